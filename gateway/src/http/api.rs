//! The description of the interface for programs: OpenAPI 3.1, with the schemas of the types that are answered.

use schemars::generate::SchemaSettings;
use serde_json::{Value, json};

use super::control;
use super::downloads::{self, ContactList};
use super::login::{self, Offer, Opened};
use super::parameters::{self, ParameterAnswers, ParameterList};
use super::sheet::AxisSheet;
use super::traces::{AxisTraces, TimeTraces};
use super::view::{FaultList, HTTP_FAULTS_MAX, HTTP_LINES_MAX, LogLines, Look};
use crate::config::LogLevel;
use crate::history::LogQuery;
use crate::local::overview::Overview;

/// Where OpenAPI keeps the schemas.
const SCHEMAS: &str = "/components/schemas";

/// The description of all paths.
#[must_use]
pub fn openapi() -> Value {
    let mut settings = SchemaSettings::draft2020_12().for_serialize();
    settings.definitions_path = SCHEMAS.into();
    let mut generator = settings.into_generator();
    let overview = generator.subschema_for::<Overview>();
    let look = generator.subschema_for::<Look>();
    let faults = generator.subschema_for::<FaultList>();
    let lines = generator.subschema_for::<LogLines>();
    let traces = generator.subschema_for::<AxisTraces>();
    let times = generator.subschema_for::<TimeTraces>();
    let sheet = generator.subschema_for::<AxisSheet>();
    let contacts = generator.subschema_for::<ContactList>();
    let offer = generator.subschema_for::<Offer>();
    let opened = generator.subschema_for::<Opened>();
    let parameter_list = generator.subschema_for::<ParameterList>();
    let parameter_answers = generator.subschema_for::<ParameterAnswers>();
    let schemas = generator.take_definitions(false);
    let json = |schema: &schemars::Schema| json!({ "application/json": { "schema": schema } });
    let text = |kind: &str| json!({ kind: { "schema": { "type": "string" } } });
    let good = |description: &str, content: Value| json!({ "description": description, "content": content });
    let path =
        |summary: &str, responses: Value| json!({ "get": { "summary": summary, "responses": responses } });
    let health = |summary: &str, good_text: &str, bad_text: &str| {
        let bad = good(bad_text, text("text/plain"));
        path(summary, json!({ "200": good(good_text, text("text/plain")), "503": bad }))
    };
    let file = |summary: &str, kind: &str| path(summary, json!({ "200": good(summary, text(kind)) }));
    let mut events = path(
        "The state of the gateway, twice a second, as server-sent events of the type `status`",
        json!({ "200": good("A stream without end", text("text/event-stream")) }),
    );
    events["get"]["responses"]["200"]["x-event-data"] = json!({ "status": look });
    events["get"]["responses"]["503"] = good("Too many viewers", text("text/plain"));
    let parameter = |name: &str, description: &str, schema: Value| json!({ "name": name, "in": "query", "description": description, "schema": schema });
    let of_axis = |what: &str| parameter("axis", what, json!({ "type": "string" }));
    let wrong = good("The query is wrong; why", text("text/plain"));
    let mut fault_list = path(
        "Faults that are present, and faults that were, as `axisbridge faults` shows them",
        json!({ "200": good(&format!("Newest first, at most {HTTP_FAULTS_MAX}"), json(&faults)), "400": wrong }),
    );
    fault_list["get"]["parameters"] = json!([of_axis("Only faults of this axis")]);
    let mut log = path(
        "Lines of the log, as `axisbridge log --json` shows them",
        json!({ "200": good("Oldest first", json(&lines)), "400": wrong }),
    );
    log["get"]["parameters"] = json!([
        parameter(
            "after",
            "Only lines after this number; without it the newest lines",
            json!({ "type": "integer", "minimum": 0 })
        ),
        parameter(
            "lines",
            "At most so many",
            json!({ "type": "integer", "minimum": 1, "maximum": HTTP_LINES_MAX, "default": LogQuery::default().lines })
        ),
        parameter(
            "level",
            "Only lines that matter at least as much",
            json!({ "enum": LogLevel::ALL.map(LogLevel::name) })
        ),
        of_axis("Only lines about this axis"),
    ]);
    let needed = |mut parameter: Value| {
        parameter["required"] = true.into();
        parameter
    };
    let after = || {
        let number = json!({ "type": "integer", "minimum": 0, "default": 0 });
        parameter("after", "Only samples after this number", number)
    };
    let mut axis_traces = path(
        "Command and actual values of the last minute of an axis, ten a second",
        json!({ "200": good("Oldest first", json(&traces)), "400": wrong }),
    );
    axis_traces["get"]["parameters"] = json!([needed(of_axis("The axis")), after()]);
    let mut time_traces = path(
        "Offset of system time and phase errors of the buses in the last ten minutes, one a second",
        json!({ "200": good("Oldest first", json(&times)), "400": wrong }),
    );
    time_traces["get"]["parameters"] = json!([after()]);
    let mut axis_sheet = path(
        "Limits of an axis, and where each of its values is on both sides",
        json!({ "200": good("What does not change while the gateway runs", json(&sheet)), "400": wrong }),
    );
    axis_sheet["get"]["parameters"] = json!([needed(of_axis("The axis"))]);
    let mut eds = path(
        "Electronic data sheet of a device, as `axisbridge eds` writes it",
        json!({ "200": good("The sheet", text("text/plain")), "400": wrong }),
    );
    eds["get"]["parameters"] =
        json!([needed(parameter("device", "The device", json!({ "type": "string" })))]);
    let missing = good("The text of the configuration is not known", text("text/plain"));
    let configuration = path(
        "The configuration, without comments and secrets",
        json!({ "200": good("Its keys and values", text("application/toml")), "404": missing }),
    );
    let status = "The same object as that of `axisbridge status --json`";
    let mut description = json!({
        "openapi": "3.1.0",
        "info": {
            "title": "Axisbridge",
            "version": env!("CARGO_PKG_VERSION"),
            "description": "The state of a running gateway. Every path is read-only but those of sessions and control.",
        },
        "paths": {
            "/": file("Page for people", "text/html"),
            "/page.css": file("Style of the page", "text/css"),
            "/page.js": file("Program of the page", "text/javascript"),
            "/events": events,
            "/healthz": health(
                "Whether the cycle thread is alive", "It has published its state in time", "Why not"),
            "/readyz": health(
                "Whether every bus is in cyclic operation, and every axis commissioned and without fault",
                "Nothing is missing",
                "What is missing, one on each line",
            ),
            "/metrics": file("Metrics in the text format of OpenMetrics 1.0", "application/openmetrics-text"),
            "/api/v1/status": path(status, json!({ "200": good(status, json(&overview)) })),
            "/api/v1/faults": fault_list,
            "/api/v1/log": log,
            "/api/v1/traces": axis_traces,
            "/api/v1/time": time_traces,
            "/api/v1/axis": axis_sheet,
            "/api/v1/eds": eds,
            "/api/v1/configuration": configuration,
            "/api/v1/openapi.json": path(
                "This description",
                json!({ "200": good("OpenAPI 3.1", json!({ "application/json": { "schema": { "type": "object" } } })) }),
            ),
        },
        "components": { "schemas": schemas, "securitySchemes": { "bearer": { "type": "http", "scheme": "bearer" } } },
    });
    description["paths"]["/api/v1/session"] = login::describe(&json!(offer), &json!(opened));
    description["paths"]["/api/v1/control"] = control::describe();
    let of_drives = parameters::describe(&json!(parameter_list), &json!(parameter_answers));
    for (path, described) in downloads::describe(&json!(contacts)).into_iter().chain(of_drives) {
        description["paths"][path] = described;
    }
    description
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::contact::{Contact, Phase, PhaseReached, RefusedService};

    #[test]
    fn answer_has_exactly_the_fields_of_the_schema() {
        let description = openapi();
        let (view, _publisher) = super::super::view::tests::view();
        let status = serde_json::to_value(view.look()).unwrap();
        let look = &description["components"]["schemas"]["Look"];
        compare(&description, look, &status, "Look");
        let faults = serde_json::to_value(view.faults(None)).unwrap();
        compare(&description, &description["components"]["schemas"]["FaultList"], &faults, "FaultList");
        let lines = serde_json::to_value(view.log(&LogQuery::default())).unwrap();
        compare(&description, &description["components"]["schemas"]["LogLines"], &lines, "LogLines");
        view.sample();
        for (name, answer) in [
            ("AxisTraces", serde_json::to_value(view.axis_traces(0, 0)).unwrap()),
            ("TimeTraces", serde_json::to_value(view.time_traces(0)).unwrap()),
            ("AxisSheet", serde_json::to_value(view.sheet(1)).unwrap()),
        ] {
            compare(&description, &description["components"]["schemas"][name], &answer, name);
        }
        let contact = Contact {
            phases: vec![PhaseReached { phase: Phase::GroupSync, after_ms: 1 }],
            refused: vec![RefusedService::default()],
            ..Contact::default()
        };
        for (name, answer) in super::parameters::tests::examples() {
            compare(&description, &description["components"]["schemas"][name], &answer, name);
        }
        let contacts = serde_json::to_value(ContactList { contacts: vec![contact] }).unwrap();
        compare(&description, &description["components"]["schemas"]["ContactList"], &contacts, "ContactList");
        let reference = &description["paths"]["/api/v1/status"]["get"]["responses"]["200"]["content"]["application/json"]
            ["schema"]["$ref"];
        assert_eq!(reference, "#/components/schemas/Overview");
    }

    /// Every field of an object is in its schema, and the other way round, as deep as they go.
    fn compare(description: &Value, schema: &Value, value: &Value, at: &str) {
        // A value that may be absent.
        let present =
            schema["anyOf"].as_array().and_then(|either| either.iter().find(|one| one["$ref"].is_string()));
        let schema = present.unwrap_or(schema);
        let schema = match schema["$ref"].as_str() {
            Some(reference) => description.pointer(reference.trim_start_matches('#')).expect("a schema"),
            None => schema,
        };
        match value {
            Value::Object(fields) => {
                let named = schema["properties"].as_object().unwrap_or_else(|| panic!("{at}: {schema}"));
                let keys = |map: &serde_json::Map<String, Value>| {
                    let mut keys: Vec<String> = map.keys().cloned().collect();
                    keys.sort();
                    keys
                };
                assert_eq!(keys(fields), keys(named), "{at}");
                for (key, value) in fields {
                    assert!(
                        named[key]["description"].is_string() || named[key]["$ref"].is_string(),
                        "{at}.{key}"
                    );
                    compare(description, &named[key], value, &format!("{at}.{key}"));
                }
            }
            Value::Array(items) => {
                for item in items {
                    compare(description, &schema["items"], item, at);
                }
            }
            _ => {}
        }
    }
}
