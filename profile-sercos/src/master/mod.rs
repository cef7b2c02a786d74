//! The master role.

pub mod config;
pub mod connection;
pub mod layout;
pub mod svc;
