//! Whether the gateway is alive, and whether it is ready.

use schemars::JsonSchema;
use serde::Serialize;

use crate::local::overview::Overview;

/// The health of a gateway.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Health {
    /// The cycle thread publishes its state in time.
    pub alive: bool,
    /// Why it is not alive.
    pub reason: Option<String>,
    /// It is alive, every bus is in cyclic operation, and every axis is commissioned and without fault.
    pub ready: bool,
    /// What is missing for `ready`, by name.
    pub missing: Vec<String>,
}

impl Health {
    /// Judges a gateway.
    pub(super) fn of(overview: &Overview) -> Self {
        let (reason, missing) = (overview.silent.clone(), overview.missing());
        Self { alive: reason.is_none(), reason, ready: missing.is_empty(), missing }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use profile_generic::inhibit::Inhibits;
    use profile_generic::state::DriveState;

    use super::super::view::tests::installation;
    use super::*;
    use crate::status::pulse::silence;
    use crate::status::tests::distinct;
    use crate::status::{BoxState, BoxStatus};
    use crate::time::status::tests::synchronized;

    fn health(status: &BoxStatus, age: u64) -> Health {
        let silent = silence(status, Duration::from_millis(age));
        Health::of(&Overview { silent, ..Overview::of(&installation(), status, &synchronized()) })
    }

    /// The status of a gateway with nothing wrong.
    fn good() -> BoxStatus {
        let mut status = distinct();
        status.buses[1].up = true;
        status.axes[1] = status.axes[0];
        status
    }

    #[test]
    fn gateway_without_fault_is_ready() {
        let health = health(&good(), 10);
        assert_eq!(health, Health { alive: true, reason: None, ready: true, missing: Vec::new() });
    }

    #[test]
    fn what_is_missing_is_named() {
        let mut status = distinct();
        status.axes[0].inhibits = Inhibits::NO_DRIVE;
        let found = health(&status, 10);
        assert!(found.alive && !found.ready);
        let missing = [
            "bus CAN bus 1: not in cyclic operation",
            "axis turntable: its drive drive-a is not commissioned",
            "axis slide: fault safety_core",
        ];
        assert_eq!(found.missing, missing);
        status.axes[0].inhibits = Inhibits::NO_POWER;
        assert_eq!(health(&status, 10).missing.len(), 2, "main power is no commissioning");
        status.axes[0].state = DriveState::NotReady;
        assert_eq!(health(&status, 10).missing.len(), 3);
        let stopping = BoxStatus { state: BoxState::STOPPING, ..good() };
        assert_eq!(health(&stopping, 10).missing, ["the gateway stops"]);
    }

    #[test]
    fn cycle_thread_that_publishes_nothing_is_not_alive() {
        assert!(health(&good(), 1_000).alive);
        let dead = health(&good(), 1_001);
        assert_eq!(dead.reason.as_deref(), Some("the cycle thread has published nothing for 1 s"));
        assert_eq!((dead.ready, dead.missing.len()), (false, 1));
        let slow = BoxStatus { cycle_time_ns: 1_000_000_000, ..good() };
        assert!(health(&slow, 4_000).alive && !health(&slow, 4_001).alive);
        let starting = health(&BoxStatus::STARTING, 0);
        assert_eq!(starting.reason.as_deref(), Some("the cycle thread has not started yet"));
    }
}
