//! Forward_Open (0x54) and Large_Forward_Open (0x5B): service data of request and replies.
//!
//! | offset | size | request |
//! |---|---|---|
//! | 0 | 1 | priority (bit 4) and time tick (bits 3..0: 2^n ms) |
//! | 1 | 1 | time-out ticks |
//! | 2 | 4 | O->T connection ID |
//! | 6 | 4 | T->O connection ID |
//! | 10 | 8 | triad |
//! | 18 | 1 | time-out multiplier, 0..7 = 4..512 intervals |
//! | 19 | 3 | reserved |
//! | 22 | 4 | O->T requested packet interval in microseconds |
//! | 26 | 2 (4) | O->T network connection parameters |
//! | 28 (30) | 4 | T->O requested packet interval in microseconds |
//! | 32 (34) | 2 (4) | T->O network connection parameters |
//! | 34 (38) | 1 | transport class and trigger |
//! | 35 (39) | 1 | connection path length in words |
//! | 36 (40) | | connection path, padded EPATH |
//!
//! Offsets in brackets are those of the large form. The success reply: both connection IDs, triad, both
//! actual packet intervals, reply length in words u8, reserved u8, application reply. The failure reply:
//! triad, words of the path not processed u8, reserved u8.

use super::encapsulation::words_u8;
use super::network_parameters::NetworkParameters;
use super::status::Service;
use super::triad::{ConnectionTriad, TRIAD_LEN};
use super::{Error, Reader, Writer};
use core::fmt;
use profile_generic::open_code;
use profile_generic::time::DurationNs;

/// A connection is not timed out sooner than this before its first message.
pub const FIRST_MESSAGE_TIMEOUT: DurationNs = DurationNs::from_secs(10);

open_code! {
    /// Production trigger of a transport.
    pub struct Trigger(u8) {
        /// At every packet interval.
        CYCLIC = 0 => "cyclic",
        /// When the data change.
        CHANGE_OF_STATE = 1 => "change of state",
        /// When the application says so.
        APPLICATION = 2 => "application",
    }
}

/// Transport class and trigger byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Transport {
    /// Bit 7: the target is the server of this transport.
    pub server: bool,
    /// Bits 6..4.
    pub trigger: Trigger,
    /// Bits 3..0: transport class 0, 1, 2 or 3.
    pub class: u8,
}

impl Transport {
    /// From the byte on the wire.
    pub const fn from_u8(byte: u8) -> Self {
        Self { server: byte & 0x80 != 0, trigger: Trigger(byte >> 4 & 7), class: byte & 0x0F }
    }

    /// The byte on the wire; values too large for their bits are cut to them.
    pub const fn to_u8(self) -> u8 {
        (if self.server { 0x80 } else { 0 }) | (self.trigger.0 & 7) << 4 | self.class & 0x0F
    }
}

/// A Forward_Open or Large_Forward_Open request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ForwardOpen<'a> {
    /// Whether parameters are in the 32-bit form (service 0x5B).
    pub large: bool,
    /// Priority and time tick of the request itself.
    pub priority_tick: u8,
    /// Time-out of the request itself in ticks.
    pub timeout_ticks: u8,
    /// O->T connection ID: 0 or a proposal for point to point, chosen by the target.
    pub o_to_t_id: u32,
    /// T->O connection ID, chosen by the originator for point to point.
    pub t_to_o_id: u32,
    /// Who asks, and for which connection.
    pub triad: ConnectionTriad,
    /// Time-out multiplier code; see [`ForwardOpen::multiplier`].
    pub timeout_multiplier: u8,
    /// O->T requested packet interval in microseconds.
    pub o_to_t_rpi_us: u32,
    /// O->T parameters.
    pub o_to_t: NetworkParameters,
    /// T->O requested packet interval in microseconds.
    pub t_to_o_rpi_us: u32,
    /// T->O parameters.
    pub t_to_o: NetworkParameters,
    /// Transport class and trigger.
    pub transport: Transport,
    /// Connection path, padded EPATH of even length up to 510 bytes.
    pub path: &'a [u8],
}

impl<'a> ForwardOpen<'a> {
    /// Reads the data of a Forward_Open, or with `large` of a Large_Forward_Open.
    ///
    /// # Errors
    /// [`Error::truncated`], [`Error::trailing`].
    // Flat: one line per field, each with its error.
    pub fn parse(bytes: &'a [u8], large: bool) -> Result<Self, Error> {
        let mut r = Reader::new(bytes);
        let priority_tick = r.u8("priority and time tick")?;
        let timeout_ticks = r.u8("time-out ticks")?;
        let o_to_t_id = r.u32("O->T connection ID")?;
        let t_to_o_id = r.u32("T->O connection ID")?;
        let triad = ConnectionTriad::read(&mut r)?;
        let timeout_multiplier = r.u8("time-out multiplier")?;
        r.take("reserved", 3)?;
        let o_to_t_rpi_us = r.u32("O->T RPI")?;
        let o_to_t = read_parameters(&mut r, "O->T parameters", large)?;
        let t_to_o_rpi_us = r.u32("T->O RPI")?;
        let t_to_o = read_parameters(&mut r, "T->O parameters", large)?;
        let transport = Transport::from_u8(r.u8("transport class and trigger")?);
        let words = r.u8("connection path length")?;
        let path = r.take("connection path", 2 * usize::from(words))?;
        r.finish("Forward_Open")?;
        Ok(Self {
            large,
            priority_tick,
            timeout_ticks,
            o_to_t_id,
            t_to_o_id,
            triad,
            timeout_multiplier,
            o_to_t_rpi_us,
            o_to_t,
            t_to_o_rpi_us,
            t_to_o,
            transport,
            path,
        })
    }

    /// Bytes of the request data.
    pub const fn buffer_len(&self) -> usize {
        (if self.large { 40 } else { 36 }) + self.path.len()
    }

    /// Writes the request data and returns its length.
    ///
    /// # Errors
    /// [`Error::truncated`]; [`Error::too_large`] for a size above 511 in the small form or a path above 510
    /// bytes; [`Error::invalid`] for a path of odd length.
    // Flat: one line per field, each with its error.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let mut w = Writer::new(buffer);
        w.u8("priority and time tick", self.priority_tick)?;
        w.u8("time-out ticks", self.timeout_ticks)?;
        w.u32("O->T connection ID", self.o_to_t_id)?;
        w.u32("T->O connection ID", self.t_to_o_id)?;
        self.triad.write(&mut w)?;
        w.u8("time-out multiplier", self.timeout_multiplier)?;
        w.zeros("reserved", 3)?;
        w.u32("O->T RPI", self.o_to_t_rpi_us)?;
        write_parameters(&mut w, "O->T parameters", self.o_to_t, self.large)?;
        w.u32("T->O RPI", self.t_to_o_rpi_us)?;
        write_parameters(&mut w, "T->O parameters", self.t_to_o, self.large)?;
        w.u8("transport class and trigger", self.transport.to_u8())?;
        w.u8("connection path length", words_u8("connection path", self.path.len())?)?;
        w.slice("connection path", self.path)?;
        Ok(w.written())
    }

    /// The service code this request is sent with.
    pub const fn service(&self) -> Service {
        if self.large { Service::LARGE_FORWARD_OPEN } else { Service::FORWARD_OPEN }
    }

    /// How many intervals of silence end the connection, or `None` for a reserved code.
    pub const fn multiplier(&self) -> Option<u16> {
        multiplier(self.timeout_multiplier)
    }
}

/// How many intervals a time-out multiplier code stands for: 0..=7 are 4, 8, .. 512; others are reserved.
pub const fn multiplier(code: u8) -> Option<u16> {
    if code <= 7 { Some(4 << code) } else { None }
}

fn read_parameters(r: &mut Reader<'_>, what: &'static str, large: bool) -> Result<NetworkParameters, Error> {
    if large {
        Ok(NetworkParameters::from_u32(r.u32(what)?))
    } else {
        Ok(NetworkParameters::from_u16(r.u16(what)?))
    }
}

fn write_parameters(
    w: &mut Writer<'_>,
    what: &'static str,
    value: NetworkParameters,
    large: bool,
) -> Result<(), Error> {
    if large { w.u32(what, value.to_u32()) } else { w.u16(what, value.to_u16()?) }
}

impl fmt::Display for ForwardOpen<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} of {}: class {} {}, O->T {} every {} us, T->O {} every {} us",
            self.service(),
            self.triad,
            self.transport.class,
            self.transport.trigger,
            self.o_to_t,
            self.o_to_t_rpi_us,
            self.t_to_o,
            self.t_to_o_rpi_us
        )
    }
}

/// Data of a successful reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ForwardOpenReply<'a> {
    /// O->T connection ID to be used.
    pub o_to_t_id: u32,
    /// T->O connection ID to be used.
    pub t_to_o_id: u32,
    /// As in the request.
    pub triad: ConnectionTriad,
    /// O->T actual packet interval in microseconds.
    pub o_to_t_api_us: u32,
    /// T->O actual packet interval in microseconds.
    pub t_to_o_api_us: u32,
    /// What the application adds, of even length up to 510 bytes.
    pub application_reply: &'a [u8],
}

impl<'a> ForwardOpenReply<'a> {
    /// Reads the reply data.
    ///
    /// # Errors
    /// [`Error::truncated`], [`Error::trailing`].
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        let mut r = Reader::new(bytes);
        let o_to_t_id = r.u32("O->T connection ID")?;
        let t_to_o_id = r.u32("T->O connection ID")?;
        let triad = ConnectionTriad::read(&mut r)?;
        let o_to_t_api_us = r.u32("O->T API")?;
        let t_to_o_api_us = r.u32("T->O API")?;
        let words = r.u8("application reply length")?;
        r.u8("reserved")?;
        let application_reply = r.take("application reply", 2 * usize::from(words))?;
        r.finish("Forward_Open reply")?;
        Ok(Self { o_to_t_id, t_to_o_id, triad, o_to_t_api_us, t_to_o_api_us, application_reply })
    }

    /// Bytes of the reply data.
    pub const fn buffer_len(&self) -> usize {
        26 + self.application_reply.len()
    }

    /// Writes the reply data and returns its length.
    ///
    /// # Errors
    /// [`Error::truncated`]; [`Error::too_large`] and [`Error::invalid`] for an application reply too long
    /// or odd.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let mut w = Writer::new(buffer);
        w.u32("O->T connection ID", self.o_to_t_id)?;
        w.u32("T->O connection ID", self.t_to_o_id)?;
        self.triad.write(&mut w)?;
        w.u32("O->T API", self.o_to_t_api_us)?;
        w.u32("T->O API", self.t_to_o_api_us)?;
        w.u8("application reply length", words_u8("application reply", self.application_reply.len())?)?;
        w.u8("reserved", 0)?;
        w.slice("application reply", self.application_reply)?;
        Ok(w.written())
    }
}

/// Data of a refused Forward_Open, Large_Forward_Open or Forward_Close.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConnectionFailure {
    /// As in the request.
    pub triad: ConnectionTriad,
    /// Words of the connection path that were not processed.
    pub remaining_path_words: u8,
}

/// Length of [`ConnectionFailure`] in bytes.
pub const CONNECTION_FAILURE_LEN: usize = TRIAD_LEN + 2;

impl ConnectionFailure {
    /// Reads the reply data.
    ///
    /// # Errors
    /// [`Error::truncated`], [`Error::trailing`].
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let mut r = Reader::new(bytes);
        let triad = ConnectionTriad::read(&mut r)?;
        let remaining_path_words = r.u8("remaining path size")?;
        r.u8("reserved")?;
        r.finish("connection failure")?;
        Ok(Self { triad, remaining_path_words })
    }

    /// Always [`CONNECTION_FAILURE_LEN`].
    pub const fn buffer_len(&self) -> usize {
        CONNECTION_FAILURE_LEN
    }

    /// Writes the reply data and returns its length.
    ///
    /// # Errors
    /// [`Error::truncated`].
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let mut w = Writer::new(buffer);
        self.triad.write(&mut w)?;
        w.u8("remaining path size", self.remaining_path_words)?;
        w.u8("reserved", 0)?;
        Ok(w.written())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::wire::check::check_vectors;
    use proptest::prelude::*;

    const TRIAD: ConnectionTriad = ConnectionTriad {
        connection_serial: 0x1234,
        originator_vendor: 0x0001,
        originator_serial: 0xCAFE_F00D,
    };

    // The request layout above with the path and sizes of Volume 9 clause 7-1.1.
    const REQUEST: ForwardOpen<'static> = ForwardOpen {
        large: false,
        priority_tick: 0x0A,
        timeout_ticks: 0x0E,
        o_to_t_id: 0,
        t_to_o_id: 0x8001_0002,
        triad: TRIAD,
        timeout_multiplier: 1,
        o_to_t_rpi_us: 4000,
        o_to_t: NetworkParameters {
            redundant_owner: false,
            connection_type: super::super::network_parameters::ConnectionType::POINT_TO_POINT,
            priority: super::super::network_parameters::Priority::URGENT,
            variable: true,
            size: 220,
        },
        t_to_o_rpi_us: 4000,
        t_to_o: NetworkParameters {
            redundant_owner: false,
            connection_type: super::super::network_parameters::ConnectionType::POINT_TO_POINT,
            priority: super::super::network_parameters::Priority::URGENT,
            variable: true,
            size: 220,
        },
        transport: Transport { server: false, trigger: Trigger::CYCLIC, class: 1 },
        path: &[0x20, 0x42, 0x2C, 0x51, 0x2C, 0x02],
    };

    #[rustfmt::skip]
    const SMALL: &[u8] = &[
        0x0A, 0x0E, 0, 0, 0, 0, 0x02, 0x00, 0x01, 0x80, 0x34, 0x12, 0x01, 0x00, 0x0D, 0xF0, 0xFE, 0xCA,
        1, 0, 0, 0,
        0xA0, 0x0F, 0, 0, 0xDC, 0x4E, 0xA0, 0x0F, 0, 0, 0xDC, 0x4E, 0x01, 3,
        0x20, 0x42, 0x2C, 0x51, 0x2C, 0x02,
    ];
    #[rustfmt::skip]
    const LARGE: &[u8] = &[
        0x0A, 0x0E, 0, 0, 0, 0, 0x02, 0x00, 0x01, 0x80, 0x34, 0x12, 0x01, 0x00, 0x0D, 0xF0, 0xFE, 0xCA,
        1, 0, 0, 0,
        0xA0, 0x0F, 0, 0, 0xDC, 0, 0, 0x4E, 0xA0, 0x0F, 0, 0, 0xDC, 0, 0, 0x4E, 0x01, 3,
        0x20, 0x42, 0x2C, 0x51, 0x2C, 0x02,
    ];

    #[test]
    fn request_vectors_both_ways() {
        for (bytes, large) in [(SMALL, false), (LARGE, true)] {
            let value = ForwardOpen { large, ..REQUEST };
            assert_eq!(ForwardOpen::parse(bytes, large), Ok(value));
            assert_eq!(value.buffer_len(), bytes.len());
            let mut buffer = vec![0xA5; bytes.len() + 2];
            assert_eq!(value.emit(&mut buffer), Ok(bytes.len()));
            assert_eq!(&buffer[..bytes.len()], bytes);
            for cut in 0..bytes.len() {
                assert!(ForwardOpen::parse(&bytes[..cut], large).is_err(), "cut at {cut}");
                assert!(value.emit(&mut buffer[..cut]).is_err(), "into {cut}");
            }
            let longer = [bytes, &[0][..]].concat();
            assert_eq!(
                ForwardOpen::parse(&longer, large),
                Err(Error::trailing("Forward_Open", bytes.len(), 1))
            );
        }
        assert_eq!(
            REQUEST.to_string(),
            "Forward_Open of connection 0x1234 of vendor 0x0001 serial 0xcafef00d: class 1 cyclic, \
             O->T point to point, urgent priority, up to 220 bytes every 4000 us, \
             T->O point to point, urgent priority, up to 220 bytes every 4000 us"
        );
    }

    #[test]
    fn reply_vectors_both_ways() {
        let replies: &[(&str, &[u8], ForwardOpenReply)] = &[(
            "success",
            &[
                1, 0, 0, 0xC0, 2, 0, 1, 0x80, 0x34, 0x12, 1, 0, 0x0D, 0xF0, 0xFE, 0xCA, 0xA0, 0x0F, 0, 0,
                0xA0, 0x0F, 0, 0, 1, 0, 7, 8,
            ],
            ForwardOpenReply {
                o_to_t_id: 0xC000_0001,
                t_to_o_id: 0x8001_0002,
                triad: TRIAD,
                o_to_t_api_us: 4000,
                t_to_o_api_us: 4000,
                application_reply: &[7, 8],
            },
        )];
        check_vectors!(replies, ForwardOpenReply);
        let failures: &[(&str, &[u8], ConnectionFailure)] = &[(
            "refusal",
            &[0x34, 0x12, 1, 0, 0x0D, 0xF0, 0xFE, 0xCA, 3, 0],
            ConnectionFailure { triad: TRIAD, remaining_path_words: 3 },
        )];
        check_vectors!(failures, ConnectionFailure);
    }

    #[test]
    fn transport_and_multiplier() {
        let explicit = Transport { server: true, trigger: Trigger::APPLICATION, class: 3 };
        assert_eq!(explicit.to_u8(), 0xA3);
        assert_eq!(Transport::from_u8(0xA3), explicit);
        assert_eq!(multiplier(0), Some(4));
        assert_eq!(multiplier(7), Some(512));
        assert_eq!(multiplier(8), None);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn round_trip(large: bool, head: [u8; 2], ids: [u32; 2], triad: (u16, u16, u32),
                      timeout_multiplier: u8, rpis: [u32; 2], parameters: [u32; 2], transport: u8,
                      path in prop::collection::vec(any::<[u8; 2]>(), 0..30)) {
            let parameter = |word: u32| if large { NetworkParameters::from_u32(word) } else {
                let [low, high, ..] = word.to_le_bytes();
                NetworkParameters::from_u16(u16::from_le_bytes([low, high]))
            };
            let path = path.concat();
            let value = ForwardOpen {
                large, priority_tick: head[0], timeout_ticks: head[1], o_to_t_id: ids[0], t_to_o_id: ids[1],
                triad: ConnectionTriad {
                    connection_serial: triad.0, originator_vendor: triad.1, originator_serial: triad.2,
                },
                timeout_multiplier, o_to_t_rpi_us: rpis[0], o_to_t: parameter(parameters[0]),
                t_to_o_rpi_us: rpis[1], t_to_o: parameter(parameters[1]),
                transport: Transport::from_u8(transport), path: &path,
            };
            let mut buffer = vec![0xA5; value.buffer_len()];
            prop_assert_eq!(value.emit(&mut buffer), Ok(value.buffer_len()));
            prop_assert_eq!(ForwardOpen::parse(&buffer, large), Ok(value));
        }

        #[test]
        fn reply_round_trip(ids: [u32; 2], apis: [u32; 2],
                            reply in prop::collection::vec(any::<[u8; 2]>(), 0..9)) {
            let reply = reply.concat();
            let value = ForwardOpenReply {
                o_to_t_id: ids[0], t_to_o_id: ids[1], triad: TRIAD, o_to_t_api_us: apis[0],
                t_to_o_api_us: apis[1], application_reply: &reply,
            };
            let mut buffer = vec![0xA5; value.buffer_len()];
            prop_assert_eq!(value.emit(&mut buffer), Ok(value.buffer_len()));
            prop_assert_eq!(ForwardOpenReply::parse(&buffer), Ok(value));
        }
    }
}
