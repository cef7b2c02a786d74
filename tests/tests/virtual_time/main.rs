//! The whole chain in virtual time: controller, network, box, bus and drives.

mod attributes;
mod can;
mod can_captures;
mod can_faults;
mod can_modes;
mod devicenet;
mod drive_profile;
mod events;
mod faults;
mod fixed;
mod hookup;
mod hot_plug;
mod indicators;
mod loss;
mod modes;
mod network;
mod owner;
mod planes;
mod programs;
mod scaling;
mod scripts;
mod stalled;
mod stopping;
mod torque;
mod trims;
