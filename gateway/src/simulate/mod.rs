//! The other sides of the protocols as runnable peers: what `demo` and `simulate` start.
//!
//! The protocol engines live in the profile crates; here they get sockets, a clock and a program.

pub mod can_actor;
pub mod can_bus;
pub mod can_drive;
pub mod can_process;
pub mod can_twin;
pub mod clock;
pub mod controller;
pub mod controller_time;
pub mod devicenet_drive;
pub mod drive_events;
pub mod drives;
pub mod grandmaster;
pub mod plc;
pub mod program;
pub mod script;
pub mod sercos_twin;
pub mod setup;
