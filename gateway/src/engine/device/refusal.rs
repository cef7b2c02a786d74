//! What a refusal of the drive means to the controller.

use profile_cip::wire::status::GeneralStatus;

use crate::engine::access::{AccessFailure, Refusal};
use crate::engine::parameter::ParameterFailure;

/// The status with which an access of the controller ends.
pub(super) fn refusal(failure: AccessFailure) -> GeneralStatus {
    match failure {
        AccessFailure::Refused(Refusal::Unknown) => GeneralStatus::ATTRIBUTE_NOT_SUPPORTED,
        AccessFailure::Refused(Refusal::ReadOnly) => GeneralStatus::ATTRIBUTE_NOT_SETTABLE,
        AccessFailure::Refused(Refusal::Value) => GeneralStatus::INVALID_ATTRIBUTE_VALUE,
        AccessFailure::Refused(Refusal::Other) | AccessFailure::Unanswered => {
            GeneralStatus::DEVICE_STATE_CONFLICT
        }
    }
}

/// The status with which an access to a generic parameter ends.
impl From<ParameterFailure> for GeneralStatus {
    fn from(failure: ParameterFailure) -> Self {
        match failure {
            ParameterFailure::Absent => GeneralStatus::ATTRIBUTE_NOT_SUPPORTED,
            ParameterFailure::ReadOnly => GeneralStatus::ATTRIBUTE_NOT_SETTABLE,
            ParameterFailure::Value | ParameterFailure::NotKept => GeneralStatus::INVALID_ATTRIBUTE_VALUE,
            ParameterFailure::NoValue(_)
            | ParameterFailure::Refused
            | ParameterFailure::Torque
            | ParameterFailure::Unanswered => GeneralStatus::DEVICE_STATE_CONFLICT,
            ParameterFailure::Busy => GeneralStatus::RESOURCE_UNAVAILABLE,
        }
    }
}
