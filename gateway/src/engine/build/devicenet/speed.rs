//! Velocity drives of the AC/DC drive profile.

use profile_cip::devicenet::wire::speed::Assembly;
use profile_generic::ratio::Ratio;
use profile_generic::scaling::{NANO, UnitKind};

use super::Parts;
use crate::config::{Axis, DevicenetDrive};
use crate::engine::build::kind;
use crate::engine::bus::devicenet::end::{End, SpeedLink};
use crate::engine::bus::devicenet::setup::speed_steps;
use crate::mapping::Mapping;
use crate::mapping::devicenet::{DevicenetAxis, DevicenetError, SpeedAxis};

/// Highest SpeedScale and, with a minus, the lowest one that a ratio has room for.
const SCALE_MAX: u32 = 30;

/// What a drive with this output assembly and SpeedScale is controlled by.
pub(super) fn parts(
    drive: &DevicenetDrive,
    axis: &Axis,
    mapping: &Mapping,
    (assembly, scale): (Assembly, i8),
) -> Result<Parts, DevicenetError> {
    let speed = speed(drive, axis, scale).ok_or(DevicenetError::Overflow)?;
    let extended = assembly.is_extended();
    let needs = SpeedAxis { speed, extended };
    let program = mapping.devicenet_speed_program(&needs)?;
    let link = SpeedLink::new(assembly).map_err(|_| DevicenetError::Assembly(assembly))?;
    let (end, needs) = (End::Speed(link), DevicenetAxis::Speed(needs));
    Ok(Parts { end, needs, program, steps: speed_steps(scale, extended) })
}

/// Nanounits of the axis per second in a unit of the speed: rpm / 2^SpeedScale.
fn speed(drive: &DevicenetDrive, axis: &Axis, scale: i8) -> Option<Ratio> {
    let steps = u32::from(scale.unsigned_abs()).min(SCALE_MAX);
    let power = 1_i64 << steps;
    let rpm = Ratio::new(NANO, 60)?;
    let unit = rpm.then(if scale < 0 { Ratio::new(power, 1)? } else { Ratio::new(1, power)? })?;
    match kind(axis) {
        UnitKind::Rotary => Some(unit),
        UnitKind::Linear => unit.then(drive.way_of_a_turn?),
    }
}
