//! Parameters: the catalogue of what can be read from and written to a drive, and the access to it.
//!
//! A parameter is a data element with a name, a type and an access direction (IEC 61800-7-202, 3.1.37). Each
//! profile binds its attributes, IDNs or objects to the parameters of this catalogue.

use crate::cast;
use crate::code::named_enum;
use arrayvec::ArrayString;
use core::fmt;

mod catalogue;

pub(crate) use catalogue::parameter_rows;

pub use catalogue::{CATALOGUE, Parameter, ParameterRow};

/// The longest text of a parameter in bytes: a CIP SHORT_STRING product name has at most 32.
pub const MAX_TEXT: usize = 32;

/// The text of a parameter, held in place.
pub type Text = ArrayString<MAX_TEXT>;

named_enum! {
    /// How a parameter is held.
    pub enum ParameterType {
        /// A whole number in the unit of the parameter's quantity.
        Integer = "integer",
        /// A 64-bit floating point number.
        Float = "float",
        /// Up to [`MAX_TEXT`] bytes of UTF-8.
        Text = "text",
    }
}

named_enum! {
    /// When a parameter may be written.
    pub enum Access {
        /// Never: it can only be read.
        Read = "read",
        /// At any time.
        Write = "write",
        /// While the drive has no torque.
        WriteWhileDisabled = "write_while_disabled",
    }
}

named_enum! {
    /// What to do with a parameter.
    pub enum Operation {
        /// Get the value.
        Read = "read",
        /// Set the value.
        Write = "write",
    }
}

/// A value in the type of its parameter, in generic units.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ParameterValue {
    /// A whole number in the unit of the parameter's quantity.
    Integer(i64),
    /// The bits of a double, so that values compare and hash; see [`ParameterValue::float`].
    Float(u64),
    /// A text.
    Text(Text),
}

impl ParameterValue {
    /// A floating point value.
    pub const fn float(value: f64) -> Self {
        Self::Float(value.to_bits())
    }

    /// A text, or `None` when it is longer than [`MAX_TEXT`] bytes.
    pub fn text(text: &str) -> Option<Self> {
        Text::from(text).ok().map(Self::Text)
    }

    /// The whole number, if it is one.
    pub const fn as_i64(&self) -> Option<i64> {
        match self {
            Self::Integer(value) => Some(*value),
            _ => None,
        }
    }

    /// The number as a double, if it is a number; beyond 53 bits an integer is rounded.
    pub const fn as_f64(&self) -> Option<f64> {
        match self {
            Self::Integer(value) => Some(cast::f64_from_i64(*value)),
            Self::Float(bits) => Some(f64::from_bits(*bits)),
            Self::Text(_) => None,
        }
    }

    /// The text, if it is one.
    pub fn as_str(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }

    /// How the value is held.
    pub const fn kind(&self) -> ParameterType {
        match self {
            Self::Integer(_) => ParameterType::Integer,
            Self::Float(_) => ParameterType::Float,
            Self::Text(_) => ParameterType::Text,
        }
    }
}

impl fmt::Display for ParameterValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Integer(value) => write!(f, "{value}"),
            Self::Float(bits) => write!(f, "{}", f64::from_bits(*bits)),
            Self::Text(text) => write!(f, "{text:?}"),
        }
    }
}

/// One access to one parameter, and after it the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ParameterAccess {
    /// Which parameter.
    pub parameter: Parameter,
    /// What to do with it.
    pub operation: Operation,
    /// The value to write, or the value read; `None` in a request to read.
    pub value: Option<ParameterValue>,
}

impl ParameterAccess {
    /// Asks for the value.
    pub const fn read(parameter: Parameter) -> Self {
        Self { parameter, operation: Operation::Read, value: None }
    }

    /// Sets the value.
    pub const fn write(parameter: Parameter, value: ParameterValue) -> Self {
        Self { parameter, operation: Operation::Write, value: Some(value) }
    }

    /// Checks what the catalogue can tell without the drive; `has_torque` as the drive is now.
    ///
    /// # Errors
    /// [`ParameterError::Unknown`], [`ParameterError::ReadOnly`], [`ParameterError::NotNow`], or
    /// [`ParameterError::WrongType`].
    pub fn check(&self, has_torque: bool) -> Result<&'static ParameterRow, ParameterError> {
        let row = self.parameter.row().ok_or(ParameterError::Unknown(self.parameter))?;
        if self.operation == Operation::Read {
            return Ok(row);
        }
        match row.access {
            Access::Read => Err(ParameterError::ReadOnly(self.parameter)),
            Access::WriteWhileDisabled if has_torque => Err(ParameterError::NotNow(self.parameter)),
            _ if self.value.map(|value| value.kind()) != Some(row.kind) => {
                Err(ParameterError::WrongType { parameter: self.parameter, expected: row.kind })
            }
            _ => Ok(row),
        }
    }
}

/// Why an access to a parameter failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ParameterError {
    /// The catalogue or the drive does not have it.
    #[error("parameter {0} is not known")]
    Unknown(Parameter),
    /// It can only be read.
    #[error("parameter {0} can only be read")]
    ReadOnly(Parameter),
    /// It cannot be written in the present state of the drive.
    #[error("parameter {0} cannot be written while the drive has torque")]
    NotNow(Parameter),
    /// The value is of another type.
    #[error("parameter {parameter} expects a value of type {expected}")]
    WrongType {
        /// Which parameter.
        parameter: Parameter,
        /// What it expects.
        expected: ParameterType,
    },
    /// The value is below the lowest or above the highest that is allowed.
    #[error("parameter {parameter} expects {min} to {max}")]
    OutOfRange {
        /// Which parameter.
        parameter: Parameter,
        /// The lowest value allowed.
        min: i64,
        /// The highest value allowed.
        max: i64,
    },
    /// The drive did not answer in time.
    #[error("the drive did not answer for parameter {0} in time")]
    TimedOut(Parameter),
    /// The drive refused with a code of its own.
    #[error("the drive refused parameter {parameter} with code {code:#x}")]
    Refused {
        /// Which parameter.
        parameter: Parameter,
        /// The code of the drive's profile.
        code: u32,
    },
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::Quantity;

    #[test]
    fn the_catalogue_is_ordered_complete_and_uniquely_named() {
        assert!(CATALOGUE.len() >= 80, "{}", CATALOGUE.len());
        for pair in CATALOGUE.windows(2) {
            assert!(
                pair[0].parameter < pair[1].parameter,
                "{} before {}",
                pair[0].parameter,
                pair[1].parameter
            );
        }
        for row in CATALOGUE {
            let name = row.parameter.name().unwrap();
            assert!(
                name.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_')
            );
            assert_eq!(Parameter::from_name(name), Some(row.parameter), "{name}");
            assert!(!row.parameter.is_of_vendor(), "{name}");
            assert_eq!(row.parameter.row(), Some(row), "{name}");
            assert!(row.description.ends_with('.') && row.description.len() > 10, "{name}");
            let measured = row.quantity != Quantity::None;
            assert!(!measured || row.kind == ParameterType::Integer, "{name}: a quantity is an integer");
        }
        assert_eq!(Parameter(0xFFFF).row(), None);
        assert!(Parameter(0x8000).is_of_vendor());
        assert_eq!(Parameter::from_name("no_such_parameter"), None);
    }

    #[test]
    fn values_keep_their_type() {
        assert_eq!(ParameterValue::float(1.5).as_f64(), Some(1.5));
        assert_eq!(ParameterValue::Integer(-7).as_f64(), Some(-7.0));
        assert_eq!(ParameterValue::text("drive").unwrap().as_str(), Some("drive"));
        assert_eq!(ParameterValue::text(&"x".repeat(MAX_TEXT + 1)), None);
        assert_eq!(ParameterValue::float(0.25).to_string(), "0.25");
        assert_eq!(ParameterValue::text("a\"b").unwrap().to_string(), "\"a\\\"b\"");
        assert_eq!(ParameterValue::float(2.0).as_i64(), None);
    }

    #[test]
    fn access_is_checked_against_the_catalogue() {
        let gain = Parameter::POSITION_LOOP_GAIN;
        let number = ParameterValue::Integer(1);
        assert_eq!(ParameterAccess::write(gain, number).check(true).unwrap().parameter, gain);
        assert_eq!(
            ParameterAccess::write(gain, ParameterValue::float(1.0)).check(false),
            Err(ParameterError::WrongType { parameter: gain, expected: ParameterType::Integer })
        );
        let poles = Parameter::MOTOR_POLE_COUNT;
        assert_eq!(ParameterAccess::write(poles, number).check(true), Err(ParameterError::NotNow(poles)));
        assert!(ParameterAccess::write(poles, number).check(false).is_ok());
        let actual = Parameter::LOAD_POSITION_ACTUAL;
        assert_eq!(
            ParameterAccess::write(actual, number).check(false),
            Err(ParameterError::ReadOnly(actual))
        );
        assert!(ParameterAccess::read(actual).check(true).is_ok());
        let unknown = Parameter(0x7777);
        assert_eq!(ParameterAccess::read(unknown).check(true), Err(ParameterError::Unknown(unknown)));
        assert_eq!(ParameterError::Unknown(unknown).to_string(), "parameter 0x7777 is not known");
    }
}
