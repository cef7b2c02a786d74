//! Homing: methods 6098h and what the statusword says about it.
//!
//! A method is a switch, one of its edges, the direction in which the edge is passed in the end, and whether the index
//! pulse behind it counts:
//!
//! | methods | switch | edge that counts | first direction |
//! |---|---|---|---|
//! | 1, 17 | negative limit | upper end, passed upward | negative |
//! | 2, 18 | positive limit | lower end, passed downward | positive |
//! | 3, 4, 19, 20 | home, closed all the way up | lower end; 3, 19 downward, 4, 20 upward | positive |
//! | 5, 6, 21, 22 | home, closed all the way down | upper end; 5, 21 upward, 6, 22 downward | negative |
//! | 7 to 10, 23 to 26 | home, turning round at the positive limit | lower end down, up; upper end down, up | positive |
//! | 11 to 14, 27 to 30 | home, turning round at the negative limit | upper end up, down; lower end up, down | negative |
//! | 33, 34 | none: the next index pulse | | negative, positive |
//! | 35, 37 | none: where the axis stands; 35 is the old number | | |
//!
//! 17 to 30 are 1 to 14 without the index pulse. 15, 16, 31 and 32 are reserved, below 0 are those of the manufacturer.

use core::fmt;

use super::statusword::Statusword;

/// A homing method, object 6098h.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct Method(pub i8);

/// Which way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Direction {
    /// Toward lower positions.
    Negative,
    /// Toward higher positions.
    Positive,
}

impl Direction {
    /// -1 or 1.
    #[must_use]
    pub const fn sign(self) -> i64 {
        match self {
            Self::Negative => -1,
            Self::Positive => 1,
        }
    }

    /// The other one.
    #[must_use]
    pub const fn reversed(self) -> Self {
        match self {
            Self::Negative => Self::Positive,
            Self::Positive => Self::Negative,
        }
    }
}

/// A switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Switch {
    /// Closed at and below its place.
    NegativeLimit,
    /// Closed at and above its place.
    PositiveLimit,
    /// Closed along a stretch.
    Home,
}

/// What a method does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Plan {
    /// The place where the axis stands is the home position.
    Here,
    /// The next index pulse is.
    Index(Direction),
    /// An edge of a switch is, or the index pulse behind it.
    Edge {
        /// The switch.
        switch: Switch,
        /// Which end of the stretch where it is closed: `Negative` is the lower one.
        end: Direction,
        /// In which direction the edge is passed in the end.
        passed: Direction,
        /// Where to look for the switch first.
        first: Direction,
        /// A limit switch on the way turns the search round, instead of ending it.
        turns: bool,
        /// The first index pulse behind the edge counts, instead of the edge.
        index: bool,
    },
}

impl Method {
    /// Every method of the standard.
    pub const ALL: [i8; 32] = [
        1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29,
        30, 33, 34, 35, 37,
    ];

    /// What it does; `None` for a reserved number and for those of the manufacturer.
    #[must_use]
    // Flat: a table by method.
    pub const fn plan(self) -> Option<Plan> {
        use Direction::{Negative, Positive};
        let (number, index) = match self.0 {
            1..=14 => (self.0, true),
            17..=30 => (self.0 - 16, false),
            33 => return Some(Plan::Index(Negative)),
            34 => return Some(Plan::Index(Positive)),
            35 | 37 => return Some(Plan::Here),
            _ => return None,
        };
        let (switch, end, passed, first, turns) = match number {
            1 => (Switch::NegativeLimit, Positive, Positive, Negative, false),
            2 => (Switch::PositiveLimit, Negative, Negative, Positive, false),
            3 => (Switch::Home, Negative, Negative, Positive, false),
            4 => (Switch::Home, Negative, Positive, Positive, false),
            5 => (Switch::Home, Positive, Positive, Negative, false),
            6 => (Switch::Home, Positive, Negative, Negative, false),
            7 => (Switch::Home, Negative, Negative, Positive, true),
            8 => (Switch::Home, Negative, Positive, Positive, true),
            9 => (Switch::Home, Positive, Negative, Positive, true),
            10 => (Switch::Home, Positive, Positive, Positive, true),
            11 => (Switch::Home, Positive, Positive, Negative, true),
            12 => (Switch::Home, Positive, Negative, Negative, true),
            13 => (Switch::Home, Negative, Positive, Negative, true),
            _ => (Switch::Home, Negative, Negative, Negative, true),
        };
        Some(Plan::Edge { switch, end, passed, first, turns, index })
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

/// What bits 13, 12 and 10 of the statusword say in the mode homing. Source: python canopen `p402.py`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Progress {
    /// 000.
    InProgress,
    /// 001.
    InterruptedOrNotStarted,
    /// 010.
    AttainedNotReached,
    /// 011.
    Done,
    /// 100.
    FailedMoving,
    /// 101.
    FailedStanding,
}

impl Progress {
    /// What a statusword says; `None` for the two reserved combinations.
    #[must_use]
    pub const fn decode(word: Statusword) -> Option<Self> {
        let (error, attained) =
            (word.contains(Statusword::HOMING_ERROR), word.contains(Statusword::HOMING_ATTAINED));
        Some(match (error, attained, word.contains(Statusword::TARGET_REACHED)) {
            (false, false, false) => Self::InProgress,
            (false, false, true) => Self::InterruptedOrNotStarted,
            (false, true, false) => Self::AttainedNotReached,
            (false, true, true) => Self::Done,
            (true, false, false) => Self::FailedMoving,
            (true, false, true) => Self::FailedStanding,
            (true, true, _) => return None,
        })
    }

    /// The bits that say it.
    #[must_use]
    pub const fn bits(self) -> Statusword {
        let (error, attained) = (Statusword::HOMING_ERROR, Statusword::HOMING_ATTAINED);
        match self {
            Self::InProgress => Statusword::empty(),
            Self::InterruptedOrNotStarted => Statusword::TARGET_REACHED,
            Self::AttainedNotReached => attained,
            Self::Done => attained.union(Statusword::TARGET_REACHED),
            Self::FailedMoving => error,
            Self::FailedStanding => error.union(Statusword::TARGET_REACHED),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_methods_of_the_standard_have_a_plan() {
        let known: Vec<_> = (i8::MIN..=i8::MAX).filter(|&number| Method(number).plan().is_some()).collect();
        assert_eq!(known, Method::ALL);
    }

    #[test]
    fn methods_17_to_30_are_1_to_14_without_the_index_pulse() {
        for number in 1..=14 {
            let without = Method(number + 16).plan();
            let with = match Method(number).plan() {
                Some(Plan::Edge { switch, end, passed, first, turns, index: true }) => {
                    Some(Plan::Edge { switch, end, passed, first, turns, index: false })
                }
                other => panic!("{number}: {other:?}"),
            };
            assert_eq!(with, without, "{number}");
        }
    }

    #[test]
    fn opposite_methods_mirror_each_other() {
        for (up, down) in [(2, 1), (3, 5), (4, 6), (7, 11), (8, 12), (9, 13), (10, 14)] {
            let (
                Some(Plan::Edge { end, passed, first, .. }),
                Some(Plan::Edge { end: e, passed: p, first: f, .. }),
            ) = (Method(up).plan(), Method(down).plan())
            else {
                panic!("{up} and {down}");
            };
            assert_eq!((end, passed, first), (e.reversed(), p.reversed(), f.reversed()), "{up} and {down}");
        }
    }

    #[test]
    fn the_statusword_tells_how_far_homing_is() {
        let bits = Statusword::HOMING_ERROR | Statusword::HOMING_ATTAINED | Statusword::TARGET_REACHED;
        let mut known = 0;
        for word in (0..=u16::MAX).map(Statusword::from_bits_retain) {
            if let Some(progress) = Progress::decode(word) {
                assert_eq!(progress.bits(), word & bits);
                known += 1;
            }
        }
        assert_eq!(known, 6 * 0x2000);
        assert_eq!(Progress::decode(Statusword::from_bits_retain(0x1637)), Some(Progress::Done));
    }
}
