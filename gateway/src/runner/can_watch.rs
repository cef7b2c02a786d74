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
    /// The number of the interface that the port is open on.
    index: i32,
    restarts: bool,
    back: Arc<BackOnBus>,
    told: Option<BusState>,
    /// The interface was replaced, which is reported once.
    replaced: bool,
    /// A restart that failed is reported once, until one succeeds.
    refusal_told: bool,
}

impl CanWatch {
    /// Over the interface with this name and number; one that is off the bus is restarted if `restarts`, which needs `CAP_NET_ADMIN`.
    #[must_use]
    pub const fn new(name: String, index: i32, restarts: bool, back: Arc<BackOnBus>) -> Self {
        Self { name, index, restarts, back, told: None, replaced: false, refusal_told: false }
    }

    fn look(&mut self) {
        let question = self.back.question();
        // An interface that has gone is told by the bus.
        let Ok(state) = can_interface::state(&self.name) else { return };
        self.take(question, &state);
    }

    fn take(&mut self, question: u32, state: &State) {
        if state.index != self.index {
            // The port is open on the one before for good, and the bus stays off.
            if !std::mem::replace(&mut self.replaced, true) {
                let interface = self.name.as_str();
                warn!(
                    interface,
                    "the CAN interface was replaced by another one: restart the gateway to use it"
                );
            }
            return;
        }
        self.tell(state);
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

#[cfg(test)]
mod tests {
    use super::*;

    const STATE: State = State {
        index: 7,
        link: LinkState::Up,
        has_bit_rate: false,
        nominal: None,
        sample_point: None,
        data: None,
        fd: false,
        state: None,
        restart_ms: None,
        errors: None,
        queue: 128,
    };

    #[test]
    fn interface_that_was_replaced_brings_no_bus_back() {
        let back = Arc::new(BackOnBus::default());
        let mut watch = CanWatch::new("can0".to_owned(), 7, false, Arc::clone(&back));
        back.ask();
        watch.take(back.question(), &State { link: LinkState::Down, ..STATE });
        assert!(!back.is_answered(), "it is down");
        watch.take(back.question(), &State { index: 8, ..STATE });
        assert_eq!((back.is_answered(), watch.replaced), (false, true));
        watch.take(back.question(), &STATE);
        assert!(back.is_answered(), "the one that the port is open on is up again");
    }
}
