//! DeviceNet: CIP on CAN (IEC 61158 type 2 on CAN, IEC 62026-3), and CIP Motion over it (IEC 61800-7-302, clause 5).
//!
//! - [`wire`]: identifiers and messages;
//! - [`fragmentation`], [`access`], [`connection`]: the protocols that master and slave share;
//! - [`slave`]: a group 2 only server of the predefined master/slave connection set, with what stands behind it: a CIP Motion
//!   drive or a velocity drive of the AC/DC drive profile, both simulated;
//! - [`master`]: a scanner of up to 63 slaves.
//!
//! Frames go in by `handle_frame(now, frame)` and come out by `poll(now)` until there is none; `wake_at()` says when to call
//! again. The transport must not hand a node its own frames.
//!
//! The unconnected message manager (UCMM), multicast poll, and the offline connection set are known by their identifiers
//! and otherwise not there.

pub mod access;
pub mod connection;
pub mod fragmentation;
pub mod link;
pub mod master;
pub mod slave;
pub mod wire;

#[cfg(test)]
mod tests;
