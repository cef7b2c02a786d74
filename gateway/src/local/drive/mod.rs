//! Parameters of drives by the number that they have there, for clients of the socket: what a line names, what bytes mean, what is
//! known of a drive, and the accesses that a request takes one after the other.

pub mod id;
pub mod job;
pub mod known;
pub mod value;
