//! This module reads a run back from its folder, a recording or a summary.

use super::summary::{Summary, read};
use super::table::{SECONDS, Table};
use super::{ResultsError, later};
use crate::frame::RunInfo;
use crate::record::folder::FILES;
use crate::record::info::run_info;
use crate::record::rerun_log::Recorded;
use crate::scene::{self, Geometry, SceneSource, scene_hash};
use indexmap::IndexMap;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Kind of data from which a run was read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A folder with `series.csv`.
    Folder,
    /// A recording without a folder.
    Recording,
    /// A summary alone, which has values at the end only.
    Summary,
}

/// A run that was read.
pub struct Member {
    /// Name of the run, unique among those that were opened together.
    pub name: String,
    /// Path of its folder or file.
    pub path: PathBuf,
    /// Kind of data from which it was read.
    pub kind: Kind,
    /// Simulated time at the end (s).
    pub end: f64,
    /// The series; `None` for a summary alone.
    pub table: Option<Table>,
    /// The resolved scene, as TOML; `None` if unknown.
    pub scene_toml: Option<String>,
    /// Constant part of a recording of the scene; `None` if the scene is unknown.
    pub info: Option<RunInfo>,
    /// The recording; `None` if there is none.
    pub recorded: Option<Recorded>,
    /// Messages about missing or incomplete data.
    pub notes: Vec<String>,
    summary: Option<Summary>,
    scene: Option<(String, String)>,
}

impl Member {
    /// Geometry of the scene, on which units depend; the plane if the scene is unknown.
    pub fn geometry(&self) -> Geometry {
        let round = self.info.as_ref().is_some_and(|info| info.round);
        if round { Geometry::Axisymmetric } else { Geometry::Plane }
    }
}

/// Reads runs and gives them different names.
pub fn open_all(paths: &[PathBuf]) -> Result<Vec<Member>, ResultsError> {
    if paths.len() < 2 {
        return Err(ResultsError::Usage(
            "one run alone cannot be compared; give two or more: grainscope compare runs/silo \
             runs/silo-2"
                .into(),
        ));
    }
    open_each(paths)
}

/// Reads one or more runs and gives them different names.
pub fn open_each(paths: &[PathBuf]) -> Result<Vec<Member>, ResultsError> {
    let mut members: Vec<Member> = vec![];
    for path in paths {
        let member = Member::open(path)?;
        let place = |m: &Member| std::fs::canonicalize(&m.path).unwrap_or(m.path.clone());
        if let Some(twin) = members.iter().find(|m| place(m) == place(&member)) {
            return Err(ResultsError::Usage(format!(
                "{} and {} are the same run; give two different ones",
                twin.path.display(),
                path.display()
            )));
        }
        members.push(member);
    }
    for k in 1..members.len() {
        let taken = |name: &str| members[..k].iter().any(|m| m.name == name);
        if taken(&members[k].name) {
            let name = members[k].name.clone();
            let fresh = (2..).map(|n| format!("{name} ({n})")).find(|name| !taken(name));
            members[k].rename(&fresh.unwrap_or(name));
        }
    }
    Ok(members)
}

impl Member {
    /// Reads a run from its folder, from a file in its folder, or from a recording or summary.
    pub fn open(path: &Path) -> Result<Member, ResultsError> {
        if path.is_dir() {
            return Self::folder(path);
        }
        if !path.is_file() {
            return Err(ResultsError::Missing(path.to_owned()));
        }
        let file = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let beside = path.parent().unwrap_or(Path::new("")).join("series.csv");
        if FILES.contains(&file.as_str()) && beside.is_file() {
            let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
            return Self::folder(folder.unwrap_or(Path::new(".")));
        }
        match path.extension().and_then(|e| e.to_str()) {
            Some("rrd") => Self::recording(path),
            Some("json") => Self::golden(path),
            _ => Err(ResultsError::Unknown(path.to_owned())),
        }
    }

    fn folder(folder: &Path) -> Result<Member, ResultsError> {
        let file = |name: &str| Some(folder.join(name)).filter(|p| p.is_file());
        let Some(series) = file("series.csv") else {
            return match (file("recording.rrd"), file("summary.json")) {
                (Some(recording), _) => Self::recording(&recording),
                (None, Some(summary)) => Self::golden(&summary),
                (None, None) => Err(ResultsError::NoRun(folder.to_owned())),
            };
        };
        let broken = |cause| ResultsError::Broken { path: series.clone(), cause };
        let table = Table::parse(&read(&series)?).map_err(broken)?;
        let mut member = Member {
            name: folder_name(folder),
            path: folder.to_owned(),
            kind: Kind::Folder,
            end: table.end(),
            table: Some(table),
            scene_toml: file("scene.toml").map(|p| read(&p)).transpose()?,
            info: None,
            recorded: None,
            notes: vec![],
            summary: file("summary.json").map(|p| Summary::read(&p)).transpose()?,
            scene: None,
        };
        member.note_ending();
        let elsewhere = member.summary.as_ref().and_then(|s| s.recording.clone());
        let recording = file("recording.rrd").or(elsewhere.filter(|p| p.is_file()));
        if let Some(recording) = recording {
            match Recorded::open(&recording) {
                Ok(recorded) => member.take(recorded),
                // The values come from the series; only the pictures are missing.
                Err(e) => member.notes.push(format!("{e}; the run is compared without pictures")),
            }
        }
        member.resolve()?;
        Ok(member)
    }

    fn recording(path: &Path) -> Result<Member, ResultsError> {
        let recorded = Recorded::open(path)?;
        let broken =
            |cause: &str| ResultsError::Broken { path: path.to_owned(), cause: cause.into() };
        let table = Table::of_recording(&recorded.curves())
            .ok_or_else(|| broken("the recording holds no series; was it cut at the start?"))?;
        let mut member = Member {
            name: match path.file_stem().map(|s| s.to_string_lossy()) {
                Some(stem) if stem != "recording" => stem.into_owned(),
                _ => recorded.run.clone(),
            },
            path: path.to_owned(),
            kind: Kind::Recording,
            end: table.end(),
            table: Some(table),
            scene_toml: recorded.scene_toml(),
            info: None,
            recorded: None,
            notes: vec![],
            summary: None,
            scene: None,
        };
        member.take(recorded);
        member.resolve()?;
        Ok(member)
    }

    fn golden(path: &Path) -> Result<Member, ResultsError> {
        let summary = Summary::read(path)?;
        let beside = path.parent().unwrap_or(Path::new("")).join("scene.toml");
        let named = path.file_stem().is_some_and(|s| s != "summary");
        let mut member = Member {
            name: if named {
                path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
            } else {
                folder_name(path.parent().unwrap_or(Path::new("")))
            },
            path: path.to_owned(),
            kind: Kind::Summary,
            end: summary.time,
            table: None,
            scene_toml: (!named && beside.is_file()).then(|| read(&beside)).transpose()?,
            info: None,
            recorded: None,
            notes: vec![],
            summary: Some(summary),
            scene: None,
        };
        member.note_ending();
        member.resolve()?;
        Ok(member)
    }

    fn note_ending(&mut self) {
        match &self.summary {
            Some(s) if s.ending != "finished" => self.notes.push(format!(
                "{} did not finish ({}{})",
                self.name,
                s.ending.replace('_', " "),
                s.error.as_ref().map_or(String::new(), |e| format!(": {e}"))
            )),
            None => self.notes.push(format!(
                "{} has no summary.json: it was killed or is still running",
                self.name
            )),
            _ => {}
        }
    }

    fn take(&mut self, recorded: Recorded) {
        if let Some(cause) = &recorded.cut {
            self.notes.push(format!(
                "the recording of {} is cut ({cause}); the part before the cut is compared",
                self.name
            ));
        }
        self.recorded = Some(recorded);
    }

    /// Resolves the scene: domain, walls and plots.
    fn resolve(&mut self) -> Result<(), ResultsError> {
        let Some(text) = &self.scene_toml else { return Ok(()) };
        let source = SceneSource::new(format!("scene of {}", self.path.display()), text.as_str());
        let scene = scene::parse(&source)?;
        let plan = crate::plan::resolve(&scene).map_err(|e| e.with_source(&source))?;
        self.scene = Some((scene.name.clone(), scene_hash(&scene)));
        self.info = Some(run_info(&plan, &self.name));
        Ok(())
    }

    /// Renames the run.
    pub fn rename(&mut self, name: &str) {
        self.name = name.to_owned();
        if let Some(info) = &mut self.info {
            info.name = name.to_owned();
        }
    }

    /// Text of `summary.json`; `None` if there is none.
    pub fn summary_text(&self) -> Option<&str> {
        self.summary.as_ref().map(|s| s.text.as_str())
    }

    /// SHA-256 of the final state, hexadecimal; `None` if unknown.
    pub fn state_hash(&self) -> Option<&str> {
        self.summary.as_ref().map(|s| s.state_hash.as_str())
    }

    /// Name and hash of the scene; `None` if unknown.
    pub fn scene(&self) -> Option<(String, String)> {
        let known = self.summary.as_ref().map(|s| (s.scene.clone(), s.scene_hash.clone()));
        known.or(self.scene.clone())
    }

    /// Values at a time; `None` if they are unknown there.
    pub fn values_at(&self, time: f64) -> Option<IndexMap<String, f64>> {
        let mut values = IndexMap::from([("end".to_string(), self.end)]);
        match &self.table {
            Some(table) => {
                for (name, column) in &table.columns {
                    let value = table.at(column, time).filter(|v| !v.is_nan());
                    if let (Some(value), false) = (value, name == "time" || name == "dt") {
                        values.insert(name.clone(), value);
                    }
                }
                // The computing time comes last: it depends on the machine.
                if let Some(seconds) = values.shift_remove(SECONDS) {
                    values.insert(SECONDS.into(), seconds);
                }
            }
            None if later(self.end, time) => return None,
            None => values.extend(self.summary.as_ref()?.values()),
        }
        Some(values)
    }
}

/// Name of a folder, also for `.`.
fn folder_name(folder: &Path) -> String {
    let name = |path: &Path| path.file_name().map(|n| n.to_string_lossy().into_owned());
    name(folder)
        .or_else(|| name(&std::fs::canonicalize(folder).ok()?))
        .unwrap_or_else(|| "run".to_owned())
}
