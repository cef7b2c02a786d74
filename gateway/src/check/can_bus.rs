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
            let title = format!("`millimetres_per_turn` of the drive `{}` is missing", drive.name);
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

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use super::*;
    use crate::config::Config;

    /// A bus at 1 Mbit/s with so many drives of one RPDO and one TPDO each: position only, no actual value beside it.
    fn fits(mapping: &Mapping, drives: u32, cycle_ms: u32) -> bool {
        let (mut names, mut axes, mut bus) = (String::new(), String::new(), String::new());
        for number in 1..=drives {
            write!(names, "\"a{number}\", ").expect("a string takes everything");
            write!(
                axes,
                "[[axis]]\nname = \"a{number}\"\ninstance = {number}\ndrive = \"d{number}\"\nunit = \"revolution\"\n\
                 motion_resolution = 10_000\n"
            )
            .expect("a string takes everything");
            write!(
                bus,
                "[[south.can.drive]]\nname = \"d{number}\"\nnode = {number}\nmodes = [\"position\"]\nactual_values = []\n"
            )
            .expect("a string takes everything");
        }
        let text = format!(
            "[box]\nname = \"plan\"\n[[device]]\nname = \"front\"\nlisten = \"127.0.0.2\"\naxes = [{names}]\n\
             update_period = {{ min = \"8 ms\", max = \"16 ms\" }}\n[device.identity]\nvendor_id = 1\nproduct_code = 1\n\
             serial_number = 1\nproduct_name = \"plan\"\n{axes}[[south.can]]\ninterface = \"in-process\"\n\
             cycle_time = \"{cycle_ms} ms\"\n{bus}"
        );
        let config = Config::parse(&text, "plan.toml").expect("the configuration is sound");
        let Network { master, .. } = network(&config, 0, mapping).expect("the drives have PDOs");
        let traffic = traffic(&master);
        plan(&master, config.can[0].bit_rate, &traffic).check().is_ok()
    }

    /// What the documentation promises is what the plan lets pass, to the drive.
    #[test]
    fn the_documentation_says_how_many_drives_fit_a_bus() {
        let mapping = Mapping::embedded().expect("the shipped tables are sound");
        let most =
            |cycle_ms| (1..=16).take_while(|drives| fits(&mapping, *drives, cycle_ms)).last().unwrap_or(0);
        let counts = [1, 2, 4].map(|cycle_ms| (cycle_ms, most(cycle_ms)));
        let [(_, one), (_, two), (_, four)] = counts;
        let sentence = format!("there is room for {one} drives at 1 ms, {two} at 2 ms and {four} at 4 ms");
        let page = include_str!("../../../docs/tasks/connect-canopen-drives.md").replace('\n', " ");
        assert!(page.contains(&sentence), "{sentence}");
    }
}
