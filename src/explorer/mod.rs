//! This module implements the explorer: an interactive run, and a web page that shows and controls
//! it.
//!
//! ```text
//! page --- commands ---> server --- channel ---> session: takes a step, answers, takes a step
//!  ^                       |                        |            |
//!  |<-------- state -------+<------- status ---------+            +--> viewer (recording)
//! ```
//!
//! The `session` owns the run and its data, on a thread of its own. It takes commands between steps
//! and answers each one: accepted, with the effect, or refused, with the reason. It publishes its
//! state on the `status`, which the `server` can read at any time, however long a step takes. Pages
//! hold no state: all open pages show the same session.

mod draft;
mod editor;
mod frame_buffer;
mod knobs;
mod library;
mod live;
mod problem;
mod protocol;
mod save;
mod server;
mod session;
mod stage;
mod status;

use crate::scene::SceneSource;
use crate::web;
use crate::web::guard::Guard;
use crossbeam::channel::bounded;
use library::Library;
use session::Session;
use status::Status;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread::JoinHandle;

/// Number of commands that may wait for the session.
const WAITING: usize = 64;

/// Settings of an explorer.
pub struct Settings {
    /// The first scene.
    pub scene: SceneSource,
    /// Whether the scene is a file; otherwise it is a preset.
    pub from_file: bool,
    /// Settings of the scene, in the form of `--set`.
    pub sets: Vec<String>,
    /// Folder whose scenes are listed in addition to the presets.
    pub folder: PathBuf,
    /// Folder for saved runs.
    pub out: PathBuf,
    /// Port of the page; 0 takes any free port.
    pub port: u16,
    /// Whether the run is paused at the first instant.
    pub paused: bool,
    /// Ends the session when set.
    pub interrupted: Arc<AtomicBool>,
}

/// Error of starting an explorer.
#[derive(Debug, thiserror::Error)]
pub enum ExplorerError {
    /// The port cannot be used.
    #[error("port {port} of this machine cannot be used: {source}; 0 takes any free port")]
    Port {
        /// The requested port.
        port: u16,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// There are no random numbers for the address of the page.
    #[error("the system provides no random numbers, which the address of the page needs: {0}")]
    Random(getrandom::Error),
    /// A thread cannot be started.
    #[error("a thread cannot be started: {0}")]
    Thread(std::io::Error),
}

/// A running explorer.
pub struct Explorer {
    /// Address of the page, with a secret token.
    pub url: String,
    session: JoinHandle<()>,
}

impl Explorer {
    /// Starts the session and serves its page.
    pub fn open(settings: Settings) -> Result<Explorer, ExplorerError> {
        let port = settings.port;
        let (page, port) =
            web::listen(port).map_err(|source| ExplorerError::Port { port, source })?;
        let (data, data_port) =
            web::listen(0).map_err(|source| ExplorerError::Port { port: 0, source })?;
        let guard = Arc::new(Guard::new(&[port, data_port]).map_err(ExplorerError::Random)?);
        let (url, streams) = (guard.url(port), format!("{}stream/", guard.url(data_port)));
        let (sender, receiver) = bounded(WAITING);
        let status = Arc::new(Status::new(streams));
        let shared = status.clone();
        let desk = editor::Desk::new(settings.folder.clone(), &settings.scene, settings.from_file);
        let site = server::Site { commands: sender, status, desk };
        let routes = server::routes(guard, site);
        let thread = |name: &str| std::thread::Builder::new().name(name.into());
        let session = thread("session")
            .spawn(move || {
                let library = Library::new(settings.folder);
                let mut session =
                    Session::new(library, settings.out, receiver, shared, settings.interrupted);
                session.open(settings.scene, settings.from_file, &settings.sets, settings.paused);
                session.serve();
            })
            .map_err(ExplorerError::Thread)?;
        thread("server")
            .spawn(move || server::serve(page, data, routes))
            .map_err(ExplorerError::Thread)?;
        Ok(Explorer { url, session })
    }

    /// Waits until the session ends.
    pub fn wait(self) {
        if let Err(panic) = self.session.join() {
            std::panic::resume_unwind(panic);
        }
    }
}
