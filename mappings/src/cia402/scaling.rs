//! What one count of an object is, from the drive's factor group or from the configuration.

use profile_generic::quantity::Quantity;
use profile_generic::ratio::Ratio;
use profile_generic::scaling::UnitKind;

use super::compile::{Cia402Axis, Cia402Error};
use super::facts::ObjectFacts;
use super::{Base, Cia402Tables, Method, Value};

impl Cia402Tables {
    /// Generic units of `quantity` in one count of a value.
    ///
    /// # Errors
    /// The unit is not known, or the drive has reported nothing that it follows from.
    pub(super) fn count(
        &self,
        value: &Value,
        quantity: Quantity,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
    ) -> Result<Ratio, Cia402Error> {
        if value.unit.is_empty() || quantity == Quantity::None {
            return Ok(Ratio::ONE);
        }
        if let Some(place) = self.scalings.iter().position(|rule| rule.unit == value.unit) {
            return self.scaled(place, axis, facts);
        }
        let unit = self.units.iter().find(|unit| unit.unit == value.unit && unit.quantity == quantity);
        let unit =
            unit.ok_or_else(|| Cia402Error::Unit { object: value.object, unit: value.unit.clone() })?;
        match (quantity, axis.units.kind) {
            // A turn of the motor is the way that the configuration gives it.
            (Quantity::Velocity, UnitKind::Linear) => self.linear(unit.ratio, axis, value),
            _ => Ok(unit.ratio),
        }
    }

    /// Whether nobody says what a count of a value is, of a drive that has been asked.
    pub(super) fn is_unscaled(
        &self,
        value: &Value,
        quantity: Quantity,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
    ) -> bool {
        !facts.is_empty()
            && matches!(self.count(value, quantity, axis, facts), Err(Cia402Error::NoScaling(_)))
    }

    fn linear(&self, ratio: Ratio, axis: &Cia402Axis, value: &Value) -> Result<Ratio, Cia402Error> {
        let way = axis.way_of_a_turn.ok_or(Cia402Error::Way)?;
        ratio.then(way).ok_or(Cia402Error::Overflow(value.object))
    }

    /// Generic units in one count of the scaling in this place.
    fn scaled(&self, place: usize, axis: &Cia402Axis, facts: &ObjectFacts) -> Result<Ratio, Cia402Error> {
        let rule = &self.scalings[place];
        if let Some(ratio) = axis.count_of(rule.quantity) {
            return Ok(ratio);
        }
        for method in &rule.methods {
            if let Some(ratio) = self.by(method, rule.quantity, axis, facts)? {
                return Ok(ratio);
            }
        }
        Err(Cia402Error::NoScaling(rule.unit.clone()))
    }

    /// `None` when the drive lacks one of the objects, or one of them says nothing.
    fn by(
        &self,
        method: &Method,
        quantity: Quantity,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
    ) -> Result<Option<Ratio>, Cia402Error> {
        let number = |value: &Value| facts.number(value).filter(|number| *number > 0);
        if method.when.as_ref().is_some_and(|(value, wanted)| facts.number(value) != Some(*wanted)) {
            return Ok(None);
        }
        if method.times.iter().chain(&method.over).any(|value| number(value).is_none()) {
            return Ok(None);
        }
        let mut ratio = match &method.base {
            Base::Like(place) => self.scaled(*place, axis, facts)?,
            Base::Generic(base) => match (quantity, axis.units.kind) {
                (Quantity::Position | Quantity::Velocity | Quantity::Acceleration, UnitKind::Linear) => {
                    let way = axis.way_of_a_turn.ok_or(Cia402Error::Way)?;
                    base.then(way).ok_or(Cia402Error::Way)?
                }
                _ => *base,
            },
        };
        for (values, invert) in [(&method.times, false), (&method.over, true)] {
            for value in values {
                let overflow = Cia402Error::Overflow(value.object);
                let factor = number(value).and_then(|number| Ratio::new(number, 1));
                let factor = factor.and_then(|factor| if invert { factor.inverse() } else { Some(factor) });
                ratio = factor.and_then(|factor| ratio.then(factor)).ok_or(overflow)?;
            }
        }
        Ok(Some(ratio))
    }

    /// Every object that a scaling follows from, once.
    pub(super) fn scaling_values(&self) -> Vec<Value> {
        let mut values: Vec<Value> = Vec::new();
        for method in self.scalings.iter().flat_map(|rule| &rule.methods) {
            let when = method.when.as_ref().map(|(value, _)| value);
            for value in when.into_iter().chain(&method.times).chain(&method.over) {
                if !values.contains(value) {
                    values.push(value.clone());
                }
            }
        }
        values
    }
}
