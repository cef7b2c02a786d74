//! What tables mean, as a text: tables with the same text make the same of every axis.
//!
//! The order of rows and of names in a list is left out where nothing depends on it, and so is what no program is made of. Why
//! nothing depends on it stands at each of them.

use std::fmt::{Debug, Write as _};

use profile_generic::image::StatusBits;
use profile_generic::program::BitPattern;

use crate::cia402::{
    ActionRule as Cia402ActionRule, ReportRule as Cia402ReportRule, StatusRule as Cia402StatusRule,
    StepKind as Cia402StepKind, StepRule as Cia402StepRule, Tells,
};
use crate::drive_program::FaultRow;
use crate::sercos::scaling::{Method, ScalingRule};
use crate::sercos::tables::{ReportRule, StatusRule as SercosStatusRule, StepKind, StepRule};
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

/// Actions by what each comes to in every status word: the first row for the state, else the one for every other state.
fn cia402_actions(rules: &[Cia402ActionRule]) -> String {
    let mut text = String::new();
    let mut actions: Vec<_> = rules.iter().map(|rule| rule.action).collect();
    actions.sort_unstable_by_key(|action| action.name());
    actions.dedup();
    for word in words(rules.iter().filter_map(|rule| rule.when)) {
        for action in &actions {
            let own = || rules.iter().filter(|rule| rule.action == *action);
            let of_state = own().find(|rule| rule.when.is_some_and(|when| when.matches(word)));
            let rule = of_state.or_else(|| own().find(|rule| rule.when.is_none()));
            let _ = writeln!(text, "{word:04X} {action} {:?}", rule.map(|rule| rule.pattern));
        }
    }
    text
}

/// Status bits, which are added up, by what comes of every value of their word; rows of one word are alternatives.
fn sercos_status(rules: &[SercosStatusRule]) -> String {
    let mut text = String::new();
    let mut idns: Vec<_> = rules.iter().map(|rule| rule.word).collect();
    idns.sort_unstable();
    idns.dedup();
    for idn in idns {
        let own = || rules.iter().filter(|rule| rule.word == idn);
        for word in words(own().map(|rule| rule.pattern)) {
            for acknowledges in [false, true] {
                let fits = |rule: &&SercosStatusRule| {
                    rule.pattern.matches(word)
                        && rule.acknowledges.is_none_or(|wanted| wanted == acknowledges)
                };
                let bits = own().filter(fits).fold(StatusBits::empty(), |bits, rule| bits | rule.bit);
                let _ = writeln!(text, "{idn} {word:04X} {acknowledges} {bits:?}");
            }
        }
    }
    text
}

/// The same of CiA 402, as [`cia402_reports`].
fn cia402_status(rules: &[Cia402StatusRule]) -> String {
    let mut text = String::new();
    let mut modes: Vec<i8> = rules.iter().flat_map(|rule| rule.modes.iter().copied()).chain([0]).collect();
    modes.sort_unstable();
    modes.dedup();
    let mut objects: Vec<_> = rules.iter().map(|rule| rule.object).collect();
    objects.sort_unstable_by_key(|object| (object.index, object.sub));
    objects.dedup();
    for object in objects {
        let own = || rules.iter().filter(|rule| rule.object == object);
        for word in words(own().map(|rule| rule.pattern)) {
            for mode in &modes {
                for (follows, voltage) in [(false, false), (false, true), (true, false), (true, true)] {
                    let tells = Tells { follows, voltage };
                    let fits = |rule: &&Cia402StatusRule| {
                        rule.pattern.matches(word)
                            && (rule.modes.is_empty() || rule.modes.contains(mode))
                            && rule.drives.include(tells)
                    };
                    let none = (StatusBits::empty(), StatusBits::empty());
                    let bits = own()
                        .filter(fits)
                        .fold(none, |bits, rule| (bits.0 | rule.bit, bits.1 | rule.inverted));
                    let _ = writeln!(text, "{object} {word:04X} {mode} {tells:?} {bits:?}");
                }
            }
        }
    }
    text
}

/// Methods of which the first that fits the scaling type wins, by what every type comes to.
fn sercos_methods(rule: &mut ScalingRule) -> String {
    let methods = std::mem::take(&mut rule.methods);
    // Every one of them may name parameters that are read, whether it wins or not.
    let reads = |method: &Method| format!("{:?}", [method.factor, method.exponent, method.divisor]);
    let mut text = unordered(&methods.iter().map(reads).collect::<Vec<_>>());
    for word in words(methods.iter().map(|method| method.pattern)) {
        let method = methods.iter().find(|method| method.pattern.matches(word));
        let method = method.map(|method| Method { pattern: BitPattern::new(0, 0), ..method.clone() });
        let _ = writeln!(text, "\n{word:02X} {method:?}");
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
        let methods: Vec<String> = rest.scalings.iter_mut().map(sercos_methods).collect();
        // Each is found by its signal, parameter, mode or edge, of which there is one row.
        let lists = [
            methods.join("\n"),
            sercos_reports(&std::mem::take(&mut rest.reports)),
            unordered(&std::mem::take(&mut rest.signals)),
            unordered(&std::mem::take(&mut rest.procedures)),
            sercos_status(&std::mem::take(&mut rest.status)),
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
        // Steps that only read, one behind the other, read the same in any order: the steps of a phase are planned before the first of
        // them is done, and none of them asks what another has found.
        let reads = |rule: &StepRule| {
            let only = [
                StepKind::ReadScaling,
                StepKind::ReadTelegram,
                StepKind::ReadParameters,
                StepKind::ReadProcedures,
                StepKind::ReadCaptures,
            ];
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
        // What a drive is asked is planned before the first question, and all of it comes before anything is written.
        let asks = |rule: &Cia402StepRule| {
            matches!(
                rule.kind,
                Cia402StepKind::Read(_)
                    | Cia402StepKind::ReadScaling
                    | Cia402StepKind::ReadParameters
                    | Cia402StepKind::ReadCaptures
            )
        };
        let (asked, told) = std::mem::take(&mut rest.steps).into_iter().partition(asks);
        let asked: Vec<Cia402StepRule> = asked;
        rest.steps = told;
        // Objects that are written one behind the other are each an option of their own, and the drive has no torque yet. The cycle is
        // read back, and nothing else is made of that.
        let writes = |rule: &Cia402StepRule| {
            matches!(
                rule.kind,
                Cia402StepKind::Write(..)
                    | Cia402StepKind::WriteParameter(_)
                    | Cia402StepKind::WriteCycle(..)
            )
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
            unordered(&asked),
            cia402_actions(&std::mem::take(&mut rest.actions)),
            by_code(&std::mem::take(&mut rest.faults)),
            cia402_reports(&std::mem::take(&mut rest.reports)),
            unordered(&std::mem::take(&mut rest.signals)),
            unordered(&std::mem::take(&mut rest.procedures)),
            cia402_status(&std::mem::take(&mut rest.status)),
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
            // What both patterns take, a method before has taken.
            (
                "generic-sercos.toml",
                "pattern = [0x3F, 0x01], name = \"newton, preferential\"",
                "pattern = [0x3E, 0x00], name = \"newton, preferential\"",
            ),
            // Both send the same, and so does the row for every other state.
            (
                "generic-cia402.toml",
                "  { action = \"enable\", when = \"Switch on disabled\", send = \"Shutdown\", source = \"RS PY NT AB SSC: transition 2\" },\n",
                "",
            ),
            // A row for drives without bit 12 shows the same.
            (
                "generic-cia402.toml",
                "modes = [\"csp\", \"csv\", \"cst\"], follows = true, status = \"tracking\"",
                "modes = [\"csp\", \"csv\", \"cst\"], status = \"tracking\"",
            ),
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
            (
                "generic-sercos.toml",
                "pattern = [0x3F, 0x02], name = \"newton metre",
                "pattern = [0x37, 0x02], name = \"newton metre",
            ),
            (
                "generic-cia402.toml",
                "when = \"Switched on\", send = \"Enable operation\"",
                "when = \"Switched on\", send = \"Switch on\"",
            ),
            ("generic-cia402.toml", "follows = false, status = \"tracking\"", "status = \"tracking\""),
            ("generic-sercos.toml", "status = \"tracking\", acknowledges = false", "status = \"tracking\""),
        ] {
            assert_ne!(with(file, from, to).meaning(), shipped, "{from}");
        }
    }
}
