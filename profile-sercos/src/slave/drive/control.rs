//! The control word S-0-0134: what it asks of the servo, with the delays, and the operation mode that it selects.

use profile_generic::image::StatusBits;
use profile_generic::mode::OperatingMode;
use profile_generic::servo::{ServoActual, ServoControl};
use profile_generic::state::Report;
use profile_generic::time::DurationNs;

use super::parameters::MODES;
use crate::slave::application::Cycle;
use crate::slave::parameter::Store;
use crate::slave::phase::State;
use crate::wire::drive_words::DriveControl;
use crate::wire::header::Phase;
use crate::wire::idn::Idn;

/// Data blocks of the operation modes that bits 10..8 of S-0-0134 select.
pub(super) const MODE_BLOCKS: [u16; 8] = [32, 33, 34, 35, 284, 285, 286, 287];

/// Bits 15 and 14: the drive is to have torque.
const ENABLING: DriveControl = DriveControl::ON.union(DriveControl::ENABLE);

/// What the control word asks for.
#[derive(Debug)]
pub(super) struct Control {
    pub word: DriveControl,
    pub main_power: bool,
    /// The connection was lost in operation, or a fault was reset: the enabling bits have to go away once.
    pub locked: bool,
    /// Time in operation, up to the drive-on delay.
    on_for: DurationNs,
    /// Time at standstill since the drive was switched off by bit 15.
    pub off_for: DurationNs,
    pub follows: bool,
    /// It shows neither bit 3 nor bit 4 of S-0-0135, and knows no halt.
    pub silent: bool,
}

impl Control {
    pub fn new() -> Control {
        Control {
            word: DriveControl::empty(),
            main_power: true,
            locked: false,
            on_for: DurationNs::ZERO,
            off_for: DurationNs::ZERO,
            follows: false,
            silent: false,
        }
    }

    /// Takes the word of a cycle; `torque` while the drive is in operation.
    pub fn take(&mut self, received: DriveControl, cycle: &Cycle, torque: bool) {
        if cycle.connected {
            self.word = received;
            self.locked &= received.contains(ENABLING);
        } else if torque {
            self.locked = true;
        } else if cycle.state != State::In(Phase::CP4) {
            self.word = DriveControl::empty();
            self.locked = false;
        }
    }

    /// The drive is to have torque.
    pub fn wants_torque(&self, cycle: &Cycle) -> bool {
        self.word.contains(ENABLING) && cycle.connected
    }

    /// Whether the drive-on delay is over; counts from the moment at which the drive has torque.
    pub fn is_through_on_delay(&mut self, torque: bool, elapsed: DurationNs, store: &Store) -> bool {
        self.on_for = if torque { self.on_for + elapsed } else { DurationNs::ZERO };
        self.on_for >= tenth_millis(store, Idn::DRIVE_ON_DELAY_TIME)
    }

    /// The servo's control, from the bits of S-0-0134 and the delays; `torque` while the drive is in operation.
    pub fn servo_control(
        &mut self,
        cycle: &Cycle,
        store: &Store,
        actual: &ServoActual,
        torque: bool,
    ) -> ServoControl {
        let (on, enable) = (self.word.contains(DriveControl::ON), self.word.contains(DriveControl::ENABLE));
        if !enable && (cycle.connected || !torque) {
            return ServoControl::TorqueOff;
        }
        if !on || !cycle.connected || self.locked {
            let stands = torque && actual.status.contains(StatusBits::STANDSTILL);
            self.off_for = if stands { self.off_for + cycle.elapsed } else { DurationNs::ZERO };
            let waits = torque && self.is_in_off_delay(cycle, store);
            return if waits { ServoControl::Halt } else { ServoControl::Disable };
        }
        self.off_for = DurationNs::ZERO;
        let halt = !self.word.contains(DriveControl::RESTART) && !self.silent;
        let running = matches!(actual.report, Report::Operating | Report::Halted);
        if halt && running { ServoControl::Halt } else { ServoControl::Enable }
    }

    /// Whether the drive stays in halt for the drive-off delay: only for a master that it follows.
    fn is_in_off_delay(&self, cycle: &Cycle, store: &Store) -> bool {
        let follows = cycle.connected && !self.locked;
        follows && self.off_for < tenth_millis(store, Idn::DRIVE_OFF_DELAY_TIME)
    }
}

/// A delay parameter in 0.1 ms.
fn tenth_millis(store: &Store, idn: Idn) -> DurationNs {
    DurationNs(store.number_of(idn).saturating_mul(100_000))
}

/// The operation mode.
#[derive(Debug)]
pub(super) struct ModeSwitch {
    /// Code in effect.
    pub code: u16,
    /// The number that selects it, bits 10..8 of S-0-0134.
    pub number: u8,
    /// Time from the selection of a mode to the mode.
    pub delay: DurationNs,
    /// How long another one has been selected.
    selected_for: DurationNs,
}

impl ModeSwitch {
    pub fn new() -> ModeSwitch {
        ModeSwitch { code: MODES[2], number: 0, delay: DurationNs::ZERO, selected_for: DurationNs::ZERO }
    }

    /// The code behind the selected number, with that number; the one in effect while `torque` makes the change wait.
    pub fn select(&mut self, selected: u8, elapsed: DurationNs, torque: bool, store: &Store) -> (u16, u8) {
        self.selected_for =
            if selected == self.number { DurationNs::ZERO } else { self.selected_for + elapsed };
        let waits = self.selected_for <= self.delay && torque;
        let number = if waits { self.number } else { selected };
        let block = MODE_BLOCKS[usize::from(number & 7)];
        let [low, high, ..] = store.number_of(Idn::standard(block)).to_le_bytes();
        (u16::from_le_bytes([low, high]), number)
    }
}

/// What an operation mode code means to the servo; `None` if the drive does not have it.
pub(super) const fn mode_of(code: u16) -> Option<OperatingMode> {
    match code {
        0x0001 => Some(OperatingMode::Torque),
        0x0002 => Some(OperatingMode::Velocity),
        0x0003 | 0x000B | 0x0013 | 0x001B | 0x0004 | 0x000C | 0x0014 | 0x001C => {
            Some(OperatingMode::Position)
        }
        _ => None,
    }
}

/// Whether the position loop is closed over feedback 2 in an operation mode.
pub(super) const fn is_by_load(code: u16) -> bool {
    code & 0b111 == 0b100
}

#[cfg(test)]
mod tests {
    use profile_generic::time::MonotonicTime;

    use super::*;

    fn cycle(connected: bool, phase: Phase) -> Cycle {
        let (now, elapsed) = (MonotonicTime(0), DurationNs::from_millis(1));
        Cycle { now, elapsed, state: State::In(phase), connected, fresh: connected }
    }

    #[test]
    fn connection_lost_in_operation_locks_until_the_bits_go_away() {
        let mut control = Control::new();
        control.take(ENABLING, &cycle(true, Phase::CP4), false);
        assert!(control.wants_torque(&cycle(true, Phase::CP4)) && !control.locked);
        control.take(DriveControl::empty(), &cycle(false, Phase::CP4), true);
        assert!(control.locked && control.word == ENABLING);
        control.take(ENABLING, &cycle(true, Phase::CP4), false);
        assert!(control.locked);
        control.take(DriveControl::ON, &cycle(true, Phase::CP4), false);
        assert!(!control.locked);
        // Without torque and outside of CP4 nothing of it stays.
        control.locked = true;
        control.take(ENABLING, &cycle(false, Phase::CP3), false);
        assert!(!control.locked && control.word.is_empty());
    }

    #[test]
    fn each_supported_code_has_its_mode() {
        assert_eq!(mode_of(0x0013), Some(OperatingMode::Position));
        assert_eq!(mode_of(0x0002), Some(OperatingMode::Velocity));
        assert_eq!(mode_of(0x0001), Some(OperatingMode::Torque));
        assert!(MODES.iter().all(|&code| mode_of(code).is_some()));
        assert_eq!(mode_of(0x0005), None);
        let by_load: Vec<u16> = MODES.into_iter().filter(|code| is_by_load(*code)).collect();
        assert_eq!(by_load, [0x0004, 0x000C, 0x0014, 0x001C]);
    }
}
