//! What the tables make of generic commands for CiA 402 drives in the modes that no CIP word asks for (pp, ip, hm), and of their
//! touch probes: frames that are led by the generic side, as text.

use std::fmt::Write as _;

use axisbridge::mapping::{
    CaptureMode, Cia402Axis, Cia402Error, DriveProgram, Mapping, Object, ObjectFacts, Order, ProcedureBy,
};
use profile_generic::image::{AxisCommand, AxisFeedback, Signal};
use profile_generic::mode::{InterpolationSource, ModeSelection, OperatingMode};
use profile_generic::program::{BitPattern, ConversionReport};
use profile_generic::state::Action;
use profile_generic::time::DurationNs;

/// Bytes for the values of any drive here.
const TELEGRAM: usize = 64;

/// Counts of the drive in a turn: one that shows what is rounded.
const ENCODER: u32 = 3_600;

const fn led_by(mode: OperatingMode, interpolation: InterpolationSource) -> ModeSelection {
    ModeSelection { mode, interpolation }
}

/// Position from the controller, to targets, and homing by the drive.
const SELECTIONS: [ModeSelection; 3] = [
    led_by(OperatingMode::Position, InterpolationSource::Controller),
    led_by(OperatingMode::Position, InterpolationSource::Drive),
    led_by(OperatingMode::Homing, InterpolationSource::Drive),
];

/// The drives: their names, bits of 6502, and which values stand in the PDOs of their probes.
const DRIVES: [(&str, u32, CaptureMode); 3] = [
    ("ip, pp and hm", 0x61, CaptureMode::Off),
    ("csp, pp and hm, probes by SDO", 0xA1, CaptureMode::ServiceChannel),
    ("csp, pp and hm, probes in PDOs", 0xA1, CaptureMode::Cyclic),
];

/// Statuswords of every state, in operation with each of the bits 10, 12 and 13.
const STATUS_WORDS: [u32; 13] =
    [0x0250, 0x0231, 0x0233, 0x0237, 0x0637, 0x1237, 0x1637, 0x2237, 0x2637, 0x3237, 0x0217, 0x021F, 0x0218];

/// Modes of operation that a drive may show: pp, hm, ip, csp.
const SHOWN: [u32; 4] = [1, 6, 7, 8];

/// Values for every signal: whole counts, halves that are rounded, both signs, and beyond what 32 bits hold.
const VALUES: [i64; 5] = [0, 1_000_000_000, -1_500_138_889, 416_667, i64::MAX / 3];

/// Signals of commands that count in these modes.
const SIGNALS: [Signal; 7] = [
    Signal::PositionCommand,
    Signal::VelocityOffset,
    Signal::TorqueOffset,
    Signal::TargetPosition,
    Signal::ProfileVelocity,
    Signal::ProfileAcceleration,
    Signal::ProfileDeceleration,
];

/// All of it.
///
/// # Errors
/// The tables make no program for one of the drives.
pub fn text(mapping: &Mapping) -> Result<String, Cia402Error> {
    let mut text = String::new();
    for (name, modes, captures) in DRIVES {
        let program = program(mapping, modes, captures)?;
        line(&mut text, format_args!("drive with {name}"));
        // Probes beside the cycle change nothing in it.
        if captures != CaptureMode::ServiceChannel {
            commands(&mut text, &program);
            statuses(&mut text, &program);
        }
        probes(&mut text, &program);
    }
    Ok(text)
}

fn line(text: &mut String, what: std::fmt::Arguments<'_>) {
    // Writing to a string does not fail.
    let _ = writeln!(text, "{what}");
}

fn program(mapping: &Mapping, modes: u32, captures: CaptureMode) -> Result<DriveProgram, Cia402Error> {
    let mut facts = ObjectFacts::new();
    let factors = [(0x6091, 1, 1), (0x6091, 2, 1), (0x6096, 1, 1), (0x6096, 2, 1)];
    let objects = [(0x6502, 0, modes), (0x608F, 1, ENCODER), (0x608F, 2, 1)].into_iter().chain(factors);
    for (index, sub, value) in objects {
        facts.note_data(Object { index, sub }, &value.to_le_bytes());
    }
    facts.note_missing(Object { index: 0x6092, sub: 1 });
    let axis = Cia402Axis {
        modes: SELECTIONS.into_iter().collect(),
        cycle: DurationNs::from_millis(2),
        captures,
        ..Cia402Axis::default()
    };
    mapping.cia402_program(&axis, &facts)
}

/// The bytes of the values, as they go into RPDOs.
fn encoded(program: &DriveProgram, command: &AxisCommand, order: Order, status: u32) -> String {
    let mut bytes = [0; TELEGRAM];
    let len = usize::from(program.telegram.command_bytes);
    let mut report = ConversionReport::default();
    let control = program.encode(command, order, 0, status, &mut bytes[..len], &mut report);
    let mut text = format!("{control:08x}:");
    for byte in &bytes[..len] {
        let _ = write!(text, " {byte:02x}");
    }
    if report.saturated > 0 {
        let _ = write!(text, ", {} clamped", report.saturated);
    }
    text
}

/// What comes of some inputs, those with the same outcome in one line.
fn grouped(text: &mut String, what: &str, outcomes: impl Iterator<Item = (String, String)>) {
    let mut groups: Vec<(String, Vec<String>)> = Vec::new();
    for (input, outcome) in outcomes {
        match groups.iter_mut().find(|(known, _)| *known == outcome) {
            Some((_, inputs)) => inputs.push(input),
            None => groups.push((outcome, vec![input])),
        }
    }
    for (outcome, inputs) in groups {
        line(text, format_args!("    {what} -> {outcome} at {}", inputs.join(" ")));
    }
}

/// Every status in every mode that the drive may show.
fn shown() -> impl Iterator<Item = u32> {
    SHOWN.into_iter().flat_map(|mode| STATUS_WORDS.into_iter().map(move |word| word | mode << 16))
}

/// Orders in every mode while the drive shows anything, and values of every signal.
fn commands(text: &mut String, program: &DriveProgram) {
    let actions = [
        Action::Energize,
        Action::Enable,
        Action::Halt,
        Action::Disable,
        Action::TorqueOff,
        Action::ResetFault,
    ];
    for selection in SELECTIONS {
        let (carried, needed) = (program.carries(selection), program.needs(selection));
        line(text, format_args!("  {selection}: carries {carried:?}, needs {needed:?}"));
        if let Some(handshake) = program.handshake(selection) {
            line(text, format_args!("    asks {:?}, taken {:?}", handshake.ask, handshake.taken));
        }
        let ModeSelection { mode, interpolation } = selection;
        let command = AxisCommand { mode, interpolation, ..AxisCommand::default() };
        let told = Some(selection);
        for (action, asks) in actions.into_iter().flat_map(|action| [(action, false), (action, true)]) {
            let what = format!("{action}{}", if asks { ", asks" } else { "" });
            let outcome = |status: u32| encoded(program, &command, Order { action, told, asks }, status);
            grouped(text, &what, shown().map(|status| (format!("{status:06x}"), outcome(status))));
        }
        let order = Order { action: Action::Enable, told, asks: false };
        for (signal, value) in SIGNALS.into_iter().flat_map(|signal| VALUES.map(|value| (signal, value))) {
            let mut command = command;
            command.set(signal, value);
            let outcome = |mode: u32| encoded(program, &command, order, 0x1237 | mode << 16);
            let outcomes = SHOWN.into_iter().map(|mode| (format!("mode {mode}"), outcome(mode)));
            grouped(text, &format!("{signal} {value}"), outcomes);
        }
    }
}

/// What statuses tell, in every mode that the drive may show.
fn statuses(text: &mut String, program: &DriveProgram) {
    let outcome = |status: u32| {
        let mode = program.mode(status).map_or_else(|| "no mode".to_owned(), |mode| mode.to_string());
        let (report, led) = (program.report(status), program.led_report(status));
        let mut outcome = format!("{report}, led {led}, {mode}, {:?}", program.status_bits(status, &[]));
        for procedure in program.procedures() {
            if let ProcedureBy::Mode(by) = &procedure.by {
                let (done, failed) = (by.is_done(status), by.has_failed(status));
                let _ = write!(outcome, ", {}: done {done}, failed {failed}", procedure.selection);
                let _ = write!(outcome, ", within {}", by.time_out);
            }
        }
        outcome
    };
    grouped(text, "status", shown().map(|status| (format!("{status:06x}"), outcome(status))));
    let mut telegram = [0x11; TELEGRAM];
    let len = usize::from(program.telegram.feedback_bytes);
    telegram[..3].copy_from_slice(&[0x37, 0x12, 1]);
    let (mut feedback, mut report) = (AxisFeedback::default(), ConversionReport::default());
    let mut hearing = program.cached_status();
    program.decode(&telegram[..len], false, &mut feedback, &mut hearing, &mut report);
    for signal in [Signal::PositionActual, Signal::VelocityActual, Signal::TorqueActual] {
        line(text, format_args!("    {signal} {:?}", feedback.get(signal)));
    }
}

/// What arms the probes, what shows their edges, and what their positions mean.
fn probes(text: &mut String, program: &DriveProgram) {
    let captures = program.captures();
    for enable in &captures.enables {
        line(
            text,
            format_args!(
                "  probes are told by {:?}, mask {:#06x}, on {:#06x}",
                enable.place, enable.mask, enable.on
            ),
        );
    }
    for word in &captures.words {
        line(text, format_args!("  probes tell by {word:?}"));
    }
    for latch in &captures.latches {
        line(
            text,
            format_args!(
                "  {} {}: select {:#06x}, of enable {}, shown by {:?} of word {}, stored in {:?}",
                latch.kind.source,
                latch.kind.edge,
                latch.select,
                latch.enable,
                latch.pattern,
                latch.word,
                latch.value.place
            ),
        );
        let armed = latch.select | captures.enables[latch.enable].on;
        let mut telegram = [0; TELEGRAM];
        captures.enables[latch.enable]
            .place
            .write_bits(&mut telegram, BitPattern::new(captures.enables[latch.enable].mask, armed));
        let len = usize::from(program.telegram.command_bytes);
        line(text, format_args!("    armed: {armed:#06x}, {:02x?}", &telegram[..len]));
        for raw in [0, 3_600, -5_401] {
            line(text, format_args!("    raw {raw} -> {}", latch.value.position(raw, 0)));
        }
    }
    for input in &captures.inputs {
        line(
            text,
            format_args!(
                "  {} {}: {:?} of {:?}",
                input.kind.source, input.kind.edge, input.pattern, input.word
            ),
        );
    }
}
