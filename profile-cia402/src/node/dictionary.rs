//! The object dictionary: what objects a device has, of what type and with what limits, and their values.
//!
//! It is built once, in ascending order of index and sub-index, and does not grow afterwards.

use crate::wire::{AbortCode, Mux, NodeId};

/// Type of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DataType {
    /// BOOLEAN, in a byte.
    Bool,
    /// INTEGER8.
    I8,
    /// INTEGER16.
    I16,
    /// INTEGER32.
    I32,
    /// UNSIGNED8.
    U8,
    /// UNSIGNED16.
    U16,
    /// UNSIGNED32.
    U32,
    /// INTEGER24.
    I24,
    /// INTEGER40.
    I40,
    /// INTEGER48.
    I48,
    /// INTEGER56.
    I56,
    /// INTEGER64.
    I64,
    /// UNSIGNED24.
    U24,
    /// UNSIGNED40.
    U40,
    /// UNSIGNED48.
    U48,
    /// UNSIGNED56.
    U56,
    /// UNSIGNED64, as the bits of a number with sign.
    U64,
    /// REAL32, as its bits.
    F32,
    /// REAL64, as its bits.
    F64,
    /// VISIBLE_STRING.
    Text,
    /// OCTET_STRING.
    Octets,
    /// DOMAIN: any bytes.
    Domain,
}

impl DataType {
    /// Its code in CiA 301, as electronic data sheets give it.
    #[must_use]
    pub const fn code(self) -> u16 {
        match self {
            Self::Bool => 0x01,
            Self::I8 => 0x02,
            Self::I16 => 0x03,
            Self::I32 => 0x04,
            Self::U8 => 0x05,
            Self::U16 => 0x06,
            Self::U32 => 0x07,
            Self::I24 => 0x10,
            Self::I40 => 0x12,
            Self::I48 => 0x13,
            Self::I56 => 0x14,
            Self::I64 => 0x15,
            Self::U24 => 0x16,
            Self::U40 => 0x18,
            Self::U48 => 0x19,
            Self::U56 => 0x1A,
            Self::U64 => 0x1B,
            Self::F32 => 0x08,
            Self::F64 => 0x11,
            Self::Text => 0x09,
            Self::Octets => 0x0A,
            Self::Domain => 0x0F,
        }
    }

    /// All of them.
    pub const ALL: [Self; 22] = [
        Self::Bool,
        Self::I8,
        Self::I16,
        Self::I24,
        Self::I32,
        Self::I40,
        Self::I48,
        Self::I56,
        Self::I64,
        Self::U8,
        Self::U16,
        Self::U24,
        Self::U32,
        Self::U40,
        Self::U48,
        Self::U56,
        Self::U64,
        Self::F32,
        Self::F64,
        Self::Text,
        Self::Octets,
        Self::Domain,
    ];

    /// Whether its values have no fixed length.
    #[must_use]
    pub const fn is_bytes(self) -> bool {
        matches!(self, Self::Text | Self::Octets | Self::Domain)
    }

    /// Bytes of a number; 0 for text, octets and domains.
    #[must_use]
    pub const fn size(self) -> usize {
        match self {
            Self::Bool | Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I24 | Self::U24 => 3,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I40 | Self::U40 => 5,
            Self::I48 | Self::U48 => 6,
            Self::I56 | Self::U56 => 7,
            Self::I64 | Self::U64 | Self::F64 => 8,
            Self::Text | Self::Octets | Self::Domain => 0,
        }
    }

    /// Whether its numbers have a sign. Those of 64 bits are kept as such.
    const fn is_signed(self) -> bool {
        matches!(
            self,
            Self::I8
                | Self::I16
                | Self::I24
                | Self::I32
                | Self::I40
                | Self::I48
                | Self::I56
                | Self::I64
                | Self::U64
                | Self::F64
        )
    }

    /// The least and the largest number; 0 and 0 for text, octets and domains.
    #[must_use]
    pub const fn range(self) -> (i64, i64) {
        let bits = 8 * self.size();
        match (self, bits) {
            (Self::Bool, _) => (0, 1),
            (_, 0) => (0, 0),
            (_, 64) => (i64::MIN, i64::MAX),
            (_, bits) if self.is_signed() => (-(1 << (bits - 1)), (1 << (bits - 1)) - 1),
            (_, bits) => (0, (1 << bits) - 1),
        }
    }

    /// The number in `bytes`, little endian; `None` unless there are exactly as many as the type has.
    #[must_use]
    pub fn number(self, bytes: &[u8]) -> Option<i64> {
        let size = self.size();
        let negative = self.is_signed() && bytes.last().is_some_and(|last| last & 0x80 != 0);
        let mut wide = [if negative { 0xFF } else { 0 }; 8];
        wide.get_mut(..size).filter(|place| place.len() == bytes.len() && size > 0)?.copy_from_slice(bytes);
        Some(i64::from_le_bytes(wide))
    }
}

/// Who may read and write an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Access {
    /// Never changes.
    Constant,
    /// Only the device changes it.
    ReadOnly,
    /// The master reads and writes it.
    ReadWrite,
    /// The master writes it and cannot read it.
    WriteOnly,
}

impl Access {
    /// Whether the master may write it.
    #[must_use]
    pub const fn writes(self) -> bool {
        matches!(self, Self::ReadWrite | Self::WriteOnly)
    }
}

/// Which PDOs may carry an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Mapping {
    /// None.
    None,
    /// From the master.
    Rpdo,
    /// To the master.
    Tpdo,
    /// Both.
    Both,
}

/// What an object or one of its parts is, to begin with.
#[derive(Debug, Clone, Copy)]
pub struct Definition {
    /// Its name.
    pub name: &'static str,
    /// Its type.
    pub data_type: DataType,
    /// Its access.
    pub access: Access,
    /// Its mapping.
    pub mapping: Mapping,
    /// Least number.
    pub low: i64,
    /// Largest number.
    pub high: i64,
    /// Number after a reset with nothing stored.
    pub default: i64,
    /// The node-id is added to the default.
    pub adds_node: bool,
    /// It is no parameter: neither stored nor part of the configuration.
    pub is_volatile: bool,
    /// Bytes of a text or a domain to begin with, and how many there can be.
    pub bytes: (&'static [u8], usize),
}

impl Definition {
    /// A number that the master may read and write.
    #[must_use]
    pub const fn new(name: &'static str, data_type: DataType, default: i64) -> Self {
        let (low, high) = data_type.range();
        Self {
            name,
            data_type,
            access: Access::ReadWrite,
            mapping: Mapping::None,
            low,
            high,
            default,
            adds_node: false,
            is_volatile: false,
            bytes: (&[], 0),
        }
    }

    /// A text that never changes.
    #[must_use]
    pub const fn text(name: &'static str, text: &'static str) -> Self {
        let bytes = (text.as_bytes(), text.len());
        Self { bytes, ..Self::new(name, DataType::Text, 0).constant() }
    }

    /// Up to `capacity` bytes that the master may read and write.
    #[must_use]
    pub const fn domain(name: &'static str, capacity: usize) -> Self {
        Self { bytes: (&[], capacity), is_volatile: true, ..Self::new(name, DataType::Domain, 0) }
    }

    /// Never changes.
    #[must_use]
    pub const fn constant(self) -> Self {
        Self { access: Access::Constant, ..self }
    }

    /// Only the device changes it.
    #[must_use]
    pub const fn read_only(self) -> Self {
        Self { access: Access::ReadOnly, is_volatile: true, ..self }
    }

    /// May be mapped into these PDOs.
    #[must_use]
    pub const fn mappable(self, mapping: Mapping) -> Self {
        Self { mapping, ..self }
    }

    /// Takes numbers from `low` to `high`.
    #[must_use]
    pub const fn range(self, low: i64, high: i64) -> Self {
        Self { low, high, ..self }
    }

    /// The node-id is added to its default.
    #[must_use]
    pub const fn plus_node(self) -> Self {
        Self { adds_node: true, ..self }
    }

    /// Is no parameter.
    #[must_use]
    pub const fn volatile(self) -> Self {
        Self { is_volatile: true, ..self }
    }
}

/// How the parts of an object belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Shape {
    /// One value.
    Variable,
    /// Parts of the same type.
    Array,
    /// Parts of different types.
    Record,
}

/// An object as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Object {
    /// Its index.
    pub index: u16,
    /// Its name.
    pub name: &'static str,
    /// Its shape.
    pub shape: Shape,
}

/// An object, or a part of one.
#[derive(Debug, Clone)]
pub struct Entry {
    mux: Mux,
    definition: Definition,
    number: i64,
    /// What a reset gives back.
    stored: i64,
    bytes: Vec<u8>,
    /// Nobody but the device itself finds it.
    is_hidden: bool,
}

impl Entry {
    /// Where it is.
    #[must_use]
    pub const fn mux(&self) -> Mux {
        self.mux
    }

    /// What it is.
    #[must_use]
    pub const fn definition(&self) -> &Definition {
        &self.definition
    }

    /// Whether only the device itself has to do with it: no client finds it, and no PDO carries it.
    #[must_use]
    pub const fn is_hidden(&self) -> bool {
        self.is_hidden
    }

    /// Its number; 0 for text and domains.
    #[must_use]
    pub const fn number(&self) -> i64 {
        self.number
    }

    /// Its bytes; empty for numbers.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    fn default(&self, node: Option<NodeId>) -> i64 {
        let node = node.filter(|_| self.definition.adds_node);
        self.definition.default.saturating_add(node.map_or(0, |node| i64::from(node.get())))
    }
}

/// Place of an entry; found once, then used in the cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Handle(usize);

/// Which parameters are stored or given their defaults again: the sub-indices of 1010h and 1011h.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Group {
    /// 1: all.
    All,
    /// 2: 1000h to 1FFFh.
    Communication,
    /// 3: 6000h to 9FFFh.
    Application,
    /// 4: 2000h to 5FFFh.
    Manufacturer,
}

impl Group {
    /// The group of a sub-index.
    #[must_use]
    pub const fn of(sub: u8) -> Option<Self> {
        Some(match sub {
            1 => Self::All,
            2 => Self::Communication,
            3 => Self::Application,
            4 => Self::Manufacturer,
            _ => return None,
        })
    }

    const fn has(self, index: u16) -> bool {
        match self {
            Self::All => true,
            Self::Communication => index < 0x2000,
            Self::Application => index >= 0x6000,
            Self::Manufacturer => index >= 0x2000 && index < 0x6000,
        }
    }
}

/// The objects of a node and their values, in the order of their indices.
#[derive(Debug, Clone)]
pub struct Dictionary {
    /// Added to identifiers; `None` adds nothing.
    node: Option<NodeId>,
    /// Index and sub-index of each entry, ascending.
    keys: Vec<u32>,
    entries: Vec<Entry>,
    objects: Vec<Object>,
    /// A parameter has changed since it was asked last.
    changed: bool,
}

const fn key(mux: Mux) -> u32 {
    (mux.index as u32) << 8 | mux.sub as u32
}

impl Dictionary {
    /// An empty one, for a device with this node-id, or without one.
    #[must_use]
    pub const fn new(node: Option<NodeId>) -> Self {
        Self { node, keys: Vec::new(), entries: Vec::new(), objects: Vec::new(), changed: false }
    }

    /// Adds an object of one value. One that is there already stays as it is.
    pub fn variable(&mut self, index: u16, definition: Definition) {
        if self.object(index).is_none() {
            self.add_object(Object { index, name: definition.name, shape: Shape::Variable });
            self.add(Mux::new(index, 0), definition);
        }
    }

    /// Adds an object of several parts, from sub-index 1 up; `None` leaves a sub-index out.
    pub fn record(&mut self, index: u16, name: &'static str, shape: Shape, parts: &[Option<Definition>]) {
        if self.object(index).is_some() {
            return;
        }
        self.add_object(Object { index, name, shape });
        let highest = parts.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
        let highest = i64::try_from(highest).unwrap_or(0);
        let count = Definition::new("Highest sub-index supported", DataType::U8, highest).constant();
        self.add(Mux::new(index, 0), count);
        for (sub, part) in (1..=u8::MAX).zip(parts) {
            if let Some(part) = part {
                self.add(Mux::new(index, sub), *part);
            }
        }
    }

    /// Adds one entry, also to an object that is there already.
    pub fn add(&mut self, mux: Mux, definition: Definition) {
        let Err(place) = self.keys.binary_search(&key(mux)) else { return };
        let (content, capacity) = definition.bytes;
        let mut bytes = Vec::with_capacity(capacity.max(content.len()));
        bytes.extend_from_slice(content);
        let mut entry = Entry { mux, definition, number: 0, stored: 0, bytes, is_hidden: false };
        entry.stored = entry.default(self.node);
        entry.number = entry.stored;
        self.keys.insert(place, key(mux));
        self.entries.insert(place, entry);
    }

    /// Adds the heading of an object whose entries are added one by one.
    pub fn add_object(&mut self, object: Object) {
        if let Err(place) = self.objects.binary_search_by_key(&object.index, |known| known.index) {
            self.objects.insert(place, object);
        }
    }

    /// Lets nobody write these objects any more.
    pub fn make_constant(&mut self, which: impl Fn(u16) -> bool) {
        let entries = self.entries.iter_mut().filter(|entry| which(entry.mux.index));
        entries.for_each(|entry| entry.definition.access = Access::Constant);
    }

    /// The node-id that is added to identifiers; 0 without.
    #[must_use]
    pub fn node_number(&self) -> u8 {
        self.node.map_or(0, NodeId::get)
    }

    /// Keeps all entries for the device itself: for clients there are none until [`Dictionary::redefine`] or [`Dictionary::add`]
    /// makes them known again.
    pub fn hide_all(&mut self) {
        self.objects.clear();
        self.entries.iter_mut().for_each(|entry| entry.is_hidden = true);
    }

    /// Removes the entries of these objects.
    pub fn remove(&mut self, which: impl Fn(u16) -> bool) {
        self.objects.retain(|object| !which(object.index));
        self.entries.retain(|entry| !which(entry.mux.index));
        self.keys = self.entries.iter().map(|entry| key(entry.mux)).collect();
    }

    /// Gives an entry that is there another definition and shows it to clients. It has its default again.
    pub fn redefine(&mut self, handle: Handle, definition: Definition) {
        let node = self.node;
        let entry = &mut self.entries[handle.0];
        (entry.definition, entry.is_hidden) = (definition, false);
        entry.stored = entry.default(node);
        entry.number = entry.stored;
    }

    /// Gives an entry another default, and that number.
    pub fn set_default(&mut self, handle: Handle, number: i64) {
        let entry = &mut self.entries[handle.0];
        let (low, high) = entry.definition.data_type.range();
        (entry.definition.default, entry.definition.adds_node) = (number.clamp(low, high), false);
        (entry.number, entry.stored) = (entry.definition.default, entry.definition.default);
    }

    /// The objects, ascending.
    #[must_use]
    pub fn objects(&self) -> &[Object] {
        &self.objects
    }

    /// The object with an index.
    #[must_use]
    pub fn object(&self, index: u16) -> Option<&Object> {
        let place = self.objects.binary_search_by_key(&index, |known| known.index).ok()?;
        self.objects.get(place)
    }

    /// The entries, ascending.
    #[must_use]
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// Where an entry is.
    #[must_use]
    pub fn find(&self, mux: Mux) -> Option<Handle> {
        self.keys.binary_search(&key(mux)).ok().map(Handle)
    }

    /// An entry by its place.
    #[must_use]
    pub fn entry(&self, handle: Handle) -> &Entry {
        &self.entries[handle.0]
    }

    /// The entry that a client asks for.
    ///
    /// # Errors
    /// No such object, or no such sub-index.
    pub fn look_up(&self, mux: Mux) -> Result<Handle, AbortCode> {
        let missing =
            if self.object(mux.index).is_some() { AbortCode::NO_SUB_INDEX } else { AbortCode::NO_OBJECT };
        self.find(mux).filter(|handle| !self.entries[handle.0].is_hidden).ok_or(missing)
    }

    /// The number of an entry; 0 when there is none.
    #[must_use]
    pub fn number(&self, index: u16, sub: u8) -> i64 {
        self.find(Mux::new(index, sub)).map_or(0, |handle| self.entries[handle.0].number)
    }

    /// Sets the number of an entry, held at the ends of its type; nothing happens when there is none.
    pub fn set(&mut self, index: u16, sub: u8, number: i64) {
        if let Some(handle) = self.find(Mux::new(index, sub)) {
            self.set_number(handle, number);
        }
    }

    /// Sets the number of an entry by its place, held at the ends of its type.
    pub fn set_number(&mut self, handle: Handle, number: i64) {
        let entry = &mut self.entries[handle.0];
        let (low, high) = entry.definition.data_type.range();
        let number = number.clamp(low, high);
        self.changed |= number != entry.number && !entry.definition.is_volatile;
        entry.number = number;
    }

    /// Sets the bytes of a text or a domain, as many as it can have.
    pub fn set_bytes(&mut self, handle: Handle, bytes: &[u8]) {
        let entry = &mut self.entries[handle.0];
        entry.bytes.clear();
        let kept = bytes.len().min(entry.bytes.capacity());
        entry.bytes.extend_from_slice(&bytes[..kept]);
    }

    /// Gives a text or a domain its content while the dictionary is built, however long it is.
    pub fn fill(&mut self, mux: Mux, bytes: &[u8]) {
        if let Some(handle) = self.find(mux) {
            self.entries[handle.0].bytes = bytes.to_vec();
        }
    }

    /// The same, with room for as many bytes as a client may write.
    pub fn fill_within(&mut self, mux: Mux, bytes: &[u8], capacity: usize) {
        if let Some(handle) = self.find(mux) {
            let mut content = Vec::with_capacity(capacity.max(bytes.len()));
            content.extend_from_slice(bytes);
            self.entries[handle.0].bytes = content;
        }
    }

    /// Whether a parameter has changed since the last call.
    pub fn take_changed(&mut self) -> bool {
        core::mem::take(&mut self.changed)
    }

    /// Stores the parameters of a group: a reset gives these numbers back.
    pub fn store(&mut self, group: Group) {
        let parameters = self.entries.iter_mut().filter(|entry| !entry.definition.is_volatile);
        for entry in parameters.filter(|entry| group.has(entry.mux.index)) {
            entry.stored = entry.number;
        }
    }

    /// Forgets what was stored of a group: a reset gives the defaults back.
    pub fn restore(&mut self, group: Group) {
        let node = self.node;
        for entry in self.entries.iter_mut().filter(|entry| group.has(entry.mux.index)) {
            entry.stored = entry.default(node);
        }
    }

    /// Gives all objects of a group the numbers that they have after power-on.
    pub fn reset(&mut self, group: Group) {
        for entry in self.entries.iter_mut().filter(|entry| group.has(entry.mux.index)) {
            entry.number = entry.stored;
        }
        self.changed = true;
    }

    /// The device has another node-id: identifiers that are the default move along, and so do stored ones.
    pub fn set_node(&mut self, node: Option<NodeId>) {
        let before = core::mem::replace(&mut self.node, node);
        for entry in self.entries.iter_mut().filter(|entry| entry.definition.adds_node) {
            let (old, new) = (entry.default(before), entry.default(node));
            for number in [&mut entry.number, &mut entry.stored] {
                if *number == old {
                    *number = new;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(number: u8) -> Option<NodeId> {
        NodeId::new(number).ok()
    }

    fn dictionary() -> Dictionary {
        let mut dictionary = Dictionary::new(node(5));
        dictionary.variable(0x6040, Definition::new("Controlword", DataType::U16, 0).volatile());
        dictionary.variable(0x1014, Definition::new("COB-ID EMCY", DataType::U32, 0x80).plus_node());
        let limit = Definition::new("Limit", DataType::I32, -7);
        dictionary.record(0x607D, "Software position limit", Shape::Array, &[Some(limit), None, Some(limit)]);
        dictionary.variable(0x2FFE, Definition::domain("Data", 4));
        dictionary
    }

    #[test]
    fn entries_are_found_and_absent_ones_say_what_is_missing() {
        let dictionary = dictionary();
        let look =
            |index, sub| dictionary.look_up(Mux::new(index, sub)).map(|at| dictionary.entry(at).number());
        assert_eq!(look(0x607D, 0), Ok(3));
        assert_eq!(look(0x607D, 3), Ok(-7));
        assert_eq!(look(0x607D, 2), Err(AbortCode::NO_SUB_INDEX));
        assert_eq!(look(0x6040, 1), Err(AbortCode::NO_SUB_INDEX));
        assert_eq!(look(0x6041, 0), Err(AbortCode::NO_OBJECT));
        assert!(dictionary.keys.is_sorted());
        assert_eq!(
            dictionary.objects().iter().map(|object| object.index).collect::<Vec<_>>(),
            [0x1014, 0x2FFE, 0x6040, 0x607D]
        );
    }

    #[test]
    fn numbers_are_held_at_the_ends_of_their_type() {
        let mut dictionary = dictionary();
        for (number, held) in [(70_000, 65_535), (-1, 0), (6, 6)] {
            dictionary.set(0x6040, 0, number);
            assert_eq!(dictionary.number(0x6040, 0), held);
        }
        dictionary.set(0x9999, 0, 1);
        assert_eq!(dictionary.number(0x9999, 0), 0);
    }

    #[test]
    fn parameters_come_back_as_they_were_stored_and_others_as_they_were_made() {
        let mut dictionary = dictionary();
        dictionary.set(0x607D, 1, 9);
        dictionary.set(0x6040, 0, 15);
        assert!(dictionary.take_changed() && !dictionary.take_changed());
        dictionary.store(Group::Communication);
        dictionary.reset(Group::All);
        assert_eq!((dictionary.number(0x607D, 1), dictionary.number(0x6040, 0)), (-7, 0));
        dictionary.set(0x607D, 1, 9);
        dictionary.store(Group::Application);
        dictionary.set(0x607D, 1, 10);
        dictionary.reset(Group::All);
        assert_eq!(dictionary.number(0x607D, 1), 9);
        dictionary.restore(Group::All);
        assert_eq!(dictionary.number(0x607D, 1), 9, "until the next reset");
        dictionary.reset(Group::All);
        assert_eq!(dictionary.number(0x607D, 1), -7);
    }

    #[test]
    fn default_identifiers_follow_the_node_id() {
        let mut dictionary = dictionary();
        assert_eq!(dictionary.number(0x1014, 0), 0x85);
        dictionary.set_node(node(9));
        assert_eq!(dictionary.number(0x1014, 0), 0x89);
        dictionary.set(0x1014, 0, 0x90);
        dictionary.set_node(node(5));
        assert_eq!(dictionary.number(0x1014, 0), 0x90, "somebody gave it this one");
    }

    #[test]
    fn bytes_never_grow_beyond_their_room() {
        let mut dictionary = dictionary();
        let handle = dictionary.find(Mux::new(0x2FFE, 0)).unwrap();
        dictionary.set_bytes(handle, &[1, 2, 3, 4, 5]);
        assert_eq!(dictionary.entry(handle).bytes(), [1, 2, 3, 4]);
    }
}
