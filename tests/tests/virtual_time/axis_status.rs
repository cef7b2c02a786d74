//! Bits of Axis Status that a fault of the drive and a shutdown leave as they are: DC Bus Up and Feedback Integrity (CIP Volume 9, Tables
//! 5-2.60 and 5-2.61).

use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::{NANO, millis};
use axisbridge_tests::rig::{CONTROLLER, Rig, Settings};
use profile_cia402::node::drive::Axis;
use profile_cip::controller::{AxisSet, Step};
use profile_cip::device::axis_state::AxisState;
use profile_cip::wire::motion::codes::{AxisControl, AxisStatus};
use profile_generic::fault::FaultCause;
use profile_generic::image::StatusBits;
use profile_generic::quantity::Position;

use super::stopping::request;

/// A turntable that is enabled and stands.
struct Turntable {
    rig: Rig,
    client: Client,
}

impl Turntable {
    fn enabled(settings: Settings) -> Self {
        let mut rig = Rig::ready(settings);
        rig.connect(vec![Step::Enable(AxisSet::one(1)), Step::Dwell { seconds: 1_000.0 }]);
        rig.run_until(millis(10_000), "the enable", |rig| rig.report().steps_finished == 1);
        let client = Client::connect(&mut rig, CONTROLLER);
        request(&mut rig, AxisControl::NONE);
        Self { rig, client }
    }

    fn state(&self) -> AxisState {
        self.rig.engine.devices()[0].axis_states().next().map_or(AxisState::Off, |(_, state)| state)
    }

    /// Goes on until the axis is in this state, and a while after it.
    #[track_caller]
    fn until(&mut self, state: AxisState) {
        let seen = |rig: &Rig| rig.engine.devices()[0].axis_states().next().map(|(_, state)| state);
        self.rig.run_until(millis(8_000), &state.to_string(), |rig| seen(rig) == Some(state));
        self.rig.run_for(millis(300));
        assert_eq!(self.state(), state);
    }

    /// Asks for something and goes on until the axis is in the state that it leads to.
    #[track_caller]
    fn ask(&mut self, control: AxisControl, state: AxisState) {
        for control in [AxisControl::NONE, control] {
            request(&mut self.rig, control);
            self.rig.run_for(millis(50));
        }
        self.until(state);
    }

    fn has(&mut self, bit: AxisStatus) -> bool {
        let (status, data) = self.client.ask(&mut self.rig, 0x0E, 1, Some(651), &[]);
        let word = data.iter().rev().fold(0_u32, |word, octet| word << 8 | u32::from(*octet));
        assert_eq!((status, data.len()), (0, 4));
        AxisStatus::from_bits_retain(word).contains(bit)
    }

    /// Switches the mains of its CANopen drive; its bus takes a while to follow.
    fn power(&mut self, on: bool) {
        self.can_axis().set_main_power(on);
        self.rig.run_for(millis(2_000));
    }

    fn can_axis(&mut self) -> &mut Axis {
        let node = self.rig.can[0].bus.nodes_mut().next().expect("the drive");
        &mut node.application_mut().axes_mut()[0]
    }
}

/// A CANopen turntable whose drive has this key.
fn canopen(key: &str) -> Turntable {
    let drive = "name = \"drive-a\"\nnode = 1\n";
    let configuration = include_str!("can.toml");
    assert!(configuration.contains(drive));
    Turntable::enabled(Settings::without_line(
        configuration.replace(drive, &format!("{drive}voltage_bit = \"{key}\"\n")),
    ))
}

#[test]
fn the_bus_of_a_drive_that_shows_it_is_up_in_faults_and_shutdowns_until_the_mains_are_gone() {
    let bus = AxisStatus::DC_BUS_UP;
    let mut axis = canopen("dc-link");
    assert!(axis.has(bus));
    axis.can_axis().servo_mut().raise_fault(FaultCause::OVER_CURRENT);
    axis.until(AxisState::MajorFaulted);
    assert!(axis.has(bus), "the fault has not discharged it");
    axis.power(false);
    assert_eq!((axis.state(), axis.has(bus)), (AxisState::MajorFaulted, false));
    axis.power(true);
    assert_eq!((axis.state(), axis.has(bus)), (AxisState::MajorFaulted, true));
    axis.can_axis().recover(FaultCause::OVER_CURRENT);
    axis.ask(AxisControl::FAULT_RESET, AxisState::Stopped);
    assert!(axis.has(bus));
    axis.ask(AxisControl::SHUTDOWN, AxisState::Shutdown);
    assert!(axis.has(bus));
    axis.power(false);
    assert_eq!((axis.state(), axis.has(bus)), (AxisState::Shutdown, false));
    axis.ask(AxisControl::SHUTDOWN_RESET, AxisState::PreCharge);
    assert!(!axis.has(bus));
}

/// Without bit 4 of the statusword a CANopen drive shows its supply by its states, as a SERCOS drive does by "Ready to operate": faulted or
/// disabled it shows nothing of it.
#[test]
fn the_bus_of_a_drive_that_does_not_show_it_stays_as_it_was_while_it_is_faulted_or_shut_down() {
    let bus = AxisStatus::DC_BUS_UP;
    let mut axis = canopen("ignore");
    axis.can_axis().servo_mut().raise_fault(FaultCause::OVER_CURRENT);
    axis.until(AxisState::MajorFaulted);
    assert!(axis.has(bus));
    axis.can_axis().recover(FaultCause::OVER_CURRENT);
    axis.ask(AxisControl::FAULT_RESET, AxisState::Stopped);
    axis.ask(AxisControl::SHUTDOWN, AxisState::Shutdown);
    assert!(axis.has(bus));

    let mut axis = Turntable::enabled(Settings::default());
    axis.rig.drive_mut(0).raise_fault(FaultCause::OVER_CURRENT);
    axis.until(AxisState::MajorFaulted);
    assert!(axis.has(bus));
    axis.rig.drive_mut(0).recover(FaultCause::OVER_CURRENT);
    axis.ask(AxisControl::FAULT_RESET, AxisState::Stopped);
    axis.ask(AxisControl::SHUTDOWN, AxisState::Shutdown);
    axis.rig.drive_mut(0).set_main_power(false);
    axis.rig.run_for(millis(2_000));
    assert_eq!((axis.state(), axis.has(bus)), (AxisState::Shutdown, true), "as it was");
    axis.ask(AxisControl::SHUTDOWN_RESET, AxisState::PreCharge);
    assert!(!axis.has(bus), "it waits for its supply");
}

#[test]
fn feedback_is_doubted_after_a_fault_of_the_feedback_alone_and_until_a_reset() {
    let integrity = AxisStatus::FEEDBACK_INTEGRITY;
    let mut axis = Turntable::enabled(Settings::default());
    assert!(axis.has(integrity));
    axis.rig.drive_mut(0).raise_fault(FaultCause::MOTOR_OVER_TEMPERATURE);
    axis.until(AxisState::MajorFaulted);
    assert!(axis.has(integrity), "the encoder counts on");
    axis.rig.drive_mut(0).recover(FaultCause::MOTOR_OVER_TEMPERATURE);
    axis.ask(AxisControl::FAULT_RESET, AxisState::Stopped);
    axis.rig.drive_mut(0).set_main_power(false);
    axis.until(AxisState::PreCharge);
    assert!(axis.has(integrity), "and without mains");
    axis.rig.drive_mut(0).set_main_power(true);
    axis.until(AxisState::Stopped);

    // A jump of the position is a loss of feedback data, which the gateway finds: the drive stays ready.
    let servo = axis.rig.drive_mut(0).servo_mut();
    let there = servo.position();
    servo.set_position(Position(there.get() + 200 * NANO));
    axis.until(AxisState::MajorFaulted);
    assert!(axis.rig.engine.axes()[0].feedback().status.contains(StatusBits::READY));
    assert!(!axis.has(integrity));
    axis.rig.run_for(millis(2_000));
    assert!(!axis.has(integrity), "not before a reset");
    axis.ask(AxisControl::FAULT_RESET, AxisState::Stopped);
    assert!(axis.has(integrity));
}
