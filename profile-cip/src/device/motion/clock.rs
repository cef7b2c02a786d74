//! System time of the device and the controller's time stamps in it.

use crate::device::motion_link::{SyncQuality, SyncState};
use crate::reported::Reported;
use crate::time_offset::{OffsetCompensation, Offsets};
use crate::wire::motion::codes::SyncStatus;
use crate::wire::motion::id_list::parse_group_sync;
use crate::wire::status::GeneralStatus;

/// The clocks of device and controller.
#[derive(Default)]
pub(super) struct Clock {
    sync: SyncState,
    quality: SyncQuality,
    compensation: OffsetCompensation,
    reported_offset: Reported<i64>,
}

impl Clock {
    /// A connection begins or ends: nothing is known of the controller's clock.
    pub fn start_over(&mut self) {
        self.compensation.reset();
        self.reported_offset = Reported::new();
    }

    /// Takes the state of the device's clock. Returns by how much the offset has stepped, ns.
    pub fn set(&mut self, sync: SyncState) -> i64 {
        let step = sync.offset.saturating_sub(self.sync.offset);
        self.sync = sync;
        step
    }

    pub fn is_synchronized(&self) -> bool {
        self.sync.synchronized
    }

    pub fn set_quality(&mut self, quality: SyncQuality) {
        self.quality = quality;
    }

    pub fn quality(&self) -> SyncQuality {
        self.quality
    }

    /// A system time on the local clock, so that a step of the device's own is none of the controller's.
    pub fn to_local(&self, system_time: u64) -> u64 {
        system_time.wrapping_sub(self.sync.offset.cast_unsigned())
    }

    fn offsets(&self, controller: u64) -> Offsets {
        Offsets { own: self.sync.offset, peer: controller.cast_signed() }
    }

    /// A time-stamped update has come. `controller` is the Controller Time Offset, `period` the update period, both in ns.
    pub fn update(&mut self, controller: u64, step_threshold: i64, period: u64) {
        let period = i64::try_from(period).unwrap_or(i64::MAX);
        self.compensation.update(self.offsets(controller), step_threshold, period);
    }

    /// A time stamp of the controller in the device's system time, ns.
    pub fn compensate(&self, time_stamp: u64) -> u64 {
        self.compensation.compensate(time_stamp)
    }

    /// Whether a stamp in the device's system time is of the future, or of more than two periods ago (clause 7-1.3).
    pub fn is_skewed(time_stamp: u64, period: u64, system_time: u64) -> bool {
        time_stamp.saturating_add(period).abs_diff(system_time) > period
    }

    /// Group_Sync, clause 5-2.4.1.1: same grand master, synchronized, no skew.
    ///
    /// The skew can only be judged by a time stamp of the controller: `received` of the last update, with its period. The
    /// example of clause 7-1.3 sends none before it; then Synchronous Control, which needs one, makes the judgement.
    pub fn group_sync(
        &mut self,
        body: &[u8],
        system_time: Option<u64>,
        received: Option<(Option<u64>, u64)>,
        controller: u64,
    ) -> (GeneralStatus, SyncStatus) {
        let grandmaster = match parse_group_sync(body) {
            Ok(id) => id,
            Err(error) if error.is_too_long() => {
                return (GeneralStatus::TOO_MUCH_DATA, SyncStatus::NOT_SYNCHRONIZED);
            }
            Err(_) => return (GeneralStatus::NOT_ENOUGH_DATA, SyncStatus::NOT_SYNCHRONIZED),
        };
        let status = match (self.sync.grandmaster, system_time) {
            (Some(ours), _) if ours != grandmaster => SyncStatus::DIFFERENT_GRANDMASTER,
            (Some(_), Some(system_time)) if self.sync.synchronized => Self::judge_skew(system_time, received),
            _ => SyncStatus::NOT_SYNCHRONIZED,
        };
        if status == SyncStatus::SYNCHRONIZED {
            self.compensation.synchronize(self.offsets(controller));
        }
        (GeneralStatus::SUCCESS, status)
    }

    /// The stamp counts as it came: with Group_Sync both clocks are to agree, and what was compensated before ends.
    fn judge_skew(system_time: u64, received: Option<(Option<u64>, u64)>) -> SyncStatus {
        let Some((time_stamp, period)) = received else { return SyncStatus::NOT_SYNCHRONIZED };
        let skewed = time_stamp.is_some_and(|stamp| Self::is_skewed(stamp, period, system_time));
        if skewed { SyncStatus::CLOCK_SKEW } else { SyncStatus::SYNCHRONIZED }
    }

    /// System Time Offset if it is to be put into update `update_id`.
    pub fn due(&mut self, update_id: u8) -> Option<i64> {
        self.reported_offset.due(self.sync.offset, update_id)
    }

    /// The controller has processed update `received`.
    pub fn acknowledge(&mut self, received: u8) {
        self.reported_offset.acknowledge(received);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: u64 = 1_000_000;

    /// A controller that connects before the device has any time: its first time is a step of years, which the compensation holds.
    #[test]
    fn device_that_gets_its_time_behind_the_connection_passes_group_sync() {
        let (epoch, now) = (1_700_000_000_000_000_000_u64, 50 * PERIOD);
        let mut clock = Clock::default();
        clock.set(SyncState { grandmaster: Some([7; 8]), synchronized: false, offset: 0 });
        clock.update(epoch, 1_000_000, PERIOD);
        clock.set(SyncState { grandmaster: Some([7; 8]), synchronized: true, offset: epoch.cast_signed() });
        clock.update(epoch, 1_000_000, PERIOD);
        let received = Some((Some(epoch + now - PERIOD), PERIOD));
        let (_, status) = clock.group_sync(&[7; 8], Some(epoch + now), received, epoch);
        assert_eq!(status, SyncStatus::SYNCHRONIZED);
        assert_eq!(clock.compensate(epoch + now), epoch + now, "and from then on stamps are what they are");
    }

    #[test]
    fn group_sync_needs_the_same_grandmaster_a_synchronized_clock_and_a_stamp_without_skew() {
        let sync = SyncState { grandmaster: Some([7; 8]), synchronized: true, offset: 0 };
        let (ours, other) = ([7_u8; 8], [8_u8; 8]);
        let now = 50 * PERIOD;
        let fresh = Some((Some(now - PERIOD), PERIOD));
        let rows = [
            (sync, &ours[..], Some(now), fresh, SyncStatus::SYNCHRONIZED),
            (sync, &ours[..], Some(now), Some((None, PERIOD)), SyncStatus::SYNCHRONIZED),
            (sync, &ours[..], Some(now), Some((Some(now - 3 * PERIOD), PERIOD)), SyncStatus::CLOCK_SKEW),
            (sync, &ours[..], Some(now), Some((Some(now + 1), PERIOD)), SyncStatus::CLOCK_SKEW),
            (sync, &ours[..], Some(now), None, SyncStatus::NOT_SYNCHRONIZED),
            (sync, &ours[..], None, fresh, SyncStatus::NOT_SYNCHRONIZED),
            (sync, &other[..], Some(now), fresh, SyncStatus::DIFFERENT_GRANDMASTER),
            (
                SyncState { synchronized: false, ..sync },
                &ours[..],
                Some(now),
                fresh,
                SyncStatus::NOT_SYNCHRONIZED,
            ),
            (
                SyncState { grandmaster: None, ..sync },
                &ours[..],
                Some(now),
                fresh,
                SyncStatus::NOT_SYNCHRONIZED,
            ),
        ];
        for (state, body, system_time, received, expected) in rows {
            let mut clock = Clock::default();
            clock.set(state);
            let found = clock.group_sync(body, system_time, received, 0);
            assert_eq!(found, (GeneralStatus::SUCCESS, expected), "{state:?} {body:?} {received:?}");
        }
        let mut clock = Clock::default();
        assert_eq!(clock.group_sync(&[7; 7], None, None, 0).0, GeneralStatus::NOT_ENOUGH_DATA);
        assert_eq!(clock.group_sync(&[7; 9], None, None, 0).0, GeneralStatus::TOO_MUCH_DATA);
    }

    #[test]
    fn the_offset_is_reported_until_acknowledged_and_after_each_step() {
        let mut clock = Clock::default();
        assert_eq!(clock.set(SyncState { offset: 500, ..SyncState::default() }), 500);
        assert_eq!((clock.due(1), clock.due(2)), (Some(500), Some(500)));
        clock.acknowledge(1);
        assert_eq!(clock.due(3), None);
        assert_eq!(clock.set(SyncState { offset: 200, ..SyncState::default() }), -300);
        assert_eq!((clock.due(4), clock.to_local(1_000)), (Some(200), 800));
    }
}
