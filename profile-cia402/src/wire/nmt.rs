//! NMT commands, and the state of a device that they change.

pub use crate::generated::codes::{NmtCommand, NmtState};
use core::fmt;

use super::cob_id::NodeId;
use profile_generic::wire::{Error, exact};

/// Bytes of a command.
pub const NMT_LEN: usize = 2;

impl NmtState {
    /// Whether SDOs are served.
    #[must_use]
    pub const fn has_sdo(self) -> bool {
        matches!(self, Self::OPERATIONAL | Self::PRE_OPERATIONAL)
    }

    /// Whether PDOs are sent and taken.
    #[must_use]
    pub const fn has_pdo(self) -> bool {
        matches!(self, Self::OPERATIONAL)
    }
}

/// An NMT command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Nmt {
    /// What to do.
    pub command: NmtCommand,
    /// Who; `None` for all devices.
    pub node: Option<NodeId>,
}

impl Nmt {
    /// Reads a command.
    ///
    /// # Errors
    /// [`Error`] unless there are two bytes and the second one is 0 to 127.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let [command, node] = exact::<NMT_LEN>("NMT command", bytes)?;
        let node = if node == 0 { None } else { Some(NodeId::new(node)?) };
        Ok(Self { command: NmtCommand(command), node })
    }

    /// The bytes.
    #[must_use]
    pub fn emit(&self) -> [u8; NMT_LEN] {
        [self.command.0, self.node.map_or(0, NodeId::get)]
    }
}

impl fmt::Display for Nmt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.node {
            Some(node) => write!(f, "NMT {} node {node}", self.command),
            None => write!(f, "NMT {} all nodes", self.command),
        }
    }
}

#[cfg(test)]
mod tests {
    use profile_generic::wire::check::check_vectors;
    use proptest::prelude::*;

    use super::*;

    /// Source, bytes, command, node (0 for all), text.
    const VECTORS: &[(&str, [u8; 2], u8, u8, &str)] = &[
        ("CO_NMT_Heartbeat.h", [1, 0], 1, 0, "NMT start all nodes"),
        ("canopen tests: test_nmt", [2, 0], 2, 0, "NMT stop all nodes"),
        ("CO_NMT_Heartbeat.h", [0x80, 127], 128, 127, "NMT enter pre-operational node 127"),
        ("CO_NMT_Heartbeat.h", [0x81, 1], 129, 1, "NMT reset node node 1"),
        ("CO_NMT_Heartbeat.h", [0x82, 0], 130, 0, "NMT reset communication all nodes"),
        ("unknown command, kept", [0x83, 0], 131, 0, "NMT 0x83 all nodes"),
    ];

    #[test]
    fn vectors_both_ways() {
        for &(source, bytes, command, node, text) in VECTORS {
            let value = Nmt { command: NmtCommand(command), node: NodeId::new(node).ok() };
            check_vectors!(&[(source, bytes, value)], Nmt, whole);
            assert_eq!(value.to_string(), text);
        }
    }

    #[test]
    fn wrong_nodes_are_named() {
        let error = Nmt::parse(&[1, 128]).unwrap_err();
        assert_eq!(error.to_string(), "node-id: expected 1 to 127, got 0x80");
    }

    #[test]
    fn services_by_state() {
        let states = [NmtState::BOOT_UP, NmtState::STOPPED, NmtState::OPERATIONAL, NmtState::PRE_OPERATIONAL];
        assert_eq!(states.map(NmtState::has_sdo), [false, false, true, true]);
        assert_eq!(states.map(NmtState::has_pdo), [false, false, true, false]);
    }

    proptest! {
        #[test]
        fn round_trips(bytes in prop::collection::vec(any::<u8>(), 0..10)) {
            if let Ok(value) = Nmt::parse(&bytes) {
                prop_assert_eq!(&value.emit()[..], &bytes[..]);
            }
        }
    }
}
