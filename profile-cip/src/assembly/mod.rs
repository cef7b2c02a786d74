//! Assemblies that carry axes: what a programmable controller exchanges with a drive on a class 1 connection to an assembly.
//!
//! - [`field`]: the named values of one axis, with their types on the wire;
//! - [`layout`]: which fields an axis has, at which offsets, and the assemblies of a device;
//! - [`data`]: the values of one axis, from bytes and to bytes;
//! - [`handshake`]: when a control word enables, stops, starts and resets.
//!
//! Connection data of the controller have a run/idle header in front; those of the device have none.
//!
//! | connection point | what it is |
//! |---|---|
//! | 150 (20 to 23) | output assembly: from the controller |
//! | 100 (70 to 73) | input assembly: to the controller |
//! | 151 | configuration assembly, without data |
//! | 152 | heartbeat of an input-only connection |
//! | 153 | heartbeat of a listen-only connection |
//!
//! Numbers in brackets are those of the AC/DC drive profile, whose assemblies a layout may have instead.

pub mod data;
pub mod field;
pub mod handshake;
pub mod layout;

pub use self::data::{AxisInput, AxisOutput, Scale, SizeError};
pub use self::field::{InputField, OutputField};
pub use self::handshake::{Control, Handshake, Link, Reaction, Refusal, State};
pub use self::layout::{Assemblies, DriveMode, Layout, LayoutError, Placed};

/// Bytes of the run/idle header in front of output data.
pub const RUN_IDLE_LEN: usize = 4;

/// Bit of the run/idle header: the controller runs.
pub const RUN: u32 = 1;

#[cfg(test)]
mod tests;
