//! What the controller sees of a fault of a drive: which cause, in which state of the axis, for how long, behind which bus.
//!
//! A drive that resets itself shows its error for as long as the row says, one telegram at the least, and can then be enabled again.
//! Whatever the time, the axis has to be faulted from the first telegram, and nothing but a reset may bring it back.

use std::fmt::Write as _;

use axisbridge_tests::rig::Rig;
use profile_cip::controller::{Controller, Step};
use profile_cip::device::axis_state::AxisState;
use profile_cip::wire::motion::codes::ControlMode;
use profile_generic::fault::FaultCause;
use profile_generic::time::DurationNs;

use crate::chain::{Bus, Chain};
use crate::scenario::AXIS;
use crate::trouble::Trouble;

/// One cause for each bit of the class 1 diagnostics of SERCOS, and so for each class of the error codes of CiA 402 that a drive
/// of this kind has; the enable input stands for a torque that is taken away by the safety.
const CAUSES: [FaultCause; 16] = [
    FaultCause::MOTOR_OVERLOAD,
    FaultCause::DRIVE_OVER_TEMPERATURE,
    FaultCause::MOTOR_OVER_TEMPERATURE,
    FaultCause::COOLING,
    FaultCause::CONTROL_VOLTAGE,
    FaultCause::FEEDBACK_LOSS,
    FaultCause::COMMUTATION,
    FaultCause::OVER_CURRENT,
    FaultCause::OVER_VOLTAGE,
    FaultCause::UNDER_VOLTAGE,
    FaultCause::MAINS_PHASE_LOSS,
    FaultCause::EXCESSIVE_POSITION_ERROR,
    FaultCause::ILLEGAL_MODE,
    FaultCause::HARDWARE_OVERTRAVEL_POSITIVE,
    FaultCause::EXTERNAL_INPUT,
    FaultCause::ENABLE_INPUT_LOST,
];

/// Causes of the rows in other states than Running: one after which the drive coasts, and one after which it brakes.
const TWO: [FaultCause; 2] = [FaultCause::OVER_CURRENT, FaultCause::EXTERNAL_INPUT];

/// How long it is there; `None` for good.
const DURATIONS: [Option<i64>; 5] = [Some(0), Some(20), Some(200), Some(1_000), None];

/// How long a row is looked at before the reset.
const LOOK: f64 = 3.0;

/// The axis when the trouble begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum During {
    Stopped,
    Starting,
    Running,
    Stopping,
}

impl During {
    fn program(self) -> Vec<Step> {
        let turn = Step::RunAt { axis: 1, velocity: 2.0, acceleration: 20.0, jerk: 400.0 };
        let look = Step::Dwell { seconds: LOOK };
        let mut program = match self {
            Self::Stopped => vec![look],
            Self::Starting => vec![Step::Enable(AXIS), look],
            Self::Running => vec![Step::Enable(AXIS), turn, look],
            Self::Stopping => vec![Step::Enable(AXIS), turn, Step::Disable(AXIS), look],
        };
        let again =
            [Step::FaultReset(AXIS), Step::Enable(AXIS), Step::Dwell { seconds: 0.1 }, Step::Disable(AXIS)];
        program.extend(again);
        program
    }

    /// Whether the moment has come.
    fn is_there(self, rig: &Rig) -> bool {
        let state = rig.engine.devices()[0].device().axis_state(0);
        match self {
            Self::Stopped => state == Some(AxisState::Stopped),
            Self::Starting => state == Some(AxisState::Starting),
            Self::Running => rig.report().steps_finished == 2,
            Self::Stopping => state == Some(AxisState::Stopping),
        }
    }
}

/// A row: what the controller saw, and when.
fn row(bus: Bus, during: During, trouble: Trouble, duration: Option<i64>) -> String {
    let chain = Chain { bus, synchronous: true };
    let limits = if trouble == Trouble::PositionJumpWithLimit { "velocity = 10.0\n" } else { "" };
    let mut rig = chain.ready_with(limits);
    let mut config = chain.controller(&rig);
    config.axes[0].control_mode = ControlMode::VELOCITY;
    rig.connect_with(config, during.program());
    rig.run_until(DurationNs::from_millis(10_000), "the moment", |rig| during.is_there(rig));
    let (begin, before, told) = (rig.now(), rig.axis_states(0).len(), rig.report().axes[0].faults.total);
    trouble.begin(&mut rig, bus);
    let cycle = chain.cycle();
    let end = duration.map(|ms| begin + cycle.max(DurationNs::from_millis(ms)));
    let mut noticed = None;
    let mut over = false;
    let closed = |rig: &Rig| rig.controller.as_ref().is_none_or(Controller::is_closed);
    let limit = begin + DurationNs::from_millis(20_000);
    while !closed(&rig) && rig.now() < limit {
        rig.step();
        if !over && end.is_some_and(|end| rig.now() >= end) {
            over = true;
            trouble.end(&mut rig, bus);
        }
        if noticed.is_none() && rig.report().axes[0].faults.total > told {
            noticed = Some(rig.now().since(begin));
        }
    }
    let states: Vec<_> = rig.axis_states(0)[before..].iter().map(ToString::to_string).collect();
    let faults: Vec<_> = rig.report().axes[0]
        .faults
        .kept()
        .iter()
        .map(|fault| format!("{} {}", short(&fault.fault_type.to_string()), fault.code))
        .collect();
    let seen = noticed.map_or("never".to_owned(), |after| format!("{}", after.as_nanos() / cycle.as_nanos()));
    let outcome = match rig.report().failure {
        None if closed(&rig) => "runs again".to_owned(),
        None => "still under way".to_owned(),
        Some(failure) => failure.to_string(),
    };
    let duration = duration.map_or("for good".to_owned(), |ms| match ms {
        0 => "1 telegram".to_owned(),
        ms => format!("{ms} ms"),
    });
    let during = format!("{during:?}");
    format!(
        "{during:<9} {:<29} {duration:<10} {seen:>5}  {}\n{:>57}{}; {outcome}",
        trouble.name(),
        states.join(" > "),
        "",
        if faults.is_empty() { "no fault".to_owned() } else { faults.join(", ") },
    )
}

/// Fault types as the display has them.
fn short(fault_type: &str) -> String {
    fault_type
        .replace("Axis Fault - Mfg", "M")
        .replace("Axis Fault", "S")
        .replace("Faults Cleared", "cleared by")
}

fn table(bus: Bus) -> String {
    let mut text =
        String::from("during    trouble                       for        cycle  states of the axis\n");
    let mut rows = 0;
    let running = CAUSES.map(Trouble::Fault).into_iter().chain([
        Trouble::MainPower,
        Trouble::Silence,
        Trouble::StaleData,
    ]);
    let running = running.map(|trouble| (During::Running, trouble));
    let states = [During::Stopped, During::Starting, During::Stopping];
    let others = states.into_iter().flat_map(|during| TWO.map(|cause| (during, Trouble::Fault(cause))));
    for (during, trouble) in running.chain(others) {
        for duration in DURATIONS {
            writeln!(text, "{}", row(bus, during, trouble, duration)).expect("a string takes everything");
            rows += 1;
        }
    }
    for trouble in [Trouble::TorqueLost, Trouble::PositionJump, Trouble::PositionJumpWithLimit] {
        writeln!(text, "{}", row(bus, During::Running, trouble, None)).expect("a string takes everything");
        rows += 1;
    }
    println!("rows: {rows}");
    text
}

#[test]
fn sercos() {
    insta::assert_snapshot!(table(Bus::Sercos));
}

#[test]
fn canopen() {
    insta::assert_snapshot!(table(Bus::Canopen));
}

#[test]
fn devicenet_drives() {
    insta::assert_snapshot!(table(Bus::Devicenet));
}

/// The log has what was measured: a jump of two turns where 10 turns a second are possible.
#[test]
fn a_position_jump_says_how_far_the_axis_went_and_how_far_it_could() {
    let chain = Chain { bus: Bus::Sercos, synchronous: true };
    let mut rig = chain.ready_with("velocity = 10.0\n");
    let mut config = chain.controller(&rig);
    // In position control the drive would find a following error in the same cycle.
    config.axes[0].control_mode = ControlMode::VELOCITY;
    rig.connect_with(config, vec![Step::Enable(AXIS), Step::Dwell { seconds: 5.0 }]);
    rig.run_until(DurationNs::from_millis(5_000), "Running", |rig| rig.report().steps_finished == 1);
    rig.run_for(DurationNs::from_millis(200));
    assert_eq!(rig.engine.axes()[0].fault(), None);
    Trouble::PositionJumpWithLimit.begin(&mut rig, Bus::Sercos);
    rig.run_for(DurationNs::from_millis(20));
    let fault = rig.engine.axes()[0].fault().expect("a fault");
    assert_eq!(fault.cause, FaultCause::FEEDBACK_DATA_LOSS);
    let line = "the actual position changed by 2.000 u in 2 ms, possible are 0.050 u";
    assert_eq!(rig.told().lines().filter(|told| told.ends_with(line)).count(), 1, "{}", rig.told());
}
