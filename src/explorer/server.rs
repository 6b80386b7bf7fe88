//! This module serves the page over HTTP, to this machine only.
//!
//! Every path starts with the token. The host of a request must be this machine, and its origin
//! must not be another site. Pages choose scenes and files from lists of the session and never give
//! paths. The sizes of bodies and headers and the number of connections are limited.

use super::protocol::{Answer, Command};
use super::session::Request as Order;
use super::status::Status;
use crate::record::rerun_log::{ViewerFile, viewer_file};
use axum::Router;
use axum::body::{Body, Bytes, to_bytes};
use axum::extract::{DefaultBodyLimit, Path, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, Uri, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use crossbeam::channel::Sender;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::convert::Infallible;
use std::net::TcpListener;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{Semaphore, oneshot};

/// Maximum size of the body of a command (bytes).
const MAX_BODY: usize = 16 * 1024;
/// Maximum size of the header of a request (bytes).
const MAX_HEAD: usize = 32 * 1024;
/// Maximum number of concurrent connections.
const MAX_CONNECTIONS: usize = 128;
/// Time limit for the header of a request, and for its body.
const CLIENT_PATIENCE: Duration = Duration::from_secs(10);
/// Maximum silence of an event stream.
const HEARTBEAT: Duration = Duration::from_secs(10);

const PAGE: &str = include_str!("../../assets/explorer/index.html");
const STYLE: &str = include_str!("../../assets/explorer/style.css");
const SCRIPT: &str = include_str!("../../assets/explorer/explorer.js");
const PLOTS: &str = include_str!("../../assets/explorer/plots.js");
const VIEWER: &str = include_str!("../../assets/explorer/viewer.html");
const VIEWER_SCRIPT: &str = include_str!("../../assets/explorer/viewer.js");
const ICON: &str = include_str!("../../assets/explorer/icon.svg");

/// Content security policy: pages load only from this server, except the data of the recording.
const POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; \
    style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; \
    connect-src 'self' http://127.0.0.1:*; frame-src 'self'; worker-src 'self' blob:; \
    frame-ancestors 'self'; base-uri 'none'; form-action 'none'";

/// Configuration and data of the server.
pub struct Site {
    /// Port of the page.
    pub port: u16,
    /// Secret token in the address of the page.
    pub token: String,
    /// Sender of commands to the session.
    pub commands: Sender<Order>,
    /// Data that the session publishes.
    pub status: Arc<Status>,
}

type Shared = State<Arc<Site>>;

/// Serves the page until the program ends.
pub fn serve(listener: TcpListener, site: Site) {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let outcome = runtime.and_then(|r| r.block_on(accept(listener, routes(Arc::new(site)))));
    if let Err(e) = outcome {
        eprintln!("error: the server of the page has stopped: {e}");
    }
}

async fn accept(listener: TcpListener, routes: Router) -> std::io::Result<()> {
    listener.set_nonblocking(true)?;
    let listener = tokio::net::TcpListener::from_std(listener)?;
    let places = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    loop {
        let place = places.clone().acquire_owned().await;
        let Ok((stream, _)) = listener.accept().await else {
            // Too many open files, or an aborted connection: later connections may still succeed.
            tokio::time::sleep(Duration::from_millis(50)).await;
            continue;
        };
        let service = TowerToHyperService::new(routes.clone());
        let serving = hyper::server::conn::http1::Builder::new()
            .timer(TokioTimer::new())
            .header_read_timeout(CLIENT_PATIENCE)
            .max_buf_size(MAX_HEAD)
            .serve_connection(TokioIo::new(stream), service);
        tokio::spawn(async move {
            // A broken connection concerns only its client.
            let _ = serving.await;
            drop(place);
        });
    }
}

fn routes(site: Arc<Site>) -> Router {
    const HTML: &str = "text/html; charset=utf-8";
    const JS: &str = "text/javascript; charset=utf-8";
    let text = |kind: &'static str, text: &'static str| {
        get(move || async move { ([(header::CONTENT_TYPE, kind)], text) })
    };
    let viewer = |kind: &'static str, file: ViewerFile| {
        get(move || async move {
            match viewer_file(file) {
                Some(bytes) => {
                    ([(header::CONTENT_TYPE, kind)], Bytes::from_static(bytes)).into_response()
                }
                None => StatusCode::NOT_FOUND.into_response(),
            }
        })
    };
    let inside = Router::new()
        .route("/", text(HTML, PAGE))
        .route("/style.css", text("text/css; charset=utf-8", STYLE))
        .route("/explorer.js", text(JS, SCRIPT))
        .route("/plots.js", text(JS, PLOTS))
        .route("/icon.svg", text("image/svg+xml", ICON))
        .route("/viewer/", text(HTML, VIEWER))
        .route("/viewer/viewer.js", text(JS, VIEWER_SCRIPT))
        .route("/viewer/re_viewer.js", viewer(JS, ViewerFile::Script))
        .route("/viewer/re_viewer_bg.wasm", viewer("application/wasm", ViewerFile::Program))
        .route("/api/state", get(state))
        .route("/api/events", get(events))
        .route("/api/curves", get(curves))
        .route("/api/sketch", get(sketch))
        .route("/api/command", post(command))
        .route("/api/saved/{folder}/{file}", get(saved));
    // A nested router does not match its own root with a trailing slash.
    let root = format!("/{}", site.token);
    let mut all = Router::new().route(&format!("{root}/"), text(HTML, PAGE));
    all = all.nest(&root, inside);
    all.layer(DefaultBodyLimit::max(MAX_BODY))
        .layer(from_fn_with_state(site.clone(), guard))
        .with_state(site)
}

/// Refuses requests that are not from a page of this program, and adds the security headers.
async fn guard(State(site): Shared, request: Request, next: Next) -> Response {
    let mut response = match admit(&site, &request) {
        Ok(()) => next.run(request).await,
        Err(why) => (StatusCode::FORBIDDEN, why).into_response(),
    };
    let headers = response.headers_mut();
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_FRAME_OPTIONS, "SAMEORIGIN"),
        (header::CACHE_CONTROL, "no-store"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

fn admit(site: &Site, request: &Request) -> Result<(), &'static str> {
    let headers = request.headers();
    let hosts = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", site.port));
    let text = |name: HeaderName| headers.get(name).map(|v| v.to_str().unwrap_or("?"));
    if !text(header::HOST).is_some_and(|host| hosts.iter().any(|h| h == host)) {
        return Err("the host name of this page must be that of this machine\n");
    }
    let ours = |origin: &str| hosts.iter().any(|h| origin.strip_prefix("http://") == Some(h));
    if text(header::ORIGIN).is_some_and(|origin| !ours(origin)) {
        return Err("requests from other sites are refused\n");
    }
    let given = request.uri().path().split('/').nth(1).unwrap_or_default();
    if !same(given, &site.token) {
        return Err("the address lacks the token that grainscope printed\n");
    }
    Ok(())
}

/// Compares in constant time, so that the duration does not reveal a partly correct token.
fn same(a: &str, b: &str) -> bool {
    let differ = a.bytes().zip(b.bytes()).fold(0, |all, (a, b)| all | (a ^ b));
    a.len() == b.len() && differ == 0
}

fn json(text: impl Into<Body>) -> Response {
    ([(header::CONTENT_TYPE, "application/json")], text.into()).into_response()
}

async fn state(State(site): Shared) -> Response {
    let text = site.status.watch().borrow().to_string();
    json(text)
}

/// Streams the state now and after each change, as server-sent events.
async fn events(State(site): Shared) -> Response {
    let mut receiver = site.status.watch();
    receiver.mark_changed();
    let stream = futures::stream::unfold(receiver, |mut receiver| async move {
        let text = match tokio::time::timeout(HEARTBEAT, receiver.changed()).await {
            Ok(Ok(())) => format!("data: {}\n\n", receiver.borrow_and_update().as_ref()),
            Ok(Err(_)) => return None,
            Err(_) => ": still here\n\n".to_string(),
        };
        Some((Ok::<_, Infallible>(Bytes::from(text)), receiver))
    });
    ([(header::CONTENT_TYPE, "text/event-stream")], Body::from_stream(stream)).into_response()
}

/// Points of the curves of a run: `?run=<id>&from=<point>`.
async fn curves(State(site): Shared, uri: Uri) -> Response {
    let number = |name: &str| -> Option<u64> {
        let pairs = uri.query().unwrap_or_default().split('&');
        pairs.filter_map(|p| p.split_once('=')).find(|p| p.0 == name)?.1.parse().ok()
    };
    let from = number("from").and_then(|f| usize::try_from(f).ok()).unwrap_or(0);
    let part = number("run").and_then(|run| site.status.part(run, from));
    match part.map(|p| serde_json::to_string(&p)) {
        Some(Ok(text)) => json(text),
        _ => (StatusCode::NOT_FOUND, "there is no such run\n").into_response(),
    }
}

async fn sketch(State(site): Shared) -> Response {
    match site.status.drawn().map(|s| serde_json::to_string(&s)) {
        Some(Ok(text)) => json(text),
        _ => (StatusCode::NOT_FOUND, "there is no picture yet\n").into_response(),
    }
}

async fn command(State(site): Shared, headers: HeaderMap, body: Body) -> Response {
    let refuse = |code: StatusCode, answer: Answer| {
        let text = serde_json::to_string(&answer).unwrap_or_default();
        (code, [(header::CONTENT_TYPE, "application/json")], text).into_response()
    };
    // Forms of other sites cannot send this content type.
    let kind = headers.get(header::CONTENT_TYPE).and_then(|v| v.to_str().ok());
    if !kind.is_some_and(|k| k.starts_with("application/json")) {
        let answer = Answer::no("a command must be JSON", "send it as application/json");
        return refuse(StatusCode::UNSUPPORTED_MEDIA_TYPE, answer);
    }
    let body = match tokio::time::timeout(CLIENT_PATIENCE, to_bytes(body, MAX_BODY)).await {
        Ok(Ok(body)) => body,
        Ok(Err(_)) => return StatusCode::PAYLOAD_TOO_LARGE.into_response(),
        Err(_) => return StatusCode::REQUEST_TIMEOUT.into_response(),
    };
    let command: Command = match serde_json::from_slice(&body) {
        Ok(command) => command,
        Err(e) => {
            let answer = Answer::no(format!("this is not a command: {e}"), "");
            return refuse(StatusCode::BAD_REQUEST, answer);
        }
    };
    let (reply, answer) = oneshot::channel();
    if site.commands.try_send(Order { command, reply }).is_err() {
        let answer = Answer::no("too many commands are waiting", "wait for the step to end");
        return refuse(StatusCode::SERVICE_UNAVAILABLE, answer);
    }
    match answer.await {
        Ok(answer) => refuse(StatusCode::OK, answer),
        Err(_) => {
            let answer = Answer::no("the session has ended", "start grainscope again");
            refuse(StatusCode::SERVICE_UNAVAILABLE, answer)
        }
    }
}

/// A file of a run saved in this session.
async fn saved(State(site): Shared, Path((folder, file)): Path<(String, String)>) -> Response {
    let path = site.status.file(&folder, &file);
    let bytes = path.and_then(|path| std::fs::read(path).ok());
    let Some(bytes) = bytes else {
        return (StatusCode::NOT_FOUND, "there is no such file\n").into_response();
    };
    let kind = match file.rsplit('.').next() {
        Some("svg") => "image/svg+xml",
        Some("png") => "image/png",
        Some("json") => "application/json",
        Some("csv") => "text/csv; charset=utf-8",
        Some("toml") => "text/plain; charset=utf-8",
        _ => "application/octet-stream",
    };
    let name = format!("attachment; filename=\"{folder}-{file}\"");
    ([(header::CONTENT_TYPE, kind.to_string()), (header::CONTENT_DISPOSITION, name)], bytes)
        .into_response()
}
