//! The words of CIP Motion: what a request asks for, and what a state is shown as.

use super::facts::{
    AXIS_STATES, CONTROL_MODES, DRIVE_ACTIONS, FEEDBACK_MODES, REQUESTS, SEQUENCE, STOPPINGS,
};
use super::{Reporter, place_of};
use crate::Mapping;
use crate::finding::Findings;
use crate::finding::registry::{REQUEST_LOST, WRONG_BINDING, WRONG_ORDER, WRONG_STATE};
use crate::format::{Name, SequenceRow};

pub(super) fn check(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().cip_generic;
    let rows = &file.rows;
    let mut reporter = Reporter { source: &file.text, findings };
    requests(mapping, &mut reporter);
    for row in &rows.drive_action {
        let fact = DRIVE_ACTIONS.iter().find(|(action, _)| action == row.drive_action.get_ref());
        let Some((action, request)) = fact else { continue };
        differs(&mut reporter, action, row.request.as_ref(), *request, &row.drive_action);
    }
    for row in &rows.state {
        let fact = AXIS_STATES.iter().find(|(state, ..)| state == row.state.get_ref());
        let Some((state, axis_state, conditions)) = fact else { continue };
        if row.axis_state.get_ref() != axis_state {
            let what = [
                format!("`{state}` would be shown as `{}`", row.axis_state.get_ref()),
                format!("the Axis State of `{state}` is `{axis_state}`"),
                format!("write `axis_state = \"{axis_state}\"`"),
            ];
            reporter.report(WRONG_STATE, ("axis_state", row.axis_state.span()), what);
        }
        let mut given: Vec<&str> = row.conditions.iter().map(|name| name.get_ref().as_str()).collect();
        let mut right = conditions.to_vec();
        given.sort_unstable();
        right.sort_unstable();
        if given != right {
            let listed: Vec<String> = conditions.iter().map(|name| format!("\"{name}\"")).collect();
            let what = [
                format!("`{state}` holds other conditions"),
                format!(
                    "the state machine of the axis comes to `{axis_state}` with {}",
                    if conditions.is_empty() { "none".to_owned() } else { conditions.join(", ") }
                ),
                format!("write `conditions = [{}]`", listed.join(", ")),
            ];
            reporter.report(WRONG_STATE, ("state", row.state.span()), what);
        }
    }
    stoppings(mapping, &mut reporter);
    for row in &rows.mode {
        let fact = CONTROL_MODES.iter().find(|(control, _)| control == row.control_mode.get_ref());
        let Some((control, mode)) = fact.filter(|(_, mode)| mode != row.mode.get_ref()) else { continue };
        let what = [
            format!("`{control}` would select the operating mode `{}`", row.mode.get_ref()),
            format!("expected `{mode}`"),
            format!("write `mode = \"{mode}\"`"),
        ];
        reporter.report(WRONG_STATE, ("mode", row.mode.span()), what);
    }
    for row in &rows.feedback_mode {
        let fact = FEEDBACK_MODES.iter().find(|(known, _)| known == row.feedback_mode.get_ref());
        let Some((name, feedback)) = fact.filter(|(_, right)| right != row.feedback.get_ref()) else {
            continue;
        };
        let what = [
            format!("`{name}` would be taken by an axis with `feedback = \"{}\"`", row.feedback.get_ref()),
            format!("expected `{feedback}`: the encoders that the controller has set up"),
            format!("write `feedback = \"{feedback}\"`"),
        ];
        reporter.report(WRONG_STATE, ("feedback", row.feedback.span()), what);
    }
    sequence(&mut reporter, &rows.sequence);
}

/// The attributes that start and stop an axis.
fn sequence(reporter: &mut Reporter<'_>, row: &SequenceRow) {
    for (key, given) in row.attributes() {
        let fact = SEQUENCE.iter().find(|(known, _)| *known == key);
        let Some((_, right)) = fact.filter(|(_, right)| given.get_ref() != right) else { continue };
        let what = [
            format!("`{key}` would follow the attribute `{}`", given.get_ref()),
            format!("expected `{right}`: the controller sets that one"),
            format!("write `{key} = \"{right}\"`"),
        ];
        reporter.report(WRONG_BINDING, (key, given.span()), what);
    }
}

/// How an axis is stopped.
fn stoppings(mapping: &Mapping, reporter: &mut Reporter<'_>) {
    for row in &mapping.tables().cip_generic.rows.stopping {
        let name = row.stopping_action.get_ref();
        let Some((_, method, holds, abort)) = STOPPINGS.iter().find(|(known, ..)| known == name) else {
            continue;
        };
        for (key, given, right) in [("method", &row.method, method), ("abort", &row.abort, abort)] {
            if given.get_ref() == right {
                continue;
            }
            let what = [
                format!("`{name}` would stop the axis by `{}`", given.get_ref()),
                format!("expected `{right}`"),
                format!("write `{key} = \"{right}\"`"),
            ];
            reporter.report(WRONG_ORDER, (key, given.span()), what);
        }
        if row.holds != *holds {
            let what = [
                format!(
                    "`{name}` would {} the axis with torque at rest",
                    if row.holds { "hold" } else { "not hold" }
                ),
                format!("expected `holds = {holds}`, as its name says"),
                format!("write `holds = {holds}`"),
            ];
            reporter.report(WRONG_ORDER, ("stopping_action", row.stopping_action.span()), what);
        }
    }
}

/// Each request of the standard once, and each asks for what it says.
fn requests(mapping: &Mapping, reporter: &mut Reporter<'_>) {
    let rows = &mapping.tables().cip_generic.rows;
    for (at, row) in rows.request.iter().enumerate() {
        let control = row.axis_control.get_ref();
        if rows.request[..at].iter().any(|other| other.axis_control.get_ref() == control) {
            let what = [
                format!("two rows for `{control}`"),
                "the first one counts; the request that the other one was meant for is never carried out"
                    .to_owned(),
                "correct `axis_control` of one of them".to_owned(),
            ];
            reporter.report(REQUEST_LOST, ("axis_control", row.axis_control.span()), what);
        }
        let Some((_, request, response)) = REQUESTS.iter().find(|(known, ..)| known == control) else {
            continue;
        };
        differs(reporter, control, row.request.as_ref(), *request, &row.axis_control);
        if row.axis_response.get_ref() != response {
            let what = [
                format!("`{control}` would be answered with `{}`", row.axis_response.get_ref()),
                format!("expected `{response}`: the controller waits for it"),
                format!("write `axis_response = \"{response}\"`"),
            ];
            reporter.report(REQUEST_LOST, ("axis_response", row.axis_response.span()), what);
        }
    }
    for (control, ..) in REQUESTS {
        if !rows.request.iter().any(|row| row.axis_control.get_ref() == control) {
            let what = [
                format!("no row carries out `{control}`"),
                "the controller would wait for an answer in vain".to_owned(),
                format!("add a [[request]] row with `axis_control = \"{control}\"`"),
            ];
            reporter.report(REQUEST_LOST, ("mapping", rows.mapping.span()), what);
        }
    }
}

/// A row that asks for another request than its name says.
fn differs(reporter: &mut Reporter<'_>, what: &str, given: Option<&Name>, right: Option<&str>, row: &Name) {
    let asked = given.map(|name| name.get_ref().as_str());
    if asked == right {
        return;
    }
    let word =
        |request: Option<&str>| request.map_or_else(|| "nothing".to_owned(), |name| format!("`{name}`"));
    let help = match right {
        Some(right) => format!("write `request = \"{right}\"`"),
        None => "remove `request`".to_owned(),
    };
    let place = place_of("request", given, ("request", row));
    let text = [format!("`{what}` would ask for {}", word(asked)), format!("expected {}", word(right)), help];
    reporter.report(REQUEST_LOST, place, text);
}
