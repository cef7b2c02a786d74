//! The attributes that the device serves for one axis.

use std::fmt;
use std::sync::Arc;

use profile_cip::device::axis_object::PositionView;
use profile_generic::image::Signal;
use profile_generic::parameter::Parameter;
use profile_generic::program::{Conversion, Width};
use profile_generic::ratio::{Ratio, Rounding};

use super::cip_scaling::CipScaling;
use super::cip_tables::{CipTables, FeedbackUnit, Missing, Served, ServedAttribute, limit_has_sign};
use super::dictionary::{Access, CipType, PolarityEffect};
use super::mechanics::MechanicalFact;

/// How far apart two values may be that are the same, of the larger one.
const SAME: f64 = 0.001;

/// The value of an attribute that is a single number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Number {
    /// A whole one.
    Integer(i64),
    /// A real one.
    Real(f64),
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Integer(value) => write!(f, "{value}"),
            Self::Real(value) => {
                // A REAL as short as it is, and not with what it lacks to the number that was meant.
                #[allow(clippy::cast_possible_truncation)]
                let short = *value as f32;
                if f64::from(short).to_bits() == value.to_bits() {
                    return write!(f, "{short}");
                }
                write!(f, "{value}")
            }
        }
    }
}

/// Who answers for an attribute, with the conversions of one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Backing {
    /// The device computes it.
    Device,
    /// The connection writes it.
    Connection,
    /// It is stored and given back, without effect: what the standard lets a device keep.
    Stored,
    /// It never changes.
    Constant(i64),
    /// It is what the scaling of the drive comes to.
    Mechanics(MechanicalFact),
    /// A value of the process image.
    Signal {
        /// The signal.
        signal: Signal,
        /// The parameter of the drive that is read while the signal has no value.
        otherwise: Option<Parameter>,
        /// From the generic unit.
        from_generic: Conversion,
    },
    /// A parameter of the drive.
    Parameter {
        /// The parameter.
        parameter: Parameter,
        /// To the generic unit.
        to_generic: Conversion,
        /// From the generic unit.
        from_generic: Conversion,
        /// What it is of a drive without the parameter.
        missing: Missing,
        /// The attribute is one over the generic value; 0 on both sides is "none".
        reciprocal: bool,
        /// What a value of an encoder counts in: the conversions leave that out.
        feedback: Option<FeedbackUnit>,
    },
}

/// One attribute of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AttributeEntry {
    /// Attribute number.
    pub id: u16,
    /// Type of the value or of an array's elements.
    pub data_type: CipType,
    /// Elements of an array; `None` for a single value.
    pub length: Option<u16>,
    /// Access.
    pub access: Access,
    /// Whether it may be set in the Running state.
    pub running: bool,
    /// Value at power-up.
    pub default: i64,
    /// Least and greatest value that may be set.
    pub range: Option<(i64, i64)>,
    /// Who answers.
    pub backing: Backing,
}

/// The attributes of an axis, by number. A clone shares the entries: 47 kB, which are alike for all axes of one scaling.
#[derive(Debug, Clone, Default)]
pub struct AttributeTable {
    entries: Arc<Vec<AttributeEntry>>,
}

/// Why an attribute value cannot be converted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ValueError {
    /// Another number of bytes than the type has.
    #[error("expected {expected} bytes, got {got}")]
    Length {
        /// Bytes of the type.
        expected: usize,
        /// Bytes given.
        got: usize,
    },
    /// Infinite, or not a number.
    #[error("expected a finite number")]
    NotFinite,
    /// Beyond the range of the generic value.
    #[error("the value is out of range")]
    Range,
    /// The attribute is no number, or nothing generic stands behind it.
    #[error("the attribute has no generic value")]
    NotConvertible,
}

impl AttributeTable {
    pub(super) fn compile(tables: &CipTables, scaling: &CipScaling) -> Option<Self> {
        let mut entries = Vec::with_capacity(tables.attributes.len());
        for entry in compiled(tables, scaling) {
            entries.push(entry?);
        }
        Some(Self { entries: Arc::new(entries) })
    }

    /// An empty table of its own with room for the attributes of these tables.
    pub(super) fn with_room(tables: &CipTables) -> Self {
        Self { entries: Arc::new(Vec::with_capacity(tables.attributes.len())) }
    }

    /// The attributes in another scaling, in place: nothing is allocated in a table of [`AttributeTable::with_room`]. `None`, and
    /// nothing done, when a ratio does not fit 64 bits, or the table is shared.
    pub(super) fn refill(&mut self, tables: &CipTables, scaling: &CipScaling) -> Option<()> {
        if compiled(tables, scaling).any(|entry| entry.is_none()) {
            return None;
        }
        let entries = Arc::get_mut(&mut self.entries)?;
        entries.clear();
        entries.extend(compiled(tables, scaling).flatten());
        Some(())
    }

    /// All attributes.
    pub fn entries(&self) -> &[AttributeEntry] {
        &self.entries
    }

    /// The attribute with this number, if the device serves it.
    pub fn get(&self, id: u16) -> Option<&AttributeEntry> {
        let at = self.entries.binary_search_by_key(&id, |entry| entry.id).ok()?;
        self.entries.get(at)
    }
}

/// What stands behind an attribute, and whether its sign is turned: an inverted Motion Polarity turns the sign of signals
/// and exchanges the limits of the two directions (clause 5-2.3.2.1.2, Tables 5-2.14 and 5-2.15).
pub(super) fn behind<'t>(
    tables: &'t CipTables,
    row: &'t ServedAttribute,
    scaling: &CipScaling,
) -> (&'t Served, bool) {
    if !scaling.inverted {
        return (&row.served, false);
    }
    match row.attribute.polarity {
        PolarityEffect::None => (&row.served, false),
        PolarityEffect::Sign => (&row.served, true),
        PolarityEffect::Swap(with) => {
            let other = tables.attributes.iter().find(|other| other.attribute.id == with);
            match (row.served, other.map(|other| &other.served)) {
                // What is kept for the controller alone stays as the controller has set it.
                (Served::Parameter { .. }, Some(other @ Served::Parameter { parameter, .. })) => {
                    (other, parameter.row().is_some_and(|row| limit_has_sign(row.quantity)))
                }
                _ => (&row.served, false),
            }
        }
    }
}

/// Each attribute in a scaling; `None` for one of which a ratio does not fit 64 bits.
fn compiled<'t>(
    tables: &'t CipTables,
    scaling: &'t CipScaling,
) -> impl Iterator<Item = Option<AttributeEntry>> + 't {
    tables.attributes.iter().map(move |row| {
        let (behind, turns) = behind(tables, row, scaling);
        entry(row, behind, turns, scaling)
    })
}

fn entry(
    row: &ServedAttribute,
    served: &Served,
    turns: bool,
    scaling: &CipScaling,
) -> Option<AttributeEntry> {
    let attribute = &row.attribute;
    let backing = match *served {
        Served::Device => Backing::Device,
        Served::Connection => Backing::Connection,
        Served::Stored => Backing::Stored,
        Served::Constant(value) => Backing::Constant(value),
        Served::Mechanics(fact) => Backing::Mechanics(fact),
        Served::Signal { signal, otherwise, unit } => {
            let to_generic = scaling.convert(unit, turns)?;
            Backing::Signal { signal, otherwise, from_generic: Conversion::new(to_generic.inverse()?) }
        }
        Served::Parameter { parameter, unit, missing, range } => {
            let to_generic = scaling.convert(unit, turns)?;
            let (low, high) = range.unwrap_or((i64::MIN, i64::MAX));
            Backing::Parameter {
                parameter,
                to_generic: Conversion::new(to_generic).within(low, high),
                from_generic: Conversion::new(to_generic.inverse()?),
                missing,
                reciprocal: unit.reciprocal,
                feedback: unit.times.feedback(attribute.id),
            }
        }
    };
    Some(AttributeEntry {
        id: attribute.id,
        data_type: attribute.data_type,
        length: attribute.length,
        access: attribute.access,
        running: attribute.running,
        default: attribute.default.unwrap_or(0),
        range: row.range,
        backing,
    })
}

impl AttributeEntry {
    /// The generic value of the bytes of the attribute.
    ///
    /// # Errors
    /// The bytes do not hold a value of the type, or the value is out of range, or no parameter stands
    /// behind it.
    pub fn to_generic(&self, bytes: &[u8]) -> Result<i64, ValueError> {
        let Backing::Parameter { to_generic, reciprocal, .. } = &self.backing else {
            return Err(ValueError::NotConvertible);
        };
        if *reciprocal {
            return self.reciprocal_to_generic(to_generic, bytes);
        }
        let width = self.number_width()?;
        let length = ValueError::Length { expected: width.bytes(), got: bytes.len() };
        let integer = width.integer(bytes).ok_or(length)?;
        let outcome = match (width, bytes) {
            (Width::F32, &[a, b, c, d]) => {
                let value = f64::from(f32::from_le_bytes([a, b, c, d]));
                to_generic.convert_f64(value).ok_or(ValueError::NotFinite)?
            }
            (Width::F64, &[a, b, c, d, e, f, g, h]) => {
                let value = f64::from_le_bytes([a, b, c, d, e, f, g, h]);
                to_generic.convert_f64(value).ok_or(ValueError::NotFinite)?
            }
            _ => to_generic.convert(integer),
        };
        if outcome.saturated { Err(ValueError::Range) } else { Ok(outcome.value) }
    }

    /// One over a real value, as a time constant is of a bandwidth. 0 is "none" on both sides, so nothing else may come to it.
    fn reciprocal_to_generic(&self, to_generic: &Conversion, bytes: &[u8]) -> Result<i64, ValueError> {
        let value = match (self.number_width()?, bytes) {
            (Width::F32, &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
            (Width::F32, _) => {
                return Err(ValueError::Length { expected: Width::F32.bytes(), got: bytes.len() });
            }
            _ => return Err(ValueError::NotConvertible),
        };
        if !value.is_finite() {
            return Err(ValueError::NotFinite);
        }
        if value == 0.0 {
            return Ok(0);
        }
        let outcome = to_generic.convert_f64(value.recip()).ok_or(ValueError::Range)?;
        if value < 0.0 || outcome.saturated || outcome.value == 0 {
            return Err(ValueError::Range);
        }
        Ok(outcome.value)
    }

    /// Writes a generic value as the attribute into `out` and returns the bytes that count and whether the
    /// value was clamped.
    ///
    /// # Errors
    /// The attribute is no number, or neither a parameter nor a signal stands behind it.
    pub fn from_generic(&self, generic: i64, out: &mut [u8; 8]) -> Result<(usize, bool), ValueError> {
        let (Backing::Parameter { from_generic, .. } | Backing::Signal { from_generic, .. }) = &self.backing
        else {
            return Err(ValueError::NotConvertible);
        };
        if self.feedback().is_some() {
            // Its encoder says how much one is: [`AttributeEntry::from_encoder`].
            return Err(ValueError::NotConvertible);
        }
        let width = self.number_width()?;
        *out = [0; 8];
        if let Backing::Parameter { reciprocal: true, to_generic, .. } = &self.backing {
            let value = match (width, generic) {
                (Width::F32, 0) => 0.0,
                (Width::F32, _) => {
                    let ratio = to_generic.ratio;
                    let divisor = ratio.den().checked_mul(generic);
                    let value = divisor.and_then(|divisor| Ratio::new(ratio.num(), divisor));
                    value.ok_or(ValueError::Range)?.convert_to_f32(1).value
                }
                _ => return Err(ValueError::NotConvertible),
            };
            out[..4].copy_from_slice(&value.to_le_bytes());
            return Ok((width.bytes(), false));
        }
        let clamped = match width {
            Width::F32 => {
                let (outcome, saturated) = from_generic.convert_to_f32(generic);
                out[..4].copy_from_slice(&outcome.value.to_le_bytes());
                saturated
            }
            Width::F64 => {
                let (outcome, saturated) = from_generic.convert_to_f64(generic);
                *out = outcome.value.to_le_bytes();
                saturated
            }
            _ => {
                let outcome = from_generic.convert(generic);
                let (min, max) = width.range();
                let value = outcome.value.clamp(min, max);
                let bytes = value.to_le_bytes();
                out[..width.bytes()].copy_from_slice(&bytes[..width.bytes()]);
                outcome.saturated || value != outcome.value
            }
        };
        Ok((width.bytes(), clamped))
    }

    /// Writes the generic value of a signal as the attribute into `out` and returns the bytes that count; positions as the
    /// controller sees them. They roll over where the type of the attribute ends.
    ///
    /// # Errors
    /// As for [`AttributeEntry::from_generic`].
    pub fn from_signal(
        &self,
        generic: i64,
        view: &PositionView,
        out: &mut [u8; 8],
    ) -> Result<usize, ValueError> {
        let seen = match &self.backing {
            Backing::Signal { signal: Signal::PositionActual, from_generic, .. } => {
                view.measured(from_generic.convert(generic).value)
            }
            Backing::Signal { signal: Signal::PositionCommand, from_generic, .. } => {
                view.commanded(from_generic.convert(generic).value)
            }
            _ => return self.from_generic(generic, out).map(|(len, _)| len),
        };
        let width = self.number_width()?;
        if matches!(width, Width::F32 | Width::F64) {
            return Err(ValueError::NotConvertible);
        }
        *out = seen.to_le_bytes();
        Ok(width.bytes())
    }

    /// Writes the value of an encoder as the attribute into `out` and returns the bytes that count; `nanounits` are in one of
    /// what it counts in. Counts roll over where the type of the attribute ends (clause 5-2.6.6.2).
    ///
    /// # Errors
    /// As for [`AttributeEntry::from_generic`].
    pub fn from_encoder(
        &self,
        generic: i64,
        nanounits: Ratio,
        out: &mut [u8; 8],
    ) -> Result<usize, ValueError> {
        let Backing::Parameter { from_generic, feedback: Some(FeedbackUnit { is_counts, .. }), .. } =
            &self.backing
        else {
            return Err(ValueError::NotConvertible);
        };
        let width = self.number_width()?;
        let ratio = nanounits.inverse().and_then(|each| from_generic.ratio.then(each));
        let conversion = Conversion::new(ratio.ok_or(ValueError::Range)?);
        *out = [0; 8];
        match width {
            Width::F32 => {
                let (outcome, _) = conversion.convert_to_f32(generic);
                out[..4].copy_from_slice(&outcome.value.to_le_bytes());
            }
            Width::F64 => return Err(ValueError::NotConvertible),
            _ => {
                let outcome = conversion.with_rounding(Rounding::Floor).convert(generic);
                if outcome.saturated || !is_counts {
                    return Err(ValueError::Range);
                }
                *out = outcome.value.to_le_bytes();
            }
        }
        Ok(width.bytes())
    }

    /// What a value of an encoder counts in.
    #[must_use]
    pub fn feedback(&self) -> Option<FeedbackUnit> {
        match self.backing {
            Backing::Parameter { feedback, .. } => feedback,
            _ => None,
        }
    }

    /// Whether two values of the attribute are the same: reals to a thousandth, as drives keep whole steps of their units.
    #[must_use]
    pub fn agree(&self, a: &[u8], b: &[u8]) -> bool {
        match (self.number(a), self.number(b)) {
            (Some(Number::Real(a)), Some(Number::Real(b))) => (a - b).abs() <= a.abs().max(b.abs()) * SAME,
            (Some(a), Some(b)) => a == b,
            // What is no number is not compared.
            _ => false,
        }
    }

    /// Whether the attribute is one over the generic value.
    #[must_use]
    pub fn is_reciprocal(&self) -> bool {
        matches!(self.backing, Backing::Parameter { reciprocal: true, .. })
    }

    /// Writes a number as the attribute into `out` and returns the bytes that count; `None` for one that the attribute cannot hold.
    #[must_use]
    pub fn write_number(&self, number: Number, out: &mut [u8; 8]) -> Option<usize> {
        let width = self.number_width().ok()?;
        *out = [0; 8];
        match (width, number) {
            (Width::F32, Number::Real(value)) => {
                out[..4].copy_from_slice(&nearest_single(value).to_le_bytes());
            }
            (Width::F64, Number::Real(value)) => *out = value.to_le_bytes(),
            (Width::F32 | Width::F64, _) | (_, Number::Real(_)) => return None,
            (_, Number::Integer(value)) => {
                let (low, high) = width.range();
                if !(low..=high).contains(&value) {
                    return None;
                }
                *out = value.to_le_bytes();
            }
        }
        Some(width.bytes())
    }

    /// The number that the bytes of the attribute are; `None` for an array, a string, and bytes that are too few.
    #[must_use]
    pub fn number(&self, bytes: &[u8]) -> Option<Number> {
        let width = self.number_width().ok()?;
        Some(match (width, bytes) {
            (Width::F32, &[a, b, c, d]) => Number::Real(f64::from(f32::from_le_bytes([a, b, c, d]))),
            (Width::F64, &[a, b, c, d, e, f, g, h]) => {
                Number::Real(f64::from_le_bytes([a, b, c, d, e, f, g, h]))
            }
            _ => Number::Integer(width.integer(bytes)?),
        })
    }

    fn number_width(&self) -> Result<Width, ValueError> {
        self.data_type.width().filter(|_| self.length.is_none()).ok_or(ValueError::NotConvertible)
    }
}

/// The nearest single; ties to even.
#[expect(clippy::cast_possible_truncation, reason = "the nearest single is what is wanted")]
const fn nearest_single(value: f64) -> f32 {
    value as f32
}
