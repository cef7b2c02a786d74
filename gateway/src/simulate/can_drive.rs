//! A simulated CiA 402 drive on CANopen.

use profile_cia402::drive::State;
use profile_cia402::drive::index::{AXIS_OFFSET, GEAR_RATIO};
use profile_cia402::eds::DeviceDescription;
use profile_cia402::node::dictionary::Group;
use profile_cia402::node::drive::{Axis, Device, DeviceError, identity, identity_of};
use profile_cia402::node::{Config, Node};
use profile_cia402::wire::NodeId;
use profile_cia402::wire::nmt::NmtState;
use profile_generic::quantity::Position;
use profile_generic::servo::{Servo, ServoParameters};
use profile_generic::time::DurationNs;

use super::can_actor::ActingNode;
use super::drive_events::Shown;
use super::drive_events::setup::Setup;
use crate::config::CanDevice;

/// From a reset to the boot-up message.
const BOOT_TIME: DurationNs = DurationNs::from_millis(50);

/// A node on a bus.
pub type DriveNode = Node<Device>;

/// A device with so many axes, 1 to 8, each a servo of 1 Nm and 3000 revolutions per minute. Without a node-id it waits for
/// one by LSS. Its serial number is the node-id it begins with.
///
/// # Errors
/// Another number of axes.
pub fn drive(node: Option<NodeId>, axes: u8) -> Result<DriveNode, DeviceError> {
    drive_with(node, serial_of(node), axes, &Setup::default())
}

fn serial_of(node: Option<NodeId>) -> u32 {
    node.map_or(0, |node| u32::from(node.get()))
}

/// The same with a serial number of its own, by which LSS tells it from others, and with what a script makes of its axes, 1 to 8.
///
/// # Errors
/// Another number of axes, or one that cannot work.
pub fn drive_with(
    node: Option<NodeId>,
    serial: u32,
    axes: u8,
    setup: &Setup,
) -> Result<DriveNode, DeviceError> {
    made(node, axes, setup, None, |config| config.identity.serial = serial)
}

/// A device that stands in for one of a configuration, with so many axes: it is what the configuration expects it to be. One that
/// is to get its node-id by LSS has none.
///
/// # Errors
/// Another number of axes than 1 to 8.
pub fn stand_in(node: NodeId, axes: u8, device: Option<&CanDevice>) -> Result<DriveNode, DeviceError> {
    made(Some(node), axes, &Setup::default(), None, |config| {
        let Some(device) = device else { return };
        let (own, expected) = (&mut config.identity, device.expected);
        let numbers = [
            (&mut own.vendor, expected.vendor),
            (&mut own.product, expected.product),
            (&mut own.revision, expected.revision),
            (&mut own.serial, expected.serial),
        ];
        for (own, expected) in numbers {
            *own = expected.unwrap_or(*own);
        }
        config.has_mapping = !device.keeps_mapping;
        config.node = config.node.filter(|_| device.lss.is_none());
    })
}

/// A device with the objects of a data sheet, and with as many axes as that has.
///
/// # Errors
/// Another number of axes than 1 to 8, or one that cannot work.
pub(super) fn like(
    node: Option<NodeId>,
    serial: u32,
    axes: u8,
    setup: &Setup,
    sheet: DeviceDescription,
) -> Result<DriveNode, DeviceError> {
    made(node, axes, setup, Some(sheet), |config| config.identity.serial = serial)
}

fn made(
    node: Option<NodeId>,
    axes: u8,
    setup: &Setup,
    sheet: Option<DeviceDescription>,
    change: impl FnOnce(&mut Config),
) -> Result<DriveNode, DeviceError> {
    let numbers = 1..=u16::from(axes);
    let servos: Vec<_> = numbers.clone().map(|axis| setup.servo(axis, ServoParameters::default())).collect();
    let mut config = Config {
        node,
        identity: identity(servos.len(), serial_of(node)),
        boot_time: BOOT_TIME,
        has_blocks: true,
        has_mapping: true,
    };
    change(&mut config);
    let device = match sheet {
        None => Device::new(&servos)?,
        Some(sheet) => {
            config.identity = identity_of(&sheet, config.identity);
            Device::like(&servos, sheet, node.map_or(0, NodeId::get))?
        }
    };
    let mut node = Node::new(&config, device);
    let gears = numbers.filter_map(|axis| setup.gear(axis).map(|gear| (axis - 1, gear)));
    for (number, (motor, load)) in gears {
        let index = GEAR_RATIO + number * AXIS_OFFSET;
        let dictionary = node.dictionary_mut();
        dictionary.set(index, 1, i64::from(motor));
        dictionary.set(index, 2, i64::from(load));
        // A reset of the node keeps it.
        dictionary.store(Group::All);
        dictionary.reset(Group::All);
    }
    Ok(node)
}

impl ActingNode for DriveNode {
    type State = Shown<NmtState, State>;

    fn state(&self, drive: u16) -> Option<Self::State> {
        let axis = self.application().axes().get(usize::from(drive).checked_sub(1)?)?;
        let actual = axis.actual();
        let (link, state) = (DriveNode::state(self), axis.state());
        Some(Shown { link, state, fault: actual.fault, warning: actual.warning, silent: false })
    }

    fn servo_mut(&mut self, drive: u16) -> Option<&mut Servo> {
        axis_mut(self, drive).map(Axis::servo_mut)
    }

    fn set_power(&mut self, drive: u16, on: bool) {
        if let Some(axis) = axis_mut(self, drive) {
            axis.set_main_power(on);
        }
    }

    fn set_limit_switches(&mut self, drive: u16, lower: Position, upper: Position) -> bool {
        let Some(axis) = axis_mut(self, drive) else { return false };
        axis.set_limit_switches(lower, upper);
        axis.set_ignores_limit_switches(true);
        true
    }
}

fn axis_mut(node: &mut DriveNode, number: u16) -> Option<&mut Axis> {
    node.application_mut().axes_mut().get_mut(usize::from(number).checked_sub(1)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drives_without_a_node_id_are_told_apart_by_their_serial_numbers() {
        let serial = |serial| {
            let node = drive_with(None, serial, 1, &Setup::default()).expect("a drive");
            node.dictionary().number(0x1018, 4)
        };
        assert_eq!([serial(0x1234), serial(0xFFFF_FFFF)], [0x1234, 0xFFFF_FFFF]);
    }

    #[test]
    fn drives_have_one_to_eight_axes() {
        for axes in 1..=8 {
            let node = drive(NodeId::new(1).ok(), axes).expect("a drive");
            assert_eq!(node.application().axes().len(), usize::from(axes));
        }
        assert!(drive(None, 0).is_err() && drive(None, 9).is_err());
    }
}
