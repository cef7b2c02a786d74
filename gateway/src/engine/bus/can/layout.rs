//! Which value goes in which PDO.
//!
//! A program sees the values of its drive as one row of bytes. They are spread over PDOs in their order, each in the first
//! PDO that has room for it: control, mode and set-point of the first mode stand together. Where a device keeps its mapping, they
//! are looked for in the PDOs that it has.

use core::fmt;

use arrayvec::ArrayVec;
use profile_cia402::drive::index::AXIS_OFFSET;
use profile_cia402::eds::drive::Pdo;
use profile_cia402::master::config::{Direction, MappingPolicy, PdoConfig};
use profile_cia402::wire::pdo::{MappingEntry, PDO_LEN_MAX, TransmissionType};
use profile_cia402::wire::{CobId, Mux, NodeId, cob_id};
use profile_generic::can::Id;
use profile_generic::time::DurationNs;

use crate::mapping::{Item, Object};

const NANOS_IN_MS: i64 = 1_000_000;

/// PDOs of an axis, each way.
pub const PDOS_MAX: usize = 4;

/// Places of values of an axis, each way: as many as its PDOs have bytes.
const PARTS_MAX: usize = BYTES_MAX;

/// PDOs with identifiers of the default connection set.
const DEFAULT_PDOS: u16 = 4;

/// PDOs of an axis that are looked at where its device keeps its mapping, each way.
pub const LOOKED_AT: u16 = 8;

/// Bytes of an axis, each way.
pub const BYTES_MAX: usize = PDOS_MAX * PDO_LEN_MAX;

/// From the first PDO of one axis of a device to that of the next one.
const AXIS_STEP: u16 = 0x40;

/// Where a value stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Place of its PDO among those of the axis.
    pub pdo: usize,
    /// Its first byte there.
    pub at: usize,
    /// Its first byte in the row.
    pub from: usize,
    /// Its bytes.
    pub len: usize,
}

/// How the values of an axis are spread over its PDOs, one way.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct PdoMap {
    parts: ArrayVec<Part, PARTS_MAX>,
    numbers: ArrayVec<u16, PDOS_MAX>,
    len: usize,
}

/// The PDOs that an axis may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AxisPdos {
    /// Number of the first one.
    pub first: u16,
    /// Identifiers where there are none by default: of RPDOs and of TPDOs.
    pub ids: Option<[[Id; PDOS_MAX]; 2]>,
    /// How many TPDOs may be missing in a row.
    pub allowed_losses: u16,
    /// Whether they are used as the device has them.
    pub kept: bool,
    /// Transmission types of RPDOs and TPDOs, where it is not left to the device.
    pub types: [Option<TransmissionType>; 2],
    /// From one SYNC to the next.
    pub cycle: DurationNs,
}

/// What RPDOs are given when a device does not take 1. Other synchronous types are the same to one that receives.
const RPDO_TYPES: &[TransmissionType] =
    &[TransmissionType::SYNC_ON_EVENT, TransmissionType::EVENT_PROFILE, TransmissionType::EVENT_MANUFACTURER];

/// What TPDOs are given. Those at every second SYNC and slower would leave cycles without values.
const TPDO_TYPES: &[TransmissionType] =
    &[TransmissionType::EVENT_PROFILE, TransmissionType::EVENT_MANUFACTURER];

/// A PDO as a device has it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FoundPdo {
    /// Its number, from 1.
    pub number: u16,
    /// Its identifier, if it has one.
    pub id: Option<Id>,
    /// What it carries.
    pub mapping: Vec<MappingEntry>,
}

/// RPDOs and TPDOs as a device has them.
pub type FoundPdos = [Vec<FoundPdo>; 2];

impl FoundPdo {
    /// A PDO by its COB-ID. One that does not exist yet has the identifier of the default connection set, if there is one.
    #[must_use]
    pub fn new(number: u16, cob_id: CobId, mapping: Vec<MappingEntry>) -> Self {
        let own = cob_id.is_valid() || number > DEFAULT_PDOS;
        Self { number, id: Some(cob_id.id()).filter(|id| own && *id != Id::Standard(0)), mapping }
    }

    /// A PDO by the description of its device.
    #[must_use]
    pub fn described(pdo: &Pdo) -> Self {
        let word = CobId(pdo.cob_id.unwrap_or(0)).with_valid(pdo.valid);
        let mapping = pdo.mapping.iter().map(|entry| MappingEntry(entry.word())).collect();
        Self::new(pdo.number + 1, word, mapping)
    }
}

/// `1: 6040:00 607A:00`.
impl fmt::Display for FoundPdo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", self.number)?;
        self.mapping.iter().try_for_each(|entry| write!(f, " {}", entry.mux()))
    }
}

/// A value that is in none of the PDOs that a device keeps, or in none that can be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{object} is in no {direction} that can be used, and the mapping is kept: expected one{} got {found}", Only(*.direction))]
pub struct NotMapped {
    /// The value.
    pub object: Object,
    /// Which way it goes.
    pub direction: Direction,
    /// The PDOs that there are.
    pub found: String,
}

/// What else may be in such a PDO.
struct Only(Direction);

impl fmt::Display for Only {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.0 {
            // What nobody sets would be sent as zero.
            Direction::Receive => " with only values that the gateway sets,",
            Direction::Transmit => ",",
        })
    }
}

/// Values that do not fit the PDOs of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{0} does not fit: an axis has {PDOS_MAX} PDOs of {PDO_LEN_MAX} bytes each way")]
pub struct NoRoom(pub Object);

impl PdoMap {
    /// What is put in which PDO.
    #[must_use]
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// The numbers of the PDOs.
    #[must_use]
    pub fn numbers(&self) -> &[u16] {
        &self.numbers
    }

    /// Bytes of the row.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is nothing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
}

impl AxisPdos {
    /// The PDOs of an axis of a device, from 0. The first axis has identifiers by default; others take them from `spare`.
    #[must_use]
    pub fn new(axis: u16, allowed_losses: u16, spare: &mut SpareIds) -> Option<Self> {
        let ids = match axis {
            0 => None,
            _ => Some(spare.next()?),
        };
        let first = AXIS_STEP * axis + 1;
        Some(Self { first, ids, allowed_losses, kept: false, types: [None; 2], cycle: DurationNs::ZERO })
    }

    /// Spreads values, with their lengths in bytes, over PDOs at every SYNC.
    ///
    /// # Errors
    /// They do not fit.
    pub fn pdo_map(
        &self,
        direction: Direction,
        values: &[(Object, u8)],
    ) -> Result<(Vec<PdoConfig>, PdoMap), NoRoom> {
        let mut pdo_map = PdoMap::default();
        let mut pdos: Vec<Vec<MappingEntry>> = Vec::new();
        let mut used: Vec<usize> = Vec::new();
        for (object, len) in values {
            let size = usize::from(*len);
            let free = used.iter().position(|used| used + size <= PDO_LEN_MAX);
            let pdo = match free {
                Some(pdo) => pdo,
                None if used.len() < PDOS_MAX && size <= PDO_LEN_MAX => {
                    used.push(0);
                    pdos.push(Vec::new());
                    used.len() - 1
                }
                None => return Err(NoRoom(*object)),
            };
            let part = Part { pdo, at: used[pdo], from: pdo_map.len, len: size };
            pdo_map.parts.try_push(part).map_err(|_| NoRoom(*object))?;
            pdos[pdo].push(MappingEntry::new(Mux::new(object.index, object.sub), len * 8));
            used[pdo] += size;
            pdo_map.len += size;
        }
        let ids = self.ids_of(direction);
        let mut configs = Vec::with_capacity(pdos.len());
        for (number, (place, mapping)) in (self.first..).zip(pdos.into_iter().enumerate()) {
            pdo_map.numbers.push(number);
            let id = ids.map(|ids| ids[place]);
            configs.push(PdoConfig { id, ..self.config(direction, number, mapping) });
        }
        Ok((configs, pdo_map))
    }

    /// A PDO that goes in every cycle, as far as the device lets it.
    fn config(&self, direction: Direction, number: u16, mapping: Vec<MappingEntry>) -> PdoConfig {
        let (place, others) = match direction {
            Direction::Receive => (0, RPDO_TYPES),
            Direction::Transmit => (1, TPDO_TYPES),
        };
        let (transmission, others) = match self.types[place] {
            Some(wanted) => (wanted, &[][..]),
            None => (TransmissionType::EVERY_SYNC, others),
        };
        // The event timer counts milliseconds; one that was sent late is not missing yet.
        let every_ms = ((self.cycle.as_nanos() + NANOS_IN_MS - 1) / NANOS_IN_MS).max(1);
        let every_ms = u16::try_from(every_ms).unwrap_or(u16::MAX);
        let transmits = direction == Direction::Transmit;
        PdoConfig {
            transmission,
            others,
            event_timer_ms: if transmits { every_ms } else { 0 },
            deadline_ms: if transmits { every_ms.saturating_mul(2) } else { 0 },
            allowed_losses: self.allowed_losses,
            ..PdoConfig::cyclic(number, mapping)
        }
    }

    fn ids_of(&self, direction: Direction) -> Option<[Id; PDOS_MAX]> {
        self.ids.map(|[receive, transmit]| match direction {
            Direction::Receive => receive,
            Direction::Transmit => transmit,
        })
    }

    /// Numbers of the PDOs of a device that may belong to the axis.
    #[must_use]
    pub fn numbers(&self) -> core::ops::Range<u16> {
        self.first..self.first + LOOKED_AT
    }

    /// Finds values, with their lengths in bytes, in PDOs as a device has them. An RPDO is used if it brings nothing but these
    /// values; a value that several of them bring is put into each.
    ///
    /// # Errors
    /// A value is in none of them, or in too many different ones.
    pub fn find(
        &self,
        direction: Direction,
        values: &[(Object, u8)],
        found: &[FoundPdo],
    ) -> Result<(Vec<PdoConfig>, PdoMap), NotMapped> {
        let found: Vec<&FoundPdo> = found.iter().filter(|pdo| self.numbers().contains(&pdo.number)).collect();
        let listed = || {
            let all: Vec<_> = found.iter().map(ToString::to_string).collect();
            if all.is_empty() { "none".to_owned() } else { all.join(", ") }
        };
        let missing = |object| NotMapped { object, direction, found: listed() };
        let used = self.choose(direction, values, &found).map_err(missing)?;
        self.use_kept(direction, values, &used).map_err(missing)
    }

    /// As few PDOs as bring all values, by their numbers; else the value that none of them brings.
    fn choose<'f>(
        &self,
        direction: Direction,
        values: &[(Object, u8)],
        found: &[&'f FoundPdo],
    ) -> Result<Vec<&'f FoundPdo>, Object> {
        let usable = |pdo: &&FoundPdo| self.is_usable(direction, values, pdo);
        let mut free: Vec<&FoundPdo> = found.iter().copied().filter(usable).collect();
        let mut rest: Vec<(Object, u8)> = values.to_vec();
        let mut used: Vec<&FoundPdo> = Vec::new();
        while let Some((first, _)) = rest.first() {
            let brings = |pdo: &FoundPdo| rest.iter().filter(|value| carries(pdo, value).is_some()).count();
            // The lowest number of those that bring as much.
            let best = free.iter().copied().rev().max_by_key(|pdo| brings(pdo));
            let best = best.filter(|pdo| brings(pdo) > 0 && used.len() < PDOS_MAX);
            let best = best.ok_or(*first)?;
            rest.retain(|value| carries(best, value).is_none());
            free.retain(|pdo| pdo.number != best.number);
            used.push(best);
        }
        used.sort_by_key(|pdo| pdo.number);
        Ok(used)
    }

    /// Whether a PDO has an identifier, and, if the drive receives it, brings nothing but these values.
    fn is_usable(&self, direction: Direction, values: &[(Object, u8)], pdo: &FoundPdo) -> bool {
        let has_id = pdo.id.is_some() || self.ids_of(direction).is_some() || pdo.number <= DEFAULT_PDOS;
        if !has_id {
            return false;
        }
        // Every bit is that of a value, or of a gap: nothing is sent that nobody has set.
        let brought = values.iter().filter(|value| carries(pdo, value).is_some());
        let brought: usize = brought.map(|(_, len)| usize::from(*len) * 8).sum();
        let bits = |entry: &MappingEntry| usize::from(entry.bits());
        let gaps: usize = pdo.mapping.iter().filter(|entry| entry.is_dummy()).map(bits).sum();
        direction == Direction::Transmit || brought + gaps == pdo.mapping.iter().map(bits).sum::<usize>()
    }

    /// PDOs as the device has them, with the places of the values; else the value that has too many places.
    fn use_kept(
        &self,
        direction: Direction,
        values: &[(Object, u8)],
        used: &[&FoundPdo],
    ) -> Result<(Vec<PdoConfig>, PdoMap), Object> {
        let mut row = 0;
        let mut froms = Vec::with_capacity(values.len());
        for (_, len) in values {
            froms.push(row);
            row += usize::from(*len);
        }
        let mut pdo_map = PdoMap { len: row, ..PdoMap::default() };
        let mut configs = Vec::with_capacity(used.len());
        for (place, pdo) in used.iter().enumerate() {
            pdo_map.numbers.push(pdo.number);
            for (value, from) in values.iter().zip(&froms) {
                // What comes twice is taken from the first one.
                let again =
                    direction == Direction::Transmit && pdo_map.parts.iter().any(|part| part.from == *from);
                let Some(at) = carries(pdo, value).filter(|_| !again) else { continue };
                let part = Part { pdo: place, at, from: *from, len: usize::from(value.1) };
                pdo_map.parts.try_push(part).map_err(|_| value.0)?;
            }
            configs.push(PdoConfig {
                id: pdo.id.or_else(|| Some(self.ids_of(direction)?[place])),
                policy: MappingPolicy::Keep,
                ..self.config(direction, pdo.number, pdo.mapping.clone())
            });
        }
        Ok((configs, pdo_map))
    }
}

/// The byte of a PDO that a value begins at; `None` where it is not as a whole in it.
fn carries(pdo: &FoundPdo, value: &(Object, u8)) -> Option<usize> {
    let (object, len) = value;
    let wanted = MappingEntry::new(Mux::new(object.index, object.sub), len * 8);
    let place = pdo.mapping.iter().position(|entry| *entry == wanted)?;
    let bits: usize = pdo.mapping[..place].iter().map(|entry| usize::from(entry.bits())).sum();
    bits.is_multiple_of(8).then_some(bits / 8)
}

/// Identifiers of PDOs that belong to node-ids which nobody has.
#[derive(Debug)]
pub struct SpareIds {
    taken: Vec<NodeId>,
    next: u8,
}

impl SpareIds {
    /// All but those of these nodes.
    #[must_use]
    pub fn new(taken: Vec<NodeId>) -> Self {
        Self { taken, next: NodeId::MAX.get() }
    }

    /// Four identifiers for RPDOs and four for TPDOs.
    fn next(&mut self) -> Option<[[Id; PDOS_MAX]; 2]> {
        loop {
            let node = NodeId::new(self.next).ok()?;
            self.next -= 1;
            if self.taken.contains(&node) {
                continue;
            }
            let ids = |of: fn(u16, NodeId) -> Option<Id>| {
                let ids = [of(1, node)?, of(2, node)?, of(3, node)?, of(4, node)?];
                Some(ids)
            };
            return Some([ids(cob_id::rpdo)?, ids(cob_id::tpdo)?]);
        }
    }
}

/// An item as the object that it is.
#[must_use]
pub fn object(item: Item) -> Option<Object> {
    match item {
        Item::Object(object) => Some(object),
        Item::Idn(_) | Item::Attribute(_) => None,
    }
}

const _: () = assert!(AXIS_STEP * 0x20 == AXIS_OFFSET, "PDOs and objects of axes are numbered alike");

#[cfg(test)]
mod tests {
    use super::*;

    fn objects(lens: &[u8]) -> Vec<(Object, u8)> {
        (0x6040..).zip(lens).map(|(index, len)| (Object { index, sub: 0 }, *len)).collect()
    }

    fn first() -> AxisPdos {
        AxisPdos::new(0, 3, &mut SpareIds::new(Vec::new())).unwrap()
    }

    #[test]
    fn values_go_into_the_first_pdo_with_room() {
        // Control, mode, position; velocity and torque; and a byte that the first one still has room for.
        let (pdos, pdo_map) = first().pdo_map(Direction::Receive, &objects(&[2, 1, 4, 4, 2, 1])).unwrap();
        let mapped: Vec<_> = pdos
            .iter()
            .map(|pdo| (pdo.number, pdo.id, pdo.mapping.iter().map(|entry| entry.0).collect()))
            .collect();
        let expected: Vec<(u16, Option<Id>, Vec<u32>)> = vec![
            (1, None, vec![0x6040_0010, 0x6041_0008, 0x6042_0020, 0x6045_0008]),
            (2, None, vec![0x6043_0020, 0x6044_0010]),
        ];
        assert_eq!(mapped, expected);
        let parts: Vec<_> =
            pdo_map.parts().iter().map(|part| (part.pdo, part.at, part.from, part.len)).collect();
        let all = [(0, 0, 0, 2), (0, 2, 2, 1), (0, 3, 3, 4), (1, 0, 7, 4), (1, 4, 11, 2), (0, 7, 13, 1)];
        assert_eq!(parts, all);
        assert_eq!((pdo_map.numbers(), pdo_map.len()), (&[1, 2][..], 14));
        assert!(pdos.iter().all(|pdo| pdo.allowed_losses == 3));
    }

    #[test]
    fn what_does_not_fit_is_named() {
        let eight = [8; 5];
        let error = first().pdo_map(Direction::Transmit, &objects(&eight)).unwrap_err();
        assert_eq!(error.to_string(), "6044:00 does not fit: an axis has 4 PDOs of 8 bytes each way");
        assert_eq!(first().pdo_map(Direction::Transmit, &objects(&[9])).unwrap_err().0.index, 0x6040);
        assert!(first().pdo_map(Direction::Transmit, &objects(&[8, 8, 8, 8])).is_ok());
    }

    #[test]
    fn other_axes_take_identifiers_of_nodes_that_are_not_there() {
        let node = |number| NodeId::new(number).unwrap();
        let mut spare = SpareIds::new(vec![node(127), node(1)]);
        let second = AxisPdos::new(1, 1, &mut spare).unwrap();
        let (pdos, _) = second.pdo_map(Direction::Receive, &objects(&[8, 8])).unwrap();
        let ids: Vec<_> = pdos.iter().map(|pdo| (pdo.number, pdo.id)).collect();
        assert_eq!(ids, [(0x41, Some(Id::Standard(0x27E))), (0x42, Some(Id::Standard(0x37E)))]);
        let (pdos, _) = second.pdo_map(Direction::Transmit, &objects(&[8])).unwrap();
        assert_eq!(pdos[0].id, Some(Id::Standard(0x1FE)));
        let third = AxisPdos::new(2, 1, &mut spare).unwrap();
        assert_eq!(third.ids.unwrap()[1][3], Id::Standard(0x4FD));
        assert_eq!((second.first, third.first), (0x41, 0x81));
    }

    fn found(number: u16, entries: &[u32]) -> FoundPdo {
        let mapping = entries.iter().map(|entry| MappingEntry(*entry)).collect();
        FoundPdo { number, id: None, mapping }
    }

    fn values(entries: &[(u16, u8)]) -> Vec<(Object, u8)> {
        entries.iter().map(|(index, len)| (Object { index: *index, sub: 0 }, *len)).collect()
    }

    type Placed = (usize, usize, usize, usize);

    fn parts(pdo_map: &PdoMap) -> Vec<Placed> {
        pdo_map.parts().iter().map(|part| (part.pdo, part.at, part.from, part.len)).collect()
    }

    #[test]
    fn values_are_found_where_they_are_mapped() {
        let wanted = values(&[(0x6040, 2), (0x6060, 1), (0x607A, 4)]);
        let pdos = [
            found(1, &[0x6040_0010]),
            found(2, &[0x6040_0010, 0x6060_0008]),
            // A gap of a byte, which is of type UNSIGNED8.
            found(3, &[0x0005_0008, 0x607A_0020, 0x6040_0010]),
        ];
        let (configs, pdo_map) = first().find(Direction::Receive, &wanted, &pdos).unwrap();
        let numbers: Vec<_> = configs.iter().map(|pdo| (pdo.number, pdo.policy)).collect();
        assert_eq!(numbers, [(2, MappingPolicy::Keep), (3, MappingPolicy::Keep)]);
        // The controlword goes into both.
        assert_eq!(parts(&pdo_map), [(0, 0, 0, 2), (0, 2, 2, 1), (1, 5, 0, 2), (1, 1, 3, 4)]);
        assert_eq!((pdo_map.numbers(), pdo_map.len()), (&[2, 3][..], 7));
        // What is told twice is taken once, and what nobody wants is left.
        let (_, pdo_map) = first().find(Direction::Transmit, &wanted, &pdos).unwrap();
        assert_eq!(parts(&pdo_map), [(0, 0, 0, 2), (0, 2, 2, 1), (1, 1, 3, 4)]);
        let odd = [found(1, &[0x6040_0010, 0x6081_0020]), found(2, &[0x6060_0008, 0x607A_0020])];
        let (configs, pdo_map) = first().find(Direction::Transmit, &wanted, &odd).unwrap();
        assert_eq!(configs.len(), 2);
        assert_eq!(parts(&pdo_map), [(0, 0, 0, 2), (1, 0, 2, 1), (1, 1, 3, 4)]);
    }

    /// Nothing is sent to a drive that nobody has set, and nothing is read where it does not stand.
    #[test]
    fn what_is_not_found_is_named_with_what_there_is() {
        let wanted = values(&[(0x6040, 2), (0x607A, 4)]);
        let said =
            |direction, pdos: &[FoundPdo]| first().find(direction, &wanted, pdos).unwrap_err().to_string();
        let head = "is in no RPDO that can be used, and the mapping is kept: expected one with only values that the gateway sets, got";
        let cases: [(&[u32], &str); 5] = [
            (&[0x6040_0010], "607A:00 {} 1: 6040:00"),
            // Something else beside it, another length, half of it twice, and bits that shift it.
            (&[0x6040_0010, 0x607A_0020, 0x6081_0010], "6040:00 {} 1: 6040:00 607A:00 6081:00"),
            (&[0x6040_0010, 0x607A_0010], "6040:00 {} 1: 6040:00 607A:00"),
            (&[0x6040_0010, 0x607A_0020, 0x6040_0010], "6040:00 {} 1: 6040:00 607A:00 6040:00"),
            (
                &[0x0001_0001, 0x6040_0010, 0x607A_0020, 0x0001_0007],
                "6040:00 {} 1: 0001:00 6040:00 607A:00 0001:00",
            ),
        ];
        for (entries, expected) in cases {
            assert_eq!(said(Direction::Receive, &[found(1, entries)]), expected.replace("{}", head));
        }
        let text = said(Direction::Transmit, &[found(9, &[0x6040_0010, 0x607A_0020])]);
        assert_eq!(
            text, "6040:00 is in no TPDO that can be used, and the mapping is kept: expected one, got none",
            "it belongs to nobody"
        );
    }

    #[test]
    fn identifiers_are_those_that_the_device_has() {
        let word = |word| FoundPdo::new(1, CobId(word), Vec::new()).id;
        assert_eq!(word(0x0000_0195), Some(Id::Standard(0x195)));
        assert_eq!(word(0x4000_0195), Some(Id::Standard(0x195)));
        assert_eq!((word(0x8000_0195), word(0)), (None, None), "it has that of the default connection set");
        let fifth = |word| FoundPdo::new(5, CobId(word), Vec::new()).id;
        assert_eq!((fifth(0x8000_0195), fifth(0x8000_0000)), (Some(Id::Standard(0x195)), None));
    }
}
