//! SYNC, with a counter or without.

use core::fmt;

use profile_generic::wire::Error;

/// The largest value of the counter (1019).
pub const COUNTER_MAX: u8 = 240;

/// SYNC, with or without its counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Sync {
    /// Counts from 1 to the value of 1019 and begins again; `None` where 1019 is 0.
    pub counter: Option<u8>,
}

impl Sync {
    /// Reads one.
    ///
    /// # Errors
    /// [`Error`] for more than one byte and for a counter that is not 1 to 240.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        match *bytes {
            [] => Ok(Self { counter: None }),
            [counter @ 1..=COUNTER_MAX] => Ok(Self { counter: Some(counter) }),
            [counter] => Err(Error::value("SYNC counter", "1 to 240", u32::from(counter))),
            _ => Err(Error::length("SYNC", 1, bytes.len())),
        }
    }

    /// Bytes of the data.
    #[must_use]
    pub const fn buffer_len(&self) -> usize {
        self.counter.is_some() as usize
    }

    /// The bytes: the first [`Sync::buffer_len`] of these.
    #[must_use]
    pub fn emit(&self) -> [u8; 1] {
        [self.counter.unwrap_or_default()]
    }
}

impl fmt::Display for Sync {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.counter {
            Some(counter) => write!(f, "SYNC {counter}"),
            None => f.write_str("SYNC"),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn vectors_both_ways() {
        // canopen tests: test_sync sends no byte without a counter, and the count with one.
        let vectors: [(&[u8], Option<u8>, &str); 3] =
            [(&[], None, "SYNC"), (&[2], Some(2), "SYNC 2"), (&[240], Some(240), "SYNC 240")];
        for (bytes, counter, text) in vectors {
            let value = Sync { counter };
            assert_eq!(Sync::parse(bytes), Ok(value));
            assert_eq!(&value.emit()[..value.buffer_len()], bytes);
            assert_eq!(value.to_string(), text);
        }
        assert_eq!(Sync::parse(&[1, 2]), Err(Error::length("SYNC", 1, 2)));
        assert_eq!(Sync::parse(&[0]).unwrap_err().to_string(), "SYNC counter: expected 1 to 240, got 0x0");
        assert!(Sync::parse(&[241]).is_err());
    }

    proptest! {
        #[test]
        fn round_trips(bytes in prop::collection::vec(any::<u8>(), 0..9)) {
            if let Ok(value) = Sync::parse(&bytes) {
                prop_assert_eq!(&value.emit()[..value.buffer_len()], &bytes[..]);
            }
        }
    }
}
