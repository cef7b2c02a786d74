//! Parameters of drives, as they are in the drive now: read on demand, by everybody who can see the page.
//!
//! ```text
//! GET /api/v1/parameter?axis=x&id=S-0-0104 --one at a time--> Session --hub--> engine --bus--> drive
//! ```
//!
//! Each request has a session of local control of its own, which reads and does nothing else; writing takes a control stream. Of all viewers
//! together one access is in progress at a time: a tool on the Unix socket waits for one of them at most, and a drive has never two.

#[cfg(test)]
pub(super) mod tests;

use std::time::Duration;

use axum::Router;
use axum::extract::{Extension, RawQuery, State};
use axum::http::header::RETRY_AFTER;
use axum::http::{Method, StatusCode};
use axum::response::{IntoResponse as _, Response};
use axum::routing::get;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Value, json};
use tokio::sync::Semaphore;
use tokio::time::{Instant, timeout_at};

use super::login::{Remote, refuse};
use super::routes::{JSON, Sources, json as object, refused, typed, words};
use crate::local::drive::job::ParameterReport;
use crate::local::drive::reply::{List, Listed, Refused, report};
use crate::local::protocol::{BadRequest, axis_query};
use crate::local::{Door, Taken, Who};
use crate::parameter::id::Id;

/// Parameters of a request.
pub const IDS_MAX: usize = 8;

/// How long a request may take. What is not read until then is answered with `busy`.
const PATIENCE: Duration = Duration::from_secs(10);

/// What is refused when the time is over.
const NOT_IN_TIME: &str = "the drive was not asked in time: other accesses came first";

/// Reads parameters for everybody.
#[derive(Debug)]
pub struct Readers {
    door: Door,
    /// One access at a time.
    turn: Semaphore,
}

impl Readers {
    /// Reads through this door.
    pub(super) fn new(door: Door) -> Self {
        Self { door, turn: Semaphore::new(1) }
    }

    /// The reply to a request, or a refusal when it does not come in time. Dropped with the request, it leaves nothing behind.
    async fn ask(&self, from: Remote, line: String, end: Instant) -> String {
        let asked = timeout_at(end, async {
            let _turn = self.turn.acquire().await;
            let mut session = self.door.enter(Who::Host(from.0));
            match session.take(&Ok(line)) {
                Taken::Reply(reply) => reply,
                // The session has gone only with the gateway.
                Taken::Asked => session.reply().await.unwrap_or_default(),
                // No request for a file comes here.
                Taken::File(_) => String::new(),
            }
        });
        asked.await.unwrap_or_else(|_| format!("error read - busy: {NOT_IN_TIME}\n"))
    }
}

/// The parameters that are known of the drive of an axis.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ParameterList {
    /// The axis.
    pub axis: String,
    /// The kind of its bus: `sercos`, `canopen` or `devicenet`.
    pub bus: String,
    /// Where the list is from: an IDN of the drive, `file` or `dictionary`.
    pub source: String,
    /// The parameters, in the order of the list.
    pub parameters: Vec<ParameterRow>,
}

/// A parameter of a list.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ParameterRow {
    /// Its number in the words of the drive, or its name in the tables.
    pub id: String,
    /// Its name.
    pub name: Option<String>,
    /// What can be done with it, as far as it is known before the drive is asked.
    pub access: Option<String>,
    /// The type of its value.
    #[serde(rename = "type")]
    pub kind: Option<String>,
    /// Its unit.
    pub unit: Option<String>,
    /// Least value.
    pub minimum: Option<String>,
    /// Greatest value.
    pub maximum: Option<String>,
}

impl From<&Listed> for ParameterRow {
    fn from(listed: &Listed) -> Self {
        let detail = |key| Some(listed.detail(key).to_owned()).filter(|text| !text.is_empty());
        Self {
            id: listed.id.clone(),
            name: detail("name"),
            access: detail("access"),
            kind: detail("type"),
            unit: detail("unit"),
            minimum: detail("min"),
            maximum: detail("max"),
        }
    }
}

/// What drives say of parameters.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ParameterAnswers {
    /// An answer for each parameter, in the order of the request.
    pub parameters: Vec<ParameterAnswer>,
}

/// What a drive says of a parameter.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ParameterAnswer {
    /// The parameter, as it was asked for.
    pub id: String,
    /// What the drive has; `null` when it refuses.
    pub report: Option<ParameterReport>,
    /// Why there is no report.
    pub refused: Option<ParameterRefusal>,
}

/// Why a parameter was not read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ParameterRefusal {
    /// The code, as in the replies of local control.
    pub code: String,
    /// Its text, with the drive's own code.
    pub text: String,
}

impl ParameterAnswer {
    /// Takes the reply to a `read` apart.
    fn of(axis: &str, id: String, reply: &str) -> Self {
        let reply = reply.trim_end();
        let found = reply.strip_prefix(&format!("ok read {axis} ")).and_then(report);
        let refused = found.is_none().then(|| {
            let Refused { code, text } = Refused::parse(reply);
            ParameterRefusal { code, text }
        });
        Self { id, report: found, refused }
    }
}

/// The paths.
pub(super) fn routes() -> Router<Sources> {
    Router::new().route("/api/v1/parameters", get(list)).route("/api/v1/parameter", get(read))
}

/// The paths in the description of the interface; `rows` is the schema of [`ParameterList`], `answers` that of [`ParameterAnswers`].
pub(super) fn describe(rows: &Value, answers: &Value) -> Vec<(&'static str, Value)> {
    let text = |description: &str| json!({ "description": description, "content": { "text/plain": { "schema": { "type": "string" } } } });
    let path = |summary: &str, schema: &Value, parameters: Value| {
        json!({ "get": { "summary": summary, "parameters": parameters, "responses": {
            "200": { "description": summary, "content": { "application/json": { "schema": schema } } },
            "400": text("The query is wrong; why"),
            "503": text("The drive does not answer, or other accesses come first; see Retry-After"),
        } } })
    };
    let axis = json!({ "name": "axis", "in": "query", "required": true, "description": "The axis", "schema": { "type": "string" } });
    let id = json!({ "name": "id", "in": "query", "required": true,
        "description": format!("A parameter, up to {IDS_MAX} times: its number in the drive, or its name"),
        "schema": { "type": "array", "maxItems": IDS_MAX, "items": { "type": "string" } } });
    let brief = json!({ "name": "brief", "in": "query", "required": false, "allowEmptyValue": true,
        "description": "Without unit and limits, which take accesses of their own", "schema": { "type": "string" } });
    let list = "The parameters that are known of the drive of an axis, as `axisbridge param list` shows them";
    let read = "Parameters as their drive has them now, as `axisbridge param read` shows them";
    vec![
        ("/api/v1/parameters", path(list, rows, json!([axis]))),
        ("/api/v1/parameter", path(read, answers, json!([axis, id, brief]))),
    ]
}

/// What a request is for.
#[derive(Debug, PartialEq, Eq)]
struct Wanted {
    /// Place of the axis.
    place: usize,
    ids: Vec<String>,
    brief: bool,
}

/// Reads the query: `axis=AXIS&id=ID`, with `id` up to [`IDS_MAX`] times, and `brief`.
fn wanted(query: &[&str], axes: &[String]) -> Result<Wanted, BadRequest> {
    let (mut place, mut ids, mut brief) = (None, Vec::new(), false);
    for text in query {
        let unexpected = |expected| BadRequest::Unexpected { text: (*text).to_owned(), expected };
        match text.split_once('=').unwrap_or((text, "")) {
            ("axis", _) => place = Some(axis_query(&[text], axes)?),
            ("id", "") => return Err(unexpected("the number or name of a parameter after id=")),
            ("id", id) if ids.len() < IDS_MAX => ids.push(id.to_owned()),
            ("id", _) => return Err(unexpected("at most 8 parameters")),
            ("brief", "") => brief = true,
            _ => return Err(unexpected("axis=AXIS, id=ID or brief")),
        }
    }
    let place = place.ok_or(BadRequest::NoAxis("parameter"))?;
    if ids.is_empty() {
        return Err(BadRequest::Missing { word: "parameter", what: "id=ID" });
    }
    Ok(Wanted { place, ids, brief })
}

async fn list(
    State(sources): State<Sources>,
    Extension(from): Extension<Remote>,
    method: Method,
    RawQuery(query): RawQuery,
) -> Response {
    let mut axes = sources.view.axes();
    let place = match axis_query(&words(query.as_deref()), &axes) {
        Ok(place) => place,
        Err(error) => return refused(&error),
    };
    let Some(readers) = &sources.readers else { return nobody() };
    // A drive is not asked for what is not sent.
    if method == Method::HEAD {
        return typed(JSON, ());
    }
    let axis = axes.swap_remove(place);
    let reply = readers.ask(from, format!("list {axis}"), Instant::now() + PATIENCE).await;
    let mut lines: Vec<&str> = reply.lines().collect();
    let last = lines.pop().unwrap_or_default();
    match List::parse(&axis, lines, last) {
        Ok(List { axis, bus, source, parameters }) => object(&ParameterList {
            axis,
            bus,
            source,
            parameters: parameters.iter().map(ParameterRow::from).collect(),
        }),
        Err(why) => {
            let unavailable = refuse(StatusCode::SERVICE_UNAVAILABLE, why);
            ([(RETRY_AFTER, "3")], unavailable).into_response()
        }
    }
}

async fn read(
    State(sources): State<Sources>,
    Extension(from): Extension<Remote>,
    method: Method,
    RawQuery(query): RawQuery,
) -> Response {
    let mut axes = sources.view.axes();
    let Wanted { place, ids, brief } = match wanted(&words(query.as_deref()), &axes) {
        Ok(wanted) => wanted,
        Err(error) => return refused(&error),
    };
    let Some(readers) = &sources.readers else { return nobody() };
    if method == Method::HEAD {
        return typed(JSON, ());
    }
    let axis = axes.swap_remove(place);
    let end = Instant::now() + PATIENCE;
    let mut parameters = Vec::with_capacity(ids.len());
    for id in ids {
        // A parameter with a name has nothing that could be left out.
        let brief = if brief && Id::parse(&id).is_some() { " brief" } else { "" };
        let reply = readers.ask(from, format!("read {axis} {id}{brief}"), end).await;
        parameters.push(ParameterAnswer::of(&axis, id, &reply));
    }
    object(&ParameterAnswers { parameters })
}

/// The refusal of a server that cannot ask the engine.
fn nobody() -> Response {
    refuse(StatusCode::SERVICE_UNAVAILABLE, "this server has no access to drives")
}
