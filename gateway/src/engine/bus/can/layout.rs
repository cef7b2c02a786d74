//! Which value goes in which PDO.
//!
//! A program sees the values of its drive as one row of bytes. They are spread over PDOs in their order, each in the first
//! PDO that has room for it: control, mode and set-point of the first mode stand together.

use arrayvec::ArrayVec;
use profile_cia402::drive::index::AXIS_OFFSET;
use profile_cia402::master::config::{Direction, PdoConfig};
use profile_cia402::wire::pdo::{MappingEntry, PDO_LEN_MAX};
use profile_cia402::wire::{Mux, NodeId, cob_id};
use profile_generic::can::Id;

use crate::mapping::{Item, Object};

/// PDOs of an axis, each way.
pub const PDOS_MAX: usize = 4;

/// Values of an axis, each way.
pub const VALUES_MAX: usize = 16;

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
pub struct Spread {
    parts: ArrayVec<Part, VALUES_MAX>,
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
}

/// Values that do not fit the PDOs of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{0} does not fit: an axis has {PDOS_MAX} PDOs of {PDO_LEN_MAX} bytes each way")]
pub struct NoRoom(pub Object);

impl Spread {
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
        Some(Self { first: AXIS_STEP * axis + 1, ids, allowed_losses })
    }

    /// Spreads values, with their lengths in bytes, over PDOs at every SYNC.
    ///
    /// # Errors
    /// They do not fit.
    pub fn spread(
        &self,
        direction: Direction,
        values: &[(Object, u8)],
    ) -> Result<(Vec<PdoConfig>, Spread), NoRoom> {
        let mut spread = Spread::default();
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
            let part = Part { pdo, at: used[pdo], from: spread.len, len: size };
            spread.parts.try_push(part).map_err(|_| NoRoom(*object))?;
            pdos[pdo].push(MappingEntry::new(Mux::new(object.index, object.sub), len * 8));
            used[pdo] += size;
            spread.len += size;
        }
        let ids = self.ids.map(|[receive, transmit]| match direction {
            Direction::Receive => receive,
            Direction::Transmit => transmit,
        });
        let mut configs = Vec::with_capacity(pdos.len());
        for (number, (place, mapping)) in (self.first..).zip(pdos.into_iter().enumerate()) {
            spread.numbers.push(number);
            let id = ids.map(|ids| ids[place]);
            configs.push(PdoConfig {
                id,
                allowed_losses: self.allowed_losses,
                ..PdoConfig::cyclic(number, mapping)
            });
        }
        Ok((configs, spread))
    }
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
        let (pdos, spread) = first().spread(Direction::Receive, &objects(&[2, 1, 4, 4, 2, 1])).unwrap();
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
            spread.parts().iter().map(|part| (part.pdo, part.at, part.from, part.len)).collect();
        let all = [(0, 0, 0, 2), (0, 2, 2, 1), (0, 3, 3, 4), (1, 0, 7, 4), (1, 4, 11, 2), (0, 7, 13, 1)];
        assert_eq!(parts, all);
        assert_eq!((spread.numbers(), spread.len()), (&[1, 2][..], 14));
        assert!(pdos.iter().all(|pdo| pdo.allowed_losses == 3));
    }

    #[test]
    fn what_does_not_fit_is_named() {
        let eight = [8; 5];
        let error = first().spread(Direction::Transmit, &objects(&eight)).unwrap_err();
        assert_eq!(error.to_string(), "6044:00 does not fit: an axis has 4 PDOs of 8 bytes each way");
        assert_eq!(first().spread(Direction::Transmit, &objects(&[9])).unwrap_err().0.index, 0x6040);
        assert!(first().spread(Direction::Transmit, &objects(&[8, 8, 8, 8])).is_ok());
    }

    #[test]
    fn other_axes_take_identifiers_of_nodes_that_are_not_there() {
        let node = |number| NodeId::new(number).unwrap();
        let mut spare = SpareIds::new(vec![node(127), node(1)]);
        let second = AxisPdos::new(1, 1, &mut spare).unwrap();
        let (pdos, _) = second.spread(Direction::Receive, &objects(&[8, 8])).unwrap();
        let ids: Vec<_> = pdos.iter().map(|pdo| (pdo.number, pdo.id)).collect();
        assert_eq!(ids, [(0x41, Some(Id::Standard(0x27E))), (0x42, Some(Id::Standard(0x37E)))]);
        let (pdos, _) = second.spread(Direction::Transmit, &objects(&[8])).unwrap();
        assert_eq!(pdos[0].id, Some(Id::Standard(0x1FE)));
        let third = AxisPdos::new(2, 1, &mut spare).unwrap();
        assert_eq!(third.ids.unwrap()[1][3], Id::Standard(0x4FD));
        assert_eq!((second.first, third.first), (0x41, 0x81));
    }
}
