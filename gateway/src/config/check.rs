//! From the file as written to the configuration as used; collects every fault.

use std::fmt::Display;
use std::net::{Ipv4Addr, SocketAddr};
use std::ops::{Range, RangeInclusive};
use std::path::PathBuf;

use crate::finding::registry::{self as code, Code};
use crate::finding::{Problem, Spanned};
use profile_generic::quantity::{Acceleration, Position, Torque, Velocity};
use profile_generic::ratio::{Ratio, Rounding};
use profile_generic::time::DurationNs;
use profile_sercos::master::config::{AddressPolicy, MasterConfig};

use super::duration;
use super::file::{
    AxisTable, DeviceTable, DriveTable, File, IdentityTable, LimitsTable, RealtimeTable, SercosTable,
    SouthTable, UpdatePeriodTable,
};
use super::rated;
use super::{
    AXES_MAX, Axis, AxisFunction, AxisKind, Config, DEVICES_MAX, Device, Drive, DriveAt, Identity, Limits,
    Link, LogLevel, Modbus, Sercos, StoppingAction, TimeSource,
};
use crate::mapping::{CaptureMode, ETHERNET_IP, networks};
use crate::sys::realtime::{self, PRIORITY_MAX};

const NAME_LEN_MAX: usize = 32;
/// Longest name of a network interface on Linux.
const INTERFACE_LEN_MAX: usize = 15;
const SERCOS_ADDRESS_MAX: i64 = 511;
/// Cycles shorter than the step of the others (S-0-1002).
const SHORT_CYCLES_NS: [i64; 3] = [31_250, 62_500, 125_000];
const CYCLE_STEP_NS: i64 = 250_000;
const CYCLE_MAX_NS: i64 = 65_000_000;
const UPDATE_PERIOD_NS: RangeInclusive<i64> = 250_000..=100_000_000;
const DEFAULT_CLIENTS_MAX: u8 = 8;
const DEFAULT_UPDATE_PERIOD_MIN: DurationNs = DurationNs::from_millis(1);
const DEFAULT_UPDATE_PERIOD_MAX: DurationNs = DurationNs::from_millis(32);
const DEFAULT_MOTION_RESOLUTION: u32 = 1_000_000;
pub(crate) const DEFAULT_JITTER: DurationNs = DurationNs::from_micros(50);
const DEFAULT_CP0_STABLE_CYCLES: u16 = 100;
pub(crate) const DEFAULT_ALLOWED_LOSSES: u16 = 5;
/// The work for a cycle begins so long before its instant: ordinary kernels wake a real-time thread later than half of that once in
/// a hundred times.
pub(crate) const DEFAULT_LEAD: DurationNs = DurationNs::from_micros(100);

/// Longest lead.
const LEAD_MAX: DurationNs = DurationNs::from_millis(1);

pub(crate) const DEFAULT_PRIORITY: u8 = 80;
const DEFAULT_REVISION: (u8, u8) = (1, 1);
const DEFAULT_PRODUCT_NAME: &str = "Axisbridge";

/// A link name that stands for simulated drives.
pub(super) const IN_PROCESS: &str = "in-process";

/// Checks a file.
pub(super) fn check(file: &File) -> Result<Config, Vec<Problem>> {
    let mut checker = Checker::default();
    let config = checker.file(file);
    match config {
        Some(config) if checker.problems.is_empty() => Ok(config),
        _ => Err(checker.problems),
    }
}

/// Collects problems. A method returns `None` when it has reported one: the rest of the file is still
/// checked.
#[derive(Default)]
pub(super) struct Checker {
    problems: Vec<Problem>,
}

impl Checker {
    /// A problem of more than one place.
    pub(super) fn push(&mut self, problem: Problem) {
        self.problems.push(problem);
    }

    pub(super) fn report<T>(
        &mut self,
        span: Range<usize>,
        title: impl Display,
        expected: impl Display,
    ) -> Option<T> {
        self.report_as(code::CONFIG_VALUE, span, title, expected)
    }

    pub(super) fn report_as<T>(
        &mut self,
        code: Code,
        span: Range<usize>,
        title: impl Display,
        expected: impl Display,
    ) -> Option<T> {
        self.problems.push(Problem::new(code, span).title(title.to_string()).expected(expected.to_string()));
        None
    }

    fn duplicate(&mut self, what: &str, first: Range<usize>, second: Range<usize>) {
        let problem = Problem::new(code::TWICE, second).title(format!("{what} is used twice"));
        self.problems
            .push(problem.expected("expected one that is not used yet").related(first, "used here first"));
    }

    /// Reports every value that has come before.
    pub(super) fn unique<T: PartialEq + Display>(&mut self, what: &str, values: &[Spanned<T>]) {
        for (index, value) in values.iter().enumerate() {
            if let Some(first) = values[..index].iter().find(|earlier| earlier.get_ref() == value.get_ref()) {
                self.duplicate(&format!("{what} `{}`", value.get_ref()), first.span(), value.span());
            }
        }
    }

    fn file(&mut self, file: &File) -> Option<Config> {
        let name = self.label("the box", &file.the_box.name);
        let time = self.time(file);
        let log_level = self.log_level(file);
        let modbus = match &file.modbus {
            Some(table) => {
                let listen = self.socket_address(&table.listen);
                let clients_max = self.number_or(
                    table.clients_max.as_ref(),
                    "the number of Modbus clients",
                    1..=64,
                    DEFAULT_CLIENTS_MAX,
                );
                Some(Modbus { listen: listen?, clients_max: clients_max? })
            }
            None => None,
        };
        let mappings = file.mappings.as_ref();
        let paths = mappings.iter().flat_map(|table| table.dir.iter().chain(&table.overlays));
        for path in paths {
            self.path(path, "mapping tables");
        }
        let path = |path: &Spanned<String>| PathBuf::from(path.get_ref());
        let mappings_dir = mappings.and_then(|table| table.dir.as_ref()).map(path);
        let overlays = mappings.iter().flat_map(|table| &table.overlays).map(path).collect();

        let settings_file = file.the_box.settings_file.as_ref();
        if let Some(path) = settings_file {
            self.path(path, "the settings file");
        }
        let settings_file = settings_file.map(path);

        let south = file.south.get_ref();
        let realtime = self.realtime(south.realtime.as_ref());
        let lead = self.lead(south.realtime.as_ref());
        let sercos = match &south.sercos {
            Some(table) => self.sercos(table.get_ref()).map(Some),
            None => Some(None),
        };
        self.some_bus(&file.south);
        let can = self.can(&south.can);
        let devicenet = self.devicenet(&south.devicenet);
        self.interfaces(south);
        let drives = self.drives(file);
        let cycles = sercos.iter().flatten().map(|sercos| sercos.cycle_time);
        let cycles = cycles.chain(can.iter().flatten().map(|can| can.cycle_time));
        let cycles = cycles.chain(devicenet.iter().flatten().map(|network| network.cycle_time));
        let cycle_time = cycles.min().unwrap_or(DurationNs::ZERO);

        self.unique("the device name", &names(&file.device, |device| &device.name));
        self.unique("the listen address", &names(&file.device, |device| &device.listen));
        self.unique("the axis name", &names(&file.axis, |axis| &axis.name));
        self.unique("the drive", &names(&file.axis, |axis| &axis.drive));
        self.count(&file.device, "devices", DEVICES_MAX);
        self.count(&file.axis, "axes", AXES_MAX);

        let owners = self.owners(&file.device, &file.axis);
        let devices: Vec<_> =
            file.device.iter().map(|device| self.device(device.get_ref(), cycle_time)).collect();
        let axes: Vec<_> = file
            .axis
            .iter()
            .zip(&owners)
            .map(|(axis, owner)| self.axis(axis.get_ref(), *owner, &drives))
            .collect();
        self.instances(&file.axis, &owners);

        Some(Config {
            name: name?,
            time: time?,
            log_level: log_level?,
            modbus,
            mappings_dir,
            overlays,
            settings_file,
            devices: devices.into_iter().collect::<Option<_>>()?,
            axes: axes.into_iter().collect::<Option<_>>()?,
            realtime: realtime?,
            lead: lead?,
            sercos: sercos?,
            can: can?,
            devicenet: devicenet?,
        })
    }

    pub(super) fn path(&mut self, path: &Spanned<String>, what: &str) {
        if path.get_ref().is_empty() {
            self.report::<()>(path.span(), format_args!("the path of {what} is empty"), "expected a path");
        }
    }

    fn time(&mut self, file: &File) -> Option<TimeSource> {
        match file.time.as_ref().and_then(|table| table.source.as_ref()) {
            Some(source) if source.get_ref() != "host" => self.report_as(
                code::UNKNOWN_WORD,
                source.span(),
                format_args!("unknown time source `{}`", source.get_ref()),
                "expected \"host\"",
            ),
            _ => Some(TimeSource::Host),
        }
    }

    fn log_level(&mut self, file: &File) -> Option<LogLevel> {
        let Some(level) = file.log.as_ref().and_then(|table| table.level.as_ref()) else {
            return Some(LogLevel::Info);
        };
        let levels = [LogLevel::Error, LogLevel::Warn, LogLevel::Info, LogLevel::Debug, LogLevel::Trace];
        match levels.into_iter().find(|candidate| candidate.name() == level.get_ref()) {
            Some(level) => Some(level),
            None => self.report_as(
                code::UNKNOWN_WORD,
                level.span(),
                format_args!("unknown log level `{}`", level.get_ref()),
                "expected \"error\", \"warn\", \"info\", \"debug\" or \"trace\"",
            ),
        }
    }

    pub(super) fn count<T>(&mut self, tables: &[Spanned<T>], what: &str, most: usize) {
        if let Some(excess) = tables.get(most) {
            self.report_as::<()>(
                code::TOO_MANY,
                excess.span(),
                format_args!("too many {what}: {}", tables.len()),
                format_args!("expected at most {most}"),
            );
        }
    }

    /// For each axis the device that lists it.
    fn owners(
        &mut self,
        devices: &[Spanned<DeviceTable>],
        axes: &[Spanned<AxisTable>],
    ) -> Vec<Option<usize>> {
        let mut owners: Vec<Option<(usize, Range<usize>)>> = vec![None; axes.len()];
        for (index, device) in devices.iter().enumerate() {
            let listed = &device.get_ref().axes;
            if listed.get_ref().is_empty() {
                self.report::<()>(
                    listed.span(),
                    "a device without axes",
                    "expected the name of at least one axis",
                );
            }
            self.node_axes(device.get_ref());
            for name in listed.get_ref() {
                let position = axes.iter().position(|axis| axis.get_ref().name.get_ref() == name.get_ref());
                let Some(position) = position else {
                    self.unknown("axis", name, axes.iter().map(|axis| axis.get_ref().name.get_ref()));
                    continue;
                };
                if let Some((_, first)) = &owners[position] {
                    self.duplicate(&format!("the axis `{}`", name.get_ref()), first.clone(), name.span());
                } else {
                    owners[position] = Some((index, name.span()));
                }
            }
        }
        for (axis, owner) in axes.iter().zip(&owners) {
            if owner.is_none() {
                let name = &axis.get_ref().name;
                self.report_as::<()>(
                    code::CONFIG_REFERENCE,
                    name.span(),
                    format_args!("the axis `{}` belongs to no device", name.get_ref()),
                    "expected its name under `axes` of a [[device]]",
                );
            }
        }
        owners.into_iter().map(|owner| owner.map(|(index, _)| index)).collect()
    }

    /// A device has as many axes as its network lets a node have.
    fn node_axes(&mut self, device: &DeviceTable) {
        let networks = networks().iter().filter(|network| network.name == ETHERNET_IP);
        for network in networks {
            let (least, most) = (usize::from(*network.axes.start()), usize::from(*network.axes.end()));
            let count = device.axes.get_ref().len();
            // Without any there is a report already.
            if count > 0 && !(least..=most).contains(&count) {
                self.report_as::<()>(
                    code::TOO_MANY,
                    device.axes.span(),
                    format_args!("the device `{}` has {count} axes", device.name.get_ref()),
                    format_args!(
                        "expected {least} to {most} axes of a node on {} (IEC 61800-7-302 clause {})",
                        network.name, network.clause
                    ),
                );
            }
        }
    }

    /// Instance numbers are unique in each device.
    fn instances(&mut self, axes: &[Spanned<AxisTable>], owners: &[Option<usize>]) {
        for (index, axis) in axes.iter().enumerate() {
            let instance = &axis.get_ref().instance;
            let earlier = axes[..index].iter().zip(owners).find(|(earlier, owner)| {
                owners[index].is_some()
                    && **owner == owners[index]
                    && earlier.get_ref().instance.get_ref() == instance.get_ref()
            });
            if let Some((earlier, _)) = earlier {
                self.duplicate(
                    &format!("the instance {} in one device", instance.get_ref()),
                    earlier.get_ref().instance.span(),
                    instance.span(),
                );
            }
        }
    }

    fn unknown<'a>(&mut self, what: &str, name: &Spanned<String>, known: impl Iterator<Item = &'a String>) {
        let known: Vec<String> = known.map(|name| format!("`{name}`")).collect();
        let expected = match known.is_empty() {
            true => format!("expected one that is there: there is no {what}"),
            false => format!("expected one of {}", known.join(", ")),
        };
        self.report_as::<()>(
            code::CONFIG_REFERENCE,
            name.span(),
            format_args!("there is no {what} `{}`", name.get_ref()),
            expected,
        );
    }

    fn device(&mut self, table: &DeviceTable, cycle_time: DurationNs) -> Option<Device> {
        let name = self.name("device", &table.name);
        let listen = self.own_address(&table.listen);
        let identity = self.identity(&table.identity);
        let power_structure_class_id = self.number_or(
            table.power_structure_class_id.as_ref(),
            "the power structure class ID",
            0..=i64::from(u32::MAX),
            0,
        );
        let connection_format = self.connection_format(table);
        let update_period = self.update_period(table.update_period.as_ref(), cycle_time);
        let (update_period_min, update_period_max) = update_period?;
        Some(Device {
            name: name?,
            listen: listen?,
            identity: identity?,
            power_structure_class_id: power_structure_class_id?,
            connection_format: connection_format?,
            update_period_min,
            update_period_max,
        })
    }

    fn identity(&mut self, table: &IdentityTable) -> Option<Identity> {
        let vendor_id = self.number(&table.vendor_id, "the vendor ID", 1..=65_535);
        let product_code = self.number(&table.product_code, "the product code", 1..=65_535);
        let serial_number = self.number(&table.serial_number, "the serial number", 1..=i64::from(u32::MAX));
        let revision = match &table.revision {
            None => Some(DEFAULT_REVISION),
            Some(text) => {
                let parts = text.get_ref().split_once('.');
                let numbers = parts
                    .and_then(|(major, minor)| Some((major.parse::<u8>().ok()?, minor.parse::<u8>().ok()?)));
                match numbers {
                    Some((major @ 1..=127, minor @ 1..)) => Some((major, minor)),
                    _ => self.report(
                        text.span(),
                        format_args!("`{}` is not a revision", text.get_ref()),
                        "expected major and minor, such as \"1.1\" (1 to 127, 1 to 255)",
                    ),
                }
            }
        };
        let product_name = match &table.product_name {
            None => Some(DEFAULT_PRODUCT_NAME.to_owned()),
            Some(name) => self.label("the product", name),
        };
        let vendor_name = match &table.vendor_name {
            None => vendor_id.map(|id: u16| format!("Vendor {id}")),
            Some(name) => self.label("the vendor", name),
        };
        let catalog = match &table.catalog {
            None => product_name.clone(),
            Some(name) => self.label("the catalogue entry", name),
        };
        let (revision_major, revision_minor) = revision?;
        Some(Identity {
            vendor_id: vendor_id?,
            vendor_name: vendor_name?,
            catalog: catalog?,
            product_code: product_code?,
            revision_major,
            revision_minor,
            serial_number: serial_number?,
            product_name: product_name?,
        })
    }

    fn update_period(
        &mut self,
        table: Option<&UpdatePeriodTable>,
        cycle_time: DurationNs,
    ) -> Option<(DurationNs, DurationNs)> {
        let given_min = table.and_then(|table| table.min.as_ref());
        let given_max = table.and_then(|table| table.max.as_ref());
        let min = match given_min {
            Some(text) => self.one_update_period(text)?,
            None => DEFAULT_UPDATE_PERIOD_MIN.max(cycle_time),
        };
        let max = match given_max {
            Some(text) => self.one_update_period(text)?,
            None => DEFAULT_UPDATE_PERIOD_MAX.max(cycle_time),
        };
        if let Some(text) = given_min
            && min < cycle_time
        {
            return self.report_as(
                code::CONTRADICTION,
                text.span(),
                format_args!(
                    "the shortest update period {} is shorter than the bus cycle",
                    duration::show(min)
                ),
                format_args!("expected at least {}", duration::show(cycle_time)),
            );
        }
        match given_max.or(given_min) {
            Some(text) if min > max => self.report_as(
                code::CONTRADICTION,
                text.span(),
                format_args!(
                    "the shortest update period {} is longer than the longest {}",
                    duration::show(min),
                    duration::show(max)
                ),
                "expected min no longer than max",
            ),
            _ => Some((min, max)),
        }
    }

    fn one_update_period(&mut self, text: &Spanned<String>) -> Option<DurationNs> {
        let period = self.time_span(text)?;
        if UPDATE_PERIOD_NS.contains(&period.0) && period.0 % 1_000 == 0 {
            return Some(period);
        }
        self.report(
            text.span(),
            format_args!("{} cannot be an update period", duration::show(period)),
            "expected 250 us to 100 ms in whole microseconds",
        )
    }

    fn axis(
        &mut self,
        table: &AxisTable,
        device: Option<usize>,
        drives: &[(&Spanned<String>, DriveAt)],
    ) -> Option<Axis> {
        let name = self.name("axis", &table.name);
        let instance = self.number(&table.instance, "the instance", 1..=255);
        let drive =
            drives.iter().find(|(name, _)| name.get_ref() == table.drive.get_ref()).map(|(_, at)| *at);
        if drive.is_none() {
            self.unknown("drive", &table.drive, drives.iter().map(|(name, _)| name.get_ref()));
        }
        let function = self.function(table);
        let kind = match table.unit.get_ref().as_str() {
            "revolution" => Some(AxisKind::Rotary),
            "millimetre" => Some(AxisKind::Linear),
            other => self.report_as(
                code::UNKNOWN_WORD,
                table.unit.span(),
                format_args!("unknown axis unit `{other}`"),
                "expected \"revolution\" or \"millimetre\"",
            ),
        };
        let counts = 1..=i64::from(i32::MAX);
        let motion_resolution = self.number_or(
            table.motion_resolution.as_ref(),
            "the motion resolution",
            counts.clone(),
            DEFAULT_MOTION_RESOLUTION,
        );
        let unwind_counts = match &table.unwind_counts {
            Some(value) => self.number(value, "the unwind", counts).map(Some),
            None => Some(None),
        };
        let power_structure_axis_id = self.number_or(
            table.power_structure_axis_id.as_ref(),
            "the power structure axis ID",
            0..=i64::from(u32::MAX),
            0,
        );
        let limits = match &table.limits {
            Some(limits) => self.limits(limits, table.unwind_counts.as_ref()),
            None => Some(Limits::default()),
        };
        // A PDO more is much of a CAN bus.
        let usual = match drive {
            Some(DriveAt::Can { .. }) => CaptureMode::ServiceChannel,
            _ => CaptureMode::Cyclic,
        };
        let events = self.capture_mode(table.events.as_ref(), usual);
        let on_command_loss = self.stopping_action(table.on_command_loss.as_ref());
        Some(Axis {
            name: name?,
            instance: instance?,
            device: device?,
            drive: drive?,
            function: function?,
            kind: kind?,
            motion_resolution: motion_resolution?,
            unwind_counts: unwind_counts?,
            power_structure_axis_id: power_structure_axis_id?,
            limits: limits?,
            on_command_loss: on_command_loss?,
            events: events?,
        })
    }

    /// What the axis is, and whether that goes with the rest of its table.
    fn function(&mut self, table: &AxisTable) -> Option<AxisFunction> {
        let Some(name) = &table.function else { return Some(AxisFunction::Drive) };
        let Some(function) = AxisFunction::ALL.into_iter().find(|known| known.name() == name.get_ref())
        else {
            let known: Vec<String> =
                AxisFunction::ALL.iter().map(|known| format!("\"{}\"", known.name())).collect();
            return self.report_as(
                code::UNKNOWN_WORD,
                name.span(),
                format_args!("unknown axis function `{}`", name.get_ref()),
                format_args!("expected one of {}", known.join(", ")),
            );
        };
        if function == AxisFunction::Drive {
            return Some(function);
        }
        let limits = table.limits.as_ref().and_then(LimitsTable::first);
        let misfits = [
            (limits, "it is never moved"),
            (
                table.on_command_loss.as_ref().map(|value| ("on_command_loss", value.span())),
                "it is never moved",
            ),
            (
                table
                    .unwind_counts
                    .as_ref()
                    .filter(|_| function == AxisFunction::Converter)
                    .map(|value| ("unwind_counts", value.span())),
                "it has no position",
            ),
        ];
        let before = self.problems.len();
        for ((key, span), why) in misfits.into_iter().filter_map(|(found, why)| Some((found?, why))) {
            let title = format!("an axis of function \"{}\" has no {key}", function.name());
            let problem = Problem::new(code::CONTRADICTION, span).title(title);
            let problem = problem.expected(format!("expected no {key}: {why}"));
            self.problems.push(problem.related(name.span(), "the function of the axis"));
        }
        (self.problems.len() == before).then_some(function)
    }

    fn capture_mode(&mut self, name: Option<&Spanned<String>>, usual: CaptureMode) -> Option<CaptureMode> {
        let Some(name) = name else { return Some(usual) };
        match name.get_ref().as_str() {
            "cyclic" => Some(CaptureMode::Cyclic),
            "service-channel" => Some(CaptureMode::ServiceChannel),
            "off" => Some(CaptureMode::Off),
            other => self.report_as(
                code::UNKNOWN_WORD,
                name.span(),
                "unknown way to capture events",
                format!("expected cyclic, service-channel or off, found {other}"),
            ),
        }
    }

    fn stopping_action(&mut self, name: Option<&Spanned<String>>) -> Option<StoppingAction> {
        let Some(name) = name else { return Some(StoppingAction::RampedDecelAndDisable) };
        let action = StoppingAction::ALL.into_iter().find(|action| action.name() == name.get_ref());
        if action.is_none() {
            let known: Vec<String> =
                StoppingAction::ALL.iter().map(|action| format!("\"{}\"", action.name())).collect();
            return self.report_as(
                code::UNKNOWN_WORD,
                name.span(),
                format_args!("unknown stopping action `{}`", name.get_ref()),
                format_args!("expected one of {}", known.join(", ")),
            );
        }
        action
    }

    fn limits(&mut self, table: &LimitsTable, unwind: Option<&Spanned<i64>>) -> Option<Limits> {
        // Axis units to 1e-9 of them; percent to parts per million.
        let velocity = self.positive(table.velocity.as_ref(), "the velocity limit", NANO);
        let acceleration = self.positive(table.acceleration.as_ref(), "the acceleration limit", NANO);
        let torque = self.positive(table.torque_percent.as_ref(), "the torque limit", PERCENT_TO_PPM);
        let following_error =
            self.positive(table.following_error.as_ref(), "the following error limit", NANO);
        let position = self.position_range(table, unwind);
        let (position_min, position_max) = position?;
        Some(Limits {
            position_min,
            position_max,
            velocity: velocity?.map(Velocity),
            acceleration: acceleration?.map(Acceleration),
            torque: torque?.map(Torque),
            following_error: following_error?.map(Position),
        })
    }

    fn position_range(
        &mut self,
        table: &LimitsTable,
        unwind: Option<&Spanned<i64>>,
    ) -> Option<(Option<Position>, Option<Position>)> {
        let (min, max) = match (&table.position_min, &table.position_max) {
            (None, None) => return Some((None, None)),
            (Some(min), Some(max)) => (min, max),
            (Some(lone), None) | (None, Some(lone)) => {
                return self.report_as(
                    code::CONTRADICTION,
                    lone.span(),
                    "one position limit without the other",
                    "expected both position_min and position_max, or neither",
                );
            }
        };
        if let Some(unwind) = unwind {
            let problem = Problem::new(code::CONTRADICTION, min.span());
            let problem = problem.title("an axis without ends has no position limits");
            let problem = problem.expected("expected no position_min and position_max");
            self.problems.push(problem.related(unwind.span(), "the axis starts anew after these counts"));
            return None;
        }
        let low = self.fine(min, "the position limit", NANO)?;
        let high = self.fine(max, "the position limit", NANO)?;
        if low >= high {
            return self.report_as(
                code::CONTRADICTION,
                max.span(),
                format_args!("position_max {} is not above position_min {}", max.get_ref(), min.get_ref()),
                "expected more than position_min",
            );
        }
        Some((Some(Position(low)), Some(Position(high))))
    }

    /// An optional value above zero in fine units.
    pub(super) fn positive(
        &mut self,
        value: Option<&Spanned<f64>>,
        what: &str,
        scale: Option<Ratio>,
    ) -> Option<Option<i64>> {
        let Some(value) = value else { return Some(None) };
        match self.fine(value, what, scale)? {
            fine if fine > 0 => Some(Some(fine)),
            _ => self.report_as(
                code::OUT_OF_RANGE,
                value.span(),
                format_args!("{what} is {}", value.get_ref()),
                "expected a number above 0",
            ),
        }
    }

    /// A value in fine units, rounded to the nearest.
    pub(super) fn fine(&mut self, value: &Spanned<f64>, what: &str, scale: Option<Ratio>) -> Option<i64> {
        match scale?.apply_f64(*value.get_ref(), Rounding::Nearest) {
            Ok(fine) => Some(fine),
            Err(_) => self.report_as(
                code::OUT_OF_RANGE,
                value.span(),
                format_args!("{what} {} is too large", value.get_ref()),
                "expected a number that fits 64 bits in units of 1e-9",
            ),
        }
    }

    /// The drives of all buses by their names.
    fn drives<'a>(&mut self, file: &'a File) -> Vec<(&'a Spanned<String>, DriveAt)> {
        let south = file.south.get_ref();
        let sercos = south.sercos.iter().flat_map(|table| table.get_ref().drive.iter().enumerate());
        let mut drives: Vec<_> =
            sercos.map(|(drive, table)| (&table.get_ref().name, DriveAt::Sercos { drive })).collect();
        for (bus, table) in south.can.iter().enumerate() {
            let all = table.get_ref().drive.iter().enumerate();
            drives.extend(all.map(|(drive, table)| (&table.get_ref().name, DriveAt::Can { bus, drive })));
        }
        for (network, table) in south.devicenet.iter().enumerate() {
            let all = table.get_ref().drive.iter().enumerate();
            let at = |drive| DriveAt::Devicenet { network, drive };
            drives.extend(all.map(|(drive, table)| (&table.get_ref().name, at(drive))));
        }
        let names: Vec<_> = drives.iter().map(|(name, _)| (*name).clone()).collect();
        self.unique("the drive name", &names);
        drives
    }

    fn sercos(&mut self, table: &SercosTable) -> Option<Sercos> {
        let link = self.link(&table.interface, table.ring_interface.as_ref());
        let cycle_time = self.cycle_time(&table.cycle_time);
        let least = MasterConfig::setup_cycle_least(Sercos::slaves_max(table.drive.len()));
        let setup_cycle = match &table.setup_cycle {
            Some(text) => self.setup_cycle(text, DurationNs(i64::from(least))).map(Some),
            None => Some(None),
        };
        let master_mac = match &table.master_mac {
            Some(text) => self.mac(text).map(Some),
            None => Some(None),
        };
        let jitter = self.jitter(table.jitter.as_ref(), cycle_time);
        let cp0_stable_cycles = self.number_or(
            table.cp0_stable_cycles.as_ref(),
            "the number of stable cycles",
            1..=1000,
            DEFAULT_CP0_STABLE_CYCLES,
        );
        let allowed_losses = self.number_or(
            table.allowed_losses.as_ref(),
            "the number of allowed losses",
            1..=65_535,
            DEFAULT_ALLOWED_LOSSES,
        );
        self.unique("the SERCOS address", &names(&table.drive, |drive| &drive.address));
        let drives: Vec<_> = table.drive.iter().map(|drive| self.drive(drive.get_ref())).collect();
        let later = || table.drive.iter().filter_map(|drive| drive.get_ref().hot_plug.as_ref());
        let all = later().filter(|hot_plug| *hot_plug.get_ref()).count() == table.drive.len();
        if let Some(first) = later().next().filter(|_| all) {
            self.report::<()>(
                first.span(),
                "every drive has `hot_plug = true`",
                "expected at least one drive without it: a bus on which nobody is does not run, and drives are plugged in \
                 while it runs",
            );
        }
        Some(Sercos {
            link: link?,
            cycle_time: cycle_time?,
            setup_cycle: setup_cycle?,
            master_mac: master_mac?,
            jitter: jitter?,
            cp0_stable_cycles: cp0_stable_cycles?,
            allowed_losses: allowed_losses?,
            addresses: match table.assign_addresses {
                Some(true) => AddressPolicy::Assign,
                Some(false) | None => AddressPolicy::Refuse,
            },
            drives: drives.into_iter().collect::<Option<_>>()?,
        })
    }

    /// Without any bus there is nothing behind the box.
    fn some_bus(&mut self, table: &Spanned<SouthTable>) {
        let south = table.get_ref();
        if south.sercos.is_none() && south.can.is_empty() && south.devicenet.is_empty() {
            self.report::<()>(
                table.span(),
                "the gateway has no bus",
                "expected [south.sercos], [[south.can]] or [[south.devicenet]]",
            );
        }
    }

    /// No two buses share a CAN interface.
    fn interfaces(&mut self, south: &SouthTable) {
        let all = names(&south.can, |bus| &bus.interface);
        let all = all.into_iter().chain(names(&south.devicenet, |network| &network.interface));
        let real: Vec<_> = all.filter(|name| name.get_ref() != IN_PROCESS).collect();
        self.unique("the CAN interface", &real);
    }

    fn link(&mut self, name: &Spanned<String>, ring: Option<&Spanned<String>>) -> Option<Link> {
        let first = self.interface(name);
        let second = ring.map(|ring| self.interface(ring));
        let Some(ring) = ring else {
            return first.map(|first| match first {
                None => Link::InProcess { ring: false },
                Some(name) => Link::Interface { name, ring: None },
            });
        };
        match (first?, second??) {
            (None, None) => Some(Link::InProcess { ring: true }),
            (Some(first), Some(second)) if first != second => {
                Some(Link::Interface { name: first, ring: Some(second) })
            }
            (Some(first), Some(_)) => self.report(
                ring.span(),
                format_args!("`{first}` is the interface of the first port already"),
                "expected another interface: both ends of a ring have a port of their own",
            ),
            _ => self.report_as(
                code::CONTRADICTION,
                ring.span(),
                "simulated and real drives cannot share a ring",
                "expected two names of interfaces, or \"in-process\" for both",
            ),
        }
    }

    /// The name of an interface, `None` for drives in the process.
    #[expect(clippy::option_option, reason = "the outer one says that there is an error, as everywhere here")]
    pub(super) fn interface(&mut self, name: &Spanned<String>) -> Option<Option<String>> {
        let text = name.get_ref();
        if text == IN_PROCESS {
            return Some(None);
        }
        if text.is_empty() || text.len() > INTERFACE_LEN_MAX || text.contains(['/', ' ', '\0']) {
            return self.report(
                name.span(),
                format_args!("`{text}` cannot be a network interface"),
                "expected the name of an interface, 1 to 15 characters, or \"in-process\"",
            );
        }
        Some(Some(text.clone()))
    }

    fn cycle_time(&mut self, text: &Spanned<String>) -> Option<DurationNs> {
        let time = self.time_span(text)?;
        let long = (CYCLE_STEP_NS..=CYCLE_MAX_NS).contains(&time.0) && time.0 % CYCLE_STEP_NS == 0;
        if long || SHORT_CYCLES_NS.contains(&time.0) {
            return Some(time);
        }
        self.report(
            text.span(),
            format_args!("{} is not a SERCOS III cycle time", duration::show(time)),
            "expected 31.25 us, 62.5 us, 125 us, 250 us, or a multiple of 250 us up to 65 ms",
        )
    }

    fn setup_cycle(&mut self, text: &Spanned<String>, least: DurationNs) -> Option<DurationNs> {
        let time = self.time_span(text)?;
        if (least.0..=CYCLE_MAX_NS).contains(&time.0) && time.0 % CYCLE_STEP_NS == 0 {
            return Some(time);
        }
        self.report(
            text.span(),
            format_args!("{} cannot be the cycle of phases 0 to 2", duration::show(time)),
            format_args!("expected a multiple of 250 us from {} to 65 ms", duration::show(least)),
        )
    }

    fn jitter(&mut self, text: Option<&Spanned<String>>, cycle: Option<DurationNs>) -> Option<DurationNs> {
        let Some(text) = text else {
            return cycle.map(|cycle| DEFAULT_JITTER.min(DurationNs(cycle.0 / 4)));
        };
        let jitter = self.time_span(text)?;
        let most = DurationNs(cycle?.0 / 4);
        if (DurationNs(1_000)..=most).contains(&jitter) {
            return Some(jitter);
        }
        self.report(
            text.span(),
            format_args!("a jitter of {} does not suit the cycle", duration::show(jitter)),
            format_args!("expected 1 us to a quarter of the cycle, {}", duration::show(most)),
        )
    }

    fn mac(&mut self, text: &Spanned<String>) -> Option<[u8; 6]> {
        let bytes: Vec<u8> = text
            .get_ref()
            .split(':')
            .filter(|part| part.len() == 2)
            .filter_map(|part| u8::from_str_radix(part, 16).ok())
            .collect();
        match <[u8; 6]>::try_from(bytes) {
            // A group address cannot send, and all zeroes is no address.
            Ok(mac) if text.get_ref().len() == 17 && mac[0] & 1 == 0 && mac != [0; 6] => Some(mac),
            _ => self.report(
                text.span(),
                format_args!("`{}` is not the Ethernet address of a station", text.get_ref()),
                "expected six bytes, such as \"02:00:00:00:00:01\", the first one even",
            ),
        }
    }

    /// How long before its instant the work for a cycle begins.
    fn lead(&mut self, table: Option<&RealtimeTable>) -> Option<DurationNs> {
        let Some(text) = table.and_then(|table| table.lead.as_ref()) else { return Some(DEFAULT_LEAD) };
        let lead = self.time_span(text)?;
        if (DurationNs::ZERO..=LEAD_MAX).contains(&lead) {
            return Some(lead);
        }
        self.report(
            text.span(),
            format_args!("a lead of {} is too long", duration::show(lead)),
            format_args!("expected \"0 us\" to \"{}\"", duration::show(LEAD_MAX)),
        )
    }

    fn realtime(&mut self, table: Option<&RealtimeTable>) -> Option<realtime::Request> {
        let priority = self.number_or(
            table.and_then(|table| table.priority.as_ref()),
            "the priority",
            0..=i64::from(PRIORITY_MAX),
            DEFAULT_PRIORITY,
        );
        let cpu = match table.and_then(|table| table.cpu.as_ref()) {
            Some(cpu) => self.number(cpu, "the processor", 0..=1023).map(Some),
            None => Some(None),
        };
        let lock_memory = table.and_then(|table| table.lock_memory).unwrap_or(true);
        Some(realtime::Request {
            priority: priority.map(|priority| (priority > 0).then_some(priority))?,
            cpu: cpu?,
            lock_memory,
            stay_awake: table.and_then(|table| table.stay_awake).unwrap_or(false),
        })
    }

    fn drive(&mut self, table: &DriveTable) -> Option<Drive> {
        let name = self.name("drive", &table.name);
        let address = self.number(&table.address, "the SERCOS address", 1..=SERCOS_ADDRESS_MAX);
        let rated = match &table.rated_torque {
            None => Some(None),
            Some(text) => match rated::parse(text.get_ref()) {
                Some(rated) => Some(Some(rated)),
                None => self.report(
                    text.span(),
                    format_args!("`{}` is not a torque or force", text.get_ref()),
                    rated::EXPECTED,
                ),
            },
        };
        let set_scaling = table.set_scaling.unwrap_or(false);
        let acknowledges = table.acknowledges.unwrap_or(true);
        let hot_plug = table.hot_plug.as_ref().is_some_and(|hot_plug| *hot_plug.get_ref());
        let modes = match &table.modes {
            None => Some(None),
            Some(names) if names.get_ref().is_empty() => self.report(
                names.span(),
                "an axis without a mode",
                "expected at least one mode of \"position\", \"velocity\" and \"torque\"",
            ),
            Some(names) => self.words(names, "mode", &super::can::MODES).map(Some),
        };
        Some(Drive {
            name: name?,
            address: address?,
            set_scaling,
            acknowledges,
            modes: modes?,
            rated: rated?,
            hot_plug,
        })
    }

    /// A name that other parts of the file refer to.
    pub(super) fn name(&mut self, what: &str, name: &Spanned<String>) -> Option<String> {
        let text = name.get_ref();
        let good = text.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-_".contains(&byte));
        if good && (1..=NAME_LEN_MAX).contains(&text.len()) {
            return Some(text.clone());
        }
        self.report(
            name.span(),
            format_args!("`{text}` cannot be the name of a {what}"),
            "expected 1 to 32 letters, digits, `-` and `_`",
        )
    }

    /// A name for people.
    fn label(&mut self, what: &str, name: &Spanned<String>) -> Option<String> {
        let text = name.get_ref();
        let good = text.bytes().all(|byte| (0x20..0x7F).contains(&byte)) && !text.trim().is_empty();
        if good && text.len() <= NAME_LEN_MAX {
            return Some(text.clone());
        }
        self.report(
            name.span(),
            format_args!("`{text}` cannot be the name of {what}"),
            "expected 1 to 32 printable ASCII characters",
        )
    }

    pub(super) fn time_span(&mut self, text: &Spanned<String>) -> Option<DurationNs> {
        match duration::parse(text.get_ref()) {
            Some(time) => Some(time),
            None => self.report(
                text.span(),
                format_args!("`{}` is not a time", text.get_ref()),
                format_args!("expected {}", duration::EXPECTED),
            ),
        }
    }

    fn own_address(&mut self, text: &Spanned<String>) -> Option<Ipv4Addr> {
        match text.get_ref().parse::<Ipv4Addr>() {
            Ok(address)
                if !address.is_unspecified() && !address.is_multicast() && !address.is_broadcast() =>
            {
                Some(address)
            }
            _ => self.report(
                text.span(),
                format_args!("`{}` is not an address that a device can have", text.get_ref()),
                "expected one IPv4 address of this host, without port, such as \"192.168.1.10\"",
            ),
        }
    }

    fn socket_address(&mut self, text: &Spanned<String>) -> Option<SocketAddr> {
        match text.get_ref().parse() {
            Ok(address) => Some(address),
            Err(_) => self.report(
                text.span(),
                format_args!("`{}` is not an address with a port", text.get_ref()),
                "expected an address such as \"0.0.0.0:502\" or \"[::]:502\"",
            ),
        }
    }

    pub(super) fn number<T: TryFrom<i64>>(
        &mut self,
        value: &Spanned<i64>,
        what: &str,
        range: RangeInclusive<i64>,
    ) -> Option<T> {
        let given = *value.get_ref();
        match T::try_from(given) {
            Ok(number) if range.contains(&given) => Some(number),
            _ => self.report_as(
                code::OUT_OF_RANGE,
                value.span(),
                format_args!("{what} is {given}"),
                format_args!("expected {} to {}", range.start(), range.end()),
            ),
        }
    }

    pub(super) fn number_or<T: TryFrom<i64>>(
        &mut self,
        value: Option<&Spanned<i64>>,
        what: &str,
        range: RangeInclusive<i64>,
        default: T,
    ) -> Option<T> {
        match value {
            Some(value) => self.number(value, what, range),
            None => Some(default),
        }
    }
}

/// Axis units to units of 1e-9.
pub(super) const NANO: Option<Ratio> = Ratio::new(1_000_000_000, 1);

/// Percent to parts per million.
const PERCENT_TO_PPM: Option<Ratio> = Ratio::new(10_000, 1);

/// One key of every table of a list, with its place.
pub(super) fn names<T, V: Clone>(tables: &[Spanned<T>], key: impl Fn(&T) -> &Spanned<V>) -> Vec<Spanned<V>> {
    tables.iter().map(|table| key(table.get_ref()).clone()).collect()
}
