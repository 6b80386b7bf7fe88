//! This module combines the recordings of several runs in one recording with one time cursor: a
//! view of each run, overlaid curves, and differences of the fields.

use rerun::{EntityPath, EntityPathPart, archetypes};

use super::sinks::{Destinations, Sink};
use super::{Finished, Paths, RecordError, Recorded, RerunLog, SIM_TIME, blueprint};
use crate::frame::{GridField, RunInfo};
use crate::record::colour::OKABE_ITO;

/// Delay of the clear after the last difference (s), so that the difference at the end stays
/// visible.
const AFTER: f64 = 1e-9;

/// Root path of the entities of differences.
const DIFFERENCES: &str = "differences";

/// A run to be shown, under the name in its [`RunInfo`].
pub struct RecordedRun<'a> {
    /// Constant part of the recording.
    pub info: RunInfo,
    /// The recording.
    pub recorded: &'a Recorded,
}

/// Fields of one run minus those of another run.
pub struct Difference {
    /// Names of both runs, their common domain, walls, and the fields.
    pub info: RunInfo,
    /// Time (s) and fields at that time.
    pub frames: Vec<(f64, Vec<GridField>)>,
    /// Time after which there is no difference because one of the runs has ended (s).
    pub ends: Option<f64>,
}

/// Identifier, title and texts of a comparison.
pub struct SideBySide<'a> {
    /// Identifier of the recording.
    pub id: &'a str,
    /// Title of the recording.
    pub title: &'a str,
    /// Title and Markdown of each text panel.
    pub texts: &'a [(&'a str, String)],
}

impl SideBySide<'_> {
    /// Writes the recording. If a page is served, it is served until the result is dropped.
    pub fn write(
        &self,
        lanes: &[RecordedRun],
        differences: &[Difference],
        sinks: &[Sink],
    ) -> Result<Finished, RecordError> {
        let mut to = Destinations::open(sinks)?;
        let rec = to.begin(self.id)?;
        let pairs: Vec<(&RunInfo, Paths)> =
            differences.iter().map(|d| (&d.info, difference_paths(&d.info))).collect();
        let texts: Vec<(&str, EntityPath)> =
            self.texts.iter().map(|(title, _)| (*title, text_path(title))).collect();
        let infos: Vec<&RunInfo> = lanes.iter().map(|lane| &lane.info).collect();
        blueprint::send_comparison(&rec, self.id, &infos, &pairs, &texts)?;
        rec.send_recording_name(self.title)?;
        for (title, text) in self.texts {
            rec.log_static(
                text_path(title),
                &archetypes::TextDocument::from_markdown(text.as_str()),
            )?;
        }

        let mut all = RerunLog::of(rec.clone(), &RunInfo::default());
        (all.files, all.viewers, all.page) = (to.files, to.viewers, to.page);
        for (lane, color) in lanes.iter().zip(OKABE_ITO.iter().cycle()) {
            let log = RerunLog::of(rec.clone(), &lane.info);
            for (chunk, path) in lane.recorded.of_run() {
                // Field values are needed only for the comparison, which is complete.
                if path.last().is_some_and(|part| part == "values") {
                    continue;
                }
                let path = path.into_iter().map(EntityPathPart::new).collect();
                let path = log.paths.root.join(&EntityPath::new(path));
                rec.send_chunk(chunk.clone_with_new_entity_path(path));
            }
            log.one_color(&lane.info, Some(&lane.info.name), *color)?;
        }
        for difference in differences {
            let mut log = RerunLog::of(rec.clone(), &difference.info);
            log.paths = difference_paths(&difference.info);
            log.world(&difference.info)?;
            for (time, fields) in &difference.frames {
                rec.reset_time();
                rec.set_duration_secs(SIM_TIME, *time);
                fields.iter().try_for_each(|field| log.field(field))?;
            }
            if let Some(end) = difference.ends {
                rec.reset_time();
                rec.set_duration_secs(SIM_TIME, end + AFTER);
                for field in &difference.info.fields {
                    let image = log.paths.field(&field.name).join(&"image".into());
                    rec.log(image, &archetypes::Clear::flat())?;
                }
            }
        }
        let pictures = lanes.len() as u64;
        let finished = all.finish()?;
        Ok(Finished { pictures, ..finished })
    }
}

fn difference_paths(info: &RunInfo) -> Paths {
    Paths::below(DIFFERENCES, &info.name)
}

fn text_path(title: &str) -> EntityPath {
    EntityPath::new(["comparison", title].map(|part| EntityPathPart::new(part.to_owned())).to_vec())
}
