//! The clock of a simulated controller: that of the host with an offset, a drift and steps, so that controller and gateway have
//! two clocks on one host.
//!
//! Its monotonic clock drifts and never steps: the controller's update period is made of it. Its system time has the offset and the
//! steps as well.

use std::str::FromStr;

use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_generic::time_base::TimeSample;

use crate::sys::clock::{self, HostTime};

const BILLION: i128 = 1_000_000_000;

/// A step of system time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockStep {
    /// When, from the start of the controller on.
    pub after: DurationNs,
    /// By how much.
    pub size: DurationNs,
}

/// `SECONDS:MILLISECONDS`: after so many seconds, by so many milliseconds.
impl FromStr for ClockStep {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let expected = || format!("expected SECONDS:MILLISECONDS, such as 3:-50, got `{text}`");
        let (after, size) = text.split_once(':').ok_or_else(expected)?;
        let after = after.parse::<u32>().map_err(|_| expected())?;
        let size = size.parse::<i32>().map_err(|_| expected())?;
        Ok(Self {
            after: DurationNs::from_millis(i64::from(after) * 1_000),
            size: DurationNs::from_millis(i64::from(size)),
        })
    }
}

/// How a controller's clock differs from the host's.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ClockPlan {
    /// By how much its system time is ahead from the start on.
    pub offset: DurationNs,
    /// What both of its clocks gain in a second, parts per thousand million.
    pub drift_ppb: i64,
    /// Steps of its system time.
    pub steps: Vec<ClockStep>,
}

/// The clock of a controller that runs.
#[derive(Debug, Clone)]
pub struct ControllerClock {
    plan: ClockPlan,
    begun: MonotonicTime,
}

impl ControllerClock {
    /// A clock that is set by its plan now.
    #[must_use]
    pub fn start(plan: ClockPlan) -> Self {
        Self { plan, begun: clock::monotonic_now() }
    }

    /// The controller's monotonic time.
    #[must_use]
    pub fn now(&self) -> MonotonicTime {
        self.of(clock::monotonic_now())
    }

    /// A sample of its system time, as [`HostTime::sample`] gives one.
    #[must_use]
    pub fn sample(&self) -> Option<TimeSample> {
        HostTime.sample().map(|sample| self.changed(&sample))
    }

    /// The first sample, as [`HostTime::first_sample`] gives it.
    #[must_use]
    pub fn first_sample(&self) -> TimeSample {
        self.changed(&HostTime.first_sample())
    }

    /// Its system time at an instant of the host's monotonic clock that is just past.
    #[must_use]
    pub fn system_at(&self, host: MonotonicTime) -> SystemTime {
        let now = HostTime.first_sample();
        self.changed(&TimeSample { at: host, system: now.system - now.at.since(host), ..now }).system
    }

    /// What the clock has gained at an instant of the host's monotonic clock.
    fn gained(&self, host: MonotonicTime) -> DurationNs {
        let gained = i128::from(host.since(self.begun).0) * i128::from(self.plan.drift_ppb) / BILLION;
        DurationNs(i64::try_from(gained).unwrap_or(0))
    }

    fn of(&self, host: MonotonicTime) -> MonotonicTime {
        host + self.gained(host)
    }

    fn changed(&self, sample: &TimeSample) -> TimeSample {
        let passed = sample.at.since(self.begun);
        let steps = self.plan.steps.iter().filter(|step| step.after <= passed);
        let stepped = steps.fold(self.plan.offset, |sum, step| sum + step.size);
        let system: SystemTime = sample.system + self.gained(sample.at) + stepped;
        TimeSample { at: self.of(sample.at), system, ..*sample }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_read_and_anything_else_is_refused() {
        let step = |after, size| ClockStep {
            after: DurationNs::from_millis(after),
            size: DurationNs::from_millis(size),
        };
        assert_eq!("3:-50".parse(), Ok(step(3_000, -50)));
        assert_eq!("0:3600000".parse(), Ok(step(0, 3_600_000)));
        for wrong in ["", ":", "3", "3:", ":5", "-1:5", "3:x", "3:5:7", "3.5:1", "3:99999999999"] {
            let error = format!("expected SECONDS:MILLISECONDS, such as 3:-50, got `{wrong}`");
            assert_eq!(wrong.parse::<ClockStep>(), Err(error));
        }
    }

    #[test]
    fn both_clocks_drift_and_only_system_time_has_offset_and_steps() {
        let seconds = |count: i64| DurationNs::from_millis(count * 1_000);
        let steps = vec!["2:100".parse().unwrap(), "4:-30".parse().unwrap()];
        let plan = ClockPlan { offset: DurationNs::from_millis(5), drift_ppb: 200_000, steps };
        let begun = MonotonicTime(7_000_000_000);
        let clock = ControllerClock { plan, begun };
        let system = SystemTime(1_700_000_000_000_000_000);
        let at = |passed: i64| {
            let host =
                TimeSample { at: begun + seconds(passed), system: system + seconds(passed), rate_ppb: 0 };
            let own = clock.changed(&host);
            (own.at.since(host.at).0, own.system.since(host.system).0)
        };
        assert_eq!(at(0), (0, 5_000_000));
        assert_eq!(at(1), (200_000, 5_200_000));
        assert_eq!(at(2), (400_000, 105_400_000));
        assert_eq!(at(5), (1_000_000, 76_000_000));
    }
}
