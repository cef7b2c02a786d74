//! What one unit in the last place of a SERCOS value is, from the drive's scaling parameters.
//!
//! ```text
//! LSB = base * factor * 10^exponent / divisor    by the scaling type
//!       * gear                                   where the data refer to the other shaft
//!       * feed constant                          where the data are turns and the axis makes a way, or the reverse
//!       / rated torque                           where the data are newton or newton metre
//! ```

use profile_generic::program::BitPattern;
use profile_generic::quantity::Quantity;
use profile_generic::ratio::Ratio;
use profile_generic::scaling::UnitKind;
use profile_sercos::wire::idn::Idn;

use super::facts::DriveFacts;
use crate::dictionary::SercosDictionary;

/// The largest power of ten in a scaling; S-0-0046 and its like go from -32 to 32, 64 bits hold 10^18.
pub const MAX_EXPONENT: u32 = 18;

/// The shaft that an axis or a value refers to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reference {
    /// The load, behind the gear.
    #[default]
    Load,
    /// The motor.
    Motor,
}

impl Reference {
    /// Both with their words in the files.
    pub const NAMED: &'static [(&'static str, Self)] = &[("load", Self::Load), ("motor", Self::Motor)];
}

/// What a motor can give for ever.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rated {
    /// Whether it is a torque (rotary) or a force (linear): a turning motor may well move a linear axis.
    pub kind: UnitKind,
    /// Micro newton metre or micro newton, above 0.
    pub value: i64,
}

/// What must be known of an axis to scale its values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AxisUnits {
    /// Rotary or linear.
    pub kind: UnitKind,
    /// The shaft that the axis units refer to.
    pub reference: Reference,
    /// Rated torque or force of the motor, if known.
    pub rated: Option<Rated>,
}

/// The unit in the last place of a scaled value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lsb {
    /// What it measures.
    pub quantity: Quantity,
    /// Generic units in it.
    pub generic: Ratio,
    /// Counts where the generic quantity is zero.
    pub zero: i64,
    /// Counts after which positions wrap, and the IDN that says so, if the drive works modulo.
    pub modulo: Option<(i64, Idn)>,
}

/// Why a value cannot be scaled.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ScalingError {
    /// No row of the mapping tables reports what the scaling means.
    #[error("no [[scaling]] row for `{0}`")]
    Unknown(String),
    /// The drive has not reported a parameter.
    #[error("{0} is needed for the scaling and was not read from the drive")]
    NotRead(Idn),
    /// The scaling type is none of those in the tables.
    #[error("{idn}: expected a scaling type that can be converted, got {value:#06x}")]
    Type {
        /// The scaling type parameter.
        idn: Idn,
        /// What the drive holds.
        value: i64,
    },
    /// A parameter of the scaling is out of range.
    #[error("{idn}: expected {expected}, got {value}")]
    Value {
        /// The parameter.
        idn: Idn,
        /// What it should hold.
        expected: &'static str,
        /// What the drive holds.
        value: i64,
    },
    /// The scaling type fixes a factor, and the drive shows another.
    #[error("{idn}: expected {expected}, which the scaling type {word} = {value:#06x} fixes, got {got}")]
    Preferential {
        /// The factor, exponent or resolution.
        idn: Idn,
        /// What it should hold.
        expected: i64,
        /// What the drive holds.
        got: i64,
        /// The scaling type parameter.
        word: Idn,
        /// What it holds.
        value: i64,
    },
    /// The unit in the drive's element 4 is none of those in the tables.
    #[error("{idn}: expected a unit of {expected} in element 4, got `{got}`")]
    Unit {
        /// The parameter.
        idn: Idn,
        /// What the unit should measure.
        expected: Quantity,
        /// The drive's unit.
        got: String,
    },
    /// Absolute torque without a rated torque.
    #[error(
        "{word} = {value:#06x}: the drive gives {what} in absolute units, and the axis has no rated {what}"
    )]
    NoRatedTorque {
        /// The scaling type parameter.
        word: Idn,
        /// What it holds.
        value: i64,
        /// Torque or force.
        what: &'static str,
    },
    /// The exact ratio does not fit 64 bits.
    #[error("{0}: the exact ratio does not fit 64 bits")]
    Overflow(Idn),
}

/// A number that stands in the table or in the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Term {
    Fixed(i64),
    Drive(Idn),
}

#[derive(Debug, Clone)]
pub(crate) struct Method {
    pub pattern: BitPattern,
    pub kind: Option<UnitKind>,
    pub quantity: Quantity,
    pub base: Ratio,
    pub factor: Term,
    pub exponent: Term,
    pub divisor: Term,
    pub zero: i64,
    pub expect: Vec<(Idn, i64)>,
}

/// What lies between motor and load.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GearRule {
    /// The scaling type that refers to the load.
    pub pattern: BitPattern,
    /// Turns of the motor.
    pub motor: Idn,
    /// Turns of the load that belong to them.
    pub load: Idn,
    /// The shaft that the generic quantity refers to, where it is not that of the axis.
    pub generic: Option<Reference>,
}

/// How positions wrap.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ModuloRule {
    pub pattern: BitPattern,
    pub range: Idn,
    pub divider: Option<Idn>,
}

/// How the unit of one quantity follows from the drive's scaling parameters.
#[derive(Debug, Clone)]
pub struct ScalingRule {
    pub(crate) scaling: String,
    pub(crate) word: Idn,
    pub(crate) gear: Option<GearRule>,
    pub(crate) feed: Option<Idn>,
    pub(crate) exact: bool,
    pub(crate) modulo: Option<ModuloRule>,
    pub(crate) methods: Vec<Method>,
}

/// Where the scaling finds what it needs to know.
pub(crate) struct ScalingSource<'a> {
    pub axis: AxisUnits,
    pub facts: &'a DriveFacts,
    pub dictionary: &'a SercosDictionary,
    /// Nanounits of the load in a nanoturn of it, by the feed constant with this IDN.
    pub feed: &'a dyn Fn(Idn) -> Result<Ratio, ScalingError>,
}

impl ScalingSource<'_> {
    fn read(&self, idn: Idn) -> Result<i64, ScalingError> {
        self.facts.number(idn, self.dictionary).ok_or(ScalingError::NotRead(idn))
    }
}

impl ScalingRule {
    /// Every IDN that the rule may look at.
    pub fn idns(&self) -> Vec<Idn> {
        let mut idns = vec![self.word];
        idns.extend(self.gear.iter().flat_map(|gear| [gear.motor, gear.load]));
        idns.extend(self.feed);
        idns.extend(self.modulo.map(|modulo| modulo.range));
        idns.extend(self.modulo.and_then(|modulo| modulo.divider));
        for method in &self.methods {
            for term in [method.factor, method.exponent, method.divisor] {
                if let Term::Drive(idn) = term {
                    idns.push(idn);
                }
            }
            idns.extend(method.expect.iter().map(|(idn, _)| *idn));
        }
        let mut seen = Vec::with_capacity(idns.len());
        idns.retain(|idn| {
            !seen.contains(idn) && {
                seen.push(*idn);
                true
            }
        });
        idns
    }

    /// The unit in the last place for an axis and its drive.
    ///
    /// # Errors
    /// A parameter was not read or holds what no row knows, or the exact ratio does not fit 64 bits.
    pub(crate) fn lsb(&self, source: &ScalingSource<'_>) -> Result<Lsb, ScalingError> {
        let value = source.read(self.word)?;
        let unknown = ScalingError::Type { idn: self.word, value };
        let word = u32::try_from(value).map_err(|_| unknown.clone())?;
        let method = self.methods.iter().find(|method| method.pattern.matches(word)).ok_or(unknown)?;
        for (idn, expected) in &method.expect {
            let (idn, expected) = (*idn, *expected);
            if let Some(got) = source.facts.number(idn, source.dictionary).filter(|got| *got != expected) {
                return Err(ScalingError::Preferential { idn, expected, got, word: self.word, value });
            }
        }
        let mut generic = self.then(self.scale(source, method)?, method.base)?;
        let mut quantity = method.quantity;
        if let Some(kind) = method.kind {
            generic = self.at_shaft(source, word, generic)?;
            if quantity == Quantity::TorqueAbsolute {
                let what = if kind == UnitKind::Rotary { "torque" } else { "force" };
                let rated = source.axis.rated.filter(|rated| rated.kind == kind && rated.value > 0);
                let none = ScalingError::NoRatedTorque { word: self.word, value, what };
                let rated = rated.and_then(|rated| Ratio::new(1_000_000, rated.value)).ok_or(none)?;
                generic = self.then(generic, rated)?;
                quantity = Quantity::Torque;
            } else if kind != source.axis.kind {
                generic = self.then(generic, self.feed(source, kind)?)?;
            }
        }
        generic.inverse().ok_or(ScalingError::Overflow(self.word))?;
        let modulo = match self.modulo.filter(|modulo| modulo.pattern.matches(word)) {
            Some(modulo) => Some((self.range(source, modulo)?, modulo.range)),
            None => None,
        };
        Ok(Lsb { quantity, generic, zero: method.zero, modulo })
    }

    fn then(&self, ratio: Ratio, next: Ratio) -> Result<Ratio, ScalingError> {
        let product = if self.exact { ratio.then(next) } else { ratio.then_nearest(next) };
        product.ok_or(ScalingError::Overflow(self.word))
    }

    /// Factor times power of ten over divisor.
    fn scale(&self, source: &ScalingSource<'_>, method: &Method) -> Result<Ratio, ScalingError> {
        let term = |term| match term {
            Term::Fixed(value) => Ok((self.word, value)),
            Term::Drive(idn) => source.read(idn).map(|value| (idn, value)),
        };
        let (idn, factor) = term(method.factor)?;
        let factor = above_zero(idn, factor)?;
        let (idn, divisor) = term(method.divisor)?;
        let divisor = above_zero(idn, divisor)?;
        let (idn, exponent) = term(method.exponent)?;
        let power = power_of_ten(idn, exponent)?;
        self.then(Ratio::new(factor, divisor).ok_or(ScalingError::Overflow(self.word))?, power)
    }

    /// The same at the shaft that the generic quantity refers to.
    fn at_shaft(&self, source: &ScalingSource<'_>, word: u32, unit: Ratio) -> Result<Ratio, ScalingError> {
        let Some(gear) = self.gear else { return Ok(unit) };
        let data = if gear.pattern.matches(word) { Reference::Load } else { Reference::Motor };
        let generic = gear.generic.unwrap_or(source.axis.reference);
        if data == generic {
            return Ok(unit);
        }
        // A drive that has neither knows of no gear.
        if source.facts.is_missing(gear.motor) && source.facts.is_missing(gear.load) {
            return Ok(unit);
        }
        let motor = above_zero(gear.motor, source.read(gear.motor)?)?;
        let load = above_zero(gear.load, source.read(gear.load)?)?;
        // One turn of the motor is load/motor turns of the load.
        let ratio = match generic {
            Reference::Load => Ratio::new(load, motor),
            Reference::Motor => Ratio::new(motor, load),
        };
        self.then(unit, ratio.ok_or(ScalingError::Overflow(self.word))?)
    }

    /// From what the data measure to what the axis does.
    fn feed(&self, source: &ScalingSource<'_>, data: UnitKind) -> Result<Ratio, ScalingError> {
        let idn = self.feed.ok_or_else(|| ScalingError::Unknown(self.scaling.clone()))?;
        let feed = (source.feed)(idn)?;
        match data {
            UnitKind::Rotary => Ok(feed),
            UnitKind::Linear => feed.inverse().ok_or(ScalingError::Overflow(idn)),
        }
    }

    fn range(&self, source: &ScalingSource<'_>, modulo: ModuloRule) -> Result<i64, ScalingError> {
        if let Some(idn) = modulo.divider
            && let Some(value) = source.facts.number(idn, source.dictionary).filter(|value| *value != 1)
        {
            return Err(ScalingError::Value {
                idn,
                expected: "1, because no source says how it changes the range",
                value,
            });
        }
        above_one(modulo.range, source.read(modulo.range)?)
    }
}

pub(crate) fn above_zero(idn: Idn, value: i64) -> Result<i64, ScalingError> {
    if value > 0 { Ok(value) } else { Err(ScalingError::Value { idn, expected: "a number above 0", value }) }
}

fn above_one(idn: Idn, value: i64) -> Result<i64, ScalingError> {
    if value > 1 { Ok(value) } else { Err(ScalingError::Value { idn, expected: "a number above 1", value }) }
}

/// 10^exponent.
pub(crate) fn power_of_ten(idn: Idn, exponent: i64) -> Result<Ratio, ScalingError> {
    let magnitude = u32::try_from(exponent.unsigned_abs()).ok().filter(|power| *power <= MAX_EXPONENT);
    let magnitude = magnitude.and_then(|power| 10_i64.checked_pow(power));
    let power =
        magnitude.and_then(|power| if exponent < 0 { Ratio::new(1, power) } else { Ratio::new(power, 1) });
    power.ok_or(ScalingError::Value { idn, expected: "an exponent from -18 to 18", value: exponent })
}
