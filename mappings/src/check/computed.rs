//! Computed values: whether a drive has what they are computed from, and whether every result fits.
//!
//! The ranges of the operands are those of their parameters, or else what the drive's bytes can hold. They are carried through the
//! rows exactly: an interval ends where one of its operands ends, as sums, products and quotients rise or fall all the way.

use crate::own_values::{OF_CONFIGURATION, OF_GATEWAY};
use profile_generic::image::Signal;
use profile_generic::parameter::Parameter;
use profile_generic::ratio::quotient;

use crate::attributes::Backing;
use crate::computed::{Computation, Limit, Operand, Operation, Read, Row};
use crate::finding::registry::{self as code, Code};
use crate::finding::{Findings, Problem};
use crate::format::{ComputedRow, Name};
use crate::{CipScaling, DriveProgram, Mapping};

/// Least and greatest value.
type Interval = (i128, i128);

/// What a signal can be that is in no telegram: as many whole numbers as a floating point number holds.
const SIGNAL: Interval = (-(1 << 53), 1 << 53);

/// Why a row has no interval within its range.
enum Unfit {
    /// The divisor can be zero.
    Divisor,
    /// A number on the way needs more than 127 bits.
    Way,
    /// The result is in this interval, which is beyond its range.
    Result(Interval),
    /// The drive lacks an operand.
    Missing,
}

/// The rows of computed values, with what they say.
fn rows(mapping: &Mapping) -> impl Iterator<Item = (&ComputedRow, &Computation)> {
    let generic = &mapping.dictionaries.generic;
    mapping.tables().generic.rows.computed.iter().filter_map(|row| {
        let parameter = generic.parameter(row.parameter.get_ref())?;
        Some((row, generic.computation(parameter.parameter)?))
    })
}

/// Whether a computed value is in a drive as well, and whether any drive has what it is computed from.
pub(super) fn bindings(mapping: &Mapping, findings: &mut Findings) {
    let tables = mapping.tables();
    let of_families = mapping.families().iter().map(|family| &family.mapping);
    let cia402: Vec<_> = of_families.chain([mapping]).map(|known| &known.tables().generic_cia402).collect();
    let generic = &mapping.dictionaries.generic;
    // One of the catalogue is computed for the drives that lack it.
    let is_computed = |name: &Name| {
        let known = generic.parameter(name.get_ref()).filter(|row| row.parameter.is_of_vendor());
        known.is_some_and(|row| generic.computation(row.parameter).is_some())
    };
    let south = "expected no row for a drive: the value is computed";
    for row in tables.generic_sercos.rows.parameter.iter().filter(|row| is_computed(&row.parameter)) {
        let problem = Problem::new(code::CONTRADICTION, row.parameter.span()).key("parameter");
        findings.push(&tables.generic_sercos.text, problem.expected(south));
    }
    for file in &cia402 {
        for row in file.rows.parameter.iter().filter(|row| is_computed(&row.parameter)) {
            let problem = Problem::new(code::CONTRADICTION, row.parameter.span()).key("parameter");
            findings.push(&file.text, problem.expected(south));
        }
    }
    for (row, computation) in rows(mapping) {
        let is_drives = |read: &&Read| read.signal.is_none() && !read.is_zero_if_missing;
        let is_computed = |parameter: &Parameter| {
            *parameter == Parameter::SYSTEM_INERTIA
                || OF_GATEWAY.contains(parameter)
                || OF_CONFIGURATION.contains(parameter)
                || generic.computation(*parameter).is_some()
        };
        let reads = computation.reads.iter().filter(is_drives).filter_map(|read| read.parameter);
        for parameter in reads.filter(|parameter| !is_computed(parameter)) {
            let name = mapping.parameter_name(parameter);
            let is = |known: &Name| *known.get_ref() == name;
            let has = tables.generic_sercos.rows.parameter.iter().any(|row| is(&row.parameter))
                || cia402.iter().any(|file| file.rows.parameter.iter().any(|row| is(&row.parameter)));
            if !has {
                let message = format!(
                    "expected a [[parameter]] row of generic-sercos or generic-cia402 for {name}, got none"
                );
                let problem = Problem::new(code::ROW_MISSING, row.parameter.span()).key("parameter");
                findings.push(&tables.generic.text, problem.expected(message));
            }
        }
    }
}

/// Whether every result fits its range and its attribute, with drives of this program.
pub(super) fn ranges(
    mapping: &Mapping,
    scaling: &CipScaling,
    (program, drives): (&DriveProgram, &str),
    findings: &mut Findings,
) {
    for (row, computation) in rows(mapping) {
        let reads: Vec<_> = computation.reads.iter().map(|read| interval(program, read)).collect();
        // What a drive's bytes can hold says little of the catalogue's: a result that does not fit is refused when it is there.
        let parameter = mapping.dictionaries.generic.parameter(row.parameter.get_ref());
        let Some(parameter) = parameter.filter(|parameter| parameter.parameter.is_of_vendor()) else {
            continue;
        };
        let unit = parameter.quantity.unit();
        let mut results: Vec<Interval> = Vec::new();
        let mut unfit = None;
        for row in &computation.rows {
            match result(row, &reads, &results) {
                Ok(interval) => results.push(interval),
                // What is wrong with a row that this one needs is told there.
                Err(why) if row.parameter == parameter.parameter => unfit = Some(why),
                Err(_) => break,
            }
        }
        let message = match (unfit, results.last()) {
            (Some(Unfit::Divisor), _) => {
                format!("the divisor can be 0 in drives of {drives}: give it a `range` without 0")
            }
            (Some(Unfit::Way), _) => format!(
                "a product on the way can need more than 127 bits with drives of {drives}: give the operands a `range`"
            ),
            (Some(Unfit::Result((low, high))), _) => {
                let held = match parameter.range {
                    Some((least, most)) => format!("{least} to {most} {unit}"),
                    None => "64 bits".to_owned(),
                };
                format!("{low} to {high} {unit} with drives of {drives} do not fit {held}")
            }
            (Some(Unfit::Missing), _) => continue,
            (None, Some(result)) if results.len() == computation.rows.len() => {
                match beyond_attribute(mapping, scaling, parameter.parameter.0, *result) {
                    Some(kind) if parameter.range.is_none() => {
                        let (low, high) = result;
                        format!("{low} to {high} {unit} with drives of {drives} do not fit a {kind}")
                    }
                    _ => continue,
                }
            }
            _ => continue,
        };
        push(mapping, code::COMPUTED_RANGE, &row.parameter, message, findings);
    }
}

/// Reports a row once, however many drives and families show the same.
fn push(mapping: &Mapping, code: Code, name: &Name, message: String, findings: &mut Findings) {
    let text = &mapping.tables().generic.text;
    let (file, line, _) = text.place(name.span().start);
    let known = findings.list().iter().any(|known| {
        known.code == code && known.file == file && known.line == line && known.expected == message
    });
    if !known {
        let help = "give the operands or the result a `range`, or say in `saturates` why a result may be held at its end";
        findings.push(text, Problem::new(code, name.span()).key("parameter").expected(message).help(help));
    }
}

/// What an operand can be that is not computed; `None` where the drive lacks it.
fn interval(program: &DriveProgram, read: &Read) -> Option<Interval> {
    if let Some((low, high)) = read.range {
        let turns = read.parameter == Some(Parameter::MOTOR_TURNS_PER_UNIT);
        let has = turns || program.parameter(read.parameter?).is_some();
        return has.then_some((i128::from(low), i128::from(high)));
    }
    let signal = read.signal.and_then(|signal| of_signal(program, signal));
    let held = read.parameter.and_then(|parameter| {
        let entry = program.parameter(parameter)?;
        let (least, most) = entry.width.range();
        let from_drive = entry.from_drive?;
        let (one, other) = (from_drive.convert(least).value, from_drive.convert(most).value);
        Some((i128::from(one.min(other)), i128::from(one.max(other))))
    });
    let zero = Some((0, 0)).filter(|_| read.is_zero_if_missing);
    [signal, held, zero].into_iter().flatten().reduce(joined)
}

/// What a signal can be; `None` of one that the drive does not send.
fn of_signal(program: &DriveProgram, signal: Signal) -> Option<Interval> {
    (signal.is_command() || program.tells(signal)).then_some(SIGNAL)
}

/// All that is in one of them or between them.
fn joined((low, high): Interval, (least, most): Interval) -> Interval {
    (low.min(least), high.max(most))
}

/// The type of the attribute that does not hold both ends.
fn beyond_attribute(
    mapping: &Mapping,
    scaling: &CipScaling,
    parameter: u16,
    (low, high): Interval,
) -> Option<&'static str> {
    let table = mapping.attribute_table(scaling)?;
    let of =
        |backing: Backing| matches!(backing, Backing::Parameter { parameter: own, .. } if own.0 == parameter);
    let entry = *table.entries().iter().find(|entry| of(entry.backing))?;
    let clamped = |end: i128| {
        let end = i64::try_from(end).ok();
        end.is_none_or(|end| entry.from_generic(end, &mut [0; 8]).is_ok_and(|(_, clamped)| clamped))
    };
    (clamped(low) || clamped(high)).then(|| entry.data_type.name())
}

/// The interval of a row, by those of what it needs.
fn result(row: &Row, reads: &[Option<Interval>], results: &[Interval]) -> Result<Interval, Unfit> {
    let of = |operand: &Operand| match *operand {
        Operand::Constant(value) => Ok((i128::from(value), i128::from(value))),
        Operand::Read(at) => reads.get(at).copied().flatten().ok_or(Unfit::Missing),
        Operand::Row(at) => results.get(at).copied().ok_or(Unfit::Missing),
        Operand::ReadOrRow(read, at) => {
            let read = reads.get(read).copied().flatten();
            let both = read.into_iter().chain(results.get(at).copied()).reduce(joined);
            both.ok_or(Unfit::Missing)
        }
    };
    let all = |operands: &[Operand]| operands.iter().map(of).collect::<Result<Vec<_>, _>>();
    let (tops, bottoms) = match &row.operation {
        Operation::Sum(plus, less) => {
            let mut sum: Interval = (0, 0);
            for (low, high) in all(plus)? {
                sum = (added(sum.0, low)?, added(sum.1, high)?);
            }
            for (low, high) in all(less)? {
                sum = (added(sum.0, -high)?, added(sum.1, -low)?);
            }
            (vec![sum.0, sum.1], vec![1])
        }
        Operation::Product(factors) => {
            let mut ends = vec![1_i128];
            for (low, high) in all(factors)? {
                let mut next = Vec::with_capacity(ends.len() * 2);
                for end in ends {
                    next.extend([multiplied(end, low)?, multiplied(end, high)?]);
                }
                ends = next;
            }
            (ends, vec![1])
        }
        Operation::Ratio(dividend, divisor) => {
            let ((low, high), (least, most)) = (of(dividend)?, of(divisor)?);
            if least <= 0 && most >= 0 {
                return Err(Unfit::Divisor);
            }
            (vec![low, high], vec![least, most])
        }
        // At most what is limited; the ends are not looked at.
        Operation::Limit(Limit { value, .. }) => {
            let (low, high) = of(value)?;
            (vec![low, high], vec![1])
        }
        Operation::Selection(_, choices) => {
            let taken: Vec<Operand> = choices.iter().map(|(_, taken)| *taken).collect();
            (all(&taken)?.into_iter().flat_map(|(low, high)| [low, high]).collect(), vec![1])
        }
    };
    let (num, den) = (i128::from(row.factor.num()), i128::from(row.factor.den()));
    let mut ends: Option<Interval> = None;
    for top in &tops {
        for bottom in &bottoms {
            let (top, bottom) = (multiplied(*top, num)?, multiplied(*bottom, den)?);
            let outcome = quotient(top, bottom, row.rounding).ok_or(Unfit::Divisor)?;
            // Beyond 64 bits by however much.
            let value = i128::from(outcome.value)
                + if outcome.saturated { top.signum() * bottom.signum() } else { 0 };
            let (low, high) = ends.unwrap_or((value, value));
            ends = Some((low.min(value), high.max(value)));
        }
    }
    let (low, high) = ends.ok_or(Unfit::Way)?;
    let (least, most) = row.range.unwrap_or((i64::MIN, i64::MAX));
    let (least, most) = (i128::from(least), i128::from(most));
    if (low < least || high > most) && !row.saturates {
        return Err(Unfit::Result((low, high)));
    }
    let (low, high) = (low.clamp(least, most), high.clamp(least, most));
    // In the other modes it is 0.
    Ok(if row.modes.is_empty() { (low, high) } else { joined((low, high), (0, 0)) })
}

fn added(one: i128, other: i128) -> Result<i128, Unfit> {
    one.checked_add(other).ok_or(Unfit::Way)
}

fn multiplied(one: i128, other: i128) -> Result<i128, Unfit> {
    one.checked_mul(other).ok_or(Unfit::Way)
}
