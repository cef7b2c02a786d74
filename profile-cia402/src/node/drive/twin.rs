//! A simulated drive with the objects of a data sheet.
//!
//! The simulated drive goes on with its own objects. Those that the file lacks are hidden from clients, those that it has get its
//! type, access, limits, mapping and value, and what is only in the file keeps what is written to it. Some values the file does not
//! say, or gives as 0, with which no axis could move (accelerations, factors, windows): there the simulated drive's are kept, in
//! the units of the file. What a count is follows from the objects that the file has, as the standard has it.

use profile_generic::ratio::Ratio;

use crate::drive::index::*;
use crate::drive::modes::SupportedModes;
use crate::eds::{self, DeviceDescription, SubObject};
use crate::node::dictionary::{Access, DataType, Definition, Dictionary, Mapping, Object, Shape};
use crate::node::drive::scaling::{Scale, Scales};
use crate::wire::Mux;
use crate::wire::pdo::{Direction, SUB_COB_ID, SUB_TYPE};

/// Unit of velocities, which the simulated drive has no object for.
const VELOCITY_UNIT: u16 = 0x60A9;

/// PDOs that have identifiers by default.
const DEFAULT_PDOS: u16 = 4;

/// Bytes that a client may write into a text, and into octets or a domain, that has no content of that length.
const TEXT_LEN: usize = 64;
const DOMAIN_LEN: usize = 256;

/// What a value counts.
#[derive(Debug, Clone, Copy)]
enum Unit {
    Position,
    Velocity,
    Acceleration,
}

/// Values in user units with which an axis moves, and without which it does not: 0 is not taken from a file.
const VALUES: [(u16, u8, Unit); 14] = [
    (FOLLOWING_WINDOW, 0, Unit::Position),
    (POSITION_WINDOW, 0, Unit::Position),
    (VELOCITY_WINDOW, 0, Unit::Velocity),
    (VELOCITY_THRESHOLD, 0, Unit::Velocity),
    (MAX_PROFILE_VELOCITY, 0, Unit::Velocity),
    (PROFILE_VELOCITY, 0, Unit::Velocity),
    (PROFILE_ACCELERATION, 0, Unit::Acceleration),
    (PROFILE_DECELERATION, 0, Unit::Acceleration),
    (QUICK_STOP_DECELERATION, 0, Unit::Acceleration),
    (HOMING_ACCELERATION, 0, Unit::Acceleration),
    (MAX_ACCELERATION, 0, Unit::Acceleration),
    (MAX_DECELERATION, 0, Unit::Acceleration),
    (HOMING_SPEEDS, 1, Unit::Velocity),
    (HOMING_SPEEDS, 2, Unit::Velocity),
];

/// Modes, and the objects that a drive with them has.
const MODES_BY_OBJECTS: [(SupportedModes, &[u16]); 9] = [
    (SupportedModes::PROFILE_POSITION, &[TARGET_POSITION, PROFILE_VELOCITY]),
    (SupportedModes::VELOCITY, &[VL_TARGET_VELOCITY]),
    (SupportedModes::PROFILE_VELOCITY, &[TARGET_VELOCITY]),
    (SupportedModes::TORQUE, &[TARGET_TORQUE]),
    (SupportedModes::HOMING, &[HOMING_METHOD]),
    (SupportedModes::INTERPOLATED_POSITION, &[INTERPOLATION_DATA]),
    (SupportedModes::CYCLIC_POSITION, &[TARGET_POSITION, INTERPOLATION_PERIOD]),
    (SupportedModes::CYCLIC_VELOCITY, &[TARGET_VELOCITY, INTERPOLATION_PERIOD]),
    (SupportedModes::CYCLIC_TORQUE, &[TARGET_TORQUE, INTERPOLATION_PERIOD]),
];

/// The modes of an axis, from 0, of a node with this node-id.
pub(super) fn modes(sheet: &DeviceDescription, axis: u16, node: u8) -> SupportedModes {
    let offset = axis * AXIS_OFFSET;
    if let Some(said) = sheet.number(SUPPORTED_MODES + offset, 0, node).filter(|said| *said != 0) {
        return SupportedModes::from_bits_retain(said);
    }
    let has = |objects: &[u16]| objects.iter().all(|index| sheet.object(index + offset).is_some());
    let there = MODES_BY_OBJECTS.iter().filter(|(_, objects)| has(objects));
    there.fold(SupportedModes::empty(), |all, (mode, _)| all | *mode)
}

/// Makes the objects of a simulated drive with so many axes those of a data sheet.
pub(super) fn shape(dictionary: &mut Dictionary, sheet: &DeviceDescription, axes: usize) {
    // Objects of other manufacturers mean something else, and PDOs carry what the file says.
    let pdos = |index| {
        Direction::BOTH
            .iter()
            .any(|way| way.communication().contains(&index) || way.mapping().contains(&index))
    };
    dictionary.remove(|index| (0x2000..0x6000).contains(&index) || pdos(index));
    dictionary.hide_all();
    for object in &sheet.objects {
        for sub in &object.subs {
            value(dictionary, sheet, object.index, sub);
        }
        let shape = match object.kind {
            eds::ObjectKind::Array => Shape::Array,
            kind if kind.has_subs() => Shape::Record,
            _ => Shape::Variable,
        };
        if !object.subs.is_empty() {
            dictionary.add_object(Object { index: object.index, name: "", shape });
        }
    }
    for axis in (0..AXES_MAX).take(axes) {
        let axis = u16::from(axis);
        scale(dictionary, sheet, axis);
        // A drive that has the object has something in it, though the file does not say what.
        if let Some(handle) = dictionary.find(Mux::new(SUPPORTED_MODES + axis * AXIS_OFFSET, 0)) {
            dictionary.set_default(handle, i64::from(modes(sheet, axis, 0).bits()));
        }
    }
}

/// Makes a value of the file one of the dictionary.
fn value(dictionary: &mut Dictionary, sheet: &DeviceDescription, index: u16, sub: &SubObject) {
    let Some(data_type) = DataType::ALL.into_iter().find(|known| known.code() == sub.data_type.0) else {
        return;
    };
    let (mux, node) = (Mux::new(index, sub.sub), dictionary.node_number());
    let own = dictionary.find(mux);
    let before = own.map(|handle| *dictionary.entry(handle).definition());
    let said =
        sub.setting().and_then(|setting| Some((setting.value.to_bytes(sub.data_type)?, setting.plus_node)));
    if data_type.is_bytes() {
        let content = said.map(|(bytes, _)| bytes).unwrap_or_default();
        let room = if data_type == DataType::Text { TEXT_LEN } else { DOMAIN_LEN };
        let capacity = if sub.access.writes() { room.max(content.len()) } else { content.len() };
        let definition = Definition {
            bytes: (&[], capacity),
            is_volatile: true,
            ..definition(sheet, (index, node), sub, data_type, None)
        };
        match own {
            Some(handle) => dictionary.redefine(handle, definition),
            None => dictionary.add(mux, definition),
        }
        dictionary.fill_within(mux, &content, capacity);
        return;
    }
    let number = said.and_then(|(bytes, plus_node)| Some((data_type.number(&bytes)?, plus_node)));
    // One with which the simulated drive would not move.
    let is_idle =
        |number: i64| number == 0 && before.is_some_and(|before| before.low > 0 || is_needed(index, sub.sub));
    let (default, adds_node) = match (number.filter(|(number, _)| !is_idle(*number)), before) {
        (Some(said), _) => said,
        (None, Some(before)) => (before.default, before.adds_node),
        (None, None) => unsaid(index, sub.sub),
    };
    let made = definition(sheet, (index, node), sub, data_type, before);
    // The device computes with what it has itself, in whatever type a file gives it: in 32 bits at most.
    let (lowest, highest) = match data_type.range() {
        (lowest, highest) if before.is_some() || index < 0x2000 => {
            (lowest.max(i64::from(i32::MIN)), highest.min(i64::from(u32::MAX)))
        }
        range => range,
    };
    let default = default.clamp(lowest, highest);
    // What it has is within its limits, whatever those are.
    let has = default.saturating_add(if adds_node { node.into() } else { 0 }).min(highest);
    let (low, high) = (made.low.clamp(lowest, has), made.high.clamp(has, highest));
    let definition = Definition { default, adds_node, low, high, ..made };
    match own {
        Some(handle) => dictionary.redefine(handle, definition),
        None => dictionary.add(mux, definition),
    }
}

/// The definition of a value of the file, without its default.
fn definition(
    sheet: &DeviceDescription,
    (index, node): (u16, u8),
    sub: &SubObject,
    data_type: DataType,
    before: Option<Definition>,
) -> Definition {
    let (lowest, highest) = data_type.range();
    let limit = |setting: &Option<eds::Setting>| {
        let number = setting.as_ref()?.at(node)?.as_integer()?;
        i64::try_from(number).ok()
    };
    let has_order = !matches!(data_type, DataType::U64 | DataType::F32 | DataType::F64);
    let own = before.filter(|before| before.data_type == data_type);
    let (low, high) = match (limit(&sub.low), limit(&sub.high)) {
        _ if !has_order => (lowest, highest),
        (None, None) => own.map_or((lowest, highest), |before| (before.low, before.high)),
        (low, high) => (low.unwrap_or(lowest).max(lowest), high.unwrap_or(highest).min(highest)),
    };
    let is_fixed = sheet.device.granularity == Some(0)
        && Direction::BOTH.iter().any(|way| way.mapping().contains(&index));
    let access = match sub.access {
        eds::Access::Constant => Access::Constant,
        _ if is_fixed => Access::ReadOnly,
        eds::Access::ReadOnly => Access::ReadOnly,
        eds::Access::WriteOnly => Access::WriteOnly,
        eds::Access::ReadWrite | eds::Access::ReadWriteTransmit | eds::Access::ReadWriteReceive => {
            Access::ReadWrite
        }
    };
    let mapping = match (sub.pdo_mapping, sub.access.receives(), sub.access.transmits()) {
        (true, true, true) => Mapping::Both,
        (true, true, false) => Mapping::Rpdo,
        (true, false, true) => Mapping::Tpdo,
        _ => Mapping::None,
    };
    let is_volatile = before.map_or(!access.writes(), |before| before.is_volatile);
    let name = before.map_or("", |before| before.name);
    Definition { access, mapping, low, high, is_volatile, ..Definition::new(name, data_type, 0) }
}

/// Whether 0 in a value of the first or a further axis keeps it from moving.
fn is_needed(index: u16, sub: u8) -> bool {
    let on_first = on_first_axis(index);
    on_first == ENCODER_RESOLUTION && sub > 0
        || VALUES.iter().any(|(known, known_sub, _)| (*known, *known_sub) == (on_first, sub))
}

/// The default of a value that neither the file nor the simulated drive gives: that of CiA 301, or 0.
fn unsaid(index: u16, sub: u8) -> (i64, bool) {
    for way in Direction::BOTH {
        if way.communication().contains(&index) {
            let number = index - way.first_communication();
            let first = if way == Direction::Receive { 0x200 } else { 0x180 };
            return match sub {
                SUB_COB_ID if number < DEFAULT_PDOS => (first + 0x100 * i64::from(number), true),
                SUB_COB_ID => (1 << 31, false),
                SUB_TYPE => (255, false),
                _ => (0, false),
            };
        }
    }
    (0, false)
}

/// Gives hidden factors the values that the factors of the file stand for, and values that the file does not give those of the
/// simulated drive in its units.
fn scale(dictionary: &mut Dictionary, sheet: &DeviceDescription, axis: u16) {
    let offset = axis * AXIS_OFFSET;
    let has = |index: u16| sheet.object(index + offset).is_some();
    let part = |dictionary: &Dictionary, index: u16, sub| dictionary.number(index + offset, sub);
    let set = |dictionary: &mut Dictionary, index: u16, sub, number: i64| {
        if let Some(handle) = dictionary.find(Mux::new(index + offset, sub)) {
            dictionary.set_default(handle, number);
        }
    };
    let pair = |dictionary: &mut Dictionary, index, upper: i64, lower: i64| {
        let (upper, lower) = reduced(upper, lower);
        set(dictionary, index, 1, upper);
        set(dictionary, index, 2, lower);
    };
    // Without a feed constant, a count of the position is one of the encoder behind the gear.
    if !has(FEED_CONSTANT) && has(ENCODER_RESOLUTION) {
        let number = |index, sub| part(dictionary, index, sub);
        let upper = number(ENCODER_RESOLUTION, 1).saturating_mul(number(GEAR_RATIO, 1));
        let lower = number(ENCODER_RESOLUTION, 2).saturating_mul(number(GEAR_RATIO, 2));
        pair(dictionary, FEED_CONSTANT, upper, lower);
    }
    // The unit of velocities counts before their factor.
    let unit = if has(VELOCITY_UNIT) { part(dictionary, VELOCITY_UNIT, 0) } else { 0 };
    let (feed, turns) = (part(dictionary, FEED_CONSTANT, 1), part(dictionary, FEED_CONSTANT, 2));
    let counts_of_a_turn = |counts: i64| (counts.saturating_mul(turns), feed);
    let factor = match unit {
        0x00B4_4700 => Some(counts_of_a_turn(60)),
        0xFFB4_4700 => Some(counts_of_a_turn(600)),
        0xFEB4_4700 => Some(counts_of_a_turn(6_000)),
        0xFDB4_4700 => Some(counts_of_a_turn(60_000)),
        0x00B4_0300 => Some(counts_of_a_turn(1)),
        0xFDB4_0300 => Some(counts_of_a_turn(1_000)),
        0x00B5_0300 => Some((1, 1)),
        _ => None,
    };
    if let Some((upper, lower)) = factor {
        pair(dictionary, VELOCITY_FACTOR, upper, lower);
    }
    let preset = Scales::preset();
    let Some(scales) = Scales::read(dictionary, offset) else { return };
    let of = |scales: &Scales, unit| -> Scale {
        match unit {
            Unit::Position => scales.position,
            Unit::Velocity => scales.velocity,
            Unit::Acceleration => scales.acceleration,
        }
    };
    for (index, sub, unit) in VALUES {
        let mux = Mux::new(index + offset, sub);
        let is_said = sheet.number(mux.index, sub, 0).is_some_and(|number| number != 0);
        let Some(handle) = dictionary.find(mux).filter(|_| !is_said) else { continue };
        let counts = of(&scales, unit).counts(of(&preset, unit).servo(dictionary.entry(handle).number()));
        dictionary.set_default(handle, counts.clamp(1, i64::from(u32::MAX)));
    }
}

/// The same ratio in numbers of 31 bits, as near as they come.
fn reduced(upper: i64, lower: i64) -> (i64, i64) {
    let ratio = Ratio::new(upper.max(1), lower.max(1)).unwrap_or(Ratio::ONE);
    let (mut upper, mut lower) = (ratio.num(), ratio.den());
    while upper > i64::from(i32::MAX) || lower > i64::from(i32::MAX) {
        (upper, lower) = ((upper / 2).max(1), (lower / 2).max(1));
    }
    (upper, lower)
}

/// Takes the time between set-points from the communication cycle period, of a drive without an object for it.
pub(super) fn follow_cycle(dictionary: &mut Dictionary, axes: usize) {
    let period = dictionary.number(COMMUNICATION_CYCLE_PERIOD, 0);
    let (number, power) = if period % 1_000 == 0 { (period / 1_000, -3) } else { (period / 100, -4) };
    if period == 0 || !(1..=255).contains(&number) {
        return;
    }
    for axis in (0..AXES_MAX).take(axes) {
        let index = INTERPOLATION_PERIOD + u16::from(axis) * AXIS_OFFSET;
        dictionary.set(index, 1, number);
        dictionary.set(index, 2, power);
    }
}
