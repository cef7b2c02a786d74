//! A clock that may be the grandmaster, for the bench: it tells its time as long as no better clock is heard.
//!
//! ```text
//!  +-----------+  no Announce for 6 to 8 s  +--------+  a better clock  +-----------+
//!  | Listening |--------------------------->| Master |----------------->| Outranked |
//!  +-----------+                            +--------+ <----------------+-----------+
//!        |            a better clock                      it is silent        ^
//!        +--------------------------------------------------------------------+
//! ```
//!
//! What it tells of itself is what it is (`time-sync` of CIP Volume 9, 2): class 248, accuracy 0xFE, source 0xA0, nothing traceable.

use std::fmt;
use std::io;

use profile_generic::time::{MonotonicTime, SystemTime};
use statime::config::{ClockIdentity, InstanceConfig, SdoId};
use statime::observability::port::PortState;
use statime::time::Time;

use super::guard::Guard;
use super::wire::Wire;
use super::{ClockPort, Instance, LOG_ANNOUNCE, LOG_SYNC, PortSettings, time_properties};
use crate::time::status::Identity;

/// What the clock is, and how often it tells the time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MasterConfig {
    /// Identity of the clock, EUI-64.
    pub identity: [u8; 8],
    /// Domain, 0..=127.
    pub domain: u8,
    /// First and second priority: the lower, the better.
    pub priorities: [u8; 2],
    /// Interval of Announce, 2^n s.
    pub log_announce: i8,
    /// Interval of Sync, 2^n s.
    pub log_sync: i8,
    /// Where the randomness of the time before the first Announce begins.
    pub seed: u64,
}

impl MasterConfig {
    /// A clock with the intervals and priorities of CIP Sync.
    #[must_use]
    pub const fn new(identity: [u8; 8]) -> Self {
        Self {
            identity,
            domain: 0,
            priorities: [128; 2],
            log_announce: LOG_ANNOUNCE,
            log_sync: LOG_SYNC,
            seed: 0,
        }
    }
}

/// What the clock is among others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MasterState {
    /// It listens whether there is a master.
    #[default]
    Listening,
    /// It is the grandmaster.
    Master,
    /// A better clock is the grandmaster. Nobody follows this one.
    Outranked {
        /// Identity of the better one.
        by: [u8; 8],
    },
}

impl fmt::Display for MasterState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Listening => f.write_str("listening for other masters"),
            Self::Master => f.write_str("grandmaster"),
            Self::Outranked { by } => write!(f, "no grandmaster: {} is a better clock", Identity(*by)),
        }
    }
}

/// Tells the time until the wire ends. `time` gives the time of the clock at an instant of the wire; `report` gets each other state.
///
/// # Errors
/// What the wire says.
pub fn lead(
    config: &MasterConfig,
    wire: &mut impl Wire,
    time: &impl Fn(MonotonicTime) -> SystemTime,
    report: &mut dyn FnMut(MasterState),
) -> io::Result<()> {
    let [priority_1, priority_2] = config.priorities;
    let settings = PortSettings {
        instance: InstanceConfig {
            clock_identity: ClockIdentity(config.identity),
            priority_1,
            priority_2,
            domain_number: config.domain,
            slave_only: false,
            sdo_id: SdoId::default(),
            path_trace: false,
        },
        log_announce: config.log_announce,
        log_sync: config.log_sync,
        asymmetry: 0,
    };
    let time = |at| Time::from_nanos(time(at).0);
    let instance = Instance::new(settings.instance, time_properties());
    let guard = Guard::of_master(config.identity, config.domain);
    let mut port = ClockPort::start(&instance, &settings, config.seed, guard, wire)?;
    let mut reported = None;
    while !wire.is_ended() {
        let state = match (port.state(), port.master()) {
            (Some(PortState::Master), _) => MasterState::Master,
            (_, Some(master)) => MasterState::Outranked { by: master.grandmaster },
            _ => MasterState::Listening,
        };
        if reported.replace(state) != Some(state) {
            report(state);
        }
        port.turn(wire, &time)?;
        // The time of another master is not taken.
        while port.measurements.take().is_some() {}
    }
    Ok(())
}
