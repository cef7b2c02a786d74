//! What an attribute is: type, access, where its value lives, what it may be set to.

use super::DataType;

/// Who has an attribute.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Scope {
    /// The class, instance 0.
    Class,
    /// Every axis.
    Instance,
}

/// Access rule of the standard's tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// Get only.
    Get,
    /// Get and Set by a service.
    Set,
    /// `Set*`: set by the cyclic connection data, not by a service.
    Cyclic,
}

/// Where the value lives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Backing {
    /// In the device; the owner of the device may publish values with `put_attribute`.
    Stored,
    /// In the drive: every Get and Set is carried to it.
    Drive,
    /// In the process image of the drive: a Get is carried to the owner of the device like one of [`Backing::Drive`], and
    /// what a cyclic read list holds of them is published in every cycle.
    Signal,
}

impl Backing {
    /// Whether a Get has to ask the owner of the device.
    #[must_use]
    pub const fn is_elsewhere(self) -> bool {
        matches!(self, Self::Drive | Self::Signal)
    }
}

/// Value an attribute has before it is set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DefaultValue {
    /// For the integer and bit string types.
    Integer(i64),
    /// For REAL and LREAL.
    Real(f64),
}

/// What an attribute is.
#[derive(Debug, Clone, PartialEq)]
pub struct AttributeDefinition {
    /// Who has it.
    pub scope: Scope,
    /// Attribute ID.
    pub id: u16,
    /// Type of an element.
    pub data_type: DataType,
    /// Number of elements of an array; `None` for a single value.
    pub elements: Option<u16>,
    /// Access rule.
    pub access: Access,
    /// Whether it may be set while the axis is Running, Table 5-2.110.
    pub settable_in_running: bool,
    /// Where the value lives.
    pub backing: Backing,
    /// Default of every element.
    pub default: DefaultValue,
    /// Permitted values, ends included.
    pub range: Option<(f64, f64)>,
    /// What holds for single elements of an array in place of `default` and `range`: one rule for each element from the
    /// first; empty where all are alike.
    pub element_rules: Vec<ElementRule>,
    /// Permitted codes of an enumeration in ascending order; empty for any value of the type.
    pub codes: Vec<u32>,
    /// Bits of a bit field that mean something; the others have to be 0.
    pub bits: Option<u64>,
    /// The standard requires it of no device that closes a loop.
    pub is_optional: bool,
    /// Name of the standard.
    pub name: String,
}

/// Default and permitted values of one element of an array.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElementRule {
    /// Its default.
    pub default: DefaultValue,
    /// Its permitted values, ends included.
    pub range: (f64, f64),
    /// A value that leaves the element as it is, in the octets of the type; it is taken and not stored.
    pub keeps: Option<u8>,
}

impl ElementRule {
    /// Whether a value leaves the element as it is.
    #[must_use]
    pub fn keeps_with(&self, element: &[u8]) -> bool {
        self.keeps.is_some_and(|keeps| element == [keeps])
    }
}

impl AttributeDefinition {
    /// A stored single value with default 0 and no range.
    #[must_use]
    pub fn new(scope: Scope, id: u16, data_type: DataType, access: Access, name: &str) -> Self {
        Self {
            scope,
            id,
            data_type,
            elements: None,
            access,
            settable_in_running: false,
            backing: Backing::Stored,
            default: DefaultValue::Integer(0),
            range: None,
            element_rules: Vec::new(),
            codes: Vec::new(),
            bits: None,
            is_optional: false,
            name: name.to_owned(),
        }
    }

    /// Octets of the whole value.
    #[must_use]
    pub fn size(&self) -> usize {
        usize::from(self.data_type.size()) * usize::from(self.elements.unwrap_or(1))
    }
}
