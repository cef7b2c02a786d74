//! The object dictionary: entries with their bytes, and who may do what with them.

use std::collections::BTreeMap;

use super::settings::Settings;

/// Abort codes of the SDO protocol.
pub mod abort {
    /// The toggle bit did not alternate.
    pub const TOGGLE: u32 = 0x0503_0000;
    /// The command specifier is not known or not expected.
    pub const COMMAND: u32 = 0x0504_0001;
    /// A block size that cannot be.
    pub const BLOCK_SIZE: u32 = 0x0504_0002;
    /// A wrong sequence number.
    pub const SEQUENCE: u32 = 0x0504_0003;
    /// A wrong CRC.
    pub const CRC: u32 = 0x0504_0004;
    /// No room.
    pub const MEMORY: u32 = 0x0504_0005;
    /// The object cannot be read.
    pub const WRITE_ONLY: u32 = 0x0601_0001;
    /// The object cannot be written.
    pub const READ_ONLY: u32 = 0x0601_0002;
    /// No such object.
    pub const NO_OBJECT: u32 = 0x0602_0000;
    /// The object does not go into this PDO.
    pub const NOT_MAPPABLE: u32 = 0x0604_0041;
    /// The PDO would be too long.
    pub const PDO_LENGTH: u32 = 0x0604_0042;
    /// Parameters do not fit together.
    pub const INCOMPATIBLE: u32 = 0x0604_0043;
    /// The hardware failed.
    pub const HARDWARE: u32 = 0x0606_0000;
    /// The length does not match.
    pub const LENGTH: u32 = 0x0607_0010;
    /// Too long.
    pub const TOO_LONG: u32 = 0x0607_0012;
    /// No such sub-index.
    pub const NO_SUB: u32 = 0x0609_0011;
    /// A value that is not allowed.
    pub const VALUE: u32 = 0x0609_0030;
    /// Above the highest value.
    pub const TOO_HIGH: u32 = 0x0609_0031;
    /// Below the lowest value.
    pub const TOO_LOW: u32 = 0x0609_0032;
    /// Cannot be stored.
    pub const STORE: u32 = 0x0800_0020;
    /// Not in this state of the device.
    pub const STATE: u32 = 0x0800_0022;
    /// No data.
    pub const NO_DATA: u32 = 0x0800_0024;
}

/// Who may do what with an entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// Never changes.
    Const,
    /// Read only.
    Ro,
    /// Read and write.
    Rw,
    /// Write only.
    Wo,
}

/// Which PDOs take an entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mappable {
    /// None.
    No,
    /// RPDOs.
    Rx,
    /// TPDOs.
    Tx,
    /// Both.
    Both,
}

/// The type of an entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// UNSIGNED8.
    U8,
    /// INTEGER8.
    I8,
    /// UNSIGNED16.
    U16,
    /// INTEGER16.
    I16,
    /// UNSIGNED32.
    U32,
    /// INTEGER32.
    I32,
    /// VISIBLE_STRING.
    Text,
}

impl Kind {
    /// Bytes of a value; none for text.
    #[must_use]
    pub fn width(self) -> Option<usize> {
        match self {
            Kind::U8 | Kind::I8 => Some(1),
            Kind::U16 | Kind::I16 => Some(2),
            Kind::U32 | Kind::I32 => Some(4),
            Kind::Text => None,
        }
    }

    /// Whether the value has a sign.
    #[must_use]
    pub fn signed(self) -> bool {
        matches!(self, Kind::I8 | Kind::I16 | Kind::I32)
    }
}

/// One entry.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Its type.
    pub kind: Kind,
    /// Its bytes, little endian.
    pub data: Vec<u8>,
    /// Who may do what.
    pub access: Access,
    /// Which PDOs take it.
    pub map: Mappable,
    /// Lowest and highest value of a download.
    pub limits: Option<(i64, i64)>,
}

impl Entry {
    /// The value as a number; 0 for text.
    #[must_use]
    pub fn int(&self) -> i64 {
        match self.kind.width() {
            Some(_) => number(&self.data, self.kind.signed()),
            None => 0,
        }
    }
}

/// A number from little endian bytes, at most eight.
#[must_use]
pub fn number(data: &[u8], signed: bool) -> i64 {
    let minus = signed && data.last().is_some_and(|top| top & 0x80 != 0);
    let mut bytes = [if minus { 0xFF } else { 0 }; 8];
    for (to, from) in bytes.iter_mut().zip(data) {
        *to = *from;
    }
    i64::from_le_bytes(bytes)
}

/// The low 16 bits of a number.
#[must_use]
pub fn word(value: i64) -> u16 {
    let [a, b, ..] = value.to_le_bytes();
    u16::from_le_bytes([a, b])
}

/// The low 32 bits of a number.
#[must_use]
pub fn long(value: i64) -> u32 {
    let [a, b, c, d, ..] = value.to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}

/// The low 8 bits of a number.
#[must_use]
pub fn byte(value: i64) -> u8 {
    value.to_le_bytes()[0]
}

/// The object dictionary. The drive itself uses the indices of axis 0; `wire` methods take those of the bus.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Dictionary {
    entries: BTreeMap<(u16, u8), Entry>,
    offset: u16,
}

impl Dictionary {
    /// The dictionary of a drive at delivery.
    #[must_use]
    pub fn new(settings: &Settings) -> Self {
        let mut od = Self { entries: BTreeMap::new(), offset: settings.axis_offset };
        super::objects::fill(&mut od, settings);
        for (index, sub, value) in &settings.values {
            od.set(*index, *sub, *value);
        }
        for (index, sub) in &settings.read_only {
            od.change(*index, *sub, |entry| entry.access = Access::Ro);
        }
        for (index, sub) in &settings.write_only {
            od.change(*index, *sub, |entry| entry.access = Access::Wo);
        }
        for index in &settings.not_mappable {
            let place = od.place(*index);
            for entry in od.entries.iter_mut().filter(|((at, _), _)| *at == place) {
                entry.1.map = Mappable::No;
            }
        }
        for (index, sub) in &settings.missing {
            let place = od.place(*index);
            od.entries.retain(|(at, at_sub), _| *at != place || sub.is_some_and(|sub| sub != *at_sub));
        }
        od
    }

    /// The index on the bus.
    #[must_use]
    pub fn place(&self, index: u16) -> u16 {
        if (0x6000..=0x67FF).contains(&index) { index.wrapping_add(self.offset) } else { index }
    }

    /// The index of axis 0 for one of the bus.
    #[must_use]
    pub fn inner(&self, index: u16) -> u16 {
        let back = index.wrapping_sub(self.offset);
        if index >= 0x6000 && (0x6000..=0x67FF).contains(&back) { back } else { index }
    }

    /// Adds an entry.
    pub fn put(&mut self, index: u16, sub: u8, entry: Entry) {
        let place = self.place(index);
        self.entries.insert((place, sub), entry);
    }

    /// Takes a whole object away.
    pub fn remove(&mut self, index: u16) {
        let place = self.place(index);
        self.entries.retain(|(at, _), _| *at != place);
    }

    fn change(&mut self, index: u16, sub: u8, with: impl FnOnce(&mut Entry)) {
        let place = self.place(index);
        if let Some(entry) = self.entries.get_mut(&(place, sub)) {
            with(entry);
        }
    }

    /// An entry by the index of the bus, or why there is none.
    ///
    /// # Errors
    /// 06020000 or 06090011.
    pub fn wire(&self, index: u16, sub: u8) -> Result<&Entry, u32> {
        if let Some(entry) = self.entries.get(&(index, sub)) {
            return Ok(entry);
        }
        let any = self.entries.range((index, 0)..=(index, 255)).next().is_some();
        Err(if any { abort::NO_SUB } else { abort::NO_OBJECT })
    }

    /// Whether the drive has this object.
    #[must_use]
    pub fn has(&self, index: u16, sub: u8) -> bool {
        self.entries.contains_key(&(self.place(index), sub))
    }

    /// A value; 0 if the object is not there.
    #[must_use]
    pub fn int(&self, index: u16, sub: u8) -> i64 {
        self.entries.get(&(self.place(index), sub)).map_or(0, Entry::int)
    }

    /// A value, or another one if the object is not there.
    #[must_use]
    pub fn int_or(&self, index: u16, sub: u8, other: i64) -> i64 {
        self.entries.get(&(self.place(index), sub)).map_or(other, Entry::int)
    }

    /// Sets a value; nothing happens if the object is not there.
    pub fn set(&mut self, index: u16, sub: u8, value: i64) {
        self.change(index, sub, |entry| {
            if let Some(width) = entry.kind.width() {
                entry.data.clear();
                entry.data.extend_from_slice(&value.to_le_bytes()[..width]);
            }
        });
    }

    /// Sets the bytes of an entry by the index of the bus.
    pub fn set_wire(&mut self, index: u16, sub: u8, data: &[u8]) {
        if let Some(entry) = self.entries.get_mut(&(index, sub)) {
            entry.data.clear();
            entry.data.extend_from_slice(data);
        }
    }

    /// Checks what holds for every download: existence, access, length, limits.
    ///
    /// # Errors
    /// The abort code.
    pub fn check(&self, index: u16, sub: u8, data: &[u8]) -> Result<(), u32> {
        let entry = self.wire(index, sub)?;
        if matches!(entry.access, Access::Const | Access::Ro) {
            return Err(abort::READ_ONLY);
        }
        match entry.kind.width() {
            Some(width) if width != data.len() => return Err(abort::LENGTH),
            None if data.len() > 64 => return Err(abort::TOO_LONG),
            _ => {}
        }
        if let Some((low, high)) = entry.limits {
            let value = number(data, entry.kind.signed());
            if value > high {
                return Err(abort::TOO_HIGH);
            }
            if value < low {
                return Err(abort::TOO_LOW);
            }
        }
        Ok(())
    }

    /// Puts entries with these indices back to how they are in another dictionary.
    pub fn restore(&mut self, from: &Dictionary, first: u16, last: u16) {
        for (key, entry) in from.entries.range((first, 0)..=(last, 255)) {
            self.entries.insert(*key, entry.clone());
        }
    }
}
