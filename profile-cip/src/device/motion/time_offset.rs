//! System Time Offset Compensation, clause 2-2: makes the controller's time stamps comparable with the device's
//! system time while a step of the master clock travels through the network.
//!
//! ```text
//! compensated = received + variance - phase correction
//! variance    = (offset device - last) - (offset controller - last) [+ phase not yet corrected]
//! ```
//!
//! Clause 2-2.1 adds the compensation, and its Table 2-2.2 shows -1000 for a controller that is 1000 ahead. When the
//! offsets have changed by no more than the step threshold they become the new reference and the remaining variance
//! is worked off by a thousandth of the update period per update (clause 2-2.2); beyond it the references are held.

/// State of the compensation. All values in ns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct OffsetCompensation {
    reference: Option<Offsets>,
    current: Offsets,
    variance: i64,
    phase_correction: i64,
    phase_remaining: i64,
    step: bool,
}

/// System time offsets of both sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Offsets {
    /// System Time Offset of this device.
    pub device: i64,
    /// Controller Time Offset as received.
    pub controller: i64,
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
            let device = offsets.device.saturating_sub(reference.device);
            let controller = offsets.controller.saturating_sub(reference.controller);
            self.variance = device.saturating_sub(controller).saturating_add(self.phase_remaining);
            self.phase_correction = 0;
            self.phase_remaining = 0;
            self.step = self.variance.saturating_abs() > step_threshold;
            if !self.step {
                self.reference = Some(offsets);
            }
        } else if !self.step {
            let pace = (period / 1000).max(1);
            let left = self.variance.saturating_sub(self.phase_correction);
            self.phase_correction = self.phase_correction.saturating_add(left.clamp(-pace, pace));
            self.phase_remaining = self.variance.saturating_sub(self.phase_correction);
        }
    }

    /// A time stamp of the controller in this device's system time, ns.
    #[must_use]
    pub fn compensate(&self, time_stamp: u64) -> u64 {
        time_stamp.saturating_add_signed(self.variance.saturating_sub(self.phase_correction))
    }

    /// Forgets the reference: the connection is gone.
    pub fn reset(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_of_the_master_follows_table_2_2_2() {
        // Columns: controller offset, its time stamp, device offset, adjusted time stamp.
        let rows = [
            (100, 100, 100, 100),
            (100, 200, 100, 200),
            (1100, 1300, 100, 300),
            (1100, 1400, 1100, 1400),
            (1100, 1500, 1100, 1500),
        ];
        let mut compensation = OffsetCompensation::default();
        for (controller, time_stamp, device, adjusted) in rows {
            compensation.update(Offsets { device, controller }, 500, 1000);
            assert_eq!(compensation.compensate(time_stamp), adjusted, "time stamp {time_stamp}");
        }
    }

    #[test]
    fn a_small_change_is_worked_off_a_thousandth_of_the_period_at_a_time() {
        let mut compensation = OffsetCompensation::default();
        let (threshold, period) = (1_000_000, 2_000_000);
        compensation.update(Offsets { device: 0, controller: 0 }, threshold, period);
        let changed = Offsets { device: 5_000, controller: 0 };
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
        compensation.update(Offsets { device: -4_000, controller: 0 }, threshold, period);
        compensation.update(Offsets { device: -4_000, controller: 0 }, threshold, period);
        assert_eq!(compensation.compensate(0x10_0000), 0x10_0000 - 3_000);
        compensation.update(Offsets { device: -6_000, controller: 0 }, threshold, period);
        assert_eq!(compensation.compensate(0x10_0000), 0x10_0000 - 5_000);
    }

    #[test]
    fn extreme_offsets_do_not_overflow() {
        let mut compensation = OffsetCompensation::default();
        compensation.update(Offsets { device: i64::MIN, controller: i64::MAX }, 1, 1);
        compensation.update(Offsets { device: i64::MAX, controller: i64::MIN }, 1, 1);
        assert_eq!(compensation.compensate(5), 5_u64.saturating_add_signed(i64::MAX));
    }
}
