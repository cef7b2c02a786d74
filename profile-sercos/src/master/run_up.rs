//! Where the master is on its way through the phases, and where it shall go.

use profile_generic::time::{DurationNs, MonotonicTime};

use super::phase::{PhaseEvent, State};
use crate::wire::header::Phase;

/// State and target of the run-up.
#[derive(Debug)]
pub(super) struct RunUp {
    state: State,
    /// `None` for no telegrams.
    pub target: Option<Phase>,
    /// Start of the present state.
    since: MonotonicTime,
    /// Cycles sent in the present state.
    pub cycles: u32,
    /// The slaves meet the condition of the present state.
    pub condition: bool,
    /// No slave inserted data in the cycle before.
    left_before: bool,
    /// The application is through.
    pub proceed: bool,
}

impl RunUp {
    pub fn new() -> RunUp {
        RunUp {
            state: State::Nrt,
            target: None,
            since: MonotonicTime::ZERO,
            cycles: 0,
            condition: false,
            left_before: false,
            proceed: false,
        }
    }

    pub fn state(&self) -> State {
        self.state
    }

    /// The phase to go to; CP0 is the way to no telegrams.
    pub fn wanted(&self) -> Phase {
        self.target.unwrap_or(Phase::CP0)
    }

    /// Time in the present state.
    pub fn age(&self, now: MonotonicTime) -> DurationNs {
        now - self.since
    }

    /// Moves on by `event`. Gives the state before; `None` when the event means nothing in this state.
    pub fn advance(&mut self, now: MonotonicTime, event: PhaseEvent) -> Option<State> {
        let next = self.state.next(event)?;
        let last = self.state;
        *self = RunUp { state: next, target: self.target, since: now, ..RunUp::new() };
        Some(last)
    }

    /// A lower phase is wanted, or no telegrams.
    pub fn wants_down(&self) -> Option<PhaseEvent> {
        let level = match self.state {
            State::Silence1 => Phase::CP1,
            State::Silence2 => Phase::CP2,
            State::Silence3 => Phase::CP3,
            state => state.phase().unwrap_or(Phase::CP0),
        };
        match self.target {
            Some(target) => (target < level).then_some(PhaseEvent::Restart),
            None if level > Phase::CP0 => Some(PhaseEvent::Restart),
            None => (self.state != State::Down && self.state != State::Nrt).then_some(PhaseEvent::Stop),
        }
    }

    /// Takes whether no slave inserted data in this cycle; `true` when the phase can be left. With two ports that takes two
    /// cycles in a row: in the first one the copy into which a slave still writes may be lost.
    pub fn have_left(&mut self, left: bool, one_port: bool) -> bool {
        let before = core::mem::replace(&mut self.left_before, left);
        left && (before || one_port)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_state_begins_without_what_was_true_in_the_last_one() {
        let mut run = RunUp::new();
        run.target = Some(Phase::CP4);
        (run.cycles, run.condition, run.proceed) = (7, true, true);
        assert_eq!(run.advance(MonotonicTime(5), PhaseEvent::Ready), None);
        assert_eq!((run.state(), run.cycles), (State::Nrt, 7));
        assert_eq!(run.advance(MonotonicTime(5), PhaseEvent::Up), Some(State::Nrt));
        assert_eq!((run.state(), run.target), (State::Listen, Some(Phase::CP4)));
        assert_eq!((run.cycles, run.condition, run.proceed), (0, false, false));
        assert_eq!(run.age(MonotonicTime(9)), DurationNs(4));
    }

    #[test]
    fn way_down_by_state_and_target() {
        let run = |state, target| RunUp { state, target, ..RunUp::new() };
        let cases = [
            (State::Cp4, Some(Phase::CP4), None),
            (State::Cp4, Some(Phase::CP2), Some(PhaseEvent::Restart)),
            (State::Cp4, None, Some(PhaseEvent::Restart)),
            (State::Silence3, Some(Phase::CP2), Some(PhaseEvent::Restart)),
            (State::Silence3, Some(Phase::CP3), None),
            (State::Cp0, None, Some(PhaseEvent::Stop)),
            (State::Listen, None, Some(PhaseEvent::Stop)),
            (State::Down, None, None),
            (State::Nrt, None, None),
        ];
        for (state, target, wanted) in cases {
            assert_eq!(run(state, target).wants_down(), wanted, "{state:?} {target:?}");
        }
    }

    #[test]
    fn phase_is_left_after_two_cycles_with_two_ports() {
        let mut run = RunUp::new();
        assert_eq!([true, true].map(|left| run.have_left(left, false)), [false, true]);
        assert_eq!([false, true, false].map(|left| run.have_left(left, true)), [false, true, false]);
    }
}
