//! Devices that fall out again and again: one that restarts by itself, or that a bad contact takes away, is left alone for longer and
//! longer. Else the master would do nothing but set it up.

use profile_generic::time::{DurationNs, MonotonicTime};

/// A device that was in operation for so long is sound.
const SOUND: DurationNs = DurationNs::from_secs(10);

/// So many times in a row it is set up at once.
const AT_ONCE: u32 = 2;

/// The first pause; it doubles each time.
const PAUSE: DurationNs = DurationNs::from_secs(1);

/// The longest one.
const PAUSE_MAX: DurationNs = DurationNs::from_secs(64);

/// How often a device has fallen out since it was sound.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Relapse {
    operational_since: Option<MonotonicTime>,
    count: u32,
    until: Option<MonotonicTime>,
}

impl Relapse {
    /// The device is in operation.
    pub fn operational(&mut self, now: MonotonicTime) {
        self.operational_since = Some(now);
    }

    /// It has fallen out: how often in a row, and how long it is left alone then; `None` for not at all.
    pub fn count(&mut self, now: MonotonicTime) -> Option<(u32, DurationNs)> {
        let sound = self.operational_since.take().is_some_and(|since| now.since(since) >= SOUND);
        self.count = if sound { 1 } else { self.count.saturating_add(1) };
        let doublings = self.count.checked_sub(AT_ONCE + 1)?;
        let pause = (0..doublings.min(16)).fold(PAUSE, |pause, _| (pause * 2).min(PAUSE_MAX));
        self.until = Some(now + pause);
        Some((self.count, pause))
    }

    /// Until when it is left alone.
    pub fn until(&self, now: MonotonicTime) -> Option<MonotonicTime> {
        self.until.filter(|until| now < *until)
    }

    /// Somebody wants it tried again, or the master begins anew.
    pub fn forget(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(seconds: i64) -> DurationNs {
        DurationNs::from_secs(seconds)
    }

    #[test]
    fn pauses_double_and_a_sound_device_begins_anew() {
        let (mut relapse, mut now) = (Relapse::default(), MonotonicTime(1));
        let mut out = |after: DurationNs, now: &mut MonotonicTime| {
            relapse.operational(*now);
            *now = *now + after;
            relapse.count(*now)
        };
        let all: Vec<_> = (0..10).map(|_| out(seconds(9), &mut now)).collect();
        let pauses = [1, 2, 4, 8, 16, 32, 64, 64].map(seconds);
        let expected = pauses.iter().zip(3..).map(|(pause, count)| Some((count, *pause)));
        assert_eq!(all, [None, None].into_iter().chain(expected).collect::<Vec<_>>());
        assert_eq!(out(seconds(10), &mut now), None, "it was sound");
        assert_eq!((out(seconds(1), &mut now), out(seconds(1), &mut now)), (None, Some((3, seconds(1)))));
        assert_eq!(relapse.until(now), Some(now + seconds(1)));
        assert_eq!(relapse.until(now + seconds(1)), None);
        // It never came into operation in between.
        assert_eq!(relapse.count(now + seconds(100)), Some((4, seconds(2))));
        relapse.forget();
        assert_eq!((relapse.until(now), relapse.count(now)), (None, None));
    }
}
