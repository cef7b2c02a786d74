//! What a count of the controller is, from the scaling attributes of an axis.

use profile_generic::ratio::Ratio;
use profile_generic::scaling::UnitKind;

use super::cip_tables::{CipTables, CipUnit, Times};

/// The scaling of one axis on the CIP side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CipScaling {
    /// Rotary or linear.
    pub kind: UnitKind,
    /// Nanounits in a displacement unit, above zero.
    pub nanounits_per_unit: i64,
    /// Counts in a displacement unit, above zero.
    pub counts_per_unit: i64,
    /// Whether the direction is turned.
    pub inverted: bool,
    /// Counts of one cycle of the machine, for a cyclic axis.
    pub unwind: Option<i64>,
}

/// Why the scaling attributes make no scaling.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CipScalingError {
    /// An attribute holds nothing that can be used.
    #[error("attribute {attribute}: expected {expected}, got {value}")]
    Attribute {
        /// Attribute number.
        attribute: u16,
        /// What it should hold.
        expected: &'static str,
        /// What it holds.
        value: i64,
    },
    /// The ratio of counts to nanounits does not fit 64 bits.
    #[error("attribute {attribute}: the resolution {value} cannot be expressed exactly")]
    Inexact {
        /// Attribute number.
        attribute: u16,
        /// The resolution.
        value: i64,
    },
}

impl CipScaling {
    /// The scaling that the attributes of an axis describe; `get` returns the value of an attribute, 0
    /// where it was never set.
    ///
    /// # Errors
    /// A code, a resolution or an unwind position cannot be used; the error names the attribute.
    pub fn from_attributes(tables: &CipTables, get: impl Fn(u16) -> i64) -> Result<Self, CipScalingError> {
        let rows = &tables.scaling;
        let drive_scaling = get(rows.configuration) == i64::from(rows.drive_scaling);
        let (unit_attribute, units) = if drive_scaling {
            (rows.unit, &tables.motion_units)
        } else {
            (rows.feedback_unit, &tables.feedback_units)
        };
        let code = get(unit_attribute);
        let unit =
            units.iter().find(|unit| i64::from(unit.code) == code).ok_or(CipScalingError::Attribute {
                attribute: unit_attribute,
                expected: "the code of a displacement unit",
                value: code,
            })?;
        let mut counts_per_unit: i64 = 1;
        let resolution = if drive_scaling { &rows.resolution[..] } else { &rows.feedback_resolution[..] };
        for &attribute in resolution {
            let value = get(attribute);
            let product =
                Some(value).filter(|value| *value > 0).and_then(|value| counts_per_unit.checked_mul(value));
            counts_per_unit = product.ok_or(CipScalingError::Attribute {
                attribute,
                expected: "a number above 0",
                value,
            })?;
        }
        let unwind = (drive_scaling && get(rows.unwind) != 0).then(|| get(rows.unwind_position));
        if let Some(value) = unwind
            && !(2..=i64::from(i32::MAX)).contains(&value)
        {
            let attribute = rows.unwind_position;
            return Err(CipScalingError::Attribute { attribute, expected: "2 counts to 2^31 - 1", value });
        }
        let scaling = Self {
            kind: unit.kind,
            nanounits_per_unit: unit.nanounits,
            counts_per_unit,
            inverted: drive_scaling && get(rows.polarity) == i64::from(rows.inverted),
            unwind,
        };
        match scaling.checked_nanounits_per_count() {
            Some(_) => Ok(scaling),
            None => Err(CipScalingError::Inexact { attribute: unit_attribute, value: counts_per_unit }),
        }
    }

    fn checked_nanounits_per_count(&self) -> Option<Ratio> {
        let ratio = Ratio::new(self.nanounits_per_unit, self.counts_per_unit)?;
        let ratio = if self.inverted { ratio.then(Ratio::new(-1, 1)?)? } else { ratio };
        ratio.inverse().map(|_| ratio)
    }

    /// Nanounits in a count; negative when the direction is turned.
    pub fn nanounits_per_count(&self) -> Ratio {
        self.checked_nanounits_per_count().unwrap_or_default()
    }

    /// Generic units in one `unit`; `turns` when the value has a direction that the polarity turns.
    pub(super) fn convert(&self, unit: CipUnit, turns: bool) -> Option<Ratio> {
        let times = match unit.times {
            Times::One => Ratio::ONE,
            Times::MotionCount => Ratio::new(self.nanounits_per_unit, self.counts_per_unit)?,
            Times::MotionUnit => Ratio::new(self.nanounits_per_unit, 1)?,
            // Whoever answers multiplies by what the attributes of the encoder say then.
            Times::FeedbackCount | Times::FeedbackUnit => Ratio::ONE,
        };
        let sign = if turns && self.inverted { -1 } else { 1 };
        unit.ratio.then(times)?.then(Ratio::new(sign, 1)?)
    }
}
