//! Accesses to one parameter of a drive in generic units, from the request to the result.
//!
//! A parameter that the drive has takes one access to the drive. One that is computed takes a read for each operand that counts and
//! that is in no telegram, one after the other, and a write for the operand that is written when it is set. Signals are taken in the
//! cycle in which the last operand is known. What was written is read again where the drive lets it be read, because a drive may take
//! a value and keep another. Nothing is kept here: every value is the drive's at that moment.

use arrayvec::ArrayVec;
use profile_generic::parameter::{Access as When, Parameter};
use profile_generic::state::Report;
use profile_generic::time::{MonotonicTime, SystemTime};

use super::access::{Access, AccessFailure, Refusal};
use super::axis::AxisChannel;
use super::bus::{Answer, Buses, Purpose};
use super::north::Exchange;
use super::sharing::{Rescaling, is_rescaling, sharing};
use crate::mapping::{Computation, DriveProgram, Fact, Item, Known, Mapping, NoValue, READS_MAX};

/// Accesses under way at the same time, of one axis by a controller or of all axes by another north side.
pub const JOBS_MAX: usize = 4;

/// Why an access to a parameter failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ParameterFailure {
    /// The drive does not have it.
    #[error("the drive does not have this parameter")]
    Absent,
    /// It can only be read.
    #[error("the parameter can only be read")]
    ReadOnly,
    /// The value is beyond the range, or the drive does not take it.
    #[error("the value is out of range")]
    Value,
    /// It is not to be written while the drive has torque.
    #[error("the parameter cannot be written while the drive has torque")]
    Torque,
    /// The values of the drive give no result.
    #[error("{0}")]
    NoValue(NoValue),
    /// The drive has taken the value, and says another one when it is asked.
    #[error("the drive has taken the value and kept another one")]
    NotKept,
    /// The drive refused for another reason, mostly that it is not the time for it.
    #[error("the drive refused the access")]
    Refused,
    /// The drive is not there, or did not answer.
    #[error("the drive does not answer")]
    Unanswered,
    /// Too many accesses wait.
    #[error("too many accesses wait for the drive")]
    Busy,
}

impl From<AccessFailure> for ParameterFailure {
    fn from(failure: AccessFailure) -> Self {
        match failure {
            AccessFailure::Refused(Refusal::Unknown) => Self::Absent,
            AccessFailure::Refused(Refusal::ReadOnly) => Self::ReadOnly,
            AccessFailure::Refused(Refusal::Value) => Self::Value,
            AccessFailure::Refused(Refusal::Other) => Self::Refused,
            AccessFailure::Unanswered => Self::Unanswered,
        }
    }
}

/// What the drive was asked last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Asked {
    /// Nothing, or its answer was taken.
    Nothing,
    /// The operand in this place, which is this parameter.
    Operand(usize, Parameter),
    /// The parameter itself.
    Value,
    /// To take a value.
    Write,
    /// What it has made of it.
    ReadBack,
}

/// What a drive has taken.
#[derive(Debug, Clone)]
struct Written {
    parameter: Parameter,
    item: Item,
    bytes: ArrayVec<u8, 8>,
    /// The drive has said that it has it.
    is_taken: bool,
}

/// A thousandth is what a drive may round.
const ROUNDING: u64 = 1_000;

/// What comes next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Next {
    /// The drive is asked this; [`ParameterJob::sent`] says that it was.
    Ask(Access),
    /// The drive was asked.
    Wait,
    /// It is over: the value that was read, or written.
    Done(Result<i64, ParameterFailure>),
}

/// What a north side has in a cycle for its accesses.
pub(super) struct Drives<'a> {
    /// Now, on the local clock and as system time.
    pub now: (MonotonicTime, SystemTime),
    pub mapping: &'a Mapping,
    pub axes: &'a mut [AxisChannel],
    pub buses: &'a mut Buses,
}

impl<'a> Drives<'a> {
    /// Those of an exchange.
    pub fn of(exchange: &'a mut Exchange<'_>, buses: &'a mut Buses) -> Self {
        let now = (exchange.now, exchange.system());
        Self { now, mapping: exchange.mapping, axes: &mut *exchange.axes, buses }
    }
}

/// An access to one parameter.
#[derive(Debug, Clone)]
pub struct ParameterJob {
    parameter: Parameter,
    /// What is written; `None` reads.
    wanted: Option<i64>,
    /// What the drive has answered, in the order of the reads.
    answers: [Option<i64>; READS_MAX],
    next: Asked,
    asked: Asked,
    /// What the drive was sent, if it lets it be read.
    written: Option<Written>,
    rescaling: Rescaling,
    result: Option<Result<i64, ParameterFailure>>,
}

impl ParameterJob {
    /// Reads a parameter, or writes a value to it.
    #[must_use]
    pub const fn new(parameter: Parameter, wanted: Option<i64>) -> Self {
        let (answers, next, asked) = ([None; READS_MAX], Asked::Nothing, Asked::Nothing);
        Self {
            parameter,
            wanted,
            answers,
            next,
            asked,
            written: None,
            rescaling: Rescaling::None,
            result: None,
        }
    }

    /// Asks the drive of an axis for what comes next; the result when it is over. Nothing is written while an axis of the device is
    /// taken, which is asked of each with its number.
    pub(super) fn step(
        &mut self,
        drives: &mut Drives<'_>,
        axis: usize,
        purpose: Purpose,
        is_taken: impl Fn(usize, &AxisChannel) -> bool,
    ) -> Option<Result<i64, ParameterFailure>> {
        let Drives { now, mapping, ref mut axes, ref mut buses } = *drives;
        let Some(channel) = axes.get(axis) else { return Some(Err(ParameterFailure::Unanswered)) };
        // What a controller has set is not written over by what was asked before.
        let may_write = self.wanted.is_some() && !self.is_written();
        if may_write && sharing(axis, axes, buses).any(|(number, axis)| is_taken(number, axis)) {
            return Some(Err(ParameterFailure::Refused));
        }
        let has_torque = sharing(axis, axes, buses).any(|(_, axis)| axis.may_have_torque());
        let over = match self.next(mapping, channel, has_torque) {
            Next::Wait => None,
            Next::Done(result) => Some(result),
            Next::Ask(access) if has_torque && is_rescaling(&access) => Some(Err(ParameterFailure::Torque)),
            Next::Ask(access) if buses.access(axis, &access, purpose) => {
                self.rescaling.asked(&access);
                self.sent();
                None
            }
            Next::Ask(_) => Some(Err(ParameterFailure::Busy)),
        };
        self.rescaling.apply(now, axis, (axes, buses));
        over
    }

    /// What comes next; with torque not every parameter is written.
    pub(super) fn next(&mut self, mapping: &Mapping, axis: &AxisChannel, has_torque: bool) -> Next {
        if let Some(result) = self.result {
            return Next::Done(result);
        }
        if self.asked != Asked::Nothing {
            return Next::Wait;
        }
        let is_gone = axis.feedback().report == Report::Silent;
        if let Some(written) = self.written.as_ref().filter(|written| written.is_taken && !is_gone) {
            self.next = Asked::ReadBack;
            return Next::Ask(Access::read(written.item));
        }
        let refused = self.refused(mapping, has_torque);
        if let Some(failure) = refused.or(is_gone.then_some(ParameterFailure::Unanswered)) {
            self.fail(failure);
            return Next::Done(Err(failure));
        }
        // What the drive itself has goes first.
        let is_computed = axis.south().is_none_or(|program| !has(program, self.parameter));
        let computation = mapping.dictionaries.generic.computation(self.parameter);
        let datum = axis.south().and_then(|program| program.datum(self.parameter));
        let request = match (computation.filter(|_| is_computed), datum, self.wanted) {
            (_, Some(value), None) => Err(Ok(value)),
            (_, Some(_), Some(_)) => Err(Err(ParameterFailure::ReadOnly)),
            (Some(computation), ..) => self.compute(computation, axis),
            (None, None, Some(wanted)) => self.write(self.parameter, wanted, axis),
            (None, None, None) => self.read(self.parameter, Asked::Value, axis),
        };
        match request {
            Ok(Some(access)) => Next::Ask(access),
            Ok(None) => Next::Wait,
            Err(result) => {
                self.result = Some(result);
                Next::Done(result)
            }
        }
    }

    /// Why the value is not written, by what the tables say of the parameter.
    fn refused(&self, mapping: &Mapping, has_torque: bool) -> Option<ParameterFailure> {
        let wanted = self.wanted?;
        let row = mapping.dictionaries.generic.by_number(self.parameter)?;
        match row.access {
            When::Read => Some(ParameterFailure::ReadOnly),
            When::WriteWhileDisabled if has_torque => Some(ParameterFailure::Torque),
            When::Write | When::WriteWhileDisabled => {
                let beyond = row.range.is_some_and(|(low, high)| !(low..=high).contains(&wanted));
                beyond.then_some(ParameterFailure::Value)
            }
        }
    }

    /// Whether a value may have reached the drive.
    fn is_written(&self) -> bool {
        self.asked == Asked::Write || self.written.is_some() || self.result.is_some()
    }

    /// The next step of a computed value; the error is the result.
    fn compute(
        &mut self,
        computation: &Computation,
        axis: &AxisChannel,
    ) -> Result<Option<Access>, Result<i64, ParameterFailure>> {
        let program = axis.south().ok_or(Err(ParameterFailure::Unanswered))?;
        if self.answers.iter().all(Option::is_none) && !computation.is_possible(program) {
            return Err(Err(ParameterFailure::Absent));
        }
        let known = self.known(computation, program, axis);
        let (missing, is_write) = match self.wanted {
            None => match computation.value(&known) {
                Ok(value) => return Err(Ok(value)),
                Err(missing) => (missing, false),
            },
            Some(wanted) => match computation.solve(wanted, &known) {
                Ok((parameter, value)) => return self.write(parameter, value, axis),
                Err(missing) => (missing, true),
            },
        };
        match missing {
            NoValue::Needs(place) => {
                let read = computation.reads.get(place).and_then(|read| read.parameter);
                let parameter = read.ok_or(Err(ParameterFailure::Absent))?;
                self.read(parameter, Asked::Operand(place, parameter), axis)
            }
            // Another operating mode has what this one lacks.
            NoValue::Absent(_) => Err(Err(ParameterFailure::NoValue(NoValue::Mode))),
            NoValue::ReadOnly => Err(Err(ParameterFailure::ReadOnly)),
            NoValue::Beyond | NoValue::Divisor if is_write => Err(Err(ParameterFailure::Value)),
            other => Err(Err(ParameterFailure::NoValue(other))),
        }
    }

    /// What is known of the operands now: what the drive has answered, and the signals of this cycle.
    fn known(&self, computation: &Computation, program: &DriveProgram, axis: &AxisChannel) -> Known {
        let answer = |place: usize, _| match self.answers.get(place) {
            Some(Some(value)) => Fact::Value(*value),
            _ => Fact::Unknown,
        };
        computation.known(
            program,
            axis.control(),
            |signal| axis.signal(signal),
            |parameter| axis.kept(parameter),
            answer,
        )
    }

    fn read(
        &mut self,
        parameter: Parameter,
        next: Asked,
        axis: &AxisChannel,
    ) -> Result<Option<Access>, Result<i64, ParameterFailure>> {
        let program = axis.south().ok_or(Err(ParameterFailure::Unanswered))?;
        let held = program.parameter(parameter).filter(|held| held.from_drive.is_some());
        let held = held.ok_or(Err(ParameterFailure::Absent))?;
        self.next = next;
        Ok(Some(Access::read(held.item)))
    }

    fn write(
        &mut self,
        parameter: Parameter,
        value: i64,
        axis: &AxisChannel,
    ) -> Result<Option<Access>, Result<i64, ParameterFailure>> {
        let program = axis.south().ok_or(Err(ParameterFailure::Unanswered))?;
        let held = program.parameter(parameter).ok_or(Err(ParameterFailure::Absent))?;
        let (bytes, len, clamped) = held.encode(value).ok_or(Err(ParameterFailure::ReadOnly))?;
        if clamped {
            return Err(Err(ParameterFailure::Value));
        }
        self.next = Asked::Write;
        let bytes: ArrayVec<u8, 8> = bytes.iter().take(len).copied().collect();
        let access = Access::write(held.item, &bytes);
        let written = Written { parameter, item: held.item, bytes, is_taken: false };
        self.written = held.from_drive.is_some().then_some(written);
        Ok(access)
    }

    /// The drive was asked what came next.
    pub(super) fn sent(&mut self) {
        self.asked = std::mem::replace(&mut self.next, Asked::Nothing);
    }

    /// It ends so, whatever the drive says.
    pub fn fail(&mut self, failure: ParameterFailure) {
        self.result = Some(Err(failure));
    }

    /// Takes the drive's answer.
    pub fn take(&mut self, answer: &Answer, axis: &AxisChannel) {
        self.rescaling.answered(answer);
        let asked = std::mem::replace(&mut self.asked, Asked::Nothing);
        let data = match &answer.result {
            Ok((data, _)) => data,
            Err(failure) => return self.fail((*failure).into()),
        };
        let parameter = match asked {
            Asked::Nothing => return,
            Asked::Write => {
                match &mut self.written {
                    Some(written) => written.is_taken = true,
                    None => self.result = self.wanted.map(Ok),
                }
                return;
            }
            Asked::ReadBack => {
                let is_kept = self.written.take().is_some_and(|written| written.is_kept(data, axis));
                let wanted = self.wanted.ok_or(ParameterFailure::Absent);
                self.result = Some(if is_kept { wanted } else { Err(ParameterFailure::NotKept) });
                return;
            }
            Asked::Operand(_, parameter) => parameter,
            Asked::Value => self.parameter,
        };
        let held = axis.south().and_then(|program| program.parameter(parameter));
        let Some(value) = held.and_then(|held| held.decode(data)) else {
            return self.fail(ParameterFailure::Unanswered);
        };
        match asked {
            Asked::Operand(place, _) => {
                if let Some(known) = self.answers.get_mut(place) {
                    *known = Some(value);
                }
            }
            _ => self.result = Some(Ok(value)),
        }
    }
}

impl Written {
    /// Whether the drive has kept the value, by what it says now.
    fn is_kept(&self, data: &[u8], axis: &AxisChannel) -> bool {
        let held = axis.south().and_then(|program| program.parameter(self.parameter));
        let value = |bytes: &[u8]| held.and_then(|held| held.decode(bytes));
        let is_near = |(sent, now): (i64, i64)| sent.abs_diff(now) <= sent.unsigned_abs() / ROUNDING;
        self.bytes.as_slice() == data || value(&self.bytes).zip(value(data)).is_some_and(is_near)
    }
}

/// Whether the drive has a parameter that can be read.
fn has(program: &DriveProgram, parameter: Parameter) -> bool {
    program.parameter(parameter).is_some_and(|held| held.from_drive.is_some())
}

/// Accesses under way, each with what it is for.
#[derive(Debug)]
pub struct ParameterJobs<T>(ArrayVec<(T, ParameterJob), JOBS_MAX>);

impl<T> Default for ParameterJobs<T> {
    fn default() -> Self {
        Self(ArrayVec::new())
    }
}

impl<T> ParameterJobs<T> {
    /// Adds an access; `false` if there is no room.
    pub fn push(&mut self, what: T, job: ParameterJob) -> bool {
        self.0.try_push((what, job)).is_ok()
    }

    /// Takes the drive's answer to the access that this is true of; whether there is one.
    pub fn take(&mut self, is: impl Fn(&T) -> bool, answer: &Answer, axis: &AxisChannel) -> bool {
        let job = self.0.iter_mut().find(|(what, _)| is(what));
        job.map(|(_, job)| job.take(answer, axis)).is_some()
    }

    /// Asks drives what comes next, and takes out what is over.
    pub fn advance(
        &mut self,
        mut step: impl FnMut(&T, &mut ParameterJob) -> Option<Result<i64, ParameterFailure>>,
        mut done: impl FnMut(T, Result<i64, ParameterFailure>),
    ) {
        let mut at = 0;
        while let Some((what, job)) = self.0.get_mut(at) {
            match step(what, job) {
                None => at += 1,
                Some(result) => {
                    let (what, _) = self.0.remove(at);
                    done(what, result);
                }
            }
        }
    }
}
