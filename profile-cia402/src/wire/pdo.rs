//! What PDO parameters hold: transmission types and mapping entries.

use core::fmt;
use core::ops::RangeInclusive;

use super::mux::Mux;

/// Most bytes of a PDO in a classic frame.
pub const PDO_LEN_MAX: usize = 8;

/// Most entries of a mapping: one per bit of the PDO.
pub const MAPPING_MAX: usize = 64;

/// Of PDO 1; those of PDO n follow at n - 1.
pub use crate::generated::objects::{RPDO_COMMUNICATION, RPDO_MAPPING, TPDO_COMMUNICATION, TPDO_MAPPING};

/// Highest number of a PDO, counted from 1.
pub const PDO_NUMBER_MAX: u16 = 512;

/// Sub-index of the COB-ID.
pub const SUB_COB_ID: u8 = 1;
/// Sub-index of the transmission type.
pub const SUB_TYPE: u8 = 2;
/// Sub-index of the inhibit time, 100 microseconds; TPDO.
pub const SUB_INHIBIT: u8 = 3;
/// Sub-index of the event timer, ms; in an RPDO the deadline.
pub const SUB_EVENT_TIMER: u8 = 5;
/// Sub-index of the SYNC start value; TPDO.
pub const SUB_SYNC_START: u8 = 6;

/// Which way a PDO goes, as the device sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Direction {
    /// The device receives: RPDO, from the master.
    Receive,
    /// The device transmits: TPDO, to the master.
    Transmit,
}

impl Direction {
    /// Both, that to the device first.
    pub const BOTH: [Self; 2] = [Self::Receive, Self::Transmit];

    /// Number of the communication parameters of the first PDO.
    #[must_use]
    pub const fn first_communication(self) -> u16 {
        match self {
            Self::Receive => RPDO_COMMUNICATION,
            Self::Transmit => TPDO_COMMUNICATION,
        }
    }

    /// Number of the mapping of the first PDO.
    #[must_use]
    pub const fn first_mapping(self) -> u16 {
        match self {
            Self::Receive => RPDO_MAPPING,
            Self::Transmit => TPDO_MAPPING,
        }
    }

    /// A communication parameter of a PDO, whose number counts from 1.
    #[must_use]
    pub const fn communication_object(self, number: u16, sub: u8) -> Mux {
        Mux::new(self.first_communication() + (number - 1), sub)
    }

    /// An entry of the mapping of a PDO, whose number counts from 1; entry 0 is how many there are.
    #[must_use]
    pub const fn mapping_object(self, number: u16, sub: u8) -> Mux {
        Mux::new(self.first_mapping() + (number - 1), sub)
    }

    /// Numbers of the communication parameters.
    #[must_use]
    pub const fn communication(self) -> RangeInclusive<u16> {
        self.first_communication()..=self.first_communication() + (PDO_NUMBER_MAX - 1)
    }

    /// Numbers of the mappings.
    #[must_use]
    pub const fn mapping(self) -> RangeInclusive<u16> {
        self.first_mapping()..=self.first_mapping() + (PDO_NUMBER_MAX - 1)
    }

    /// The identifier of one of the first four PDOs, counted from 0, in the default connection set.
    #[must_use]
    pub fn default_cob_id(self, pdo: u16, node: u8) -> Option<u32> {
        let first = match self {
            Self::Receive => 0x200,
            Self::Transmit => 0x180,
        };
        (pdo < 4).then(|| first + u32::from(pdo) * 0x100 + u32::from(node))
    }
}

impl fmt::Display for Direction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Receive => "RPDO",
            Self::Transmit => "TPDO",
        })
    }
}

/// Transmission type: when a TPDO is sent, and when an RPDO takes effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TransmissionType(pub u8);

impl TransmissionType {
    /// TPDO: at the next SYNC after an event.
    pub const SYNC_ON_EVENT: Self = Self(0);
    /// TPDO: at every SYNC. RPDO: takes effect at the next SYNC, as with all of 0 to 240.
    pub const EVERY_SYNC: Self = Self(1);
    /// TPDO: sampled at SYNC, sent when asked for by a remote frame.
    pub const RTR_SYNC: Self = Self(252);
    /// TPDO: sent when asked for by a remote frame.
    pub const RTR_EVENT: Self = Self(253);
    /// On an event that the manufacturer defines.
    pub const EVENT_MANUFACTURER: Self = Self(254);
    /// On an event that the device profile defines.
    pub const EVENT_PROFILE: Self = Self(255);

    /// Whether SYNC has to do with it: 0 to 240 and 252.
    #[must_use]
    pub const fn is_synchronous(self) -> bool {
        matches!(self.0, 0..=240 | 252)
    }

    /// Every how many SYNCs a TPDO is sent; `None` for types that are not cyclic.
    #[must_use]
    pub const fn syncs(self) -> Option<u8> {
        match self.0 {
            1..=240 => Some(self.0),
            _ => None,
        }
    }

    /// Whether it goes by events alone.
    #[must_use]
    pub const fn is_event_driven(self) -> bool {
        self.0 >= 254
    }

    /// Whether remote frames ask for it.
    #[must_use]
    pub const fn is_remote(self) -> bool {
        matches!(self.0, 252 | 253)
    }

    /// Whether it is reserved: 241 to 251.
    #[must_use]
    pub const fn is_reserved(self) -> bool {
        matches!(self.0, 241..=251)
    }
}

impl fmt::Display for TransmissionType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            0 => f.write_str("synchronous on event"),
            1 => f.write_str("every SYNC"),
            2..=240 => write!(f, "every {} SYNCs", self.0),
            252 => f.write_str("on remote frame, sampled at SYNC"),
            253 => f.write_str("on remote frame"),
            254 => f.write_str("on event (manufacturer)"),
            255 => f.write_str("on event (profile)"),
            _ => write!(f, "reserved type {}", self.0),
        }
    }
}

/// One entry of a mapping: `index << 16 | sub-index << 8 | bits`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MappingEntry(pub u32);

impl MappingEntry {
    /// An entry.
    #[must_use]
    pub const fn new(mux: Mux, bits: u8) -> Self {
        Self((mux.index as u32) << 16 | (mux.sub as u32) << 8 | bits as u32)
    }

    /// The object.
    #[must_use]
    pub const fn mux(self) -> Mux {
        let [_, sub, low, high] = self.0.to_le_bytes();
        Mux::new(u16::from_le_bytes([low, high]), sub)
    }

    /// Its length in bits.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0.to_le_bytes()[0]
    }

    /// Whether it only fills a place: indices below 0020 are data types (1 to 7: BOOLEAN to UNSIGNED32).
    #[must_use]
    pub const fn is_dummy(self) -> bool {
        matches!(self.mux().index, 1..0x20)
    }
}

/// Bytes of a PDO with these entries; `None` when the bits do not fill whole bytes.
#[must_use]
pub fn mapped_len(entries: &[MappingEntry]) -> Option<usize> {
    let bits: usize = entries.iter().map(|entry| usize::from(entry.bits())).sum();
    bits.is_multiple_of(8).then_some(bits / 8)
}

/// As configuration files write it: `6040:00/16`.
impl fmt::Display for MappingEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.mux(), self.bits())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn every_type_has_one_meaning() {
        let kinds = (0..=255).map(TransmissionType);
        let mut counts = [0; 5];
        for kind in kinds {
            let flags = [
                kind == TransmissionType::SYNC_ON_EVENT,
                kind.syncs().is_some(),
                kind.is_reserved(),
                kind.is_remote(),
                kind.is_event_driven(),
            ];
            assert_eq!(flags.iter().filter(|&&flag| flag).count(), 1, "{kind}");
            counts.iter_mut().zip(flags).for_each(|(count, flag)| *count += u32::from(flag));
        }
        assert_eq!(counts, [1, 240, 11, 2, 2]);
        assert!(TransmissionType(240).is_synchronous() && TransmissionType::RTR_SYNC.is_synchronous());
        assert!(!TransmissionType(241).is_synchronous() && !TransmissionType::RTR_EVENT.is_synchronous());
        let texts = [0, 1, 4, 245, 252, 253, 254, 255].map(|number| TransmissionType(number).to_string());
        assert_eq!(
            texts,
            [
                "synchronous on event",
                "every SYNC",
                "every 4 SYNCs",
                "reserved type 245",
                "on remote frame, sampled at SYNC",
                "on remote frame",
                "on event (manufacturer)",
                "on event (profile)"
            ]
        );
    }

    #[test]
    fn entries_as_drives_have_them() {
        // Default mappings of Kollmorgen S300 and AKD.
        let entry = MappingEntry(0x607A_0020);
        assert_eq!((entry.mux(), entry.bits()), (Mux::new(0x607A, 0), 32));
        assert_eq!(
            (MappingEntry::new(Mux::new(0x607A, 0), 32), entry.to_string()),
            (entry, "607A:00/32".into())
        );
        assert_eq!(mapped_len(&[MappingEntry(0x6040_0010), entry]), Some(6));
        assert_eq!(mapped_len(&[MappingEntry(0x0001_0001), entry]), None);
        assert!(MappingEntry(0x0005_0008).is_dummy() && !entry.is_dummy());
    }

    proptest! {
        #[test]
        fn entries_round_trip(word: u32) {
            let entry = MappingEntry(word);
            prop_assert_eq!(MappingEntry::new(entry.mux(), entry.bits()), entry);
        }
    }
}
