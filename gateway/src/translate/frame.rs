//! What some bytes are: a whole Ethernet frame, a class 1 datagram, an update, a SERCOS telegram.

use profile_cip::wire::class1::{Class1Datagram, SEQUENCE_COUNT_LEN};
use profile_cip::wire::motion::codes::ConnectionFormat;
use profile_cip::wire::motion::fixed::{FixedActual, FixedCommand};
use profile_cip::wire::motion::{ActualFrame, CommandFrame, FORMAT_REVISION_RUN_IDLE, run_idle};

use crate::decode::packet::{self, Packet, is_io};

/// Octets of an update of the fixed formats.
const FIXED_LEN: usize = 16;

/// Bytes that were recognised.
#[derive(Debug, Clone, Copy)]
pub enum Recognised<'a> {
    /// An update from the controller, with its octets.
    Command(CommandFrame<'a>, &'a [u8]),
    /// The same in the fixed format.
    FixedCommand(FixedCommand),
    /// An update of the device.
    Actual(ActualFrame<'a>),
    /// The same in the fixed format.
    FixedActual(FixedActual),
    /// A SERCOS III frame from the destination address on.
    Sercos(&'a [u8]),
}

/// Why bytes are none of these.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// Ethernet with something else in it.
    #[error("{0}")]
    Other(String),
    /// Neither a frame nor a datagram nor an update.
    #[error(
        "expected an Ethernet frame, a class 1 datagram or a CIP Motion update, got {len} bytes; as an update: {error}"
    )]
    Unknown {
        /// How many bytes.
        len: usize,
        /// What an update would have to be.
        error: String,
    },
}

/// Finds out what the bytes are.
///
/// # Errors
/// [`FrameError`].
pub fn recognise(bytes: &[u8]) -> Result<Recognised<'_>, FrameError> {
    match packet::parse(bytes) {
        Packet::Sercos => return Ok(Recognised::Sercos(bytes)),
        Packet::Udp { from, to, payload } if is_io(from, to) => {
            let datagram =
                Class1Datagram::parse(payload).map_err(|error| FrameError::Other(error.to_string()))?;
            return connected(datagram.data);
        }
        Packet::Udp { from, to, .. } => {
            return Err(FrameError::Other(format!("UDP {from} -> {to} is no class 1 connection")));
        }
        Packet::Tcp(segment) => {
            let (from, to) = (segment.from, segment.to);
            return Err(FrameError::Other(format!(
                "TCP {from} -> {to}: explicit messages go by `set` and `get`"
            )));
        }
        Packet::CutUdp { .. } | Packet::Other(_) => {}
    }
    if let Ok(datagram) = Class1Datagram::parse(bytes) {
        return connected(datagram.data);
    }
    let error = match update(bytes) {
        Ok(recognised) => return Ok(recognised),
        Err(error) => error,
    };
    // The class 1 sequence count may still stand in front.
    match bytes.get(SEQUENCE_COUNT_LEN..).map(update) {
        Some(Ok(recognised)) => Ok(recognised),
        _ => Err(FrameError::Unknown { len: bytes.len(), error: error.to_string() }),
    }
}

/// The data of a datagram.
fn connected(data: &[u8]) -> Result<Recognised<'_>, FrameError> {
    if run_idle::revision_of(data) == FORMAT_REVISION_RUN_IDLE {
        let text =
            "an update of format revision 3, behind a run/idle header, is not translated; `decode` shows it";
        return Err(FrameError::Other(text.to_owned()));
    }
    update(data).map_err(|error| FrameError::Other(error.to_string()))
}

/// An update behind its sequence count.
fn update(bytes: &[u8]) -> Result<Recognised<'_>, profile_cip::wire::Error> {
    match bytes.first().copied().map(ConnectionFormat) {
        Some(ConnectionFormat::FIXED_COMMAND) if bytes.len() == FIXED_LEN => {
            FixedCommand::parse(bytes).map(Recognised::FixedCommand)
        }
        Some(ConnectionFormat::FIXED_ACTUAL) if bytes.len() == FIXED_LEN => {
            FixedActual::parse(bytes).map(Recognised::FixedActual)
        }
        Some(ConnectionFormat::VARIABLE_ACTUAL) => ActualFrame::parse(bytes).map(Recognised::Actual),
        _ => CommandFrame::parse(bytes).map(|frame| Recognised::Command(frame, bytes)),
    }
}
