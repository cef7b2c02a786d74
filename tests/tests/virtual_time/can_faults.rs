//! A CANopen drive, its bus or somebody else on it misbehaves: its axis stops and says why, the other one goes on as if nothing
//! were, and when it is over a Fault Reset brings the axis back.
//!
//! The turntable (node 1) turns in velocity control without anybody looking after it, so that a drive that acts on an old
//! set-point goes on and on. The slide (node 2) is on a long way at constant speed.

use axisbridge::engine::axis::AxisChannel;
use axisbridge::simulate::can_drive::drive;
use axisbridge::status::BoxState;
use axisbridge_tests::rig::motion::{NANO, both, millis};
use axisbridge_tests::rig::{Rig, Settings};
use profile_cia402::node::drive::Axis;
use profile_cia402::wire::NodeId;
use profile_cip::controller::{AxisSet, Limits, Step};
use profile_cip::wire::motion::codes::{AxisControl, ControlMode, FaultType};
use profile_generic::can::bus::{Disturbance, Effect, State, Station};
use profile_generic::can::{Frame, Id};
use profile_generic::fault::FaultCause;
use profile_generic::state::DriveState;
use profile_generic::time::DurationNs;

use super::beside::{Beside, connect};

const BOX: &str = include_str!("can.toml");

const TURNTABLE: AxisSet = AxisSet::one(1);

/// Revolutions per second of the turntable, before and after.
const SPEED: f64 = 2.0;

/// The slide's speed: 24 mm/s, which are 4.8 revolutions of its screw per second.
const SLIDE: Limits = Limits { velocity: 24.0, acceleration: 240.0, jerk: 4_800.0 };
const SLIDE_SPEED: i64 = 24 * NANO / 5;

/// COB-IDs of node 1.
const EMCY: Id = Id::Standard(0x081);
const TPDO: Id = Id::Standard(0x181);
const SDO_ANSWER: Id = Id::Standard(0x581);
const HEARTBEAT: Id = Id::Standard(0x701);

fn axis(rig: &Rig, device: usize) -> &Axis {
    &rig.can[0].bus.nodes().nth(device).expect("a device").application().axes()[0]
}

fn velocity(rig: &Rig, device: usize) -> i64 {
    axis(rig, device).actual().velocity.get()
}

fn position(rig: &Rig, device: usize) -> i64 {
    axis(rig, device).actual().position.get()
}

const BUS: Beside = Beside { velocity, position, turns: turntable_turns, slides: slide_moves };

fn turn() -> Step {
    Step::RunAt { axis: 1, velocity: SPEED, acceleration: 20.0, jerk: 400.0 }
}

fn settings() -> Settings {
    Settings::without_line(BOX)
}

/// The slide goes far enough for what follows: `seconds`, and then turning the turntable again for a while.
fn far(seconds: f64) -> Step {
    Step::MoveAbsolute { axis: 2, position: 24.0 * (seconds + 2.0), limits: SLIDE }
}

/// Both axes in motion; the turntable is reset and turned again after so many seconds.
fn in_motion(seconds: f64) -> Rig {
    let mut rig = Rig::ready(settings());
    let again = vec![Step::Dwell { seconds }, Step::FaultReset(TURNTABLE), Step::Enable(TURNTABLE), turn()];
    let program = vec![
        Step::Enable(both()),
        turn(),
        Step::Together(vec![far(seconds), Step::Sequence(again)]),
        Step::Disable(both()),
    ];
    connect(&mut rig, program);
    rig.run_until(millis(10_000), "both in motion", moving);
    rig
}

fn moving(rig: &Rig) -> bool {
    turntable_turns(rig) && slide_moves(rig)
}

fn turntable_turns(rig: &Rig) -> bool {
    velocity(rig, 0) > 199 * NANO / 100
}

/// The slide is at its speed, to a hundredth.
fn slide_moves(rig: &Rig) -> bool {
    (velocity(rig, 1) - SLIDE_SPEED).abs() < SLIDE_SPEED / 100
}

/// Type and code of the faults of an axis that the controller got.
fn codes(rig: &Rig, place: usize) -> Vec<(FaultType, u8)> {
    rig.report().axes[place].faults.kept().iter().map(|fault| (fault.fault_type, fault.code)).collect()
}

/// What was told once.
#[track_caller]
fn told(rig: &Rig, text: &str) {
    let count = rig.told().lines().filter(|line| *line == text).count();
    assert_eq!(count, 1, "`{text}` is told {count} times:\n{}", rig.told());
}

/// The turntable's axis has stopped because nothing good comes from its drive.
#[track_caller]
fn silent(rig: &Rig) {
    assert_eq!(codes(rig, 0), [(FaultType::AXIS_MFG, 17)], "{}", rig.told());
    let axis = &rig.engine.axes()[0];
    assert_eq!(axis.fault().map(|fault| fault.cause), Some(FaultCause::SOUTH_SILENCE));
    assert!(matches!(axis.state(), DriveState::FaultReaction | DriveState::Faulted), "{:?}", axis.state());
    told(rig, "axis 1: Axis Fault - Mfg 17 (south_silence) in Running, fault action 0x23");
}

/// A station that nobody has asked for.
fn intruder(rig: &mut Rig) -> Station {
    rig.can[0].bus.bus_mut().add(64).expect("the bus has room for another station")
}

fn send(rig: &mut Rig, from: Station, id: Id, data: &[u8]) {
    let now = rig.now();
    let frame = Frame::new(id, data).expect("a frame");
    rig.can[0].bus.bus_mut().send(now, from, &frame).expect("the station has room");
}

#[test]
fn a_lost_heartbeat_stops_its_axis() {
    let mut rig = in_motion(3.0);
    rig.can[0].tamper = Some(Box::new(|_, frame| frame.id() != HEARTBEAT));
    // Three heartbeats of 100 ms may be missing.
    BUS.stops_within(&mut rig, 500);
    told(&rig, "CAN bus 1: the heartbeat of node 1 is gone");
    silent(&rig);
    rig.can[0].tamper = None;
    BUS.runs_again(&mut rig);
    rig.can[0].bus.bus_mut().judge();
}

#[test]
fn a_drive_whose_plug_is_pulled_stops_by_itself() {
    let mut rig = in_motion(3.0);
    let now = rig.now();
    rig.can[0].bus.connect(now, 0, false);
    BUS.stops_within(&mut rig, 500);
    silent(&rig);
    BUS.go(&mut rig, 1_000, "the loss", |rig| rig.told().contains("the heartbeat of node 1 is gone"));
    let now = rig.now();
    rig.can[0].bus.connect(now, 0, true);
    BUS.runs_again(&mut rig);
}

/// Nobody acknowledges what the gateway sends: its controller repeats one frame until somebody does. What was made meanwhile is old.
#[test]
fn old_commands_do_not_leave_when_contact_returns() {
    let mut rig = in_motion(30.0);
    let counts = |rig: &Rig| -> Vec<(u64, u64)> {
        let nodes = rig.can[0].bus.nodes();
        nodes.map(|node| (node.statistics().syncs, node.statistics().rpdos)).collect()
    };
    let plug = |rig: &mut Rig, connected| {
        let now = rig.now();
        (0..2).for_each(|device| rig.can[0].bus.connect(now, device, connected));
    };
    plug(&mut rig, false);
    rig.run_for(millis(100));
    let before = counts(&rig);
    plug(&mut rig, true);
    rig.run_for(millis(20));
    for ((syncs, rpdos), (syncs_before, rpdos_before)) in counts(&rig).into_iter().zip(before) {
        // What two cycles had left in the queue, what was made since, and five cycles; there are two RPDOs in each.
        let (syncs, rpdos) = (syncs - syncs_before, rpdos - rpdos_before);
        assert!((5..=8).contains(&syncs) && rpdos <= 16, "{syncs} SYNCs and {rpdos} RPDOs in five cycles");
    }
    // The drives have missed SYNC, and the gateway their answers: nothing moves, and all of it works again.
    rig.run_for(millis(1_000));
    for place in 0..2 {
        assert!(codes(&rig, place).contains(&(FaultType::AXIS_MFG, 17)), "{}", rig.told());
        assert!(!rig.engine.axes()[place].may_have_torque() && velocity(&rig, place).abs() < NANO / 100);
    }
    rig.kill_controller();
    rig.run_for(millis(5_000));
    let program = vec![
        Step::Dwell { seconds: 0.1 },
        Step::FaultReset(both()),
        Step::Enable(both()),
        Step::Together(vec![far(0.0), turn()]),
        Step::Disable(both()),
    ];
    connect(&mut rig, program);
    rig.run_until(millis(10_000), "both in motion", moving);
    let report = rig.run(millis(30_000));
    assert_eq!(report.failure, None, "{}\n{}", rig.log(), rig.told());
}

#[test]
fn a_drive_that_reboots_stops_its_axis() {
    let mut rig = in_motion(3.0);
    let now = rig.now();
    rig.can[0].bus.nodes_mut().next().expect("a drive").power_cycle(now);
    BUS.stops_within(&mut rig, 500);
    told(&rig, "CAN bus 1: node 1 has restarted while it was in operation");
    silent(&rig);
    BUS.runs_again(&mut rig);
    rig.can[0].bus.bus_mut().judge();
}

#[test]
fn a_storm_of_emergency_messages_stops_nobody() {
    let mut rig = in_motion(2.0);
    let other = intruder(&mut rig);
    rig.can[0].bus.bus_mut().share(EMCY);
    for _ in 0..500 {
        send(&mut rig, other, EMCY, &[0x00, 0x10, 0x01, 0, 0, 0, 0, 0]);
        BUS.go_for(&mut rig, 1);
        assert!(moving(&rig), "{}", rig.told());
    }
    told(&rig, "CAN bus 1: node 1 sends more emergency messages than are logged one by one");
    let all = rig.notices.iter().filter(|notice| notice.to_string().contains("EMCY ")).count();
    assert_eq!(all, 16, "in a second: {}", rig.told());
    assert_eq!(codes(&rig, 0), []);
    BUS.runs_again(&mut rig);
    rig.can[0].bus.bus_mut().judge();
}

#[test]
fn a_box_that_is_bus_off_stops_every_axis_and_leads_them_again_when_it_is_back() {
    let mut rig = in_motion(30.0);
    let (now, own) = (rig.now(), rig.can[0].bus.own_station());
    rig.can[0].bus.bus_mut().take_off(now, own);
    // The drives miss the SYNC of the box after three cycles.
    let still = |rig: &Rig| (0..2).all(|device| velocity(rig, device).abs() < NANO / 100);
    rig.run_until(millis(500), "rest", still);
    told(&rig, "CAN bus 1: the controller is off the bus");
    let stands = [position(&rig, 0), position(&rig, 1)];
    rig.run(millis(60_000));
    let states: Vec<_> = rig.engine.axes().iter().map(AxisChannel::state).collect();
    assert_eq!(states, [DriveState::Faulted; 2], "nobody waits for ever on a bus without cycles");
    for (place, stands) in stands.into_iter().enumerate() {
        assert_eq!(codes(&rig, place), [(FaultType::AXIS_MFG, 17)], "{}", rig.told());
        assert!((position(&rig, place) - stands).abs() < NANO / 1_000);
    }
    let now = rig.now();
    rig.can[0].bus.bus_mut().restart(now, own);
    rig.run_for(millis(2_000));
    told(&rig, "CAN bus 1: the controller is back on the bus");
    assert!(still(&rig) && rig.torque_free(), "nobody moves by itself");
    let program = vec![
        Step::Dwell { seconds: 0.1 },
        Step::FaultReset(both()),
        Step::Enable(both()),
        Step::Together(vec![far(0.0), turn()]),
        Step::Disable(both()),
    ];
    connect(&mut rig, program);
    rig.run_until(millis(10_000), "both in motion", moving);
    let report = rig.run(millis(30_000));
    assert_eq!(report.failure, None, "{}\n{}", rig.log(), rig.told());
}

#[test]
fn a_bus_that_is_lost_again_and_again_is_left_alone_for_longer_and_longer() {
    let mut rig = Rig::ready(settings());
    let own = rig.can[0].bus.own_station();
    let count = |rig: &Rig, text| rig.told().lines().filter(|line| *line == text).count();
    for (round, pause) in (1..).zip([0, 500, 1_000, 2_000, 4_000]) {
        let now = rig.now();
        rig.can[0].bus.bus_mut().take_off(now, own);
        rig.run_for(millis(20));
        let begin = rig.now();
        rig.can[0].bus.bus_mut().restart(begin, own);
        rig.run_until(millis(pause + 100), "back", |rig| {
            count(rig, "CAN bus 1: the controller is back on the bus") == round
        });
        let waited = rig.now() - begin;
        assert!((pause..pause + 10).contains(&(waited.0 / 1_000_000)), "{waited} in place of {pause} ms");
        assert_eq!(count(&rig, "CAN bus 1: the controller is off the bus"), round);
    }
    rig.run_for(millis(2_000));
    assert!(rig.engine.axes().iter().all(|axis| axis.south().is_some()), "both are in operation again");
}

#[test]
fn a_second_device_with_the_same_node_id_stops_the_axis_until_it_is_gone() {
    let mut rig = in_motion(14.0);
    rig.can[0].bus.add(drive(NodeId::new(1).ok(), 1).expect("a drive"));
    // Two stations that answer at once spoil each other's frames until both are bus off. What the drives know of the time is SYNC,
    // which waits for that.
    let mut slowest = SLIDE_SPEED;
    rig.run_until(millis(1_000), "both off", |rig| {
        slowest = slowest.min(velocity(rig, 1));
        let bus = &rig.can[0].bus;
        bus.bus().state(bus.station(0)) == State::BusOff && velocity(rig, 0).abs() < NANO / 100
    });
    assert!(slowest > SLIDE_SPEED * 9 / 10, "{slowest}");
    told(&rig, "CAN bus 1: node 1 has restarted while it was in operation");
    silent(&rig);
    // It is asked a second time.
    BUS.go_for(&mut rig, 1_200);
    let left_out = |line: &str| {
        line.starts_with("axis 1: commissioning of node 1 failed: ")
            && line.ends_with(": no answer within 500 ms; it is left out")
    };
    assert_eq!(rig.told().lines().filter(|line| left_out(line)).count(), 1, "{}", rig.told());
    BUS.stops_within(&mut rig, 10);
    let now = rig.now();
    let bus = &mut rig.can[0].bus;
    bus.connect(now, 2, false);
    bus.connect(now, 0, true);
    bus.nodes_mut().next().expect("a drive").power_cycle(now);
    BUS.runs_again(&mut rig);
}

#[test]
fn every_tpdo_twice_stops_its_axis() {
    let mut rig = in_motion(12.0);
    let (own, device) = (rig.can[0].bus.own_station(), rig.can[0].bus.station(0));
    let twice = Disturbance::all(Effect::Double).from(device).to(own).id(TPDO);
    rig.can[0].bus.bus_mut().disturb(twice);
    BUS.stops_within(&mut rig, 300);
    told(&rig, "CAN bus 1: two devices seem to have node-id 1: two of each TPDO");
    silent(&rig);
    rig.can[0].bus.bus_mut().calm();
    BUS.runs_again(&mut rig);
}

#[test]
fn as_many_lost_tpdos_as_are_permitted_stop_nobody() {
    let mut rig = in_motion(1.0);
    let mut left = 3;
    rig.can[0].tamper = Some(Box::new(move |_, frame| {
        let lost = frame.id() == TPDO && left > 0;
        left -= i32::from(lost);
        !lost
    }));
    BUS.go_for(&mut rig, 200);
    assert!(moving(&rig), "{}", rig.told());
    assert_eq!(rig.engine.axes()[0].counters().lost_telegrams, 3);
    assert_eq!((codes(&rig, 0), codes(&rig, 1)), (vec![], vec![]));
    BUS.runs_again(&mut rig);
}

#[test]
fn a_tpdo_that_stays_away_stops_its_axis() {
    let mut rig = in_motion(2.0);
    rig.can[0].tamper = Some(Box::new(|_, frame| frame.id() != TPDO));
    BUS.stops_within(&mut rig, 300);
    told(&rig, "CAN bus 1: TPDO 1 of node 1 is missing more often than permitted");
    silent(&rig);
    rig.can[0].tamper = None;
    BUS.runs_again(&mut rig);
    told(&rig, "CAN bus 1: TPDO 1 of node 1 comes again");
    rig.can[0].bus.bus_mut().judge();
}

/// A TPDO comes at any time of the cycle, and the other bus has the gateway look for it at any time: also between the step of the
/// axes and SYNC.
#[test]
fn a_tpdo_counts_whenever_it_comes_in_the_cycle() {
    let (first, second) =
        BOX.split_once("[[south.can.drive]]\nname = \"drive-b\"").expect("the second drive");
    let bus = "[[south.can]]\ninterface = \"in-process\"\ncycle_time = \"1 ms\"\n\n";
    let drive = "[[south.can.drive]]\nname = \"drive-b\"";
    // The step of the turntable is 0.4 ms before SYNC, and in between is that of the slide.
    let lead = "\n[south.realtime]\nlead = \"400 us\"\n";
    let mut rig = Rig::ready(Settings::without_line(format!("{first}{bus}{drive}{second}{lead}")));
    connect(&mut rig, vec![Step::Enable(both()), turn(), Step::Dwell { seconds: 500.0 }]);
    rig.run_until(millis(10_000), "the turntable in motion", turntable_turns);
    let (own, device) = (rig.can[0].bus.own_station(), rig.can[0].bus.station(0));
    for micros in (0..4_000).step_by(50) {
        let late = Effect::Delay(DurationNs::from_micros(micros));
        rig.can[0].bus.bus_mut().calm();
        rig.can[0].bus.bus_mut().disturb(Disturbance::all(late).from(device).to(own));
        let end = rig.now() + millis(40);
        while rig.now() < end {
            rig.step();
            let axis = &rig.engine.axes()[0];
            let age = axis.feedback().age_cycles;
            assert!(age <= 2, "a position of {age} cycles ago with TPDOs {micros} us late\n{}", rig.told());
            assert_eq!(axis.fault(), None, "{micros}: {}", rig.told());
        }
    }
    assert!(turntable_turns(&rig), "{}", rig.told());
}

#[test]
fn a_tpdo_of_another_length_is_not_taken_and_stops_its_axis() {
    let mut rig = in_motion(2.0);
    rig.can[0].tamper = Some(Box::new(|_, frame| {
        if frame.id() == TPDO {
            *frame = Frame::new(TPDO, &frame.data()[..3]).expect("a frame");
        }
        true
    }));
    BUS.stops_within(&mut rig, 300);
    told(&rig, "CAN bus 1: TPDO 1 of node 1: expected 7 bytes, got 3; it is ignored");
    silent(&rig);
    rig.can[0].tamper = None;
    BUS.runs_again(&mut rig);
}

#[test]
fn frames_that_nobody_has_asked_for_change_nothing() {
    let mut rig = in_motion(1.0);
    let other = intruder(&mut rig);
    let refused = rig.status().counters.refused_frames;
    let strange = [
        (Id::Standard(0x1A5), vec![0xFF; 8]),
        (Id::Standard(0x5A5), vec![0x43, 0, 0x10, 0, 0, 0, 0, 0]),
        (Id::Standard(0x7E4), vec![0x44; 8]),
        (Id::Standard(0x100), vec![1, 2, 3]),
        (Id::Standard(0x6A5), vec![0x40, 0, 0x10, 0, 0, 0, 0, 0]),
        (Id::Extended(0x181), vec![0; 8]),
        (Id::Standard(0x7A5), vec![]),
    ];
    for (id, data) in &strange {
        send(&mut rig, other, *id, data);
        BUS.go_for(&mut rig, 50);
        assert!(moving(&rig), "{id}: {}", rig.told());
    }
    told(&rig, "CAN bus 1: node 37 is on the bus and not in the configuration");
    assert_eq!(rig.status().counters.refused_frames - refused, strange.len() as u64);
    assert_eq!((codes(&rig, 0), codes(&rig, 1)), (vec![], vec![]));
    BUS.runs_again(&mut rig);
}

#[test]
fn somebody_else_who_commands_a_drive_stops_its_axis_and_is_told() {
    let mut rig = in_motion(2.0);
    let other = intruder(&mut rig);
    rig.can[0].bus.bus_mut().share(Id::Standard(0x201));
    // Disable voltage, for as long as it takes.
    for _ in 0..20 {
        // Two stations that begin the same frame at the same moment disturb each other on the bus: here the master's are over.
        rig.run_until(millis(10), "the middle of a cycle", |rig| {
            rig.cycle_sent_at().is_some_and(|at| rig.now() >= at + millis(1))
        });
        send(&mut rig, other, Id::Standard(0x201), &[0; 7]);
        BUS.go_for(&mut rig, 2);
    }
    BUS.stops_within(&mut rig, 1_000);
    told(&rig, "CAN bus 1: another station sends 201, which only the master may send");
    // Whoever takes away its operation takes away its power, as far as the drive tells.
    assert_eq!(codes(&rig, 0), [(FaultType::AXIS, 37)], "{}", rig.told());
    assert_eq!(rig.engine.axes()[0].fault().map(|fault| fault.cause), Some(FaultCause::POWER_LOSS));
    BUS.runs_again(&mut rig);
}

/// A box whose turntable does not come up; the slide runs, and the turntable after so many seconds.
fn without_turntable(seconds: f64, tamper: impl FnMut(&mut Frame) -> bool + 'static) -> Rig {
    let mut rig = Rig::new(settings());
    let mut tamper = tamper;
    rig.can[0].tamper = Some(Box::new(move |_, frame| tamper(frame)));
    rig.run_until(millis(20_000), "the bus up", |rig| rig.status().state == BoxState::READY);
    let late = vec![Step::Dwell { seconds }, Step::Enable(TURNTABLE), turn()];
    let program = vec![
        Step::Enable(AxisSet::one(2)),
        Step::Together(vec![far(seconds), Step::Sequence(late)]),
        Step::Disable(both()),
    ];
    let mut config = rig.controller_config();
    config.axes[0].control_mode = ControlMode::VELOCITY;
    config.late = TURNTABLE;
    rig.connect_with(config, program);
    rig.run_until(millis(10_000), "the slide in motion", slide_moves);
    assert_eq!(rig.engine.axes()[0].state(), DriveState::NotReady);
    rig
}

#[test]
fn a_drive_that_refuses_its_mapping_is_left_out_and_tried_again() {
    let mut rig = without_turntable(12.0, |frame| {
        // It takes no mapping, and does not tell which one it has.
        let mut abort = [0x80, 0x00, 0x16, 0x01, 0x41, 0, 0x04, 0x06];
        if frame.id() == SDO_ANSWER && frame.data()[..4] == [0x60, 0x00, 0x16, 0x01] {
            *frame = Frame::new(SDO_ANSWER, &abort).expect("a frame");
        }
        if frame.id() == SDO_ANSWER && frame.data()[..4] == [0x43, 0x00, 0x16, 0x01] {
            abort[4..].copy_from_slice(&0x0800_0022_u32.to_le_bytes());
            *frame = Frame::new(SDO_ANSWER, &abort).expect("a frame");
        }
        true
    });
    told(
        &rig,
        "CAN bus 1: node 1 does not come up: J: configuration download failed: map write 1600:01: refused with 06040041: \
         object cannot be mapped to a PDO",
    );
    BUS.go_for(&mut rig, 1_000);
    told(
        &rig,
        "axis 1: commissioning of node 1 failed: reading 1600:01: refused with 08000022: data cannot be transferred or stored: device \
         state; it is left out",
    );
    BUS.go_for(&mut rig, 1_000);
    assert_eq!(position(&rig, 0), 0);
    rig.can[0].tamper = None;
    BUS.runs_again(&mut rig);
}

#[test]
fn a_drive_that_answers_no_sdo_is_left_out_and_tried_again() {
    let mut rig = without_turntable(24.0, |frame| frame.id() != SDO_ANSWER);
    BUS.go_for(&mut rig, 11_000);
    told(&rig, "CAN bus 1: node 1 does not come up: B: no answer to device type");
    assert_eq!(position(&rig, 0), 0);
    rig.can[0].tamper = None;
    BUS.runs_again(&mut rig);
}

#[test]
fn a_drive_that_does_not_come_into_operation_is_a_fault_and_is_not_led() {
    let mut rig = Rig::ready(settings());
    // Its status word says Switched on for ever.
    rig.can[0].tamper = Some(Box::new(|_, frame| {
        if frame.id() == TPDO && frame.data()[0] & 0x6F == 0x27 {
            let mut data = frame.data().to_vec();
            data[0] &= !0x04;
            *frame = Frame::new(TPDO, &data).expect("a frame");
        }
        true
    }));
    let late = vec![
        Step::Ask { axes: TURNTABLE, request: AxisControl::ENABLE },
        Step::Dwell { seconds: 12.0 },
        Step::FaultReset(TURNTABLE),
        Step::Enable(TURNTABLE),
        turn(),
    ];
    let program = vec![
        Step::Enable(AxisSet::one(2)),
        Step::Together(vec![far(12.0), Step::Sequence(late)]),
        Step::Disable(both()),
    ];
    connect(&mut rig, program);
    rig.run_until(millis(10_000), "the slide in motion", slide_moves);
    BUS.go_for(&mut rig, 10_500);
    assert_eq!(codes(&rig, 0), [(FaultType::AXIS_MFG, 12)], "{}", rig.told());
    assert_eq!(rig.engine.axes()[0].fault().map(|fault| fault.cause), Some(FaultCause::START_TIME_OUT));
    told(&rig, "axis 1: Axis Fault - Mfg 12 (start_time_out) in Starting, fault action 0x23");
    assert!(velocity(&rig, 0).abs() < NANO / 100);
    rig.can[0].tamper = None;
    BUS.runs_again(&mut rig);
}
