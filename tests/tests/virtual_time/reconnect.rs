//! A connection is closed, lost, opened anew: what becomes of an axis in motion, and of faults (CIP Volume 9, 5-2.6.2.3
//! and Table 5-2.97).

use std::fmt::Write as _;

use axisbridge::engine::notice::Notice;
use axisbridge_tests::rig::motion::{NANO, SLIDE, at_rest, both, long_moves, millis, moves};
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cip::controller::{AttributeSet, AxisSet, Step};
use profile_cip::device::axis_state::AxisState;
use profile_cip::device::fault_log::LogKind;
use profile_cip::device::visualization::Indication;
use profile_cip::wire::motion::codes::{ControlMode, FaultType, NodeFault};
use profile_generic::fault::FaultCause;
use profile_generic::state::Report;

const TURNTABLE_ONLY: AxisSet = AxisSet::one(1);
const SLIDE_ONLY: AxisSet = AxisSet::one(2);

/// Entries of an axis' fault log, oldest first: which fault, and what has ended it.
fn log(rig: &Rig, axis: usize) -> String {
    let log = rig.engine.devices()[0].fault_log(axis).expect("an axis");
    let fault = |kind: LogKind| match kind {
        LogKind::Fault(kind) => Some(kind),
        LogKind::Alarm(_) => None,
    };
    let mut entries: Vec<_> = log
        .entries()
        .filter_map(|entry| {
            let kind = fault(entry.kind)?;
            let end = entry.ended.map_or_else(|| "stands".to_owned(), |(by, _)| format!("ended by {by}"));
            Some(format!("{kind} {} {end}", entry.code))
        })
        .collect();
    entries.reverse();
    if entries.is_empty() { "nothing".to_owned() } else { entries.join(", ") }
}

/// What a person sees of an axis: display, lamp, generic state and fault as Modbus has them.
fn shown(rig: &Rig, axis: usize) -> String {
    let status = &rig.status().axes[axis];
    let fault = status.fault.map_or_else(|| "no fault".to_owned(), |cause| cause.to_string());
    format!("{}, {}, {}, {fault}", status.display(), status.indicators.axis, status.state)
}

/// Both axes turn or stand under torque when the controller sends a Forward_Close: the turntable runs at a speed.
fn closes_in_motion(action: Option<u8>) -> Rig {
    // What the box does about lost commands is not what the controller has asked for.
    let lost = "on_command_loss = \"disable-and-coast\"\ninstance = ";
    let configuration = BOX.replace("instance = ", lost);
    let mut rig = Rig::ready(Settings { configuration, ..Settings::default() });
    let mut config = rig.controller_config();
    config.axes[0].control_mode = ControlMode::VELOCITY;
    let set = |axis: u8| {
        let mut attributes = vec![AttributeSet::real(486, if axis == 1 { 20.0 } else { 1_000.0 })];
        attributes.extend(action.map(|action| AttributeSet::usint(610, action)));
        Step::SetAttributes { axis, attributes }
    };
    let run = Step::RunAt { axis: 1, velocity: 2.0, acceleration: 50.0, jerk: 1_000.0 };
    rig.connect_with(config, vec![set(1), set(2), Step::Enable(both()), run, Step::Reconnect]);
    rig.run_until(millis(8_000), "the Forward_Close", |rig| {
        rig.report().steps_finished == 4 && rig.status().connections == 0
    });
    // The controller does not come back by itself.
    rig.kill_controller();
    rig
}

#[test]
fn forward_close_stops_running_axes_by_their_stopping_action_and_is_no_fault() {
    let mut table = String::from(
        "Stopping Action: torque of turntable and slide off, at rest after; way of the turntable\n",
    );
    for action in [None, Some(0), Some(1), Some(2), Some(3), Some(4)] {
        let mut rig = closes_in_motion(action);
        let (start, from) = (rig.now(), rig.position(0));
        assert!(rig.velocity(0) > 19 * NANO / 10, "it turned when the connection was closed");
        let mut rest = None;
        let end = rig.now() + millis(3_000);
        rig.run_until(millis(3_100), "the end", |rig| {
            let device = rig.engine.devices()[0].device();
            assert_eq!(device.node_fault(), NodeFault::NONE, "{action:?}");
            for axis in 0..2 {
                assert_eq!(device.axis_state(axis), Some(AxisState::Initializing), "{action:?}");
                assert_eq!(rig.engine.axes()[axis].fault(), None, "{action:?}\n{}", rig.told());
            }
            if rest.is_none() && at_rest(rig) {
                rest = Some(rig.now().since(start));
            }
            rig.now() >= end
        });
        assert!(rig.torque_free(), "{action:?}: also after a stop that would hold the axis");
        let off = |place: usize| {
            let fell = rig.watched[place].changes.iter().find(|(at, on)| *at >= start && !on);
            fell.map_or_else(|| "never".to_owned(), |(at, _)| at.since(start).to_string())
        };
        let way = rig.position(0) - from;
        let rest = rest.expect("rest");
        writeln!(table, "{action:?}: {}, {}, {rest}; {way} nrev", off(0), off(1))
            .expect("a string takes everything");

        // Nothing was wrong, and nothing is said to have been.
        assert_eq!((log(&rig, 0).as_str(), log(&rig, 1).as_str()), ("nothing", "nothing"), "{action:?}");
        let wrong = |notice: &&Notice| matches!(notice, Notice::Node { .. } | Notice::Fault { .. });
        assert_eq!(rig.notices.iter().filter(wrong).count(), 0, "{}", rig.told());
        assert_eq!(shown(&rig, 0), "STANDBY, flashing green, ready, no fault");
        let network = rig.status().axes[0].indicators.network;
        assert_eq!(network, Indication::FLASHING_GREEN, "not the flashing red of a lost connection");

        // The next connection finds the axes as after a Disable.
        rig.connect(vec![Step::Enable(both()), moves(3.0, 40.0), Step::Disable(both())]);
        let report = rig.run(millis(30_000));
        assert_eq!((report.failure, report.steps_finished), (None, 3), "{action:?}: {}", rig.log());
        assert_eq!((report.axes[0].faults.total, report.axes[1].faults.total), (0, 0));
    }
    insta::assert_snapshot!(table);
}

#[test]
fn a_connection_lost_in_motion_is_a_node_fault_that_a_new_connection_clears() {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(long_moves());
    rig.run_until(millis(5_000), "motion", |rig| rig.velocity(0) > NANO);
    rig.kill_controller();
    rig.run_for(millis(1_000));
    let device = rig.engine.devices()[0].device();
    assert_eq!(device.axis_state(0), Some(AxisState::MajorFaulted));
    assert_ne!(device.node_fault(), NodeFault::NONE);
    let told = rig.notices.len();
    rig.connect(vec![Step::Dwell { seconds: 0.5 }]);
    rig.run_until(millis(5_000), "the dwell", |rig| rig.report().steps_finished == 1);
    let device = rig.engine.devices()[0].device();
    assert_eq!((device.axis_state(0), device.node_fault()), (Some(AxisState::Stopped), NodeFault::NONE));
    let faults = rig.notices[told..].iter().filter(|notice| matches!(notice, Notice::Fault { .. })).count();
    assert_eq!(faults, 0, "{}", rig.told());
}

/// What goes wrong with the slide, and whether it is still wrong afterwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Trouble {
    ControllerAborts,
    UpdatesMissing,
    DriveFaultOver,
    DriveFaultStands,
    BoxLimit,
    DriveLost,
}

impl Trouble {
    const ALL: [Self; 6] = [
        Self::ControllerAborts,
        Self::UpdatesMissing,
        Self::DriveFaultOver,
        Self::DriveFaultStands,
        Self::BoxLimit,
        Self::DriveLost,
    ];

    /// The slide is in motion, and then in this trouble; the controller is still connected.
    fn begin(self) -> Rig {
        let mut rig = Rig::ready(Settings::default());
        let to = if self == Self::BoxLimit { -20.0 } else { 900.0 };
        let mut program = vec![Step::Enable(both())];
        program.push(Step::Together(vec![
            Step::MoveAbsolute { axis: 2, position: to, limits: SLIDE },
            Step::Sequence(match self {
                Self::ControllerAborts => vec![Step::Dwell { seconds: 0.5 }, Step::Abort(SLIDE_ONLY)],
                _ => vec![],
            }),
        ]));
        rig.connect(program);
        rig.run_until(millis(5_000), "motion", |rig| rig.velocity(1).abs() > 10 * NANO);
        match self {
            Self::ControllerAborts | Self::BoxLimit => {}
            Self::UpdatesMissing => rig.tamper_command = Some(Box::new(|_| false)),
            Self::DriveFaultOver => rig.drive_mut(1).raise_fault(FaultCause::OVER_CURRENT),
            Self::DriveFaultStands => rig.drive_mut(1).raise_fault(FaultCause::OVER_VOLTAGE),
            Self::DriveLost => rig.line.cut(1),
        }
        rig.run_until(millis(3_000), "the fault", |rig| {
            let state = rig.engine.devices()[0].device().axis_state(1);
            matches!(state, Some(AxisState::Aborting | AxisState::MajorFaulted))
        });
        rig.tamper_command = None;
        rig
    }
}

/// State and faults of the slide as the device has them.
fn device(rig: &Rig) -> String {
    let device = rig.engine.devices()[0].device();
    let words = device.fault_words(1).expect("an axis");
    let mut faults = Vec::new();
    for kind in 1..=8 {
        let word = words.fault(FaultType(kind));
        faults.extend(
            (0..64).filter(|bit| word >> bit & 1 != 0).map(|bit| format!("{} {bit}", FaultType(kind))),
        );
    }
    let faults = if faults.is_empty() { "none".to_owned() } else { faults.join(", ") };
    format!("{}, faults {faults}, {}", device.axis_state(1).expect("an axis"), device.node_fault())
}

#[test]
fn a_new_connection_clears_what_is_over_and_raises_anew_what_stands() {
    let mut table = String::new();
    for trouble in Trouble::ALL {
        for closed in [true, false] {
            let mut rig = trouble.begin();
            let way = if closed { "Forward_Close" } else { "connection lost" };
            writeln!(table, "== {trouble:?}, {way}").expect("a string takes everything");
            if closed {
                // The controller stops what it still can, and closes in order.
                rig.run(millis(60_000));
            } else {
                rig.kill_controller();
            }
            if trouble == Trouble::DriveFaultOver {
                rig.drive_mut(1).clear_fault(FaultCause::OVER_CURRENT);
            }
            // Beyond all time limits of stops and resets.
            rig.run_for(millis(40_000));
            writeln!(table, "before: {} | {}", device(&rig), shown(&rig, 1))
                .expect("a string takes everything");
            assert!(rig.torque_free(), "{trouble:?}, {way}");
            let (stands, changes) = (rig.position(1), rig.watched[1].changes.len());

            rig.connect(vec![Step::Dwell { seconds: 1.0 }]);
            rig.run_until(millis(60_000), "the dwell, or the end of patience", |rig| {
                rig.report().steps_finished == 1 || rig.report().failure.is_some()
            });
            let failure = rig.report().failure.map_or_else(String::new, |failure| format!(" | {failure}"));
            writeln!(table, "opened: {} | {}{failure}", device(&rig), shown(&rig, 1))
                .expect("a string takes everything");
            let records = rig.report().axes[1].faults.kept().to_vec();
            let records: Vec<_> =
                records.iter().map(|one| format!("{} {}", one.fault_type, one.code)).collect();
            writeln!(table, "records: {}", records.join(", ")).expect("a string takes everything");
            rig.run(millis(60_000));
            writeln!(table, "log: {}\n", log(&rig, 1)).expect("a string takes everything");

            // Neither a reset nor a connection moves anything.
            assert!((rig.position(1) - stands).abs() < NANO / 100, "{trouble:?}, {way}");
            assert_eq!(rig.watched[1].changes.len(), changes, "{trouble:?}, {way}: no torque");
            // What does not concern the turntable leaves it well.
            let turntable = &rig.report().axes[0].faults;
            assert_eq!(turntable.kept().iter().filter(|one| one.fault_type != FaultType::CLEARED).count(), 0);
        }
    }
    insta::assert_snapshot!(table);
}

#[test]
fn after_a_reconnection_the_axis_moves_without_a_fault_reset() {
    for trouble in
        [Trouble::ControllerAborts, Trouble::UpdatesMissing, Trouble::DriveFaultOver, Trouble::BoxLimit]
    {
        let mut rig = trouble.begin();
        rig.run(millis(60_000));
        if trouble == Trouble::DriveFaultOver {
            assert_eq!(rig.drive(1).actual().report, Report::Faulted, "latched in the drive");
            rig.drive_mut(1).clear_fault(FaultCause::OVER_CURRENT);
        }
        let home = Step::MoveAbsolute { axis: 2, position: 100.0, limits: SLIDE };
        rig.connect(vec![Step::Enable(both()), home, Step::Disable(both())]);
        let report = rig.run(millis(30_000));
        // The way back from beyond the box's limit is another matter.
        let expected = if trouble == Trouble::BoxLimit { report.steps_finished } else { 3 };
        assert_eq!(report.steps_finished, expected, "{trouble:?}: {report}\n{}", rig.log());
        assert!(report.steps_finished >= 1, "{trouble:?}: enabled without a reset: {report}");
    }
}

#[test]
fn a_drive_that_trips_without_a_connection_is_shown_as_faulted() {
    let mut rig = Rig::ready(Settings::default());
    rig.run_for(millis(100));
    assert_eq!(shown(&rig, 1), "STANDBY, flashing green, inhibited, no fault");
    rig.drive_mut(1).raise_fault(FaultCause::OVER_CURRENT);
    rig.run_for(millis(500));
    assert_eq!(shown(&rig, 1), "X2:FLT S10, off, faulted, over_current");
    assert_eq!(shown(&rig, 0), "STANDBY, flashing green, inhibited, no fault");
    rig.drive_mut(1).clear_fault(FaultCause::OVER_CURRENT);
    rig.connect(vec![Step::Enable(TURNTABLE_ONLY), Step::Enable(SLIDE_ONLY), Step::Disable(both())]);
    let report = rig.run(millis(30_000));
    assert_eq!((report.failure, report.steps_finished), (None, 3), "{}", rig.log());
    assert_eq!(shown(&rig, 1), "STANDBY, flashing green, ready, no fault");
}
