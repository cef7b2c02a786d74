//! When a bus is brought up anew: after a phase-up that failed, and for a drive that is missing.

use profile_generic::time::{DurationNs, MonotonicTime};

/// Pause before the bus is brought up anew for a lost drive while nobody uses the others; it doubles with every vain
/// attempt.
const RESCAN_PAUSE: DurationNs = DurationNs::from_secs(10);

/// Longest pause of either kind.
const PAUSE_MAX: DurationNs = DurationNs::from_secs(320);

/// Pause before a failed phase-up is tried again; it doubles while a drive is refused that only another configuration can help.
const RETRY_PAUSE: DurationNs = DurationNs::from_secs(2);

/// Which drives a bus is without that cannot come later.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Missing {
    None,
    /// One that was not found.
    Absent,
    /// One that was found, and lost or left out: what was wrong may have been read wrongly, or is over.
    LeftOut,
}

/// What the bus does about drives that are missing.
#[derive(Debug)]
pub(super) struct Recovery {
    retry_at: Option<MonotonicTime>,
    retry_pause: DurationNs,
    /// Since when a drive is missing that was there.
    lost_since: Option<MonotonicTime>,
    rescan_pause: DurationNs,
    /// A slave hangs and was left out. Phase 0 cannot get past it: a new scan would find nobody.
    isolated: bool,
    /// No controller is connected.
    idle: bool,
    /// The bus goes down because the box wants it to: that is no fault of any axis.
    planned: bool,
    /// The box ends: the bus stays down.
    ended: bool,
}

impl Recovery {
    /// Of a bus on which nothing is missing.
    pub(super) const fn new() -> Self {
        Self {
            retry_at: None,
            retry_pause: RETRY_PAUSE,
            lost_since: None,
            rescan_pause: RESCAN_PAUSE,
            isolated: false,
            idle: true,
            planned: false,
            ended: false,
        }
    }

    /// Whether the bus goes down without a fault.
    pub(super) const fn is_planned(&self) -> bool {
        self.planned
    }

    /// Whether a controller is connected: then a bus that works is not taken down.
    pub(super) const fn set_idle(&mut self, idle: bool) {
        self.idle = idle;
    }

    /// The bus gives way to another master.
    pub(super) const fn give_way(&mut self) {
        self.planned = true;
    }

    /// The box ends.
    pub(super) const fn end(&mut self) {
        self.ended = true;
    }

    /// A drive is missing that only a new scan brings back.
    pub(super) fn miss(&mut self, now: MonotonicTime) {
        self.lost_since.get_or_insert(now);
    }

    /// All drives are heard again.
    pub(super) const fn find_all(&mut self) {
        self.lost_since = None;
    }

    /// A drive has come by hot plug, and none is missing.
    pub(super) const fn complete(&mut self) {
        (self.lost_since, self.rescan_pause) = (None, RESCAN_PAUSE);
    }

    /// A slave that hangs was left out.
    pub(super) const fn isolate(&mut self) {
        self.isolated = true;
    }

    /// Phase 0 has begun: the scan can pass every slave that is left.
    pub(super) const fn begin_scan(&mut self) {
        self.isolated = false;
    }

    /// The bus is in CP4, with all drives or without some.
    pub(super) fn reach_cp4(&mut self, now: MonotonicTime, missing: Missing) {
        self.planned = false;
        self.retry_pause = RETRY_PAUSE;
        match missing {
            Missing::None => self.rescan_pause = RESCAN_PAUSE,
            Missing::LeftOut => self.lost_since = Some(now),
            // It was there once and is missing after a new scan: it is looked for again, ever more rarely.
            Missing::Absent if self.rescan_pause > RESCAN_PAUSE => self.lost_since = Some(now),
            Missing::Absent => {}
        }
    }

    /// Whether a bus that works is to be brought up anew for a drive that is missing.
    pub(super) fn wants_scan(&self, now: MonotonicTime) -> bool {
        let missing = |since| now.since(since) > self.rescan_pause;
        self.idle && !self.isolated && self.lost_since.is_some_and(missing)
    }

    /// The bus is taken down for a new scan: because all drives are lost, or as planned.
    pub(super) fn take_down(&mut self, planned: bool) {
        self.lost_since = None;
        self.planned = planned;
        self.rescan_pause = (self.rescan_pause * 2).min(PAUSE_MAX);
    }

    /// Whether a bus that is down is to be brought up now; `unfit` says whether a drive was refused for what it is.
    pub(super) fn wants_up(&mut self, now: MonotonicTime, unfit: bool) -> bool {
        if self.ended || now < *self.retry_at.get_or_insert(now + self.retry_pause) {
            return false;
        }
        self.retry_at = None;
        if unfit {
            self.retry_pause = (self.retry_pause * 2).min(PAUSE_MAX);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: MonotonicTime = MonotonicTime(1_000_000_000);

    fn s(seconds: i64) -> MonotonicTime {
        NOW + DurationNs::from_secs(seconds)
    }

    /// Seconds until the bus is to be brought up.
    fn up_after(recovery: &mut Recovery, from: i64, unfit: bool) -> i64 {
        (from..from + 1_000).find(|second| recovery.wants_up(s(*second), unfit)).unwrap() - from
    }

    #[test]
    fn a_failed_phase_up_is_tried_again_ever_more_rarely_while_a_drive_is_unfit() {
        let mut recovery = Recovery::new();
        let unfit: Vec<_> = (0..10).map(|_| up_after(&mut recovery, 0, true)).collect();
        assert_eq!(unfit, [2, 4, 8, 16, 32, 64, 128, 256, 320, 320]);
        recovery.reach_cp4(NOW, Missing::None);
        assert_eq!((0..3).map(|_| up_after(&mut recovery, 0, false)).collect::<Vec<_>>(), [2, 2, 2]);
        recovery.end();
        assert!(!recovery.wants_up(MonotonicTime::MAX, false), "the box ends");
    }

    #[test]
    fn a_missing_drive_is_looked_for_only_while_no_controller_is_connected() {
        let mut recovery = Recovery::new();
        assert!(!recovery.wants_scan(MonotonicTime::MAX), "nothing is missing");
        recovery.miss(NOW);
        recovery.miss(s(5));
        assert!(!recovery.wants_scan(s(10)) && recovery.wants_scan(s(11)), "since it went first");
        recovery.set_idle(false);
        assert!(!recovery.wants_scan(MonotonicTime::MAX));
        recovery.set_idle(true);
        recovery.isolate();
        assert!(!recovery.wants_scan(MonotonicTime::MAX), "the scan would find nobody");
        recovery.begin_scan();
        assert!(recovery.wants_scan(s(11)));
        recovery.find_all();
        assert!(!recovery.wants_scan(MonotonicTime::MAX));
    }

    #[test]
    fn a_drive_that_stays_away_costs_ever_fewer_scans() {
        let mut recovery = Recovery::new();
        recovery.miss(NOW);
        for seconds in [10, 20, 40, 80, 160, 320, 320] {
            assert!(!recovery.wants_scan(s(seconds)) && recovery.wants_scan(s(seconds + 1)), "{seconds}");
            recovery.take_down(true);
            assert!(recovery.is_planned());
            recovery.reach_cp4(NOW, Missing::Absent);
            assert!(!recovery.is_planned());
        }
        recovery.complete();
        assert!(!recovery.wants_scan(MonotonicTime::MAX));
        recovery.reach_cp4(NOW, Missing::Absent);
        assert!(!recovery.wants_scan(MonotonicTime::MAX), "one that never came is not looked for");
    }

    #[test]
    fn a_drive_that_was_found_and_left_out_is_tried_again_ever_more_rarely() {
        let mut recovery = Recovery::new();
        for seconds in [10, 20, 40, 80, 160, 320, 320] {
            recovery.reach_cp4(NOW, Missing::LeftOut);
            assert!(!recovery.wants_scan(s(seconds)) && recovery.wants_scan(s(seconds + 1)), "{seconds}");
            recovery.take_down(true);
        }
        recovery.reach_cp4(NOW, Missing::None);
        assert!(!recovery.wants_scan(MonotonicTime::MAX));
        recovery.reach_cp4(NOW, Missing::LeftOut);
        assert!(recovery.wants_scan(s(11)), "as soon as at first");
    }
}
