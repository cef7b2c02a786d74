//! Parameters of drives for clients of the socket: the accesses that a request takes one after the other.

pub mod job;
