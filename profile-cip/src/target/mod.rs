//! The device role: the explicit side ([`adapter`]) and the motion device behind it.

pub mod motion_link;
pub mod axis_state;
