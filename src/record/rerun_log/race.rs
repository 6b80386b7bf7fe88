//! This module records several runs side by side on the timeline of computing time (a race).

use std::path::Path;

use super::sinks::{Destinations, Sink};
use super::{Finished, RecordError, RerunLog, blueprint};
use crate::frame::{Frame, RunInfo};
use crate::record::colour::OKABE_ITO;

/// A recording of runs that are computed one after the other and viewed together.
pub struct Race {
    lanes: Vec<RerunLog>,
}

impl Race {
    /// Starts a recording of several runs, whose names must differ. It takes the identifier of the
    /// first run.
    pub fn open(infos: &[RunInfo], title: &str, path: &Path) -> Result<Self, RecordError> {
        let mut to = Destinations::open(&[Sink::Save(path.to_owned())])?;
        let id = infos.first().map_or("race", |info| info.recording_id.as_str());
        let rec = to.begin(id)?;
        blueprint::send_race(&rec, infos)?;
        rec.send_recording_name(title)?;
        let mut lanes = Vec::new();
        for (info, color) in infos.iter().zip(OKABE_ITO.iter().cycle()) {
            let mut lane = RerunLog::of(rec.clone(), info);
            lane.constant(info)?;
            // The plot contains several runs: the colour identifies the run.
            lane.one_color(info, None, *color)?;
            lanes.push(lane);
        }
        if let Some(first) = lanes.first_mut() {
            first.files = to.files;
        }
        Ok(Self { lanes })
    }

    /// Records a frame of the run with index `lane`.
    pub fn frame(&mut self, lane: usize, frame: &Frame) -> Result<(), RecordError> {
        self.lanes.get_mut(lane).map_or(Ok(()), |lane| lane.frame(frame))
    }

    /// Ends the recording; `None` if there are no runs.
    pub fn finish(mut self) -> Result<Option<Finished>, RecordError> {
        if self.lanes.is_empty() {
            return Ok(None);
        }
        // The first log owns the file, and closes it after the others are dropped.
        let first = self.lanes.remove(0);
        drop(self.lanes);
        first.finish().map(Some)
    }
}
