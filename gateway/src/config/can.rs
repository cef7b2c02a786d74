//! The CAN buses of a configuration.

use profile_cia402::wire::NodeId;
use profile_generic::can::timing::BitRate;
use profile_generic::image::Signal;
use profile_generic::mode::OperatingMode;
use profile_generic::quantity::Quantity;
use profile_generic::ratio::Ratio;
use profile_generic::time::DurationNs;

use super::check::{Checker, NANO};
use super::file::{CanDriveTable, CanTable, CountsTable};
use super::{Can, CanDrive, CanLink, duration};
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
const DEFAULT_ALLOWED_LOSSES: u16 = 3;
const AXES: core::ops::RangeInclusive<i64> = 0..=7;

/// Parts per million in the rated torque.
const RATED: Option<Ratio> = Ratio::new(1_000_000, 1);

/// What an axis can be used for.
pub(super) const MODES: [(&str, OperatingMode); 3] = [
    ("position", OperatingMode::Position),
    ("velocity", OperatingMode::Velocity),
    ("torque", OperatingMode::Torque),
];

/// Actual values that can be left out, and whether they are where nothing is said.
const ACTUAL_VALUES: [(&str, (Signal, bool)); 4] = [
    ("velocity", (Signal::VelocityActual, true)),
    ("torque", (Signal::TorqueActual, true)),
    ("following-error", (Signal::FollowingError, false)),
    ("inputs", (Signal::DigitalInputs, false)),
];

/// Modes of operation of drives (6060).
const DRIVE_MODES: [(&str, i8); 9] =
    [("pp", 1), ("vl", 2), ("pv", 3), ("tq", 4), ("hm", 6), ("ip", 7), ("csp", 8), ("csv", 9), ("cst", 10)];

/// Offsets that can be sent.
const OFFSETS: [(&str, Signal); 2] = [("velocity", Signal::VelocityOffset), ("torque", Signal::TorqueOffset)];

impl Checker {
    /// All CAN buses.
    pub(super) fn can(&mut self, tables: &[Spanned<CanTable>]) -> Option<Vec<Can>> {
        self.count(tables, "CAN buses", BUSES_MAX);
        let buses: Vec<_> = tables.iter().map(|bus| self.can_bus(bus.get_ref())).collect();
        buses.into_iter().collect()
    }

    fn can_bus(&mut self, table: &CanTable) -> Option<Can> {
        let link = self.can_link(&table.interface, table.set_bit_rate);
        let bit_rate = self.number_or(table.bit_rate.as_ref(), "the bit rate", BIT_RATES, DEFAULT_BIT_RATE);
        let cycle_time = self.sync_time(&table.cycle_time);
        let node = self.number_or(table.node.as_ref(), "the node-id of the box", NODES, DEFAULT_NODE);
        let heartbeat_ms = match &table.heartbeat {
            None => Some(DEFAULT_HEARTBEAT_MS),
            Some(text) => self.watch_time(text, "the time between heartbeats"),
        };
        let allowed_losses = self.number_or(
            table.allowed_losses.as_ref(),
            "the number of allowed losses",
            1..=1000,
            DEFAULT_ALLOWED_LOSSES,
        );
        if table.drive.is_empty() {
            return self.report(
                table.interface.span(),
                format_args!("the CAN bus `{}` has no drives", table.interface.get_ref()),
                "expected at least one [[south.can.drive]]",
            );
        }
        self.can_places(table, node);
        let drives: Vec<_> = table.drive.iter().map(|drive| self.can_drive(drive.get_ref())).collect();
        let devices = self.can_devices(table);
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
        &mut self,
        interface: &Spanned<String>,
        set_bit_rate: Option<bool>,
    ) -> Option<CanLink> {
        self.interface(interface).map(|name| match name {
            None => CanLink::InProcess,
            Some(name) => CanLink::Interface { name, set_bit_rate: set_bit_rate.unwrap_or(false) },
        })
    }

    /// Each axis of each device once, and no device with the number of the box.
    fn can_places(&mut self, table: &CanTable, own: Option<u8>) {
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
                self.push(problem.related(first.get_ref().node.span(), "used here first"));
            }
            if own.is_some_and(|own| i64::from(own) == *node.get_ref()) {
                self.report::<()>(
                    node.span(),
                    format_args!("node-id {} is that of the gateway", node.get_ref()),
                    "expected another one, or another `node` of the bus",
                );
            }
        }
    }

    fn sync_time(&mut self, text: &Spanned<String>) -> Option<DurationNs> {
        let time = self.time_span(text)?;
        if CYCLE_NS.contains(&time.0) && time.0 % CYCLE_STEP_NS == 0 {
            return Some(time);
        }
        self.report(
            text.span(),
            format_args!("{} cannot be the cycle of a CAN bus", duration::show(time)),
            "expected 500 us to 1 s in whole 100 microseconds",
        )
    }

    /// A time between two signs of life, ms.
    pub(super) fn watch_time(&mut self, text: &Spanned<String>, what: &str) -> Option<u16> {
        let time = self.time_span(text)?;
        let ms = time.0 / 1_000_000;
        if time.0 % 1_000_000 == 0 && WATCH_MS.contains(&ms) {
            return u16::try_from(ms).ok();
        }
        self.report(
            text.span(),
            format_args!("{} cannot be {what}", duration::show(time)),
            "expected 10 ms to 10 s in whole milliseconds",
        )
    }

    fn can_drive(&mut self, table: &CanDriveTable) -> Option<CanDrive> {
        let name = self.name("drive", &table.name);
        let node = self.number(&table.node, "the node-id", NODES);
        let axis = self.number_or(table.axis.as_ref(), "the axis of the device", AXES, 0);
        let modes = match &table.modes {
            None => Some(None),
            Some(names) => self.words(names, "mode", &MODES).map(Some),
        };
        if let Some(names) = table.modes.as_ref().filter(|names| names.get_ref().is_empty()) {
            self.report::<()>(names.span(), "an axis without a mode", "expected at least one mode");
        }
        let sent = match &table.actual_values {
            None => {
                Some(ACTUAL_VALUES.map(|(_, value)| value).into_iter().filter(|(_, usual)| *usual).collect())
            }
            Some(names) => self.words(names, "actual value", &ACTUAL_VALUES),
        };
        let left_out = sent.map(|sent| {
            let all = ACTUAL_VALUES.iter().map(|(_, value)| value);
            all.filter(|value| !sent.contains(value)).map(|(signal, _)| *signal).collect()
        });
        let offsets = match &table.offsets {
            None => Some(Vec::new()),
            Some(names) => self.words(names, "offset", &OFFSETS),
        };
        let tells_voltage = match &table.voltage_bit {
            None => Some(None),
            Some(word) => self.word(word, "meaning of bit 4", &VOLTAGE_BIT).map(Some),
        };
        let drive_modes = match &table.drive_modes {
            None => Some(None),
            Some(names) => self.words(names, "mode of operation", &DRIVE_MODES).map(Some),
        };
        if let Some(names) = table.drive_modes.as_ref().filter(|names| names.get_ref().is_empty()) {
            self.report::<()>(
                names.span(),
                "a drive without modes",
                "expected at least one mode of operation",
            );
        }
        let way_of_a_turn = match &table.millimetres_per_turn {
            None => Some(None),
            Some(value) => self.exact(value, "the way of a turn").map(Some),
        };
        let counts = match &table.counts {
            None => Some(Vec::new()),
            Some(counts) => self.counts(counts),
        };
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
        })
    }

    /// Words of a list, each once.
    pub(super) fn words<T: Copy>(
        &mut self,
        names: &Spanned<Vec<Spanned<String>>>,
        what: &str,
        known: &[(&str, T)],
    ) -> Option<Vec<T>> {
        self.unique(&format!("the {what}"), names.get_ref());
        let words: Vec<_> = names.get_ref().iter().map(|name| self.word(name, what, known)).collect();
        words.into_iter().collect()
    }

    /// A word of a list.
    pub(super) fn word<T: Copy>(
        &mut self,
        name: &Spanned<String>,
        what: &str,
        known: &[(&str, T)],
    ) -> Option<T> {
        let found = known.iter().find(|(word, _)| *word == name.get_ref()).map(|(_, value)| *value);
        found.or_else(|| {
            let all: Vec<_> = known.iter().map(|(word, _)| format!("\"{word}\"")).collect();
            self.report_as(
                code::UNKNOWN_WORD,
                name.span(),
                format_args!("unknown {what} `{}`", name.get_ref()),
                format_args!("expected one of {}", all.join(", ")),
            )
        })
    }

    /// A number above 0 with up to nine decimals as an exact ratio.
    pub(super) fn exact(&mut self, value: &Spanned<f64>, what: &str) -> Option<Ratio> {
        let nano = self.fine(value, what, NANO)?;
        match Ratio::new(nano, NANO?.num()).filter(|_| nano > 0) {
            Some(ratio) => Some(ratio),
            None => self.report_as(
                code::OUT_OF_RANGE,
                value.span(),
                format_args!("{what} is {}", value.get_ref()),
                "expected a number above 0",
            ),
        }
    }

    fn counts(&mut self, table: &CountsTable) -> Option<Vec<(Quantity, Ratio)>> {
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
            let per_unit = self.exact(value, "the number of counts")?;
            let ratio = per_unit.inverse().and_then(|inverse| unit?.then(inverse));
            let Some(ratio) = ratio else {
                return self.report_as(
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
}
