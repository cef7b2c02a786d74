//! EtherNet/IP, CIP and CIP Motion: wire formats, target and controller roles.
//!
//! The crate holds no socket, no clock and no thread: bytes and time go in by argument, bytes and
//! answers come out. Three parts stand beside each other:
//!
//! - [`wire`]: what the bytes look like, one file per block, shared by both roles;
//! - [`target`]: the device role. [`target::adapter::Adapter`] answers everything explicit
//!   (sessions, objects, connections), and the motion device behind it runs the axes;
//! - the controller role, which opens the connection and moves the axes.
//!
//! Names are the terms of the CIP documents. Multi-byte values are little-endian on the wire unless a
//! layout table says otherwise.

#![forbid(unsafe_code)]

pub mod controller;
pub mod devicenet;
pub mod target;
pub mod wire;
