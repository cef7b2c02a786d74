//! What a drive is told and asked once its poll connection runs, before its axis may use it.
//!
//! | a CIP Motion drive | a velocity drive |
//! |---|---|
//! | its limits, as the configuration has them | SpeedScale: it has to be the one of the configuration |
//! | Configuration Complete (attribute 89) | control and reference from the network, where its assembly has no bits for them |

mod speed;

use profile_cip::device::attribute::id;
use profile_cip::devicenet::master::event::{ExplicitRequest, Outcome};

pub use self::speed::speed_steps;
use super::access::{value, write, written};
use crate::engine::access::{AccessFailure, Refusal};
use crate::mapping::Attribute;
use crate::mapping::devicenet::motion;

/// One explicit message before operation, and the answer that it must have.
#[derive(Debug, Clone)]
pub struct SetupStep {
    /// What it is about.
    pub attribute: Attribute,
    request: ExplicitRequest,
    answer: Answer,
}

/// What the answer has to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Answer {
    /// The value is taken.
    Written,
    /// The value is this one; a drive without the attribute has 0.
    Equals(i8),
}

/// Why a drive cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SetupFailure {
    /// It has not taken a value.
    #[error("writing {attribute}: {}", why(*failure))]
    NotWritten {
        /// Class, instance and attribute that it was about.
        attribute: Attribute,
        /// Why.
        failure: AccessFailure,
    },
    /// It has not told a value.
    #[error("reading {attribute}: {}", why(*failure))]
    NotRead {
        /// Class, instance and attribute that it was about.
        attribute: Attribute,
        /// Why.
        failure: AccessFailure,
    },
    /// It has another value than the configuration says.
    #[error("{attribute}: expected {expected}, the drive has {found}")]
    Other {
        /// Class, instance and attribute that it was about.
        attribute: Attribute,
        /// What the configuration says.
        expected: i8,
        /// What the drive says.
        found: i8,
    },
}

const fn why(failure: AccessFailure) -> &'static str {
    match failure {
        AccessFailure::Refused(Refusal::Unknown) => "the drive has none",
        AccessFailure::Refused(Refusal::ReadOnly) => "it can only be read",
        AccessFailure::Refused(Refusal::Value) => "the drive does not take the value",
        AccessFailure::Refused(Refusal::Other) => "the drive refuses",
        AccessFailure::Unanswered => "no answer that can be understood",
    }
}

fn set(class: u16, id: u16, bytes: &[u8]) -> Option<SetupStep> {
    let attribute = Attribute { class, id };
    Some(SetupStep { attribute, request: write(attribute, bytes)?, answer: Answer::Written })
}

/// The steps of a CIP Motion drive that has to hold these REAL attributes.
#[must_use]
pub fn motion_steps(limits: &[(u16, f32)]) -> Vec<SetupStep> {
    let limits = limits.iter().filter_map(|(id, value)| set(motion::CLASS, *id, &value.to_le_bytes()));
    limits.chain(set(motion::CLASS, id::CONTROL_STATUS, &[1])).collect()
}

impl SetupStep {
    /// What is sent.
    #[must_use]
    pub fn request(&self) -> ExplicitRequest {
        self.request.clone()
    }

    /// Whether the answer is the right one.
    ///
    /// # Errors
    /// It is not.
    pub fn judge(&self, outcome: &Outcome) -> Result<(), SetupFailure> {
        let attribute = self.attribute;
        match self.answer {
            Answer::Written => {
                written(attribute, outcome).map_err(|failure| SetupFailure::NotWritten { attribute, failure })
            }
            Answer::Equals(expected) => {
                let found = match value(attribute, outcome) {
                    Ok(bytes) if bytes.len() == 1 => i8::from_le_bytes([bytes[0]]),
                    Ok(_) => {
                        return Err(SetupFailure::NotRead { attribute, failure: AccessFailure::Unanswered });
                    }
                    Err(AccessFailure::Refused(Refusal::Unknown)) => 0,
                    Err(failure) => return Err(SetupFailure::NotRead { attribute, failure }),
                };
                let other = SetupFailure::Other { attribute, expected, found };
                if found == expected { Ok(()) } else { Err(other) }
            }
        }
    }
}

#[cfg(test)]
mod tests;
