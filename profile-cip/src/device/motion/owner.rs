//! Who may change the Motion Device Axis Object by explicit message.
//!
//! While a motion connection is open, its controller alone decides over the axes: only messages from the address that its
//! Forward_Open came from may do more than read. Attributes decide over motion as much as requests do (scaling, stopping,
//! limits, and in the fixed format Configuration Complete), and nobody beside the controller can know what it is doing
//! with the axis. Others are told "privilege violation" for the whole service, before its data are looked at.
//!
//! The documents leave this to the device maker; status 0x0F is that of a permission which the requester lacks. With no
//! connection open there is no owner, and any client that configures the device may set what can be set.

use core::net::Ipv4Addr;

use crate::device::motion_link::ExplicitRequest;
use crate::wire::motion::codes::MotionService;

/// Services of explicit messages alone, by their CIP codes.
pub(super) mod common {
    pub const GET_ATTRIBUTES_ALL: u8 = 0x01;
    pub const GET_ATTRIBUTE_LIST: u8 = 0x03;
    pub const SET_ATTRIBUTE_LIST: u8 = 0x04;
    pub const GET_ATTRIBUTE_SINGLE: u8 = 0x0E;
    pub const SET_ATTRIBUTE_SINGLE: u8 = 0x10;
}

/// Whether a service does nothing but read. What is not known to be harmless counts as a change.
pub(crate) fn reads(service: u8) -> bool {
    let common = [common::GET_ATTRIBUTES_ALL, common::GET_ATTRIBUTE_LIST, common::GET_ATTRIBUTE_SINGLE]
        .contains(&service);
    common
        || matches!(
            MotionService(service),
            MotionService::GET_AXIS_ATTRIBUTES_LIST
                | MotionService::GET_MOTOR_TEST_DATA
                | MotionService::GET_INERTIA_TEST_DATA
                | MotionService::GET_HOOKUP_TEST_DATA
        )
}

/// Whether a request is not its sender's to make while `owner` has the motion connection.
pub(super) fn is_foreign(owner: Option<Ipv4Addr>, request: &ExplicitRequest) -> bool {
    owner.is_some_and(|owner| owner != request.originator) && !reads(request.service)
}
