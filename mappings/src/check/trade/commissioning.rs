//! A step of commissioning is for the axes that need it, and in the phase in which it does what it is for.

use super::facts::{CIA402_STEPS_OF, SERCOS_STEPS_OF};
use super::{Reporter, place_of};
use crate::Mapping;
use crate::finding::Findings;
use crate::finding::registry::STEP_MISPLACED;
use crate::format::{CommissionRow, Name, WhenRow};

/// The axes that a step is for, as the key `when` has them; `None` = whatever they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct When {
    pub kind: Option<&'static str>,
    pub modulo: Option<bool>,
    pub set_scaling: Option<bool>,
    pub captures: Option<bool>,
}

impl When {
    /// Every axis.
    pub const ALWAYS: Self = Self { kind: None, modulo: None, set_scaling: None, captures: None };
    /// One that is to capture events.
    pub const CAPTURES: Self = Self { captures: Some(true), ..Self::ALWAYS };
    /// One of which the gateway sets the scaling.
    pub const SCALED: Self = Self { set_scaling: Some(true), ..Self::ALWAYS };
    pub const ROTARY: Self = Self { kind: Some("rotary"), ..Self::SCALED };
    pub const LINEAR: Self = Self { kind: Some("linear"), ..Self::SCALED };
    pub const TURNS: Self = Self { modulo: Some(true), ..Self::ROTARY };
    pub const TURNS_NOT: Self = Self { modulo: Some(false), ..Self::ROTARY };

    fn is(self, row: Option<&WhenRow>) -> bool {
        let Some(row) = row else { return self == Self::ALWAYS };
        row.kind.as_ref().map(|kind| kind.get_ref().as_str()) == self.kind
            && row.modulo == self.modulo
            && row.set_scaling == self.set_scaling
            && row.captures == self.captures
            && row.mode.is_none()
    }

    /// The key as it is written.
    fn key(self) -> Option<String> {
        let flag = |key: &str, value: Option<bool>| value.map(|value| format!("{key} = {value}"));
        let keys = [
            self.kind.map(|kind| format!("kind = \"{kind}\"")),
            flag("modulo", self.modulo),
            flag("set_scaling", self.set_scaling),
            flag("captures", self.captures),
        ];
        let keys: Vec<String> = keys.into_iter().flatten().collect();
        (!keys.is_empty()).then(|| format!("when = {{ {} }}", keys.join(", ")))
    }
}

/// A step: what it does, its IDN and value where it has some, the phase, and the axes.
pub(super) type Step = (&'static str, Option<&'static str>, Option<i64>, u8, When);

pub(super) fn sercos(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let mut reporter = Reporter { source: &file.text, findings };
    for row in &file.rows.commission {
        let of_row = |(verb, idn, value, ..): &&Step| {
            row.step.get_ref() == verb
                && row.idn.as_ref().map(|idn| idn.get_ref().as_str()) == *idn
                && row.value.as_ref().map(|value| *value.get_ref()) == *value
        };
        let Some((.., phase, when)) = SERCOS_STEPS_OF.iter().find(of_row) else { continue };
        let place = || place_of("idn", row.idn.as_ref(), ("do", &row.step));
        if row.phase.get_ref() != phase {
            let what = [
                format!("{} is done in CP{}", named(row), row.phase.get_ref()),
                format!(
                    "expected CP{phase}: the scaling and everything that depends on it is settled before CP3"
                ),
                format!("write `phase = {phase}`"),
            ];
            reporter.report(STEP_MISPLACED, ("phase", row.phase.span()), what);
        }
        if !when.is(row.when.as_ref()) {
            let key = when.key();
            let what = [
                format!("{} is for other axes than it is made for", named(row)),
                format!(
                    "expected {}",
                    key.as_deref().map_or("every axis".to_owned(), |key| format!("`{key}`"))
                ),
                key.map_or_else(|| "remove `when`".to_owned(), |key| format!("write `{key}`")),
            ];
            reporter.report(STEP_MISPLACED, place(), what);
        }
    }
}

/// A step in words.
fn named(row: &CommissionRow) -> String {
    let of =
        |name: &Option<Name>| name.as_ref().map(|name| format!(" {}", name.get_ref())).unwrap_or_default();
    let value = row.value.as_ref().map(|value| format!(" = {:#x}", value.get_ref())).unwrap_or_default();
    format!("`{}{}{}{value}`", row.step.get_ref(), of(&row.idn), of(&row.parameter))
}

pub(super) fn cia402(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_cia402;
    let mut reporter = Reporter { source: &file.text, findings };
    for row in file.rows.commission.iter().filter(|row| row.step.get_ref() == "write") {
        let Some(object) = &row.object else { continue };
        let Some((_, right)) = CIA402_STEPS_OF.iter().find(|(known, _)| known == object.get_ref()) else {
            continue;
        };
        let mut modes: Vec<&str> = row.modes.iter().map(|mode| mode.get_ref().as_str()).collect();
        modes.sort_unstable();
        if modes == *right {
            continue;
        }
        let listed: Vec<String> = right.iter().map(|mode| format!("\"{mode}\"")).collect();
        let (expected, help) = match right.is_empty() {
            true => ("every drive".to_owned(), "remove `modes`".to_owned()),
            false => (
                format!("those that are led in {}", right.join(", ")),
                format!("write `modes = [{}]`", listed.join(", ")),
            ),
        };
        let what = [
            format!("{} is written into other drives than it is made for", object.get_ref()),
            format!("expected {expected}"),
            help,
        ];
        reporter.report(STEP_MISPLACED, ("object", object.span()), what);
    }
}
