//! This module refuses requests that do not come from a page of this program.

use super::HOST;
use super::connections::Visitor;
use axum::Extension;
use axum::Router;
use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::MethodRouter;
use std::sync::Arc;

/// Maximum size of the body of a request (bytes).
pub const MAX_BODY: usize = 16 * 1024;

/// Content security policy: pages load only from this server. The viewer's own messages to its
/// makers are blocked by it.
const POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; \
    style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; \
    frame-src 'self'; worker-src 'self' blob:; frame-ancestors 'self'; base-uri 'none'; \
    form-action 'none'; connect-src 'self'";

/// What a request must show.
pub struct Guard {
    token: String,
    /// Ports of the servers. Pages of the first may read from the others.
    ports: Vec<u16>,
    policy: HeaderValue,
}

impl Guard {
    /// A guard with a new token for servers on the given ports.
    ///
    /// # Errors
    /// The system provides no random numbers.
    pub fn new(ports: &[u16]) -> Result<Guard, getrandom::Error> {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes)?;
        let others = ports.iter().skip(1).map(|port| format!(" http://{HOST}:{port}"));
        let policy = HeaderValue::from_str(&(POLICY.to_string() + &others.collect::<String>()));
        Ok(Guard {
            token: bytes.iter().map(|b| format!("{b:02x}")).collect(),
            ports: ports.to_vec(),
            policy: policy.unwrap_or(HeaderValue::from_static(POLICY)),
        })
    }

    /// Address of a server, with the token.
    pub fn url(&self, port: u16) -> String {
        format!("http://{HOST}:{port}/{}/", self.token)
    }

    /// Puts routes below the token and behind this guard; `index` is the page at its root.
    pub fn protect<S: Clone + Send + Sync + 'static>(
        self: Arc<Guard>,
        index: MethodRouter<S>,
        inside: Router<S>,
        state: S,
    ) -> Router {
        // A nested router does not match its own root with a trailing slash.
        let root = format!("/{}", self.token);
        let all = Router::new().route(&format!("{root}/"), index).nest(&root, inside);
        all.layer(DefaultBodyLimit::max(MAX_BODY))
            .layer(from_fn_with_state(self, check))
            .with_state(state)
    }

    /// Whether a host with a port, or an origin without its scheme, is one of these servers.
    fn is_ours(&self, host: &str) -> bool {
        self.ports
            .iter()
            .any(|port| ["127.0.0.1", "localhost"].iter().any(|n| host == format!("{n}:{port}")))
    }

    fn admit(&self, request: &Request) -> Result<(), &'static str> {
        let headers = request.headers();
        if !text(headers, header::HOST).is_some_and(|host| self.is_ours(host)) {
            return Err("the host name of this page must be that of this machine\n");
        }
        let ours = |origin: &str| origin.strip_prefix("http://").is_some_and(|h| self.is_ours(h));
        if text(headers, header::ORIGIN).is_some_and(|origin| !ours(origin)) {
            return Err("requests from other sites are refused\n");
        }
        let given = request.uri().path().split('/').nth(1).unwrap_or_default();
        if !same(given, &self.token) {
            return Err("the address lacks the token that grainscope printed\n");
        }
        Ok(())
    }
}

fn text(headers: &HeaderMap, name: HeaderName) -> Option<&str> {
    headers.get(name).map(|v| v.to_str().unwrap_or("?"))
}

/// Compares in constant time, so that the duration does not reveal a partly correct token.
fn same(a: &str, b: &str) -> bool {
    let differ = a.bytes().zip(b.bytes()).fold(0, |all, (a, b)| all | (a ^ b));
    a.len() == b.len() && differ == 0
}

/// Refuses requests that are not from a page of this program, and adds the security headers.
async fn check(
    State(guard): State<Arc<Guard>>,
    visitor: Option<Extension<Arc<Visitor>>>,
    request: Request,
    next: Next,
) -> Response {
    // A page of the first server that reads from another one. Its origin is checked below.
    let reader = request.headers().get(header::ORIGIN).cloned();
    let admitted = guard.admit(&request);
    let mut response = match admitted {
        Ok(()) if visitor.is_none_or(|v| v.enter()) => next.run(request).await,
        Ok(()) => (StatusCode::SERVICE_UNAVAILABLE, "too many connections\n").into_response(),
        Err(why) => (StatusCode::FORBIDDEN, why).into_response(),
    };
    let headers = response.headers_mut();
    for (name, value) in [
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_FRAME_OPTIONS, "SAMEORIGIN"),
        (header::CACHE_CONTROL, "no-store"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    headers.insert(header::CONTENT_SECURITY_POLICY, guard.policy.clone());
    if let (Ok(()), Some(origin)) = (admitted, reader) {
        headers.insert(header::ACCESS_CONTROL_ALLOW_ORIGIN, origin);
    }
    response
}
