//! Scripts for the bench tester: a TOML file with a connection, axes and steps.
//!
//! ```toml
//! [connection]
//! target = "192.0.2.10"
//!
//! [axis.1]
//! counts_per_unit = 1_000_000
//!
//! [[step]]
//! enable = "all"
//!
//! [[step]]
//! move = { axis = 1, to = 2.5, velocity = 1.0, acceleration = 10.0 }
//! ```
//!
//! The whole file is read and checked before anything is sent: every key, every name of the standard, every value, and
//! whether a step can succeed at all. Every problem is reported at its place.

pub(in crate::simulate) mod attributes;
mod connection;
mod events;
mod exchange;
mod expect;
mod misbehave;
mod motion;
pub(in crate::simulate) mod reader;
pub mod schema;
mod step;
#[cfg(test)]
mod tests;

use std::path::Path;

use profile_cip::controller::{Condition, ControllerConfig, Step};
use profile_generic::time::DurationNs;
use toml::de::{DeTable, DeValue};

use self::attributes::Attribute;
pub use self::connection::Places;
use self::reader::{Keys, Problems};
use self::step::Frame;
use crate::config::FILE_LEN_MAX;
use crate::finding::{Findings, read_file};
use crate::mapping::{CipDictionary, Mapping};

/// A script that has been read and checked.
#[derive(Debug, Clone)]
pub struct Script {
    /// What it is about, if it says so.
    pub title: Option<String>,
    /// Where the device and this controller are, if it says so.
    pub places: Places,
    /// Connection and axes.
    pub config: ControllerConfig,
    /// What the controller does, in order.
    pub steps: Vec<Step>,
    /// What each step does, in words, with its line in the file; the last ones may have been added.
    pub titles: Vec<(String, Option<usize>)>,
}

impl Script {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// The file cannot be read, or what is wrong in it, each fault at its place.
    pub fn load(path: &Path, mapping: &Mapping) -> Result<Self, Findings> {
        let source = read_file(path, FILE_LEN_MAX)?;
        Self::parse(&source, &path.display().to_string(), mapping)
    }

    /// Checks the text of a script; `name` stands in the errors.
    ///
    /// # Errors
    /// Every fault found.
    pub fn parse(source: &str, name: &str, mapping: &Mapping) -> Result<Self, Findings> {
        reader::parsed(source, name, |table, problems| read(table, source, mapping, problems))
    }
}

/// Whether a fault that no step expects fails the run.
const UNEXPECTED_FAULTS: &[(&str, bool)] = &[("fail", true), ("ignore", false)];

fn read(table: &DeTable<'_>, source: &str, mapping: &Mapping, problems: &Problems) -> Option<Script> {
    let dictionary = &mapping.dictionaries.cip;
    let mut keys = Keys::new("the script", table, 0..0, problems);
    let title = reader::title(&mut keys)?;
    let unexpected = keys.word_or("unexpected_faults", UNEXPECTED_FAULTS, true);
    let format = connection::format(table.get("connection"));
    let axes = connection::axes(keys.find("axis"), format, dictionary, problems);
    let (setups, motion): (Vec<_>, Vec<_>) = axes.clone().unwrap_or_default().into_iter().unzip();
    let mut config = ControllerConfig::new(None, setups);
    let places = connection::connection(keys.find("connection"), &mut config, dictionary, problems);
    let frame = Frame { config: &config, motion: &motion, dictionary, problems };
    let mut steps = Vec::new();
    let mut titles = Vec::new();
    // Without axes every step would be told again what is wrong with them.
    let list = keys.find("step");
    keys.finish()?;
    axes?;
    if let Some(list) = list {
        let DeValue::Array(items) = list.get_ref() else {
            return reader::wrong(list, "step", "[[step]] tables", problems);
        };
        for item in items.iter() {
            let Some((step, title)) = step::step(item, &frame) else { continue };
            let line = source[..item.span().start.min(source.len())].matches('\n').count() + 1;
            titles.push((title.unwrap_or_else(|| describe(&step, dictionary)), Some(line)));
            steps.push(step);
        }
    }
    let places = places?;
    if let Err(error) = config.check() {
        let place = table.iter().find(|(key, _)| key.get_ref() == "connection").map(|(key, _)| key.span());
        return problems.report(place.unwrap_or(0..0), "the connection cannot work", error);
    }
    if unexpected? {
        let condition = Condition::NoFault;
        steps.push(Step::Expect { condition, within: DurationNs::ZERO });
        titles.push(("No unexpected fault".to_owned(), None));
    }
    Some(Script { title, places, config, steps, titles })
}

/// A step in words, with the names of attributes.
fn describe(step: &Step, dictionary: &CipDictionary) -> String {
    let names = |ids: &mut dyn Iterator<Item = u16>, class: bool| {
        ids.map(|id| name_of(dictionary, class, id)).collect::<Vec<_>>().join(", ")
    };
    match step {
        Step::ReadAttributes { axis, attributes } => {
            format!("Get {}", names(&mut attributes.iter().map(|a| a.id), *axis == 0))
        }
        Step::SetAttributes { axis, attributes } => {
            format!("Set {}", names(&mut attributes.iter().map(|a| a.selector.id), *axis == 0))
        }
        _ => step.to_string(),
    }
}

/// The name of an attribute, or its number.
fn name_of(dictionary: &CipDictionary, class: bool, id: u16) -> String {
    find(dictionary, class, id).map_or_else(|| format!("attribute {id}"), |attribute| attribute.name)
}

fn find(dictionary: &CipDictionary, class: bool, id: u16) -> Option<Attribute> {
    let rows = if class { dictionary.class_attributes() } else { dictionary.attributes() };
    rows.iter().find(|row| row.id == id).map(|row| Attribute {
        id,
        name: row.name.clone(),
        data_type: row.data_type,
        length: row.length,
    })
}

/// An attribute with its value, for people.
#[must_use]
pub fn show_attribute(mapping: &Mapping, instance: u8, id: u16, bytes: &[u8]) -> String {
    let dictionary = &mapping.dictionaries.cip;
    let known = find(dictionary, instance == 0, id);
    format!("{} = {}", name_of(dictionary, instance == 0, id), attributes::show(bytes, known.as_ref()))
}
