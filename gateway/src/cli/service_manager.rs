//! What a service manager hears from `run` (sd_notify): that the gateway runs, that its cycle goes on, that it stops.

use std::time::{Duration, Instant};

use sd_notify::NotifyState;
use tracing::warn;

use crate::status::pulse::{Heartbeat, silence};
use crate::status::{BoxState, BoxStatus};

/// How often the published status is looked at.
const LOOK_INTERVAL: Duration = Duration::from_millis(200);

/// The service manager that has started the process, or nobody.
#[derive(Debug)]
pub struct ServiceManager {
    report: Report,
    /// When the status is looked at again.
    next: Instant,
    /// A message could not be sent, which is logged once.
    deaf: bool,
}

impl ServiceManager {
    /// The one that the environment names: `NOTIFY_SOCKET`, `WATCHDOG_USEC`.
    pub fn of_environment(now: Instant) -> Self {
        Self { report: Report::new(now, sd_notify::watchdog_enabled()), next: now, deaf: false }
    }

    /// Reports what `status` shows if it is time for it.
    pub fn look(&mut self, now: Instant, status: impl FnOnce() -> BoxStatus) {
        if now < self.next {
            return;
        }
        self.next = now + LOOK_INTERVAL;
        let messages = self.report.messages(now, &status());
        self.send(&messages);
    }

    /// The gateway ends: nothing is watched from now on.
    pub fn stopping(&mut self) {
        self.send(&[Message::Stopping]);
    }

    fn send(&mut self, messages: &[Message]) {
        let states: Vec<_> = messages.iter().map(Message::state).collect();
        if states.is_empty() {
            return;
        }
        // Without a service manager nothing is sent.
        if let Err(error) = sd_notify::notify(&states)
            && !std::mem::replace(&mut self.deaf, true)
        {
            warn!(%error, "the service manager cannot be reached at NOTIFY_SOCKET");
        }
    }
}

/// One thing to report.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Message {
    Ready,
    Watchdog,
    Status(String),
    Stopping,
}

impl Message {
    fn state(&self) -> NotifyState<'_> {
        match self {
            Self::Ready => NotifyState::Ready,
            Self::Watchdog => NotifyState::Watchdog,
            Self::Status(text) => NotifyState::Status(text),
            Self::Stopping => NotifyState::Stopping,
        }
    }
}

/// What was reported, and what follows from a status.
#[derive(Debug)]
struct Report {
    heartbeat: Heartbeat,
    /// How often the watchdog is fed; `None` without one.
    feed_interval: Option<Duration>,
    fed: Option<Instant>,
    is_ready: bool,
    shown: Option<BoxState>,
}

impl Report {
    /// For a watchdog that bites after this time of silence.
    fn new(now: Instant, watchdog: Option<Duration>) -> Self {
        Self {
            heartbeat: Heartbeat::new(now),
            feed_interval: watchdog.map(|time_out| time_out / 2),
            fed: None,
            is_ready: false,
            shown: None,
        }
    }

    /// Ready is a gateway whose cycle thread runs, whether drives answer or not. The watchdog is fed by the cycle alone: only while
    /// the status that it publishes goes on.
    fn messages(&mut self, now: Instant, status: &BoxStatus) -> Vec<Message> {
        let age = self.heartbeat.age(now, status.uptime);
        let mut messages = Vec::new();
        let silence = silence(status, age);
        if silence.is_none() && !self.is_ready {
            self.is_ready = true;
            messages.push(Message::Ready);
        }
        let is_due = |interval| self.fed.is_none_or(|fed| now.saturating_duration_since(fed) >= interval);
        if silence.is_none() && self.feed_interval.is_some_and(is_due) {
            self.fed = Some(now);
            messages.push(Message::Watchdog);
        }
        if self.shown != Some(status.state) {
            self.shown = Some(status.state);
            messages.push(Message::Status(status.state.to_string()));
        }
        messages
    }
}

#[cfg(test)]
mod tests {
    use profile_generic::time::DurationNs;

    use super::*;
    use crate::status::tests::distinct;

    /// A report in virtual time, of a cycle that can be stopped.
    struct Rig {
        report: Report,
        start: Instant,
        status: BoxStatus,
    }

    impl Rig {
        fn new(watchdog: Option<u64>) -> Self {
            let start = Instant::now();
            let status = BoxStatus::STARTING;
            Self { report: Report::new(start, watchdog.map(Duration::from_millis)), start, status }
        }

        /// What is reported at this millisecond.
        fn at(&mut self, millis: u64) -> Vec<String> {
            let messages = self.report.messages(self.start + Duration::from_millis(millis), &self.status);
            messages.iter().map(|message| message.state().to_string()).collect()
        }

        /// The cycle goes on until this millisecond, and is looked at there.
        fn cycle(&mut self, millis: u64) -> Vec<String> {
            self.status.uptime = DurationNs::from_millis(millis.try_into().unwrap());
            self.at(millis)
        }

        fn begin(&mut self) {
            self.status = BoxStatus { state: BoxState::PHASE_UP, ..distinct() };
        }
    }

    #[test]
    fn gateway_is_ready_when_its_cycle_runs() {
        let mut rig = Rig::new(None);
        assert_eq!(rig.at(0), ["STATUS=starting"]);
        assert_eq!(rig.at(200), [""; 0]);
        rig.begin();
        assert_eq!(rig.cycle(400), ["READY=1", "STATUS=phase_up"]);
        assert_eq!(rig.cycle(600), [""; 0]);
        rig.status.state = BoxState::READY;
        assert_eq!(rig.cycle(800), ["STATUS=ready"]);
    }

    #[test]
    fn watchdog_is_fed_at_half_its_time() {
        let mut rig = Rig::new(Some(10_000));
        assert_eq!(rig.at(0), ["STATUS=starting"]);
        rig.begin();
        let fed: Vec<_> = (1..=75)
            .map(|look| look * 200)
            .filter(|millis| rig.cycle(*millis).contains(&"WATCHDOG=1".into()))
            .collect();
        assert_eq!(fed, [200, 5_200, 10_200]);
    }

    #[test]
    fn watchdog_is_not_fed_while_the_cycle_stands() {
        let mut rig = Rig::new(Some(2_000));
        rig.begin();
        assert_eq!(rig.cycle(0), ["READY=1", "WATCHDOG=1", "STATUS=phase_up"]);
        assert_eq!(rig.cycle(1_000), ["WATCHDOG=1"]);
        // A second without publication is no pause of the host any more.
        assert_eq!(rig.at(2_000), ["WATCHDOG=1"]);
        for millis in [2_001, 3_000, 4_000, 60_000] {
            assert_eq!(rig.at(millis), [""; 0], "after {millis} ms");
        }
        assert_eq!(rig.cycle(60_200), ["WATCHDOG=1"], "it goes on");
    }

    #[test]
    fn watchdog_is_not_fed_before_the_cycle_starts() {
        let mut rig = Rig::new(Some(400));
        assert_eq!(rig.at(0), ["STATUS=starting"]);
        assert_eq!(rig.at(1_000), [""; 0]);
    }

    #[test]
    fn watchdog_is_fed_while_the_axes_are_stopped() {
        let mut rig = Rig::new(Some(2_000));
        rig.begin();
        rig.cycle(0);
        rig.status.state = BoxState::STOPPING;
        assert_eq!(rig.cycle(1_000), ["WATCHDOG=1", "STATUS=stopping"]);
        assert_eq!(rig.cycle(2_000), ["WATCHDOG=1"]);
    }
}
