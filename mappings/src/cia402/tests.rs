//! Plans and programs of the CiA 402 side.

use std::fmt::Write as _;

use profile_generic::capture::{CaptureEdge, CaptureKind, CaptureSource};
use profile_generic::cast::f64_from_i64;
use profile_generic::image::{AxisCommand, AxisFeedback, StatusBits};
use profile_generic::mode::OperatingMode;
use profile_generic::program::ConversionReport;
use profile_generic::scaling::UnitKind;
use profile_generic::time::DurationNs;
use proptest::prelude::*;

use super::*;
use crate::tests::shipped;
use crate::{AxisUnits, CaptureMode, DriveProgram, Item, Mapping};

const ALL: [OperatingMode; 3] = [OperatingMode::Position, OperatingMode::Velocity, OperatingMode::Torque];

fn axis(modes: &[OperatingMode]) -> Cia402Axis {
    Cia402Axis {
        modes: modes.iter().map(|mode| (*mode).into()).collect(),
        cycle: DurationNs::from_millis(2),
        left_out: vec![Signal::FollowingError, Signal::DigitalInputs],
        acknowledges: Some(true),
        tells_voltage: Some(true),
        drive_modes: None,
        any_mode: false,
        ..Cia402Axis::default()
    }
}

fn object(index: u16, sub: u8) -> Object {
    Object { index, sub }
}

/// A drive with csp, csv and cst, with this feed constant, that counts velocities by its positions.
fn with_feed(feed: u32, shaft: u32) -> ObjectFacts {
    let mut facts = ObjectFacts::new();
    facts.note_data(object(0x6502, 0), &0x380_u32.to_le_bytes());
    facts.note_data(object(0x6092, 1), &feed.to_le_bytes());
    facts.note_data(object(0x6092, 2), &shaft.to_le_bytes());
    facts.note_data(object(0x6096, 1), &1_u32.to_le_bytes());
    facts.note_data(object(0x6096, 2), &1_u32.to_le_bytes());
    facts
}

/// A drive with csp, csv and cst that counts 3600 in a turn, and has every object.
fn servo() -> ObjectFacts {
    with_feed(3600, 1)
}

fn program(modes: &[OperatingMode]) -> DriveProgram {
    shipped().cia402_program(&axis(modes), &servo()).unwrap()
}

/// The state of a drive, as its statusword shows it.
const STATES: [(&str, u32); 8] = [
    ("not ready to switch on", 0x00),
    ("switch on disabled", 0x40),
    ("ready to switch on", 0x21),
    ("switched on", 0x23),
    ("operation enabled", 0x27),
    ("quick stop active", 0x07),
    ("fault reaction active", 0x0F),
    ("fault", 0x08),
];

/// 6061 shows csp.
const IN_CSP: u32 = 8 << 16;

#[test]
fn every_action_in_every_state() {
    let program = program(&ALL);
    let mut text = String::new();
    for (name, status) in STATES.map(|(name, status)| (name, status | IN_CSP)) {
        write!(text, "{name:<24}").unwrap();
        for action in Action::ALL {
            // What stood there before must not matter where an action writes anything.
            let [low, high] = [0x0000, 0x0080]
                .map(|before| program.control(*action, OperatingMode::Position.into(), before, status));
            assert!(
                low == high || (low, high) == (0x08_0000, 0x08_0080),
                "{name} {action}: {low:X} {high:X}"
            );
            write!(text, " {}={:04X}", action.name(), low & 0xFFFF).unwrap();
        }
        text.push('\n');
    }
    insta::assert_snapshot!(text);
}

#[test]
fn torque_comes_one_state_at_a_time_and_only_by_enable() {
    let program = program(&ALL);
    for action in Action::ALL {
        for (name, status) in STATES {
            let control = program.control(*action, OperatingMode::Position.into(), 0, status | IN_CSP);
            let enabled = control & 0x0F == 0x0F;
            let may = matches!(*action, Action::Enable) && matches!(status, 0x23 | 0x27)
                || matches!(*action, Action::Halt) && status == 0x27;
            assert_eq!(enabled, may, "{action} in {name}: {control:04X}");
        }
    }
}

#[test]
fn a_drive_is_led_from_its_start_into_operation() {
    // The transitions of CiA 402, as a drive makes them.
    let next = |status: u32, control: u32| match (status, control & 0x8F) {
        (0x40, 0x06) => 0x21,
        (0x21, 0x07) => 0x23,
        (0x23, 0x0F) => 0x27,
        (_, word) if word & 0x02 == 0 => 0x40,
        (status, _) => status,
    };
    let program = program(&ALL);
    let (mut status, mut control, mut passed) = (0x40, 0, vec![]);
    for _ in 0..6 {
        control = program.control(Action::Enable, OperatingMode::Position.into(), control, status | IN_CSP);
        status = next(status, control);
        passed.push(status);
    }
    assert_eq!(passed, [0x21, 0x23, 0x27, 0x27, 0x27, 0x27]);
    let control = program.control(Action::TorqueOff, OperatingMode::Position.into(), control, status);
    assert_eq!(next(status, control), 0x40);
}

#[test]
fn a_drive_that_shows_another_mode_stays_switched_on() {
    let program = program(&ALL);
    let enable = |mode: OperatingMode, status: u32, shown: u32| {
        program.control(Action::Enable, mode.into(), 0, status | shown << 16) & 0xFF
    };
    for (mode, code) in
        [(OperatingMode::Position, 8), (OperatingMode::Velocity, 9), (OperatingMode::Torque, 10)]
    {
        for shown in [0, 3, 6, 8, 9, 10, 0xFF] {
            let expected = if shown == code { 0x0F } else { 0x07 };
            assert_eq!(enable(mode, 0x23, shown), expected, "{mode:?} while {shown} is shown");
            // A mode is changed in operation, and one that is not shown in time is a fault of the axis.
            assert_eq!(enable(mode, 0x27, shown), 0x0F, "{mode:?} in operation");
            assert_eq!(enable(mode, 0x21, shown), 0x07, "{mode:?}");
        }
    }
}

#[test]
fn what_every_status_says() {
    let program = program(&ALL);
    // One whose bits 4 and 12 are not looked at.
    let plain = Cia402Axis { acknowledges: None, tells_voltage: None, ..axis(&ALL) };
    let plain = shipped().cia402_program(&plain, &servo()).unwrap();
    let mut text = String::new();
    for mode in [8_u32, 9, 3, 0] {
        for (name, state) in STATES {
            for bits in [0, 0x10, 0x1000, 0x1490] {
                let status = mode << 16 | state | bits;
                let bits = |program: &DriveProgram| {
                    let bits = program.status_bits(status, &[]);
                    bits.iter_names().map(|(name, _)| name).collect::<Vec<_>>().join(" ")
                };
                let mode = program.mode(status).map_or("-".to_owned(), |mode| mode.to_string());
                for (keeps, program) in [("4 12", &program), ("", &plain)] {
                    let (report, shown) = (program.report(status), bits(program));
                    writeln!(text, "{status:06X} {name:<22} {mode:<9} {keeps:<5} {report:<15} {shown}")
                        .unwrap();
                }
            }
        }
    }
    insta::assert_snapshot!(text);
}

#[test]
fn the_telegrams_carry_what_the_modes_need() {
    let items = |items: &[Item]| items.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
    let all = program(&ALL).telegram;
    assert_eq!(items(&all.command), "6040:00 6060:00 607A:00 60FF:00 6071:00");
    assert_eq!(items(&all.feedback), "6041:00 6061:00 6064:00 606C:00 6077:00");
    assert_eq!((all.command_bytes, all.feedback_bytes), (13, 13));
    let third = Cia402Axis { axis: 2, ..axis(&ALL[..1]) };
    let mut facts = servo();
    facts.note_missing(object(0x6077, 0));
    let third = shipped().cia402_program(&third, &facts).unwrap().telegram;
    assert_eq!(items(&third.command), "7040:00 7060:00 707A:00");
    assert_eq!(items(&third.feedback), "7041:00 7061:00 7064:00 706C:00");
}

#[test]
fn captures_are_those_whose_objects_the_drive_has() {
    let kind = CaptureKind::new;
    let (one, two) = (CaptureSource::Registration1, CaptureSource::Registration2);
    let home = kind(CaptureSource::HomeSwitch, CaptureEdge::Positive);
    let mut facts = servo();
    facts.note_missing(object(0x60BC, 0));
    let of = |captures| {
        let second = Cia402Axis { axis: 1, captures, ..axis(&ALL[..1]) };
        shipped().cia402_program(&second, &facts).unwrap()
    };
    assert!(of(CaptureMode::Off).captures().kinds().is_empty());
    for (captures, telegrams) in [(CaptureMode::ServiceChannel, [3, 5]), (CaptureMode::Cyclic, [4, 7])] {
        let program = of(captures);
        let kinds = program.captures().kinds();
        assert!(
            kinds.contains(kind(one, CaptureEdge::Positive))
                && kinds.contains(kind(two, CaptureEdge::Negative))
        );
        assert!(!kinds.contains(kind(two, CaptureEdge::Positive)), "it has no 60BC");
        assert_eq!(
            kinds.contains(home),
            captures == CaptureMode::Cyclic,
            "an input has to come in every cycle"
        );
        assert_eq!([program.telegram.command.len(), program.telegram.feedback.len()], telegrams);
        let places: Vec<_> = program.captures().enables.iter().map(|gate| gate.place).collect();
        let offset = (captures == CaptureMode::Cyclic).then_some(7);
        assert!(places.iter().all(|place| (place.item, place.offset) == (Item::object(0x68B8, 0), offset)));
        let words: Vec<_> = program.captures().words.iter().map(|place| (place.item, place.offset)).collect();
        assert_eq!(words, [(Item::object(0x68B9, 0), (captures == CaptureMode::Cyclic).then_some(17))]);
    }
    let cyclic = of(CaptureMode::Cyclic);
    let input = cyclic.captures().inputs[0].word;
    assert_eq!((input.item, input.offset), (Item::object(0x68FD, 0), Some(13)));
    assert_eq!((cyclic.telegram.command_bytes, cyclic.telegram.feedback_bytes), (9, 19));
}

#[test]
fn set_points_and_actual_values_go_both_ways() {
    let program = program(&ALL);
    let mut command = AxisCommand { mode: OperatingMode::Position, ..AxisCommand::default() };
    command.set(Signal::PositionCommand, 250_000_000);
    command.set(Signal::VelocityCommand, -1_000_000_000);
    command.set(Signal::TorqueCommand, 500_000);
    let (mut bytes, mut report) = ([0xA5; 13], ConversionReport::default());
    let control = program.encode(&command, Action::Enable, 0, 0x23 | IN_CSP, &mut bytes, &mut report);
    assert!(report.is_clean());
    assert_eq!(control, 0x08_000F);
    // Controlword, mode 8, 900 counts, -3600 counts a second, 500 permille.
    assert_eq!(bytes, [0x0F, 0, 8, 0x84, 0x03, 0, 0, 0xF0, 0xF1, 0xFF, 0xFF, 0xF4, 0x01]);
    let (mut feedback, mut cached) = (AxisFeedback::default(), program.cached_status());
    let shown = [0x37, 0x12, 9, 0x84, 0x03, 0, 0, 0xF0, 0xF1, 0xFF, 0xFF, 0x0C, 0xFE];
    let status = program.decode(&shown, false, &mut feedback, &mut cached, &mut report);
    assert_eq!(status, Some(0x09_1237));
    assert_eq!((feedback.report, feedback.mode), (Report::Operating, OperatingMode::Velocity));
    assert_eq!(feedback.get(Signal::PositionActual), Some(250_000_000));
    assert_eq!(feedback.get(Signal::VelocityActual), Some(-1_000_000_000));
    assert_eq!(feedback.get(Signal::TorqueActual), Some(-500_000));
    assert_eq!(program.decode(&shown[..2], false, &mut feedback, &mut cached, &mut report), None);
}

#[test]
fn the_first_mode_that_the_drive_has_is_taken() {
    let mut facts = servo();
    // csp and the two profile modes.
    facts.note_data(object(0x6502, 0), &0x8C_u32.to_le_bytes());
    let program = shipped().cia402_program(&axis(&ALL), &facts).unwrap();
    let modes = ALL.map(|mode| program.control(Action::None, mode.into(), 0, 0) >> 16);
    assert_eq!(modes, [8, 3, 4]);
    facts.note_data(object(0x6502, 0), &0x04_u32.to_le_bytes());
    let error = shipped().cia402_program(&axis(&ALL), &facts).unwrap_err();
    assert_eq!(
        error.to_string(),
        "position needs one of the modes csp, ip, the drive has none of them: 6502:00 is 0x00000004"
    );
    // A drive that does not say is believed to have what is wanted most.
    let mut unsaid = servo();
    unsaid.note_missing(object(0x6502, 0));
    let program = shipped().cia402_program(&axis(&ALL), &unsaid).unwrap();
    assert_eq!(ALL.map(|mode| program.control(Action::None, mode.into(), 0, 0) >> 16), [8, 9, 10]);
}

fn steps(plan: Plan, axis: &Cia402Axis) -> String {
    let steps = shipped().cia402_steps(plan, axis, &servo()).unwrap();
    let line = |step: &ObjectStep| match step {
        ObjectStep::Read { object, fail } => format!("read  {object} fail={fail}"),
        ObjectStep::Write { object, bytes, fail } => format!("write {object} {bytes:02X?} fail={fail}"),
    };
    steps.iter().map(line).collect::<Vec<_>>().join("\n")
}

#[test]
fn what_a_drive_is_asked_and_told() {
    let mut axis = axis(&ALL);
    let limit = |name: &str, value| (Parameter::from_name(name).unwrap(), value);
    axis.parameters = vec![
        limit("torque_limit_positive", 1_500_000),
        limit("torque_limit_negative", -1_200_000),
        limit("velocity_limit_positive", 50_000_000_000),
    ];
    let mut text = steps(Plan::Ask, &axis);
    text.push_str("\n\n");
    text.push_str(&steps(Plan::Tell, &axis));
    insta::assert_snapshot!(text);
    let step = ObjectStep::Read { object: object(0x6064, 0), fail: false };
    let of = |number| step.item(&Cia402Axis { axis: number, ..Cia402Axis::default() });
    assert_eq!(of(1), Some(Item::object(0x6864, 0)));
    assert_eq!(of(8), None);
}

/// What is written of two limits of the torque, 150 % forward and 120 % backward.
fn torque_limits(facts: &ObjectFacts) -> Vec<String> {
    let limit = |name: &str, value| (Parameter::from_name(name).unwrap(), value);
    let parameters =
        vec![limit("torque_limit_positive", 1_500_000), limit("torque_limit_negative", -1_200_000)];
    let axis = Cia402Axis { parameters, ..axis(&ALL) };
    let steps = shipped().cia402_steps(Plan::Tell, &axis, facts).unwrap();
    let written = steps.iter().filter_map(|step| match step {
        ObjectStep::Write { object, bytes, .. } if [0x6072, 0x60E0, 0x60E1].contains(&object.index) => {
            Some(format!("{object} {}", u16::from_le_bytes([bytes[0], bytes[1]])))
        }
        _ => None,
    });
    written.collect()
}

#[test]
fn limits_of_the_torque_are_exchanged_where_positions_are_inverted_and_torques_are_not() {
    for (polarity, expected) in [
        (0x00, ["60E0:00 1500", "60E1:00 1200"]),
        (0x40, ["60E0:00 1500", "60E1:00 1200"]),
        (0x80, ["60E1:00 1500", "60E0:00 1200"]),
        (0xC0, ["60E1:00 1500", "60E0:00 1200"]),
    ] {
        let mut facts = servo();
        facts.note_data(object(0x607E, 0), &[polarity]);
        assert_eq!(torque_limits(&facts), expected, "{polarity:02X}");
        let program = shipped().cia402_program(&axis(&ALL), &facts).unwrap();
        let held = |name| program.parameter(Parameter::from_name(name).unwrap()).unwrap();
        let both = ["torque_limit_positive", "torque_limit_negative"].map(held);
        let shown = both.map(|entry| {
            let (bytes, len, clamped) = entry
                .encode(if entry.parameter == both[0].parameter { 1_500_000 } else { -1_200_000 })
                .unwrap();
            assert!(!clamped);
            format!("{} {}", entry.item, entry.width.integer(&bytes[..len]).unwrap())
        });
        assert_eq!(shown, expected, "{polarity:02X}, by the controller");
    }
}

#[test]
fn a_drive_with_one_limit_for_both_directions_is_told_the_lesser_one() {
    let mut facts = servo();
    facts.note_missing(object(0x60E1, 0));
    assert_eq!(torque_limits(&facts), ["60E0:00 1500", "6072:00 1200"]);
    facts.note_missing(object(0x60E0, 0));
    assert_eq!(torque_limits(&facts), ["6072:00 1200"], "once");
    let program = shipped().cia402_program(&axis(&ALL), &facts).unwrap();
    let limit = Parameter::from_name("torque_limit_positive").unwrap();
    assert_eq!(program.parameter(limit), None, "a controller that sets one of them would move the other");
}

#[test]
fn both_speeds_of_homing_are_parameters() {
    let program = program(&ALL);
    for (name, object) in [("homing_velocity", "6099:01"), ("homing_creep_velocity", "6099:02")] {
        let entry = program.parameter(Parameter::from_name(name).unwrap()).unwrap();
        // Two turns a second of 3600 counts.
        let (bytes, len, clamped) = entry.encode(2_000_000_000).unwrap();
        assert_eq!((entry.item.to_string().as_str(), clamped), (object, false));
        assert_eq!(entry.width.integer(&bytes[..len]), Some(7_200));
    }
}

#[test]
fn what_cannot_be_told_is_an_error() {
    let with = |change: &dyn Fn(&mut Cia402Axis)| {
        let mut axis = axis(&ALL);
        change(&mut axis);
        shipped().cia402_steps(Plan::Tell, &axis, &servo()).unwrap_err().to_string()
    };
    let limit = Parameter::from_name("torque_limit_positive").unwrap();
    let mut text = String::new();
    for error in [
        with(&|axis| axis.cycle = DurationNs(31_250)),
        with(&|axis| axis.parameters = vec![(limit, 70_000_000)]),
        with(&|axis| axis.modes.clear()),
        with(&|axis| axis.modes = [OperatingMode::Acceleration.into()].into_iter().collect()),
    ] {
        writeln!(text, "{error}").unwrap();
    }
    let linear =
        Cia402Axis { units: AxisUnits { kind: UnitKind::Linear, ..AxisUnits::default() }, ..axis(&ALL) };
    writeln!(text, "{}", shipped().cia402_program(&linear, &servo()).unwrap_err()).unwrap();
    let bare = shipped().cia402_program(&axis(&ALL), &ObjectFacts::new()).unwrap_err();
    writeln!(text, "{bare}").unwrap();
    let mut facts = servo();
    facts.note_missing(object(0x607A, 0));
    writeln!(text, "{}", shipped().cia402_program(&axis(&ALL), &facts).unwrap_err()).unwrap();
    let ninth = Cia402Axis { axis: 8, ..axis(&ALL) };
    writeln!(text, "{}", shipped().cia402_program(&ninth, &servo()).unwrap_err()).unwrap();
    insta::assert_snapshot!(text);
}

#[test]
fn the_configuration_goes_before_the_factor_group() {
    let mut own = axis(&ALL);
    own.counts = vec![(Quantity::Velocity, Ratio::new(5_000_000, 3).unwrap())];
    let program = shipped().cia402_program(&own, &servo()).unwrap();
    let lsb =
        |signal| program.feedback.fields().find(|field| field.signal == signal).unwrap().conversion.ratio;
    // 0.1 rpm; a turn of 3600 counts.
    assert_eq!(lsb(Signal::VelocityActual), Ratio::new(5_000_000, 3).unwrap());
    assert_eq!(lsb(Signal::PositionActual), Ratio::new(1_000_000_000, 3600).unwrap());
    // A spindle of 10 mm: 3600 counts are 10^10 nanometres of a millimetre.
    let units = AxisUnits { kind: UnitKind::Linear, ..AxisUnits::default() };
    let linear = Cia402Axis { units, way_of_a_turn: Ratio::new(10, 1), ..axis(&ALL) };
    let program = shipped().cia402_program(&linear, &servo()).unwrap();
    let lsb = program.feedback.fields().find(|field| field.signal == Signal::PositionActual).unwrap();
    assert_eq!(lsb.conversion.ratio, Ratio::new(10_000_000_000, 3600).unwrap());
}

#[test]
fn every_error_code_has_a_cause_and_a_code_counts_before_its_class() {
    let mapping = shipped();
    let program = program(&ALL);
    let set = mapping.dictionaries.cia402.codes("Error code").unwrap();
    let word = program.diagnostic_words(true).next().unwrap();
    assert_eq!(word.to_string(), "603F:00");
    let mut text = String::new();
    for code in set.codes.iter().filter(|code| code.code != 0) {
        let found: Vec<_> = program.faults(word, u32::try_from(code.code).unwrap()).collect();
        let [(cause, reaction)] = found[..] else { panic!("{:04X} {}: {found:?}", code.code, code.name) };
        writeln!(text, "{:04X} {:<45} {cause} {reaction}", code.code, code.name).unwrap();
    }
    insta::assert_snapshot!(text);
    // Codes without a name have the cause of their class.
    let cause = |code| program.faults(word, code).next().map(|(cause, _)| cause.to_string());
    assert_eq!(cause(0x8699), Some("excessive_position_error".to_owned()));
    assert_eq!(cause(0x2FFF), Some("over_current".to_owned()));
    assert_eq!(cause(0), None);
    for class in &set.classes {
        assert!(cause(u32::try_from(class.first).unwrap() | 0x0F).is_some(), "{}", class.name);
    }
}

proptest! {
    /// A value loses at most half a count on its way to the drive and back.
    #[test]
    fn positions_lose_at_most_one_count(
        generic in -2_000_000_000_i64..2_000_000_000, feed in 1_u32..1 << 24, shaft in 1_u32..16,
    ) {
        let mapping: &Mapping = shipped();
        let program = mapping.cia402_program(&axis(&ALL[..1]), &with_feed(feed, shaft)).unwrap();
        let field = program.command.fields().next().unwrap();
        let back = program.feedback.fields().next().unwrap();
        let outcome = field.conversion.convert(generic);
        let lsb = 1e9 * f64::from(shaft) / f64::from(feed);
        let lost = f64_from_i64(back.conversion.convert(outcome.value).value - generic).abs();
        prop_assert!(lost <= lsb.max(1.0), "{lost} of {lsb}");
    }
}

/// 607A is set-point and target: what a drive follows at once in csp is never where it shall go to by itself.
#[test]
fn a_target_counts_only_in_a_drive_that_shows_that_it_goes_to_targets() {
    let target = ModeSelection::by_drive(OperatingMode::Position);
    let mut needs = axis(&ALL[..1]);
    needs.modes.push(target);
    let mut facts = servo();
    facts.note_data(object(0x6502, 0), &0x81_u32.to_le_bytes());
    let program = shipped().cia402_program(&needs, &facts).unwrap();
    let mut command = AxisCommand::default();
    command.set(Signal::PositionCommand, 1_000_000_000);
    command.set(Signal::TargetPosition, -1_000_000_000);
    let placed = |selection: ModeSelection, status| {
        let mut command = command;
        command.select(selection);
        let (mut bytes, mut report) = ([0; 19], ConversionReport::default());
        let control = program.encode(&command, Action::Enable, 0, status, &mut bytes, &mut report);
        (control >> 16, i32::from_le_bytes([bytes[3], bytes[4], bytes[5], bytes[6]]))
    };
    assert_eq!(placed(target, 0x08_1027), (1, 3600), "told pp, and still in csp");
    assert_eq!(placed(target, 0x01_0027), (1, -3600));
    assert_eq!(placed(OperatingMode::Position.into(), 0x01_0027), (8, 3600));
    assert_eq!(placed(OperatingMode::Position.into(), 0x08_1027), (8, 3600));
}

/// What a drive tells whose 60FD stands in its telegram, by the bits that are set in it.
fn inputs(
    facts: &ObjectFacts,
    captures: CaptureMode,
    left_out: Vec<Signal>,
    word: u32,
) -> Option<StatusBits> {
    let axis = Cia402Axis { captures, left_out, ..axis(&ALL[..1]) };
    let program = shipped().cia402_program(&axis, facts).unwrap();
    let mut telegram = vec![0; usize::from(program.telegram.feedback_bytes)];
    let place = program.place_of_feedback(Item::object(0x60FD, 0));
    if let Some((at, len)) = place {
        telegram[at..at + len].copy_from_slice(&word.to_le_bytes());
    }
    let mut feedback = AxisFeedback::default();
    let mut report = ConversionReport::default();
    program.decode(&telegram, false, &mut feedback, &mut program.cached_status(), &mut report);
    let seen = feedback.get(Signal::DigitalInputs);
    assert_eq!(seen, place.map(|_| i64::from(word)), "the word as it is");
    assert_eq!(program.knows_status(StatusBits::LIMIT_SWITCHES), place.is_some());
    place.map(|_| feedback.status & StatusBits::INPUTS)
}

#[test]
fn switches_are_status_bits_where_the_inputs_are_sent() {
    let told = StatusBits::LIMIT_SWITCHES;
    let [positive, negative] = [StatusBits::POSITIVE_LIMIT_SWITCH, StatusBits::NEGATIVE_LIMIT_SWITCH];
    for (polarity, low, high) in
        [(0, negative, positive), (0x40, negative, positive), (0x80, positive, negative)]
    {
        let mut facts = servo();
        facts.note_data(object(0x607E, 0), &[polarity]);
        let cases = [
            (0, told),
            (0x1, told | low),
            (0x2, told | high),
            (0x4, told | StatusBits::HOME_SWITCH),
            (0xFFFF_0008, told),
            (0x7, told | low | high | StatusBits::HOME_SWITCH),
        ];
        for (word, expected) in cases {
            let here = inputs(&facts, CaptureMode::Off, Vec::new(), word);
            assert_eq!(here, Some(expected), "607E {polarity:02X}, 60FD {word:08X}");
        }
    }
    let left_out = vec![Signal::DigitalInputs];
    assert_eq!(inputs(&servo(), CaptureMode::ServiceChannel, left_out.clone(), 0x7), None, "not asked for");
    let with_events = inputs(&servo(), CaptureMode::Cyclic, left_out, 0x2);
    assert_eq!(with_events, Some(told | positive), "there for the home switch, so all see it");
    let mut without = servo();
    without.note_missing(object(0x60FD, 0));
    assert_eq!(inputs(&without, CaptureMode::Cyclic, Vec::new(), 0), None, "the drive has none");
}

#[test]
fn the_following_error_is_that_of_the_drive_where_it_is_sent() {
    for (polarity, expected) in [(0x00, 250_000_000), (0x80, 250_000_000)] {
        let mut facts = servo();
        facts.note_data(object(0x607E, 0), &[polarity]);
        let axis = Cia402Axis { left_out: vec![Signal::DigitalInputs], ..axis(&ALL[..1]) };
        let program = shipped().cia402_program(&axis, &facts).unwrap();
        let (at, len) = program.place_of_feedback(Item::object(0x60F4, 0)).unwrap();
        let mut telegram = vec![0; usize::from(program.telegram.feedback_bytes)];
        telegram[at..at + len].copy_from_slice(&900_i32.to_le_bytes());
        let mut feedback = AxisFeedback::default();
        let mut report = ConversionReport::default();
        program.decode(&telegram, false, &mut feedback, &mut program.cached_status(), &mut report);
        assert_eq!(feedback.get(Signal::FollowingError), Some(expected), "{polarity:02X}");
    }
}

/// What was shown last is kept with what it says: every part of it has to count.
#[test]
fn what_a_drive_says_follows_what_it_shows_in_every_cycle() {
    let program =
        shipped().cia402_program(&Cia402Axis { left_out: Vec::new(), ..axis(&ALL) }, &servo()).unwrap();
    let (at, _) = program.place_of_feedback(Item::object(0x60FD, 0)).unwrap();
    let bytes = usize::from(program.telegram.feedback_bytes);
    let words = [0, 0x1, 0x2].into_iter().flat_map(|inputs| {
        let states = STATES.iter().flat_map(|(_, state)| [*state, *state | 0x1000]);
        states.flat_map(move |state| [8, 9, 10].map(|mode| (inputs, state, mode)))
    });
    let shown: Vec<_> = words.flat_map(|shown| [(shown, false), (shown, true)]).collect();
    let hear = |cached: &mut _, ((inputs, state, mode), led): ((u8, u32, u8), bool)| {
        let mut telegram = vec![0; bytes];
        telegram[..2].copy_from_slice(&state.to_le_bytes()[..2]);
        (telegram[2], telegram[at]) = (mode, inputs);
        let (mut feedback, mut report) = (AxisFeedback::default(), ConversionReport::default());
        program.decode(&telegram, led, &mut feedback, cached, &mut report).unwrap();
        (feedback.report, feedback.mode, feedback.status)
    };
    let alone: Vec<_> = shown.iter().map(|shown| hear(&mut program.cached_status(), *shown)).collect();
    let mut said = alone.clone();
    said.sort_by_key(|said| format!("{said:?}"));
    said.dedup();
    assert!(said.len() > 20, "they say different things: {}", said.len());
    let mut cached = program.cached_status();
    for step in [1, 2, 6, 48, 7, 96] {
        for turn in 0..2 * shown.len() {
            // Everything twice, and each behind another one than before.
            let at = turn / 2 * step % shown.len();
            assert_eq!(hear(&mut cached, shown[at]), alone[at], "{:?}", shown[at]);
        }
    }
}
