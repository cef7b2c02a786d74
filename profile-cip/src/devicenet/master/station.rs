//! One slave as the master sees it: how it is taken, set up, exchanged with, lost and taken again.
//!
//! | | done | already allocated | another master | refused, no answer, wrong device, lost |
//! |---|---|---|---|---|
//! | waiting (time is over) | allocate | | | |
//! | allocate | identify | release | waiting | waiting |
//! | release, then allocate anew | allocate again | allocate again | waiting | allocate again (refused), waiting (no answer) |
//! | allocate again | identify | waiting | waiting | waiting |
//! | identify | paths | | | waiting |
//! | paths | sizes | | | waiting |
//! | sizes | rates | | | waiting |
//! | rates | exchange | | | waiting |
//! | exchange | | | | waiting |
//!
//! A slave that is taken already when the master begins is one that has outlived the master, or one that the master has lost
//! and that has not noticed: it is given back and taken anew, so that nothing of before counts.

use core::fmt;

/// Where a slave is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Phase {
    /// Not asked for now.
    Waiting,
    /// Being allocated.
    Allocate,
    /// Being given back, because it is allocated already.
    Release,
    /// Being allocated after that.
    AllocateAgain,
    /// Being asked who it is.
    Identify,
    /// Being asked which assemblies its connections carry, and given the right ones.
    Paths,
    /// Being asked how long its messages are.
    Sizes,
    /// Being given its expected packet rates, which establishes the connections.
    Rates,
    /// Exchanging I/O messages.
    Exchange,
}

/// How a phase ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PhaseEvent {
    /// Everything was done; in Waiting, the time is over.
    Done,
    /// The slave says that it is in that state already.
    Already,
    /// Another master has it.
    Conflict,
    /// The slave refuses, or is not what it should be.
    Refused,
    /// No answer.
    NoAnswer,
    /// It was lost, or has started anew.
    Lost,
}

impl Phase {
    /// Every phase.
    pub const ALL: [Self; 9] = [
        Self::Waiting,
        Self::Allocate,
        Self::Release,
        Self::AllocateAgain,
        Self::Identify,
        Self::Paths,
        Self::Sizes,
        Self::Rates,
        Self::Exchange,
    ];

    /// The phase behind this one.
    #[must_use]
    pub const fn next(self, event: PhaseEvent) -> Self {
        use PhaseEvent as E;
        match (self, event) {
            (Self::Waiting, E::Done) => Self::Allocate,
            (Self::Allocate | Self::AllocateAgain, E::Done) => Self::Identify,
            (Self::Allocate, E::Already) => Self::Release,
            (Self::Release, E::Done | E::Already | E::Refused) => Self::AllocateAgain,
            (Self::Identify, E::Done) => Self::Paths,
            (Self::Paths, E::Done) => Self::Sizes,
            (Self::Sizes, E::Done) => Self::Rates,
            (Self::Rates | Self::Exchange, E::Done) => Self::Exchange,
            _ => Self::Waiting,
        }
    }

    /// Whether the slave is the master's in this phase, as far as the master knows.
    #[must_use]
    pub const fn is_allocated(self) -> bool {
        matches!(self, Self::Identify | Self::Paths | Self::Sizes | Self::Rates | Self::Exchange)
    }
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Waiting => "waiting",
            Self::Allocate => "allocate",
            Self::Release => "release",
            Self::AllocateAgain => "allocate again",
            Self::Identify => "identify",
            Self::Paths => "assemblies",
            Self::Sizes => "sizes",
            Self::Rates => "expected packet rates",
            Self::Exchange => "exchange",
        })
    }
}

#[cfg(test)]
mod tests {
    use core::fmt::Write as _;

    use super::*;

    #[test]
    fn every_phase_and_event() {
        let events = [
            PhaseEvent::Done,
            PhaseEvent::Already,
            PhaseEvent::Conflict,
            PhaseEvent::Refused,
            PhaseEvent::NoAnswer,
            PhaseEvent::Lost,
        ];
        let mut text = String::new();
        for phase in Phase::ALL {
            for event in events {
                writeln!(text, "{phase} {event:?} -> {}", phase.next(event)).unwrap();
            }
        }
        insta::assert_snapshot!(text);
    }
}
