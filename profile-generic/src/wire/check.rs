//! Checks of wire code, for the tests of the protocol crates.

/// Result of an `emit`: the bytes written, or nothing where the layout has a fixed length.
pub trait Written {
    /// The bytes written, `len` in a layout of that length.
    fn written(self, len: usize) -> usize;
}

impl Written for usize {
    fn written(self, _: usize) -> usize {
        self
    }
}

impl Written for () {
    fn written(self, len: usize) -> usize {
        len
    }
}

/// Checks a table of `(name, bytes, value)` in both directions.
///
/// Each row: the bytes parse to the value; the value emits them into a buffer filled with 0xA5, has their length by
/// `buffer_len`, and writes nothing behind them; each shorter buffer is refused; each shorter input is refused.
///
/// - `open_ended`: the last field is "the rest": a cut input may still be a value, only a different one.
/// - `fixed`: the layout has a fixed length and its type no `buffer_len`; longer inputs may have something behind it.
/// - `whole`: the layout is a whole frame that `emit` returns; any other length is refused as a length.
#[doc(hidden)]
#[macro_export]
macro_rules! check_vectors {
    ($vectors:expr, $ty:ident) => {
        for (name, bytes, value) in $vectors {
            let (name, bytes, value) = $crate::check_vector!(name, bytes, value, $ty);
            assert_eq!(value.buffer_len(), bytes.len(), "{name}");
            $crate::check_vectors!(@prefixes name, bytes, $ty);
        }
    };
    ($vectors:expr, $ty:ident, open_ended) => {
        for (name, bytes, value) in $vectors {
            let (name, bytes, value) = $crate::check_vector!(name, bytes, value, $ty);
            assert_eq!(value.buffer_len(), bytes.len(), "{name}");
            for cut in 0..bytes.len() {
                assert_ne!($ty::parse(&bytes[..cut]).ok().as_ref(), Some(value), "{name} cut at {cut}");
            }
        }
    };
    ($vectors:expr, $ty:ident, fixed) => {
        for (name, bytes, value) in $vectors {
            let (name, bytes, _) = $crate::check_vector!(name, bytes, value, $ty);
            $crate::check_vectors!(@prefixes name, bytes, $ty);
        }
    };
    ($vectors:expr, $ty:ident, whole) => {
        for (name, bytes, value) in $vectors {
            let (bytes, value) = (&bytes[..], &*value);
            assert_eq!($ty::parse(bytes).as_ref(), Ok(value), "{name}");
            assert_eq!(&value.emit()[..], bytes, "{name}");
            let longer = [bytes, bytes, &[0]].concat();
            for len in (0..longer.len()).filter(|&len| len != bytes.len()) {
                let error = $ty::parse(&longer[..len]).expect_err("another length");
                assert!(error.is_length() && error.found == len, "{name} with {len} bytes: {error}");
            }
        }
    };
    (@prefixes $name:ident, $bytes:ident, $ty:ident) => {
        for cut in 0..$bytes.len() {
            assert!($ty::parse(&$bytes[..cut]).is_err(), "{} cut at {cut}", $name);
        }
    };
}

/// One row of [`check_vectors`]; gives it back as slice and reference.
#[doc(hidden)]
#[macro_export]
macro_rules! check_vector {
    ($name:expr, $bytes:expr, $value:expr, $ty:ident) => {{
        let (name, bytes, value) = (&$name, &$bytes[..], &*$value);
        assert_eq!($ty::parse(bytes).as_ref(), Ok(value), "{name}");
        let len = bytes.len();
        let mut buffer = vec![0xA5; len + 3];
        let written =
            value.emit(&mut buffer).map(|written| $crate::wire::check::Written::written(written, len));
        assert_eq!(written, Ok(len), "{name}");
        assert_eq!(&buffer[..len], bytes, "{name}");
        assert_eq!(&buffer[len..], [0xA5; 3], "{name}: wrote beyond its end");
        for room in 0..len {
            assert!(value.emit(&mut buffer[..room]).is_err(), "{name} into {room} bytes");
        }
        (name, bytes, value)
    }};
}

pub use crate::{check_vector, check_vectors};
