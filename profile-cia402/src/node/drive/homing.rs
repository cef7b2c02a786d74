//! Homing: how the drive looks for its home position. What the methods are stands in [`crate::drive::homing`].
//!
//! ```text
//! seek    fast, until the switch is closed; a limit switch on the way turns it round or ends it
//! leave   fast, until it is open again: only where the edge that counts is one that closes it
//! cross   slowly over the edge that counts
//! index   slowly on to the next index pulse
//! brake   to a stand; then the home position gets the value of 607Ch
//! ```

use profile_generic::servo::motion::{Motion, Pace};

use super::probe::Passed;
use crate::drive::homing::{Direction, Plan, Progress, Switch};

/// What the drive senses in a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Senses {
    /// The negative limit switch is closed, the positive one, and where they close.
    pub limits: [bool; 2],
    pub limit_places: [i64; 2],
    /// The home switch is closed.
    pub home: bool,
    /// What passed since the last step.
    pub passed: Passed,
    /// 1, 0 or -1: how the servo turns. All directions are its own, whichever way positions count.
    pub moves: i64,
    /// Time since the last step, nanoseconds.
    pub span: i64,
}

/// How fast, nanounits.
#[derive(Debug, Clone, Copy)]
pub(super) struct Speeds {
    /// 6099h:1.
    pub fast: i64,
    /// 6099h:2.
    pub slow: i64,
    /// 609Ah.
    pub acceleration: i64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Step {
    #[default]
    Idle,
    Seek {
        toward: Direction,
        turned: bool,
    },
    Leave,
    Cross,
    /// The edge was at this place, if there was one.
    Index(Direction, Option<i64>),
    /// The home position is known.
    Brake(i64),
    Done,
    /// Moving to a stop after a failure, then standing.
    Failing,
    Failed,
    /// Stopped by bit 4.
    Stopping,
}

/// Homing under way.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Homing {
    plan: Option<Plan>,
    step: Step,
    /// The switch was closed in the step before.
    closed: bool,
}

impl Homing {
    /// Bit 4 rises. Without a plan homing fails.
    pub fn start(&mut self, plan: Option<Plan>, senses: &Senses) {
        self.plan = plan;
        self.step = match plan {
            None => Step::Failing,
            Some(Plan::Here) => Step::Brake(i64::MIN),
            Some(Plan::Index(toward)) => Step::Index(toward, None),
            Some(Plan::Edge { switch, end, passed, first, .. }) => {
                self.closed = is_closed(switch, senses);
                match (self.closed, end == passed) {
                    (true, true) => Step::Cross,
                    (true, false) => Step::Leave,
                    (false, _) => Step::Seek { toward: first, turned: false },
                }
            }
        };
    }

    /// Bit 4 is 0: what is under way ends.
    pub fn stop(&mut self) {
        self.step = match self.step {
            Step::Idle | Step::Done | Step::Failed => self.step,
            Step::Failing => Step::Failing,
            _ => Step::Stopping,
        };
    }

    /// Whether it moves the axis.
    pub fn is_active(&self) -> bool {
        !matches!(self.step, Step::Idle | Step::Done | Step::Failed)
    }

    /// What the statusword says about it.
    pub fn progress(&self) -> Progress {
        match self.step {
            Step::Idle => Progress::InterruptedOrNotStarted,
            Step::Done => Progress::Done,
            Step::Failing => Progress::FailedMoving,
            Step::Failed => Progress::FailedStanding,
            _ => Progress::InProgress,
        }
    }

    /// One step. Returns the home position, once the axis stands behind it.
    // Flat: one arm per step.
    pub fn advance(&mut self, motion: &mut Motion, senses: &Senses, speeds: &Speeds) -> Option<i64> {
        let rate = speeds.acceleration.max(1);
        let pace = Pace { velocity: speeds.fast.max(1), acceleration: rate, deceleration: rate };
        let mut go = |toward: Direction, speed: i64| {
            motion.advance(senses.span, toward.sign() * speed.max(1), pace);
        };
        match (self.step, self.plan) {
            (Step::Idle | Step::Done | Step::Failed, _) => motion.advance(senses.span, 0, pace),
            (Step::Brake(_) | Step::Failing | Step::Stopping, _) => {
                motion.advance(senses.span, 0, pace);
                if motion.velocity == 0 {
                    return self.come_to_rest(motion.position);
                }
            }
            (Step::Index(toward, edge), _) => {
                go(toward, speeds.slow);
                self.look_for_index(toward, edge, senses);
            }
            (step, Some(Plan::Edge { switch, end, passed, turns, index, .. })) => {
                let closed = is_closed(switch, senses);
                let was = core::mem::replace(&mut self.closed, closed);
                match step {
                    Step::Seek { toward, turned } => {
                        go(toward, speeds.fast);
                        let closed = closed || switch == Switch::Home && senses.passed.closed.is_some();
                        self.step = match (closed, blocked(toward, self.plan, senses)) {
                            (true, _) if end == passed => Step::Cross,
                            (true, _) => Step::Leave,
                            (false, true) if turns && !turned => {
                                Step::Seek { toward: toward.reversed(), turned: true }
                            }
                            (false, true) => Step::Failing,
                            (false, false) => step,
                        };
                    }
                    Step::Leave => {
                        let back = passed.reversed();
                        go(back, speeds.fast);
                        // Open on the far side, where braking has led it, does not count.
                        let open = senses.passed.opened.is_some() && senses.moves == back.sign();
                        self.step_or_fail(open.then_some(Step::Cross), back, senses);
                    }
                    _ => {
                        go(passed, speeds.slow);
                        let place = edge_of(switch, end == passed, was && !closed, senses);
                        let place = place.filter(|_| senses.moves == passed.sign());
                        let next = place.map(|place| match index {
                            true => Step::Index(passed, Some(place)),
                            false => Step::Brake(place),
                        });
                        self.step_or_fail(next, passed, senses);
                    }
                }
            }
            // Only edges are looked for with a switch.
            (_, _) => self.step = Step::Failing,
        }
        None
    }

    /// The index pulse behind the edge, if there was one, on the way `toward`.
    fn look_for_index(&mut self, toward: Direction, edge: Option<i64>, senses: &Senses) {
        let ahead = toward.sign();
        let beyond = |place: i64| edge.is_none_or(|edge| (place - edge) * ahead >= 0);
        let found = senses.passed.index.filter(|place| senses.moves == ahead && beyond(*place));
        self.step_or_fail(found.map(Step::Brake), toward, senses);
    }

    /// Goes on with the next step, once it is known; fails where the way ends before.
    fn step_or_fail(&mut self, next: Option<Step>, toward: Direction, senses: &Senses) {
        match next {
            Some(next) => self.step = next,
            None if blocked(toward, self.plan, senses) => self.step = Step::Failing,
            None => {}
        }
    }

    fn come_to_rest(&mut self, here: i64) -> Option<i64> {
        let step = match self.step {
            Step::Brake(_) => Step::Done,
            Step::Failing => Step::Failed,
            _ => Step::Idle,
        };
        match core::mem::replace(&mut self.step, step) {
            Step::Brake(i64::MIN) => Some(here),
            Step::Brake(home) => Some(home),
            _ => None,
        }
    }

    /// The axis can move no longer.
    pub fn abort(&mut self) {
        if self.is_active() {
            self.step = if self.step == Step::Stopping { Step::Idle } else { Step::Failed };
        }
    }
}

/// Where the edge of a switch was passed: the one at which it opens, or closes. A limit switch has `left` its place.
fn edge_of(switch: Switch, opens: bool, left: bool, senses: &Senses) -> Option<i64> {
    match switch {
        Switch::Home if opens => senses.passed.opened,
        Switch::Home => senses.passed.closed,
        Switch::NegativeLimit => left.then_some(senses.limit_places[0]),
        Switch::PositiveLimit => left.then_some(senses.limit_places[1]),
    }
}

fn is_closed(switch: Switch, senses: &Senses) -> bool {
    match switch {
        Switch::NegativeLimit => senses.limits[0],
        Switch::PositiveLimit => senses.limits[1],
        Switch::Home => senses.home,
    }
}

/// Whether a limit switch ends the way; not the one that is looked for.
fn blocked(toward: Direction, plan: Option<Plan>, senses: &Senses) -> bool {
    let wanted = match plan {
        Some(Plan::Edge { switch, .. }) => Some(switch),
        _ => None,
    };
    match toward {
        Direction::Negative => senses.limits[0] && wanted != Some(Switch::NegativeLimit),
        Direction::Positive => senses.limits[1] && wanted != Some(Switch::PositiveLimit),
    }
}
