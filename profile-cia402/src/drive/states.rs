//! The state machine of a drive: states as the statusword shows them, transitions as the controlword asks for them.
//!
//! ```text
//! start --0--> not ready to switch on --1--> switch on disabled <------------------------- 15 -- fault
//!                                             2 |    ^ 7  ^ 10  ^ 9    ^ 12                        ^
//!                                               v    |    |     |      |                        14 |
//!                                   ready to switch on    |     |      |          fault reaction active
//!                                    3 |   ^ 6      ^ 8   |     |      |                           ^
//!                                      v   |        |     |     |      |                        13 |
//!                                   switched on ----+-----+     |      |                 from every state
//!                                    4 |   ^ 5      |           |      |
//!                                      v   |        |           |      |
//!                                   operation enabled ----------+      |
//!                                   11 |   ^ 16                        |
//!                                      v   |                           |
//!                                   quick stop active -----------------+
//! ```
//!
//! 0, 1, 13 and 14 the drive makes by itself; 12 too, when the quick stop does not hold the axis.

use core::fmt;

use super::controlword::{Command, Controlword};
use super::statusword::Statusword;

/// A state of the power drive system (6041, bits 0 to 6).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub enum State {
    /// Internal checks go on.
    #[default]
    NotReadyToSwitchOn,
    /// No torque, and none can be asked for yet.
    SwitchOnDisabled,
    /// No torque; parameters may change.
    ReadyToSwitchOn,
    /// The power stage is ready.
    SwitchedOn,
    /// The axis follows its set-points.
    OperationEnabled,
    /// The axis brakes, or stands with torque after it.
    QuickStopActive,
    /// A fault came; the axis brakes.
    FaultReactionActive,
    /// No torque until the fault is reset.
    Fault,
}

impl State {
    /// Every state.
    pub const ALL: [Self; 8] = [
        Self::NotReadyToSwitchOn,
        Self::SwitchOnDisabled,
        Self::ReadyToSwitchOn,
        Self::SwitchedOn,
        Self::OperationEnabled,
        Self::QuickStopActive,
        Self::FaultReactionActive,
        Self::Fault,
    ];

    /// Bits 6, 5 and 3 to 0 of the statusword.
    #[must_use]
    pub const fn bits(self) -> u16 {
        match self {
            Self::NotReadyToSwitchOn => 0x00,
            Self::SwitchOnDisabled => 0x40,
            Self::ReadyToSwitchOn => 0x21,
            Self::SwitchedOn => 0x23,
            Self::OperationEnabled => 0x27,
            Self::QuickStopActive => 0x07,
            Self::FaultReactionActive => 0x0F,
            Self::Fault => 0x08,
        }
    }

    /// The bits of the statusword that tell it; bit 5 reports nothing where operation is not possible.
    #[must_use]
    pub const fn mask(self) -> u16 {
        match self {
            Self::NotReadyToSwitchOn | Self::SwitchOnDisabled | Self::FaultReactionActive | Self::Fault => {
                0x4F
            }
            _ => 0x6F,
        }
    }

    /// The state that a statusword shows; `None` for bits that show none.
    #[must_use]
    pub const fn decode(word: Statusword) -> Option<Self> {
        let mut number = 0;
        while number < Self::ALL.len() {
            let state = Self::ALL[number];
            if word.bits() & state.mask() == state.bits() {
                return Some(state);
            }
            number += 1;
        }
        None
    }

    /// Whether the axis can have torque.
    #[must_use]
    pub const fn has_torque(self) -> bool {
        matches!(self, Self::OperationEnabled | Self::QuickStopActive | Self::FaultReactionActive)
    }

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotReadyToSwitchOn => "not ready to switch on",
            Self::SwitchOnDisabled => "switch on disabled",
            Self::ReadyToSwitchOn => "ready to switch on",
            Self::SwitchedOn => "switched on",
            Self::OperationEnabled => "operation enabled",
            Self::QuickStopActive => "quick stop active",
            Self::FaultReactionActive => "fault reaction active",
            Self::Fault => "fault",
        }
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A transition, by its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Transition(u8);

impl Transition {
    /// Highest number.
    pub const LAST: u8 = 16;

    /// The transition with a number, 0 to 16.
    #[must_use]
    pub const fn new(number: u8) -> Option<Self> {
        if number <= Self::LAST { Some(Self(number)) } else { None }
    }

    /// Its number.
    #[must_use]
    pub const fn number(self) -> u8 {
        self.0
    }

    /// Where it begins; `None` for 0, which begins with the power, and 13, which begins everywhere.
    #[must_use]
    pub const fn from(self) -> Option<State> {
        Some(match self.0 {
            1 => State::NotReadyToSwitchOn,
            2 => State::SwitchOnDisabled,
            3 | 7 => State::ReadyToSwitchOn,
            4 | 6 | 10 => State::SwitchedOn,
            5 | 8 | 9 | 11 => State::OperationEnabled,
            12 | 16 => State::QuickStopActive,
            14 => State::FaultReactionActive,
            15 => State::Fault,
            _ => return None,
        })
    }

    /// Where it ends.
    #[must_use]
    pub const fn to(self) -> State {
        match self.0 {
            0 => State::NotReadyToSwitchOn,
            1 | 7 | 9 | 10 | 12 | 15 => State::SwitchOnDisabled,
            2 | 6 | 8 => State::ReadyToSwitchOn,
            3 | 5 => State::SwitchedOn,
            4 | 16 => State::OperationEnabled,
            11 => State::QuickStopActive,
            13 => State::FaultReactionActive,
            _ => State::Fault,
        }
    }
}

impl fmt::Display for Transition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

/// The transition that a controlword asks for; `None` where it asks for nothing, or for what is not possible.
///
/// `before` is the word before it: a fault is reset by the rising edge of bit 7, and a quick stop that holds the axis
/// (`holds`, option codes 5 to 8) is left by the rising edge of bit 2, so that a word that still stands does not move an
/// axis that has stopped.
///
/// *Enable operation* in *ready to switch on* is transition 3; 4 follows when the same word is asked again.
#[must_use]
// Flat: the table of the standard, one arm per transition.
pub fn transition(state: State, word: Controlword, before: Controlword, holds: bool) -> Option<Transition> {
    use Command as C;
    let rises = |bit| word.contains(bit) && !before.contains(bit);
    if state == State::Fault {
        return rises(Controlword::FAULT_RESET).then_some(Transition(15));
    }
    let number = match (state, Command::decode(word)?) {
        (State::SwitchOnDisabled, C::Shutdown) => 2,
        (State::ReadyToSwitchOn, C::SwitchOn | C::EnableOperation) => 3,
        (State::ReadyToSwitchOn, C::DisableVoltage | C::QuickStop) => 7,
        (State::SwitchedOn, C::EnableOperation) => 4,
        (State::SwitchedOn, C::Shutdown) => 6,
        (State::SwitchedOn, C::DisableVoltage | C::QuickStop) => 10,
        (State::OperationEnabled, C::SwitchOn) => 5,
        (State::OperationEnabled, C::Shutdown) => 8,
        (State::OperationEnabled, C::DisableVoltage) => 9,
        (State::OperationEnabled, C::QuickStop) => 11,
        (State::QuickStopActive, C::DisableVoltage) => 12,
        (State::QuickStopActive, C::EnableOperation) if holds && rises(Controlword::QUICK_STOP) => 16,
        _ => return None,
    };
    Some(Transition(number))
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use super::*;

    /// Statuswords as they were seen: ros2_canopen `state.cpp`, python canopen `p402.py`, ABB FEPL-02 manual.
    const VECTORS: [(u16, Option<State>); 14] = [
        (0x0000, Some(State::NotReadyToSwitchOn)),
        (0x0010, Some(State::NotReadyToSwitchOn)),
        (0x0250, Some(State::SwitchOnDisabled)),
        (0x0270, Some(State::SwitchOnDisabled)),
        (0x0231, Some(State::ReadyToSwitchOn)),
        (0x0233, Some(State::SwitchedOn)),
        (0x0637, Some(State::OperationEnabled)),
        (0x0217, Some(State::QuickStopActive)),
        (0x021F, Some(State::FaultReactionActive)),
        (0x0208, Some(State::Fault)),
        (0x0228, Some(State::Fault)),
        (0x0211, None),
        (0x0241, None),
        (0x0263, None),
    ];

    #[test]
    fn statuswords_show_states() {
        for (word, state) in VECTORS {
            assert_eq!(State::decode(Statusword::from_bits_retain(word)), state, "{word:04x}");
        }
    }

    #[test]
    fn no_word_shows_two_states() {
        for bits in 0..=u16::MAX {
            let shown = State::ALL.iter().filter(|state| bits & state.mask() == state.bits());
            assert!(shown.count() <= 1, "{bits:04x}");
        }
    }

    #[test]
    fn transitions_lead_from_where_they_begin_to_where_they_end() {
        for state in State::ALL {
            for bits in 0..=0xFF {
                for (before, holds) in [(0, false), (0xFF, false), (0, true), (0xFF, true)] {
                    let word = Controlword::from_bits_retain(bits);
                    let before = Controlword::from_bits_retain(before);
                    let Some(taken) = transition(state, word, before, holds) else { continue };
                    assert_eq!(taken.from(), Some(state), "{taken}");
                    assert_ne!(taken.to(), state, "{taken}");
                }
            }
        }
        assert_eq!(Transition::new(17), None);
        let ends: Vec<_> = (0..=Transition::LAST).filter_map(Transition::new).map(Transition::to).collect();
        assert_eq!(ends.len(), 17);
    }

    /// The whole table: each state with each command, and the edges of bits 7 and 2.
    #[test]
    fn every_state_with_every_command() {
        let mut text = String::new();
        for state in State::ALL {
            writeln!(text, "{state}").unwrap();
            let words = Command::ALL.map(|command| (command.name(), 0, command.word().bits()));
            let edges = [
                ("enable after quick stop", 0x02, 0x0F),
                ("enable, bit 2 stood", 0x0F, 0x0F),
                ("fault reset", 0x00, 0x80),
                ("fault reset stands", 0x80, 0x80),
                ("fault reset with enable", 0x0F, 0x8F),
            ];
            for (name, before, word) in words.into_iter().chain(edges) {
                let [before, word] = [before, word].map(Controlword::from_bits_retain);
                let show = |holds| match transition(state, word, before, holds) {
                    Some(taken) => format!("{taken} -> {}", taken.to()),
                    None => "ignored".into(),
                };
                let (leaves, holds) = (show(false), show(true));
                write!(text, "  {name:<24} {leaves}").unwrap();
                writeln!(
                    text,
                    "{}",
                    if holds == leaves { String::new() } else { format!("; holding: {holds}") }
                )
                .unwrap();
            }
        }
        insta::assert_snapshot!(text);
    }
}
