//! The controller role of CIP Motion.

pub mod trajectory;
