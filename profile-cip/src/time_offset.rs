//! System Time Offset Compensation, clause 2-2: makes the time stamps of the other side comparable with the system time of this one
//! while a step of the master clock travels through the network. Both roles have it: the device for the stamps of the
//! controller (2-1.2), the controller for those of the device (2-1.3).
//!
//! ```text
//! compensated = received + variance - phase correction
//! variance    = (own offset - last) - (offset of the other side - last) [+ phase not yet corrected]
//! ```
//!
//! Clause 2-2.1 adds the compensation, and its Table 2-2.2 shows -1000 for a controller that is 1000 ahead. When the
//! offsets have changed by no more than the step threshold they become the new reference and the remaining variance
//! is worked off by a thousandth of the update period per update (clause 2-2.2); beyond it the references are held.
//!
//! The clause wants uncorrected phase carried into what comes next. Its listing computes it only in an update without a change,
//! and so loses it where offsets change in two updates in a row, and through a step of the master. Here it is kept with the
//! references: the compensation is always what the offsets have changed since then, and the phase that was uncorrected then.

/// State of the compensation. All values in ns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct OffsetCompensation {
    reference: Option<Offsets>,
    current: Offsets,
    /// Phase that is not corrected yet, of the time before the references.
    phase_remaining: i64,
    /// What is added to a time stamp.
    compensation: i64,
    step: bool,
}

/// System time offsets of both sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Offsets {
    /// System Time Offset of this side.
    pub own: i64,
    /// The one that the other side has sent with its time stamps.
    pub peer: i64,
}

impl OffsetCompensation {
    /// Takes `offsets` as the reference: both clocks are known to agree now (Group_Sync).
    pub fn synchronize(&mut self, offsets: Offsets) {
        *self = Self { reference: Some(offsets), current: offsets, ..Self::default() };
    }

    /// Takes the offsets of an update and works off one period of phase. `step_threshold` and `period` in ns.
    pub fn update(&mut self, offsets: Offsets, step_threshold: i64, period: i64) {
        let Some(reference) = self.reference else {
            self.synchronize(offsets);
            return;
        };
        if offsets != self.current {
            self.current = offsets;
            let own = offsets.own.saturating_sub(reference.own);
            let peer = offsets.peer.saturating_sub(reference.peer);
            let variance = own.saturating_sub(peer).saturating_add(self.phase_remaining);
            self.compensation = variance;
            self.step = variance.saturating_abs() > step_threshold;
            if !self.step {
                self.reference = Some(offsets);
                self.phase_remaining = variance;
            }
        } else if !self.step {
            let pace = (period / 1000).max(1);
            self.phase_remaining -= self.phase_remaining.clamp(-pace, pace);
            self.compensation = self.phase_remaining;
        }
    }

    /// A time stamp of the other side in the system time of this one, ns.
    #[must_use]
    pub fn compensate(&self, time_stamp: u64) -> u64 {
        time_stamp.saturating_add_signed(self.compensation)
    }

    /// Forgets the reference: the connection is gone.
    pub fn reset(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rows of Table 2-2.2 (Table 25 of IEC 61800-7-202) with all of their columns, whose master is that of Table 2-2.1: its
    /// time steps by 1000 in interval 2, the source learns of it in interval 3 and the destination in interval 4.
    #[test]
    fn a_step_of_the_master_follows_table_2_2_2() {
        struct Side {
            local: i64,
            offset: i64,
            last: i64,
            time: u64,
        }
        let side = |local, offset, last, time| Side { local, offset, last, time };
        // Master time; the controller, with its time stamp; the drive; offset compensation, adjusted time stamp.
        let rows = [
            (100, side(0, 100, 100, 100), 100, side(0, 100, 100, 100), 0, 100),
            (200, side(100, 100, 100, 200), 200, side(100, 100, 100, 200), 0, 200),
            (1300, side(200, 1100, 100, 1300), 1300, side(200, 100, 100, 300), -1000, 300),
            (1400, side(300, 1100, 100, 1400), 1400, side(300, 1100, 100, 1400), 0, 1400),
            (1500, side(400, 1100, 1100, 1500), 1500, side(400, 1100, 1100, 1500), 0, 1500),
        ];
        let mut compensation = OffsetCompensation::default();
        for (interval, (master, controller, time_stamp, drive, offset_comp, adjusted)) in (1..).zip(rows) {
            for known in [&controller, &drive] {
                assert_eq!(known.time, known.local.saturating_add(known.offset).unsigned_abs(), "{interval}");
            }
            assert_eq!(
                controller.time.max(drive.time),
                master,
                "{interval}: whoever knows has the master's time"
            );
            if let Some(last) = compensation.reference {
                assert_eq!((last.peer, last.own), (controller.last, drive.last), "{interval}");
            }
            let offsets = Offsets { own: drive.offset, peer: controller.offset };
            compensation.update(offsets, 500, 1000);
            let found = compensation.compensate(time_stamp);
            assert_eq!(
                (found, found),
                (adjusted, time_stamp.saturating_add_signed(offset_comp)),
                "{interval}"
            );
            assert_eq!(found, drive.time, "{interval}: it is the drive's own time");
        }
    }

    /// The other order, of which clause 2-2.1 says that the algorithm handles it as well.
    #[test]
    fn a_step_that_the_device_sees_first_is_held_until_the_controller_has_seen_it() {
        let rows = [
            (100, 100, 100, 100),
            (100, 300, 1100, 1300),
            (100, 350, 1100, 1350),
            (1100, 1400, 1100, 1400),
            (1100, 1500, 1100, 1500),
        ];
        let mut compensation = OffsetCompensation::default();
        for (controller, time_stamp, device, adjusted) in rows {
            compensation.update(Offsets { own: device, peer: controller }, 500, 1000);
            assert_eq!(compensation.compensate(time_stamp), adjusted, "time stamp {time_stamp}");
        }
    }

    /// Clause 2-2.2: 1 us of correction in a millisecond, so that 100 us take 100 ms and 1 ms takes a Sync interval of a second,
    /// whatever the update period.
    #[test]
    fn a_frequency_step_is_worked_off_at_a_microsecond_in_a_millisecond() {
        for period in [500_000, 1_000_000, 2_000_000, 8_000_000_i64] {
            for phase in [100_000, -100_000, 1_000_000, -1_000_000_i64] {
                let mut compensation = OffsetCompensation::default();
                compensation.update(Offsets::default(), 1_000_000, period);
                let changed = Offsets { own: phase, peer: 0 };
                compensation.update(changed, 1_000_000, period);
                let left = |known: &OffsetCompensation| known.compensate(1 << 40).cast_signed() - (1 << 40);
                assert_eq!(left(&compensation), phase, "no step of the stamps");
                let mut passed = 0;
                while left(&compensation) != 0 {
                    let before = left(&compensation);
                    compensation.update(changed, 1_000_000, period);
                    passed += period;
                    assert!((before - left(&compensation)).abs() <= period / 1000);
                }
                let whole = u64::try_from(period).expect("some ns");
                assert_eq!(
                    passed.unsigned_abs(),
                    (phase.unsigned_abs() * 1000).next_multiple_of(whole),
                    "{phase}"
                );
            }
        }
    }

    /// What is not corrected yet is carried on (clause 2-2.2), whatever comes between. The listing of the clause loses it in two
    /// cases: where offsets change in two updates in a row, and where a step of the master comes amid a correction.
    #[test]
    fn no_phase_is_lost_between_two_changes() {
        let (threshold, period) = (1_000_000, 1_000_000);
        let at =
            |compensation: &OffsetCompensation| compensation.compensate(1 << 40).cast_signed() - (1 << 40);
        // The controller learns of another master 900 us away, and the device does in the next update.
        let mut compensation = OffsetCompensation::default();
        compensation.update(Offsets::default(), threshold, period);
        compensation.update(Offsets { own: 0, peer: 900_000 }, threshold, period);
        assert_eq!(at(&compensation), -900_000);
        compensation.update(Offsets { own: 900_000, peer: 900_000 }, threshold, period);
        assert_eq!(at(&compensation), 0, "their clocks agree again");
        // A step of 10 ms while 300 us are left of a change before.
        let mut compensation = OffsetCompensation::default();
        compensation.update(Offsets::default(), threshold, period);
        compensation.update(Offsets { own: 301_000, peer: 0 }, threshold, period);
        compensation.update(Offsets { own: 301_000, peer: 0 }, threshold, period);
        assert_eq!(at(&compensation), 300_000);
        compensation.update(Offsets { own: 301_000, peer: 10_000_000 }, threshold, period);
        assert_eq!(at(&compensation), 300_000 - 10_000_000);
        compensation.update(Offsets { own: 10_301_000, peer: 10_000_000 }, threshold, period);
        assert_eq!(at(&compensation), 300_000, "as before the step");
        compensation.update(Offsets { own: 10_301_000, peer: 10_000_000 }, threshold, period);
        assert_eq!(at(&compensation), 299_000, "and it goes on");
    }

    #[test]
    fn a_small_change_is_worked_off_a_thousandth_of_the_period_at_a_time() {
        let mut compensation = OffsetCompensation::default();
        let (threshold, period) = (1_000_000, 2_000_000);
        compensation.update(Offsets { own: 0, peer: 0 }, threshold, period);
        let changed = Offsets { own: 5_000, peer: 0 };
        compensation.update(changed, threshold, period);
        assert_eq!(compensation.compensate(1_000_000), 1_005_000);
        for expected in [1_003_000, 1_001_000, 1_000_000, 1_000_000] {
            compensation.update(changed, threshold, period);
            assert_eq!(compensation.compensate(1_000_000), expected);
        }
    }

    #[test]
    fn phase_that_is_left_is_carried_into_the_next_change() {
        let mut compensation = OffsetCompensation::default();
        let (threshold, period) = (1_000_000, 1_000_000);
        compensation.update(Offsets::default(), threshold, period);
        compensation.update(Offsets { own: -4_000, peer: 0 }, threshold, period);
        compensation.update(Offsets { own: -4_000, peer: 0 }, threshold, period);
        assert_eq!(compensation.compensate(0x10_0000), 0x10_0000 - 3_000);
        compensation.update(Offsets { own: -6_000, peer: 0 }, threshold, period);
        assert_eq!(compensation.compensate(0x10_0000), 0x10_0000 - 5_000);
    }

    #[test]
    fn extreme_offsets_do_not_overflow() {
        let mut compensation = OffsetCompensation::default();
        compensation.update(Offsets { own: i64::MIN, peer: i64::MAX }, 1, 1);
        compensation.update(Offsets { own: i64::MAX, peer: i64::MIN }, 1, 1);
        assert_eq!(compensation.compensate(5), 5_u64.saturating_add_signed(i64::MAX));
    }
}
