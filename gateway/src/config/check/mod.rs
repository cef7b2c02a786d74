//! From the file as written to the configuration as used; collects every fault.
//!
//! One file for each subject: its function `check` takes the tables of that subject and returns what they come to, or reports what is
//! wrong and returns `None`, so that the rest of the file is still checked.

pub(super) mod assembly;
pub(super) mod axis;
pub(super) mod can;
pub(super) mod can_device;
pub(super) mod device;
pub(super) mod devicenet;
mod hosts;
mod http;
mod limits;
pub(super) mod modbus;
pub(in crate::config) mod nameplate;
mod problems;
mod realtime;
mod recording;
mod references;
pub(super) mod sercos;
pub(super) mod startup;
pub(super) mod time;
mod value;

use std::path::PathBuf;

use profile_generic::time::DurationNs;

pub(crate) use self::realtime::DEFAULT_PRIORITY;
pub(crate) use self::sercos::{DEFAULT_ALLOWED_LOSSES, DEFAULT_JITTER};

use self::problems::Problems;
use super::file::{File, RealtimeTable, SouthTable};
use super::{AXES_MAX, Config, DEVICES_MAX, LogLevel};
use crate::finding::{Problem, Spanned};

/// What can be logged.
pub(super) fn log_levels() -> [(&'static str, LogLevel); 5] {
    LogLevel::ALL.map(|level| (level.name(), level))
}

/// Checks a file.
pub(super) fn check(file: &File) -> Result<Config, Vec<Problem>> {
    let mut problems = Problems::default();
    let config = check_file(&mut problems, file);
    problems.done(config)
}

fn check_file(problems: &mut Problems, file: &File) -> Option<Config> {
    let name = value::label(problems, "the box", &file.the_box.name);
    let log_level = log_level(problems, file);
    let modbus = value::optional(&file.modbus, |table| modbus::check(problems, table, &file.axis));
    let http = value::optional(&file.http, |table| http::check(problems, table, file.modbus.as_ref()));
    let recording = recording::check(problems, file.recording.as_ref());
    let mappings = file.mappings.as_ref();
    let paths = mappings.iter().flat_map(|table| table.dir.iter().chain(&table.overlays));
    for path in paths {
        value::path(problems, path, "mapping tables");
    }
    let path = |path: &Spanned<String>| PathBuf::from(path.get_ref());
    let mappings_dir = mappings.and_then(|table| table.dir.as_ref()).map(path);
    let overlays = mappings.iter().flat_map(|table| &table.overlays).map(path).collect();

    let settings_file = file.the_box.settings_file.as_ref();
    if let Some(path) = settings_file {
        value::path(problems, path, "the settings file");
    }
    let settings_file = settings_file.map(path);
    let history_dir = file.history.as_ref().map(|table| {
        value::path(problems, &table.directory, "the directory of the fault history");
        path(&table.directory)
    });

    let south = file.south.get_ref();
    let usual = RealtimeTable::default();
    let realtime_table = south.realtime.as_ref().unwrap_or(&usual);
    let realtime = realtime::check(problems, realtime_table);
    let lead = realtime::lead(problems, realtime_table);
    let sercos = value::optional(&south.sercos, |table| sercos::check(problems, table.get_ref()));
    some_bus(problems, &file.south);
    let can = can::check(problems, &south.can);
    let devicenet = devicenet::check(problems, &south.devicenet);
    interfaces(problems, south);
    let drives = references::drives(problems, file);
    let cycles = sercos.iter().flatten().map(|sercos| sercos.cycle_time);
    let cycles = cycles.chain(can.iter().flatten().map(|can| can.cycle_time));
    let cycles = cycles.chain(devicenet.iter().flatten().map(|network| network.cycle_time));
    let cycle_time = cycles.min().unwrap_or(DurationNs::ZERO);

    problems.unique("the device name", &names(&file.device, |device| &device.name));
    problems.unique("the listen address", &names(&file.device, |device| &device.listen));
    problems.unique("the axis name", &names(&file.axis, |axis| &axis.name));
    problems.unique("the drive", &names(&file.axis, |axis| &axis.drive));
    problems.count(&file.device, "devices", DEVICES_MAX);
    problems.count(&file.axis, "axes", AXES_MAX);

    let owners = references::owners(problems, &file.device, &file.axis);
    let devices: Vec<_> =
        file.device.iter().map(|device| device::check(problems, device.get_ref(), cycle_time)).collect();
    let axes: Vec<_> = file
        .axis
        .iter()
        .zip(&owners)
        .map(|(axis, owner)| axis::check(problems, axis.get_ref(), *owner, &drives))
        .collect();
    references::instances(problems, &file.axis, &owners);
    assembly::axes(problems, &file.device, &devices, &axes);
    let listen: Vec<_> = devices.iter().flatten().map(|device| device.listen).collect();
    let time = time::check(problems, file.time.as_ref(), &listen);

    Some(Config {
        name: name?,
        time: time?,
        log_level: log_level?,
        modbus: modbus?,
        http: http?,
        recording: recording?,
        mappings_dir,
        overlays,
        settings_file,
        history_dir,
        devices: devices.into_iter().collect::<Option<_>>()?,
        axes: axes.into_iter().collect::<Option<_>>()?,
        realtime: realtime?,
        lead: lead?,
        sercos: sercos?,
        can: can?,
        devicenet: devicenet?,
    })
}

fn log_level(problems: &mut Problems, file: &File) -> Option<LogLevel> {
    let level = file.log.as_ref().and_then(|table| table.level.as_ref());
    value::word_or(problems, level, "log level", &log_levels(), LogLevel::Info)
}

/// Without any bus there is nothing behind the box.
fn some_bus(problems: &mut Problems, table: &Spanned<SouthTable>) {
    let south = table.get_ref();
    if south.sercos.is_none() && south.can.is_empty() && south.devicenet.is_empty() {
        problems.report::<()>(
            table.span(),
            "the gateway has no bus",
            "expected [south.sercos], [[south.can]] or [[south.devicenet]]",
        );
    }
}

/// No two buses share a CAN interface.
fn interfaces(problems: &mut Problems, south: &SouthTable) {
    let all = names(&south.can, |bus| &bus.interface);
    let all = all.into_iter().chain(names(&south.devicenet, |network| &network.interface));
    let real: Vec<_> = all.filter(|name| name.get_ref() != value::IN_PROCESS).collect();
    problems.unique("the CAN interface", &real);
}

/// One key of every table of a list, with its place.
fn names<T, V: Clone>(tables: &[Spanned<T>], key: impl Fn(&T) -> &Spanned<V>) -> Vec<Spanned<V>> {
    tables.iter().map(|table| key(table.get_ref()).clone()).collect()
}

/// What the check of one table makes of a text, or the titles of what it reports.
#[cfg(test)]
fn checked<Table: serde::de::DeserializeOwned, T>(
    text: &str,
    check: impl FnOnce(&mut Problems, &Table) -> Option<T>,
) -> Result<T, Vec<String>> {
    let mut problems = Problems::default();
    let table = toml::from_str(text).expect("a table");
    let checked = check(&mut problems, &table);
    problems.done(checked).map_err(|problems| problems.into_iter().map(|problem| problem.title).collect())
}
