//! Indices of objects. Those of CiA 402 are for the first axis of a device; those of axis n are [`AXIS_OFFSET`] times n
//! higher.

pub use crate::generated::objects::*;

/// Distance from an object of one axis to that of the next.
pub const AXIS_OFFSET: u16 = 0x800;

/// Most axes in a device.
pub const AXES_MAX: u8 = 8;

/// What an object of whatever axis is on the first one; others stay as they are.
#[must_use]
pub const fn on_first_axis(index: u16) -> u16 {
    match index {
        0x6000..=0x9FFF => 0x6000 + (index - 0x6000) % AXIS_OFFSET,
        _ => index,
    }
}

/// Bits of 60FDh.
pub mod input {
    /// Negative limit switch.
    pub const NEGATIVE_LIMIT: u32 = 1 << 0;
    /// Positive limit switch.
    pub const POSITIVE_LIMIT: u32 = 1 << 1;
    /// Home switch.
    pub const HOME: u32 = 1 << 2;
    /// Interlock.
    pub const INTERLOCK: u32 = 1 << 3;
    /// The inputs of the manufacturer begin at this bit.
    pub const MANUFACTURER_SHIFT: u32 = 16;
}
