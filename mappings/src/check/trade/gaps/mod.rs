//! What the profiles have and no row binds: a row that was taken away.
//!
//! An IDN or object that is left out on purpose stands in [[unbound]] with a reason. A status bit, an event, an edge or a step of
//! commissioning has no such place: without its row, the axis comes to operation and lacks it in silence.

pub(super) mod cia402;
pub(super) mod cip;
pub(super) mod sercos;

use super::Reporter;
use super::facts::WRITES;
use crate::finding::registry::NOTHING_BOUND;
use crate::finding::{Findings, Source};
use crate::format::{Name, UnitRow};

/// A table in which rows are missed, with the place that stands for it.
struct Table<'a> {
    reporter: Reporter<'a>,
    mapping: &'a Name,
}

impl<'a> Table<'a> {
    const fn new(source: &'a Source, mapping: &'a Name, findings: &'a mut Findings) -> Self {
        Self { reporter: Reporter { source, findings }, mapping }
    }

    /// Reports what no row of a list has.
    fn lacks(&mut self, list: &str, what: &str, why: &str) {
        let what =
            [format!("no [[{list}]] row has {what}"), why.to_owned(), format!("add the row to [[{list}]]")];
        self.reporter.report(NOTHING_BOUND, ("mapping", self.mapping.span()), what);
    }

    /// Reports what a list has to have, unless one of its rows has it.
    fn wants(&mut self, has: bool, list: &str, what: &str, why: &str) {
        if !has {
            self.lacks(list, what, why);
        }
    }

    /// Reports what is neither bound nor left out for a reason.
    fn unanswered(&mut self, what: &str, name: &str) {
        let what = [
            format!("no row binds {what} ({name})"),
            "nothing would be read from it or written to it, and nobody has said why".to_owned(),
            "bind it, or name it in an [[unbound]] row with the reason".to_owned(),
        ];
        self.reporter.report(NOTHING_BOUND, ("mapping", self.mapping.span()), what);
    }
}

fn is(name: &Name, wanted: &str) -> bool {
    name.get_ref() == wanted
}

fn is_named(name: Option<&Name>, wanted: &str) -> bool {
    name.is_some_and(|name| is(name, wanted))
}

/// Whether the drive makes the way.
fn by(interpolation: Option<&Name>) -> bool {
    is_named(interpolation, "drive")
}

fn mode(table: &mut Table<'_>, has: bool, mode: &str, by_drive: bool) {
    let what = if by_drive { "by the drive" } else { "by the controller" };
    let why = "a drive that can do it would be taken for one that cannot";
    table.wants(has, "mode", &format!("the mode `{mode}` {what}, or not all of its operation modes"), why);
}

fn parameter(table: &mut Table<'_>, name: &str, places: &[&str]) {
    let why = format!("drives hold it in {}, and nobody would read or set it there", places.join(" or "));
    table.lacks("parameter", &format!("`parameter = \"{name}\"`"), &why);
}

fn signal(table: &mut Table<'_>, has: bool, name: &str, places: &[&str]) {
    let why = format!("drives have it in {}, and no telegram could carry it", places.join(" or "));
    table.wants(has, "signal", &format!("`signal = \"{name}\"`"), &why);
}

fn capture(table: &mut Table<'_>, has: bool, capture: &str, edge: &str) {
    let why = "the edge would never be told";
    table.wants(has, "capture", &format!("the {edge} edge of `{capture}`"), why);
}

fn units(table: &mut Table<'_>, facts: &[(&str, &str)], rows: &[UnitRow]) {
    for (unit, quantity) in facts {
        let has = rows.iter().any(|row| is(&row.unit, unit));
        let why = format!("a {quantity} that a drive gives in it would be missing");
        table.wants(has, "unit", &format!("`unit = \"{unit}\"`"), &why);
    }
}

fn steps(table: &mut Table<'_>, verbs: &[&str], has: impl Fn(&str) -> bool) {
    for verb in verbs {
        let why = "the axis would not know how its drive is, or the drive not what is wanted of it";
        table.wants(has(verb), "commission", &format!("`do = \"{verb}\"`"), why);
    }
}

/// Parameters that are written as the configuration says.
fn limits(table: &mut Table<'_>, names: &[&str], written: impl Fn(&str) -> bool) {
    for name in names {
        let what = format!("`do = \"write\"` with `parameter = \"{name}\"`");
        let why = "what the configuration says of it would not reach the drive";
        table.wants(written(name), "commission", &what, why);
    }
}

/// What is asked of every drive beside its parameters.
fn reads(table: &mut Table<'_>, places: &[&str], read: impl Fn(&str) -> bool) {
    for place in places {
        let why = "what the drive says of itself there would not be known";
        table.wants(read(place), "commission", &format!("`do = \"read\"` of {place}"), why);
    }
}

fn values(table: &mut Table<'_>, sercos: bool, written: impl Fn(&str, i64) -> bool) {
    for (place, values) in WRITES.iter().filter(|(place, _)| place.starts_with("S-") == sercos) {
        for value in *values {
            let what = format!("`do = \"write\"` of {value:#x} to {place}");
            let why = "the drive would keep what somebody has set there before";
            table.wants(written(place, *value), "commission", &what, why);
        }
    }
}
