//! The simulated drive as its master sees it.

mod homing;
mod modes;
mod states;
