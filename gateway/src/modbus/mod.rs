//! A Modbus TCP server with the state of the box and its axes, which is only read, and with parameters of drives.
//!
//! Input registers and holding registers show the same [`map`]. Whatever would write is answered with
//! *illegal function*, an address outside the map with *illegal data address*, a count of 0 or above 125 with
//! *illegal data value*. Any unit identifier is answered. One request sees one status: its registers belong
//! together. Behind the map are the registers that a configuration binds to [`parameters`].

pub mod map;
mod parameters;
mod server;

pub use parameters::{Binding, Hub, Parameters};
pub use server::{ModbusServer, StatusSource};
