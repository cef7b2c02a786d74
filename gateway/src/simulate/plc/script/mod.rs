//! Scripts for `simulate plc`: a TOML file with steps, read against the configuration of the gateway.
//!
//! ```toml
//! [[step]]
//! enable = "slide"
//!
//! [[step]]
//! move = { axis = "slide", to = 12.5, velocity = 50.0 }
//!
//! [[step]]
//! expect = { axis = "slide", position = 12.5, tolerance = 0.05 }
//! ```
//!
//! The whole file is read and checked before anything is sent. Axes have the names of the configuration, values its units.

mod steps;
#[cfg(test)]
mod tests;

use std::path::Path;
use std::time::Duration;

use profile_generic::time::DurationNs;
use toml::de::{DeTable, DeValue};

use self::steps::Frame;
use super::{Images, Plan, Planned};
use crate::config::{Config, FILE_LEN_MAX};
use crate::finding::{Findings, read_file};
use crate::simulate::script::reader::{self, Keys, Problems};

/// Packet interval where nothing is said.
const INTERVAL: DurationNs = DurationNs::from_millis(8);
/// Packet intervals that can be asked for.
const INTERVALS: std::ops::RangeInclusive<i64> = 1_000_000..=100_000_000;

/// A script that has been read and checked.
#[derive(Debug, Clone)]
pub struct Script {
    /// What it is about, if it says so.
    pub title: Option<String>,
    /// The device and its axes.
    pub plan: Plan,
    /// What the controller does, in order.
    pub steps: Vec<Planned>,
}

impl Plan {
    /// The plan of a device of a configuration; `None` for a CIP Motion device.
    #[must_use]
    pub fn of(config: &Config, device: usize, interval: Duration) -> Option<Self> {
        let found = config.devices.get(device)?;
        let mut axes: Vec<_> = config.axes_of(device).map(|(_, axis)| axis).collect();
        axes.sort_unstable_by_key(|axis| axis.instance);
        Some(Self {
            address: found.listen,
            assemblies: found.assembly.clone()?,
            names: axes.iter().map(|axis| axis.name.clone()).collect(),
            counts: axes.iter().map(|axis| axis.motion_resolution).collect(),
            interval,
        })
    }
}

impl Script {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// The file cannot be read, or what is wrong in it, each fault at its place.
    pub fn load(path: &Path, config: &Config) -> Result<Self, Findings> {
        let source = read_file(path, FILE_LEN_MAX)?;
        Self::parse(&source, &path.display().to_string(), config)
    }

    /// Checks the text of a script; `name` stands in the errors.
    ///
    /// # Errors
    /// Every fault found.
    pub fn parse(source: &str, name: &str, config: &Config) -> Result<Self, Findings> {
        reader::parsed(source, name, |table, problems| read(table, source, config, problems))
    }
}

fn read(table: &DeTable<'_>, source: &str, config: &Config, problems: &Problems) -> Option<Script> {
    let mut keys = Keys::new("the script", table, 0..0, problems);
    let title = reader::title(&mut keys)?;
    let interval = interval(&mut keys)?;
    let device = device(&mut keys, config)?;
    let list = keys.find("step");
    keys.finish()?;
    let plan = Plan::of(config, device, interval)?;
    let images = Images::new(&plan.assemblies, &plan.counts);
    let mut steps = Vec::new();
    if let Some(list) = list {
        let DeValue::Array(items) = list.get_ref() else {
            return reader::wrong(list, "step", "[[step]] tables", problems);
        };
        let frame = Frame { plan: &plan, images: &images, problems };
        for item in items.iter() {
            let line = source[..item.span().start.min(source.len())].matches('\n').count() + 1;
            steps.extend(steps::step(item, line, &frame));
        }
    }
    Some(Script { title, plan, steps })
}

fn interval(keys: &mut Keys<'_, '_>) -> Option<Duration> {
    let Some(value) = keys.find("interval") else { return nanos(INTERVAL) };
    let span = reader::time(value, "interval", keys.problems)?;
    if !INTERVALS.contains(&span.as_nanos()) {
        let title = format!("the interval is {span}");
        return keys.problems.report(value.span(), title, "expected 1 ms to 100 ms");
    }
    nanos(span)
}

fn nanos(span: DurationNs) -> Option<Duration> {
    u64::try_from(span.as_nanos()).ok().map(Duration::from_nanos)
}

/// The device that the script names, or the only one with assemblies.
fn device(keys: &mut Keys<'_, '_>, config: &Config) -> Option<usize> {
    let with: Vec<_> =
        config.devices.iter().enumerate().filter(|(_, device)| device.assembly.is_some()).collect();
    let names: Vec<_> = with.iter().map(|(_, device)| format!("\"{}\"", device.name)).collect();
    let expected = || match names.as_slice() {
        [] => "expected a configuration with such a device".to_owned(),
        names => format!("expected device = one of {}", names.join(", ")),
    };
    let Some(value) = keys.find("device") else {
        return match with.as_slice() {
            [(number, _)] => Some(*number),
            [] => keys.problems.report(0..0, "no device of the configuration has assemblies", expected()),
            _ => keys.problems.report(0..0, "more than one device has assemblies", expected()),
        };
    };
    let Some(name) = value.get_ref().as_str() else {
        return reader::wrong(value, "device", "the name of a device", keys.problems);
    };
    let found = with.iter().find(|(_, device)| device.name == name).map(|(number, _)| *number);
    found.or_else(|| {
        let title = format!("there is no device `{name}` with assemblies");
        keys.problems.report(value.span(), title, expected())
    })
}
