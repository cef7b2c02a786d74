//! Deliberate misbehaviour for bench tests: what a broken controller or a broken network would do.
//!
//! Each kind spoils the next updates in one way. While it does, everything else goes on as ever: the commands
//! follow their profiles, and what is lost is lost.

use core::fmt;

use super::axis_set::AxisSet;
use profile_generic::time::DurationNs;

/// A way to misbehave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Misbehaviour {
    /// Send nothing in the next updates.
    SkipUpdates {
        /// How many.
        updates: u32,
    },
    /// Send the next updates later than they are due.
    Delay {
        /// By how much.
        by: DurationNs,
        /// How many.
        updates: u32,
    },
    /// Send the next updates twice, as the same datagram.
    Duplicate {
        /// How many.
        updates: u32,
    },
    /// Swap the next updates in pairs: the second one goes first.
    Reorder {
        /// How many pairs.
        pairs: u32,
    },
    /// Stamp the next updates with a time that has passed.
    StaleTimeStamp {
        /// How old the stamp is.
        age: DurationNs,
        /// How many updates.
        updates: u32,
    },
    /// Put the encapsulation sequence number of the next updates back, as an old datagram has it.
    WrongSequence {
        /// By how much.
        back: u32,
        /// How many updates.
        updates: u32,
    },
    /// Give the next updates the Update ID of an older one.
    WrongUpdateId {
        /// How much older.
        back: u8,
        /// How many updates.
        updates: u32,
    },
    /// Cut bytes off the end of the next updates.
    Truncate {
        /// How many bytes.
        bytes: u16,
        /// How many updates.
        updates: u32,
    },
    /// Leave out the command value that the Control Mode needs.
    OmitSetPoint {
        /// The axes that it applies to.
        axes: AxisSet,
        /// How many updates.
        updates: u32,
    },
    /// Ask in the next updates for a Control Mode that the axis does not have to know.
    WrongMode {
        /// The axes that it applies to.
        axes: AxisSet,
        /// The code.
        mode: u8,
        /// How many updates.
        updates: u32,
    },
    /// Send nothing any more, on no socket, as a controller that lost its power.
    Vanish,
    /// Drop the TCP stream and go on with the motion connection.
    DropTcp,
}

impl Misbehaviour {
    /// Updates that it spoils; none for what lasts.
    #[must_use]
    pub const fn updates(self) -> u32 {
        match self {
            Self::SkipUpdates { updates }
            | Self::Delay { updates, .. }
            | Self::Duplicate { updates }
            | Self::StaleTimeStamp { updates, .. }
            | Self::WrongSequence { updates, .. }
            | Self::WrongUpdateId { updates, .. }
            | Self::Truncate { updates, .. }
            | Self::OmitSetPoint { updates, .. }
            | Self::WrongMode { updates, .. } => updates,
            Self::Reorder { pairs } => pairs.saturating_mul(2),
            Self::Vanish | Self::DropTcp => 0,
        }
    }
}

/// So many updates, in words.
struct Updates(u32);

impl fmt::Display for Updates {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0 == 1 { f.write_str("1 update") } else { write!(f, "{} updates", self.0) }
    }
}

impl fmt::Display for Misbehaviour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let updates = Updates(self.updates());
        match self {
            Self::SkipUpdates { .. } => write!(f, "skip {updates}"),
            Self::Delay { by, .. } => write!(f, "delay {updates} by {by}"),
            Self::Duplicate { .. } => write!(f, "send {updates} twice"),
            Self::Reorder { pairs } => write!(f, "swap {pairs} pairs of updates"),
            Self::StaleTimeStamp { age, .. } => {
                write!(f, "stamp {updates} with a time {age} old")
            }
            Self::WrongSequence { back, .. } => {
                write!(f, "put the sequence of {updates} back by {back}")
            }
            Self::WrongUpdateId { back, .. } => {
                write!(f, "put the Update ID of {updates} back by {back}")
            }
            Self::Truncate { bytes, .. } => write!(f, "cut {bytes} bytes off {updates}"),
            Self::OmitSetPoint { axes, .. } => {
                write!(f, "leave out the set-point of {axes} in {updates}")
            }
            Self::WrongMode { axes, mode, .. } => {
                write!(f, "ask {axes} for control mode {mode} in {updates}")
            }
            Self::Vanish => f.write_str("vanish"),
            Self::DropTcp => f.write_str("drop the TCP stream"),
        }
    }
}

/// What is to be spoilt in one update.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Spoil {
    pub skip: bool,
    pub delay: DurationNs,
    pub duplicate: bool,
    /// Wait for the next update, which goes first.
    pub hold: bool,
    pub stamp_age: DurationNs,
    pub sequence_back: u32,
    pub update_id_back: u8,
    pub cut: u16,
    pub omit: AxisSet,
    pub wrong_mode: Option<(AxisSet, u8)>,
}

/// The misbehaviour under way.
#[derive(Debug, Clone, Default)]
pub(super) struct Abuse {
    under_way: Vec<(Misbehaviour, u32)>,
    /// Whether there has been any.
    pub ever: bool,
    /// Nothing is sent any more.
    pub vanished: bool,
    /// The TCP stream was dropped.
    pub stream_dropped: bool,
}

impl Abuse {
    /// Begins to misbehave.
    pub fn begin(&mut self, kind: Misbehaviour) {
        self.ever = true;
        match kind {
            Misbehaviour::Vanish => self.vanished = true,
            Misbehaviour::DropTcp => self.stream_dropped = true,
            _ => self.under_way.push((kind, kind.updates())),
        }
    }

    /// Ends what does not last.
    pub fn end(&mut self) {
        self.under_way.clear();
    }

    /// Whether updates are still to be spoilt.
    pub fn is_under_way(&self) -> bool {
        !self.under_way.is_empty()
    }

    /// What is to be spoilt in the next update, which counts.
    pub fn next(&mut self) -> Spoil {
        let mut spoil = Spoil::default();
        for (kind, left) in &mut self.under_way {
            match *kind {
                Misbehaviour::SkipUpdates { .. } => spoil.skip = true,
                Misbehaviour::Delay { by, .. } => spoil.delay = by,
                Misbehaviour::Duplicate { .. } => spoil.duplicate = true,
                Misbehaviour::Reorder { .. } => spoil.hold = *left % 2 == 0,
                Misbehaviour::StaleTimeStamp { age, .. } => spoil.stamp_age = age,
                Misbehaviour::WrongSequence { back, .. } => spoil.sequence_back = back,
                Misbehaviour::WrongUpdateId { back, .. } => spoil.update_id_back = back,
                Misbehaviour::Truncate { bytes, .. } => spoil.cut = bytes,
                Misbehaviour::OmitSetPoint { axes, .. } => spoil.omit = axes,
                Misbehaviour::WrongMode { axes, mode, .. } => spoil.wrong_mode = Some((axes, mode)),
                Misbehaviour::Vanish | Misbehaviour::DropTcp => {}
            }
            *left = left.saturating_sub(1);
        }
        self.under_way.retain(|(_, left)| *left > 0);
        spoil
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_lasts_for_its_updates() {
        let mut abuse = Abuse::default();
        assert_eq!(abuse.next(), Spoil::default());
        abuse.begin(Misbehaviour::SkipUpdates { updates: 2 });
        abuse.begin(Misbehaviour::Truncate { bytes: 7, updates: 1 });
        assert_eq!(abuse.next(), Spoil { skip: true, cut: 7, ..Spoil::default() });
        assert_eq!(abuse.next(), Spoil { skip: true, ..Spoil::default() });
        assert!(!abuse.is_under_way() && abuse.ever);
        abuse.begin(Misbehaviour::Reorder { pairs: 2 });
        let held: Vec<bool> = (0..5).map(|_| abuse.next().hold).collect();
        assert_eq!(held, [true, false, true, false, false]);
    }
}
