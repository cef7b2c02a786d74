//! The objects that every slave has: Identity, Message Router, DeviceNet, Connection.

use super::super::wire::{AllocationChoice, MacId};
use super::SlaveConfig;
use crate::device::objects::class::CLASS_MESSAGE_ROUTER;
use crate::device::objects::identity::CLASS_IDENTITY;
use crate::device::objects::object::Object;
use crate::wire::status::GeneralStatus;

/// Classes of this module.
pub(super) const CLASSES: [u16; 4] = [CLASS_IDENTITY, CLASS_MESSAGE_ROUTER, 3, 5];

/// MAC ID of the master in the allocation information of a slave that nobody has.
const UNALLOCATED: u8 = 0xFF;

/// The Message Router (class 2): which classes there are.
pub(super) struct Router<'a> {
    /// Classes of the application.
    pub classes: &'a [u16],
    /// Connections that exist.
    pub active: u16,
}

impl Object for Router<'_> {
    const REVISION: u16 = 1;
    const ALL: &'static [u16] = &[1, 2, 3];
    const ATTRIBUTE_MAX: u16 = 3;

    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        match attribute {
            1 => {
                let classes = CLASSES.iter().chain(self.classes);
                out.extend(u16::try_from(classes.clone().count()).unwrap_or(0).to_le_bytes());
                out.extend(classes.flat_map(|class| class.to_le_bytes()));
            }
            2 => out.extend(4_u16.to_le_bytes()),
            3 => out.extend(self.active.to_le_bytes()),
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
        Ok(())
    }
}

/// The DeviceNet object (class 3).
pub(super) struct DeviceNetObject<'a> {
    pub config: &'a mut SlaveConfig,
    pub bus_offs: &'a mut u8,
    pub held: AllocationChoice,
    pub master: Option<MacId>,
    /// An I/O connection is established.
    pub io_established: bool,
}

impl Object for DeviceNetObject<'_> {
    const REVISION: u16 = 2;
    const ALL: &'static [u16] = &[];
    const ATTRIBUTE_MAX: u16 = 5;

    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        match attribute {
            1 => out.push(self.config.mac.get()),
            2 => out.push(self.config.rate),
            3 => out.push(u8::from(self.config.bus_off_reset)),
            4 => out.push(*self.bus_offs),
            5 => out.extend([self.held.bits(), self.master.map_or(UNALLOCATED, MacId::get)]),
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
        Ok(())
    }

    fn settable_len(&self, attribute: u16) -> Result<usize, GeneralStatus> {
        match attribute {
            1..=4 => Ok(1),
            5 => Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE),
            _ => Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
    }

    fn set(&mut self, attribute: u16, value: &[u8]) -> Result<(), GeneralStatus> {
        let value = value.first().copied().unwrap_or(0);
        let within = |max: u8| {
            if value <= max { Ok(value) } else { Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE) }
        };
        match attribute {
            // The node goes off the network with it, so no motion may hang on a connection.
            1 if self.io_established => return Err(GeneralStatus::OBJECT_STATE_CONFLICT),
            1 => self.config.mac = MacId::new(value).ok_or(GeneralStatus::INVALID_ATTRIBUTE_VALUE)?,
            2 => self.config.rate = within(2)?,
            3 => self.config.bus_off_reset = within(1)? == 1,
            // Whatever is written, the counter begins anew.
            _ => *self.bus_offs = 0,
        }
        Ok(())
    }
}
