//! The common packet format: a counted list of typed items.
//!
//! | offset | size | field |
//! |---|---|---|
//! | 0 | 2 | item count |
//! | 2 | | items, each: type 2, length 2, data |
//!
//! SendRRData and SendUnitData put a 4-byte interface handle (0 for CIP) and a 2-byte time-out (seconds, 0
//! for CIP) in front of it: [`EncapsulatedPacket`]. Class 0 and 1 datagrams are the bare list.

use super::encapsulation::length_u16;
use super::{Error, Reader, Writer};
use arrayvec::ArrayVec;
use core::fmt;
use profile_generic::open_code;

/// Most items kept. A Forward_Open has four (address, data, two sockaddr items); no packet of ours needs
/// more.
pub const ITEMS_MAX: usize = 8;

/// Type and length in front of each item's data.
pub const ITEM_HEADER_LEN: usize = 4;

open_code! {
    /// Common packet format item type.
    pub struct ItemType(u16) {
        /// Address item of unconnected messages, without data.
        NULL_ADDRESS = 0x0000,
        /// A ListIdentity answer.
        IDENTITY = 0x000C,
        /// Address item of explicit connections: the connection ID.
        CONNECTED_ADDRESS = 0x00A1,
        /// Data of a connection.
        CONNECTED_DATA = 0x00B1,
        /// An unconnected message.
        UNCONNECTED_DATA = 0x00B2,
        /// A ListServices answer.
        SERVICES = 0x0100,
        /// Where originator-to-target datagrams go.
        SOCKADDR_O_TO_T = 0x8000,
        /// Where target-to-originator datagrams go.
        SOCKADDR_T_TO_O = 0x8001,
        /// Address item of class 0 and 1 datagrams: connection ID and sequence number.
        SEQUENCED_ADDRESS = 0x8002,
    }
}

/// An item of the Common Packet Format: type and data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Item<'a> {
    /// What the data is.
    pub item_type: ItemType,
    /// The item's data, at most 65535 bytes.
    pub data: &'a [u8],
}

impl Item<'_> {
    /// Type, length and data in bytes.
    pub const fn buffer_len(&self) -> usize {
        ITEM_HEADER_LEN + self.data.len()
    }
}

/// The list of items.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CommonPacket<'a> {
    /// The items in their order.
    pub items: ArrayVec<Item<'a>, ITEMS_MAX>,
}

impl<'a> CommonPacket<'a> {
    /// A list of the given items, of which the first [`ITEMS_MAX`] are kept.
    pub fn new(items: &[Item<'a>]) -> Self {
        Self { items: items.iter().copied().take(ITEMS_MAX).collect() }
    }

    /// Reads exactly one list.
    ///
    /// # Errors
    /// [`Error::too_large`] for more than [`ITEMS_MAX`] items, [`Error::truncated`], [`Error::trailing`].
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        let mut r = Reader::new(bytes);
        let packet = Self::read(&mut r)?;
        r.finish("common packet")?;
        Ok(packet)
    }

    fn read(r: &mut Reader<'a>) -> Result<Self, Error> {
        let count = r.u16("item count")?;
        if usize::from(count) > ITEMS_MAX {
            return Err(Error::too_large("item count", 8, u32::from(count)));
        }
        let mut items = ArrayVec::new();
        for _ in 0..count {
            let item_type = ItemType(r.u16("item type")?);
            let length = r.u16("item length")?;
            items.push(Item { item_type, data: r.take("item data", usize::from(length))? });
        }
        Ok(Self { items })
    }

    /// Bytes of the whole list.
    pub fn buffer_len(&self) -> usize {
        2 + self.items.iter().map(Item::buffer_len).sum::<usize>()
    }

    /// Writes the list and returns its length.
    ///
    /// # Errors
    /// [`Error::truncated`]; [`Error::too_large`] for an item of more than 65535 bytes.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let mut w = Writer::new(buffer);
        w.u16("item count", length_u16("item count", self.items.len())?)?;
        for item in &self.items {
            w.u16("item type", item.item_type.0)?;
            w.u16("item length", length_u16("item data", item.data.len())?)?;
            w.slice("item data", item.data)?;
        }
        Ok(w.written())
    }

    /// The data of the first item of that type.
    pub fn find(&self, item_type: ItemType) -> Option<&'a [u8]> {
        self.items.iter().find(|item| item.item_type == item_type).map(|item| item.data)
    }
}

impl fmt::Display for CommonPacket<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (n, item) in self.items.iter().enumerate() {
            let separator = if n == 0 { "" } else { ", " };
            write!(f, "{separator}{} ({} bytes)", item.item_type, item.data.len())?;
        }
        Ok(())
    }
}

/// Data of SendRRData and SendUnitData.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct EncapsulatedPacket<'a> {
    /// 0 for CIP.
    pub interface_handle: u32,
    /// Time-out in seconds; 0 leaves it to the CIP message.
    pub timeout_s: u16,
    /// The items.
    pub packet: CommonPacket<'a>,
}

impl<'a> EncapsulatedPacket<'a> {
    /// Reads exactly this block.
    ///
    /// # Errors
    /// As [`CommonPacket::parse`], with offsets from the start of `bytes`.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        let mut r = Reader::new(bytes);
        let value = Self {
            interface_handle: r.u32("interface handle")?,
            timeout_s: r.u16("time-out")?,
            packet: CommonPacket::read(&mut r)?,
        };
        r.finish("common packet")?;
        Ok(value)
    }

    /// Bytes of the whole block.
    pub fn buffer_len(&self) -> usize {
        6 + self.packet.buffer_len()
    }

    /// Writes the block and returns its length.
    ///
    /// # Errors
    /// As [`CommonPacket::emit`].
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let mut w = Writer::new(buffer);
        w.u32("interface handle", self.interface_handle)?;
        w.u16("time-out", self.timeout_s)?;
        let head = w.written();
        Ok(head + self.packet.emit(&mut buffer[head..])?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::wire::check::check_vectors;
    use proptest::prelude::*;

    #[test]
    fn vectors_both_ways() {
        let vectors: &[(&str, &[u8], EncapsulatedPacket)] = &[
            (
                "unconnected message in SendRRData",
                &[0, 0, 0, 0, 5, 0, 2, 0, 0, 0, 0, 0, 0xB2, 0, 2, 0, 0x01, 0x00],
                EncapsulatedPacket {
                    interface_handle: 0,
                    timeout_s: 5,
                    packet: CommonPacket::new(&[
                        Item { item_type: ItemType::NULL_ADDRESS, data: &[] },
                        Item { item_type: ItemType::UNCONNECTED_DATA, data: &[1, 0] },
                    ]),
                },
            ),
            (
                "connected message in SendUnitData",
                &[
                    0, 0, 0, 0, 0, 0, 2, 0, 0xA1, 0, 4, 0, 0x78, 0x56, 0x34, 0x12, 0xB1, 0, 4, 0, 1, 0, 0x0E,
                    0,
                ],
                EncapsulatedPacket {
                    interface_handle: 0,
                    timeout_s: 0,
                    packet: CommonPacket::new(&[
                        Item { item_type: ItemType::CONNECTED_ADDRESS, data: &[0x78, 0x56, 0x34, 0x12] },
                        Item { item_type: ItemType::CONNECTED_DATA, data: &[1, 0, 0x0E, 0] },
                    ]),
                },
            ),
        ];
        check_vectors!(vectors, EncapsulatedPacket);
    }

    #[test]
    fn an_item_count_of_0xe801_is_refused_before_any_item_is_read() {
        assert_eq!(
            CommonPacket::parse(&[0x01, 0xE8, 0, 0, 0, 0]),
            Err(Error::too_large("item count", 8, 0xE801))
        );
    }

    #[test]
    fn an_item_longer_than_its_packet_is_refused() {
        assert_eq!(
            CommonPacket::parse(&[1, 0, 0xB2, 0, 0xFF, 0xFF, 1, 2]),
            Err(Error::truncated("item data", 6, 65535, 2))
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn round_trip(interface_handle: u32, timeout_s: u16,
                      parts in prop::collection::vec(
                          (any::<u16>(), prop::collection::vec(any::<u8>(), 0..20)), 0..=ITEMS_MAX)) {
            let items = parts.iter().map(|(t, d)| Item { item_type: ItemType(*t), data: d }).collect();
            let value = EncapsulatedPacket { interface_handle, timeout_s, packet: CommonPacket { items } };
            let mut buffer = vec![0xA5; value.buffer_len()];
            prop_assert_eq!(value.emit(&mut buffer), Ok(value.buffer_len()));
            prop_assert_eq!(EncapsulatedPacket::parse(&buffer), Ok(value));
        }

        #[test]
        fn any_bytes_that_parse_emit_themselves(
            bytes in prop::collection::vec(any::<u8>(), 0..40), count in 0u8..4,
        ) {
            let mut bytes = bytes;
            if bytes.len() > 1 { bytes[0] = count; bytes[1] = 0; }
            if let Ok(value) = CommonPacket::parse(&bytes) {
                let mut buffer = vec![0xA5; bytes.len()];
                prop_assert_eq!(value.emit(&mut buffer), Ok(bytes.len()));
                prop_assert_eq!(&buffer, &bytes);
            }
        }
    }
}
