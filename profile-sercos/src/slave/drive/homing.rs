//! Homing: the position gets its reference to the machine.
//!
//! ```text
//! S-0-0148, drive controlled         the drive moves by itself and ignores command values until the command is cancelled
//!   leave     the home switch is active at the start: back out of it
//!   switch    S-0-0147 bit 0 says which way, S-0-0041 how fast, S-0-0042 how quickly; bit 5 = 1 does without
//!   marker    the first one behind the edge of the switch; bit 6 = 1 does without
//!   approach  bit 7 = 1: to the reference point; else to a stop
//!   done      S-0-0403 = 1; the reference point, S-0-0150 behind the marker, has the position S-0-0052
//!
//! S-0-0146, control unit controlled  the master moves the axis; the drive watches for switch and marker, S-0-0408 = 1
//! S-0-0171                           S-0-0175 = what the positions are off
//! S-0-0172                           positions shift by it, S-0-0403 = 1; no command value counts until it is cancelled
//!
//! S-0-0191 cancels the reference. S-0-0447 gives the place where the axis stands the position S-0-0052.
//! ```
//!
//! What the drive does on S-0-0148 is how Rexroth, Metronix and Kollmorgen drives do it. The meaning of S-0-0171, 0172,
//! 0175 and 0408 beyond their names is told by no public source.

use profile_generic::quantity::Position;
use profile_generic::servo::motion::{Motion, Pace};

use super::super::application::Progress;
use super::super::parameter::{Definition, Store};
use super::scaling::Scales;

/// IDNs of homing.
pub mod idn {
    use crate::wire::idn::Idn;

    /// Homing velocity.
    pub const VELOCITY: Idn = Idn::standard(41);
    /// Homing acceleration.
    pub const ACCELERATION: Idn = Idn::standard(42);
    /// Reference distance 1: the position of the reference point.
    pub const REFERENCE: Idn = Idn::standard(52);
    /// Control unit controlled homing procedure command.
    pub const BY_MASTER: Idn = Idn::standard(146);
    /// Homing parameter.
    pub const PARAMETER: Idn = Idn::standard(147);
    /// Drive controlled homing procedure command.
    pub const BY_DRIVE: Idn = Idn::standard(148);
    /// Reference offset 1: from the marker to the reference point.
    pub const OFFSET: Idn = Idn::standard(150);
    /// Calculate displacement procedure command.
    pub const CALCULATE: Idn = Idn::standard(171);
    /// Displacement to the referenced system procedure command.
    pub const DISPLACE: Idn = Idn::standard(172);
    /// Marker position A.
    pub const MARKER: Idn = Idn::standard(173);
    /// Displacement parameter 1.
    pub const DISPLACEMENT: Idn = Idn::standard(175);
    /// Cancel reference point procedure command.
    pub const CANCEL: Idn = Idn::standard(191);
    /// Reference marker pulse registered.
    pub const REGISTERED: Idn = Idn::standard(408);
    /// Set absolute position procedure command.
    pub const SET_ABSOLUTE: Idn = Idn::standard(447);
}

/// Bits of S-0-0147.
mod bits {
    pub const NEGATIVE: i64 = 1;
    pub const NO_SWITCH: i64 = 1 << 5;
    pub const NO_MARKER: i64 = 1 << 6;
    pub const TO_REFERENCE: i64 = 1 << 7;
    /// What the drive can do; bit 2, switch connected to the drive, is how it is anyway.
    pub const KNOWN: i64 = NEGATIVE | 1 << 2 | NO_SWITCH | NO_MARKER | TO_REFERENCE;
}

/// Element 3.
mod attribute {
    pub const BITS: u32 = 0x4001_0001;
    pub const BITS_READ: u32 = 0x7001_0001;
    pub const COMMAND_CP4: u32 = 0x3009_0001;
    pub const COMMAND: u32 = 0x0009_0001;
    pub const POSITION: u32 = 0x0422_0001;
    pub const POSITION_READ: u32 = 0x7422_0001;
    pub const VELOCITY: u32 = 0x0322_0001;
}

/// Adds the parameters of homing.
pub fn define(store: &mut Store, length: &'static str, speed: &'static str) {
    use attribute as a;
    let value = |idn, attribute, name| Definition::value(idn, attribute, name, 0);
    let command = Definition::command;
    let double = i64::from(i32::MAX);
    let definitions = [
        value(idn::VELOCITY, a::VELOCITY, "Homing velocity").unit(speed).range(1, double),
        value(idn::ACCELERATION, a::VELOCITY, "Homing acceleration").range(1, double),
        value(idn::REFERENCE, a::POSITION, "Reference distance 1").unit(length),
        value(idn::OFFSET, a::POSITION, "Reference offset 1").unit(length),
        value(idn::PARAMETER, a::BITS, "Homing parameter"),
        value(idn::MARKER, a::POSITION_READ, "Marker position A").unit(length),
        value(idn::DISPLACEMENT, a::POSITION_READ, "Displacement parameter 1").unit(length),
        value(idn::REGISTERED, a::BITS_READ, "Reference marker pulse registered"),
        command(idn::BY_DRIVE, a::COMMAND_CP4, "Drive controlled homing procedure command"),
        command(idn::BY_MASTER, a::COMMAND_CP4, "Control unit controlled homing procedure command"),
        command(idn::CALCULATE, a::COMMAND_CP4, "Calculate displacement procedure command"),
        command(idn::DISPLACE, a::COMMAND_CP4, "Displacement to the referenced system procedure command"),
        command(idn::CANCEL, a::COMMAND, "Cancel reference point procedure command"),
        command(idn::SET_ABSOLUTE, a::COMMAND, "Set absolute position procedure command"),
    ];
    for definition in definitions {
        store.define(definition);
    }
}

/// Whether the drive can home by this S-0-0147.
pub fn is_possible(parameter: i64) -> bool {
    let nothing = bits::NO_SWITCH | bits::NO_MARKER;
    parameter & !bits::KNOWN == 0 && parameter & nothing != nothing
}

/// Where homing stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Step {
    #[default]
    Idle,
    Leave,
    Switch,
    /// Behind the edge of the switch at this position, if there was one.
    Marker(Option<i64>),
    /// On to this position, or to a stop; the place of the marker is known.
    Approach {
        marker: i64,
        target: Option<i64>,
    },
    Done,
    Failed,
    /// Cancelled on the way: to a stop, then command values count again.
    Stopping,
}

/// What the drive senses in a cycle, nanounits.
#[derive(Debug, Clone, Copy)]
pub(super) struct Senses {
    /// The home switch is active.
    pub switch: bool,
    /// Where it went active since the last cycle.
    pub edge: Option<Position>,
    /// Where a marker was since the last cycle.
    pub marker: Option<Position>,
    /// The drive could follow a set-point.
    pub able: bool,
    /// Time since the last cycle, nanoseconds.
    pub span: i64,
}

/// State of homing.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Homing {
    /// S-0-0148.
    by_drive: Step,
    /// S-0-0146.
    by_master: Step,
    /// Place of the marker that counts.
    marker: Option<i64>,
    /// S-0-0172 is set: no command value counts.
    displaced: bool,
}

impl Homing {
    /// Whether the drive moves, or stands, by itself.
    pub fn leads(&self) -> bool {
        self.by_drive != Step::Idle || self.displaced
    }

    pub fn start_by_drive(&mut self, store: &Store, switch: bool) {
        let without = store.number_of(idn::PARAMETER) & bits::NO_SWITCH != 0;
        self.by_drive = match (without, switch) {
            (true, _) => Step::Marker(None),
            (false, true) => Step::Leave,
            (false, false) => Step::Switch,
        };
    }

    pub fn start_by_master(&mut self, store: &mut Store) {
        let without = store.number_of(idn::PARAMETER) & bits::NO_SWITCH != 0;
        self.marker = None;
        store.set_number_of(idn::REGISTERED, 0);
        self.by_master = if without { Step::Marker(None) } else { Step::Switch };
    }

    /// The master cancels S-0-0148.
    pub fn cancel_by_drive(&mut self) {
        self.by_drive = match self.by_drive {
            Step::Idle | Step::Done | Step::Failed => Step::Idle,
            _ => Step::Stopping,
        };
    }

    /// The master cancels S-0-0146.
    pub fn cancel_by_master(&mut self) {
        self.by_master = Step::Idle;
    }

    pub fn set_displaced(&mut self, displaced: bool) {
        self.displaced = displaced;
    }

    pub fn progress_by_drive(&self) -> Progress {
        progress(self.by_drive)
    }

    pub fn progress_by_master(&self) -> Progress {
        progress(self.by_master)
    }

    /// What the positions are off, as S-0-0171 calculates it; `None` before a marker was registered.
    pub fn displacement(&self, store: &Store, scales: &Scales) -> Option<i64> {
        Some(reference_of(store, scales) - (self.marker? + offset_of(store, scales)))
    }

    /// The place of the axis is `shift` more than it was.
    pub fn shifted(&mut self, shift: i64) {
        self.marker = self.marker.map(|marker| marker.saturating_add(shift));
    }

    /// S-0-0146: watches while the master moves the axis.
    pub fn watch(&mut self, senses: &Senses, store: &mut Store, counts: impl Fn(i64) -> i64) {
        let parameter = store.number_of(idn::PARAMETER);
        self.by_master = match self.by_master {
            Step::Switch => senses.edge.map_or(Step::Switch, |edge| Step::Marker(Some(edge.0))),
            Step::Marker(edge) => match found(edge, senses, parameter, store) {
                Some(marker) => {
                    self.marker = Some(marker);
                    store.set_number_of(idn::MARKER, counts(marker));
                    store.set_number_of(idn::REGISTERED, 1);
                    Step::Done
                }
                None => Step::Marker(edge),
            },
            other => other,
        };
    }

    /// S-0-0148: one cycle. Returns by how much positions shift, at the end.
    pub fn advance(
        &mut self,
        motion: &mut Motion,
        senses: &Senses,
        store: &mut Store,
        scales: &Scales,
        counts: impl Fn(i64) -> i64,
    ) -> Option<i64> {
        let parameter = store.number_of(idn::PARAMETER);
        let way = way_of(parameter, store);
        let quick = scales.acceleration.generic(store.number_of(idn::ACCELERATION)).max(1);
        let velocity = scales.velocity.generic(store.number_of(idn::VELOCITY)).max(1);
        let pace = Pace { velocity, acceleration: quick, deceleration: quick };
        if !senses.able && !matches!(self.by_drive, Step::Idle | Step::Done) {
            // Without torque, or halted for good: it cannot be brought to an end.
            self.by_drive = if self.by_drive == Step::Stopping { Step::Idle } else { Step::Failed };
        }
        match self.by_drive {
            Step::Idle => {}
            Step::Done | Step::Failed => motion.advance(senses.span, 0, pace),
            Step::Stopping => {
                motion.advance(senses.span, 0, pace);
                if motion.velocity == 0 {
                    self.by_drive = Step::Idle;
                }
            }
            Step::Leave => {
                motion.advance(senses.span, -way * velocity, pace);
                if !senses.switch {
                    self.by_drive = Step::Switch;
                }
            }
            Step::Switch => {
                motion.advance(senses.span, way * velocity, pace);
                if let Some(edge) = senses.edge {
                    self.by_drive = self.behind(Some(edge.0), senses, parameter, store, scales);
                }
            }
            Step::Marker(edge) => {
                motion.advance(senses.span, way * velocity, pace);
                self.by_drive = self.behind(edge, senses, parameter, store, scales);
            }
            Step::Approach { marker, target } => {
                let there = match target {
                    Some(target) => motion.advance_to(senses.span, target, pace),
                    None => {
                        motion.advance(senses.span, 0, pace);
                        motion.velocity == 0
                    }
                };
                if there {
                    self.by_drive = Step::Done;
                    self.marker = Some(marker);
                    store.set_number_of(idn::MARKER, counts(marker));
                    return self.displacement(store, scales);
                }
            }
        }
        None
    }

    /// Behind the switch: the marker, or the switch itself where no marker counts.
    fn behind(
        &self,
        edge: Option<i64>,
        senses: &Senses,
        parameter: i64,
        store: &Store,
        scales: &Scales,
    ) -> Step {
        let Some(marker) = found(edge, senses, parameter, store) else { return Step::Marker(edge) };
        let reference = marker + offset_of(store, scales);
        let target = (parameter & bits::TO_REFERENCE != 0).then_some(reference);
        Step::Approach { marker, target }
    }
}

/// The place that counts: a marker that was not passed before the switch, or the switch.
fn found(edge: Option<i64>, senses: &Senses, parameter: i64, store: &Store) -> Option<i64> {
    if parameter & bits::NO_MARKER != 0 {
        return edge;
    }
    let marker = senses.marker?.0;
    let way = way_of(parameter, store);
    edge.is_none_or(|edge| (marker - edge) * way >= 0).then_some(marker)
}

fn progress(step: Step) -> Progress {
    match step {
        Step::Done => Progress::Done,
        Step::Failed | Step::Idle => Progress::Failed,
        _ => Progress::InProcess,
    }
}

/// Positions and directions are those of the feedback value, which may be inverted.
fn sign_of(store: &Store) -> i64 {
    const INVERTED: i64 = 1 << 2;
    if store.number_of(super::idn::POSITION_POLARITY) & INVERTED == 0 { 1 } else { -1 }
}

fn way_of(parameter: i64, store: &Store) -> i64 {
    if parameter & bits::NEGATIVE != 0 { -sign_of(store) } else { sign_of(store) }
}

fn reference_of(store: &Store, scales: &Scales) -> i64 {
    sign_of(store) * scales.position.generic(store.number_of(idn::REFERENCE))
}

fn offset_of(store: &Store, scales: &Scales) -> i64 {
    sign_of(store) * scales.position.generic(store.number_of(idn::OFFSET))
}

#[cfg(test)]
mod tests {
    use profile_generic::capture::CaptureWindow;
    use profile_generic::servo::ServoParameters;
    use profile_generic::time::{DurationNs, MonotonicTime};

    use super::super::super::application::{Application, Cycle, Order};
    use super::super::super::phase::State;
    use super::super::{Drive, parameters};
    use super::*;
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
            self.drive.progress(idn::BY_DRIVE, &mut self.store)
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
            self.store.number_of(parameters::idn::POSITION_FEEDBACK)
        }

        fn hold(&mut self) {
            let here = self.actual();
            self.store.set_number_of(parameters::idn::POSITION_COMMAND, here);
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
            rig.store.set_number_of(idn::PARAMETER, parameter);
            rig.store.set_number_of(idn::REFERENCE, 36_000_000);
            rig.store.set_number_of(idn::OFFSET, 180_000);
            rig.drive.set_referenced(true);
            assert_eq!(rig.order(idn::BY_DRIVE, Order::Start), Ok(Progress::InProcess));
            rig.cycle();
            assert!(!rig.status().contains(DriveStatus::REFERENCED), "{parameter:#b}: cleared at the start");
            // A command value that would lead far away does not count.
            rig.store.set_number_of(parameters::idn::POSITION_COMMAND, -50 * TURN);
            assert_eq!(rig.homes(), Progress::Done, "{parameter:#b}");
            assert!(rig.run(2, |rig| rig.status().contains(DriveStatus::REFERENCED)), "{parameter:#b}");
            assert_eq!(rig.store.number_of(parameters::idn::POSITION_STATUS), 1);
            // The marker in the system of before: its edge, which is its end on the way back.
            let found = rig.store.number_of(idn::MARKER);
            assert!(
                (found - marker * 36 / 10_000).abs() <= 1,
                "{parameter:#b}: marker at {found} for {marker}"
            );
            // The place has not moved; its position has. 0.05 turns behind the marker it is 10 turns.
            let shift = 10 * NANO - (marker + NANO / 20);
            let truth = rig.drive.servo().position().0 - shift;
            if parameter & 0b1000_0000 != 0 {
                rig.run(100, |_| false);
                assert!(
                    (rig.actual() - 36_000_000).abs() < 2_000,
                    "{parameter:#b}: stands at {}",
                    rig.actual()
                );
            }
            assert!((truth - marker).abs() < 2 * NANO, "{parameter:#b}: {truth}");
            rig.hold();
            rig.order(idn::BY_DRIVE, Order::Cancel).expect("a cancel");
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
            rig.store.set_number_of(idn::PARAMETER, parameter);
            assert_eq!(
                rig.order(idn::BY_DRIVE, Order::Start),
                Err(SvcError::NOT_EXECUTABLE),
                "{parameter:#b}"
            );
            assert_eq!(
                rig.drive.check(idn::PARAMETER, &parameter.to_le_bytes()[..2], &rig.store),
                Err(SvcError::INVALID_DATA)
            );
        }
        rig.store.set_number_of(idn::PARAMETER, 0);
        assert_eq!(rig.order(idn::BY_DRIVE, Order::Start), Ok(Progress::InProcess));
        assert_eq!(rig.order(idn::BY_DRIVE, Order::Start), Err(SvcError::NOT_EXECUTABLE), "one at a time");
        rig.run(300, |_| false);
        rig.control(DriveControl::empty());
        rig.run(5, |_| false);
        assert_eq!(rig.progress(), Progress::Failed);
        assert!(!rig.status().contains(DriveStatus::REFERENCED));
        rig.order(idn::BY_DRIVE, Order::Cancel).expect("a cancel");
        assert_eq!(rig.order(idn::BY_DRIVE, Order::Start), Err(SvcError::NOT_EXECUTABLE), "without torque");
        // Cancelled on the way it stops, and then follows again.
        let mut rig = Rig::following();
        rig.order(idn::BY_DRIVE, Order::Start).expect("a start");
        rig.run(500, |_| false);
        assert!(rig.drive.actual().velocity.0 > NANO / 2);
        rig.order(idn::BY_DRIVE, Order::Cancel).expect("a cancel");
        assert!(rig.run(2_000, |rig| rig.drive.actual().velocity.0.abs() < NANO / 1_000));
        rig.hold();
        assert!(rig.run(20, Rig::follows));
    }

    /// The marker is a place of the machine: when the drive counts from another place, it has another number, and what the
    /// positions are off by it is less by as much.
    #[test]
    fn a_marker_moves_with_the_positions() {
        let rig = Rig::following();
        let scales =
            Scales::read(&rig.store, &ServoParameters::default()).expect("the scaling of a sound drive");
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
        rig.store.set_number_of(idn::REFERENCE, 720_000);
        assert_eq!(rig.order(idn::CALCULATE, Order::Start), Err(SvcError::NOT_EXECUTABLE), "no marker yet");
        assert_eq!(rig.order(idn::DISPLACE, Order::Start), Err(SvcError::NOT_EXECUTABLE));
        assert_eq!(rig.order(idn::BY_MASTER, Order::Start), Ok(Progress::InProcess));
        let mut command = rig.actual();
        while command < 5 * TURN / 2 {
            command += TURN / 1_000;
            rig.store.set_number_of(parameters::idn::POSITION_COMMAND, command);
            rig.cycle();
            assert!(rig.follows(), "the master leads");
        }
        assert_eq!(rig.drive.progress(idn::BY_MASTER, &mut rig.store), Progress::Done);
        assert_eq!((rig.store.number_of(idn::MARKER), rig.store.number_of(idn::REGISTERED)), (2 * TURN, 1));
        rig.order(idn::BY_MASTER, Order::Cancel).expect("a cancel");
        rig.run(500, |_| false);
        assert_eq!(rig.order(idn::CALCULATE, Order::Start), Ok(Progress::Done));
        assert_eq!(rig.store.number_of(idn::DISPLACEMENT), 720_000 - 2 * TURN);
        assert!(!rig.status().contains(DriveStatus::REFERENCED));
        let before = rig.actual();
        assert_eq!(rig.order(idn::DISPLACE, Order::Start), Ok(Progress::Done));
        rig.run(5, |_| false);
        assert!(!rig.follows() && rig.status().contains(DriveStatus::REFERENCED));
        let shift = rig.actual() - before - (720_000 - 2 * TURN);
        assert!(shift.abs() <= 20, "{shift} counts");
        rig.hold();
        rig.order(idn::DISPLACE, Order::Cancel).expect("a cancel");
        assert!(rig.run(5, Rig::follows));
        rig.run(50, |_| false);
        assert!((rig.actual() - (before + 720_000 - 2 * TURN)).abs() < 100);
        assert_eq!(rig.order(idn::CANCEL, Order::Start), Ok(Progress::Done));
        rig.cycle();
        assert!(!rig.status().contains(DriveStatus::REFERENCED));
        assert_eq!(rig.order(idn::SET_ABSOLUTE, Order::Start), Err(SvcError::NOT_EXECUTABLE), "with torque");
        rig.control(DriveControl::empty());
        rig.run(100, |_| false);
        assert_eq!(rig.order(idn::SET_ABSOLUTE, Order::Start), Ok(Progress::Done));
        rig.run(2, |_| false);
        assert!((rig.actual() - 720_000).abs() <= 4, "{}", rig.actual());
    }

    /// S-0-0258 to 0260 with S-0-0108, lag-less and not: the drive gets there by itself, as fast as it is told.
    #[test]
    fn targets_are_reached_by_the_drives_own_interpolation() {
        use parameters::idn as p;
        for code in [0x0013, 0x001B] {
            let mut rig = Rig::following();
            rig.store.set_number_of(p::MODE, code);
            // 4 turns a second at half the feedrate, 20 turns/s2 in rad/s2.
            for (idn, value) in [
                (p::POSITIONING_VELOCITY, 4 * 60 * 10_000),
                (p::OVERRIDE, 5_000),
                (p::POSITIONING_ACCELERATION, 125_664),
                (p::TARGET_POSITION, 7 * TURN / 2),
            ] {
                rig.store.set_number_of(idn, value);
            }
            rig.cycle();
            let mut fastest = 0;
            let reached = (0..5_000).any(|_| {
                rig.cycle();
                assert!(rig.follows());
                fastest = fastest.max(rig.drive.actual().velocity.0);
                (rig.actual() - 7 * TURN / 2).abs() < 400
                    && rig.drive.actual().velocity.0.abs() < NANO / 1_000
            });
            assert!(reached, "{code:#x}: at {}", rig.actual());
            assert!((fastest - 2 * NANO).abs() < NANO / 20, "{code:#x}: {fastest}");
            // A new target counts at once, backward too.
            rig.store.set_number_of(p::TARGET_POSITION, -TURN);
            assert!(rig.run(8_000, |rig| (rig.actual() + TURN).abs() < 400), "{code:#x}");
            // Feedrate zero stops it wherever it is.
            rig.store.set_number_of(p::TARGET_POSITION, 50 * TURN);
            rig.run(300, |_| false);
            rig.store.set_number_of(p::OVERRIDE, 0);
            assert!(rig.run(1_000, |rig| rig.drive.actual().velocity.0.abs() < NANO / 1_000), "{code:#x}");
            assert!(rig.actual() < 2 * TURN);
        }
    }
}
