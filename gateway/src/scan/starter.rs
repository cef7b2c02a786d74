//! A configuration to begin with: one axis for each drive that was found, and in front a device for every 16 of them.

use std::fmt::Write as _;

use profile_cip::device::config::AXES_MAX as DEVICE_AXES_MAX;

use super::report::title;
use super::{Bus, Found};
use crate::config::{AXES_MAX, Link};
use profile_sercos::wire::idn::Idn;

/// What S-0-1302.0.1 is for a drive.
const FSP_DRIVE: u32 = 2;

/// Bits 2..0 of S-0-0076 of an axis that slides.
const METHOD_LINEAR: u64 = 1;

/// The configuration as text, for the bus that `link` leads to. It is whole: `axisbridge run` takes it. What nobody but the
/// machine's builder knows (limits, the address in front, who made the box) stands in it with a value that is safe and a
/// remark.
///
/// `None` without a drive that has an address of its own.
#[must_use]
pub fn starter(bus: &Bus, link: &Link) -> Option<String> {
    let unique =
        |slave: &&Found| bus.slaves.iter().filter(|other| other.address == slave.address).count() == 1;
    let drives: Vec<_> = bus.slaves.iter().filter(|slave| slave.address != 0).filter(unique).collect();
    let drives: Vec<_> = drives.into_iter().filter(|slave| is_drive(slave)).take(AXES_MAX).collect();
    if drives.is_empty() {
        return None;
    }
    let mut out = String::new();
    let names: Vec<_> = drives.iter().map(|slave| format!("\"axis-{}\"", slave.address)).collect();
    head(&mut out, &names, "min = \"2 ms\", max = \"32 ms\"");
    let interfaces = match link {
        Link::InProcess { ring: false } => "interface = \"in-process\"\n".to_owned(),
        Link::InProcess { ring: true } => {
            "interface = \"in-process\"\nring_interface = \"in-process\"\n".to_owned()
        }
        Link::Interface { name, ring: None } => format!("interface = \"{name}\"\n"),
        Link::Interface { name, ring: Some(ring) } => {
            format!("interface = \"{name}\"\nring_interface = \"{ring}\"\n")
        }
    };
    for (number, slave) in drives.iter().enumerate() {
        axis(&mut out, instance(number), slave);
    }
    let _ = write!(
        out,
        "
[south.sercos]
{interfaces}cycle_time = \"2 ms\"
"
    );
    for slave in &drives {
        let _ = write!(
            out,
            "
[[south.sercos.drive]] # {}
name = \"drive-{}\"
address = {}
",
            title(slave),
            slave.address,
            slave.address
        );
    }
    Some(out)
}

/// The instance number of an axis in its device, from the place of the axis in the box.
pub(super) const fn instance(place: usize) -> usize {
    place % DEVICE_AXES_MAX + 1
}

/// The box and the devices in front, with axes of these names.
pub(super) fn head(out: &mut String, names: &[String], update_period: &str) {
    let _ = write!(
        out,
        "\
[box]
name = \"axisbridge\"

# CHANGE: a controller on another machine shares its time by PTP.
# [time]
# source = \"ptp\"
"
    );
    for (number, axes) in (1..).zip(names.chunks(DEVICE_AXES_MAX)) {
        device(out, number, axes, update_period);
    }
}

/// A device in front, from 1 on.
fn device(out: &mut String, number: usize, axes: &[String], update_period: &str) {
    let name = if number == 1 { "front".to_owned() } else { format!("front-{number}") };
    let _ = write!(
        out,
        "
[[device]]
name = \"{name}\"
listen = \"127.0.0.{}\" # CHANGE: an address of this host, on the controller's network
axes = [{}]
power_structure_class_id = 0
update_period = {{ {update_period} }}

[device.identity]
vendor_id = 65_535 # CHANGE: the number that ODVA has assigned to you
product_code = 1
revision = \"1.1\"
serial_number = {number} # CHANGE: every gateway has its own
product_name = \"Axisbridge\"
",
        number + 1,
        axes.join(", ")
    );
}

/// Whether a slave says that it is a drive, or has operation modes as a drive has.
fn is_drive(slave: &Found) -> bool {
    slave.facts.fsp_type == Some(FSP_DRIVE) || slave.words(Idn::OPERATION_MODES).next().is_some()
}

fn axis(out: &mut String, instance: usize, slave: &Found) {
    let linear =
        slave.number(Idn::POSITION_DATA_SCALING_TYPE).is_some_and(|word| word & 0b111 == METHOD_LINEAR);
    // Slow enough for a first look at any machine.
    let (unit, resolution, velocity, acceleration) = if linear {
        ("millimetre", 10_000, "10.0", "100.0")
    } else {
        ("revolution", 1_000_000, "0.5", "5.0")
    };
    let address = slave.address;
    let _ = write!(
        out,
        "
[[axis]]
name = \"axis-{address}\"
instance = {instance}
drive = \"drive-{address}\"
unit = \"{unit}\"
motion_resolution = {resolution} # counts in one {unit}
on_command_loss = \"current-decel-and-disable\"

[axis.limits] # CHANGE: these are for a first, slow look
velocity = {velocity} # {unit}s per second
acceleration = {acceleration} # {unit}s per second squared
torque_percent = 50.0
"
    );
}
