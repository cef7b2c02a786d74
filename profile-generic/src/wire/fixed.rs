//! Little-endian fields at fixed offsets of a buffer whose length has been checked.

use super::Error;

/// Fails unless `available` bytes are at least `needed`.
///
/// # Errors
/// [`Error::truncated`] at offset 0.
pub const fn need(what: &'static str, needed: usize, available: usize) -> Result<(), Error> {
    if available < needed { Err(Error::truncated(what, 0, needed, available)) } else { Ok(()) }
}

/// The bytes as an array of exactly `N`.
///
/// # Errors
/// [`Error::length`] for any other number of bytes.
pub fn exact<const N: usize>(what: &'static str, bytes: &[u8]) -> Result<[u8; N], Error> {
    bytes.try_into().map_err(|_| Error::length(what, N, bytes.len()))
}

/// `u16` at `offset`; panics unless the caller has checked the length.
#[must_use]
pub const fn u16_at(bytes: &[u8], offset: usize) -> u16 {
    u16::from_le_bytes([bytes[offset], bytes[offset + 1]])
}

/// `u32` at `offset`; panics unless the caller has checked the length.
#[must_use]
pub const fn u32_at(bytes: &[u8], offset: usize) -> u32 {
    u32::from_le_bytes([bytes[offset], bytes[offset + 1], bytes[offset + 2], bytes[offset + 3]])
}

/// Writes a `u16` at `offset`; panics unless the caller has checked the length.
pub fn put_u16(bytes: &mut [u8], offset: usize, value: u16) {
    bytes[offset..offset + 2].copy_from_slice(&value.to_le_bytes());
}

/// Writes a `u32` at `offset`; panics unless the caller has checked the length.
pub fn put_u32(bytes: &mut [u8], offset: usize, value: u32) {
    bytes[offset..offset + 4].copy_from_slice(&value.to_le_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_little_endian_and_leave_their_neighbours_alone() {
        let mut bytes = [0xA5; 8];
        put_u16(&mut bytes, 1, 0x0201);
        put_u32(&mut bytes, 3, 0x0605_0403);
        assert_eq!(bytes, [0xA5, 1, 2, 3, 4, 5, 6, 0xA5]);
        assert_eq!((u16_at(&bytes, 1), u32_at(&bytes, 3)), (0x0201, 0x0605_0403));
    }

    #[test]
    fn a_wrong_length_is_reported_with_both_lengths() {
        assert_eq!(need("part", 4, 4), Ok(()));
        let short = need("part", 4, 3).unwrap_err();
        assert_eq!(short.to_string(), "part at byte 0: expected 4 bytes, found 3");
        assert_eq!(exact::<2>("part", &[1, 2]), Ok([1, 2]));
        for bytes in [&[1][..], &[1, 2, 3]] {
            let error = Error::length("part", 2, bytes.len());
            assert_eq!(exact::<2>("part", bytes), Err(error));
        }
    }
}
