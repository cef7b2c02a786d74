//! A few bytes inside a frame.

use core::fmt;
use core::ops::Deref;

/// Up to `N` bytes, in place. What lies behind the length is always 0, so that equal bytes are equal values.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Bytes<const N: usize> {
    len: u8,
    bytes: [u8; N],
}

impl<const N: usize> Bytes<N> {
    /// As many of `bytes` as there is room for.
    #[must_use]
    pub fn truncated(bytes: &[u8]) -> Self {
        let kept = &bytes[..bytes.len().min(N).min(usize::from(u8::MAX))];
        let mut own = [0; N];
        own[..kept.len()].copy_from_slice(kept);
        Self { len: u8::try_from(kept.len()).unwrap_or(u8::MAX), bytes: own }
    }

    /// A copy of `bytes`; `None` when there are more than `N`.
    #[must_use]
    pub fn new(bytes: &[u8]) -> Option<Self> {
        (bytes.len() <= N).then(|| Self::truncated(bytes))
    }

    /// All `N` bytes, zeros behind the length.
    #[must_use]
    pub const fn padded(&self) -> &[u8; N] {
        &self.bytes
    }
}

impl<const N: usize> Default for Bytes<N> {
    fn default() -> Self {
        Self { len: 0, bytes: [0; N] }
    }
}

impl<const N: usize> Deref for Bytes<N> {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes[..usize::from(self.len)]
    }
}

impl<const N: usize> fmt::Display for Bytes<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, byte) in self.iter().enumerate() {
            let separator = if place == 0 { "" } else { " " };
            write!(f, "{separator}{byte:02X}")?;
        }
        Ok(())
    }
}

impl<const N: usize> fmt::Debug for Bytes<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[{self}]")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_kept_up_to_the_room_there_is() {
        assert_eq!(*Bytes::<4>::truncated(&[1, 2, 3, 4, 5]), [1, 2, 3, 4]);
        assert_eq!(Bytes::<4>::new(&[1, 2, 3, 4, 5]), None);
        let two = Bytes::<4>::new(&[1, 2]).unwrap();
        assert_eq!((&*two, two.padded(), format!("{two:?}")), (&[1, 2][..], &[1, 2, 0, 0], "[01 02]".into()));
    }
}
