//! Whether the box behind the device may be started anew: the answer to a Reset of the Identity object.

use super::device::MotionDevice;

impl MotionDevice {
    /// Whether a restart would take a controller or a drive by surprise: a motion connection is open, or an axis may
    /// still be energized, which it is until its drive says otherwise.
    pub(in crate::device) fn is_in_use(&self) -> bool {
        let energized =
            |slot: &super::device::Slot| slot.axis.drive().power_enabled || slot.axis.state().is_energized();
        self.connection.is_some() || self.slots.iter().any(energized)
    }
}
