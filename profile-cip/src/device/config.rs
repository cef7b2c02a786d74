//! What the adapter is told about the device it speaks for.

use arrayvec::{ArrayString, ArrayVec};
use core::fmt;
use core::net::Ipv4Addr;
use std::sync::Arc;

use super::hosts::Hosts;
use super::port::{InterfaceType, LinkState};
use crate::assembly::Assemblies;
use crate::wire::class1::SEQUENCE_COUNT_LEN;
use crate::wire::encapsulation::{EXPLICIT_PORT, IO_PORT};
use crate::wire::epath::ElectronicKey;
use crate::wire::list_identity::PRODUCT_NAME_MAX;
use crate::wire::motion::{Format, fixed};

/// Device type (profile) of CIP Motion drives (Volume 9 clause 6-2).
pub const DEVICE_TYPE_CIP_MOTION_DRIVE: u16 = 0x25;
/// Device type of CIP Motion encoders.
pub const DEVICE_TYPE_CIP_MOTION_ENCODER: u16 = 0x2F;
/// Device type of CIP Motion converters.
pub const DEVICE_TYPE_CIP_MOTION_CONVERTER: u16 = 0x30;

/// Device type of a device without a profile of its own: Generic Device (keyable).
pub const DEVICE_TYPE_GENERIC: u16 = 0x2B;

/// Most axis instances of a device on EtherNet/IP (IEC 61800-7-302).
pub const AXES_MAX: usize = 16;

/// Smallest motion connection in bytes: sequence count and connection header.
pub const MOTION_SIZE_MIN: u16 = 10;

/// Size of either direction of a motion connection in the fixed format, in bytes: sequence count and update.
pub const MOTION_SIZE_FIXED: u16 = 18;

/// Largest motion connection in bytes that fits one Ethernet frame: 1500 less IP, UDP and the datagram's
/// items.
pub const MOTION_SIZE_MAX: u16 = 1454;

/// Longest electronic data sheet in bytes: a sheet of every attribute of 16 axes has less than a tenth of it.
pub const EDS_LEN_MAX: usize = 1 << 22;

/// Largest code point: six bits.
pub const DSCP_MAX: u8 = 63;

/// Longest session inactivity time-out in seconds (attribute 13).
pub const INACTIVITY_TIMEOUT_MAX_S: u16 = 3600;

/// Everything the adapter is told at its start.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AdapterConfig {
    /// Identity object.
    pub identity: IdentityConfig,
    /// TCP/IP Interface object.
    pub interface: InterfaceConfig,
    /// Ethernet Link object.
    pub link: LinkConfig,
    /// QoS object.
    pub qos: QosConfig,
    /// The motion connection.
    pub motion: MotionConfig,
    /// Assemblies in place of the Motion Device Axis Object and its connection; intervals of their connections are those of
    /// `motion`.
    pub assembly: Option<Assemblies>,
    /// Who may own the device and change anything in it; others may read and listen.
    pub controllers: Hosts,
    /// Electronic data sheet of the device, served by the File object; empty for none, and then there is no such
    /// object. At most [`EDS_LEN_MAX`] bytes.
    pub eds: Arc<[u8]>,
    /// Where connection IDs and session handles start. A value that differs from run to run keeps a peer from
    /// taking a connection of the last run for one of this run.
    pub incarnation: u16,
}

/// Who the device is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IdentityConfig {
    /// Vendor ID given by ODVA.
    pub vendor: u16,
    /// Device type, such as [`DEVICE_TYPE_CIP_MOTION_DRIVE`].
    pub device_type: u16,
    /// Product code within the vendor.
    pub product_code: u16,
    /// Major revision, 1..=127.
    pub major: u8,
    /// Minor revision, 1..=255.
    pub minor: u8,
    /// Serial number, unique within the vendor.
    pub serial_number: u32,
    /// Product name, ASCII.
    pub product_name: ArrayString<PRODUCT_NAME_MAX>,
    /// Differs between two configurations of the application, for the Configuration Consistency Value (attribute 9);
    /// what is set over the network comes on top of it.
    pub configuration: u16,
}

impl IdentityConfig {
    /// Checks an electronic key against this device. Zeros in the key match anything. Without the
    /// compatibility bit major and minor revision must be equal; with it the major revision must be equal and
    /// the minor one not newer than this device's.
    ///
    /// # Errors
    /// What does not fit.
    pub fn check_key(&self, key: &ElectronicKey) -> Result<(), KeyMismatch> {
        let differs = |wanted: u16, have: u16| wanted != 0 && wanted != have;
        if differs(key.vendor, self.vendor) || differs(key.product_code, self.product_code) {
            return Err(KeyMismatch::VendorOrProduct);
        }
        if differs(key.device_type, self.device_type) {
            return Err(KeyMismatch::DeviceType);
        }
        let major_differs = key.major != 0 && key.major != self.major;
        let minor_differs =
            key.minor != 0 && if key.compatible { key.minor > self.minor } else { key.minor != self.minor };
        // With the major revision left open the minor one says nothing.
        if major_differs || (key.major != 0 && minor_differs) {
            return Err(KeyMismatch::Revision);
        }
        Ok(())
    }
}

/// Which part of an electronic key does not fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeyMismatch {
    /// Vendor ID or product code.
    VendorOrProduct,
    /// Device type.
    DeviceType,
    /// Revision.
    Revision,
}

/// The IP interface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InterfaceConfig {
    /// Address of the interface.
    pub address: Ipv4Addr,
    /// Its subnet mask.
    pub netmask: Ipv4Addr,
    /// Default gateway, 0.0.0.0 without one.
    pub gateway: Ipv4Addr,
    /// Name servers, 0.0.0.0 where there is none.
    pub name_servers: [Ipv4Addr; 2],
    /// Domain name.
    pub domain_name: ArrayString<48>,
    /// Host name.
    pub host_name: ArrayString<64>,
    /// TCP and UDP port of explicit messages, told in ListIdentity; normally 44818.
    pub explicit_port: u16,
    /// UDP port controller-to-device datagrams are taken at; with another one than 2222 the Forward_Open
    /// reply says so in a socket address item.
    pub io_port: u16,
    /// Silence in seconds after which a session is closed; 0 never closes one (attribute 13).
    pub inactivity_timeout_s: u16,
}

impl InterfaceConfig {
    /// An interface with this address and mask, everything else at its default.
    pub fn new(address: Ipv4Addr, netmask: Ipv4Addr) -> Self {
        Self {
            address,
            netmask,
            gateway: Ipv4Addr::UNSPECIFIED,
            name_servers: [Ipv4Addr::UNSPECIFIED; 2],
            domain_name: ArrayString::new(),
            host_name: ArrayString::new(),
            explicit_port: EXPLICIT_PORT,
            io_port: IO_PORT,
            inactivity_timeout_s: 120,
        }
    }
}

/// The Ethernet port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LinkConfig {
    /// MAC address.
    pub mac: [u8; 6],
    /// Name of the port.
    pub label: ArrayString<64>,
    /// Kind of port.
    pub interface_type: InterfaceType,
    /// How the port is at the start; [`crate::device::explicit::adapter::Adapter::set_link`] tells of it later.
    pub state: LinkState,
}

/// DSCP values of the QoS object, each 0..=63. Set services change them; they are used from the next start
/// on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QosConfig {
    /// PTP event messages.
    pub ptp_event: u8,
    /// PTP general messages.
    pub ptp_general: u8,
    /// Urgent priority: CIP Motion.
    pub urgent: u8,
    /// Scheduled priority.
    pub scheduled: u8,
    /// High priority.
    pub high: u8,
    /// Low priority.
    pub low: u8,
    /// Explicit messages.
    pub explicit: u8,
}

impl Default for QosConfig {
    fn default() -> Self {
        Self { ptp_event: 59, ptp_general: 47, urgent: 55, scheduled: 47, high: 43, low: 31, explicit: 27 }
    }
}

/// What a motion connection may look like (Volume 9 clause 7-1.1).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MotionConfig {
    /// Format of the connection data that the device accepts. The connection point is the same for both (it is the
    /// Format Revision), so in the Forward_Open the size type distinguishes them: fixed size for the fixed format,
    /// variable size for the variable one.
    pub format: Format,
    /// Shortest packet interval in microseconds.
    pub rpi_min_us: u32,
    /// Longest packet interval in microseconds.
    pub rpi_max_us: u32,
    /// Packet intervals must be a multiple of this, in microseconds; at least 1.
    pub rpi_multiple_us: u32,
    /// Largest controller-to-device connection in bytes, [`MOTION_SIZE_MIN`]..=[`MOTION_SIZE_MAX`]. In the fixed format
    /// this and the next do not count: the size is [`MOTION_SIZE_FIXED`].
    pub o_to_t_size_max: u16,
    /// Largest device-to-controller connection in bytes, [`MOTION_SIZE_MIN`]..=[`MOTION_SIZE_MAX`].
    pub t_to_o_size_max: u16,
    /// Drive Power Structure Class ID attribute.
    pub power_structure_class_id: u32,
    /// Drive Power Structure Axis ID attribute of each axis instance, in the order of instances.
    pub power_structure_axis_ids: ArrayVec<u32, AXES_MAX>,
}

impl MotionConfig {
    /// Whether the size of the data varies, in both directions.
    pub fn is_variable(&self) -> bool {
        self.format == Format::Variable
    }

    /// Least and greatest size of a direction in bytes, of which the variable format may have up to `max`.
    pub fn sizes(&self, max: u16) -> (u16, u16) {
        match self.format {
            Format::Variable => (MOTION_SIZE_MIN, max),
            Format::Fixed => (MOTION_SIZE_FIXED, MOTION_SIZE_FIXED),
        }
    }

    /// The acceptable packet interval nearest to the wanted one that is not shorter, or the longest there is.
    pub fn acceptable_rpi_us(&self, wanted_us: u32) -> u32 {
        let multiple = self.rpi_multiple_us.max(1);
        let longest = self.rpi_max_us / multiple * multiple;
        let wanted = wanted_us.max(self.rpi_min_us);
        wanted.checked_next_multiple_of(multiple).map_or(longest, |rpi| rpi.min(longest))
    }
}

/// Why a configuration cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConfigError {
    /// The value.
    pub what: &'static str,
    /// What it is.
    pub found: u64,
    /// Lowest permitted value.
    pub min: u64,
    /// Highest permitted value.
    pub max: u64,
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: expected {}..={}, found {}", self.what, self.min, self.max, self.found)
    }
}

impl std::error::Error for ConfigError {}

impl AdapterConfig {
    /// Checks every range.
    ///
    /// # Errors
    /// The first value outside its range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let range = |what, found: u64, min: u64, max: u64| {
            if (min..=max).contains(&found) { Ok(()) } else { Err(ConfigError { what, found, min, max }) }
        };
        let motion = &self.motion;
        range("major revision", u64::from(self.identity.major), 1, 127)?;
        range("minor revision", u64::from(self.identity.minor), 1, 255)?;
        for size in [motion.o_to_t_size_max, motion.t_to_o_size_max] {
            let (min, max) = (u64::from(MOTION_SIZE_MIN), u64::from(MOTION_SIZE_MAX));
            range("motion connection size", u64::from(size), min, max)?;
        }
        range("packet interval multiple", u64::from(motion.rpi_multiple_us), 1, u64::from(u32::MAX))?;
        range("shortest packet interval", u64::from(motion.rpi_min_us), 1, u64::from(motion.rpi_max_us))?;
        let longest = u64::from(motion.acceptable_rpi_us(u32::MAX));
        range("longest packet interval", longest, u64::from(motion.rpi_min_us), u64::from(u32::MAX))?;
        let qos = &self.qos;
        for value in
            [qos.ptp_event, qos.ptp_general, qos.urgent, qos.scheduled, qos.high, qos.low, qos.explicit]
        {
            range("DSCP value", u64::from(value), 0, u64::from(DSCP_MAX))?;
        }
        range("length of the electronic data sheet", self.eds.len() as u64, 0, EDS_LEN_MAX as u64)?;
        let inactivity = u64::from(self.interface.inactivity_timeout_s);
        range("inactivity time-out", inactivity, 0, u64::from(INACTIVITY_TIMEOUT_MAX_S))?;
        range("I/O port", u64::from(self.interface.io_port), 1, 65535)?;
        range("explicit port", u64::from(self.interface.explicit_port), 1, 65535)
    }
}

const _: () = assert!(MOTION_SIZE_MIN as usize == SEQUENCE_COUNT_LEN + 8);
const _: () = assert!(MOTION_SIZE_FIXED as usize == SEQUENCE_COUNT_LEN + fixed::LEN);

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A device with two axes, as the tests of this folder use it.
    pub fn device() -> AdapterConfig {
        AdapterConfig {
            identity: IdentityConfig {
                vendor: 0x1234,
                device_type: DEVICE_TYPE_CIP_MOTION_DRIVE,
                product_code: 7,
                major: 2,
                minor: 3,
                serial_number: 0xDEAD_BEEF,
                product_name: ArrayString::from("Axisbridge").unwrap(),
                configuration: 0,
            },
            interface: InterfaceConfig {
                gateway: Ipv4Addr::new(10, 0, 0, 1),
                domain_name: ArrayString::from("plant").unwrap(),
                host_name: ArrayString::from("axis-1").unwrap(),
                ..InterfaceConfig::new(Ipv4Addr::new(10, 0, 0, 9), Ipv4Addr::new(255, 255, 255, 0))
            },
            link: LinkConfig {
                mac: [2, 0, 0, 0, 0, 9],
                label: ArrayString::from("north").unwrap(),
                interface_type: InterfaceType::TwistedPair,
                state: LinkState {
                    up: true,
                    enabled: true,
                    speed_mbit: 100,
                    full_duplex: true,
                    ..LinkState::default()
                },
            },
            qos: QosConfig::default(),
            motion: MotionConfig {
                format: Format::Variable,
                rpi_min_us: 1000,
                rpi_max_us: 32_000,
                rpi_multiple_us: 500,
                o_to_t_size_max: 500,
                t_to_o_size_max: 600,
                power_structure_class_id: 0x0A0B_0C0D,
                power_structure_axis_ids: ArrayVec::from_iter([0x11, 0x22]),
            },
            assembly: None,
            controllers: Hosts::EVERYBODY,
            eds: Arc::new([]),
            incarnation: 0x7A00,
        }
    }

    #[test]
    fn ranges_are_checked() {
        assert_eq!(device().validate(), Ok(()));
        let mut config = device();
        config.motion.o_to_t_size_max = 9;
        assert_eq!(
            config.validate().map_err(|e| e.to_string()),
            Err("motion connection size: expected 10..=1454, found 9".to_owned())
        );
        let mut config = device();
        config.motion.rpi_multiple_us = 40_000;
        assert_eq!(
            config.validate(),
            Err(ConfigError {
                what: "longest packet interval",
                found: 0,
                min: 1000,
                max: u64::from(u32::MAX)
            })
        );
        let mut config = device();
        config.qos.high = 64;
        assert_eq!(config.validate(), Err(ConfigError { what: "DSCP value", found: 64, min: 0, max: 63 }));
    }

    #[test]
    fn acceptable_intervals_are_multiples_not_shorter_than_wanted() {
        let motion = device().motion;
        for (wanted, acceptable) in [
            (0, 1000),
            (1000, 1000),
            (1001, 1500),
            (1500, 1500),
            (32_000, 32_000),
            (32_001, 32_000),
            (u32::MAX, 32_000),
        ] {
            assert_eq!(motion.acceptable_rpi_us(wanted), acceptable, "{wanted}");
        }
    }

    #[test]
    fn electronic_keys() {
        let identity = device().identity;
        let exact = ElectronicKey {
            vendor: 0x1234,
            device_type: 0x25,
            product_code: 7,
            compatible: false,
            major: 2,
            minor: 3,
        };
        let compatible = ElectronicKey { compatible: true, ..exact };
        for (key, outcome) in [
            (ElectronicKey::default(), Ok(())),
            (exact, Ok(())),
            (compatible, Ok(())),
            (ElectronicKey { minor: 2, ..compatible }, Ok(())),
            (ElectronicKey { minor: 0, ..exact }, Ok(())),
            (ElectronicKey { major: 0, minor: 99, ..exact }, Ok(())),
            (ElectronicKey { minor: 2, ..exact }, Err(KeyMismatch::Revision)),
            (ElectronicKey { minor: 4, ..compatible }, Err(KeyMismatch::Revision)),
            (ElectronicKey { major: 1, ..compatible }, Err(KeyMismatch::Revision)),
            (ElectronicKey { major: 3, ..exact }, Err(KeyMismatch::Revision)),
            (ElectronicKey { vendor: 1, ..exact }, Err(KeyMismatch::VendorOrProduct)),
            (ElectronicKey { product_code: 8, ..exact }, Err(KeyMismatch::VendorOrProduct)),
            (ElectronicKey { device_type: 0x0C, ..exact }, Err(KeyMismatch::DeviceType)),
        ] {
            assert_eq!(identity.check_key(&key), outcome, "{key:?}");
        }
    }
}
