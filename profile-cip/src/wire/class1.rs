//! The datagram of a class 1 connection on UDP.
//!
//! | offset | size | field |
//! |---|---|---|
//! | 0 | 2 | item count, 2 |
//! | 2 | 4 | item 0x8002, length 8 |
//! | 6 | 4 | connection ID |
//! | 10 | 4 | encapsulation sequence number, one more in every datagram |
//! | 14 | 4 | item 0x00B1, length |
//! | 18 | 2 | sequence count of the connection data |
//! | 20 | | connection data |
//!
//! The connection size negotiated by the Forward_Open counts the sequence count and the data.

use super::cpf::ItemType;
use super::encapsulation::length_u16;
use super::{Error, Reader, Writer};
use core::fmt;

/// Bytes in front of the connection data.
pub const CLASS1_HEADER_LEN: usize = 20;

/// Where the connection ID stands, 4 bytes, low byte first.
pub const CONNECTION_ID_OFFSET: usize = 6;

/// Bytes of the sequence count, which the connection size includes.
pub const SEQUENCE_COUNT_LEN: usize = 2;

/// A datagram of a class 1 connection: sequenced address item and connected data item.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Class1Datagram<'a> {
    /// Connection ID of this direction.
    pub connection_id: u32,
    /// Encapsulation sequence number: tells datagrams that were overtaken or doubled.
    pub encapsulation_sequence: u32,
    /// Sequence count of the connection data: tells repeated data.
    pub sequence_count: u16,
    /// The connection data behind the sequence count.
    pub data: &'a [u8],
}

impl<'a> Class1Datagram<'a> {
    /// Reads exactly one datagram.
    ///
    /// # Errors
    /// [`Error::truncated`], [`Error::trailing`], [`Error::invalid`] for other items or counts.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        let mut r = Reader::new(bytes);
        expect(&mut r, "item count", 2)?;
        expect(&mut r, "address item type", ItemType::SEQUENCED_ADDRESS.0)?;
        expect(&mut r, "address item length", 8)?;
        let connection_id = r.u32("connection ID")?;
        let encapsulation_sequence = r.u32("encapsulation sequence number")?;
        expect(&mut r, "data item type", ItemType::CONNECTED_DATA.0)?;
        let length = r.u16("data item length")?;
        let mut item = Reader::new(r.take("data item", usize::from(length))?);
        let sequence_count = item.u16("sequence count")?;
        r.finish("class 1 datagram")?;
        Ok(Self { connection_id, encapsulation_sequence, sequence_count, data: item.rest() })
    }

    /// Header and data in bytes.
    pub const fn buffer_len(&self) -> usize {
        CLASS1_HEADER_LEN + self.data.len()
    }

    /// Writes the datagram and returns its length.
    ///
    /// # Errors
    /// [`Error::truncated`]; [`Error::too_large`] for more than 65533 bytes of data.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        Self::emit_header(
            self.connection_id,
            self.encapsulation_sequence,
            self.sequence_count,
            self.data.len(),
            buffer,
        )?;
        let mut w = Writer::new(buffer);
        w.reserve("class 1 header", CLASS1_HEADER_LEN)?;
        w.slice("connection data", self.data)?;
        Ok(w.written())
    }

    /// Writes only the header for `data_len` bytes of connection data, which the caller has put or will put
    /// at [`CLASS1_HEADER_LEN`].
    ///
    /// # Errors
    /// As [`Class1Datagram::emit`].
    pub fn emit_header(
        connection_id: u32,
        encapsulation_sequence: u32,
        sequence_count: u16,
        data_len: usize,
        buffer: &mut [u8],
    ) -> Result<(), Error> {
        let mut w = Writer::new(buffer);
        w.u16("item count", 2)?;
        w.u16("address item type", ItemType::SEQUENCED_ADDRESS.0)?;
        w.u16("address item length", 8)?;
        w.u32("connection ID", connection_id)?;
        w.u32("encapsulation sequence number", encapsulation_sequence)?;
        w.u16("data item type", ItemType::CONNECTED_DATA.0)?;
        w.u16(
            "data item length",
            length_u16("connection data", data_len.saturating_add(SEQUENCE_COUNT_LEN))?,
        )?;
        w.u16("sequence count", sequence_count)
    }
}

fn expect(r: &mut Reader<'_>, what: &'static str, expected: u16) -> Result<(), Error> {
    let offset = r.offset();
    let found = r.u16(what)?;
    if found == expected {
        return Ok(());
    }
    Err(Error::invalid(what, offset, u32::from(expected), u32::from(found)))
}

impl fmt::Display for Class1Datagram<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "connection {:#010x} number {} count {} with {} bytes",
            self.connection_id,
            self.encapsulation_sequence,
            self.sequence_count,
            self.data.len()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::wire::check::check_vectors;
    use proptest::prelude::*;

    const INITIAL: Class1Datagram<'static> = Class1Datagram {
        connection_id: 0x1122_3344,
        encapsulation_sequence: 7,
        sequence_count: 3,
        data: &[6, 2, 0, 1, 0, 0, 0, 0],
    };

    #[rustfmt::skip]
    const INITIAL_BYTES: &[u8] = &[
        2, 0, 0x02, 0x80, 8, 0, 0x44, 0x33, 0x22, 0x11, 7, 0, 0, 0, 0xB1, 0, 10, 0, 3, 0,
        6, 2, 0, 1, 0, 0, 0, 0,
    ];

    #[test]
    fn vectors_both_ways() {
        // Connection data: the first controller-to-device packet, Volume 9 clause 7-1.1.
        let vectors: &[(&str, &[u8], Class1Datagram)] = &[("initial packet", INITIAL_BYTES, INITIAL)];
        check_vectors!(vectors, Class1Datagram);
    }

    #[test]
    fn other_items_are_refused() {
        for (offset, what, expected) in [
            (0, "item count", 2),
            (2, "address item type", 0x8002),
            (4, "address item length", 8),
            (14, "data item type", 0x00B1),
        ] {
            let mut bytes = INITIAL_BYTES.to_vec();
            bytes[offset] ^= 0x40;
            let found = expected ^ 0x40;
            assert_eq!(Class1Datagram::parse(&bytes), Err(Error::invalid(what, offset, expected, found)));
        }
    }

    #[test]
    fn a_data_item_too_short_for_the_sequence_count_is_refused() {
        let mut bytes = INITIAL_BYTES[..19].to_vec();
        bytes[16] = 1;
        assert_eq!(Class1Datagram::parse(&bytes), Err(Error::truncated("sequence count", 0, 2, 1)));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn round_trip(connection_id: u32, encapsulation_sequence: u32, sequence_count: u16,
                      data in prop::collection::vec(any::<u8>(), 0..300)) {
            let value = Class1Datagram { connection_id, encapsulation_sequence, sequence_count, data: &data };
            let mut buffer = vec![0xA5; value.buffer_len()];
            prop_assert_eq!(value.emit(&mut buffer), Ok(value.buffer_len()));
            prop_assert_eq!(Class1Datagram::parse(&buffer), Ok(value));
        }

        #[test]
        fn changed_bytes_never_panic(at in 0..INITIAL_BYTES.len(), to: u8, cut in 0..=INITIAL_BYTES.len()) {
            let mut bytes = INITIAL_BYTES.to_vec();
            bytes[at] = to;
            let _ = Class1Datagram::parse(&bytes[..cut]);
        }
    }
}
