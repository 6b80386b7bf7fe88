//! This module implements the destinations of a recording and detects their errors.
//!
//! Rerun logs asynchronously and does not report a full disk. Here each destination keeps its first
//! error. An error of a viewer is an error of the recording only if no other destination is left.

mod live;

use live::LiveSink;
use std::fs::File;
use std::net::{Ipv4Addr, TcpListener};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rerun::external::re_build_info::CrateVersion;
use rerun::external::re_log_encoding::{Encoder, EncodingOptions};
use rerun::external::{re_grpc_server, re_uri};
use rerun::log::LogMsg;
use rerun::sink::{GrpcSink, LogSink, SinkFlushError};

use rerun::RecordingStream;

use super::{APPLICATION, FILE_TICK, RecordError};

/// Time after which a viewer that accepts no data is given up.
const VIEWER_PATIENCE: Duration = Duration::from_secs(5);

/// Size of the history that a server keeps for viewers that connect late (bytes).
///
/// It is half of the memory of a 1 GiB process: the viewer, often on the same machine, holds the
/// same frames once more.
const SERVER_HISTORY_BYTES: u64 = 512 * 1024 * 1024;

/// Address to serve on: only this machine can connect.
const HOST: Ipv4Addr = Ipv4Addr::LOCALHOST;

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
        web_port: u16,
        /// Port of the data; 0 takes any free port.
        grpc_port: u16,
    },
    /// The data alone, served to viewers on this machine that know its address.
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

/// A page that shows the recording in a browser; it is served until this value is dropped.
pub(super) struct Page {
    /// Address of the page, or of the data alone.
    pub(super) url: String,
    /// Server of the page, which stops when dropped; `None` if only the data is served.
    _server: Option<Box<dyn std::any::Any + Send>>,
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
}

impl Destinations {
    /// Starts a stream to all destinations.
    pub(super) fn begin(&mut self, id: &str) -> Result<RecordingStream, RecordError> {
        let mut builder = rerun::RecordingStreamBuilder::new(APPLICATION)
            .recording_id(id)
            // The RERUN environment variable must not disable a requested recording.
            .enabled(true);
        if self.viewers.is_empty() {
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
                Sink::Save(path) => {
                    let file = RrdFile::create(path)?;
                    all.files.push(file.clone());
                    all.sinks.push(Box::new(file));
                }
                Sink::Connect(url) => all.connect(url)?,
                Sink::Serve { web_port, grpc_port } => all.serve(*web_port, *grpc_port)?,
                Sink::Stream => all.stream()?,
                Sink::Spawn => all.spawn()?,
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
            ..Default::default()
        };
        let viewer = rerun::spawn(&options)
            .map_err(|e| RecordError::Viewer { name: "rerun".to_owned(), cause: e.to_string() })?;
        self.connect(&format!("rerun+http://127.0.0.1:{}/proxy", viewer.port))
    }

    fn serve(&mut self, web_port: u16, grpc_port: u16) -> Result<(), RecordError> {
        let [grpc_port, web_port] = claim([grpc_port, web_port])?;
        let page = rerun::serve_web_viewer(rerun::web_viewer::WebViewerConfig {
            bind_ip: HOST.to_string(),
            web_port: web_port.into(),
            open_browser: false,
            ..Default::default()
        })
        .map_err(|e| RecordError::Viewer {
            name: format!("port {web_port}"),
            cause: e.to_string(),
        })?;
        self.data(grpc_port, format!("page on port {web_port}"))?;
        self.page = Some(Page {
            url: format!(
                "http://{HOST}:{web_port}/?url=rerun%2Bhttp%3A%2F%2F{HOST}%3A{grpc_port}%2Fproxy"
            ),
            _server: Some(Box::new(page)),
        });
        Ok(())
    }

    fn stream(&mut self) -> Result<(), RecordError> {
        let [port, _] = claim([0, 0])?;
        self.data(port, format!("data on port {port}"))?;
        self.page = Some(Page { url: format!("rerun+http://{HOST}:{port}/proxy"), _server: None });
        Ok(())
    }

    /// Serves the data. Viewers that connect late receive the history.
    fn data(&mut self, port: u16, name: String) -> Result<(), RecordError> {
        let sink = rerun::grpc_server::GrpcServerSink::new(
            &HOST.to_string(),
            port,
            re_grpc_server::ServerOptions {
                memory_limit: rerun::MemoryLimit::from_bytes(SERVER_HISTORY_BYTES),
                ..Default::default()
            },
        )
        .map_err(|e| RecordError::Viewer { name: format!("port {port}"), cause: e.to_string() })?;
        self.add_viewer(name, Box::new(sink))
    }
}

/// Checks that ports of this machine are free, and chooses free ones for 0.
///
/// Rerun's server thread does not report a port that is in use.
fn claim(ports: [u16; 2]) -> Result<[u16; 2], RecordError> {
    let bind = |port| {
        TcpListener::bind((HOST, port))
            .and_then(|listener| Ok((listener.local_addr()?.port(), listener)))
            .map_err(|source| RecordError::Port { port, source })
    };
    // Both listeners are held until both ports are known, so that they differ.
    let (first, second) = (bind(ports[0])?, bind(ports[1])?);
    Ok([first.0, second.0])
}
