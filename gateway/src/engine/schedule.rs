//! When the engine is called, and what each call is for: the grid of each bus, and how late calls are.
//!
//! A bus is named by its place, the order of the configuration.

use profile_generic::time::{DurationNs, MonotonicTime};

use super::cyclic::Cycle;

/// Most buses of a box.
pub const BUSES_MAX: usize = 9;

/// Time between two calls while no bus has anything to do by itself, so that the north side is served.
pub(super) const IDLE_INTERVAL: DurationNs = DurationNs::from_millis(1);

/// The same of a box whose buses are slow: a part of the shortest cycle, up to this.
const IDLE_INTERVAL_MAX: DurationNs = DurationNs::from_millis(4);
const IDLE_CALLS_PER_CYCLE: i64 = 4;

/// Rather than call so shortly before a cycle of a bus, the engine sleeps until that.
const QUIET_BEFORE_CYCLE: DurationNs = DurationNs::from_micros(250);

/// The work for a cycle begins at most by this part of it before its instant: the answers of the drives have to be back by then.
const LEAD_DIVISOR: i64 = 10;

/// The cycles of all buses.
#[derive(Debug)]
pub(super) struct Schedule {
    /// The shortest cycle of all buses.
    pub cycle_time: DurationNs,
    /// How long before its instant the work for a cycle begins.
    lead: DurationNs,
    /// When the next call is due.
    due: Option<MonotonicTime>,
    buses: [BusTimes; BUSES_MAX],
}

#[derive(Debug, Clone, Copy, Default)]
struct BusTimes {
    /// The cycle that is built and waits for its instant.
    prepared: Option<MonotonicTime>,
    /// By how much calls were late since the last cycle was built.
    late: DurationNs,
    /// When the last cycle began: its instant on the grid.
    sent_at: Option<MonotonicTime>,
    /// A cycle has begun since [`Schedule::take_sent`] was called last.
    sent: bool,
}

impl Schedule {
    pub fn new(cycle_time: DurationNs, lead: DurationNs) -> Self {
        Self { cycle_time, lead, due: None, buses: [BusTimes::default(); BUSES_MAX] }
    }

    /// Begins a call; by how much it is late.
    pub fn begin(&mut self, now: MonotonicTime) -> DurationNs {
        let late = self.due.map_or(DurationNs::ZERO, |due| now.since(due).max(DurationNs::ZERO));
        self.buses.iter_mut().for_each(|bus| bus.late = bus.late.max(late));
        late
    }

    /// How long before its instant the work for a cycle begins: what comes in later belongs to the cycle after.
    fn lead_of(&self, span: DurationNs) -> DurationNs {
        self.lead.min(DurationNs(span.as_nanos() / LEAD_DIVISOR))
    }

    /// The cycle for which the axes of a bus do a step in this call, if any. `next` is the bus's next cycle.
    pub fn step(
        &self,
        place: usize,
        now: MonotonicTime,
        next: Option<MonotonicTime>,
        span: DurationNs,
    ) -> Option<MonotonicTime> {
        // Before there is a grid every call is a step.
        let Some(at) = next else { return Some(now) };
        (self.buses[place].prepared != Some(at) && now + self.lead_of(span) >= at).then_some(at)
    }

    /// What the axes of a bus need to know of the cycle at this instant.
    pub fn cycle(&self, place: usize, at: MonotonicTime, span: DurationNs) -> Cycle {
        Cycle { acts_at: at + span, span, ahead: span + self.lead_of(span), late: self.buses[place].late }
    }

    /// The frames of a cycle are built.
    pub fn prepared(&mut self, place: usize, at: MonotonicTime) {
        self.buses[place].prepared = Some(at);
        self.buses[place].late = DurationNs::ZERO;
    }

    /// The cycle that was built and whose instant has come. If the bus has left it out, the axes do their step for another one.
    pub fn take_prepared(
        &mut self,
        place: usize,
        now: MonotonicTime,
        left_out: bool,
    ) -> Option<MonotonicTime> {
        let taken = self.buses[place].prepared.take_if(|at| left_out || now >= *at);
        taken.filter(|_| !left_out)
    }

    /// The instant for which frames go out now; `None` while frames wait for theirs. A port that `holds` frames gets them ahead.
    pub fn take_sendable(&mut self, place: usize, now: MonotonicTime, holds: bool) -> Option<MonotonicTime> {
        match self.buses[place].prepared {
            None => Some(now),
            Some(_) if holds => self.buses[place].prepared.take(),
            Some(_) => self.take_prepared(place, now, false),
        }
    }

    /// A cycle of the bus has begun.
    pub fn sent(&mut self, place: usize, at: MonotonicTime) {
        self.buses[place].sent_at = Some(at);
        self.buses[place].sent = true;
    }

    /// Whether a cycle of the bus has begun since the last call of this.
    pub fn take_sent(&mut self, place: usize) -> bool {
        std::mem::take(&mut self.buses[place].sent)
    }

    /// When the drives captured the values that they sent: when the telegrams passed them.
    pub fn sampled_at(&self, place: usize, now: MonotonicTime) -> MonotonicTime {
        self.buses[place].sent_at.unwrap_or(now)
    }

    /// When a bus has to be called. `wake` is what it says itself.
    pub fn wake(
        &self,
        place: usize,
        now: MonotonicTime,
        (next, span): (Option<MonotonicTime>, DurationNs),
        wake: Option<MonotonicTime>,
    ) -> Option<MonotonicTime> {
        self.buses[place].prepared.or_else(|| {
            // A cycle that could not begin, as its frames have no room, waits for what the bus says.
            let begin = next.map(|at| at - self.lead_of(span)).filter(|at| *at > now);
            wake.into_iter().chain(begin).min()
        })
    }

    /// Ends a call; when the next one is due. `wake` is the first instant of all buses, `patience` the least of theirs.
    pub fn end(
        &mut self,
        now: MonotonicTime,
        wake: Option<MonotonicTime>,
        patience: DurationNs,
    ) -> MonotonicTime {
        let part = DurationNs(self.cycle_time.as_nanos() / IDLE_CALLS_PER_CYCLE);
        let interval = part.max(IDLE_INTERVAL).min(IDLE_INTERVAL_MAX);
        let idle = now + interval.max(patience);
        let due = wake.filter(|wake| *wake <= idle + QUIET_BEFORE_CYCLE).unwrap_or(now + interval);
        *self.due.insert(due)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPAN: DurationNs = DurationNs::from_millis(2);

    fn schedule() -> Schedule {
        Schedule::new(SPAN, DurationNs::from_millis(1))
    }

    fn at(micros: i64) -> MonotonicTime {
        MonotonicTime::ZERO + DurationNs::from_micros(micros)
    }

    #[test]
    fn step_of_a_cycle_is_done_once_from_a_tenth_ahead_on() {
        let mut schedule = schedule();
        assert_eq!(schedule.step(0, at(5), None, SPAN), Some(at(5)), "before there is a grid");
        assert_eq!(schedule.step(0, at(9_799), Some(at(10_000)), SPAN), None);
        assert_eq!(schedule.step(0, at(9_800), Some(at(10_000)), SPAN), Some(at(10_000)));
        schedule.prepared(0, at(10_000));
        assert_eq!(schedule.step(0, at(9_900), Some(at(10_000)), SPAN), None);
        assert_eq!(schedule.step(1, at(9_900), Some(at(10_000)), SPAN), Some(at(10_000)), "another bus");
    }

    #[test]
    fn prepared_cycle_is_taken_at_its_instant_and_dropped_if_left_out() {
        let mut schedule = schedule();
        assert_eq!(schedule.take_sendable(0, at(1), false), Some(at(1)), "nothing waits");
        schedule.prepared(0, at(10_000));
        assert_eq!(schedule.take_prepared(0, at(9_999), false), None);
        assert_eq!(schedule.take_sendable(0, at(9_999), false), None);
        assert_eq!(schedule.take_prepared(0, at(10_001), false), Some(at(10_000)));
        assert_eq!(schedule.take_prepared(0, at(10_001), false), None, "once");
        schedule.prepared(0, at(12_000));
        assert_eq!(
            schedule.take_sendable(0, at(11_900), true),
            Some(at(12_000)),
            "ahead to a port that holds"
        );
        assert_eq!(schedule.take_sendable(0, at(11_900), true), Some(at(11_900)));
        schedule.prepared(0, at(12_000));
        assert_eq!(schedule.take_prepared(0, at(11_000), true), None);
        assert_eq!(schedule.take_prepared(0, at(12_000), false), None);
    }

    #[test]
    fn lateness_of_calls_is_kept_for_each_bus_until_its_cycle_is_built() {
        let mut schedule = schedule();
        assert_eq!(schedule.begin(at(0)), DurationNs::ZERO, "nothing was due");
        let due = schedule.end(at(0), Some(at(800)), DurationNs::ZERO);
        assert_eq!((due, schedule.begin(at(830))), (at(800), DurationNs::from_micros(30)));
        schedule.prepared(1, at(2_000));
        schedule.end(at(830), Some(at(900)), DurationNs::ZERO);
        assert_eq!(schedule.begin(at(850)), DurationNs::ZERO, "early");
        let late = [0, 1].map(|place| schedule.cycle(place, at(2_000), SPAN).late);
        assert_eq!(late, [DurationNs::from_micros(30), DurationNs::ZERO]);
    }

    #[test]
    fn cycle_acts_one_span_after_it_begins() {
        let cycle = schedule().cycle(0, at(2_000), SPAN);
        assert_eq!((cycle.acts_at, cycle.span), (at(4_000), SPAN));
        assert_eq!(cycle.ahead, DurationNs::from_micros(2_200));
    }

    #[test]
    fn next_call_is_at_the_first_wake_or_after_the_idle_interval() {
        let mut schedule = schedule();
        let patience = DurationNs::from_millis(3);
        for (wake, expected) in [(None, 1_000), (Some(3_250), 3_250), (Some(3_251), 1_000), (Some(10), 10)] {
            assert_eq!(schedule.end(at(0), wake.map(at), patience), at(expected), "{wake:?}");
        }
    }

    #[test]
    fn bus_is_called_for_what_is_built_then_for_its_next_step() {
        let mut schedule = schedule();
        let grid = (Some(at(10_000)), SPAN);
        assert_eq!(schedule.wake(0, at(0), grid, None), Some(at(9_800)));
        assert_eq!(schedule.wake(0, at(0), grid, Some(at(9_000))), Some(at(9_000)));
        assert_eq!(schedule.wake(0, at(9_800), grid, Some(at(9_900))), Some(at(9_900)), "it could not begin");
        schedule.prepared(0, at(10_000));
        assert_eq!(schedule.wake(0, at(9_800), grid, Some(at(9_900))), Some(at(10_000)));
    }
}
