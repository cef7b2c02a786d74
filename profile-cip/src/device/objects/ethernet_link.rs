//! The Ethernet Link object (class 0xF6): the port as the host sees it.
//!
//! What the host does not report is not made up: without counters attributes 4 and 5 are not there.

use super::identity::short_string;
use super::object::{Answer, Object};
use crate::device::config::LinkConfig;
pub use crate::device::port::{InterfaceCounters, InterfaceType, LinkState, MediaCounters};
use crate::wire::status::{GeneralStatus, Service};

/// Class code of the Ethernet Link object.
pub const CLASS_ETHERNET_LINK: u16 = 0xF6;

/// Reads a counter attribute and starts its counters from zero.
pub const GET_AND_CLEAR: Service = Service(0x4C);

/// Interface flags (attribute 2): the link is up.
const FLAG_LINK: u32 = 1;
/// Interface flags: full duplex.
const FLAG_FULL_DUPLEX: u32 = 2;
/// Interface flags, bits 4..2: speed and duplex were negotiated.
const NEGOTIATED: u32 = 3 << 2;
/// Interface flags, bits 4..2: no negotiation has been tried.
const NOT_NEGOTIATED: u32 = 4 << 2;
/// Interface control (attribute 6): negotiation, and no forced speed. The host decides, so it is not settable.
const CONTROL_NEGOTIATE: [u8; 4] = [1, 0, 0, 0];
/// Interface capability (attribute 11): negotiation; the array of forced speeds behind it is empty.
const CAPABILITY: [u8; 5] = [2, 0, 0, 0, 0];

impl InterfaceCounters {
    /// In the order of the attribute.
    const fn row(&self) -> [u64; 11] {
        [
            self.in_octets,
            self.in_unicast,
            self.in_multicast,
            self.in_discards,
            self.in_errors,
            self.in_unknown_protocols,
            self.out_octets,
            self.out_unicast,
            self.out_multicast,
            self.out_discards,
            self.out_errors,
        ]
    }
}

impl MediaCounters {
    /// In the order of the attribute.
    const fn row(&self) -> [u64; 12] {
        [
            self.alignment_errors,
            self.fcs_errors,
            self.single_collisions,
            self.multiple_collisions,
            self.sqe_test_errors,
            self.deferred,
            self.late_collisions,
            self.excessive_collisions,
            self.mac_transmit_errors,
            self.carrier_sense_errors,
            self.frames_too_long,
            self.mac_receive_errors,
        ]
    }
}

/// Where the counters stood when they were cleared over the network. The host's own go on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Cleared {
    interface: InterfaceCounters,
    media: MediaCounters,
}

pub(crate) struct EthernetLink<'a> {
    pub config: &'a LinkConfig,
    pub cleared: &'a mut Cleared,
}

impl EthernetLink<'_> {
    /// Get_and_Clear: the value of a counter attribute, which then starts from zero.
    pub fn get_and_clear(&mut self, attribute: Option<u16>, data: &[u8]) -> Answer {
        let Some(attribute) = attribute else { return Answer::status(GeneralStatus::PATH_SEGMENT_ERROR) };
        if !data.is_empty() {
            return Answer::status(GeneralStatus::TOO_MUCH_DATA);
        }
        let mut value = Vec::new();
        if let Err(status) = self.get(attribute, &mut value) {
            return Answer::status(status);
        }
        let state = &self.config.state;
        match attribute {
            4 => self.cleared.interface = state.counters.unwrap_or_default(),
            5 => self.cleared.media = state.media.unwrap_or_default(),
            _ => return Answer::status(GeneralStatus::SERVICE_NOT_SUPPORTED),
        }
        Answer::done(value)
    }
}

impl Object for EthernetLink<'_> {
    const REVISION: u16 = 4;
    const ALL: &'static [u16] = &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];
    const ATTRIBUTE_MAX: u16 = 11;

    // Flat: one arm per attribute.
    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        let c = self.config;
        let state = &c.state;
        match attribute {
            1 => out.extend(state.speed_mbit.to_le_bytes()),
            2 => {
                let link = if state.up { FLAG_LINK | NEGOTIATED } else { NOT_NEGOTIATED };
                let duplex = if state.full_duplex { FLAG_FULL_DUPLEX } else { 0 };
                out.extend((link | duplex).to_le_bytes());
            }
            3 => out.extend(c.mac),
            4 => {
                let counters = state.counters.ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)?;
                udints(counters.row(), self.cleared.interface.row(), out);
            }
            5 => {
                let media = state.media.ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)?;
                udints(media.row(), self.cleared.media.row(), out);
            }
            6 => out.extend(CONTROL_NEGOTIATE),
            7 => out.push(match c.interface_type {
                InterfaceType::Unknown => 0,
                InterfaceType::Internal => 1,
                InterfaceType::TwistedPair => 2,
                InterfaceType::OpticalFiber => 3,
            }),
            // Interface state and administrative state: 1 enabled, 2 disabled.
            8 => out.push(if state.up { 1 } else { 2 }),
            9 => out.push(if state.enabled { 1 } else { 2 }),
            10 => short_string(&c.label, out),
            11 => out.extend(CAPABILITY),
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
        Ok(())
    }

    fn absent(&self, attribute: u16, out: &mut Vec<u8>) {
        match attribute {
            4 => udints([0; 11], [0; 11], out),
            5 => udints([0; 12], [0; 12], out),
            _ => {}
        }
    }
}

/// Appends counters less what they were, as UDINTs that start over.
fn udints<const N: usize>(now: [u64; N], then: [u64; N], out: &mut Vec<u8>) {
    for (now, then) in now.into_iter().zip(then) {
        let [a, b, c, d, ..] = now.wrapping_sub(then).to_le_bytes();
        out.extend([a, b, c, d]);
    }
}
