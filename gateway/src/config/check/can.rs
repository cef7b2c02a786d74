//! The CAN buses of a configuration.

use profile_cia402::wire::NodeId;
use profile_generic::can::timing::BitRate;
use profile_generic::image::Signal;
use profile_generic::mode::{ModeSelection, OperatingMode};
use profile_generic::quantity::Quantity;
use profile_generic::ratio::Ratio;
use profile_generic::time::DurationNs;

use super::value::NANO;
use super::{Problems, can_device, startup, value};
use crate::config::file::{CanDriveTable, CanTable, CountsTable};
use crate::config::{Can, CanDrive, CanLink, duration};
use crate::finding::registry as code;
use crate::finding::{Problem, Spanned};
use crate::mapping::VOLTAGE_BIT;

/// CAN buses of one box.
const BUSES_MAX: usize = 4;
const BIT_RATES: core::ops::RangeInclusive<i64> = 10_000..=1_000_000;
const DEFAULT_BIT_RATE: u32 = 1_000_000;
const CYCLE_NS: core::ops::RangeInclusive<i64> = 500_000..=1_000_000_000;
const CYCLE_STEP_NS: i64 = 100_000;
pub(super) const NODES: core::ops::RangeInclusive<i64> = 1..=127;
const DEFAULT_NODE: u8 = 127;
const WATCH_MS: core::ops::RangeInclusive<i64> = 10..=10_000;
const DEFAULT_HEARTBEAT_MS: u16 = 100;
const AXES: core::ops::RangeInclusive<i64> = 0..=7;

/// Parts per million in the rated torque.
const RATED: Option<Ratio> = Ratio::new(1_000_000, 1);

/// What an axis can be used for with set-points.
pub(in crate::config) const MODES: [(&str, OperatingMode); 3] = [
    ("position", OperatingMode::Position),
    ("velocity", OperatingMode::Velocity),
    ("torque", OperatingMode::Torque),
];

/// What an axis can be used for besides, where its drive moves it by itself. CIP Motion has no word for either: local control has.
const MODES_BY_DRIVE: [(&str, ModeSelection); 2] = [
    ("positioning", ModeSelection::by_drive(OperatingMode::Position)),
    ("homing", ModeSelection::by_drive(OperatingMode::Homing)),
];

/// All of them; an axis starts in one of [`MODES`], which come first.
pub(in crate::config) fn modes() -> Vec<(&'static str, ModeSelection)> {
    let led = MODES.map(|(name, mode)| (name, ModeSelection::from(mode)));
    led.into_iter().chain(MODES_BY_DRIVE).collect()
}

/// Actual values that can be left out, and whether they are where nothing is said.
pub(in crate::config) const ACTUAL_VALUES: [(&str, (Signal, bool)); 4] = [
    ("velocity", (Signal::VelocityActual, true)),
    ("torque", (Signal::TorqueActual, true)),
    ("following-error", (Signal::FollowingError, false)),
    ("inputs", (Signal::DigitalInputs, false)),
];

/// Modes of operation of drives (6060).
pub(in crate::config) const DRIVE_MODES: [(&str, i8); 9] =
    [("pp", 1), ("vl", 2), ("pv", 3), ("tq", 4), ("hm", 6), ("ip", 7), ("csp", 8), ("csv", 9), ("cst", 10)];

/// Offsets that can be sent.
pub(in crate::config) const OFFSETS: [(&str, Signal); 2] =
    [("velocity", Signal::VelocityOffset), ("torque", Signal::TorqueOffset)];

/// All CAN buses.
pub(super) fn check(problems: &mut Problems, tables: &[Spanned<CanTable>]) -> Option<Vec<Can>> {
    problems.count(tables, "CAN buses", BUSES_MAX);
    let buses: Vec<_> = tables.iter().map(|bus| check_bus(problems, bus.get_ref())).collect();
    buses.into_iter().collect()
}

fn check_bus(problems: &mut Problems, table: &CanTable) -> Option<Can> {
    let link = can_link(problems, &table.interface, table.set_bit_rate);
    let bit_rate = value::number_or(problems, &table.bit_rate, "the bit rate", BIT_RATES, DEFAULT_BIT_RATE);
    if bit_rate.is_none()
        && let Some(thousands) = table.bit_rate.as_ref().and_then(|rate| rate.get_ref().checked_mul(1_000))
        && BIT_RATES.contains(&thousands)
    {
        problems.help(format!("write {thousands} if this is in kbit/s"));
    }
    let cycle_time = sync_time(problems, &table.cycle_time);
    let node = value::number_or(problems, &table.node, "the node-id of the gateway", NODES, DEFAULT_NODE);
    let heartbeat_ms = match &table.heartbeat {
        None => Some(DEFAULT_HEARTBEAT_MS),
        Some(text) => watch_time(problems, text, "the time between heartbeats"),
    };
    let allowed_losses =
        value::number_or(problems, &table.allowed_losses, "the number of allowed losses", 1..=1000, 3);
    if table.drive.is_empty() {
        return problems.report(
            table.interface.span(),
            format_args!("the CAN bus `{}` has no drives", table.interface.get_ref()),
            "expected at least one [[south.can.drive]]",
        );
    }
    can_places(problems, table, node);
    let drives: Vec<_> = table.drive.iter().map(|drive| check_drive(problems, drive.get_ref())).collect();
    let devices = can_device::check(problems, table);
    Some(Can {
        link: link?,
        bit_rate: BitRate::classic(bit_rate?)?,
        cycle_time: cycle_time?,
        node: NodeId::new(node?).ok()?,
        heartbeat_ms: heartbeat_ms?,
        allowed_losses: allowed_losses?,
        drives: drives.into_iter().collect::<Option<_>>()?,
        devices: devices?,
    })
}

/// How a bus is reached.
pub(super) fn can_link(
    problems: &mut Problems,
    interface: &Spanned<String>,
    set_bit_rate: Option<bool>,
) -> Option<CanLink> {
    value::interface(problems, interface).map(|name| match name {
        None => CanLink::InProcess,
        Some(name) => CanLink::Interface { name, set_bit_rate: set_bit_rate.unwrap_or(false) },
    })
}

/// Each axis of each device once, and no device with the number of the box.
fn can_places(problems: &mut Problems, table: &CanTable, own: Option<u8>) {
    let place = |drive: &Spanned<CanDriveTable>| {
        let drive = drive.get_ref();
        (*drive.node.get_ref(), drive.axis.as_ref().map_or(0, |axis| *axis.get_ref()))
    };
    for (index, drive) in table.drive.iter().enumerate() {
        let node = &drive.get_ref().node;
        if let Some(first) = table.drive[..index].iter().find(|earlier| place(earlier) == place(drive)) {
            let (number, axis) = place(drive);
            let problem = Problem::new(code::TWICE, node.span())
                .title(format!("axis {axis} of node {number} is used twice"));
            let problem = problem.expected("expected each axis of a device once");
            problems.push(problem.related(first.get_ref().node.span(), "used here first"));
        }
        if own.is_some_and(|own| i64::from(own) == *node.get_ref()) {
            problems.report_as::<()>(
                code::CONTRADICTION,
                node.span(),
                format_args!("node-id {} is that of the gateway", node.get_ref()),
                "expected another one, or another `node` of the bus",
            );
        }
    }
}

fn sync_time(problems: &mut Problems, text: &Spanned<String>) -> Option<DurationNs> {
    let time = value::time_span(problems, text)?;
    if CYCLE_NS.contains(&time.0) && time.0 % CYCLE_STEP_NS == 0 {
        return Some(time);
    }
    problems.report(
        text.span(),
        format_args!("{} cannot be the cycle of a CAN bus", duration::show(time)),
        "expected 500 us to 1 s in whole 100 microseconds",
    )
}

/// A time between two signs of life, ms.
pub(super) fn watch_time(problems: &mut Problems, text: &Spanned<String>, what: &str) -> Option<u16> {
    let time = value::time_span(problems, text)?;
    let ms = time.0 / 1_000_000;
    if time.0 % 1_000_000 == 0 && WATCH_MS.contains(&ms) {
        return u16::try_from(ms).ok();
    }
    problems.report(
        text.span(),
        format_args!("{} cannot be {what}", duration::show(time)),
        "expected 10 ms to 10 s in whole milliseconds",
    )
}

fn check_drive(problems: &mut Problems, table: &CanDriveTable) -> Option<CanDrive> {
    let name = value::name(problems, "drive", &table.name);
    let node = value::number(problems, &table.node, "the node-id", NODES);
    let axis = value::number_or(problems, &table.axis, "the axis of the device", AXES, 0);
    let modes = value::optional(&table.modes, |names| check_modes(problems, names));
    let sent = match &table.actual_values {
        None => Some(ACTUAL_VALUES.map(|(_, value)| value).into_iter().filter(|(_, usual)| *usual).collect()),
        Some(names) => value::words(problems, names, "actual value", &ACTUAL_VALUES),
    };
    let left_out = sent.map(|sent| {
        let all = ACTUAL_VALUES.iter().map(|(_, value)| value);
        all.filter(|value| !sent.contains(value)).map(|(signal, _)| *signal).collect()
    });
    let offsets = match &table.offsets {
        None => Some(Vec::new()),
        Some(names) => value::words(problems, names, "offset", &OFFSETS),
    };
    let tells_voltage = value::optional(&table.voltage_bit, |word| {
        value::word(problems, word, "meaning of bit 4", &VOLTAGE_BIT)
    });
    let drive_modes = value::optional(&table.drive_modes, |names| {
        value::words(problems, names, "mode of operation", &DRIVE_MODES)
    });
    if let Some(names) = table.drive_modes.as_ref().filter(|names| names.get_ref().is_empty()) {
        problems.report::<()>(
            names.span(),
            "a drive without modes",
            "expected at least one mode of operation",
        );
    }
    let way_of_a_turn = value::optional(&table.millimetres_per_turn, |value| {
        value::exact(problems, value, "the way of a turn")
    });
    let counts = match &table.counts {
        None => Some(Vec::new()),
        Some(counts) => check_counts(problems, counts),
    };
    let startup = startup::can(problems, table);
    Some(CanDrive {
        name: name?,
        node: NodeId::new(node?).ok()?,
        axis: axis?,
        modes: modes?,
        left_out: left_out?,
        offsets: offsets?,
        acknowledges: table.acknowledges,
        tells_voltage: tells_voltage?,
        drive_modes: drive_modes?,
        way_of_a_turn: way_of_a_turn?,
        counts: counts?,
        startup: startup?,
    })
}

/// What an axis is used for; the first one is active at the start, and set-points lead it.
pub(super) fn check_modes(
    problems: &mut Problems,
    names: &Spanned<Vec<Spanned<String>>>,
) -> Option<Vec<ModeSelection>> {
    let all = modes();
    let modes = value::words(problems, names, "mode", &all)?;
    match (names.get_ref().first(), modes.first()) {
        (Some(_), Some(first)) if all[..MODES.len()].iter().any(|(_, mode)| mode == first) => Some(modes),
        (Some(name), _) => problems.report(
            name.span(),
            format_args!("an axis cannot start in the mode `{}`", name.get_ref()),
            "expected \"position\", \"velocity\" or \"torque\" first",
        ),
        (None, _) => problems.report(
            names.span(),
            "an axis without a mode",
            "expected at least one mode of \"position\", \"velocity\" and \"torque\"",
        ),
    }
}

fn check_counts(problems: &mut Problems, table: &CountsTable) -> Option<Vec<(Quantity, Ratio)>> {
    let all = [
        (Quantity::Position, &table.position, NANO),
        (Quantity::Velocity, &table.velocity, NANO),
        (Quantity::Acceleration, &table.acceleration, NANO),
        (Quantity::Torque, &table.torque, RATED),
    ];
    let mut counts = Vec::new();
    for (quantity, value, unit) in all {
        let Some(value) = value else { continue };
        // Generic units in a count: those in a unit over the counts in it.
        let per_unit = value::exact(problems, value, "the number of counts")?;
        let ratio = per_unit.inverse().and_then(|inverse| unit?.then(inverse));
        let Some(ratio) = ratio else {
            return problems.report_as(
                code::OUT_OF_RANGE,
                value.span(),
                format_args!("{} counts have no exact ratio", value.get_ref()),
                "expected a number with fewer digits",
            );
        };
        counts.push((quantity, ratio));
    }
    Some(counts)
}
