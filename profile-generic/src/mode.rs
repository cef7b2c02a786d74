//! Operating modes: which quantity the drive follows (device control functional element).

use crate::code::named_enum;

named_enum! {
    /// What the drive controls.
    ///
    /// Position control implies velocity control, velocity control implies acceleration control, and so on
    /// down to torque (IEC 61800-7-202, 4.2.1).
    #[derive(Default)]
    pub enum OperatingMode {
        /// Feedback only: nothing is controlled, the power stage stays off.
        #[default]
        None = "none",
        /// Follows position set-points.
        Position = "position",
        /// Follows velocity set-points.
        Velocity = "velocity",
        /// Follows acceleration set-points.
        Acceleration = "acceleration",
        /// Follows torque or force set-points.
        Torque = "torque",
        /// Homing by the drive itself, an application function.
        Homing = "homing",
    }
}

named_enum! {
    /// Who generates the fine set-points between two updates from the controller.
    #[derive(Default)]
    pub enum InterpolationSource {
        /// The controller sends a set-point for each update; the drive only interpolates finely between them.
        #[default]
        Controller = "controller",
        /// The controller sends a target, and the drive generates the profile to it.
        Drive = "drive",
    }
}

/// What the drive follows, and who makes the way there: together they choose an operation mode of a drive, or a
/// procedure that it carries out. Homing with the [`InterpolationSource::Drive`] is done by the drive alone; with the
/// [`InterpolationSource::Controller`] the controller moves the axis, and the drive looks for the place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ModeSelection {
    /// What the drive follows.
    pub mode: OperatingMode,
    /// Who makes the way.
    pub interpolation: InterpolationSource,
}

impl ModeSelection {
    /// The drive makes the way by itself.
    pub const fn by_drive(mode: OperatingMode) -> Self {
        Self { mode, interpolation: InterpolationSource::Drive }
    }
}

impl From<OperatingMode> for ModeSelection {
    /// The controller makes the way.
    fn from(mode: OperatingMode) -> Self {
        Self { mode, interpolation: InterpolationSource::Controller }
    }
}

impl core::fmt::Display for ModeSelection {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.interpolation {
            InterpolationSource::Controller => write!(f, "{}", self.mode),
            InterpolationSource::Drive => write!(f, "{} by the drive", self.mode),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_back() {
        for mode in OperatingMode::ALL {
            assert_eq!(OperatingMode::parse(mode.name()), Some(*mode));
        }
        assert_eq!(OperatingMode::default(), OperatingMode::None);
        assert_eq!(InterpolationSource::parse("drive"), Some(InterpolationSource::Drive));
        assert_eq!(ModeSelection::from(OperatingMode::Torque).to_string(), "torque");
        assert_eq!(ModeSelection::by_drive(OperatingMode::Homing).to_string(), "homing by the drive");
    }
}
