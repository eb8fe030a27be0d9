//! Who may speak to the server: the page that it has served, and nobody else.

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::fmt::Write;
use std::io;
use std::net::SocketAddr;

/// The largest body of a request, bytes. A stroke over 5 million scattered faces has about as many.
pub(super) const MOST_BYTES: usize = 64 << 20;

/// What a request has to name.
#[derive(Clone, Debug)]
pub(super) struct Guard {
    /// The hosts in the address of the page: `127.0.0.1:PORT` and `localhost:PORT`.
    hosts: [String; 2],
}

/// Headers of every answer. Nothing is kept by the browser, shown in frames or read by other pages.
const HEADERS: [(HeaderName, &str); 6] = [
    (header::CACHE_CONTROL, "no-store"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
];

impl Guard {
    pub(super) fn of(address: SocketAddr) -> Self {
        let port = address.port();
        Self { hosts: [format!("127.0.0.1:{port}"), format!("localhost:{port}")] }
    }

    /// Whether a request was made to this server by its own page, or by a program of the user.
    ///
    /// `Host` keeps out pages whose names were made to lead here (DNS rebinding), `Origin` all other pages.
    /// A browser sends an `Origin` with every POST, and with a GET to another origin.
    fn lets_in(&self, headers: &HeaderMap) -> bool {
        let is_host = |text: &str| self.hosts.iter().any(|host| host == text);
        let all = |name: HeaderName, fits: &dyn Fn(&str) -> bool| {
            let values = headers.get_all(name);
            values.iter().all(|value| value.to_str().is_ok_and(fits))
        };
        let is_origin = |text: &str| text.strip_prefix("http://").is_some_and(is_host);
        headers.contains_key(header::HOST) && all(header::HOST, &is_host) && all(header::ORIGIN, &is_origin)
    }
}

/// Answers requests that the guard does not let in, and adds [`HEADERS`] to every answer.
pub(super) async fn guarded(State(guard): State<Guard>, request: Request, next: Next) -> Response {
    let length = request.headers().get(header::CONTENT_LENGTH);
    let length = length.and_then(|value| value.to_str().ok()?.parse::<u64>().ok());
    let mut response = if guard.lets_in(request.headers()) {
        if length.is_some_and(|length| length > MOST_BYTES as u64) {
            // The rest of the application would begin to read it first.
            StatusCode::PAYLOAD_TOO_LARGE.into_response()
        } else {
            next.run(request).await
        }
    } else {
        (StatusCode::FORBIDDEN, "This server answers the page that it has opened, and no other.\n")
            .into_response()
    };
    for (name, value) in HEADERS {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

/// Returns 128 random bits as text: who does not know them cannot name an address of this server.
///
/// # Errors
/// If the system has no random numbers.
pub(super) fn token() -> io::Result<String> {
    let mut bytes = [0u8; 16];
    getrandom::fill(&mut bytes).map_err(io::Error::other)?;
    let mut text = String::new();
    for byte in bytes {
        // Writing to a string does not fail.
        let _ = write!(text, "{byte:02x}");
    }
    Ok(text)
}
