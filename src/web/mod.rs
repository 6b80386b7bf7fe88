//! This module serves pages and data over HTTP, to this machine only.
//!
//! Every path starts with a random token. The host of a request must be this machine, and its
//! origin must not be another site ([`guard`]). Connections that have not shown the token cannot
//! take the places of those that have ([`connections`]). The sizes of heads and bodies are limited.
//! [`stream`] sends data that are still being produced.

pub mod connections;
pub mod guard;
pub mod stream;

use axum::body::Bytes;
use axum::http::header;
use axum::routing::{MethodRouter, get};
use std::net::{Ipv4Addr, TcpListener};

/// Address to serve on: only this machine can connect.
pub const HOST: Ipv4Addr = Ipv4Addr::LOCALHOST;

/// Listens on a port of this machine; 0 takes any free one. Also returns the port.
///
/// # Errors
/// The port is taken or may not be used.
pub fn listen(port: u16) -> std::io::Result<(TcpListener, u16)> {
    let listener = TcpListener::bind((HOST, port))?;
    let port = listener.local_addr()?.port();
    Ok((listener, port))
}

/// Types of the files of pages.
pub mod kind {
    /// A page.
    pub const HTML: &str = "text/html; charset=utf-8";
    /// A script.
    pub const SCRIPT: &str = "text/javascript; charset=utf-8";
    /// A style sheet.
    pub const STYLE: &str = "text/css; charset=utf-8";
    /// A vector image.
    pub const SVG: &str = "image/svg+xml";
    /// A program for the browser.
    #[cfg(feature = "viewer")]
    pub const WASM: &str = "application/wasm";
}

/// A route to a file that is part of the program.
pub fn file<S: Clone + Send + Sync + 'static>(
    kind: &'static str,
    content: &'static [u8],
) -> MethodRouter<S> {
    get(move || async move { ([(header::CONTENT_TYPE, kind)], Bytes::from_static(content)) })
}
