//! Identification numbers, and a parameter with its seven elements.

use std::collections::BTreeMap;
use std::fmt;

/// An identification number of 32 bits: instance, structure element, S or P, set, block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Idn(pub u32);

impl Idn {
    /// A standard parameter without structure: S-0-nnnn.
    #[must_use]
    pub const fn s(block: u32) -> Self {
        Self(block & 0xFFF)
    }

    /// A parameter of the maker without structure: P-0-nnnn.
    #[must_use]
    pub const fn p(block: u32) -> Self {
        Self(0x8000 | block & 0xFFF)
    }

    /// S-0-nnnn with structure instance and structure element.
    #[must_use]
    pub const fn se(block: u32, instance: u32, element: u32) -> Self {
        Self((instance & 0xFF) << 24 | (element & 0xFF) << 16 | block & 0xFFF)
    }

    /// The number of the data block.
    #[must_use]
    pub const fn block(self) -> u32 {
        self.0 & 0xFFF
    }

    /// The structure instance.
    #[must_use]
    pub const fn instance(self) -> u32 {
        self.0 >> 24
    }

    /// The structure element.
    #[must_use]
    pub const fn element(self) -> u32 {
        self.0 >> 16 & 0xFF
    }

    /// Reads "S-0-0036" or "S-0-1050.1.6".
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let (kind, rest) = text.split_once('-')?;
        let (set, rest) = rest.split_once('-')?;
        let mut numbers = rest.split('.');
        let block: u32 = numbers.next()?.parse().ok()?;
        let instance: u32 = numbers.next().unwrap_or("0").parse().ok()?;
        let element: u32 = numbers.next().unwrap_or("0").parse().ok()?;
        let set: u32 = set.parse().ok()?;
        if block > 4095 || instance > 255 || element > 255 || set > 7 || numbers.next().is_some() {
            return None;
        }
        let kind = match kind {
            "S" => 0,
            "P" => 0x8000,
            _ => return None,
        };
        Some(Self(instance << 24 | element << 16 | kind | set << 12 | block))
    }
}

impl fmt::Display for Idn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = if self.0 & 0x8000 == 0 { 'S' } else { 'P' };
        write!(f, "{kind}-{}-{:04}", self.0 >> 12 & 7, self.block())?;
        if self.0 >> 16 != 0 {
            write!(f, ".{}.{}", self.instance(), self.element())?;
        }
        Ok(())
    }
}

/// Write protection in CP2.
pub const NOT_CP2: u32 = 1 << 28;
/// Write protection in CP3.
pub const NOT_CP3: u32 = 1 << 29;
/// Write protection in CP4.
pub const NOT_CP4: u32 = 1 << 30;
/// Never written by the service channel.
pub const READ_ONLY: u32 = NOT_CP2 | NOT_CP3 | NOT_CP4;
/// Written in CP2 only.
pub const CP2_ONLY: u32 = NOT_CP3 | NOT_CP4;
/// Written in CP2 and CP3.
pub const CP23: u32 = NOT_CP4;

/// Two bytes, binary.
pub const BIN2: u32 = 0x0001_0001;
/// Two bytes, unsigned.
pub const UINT2: u32 = 0x0011_0001;
/// Two bytes, signed.
pub const INT2: u32 = 0x0021_0001;
/// Two bytes, hexadecimal.
pub const HEX2: u32 = 0x0031_0001;
/// Four bytes, unsigned.
pub const UINT4: u32 = 0x0012_0001;
/// Four bytes, signed.
pub const INT4: u32 = 0x0022_0001;
/// Four bytes, hexadecimal.
pub const HEX4: u32 = 0x0032_0001;
/// Eight bytes, signed.
pub const INT8: u32 = 0x0023_0001;
/// A text.
pub const TEXT: u32 = 0x0044_0001;
/// A list of words, hexadecimal.
pub const LIST2: u32 = 0x0035_0001;
/// A list of double words, unsigned.
pub const LIST4: u32 = 0x0016_0001;
/// A list of identification numbers of four bytes.
pub const IDN_LIST: u32 = 0x0056_0001;
/// A procedure command.
pub const COMMAND: u32 = 0x0009_0001;

/// Read-only whatever the phase.
pub const E_READ_ONLY: u16 = 4;
/// Write protected now.
pub const E_PROTECTED: u16 = 5;

/// A parameter. Its data are raw bytes; what they mean stands in the attribute.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parameter {
    /// Its number.
    pub idn: Idn,
    /// Element 2, bytes of Latin-1. None: the element is not there.
    pub name: Option<Vec<u8>>,
    /// Element 3.
    pub attribute: u32,
    /// Element 4. None: the element is not there.
    pub unit: Option<Vec<u8>>,
    /// Element 5. None: the element is not there.
    pub min: Option<Vec<u8>>,
    /// Element 6. None: the element is not there.
    pub max: Option<Vec<u8>>,
    /// Element 7. A list without its head.
    pub data: Vec<u8>,
    /// How many bytes a list may have.
    pub capacity: u16,
    /// False: the data are not valid yet, and the data status says so.
    pub valid: bool,
}

impl Parameter {
    /// A parameter with a name and data; everything else is left out.
    #[must_use]
    pub fn new(idn: Idn, name: &str, attribute: u32, data: &[u8]) -> Self {
        Self {
            idn,
            name: Some(name.as_bytes().to_vec()),
            attribute,
            unit: None,
            min: None,
            max: None,
            data: data.to_vec(),
            capacity: u16::try_from(data.len()).unwrap_or(65532).max(64),
            valid: true,
        }
    }

    /// With a unit, bytes of Latin-1.
    #[must_use]
    pub fn unit(mut self, unit: &[u8]) -> Self {
        self.unit = Some(unit.to_vec());
        self
    }

    /// With a smallest and a largest value.
    #[must_use]
    pub fn range(mut self, min: &[u8], max: &[u8]) -> Self {
        self.min = Some(min.to_vec());
        self.max = Some(max.to_vec());
        self
    }

    /// A list or a text.
    #[must_use]
    pub fn is_list(&self) -> bool {
        self.attribute & 0x0004_0000 != 0
    }

    /// A procedure command.
    #[must_use]
    pub fn is_command(&self) -> bool {
        self.attribute & 0x0008_0000 != 0
    }

    /// The bytes of the value, or of one element of the list.
    #[must_use]
    pub fn width(&self) -> usize {
        match (self.attribute >> 16 & 7, self.is_list()) {
            (0 | 4, _) => 1,
            (2 | 6, _) => 4,
            (3 | 7, _) => 8,
            _ => 2,
        }
    }

    /// May the service channel write it in this phase? The code says why not.
    ///
    /// # Errors
    /// The low digit of the error code of the service channel.
    pub fn may_write(&self, phase: u8) -> Result<(), u16> {
        if self.attribute & READ_ONLY == READ_ONLY {
            return Err(E_READ_ONLY);
        }
        let protected = match phase {
            2 => NOT_CP2,
            3 => NOT_CP3,
            4 => NOT_CP4,
            _ => READ_ONLY,
        };
        if self.attribute & protected != 0 { Err(E_PROTECTED) } else { Ok(()) }
    }

    /// Checks new data: length, and the range where there is one.
    ///
    /// # Errors
    /// The error code of the service channel.
    pub fn check(&self, data: &[u8]) -> Result<(), u16> {
        if self.is_list() {
            if data.len() > usize::from(self.capacity) {
                return Err(0x7003);
            }
            return if data.len().is_multiple_of(self.width()) { Ok(()) } else { Err(0x7008) };
        }
        match data.len() {
            n if n < self.width() => return Err(0x7002),
            n if n > self.width() => return Err(0x7003),
            _ => {}
        }
        let signed = self.attribute >> 20 & 7 == 2;
        let value = number(data, signed);
        if self.min.as_deref().is_some_and(|min| value < number(min, signed)) {
            return Err(0x7006);
        }
        if self.max.as_deref().is_some_and(|max| value > number(max, signed)) {
            return Err(0x7007);
        }
        Ok(())
    }
}

/// A little-endian number of up to eight bytes.
#[must_use]
pub fn number(bytes: &[u8], signed: bool) -> i128 {
    let mut value: i128 = 0;
    for byte in bytes.iter().take(8).rev() {
        value = value << 8 | i128::from(*byte);
    }
    let negative = bytes.iter().take(8).next_back().is_some_and(|top| top & 0x80 != 0);
    if signed && negative {
        value -= 1 << (8 * bytes.len().min(8));
    }
    value
}

/// All parameters of a device.
#[derive(Debug, Clone, Default)]
pub struct Table {
    entries: BTreeMap<Idn, Parameter>,
}

impl Table {
    /// Puts a parameter in, over an older one with its number.
    pub fn add(&mut self, parameter: Parameter) {
        self.entries.insert(parameter.idn, parameter);
    }

    /// Takes a parameter away.
    pub fn remove(&mut self, idn: Idn) {
        self.entries.remove(&idn);
    }

    /// A parameter.
    #[must_use]
    pub fn get(&self, idn: Idn) -> Option<&Parameter> {
        self.entries.get(&idn)
    }

    /// A parameter to change.
    pub fn get_mut(&mut self, idn: Idn) -> Option<&mut Parameter> {
        self.entries.get_mut(&idn)
    }

    /// All numbers, in order.
    pub fn numbers(&self) -> impl Iterator<Item = Idn> + '_ {
        self.entries.keys().copied()
    }

    /// All parameters, in order of their numbers.
    pub fn all(&self) -> impl Iterator<Item = &Parameter> + '_ {
        self.entries.values()
    }

    /// The data as an unsigned number; 0 for what is not there.
    #[must_use]
    pub fn unsigned(&self, idn: Idn) -> u32 {
        self.get(idn).and_then(|p| u32::try_from(number(&p.data, false)).ok()).unwrap_or(0)
    }

    /// The data as a word; 0 for what is not there.
    #[must_use]
    pub fn word(&self, idn: Idn) -> u16 {
        u16::try_from(self.unsigned(idn) & 0xFFFF).unwrap_or(0)
    }

    /// The data as a signed number; 0 for what is not there.
    #[must_use]
    pub fn signed(&self, idn: Idn) -> i64 {
        self.get(idn).and_then(|p| i64::try_from(number(&p.data, true)).ok()).unwrap_or(0)
    }

    /// The data as a list of words.
    #[must_use]
    pub fn words(&self, idn: Idn) -> Vec<u16> {
        let Some(parameter) = self.get(idn) else { return Vec::new() };
        parameter.data.chunks_exact(2).filter_map(|c| c.try_into().ok()).map(u16::from_le_bytes).collect()
    }

    /// The data as a list of identification numbers.
    #[must_use]
    pub fn idns(&self, idn: Idn) -> Vec<Idn> {
        let Some(parameter) = self.get(idn) else { return Vec::new() };
        let quads = parameter.data.chunks_exact(4).filter_map(|c| c.try_into().ok());
        quads.map(|c| Idn(u32::from_le_bytes(c))).collect()
    }

    /// Replaces the data of a parameter that is there, from inside: nothing is checked.
    pub fn set(&mut self, idn: Idn, data: &[u8]) {
        if let Some(parameter) = self.entries.get_mut(&idn) {
            parameter.data.clear();
            parameter.data.extend_from_slice(data);
            parameter.valid = true;
        }
    }

    /// Replaces the data by a signed number, held to the width of the parameter.
    pub fn set_signed(&mut self, idn: Idn, value: i64) {
        if let Some(parameter) = self.entries.get_mut(&idn) {
            let width = parameter.width().min(8);
            let bits = u32::try_from(8 * width - 1).unwrap_or(63);
            let top = i64::MAX >> (63 - bits);
            let bytes = value.clamp(-top - 1, top).to_le_bytes();
            parameter.data.clear();
            parameter.data.extend_from_slice(&bytes[..width]);
        }
    }

    /// Replaces the data by a list of identification numbers.
    pub fn set_idns(&mut self, idn: Idn, list: &[Idn]) {
        let bytes: Vec<u8> = list.iter().flat_map(|i| i.0.to_le_bytes()).collect();
        self.set(idn, &bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_packed_as_on_the_wire() {
        assert_eq!(Idn::se(1302, 0, 1).0, 0x0001_0516);
        assert_eq!(Idn::se(1050, 1, 3).0, 0x0103_041A);
        assert_eq!(Idn::p(12).0, 0x800C);
        assert_eq!(Idn::parse("S-0-1050.1.3"), Some(Idn(0x0103_041A)));
        assert_eq!(Idn::parse("P-0-0012").map(|i| i.to_string()), Some("P-0-0012".to_owned()));
        assert_eq!(Idn::s(36).to_string(), "S-0-0036");
        assert_eq!(Idn::se(1050, 0, 6).to_string(), "S-0-1050.0.6");
        for text in ["", "S", "S-0", "S-0-", "X-0-1", "S-8-1", "S-0-4096", "S-0-1.256", "S-0-1.1.1.1"] {
            assert_eq!(Idn::parse(text), None, "{text}");
        }
    }

    #[test]
    fn numbers_keep_their_sign() {
        assert_eq!(number(&[0xFF, 0xFF], true), -1);
        assert_eq!(number(&[0xFF, 0xFF], false), 65535);
        assert_eq!(number(&[0, 0, 0, 0x80], true), -2_147_483_648);
        assert_eq!(number(&[0xFF; 8], true), -1);
        assert_eq!(number(&[], true), 0);
    }

    #[test]
    fn a_value_is_held_to_its_length_and_range() {
        let p = Parameter::new(Idn::s(1), "x", INT2, &[0, 0]).range(&[0xFE, 0xFF], &[5, 0]);
        assert_eq!(p.check(&[1]), Err(0x7002));
        assert_eq!(p.check(&[1, 0, 0]), Err(0x7003));
        assert_eq!(p.check(&[0xFD, 0xFF]), Err(0x7006));
        assert_eq!(p.check(&[6, 0]), Err(0x7007));
        assert_eq!(p.check(&[0xFE, 0xFF]), Ok(()));
        let list = Parameter { capacity: 8, ..Parameter::new(Idn::s(2), "l", IDN_LIST, &[]) };
        assert_eq!(list.check(&[0; 6]), Err(0x7008));
        assert_eq!(list.check(&[0; 12]), Err(0x7003));
        assert_eq!(list.check(&[0; 8]), Ok(()));
    }

    #[test]
    fn the_attribute_says_the_width_and_the_phases() {
        let widths = [(BIN2, 2), (UINT4, 4), (INT8, 8), (TEXT, 1), (LIST2, 2), (IDN_LIST, 4)];
        for (attribute, width) in widths {
            assert_eq!(Parameter::new(Idn::s(1), "", attribute, &[]).width(), width, "{attribute:x}");
        }
        let p = Parameter::new(Idn::s(32), "", BIN2 | CP23, &[0, 0]);
        assert_eq!((p.may_write(2), p.may_write(3), p.may_write(4)), (Ok(()), Ok(()), Err(5)));
        assert_eq!(Parameter::new(Idn::s(51), "", INT4 | READ_ONLY, &[0; 4]).may_write(2), Err(4));
    }

    #[test]
    fn a_table_holds_numbers_to_their_width() {
        let mut table = Table::default();
        table.add(Parameter::new(Idn::s(84), "t", INT2, &[0, 0]));
        table.set_signed(Idn::s(84), 100_000);
        assert_eq!(table.signed(Idn::s(84)), 32767);
        table.set_signed(Idn::s(84), -100_000);
        assert_eq!(table.signed(Idn::s(84)), -32768);
        assert_eq!(table.word(Idn::s(84)), 0x8000);
        assert_eq!(table.unsigned(Idn::s(1)), 0);
    }
}
