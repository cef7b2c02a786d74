//! Forward_Close (0x4E): service data of request and success reply.
//!
//! | offset | size | request | | offset | size | reply |
//! |---|---|---|---|---|---|---|
//! | 0 | 1 | priority and time tick | | 0 | 8 | triad |
//! | 1 | 1 | time-out ticks | | 8 | 1 | application reply length in words |
//! | 2 | 8 | triad | | 9 | 1 | reserved |
//! | 10 | 1 | connection path length in words | | 10 | | application reply |
//! | 11 | 1 | reserved | | | | |
//! | 12 | | connection path, padded EPATH | | | | |
//!
//! A refusal carries [`super::forward_open::ConnectionFailure`].

use super::encapsulation::words_u8;
use super::triad::ConnectionTriad;
use super::{Error, Reader, Writer};
use core::fmt;

/// A Forward_Close request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ForwardClose<'a> {
    /// Priority and time tick of the request itself.
    pub priority_tick: u8,
    /// Time-out of the request itself in ticks.
    pub timeout_ticks: u8,
    /// Which connection.
    pub triad: ConnectionTriad,
    /// The path of the Forward_Open, of even length up to 510 bytes.
    pub path: &'a [u8],
}

impl<'a> ForwardClose<'a> {
    /// Reads the request data.
    ///
    /// # Errors
    /// [`Error::truncated`], [`Error::trailing`].
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        let mut r = Reader::new(bytes);
        let priority_tick = r.u8("priority and time tick")?;
        let timeout_ticks = r.u8("time-out ticks")?;
        let triad = ConnectionTriad::read(&mut r)?;
        let words = r.u8("connection path length")?;
        r.u8("reserved")?;
        let path = r.take("connection path", 2 * usize::from(words))?;
        r.finish("Forward_Close")?;
        Ok(Self { priority_tick, timeout_ticks, triad, path })
    }

    /// Bytes of the request data.
    pub const fn buffer_len(&self) -> usize {
        12 + self.path.len()
    }

    /// Writes the request data and returns its length.
    ///
    /// # Errors
    /// [`Error::truncated`]; [`Error::too_large`] and [`Error::invalid`] for a path too long or of odd
    /// length.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let mut w = Writer::new(buffer);
        w.u8("priority and time tick", self.priority_tick)?;
        w.u8("time-out ticks", self.timeout_ticks)?;
        self.triad.write(&mut w)?;
        w.u8("connection path length", words_u8("connection path", self.path.len())?)?;
        w.u8("reserved", 0)?;
        w.slice("connection path", self.path)?;
        Ok(w.written())
    }
}

impl fmt::Display for ForwardClose<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Forward_Close of {}", self.triad)
    }
}

/// Data of a successful Forward_Close reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ForwardCloseReply<'a> {
    /// As in the request.
    pub triad: ConnectionTriad,
    /// What the application adds, of even length up to 510 bytes.
    pub application_reply: &'a [u8],
}

impl<'a> ForwardCloseReply<'a> {
    /// Reads the reply data.
    ///
    /// # Errors
    /// [`Error::truncated`], [`Error::trailing`].
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        let mut r = Reader::new(bytes);
        let triad = ConnectionTriad::read(&mut r)?;
        let words = r.u8("application reply length")?;
        r.u8("reserved")?;
        let application_reply = r.take("application reply", 2 * usize::from(words))?;
        r.finish("Forward_Close reply")?;
        Ok(Self { triad, application_reply })
    }

    /// Bytes of the reply data.
    pub const fn buffer_len(&self) -> usize {
        10 + self.application_reply.len()
    }

    /// Writes the reply data and returns its length.
    ///
    /// # Errors
    /// [`Error::truncated`]; [`Error::too_large`] and [`Error::invalid`] for an application reply too long
    /// or odd.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let mut w = Writer::new(buffer);
        self.triad.write(&mut w)?;
        w.u8("application reply length", words_u8("application reply", self.application_reply.len())?)?;
        w.u8("reserved", 0)?;
        w.slice("application reply", self.application_reply)?;
        Ok(w.written())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::wire::check::check_vectors;
    use proptest::prelude::*;

    const TRIAD: ConnectionTriad =
        ConnectionTriad { connection_serial: 0x1234, originator_vendor: 1, originator_serial: 0xCAFE_F00D };

    #[test]
    fn vectors_both_ways() {
        let requests: &[(&str, &[u8], ForwardClose)] = &[(
            "close of the motion connection",
            &[0x0A, 0x0E, 0x34, 0x12, 1, 0, 0x0D, 0xF0, 0xFE, 0xCA, 3, 0, 0x20, 0x42, 0x2C, 0x51, 0x2C, 2],
            ForwardClose {
                priority_tick: 0x0A,
                timeout_ticks: 0x0E,
                triad: TRIAD,
                path: &[0x20, 0x42, 0x2C, 0x51, 0x2C, 2],
            },
        )];
        check_vectors!(requests, ForwardClose);
        let replies: &[(&str, &[u8], ForwardCloseReply)] = &[(
            "done",
            &[0x34, 0x12, 1, 0, 0x0D, 0xF0, 0xFE, 0xCA, 0, 0],
            ForwardCloseReply { triad: TRIAD, application_reply: &[] },
        )];
        check_vectors!(replies, ForwardCloseReply);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn round_trip(priority_tick: u8, timeout_ticks: u8,
                      path in prop::collection::vec(any::<[u8; 2]>(), 0..30)) {
            let path = path.concat();
            let value = ForwardClose { priority_tick, timeout_ticks, triad: TRIAD, path: &path };
            let mut buffer = vec![0xA5; value.buffer_len()];
            prop_assert_eq!(value.emit(&mut buffer), Ok(value.buffer_len()));
            prop_assert_eq!(ForwardClose::parse(&buffer), Ok(value));
            let reply = ForwardCloseReply { triad: TRIAD, application_reply: &path };
            let mut buffer = vec![0xA5; reply.buffer_len()];
            prop_assert_eq!(reply.emit(&mut buffer), Ok(reply.buffer_len()));
            prop_assert_eq!(ForwardCloseReply::parse(&buffer), Ok(reply));
        }
    }
}
