//! What tables say of each other: devices of their axes, axes of their drives.

use std::ops::Range;

use super::Problems;
use crate::config::DriveAt;
use crate::config::file::{AxisTable, DeviceTable, File};
use crate::finding::registry as code;
use crate::finding::{Spanned, closest};
use crate::mapping::{ETHERNET_IP, networks};

/// For each axis the device that lists it.
pub(super) fn owners(
    problems: &mut Problems,
    devices: &[Spanned<DeviceTable>],
    axes: &[Spanned<AxisTable>],
) -> Vec<Option<usize>> {
    let mut owners: Vec<Option<(usize, Range<usize>)>> = vec![None; axes.len()];
    // Axes that a device names in another spelling: they are not reported again.
    let mut meant: Vec<&str> = Vec::new();
    let names = || axes.iter().map(|axis| axis.get_ref().name.get_ref().as_str());
    for (index, device) in devices.iter().enumerate() {
        let listed = &device.get_ref().axes;
        if listed.get_ref().is_empty() {
            problems.report::<()>(
                listed.span(),
                "a device without axes",
                "expected the name of at least one axis",
            );
        }
        node_axes(problems, device.get_ref());
        for name in listed.get_ref() {
            let position = axes.iter().position(|axis| axis.get_ref().name.get_ref() == name.get_ref());
            let Some(position) = position else {
                meant.extend(closest(name.get_ref(), names()));
                problems.unknown("axis", name, axes.iter().map(|axis| axis.get_ref().name.get_ref()));
                continue;
            };
            if let Some((_, first)) = &owners[position] {
                problems.duplicate(&format!("the axis `{}`", name.get_ref()), first.clone(), name.span());
            } else {
                owners[position] = Some((index, name.span()));
            }
        }
    }
    for (axis, owner) in axes.iter().zip(&owners) {
        let name = &axis.get_ref().name;
        if owner.is_none() && !meant.contains(&name.get_ref().as_str()) {
            problems.report_as::<()>(
                code::CONFIG_REFERENCE,
                name.span(),
                format_args!("the axis `{}` belongs to no device", name.get_ref()),
                "expected its name under `axes` of a [[device]]",
            );
        }
    }
    owners.into_iter().map(|owner| owner.map(|(index, _)| index)).collect()
}

/// A device has as many axes as its network lets a node have.
fn node_axes(problems: &mut Problems, device: &DeviceTable) {
    let networks = networks().iter().filter(|network| network.name == ETHERNET_IP);
    for network in networks {
        let (least, most) = (usize::from(*network.axes.start()), usize::from(*network.axes.end()));
        let count = device.axes.get_ref().len();
        // Without any there is a report already.
        if count > 0 && !(least..=most).contains(&count) {
            problems.report_as::<()>(
                code::TOO_MANY,
                device.axes.span(),
                format_args!("the device `{}` has {count} axes", device.name.get_ref()),
                format_args!(
                    "expected {least} to {most} axes of a node on {} (IEC 61800-7-302 clause {})",
                    network.name, network.clause
                ),
            );
        }
    }
}

/// Instance numbers are unique in each device.
pub(super) fn instances(problems: &mut Problems, axes: &[Spanned<AxisTable>], owners: &[Option<usize>]) {
    for (index, axis) in axes.iter().enumerate() {
        let instance = &axis.get_ref().instance;
        let earlier = axes[..index].iter().zip(owners).find(|(earlier, owner)| {
            owners[index].is_some()
                && **owner == owners[index]
                && earlier.get_ref().instance.get_ref() == instance.get_ref()
        });
        if let Some((earlier, _)) = earlier {
            problems.duplicate(
                &format!("the instance {} in one device", instance.get_ref()),
                earlier.get_ref().instance.span(),
                instance.span(),
            );
        }
    }
}

/// The drives of all buses by their names.
pub(super) fn drives<'a>(problems: &mut Problems, file: &'a File) -> Vec<(&'a Spanned<String>, DriveAt)> {
    let south = file.south.get_ref();
    let sercos = south.sercos.iter().flat_map(|table| table.get_ref().drive.iter().enumerate());
    let mut drives: Vec<_> =
        sercos.map(|(drive, table)| (&table.get_ref().name, DriveAt::Sercos { drive })).collect();
    for (bus, table) in south.can.iter().enumerate() {
        let all = table.get_ref().drive.iter().enumerate();
        drives.extend(all.map(|(drive, table)| (&table.get_ref().name, DriveAt::Can { bus, drive })));
    }
    for (network, table) in south.devicenet.iter().enumerate() {
        let all = table.get_ref().drive.iter().enumerate();
        let at = |drive| DriveAt::Devicenet { network, drive };
        drives.extend(all.map(|(drive, table)| (&table.get_ref().name, at(drive))));
    }
    let names: Vec<_> = drives.iter().map(|(name, _)| (*name).clone()).collect();
    problems.unique("the drive name", &names);
    drives
}
