//! Following error: command against actual position at the same instant.

use super::trajectory::State;
use profile_generic::time::{DurationNs, SystemTime};

use super::number::seconds;

/// Commands remembered; a device that answers later than this many updates is not measured.
const COMMANDS: usize = 32;

/// The last commands with the instants for which they were meant.
#[derive(Debug, Clone)]
pub(super) struct Following {
    commands: [(SystemTime, State); COMMANDS],
    next: usize,
    count: usize,
}

impl Default for Following {
    fn default() -> Self {
        Self { commands: [(SystemTime::ZERO, State::default()); COMMANDS], next: 0, count: 0 }
    }
}

impl Following {
    /// Forgets all commands: what comes next does not continue them.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Remembers the command meant for `at`.
    pub fn push(&mut self, at: SystemTime, command: State) {
        self.commands[self.next] = (at, command);
        self.next = (self.next + 1) % COMMANDS;
        self.count = (self.count + 1).min(COMMANDS);
    }

    fn newest(&self, back: usize) -> Option<(SystemTime, State)> {
        (back < self.count).then(|| self.commands[(self.next + COMMANDS - 1 - back) % COMMANDS])
    }

    /// The commanded position at `at`: between two commands interpolated, up to `ahead` behind the newest one
    /// carried on with its velocity. `None` outside of that.
    pub fn command_at(&self, at: SystemTime, ahead: DurationNs) -> Option<f64> {
        let (newest_at, newest) = self.newest(0)?;
        let beyond = at - newest_at;
        if beyond.0 >= 0 {
            return (beyond <= ahead).then(|| newest.position + newest.velocity * seconds(beyond));
        }
        let mut later = (newest_at, newest);
        for back in 1..self.count {
            let earlier = self.newest(back)?;
            if earlier.0 <= at {
                let whole = seconds(later.0 - earlier.0);
                let part = if whole > 0.0 { seconds(at - earlier.0) / whole } else { 0.0 };
                return Some(earlier.1.position + (later.1.position - earlier.1.position) * part);
            }
            later = earlier;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moving(position: f64) -> State {
        State { position, velocity: 1000.0, acceleration: 0.0 }
    }

    #[test]
    fn the_command_is_taken_at_the_instant_asked_for() {
        let mut f = Following::default();
        let ahead = DurationNs::from_millis(4);
        assert_eq!(f.command_at(SystemTime(0), ahead), None);
        for i in 0..40_u32 {
            f.push(SystemTime(u64::from(i) * 2_000_000), moving(f64::from(i) * 2.0));
        }
        let at = |nanos| f.command_at(SystemTime(nanos), ahead);
        assert_eq!(at(78_000_000), Some(78.0));
        assert_eq!(at(77_500_000), Some(77.5));
        assert_eq!(at(82_000_000), Some(82.0), "carried on for two updates");
        assert_eq!(at(82_000_001), None);
        assert_eq!(at(16_000_000), Some(16.0), "the oldest of 32");
        assert_eq!(at(15_999_999), None);
        f.clear();
        assert_eq!(f.command_at(SystemTime(78_000_000), ahead), None);
    }
}
