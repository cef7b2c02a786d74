//! The whole chain in virtual time: controller, network, box, bus and drives.

mod faults;
mod loss;
mod network;
mod programs;
mod stopping;
mod torque;
