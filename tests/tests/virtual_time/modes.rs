//! Operating modes that CIP Motion has no word for, led in the generic model: targets that the drive goes to by itself, and
//! homing by the drive and by the controller. Engine, mapping tables, master and simulated drive are those of the box.

use axisbridge::engine::axis::Limits;
use axisbridge_tests::rig::generic::GenericRig;
use profile_generic::capture::CaptureWindow;
use profile_generic::fault::FaultCause;
use profile_generic::image::{CommandSet, StatusBits};
use profile_generic::mode::{ModeSelection, OperatingMode};
use profile_generic::quantity::{Acceleration, Position, Velocity};
use profile_generic::state::{DriveState, Request};
use profile_generic::time::DurationNs;
use profile_sercos::wire::idn::Idn;

const NANO: i64 = 1_000_000_000;
const POSITION: ModeSelection = ModeSelection { mode: OperatingMode::Position, interpolation: CONTROLLER };
const CONTROLLER: profile_generic::mode::InterpolationSource =
    profile_generic::mode::InterpolationSource::Controller;
const TARGET: ModeSelection = ModeSelection::by_drive(OperatingMode::Position);
const BY_DRIVE: ModeSelection = ModeSelection::by_drive(OperatingMode::Homing);
const BY_CONTROLLER: ModeSelection = ModeSelection { mode: OperatingMode::Homing, interpolation: CONTROLLER };

/// With a limit that no test reaches, a position that changes all at once is a jump, unless homing has given it.
fn with_velocity_limit() -> Limits {
    Limits { velocity: Some(Velocity(40 * NANO)), ..Limits::default() }
}

/// A ready axis with every mode, and a home switch from 1.3 to 1.6 turns; each turn has a marker at its start.
fn ready() -> GenericRig {
    let others = [OperatingMode::Velocity, OperatingMode::Torque].map(ModeSelection::from);
    let modes = [POSITION, TARGET, BY_DRIVE, BY_CONTROLLER].into_iter().chain(others);
    let mut rig = GenericRig::ready(modes, with_velocity_limit(), |_, _| ());
    let window = CaptureWindow { from: Position(1_300_000_000), to: Position(1_600_000_000) };
    rig.drive_mut().servo_mut().set_home_switch(Some(window));
    // The reference point is 0.05 turns behind the marker, and its position 10 turns, in 0.0001 degree.
    rig.set_number(Idn::REFERENCE_DISTANCE_1, 36_000_000);
    rig.set_number(Idn::REFERENCE_OFFSET_1, 180_000);
    // 60 revolutions a minute, and 5 turns per second squared in 0.001 rad/s2.
    rig.set_number(Idn::HOMING_VELOCITY, 600_000);
    rig.set_number(Idn::HOMING_ACCELERATION, 31_416);
    rig
}

fn go_to(rig: &mut GenericRig, turns: i64, velocity: i64) {
    rig.want(|command| {
        command.select(TARGET);
        command.target_position = Position(turns * NANO);
        command.profile_velocity = Velocity(velocity * NANO);
        command.profile_acceleration = Acceleration(20 * NANO);
        command.profile_deceleration = Acceleration(10 * NANO);
        command.present = CommandSet::TARGET_POSITION
            | CommandSet::PROFILE_VELOCITY
            | CommandSet::PROFILE_ACCELERATION
            | CommandSet::PROFILE_DECELERATION;
    });
}

fn status(rig: &GenericRig, bit: StatusBits) -> bool {
    rig.feedback().status.contains(bit)
}

#[test]
fn the_drive_goes_to_targets_by_itself() {
    let mut rig = ready();
    rig.enable();
    go_to(&mut rig, 3, 2);
    let mut fastest = 0;
    rig.run_until(5_000, "the target", |rig| {
        fastest = fastest.max(rig.speed());
        status(rig, StatusBits::TARGET_REACHED)
    });
    assert!((fastest - 2 * NANO).abs() < NANO / 25, "{fastest}");
    assert_eq!(rig.feedback().selection(), TARGET);
    rig.run_for(100);
    assert!((rig.position() - 3 * NANO).abs() < NANO / 1_000, "{}", rig.position());
    assert!(status(&rig, StatusBits::STANDSTILL) && status(&rig, StatusBits::TRACKING));
    // Another target on the way, and back.
    go_to(&mut rig, 50, 2);
    rig.run_for(500);
    assert!(!status(&rig, StatusBits::TARGET_REACHED) && rig.speed() > 19 * NANO / 10);
    go_to(&mut rig, -1, 5);
    rig.run_until(5_000, "the way back", |rig| status(rig, StatusBits::TARGET_REACHED));
    rig.run_for(100);
    assert!((rig.position() + NANO).abs() < NANO / 1_000, "{}", rig.position());
    assert_eq!(rig.axis().faults().count(), 0);
    // Deceleration 10 turns/s2 from 5 turns/s takes half a second.
    go_to(&mut rig, 50, 5);
    rig.run_for(1_500);
    rig.want(|command| command.profile_velocity = Velocity::ZERO);
    let stopped = rig.run_until(2_000, "rest", |rig| rig.speed().abs() < NANO / 100);
    assert!((450..650).contains(&(stopped.as_nanos() / 1_000_000)), "{stopped}");
}

/// Who makes the way changes on the move, with a drive that takes its time: the axis keeps its speed both ways.
#[test]
fn drive_and_controller_hand_the_axis_over_on_the_move() {
    let mut rig = ready();
    rig.drive_mut().set_mode_delay(DurationNs::from_millis(40));
    rig.enable();
    rig.lead(2 * NANO, POSITION);
    rig.run_for(800);
    assert!((rig.speed() - 2 * NANO).abs() < NANO / 50, "{}", rig.speed());
    let lowest = |rig: &mut GenericRig, selection| {
        let (mut low, mut high) = (i64::MAX, i64::MIN);
        rig.run_until(100, "the other mode", |rig| {
            (low, high) = (low.min(rig.speed()), high.max(rig.speed()));
            rig.feedback().selection() == selection
        });
        for _ in 0..100 {
            rig.step();
            (low, high) = (low.min(rig.speed()), high.max(rig.speed()));
        }
        (low, high)
    };
    rig.velocity = None;
    go_to(&mut rig, 100, 2);
    let (low, high) = lowest(&mut rig, TARGET);
    assert!(low > 18 * NANO / 10 && high < 22 * NANO / 10, "to the drive: {low} to {high}");
    rig.lead(2 * NANO, POSITION);
    let (low, high) = lowest(&mut rig, POSITION);
    assert!(low > 18 * NANO / 10 && high < 22 * NANO / 10, "to the controller: {low} to {high}");
    assert_eq!((rig.state(), rig.axis().faults().count()), (DriveState::Operating, 0));
}

#[test]
fn what_is_half_understood_or_beyond_a_limit_is_not_followed() {
    let limits = Limits {
        position_max: Some(Position(5 * NANO)),
        velocity: Some(Velocity(3 * NANO)),
        ..Limits::default()
    };
    let modes = [POSITION, TARGET];
    for (name, turns, velocity, without, expected) in [
        ("beyond the end", 6, 1, CommandSet::empty(), FaultCause::POSITION_COMMAND_LIMIT),
        ("too fast", 4, 4, CommandSet::empty(), FaultCause::VELOCITY_COMMAND_LIMIT),
        ("backward speed", 4, -1, CommandSet::empty(), FaultCause::VELOCITY_COMMAND_LIMIT),
        ("no target", 4, 1, CommandSet::TARGET_POSITION, FaultCause::POSITION_COMMAND_LIMIT),
        ("no acceleration", 4, 1, CommandSet::PROFILE_ACCELERATION, FaultCause::POSITION_COMMAND_LIMIT),
    ] {
        let mut rig = GenericRig::ready(modes, limits, |_, _| ());
        rig.enable();
        go_to(&mut rig, turns, velocity);
        rig.command.present.remove(without);
        rig.run_for(300);
        assert_eq!(rig.axis().fault().map(|fault| fault.cause), Some(expected), "{name}");
        assert!(rig.position().abs() < NANO / 1_000, "{name}: moved to {}", rig.position());
    }
    // Without a deceleration the drive takes the acceleration.
    let mut rig = GenericRig::ready(modes, limits, |_, _| ());
    rig.enable();
    go_to(&mut rig, 4, 3);
    rig.command.present.remove(CommandSet::PROFILE_DECELERATION);
    rig.run_until(5_000, "the target", |rig| status(rig, StatusBits::TARGET_REACHED));
    // A mode that the drive was not set up for.
    rig.want(|command| command.select(BY_DRIVE));
    rig.run_for(300);
    assert_eq!(rig.axis().fault().map(|fault| fault.cause), Some(FaultCause::ILLEGAL_MODE));
}

#[test]
fn the_drive_homes_by_itself_and_follows_again_without_a_jump() {
    let mut rig = ready();
    rig.enable();
    rig.want(|command| command.select(BY_DRIVE));
    rig.run_until(500, "the start", |rig| rig.speed() > NANO / 10);
    assert_eq!(rig.feedback().selection(), BY_DRIVE);
    assert!(!status(&rig, StatusBits::HOMED) && !status(&rig, StatusBits::TRACKING));
    let mut states = Vec::new();
    rig.run_until(10_000, "the end of homing", |rig| {
        states.push(rig.state());
        status(rig, StatusBits::HOMED)
    });
    assert!(states.iter().all(|state| *state == DriveState::Operating), "it was in operation all the time");
    assert!(status(&rig, StatusBits::REFERENCED) && status(&rig, StatusBits::TRACKING));
    // It has stopped behind the marker at 2 turns, which is 0.05 turns before 10 turns now.
    let here = rig.position();
    assert!(here > 995 * NANO / 100 && here < 11 * NANO, "{here}");
    assert!((rig.feedback().position.get() - here).abs() < NANO / 1_000, "{:?}", rig.feedback().position);
    rig.run_for(200);
    assert!((rig.position() - here).abs() < NANO / 200, "a jump from {here} to {}", rig.position());
    rig.lead(NANO, POSITION);
    rig.run_for(1_000);
    rig.velocity = Some(0);
    rig.run_for(100);
    let way = rig.position() - here;
    assert!((9 * NANO / 10..11 * NANO / 10).contains(&way), "led again: {way}");
    assert!(status(&rig, StatusBits::HOMED), "as long as nothing takes the reference away");
    assert_eq!(rig.axis().faults().count(), 0);
}

/// The same with a drive whose status word does not say whether it follows.
#[test]
fn a_drive_without_acknowledgement_homes_as_well() {
    let mut rig =
        GenericRig::ready([POSITION, BY_DRIVE], with_velocity_limit(), |needs, _| needs.silent = true);
    rig.drive_mut().set_silent(true);
    // Without a switch: the first marker.
    rig.set_number(Idn::HOMING_PARAMETER, 0b0010_0000);
    rig.set_number(Idn::REFERENCE_DISTANCE_1, -36_000_000);
    rig.enable();
    rig.run_for(50);
    rig.want(|command| command.select(BY_DRIVE));
    rig.run_until(10_000, "the end of homing", |rig| status(rig, StatusBits::HOMED));
    let here = rig.position();
    assert!(here > -11 * NANO && here < -9 * NANO, "{here}");
    rig.run_for(300);
    assert!((rig.position() - here).abs() < NANO / 200, "a jump from {here} to {}", rig.position());
    assert_eq!(rig.state(), DriveState::Operating);
}

#[test]
fn homing_that_is_no_longer_wanted_is_cancelled() {
    let mut rig = ready();
    rig.enable();
    rig.want(|command| command.select(BY_DRIVE));
    rig.run_until(500, "the speed", |rig| rig.speed() > NANO * 9 / 10);
    let here = rig.feedback().position;
    rig.want(|command| {
        command.select(POSITION);
        command.position = here;
        command.present = CommandSet::POSITION;
    });
    rig.velocity = Some(0);
    rig.run_until(1_000, "rest", |rig| rig.speed().abs() < NANO / 100 && status(rig, StatusBits::TRACKING));
    rig.run_for(300);
    assert!(!status(&rig, StatusBits::HOMED) && !status(&rig, StatusBits::HOMING_FAILED));
    assert_eq!((rig.feedback().selection(), rig.state()), (POSITION, DriveState::Operating));
    let set = |rig: &GenericRig| rig.number(Idn::DRIVE_CONTROLLED_HOMING);
    assert_eq!(set(&rig), 0, "the command was taken back");
    // It can be asked for again.
    rig.velocity = None;
    rig.want(|command| command.select(BY_DRIVE));
    rig.run_until(10_000, "the end of homing", |rig| status(rig, StatusBits::HOMED));
}

#[test]
fn homing_that_the_drive_refuses_has_failed_and_the_axis_stands() {
    let mut rig = ready();
    // Neither switch nor marker.
    rig.set_number(Idn::HOMING_PARAMETER, 0b0110_0000);
    rig.enable();
    rig.want(|command| command.select(BY_DRIVE));
    rig.run_until(500, "the refusal", |rig| status(rig, StatusBits::HOMING_FAILED));
    rig.run_for(200);
    assert!(!status(&rig, StatusBits::HOMED) && status(&rig, StatusBits::TRACKING));
    assert_eq!(rig.state(), DriveState::Operating);
    assert!(rig.position().abs() < NANO / 1_000);
    // Not tried again before it is asked for anew.
    rig.set_number(Idn::HOMING_PARAMETER, 0);
    rig.run_for(500);
    assert!(rig.speed().abs() < NANO / 100);
    rig.lead(0, POSITION);
    rig.run_for(50);
    assert!(!status(&rig, StatusBits::HOMING_FAILED));
    rig.velocity = None;
    rig.want(|command| command.select(BY_DRIVE));
    rig.run_until(10_000, "the end of homing", |rig| status(rig, StatusBits::HOMED));
}

#[test]
fn an_error_of_the_drive_ends_homing() {
    let mut rig = ready();
    rig.enable();
    rig.want(|command| command.select(BY_DRIVE));
    rig.run_until(500, "the speed", |rig| rig.speed() > NANO * 9 / 10);
    rig.drive_mut().raise_fault(FaultCause::OVER_CURRENT);
    rig.run_until(2_000, "the fault", |rig| rig.state() == DriveState::Faulted);
    assert!(status(&rig, StatusBits::HOMING_FAILED) || !status(&rig, StatusBits::HOMED));
    rig.run_for(500);
    assert_eq!(rig.number(Idn::DRIVE_CONTROLLED_HOMING), 0, "the command was taken back");
    rig.drive_mut().clear_fault(FaultCause::OVER_CURRENT);
    rig.want(|command| command.request = Some(Request::FaultReset));
    rig.run_until(3_000, "the reset", |rig| rig.state() == DriveState::Ready);
    // Enabled again it stands: the homing of before is over.
    rig.want(|command| {
        command.select(POSITION);
        command.request = Some(Request::Enable);
    });
    rig.run_until(5_000, "operation", |rig| rig.state() == DriveState::Operating);
    let here = rig.position();
    rig.run_for(500);
    assert!((rig.position() - here).abs() < NANO / 500, "{here} to {}", rig.position());
}

#[test]
fn a_stop_ends_homing_and_takes_the_torque() {
    let mut rig = ready();
    rig.enable();
    rig.want(|command| command.select(BY_DRIVE));
    rig.run_until(500, "the speed", |rig| rig.speed() > NANO * 9 / 10);
    rig.want(|command| command.request = Some(Request::Disable));
    rig.run_until(3_000, "the end of the torque", |rig| rig.state() == DriveState::Ready);
    assert!(rig.speed().abs() < NANO / 50, "{}", rig.speed());
    rig.run_for(300);
    assert_eq!(rig.number(Idn::DRIVE_CONTROLLED_HOMING), 0, "the command was taken back");
}

#[test]
fn without_its_north_side_a_homing_axis_stops() {
    let mut rig = ready();
    rig.enable();
    rig.want(|command| command.select(BY_DRIVE));
    rig.run_until(500, "the speed", |rig| rig.speed() > NANO * 9 / 10);
    let now = rig.now();
    let system = rig.engine.time().system_at(now);
    rig.engine.axes_mut()[0].lose_north(now, system);
    rig.run_until(3_000, "rest without torque", |rig| {
        rig.state() == DriveState::Faulted && rig.speed().abs() < NANO / 50
    });
    assert_eq!(rig.axis().fault().map(|fault| fault.cause), Some(FaultCause::COMMAND_LOST));
    rig.run_for(300);
    assert_eq!(rig.number(Idn::DRIVE_CONTROLLED_HOMING), 0, "the command was taken back");
}

/// The bus is cut in the middle of homing: nothing of it is left when it is back.
#[test]
fn a_lost_bus_ends_homing() {
    let mut rig = ready();
    rig.enable();
    rig.want(|command| command.select(BY_DRIVE));
    rig.run_until(500, "the speed", |rig| rig.speed() > NANO * 9 / 10);
    rig.cable = false;
    rig.run_until(1_000, "the loss", |rig| rig.state() != DriveState::Operating);
    rig.run_for(1_000);
    rig.cable = true;
    rig.want(|command| command.select(POSITION));
    rig.run_until(30_000, "the bus", |rig| rig.feedback().fresh);
    rig.run_for(1_000);
    rig.want(|command| command.request = Some(Request::FaultReset));
    rig.run_until(10_000, "the reset", |rig| rig.state() == DriveState::Ready);
    assert!(rig.feedback().status.intersection(StatusBits::HOMED | StatusBits::HOMING_FAILED).is_empty());
    rig.want(|command| command.request = Some(Request::Enable));
    rig.run_until(5_000, "operation", |rig| rig.state() == DriveState::Operating);
    let here = rig.position();
    rig.run_for(500);
    assert!((rig.position() - here).abs() < NANO / 500, "{here} to {}", rig.position());
}

/// The controller moves the axis over switch and marker, stops it, and the drive shifts its positions.
#[test]
fn the_controller_homes_with_the_drives_help() {
    let mut rig = ready();
    rig.enable();
    rig.lead(NANO / 2, BY_CONTROLLER);
    rig.run_until(10_000, "the marker", |rig| status(rig, StatusBits::HOME_FOUND));
    assert_eq!(rig.feedback().selection(), BY_CONTROLLER);
    assert_eq!(rig.number(Idn::REFERENCE_MARKER_PULSE_REGISTERED), 1);
    assert!((rig.speed() - NANO / 2).abs() < NANO / 20, "led by set-points: {}", rig.speed());
    let before = rig.position();
    rig.run_for(200);
    assert!(!status(&rig, StatusBits::HOMED) && rig.position() > before, "it waits until the axis stands");
    rig.velocity = Some(0);
    rig.run_until(2_000, "the end of homing", |rig| status(rig, StatusBits::HOMED));
    assert!(status(&rig, StatusBits::REFERENCED) && !status(&rig, StatusBits::HOME_FOUND));
    let here = rig.position();
    // Some way behind the marker, which is 0.05 turns before 10 turns.
    assert!(here > 10 * NANO && here < 11 * NANO, "{here}");
    assert!((rig.feedback().position.get() - here).abs() < NANO / 1_000);
    rig.run_for(200);
    assert!((rig.position() - here).abs() < NANO / 200, "a jump from {here} to {}", rig.position());
    for command in [
        Idn::CONTROL_UNIT_CONTROLLED_HOMING,
        Idn::CALCULATE_DISPLACEMENT,
        Idn::DISPLACEMENT_TO_THE_REFERENCED_SYSTEM,
    ] {
        assert_eq!(rig.number(command), 0, "{command} was taken back");
    }
    rig.lead(NANO, POSITION);
    rig.run_for(500);
    assert!((rig.speed() - NANO).abs() < NANO / 20, "led again: {}", rig.speed());
    assert_eq!(rig.axis().faults().count(), 0);
}

/// A drive that lacks a procedure, or an operation mode that an axis can do without, has the others.
#[test]
fn what_a_drive_lacks_it_is_not_asked_for() {
    let modes = [POSITION, TARGET, BY_DRIVE];
    let rig = GenericRig::ready(modes, Limits::default(), |_, line| {
        line.slaves_mut()[0].store_mut().remove(Idn::standard(258));
        line.slaves_mut()[0].store_mut().remove(Idn::DRIVE_CONTROLLED_HOMING);
    });
    let program = rig.axis().south().expect("a program");
    assert!(program.has_mode(POSITION) && !program.has_mode(TARGET) && !program.has_mode(BY_DRIVE));
}
