//! Master and slaves together on a bus in virtual time.

mod abuse;
mod bench;
mod io;
mod master;
mod motion;
mod rig;
mod slave;
mod speed;
