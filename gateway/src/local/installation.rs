//! What does not change while the gateway runs: the names of its devices, buses and axes.

use std::net::Ipv4Addr;

use profile_generic::can::timing::BitRate;

use crate::config::{Axis, AxisKind, CanLink, Config, DriveAt, Link, TimeSource};
use crate::engine::bus::BusName;

/// The parts of a gateway by name, in the order in which the published status has them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Installation {
    /// Name of the gateway.
    pub name: String,
    /// Source of system time.
    pub source: TimeSource,
    /// The CIP Motion devices.
    pub devices: Vec<NamedDevice>,
    /// The SERCOS bus, the CANopen buses, the DeviceNet networks.
    pub buses: Vec<NamedBus>,
    /// The axes.
    pub axes: Vec<NamedAxis>,
}

/// A CIP Motion device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedDevice {
    /// Its name.
    pub name: String,
    /// The address of the gateway that it listens on.
    pub address: Ipv4Addr,
}

/// What a bus speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusKind {
    /// SERCOS III.
    Sercos,
    /// CANopen.
    Canopen,
    /// DeviceNet.
    Devicenet,
}

impl BusKind {
    /// Its name for programs.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sercos => "sercos",
            Self::Canopen => "canopen",
            Self::Devicenet => "devicenet",
        }
    }
}

/// A bus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedBus {
    /// Its name, as the log has it: `SERCOS`, `CAN bus 1`, `DeviceNet 1`.
    pub name: String,
    /// Its interface, two for a ring, or `in-process`.
    pub interface: String,
    /// What it speaks.
    pub kind: BusKind,
    /// Its bit rate, where it is on CAN.
    pub bit_rate: Option<BitRate>,
}

/// An axis.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedAxis {
    /// Its name.
    pub name: String,
    /// Rotary or linear.
    pub kind: AxisKind,
    /// Place of its bus in [`Installation::buses`].
    pub bus: usize,
    /// Name of its drive.
    pub drive: String,
    /// Its drive on the bus, such as `address 3`, `node 5` or `MAC ID 7`.
    pub address: String,
}

impl Installation {
    /// The parts of a configuration.
    #[must_use]
    pub fn of(config: &Config) -> Self {
        let device = |device: &crate::config::Device| NamedDevice {
            name: device.name.clone(),
            address: device.listen,
        };
        let sercos = config.sercos.iter().map(|bus| NamedBus {
            name: BusName::Sercos.to_string(),
            interface: interface_of(&bus.link),
            kind: BusKind::Sercos,
            bit_rate: None,
        });
        let can = (1..)
            .zip(&config.can)
            .map(|(number, bus)| named_can(BusName::Can(number), BusKind::Canopen, &bus.link, bus.bit_rate));
        let devicenet = (1..).zip(&config.devicenet).map(|(number, network)| {
            named_can(BusName::Devicenet(number), BusKind::Devicenet, &network.link, network.bit_rate())
        });
        Self {
            name: config.name.clone(),
            source: config.time.source,
            devices: config.devices.iter().map(device).collect(),
            buses: sercos.chain(can).chain(devicenet).collect(),
            axes: config.axes.iter().map(|axis| named_axis(config, axis)).collect(),
        }
    }

    /// The bus of an axis, by the place of the axis.
    #[must_use]
    pub fn bus_of(&self, axis: usize) -> Option<&NamedBus> {
        self.buses.get(self.axes.get(axis)?.bus)
    }
}

fn interface_of(link: &Link) -> String {
    match link {
        Link::Interface { name, ring: Some(ring) } => format!("{name}, {ring}"),
        Link::Interface { name, ring: None } => name.clone(),
        Link::InProcess { .. } => "in-process".to_owned(),
    }
}

fn named_can(name: BusName, kind: BusKind, link: &CanLink, bit_rate: BitRate) -> NamedBus {
    let interface = match link {
        CanLink::Interface { name, .. } => name.clone(),
        CanLink::InProcess => "in-process".to_owned(),
    };
    NamedBus { name: name.to_string(), interface, kind, bit_rate: Some(bit_rate) }
}

fn named_axis(config: &Config, axis: &Axis) -> NamedAxis {
    let before_can = usize::from(config.sercos.is_some());
    let bus = match axis.drive {
        DriveAt::Sercos { .. } => 0,
        DriveAt::Can { bus, .. } => before_can + bus,
        DriveAt::Devicenet { network, .. } => before_can + config.can.len() + network,
    };
    let sercos = config.sercos_drive(axis).map(|drive| &drive.name);
    let can = || config.can_drive(axis).map(|(_, drive)| &drive.name);
    let devicenet = || config.devicenet_drive(axis).map(|(_, drive)| &drive.name);
    let drive = sercos.or_else(can).or_else(devicenet).cloned().unwrap_or_default();
    NamedAxis { name: axis.name.clone(), kind: axis.kind, bus, drive, address: address(config, axis) }
}

/// Where the drive of an axis is on its bus, in the words of the bus.
fn address(config: &Config, axis: &Axis) -> String {
    let sercos = config.sercos_drive(axis).map(|drive| format!("address {}", drive.address));
    let can = || {
        config.can_drive(axis).map(|(_, drive)| match drive.axis {
            0 => format!("node {}", drive.node),
            other => format!("node {}, axis {other}", drive.node),
        })
    };
    let devicenet = || config.devicenet_drive(axis).map(|(_, drive)| format!("MAC ID {}", drive.mac));
    sercos.or_else(can).or_else(devicenet).unwrap_or_default()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The names of the gateway of [`crate::status::tests::distinct`].
    pub(crate) fn installation() -> Installation {
        let axis = |name: &str, kind, bus, drive: &str| NamedAxis {
            name: name.to_owned(),
            kind,
            bus,
            drive: drive.to_owned(),
            address: format!("address {}", bus + 3),
        };
        let device =
            |name: &str, last| NamedDevice { name: name.to_owned(), address: Ipv4Addr::new(192, 0, 2, last) };
        let bus = |name: &str, interface: &str, kind, bit_rate| NamedBus {
            name: name.to_owned(),
            interface: interface.to_owned(),
            kind,
            bit_rate,
        };
        Installation {
            name: "cell 4".to_owned(),
            source: TimeSource::Ptp,
            devices: vec![device("front", 1), device("back", 2)],
            buses: vec![
                bus("SERCOS", "eth1, eth2", BusKind::Sercos, None),
                bus("CAN bus 1", "can0", BusKind::Canopen, BitRate::fd(500_000, 2_000_000)),
            ],
            axes: vec![
                axis("turntable", AxisKind::Rotary, 0, "drive-a"),
                axis("slide", AxisKind::Linear, 1, "drive-b"),
            ],
        }
    }

    #[test]
    fn devices_buses_and_drives_have_their_names() {
        let text = include_str!("../../../examples/two-axes-in-process.toml");
        let found = Installation::of(&Config::parse(text, "two-axes-in-process.toml").unwrap());
        assert_eq!((found.name.as_str(), found.source), ("two axes", TimeSource::Shared));
        let device = NamedDevice { name: "front".to_owned(), address: Ipv4Addr::new(127, 0, 0, 2) };
        assert_eq!(found.devices, [device]);
        let bus = NamedBus {
            name: "SERCOS".to_owned(),
            interface: "in-process".to_owned(),
            kind: BusKind::Sercos,
            bit_rate: None,
        };
        assert_eq!(found.buses, [bus]);
        let axes: Vec<_> = found.axes.iter().map(|axis| (&*axis.name, &*axis.drive, axis.bus)).collect();
        assert_eq!(axes, [("turntable", "drive-a", 0), ("slide", "drive-b", 0)]);
        let addresses: Vec<_> = found.axes.iter().map(|axis| &*axis.address).collect();
        assert_eq!(addresses, ["address 1", "address 2"]);
        assert_eq!(found.bus_of(1).map(|bus| &*bus.name), Some("SERCOS"));
        assert_eq!(found.bus_of(2), None);
    }
}
