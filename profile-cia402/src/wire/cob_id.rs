//! Identifiers: which frame is whose, and the words of parameters that hold one.
//!
//! The default connection set:
//!
//! | identifier | frame |
//! |---|---|
//! | 000 | NMT command |
//! | 080 | SYNC |
//! | 080 + node | EMCY |
//! | 100 | TIME |
//! | 180, 280, 380, 480 + node | TPDO 1 to 4: the device transmits |
//! | 200, 300, 400, 500 + node | RPDO 1 to 4: the device receives |
//! | 580 + node | SDO, server to client |
//! | 600 + node | SDO, client to server |
//! | 700 + node | error control |
//! | 7E4, 7E5 | LSS, slave to master and master to slave |

use core::fmt;

use profile_generic::can::Id;

use profile_generic::wire::Error;

/// Number of a device on its bus, 1 to 127.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId(u8);

impl NodeId {
    /// The largest node-id.
    pub const MAX: Self = Self(127);

    /// How many there are.
    pub const COUNT: usize = 127;

    /// Checks a number.
    ///
    /// # Errors
    /// [`Error::value()`] for 0 and for more than 127.
    pub const fn new(number: u8) -> Result<Self, Error> {
        match number {
            1..=127 => Ok(Self(number)),
            _ => Err(Error::value("node-id", "1 to 127", number as u32)),
        }
    }

    /// The number.
    #[must_use]
    pub const fn get(self) -> u8 {
        self.0
    }

    /// Its place in an array of [`NodeId::COUNT`].
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize - 1
    }

    /// All node-ids, ascending.
    pub fn all() -> impl Iterator<Item = Self> {
        (1..=127).map(Self)
    }

    const fn above(self, base: u16) -> Id {
        Id::Standard(base + self.0 as u16)
    }
}

impl TryFrom<u8> for NodeId {
    type Error = Error;

    fn try_from(number: u8) -> Result<Self, Error> {
        Self::new(number)
    }
}

impl From<NodeId> for u8 {
    fn from(node: NodeId) -> u8 {
        node.0
    }
}

impl fmt::Display for NodeId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.0, f)
    }
}

impl fmt::Debug for NodeId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "NodeId({})", self.0)
    }
}

/// NMT commands.
pub const NMT: Id = Id::Standard(0x000);
/// SYNC.
pub const SYNC: Id = Id::Standard(0x080);
/// TIME.
pub const TIME: Id = Id::Standard(0x100);
/// LSS answers.
pub const LSS_RESPONSE: Id = Id::Standard(0x7E4);
/// LSS requests.
pub const LSS_REQUEST: Id = Id::Standard(0x7E5);

/// EMCY of a device.
#[must_use]
pub const fn emcy(node: NodeId) -> Id {
    node.above(0x080)
}

/// Default identifier of a PDO that a device transmits; `None` from TPDO 5 on, and for number 0.
#[must_use]
pub const fn tpdo(number: u16, node: NodeId) -> Option<Id> {
    match number {
        1..=4 => Some(node.above(0x080 + 0x100 * number)),
        _ => None,
    }
}

/// Default identifier of a PDO that a device receives; `None` from RPDO 5 on, and for number 0.
#[must_use]
pub const fn rpdo(number: u16, node: NodeId) -> Option<Id> {
    match number {
        1..=4 => Some(node.above(0x100 + 0x100 * number)),
        _ => None,
    }
}

/// Answers of a device's SDO server.
#[must_use]
pub const fn sdo_response(node: NodeId) -> Id {
    node.above(0x580)
}

/// Requests to a device's SDO server.
#[must_use]
pub const fn sdo_request(node: NodeId) -> Id {
    node.above(0x600)
}

/// Boot-up, heartbeat and node guarding of a device.
#[must_use]
pub const fn error_control(node: NodeId) -> Id {
    node.above(0x700)
}

/// What a frame is by the default connection set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Function {
    /// NMT command.
    Nmt,
    /// SYNC.
    Sync,
    /// TIME.
    Time,
    /// EMCY of this device.
    Emcy(NodeId),
    /// A PDO that this device transmits, 1 to 4.
    Tpdo(u8, NodeId),
    /// A PDO that this device receives, 1 to 4.
    Rpdo(u8, NodeId),
    /// This device's SDO server answers.
    SdoResponse(NodeId),
    /// This device's SDO server is asked.
    SdoRequest(NodeId),
    /// Boot-up, heartbeat or node guarding of this device.
    ErrorControl(NodeId),
    /// An LSS slave answers.
    LssResponse,
    /// The LSS master asks.
    LssRequest,
}

impl Function {
    /// What an identifier means; `None` when the default connection set does not use it.
    #[must_use]
    // Flat: a table of ranges of identifiers.
    pub fn of(id: Id) -> Option<Self> {
        let Id::Standard(id) = id else { return None };
        let node = NodeId::new(u8::try_from(id & 0x7F).unwrap_or_default());
        Some(match (id & 0x780, node) {
            (0x000, Err(_)) => Self::Nmt,
            (0x080, Err(_)) => Self::Sync,
            (0x100, Err(_)) => Self::Time,
            (0x080, Ok(node)) => Self::Emcy(node),
            (0x180, Ok(node)) => Self::Tpdo(1, node),
            (0x200, Ok(node)) => Self::Rpdo(1, node),
            (0x280, Ok(node)) => Self::Tpdo(2, node),
            (0x300, Ok(node)) => Self::Rpdo(2, node),
            (0x380, Ok(node)) => Self::Tpdo(3, node),
            (0x400, Ok(node)) => Self::Rpdo(3, node),
            (0x480, Ok(node)) => Self::Tpdo(4, node),
            (0x500, Ok(node)) => Self::Rpdo(4, node),
            (0x580, Ok(node)) => Self::SdoResponse(node),
            (0x600, Ok(node)) => Self::SdoRequest(node),
            (0x700, Ok(node)) => Self::ErrorControl(node),
            _ if id == 0x7E4 => Self::LssResponse,
            _ if id == 0x7E5 => Self::LssRequest,
            _ => return None,
        })
    }
}

impl fmt::Display for Function {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nmt => f.write_str("NMT"),
            Self::Sync => f.write_str("SYNC"),
            Self::Time => f.write_str("TIME"),
            Self::Emcy(node) => write!(f, "EMCY of node {node}"),
            Self::Tpdo(number, node) => write!(f, "TPDO{number} of node {node}"),
            Self::Rpdo(number, node) => write!(f, "RPDO{number} of node {node}"),
            Self::SdoResponse(node) => write!(f, "SDO response of node {node}"),
            Self::SdoRequest(node) => write!(f, "SDO request to node {node}"),
            Self::ErrorControl(node) => write!(f, "error control of node {node}"),
            Self::LssResponse => f.write_str("LSS response"),
            Self::LssRequest => f.write_str("LSS request"),
        }
    }
}

/// The word of a parameter that holds an identifier: 1005, 1012, 1014, sub-index 1 of 1400 to 15FF and of 1800 to 19FF, and
/// of 1200 and 1280.
///
/// Bit 31 says that the frame does not exist (in 1012, TIME, that it is consumed); bit 30, by the kind of frame, that the device
/// produces it (SYNC, TIME) or that it does not answer remote frames (TPDO); bit 29 that the identifier has 29 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CobId(pub u32);

impl CobId {
    /// Bit 31.
    const INVALID: u32 = 1 << 31;
    /// Bit 30.
    const BIT_30: u32 = 1 << 30;
    /// Bit 29.
    const EXTENDED: u32 = 1 << 29;

    /// The word of a frame that exists, bit 30 clear.
    #[must_use]
    pub const fn new(id: Id) -> Self {
        Self(match id {
            Id::Standard(id) => (id & Id::STANDARD_MAX) as u32,
            Id::Extended(id) => id & Id::EXTENDED_MAX | Self::EXTENDED,
        })
    }

    /// The identifier; bits that do not belong to it are left out.
    #[must_use]
    pub const fn id(self) -> Id {
        if self.0 & Self::EXTENDED != 0 {
            Id::Extended(self.0 & Id::EXTENDED_MAX)
        } else {
            let [low, high, ..] = self.0.to_le_bytes();
            Id::Standard(u16::from_le_bytes([low, high]) & Id::STANDARD_MAX)
        }
    }

    /// Whether the frame exists: bit 31 clear.
    #[must_use]
    pub const fn is_valid(self) -> bool {
        self.0 & Self::INVALID == 0
    }

    /// The same with bit 31 clear or set.
    #[must_use]
    pub const fn with_valid(self, valid: bool) -> Self {
        Self(if valid { self.0 & !Self::INVALID } else { self.0 | Self::INVALID })
    }

    /// Bit 30: the device produces SYNC or TIME; a TPDO does not answer remote frames.
    #[must_use]
    pub const fn bit_30(self) -> bool {
        self.0 & Self::BIT_30 != 0
    }

    /// The same with bit 30 as given.
    #[must_use]
    pub const fn with_bit_30(self, set: bool) -> Self {
        Self(if set { self.0 | Self::BIT_30 } else { self.0 & !Self::BIT_30 })
    }

    /// Whether two words name the same frame, whatever bits 30 and 31 are.
    #[must_use]
    pub fn names_same(self, other: Self) -> bool {
        self.id() == other.id()
    }
}

impl fmt::Display for CobId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let invalid = if self.is_valid() { "" } else { " not valid" };
        let bit_30 = if self.bit_30() { " bit 30" } else { "" };
        write!(f, "{}{invalid}{bit_30}", self.id())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn node(number: u8) -> NodeId {
        NodeId::new(number).unwrap()
    }

    #[test]
    fn node_ids_are_1_to_127() {
        let good: Vec<u8> = (0..=255).filter(|&number| NodeId::new(number).is_ok()).collect();
        assert_eq!(good, (1..=127).collect::<Vec<_>>());
        assert_eq!(NodeId::all().map(NodeId::get).collect::<Vec<_>>(), good);
        assert_eq!(NodeId::new(0).unwrap_err().to_string(), "node-id: expected 1 to 127, got 0x0");
    }

    #[test]
    fn the_default_connection_set() {
        // The table above; the same numbers stand in CO_driver.h.
        let n = node(0x27);
        let set = [
            (NMT, 0x000, Function::Nmt),
            (SYNC, 0x080, Function::Sync),
            (TIME, 0x100, Function::Time),
            (emcy(n), 0x0A7, Function::Emcy(n)),
            (tpdo(1, n).unwrap(), 0x1A7, Function::Tpdo(1, n)),
            (rpdo(1, n).unwrap(), 0x227, Function::Rpdo(1, n)),
            (tpdo(2, n).unwrap(), 0x2A7, Function::Tpdo(2, n)),
            (rpdo(2, n).unwrap(), 0x327, Function::Rpdo(2, n)),
            (tpdo(3, n).unwrap(), 0x3A7, Function::Tpdo(3, n)),
            (rpdo(3, n).unwrap(), 0x427, Function::Rpdo(3, n)),
            (tpdo(4, n).unwrap(), 0x4A7, Function::Tpdo(4, n)),
            (rpdo(4, n).unwrap(), 0x527, Function::Rpdo(4, n)),
            (sdo_response(n), 0x5A7, Function::SdoResponse(n)),
            (sdo_request(n), 0x627, Function::SdoRequest(n)),
            (error_control(n), 0x727, Function::ErrorControl(n)),
            (LSS_RESPONSE, 0x7E4, Function::LssResponse),
            (LSS_REQUEST, 0x7E5, Function::LssRequest),
        ];
        for (id, number, function) in set {
            assert_eq!(id, Id::Standard(number), "{function}");
            assert_eq!(Function::of(id), Some(function), "{function}");
        }
        for number in [0, 5, 512] {
            assert_eq!((tpdo(number, n), rpdo(number, n)), (None, None));
        }
    }

    #[test]
    fn every_identifier_has_at_most_one_meaning() {
        let known = (0..=0x7FF).filter_map(|id| Function::of(Id::Standard(id)));
        let all: std::collections::HashSet<_> = known.collect();
        // NMT, SYNC, TIME and LSS both ways; EMCY, 4 TPDO, 4 RPDO, SDO both ways and error control of 127 nodes.
        assert_eq!(all.len(), 5 + 12 * 127);
        for id in [0x001, 0x07F, 0x101, 0x180, 0x580, 0x600, 0x680, 0x6FF, 0x700, 0x7E6] {
            assert_eq!(Function::of(Id::Standard(id)), None, "{id:03X}");
        }
        assert_eq!(Function::of(Id::Extended(0x080)), None);
    }

    #[test]
    fn words_have_their_flags() {
        let tpdo = CobId(0xC000_0181);
        assert_eq!((tpdo.is_valid(), tpdo.bit_30(), tpdo.id()), (false, true, Id::Standard(0x181)));
        assert_eq!(tpdo.with_valid(true), CobId(0x4000_0181));
        assert_eq!(tpdo.with_valid(true).with_bit_30(false), CobId::new(Id::Standard(0x181)));
        assert_eq!(CobId::new(Id::Extended(0x181)), CobId(0x2000_0181));
        assert_eq!(tpdo.to_string(), "181 not valid bit 30");
        assert!(tpdo.names_same(CobId(0x181)) && !tpdo.names_same(CobId(0x2000_0181)));
        // A 29-bit number without bit 29 is cut to 11 bits.
        assert_eq!(CobId(0x0800_0181).id(), Id::Standard(0x181));
    }

    proptest! {
        #[test]
        fn words_and_identifiers_round_trip(word: u32) {
            let id = CobId(word).id();
            prop_assert!(id.is_valid());
            prop_assert_eq!(CobId::new(id).id(), id);
        }
    }
}
