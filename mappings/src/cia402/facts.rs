//! What a drive has told of its objects.

use std::collections::BTreeMap;

use profile_generic::program::Width;

use super::{Object, Value};

/// Who made a device, by 1018.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DriveIdentity {
    /// Vendor-ID (1018:1), where it has one.
    pub vendor: Option<u32>,
    /// Product code (1018:2), where it has one.
    pub product: Option<u32>,
}

/// What a drive has said about itself.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ObjectFacts {
    identity: DriveIdentity,
    facts: BTreeMap<Object, Fact>,
}

#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct Fact {
    data: Option<Vec<u8>>,
    missing: bool,
}

impl ObjectFacts {
    /// Nothing known.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Nothing known but what the device of the drive is.
    #[must_use]
    pub fn of(identity: DriveIdentity) -> Self {
        Self { identity, ..Self::default() }
    }

    /// What its device is.
    #[must_use]
    pub fn identity(&self) -> &DriveIdentity {
        &self.identity
    }

    /// Whether nothing is known, as before the drive was asked.
    pub(super) fn is_empty(&self) -> bool {
        self.facts.is_empty()
    }

    /// The drive has given the value of an object, or has taken these bytes for it.
    pub fn note_data(&mut self, object: Object, data: &[u8]) {
        *self.facts.entry(object).or_default() = Fact { data: Some(data.to_vec()), missing: false };
    }

    /// The drive has no such object.
    pub fn note_missing(&mut self, object: Object) {
        *self.facts.entry(object).or_default() = Fact { data: None, missing: true };
    }

    /// Whether the drive has said that it has no such object.
    #[must_use]
    pub fn is_missing(&self, object: Object) -> bool {
        self.facts.get(&object).is_some_and(|fact| fact.missing)
    }

    /// The bytes that the drive has given.
    #[must_use]
    pub fn data(&self, object: Object) -> Option<&[u8]> {
        self.facts.get(&object)?.data.as_deref()
    }

    /// The value, if the drive has given it in the length that belongs to it.
    pub(super) fn number(&self, value: &Value) -> Option<i64> {
        self.integer(value.object, value.width)
    }

    pub(super) fn integer(&self, object: Object, width: Width) -> Option<i64> {
        width.integer(self.facts.get(&object)?.data.as_deref()?)
    }
}
