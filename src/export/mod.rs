//! This module exports the pictures of a recording: VTK files (ParaView), CSV and Parquet tables.
//!
//! Each frame has a file with the particles and a file with the fields, with the same number.

mod columns;
mod tables;
mod vtu;

use crate::frame::{GridField, ParticleSnapshot, SurfaceStress};
use crate::record::replace::{self, Kind, ReplaceError};
use crate::results::table::Table;
use crate::results::{Member, ResultsError, SAME_TIME};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Error of exporting a recording.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The run cannot be read.
    #[error(transparent)]
    Run(#[from] ResultsError),
    /// The run has no recording.
    #[error("{}: has no recording to export; run the scene again without --no-recording", .0.display())]
    NoRecording(PathBuf),
    /// The recording has no pictures.
    #[error("{}: its recording has no pictures", .0.display())]
    NoPictures(PathBuf),
    /// A file is in the way, or cannot be written.
    #[error(transparent)]
    Replace(#[from] ReplaceError),
    /// A table cannot be encoded.
    #[error("{} cannot be encoded: {source}", path.display())]
    Encode {
        /// Path of the table.
        path: PathBuf,
        /// Error of the encoder.
        source: parquet::errors::ParquetError,
    },
    /// The folder cannot be made.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// Path of the folder.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
}

/// File format of an export.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// VTK unstructured grids (`.vtu`) and a `.pvd` index of them.
    Vtu,
    /// Comma-separated tables.
    Csv,
    /// Parquet tables, for data frames.
    Parquet,
}

/// Particles and fields at one instant.
#[derive(Clone, Debug, Default)]
pub struct Instant {
    /// Simulated time (s).
    pub time_s: f64,
    /// Particles, if recorded at this time.
    pub particles: Option<ParticleSnapshot>,
    /// Fields, all on the grid of the first one.
    pub fields: Vec<GridField>,
    /// Stresses along surfaces.
    pub stresses: Vec<SurfaceStress>,
}

/// All pictures of a run.
#[derive(Clone, Debug, Default)]
pub struct Frames {
    /// Instants in order of time.
    pub instants: Vec<Instant>,
    /// Material names; the class of a particle is an index into them.
    pub materials: Vec<String>,
    /// The series of the run; `None` if there is none.
    pub series: Option<Table>,
    /// Whether the flow is round: x is the distance from the axis.
    pub round: bool,
}

/// Reads the pictures of a run from its folder or a recording.
pub fn read(run: &Path) -> Result<Frames, ExportError> {
    let member = Member::open(run)?;
    let (Some(recorded), Some(info)) = (&member.recorded, &member.info) else {
        return Err(ExportError::NoRecording(run.to_owned()));
    };
    let mut frames = Frames {
        materials: info.materials.iter().map(|m| m.name.clone()).collect(),
        series: member.table.clone(),
        round: info.round,
        ..Frames::default()
    };
    for (time, particles) in recorded.particles() {
        frames.at(time).particles = Some(particles);
    }
    let fields: BTreeMap<_, _> = recorded.fields(info.domain);
    for (time, field) in fields.into_values().flatten() {
        let fields = &mut frames.at(time).fields;
        let alike = match fields.first() {
            Some(first) => field.on(first.rect(), first.nx, first.ny),
            None => field,
        };
        fields.push(alike);
    }
    for (time, surface) in recorded.stresses() {
        frames.at(time).stresses.push(surface);
    }
    if frames.instants.is_empty() {
        return Err(ExportError::NoPictures(run.to_owned()));
    }
    Ok(frames)
}

/// Writes all pictures into a folder, and removes the later pictures of an earlier export of the same format.
/// Returns the number of files.
pub fn write(frames: &Frames, format: Format, folder: &Path) -> Result<usize, ExportError> {
    let fault = |source| ExportError::Write { path: folder.to_owned(), source };
    std::fs::create_dir_all(folder).map_err(fault)?;
    let files = match format {
        Format::Vtu => vtu::write(frames, folder)?,
        Format::Csv => tables::write(frames, folder)?,
        Format::Parquet => return columns::write(frames, folder),
    };
    for entry in std::fs::read_dir(folder).map_err(fault)? {
        let path = entry.map_err(fault)?.path();
        let number = path.file_name().and_then(|name| number(name.to_str()?, format));
        let stale = number.is_some_and(|n| n >= frames.instants.len());
        // Other files with such names are not ours.
        let ours = || {
            let kinds = [Kind::Vtk, Kind::Table("x,y,"), Kind::Table("surface,along,")];
            kinds.into_iter().any(|kind| replace::may_replace(&path, kind).is_ok())
        };
        if stale && ours() {
            std::fs::remove_file(&path).map_err(fault)?;
        }
    }
    Ok(files)
}

/// Number of the picture in the name of a file that an export writes.
fn number(name: &str, format: Format) -> Option<usize> {
    let extension = if format == Format::Vtu { ".vtu" } else { ".csv" };
    let (group, digits) = name.strip_suffix(extension)?.rsplit_once('_')?;
    let known = ["particles", "fields", "stresses"].contains(&group) && digits.len() >= 5;
    digits.parse().ok().filter(|_| known && digits.bytes().all(|b| b.is_ascii_digit()))
}

/// Writes a VTK file or a table.
fn write_file(path: PathBuf, text: impl AsRef<[u8]>) -> Result<(), ExportError> {
    let text = text.as_ref();
    let header = text.split(|&b| b == b'\n').next().unwrap_or_default();
    let header = String::from_utf8_lossy(header);
    let table = path.extension().is_some_and(|e| e == "csv");
    let kind = if table { Kind::Table(&header) } else { Kind::Vtk };
    Ok(replace::write(&path, text, kind)?)
}

impl Frames {
    /// The instant at a time, created if it does not exist.
    fn at(&mut self, time_s: f64) -> &mut Instant {
        let before = time_s - SAME_TIME * time_s.abs();
        let k = self.instants.partition_point(|i| i.time_s < before);
        let same = |i: &Instant| i.time_s <= time_s + SAME_TIME * time_s.abs();
        if !self.instants.get(k).is_some_and(same) {
            self.instants.insert(k, Instant { time_s, ..Instant::default() });
        }
        &mut self.instants[k]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_of_a_longer_export_are_removed_and_other_files_are_not() {
        let folder = crate::testing::TempFolder::new().expect("a folder");
        let frames = |n: usize| Frames {
            instants: (0..n)
                .map(|k| Instant {
                    time_s: k as f64,
                    particles: Some(ParticleSnapshot {
                        positions: vec![[0.0, 1.0]],
                        class: vec![0],
                        ..ParticleSnapshot::default()
                    }),
                    ..Instant::default()
                })
                .collect(),
            materials: vec!["mud".into()],
            ..Frames::default()
        };
        let here = |name: &str| folder.path().join(name);
        for format in [Format::Csv, Format::Vtu] {
            write(&frames(4), format, folder.path()).expect("written");
        }
        std::fs::write(here("particles_00009.csv"), "mine\n").expect("written");
        write(&frames(2), Format::Csv, folder.path()).expect("written");
        let there = |n: usize, end: &str| here(&format!("particles_{n:05}.{end}")).exists();
        assert_eq!([0, 1, 2, 3].map(|n| there(n, "csv")), [true, true, false, false]);
        assert!(there(3, "vtu") && there(9, "csv"));
    }
}
