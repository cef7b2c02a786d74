//! What the tables say, held against what the standards say.
//!
//! A table can be complete, convert every unit, and still send a drive the wrong way. The rules here compare the tables with
//! [`facts`], which state once what the standards fix: which bit inverts which value, which word shows which state, what a
//! count is. No fact is derived from the tables. What a vendor defines (P parameters, objects 2000 to 5FFF) is the vendor's.
//!
//! A row with `# accept: reason` next to it is meant as it is, and is not reported.

mod access;
mod bindings;
mod causes;
mod cia402_words;
mod cip_words;
mod commissioning;
mod controller;
mod facts;
mod gaps;
mod modes;
mod policies;
mod scales;
mod sercos_words;
mod signs;

use std::ops::Range;

use crate::Mapping;
use crate::finding::registry::Code;
use crate::finding::{Findings, Problem, Source, Spanned};
use crate::format::Name;

/// Compares CIP Motion and SERCOS.
pub(super) fn check(mapping: &Mapping, findings: &mut Findings) {
    signs::sercos(mapping, findings);
    bindings::sercos(mapping, findings);
    bindings::cip(mapping, findings);
    bindings::cip_names(mapping, findings);
    bindings::sercos_places(mapping, findings);
    access::sercos(mapping, findings);
    scales::sercos::check(mapping, findings);
    scales::cip(mapping, findings);
    sercos_words::check(mapping, findings);
    causes::sercos(mapping, findings);
    causes::cip(mapping, findings);
    policies::sercos(mapping, findings);
    policies::cip(mapping, findings);
    modes::sercos(mapping, findings);
    commissioning::sercos(mapping, findings);
    cip_words::check(mapping, findings);
    controller::check(mapping, findings);
    // What nobody binds may follow from what is bound to the wrong place. A family has what its drives have, and says no reasons.
    if !findings.has_errors() {
        gaps::sercos::check(mapping, findings);
        gaps::cip::check(mapping, findings);
        gaps::cia402::check(mapping, findings);
    }
}

/// Compares CiA 402, of which a family can have rows of its own.
pub(super) fn cia402(mapping: &Mapping, findings: &mut Findings) {
    signs::cia402(mapping, findings);
    bindings::cia402(mapping, findings);
    bindings::cia402_places(mapping, findings);
    access::cia402(mapping, findings);
    scales::cia402(mapping, findings);
    cia402_words::check(mapping, findings);
    causes::cia402(mapping, findings);
    policies::cia402(mapping, findings);
    modes::cia402(mapping, findings);
    commissioning::cia402(mapping, findings);
}

/// The place of a key that may be missing: its own, else that of what names the row.
fn place_of<'k, T>(
    key: &'k str,
    given: Option<&Spanned<T>>,
    row: (&'k str, &Name),
) -> (&'k str, Range<usize>) {
    given.map_or_else(|| (row.0, row.1.span()), |given| (key, given.span()))
}

/// Whether a standard defines the IDN or object; else its vendor does.
fn is_standard(name: &str) -> bool {
    name.starts_with("S-") || name.starts_with('6')
}

/// A file of which rows are reported, unless they are accepted.
struct Reporter<'a> {
    source: &'a Source,
    findings: &'a mut Findings,
}

impl Reporter<'_> {
    /// Reports what a key says, what the standard says instead, and what to do.
    fn report(&mut self, code: Code, (key, span): (&str, Range<usize>), what: [String; 3]) {
        if self.source.accepts(&span).is_some() {
            return;
        }
        let [title, expected, help] = what;
        // A title begins with the value that the row binds.
        let about =
            title.strip_prefix('`').and_then(|rest| rest.split('`').next()).unwrap_or_default().to_owned();
        let problem =
            Problem::new(code, span).key(key).title(title).expected(expected).help(help).about(about);
        self.findings.push(self.source, problem);
    }
}
