//! A configuration to begin with: one axis for each axis of each drive that was found, and in front a device for every 16
//! of them.

use std::fmt::Write as _;

use profile_cia402::drive::modes::SupportedModes;

use super::report::title;
use super::{Bus, Found};
use crate::config::AXES_MAX;
use crate::scan::starter::{head, instance};

/// Which modes of a drive give which mode of the box.
const USES: [(&str, SupportedModes); 3] = [
    ("position", SupportedModes::CYCLIC_POSITION.union(SupportedModes::PROFILE_POSITION)),
    ("velocity", SupportedModes::CYCLIC_VELOCITY.union(SupportedModes::PROFILE_VELOCITY)),
    ("torque", SupportedModes::CYCLIC_TORQUE.union(SupportedModes::TORQUE)),
];

/// Node-id of the box, unless somebody has it.
const OWN_NODE: u8 = 127;

/// Rate that is written where the interface reports none.
const BIT_RATE: u32 = 1_000_000;

/// The configuration as text, for this interface and, where that is known, its rate. It is whole: `axisbridge run` takes it.
/// What nobody but the machine's builder knows stands in it with a value that is safe and a remark.
///
/// `None` without a drive.
#[must_use]
pub fn starter(bus: &Bus, interface: &str, bit_rate: Option<u32>) -> Option<String> {
    let drives = bus.nodes.iter().flat_map(|device| {
        let axes =
            device.axes().filter(|(_, modes)| USES.iter().any(|(_, wanted)| modes.intersects(*wanted)));
        axes.map(move |(axis, modes)| (device, axis, modes))
    });
    let drives: Vec<_> = drives.take(AXES_MAX).collect();
    if drives.is_empty() {
        return None;
    }
    let name = |device: &Found, axis: u16| match axis {
        0 => device.node.to_string(),
        _ => format!("{}-{axis}", device.node),
    };
    let names: Vec<_> =
        drives.iter().map(|(device, axis, _)| format!("\"axis-{}\"", name(device, *axis))).collect();
    let own = free(bus).next_back()?;
    let mut out = String::new();
    head(&mut out, &names, "min = \"10 ms\", max = \"80 ms\"");
    for (place, (device, axis, _)) in drives.iter().enumerate() {
        let (name, instance) = (name(device, *axis), instance(place));
        let _ = write!(
            out,
            "
[[axis]]
name = \"axis-{name}\"
instance = {instance}
drive = \"drive-{name}\"
unit = \"revolution\"
motion_resolution = 1_000_000 # counts in one revolution
on_command_loss = \"current-decel-and-disable\"

[axis.limits] # CHANGE: these are for a first, slow look
velocity = 0.5 # revolutions per second
acceleration = 5.0 # revolutions per second squared
torque_percent = 50.0
"
        );
    }
    let rate = match bit_rate {
        Some(rate) => rate.to_string(),
        None => format!("{BIT_RATE} # CHANGE: the rate of the bus"),
    };
    let _ = write!(
        out,
        "
[[south.can]]
interface = \"{interface}\"
bit_rate = {rate}
cycle_time = \"10 ms\"
node = {own} # of the box
"
    );
    for (device, axis, modes) in &drives {
        let name = name(device, *axis);
        let _ = write!(
            out,
            "
[[south.can.drive]] # {}
name = \"drive-{name}\"
node = {}
",
            title(device),
            device.node
        );
        if *axis > 0 {
            let _ = writeln!(out, "axis = {axis}");
        }
        let uses = USES.into_iter().filter(|(_, wanted)| modes.intersects(*wanted));
        let uses: Vec<_> = uses.map(|(name, _)| format!("\"{name}\"")).collect();
        if uses.len() < USES.len() {
            let _ = writeln!(out, "modes = [{}]", uses.join(", "));
        }
    }
    Some(out)
}

/// Node-ids that nobody has.
fn free(bus: &Bus) -> impl DoubleEndedIterator<Item = u8> + '_ {
    (1..=OWN_NODE).filter(|own| bus.nodes.iter().all(|device| device.node.get() != *own))
}

/// What to add for the devices without a node-id, as remarks: which node-id each is to have, and whether it is given one at
/// all, is not for a scan to say. Empty where there are none.
#[must_use]
pub fn hints(bus: &Bus) -> String {
    let mut out = String::new();
    let mut nodes = free(bus);
    // That of the box.
    nodes.next_back();
    for (address, node) in bus.unassigned.iter().zip(nodes) {
        let [vendor, product, revision, serial] = address.0;
        let _ = write!(
            out,
            "
# A device without a node-id: with these lines, and a drive with this node, the box gives it one.
# [[south.can.device]]
# node = {node} # CHANGE: the node-id that it is to have
# identity = {{ vendor_id = {vendor:#010x}, product_code = {product:#010x}, revision_number = {revision:#010x}, serial_number = {serial:#010x} }}
# lss = \"assign\"
"
        );
    }
    out
}
