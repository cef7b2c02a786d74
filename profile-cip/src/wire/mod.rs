//! The bytes of EtherNet/IP, CIP and CIP Motion: one file per block.
//!
//! Each file has a plain value with `parse`, `buffer_len` and `emit`. `parse(emit(x)) == x` for every value,
//! and parsing never panics and never allocates, whatever the bytes are.

pub mod attributes;
pub mod class1;
pub mod cpf;
pub mod encapsulation;
pub mod epath;
pub mod forward_close;
pub mod forward_open;
pub mod list_identity;
pub mod list_services;
pub mod message_router;
pub mod motion;
pub mod multiple_service;
pub mod network_parameters;
pub mod register_session;
pub mod sockaddr;
pub mod status;
pub mod triad;
pub mod unconnected_send;

pub use profile_generic::wire::{Error, Reader, Writer};
pub use triad::ConnectionTriad;
