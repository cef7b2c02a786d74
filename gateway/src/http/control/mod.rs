//! Local control over a WebSocket (RFC 6455): the requests of the Unix socket, with a dead-man.
//!
//! ```text
//! client                          gateway
//!        <-- `beat 17` ---------  ten times a second
//!        -- `17 jog x 0.5` ---->  Session, as on the Unix socket
//!        <-- `ok jog x ...` ----
//! ```
//!
//! Each message of the client begins with the number of the newest beat that it has seen. So the gateway knows that the client has seen the
//! gateway lately, and how old a message is: nothing moves by a request that the network has kept. A client whose messages are too old, or that
//! says nothing for [`LOST`], has lost control: its axes stop and lose their torque. The stream itself ends with the connection.

mod beats;
#[cfg(test)]
mod tests;

use std::time::Duration;

use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::ws::{CloseFrame, Message, Utf8Bytes, WebSocket, WebSocketUpgrade};
use axum::http::header::{RETRY_AFTER, SEC_WEBSOCKET_PROTOCOL};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse as _, Response};
use profile_generic::time::DurationNs;
use serde_json::{Value, json};
use tokio::time::{Instant, MissedTickBehavior, interval, sleep_until, timeout, timeout_at};

use self::beats::{Age, Beats};
use super::access::Lease;
use super::login::{Entered, bearer, refuse, unknown};
use crate::engine::local::Order;
use crate::local::drive::job::Ask;
use crate::local::protocol::{BadRequest, LINE_MAX, Request};
use crate::local::{Session, Taken, Who};

/// Time from one beat of the gateway to the next.
const BEAT: Duration = Duration::from_millis(100);

/// Without a message that is not too old for so long, the client has lost control.
const LOST: Duration = Duration::from_millis(500);

/// How long an axis moves after a jog.
const JOG: DurationNs = DurationNs::from_millis(200);

/// How long the end of a stream waits for a client that does not read.
const CLOSE_TIME_OUT: Duration = Duration::from_secs(1);

/// The name of the protocol, which a client asks for.
const PROTOCOL: &str = "axisbridge.control";

/// What the key of a session follows where a browser cannot send another header.
const KEY_PROTOCOL: &str = "axisbridge.session.";

/// Longest message: a number, and a line.
const MESSAGE_MAX: usize = LINE_MAX + 16;

/// Code of a close frame for a client that has broken the rules (RFC 6455 clause 7.4.1).
const POLICY: u16 = 1008;

/// Code of a close frame at the normal end.
const NORMAL: u16 = 1000;

/// The path in the description of the interface.
pub(super) fn describe() -> Value {
    let text = |description: &str| json!({ "description": description, "content": { "text/plain": { "schema": { "type": "string" } } } });
    json!({ "get": {
        "summary": "Local control of the axes over a WebSocket with the protocol `axisbridge.control`; see docs/local-control.md",
        "description": "The key of a session is in `Authorization: Bearer KEY`, or a second protocol `axisbridge.session.KEY`. The gateway sends `beat N` ten times a second. A message of the client is the number of the newest beat and a request of local control. Axes stop and lose their torque at the end of the stream, and after 0.5 s without a message.",
        "security": [{ "bearer": [] }],
        "responses": {
            "101": { "description": "The stream" },
            "401": text("There is no session with this key for this host"),
            "403": text("No token is configured, or the request is from another site"),
            "426": text("The request is not that of a WebSocket"),
            "503": text("Four streams are open; see Retry-After"),
        },
    } })
}

/// Begins a stream.
pub(super) async fn control(
    Entered { gate, from }: Entered,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Response {
    let key = bearer(&headers).or_else(|| of_protocols(&headers));
    let now = std::time::Instant::now();
    let Some(lease) = key.and_then(|key| gate.sessions.lease(now, from.ip(), key)) else {
        return unknown("there is no such session: `POST /api/v1/session` opens one");
    };
    let Ok(upgrade) = upgrade else {
        return refuse(StatusCode::UPGRADE_REQUIRED, "expected a WebSocket of version 13");
    };
    let Ok(place) = std::sync::Arc::clone(&gate.streams).try_acquire_owned() else {
        let full = refuse(StatusCode::SERVICE_UNAVAILABLE, "too many control streams are open");
        return ([(RETRY_AFTER, "10")], full).into_response();
    };
    let door = gate.door.clone();
    let upgrade = upgrade.protocols([PROTOCOL]).max_message_size(MESSAGE_MAX).max_frame_size(MESSAGE_MAX);
    upgrade.on_upgrade(async move |socket| {
        let session = door.enter(Who::Host(from)).limit_jogs(JOG);
        let client = session.id();
        tracing::info!(client, %from, "HTTP control: client connected");
        let end = serve(socket, session, lease).await;
        tracing::info!(client, %from, why = end.why(), "HTTP control: client disconnected");
        drop(place);
    })
}

/// The key of a session among the protocols that a client asks for.
fn of_protocols(headers: &HeaderMap) -> Option<&str> {
    let lists = headers.get_all(SEC_WEBSOCKET_PROTOCOL).iter().filter_map(|list| list.to_str().ok());
    lists.flat_map(|list| list.split(',')).find_map(|name| name.trim_ascii().strip_prefix(KEY_PROTOCOL))
}

/// How a stream has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    /// The client has closed it, or its connection is gone.
    Gone,
    /// Nothing came from the client for too long.
    Silent,
    /// The client does not read its replies.
    Unread,
    /// The session was ended.
    Session,
    /// A message was too long, or no text.
    Message,
}

impl End {
    const fn why(self) -> &'static str {
        match self {
            Self::Gone => "the connection has ended",
            Self::Silent => "no beat of the client in time",
            Self::Unread => "the client does not read its replies",
            Self::Session => "the session has ended",
            Self::Message => "a message was too long, or no text",
        }
    }

    const fn code(self) -> u16 {
        match self {
            Self::Gone | Self::Session => NORMAL,
            Self::Silent | Self::Unread | Self::Message => POLICY,
        }
    }
}

/// Serves a client until it is gone, and lets its axes stop.
async fn serve(mut socket: WebSocket, mut session: Session, mut lease: Lease) -> End {
    let end = until_end(&mut socket, &mut session, &mut lease).await;
    // First of all: the axes stop.
    drop(session);
    let frame = CloseFrame { code: end.code(), reason: Utf8Bytes::from_static(end.why()) };
    let _ = timeout(CLOSE_TIME_OUT, socket.send(Message::Close(Some(frame)))).await;
    end
}

async fn until_end(socket: &mut WebSocket, session: &mut Session, lease: &mut Lease) -> End {
    let mut beats = Beats::default();
    let mut interval = interval(BEAT);
    interval.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut lost = Instant::now() + LOST;
    loop {
        let text = tokio::select! {
            // Whatever else there is to do: a client that is lost moves nothing.
            biased;
            () = sleep_until(lost) => return End::Silent,
            () = lease.ended() => return End::Session,
            message = socket.recv() => {
                let now = Instant::now();
                match message {
                    Some(Ok(Message::Text(text))) => {
                        let (age, line) = beats.age(now, &text);
                        if age == Age::Fresh {
                            lost = now + LOST;
                        }
                        take(session, age, line)
                    }
                    Some(Ok(Message::Ping(_) | Message::Pong(_))) => continue,
                    Some(Ok(Message::Binary(_))) => return End::Message,
                    Some(Ok(Message::Close(_)) | Err(_)) | None => return End::Gone,
                }
            }
            reply = session.reply() => match reply {
                Some(reply) => reply,
                None => return End::Unread,
            },
            _ = interval.tick() => beats.next(Instant::now()),
        };
        let text = text.trim_end();
        if text.is_empty() {
            continue;
        }
        match timeout_at(lost, socket.send(Message::text(text))).await {
            Ok(Ok(())) => {}
            Ok(Err(_)) => return End::Gone,
            Err(_) => return End::Unread,
        }
    }
}

/// Takes a request: its reply, or nothing if the engine is asked.
fn take(session: &mut Session, age: Age, line: &str) -> String {
    let line = match line.len() {
        ..=LINE_MAX if line.contains(|letter: char| letter.is_control()) => Err(BadRequest::NotText),
        ..=LINE_MAX => Ok(line.to_owned()),
        _ => Err(BadRequest::TooLong),
    };
    let request = match session.parse(&line) {
        Ok(request) => request,
        Err(reply) => return reply,
    };
    let line = line.unwrap_or_default();
    let word = line.split_ascii_whitespace().next().unwrap_or("-");
    let axis = line.split_ascii_whitespace().nth(1).unwrap_or("-");
    match request {
        // What ends a movement is never too late.
        Request::Axes
        | Request::Status { .. }
        | Request::Order { order: Order::Stop | Order::Disable, .. } => {}
        Request::Drive { ask: Ask::List { .. } | Ask::Command { .. }, .. } => return not_here(word),
        Request::Order { .. } | Request::Drive { .. } | Request::Parameter { .. } if age == Age::Fresh => {}
        Request::Order { .. } | Request::Drive { .. } | Request::Parameter { .. } => {
            return format!(
                "error {word} {axis} late: the request was on its way for too long, nothing was done\n"
            );
        }
        _ => return not_here(word),
    }
    match session.begin_request(request, &line) {
        Taken::Reply(reply) => reply,
        // No request for a file comes here.
        Taken::Asked | Taken::File(_) => String::new(),
    }
}

/// The reply to what only the Unix socket has.
fn not_here(word: &str) -> String {
    format!("error {word} - not-here: `{word}` is a request for the Unix socket\n")
}
