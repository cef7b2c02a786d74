//! The words of a SERCOS drive: what S-0-0135 shows, what S-0-0134 asks for, and what its faults cause.

use profile_generic::program::BitPattern;
use profile_generic::state::Report;

use super::facts::{SERCOS_CODES, SERCOS_LOAD_CODES, SERCOS_MODES};
use super::{Reporter, is_standard, place_of};
use crate::Mapping;
use crate::finding::Findings;
use crate::finding::registry::{WEAKER_REACTION, WRONG_ORDER, WRONG_STATE};
use crate::format::Name;
use crate::sercos::tables::{ReportRule, StatusRule};

// S-0-0135, Drive status.
const READY: u32 = 0xC000;
const READY_SHIFT: u32 = 14;
const ERROR: u32 = 1 << 13;
const WARNING: u32 = 1 << 12;
const REFERENCED: u32 = 1 << 5;
const HALTED: u32 = 1 << 4;
const FOLLOWS: u32 = 1 << 3;

// S-0-0134, Drive control.
const ON: u32 = 1 << 15;
const ENABLE: u32 = 1 << 14;
const RESTART: u32 = 1 << 13;
const MOVES: u32 = ON | ENABLE | RESTART;

/// What an action has to do with the control word: the bits that count, their values, and what they do.
const ACTIONS: &[(&str, u32, u32, &str)] = &[
    ("energize", MOVES, 0, "bits 15, 14 and 13 (on, enable, restart) are 0"),
    ("enable", MOVES, MOVES, "bits 15, 14 and 13 (on, enable, restart) are 1"),
    (
        "disable",
        MOVES,
        ENABLE | RESTART,
        "bit 15 (on) is 0 and bits 14 and 13 (enable, restart) are 1: the drive brakes with torque",
    ),
    ("halt", MOVES, ON | ENABLE, "bits 15 and 14 (on, enable) are 1 and bit 13 (restart) is 0"),
    ("torque_off", MOVES, 0, "bits 15, 14 and 13 (on, enable, restart) are 0"),
    ("reset_fault", MOVES, 0, "bits 15, 14 and 13 (on, enable, restart) are 0"),
];

/// The command that resets class 1 diagnostics.
const RESET: &str = "S-0-0099";

/// A status bit of S-0-0135: what shows it, in words, and whether a word of a drive that acknowledges or not shows it.
type Shown = (&'static str, &'static str, fn(u32, bool) -> bool);

const STATUS: &[Shown] = &[
    ("enabled", "Ready to operate is 3", |word, _| word & READY == READY),
    ("tracking", "Ready to operate is 3, and bit 3 is 1 where the drive has it", |word, acknowledges| {
        word & READY == READY && (!acknowledges || word & FOLLOWS != 0)
    }),
    ("power", "Ready to operate is 2 or 3", |word, _| word & 1 << 15 != 0),
    ("ready", "Ready to operate is 2 and bit 13 is 0", |word, _| word & (READY | ERROR) == 1 << 15),
    ("fault", "bit 13 is 1", |word, _| word & ERROR != 0),
    ("warning", "bit 12 is 1", |word, _| word & WARNING != 0),
    ("halt", "bit 4 is 1 and the drive has it", |word, acknowledges| acknowledges && word & HALTED != 0),
    ("referenced", "bit 5 is 1", |word, _| word & REFERENCED != 0),
];

pub(super) fn check(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let mut reporter = Reporter { source: &file.text, findings };
    reports(mapping, &mut reporter);
    status(mapping, &mut reporter);
    actions(mapping, &mut reporter);
    modes(mapping, &mut reporter);
    for row in &file.rows.fault {
        let weak = row.reaction.as_ref().filter(|name| matches!(name.get_ref().as_str(), "alarm" | "ignore"));
        let Some(weak) = weak.filter(|_| row.word.get_ref() == "Class 1 diagnostic") else { continue };
        let what = [
            format!("`{}` would only warn", row.cause.get_ref()),
            "the drive switches itself off for each bit of its class 1 diagnostic".to_owned(),
            "remove `reaction`, or name the bit of the class 2 diagnostic".to_owned(),
        ];
        reporter.report(WEAKER_REACTION, ("reaction", weak.span()), what);
    }
}

/// What a status word means, by the standard.
fn meant(word: u32, acknowledges: bool, procedure: bool) -> &'static [Report] {
    match ((word & READY) >> READY_SHIFT, word & ERROR != 0) {
        (3, true) => &[Report::FaultReaction, Report::Faulted],
        (_, true) => &[Report::Faulted],
        (0, false) => &[Report::NotReady],
        (1, false) => &[Report::AwaitingPower],
        (2, false) => &[Report::Ready],
        _ if !acknowledges => &[Report::Operating],
        _ if word & HALTED != 0 => &[Report::Halted],
        _ if word & FOLLOWS != 0 || procedure => &[Report::Operating],
        _ => &[Report::Enabling],
    }
}

fn reports(mapping: &Mapping, reporter: &mut Reporter<'_>) {
    let rows = &mapping.tables().generic_sercos.rows;
    let rules = mapping.sercos.reports();
    let bits = [1 << 15, 1 << 14, ERROR, HALTED, FOLLOWS];
    let mut reported = vec![false; rules.len() + 1];
    for case in 0..1_u32 << (bits.len() + 2) {
        let is = |bit: usize| case >> bit & 1 == 1;
        let word: u32 = (0..bits.len()).filter(|bit| is(*bit)).map(|bit| bits[bit]).sum();
        let (acknowledges, procedure) = (is(bits.len()), is(bits.len() + 1));
        let fits = |rule: &ReportRule| {
            rule.pattern.matches(word)
                && rule.acknowledges.is_none_or(|wanted| wanted == acknowledges)
                && rule.procedure.is_none_or(|wanted| wanted == procedure)
        };
        let at = rules.iter().position(fits);
        let meant = meant(word, acknowledges, procedure);
        let shown = at.map(|at| rules[at].report);
        let place = at.unwrap_or(rules.len());
        if shown.is_some_and(|report| meant.contains(&report)) || reported[place] {
            continue;
        }
        reported[place] = true;
        let right = meant[0];
        let (key, span) = match at {
            Some(at) => ("report", rows.report[at].report.span()),
            None => ("status", rows.words.status.span()),
        };
        let title = match shown {
            Some(shown) => format!("S-0-0135 = {word:04X} would be taken for `{shown}`"),
            None => format!("no row says what S-0-0135 = {word:04X} means"),
        };
        let ready = (word & READY) >> READY_SHIFT;
        let error = u32::from(word & ERROR != 0);
        let what = [
            title,
            format!("the drive says `{right}`: Ready to operate = {ready}, error = {error}"),
            format!("make the first row that fits it say `report = \"{right}\"`"),
        ];
        reporter.report(WRONG_STATE, (key, span), what);
    }
}

fn status(mapping: &Mapping, reporter: &mut Reporter<'_>) {
    let rows = &mapping.tables().generic_sercos.rows;
    let bits = [1 << 15, 1 << 14, ERROR, WARNING, REFERENCED, HALTED, FOLLOWS];
    let cases = 0..1_u32 << (bits.len() + 1);
    let cases: Vec<(u32, bool)> = cases
        .map(|case| {
            let word = (0..bits.len()).filter(|bit| case >> bit & 1 == 1).map(|bit| bits[bit]).sum();
            (word, case >> bits.len() & 1 == 1)
        })
        .collect();
    for (name, why, shows) in STATUS {
        let own: Vec<_> = mapping
            .sercos
            .status
            .iter()
            .zip(&rows.status)
            .filter(|(rule, row)| rule.word == mapping.sercos.status_word && row.status.get_ref() == name)
            .collect();
        let fits = |rule: &StatusRule, (word, acknowledges): (u32, bool)| {
            rule.pattern.matches(word) && rule.acknowledges.is_none_or(|wanted| wanted == acknowledges)
        };
        let mut wrong = false;
        for (rule, row) in &own {
            if cases.iter().any(|case| fits(rule, *case) && !shows(case.0, case.1)) {
                wrong = true;
                let what = [
                    format!("`{name}` is taken from other bits of S-0-0135"),
                    format!("the drive shows it when {why}"),
                    "correct `pattern`".to_owned(),
                ];
                reporter.report(WRONG_STATE, ("status", row.status.span()), what);
            }
        }
        let missed =
            |case: &&(u32, bool)| shows(case.0, case.1) && !own.iter().any(|(rule, _)| fits(rule, **case));
        if let Some((word, _)) = cases.iter().find(missed).filter(|_| !wrong) {
            let what = [
                format!("no row takes `{name}` from S-0-0135 = {word:04X}"),
                format!("the drive shows it when {why}"),
                format!("add a [[status]] row of the word, with `status = \"{name}\"`"),
            ];
            reporter.report(WRONG_STATE, ("status", rows.words.status.span()), what);
        }
    }
}

/// Whether each word that fits one pattern fits the other.
pub(super) fn implies(pattern: BitPattern, wanted: BitPattern) -> bool {
    pattern.mask & wanted.mask == wanted.mask && pattern.value & wanted.mask == wanted.value
}

fn actions(mapping: &Mapping, reporter: &mut Reporter<'_>) {
    for row in &mapping.tables().generic_sercos.rows.action {
        let name = row.action.get_ref();
        let own = mapping.sercos.actions.iter().find(|(action, _)| action.name() == *name);
        let pattern = own.map_or(BitPattern::new(0, 0), |(_, pattern)| *pattern);
        let place = place_of("send", row.send.as_ref(), ("action", &row.action));
        match ACTIONS.iter().find(|(known, ..)| known == name) {
            Some((_, mask, value, why)) if !implies(pattern, BitPattern::new(*mask, *value)) => {
                let what = [
                    format!("`{name}` writes another command into S-0-0134"),
                    format!("expected that {why}"),
                    "correct `pattern` or `send`".to_owned(),
                ];
                reporter.report(WRONG_ORDER, place, what);
            }
            None if pattern.mask & (ON | ENABLE | RESTART) != 0 => {
                let what = [
                    format!("`{name}` changes the control word"),
                    "expected no bits: nothing is asked of the drive".to_owned(),
                    "remove `pattern` and `send`".to_owned(),
                ];
                reporter.report(WRONG_ORDER, place, what);
            }
            _ => {}
        }
        let command = row.command.as_ref().map(|idn| idn.get_ref().as_str());
        let wrong = match name.as_str() {
            "reset_fault" => command.is_none_or(|idn| is_standard(idn) && idn != RESET),
            _ => command == Some(RESET),
        };
        if wrong {
            let place = place_of("command", row.command.as_ref(), ("action", &row.action));
            let what = [
                format!("`{name}` executes the wrong procedure command"),
                format!("{RESET} resets the faults of the drive, for `reset_fault` and nothing else"),
                if name == "reset_fault" {
                    format!("write `command = \"{RESET}\"`")
                } else {
                    "remove `command`".to_owned()
                },
            ];
            reporter.report(WRONG_ORDER, place, what);
        }
    }
}

fn modes(mapping: &Mapping, reporter: &mut Reporter<'_>) {
    for row in &mapping.tables().generic_sercos.rows.mode {
        let by_drive = row.interpolation.as_ref().is_some_and(|name| name.get_ref() == "drive");
        let known =
            SERCOS_MODES.iter().find(|(mode, drive, _)| mode == row.mode.get_ref() && *drive == by_drive);
        let Some((mode, _, begin)) = known else { continue };
        let [motor, load] = [SERCOS_CODES, SERCOS_LOAD_CODES].map(|facts| {
            let own = facts.iter().find(|(known, drive, _)| known == mode && *drive == by_drive);
            own.map_or(&[][..], |(_, _, codes)| *codes)
        });
        let row_of = ("mode", row.mode.span());
        for (key, codes, right, other) in
            [("codes", &row.codes, motor, &[][..]), ("load_codes", &row.load_codes, load, motor)]
        {
            let given: Vec<&str> = codes.iter().map(|code| code.get_ref().as_str()).collect();
            if given != right && given.iter().all(|code| right.contains(code)) {
                let listed: Vec<String> = right.iter().map(|code| format!("\"{code}\"")).collect();
                let what = [
                    format!(
                        "the operating mode `{mode}` selects its {key} in another order, or not all of them"
                    ),
                    format!("expected {}: the first that the drive takes counts", listed.join(", ")),
                    format!("write `{key} = [{}]`", listed.join(", ")),
                ];
                reporter.report(WRONG_STATE, row_of.clone(), what);
            }
            for code in codes {
                selected(reporter, (key, code), (mode, begin), (right, other));
            }
        }
    }
}

/// An operation mode that an operating mode selects: one of another operating mode, or of the encoder of the motor in its place.
fn selected(
    reporter: &mut Reporter<'_>,
    (key, code): (&str, &Name),
    (mode, begin): (&str, &str),
    (right, other): (&[&str], &[&str]),
) {
    let name = code.get_ref();
    let of_another = SERCOS_MODES.iter().any(|(_, _, other)| *other != begin && name.starts_with(other));
    let (expected, help) = if of_another {
        (
            format!("expected a mode that begins with `{begin}`"),
            "name the operation mode of the drive that does the same".to_owned(),
        )
    } else if !right.is_empty() && other.contains(&name.as_str()) {
        (
            "it closes the position loop over the encoder of the motor".to_owned(),
            format!("name that of the encoder of the load, such as `{}`", right[0]),
        )
    } else {
        return;
    };
    let what = [format!("the operating mode `{mode}` would select `{name}` in the drive"), expected, help];
    reporter.report(WRONG_STATE, (key, code.span()), what);
}
