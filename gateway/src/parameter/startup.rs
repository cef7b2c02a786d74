//! The start-up list of a drive: what its parameters have to be before it takes part in the cycle.

use super::id::Id;
use super::value::{Kind, ValueError};
use crate::mapping::Cia402Type;

/// What is done when a drive has another value than its list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OnDifference {
    /// The value of the list is written and read back.
    #[default]
    Write,
    /// The drive is not used.
    Refuse,
    /// It is reported, and the drive is used as it is.
    Warn,
}

impl OnDifference {
    /// All of them, with their words in a configuration.
    pub const NAMED: [(&'static str, Self); 3] =
        [("write", Self::Write), ("refuse", Self::Refuse), ("warn", Self::Warn)];
}

/// A value of a list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StartupValue {
    /// As people write it; [`Kind::encode`] reads it.
    Text(String),
    /// The bytes in the order of the drive, from a backup.
    Bytes(Vec<u8>),
}

/// One parameter of a list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StartupEntry {
    /// The parameter.
    pub id: Id,
    /// What it has to be.
    pub value: StartupValue,
    /// The type of an object; `None` of an IDN, whose attribute says it, and where nobody says it.
    pub data_type: Option<Cia402Type>,
    /// What is done when the drive has something else.
    pub on_difference: OnDifference,
    /// Whether it is from a backup, and not from the configuration itself.
    pub from_file: bool,
}

impl StartupEntry {
    /// The bytes of the value for a drive in which the parameter is of this kind.
    ///
    /// # Errors
    /// [`ValueError`]
    pub fn bytes(&self, kind: Kind) -> Result<Vec<u8>, ValueError> {
        match &self.value {
            StartupValue::Bytes(bytes) => Ok(bytes.clone()),
            StartupValue::Text(text) => kind.encode(text),
        }
    }
}
