//! The cyclic planes through the whole chain: cyclic axes, changes of the position reference, torque control.

use std::cell::Cell;
use std::rc::Rc;

use axisbridge::mapping::Mapping;
use axisbridge::simulate::setup::make_cyclic;
use axisbridge_tests::rig::motion::{NANO, TURNTABLE, millis};
use axisbridge_tests::rig::ports::Bytes;
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cip::controller::{AxisSet, ControllerConfig, Limits, Step};
use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::motion::codes::{AxisControl, ControlMode};
use profile_cip::wire::motion::{
    ActualBlock, ActualFrame, ActualPosition, ActualWriter, CommandBlock, CommandFrame, CommandPosition,
    CommandValues, CommandWriter,
};
use profile_generic::cast::f64_from_i64;
use profile_generic::image::Signal;
use profile_generic::quantity::Position;

/// Room for any update.
const ROOM: usize = 1_500;

/// Changes the cyclic block of axis 1 in a datagram of one direction.
macro_rules! change {
    ($(#[$doc:meta])* $name:ident, $block:ty, $frame:ty, $writer:ty) => {
        $(#[$doc])*
        pub(super) fn $name(datagram: &mut Bytes, change: impl FnOnce(&mut $block)) {
            let bytes = datagram.as_slice().to_vec();
            let Ok(data) = Class1Datagram::parse(&bytes).map(|datagram| datagram.data) else { return };
            let Ok(frame) = <$frame>::parse(data) else { return };
            let mut buffer = [0; ROOM];
            let mut writer = <$writer>::new(&mut buffer, frame.header()).expect("room");
            let mut change = Some(change);
            for mut instance in frame.instances() {
                if let (1, Some(block)) = (instance.number, &mut instance.cyclic)
                    && let Some(change) = change.take()
                {
                    change(block);
                }
                writer.instance(&instance).expect("room");
            }
            let length = writer.finish();
            replace(datagram, &bytes, data.len(), &buffer[..length]);
        }
    };
}
change! {
    /// In a datagram of the controller.
    change_command, CommandBlock, CommandFrame, CommandWriter
}
change! {
    /// In a datagram of the box.
    change_actual, ActualBlock, ActualFrame, ActualWriter
}

/// Puts other data behind the header of a datagram and corrects the length in its item.
fn replace(datagram: &mut Bytes, bytes: &[u8], old: usize, data: &[u8]) {
    // The data item's length counts the class-1 sequence count, too.
    let head = bytes.len() - old;
    let mut whole = bytes[..head].to_vec();
    whole.extend_from_slice(data);
    let length = u16::try_from(data.len() + 2).expect("a datagram").to_le_bytes();
    whole[head - 4..head - 2].copy_from_slice(&length);
    datagram.replace(&whole);
}

/// The position that the box commands to the drive now, nanorevolutions.
fn commanded(rig: &Rig) -> i64 {
    rig.engine.axes()[0].command().get(Signal::PositionCommand).unwrap_or(0)
}

/// A program that turns the turntable far and back.
fn far_and_back(turns: f64) -> Vec<Step> {
    let fast = Limits { velocity: 40.0, acceleration: 400.0, jerk: 8_000.0 };
    vec![
        Step::Enable(AxisSet::one(1)),
        Step::MoveAbsolute { axis: 1, position: turns + 0.25, limits: fast },
        Step::Dwell { seconds: 0.3 },
        Step::MoveAbsolute { axis: 1, position: 0.125, limits: fast },
        Step::Dwell { seconds: 0.3 },
        Step::Disable(AxisSet::one(1)),
    ]
}

/// Runs it and looks at the drive at both ends: not one count of the controller away, however far it was.
fn run_far_and_back(rig: &mut Rig, turns: i64, nano_per_count: i64) {
    let whole = i32::try_from(turns).expect("some hundred turns");
    let mut config = rig.controller_config();
    make_cyclic(&Mapping::embedded().expect("sound tables"), &mut config.axes[0], UNWIND);
    rig.connect_with(config, far_and_back(f64::from(whole)));
    for (steps, target) in [(3, turns * NANO + NANO / 4), (5, NANO / 8)] {
        rig.run_until(millis(30_000), "an end", |rig| rig.report().steps_finished == steps);
        let error = rig.position(0) - target;
        assert!(error.abs() < nano_per_count, "{error} nanorevolutions away at {target}");
    }
    let report = rig.run(millis(5_000));
    assert_eq!(report.failure, None, "{}", rig.log());
}

/// Counts of a cycle: one revolution.
const UNWIND: i32 = 1_000_000;

#[test]
fn positions_of_a_cyclic_axis_stay_in_their_cycle_and_lead_through_many_of_them_without_drift() {
    for counted in [true, false] {
        let mut rig = Rig::ready(Settings::default());
        let seen = Rc::new(Cell::new((0_i32, 0_i32)));
        let range = Rc::clone(&seen);
        rig.tamper_actual = Some(Box::new(move |datagram| {
            change_actual(datagram, |block| {
                if let (Some(ActualPosition::Dint(position)), Some(cycles)) =
                    (block.actual.position, block.actual.unwind_count)
                {
                    assert!((0..UNWIND).contains(&position), "{position}");
                    range.set((range.get().0.min(cycles), range.get().1.max(cycles)));
                }
            });
            true
        }));
        rig.tamper_command = Some(Box::new(move |datagram| {
            change_command(datagram, |block| {
                if let Some(CommandPosition::Float(position)) = block.values.position {
                    assert!((0.0..f64::from(UNWIND)).contains(&position), "{position}");
                    block.values.unwind_count = block.values.unwind_count.filter(|_| counted);
                }
            });
            true
        }));
        run_far_and_back(&mut rig, 60, 1_000);
        assert_eq!(seen.get(), (if seen.get().0 < 0 { -1 } else { 0 }, 60), "cycles that were told");
    }
}

/// Leads a change of the position reference by the steps of Table 5-2.109, unnoticed by the controller behind.
struct Redefinition {
    displacement: i32,
    /// 0 not begun, 1 actual asked for, 2 command asked for, 3 done.
    phase: Rc<Cell<u8>>,
}

impl Redefinition {
    fn install(rig: &mut Rig, displacement: i32) -> Self {
        let phase = Rc::new(Cell::new(0));
        let (out, back) = (Rc::clone(&phase), Rc::clone(&phase));
        rig.tamper_command = Some(Box::new(move |datagram| {
            change_command(datagram, |block| {
                let control = match out.get() {
                    1 => AxisControl::CHANGE_ACTUAL_POSITION,
                    2 => AxisControl::CHANGE_COMMAND_POSITION,
                    _ => block.axis_control,
                };
                if control != block.axis_control {
                    block.axis_control = control;
                    block.values.position_displacement = Some(displacement);
                }
                if let Some(CommandPosition::Float(position)) = &mut block.values.position
                    && out.get() >= 2
                {
                    *position += f64::from(displacement);
                }
            });
            true
        }));
        rig.tamper_actual = Some(Box::new(move |datagram| {
            change_actual(datagram, |block| {
                let response = (block.axis_response, block.response_status);
                match back.get() {
                    1 if response == (AxisControl::CHANGE_ACTUAL_POSITION, 0) => back.set(2),
                    2 if response == (AxisControl::CHANGE_COMMAND_POSITION, 0) => back.set(3),
                    _ => {}
                }
                if matches!(
                    response.0,
                    AxisControl::CHANGE_ACTUAL_POSITION | AxisControl::CHANGE_COMMAND_POSITION
                ) {
                    block.axis_response = AxisControl::NONE;
                }
                if let Some(ActualPosition::Dint(position)) = &mut block.actual.position
                    && back.get() >= 2
                {
                    *position = position.wrapping_sub(displacement);
                }
            });
            true
        }));
        Self { displacement, phase }
    }
}

#[test]
fn a_change_of_the_position_reference_moves_nothing_standing_or_moving() {
    for (displacement, moving) in
        [(400_000, false), (-1_700_000, true), (2_000_000_000, true), (-2_000_000_000, false)]
    {
        let mut rig = Rig::ready(Settings::default());
        let change = Redefinition::install(&mut rig, displacement);
        rig.connect(vec![
            Step::Enable(AxisSet::one(1)),
            Step::MoveAbsolute { axis: 1, position: 10.0, limits: TURNTABLE },
            Step::Dwell { seconds: 0.5 },
            Step::MoveAbsolute { axis: 1, position: 2.0, limits: TURNTABLE },
            Step::Dwell { seconds: 0.2 },
            Step::Disable(AxisSet::one(1)),
        ]);
        let begin = |rig: &Rig| {
            if moving { rig.velocity(0) > 49 * NANO / 10 } else { rig.report().steps_finished == 2 }
        };
        rig.run_until(millis(20_000), "the moment of the change", begin);
        change.phase.set(1);
        let mut last = commanded(&rig);
        rig.run_until(millis(20_000), "the end of the moves", |rig| {
            let now = commanded(rig);
            // Five revolutions a second and a little overshoot, in a cycle of the bus.
            assert!((now - last).abs() < 11 * NANO / 1_000, "a step of {} at {displacement}", now - last);
            last = now;
            rig.report().steps_finished == 5
        });
        assert_eq!(change.phase.get(), 3, "{}", change.displacement);
        assert!((rig.position(0) - 2 * NANO).abs() < NANO / 1_000, "{}", rig.position(0));
        let report = rig.run(millis(5_000));
        assert_eq!(report.failure, None, "{}", rig.log());
    }
}

#[test]
fn an_axis_in_torque_control_gives_the_torque_it_is_told_and_is_disabled_out_of_it() {
    let mut rig = Rig::ready(Settings::default());
    let torque = Rc::new(Cell::new(None));
    let wanted = Rc::clone(&torque);
    rig.tamper_command = Some(Box::new(move |datagram| {
        change_command(datagram, |block| {
            if let Some(torque) = wanted.get() {
                block.control_mode = ControlMode::TORQUE;
                block.values = CommandValues { torque: Some(torque), ..CommandValues::default() };
            }
        });
        true
    }));
    rig.connect(vec![
        Step::Enable(AxisSet::one(1)),
        Step::Dwell { seconds: 1.5 },
        Step::Disable(AxisSet::one(1)),
    ]);
    rig.run_until(millis(10_000), "Running", |rig| rig.report().steps_finished == 1);
    for percent in [20.0_f32, -20.0] {
        torque.set(Some(percent));
        rig.run_for(millis(100));
        let before = rig.velocity(0);
        let actual = rig.drive(0).actual().torque.get();
        let expected = if percent > 0.0 { 200_000 } else { -200_000 };
        assert!((actual - expected).abs() < 2_000, "{actual} millionths at {percent} %");
        rig.run_for(millis(100));
        assert!((rig.velocity(0) - before) * expected.signum() > 0, "it is driven in that direction");
    }
    torque.set(Some(0.0));
    rig.run_for(millis(50));
    assert!(rig.drive(0).actual().torque.get().abs() < 2_000);
    let report = rig.run(millis(20_000));
    assert_eq!(report.failure, None, "{}", rig.log());
    assert!(rig.torque_free());
}

/// A box whose turntable has no ends, in front of a drive that works modulo 512 turns.
fn endless() -> Settings {
    let turntable = "unit = \"revolution\"\nunwind_counts = 1_000_000";
    let drive = "name = \"drive-a\"\naddress = 1\nset_scaling = true";
    let configuration = BOX.replacen("unit = \"revolution\"", turntable, 1).replacen(
        "name = \"drive-a\"\naddress = 1",
        drive,
        1,
    );
    Settings { configuration, ..Settings::default() }
}

/// A controller that counts the turntable's cycles, and what it makes of it.
fn endless_config(rig: &Rig) -> ControllerConfig {
    let mut config = rig.controller_config();
    make_cyclic(&Mapping::embedded().expect("sound tables"), &mut config.axes[0], UNWIND);
    config
}

/// Somebody turns the shaft of the turntable, 200 turns in a cycle of the bus, which is less than half of the drive's 512.
fn turn_by_hand(rig: &mut Rig, from: i64, to: i64) {
    let step = 200 * NANO;
    let mut at = from;
    while at != to {
        at += (to - at).clamp(-step, step);
        rig.drive_mut(0).servo_mut().set_position(Position(at));
        rig.run_for(millis(2));
    }
    rig.run_for(millis(20));
}

const FAST: Limits = Limits { velocity: 40.0, acceleration: 400.0, jerk: 8_000.0 };

#[test]
fn an_axis_without_ends_turns_on_smoothly_where_the_drive_starts_anew() {
    let mut rig = Rig::ready(endless());
    turn_by_hand(&mut rig, 0, 500 * NANO);
    let config = endless_config(&rig);
    let go = |distance| Step::MoveRelative { axis: 1, distance, limits: FAST };
    rig.connect_with(config, vec![Step::Enable(AxisSet::one(1)), go(30.0), go(-540.0), go(11.0)]);
    rig.run_until(millis(20_000), "Running", |rig| rig.report().steps_finished == 1);
    // From one cycle of the bus to the next: the way that is commanded, and the velocity that the drive really has.
    let (mut steepest, mut roughest, mut wraps) = (0, 0, 0);
    let (mut before, mut last) = (commanded(&rig), rig.velocity(0));
    for (steps, target) in [(2, 530 * NANO), (3, -10 * NANO), (4, NANO)] {
        while rig.report().steps_finished < steps {
            rig.cycle_in(|cycle| cycle());
            let (now, velocity) = (commanded(&rig), rig.velocity(0));
            let turn = 512 * NANO;
            wraps += i32::from(now.div_euclid(turn) != before.div_euclid(turn));
            steepest = steepest.max((now - before).abs());
            roughest = roughest.max((velocity - last).abs());
            (before, last) = (now, velocity);
        }
        let away = rig.position(0) - target;
        assert!(away.abs() < NANO / 100, "{away} nanorevolutions away from {target}");
    }
    assert_eq!(wraps, 4, "over 512 turns and back, and below zero and back");
    // 40 turns a second are 0.08 in 2 ms; 400 turns a second squared are 0.8 turns a second in 2 ms.
    assert!((79_000_000..81_000_000).contains(&steepest), "{steepest}");
    assert!(roughest < NANO, "{roughest}");
    let report = rig.run(millis(60_000));
    assert_eq!(report.failure, None, "{}\n{}", rig.log(), rig.told());
    assert!(!rig.told().contains("unwind_counts wants"), "{}", rig.told());
}

#[test]
fn a_million_turns_lose_not_a_count() {
    let mut rig = Rig::ready(endless());
    let config = endless_config(&rig);
    let far = 1_000_000;
    let mut at = 0;
    for turns in [far, -far, 0] {
        rig.kill_controller();
        rig.run_for(millis(1_000));
        turn_by_hand(&mut rig, at, turns * NANO);
        rig.connect_with(
            config.clone(),
            vec![
                Step::Enable(AxisSet::one(1)),
                Step::MoveRelative { axis: 1, distance: 3.25, limits: FAST },
                Step::Dwell { seconds: 0.3 },
                Step::MoveRelative { axis: 1, distance: -3.125, limits: FAST },
                Step::Dwell { seconds: 0.3 },
            ],
        );
        for (steps, away) in [(3, 3 * NANO + NANO / 4), (5, NANO / 8)] {
            rig.run_until(millis(30_000), "an end", |rig| rig.report().steps_finished == steps);
            let error = rig.position(0) - turns * NANO - away;
            assert!(error.abs() < 1_000, "{error} nanorevolutions away at {turns} turns");
            // What the controller is told is not one count of a millionth of a turn away either.
            let told = rig.report().axes[0].actual.expect("a position")
                - f64::from(i32::try_from(turns).expect("a million"));
            assert!((told - f64_from_i64(away) / 1e9).abs() < 1.5e-6, "{told} at {turns} turns");
        }
        let report = rig.run(millis(5_000));
        assert_eq!(report.failure, None, "{}\n{}", rig.log(), rig.told());
        at = rig.position(0);
    }
}

#[test]
fn a_drive_that_keeps_its_ends_is_told_of() {
    let configuration = endless().configuration.replacen("set_scaling = true", "set_scaling = false", 1);
    let rig = Rig::ready(Settings { configuration, ..Settings::default() });
    let told = rig.told();
    assert!(told.contains("axis 1: unwind_counts needs a drive that counts modulo"), "{told}");
    assert_eq!(told.matches("unwind_counts needs").count(), 1, "{told}");
}
