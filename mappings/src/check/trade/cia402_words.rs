//! The words of a CiA 402 drive: what 6041h shows, and whether 6040h leads through the states in the order of the profile.

use profile_generic::program::BitPattern;
use profile_generic::state::{Action, Report};

use super::facts::CIA402_MODES;
use super::sercos_words::implies;
use super::{Reporter, place_of};
use crate::Mapping;
use crate::cia402::Tells;
use crate::finding::Findings;
use crate::finding::registry::{WRONG_ORDER, WRONG_STATE};

/// The states of the profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    NotReady,
    Disabled,
    ReadyToSwitchOn,
    SwitchedOn,
    Enabled,
    QuickStop,
    FaultReaction,
    Fault,
}

use State::{Disabled, Enabled, Fault, FaultReaction, NotReady, QuickStop, ReadyToSwitchOn, SwitchedOn};

/// Name, mask and value of 6041h for each.
const STATES: &[(State, &str, u32, u32)] = &[
    (NotReady, "Not ready to switch on", 0x4F, 0x00),
    (Disabled, "Switch on disabled", 0x4F, 0x40),
    (ReadyToSwitchOn, "Ready to switch on", 0x6F, 0x21),
    (SwitchedOn, "Switched on", 0x6F, 0x23),
    (Enabled, "Operation enabled", 0x6F, 0x27),
    (QuickStop, "Quick stop active", 0x6F, 0x07),
    (FaultReaction, "Fault reaction active", 0x4F, 0x0F),
    (Fault, "Fault", 0x4F, 0x08),
];

const VOLTAGE: u32 = 1 << 4;
const WARNING: u32 = 1 << 7;
const FOLLOWS: u32 = 1 << 12;
const HALT: u32 = 1 << 8;
const RESET: u32 = 1 << 7;

/// Modes of operation in which bit 12 says whether the drive follows command values: csp, csv, cst.
const CYCLIC: std::ops::RangeInclusive<i8> = 8..=10;

fn state_of(word: u32) -> Option<(State, &'static str)> {
    let found = STATES.iter().find(|(_, _, mask, value)| word & mask == *value);
    found.map(|(state, name, ..)| (*state, *name))
}

fn word_of(state: State) -> u32 {
    STATES.iter().find(|known| known.0 == state).map_or(0, |known| known.3)
}

fn name_of(state: State) -> &'static str {
    STATES.iter().find(|known| known.0 == state).map_or("", |known| known.1)
}

/// The state that a controlword leads to (the transitions of the profile).
fn next(state: State, control: u32) -> State {
    let shutdown = control & 0b0111 == 0b0110;
    let switch_on = control & 0b1111 == 0b0111;
    let enable = control & 0b1111 == 0b1111;
    let quick_stop = control & 0b0110 == 0b0010;
    let no_voltage = control & 0b0010 == 0;
    match state {
        Fault if control & RESET != 0 => Disabled,
        NotReady | FaultReaction | Fault => state,
        QuickStop if enable => Enabled,
        QuickStop if no_voltage => Disabled,
        QuickStop => QuickStop,
        Enabled if quick_stop => QuickStop,
        _ if no_voltage || quick_stop => Disabled,
        Disabled if shutdown => ReadyToSwitchOn,
        Disabled => Disabled,
        _ if shutdown => ReadyToSwitchOn,
        _ if switch_on => SwitchedOn,
        _ if enable => Enabled,
        _ => state,
    }
}

pub(super) fn check(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_cia402;
    let mut reporter = Reporter { source: &file.text, findings };
    reports(mapping, &mut reporter);
    status(mapping, &mut reporter);
    order(mapping, &mut reporter);
    modes(mapping, &mut reporter);
}

/// What a state means, by the profile.
fn meant(state: State, word: u32, mode: i8, tells: Tells) -> Report {
    match state {
        NotReady => Report::NotReady,
        Disabled => Report::AwaitingPower,
        ReadyToSwitchOn if tells.voltage && word & VOLTAGE == 0 => Report::AwaitingPower,
        ReadyToSwitchOn | SwitchedOn => Report::Ready,
        Enabled if tells.follows && CYCLIC.contains(&mode) && word & FOLLOWS == 0 => Report::Enabling,
        Enabled => Report::Operating,
        QuickStop => Report::Stopping,
        FaultReaction => Report::FaultReaction,
        Fault => Report::Faulted,
    }
}

fn reports(mapping: &Mapping, reporter: &mut Reporter<'_>) {
    let rows = &mapping.tables().generic_cia402.rows;
    let rules = mapping.cia402.reports();
    let mut reported = vec![false; rules.len() + 1];
    // Every value of the low bits, with and without bit 12; csp, and pp, where bit 12 is another one.
    for case in 0..1_u32 << 11 {
        let word = case & 0x7F | if case & 0x80 != 0 { FOLLOWS } else { 0 };
        let mode: i8 = if case & 0x100 != 0 { 8 } else { 1 };
        let tells = Tells { follows: case & 0x200 != 0, voltage: case & 0x400 != 0 };
        let Some((state, name)) = state_of(word) else { continue };
        let at = rules.iter().position(|rule| {
            rule.pattern.matches(word)
                && (rule.modes.is_empty() || rule.modes.contains(&mode))
                && rule.drives.include(tells)
        });
        let right = meant(state, word, mode, tells);
        let shown = at.map(|at| rules[at].report);
        let place = at.unwrap_or(rules.len());
        if shown == Some(right) || reported[place] {
            continue;
        }
        reported[place] = true;
        let (key, span) = match at {
            Some(at) => ("report", rows.report[at].report.span()),
            None => ("status", rows.words.status.span()),
        };
        let title = match shown {
            Some(shown) => format!("6041h = {word:04X} would be taken for `{shown}`"),
            None => format!("no row says what 6041h = {word:04X} means"),
        };
        let what = [
            title,
            format!("the drive is in `{name}`, which is `{right}`"),
            format!("make the first row that fits it say `report = \"{right}\"`"),
        ];
        reporter.report(WRONG_STATE, (key, span), what);
    }
}

/// Status bits, and the states in which they may be set.
const STATUS: &[(&str, &[State])] = &[
    ("enabled", &[Enabled]),
    ("tracking", &[Enabled]),
    ("ready", &[ReadyToSwitchOn, SwitchedOn]),
    ("power", &[ReadyToSwitchOn, SwitchedOn, Enabled, QuickStop, Disabled]),
    ("fault", &[Fault, FaultReaction]),
];

/// Bits of 60FDh.
const INPUTS: &[(&str, u32)] =
    &[("negative_limit_switch", 1 << 0), ("positive_limit_switch", 1 << 1), ("home_switch", 1 << 2)];

fn status(mapping: &Mapping, reporter: &mut Reporter<'_>) {
    let rows = &mapping.tables().generic_cia402.rows.status;
    for (rule, row) in mapping.cia402.status.iter().zip(rows) {
        let name = row.status.get_ref().as_str();
        let input = INPUTS.iter().find(|(known, _)| rule.object.index == 0x60FD && *known == name);
        let of_word = rule.object == mapping.cia402.words.status;
        let wrong = if let Some((_, bit)) = input {
            (rule.pattern != BitPattern::new(*bit, *bit))
                .then(|| format!("bit {} of 60FDh", bit.trailing_zeros()))
        } else if of_word && name == "warning" {
            (!implies(rule.pattern, BitPattern::new(WARNING, WARNING))).then(|| "bit 7 of 6041h".to_owned())
        } else if let Some((_, allowed)) = STATUS.iter().find(|(known, _)| of_word && *known == name) {
            // With bit 4 the mains are seen in every state.
            let by_voltage = name == "power" && implies(rule.pattern, BitPattern::new(VOLTAGE, VOLTAGE));
            let other = STATES.iter().find(|(state, _, mask, value)| {
                let clash = (rule.pattern.value ^ value) & rule.pattern.mask & mask != 0;
                !clash && !allowed.contains(state)
            });
            let names: Vec<&str> = allowed.iter().map(|state| name_of(*state)).collect();
            other.filter(|_| !by_voltage).map(|_| format!("the state {}", names.join(" or ")))
        } else {
            None
        };
        if let Some(wanted) = wrong {
            let what = [
                format!("`{name}` is taken from something else"),
                format!("expected {wanted}"),
                "correct `state` or `pattern`".to_owned(),
            ];
            reporter.report(WRONG_STATE, ("status", row.status.span()), what);
        }
    }
}

/// What an action has to come to in a state. `None`: nothing is expected.
fn expected(action: Action, state: State) -> Option<&'static [State]> {
    Some(match (action, state) {
        (Action::Enable | Action::Energize, Disabled) => &[ReadyToSwitchOn],
        (Action::Enable, ReadyToSwitchOn) => &[SwitchedOn],
        (Action::Enable, SwitchedOn | Enabled) => &[Enabled],
        (Action::Enable, QuickStop) => &[Disabled, QuickStop],
        (Action::Disable, Enabled) => &[SwitchedOn],
        (Action::Halt, Enabled) => &[Enabled],
        (Action::TorqueOff, ReadyToSwitchOn | SwitchedOn | Enabled | QuickStop) => &[Disabled],
        (Action::ResetFault, Fault) => &[Disabled],
        (_, Fault) => &[Fault],
        (Action::Energize, Enabled | QuickStop) | (_, NotReady | FaultReaction) => return None,
        // Whatever else is asked for, torque is not switched on.
        (_, _) => &[Disabled, ReadyToSwitchOn, SwitchedOn, QuickStop],
    })
}

fn order(mapping: &Mapping, reporter: &mut Reporter<'_>) {
    let rows = &mapping.tables().generic_cia402.rows.action;
    let rules = &mapping.cia402.actions;
    let actions = [
        Action::Energize,
        Action::Enable,
        Action::Disable,
        Action::Halt,
        Action::TorqueOff,
        Action::ResetFault,
    ];
    for (action, (state, name, ..)) in
        actions.iter().flat_map(|action| STATES.iter().map(move |state| (*action, *state)))
    {
        let word = word_of(state);
        let fits = |rule: &crate::cia402::ActionRule| {
            rule.action == action && rule.when.is_none_or(|when| when.matches(word))
        };
        let Some(at) = rules.iter().position(fits) else { continue };
        let control = rules[at].pattern.apply(0);
        let reached = next(state, control);
        let Some(right) = expected(action, state) else { continue };
        let halts = control & HALT != 0;
        let halt_wrong = state == Enabled
            && matches!(action, Action::Halt | Action::Enable)
            && halts != (action == Action::Halt);
        if right.contains(&reached) && !halt_wrong {
            continue;
        }
        let row = &rows[at];
        let place = place_of("send", row.send.as_ref(), ("action", &row.action));
        let wanted: Vec<&str> = right.iter().map(|state| name_of(*state)).collect();
        let (title, wanted) = if halt_wrong {
            (
                format!(
                    "`{action}` in `{name}` writes 6040h = {control:04X}, bit 8 (halt) is {}",
                    u8::from(halts)
                ),
                format!("expected bit 8 to be {}", u8::from(!halts)),
            )
        } else {
            (
                format!(
                    "`{action}` in `{name}` writes 6040h = {control:04X}, which leads to `{}`",
                    name_of(reached)
                ),
                format!("expected a command that leads to {}", wanted.join(" or ")),
            )
        };
        let help = "correct `send`, or put the row for this state before the general one".to_owned();
        reporter.report(WRONG_ORDER, place, [title, wanted, help]);
    }
}

fn modes(mapping: &Mapping, reporter: &mut Reporter<'_>) {
    for row in &mapping.tables().generic_cia402.rows.mode {
        let by_drive = row.interpolation.as_ref().is_some_and(|name| name.get_ref() == "drive");
        let known =
            CIA402_MODES.iter().find(|(mode, drive, _)| mode == row.mode.get_ref() && *drive == by_drive);
        let Some((mode, _, right)) = known else { continue };
        for name in row.modes.iter().filter(|name| !right.contains(&name.get_ref().as_str())) {
            let what = [
                format!("the operating mode `{mode}` would select `{}` in the drive", name.get_ref()),
                format!("expected {}", right.join(", ")),
                "name the mode of operation that does the same".to_owned(),
            ];
            reporter.report(WRONG_STATE, ("modes", name.span()), what);
        }
    }
}
