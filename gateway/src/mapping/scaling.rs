//! What one unit in the last place of a SERCOS value is, from the drive's scaling parameters.

use std::collections::BTreeMap;

use profile_generic::program::{BitPattern, Width};
use profile_generic::quantity::Quantity;
use profile_generic::ratio::Ratio;
use profile_generic::scaling::UnitKind;
use profile_sercos::wire::attribute::{Attribute, Format, ItemLength};
use profile_sercos::wire::idn::Idn;

use super::dictionary::{IdnFormat, SercosDictionary};

/// The largest power of ten in a scaling; S-0-0046 and its like go from -32 to 32, 64 bits hold 10^18.
pub const MAX_EXPONENT: u32 = 18;

/// What a drive has said about itself.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DriveFacts {
    facts: BTreeMap<Idn, Fact>,
}

#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct Fact {
    attribute: Option<Attribute>,
    data: Option<Vec<u8>>,
    missing: bool,
}

impl DriveFacts {
    /// Nothing known.
    pub fn new() -> Self {
        Self::default()
    }

    /// The drive has given element 3 of an IDN.
    pub fn note_attribute(&mut self, idn: Idn, attribute: Attribute) {
        self.facts.entry(idn).or_default().attribute = Some(attribute);
    }

    /// The drive has given element 7 of an IDN, or has taken these bytes for it.
    pub fn note_data(&mut self, idn: Idn, data: &[u8]) {
        self.facts.entry(idn).or_default().data = Some(data.to_vec());
    }

    /// The drive has no such IDN.
    pub fn note_missing(&mut self, idn: Idn) {
        self.facts.entry(idn).or_default().missing = true;
    }

    /// Whether the drive has said that it has no such IDN.
    pub fn is_missing(&self, idn: Idn) -> bool {
        self.facts.get(&idn).is_some_and(|fact| fact.missing)
    }

    /// Element 3, if the drive has given it.
    pub fn attribute(&self, idn: Idn) -> Option<Attribute> {
        self.facts.get(&idn)?.attribute
    }

    /// Element 7 as bytes, if the drive has given it.
    pub fn data(&self, idn: Idn) -> Option<&[u8]> {
        self.facts.get(&idn)?.data.as_deref()
    }

    /// Element 7 as a number, signed or not as the drive or the dictionary says.
    pub fn number(&self, idn: Idn, dictionary: &SercosDictionary) -> Option<i64> {
        let data = self.data(idn)?;
        let signed = self.is_signed(idn, dictionary);
        let fill = if signed && data.last().is_some_and(|byte| byte & 0x80 != 0) { 0xFF } else { 0 };
        let mut bytes = [fill; 8];
        bytes.get_mut(..data.len())?.copy_from_slice(data);
        Some(i64::from_le_bytes(bytes))
    }

    fn is_signed(&self, idn: Idn, dictionary: &SercosDictionary) -> bool {
        match self.attribute(idn) {
            Some(attribute) => attribute.format() == Format::Signed,
            None => dictionary.idn(idn).is_some_and(|row| row.format == Some(IdnFormat::Signed)),
        }
    }

    /// How the value of an IDN lies in a telegram; the drive's word counts more than the dictionary's.
    /// `None` for lists and when nobody knows the length.
    pub fn width(&self, idn: Idn, dictionary: &SercosDictionary) -> Option<Width> {
        let row = dictionary.idn(idn);
        let length = match self.attribute(idn) {
            Some(attribute) if attribute.is_list() => return None,
            Some(attribute) => match attribute.item_length() {
                ItemLength::One => 1,
                ItemLength::Two => 2,
                ItemLength::Four => 4,
                ItemLength::Eight => 8,
            },
            None => row.filter(|row| !row.list)?.length?,
        };
        Some(match (length, self.is_signed(idn, dictionary)) {
            (1, false) => Width::U8,
            (1, true) => Width::I8,
            (2, false) => Width::U16,
            (2, true) => Width::I16,
            (4, false) => Width::U32,
            (4, true) => Width::I32,
            (8, false) => Width::U64,
            (8, true) => Width::I64,
            _ => return None,
        })
    }
}

/// The shaft that an axis or a value refers to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reference {
    /// The load, behind the gear.
    #[default]
    Load,
    /// The motor.
    Motor,
}

/// What must be known of an axis to scale its values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AxisUnits {
    /// Rotary or linear.
    pub kind: UnitKind,
    /// The shaft that the axis units refer to.
    pub reference: Reference,
    /// Rated torque in micro newton metre, or rated force in micro newton, if known.
    pub rated_torque: Option<i64>,
}

/// The unit in the last place of a scaled value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lsb {
    /// What it measures.
    pub quantity: Quantity,
    /// Generic units in it.
    pub generic: Ratio,
    /// Counts after which positions wrap, if the drive works modulo.
    pub modulo: Option<i64>,
}

/// Why a value cannot be scaled.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ScalingError {
    /// No row of the mapping tables tells what the scaling means.
    #[error("no [[scaling]] row for `{0}`")]
    Unknown(String),
    /// The drive has not told a parameter.
    #[error("{0} is needed for the scaling and was not read from the drive")]
    NotRead(Idn),
    /// The scaling type is none of those in the tables.
    #[error("{idn}: expected a scaling type of a {kind} axis, got {value:#06x}")]
    Type {
        /// The scaling type parameter.
        idn: Idn,
        /// The axis.
        kind: UnitKind,
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
    /// Absolute torque without a rated torque.
    #[error("{0}: the drive gives torque in absolute units, and the axis has no rated torque")]
    NoRatedTorque(Idn),
    /// The exact ratio does not fit 64 bits.
    #[error("{0}: the exact ratio does not fit 64 bits")]
    Overflow(Idn),
}

/// A number that stands in the table or in the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Term {
    Fixed(i64),
    Drive(Idn),
}

#[derive(Debug, Clone)]
pub(super) struct Method {
    pub pattern: BitPattern,
    pub kind: Option<UnitKind>,
    pub quantity: Quantity,
    pub base: Ratio,
    pub factor: Term,
    pub exponent: Term,
    pub divisor: Term,
}

/// How the unit of one quantity follows from the drive's scaling parameters.
#[derive(Debug, Clone)]
pub struct ScalingRule {
    pub(super) scaling: String,
    pub(super) word: Idn,
    pub(super) load: Option<(BitPattern, [Idn; 2])>,
    pub(super) modulo: Option<(BitPattern, Idn)>,
    pub(super) methods: Vec<Method>,
}

impl ScalingRule {
    /// Every IDN that the rule may look at.
    pub fn idns(&self) -> Vec<Idn> {
        let mut idns = vec![self.word];
        idns.extend(self.load.iter().flat_map(|(_, gear)| *gear));
        idns.extend(self.modulo.map(|(_, range)| range));
        for method in &self.methods {
            for term in [method.factor, method.exponent, method.divisor] {
                if let Term::Drive(idn) = term {
                    idns.push(idn);
                }
            }
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
    pub fn lsb(
        &self,
        axis: AxisUnits,
        facts: &DriveFacts,
        dictionary: &SercosDictionary,
    ) -> Result<Lsb, ScalingError> {
        let read = |idn| facts.number(idn, dictionary).ok_or(ScalingError::NotRead(idn));
        let term = |term| match term {
            Term::Fixed(value) => Ok((self.word, value)),
            Term::Drive(idn) => read(idn).map(|value| (idn, value)),
        };
        let overflow = ScalingError::Overflow(self.word);
        let value = read(self.word)?;
        let unknown = ScalingError::Type { idn: self.word, kind: axis.kind, value };
        let word = u32::try_from(value).map_err(|_| unknown.clone())?;
        let mut fitting =
            self.methods.iter().filter(|method| method.kind.is_none_or(|kind| kind == axis.kind));
        let method = fitting.find(|method| method.pattern.matches(word)).ok_or(unknown)?;

        let (idn, factor) = term(method.factor)?;
        let factor = above_zero(idn, factor)?;
        let (idn, divisor) = term(method.divisor)?;
        let divisor = above_zero(idn, divisor)?;
        let (idn, exponent) = term(method.exponent)?;
        let power = power_of_ten(idn, exponent)?;
        let scale = Ratio::new(factor, divisor).and_then(|ratio| ratio.then(power));
        let mut generic = scale.and_then(|ratio| ratio.then(method.base)).ok_or_else(|| overflow.clone())?;

        if let Some((pattern, [motor_turns, load_turns])) = self.load {
            let reference = if pattern.matches(word) { Reference::Load } else { Reference::Motor };
            if reference != axis.reference {
                let motor = above_zero(motor_turns, read(motor_turns)?)?;
                let load = above_zero(load_turns, read(load_turns)?)?;
                // One turn of the motor is load/motor turns of the load.
                let gear = match axis.reference {
                    Reference::Load => Ratio::new(load, motor),
                    Reference::Motor => Ratio::new(motor, load),
                };
                generic = gear.and_then(|gear| generic.then(gear)).ok_or_else(|| overflow.clone())?;
            }
        }
        let mut quantity = method.quantity;
        if quantity == Quantity::TorqueAbsolute {
            let rated = axis.rated_torque.filter(|rated| *rated > 0);
            let rated = rated.ok_or(ScalingError::NoRatedTorque(self.word))?;
            let relative = Ratio::new(1_000_000, rated).and_then(|ratio| generic.then(ratio));
            generic = relative.ok_or_else(|| overflow.clone())?;
            quantity = Quantity::Torque;
        }
        generic.inverse().ok_or(overflow)?;
        let modulo = match self.modulo {
            Some((pattern, range)) if pattern.matches(word) => Some(above_one(range, read(range)?)?),
            _ => None,
        };
        Ok(Lsb { quantity, generic, modulo })
    }
}

fn above_zero(idn: Idn, value: i64) -> Result<i64, ScalingError> {
    if value > 0 { Ok(value) } else { Err(ScalingError::Value { idn, expected: "a number above 0", value }) }
}

fn above_one(idn: Idn, value: i64) -> Result<i64, ScalingError> {
    if value > 1 { Ok(value) } else { Err(ScalingError::Value { idn, expected: "a number above 1", value }) }
}

/// 10^exponent.
pub(super) fn power_of_ten(idn: Idn, exponent: i64) -> Result<Ratio, ScalingError> {
    let magnitude = u32::try_from(exponent.unsigned_abs()).ok().filter(|power| *power <= MAX_EXPONENT);
    let magnitude = magnitude.and_then(|power| 10_i64.checked_pow(power));
    let power =
        magnitude.and_then(|power| if exponent < 0 { Ratio::new(1, power) } else { Ratio::new(power, 1) });
    power.ok_or(ScalingError::Value { idn, expected: "an exponent from -18 to 18", value: exponent })
}
