//! Values that are computed from others: sums, products, ratios and selections of parameters and constants.
//!
//! Every value is a whole number in the unit of its quantity. One row computes exactly, multiplies by one ratio, which has the
//! factor of the row and the units in it, and rounds once. A result beyond its range is refused, or held at the end of the range
//! where the row says why that is right; it never wraps.

use profile_generic::parameter::Parameter;
use profile_generic::ratio::{Ratio, Rounding, quotient};

/// The most parameters that a drive is asked for to compute one value.
pub const READS_MAX: usize = 8;

/// The most rows that a value is computed by, its own included.
pub const ROWS_MAX: usize = 8;

/// Something that a row computes with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operand {
    /// A parameter of the drive, by its place in [`Computation::reads`].
    Read(usize),
    /// Always the same.
    Constant(i64),
    /// The result of an earlier row, by its place.
    Row(usize),
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
}

/// A parameter that a drive is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Read {
    /// The parameter.
    pub parameter: Parameter,
    /// Least and greatest value that it may have.
    pub range: Option<(i64, i64)>,
}

/// How the value of a parameter is computed, and which operand is written when it is set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Computation {
    /// What the drive is asked for, at most [`READS_MAX`].
    pub reads: Vec<Read>,
    /// The rows, at most [`ROWS_MAX`]; each uses earlier ones only, and the last one is the value.
    pub rows: Vec<Row>,
    /// The place in `reads` of the operand of the last row that is written.
    pub written: Option<usize>,
}

/// What is known of the parameters of a [`Computation`], in the order of its reads.
pub type Known = [Option<i64>; READS_MAX];

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
        };
        let solved = divide(top, bottom, row.rounding)?;
        if read.range.is_some_and(|(low, high)| !(low..=high).contains(&solved)) {
            return Err(NoValue::Beyond);
        }
        Ok((read.parameter, solved))
    }

    /// The result of a row.
    ///
    /// # Errors
    /// As [`Computation::value`].
    pub fn row(&self, at: usize, known: &Known) -> Result<i64, NoValue> {
        let row = self.rows.get(at).ok_or(NoValue::Beyond)?;
        let (top, bottom) = match &row.operation {
            Operation::Sum(plus, less) => (self.sum((plus, less), None, known)?, 1),
            Operation::Product(factors) => (self.product(factors, None, known)?, 1),
            Operation::Ratio(dividend, divisor) => {
                (self.operand(*dividend, known)?, self.operand(*divisor, known)?)
            }
            Operation::Selection(by, choices) => (self.operand(self.choice(*by, choices, known)?, known)?, 1),
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
            Operand::Read(at) => {
                let value = known.get(at).copied().flatten().ok_or(NoValue::Needs(at))?;
                let range = self.reads.get(at).and_then(|read| read.range);
                if range.is_some_and(|(low, high)| !(low..=high).contains(&value)) {
                    return Err(NoValue::Operand(at));
                }
                value
            }
        }))
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

    /// All of them multiplied, without one of them.
    fn product(&self, factors: &[Operand], without: Option<Operand>, known: &Known) -> Result<i128, NoValue> {
        let mut factors = factors.iter().filter(|factor| Some(**factor) != without);
        factors.try_fold(1, |product, factor| times(product, self.operand(*factor, known)?))
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

/// A product that fits 127 bits.
fn times(one: i128, other: i128) -> Result<i128, NoValue> {
    one.checked_mul(other).ok_or(NoValue::Beyond)
}

/// A quotient that fits 64 bits.
fn divide(top: i128, bottom: i128, rounding: Rounding) -> Result<i64, NoValue> {
    let outcome = quotient(top, bottom, rounding).ok_or(NoValue::Divisor)?;
    if outcome.saturated { Err(NoValue::Beyond) } else { Ok(outcome.value) }
}
