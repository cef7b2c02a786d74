//! Odd drives: what a master meets in the field, written from the standards' facts alone.
//!
//! This crate depends on nothing. No line of the product is in it, so an error of the product is not repeated here, and the
//! two can disagree. Each drive is a plain state machine: frames go in with the time, frames come out, nothing sleeps, and the
//! same input gives the same output. Whoever runs one owns the wire and the clock.

pub mod can;
pub mod can_drive;
pub mod devicenet_slave;
pub mod sercos_slave;
