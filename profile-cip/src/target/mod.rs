//! The device role: the explicit side ([`adapter`]) and the motion device behind it.

pub mod adapter;
#[cfg(test)]
mod adapter_tests;
pub mod attribute;
pub mod attribute_worker;
mod axis_control;
pub mod axis_object;
pub mod axis_state;
pub mod config;
mod connection_data;
pub mod connection_manager;
mod connection_path;
pub mod counters;
mod cyclic_list;
pub mod drive_link;
pub mod ethernet_link;
pub mod event;
pub mod event_channel;
pub mod exception;
mod exchange;
pub mod fault_log;
pub mod file_object;
mod forward_close;
mod forward_open;
pub mod identity;
mod list;
mod list_job;
pub mod motion_link;
mod motion_open;
mod node;
mod object;
pub mod qos;
mod refusal;
mod reset;
mod router;
mod session;
mod status_report;
pub mod tcp_ip;
mod time_offset;
pub use axis_object::AxisConfig;
mod axis_report;
mod axis_status;
mod explicit_queue;
mod io_connection;
pub mod io_counters;
mod motion_class;
pub mod motion_device;
mod motion_receive;
mod motion_reset;
mod motion_service;
mod motion_transmit;
mod service_channel;

#[cfg(test)]
mod motion_tests;
