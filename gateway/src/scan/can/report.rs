//! What a scan of a CAN bus has found, for people and for programs.

use std::fmt::Write as _;

use profile_cia402::drive::modes::SupportedModes;
use serde_json::{Value, json};

use super::{Bus, DEVICE_TYPE, Found, HARDWARE, IDENTITY, NAME, SOFTWARE};

/// Low word of the device type of CiA 402, and bit 17 of a servo drive.
const PROFILE: u32 = 402;

/// The modes of CiA 402 by their abbreviations.
const MODES: [(&str, SupportedModes); 10] = [
    ("pp", SupportedModes::PROFILE_POSITION),
    ("vl", SupportedModes::VELOCITY),
    ("pv", SupportedModes::PROFILE_VELOCITY),
    ("tq", SupportedModes::TORQUE),
    ("hm", SupportedModes::HOMING),
    ("ip", SupportedModes::INTERPOLATED_POSITION),
    ("csp", SupportedModes::CYCLIC_POSITION),
    ("csv", SupportedModes::CYCLIC_VELOCITY),
    ("cst", SupportedModes::CYCLIC_TORQUE),
    ("cstca", SupportedModes::CYCLIC_TORQUE_COMMUTATION),
];

/// What the numbers of 1018h are.
const NUMBERS: [&str; 4] = ["vendor", "product", "revision", "serial number"];

/// The findings as lines of text.
#[must_use]
pub fn text(bus: &Bus) -> String {
    let mut out = String::new();
    let count = bus.nodes.len();
    let _ = write!(out, "{count} node{}", if count == 1 { "" } else { "s" });
    match bus.unassigned.len() {
        0 => {}
        1 => out.push_str(", 1 device without a node-id"),
        many => {
            let _ = write!(out, ", {many} devices without a node-id");
        }
    }
    out.push('\n');
    for finding in &bus.findings {
        let _ = writeln!(out, "! {finding}");
    }
    if bus.nodes.is_empty() && bus.unassigned.is_empty() {
        // Whoever is there may speak something else.
        let _ = writeln!(out, "\nno node answers by CANopen; drives on DeviceNet would not");
    }
    for device in &bus.nodes {
        lines(&mut out, device);
    }
    for address in &bus.unassigned {
        let _ = writeln!(out, "\nwithout a node-id: its LSS address");
        for (what, number) in NUMBERS.into_iter().zip(address.0) {
            let _ = writeln!(out, "  {what:<14} {}", both(number));
        }
    }
    out
}

/// A device, line by line.
fn lines(out: &mut String, device: &Found) {
    let _ = writeln!(out, "\nnode {}: {}", device.node, title(device));
    let mut line = |what: &str, value: &str| {
        let _ = writeln!(out, "  {what:<14} {value}");
    };
    if let Some(number) = device.number(DEVICE_TYPE) {
        line("device type", &format!("{number:#010x}{}", profile(number)));
    }
    for (what, object) in NUMBERS.into_iter().zip(IDENTITY) {
        if let Some(number) = device.number(object) {
            line(what, &both(number));
        }
    }
    for (what, object) in [("hardware", HARDWARE), ("software", SOFTWARE)] {
        if let Some(text) = device.text(object) {
            line(what, &text);
        }
    }
    for (axis, modes) in device.axes() {
        line(&format!("modes, axis {axis}"), &names(modes).join(" "));
    }
    for answer in &device.answers {
        if let Err(failure) = &answer.data
            && !failure.is_absent()
        {
            line("not read", &format!("{}: {failure}", answer.object));
        }
    }
}

/// The findings as one JSON object.
#[must_use]
pub fn json(bus: &Bus) -> Value {
    let nodes = bus.nodes.iter().map(|device| {
        let [vendor, product, revision, serial] = IDENTITY.map(|object| device.number(object));
        let axes = device.axes().map(
            |(axis, modes)| json!({ "axis": axis, "supported_modes": modes.bits(), "modes": names(modes) }),
        );
        json!({
            "node": device.node.get(),
            "device_type": device.number(DEVICE_TYPE),
            "vendor": vendor,
            "product": product,
            "revision": revision,
            "serial_number": serial,
            "name": device.text(NAME),
            "hardware": device.text(HARDWARE),
            "software": device.text(SOFTWARE),
            "axes": axes.collect::<Vec<_>>(),
        })
    });
    let unassigned = bus.unassigned.iter().map(|address| {
        let [vendor, product, revision, serial] = address.0;
        json!({ "vendor": vendor, "product": product, "revision": revision, "serial_number": serial })
    });
    json!({
        "nodes": nodes.collect::<Vec<_>>(),
        "without_node_id": unassigned.collect::<Vec<_>>(),
        "findings": bus.findings,
    })
}

/// A number as data sheets have it and as type plates have it.
fn both(number: u32) -> String {
    format!("{number:#010x} ({number})")
}

/// What a device calls itself.
pub(super) fn title(device: &Found) -> String {
    device.text(NAME).unwrap_or_else(|| "a device that does not tell its name".to_owned())
}

fn profile(device_type: u32) -> String {
    match device_type & 0xFFFF {
        0 => ", no standard profile".to_owned(),
        PROFILE => ", drive (CiA 402)".to_owned(),
        other => format!(", profile {other}"),
    }
}

fn names(modes: SupportedModes) -> Vec<&'static str> {
    MODES.into_iter().filter(|(_, mode)| modes.contains(*mode)).map(|(name, _)| name).collect()
}
