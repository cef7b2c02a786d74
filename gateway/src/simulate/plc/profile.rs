//! Assemblies of the AC/DC drive profile in the words of the others: run is ENABLE, and there is neither START nor STOP.

use profile_cip::assembly::Control;
use profile_cip::assembly::handshake::Status;
use profile_cip::devicenet::wire::speed::{
    Assembly, SpeedActual, SpeedControl, SpeedStatus, SupervisorState,
};

/// Seconds in a minute.
const MINUTE: i64 = 60;

/// The assemblies of one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Profile {
    /// The output assembly, 20 to 23.
    output: Assembly,
    /// Counts in a revolution.
    counts: u32,
}

impl Profile {
    pub const fn new(output: Assembly, counts: u32) -> Self {
        Self { output, counts }
    }

    /// Byte 0 of the output; `None` for a bit that the profile does not have.
    pub fn control(self, word: Control) -> Option<u8> {
        let mut bits = SpeedControl::empty();
        bits.set(SpeedControl::RUN_FORWARD, word.contains(Control::ENABLE));
        bits.set(SpeedControl::FAULT_RESET, word.contains(Control::RESET));
        if self.output.is_extended() {
            bits |= SpeedControl::NET_CONTROL | SpeedControl::NET_REFERENCE;
        }
        (word - (Control::ENABLE | Control::RESET)).is_empty().then_some(bits.bits())
    }

    /// The status word, as far as the input has it. The basic assemblies do not show that the gateway takes data in run.
    pub fn status(self, input: &[u8]) -> Status {
        let actual = self.output.status().and_then(|input_of| SpeedActual::parse(input_of, input).ok());
        let SpeedActual { status, state, speed, .. } = actual.unwrap_or_default();
        let running = status.intersects(SpeedStatus::RUNNING_FORWARD | SpeedStatus::RUNNING_REVERSE);
        let torque = matches!(
            state,
            SupervisorState::ENABLED | SupervisorState::STOPPING | SupervisorState::FAULT_STOP
        );
        let mut word = Status::empty();
        word.set(Status::READY, status.contains(SpeedStatus::READY) && !running);
        word.set(Status::ENABLED, running);
        word.set(Status::TORQUE, running || torque);
        word.set(Status::FAULT, status.contains(SpeedStatus::FAULTED));
        word.set(Status::WARNING, status.contains(SpeedStatus::WARNING));
        word.set(Status::RUN, !self.output.is_extended() || status.contains(SpeedStatus::CONTROL_FROM_NET));
        word.set(Status::STANDSTILL, speed == 0);
        word
    }

    /// The speed nearest to a velocity in counts/s, rpm.
    pub fn rpm(self, velocity: i64) -> i64 {
        let counts = i64::from(self.counts.max(1));
        let doubled = velocity.saturating_mul(2 * MINUTE);
        (doubled.saturating_add(counts * doubled.signum())) / (2 * counts)
    }

    /// The velocity of a speed, counts/s.
    pub fn velocity(self, rpm: i64) -> i64 {
        rpm.saturating_mul(i64::from(self.counts)) / MINUTE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_become_bits_and_bits_become_words() {
        let basic = Profile::new(Assembly(22), 1_000_000);
        let extended = Profile::new(Assembly(23), 1_000_000);
        for (word, in_basic, in_extended) in [
            (Control::empty(), Some(0), Some(0x60)),
            (Control::ENABLE, Some(1), Some(0x61)),
            (Control::RESET, Some(4), Some(0x64)),
            (Control::ENABLE | Control::STOP, None, None),
            (Control::ENABLE | Control::START, None, None),
            (Control::from_bits_retain(0x100), None, None),
        ] {
            assert_eq!((basic.control(word), extended.control(word)), (in_basic, in_extended), "{word:?}");
        }
        let run = Status::RUN;
        for (input, expected) in [
            ([0x70, 3, 0, 0, 0, 0], run | Status::READY | Status::STANDSTILL),
            ([0xF4, 4, 60, 0, 0, 0], run | Status::ENABLED | Status::TORQUE),
            ([0x78, 4, 0xFF, 0xFF, 0, 0], run | Status::ENABLED | Status::TORQUE),
            ([0x60, 5, 1, 0, 0, 0], run | Status::TORQUE),
            ([0x03, 7, 0, 0, 0, 0], Status::FAULT | Status::WARNING | Status::STANDSTILL),
        ] {
            assert_eq!(extended.status(&input), expected, "{input:?}");
        }
        let running = run | Status::ENABLED | Status::TORQUE;
        assert_eq!(basic.status(&[0x04, 0, 1, 0, 0, 0]), running);
        assert_eq!(basic.status(&[0x01, 0, 1, 0, 0, 0]), run | Status::FAULT);
        // A revolution a second are 60 rpm.
        for (velocity, rpm) in
            [(1_000_000, 60), (-1_000_000, -60), (8_333, 0), (8_334, 1), (-25_000, -2), (0, 0)]
        {
            assert_eq!(basic.rpm(velocity), rpm, "{velocity}");
        }
        assert_eq!((basic.velocity(60), basic.velocity(-1)), (1_000_000, -16_666));
    }
}
