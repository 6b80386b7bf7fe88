//! This module sends messages to any number of clients while they are being produced. A client that
//! connects late receives the earlier messages first.

use axum::body::{Body, Bytes};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::watch;

/// A growing list of messages.
pub struct Stream {
    kept: Mutex<Kept>,
    /// Changes with every message and at the end.
    news: watch::Sender<()>,
    /// Largest size of the messages that are not constant (bytes).
    limit: usize,
}

/// Messages with their numbers. Of those that are not constant, the oldest are dropped.
#[derive(Default)]
struct Kept {
    constant: Vec<(u64, Bytes)>,
    passing: VecDeque<(u64, Bytes)>,
    size: usize,
    count: u64,
    ended: bool,
}

impl Kept {
    /// The first message from number `from` on.
    fn after(&self, from: u64) -> Option<&(u64, Bytes)> {
        let constant = self.constant.get(self.constant.partition_point(|m| m.0 < from));
        let passing = self.passing.get(self.passing.partition_point(|m| m.0 < from));
        constant.into_iter().chain(passing).min_by_key(|m| m.0)
    }
}

impl Stream {
    /// An empty stream that keeps at most `limit` bytes of passing messages.
    pub fn new(limit: usize) -> Arc<Stream> {
        Arc::new(Stream { kept: Mutex::default(), news: watch::Sender::new(()), limit })
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Appends a message; every client receives constant ones.
    pub fn push(&self, message: Vec<u8>, constant: bool) {
        let mut kept = self.kept();
        let number = kept.count;
        kept.count += 1;
        let message = Bytes::from(message);
        if constant {
            kept.constant.push((number, message));
        } else {
            kept.size += message.len();
            kept.passing.push_back((number, message));
            while kept.size > self.limit && kept.passing.len() > 1 {
                kept.size -= kept.passing.pop_front().map_or(0, |m| m.1.len());
            }
        }
        drop(kept);
        self.news.send_replace(());
    }

    /// Ends the stream: clients are disconnected when they have received everything.
    pub fn end(&self) {
        self.kept().ended = true;
        self.news.send_replace(());
    }

    /// A response with all messages, which lasts until the end of the stream.
    pub fn response(self: Arc<Stream>) -> Response {
        let news = self.news.subscribe();
        let body =
            futures::stream::unfold((self, 0, news), |(stream, from, mut news)| async move {
                loop {
                    news.mark_unchanged();
                    let (found, ended) = {
                        let kept = stream.kept();
                        (kept.after(from).cloned(), kept.ended)
                    };
                    if let Some((number, message)) = found {
                        return Some((Ok::<_, Infallible>(message), (stream, number + 1, news)));
                    }
                    if ended || news.changed().await.is_err() {
                        return None;
                    }
                }
            });
        let kind = [(header::CONTENT_TYPE, "application/octet-stream")];
        (kind, Body::from_stream(body)).into_response()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_messages_are_dropped_but_not_the_constant_ones() {
        let stream = Stream::new(10);
        stream.push(vec![0; 4], true);
        (1..8).for_each(|k| stream.push(vec![k; 4], false));
        let kept = stream.kept();
        let mut from = 0;
        let mut seen = vec![];
        while let Some((number, message)) = kept.after(from) {
            from = number + 1;
            seen.push(message[0]);
        }
        assert_eq!(seen, [0, 6, 7]);
    }
}
