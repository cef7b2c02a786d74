//! Service data objects: both ends of a channel (CiA 301).
//!
//! A channel carries one transfer at a time. [`server`] stands in the device and serves its object dictionary, which
//! implements [`server::ObjectAccess`].

pub mod server;
