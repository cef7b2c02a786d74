//! Explicit messages: header and message body.
//!
//! | byte | unfragmented | fragmented | acknowledge |
//! |---|---|---|---|
//! | 0 | header, bit 7 = 0 | header, bit 7 = 1 | header, bit 7 = 1 |
//! | 1 | body from here | [`super::Fragment`] | [`super::Fragment`] |
//! | 2 | | body from here | [`super::AcknowledgeStatus`] |
//!
//! | bits of the header | content |
//! |---|---|
//! | 7 | a fragment, or the acknowledge of one |
//! | 6 | XID, transaction ID: the response has that of its request |
//! | 5..0 | in group 2 the other side's MAC ID: in a request whose it is, in a response whom it is for |
//!
//! The body begins with the service code; bit 7 of it marks a response. A request goes on with class and instance, in the
//! widths that the server has chosen for the connection ([`BodyFormat`]), then with the data of the service. A response
//! that refuses is service 14 with a general status and an additional code, whatever the service was.

use core::fmt;

pub use crate::generated::devicenet::BodyFormat;

use super::id::MacId;
use crate::wire::status::{GeneralStatus, REPLY_BIT, Service};
use crate::wire::{Error, Reader, Writer};

/// Bytes of a body that fit beside the header without fragmentation.
pub const UNFRAGMENTED_MAX: usize = 7;

/// Bytes of a body in one fragment.
pub const FRAGMENT_MAX: usize = 6;

/// Service code of a response that refuses, without the bit of a response.
pub const ERROR_RESPONSE: u8 = 0x14;

/// Additional code of a refusal that says nothing more.
pub const NO_ADDITIONAL_CODE: u8 = 0xFF;

const FRAGMENTED: u8 = 0x80;
const XID: u8 = 0x40;

/// The first byte of an explicit message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Header {
    /// A fragment or an acknowledge.
    pub fragmented: bool,
    /// Transaction ID.
    pub xid: bool,
    /// The MAC ID.
    pub mac: MacId,
}

impl Header {
    /// Reads the byte; every value has a meaning.
    #[must_use]
    pub const fn parse(byte: u8) -> Self {
        Self { fragmented: byte & FRAGMENTED != 0, xid: byte & XID != 0, mac: MacId::from_low_bits(byte) }
    }

    /// The byte.
    #[must_use]
    pub const fn byte(self) -> u8 {
        let fragmented = if self.fragmented { FRAGMENTED } else { 0 };
        let xid = if self.xid { XID } else { 0 };
        fragmented | xid | self.mac.get()
    }
}

impl BodyFormat {
    /// Whether class and instance have 16 bits, in this order.
    const fn wide(self) -> Option<(bool, bool)> {
        match self {
            Self::CLASS_8_INSTANCE_8 => Some((false, false)),
            Self::CLASS_8_INSTANCE_16 => Some((false, true)),
            Self::CLASS_16_INSTANCE_16 => Some((true, true)),
            Self::CLASS_16_INSTANCE_8 => Some((true, false)),
            _ => None,
        }
    }

    fn widths(self) -> Result<(bool, bool), Error> {
        let (what, found) = ("message body format", u32::from(self.0));
        self.wide().ok_or(Error::invalid(what, 0, 0, found))
    }
}

/// Body of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Request<'a> {
    /// Service, without the bit of a response.
    pub service: Service,
    /// Class code.
    pub class: u16,
    /// Instance number; 0 is the class.
    pub instance: u16,
    /// Data of the service. An attribute number is its first byte where the service has one.
    pub data: &'a [u8],
}

const REQUEST: &str = "explicit request";
const RESPONSE: &str = "explicit response";

impl<'a> Request<'a> {
    /// Reads a whole body.
    ///
    /// # Errors
    /// It is too short, a response, or in a format that is not read here.
    pub fn parse(format: BodyFormat, body: &'a [u8]) -> Result<Self, Error> {
        let (class_16, instance_16) = format.widths()?;
        let reader = &mut Reader::new(body);
        let service = reader.u8(REQUEST)?;
        if service & REPLY_BIT != 0 {
            let (what, found) = ("service of a request", u32::from(service));
            return Err(Error::invalid(what, 0, found & 0x7F, found));
        }
        let mut number = |wide| if wide { reader.u16(REQUEST) } else { reader.u8(REQUEST).map(u16::from) };
        let (class, instance) = (number(class_16)?, number(instance_16)?);
        Ok(Self { service: Service(service), class, instance, data: reader.rest() })
    }

    /// Bytes that [`Self::emit`] writes in this format.
    #[must_use]
    pub fn buffer_len(&self, format: BodyFormat) -> usize {
        let (class_16, instance_16) = format.wide().unwrap_or_default();
        3 + usize::from(class_16) + usize::from(instance_16) + self.data.len()
    }

    /// Writes a whole body.
    ///
    /// # Errors
    /// A number does not fit the format, the format is not written here, or the buffer is too short.
    pub fn emit(&self, format: BodyFormat, buffer: &mut [u8]) -> Result<usize, Error> {
        let (class_16, instance_16) = format.widths()?;
        let writer = &mut Writer::new(buffer);
        writer.u8(REQUEST, self.service.0 & !REPLY_BIT)?;
        let mut number = |what, wide, value: u16| match u8::try_from(value) {
            _ if wide => writer.u16(REQUEST, value),
            Ok(value) => writer.u8(REQUEST, value),
            Err(_) => Err(Error::too_large(what, 255, u32::from(value))),
        };
        number("class in this message body format", class_16, self.class)?;
        number("instance in this message body format", instance_16, self.instance)?;
        writer.slice(REQUEST, self.data)?;
        Ok(writer.written())
    }
}

impl fmt::Display for Request<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { service, class, instance, data } = self;
        write!(f, "{service} of class {class:#04x} instance {instance}, data {data:02x?}")
    }
}

/// Body of a response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Response<'a> {
    /// Done.
    Success {
        /// Service, without the bit of a response.
        service: Service,
        /// Data of the response.
        data: &'a [u8],
    },
    /// Refused.
    Error {
        /// Why.
        status: GeneralStatus,
        /// Why more exactly, by the class; [`NO_ADDITIONAL_CODE`] for nothing more.
        additional: u8,
    },
}

impl<'a> Response<'a> {
    /// Reads a whole body.
    ///
    /// # Errors
    /// It is too short, a request, or a refusal that has not exactly two codes.
    pub fn parse(body: &'a [u8]) -> Result<Self, Error> {
        let reader = &mut Reader::new(body);
        let service = reader.u8(RESPONSE)?;
        if service & REPLY_BIT == 0 {
            let (what, found) = ("service of a response", u32::from(service));
            return Err(Error::invalid(what, 0, found | 0x80, found));
        }
        if service & !REPLY_BIT == ERROR_RESPONSE {
            let [status, additional] = reader.array(RESPONSE)?;
            reader.finish(RESPONSE)?;
            return Ok(Self::Error { status: GeneralStatus(status), additional });
        }
        Ok(Self::Success { service: Service(service & !REPLY_BIT), data: reader.rest() })
    }

    /// Bytes that [`Self::emit`] writes.
    #[must_use]
    pub const fn buffer_len(&self) -> usize {
        match self {
            Self::Success { data, .. } => 1 + data.len(),
            Self::Error { .. } => 3,
        }
    }

    /// Writes a whole body.
    ///
    /// # Errors
    /// The buffer is too short, or a success has the service code of a refusal.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let writer = &mut Writer::new(buffer);
        match *self {
            Self::Success { service, .. } if service.0 & !REPLY_BIT == ERROR_RESPONSE => {
                let (what, found) = ("service of a response", u32::from(service.0));
                return Err(Error::invalid(what, 0, 0, found));
            }
            Self::Success { service, data } => {
                writer.u8(RESPONSE, service.0 | REPLY_BIT)?;
                writer.slice(RESPONSE, data)?;
            }
            Self::Error { status, additional } => {
                writer.slice(RESPONSE, &[ERROR_RESPONSE | REPLY_BIT, status.0, additional])?;
            }
        }
        Ok(writer.written())
    }
}

impl fmt::Display for Response<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Success { service, data } => write!(f, "{service} done, data {data:02x?}"),
            Self::Error { status, additional: NO_ADDITIONAL_CODE } => write!(f, "refused: {status}"),
            Self::Error { status, additional } => {
                write!(f, "refused: {status}, additional code {additional:#04x}")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use profile_generic::wire::Expected;

    const FORMATS: [BodyFormat; 4] = [
        BodyFormat::CLASS_8_INSTANCE_8,
        BodyFormat::CLASS_8_INSTANCE_16,
        BodyFormat::CLASS_16_INSTANCE_16,
        BodyFormat::CLASS_16_INSTANCE_8,
    ];

    #[test]
    fn every_header_comes_back() {
        let mac = MacId::new(10).unwrap();
        assert_eq!(Header::parse(0x0A), Header { fragmented: false, xid: false, mac });
        assert_eq!(Header::parse(0x8A), Header { fragmented: true, xid: false, mac });
        assert_eq!(Header::parse(0x4A), Header { fragmented: false, xid: true, mac });
        for byte in 0..=255 {
            assert_eq!(Header::parse(byte).byte(), byte);
        }
    }

    /// Bodies of the ICP DAS I-7242D and BEI MHK5 manuals, and the same request in the other formats.
    #[test]
    fn requests_both_ways() {
        let set_epr =
            Request { service: Service::SET_ATTRIBUTE_SINGLE, class: 5, instance: 2, data: &[9, 0x0A, 0x0E] };
        let allocate = Request { service: Service(0x4B), class: 3, instance: 1, data: &[0x03, 0x0A] };
        let far =
            Request { service: Service::GET_ATTRIBUTE_SINGLE, class: 0x342, instance: 0x201, data: &[7] };
        let cases: [(BodyFormat, &[u8], Request<'_>); 6] = [
            (FORMATS[0], &[0x4B, 3, 1, 3, 0x0A], allocate),
            (FORMATS[0], &[0x10, 5, 2, 9, 0x0A, 0x0E], set_epr),
            (FORMATS[1], &[0x10, 5, 2, 0, 9, 0x0A, 0x0E], set_epr),
            (FORMATS[2], &[0x10, 5, 0, 2, 0, 9, 0x0A, 0x0E], set_epr),
            (FORMATS[2], &[0x0E, 0x42, 3, 1, 2, 7], far),
            (FORMATS[3], &[0x10, 5, 0, 2, 9, 0x0A, 0x0E], set_epr),
        ];
        for (format, bytes, request) in cases {
            assert_eq!(Request::parse(format, bytes), Ok(request), "{format}");
            assert_eq!(request.buffer_len(format), bytes.len(), "{format}");
            let mut buffer = [0xA5; 12];
            assert_eq!(request.emit(format, &mut buffer), Ok(bytes.len()), "{format}");
            assert_eq!((&buffer[..bytes.len()], buffer[bytes.len()]), (bytes, 0xA5), "{format}");
            let head = bytes.len() - request.data.len();
            for cut in 0..head {
                assert!(Request::parse(format, &bytes[..cut]).is_err(), "{format} cut at {cut}");
            }
            for room in 0..bytes.len() {
                assert!(request.emit(format, &mut buffer[..room]).is_err(), "{format} into {room} bytes");
            }
        }
        let buffer = &mut [0; 12];
        assert!(matches!(far.emit(FORMATS[0], buffer), Err(Error { expected: Expected::AtMost(255), .. })));
        let instance = Request { class: 5, ..far };
        assert!(matches!(
            instance.emit(FORMATS[0], buffer),
            Err(Error { expected: Expected::AtMost(255), .. })
        ));
        for format in [BodyFormat::CIP_PATH, BodyFormat(9)] {
            assert!(
                matches!(set_epr.emit(format, buffer), Err(Error { expected: Expected::Value(_), .. })),
                "{format}"
            );
            assert!(
                matches!(Request::parse(format, &[0; 8]), Err(Error { expected: Expected::Value(_), .. })),
                "{format}"
            );
        }
        let response = Request::parse(FORMATS[0], &[0x90, 5, 2]).map_err(|error| error.to_string());
        assert_eq!(response, Err("service of a request at byte 0: expected 0x10, found 0x90".to_owned()));
    }

    #[test]
    fn responses_both_ways() {
        let cases: [(&[u8], Response<'_>); 4] = [
            (&[0xCB, 0], Response::Success { service: Service(0x4B), data: &[0] }),
            (&[0x90, 0x10, 0x0E], Response::Success { service: Service(0x10), data: &[0x10, 0x0E] }),
            (&[0x94, 0x0C, 0x01], Response::Error { status: GeneralStatus(0x0C), additional: 1 }),
            (&[0x94, 0x08, 0xFF], Response::Error { status: GeneralStatus(0x08), additional: 0xFF }),
        ];
        for (bytes, response) in cases {
            assert_eq!(Response::parse(bytes), Ok(response));
            let mut buffer = [0xA5; 8];
            assert_eq!(response.emit(&mut buffer), Ok(response.buffer_len()));
            assert_eq!((&buffer[..bytes.len()], buffer[bytes.len()]), (bytes, 0xA5));
            for cut in 0..bytes.len() {
                assert_ne!(Response::parse(&bytes[..cut]).ok(), Some(response), "cut at {cut}");
                assert!(response.emit(&mut buffer[..cut]).is_err());
            }
        }
        for bad in [&[0x94, 8][..], &[0x94, 8, 0xFF, 0], &[0x10], &[]] {
            assert!(Response::parse(bad).is_err(), "{bad:02x?}");
        }
        let disguised = Response::Success { service: Service(0x14), data: &[] };
        assert!(disguised.emit(&mut [0; 8]).is_err());
        assert_eq!(cases[2].1.to_string(), "refused: object state conflict, additional code 0x01");
        assert_eq!(cases[3].1.to_string(), "refused: service not supported");
    }

    proptest! {
        #[test]
        fn round_trips(format in 0_u8..4, service in 0_u8..0x80, class: u16, instance: u16, data in prop::collection::vec(any::<u8>(), 0..40)) {
            let format = BodyFormat(format);
            let request = Request { service: Service(service), class, instance, data: &data };
            let mut buffer = vec![0xA5; request.buffer_len(format)];
            if let Ok(len) = request.emit(format, &mut buffer) {
                prop_assert_eq!(len, buffer.len());
                prop_assert_eq!(Request::parse(format, &buffer), Ok(request));
            } else {
                prop_assert!(class > 255 || instance > 255);
            }
        }

        #[test]
        fn any_body_is_refused_or_comes_back(format in 0_u8..5, body in prop::collection::vec(any::<u8>(), 0..20)) {
            let mut buffer = vec![0xA5; 20];
            if let Ok(request) = Request::parse(BodyFormat(format), &body) {
                let len = request.emit(BodyFormat(format), &mut buffer).unwrap();
                prop_assert_eq!(&buffer[..len], &body[..]);
            }
            if let Ok(response) = Response::parse(&body) {
                let len = response.emit(&mut buffer).unwrap();
                prop_assert_eq!(&buffer[..len], &body[..]);
            }
        }
    }
}
