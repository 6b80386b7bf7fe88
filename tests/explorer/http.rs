//! A minimal HTTP client for the tests: one request per connection, headers as given.

use serde_json::Value;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// Response of a server.
pub struct Reply {
    /// Status code; 0 without a valid response.
    pub code: u16,
    /// Status line and headers.
    pub head: String,
    /// Body, with chunks joined.
    pub body: Vec<u8>,
}

impl Reply {
    /// The body as text.
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    /// The body as JSON.
    #[track_caller]
    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.body)
            .unwrap_or_else(|e| panic!("{e} in {} {}", self.code, self.text()))
    }
}

/// Sends a request to a port of this machine. The header `Host` is added unless given.
pub fn request(
    port: u16,
    method: &str,
    path: &str,
    headers: &[(&str, &str)],
    body: &[u8],
) -> Reply {
    let mut head = format!("{method} {path} HTTP/1.1\r\nConnection: close\r\n");
    if !headers.iter().any(|h| h.0 == "Host") {
        head += &format!("Host: 127.0.0.1:{port}\r\n");
    }
    for (name, value) in headers {
        head += &format!("{name}: {value}\r\n");
    }
    if !body.is_empty() || method == "POST" {
        head += &format!("Content-Length: {}\r\n", body.len());
    }
    let mut stream = TcpStream::connect(("127.0.0.1", port)).expect("a server");
    stream.set_read_timeout(Some(Duration::from_secs(240))).expect("a timeout");
    // A server may refuse a request, and close the connection, before it has read all of it. Its
    // answer can be read all the same.
    let _ =
        stream.write_all(format!("{head}\r\n").as_bytes()).and_then(|()| stream.write_all(body));
    // Not every server closes the connection when asked to.
    let (mut bytes, mut part) = (vec![], [0; 1 << 16]);
    while !is_whole(&bytes) {
        match stream.read(&mut part) {
            Ok(n) if n > 0 => bytes.extend(&part[..n]),
            _ => break,
        }
    }
    read(&bytes)
}

/// Length of the head with its final blank line, and its text.
fn head_of(bytes: &[u8]) -> Option<(usize, String)> {
    let end = bytes.windows(4).position(|w| w == b"\r\n\r\n")?;
    Some((end + 4, String::from_utf8_lossy(&bytes[..end]).into_owned()))
}

/// True if the response is complete.
fn is_whole(bytes: &[u8]) -> bool {
    let Some((from, head)) = head_of(bytes) else { return false };
    let head = head.to_ascii_lowercase();
    let length: Option<usize> =
        head.lines().find_map(|l| l.strip_prefix("content-length:")?.trim().parse().ok());
    match length {
        Some(length) => bytes.len() - from >= length,
        None => head.contains("chunked") && bytes.ends_with(b"0\r\n\r\n"),
    }
}

/// Parses a response.
fn read(bytes: &[u8]) -> Reply {
    let (from, head) = head_of(bytes).unwrap_or((bytes.len(), String::new()));
    let code = head.split(' ').nth(1).and_then(|c| c.parse().ok()).unwrap_or(0);
    let mut body = bytes[from..].to_vec();
    if head.to_ascii_lowercase().contains("transfer-encoding: chunked") {
        body = joined(&body);
    }
    Reply { code, head, body }
}

/// Joins the chunks of a chunked body.
fn joined(mut rest: &[u8]) -> Vec<u8> {
    let mut out = vec![];
    while let Some(end) = rest.windows(2).position(|w| w == b"\r\n") {
        let size = String::from_utf8_lossy(&rest[..end]);
        let Ok(size) = usize::from_str_radix(size.trim(), 16) else { break };
        let from = end + 2;
        if size == 0 || rest.len() < from + size {
            break;
        }
        out.extend(&rest[from..from + size]);
        rest = rest.get(from + size + 2..).unwrap_or_default();
    }
    out
}
