//! Multiple_Service_Packet (0x0A): several requests, or several replies, in one message.
//!
//! | offset | size | field |
//! |---|---|---|
//! | 0 | 2 | count n |
//! | 2 | 2n | offset of each embedded message from the start of the count |
//! | 2 + 2n | | the messages |
//!
//! A message ends where the next one begins, the last one at the end of the data. Messages start behind the
//! offsets and follow each other in the order of the list.

use super::encapsulation::length_u16;
use super::{Error, Reader, Writer};

/// The embedded messages, offsets checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MultipleService<'a> {
    bytes: &'a [u8],
    count: u16,
}

impl<'a> MultipleService<'a> {
    /// Checks count and offsets.
    ///
    /// # Errors
    /// [`Error::truncated`] if the list does not fit the data; [`Error::invalid`] for an offset into the
    /// list, before its predecessor, or past the end.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        let mut r = Reader::new(bytes);
        let count = r.u16("service count")?;
        let mut offsets = Reader::new(r.take("service offsets", 2 * usize::from(count))?);
        let mut lowest = length_u16("services", r.offset())?;
        for n in 0..usize::from(count) {
            let found = offsets.u16("service offset")?;
            if found < lowest || usize::from(found) > bytes.len() {
                let (offset, found, expected) = (2 + 2 * n, u32::from(found), u32::from(lowest));
                return Err(Error::invalid("service offset", offset, expected, found));
            }
            lowest = found;
        }
        Ok(Self { bytes, count })
    }

    /// How many messages there are.
    pub const fn len(&self) -> u16 {
        self.count
    }

    /// Whether there is none.
    pub const fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The message number `n`, counted from 0.
    pub fn get(&self, n: u16) -> Option<&'a [u8]> {
        if n >= self.count {
            return None;
        }
        let start = self.offset(n)?;
        let end = if n + 1 == self.count { self.bytes.len() } else { self.offset(n + 1)? };
        self.bytes.get(start..end)
    }

    fn offset(&self, n: u16) -> Option<usize> {
        let at = 2 + 2 * usize::from(n);
        let word = self.bytes.get(at..at + 2)?;
        Some(usize::from(u16::from_le_bytes([word[0], word[1]])))
    }

    /// The messages in their order.
    pub fn iter(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let all = *self;
        (0..all.count).filter_map(move |n| all.get(n))
    }
}

/// Bytes of a packet with these messages.
pub fn buffer_len(messages: &[&[u8]]) -> usize {
    2 + messages.iter().map(|message| 2 + message.len()).sum::<usize>()
}

/// Writes a packet with these messages and returns its length.
///
/// # Errors
/// [`Error::truncated`]; [`Error::too_large`] if an offset exceeds 65535.
pub fn emit(messages: &[&[u8]], buffer: &mut [u8]) -> Result<usize, Error> {
    let mut w = Writer::new(buffer);
    w.u16("service count", length_u16("service count", messages.len())?)?;
    let mut at = 2 + 2 * messages.len();
    for message in messages {
        w.u16("service offset", length_u16("service offset", at)?)?;
        at += message.len();
    }
    for message in messages {
        w.slice("service", message)?;
    }
    Ok(w.written())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const A: &[u8] = &[0x0E, 3, 0x20, 1, 0x24, 1, 0x30, 1];
    const B: &[u8] = &[0x01, 2, 0x20, 1, 0x24, 1];
    #[rustfmt::skip]
    const BOTH: &[u8] = &[2, 0, 6, 0, 14, 0, 0x0E, 3, 0x20, 1, 0x24, 1, 0x30, 1, 0x01, 2, 0x20, 1, 0x24, 1];

    #[test]
    fn vectors_both_ways() {
        let packet = MultipleService::parse(BOTH).unwrap();
        assert_eq!(packet.iter().collect::<Vec<_>>(), [A, B]);
        assert_eq!((packet.len(), packet.is_empty(), packet.get(2)), (2, false, None));
        assert_eq!(buffer_len(&[A, B]), BOTH.len());
        let mut buffer = [0xA5; 24];
        assert_eq!(emit(&[A, B], &mut buffer), Ok(BOTH.len()));
        assert_eq!(&buffer[..BOTH.len()], BOTH);
        assert_eq!(&buffer[BOTH.len()..], [0xA5; 4]);
        for cut in 0..BOTH.len() {
            assert!(emit(&[A, B], &mut buffer[..cut]).is_err());
            let messages =
                MultipleService::parse(&BOTH[..cut]).map(|packet| packet.iter().collect::<Vec<_>>());
            if cut < 14 {
                assert!(messages.is_err(), "cut at {cut}");
            } else {
                assert_eq!(messages, Ok(vec![A, &B[..cut - 14]]));
            }
        }
    }

    #[test]
    fn offsets_that_lead_astray_are_refused() {
        for (at, to, expected) in [(2, 5, 6), (2, 21, 6), (4, 5, 6), (4, 255, 6)] {
            let mut bytes = BOTH.to_vec();
            bytes[at] = to;
            let found = u32::from(to);
            assert_eq!(
                MultipleService::parse(&bytes),
                Err(Error::invalid("service offset", at, expected, found))
            );
        }
        assert_eq!(
            MultipleService::parse(&[0xFF, 0xFF, 0, 0]),
            Err(Error::truncated("service offsets", 2, 131_070, 2))
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn round_trip(messages in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..20), 0..10)) {
            let messages: Vec<&[u8]> = messages.iter().map(Vec::as_slice).collect();
            let mut buffer = vec![0xA5; buffer_len(&messages)];
            prop_assert_eq!(emit(&messages, &mut buffer), Ok(buffer.len()));
            let packet = MultipleService::parse(&buffer).unwrap();
            prop_assert_eq!(packet.iter().collect::<Vec<_>>(), messages);
        }

        #[test]
        fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..40), count in 0u8..6) {
            let mut bytes = bytes;
            if bytes.len() > 1 { bytes[0] = count; bytes[1] = 0; }
            if let Ok(packet) = MultipleService::parse(&bytes) {
                prop_assert_eq!(packet.iter().count(), usize::from(packet.len()));
            }
        }
    }
}
