//! When a CAN bus is used again whose controller was off it.

use profile_generic::time::{DurationNs, MonotonicTime};

/// A bus that was used for so long is sound, and so is one that is lost for the first time: its return is waited for, and
/// nothing else.
const SOUND: DurationNs = DurationNs::from_secs(10);

/// The pause after a return that did not last; it doubles with every further one.
const PAUSE: DurationNs = DurationNs::from_millis(500);

/// The longest one.
const PAUSE_MAX: DurationNs = DurationNs::from_secs(32);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    /// It was never lost.
    First,
    /// It is used again since then.
    Used(MonotonicTime),
    /// Its controller is off it.
    Off,
    /// Its controller is on it, and it may be used from then on.
    From(MonotonicTime),
}

/// A bus with a short circuit is lost again as soon as somebody sends: each return that does not last is followed by a longer
/// pause in which the box leaves the bus alone, and reports nothing.
#[derive(Debug, Clone, Copy)]
pub struct BusReturn {
    place: Place,
    pause: DurationNs,
}

impl BusReturn {
    /// A bus that was never lost.
    pub const NEVER_LOST: Self = Self { place: Place::First, pause: DurationNs::ZERO };

    /// The controller is off the bus; whether the bus was used until now.
    pub fn lose(&mut self, now: MonotonicTime) -> bool {
        let was_used = self.is_used();
        match self.place {
            Place::Used(since) if now < since + SOUND => {
                self.pause = (self.pause * 2).clamp(PAUSE, PAUSE_MAX)
            }
            Place::First | Place::Used(_) => self.pause = DurationNs::ZERO,
            Place::Off | Place::From(_) => {}
        }
        self.place = Place::Off;
        was_used
    }

    /// The controller is on the bus again.
    pub fn come_back(&mut self, now: MonotonicTime) {
        if self.place == Place::Off {
            self.place = Place::From(now + self.pause);
        }
    }

    /// Whether the bus may be used again, once.
    pub fn take(&mut self, now: MonotonicTime) -> bool {
        let back = matches!(self.place, Place::From(at) if now >= at);
        if back {
            self.place = Place::Used(now);
        }
        back
    }

    /// Whether what is heard on the bus counts.
    pub const fn is_used(&self) -> bool {
        matches!(self.place, Place::First | Place::Used(_))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After how long the bus is used whose controller is back at once, and comes back as often while that is waited for.
    fn pause(back: &mut BusReturn, now: &mut MonotonicTime) -> DurationNs {
        assert!(back.lose(*now), "it was used");
        assert!(!back.is_used() && !back.take(MonotonicTime::MAX), "the controller is off");
        back.come_back(*now);
        let begin = *now;
        while !back.take(*now) {
            assert!(!back.is_used());
            *now = *now + DurationNs::from_millis(100);
        }
        assert!(back.is_used() && !back.take(*now), "once");
        *now - begin
    }

    #[test]
    fn a_bus_that_is_lost_again_and_again_is_left_alone_for_longer_and_longer() {
        let (mut back, mut now) = (BusReturn::NEVER_LOST, MonotonicTime(1));
        for milliseconds in [0, 500, 1_000, 2_000, 4_000, 8_000, 16_000, 32_000, 32_000] {
            assert_eq!(pause(&mut back, &mut now), DurationNs::from_millis(milliseconds));
            now = now + DurationNs::from_millis(9_999);
        }
        now = now + DurationNs::from_millis(1);
        assert_eq!(pause(&mut back, &mut now), DurationNs::ZERO, "it was sound for ten seconds");
    }

    #[test]
    fn a_controller_that_goes_while_its_return_is_waited_for_begins_to_wait_anew() {
        let (mut back, mut now) = (BusReturn::NEVER_LOST, MonotonicTime(1));
        pause(&mut back, &mut now);
        assert!(back.lose(now));
        back.come_back(now);
        let later = now + DurationNs::from_millis(400);
        assert!(!back.lose(later), "it was told already");
        assert!(!back.take(MonotonicTime::MAX));
        back.come_back(later);
        assert!(!back.take(now + DurationNs::from_millis(500)));
        assert!(back.take(later + DurationNs::from_millis(500)), "no longer than before: it was not used");
    }
}
