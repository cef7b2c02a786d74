//! The faults and warnings of one axis that are there at the same time.

use arrayvec::ArrayVec;

use crate::fault::{Fault, FaultCause};

/// Most of them: the bits of the two diagnostic words of a drive.
pub const FAULT_SET_MAX: usize = 32;

/// Who says that it is there, and with that how it ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Origin {
    /// It happened and is over, or nobody can tell: it ends with a reset.
    Event,
    /// The drive has switched itself off for it: it ends when the drive says so.
    Drive,
    /// The drive warns and goes on.
    Warning,
    /// The gateway watches it and has done nothing about it.
    Watch,
}

/// A fault or warning that is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ActiveFault {
    /// What it is.
    pub fault: Fault,
    /// Who says so.
    pub origin: Origin,
}

/// What is there at the same time, in the order in which it came. One cause is there at most once for each origin.
#[derive(Debug, Clone, Default)]
pub struct FaultSet {
    list: ArrayVec<ActiveFault, FAULT_SET_MAX>,
    dropped: u32,
}

impl FaultSet {
    /// Nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self { list: ArrayVec::new_const(), dropped: 0 }
    }

    /// What is there.
    pub fn iter(&self) -> impl Iterator<Item = &ActiveFault> {
        self.list.iter()
    }

    /// Whether nothing is there.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Faults that found no place.
    #[must_use]
    pub const fn dropped(&self) -> u32 {
        self.dropped
    }

    /// Whether a cause is there, of this origin.
    #[must_use]
    pub fn contains(&self, cause: FaultCause, origin: Origin) -> bool {
        self.list.iter().any(|known| known.fault.cause == cause && known.origin == origin)
    }

    /// Whether anything of this origin is there.
    #[must_use]
    pub fn has(&self, origin: Origin) -> bool {
        self.list.iter().any(|known| known.origin == origin)
    }

    /// Adds a fault; `true` when it was not there yet. In a full set a warning gives way to what stops the axis.
    pub fn raise(&mut self, fault: Fault, origin: Origin) -> bool {
        if self.contains(fault.cause, origin) {
            return false;
        }
        let active = ActiveFault { fault, origin };
        if self.list.try_push(active).is_err() {
            self.dropped = self.dropped.saturating_add(1);
            let weaker = self.list.iter_mut().find(|known| known.fault.reaction < fault.reaction);
            let Some(place) = weaker else { return false };
            *place = active;
        }
        true
    }

    /// Takes out a cause of an origin.
    pub fn clear(&mut self, cause: FaultCause, origin: Origin) {
        self.list.retain(|known| known.fault.cause != cause || known.origin != origin);
    }

    /// Takes out all of an origin but those that `keep`.
    pub fn clear_all(&mut self, origin: Origin, keep: impl Fn(FaultCause) -> bool) {
        self.list.retain(|known| known.origin != origin || keep(known.fault.cause));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::Reaction;
    use crate::time::SystemTime;

    fn fault(cause: u16) -> Fault {
        Fault::new(FaultCause(cause), SystemTime(u64::from(cause)))
    }

    #[test]
    fn a_cause_is_there_once_for_each_origin_and_keeps_its_time() {
        let mut set = FaultSet::new();
        assert!(set.raise(fault(1), Origin::Watch));
        assert!(!set.raise(Fault { at: SystemTime(99), ..fault(1) }, Origin::Watch));
        assert!(set.raise(fault(1), Origin::Drive));
        assert_eq!(set.iter().map(|known| known.fault.at.0).collect::<Vec<_>>(), [1, 1]);
        set.clear(FaultCause(1), Origin::Watch);
        assert!(!set.contains(FaultCause(1), Origin::Watch) && set.contains(FaultCause(1), Origin::Drive));
        set.clear_all(Origin::Drive, |cause| cause == FaultCause(1));
        assert!(!set.is_empty());
        set.clear_all(Origin::Drive, |_| false);
        assert!(set.is_empty());
    }

    #[test]
    fn a_full_set_gives_up_a_warning_for_a_fault_and_counts() {
        let mut set = FaultSet::new();
        for cause in 0..FAULT_SET_MAX {
            let cause = u16::try_from(cause).expect("small") + 0x7000;
            set.raise(fault(cause).with_reaction(Reaction::Alarm), Origin::Warning);
        }
        assert!(!set.raise(fault(1).with_reaction(Reaction::Alarm), Origin::Warning));
        assert!(set.raise(fault(2).with_reaction(Reaction::CoastAndDisable), Origin::Drive));
        assert_eq!((set.dropped(), set.iter().count()), (2, FAULT_SET_MAX));
        assert!(set.contains(FaultCause(2), Origin::Drive));
        assert!(set.has(Origin::Drive) && set.has(Origin::Warning) && !set.has(Origin::Watch));
    }
}
