//! Unconnected_Send (0x52): a request and the route it shall take.
//!
//! | offset | size | field |
//! |---|---|---|
//! | 0 | 1 | priority and time tick |
//! | 1 | 1 | time-out ticks |
//! | 2 | 2 | length of the message in bytes |
//! | 4 | | message request |
//! | | 0 or 1 | pad, if the message has an odd length |
//! | | 1 | route path length in words |
//! | | 1 | reserved |
//! | | | route path, padded EPATH |

use super::encapsulation::{length_u16, words_u8};
use super::{Error, Reader, Writer};
use core::fmt;

/// An Unconnected_Send request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UnconnectedSend<'a> {
    /// Priority and time tick.
    pub priority_tick: u8,
    /// Time-out in ticks.
    pub timeout_ticks: u8,
    /// The request to be carried, see [`super::message_router::Request`].
    pub message: &'a [u8],
    /// The route, of even length up to 510 bytes; empty at the end of the way.
    pub route: &'a [u8],
}

impl<'a> UnconnectedSend<'a> {
    /// Reads the request data.
    ///
    /// # Errors
    /// [`Error::truncated`], [`Error::trailing`].
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        let mut r = Reader::new(bytes);
        let priority_tick = r.u8("priority and time tick")?;
        let timeout_ticks = r.u8("time-out ticks")?;
        let length = r.u16("message length")?;
        let message = r.take("embedded message", usize::from(length))?;
        if message.len() % 2 != 0 {
            r.u8("pad")?;
        }
        let words = r.u8("route path length")?;
        r.u8("reserved")?;
        let route = r.take("route path", 2 * usize::from(words))?;
        r.finish("Unconnected_Send")?;
        Ok(Self { priority_tick, timeout_ticks, message, route })
    }

    /// Bytes of the request data.
    pub const fn buffer_len(&self) -> usize {
        6 + self.message.len() + self.message.len() % 2 + self.route.len()
    }

    /// Writes the request data and returns its length.
    ///
    /// # Errors
    /// [`Error::truncated`]; [`Error::too_large`] and [`Error::invalid`] for a message or route too long, or
    /// a route of odd length.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let mut w = Writer::new(buffer);
        w.u8("priority and time tick", self.priority_tick)?;
        w.u8("time-out ticks", self.timeout_ticks)?;
        w.u16("message length", length_u16("embedded message", self.message.len())?)?;
        w.slice("embedded message", self.message)?;
        w.zeros("pad", self.message.len() % 2)?;
        w.u8("route path length", words_u8("route path", self.route.len())?)?;
        w.u8("reserved", 0)?;
        w.slice("route path", self.route)?;
        Ok(w.written())
    }
}

impl fmt::Display for UnconnectedSend<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "Unconnected_Send of {} bytes over {} words of route",
            self.message.len(),
            self.route.len() / 2
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::wire::check::check_vectors;
    use proptest::prelude::*;

    #[test]
    fn vectors_both_ways() {
        let vectors: &[(&str, &[u8], UnconnectedSend)] = &[
            (
                "Get_Attribute_Single to slot 0",
                &[5, 0x9D, 8, 0, 0x0E, 3, 0x20, 1, 0x24, 1, 0x30, 1, 1, 0, 1, 0],
                UnconnectedSend {
                    priority_tick: 5,
                    timeout_ticks: 0x9D,
                    message: &[0x0E, 3, 0x20, 1, 0x24, 1, 0x30, 1],
                    route: &[1, 0],
                },
            ),
            (
                "odd message without a route",
                &[7, 1, 5, 0, 5, 1, 0x20, 1, 0, 0, 0, 0],
                UnconnectedSend {
                    priority_tick: 7,
                    timeout_ticks: 1,
                    message: &[5, 1, 0x20, 1, 0],
                    route: &[],
                },
            ),
        ];
        check_vectors!(vectors, UnconnectedSend);
    }

    #[test]
    fn a_message_length_past_the_end_is_refused() {
        assert_eq!(
            UnconnectedSend::parse(&[5, 0x9D, 0xFF, 0xFF, 1, 2]),
            Err(Error::truncated("embedded message", 4, 65535, 2))
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn round_trip(head: [u8; 2], message in prop::collection::vec(any::<u8>(), 0..40),
                      route in prop::collection::vec(any::<[u8; 2]>(), 0..9)) {
            let route = route.concat();
            let value = UnconnectedSend {
                priority_tick: head[0], timeout_ticks: head[1], message: &message, route: &route,
            };
            let mut buffer = vec![0xA5; value.buffer_len()];
            prop_assert_eq!(value.emit(&mut buffer), Ok(value.buffer_len()));
            prop_assert_eq!(UnconnectedSend::parse(&buffer), Ok(value));
        }
    }
}
