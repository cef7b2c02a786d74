//! CIP Motion drives.

use profile_cip::wire::motion::codes::ControlMode;
use profile_generic::mode::OperatingMode;
use profile_generic::scaling::{NANO, UnitKind};

use super::Parts;
use crate::config::{Axis, AxisFunction, Devicenet, DevicenetDrive};
use crate::engine::build::{kind, parameters};
use crate::engine::bus::devicenet::end::{End, MotionLink};
use crate::engine::bus::devicenet::setup::motion_steps;
use crate::mapping::devicenet::{DevicenetAxis, DevicenetError, MotionAxis};
use crate::mapping::{CipScaling, Mapping};

/// What a drive with these modes and counts in a unit is controlled by.
pub(super) fn parts(
    network: &Devicenet,
    drive: &DevicenetDrive,
    axis: &Axis,
    mapping: &Mapping,
    (modes, resolution): (&[OperatingMode], u32),
) -> Result<Parts, DevicenetError> {
    let modes: &[OperatingMode] = match axis.function {
        AxisFunction::Drive => modes,
        // What is only looked at has its position looked at.
        AxisFunction::Encoder | AxisFunction::Converter => &[OperatingMode::Position],
    };
    let scaling = scaling(drive, axis, resolution)?;
    let needs = MotionAxis { scaling, modes: modes.to_vec() };
    let program = mapping.devicenet_motion_program(&needs)?;
    let limits = parameters(axis);
    let limits = limits
        .into_iter()
        .map(|(parameter, value)| mapping.devicenet_parameter(&scaling, parameter, value))
        .collect::<Result<Vec<_>, _>>()?;
    let first = match modes.first() {
        Some(OperatingMode::Velocity) => ControlMode::VELOCITY,
        Some(OperatingMode::Torque) => ControlMode::TORQUE,
        _ => ControlMode::POSITION,
    };
    let link = MotionLink::new(first, resolution, network.cycle_time);
    let (end, needs) = (End::Motion(link), DevicenetAxis::Motion(needs));
    Ok(Parts { end, needs, program, steps: motion_steps(&limits) })
}

/// The units of a CIP Motion drive: revolutions of its motor, or millimetres.
fn scaling(drive: &DevicenetDrive, axis: &Axis, resolution: u32) -> Result<CipScaling, DevicenetError> {
    // Nanounits of the axis in a turn; a way that is no whole number of them cannot be.
    let way = match drive.way_of_a_turn {
        Some(way) if kind(axis) == UnitKind::Linear => {
            let whole = way.convert(NANO, profile_generic::ratio::Rounding::Nearest);
            if whole.inexact || whole.saturated {
                return Err(DevicenetError::Overflow);
            }
            whole.value
        }
        _ => NANO,
    };
    Ok(CipScaling {
        kind: kind(axis),
        nanounits_per_unit: way,
        counts_per_unit: i64::from(resolution),
        inverted: false,
        unwind: None,
    })
}
