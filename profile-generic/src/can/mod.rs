//! CAN frames, as the two profiles that run on CAN hand them to their transport and take them from it; what a frame takes on
//! the wire ([`timing`]), and a bus in virtual time ([`bus`]).
//!
//! This is no part of IEC 61800-7-1. It stands here because CANopen and DeviceNet both need it and profiles do not know each
//! other.

pub mod bus;
mod frame;
pub mod timing;

pub use self::frame::{Frame, FrameError, Id};
