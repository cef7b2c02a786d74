//! The values of an instance.

use super::entry::check_string;
use super::{AttributeTable, DataType, Entry, Part};
use crate::wire::status::GeneralStatus;

/// The values of one instance.
#[derive(Debug, Clone)]
pub struct AttributeStore {
    octets: Box<[u8]>,
    /// Counts how often a value has become another one.
    changes: u64,
}

impl AttributeStore {
    /// Values at their defaults.
    #[must_use]
    pub fn new(table: &AttributeTable) -> Self {
        let mut store = Self { octets: vec![0; table.octets].into_boxed_slice(), changes: 0 };
        store.reset(table);
        store
    }

    /// Puts every value back to its default.
    pub fn reset(&mut self, table: &AttributeTable) {
        self.changes += 1;
        for entry in &table.entries {
            let size = usize::from(entry.definition.data_type.size());
            let place = entry.offset..entry.offset + entry.definition.size();
            for (index, element) in self.octets[place].chunks_exact_mut(size).enumerate() {
                let default = entry.element_defaults.get(index).unwrap_or(&entry.default);
                // A string begins empty; only its length octet counts then.
                let known = size.min(default.len());
                element[..known].copy_from_slice(&default[..known]);
            }
        }
    }

    /// The octets of a part.
    ///
    /// # Errors
    /// The part does not lie within the attribute.
    pub fn get(&self, entry: &Entry, part: Part) -> Result<&[u8], GeneralStatus> {
        let range = entry.range(part)?;
        let octets = &self.octets[entry.offset + range.start..entry.offset + range.end];
        Ok(match octets.first() {
            Some(length) if entry.definition.data_type == DataType::ShortString => {
                octets.get(..1 + usize::from(*length)).unwrap_or(octets)
            }
            _ => octets,
        })
    }

    /// Writes the octets of a part, without looking at access or range.
    ///
    /// # Errors
    /// The part does not lie within the attribute, or the octets are not as many.
    pub fn put(&mut self, entry: &Entry, part: Part, value: &[u8]) -> Result<(), GeneralStatus> {
        let range = entry.range(part)?;
        let mut place = &mut self.octets[entry.offset + range.start..entry.offset + range.end];
        if entry.definition.data_type == DataType::ShortString {
            check_string(value)?;
            place = &mut place[..value.len()];
        }
        if place.len() != value.len() {
            return Err(GeneralStatus::NOT_ENOUGH_DATA);
        }
        if *place != *value {
            place.copy_from_slice(value);
            self.changes += 1;
        }
        Ok(())
    }

    /// As [`AttributeStore::put`] does, but leaves elements whose value says so as they are ([`ElementRule::keeps`]).
    ///
    /// # Errors
    /// As [`AttributeStore::put`].
    ///
    /// [`ElementRule::keeps`]: super::ElementRule::keeps
    pub fn set(&mut self, entry: &Entry, part: Part, value: &[u8]) -> Result<(), GeneralStatus> {
        let rules = entry.definition.element_rules.get(usize::from(part.start)..).unwrap_or(&[]);
        if rules.iter().zip(value).all(|(rule, octet)| !rule.keeps_with(&[*octet])) {
            return self.put(entry, part, value);
        }
        for ((index, rule), octet) in
            (part.start..).zip(rules).zip(value.iter().take(usize::from(part.count)))
        {
            if !rule.keeps_with(&[*octet]) {
                self.put(entry, Part { start: index, count: 1 }, &[*octet])?;
            }
        }
        Ok(())
    }

    /// A number that is another one after a value has changed: what was made of the values before may be kept as long as it
    /// is the same.
    #[must_use]
    pub fn changes(&self) -> u64 {
        self.changes
    }

    /// A single unsigned value up to 64 bits; `None` if there is no such attribute.
    #[must_use]
    pub fn unsigned(&self, table: &AttributeTable, id: u16) -> Option<u64> {
        let entry = table.find(id)?;
        let value = self.get(entry, Part { start: 0, count: 1 }).ok()?;
        let mut octets = [0; 8];
        octets.get_mut(..value.len())?.copy_from_slice(value);
        Some(u64::from_le_bytes(octets))
    }

    /// Publishes a single value given as 64 bits; the excess octets are cut off. Unknown IDs are ignored.
    pub fn publish(&mut self, table: &AttributeTable, id: u16, value: u64) {
        if let Some(entry) = table.find(id) {
            let size = usize::from(entry.definition.data_type.size()).min(8);
            // A single number of its own size always fits.
            let _ = self.put(entry, Part { start: 0, count: 1 }, &value.to_le_bytes()[..size]);
        }
    }
}
