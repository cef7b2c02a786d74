//! Layer setting services (CiA 305): node-id and bit rate of devices that have none yet, or another one.
//!
//! [`slave`] stands in the device, [`master`] finds devices and sets them. Both take and give the eight bytes of a frame.

pub mod master;
pub mod slave;
#[cfg(test)]
mod tests;
