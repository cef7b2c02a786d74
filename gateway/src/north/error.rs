//! Why the server cannot listen.

use std::io;
use std::net::SocketAddrV4;

use thiserror::Error;

/// What kept a socket from being opened; one kind for each thing a person can put right.
#[derive(Debug, Error)]
pub enum ServeError {
    /// No interface of this host has the address.
    #[error("cannot listen at {address}: no interface has the address {}", address.ip())]
    NoSuchAddress {
        /// The address asked for.
        address: SocketAddrV4,
    },
    /// Another program has the port.
    #[error("cannot listen at {address}: {transport} port {} is in use by another program", address.port())]
    InUse {
        /// The address asked for.
        address: SocketAddrV4,
        /// TCP or UDP.
        transport: &'static str,
    },
    /// The system refused for another reason.
    #[error("cannot listen at {address} ({transport}): {step}: {source}")]
    System {
        /// The address asked for.
        address: SocketAddrV4,
        /// TCP or UDP.
        transport: &'static str,
        /// What was being done.
        step: &'static str,
        /// The system's error.
        source: io::Error,
    },
    /// The system starts no thread for the server, or no runtime in it.
    #[error("cannot serve {address}: cannot start its thread: {source}")]
    Thread {
        /// The address asked for.
        address: SocketAddrV4,
        /// The system's error.
        source: io::Error,
    },
}
