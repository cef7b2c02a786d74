//! A simulated CiA 402 drive on CANopen.

use profile_cia402::node::drive::{Device, DeviceError, identity};
use profile_cia402::node::{Config, Node};
use profile_cia402::wire::NodeId;
use profile_generic::servo::ServoParameters;
use profile_generic::time::DurationNs;

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
    made(node, axes, |_| {})
}

/// A device that stands in for one of a configuration, with so many axes: it is what the configuration expects it to be. One that
/// is to get its node-id by LSS has none.
///
/// # Errors
/// Another number of axes than 1 to 8.
pub fn stand_in(node: NodeId, axes: u8, device: Option<&CanDevice>) -> Result<DriveNode, DeviceError> {
    made(Some(node), axes, |config| {
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

fn made(node: Option<NodeId>, axes: u8, change: impl FnOnce(&mut Config)) -> Result<DriveNode, DeviceError> {
    let servos = vec![ServoParameters::default(); usize::from(axes)];
    let mut config = Config {
        node,
        identity: identity(servos.len(), node.map_or(0, |node| u32::from(node.get()))),
        boot_time: BOOT_TIME,
        has_blocks: true,
        has_mapping: true,
    };
    change(&mut config);
    Ok(Node::new(&config, Device::new(&servos)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drives_have_one_to_eight_axes() {
        for axes in 1..=8 {
            let node = drive(NodeId::new(1).ok(), axes).expect("a drive");
            assert_eq!(node.application().axes().len(), usize::from(axes));
        }
        assert!(drive(None, 0).is_err() && drive(None, 9).is_err());
    }
}
