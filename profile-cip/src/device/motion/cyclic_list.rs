//! Cyclic write and read data: attribute lists agreed by service and carried in every update, clauses 6-2.7.1.2.3,
//! 6-2.7.2.1.6, 5-2.5.1.3 and 5-2.5.1.4.
//!
//! A list in use stays valid until the controller uses its successor: that is the update which hands over. A successor
//! that was never used gives way to the next one, so two are kept.
//!
//! The standard promises that what a list carries is read in every update and applied in the next one. Values stored in
//! the device keep that promise, and so do signals and what is computed from them, which the owner of the device publishes in
//! every cycle ([`CyclicLists::publish`]), as far as the drive has them ([`CyclicLists::set_refused`]). A parameter of the
//! drive, which only its own parameter channel reaches, is not read in a list: it is refused with its own status ("attribute not
//! gettable") instead of being served from a copy of unknown age. It is written by one, as soon as the channel has time
//! ([`DriveValues`]), because gains and limits are what controllers have write lists for. No list has a string, whose length would move
//! what stands behind it.
//!
//! A trim ([`Entry::is_trim`]) is written by a list only. It goes with the set-points of its own update and is stored nowhere:
//! an update that does not carry it means zero.

use arrayvec::ArrayVec;

use super::drive_values::DriveValues;
use crate::device::attribute::{Access, AttributeStore, AttributeTable, Backing, DataType, Entry};
use crate::device::axis::drive_link::Trims;
use crate::wire::motion::id_list::{IdList, IdStatus, IdStatusList};
use crate::wire::status::GeneralStatus;

/// Most attributes of one list.
pub const CYCLIC_ATTRIBUTES_MAX: usize = 16;
/// Most octets of cyclic read data.
pub(crate) const CYCLIC_DATA_MAX: usize = 256;

/// Most attributes that a drive does not let be in a list. One more would be refused when it is read or written.
const REFUSED_MAX: usize = 256;

/// Direction of a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Direction {
    Write,
    Read,
}

#[derive(Debug, Clone, Default)]
struct Layout {
    id: u8,
    attributes: ArrayVec<u16, CYCLIC_ATTRIBUTES_MAX>,
    /// A signal of it has no value now.
    incomplete: bool,
}

/// The lists of one direction.
#[derive(Debug, Clone, Default)]
pub(crate) struct CyclicLists {
    in_use: Layout,
    /// Agreed on and not used yet; empty with ID 0 when there is none.
    next: Layout,
    /// The ID that was given last.
    given: u8,
    /// What the drive of the axis does not let be in a list.
    refused: ArrayVec<u16, REFUSED_MAX>,
}

/// Octets to skip so that the elements of an attribute are aligned to their size, at most to 32 bits.
fn align(at: usize, entry: &Entry) -> usize {
    at.next_multiple_of(usize::from(entry.definition.data_type.size()).min(4))
}

impl CyclicLists {
    /// Without lists: a connection begins or ends. The drive stays.
    pub fn start_over(&mut self) {
        *self = Self { refused: core::mem::take(&mut self.refused), ..Self::default() };
    }

    /// Sets what the drive of the axis does not let be in a list.
    pub fn set_refused(&mut self, ids: impl Iterator<Item = u16>) {
        self.refused = ids.take(REFUSED_MAX).collect();
    }

    /// The list with this ID, not 0, which is in use from now on.
    fn take_up(&mut self, id: u8) -> Option<&Layout> {
        if id == self.next.id {
            self.in_use = core::mem::take(&mut self.next);
        }
        (id == self.in_use.id).then_some(&self.in_use)
    }

    /// The ID for a new list: ID 0 is the empty list for good, and that of the list in use is taken.
    fn next_id(&self) -> u8 {
        let after = |id: u8| id.checked_add(1).unwrap_or(1);
        let id = after(self.given);
        if id == self.in_use.id { after(id) } else { id }
    }

    fn suits(table: &AttributeTable, id: u16, direction: Direction) -> GeneralStatus {
        match (table.find(id), direction) {
            (None, _) => GeneralStatus::ATTRIBUTE_NOT_SUPPORTED,
            (Some(e), Direction::Write)
                if !e.is_trim()
                    && (e.definition.access != Access::Set
                        || !matches!(e.definition.backing, Backing::Stored | Backing::Drive)
                        || e.definition.data_type == DataType::ShortString) =>
            {
                GeneralStatus::ATTRIBUTE_NOT_SETTABLE
            }
            (Some(e), Direction::Read)
                if e.definition.backing == Backing::Drive
                    || e.definition.data_type == DataType::ShortString =>
            {
                GeneralStatus::ATTRIBUTE_NOT_GETTABLE
            }
            (Some(_), _) => GeneralStatus::SUCCESS,
        }
    }

    /// Carries out a Set_Cyclic_Write_List or Set_Cyclic_Read_List and writes its response body.
    pub fn configure(
        &mut self,
        table: &AttributeTable,
        direction: Direction,
        body: &[u8],
        response: &mut [u8],
    ) -> (GeneralStatus, usize) {
        let Ok(list) = IdList::parse(body) else { return (GeneralStatus::NOT_ENOUGH_DATA, 0) };
        if list.len() > CYCLIC_ATTRIBUTES_MAX {
            return (GeneralStatus::RESOURCE_UNAVAILABLE, 0);
        }
        let not_of_this_drive = match direction {
            Direction::Write => GeneralStatus::ATTRIBUTE_NOT_SETTABLE,
            Direction::Read => GeneralStatus::ATTRIBUTE_NOT_GETTABLE,
        };
        let suits = |id| match Self::suits(table, id, direction) {
            GeneralStatus::SUCCESS if self.refused.contains(&id) => not_of_this_drive,
            status => status,
        };
        let statuses: ArrayVec<IdStatus, CYCLIC_ATTRIBUTES_MAX> =
            list.iter().map(|id| IdStatus { id, status: suits(id).0 }).collect();
        let size: usize = list.iter().filter_map(|id| table.find(id)).map(|e| e.definition.size() + 3).sum();
        let fits = size <= CYCLIC_DATA_MAX;
        let good = fits && statuses.iter().all(|s| s.status == 0);
        if good {
            let id = self.next_id();
            let signal = |e: &Entry| e.definition.backing == Backing::Signal;
            // Until they are published for the first time there is nothing to be read.
            let incomplete = list.iter().filter_map(|id| table.find(id)).any(signal);
            self.next = Layout { id, attributes: list.iter().collect(), incomplete };
            self.given = id;
        }
        let status = match (good, fits) {
            (true, _) => GeneralStatus::SUCCESS,
            (false, true) => GeneralStatus::ATTRIBUTE_LIST_ERROR,
            (false, false) => GeneralStatus::RESOURCE_UNAVAILABLE,
        };
        IdStatusList::emit(response, self.given, &statuses)
            .map_or((GeneralStatus::REPLY_DATA_TOO_LARGE, 0), |len| (status, len))
    }

    /// Applies cyclic write data, all of it or nothing, and gives the trims among them, which are not kept. What lives in the drive goes
    /// into `drive`.
    ///
    /// # Errors
    /// There is no list with this ID, or the data do not fit it.
    pub fn write(
        &mut self,
        table: &AttributeTable,
        (store, drive): (&mut AttributeStore, &mut DriveValues),
        id: u8,
        data: &[u8],
        running: bool,
    ) -> Result<Trims, GeneralStatus> {
        let mut trims = Trims::default();
        if id == 0 {
            drive.clear();
            return if data.is_empty() { Ok(trims) } else { Err(GeneralStatus::TOO_MUCH_DATA) };
        }
        let layout = self.take_up(id).ok_or(GeneralStatus::INVALID_PARAMETER)?;
        drive.keep(&layout.attributes);
        for apply in [false, true] {
            let mut at = 0;
            for entry in layout.attributes.iter().filter_map(|id| table.find(*id)) {
                at = align(at, entry);
                let Some(value) = data.get(at..at + entry.definition.size()) else {
                    return Err(GeneralStatus::NOT_ENOUGH_DATA);
                };
                match (apply, entry.is_trim()) {
                    (false, true) => {
                        entry.check_value(entry.whole(), value, false).map_err(|(status, _)| status)?;
                        let number = entry.definition.data_type.to_f64(value);
                        let kept = number.is_some_and(|number| trims.set(entry.definition.id, number));
                        if !kept {
                            return Err(GeneralStatus::RESOURCE_UNAVAILABLE);
                        }
                    }
                    (true, true) => {}
                    (false, false) => {
                        entry.check_set(entry.whole(), value, running).map_err(|(status, _)| status)?;
                    }
                    (true, false) if entry.definition.backing == Backing::Drive => {
                        drive.want(entry.definition.id, value)?;
                    }
                    (true, false) => store.put(entry, entry.whole(), value)?,
                }
                at += value.len();
            }
            if data.len() != at.next_multiple_of(4) {
                return Err(GeneralStatus::TOO_MUCH_DATA);
            }
        }
        Ok(trims)
    }

    /// Puts the signals of the lists into the store. `value` writes the octets of a signal and returns how many they are;
    /// a list that holds one without a value cannot be read until it has one again.
    pub fn publish(
        &mut self,
        table: &AttributeTable,
        store: &mut AttributeStore,
        value: &mut dyn FnMut(u16, &mut [u8; 8]) -> Option<usize>,
    ) {
        for layout in [&mut self.in_use, &mut self.next] {
            layout.incomplete = false;
            let entries = layout.attributes.iter().filter_map(|id| table.find(*id));
            for entry in entries.filter(|entry| entry.definition.backing == Backing::Signal) {
                let mut octets = [0; 8];
                let put = value(entry.definition.id, &mut octets)
                    .and_then(|len| octets.get(..len))
                    .map(|octets| store.put(entry, entry.whole(), octets));
                layout.incomplete |= put != Some(Ok(()));
            }
        }
    }

    /// Collects cyclic read data.
    ///
    /// # Errors
    /// There is no list with this ID, or a signal of it has no value now.
    pub fn read(
        &mut self,
        table: &AttributeTable,
        store: &AttributeStore,
        id: u8,
    ) -> Result<ArrayVec<u8, CYCLIC_DATA_MAX>, GeneralStatus> {
        let mut data = ArrayVec::new();
        if id == 0 {
            return Ok(data);
        }
        let layout = self.take_up(id).ok_or(GeneralStatus::INVALID_PARAMETER)?;
        if layout.incomplete {
            return Err(GeneralStatus::DEVICE_STATE_CONFLICT);
        }
        for entry in layout.attributes.iter().filter_map(|id| table.find(*id)) {
            let padding = align(data.len(), entry) - data.len();
            data.extend([0; 4].into_iter().take(padding));
            data.try_extend_from_slice(store.get(entry, entry.whole())?)
                .map_err(|_| GeneralStatus::REPLY_DATA_TOO_LARGE)?;
        }
        Ok(data)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::attribute::worker::AccessOperation;
    use crate::device::attribute::{AttributeDefinition, Scope};

    fn table() -> AttributeTable {
        let new = |id, data_type, access, backing| AttributeDefinition {
            backing,
            ..AttributeDefinition::new(Scope::Instance, id, data_type, access, "an attribute")
        };
        let definitions = [
            new(1, DataType::Udint, Access::Set, Backing::Stored),
            new(2, DataType::Uint, Access::Set, Backing::Stored),
            new(3, DataType::Lint, Access::Set, Backing::Stored),
            new(4, DataType::Udint, Access::Get, Backing::Stored),
            new(5, DataType::Udint, Access::Set, Backing::Drive),
            new(6, DataType::Real, Access::Get, Backing::Signal),
            new(7, DataType::ShortString, Access::Set, Backing::Stored),
            new(18, DataType::Dint, Access::Cyclic, Backing::Signal),
            new(19, DataType::Real, Access::Cyclic, Backing::Signal),
            new(20, DataType::Real, Access::Cyclic, Backing::Stored),
        ];
        AttributeTable::new(Scope::Instance, &definitions).expect("a table")
    }

    fn configure(lists: &mut CyclicLists, direction: Direction, ids: &[u16]) -> (GeneralStatus, Vec<u8>) {
        let (mut body, mut response) = ([0; 64], [0xA5; 128]);
        let len = IdList::emit(&mut body, ids).expect("room");
        let (status, len) = lists.configure(&table(), direction, &body[..len], &mut response);
        (status, response[..len].to_vec())
    }

    #[test]
    fn what_the_drive_does_not_have_in_its_telegrams_is_refused_on_every_connection() {
        let mut lists = CyclicLists::default();
        lists.set_refused([6].into_iter());
        for _ in 0..2 {
            let (mut body, mut response) = ([0; 64], [0; 64]);
            let len = IdList::emit(&mut body, &[4, 6]).expect("room");
            let (status, len) = lists.configure(&table(), Direction::Read, &body[..len], &mut response);
            assert_eq!(status, GeneralStatus::ATTRIBUTE_LIST_ERROR);
            let told = IdStatusList::parse(&response[..len]).expect("a list");
            let told: Vec<_> = told.iter().map(|item| (item.id, item.status)).collect();
            assert_eq!(told, [(4, 0), (6, GeneralStatus::ATTRIBUTE_NOT_GETTABLE.0)]);
            lists.start_over();
        }
        lists.set_refused([].into_iter());
        assert_eq!(configure(&mut lists, Direction::Read, &[4, 6]).0, GeneralStatus::SUCCESS);
    }

    #[test]
    fn data_is_aligned_as_in_table_6_2_27() {
        let table = table();
        let mut store = AttributeStore::new(&table);
        let mut lists = CyclicLists::default();
        let answer = configure(&mut lists, Direction::Write, &[1, 2, 3]);
        assert_eq!(answer, (GeneralStatus::SUCCESS, vec![3, 0, 1, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0]));
        let data = [1, 1, 1, 1, 2, 2, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0x80];
        assert_eq!(
            lists.write(&table, (&mut store, &mut DriveValues::default()), 1, &data, false),
            Ok(Trims::default())
        );
        assert_eq!(store.unsigned(&table, 2), Some(0x0202));
        assert_eq!(store.unsigned(&table, 3), Some(0x8000_0000_0000_0003));
        assert_eq!(lists.read(&table, &store, 1).as_deref(), Ok(&data[..]));
    }

    #[test]
    fn bad_write_data_changes_nothing() {
        let table = table();
        let mut store = AttributeStore::new(&table);
        let mut lists = CyclicLists::default();
        configure(&mut lists, Direction::Write, &[1, 2]);
        let mut write = |id, data: &[u8], running| {
            lists.write(&table, (&mut store, &mut DriveValues::default()), id, data, running)
        };
        assert_eq!(write(1, &[1; 4], false), Err(GeneralStatus::NOT_ENOUGH_DATA));
        assert_eq!(write(1, &[1; 12], false), Err(GeneralStatus::TOO_MUCH_DATA));
        assert_eq!(write(2, &[1; 8], false), Err(GeneralStatus::INVALID_PARAMETER));
        assert_eq!(write(1, &[1; 8], true), Err(GeneralStatus::OBJECT_STATE_CONFLICT));
        assert_eq!(write(0, &[], false), Ok(Trims::default()));
        assert_eq!(write(0, &[0; 4], false), Err(GeneralStatus::TOO_MUCH_DATA));
        assert_eq!(store.unsigned(&table, 1), Some(0));
    }

    #[test]
    fn trims_are_given_with_the_update_and_never_kept() {
        let table = table();
        let mut store = AttributeStore::new(&table);
        let mut lists = CyclicLists::default();
        let (status, body) = configure(&mut lists, Direction::Write, &[20]);
        assert_eq!((status, body[6]), (GeneralStatus::ATTRIBUTE_LIST_ERROR, 0x0E), "no trim");
        assert_eq!(configure(&mut lists, Direction::Write, &[18, 1, 19]).0, GeneralStatus::SUCCESS);
        let data = |position: i32, torque: f32| {
            let values = [position.to_le_bytes(), 7_u32.to_le_bytes(), torque.to_le_bytes()];
            values.concat()
        };
        let trims = lists
            .write(&table, (&mut store, &mut DriveValues::default()), 1, &data(-5, 2.5), false)
            .expect("good data");
        assert_eq!(trims.iter().collect::<Vec<_>>(), [(18, -5.0), (19, 2.5)]);
        assert_eq!(store.unsigned(&table, 1), Some(7));
        assert_eq!((store.unsigned(&table, 18), store.unsigned(&table, 19)), (Some(0), Some(0)), "not kept");
        let infinite =
            lists.write(&table, (&mut store, &mut DriveValues::default()), 1, &data(1, f32::INFINITY), false);
        assert_eq!(infinite, Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE));
        // Attribute 1 is not on the list of Table 5-2.110, the trims need not be.
        let running = lists.write(&table, (&mut store, &mut DriveValues::default()), 1, &data(1, 1.0), true);
        assert_eq!(running, Err(GeneralStatus::OBJECT_STATE_CONFLICT));
        assert_eq!(configure(&mut lists, Direction::Write, &[19, 18, 19]).0, GeneralStatus::SUCCESS);
        let trims = lists
            .write(&table, (&mut store, &mut DriveValues::default()), 2, &data(0, 1.5), true)
            .expect("trims while running");
        assert_eq!(trims.iter().collect::<Vec<_>>(), [(19, 1.5), (18, 7.0)], "the last value of one counts");
        assert_eq!(
            lists.write(&table, (&mut store, &mut DriveValues::default()), 0, &[], true),
            Ok(Trims::default()),
            "none is zero"
        );
    }

    #[test]
    fn signals_are_read_while_they_have_a_value() {
        let table = table();
        let mut store = AttributeStore::new(&table);
        let mut lists = CyclicLists::default();
        assert_eq!(configure(&mut lists, Direction::Read, &[2, 6]).0, GeneralStatus::SUCCESS);
        let conflict = Err(GeneralStatus::DEVICE_STATE_CONFLICT);
        assert_eq!(lists.read(&table, &store, 1), conflict, "not published yet");
        let mut asked = Vec::new();
        lists.publish(&table, &mut store, &mut |id, octets| {
            asked.push(id);
            octets[..4].copy_from_slice(&2.5_f32.to_le_bytes());
            Some(4)
        });
        assert_eq!(asked, [6]);
        let read = lists.read(&table, &store, 1);
        assert_eq!(read.as_deref(), Ok(&[0, 0, 0, 0, 0, 0, 0x20, 0x40][..]));
        lists.publish(&table, &mut store, &mut |_, _| None);
        assert_eq!(lists.read(&table, &store, 1), conflict);
        lists.publish(&table, &mut store, &mut |_, _| Some(3));
        assert_eq!(lists.read(&table, &store, 1), conflict, "another length");
    }

    #[test]
    fn strings_and_reads_of_parameters_of_the_drive_are_refused_by_name() {
        let mut lists = CyclicLists::default();
        let (status, body) = configure(&mut lists, Direction::Read, &[7, 5]);
        assert_eq!(
            (status, &body[4..]),
            (GeneralStatus::ATTRIBUTE_LIST_ERROR, &[7, 0, 0x2C, 0, 5, 0, 0x2C, 0][..])
        );
        let (status, body) = configure(&mut lists, Direction::Write, &[7, 5, 6]);
        let refused = [7, 0, 0x0E, 0, 5, 0, 0, 0, 6, 0, 0x0E, 0];
        assert_eq!((status, &body[4..]), (GeneralStatus::ATTRIBUTE_LIST_ERROR, &refused[..]));
        lists.set_refused([5].into_iter());
        let (status, body) = configure(&mut lists, Direction::Write, &[5, 1]);
        let refused = [5, 0, 0x0E, 0, 1, 0, 0, 0];
        assert_eq!((status, &body[4..]), (GeneralStatus::ATTRIBUTE_LIST_ERROR, &refused[..]));
    }

    #[test]
    fn what_lives_in_the_drive_goes_there_with_the_rest_or_not_at_all() {
        let (table, mut drive, mut tickets) = (table(), DriveValues::default(), 0);
        let mut store = AttributeStore::new(&table);
        let mut lists = CyclicLists::default();
        assert_eq!(configure(&mut lists, Direction::Write, &[1, 5]).0, GeneralStatus::SUCCESS);
        let mut write = |drive: &mut DriveValues, id, data: &[u8]| {
            lists.write(&table, (&mut store, drive), id, data, false).err()
        };
        let short = [1, 0, 0, 0, 2, 0, 0];
        assert_eq!(write(&mut drive, 1, &short), Some(GeneralStatus::NOT_ENOUGH_DATA));
        assert_eq!(drive.take_access(1, &mut tickets), None);
        assert_eq!(write(&mut drive, 1, &[1, 0, 0, 0, 2, 0, 0, 0]), None);
        let access = drive.take_access(1, &mut tickets).expect("an access");
        let octets = [2, 0, 0, 0].into_iter().collect();
        assert_eq!((access.id, access.operation), (5, AccessOperation::Write(octets)));
        assert_eq!(write(&mut drive, 1, &[1, 0, 0, 0, 3, 0, 0, 0]), None);
        assert_eq!(write(&mut drive, 0, &[]), None);
        assert!(!drive.complete(access.ticket, GeneralStatus::SUCCESS), "the empty list wants nothing");
        assert_eq!(drive.take_access(1, &mut tickets), None);
        assert_eq!((store.unsigned(&table, 1), store.unsigned(&table, 5)), (Some(1), Some(0)));
    }

    #[test]
    fn ids_go_round_past_zero_and_past_the_one_in_use() {
        let mut lists = CyclicLists::default();
        let table = table();
        let store = AttributeStore::new(&table);
        configure(&mut lists, Direction::Read, &[1]);
        assert_eq!(lists.read(&table, &store, 1).map(|d| d.len()), Ok(4));
        let ids: Vec<u8> = (0..256).map(|_| configure(&mut lists, Direction::Read, &[2]).1[2]).collect();
        assert_eq!((ids[0], ids[253], ids[254], ids[255]), (2, 255, 2, 3));
        assert_eq!(lists.read(&table, &store, 1).map(|d| d.len()), Ok(4));
    }

    #[test]
    fn the_list_before_stays_until_the_one_after_and_a_bad_list_changes_nothing() {
        let mut lists = CyclicLists::default();
        let table = table();
        let store = AttributeStore::new(&table);
        let invalid = Err(GeneralStatus::INVALID_PARAMETER);
        assert_eq!(configure(&mut lists, Direction::Read, &[1]).0, GeneralStatus::SUCCESS);
        assert_eq!(lists.read(&table, &store, 1).map(|d| d.len()), Ok(4));
        assert_eq!(configure(&mut lists, Direction::Read, &[2]).0, GeneralStatus::SUCCESS);
        let (status, body) = configure(&mut lists, Direction::Read, &[1, 9, 5]);
        assert_eq!(status, GeneralStatus::ATTRIBUTE_LIST_ERROR);
        assert_eq!(body, [3, 0, 2, 0, 1, 0, 0, 0, 9, 0, 0x14, 0, 5, 0, 0x2C, 0], "the ID stays 2");
        assert_eq!(lists.read(&table, &store, 1).map(|d| d.len()), Ok(4), "still the one in use");
        assert_eq!(configure(&mut lists, Direction::Read, &[3]).0, GeneralStatus::SUCCESS);
        assert_eq!(lists.read(&table, &store, 1).map(|d| d.len()), Ok(4), "two lists later as well");
        assert_eq!(lists.read(&table, &store, 2), invalid, "never used, and replaced");
        assert_eq!(
            lists.read(&table, &store, 0).map(|d| d.len()),
            Ok(0),
            "the empty list hands over nothing"
        );
        assert_eq!(lists.read(&table, &store, 1).map(|d| d.len()), Ok(4));
        assert_eq!(lists.read(&table, &store, 3).map(|d| d.len()), Ok(8), "handed over");
        assert_eq!(lists.read(&table, &store, 1), invalid);
        let write = configure(&mut lists, Direction::Write, &[4]);
        assert_eq!(write.1[6], GeneralStatus::ATTRIBUTE_NOT_SETTABLE.0);
        let many = [1; CYCLIC_ATTRIBUTES_MAX + 1];
        assert_eq!(
            configure(&mut lists, Direction::Read, &many),
            (GeneralStatus::RESOURCE_UNAVAILABLE, vec![])
        );
    }
}
