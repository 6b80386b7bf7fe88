//! This module records a running simulation beside pinned earlier runs on one time cursor.

use std::sync::Arc;

use super::sinks::{Destinations, Sink};
use super::{RecordError, RerunLog, blueprint};
use crate::frame::{Frame, RunInfo};

/// A run and its frames so far.
pub struct Lane<'a> {
    /// Constant part of the recording. Its name must differ from those of the other runs.
    pub info: &'a RunInfo,
    /// Frames in order.
    pub frames: &'a [Arc<Frame>],
}

impl RerunLog {
    /// Starts a recording of a running simulation beside runs that have ended.
    pub fn beside(others: &[Lane], run: &Lane, sinks: &[Sink]) -> Result<Self, RecordError> {
        let mut to = Destinations::open(sinks)?;
        let rec = to.begin(&run.info.recording_id)?;
        let infos: Vec<&RunInfo> = others.iter().chain([run]).map(|lane| lane.info).collect();
        blueprint::send_stage(&rec, &infos)?;
        rec.send_recording_name(run.info.name.as_str())?;
        for lane in others {
            let mut log = Self::of(rec.clone(), lane.info);
            log.constant(lane.info)?;
            log.replay(lane)?;
        }
        let mut log = Self::of(rec, run.info).towards(to, run.info)?;
        log.replay(run)?;
        Ok(log)
    }

    fn replay(&mut self, lane: &Lane) -> Result<(), RecordError> {
        lane.frames.iter().try_for_each(|frame| self.frame(frame))
    }
}
