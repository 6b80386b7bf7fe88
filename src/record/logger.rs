//! This module runs the logger thread, which receives frames in order over a bounded channel.

use super::rerun_log::{Finished, RecordError, RerunLog};
use crate::frame::Frame;
use crossbeam::channel::{
    Receiver, RecvTimeoutError, SendTimeoutError, Sender, TrySendError, bounded,
};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Number of frames that may wait for the logger.
const CAPACITY: usize = 8;

/// Interval at which a waiting thread checks that the logger is still running.
const LOOK_UP: Duration = Duration::from_millis(50);

/// Time after an interrupt for which a logger that does not respond (a disk that hangs) is waited
/// for.
const PATIENCE: Duration = Duration::from_secs(3);

/// Behaviour when the logger falls behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backpressure {
    /// The simulation waits, and no frame is lost. Used for recordings.
    Wait,
    /// The oldest waiting frame is dropped. Used for live viewing, where the newest frame matters.
    DropOldest,
}

/// Counts of the frames passed to the logger.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Traffic {
    /// Frames sent.
    pub frames: u64,
    /// Frames dropped.
    pub drops: u64,
    /// Frames that had to wait.
    pub waits: u64,
    /// Total waiting time.
    pub waited: Duration,
}

/// Handle of the logger thread.
pub struct Logger {
    policy: Backpressure,
    sender: Sender<Item>,
    /// The receiving end, used to remove the oldest frame. It exists only for
    /// [`Backpressure::DropOldest`], since the channel stays open as long as it exists.
    oldest: Option<Receiver<Item>>,
    thread: JoinHandle<Result<Finished, RecordError>>,
    busy_ns: Arc<AtomicU64>,
    traffic: Traffic,
    patience: Patience,
}

/// Limit on the time of waiting after an interrupt.
struct Patience {
    interrupted: Arc<AtomicBool>,
    /// When the interrupt was noticed.
    since: Option<Instant>,
}

impl Patience {
    /// Whether the time after an interrupt is over.
    fn is_over(&mut self) -> bool {
        if !self.interrupted.load(Ordering::SeqCst) {
            return false;
        }
        self.since.get_or_insert_with(Instant::now).elapsed() > PATIENCE
    }
}

/// Message to the logger thread.
enum Item {
    Frame(Box<Frame>),
    /// Flush everything received so far to the disk, then reply.
    Settle(Sender<()>),
}

/// Error: the logger thread has ended early. [`Logger::finish`] returns the cause.
#[derive(Debug)]
pub struct LoggerGone;

impl Traffic {
    /// Sum of the counts of two parts of a run.
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
    /// Starts the logger thread on an open recording. While `interrupted` is set, a logger that does
    /// not respond is given up after a few seconds.
    pub fn start(
        log: RerunLog,
        policy: Backpressure,
        interrupted: Arc<AtomicBool>,
    ) -> std::io::Result<Logger> {
        let (sender, receiver) = bounded::<Item>(CAPACITY);
        let oldest = (policy == Backpressure::DropOldest).then(|| receiver.clone());
        let busy_ns = Arc::new(AtomicU64::new(0));
        let busy = busy_ns.clone();
        let thread = std::thread::Builder::new().name("logger".into()).spawn(move || {
            let mut log = log;
            // The loop ends when the sender is dropped. An error ends it at once and closes the
            // channel, which the simulation notices when it sends its next frame.
            for item in receiver {
                let clock = Instant::now();
                match item {
                    Item::Frame(frame) => log.frame(&frame)?,
                    Item::Settle(done) => {
                        log.settle()?;
                        // If this fails, the receiver has gone and needs no reply.
                        let _ = done.send(());
                    }
                }
                busy.fetch_add(clock.elapsed().as_nanos() as u64, Ordering::Relaxed);
            }
            log.finish()
        })?;
        let patience = Patience { interrupted, since: None };
        let traffic = Traffic::default();
        Ok(Logger { policy, sender, oldest, thread, busy_ns, traffic, patience })
    }

    /// Puts a message into the channel, and waits as long as it is full.
    fn pass(&mut self, mut item: Item) -> Result<(), LoggerGone> {
        loop {
            match self.sender.send_timeout(item, LOOK_UP) {
                Ok(()) => return Ok(()),
                Err(SendTimeoutError::Disconnected(_)) => return Err(LoggerGone),
                Err(SendTimeoutError::Timeout(_)) if self.is_gone() => return Err(LoggerGone),
                Err(SendTimeoutError::Timeout(back)) => item = back,
            }
        }
    }

    /// Whether waiting for the logger is useless.
    fn is_gone(&mut self) -> bool {
        self.thread.is_finished() || self.patience.is_over()
    }

    /// Sends a frame to the logger.
    pub fn send(&mut self, frame: Frame) -> Result<(), LoggerGone> {
        self.traffic.frames += 1;
        match self.sender.try_send(Item::Frame(Box::new(frame))) {
            Ok(()) => Ok(()),
            Err(TrySendError::Disconnected(_)) => Err(LoggerGone),
            Err(TrySendError::Full(mut frame)) => match self.policy {
                Backpressure::Wait => {
                    let clock = Instant::now();
                    let sent = self.pass(frame);
                    self.traffic.waits += 1;
                    self.traffic.waited += clock.elapsed();
                    sent
                }
                Backpressure::DropOldest => loop {
                    // The channel stays open while we hold the receiver, so ask the thread.
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

    /// Counts so far, and the time that the logger was busy.
    pub fn traffic(&self) -> (Traffic, Duration) {
        (self.traffic, Duration::from_nanos(self.busy_ns.load(Ordering::Relaxed)))
    }

    /// Waits until everything sent so far is on the disk. With [`Backpressure::DropOldest`] nothing
    /// is written to the disk, and it returns at once.
    pub fn settle(&mut self) -> Result<(), LoggerGone> {
        if self.policy == Backpressure::DropOldest {
            return Ok(());
        }
        let (done, settled) = bounded(1);
        self.pass(Item::Settle(done))?;
        loop {
            match settled.recv_timeout(LOOK_UP) {
                Ok(()) => return Ok(()),
                Err(RecvTimeoutError::Disconnected) => return Err(LoggerGone),
                // The message may have entered the channel when the logger had just ended: then
                // nobody drops it.
                Err(RecvTimeoutError::Timeout) if self.is_gone() => return Err(LoggerGone),
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// Waits until everything is recorded. Returns the result, the counts and the busy time.
    pub fn finish(self) -> (Result<Finished, RecordError>, Traffic, Duration) {
        let Logger { sender, oldest, thread, busy_ns, traffic, mut patience, .. } = self;
        drop(sender);
        drop(oldest);
        let busy = || Duration::from_nanos(busy_ns.load(Ordering::Relaxed));
        while !thread.is_finished() {
            if patience.is_over() {
                return (Err(RecordError::Stuck), traffic, busy());
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        let result = match thread.join() {
            Ok(result) => result,
            Err(panic) => std::panic::resume_unwind(panic),
        };
        (result, traffic, busy())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A logger whose thread runs `work` instead of writing a recording.
    fn logger(
        interrupted: &Arc<AtomicBool>,
        work: impl FnOnce(Receiver<Item>) + Send + 'static,
    ) -> Logger {
        let (sender, receiver) = bounded::<Item>(CAPACITY);
        let thread = std::thread::spawn(move || {
            work(receiver);
            Err(RecordError::Stuck)
        });
        Logger {
            policy: Backpressure::Wait,
            sender,
            oldest: None,
            thread,
            busy_ns: Arc::default(),
            traffic: Traffic::default(),
            patience: Patience { interrupted: interrupted.clone(), since: None },
        }
    }

    #[test]
    fn a_logger_that_died_is_not_waited_for() {
        // The message to settle is still in the channel, and its receiver is never dropped.
        let clock = Instant::now();
        let mut dead = logger(&Arc::default(), std::mem::forget);
        assert!(dead.settle().is_err());
        assert!(dead.finish().0.is_err());
        // The channel is full.
        let mut dead = logger(&Arc::default(), std::mem::forget);
        let sent = (0..=CAPACITY).try_for_each(|_| dead.send(Frame::default()));
        assert!(sent.is_err());
        assert!(clock.elapsed() < Duration::from_secs(5));
    }

    #[test]
    fn after_an_interrupt_a_logger_that_hangs_is_given_up() {
        let interrupted = Arc::new(AtomicBool::new(false));
        let mut stuck = logger(&interrupted, |_channel| std::thread::sleep(Duration::MAX));
        interrupted.store(true, Ordering::SeqCst);
        let clock = Instant::now();
        assert!(stuck.settle().is_err());
        assert!(stuck.finish().0.is_err());
        assert!(clock.elapsed() < 2 * PATIENCE);
    }
}
