//! Whether the poll messages of all drives fit their DeviceNet and its cycle, and whether each drive can do what its axis is
//! to do.

use crate::config::{Axis, AxisKind, DevicenetDrive, DevicenetKind, Written};
use crate::engine::build::devicenet::{master, parts};
use crate::finding::registry as code;
use crate::finding::{Findings, Problem};
use crate::mapping::Mapping;
use profile_cip::devicenet::master::config::{ConfigError, MasterConfig};
use profile_generic::time::DurationNs;

use crate::config::file::AxisTable;

/// Percent of the cycle that poll messages may take; the rest is for explicit messages, and for answers that come late.
const SHARE_PERCENT: i64 = 80;

const MILLISECOND_NS: i64 = 1_000_000;

/// Plans each network as the box would set it up.
pub(super) fn check(mapping: &Mapping, written: &Written, findings: &mut Findings) {
    let config = &written.config;
    for (axis, table) in config.axes.iter().zip(&written.file.axis) {
        let Some((network, drive)) = config.devicenet_drive(axis) else { continue };
        let table = table.get_ref();
        let fit = able(axis, table, drive, findings, written);
        if let Err(error) = parts(network, drive, axis, mapping)
            && fit
        {
            let problem = Problem::new(code::AXIS_TABLES, table.name.span());
            let problem = problem.title(format!("no program can be made for the axis `{}`", axis.name));
            findings.push(&written.text, problem.expected(error.to_string()));
        }
    }
    let tables = written.file.south.get_ref().devicenet.iter();
    for (place, table) in tables.enumerate() {
        let master = master(config, place);
        let problem = Problem::new(code::CYCLE_FULL, table.get_ref().cycle_time.span()).key("cycle_time");
        match master.check() {
            Ok(()) | Err(ConfigError::Load { .. }) => {}
            Err(error) => {
                findings.push(&written.text, problem.expected(error.to_string()));
                continue;
            }
        }
        if let Some(expected) = overload(&master) {
            let drives = master.slaves.len();
            let title = format!("the cycle cannot hold the messages of {drives} drives");
            findings.push(&written.text, problem.title(title).expected(expected));
        }
    }
}

/// What is too much; `None` where everything fits.
fn overload(master: &MasterConfig) -> Option<String> {
    let (needed, cycle) = (master.io_time(), master.cycle);
    let permille = needed.as_nanos().saturating_mul(1000) / cycle.as_nanos().max(1);
    if permille <= SHARE_PERCENT * 10 {
        return None;
    }
    let share = SHARE_PERCENT * MILLISECOND_NS;
    let shortest = (needed.as_nanos().saturating_mul(100).saturating_add(share - 1)) / share;
    let kilobits = master.rate.bits_per_second() / 1000;
    Some(format!(
        "polls and answers are {} frames, which take up to {needed} of the cycle of {cycle} ({}.{} %) at {kilobits} kbit/s, \
         expected at most {SHARE_PERCENT} %; a cycle of {} would do",
        master.io_frames(),
        permille / 10,
        permille % 10,
        DurationNs::from_millis(shortest),
    ))
}

/// What a velocity drive lacks: a position, and limits of its own that the box could tell it.
fn able(
    axis: &Axis,
    table: &AxisTable,
    drive: &DevicenetDrive,
    findings: &mut Findings,
    written: &Written,
) -> bool {
    if !matches!(drive.kind, DevicenetKind::Speed { .. }) {
        return true;
    }
    let mut fit = true;
    if axis.kind == AxisKind::Linear && drive.way_of_a_turn.is_none() {
        let title = format!("`millimetres_per_turn` of the drive `{}` is missing", drive.name);
        let problem = Problem::new(code::AXIS_TABLES, table.drive.span()).title(title);
        findings.push(&written.text, problem.expected("expected millimetres_per_turn"));
        fit = false;
    }
    let Some(limits) = &table.limits else { return fit };
    let all = [
        ("position_min", &limits.position_min),
        ("position_max", &limits.position_max),
        ("following_error", &limits.following_error),
        ("acceleration", &limits.acceleration),
        ("torque_percent", &limits.torque_percent),
    ];
    for (key, limit) in all.into_iter().filter_map(|(key, limit)| Some((key, limit.as_ref()?))) {
        let problem = Problem::new(code::LIMIT_UNFIT, limit.span()).key(key);
        let problem = problem.title(format!("`{key}` cannot be enforced on the drive `{}`", drive.name));
        let help = "expected no limit but that of the velocity: a velocity drive of the AC/DC drive profile tells no \
                    position and is told no limits";
        findings.push(&written.text, problem.expected(help));
        fit = false;
    }
    fit
}
