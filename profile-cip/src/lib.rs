#![doc = include_str!("../README.md")]
//!
//! # Parts
//!
//! Bytes and time go in by argument, bytes and answers come out.
//!
//! - [`wire`]: what the bytes look like, one file per block, shared by both roles;
//! - [`device`]: the device role. [`device::adapter::Adapter`] answers everything explicit
//!   (sessions, objects, connections), and the motion device behind it runs the axes;
//! - [`controller`]: the controller role, which opens the connection and moves the axes;
//! - [`devicenet`]: CIP on a CAN bus, master and slave;
//! - [`assembly`]: assemblies that carry axes for programmable controllers.
//!
//! Names are the terms of the CIP documents. Multi-byte values are little-endian on the wire unless a
//! layout table says otherwise.

#![forbid(unsafe_code)]

pub mod assembly;
pub mod controller;
pub mod device;
pub mod devicenet;
mod generated;
mod reported;
mod time_offset;
pub mod wire;
