//! Whether the PDOs of all CANopen drives fit their bus and its cycle.

use crate::config::{AxisKind, Written};
use crate::engine::build::BuildError;
use crate::engine::build::can::{Network, described, network};
use crate::engine::bus::can::load::{plan, traffic};
use crate::finding::registry as code;
use crate::finding::{Findings, Problem};
use crate::mapping::Mapping;
use profile_generic::quantity::Quantity;

/// Plans each bus as the box would set it up with drives that lack nothing.
pub(super) fn check(mapping: &Mapping, written: &Written, findings: &mut Findings) {
    scaling(written, findings);
    mappings(written, findings);
    for (place, (bus, table)) in written.config.can.iter().zip(&written.file.south.get_ref().can).enumerate()
    {
        let table = table.get_ref();
        let Network { master, .. } = match network(&written.config, place, mapping) {
            Ok(network) => network,
            Err(error) => {
                findings.push(&written.text, unfit(written, &error));
                continue;
            }
        };
        let traffic = traffic(&master);
        let cycle = || Problem::new(code::CYCLE_FULL, table.cycle_time.span()).key("cycle_time");
        if let Err(error) = master.check() {
            findings.push(&written.text, cycle().expected(error.to_string()));
        }
        if let Err(error) = plan(&master, bus.bit_rate, &traffic).check() {
            let drives = bus.drives.len();
            let title = format!("the cycle cannot hold the PDOs of {drives} drives");
            findings.push(&written.text, cycle().title(title).expected(error.to_string()));
        }
    }
}

/// An axis of which no PDOs can be made.
fn unfit(written: &Written, error: &BuildError) -> Problem {
    let axes = written.config.axes.iter().zip(&written.file.axis);
    let name = match error {
        BuildError::CanDrive { name, .. } => name.as_str(),
        _ => "",
    };
    let table = axes.clone().find(|(axis, _)| axis.name == name).map(|(_, table)| table.get_ref());
    let span = table.map_or(0..0, |table| table.name.span());
    let what = match error {
        BuildError::CanDrive { error, .. } => error.to_string(),
        error => error.to_string(),
    };
    let problem = Problem::new(code::AXIS_TABLES, span);
    problem.title(format!("the tables make no PDOs for the axis `{name}`")).expected(what)
}

/// Which PDOs a device has must be told by a file where they are not mapped.
fn mappings(written: &Written, findings: &mut Findings) {
    for (bus, table) in written.config.can.iter().zip(&written.file.south.get_ref().can) {
        for (device, table) in bus.devices.iter().zip(&table.get_ref().device) {
            if let Some(word) = &table.get_ref().pdo_mapping
                && device.keeps_mapping
                && described(bus, device.node).is_none()
            {
                let problem = Problem::new(code::DRIVE_MAPPING, word.span());
                let problem =
                    problem.title(format!("the PDOs of the device with node-id {} are its own", device.node));
                findings
                    .push(&written.text, problem.expected("what they carry is not known before it is there"));
            }
        }
    }
}

/// What the counts of a drive are must be known of it, or be told by the configuration.
fn scaling(written: &Written, findings: &mut Findings) {
    for (axis, table) in written.config.axes.iter().zip(&written.file.axis) {
        let Some((_, drive)) = written.config.can_drive(axis) else { continue };
        let told = |quantity| drive.counts.iter().any(|(known, _)| *known == quantity);
        let all = [Quantity::Position, Quantity::Velocity, Quantity::Acceleration].into_iter().all(told);
        let name = table.get_ref().drive.span();
        if axis.kind == AxisKind::Linear && drive.way_of_a_turn.is_none() && !all {
            let title = format!("nobody says what a turn of the drive `{}` is in millimetres", drive.name);
            let problem = Problem::new(code::AXIS_TABLES, name).title(title);
            let help = "expected millimetres_per_turn, or counts of position, velocity and acceleration";
            findings.push(&written.text, problem.expected(help));
        } else if !all {
            let title = format!("the scaling of the drive `{}` is its own", drive.name);
            let problem = Problem::new(code::DRIVE_SCALING, name).title(title);
            findings.push(
                &written.text,
                problem.expected("range and precision are not known before it is there"),
            );
        }
    }
}
