//! The master role.

pub mod svc;
