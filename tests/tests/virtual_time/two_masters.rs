//! Another master on the wire of the box, before it starts and while its axes move.

use axisbridge::status::BoxState;
use axisbridge_tests::rig::motion::{NANO, at_rest, both, in_motion, millis, moves};
use axisbridge_tests::rig::{Rig, Settings};
use profile_cip::controller::{AxisSet, Limits, Step};
use profile_cip::devicenet::wire::{Identifier, MacId};
use profile_cip::wire::motion::codes::AxisControl;
use profile_generic::can::{Frame, Id};
use profile_generic::fault::FaultCause;
use profile_generic::state::DriveState;
use profile_generic::time::DurationNs;
use profile_sercos::master::foreign::LISTEN;
use profile_sercos::wire::header::{Channel, Header, Kind, Phase, PhaseField, TelegramType};

use super::stopping::request;

const CAN: &str = include_str!("can.toml");
const DEVICENET: &str = include_str!("devicenet.toml");

fn count(rig: &Rig, text: &str) -> usize {
    rig.told().lines().filter(|line| line.contains(text)).count()
}

/// The MST of another master.
fn mst(phase: Phase) -> [u8; 60] {
    let mut frame = [0; 60];
    let telegram = TelegramType::new(Channel::Primary, Kind::Mdt, 0);
    let header = Header { source: [2, 9, 9, 9, 9, 9], telegram, phase: PhaseField::new(false, 0, phase) };
    header.emit(&mut frame).expect("the header has room");
    frame
}

/// Another master sends in every millisecond for so long.
fn occupied(rig: &mut Rig, span: DurationNs) {
    let end = rig.now() + span;
    while rig.now() < end {
        rig.inject_frame(&mst(Phase::CP4));
        rig.run_for(millis(1));
    }
}

#[test]
fn a_box_on_an_occupied_wire_sends_nothing_and_starts_when_the_wire_is_silent() {
    let mut rig = Rig::new(Settings::default());
    occupied(&mut rig, millis(5_000));
    assert_eq!(rig.sercos().master().statistics().cycles, 0, "not a single telegram");
    let text = "another master sends on this wire: CP4 from 02:09:09:09:09:09, a cycle of about 1";
    assert_eq!(count(&rig, text), 1, "{}", rig.told());
    assert_eq!(rig.status().state, BoxState::PHASE_UP);
    assert!(rig.status().counters.refused_frames > 4_000, "they are counted");
    let silent = rig.now();
    rig.run_until(millis(20_000), "the bus", |rig| rig.status().state == BoxState::READY);
    assert!(rig.now() - silent > LISTEN);
}

#[test]
fn a_master_that_comes_while_axes_move_stops_them_and_gets_the_wire() {
    let mut rig = in_motion(Settings::default());
    let begin = rig.now();
    for _ in 0..3 {
        rig.inject_frame(&mst(Phase::CP0));
        rig.run_for(millis(2));
    }
    let axes = rig.engine.axes();
    assert!(axes.iter().all(|axis| axis.fault().map(|fault| fault.cause) == Some(FaultCause::SOUTH_SILENCE)));
    assert_eq!(rig.sercos().master().phase(), Some(Phase::CP4), "they are led to rest");
    while rig.sercos().master().phase().is_some() {
        assert!(rig.now() - begin < millis(2_000));
        occupied(&mut rig, millis(1));
    }
    assert!(rig.torque_free(), "{}", rig.told());
    assert_eq!(count(&rig, "another master sends on this wire"), 1, "{}", rig.told());
    let cycles = rig.sercos().master().statistics().cycles;
    occupied(&mut rig, millis(3_000));
    assert_eq!(count(&rig, "no SERCOS telegrams any more until the other master"), 1, "{}", rig.told());
    assert!(at_rest(&rig) && rig.torque_free());
    assert_eq!(rig.sercos().master().statistics().cycles, cycles, "the wire is the other one's");
    // It ends; the box comes back, and its axes after a reset.
    rig.kill_controller();
    rig.run_until(millis(30_000), "the bus", |rig| rig.status().phase == 4);
    rig.run_for(millis(500));
    assert!(rig.torque_free(), "nothing starts by itself");
    rig.connect(vec![
        Step::Dwell { seconds: 0.2 },
        Step::FaultReset(both()),
        Step::Enable(both()),
        moves(2.0, 30.0),
        Step::Disable(both()),
    ]);
    let report = rig.run(millis(60_000));
    assert_eq!((report.failure, report.steps_finished), (None, 5), "{}", rig.log());
}

#[test]
fn one_foreign_telegram_stops_nobody() {
    let mut rig = in_motion(Settings::default());
    rig.inject_frame(&mst(Phase::CP0));
    let report = rig.run(millis(30_000));
    assert_eq!(report.failure, None, "{}", rig.log());
    assert_eq!(count(&rig, "another master"), 0);
}

/// A box whose CAN bus is one that others can be on.
fn can_box() -> Settings {
    let configuration = CAN.replace("interface = \"in-process\"", "interface = \"can0\"");
    Settings { configuration, drives: vec![], ..Settings::default() }
}

fn send(rig: &mut Rig, from: profile_generic::can::bus::Station, number: u16, data: &[u8]) {
    let now = rig.now();
    let frame = Frame::new(Id::Standard(number), data).expect("a frame");
    rig.can[0].bus.bus_mut().send(now, from, &frame).expect("the station has room");
}

#[test]
fn a_box_on_an_occupied_can_bus_sends_nothing_and_starts_when_the_bus_is_silent() {
    let mut rig = Rig::new(can_box());
    let other = rig.can[0].bus.bus_mut().add(64).expect("the bus has room for another station");
    for _ in 0..250 {
        send(&mut rig, other, 0x080, &[]);
        rig.run_for(millis(20));
    }
    let sync = rig.engine.buses().can().next().expect("a bus").master().statistics().syncs;
    assert_eq!(sync, 0);
    let text = "CAN bus 1: another master is on this bus: SYNC, identifier 080, a SYNC every 2";
    assert_eq!(count(&rig, text), 1, "{}", rig.told());
    assert_eq!(count(&rig, "is the expected device") + count(&rig, "does not come up"), 0, "{}", rig.told());
    rig.run_until(millis(20_000), "the bus", |rig| rig.status().state == BoxState::READY);
}

#[test]
fn somebody_who_sends_sync_beside_the_box_stops_its_axes_and_gets_the_bus() {
    let mut rig = Rig::ready(can_box());
    rig.connect(vec![Step::Enable(both()), Step::Dwell { seconds: 500.0 }]);
    rig.run_until(millis(10_000), "the enable", |rig| rig.report().steps_finished == 1);
    let other = rig.can[0].bus.bus_mut().add(64).expect("the bus has room for another station");
    rig.can[0].bus.bus_mut().share(Id::Standard(0x080));
    for _ in 0..300 {
        send(&mut rig, other, 0x080, &[]);
        rig.run_for(millis(7));
    }
    assert_eq!(count(&rig, "CAN bus 1: another master is on this bus: SYNC"), 1, "{}", rig.told());
    assert_eq!(count(&rig, "CAN bus 1: nothing is sent until the other master"), 1, "{}", rig.told());
    for axis in rig.engine.axes() {
        assert_eq!(axis.fault().map(|fault| fault.cause), Some(FaultCause::SOUTH_SILENCE), "{}", rig.told());
    }
    assert!(rig.torque_free());
    rig.kill_controller();
    rig.run_until(millis(30_000), "the bus", |rig| {
        rig.engine.axes().iter().all(|axis| axis.south().is_some())
    });
    rig.run_for(millis(500));
    rig.connect(vec![
        Step::Dwell { seconds: 0.2 },
        Step::FaultReset(both()),
        Step::Enable(both()),
        Step::Disable(both()),
    ]);
    let report = rig.run(millis(60_000));
    assert_eq!(report.failure, None, "{}\n{}", rig.log(), rig.told());
}

/// The slide goes a long way, and the turntable is not used.
fn slide_alone() -> Vec<Step> {
    let limits = Limits { velocity: 24.0, acceleration: 240.0, jerk: 4_800.0 };
    vec![Step::Enable(AxisSet::one(2)), Step::MoveAbsolute { axis: 2, position: 500.0, limits }]
}

/// The turntable is enabled while the slide still comes to rest for another master. It is stopped at once.
#[track_caller]
fn enabled_while_the_slide_stops(rig: &mut Rig) {
    request(rig, AxisControl::ENABLE);
    let mut enabled = None;
    while rig.engine.axes()[1].may_have_torque() {
        rig.step();
        if rig.engine.axes()[0].state().is_running() {
            let enabled = *enabled.get_or_insert(rig.now());
            assert!(rig.now() - enabled < millis(10), "{:?}\n{}", rig.states(0), rig.told());
        }
    }
    assert!(enabled.is_some(), "the slide has stopped too early: {}", rig.told());
    rig.run_for(millis(100));
    assert_eq!(rig.engine.axes()[0].fault().map(|fault| fault.cause), Some(FaultCause::SOUTH_SILENCE));
    assert!(rig.torque_free());
}

#[test]
fn an_axis_that_is_enabled_beside_another_master_is_stopped_at_once() {
    let mut rig = Rig::ready(can_box());
    rig.connect(slide_alone());
    rig.run_until(millis(10_000), "the slide in motion", |rig| {
        let slide = rig.can[0].bus.nodes().nth(1).expect("a device");
        slide.application().axes()[0].actual().velocity.get() > 47 * NANO / 10
    });
    let other = rig.can[0].bus.bus_mut().add(64).expect("the bus has room for another station");
    rig.can[0].bus.bus_mut().share(Id::Standard(0x080));
    rig.motion_checker.tolerate("a drive takes one set-point at two SYNCs", |_| true);
    let begin = rig.now();
    while rig.engine.axes()[1].state() != DriveState::FaultReaction {
        assert!(rig.now() - begin < millis(100), "{}", rig.told());
        send(&mut rig, other, 0x080, &[]);
        rig.run_for(millis(7));
    }
    enabled_while_the_slide_stops(&mut rig);
    assert_eq!(count(&rig, "CAN bus 1: nothing is sent until the other master"), 1, "{}", rig.told());
}

#[test]
fn a_devicenet_drive_that_somebody_else_polls_is_stopped_and_left_to_him_while_the_other_goes_on() {
    let settings = Settings { configuration: DEVICENET.to_owned(), drives: vec![], ..Settings::default() };
    let mut rig = Rig::ready(settings);
    rig.connect(vec![Step::Enable(both()), Step::Dwell { seconds: 500.0 }]);
    rig.run_until(millis(10_000), "the enable", |rig| rig.report().steps_finished == 1);
    let other = rig.devicenet[0].bus.bus_mut().add(64).expect("the bus has room for another station");
    let poll = Identifier::PollCommand(MacId::new(5).expect("a MAC ID")).can();
    rig.devicenet[0].bus.bus_mut().share(poll);
    for _ in 0..20 {
        let (now, frame) = (rig.now(), Frame::new(poll, &[]).expect("a frame"));
        rig.devicenet[0].bus.bus_mut().send(now, other, &frame).expect("the station has room");
        rig.run_for(millis(100));
    }
    let text = "DeviceNet 1: slave 5: another master polls it, whose MAC ID is not known";
    assert_eq!(count(&rig, text), 1, "{}", rig.told());
    let [polled, free] = rig.engine.axes() else { panic!("two axes") };
    assert_eq!(polled.fault().map(|fault| fault.cause), Some(FaultCause::SOUTH_SILENCE));
    assert!(polled.south().is_none() && !polled.may_have_torque());
    assert!(free.fault().is_none() && free.may_have_torque());
    assert_eq!(count(&rig, "DeviceNet 1: slave 5: another master has it"), 1);
}
