//! A PTP grandmaster on the sockets of the host, with a clock that is set by a plan. It sets no clock of the host.

use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use super::clock::ControllerClock;
use crate::sys::ptp_socket::{Dscp, OpenError, PtpSockets};
use crate::time::ptp::master::{MasterConfig, MasterState, lead};
use crate::time::ptp::wire::{Control, HostWire};

/// Why there is no grandmaster.
#[derive(Debug, thiserror::Error)]
pub enum GrandmasterError {
    /// Its sockets are not to be had.
    #[error("no grandmaster on {interface}: {source}")]
    Open {
        /// Its interface.
        interface: String,
        /// Why.
        source: OpenError,
    },
    /// The system gives no thread.
    #[error("cannot start the thread of the grandmaster: {0}")]
    Thread(io::Error),
    /// It has ended by itself.
    #[error("the grandmaster has ended: {0}")]
    Ended(String),
}

/// What is known of it.
#[derive(Debug, Clone, Default)]
struct Shared {
    state: MasterState,
    /// Why it has ended.
    failure: Option<String>,
}

/// A clock at work on a thread of its own; it ends when dropped.
#[derive(Debug)]
pub struct Grandmaster {
    identity: [u8; 8],
    shared: Arc<Mutex<Shared>>,
    control: Arc<Control>,
    thread: Option<JoinHandle<()>>,
}

impl Grandmaster {
    /// Starts it on an interface.
    ///
    /// # Errors
    /// No sockets, or no thread.
    pub fn start(
        interface: &str,
        config: MasterConfig,
        clock: ControllerClock,
    ) -> Result<Self, GrandmasterError> {
        let sockets = PtpSockets::open(interface, Dscp::default(), false)
            .map_err(|source| GrandmasterError::Open { interface: interface.to_owned(), source })?;
        let control = Arc::new(Control::default());
        control.domain.store(config.domain, Ordering::Relaxed);
        let shared = Arc::new(Mutex::new(Shared::default()));
        let mut wire = HostWire::new(sockets, config.domain, Arc::clone(&control));
        let place = Arc::clone(&shared);
        let run = move || {
            let write = |change: &dyn Fn(&mut Shared)| {
                change(&mut place.lock().unwrap_or_else(PoisonError::into_inner));
            };
            let led = catch_unwind(AssertUnwindSafe(|| {
                lead(&config, &mut wire, &|at| clock.system_at(at), &mut |state| {
                    write(&|shared| shared.state = state);
                })
            }));
            let failure = match led {
                Ok(Ok(())) => return,
                Ok(Err(failure)) => failure.to_string(),
                Err(_) => "an error in the PTP library".to_owned(),
            };
            write(&|shared| shared.failure = Some(failure.clone()));
        };
        let thread = std::thread::Builder::new()
            .name("axisbridge-master".to_owned())
            .spawn(run)
            .map_err(GrandmasterError::Thread)?;
        Ok(Self { identity: config.identity, shared, control, thread: Some(thread) })
    }

    /// Identity of its clock.
    #[must_use]
    pub const fn identity(&self) -> [u8; 8] {
        self.identity
    }

    /// What it is among other clocks.
    ///
    /// # Errors
    /// It has ended by itself.
    pub fn state(&self) -> Result<MasterState, GrandmasterError> {
        let shared = self.shared.lock().unwrap_or_else(PoisonError::into_inner);
        match &shared.failure {
            Some(failure) => Err(GrandmasterError::Ended(failure.clone())),
            None => Ok(shared.state),
        }
    }
}

impl Drop for Grandmaster {
    fn drop(&mut self) {
        self.control.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A panic has been printed where it happened.
            let _ = thread.join();
        }
    }
}
