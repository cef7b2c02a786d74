//! What is in the dictionary of a drive at delivery.

use super::dictionary::{Access, Dictionary, Entry, Kind, Mappable};
use super::settings::{PdoDefault, Period, Settings};

use Access::{Const, Ro, Rw};
use Kind::{I8, I16, I32, U8, U16, U32};
use Mappable::{Both, No, Rx, Tx};

fn number(od: &mut Dictionary, index: u16, sub: u8, kind: Kind, access: Access, map: Mappable, value: i64) {
    let data = kind.width().map_or(Vec::new(), |width| value.to_le_bytes()[..width].to_vec());
    od.put(index, sub, Entry { kind, data, access, map, limits: None });
}

fn text(od: &mut Dictionary, index: u16, value: &str) {
    let data = value.as_bytes().to_vec();
    od.put(index, 0, Entry { kind: Kind::Text, data, access: Const, map: No, limits: None });
}

/// Fills in everything the settings ask for.
pub fn fill(od: &mut Dictionary, s: &Settings) {
    communication(od, s);
    pdos(od, s);
    for &(index, sub, kind, access, map, value) in DRIVE {
        number(od, index, sub, kind, access, map, value);
    }
    let counts = i64::from(s.counts_per_turn);
    od.set(0x605A, 0, i64::from(s.quick_stop_option));
    od.set(0x6060, 0, i64::from(s.mode_at_start));
    od.set(0x6061, 0, i64::from(s.mode_at_start));
    od.set(0x6502, 0, i64::from(s.mode_bits()));
    od.set(0x608F, 1, counts);
    od.set(0x6080, 0, s.max_velocity * 60 / counts.max(1));
    od.set(0x67FF, 0, i64::from(s.device_type));
    let unit = |counts: i64, (num, den): (i64, i64)| counts * den / num.max(1);
    od.set(0x607F, 0, unit(s.max_velocity, s.velocity_unit));
    od.set(0x6081, 0, unit(s.max_velocity / 20, s.velocity_unit));
    for (index, part) in [(0x6083, 60), (0x6084, 60), (0x6085, 6)] {
        od.set(index, 0, unit(s.max_acceleration / part, s.acceleration_unit));
    }
    od.set(0x609A, 0, unit(s.max_acceleration / 60, s.acceleration_unit));
    od.set(0x6099, 1, unit(s.max_velocity / 50, s.velocity_unit));
    od.set(0x6099, 2, unit(s.max_velocity / 200, s.velocity_unit));
    od.set(0x6072, 0, s.torque_rated * 3);
    od.set(0x6087, 0, s.torque_rated * 10);
    match s.period {
        Period::Writable => {}
        Period::ReadOnly(value, exponent) => {
            number(od, 0x60C2, 1, U8, Ro, No, value.into());
            number(od, 0x60C2, 2, I8, Ro, No, exponent.into());
        }
        Period::Sticks(value, exponent) => {
            od.set(0x60C2, 1, value.into());
            od.set(0x60C2, 2, exponent.into());
        }
        Period::Absent => od.remove(0x60C2),
    }
    if s.guarding_only {
        od.remove(0x1017);
    }
    for (index, subs) in [
        (0x607D, 2),
        (0x608F, 2),
        (0x6091, 2),
        (0x6092, 2),
        (0x6099, 2),
        (0x60C1, 1),
        (0x60C2, 2),
        (0x60FE, 2),
    ] {
        if od.has(index, 1) {
            number(od, index, 0, U8, Const, No, subs);
        }
    }
}

fn communication(od: &mut Dictionary, s: &Settings) {
    let id = i64::from(s.node_id);
    number(od, 0x1000, 0, U32, Const, No, s.device_type.into());
    number(od, 0x1001, 0, U8, Ro, Tx, 0);
    number(od, 0x1003, 0, U8, Rw, No, 0);
    for sub in 1..=8 {
        number(od, 0x1003, sub, U32, Ro, No, 0);
    }
    number(od, 0x1005, 0, U32, Rw, No, 0x80);
    number(od, 0x1006, 0, U32, Rw, No, 0);
    number(od, 0x1007, 0, U32, Rw, No, 0);
    let [name, hardware, software] =
        if s.empty_text { ["", "", ""] } else { [s.name.as_str(), "H1", "1.02.3"] };
    text(od, 0x1008, name);
    text(od, 0x1009, hardware);
    text(od, 0x100A, software);
    number(od, 0x100C, 0, U16, Rw, No, 0);
    number(od, 0x100D, 0, U8, Rw, No, 0);
    for index in [0x1010, 0x1011] {
        number(od, index, 0, U8, Const, No, 1);
        number(od, index, 1, U32, Rw, No, 1);
    }
    number(od, 0x1014, 0, U32, Rw, No, 0x80 + id);
    number(od, 0x1015, 0, U16, Rw, No, 0);
    number(od, 0x1016, 0, U8, Const, No, 1);
    number(od, 0x1016, 1, U32, Rw, No, 0);
    number(od, 0x1017, 0, U16, Rw, No, s.heartbeat_ms.into());
    number(od, 0x1018, 0, U8, Const, No, 4);
    for (sub, value) in [(1, s.vendor), (2, s.product), (3, s.revision), (4, s.serial)] {
        number(od, 0x1018, sub, U32, Const, No, value.into());
    }
    number(od, 0x1019, 0, U8, Rw, No, 0);
    number(od, 0x1020, 0, U8, Const, No, 2);
    number(od, 0x1020, 1, U32, Rw, No, 0);
    number(od, 0x1020, 2, U32, Rw, No, 0);
    number(od, 0x1029, 0, U8, Const, No, 1);
    number(od, 0x1029, 1, U8, Rw, No, 0);
    number(od, 0x1200, 0, U8, Const, No, 2);
    number(od, 0x1200, 1, U32, Const, No, 0x600 + id);
    number(od, 0x1200, 2, U32, Const, No, 0x580 + id);
    // A command channel of a vendor.
    for index in [0x2301, 0x2303] {
        number(od, index, 0, U8, Const, No, 2);
        number(od, index, 1, U8, Rw, Both, 0);
        number(od, index, 2, I32, Rw, Both, 0);
    }
}

fn pdos(od: &mut Dictionary, s: &Settings) {
    let cob_access = if s.cob_id_fixed { Ro } else { Rw };
    let map_access = if s.mapping_fixed { Ro } else { Rw };
    for (first, first_map, list, transmit) in
        [(0x1400, 0x1600, &s.rpdos, false), (0x1800, 0x1A00, &s.tpdos, true)]
    {
        for ((index, at), pdo) in (first..).zip(first_map..).zip(list) {
            number(od, index, 0, U8, Const, No, if transmit { 6 } else { 5 });
            number(od, index, 1, U32, cob_access, No, cob_id(pdo, s.node_id));
            number(od, index, 2, U8, Rw, No, pdo.kind.into());
            number(od, index, 3, U16, Rw, No, pdo.inhibit.into());
            number(od, index, 5, U16, Rw, No, pdo.event_ms.into());
            if transmit {
                number(od, index, 6, U8, Rw, No, 0);
            }
            let map: Vec<u32> = pdo.map.iter().copied().filter(|entry| !gone(*entry, s)).collect();
            let count = i64::try_from(map.len()).unwrap_or(0);
            number(od, at, 0, U8, map_access, No, count);
            for (sub, entry) in
                (1..=s.max_entries.max(1)).zip(map.iter().copied().chain(std::iter::repeat(0)))
            {
                // The axis objects of the default maps move with the axis.
                let placed = od.place(super::dictionary::word(i64::from(entry >> 16)));
                let value = (i64::from(placed) << 16) | i64::from(entry & 0xFFFF);
                number(od, at, sub, U32, map_access, No, if entry == 0 { 0 } else { value });
            }
        }
    }
}

/// Whether the drive does not have the object of a mapping entry, or does not map it.
fn gone(entry: u32, s: &Settings) -> bool {
    let index = super::dictionary::word(i64::from(entry >> 16));
    let [_, sub, ..] = entry.to_le_bytes();
    let missing = |(at, part): &(u16, Option<u8>)| *at == index && part.is_none_or(|part| part == sub);
    s.missing.iter().any(missing) || s.not_mappable.contains(&index)
}

fn cob_id(pdo: &PdoDefault, node_id: u8) -> i64 {
    let id = if pdo.base == 0 { 0 } else { i64::from(pdo.base) + i64::from(node_id) };
    let invalid = if pdo.valid && pdo.base != 0 { 0 } else { 0x8000_0000 };
    id | invalid | if pdo.bit_30 { 0x4000_0000 } else { 0 }
}

/// Index, sub-index, type, access, mapping and value of the drive's own objects.
const DRIVE: &[(u16, u8, Kind, Access, Mappable, i64)] = &[
    (0x6007, 0, I16, Rw, No, 1),
    (0x603F, 0, U16, Ro, Tx, 0),
    (0x6040, 0, U16, Rw, Both, 0),
    (0x6041, 0, U16, Ro, Tx, 0),
    (0x605A, 0, I16, Rw, No, 2),
    (0x605B, 0, I16, Rw, No, 0),
    (0x605C, 0, I16, Rw, No, 1),
    (0x605D, 0, I16, Rw, No, 1),
    (0x605E, 0, I16, Rw, No, 2),
    (0x6060, 0, I8, Rw, Both, 0),
    (0x6061, 0, I8, Ro, Tx, 0),
    (0x6062, 0, I32, Ro, Tx, 0),
    (0x6064, 0, I32, Ro, Tx, 0),
    (0x6065, 0, U32, Rw, Both, 20_000),
    (0x6066, 0, U16, Rw, Both, 0),
    (0x6067, 0, U32, Rw, Both, 10),
    (0x6068, 0, U16, Rw, Both, 0),
    (0x6069, 0, I32, Ro, Tx, 0),
    (0x606B, 0, I32, Ro, Tx, 0),
    (0x606C, 0, I32, Ro, Tx, 0),
    (0x606D, 0, U16, Rw, Both, 100),
    (0x606E, 0, U16, Rw, Both, 0),
    (0x606F, 0, U16, Rw, Both, 10),
    (0x6070, 0, U16, Rw, Both, 0),
    (0x6071, 0, I16, Rw, Both, 0),
    (0x6072, 0, U16, Rw, Both, 3000),
    (0x6074, 0, I16, Ro, Tx, 0),
    (0x6075, 0, U32, Rw, No, 5000),
    (0x6076, 0, U32, Rw, No, 1200),
    (0x6077, 0, I16, Ro, Tx, 0),
    (0x6078, 0, I16, Ro, Tx, 0),
    (0x6079, 0, U32, Ro, Tx, 48_000),
    (0x607A, 0, I32, Rw, Both, 0),
    (0x607C, 0, I32, Rw, Both, 0),
    (0x607D, 1, I32, Rw, Both, 0),
    (0x607D, 2, I32, Rw, Both, 0),
    (0x607E, 0, U8, Rw, No, 0),
    (0x607F, 0, U32, Rw, Both, 0),
    (0x6080, 0, U32, Rw, Both, 0),
    (0x6081, 0, U32, Rw, Both, 0),
    (0x6082, 0, U32, Rw, Both, 0),
    (0x6083, 0, U32, Rw, Both, 0),
    (0x6084, 0, U32, Rw, Both, 0),
    (0x6085, 0, U32, Rw, Both, 0),
    (0x6086, 0, I16, Rw, Both, 0),
    (0x6087, 0, U32, Rw, Both, 0),
    (0x608F, 1, U32, Rw, No, 1),
    (0x608F, 2, U32, Rw, No, 1),
    (0x6091, 1, U32, Rw, No, 1),
    (0x6091, 2, U32, Rw, No, 1),
    (0x6092, 1, U32, Rw, No, 1),
    (0x6092, 2, U32, Rw, No, 1),
    (0x6098, 0, I8, Rw, Both, 35),
    (0x6099, 1, U32, Rw, Both, 0),
    (0x6099, 2, U32, Rw, Both, 0),
    (0x609A, 0, U32, Rw, Both, 0),
    (0x60A8, 0, U32, Rw, No, 0x00B5_0000),
    (0x60A9, 0, U32, Rw, No, 0x00B5_0300),
    (0x60B0, 0, I32, Rw, Rx, 0),
    (0x60B1, 0, I32, Rw, Rx, 0),
    (0x60B2, 0, I16, Rw, Rx, 0),
    (0x60C0, 0, I16, Rw, No, 0),
    (0x60C1, 1, I32, Rw, Rx, 0),
    (0x60C2, 1, U8, Rw, No, 1),
    (0x60C2, 2, I8, Rw, No, -3),
    (0x60C5, 0, U32, Rw, No, 0),
    (0x60C6, 0, U32, Rw, No, 0),
    (0x60F4, 0, I32, Ro, Tx, 0),
    (0x60FD, 0, U32, Ro, Tx, 0),
    (0x60FE, 1, U32, Rw, Both, 0),
    (0x60FE, 2, U32, Rw, No, 0),
    (0x60FF, 0, I32, Rw, Both, 0),
    (0x6502, 0, U32, Ro, No, 0),
    (0x67FF, 0, U32, Const, No, 0),
];
