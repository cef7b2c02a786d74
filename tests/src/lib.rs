//! Shared helpers of the whole-system tests.
//!
//! The tests themselves stand in `tests/`, one file a subject. What needs a foreign peer (tshark, root
//! for network namespaces) goes through [`peer`]: on a user's machine a missing peer is a visible skip,
//! in CI (`CI=true`) it is a failure.

pub mod can_frames;
pub mod can_kernel;
pub mod can_led;
pub mod example;
pub mod expected;
pub mod fuzz;
pub mod host;
pub mod mapping;
pub mod modbus;
pub mod namespace;
pub mod peer;
pub mod process;
pub mod rig;
pub mod slcan;
pub mod tables;
pub mod tshark;
