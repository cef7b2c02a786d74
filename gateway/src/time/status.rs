//! What is known of system time: where it comes from, how good it is.

use std::fmt;

use profile_generic::time_base::TimeSample;
use statime::config::TimePropertiesDS;
use statime::observability::current::CurrentDS;
use statime::observability::parent::ParentDS;

use super::judge::SyncPhase;
use super::ptp::FollowerConfig;
use super::ptp::guard::Refusal;

/// What a clock tells of itself in its Announces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quality {
    /// Class: the lower, the better; 248 if nobody has set one.
    pub class: u8,
    /// Accuracy (IEEE 1588-2008, table 6): 0xFE unknown.
    pub accuracy: u8,
    /// Offset scaled log variance.
    pub variance: u16,
}

/// The master that is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Master {
    /// Identity of the grandmaster.
    pub grandmaster: [u8; 8],
    /// What it tells of itself.
    pub quality: Quality,
    /// Its first and second priority.
    pub priorities: [u8; 2],
    /// Identity and port number of the clock that sends the Syncs: the grandmaster or a boundary clock.
    pub parent: ([u8; 8], u16),
    /// Boundary clocks on the way, and one more for us.
    pub steps_removed: u16,
    /// Seconds of PTP time ahead of UTC, as far as the master tells.
    pub utc_offset: Option<i16>,
    /// The time counts seconds of TAI.
    pub ptp_time_scale: bool,
    /// Where its time comes from (IEEE 1588-2008, table 7).
    pub time_source: u8,
    /// Its time is traceable to a standard.
    pub time_traceable: bool,
    /// Its rate is traceable to a standard.
    pub frequency_traceable: bool,
}

impl Master {
    pub(super) fn of(parent: &ParentDS, time: &TimePropertiesDS, current: &CurrentDS) -> Self {
        let quality = parent.grandmaster_clock_quality;
        Self {
            grandmaster: parent.grandmaster_identity.0,
            quality: Quality {
                class: quality.clock_class,
                accuracy: quality.clock_accuracy.to_primitive(),
                variance: quality.offset_scaled_log_variance,
            },
            priorities: [parent.grandmaster_priority_1, parent.grandmaster_priority_2],
            parent: (parent.parent_port_identity.clock_identity.0, parent.parent_port_identity.port_number),
            steps_removed: current.steps_removed,
            utc_offset: time.current_utc_offset,
            ptp_time_scale: time.ptp_timescale,
            time_source: time.time_source.to_primitive(),
            time_traceable: time.time_traceable,
            frequency_traceable: time.frequency_traceable,
        }
    }
}

/// The state of system time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TimeStatus {
    /// Whether it is synchronized.
    pub phase: SyncPhase,
    /// Identity of our own clock.
    pub identity: [u8; 8],
    /// The master that is followed.
    pub master: Option<Master>,
    /// The grandmaster whose time this is; stays while its master is silent.
    pub grandmaster: Option<[u8; 8]>,
    /// System time with the monotonic time of one instant, and its rate.
    pub sample: Option<TimeSample>,
    /// Offset from the master that the last Sync has shown, ns.
    pub offset_from_master: Option<i64>,
    /// Largest one since this grandmaster is followed, ns.
    pub max_offset: u64,
    /// Mean delay of the path to the master, ns.
    pub mean_path_delay: Option<i64>,
    /// Distance of the last Syncs from the line through them, the middle one, ns.
    pub spread: u64,
    /// Bound of the error, ns.
    pub error_bound: u64,
    /// Largest offset of a synchronized clock, ns.
    pub threshold: u64,
    /// PTP domain.
    pub domain: u8,
    /// Steps of the master's clock.
    pub steps: u32,
    /// Messages that were not passed on, by [`Refusal::ALL`].
    pub refused: [u64; Refusal::ALL.len()],
}

impl TimeStatus {
    /// A follower that has heard nothing yet.
    #[must_use]
    pub const fn ptp(config: &FollowerConfig) -> Self {
        Self {
            phase: SyncPhase::Listening,
            identity: config.identity,
            master: None,
            grandmaster: None,
            sample: None,
            offset_from_master: None,
            max_offset: 0,
            mean_path_delay: None,
            spread: 0,
            error_bound: 0,
            threshold: config.threshold,
            domain: config.domain,
            steps: 0,
            refused: [0; Refusal::ALL.len()],
        }
    }
}

/// An identity as PTP tools write it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identity(pub [u8; 8]);

impl fmt::Display for Identity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b, c, d, e, g, h, i] = self.0;
        write!(f, "{a:02x}{b:02x}{c:02x}.{d:02x}{e:02x}.{g:02x}{h:02x}{i:02x}")
    }
}

impl fmt::Display for TimeStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.phase)?;
        if let Some(grandmaster) = self.grandmaster {
            write!(f, ", grandmaster {}", Identity(grandmaster))?;
        }
        if let Some(offset) = self.offset_from_master {
            write!(f, ", offset {offset} ns")?;
        }
        if let Some(delay) = self.mean_path_delay {
            write!(f, ", path delay {delay} ns")?;
        }
        Ok(())
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A synchronized clock, 120 ns off.
    pub fn synchronized() -> TimeStatus {
        let follower =
            FollowerConfig { identity: [1; 8], domain: 0, threshold: 10_000, asymmetry: 0, seed: 1 };
        TimeStatus {
            phase: SyncPhase::Synchronized,
            grandmaster: Some([0x02, 0x41, 0x42, 0xFF, 0xFE, 0, 0, 1]),
            offset_from_master: Some(-120),
            mean_path_delay: Some(3_400),
            error_bound: 800,
            ..TimeStatus::ptp(&follower)
        }
    }
}
