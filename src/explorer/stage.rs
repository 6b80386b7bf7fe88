//! What the viewer shows: the run, and pinned ones beside it.

use super::film::Film;
use super::live::Live;
use super::protocol::{PinState, Stream};
use crate::frame::{Frame, RunInfo};
use crate::record::logger::{Backpressure, Logger};
use crate::record::rerun_log::{Lane, RecordError, RerunLog, Sink};
use std::sync::Arc;

/// Most runs that are pinned at a time: each keeps its pictures.
pub const MOST_PINS: usize = 6;

/// A run that is kept as it was.
pub struct Pin {
    pub state: PinState,
    pub info: RunInfo,
    pub film: Film,
}

/// A recording that is being shown.
pub struct Stage {
    pub stream: Stream,
    logger: Logger,
}

impl Stage {
    /// Opens a recording of a run so far, beside the pins; `number` tells it from others.
    pub fn open(pins: &[Pin], live: &Live, number: u64) -> Result<Stage, RecordError> {
        let mut info = live.info.clone();
        info.recording_id = format!("{}-{number}", info.recording_id);
        if !pins.is_empty() {
            info.name = format!("{} (now)", info.name);
        }
        let lanes: Vec<Lane> =
            pins.iter().map(|p| Lane { info: &p.info, frames: p.film.frames() }).collect();
        let run = Lane { info: &info, frames: live.film.frames() };
        let log = RerunLog::beside(&lanes, &run, &[Sink::Stream])?;
        let url = log.url().unwrap_or_default().to_string();
        let logger = Logger::start(log, Backpressure::DropOldest)
            .map_err(|e| RecordError::Viewer { name: "logger".into(), cause: e.to_string() })?;
        Ok(Stage { stream: Stream { url, recording: info.recording_id }, logger })
    }

    /// Shows a frame; `false` if nobody can see it any more.
    pub fn show(&mut self, frame: &Arc<Frame>) -> bool {
        self.logger.send(Frame::clone(frame)).is_ok()
    }

    /// Ends the recording, and says what went wrong with it.
    pub fn close(self) -> Option<RecordError> {
        self.logger.finish().0.err()
    }
}
