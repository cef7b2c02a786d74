#![doc = include_str!("../README.md")]
//!
//! # Parts
//!
//! * [`wire`]: what stands in the Ethernet frame and in the service channel, as values.
//! * [`master`]: the master role, from the first CP0 telegram to cyclic operation.
//! * [`checker`]: judges everything on the wire by the rules; carries the tests.
//! * [`slave`]: the slave role, with a simulated drive behind it, and networks of slaves.
//! * [`port`]: the two Ethernet ports of both.
//!
//! Everything here is sans-IO: frames and the time go in as arguments, frames and events come out. Nothing
//! opens a socket, reads a clock or logs.
//!
//! All multi-byte values in a SERCOS data field are little endian. Offsets of telegram parts are counted from
//! the first byte behind the six-byte SERCOS header (frame byte 20) as the parameters S-0-1009, S-0-1011,
//! S-0-1013, S-0-1014 and S-0-1050.x.3 do.

#![forbid(unsafe_code)]

pub mod checker;
mod generated;
pub mod master;
pub mod port;
pub mod slave;
pub mod wire;
