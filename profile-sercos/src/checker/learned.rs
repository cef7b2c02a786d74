//! What went over a service channel: the operation data that a slave was told, or has told.

use std::collections::{BTreeMap, BTreeSet};

use crate::generated::idns::connection;
use crate::wire::data_status::{CommandState, DataStatus};
use crate::wire::idn::Idn;
use crate::wire::procedure::ProcedureControl;
use crate::wire::svc::{Element, LIST_HEAD_LEN, MdtSvc};

/// Operation data by IDN, as it was transferred: lists with their head.
#[derive(Debug, Default)]
pub(super) struct Learned {
    open: Option<Idn>,
    parts: Vec<u8>,
    values: BTreeMap<Idn, Vec<u8>>,
    /// S-0-0127 was executed and done: the slave takes part in CP3.
    pub checked: bool,
    /// S-0-0128 was executed and done.
    pub ready: bool,
}

impl Learned {
    /// Takes a step that the slave is through with, and its answer; `None` for an error.
    pub fn step(&mut self, step: MdtSvc, answer: Option<u32>) {
        let Some(answer) = answer else {
            self.parts.clear();
            return;
        };
        let (control, write) = (step.control, step.control.write());
        match control.element() {
            Element::Idn if write => {
                self.open = Some(Idn(step.info));
                self.parts.clear();
                let [low, high, ..] = answer.to_le_bytes();
                let status = DataStatus::from_bits_retain(u16::from_le_bytes([low, high]));
                let done = status.command_state() == CommandState::Done;
                self.checked |= done && Idn(step.info) == Idn::CP3_CHECK;
                self.ready |= done && Idn(step.info) == Idn::CP4_CHECK;
            }
            Element::Data => {
                let Some(idn) = self.open else { return };
                self.parts.extend(if write { step.info } else { answer }.to_le_bytes());
                if write && idn == Idn::CP3_CHECK && step.info == u32::from(ProcedureControl::EXECUTE.bits())
                {
                    self.checked = false;
                }
                if control.last() {
                    self.values.insert(idn, std::mem::take(&mut self.parts));
                }
            }
            _ => self.parts.clear(),
        }
    }

    #[cfg(test)]
    pub fn tell(&mut self, idn: Idn, bytes: &[u8]) {
        self.values.insert(idn, bytes.to_vec());
    }

    /// A value of up to four bytes.
    pub fn word(&self, idn: Idn) -> Option<u32> {
        self.values.get(&idn)?.first_chunk().map(|bytes| u32::from_le_bytes(*bytes))
    }

    /// A value of two bytes.
    pub fn half(&self, idn: Idn) -> Option<u16> {
        self.values.get(&idn)?.first_chunk().map(|bytes| u16::from_le_bytes(*bytes))
    }

    /// The items of a list.
    pub fn list(&self, idn: Idn) -> Option<&[u8]> {
        self.values.get(&idn)?.get(LIST_HEAD_LEN..)
    }

    /// The numbers of the connections that were set up (element 1) or given a place (element 3).
    pub fn connections(&self) -> BTreeSet<u8> {
        let told = self.values.keys().filter(|idn| {
            idn.block() == Idn::CONNECTION_BLOCK
                && !idn.is_product()
                && matches!(idn.element(), connection::SETUP | connection::ASSIGNMENT)
        });
        told.map(|idn| idn.instance()).collect()
    }
}
