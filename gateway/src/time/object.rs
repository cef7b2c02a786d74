//! What the Time Sync object of a device shows of a [`TimeStatus`].

use profile_cip::device::motion_device::SyncState;
use profile_cip::device::time_sync::{ClockInfo, MasterInfo, Measurement, PortState, PtpPort, TimeSyncState};

use super::feed::line_at;
use super::judge::SyncPhase;
use super::ptp::{LOG_ANNOUNCE, LOG_SYNC};
use super::status::{Master, TimeStatus};
use crate::config::TimeSource;
use crate::sys::clock::{HostTime, TimeScale, monotonic_now};

/// The object as it is now.
#[must_use]
pub fn time_sync(source: TimeSource, status: &TimeStatus) -> TimeSyncState {
    let sync = SyncState {
        grandmaster: status.grandmaster,
        synchronized: status.phase.is_synchronized(),
        offset: 0,
    };
    match source {
        TimeSource::Ptp | TimeSource::Daemon => follower(sync, status),
        TimeSource::Host | TimeSource::Shared => host(sync, status.identity),
        TimeSource::None => TimeSyncState { sync, ..TimeSyncState::default() },
    }
}

/// The clock of the host, which runs no PTP of its own.
fn host(sync: SyncState, identity: [u8; 8]) -> TimeSyncState {
    let sample = HostTime.first_sample();
    let utc_offset = match HostTime.scale() {
        TimeScale::Tai { offset_s } => u16::try_from(offset_s).ok(),
        TimeScale::Utc => None,
    };
    let apart = sample.system.0.cast_signed().wrapping_sub(sample.at.0.cast_signed());
    TimeSyncState {
        sync: SyncState { offset: apart, ..sync },
        system_less_monotonic: Some(apart),
        local: Some(ClockInfo::host(identity, utc_offset)),
        ..TimeSyncState::default()
    }
}

fn follower(sync: SyncState, status: &TimeStatus) -> TimeSyncState {
    let apart = status.sample.map(|line| {
        let sample = line_at(&line, monotonic_now());
        sample.system.0.cast_signed().wrapping_sub(sample.at.0.cast_signed())
    });
    let measurement = status.offset_from_master.zip(status.mean_path_delay);
    TimeSyncState {
        sync: SyncState { offset: apart.unwrap_or(0), ..sync },
        system_less_monotonic: apart,
        ptp: Some(PtpPort {
            state: port_state(status),
            domain: status.domain,
            log_announce: u16::from(LOG_ANNOUNCE.unsigned_abs()),
            log_sync: LOG_SYNC.into(),
            master: status.master.map(|master| master_info(&master)),
        }),
        measurement: measurement.map(|(offset_from_master, mean_path_delay)| Measurement {
            offset_from_master,
            max_offset_from_master: status.max_offset,
            mean_path_delay,
        }),
        local: Some(ClockInfo::follower(status.identity)),
    }
}

fn port_state(status: &TimeStatus) -> PortState {
    match status.phase {
        _ if status.master.is_none() => PortState::Listening,
        SyncPhase::Synchronized | SyncPhase::Holdover => PortState::Slave,
        SyncPhase::Listening | SyncPhase::Uncalibrated(_) => PortState::Uncalibrated,
    }
}

fn master_info(master: &Master) -> MasterInfo {
    let flag = |is_set: bool, flag: u16| if is_set { flag } else { 0 };
    let flags = flag(master.ptp_time_scale, ClockInfo::PTP_TIME_SCALE)
        | flag(master.time_traceable, ClockInfo::TIME_TRACEABLE)
        | flag(master.frequency_traceable, ClockInfo::FREQUENCY_TRACEABLE);
    let grandmaster = ClockInfo {
        identity: master.grandmaster,
        class: master.quality.class,
        accuracy: master.quality.accuracy,
        variance: master.quality.variance,
        utc_offset: master.utc_offset.and_then(|offset| u16::try_from(offset).ok()),
        flags,
        source: master.time_source,
    };
    MasterInfo {
        grandmaster,
        priorities: master.priorities,
        parent: master.parent,
        steps_removed: master.steps_removed,
    }
}
