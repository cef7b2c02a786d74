//! The time of a simulated controller: its own clock, told to others or not, or that of a grandmaster.
//!
//! | time | local clock | system time |
//! |---|---|---|
//! | [`ControllerTime::Own`] | the host's monotonic clock with a drift | the host's clock with offset, drift and steps |
//! | [`ControllerTime::Leading`] | the same | the same, told by PTP |
//! | [`ControllerTime::Following`] | the host's monotonic clock at the rate of the grandmaster | the grandmaster's |
//!
//! Update periods are counted on the local clock. A step of system time goes into the offset between the two
//! (CIP Volume 9, 2-2.1), so that no update is early or late by it.

use profile_generic::time::{DurationNs, MonotonicTime};
use profile_generic::time_base::{TimeBase, TimeSample};

use super::clock::{ClockPlan, ControllerClock};
use super::grandmaster::{Grandmaster, GrandmasterError};
use super::setup::HOST_CLOCK;
use crate::config::{Time, TimeSource};
use crate::sys::clock::monotonic_now;
use crate::sys::interfaces;
use crate::sys::ptp_socket::Dscp;
use crate::time::feed::line_at;
use crate::time::ptp::master::{MasterConfig, MasterState};
use crate::time::source::{Place, SourceError, TimeService, identity};
use crate::time::status::TimeStatus;

/// Where a controller takes part in PTP.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PtpPlace {
    /// Network interface.
    pub interface: String,
    /// Domain, 0..=127.
    pub domain: u8,
}

/// How a controller has its time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TimePlan {
    /// It has a clock of its own that everybody on this host knows.
    Host(ClockPlan),
    /// It follows a grandmaster, and is synchronized within so much.
    Ptp(PtpPlace, DurationNs),
    /// It is the grandmaster, with a clock of its own.
    Grandmaster(PtpPlace, Leadership, ClockPlan),
}

/// How a clock tells its time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Leadership {
    /// First and second priority among clocks: the lower, the better.
    pub priorities: [u8; 2],
    /// Interval of Announce, 2^n s.
    pub log_announce: i8,
    /// Interval of Sync, 2^n s.
    pub log_sync: i8,
}

/// Why a controller has no time.
#[derive(Debug, thiserror::Error)]
pub enum TimeError {
    /// It cannot follow a grandmaster.
    #[error("no PTP: {0}")]
    Follower(#[from] SourceError),
    /// It cannot be the grandmaster.
    #[error(transparent)]
    Grandmaster(#[from] GrandmasterError),
}

/// The time of a controller that runs.
#[derive(Debug)]
pub enum ControllerTime {
    /// Its own clock.
    Own(ControllerClock),
    /// Its own clock, which it tells to others.
    Leading(ControllerClock, Grandmaster),
    /// The clock of a grandmaster.
    Following(Box<Following>),
}

/// See [`ControllerTime::Following`].
#[derive(Debug)]
pub struct Following {
    service: TimeService,
    /// What is known of the grandmaster's time.
    status: TimeStatus,
    /// Local clock and system time over the host's monotonic clock; `None` before the first measurement.
    base: Option<TimeBase>,
}

/// What a controller has before it begins.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Readiness {
    /// Its updates can have time stamps.
    Ready,
    /// What it waits for.
    Waits(String),
}

impl ControllerTime {
    /// Starts the clock of a plan. A follower has no time yet: [`ControllerTime::readiness`].
    ///
    /// # Errors
    /// No sockets for PTP.
    pub fn start(plan: TimePlan) -> Result<Self, TimeError> {
        Ok(match plan {
            TimePlan::Host(plan) => Self::Own(ControllerClock::start(plan)),
            TimePlan::Ptp(place, threshold) => Self::Following(Box::new(Following::start(place, threshold)?)),
            TimePlan::Grandmaster(place, leadership, plan) => {
                let clock = ControllerClock::start(plan);
                let Leadership { priorities, log_announce, log_sync } = leadership;
                let config = MasterConfig {
                    domain: place.domain,
                    priorities,
                    log_announce,
                    log_sync,
                    seed: monotonic_now().0,
                    ..MasterConfig::new(identity(interfaces::mac(&place.interface).unwrap_or_default()))
                };
                let grandmaster = Grandmaster::start(&place.interface, config, clock.clone())?;
                Self::Leading(clock, grandmaster)
            }
        })
    }

    /// Whether it has a time that others share.
    ///
    /// # Errors
    /// The grandmaster has ended by itself.
    pub fn readiness(&mut self) -> Result<Readiness, TimeError> {
        Ok(match self {
            Self::Own(_) => Readiness::Ready,
            Self::Leading(_, grandmaster) => match grandmaster.state()? {
                MasterState::Master => Readiness::Ready,
                state => Readiness::Waits(state.to_string()),
            },
            Self::Following(following) => {
                following.look();
                let is_ready = following.status.phase.is_synchronized() && following.base.is_some();
                if is_ready { Readiness::Ready } else { Readiness::Waits(following.status.phase.to_string()) }
            }
        })
    }

    /// What is to be said of it; changes with its state.
    #[must_use]
    pub fn description(&self) -> String {
        match self {
            Self::Own(_) => "the host's clock".to_owned(),
            Self::Leading(_, grandmaster) => match grandmaster.state() {
                Ok(state) => {
                    format!("{} is {state}", crate::time::status::Identity(grandmaster.identity()))
                }
                Err(error) => error.to_string(),
            },
            Self::Following(following) => following.status.to_string(),
        }
    }

    /// Identity of the grandmaster of its system time; `None` while it knows none.
    #[must_use]
    pub fn grandmaster(&self) -> Option<[u8; 8]> {
        match self {
            Self::Own(_) => Some(HOST_CLOCK),
            Self::Leading(_, grandmaster) => Some(grandmaster.identity()),
            Self::Following(following) => following.status.grandmaster,
        }
    }

    /// The time on the local clock.
    #[must_use]
    pub fn now(&self) -> MonotonicTime {
        match self {
            Self::Own(clock) | Self::Leading(clock, _) => clock.now(),
            Self::Following(following) => following.local(monotonic_now()),
        }
    }

    /// System time at an instant of the local clock; `None` when it could not be read.
    pub fn sample(&mut self) -> Option<TimeSample> {
        match self {
            Self::Own(clock) | Self::Leading(clock, _) => clock.sample(),
            Self::Following(following) => {
                following.look();
                Some(following.sample())
            }
        }
    }

    /// The same before anything is known of the time: as good as there is one.
    pub fn first_sample(&mut self) -> TimeSample {
        match self {
            Self::Own(clock) | Self::Leading(clock, _) => clock.first_sample(),
            Self::Following(following) => {
                following.look();
                following.sample()
            }
        }
    }
}

impl Following {
    fn start(place: PtpPlace, threshold: DurationNs) -> Result<Self, SourceError> {
        let mac = interfaces::mac(&place.interface).unwrap_or_default();
        let at = Place { interface: Some(place.interface), mac, event_dscp: Dscp::default().event };
        let config = Time { source: TimeSource::Ptp, domain: place.domain, threshold, ..Time::default() };
        let (service, _) = TimeService::start(&config, &at)?;
        let status = service.view().read();
        Ok(Self { service, status, base: None })
    }

    /// Takes what the follower knows by now.
    fn look(&mut self) {
        self.status = self.service.view().read();
        let Some(line) = self.status.sample else { return };
        let sample = line_at(&line, monotonic_now());
        match &mut self.base {
            Some(base) => {
                base.feed(&sample);
            }
            // The rate is known from the second sample on.
            None => self.base = Some(TimeBase::new(sample)),
        }
    }

    /// The local clock: system time without its steps.
    fn local(&self, host: MonotonicTime) -> MonotonicTime {
        let Some(base) = &self.base else { return host };
        MonotonicTime(base.system_at(host).0.wrapping_sub(base.offset().0.cast_unsigned()))
    }

    fn sample(&self) -> TimeSample {
        let host = monotonic_now();
        let at = self.local(host);
        let system = self.base.map_or(profile_generic::time::SystemTime(at.0), |base| base.system_at(host));
        TimeSample { at, system, rate_ppb: 0 }
    }
}
