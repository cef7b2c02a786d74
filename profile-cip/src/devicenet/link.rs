//! Which CAN frames are frames of DeviceNet.

use profile_generic::can::{Frame, Id};

use super::fragmentation::FragmentError;
use super::wire::{Identifier, MacId};
use crate::wire::Error;

/// Why a frame was not used. Nothing has changed by it, but what the text says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// DeviceNet has identifiers of 11 bits only.
    #[error("an identifier of 29 bits")]
    Extended,
    /// DeviceNet has no remote frames.
    #[error("a remote frame")]
    Remote,
    /// DeviceNet has classic frames only.
    #[error("a CAN FD frame")]
    Fd,
    /// 7F0 to 7FF.
    #[error("identifier {0:03X} is none of DeviceNet")]
    Identifier(u16),
    /// The node is not on line.
    #[error("the node is not on line")]
    Offline,
    /// Nobody here is meant.
    #[error("{0} is not for this node")]
    NotForUs(Identifier),
    /// The connection that it belongs to is not there, or takes no messages now.
    #[error("{0}: there is no such connection now")]
    NoConnection(Identifier),
    /// It comes from another node than the connection's.
    #[error("expected MAC ID {expected} as the other side, got {found}")]
    Peer {
        /// The connection's.
        expected: MacId,
        /// The one in the message.
        found: MacId,
    },
    /// What is in it cannot be read.
    #[error("{0}: {1}")]
    Malformed(Identifier, Error),
    /// It is no part of a message that can be put together; what has begun was dropped.
    #[error("{0}: {1}")]
    Fragment(Identifier, FragmentError),
    /// The length is not one that the connection carries.
    #[error("{identifier}: expected {expected} bytes, got {found}")]
    Length {
        /// Which message.
        identifier: Identifier,
        /// Bytes that the connection carries.
        expected: usize,
        /// Bytes that came.
        found: usize,
    },
    /// A response that nothing was asked for, or that came too late.
    #[error("{0}: nothing was asked")]
    Unasked(Identifier),
    /// Another node has this node's MAC ID.
    #[error("duplicate MAC ID {mac}: vendor {vendor:#06x}, serial {serial:#010x}")]
    DuplicateMac {
        /// The MAC ID.
        mac: MacId,
        /// Vendor ID of the other node.
        vendor: u16,
        /// Its serial number.
        serial: u32,
    },
}

/// Identifier and data of a frame.
///
/// # Errors
/// The frame is none of DeviceNet.
pub fn accept(frame: &Frame) -> Result<(Identifier, &[u8]), Refusal> {
    if frame.is_fd() {
        return Err(Refusal::Fd);
    }
    let Id::Standard(bits) = frame.id() else { return Err(Refusal::Extended) };
    if frame.is_remote() {
        return Err(Refusal::Remote);
    }
    let identifier = Identifier::parse(bits).map_err(|_| Refusal::Identifier(bits))?;
    Ok((identifier, frame.data()))
}

/// The frame of `identifier` with this data, of which eight bytes fit.
pub(super) fn frame(identifier: Identifier, data: &[u8]) -> Option<Frame> {
    Frame::new(identifier.can(), data).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_frames_are_named() {
        let id = Id::Standard(0x40F);
        let cases = [
            (Frame::new(Id::Extended(0x40F), &[0; 7]), Refusal::Extended),
            (Frame::remote(id, 7), Refusal::Remote),
            (Frame::fd(id, &[0; 7], false), Refusal::Fd),
            (Frame::new(Id::Standard(0x7F0), &[]), Refusal::Identifier(0x7F0)),
        ];
        for (frame, refusal) in cases {
            assert_eq!(accept(&frame.unwrap()), Err(refusal));
        }
        let mac = MacId::new(1).unwrap();
        let good = Frame::new(id, &[1, 2]).unwrap();
        assert_eq!(accept(&good), Ok((Identifier::DuplicateMacCheck(mac), &[1, 2][..])));
        assert_eq!(frame(Identifier::DuplicateMacCheck(mac), &[1, 2]), Some(good));
        assert_eq!(Refusal::Identifier(0x7FA).to_string(), "identifier 7FA is none of DeviceNet");
    }
}
