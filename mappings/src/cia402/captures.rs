//! How a CiA 402 drive captures positions: touch probes, and inputs that are seen in every cycle.
//!
//! Function and status of the probes, and the inputs, go in the PDOs where the configuration wants that; a position that was
//! stored is read by SDO. A capture is there only if the drive has not said that it lacks one of its objects.

use profile_generic::capture::CaptureKind;
use profile_generic::image::Signal;
use profile_generic::program::{BitPattern, Conversion};
use profile_generic::quantity::Quantity;

use super::compile::{Cia402Axis, Cia402Error, Places};
use super::facts::ObjectFacts;
use super::{Cia402Tables, FULL_RANGE, Object, Value};
use crate::capture_program::{CaptureMode, CaptureProgram, Gate, Input, Latch, Place, Stored};
use crate::drive_program::Telegram;
use crate::sercos::captures::index_of;

#[derive(Debug, Clone)]
pub(crate) struct CaptureRule {
    pub kind: CaptureKind,
    /// The word that reports it, and what it shows.
    pub word: Value,
    pub pattern: BitPattern,
    pub latch: Option<LatchRule>,
}

/// What a drive stores by itself.
#[derive(Debug, Clone)]
pub(crate) struct LatchRule {
    pub value: Value,
    pub function: Value,
    /// Bits of the function that let its probe work, and those that let this edge through.
    pub enable: BitPattern,
    pub select: BitPattern,
}

impl CaptureRule {
    fn values(&self) -> impl Iterator<Item = &Value> {
        let latch = self.latch.iter().flat_map(|latch| [&latch.function, &latch.value]);
        std::iter::once(&self.word).chain(latch)
    }
}

impl Cia402Tables {
    /// Every object that a capture needs, once.
    pub(super) fn capture_objects(&self, axis: &Cia402Axis) -> Vec<Object> {
        let mut objects = Vec::new();
        let rules = self.captures.iter().filter(|rule| is_wanted(rule, axis));
        for value in rules.flat_map(CaptureRule::values) {
            if !objects.contains(&value.object) {
                objects.push(value.object);
            }
        }
        objects
    }

    /// What stands in the telegrams behind the signals: functions, then words. A word that is a signal stands with these.
    pub(super) fn cyclic_of_captures(
        &self,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
        to_drive: bool,
        places: &Places<'_>,
    ) -> Vec<&Value> {
        let mut values: Vec<&Value> = Vec::new();
        if axis.captures != CaptureMode::Cyclic {
            return values;
        }
        for rule in self.captures.iter().filter(|rule| is_usable(rule, axis, facts)) {
            let value = match to_drive {
                true => rule.latch.as_ref().map(|latch| &latch.function),
                false => Some(&rule.word),
            };
            let signal = |value: &Value| places.iter().any(|(rule, _)| rule.value.object == value.object);
            values.extend(value.filter(|value| !values.contains(value) && !signal(value)));
        }
        values
    }

    /// The program of the captures of an axis; `telegram` has what stands in it, and `places` where its signals stand.
    pub(super) fn capture_program(
        &self,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
        telegram: &Telegram,
        places: &Places<'_>,
    ) -> Result<CaptureProgram, Cia402Error> {
        let mut program = CaptureProgram::default();
        for rule in self.captures.iter().filter(|rule| is_usable(rule, axis, facts)) {
            // A capture that does not fit is one that the axis does not have.
            let _ = self.capture(rule, axis, facts, telegram, places, &mut program)?;
        }
        Ok(program)
    }

    fn capture(
        &self,
        rule: &CaptureRule,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
        telegram: &Telegram,
        places: &Places<'_>,
        program: &mut CaptureProgram,
    ) -> Result<Option<()>, Cia402Error> {
        let place = |value: &Value, to_drive: bool| -> Result<Place, Cia402Error> {
            let item = axis.item(value.object).ok_or(Cia402Error::Axis(axis.axis))?;
            let (items, end) = match to_drive {
                true => (&telegram.command, telegram.command_bytes),
                false => (&telegram.feedback, telegram.feedback_bytes),
            };
            // What is no signal is among the last ones, in this order.
            let mut offset = end;
            let signal = places.iter().find(|(rule, _)| rule.value.object == value.object);
            let mut found = signal.map(|(_, at)| *at);
            for cyclic in self.cyclic_of_captures(axis, facts, to_drive, places).into_iter().rev() {
                offset -= u16::try_from(cyclic.width.bytes()).unwrap_or(u16::MAX);
                if cyclic.object == value.object && items.contains(&item) {
                    found = Some(offset);
                }
            }
            Ok(Place { item, width: value.width, offset: found })
        };
        let (kind, pattern) = (rule.kind, rule.pattern);
        let word = place(&rule.word, false)?;
        let Some(latch) = &rule.latch else {
            // Only what comes in every cycle can be compared.
            let input = word.offset.map(|_| Input { kind, word, pattern });
            return Ok(input.and_then(|input| program.inputs.try_push(input).ok()));
        };
        let value = self.stored(&latch.value, axis, facts)?;
        let function = place(&latch.function, true)?;
        let mask = latch.enable.mask | latch.select.mask;
        let known = program
            .enables
            .iter()
            .position(|gate| gate.place.item == function.item && gate.on == latch.enable.value);
        let enable = match known {
            Some(known) => {
                program.enables[known].mask |= mask;
                known
            }
            None => {
                let gate = Gate { place: function, mask, on: latch.enable.value };
                if program.enables.try_push(gate).is_err() {
                    return Ok(None);
                }
                program.enables.len() - 1
            }
        };
        let Some(word) = index_of(&mut program.words, word) else { return Ok(None) };
        let latch = Latch { kind, enable, word, pattern, select: latch.select.value, value };
        Ok(program.latches.try_push(latch).ok())
    }

    /// A stored position; it counts as the actual position does.
    fn stored(&self, value: &Value, axis: &Cia402Axis, facts: &ObjectFacts) -> Result<Stored, Cia402Error> {
        let like = self.signal(Signal::PositionActual, 0).map_or(value, |rule| &rule.value);
        let count = self.count(like, Quantity::Position, axis, facts)?;
        let item = axis.item(value.object).ok_or(Cia402Error::Axis(axis.axis))?;
        Ok(Stored {
            place: Place { item, width: value.width, offset: None },
            to_generic: Conversion::new(count),
            to_drive: Conversion::new(count.inverse().ok_or(Cia402Error::Overflow(value.object))?),
            modulo: FULL_RANGE,
        })
    }
}

/// Whether an axis wants a capture, and its drive may have the objects.
fn is_usable(rule: &CaptureRule, axis: &Cia402Axis, facts: &ObjectFacts) -> bool {
    is_wanted(rule, axis) && rule.values().all(|value| !facts.is_missing(value.object))
}

/// Inputs are only seen in the telegrams.
fn is_wanted(rule: &CaptureRule, axis: &Cia402Axis) -> bool {
    match axis.captures {
        CaptureMode::Off => false,
        CaptureMode::ServiceChannel => rule.latch.is_some(),
        CaptureMode::Cyclic => true,
    }
}
