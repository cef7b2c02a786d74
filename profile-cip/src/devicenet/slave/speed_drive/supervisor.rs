//! The state machine of the Control Supervisor object (class 29).
//!
//! | | power | no power | run (edge) | no run | fault | stands still | fault reset |
//! |---|---|---|---|---|---|---|---|
//! | not ready | ready | | | | faulted | | |
//! | ready | | not ready | enabled | | faulted | | |
//! | enabled | | fault stop | | stopping | fault stop | | |
//! | stopping | | fault stop | enabled | | fault stop | ready | |
//! | fault stop | | | | | | faulted | |
//! | faulted | | | | | | | ready |
//!
//! Run is an edge: what stood before the drive was ready, or before a fault was reset, starts nothing. Run forward and run
//! reverse together are no run.

use super::super::super::wire::speed::SupervisorState;

/// What the state machine looks at, in the order in which it counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Inputs {
    /// There is power.
    pub power: bool,
    /// A fault stands, or its cause.
    pub fault: bool,
    /// The axis stands still, or has no torque any more.
    pub standstill: bool,
    /// Run forward or run reverse, from the side that has the control.
    pub run: bool,
    /// Run has come since the last step.
    pub run_edge: bool,
    /// Fault reset has come since the last step, and the cause of the fault is gone.
    pub reset: bool,
}

/// The state behind `state` with these inputs.
#[must_use]
// Flat: the table of the standard, one arm per transition.
pub const fn next(state: SupervisorState, inputs: Inputs) -> SupervisorState {
    use SupervisorState as S;
    match state {
        S::NOT_READY | S::READY if inputs.fault => S::FAULTED,
        S::NOT_READY if inputs.power => S::READY,
        S::READY if !inputs.power => S::NOT_READY,
        S::READY if inputs.run && inputs.run_edge => S::ENABLED,
        S::ENABLED | S::STOPPING if inputs.fault || !inputs.power => S::FAULT_STOP,
        S::ENABLED if !inputs.run => S::STOPPING,
        S::STOPPING if inputs.run && inputs.run_edge => S::ENABLED,
        S::STOPPING if inputs.standstill => S::READY,
        S::FAULT_STOP if inputs.standstill => S::FAULTED,
        S::FAULTED if inputs.reset => S::READY,
        S::STARTUP | S::VENDOR => S::NOT_READY,
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use core::fmt::Write as _;

    use super::*;

    /// Every state with every combination of inputs; equal outcomes in one line.
    #[test]
    fn every_state_and_input() {
        let mut text = String::new();
        for state in 1..=7 {
            let state = SupervisorState(state);
            writeln!(text, "{state}").unwrap();
            for bits in 0..64_u8 {
                let bit = |place: u8| bits >> place & 1 == 1;
                let inputs = Inputs {
                    power: bit(0),
                    fault: bit(1),
                    standstill: bit(2),
                    run: bit(3),
                    run_edge: bit(4),
                    reset: bit(5),
                };
                let to = next(state, inputs);
                if to == state {
                    continue;
                }
                let names = ["power", "fault", "standstill", "run", "edge", "reset"];
                let set: Vec<_> =
                    (0_u8..).zip(names).filter(|(place, _)| bit(*place)).map(|(_, name)| name).collect();
                writeln!(text, "  {} -> {to}", set.join("+")).unwrap();
            }
        }
        insta::assert_snapshot!(text);
    }

    #[test]
    fn only_an_edge_of_run_enables() {
        for state in 0..=8 {
            for bits in 0..32_u8 {
                let bit = |place: u8| bits >> place & 1 == 1;
                let inputs = Inputs {
                    power: bit(0),
                    fault: bit(1),
                    standstill: bit(2),
                    run: bit(3),
                    run_edge: false,
                    reset: bit(4),
                };
                let to = next(SupervisorState(state), inputs);
                assert!(to != SupervisorState::ENABLED || SupervisorState(state) == SupervisorState::ENABLED);
            }
        }
    }
}
