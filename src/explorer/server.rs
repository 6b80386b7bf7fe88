//! This module serves the page of the explorer, behind the guard of [`crate::web`]. Pages choose
//! scenes and files from lists of the session and never give paths.

use super::editor::{Desk, Edit, MAX_SCENE};
use super::protocol::{Answer, Command};
use super::session::Request as Order;
use super::status::Status;
use crate::light;
use crate::record::rerun_log::with_viewer;
use crate::web::connections::{CLIENT_PATIENCE, accept};
use crate::web::guard::Guard;
use crate::web::{file, kind};
use axum::Router;
use axum::body::{Body, Bytes, to_bytes};
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use crossbeam::channel::Sender;
use futures::future;
use serde::de::DeserializeOwned;
use std::convert::Infallible;
use std::net::TcpListener;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::oneshot;

/// Maximum silence of an event stream.
const HEARTBEAT: Duration = Duration::from_secs(10);

const PAGE: &str = include_str!("../../assets/explorer/index.html");
const STYLE: &str = include_str!("../../assets/explorer/style.css");
const SCRIPT: &str = include_str!("../../assets/explorer/explorer.js");
const PLOTS: &str = include_str!("../../assets/explorer/plots.js");
const EDITOR: &str = include_str!("../../assets/editor/editor.js");
const SCENE_SCRIPT: &str = include_str!("../../assets/explorer/scene.js");
const VIEWER: &str = include_str!("../../assets/explorer/viewer.html");
const VIEWER_SCRIPT: &str = include_str!("../../assets/explorer/viewer.js");
const ICON: &str = include_str!("../../assets/explorer/icon.svg");

/// Configuration and data of the server.
pub struct Site {
    /// Sender of commands to the session.
    pub commands: Sender<Order>,
    /// Data that the session publishes.
    pub status: Arc<Status>,
    /// Scenes that the page edits.
    pub desk: Desk,
}

type Shared = State<Arc<Site>>;

/// The routes of the page. Without the files of the Rerun viewer, the page has the light view alone.
pub fn routes(guard: Arc<Guard>, site: Site) -> Router {
    let page = || file(kind::HTML, PAGE.as_bytes());
    let viewer = Router::new().route("/viewer.js", file(kind::SCRIPT, VIEWER_SCRIPT.as_bytes()));
    let inside = Router::new()
        .route("/", page())
        .route("/style.css", file(kind::STYLE, STYLE.as_bytes()))
        .route("/explorer.js", file(kind::SCRIPT, SCRIPT.as_bytes()))
        .route("/plots.js", file(kind::SCRIPT, PLOTS.as_bytes()))
        .route("/base.css", file(kind::STYLE, light::BASE_STYLE.as_bytes()))
        .route("/light.css", file(kind::STYLE, light::STYLE.as_bytes()))
        .route("/light/frame.js", file(kind::SCRIPT, light::DRAWING[0].as_bytes()))
        .route("/light/painter.js", file(kind::SCRIPT, light::DRAWING[1].as_bytes()))
        .route("/light/canvas.js", file(kind::SCRIPT, light::CANVAS.as_bytes()))
        .route("/light/view.js", file(kind::SCRIPT, light::VIEW.as_bytes()))
        .route("/icon.svg", file(kind::SVG, ICON.as_bytes()))
        .route("/stream/{name}", get(stream))
        .route("/api/state", get(state))
        .route("/api/events", get(events))
        .route("/api/curves", get(curves))
        .route("/api/runs/{id}", get(listing))
        .route("/api/runs/{id}/{step}", get(picture))
        .route("/editor.js", file(kind::SCRIPT, EDITOR.as_bytes()))
        .route("/scene.js", file(kind::SCRIPT, SCENE_SCRIPT.as_bytes()))
        .route("/api/schema", get(schema))
        .route("/api/scene/{id}", get(scene))
        .route("/api/editor", post(edit))
        .route("/api/command", post(command))
        .route("/api/saved/{folder}/{file}", get(saved));
    let inside = match with_viewer(viewer) {
        Some(viewer) => {
            inside.route("/viewer/", file(kind::HTML, VIEWER.as_bytes())).nest("/viewer", viewer)
        }
        None => inside,
    };
    guard.protect(page(), inside, Arc::new(site))
}

/// Serves the page, and the streams of the viewer on a port of their own, until the program ends.
/// A browser opens only a few connections to a port, and streams occupy theirs.
pub fn serve(page: TcpListener, data: TcpListener, routes: Router) {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let outcome = runtime.and_then(|r| {
        r.block_on(async {
            let (page, data) = (pin!(accept(page, routes.clone())), pin!(accept(data, routes)));
            future::select(page, data).await.factor_first().0
        })
    });
    if let Err(e) = outcome {
        eprintln!("error: the server of the page has stopped: {e}");
    }
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

/// A recording for the viewer, while it is being made.
async fn stream(State(site): Shared, Path(name): Path<String>) -> Response {
    match site.status.stream(&name) {
        Some(stream) => stream.response(),
        None => (StatusCode::NOT_FOUND, "there is no such recording\n").into_response(),
    }
}

/// Constant data of a run and the steps that have pictures.
async fn listing(State(site): Shared, Path(id): Path<u64>) -> Response {
    match site.status.listing(id).map(|l| serde_json::to_string(&l)) {
        Some(Ok(text)) => json(text),
        _ => (StatusCode::NOT_FOUND, "there is no such run\n").into_response(),
    }
}

/// The packed picture of a step.
async fn picture(State(site): Shared, Path((id, step)): Path<(u64, u64)>) -> Response {
    let packed = tokio::task::spawn_blocking(move || site.status.picture(id, step)).await;
    match packed {
        Ok(Some(bytes)) => {
            ([(header::CONTENT_TYPE, "application/octet-stream")], bytes).into_response()
        }
        _ => (StatusCode::NOT_FOUND, "there is no such picture\n").into_response(),
    }
}

/// The schema of scenes, for completion and help.
async fn schema() -> Response {
    json(crate::scene::json_schema())
}

/// The text of a scene of the library.
async fn scene(State(site): Shared, Path(id): Path<String>) -> Response {
    let opened = tokio::task::spawn_blocking(move || site.desk.open(&id)).await;
    match opened.map(|o| o.map(|o| serde_json::to_string(&o))) {
        Ok(Some(Ok(text))) => json(text),
        _ => (StatusCode::NOT_FOUND, "there is no such scene\n").into_response(),
    }
}

/// A request of the editor. It is answered beside the session, so it does not wait for a step.
async fn edit(State(site): Shared, headers: HeaderMap, body: Body) -> Response {
    let order: Edit = match read(&headers, body).await {
        Ok(order) => order,
        Err(refusal) => return refusal,
    };
    let answer = tokio::task::spawn_blocking(move || site.desk.obey(order, &site.status)).await;
    match answer.map(|a| serde_json::to_string(&a)) {
        Ok(Ok(text)) => json(text),
        _ => StatusCode::INTERNAL_SERVER_ERROR.into_response(),
    }
}

fn refuse(code: StatusCode, answer: &Answer) -> Response {
    let text = serde_json::to_string(answer).unwrap_or_default();
    (code, [(header::CONTENT_TYPE, "application/json")], text).into_response()
}

/// Reads a JSON body of at most [`MAX_SCENE`] bytes.
async fn read<T: DeserializeOwned>(headers: &HeaderMap, body: Body) -> Result<T, Response> {
    // Forms of other sites cannot send this content type.
    let kind = headers.get(header::CONTENT_TYPE).and_then(|v| v.to_str().ok());
    if !kind.is_some_and(|k| k.starts_with("application/json")) {
        let answer = Answer::no("a command must be JSON", "send it as application/json");
        return Err(refuse(StatusCode::UNSUPPORTED_MEDIA_TYPE, &answer));
    }
    let body = match tokio::time::timeout(CLIENT_PATIENCE, to_bytes(body, MAX_SCENE)).await {
        Ok(Ok(body)) => body,
        Ok(Err(_)) => return Err(StatusCode::PAYLOAD_TOO_LARGE.into_response()),
        Err(_) => return Err(StatusCode::REQUEST_TIMEOUT.into_response()),
    };
    serde_json::from_slice(&body).map_err(|e| {
        let answer = Answer::no(format!("this is not a command: {e}"), "");
        refuse(StatusCode::BAD_REQUEST, &answer)
    })
}

async fn command(State(site): Shared, headers: HeaderMap, body: Body) -> Response {
    let command: Command = match read(&headers, body).await {
        Ok(command) => command,
        Err(refusal) => return refusal,
    };
    let (reply, answer) = oneshot::channel();
    if site.commands.try_send(Order { command, reply }).is_err() {
        let answer = Answer::no("too many commands are waiting", "wait for the step to end");
        return refuse(StatusCode::SERVICE_UNAVAILABLE, &answer);
    }
    match answer.await {
        Ok(answer) => refuse(StatusCode::OK, &answer),
        Err(_) => {
            let answer = Answer::no("the session has ended", "start grainscope again");
            refuse(StatusCode::SERVICE_UNAVAILABLE, &answer)
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
