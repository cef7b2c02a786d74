//! The Axisbridge gateway.

pub mod capture;
pub mod config;
pub mod sys;
