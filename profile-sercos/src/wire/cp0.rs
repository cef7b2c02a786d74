//! Telegrams of CP0, the scan: MDT0 carries the communication version, AT0 collects addresses.
//!
//! Data field of MDT0 (40 bytes):
//!
//! | byte | size | field |
//! |---|---|---|
//! | 0 | 4 | communication version |
//! | 4 | 4 | t1, ns; counts only with version bit 20 |
//! | 8 | 4 | t6, ns; likewise |
//! | 12 | 4 | t7, ns; likewise |
//! | 16 | 24 | reserved |
//!
//! Data field of AT0 (1024 bytes): word 0 is the sequence counter, words 1 to 511 the topology fields.
//! On the way out a slave takes the counter as its topology address, writes its SERCOS address into that word
//! and adds one to the counter; on the way back it only adds one.

use crate::generated::bits::communication_version;
use core::fmt;

use profile_generic::wire::{Error, need, put_u16, put_u32, u16_at, u32_at};

/// Bytes of the data field of MDT0 in CP0.
pub const MDT_LEN: usize = 40;
/// Bytes of the data field of AT0 in CP0.
pub const AT_LEN: usize = 1024;
/// Topology fields in AT0, and so the most slaves on a network.
pub const SLAVES_MAX: usize = 511;
/// Topology field which no slave has written.
pub const NO_SLAVE: u16 = 0xFFFF;

mod field {
    pub const VERSION: usize = 0;
    pub const T1: usize = VERSION + 4;
    pub const T6: usize = T1 + 4;
    pub const T7: usize = T6 + 4;
    pub const RESERVED: usize = T7 + 4;
}

bitflags::bitflags! {
    /// Communication version: what the master asks of every slave from CP0 on.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct CommunicationVersion: u32 {
        /// Bit 0: address allocation by topology.
        const ADDRESS_ALLOCATION = communication_version::ADDRESS_ALLOCATION;
        /// Bit 16: four MDTs and four ATs in CP1 and CP2 instead of two and two.
        const FOUR_TELEGRAMS = 1 << communication_version::TELEGRAMS_IN_CP1_AND_CP2.trailing_zeros();
        /// Bit 20: t1, t6 and t7 follow in this telegram.
        const TIMES = communication_version::T1_T6_AND_T7_TRANSMITTED;
        /// Bit 21: fast phase switch.
        const FAST_PHASE_SWITCH = communication_version::FAST_PHASE_SWITCH;
        /// Bit 22: the last slave does not send SERCOS telegrams on its free port.
        const NO_FORWARD_AT_END = communication_version::LAST_SLAVE_DOES_NOT_FORWARD;
    }
}

impl CommunicationVersion {
    /// The bits which a slave has to acknowledge with bit 15 of its topology field.
    pub const ACKNOWLEDGED: CommunicationVersion = CommunicationVersion::TIMES
        .union(CommunicationVersion::FAST_PHASE_SWITCH)
        .union(Self::NO_FORWARD_AT_END);

    /// Number of MDTs, and of ATs, in CP1 and CP2: 2 or 4.
    pub const fn telegrams(self) -> u8 {
        if self.contains(Self::FOUR_TELEGRAMS) { 4 } else { 2 }
    }
}

impl fmt::Display for CommunicationVersion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#010x}", self.bits())?;
        let names = [
            (Self::ADDRESS_ALLOCATION, "address allocation"),
            (Self::FOUR_TELEGRAMS, "4 MDT and 4 AT"),
            (Self::TIMES, "times follow"),
            (Self::FAST_PHASE_SWITCH, "fast phase switch"),
            (Self::NO_FORWARD_AT_END, "no forward at the end"),
        ];
        profile_generic::wire::display_bits(
            f,
            names.into_iter().filter(|&(bit, _)| self.contains(bit)).map(|(_, name)| name),
        )
    }
}

/// Data field of MDT0 in CP0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MdtRepr {
    /// What the master asks of the slaves.
    pub version: CommunicationVersion,
    /// t1, start of AT0, ns. Counts with [`CommunicationVersion::TIMES`].
    pub t1_ns: u32,
    /// t6, start of the unified communication channel, ns. Likewise.
    pub t6_ns: u32,
    /// t7, end of the unified communication channel, ns. Likewise.
    pub t7_ns: u32,
    /// Reserved bytes, as received.
    pub reserved: [u8; MDT_LEN - field::RESERVED],
}

impl Default for MdtRepr {
    fn default() -> Self {
        MdtRepr {
            version: CommunicationVersion::ADDRESS_ALLOCATION,
            t1_ns: 0,
            t6_ns: 0,
            t7_ns: 0,
            reserved: [0; MDT_LEN - field::RESERVED],
        }
    }
}

impl MdtRepr {
    /// Reads the data field. Fails unless there are at least 40 bytes.
    pub fn parse(data: &[u8]) -> Result<MdtRepr, Error> {
        need("MDT0 of CP0", MDT_LEN, data.len())?;
        let mut reserved = [0; MDT_LEN - field::RESERVED];
        reserved.copy_from_slice(&data[field::RESERVED..MDT_LEN]);
        Ok(MdtRepr {
            version: CommunicationVersion::from_bits_retain(u32_at(data, field::VERSION)),
            t1_ns: u32_at(data, field::T1),
            t6_ns: u32_at(data, field::T6),
            t7_ns: u32_at(data, field::T7),
            reserved,
        })
    }

    /// Bytes written by [`emit`](Self::emit).
    pub const fn buffer_len(&self) -> usize {
        MDT_LEN
    }

    /// Writes the data field.
    pub fn emit(&self, data: &mut [u8]) -> Result<(), Error> {
        need("MDT0 of CP0", MDT_LEN, data.len())?;
        put_u32(data, field::VERSION, self.version.bits());
        put_u32(data, field::T1, self.t1_ns);
        put_u32(data, field::T6, self.t6_ns);
        put_u32(data, field::T7, self.t7_ns);
        data[field::RESERVED..MDT_LEN].copy_from_slice(&self.reserved);
        Ok(())
    }
}

/// The sequence counter, word 0 of AT0: bits 14..0 count the ports passed, bit 15 is the S channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SequenceCounter(pub u16);

impl SequenceCounter {
    /// As the master sends it on its P port.
    pub const START_PRIMARY: SequenceCounter = SequenceCounter(1);
    /// As the master sends it on its S port.
    pub const START_SECONDARY: SequenceCounter = SequenceCounter(0x8001);

    /// Whether the telegram is on the S channel.
    pub const fn secondary(self) -> bool {
        self.0 & 0x8000 != 0
    }

    /// The count.
    pub const fn count(self) -> u16 {
        self.0 & 0x7FFF
    }

    /// One more port passed; the channel bit stays.
    #[must_use]
    pub const fn next(self) -> SequenceCounter {
        SequenceCounter(self.0 & 0x8000 | (self.0.wrapping_add(1) & 0x7FFF))
    }
}

/// One topology field of AT0: bits 8..0 SERCOS address, bit 15 acknowledges the communication version.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct TopologyField(pub u16);

impl TopologyField {
    /// No slave has written here.
    pub const EMPTY: TopologyField = TopologyField(NO_SLAVE);

    /// A slave's entry. `address` is cut to nine bits; 0 means that none is set.
    pub const fn new(address: u16, acknowledged: bool) -> Self {
        TopologyField(address & 0x1FF | if acknowledged { 0x8000 } else { 0 })
    }

    /// The SERCOS address, or `None` where no slave has written.
    pub const fn address(self) -> Option<u16> {
        if self.0 == NO_SLAVE { None } else { Some(self.0 & 0x1FF) }
    }

    /// Whether the slave does what the communication version asks.
    pub const fn acknowledged(self) -> bool {
        self.0 != NO_SLAVE && self.0 & 0x8000 != 0
    }
}

/// Data field of AT0 in CP0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AtRepr {
    /// Sequence counter.
    pub counter: SequenceCounter,
    /// Topology fields of topology addresses 1 to 511.
    pub topology: [u16; SLAVES_MAX],
}

impl AtRepr {
    /// The telegram as the master sends it: no slave has written yet.
    pub const fn empty(counter: SequenceCounter) -> Self {
        AtRepr { counter, topology: [NO_SLAVE; SLAVES_MAX] }
    }

    /// Reads the data field. Fails unless there are at least 1024 bytes.
    pub fn parse(data: &[u8]) -> Result<AtRepr, Error> {
        need("AT0 of CP0", AT_LEN, data.len())?;
        let mut topology = [NO_SLAVE; SLAVES_MAX];
        for (field, bytes) in topology.iter_mut().zip(data[2..AT_LEN].chunks_exact(2)) {
            *field = u16_at(bytes, 0);
        }
        Ok(AtRepr { counter: SequenceCounter(u16_at(data, 0)), topology })
    }

    /// Bytes written by [`emit`](Self::emit).
    pub const fn buffer_len(&self) -> usize {
        AT_LEN
    }

    /// Writes the data field.
    pub fn emit(&self, data: &mut [u8]) -> Result<(), Error> {
        need("AT0 of CP0", AT_LEN, data.len())?;
        put_u16(data, 0, self.counter.0);
        for (field, bytes) in self.topology.iter().zip(data[2..AT_LEN].chunks_exact_mut(2)) {
            put_u16(bytes, 0, *field);
        }
        Ok(())
    }

    /// The slaves that have written: topology address and field.
    pub fn slaves(&self) -> impl Iterator<Item = (u16, TopologyField)> + '_ {
        (1..)
            .zip(self.topology.iter().map(|&word| TopologyField(word)))
            .filter(|(_, field)| field.0 != NO_SLAVE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn mdt_of_the_recording() {
        // Recording sercos3_startup_line2, frame 1.
        let mut bytes = [0; MDT_LEN];
        bytes[0] = 1;
        let repr = MdtRepr::parse(&bytes).unwrap();
        assert_eq!(repr, MdtRepr::default());
        let mut again = [0xA5; MDT_LEN];
        repr.emit(&mut again).unwrap();
        assert_eq!(again, bytes);
        assert_eq!(repr.version.to_string(), "0x00000001 (address allocation)");
        assert_eq!(repr.version.telegrams(), 2);
    }

    #[test]
    fn at_of_the_recording() {
        // Recording sercos3_startup_line2, frames 2 (sent) and 4 (come back from a line of two).
        let mut sent = [0xFF; AT_LEN];
        sent[..2].copy_from_slice(&[1, 0]);
        let mut back = sent;
        back[..6].copy_from_slice(&[4, 0, 1, 0, 2, 0]);
        let empty = AtRepr::empty(SequenceCounter::START_PRIMARY);
        let mut filled = empty;
        filled.counter = SequenceCounter(4);
        filled.topology[..2].copy_from_slice(&[1, 2]);
        for (bytes, repr) in [(sent, empty), (back, filled)] {
            assert_eq!(AtRepr::parse(&bytes), Ok(repr));
            let mut again = [0xA5; AT_LEN];
            repr.emit(&mut again).unwrap();
            assert_eq!(again, bytes);
        }
        let found: Vec<_> = filled.slaves().map(|(at, field)| (at, field.address())).collect();
        assert_eq!(found, [(1, Some(1)), (2, Some(2))]);
        assert_eq!(empty.slaves().count(), 0);
    }

    #[test]
    fn words() {
        assert_eq!(TopologyField::new(0x3FF, true), TopologyField(0x81FF));
        assert_eq!(TopologyField::new(5, false).address(), Some(5));
        assert!(TopologyField(0x8005).acknowledged() && !TopologyField::EMPTY.acknowledged());
        assert_eq!(SequenceCounter(0xFFFF).next(), SequenceCounter(0x8000));
        assert_eq!(SequenceCounter(0x7FFF).next(), SequenceCounter(0));
        assert!(SequenceCounter::START_SECONDARY.secondary());
        let all = CommunicationVersion::all() | CommunicationVersion::from_bits_retain(0x100);
        assert_eq!(CommunicationVersion::ACKNOWLEDGED.bits(), 0x0070_0000);
        assert_eq!(all.telegrams(), 4);
    }

    #[test]
    fn truncation_is_an_error_at_every_byte() {
        let at = AtRepr::empty(SequenceCounter::START_PRIMARY);
        let mut bytes = [0; AT_LEN];
        for len in 0..AT_LEN {
            assert!(AtRepr::parse(&bytes[..len]).is_err());
            assert!(at.emit(&mut bytes[..len]).is_err());
        }
        for len in 0..MDT_LEN {
            assert!(MdtRepr::parse(&bytes[..len]).is_err());
            assert!(MdtRepr::default().emit(&mut bytes[..len]).is_err());
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn any_bytes_come_back(bytes in proptest::collection::vec(any::<u8>(), AT_LEN)) {
            let mut again = [0xA5; AT_LEN];
            AtRepr::parse(&bytes).unwrap().emit(&mut again).unwrap();
            prop_assert_eq!(&again[..], &bytes[..]);
            MdtRepr::parse(&bytes).unwrap().emit(&mut again).unwrap();
            prop_assert_eq!(&again[..MDT_LEN], &bytes[..MDT_LEN]);
        }
    }
}
