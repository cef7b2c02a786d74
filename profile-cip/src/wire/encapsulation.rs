//! The encapsulation header of EtherNet/IP and the packet it heads.
//!
//! | offset | size | field |
//! |---|---|---|
//! | 0 | 2 | command |
//! | 2 | 2 | length of the data behind the header, in bytes |
//! | 4 | 4 | session handle |
//! | 8 | 4 | status, 0 in requests |
//! | 12 | 8 | sender context, returned unchanged |
//! | 20 | 4 | options, 0 |
//! | 24 | length | command-specific data |
//!
//! The same layout is used on TCP (a stream of packets) and on UDP (one packet a datagram).

use super::{Error, Reader, Writer};
use core::fmt;
use profile_generic::open_code;

/// Length of the header in bytes.
pub const HEADER_LEN: usize = 24;

/// TCP and UDP port of explicit messages.
pub const EXPLICIT_PORT: u16 = 44818;

/// UDP port of class 0 and class 1 connected data.
pub const IO_PORT: u16 = 2222;

/// The one encapsulation protocol version there is.
pub const PROTOCOL_VERSION: u16 = 1;

open_code! {
    /// Encapsulation command.
    pub struct Command(u16) {
        /// Nothing to do, never answered.
        NOP = 0x0000,
        /// Which communication services are there.
        LIST_SERVICES = 0x0004,
        /// Who are you.
        LIST_IDENTITY = 0x0063,
        /// Which non-CIP interfaces are there.
        LIST_INTERFACES = 0x0064,
        /// Open the session.
        REGISTER_SESSION = 0x0065,
        /// End the session and the stream.
        UNREGISTER_SESSION = 0x0066,
        /// An unconnected message.
        SEND_RR_DATA = 0x006F,
        /// A message of an explicit connection.
        SEND_UNIT_DATA = 0x0070,
    }
}

open_code! {
    /// Encapsulation status, in replies.
    pub struct EncapsulationStatus(u32) {
        /// Done.
        SUCCESS = 0x0000,
        /// The command is unknown or not possible here.
        INVALID_COMMAND = 0x0001,
        /// No memory to handle the command.
        INSUFFICIENT_MEMORY = 0x0002,
        /// The data portion is malformed.
        INCORRECT_DATA = 0x0003,
        /// The session handle is not that of this stream.
        INVALID_SESSION_HANDLE = 0x0064,
        /// The length does not suit the command.
        INVALID_LENGTH = 0x0065,
        /// The protocol version is not supported.
        UNSUPPORTED_PROTOCOL = 0x0069,
    }
}

/// The header alone, as a stream reader needs it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// What is asked for.
    pub command: Command,
    /// Bytes behind the header.
    pub length: u16,
    /// Session the packet belongs to, 0 where there is none.
    pub session_handle: u32,
    /// Outcome, 0 in requests.
    pub status: EncapsulationStatus,
    /// Returned unchanged in the reply.
    pub sender_context: [u8; 8],
    /// Reserved; packets with other than 0 are dropped by the receiver.
    pub options: u32,
}

impl Header {
    /// Reads the header at the start of `bytes`; more may follow.
    ///
    /// # Errors
    /// [`Error::truncated`].
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let mut r = Reader::new(bytes);
        Ok(Self {
            command: Command(r.u16("encapsulation command")?),
            length: r.u16("encapsulation length")?,
            session_handle: r.u32("session handle")?,
            status: EncapsulationStatus(r.u32("encapsulation status")?),
            sender_context: r.array("sender context")?,
            options: r.u32("encapsulation options")?,
        })
    }

    /// Always [`HEADER_LEN`].
    pub const fn buffer_len(&self) -> usize {
        HEADER_LEN
    }

    /// Writes the header and returns its length.
    ///
    /// # Errors
    /// [`Error::truncated`].
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let mut w = Writer::new(buffer);
        w.u16("encapsulation command", self.command.0)?;
        w.u16("encapsulation length", self.length)?;
        w.u32("session handle", self.session_handle)?;
        w.u32("encapsulation status", self.status.0)?;
        w.slice("sender context", &self.sender_context)?;
        w.u32("encapsulation options", self.options)?;
        Ok(w.written())
    }
}

/// A whole packet: header and data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Packet<'a> {
    /// What is asked for.
    pub command: Command,
    /// Session the packet belongs to, 0 where there is none.
    pub session_handle: u32,
    /// Outcome, 0 in requests.
    pub status: EncapsulationStatus,
    /// Returned unchanged in the reply.
    pub sender_context: [u8; 8],
    /// Reserved, 0.
    pub options: u32,
    /// Command-specific data, at most 65535 bytes.
    pub data: &'a [u8],
}

impl<'a> Packet<'a> {
    /// Reads exactly one packet: a datagram, or a slice cut out of a stream by [`Header::length`].
    ///
    /// # Errors
    /// [`Error::truncated`]; [`Error::trailing`] if the length field leaves bytes over.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        let header = Header::parse(bytes)?;
        let mut r = Reader::new(bytes);
        r.take("encapsulation header", HEADER_LEN)?;
        let data = r.take("encapsulation data", usize::from(header.length))?;
        r.finish("encapsulation packet")?;
        Ok(Self {
            command: header.command,
            session_handle: header.session_handle,
            status: header.status,
            sender_context: header.sender_context,
            options: header.options,
            data,
        })
    }

    /// Header and data in bytes.
    pub const fn buffer_len(&self) -> usize {
        HEADER_LEN + self.data.len()
    }

    /// Writes the packet and returns its length.
    ///
    /// # Errors
    /// [`Error::truncated`]; [`Error::too_large`] if the data is longer than the length field can say.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let header = Header {
            command: self.command,
            length: length_u16("encapsulation data", self.data.len())?,
            session_handle: self.session_handle,
            status: self.status,
            sender_context: self.sender_context,
            options: self.options,
        };
        let mut w = Writer::new(buffer);
        header.emit(w.reserve("encapsulation header", HEADER_LEN)?)?;
        w.slice("encapsulation data", self.data)?;
        Ok(w.written())
    }
}

impl fmt::Display for Packet<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} session {:#010x} status {} with {} bytes",
            self.command,
            self.session_handle,
            self.status,
            self.data.len()
        )
    }
}

/// A length as the 16-bit field that carries it.
///
/// # Errors
/// [`Error::too_large`] naming `what` above 65535.
pub(crate) fn length_u16(what: &'static str, length: usize) -> Result<u16, Error> {
    u16::try_from(length)
        .map_err(|_| Error::too_large(what, u32::from(u16::MAX), u32::try_from(length).unwrap_or(u32::MAX)))
}

/// A length in bytes as the 8-bit count of 16-bit words that carries it.
///
/// # Errors
/// [`Error::too_large`] naming `what` above 510 bytes, [`Error::invalid`] for an odd length.
pub(crate) fn words_u8(what: &'static str, length: usize) -> Result<u8, Error> {
    let value = u32::try_from(length).unwrap_or(u32::MAX);
    if !length.is_multiple_of(2) {
        return Err(Error::invalid(what, 0, value.saturating_add(1), value));
    }
    u8::try_from(length / 2).map_err(|_| Error::too_large(what, 510, value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::wire::check::check_vectors;
    use proptest::prelude::*;

    // Layout: encapsulation header table above; RegisterSession with protocol version 1.
    const VECTORS: &[(&str, &[u8], Packet<'static>)] = &[
        (
            "RegisterSession request",
            &[0x65, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 0, 0, 0, 0, 1, 0, 0, 0],
            Packet {
                command: Command::REGISTER_SESSION,
                session_handle: 0,
                status: EncapsulationStatus::SUCCESS,
                sender_context: [1, 2, 3, 4, 5, 6, 7, 8],
                options: 0,
                data: &[1, 0, 0, 0],
            },
        ),
        (
            "refused SendRRData",
            &[0x6F, 0, 0, 0, 0x44, 0x33, 0x22, 0x11, 0x64, 0, 0, 0, 9, 9, 9, 9, 9, 9, 9, 9, 0, 0, 0, 0],
            Packet {
                command: Command::SEND_RR_DATA,
                session_handle: 0x1122_3344,
                status: EncapsulationStatus::INVALID_SESSION_HANDLE,
                sender_context: [9; 8],
                options: 0,
                data: &[],
            },
        ),
    ];

    #[test]
    fn vectors_both_ways() {
        check_vectors!(VECTORS, Packet);
    }

    #[test]
    fn a_length_field_that_leaves_bytes_over_is_refused() {
        let mut bytes = [0; 30];
        bytes[2] = 4;
        assert_eq!(Packet::parse(&bytes), Err(Error::trailing("encapsulation packet", 28, 2)));
    }

    #[test]
    fn more_data_than_the_length_field_holds_is_refused() {
        let data = vec![0; 65536];
        let packet = Packet { data: &data, ..VECTORS[0].2 };
        let mut buffer = vec![0; packet.buffer_len()];
        assert_eq!(packet.emit(&mut buffer), Err(Error::too_large("encapsulation data", 65535, 65536)));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn round_trip(command: u16, session_handle: u32, status: u32, sender_context: [u8; 8], options: u32,
                      data in prop::collection::vec(any::<u8>(), 0..64)) {
            let packet = Packet {
                command: Command(command), session_handle, status: EncapsulationStatus(status),
                sender_context, options, data: &data,
            };
            let mut buffer = vec![0xA5; packet.buffer_len()];
            prop_assert_eq!(packet.emit(&mut buffer), Ok(packet.buffer_len()));
            prop_assert_eq!(Packet::parse(&buffer), Ok(packet));
        }

        #[test]
        fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..80)) {
            if let Ok(packet) = Packet::parse(&bytes) {
                prop_assert_eq!(packet.data, &bytes[HEADER_LEN..]);
            }
        }
    }
}
