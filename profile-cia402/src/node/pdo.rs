//! PDOs of a device: parameters, the rules for changing them, and what is sent and taken.
//!
//! A mapping is changed while the PDO is not valid (bit 31 of its COB-ID) and while its number of entries is 0; anything else
//! is refused, as drives do.

use arrayvec::ArrayVec;
use profile_generic::can::Id;
use profile_generic::time::{DurationNs, MonotonicTime};

use super::communication::is_free;
use super::dictionary::{DataType, Definition, Dictionary, Handle, Mapping, Object, Shape};
use crate::wire::cob_id::CobId;
use crate::wire::pdo::{
    Direction, MappingEntry, PDO_LEN_MAX, RPDO_COMMUNICATION, SUB_COB_ID, SUB_EVENT_TIMER, SUB_INHIBIT,
    SUB_SYNC_START, SUB_TYPE, TPDO_COMMUNICATION, TransmissionType,
};
use crate::wire::{AbortCode, Mux};

/// From a communication parameter to the mapping.
const TO_MAPPING: u16 = 0x200;
/// Entries of a mapping: whole bytes only.
pub const ENTRIES: u8 = 8;
/// Most PDOs of one direction: four for each of eight axes.
pub const PDOS_MAX: usize = 32;
/// From the first PDO of one axis to that of the next one.
pub const AXIS_STEP: u16 = 0x40;

/// A PDO to begin with.
#[derive(Debug, Clone, Copy)]
pub struct Preset {
    /// Which way.
    pub direction: Direction,
    /// Its number less 1: place in 1400h or 1800h.
    pub offset: u16,
    /// Default identifier less the node-id; `None` for none.
    pub base: Option<u16>,
    /// Whether it is valid to begin with.
    pub valid: bool,
    /// What it carries.
    pub entries: [MappingEntry; 3],
}

/// Adds the objects of a PDO.
pub fn define(dictionary: &mut Dictionary, preset: &Preset) {
    use DataType::{U8, U16, U32};
    let new = Definition::new;
    let transmit = preset.direction == Direction::Transmit;
    let (first, names) = if transmit {
        (TPDO_COMMUNICATION, ("TPDO communication parameter", "TPDO mapping parameter"))
    } else {
        (RPDO_COMMUNICATION, ("RPDO communication parameter", "RPDO mapping parameter"))
    };
    let index = first + preset.offset;
    let invalid = if preset.valid && preset.base.is_some() { 0 } else { 1 << 31 };
    // No device here answers remote frames.
    let no_rtr = if transmit { 1 << 30 } else { 0 };
    let cob_id = new("COB-ID", U32, invalid | no_rtr | i64::from(preset.base.unwrap_or(0)));
    let cob_id = if preset.base.is_some() { cob_id.plus_node() } else { cob_id };
    let event = Some(new("Event timer", U16, 0));
    let transmission = Some(new("Transmission type", U8, 255));
    let (inhibit, start) = (new("Inhibit time", U16, 0), new("SYNC start value", U8, 0).range(0, 240));
    let tail = if transmit { Some(start) } else { None };
    let inhibit = if transmit { Some(inhibit) } else { None };
    let parts = [Some(cob_id), transmission, inhibit, None, event, tail];
    dictionary.record(index, names.0, Shape::Record, &parts);
    let mapping = index + TO_MAPPING;
    let used = preset.entries.iter().take_while(|entry| entry.0 != 0).count();
    dictionary.add_object(Object { index: mapping, name: names.1, shape: Shape::Record });
    let count =
        new("Number of mapped objects", U8, i64::try_from(used).unwrap_or(0)).range(0, i64::from(ENTRIES));
    dictionary.add(Mux::new(mapping, 0), count);
    for sub in 1..=ENTRIES {
        let entry = preset.entries.get(usize::from(sub) - 1).map_or(0, |entry| entry.0);
        dictionary.add(Mux::new(mapping, sub), new("Mapped object", U32, i64::from(entry)));
    }
}

/// What stands at a place of a PDO.
#[derive(Debug, Clone, Copy)]
struct Mapped {
    /// `None` only fills a place.
    handle: Option<Handle>,
    data_type: DataType,
}

/// A PDO at work.
#[derive(Debug, Clone)]
pub(super) struct Pdo {
    /// Index of its communication parameter.
    pub index: u16,
    pub id: Id,
    pub valid: bool,
    pub transmission: TransmissionType,
    inhibit: DurationNs,
    event: DurationNs,
    start: u8,
    mapped: ArrayVec<Mapped, { ENTRIES as usize }>,
    len: usize,
    state: Running,
}

/// What changes while PDOs run.
#[derive(Debug, Clone, Copy, Default)]
struct Running {
    /// RPDO: what takes effect at the next SYNC.
    pending: Option<[u8; PDO_LEN_MAX]>,
    /// RPDO: the next one has to come by then. TPDO: it is sent then, though nothing has changed.
    due: Option<MonotonicTime>,
    /// TPDO: not before.
    not_before: MonotonicTime,
    /// TPDO: what was sent last.
    sent: Option<[u8; PDO_LEN_MAX]>,
    /// TPDO: SYNCs since it was sent, or until it begins; `None` before its SYNC start value.
    syncs: Option<u8>,
}

fn word(number: i64) -> CobId {
    CobId(u32::try_from(number).unwrap_or(u32::MAX))
}

fn entry_of(number: i64) -> MappingEntry {
    MappingEntry(u32::try_from(number).unwrap_or(0))
}

/// Direction of the object whose index is that of a communication or mapping parameter, and the index of the former.
fn place(index: u16) -> Option<(Direction, u16, bool)> {
    Direction::BOTH.into_iter().find_map(|way| {
        if way.communication().contains(&index) {
            return Some((way, index, false));
        }
        way.mapping().contains(&index).then(|| (way, index - TO_MAPPING, true))
    })
}

/// Index of the communication parameter of the PDO that an object belongs to.
pub(super) fn communication_index(index: u16) -> Option<u16> {
    place(index).map(|(_, index, _)| index)
}

/// Whether a number may be written to a parameter of a PDO; objects of other kinds may.
pub(super) fn check(mux: Mux, number: i64, dictionary: &Dictionary) -> Result<(), AbortCode> {
    let Some((direction, index, is_mapping)) = place(mux.index) else { return Ok(()) };
    let valid = word(dictionary.number(index, SUB_COB_ID)).is_valid();
    if is_mapping {
        if valid || mux.sub != 0 && dictionary.number(mux.index, 0) != 0 {
            return Err(AbortCode::ACCESS);
        }
        return match mux.sub {
            0 => check_count(direction, mux.index, number, dictionary),
            _ if number == 0 => Ok(()),
            _ => mapped(direction, entry_of(number), dictionary).map(|_| ()),
        };
    }
    let good = match mux.sub {
        SUB_COB_ID => is_usable(word(number), word(dictionary.number(index, SUB_COB_ID))),
        SUB_TYPE => {
            let transmission = TransmissionType(u8::try_from(number).unwrap_or(u8::MAX));
            // No device here answers remote frames.
            !transmission.is_reserved() && !transmission.is_remote()
        }
        SUB_INHIBIT | SUB_SYNC_START => !valid,
        _ => true,
    };
    if good { Ok(()) } else { Err(AbortCode::VALUE) }
}

/// Whether a PDO can have this COB-ID instead of the old one: one that is sent or received does not move.
fn is_usable(new: CobId, old: CobId) -> bool {
    let moves = old.is_valid() && new.is_valid() && !new.names_same(old);
    let taken = new.is_valid() && !is_free(new.id());
    !moves && !taken && !matches!(new.id(), Id::Extended(_))
}

fn check_count(
    direction: Direction,
    index: u16,
    count: i64,
    dictionary: &Dictionary,
) -> Result<(), AbortCode> {
    let mut len = 0;
    for sub in 1..=u8::try_from(count).unwrap_or(0) {
        len += mapped(direction, entry_of(dictionary.number(index, sub)), dictionary)?.data_type.size();
    }
    if len > PDO_LEN_MAX { Err(AbortCode::PDO_LENGTH) } else { Ok(()) }
}

/// What an entry of a mapping stands for.
fn mapped(direction: Direction, entry: MappingEntry, dictionary: &Dictionary) -> Result<Mapped, AbortCode> {
    if entry.is_dummy() {
        let fills = [DataType::I8, DataType::I16, DataType::I32, DataType::U8, DataType::U16, DataType::U32];
        let data_type = fills.into_iter().find(|known| known.code() == entry.mux().index);
        let data_type =
            data_type.filter(|_| direction == Direction::Receive).ok_or(AbortCode::NOT_MAPPABLE)?;
        let fits = usize::from(entry.bits()) == 8 * data_type.size();
        return if fits { Ok(Mapped { handle: None, data_type }) } else { Err(AbortCode::PARAMETER) };
    }
    let handle = dictionary.look_up(entry.mux())?;
    let definition = dictionary.entry(handle).definition();
    let allowed = match direction {
        Direction::Receive => matches!(definition.mapping, Mapping::Rpdo | Mapping::Both),
        Direction::Transmit => matches!(definition.mapping, Mapping::Tpdo | Mapping::Both),
    };
    if !allowed {
        return Err(AbortCode::NOT_MAPPABLE);
    }
    let data_type = definition.data_type;
    if usize::from(entry.bits()) != 8 * data_type.size() {
        return Err(AbortCode::PARAMETER);
    }
    Ok(Mapped { handle: Some(handle), data_type })
}

impl Pdo {
    /// The PDO whose communication parameter has this index, as the dictionary says.
    pub fn new(index: u16, dictionary: &Dictionary) -> Self {
        let number = |sub| dictionary.number(index, sub);
        let direction = if index < TPDO_COMMUNICATION { Direction::Receive } else { Direction::Transmit };
        let cob_id = word(number(SUB_COB_ID));
        let mut mapped_objects = ArrayVec::new();
        for sub in 1..=u8::try_from(dictionary.number(index + TO_MAPPING, 0)).unwrap_or(0).min(ENTRIES) {
            let entry = entry_of(dictionary.number(index + TO_MAPPING, sub));
            // What cannot be mapped was refused when it was written.
            let Ok(mapped) = mapped(direction, entry, dictionary) else { continue };
            mapped_objects.push(mapped);
        }
        let byte = |sub| u8::try_from(number(sub)).unwrap_or(u8::MAX);
        Self {
            index,
            id: cob_id.id(),
            valid: cob_id.is_valid(),
            transmission: TransmissionType(byte(SUB_TYPE)),
            inhibit: DurationNs::from_micros(100 * number(SUB_INHIBIT)),
            event: DurationNs::from_millis(number(SUB_EVENT_TIMER)),
            start: byte(SUB_SYNC_START),
            len: mapped_objects.iter().map(|mapped: &Mapped| mapped.data_type.size()).sum(),
            mapped: mapped_objects,
            state: Running::default(),
        }
    }

    /// Takes changed parameters over.
    pub fn refresh(&mut self, dictionary: &Dictionary) {
        let fresh = Self::new(self.index, dictionary);
        let state = if fresh.valid && self.valid { self.state } else { Running::default() };
        *self = Self { state, ..fresh };
    }

    /// The communication begins.
    pub fn start(&mut self) {
        self.state = Running::default();
    }

    /// Bytes.
    pub fn len(&self) -> usize {
        self.len
    }

    /// RPDO: data came that are long enough. Synchronous ones are kept for the next SYNC; whether others are to be applied
    /// is said.
    pub fn receive(&mut self, now: MonotonicTime, data: &[u8]) -> bool {
        let mut bytes = [0; PDO_LEN_MAX];
        let kept = data.len().min(PDO_LEN_MAX);
        bytes[..kept].copy_from_slice(&data[..kept]);
        self.state.pending = Some(bytes);
        self.state.due = (self.event > DurationNs::ZERO).then(|| now + self.event);
        !self.transmission.is_synchronous()
    }

    /// RPDO: whether it should have come by now. Told once.
    pub fn is_late(&mut self, now: MonotonicTime) -> bool {
        let late = self.state.due.is_some_and(|due| now >= due);
        if late {
            self.state.due = None;
        }
        late
    }

    /// RPDO: puts what came into the objects; whether something had come. A number beyond its limits stays out.
    pub fn apply(&mut self, dictionary: &mut Dictionary) -> bool {
        let Some(bytes) = self.state.pending.take() else { return false };
        let mut at = 0;
        for mapped in &self.mapped {
            let end = at + mapped.data_type.size();
            let number = bytes.get(at..end).and_then(|bytes| mapped.data_type.number(bytes));
            at = end;
            let (Some(handle), Some(number)) = (mapped.handle, number) else { continue };
            let definition = dictionary.entry(handle).definition();
            let writable = definition.access.writes();
            if writable && (definition.low..=definition.high).contains(&number) {
                dictionary.set_number(handle, number);
            }
        }
        true
    }

    /// TPDO: its bytes now.
    fn sample(&self, dictionary: &Dictionary) -> [u8; PDO_LEN_MAX] {
        let mut bytes = [0; PDO_LEN_MAX];
        let mut at = 0;
        for mapped in &self.mapped {
            let size = mapped.data_type.size();
            let number = mapped.handle.map_or(0, |handle| dictionary.entry(handle).number());
            if let Some(place) = bytes.get_mut(at..at + size) {
                place.copy_from_slice(&number.to_le_bytes()[..size]);
            }
            at += size;
        }
        bytes
    }

    /// TPDO: what is to be sent because something has changed or the event timer has run down.
    pub fn event(&mut self, now: MonotonicTime, dictionary: &Dictionary) -> Option<[u8; PDO_LEN_MAX]> {
        if !self.transmission.is_event_driven() || now < self.state.not_before {
            return None;
        }
        let bytes = self.sample(dictionary);
        let due = self.state.due.is_some_and(|due| now >= due);
        if self.state.sent == Some(bytes) && !due {
            return None;
        }
        self.state.not_before = now + self.inhibit;
        self.state.due = (self.event > DurationNs::ZERO).then(|| now + self.event);
        self.state.sent = Some(bytes);
        Some(bytes)
    }

    /// TPDO: what is to be sent because of a SYNC.
    pub fn sync(&mut self, counter: Option<u8>, dictionary: &Dictionary) -> Option<[u8; PDO_LEN_MAX]> {
        let bytes = match self.transmission.syncs() {
            Some(every) => {
                let passed = match (self.state.syncs, counter) {
                    (None, Some(counter)) if self.start != 0 && counter != self.start => return None,
                    // The first one is sent at its start value, or with the first SYNC that completes its number.
                    (None, Some(_)) if self.start != 0 => every,
                    (passed, _) => passed.unwrap_or(0) + 1,
                };
                self.state.syncs = Some(if passed >= every { 0 } else { passed });
                if passed < every {
                    return None;
                }
                self.sample(dictionary)
            }
            None if self.transmission == TransmissionType::SYNC_ON_EVENT => {
                let bytes = self.sample(dictionary);
                if self.state.sent == Some(bytes) {
                    return None;
                }
                bytes
            }
            None => return None,
        };
        self.state.sent = Some(bytes);
        Some(bytes)
    }
}
