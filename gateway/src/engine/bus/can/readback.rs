//! Reading the PDOs that a device has, where they are used as they are.

use std::collections::{BTreeMap, VecDeque};

use profile_cia402::sdo::request::{SdoFailure, SdoOutcome};
use profile_cia402::wire::pdo::{Direction, MAPPING_MAX, MappingEntry, SUB_COB_ID};
use profile_cia402::wire::{CobId, Mux};

use super::layout::{AxisPdos, FoundPdo, FoundPdos};

/// The reading: what is to be asked, what is under way, what came.
#[derive(Debug)]
pub struct Readback {
    pdos: AxisPdos,
    ask: VecDeque<Mux>,
    sent: VecDeque<Mux>,
    told: BTreeMap<Mux, u32>,
}

impl Readback {
    /// Of the PDOs that may belong to an axis.
    pub fn new(pdos: AxisPdos) -> Self {
        let objects = |number: u16| {
            Direction::BOTH
                .map(|way| [way.communication_object(number, SUB_COB_ID), way.mapping_object(number, 0)])
        };
        let ask = pdos.numbers().flat_map(objects).flatten().collect();
        Self { pdos, ask, sent: VecDeque::new(), told: BTreeMap::new() }
    }

    /// The next object to be read.
    pub fn next(&mut self) -> Option<Mux> {
        let object = self.ask.pop_front()?;
        self.sent.push_back(object);
        Some(object)
    }

    /// Requests under way.
    pub fn under_way(&self) -> usize {
        self.sent.len()
    }

    /// Takes the answer to the first request that is under way.
    ///
    /// # Errors
    /// The object that could not be read, for another reason than that the device does not have it.
    pub fn handle(&mut self, outcome: &SdoOutcome) -> Result<(), (Mux, SdoFailure)> {
        let Some(object) = self.sent.pop_front() else { return Ok(()) };
        match outcome.result {
            Err(failure) if failure.is_absent() => return Ok(()),
            Err(failure) => return Err((object, failure)),
            Ok(()) => {}
        }
        let value = outcome.data.unsigned().and_then(|value| u32::try_from(value).ok()).unwrap_or(0);
        self.told.insert(object, value);
        let is_count =
            object.sub == 0 && Direction::BOTH.iter().any(|way| way.mapping().contains(&object.index));
        if is_count {
            let count =
                u8::try_from(value).unwrap_or(u8::MAX).min(u8::try_from(MAPPING_MAX).unwrap_or(u8::MAX));
            self.ask.extend((1..=count).map(|sub| Mux::new(object.index, sub)));
        }
        Ok(())
    }

    /// What was found, once everything has been read.
    pub fn found(&self) -> FoundPdos {
        Direction::BOTH.map(|way| {
            let pdo = |number: u16| {
                let entries = way.mapping_object(number, 1)..=way.mapping_object(number, u8::MAX);
                let word = self.told.get(&way.communication_object(number, SUB_COB_ID))?;
                let entries = self.told.range(entries).map(|(_, word)| MappingEntry(*word)).collect();
                Some(FoundPdo::new(number, CobId(*word), entries))
            };
            self.pdos.numbers().filter_map(pdo).filter(|pdo| !pdo.mapping.is_empty()).collect()
        })
    }
}
