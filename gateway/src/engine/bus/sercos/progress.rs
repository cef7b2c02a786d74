//! What is said of a phase on the way up that takes long.

use profile_generic::time::{DurationNs, MonotonicTime};
use profile_sercos::master::Master;
use profile_sercos::wire::header::Phase;

use crate::engine::notice::Notice;

/// How often is said what a long phase waits for.
const PROGRESS: DurationNs = DurationNs::from_secs(5);

/// Counts what was said of the phase.
#[derive(Debug, Default)]
pub(super) struct PhaseProgress {
    phase: Option<Phase>,
    since: MonotonicTime,
    reported: i64,
}

impl PhaseProgress {
    /// What is to be said: every [`PROGRESS`] that the bus is in the same phase on its way up.
    pub(super) fn report(&mut self, now: MonotonicTime, master: &Master) -> Option<Notice> {
        let phase = master.phase();
        if phase != self.phase {
            *self = Self { phase, since: now, reported: 0 };
        }
        // On the way down, and in a pause before the next try, nobody waits for anything.
        let phase = phase.filter(|phase| *phase < Phase::CP4 && master.target_phase() == Some(Phase::CP4))?;
        let times = now.since(self.since).0 / PROGRESS.0;
        if times <= self.reported {
            return None;
        }
        self.reported = times;
        let seconds = u16::try_from(now.since(self.since).0 / 1_000_000_000).unwrap_or(u16::MAX);
        Some(Notice::Progress { phase, seconds, with: master.waits_for() })
    }
}
