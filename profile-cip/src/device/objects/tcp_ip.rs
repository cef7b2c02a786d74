//! The TCP/IP Interface object (class 0xF5).
//!
//! The address belongs to the host, which gives it to the device by the configuration of the box. Over the network it is
//! read and never set; the one value that is set is the inactivity time-out of sessions.

use core::net::Ipv4Addr;

use super::object::Object;
pub use crate::device::config::INACTIVITY_TIMEOUT_MAX_S;
use crate::device::config::InterfaceConfig;
use crate::wire::status::GeneralStatus;

/// Class code of the TCP/IP Interface object.
pub const CLASS_TCP_IP: u16 = 0xF5;

/// Status (attribute 1): the configuration is valid and was stored, in bits 3..0. No address conflict detection runs in
/// the device, and nothing is pending.
const STATUS_STORED: u32 = 1;
/// Configuration capability (attribute 2): no BOOTP, DNS or DHCP client, nothing to be set, no conflict detection.
const CAPABILITY: u32 = 0;
/// Configuration control (attribute 3): the stored configuration is used. The only value there is.
const CONTROL_STORED: u32 = 0;
/// Multicast groups are allocated by the default algorithm (attribute 9).
const ALLOCATE_BY_DEFAULT: u8 = 0;
/// Bytes of the Last Conflict Detected structure (attribute 11): activity, MAC address, ARP packet.
const LAST_CONFLICT_LEN: usize = 1 + 6 + 28;
/// Bytes of a safety network number (attribute 7).
const SAFETY_NETWORK_NUMBER_LEN: usize = 6;

pub(crate) struct TcpIp<'a>(pub &'a mut InterfaceConfig);

impl Object for TcpIp<'_> {
    const REVISION: u16 = 4;
    const ALL: &'static [u16] = &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13];
    const ATTRIBUTE_MAX: u16 = 13;

    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        let c = &*self.0;
        match attribute {
            1 => out.extend(STATUS_STORED.to_le_bytes()),
            2 => out.extend(CAPABILITY.to_le_bytes()),
            3 => out.extend(CONTROL_STORED.to_le_bytes()),
            // Physical link: path to the Ethernet Link object.
            4 => out.extend([2, 0, 0x20, 0xF6, 0x24, 0x01]),
            5 => {
                let [first, second] = c.name_servers;
                for address in [c.address, c.netmask, c.gateway, first, second] {
                    udint(address, out);
                }
                string(&c.domain_name, out);
            }
            6 => string(&c.host_name, out),
            // Time to live of multicasts.
            8 => out.push(1),
            9 => {
                out.extend([ALLOCATE_BY_DEFAULT, 0]);
                out.extend(1u16.to_le_bytes());
                udint(default_group(c.address, c.netmask), out);
            }
            // Select ACD: the device runs no address conflict detection, so it has seen no conflict either.
            10 => out.push(0),
            11 => out.extend([0; LAST_CONFLICT_LEN]),
            13 => out.extend(c.inactivity_timeout_s.to_le_bytes()),
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
        Ok(())
    }

    fn absent(&self, attribute: u16, out: &mut Vec<u8>) {
        match attribute {
            7 => out.extend([0; SAFETY_NETWORK_NUMBER_LEN]),
            // Quick connect, off.
            12 => out.push(0),
            _ => {}
        }
    }

    fn settable_len(&self, attribute: u16) -> Result<usize, GeneralStatus> {
        match attribute {
            3 => Ok(4),
            10 => Ok(1),
            13 => Ok(2),
            _ => {
                self.get(attribute, &mut Vec::new())?;
                Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE)
            }
        }
    }

    fn set(&mut self, attribute: u16, value: &[u8]) -> Result<(), GeneralStatus> {
        match (attribute, value) {
            // There is one way to be configured and one state of the detection; to ask for those is no error.
            (3, [0, 0, 0, 0]) | (10, [0]) => Ok(()),
            (13, [low, high]) => {
                let seconds = u16::from_le_bytes([*low, *high]);
                if seconds > INACTIVITY_TIMEOUT_MAX_S {
                    return Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE);
                }
                self.0.inactivity_timeout_s = seconds;
                Ok(())
            }
            (3 | 10, _) => Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE),
            _ => Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE),
        }
    }
}

/// First multicast group of a device by the default algorithm: 32 groups for each host number, counted from 1 and taken
/// modulo 1024, from 239.192.1.0 on.
pub(crate) fn default_group(address: Ipv4Addr, netmask: Ipv4Addr) -> Ipv4Addr {
    let host = (address.to_bits() & !netmask.to_bits()).wrapping_sub(1) & 0x3FF;
    Ipv4Addr::from_bits(Ipv4Addr::new(239, 192, 1, 0).to_bits() + (host << 5))
}

/// Appends an address as the UDINT it is on the wire: 10.0.0.9 is 0x0A000009, low byte first.
fn udint(address: Ipv4Addr, out: &mut Vec<u8>) {
    out.extend(u32::from(address).to_le_bytes());
}

/// Appends a STRING: 16-bit length, text, and a zero byte behind an odd text.
fn string(text: &str, out: &mut Vec<u8>) {
    let length = u16::try_from(text.len()).unwrap_or(u16::MAX);
    out.extend(length.to_le_bytes());
    out.extend(text.as_bytes().iter().take(usize::from(length)));
    if length % 2 != 0 {
        out.push(0);
    }
}
