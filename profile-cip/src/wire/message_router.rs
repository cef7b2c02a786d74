//! Explicit request and reply as the message router takes and gives them.
//!
//! | offset | size | request | | offset | size | reply |
//! |---|---|---|---|---|---|---|
//! | 0 | 1 | service | | 0 | 1 | service + 0x80 |
//! | 1 | 1 | path length in words | | 1 | 1 | reserved |
//! | 2 | | path, padded EPATH | | 2 | 1 | general status |
//! | | | data | | 3 | 1 | extended status length in words |
//! | | | | | 4 | | extended status, then data |

use super::encapsulation::words_u8;
use super::status::{GeneralStatus, REPLY_BIT, Service};
use super::{Error, Reader, Writer};
use arrayvec::ArrayVec;
use core::fmt;

/// Most words of extended status kept: the longest one defined here has five.
pub const EXTENDED_STATUS_MAX: usize = 8;

/// A Message Router request: service, path and data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Request<'a> {
    /// Service code, bit 7 clear.
    pub service: Service,
    /// Padded EPATH, an even count of bytes up to 510; see [`super::epath::segments`].
    pub path: &'a [u8],
    /// Service data.
    pub data: &'a [u8],
}

impl<'a> Request<'a> {
    /// Reads a request; everything behind the path is data.
    ///
    /// # Errors
    /// [`Error::truncated`]; [`Error::invalid`] if the service has the reply bit.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        let mut r = Reader::new(bytes);
        let service = r.u8("service")?;
        if service & REPLY_BIT != 0 {
            let (found, expected) = (u32::from(service), u32::from(service & !REPLY_BIT));
            return Err(Error::invalid("service", 0, expected, found));
        }
        let words = r.u8("path length")?;
        let path = r.take("path", 2 * usize::from(words))?;
        Ok(Self { service: Service(service), path, data: r.rest() })
    }

    /// Bytes of the request.
    pub const fn buffer_len(&self) -> usize {
        2 + self.path.len() + self.data.len()
    }

    /// Writes the request and returns its length.
    ///
    /// # Errors
    /// [`Error::truncated`]; [`Error::too_large`] and [`Error::invalid`] for a path too long or of odd
    /// length.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let mut w = Writer::new(buffer);
        w.u8("service", self.service.0 & !REPLY_BIT)?;
        w.u8("path length", words_u8("path", self.path.len())?)?;
        w.slice("path", self.path)?;
        w.slice("data", self.data)?;
        Ok(w.written())
    }
}

impl fmt::Display for Request<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} with {} bytes", self.service, self.data.len())
    }
}

/// A Message Router reply: service, general and extended status, data.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reply<'a> {
    /// Service code of the request, bit 7 clear.
    pub service: Service,
    /// Outcome.
    pub status: GeneralStatus,
    /// More about the outcome.
    pub extended: ArrayVec<u16, EXTENDED_STATUS_MAX>,
    /// Reply data.
    pub data: &'a [u8],
}

impl<'a> Reply<'a> {
    /// A reply without data.
    pub fn new(service: Service, status: GeneralStatus) -> Self {
        Self { service, status, extended: ArrayVec::new(), data: &[] }
    }

    /// Reads a reply; everything behind the extended status is data.
    ///
    /// # Errors
    /// [`Error::truncated`]; [`Error::invalid`] without the reply bit; [`Error::too_large`] for more than
    /// [`EXTENDED_STATUS_MAX`] words of extended status.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        let mut r = Reader::new(bytes);
        let service = r.u8("service")?;
        if service & REPLY_BIT == 0 {
            let (found, expected) = (u32::from(service), u32::from(service | REPLY_BIT));
            return Err(Error::invalid("reply service", 0, expected, found));
        }
        r.u8("reserved")?;
        let status = GeneralStatus(r.u8("general status")?);
        let words = r.u8("extended status length")?;
        if usize::from(words) > EXTENDED_STATUS_MAX {
            let max = 8;
            return Err(Error::too_large("extended status length", max, u32::from(words)));
        }
        let mut extended = ArrayVec::new();
        for _ in 0..words {
            extended.push(r.u16("extended status")?);
        }
        Ok(Self { service: Service(service & !REPLY_BIT), status, extended, data: r.rest() })
    }

    /// Bytes of the reply.
    pub fn buffer_len(&self) -> usize {
        4 + 2 * self.extended.len() + self.data.len()
    }

    /// Writes the reply and returns its length.
    ///
    /// # Errors
    /// [`Error::truncated`].
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let mut w = Writer::new(buffer);
        w.u8("service", self.service.0 | REPLY_BIT)?;
        w.u8("reserved", 0)?;
        w.u8("general status", self.status.0)?;
        w.u8("extended status length", words_u8("extended status", 2 * self.extended.len())?)?;
        for word in &self.extended {
            w.u16("extended status", *word)?;
        }
        w.slice("data", self.data)?;
        Ok(w.written())
    }
}

impl fmt::Display for Reply<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} reply: {}", self.service, self.status)?;
        for word in &self.extended {
            write!(f, " {word:#06x}")?;
        }
        write!(f, " with {} bytes", self.data.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::wire::Expected;
    use profile_generic::wire::check::{check_vector, check_vectors};
    use proptest::prelude::*;

    #[test]
    fn vectors_both_ways() {
        let requests: &[(&str, &[u8], Request)] = &[
            (
                "Get_Attribute_Single of the vendor ID",
                &[0x0E, 3, 0x20, 1, 0x24, 1, 0x30, 1],
                Request {
                    service: Service::GET_ATTRIBUTE_SINGLE,
                    path: &[0x20, 1, 0x24, 1, 0x30, 1],
                    data: &[],
                },
            ),
            (
                "Reset type 0",
                &[5, 2, 0x20, 1, 0x24, 1, 0],
                Request { service: Service::RESET, path: &[0x20, 1, 0x24, 1], data: &[0] },
            ),
        ];
        check_vectors!(requests, Request, open_ended);
        let refused = Reply {
            extended: ArrayVec::from_iter([0x0106]),
            ..Reply::new(Service::FORWARD_OPEN, GeneralStatus::CONNECTION_FAILURE)
        };
        let vendor = Reply {
            data: &[0x34, 0x12],
            ..Reply::new(Service::GET_ATTRIBUTE_SINGLE, GeneralStatus::SUCCESS)
        };
        for (name, bytes, value) in [
            ("value", &[0x8E, 0, 0, 0, 0x34, 0x12][..], vendor),
            ("ownership conflict", &[0xD4, 0, 1, 1, 0x06, 0x01], refused),
        ] {
            check_vector!(name, bytes, &value, Reply);
            assert_eq!(value.buffer_len(), bytes.len(), "{name}");
            for cut in 0..4 {
                assert!(Reply::parse(&bytes[..cut]).is_err(), "{name} cut at {cut}");
            }
        }
        assert_eq!(
            Reply::parse(&[0xD4, 0, 1, 2, 6, 1, 0]),
            Err(Error::truncated("extended status", 6, 2, 1))
        );
    }

    #[test]
    fn a_padded_path_past_the_buffer_is_refused() {
        assert_eq!(Request::parse(&[0x0E, 200, 0x20, 1]), Err(Error::truncated("path", 2, 400, 2)));
    }

    #[test]
    fn requests_and_replies_are_not_taken_for_each_other() {
        assert!(matches!(
            Request::parse(&[0x8E, 0]),
            Err(Error { what: "service", expected: Expected::Value(_), .. })
        ));
        assert!(matches!(
            Reply::parse(&[0x0E, 0, 0, 0]),
            Err(Error { what: "reply service", expected: Expected::Value(_), .. })
        ));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn request_round_trip(service in 0u8..0x80, path in prop::collection::vec(any::<[u8; 2]>(), 0..20),
                              data in prop::collection::vec(any::<u8>(), 0..40)) {
            let path = path.concat();
            let value = Request { service: Service(service), path: &path, data: &data };
            let mut buffer = vec![0xA5; value.buffer_len()];
            prop_assert_eq!(value.emit(&mut buffer), Ok(value.buffer_len()));
            prop_assert_eq!(Request::parse(&buffer), Ok(value));
        }

        #[test]
        fn reply_round_trip(service in 0u8..0x80, status: u8,
                            extended in prop::collection::vec(any::<u16>(), 0..=EXTENDED_STATUS_MAX),
                            data in prop::collection::vec(any::<u8>(), 0..40)) {
            let value = Reply {
                service: Service(service), status: GeneralStatus(status),
                extended: extended.into_iter().collect(), data: &data,
            };
            let mut buffer = vec![0xA5; value.buffer_len()];
            prop_assert_eq!(value.emit(&mut buffer), Ok(value.buffer_len()));
            prop_assert_eq!(Reply::parse(&buffer), Ok(value));
        }

        #[test]
        fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..40)) {
            let _ = Request::parse(&bytes);
            let _ = Reply::parse(&bytes);
        }
    }
}
