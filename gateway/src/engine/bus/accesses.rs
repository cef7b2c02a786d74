//! Accesses to a drive alongside the cycle that wait for an answer.

use arrayvec::ArrayVec;

use super::Purpose;
use crate::engine::access::{Access, Operation};
use crate::mapping::Item;

/// An access that waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Asked {
    /// What it is for.
    pub purpose: Purpose,
    /// What is accessed.
    pub item: Item,
    /// Whether it writes a value.
    pub write: bool,
}

/// Up to `N` accesses of one axis. `T` distinguishes the requests of the master.
#[derive(Debug)]
pub(super) struct Accesses<T, const N: usize>(ArrayVec<(T, Asked), N>);

impl<T: Copy + PartialEq, const N: usize> Accesses<T, N> {
    /// None.
    pub(super) fn new() -> Self {
        Self(ArrayVec::new())
    }

    /// Makes a request if there is room to wait for its answer; whether it was made.
    pub(super) fn submit(
        &mut self,
        access: &Access,
        purpose: Purpose,
        submit: impl FnOnce() -> Option<T>,
    ) -> bool {
        if self.0.is_full() {
            return false;
        }
        let ticket = submit();
        let write = matches!(access.operation, Operation::Write(_));
        self.0.extend(ticket.map(|ticket| (ticket, Asked { purpose, item: access.item, write })));
        ticket.is_some()
    }

    /// Whether this request is one of them.
    pub(super) fn contains(&self, ticket: T) -> bool {
        self.0.iter().any(|(known, _)| *known == ticket)
    }

    /// Ends the wait for a request; `None` when it is none of them.
    pub(super) fn take(&mut self, ticket: T) -> Option<Asked> {
        let at = self.0.iter().position(|(known, _)| *known == ticket)?;
        Some(self.0.remove(at).1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_answer_finds_its_access_once_and_a_full_list_asks_nothing() {
        let mut accesses = Accesses::<u8, 2>::new();
        let item = |sub| Item::object(0x6041, sub);
        let read = |sub| Access::read(item(sub));
        let write = |sub| Access::write(item(sub), &[1]).expect("short");
        assert!(accesses.submit(&read(1), Purpose::Diagnosis, || Some(1)));
        assert!(!accesses.submit(&read(2), Purpose::FaultReset, || None), "the master has no room");
        assert!(accesses.submit(&write(3), Purpose::FaultReset, || Some(3)));
        assert!(!accesses.submit(&read(4), Purpose::FaultReset, || unreachable!("the list is full")));
        assert!(accesses.contains(1) && !accesses.contains(2));
        let asked = |purpose, sub, write| Some(Asked { purpose, item: item(sub), write });
        assert_eq!(accesses.take(3), asked(Purpose::FaultReset, 3, true));
        assert_eq!((accesses.take(3), accesses.take(2)), (None, None));
        assert_eq!(accesses.take(1), asked(Purpose::Diagnosis, 1, false));
    }
}
