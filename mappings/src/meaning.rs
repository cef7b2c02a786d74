//! What tables mean, as a text: tables with the same text make the same of every axis.
//!
//! The order of rows and of names in a list is left out where nothing depends on it, and so is what no program is made of. Why
//! nothing depends on it stands at each of them.

use std::fmt::{Debug, Write as _};

use profile_generic::program::BitPattern;

use crate::cia402::{
    ReportRule as Cia402ReportRule, StepKind as Cia402StepKind, StepRule as Cia402StepRule, Tells,
};
use crate::drive_program::FaultRow;
use crate::sercos::tables::{ReportRule, StepKind, StepRule};
use crate::{Cia402Tables, CipTables, Mapping, SercosTables};

impl Mapping {
    /// What these tables mean, as a text to compare with that of others. The dictionaries and the families are not in it.
    #[must_use]
    pub fn meaning(&self) -> String {
        format!("{}\n{}\n{}", self.cip.meaning(), self.sercos.meaning(), self.cia402.meaning())
    }
}

/// A list as a text that is the same in any order.
pub(crate) fn unordered<T: Debug>(list: &[T]) -> String {
    let mut texts: Vec<String> = list.iter().map(|one| format!("{one:?}")).collect();
    texts.sort_unstable();
    texts.join("\n")
}

/// Faults of which the first that fits the code wins, by what comes of every code.
pub(crate) fn by_code(faults: &[FaultRow]) -> String {
    let mut text = String::new();
    let mut last = None;
    for code in 0..=u32::from(u16::MAX) {
        let fits = |row: &&FaultRow| row.pattern.matches(code);
        let row = faults.iter().find(fits).map(|row| (row.word, row.cause, row.reaction));
        if row != last {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{code:04X} {row:?}");
            last = row;
        }
    }
    text
}

/// Every value of the bits that patterns look at.
fn words(patterns: impl Iterator<Item = BitPattern>) -> Vec<u32> {
    let all = patterns.fold(0, |all, pattern| all | pattern.mask);
    let bits: Vec<u32> = (0..u32::BITS).map(|bit| 1 << bit).filter(|bit| all & bit != 0).collect();
    // A word has 16 bits.
    let count = 1_u32 << bits.len().min(16);
    let value =
        |case: u32| (0_u32..).zip(&bits).filter(|(at, _)| case >> at & 1 == 1).map(|(_, bit)| bit).sum();
    (0..count).map(value).collect()
}

/// Reports of which the first that fits wins, by what comes of every status word.
fn sercos_reports(rules: &[ReportRule]) -> String {
    let mut text = String::new();
    for word in words(rules.iter().map(|rule| rule.pattern)) {
        for (acknowledges, procedure) in [(false, false), (false, true), (true, false), (true, true)] {
            let fits = |rule: &&ReportRule| {
                rule.pattern.matches(word)
                    && rule.acknowledges.is_none_or(|wanted| wanted == acknowledges)
                    && rule.procedure.is_none_or(|wanted| wanted == procedure)
            };
            let report = rules.iter().find(fits).map(|rule| rule.report);
            let _ = writeln!(text, "{word:04X} {acknowledges} {procedure} {report:?}");
        }
    }
    text
}

/// The same of CiA 402, in every mode that a rule names, and in one that none does.
fn cia402_reports(rules: &[Cia402ReportRule]) -> String {
    let mut text = String::new();
    let mut modes: Vec<i8> = rules.iter().flat_map(|rule| rule.modes.iter().copied()).chain([0]).collect();
    modes.sort_unstable();
    modes.dedup();
    for word in words(rules.iter().map(|rule| rule.pattern)) {
        for mode in &modes {
            for (follows, voltage) in [(false, false), (false, true), (true, false), (true, true)] {
                let tells = Tells { follows, voltage };
                let fits = |rule: &&Cia402ReportRule| {
                    rule.pattern.matches(word)
                        && (rule.modes.is_empty() || rule.modes.contains(mode))
                        && rule.drives.include(tells)
                };
                let report = rules.iter().find(fits).map(|rule| rule.report);
                let _ = writeln!(text, "{word:04X} {mode} {tells:?} {report:?}");
            }
        }
    }
    text
}

impl CipTables {
    fn meaning(&self) -> String {
        let mut rest = self.clone();
        // Each is found by its code, bit, cause or number, of which there is one row; status bits are added up.
        let lists = [
            unordered(&std::mem::take(&mut rest.motion_units)),
            unordered(&std::mem::take(&mut rest.feedback_units)),
            unordered(&std::mem::take(&mut rest.cyclic)),
            unordered(&std::mem::take(&mut rest.requests)),
            unordered(&std::mem::take(&mut rest.status)),
            unordered(&std::mem::take(&mut rest.io_status)),
            unordered(&std::mem::take(&mut rest.faults)),
            unordered(&std::mem::take(&mut rest.opposites)),
            unordered(&std::mem::take(&mut rest.exceptions)),
            unordered(&std::mem::take(&mut rest.inhibits)),
            unordered(&std::mem::take(&mut rest.stoppings)),
            unordered(&std::mem::take(&mut rest.events.rules)),
            unordered(&std::mem::take(&mut rest.events.status)),
        ];
        // Why something is left out is for people. The units stand in what they convert.
        rest.rejected.clear();
        rest.unraised.clear();
        rest.forget_units();
        // Factors of one product.
        rest.scaling.feedback_resolution.sort_unstable();
        // An attribute that is neither a value of the drive nor a constant is one that is stored and given back, whoever sets it.
        for row in &mut rest.attributes {
            row.forget_who_stores();
        }
        format!("{}\n{rest:?}", lists.join("\n--\n"))
    }
}

impl SercosTables {
    fn meaning(&self) -> String {
        let mut rest = self.clone();
        for method in rest.scalings.iter_mut().flat_map(|rule| &mut rule.methods) {
            // All of them have to hold.
            method.expect.sort_unstable_by_key(|expected| format!("{expected:?}"));
        }
        for unit in &mut rest.units {
            // A drive's own spelling is looked for in all of them.
            unit.texts.sort_unstable();
        }
        for mode in &mut rest.modes {
            // Values have their places in the telegram by the lists that are agreed with the drive.
            mode.command.sort_unstable_by_key(|signal| format!("{signal:?}"));
            mode.actual.sort_unstable_by_key(|signal| format!("{signal:?}"));
        }
        // Each is found by its signal, parameter, mode or edge, of which there is one row; status bits are added up.
        let lists = [
            sercos_reports(&std::mem::take(&mut rest.reports)),
            unordered(&std::mem::take(&mut rest.signals)),
            unordered(&std::mem::take(&mut rest.procedures)),
            unordered(&std::mem::take(&mut rest.status)),
            unordered(&std::mem::take(&mut rest.parameters)),
            unordered(&std::mem::take(&mut rest.captures)),
        ];
        for rule in &mut rest.steps {
            if let StepKind::Read { elements, .. } = &mut rule.kind {
                elements.sort_unstable_by_key(|element| format!("{element:?}"));
            }
        }
        // Parameters that are written one behind the other are each an IDN of their own.
        let writes = |rule: &StepRule| matches!(rule.kind, StepKind::WriteParameter(_));
        for steps in
            rest.steps.chunk_by_mut(|one, next| one.phase == next.phase && writes(one) && writes(next))
        {
            steps.sort_unstable_by_key(|rule| format!("{rule:?}"));
        }
        // Steps that only read, one behind the other, read the same in any order: none of them asks what another has found.
        let reads = |rule: &StepRule| {
            let only = [StepKind::ReadParameters, StepKind::ReadProcedures, StepKind::ReadCaptures];
            matches!(rule.kind, StepKind::Read { .. }) || only.contains(&rule.kind)
        };
        for steps in rest.steps.chunk_by_mut(|one, next| one.phase == next.phase && reads(one) && reads(next))
        {
            steps.sort_unstable_by_key(|rule| format!("{rule:?}"));
        }
        rest.unbound.clear();
        rest.unanswered.clear();
        format!("{}\n{rest:?}", lists.join("\n--\n"))
    }
}

impl Cia402Tables {
    fn meaning(&self) -> String {
        let mut rest = self.clone();
        for mode in &mut rest.modes {
            // Values have their places in the PDOs by the mapping that is written to the drive.
            mode.command.sort_unstable_by_key(|signal| format!("{signal:?}"));
            mode.actual.sort_unstable_by_key(|signal| format!("{signal:?}"));
        }
        for rule in &mut rest.procedures {
            rule.failed.sort_unstable_by_key(|pattern| format!("{pattern:?}"));
        }
        // Which modes they are for, in any order.
        rest.signals.iter_mut().for_each(|rule| rule.modes.sort_unstable());
        rest.status.iter_mut().for_each(|rule| rule.modes.sort_unstable());
        rest.steps.iter_mut().for_each(|rule| rule.modes.sort_unstable());
        // Objects that are written one behind the other are each an option of their own, and the drive has no torque yet.
        let writes = |rule: &Cia402StepRule| {
            matches!(rule.kind, Cia402StepKind::Write(..) | Cia402StepKind::WriteParameter(_))
        };
        for steps in rest.steps.chunk_by_mut(|one, next| writes(one) && writes(next)) {
            steps.sort_unstable_by_key(|rule| format!("{rule:?}"));
        }
        // Factors of one product.
        for method in rest.scalings.iter_mut().flat_map(|rule| &mut rule.methods) {
            method.times.sort_unstable_by_key(|value| format!("{value:?}"));
            method.over.sort_unstable_by_key(|value| format!("{value:?}"));
        }
        // As for SERCOS. Of error codes there are so few that all of them are looked at.
        let lists = [
            by_code(&std::mem::take(&mut rest.faults)),
            cia402_reports(&std::mem::take(&mut rest.reports)),
            unordered(&std::mem::take(&mut rest.signals)),
            unordered(&std::mem::take(&mut rest.procedures)),
            unordered(&std::mem::take(&mut rest.status)),
            unordered(&std::mem::take(&mut rest.parameters)),
            unordered(&std::mem::take(&mut rest.captures)),
        ];
        rest.unbound.clear();
        rest.unanswered.clear();
        format!("{}\n{rest:?}", lists.join("\n--\n"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TableTexts;

    fn with(file: &str, from: &str, to: &str) -> Mapping {
        let texts = TableTexts::embedded();
        let text = match file {
            "cip-generic.toml" => texts.cip_generic.text,
            "generic-sercos.toml" => texts.generic_sercos.text,
            _ => texts.generic_cia402.text,
        };
        assert!(text.contains(from), "{from}");
        Mapping::embedded().unwrap().with_table(file, &text.replacen(from, to, 1)).unwrap()
    }

    #[test]
    fn what_makes_no_difference_does_not_change_the_meaning() {
        let shipped = Mapping::embedded().unwrap().meaning();
        for (file, from, to) in [
            ("cip-generic.toml", "served_by = \"device\"", "served_by = \"connection\""),
            ("generic-sercos.toml", "[\"in/Rev\", \"inch/U\"", "[\"inch/U\", \"in/Rev\""),
            (
                "generic-cia402.toml",
                "\"DC link under-voltage\", \"Under-voltage 1\"",
                "\"Under-voltage 1\", \"DC link under-voltage\"",
            ),
            // Its class is reported as the same.
            ("generic-cia402.toml", "\"Position controller\", ", ""),
        ] {
            assert_eq!(with(file, from, to).meaning(), shipped, "{from}");
        }
    }

    #[test]
    fn what_makes_a_difference_changes_it() {
        let shipped = Mapping::embedded().unwrap().meaning();
        for (file, from, to) in [
            (
                "cip-generic.toml",
                "cause = \"homing\", manufacturer = 9",
                "cause = \"homing\", manufacturer = 40",
            ),
            (
                "generic-sercos.toml",
                "idn = \"S-0-0037\", direction = \"to_drive\", missing = \"omit\"",
                "idn = \"S-0-0037\", direction = \"to_drive\", missing = \"refuse\"",
            ),
            ("generic-cia402.toml", "\"Velocity controller\"", "\"Motor\""),
            ("generic-cia402.toml", "modes = [\"csv\", \"pv\"]", "modes = [\"pv\", \"csv\"]"),
        ] {
            assert_ne!(with(file, from, to).meaning(), shipped, "{from}");
        }
    }
}
