//! Every generic value is bound to what holds it by the standard.

use super::facts::{Binding, CYCLIC, OPPOSITES, PARAMETERS, SIGNALS, WORDS};
use super::{Reporter, is_standard};
use crate::Mapping;
use crate::finding::Findings;
use crate::finding::registry::WRONG_BINDING;
use crate::format::Name;

/// Which of the places of a binding.
type Places = fn(&Binding) -> &'static [&'static str];

pub(super) fn sercos(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let mut reporter = Reporter { source: &file.text, findings };
    let places: Places = |known| known.idns;
    let rows = &file.rows;
    for (word, idn) in [
        ("control", &rows.words.control),
        ("status", &rows.words.status),
        ("modes_supported", &rows.supported_modes.list),
    ] {
        bound(&mut reporter, WORDS, word, ("idn", idn), places, true);
    }
    for row in &rows.signal {
        bound(&mut reporter, SIGNALS, row.signal.get_ref(), ("idn", &row.idn), places, true);
    }
    for row in &rows.parameter {
        bound(&mut reporter, PARAMETERS, row.parameter.get_ref(), ("idn", &row.idn), places, false);
    }
}

pub(super) fn cia402(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_cia402;
    let mut reporter = Reporter { source: &file.text, findings };
    let places: Places = |known| known.objects;
    let words = &file.rows.words;
    for (word, object) in [
        ("control", &words.control),
        ("status", &words.status),
        ("mode", &words.mode),
        ("mode_shown", &words.mode_shown),
        ("modes_supported", &words.modes_supported),
        ("polarity", &words.polarity),
    ] {
        bound(&mut reporter, WORDS, word, (word, object), places, true);
    }
    for row in &file.rows.signal {
        bound(&mut reporter, SIGNALS, row.signal.get_ref(), ("object", &row.object), places, true);
    }
    for row in &file.rows.parameter {
        bound(&mut reporter, PARAMETERS, row.parameter.get_ref(), ("object", &row.object), places, false);
        let more = [("inverted", &row.inverted), ("common", &row.common)];
        for (key, object) in more {
            let Some(object) = object else { continue };
            let name = if key == "inverted" {
                opposite(row.parameter.get_ref())
            } else {
                row.parameter.get_ref().clone()
            };
            bound(&mut reporter, PARAMETERS, &name, (key, object), places, false);
        }
    }
}

/// The name of the same value in the other direction.
fn opposite(name: &str) -> String {
    if name.contains("positive") {
        name.replace("positive", "negative")
    } else {
        name.replace("negative", "positive")
    }
}

/// `strict`: nothing else of the standard will do. Otherwise only what the standard has for another value is wrong.
fn bound(
    reporter: &mut Reporter<'_>,
    facts: &[Binding],
    name: &str,
    (key, place): (&str, &Name),
    places: Places,
    strict: bool,
) {
    let given = place.get_ref().as_str();
    let Some(known) = facts.iter().find(|fact| fact.name == name) else { return };
    let right = places(known);
    if right.is_empty() || right.contains(&given) || !is_standard(given) {
        return;
    }
    let other = facts.iter().find(|fact| places(fact).contains(&given));
    if other.is_none() && !strict {
        return;
    }
    let holds = other.map_or_else(|| "something else".to_owned(), |fact| format!("`{}`", fact.name));
    let what = [
        format!("`{name}` is bound to {given}"),
        format!("{given} is {holds} by the standard; `{name}` is {}", right.join(" or ")),
        format!("write `{key} = \"{}\"`", right[0]),
    ];
    reporter.report(WRONG_BINDING, (key, place.span()), what);
}

/// Elements and attributes of CIP Motion.
pub(super) fn cip(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().cip_generic;
    let mut reporter = Reporter { source: &file.text, findings };
    for row in &file.rows.cyclic {
        let known = CYCLIC.iter().find(|(element, _)| element == row.element.get_ref());
        let Some((element, signal)) = known.filter(|(_, signal)| signal != row.signal.get_ref()) else {
            continue;
        };
        let what = [
            format!("`{element}` is bound to `{}`", row.signal.get_ref()),
            format!("expected `{signal}`"),
            format!("write `signal = \"{signal}\"`"),
        ];
        reporter.report(WRONG_BINDING, ("signal", row.signal.span()), what);
    }
    for row in &file.rows.attribute {
        for (key, bound) in [("parameter", &row.parameter), ("signal", &row.signal)] {
            let Some(bound) = bound else { continue };
            let attribute = row.attribute.get_ref();
            let Some((one, other)) = contradiction(attribute, bound.get_ref()) else { continue };
            let what = [
                format!("`{attribute}` is bound to `{}`", bound.get_ref()),
                format!("one says {one}, the other {other}"),
                format!("bind it to the {key} that says {one}"),
            ];
            reporter.report(WRONG_BINDING, (key, bound.span()), what);
        }
    }
}

/// The words by which two names exclude each other.
fn contradiction(one: &str, other: &str) -> Option<(&'static str, &'static str)> {
    let one = one.to_lowercase();
    let says = |text: &str, word: &str| text.contains(word);
    let pairs = OPPOSITES.iter().flat_map(|(left, right)| [(*left, *right), (*right, *left)]);
    let mut pairs = pairs.filter(|(left, right)| says(&one, left) && !says(&one, right));
    pairs.find(|(left, right)| says(other, right) && !says(other, left))
}
