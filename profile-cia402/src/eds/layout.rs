//! Choosing PDOs for the objects that a master wants to exchange.
//!
//! A master writes its own mapping wherever a device lets it: PDOs whose mapping can be changed are filled in the order of the
//! wishes, what must be there before what may be, each axis for itself, so that what belongs together (controlword and set-point
//! of an axis) travels together. What finds no place there, and everything on devices with fixed mappings, is looked for in the
//! PDOs as they are.

use core::fmt;

use super::data_type::DataType;
use super::description::DeviceDescription;
use super::drive::{AXES_MAX, AXIS_STEP, Direction, MappingEntry, Pdo};

/// Bits of a classic PDO.
const BITS_MAX: u32 = 64;

/// The first object of the drive profile.
const PROFILE_START: u16 = 0x6000;

/// Objects below this number are data types, which stand for gaps.
const DUMMIES_END: u16 = 0x20;

/// How many PDOs a device with several axes keeps for each: those of axis n begin at 64 * n.
const AXIS_PDOS: u16 = 64;

/// An object that is to be exchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Wanted {
    /// The object.
    pub index: u16,
    /// The sub-object.
    pub sub: u8,
    /// Whether there is no use without it.
    pub must: bool,
}

impl Wanted {
    /// An object without which there is no use.
    #[must_use]
    pub const fn must(index: u16, sub: u8) -> Self {
        Self { index, sub, must: true }
    }

    /// An object that is of use if there is room.
    #[must_use]
    pub const fn may(index: u16, sub: u8) -> Self {
        Self { index, sub, must: false }
    }
}

impl fmt::Display for Wanted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04X}:{:X}", self.index, self.sub)
    }
}

/// A PDO that is used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PdoLayout {
    /// From the view of the device.
    pub direction: Direction,
    /// Its number, from 0.
    pub number: u16,
    /// Its identifier: that of the description, or of the default connection set. `None`: one has to be given to it.
    pub cob_id: Option<u32>,
    /// What it carries.
    pub entries: Vec<MappingEntry>,
    /// Whether the mapping has to be written; a fixed one is taken as it is, with what nobody wants in it.
    pub write_mapping: bool,
}

impl PdoLayout {
    /// Bytes of its frame.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.entries.iter().map(|entry| usize::from(entry.bits)).sum::<usize>().div_ceil(8)
    }
}

/// Why an object is left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Reason {
    /// The device does not have it.
    #[error("the device does not have it")]
    NotThere,
    /// No PDO of this direction can carry it.
    #[error("{0}s cannot carry it")]
    NotMappable(Direction),
    /// Nobody knows its length.
    #[error("its type {0:?} has no length of its own")]
    NoLength(DataType),
    /// There is no PDO with room for it.
    #[error("no PDO has room for its {0} bits")]
    NoRoom(u8),
}

/// An object that is left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LeftOut {
    /// The direction it was wanted in.
    pub direction: Direction,
    /// The object.
    pub wanted: Wanted,
    /// Why.
    pub reason: Reason,
}

impl fmt::Display for LeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} in {}s: {}", self.wanted, self.direction, self.reason)
    }
}

/// Which PDOs carry what.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Layout {
    /// PDOs that are used, RPDOs first, by number.
    pub pdos: Vec<PdoLayout>,
    /// PDOs that are switched on after a reset and carry nothing that is wanted: they are to be switched off.
    pub unused: Vec<(Direction, u16)>,
    /// What is left out.
    pub left_out: Vec<LeftOut>,
}

impl Layout {
    /// Whether everything is there without which there is no use.
    #[must_use]
    pub fn is_usable(&self) -> bool {
        !self.left_out.iter().any(|left| left.wanted.must)
    }

    /// The PDO of a direction that carries an object, and at which bit.
    #[must_use]
    pub fn find(&self, direction: Direction, index: u16, sub: u8) -> Option<(&PdoLayout, u32)> {
        self.pdos.iter().filter(|pdo| pdo.direction == direction).find_map(|pdo| {
            let at = pdo.entries.iter().position(|entry| (entry.index, entry.sub) == (index, sub))?;
            let before = pdo.entries.iter().take(at).map(|entry| u32::from(entry.bits)).sum();
            Some((pdo, before))
        })
    }
}

/// Chooses PDOs of a node for objects to be received by it and transmitted by it.
#[must_use]
pub fn derive(description: &DeviceDescription, node: u8, receive: &[Wanted], transmit: &[Wanted]) -> Layout {
    let mut layout = Layout::default();
    for (direction, wanted) in [(Direction::Receive, receive), (Direction::Transmit, transmit)] {
        let pdos = description.pdos(direction, node);
        let mut planner = Planner { pdos: &pdos, node, direction, open: Vec::new() };
        // What must be there comes first, so that nothing that may be there takes its place.
        for must in [true, false] {
            let mut rest: Vec<(Wanted, MappingEntry)> = Vec::new();
            for &wanted in wanted.iter().filter(|wanted| wanted.must == must) {
                match entry(description, direction, wanted) {
                    Ok(entry) if planner.carries(entry) || planner.place(entry) => {}
                    Ok(entry) => rest.push((wanted, entry)),
                    Err(reason) => layout.left_out.push(LeftOut { direction, wanted, reason }),
                }
            }
            planner.take_fixed(&mut rest, must);
            layout.left_out.extend(rest.iter().map(|(wanted, entry)| {
                let reason = Reason::NoRoom(entry.bits);
                LeftOut { direction, wanted: *wanted, reason }
            }));
        }
        planner.finish(&mut layout);
    }
    layout
}

/// The entry that an object makes in a mapping.
fn entry(
    description: &DeviceDescription,
    direction: Direction,
    wanted: Wanted,
) -> Result<MappingEntry, Reason> {
    let value = description.sub(wanted.index, wanted.sub).ok_or(Reason::NotThere)?;
    let allowed = match direction {
        Direction::Receive => value.access.receives(),
        Direction::Transmit => value.access.transmits(),
    };
    if !value.pdo_mapping || !allowed {
        return Err(Reason::NotMappable(direction));
    }
    let bits = value.data_type.bits().ok_or(Reason::NoLength(value.data_type))?;
    // Drives map whole bytes.
    Ok(MappingEntry { index: wanted.index, sub: wanted.sub, bits: bits.next_multiple_of(8) })
}

/// Whether a PDO is there or can be switched on.
const fn usable(pdo: &Pdo) -> bool {
    pdo.valid || pdo.cob_id_writable
}

/// The axis that an object belongs to.
fn axis(index: u16) -> u16 {
    index.checked_sub(PROFILE_START).map_or(0, |above| above / AXIS_STEP).min(AXES_MAX)
}

/// The PDOs of one direction as they are taken.
struct Planner<'p> {
    pdos: &'p [Pdo],
    node: u8,
    direction: Direction,
    /// Those that are used, each with the axis it was opened for.
    open: Vec<(u16, PdoLayout)>,
}

impl Planner<'_> {
    fn carries(&self, entry: MappingEntry) -> bool {
        self.open.iter().any(|(_, pdo)| pdo.entries.contains(&entry))
    }

    fn is_open(&self, pdo: &Pdo) -> bool {
        self.open.iter().any(|(_, open)| open.number == pdo.number)
    }

    /// Puts an entry into a PDO whose mapping is written: one of its axis, a new one, one of another axis. Whether there is
    /// one.
    fn place(&mut self, entry: MappingEntry) -> bool {
        let own = axis(entry.index);
        let room = |(of, open): &&mut (u16, PdoLayout), same: bool| {
            let most =
                self.pdos.iter().find(|pdo| pdo.number == open.number).map_or(0, |pdo| pdo.entries_max);
            let bits: u32 = open.entries.iter().map(|entry| u32::from(entry.bits)).sum();
            let fits = bits + u32::from(entry.bits) <= BITS_MAX && open.entries.len() < usize::from(most);
            open.write_mapping && fits && (*of == own) == same
        };
        if let Some((_, pdo)) = self.open.iter_mut().find(|open| room(open, true)) {
            pdo.entries.push(entry);
            return true;
        }
        let free = |pdo: &&Pdo| {
            usable(pdo) && pdo.is_changeable() && !self.open.iter().any(|(_, open)| open.number == pdo.number)
        };
        // Devices with several axes have the PDOs of each in a block of their own.
        let of_block = self.pdos.iter().filter(free).find(|pdo| pdo.number / AXIS_PDOS == own);
        if let Some(pdo) = of_block.or_else(|| self.pdos.iter().find(free)) {
            self.open.push((own, opened(pdo, self.node, vec![entry], true)));
            return true;
        }
        let other = self.open.iter_mut().find(|open| room(open, false));
        other.map(|(_, pdo)| pdo.entries.push(entry)).is_some()
    }

    /// Looks for what is left in PDOs as they are: always in the one with the most of it.
    ///
    /// An RPDO brings everything that is in it. For what must be there that is taken; for what only may be there no RPDO is taken
    /// that also has what nobody wants, or what another one brings already.
    fn take_fixed(&mut self, rest: &mut Vec<(Wanted, MappingEntry)>, must: bool) {
        while !rest.is_empty() {
            let good = |pdo: &Pdo| {
                let wanted = |entry: &MappingEntry| rest.iter().any(|(_, wanted)| wanted == entry);
                must || self.direction == Direction::Transmit
                    || pdo
                        .mapping
                        .iter()
                        .all(|entry| entry.index < DUMMIES_END || wanted(entry) && !self.carries(*entry))
            };
            let free = self.pdos.iter().filter(|pdo| usable(pdo) && !self.is_open(pdo) && good(pdo));
            let count = |pdo: &Pdo| rest.iter().filter(|(_, entry)| pdo.mapping.contains(entry)).count();
            // The lowest number of those that carry as much.
            let best = free.map(|pdo| (count(pdo), pdo)).filter(|(count, _)| *count > 0);
            let best = best.fold(None, |best: Option<(usize, &Pdo)>, next| match best {
                Some((count, _)) if count >= next.0 => best,
                _ => Some(next),
            });
            let Some((_, pdo)) = best else { return };
            rest.retain(|(_, entry)| !pdo.mapping.contains(entry));
            self.open.push((0, opened(pdo, self.node, pdo.mapping.clone(), false)));
        }
    }

    fn finish(mut self, layout: &mut Layout) {
        self.open.sort_by_key(|(_, pdo)| pdo.number);
        let idle = self.pdos.iter().filter(|pdo| pdo.valid && !self.is_open(pdo));
        layout.unused.extend(idle.map(|pdo| (self.direction, pdo.number)));
        layout.pdos.extend(self.open.into_iter().map(|(_, pdo)| pdo));
    }
}

fn opened(pdo: &Pdo, node: u8, entries: Vec<MappingEntry>, write_mapping: bool) -> PdoLayout {
    PdoLayout {
        direction: pdo.direction,
        number: pdo.number,
        cob_id: pdo.cob_id.or_else(|| pdo.direction.default_cob_id(pdo.number, node)),
        entries,
        write_mapping,
    }
}
