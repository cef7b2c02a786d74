//! Values that are computed from others: sums, products, ratios, limits and selections of parameters, signals and constants.
//!
//! Every value is a whole number in the unit of its quantity. One row computes exactly, multiplies by one ratio, which has the
//! factor of the row and the units in it, and rounds once. A result beyond its range is refused, or held at the end of the range
//! where the row says why that is right; it never wraps.

use profile_generic::image::Signal;
use profile_generic::mode::OperatingMode;
use profile_generic::parameter::Parameter;
use profile_generic::ratio::{Ratio, Rounding, quotient};

use super::drive_program::DriveProgram;

/// The most parameters and signals that one value is computed from.
pub const READS_MAX: usize = 36;

/// The most rows that a value is computed by, its own included.
pub const ROWS_MAX: usize = 20;

/// Something that a row computes with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operand {
    /// A parameter of the drive or a signal, by its place in [`Computation::reads`].
    Read(usize),
    /// Always the same.
    Constant(i64),
    /// The result of an earlier row, by its place.
    Row(usize),
    /// A parameter of the drive, by its place in [`Computation::reads`], and the row that computes it for a drive without it. In an
    /// operating mode that is not one of the row's it is 0.
    ReadOrRow(usize, usize),
}

/// A value between ends. An end that the drive does not have does not count; a value that is not held needs one on either side, as
/// nobody knows without them whether a limit acts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Limit {
    /// What is limited.
    pub value: Operand,
    /// Lower ends: the highest counts.
    pub least: Vec<Operand>,
    /// Upper ends: the lowest counts.
    pub most: Vec<Operand>,
    /// Ends of both directions, as magnitudes.
    pub within: Vec<Operand>,
    /// Whether a value beyond an end is held at it. Otherwise a value that is not between the ends gives no result.
    pub holds: bool,
}

/// How a row computes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Operation {
    /// All of the first, less all of the others.
    Sum(Vec<Operand>, Vec<Operand>),
    /// All of them, multiplied.
    Product(Vec<Operand>),
    /// Dividend and divisor.
    Ratio(Operand, Operand),
    /// The one whose number is the value of the first.
    Selection(Operand, Vec<(i64, Operand)>),
    /// A value between ends.
    Limit(Limit),
}

impl Operation {
    /// Everything that it computes with.
    pub fn operands(&self) -> Vec<Operand> {
        match self {
            Self::Sum(plus, less) => [plus.as_slice(), less].concat(),
            Self::Product(factors) => factors.clone(),
            Self::Ratio(dividend, divisor) => vec![*dividend, *divisor],
            Self::Selection(by, choices) => {
                [*by].into_iter().chain(choices.iter().map(|(_, taken)| *taken)).collect()
            }
            Self::Limit(Limit { value, least, most, within, .. }) => {
                [std::slice::from_ref(value), least, most, within].concat()
            }
        }
    }
}

/// One row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// The parameter that it computes.
    pub parameter: Parameter,
    /// How.
    pub operation: Operation,
    /// What the result is multiplied by: the factor of the row, and what its units make.
    pub factor: Ratio,
    /// How the product becomes a whole number.
    pub rounding: Rounding,
    /// Least and greatest result.
    pub range: Option<(i64, i64)>,
    /// Whether a result beyond is held at the end of the range; it is refused otherwise.
    pub saturates: bool,
    /// Operating modes in which it is computed; in others, and without torque, it is 0. Every one where there is none.
    pub modes: Vec<OperatingMode>,
}

/// A value that is not computed: of the drive, or of its process image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Read {
    /// The signal. It counts as long as it has a value; the parameter counts otherwise.
    pub signal: Option<Signal>,
    /// The parameter that the drive is asked for.
    pub parameter: Option<Parameter>,
    /// Whether it is 0 in a drive that lacks the parameter and whose loops are those of its profile.
    pub is_zero_if_missing: bool,
    /// Least and greatest value that it may have.
    pub range: Option<(i64, i64)>,
}

/// How the value of a parameter is computed, and which operand is written when it is set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Computation {
    /// What is not computed, at most [`READS_MAX`].
    pub reads: Vec<Read>,
    /// The rows, at most [`ROWS_MAX`]; each uses earlier ones only, and the last one is the value.
    pub rows: Vec<Row>,
    /// The place in `reads` of the operand of the last row that is written.
    pub written: Option<usize>,
}

/// What is known of one of the [`Computation::reads`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Fact {
    /// The drive has it and was not asked yet.
    #[default]
    Unknown,
    /// Its value.
    Value(i64),
    /// The drive does not have it.
    Absent,
    /// A signal that has no value now.
    Silent,
}

/// What controls the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Control {
    /// Nothing: there is no torque, and no loop is closed.
    #[default]
    Off,
    /// The set-points of the gateway, in this mode.
    Gateway(OperatingMode),
    /// The drive by itself, such as in a stop.
    Drive,
}

/// What is known of the reads of a [`Computation`], in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Known {
    /// Each of them.
    pub facts: [Fact; READS_MAX],
    /// What controls the axis.
    pub control: Control,
}

// Longer arrays have no default of their own.
impl Default for Known {
    fn default() -> Self {
        Self { facts: [Fact::default(); READS_MAX], control: Control::default() }
    }
}

/// Why there is no value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoValue {
    /// The parameter in this place of the reads has to be known first.
    #[error("a parameter of the drive is not known yet")]
    Needs(usize),
    /// The parameter in this place of the reads is beyond its range.
    #[error("the drive has a value that is beyond the range of its parameter")]
    Operand(usize),
    /// The result, or a number on the way to it, is beyond the range.
    #[error("the result is beyond its range")]
    Beyond,
    /// A divisor is zero.
    #[error("the divisor is 0")]
    Divisor,
    /// The selecting value is none of the choices, or selects another operand than the written one.
    #[error("no choice has the number {0}")]
    Choice(i64),
    /// The drive does not have what is in this place of the reads.
    #[error("the drive does not have what the value is computed from")]
    Absent(usize),
    /// The signal in this place of the reads has no value.
    #[error("a signal has no value now")]
    Silent(usize),
    /// It has no value in this operating mode, or while the drive moves by itself.
    #[error("there is no such value in this operating mode or state of the drive")]
    Mode,
    /// A limit acts, so that what it is computed from is not the value.
    #[error("the drive holds the value at a limit")]
    Limited,
    /// Nothing is written when the parameter is set.
    #[error("the value can only be read")]
    ReadOnly,
}

impl Computation {
    /// The value.
    ///
    /// # Errors
    /// [`NoValue::Needs`] until everything is known that counts; another one where there is no value.
    pub fn value(&self, known: &Known) -> Result<i64, NoValue> {
        self.row(self.rows.len().saturating_sub(1), known)
    }

    /// Whether a drive with this program has what the value is computed from, in one of its operating modes at least.
    #[must_use]
    pub fn is_possible(&self, program: &DriveProgram) -> bool {
        self.is_possible_with(program, &|read| read.is_in(program))
    }

    /// Whether that is so in every cycle: signals that the telegrams carry, and settings, for which this is true.
    pub fn is_cyclic(&self, program: &DriveProgram, is_setting: impl Fn(Parameter) -> bool) -> bool {
        self.is_possible_with(program, &|read| {
            read.is_carried(program)
                || read.kept(program).is_some()
                || (read.parameter.is_some_and(&is_setting) && read.is_in(program))
                || matches!(read.of_drive(program), Fact::Value(_))
        })
    }

    fn is_possible_with(&self, program: &DriveProgram, is_there: &dyn Fn(&Read) -> bool) -> bool {
        let modes = OperatingMode::ALL.iter().copied();
        let mut modes = modes.filter(|mode| *mode == OperatingMode::None || program.has_mode(*mode));
        let last = self.rows.len().saturating_sub(1);
        modes.any(|mode| self.row_is_possible(last, mode, program, is_there) == Some(true))
    }

    /// Whether a drive has what a row needs in a mode; `None` for what is 0 in this mode.
    fn row_is_possible(
        &self,
        at: usize,
        mode: OperatingMode,
        program: &DriveProgram,
        is_there: &dyn Fn(&Read) -> bool,
    ) -> Option<bool> {
        let Some(row) = self.rows.get(at) else { return Some(false) };
        // What the loops make in a mode follows from the profile of a drive; of one without parameters it is not known.
        if !row.modes.is_empty() && !program.has_parameters() {
            return Some(false);
        }
        if !row.modes.is_empty() && !row.modes.contains(&mode) {
            return None;
        }
        let has = |operand: &Operand| match *operand {
            Operand::Constant(_) => None,
            Operand::Row(at) => self.row_is_possible(at, mode, program, is_there),
            Operand::Read(at) => Some(self.reads.get(at).is_some_and(is_there)),
            Operand::ReadOrRow(read, at) => match self.row_is_possible(at, mode, program, is_there) {
                Some(false) => Some(self.reads.get(read).is_some_and(is_there)),
                other => other,
            },
        };
        let both = |all: Option<bool>, one: Option<bool>| match (all, one) {
            (None, other) | (other, None) => other,
            (Some(all), Some(one)) => Some(all && one),
        };
        let all = |operands: &[Operand]| operands.iter().map(&has).fold(None, both);
        match &row.operation {
            Operation::Selection(by, choices) => {
                let choice = choices.iter().any(|(_, taken)| has(taken) != Some(false));
                has(by).map(|by| by && choice)
            }
            Operation::Limit(Limit { value, least, most, within, holds }) => {
                let any =
                    |ends: &[Operand]| *holds || ends.iter().chain(within).any(|end| has(end) != Some(false));
                has(value).map(|value| value && any(least) && any(most))
            }
            Operation::Sum(plus, less) => both(all(plus), all(less)),
            Operation::Product(factors) => all(factors),
            Operation::Ratio(dividend, divisor) => both(has(dividend), has(divisor)),
        }
    }

    /// What is known of its reads: the signals, and what the drive was asked for. `signal` gives the value that a signal has now,
    /// `kept` that of a parameter of the gateway, `asked` what is known of the parameter in this place, which the drive has.
    pub fn known(
        &self,
        program: &DriveProgram,
        control: Control,
        signal: impl Fn(Signal) -> Option<i64>,
        kept: impl Fn(Parameter) -> Option<i64>,
        mut asked: impl FnMut(usize, Parameter) -> Fact,
    ) -> Known {
        let mut known = Known { control, ..Known::default() };
        for (place, (fact, read)) in known.facts.iter_mut().zip(&self.reads).enumerate() {
            *fact = match read.fact(program, &signal, &kept) {
                Fact::Unknown => read.parameter.map_or(Fact::Unknown, |parameter| asked(place, parameter)),
                fact => fact,
            };
        }
        known
    }

    /// What has to be written for the value to become `wanted`, and to which parameter.
    ///
    /// # Errors
    /// As [`Computation::value`]; the operand that is written need not be known.
    pub fn solve(&self, wanted: i64, known: &Known) -> Result<(Parameter, i64), NoValue> {
        let (Some(at), Some(row)) = (self.written, self.rows.last()) else { return Err(NoValue::ReadOnly) };
        let written = Operand::Read(at);
        let read = self.reads.get(at).ok_or(NoValue::ReadOnly)?;
        if row.range.is_some_and(|(low, high)| !(low..=high).contains(&wanted)) {
            return Err(NoValue::Beyond);
        }
        let wanted = i128::from(wanted);
        let (num, den) = (i128::from(row.factor.num()), i128::from(row.factor.den()));
        // The row is `value = operation * num / den`; each of these is that, solved for the operand.
        let (top, bottom) = match &row.operation {
            Operation::Sum(plus, less) => {
                let rest = self.sum((plus, less), Some(written), known)?;
                let rest = Some(times(wanted, den)?.checked_sub(times(rest, num)?).ok_or(NoValue::Beyond)?);
                let is_taken_away = less.contains(&written);
                let top = rest.filter(|_| is_taken_away).map_or(rest, |rest| rest.checked_neg());
                (top.ok_or(NoValue::Beyond)?, num)
            }
            Operation::Product(factors) => {
                let rest = self.product(factors, Some(written), known)?;
                (times(wanted, den)?, times(rest, num)?)
            }
            Operation::Ratio(dividend, divisor) if *dividend == written => {
                (times(times(wanted, self.operand(*divisor, known)?)?, den)?, num)
            }
            Operation::Ratio(dividend, _) => {
                (times(self.operand(*dividend, known)?, num)?, times(wanted, den)?)
            }
            Operation::Selection(by, choices) => {
                if self.choice(*by, choices, known)? != written {
                    return Err(NoValue::Choice(self.selected(*by, known)?));
                }
                (times(wanted, den)?, num)
            }
            // Its ends are none of the controller's to move.
            Operation::Limit(_) => return Err(NoValue::ReadOnly),
        };
        let solved = divide(top, bottom, row.rounding)?;
        if read.range.is_some_and(|(low, high)| !(low..=high).contains(&solved)) {
            return Err(NoValue::Beyond);
        }
        Ok((read.parameter.ok_or(NoValue::ReadOnly)?, solved))
    }

    /// The result of a row.
    ///
    /// # Errors
    /// As [`Computation::value`].
    pub fn row(&self, at: usize, known: &Known) -> Result<i64, NoValue> {
        let row = self.rows.get(at).ok_or(NoValue::Beyond)?;
        if !row.counts(known.control)? {
            return Ok(0);
        }
        let (top, bottom) = match &row.operation {
            Operation::Sum(plus, less) => (self.sum((plus, less), None, known)?, 1),
            Operation::Product(factors) => (self.product(factors, None, known)?, 1),
            Operation::Ratio(dividend, divisor) => {
                (self.operand(*dividend, known)?, self.operand(*divisor, known)?)
            }
            Operation::Selection(by, choices) => (self.operand(self.choice(*by, choices, known)?, known)?, 1),
            Operation::Limit(limit) => (self.limited(limit, known)?, 1),
        };
        let top = times(top, i128::from(row.factor.num()))?;
        let bottom = times(bottom, i128::from(row.factor.den()))?;
        let outcome = quotient(top, bottom, row.rounding).ok_or(NoValue::Divisor)?;
        let (low, high) = row.range.unwrap_or((i64::MIN, i64::MAX));
        let held = outcome.value.clamp(low, high);
        if (outcome.saturated || held != outcome.value) && !row.saturates {
            return Err(NoValue::Beyond);
        }
        Ok(held)
    }

    fn operand(&self, operand: Operand, known: &Known) -> Result<i128, NoValue> {
        Ok(i128::from(match operand {
            Operand::Constant(value) => value,
            Operand::Row(at) => self.row(at, known)?,
            Operand::Read(at) => self.read(at, known)?,
            Operand::ReadOrRow(read, at) => {
                let row = self.rows.get(at).ok_or(NoValue::Beyond)?;
                match known.facts.get(read) {
                    Some(Fact::Absent) => self.row(at, known)?,
                    _ if row.counts(known.control)? => self.read(read, known)?,
                    _ => 0,
                }
            }
        }))
    }

    /// The value of one of the reads.
    fn read(&self, at: usize, known: &Known) -> Result<i64, NoValue> {
        let read = self.reads.get(at).ok_or(NoValue::Absent(at))?;
        let value = match known.facts.get(at).copied().unwrap_or_default() {
            Fact::Value(value) => value,
            Fact::Unknown => return Err(NoValue::Needs(at)),
            Fact::Silent => return Err(NoValue::Silent(at)),
            Fact::Absent if read.is_zero_if_missing => 0,
            Fact::Absent => return Err(NoValue::Absent(at)),
        };
        if read.range.is_some_and(|(low, high)| !(low..=high).contains(&value)) {
            return Err(NoValue::Operand(at));
        }
        Ok(value)
    }

    /// A value between its ends.
    fn limited(&self, limit: &Limit, known: &Known) -> Result<i128, NoValue> {
        let value = self.operand(limit.value, known)?;
        let (mut low, mut high) = (None, None);
        let mut end = |operand: Operand, of: [bool; 2]| match self.operand(operand, known) {
            Err(NoValue::Absent(_)) => Ok(()),
            Err(why) => Err(why),
            Ok(end) => {
                if of[0] {
                    let least = if of[1] { -end.abs() } else { end };
                    low = Some(low.map_or(least, |low: i128| low.max(least)));
                }
                if of[1] {
                    let most = if of[0] { end.abs() } else { end };
                    high = Some(high.map_or(most, |high: i128| high.min(most)));
                }
                Ok(())
            }
        };
        for (operands, of) in
            [(&limit.least, [true, false]), (&limit.most, [false, true]), (&limit.within, [true, true])]
        {
            operands.iter().try_for_each(|operand| end(*operand, of))?;
        }
        if limit.holds {
            let (low, high) = (low.unwrap_or(i128::MIN), high.unwrap_or(i128::MAX));
            // Ends that contradict each other hold nothing.
            return if low > high { Err(NoValue::Beyond) } else { Ok(value.clamp(low, high)) };
        }
        let (low, high) = low.zip(high).ok_or(NoValue::Absent(0))?;
        if low < value && value < high { Ok(value) } else { Err(NoValue::Limited) }
    }

    /// All of the first less all of the others, without one of them.
    fn sum(
        &self,
        (plus, less): (&[Operand], &[Operand]),
        without: Option<Operand>,
        known: &Known,
    ) -> Result<i128, NoValue> {
        let mut sum = 0_i128;
        for operand in plus.iter().filter(|operand| Some(**operand) != without) {
            sum = sum.checked_add(self.operand(*operand, known)?).ok_or(NoValue::Beyond)?;
        }
        for operand in less.iter().filter(|operand| Some(**operand) != without) {
            sum = sum.checked_sub(self.operand(*operand, known)?).ok_or(NoValue::Beyond)?;
        }
        Ok(sum)
    }

    /// All of them multiplied, without one of them. With a factor that is 0 the product is 0, whatever the others are.
    fn product(&self, factors: &[Operand], without: Option<Operand>, known: &Known) -> Result<i128, NoValue> {
        let mut product = Ok(1);
        for factor in factors.iter().filter(|factor| Some(**factor) != without) {
            let factor = self.operand(*factor, known);
            if factor == Ok(0) {
                return Ok(0);
            }
            product = product.and_then(|product| times(product, factor?));
        }
        product
    }

    fn selected(&self, by: Operand, known: &Known) -> Result<i64, NoValue> {
        i64::try_from(self.operand(by, known)?).map_err(|_| NoValue::Beyond)
    }

    fn choice(&self, by: Operand, choices: &[(i64, Operand)], known: &Known) -> Result<Operand, NoValue> {
        let selected = self.selected(by, known)?;
        let found = choices.iter().find(|(is, _)| *is == selected);
        found.map(|(_, taken)| *taken).ok_or(NoValue::Choice(selected))
    }
}

impl Row {
    /// Whether it is computed now; it is 0 otherwise.
    fn counts(&self, control: Control) -> Result<bool, NoValue> {
        match control {
            _ if self.modes.is_empty() => Ok(true),
            Control::Off => Ok(false),
            Control::Gateway(mode) => Ok(self.modes.contains(&mode)),
            Control::Drive => Err(NoValue::Mode),
        }
    }
}

impl Read {
    /// Whether a drive with this program has it.
    fn is_in(&self, program: &DriveProgram) -> bool {
        self.is_carried(program)
            || self.kept(program).is_some()
            || self.of_drive(program) != Fact::Absent
            || (self.is_zero_if_missing && program.has_parameters())
    }

    /// Its parameter, if the gateway keeps that itself.
    fn kept(&self, program: &DriveProgram) -> Option<Parameter> {
        self.parameter.filter(|parameter| program.keeps(*parameter))
    }

    /// Whether its signal is in the telegrams, or derived from what is there.
    fn is_carried(&self, program: &DriveProgram) -> bool {
        self.signal
            .is_some_and(|signal| signal.is_command() || program.tells(signal) || program.derives(signal))
    }

    /// What is known of its parameter without asking the drive.
    fn of_drive(&self, program: &DriveProgram) -> Fact {
        match self.parameter {
            Some(Parameter::MOTOR_TURNS_PER_UNIT) => {
                program.motor_turns_per_unit().map_or(Fact::Absent, Fact::Value)
            }
            Some(parameter) if program.parameter(parameter).is_some_and(|held| held.from_drive.is_some()) => {
                Fact::Unknown
            }
            Some(parameter) => program.datum(parameter).map_or(Fact::Absent, Fact::Value),
            None => Fact::Absent,
        }
    }

    /// What is known of it without asking the drive. `signal` gives the value that a signal has now.
    /// `kept` gives what the gateway keeps itself for a drive without it.
    pub fn fact(
        &self,
        program: &DriveProgram,
        signal: impl Fn(Signal) -> Option<i64>,
        kept: impl Fn(Parameter) -> Option<i64>,
    ) -> Fact {
        if let Some(value) = self.kept(program).and_then(kept) {
            return Fact::Value(value);
        }
        if let Some(value) = self.signal.and_then(signal) {
            return Fact::Value(value);
        }
        match self.of_drive(program) {
            Fact::Absent if self.is_carried(program) => Fact::Silent,
            // Of a drive whose loops nobody knows nothing is 0 for certain.
            Fact::Absent if self.is_zero_if_missing && !program.has_parameters() => Fact::Silent,
            known => known,
        }
    }
}

/// A product that fits 127 bits.
fn times(one: i128, other: i128) -> Result<i128, NoValue> {
    one.checked_mul(other).ok_or(NoValue::Beyond)
}

/// A quotient that fits 64 bits.
fn divide(top: i128, bottom: i128, rounding: Rounding) -> Result<i64, NoValue> {
    let outcome = quotient(top, bottom, rounding).ok_or(NoValue::Divisor)?;
    if outcome.saturated { Err(NoValue::Beyond) } else { Ok(outcome.value) }
}
