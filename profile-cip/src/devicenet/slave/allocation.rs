//! Who may take which connections: the decisions of the DeviceNet object on Allocate and Release, without carrying them out.
//!
//! | refusal | general status | additional code |
//! |---|---|---|
//! | another master has the slave, or has not | 0C object state conflict | 01 |
//! | nothing is asked for, a reserved bit, both kinds of instance 4, acknowledge suppression without either, a first allocation without the explicit connection | 09 invalid attribute value | 02 |
//! | a connection that the slave has not | 02 resource unavailable | 02 |
//! | a connection that is in use, or with Release none that is | 0B already in state | 02 |
//! | another service on the unconnected port | 08 service not supported | 03 |
//!
//! The additional codes are those of the DeviceNet object; which general status goes with which is as implementations in the
//! field have it.

use super::super::wire::explicit::NO_ADDITIONAL_CODE;
use super::super::wire::{Allocate, AllocationChoice, MacId};
use super::application::ServiceError;
use crate::wire::Error;
use crate::wire::status::GeneralStatus;
use crate::wire::status::length_status;

/// Additional code: allocation conflict.
pub const ALLOCATION_CONFLICT: u8 = 0x01;
/// Additional code: invalid allocation or release choice.
pub const INVALID_CHOICE: u8 = 0x02;
/// Additional code: neither Allocate nor Release on the unconnected port of a group 2 only server.
pub const NOT_ON_UNCONNECTED_PORT: u8 = 0x03;

/// What is allocated, and what could be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Allocation {
    /// The master, if the slave is allocated.
    pub master: Option<MacId>,
    /// Connections that exist.
    pub held: AllocationChoice,
    /// Connections that the slave can have.
    pub supported: AllocationChoice,
}

const fn refuse<T>(status: GeneralStatus, additional: u8) -> Result<T, ServiceError> {
    Err(ServiceError { status, additional })
}

fn data_error(error: Error) -> ServiceError {
    let status = length_status(&error).unwrap_or(GeneralStatus::INVALID_ATTRIBUTE_VALUE);
    ServiceError { status, additional: NO_ADDITIONAL_CODE }
}

impl Allocation {
    fn check_owner(&self, asker: MacId) -> Result<(), ServiceError> {
        match self.master {
            Some(master) if master != asker => {
                refuse(GeneralStatus::OBJECT_STATE_CONFLICT, ALLOCATION_CONFLICT)
            }
            _ => Ok(()),
        }
    }

    fn check_choice(&self, choice: AllocationChoice) -> Result<(), ServiceError> {
        let either = AllocationChoice::CHANGE_OF_STATE_OR_CYCLIC;
        let reserved = choice.bits() & 0x80 != 0;
        let connections = choice - AllocationChoice::ACKNOWLEDGE_SUPPRESSION;
        let suppressed = choice != connections && !choice.intersects(either);
        if connections.is_empty() || reserved || suppressed {
            return refuse(GeneralStatus::INVALID_ATTRIBUTE_VALUE, INVALID_CHOICE);
        }
        if !self.supported.contains(choice) {
            return refuse(GeneralStatus::RESOURCE_UNAVAILABLE, INVALID_CHOICE);
        }
        Ok(())
    }

    /// Judges an allocation that `asker` asks for with `data`.
    ///
    /// # Errors
    /// The refusal to answer with.
    pub fn check_allocate(&self, asker: MacId, data: &[u8]) -> Result<Allocate, ServiceError> {
        let request = Allocate::parse(data).map_err(data_error)?;
        if request.allocator != asker {
            return refuse(GeneralStatus::INVALID_ATTRIBUTE_VALUE, NO_ADDITIONAL_CODE);
        }
        self.check_owner(asker)?;
        let choice = request.choice;
        self.check_choice(choice)?;
        let either = AllocationChoice::CHANGE_OF_STATE_OR_CYCLIC;
        let explicit = AllocationChoice::EXPLICIT;
        if choice.contains(either) || !(choice | self.held).contains(explicit) {
            return refuse(GeneralStatus::INVALID_ATTRIBUTE_VALUE, INVALID_CHOICE);
        }
        let fourth = choice.intersects(either) && self.held.intersects(either);
        let connections = choice - AllocationChoice::ACKNOWLEDGE_SUPPRESSION;
        if fourth || self.held.intersects(connections) {
            return refuse(GeneralStatus::ALREADY_IN_STATE, INVALID_CHOICE);
        }
        Ok(request)
    }

    /// Judges a release that `asker` asks for with `data`; gives the connections that end.
    ///
    /// # Errors
    /// The refusal to answer with.
    pub fn check_release(&self, asker: MacId, data: &[u8]) -> Result<AllocationChoice, ServiceError> {
        let choice = match data {
            [choice] => AllocationChoice::from_bits_retain(*choice),
            [] => return Err(GeneralStatus::NOT_ENOUGH_DATA.into()),
            _ => return Err(GeneralStatus::TOO_MUCH_DATA.into()),
        };
        self.check_owner(asker)?;
        self.check_choice(choice)?;
        let held = self.held & (choice - AllocationChoice::ACKNOWLEDGE_SUPPRESSION);
        if held.is_empty() {
            return refuse(GeneralStatus::ALREADY_IN_STATE, INVALID_CHOICE);
        }
        Ok(held)
    }
}

#[cfg(test)]
mod tests {
    use core::fmt::Write as _;

    use super::*;

    fn mac(number: u8) -> MacId {
        MacId::new(number).unwrap()
    }

    fn outcome<T: core::fmt::Debug>(result: Result<T, ServiceError>, show: impl Fn(T) -> String) -> String {
        result.map_or_else(|error| format!("refused: {} / {:02x}", error.status, error.additional), show)
    }

    /// Every choice against a free slave, one with explicit and poll, and one of another master.
    #[test]
    fn every_choice() {
        let supported = AllocationChoice::EXPLICIT
            | AllocationChoice::POLL
            | AllocationChoice::CHANGE_OF_STATE_OR_CYCLIC
            | AllocationChoice::ACKNOWLEDGE_SUPPRESSION;
        let held = AllocationChoice::EXPLICIT | AllocationChoice::POLL;
        let free = Allocation { master: None, held: AllocationChoice::empty(), supported };
        let cases = [
            ("free", free),
            ("explicit and poll", Allocation { master: Some(mac(1)), held, supported }),
            ("of another", Allocation { master: Some(mac(2)), held, supported }),
        ];
        let mut text = String::new();
        for (name, allocation) in cases {
            writeln!(text, "{name}").unwrap();
            // Neighbours with the same outcome are one line.
            let mut last = (0_u8, String::new());
            for bits in 0..=255_u8 {
                let allocate =
                    outcome(allocation.check_allocate(mac(1), &[bits, 1]), |_| "allocated".to_owned());
                let release =
                    outcome(allocation.check_release(mac(1), &[bits]), |held| format!("releases {held}"));
                let line = format!("{allocate}; {release}");
                if bits > 0 && line != last.1 {
                    writeln!(text, "  {:02x} to {:02x}: {}", last.0, bits - 1, last.1).unwrap();
                    last.0 = bits;
                }
                last.1 = line;
            }
            writeln!(text, "  {:02x} to ff: {}", last.0, last.1).unwrap();
        }
        insta::assert_snapshot!(text);
    }

    #[test]
    fn wrong_data() {
        let allocation = Allocation {
            master: None,
            held: AllocationChoice::empty(),
            supported: AllocationChoice::EXPLICIT,
        };
        let allocate = |data: &[u8]| allocation.check_allocate(mac(1), data).map_err(|error| error.status);
        assert_eq!(allocate(&[1]).unwrap_err(), GeneralStatus::NOT_ENOUGH_DATA);
        assert_eq!(allocate(&[1, 1, 1]).unwrap_err(), GeneralStatus::TOO_MUCH_DATA);
        assert_eq!(allocate(&[1, 64]).unwrap_err(), GeneralStatus::INVALID_ATTRIBUTE_VALUE);
        assert_eq!(
            allocate(&[1, 2]).unwrap_err(),
            GeneralStatus::INVALID_ATTRIBUTE_VALUE,
            "for somebody else"
        );
        assert!(allocate(&[1, 1]).is_ok());
        let release = |data: &[u8]| allocation.check_release(mac(1), data).map_err(|error| error.status);
        assert_eq!(release(&[]).unwrap_err(), GeneralStatus::NOT_ENOUGH_DATA);
        assert_eq!(release(&[1, 1]).unwrap_err(), GeneralStatus::TOO_MUCH_DATA);
        assert_eq!(release(&[1]).unwrap_err(), GeneralStatus::ALREADY_IN_STATE);
    }
}
