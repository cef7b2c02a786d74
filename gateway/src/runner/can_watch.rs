//! What the controllers of CAN interfaces say of their bus: told when it changes, and answered by a restart where the box has
//! set the interface up and its driver does not come back by itself.
//!
//! Netlink waits and allocates: this runs beside the cycle.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tracing::{info, warn};

use super::port::BackOnBus;
use crate::sys::can_error::BusState;
use crate::sys::can_interface::{self, State};
use crate::sys::link::LinkState;

/// How often the controllers are asked.
const INTERVAL: Duration = Duration::from_millis(100);

/// The watch over one interface.
#[derive(Debug)]
pub struct CanWatch {
    name: String,
    restarts: bool,
    back: Arc<BackOnBus>,
    told: Option<BusState>,
    /// A restart that failed is reported once, until one succeeds.
    refusal_told: bool,
}

impl CanWatch {
    /// Over the interface `name`; one that is off the bus is restarted if `restarts`, which needs `CAP_NET_ADMIN`.
    #[must_use]
    pub const fn new(name: String, restarts: bool, back: Arc<BackOnBus>) -> Self {
        Self { name, restarts, back, told: None, refusal_told: false }
    }

    fn look(&mut self) {
        let question = self.back.question();
        // An interface that has gone is told by the bus.
        let Ok(state) = can_interface::state(&self.name) else { return };
        self.tell(&state);
        let is_off = state.state == Some(BusState::Off);
        if !is_off && !matches!(state.link, LinkState::Down | LinkState::Gone) {
            self.back.answer(question);
        }
        if is_off && self.restarts && !state.restarts() {
            self.restart();
        }
    }

    /// An interface that says nothing, or is down, has nothing to be told of.
    fn tell(&mut self, state: &State) {
        let Some(now) = state.state else { return };
        if self.told.replace(now).unwrap_or(BusState::Active) == now {
            return;
        }
        let interface = self.name.as_str();
        let (transmit, receive) = state.errors.unwrap_or_default();
        match now {
            BusState::Active => info!(interface, "CAN controller: {now}"),
            _ => warn!(interface, transmit, receive, "CAN controller: {now}"),
        }
    }

    fn restart(&mut self) {
        let interface = self.name.as_str();
        match can_interface::restart(interface) {
            Ok(()) => {
                info!(interface, "the CAN controller is restarted");
                self.refusal_told = false;
            }
            Err(error) => {
                if !std::mem::replace(&mut self.refusal_told, true) {
                    warn!(interface, %error, "the CAN controller stays off the bus");
                }
            }
        }
    }
}

/// Watches until the box has ended.
pub async fn watch(mut interfaces: Vec<CanWatch>, stop: Arc<AtomicBool>) {
    let mut interval = tokio::time::interval(INTERVAL);
    while !stop.load(Ordering::Relaxed) && !interfaces.is_empty() {
        interval.tick().await;
        interfaces.iter_mut().for_each(CanWatch::look);
    }
}
