//! What the drive had before a controller changed it. A connection begins with the defaults of all attributes (clause 5-2.4,
//! Forward_Open): the default of one that lives in the drive is what the drive had by itself, from its memory or a start-up
//! list.
//!
//! The value is read before the first write, which waits behind the read in the queue of the drive. With the next connection all
//! values go back, the last one that was changed first, as limits may depend on each other; the accesses of the controller and the
//! torque of the axis wait for that, and it waits for an axis that still has torque of before. A drive that is lost is commissioned
//! anew, and what it has then is what it has by itself.

use arrayvec::ArrayVec;

use crate::engine::access::{Access, AccessFailure, Data, Operation};
use crate::mapping::Item;

/// Parameters that a controller may change: more than there are attributes that a drive has.
const ORIGINALS_MAX: usize = 96;

/// Longest value of an attribute in a drive, octets.
const VALUE_MAX: usize = 8;

/// What the drive had.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Original {
    item: Item,
    /// `None` until the drive has answered.
    value: Option<ArrayVec<u8, VALUE_MAX>>,
}

/// The originals of one drive.
#[derive(Debug, Default)]
pub(super) struct Originals {
    /// In the order in which they were changed.
    known: ArrayVec<Original, ORIGINALS_MAX>,
    /// They go back.
    returning: bool,
    /// The one that the drive was asked to take back.
    under_way: Option<Item>,
}

impl Originals {
    /// Asks the drive for what it has, where that is not known, before a request that writes; `false` if the drive cannot be asked,
    /// and the request cannot be made.
    pub fn ask_before(&mut self, request: &Access, ask: impl FnOnce(&Access) -> bool) -> bool {
        let is_known = self.known.iter().any(|known| known.item == request.item);
        if is_known || !matches!(request.operation, Operation::Write(_)) {
            return true;
        }
        let is_asked = !self.known.is_full() && ask(&Access::read(request.item));
        if is_asked {
            self.known.push(Original { item: request.item, value: None });
        }
        is_asked
    }

    /// Takes the drive's answer to a read of [`Originals::ask_before`]. What cannot be read, or is longer than an attribute, is
    /// not kept.
    pub fn read(&mut self, item: Item, result: Result<&Data, AccessFailure>) {
        let Some(at) = self.known.iter().position(|known| known.item == item && known.value.is_none()) else {
            return;
        };
        match result.ok().and_then(|data| ArrayVec::try_from(&data[..]).ok()) {
            Some(value) => self.known[at].value = Some(value),
            None => {
                self.known.remove(at);
            }
        }
    }

    /// Somebody else has set this: it is what the drive has by itself from now on.
    pub fn forget(&mut self, item: Item) {
        self.known.retain(|known| known.item != item);
    }

    /// The drive is gone.
    pub fn forget_all(&mut self) {
        self.known.clear();
        self.returning = false;
    }

    /// A connection was opened.
    pub fn give_back(&mut self) {
        self.returning = !self.known.is_empty() || self.under_way.is_some();
    }

    /// Whether values are on their way back.
    #[must_use]
    pub fn is_returning(&self) -> bool {
        self.returning
    }

    /// Asks the drive to take the next value back.
    pub fn advance(&mut self, ask: impl FnOnce(&Access) -> bool) {
        if !self.returning || self.under_way.is_some() {
            return;
        }
        // A read that is under way is answered before long.
        let Some(Original { item, value }) = self.known.last() else {
            self.returning = false;
            return;
        };
        let Some(request) = value.as_ref().and_then(|value| Access::write(*item, value)) else { return };
        if ask(&request) {
            self.under_way = Some(*item);
            self.known.pop();
        }
    }

    /// The drive has answered to a value that goes back.
    pub fn written(&mut self) {
        self.under_way = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Item = Item::object(0x6065, 0);
    const B: Item = Item::object(0x6066, 0);

    fn write(item: Item) -> Access {
        Access::write(item, &[9]).expect("short")
    }

    fn data(bytes: &[u8]) -> Data {
        Data::try_from(bytes).expect("short")
    }

    /// Both are changed, and known.
    fn changed() -> Originals {
        let mut originals = Originals::default();
        for (item, value) in [(A, 1), (B, 2)] {
            assert!(originals.ask_before(&write(item), |request| *request == Access::read(item)));
            originals.read(item, Ok(&data(&[value, 0])));
        }
        originals
    }

    /// What goes back next.
    fn next(originals: &mut Originals) -> Option<Access> {
        let mut asked = None;
        originals.advance(|request| {
            asked = Some(request.clone());
            true
        });
        asked
    }

    #[test]
    fn only_the_first_write_reads_before() {
        let mut originals = Originals::default();
        assert!(originals.ask_before(&Access::read(A), |_| unreachable!("a read changes nothing")));
        assert!(!originals.ask_before(&write(A), |_| false), "the drive cannot be asked");
        assert!(originals.ask_before(&write(A), |_| true));
        assert!(originals.ask_before(&write(A), |_| unreachable!("asked already")));
        originals.read(A, Ok(&data(&[1])));
        originals.read(A, Ok(&data(&[9])));
        assert!(originals.ask_before(&write(A), |_| unreachable!("known")));
        originals.give_back();
        assert_eq!(next(&mut originals), Access::write(A, &[1]), "the first one");
    }

    #[test]
    fn a_connection_gives_back_the_last_change_first_one_at_a_time() {
        let mut originals = changed();
        assert_eq!(next(&mut originals), None, "on the same connection");
        originals.give_back();
        assert_eq!(next(&mut originals), Access::write(B, &[2, 0]));
        assert_eq!(next(&mut originals), None, "the drive has not answered");
        originals.written();
        assert_eq!(next(&mut originals), Access::write(A, &[1, 0]));
        assert!(originals.is_returning());
        originals.written();
        assert_eq!(next(&mut originals), None);
        assert!(!originals.is_returning());
        assert!(originals.ask_before(&write(A), |_| true), "it is read again");
        originals.read(A, Err(AccessFailure::Unanswered));
        originals.give_back();
        assert!(!originals.is_returning(), "what could not be read cannot go back");
    }

    #[test]
    fn a_queue_without_room_and_a_read_under_way_are_waited_for() {
        let mut originals = changed();
        let c = Item::object(0x6067, 0);
        assert!(originals.ask_before(&write(c), |_| true));
        originals.give_back();
        assert_eq!(next(&mut originals), None, "the drive has not said what it had");
        originals.read(c, Ok(&data(&[3])));
        originals.advance(|_| false);
        assert_eq!(next(&mut originals), Access::write(c, &[3]), "again");
    }

    #[test]
    fn what_somebody_else_has_set_and_what_a_lost_drive_had_stays() {
        let mut originals = changed();
        originals.forget(B);
        originals.give_back();
        assert_eq!(next(&mut originals), Access::write(A, &[1, 0]));
        let mut originals = changed();
        originals.give_back();
        originals.forget_all();
        assert_eq!((next(&mut originals), originals.is_returning()), (None, false));
    }

    #[test]
    fn values_longer_than_an_attribute_are_not_kept() {
        let mut originals = Originals::default();
        assert!(originals.ask_before(&write(A), |_| true));
        originals.read(A, Ok(&data(&[0; 9])));
        originals.give_back();
        assert!(!originals.is_returning());
    }
}
