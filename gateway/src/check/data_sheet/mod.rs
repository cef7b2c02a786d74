//! What a CANopen device lacks, by its data sheet, of what the configuration needs of it: found before it is on the bus.
//!
//! [`rehearsal`] commissions the device as the box does, with answers from the file; [`pdos`] follows the set-up of its PDOs, and
//! [`Device`] what comes before both. A device that would be left out is an error, with the reason that the box would log.

mod file;
mod pdos;
mod rehearsal;

use std::ops::Range;

use profile_cia402::drive::index::on_first_axis;
use profile_cia402::eds::DeviceDescription;
use profile_cia402::master::config::MasterConfig;
use profile_cia402::wire::Mux;

use self::file::Sheet;
use self::pdos::{Refusal, Trouble, troubles};
use self::rehearsal::{End, Rehearsal, rehearse};
use crate::config::file::CanDeviceTable;
use crate::config::{Can, CanDevice, Written};
use crate::engine::build::can::network;
use crate::engine::bus::can::commissioner::AxisSetup;
use crate::engine::bus::can::failure::{Misfit, StepFailure};
use crate::engine::notice::Notice;
use crate::finding::registry as code;
use crate::finding::{Code, Findings, Problem, Source};
use crate::mapping::{Cia402Error, DriveProgram, Mapping, Object};

/// So many objects are named in a sentence.
const NAMED_MAX: usize = 8;

/// Checks each device whose configuration names its data sheet.
pub(super) fn check(mapping: &Mapping, written: &Written, findings: &mut Findings) {
    let tables = &written.file.south.get_ref().can;
    for (place, (bus, table)) in written.config.can.iter().zip(tables).enumerate() {
        for (device, table) in bus.devices.iter().zip(&table.get_ref().device) {
            let table = table.get_ref();
            let (Some(path), Some(key)) = (&device.eds, &table.eds) else { continue };
            let Some(sheet) = Sheet::load(written, device, path, key, findings) else { continue };
            // What is wrong without a data sheet is found elsewhere.
            let Ok(network) = network(&written.config, place, mapping) else { continue };
            let axes = network.devices.into_iter().find(|(node, _)| *node == device.node);
            let axes = axes.map(|(_, axes)| axes).unwrap_or_default();
            let mut source = written.text.clone();
            let start = source.push(sheet.path.as_str().into(), sheet.text.as_str().into());
            let span = key.span();
            let mut look =
                Device { mapping, written, bus, device, table, sheet: &sheet, source, start, span, findings };
            look.identity();
            look.bit_rate();
            look.supervision(&network.master);
            look.commissioning(&network.master, axes);
        }
    }
}

/// One device.
struct Device<'a> {
    mapping: &'a Mapping,
    written: &'a Written,
    bus: &'a Can,
    device: &'a CanDevice,
    table: &'a CanDeviceTable,
    sheet: &'a Sheet,
    /// The configuration, and the data sheet after it.
    source: Source,
    /// Where the data sheet begins there.
    start: usize,
    /// The key that names the data sheet.
    span: Range<usize>,
    findings: &'a mut Findings,
}

impl Device<'_> {
    fn description(&self) -> &DeviceDescription {
        &self.sheet.description
    }

    fn node(&self) -> u8 {
        self.device.node.get()
    }

    /// Reports something, with the place in the data sheet that it follows from, where there is one.
    fn report(&mut self, problem: Problem, object: Option<Mux>) {
        let place = object.map(|object| self.sheet.place(object)).filter(|place| !place.is_empty());
        let problem = match place {
            Some(place) => {
                let span = self.start + place.start..self.start + place.end;
                problem.related(span, "so the data sheet says")
            }
            None => problem,
        };
        self.findings.push(&self.source, problem);
    }

    fn problem(&self, code: Code, title: impl Into<String>) -> Problem {
        Problem::new(code, self.span.clone()).title(title).key("eds")
    }

    /// The place of an axis in the configuration: the modes of its drive where they are given, else its name.
    fn axis_span(&self, axis: u8, about_modes: bool) -> Range<usize> {
        let config = &self.written.config;
        let axis = config.axes.get(usize::from(axis));
        let Some((bus, drive)) = axis.and_then(|axis| config.can_drive(axis)) else {
            return self.span.clone();
        };
        let tables = config.can.iter().zip(&self.written.file.south.get_ref().can);
        let mut tables = tables
            .filter(|(known, _)| core::ptr::eq(*known, bus))
            .flat_map(|(known, table)| known.drives.iter().zip(&table.get_ref().drive));
        let Some((_, table)) = tables.find(|(known, _)| core::ptr::eq(*known, drive)) else {
            return self.span.clone();
        };
        let table = table.get_ref();
        let modes = table.modes.as_ref().filter(|_| about_modes);
        modes.map_or_else(|| table.name.span(), |modes| modes.span())
    }

    /// Whether it is the device that the configuration expects.
    fn identity(&mut self) {
        let (node, expected) = (self.node(), self.device.expected);
        let of_head = &self.description().device;
        let numbers = [
            (1, "vendor-ID", expected.vendor, of_head.vendor_number),
            (2, "product code", expected.product, of_head.product_number),
            (3, "revision number", expected.revision, of_head.revision_number),
            // A data sheet is that of all devices of a kind.
            (4, "serial number", expected.serial, None),
        ];
        for (sub, what, expected, of_head) in numbers {
            let Some(expected) = expected else { continue };
            let object = Mux::new(0x1018, sub);
            if let Err(code) = self.description().look_up(object) {
                let problem =
                    self.problem(code::SHEET_LACKS, format!("the device has no {what}: {object}: {code}"));
                let why = format!("expected {expected:#x}, which `identity` has the gateway compare");
                self.report(problem.expected(why).help(format!("remove the {what} from `identity`")), None);
                continue;
            }
            let said = self.description().number(object.index, sub, node).filter(|_| sub < 4);
            let found = said.filter(|number| *number != 0).or(of_head.filter(|number| *number != 0));
            if let Some(found) = found.filter(|found| *found != expected) {
                let problem = self.problem(
                    code::DATA_SHEET,
                    format!("the data sheet is of a device with the {what} {found:#x}"),
                );
                let problem = problem.expected(format!("expected {expected:#x}, as `identity` says"));
                self.report(problem, said.map(|_| object));
            }
        }
        let Some(profile) = expected.profile else { return };
        let object = Mux::DEVICE_TYPE;
        let found = self.description().number(object.index, 0, node);
        let help = "write `device_type = \"any\"` if it is a drive nevertheless";
        if let Some(found) = found.filter(|found| found & 0xFFFF != u32::from(profile)) {
            let title = format!("the data sheet is of a device of type {found:#x}, not of a drive");
            let problem = self.problem(code::DATA_SHEET, title);
            let expected = format!("expected the profile {profile} ({profile:#x}) in the low half of 1000");
            self.report(problem.expected(expected).help(help), Some(object));
        } else if let Err(code) = self.description().look_up(object) {
            let problem =
                self.problem(code::SHEET_LACKS, format!("the device has no type: {object}: {code}"));
            self.report(problem.expected(format!("expected the profile {profile}")).help(help), None);
        }
    }

    /// Whether it has the bit rate of the bus.
    fn bit_rate(&mut self) {
        let rate = self.bus.bit_rate.nominal();
        let has = &self.description().device.bit_rates;
        if has.is_empty() || has.iter().any(|known| u32::from(*known) * 1_000 == rate) {
            return;
        }
        let all: Vec<_> = has.iter().map(ToString::to_string).collect();
        let title = format!("the device does not have the bit rate of the bus, {} kbit/s", rate / 1_000);
        let problem = self.problem(code::SHEET_LACKS, title);
        let problem =
            problem.expected(format!("expected one of {} kbit/s, by the data sheet", all.join(", ")));
        self.report(problem.help("set `bit_rate` of the bus to one that all its devices have"), None);
    }

    /// Whether it takes what it gets before its axes are looked at, and what it is watched by.
    fn supervision(&mut self, master: &MasterConfig) {
        let Some(config) = master.nodes.iter().find(|known| known.node == self.device.node) else { return };
        let node = self.node();
        for write in &config.writes {
            if let Err(code) = self.description().takes(write.object, write.data.as_slice(), node) {
                let title = format!("the device does not take its `configuration`: {}: {code}", write.object);
                let problem = Problem::new(code::SHEET_LACKS, self.configuration_span()).title(title);
                self.report(problem.key("configuration"), Some(write.object));
            }
        }
        let number = |value: u16| value.to_le_bytes().to_vec();
        let heartbeat = config.heartbeat.map(|heartbeat| number(heartbeat.producer_ms));
        if let Some(bytes) = heartbeat
            && let Err(code) = self.description().takes(Mux::PRODUCER_HEARTBEAT, &bytes, node)
        {
            let object = Mux::PRODUCER_HEARTBEAT;
            let problem =
                self.problem(code::SHEET_LACKS, format!("the device has no heartbeat: {object}: {code}"));
            let problem =
                problem.expected("expected one, by which the gateway sees that the device is there");
            self.report(
                problem.help("write `guarding = \"100 ms\"` for this device, if it has node guarding"),
                Some(object),
            );
        }
        let factor = |factor: u8| vec![factor];
        let guarding = config.guarding.map(|guard| {
            [
                (Mux::GUARD_TIME, number(guard.guard_time_ms)),
                (Mux::LIFE_TIME_FACTOR, factor(guard.life_time_factor)),
            ]
        });
        for (object, bytes) in guarding.into_iter().flatten() {
            match self.description().takes(object, &bytes, node) {
                // One without it is guarded all the same; only it does not see that the gateway is lost.
                Err(code) if !code.is_absent() => {
                    let title = format!("the device cannot be guarded as configured: {object}: {code}");
                    let problem = self.problem(code::SHEET_LACKS, title);
                    self.report(problem, Some(object));
                }
                _ => {}
            }
        }
    }

    fn configuration_span(&self) -> Range<usize> {
        self.table.configuration.as_ref().map_or_else(|| self.span.clone(), |path| path.span())
    }

    /// Commissioning and PDOs.
    fn commissioning(&mut self, master: &MasterConfig, axes: Vec<AxisSetup>) {
        let numbers: Vec<u8> = axes.iter().map(|setup| u8::try_from(setup.axis).unwrap_or(u8::MAX)).collect();
        let sheet = self.sheet;
        let (mapping, node, description) = (self.mapping, self.device.node, &sheet.description);
        let run = |keeps| rehearse(mapping, master, node, axes.clone(), description, keeps);
        let mut rehearsal = run(false);
        let mut all = made(&rehearsal).map(|set| troubles(description, node, set)).unwrap_or_default();
        if let Some(Trouble::Mapping(first)) =
            all.iter().find(|trouble| !matches!(trouble, Trouble::Other(_))).cloned()
        {
            let refused = all.iter().filter_map(|trouble| match trouble {
                Trouble::Mapping(refusal) => Some(refusal.text.clone()),
                _ => None,
            });
            let refused = listed(refused.collect());
            rehearsal = run(true);
            let title = "the device does not let its PDOs be mapped: those that it has are used";
            let problem = self.problem(code::SHEET_WITHOUT, title).expected(refused);
            let problem = problem.help("write `pdo_mapping = \"keep\"`, if that is as it should be");
            self.report(problem, Some(first.object));
            all = made(&rehearsal).map(|set| troubles(description, node, set)).unwrap_or_default();
        }
        for trouble in all {
            self.trouble(trouble);
        }
        self.synchronization(&rehearsal);
        let Rehearsal { end, notices, unscaled } = rehearsal;
        for notice in notices {
            self.logged(notice);
        }
        if !unscaled.is_empty() {
            let names = listed(unscaled.iter().map(ToString::to_string).collect());
            let problem = self.problem(code::SHEET_SILENT, "the data sheet does not say what a count is");
            let problem = problem.expected(format!("expected values of {names}"));
            let help = "range and precision are not known before the drive is there; `counts` of the drive gives them";
            self.report(problem.help(help), unscaled.first().copied());
        }
        match end {
            Some(End::Failed(notice)) => self.failed(*notice),
            Some(End::Made(_, programs)) => {
                for (axis, program) in numbers.into_iter().zip(programs) {
                    self.parameters(axis, &program);
                }
            }
            None => {}
        }
    }

    fn trouble(&mut self, trouble: Trouble) {
        let (code, Refusal { object, text }, help) = match trouble {
            Trouble::Fatal(refusal) => (code::SHEET_PDOS, refusal, "the device is left out at start"),
            Trouble::Other(refusal) => (code::SHEET_WITHOUT, refusal, ""),
            // Those that the device has are used after the first of them, and none of them is written.
            Trouble::Mapping(_) => return,
        };
        let problem = self.problem(code, text).help(help);
        self.report(problem, Some(object));
    }

    /// A device without 1005 follows no SYNC, as far as the file says.
    fn synchronization(&mut self, rehearsal: &Rehearsal) {
        let object = Mux::new(profile_cia402::drive::index::COB_ID_SYNC, 0);
        let Err(code) = self.description().look_up(object) else { return };
        if made(rehearsal).is_some() {
            let problem =
                self.problem(code::SHEET_SILENT, format!("the data sheet has no SYNC: {object}: {code}"));
            let problem = problem.expected(
                "expected it with the identifier 0x80, by which set-points and actual values are taken",
            );
            self.report(problem.help("ask its maker whether the device follows SYNC"), None);
        }
    }

    /// The device would be left out.
    fn failed(&mut self, notice: Notice) {
        let (axis, code, text, object, about_modes) = match &notice {
            Notice::NodeProgram { axis, error: Misfit::Program(error), .. } => {
                let about_modes = matches!(
                    error,
                    Cia402Error::NotSupported { .. } | Cia402Error::NoneLeft(_) | Cia402Error::Missing { .. }
                );
                let object = match error {
                    Cia402Error::NotSupported { .. } | Cia402Error::NoneLeft(_) => Some(Mux::new(0x6502, 0)),
                    _ => None,
                };
                (*axis, code::SHEET_LACKS, error.to_string(), object, about_modes)
            }
            Notice::NodeProgram { axis, error, .. } => {
                (*axis, code::SHEET_PDOS, error.to_string(), None, true)
            }
            Notice::NodeCommissioning { axis, failure, .. } => {
                (*axis, code::SHEET_LACKS, failure.to_string(), Some(mux(failure.object)), false)
            }
            other => (u8::MAX, code::SHEET_LACKS, other.to_string(), None, false),
        };
        let title = format!("the axis cannot work with the drive of this data sheet: {text}");
        let problem = Problem::new(code, self.axis_span(axis, about_modes)).title(title);
        self.report(problem.help("the device is left out at start"), object);
    }

    /// What the gateway would log while it commissions the device.
    fn logged(&mut self, notice: Notice) {
        match notice {
            Notice::ModesTried { axis, .. } => {
                let problem = Problem::new(code::SHEET_SILENT, self.axis_span(axis, true))
                    .title("the data sheet does not say which modes of operation the drive has")
                    .expected("expected a value of 6502: the modes are tried when the drive is there");
                let help = "write `drive_modes` for this drive, from its manual";
                self.report(problem.help(help), Some(Mux::new(0x6502, 0)));
            }
            Notice::ObjectsPassedOver { axis, failures } => self.passed_over(axis, &failures),
            Notice::NodeModesLeftOut { axis, modes, .. } => {
                for (mode, why) in modes {
                    let problem = Problem::new(code::SHEET_WITHOUT, self.axis_span(axis, true));
                    let problem = problem.title(format!("the axis works without the mode {mode}"));
                    let object =
                        matches!(why, Cia402Error::NotSupported { .. }).then_some(Mux::new(0x6502, 0));
                    let help = "write `modes` for this drive with those that the axis is used for";
                    self.report(problem.expected(why.to_string()).help(help), object);
                }
            }
            Notice::NotMapped { axis, objects, .. } => {
                let names = listed(objects.iter().map(ToString::to_string).collect());
                let problem = Problem::new(code::SHEET_WITHOUT, self.axis_span(axis, false));
                let title = format!("the axis works without {names}: no PDO that can be used carries it");
                let problem = problem
                    .title(title)
                    .help("map it with the maker's tool, or leave it out of `actual_values`");
                self.report(problem, objects.first().map(|object| mux(*object)));
            }
            Notice::Period { axis, expected, found, .. } => {
                let problem = Problem::new(code::SHEET_WITHOUT, self.axis_span(axis, false));
                let title = format!(
                    "the drive expects set-points every {found} (60C2), and they come every {expected}"
                );
                let problem = problem.title(title);
                let help = "set its interpolation time with the maker's tool, or `cycle_time` of the bus";
                self.report(problem.help(help), Some(Mux::new(0x60C2, 1)));
            }
            _ => {}
        }
    }

    /// Steps that the drive does not take, and that may fail. What is only read says what there is.
    fn passed_over(&mut self, axis: u8, failures: &[StepFailure]) {
        for failure in failures.iter().filter(|failure| failure.what == "writing") {
            let problem = Problem::new(code::SHEET_WITHOUT, self.axis_span(axis, false));
            let problem = problem.title(format!("commissioning goes on without {failure}"));
            let is_period = on_first_axis(failure.object.index) == 0x60C2;
            let help = if is_period {
                "set the interpolation time of the drive to `cycle_time` with the maker's tool"
            } else {
                "set it in the drive with the maker's tool, if the axis needs it"
            };
            self.report(problem.help(help), Some(mux(failure.object)));
        }
    }

    /// Parameters of the tables whose object the drive lacks, or has otherwise: the attributes that stand for them.
    fn parameters(&mut self, axis: u8, program: &DriveProgram) {
        let mut missing = Vec::new();
        for known in self.mapping.dictionaries.generic.parameters() {
            let parameter = known.parameter;
            if self.mapping.object_parameter_row(parameter).is_none() {
                continue;
            }
            let Some(entry) = program.parameter(parameter) else {
                missing.push(known.name.clone());
                continue;
            };
            let Some(object) = crate::engine::bus::can::layout::object(entry.item) else { continue };
            let Ok(value) = self.description().look_up(mux(object)) else { continue };
            let bytes = value.data_type.bits().map(|bits| usize::from(bits).div_ceil(8));
            let (wrong, help) = if bytes.is_some_and(|bytes| bytes != entry.width.bytes()) {
                let title = format!(
                    "{}: {object} is {}, and the tables have {} bytes",
                    known.name,
                    value.data_type,
                    entry.width.bytes()
                );
                (title, "write the type of this drive into an overlay")
            } else if entry.to_drive.is_some() && !value.access.writes() {
                let title = format!("{} cannot be set: {object} is {}", known.name, value.access.word());
                (title, "the drive keeps its own; an attribute that is set to another value is refused")
            } else {
                continue;
            };
            let problem =
                Problem::new(code::SHEET_WITHOUT, self.axis_span(axis, false)).title(wrong).help(help);
            self.report(problem, Some(mux(object)));
        }
        if !missing.is_empty() {
            let problem = Problem::new(code::SHEET_NOTE, self.axis_span(axis, false));
            let title =
                format!("the drive has no object for {} of the parameters of the tables", missing.len());
            let problem = problem.title(title).expected(missing.join(", "));
            self.report(problem, None);
        }
    }
}

/// The PDOs that a commissioning came to.
fn made(rehearsal: &Rehearsal) -> Option<&profile_cia402::master::pdo_set::PdoSet> {
    match &rehearsal.end {
        Some(End::Made(set, _)) => Some(set),
        _ => None,
    }
}

fn mux(object: Object) -> Mux {
    Mux::new(object.index, object.sub)
}

/// Some of many, joined.
fn listed(mut names: Vec<String>) -> String {
    names.dedup();
    let more = names.len().saturating_sub(NAMED_MAX);
    names.truncate(NAMED_MAX);
    if more > 0 {
        names.push(format!("{more} more"));
    }
    names.join("; ")
}
