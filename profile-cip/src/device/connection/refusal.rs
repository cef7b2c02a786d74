//! Why a Forward_Open is refused, with everything its reply and the log have to say.

use arrayvec::ArrayVec;

use crate::wire::message_router::EXTENDED_STATUS_MAX;
use crate::wire::status::{ConnectionStatus, GeneralStatus};

/// A refusal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Refusal {
    pub general: GeneralStatus,
    pub extended: ArrayVec<u16, EXTENDED_STATUS_MAX>,
    /// The value the request had, where the refusal is about one.
    pub found: Option<u32>,
    /// The value that would be taken, where there is one.
    pub expected: Option<u32>,
    /// Words of the path not processed.
    pub remaining_path_words: u8,
}

impl Refusal {
    pub fn new(general: GeneralStatus, extended: u16) -> Self {
        Self { extended: ArrayVec::from_iter([extended]), ..Self::general(general) }
    }

    /// A general status alone.
    pub fn general(general: GeneralStatus) -> Self {
        Self { general, extended: ArrayVec::new(), found: None, expected: None, remaining_path_words: 0 }
    }

    /// General status 0x01 and this extended one.
    pub fn connection(status: ConnectionStatus) -> Self {
        Self::new(GeneralStatus::CONNECTION_FAILURE, status.0)
    }

    /// As [`Refusal::connection`], about a value.
    pub fn value(status: ConnectionStatus, found: u32, expected: u32) -> Self {
        Self { found: Some(found), expected: Some(expected), ..Self::connection(status) }
    }

    /// A connection size that cannot be; the reply carries the one that can.
    pub fn size(status: ConnectionStatus, found: u16, expected: u16) -> Self {
        let mut refusal = Self::value(status, u32::from(found), u32::from(expected));
        refusal.extended.push(expected);
        refusal
    }

    /// Packet intervals that cannot be; the reply carries acceptable ones, O->T then T->O, each low word
    /// first.
    pub fn intervals(found_us: u32, o_to_t_us: u32, t_to_o_us: u32) -> Self {
        let mut refusal = Self::value(ConnectionStatus::RPI_NOT_SUPPORTED, found_us, o_to_t_us);
        for acceptable in [o_to_t_us, t_to_o_us] {
            let [a, b, c, d] = acceptable.to_le_bytes();
            refusal.extended.extend([u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d])]);
        }
        refusal
    }

    /// A packet interval T->O that is not the one of the multicast stream; the reply says of both, O->T first,
    /// what they are, and then which ones would do.
    pub fn stream_interval(found_us: u32, o_to_t_us: u32, t_to_o_us: u32) -> Self {
        /// The interval is acceptable.
        const ACCEPTABLE: u8 = 0;
        /// No other interval would do.
        const REQUIRED: u8 = 4;
        let mut refusal = Self::value(ConnectionStatus::RPI_NOT_ACCEPTABLE, found_us, t_to_o_us);
        let [a, b, c, d] = o_to_t_us.to_le_bytes();
        let [e, f, g, h] = t_to_o_us.to_le_bytes();
        let octets = [[ACCEPTABLE, REQUIRED], [a, b], [c, d], [e, f], [g, h]];
        refusal.extended.extend(octets.map(u16::from_le_bytes));
        refusal
    }

    /// First word of extended status, 0 without one.
    pub fn first_extended(&self) -> u16 {
        self.extended.first().copied().unwrap_or(0)
    }
}
