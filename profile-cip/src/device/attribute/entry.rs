//! An attribute of a table: its place, its default, and what it may be set to.

use super::data_type::SHORT_STRING_MAX;
use super::{Access, AttributeDefinition, Backing, DataType, DefaultValue};
use crate::wire::status::GeneralStatus;

/// One attribute with the place of its value.
#[derive(Debug, Clone)]
pub struct Entry {
    /// What it is.
    pub definition: AttributeDefinition,
    pub(super) offset: usize,
    pub(super) default: [u8; 8],
    /// Defaults of the elements that have a rule of their own.
    pub(super) element_defaults: Vec<[u8; 8]>,
}

/// Part of an attribute: `count` elements from `start`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// First element.
    pub start: u16,
    /// Number of elements.
    pub count: u16,
}

impl Entry {
    /// The whole value.
    #[must_use]
    pub fn whole(&self) -> Part {
        Part { start: 0, count: self.definition.elements.unwrap_or(1) }
    }

    /// Checks that the part lies within the attribute, and gives its octets within the whole value.
    pub(super) fn range(&self, part: Part) -> Result<core::ops::Range<usize>, GeneralStatus> {
        let size = usize::from(self.definition.data_type.size());
        let end = u32::from(part.start) + u32::from(part.count);
        if part.count == 0 || end > u32::from(self.whole().count) {
            return Err(GeneralStatus::INVALID_PARAMETER);
        }
        let start = usize::from(part.start) * size;
        Ok(start..start + usize::from(part.count) * size)
    }

    /// Whether the attribute is a trim: a value of the drive's process image that updates carry beside their set-points. It
    /// counts for the set-points that it came with, and for no others.
    #[must_use]
    pub fn is_trim(&self) -> bool {
        self.definition.access == Access::Cyclic && self.definition.backing == Backing::Signal
    }

    /// Checks a value for a part without writing it.
    ///
    /// # Errors
    /// The general status and the index of the element that caused it.
    pub fn check_set(&self, part: Part, value: &[u8], running: bool) -> Result<(), (GeneralStatus, u16)> {
        if self.definition.access != Access::Set {
            return Err((GeneralStatus::ATTRIBUTE_NOT_SETTABLE, 0));
        }
        self.check_value(part, value, running)
    }

    /// The same without a look at the access: for what an update carries.
    ///
    /// # Errors
    /// The general status and the index of the element that caused it.
    pub(crate) fn check_value(
        &self,
        part: Part,
        value: &[u8],
        running: bool,
    ) -> Result<(), (GeneralStatus, u16)> {
        let definition = &self.definition;
        let range = self.range(part).map_err(|status| (status, part.start))?;
        let is_string = definition.data_type == DataType::ShortString;
        if is_string {
            check_string(value).map_err(|status| (status, 0))?;
        } else if value.len() != range.len() {
            let short = value.len() < range.len();
            let status = if short { GeneralStatus::NOT_ENOUGH_DATA } else { GeneralStatus::TOO_MUCH_DATA };
            return Err((status, 0));
        }
        if running && !definition.settable_in_running {
            return Err((GeneralStatus::OBJECT_STATE_CONFLICT, 0));
        }
        if is_string {
            return Ok(());
        }
        let size = usize::from(definition.data_type.size());
        for (index, element) in (part.start..).zip(value.chunks_exact(size)) {
            let rule = definition.element_rules.get(usize::from(index));
            if rule.is_some_and(|rule| rule.keeps_with(element)) {
                continue;
            }
            let range = rule.map_or(definition.range, |rule| Some(rule.range));
            check_value(definition, range, element).map_err(|status| (status, index))?;
        }
        Ok(())
    }
}

/// The octets of a default, if it fits the type and the range.
pub(super) fn encode_default(
    definition: &AttributeDefinition,
    default: DefaultValue,
    range: Option<(f64, f64)>,
) -> Option<[u8; 8]> {
    let size = usize::from(definition.data_type.size());
    let octets = match (definition.data_type, default) {
        (DataType::ShortString, DefaultValue::Integer(0)) => return Some([0; 8]),
        (DataType::ShortString, _) => return None,
        (DataType::Real, DefaultValue::Real(value)) => {
            let narrow = narrow(value);
            let mut octets = [0; 8];
            octets[..4].copy_from_slice(&narrow.to_le_bytes());
            octets
        }
        (DataType::Lreal, DefaultValue::Real(value)) => value.to_le_bytes(),
        (DataType::Real | DataType::Lreal, DefaultValue::Integer(0)) => [0; 8],
        (DataType::Real | DataType::Lreal, _) | (_, DefaultValue::Real(_)) => return None,
        (_, DefaultValue::Integer(value)) => {
            let octets = value.to_le_bytes();
            let (low, high) = octets.split_at(size);
            let negative = low[size - 1] & 0x80 != 0;
            let clean = high.iter().all(|o| *o == 0) || (negative && high.iter().all(|o| *o == 0xFF));
            if !clean {
                return None;
            }
            octets
        }
    };
    // Everything is 0 at power-up unless the standard says otherwise, also where 0 is none of the codes.
    check_range(definition.data_type, range, &octets[..size]).ok()?;
    Some(octets)
}

#[expect(clippy::cast_possible_truncation, reason = "a REAL holds the nearest single precision number")]
fn narrow(value: f64) -> f32 {
    value as f32
}

/// Checks one element: a number that is finite and within the range, and then one of the codes and bits that there are.
fn check_value(
    definition: &AttributeDefinition,
    range: Option<(f64, f64)>,
    element: &[u8],
) -> Result<(), GeneralStatus> {
    check_range(definition.data_type, range, element)?;
    let raw = definition.data_type.raw(element).ok_or(GeneralStatus::NOT_ENOUGH_DATA)?;
    let truth = definition.data_type != DataType::Bool || raw <= 1;
    let code = definition.codes.is_empty()
        || u32::try_from(raw).is_ok_and(|raw| definition.codes.binary_search(&raw).is_ok());
    let bits = definition.bits.is_none_or(|bits| raw & !bits == 0);
    if truth && code && bits { Ok(()) } else { Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE) }
}

/// Checks that the octets are a string with its length in front.
pub(super) fn check_string(value: &[u8]) -> Result<(), GeneralStatus> {
    match value.split_first() {
        Some((length, characters)) if characters.len() > usize::from(*length) => {
            Err(GeneralStatus::TOO_MUCH_DATA)
        }
        Some((length, characters)) if characters.len() == usize::from(*length) => {
            if *length <= SHORT_STRING_MAX { Ok(()) } else { Err(GeneralStatus::TOO_MUCH_DATA) }
        }
        _ => Err(GeneralStatus::NOT_ENOUGH_DATA),
    }
}

/// Checks one element: finite and within the range.
fn check_range(data_type: DataType, range: Option<(f64, f64)>, element: &[u8]) -> Result<(), GeneralStatus> {
    let value = data_type.to_f64(element).ok_or(GeneralStatus::NOT_ENOUGH_DATA)?;
    let (low, high) = range.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
    if value.is_finite() && value >= low && value <= high {
        Ok(())
    } else {
        Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE)
    }
}
