//! A thread of its own for each viewer: a slow viewer does not delay the run.

use super::*;
use crossbeam::channel::{Sender, bounded};
use rerun::log::LogMsg;
use rerun::sink::{LogSink, SinkFlushError};
use std::time::Duration;

/// Message to the thread of a viewer.
pub(super) enum Parcel {
    Message(LogMsg),
    /// Wait at most this long until everything before it has been sent, then reply.
    Flush(Duration, Sender<Result<(), SinkFlushError>>),
}

/// Number of messages that may wait, in addition to Rerun's own queue.
pub(super) const PARCELS: usize = 8;

/// A sink for viewers. Rerun's own sinks block as long as a viewer accepts no data, possibly for
/// ever. This one passes messages to a thread of its own, and gives up a viewer that accepts
/// nothing for [`VIEWER_PATIENCE`]. A slow viewer slows down the logger, whose [`Backpressure`]
/// policy decides the effect on the run.
///
/// [`Backpressure`]: crate::record::logger::Backpressure
pub(super) struct LiveSink {
    pub(super) fault: Fault,
    pub(super) line: Sender<Parcel>,
}

impl LiveSink {
    /// Starts the thread. It ends after this sink is dropped and the waiting messages are sent.
    pub(super) fn start(fault: Fault, inner: Box<dyn LogSink>) -> std::io::Result<LiveSink> {
        let (line, parcels) = bounded(PARCELS);
        std::thread::Builder::new().name("viewer".into()).spawn(move || {
            for parcel in parcels {
                match parcel {
                    Parcel::Message(message) => inner.send(message),
                    // If this fails, the receiver has gone and needs no reply.
                    Parcel::Flush(timeout, done) => {
                        let _ = done.send(inner.flush_blocking(timeout));
                    }
                }
            }
        })?;
        Ok(LiveSink { fault, line })
    }

    pub(super) fn hand_over(
        &self,
        parcel: Parcel,
        timeout: Duration,
    ) -> Result<(), SinkFlushError> {
        self.line.send_timeout(parcel, timeout).map_err(|_| {
            let seconds = timeout.as_secs_f64();
            SinkFlushError::failed(format!("it accepted no data for {seconds} s"))
        })
    }

    /// Stores an error unless there is one already.
    pub(super) fn note(&self, error: &SinkFlushError) {
        lock(&self.fault).get_or_insert_with(|| error.to_string());
    }
}

impl LogSink for LiveSink {
    fn send(&self, msg: LogMsg) {
        if lock(&self.fault).is_none()
            && let Err(error) = self.hand_over(Parcel::Message(msg), VIEWER_PATIENCE)
        {
            self.note(&error);
        }
    }

    fn flush_blocking(&self, timeout: Duration) -> Result<(), SinkFlushError> {
        if let Some(cause) = &*lock(&self.fault) {
            return Err(SinkFlushError::failed(cause.clone()));
        }
        let timeout = timeout.min(VIEWER_PATIENCE);
        let (done, flushed) = bounded(1);
        let result = self
            .hand_over(Parcel::Flush(timeout, done), timeout)
            .and_then(|()| flushed.recv_timeout(timeout).unwrap_or(Err(SinkFlushError::Timeout)));
        if let Err(error) = &result {
            self.note(error);
        }
        result
    }
}
