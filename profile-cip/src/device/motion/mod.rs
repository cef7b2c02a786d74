//! The motion device: its I/O connection, its updates, its services and its axes.

mod cyclic_list;
pub mod device;
mod explicit_queue;
mod fixed;
mod indication;
mod io_connection;
pub mod io_counters;
mod node;
mod owner;
mod receive;
mod reset;
mod service;
mod service_channel;
#[cfg(test)]
mod tests;
mod time_offset;
mod transmit;
