//! The QoS object (class 0x48): the code points that mark what the device sends (Volume 9 clause 9-2).
//!
//! A value that is set is stored at once and used after the next start.

use super::object::Object;
pub use crate::device::config::DSCP_MAX;
use crate::device::config::QosConfig;
use crate::wire::network_parameters::Priority;
use crate::wire::status::GeneralStatus;

/// Class code of the QoS object.
pub const CLASS_QOS: u16 = 0x48;

impl QosConfig {
    /// Code point of the datagrams of a connection with this priority.
    pub const fn of_priority(&self, priority: Priority) -> u8 {
        match priority {
            Priority::URGENT => self.urgent,
            Priority::SCHEDULED => self.scheduled,
            Priority::HIGH => self.high,
            _ => self.low,
        }
    }

    fn slot(&mut self, attribute: u16) -> Option<&mut u8> {
        Some(match attribute {
            2 => &mut self.ptp_event,
            3 => &mut self.ptp_general,
            4 => &mut self.urgent,
            5 => &mut self.scheduled,
            6 => &mut self.high,
            7 => &mut self.low,
            8 => &mut self.explicit,
            _ => return None,
        })
    }
}

pub(crate) struct Qos<'a>(pub &'a mut QosConfig);

impl Object for Qos<'_> {
    const REVISION: u16 = 1;
    const ALL: &'static [u16] = &[];
    const ATTRIBUTE_MAX: u16 = 8;

    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        let mut values = *self.0;
        out.push(match attribute {
            // 802.1Q tagging is off: priority travels in the code points.
            1 => 0,
            _ => *values.slot(attribute).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)?,
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
        let (Some(slot), [dscp]) = (self.0.slot(attribute), value) else {
            return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED);
        };
        if *dscp > DSCP_MAX {
            return Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE);
        }
        *slot = *dscp;
        Ok(())
    }
}
