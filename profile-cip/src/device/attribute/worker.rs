//! Runs attribute services against the values of one instance, and asks the drive where the value is the drive's.

use arrayvec::ArrayVec;

use super::list_job::{Item, ListFormat, ListJob, Outcome};
use crate::device::attribute::{Access, AttributeStore, AttributeTable, Backing, DataType, Entry, Part};
use crate::wire::status::GeneralStatus;

/// Most octets that one access to the drive carries.
pub const ACCESS_MAX: usize = 64;

/// What the drive is asked to do with an attribute.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum AccessOperation {
    /// Read so many octets.
    Read(usize),
    /// Write these octets.
    Write(ArrayVec<u8, ACCESS_MAX>),
}

/// An access to an attribute that lives in the drive; to be answered with
/// [`MotionDevice::complete_attribute`](crate::device::motion::device::MotionDevice::complete_attribute).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AttributeAccess {
    /// Names the access until its answer.
    pub ticket: u32,
    /// Instance number; 0 is the class.
    pub instance: u8,
    /// Attribute ID.
    pub id: u16,
    /// First array element; 0 for a single value.
    pub start: u16,
    /// Number of array elements; 1 for a single value.
    pub count: u16,
    /// What to do.
    pub operation: AccessOperation,
}

/// The values that a service works on.
pub(crate) struct AttributeSpace<'a> {
    pub table: &'a AttributeTable,
    pub store: &'a mut AttributeStore,
    pub instance: u8,
    /// The axis is Running, where only some attributes may be set.
    pub running: bool,
    /// Last ticket given out.
    pub tickets: &'a mut u32,
}

enum Executed {
    Value(Part),
    Done,
    Refused(GeneralStatus, u16),
    Ask(AttributeAccess),
}

struct Waiting {
    item: Item,
    access: AttributeAccess,
    taken: bool,
}

/// One attribute service at a time.
#[derive(Default)]
pub(crate) struct AttributeWorker {
    job: Option<ListJob>,
    waiting: Option<Waiting>,
    /// Most octets of the response body.
    limit: usize,
}

fn is_string(entry: Option<&Entry>) -> bool {
    entry.is_some_and(|entry| entry.definition.data_type == DataType::ShortString)
}

/// The part of the attribute that an item names, if its dimension and element size are right.
fn part_of(entry: &Entry, item: &Item) -> Result<Part, GeneralStatus> {
    let Some(selector) = item.selector else { return Ok(entry.whole()) };
    if entry.definition.data_type == DataType::ShortString && selector.ranges().is_empty() {
        // Only who has the string knows how long it is: the size in a Get means nothing, that in a Set is the value's own.
        return Ok(entry.whole());
    }
    if selector.element_size != entry.definition.data_type.size() {
        let short = selector.element_size < entry.definition.data_type.size();
        return Err(if short { GeneralStatus::NOT_ENOUGH_DATA } else { GeneralStatus::TOO_MUCH_DATA });
    }
    match (selector.ranges(), entry.definition.elements) {
        ([], None) => Ok(entry.whole()),
        ([range], Some(_)) => Ok(Part { start: range.start, count: range.count }),
        _ => Err(GeneralStatus::INVALID_PARAMETER),
    }
}

impl AttributeSpace<'_> {
    fn execute(&mut self, item: &Item, value: &[u8]) -> Executed {
        let Some(entry) = self.table.find(item.id) else {
            return Executed::Refused(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED, 0);
        };
        let part = match part_of(entry, item) {
            Ok(part) => part,
            Err(status) => return Executed::Refused(status, 0),
        };
        if item.value.is_some() { self.set(entry, part, value) } else { self.get(entry, part) }
    }

    fn get(&mut self, entry: &Entry, part: Part) -> Executed {
        match self.store.get(entry, part) {
            Err(status) => Executed::Refused(status, part.start),
            Ok(value) if entry.definition.backing.is_elsewhere() => {
                let len = value.len();
                if len > ACCESS_MAX {
                    return Executed::Refused(GeneralStatus::REPLY_DATA_TOO_LARGE, 0);
                }
                self.ask(entry, part, AccessOperation::Read(len))
            }
            Ok(_) => Executed::Value(part),
        }
    }

    fn set(&mut self, entry: &Entry, part: Part, value: &[u8]) -> Executed {
        // What the connection sets cannot be changed here; saying again what is in force does no harm.
        if entry.definition.access == Access::Cyclic && self.store.get(entry, part) == Ok(value) {
            return Executed::Done;
        }
        if let Err((status, index)) = entry.check_set(part, value, self.running) {
            return Executed::Refused(status, index);
        }
        if entry.definition.backing == Backing::Stored {
            return match self.store.set(entry, part, value) {
                Ok(()) => Executed::Done,
                Err(status) => Executed::Refused(status, part.start),
            };
        }
        match ArrayVec::try_from(value) {
            Ok(octets) => self.ask(entry, part, AccessOperation::Write(octets)),
            Err(_) => Executed::Refused(GeneralStatus::TOO_MUCH_DATA, 0),
        }
    }

    fn ask(&mut self, entry: &Entry, part: Part, operation: AccessOperation) -> Executed {
        *self.tickets = self.tickets.wrapping_add(1);
        Executed::Ask(AttributeAccess {
            ticket: *self.tickets,
            instance: self.instance,
            id: entry.definition.id,
            start: part.start,
            count: part.count,
            operation,
        })
    }
}

impl AttributeWorker {
    /// Starts a service; one that is in progress is dropped, and the drive's answer to it will not count.
    ///
    /// # Errors
    /// The request is malformed.
    pub fn start(
        &mut self,
        format: ListFormat,
        body: &[u8],
        limit: usize,
        table: &AttributeTable,
    ) -> Result<(), GeneralStatus> {
        *self = Self { limit, ..Self::default() };
        self.job = Some(ListJob::new(format, body, limit, table)?);
        Ok(())
    }

    /// Drops the service in progress.
    pub fn abandon(&mut self) {
        *self = Self::default();
    }

    /// Works until the service is done or has to wait for the drive. Returns the response when done.
    pub fn run(&mut self, space: &mut AttributeSpace<'_>) -> Option<(GeneralStatus, &[u8])> {
        if self.waiting.is_some() {
            return None;
        }
        let job = self.job.as_mut()?;
        while let Some(item) = job.next_item(space.table) {
            match space.execute(&item, job.value(&item)) {
                Executed::Value(part) => {
                    let entry = space.table.find(item.id);
                    let value = entry.and_then(|e| space.store.get(e, part).ok()).unwrap_or_default();
                    job.answer(&item, Outcome::Value(value), self.limit);
                }
                Executed::Done => job.answer(&item, Outcome::Done, self.limit),
                Executed::Refused(status, index) => {
                    job.answer(&item, Outcome::Refused(status, index), self.limit);
                }
                Executed::Ask(access) => {
                    self.waiting = Some(Waiting { item, access, taken: false });
                    return None;
                }
            }
        }
        self.job.as_mut().map(ListJob::finish)
    }

    /// The access to hand to the drive, once.
    pub fn take_access(&mut self) -> Option<AttributeAccess> {
        let waiting = self.waiting.as_mut().filter(|w| !w.taken)?;
        waiting.taken = true;
        Some(waiting.access.clone())
    }

    /// Takes the drive's answer. Returns the access if it was one of this worker's.
    pub fn complete(
        &mut self,
        ticket: u32,
        answer: Result<&[u8], GeneralStatus>,
        space: &mut AttributeSpace<'_>,
    ) -> Option<AttributeAccess> {
        let Waiting { item, access, .. } = self.waiting.take_if(|w| w.access.ticket == ticket)?;
        let Some(job) = self.job.as_mut() else { return Some(access) };
        let entry = space.table.find(item.id);
        let part = Part { start: access.start, count: access.count };
        let outcome = match (&access.operation, answer) {
            (_, Err(status)) => Outcome::Refused(status, access.start),
            (AccessOperation::Read(len), Ok(value)) if value.len() == *len || is_string(entry) => {
                Outcome::Value(value)
            }
            (AccessOperation::Read(_), Ok(_)) => Outcome::Refused(GeneralStatus::DEVICE_STATE_CONFLICT, 0),
            (AccessOperation::Write(octets), Ok(_)) => {
                match entry.map(|entry| space.store.put(entry, part, octets)) {
                    Some(Ok(())) => Outcome::Done,
                    _ => Outcome::Refused(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED, 0),
                }
            }
        };
        job.answer(&item, outcome, self.limit);
        Some(access)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::attribute::{AttributeDefinition, Scope};

    fn table() -> AttributeTable {
        let new = |id, backing| AttributeDefinition {
            backing,
            ..AttributeDefinition::new(Scope::Instance, id, DataType::Udint, Access::Set, "an attribute")
        };
        let definitions = [new(500, Backing::Stored), new(501, Backing::Drive), new(502, Backing::Drive)];
        AttributeTable::new(Scope::Instance, &definitions).expect("a table")
    }

    struct Rig {
        table: AttributeTable,
        store: AttributeStore,
        tickets: u32,
        worker: AttributeWorker,
    }

    impl Rig {
        fn new(format: ListFormat, body: &[u8]) -> Self {
            let table = table();
            let store = AttributeStore::new(&table);
            let mut worker = AttributeWorker::default();
            worker.start(format, body, 500, &table).expect("a request");
            Self { table, store, tickets: 0, worker }
        }

        fn run(&mut self) -> Option<(GeneralStatus, Vec<u8>)> {
            let (table, store, tickets) = (&self.table, &mut self.store, &mut self.tickets);
            let mut space = AttributeSpace { table, store, instance: 3, running: false, tickets };
            self.worker.run(&mut space).map(|(status, body)| (status, body.to_vec()))
        }

        fn complete(&mut self, ticket: u32, answer: Result<&[u8], GeneralStatus>) -> bool {
            let (table, store, tickets) = (&self.table, &mut self.store, &mut self.tickets);
            let mut space = AttributeSpace { table, store, instance: 3, running: false, tickets };
            self.worker.complete(ticket, answer, &mut space).is_some()
        }
    }

    /// A Set_Axis_Attributes_List of all three attributes.
    const SET: [u8; 28] =
        [3, 0, 0, 0, 0xF4, 1, 0, 4, 1, 0, 0, 0, 0xF5, 1, 0, 4, 2, 0, 0, 0, 0xF6, 1, 0, 4, 3, 0, 0, 0];

    #[test]
    fn a_set_waits_for_the_drive_item_by_item() {
        let mut rig = Rig::new(ListFormat::AxisSet, &SET);
        assert_eq!(rig.run(), None);
        assert_eq!(rig.store.unsigned(&rig.table, 500), Some(1));
        assert_eq!(rig.store.unsigned(&rig.table, 501), Some(0), "not before the drive has it");
        let access = rig.worker.take_access().expect("an access");
        assert_eq!((access.instance, access.id, access.start, access.count), (3, 501, 0, 1));
        assert_eq!(
            access.operation,
            AccessOperation::Write(ArrayVec::try_from(&[2, 0, 0, 0][..]).expect("four"))
        );
        assert_eq!(rig.worker.take_access(), None, "handed out once");
        assert!(!rig.complete(access.ticket + 1, Ok(&[])), "another ticket");
        assert!(rig.complete(access.ticket, Ok(&[])));
        assert_eq!(rig.store.unsigned(&rig.table, 501), Some(2));
        assert_eq!(rig.run(), None);
        let access = rig.worker.take_access().expect("the next access");
        assert_eq!(access.id, 502);
        assert!(rig.complete(access.ticket, Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE)));
        let body = vec![3, 0, 0, 0, 0xF4, 1, 0, 0, 0xF5, 1, 0, 0, 0xF6, 1, 9, 0];
        assert_eq!(rig.run(), Some((GeneralStatus::ATTRIBUTE_LIST_ERROR, body)));
    }

    #[test]
    fn a_get_asks_the_drive_only_for_what_lives_there() {
        let body = [2, 0, 0, 0, 0xF4, 1, 0, 4, 0xF6, 1, 0, 4];
        let mut rig = Rig::new(ListFormat::AxisGet, &body);
        assert_eq!(rig.run(), None);
        let access = rig.worker.take_access().expect("an access");
        assert_eq!((access.id, access.operation), (502, AccessOperation::Read(4)));
        assert!(rig.complete(access.ticket, Ok(&[9, 8, 7, 6])));
        let body = vec![2, 0, 0, 0, 0xF4, 1, 0, 4, 0, 0, 0, 0, 0xF6, 1, 0, 4, 9, 8, 7, 6];
        assert_eq!(rig.run(), Some((GeneralStatus::SUCCESS, body)));
    }

    #[test]
    fn wrong_sizes_dimensions_and_cyclic_attributes_are_refused_one_by_one() {
        // 500 with two octets, 500 as an array, 40 (set by the connection) to 1 and to 0, which it is.
        let body = [
            4, 0, 0, 0, 0xF4, 1, 0, 2, 1, 0, 0, 0, 0xF4, 1, 1, 4, 0, 0, 1, 0, 1, 0, 0, 0, 40, 0, 0, 1, 1, 0,
            0, 0, 40, 0, 0, 1, 0, 0, 0, 0,
        ];
        let mut rig = Rig::new(ListFormat::AxisSet, &body);
        let body = vec![4, 0, 0, 0, 0xF4, 1, 0x13, 0, 0xF4, 1, 0x20, 0, 40, 0, 0x0E, 0, 40, 0, 0, 0];
        assert_eq!(rig.run(), Some((GeneralStatus::ATTRIBUTE_LIST_ERROR, body)));
    }
}
