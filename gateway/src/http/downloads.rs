//! Files that viewers take: the rolling recording, the frames of a contact, and the diagnostics bundle. One is made at a time,
//! off the thread of the server, so that viewers cost neither it nor much memory.

use std::convert::Infallible;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use axum::Router;
use axum::body::{Body, Bytes, HttpBody};
use axum::extract::{RawQuery, State};
use axum::http::header::{CONTENT_DISPOSITION, RETRY_AFTER};
use axum::http::{Method, StatusCode};
use axum::response::{IntoResponse as _, Response};
use axum::routing::get;
use hyper::body::{Frame, SizeHint};
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Value, json};
use tokio::sync::OwnedSemaphorePermit;

use super::routes::{JSON, Sources, TEXT, refused, typed, words};
use crate::bundle;
use crate::local::protocol::{contact_query, recording_query};
use crate::recording::{Contact, TakeError};

/// Bytes of a file that are handed to the connection at once.
const PART: usize = 64 * 1_024;

const PCAPNG: &str = "application/vnd.tcpdump.pcap";
const TAR: &str = "application/x-tar";

/// The first contacts of controllers.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ContactList {
    /// The contacts, newest first.
    pub contacts: Vec<Contact>,
}

/// The paths.
pub(super) fn routes() -> Router<Sources> {
    Router::new()
        .route("/recording.pcapng", get(recording))
        .route("/contact.pcapng", get(contact))
        .route("/bundle", get(archive))
        .route("/api/v1/contacts", get(contacts))
}

/// The paths in the description of the interface; `contacts` is the schema of [`ContactList`].
pub(super) fn describe(contacts: &Value) -> Vec<(&'static str, Value)> {
    let text = |description: &str| json!({ "description": description, "content": { "text/plain": { "schema": { "type": "string" } } } });
    let file = |summary: &str, kind: &str, parameter: Option<Value>| {
        let content = json!({ kind: { "schema": { "type": "string", "format": "binary" } } });
        let mut path = json!({ "get": { "summary": summary, "responses": {
            "200": { "description": summary, "content": content },
            "404": text("There is no such recording; why"),
            "503": text("Another file is being made"),
        } } });
        if let Some(parameter) = parameter {
            path["get"]["responses"]["400"] = text("The query is wrong; why");
            path["get"]["parameters"] = json!([parameter]);
        }
        path
    };
    let number = |name: &str, description: &str, required: bool| {
        json!({ "name": name, "in": "query", "description": description, "required": required,
                "schema": { "type": "integer", "minimum": 1 } })
    };
    let list = "First contacts of controllers, as `axisbridge contacts --json` shows them";
    let last = number("last", "Only the last seconds; without it as many as are kept", false);
    let which = number("number", "Number of the contact", true);
    vec![
        ("/recording.pcapng", file("The last seconds of the frames of all sides", PCAPNG, Some(last))),
        ("/contact.pcapng", file("The frames of a first contact", PCAPNG, Some(which))),
        ("/bundle", file("The diagnostics bundle, as `axisbridge bundle` writes it", TAR, None)),
        (
            "/api/v1/contacts",
            json!({ "get": { "summary": list, "responses": { "200": {
                "description": "Newest first",
                "content": { "application/json": { "schema": contacts } },
            } } } }),
        ),
    ]
}

async fn recording(State(sources): State<Sources>, method: Method, RawQuery(query): RawQuery) -> Response {
    let last = match recording_query(&mut words(query.as_deref()).into_iter()) {
        Ok(last) => last,
        Err(error) => return refused(&error),
    };
    let make = move |from: &bundle::Sources| {
        let recording = from.recording.as_ref();
        recording.map(|recording| recording.take(last.unwrap_or_else(|| recording.span())))
    };
    download(sources, method, (PCAPNG, "recording.pcapng"), make).await
}

async fn contact(State(sources): State<Sources>, method: Method, RawQuery(query): RawQuery) -> Response {
    let number = match contact_query(&mut words(query.as_deref()).into_iter()) {
        Ok(number) => number,
        Err(error) => return refused(&error),
    };
    let make =
        move |from: &bundle::Sources| from.recording.as_ref().map(|recording| recording.take_contact(number));
    download(sources, method, (PCAPNG, "contact.pcapng"), make).await
}

async fn archive(State(sources): State<Sources>, method: Method) -> Response {
    download(sources, method, (TAR, "axisbridge-bundle.tar"), |from| Some(from.bundle())).await
}

async fn contacts(State(sources): State<Sources>) -> Response {
    let recording = sources.view.sources().recording.as_ref();
    let contacts = recording.map(|recording| recording.contacts()).unwrap_or_default();
    typed(JSON, serde_json::to_string(&ContactList { contacts }).unwrap_or_default())
}

/// Makes a file and sends it.
async fn download(
    sources: Sources,
    method: Method,
    (kind, name): (&'static str, &str),
    make: impl FnOnce(&bundle::Sources) -> Option<Result<Vec<u8>, TakeError>> + Send + 'static,
) -> Response {
    let nothing = || (StatusCode::NOT_FOUND, typed(TEXT, "nothing is recorded\n")).into_response();
    let from = Arc::clone(sources.view.sources());
    if method == Method::HEAD {
        return typed(kind, ());
    }
    let Ok(place) = Arc::clone(&sources.downloads).try_acquire_owned() else { return busy() };
    let Ok(made) = tokio::task::spawn_blocking(move || make(&from)).await else { return nothing() };
    match made {
        None => nothing(),
        Some(Ok(file)) => {
            let body = Body::new(Download { rest: Bytes::from(file), _place: place });
            let disposition = format!("attachment; filename=\"{name}\"");
            ([(CONTENT_DISPOSITION, disposition)], typed(kind, body)).into_response()
        }
        Some(Err(TakeError::Busy)) => busy(),
        Some(Err(error)) => (StatusCode::NOT_FOUND, typed(TEXT, format!("{error}\n"))).into_response(),
    }
}

fn busy() -> Response {
    let text = typed(TEXT, "another file is being made or sent; try again\n");
    (StatusCode::SERVICE_UNAVAILABLE, [(RETRY_AFTER, "2")], text).into_response()
}

/// A file that is sent; the next one is made when it is gone.
struct Download {
    rest: Bytes,
    _place: OwnedSemaphorePermit,
}

impl HttpBody for Download {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        _context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        if self.rest.is_empty() {
            return Poll::Ready(None);
        }
        let len = self.rest.len().min(PART);
        Poll::Ready(Some(Ok(Frame::data(self.rest.split_to(len)))))
    }

    fn size_hint(&self) -> SizeHint {
        SizeHint::with_exact(u64::try_from(self.rest.len()).unwrap_or(u64::MAX))
    }
}
