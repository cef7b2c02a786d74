//! The Axisbridge gateway.

pub mod sys;
