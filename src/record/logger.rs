//! The logger thread: frames arrive over a bounded channel, in order.

use super::rerun_log::{Finished, RecordError, RerunLog};
use crate::frame::Frame;
use crossbeam::channel::{Receiver, Sender, TrySendError, bounded};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Frames that may wait for the logger.
const CAPACITY: usize = 8;

/// What to do when the logger is behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backpressure {
    /// The simulation waits: nothing is lost. For recordings.
    Wait,
    /// The oldest waiting frame is dropped: the newest matters. For watching.
    DropOldest,
}

/// How often the two threads met.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Traffic {
    pub frames: u64,
    pub drops: u64,
    /// Frames that had to wait, and how long in all.
    pub waits: u64,
    pub waited: Duration,
}

/// Handle of the logger thread.
pub struct Logger {
    policy: Backpressure,
    sender: Sender<Item>,
    /// The other end, to take the oldest frame out; only for [`Backpressure::DropOldest`], since
    /// the channel never closes while it exists.
    oldest: Option<Receiver<Item>>,
    thread: JoinHandle<Result<Finished, RecordError>>,
    busy_ns: Arc<AtomicU64>,
    traffic: Traffic,
}

/// What the thread is asked to do.
enum Item {
    Frame(Box<Frame>),
    /// Bring everything so far to the disk, and say so.
    Settle(Sender<()>),
}

/// The logger ended early; [`Logger::finish`] says why.
#[derive(Debug)]
pub struct LoggerGone;

impl Traffic {
    /// That of two parts of a run.
    pub fn and(self, o: Traffic) -> Traffic {
        Traffic {
            frames: self.frames + o.frames,
            drops: self.drops + o.drops,
            waits: self.waits + o.waits,
            waited: self.waited + o.waited,
        }
    }
}

impl Logger {
    /// Starts the thread on an open recording.
    pub fn start(log: RerunLog, policy: Backpressure) -> std::io::Result<Logger> {
        let (sender, receiver) = bounded::<Item>(CAPACITY);
        let oldest = (policy == Backpressure::DropOldest).then(|| receiver.clone());
        let busy_ns = Arc::new(AtomicU64::new(0));
        let busy = busy_ns.clone();
        let thread = std::thread::Builder::new().name("logger".into()).spawn(move || {
            let mut log = log;
            // Ends when the sender is dropped. A fault ends it at once and closes the channel: the
            // simulation hears of it with its next frame.
            for item in receiver {
                let clock = Instant::now();
                match item {
                    Item::Frame(frame) => log.frame(&frame)?,
                    Item::Settle(done) => {
                        log.settle()?;
                        // Nobody waits any more if this fails.
                        let _ = done.send(());
                    }
                }
                busy.fetch_add(clock.elapsed().as_nanos() as u64, Ordering::Relaxed);
            }
            log.finish()
        })?;
        Ok(Logger { policy, sender, oldest, thread, busy_ns, traffic: Traffic::default() })
    }

    pub fn send(&mut self, frame: Frame) -> Result<(), LoggerGone> {
        self.traffic.frames += 1;
        match self.sender.try_send(Item::Frame(Box::new(frame))) {
            Ok(()) => Ok(()),
            Err(TrySendError::Disconnected(_)) => Err(LoggerGone),
            Err(TrySendError::Full(mut frame)) => match self.policy {
                Backpressure::Wait => {
                    let clock = Instant::now();
                    let sent = self.sender.send(frame).map_err(|_| LoggerGone);
                    self.traffic.waits += 1;
                    self.traffic.waited += clock.elapsed();
                    sent
                }
                Backpressure::DropOldest => loop {
                    // With the other end in our hands the channel stays open: ask the thread.
                    if self.thread.is_finished() {
                        return Err(LoggerGone);
                    }
                    if self.oldest.as_ref().is_some_and(|o| o.try_recv().is_ok()) {
                        self.traffic.drops += 1;
                    }
                    match self.sender.try_send(frame) {
                        Ok(()) => return Ok(()),
                        Err(TrySendError::Full(f)) => frame = f,
                        Err(TrySendError::Disconnected(_)) => return Err(LoggerGone),
                    }
                },
            },
        }
    }

    /// How often the two threads have met so far, and how long this one was busy.
    pub fn traffic(&self) -> (Traffic, Duration) {
        (self.traffic, Duration::from_nanos(self.busy_ns.load(Ordering::Relaxed)))
    }

    /// Waits until everything sent so far is on the disk. Where frames may be dropped nothing is kept
    /// there.
    pub fn settle(&mut self) -> Result<(), LoggerGone> {
        if self.policy == Backpressure::DropOldest {
            return Ok(());
        }
        let (done, settled) = bounded(1);
        self.sender.send(Item::Settle(done)).map_err(|_| LoggerGone)?;
        settled.recv().map_err(|_| LoggerGone)
    }

    /// Waits until everything is recorded.
    pub fn finish(self) -> (Result<Finished, RecordError>, Traffic, Duration) {
        let Logger { sender, oldest, thread, busy_ns, traffic, .. } = self;
        drop(sender);
        drop(oldest);
        let result = match thread.join() {
            Ok(result) => result,
            Err(panic) => std::panic::resume_unwind(panic),
        };
        (result, traffic, Duration::from_nanos(busy_ns.load(Ordering::Relaxed)))
    }
}
