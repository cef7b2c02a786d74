//! Frames that are sent through the gateway with the tables: the facts of [`crate::translate::golden`] as findings.

use std::path::Path;

use crate::finding::registry as code;
use crate::finding::{Findings, Problem};
use crate::mapping::Mapping;
use crate::translate::golden::{Facts, Failure};

/// More than these are not told apart: one wrong row breaks many facts.
const FAILURES_MAX: usize = 25;

/// Shows every fact with the tables; how many there are.
pub(super) fn check(mapping: &Mapping, findings: &mut Findings) -> usize {
    let mut count = 0;
    for facts in Facts::shipped() {
        // A test holds that the facts of the program can be read.
        let (shown, failures) = facts.check(mapping, FAILURES_MAX).unwrap_or_default();
        count += shown;
        failures.iter().for_each(|failure| push(mapping, failure, findings));
    }
    count
}

fn push(mapping: &Mapping, failure: &Failure, findings: &mut Findings) {
    let Failure { says, group, place, expected, found, dangerous, rows } = failure;
    let places: Vec<_> = rows.iter().filter_map(|row| mapping.place_of(row)).collect();
    let accepted = places.iter().find_map(|(text, span)| text.accepts(span));
    let code = match (accepted, dangerous) {
        (Some(_), _) => code::FACT_ACCEPTED,
        (None, true) => code::FACT_FAILS,
        (None, false) => code::FACT_DIFFERS,
    };
    let difference = format!("expected {expected}, found {found}");
    // A row that is laid over a table is the likelier cause.
    let laid = places.iter().find(|(text, span)| !text.path().ends_with(text.place(span.start).0));
    let Some((text, span)) = laid.or(places.first()) else {
        findings.push_file(code, Path::new(place), format!("{says}: {difference}"));
        return;
    };
    let others: Vec<String> = rows.iter().map(ToString::to_string).collect();
    let mut problem = Problem::new(code, span.clone()).title(format!("this does not hold: {says}"));
    problem = problem.expected(format!("{difference}; {group}"));
    problem = problem.help(match accepted {
        Some(reason) => format!("accepted: {reason}"),
        None => format!("shown by {place} with {}", others.join(", ")),
    });
    findings.push(text, problem);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mapping::{Overlay, TableTexts};

    fn found(overlay: &str) -> Findings {
        let mut texts = TableTexts::embedded();
        texts.overlays.push(Overlay::new("line-4.toml", overlay));
        let mapping = Mapping::from_texts(&texts).unwrap();
        let mut findings = Findings::default();
        assert!(check(&mapping, &mut findings) >= 300);
        findings
    }

    #[test]
    fn the_shipped_tables_have_no_finding() {
        let mut findings = Findings::default();
        check(&Mapping::embedded().unwrap(), &mut findings);
        assert!(findings.is_empty(), "{findings}");
    }

    #[test]
    fn a_polarity_that_is_taken_out_is_an_error_at_its_row() {
        let findings = found(
            "format = 1\noverlay = \"a\"\n\n[[generic-sercos.signal]]\nsignal = \"velocity_actual\"\nremove = [\"polarity\"]\n",
        );
        let first = &findings.list()[0];
        assert_eq!((first.code, first.file.as_str(), first.line), (code::FACT_FAILS, "line-4.toml", 5));
        assert!(first.title.contains("velocity feedback changes its sign"), "{first}");
    }

    #[test]
    fn another_scaling_is_a_warning_and_can_be_accepted() {
        let row = "format = 1\noverlay = \"a\"\n\n[[generic-sercos.parameter]]\nparameter = \"jerk_limit\"\nfactor = [1, 2]\n";
        let findings = found(row);
        // For a linear axis and for a rotary one.
        let codes: Vec<_> = findings.list().iter().map(|finding| finding.code).collect();
        assert_eq!(codes, [code::FACT_DIFFERS; 2], "{findings}");
        let findings = found(&format!("{row}# accept: this drive counts half of it\n"));
        let codes: Vec<_> = findings.list().iter().map(|finding| finding.code).collect();
        assert_eq!(codes, [code::FACT_ACCEPTED; 2], "{findings}");
        assert!(findings.list().iter().all(|finding| finding.help.contains("this drive counts half of it")));
    }
}
