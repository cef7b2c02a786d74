//! Master and slaves together on a bus in virtual time.

mod bench;
mod master;
mod motion;
mod rig;
mod slave;
mod speed;
