//! The CIP objects of the device beside the axes.

pub mod ac_dc_drive;
pub mod assembly;
pub mod class;
pub(super) mod connection_manager;
pub mod ethernet_link;
pub mod file;
pub mod identity;
pub mod list;
pub(crate) mod object;
pub mod qos;
pub mod router;
pub mod tcp_ip;
pub mod time_sync;
