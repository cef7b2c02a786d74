//! Homing by the drive and by the master, against the switch and the markers of the simulated servo.

use profile_generic::capture::CaptureWindow;
use profile_generic::servo::ServoParameters;
use profile_generic::time::{DurationNs, MonotonicTime};

use super::super::Drive;
use super::*;
use crate::slave::application::{Application, Cycle, Order};
use crate::slave::phase::State;
use crate::wire::drive_words::{DriveControl, DriveStatus};
use crate::wire::header::Phase;
use crate::wire::idn::Idn;
use crate::wire::svc_error::SvcError;

/// Counts of 0.0001 degree in a turn, and nanoturns.
const TURN: i64 = 3_600_000;
const NANO: i64 = 1_000_000_000;

struct Rig {
    drive: Drive,
    store: Store,
}

impl Rig {
    /// A drive that follows its command value, which is where it stands.
    fn following() -> Self {
        let mut drive = Drive::new(ServoParameters::default()).expect("a drive");
        let mut store = Store::new();
        drive.define(&mut store);
        let mut rig = Self { drive, store };
        // Every turn has a marker at its start; the switch is closed from 1.3 to 1.6 turns.
        let window = CaptureWindow { from: Position(1_300_000_000), to: Position(1_600_000_000) };
        rig.drive.servo_mut().set_home_switch(Some(window));
        // Main power comes first.
        rig.run(1_000, |_| false);
        rig.control(DriveControl::ON | DriveControl::ENABLE | DriveControl::RESTART);
        assert!(rig.run(1_000, Rig::follows), "it follows");
        rig
    }

    fn control(&mut self, control: DriveControl) {
        self.store.set_number_of(Idn::DRIVE_CONTROL, i64::from(control.bits()));
    }

    fn status(&self) -> DriveStatus {
        let [low, high, ..] = self.store.number_of(Idn::DRIVE_STATUS).to_le_bytes();
        DriveStatus::from_bits_retain(u16::from_le_bytes([low, high]))
    }

    fn follows(&self) -> bool {
        self.status().contains(DriveStatus::FOLLOWS)
    }

    fn cycle(&mut self) {
        let cycle = Cycle {
            now: MonotonicTime(0),
            elapsed: DurationNs::from_millis(1),
            state: State::In(Phase::CP4),
            connected: true,
            fresh: true,
        };
        self.drive.cycle(cycle, &mut self.store);
    }

    /// So many cycles, or until `done`.
    fn run(&mut self, cycles: usize, done: impl Fn(&Self) -> bool) -> bool {
        (0..cycles).any(|_| {
            self.cycle();
            done(self)
        })
    }

    fn order(&mut self, idn: Idn, order: Order) -> Result<Progress, SvcError> {
        self.drive.order(idn, order, &mut self.store)
    }

    fn progress(&mut self) -> Progress {
        self.drive.progress(Idn::DRIVE_CONTROLLED_HOMING, &mut self.store)
    }

    fn homes(&mut self) -> Progress {
        for _ in 0..20_000 {
            self.cycle();
            assert!(!self.follows(), "command values count");
            if self.progress() != Progress::InProcess {
                break;
            }
        }
        self.progress()
    }

    fn actual(&self) -> i64 {
        self.store.number_of(Idn::POSITION_FEEDBACK_VALUE_1)
    }

    fn hold(&mut self) {
        let here = self.actual();
        self.store.set_number_of(Idn::POSITION_COMMAND, here);
    }
}

/// Each S-0-0147 that the drive knows, both ways and from both sides of the switch: where the reference point is, and
/// what position it has then.
#[test]
fn every_way_of_homing_ends_at_the_reference_point() {
    for (parameter, start, marker) in [
        (0b0000_0000, 0, 2 * NANO),
        (0b1000_0000, 0, 2 * NANO),
        (0b0010_0000, NANO / 4, NANO),
        (0b0100_0000, 0, 1_300_000_000),
        (0b0000_0001, 3 * NANO, NANO + 1_000_000),
        (0b1000_0001, 3 * NANO, NANO + 1_000_000),
        (0b1100_0000, 1_400_000_000, 1_300_000_000),
        (0b1000_0000, 1_400_000_000, 2 * NANO),
    ] {
        let mut rig = Rig::following();
        rig.control(DriveControl::empty());
        rig.run(50, |_| false);
        rig.drive.servo_mut().set_position(Position(start));
        rig.run(2, |_| false);
        rig.hold();
        rig.control(DriveControl::ON | DriveControl::ENABLE | DriveControl::RESTART);
        assert!(rig.run(200, Rig::follows), "{parameter:#b}");
        rig.store.set_number_of(Idn::HOMING_PARAMETER, parameter);
        rig.store.set_number_of(Idn::REFERENCE_DISTANCE_1, 36_000_000);
        rig.store.set_number_of(Idn::REFERENCE_OFFSET_1, 180_000);
        rig.drive.set_referenced(true);
        assert_eq!(rig.order(Idn::DRIVE_CONTROLLED_HOMING, Order::Start), Ok(Progress::InProcess));
        rig.cycle();
        assert!(!rig.status().contains(DriveStatus::REFERENCED), "{parameter:#b}: cleared at the start");
        // A command value that would lead far away does not count.
        rig.store.set_number_of(Idn::POSITION_COMMAND, -50 * TURN);
        assert_eq!(rig.homes(), Progress::Done, "{parameter:#b}");
        assert!(rig.run(2, |rig| rig.status().contains(DriveStatus::REFERENCED)), "{parameter:#b}");
        assert_eq!(rig.store.number_of(Idn::POSITION_FEEDBACK_VALUE_STATUS), 1);
        // The marker in the system of before: its edge, which is its end on the way back.
        let found = rig.store.number_of(Idn::MARKER_POSITION_A);
        assert!((found - marker * 36 / 10_000).abs() <= 1, "{parameter:#b}: marker at {found} for {marker}");
        // The place has not moved; its position has. 0.05 turns behind the marker it is 10 turns.
        let shift = 10 * NANO - (marker + NANO / 20);
        let truth = rig.drive.servo().position().0 - shift;
        if parameter & 0b1000_0000 != 0 {
            rig.run(100, |_| false);
            assert!((rig.actual() - 36_000_000).abs() < 2_000, "{parameter:#b}: stands at {}", rig.actual());
        }
        assert!((truth - marker).abs() < 2 * NANO, "{parameter:#b}: {truth}");
        rig.hold();
        rig.order(Idn::DRIVE_CONTROLLED_HOMING, Order::Cancel).expect("a cancel");
        let before = rig.drive.servo().position().0;
        assert!(rig.run(10, Rig::follows), "{parameter:#b}: it follows again");
        rig.run(50, |_| false);
        let moved = rig.drive.servo().position().0 - before;
        assert!(moved.abs() < NANO / 200, "{parameter:#b}: a jump of {moved}");
    }
}

#[test]
fn homing_that_cannot_be_is_refused_and_one_that_loses_its_torque_fails() {
    let mut rig = Rig::following();
    for parameter in [0b0110_0000, 0b1000, 0x100] {
        rig.store.set_number_of(Idn::HOMING_PARAMETER, parameter);
        assert_eq!(
            rig.order(Idn::DRIVE_CONTROLLED_HOMING, Order::Start),
            Err(SvcError::NOT_EXECUTABLE),
            "{parameter:#b}"
        );
        assert_eq!(
            rig.drive.check(Idn::HOMING_PARAMETER, &parameter.to_le_bytes()[..2], &rig.store),
            Err(SvcError::INVALID_DATA)
        );
    }
    rig.store.set_number_of(Idn::HOMING_PARAMETER, 0);
    assert_eq!(rig.order(Idn::DRIVE_CONTROLLED_HOMING, Order::Start), Ok(Progress::InProcess));
    assert_eq!(
        rig.order(Idn::DRIVE_CONTROLLED_HOMING, Order::Start),
        Err(SvcError::NOT_EXECUTABLE),
        "one at a time"
    );
    rig.run(300, |_| false);
    rig.control(DriveControl::empty());
    rig.run(5, |_| false);
    assert_eq!(rig.progress(), Progress::Failed);
    assert!(!rig.status().contains(DriveStatus::REFERENCED));
    rig.order(Idn::DRIVE_CONTROLLED_HOMING, Order::Cancel).expect("a cancel");
    assert_eq!(
        rig.order(Idn::DRIVE_CONTROLLED_HOMING, Order::Start),
        Err(SvcError::NOT_EXECUTABLE),
        "without torque"
    );
    // Cancelled on the way it stops, and then follows again.
    let mut rig = Rig::following();
    rig.order(Idn::DRIVE_CONTROLLED_HOMING, Order::Start).expect("a start");
    rig.run(500, |_| false);
    assert!(rig.drive.actual().velocity.0 > NANO / 2);
    rig.order(Idn::DRIVE_CONTROLLED_HOMING, Order::Cancel).expect("a cancel");
    assert!(rig.run(2_000, |rig| rig.drive.actual().velocity.0.abs() < NANO / 1_000));
    rig.hold();
    assert!(rig.run(20, Rig::follows));
}

/// The marker is a place of the machine: when the drive counts from another place, it has another number, and what the
/// positions are off by it is less by as much.
#[test]
fn a_marker_moves_with_the_positions() {
    let rig = Rig::following();
    let scales = Scales::read(&rig.store, &ServoParameters::default()).expect("the scaling of a sound drive");
    let off = |homing: &Homing| homing.displacement(&rig.store, &scales);
    let mut homing = Homing { marker: Some(2 * NANO), ..Homing::default() };
    let before = off(&homing).expect("a marker was registered");
    homing.shifted(NANO / 4);
    assert_eq!((homing.marker, off(&homing)), (Some(2 * NANO + NANO / 4), Some(before - NANO / 4)));
    homing.shifted(-NANO);
    assert_eq!((homing.marker, off(&homing)), (Some(NANO + NANO / 4), Some(before + 3 * NANO / 4)));
    let mut none = Homing::default();
    none.shifted(NANO);
    assert_eq!((none.marker, off(&none)), (None, None));
}

/// S-0-0146, 0171, 0172, 0191: the master moves the axis over switch and marker, stops, and takes the displacement over.
#[test]
fn a_master_homes_with_displacement() {
    let mut rig = Rig::following();
    rig.store.set_number_of(Idn::REFERENCE_DISTANCE_1, 720_000);
    assert_eq!(
        rig.order(Idn::CALCULATE_DISPLACEMENT, Order::Start),
        Err(SvcError::NOT_EXECUTABLE),
        "no marker yet"
    );
    assert_eq!(
        rig.order(Idn::DISPLACEMENT_TO_THE_REFERENCED_SYSTEM, Order::Start),
        Err(SvcError::NOT_EXECUTABLE)
    );
    assert_eq!(rig.order(Idn::CONTROL_UNIT_CONTROLLED_HOMING, Order::Start), Ok(Progress::InProcess));
    let mut command = rig.actual();
    while command < 5 * TURN / 2 {
        command += TURN / 1_000;
        rig.store.set_number_of(Idn::POSITION_COMMAND, command);
        rig.cycle();
        assert!(rig.follows(), "the master leads");
    }
    assert_eq!(rig.drive.progress(Idn::CONTROL_UNIT_CONTROLLED_HOMING, &mut rig.store), Progress::Done);
    assert_eq!(
        (
            rig.store.number_of(Idn::MARKER_POSITION_A),
            rig.store.number_of(Idn::REFERENCE_MARKER_PULSE_REGISTERED)
        ),
        (2 * TURN, 1)
    );
    rig.order(Idn::CONTROL_UNIT_CONTROLLED_HOMING, Order::Cancel).expect("a cancel");
    rig.run(500, |_| false);
    assert_eq!(rig.order(Idn::CALCULATE_DISPLACEMENT, Order::Start), Ok(Progress::Done));
    assert_eq!(rig.store.number_of(Idn::DISPLACEMENT_PARAMETER_1), 720_000 - 2 * TURN);
    assert!(!rig.status().contains(DriveStatus::REFERENCED));
    let before = rig.actual();
    assert_eq!(rig.order(Idn::DISPLACEMENT_TO_THE_REFERENCED_SYSTEM, Order::Start), Ok(Progress::Done));
    rig.run(5, |_| false);
    assert!(!rig.follows() && rig.status().contains(DriveStatus::REFERENCED));
    let shift = rig.actual() - before - (720_000 - 2 * TURN);
    assert!(shift.abs() <= 20, "{shift} counts");
    rig.hold();
    rig.order(Idn::DISPLACEMENT_TO_THE_REFERENCED_SYSTEM, Order::Cancel).expect("a cancel");
    assert!(rig.run(5, Rig::follows));
    rig.run(50, |_| false);
    assert!((rig.actual() - (before + 720_000 - 2 * TURN)).abs() < 100);
    assert_eq!(rig.order(Idn::CANCEL_REFERENCE_POINT, Order::Start), Ok(Progress::Done));
    rig.cycle();
    assert!(!rig.status().contains(DriveStatus::REFERENCED));
    assert_eq!(
        rig.order(Idn::SET_ABSOLUTE_POSITION, Order::Start),
        Err(SvcError::NOT_EXECUTABLE),
        "with torque"
    );
    rig.control(DriveControl::empty());
    rig.run(100, |_| false);
    assert_eq!(rig.order(Idn::SET_ABSOLUTE_POSITION, Order::Start), Ok(Progress::Done));
    rig.run(2, |_| false);
    assert!((rig.actual() - 720_000).abs() <= 4, "{}", rig.actual());
}

/// S-0-0258 to 0260 with S-0-0108, lag-less and not: the drive gets there by itself, as fast as it is told.
#[test]
fn targets_are_reached_by_the_drives_own_interpolation() {
    for code in [0x0013, 0x001B] {
        let mut rig = Rig::following();
        rig.store.set_number_of(Idn::PRIMARY_OPERATION_MODE, code);
        // 4 turns a second at half the feedrate, 20 turns/s2 in rad/s2.
        for (idn, value) in [
            (Idn::POSITIONING_VELOCITY, 4 * 60 * 10_000),
            (Idn::FEEDRATE_OVERRIDE, 5_000),
            (Idn::POSITIONING_ACCELERATION, 125_664),
            (Idn::TARGET_POSITION, 7 * TURN / 2),
        ] {
            rig.store.set_number_of(idn, value);
        }
        rig.cycle();
        let mut fastest = 0;
        let reached = (0..5_000).any(|_| {
            rig.cycle();
            assert!(rig.follows());
            fastest = fastest.max(rig.drive.actual().velocity.0);
            (rig.actual() - 7 * TURN / 2).abs() < 400 && rig.drive.actual().velocity.0.abs() < NANO / 1_000
        });
        assert!(reached, "{code:#x}: at {}", rig.actual());
        assert!((fastest - 2 * NANO).abs() < NANO / 20, "{code:#x}: {fastest}");
        // A new target counts at once, backward too.
        rig.store.set_number_of(Idn::TARGET_POSITION, -TURN);
        assert!(rig.run(8_000, |rig| (rig.actual() + TURN).abs() < 400), "{code:#x}");
        // Feedrate zero stops it wherever it is.
        rig.store.set_number_of(Idn::TARGET_POSITION, 50 * TURN);
        rig.run(300, |_| false);
        rig.store.set_number_of(Idn::FEEDRATE_OVERRIDE, 0);
        assert!(rig.run(1_000, |rig| rig.drive.actual().velocity.0.abs() < NANO / 1_000), "{code:#x}");
        assert!(rig.actual() < 2 * TURN);
    }
}
