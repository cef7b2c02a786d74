//! The motion device: its I/O connection, its updates, its services and its axes.

mod clock;
mod cyclic_list;
pub mod device;
mod drive_values;
mod engine;
mod explicit;
mod fixed;
mod indication;
mod instances;
mod io_connection;
pub mod io_counters;
mod node;
pub(crate) mod owner;
mod receive;
mod service;
mod service_channel;
mod slot;
mod statistics;
#[cfg(test)]
mod tests;
mod transmit;
