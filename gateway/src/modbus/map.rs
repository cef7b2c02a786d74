//! The register map: which register holds what.
//!
//! `docs/modbus.md` holds the same tables; a test compares them. Numbers of more than one register begin with
//! the most significant one. Registers that are not in the table read 0.

use profile_cip::device::visualization::{self, Indication};

use crate::config::AXES_MAX;
use crate::status::{AxisStatus, BoxStatus, mode_code, state_code};

/// Number of this map, in register 0. It changes when a register gets another meaning, not when one is added.
pub const MAP_VERSION: u16 = 1;

/// Registers of the gateway, and of each axis.
pub const BLOCK_LEN: u16 = 64;

/// Address of the first axis block.
pub const AXES_ADDRESS: u16 = BLOCK_LEN;

/// Registers of the map: the block of the gateway and those of all axes that a box can have, configured or not.
pub const MAP_LEN: u16 = AXES_ADDRESS + BLOCK_LEN * AXES;

const AXES: u16 = 64;
const _: () = assert!(AXES as usize == AXES_MAX);

/// The most registers one request can ask for (Modbus application protocol 1.1b3, 6.3 and 6.4).
pub const COUNT_MAX: u16 = 125;

/// Size and sign of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// One register.
    U16,
    /// Two registers.
    U32,
    /// Two registers, two's complement.
    I32,
    /// Four registers.
    U64,
    /// Four registers, two's complement.
    I64,
}

impl Kind {
    /// Registers it takes.
    #[must_use]
    pub const fn registers(self) -> u16 {
        match self {
            Self::U16 => 1,
            Self::U32 | Self::I32 => 2,
            Self::U64 | Self::I64 => 4,
        }
    }

    /// Its name in the documentation.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::U16 => "u16",
            Self::U32 => "u32",
            Self::I32 => "i32",
            Self::U64 => "u64",
            Self::I64 => "i64",
        }
    }
}

/// A row of a block: where a value is and what it says.
#[derive(Debug, Clone, Copy)]
pub struct Entry<S> {
    /// First register, from the start of the block.
    pub offset: u16,
    /// Size and sign.
    pub kind: Kind,
    /// Name, in snake case.
    pub name: &'static str,
    /// Unit and meaning.
    pub meaning: &'static str,
    /// The value, sign-extended to 64 bits.
    value: fn(&S) -> u64,
}

const fn entry<S>(
    offset: u16,
    kind: Kind,
    name: &'static str,
    meaning: &'static str,
    value: fn(&S) -> u64,
) -> Entry<S> {
    Entry { offset, kind, name, meaning, value }
}

/// The block of the gateway.
pub const BOX: &[Entry<BoxStatus>] = &[
    entry(0, Kind::U16, "map_version", "number of this map: 1", |_| u64::from(MAP_VERSION)),
    entry(
        1,
        Kind::U16,
        "state",
        "0 starting, 1 phase up, 2 ready, 3 running, 4 bus lost, 5 stopping",
        |status| u64::from(status.state.0),
    ),
    entry(2, Kind::U16, "sercos_phase", "communication phase 0 to 4; 255 none", |status| {
        u64::from(status.phase)
    }),
    entry(3, Kind::U16, "axis_count", "configured axes", |status| u64::from(status.axis_count)),
    entry(4, Kind::U16, "connections", "open CIP Motion connections, and owners of assemblies", |status| {
        u64::from(status.connections)
    }),
    entry(5, Kind::U16, "axes_address", "address of the first axis block: 64", |_| u64::from(AXES_ADDRESS)),
    entry(6, Kind::U16, "block_length", "registers of an axis block: 64", |_| u64::from(BLOCK_LEN)),
    entry(8, Kind::U32, "uptime", "seconds since the gateway started", |status| {
        (status.uptime.0.max(0) / 1_000_000_000).cast_unsigned()
    }),
    entry(10, Kind::U32, "cycle_time", "bus cycle in nanoseconds", |status| u64::from(status.cycle_time_ns)),
    entry(
        12,
        Kind::U32,
        "lateness_max",
        "latest start of a cycle after its time, in nanoseconds",
        |status| u64::from(status.lateness_max_ns),
    ),
    entry(16, Kind::U64, "cycles", "cycles run", |status| status.counters.cycles),
    entry(20, Kind::U64, "late_cycles", "cycles that began more than half a cycle late", |status| {
        status.counters.late_cycles
    }),
    entry(24, Kind::U64, "lost_updates", "controller updates that did not come or came too late", |status| {
        status.counters.lost_updates
    }),
    entry(28, Kind::U64, "lost_telegrams", "bus cycles without the data of a drive", |status| {
        status.counters.lost_telegrams
    }),
    entry(32, Kind::U64, "refused_frames", "malformed or foreign frames and datagrams", |status| {
        status.counters.refused_frames
    }),
    entry(36, Kind::U64, "send_failures", "frames and datagrams that could not be sent", |status| {
        status.counters.send_failures
    }),
    entry(
        40,
        Kind::U16,
        "phase_lock",
        "cycles of the buses: 0 free of system time, 1 pulled to it, 2 locked; the least of all",
        |status| u64::from(status.phase_lock.state.code()),
    ),
    entry(
        42,
        Kind::I32,
        "phase_error",
        "latest cycle after its instant of system time, in nanoseconds; the largest of all",
        |status| status.phase_lock.error.0.cast_unsigned(),
    ),
];

/// The block of an axis.
pub const AXIS: &[Entry<AxisStatus>] = &[
    entry(0, Kind::U16, "instance", "instance number in its device; 0: no such axis", |axis| {
        u64::from(axis.instance)
    }),
    entry(1, Kind::U16, "device", "number of its device in the configuration, from 0", |axis| {
        u64::from(axis.device)
    }),
    entry(
        2,
        Kind::U16,
        "state",
        "0 not ready, 1 inhibited, 2 awaiting power, 3 ready, 4 starting, 5 operating, 6 testing, 7 stopping, 8 fault reaction, 9 faulted, 10 shutdown",
        |axis| u64::from(state_code(axis.state)),
    ),
    entry(3, Kind::U16, "cip_axis_state", "Axis State of the Motion Device Axis Object", |axis| {
        u64::from(axis.cip_axis_state)
    }),
    entry(
        4,
        Kind::U16,
        "mode",
        "0 none, 1 position, 2 velocity, 3 acceleration, 4 torque, 5 homing",
        |axis| u64::from(mode_code(axis.mode)),
    ),
    entry(5, Kind::U16, "fault_cause", "generic fault cause; 0 none", |axis| {
        axis.fault.map_or(0, |cause| u64::from(cause.0))
    }),
    entry(6, Kind::U32, "fault_vendor_code", "the drive's own code for the fault; 0 none", |axis| {
        u64::from(axis.fault_vendor_code)
    }),
    entry(8, Kind::U32, "status", "status bits of the generic drive model", |axis| {
        u64::from(axis.status.bits())
    }),
    entry(10, Kind::U32, "inhibits", "what keeps the axis from being enabled, as bits", |axis| {
        u64::from(axis.inhibits.bits())
    }),
    entry(12, Kind::I64, "position", "actual position in 1e-9 revolution or millimetre", |axis| {
        axis.position.0.cast_unsigned()
    }),
    entry(16, Kind::I32, "position_counts", "actual position in counts of the controller", |axis| {
        i64::from(axis.position_counts).cast_unsigned()
    }),
    entry(18, Kind::U32, "faults", "faults that have occurred", |axis| u64::from(axis.faults)),
    entry(20, Kind::I64, "velocity", "actual velocity in 1e-9 revolution or millimetre per second", |axis| {
        axis.velocity.0.cast_unsigned()
    }),
    entry(24, Kind::I64, "torque", "actual torque or force in 1e-6 of the rated one", |axis| {
        axis.torque.0.cast_unsigned()
    }),
    entry(
        28,
        Kind::I64,
        "following_error",
        "commanded less actual position in 1e-9 revolution or millimetre",
        |axis| axis.following_error.0.cast_unsigned(),
    ),
    entry(32, Kind::U64, "commands", "commands taken over from the controller", |axis| axis.commands),
    entry(36, Kind::U32, "lost_updates", "controller updates lost or late", |axis| {
        u64::from(axis.lost_updates)
    }),
    entry(38, Kind::U32, "lost_telegrams", "bus cycles without fresh data of the drive", |axis| {
        u64::from(axis.lost_telegrams)
    }),
    entry(40, Kind::U32, "saturated", "values clamped on their way", |axis| u64::from(axis.saturated)),
    entry(42, Kind::U16, "module_status", "Module Status LED of the device, an indication", |axis| {
        lamp(axis, visualization::module_status(axis.indicators.module))
    }),
    entry(43, Kind::U16, "network_status", "Network Status LED of the device, an indication", |axis| {
        lamp(axis, axis.indicators.network)
    }),
    entry(44, Kind::U16, "axis_status", "Axis Status LED, an indication", |axis| {
        lamp(axis, axis.indicators.axis)
    }),
    entry(45, Kind::U16, "display_text", "string of the alphanumeric display", |axis| {
        u64::from(axis.indicators.line.text.0)
    }),
    entry(46, Kind::U16, "display_code", "code behind the string; 0 where it has none", |axis| {
        u64::from(axis.indicators.line.code)
    }),
    entry(
        48,
        Kind::U64,
        "display_1",
        "the display's characters 1 to 8, two in a register, ASCII, then 0",
        |axis| characters(axis, 0),
    ),
    entry(52, Kind::U64, "display_2", "the display's characters 9 to 16", |axis| characters(axis, 8)),
    entry(
        56,
        Kind::U16,
        "waits_for",
        "what the axis has waited for longer than a second; 0 nothing",
        |axis| axis.wait.map_or(0, |wait| u64::from(wait.waiting.awaited.code())),
    ),
    entry(57, Kind::U16, "waits_word", "status word of the drive while the axis waits", |axis| {
        axis.wait.map_or(0, |wait| u64::from(wait.word()))
    }),
    entry(58, Kind::U16, "waits_mask", "bits of the word that keep the axis waiting", |axis| {
        axis.wait.map_or(0, |wait| u64::from(wait.mask()))
    }),
    entry(59, Kind::U16, "waits_value", "what these bits have to be", |axis| {
        axis.wait.map_or(0, |wait| u64::from(wait.value()))
    }),
    entry(60, Kind::U32, "waits_time", "seconds since the wait began", |axis| {
        axis.wait.map_or(0, |wait| u64::from(wait.seconds))
    }),
    entry(
        62,
        Kind::U32,
        "waits_item",
        "number of the word: IDN, index x 256 + sub-index, or class x 65536 + attribute",
        |axis| axis.wait.map_or(0, |wait| u64::from(wait.item())),
    ),
];

/// A lamp of an axis that is there.
fn lamp(axis: &AxisStatus, indication: Indication) -> u64 {
    if axis.instance == 0 { 0 } else { u64::from(indication.0) }
}

/// Eight characters of the display from `start` on.
fn characters(axis: &AxisStatus, start: usize) -> u64 {
    let display = axis.display();
    let mut octets = [0; 8];
    for (place, octet) in octets.iter_mut().zip(display.as_bytes().iter().skip(start)) {
        *place = *octet;
    }
    u64::from_be_bytes(octets)
}

/// Registers that do not exist.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// Beyond the map.
    Address,
    /// None, or more than one request can carry.
    Count,
}

/// The registers `address .. address + count` of a status.
///
/// # Errors
/// [`Refusal`] when they are not all in the map or are too many.
pub fn registers(status: &BoxStatus, address: u16, count: u16) -> Result<Vec<u16>, Refusal> {
    if !(1..=COUNT_MAX).contains(&count) {
        return Err(Refusal::Count);
    }
    if address >= MAP_LEN || count > MAP_LEN - address {
        return Err(Refusal::Address);
    }
    // Only the blocks that are asked for are laid out: a request touches three of them at most.
    let (first, last) = (address / BLOCK_LEN, (address + count - 1) / BLOCK_LEN);
    let mut image = vec![0; usize::from((last - first + 1) * BLOCK_LEN)];
    for (number, block) in (first..).zip(image.chunks_exact_mut(usize::from(BLOCK_LEN))) {
        let axis = number.checked_sub(1).map(|axis| status.configured_axes().get(usize::from(axis)));
        match axis {
            None => fill(block, BOX, status),
            Some(Some(axis)) => fill(block, AXIS, axis),
            Some(None) => {}
        }
    }
    let start = usize::from(address - first * BLOCK_LEN);
    Ok(image[start..start + usize::from(count)].to_vec())
}

fn fill<S>(block: &mut [u16], entries: &[Entry<S>], source: &S) {
    for entry in entries {
        let [a, b, c, d, e, f, g, h] = (entry.value)(source).to_be_bytes();
        let words = [[a, b], [c, d], [e, f], [g, h]].map(u16::from_be_bytes);
        let registers = usize::from(entry.kind.registers());
        let start = usize::from(entry.offset);
        block[start..start + registers].copy_from_slice(&words[words.len() - registers..]);
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use profile_cip::device::visualization::display::LineText;
    use profile_generic::fault::FaultCause;
    use profile_generic::image::StatusBits;
    use profile_generic::inhibit::Inhibits;

    use super::*;
    use crate::engine::axis::Awaited;
    use crate::status::tests::distinct;

    /// A block as a table of the documentation.
    fn block<S>(entries: &[Entry<S>]) -> String {
        let mut text = "| register | type | name | meaning |\n|---|---|---|---|\n".to_owned();
        for entry in entries {
            let Entry { offset, name, meaning, .. } = entry;
            writeln!(text, "| {offset} | {} | `{name}` | {meaning} |", entry.kind.name()).unwrap();
        }
        text
    }

    /// Values and their names as a table of the documentation.
    fn names<'a>(head: &str, rows: impl Iterator<Item = (String, &'a str)>) -> String {
        let mut text = format!("| {head} | name |\n|---|---|\n");
        for (value, name) in rows {
            writeln!(text, "| {value} | {} |", name.replace('_', " ")).unwrap();
        }
        text
    }

    fn tables() -> [String; 8] {
        [
            block(BOX),
            block(AXIS),
            names(
                "fault_cause",
                FaultCause::NAMED.iter().map(|(code, name)| (format!("{:#06x}", code.0), *name)),
            ),
            names("status bit", bits(StatusBits::NAMED.iter().map(|(bit, name)| (bit.bits(), *name)))),
            names("inhibits bit", bits(Inhibits::NAMED.iter().map(|(bit, name)| (bit.bits(), *name)))),
            names(
                "indication",
                Indication::NAMED.iter().map(|(indication, name)| (indication.0.to_string(), *name)),
            ),
            names("display_text", LineText::NAMED.iter().map(|(text, name)| (text.0.to_string(), *name))),
            names(
                "waits_for",
                Awaited::ALL.iter().map(|awaited| (awaited.code().to_string(), awaited.name())),
            ),
        ]
    }

    fn bits<'a>(rows: impl Iterator<Item = (u32, &'a str)>) -> impl Iterator<Item = (String, &'a str)> {
        rows.map(|(bit, name)| (bit.trailing_zeros().to_string(), name))
    }

    fn assert_layout<S>(entries: &[Entry<S>]) {
        let mut free = 0;
        for entry in entries {
            assert!(entry.offset >= free, "{} overlaps", entry.name);
            assert_eq!(entry.offset % entry.kind.registers().min(2), 0, "{} is unaligned", entry.name);
            free = entry.offset + entry.kind.registers();
        }
        assert!(free <= BLOCK_LEN);
    }

    #[test]
    fn values_lie_one_after_the_other_within_their_block() {
        assert_layout(BOX);
        assert_layout(AXIS);
        assert_eq!(MAP_LEN, 4160);
    }

    #[test]
    fn the_documentation_has_the_same_tables() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/modbus.md");
        let page = std::fs::read_to_string(path).unwrap();
        for table in tables() {
            assert!(page.contains(&table), "docs/modbus.md lacks this table:\n{table}");
        }
    }

    #[test]
    fn every_value_is_where_the_map_says() {
        let status = distinct();
        let of_box = registers(&status, 0, 64).unwrap();
        let expected_box: &[(usize, &[u16])] = &[
            (0, &[1, 3, 4, 2, 2, 64, 64, 0]),
            (8, &[0, 987]),
            (10, &[0x001E, 0x8480]),
            (12, &[1, 0xE240]),
            (16, &[0x0102, 0x0304, 0x0506, 0x0708]),
            (20, &[0, 0, 0, 11, 0, 0, 0, 12, 0, 0, 0, 13, 0, 0, 0, 14, 0, 0, 0, 15]),
            // Locked, -789
            (40, &[2, 0, 0xFFFF, 0xFCEB]),
        ];
        for (at, values) in expected_box {
            assert_eq!(&of_box[*at..at + values.len()], *values, "register {at}");
        }
        assert_eq!(of_box[44..], [0; 20]);

        let first = registers(&status, 64, 64).unwrap();
        let expected: &[(usize, &[u16])] = &[
            (0, &[1, 0, 5, 4, 1, 0, 0, 0]),
            (8, &[0, 0x0009, 0, 0]),
            // -1234567890123, -1234567
            (12, &[0xFFFF, 0xFEE0, 0x8E04, 0xFB35, 0xFFED, 0x2979]),
            (18, &[0x0BBB, 0x0CCC]),
            // -2500000000, -333333, 77
            (20, &[0xFFFF, 0xFFFF, 0x6AFD, 0x0700, 0xFFFF, 0xFFFF, 0xFFFA, 0xE9EB, 0, 0, 0, 77]),
            (32, &[0x1111, 0x2222, 0x3333, 0x4444, 0x5555, 0x6666, 0x7777, 0x8888, 0x0999, 0x0AAA]),
        ];
        for (at, values) in expected {
            assert_eq!(&first[*at..at + values.len()], *values, "register {at}");
        }
        // Flashing red, solid green, red-green, RUNNING without a code, "X1:RUNNING".
        assert_eq!(first[42..48], [4, 2, 7, 11, 0, 0]);
        assert_eq!(first[48..53], [0x5831, 0x3A52, 0x554E, 0x4E49, 0x4E47]);
        assert_eq!(first[53..], [0; 11]);
        let second = registers(&status, 128, 18).unwrap();
        assert_eq!(second[..12], [200, 1, 9, 8, 5, 0x0905, 0xC30A, 0x0040, 0, 0, 0, 1]);
        assert_eq!(second[16..], [0x7FFF, 0xFFFF]);
        let shown = registers(&status, 128 + 42, 14).unwrap();
        // Solid red, off, solid red, INIT FLT with code 12, "INIT FLT S12".
        assert_eq!(shown[..6], [5, 0, 5, 15, 12, 0]);
        assert_eq!(shown[6..], [0x494E, 0x4954, 0x2046, 0x4C54, 0x2053, 0x3132, 0, 0]);
        // Waits for its drive to follow: bit 12 has to be 1 and bit 6 to be 0 in object 6041:00.
        let waits = registers(&status, 128 + 56, 8).unwrap();
        assert_eq!(waits, [5, 0x0237, 0x1040, 0x1000, 0x0001, 0x0002, 0x0060, 0x4100]);
        assert_eq!(registers(&status, 192, 64).unwrap(), [0; 64]);
    }

    #[test]
    fn the_blocks_of_64_axes_lie_one_after_the_other() {
        let mut status = distinct();
        status.axis_count = 64;
        for (place, axis) in (0..).zip(&mut status.axes) {
            *axis = AxisStatus { instance: place % 16 + 1, device: place / 16, ..AxisStatus::NONE };
            axis.position_counts = 1000 + i32::from(place);
        }
        for place in 0..64_u16 {
            let block = AXES_ADDRESS + BLOCK_LEN * place;
            assert_eq!(registers(&status, block, 2).unwrap(), [place % 16 + 1, place / 16], "axis {place}");
            assert_eq!(registers(&status, block + 16, 2).unwrap(), [0, 1000 + place], "axis {place}");
        }
        // The last register of one block and the first of the next, and all of two blocks but their ends.
        assert_eq!(registers(&status, 64 + 64 * 17 - 1, 2).unwrap(), [0, 2]);
        let two = registers(&status, 64 + 64 * 62 + 1, 125).unwrap();
        assert_eq!((two[0], two[16], two[63], two[64], two[80]), (3, 1062, 16, 3, 1063));
    }

    #[test]
    fn registers_outside_the_map_are_refused() {
        let status = distinct();
        assert_eq!(registers(&status, 4159, 1).unwrap(), [0]);
        assert_eq!(registers(&status, 4159, 2), Err(Refusal::Address));
        assert_eq!(registers(&status, 4160, 1), Err(Refusal::Address));
        assert_eq!(registers(&status, 65_535, 125), Err(Refusal::Address));
        assert_eq!(registers(&status, 0, 0), Err(Refusal::Count));
        assert_eq!(registers(&status, 0, 126), Err(Refusal::Count));
        assert_eq!(registers(&status, 0, 125).unwrap().len(), 125);
    }
}
