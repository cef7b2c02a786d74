//! What the master has configured in CP2, checked and resolved for the cyclic path: S-0-0127.

use core::ops::Range;

use arrayvec::ArrayVec;

use super::communication::{CONNECTIONS_MAX, VALUES_MAX};
use super::connection::Consumer;
use super::parameter::{Cyclic, Handle, Store};
use crate::generated::idns::connection;
use crate::wire::connection::{
    CONNECTION_CONTROL_LEN, ConfigurationType, ConnectionControl, ConnectionSetup,
};
use crate::wire::header::{Kind, TELEGRAMS_MAX};
use crate::wire::hot_plug::HOT_PLUG_LEN;
use crate::wire::idn::Idn;
use crate::wire::layout::{DEVICE_WORD_LEN, Offset};
use crate::wire::svc::SVC_LEN;

/// IDNs reported at most by one check.
pub const INVALID_MAX: usize = 64;
/// Parts of a slave in the telegrams of one kind: service channel, device word, connections.
const PARTS_MAX: usize = 2 + CONNECTIONS_MAX;

/// The IDNs that a check has found to be wrong. More than [`INVALID_MAX`] are dropped: the first ones are
/// enough to work on.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Invalid(ArrayVec<Idn, INVALID_MAX>);

impl Invalid {
    /// Reports an IDN, once.
    pub fn push(&mut self, idn: Idn) {
        if !self.0.contains(&idn) && !self.0.is_full() {
            self.0.push(idn);
        }
    }

    /// What has been reported.
    pub fn idns(&self) -> &[Idn] {
        &self.0
    }
}

/// One connection, resolved.
#[derive(Debug, Clone)]
pub struct Link {
    /// x of S-0-1050.x.
    pub index: u8,
    /// This slave produces.
    pub producer: bool,
    /// In MDTs or in ATs.
    pub kind: Kind,
    /// Place of C-CON.
    pub at: Offset,
    /// Values and their lengths in bytes, in order.
    pub values: ArrayVec<(Handle, usize), VALUES_MAX>,
    /// State of a consumer.
    pub consumer: Consumer,
    /// C-CON of a producer.
    pub control: ConnectionControl,
    /// Cycles from one production to the next.
    pub interval: u16,
    /// Cycles since the last production.
    pub age: u16,
    /// The telegram of this cycle has been judged or filled.
    pub seen: bool,
    /// The consumer has taken new values in this cycle.
    pub fresh: bool,
}

impl Link {
    /// Bytes with C-CON.
    pub fn len(&self) -> usize {
        CONNECTION_CONTROL_LEN + self.values.iter().map(|(_, len)| len).sum::<usize>()
    }

    /// Whether the connection has no values.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }
}

/// The slave's parts of the telegrams in CP3 and CP4.
#[derive(Debug, Clone)]
pub struct Configuration {
    /// C-DEV in the MDTs.
    pub device_control: Offset,
    /// S-DEV in the ATs.
    pub device_status: Offset,
    /// Service channel in the MDTs.
    pub svc_mdt: Offset,
    /// Service channel in the ATs.
    pub svc_at: Offset,
    /// Communication cycle, ns.
    pub cycle_ns: u32,
    /// Permitted MST losses in a row.
    pub mst_losses: u32,
    /// Active connections.
    pub links: ArrayVec<Link, CONNECTIONS_MAX>,
}

/// Places of parts in the telegrams of one kind: each within its telegram, none over another.
struct Places {
    kind: Kind,
    lengths: [usize; TELEGRAMS_MAX],
    taken: ArrayVec<(u8, Range<usize>), PARTS_MAX>,
}

impl Places {
    fn new(store: &Store, kind: Kind, lengths: Idn) -> Self {
        let data = store.find(lengths).map_or(&[][..], |handle| store.get(handle).data());
        let mut places = Places { kind, lengths: [0; TELEGRAMS_MAX], taken: ArrayVec::new() };
        for (len, bytes) in places.lengths.iter_mut().zip(data.chunks_exact(2)) {
            *len = usize::from(u16::from_le_bytes([bytes[0], bytes[1]]));
        }
        places
    }

    /// Whether `len` bytes at `at` are free; then they are taken.
    fn take(&mut self, at: Offset, len: usize) -> bool {
        let range = at.range(len);
        let Some(&telegram) = self.lengths.get(usize::from(at.telegram)) else { return false };
        let hot_plug = if at.telegram == 0 { HOT_PLUG_LEN } else { 0 };
        let overlaps = |(telegram, taken): &(u8, Range<usize>)| {
            *telegram == at.telegram && taken.start < range.end && range.start < taken.end
        };
        if range.start < hot_plug || range.end > telegram || self.taken.iter().any(overlaps) {
            return false;
        }
        self.taken.try_push((at.telegram, range)).is_ok()
    }
}

/// Reads and judges everything that the master has configured. `invalid` receives the IDNs that are wrong; if
/// there are none the result is what the cyclic path runs on.
pub fn resolve(store: &Store, invalid: &mut Invalid) -> Option<Configuration> {
    let number = |idn| u32::try_from(store.number_of(idn)).unwrap_or(0);
    let cycle_ns = number(Idn::CYCLE_TIME);
    if !super::communication::is_cycle_time(cycle_ns) {
        invalid.push(Idn::CYCLE_TIME);
    }
    for idn in [Idn::AT_START, Idn::SYNC_TIME, Idn::COMMAND_VALID] {
        if number(idn) > cycle_ns {
            invalid.push(idn);
        }
    }
    let mut places =
        [Places::new(store, Kind::Mdt, Idn::MDT_LENGTHS), Places::new(store, Kind::At, Idn::AT_LENGTHS)];
    for (places, idn) in places.iter().zip([Idn::MDT_LENGTHS, Idn::AT_LENGTHS]) {
        if places.lengths[0] == 0 {
            invalid.push(idn);
        }
    }
    let mut fixed = |kind: usize, idn: Idn, len: usize| {
        let [low, high, ..] = store.number_of(idn).to_le_bytes();
        let at = Offset::from_parameter(u16::from_le_bytes([low, high]));
        if !places[kind].take(at, len) {
            invalid.push(idn);
        }
        at
    };
    let (device_control, device_status) =
        (fixed(0, Idn::CONTROL_OFFSET, DEVICE_WORD_LEN), fixed(1, Idn::STATUS_OFFSET, DEVICE_WORD_LEN));
    let (svc_mdt, svc_at) = (fixed(0, Idn::SVC_MDT_OFFSET, SVC_LEN), fixed(1, Idn::SVC_AT_OFFSET, SVC_LEN));
    let mut links = ArrayVec::new();
    for index in 0..u8::try_from(CONNECTIONS_MAX).unwrap_or(u8::MAX) {
        if let Some(link) = resolve_link(store, index, cycle_ns, &mut places, invalid)
            && links.try_push(link).is_err()
        {
            invalid.push(Idn::connection(index, connection::SETUP));
        }
    }
    let mst_losses = number(Idn::MST_LOSSES);
    let configuration =
        Configuration { device_control, device_status, svc_mdt, svc_at, cycle_ns, mst_losses, links };
    invalid.idns().is_empty().then_some(configuration)
}

/// Resolves the list of a connection's values.
fn resolve_values<const N: usize>(
    store: &Store,
    list: Idn,
    producer: bool,
    invalid: &mut Invalid,
) -> ArrayVec<(Handle, usize), N> {
    let fits = |cyclic| match cyclic {
        Cyclic::No => false,
        Cyclic::Both => true,
        Cyclic::Command => !producer,
        Cyclic::Feedback => producer,
    };
    let mut values = ArrayVec::new();
    for idn in store.idns(list) {
        let found = store.find(idn).map(|handle| (handle, store.get(handle)));
        let found =
            found.filter(|(_, parameter)| fits(parameter.cyclic()) && !parameter.attribute().is_list());
        let kept =
            found.is_some_and(|(handle, parameter)| values.try_push((handle, parameter.capacity())).is_ok());
        if !kept {
            invalid.push(list);
        }
    }
    if values.is_empty() {
        invalid.push(list);
    }
    values
}

/// Resolves connection `index`; `None` if it is not there or not active.
fn resolve_link(
    store: &Store,
    index: u8,
    cycle_ns: u32,
    places: &mut [Places; 2],
    invalid: &mut Invalid,
) -> Option<Link> {
    let x = |element| Idn::connection(index, element);
    let word = |element| {
        let [low, high, ..] = store.number_of(x(element)).to_le_bytes();
        u16::from_le_bytes([low, high])
    };
    store.find(x(connection::SETUP))?;
    let setup = ConnectionSetup::from_bits_retain(word(connection::SETUP));
    if !setup.contains(ConnectionSetup::ACTIVE) {
        return None;
    }
    if setup.configuration() != ConfigurationType::IdnList {
        invalid.push(x(connection::SETUP));
    }
    let producer = setup.contains(ConnectionSetup::PRODUCER);
    let values = resolve_values(store, x(connection::LIST), producer, invalid);
    let producer_cycle = u32::try_from(store.number_of(x(connection::CYCLE))).unwrap_or(0);
    if producer_cycle != 0 && cycle_ns != 0 && producer_cycle % cycle_ns != 0 {
        invalid.push(x(connection::CYCLE));
    }
    let cycles = producer_cycle.checked_div(cycle_ns).unwrap_or(1).max(1);
    let interval = u16::try_from(cycles).unwrap_or(u16::MAX);
    let (kind, at) = Offset::from_assignment(word(connection::ASSIGNMENT));
    let link = Link {
        index,
        producer,
        kind,
        at,
        values,
        consumer: Consumer::new(word(connection::LOSSES_MAX), interval),
        control: ConnectionControl::empty(),
        interval,
        age: 0,
        seen: false,
        fresh: false,
    };
    let len = link.len();
    // A slave writes into ATs only.
    let direction = !producer || kind == Kind::At;
    let free =
        places.iter_mut().find(|places| places.kind == kind).is_some_and(|places| places.take(at, len));
    if !direction || !free {
        invalid.push(x(connection::ASSIGNMENT));
    }
    Some(link)
}

#[cfg(test)]
mod tests {
    use super::super::communication;
    use super::super::parameter::Definition;
    use super::*;

    /// Slave 1 of recording sercos3_startup_line2 as configured in frames 2641 to 4473.
    fn configured() -> Store {
        let mut store = Store::new();
        communication::define(&mut store, &crate::slave::Config::default());
        for (idn, attribute, cyclic) in [
            (134, 0x7001_0001, Cyclic::Command),
            (36, 0x0322_0001, Cyclic::Command),
            (135, 0x7001_0001, Cyclic::Feedback),
            (40, 0x7322_0001, Cyclic::Feedback),
            (51, 0x7422_0001, Cyclic::Feedback),
        ] {
            store.define(Definition::value(Idn::standard(idn), attribute, "", 0).cyclic(cyclic));
        }
        let words = |words: &[u16]| words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>();
        store.set_data_of(Idn::MDT_LENGTHS, &words(&[46, 0, 0, 0]));
        store.set_data_of(Idn::AT_LENGTHS, &words(&[48, 0, 0, 0]));
        let list = |idns: &[u32]| idns.iter().flat_map(|idn| idn.to_le_bytes()).collect::<Vec<u8>>();
        store.set_data_of(Idn::connection(0, 6), &list(&[0x86, 0x24]));
        store.set_data_of(Idn::connection(1, 6), &list(&[0x87, 0x28, 0x33]));
        let numbers = [
            (Idn::CYCLE_TIME, 10_000_000),
            (Idn::CONTROL_OFFSET, 26),
            (Idn::STATUS_OFFSET, 20),
            (Idn::SVC_MDT_OFFSET, 14),
            (Idn::SVC_AT_OFFSET, 8),
            (Idn::connection(0, 1), 0x8000),
            (Idn::connection(1, 1), 0xC000),
            (Idn::connection(0, 3), 0x081E),
            (Idn::connection(1, 3), 0x0018),
            (Idn::connection(0, 10), 10_000_000),
            (Idn::connection(0, 11), 10),
        ];
        for (idn, value) in numbers {
            store.set_number_of(idn, value);
        }
        store
    }

    #[test]
    fn the_recorded_configuration_is_good() {
        let mut invalid = Invalid::default();
        let configuration = resolve(&configured(), &mut invalid).unwrap();
        assert_eq!(invalid.idns(), []);
        assert_eq!((configuration.cycle_ns, configuration.mst_losses), (10_000_000, 10));
        let links: Vec<_> = configuration
            .links
            .iter()
            .map(|link| (link.index, link.producer, link.kind, link.at.offset, link.len()))
            .collect();
        assert_eq!(links, [(0, false, Kind::Mdt, 30, 8), (1, true, Kind::At, 24, 12)]);
    }

    #[test]
    fn every_mistake_is_named() {
        let x = Idn::connection;
        let cases: &[(&str, Idn, i64, &[Idn])] = &[
            ("cycle time", Idn::CYCLE_TIME, 300_000, &[Idn::CYCLE_TIME, x(0, 10)]),
            ("time behind the cycle", Idn::SYNC_TIME, 10_000_001, &[Idn::SYNC_TIME]),
            ("word behind the telegram", Idn::CONTROL_OFFSET, 45, &[Idn::CONTROL_OFFSET]),
            ("word in the hot-plug field", Idn::STATUS_OFFSET, 7, &[Idn::STATUS_OFFSET]),
            ("unused telegram", Idn::STATUS_OFFSET, 0x1014, &[Idn::STATUS_OFFSET]),
            ("telegram that cannot be", Idn::STATUS_OFFSET, 0x7014, &[Idn::STATUS_OFFSET]),
            ("channel over the word", Idn::SVC_MDT_OFFSET, 22, &[Idn::SVC_MDT_OFFSET]),
            ("connection over the channel", x(1, 3), 10, &[x(1, 3)]),
            ("connection behind the telegram", x(0, 3), 0x0827, &[x(0, 3)]),
            ("producer in an MDT", x(1, 3), 0x0826, &[x(1, 3)]),
            ("container", x(0, 1), 0x8010, &[x(0, 1)]),
            ("feedback as command", x(1, 1), 0x8000, &[x(1, 6)]),
            ("producer cycle", x(0, 10), 15_000_000, &[x(0, 10)]),
            ("connection without values", x(2, 1), 0xC000, &[x(2, 6), x(2, 3)]),
        ];
        for (what, idn, value, wanted) in cases {
            let mut store = configured();
            store.set_number_of(*idn, *value);
            let mut invalid = Invalid::default();
            assert!(resolve(&store, &mut invalid).is_none(), "{what}");
            assert_eq!(invalid.idns(), *wanted, "{what}");
        }
        let mut store = configured();
        store.set_data_of(Idn::AT_LENGTHS, &[0; 8]);
        let mut invalid = Invalid::default();
        resolve(&store, &mut invalid);
        assert_eq!(invalid.idns(), [Idn::AT_LENGTHS, Idn::STATUS_OFFSET, Idn::SVC_AT_OFFSET, x(1, 3)]);
    }
}
