//! A checked little-endian cursor over received bytes.

use super::Error;

/// Reads values one after the other; running over the end is an [`Error::truncated`], never a panic.
#[derive(Debug, Clone)]
pub struct Reader<'a> {
    rest: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    /// Starts at the first byte.
    #[inline]
    pub const fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, at: 0 }
    }

    /// Offset of the next byte, in bytes from the start.
    #[inline]
    pub const fn offset(&self) -> usize {
        self.at
    }

    /// Bytes not read yet.
    #[inline]
    pub const fn remaining(&self) -> usize {
        self.rest.len()
    }

    /// Whether everything has been read.
    #[inline]
    pub const fn is_empty(&self) -> bool {
        self.remaining() == 0
    }

    /// The next `count` bytes.
    ///
    /// # Errors
    /// [`Error::truncated`] naming `what` if fewer are left; nothing is consumed then.
    #[inline]
    pub fn take(&mut self, what: &'static str, count: usize) -> Result<&'a [u8], Error> {
        let Some((part, rest)) = self.rest.split_at_checked(count) else {
            return Err(Error::truncated(what, self.at, count, self.rest.len()));
        };
        self.rest = rest;
        self.at += count;
        Ok(part)
    }

    /// Everything that is left.
    #[inline]
    pub fn rest(&mut self) -> &'a [u8] {
        self.at += self.rest.len();
        core::mem::take(&mut self.rest)
    }

    /// The next `N` bytes as an array.
    ///
    /// # Errors
    /// [`Error::truncated`] naming `what`.
    #[inline]
    pub fn array<const N: usize>(&mut self, what: &'static str) -> Result<[u8; N], Error> {
        let mut out = [0; N];
        out.copy_from_slice(self.take(what, N)?);
        Ok(out)
    }

    /// One byte.
    ///
    /// # Errors
    /// [`Error::truncated`] naming `what`.
    #[inline]
    pub fn u8(&mut self, what: &'static str) -> Result<u8, Error> {
        Ok(self.array::<1>(what)?[0])
    }

    /// A little-endian 16-bit value.
    ///
    /// # Errors
    /// [`Error::truncated`] naming `what`.
    #[inline]
    pub fn u16(&mut self, what: &'static str) -> Result<u16, Error> {
        Ok(u16::from_le_bytes(self.array(what)?))
    }

    /// A little-endian 32-bit value.
    ///
    /// # Errors
    /// [`Error::truncated`] naming `what`.
    #[inline]
    pub fn u32(&mut self, what: &'static str) -> Result<u32, Error> {
        Ok(u32::from_le_bytes(self.array(what)?))
    }

    /// A little-endian 64-bit value.
    ///
    /// # Errors
    /// [`Error::truncated`] naming `what`.
    #[inline]
    pub fn u64(&mut self, what: &'static str) -> Result<u64, Error> {
        Ok(u64::from_le_bytes(self.array(what)?))
    }

    /// The next byte without consuming it.
    #[inline]
    pub fn peek(&self) -> Option<u8> {
        self.rest.first().copied()
    }

    /// Succeeds only if nothing is left behind the part named `what`.
    ///
    /// # Errors
    /// [`Error::trailing`] with the count of bytes too many.
    #[inline]
    pub fn finish(&self, what: &'static str) -> Result<(), Error> {
        match self.remaining() {
            0 => Ok(()),
            excess => Err(Error::trailing(what, self.at, excess)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_little_endian_in_order() {
        let bytes = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 0xAA];
        let mut r = Reader::new(&bytes);
        assert_eq!(r.u8("a"), Ok(1));
        assert_eq!(r.u16("b"), Ok(0x0302));
        assert_eq!(r.u32("c"), Ok(0x0706_0504));
        assert_eq!(r.u64("d"), Ok(0x0F0E_0D0C_0B0A_0908));
        assert_eq!(r.peek(), Some(0xAA));
        assert_eq!(r.finish("all"), Err(Error::trailing("all", 15, 1)));
        assert_eq!(r.rest(), [0xAA]);
        assert_eq!(r.finish("all"), Ok(()));
        assert_eq!(r.peek(), None);
    }

    #[test]
    fn a_short_read_consumes_nothing_and_says_where() {
        let mut r = Reader::new(&[1, 2, 3]);
        assert_eq!(r.u8("first"), Ok(1));
        let expected = Error::truncated("word", 1, 4, 2);
        assert_eq!(r.u32("word"), Err(expected));
        assert_eq!(expected.to_string(), "word at byte 1: expected 4 bytes, found 2");
        assert_eq!(r.u16("half"), Ok(0x0302));
        let huge = r.take("huge", usize::MAX);
        assert_eq!(huge, Err(Error::truncated("huge", 3, usize::MAX, 0)));
    }
}
