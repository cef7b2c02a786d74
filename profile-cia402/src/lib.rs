#![doc = include_str!("../README.md")]
//!
//! # Parts
//!
//! * [`wire`]: what stands in the frames, as values; one file per kind of frame.
//! * [`sdo`]: both ends of an SDO channel.
//! * [`lss`]: layer setting services, both ends.
//! * [`eds`]: electronic data sheets, device configuration files and what follows from them.
//! * [`drive`]: words, states and modes of CiA 402, for both roles.
//! * [`master`]: the network's master: boot-up, configuration, SYNC and PDOs, supervision.
//! * [`node`]: a device, with a simulated drive behind it.
//! * [`plan`]: whether the bus can carry it all.
//!
//! Everything here is sans-IO: frames and the time go in as arguments, frames and events come out. Nothing opens a socket, reads a
//! clock or logs. CiA 301, 302, 305, 306 and 402 are not public; facts come from implementations and vendor manuals, and each
//! file names what it relies on.
//!
//! All multi-byte values are little endian.

#![forbid(unsafe_code)]

pub mod drive;
pub mod eds;
mod generated;
pub mod lss;
pub mod master;
pub mod node;
pub mod plan;
pub mod sdo;
pub mod wire;
