//! What the controller sees of a fault of a drive: which cause, in which state of the axis, for how long, behind which bus.
//!
//! A drive that resets itself shows its error for as long as the row says, one telegram at the least, and can then be enabled again.
//! Whatever the time, the axis has to be faulted from the first telegram, and nothing but a reset may bring it back.

use std::fmt::Write as _;

use axisbridge_tests::rig::Rig;
use profile_cip::controller::{Controller, Step};
use profile_cip::target::axis_state::AxisState;
use profile_cip::wire::motion::codes::ControlMode;
use profile_generic::fault::FaultCause;
use profile_generic::quantity::Position;
use profile_generic::time::DurationNs;

use crate::chain::{Bus, Chain};
use crate::scenario::AXIS;

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

/// What goes wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Trouble {
    /// The drive finds a fault.
    Fault(FaultCause),
    /// Main power is gone.
    MainPower,
    /// The drive is not heard.
    Silence,
    /// Its torque is gone without a word.
    TorqueLost,
    /// Its position is another one from one value to the next.
    PositionJump,
}

impl Trouble {
    fn name(self) -> String {
        match self {
            Self::Fault(cause) => cause.to_string(),
            Self::MainPower => "main power off".to_owned(),
            Self::Silence => "silence".to_owned(),
            Self::TorqueLost => "torque lost".to_owned(),
            Self::PositionJump => "position jump".to_owned(),
        }
    }

    fn begin(self, rig: &mut Rig, bus: Bus) {
        match self {
            Self::Silence => silence(rig, bus, true),
            Self::MainPower => main_power(rig, bus, false),
            Self::Fault(cause) => servo(rig, bus).raise_fault(cause),
            Self::TorqueLost => servo(rig, bus).lose_torque(),
            Self::PositionJump => {
                let servo = servo(rig, bus);
                let there = servo.position();
                servo.set_position(Position(there.get() + 2_000_000_000));
            }
        }
    }

    fn end(self, rig: &mut Rig, bus: Bus) {
        match self {
            Self::Silence => silence(rig, bus, false),
            Self::MainPower => main_power(rig, bus, true),
            Self::Fault(cause) if bus == Bus::Canopen => can_axis(rig).recover(cause),
            Self::Fault(cause) => servo(rig, bus).recover(cause),
            Self::TorqueLost | Self::PositionJump => {}
        }
    }
}

fn main_power(rig: &mut Rig, bus: Bus, on: bool) {
    match bus {
        Bus::Sercos => rig.drive_mut(0).set_main_power(on),
        Bus::Canopen => can_axis(rig).set_main_power(on),
        Bus::Devicenet => devicenet(rig).set_main_power(on),
    }
}

fn can_axis(rig: &mut Rig) -> &mut profile_cia402::node::drive::Axis {
    let node = rig.can[0].bus.nodes_mut().next().expect("the drive");
    &mut node.application_mut().axes_mut()[0]
}

fn devicenet(rig: &mut Rig) -> &mut axisbridge::simulate::devicenet_drive::DevicenetNode {
    rig.devicenet[0].bus.nodes_mut().next().expect("the drive")
}

fn servo(rig: &mut Rig, bus: Bus) -> &mut profile_generic::servo::Servo {
    match bus {
        Bus::Sercos => rig.drive_mut(0).servo_mut(),
        Bus::Canopen => can_axis(rig).servo_mut(),
        Bus::Devicenet => devicenet(rig).servo_mut(),
    }
}

fn silence(rig: &mut Rig, bus: Bus, begins: bool) {
    let now = rig.now();
    match bus {
        Bus::Sercos => rig.cable = !begins,
        Bus::Canopen => rig.can[0].bus.connect(now, 0, !begins),
        Bus::Devicenet => rig.devicenet[0].bus.connect(now, 0, !begins),
    }
}

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
    let mut rig = chain.ready();
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
    let running = CAUSES.map(Trouble::Fault).into_iter().chain([Trouble::MainPower, Trouble::Silence]);
    let running = running.map(|trouble| (During::Running, trouble));
    let states = [During::Stopped, During::Starting, During::Stopping];
    let others = states.into_iter().flat_map(|during| TWO.map(|cause| (during, Trouble::Fault(cause))));
    for (during, trouble) in running.chain(others) {
        for duration in DURATIONS {
            writeln!(text, "{}", row(bus, during, trouble, duration)).expect("a string takes everything");
            rows += 1;
        }
    }
    for trouble in [Trouble::TorqueLost, Trouble::PositionJump] {
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
