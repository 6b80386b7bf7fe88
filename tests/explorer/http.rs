//! As little of a client as the tests need: one request, one connection, every header as given.

use serde_json::Value;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// What a server answered.
pub struct Reply {
    pub code: u16,
    pub head: String,
    pub body: Vec<u8>,
}

impl Reply {
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    #[track_caller]
    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.body)
            .unwrap_or_else(|e| panic!("{e} in {} {}", self.code, self.text()))
    }
}

/// Sends a request to this machine; `Host` is the usual one unless given.
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
    stream.write_all(format!("{head}\r\n").as_bytes()).expect("sent");
    // A server may refuse before it has read everything.
    let _ = stream.write_all(body);
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

fn head_of(bytes: &[u8]) -> Option<(usize, String)> {
    let end = bytes.windows(4).position(|w| w == b"\r\n\r\n")?;
    Some((end + 4, String::from_utf8_lossy(&bytes[..end]).into_owned()))
}

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

fn read(bytes: &[u8]) -> Reply {
    let (from, head) = head_of(bytes).unwrap_or((bytes.len(), String::new()));
    let code = head.split(' ').nth(1).and_then(|c| c.parse().ok()).unwrap_or(0);
    let mut body = bytes[from..].to_vec();
    if head.to_ascii_lowercase().contains("transfer-encoding: chunked") {
        body = joined(&body);
    }
    Reply { code, head, body }
}

/// The body of chunks.
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
