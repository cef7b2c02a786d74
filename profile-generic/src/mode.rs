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
    }
}
