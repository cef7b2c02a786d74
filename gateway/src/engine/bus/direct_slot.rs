//! The direct access of a bus that is in progress, from its request to its result.

use crate::engine::direct::DirectResult;

/// At most one access. `T` distinguishes the requests of the master.
#[derive(Debug)]
pub(super) struct DirectSlot<T> {
    ticket: Option<T>,
    ended: Option<DirectResult>,
}

impl<T: Copy + PartialEq> DirectSlot<T> {
    /// Without an access.
    pub(super) fn new() -> Self {
        Self { ticket: None, ended: None }
    }

    /// Whether another access may begin.
    pub(super) fn is_free(&self) -> bool {
        self.ticket.is_none() && self.ended.is_none()
    }

    /// This request was made for it.
    pub(super) fn begin(&mut self, ticket: T) {
        self.ticket = Some(ticket);
    }

    /// Whether this request was made for it.
    pub(super) fn contains(&self, ticket: T) -> bool {
        self.ticket == Some(ticket)
    }

    /// The request has ended so.
    pub(super) fn end(&mut self, result: DirectResult) {
        self.ticket = None;
        self.ended = Some(result);
    }

    /// Takes the result, once there is one.
    pub(super) fn take(&mut self) -> Option<DirectResult> {
        self.ended.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_access_is_in_its_slot_until_its_result_is_taken() {
        let mut slot = DirectSlot::<u8>::new();
        assert!(slot.is_free() && !slot.contains(4));
        slot.begin(4);
        assert!(!slot.is_free() && slot.contains(4) && !slot.contains(5));
        assert_eq!(slot.take(), None);
        slot.end(DirectResult { result: Ok(None), data: vec![1, 2] });
        assert!(!slot.is_free() && !slot.contains(4), "the result is not taken yet");
        assert_eq!(slot.take(), Some(DirectResult { result: Ok(None), data: vec![1, 2] }));
        assert!(slot.is_free());
    }
}
