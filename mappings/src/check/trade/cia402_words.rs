//! The words of a CiA 402 drive: what 6041h shows, and whether 6040h leads through the states in the order of the profile.

use profile_generic::program::BitPattern;
use profile_generic::state::{Action, Report};

use super::facts::{CIA402_CONTROL, CIA402_MODES};
use super::sercos_words::implies;
use super::{Reporter, place_of};
use crate::Mapping;
use crate::cia402::{StatusRule, Tells};
use crate::finding::Findings;
use crate::finding::registry::{WRONG_ORDER, WRONG_STATE};
use crate::format::Cia402StatusRow;

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
const REACHED: u32 = 1 << 10;
const HOMING_ERROR: u32 = 1 << 13;
const HOMING: u32 = HOMING_ERROR | FOLLOWS | REACHED;
const BIT_4: u32 = 1 << 4;
const FOLLOWS: u32 = 1 << 12;
const HALT: u32 = 1 << 8;
const RESET: u32 = 1 << 7;
const QUICK_STOP: u32 = 1 << 2;

/// Modes of operation: profile position, velocity of a frequency converter, profile velocity, interpolated position, homing.
const PP: i8 = 1;
const VL: i8 = 2;
const PV: i8 = 3;
const IP: i8 = 7;

const HM: i8 = 6;

/// Modes of operation in which bit 12 says whether the drive follows command values: csp, csv, cst, and ip.
fn reports_by_bit_12(mode: i8) -> bool {
    matches!(mode, IP | 8..=10)
}

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
    quick_stops(mapping, &mut reporter);
    control(mapping, &mut reporter);
    modes(mapping, &mut reporter);
}

/// What a state means, by the profile.
fn meant(state: State, word: u32, mode: i8, tells: Tells) -> Report {
    match state {
        NotReady => Report::NotReady,
        Disabled => Report::AwaitingPower,
        ReadyToSwitchOn if tells.voltage && word & VOLTAGE == 0 => Report::AwaitingPower,
        ReadyToSwitchOn | SwitchedOn => Report::Ready,
        Enabled if tells.follows && reports_by_bit_12(mode) && word & FOLLOWS == 0 => Report::Enabling,
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
    // Every value of the low bits, with and without bit 12, in every mode.
    let modes = || [PP, VL, PV, 4, HM, IP, 8, 9, 10];
    for (case, mode) in (0..1_u32 << 10).flat_map(|case| modes().map(|mode| (case, mode))) {
        let word = case & 0x7F | if case & 0x80 != 0 { FOLLOWS } else { 0 };
        let tells = Tells { follows: case & 0x100 != 0, voltage: case & 0x200 != 0 };
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

/// A word of the drive, the mode that it shows, and what it tells by bits that not all drives keep.
#[derive(Clone, Copy)]
struct Case {
    state: State,
    word: u32,
    mode: i8,
    tells: Tells,
}

impl Case {
    /// Whether a rule takes its status bit in this case.
    fn fits(&self, rule: &StatusRule) -> bool {
        rule.pattern.matches(self.word)
            && (rule.modes.is_empty() || rule.modes.contains(&self.mode))
            && rule.drives.include(self.tells)
    }
}

/// A status bit of 6041h: what shows it, in words, and whether a case does; `None` where the profile leaves it open.
type Shown = (&'static str, &'static str, fn(Case) -> Option<bool>);

const STATUS: &[Shown] = &[
    ("enabled", "the state Operation enabled", |case| Some(case.state == Enabled)),
    ("fault", "the state Fault or Fault reaction active", |case| {
        Some(matches!(case.state, Fault | FaultReaction))
    }),
    ("warning", "bit 7 of 6041h", |case| Some(case.word & WARNING != 0)),
    ("ready", "the state Ready to switch on or Switched on", |case| {
        Some(matches!(case.state, ReadyToSwitchOn | SwitchedOn))
    }),
    ("power", "bit 4 where the drive tells by it, else a state from Ready to switch on", |case| {
        match case.state {
            _ if case.tells.voltage => Some(case.word & VOLTAGE != 0),
            Disabled => None,
            state => Some(matches!(state, ReadyToSwitchOn | SwitchedOn | Enabled | QuickStop)),
        }
    }),
    (
        "tracking",
        "the state Operation enabled, and bit 12 in csp, csv, cst and ip where the drive has it",
        |case| {
            let told = reports_by_bit_12(case.mode) && case.tells.follows;
            // A drive that homes follows nobody.
            Some(case.state == Enabled && case.mode != HM && (!told || case.word & FOLLOWS != 0))
        },
    ),
    ("target_reached", "bit 10 in pp and Operation enabled", |case| {
        Some(case.state == Enabled && case.mode == PP && case.word & REACHED != 0)
    }),
    ("at_velocity", "bit 10 in pv and vl", |case| {
        Some(matches!(case.mode, PV | VL) && case.word & REACHED != 0)
    }),
    ("standstill", "bit 12 in pv", |case| Some(case.mode == PV && case.word & FOLLOWS != 0)),
];

/// Bits of 60FDh.
const INPUTS: &[(&str, u32)] =
    &[("negative_limit_switch", 1 << 0), ("positive_limit_switch", 1 << 1), ("home_switch", 1 << 2)];

fn status(mapping: &Mapping, reporter: &mut Reporter<'_>) {
    let rows = &mapping.tables().generic_cia402.rows.status;
    for (rule, row) in mapping.cia402.status.iter().zip(rows) {
        input(rule, row, reporter);
    }
    let cases = cases();
    for shown in STATUS {
        status_bit(mapping, shown, &cases, reporter);
    }
}

/// A switch is taken from its bit of 60FDh.
fn input(rule: &StatusRule, row: &Cia402StatusRow, reporter: &mut Reporter<'_>) {
    let name = row.status.get_ref().as_str();
    let input = INPUTS.iter().find(|(known, _)| rule.object.index == 0x60FD && *known == name);
    let other = input.filter(|(_, bit)| rule.pattern != BitPattern::new(*bit, *bit));
    if let Some((_, bit)) = other {
        let wanted = format!("bit {} of 60FDh", bit.trailing_zeros());
        taken(reporter, name, &wanted, row.status.span());
    }
}

/// A status bit is taken from 6041h in every case that shows it, and in no other.
fn status_bit(mapping: &Mapping, (name, why, shows): &Shown, cases: &[Case], reporter: &mut Reporter<'_>) {
    let rows = &mapping.tables().generic_cia402.rows;
    let own: Vec<_> = mapping
        .cia402
        .status
        .iter()
        .zip(&rows.status)
        .filter(|(rule, row)| rule.object == mapping.cia402.words.status && row.status.get_ref() == name)
        .collect();
    let mut wrong = false;
    for (rule, row) in &own {
        if cases.iter().any(|case| shows(*case) == Some(false) && case.fits(rule)) {
            wrong = true;
            taken(reporter, name, why, row.status.span());
        }
    }
    let missed = |case: &&Case| shows(**case) == Some(true) && !own.iter().any(|(rule, _)| case.fits(rule));
    if let Some(case) = cases.iter().find(missed).filter(|_| !wrong) {
        let what = [
            format!("no row takes `{name}` from 6041h = {:04X} in mode {}", case.word, case.mode),
            format!("the drive shows it by {why}"),
            format!("add a [[status]] row of 6041h, with `status = \"{name}\"`"),
        ];
        reporter.report(WRONG_STATE, ("status", rows.words.status.span()), what);
    }
}

/// A status bit that is taken from other bits than the standard's.
fn taken(reporter: &mut Reporter<'_>, name: &str, wanted: &str, span: std::ops::Range<usize>) {
    let what = [
        format!("`{name}` is taken from something else"),
        format!("expected {wanted}"),
        "correct `state`, `pattern`, `modes`, `follows` or `voltage`".to_owned(),
    ];
    reporter.report(WRONG_STATE, ("status", span), what);
}

/// Every state with every bit beside it that a status bit follows from, in every mode and for every kind of drive.
fn cases() -> Vec<Case> {
    let bits = [VOLTAGE, WARNING, REACHED, FOLLOWS];
    let mut cases = Vec::new();
    for (state, _, _, value) in STATES {
        for case in 0..1_u32 << (bits.len() + 2) {
            let is = |bit: usize| case >> bit & 1 == 1;
            let beside: u32 = (0..bits.len()).filter(|bit| is(*bit)).map(|bit| bits[bit]).sum();
            let tells = Tells { follows: is(bits.len()), voltage: is(bits.len() + 1) };
            let of_mode = |mode| Case { state: *state, word: value | beside, mode, tells };
            cases.extend([PP, VL, PV, 4, HM, IP, 8, 9, 10].map(of_mode));
        }
    }
    cases
}

/// What an action has to come to in a state. `None`: nothing is expected.
fn expected(action: Action, state: State) -> Option<&'static [State]> {
    Some(match (action, state) {
        (Action::Enable | Action::Energize, Disabled) => &[ReadyToSwitchOn],
        (Action::Enable, ReadyToSwitchOn) => &[SwitchedOn],
        (Action::Enable, SwitchedOn | Enabled) => &[Enabled],
        (Action::Enable, QuickStop) => &[Disabled],
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
        let Some(at) = rules.iter().position(fits) else {
            if expected(action, state).is_some() {
                let what = [
                    format!("no row says what `{action}` writes in `{name}`"),
                    "the drive would be left as it is".to_owned(),
                    format!("add an [[action]] row with `action = \"{action}\"` and without `when`"),
                ];
                reporter.report(
                    WRONG_ORDER,
                    ("mapping", mapping.tables().generic_cia402.rows.mapping.span()),
                    what,
                );
            }
            continue;
        };
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

/// Bit 2 is low for a quick stop: a command that is none leaves it high.
fn quick_stops(mapping: &Mapping, reporter: &mut Reporter<'_>) {
    let rows = &mapping.tables().generic_cia402.rows.action;
    for (rule, row) in mapping.cia402.actions.iter().zip(rows) {
        let writes = rule.pattern.mask & QUICK_STOP != 0;
        if !writes || implies(rule.pattern, BitPattern::new(QUICK_STOP, QUICK_STOP)) {
            continue;
        }
        let what = [
            format!("`{}` writes bit 2 of 6040h as 0", rule.action),
            "that is the bit of a quick stop, which nobody asks for".to_owned(),
            "write `pattern = [{ field = \"Quick stop\", is = 1 }]`".to_owned(),
        ];
        reporter.report(WRONG_ORDER, place_of("send", row.send.as_ref(), ("action", &row.action)), what);
    }
}

/// Bits of 6040h that a mode needs.
fn control(mapping: &Mapping, reporter: &mut Reporter<'_>) {
    let rows = &mapping.tables().generic_cia402.rows.mode;
    for (rule, row) in mapping.cia402.modes.iter().zip(rows) {
        for name in &row.modes {
            let fact = CIA402_CONTROL.iter().find(|(known, ..)| known == name.get_ref());
            let Some((mode, mask, value, why)) = fact else { continue };
            if implies(rule.control, BitPattern::new(*mask, *value)) {
                continue;
            }
            let what = [
                format!("the mode `{mode}` has other bits in 6040h"),
                format!("expected that {why}"),
                "correct `control`".to_owned(),
            ];
            reporter.report(WRONG_ORDER, ("modes", name.span()), what);
        }
        // Bit 4 asks for the target of pp, and bit 12 says that it was taken.
        let Some(handshake) = &rule.handshake else { continue };
        if handshake.ask != BitPattern::new(BIT_4, BIT_4)
            || handshake.taken != BitPattern::new(FOLLOWS, FOLLOWS)
        {
            let what = [
                format!("the targets of the mode `{}` are handed over by other bits", row.mode.get_ref()),
                "expected bit 4 of 6040h (new set-point), answered by bit 12 of 6041h".to_owned(),
                "correct `ask` and `taken` of `handshake`".to_owned(),
            ];
            reporter.report(WRONG_ORDER, ("mode", row.mode.span()), what);
        }
    }
    let rows = &mapping.tables().generic_cia402.rows.procedure;
    for (rule, row) in mapping.cia402.procedures.iter().zip(rows) {
        let homes = row.modes.iter().any(|name| name.get_ref() == "hm");
        // Bits 13, 12 and 10: completed, and errors moving and at rest.
        let done = BitPattern::new(HOMING, FOLLOWS | REACHED);
        let mut failed: Vec<u32> = rule.failed.iter().map(|pattern| pattern.value).collect();
        failed.sort_unstable();
        let right = rule.start == BitPattern::new(BIT_4, BIT_4)
            && rule.done == done
            && failed == [HOMING_ERROR, HOMING_ERROR | REACHED];
        if homes && !right {
            let what = [
                format!("the mode `{}` starts or ends by other bits", row.mode.get_ref()),
                "expected bit 4 of 6040h to start hm; in 6041h bits 12 and 10 for the end, and bit 13 for an error"
                    .to_owned(),
                "correct `start`, `done` or `failed`".to_owned(),
            ];
            reporter.report(WRONG_ORDER, ("mode", row.mode.span()), what);
        }
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
