//! Signed and floating point values on top of the crate's cursors, and errors moved to the place of a block.

use crate::wire::{Error, Reader, Writer};

/// Reads the CIP types DINT, LINT, REAL and LREAL.
pub(crate) trait ReadValue {
    fn i32(&mut self, what: &'static str) -> Result<i32, Error>;
    fn i64(&mut self, what: &'static str) -> Result<i64, Error>;
    fn f32(&mut self, what: &'static str) -> Result<f32, Error>;
    fn f64(&mut self, what: &'static str) -> Result<f64, Error>;
}

impl ReadValue for Reader<'_> {
    #[inline]
    fn i32(&mut self, what: &'static str) -> Result<i32, Error> {
        Ok(self.u32(what)?.cast_signed())
    }

    #[inline]
    fn i64(&mut self, what: &'static str) -> Result<i64, Error> {
        Ok(self.u64(what)?.cast_signed())
    }

    #[inline]
    fn f32(&mut self, what: &'static str) -> Result<f32, Error> {
        Ok(f32::from_bits(self.u32(what)?))
    }

    #[inline]
    fn f64(&mut self, what: &'static str) -> Result<f64, Error> {
        Ok(f64::from_bits(self.u64(what)?))
    }
}

/// Writes the CIP types DINT, LINT, REAL and LREAL.
pub(crate) trait WriteValue {
    fn i32(&mut self, what: &'static str, value: i32) -> Result<(), Error>;
    fn i64(&mut self, what: &'static str, value: i64) -> Result<(), Error>;
    fn f32(&mut self, what: &'static str, value: f32) -> Result<(), Error>;
    fn f64(&mut self, what: &'static str, value: f64) -> Result<(), Error>;
}

impl WriteValue for Writer<'_> {
    #[inline]
    fn i32(&mut self, what: &'static str, value: i32) -> Result<(), Error> {
        self.u32(what, value.cast_unsigned())
    }

    #[inline]
    fn i64(&mut self, what: &'static str, value: i64) -> Result<(), Error> {
        self.u64(what, value.cast_unsigned())
    }

    #[inline]
    fn f32(&mut self, what: &'static str, value: f32) -> Result<(), Error> {
        self.u32(what, value.to_bits())
    }

    #[inline]
    fn f64(&mut self, what: &'static str, value: f64) -> Result<(), Error> {
        self.u64(what, value.to_bits())
    }
}

/// A field has a value that is not `expected`.
pub(crate) fn invalid(what: &'static str, offset: usize, found: u8, expected: u8) -> Error {
    Error::invalid(what, offset, u32::from(expected), u32::from(found))
}
