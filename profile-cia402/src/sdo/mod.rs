//! Service data objects: both ends of a channel (CiA 301).
//!
//! A channel carries one transfer at a time. [`server`] stands in the device and serves its object dictionary, which
//! implements [`server::ObjectAccess`]; [`client`] asks. Neither knows identifiers: they take and give the eight bytes of a frame.

pub mod client;
pub mod request;
pub mod server;
#[cfg(test)]
mod tests;
