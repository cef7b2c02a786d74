//! The objects of the Ethernet port: TCP/IP Interface (0xF5), Ethernet Link (0xF6) and QoS (0x48).

use core::net::Ipv4Addr;

use super::config::{InterfaceConfig, LinkConfig, QosConfig};
use super::identity::short_string;
use super::object::Object;
use crate::wire::status::GeneralStatus;

/// Class code of the QoS object.
pub const CLASS_QOS: u16 = 0x48;
/// Class code of the TCP/IP Interface object.
pub const CLASS_TCP_IP: u16 = 0xF5;
/// Class code of the Ethernet Link object.
pub const CLASS_ETHERNET_LINK: u16 = 0xF6;

/// Longest session inactivity time-out in seconds (attribute 13).
pub const INACTIVITY_TIMEOUT_MAX_S: u16 = 3600;

pub(super) struct TcpIp<'a>(pub &'a mut InterfaceConfig);

impl Object for TcpIp<'_> {
    const REVISION: u16 = 4;
    const ALL: &'static [u16] = &[1, 2, 3, 4, 5, 6];
    const ATTRIBUTE_MAX: u16 = 13;

    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        let c = &*self.0;
        match attribute {
            // Status: the interface configuration is valid.
            1 => out.extend(1u32.to_le_bytes()),
            // Capability: nothing is set over the network, so there is neither BOOTP nor DHCP to choose.
            // Control: the configuration is the stored one.
            2 | 3 => out.extend(0u32.to_le_bytes()),
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
            13 => out.extend(c.inactivity_timeout_s.to_le_bytes()),
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
        Ok(())
    }

    fn settable_len(&self, attribute: u16) -> Result<usize, GeneralStatus> {
        if attribute == 13 {
            return Ok(2);
        }
        self.get(attribute, &mut Vec::new())?;
        Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE)
    }

    fn set(&mut self, _attribute: u16, value: &[u8]) -> Result<(), GeneralStatus> {
        let value = value.try_into().map_err(|_| GeneralStatus::NOT_ENOUGH_DATA)?;
        let seconds = u16::from_le_bytes(value);
        if seconds > INACTIVITY_TIMEOUT_MAX_S {
            return Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE);
        }
        self.0.inactivity_timeout_s = seconds;
        Ok(())
    }
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

pub(super) struct EthernetLink<'a>(pub &'a LinkConfig);

impl Object for EthernetLink<'_> {
    const REVISION: u16 = 4;
    const ALL: &'static [u16] = &[1, 2, 3];
    const ATTRIBUTE_MAX: u16 = 10;

    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        let c = self.0;
        match attribute {
            1 => out.extend(c.speed_mbit.to_le_bytes()),
            2 => {
                // Bit 0 link, bit 1 full duplex, bits 4..2 negotiation: 3 done, 4 not attempted.
                let link = c.speed_mbit != 0;
                let negotiation: u32 = if link { 3 } else { 4 };
                let flags = u32::from(link) | u32::from(c.full_duplex) << 1 | negotiation << 2;
                out.extend(flags.to_le_bytes());
            }
            3 => out.extend(c.mac),
            // Interface type: twisted pair.
            7 => out.push(2),
            // Interface state: 1 enabled, 2 disabled; it cannot be disabled here.
            8 => out.push(1),
            10 => short_string(&c.label, out),
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
        Ok(())
    }
}

pub(super) struct Qos<'a>(pub &'a mut QosConfig);

impl Qos<'_> {
    fn slot(&mut self, attribute: u16) -> Option<&mut u8> {
        let c = &mut *self.0;
        Some(match attribute {
            2 => &mut c.ptp_event,
            3 => &mut c.ptp_general,
            4 => &mut c.urgent,
            5 => &mut c.scheduled,
            6 => &mut c.high,
            7 => &mut c.low,
            8 => &mut c.explicit,
            _ => return None,
        })
    }
}

impl Object for Qos<'_> {
    const REVISION: u16 = 1;
    const ALL: &'static [u16] = &[];
    const ATTRIBUTE_MAX: u16 = 8;

    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        let c = &*self.0;
        out.push(match attribute {
            // 802.1Q tagging is off: priority travels in the DSCP values.
            1 => 0,
            2 => c.ptp_event,
            3 => c.ptp_general,
            4 => c.urgent,
            5 => c.scheduled,
            6 => c.high,
            7 => c.low,
            8 => c.explicit,
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        });
        Ok(())
    }

    fn settable_len(&self, attribute: u16) -> Result<usize, GeneralStatus> {
        match attribute {
            2..=8 => Ok(1),
            1 => Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE),
            _ => Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
    }

    fn set(&mut self, attribute: u16, value: &[u8]) -> Result<(), GeneralStatus> {
        let (Some(slot), [dscp]) = (self.slot(attribute), value) else {
            return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED);
        };
        if *dscp > 63 {
            return Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE);
        }
        *slot = *dscp;
        Ok(())
    }
}
