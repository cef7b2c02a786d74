//! The Controller Time Offset of the C-to-D header, clause 6-2.7.1.1.2.
//!
//! It is sent until the device has confirmed an update that carried it, and again after a step of system
//! time.

use profile_generic::time::DurationNs;

/// Change of the measured offset that is told to the device: the default Step Threshold of the object. A change below may be one that
/// the clock is slewed by. A step that the clock reports is told whatever its size.
const OFFSET_STEP: DurationNs = DurationNs::from_millis(1);

/// System time less local clock.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct TimeOffset {
    /// Told to the device, with the first update ID that carried it.
    told: Option<(i64, u8)>,
    /// Whether the device has confirmed an update that carried it.
    confirmed: bool,
    /// A new value waits for a second measurement, as one alone may be an interruption between two clocks.
    candidate: Option<i64>,
    /// Steps of the clock that are not told yet.
    stepped: i64,
}

impl TimeOffset {
    /// Takes the difference of the clocks; gives the value to be sent in update `update_id`, if any.
    pub fn measure(&mut self, offset: i64, update_id: u8) -> Option<i64> {
        let stepped = core::mem::take(&mut self.stepped);
        let before = self.told;
        let (mut told, _) = *self.told.get_or_insert((offset, update_id));
        if before.is_some() && stepped != 0 {
            told = told.saturating_add(stepped);
            self.told = Some((told, update_id));
            self.confirmed = false;
        }
        let steps = |a: i64, b: i64| a.abs_diff(b) > OFFSET_STEP.magnitude();
        if !steps(offset, told) {
            self.candidate = None;
        } else if self.candidate.replace(offset).is_some_and(|candidate| !steps(offset, candidate)) {
            self.told = Some((offset, update_id));
            self.confirmed = false;
            self.candidate = None;
        }
        self.told.filter(|_| !self.confirmed).map(|(offset, _)| offset)
    }

    /// System time has stepped by so much; from the next measurement on it is in the offset.
    pub fn step(&mut self, by: DurationNs) {
        self.stepped = self.stepped.saturating_add(by.0);
    }

    /// The device has processed our update `update_id`.
    pub fn handle_received(&mut self, update_id: u8) {
        if let Some((_, first)) = self.told
            && update_id.wrapping_sub(first) <= u8::MAX / 2
        {
            self.confirmed = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOUR: i64 = 3_600_000_000_000;

    #[test]
    fn the_offset_is_sent_until_confirmed_and_after_a_step() {
        let mut offset = TimeOffset::default();
        assert_eq!(offset.measure(HOUR, 254), Some(HOUR));
        assert_eq!(offset.measure(HOUR + 900, 255), Some(HOUR), "what was told stays");
        offset.handle_received(253);
        assert_eq!(offset.measure(HOUR, 0), Some(HOUR), "the device had not seen it yet");
        offset.handle_received(254);
        assert_eq!(offset.measure(HOUR, 1), None);
        assert_eq!(offset.measure(2 * HOUR, 2), None, "one measurement alone may be an interruption");
        assert_eq!(offset.measure(HOUR, 3), None);
        assert_eq!(offset.measure(2 * HOUR, 4), None);
        assert_eq!(offset.measure(2 * HOUR, 5), Some(2 * HOUR));
        offset.handle_received(4);
        assert_eq!(offset.measure(2 * HOUR, 6), Some(2 * HOUR));
        offset.handle_received(5);
        assert_eq!(offset.measure(2 * HOUR, 7), None);
    }

    #[test]
    fn a_step_that_the_clock_reports_is_told_with_the_first_stamp_that_has_it() {
        let mut offset = TimeOffset::default();
        offset.step(DurationNs(5));
        assert_eq!(offset.measure(HOUR, 0), Some(HOUR), "the first one has it already");
        offset.handle_received(0);
        assert_eq!(offset.measure(HOUR + 70_000, 1), None, "the clock was slewed");
        offset.step(DurationNs::from_micros(260));
        assert_eq!(offset.measure(HOUR + 330_000, 2), Some(HOUR + 260_000), "the step, and not the slew");
        offset.handle_received(1);
        assert_eq!(offset.measure(HOUR + 330_000, 3), Some(HOUR + 260_000));
        offset.handle_received(2);
        assert_eq!(offset.measure(HOUR + 330_000, 4), None);
        offset.step(DurationNs::from_millis(10));
        assert_eq!(offset.measure(HOUR + 10_330_000, 5), Some(HOUR + 10_260_000), "at once");
    }
}
