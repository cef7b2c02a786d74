//! The device's end of network management: its state, and which services there are in which state.
//!
//! ```text
//! power-on, reset node, reset communication
//!      |
//! initialising --boot-up message--> pre-operational <--128-- operational
//!                                        |   ^  \--1---------->  ^ |
//!                                      2 |   | 128             1 | | 2
//!                                        v   |                   | v
//!                                      stopped <-----------------+-+
//! ```
//!
//! | service | initialising | pre-operational | operational | stopped |
//! |---|---|---|---|---|
//! | NMT, heartbeat | | yes | yes | yes |
//! | SDO, SYNC, TIME, EMCY | | yes | yes | |
//! | PDO | | | yes | |

use crate::wire::nmt::{NmtCommand, NmtState};

/// What a command makes the device do besides changing its state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Effect {
    /// Nothing.
    None,
    /// PDOs begin.
    Start,
    /// PDOs end.
    Leave,
    /// All starts anew.
    ResetNode,
    /// The communication starts anew.
    ResetCommunication,
}

/// The state and the effect of a command; `NmtState::BOOT_UP` is *initialising*, in which no command counts.
#[must_use]
pub fn obey(state: NmtState, command: NmtCommand) -> (NmtState, Effect) {
    if state == NmtState::BOOT_UP {
        return (state, Effect::None);
    }
    let next = match command {
        NmtCommand::START => NmtState::OPERATIONAL,
        NmtCommand::STOP => NmtState::STOPPED,
        NmtCommand::ENTER_PRE_OPERATIONAL => NmtState::PRE_OPERATIONAL,
        NmtCommand::RESET_NODE => return (NmtState::BOOT_UP, Effect::ResetNode),
        NmtCommand::RESET_COMMUNICATION => return (NmtState::BOOT_UP, Effect::ResetCommunication),
        _ => return (state, Effect::None),
    };
    let effect = match (state.has_pdo(), next.has_pdo()) {
        (false, true) => Effect::Start,
        (true, false) => Effect::Leave,
        _ => Effect::None,
    };
    (next, effect)
}

/// The state after a communication error, by 1029h:1: 0 leaves *operational* for *pre-operational*, 1 changes nothing, 2
/// stops.
#[must_use]
pub fn fail(state: NmtState, behaviour: i64) -> (NmtState, Effect) {
    match behaviour {
        0 if state == NmtState::OPERATIONAL => obey(state, NmtCommand::ENTER_PRE_OPERATIONAL),
        2 => obey(state, NmtCommand::STOP),
        _ => (state, Effect::None),
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use super::*;

    #[test]
    fn every_state_with_every_command() {
        let states = [NmtState::BOOT_UP, NmtState::PRE_OPERATIONAL, NmtState::OPERATIONAL, NmtState::STOPPED];
        let mut text = String::new();
        for state in states {
            writeln!(text, "{state}: SDO {}, PDO {}", state.has_sdo(), state.has_pdo()).unwrap();
            let commands =
                NmtCommand::NAMED.iter().map(|(command, _)| *command).chain([NmtCommand(0), NmtCommand(3)]);
            for command in commands {
                let (next, effect) = obey(state, command);
                writeln!(text, "  {:<24} {next}, {effect:?}", command.to_string()).unwrap();
            }
            for behaviour in 0..4 {
                let (next, effect) = fail(state, behaviour);
                writeln!(text, "  communication error, {behaviour}   {next}, {effect:?}").unwrap();
            }
        }
        insta::assert_snapshot!(text);
    }
}
