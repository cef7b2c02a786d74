//! Modes that a drive carries out by itself: homing, by procedure commands or by a mode of its own.
//!
//! ```text
//! wanted --> Clear(0) --> Start(0) --> Process(0) --> Stand(1) --> Clear(1) ... --> Process(last)
//!              write 0      write 3      data status               |                     |
//!                                                          refused, error            all done
//!                                                                  v                     v
//!              Failed, Done <-- Settling <-- last one cancelled -- Cancel(n) ... Cancel(0)
//! ```
//!
//! A command stays set until all are through, then they are cancelled, the last one first: only then the drive follows
//! command values again. No longer wanting it, or losing the operation of the drive, cancels on the way. A drive that comes
//! (back) to the bus may still have commands set, and would not follow: they are cancelled before anything else. Everything
//! goes over the service channel, one access at a time, beside the cycle.
//!
//! ```text
//! wanted --> Enter ---------> Run ------------> Leave ---------------> Settling --> Done, Failed
//!            mode, no bit     bit, until the    no bit, until the      the mode of before, until
//!            until it shows   status tells      axis stands            the drive follows
//! ```
//!
//! A mode of its own ends likewise, and it ends after its time in any case.

use profile_generic::image::StatusBits;
use profile_generic::mode::ModeSelection;
use profile_generic::time::{DurationNs, MonotonicTime};

use crate::engine::access::{Access, AccessFailure, Operation, Progress};
use crate::mapping::{ModeProcedure, Procedure, ProcedureBy};

/// How often the drive is asked how far a command is.
const ASK_EVERY: DurationNs = DurationNs::from_millis(10);

/// How long the drive may take, after the last command was cancelled, until it follows command values again.
const FOLLOW_TIME_OUT: DurationNs = DurationNs::from_millis(500);

/// Accesses of a cancellation that the drive does not answer before it is given up.
const CANCEL_ATTEMPTS: u8 = 3;

/// How long the drive may take to show the mode of a procedure, and how long what it shows may be of the procedure before.
const MODE_TIME: DurationNs = DurationNs::from_millis(100);

/// How long the drive may take to come to rest after a procedure has ended.
const REST_TIME_OUT: DurationNs = DurationNs::from_secs(30);

/// Fresh telegrams after the end until its values are those of after it.
const SETTLED_AFTER: u8 = 2;

/// What comes of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    Done,
    Failed,
    /// Nobody wants it any longer.
    Dropped,
}

/// Where it stands; the numbers are places among the commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Stage {
    #[default]
    Idle,
    Clear(usize),
    Start(usize),
    Process(usize),
    /// The command before this one is done: the controller has to stop the axis.
    Stand(usize),
    Cancel(usize, End),
    /// The drive is told the mode of the procedure.
    Enter,
    /// The procedure is asked for. `stale` is whether the drive still shows an end as it did before.
    Run {
        stale: bool,
    },
    /// The procedure has ended: the axis has to come to rest. So many telegrams came since.
    Leave(End, u8),
    /// Through with the commands; the drive has to follow command values again.
    Settling(End),
    Ended(End),
}

/// An access to the service channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProcedureAccess {
    /// Cancels what may be left of a command since before the drive came to the bus.
    Sweep(usize),
    /// Takes back what may be left of a command.
    Clear(usize),
    /// Sets and starts a command.
    Start(usize),
    /// Asks how far it is.
    Ask(usize),
    /// Cancels the command.
    Cancel(usize),
}

/// What the unit has to know of the axis in each cycle.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings {
    /// The instant of this cycle, on the local clock.
    pub now: MonotonicTime,
    /// The axis is in operation.
    pub operating: bool,
    /// The actual velocity is not above the standstill speed.
    pub stands: bool,
    /// It follows command values.
    pub follows: bool,
    /// The operation mode that it shows.
    pub shown: Option<ModeSelection>,
    /// The status that it shows.
    pub status: u32,
}

/// The procedures of one axis.
#[derive(Debug, Clone, Copy, Default)]
pub struct ProcedureUnit {
    stage: Stage,
    /// Commands of all procedures that may still be left to be cancelled.
    left_over: usize,
    /// What is being carried out.
    selection: ModeSelection,
    outstanding: Option<ProcedureAccess>,
    /// Counts restarts: answers of an earlier one do not count.
    generation: u8,
    ask_at: MonotonicTime,
    since: MonotonicTime,
    attempts: u8,
    homed: bool,
    /// The mode in which the drive was before it was told one of its own for the procedure.
    before: Option<ModeSelection>,
}

impl ProcedureUnit {
    /// The drive was lost or is new: nothing is under way, and all that it has of these procedures is cancelled.
    pub fn restart(&mut self, procedures: &[Procedure]) {
        let left_over = procedures.iter().map(|procedure| procedure.commands().len()).sum();
        *self = Self { generation: self.generation.wrapping_add(1), left_over, ..Self::default() };
    }

    /// One that is over is begun anew if it is still wanted; returns whether one was over.
    pub fn repeat(&mut self) -> bool {
        let is_over = matches!(self.stage, Stage::Ended(_));
        if is_over {
            (self.stage, self.homed) = (Stage::Idle, false);
        }
        is_over
    }

    /// Tells what is wanted, in every cycle in which the drive was heard.
    pub fn want(&mut self, wanted: Option<&Procedure>, around: &Surroundings) {
        let same = wanted.filter(|procedure| procedure.selection == self.selection);
        match self.stage {
            Stage::Idle | Stage::Ended(_) => {
                let Some(procedure) = wanted else {
                    self.stage = Stage::Idle;
                    return;
                };
                if matches!(self.stage, Stage::Idle | Stage::Ended(End::Dropped)) || same.is_none() {
                    self.begin(procedure, around);
                }
            }
            Stage::Settling(end) => {
                let there = self.before.is_none_or(|mode| around.shown == Some(mode));
                let late = around.now.since(self.since) > FOLLOW_TIME_OUT;
                if around.follows && there || !around.operating || late {
                    self.stage = Stage::Ended(end);
                    self.homed |= end == End::Done;
                }
            }
            Stage::Cancel(..) => {}
            Stage::Enter | Stage::Run { .. } | Stage::Leave(..) => self.advance_mode(same, around),
            Stage::Clear(at) | Stage::Start(at) | Stage::Process(at) | Stage::Stand(at) => {
                match (same, self.stage) {
                    (None, _) => self.end(at, End::Dropped),
                    (Some(_), _) if !around.operating => self.end(at, End::Failed),
                    (Some(_), Stage::Stand(_)) if around.stands => self.stage = Stage::Clear(at),
                    _ => {}
                }
            }
        }
    }

    fn begin(&mut self, procedure: &Procedure, around: &Surroundings) {
        let there = procedure.led_in.is_none_or(|mode| around.shown == Some(mode));
        if around.operating && around.follows && there && self.left_over == 0 {
            self.selection = procedure.selection;
            (self.stage, self.before) = match procedure.by {
                ProcedureBy::Commands(_) => (Stage::Clear(0), None),
                ProcedureBy::Mode(_) => (Stage::Enter, around.shown),
            };
            self.since = around.now;
            self.homed = false;
        }
    }

    /// A procedure that is a mode of its own.
    fn advance_mode(&mut self, wanted: Option<&Procedure>, around: &Surroundings) {
        let mode = wanted.and_then(|procedure| match &procedure.by {
            ProcedureBy::Mode(mode) => Some(mode),
            ProcedureBy::Commands(_) => None,
        });
        let passed = around.now.since(self.since);
        let next = match (self.stage, mode) {
            (Stage::Leave(end, came), _) => leave(end, came, passed, around),
            (_, None) => Stage::Leave(End::Dropped, 0),
            (_, Some(_)) if !around.operating => Stage::Leave(End::Failed, 0),
            (Stage::Enter, Some(mode)) if mode.shown.matches(around.status) => {
                Stage::Run { stale: mode.is_done(around.status) || mode.has_failed(around.status) }
            }
            (Stage::Enter, Some(_)) if passed > MODE_TIME => Stage::Leave(End::Failed, 0),
            (Stage::Run { stale }, Some(mode)) => run(mode, stale, passed, around),
            (stage, _) => stage,
        };
        let same = std::mem::discriminant(&next) == std::mem::discriminant(&self.stage);
        self.stage = next;
        if !same {
            self.since = around.now;
        }
    }

    /// The mode that the drive is to be told in place of the one that is chosen: its own of the procedure, and the one of
    /// before when it is through.
    pub fn told(&self) -> Option<ModeSelection> {
        match self.stage {
            Stage::Enter | Stage::Run { .. } | Stage::Leave(..) => Some(self.selection),
            Stage::Settling(_) | Stage::Ended(_) => self.before,
            _ => None,
        }
    }

    /// Whether the drive is asked to carry the procedure out.
    pub fn is_requested(&self) -> bool {
        matches!(self.stage, Stage::Run { .. })
    }

    /// Whether the positions of the drive may have got another reference in this cycle.
    pub fn has_shifted(&self) -> bool {
        matches!(self.stage, Stage::Leave(End::Done, ..=SETTLED_AFTER))
    }

    /// On to the end by cancelling what was set, from this place on.
    fn end(&mut self, at: usize, end: End) {
        self.stage = Stage::Cancel(at, end);
        self.attempts = 0;
    }

    /// What is carried out, or was and is still chosen.
    pub fn selection(&self) -> Option<ModeSelection> {
        (self.stage != Stage::Idle).then_some(self.selection)
    }

    /// Whether the drive need not follow command values: from the start of the first command until it follows again
    /// after the last.
    pub fn leads(&self) -> bool {
        !matches!(self.stage, Stage::Idle | Stage::Ended(_) | Stage::Clear(0) | Stage::Enter)
    }

    /// Whether set-points of a controller that moves the axis meanwhile count: until it stands at the place.
    pub fn takes_set_points(&self, procedure: &Procedure) -> bool {
        procedure.led_in.is_some()
            && matches!(
                self.stage,
                Stage::Idle | Stage::Clear(0) | Stage::Start(0) | Stage::Process(0) | Stage::Stand(_)
            )
    }

    /// The bits that say how it went.
    pub fn status(&self) -> StatusBits {
        let mut status = StatusBits::empty();
        status.set(StatusBits::HOMED, self.homed);
        let found = matches!(
            self.stage,
            Stage::Stand(_) | Stage::Clear(1..) | Stage::Start(1..) | Stage::Process(1..)
        );
        status.set(StatusBits::HOME_FOUND, found);
        status.set(StatusBits::HOMING_FAILED, self.stage == Stage::Ended(End::Failed));
        status
    }

    /// Bits that [`ProcedureUnit::status`] tells about.
    pub const STATUS: StatusBits =
        StatusBits::HOMED.union(StatusBits::HOME_FOUND).union(StatusBits::HOMING_FAILED);

    /// The place of the axis has no reference any more.
    pub fn lose_reference(&mut self) {
        self.homed = false;
    }

    /// The next access to the drive's service channel, if one is due and none under way.
    pub fn access(
        &self,
        procedures: &[Procedure],
        now: MonotonicTime,
    ) -> Option<(Access, ProcedureAccess, u8)> {
        if self.outstanding.is_some() {
            return None;
        }
        if let Some(at) = self.left_over.checked_sub(1) {
            // The last one first.
            let item = *procedures.iter().flat_map(Procedure::commands).nth(at)?;
            let cancel = Access::new(item, Operation::Cancel).urgent();
            return Some((cancel, ProcedureAccess::Sweep(at), self.generation));
        }
        let procedure = self.of(procedures)?;
        let (at, access, operation) = match self.stage {
            Stage::Clear(at) => (at, ProcedureAccess::Clear(at), Operation::Cancel),
            Stage::Start(at) => (at, ProcedureAccess::Start(at), Operation::Start),
            Stage::Process(at) if now >= self.ask_at => (at, ProcedureAccess::Ask(at), Operation::Progress),
            Stage::Cancel(at, _) => (at, ProcedureAccess::Cancel(at), Operation::Cancel),
            _ => return None,
        };
        let item = *procedure.commands().get(at)?;
        Some((Access::new(item, operation).urgent(), access, self.generation))
    }

    /// The procedure that is carried out.
    fn of<'p>(&self, procedures: &'p [Procedure]) -> Option<&'p Procedure> {
        let selection = self.selection()?;
        procedures.iter().find(|procedure| procedure.selection == selection)
    }

    /// The access was handed to the service channel.
    pub fn sent(&mut self, access: ProcedureAccess) {
        self.outstanding = Some(access);
    }

    /// Takes the answer to an access. Whether positions may have another reference now.
    pub fn answer(
        &mut self,
        procedures: &[Procedure],
        access: ProcedureAccess,
        generation: u8,
        result: Result<Progress, AccessFailure>,
        now: MonotonicTime,
    ) -> bool {
        if generation != self.generation || self.outstanding != Some(access) {
            return false;
        }
        self.outstanding = None;
        let commands = self.of(procedures).map_or(0, |procedure| procedure.commands().len());
        match (self.stage, access, result) {
            // A drive that does not let it be cancelled has none that is set.
            (_, ProcedureAccess::Sweep(at), _) => self.left_over = at,
            (Stage::Clear(at), ProcedureAccess::Clear(_), Ok(_)) => self.stage = Stage::Start(at),
            (Stage::Start(at), ProcedureAccess::Start(_), Ok(_)) => {
                self.stage = Stage::Process(at);
                self.ask_at = now + ASK_EVERY;
            }
            (Stage::Process(at), ProcedureAccess::Ask(_), Ok(progress)) => match progress {
                Progress::InProcess => self.ask_at = now + ASK_EVERY,
                Progress::Done if at + 1 < commands => self.stage = Stage::Stand(at + 1),
                Progress::Done => {
                    self.end(at, End::Done);
                    return true;
                }
                Progress::None | Progress::Failed => self.end(at, End::Failed),
            },
            (Stage::Clear(at) | Stage::Start(at) | Stage::Process(at), _, Err(_)) => {
                self.end(at, End::Failed)
            }
            (Stage::Cancel(at, end), ProcedureAccess::Cancel(_), result) => {
                let again = result.is_err() && self.attempts < CANCEL_ATTEMPTS;
                self.attempts += u8::from(again);
                if !again {
                    self.attempts = 0;
                    self.stage = match at.checked_sub(1) {
                        Some(before) => Stage::Cancel(before, end),
                        None => Stage::Settling(end),
                    };
                    self.since = now;
                }
            }
            // An answer to what was asked before the cancellation.
            _ => {}
        }
        false
    }
}

/// A mode whose bit is taken back, until the axis stands.
fn leave(end: End, came: u8, passed: DurationNs, around: &Surroundings) -> Stage {
    let rests = around.stands && came >= SETTLED_AFTER;
    if rests || !around.operating || passed > REST_TIME_OUT {
        Stage::Settling(end)
    } else {
        Stage::Leave(end, came.saturating_add(1))
    }
}

/// A mode whose bit is set, until the status says how it went. `stale`: what it says may be of the procedure before.
fn run(mode: &ModeProcedure, stale: bool, passed: DurationNs, around: &Surroundings) -> Stage {
    let (done, failed) = (mode.is_done(around.status), mode.has_failed(around.status));
    let stale = stale && (done || failed) && passed <= MODE_TIME;
    if !stale && done {
        Stage::Leave(End::Done, 0)
    } else if !stale && failed || passed > mode.time_out {
        Stage::Leave(End::Failed, 0)
    } else {
        Stage::Run { stale }
    }
}

#[cfg(test)]
mod tests;
