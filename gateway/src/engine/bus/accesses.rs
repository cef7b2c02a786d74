//! Accesses to a drive alongside the cycle that wait for an answer.

use arrayvec::ArrayVec;

use super::Purpose;
use crate::mapping::Item;

/// Up to `N` accesses of one axis. `T` distinguishes the requests of the master.
#[derive(Debug)]
pub(super) struct Accesses<T, const N: usize>(ArrayVec<(T, Purpose, Item), N>);

impl<T: Copy + PartialEq, const N: usize> Accesses<T, N> {
    /// None.
    pub(super) fn new() -> Self {
        Self(ArrayVec::new())
    }

    /// Makes a request if there is room to wait for its answer; whether it was made.
    pub(super) fn submit(
        &mut self,
        item: Item,
        purpose: Purpose,
        submit: impl FnOnce() -> Option<T>,
    ) -> bool {
        if self.0.is_full() {
            return false;
        }
        let ticket = submit();
        self.0.extend(ticket.map(|ticket| (ticket, purpose, item)));
        ticket.is_some()
    }

    /// Whether this request is one of them.
    pub(super) fn contains(&self, ticket: T) -> bool {
        self.0.iter().any(|(known, ..)| *known == ticket)
    }

    /// Ends the wait for a request; `None` when it is none of them.
    pub(super) fn take(&mut self, ticket: T) -> Option<(Purpose, Item)> {
        let at = self.0.iter().position(|(known, ..)| *known == ticket)?;
        let (_, purpose, item) = self.0.remove(at);
        Some((purpose, item))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_answer_finds_its_access_once_and_a_full_list_asks_nothing() {
        let mut accesses = Accesses::<u8, 2>::new();
        let item = |sub| Item::object(0x6041, sub);
        assert!(accesses.submit(item(1), Purpose::Diagnosis, || Some(1)));
        assert!(!accesses.submit(item(2), Purpose::FaultReset, || None), "the master has no room");
        assert!(accesses.submit(item(3), Purpose::FaultReset, || Some(3)));
        assert!(!accesses.submit(item(4), Purpose::FaultReset, || unreachable!("the list is full")));
        assert!(accesses.contains(1) && !accesses.contains(2));
        assert_eq!(accesses.take(3), Some((Purpose::FaultReset, item(3))));
        assert_eq!((accesses.take(3), accesses.take(2)), (None, None));
        assert_eq!(accesses.take(1), Some((Purpose::Diagnosis, item(1))));
    }
}
