//! What a configuration has taken over from a starter or an example without a look at it.

use crate::config::{Named, Written};
use crate::finding::registry as code;
use crate::finding::{Findings, Problem};

/// What `axisbridge scan` marks with.
const MARK: &str = "# CHANGE";

/// Rockwell Automation.
const OF_ANOTHER: i64 = 1;

/// What the examples have: the last number, which ODVA has not assigned.
const OF_NOBODY: i64 = 65_535;

/// Looks for marks in the text, and at vendor IDs.
pub(super) fn check(named: &Named, written: Option<&Written>, findings: &mut Findings) {
    let text = &named.text;
    let mut line = 1;
    while let Some(whole) = text.rest_of_line(line, 1) {
        let words = text.slice(&whole);
        // A line that is a comment as a whole does nothing.
        let marked = words.find(MARK).filter(|_| !words.trim_start().starts_with('#'));
        if let Some(at) = marked {
            let asks = words[at + MARK.len()..].trim_start_matches(':').trim();
            let problem = Problem::new(code::PLACEHOLDER, whole.start + at..whole.end);
            let asks = if asks.is_empty() { "the value" } else { asks };
            let problem = problem.expected(format!("expected: {asks}"));
            findings.push(text, problem.help("edit the line, and remove the mark"));
        }
        line += 1;
    }
    let devices = written.iter().flat_map(|written| &written.file.device);
    for vendor in devices.map(|device| &device.get_ref().identity.vendor_id) {
        let (code, expected) = match *vendor.get_ref() {
            OF_ANOTHER => (code::VENDOR_ID, "this is the vendor ID of Rockwell Automation"),
            OF_NOBODY => (code::VENDOR_NONE, "this stands for a vendor ID that is still to be assigned"),
            _ => continue,
        };
        let line = text.place(vendor.span().start).1;
        let marked = text.rest_of_line(line, 1).is_some_and(|whole| text.slice(&whole).contains(MARK));
        if marked || text.accepts(&vendor.span()).is_some() {
            continue;
        }
        let problem = Problem::new(code, vendor.span()).key("vendor_id").expected(expected);
        findings.push(text, problem.help("use the one that ODVA has assigned to you"));
    }
}
