//! System time over the local clock, as the devices see it.

use profile_cip::device::motion_device::SyncState;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_generic::time_base::{TimeBase, TimeSample};

/// The time base, and whether it can be trusted.
#[derive(Debug)]
pub(super) struct Clock {
    pub base: TimeBase,
    /// The time base has taken a sample.
    is_set: bool,
    sync: SyncState,
}

impl Default for Clock {
    fn default() -> Self {
        let never = TimeSample { at: MonotonicTime::ZERO, system: SystemTime::ZERO, rate_ppb: 0 };
        Self { base: TimeBase::new(never), is_set: false, sync: SyncState::default() }
    }
}

impl Clock {
    /// Sets whether system time can be trusted. Returns what the devices are told, with the offset of the time base.
    pub fn set_sync(&mut self, sync: SyncState) -> SyncState {
        self.sync = SyncState { offset: self.base.offset().as_nanos(), ..sync };
        self.sync
    }

    /// The time base while the time of the network is proven.
    pub fn trusted(&self) -> Option<&TimeBase> {
        (self.is_set && self.sync.synchronized).then_some(&self.base)
    }

    /// Takes a sample of system time. Returns the step, if it is one, and what the devices are told if the offset has changed.
    pub fn feed(&mut self, sample: &TimeSample) -> (Option<DurationNs>, Option<SyncState>) {
        let step = if std::mem::replace(&mut self.is_set, true) {
            self.base.feed(sample)
        } else {
            self.base = TimeBase::new(*sample);
            None
        };
        let moved = self.base.offset().as_nanos() != self.sync.offset;
        (step, moved.then(|| self.set_sync(self.sync)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(at_ms: i64, system_ms: u64) -> TimeSample {
        let at = MonotonicTime::ZERO + DurationNs::from_millis(at_ms);
        TimeSample { at, system: SystemTime(system_ms * 1_000_000), rate_ppb: 0 }
    }

    #[test]
    fn first_sample_is_no_step_and_a_later_jump_is() {
        let mut clock = Clock::default();
        let (step, sync) = clock.feed(&sample(10, 1_000_010));
        assert_eq!((step, sync.map(|sync| sync.offset)), (None, Some(1_000_000_000_000)));
        assert_eq!(clock.feed(&sample(20, 1_000_020)), (None, None));
        assert_eq!(clock.feed(&sample(30, 1_003_030)), (None, None), "one sample alone may be wrong");
        let (step, sync) = clock.feed(&sample(40, 1_003_040));
        assert_eq!(step, Some(DurationNs::from_secs(3)));
        assert_eq!(sync.map(|sync| sync.offset), Some(1_003_000_000_000));
    }

    #[test]
    fn time_is_trusted_once_there_is_a_sample_and_while_it_is_synchronized() {
        let mut clock = Clock::default();
        let synchronized = |synchronized| SyncState { synchronized, ..SyncState::default() };
        clock.set_sync(synchronized(true));
        assert!(clock.trusted().is_none(), "no sample");
        clock.feed(&sample(0, 5_000));
        assert_eq!(
            clock.trusted().map(|base| base.system_at(MonotonicTime::ZERO)),
            Some(SystemTime(5_000_000_000))
        );
        clock.set_sync(synchronized(false));
        assert!(clock.trusted().is_none());
    }

    #[test]
    fn devices_get_the_offset_of_the_time_base_whatever_the_source_says() {
        let mut clock = Clock::default();
        clock.feed(&sample(0, 5_000));
        let sync = clock.set_sync(SyncState { offset: 7, ..SyncState::default() });
        assert_eq!(sync.offset, 5_000_000_000);
    }
}
