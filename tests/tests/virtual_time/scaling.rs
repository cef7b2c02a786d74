//! Drives in every scaling that a machine builder may have left them in: the axis goes where it is sent, as fast as it is
//! sent there, whatever the drive counts in.

use axisbridge_tests::rig::motion::{NANO, SLIDE, TURNTABLE, millis};
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cip::controller::{AttributeSet, AxisSet, Condition, ControllerConfig, Limits, Step};
use profile_cip::wire::motion::codes::{AxisControl, AxisStateCode};
use profile_generic::fault::FaultCause;
use profile_generic::state::DriveState;
use profile_sercos::wire::idn::Idn;

/// Parameters of the drive: number and value.
type Preset = &'static [(u16, i64)];

/// A gear of 5 to 2 and a spindle of 8 mm.
const GEAR: Preset = &[(121, 5), (122, 2), (123, 80_000)];

/// For the turntable.
const ROTARY: &[(&str, Preset)] = &[
    ("motor, preferential", &[(76, 0x02), (44, 0x02), (160, 0x02)]),
    ("load, preferential, per second", &[(76, 0x42), (44, 0x62), (160, 0x42)]),
    (
        "parameters",
        &[(76, 0x4A), (79, 1 << 20), (44, 0x4A), (45, 3), (46, -3), (160, 0x4A), (161, 7), (162, -4)],
    ),
    ("motor, parameters", &[(76, 0x0A), (79, 10_007), (44, 0x2A), (45, 1), (46, -5), (160, 0x0A), (162, -2)]),
    ("linear data of a turning axis", &[(76, 0x41), (44, 0x41), (160, 0x41)]),
    ("newton metre at the load", &[(86, 0x42)]),
    ("inch pounds at the motor", &[(86, 0x1A), (93, 1), (94, -2)]),
    ("load, modulo", &[(76, 0xC2), (103, 3_600_000)]),
    ("motor, modulo of some turns", &[(76, 0x8A), (79, 36_000), (103, 100_000)]),
];

/// For the slide.
const LINEAR: &[(&str, Preset)] = &[
    ("load, preferential", &[(76, 0x41), (44, 0x41), (160, 0x41)]),
    (
        "motor, metre per second",
        &[(76, 0x01), (44, 0x29), (45, 1), (46, -7), (160, 0x09), (161, 2), (162, -6)],
    ),
    (
        "inch",
        &[(76, 0x59), (77, 1), (78, -5), (44, 0x59), (45, 1), (46, -4), (160, 0x59), (161, 1), (162, -3)],
    ),
    ("inch, preferential", &[(76, 0x51), (44, 0x51), (160, 0x51)]),
    ("turns of the spindle", &[(76, 0x42), (44, 0x42), (160, 0x42)]),
    ("turns of the motor", &[(76, 0x0A), (79, 65_536), (44, 0x22), (160, 0x02)]),
    ("newton", &[(86, 0x49), (93, 1), (94, -1)]),
    ("pounds of force", &[(86, 0x19), (93, 1), (94, -1)]),
];

/// A box that knows what the motors are rated for.
fn rated() -> String {
    BOX.replace("address = 1", "address = 1\nrated_torque = \"1 Nm\"")
        .replace("address = 2", "address = 2\nrated_torque = \"200 N\"")
}

fn preset(rig: &mut Rig, place: usize, values: Preset) {
    for (idn, value) in values {
        rig.line.slaves_mut()[place].preset(Idn::standard(*idn), *value);
    }
}

/// Sends both axes somewhere and back, and looks at the servos themselves.
fn run(rig: &mut Rig, what: &str) {
    rig.run_until(millis(20_000), "the bus in CP4", |rig| rig.status().phase == 4);
    rig.connect(vec![
        Step::Enable(AxisSet::first(2)),
        Step::Together(vec![
            Step::MoveAbsolute { axis: 1, position: 2.25, limits: TURNTABLE },
            Step::MoveAbsolute { axis: 2, position: 150.5, limits: SLIDE },
        ]),
        Step::Dwell { seconds: 0.4 },
        Step::Jog { axis: 1, velocity: -2.0, acceleration: 40.0, jerk: 800.0, seconds: 1.0 },
        Step::Disable(AxisSet::first(2)),
    ]);
    rig.run_until(millis(20_000), "the end of the moves", |rig| rig.report().steps_finished == 3);
    for (place, target, window) in [(0, 9 * NANO / 4, NANO / 500), (1, 301 * NANO / 2, NANO / 25)] {
        let error = rig.position(place) - target;
        assert!(error.abs() < window, "{what}: axis {place} is {error} nanounits away\n{}", rig.told());
        // What the box says of itself is the same, to a count of the coarsest scaling here.
        let seen = rig.engine.axes()[place].feedback().position.get();
        assert!((seen - rig.position(place)).abs() < window, "{what}: {seen} seen");
    }
    rig.run_until(millis(5_000), "the velocity", |rig| (rig.velocity(0) + 2 * NANO).abs() < NANO / 50);
    rig.run_for(millis(100));
    let seen = rig.engine.axes()[0].feedback();
    assert!((seen.velocity.get() + 2 * NANO).abs() < NANO / 50, "{what}: {}", seen.velocity);
    assert!(
        (seen.torque.get() - rig.drive(0).actual().torque.get()).abs() < 20_000,
        "{what}: {}",
        seen.torque
    );
    let report = rig.run(millis(20_000));
    assert_eq!(report.failure, None, "{what}: {}\n{}", rig.log(), rig.told());
}

#[test]
fn axes_go_where_they_are_sent_in_every_scaling_of_their_drives() {
    for number in 0..ROTARY.len().max(LINEAR.len()) {
        let mut rig = Rig::new(Settings { configuration: rated(), ..Settings::default() });
        let (rotary, linear) = (ROTARY[number % ROTARY.len()], LINEAR[number % LINEAR.len()]);
        for (place, (_, values)) in [rotary, linear].into_iter().enumerate() {
            preset(&mut rig, place, GEAR);
            preset(&mut rig, place, values);
        }
        run(&mut rig, &format!("{} / {}", rotary.0, linear.0));
    }
}

/// Each polarity bit by itself and all of them: inverted as a whole the axis turns the other way, and where only some of
/// the bits are set, command and actual value still go the same way.
#[test]
fn polarities_lead_no_axis_astray() {
    for (position, velocity, torque) in [
        (0b000, 0b000, 0b000),
        (0b111, 0b111, 0b111),
        (0b001, 0b000, 0b000),
        (0b100, 0b000, 0b000),
        (0b000, 0b001, 0b001),
        (0b000, 0b100, 0b100),
        (0b101, 0b000, 0b101),
        (0b110, 0b011, 0b001),
    ] {
        let mut rig = Rig::new(Settings::default());
        for (idn, bits) in [(55, position), (43, velocity), (85, torque)] {
            rig.line.slaves_mut()[0].preset(Idn::standard(idn), bits);
        }
        rig.run_until(millis(20_000), "the bus in CP4", |rig| rig.status().phase == 4);
        rig.connect(vec![
            Step::Enable(AxisSet::one(1)),
            Step::MoveAbsolute { axis: 1, position: 1.5, limits: TURNTABLE },
            Step::Dwell { seconds: 0.3 },
            Step::Jog { axis: 1, velocity: 3.0, acceleration: 40.0, jerk: 800.0, seconds: 1.0 },
            Step::Disable(AxisSet::one(1)),
        ]);
        let what = format!("{position:#05b} {velocity:#05b} {torque:#05b}");
        let way = if position & 0b100 == 0 { 1 } else { -1 };
        rig.run_until(millis(20_000), "the end of the move", |rig| rig.report().steps_finished == 3);
        let error = rig.position(0) * way - 3 * NANO / 2;
        assert!(error.abs() < NANO / 500, "{what}: {error} nanorevolutions away");
        rig.run_until(millis(5_000), "the velocity", |rig| {
            (rig.velocity(0) * way - 3 * NANO).abs() < NANO / 50
        });
        let seen = rig.engine.axes()[0].feedback();
        assert!(seen.velocity.get() > 2 * NANO, "{what}: {}", seen.velocity);
        let torque = rig.drive(0).actual().torque.get() * way;
        assert!((seen.torque.get() - torque).abs() < 5_000, "{what}: {} for {torque}", seen.torque);
        let report = rig.run(millis(20_000));
        assert_eq!(report.failure, None, "{what}: {}\n{}", rig.log(), rig.told());
    }
}

/// What cannot be converted, or is only half understood, keeps its axis out, says why, and leaves the other one running.
#[test]
fn a_scaling_that_cannot_be_converted_is_told_with_drive_idn_and_value() {
    let cases: [(Preset, &str); 5] = [
        (&[(76, 0x00)], "S-0-0076: expected a scaling type that can be converted, got 0x0000"),
        (&[(44, 0x00)], "S-0-0044: expected a scaling type that can be converted, got 0x0000"),
        (
            &[(79, 1_000_000)],
            "S-0-0079: expected 3600000, which the scaling type S-0-0076 = 0x0002 fixes, got 1000000",
        ),
        (&[(76, 0x09), (78, -19)], "S-0-0078: expected an exponent from -18 to 18, got -19"),
        (&[(76, 0x82), (103, 0)], "S-0-0103: expected a number above 1, got 0"),
    ];
    for (values, why) in cases {
        let mut rig = Rig::new(Settings::default());
        preset(&mut rig, 0, values);
        rig.run_until(millis(20_000), "the bus in CP4", |rig| rig.status().phase == 4);
        rig.run_for(millis(100));
        let told = rig.told();
        let line = format!("axis 1: the drive with SERCOS address 1 cannot be used: {why}; it is left out");
        let refused = told.contains(&line) || told.contains("S-0-0103") && why.contains("S-0-0103");
        assert!(refused, "expected {line}\n{told}");
        assert_eq!(rig.engine.axes()[0].state(), DriveState::NotReady);
        assert_ne!(rig.engine.axes()[1].state(), DriveState::NotReady, "{told}");
    }
}

/// What was wrong may have been read wrongly, or is over: while nobody uses the bus, a drive that was left out is looked at again.
#[test]
fn a_drive_that_was_left_out_is_tried_again_while_no_controller_is_connected() {
    for connected in [false, true] {
        let mut rig = Rig::new(Settings::default());
        let scaling = rig.line.slaves()[0].store().number_of(Idn::standard(76));
        preset(&mut rig, 0, &[(76, 0)]);
        rig.run_until(millis(20_000), "the bus in CP4", |rig| rig.status().phase == 4);
        rig.run_for(millis(100));
        assert!(rig.told().contains("S-0-0076") && rig.engine.axes()[0].south().is_none(), "{}", rig.told());
        rig.line.slaves_mut()[0].preset(Idn::standard(76), scaling);
        if connected {
            let config = ControllerConfig { late: AxisSet::one(1), ..rig.controller_config() };
            rig.connect_with(config, vec![Step::Enable(AxisSet::one(2)), Step::Dwell { seconds: 500.0 }]);
            let end = rig.now() + millis(60_000);
            rig.run_until(millis(61_000), "a minute", |rig| {
                assert_eq!(rig.status().phase, 4);
                rig.now() >= end
            });
            continue;
        }
        let took = rig.run_until(millis(20_000), "the drive", |rig| rig.engine.axes()[0].south().is_some());
        assert!(took > millis(9_000), "{took}");
        rig.run_until(millis(5_000), "both drives", |rig| {
            rig.status().phase == 4
                && rig.engine.axes().iter().all(|axis| axis.state() != DriveState::NotReady)
        });
    }
}

/// Torque that cannot be converted keeps the axis out of torque control and of nothing else, where nobody has asked for it.
#[test]
fn a_torque_that_cannot_be_converted_is_done_without() {
    let why = "S-0-0086 = 0x0002: the drive gives torque in absolute units, and the axis has no rated torque";
    let preset_and_run = |configuration: String| {
        let mut rig = Rig::new(Settings { configuration, ..Settings::default() });
        preset(&mut rig, 0, &[(86, 0x02)]);
        rig.run_until(millis(20_000), "the bus in CP4", |rig| rig.status().phase == 4);
        rig.run_for(millis(100));
        rig
    };
    let rig = preset_and_run(BOX.to_owned());
    let line = format!("the drive with SERCOS address 1: the axis works without torque ({why})");
    assert!(rig.told().contains(&line), "{}", rig.told());
    assert_ne!(rig.engine.axes()[0].state(), DriveState::NotReady, "{}", rig.told());
    let first = "name = \"drive-a\"\naddress = 1\n";
    let modes = format!("{first}modes = [\"position\", \"torque\"]\n");
    let rig = preset_and_run(BOX.replace(first, &modes));
    let line = format!("the drive with SERCOS address 1 cannot be used: {why}; it is left out");
    assert!(rig.told().contains(&line), "{}", rig.told());
}

/// Half of a modulo range is the longest way that a command can lead in a cycle: a longer one would lead the drive the
/// other way round. It is not sent; the axis stops.
#[test]
fn a_command_that_a_modulo_drive_would_take_backward_is_not_sent() {
    let mut rig = Rig::new(Settings::default());
    // A hundredth of a turn: half of it is 2.5 turns a second in cycles of 2 ms.
    preset(&mut rig, 0, &[(76, 0xC2), (103, 36_000)]);
    rig.run_until(millis(20_000), "the bus in CP4", |rig| rig.status().phase == 4);
    rig.connect(vec![
        Step::Enable(AxisSet::one(1)),
        Step::MoveAbsolute { axis: 1, position: 1.0, limits: Limits { velocity: 2.0, ..TURNTABLE } },
        Step::MoveAbsolute { axis: 1, position: 20.0, limits: TURNTABLE },
    ]);
    rig.run_until(millis(20_000), "the slow move", |rig| rig.report().steps_finished == 2);
    assert!((rig.position(0) - NANO).abs() < NANO / 200, "{} after many wraps", rig.position(0));
    let mut last = 0;
    rig.run_until(millis(20_000), "the fault", |rig| {
        assert!(rig.velocity(0) > -NANO / 20, "backward at {}", rig.velocity(0));
        last = rig.velocity(0);
        rig.engine.axes()[0].faults().any(|active| active.fault.cause == FaultCause::VELOCITY_COMMAND_LIMIT)
    });
    assert!(last > 2 * NANO && last < 26 * NANO / 10, "stopped at {last}");
    rig.run_until(millis(3_000), "the end of the torque", |rig| rig.velocity(0).abs() < NANO / 100);
}

/// The controller can correct a scaling that was refused: the next Enable takes it, or refuses it again, and never waits for ever.
#[test]
fn a_scaling_that_was_refused_can_be_corrected() {
    let mut rig = Rig::ready(Settings::default());
    let turntable = AxisSet::one(1);
    let unwind = |counts: i32| Step::SetAttributes {
        axis: 1,
        attributes: vec![AttributeSet::usint(83, 1), AttributeSet::bytes(84, &counts.to_le_bytes())],
    };
    let refused = || {
        let state = Condition::State { axis: 1, state: AxisStateCode::MAJOR_FAULTED };
        let request = AxisControl::ENABLE;
        let fault = Step::Expect { condition: state, within: millis(500) };
        [Step::Ask { axes: turntable, request }, fault, Step::FaultReset(turntable)]
    };
    let mut program = vec![unwind(0)];
    program.extend(refused());
    program.extend(refused());
    program.extend([
        unwind(1_000_000),
        Step::Enable(turntable),
        Step::MoveAbsolute { axis: 1, position: 0.75, limits: TURNTABLE },
        Step::Disable(turntable),
    ]);
    rig.connect(program);
    let report = rig.run(millis(20_000));
    assert_eq!((report.failure, report.steps_finished), (None, 11), "{}\n{}", rig.log(), rig.told());
    assert!((rig.position(0) - 3 * NANO / 4).abs() < NANO / 500, "at {}", rig.position(0));
    let refusals = rig.told().matches("attribute 84: expected 2 counts to 2^31 - 1, got 0").count();
    assert_eq!(refusals, 2, "{}", rig.told());
}
