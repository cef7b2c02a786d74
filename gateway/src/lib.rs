//! The Axisbridge gateway.

pub mod capture;
pub mod sys;
