//! What cyclic write data have for the drive: parameters that only its own parameter channel reaches, clause 6-2.7.1.2.3.
//!
//! A value is handed to the drive when an update brings another one than the update before, when something else has set the
//! attribute since, and when the drive is heard again. One access at a time is under way for an attribute; values that come in
//! the meantime replace each other, and the last one follows. What the drive refuses is in the status of the write block as long
//! as the updates bring that value.

use arrayvec::ArrayVec;

use super::cyclic_list::CYCLIC_ATTRIBUTES_MAX;
use crate::device::attribute::worker::{AccessOperation, AttributeAccess};
use crate::wire::status::GeneralStatus;

/// Octets of the longest number.
const NUMBER_MAX: usize = 8;

/// The value of one attribute.
#[derive(Debug, Clone)]
struct DriveValue {
    id: u16,
    /// What the last update has brought.
    wanted: ArrayVec<u8, NUMBER_MAX>,
    /// It is to be handed to the drive.
    is_due: bool,
    /// The access whose answer has not come.
    ticket: Option<u32>,
    /// What the drive has answered last.
    status: GeneralStatus,
}

/// The values of an axis that its cyclic write list has for the drive.
#[derive(Debug, Clone, Default)]
pub(super) struct DriveValues(ArrayVec<DriveValue, CYCLIC_ATTRIBUTES_MAX>);

impl DriveValues {
    /// Nothing is wanted of the drive any more. Accesses that are under way end by themselves.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Keeps only the attributes of a list.
    pub fn keep(&mut self, ids: &[u16]) {
        self.0.retain(|known| ids.contains(&known.id));
    }

    /// Takes the value that an update has brought.
    ///
    /// # Errors
    /// The value is none of a number, or there are too many.
    pub fn want(&mut self, id: u16, value: &[u8]) -> Result<(), GeneralStatus> {
        let wanted = ArrayVec::try_from(value).map_err(|_| GeneralStatus::TOO_MUCH_DATA)?;
        let Some(known) = self.0.iter_mut().find(|known| known.id == id) else {
            let new = DriveValue { id, wanted, is_due: true, ticket: None, status: GeneralStatus::SUCCESS };
            return self.0.try_push(new).map_err(|_| GeneralStatus::RESOURCE_UNAVAILABLE);
        };
        if known.wanted != wanted {
            (known.wanted, known.is_due, known.status) = (wanted, true, GeneralStatus::SUCCESS);
        }
        Ok(())
    }

    /// Somebody else has set the attribute: the next access sets it to what the updates bring.
    pub fn set_by_others(&mut self, id: u16) {
        for known in self.0.iter_mut().filter(|known| known.id == id) {
            known.is_due = true;
        }
    }

    /// The drive is heard again: it may have none of the values any more, and those that came meanwhile were refused.
    pub fn renew(&mut self) {
        for known in &mut self.0 {
            (known.is_due, known.status) = (true, GeneralStatus::SUCCESS);
        }
    }

    /// The next access, for the axis with this instance number.
    pub fn take_access(&mut self, instance: u8, tickets: &mut u32) -> Option<AttributeAccess> {
        let known = self.0.iter_mut().find(|known| known.is_due && known.ticket.is_none())?;
        *tickets = tickets.wrapping_add(1);
        (known.is_due, known.ticket) = (false, Some(*tickets));
        let octets = known.wanted.iter().copied().collect();
        let operation = AccessOperation::Write(octets);
        Some(AttributeAccess { ticket: *tickets, instance, id: known.id, start: 0, count: 1, operation })
    }

    /// Takes the drive's answer; `false` if it is to another access.
    pub fn complete(&mut self, ticket: u32, status: GeneralStatus) -> bool {
        let Some(known) = self.0.iter_mut().find(|known| known.ticket == Some(ticket)) else { return false };
        known.ticket = None;
        if !known.is_due {
            known.status = status;
        }
        true
    }

    /// What the drive has refused, the first of the list; success while it has refused nothing.
    pub fn status(&self) -> GeneralStatus {
        let refused =
            self.0.iter().map(|known| known.status).find(|status| *status != GeneralStatus::SUCCESS);
        refused.unwrap_or(GeneralStatus::SUCCESS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(values: &mut DriveValues, tickets: &mut u32) -> Option<(u32, u16, Vec<u8>)> {
        let access = values.take_access(3, tickets)?;
        assert_eq!((access.instance, access.start, access.count), (3, 0, 1));
        let AccessOperation::Write(octets) = access.operation else { panic!("a read") };
        Some((access.ticket, access.id, octets.to_vec()))
    }

    #[test]
    fn a_value_is_handed_over_once_and_the_last_of_many_follows() {
        let (mut values, mut tickets) = (DriveValues::default(), 6);
        for _ in 0..3 {
            values.want(504, &[1, 0]).expect("room");
        }
        assert_eq!(taken(&mut values, &mut tickets), Some((7, 504, vec![1, 0])));
        for value in 2..5 {
            values.want(504, &[value, 0]).expect("room");
            assert_eq!(taken(&mut values, &mut tickets), None, "one at a time");
        }
        assert!(!values.complete(6, GeneralStatus::SUCCESS), "another ticket");
        assert!(values.complete(7, GeneralStatus::INVALID_ATTRIBUTE_VALUE));
        assert_eq!(values.status(), GeneralStatus::SUCCESS, "that was of the value before");
        assert_eq!(taken(&mut values, &mut tickets), Some((8, 504, vec![4, 0])));
        assert!(values.complete(8, GeneralStatus::SUCCESS));
        values.want(504, &[4, 0]).expect("room");
        assert_eq!(taken(&mut values, &mut tickets), None, "the drive has it");
    }

    #[test]
    fn what_the_drive_refuses_stays_until_there_is_another_value() {
        let (mut values, mut tickets) = (DriveValues::default(), 0);
        values.want(1, &[1]).expect("room");
        values.want(2, &[2]).expect("room");
        assert_eq!(taken(&mut values, &mut tickets), Some((1, 1, vec![1])));
        assert_eq!(taken(&mut values, &mut tickets), Some((2, 2, vec![2])));
        assert!(values.complete(2, GeneralStatus::INVALID_ATTRIBUTE_VALUE));
        assert!(values.complete(1, GeneralStatus::SUCCESS));
        values.want(1, &[1]).expect("room");
        values.want(2, &[2]).expect("room");
        assert_eq!(values.status(), GeneralStatus::INVALID_ATTRIBUTE_VALUE);
        assert_eq!(taken(&mut values, &mut tickets), None, "the drive is not asked again and again");
        values.want(2, &[3]).expect("room");
        assert_eq!(values.status(), GeneralStatus::SUCCESS);
        values.keep(&[1]);
        assert_eq!(taken(&mut values, &mut tickets), None);
    }

    #[test]
    fn what_somebody_else_has_set_is_set_again() {
        let (mut values, mut tickets) = (DriveValues::default(), 0);
        values.want(1, &[1]).expect("room");
        assert_eq!(taken(&mut values, &mut tickets), Some((1, 1, vec![1])));
        values.set_by_others(1);
        values.set_by_others(2);
        assert_eq!(taken(&mut values, &mut tickets), None);
        assert!(values.complete(1, GeneralStatus::SUCCESS));
        assert_eq!(taken(&mut values, &mut tickets), Some((2, 1, vec![1])));
        values.clear();
        assert!(!values.complete(2, GeneralStatus::SUCCESS), "nobody waits for it");
    }

    #[test]
    fn a_drive_that_is_heard_again_gets_every_value_again() {
        let (mut values, mut tickets) = (DriveValues::default(), 0);
        values.want(1, &[1]).expect("room");
        values.want(2, &[2]).expect("room");
        values.want(3, &[3]).expect("room");
        for ticket in 1..=3 {
            assert_eq!(taken(&mut values, &mut tickets).map(|(ticket, ..)| ticket), Some(ticket));
        }
        assert!(values.complete(1, GeneralStatus::SUCCESS));
        assert!(values.complete(2, GeneralStatus::DEVICE_STATE_CONFLICT));
        values.renew();
        assert_eq!(values.status(), GeneralStatus::SUCCESS, "the drive before refused it");
        assert_eq!(taken(&mut values, &mut tickets), Some((4, 1, vec![1])));
        assert_eq!(taken(&mut values, &mut tickets), Some((5, 2, vec![2])));
        assert_eq!(taken(&mut values, &mut tickets), None, "the drive before has not answered");
        assert!(values.complete(3, GeneralStatus::DEVICE_STATE_CONFLICT));
        assert_eq!(taken(&mut values, &mut tickets), Some((6, 3, vec![3])));
        assert_eq!(values.status(), GeneralStatus::SUCCESS);
    }

    #[test]
    fn no_more_than_a_list_has() {
        let mut values = DriveValues::default();
        for id in 0..16 {
            values.want(id, &[0; 8]).expect("room");
        }
        assert_eq!(values.want(16, &[0; 8]), Err(GeneralStatus::RESOURCE_UNAVAILABLE));
        assert_eq!(values.want(0, &[0; 9]), Err(GeneralStatus::TOO_MUCH_DATA));
    }
}
