//! This module accepts connections. Those that have not shown the token are few and short-lived:
//! when there are too many of them, the oldest is closed.

use axum::{Extension, Router};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::collections::VecDeque;
use std::net::TcpListener;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;
use tokio::task::AbortHandle;

/// Maximum size of the head of a request (bytes).
const MAX_HEAD: usize = 32 * 1024;
/// Maximum number of connections that have shown the token.
const MAX_KNOWN: usize = 128;
/// Maximum number of connections that have not.
const MAX_STRANGERS: usize = 64;
/// Time limit for the head of a request, and for its body.
pub const CLIENT_PATIENCE: Duration = Duration::from_secs(10);

/// One connection.
pub struct Visitor {
    known: AtomicBool,
    /// Number of known connections.
    count: Arc<AtomicUsize>,
}

impl Visitor {
    /// Notes that the connection has shown the token. Returns whether there is a place for it.
    pub fn enter(&self) -> bool {
        if self.known.load(Ordering::Relaxed) {
            return true;
        }
        if self.count.fetch_add(1, Ordering::Relaxed) >= MAX_KNOWN {
            self.count.fetch_sub(1, Ordering::Relaxed);
            return false;
        }
        self.known.store(true, Ordering::Relaxed);
        true
    }
}

impl Drop for Visitor {
    fn drop(&mut self) {
        if *self.known.get_mut() {
            self.count.fetch_sub(1, Ordering::Relaxed);
        }
    }
}

/// Serves routes to all who connect; does not return unless the listener cannot be used.
pub async fn accept(listener: TcpListener, routes: Router) -> std::io::Result<()> {
    listener.set_nonblocking(true)?;
    let listener = tokio::net::TcpListener::from_std(listener)?;
    let count = Arc::new(AtomicUsize::new(0));
    let mut strangers: VecDeque<(Arc<Visitor>, AbortHandle)> = VecDeque::new();
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            // Too many open files, or an aborted connection: later connections may still succeed.
            tokio::time::sleep(Duration::from_millis(50)).await;
            continue;
        };
        strangers.retain(|(v, task)| !v.known.load(Ordering::Relaxed) && !task.is_finished());
        if strangers.len() >= MAX_STRANGERS
            && let Some((_, task)) = strangers.pop_front()
        {
            task.abort();
        }
        let visitor = Arc::new(Visitor { known: AtomicBool::new(false), count: count.clone() });
        let service = TowerToHyperService::new(routes.clone().layer(Extension(visitor.clone())));
        let serving = hyper::server::conn::http1::Builder::new()
            .timer(TokioTimer::new())
            .header_read_timeout(CLIENT_PATIENCE)
            .max_buf_size(MAX_HEAD)
            .serve_connection(TokioIo::new(stream), service);
        let task = tokio::spawn(async move {
            // A broken connection concerns only its client.
            let _ = serving.await;
        });
        strangers.push_back((visitor, task.abort_handle()));
    }
}
