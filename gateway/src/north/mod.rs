//! The north side's explicit messaging: EtherNet/IP sessions over TCP and the List commands over UDP.
//!
//! The protocol is `profile_cip::target::adapter`, which knows no socket. Here are the sockets around it and
//! the way to the motion device, which runs in the cycle thread:
//!
//! ```text
//! TCP streams --reader--> |          | --MotionRequest--> queue --> DeviceEnd (cycle thread)
//!             <--writer-- |  server  | <--MotionReply---- queue <--
//! UDP datagrams --------> |  (task)  | --> recording, log, statistics
//! ```
//!
//! One task owns the adapter. Each stream has a task of its own that holds at most one buffer of input and
//! one of output, so that a peer that stalls holds up nobody else.

mod connection;
mod error;
mod link;
mod server;
mod sockets;
mod statistics;

#[cfg(test)]
mod tests;
#[cfg(test)]
pub(crate) use tests::test_adapter_config;

use std::net::SocketAddrV4;

use tokio::sync::watch;
use tokio::task::JoinHandle;

pub use error::ServeError;
pub use link::{AdapterEnd, DeviceEnd, QUEUE_LEN, motion_link};
pub use server::{ExplicitServer, STALL_LIMIT};
pub use statistics::Statistics;

/// A server that runs as a task. It ends when this is dropped.
#[derive(Debug)]
pub struct Handle {
    address: SocketAddrV4,
    statistics: watch::Receiver<Statistics>,
    stop: watch::Sender<bool>,
    task: JoinHandle<Statistics>,
}

impl Handle {
    /// Where it listens, TCP and UDP.
    #[must_use]
    pub const fn address(&self) -> SocketAddrV4 {
        self.address
    }

    /// What it has counted, at most a second old.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        self.statistics.borrow().clone()
    }

    /// Ends the server and all its streams, and returns what it has counted.
    pub async fn stop(self) -> Statistics {
        self.stop.send_replace(true);
        match self.task.await {
            Ok(statistics) => statistics,
            Err(_) => self.statistics.borrow().clone(),
        }
    }
}

/// Runs the server as a task of the current runtime.
#[must_use]
pub fn spawn(server: ExplicitServer) -> Handle {
    let address = server.local_address();
    let statistics = server.statistics();
    let (stop, stopped) = watch::channel(false);
    let task = tokio::spawn(server.run(stopped));
    Handle { address, statistics, stop, task }
}
