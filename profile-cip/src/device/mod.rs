//! The device role: what a motion controller sees on EtherNet/IP.
//!
//! | folder | subject |
//! |---|---|
//! | [`explicit`] | encapsulation sessions over TCP and UDP, and the requests that come over them |
//! | `connection` | which connections there are, and what a Forward_Open must be like |
//! | [`objects`] | the CIP objects beside the axes: Identity, Connection Manager, TCP/IP, Ethernet Link, QoS, File, Time Sync |
//! | [`motion`] | the motion device: I/O connection, updates, services, up to 16 axes |
//! | [`axis`] | one axis: states, handshake, faults, events, what its drive is told |
//! | [`attribute`] | attributes of the Motion Device Axis Object: definitions, tables, values, list services |
//! | [`visualization`] | LEDs and display |
//!
//! The explicit side and the motion device run on different threads; [`motion_link`] has what passes between them.
//! [`config`] with its [`hosts`], [`event`] and [`counters`] are what the application gives to the explicit side and gets from it.

pub mod attribute;
pub mod axis;
pub mod config;
mod connection;
pub mod counters;
pub mod event;
pub mod explicit;
pub mod hosts;
pub mod motion;
pub mod motion_link;
pub mod objects;
mod port;
mod session_slot;
pub mod visualization;

pub use attribute::worker as attribute_worker;
pub use axis::{
    self as axis_object, AxisConfig, drive_link, event_channel, exception, fault_log, state as axis_state,
};
pub use connection::{manager as connection_manager, motion as motion_open};
pub use explicit::adapter;
pub use motion::{device as motion_device, io_counters};
pub use objects::{
    ethernet_link, file as file_object, identity, list as object_list, qos, router, tcp_ip, time_sync,
};
