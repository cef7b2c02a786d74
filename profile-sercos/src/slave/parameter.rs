//! The parameters of a slave: data blocks with their seven elements.
//!
//! Everything is allocated when parameters are defined. Values are changed in place.

use std::borrow::Cow;

use crate::wire::attribute::{Attribute, Format};
use crate::wire::data_status::DataStatus;
use crate::wire::header::Phase;
use crate::wire::idn::Idn;
use crate::wire::procedure::ProcedureControl;
use crate::wire::svc_error::SvcError;

/// Most parameters of a slave. Bounds the lists of IDNs, which are 4 bytes an entry and 65535 bytes at most.
pub const PARAMETERS_MAX: usize = 4096;

/// Whether a parameter may be part of a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Cyclic {
    /// Only over the service channel.
    #[default]
    No,
    /// Command value: in a connection which the slave consumes.
    Command,
    /// Feedback value: in a connection which the slave produces.
    Feedback,
    /// Either.
    Both,
}

/// A handle of a parameter in its store; valid for the store that gave it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Handle(usize);

/// What a parameter is, before it is in a store. Built with the methods that return `Self`.
#[derive(Debug, Clone)]
pub struct Definition {
    idn: Idn,
    name: Cow<'static, str>,
    unit: Cow<'static, str>,
    attribute: Attribute,
    minimum: Option<i64>,
    maximum: Option<i64>,
    data: Vec<u8>,
    capacity: usize,
    cyclic: Cyclic,
    busy_cycles: u8,
    valid: bool,
}

impl Definition {
    fn new(idn: Idn, attribute: u32, name: impl Into<Cow<'static, str>>, data: Vec<u8>) -> Self {
        let capacity = data.len();
        Definition {
            idn,
            name: name.into(),
            unit: Cow::Borrowed(""),
            attribute: Attribute(attribute),
            minimum: None,
            maximum: None,
            data,
            capacity,
            cyclic: Cyclic::No,
            busy_cycles: 0,
            valid: true,
        }
    }

    /// A number or bit field. `attribute` is element 3 and gives the length.
    pub fn value(idn: Idn, attribute: u32, name: &'static str, value: i64) -> Self {
        let len = usize::from(Attribute(attribute).item_length().bytes());
        Self::new(idn, attribute, name, value.to_le_bytes()[..len].to_vec())
    }

    /// A list; `capacity` is its longest length in bytes, `data` its items as bytes.
    pub fn list(idn: Idn, attribute: u32, name: &'static str, data: &[u8], capacity: usize) -> Self {
        let mut definition = Self::new(idn, attribute, name, data.to_vec());
        definition.capacity = capacity.max(data.len()).min(usize::from(u16::MAX));
        definition
    }

    /// Operation data of any kind with these bytes, which fit the attribute; `capacity` is the longest length of a list in bytes.
    pub(super) fn data(idn: Idn, attribute: Attribute, name: String, data: &[u8], capacity: usize) -> Self {
        let mut definition = Self::new(idn, attribute.0, name, data.to_vec());
        if attribute.is_list() {
            definition.capacity = capacity.max(data.len()).min(usize::from(u16::MAX));
        }
        definition
    }

    /// A text that only the slave changes.
    pub fn text(idn: Idn, name: &'static str, text: &str, capacity: usize) -> Self {
        Self::list(idn, TEXT_READ_ONLY, name, text.as_bytes(), capacity)
    }

    /// A procedure command. `attribute` gives the phases in which it can be started.
    pub fn command(idn: Idn, attribute: u32, name: &'static str) -> Self {
        Self::value(idn, attribute, name, 0)
    }

    /// With a unit, element 4.
    #[must_use]
    pub fn unit(mut self, unit: impl Into<Cow<'static, str>>) -> Self {
        self.unit = unit.into();
        self
    }

    /// With minimum and maximum, elements 5 and 6.
    #[must_use]
    pub fn range(mut self, minimum: i64, maximum: i64) -> Self {
        (self.minimum, self.maximum) = (Some(minimum), Some(maximum));
        self
    }

    /// With a place in connections.
    #[must_use]
    pub fn cyclic(mut self, cyclic: Cyclic) -> Self {
        self.cyclic = cyclic;
        self
    }

    /// The service channel answers busy for so many cycles before it has read or written the data.
    #[must_use]
    pub fn busy(mut self, cycles: u8) -> Self {
        self.busy_cycles = cycles;
        self
    }

    /// The data is invalid until it is first written.
    #[must_use]
    pub fn invalid(mut self) -> Self {
        self.valid = false;
        self
    }
}

/// Element 3 of a read-only text.
pub const TEXT_READ_ONLY: u32 = 0x7044_0001;
/// Element 3 of a read-only list of four-byte IDNs.
pub const IDN_LIST_READ_ONLY: u32 = 0x7056_0001;

/// A parameter in a store.
#[derive(Debug)]
pub struct Parameter {
    definition: Definition,
    status: DataStatus,
}

impl Parameter {
    /// The identification number that it stands under.
    pub fn idn(&self) -> Idn {
        self.definition.idn
    }

    /// Element 2.
    pub fn name(&self) -> &str {
        &self.definition.name
    }

    /// Element 3.
    pub fn attribute(&self) -> Attribute {
        self.definition.attribute
    }

    /// Element 4; empty if there is none.
    pub fn unit(&self) -> &str {
        &self.definition.unit
    }

    /// Element 5 as a number.
    pub fn minimum(&self) -> Option<i64> {
        self.definition.minimum
    }

    /// Element 6 as a number.
    pub fn maximum(&self) -> Option<i64> {
        self.definition.maximum
    }

    /// Element 7: the bytes of the value, or of the list without its head.
    pub fn data(&self) -> &[u8] {
        &self.definition.data
    }

    /// Longest data in bytes.
    pub fn capacity(&self) -> usize {
        self.definition.capacity
    }

    /// Place in connections.
    pub fn cyclic(&self) -> Cyclic {
        self.definition.cyclic
    }

    /// Cycles for which an access is busy.
    pub fn busy_cycles(&self) -> u8 {
        self.definition.busy_cycles
    }

    /// Data status: validity of a parameter, progress of a procedure command.
    pub fn status(&self) -> DataStatus {
        self.status
    }

    /// Why element 7 cannot be written over the service channel in `phase`.
    pub fn write_protection(&self, phase: Phase) -> Option<SvcError> {
        let attribute = self.attribute();
        if (2..=4).all(|phase| attribute.write_protected(phase)) {
            Some(SvcError::DATA_READ_ONLY)
        } else if attribute.write_protected(phase.0) {
            Some(SvcError::DATA_PROTECTED)
        } else {
            None
        }
    }

    /// The value as a number, with its sign if the display format has one. Lists give 0.
    pub fn number(&self) -> i64 {
        number(self.attribute(), self.data())
    }

    /// Whether `data` is a permitted value: length, whole items, limits.
    pub fn check(&self, data: &[u8]) -> Result<(), SvcError> {
        if data.len() > self.capacity() {
            return Err(SvcError::DATA_LONG);
        }
        let attribute = self.attribute();
        if attribute.is_list() {
            let item = usize::from(attribute.item_length().bytes());
            return if data.len().is_multiple_of(item) { Ok(()) } else { Err(SvcError::INVALID_DATA) };
        }
        if data.len() < self.capacity() {
            return Err(SvcError::DATA_SHORT);
        }
        let value = number(attribute, data);
        if self.minimum().is_some_and(|minimum| value < minimum) {
            return Err(SvcError::BELOW_MINIMUM);
        }
        if self.maximum().is_some_and(|maximum| value > maximum) {
            return Err(SvcError::ABOVE_MAXIMUM);
        }
        Ok(())
    }
}

/// `data` as a number in the length and display format of `attribute`.
fn number(attribute: Attribute, data: &[u8]) -> i64 {
    let len = usize::from(attribute.item_length().bytes());
    if attribute.is_list() || data.len() != len {
        return 0;
    }
    let negative = attribute.format() == Format::Signed && data[len - 1] & 0x80 != 0;
    let mut bytes = if negative { [0xFF; 8] } else { [0; 8] };
    bytes[..len].copy_from_slice(data);
    i64::from_le_bytes(bytes)
}

/// All parameters of a slave.
#[derive(Debug, Default)]
pub struct Store {
    parameters: Vec<Parameter>,
    /// Positions in `parameters`, sorted by IDN.
    order: Vec<usize>,
    /// Positions of those that only the slave itself has to do with.
    hidden: Vec<usize>,
}

impl Store {
    /// An empty store.
    pub fn new() -> Self {
        Store { parameters: Vec::new(), order: Vec::new(), hidden: Vec::new() }
    }

    /// Adds a parameter, or replaces the one with the same IDN.
    ///
    /// # Panics
    /// With more than [`PARAMETERS_MAX`] parameters: a slave's set is fixed when it is built.
    pub fn define(&mut self, mut definition: Definition) -> Handle {
        let extra = definition.capacity - definition.data.len();
        definition.data.reserve_exact(extra);
        let status = if definition.valid { DataStatus::empty() } else { DataStatus::INVALID };
        let idn = definition.idn;
        let parameter = Parameter { definition, status };
        match self.position(idn) {
            Ok(at) => {
                let index = self.order[at];
                self.parameters[index] = parameter;
                Handle(index)
            }
            Err(at) => {
                assert!(self.parameters.len() < PARAMETERS_MAX, "more than {PARAMETERS_MAX} parameters");
                self.parameters.push(parameter);
                self.order.insert(at, self.parameters.len() - 1);
                Handle(self.parameters.len() - 1)
            }
        }
    }

    fn position(&self, idn: Idn) -> Result<usize, usize> {
        self.order.binary_search_by_key(&idn, |&index| self.parameters[index].idn())
    }

    /// The parameter with this IDN.
    pub fn find(&self, idn: Idn) -> Option<Handle> {
        self.position(idn).ok().map(|at| Handle(self.order[at]))
    }

    /// Makes it a slave that does not have this parameter; whether it had it. Handles of it stay valid.
    pub fn remove(&mut self, idn: Idn) -> bool {
        let place = self.position(idn);
        if let Ok(at) = place {
            self.order.remove(at);
        }
        place.is_ok()
    }

    /// Makes it a slave that does not have this parameter, and goes on with its number inside; whether it had it.
    pub fn hide(&mut self, idn: Idn) -> bool {
        let place = self.position(idn);
        if let Ok(at) = place {
            self.hidden.push(self.order.remove(at));
        }
        place.is_ok()
    }

    /// The parameter with this IDN, also one that is hidden.
    fn find_inside(&self, idn: Idn) -> Option<Handle> {
        let hidden = || self.hidden.iter().copied().find(|&index| self.parameters[index].idn() == idn);
        self.find(idn).or_else(|| hidden().map(Handle))
    }

    /// A parameter by its handle.
    pub fn get(&self, handle: Handle) -> &Parameter {
        &self.parameters[handle.0]
    }

    /// All parameters in order of their IDNs.
    pub fn iter(&self) -> impl Iterator<Item = &Parameter> {
        self.order.iter().map(|&index| &self.parameters[index])
    }

    /// The value of a parameter as a number.
    pub fn number(&self, handle: Handle) -> i64 {
        self.parameters[handle.0].number()
    }

    /// The value of the parameter with this IDN; 0 if there is none.
    pub fn number_of(&self, idn: Idn) -> i64 {
        self.find_inside(idn).map_or(0, |handle| self.number(handle))
    }

    /// Sets a number from inside the slave: no limit and no write protection applies. What does not fit is
    /// clamped to the length and display format.
    pub fn set_number(&mut self, handle: Handle, value: i64) {
        let definition = &mut self.parameters[handle.0].definition;
        let bits = u32::from(definition.attribute.item_length().bytes()) * 8;
        let value = match (definition.attribute.format(), bits) {
            (_, 64) => value,
            (Format::Signed, _) => value.clamp(-(1 << (bits - 1)), (1 << (bits - 1)) - 1),
            _ => value.clamp(0, (1 << bits) - 1),
        };
        let len = definition.data.len();
        if len <= 8 && !definition.attribute.is_list() {
            definition.data.copy_from_slice(&value.to_le_bytes()[..len]);
        }
    }

    /// Sets the number of the parameter with this IDN, if there is one.
    pub fn set_number_of(&mut self, idn: Idn, value: i64) {
        if let Some(handle) = self.find_inside(idn) {
            self.set_number(handle, value);
        }
    }

    /// Sets the bytes of a value or list from inside the slave and makes the data valid. A list is cut at its
    /// capacity; a value of another length is left alone.
    pub fn set_data(&mut self, handle: Handle, data: &[u8]) {
        let parameter = &mut self.parameters[handle.0];
        let definition = &mut parameter.definition;
        if definition.attribute.is_list() {
            let len = data.len().min(definition.capacity);
            definition.data.clear();
            definition.data.extend_from_slice(&data[..len]);
        } else if data.len() == definition.data.len() {
            definition.data.copy_from_slice(data);
        }
        parameter.status.remove(DataStatus::INVALID);
    }

    /// Sets the bytes of the parameter with this IDN, if there is one.
    pub fn set_data_of(&mut self, idn: Idn, data: &[u8]) {
        if let Some(handle) = self.find(idn) {
            self.set_data(handle, data);
        }
    }

    /// Appends an IDN to a list of IDNs; a full list stays as it is.
    pub fn push_idn(&mut self, handle: Handle, idn: Idn) {
        let definition = &mut self.parameters[handle.0].definition;
        if definition.data.len() + 4 <= definition.capacity {
            definition.data.extend_from_slice(&idn.0.to_le_bytes());
        }
    }

    /// The IDNs in a list of IDNs; empty if there is no such parameter.
    pub fn idns(&self, list: Idn) -> impl Iterator<Item = Idn> {
        let data = self.find(list).map_or(&[][..], |handle| self.get(handle).data());
        data.chunks_exact(4).map(|b| Idn(u32::from_le_bytes([b[0], b[1], b[2], b[3]])))
    }

    /// Sets the data status of a procedure command.
    pub fn set_status(&mut self, handle: Handle, status: DataStatus) {
        self.parameters[handle.0].status = status;
    }

    /// The control word which the master has written to a procedure command.
    pub fn control(&self, handle: Handle) -> ProcedureControl {
        let [low, high, ..] = self.number(handle).to_le_bytes();
        ProcedureControl::from_bits_retain(u16::from_le_bytes([low, high]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDN: Idn = Idn::standard(36);

    #[test]
    fn definitions_are_found_by_idn_and_can_be_replaced() {
        let mut store = Store::new();
        let later = store.define(Definition::value(Idn::standard(40), 0x7322_0001, "feedback", 7));
        let first = store.define(Definition::value(IDN, 0x0322_0001, "command", -5).unit("mm/min"));
        assert_eq!(store.find(IDN), Some(first));
        assert_eq!(store.iter().map(Parameter::idn).collect::<Vec<_>>(), [IDN, Idn::standard(40)]);
        assert_eq!(store.number(first), -5);
        assert_eq!(store.get(first).data(), [0xFB, 0xFF, 0xFF, 0xFF]);
        assert_eq!(store.define(Definition::value(IDN, 0x0322_0001, "command", 9)), first);
        assert_eq!((store.number(first), store.number(later)), (9, 7));
        assert_eq!(store.find(Idn::standard(1)), None);
        assert_eq!(store.number_of(Idn::standard(1)), 0);
    }

    #[test]
    fn numbers_are_clamped_to_their_length() {
        let mut store = Store::new();
        let signed = store.define(Definition::value(IDN, 0x0021_0001, "signed 2", 0));
        let unsigned = store.define(Definition::value(Idn::standard(1), 0x0011_0001, "unsigned 2", 0));
        let eight = store.define(Definition::value(Idn::standard(2), 0x0023_0001, "signed 8", 0));
        let cases = [(40_000, 32_767, 40_000), (-40_000, -32_768, 0), (70_000, 32_767, 65_535)];
        for (value, as_signed, as_unsigned) in cases {
            store.set_number(signed, value);
            store.set_number(unsigned, value);
            store.set_number(eight, value);
            let numbers = [signed, unsigned, eight].map(|handle| store.number(handle));
            assert_eq!(numbers, [as_signed, as_unsigned, value]);
        }
    }

    #[test]
    fn values_are_checked_before_they_are_taken() {
        let mut store = Store::new();
        let value = store.define(Definition::value(IDN, 0x0022_0001, "limited", 0).range(-10, 10));
        let list = store.define(Definition::list(Idn::standard(1), 0x0015_0001, "list", &[], 6));
        let check = |handle, data: &[u8]| store.get(handle).check(data);
        assert_eq!(check(value, &(-10i32).to_le_bytes()), Ok(()));
        assert_eq!(check(value, &(-11i32).to_le_bytes()), Err(SvcError::BELOW_MINIMUM));
        assert_eq!(check(value, &11i32.to_le_bytes()), Err(SvcError::ABOVE_MAXIMUM));
        assert_eq!(check(value, &[0; 3]), Err(SvcError::DATA_SHORT));
        assert_eq!(check(value, &[0; 5]), Err(SvcError::DATA_LONG));
        assert_eq!(check(list, &[0; 6]), Ok(()));
        assert_eq!(check(list, &[0; 5]), Err(SvcError::INVALID_DATA));
        assert_eq!(check(list, &[0; 8]), Err(SvcError::DATA_LONG));
    }

    #[test]
    fn write_protection_follows_the_attribute() {
        let mut store = Store::new();
        let read_only = store.define(Definition::value(IDN, 0x7001_0001, "", 0));
        let cp2_cp3 = store.define(Definition::value(Idn::standard(1), 0x4001_0001, "", 0));
        let at = |handle, phase| store.get(handle).write_protection(Phase(phase));
        assert_eq!(at(read_only, 2), Some(SvcError::DATA_READ_ONLY));
        assert_eq!([2, 3, 4].map(|phase| at(cp2_cp3, phase)), [None, None, Some(SvcError::DATA_PROTECTED)]);
    }

    #[test]
    fn lists_stay_within_their_capacity() {
        let mut store = Store::new();
        let list = store.define(Definition::list(IDN, IDN_LIST_READ_ONLY, "list", &[], 8).invalid());
        assert_eq!(store.get(list).status(), DataStatus::INVALID);
        for number in 1..4 {
            store.push_idn(list, Idn::standard(number));
        }
        assert_eq!(store.idns(IDN).collect::<Vec<_>>(), [Idn::standard(1), Idn::standard(2)]);
        store.set_data(list, &[9; 12]);
        assert_eq!((store.get(list).data(), store.get(list).status()), (&[9; 8][..], DataStatus::empty()));
    }
}
