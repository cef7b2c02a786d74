//! The places for the requests of one service channel: a place is taken until its outcome has been fetched, so no outcome is
//! ever lost.

use super::request::{SvcFailure, SvcOperation, SvcOutcome, SvcReply, SvcRequest};
use super::transfer::Transfer;
use crate::wire::idn::Idn;

/// Requests of the application which one slave holds, waiting or answered and not fetched.
pub const REQUESTS_MAX: usize = 16;

/// Place of the master's own requests.
const OWN: usize = REQUESTS_MAX;

#[derive(Debug)]
enum Place {
    Free,
    Waiting,
    Active,
    /// A procedure command in process, off the wire, and when it was asked about in the order of all.
    Parked(Transfer, u64),
    Finished(Result<SvcReply, SvcFailure>),
}

#[derive(Debug)]
struct Slot {
    place: Place,
    serial: u64,
    request: SvcRequest,
}

impl Slot {
    fn empty() -> Slot {
        Slot { place: Place::Free, serial: 0, request: SvcRequest::new(Idn(0), SvcOperation::Status) }
    }

    fn is_parked(&self) -> bool {
        matches!(self.place, Place::Parked(..))
    }
}

/// The requests, by their places.
#[derive(Debug)]
pub(super) struct Slots {
    slots: Box<[Slot; REQUESTS_MAX + 1]>,
    serial: u64,
    /// Commands in process that were asked about so far.
    turn: u64,
    /// Requests that wait or are parked, and those of the application that are finished: most of the time there are none.
    pending: usize,
    finished: usize,
}

impl Slots {
    pub fn new() -> Slots {
        let slots = Box::new(core::array::from_fn(|_| Slot::empty()));
        Slots { slots, serial: 0, turn: 0, pending: 0, finished: 0 }
    }

    /// Requests that wait, or procedure commands in process.
    pub fn has_pending(&self) -> bool {
        self.pending > 0
    }

    /// The first procedure command in process.
    pub fn parked(&self) -> Option<usize> {
        self.slots.iter().position(Slot::is_parked).filter(|_| self.has_pending())
    }

    /// How many procedure commands are in process.
    pub fn count_parked(&self) -> usize {
        self.slots.iter().filter(|slot| slot.is_parked()).count()
    }

    pub fn request(&self, index: usize) -> &SvcRequest {
        &self.slots[index].request
    }

    pub fn request_mut(&mut self, index: usize) -> &mut SvcRequest {
        &mut self.slots[index].request
    }

    /// Takes a request of the application; gives it back when all places are taken.
    pub fn submit(&mut self, request: SvcRequest) -> Result<(usize, u64), SvcRequest> {
        match self.slots[..OWN].iter().position(|slot| matches!(slot.place, Place::Free)) {
            Some(index) => Ok((index, self.occupy(index, request))),
            None => Err(request),
        }
    }

    /// Takes a request of the master itself, which goes before all others.
    pub fn submit_own(&mut self, request: SvcRequest) {
        self.occupy(OWN, request);
    }

    fn occupy(&mut self, index: usize, request: SvcRequest) -> u64 {
        self.serial += 1;
        let again = matches!(self.slots[index].place, Place::Waiting | Place::Parked(..));
        self.pending += usize::from(!again);
        self.slots[index] = Slot { place: Place::Waiting, serial: self.serial, request };
        self.serial
    }

    /// Whether a request of the application is finished.
    #[inline]
    pub fn has_outcome(&self) -> bool {
        self.finished > 0
    }

    /// The outcome of one finished request of the application, oldest first, with its place and serial number.
    pub fn take_outcome(&mut self) -> Option<(usize, u64, SvcOutcome)> {
        if !self.has_outcome() {
            return None;
        }
        let index = (0..OWN)
            .filter(|&index| matches!(self.slots[index].place, Place::Finished(_)))
            .min_by_key(|&index| self.slots[index].serial)?;
        let serial = self.slots[index].serial;
        self.take(index).map(|outcome| (index, serial, outcome))
    }

    /// The outcome of the master's own request.
    pub fn take_own(&mut self) -> Option<SvcOutcome> {
        self.take(OWN)
    }

    fn take(&mut self, index: usize) -> Option<SvcOutcome> {
        let slot = &mut self.slots[index];
        let Place::Finished(result) = slot.place else {
            return None;
        };
        slot.place = Place::Free;
        if index != OWN {
            self.finished -= 1;
        }
        Some(SvcOutcome {
            idn: slot.request.idn,
            operation: slot.request.operation,
            result,
            data: core::mem::take(&mut slot.request.data),
        })
    }

    /// Ends every request with `failure`.
    pub fn abort(&mut self, failure: SvcFailure) {
        for index in 0..self.slots.len() {
            if matches!(self.slots[index].place, Place::Waiting | Place::Active | Place::Parked(..)) {
                self.finish(index, Err(failure));
            }
        }
        self.pending = 0;
    }

    /// A request has come to its end.
    pub fn finish(&mut self, index: usize, result: Result<SvcReply, SvcFailure>) {
        self.slots[index].place = Place::Finished(result);
        if index != OWN {
            self.finished += 1;
        }
    }

    /// Takes a procedure command in process off the wire.
    pub fn park(&mut self, index: usize, transfer: Transfer) {
        self.turn += 1;
        self.slots[index].place = Place::Parked(transfer, self.turn);
        self.pending += 1;
    }

    /// Makes a request the active one; whether it was parked.
    pub fn activate(&mut self, index: usize) -> (Transfer, bool) {
        let slot = &mut self.slots[index];
        self.pending -= 1;
        match core::mem::replace(&mut slot.place, Place::Active) {
            Place::Parked(transfer, _) => (transfer, true),
            _ => (Transfer::new(&mut slot.request), false),
        }
    }

    /// The request to go on with: the most urgent one that waits if `may_start`, or a command in process if its time has come
    /// or nothing else waits.
    pub fn next(&self, may_start: bool, command_is_due: bool) -> Option<usize> {
        let serial = |index: usize| core::cmp::Reverse(self.slots[index].serial);
        let rank = |index: usize| (index == OWN, self.slots[index].request.priority, serial(index));
        let all = 0..self.slots.len();
        let waiting = all.clone().filter(|&index| may_start && self.may_start(index));
        let waiting = waiting.max_by_key(|&index| rank(index));
        let asked = |index: usize| match self.slots[index].place {
            Place::Parked(_, turn) => Some((turn, index)),
            _ => None,
        };
        let parked = all.filter_map(asked).min().filter(|_| waiting.is_none() || command_is_due);
        parked.map(|(_, index)| index).or(waiting)
    }

    /// Whether the request waits and may go on the wire. One command at a time acts on a data block.
    fn may_start(&self, index: usize) -> bool {
        let slot = &self.slots[index];
        let taken = |other: &Slot| matches!(&other.place, Place::Parked(transfer, _) if transfer.idn() == slot.request.idn);
        matches!(slot.place, Place::Waiting) && !self.slots.iter().any(taken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Slots {
        /// The places that are taken, and the first failure.
        pub fn shown(&self) -> String {
            let name = |slot: &Slot| match &slot.place {
                Place::Free => None,
                Place::Waiting => Some("waiting"),
                Place::Active => Some("active"),
                Place::Parked(..) => Some("parked"),
                Place::Finished(Ok(_)) => Some("done"),
                Place::Finished(Err(_)) => Some("failed"),
            };
            let places: Vec<_> = self.slots.iter().filter_map(name).collect();
            let failure = self.slots.iter().find_map(|slot| match slot.place {
                Place::Finished(Err(failure)) => Some(format!(" ({failure})")),
                _ => None,
            });
            format!("{}{}", places.join(" "), failure.unwrap_or_default())
        }
    }

    fn read(block: u16) -> SvcRequest {
        SvcRequest::read(Idn::standard(block))
    }

    #[test]
    fn command_in_process_is_next_when_due_or_when_nothing_else_waits() {
        let mut slots = Slots::new();
        let (command, _) = slots.submit(SvcRequest::command(Idn::standard(99))).unwrap();
        let (transfer, parked) = slots.activate(command);
        assert!(!parked);
        slots.park(command, transfer);
        assert_eq!((slots.parked(), slots.count_parked()), (Some(command), 1));
        let (other, _) = slots.submit(read(1)).unwrap();
        assert_eq!(slots.next(true, false), Some(other));
        assert_eq!(slots.next(true, true), Some(command));
        assert_eq!(slots.next(false, false), Some(command), "others may not start");
        // A second command on the same data block waits for the first.
        slots.activate(other);
        slots.submit(SvcRequest::command(Idn::standard(99))).unwrap();
        assert_eq!(slots.next(true, false), Some(command));
    }

    #[test]
    fn abort_finishes_each_request_once() {
        let mut slots = Slots::new();
        slots.submit(read(1)).unwrap();
        slots.submit_own(read(2));
        slots.abort(SvcFailure::PhaseLeft);
        assert!(!slots.has_pending());
        let (place, serial, outcome) = slots.take_outcome().unwrap();
        assert_eq!((place, serial, outcome.idn), (0, 1, Idn::standard(1)));
        assert!(slots.take_outcome().is_none());
        assert_eq!(slots.take_own().unwrap().idn, Idn::standard(2));
    }
}
