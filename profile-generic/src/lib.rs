//! The generic power drive system interface of IEC 61800-7-1.

pub mod capture;
pub mod cast;
pub mod code;
pub mod fault;
pub mod functional_element;
pub mod image;
pub mod inhibit;
pub mod interpolation;
pub mod mode;
pub mod parameter;
pub mod program;
pub mod quantity;
pub mod ratio;
pub mod scaling;
pub mod servo;
pub mod state;
pub mod time;
