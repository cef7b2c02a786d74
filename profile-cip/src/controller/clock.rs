//! The controller's system time: its line over the local clock, the Controller Time Offset of the C-to-D header (clause
//! 6-2.7.1.1.2), and the device's time stamps in it.
//!
//! ```text
//! system time = local clock + Controller Time Offset
//! ```
//!
//! As in the device, small differences between the caller's two clocks go into the rate of the local clock and larger ones are
//! steps ([`TimeBase`]). A step changes the time stamps and the offset in one and the same update: a device that sees one without
//! the other takes it for motion. The offset is sent until the device has confirmed an update that carried it, and again after
//! each step.

use crate::reported::Reported;
use crate::time_offset::{OffsetCompensation, Offsets};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_generic::time_base::{TimeBase, TimeSample};

/// Step Threshold of the compensation: the default of the object.
const STEP_THRESHOLD_NS: i64 = 1_000_000;

/// System time of the controller, and what both sides know of each other's.
#[derive(Debug, Clone, Default)]
pub(super) struct Clock {
    /// `None` before the first sample.
    base: Option<TimeBase>,
    /// When the clocks were read last.
    read_at: Option<MonotonicTime>,
    /// The offset on its way to the device.
    reported: Reported<i64>,
    /// Device Time Offset as received last.
    device: i64,
    compensation: OffsetCompensation,
}

impl Clock {
    /// The connection is a new one: nothing is known of the device's clock, nor does it know of ours.
    pub fn reconnect(&mut self) {
        *self = Self { base: self.base, read_at: self.read_at, ..Self::default() };
    }

    /// Takes what the clocks of the caller show at the same instant. The same reading again is no second one.
    pub fn feed(&mut self, now: MonotonicTime, system: SystemTime) {
        if self.read_at.replace(now) == Some(now) {
            return;
        }
        let sample = TimeSample { at: now, system, rate_ppb: 0 };
        match &mut self.base {
            Some(base) => {
                base.feed(&sample);
            }
            None => self.base = Some(TimeBase::new(sample)),
        }
    }

    /// System time at an instant of the local clock.
    pub fn system_at(&self, at: MonotonicTime) -> SystemTime {
        self.base.map_or(SystemTime::ZERO, |base| base.system_at(at))
    }

    /// A system time on the local clock: nothing that is measured by it sees a step.
    pub fn to_local(&self, system: SystemTime) -> SystemTime {
        SystemTime(system.0.wrapping_sub(self.offset().cast_unsigned()))
    }

    fn offset(&self) -> i64 {
        self.base.map_or(0, |base| base.offset().as_nanos())
    }

    /// Controller Time Offset if it is to be put into update `update_id`.
    pub fn due(&mut self, update_id: u8) -> Option<i64> {
        self.reported.due(self.offset(), update_id)
    }

    /// The device has processed our update `update_id`.
    pub fn handle_received(&mut self, update_id: u8) {
        self.reported.acknowledge(update_id);
    }

    fn offsets(&self) -> Offsets {
        Offsets { own: self.offset(), peer: self.device }
    }

    /// The device is synchronized by Group_Sync: both clocks agree now (clause 5-2.4.1.1).
    pub fn synchronize(&mut self) {
        self.compensation.synchronize(self.offsets());
    }

    /// The time stamp of a D-to-C update, and its offset if it has one, in the system time of the controller (System Time Offset
    /// Check, clause 2-1.3).
    pub fn compensate(&mut self, stamp: SystemTime, offset: Option<i64>, period: DurationNs) -> SystemTime {
        self.device = offset.unwrap_or(self.device);
        self.compensation.update(self.offsets(), STEP_THRESHOLD_NS, period.as_nanos());
        SystemTime(self.compensation.compensate(stamp.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOUR: i64 = 3_600_000_000_000;
    const PERIOD: DurationNs = DurationNs::from_millis(2);

    fn at(periods: i64) -> MonotonicTime {
        MonotonicTime(7_000_000_000) + PERIOD * periods
    }

    fn system(periods: i64, ahead: i64) -> SystemTime {
        SystemTime(at(periods).0) + DurationNs(ahead)
    }

    #[test]
    fn the_offset_is_sent_until_confirmed_and_after_a_step() {
        let mut clock = Clock::default();
        let measure = |clock: &mut Clock, period: i64, ahead: i64, id: u8| {
            clock.feed(at(period), system(period, ahead));
            clock.due(id)
        };
        assert_eq!(measure(&mut clock, 0, HOUR, 254), Some(HOUR));
        assert_eq!(measure(&mut clock, 1, HOUR + 900, 255), Some(HOUR), "what was reported stays");
        clock.handle_received(253);
        assert_eq!(measure(&mut clock, 2, HOUR, 0), Some(HOUR), "the device had not seen it yet");
        clock.handle_received(254);
        assert_eq!(measure(&mut clock, 3, HOUR, 1), None);
        assert_eq!(measure(&mut clock, 4, 2 * HOUR, 2), None, "one measurement alone may be an interruption");
        assert_eq!(measure(&mut clock, 5, HOUR, 3), None);
        assert_eq!(measure(&mut clock, 6, 2 * HOUR, 4), None);
        let before = clock.offset();
        let stepped = measure(&mut clock, 7, 2 * HOUR, 5).expect("a step");
        assert!((stepped - before - HOUR).abs() < 1_000, "{stepped}");
        clock.handle_received(4);
        assert_eq!(measure(&mut clock, 8, 2 * HOUR, 6), Some(stepped));
        clock.handle_received(5);
        assert_eq!(measure(&mut clock, 9, 2 * HOUR, 7), None);
    }

    /// The stamp of an update and the offset that it carries never disagree: their difference, the local clock, goes on evenly.
    #[test]
    fn a_step_is_in_stamp_and_offset_of_the_same_update() {
        for step in [150_000, -150_000, 900_000, 1_100_000, 10_000_000, -10_000_000, HOUR] {
            let mut clock = Clock::default();
            let mut local = None;
            let mut reported = 0;
            for period in 0..50_i64 {
                clock.feed(at(period), system(period, if period < 20 { 0 } else { step }));
                reported = clock.due(0).unwrap_or(reported);
                let now = clock.system_at(at(period)).0.wrapping_sub(reported.cast_unsigned());
                if let Some(before) = local.replace(now) {
                    assert_eq!(now - before, PERIOD.as_nanos().cast_unsigned(), "{step}: period {period}");
                }
            }
            assert_eq!(reported, step);
        }
    }

    #[test]
    fn stamps_of_a_device_that_has_not_seen_the_step_yet_are_compensated() {
        let mut clock = Clock::default();
        clock.feed(at(0), system(0, 0));
        clock.compensate(system(0, 0), Some(0), PERIOD);
        clock.synchronize();
        for period in 1..=2 {
            clock.feed(at(period), system(period, HOUR));
        }
        assert_eq!(clock.compensate(system(2, 0), None, PERIOD), system(2, HOUR));
        assert_eq!(clock.to_local(clock.system_at(at(2))), system(2, 0));
        assert_eq!(clock.compensate(system(3, HOUR), Some(HOUR), PERIOD), system(3, HOUR), "now it has");
    }
}
