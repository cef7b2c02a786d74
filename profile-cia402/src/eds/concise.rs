//! Concise device configuration: what object 1F22 holds for a node (CiA 302).
//!
//! | bytes | |
//! |---|---|
//! | 0-3 | number of entries |
//! | of each entry: 0-1 | index |
//! | 2 | sub-index |
//! | 3-6 | bytes of the value |
//! | 7- | the value |

use core::fmt;

use super::description::{DeviceDescription, Object, SubObject};
use super::drive::Direction;
use super::value::Value;
use crate::generated::objects;

/// Bytes in front of the value of an entry.
const HEAD: usize = 7;

/// Bit 31 of the COB-ID of a PDO: it does not exist.
const NOT_VALID: u32 = 1 << 31;

/// Bit 0 of `ObjFlags`: not to be written when a configuration is downloaded.
const NO_DOWNLOAD: u32 = 1;

/// One value to be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Entry<'b> {
    /// The object.
    pub index: u16,
    /// The sub-object.
    pub sub: u8,
    /// The value, little endian.
    pub data: &'b [u8],
}

impl fmt::Display for Entry<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04X}:{:X} =", self.index, self.sub)?;
        self.data.iter().try_for_each(|byte| write!(f, " {byte:02X}"))
    }
}

/// What is wrong with a concise configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ConciseError {
    /// It ends too early.
    #[error("byte {offset}: expected {expected} bytes more, got {got}")]
    Truncated {
        /// Where they are missing.
        offset: usize,
        /// Bytes that were expected.
        expected: u32,
        /// Bytes that there are.
        got: usize,
    },
    /// Something stands behind the last entry.
    #[error("byte {offset}: expected the end behind the last entry, got {bytes} bytes")]
    Trailing {
        /// Where it stands.
        offset: usize,
        /// How much.
        bytes: usize,
    },
}

/// Reads a concise configuration.
///
/// # Errors
/// [`ConciseError`].
pub fn parse(bytes: &[u8]) -> Result<Vec<Entry<'_>>, ConciseError> {
    let mut reader = Reader { bytes, offset: 0 };
    let count = reader.word()?;
    let mut entries = Vec::new();
    for _ in 0..count {
        let head = reader.take(3)?;
        let (index, sub) = (u16::from_le_bytes([head[0], head[1]]), head[2]);
        let length = reader.word()?;
        entries.push(Entry { index, sub, data: reader.take(length)? });
    }
    match bytes.len() - reader.offset {
        0 => Ok(entries),
        left => Err(ConciseError::Trailing { offset: reader.offset, bytes: left }),
    }
}

struct Reader<'b> {
    bytes: &'b [u8],
    offset: usize,
}

impl<'b> Reader<'b> {
    fn take(&mut self, length: u32) -> Result<&'b [u8], ConciseError> {
        let rest = self.bytes.get(self.offset..).unwrap_or_default();
        let wanted = usize::try_from(length).unwrap_or(usize::MAX);
        let taken = rest.get(..wanted).ok_or(ConciseError::Truncated {
            offset: self.offset,
            expected: length,
            got: rest.len(),
        })?;
        self.offset += wanted;
        Ok(taken)
    }

    fn word(&mut self) -> Result<u32, ConciseError> {
        let bytes = self.take(4)?;
        Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    }
}

/// Writes a concise configuration. Entries beyond 2^32 - 1, or longer, do not fit and are left out.
#[must_use]
pub fn emit<'b>(entries: impl IntoIterator<Item = Entry<'b>>) -> Vec<u8> {
    let mut bytes = vec![0; 4];
    let mut count = 0_u32;
    for entry in entries {
        let (Ok(length), Some(next)) = (u32::try_from(entry.data.len()), count.checked_add(1)) else {
            continue;
        };
        count = next;
        bytes.reserve(HEAD + entry.data.len());
        bytes.extend(entry.index.to_le_bytes());
        bytes.push(entry.sub);
        bytes.extend(length.to_le_bytes());
        bytes.extend(entry.data);
    }
    bytes[..4].copy_from_slice(&count.to_le_bytes());
    bytes
}

/// A value to be written, with its bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Write {
    /// The object.
    pub index: u16,
    /// The sub-object.
    pub sub: u8,
    /// The value, little endian.
    pub data: Vec<u8>,
}

impl Write {
    /// The entry that it is.
    #[must_use]
    pub fn entry(&self) -> Entry<'_> {
        Entry { index: self.index, sub: self.sub, data: &self.data }
    }
}

/// What a configuration writes, in the order that devices accept.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Configuration {
    /// What is written.
    pub writes: Vec<Write>,
    /// Objects with a value that cannot be written: read only, not to be downloaded, or of a type without bytes.
    pub left_out: Vec<(u16, u8)>,
}

impl Configuration {
    /// The concise configuration that it is.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        emit(self.writes.iter().map(Write::entry))
    }

    fn push(&mut self, object: &Object, value: &SubObject, node: u8) {
        let data = value.parameter.as_ref().and_then(|setting| setting.at(node)?.to_bytes(value.data_type));
        let written = data.filter(|_| {
            value.access.writes()
                && object.flags & NO_DOWNLOAD == 0
                && object.index != objects::RESTORE_DEFAULT_PARAMETERS
        });
        match written {
            Some(data) => self.writes.push(Write { index: object.index, sub: value.sub, data }),
            None => self.left_out.push((object.index, value.sub)),
        }
    }

    fn word(&mut self, index: u16, sub: u8, word: u32) {
        self.writes.push(Write { index, sub, data: word.to_le_bytes().to_vec() });
    }
}

impl DeviceDescription {
    /// What the values of a configuration (`ParameterValue`) write into a node, in the order that devices accept: PDOs are
    /// switched off before their mapping changes and on again behind it; storing comes last.
    #[must_use]
    pub fn configuration(&self, node: u8) -> Configuration {
        let mut configuration = Configuration::default();
        let set = |object: &Object| object.subs.iter().any(|value| value.parameter.is_some());
        let late = [objects::STORE_PARAMETERS, objects::VERIFY_CONFIGURATION];
        let is_pdo = |index: u16| (0x1400..=0x1BFF).contains(&index);
        let plain =
            self.objects.iter().filter(|object| !is_pdo(object.index) && !late.contains(&object.index));
        let mut plain_values = |objects: &mut dyn Iterator<Item = &Object>| {
            for object in objects {
                for value in object.subs.iter().filter(|value| value.parameter.is_some()) {
                    configuration.push(object, value, node);
                }
            }
        };
        plain_values(&mut { plain });
        for direction in Direction::BOTH {
            for communication in direction.communication() {
                let objects = [communication, communication + 0x200].map(|index| self.object(index));
                if objects.iter().flatten().any(|object| set(object)) {
                    self.pdo_configuration(objects, node, &mut configuration);
                }
            }
        }
        for object in [objects::VERIFY_CONFIGURATION, objects::STORE_PARAMETERS]
            .iter()
            .filter_map(|index| self.object(*index))
        {
            for value in object.subs.iter().filter(|value| value.parameter.is_some()) {
                configuration.push(object, value, node);
            }
        }
        configuration
    }

    /// Off, mapping (0, entries, count), the rest, on.
    fn pdo_configuration(&self, objects: [Option<&Object>; 2], node: u8, configuration: &mut Configuration) {
        let [communication, mapping] = objects;
        let identifier = communication.and_then(|object| object.sub(1)).filter(|value| value.access.writes());
        let word = identifier.and_then(|value| value.setting()?.at(node)?.as_u32());
        if let Some((object, word)) = communication.zip(word) {
            configuration.word(object.index, 1, word | NOT_VALID);
        }
        if let Some(object) = mapping {
            let count = object.sub(0).filter(|value| value.parameter.is_some());
            let entries: Vec<&SubObject> =
                object.subs.iter().filter(|value| value.sub > 0 && value.parameter.is_some()).collect();
            let writable = object.sub(0).is_some_and(|value| value.access.writes());
            let changes = count.is_some() || !entries.is_empty();
            if changes && writable {
                configuration.writes.push(Write { index: object.index, sub: 0, data: vec![0] });
            }
            for value in &entries {
                configuration.push(object, value, node);
            }
            match (count, object.sub(0)) {
                (Some(value), _) => configuration.push(object, value, node),
                // The count was cleared for the entries: it comes back as it was.
                (None, Some(value)) if changes && writable => {
                    let kept = value.default.as_ref().map(|setting| setting.value.clone());
                    let kept = kept.unwrap_or(Value::Unsigned(entries.len() as u64));
                    let data = kept.to_bytes(value.data_type).unwrap_or_default();
                    configuration.writes.push(Write { index: object.index, sub: 0, data });
                }
                _ => {}
            }
        }
        if let Some(object) = communication {
            let others = object.subs.iter().filter(|value| value.sub != 1 && value.parameter.is_some());
            for value in others {
                configuration.push(object, value, node);
            }
            if let Some(word) = word {
                configuration.word(object.index, 1, word);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (bytes, entries), made by the layout of the facts.
    const VECTORS: &[(&[u8], &[Entry<'static>])] = &[
        (&[0, 0, 0, 0], &[]),
        (
            &[2, 0, 0, 0, 0x17, 0x10, 0, 2, 0, 0, 0, 0xE8, 3, 0x60, 0x60, 0, 1, 0, 0, 0, 8],
            &[Entry { index: 0x1017, sub: 0, data: &[0xE8, 3] }, Entry { index: 0x6060, sub: 0, data: &[8] }],
        ),
    ];

    #[test]
    fn vectors_are_read_and_written() {
        for (bytes, entries) in VECTORS {
            assert_eq!(parse(bytes).as_deref(), Ok(*entries));
            assert_eq!(emit(entries.iter().copied()), *bytes);
        }
        assert_eq!(VECTORS[1].1[0].to_string(), "1017:0 = E8 03");
    }

    #[test]
    fn truncation_at_every_byte_is_an_error() {
        let bytes = VECTORS[1].0;
        for end in 0..bytes.len() {
            assert!(matches!(parse(&bytes[..end]), Err(ConciseError::Truncated { .. })), "{end}");
        }
        let longer = [bytes, &[0]].concat();
        assert_eq!(parse(&longer), Err(ConciseError::Trailing { offset: bytes.len(), bytes: 1 }));
        // No memory is taken for a count or a length that is not there.
        assert_eq!(
            parse(&[0xFF, 0xFF, 0xFF, 0xFF, 0, 0x10, 0, 0xFF, 0xFF, 0xFF, 0xFF]),
            Err(ConciseError::Truncated { offset: 11, expected: u32::MAX, got: 0 })
        );
    }

    proptest::proptest! {
        #[test]
        fn what_is_written_is_read(entries in proptest::collection::vec(
            (proptest::num::u16::ANY, proptest::num::u8::ANY, proptest::collection::vec(proptest::num::u8::ANY, 0..20)), 0..20)) {
            let made: Vec<Entry<'_>> =
                entries.iter().map(|(index, sub, data)| Entry { index: *index, sub: *sub, data }).collect();
            let bytes = emit(made.iter().copied());
            proptest::prop_assert_eq!(parse(&bytes), Ok(made));
        }

        #[test]
        fn no_bytes_make_it_panic(bytes in proptest::collection::vec(proptest::num::u8::ANY, 0..200)) {
            let _ = parse(&bytes);
        }
    }
}
