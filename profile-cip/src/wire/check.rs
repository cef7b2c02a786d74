//! Test helpers every wire file uses.

/// Checks a table of `(name, bytes, value)` in both directions.
///
/// Each row: the bytes parse to the value; the value has the bytes' length and emits them into a buffer
/// pre-filled with 0xA5; each shorter buffer is refused; each shorter input is refused.
macro_rules! check_vectors {
    ($vectors:expr, $ty:ident) => {
        check_vectors!($vectors, $ty, refuses_every_prefix)
    };
    // For layouts whose last field is "the rest": a cut input may still be a value, only a different one.
    ($vectors:expr, $ty:ident, open_ended) => {
        for (name, bytes, value) in $vectors {
            crate::wire::check::check_vector!(name, *bytes, *value, $ty);
            for cut in 0..bytes.len() {
                assert_ne!($ty::parse(&bytes[..cut]).ok().as_ref(), Some(value), "{name} cut at {cut}");
            }
        }
    };
    ($vectors:expr, $ty:ident, refuses_every_prefix) => {
        for (name, bytes, value) in $vectors {
            crate::wire::check::check_vector!(name, *bytes, *value, $ty);
            for cut in 0..bytes.len() {
                assert!($ty::parse(&bytes[..cut]).is_err(), "{name} cut at {cut}");
            }
        }
    };
}

/// One row of [`check_vectors`].
macro_rules! check_vector {
    ($name:expr, $bytes:expr, $value:expr, $ty:ident) => {{
        let (name, bytes, value): (&str, &[u8], _) = ($name, $bytes, &$value);
        assert_eq!($ty::parse(bytes).as_ref(), Ok(value), "{name}");
        assert_eq!(value.buffer_len(), bytes.len(), "{name}");
        let mut buffer = vec![0xA5; bytes.len() + 3];
        assert_eq!(value.emit(&mut buffer), Ok(bytes.len()), "{name}");
        assert_eq!(&buffer[..bytes.len()], bytes, "{name}");
        assert_eq!(&buffer[bytes.len()..], [0xA5; 3], "{name}: wrote beyond its end");
        for room in 0..bytes.len() {
            assert!(value.emit(&mut buffer[..room]).is_err(), "{name} into {room} bytes");
        }
    }};
}

pub(crate) use {check_vector, check_vectors};
