//! Sessions over HTTP: a client shows the token and gets the key of a session, which it shows from then on.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::{Extension, FromRequestParts, State};
use axum::http::header::{AUTHORIZATION, RETRY_AFTER, WWW_AUTHENTICATE};
use axum::http::request::Parts;
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse as _, Response};
use axum::routing::{MethodRouter, get};
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Value, json};
use tokio::sync::Semaphore;

use super::access::{Attempts, IDLE, Sessions, Token, same_origin};
use super::routes::{JSON, Sources, TEXT, typed};
use crate::line_limit::{LineKind, LineLimit, Peer};
use crate::local::Door;
use crate::sys::clock::monotonic_now;

/// How long a client has to wait that has come while the token of another one is verified, seconds.
const BUSY: u64 = 1;

/// Control streams at the same time.
pub(super) const STREAMS_MAX: usize = 4;

/// Control of the axes by those who have the token.
#[derive(Debug)]
pub struct Gate {
    pub(super) token: Arc<Token>,
    pub(super) door: Door,
    pub(super) sessions: Arc<Sessions>,
    pub(super) streams: Arc<Semaphore>,
    attempts: Attempts,
    /// One token is verified at a time: it takes a processor for tens of milliseconds.
    verifying: Arc<Semaphore>,
    limit: Arc<LineLimit>,
}

impl Gate {
    /// Control by this token, through this door.
    pub(super) fn new(token: Token, door: Door, limit: Arc<LineLimit>) -> Self {
        Self {
            token: Arc::new(token),
            door,
            sessions: Arc::default(),
            streams: Arc::new(Semaphore::new(STREAMS_MAX)),
            attempts: Attempts::default(),
            verifying: Arc::new(Semaphore::new(1)),
            limit,
        }
    }

    /// Whether a line about a host that was refused is to be written.
    pub(super) fn admits_line(&self, from: SocketAddr) -> bool {
        self.limit.admits(monotonic_now(), LineKind::Login, Peer::Host(from.ip()))
    }
}

/// Where the request of a connection comes from.
#[derive(Debug, Clone, Copy)]
pub struct Remote(pub SocketAddr);

/// Whether axes can be controlled over HTTP.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Offer {
    /// Whether a token is configured.
    pub control: bool,
    /// Whether the connection is encrypted.
    pub encrypted: bool,
}

/// A session that was opened.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Opened {
    /// Its key: 64 hexadecimal digits.
    pub session: String,
    /// After so many seconds without a control stream it ends, s.
    pub idle_s: u64,
}

/// The path.
pub(super) fn route() -> MethodRouter<Sources> {
    get(offer).post(open).delete(close)
}

/// The path in the description of the interface, with the schemas of [`Offer`] and [`Opened`].
pub(super) fn describe(offer: &Value, opened: &Value) -> Value {
    let text = |description: &str| json!({ "description": description, "content": { "text/plain": { "schema": { "type": "string" } } } });
    let object = |description: &str, schema: &Value| json!({ "description": description, "content": { "application/json": { "schema": schema } } });
    let refused = "No token is configured, or the request is from another site";
    json!({
        "get": {
            "summary": "Whether axes can be controlled over HTTP",
            "responses": { "200": object("Whether there is a token, and TLS", offer) },
        },
        "post": {
            "summary": "Show the token (`Authorization: Bearer TOKEN`) and get the key of a session",
            "security": [{ "bearer": [] }],
            "responses": {
                "200": object("The key, which is shown in place of the token from now on", opened),
                "401": text("The token is wrong, or there is none"),
                "403": text(refused),
                "429": text("The host has tried too often; see Retry-After"),
                "503": text("Another token is being verified, or every session is in use; see Retry-After"),
            },
        },
        "delete": {
            "summary": "End the session (`Authorization: Bearer KEY`); its control streams end, and with them their axes stop",
            "security": [{ "bearer": [] }],
            "responses": {
                "204": { "description": "It has ended" },
                "401": text("There is no session with this key for this host"),
                "403": text(refused),
            },
        },
    })
}

/// What `Authorization: Bearer` has.
pub(super) fn bearer(headers: &HeaderMap) -> Option<&str> {
    let (scheme, secret) = headers.get(AUTHORIZATION)?.to_str().ok()?.split_once(' ')?;
    scheme.eq_ignore_ascii_case("Bearer").then_some(secret.trim_ascii()).filter(|secret| !secret.is_empty())
}

/// A refusal in words.
pub(super) fn refuse(code: StatusCode, text: impl std::fmt::Display) -> Response {
    (code, typed(TEXT, format!("{text}\n"))).into_response()
}

/// A request of the page itself or of a program, where axes can be controlled.
pub(super) struct Entered {
    pub gate: Arc<Gate>,
    pub from: SocketAddr,
}

impl FromRequestParts<Sources> for Entered {
    /// There is no gate, or the request is from another site.
    type Rejection = Response;

    async fn from_request_parts(parts: &mut Parts, sources: &Sources) -> Result<Self, Response> {
        let remote = Extension::<Remote>::from_request_parts(parts, sources).await;
        let Extension(Remote(from)) = remote.map_err(|rejection| rejection.into_response())?;
        let Some(gate) = &sources.gate else {
            let text = "nobody controls axes over HTTP: `[http]` of the configuration has no `token`";
            return Err(refuse(StatusCode::FORBIDDEN, text));
        };
        same_origin(&parts.headers).map_err(|error| {
            if gate.admits_line(from) {
                tracing::warn!(%from, "HTTP control refused: {error}");
            }
            refuse(StatusCode::FORBIDDEN, error)
        })?;
        Ok(Self { gate: Arc::clone(gate), from })
    }
}

/// Nobody that is known.
pub(super) fn unknown(text: &str) -> Response {
    ([(WWW_AUTHENTICATE, "Bearer")], refuse(StatusCode::UNAUTHORIZED, text)).into_response()
}

async fn offer(State(sources): State<Sources>) -> Response {
    let offer = Offer { control: sources.gate.is_some(), encrypted: sources.encrypted };
    typed(JSON, serde_json::to_string(&offer).unwrap_or_default())
}

async fn open(Entered { gate, from }: Entered, headers: HeaderMap) -> Response {
    let Some(secret) = bearer(&headers).map(str::to_owned) else {
        return unknown("expected `Authorization: Bearer TOKEN`");
    };
    let host = from.ip();
    let later = |code, seconds: u64, text: String| {
        ([(RETRY_AFTER, seconds.to_string())], refuse(code, text)).into_response()
    };
    // Ahead of the attempt: a host does not lose one to another host that verifies.
    let Ok(verifies) = Arc::clone(&gate.verifying).try_acquire_owned() else {
        return later(StatusCode::SERVICE_UNAVAILABLE, BUSY, "another token is being verified".to_owned());
    };
    if let Err(wait) = gate.attempts.take(Instant::now(), host) {
        let seconds = wait.saturating_add(Duration::from_millis(999)).as_secs();
        let text = format!("too many attempts: the next one is in {seconds} s");
        if gate.admits_line(from) {
            tracing::warn!(%from, "HTTP control refused: {text}");
        }
        return later(StatusCode::TOO_MANY_REQUESTS, seconds, text);
    }
    let token = Arc::clone(&gate.token);
    // The thread has the nice value of this one: it takes what time the cycle leaves. A client that goes meanwhile does not let the next
    // one verify beside it.
    let verify = move || {
        let accepted = token.accepts(&secret);
        drop(verifies);
        accepted
    };
    if !tokio::task::spawn_blocking(verify).await.unwrap_or(false) {
        if gate.admits_line(from) {
            tracing::warn!(%from, "HTTP control refused: the token is wrong");
        }
        return unknown("the token is wrong");
    }
    gate.attempts.forget(host);
    match gate.sessions.open(Instant::now(), host) {
        Ok(session) => {
            tracing::info!(%from, "HTTP control: session opened with the token");
            let opened = Opened { session, idle_s: IDLE.as_secs() };
            typed(JSON, serde_json::to_string(&opened).unwrap_or_default())
        }
        Err(error) => later(StatusCode::SERVICE_UNAVAILABLE, BUSY, error.to_string()),
    }
}

async fn close(Entered { gate, from }: Entered, headers: HeaderMap) -> Response {
    let closed = bearer(&headers).is_some_and(|key| gate.sessions.close(Instant::now(), from.ip(), key));
    if !closed {
        return unknown("there is no such session");
    }
    tracing::info!(%from, "HTTP control: session ended");
    StatusCode::NO_CONTENT.into_response()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bearer_is_read_from_its_header_alone() {
        let of = |value: &str| {
            let mut headers = HeaderMap::new();
            headers.insert(AUTHORIZATION, value.parse().unwrap());
            bearer(&headers).map(str::to_owned)
        };
        assert_eq!(of("Bearer abc").as_deref(), Some("abc"));
        assert_eq!(of("bearer  abc").as_deref(), Some("abc"));
        for text in ["abc", "Basic abc", "Bearer", "Bearer ", ""] {
            assert_eq!(of(text), None, "{text}");
        }
        assert_eq!(bearer(&HeaderMap::new()), None);
    }
}
