//! The start-up lists of a configuration: what the gateway sets itself, types that nobody says, values that a parameter cannot have.

use std::ops::Range;

use profile_sercos::wire::attribute::{Attribute, ItemLength};
use profile_sercos::wire::idn::Idn;

use crate::config::file::{CanDriveTable, DevicenetDriveTable, DriveTable};
use crate::config::{Axis, Written};
use crate::engine::build::startup::Reserved;
use crate::engine::build::{can, devicenet, sercos};
use crate::finding::registry as code;
use crate::finding::{Findings, Problem, Source, Spanned};
use crate::mapping::{Cia402Type, IdnUnit, Mapping};
use crate::parameter::attributes::attributes;
use crate::parameter::id::Id;
use crate::parameter::known::objects;
use crate::parameter::startup::{StartupEntry, StartupValue};
use crate::parameter::value::Kind;

/// So many parameters are named in one finding.
const NAMED_MAX: usize = 8;

/// Looks at the list of the drive of each axis.
pub(super) fn check(mapping: &Mapping, written: &Written, findings: &mut Findings) {
    let mut list = List { text: &written.text, findings };
    for axis in &written.config.axes {
        sercos_drive(&mut list, axis, written, mapping);
        can_drive(&mut list, axis, written, mapping);
        devicenet_drive(&mut list, axis, written, mapping);
    }
}

fn sercos_drive(list: &mut List<'_>, axis: &Axis, written: &Written, mapping: &Mapping) {
    let drive = written.config.sercos_drive(axis).filter(|drive| !drive.startup.is_empty());
    let Some(drive) = drive else { return };
    let reserved = Reserved::of_sercos(mapping, &sercos::needs(axis, drive));
    let mut tables = written.file.south.get_ref().sercos.iter().flat_map(|table| &table.get_ref().drive);
    let named = |table: &&Spanned<DriveTable>| is_named(&table.get_ref().name, &drive.name);
    let Some(table) = tables.find(named) else { return };
    let table = table.get_ref();
    list.file(&drive.startup, table.startup_file.as_ref(), &reserved);
    for (entry, table) in own(&drive.startup, &table.startup, |table| &table.parameter) {
        if list.is_free(entry, table.parameter.span(), &reserved) {
            list.idn(entry, table.parameter.span(), table.value.span(), mapping);
        }
    }
}

fn can_drive(list: &mut List<'_>, axis: &Axis, written: &Written, mapping: &Mapping) {
    let drive = written.config.can_drive(axis).filter(|(_, drive)| !drive.startup.is_empty());
    let Some((bus, drive)) = drive else { return };
    let reserved = Reserved::of_can(mapping, &can::needs(axis, bus, drive));
    let mut tables = written.file.south.get_ref().can.iter().flat_map(|table| &table.get_ref().drive);
    let named = |table: &&Spanned<CanDriveTable>| is_named(&table.get_ref().name, &drive.name);
    let Some(table) = tables.find(named) else { return };
    let table = table.get_ref();
    list.file(&drive.startup, table.startup_file.as_ref(), &reserved);
    let (_, known) = objects(bus, drive, mapping);
    for (entry, table) in own(&drive.startup, &table.startup, |table| &table.parameter) {
        let Id::Object(object) = entry.id else { continue };
        let known = known.iter().find(|known| known.object == object).and_then(|known| known.data_type);
        if list.is_free(entry, table.parameter.span(), &reserved) {
            list.object(entry, table.parameter.span(), table.value.span(), known);
        }
    }
}

fn devicenet_drive(list: &mut List<'_>, axis: &Axis, written: &Written, mapping: &Mapping) {
    let drive = written.config.devicenet_drive(axis).filter(|(_, drive)| !drive.startup.is_empty());
    let Some((network, drive)) = drive else { return };
    // Why there are none is found elsewhere.
    let Ok(parts) = devicenet::parts(network, drive, axis, mapping) else { return };
    let reserved = Reserved::of_devicenet(&parts.steps);
    let mut tables = written.file.south.get_ref().devicenet.iter().flat_map(|table| &table.get_ref().drive);
    let named = |table: &&Spanned<DevicenetDriveTable>| is_named(&table.get_ref().name, &drive.name);
    let Some(table) = tables.find(named) else { return };
    let table = table.get_ref();
    list.file(&drive.startup, table.startup_file.as_ref(), &reserved);
    let known = attributes(&drive.kind, mapping);
    for (entry, table) in own(&drive.startup, &table.startup, |table| &table.parameter) {
        let known = known.iter().find(|known| known.id == entry.id).and_then(|known| known.data_type());
        if list.is_free(entry, table.parameter.span(), &reserved) {
            list.object(entry, table.parameter.span(), table.value.span(), known);
        }
    }
}

fn is_named(name: &Spanned<String>, wanted: &str) -> bool {
    name.get_ref() == wanted
}

/// The entries of the configuration itself, each with its table.
fn own<'w, T>(
    startup: &'w [StartupEntry],
    tables: &'w [Spanned<T>],
    parameter: impl Fn(&T) -> &Spanned<String>,
) -> Vec<(&'w StartupEntry, &'w T)> {
    let find = |table: &'w Spanned<T>| {
        let id = Id::parse(parameter(table.get_ref()).get_ref())?;
        let entry = startup.iter().find(|entry| entry.id == id && !entry.from_file)?;
        Some((entry, table.get_ref()))
    };
    tables.iter().filter_map(find).collect()
}

/// The list of a drive.
struct List<'l> {
    text: &'l Source,
    findings: &'l mut Findings,
}

impl List<'_> {
    fn push(&mut self, problem: Problem) {
        self.findings.push(self.text, problem);
    }

    /// Whether the gateway leaves a parameter to the list.
    fn is_free(&mut self, entry: &StartupEntry, span: Range<usize>, reserved: &Reserved) -> bool {
        let Some(why) = reserved.why(entry.id) else { return true };
        let problem = Problem::new(code::STARTUP, span).key("parameter");
        let title = format!("{} cannot be in a start-up list", entry.id);
        self.push(problem.title(title).expected(format!("expected another parameter: {why}")));
        false
    }

    /// What of a file the gateway sets itself is not in the list.
    fn file(&mut self, startup: &[StartupEntry], file: Option<&Spanned<String>>, reserved: &Reserved) {
        let Some(file) = file else { return };
        let left: Vec<_> =
            startup.iter().filter(|entry| entry.from_file && reserved.why(entry.id).is_some()).collect();
        if left.is_empty() {
            return;
        }
        let mut names: Vec<_> = left.iter().take(NAMED_MAX).map(|entry| entry.id.to_string()).collect();
        names.extend((left.len() > NAMED_MAX).then(|| format!("{} more", left.len() - NAMED_MAX)));
        let title =
            format!("not in the start-up list, because the gateway sets it itself: {}", names.join(", "));
        self.push(Problem::new(code::STARTUP_ODD, file.span()).key("startup_file").title(title));
    }

    /// What the dictionary says of an IDN. What the drive says counts more.
    fn idn(&mut self, entry: &StartupEntry, span: Range<usize>, value: Range<usize>, mapping: &Mapping) {
        let Id::Idn(idn) = entry.id else { return };
        let Some(row) = mapping.dictionaries.sercos.idn(idn) else { return };
        if row.command {
            let problem = Problem::new(code::STARTUP, span).key("parameter");
            let problem = problem.title(format!("{idn} is a procedure command"));
            return self.push(problem.expected("expected a parameter with a value"));
        }
        let Some(attribute) = attribute(idn, mapping) else { return };
        if let Err(error) = entry.bytes(Kind::Sercos(attribute)) {
            let problem = Problem::new(code::STARTUP_ODD, value).key("value");
            let problem = problem.title(format!("the value does not fit {idn} ({})", row.name));
            self.push(problem.expected(format!("{error}; the attribute of the drive counts more")));
        }
    }

    /// The type of an object.
    fn object(
        &mut self,
        entry: &StartupEntry,
        span: Range<usize>,
        value: Range<usize>,
        known: Option<Cia402Type>,
    ) {
        let says_itself = matches!(&entry.value, StartupValue::Text(text) if text.contains(':'));
        match (entry.data_type, known) {
            (Some(own), Some(known)) if own != known => {
                let problem = Problem::new(code::STARTUP_ODD, span).key("type");
                let title = format!("the type of {} is {}", entry.id, known.name());
                self.push(problem.title(title).expected(format!("expected it, got {}", own.name())));
            }
            // Looked at with the configuration.
            (Some(_), _) => {}
            (None, Some(known)) => {
                if let Err(error) = entry.bytes(Kind::Object(known)) {
                    let problem = Problem::new(code::STARTUP, value).key("value");
                    let title = format!("the value is not a {}, as {} is one", known.name(), entry.id);
                    self.push(problem.title(title).expected(error.to_string()));
                }
            }
            (None, None) if says_itself && entry.bytes(Kind::Unknown).is_ok() => {}
            (None, None) => {
                let problem = Problem::new(code::STARTUP, span).key("type");
                let problem = problem.title(format!("nobody says the type of {}", entry.id));
                self.push(problem.expected("expected `type`, such as type = \"u32\""));
            }
        }
    }
}

/// The attribute of an IDN by the dictionary, where that says all of it that decides what the bytes of a value are.
fn attribute(idn: Idn, mapping: &Mapping) -> Option<Attribute> {
    let row = mapping.dictionaries.sercos.idn(idn)?;
    let length = match row.length_on_sercos_3()? {
        1 => ItemLength::One,
        2 => ItemLength::Two,
        4 => ItemLength::Four,
        8 => ItemLength::Eight,
        _ => return None,
    };
    let IdnUnit::Fixed { decimals, .. } = &row.unit else { return None };
    let attribute = Attribute::new(length, row.format?.of_attribute()).with_decimals(*decimals);
    Some(if row.list { attribute.list() } else { attribute })
}
