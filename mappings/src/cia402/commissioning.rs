//! What is written to and read from a drive before it takes part in the cycle.

use std::fmt;

use profile_generic::time::DurationNs;

use super::compile::{Cia402Axis, Cia402Error};
use super::facts::ObjectFacts;
use super::{Cia402Tables, Object, ParameterRule, StepKind, Value};
use crate::drive_program::ParameterEntry;
use crate::item::Item;

/// One SDO access.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ObjectStep {
    /// Reads an object and notes it in the [`ObjectFacts`].
    Read {
        /// The object, as the tables have it.
        object: Object,
        /// Whether commissioning fails when the drive refuses.
        fail: bool,
    },
    /// Writes an object.
    Write {
        /// The object, as the tables have it.
        object: Object,
        /// The bytes.
        bytes: Vec<u8>,
        /// Whether commissioning fails when the drive refuses.
        fail: bool,
    },
}

impl ObjectStep {
    /// What is accessed on the axis of a device.
    #[must_use]
    pub fn item(&self, axis: &Cia402Axis) -> Option<Item> {
        let (Self::Read { object, .. } | Self::Write { object, .. }) = self;
        axis.item(*object)
    }
}

/// The steps, in order. What follows depends on what was read, so there are two parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plan {
    /// What the drive is asked.
    Ask,
    /// What it is told, once it has answered.
    Tell,
}

impl Cia402Tables {
    /// The steps of one part of commissioning.
    ///
    /// # Errors
    /// A value does not fit the drive, or a mode is not there.
    pub(crate) fn steps(
        &self,
        plan: Plan,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
    ) -> Result<Vec<ObjectStep>, Cia402Error> {
        let mut steps = Vec::new();
        let uses = |modes: &[i8]| -> Result<bool, Cia402Error> {
            let chosen = self.chosen(axis, facts)?;
            let procedures = self.procedures_of(axis, facts);
            let modes_of_axis = chosen.iter().map(|(_, mode)| mode.code);
            let mut all = modes_of_axis.chain(procedures.iter().map(|(_, mode)| mode.code));
            Ok(all.any(|mode| modes.contains(&mode)))
        };
        for rule in &self.steps {
            let fail = rule.fail;
            if !rule.modes.is_empty() && !uses(&rule.modes)? {
                continue;
            }
            match (plan, &rule.kind) {
                (Plan::Ask, StepKind::Read(object)) => steps.push(ObjectStep::Read { object: *object, fail }),
                (Plan::Ask, StepKind::ReadScaling) => {
                    let values = self.scaling_values();
                    steps.extend(values.iter().map(|value| ObjectStep::Read { object: value.object, fail }));
                }
                (Plan::Ask, StepKind::ReadParameters) => {
                    let parameters = self.parameters.iter().map(|rule| rule.at.value.object);
                    for object in self.asked_signals(axis).chain(parameters) {
                        let step = ObjectStep::Read { object, fail };
                        if !steps.contains(&step) {
                            steps.push(step);
                        }
                    }
                }
                (Plan::Ask, StepKind::ReadCaptures) => {
                    let objects = self.capture_objects(axis).into_iter();
                    steps.extend(objects.map(|object| ObjectStep::Read { object, fail }));
                }
                (Plan::Tell, StepKind::Write(value, number)) => {
                    steps.push(ObjectStep::Write {
                        object: value.object,
                        bytes: bytes(value, *number)?,
                        fail,
                    });
                }
                (Plan::Tell, StepKind::WriteParameter(parameter)) => {
                    for (_, generic) in axis.parameters.iter().filter(|(known, _)| known == parameter) {
                        let step = self.write_parameter(*parameter, *generic, axis, facts, fail)?;
                        // Two parameters may fall to one object.
                        steps.extend(step.filter(|step| !steps.contains(step)));
                    }
                }
                (Plan::Tell, StepKind::WriteCycle(value, exponent)) => {
                    let (number, power) = cycle(axis.cycle).ok_or(Cia402Error::Cycle(axis.cycle))?;
                    for (value, number) in [(value, number), (exponent, power)] {
                        let bytes = bytes(value, number)?;
                        steps.push(ObjectStep::Write { object: value.object, bytes, fail });
                    }
                    // A drive may answer success and keep what it had.
                    let back = [value, exponent].map(|value| ObjectStep::Read { object: value.object, fail });
                    steps.extend(back);
                }
                (Plan::Tell, StepKind::WriteMode) => {
                    if let Some(mode) = self.chosen(axis, facts)?.first() {
                        let bytes = mode.1.code.to_le_bytes().to_vec();
                        steps.push(ObjectStep::Write { object: self.words.mode, bytes, fail });
                    }
                }
                _ => {}
            }
        }
        Ok(steps)
    }

    /// The objects that commissioning writes into the drive of an axis, as the tables have them: others have no say in them. What
    /// the axis arms its captures by is among them.
    pub(crate) fn written(&self, axis: &Cia402Axis) -> Vec<Object> {
        let mut objects = Vec::new();
        for rule in &self.steps {
            match &rule.kind {
                StepKind::Write(value, _) => objects.push(value.object),
                StepKind::WriteParameter(parameter) => {
                    let has_value = axis.parameters.iter().any(|(known, _)| known == parameter);
                    let rules =
                        self.parameters.iter().filter(|rule| has_value && rule.parameter == *parameter);
                    for ParameterRule { at, .. } in rules {
                        let others = at.inverted.iter().chain(&at.common);
                        objects.extend(std::iter::once(&at.value).chain(others).map(|value| value.object));
                    }
                }
                StepKind::WriteCycle(value, exponent) => objects.extend([value.object, exponent.object]),
                StepKind::WriteMode => objects.push(self.words.mode),
                _ => {}
            }
        }
        objects.extend(self.capture_objects(axis));
        objects.sort_unstable();
        objects.dedup();
        objects
    }

    /// The time between set-points that a drive expects, where it is another one than the cycle.
    pub(crate) fn other_period(&self, axis: &Cia402Axis, facts: &ObjectFacts) -> Option<InterpolationPeriod> {
        let (value, exponent) = self.steps.iter().find_map(|rule| match &rule.kind {
            StepKind::WriteCycle(value, exponent) => Some((value, exponent)),
            _ => None,
        })?;
        let number = facts.integer(value.object, value.width)?;
        let exponent = facts.integer(exponent.object, exponent.width)?;
        let found = InterpolationPeriod { number, exponent };
        (found.nanoseconds() != Some(axis.cycle.as_nanos())).then_some(found)
    }

    /// The objects of the signals that the modes of an axis can have. What is only there in a mode of operation, which 6502 tells,
    /// is not asked for.
    fn asked_signals<'a>(&'a self, axis: &'a Cia402Axis) -> impl Iterator<Item = Object> + 'a {
        let modes = axis.modes.clone();
        let used = move |signal| {
            let rules = self.modes.iter().filter(|rule| modes.contains(&rule.selection));
            rules.flat_map(|rule| rule.command.iter().chain(&rule.actual)).any(|known| *known == signal)
        };
        let rules = self.signals.iter().filter(move |rule| used(rule.signal) && axis.wants(rule));
        rules.filter(|rule| rule.modes.is_empty() || !rule.refuse).map(|rule| rule.value.object)
    }

    fn write_parameter(
        &self,
        parameter: profile_generic::parameter::Parameter,
        generic: i64,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
        fail: bool,
    ) -> Result<Option<ObjectStep>, Cia402Error> {
        let Some(rule) = self.parameters.iter().find(|rule| rule.parameter == parameter) else {
            return Ok(None);
        };
        let (object, bytes) = match (self.entry(rule, axis, facts)?, &rule.at.common) {
            (Some(entry), _) => {
                let inverted = rule.at.inverted.as_ref().filter(|_| self.inverts_positions(facts));
                let object = inverted.unwrap_or(&rule.at.value).object;
                (object, octets(object, &entry, generic)?)
            }
            (None, Some(common)) => (common.object, self.least_of(common, axis, facts)?),
            (None, None) => return Ok(None),
        };
        Ok(bytes.map(|bytes| ObjectStep::Write { object, bytes, fail }))
    }

    /// The least of what the configuration gives the parameters that fall to an object which limits both directions.
    fn least_of(
        &self,
        common: &Value,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
    ) -> Result<Option<Vec<u8>>, Cia402Error> {
        let mut least: Option<(u64, Option<Vec<u8>>)> = None;
        for (parameter, generic) in &axis.parameters {
            let falls = |rule: &&ParameterRule| {
                rule.parameter == *parameter && rule.at.common.as_ref() == Some(common)
            };
            let Some(rule) = self.parameters.iter().find(falls) else { continue };
            if self.entry(rule, axis, facts)?.is_some() {
                continue;
            }
            // It is written to a drive that has none of the objects as well: what the drive refuses is reported.
            let Some(entry) = self.entry_in(common, rule, axis, facts)? else { continue };
            let size = generic.unsigned_abs();
            if least.as_ref().is_none_or(|(known, _)| size < *known) {
                least = Some((size, octets(common.object, &entry, *generic)?));
            }
        }
        Ok(least.and_then(|(_, bytes)| bytes))
    }
}

/// A generic value as an object holds it; `None` where the parameter is only read.
fn octets(object: Object, entry: &ParameterEntry, generic: i64) -> Result<Option<Vec<u8>>, Cia402Error> {
    match entry.encode(generic) {
        Some((_, _, true)) => Err(Cia402Error::Range { object, value: generic }),
        Some((bytes, len, false)) => Ok(Some(bytes[..len].to_vec())),
        None => Ok(None),
    }
}

/// A number in the bytes of a value.
fn bytes(value: &Value, number: i64) -> Result<Vec<u8>, Cia402Error> {
    let (min, max) = value.width.range();
    if !(min..=max).contains(&number) {
        return Err(Cia402Error::Range { object: value.object, value: number });
    }
    Ok(number.to_le_bytes()[..value.width.bytes()].to_vec())
}

/// What a drive shows in 60C2: so many times ten to the exponent, in seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InterpolationPeriod {
    /// 60C2:01.
    pub number: i64,
    /// 60C2:02.
    pub exponent: i64,
}

impl InterpolationPeriod {
    fn nanoseconds(self) -> Option<i64> {
        let power = u32::try_from(self.exponent + 9).ok()?;
        self.number.checked_mul(10_i64.checked_pow(power)?)
    }
}

impl fmt::Display for InterpolationPeriod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.nanoseconds() {
            Some(0) | None => write!(f, "{} * 10^{} s", self.number, self.exponent),
            Some(time) => write!(f, "{}", DurationNs(time)),
        }
    }
}

/// A time as a whole number of 1 to 255 and a power of ten in seconds, milliseconds where they do: many drives take no other
/// exponent. `None` when there is none.
fn cycle(time: DurationNs) -> Option<(i64, i64)> {
    let (mut number, mut power) = (time.as_nanos(), -9);
    let fits = |number| number <= i64::from(u8::MAX);
    while number % 10 == 0 && number > 0 && power < 0 && !(power >= -3 && fits(number)) {
        (number, power) = (number / 10, power + 1);
    }
    (1..=i64::from(u8::MAX)).contains(&number).then_some((number, power))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cycle_is_a_number_and_a_power_of_ten() {
        let of = |ns| cycle(DurationNs(ns));
        assert_eq!(of(1_000_000), Some((1, -3)));
        assert_eq!(of(10_000_000), Some((10, -3)));
        assert_eq!(of(255_000_000), Some((255, -3)));
        assert_eq!(of(260_000_000), Some((26, -2)));
        assert_eq!(of(2_500_000), Some((25, -4)));
        assert_eq!(of(125_000), Some((125, -6)));
        assert_eq!(of(1_000_000_000), Some((100, -2)));
        assert_eq!(of(31_250), None, "3125 does not fit an octet");
        assert_eq!((of(0), of(-1)), (None, None));
    }

    #[test]
    fn a_period_is_shown_as_a_time_where_it_is_one() {
        let show = |number, exponent| InterpolationPeriod { number, exponent }.to_string();
        assert_eq!(
            [show(1, -3), show(25, -4), show(0, -3), show(1, -12)].join(", "),
            "1 ms, 2.500000 ms, 0 * 10^-3 s, 1 * 10^-12 s"
        );
    }
}
