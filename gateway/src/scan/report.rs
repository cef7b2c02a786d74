//! What a scan has found, for people and for programs.

use std::fmt::Write as _;

use profile_sercos::wire::idn::Idn;
use serde_json::{Value, json};

use super::{Bus, Found};
use crate::mapping::SercosDictionary;

/// The set of codes of S-0-0292.
const MODES: &str = "Operation mode";
/// The set of codes of S-0-1302.0.1.
const FSP: &str = "FSP type";

/// Texts of a slave that take one line: what they are called, and their IDN.
const LINES: [(&str, Idn); 7] = [
    ("hardware", Idn::HARDWARE_REVISION),
    ("software", Idn::SOFTWARE_REVISION),
    ("serial number", Idn::SERIAL_NUMBER),
    ("communication hardware", Idn::HARDWARE_VERSION),
    ("manufacturer version", Idn::MANUFACTURER_VERSION),
    ("controller", Idn::CONTROLLER_TYPE),
    ("motor", Idn::MOTOR_TYPE),
];

/// The scaling types of a drive.
const SCALINGS: [(&str, Idn); 4] = [
    ("position", Idn::POSITION_DATA_SCALING_TYPE),
    ("velocity", Idn::VELOCITY_DATA_SCALING_TYPE),
    ("acceleration", Idn::ACCELERATION_DATA_SCALING_TYPE),
    ("torque", Idn::TORQUE_FORCE_DATA_SCALING_TYPE),
];

/// The findings as lines of text.
#[must_use]
pub fn text(bus: &Bus, dictionary: &SercosDictionary) -> String {
    let mut out = String::new();
    let count = bus.slaves.len();
    let topology = bus.topology.map(|topology| format!(", {topology}")).unwrap_or_default();
    let _ = writeln!(out, "{count} slave{}{topology}", if count == 1 { "" } else { "s" });
    for finding in &bus.findings {
        let _ = writeln!(out, "! {finding}");
    }
    for slave in &bus.slaves {
        lines(&mut out, slave, dictionary);
    }
    out
}

/// A slave, line by line.
fn lines(out: &mut String, slave: &Found, dictionary: &SercosDictionary) {
    let _ = writeln!(out, "\n{}: {}", place(slave), title(slave));
    let mut line = |what: &str, value: &str| {
        let _ = writeln!(out, "  {what:<22} {value}");
    };
    if slave.lost {
        line("state", "went away during the scan");
    }
    if let Some(vendor) = vendor(slave) {
        line("vendor", &vendor);
    }
    for (what, idn) in LINES {
        if let Some(text) = slave.text(idn) {
            line(what, &text);
        }
    }
    line("profile", &profile(slave, dictionary));
    let classes: Vec<_> = slave.facts.classes.iter().map(ToString::to_string).collect();
    line("classes", &classes.join(", "));
    line("connections", &slave.facts.connections.to_string());
    for (number, mode) in modes(slave, dictionary).iter().enumerate() {
        line(if number == 0 { "operation modes" } else { "" }, mode);
    }
    for (what, idn) in SCALINGS {
        if let Some(value) = slave.number(idn) {
            line(&format!("{what} scaling"), &scaling(dictionary, idn, value));
        }
    }
    if let Some(text) = slave.text(Idn::DIAGNOSTIC_MESSAGE) {
        line("diagnosis", &text);
    }
    for answer in &slave.answers {
        if let Err(failure) = &answer.data
            && !failure.is_absent()
        {
            line("not read", &format!("{}: {failure}", answer.idn));
        }
    }
}

/// The findings as one JSON object.
#[must_use]
pub fn json(bus: &Bus, dictionary: &SercosDictionary) -> Value {
    let slaves = bus.slaves.iter().map(|slave| {
        let scalings = SCALINGS
            .iter()
            .filter_map(|(what, idn)| slave.number(*idn).map(|value| ((*what).to_owned(), json!(value))));
        let modes: Vec<u16> = slave.words(Idn::OPERATION_MODES).collect();
        json!({
            "position": slave.id.topology_address(),
            "address": slave.address,
            "lost": slave.lost,
            "vendor": slave.text(Idn::VENDOR_NAME),
            "vendor_code": slave.number(Idn::VENDOR_CODE),
            "device": slave.text(Idn::DEVICE_NAME),
            "device_id": slave.text(Idn::DEVICE_ID),
            "hardware": slave.text(Idn::HARDWARE_REVISION),
            "software": slave.text(Idn::SOFTWARE_REVISION),
            "serial_number": slave.text(Idn::SERIAL_NUMBER),
            "profile": profile(slave, dictionary),
            "classes": slave.facts.classes.iter().map(ToString::to_string).collect::<Vec<_>>(),
            "connections": slave.facts.connections,
            "operation_modes": modes,
            "scaling": scalings.collect::<serde_json::Map<_, _>>(),
        })
    });
    let topology = bus.topology.map(|topology| topology.to_string());
    json!({ "topology": topology, "findings": bus.findings, "slaves": slaves.collect::<Vec<_>>() })
}

/// Where a slave is.
fn place(slave: &Found) -> String {
    let position = slave.id.topology_address();
    match slave.address {
        0 => format!("{position}, no address"),
        address => format!("{position}, address {address}"),
    }
}

/// What a slave calls itself.
pub(super) fn title(slave: &Found) -> String {
    let name = slave.text(Idn::DEVICE_NAME).or_else(|| slave.text(Idn::CONTROLLER_TYPE));
    let name = name.unwrap_or_else(|| "a slave that does not tell its name".to_owned());
    match slave.text(Idn::DEVICE_ID) {
        Some(id) => format!("{name} ({id})"),
        None => name,
    }
}

fn vendor(slave: &Found) -> Option<String> {
    match (slave.text(Idn::VENDOR_NAME), slave.number(Idn::VENDOR_CODE)) {
        (Some(name), Some(code)) => Some(format!("{name} (code {code})")),
        (Some(name), None) => Some(name),
        (None, code) => code.map(|code| format!("code {code}")),
    }
}

fn profile(slave: &Found, dictionary: &SercosDictionary) -> String {
    match slave.facts.fsp_type {
        Some(number) => named(dictionary, FSP, number).unwrap_or_else(|| format!("FSP type {number}")),
        None => "not told".to_owned(),
    }
}

/// The operation modes a drive has, each with its code.
fn modes(slave: &Found, dictionary: &SercosDictionary) -> Vec<String> {
    let name =
        |mode: u16| named(dictionary, MODES, u32::from(mode)).unwrap_or_else(|| "vendor's own".to_owned());
    slave.words(Idn::OPERATION_MODES).map(|mode| format!("0x{mode:04X} {}", name(mode))).collect()
}

fn named(dictionary: &SercosDictionary, set: &str, code: u32) -> Option<String> {
    let known = dictionary.codes(set)?.codes.iter().find(|known| known.code == code)?;
    Some(known.name.clone())
}

/// A scaling type with the names of its fields' values.
fn scaling(dictionary: &SercosDictionary, idn: Idn, value: u64) -> String {
    let fields = dictionary.word_of(idn).map(|word| word.fields.as_slice()).unwrap_or_default();
    let names = fields.iter().filter_map(|field| {
        let [(low, high)] = field.parts.as_slice() else { return None };
        let held = value >> low & ((1 << (high - low + 1)) - 1);
        let known = field.values.iter().find(|known| u64::from(known.value) == held)?;
        Some(known.name.as_str())
    });
    format!("0x{value:04X} {}", names.collect::<Vec<_>>().join(", "))
}
