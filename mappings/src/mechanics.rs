//! What lies between the motor of an axis and its load, as the scaling of its drive has it: gear and travel in a turn.
//!
//! A controller that scales for itself works with the same gear and travel. It can therefore set the attributes that describe them to what
//! the drive has; another value would let the load go another way than the controller believes.

use std::f64::consts::PI;

use profile_generic::ratio::{Ratio, Rounding};
use profile_generic::scaling::UnitKind;

use super::attributes::Number;

/// How far apart two lengths may be that are the same, of the larger one: a REAL has 24 bits, and every turn adds up.
const SAME: f64 = 1e-6;

/// What an attribute says of the mechanics.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MechanicalFact {
    /// Kind of the load, with the codes of its kinds.
    LoadType {
        /// A shaft that turns with the motor.
        direct: i64,
        /// A shaft behind a gear.
        transmission: i64,
        /// A turning motor moves the load along a line.
        actuator: i64,
    },
    /// Kind of the actuator.
    ActuatorType {
        /// Code of none.
        none: i64,
        /// The code that is shown until another one is set.
        usual: i64,
    },
    /// Travel of the load in a turn of its shaft, millimetre.
    Lead,
    /// Diameter of a wheel whose circumference is that travel, millimetre.
    Diameter,
    /// Revolutions of the encoder of the motor in a revolution or metre of that of the load.
    UnitRatio,
}

/// What lies between motor and load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mechanics {
    /// Whether the load turns or goes along a line.
    pub kind: UnitKind,
    /// Turns of the motor in a turn of the load; `None` where the drive knows of no gear.
    pub gear: Option<Ratio>,
    /// Millimetres that a linear load goes in a turn of its shaft; `None` of one that turns, and where nobody says it.
    pub travel: Option<Ratio>,
}

impl Mechanics {
    /// What an attribute is until the controller sets it; `None` where nobody knows.
    #[must_use]
    pub fn value(&self, fact: MechanicalFact) -> Option<Number> {
        let is_linear = self.kind == UnitKind::Linear;
        if is_linear && self.travel.is_none() {
            return None;
        }
        let travel = self.travel.map_or(0.0, |travel| travel.to_f64(1));
        Some(match fact {
            MechanicalFact::LoadType { actuator, .. } if is_linear => Number::Integer(actuator),
            MechanicalFact::LoadType { direct, transmission, .. } => {
                Number::Integer(if self.is_direct() { direct } else { transmission })
            }
            MechanicalFact::ActuatorType { none, usual } => {
                Number::Integer(if is_linear { usual } else { none })
            }
            MechanicalFact::Lead => Number::Real(travel),
            MechanicalFact::Diameter => Number::Real(travel / PI),
            MechanicalFact::UnitRatio => Number::Real(self.feedback_unit_ratio()?),
        })
    }

    /// Whether an attribute may be set to this.
    #[must_use]
    pub fn agrees(&self, fact: MechanicalFact, wanted: Number) -> bool {
        match (fact, wanted, self.value(fact)) {
            (_, _, None) => false,
            // Turns that are as many on both sides are a transmission too.
            (MechanicalFact::LoadType { transmission, .. }, Number::Integer(code), Some(held)) => {
                held == wanted || (self.kind == UnitKind::Rotary && code == transmission)
            }
            // Whatever makes the travel: what counts is how long it is.
            (MechanicalFact::ActuatorType { none, .. }, Number::Integer(code), Some(held)) => {
                (code == none) == (held == Number::Integer(none))
            }
            (_, Number::Real(wanted), Some(Number::Real(held))) => {
                (wanted - held).abs() <= wanted.abs().max(held.abs()) * SAME
            }
            _ => false,
        }
    }

    /// Revolutions of the motor in one axis unit (a turn or a millimetre of the load), in 1e-15: over a million of them that is no count
    /// of an encoder. `None` where nobody knows the travel.
    #[must_use]
    pub fn motor_turns_per_unit(&self) -> Option<i64> {
        let gear = self.gear.unwrap_or(Ratio::ONE);
        let turns = match self.kind {
            UnitKind::Rotary => gear,
            UnitKind::Linear => gear.then(self.travel?.inverse()?)?,
        };
        turns.apply(1_000_000_000_000_000, Rounding::Nearest).ok()
    }

    /// Revolutions of the motor in a revolution of the load, or in a metre; `None` where nobody knows the travel.
    fn feedback_unit_ratio(&self) -> Option<f64> {
        let gear = self.gear.map_or(1.0, |gear| gear.to_f64(1));
        match self.kind {
            UnitKind::Rotary => Some(gear),
            UnitKind::Linear => Some(gear / self.travel?.to_f64(1) * 1_000.0),
        }
    }

    /// Whether the load turns as the motor does.
    fn is_direct(&self) -> bool {
        self.gear.is_none_or(|gear| gear.num() == gear.den())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOAD: MechanicalFact = MechanicalFact::LoadType { direct: 0, transmission: 2, actuator: 3 };
    const ACTUATOR: MechanicalFact = MechanicalFact::ActuatorType { none: 0, usual: 1 };

    fn codes(mechanics: &Mechanics, fact: MechanicalFact) -> Vec<i64> {
        (0..6).filter(|code| mechanics.agrees(fact, Number::Integer(*code))).collect()
    }

    #[test]
    fn a_load_that_turns_has_a_gear_or_none_and_no_actuator() {
        let mut axis = Mechanics { kind: UnitKind::Rotary, gear: None, travel: None };
        assert_eq!((axis.value(LOAD), codes(&axis, LOAD)), (Some(Number::Integer(0)), vec![0, 2]));
        axis.gear = Ratio::new(7, 7);
        assert_eq!(codes(&axis, LOAD), [0, 2]);
        axis.gear = Ratio::new(10, 1);
        assert_eq!((axis.value(LOAD), codes(&axis, LOAD)), (Some(Number::Integer(2)), vec![2]));
        assert_eq!((axis.value(ACTUATOR), codes(&axis, ACTUATOR)), (Some(Number::Integer(0)), vec![0]));
        assert!(axis.agrees(MechanicalFact::Lead, Number::Real(0.0)));
        assert!(!axis.agrees(MechanicalFact::Lead, Number::Real(10.0)));
        assert!(!axis.agrees(MechanicalFact::Diameter, Number::Real(0.1)));
        assert!(!axis.agrees(MechanicalFact::Lead, Number::Real(f64::NAN)));
    }

    #[test]
    fn a_load_on_a_line_has_the_travel_of_the_drive_to_a_millionth() {
        let axis = Mechanics { kind: UnitKind::Linear, gear: None, travel: Ratio::new(25, 2) };
        assert_eq!((axis.value(LOAD), codes(&axis, LOAD)), (Some(Number::Integer(3)), vec![3]));
        assert_eq!(axis.value(ACTUATOR), Some(Number::Integer(1)));
        assert_eq!(codes(&axis, ACTUATOR), [1, 2, 3, 4, 5], "whatever makes the travel");
        assert_eq!(axis.value(MechanicalFact::Lead), Some(Number::Real(12.5)));
        for (lead, same) in [(12.5, true), (12.500_01, true), (12.500_02, false), (12.4999, false)] {
            assert_eq!(axis.agrees(MechanicalFact::Lead, Number::Real(lead)), same, "{lead}");
        }
        // A wheel of 3.978874 mm has a circumference of 12.5 mm.
        assert!(axis.agrees(MechanicalFact::Diameter, Number::Real(3.978_874)));
        assert!(!axis.agrees(MechanicalFact::Diameter, Number::Real(3.978_9)));
        assert!(!axis.agrees(MechanicalFact::Diameter, Number::Integer(4)));
    }

    #[test]
    fn a_unit_of_the_load_is_turns_of_the_motor_by_gear_and_travel() {
        let turns = |kind, gear, travel| Mechanics { kind, gear, travel }.motor_turns_per_unit();
        assert_eq!(turns(UnitKind::Rotary, None, None), Some(1_000_000_000_000_000));
        assert_eq!(turns(UnitKind::Rotary, Ratio::new(10, 3), None), Some(3_333_333_333_333_333));
        assert_eq!(turns(UnitKind::Linear, Ratio::new(2, 1), Ratio::new(5, 1)), Some(400_000_000_000_000));
        assert_eq!(turns(UnitKind::Linear, None, None), None);
    }

    #[test]
    fn unit_ratio_is_turns_of_the_motor_for_a_turn_or_a_metre_of_the_load() {
        let value = |kind, gear, travel| Mechanics { kind, gear, travel }.value(MechanicalFact::UnitRatio);
        assert_eq!(value(UnitKind::Rotary, None, None), Some(Number::Real(1.0)));
        assert_eq!(value(UnitKind::Rotary, Ratio::new(10, 4), None), Some(Number::Real(2.5)));
        let screw = Mechanics { kind: UnitKind::Linear, gear: Ratio::new(2, 1), travel: Ratio::new(5, 1) };
        assert_eq!(screw.value(MechanicalFact::UnitRatio), Some(Number::Real(400.0)));
        assert!(screw.agrees(MechanicalFact::UnitRatio, Number::Real(400.0001)));
        assert!(!screw.agrees(MechanicalFact::UnitRatio, Number::Real(401.0)));
        assert_eq!(value(UnitKind::Linear, Ratio::new(2, 1), None), None);
    }

    #[test]
    fn a_line_whose_travel_nobody_knows_says_nothing() {
        let axis = Mechanics { kind: UnitKind::Linear, gear: Ratio::new(10, 1), travel: None };
        for fact in [LOAD, ACTUATOR, MechanicalFact::Lead, MechanicalFact::Diameter] {
            assert_eq!(axis.value(fact), None);
            assert!(!axis.agrees(fact, Number::Integer(3)) && !axis.agrees(fact, Number::Real(0.0)));
        }
    }
}
