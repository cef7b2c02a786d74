//! The attributes of a scope, sorted.

use core::fmt;

use super::engine::{ENGINE, RULES};
use super::entry::{Entry, encode_default};
use super::{AttributeDefinition, DataType, DefaultValue, ElementRule, Scope};

/// Why a table of definitions cannot be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TableError {
    /// Two definitions have the same scope and ID.
    Duplicate(Scope, u16),
    /// The engine needs this attribute with another type, or as a single value.
    EngineType {
        /// Scope of the attribute.
        scope: Scope,
        /// Attribute ID.
        id: u16,
        /// The type that the engine needs.
        expected: DataType,
    },
    /// A default does not fit its type or its range.
    Default(Scope, u16),
}

impl fmt::Display for TableError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Duplicate(scope, id) => write!(f, "{scope:?} attribute {id} is defined twice"),
            Self::EngineType { scope, id, expected } => {
                write!(f, "{scope:?} attribute {id}: expected a single {expected:?}")
            }
            Self::Default(scope, id) => {
                write!(f, "{scope:?} attribute {id}: the default does not fit its type or range")
            }
        }
    }
}

impl std::error::Error for TableError {}

/// The sorted attributes of one scope.
#[derive(Debug, Clone)]
pub struct AttributeTable {
    pub(super) entries: Vec<Entry>,
    /// Place of each ID below [`INDEXED`] among the entries, [`NOWHERE`] where there is no such attribute.
    index: Box<[u16]>,
    pub(super) octets: usize,
}

/// IDs below this are found without a search: those of the standard, which the cycle asks for.
const INDEXED: usize = 4096;

/// Place of an ID that no entry has.
const NOWHERE: u16 = u16::MAX;

fn index(entries: &[Entry]) -> Box<[u16]> {
    let mut index = Vec::new();
    for (place, entry) in (0..).zip(entries) {
        let id = usize::from(entry.definition.id);
        if id < INDEXED {
            index.resize(id, NOWHERE);
            index.push(place);
        }
    }
    index.into_boxed_slice()
}

impl AttributeTable {
    /// Builds the table of one scope: the definitions of that scope and those of the engine that are missing.
    ///
    /// # Errors
    /// See [`TableError`].
    pub fn new(scope: Scope, definitions: &[AttributeDefinition]) -> Result<Self, TableError> {
        let mut all: Vec<AttributeDefinition> =
            definitions.iter().filter(|d| d.scope == scope).cloned().collect();
        for (_, id, data_type, access, default, name) in ENGINE.iter().filter(|row| row.0 == scope) {
            let own = RULES.iter().find(|rule| scope == Scope::Class && rule.id == *id);
            let default = own.map_or(*default, |rule| rule.default);
            let range = own.map(|rule| rule.range);
            match all.iter_mut().find(|d| d.id == *id) {
                Some(d) if d.data_type.size() == data_type.size() && d.elements.is_none() => {
                    // A definition that leaves the default open must not turn a limit into 0.
                    if d.default == DefaultValue::Integer(0) {
                        d.default = DefaultValue::Integer(default);
                    }
                    d.range = d.range.or(range);
                }
                Some(_) => return Err(TableError::EngineType { scope, id: *id, expected: *data_type }),
                None => {
                    let mut definition = AttributeDefinition::new(scope, *id, *data_type, *access, name);
                    definition.default = DefaultValue::Integer(default);
                    definition.range = range;
                    definition.settable_in_running = true;
                    all.push(definition);
                }
            }
        }
        all.sort_by_key(|d| d.id);
        if let Some(pair) = all.windows(2).find(|pair| pair[0].id == pair[1].id) {
            return Err(TableError::Duplicate(scope, pair[0].id));
        }
        let mut entries = Vec::with_capacity(all.len());
        let mut octets = 0;
        for definition in all {
            let wrong = TableError::Default(scope, definition.id);
            if definition.element_rules.len() > usize::from(definition.elements.unwrap_or(0)) {
                return Err(wrong);
            }
            let default =
                encode_default(&definition, definition.default, definition.range).ok_or(wrong.clone())?;
            let encode = |rule: &ElementRule| encode_default(&definition, rule.default, Some(rule.range));
            let element_defaults: Option<Vec<_>> = definition.element_rules.iter().map(encode).collect();
            let element_defaults = element_defaults.ok_or(wrong)?;
            let size = definition.size();
            entries.push(Entry { definition, offset: octets, default, element_defaults });
            octets += size;
        }
        let index = index(&entries);
        Ok(Self { entries, index, octets })
    }

    /// The attribute with this ID.
    #[must_use]
    pub fn find(&self, id: u16) -> Option<&Entry> {
        match self.index.get(usize::from(id)) {
            Some(place) => self.entries.get(usize::from(*place)),
            None => {
                let at = self.entries.binary_search_by_key(&id, |e| e.definition.id).ok()?;
                self.entries.get(at)
            }
        }
    }

    /// All attributes in the order of their IDs.
    pub fn iter(&self) -> impl Iterator<Item = &AttributeDefinition> {
        self.entries.iter().map(|e| &e.definition)
    }
}
