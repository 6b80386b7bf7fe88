//! This module streams the run, and pinned runs beside it, to the viewer.

use super::frame_buffer::FrameBuffer;
use super::live::Live;
use super::protocol::{PinState, Stream};
use super::status::Status;
use crate::frame::{Frame, RunInfo};
use crate::record::logger::{Backpressure, Logger};
use crate::record::rerun_log::{Lane, RecordError, RerunLog, Sink};
use std::sync::Arc;

/// Maximum number of pinned runs: each keeps its pictures in memory.
pub const MOST_PINS: usize = 6;

/// A pinned run: a copy of a run at the time of pinning.
pub struct Pin {
    /// State shown on the page.
    pub state: PinState,
    /// Constant part of its recording.
    pub info: RunInfo,
    /// Its frames.
    pub frames: FrameBuffer,
}

/// A recording that the viewer shows.
pub struct Stage {
    /// Address of the recording.
    pub stream: Stream,
    /// Name of its stream.
    name: String,
    logger: Logger,
}

impl Stage {
    /// Opens a recording of the run so far, beside the pinned runs; `number` makes its identifier
    /// unique.
    pub fn open(
        pins: &[Pin],
        live: &Live,
        number: u64,
        status: &Status,
    ) -> Result<Stage, RecordError> {
        let mut info = live.info.clone();
        info.recording_id = format!("{}-{number}", info.recording_id);
        if !pins.is_empty() {
            info.name = format!("{} (now)", info.name);
        }
        let lanes: Vec<Lane> =
            pins.iter().map(|p| Lane { info: &p.info, frames: p.frames.frames() }).collect();
        let run = Lane { info: &info, frames: live.frames.frames() };
        let log = RerunLog::beside(&lanes, &run, &[Sink::Stream])?;
        let name = format!("{number}.rrd");
        let url = log.stream().map_or(String::new(), |stream| status.show(&name, stream));
        let logger = Logger::start(log, Backpressure::DropOldest, Arc::default())
            .map_err(|e| RecordError::Viewer { name: "logger".into(), cause: e.to_string() })?;
        Ok(Stage { stream: Stream { url, recording: info.recording_id }, name, logger })
    }

    /// Sends a frame; `false` if the recording has ended.
    pub fn show(&mut self, frame: &Arc<Frame>) -> bool {
        self.logger.send(Frame::clone(frame)).is_ok()
    }

    /// Ends the recording; returns its error, if any.
    pub fn close(self, status: &Status) -> Option<RecordError> {
        status.hide(&self.name);
        self.logger.finish().0.err()
    }
}
