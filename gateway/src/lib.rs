//! The Axisbridge gateway.

pub mod capture;
pub mod config;
pub mod decode;
pub mod latest;
pub mod mapping;
pub mod modbus;
pub mod north;
pub mod status;
pub mod sys;
