//! What cannot happen on a well-built network, by station and rule.

use core::fmt;

use arrayvec::ArrayVec;

use super::Station;
use crate::can::frame::{Frame, Id};
use crate::time::{DurationNs, MonotonicTime};

/// Violations that are kept.
pub const VIOLATIONS_MAX: usize = 64;

/// Extended identifiers whose senders are remembered.
const EXTENDED_MAX: usize = 64;

/// Which rule was broken, with the numbers that show it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// No two stations send different frames with one identifier at the same time: neither wins.
    Collision {
        /// The other one.
        with: Station,
        /// The identifier.
        id: Id,
    },
    /// An identifier has one sender, unless it is [shared](super::Bus::share).
    Sender {
        /// Who sent it before.
        owner: Station,
        /// The identifier.
        id: Id,
    },
    /// A classic bus carries no FD frames: every classic controller would spoil them.
    FdFrame {
        /// The identifier.
        id: Id,
    },
    /// No frame waits longer than the network's patience.
    Wait {
        /// The identifier.
        id: Id,
        /// How long it waited.
        waited: DurationNs,
        /// The patience.
        patience: DurationNs,
    },
}

impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Rule::Collision { with, id } => {
                write!(f, "sends {id} at the same time as {with}, with other bits behind it")
            }
            Rule::Sender { owner, id } => write!(f, "sends {id}, which is an identifier of {owner}"),
            Rule::FdFrame { id } => write!(f, "sends {id} as an FD frame on a classic bus"),
            Rule::Wait { id, waited, patience } => {
                write!(f, "waited {waited} for the bus with {id}, expected at most {patience}")
            }
        }
    }
}

/// A rule that a station broke.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Violation {
    /// When.
    pub at: MonotonicTime,
    /// Who.
    pub station: Station,
    /// Which.
    pub rule: Rule,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} {}", self.at, self.station, self.rule)
    }
}

/// Who sends what, and what is wrong with it.
#[derive(Debug)]
pub(super) struct Checker {
    violations: ArrayVec<Violation, VIOLATIONS_MAX>,
    /// Owners of the standard identifiers.
    standard: Box<[Owner; Id::STANDARD_MAX as usize + 1]>,
    extended: ArrayVec<(u32, Owner), EXTENDED_MAX>,
    pub patience: DurationNs,
    beyond: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Owner {
    Nobody,
    One(Station),
    Shared,
}

impl Default for Checker {
    fn default() -> Self {
        Self {
            violations: ArrayVec::new(),
            standard: Box::new([Owner::Nobody; Id::STANDARD_MAX as usize + 1]),
            extended: ArrayVec::new(),
            patience: DurationNs::MAX,
            beyond: 0,
        }
    }
}

impl Checker {
    pub fn violations(&self) -> &[Violation] {
        &self.violations
    }

    pub fn pardon(&mut self) -> usize {
        let count = self.violations.len() + self.beyond;
        self.violations.clear();
        self.beyond = 0;
        count
    }

    /// Keeps a violation; what repeats itself without end, as a collision does, is reported once.
    pub fn broken(&mut self, violation: Violation) {
        let same = |last: &Violation| (last.station, last.rule) == (violation.station, violation.rule);
        if self.violations.last().is_some_and(same) {
            return;
        }
        if self.violations.try_push(violation).is_err() {
            self.beyond += 1;
        }
    }

    pub fn share(&mut self, id: Id) {
        if let Some(owner) = self.owner(id) {
            *owner = Owner::Shared;
        }
    }

    /// A station hands in a frame. Remote frames ask for the identifiers of others.
    pub fn sent(&mut self, at: MonotonicTime, station: Station, frame: &Frame) {
        let id = frame.id();
        let Some(owner) = self.owner(id).filter(|_| !frame.is_remote()) else { return };
        match *owner {
            Owner::Nobody => *owner = Owner::One(station),
            Owner::One(before) if before != station => {
                // Told once; from here on it has no one owner.
                *owner = Owner::Shared;
                self.broken(Violation { at, station, rule: Rule::Sender { owner: before, id } });
            }
            Owner::One(_) | Owner::Shared => {}
        }
    }

    /// A frame has waited so long for the bus.
    pub fn waited(&mut self, at: MonotonicTime, station: Station, id: Id, waited: DurationNs) {
        let patience = self.patience;
        if waited > patience {
            self.broken(Violation { at, station, rule: Rule::Wait { id, waited, patience } });
        }
    }

    fn owner(&mut self, id: Id) -> Option<&mut Owner> {
        match id {
            Id::Standard(id) => self.standard.get_mut(usize::from(id)),
            Id::Extended(id) => {
                let known = self.extended.iter().position(|(known, _)| *known == id);
                let place = known.or_else(|| {
                    self.extended.try_push((id, Owner::Nobody)).ok().map(|()| self.extended.len() - 1)
                })?;
                self.extended.get_mut(place).map(|(_, owner)| owner)
            }
        }
    }
}
