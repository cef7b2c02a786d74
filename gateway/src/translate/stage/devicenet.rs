//! Drives on DeviceNet: everything that the box knows of them stands in the configuration.

use profile_cip::devicenet::wire::MacId;
use profile_generic::image::Signal;
use profile_generic::program::Field;

use super::{Behind, RowCache, StageAxis, StageError};
use crate::config::Config;
use crate::engine::build::devicenet::{Parts, parts};
use crate::engine::build::scaling;
use crate::engine::bus::devicenet::end::End;
use crate::mapping::Mapping;
use crate::mapping::devicenet::DevicenetAxis;

/// Byte of the value in an update of the fixed format, and of the speed in an assembly.
const VALUE_AT: usize = 12;
const SPEED_AT: usize = 2;

/// A drive on DeviceNet.
#[derive(Debug, Clone)]
pub struct DevicenetDrive {
    /// Its MAC ID.
    pub mac: MacId,
    /// What it is needed for.
    pub needs: DevicenetAxis,
    /// The box's end of its poll connection, as it is at the start.
    pub end: End,
}

impl DevicenetDrive {
    /// Whether it is a CIP Motion drive.
    #[must_use]
    pub const fn is_motion(&self) -> bool {
        matches!(self.needs, DevicenetAxis::Motion(_))
    }

    /// Name of a value, and where it stands in a message; `None` of one that stands there in another form.
    #[must_use]
    pub fn value(&self, field: &Field) -> (&'static str, Option<usize>) {
        match (&self.needs, field.signal) {
            // It goes without its sign, which is the bit of reverse.
            (DevicenetAxis::Speed(_), signal) if signal.is_command() => ("speed reference", None),
            (DevicenetAxis::Speed(_), _) => ("speed", Some(SPEED_AT)),
            (DevicenetAxis::Motion(_), Signal::PositionCommand) => ("Command Position", Some(VALUE_AT)),
            (DevicenetAxis::Motion(_), Signal::VelocityCommand) => ("Command Velocity", Some(VALUE_AT)),
            (DevicenetAxis::Motion(_), Signal::TorqueCommand) => ("Command Torque", Some(VALUE_AT)),
            (DevicenetAxis::Motion(_), Signal::PositionActual) => ("Actual Position", Some(VALUE_AT)),
            (DevicenetAxis::Motion(_), _) => ("change of the position, per second", None),
        }
    }
}

/// The axes of a network of a configuration, each with its number there.
///
/// # Errors
/// A drive cannot be led as the configuration says.
pub(super) fn configured(
    config: &Config,
    network: usize,
    mapping: &Mapping,
) -> Result<Vec<(usize, StageAxis)>, StageError> {
    let mut axes = Vec::new();
    let all = config.axes.iter().enumerate();
    for (number, axis) in all {
        let Some((of, drive)) = config.devicenet_drive(axis) else { continue };
        let own = &config.devicenet[network];
        if !std::ptr::eq(of, own) {
            continue;
        }
        let failed = |told: String| StageError::Program { axis: axis.name.clone(), told };
        let Parts { end, needs, program, .. } =
            parts(own, drive, axis, mapping).map_err(|error| failed(error.to_string()))?;
        let scaling = scaling(axis);
        let no_ratio = || failed("a ratio of its scaling does not fit 64 bits".to_owned());
        let made = StageAxis {
            name: axis.name.clone(),
            device: axis.device,
            instance: axis.instance,
            drive: drive.name.clone(),
            bus: config.can.len() + network,
            behind: Behind::Devicenet(DevicenetDrive { mac: drive.mac, needs, end }),
            stands_in: false,
            north: mapping.cip_program(&scaling).ok_or_else(no_ratio)?,
            attributes: mapping.attribute_table(&scaling).ok_or_else(no_ratio)?,
            south: program,
            rows: RowCache::default(),
            scaling,
        };
        axes.push((number, made));
    }
    Ok(axes)
}
