//! Whether every attribute has an answer.

use std::collections::BTreeMap;

use crate::finding::registry as code;
use crate::finding::{Findings, Problem};
use crate::{DEVICE_FUNCTIONS, Mapping};

/// Device functions that the box offers with a drive: position, velocity and torque loop.
const OFFERED: &str = "PVT";

/// Looks for attributes that nobody answers for, and for required ones that are rejected.
pub(super) fn check(mapping: &Mapping, findings: &mut Findings) {
    let tables = mapping.tables();
    let (text, rows) = (&tables.cip_generic.text, &tables.cip_generic.rows);
    let places: BTreeMap<&str, _> = rows
        .reject
        .iter()
        .flat_map(|row| &row.attributes)
        .map(|name| (name.get_ref().as_str(), name.span()))
        .collect();
    for attribute in mapping.dictionaries.cip.attributes() {
        let required = DEVICE_FUNCTIONS.iter().zip(attribute.need.chars());
        let required: String = required
            .filter(|(function, need)| *need == 'R' && OFFERED.contains(**function))
            .map(|(function, _)| *function)
            .collect();
        if mapping.cip.attributes.iter().any(|row| row.attribute.id == attribute.id) {
            continue;
        }
        let rejected = mapping.cip.rejected.iter().find(|(id, _)| *id == attribute.id);
        let what = format!("attribute {} `{}`", attribute.id, attribute.name);
        match (rejected, places.get(attribute.name.as_str())) {
            (Some((_, reason)), Some(span)) if !required.is_empty() => {
                let problem = Problem::new(code::REQUIRED_UNSERVED, span.clone()).key("attributes");
                let problem = problem.title(format!("required {what} is not served"));
                findings.push(
                    text,
                    problem.expected(format!("required of {required}; the reason given: {reason}")),
                );
            }
            (Some(_), _) => {}
            (None, _) => {
                let problem = Problem::new(code::ATTRIBUTE_UNSAID, rows.mapping.span());
                let problem = problem.title(format!("{what} has no answer"));
                findings.push(
                    text,
                    problem.expected("expected an [[attribute]] row, or a place in a [[reject]] row"),
                );
            }
        }
    }
}
