//! Whether the box behind the device may be started anew: the answer to a Reset of the Identity object.

use super::motion_device::MotionDevice;

impl MotionDevice {
    /// Whether a restart would take a controller or a drive by surprise: a motion connection is open, or an axis may
    /// still be energized, which it is until its drive says otherwise.
    pub(super) fn is_in_use(&self) -> bool {
        let energized = |slot: &super::motion_device::Slot| {
            slot.axis.drive().power_enabled || slot.axis.state().is_energized()
        };
        self.connection.is_some() || self.slots.iter().any(energized)
    }
}
