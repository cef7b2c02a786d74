//! The paths, and what answers them.

use std::sync::Arc;

use axum::Router;
use axum::extract::{RawQuery, State};
use axum::http::header::{
    CACHE_CONTROL, CONNECTION, CONTENT_DISPOSITION, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HeaderName,
    HeaderValue, REFERRER_POLICY, RETRY_AFTER, X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{Method, StatusCode};
use axum::middleware::map_response;
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use serde::Serialize;
use tokio::sync::Semaphore;

use super::api::openapi;
use super::control;
use super::downloads;
use super::events::Events;
use super::login::{self, Gate};
use super::metrics::metrics;
use super::page;
use super::parameters::{self, Readers};
use super::server::Load;
use super::view::{HTTP_LINES_MAX, View};
use crate::local::protocol::{BadRequest, after_query, axis_query, fault_query, log_query, trace_query};

pub(super) const TEXT: &str = "text/plain; charset=utf-8";
pub(super) const JSON: &str = "application/json";
const TOML: &str = "application/toml";
const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// In every answer: nothing from elsewhere, nothing inside other pages, nothing kept.
const EVERYWHERE: [(HeaderName, &str); 4] = [
    (
        CONTENT_SECURITY_POLICY,
        "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src data:; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    (X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (REFERRER_POLICY, "no-referrer"),
    (CACHE_CONTROL, "no-store"),
];

/// What the answers are made of.
#[derive(Debug, Clone)]
pub struct Sources {
    /// The gateway.
    pub view: Arc<View>,
    /// The stream of events.
    pub events: Arc<Events>,
    /// The server's own counters.
    pub load: Arc<Load>,
    /// One file is made and sent at a time.
    pub downloads: Arc<Semaphore>,
    /// The parameters of drives; `None` where nobody can ask the engine.
    pub readers: Option<Arc<Readers>>,
    /// Control of the axes; `None` without a token.
    pub gate: Option<Arc<Gate>>,
    /// Whether connections are encrypted.
    pub encrypted: bool,
}

/// The paths of the server. `GET` and `HEAD` are answered; every other method is refused, but those of sessions.
pub fn routes(sources: Sources) -> Router {
    Router::new()
        .route("/", get(async || typed("text/html; charset=utf-8", page::HTML)))
        .route("/page.css", get(async || typed("text/css; charset=utf-8", page::CSS)))
        .route("/page.js", get(async || typed("text/javascript; charset=utf-8", page::JS)))
        .route("/events", get(events))
        .route("/healthz", get(healthz))
        .route("/readyz", get(readyz))
        .route("/metrics", get(scrape))
        .route("/api/v1/status", get(status))
        .route("/api/v1/faults", get(faults))
        .route("/api/v1/log", get(log))
        .route("/api/v1/traces", get(traces))
        .route("/api/v1/time", get(time))
        .route("/api/v1/axis", get(axis))
        .route("/api/v1/eds", get(eds))
        .route("/api/v1/configuration", get(configuration))
        .route("/api/v1/session", login::route())
        .route("/api/v1/control", get(control::control))
        .merge(parameters::routes())
        .merge(downloads::routes())
        .route("/api/v1/openapi.json", get(async || typed(JSON, openapi().to_string())))
        .fallback(async || (StatusCode::NOT_FOUND, typed(TEXT, "there is nothing at this path\n")))
        .layer(map_response(with_headers))
        .with_state(sources)
}

async fn with_headers(mut response: Response) -> Response {
    for (name, value) in EVERYWHERE {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    // A connection has one request. That of a WebSocket goes on without HTTP.
    if response.status() != StatusCode::SWITCHING_PROTOCOLS {
        response.headers_mut().insert(CONNECTION, HeaderValue::from_static("close"));
    }
    response
}

pub(super) fn typed(kind: &'static str, body: impl IntoResponse) -> Response {
    ([(CONTENT_TYPE, kind)], body).into_response()
}

async fn healthz(State(sources): State<Sources>) -> Response {
    match sources.view.look().health.reason {
        None => typed(TEXT, "alive\n"),
        Some(reason) => (StatusCode::SERVICE_UNAVAILABLE, typed(TEXT, format!("{reason}\n"))).into_response(),
    }
}

async fn readyz(State(sources): State<Sources>) -> Response {
    let health = sources.view.look().health;
    if health.ready {
        return typed(TEXT, "ready\n");
    }
    let missing = health.missing.join("\n");
    (StatusCode::SERVICE_UNAVAILABLE, typed(TEXT, format!("{missing}\n"))).into_response()
}

async fn scrape(State(sources): State<Sources>) -> Response {
    let text = metrics(&sources.view.look(), sources.view.started(), &sources.load.read());
    typed(OPEN_METRICS, text)
}

async fn status(State(sources): State<Sources>) -> Response {
    json(&sources.view.look().status)
}

async fn faults(State(sources): State<Sources>, RawQuery(query): RawQuery) -> Response {
    match fault_query(&words(query.as_deref()), &sources.view.axes()) {
        Ok(axis) => json(&sources.view.faults(axis.as_deref())),
        Err(error) => refused(&error),
    }
}

async fn log(State(sources): State<Sources>, RawQuery(query): RawQuery) -> Response {
    match log_query(&mut words(query.as_deref()).into_iter(), &sources.view.axes(), HTTP_LINES_MAX) {
        Ok(query) => json(&sources.view.log(&query)),
        Err(error) => refused(&error),
    }
}

async fn traces(State(sources): State<Sources>, RawQuery(query): RawQuery) -> Response {
    match trace_query(&words(query.as_deref()), &sources.view.axes()) {
        Ok((place, after)) => json(&sources.view.axis_traces(place, after)),
        Err(error) => refused(&error),
    }
}

async fn time(State(sources): State<Sources>, RawQuery(query): RawQuery) -> Response {
    match after_query(&words(query.as_deref())) {
        Ok(after) => json(&sources.view.time_traces(after)),
        Err(error) => refused(&error),
    }
}

async fn axis(State(sources): State<Sources>, RawQuery(query): RawQuery) -> Response {
    match axis_query(&words(query.as_deref()), &sources.view.axes()) {
        Ok(place) => json(&sources.view.sheet(place)),
        Err(error) => refused(&error),
    }
}

async fn eds(State(sources): State<Sources>, RawQuery(query): RawQuery) -> Response {
    let files = sources.view.files();
    let query = query.unwrap_or_default();
    match query.strip_prefix("device=").and_then(|device| Some((device, files.sheet(device)?))) {
        Some((device, sheet)) => file(TEXT, &format!("{device}.eds"), sheet.to_vec()),
        None => {
            let known: Vec<_> = files.sheets.iter().map(|(name, _)| name.as_str()).collect();
            let text = format!("unexpected `{query}`: expected device= and one of {}\n", known.join(", "));
            (StatusCode::BAD_REQUEST, typed(TEXT, text)).into_response()
        }
    }
}

async fn configuration(State(sources): State<Sources>) -> Response {
    match &sources.view.files().configuration {
        Some(text) => file(TOML, "axisbridge.toml", text.clone()),
        None => (StatusCode::NOT_FOUND, typed(TEXT, "the text of the configuration is not known\n"))
            .into_response(),
    }
}

/// An answer that a browser saves under a name. Names of devices need no escapes.
fn file(kind: &'static str, name: &str, body: impl IntoResponse) -> Response {
    let disposition = format!("attachment; filename=\"{name}\"");
    ([(CONTENT_DISPOSITION, disposition)], typed(kind, body)).into_response()
}

/// The object has texts, numbers and lists, and nothing that JSON does not know.
pub(super) fn json(object: &impl Serialize) -> Response {
    typed(JSON, serde_json::to_string(object).unwrap_or_default())
}

/// The parts of a query: names of axes and numbers need no escapes.
pub(super) fn words(query: Option<&str>) -> Vec<&str> {
    query.unwrap_or_default().split('&').filter(|word| !word.is_empty()).collect()
}

pub(super) fn refused(error: &BadRequest) -> Response {
    (StatusCode::BAD_REQUEST, typed(TEXT, format!("{error}\n"))).into_response()
}

async fn events(State(sources): State<Sources>, method: Method) -> Response {
    if method == Method::HEAD {
        return typed("text/event-stream", ());
    }
    match sources.events.stream() {
        Some(body) => typed("text/event-stream", body),
        None => {
            let busy = typed(TEXT, "too many viewers\n");
            (StatusCode::SERVICE_UNAVAILABLE, [(RETRY_AFTER, "10")], busy).into_response()
        }
    }
}
