//! The whole chain with DeviceNet: a network with arbitration and bit times between the box and simulated drives.
//!
//! Where something goes wrong, the turntable (MAC ID 5) turns in velocity control, so that a drive that acts on an old set-point
//! goes on and on, and the slide (MAC ID 9) is on a long way at constant speed, and goes on.

use axisbridge::engine::axis::AxisChannel;
use axisbridge::simulate::devicenet_drive::DevicenetNode;
use axisbridge::simulate::program::{self, AxisPlan};
use axisbridge::status::BoxState;
use axisbridge_tests::rig::motion::{NANO, both, millis};
use axisbridge_tests::rig::motion_checker::violation::Rule;
use axisbridge_tests::rig::{Rig, Settings};
use profile_cip::controller::{AxisSet, Limits, Step};
use profile_cip::devicenet::wire::{DuplicateMac, Identifier, MacId};
use profile_cip::wire::motion::codes::FaultType;
use profile_generic::can::Frame;
use profile_generic::can::bus::Station;
use profile_generic::cast::f64_from_i64;
use profile_generic::fault::FaultCause;
use profile_generic::state::DriveState;

use super::beside::{Beside, connect};

/// Two CIP Motion drives at 10 ms and 500 kbit/s.
const BOX: &str = include_str!("devicenet.toml");

const TURNTABLE: AxisSet = AxisSet::one(1);

/// The slide's speed: 24 mm/s, which are 4.8 revolutions of its screw per second.
const SLIDE: Limits = Limits { velocity: 24.0, acceleration: 240.0, jerk: 4_800.0 };
const SLIDE_SPEED: i64 = 24 * NANO / 5;

fn settings() -> Settings {
    with(BOX)
}

fn with(configuration: &str) -> Settings {
    Settings::without_line(configuration)
}

/// The box with a velocity drive of the AC/DC drive profile on the turntable.
pub(super) fn velocity_drive(assembly: u8) -> String {
    let (head, tail) =
        BOX.split_once("[axis.limits]\nfollowing_error = 0.5\n").expect("the turntable's limits");
    let kind = format!("mac_id = 5\nkind = \"ac-dc\"\nassembly = {assembly}");
    format!("{head}{tail}").replace("mac_id = 5\nresolution = 1_048_576", &kind)
}

/// Box and drives as patient as they have to be on a host without real-time scheduling.
fn patient() -> String {
    BOX.replace("cycle_time = \"10 ms\"\n", "cycle_time = \"10 ms\"\nallowed_losses = 50\n")
        .replace("\nresolution =", "\npacket_rate = \"250 ms\"\nresolution =")
}

fn drive(rig: &Rig, drive: usize) -> &DevicenetNode {
    rig.devicenet[0].bus.nodes().nth(drive).expect("a drive")
}

fn velocity(rig: &Rig, place: usize) -> i64 {
    drive(rig, place).actual().velocity.get()
}

/// Where the servo of a drive is, in nanoturns of its motor.
fn position(rig: &Rig, place: usize) -> i64 {
    drive(rig, place).actual().position.get()
}

/// The same in turns.
fn turns(rig: &Rig, place: usize) -> f64 {
    f64_from_i64(position(rig, place)) / 1e9
}

const BUS: Beside = Beside { velocity, position, turns: turntable_turns, slides: slide_moves };

fn turn(velocity: f64) -> Step {
    Step::RunAt { axis: 1, velocity, acceleration: 20.0, jerk: 400.0 }
}

/// Both axes in motion; the turntable is reset and turned again after so many seconds.
fn in_motion(configuration: &str, seconds: f64) -> Rig {
    let mut rig = Rig::ready(with(configuration));
    let again =
        vec![Step::Dwell { seconds }, Step::FaultReset(TURNTABLE), Step::Enable(TURNTABLE), turn(2.0)];
    let far = Step::MoveAbsolute { axis: 2, position: 24.0 * (seconds + 2.0), limits: SLIDE };
    let program = vec![
        Step::Enable(both()),
        turn(2.0),
        Step::Together(vec![far, Step::Sequence(again)]),
        Step::Disable(both()),
    ];
    connect(&mut rig, program);
    rig.run_until(millis(10_000), "both in motion", |rig| turntable_turns(rig) && slide_moves(rig));
    rig
}

/// The turntable is at its speed, to a hundredth.
fn turntable_turns(rig: &Rig) -> bool {
    (velocity(rig, 0) - 2 * NANO).abs() < 2 * NANO / 100
}

/// The slide is at its speed: to a third at any instant, because the drive gets a position every 10 ms and makes a step of each, and
/// to a tenth over four cycles, as the box sees it.
fn slide_moves(rig: &Rig) -> bool {
    let seen = rig.engine.axes()[1].feedback().velocity.get();
    (velocity(rig, 1) - SLIDE_SPEED).abs() < SLIDE_SPEED / 3 && (seen - 24 * NANO).abs() < 24 * NANO / 10
}

#[track_caller]
fn count(rig: &Rig, text: &str) -> usize {
    rig.told().lines().filter(|line| *line == text).count()
}

/// Type and code of the faults of an axis that the controller got.
fn codes_of(rig: &Rig, axis: usize) -> Vec<(FaultType, u8)> {
    rig.report().axes[axis].faults.kept().iter().map(|fault| (fault.fault_type, fault.code)).collect()
}

/// Those of the turntable.
fn codes(rig: &Rig) -> Vec<(FaultType, u8)> {
    codes_of(rig, 0)
}

/// The turntable's axis has stopped because nothing good comes from its drive.
#[track_caller]
fn silent(rig: &Rig) {
    assert_eq!(codes(rig), [(FaultType::AXIS_MFG, 17)], "{}", rig.told());
    let axis = &rig.engine.axes()[0];
    assert_eq!(axis.fault().map(|fault| fault.cause), Some(FaultCause::SOUTH_SILENCE));
    assert!(matches!(axis.state(), DriveState::FaultReaction | DriveState::Faulted), "{:?}", axis.state());
}

/// A station that nobody has asked for asks for a MAC ID, or says that it has it.
fn claim(rig: &mut Rig, from: Station, mac: u8, response: bool) {
    let mac = MacId::new(mac).expect("a MAC ID");
    let message = DuplicateMac { response, port: 0, vendor: 0x0777, serial: 0x1234_5678 };
    let mut data = [0; 7];
    message.emit(&mut data).expect("seven bytes");
    let frame = Frame::new(Identifier::DuplicateMacCheck(mac).can(), &data).expect("a frame");
    let now = rig.now();
    rig.devicenet[0].bus.bus_mut().send(now, from, &frame).expect("the station has room");
}

fn intruder(rig: &mut Rig) -> Station {
    rig.devicenet[0].bus.bus_mut().add(64).expect("the bus has room for another station")
}

/// Lets the fragments of the drive with MAC ID 5 come in another order: the last but one is told to be the last.
fn shuffle(frame: &mut Frame) {
    const LAST: u8 = 0x80;
    let of = Identifier::PollResponse(MacId::new(5).expect("a MAC ID")).can();
    let [head, rest @ ..] = frame.data() else { return };
    if frame.id() == of && matches!(head & 0x3F, 1 | 2) {
        let other = if head & 0x3F == 1 { LAST | 2 } else { 0x40 | 1 };
        let data: Vec<u8> = core::iter::once(other).chain(rest.iter().copied()).collect();
        *frame = Frame::new(of, &data).expect("as long as it was");
    }
}

#[test]
fn two_axes_go_where_the_controller_sends_them() {
    let mut rig = Rig::ready(settings());
    let plans = [AxisPlan::new(1, 2.0, 600.0, 0.002, 6.0), AxisPlan::new(2, 40.0, 700.0, 0.02, 6.0)];
    rig.connect(program::standard(&plans, 6.0));
    let report = rig.run(millis(60_000));
    assert!(report.failure.is_none(), "{report:?}\n{}\n{}", rig.log(), rig.told());
    for (place, (plan, way)) in plans.iter().zip([1.0, 5.0]).enumerate() {
        let position = turns(&rig, place) * way;
        assert!((position - plan.target).abs() < plan.window, "{position} is not {}", plan.target);
    }
    rig.devicenet[0].bus.bus_mut().judge();
    assert!(rig.torque_free());
}

/// A host without real-time scheduling: what was built for a cycle that is left out is built again for another one, and the drive
/// must not count it as an update that was lost (more than four of them are a node fault).
#[test]
fn cycles_that_are_left_out_are_no_lost_updates() {
    let applied = |rig: &Rig, place| match drive(rig, place) {
        DevicenetNode::Motion(slave) => {
            let counters = slave.application().device().counters();
            (counters.applied, counters.lost_updates)
        }
        DevicenetNode::Speed(_) => panic!("both are CIP Motion drives"),
    };
    let mut rig = Rig::ready(with(&patient()));
    rig.wake_ups.jitter = millis(10);
    let before = [0, 1].map(|place| applied(&rig, place).0);
    rig.run_for(millis(5_000));
    for (place, before) in before.into_iter().enumerate() {
        let (applied, lost) = applied(&rig, place);
        let left_out = 500 - (applied - before);
        assert!(
            (50..300).contains(&left_out),
            "{left_out} cycles of 10 ms were left out: the test shows nothing\n{}",
            rig.told()
        );
        assert_eq!(lost, 0, "{}", rig.told());
        let axis = &rig.engine.axes()[place];
        assert_eq!(axis.fault(), None, "{}", rig.told());
        assert_eq!(axis.state(), DriveState::Inhibited, "{}", rig.told());
    }
}

/// The velocity of a CIP Motion drive is taken from its positions, whose distance in time is that of the grid.
#[test]
fn velocity_stays_what_it_is_when_cycles_are_left_out() {
    let mut rig = in_motion(&patient(), 3.0);
    let cycles = |rig: &Rig| {
        let statistics = *rig.engine.buses().devicenet().next().expect("a network").master().statistics();
        (statistics.cycles, statistics.skipped)
    };
    let before = cycles(&rig);
    rig.wake_ups.pause(rig.now() + millis(35));
    let end = rig.now() + millis(150);
    while rig.now() < end {
        rig.step();
        let seen = rig.engine.axes()[0].feedback().velocity.get();
        assert!((seen - 2 * NANO).abs() < 2 * NANO / 5, "{seen} after {:?}", cycles(&rig));
    }
    let after = cycles(&rig);
    assert!(after.1 - before.1 >= 2, "cycles were left out: {before:?} {after:?}");
    assert!(turntable_turns(&rig), "{}", rig.told());
    BUS.runs_again(&mut rig);
}

#[test]
fn a_drive_whose_plug_is_pulled_stops_by_itself_and_comes_back_while_the_other_goes_on() {
    let mut rig = in_motion(BOX, 8.0);
    let now = rig.now();
    rig.devicenet[0].bus.connect(now, 0, false);
    BUS.stops_within(&mut rig, 800);
    silent(&rig);
    assert_eq!(count(&rig, "DeviceNet 1: slave 5: poll connection: 4 answers in a row are missing"), 1);
    let now = rig.now();
    rig.devicenet[0].bus.connect(now, 0, true);
    BUS.go(&mut rig, 7_000, "the drive taken anew", |rig| {
        count(rig, "DeviceNet 1: slave 5: exchanging") == 2 && rig.engine.axes()[0].south().is_some()
    });
    assert!(velocity(&rig, 0).abs() < NANO / 100, "nobody has asked it to move");
    BUS.runs_again(&mut rig);
    rig.devicenet[0].bus.bus_mut().judge();
}

#[test]
fn a_fault_of_the_drive_is_told_with_its_cause_and_reset() {
    let mut rig = in_motion(BOX, 3.0);
    rig.devicenet[0]
        .bus
        .nodes_mut()
        .next()
        .expect("a drive")
        .servo_mut()
        .raise_fault(FaultCause::OVER_CURRENT);
    BUS.stops_within(&mut rig, 1_000);
    // Before the drive has said which: number 1 of the manufacturer.
    let told = [(FaultType::AXIS_MFG, 1), (FaultType::AXIS, 10)];
    assert_eq!(codes(&rig), told, "Inverter Overcurrent\n{}", rig.told());
    rig.devicenet[0]
        .bus
        .nodes_mut()
        .next()
        .expect("a drive")
        .servo_mut()
        .clear_fault(FaultCause::OVER_CURRENT);
    BUS.runs_again(&mut rig);
}

#[test]
fn one_message_with_its_fragments_out_of_order_stops_nobody() {
    let mut rig = in_motion(BOX, 1.0);
    let (from, refused) = (rig.now(), rig.status().counters.refused_frames);
    rig.devicenet[0].tamper = Some(Box::new(move |now, frame| {
        if now.since(from) < millis(10) {
            shuffle(frame);
        }
        true
    }));
    BUS.go_for(&mut rig, 200);
    assert!(turntable_turns(&rig), "{}", rig.told());
    assert!(rig.status().counters.refused_frames > refused, "they were not taken");
    let lost = rig.engine.axes()[0].counters().lost_telegrams;
    assert!((1..=2).contains(&lost), "{lost}");
    BUS.runs_again(&mut rig);
}

#[test]
fn fragments_that_stay_out_of_order_stop_their_axis() {
    let mut rig = in_motion(BOX, 8.0);
    rig.devicenet[0].tamper = Some(Box::new(|_, frame| {
        shuffle(frame);
        true
    }));
    BUS.stops_within(&mut rig, 1_500);
    silent(&rig);
    rig.devicenet[0].tamper = None;
    BUS.runs_again(&mut rig);
}

#[test]
fn a_box_whose_mac_id_another_node_has_stays_off_the_network_until_it_is_free() {
    let mut rig = Rig::new(settings());
    let other = intruder(&mut rig);
    rig.run_for(millis(500));
    claim(&mut rig, other, 1, true);
    rig.run_for(millis(5_000));
    assert_ne!(rig.status().state, BoxState::READY);
    assert!(!rig.told().contains("on line") && !rig.told().contains("exchanging"), "{}", rig.told());
    assert!(rig.told().contains("0x0777"), "expected who it is: {}", rig.told());
    // It asks again after ten seconds, and nobody minds.
    rig.run_until(millis(15_000), "the bus up", |rig| rig.status().state == BoxState::READY);
    assert_eq!(count(&rig, "DeviceNet 1: on line"), 1);
}

#[test]
fn a_node_that_asks_for_the_mac_id_of_the_box_is_told_and_changes_nothing() {
    let mut rig = in_motion(BOX, 1.0);
    let other = intruder(&mut rig);
    claim(&mut rig, other, 1, false);
    BUS.go_for(&mut rig, 300);
    assert!(turntable_turns(&rig), "{}", rig.told());
    BUS.runs_again(&mut rig);
}

#[test]
fn another_drive_than_expected_is_left_out_and_named() {
    let other = BOX.replacen("mac_id = 9\n", "mac_id = 9\nproduct_code = 77\n", 1);
    let mut rig = Rig::ready(with(&other));
    rig.run_for(millis(3_000));
    let named = "DeviceNet 1: slave 9: product code: expected 0x004d, found 0x0001";
    assert_eq!(count(&rig, named), 1, "{}", rig.told());
    let [good, left_out] = rig.engine.axes() else { panic!("two axes") };
    assert!(good.south().is_some() && left_out.south().is_none());
}

#[test]
fn a_velocity_drive_turns_both_ways_beside_a_motion_drive() {
    let mut rig = Rig::ready(with(&velocity_drive(21)));
    let far = Step::MoveAbsolute { axis: 2, position: 100.0, limits: SLIDE };
    let program = vec![
        Step::Enable(both()),
        turn(2.0),
        Step::Dwell { seconds: 1.0 },
        turn(-1.5),
        Step::Dwell { seconds: 1.0 },
        far,
        Step::Disable(both()),
    ];
    connect(&mut rig, program);
    rig.run_until(millis(10_000), "forward", turntable_turns);
    rig.run_for(millis(300));
    let seen = rig.engine.axes()[0].feedback().velocity.get();
    assert!((seen - 2 * NANO).abs() < NANO / 20, "the drive says {seen}, in whole rpm");
    rig.run_until(millis(10_000), "reverse", |rig| (velocity(rig, 0) + 3 * NANO / 2).abs() < NANO / 50);
    let report = rig.run(millis(30_000));
    assert_eq!(report.failure, None, "{}\n{}", rig.log(), rig.told());
    let reached = turns(&rig, 1) * 5.0;
    assert!((reached - 100.0).abs() < 0.2, "{reached}: the step ends with the command");
    assert!(rig.torque_free());
    rig.devicenet[0].bus.bus_mut().judge();
}

#[test]
fn a_velocity_drive_that_is_lost_stops_and_comes_back() {
    let mut rig = in_motion(&velocity_drive(21), 9.0);
    let now = rig.now();
    rig.devicenet[0].bus.connect(now, 0, false);
    BUS.stops_within(&mut rig, 6_000);
    silent(&rig);
    let now = rig.now();
    rig.devicenet[0].bus.connect(now, 0, true);
    BUS.runs_again(&mut rig);
}

#[test]
fn a_box_that_is_bus_off_stops_both_axes_and_leads_them_again_when_it_is_back() {
    let mut rig = in_motion(BOX, 30.0);
    let (now, own) = (rig.now(), rig.devicenet[0].bus.own_station());
    rig.devicenet[0].bus.bus_mut().take_off(now, own);
    // The drives miss four polls, and stop by themselves.
    let still = |rig: &Rig| (0..2).all(|place| velocity(rig, place).abs() < NANO / 100);
    rig.run_until(millis(1_500), "rest", still);
    let stands = [position(&rig, 0), position(&rig, 1)];
    rig.run(millis(60_000));
    let states: Vec<_> = rig.engine.axes().iter().map(AxisChannel::state).collect();
    assert_eq!(states, [DriveState::Faulted; 2], "nobody waits for ever on a bus without cycles");
    for (axis, stands) in stands.into_iter().enumerate() {
        assert_eq!(codes_of(&rig, axis), [(FaultType::AXIS_MFG, 17)], "{}", rig.told());
        assert!((position(&rig, axis) - stands).abs() < NANO / 1_000);
    }
    let now = rig.now();
    rig.devicenet[0].bus.bus_mut().restart(now, own);
    rig.run_until(millis(20_000), "both drives taken anew", |rig| {
        rig.engine.axes().iter().all(|axis| axis.south().is_some())
    });
    rig.run_for(millis(500));
    assert!(still(&rig) && rig.torque_free(), "nobody moves by itself");
    let program = vec![
        Step::Dwell { seconds: 0.1 },
        Step::FaultReset(both()),
        Step::Enable(both()),
        turn(2.0),
        Step::MoveRelative { axis: 2, distance: 48.0, limits: SLIDE },
        Step::Disable(both()),
    ];
    // Where an axis stands between two counts of its drive, the first set-points round to either: two counts of the slide in a cycle.
    rig.motion_checker.tolerate("counts of the controller and the drive that do not coincide", |violation| {
        violation.axis == 1 && violation.rule == Rule::Velocity && violation.value.abs() < 0.002
    });
    connect(&mut rig, program);
    rig.run_until(millis(10_000), "both in motion", |rig| turntable_turns(rig) && slide_moves(rig));
    let report = rig.run(millis(30_000));
    assert_eq!(report.failure, None, "{}\n{}", rig.log(), rig.told());
    assert!(rig.torque_free());
}

#[test]
fn a_bus_that_is_lost_again_and_again_is_left_alone_for_longer_and_longer() {
    let mut rig = Rig::ready(settings());
    let own = rig.devicenet[0].bus.own_station();
    let count = |rig: &Rig, text| rig.told().lines().filter(|line| line.ends_with(text)).count();
    // What the box does at once when it may: it asks twice whether its MAC ID is free.
    let mut asking = None;
    for (round, pause) in (1..).zip([0, 500, 1_000, 2_000]) {
        for _ in 0..if pause == 0 { 1 } else { 2 } {
            // Off once more while the pause lasts begins that pause anew, and is nothing new.
            let now = rig.now();
            rig.devicenet[0].bus.bus_mut().take_off(now, own);
            rig.run_for(millis(20));
            let now = rig.now();
            rig.devicenet[0].bus.bus_mut().restart(now, own);
            rig.run_for(millis(40));
        }
        assert_eq!(count(&rig, ": bus off"), round, "{}", rig.told());
        let begin = rig.now();
        rig.run_until(millis(10_000), "on line again", |rig| count(rig, ": on line") == round + 1);
        let waited = (rig.now() - begin).0 / 1_000_000;
        let asking = *asking.get_or_insert(waited);
        assert!((waited - asking - pause).abs() <= 20, "{waited} ms, of which {asking} to ask, not {pause}");
    }
    rig.run_for(millis(5_000));
    assert!(rig.engine.axes().iter().all(|axis| axis.south().is_some()), "both are in operation again");
}

/// The axis of the drive with MAC ID 5 is as it was, and its node has a fault.
fn with_node_fault(frame: &mut Frame) {
    const FAULT: u8 = 1 << 3;
    let of = Identifier::PollResponse(MacId::new(5).expect("a MAC ID")).can();
    // The fourth byte of the update, in its first fragment.
    if frame.id() == of && frame.data().first() == Some(&0) {
        let mut data: Vec<u8> = frame.data().to_vec();
        data[4] |= FAULT;
        *frame = Frame::new(of, &data).expect("as long as it was");
    }
}

#[test]
fn a_fault_of_a_node_stops_its_axis_until_it_is_reset() {
    let mut rig = in_motion(BOX, 4.0);
    rig.devicenet[0].tamper = Some(Box::new(|_, frame| {
        with_node_fault(frame);
        true
    }));
    // The fault takes no torque away: the drive brakes with it.
    let torque =
        |rig: &Rig| rig.devicenet[0].bus.nodes().next().expect("a drive").actual().report.has_torque();
    let (mut with, end) = (0, rig.now() + millis(1_000));
    BUS.go(&mut rig, 2_000, "a second", |rig| {
        with += i32::from(torque(rig));
        assert!(!torque(rig) || rig.engine.axes()[0].may_have_torque(), "{}", rig.told());
        rig.now() >= end
    });
    assert!(with > 10 && !torque(&rig), "{with}");
    BUS.stops_within(&mut rig, 1);
    // The axis of the drive knows of no fault, and half a second is waited for a cause.
    BUS.go_for(&mut rig, 500);
    assert_eq!(codes(&rig), [(FaultType::AXIS_MFG, 1)], "{}", rig.told());
    rig.devicenet[0].tamper = None;
    BUS.go_for(&mut rig, 300);
    assert!(rig.engine.axes()[0].fault().is_some(), "a fault stays until somebody resets it");
    BUS.runs_again(&mut rig);
}

#[test]
fn a_velocity_drive_with_the_basic_assembly_turns_forward_and_comes_back() {
    let mut rig = in_motion(&velocity_drive(20), 9.0);
    let seen = rig.engine.axes()[0].feedback().velocity.get();
    assert!((seen - 2 * NANO).abs() < NANO / 20, "the drive says {seen}, in whole rpm");
    let now = rig.now();
    rig.devicenet[0].bus.connect(now, 0, false);
    BUS.stops_within(&mut rig, 6_000);
    silent(&rig);
    let now = rig.now();
    rig.devicenet[0].bus.connect(now, 0, true);
    BUS.runs_again(&mut rig);
}

#[test]
fn the_basic_assembly_has_no_reverse_and_a_command_for_it_is_a_fault() {
    let mut rig = Rig::ready(with(&velocity_drive(20)));
    let program = vec![
        Step::Enable(TURNTABLE),
        turn(1.0),
        Step::Dwell { seconds: 0.5 },
        turn(-1.0),
        Step::Dwell { seconds: 5.0 },
    ];
    connect(&mut rig, program);
    rig.run_until(millis(10_000), "forward", |rig| (velocity(rig, 0) - NANO).abs() < NANO / 50);
    let mut least = NANO;
    rig.run_until(millis(10_000), "the fault", |rig| {
        least = least.min(velocity(rig, 0));
        rig.engine.axes()[0].fault().is_some()
    });
    let fault = rig.engine.axes()[0].fault().map(|fault| fault.cause);
    assert_eq!(fault, Some(FaultCause::POSITION_COMMAND_LIMIT), "{}", rig.told());
    rig.run_until(millis(3_000), "rest", |rig| {
        least = least.min(velocity(rig, 0));
        velocity(rig, 0).abs() < NANO / 100
    });
    assert!(least > -NANO / 100, "it never ran in reverse: {least}");
    rig.run_for(millis(500));
    assert_eq!(codes(&rig), [(FaultType::AXIS_MFG, 6)], "{}", rig.told());
}

#[test]
fn a_node_that_asks_for_the_mac_id_of_a_drive_is_told_and_changes_nothing() {
    let mut rig = in_motion(BOX, 2.0);
    let other = intruder(&mut rig);
    claim(&mut rig, other, 5, false);
    BUS.go_for(&mut rig, 500);
    assert!(turntable_turns(&rig), "{}", rig.told());
    let named = "DeviceNet 1: slave 5: another node wants its MAC ID: vendor 0x0777, serial 0x12345678";
    assert_eq!(count(&rig, named), 1, "{}", rig.told());
    BUS.runs_again(&mut rig);
}
