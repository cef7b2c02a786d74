//! The configurations of CANopen devices: as a text (DCF), or concise as object 1F22 has them.
//!
//! The box writes what a file says and keeps off what it sets itself: PDOs that it maps, SYNC, supervision, and what moves a
//! drive.

use std::path::Path;

use profile_cia402::drive::index;
use profile_cia402::eds::concise::{self, Entry};
use profile_cia402::eds::drive::{Direction, Pdo};
use profile_cia402::eds::{self, DeviceDescription, Diagnostic, Severity};
use profile_cia402::master::config::{Expected, Stamp, Write};
use profile_cia402::sdo::request::SdoData;
use profile_cia402::wire::{Mux, NodeId};

use super::file::CanDeviceTable;
use super::known_object::KnownObject;
use super::{CanDevice, DeviceFile, Written};
use crate::finding::registry as code;
use crate::finding::{Code, Findings, Problem, Source, read_bytes};

/// So many objects are named of those that are not written.
const NAMED_MAX: usize = 8;

/// Days of a stamp: a century from 1984-01-01 on.
const DAYS: u64 = 36_525;
const MILLISECONDS_OF_A_DAY: u64 = 86_400_000;

/// What moves a drive, or says how it does.
const COMMANDS: [u16; 11] = [
    index::CONTROLWORD,
    index::VL_TARGET_VELOCITY,
    index::MODE,
    index::TARGET_TORQUE,
    index::TARGET_POSITION,
    index::POSITION_OFFSET,
    index::VELOCITY_OFFSET,
    index::TORQUE_OFFSET,
    index::PROBE_FUNCTION,
    index::INTERPOLATION_DATA,
    index::TARGET_VELOCITY,
];

/// Reads the files that a configuration names; whether all of them can be used. `folder` is where their paths count from.
pub(super) fn load(folder: &Path, written: &mut Written, findings: &mut Findings) -> bool {
    let Written { text, file, config } = written;
    let mut good = true;
    for (bus, table) in config.can.iter_mut().zip(&file.south.get_ref().can) {
        for (device, table) in bus.devices.iter_mut().zip(&table.get_ref().device) {
            let table = table.get_ref();
            device.eds = device.eds.take().map(|path| folder.join(path));
            if let Some(path) = &table.configuration {
                let path = folder.join(path.get_ref());
                good &= Loader { text, table, path: &path, device, findings }.load().is_some();
            }
        }
    }
    good
}

/// What is written, the PDOs that the device has then, where the file reports them, and its objects.
type Values = (Vec<Write>, Option<[Vec<Pdo>; 2]>, Vec<KnownObject>);

/// Reads one file.
struct Loader<'l> {
    /// The configuration of the gateway, and what it says of the device.
    text: &'l Source,
    table: &'l CanDeviceTable,
    path: &'l Path,
    device: &'l mut CanDevice,
    findings: &'l mut Findings,
}

impl Loader<'_> {
    fn load(&mut self) -> Option<()> {
        let most = u64::try_from(eds::BYTES_MAX).unwrap_or(u64::MAX);
        let bytes = match read_bytes(self.path, most) {
            Ok(bytes) => bytes,
            Err((code, expected)) => {
                let problem = Problem::new(code, self.span()).expected(expected);
                return self.report(problem.help("the path starts at the folder of the configuration"));
            }
        };
        // Fewer than 2^24 entries are in a file that may be read, and no text has a zero.
        let (writes, pdos, objects) = if bytes.get(..4).is_some_and(|count| count[3] == 0) {
            (self.concise(&bytes)?, None, Vec::new())
        } else {
            self.text(&bytes)?
        };
        if writes.is_empty() && !(self.device.keeps_mapping && pdos.is_some()) {
            let problem = Problem::new(code::DEVICE_FILE, self.span());
            let problem = problem.title("the file has no values for the device");
            return self.report(
                problem.expected("expected a `ParameterValue` that the gateway does not set itself"),
            );
        }
        self.device.file = Some(DeviceFile { stamp: stamp(&writes), writes, pdos, objects });
        Some(())
    }

    fn span(&self) -> core::ops::Range<usize> {
        self.table.configuration.as_ref().map_or(0..0, |path| path.span())
    }

    /// Notes something about the key of the file.
    fn report<T>(&mut self, problem: Problem) -> Option<T> {
        self.findings.push(self.text, problem.key("configuration"));
        None
    }

    fn concise(&mut self, bytes: &[u8]) -> Option<Vec<Write>> {
        match concise::parse(bytes) {
            Ok(entries) => {
                let source = Source::new(&self.path.display().to_string(), "");
                self.writes(&source, entries)
            }
            Err(error) => {
                self.findings.push_file(code::DEVICE_FILE, self.path, error.to_string());
                None
            }
        }
    }

    fn text(&mut self, bytes: &[u8]) -> Option<Values> {
        let reading = match eds::read(bytes) {
            Ok(reading) => reading,
            Err(error) => {
                self.findings.push_file(code::DEVICE_FILE, self.path, error.to_string());
                return None;
            }
        };
        let text = shown(bytes);
        if !text.lines().any(is_of_a_data_sheet) {
            let problem = Problem::new(code::DEVICE_FILE, self.span());
            let problem = problem.title("the file is neither an EDS nor a DCF");
            return self
                .report(problem.expected("expected a file with sections such as [FileInfo] and [1000]"));
        }
        let source = Source::new(&self.path.display().to_string(), &text);
        let mut good = true;
        for diagnostic in reading.diagnostics.list() {
            let code = match diagnostic.severity() {
                Severity::Note => continue,
                Severity::Error if counts(diagnostic) => code::DEVICE_FILE,
                Severity::Warning | Severity::Error => code::DEVICE_FILE_ODD,
            };
            good &= code != code::DEVICE_FILE;
            self.findings.push(&source, problem(&source, code, diagnostic));
        }
        let description = reading.description;
        self.is_for(&description).filter(|()| good)?;
        let node = self.device.node.get();
        let configuration = description.configuration(node);
        for (index, sub) in &configuration.left_out {
            let writable = description.sub(*index, *sub).is_some_and(|value| value.access.writes());
            if writable && !is_own(*index, self.device.keeps_mapping) {
                let object = Mux::new(*index, *sub);
                let problem = Problem::new(code::DEVICE_FILE_ODD, place(&source, object));
                let problem = problem.title(format!("the value of {object} is not written"));
                let why = "expected one that may be downloaded (ObjFlags), of a type with bytes";
                self.findings.push(&source, problem.expected(why));
            }
        }
        let writes =
            self.writes(&source, configuration.writes.iter().map(concise::Write::entry).collect())?;
        let pdos = Direction::BOTH.map(|way| description.pdos(way, node));
        let pdos = Some(pdos).filter(|pdos| pdos.iter().any(|pdos| !pdos.is_empty()));
        Some((writes, pdos, KnownObject::of_description(&description)))
    }

    /// What is written of these; the rest is told.
    fn writes(&mut self, source: &Source, entries: Vec<Entry<'_>>) -> Option<Vec<Write>> {
        let (own, others): (Vec<Entry<'_>>, Vec<Entry<'_>>) =
            entries.into_iter().partition(|entry| is_own(entry.index, self.device.keeps_mapping));
        if let Some(first) = own.first() {
            let mut objects: Vec<Mux> = own.iter().map(|entry| Mux::new(entry.index, entry.sub)).collect();
            objects.sort_unstable();
            objects.dedup();
            let mut names: Vec<_> = objects.iter().take(NAMED_MAX).map(ToString::to_string).collect();
            names.extend((objects.len() > NAMED_MAX).then(|| format!("{} more", objects.len() - NAMED_MAX)));
            let span = place(source, Mux::new(first.index, first.sub));
            let problem = Problem::new(code::DEVICE_FILE_ODD, span);
            let title = format!("what the gateway sets itself is not written: {}", names.join(", "));
            self.findings.push(source, problem.title(title));
        }
        if let Some(empty) = others.iter().find(|entry| entry.data.is_empty()) {
            let object = Mux::new(empty.index, empty.sub);
            let problem = Problem::new(code::DEVICE_FILE, place(source, object));
            self.findings.push(source, problem.title(format!("{object} is given no bytes")));
            return None;
        }
        let write = |entry: &Entry<'_>| {
            let data = SdoData::inline(entry.data).unwrap_or_else(|| SdoData::Buffer(entry.data.to_vec()));
            Write { object: Mux::new(entry.index, entry.sub), data }
        };
        Some(others.iter().map(write).collect())
    }

    /// Whether the file is for this device; what it is for is expected of the device.
    fn is_for(&mut self, description: &DeviceDescription) -> Option<()> {
        let known = |number: Option<u32>| number.filter(|number| *number != 0);
        let Expected { vendor, product, .. } = &mut self.device.expected;
        let numbers = [
            ("vendor-ID", vendor, known(description.device.vendor_number)),
            ("product code", product, known(description.device.product_number)),
        ];
        let mut other = None;
        for (key, expected, of_file) in numbers {
            match (*expected, of_file) {
                (Some(expected), Some(of_file)) if expected != of_file => {
                    other = other.or(Some((key, expected, of_file)));
                }
                (None, Some(of_file)) => *expected = Some(of_file),
                _ => {}
            }
        }
        if let Some((key, expected, of_file)) = other {
            let problem = Problem::new(code::DEVICE_FILE, self.span());
            let problem = problem.title(format!("the file is for a device with the {key} {of_file:#x}"));
            return self.report(problem.expected(format!("expected {expected:#x}, as `identity` says")));
        }
        let made_for = description.commissioning.as_ref().and_then(|commissioning| commissioning.node_id);
        if let Some(node) =
            made_for.and_then(|node| NodeId::new(node).ok()).filter(|node| *node != self.device.node)
        {
            let problem = Problem::new(code::DEVICE_FILE_ODD, self.span());
            let problem = problem.title(format!("the file was made for node-id {node}"));
            let expected =
                format!("expected {}: values with $NODEID are right, others may not be", self.device.node);
            self.report::<()>(problem.expected(expected));
        }
        Some(())
    }
}

/// Whether the gateway sets an object itself where it maps the PDOs, or whether writing it would undo what the gateway needs.
#[must_use]
pub fn is_set_by_gateway(index: u16) -> bool {
    is_own(index, false)
}

/// Whether the gateway sets an object itself, or whether writing it would undo what the gateway needs.
fn is_own(index: u16, keeps_mapping: bool) -> bool {
    match index {
        // SYNC, guarding, storing and restoring, EMCY, heartbeats, the stamp; programs; network management.
        0x1005..=0x1007 | 0x100C | 0x100D | 0x1010 | 0x1011 | 0x1014 | 0x1016 | 0x1017 | 0x1019 | 0x1020 => {
            true
        }
        0x1F50..=0x1F5F | 0x1F80..=0x1F8F => true,
        0x1400..=0x1BFF => !keeps_mapping,
        0x6000..=0x9FFF => COMMANDS.contains(&index::on_first_axis(index)),
        _ => false,
    }
}

/// By what a device tells that it has these values: as good as never the same for others.
fn stamp(writes: &[Write]) -> Stamp {
    let bytes = concise::emit(writes.iter().map(|Write { object, data }| Entry {
        index: object.index,
        sub: object.sub,
        data: data.as_slice(),
    }));
    // FNV-1a.
    let hash = bytes.iter().fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01B3)
    });
    let number = |value: u64| u32::try_from(value).unwrap_or(u32::MAX);
    // Not 0, which a device reports that has none.
    let date = number(hash / MILLISECONDS_OF_A_DAY % DAYS + 1);
    Stamp { date, time: number(hash % MILLISECONDS_OF_A_DAY) }
}

/// Whether a line is the head of a section that only data sheets have.
pub(crate) fn is_of_a_data_sheet(line: &str) -> bool {
    let Some(name) = line.trim().strip_prefix('[').and_then(|rest| rest.split(']').next()) else {
        return false;
    };
    let known = ["FileInfo", "DeviceInfo", "MandatoryObjects", "OptionalObjects", "ManufacturerObjects"];
    let is_object = name.get(..4).is_some_and(|index| index.bytes().all(|digit| digit.is_ascii_hexdigit()));
    is_object || known.iter().any(|known| name.eq_ignore_ascii_case(known))
}

/// Whether what is wrong can cost a value that is to be written.
fn counts(diagnostic: &Diagnostic) -> bool {
    let aside = ["DefaultValue", "LowLimit", "HighLimit"];
    let head = ["[FileInfo]", "[DeviceInfo]", "[Comments]", "[DeviceComissioning]", "[DeviceCommissioning]"];
    !(aside.iter().any(|key| diagnostic.place.ends_with(key))
        || head.iter().any(|section| diagnostic.place.starts_with(section)))
}

/// A file as it is shown: with the lines that its reader counts.
pub(crate) fn shown(bytes: &[u8]) -> String {
    eds::plain(bytes).replace("\r\n", "\n").replace('\r', "\n")
}

pub(crate) fn problem(source: &Source, code: Code, diagnostic: &Diagnostic) -> Problem {
    let at = |number: u32| usize::try_from(number).unwrap_or(usize::MAX);
    let span = source.rest_of_line(at(diagnostic.line), at(diagnostic.column)).unwrap_or(0..0);
    let place = if diagnostic.place.is_empty() { code.title() } else { &diagnostic.place };
    Problem::new(code, span)
        .title(format!("{place} ({})", diagnostic.kind))
        .expected(format!("expected {}, got {}", diagnostic.expected, diagnostic.got))
}

/// The section of an object in a text; its beginning where there is none.
pub(crate) fn place(source: &Source, object: Mux) -> core::ops::Range<usize> {
    let Mux { index, sub } = object;
    let names = [format!("[{index:04X}sub{sub:X}]"), format!("[{index:04X}]"), format!("[{index:04X}Value]")];
    let find = |name: &String| source.find_line(|line| line.trim().eq_ignore_ascii_case(name));
    names.iter().find_map(find).unwrap_or(0..0)
}
