//! Somebody is gone: the controller, its stream, the box, a drive.

use std::cell::RefCell;
use std::fmt::Write as _;
use std::rc::Rc;

use axisbridge::config::StoppingAction;
use axisbridge_tests::rig::motion::{
    NANO, SLIDE_END, arrival, at_rest, both, in_motion, long_moves, millis, moves,
};
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cip::controller::{AxisSet, Failure, Step};
use profile_cip::device::axis_state::AxisState;
use profile_cip::wire::class1::CLASS1_HEADER_LEN;
use profile_cip::wire::motion::codes::{AxisStateCode, FaultType, NodeFault};
use profile_cip::wire::motion::{ActualFrame, ActualPosition};
use profile_generic::fault::FaultCause;
use profile_generic::scaling::UnitKind;
use profile_generic::state::{DriveState, Report};
use profile_generic::time::{DurationNs, MonotonicTime};

/// A box whose axes stop like this when commands stay away.
fn stopping_by(action: StoppingAction) -> Settings {
    let line = format!("on_command_loss = \"{}\"\ninstance = ", action.name());
    Settings { configuration: BOX.replace("instance = ", &line), ..Settings::default() }
}

fn changes_since(rig: &Rig, drive: usize, start: MonotonicTime) -> Vec<(DurationNs, bool)> {
    let changes = rig.watched[drive].changes.iter().filter(|(at, _)| *at > start);
    changes.map(|(at, on)| (at.since(start), *on)).collect()
}

fn where_it_stands(rig: &Rig) -> [i64; 2] {
    [rig.position(0), rig.position(1)]
}

#[test]
fn a_controller_that_vanishes_leaves_axes_that_stop_as_configured_and_stay_stopped() {
    let mut table = String::from("action: torque off, at rest after; way of turntable and slide\n");
    for action in StoppingAction::ALL {
        let mut rig = in_motion(stopping_by(action));
        let (start, from) = (rig.now(), where_it_stands(&rig));
        rig.kill_controller();
        let rest = rig.run_until(millis(2_000), "rest", at_rest);
        rig.run_for(millis(200));
        let stands = where_it_stands(&rig);
        let off = changes_since(&rig, 0, start);
        assert_eq!(changes_since(&rig, 1, start), off, "both axes are treated alike");
        let holds =
            matches!(action, StoppingAction::CurrentDecelAndHold | StoppingAction::RampedDecelAndHold);
        if holds {
            assert_eq!(off, [], "{action:?} keeps the torque");
            assert_eq!(rig.drive(0).actual().report, Report::Halted);
        } else {
            let [(after, false)] = off[..] else { panic!("{action:?}: {off:?}") };
            assert!(after < millis(40), "{action:?}: drive-on fell after {after}");
            assert!(rig.torque_free(), "{action:?}");
        }
        // A coasting axis takes its time, one that is braked does not.
        let limit = if action == StoppingAction::DisableAndCoast { millis(1_000) } else { millis(300) };
        assert!(rest < limit, "{action:?}: rest after {rest}");
        let way = [0, 1].map(|place| stands[place] - from[place]);
        assert!(way.iter().all(|way| *way > 0), "no axis turned back: {way:?}");
        let off = off.first().map_or_else(|| "never".to_owned(), |(after, _)| after.to_string());
        writeln!(table, "{}: {off}, {rest}; {} nrev {} nmm", action.name(), way[0], way[1])
            .expect("a string takes everything");

        // Silence goes on: the standard's faults are there, and nothing moves, not even where torque holds
        // it.
        rig.run_for(millis(2_000));
        let moved = [0, 1].map(|place| (rig.position(place) - stands[place]).abs());
        assert!(moved[0] < NANO / 1_000 && moved[1] < NANO / 100, "{action:?}: {moved:?}");
        assert_eq!(rig.axis_states(0).last(), Some(&AxisState::MajorFaulted));
        assert_eq!(rig.axis_states(1).last(), Some(&AxisState::MajorFaulted));
        let device = rig.engine.devices()[0].device();
        assert_ne!(device.node_fault(), NodeFault::NONE);
        assert_eq!((device.connection(), device.counters().connection_losses), (None, 1));

        // A new connection alone moves nothing either; what held is let go.
        let stands = where_it_stands(&rig);
        let reconnected = rig.now();
        rig.connect(vec![Step::Dwell { seconds: 0.5 }]);
        let report = rig.run(millis(20_000));
        assert_eq!(report.failure, None, "{action:?}: {}", rig.log());
        let risen = |place| changes_since(&rig, place, reconnected).iter().any(|(_, on)| *on);
        assert!(!risen(0) && !risen(1) && rig.torque_free(), "{action:?}");
        let moved = [0, 1].map(|place| (rig.position(place) - stands[place]).abs());
        assert!(moved[0] < NANO / 100 && moved[1] < NANO / 10, "{action:?}: {moved:?}");

        // The controller enables and everything works as before.
        rig.connect(vec![Step::Enable(both()), moves(3.0, 40.0), Step::Disable(both())]);
        let report = rig.run(millis(20_000));
        assert_eq!((report.failure, report.steps_finished), (None, 3), "{action:?}: {}", rig.log());
    }
    insta::assert_snapshot!(table);
}

#[test]
fn a_gap_longer_than_the_limit_stops_the_axes_for_good() {
    let mut rig = in_motion(Settings::default());
    rig.tamper_command = Some(Box::new(|_| false));
    rig.run_until(millis(40), "the end of patience", |rig| {
        rig.engine.devices()[0].device().node_fault() == NodeFault::CONNECTION_UPDATE
    });
    rig.tamper_command = None;
    let device = rig.engine.devices()[0].device();
    assert!(device.connection().is_some(), "the connection itself bears 128 ms");
    let report = rig.run(millis(20_000));
    assert_eq!(
        report.node_fault,
        Some(NodeFault::CONNECTION_UPDATE),
        "it is told while the connection is there"
    );
    assert!(matches!(report.failure, Some(Failure::AxisNotRunning { .. })), "{:?}", report.failure);
    assert!(at_rest(&rig) && rig.torque_free());
    for (number, axis) in (0..).zip(rig.engine.axes()) {
        assert!(rig.axis_states(number).contains(&AxisState::MajorFaulted));
        assert_eq!(axis.counters().faults, 1);
    }
}

#[test]
fn a_gap_within_the_limit_is_bridged() {
    let mut rig = in_motion(Settings::default());
    rig.tamper_command = Some(Box::new(|_| false));
    rig.run_for(millis(12));
    rig.tamper_command = None;
    let report = rig.run(millis(20_000));
    assert_eq!((report.failure, report.device_lost_updates), (None, 3), "{}", rig.log());
}

#[test]
fn a_broken_stream_does_not_disturb_the_motion() {
    let mut rig = in_motion(Settings::default());
    rig.drop_stream();
    let report = rig.run(millis(20_000));
    assert_eq!(report.steps_finished, 4, "{}", rig.log());
    assert_eq!(report.failed_step, None);
    let Some(Failure::ExplicitTimeOut { .. }) = report.failure else { panic!("{:?}", report.failure) };
    assert!((rig.position(1) - 900 * NANO).abs() < NANO / 50, "it went to {SLIDE_END}");
    // The closing of the connection could not be told: it ends by its time-out, with the axes at rest.
    assert_eq!(rig.engine.devices()[0].device().counters().connection_losses, 1);
    rig.connect(long_moves());
    rig.run_until(millis(10_000), "a new start", |rig| rig.report().steps_finished == 1);
}

#[test]
fn a_slave_that_vanishes_faults_its_axis_and_only_its_axis() {
    let mut rig = in_motion(Settings::default());
    rig.line.cut(1);
    let found = rig.run_until(millis(100), "the fault", |rig| rig.engine.axes()[1].fault().is_some());
    // Five losses in a row are allowed, in cycles of 2 ms.
    assert!(found <= millis(14), "{found}");
    let fault = rig.engine.axes()[1].fault().expect("a fault");
    assert_eq!(fault.cause, FaultCause::SOUTH_SILENCE);
    assert_eq!(rig.engine.axes()[0].fault(), None);
    // The drive, which hears nothing more, stops by itself.
    rig.run_until(millis(500), "rest", |rig| rig.velocity(1).abs() < NANO);
    assert_eq!(rig.engine.axes()[0].state(), DriveState::Operating, "the other one is still led");
    rig.run_for(millis(500));
    let report = rig.report();
    let codes: Vec<_> = report.axes[1].faults.kept().iter().map(|one| (one.fault_type, one.code)).collect();
    // One cause, one record: south silence in the manufacturer's table.
    assert_eq!(codes, [(FaultType::AXIS_MFG, 17)]);
    assert_eq!(report.axes[0].faults.total, 0);
    let Some(Failure::AxisNotRunning { axis: 2, .. }) = report.failure else {
        panic!("{:?}", report.failure)
    };
    // The controller has stopped and disabled the axis that it still has.
    assert_eq!(report.axes[0].state, Some(AxisStateCode::STOPPED));
    assert!(rig.watched[0].changes.last().is_some_and(|(_, on)| !on));
}

#[test]
fn a_line_that_comes_back_as_a_whole_is_brought_up_again_and_needs_a_reset() {
    let mut rig = in_motion(Settings::default());
    rig.cable = false;
    let rest = rig.run_until(millis(1_000), "rest", at_rest);
    assert!(rest < millis(150), "the drives stop by themselves: {rest}");
    // They may have come to rest before the box has missed more than it is allowed to.
    rig.run_for(millis(14));
    for axis in rig.engine.axes() {
        assert_eq!(axis.fault().map(|fault| fault.cause), Some(FaultCause::SOUTH_SILENCE));
    }
    rig.kill_controller();
    rig.run_for(millis(500));
    rig.cable = true;
    rig.run_until(millis(20_000), "the bus", |rig| rig.status().phase == 4);
    rig.run_for(millis(500));
    assert!(rig.torque_free() && rig.watched.iter().all(|drive| !drive.on), "the bus alone starts nothing");
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
fn a_box_that_restarts_moves_nothing_until_it_is_asked_to() {
    let mut rig = in_motion(Settings::default());
    let start = rig.now();
    rig.restart_box();
    let rest = rig.run_until(millis(1_000), "rest", at_rest);
    assert!(rest < millis(150), "the drives stop by themselves: {rest}");
    // They may have come to rest before the box has missed more than it is allowed to.
    rig.run_for(millis(14));
    let stands = where_it_stands(&rig);
    let report = rig.run(millis(20_000));
    let Some(Failure::ConnectionTimedOut { .. }) = report.failure else { panic!("{:?}", report.failure) };
    rig.run_until(millis(20_000), "the bus", |rig| rig.status().phase == 4);
    rig.run_for(millis(1_000));
    let moved = [0, 1].map(|place| (rig.position(place) - stands[place]).abs());
    assert!(moved[0] < NANO / 1_000 && moved[1] < NANO / 100, "{moved:?}");
    for drive in 0..2 {
        assert!(!changes_since(&rig, drive, start).iter().any(|(_, on)| *on));
    }
    // What the controller of before still sends would be another connection's; a new one works.
    rig.connect(vec![Step::Enable(AxisSet::one(1)), Step::Disable(AxisSet::one(1))]);
    assert_eq!(rig.run(millis(20_000)).failure, None, "{}", rig.log());
}

#[test]
fn a_box_that_ends_leaves_drives_without_torque_and_a_silent_bus() {
    for action in [StoppingAction::RampedDecelAndDisable, StoppingAction::CurrentDecelAndHold] {
        let mut rig = in_motion(stopping_by(action));
        let now = rig.now();
        rig.engine.stop(now);
        assert!(!rig.engine.is_stopped());
        let took = rig.run_until(millis(2_000), "the end", |rig| rig.engine.is_stopped());
        assert!(took < millis(200), "{action:?}: {took}");
        assert!(at_rest(&rig) && rig.torque_free(), "{action:?}");
        assert_eq!(rig.sercos().master().phase(), None);
        assert_eq!(rig.watched.iter().map(|drive| drive.on).collect::<Vec<_>>(), [false, false]);
    }
}

#[test]
fn a_single_lost_drive_is_taken_back_once_nobody_uses_the_others() {
    let mut rig = in_motion(Settings::default());
    rig.line.cut(1);
    rig.run_until(millis(100), "the fault", |rig| rig.engine.axes()[1].fault().is_some());
    rig.line.mend(1);
    // The controller stops and disables the axis that it still has, and closes the connection.
    rig.run_until(millis(30_000), "the end of the connection", |rig| rig.status().connections == 0);
    assert_eq!(rig.status().phase, 4, "the bus stays up for the axis that is in use");
    let heard = |rig: &Rig| rig.engine.axes()[1].feedback().report != Report::Silent;
    assert!(!heard(&rig), "the drive does not come back by itself: it has left CP4");
    rig.run_until(millis(30_000), "the drive", |rig| rig.status().phase == 4 && heard(rig));
    rig.run_for(millis(500));
    // Taking the bus down was the box's own wish: the axis that was well is well.
    assert_eq!(rig.engine.axes()[0].fault(), None);
    assert!(rig.torque_free());
}

/// Age of the time stamp in ns and the position in counts of both axes, in an update of the box that is sent now.
fn stamped(bytes: &[u8], system: u64) -> Option<(u64, [i64; 2])> {
    let frame = ActualFrame::parse(bytes.get(CLASS1_HEADER_LEN..)?).ok()?;
    let stamp = frame.header().time_stamp?;
    let counts = |position| match position {
        ActualPosition::Dint(position) => i64::from(position),
        ActualPosition::Lint(position) => position,
    };
    let mut positions = frame.instances().filter_map(|one| one.cyclic?.actual.position).map(counts);
    Some((system - stamp, [positions.next()?, positions.next()?]))
}

#[test]
fn one_lost_drive_leaves_the_time_stamp_of_the_other_fresh_and_its_own_position_held() {
    for lost in 0..2 {
        let other = 1 - lost;
        // The last drive of the line is lost: that of either axis.
        let mut settings = Settings::default();
        if lost == 0 {
            settings.drives = vec![(1, UnitKind::Linear), (2, UnitKind::Rotary)];
            let swapped = BOX.replace("drive = \"drive-a\"", "drive = \"drive-?\"");
            let swapped = swapped.replace("drive = \"drive-b\"", "drive = \"drive-a\"");
            settings.configuration = swapped.replace("drive-?", "drive-b");
        }
        let mut rig = Rig::ready(settings);
        rig.connect(vec![Step::Enable(both()), moves(1.0, 40.0), arrival(), Step::Dwell { seconds: 30.0 }]);
        rig.run_until(millis(8_000), "both axes in place", |rig| rig.report().steps_finished == 3);
        let (clock, offset) = (rig.clock(), rig.system().0 - rig.now().0);
        let seen = Rc::new(RefCell::new(Vec::new()));
        let log = Rc::clone(&seen);
        rig.tamper_actual = Some(Box::new(move |datagram| {
            log.borrow_mut().extend(stamped(datagram.as_slice(), clock.get().0 + offset));
            true
        }));
        rig.run_for(millis(100));
        let before = seen.borrow().last().expect("updates").1;
        rig.line.cut(1);
        rig.run_until(millis(100), "the fault", |rig| rig.engine.axes()[lost].fault().is_some());
        seen.borrow_mut().clear();
        rig.run_for(millis(2_000));
        let seen = seen.borrow();
        assert!(seen.len() > 300, "axis {lost} lost: {} updates", seen.len());
        let oldest = seen.iter().map(|(age, _)| *age).max().expect("updates");
        // Captured in the cycle of 2 ms before the update.
        assert!(oldest <= 2_100_000, "axis {lost} lost: the time stamp is up to {oldest} ns old");
        for (_, positions) in seen.iter() {
            assert!((positions[lost] - before[lost]).abs() < 50, "held: {positions:?}, {before:?}");
            assert!((positions[other] - before[other]).abs() < 50, "at rest: {positions:?}, {before:?}");
        }
        // It has been silent for longer than its stop is waited for.
        assert_eq!(rig.report().axes[lost].state, Some(AxisStateCode::MAJOR_FAULTED));
    }
}
