//! This module streams a recording over HTTP, and serves a page that shows it.
//!
//! The data of a recording are private, so they are served behind the guard of [`crate::web`] and
//! not by Rerun's own server, which answers everyone on this machine, web pages included.

use super::super::viewer::with_viewer;
use super::{RecordError, lock};
use crate::web::guard::Guard;
use crate::web::stream::Stream;
use crate::web::{connections, file, kind, listen};
use axum::Router;
use axum::routing::get;
use futures::future;
use rerun::external::re_build_info::CrateVersion;
use rerun::external::re_log_encoding::{Encoder, EncodingOptions};
use rerun::log::{Chunk, LogMsg};
use rerun::sink::{LogSink, SinkFlushError};
use std::pin::pin;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::sync::oneshot;

/// Size of the history that is kept for viewers that connect late (bytes).
///
/// It is half of the memory of a 1 GiB process: the viewer, often on the same machine, holds the
/// same frames once more.
const HISTORY: usize = 512 * 1024 * 1024;

const INDEX: &str = include_str!("../../../../assets/page/index.html");
const SCRIPT: &str = include_str!("../../../../assets/page/page.js");

/// Bytes that the encoder has written since they were last taken.
#[derive(Clone, Default)]
struct Buffer(Arc<Mutex<Vec<u8>>>);

impl std::io::Write for Buffer {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        lock(&self.0).extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// A sink that encodes a recording as the bytes of an `.rrd` file and puts them into a stream.
pub(super) struct StreamSink {
    encoder: Mutex<Encoder<Buffer>>,
    written: Buffer,
    stream: Arc<Stream>,
}

impl StreamSink {
    /// A sink, and its stream.
    pub(super) fn new() -> Result<(StreamSink, Arc<Stream>), RecordError> {
        let stream = Stream::new(HISTORY);
        let written = Buffer::default();
        let version = CrateVersion::LOCAL;
        let options = EncodingOptions::PROTOBUF_COMPRESSED;
        let mut encoder = Encoder::new_eager(version, options, written.clone())
            .map_err(|e| RecordError::Viewer { name: "stream".into(), cause: e.to_string() })?;
        // The table of contents of the footer would grow with every message.
        encoder.do_not_emit_footer();
        let sink = StreamSink { encoder: Mutex::new(encoder), written, stream: stream.clone() };
        sink.pass_on(true);
        Ok((sink, stream))
    }

    fn pass_on(&self, constant: bool) {
        let bytes = std::mem::take(&mut *lock(&self.written.0));
        self.stream.push(bytes, constant);
    }
}

impl LogSink for StreamSink {
    fn send(&self, message: LogMsg) {
        let constant = match &message {
            LogMsg::SetStoreInfo(_) | LogMsg::BlueprintActivationCommand(_) => true,
            LogMsg::ArrowMsg(store, data) => {
                store.is_blueprint() || Chunk::from_arrow_msg(data).is_ok_and(|c| c.is_static())
            }
        };
        let mut encoder = lock(&self.encoder);
        // The buffer is in memory and accepts everything; a message that cannot be encoded cannot
        // be shown.
        if encoder.append(&message).is_ok() {
            self.pass_on(constant);
        }
    }

    fn flush_blocking(&self, _timeout: Duration) -> Result<(), SinkFlushError> {
        Ok(())
    }
}

impl Drop for StreamSink {
    fn drop(&mut self) {
        self.stream.end();
    }
}

/// A page that shows a recording in a browser; it is served until this value is dropped.
pub(crate) struct Page {
    /// Address of the page.
    pub(crate) url: String,
    _stop: oneshot::Sender<()>,
}

impl Page {
    /// Serves a page with a stream on a port; 0 takes any free one.
    pub(super) fn open(port: u16, stream: Arc<Stream>) -> Result<Page, RecordError> {
        let (listener, port) = listen(port).map_err(|source| RecordError::Port { port, source })?;
        let fault = |cause: String| RecordError::Viewer { name: format!("port {port}"), cause };
        let guard = Arc::new(Guard::new(&[port]).map_err(|e| fault(e.to_string()))?);
        let url = guard.url(port);
        let stream = move || {
            let stream = stream.clone();
            async move { stream.response() }
        };
        let inside = Router::new()
            .route("/", file(kind::HTML, INDEX.as_bytes()))
            .route("/page.js", file(kind::SCRIPT, SCRIPT.as_bytes()))
            .route("/recording.rrd", get(stream));
        let inside = with_viewer(inside)
            .ok_or_else(|| fault("this program was built without the feature `viewer`".into()))?;
        let index = file(kind::HTML, INDEX.as_bytes());
        let routes = guard.protect(index, inside, ());
        let (stop, stopped) = oneshot::channel::<()>();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        let runtime = runtime.map_err(|e| fault(e.to_string()))?;
        let served = std::thread::Builder::new().name("page".into()).spawn(move || {
            let accepting = pin!(connections::accept(listener, routes));
            runtime.block_on(future::select(accepting, stopped));
        });
        served.map_err(|e| fault(e.to_string()))?;
        Ok(Page { url, _stop: stop })
    }
}
