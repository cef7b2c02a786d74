//! Why a CANopen drive is left out.

use profile_cia402::master::CallError;
use profile_cia402::sdo::request::SdoFailure;

use super::layout::{NoRoom, NotMapped};
use crate::mapping::{Cia402Error, Item, Object};

/// A step that the drive did not take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{what} {object}: {failure}")]
pub struct StepFailure {
    /// What was tried.
    pub what: &'static str,
    /// Index and sub-index in the object dictionary.
    pub object: Object,
    /// Why it failed.
    pub failure: SdoFailure,
}

/// Why a drive cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Misfit {
    /// It does not fit the tables.
    #[error("{0}")]
    Program(#[from] Cia402Error),
    /// Its values do not fit its PDOs.
    #[error("{0}")]
    Room(#[from] NoRoom),
    /// Its values are not in the PDOs that it keeps.
    #[error("{0}")]
    Mapped(#[from] NotMapped),
    /// More devices with several axes than there are free identifiers.
    #[error("no identifiers are left for its PDOs: expected fewer devices with several axes")]
    Identifiers,
    /// The network is not possible with its PDOs.
    #[error("{0}")]
    Network(#[from] CallError),
    /// Nobody says how long a value is.
    #[error("the dictionary has no length for {0}")]
    Length(Item),
}
