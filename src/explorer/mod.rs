//! The explorer: a run that listens, and a page that shows it.
//!
//! ```text
//! page --- commands ---> server --- channel ---> session: takes a step, answers, takes a step
//!  ^                       |                        |            |
//!  |<-------- state -------+<------- board ---------+            +--> viewer (recording)
//! ```
//!
//! The `session` owns the run and everything that can be said of it, on a thread of its own. It
//! takes commands between steps and answers each one: accepted, with what it does, or refused, and
//! why. What it knows is written on the `board`, which the `server` reads whenever a page asks,
//! however long a step takes. Pages hold no state: all that are open show the same session.

mod board;
mod draft;
mod film;
mod keep;
mod knobs;
mod library;
mod live;
mod problem;
mod protocol;
mod server;
mod session;
mod stage;

use crate::record::rerun_log::{ViewerFile, viewer_file};
use crate::scene::SceneSource;
use board::Board;
use crossbeam::channel::bounded;
use library::Library;
use session::Session;
use std::net::{Ipv4Addr, TcpListener};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread::JoinHandle;

/// Commands that may wait for the session.
const WAITING: usize = 64;

/// What the explorer opens with.
pub struct Settings {
    /// The first scene, and whether it is a preset or a file.
    pub scene: SceneSource,
    pub from_file: bool,
    /// Changes of the scene's text, as `--set` takes them.
    pub sets: Vec<String>,
    /// Folder whose scenes are offered beside the presets.
    pub folder: PathBuf,
    /// Folder that saved runs go to.
    pub out: PathBuf,
    /// Port of the page; 0 takes any free one.
    pub port: u16,
    /// Stand at the first instant until told to run.
    pub paused: bool,
    /// Ends the session when set.
    pub interrupted: Arc<AtomicBool>,
}

/// Why there is no explorer.
#[derive(Debug, thiserror::Error)]
pub enum ExplorerError {
    #[error("port {port} of this machine cannot be used: {source}; 0 takes any free port")]
    Port { port: u16, source: std::io::Error },
    #[error("the system gives no random numbers, which the page's address needs: {0}")]
    Random(getrandom::Error),
    #[error("a thread cannot be started: {0}")]
    Thread(std::io::Error),
    #[error("this program was built without the viewer's files")]
    NoViewer,
}

/// An explorer that is open.
pub struct Explorer {
    /// Where the page is; nobody else knows the token in it.
    pub url: String,
    session: JoinHandle<()>,
}

impl Explorer {
    /// Starts the session and serves its page.
    pub fn open(settings: Settings) -> Result<Explorer, ExplorerError> {
        if viewer_file(ViewerFile::Program).is_none() {
            return Err(ExplorerError::NoViewer);
        }
        let port = settings.port;
        let fault = |source| ExplorerError::Port { port, source };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(fault)?;
        let port = listener.local_addr().map_err(fault)?.port();
        let token = token()?;
        let url = format!("http://{}:{port}/{token}/", Ipv4Addr::LOCALHOST);
        let (sender, receiver) = bounded(WAITING);
        let board = Arc::new(Board::new());
        let shared = board.clone();
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
        let site = server::Site { port, token, commands: sender, board };
        thread("server")
            .spawn(move || server::serve(listener, site))
            .map_err(ExplorerError::Thread)?;
        Ok(Explorer { url, session })
    }

    /// Waits until the session is told to end.
    pub fn wait(self) {
        if let Err(panic) = self.session.join() {
            std::panic::resume_unwind(panic);
        }
    }
}

/// 128 random bits in hexadecimal digits.
fn token() -> Result<String, ExplorerError> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).map_err(ExplorerError::Random)?;
    Ok(bytes.iter().map(|b| format!("{b:02x}")).collect())
}
