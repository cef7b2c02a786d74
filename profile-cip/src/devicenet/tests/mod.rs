//! Master and slaves together on a bus in virtual time.

mod motion;
mod rig;
