//! Bodies of Get_Attribute_List (0x03) and Set_Attribute_List (0x04).
//!
//! | | request: count u16, then each | reply: count u16, then each |
//! |---|---|---|
//! | Get_Attribute_List | attribute u16 | attribute u16, status u16, value if the status is 0 |
//! | Set_Attribute_List | attribute u16, value | attribute u16, status u16 |
//!
//! Values have no length of their own: only the object knows where one ends. Get_Attribute_Single and
//! Set_Attribute_Single have nothing but the value, Get_Attributes_All the values of all attributes in order.

use super::encapsulation::length_u16;
use super::{Error, Reader, Writer};

/// Attribute numbers of a Get_Attribute_List request, as the bytes they came in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AttributeIds<'a>(&'a [u8]);

impl<'a> AttributeIds<'a> {
    /// Reads the request data.
    ///
    /// # Errors
    /// [`Error::truncated`] if the count says more than there is, [`Error::trailing`].
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        let mut r = Reader::new(bytes);
        let count = r.u16("attribute count")?;
        let ids = r.take("attribute list", 2 * usize::from(count))?;
        r.finish("attribute list")?;
        Ok(Self(ids))
    }

    /// The numbers in their order.
    pub fn iter(&self) -> impl Iterator<Item = u16> + use<'a> {
        self.0.chunks_exact(2).map(|word| u16::from_le_bytes([word[0], word[1]]))
    }

    /// How many there are.
    pub const fn len(&self) -> usize {
        self.0.len() / 2
    }

    /// Whether there is none.
    pub const fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Writes request data with these numbers and returns its length.
    ///
    /// # Errors
    /// [`Error::truncated`]; [`Error::too_large`] for more than 65535 numbers.
    pub fn emit(ids: &[u16], buffer: &mut [u8]) -> Result<usize, Error> {
        let mut w = Writer::new(buffer);
        w.u16("attribute count", length_u16("attribute count", ids.len())?)?;
        for id in ids {
            w.u16("attribute", *id)?;
        }
        Ok(w.written())
    }
}

/// Attribute and status, one row of either reply. The value follows it in a Get_Attribute_List reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AttributeStatus {
    /// Attribute number.
    pub attribute: u16,
    /// General status in the low byte.
    pub status: u16,
}

impl AttributeStatus {
    /// Reads a row where `r` stands.
    ///
    /// # Errors
    /// [`Error::truncated`].
    pub fn read(r: &mut Reader<'_>) -> Result<Self, Error> {
        Ok(Self { attribute: r.u16("attribute")?, status: r.u16("attribute status")? })
    }

    /// Writes a row where `w` stands.
    ///
    /// # Errors
    /// [`Error::truncated`].
    pub fn write(&self, w: &mut Writer<'_>) -> Result<(), Error> {
        w.u16("attribute", self.attribute)?;
        w.u16("attribute status", self.status)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn vectors_both_ways() {
        let bytes = [2, 0, 1, 0, 0xB9, 1];
        let ids = AttributeIds::parse(&bytes).unwrap();
        assert_eq!(ids.iter().collect::<Vec<_>>(), [1, 441]);
        assert_eq!((ids.len(), ids.is_empty()), (2, false));
        let mut buffer = [0xA5; 8];
        assert_eq!(AttributeIds::emit(&[1, 441], &mut buffer), Ok(6));
        assert_eq!(buffer, [2, 0, 1, 0, 0xB9, 1, 0xA5, 0xA5]);
        for cut in 0..bytes.len() {
            assert!(AttributeIds::parse(&bytes[..cut]).is_err(), "cut at {cut}");
            assert!(AttributeIds::emit(&[1, 441], &mut buffer[..cut]).is_err(), "into {cut}");
        }
        let row = AttributeStatus { attribute: 441, status: 0x14 };
        let mut w = Writer::new(&mut buffer);
        assert_eq!(row.write(&mut w), Ok(()));
        assert_eq!(buffer[..4], [0xB9, 1, 0x14, 0]);
        assert_eq!(AttributeStatus::read(&mut Reader::new(&buffer)), Ok(row));
    }

    #[test]
    fn a_huge_count_is_refused_before_any_number_is_read() {
        assert_eq!(
            AttributeIds::parse(&[0xFF, 0xFF, 1, 0]),
            Err(Error::truncated("attribute list", 2, 131_070, 2))
        );
    }

    proptest! {
        #[test]
        fn round_trip(ids in prop::collection::vec(any::<u16>(), 0..20)) {
            let mut buffer = vec![0xA5; 2 + 2 * ids.len()];
            prop_assert_eq!(AttributeIds::emit(&ids, &mut buffer), Ok(buffer.len()));
            prop_assert_eq!(AttributeIds::parse(&buffer).unwrap().iter().collect::<Vec<_>>(), ids);
        }
    }
}
