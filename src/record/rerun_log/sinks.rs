//! This module implements the destinations of a recording and detects their errors.
//!
//! Rerun logs asynchronously and does not report a full disk. Here each destination keeps its first
//! error. An error of a viewer is an error of the recording only if no other destination is left.

mod live;
mod page;

use live::LiveSink;
pub(super) use page::Page;
use page::StreamSink;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rerun::external::re_build_info::CrateVersion;
use rerun::external::re_log_encoding::{Encoder, EncodingOptions};
use rerun::external::re_uri;
use rerun::log::LogMsg;
use rerun::sink::{GrpcSink, LogSink, SinkFlushError};

use rerun::RecordingStream;

use super::{APPLICATION, FILE_TICK, RecordError};
use crate::record::replace::{Kind, may_replace};
use crate::web::stream::Stream;

/// Time after which a viewer that accepts no data is given up.
const VIEWER_PATIENCE: Duration = Duration::from_secs(5);

/// A destination of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Sink {
    /// An `.rrd` file.
    Save(PathBuf),
    /// A running viewer, by its address, such as `rerun+http://127.0.0.1:9876/proxy`.
    Connect(String),
    /// A page served by this process, to this machine only.
    Serve {
        /// Port of the page; 0 takes any free port.
        port: u16,
    },
    /// A stream of bytes, which another part of the program serves.
    Stream,
    /// The `rerun` viewer found on `PATH`, started now.
    Spawn,
}

/// First error of a destination, shared between its sink and the recorder.
type Fault = Arc<Mutex<Option<String>>>;

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// An `.rrd` file. Rerun's own `FileSink` writes the same bytes, but reports errors only in the
/// log.
#[derive(Clone)]
pub(super) struct RrdFile {
    path: PathBuf,
    encoder: Arc<Mutex<Encoder<File>>>,
    /// The same file, used to flush it to the disk.
    handle: Arc<File>,
    fault: Fault,
}

impl RrdFile {
    /// Creates the file and writes its header.
    pub(super) fn create(path: &Path) -> Result<Self, RecordError> {
        let failed = |cause: String| RecordError::Write { path: path.to_owned(), cause };
        may_replace(path, Kind::Recording)?;
        let file = File::create(path).map_err(|e| failed(e.to_string()))?;
        let handle = file.try_clone().map_err(|e| failed(e.to_string()))?;
        let encoder =
            Encoder::new_eager(CrateVersion::LOCAL, EncodingOptions::PROTOBUF_COMPRESSED, file)
                .map_err(|e| failed(e.to_string()))?;
        Ok(Self {
            path: path.to_owned(),
            encoder: Arc::new(Mutex::new(encoder)),
            handle: Arc::new(handle),
            fault: Fault::default(),
        })
    }

    /// The first error of the file, if any.
    pub(super) fn check(&self) -> Result<(), RecordError> {
        match lock(&self.fault).clone() {
            None => Ok(()),
            Some(cause) => Err(RecordError::Write { path: self.path.clone(), cause }),
        }
    }

    /// The error of a file that accepts no more data without giving a cause.
    pub(super) fn late(&self) -> RecordError {
        RecordError::Write {
            path: self.path.clone(),
            cause: "the disk does not respond".to_owned(),
        }
    }

    /// Writes the footer. It must be called after the last message.
    pub(super) fn finish(&self) -> Result<Saved, RecordError> {
        self.check()?;
        let failed = |cause: String| RecordError::Write { path: self.path.clone(), cause };
        let mut encoder = lock(&self.encoder);
        encoder.finish().map_err(|e| failed(e.to_string()))?;
        encoder.flush_blocking().map_err(|e| failed(e.to_string()))?;
        self.finished()
    }

    /// Path and size of the file as it is now.
    pub(super) fn finished(&self) -> Result<Saved, RecordError> {
        let size = std::fs::metadata(&self.path).map_err(|e| self.failed(&e.to_string()))?;
        Ok(Saved { path: self.path.clone(), bytes: size.len() })
    }

    /// Flushes the file to the disk, and moves it to `place` if given.
    pub(super) fn settle(&mut self, place: Option<&Path>) -> Result<(), RecordError> {
        self.check()?;
        let encoder = lock(&self.encoder).flush_blocking();
        encoder.map_err(|e| self.failed(&e.to_string()))?;
        self.handle.sync_data().map_err(|e| self.failed(&e.to_string()))?;
        if let Some(place) = place {
            std::fs::rename(&self.path, place).map_err(|e| self.failed(&e.to_string()))?;
            self.path = place.to_owned();
        }
        Ok(())
    }

    fn failed(&self, cause: &str) -> RecordError {
        RecordError::Write { path: self.path.clone(), cause: cause.to_owned() }
    }
}

impl LogSink for RrdFile {
    fn send(&self, msg: LogMsg) {
        let mut fault = lock(&self.fault);
        if fault.is_none()
            && let Err(error) = lock(&self.encoder).append(&msg)
        {
            *fault = Some(error.to_string());
        }
    }

    fn flush_blocking(&self, _timeout: Duration) -> Result<(), SinkFlushError> {
        match &*lock(&self.fault) {
            None => Ok(()),
            Some(cause) => Err(SinkFlushError::failed(cause.clone())),
        }
    }
}

/// A file that was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Saved {
    /// Path of the file.
    pub path: PathBuf,
    /// Size (bytes).
    pub bytes: u64,
}

/// A viewer. After its first error nothing more is sent to it.
#[derive(Clone)]
pub(super) struct Live {
    name: String,
    fault: Fault,
}

impl Live {
    /// The first error of the viewer, if any.
    pub(super) fn check(&self) -> Result<(), RecordError> {
        match lock(&self.fault).clone() {
            None => Ok(()),
            Some(cause) => Err(RecordError::Viewer { name: self.name.clone(), cause }),
        }
    }
}

/// All destinations of one recording.
#[derive(Default)]
pub(super) struct Destinations {
    /// Sinks of all destinations.
    pub(super) sinks: Vec<Box<dyn LogSink>>,
    /// Files among the destinations.
    pub(super) files: Vec<RrdFile>,
    /// Viewers among the destinations.
    pub(super) viewers: Vec<Live>,
    /// The served page, if any.
    pub(super) page: Option<Page>,
    /// The stream of bytes, if any.
    pub(super) stream: Option<Arc<Stream>>,
}

impl Destinations {
    /// Starts a stream to all destinations.
    pub(super) fn begin(&mut self, id: &str) -> Result<RecordingStream, RecordError> {
        let mut builder = rerun::RecordingStreamBuilder::new(APPLICATION)
            .recording_id(id)
            // The RERUN environment variable must not disable a requested recording.
            .enabled(true);
        if self.viewers.is_empty() && self.stream.is_none() {
            builder = builder.batcher_config(rerun::log::ChunkBatcherConfig {
                flush_tick: FILE_TICK,
                ..Default::default()
            });
        }
        let rec = builder.set_sinks(std::mem::take(&mut self.sinks))?;
        rec.set_log_time_enabled(false);
        rec.set_log_tick_enabled(false);
        Ok(rec)
    }

    /// Opens all destinations.
    pub(super) fn open(sinks: &[Sink]) -> Result<Self, RecordError> {
        let mut all = Self::default();
        for sink in sinks {
            match sink {
                // Files are created last: if anything else fails, none is touched.
                Sink::Save(_) => {}
                Sink::Connect(url) => all.connect(url)?,
                Sink::Serve { port } => {
                    let stream = all.stream()?;
                    all.page = Some(Page::open(*port, stream)?);
                }
                Sink::Stream => all.stream().map(drop)?,
                Sink::Spawn => all.spawn()?,
            }
        }
        for sink in sinks {
            if let Sink::Save(path) = sink {
                let file = RrdFile::create(path)?;
                all.files.push(file.clone());
                all.sinks.push(Box::new(file));
            }
        }
        Ok(all)
    }

    fn add_viewer(&mut self, name: String, inner: Box<dyn LogSink>) -> Result<(), RecordError> {
        let fault = Fault::default();
        match LiveSink::start(Arc::clone(&fault), inner) {
            Ok(sink) => self.sinks.push(Box::new(sink)),
            Err(e) => return Err(RecordError::Viewer { name, cause: e.to_string() }),
        }
        self.viewers.push(Live { name, fault });
        Ok(())
    }

    fn connect(&mut self, url: &str) -> Result<(), RecordError> {
        let uri: re_uri::ProxyUri = url.parse().map_err(|e| RecordError::Viewer {
            name: url.to_owned(),
            cause: format!("{e}; an address looks like {}", rerun::DEFAULT_CONNECT_URL),
        })?;
        self.add_viewer(url.to_owned(), Box::new(GrpcSink::new(uri)))
    }

    fn spawn(&mut self) -> Result<(), RecordError> {
        let options = rerun::SpawnOptions {
            hide_welcome_screen: true,
            wait_for_bind: true,
            // With this variable the viewer sends no usage statistics to its makers.
            extra_env: vec![("CI".into(), "true".into())],
            ..Default::default()
        };
        let viewer = rerun::spawn(&options)
            .map_err(|e| RecordError::Viewer { name: "rerun".to_owned(), cause: e.to_string() })?;
        self.connect(&format!("rerun+http://127.0.0.1:{}/proxy", viewer.port))
    }

    /// Opens a stream, which viewers can read from its start at any time.
    fn stream(&mut self) -> Result<Arc<Stream>, RecordError> {
        let (sink, stream) = StreamSink::new()?;
        self.sinks.push(Box::new(sink));
        self.stream = Some(stream.clone());
        Ok(stream)
    }
}
