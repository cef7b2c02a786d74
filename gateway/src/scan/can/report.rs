//! What a scan of a CAN bus has found, for people and for programs.

use std::fmt::Write as _;

use profile_cia402::drive::modes::SupportedModes;
use serde_json::{Value, json};

use super::{DEVICE_TYPE, Found, HARDWARE, IDENTITY, NAME, SOFTWARE};

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
pub fn text(found: &[Found]) -> String {
    let mut out = String::new();
    let count = found.len();
    let _ = writeln!(out, "{count} node{}", if count == 1 { "" } else { "s" });
    for device in found {
        let _ = writeln!(out, "\nnode {}: {}", device.node, title(device));
        let mut line = |what: &str, value: &str| {
            let _ = writeln!(out, "  {what:<14} {value}");
        };
        if let Some(number) = device.number(DEVICE_TYPE) {
            line("device type", &format!("{number:#010x}{}", profile(number)));
        }
        for (what, object) in NUMBERS.into_iter().zip(IDENTITY) {
            if let Some(number) = device.number(object) {
                line(what, &format!("{number:#010x} ({number})"));
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
    out
}

/// The findings as one JSON object.
#[must_use]
pub fn json(found: &[Found]) -> Value {
    let nodes = found.iter().map(|device| {
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
    json!({ "nodes": nodes.collect::<Vec<_>>() })
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
