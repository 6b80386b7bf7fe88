//! Where a recording goes, and whether it got there.
//!
//! Rerun logs asynchronously and tells nobody when the disk is full. Here each
//! destination keeps its first fault, and a fault is an error of the recording
//! only if nothing else still receives it.

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

use crossbeam::channel::{Sender, bounded};
use rerun::RecordingStream;

use super::{APPLICATION, FILE_TICK, RecordError};

/// How long a viewer may take to swallow what was sent before it is given up.
const VIEWER_PATIENCE: Duration = Duration::from_secs(5);

/// History a server keeps for viewers that connect late.
///
/// Half of what a 1 GiB process may spend: the same frames are held once more
/// by the viewer itself, often on the same machine.
const SERVER_HISTORY_BYTES: u64 = 512 * 1024 * 1024;

/// Everything that is served is served to this machine only.
const HOST: Ipv4Addr = Ipv4Addr::LOCALHOST;

/// A destination of the recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Sink {
    /// An `.rrd` file.
    Save(PathBuf),
    /// A viewer that already listens, such as `rerun+http://127.0.0.1:9876/proxy`.
    Connect(String),
    /// A page served from this process, to this machine only.
    Serve {
        /// Port of the page; 0 takes any free one.
        web_port: u16,
        /// Port of the data; 0 takes any free one.
        grpc_port: u16,
    },
    /// The data alone, served to viewers on this machine that are told its address.
    Stream,
    /// The `rerun` viewer found on the path, started now.
    Spawn,
}

/// First fault of a destination, shared between its sink and the recorder.
type Fault = Arc<Mutex<Option<String>>>;

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// An `.rrd` file. Rerun's own `FileSink` writes the same bytes, but only logs
/// why it failed.
#[derive(Clone)]
pub(super) struct RrdFile {
    path: PathBuf,
    encoder: Arc<Mutex<Encoder<File>>>,
    /// The same file, to bring it to the disk.
    handle: Arc<File>,
    fault: Fault,
}

impl RrdFile {
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

    pub(super) fn check(&self) -> Result<(), RecordError> {
        match lock(&self.fault).clone() {
            None => Ok(()),
            Some(cause) => Err(RecordError::Write { path: self.path.clone(), cause }),
        }
    }

    /// The error of a file that takes no more data, without saying why.
    pub(super) fn late(&self) -> RecordError {
        RecordError::Write { path: self.path.clone(), cause: "the disk does not answer".to_owned() }
    }

    /// Writes the footer. To be called when nothing more will be sent.
    pub(super) fn finish(&self) -> Result<Saved, RecordError> {
        self.check()?;
        let failed = |cause: String| RecordError::Write { path: self.path.clone(), cause };
        let mut encoder = lock(&self.encoder);
        encoder.finish().map_err(|e| failed(e.to_string()))?;
        encoder.flush_blocking().map_err(|e| failed(e.to_string()))?;
        self.finished()
    }

    /// The file as it is now.
    pub(super) fn finished(&self) -> Result<Saved, RecordError> {
        let size = std::fs::metadata(&self.path).map_err(|e| self.failed(&e.to_string()))?;
        Ok(Saved { path: self.path.clone(), bytes: size.len() })
    }

    /// Brings what was sent to the disk, and the file to its final place.
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
    /// Where it is.
    pub path: PathBuf,
    /// How large it is.
    pub bytes: u64,
}

/// A viewer, near or far. After its first fault nothing more is sent to it.
#[derive(Clone)]
pub(super) struct Live {
    name: String,
    fault: Fault,
}

impl Live {
    pub(super) fn check(&self) -> Result<(), RecordError> {
        match lock(&self.fault).clone() {
            None => Ok(()),
            Some(cause) => Err(RecordError::Viewer { name: self.name.clone(), cause }),
        }
    }
}

/// What is handed to the thread of a viewer.
enum Parcel {
    Message(LogMsg),
    /// Wait until everything before it has left; then say so.
    Flush(Duration, Sender<Result<(), SinkFlushError>>),
}

/// Parcels that may wait beside those that Rerun's own queue holds.
const PARCELS: usize = 8;

/// Rerun's sinks block for as long as a viewer takes nothing, which may be for ever. This one hands
/// what it is sent to a thread of its own, and gives a viewer up that takes nothing for
/// [`VIEWER_PATIENCE`]. A viewer that is merely slow slows the logger, whose policy decides what
/// that means for the run.
struct LiveSink {
    fault: Fault,
    line: Sender<Parcel>,
}

impl LiveSink {
    /// Starts the thread; it ends when this is dropped and the viewer has taken what waits.
    fn start(fault: Fault, inner: Box<dyn LogSink>) -> std::io::Result<LiveSink> {
        let (line, parcels) = bounded(PARCELS);
        std::thread::Builder::new().name("viewer".into()).spawn(move || {
            for parcel in parcels {
                match parcel {
                    Parcel::Message(message) => inner.send(message),
                    // Nobody waits any more if this fails.
                    Parcel::Flush(timeout, done) => {
                        let _ = done.send(inner.flush_blocking(timeout));
                    }
                }
            }
        })?;
        Ok(LiveSink { fault, line })
    }

    fn hand_over(&self, parcel: Parcel, timeout: Duration) -> Result<(), SinkFlushError> {
        self.line.send_timeout(parcel, timeout).map_err(|_| {
            let seconds = timeout.as_secs_f64();
            SinkFlushError::failed(format!("it took nothing of what was sent for {seconds} s"))
        })
    }

    /// The first fault stays.
    fn note(&self, error: &SinkFlushError) {
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

/// A page that shows the recording in a browser, for as long as this lives.
pub(super) struct Page {
    pub(super) url: String,
    /// Stops serving when dropped; absent where the data alone is served.
    _server: Option<Box<dyn std::any::Any + Send>>,
}

/// All destinations of one recording.
#[derive(Default)]
pub(super) struct Destinations {
    pub(super) sinks: Vec<Box<dyn LogSink>>,
    pub(super) files: Vec<RrdFile>,
    pub(super) viewers: Vec<Live>,
    pub(super) page: Option<Page>,
}

impl Destinations {
    /// Starts a recording that goes to all of them.
    pub(super) fn begin(&mut self, id: &str) -> Result<RecordingStream, RecordError> {
        let mut builder = rerun::RecordingStreamBuilder::new(APPLICATION)
            .recording_id(id)
            // The RERUN environment variable must not silence a recording that was asked for.
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

    /// Serves the data; viewers that come late get what was sent before.
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

/// Makes sure that ports of this machine are free, and finds some for 0.
///
/// Rerun's server thread would report a busy port to nobody.
fn claim(ports: [u16; 2]) -> Result<[u16; 2], RecordError> {
    let bind = |port| {
        TcpListener::bind((HOST, port))
            .and_then(|listener| Ok((listener.local_addr()?.port(), listener)))
            .map_err(|source| RecordError::Port { port, source })
    };
    // Both are held until both are known, so that they differ.
    let (first, second) = (bind(ports[0])?, bind(ports[1])?);
    Ok([first.0, second.0])
}
