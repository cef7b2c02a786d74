//! CP0: the slave takes its topology address and shows its SERCOS address.

use super::{Application, Slave};
use crate::wire::cp0::{AT_LEN, CommunicationVersion, MdtRepr, SLAVES_MAX, SequenceCounter, TopologyField};
use crate::wire::idn::Idn;

/// What of the communication version this slave can do. It needs no pause beyond the reconfiguration.
const SUPPORTED: CommunicationVersion = CommunicationVersion::ADDRESS_ALLOCATION
    .union(CommunicationVersion::FOUR_TELEGRAMS)
    .union(CommunicationVersion::TIMES)
    .union(CommunicationVersion::FAST_PHASE_SWITCH)
    .union(CommunicationVersion::NO_FORWARD_AT_END);

/// Cycles of CP0 in a row without P telegram after which the S telegram gives the topology address.
const PRIMARY_MISSES: u8 = 2;

impl<A: Application> Slave<A> {
    pub(super) fn scan_mdt(&mut self, number: u8, data: &[u8]) {
        if number == 0
            && let Ok(repr) = MdtRepr::parse(data)
        {
            self.version = repr.version;
        }
    }

    pub(super) fn scan_at(&mut self, number: u8, outward: bool, data: &mut [u8]) {
        if number != 0 || data.len() < AT_LEN {
            return;
        }
        let counter = SequenceCounter(u16::from_le_bytes([data[0], data[1]]));
        if outward {
            let topology = counter.count() & 0x1FF;
            // In a ring the S telegram counts from the other end; the P telegram gives the address, also when it
            // is missing for a cycle or two.
            if !counter.secondary() {
                self.address_age = 0;
            }
            if !counter.secondary() || self.address_age > PRIMARY_MISSES {
                self.topology_address = topology;
            }
            let at = 2 * usize::from(topology);
            if (1..=SLAVES_MAX).contains(&usize::from(topology)) {
                let address = u16::try_from(self.core.store.number_of(Idn::ADDRESS)).unwrap_or(0);
                let asked = self.version.intersects(CommunicationVersion::ACKNOWLEDGED);
                let field = TopologyField::new(address, asked && SUPPORTED.contains(self.version));
                data[at..at + 2].copy_from_slice(&field.0.to_le_bytes());
            }
        }
        data[..2].copy_from_slice(&counter.next().0.to_le_bytes());
    }
}
