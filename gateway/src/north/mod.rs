//! The north side's explicit messaging: EtherNet/IP sessions over TCP and the List commands over UDP.
//!
//! The protocol is `profile_cip::device::adapter`, which knows no socket. Here are the sockets around it and
//! the way to the motion device, which runs in the cycle thread:
//!
//! ```text
//! TCP streams    <--> |         | --MotionRequest--> queue --> DeviceEnd (cycle thread)
//! UDP datagrams  <--> | adapter | <--MotionReply---- queue <--
//!                     |         | --> recording, log, statistics
//! ```
//!
//! One thread a device owns all of that and answers a request in the turn in which it comes. A stream has at
//! most one buffer of input and one of output, so that a peer that stalls holds up nobody else.

mod core;
mod error;
mod link;
mod server;
mod sockets;
mod statistics;
mod stream;

#[cfg(test)]
mod tests;
#[cfg(test)]
pub(crate) use tests::test_adapter_config;

use std::net::SocketAddrV4;
use std::thread::JoinHandle;

use tokio::sync::{oneshot, watch};

use crate::sys::thread::{self, SMALL_STACK};
pub use error::ServeError;
pub use link::{AdapterEnd, DeviceEnd, QUEUE_LEN, motion_link};
pub use server::{ExplicitServer, STALL_LIMIT};
pub use statistics::Statistics;

/// A server that runs in a thread of its own. It ends when this is dropped.
#[derive(Debug)]
pub struct Handle {
    address: SocketAddrV4,
    statistics: watch::Receiver<Statistics>,
    stop: watch::Sender<bool>,
    ended: oneshot::Receiver<()>,
    /// `None` once it is joined.
    thread: Option<JoinHandle<()>>,
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
    pub async fn stop(mut self) -> Statistics {
        self.stop.send_replace(true);
        // The sender is gone when the server is, however it ended; what is left of the thread takes no time.
        let _ = (&mut self.ended).await;
        self.statistics.borrow().clone()
    }
}

/// Its ports are free afterwards: a start that has failed elsewhere is followed by another one.
impl Drop for Handle {
    fn drop(&mut self) {
        self.stop.send_replace(true);
        if let Some(thread) = self.thread.take() {
            // A panic has been printed where it happened.
            let _ = thread.join();
        }
    }
}

/// Runs the server in a thread of its own.
///
/// # Errors
/// The system starts no thread, or no runtime in it.
pub fn spawn(server: ExplicitServer) -> Result<Handle, ServeError> {
    let address = server.local_address();
    let statistics = server.statistics();
    let (stop, stopped) = watch::channel(false);
    let (end, ended) = oneshot::channel::<()>();
    let system = |source| ServeError::Thread { address, source };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(system)?;
    let inside = runtime.enter();
    let running = server.start()?;
    drop(inside);
    let thread = thread::named("axisbridge-north", SMALL_STACK).spawn(move || {
        runtime.block_on(running.run(stopped));
        drop((runtime, end));
    });
    Ok(Handle { address, statistics, stop, ended, thread: Some(thread.map_err(system)?) })
}
