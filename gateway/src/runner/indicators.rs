//! What the indicators show, as log lines whenever it changes, for a box without lamps.

use profile_cip::device::visualization::{self, Indication};

use crate::status::{BoxStatus, Indicators};

/// A change of what is shown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Change {
    /// At a device.
    Device {
        /// Its number in the configuration.
        device: usize,
        /// Module Status LED.
        module_status: Indication,
        /// Network Status LED.
        network_status: Indication,
    },
    /// At an axis.
    Axis {
        /// Its number in the configuration.
        axis: usize,
        /// Axis Status LED.
        axis_status: Indication,
        /// The line of the display; empty for none.
        display: String,
    },
}

/// What was shown last.
#[derive(Debug, Default)]
pub struct Shown {
    axes: Vec<Indicators>,
}

impl Shown {
    /// What has changed since the last call; everything at the first one.
    pub fn changes(&mut self, status: &BoxStatus) -> Vec<Change> {
        let mut changes = Vec::new();
        let mut told = None;
        for (number, axis) in status.configured_axes().iter().enumerate() {
            let now = axis.indicators;
            let before = self.axes.get(number).copied();
            // Every axis of a device tells the lamps of the device alike.
            let device = Some(axis.device);
            if told != device
                && before.is_none_or(|was| (was.module, was.network) != (now.module, now.network))
            {
                told = device;
                changes.push(Change::Device {
                    device: usize::from(axis.device),
                    module_status: visualization::module_status(now.module),
                    network_status: now.network,
                });
            }
            if before.is_none_or(|was| (was.axis, was.line) != (now.axis, now.line)) {
                let display = axis.display().to_string();
                changes.push(Change::Axis { axis: number, axis_status: now.axis, display });
            }
        }
        self.axes = status.configured_axes().iter().map(|axis| axis.indicators).collect();
        changes
    }
}

#[cfg(test)]
mod tests {
    use profile_cip::device::identity::ModuleState;
    use profile_cip::device::visualization::display::{Line, LineText};

    use super::*;
    use crate::status::tests::distinct;

    fn device(device: usize, module_status: Indication, network_status: Indication) -> Change {
        Change::Device { device, module_status, network_status }
    }

    fn axis(axis: usize, axis_status: Indication, display: &str) -> Change {
        Change::Axis { axis, axis_status, display: display.to_owned() }
    }

    #[test]
    fn each_change_is_told_once() {
        let mut shown = Shown::default();
        let mut status = distinct();
        let first = [
            device(0, Indication::FLASHING_RED, Indication::SOLID_GREEN),
            axis(0, Indication::RED_GREEN, "X1:RUNNING"),
            device(1, Indication::SOLID_RED, Indication::OFF),
            axis(1, Indication::SOLID_RED, "INIT FLT S12"),
        ];
        assert_eq!(shown.changes(&status), first);
        status.axes[0].position.0 += 1;
        status.axes[0].indicators.minor_fault = false;
        assert_eq!(shown.changes(&status), []);
        status.axes[0].indicators.line = Line { text: LineText::ALARM, code: 7 };
        assert_eq!(shown.changes(&status), [axis(0, Indication::RED_GREEN, "X1:ALARM S07")]);
        status.axes[1].indicators.module = ModuleState::Standby;
        assert_eq!(shown.changes(&status), [device(1, Indication::FLASHING_GREEN, Indication::OFF)]);
        assert_eq!(shown.changes(&status), []);
    }

    #[test]
    fn the_lamps_of_a_device_are_told_once_for_all_its_axes() {
        let mut status = distinct();
        status.axes[1] = status.axes[0];
        status.axes[1].instance = 2;
        let changes = Shown::default().changes(&status);
        let devices = changes.iter().filter(|change| matches!(change, Change::Device { .. })).count();
        assert_eq!((devices, changes.len()), (1, 3), "{changes:?}");
    }
}
