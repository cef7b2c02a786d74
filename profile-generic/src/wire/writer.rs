//! A checked little-endian cursor over a buffer to be sent.

use super::Error;

/// Writes values one after the other; running over the end is an [`Error::truncated`], never a panic.
#[derive(Debug)]
pub struct Writer<'a> {
    bytes: &'a mut [u8],
    at: usize,
}

impl<'a> Writer<'a> {
    /// Starts at the first byte.
    #[inline]
    pub const fn new(bytes: &'a mut [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// Bytes written so far.
    #[inline]
    pub const fn written(&self) -> usize {
        self.at
    }

    /// Bytes that still fit.
    #[inline]
    pub const fn remaining(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// The next `count` bytes for the caller to fill.
    ///
    /// # Errors
    /// [`Error::truncated`] naming `what` if fewer are left; nothing is written then.
    #[inline]
    pub fn reserve(&mut self, what: &'static str, count: usize) -> Result<&mut [u8], Error> {
        let available = self.remaining();
        if count > available {
            return Err(Error::truncated(what, self.at, count, available));
        }
        let start = self.at;
        self.at += count;
        Ok(&mut self.bytes[start..start + count])
    }

    /// Copies `part`.
    ///
    /// # Errors
    /// [`Error::truncated`] naming `what`.
    #[inline]
    pub fn slice(&mut self, what: &'static str, part: &[u8]) -> Result<(), Error> {
        self.reserve(what, part.len())?.copy_from_slice(part);
        Ok(())
    }

    /// `count` zero bytes: reserved fields and padding.
    ///
    /// # Errors
    /// [`Error::truncated`] naming `what`.
    #[inline]
    pub fn zeros(&mut self, what: &'static str, count: usize) -> Result<(), Error> {
        self.reserve(what, count)?.fill(0);
        Ok(())
    }

    /// One byte.
    ///
    /// # Errors
    /// [`Error::truncated`] naming `what`.
    #[inline]
    pub fn u8(&mut self, what: &'static str, value: u8) -> Result<(), Error> {
        self.slice(what, &[value])
    }

    /// A little-endian 16-bit value.
    ///
    /// # Errors
    /// [`Error::truncated`] naming `what`.
    #[inline]
    pub fn u16(&mut self, what: &'static str, value: u16) -> Result<(), Error> {
        self.slice(what, &value.to_le_bytes())
    }

    /// A little-endian 32-bit value.
    ///
    /// # Errors
    /// [`Error::truncated`] naming `what`.
    #[inline]
    pub fn u32(&mut self, what: &'static str, value: u32) -> Result<(), Error> {
        self.slice(what, &value.to_le_bytes())
    }

    /// A little-endian 64-bit value.
    ///
    /// # Errors
    /// [`Error::truncated`] naming `what`.
    #[inline]
    pub fn u64(&mut self, what: &'static str, value: u64) -> Result<(), Error> {
        self.slice(what, &value.to_le_bytes())
    }

    /// Overwrites a 16-bit value written earlier at `offset`: lengths that are known only afterwards.
    ///
    /// # Errors
    /// [`Error::truncated`] naming `what` if those two bytes have not been written yet.
    #[inline]
    pub fn patch_u16(&mut self, what: &'static str, offset: usize, value: u16) -> Result<(), Error> {
        let available = self.at.saturating_sub(offset);
        if available < 2 {
            return Err(Error::truncated(what, offset, 2, available));
        }
        self.bytes[offset..offset + 2].copy_from_slice(&value.to_le_bytes());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writes_little_endian_in_order_and_patches() {
        let mut buffer = [0xA5; 19];
        let mut w = Writer::new(&mut buffer);
        assert_eq!(w.u8("a", 1), Ok(()));
        assert_eq!(w.u16("b", 0x0302), Ok(()));
        assert_eq!(w.u32("c", 0x0706_0504), Ok(()));
        assert_eq!(w.u64("d", 0x0F0E_0D0C_0B0A_0908), Ok(()));
        assert_eq!(w.zeros("e", 2), Ok(()));
        assert_eq!(w.patch_u16("b", 1, 0xBEEF), Ok(()));
        assert_eq!(w.written(), 17);
        let short = Error::truncated("f", 17, 4, 2);
        assert_eq!(w.u32("f", 1), Err(short));
        let unwritten = Error::truncated("g", 16, 2, 1);
        assert_eq!(w.patch_u16("g", 16, 1), Err(unwritten));
        assert_eq!(buffer, [1, 0xEF, 0xBE, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 0, 0, 0xA5, 0xA5],);
    }
}
