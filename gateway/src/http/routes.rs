//! The paths, and what answers them.

use std::sync::Arc;

use axum::Router;
use axum::extract::{RawQuery, State};
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HeaderName, HeaderValue, REFERRER_POLICY,
    RETRY_AFTER, X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{Method, StatusCode};
use axum::middleware::map_response;
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use tokio::sync::Semaphore;

use super::api::openapi;
use super::downloads;
use super::events::Events;
use super::metrics::metrics;
use super::page;
use super::server::Load;
use super::view::{HTTP_LINES_MAX, View};
use crate::local::protocol::{BadRequest, fault_query, log_query};

pub(super) const TEXT: &str = "text/plain; charset=utf-8";
pub(super) const JSON: &str = "application/json";
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
}

/// The paths of the server. `GET` and `HEAD` are answered; every other method is refused.
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
    // The object has texts, numbers and lists, and nothing that JSON does not know.
    typed(JSON, serde_json::to_string(&sources.view.look().status).unwrap_or_default())
}

async fn faults(State(sources): State<Sources>, RawQuery(query): RawQuery) -> Response {
    match fault_query(&words(query.as_deref()), &sources.view.axes()) {
        Ok(axis) => {
            typed(JSON, serde_json::to_string(&sources.view.faults(axis.as_deref())).unwrap_or_default())
        }
        Err(error) => refused(&error),
    }
}

async fn log(State(sources): State<Sources>, RawQuery(query): RawQuery) -> Response {
    match log_query(&mut words(query.as_deref()).into_iter(), &sources.view.axes(), HTTP_LINES_MAX) {
        Ok(query) => typed(JSON, serde_json::to_string(&sources.view.log(&query)).unwrap_or_default()),
        Err(error) => refused(&error),
    }
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
