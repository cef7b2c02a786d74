//! The operating system: sockets, clocks, scheduling.
//!
//! The files in this module are the only ones of the project that contain `unsafe`: each allows it for itself
//! and gives the reason at each block. Nothing here knows a protocol; nothing here allocates, locks or logs
//! once a socket is open, so the cycle thread may call any `send`, `recv`, clock or sleep.
//!
//! Linux only: packet sockets, kernel time stamps and absolute sleeps are taken as Linux has them.

pub mod can_error;
pub mod can_interface;
mod can_netlink;
pub mod can_socket;
pub mod card_stamps;
pub mod clock;
pub mod ethtool;
pub mod gate;
pub mod interface_lock;
pub mod interfaces;
pub mod launch;
pub mod link;
pub mod memory;
pub mod namespace;
pub mod packet_socket;
pub mod phc;
pub mod ptp_socket;
pub mod realtime;
pub mod thread;
pub mod udp;

mod option;
mod receive;
