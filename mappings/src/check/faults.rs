//! Whether every fault is told with a code of its own, and every row can count.

use profile_generic::fault::FaultCause;
use profile_generic::program::BitPattern;

use crate::Mapping;
use crate::finding::registry as code;
use crate::finding::{Findings, Problem};
use crate::format::CipFaultRow;

/// Looks at the faults of the controller and of SERCOS drives, and at the rows of which the first that fits wins.
pub(super) fn check(mapping: &Mapping, findings: &mut Findings) {
    causes(mapping, findings);
    sercos_faults(mapping, findings);
    sercos_reports(mapping, findings);
}

/// The same for CiA 402 drives.
pub(super) fn cia402(mapping: &Mapping, findings: &mut Findings) {
    exceptions(mapping, findings);
    cia402_faults(mapping, findings);
    cia402_reports(mapping, findings);
}

fn causes(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().cip_generic;
    let rows = &file.rows.fault;
    for (_, name) in FaultCause::NAMED {
        if !rows.iter().any(|row| row.cause.get_ref() == name) {
            let problem = Problem::new(code::FAULT_NO_CODE, file.rows.mapping.span());
            let problem = problem.title(format!("the fault `{name}` has no code"));
            findings.push(
                &file.text,
                problem.expected("expected a [[fault]] row: the controller would not be told"),
            );
        }
    }
    for (at, row) in rows.iter().enumerate() {
        let Some((key, span, answer)) = answer(row) else { continue };
        let same = |other: &&CipFaultRow| {
            self::answer(other)
                .is_some_and(|(other_key, _, other)| (other_key, other) == (key, answer.clone()))
        };
        let Some(other) = rows[..at].iter().find(same) else { continue };
        if row.shared && other.shared {
            continue;
        }
        let Some((_, place, _)) = self::answer(other) else { continue };
        let (one, two) = (other.cause.get_ref(), row.cause.get_ref());
        let problem = Problem::new(code::CODE_SHARED, span).key(key);
        let problem = problem.title(format!("`{one}` and `{two}` have the same code"));
        let problem =
            problem.expected("the controller cannot distinguish them").related(place, "the other one");
        findings.push(&file.text, problem.help("set `shared = true` in both rows if you mean that"));
    }
}

/// Each standard exception is found by someone, or there is a reason.
fn exceptions(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().cip_generic;
    let Some(set) = mapping.dictionaries.cip.bits("Axis Exceptions") else { return };
    for named in &set.codes {
        let is = |bit: u8| u32::from(bit) == named.code;
        let raised = mapping.raised_exceptions().any(is);
        if raised || mapping.cip.unraised.iter().any(|(bit, _)| is(*bit)) {
            continue;
        }
        let row =
            file.rows.fault.iter().find(|row| {
                row.exception.as_ref().is_some_and(|exception| *exception.get_ref() == named.name)
            });
        let span = row.map_or_else(|| file.rows.mapping.span(), |row| row.cause.span());
        let problem = Problem::new(code::EXCEPTION_UNSAID, span);
        let problem = problem.title(format!("nobody finds the exception `{}`", named.name));
        findings.push(
            &file.text,
            problem
                .expected("expected a [[fault]] row of a drive that leads to it, or a place in [[unraised]]"),
        );
    }
}

/// What a row answers a fault with.
fn answer(row: &CipFaultRow) -> Option<(&'static str, std::ops::Range<usize>, String)> {
    let named = [
        ("exception", &row.exception),
        ("node_fault", &row.node_fault),
        ("initialization", &row.initialization),
        ("apr", &row.apr),
    ];
    let name = named.into_iter().find_map(|(key, name)| Some((key, name.as_ref()?)));
    match (name, &row.manufacturer) {
        (Some((key, name)), _) => Some((key, name.span(), name.get_ref().clone())),
        (None, Some(bit)) => Some(("manufacturer", bit.span(), bit.get_ref().to_string())),
        (None, None) => None,
    }
}

/// Whether each word that fits the later pattern fits the earlier one too.
fn hides(earlier: BitPattern, later: BitPattern) -> bool {
    earlier.mask & !later.mask == 0 && later.value & earlier.mask == earlier.value & earlier.mask
}

fn sercos_faults(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let rules = mapping.sercos.faults();
    for (at, (rule, row)) in rules.iter().zip(&file.rows.fault).enumerate() {
        // A row counts unless one before it has matched on one of the same bits.
        let hidden = rules[..at].iter().position(|other| {
            other.word == rule.word
                && hides(other.pattern, rule.pattern)
                && other.pattern.mask & rule.pattern.mask != 0
        });
        if let Some(before) = hidden {
            let cause = row.cause.get_ref();
            let problem = Problem::new(code::NEVER_REACHED, row.cause.span()).key("cause");
            let problem = problem.title(format!("the row of the fault `{cause}` is never used"));
            let problem = problem.expected("whatever fits this row fits one before it");
            findings.push(&file.text, problem.related(file.rows.fault[before].cause.span(), "this one"));
        }
    }
}

fn sercos_reports(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let rules = mapping.sercos.reports();
    for (at, (rule, row)) in rules.iter().zip(&file.rows.report).enumerate() {
        let covers = |other: Option<bool>, own: Option<bool>| other.is_none() || other == own;
        let hidden = rules[..at].iter().position(|other| {
            hides(other.pattern, rule.pattern)
                && covers(other.acknowledges, rule.acknowledges)
                && covers(other.procedure, rule.procedure)
        });
        if let Some(before) = hidden {
            let problem = Problem::new(code::NEVER_REACHED, row.report.span()).key("report");
            let problem = problem.title(format!("the row of the report `{}` is never used", rule.report));
            let problem = problem.expected("whatever fits this row fits one before it");
            findings.push(&file.text, problem.related(file.rows.report[before].report.span(), "this one"));
        }
    }
}

/// Codes have their rows, classes are for what is left of them.
fn cia402_faults(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_cia402;
    let codes = file.rows.fault.iter().flat_map(|row| row.codes.iter().map(|name| ("codes", name)));
    let classes =
        file.rows.fault_class.iter().flat_map(|row| row.classes.iter().map(|name| ("classes", name)));
    let places: Vec<_> = codes.chain(classes).collect();
    let rules = mapping.cia402.faults();
    for (at, (rule, (key, name))) in rules.iter().zip(&places).enumerate() {
        let hidden = rules[..at].iter().position(|other| hides(other.pattern, rule.pattern));
        if let Some(before) = hidden {
            let problem = Problem::new(code::NEVER_REACHED, name.span()).key(*key);
            let problem = problem.title(format!("`{}` is never used", name.get_ref()));
            let problem = problem.expected("everything that fits it also fits an earlier row");
            findings.push(&file.text, problem.related(places[before].1.span(), "this one"));
        }
    }
}

fn cia402_reports(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_cia402;
    let rules = mapping.cia402.reports();
    for (at, (rule, row)) in rules.iter().zip(&file.rows.report).enumerate() {
        let hidden = rules[..at].iter().position(|other| {
            hides(other.pattern, rule.pattern)
                && (other.drives.follows.is_none() || other.drives.follows == rule.drives.follows)
                && (other.drives.voltage.is_none() || other.drives.voltage == rule.drives.voltage)
                && (other.modes.is_empty()
                    || !rule.modes.is_empty() && rule.modes.iter().all(|mode| other.modes.contains(mode)))
        });
        if let Some(before) = hidden {
            let problem = Problem::new(code::NEVER_REACHED, row.report.span()).key("report");
            let problem = problem.title(format!("the row of the report `{}` is never used", rule.report));
            let problem = problem.expected("whatever fits this row fits one before it");
            findings.push(&file.text, problem.related(file.rows.report[before].report.span(), "this one"));
        }
    }
}
