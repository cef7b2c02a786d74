//! The telegrams of CP3 and CP4 as the slaves were told them, and whether they fit together.

use std::ops::Range;

use super::learned::Learned;
use super::rule::{Part, Rule};
use crate::wire::connection::ConnectionSetup;
use crate::wire::extended::EXTENDED_LEN;
use crate::wire::header::{Kind, TELEGRAMS_MAX};
use crate::wire::hot_plug::HOT_PLUG_LEN;
use crate::wire::idn::Idn;
use crate::wire::layout::{DEVICE_WORD_LEN, Offset};
use crate::wire::svc::SVC_LEN;

/// Time of one byte at 100 Mbit/s, ns.
pub(super) const BYTE_NS: u64 = 80;
/// Bytes on the wire besides the data field: preamble 8, addresses 12, EtherType 2, SERCOS header 6, FCS 4.
const OVERHEAD: u64 = 32;
/// Smallest inter frame gap of Ethernet, bytes.
const GAP_MIN: u64 = 12;
/// Smallest unified communication channel, ns.
const UC_MIN_NS: u64 = 125_000;
/// S-0-1032: the MST deviates by more than 1 us.
const SOFT_MASTER: u32 = 1 << 4;

/// One connection of a slave.
#[derive(Debug)]
pub(super) struct Connection {
    pub index: u8,
    pub kind: Kind,
    pub at: Offset,
    pub producer: bool,
    /// C-CON of the last cycle.
    pub last: u16,
}

/// The parts of one slave.
#[derive(Debug)]
pub(super) struct Places {
    pub svc_mdt: Offset,
    pub svc_at: Offset,
    /// C-DEV; `None` like S-DEV.
    pub control: Option<Offset>,
    /// S-DEV; `None` for a slave that only has a service channel yet.
    pub status: Option<Offset>,
    pub connections: Vec<Connection>,
    /// What it writes, in each AT, sorted.
    pub own: [Vec<Range<usize>>; TELEGRAMS_MAX],
}

/// The telegrams of CP3 and CP4.
#[derive(Debug)]
pub(super) struct Plan {
    pub mdt_len: [usize; TELEGRAMS_MAX],
    pub at_len: [usize; TELEGRAMS_MAX],
    pub cycle_ns: u32,
    pub jitter_ns: u32,
    /// t1, where slaves were told it.
    pub at_start_ns: Option<u32>,
    /// t6, where there is a unified communication channel.
    pub uc_start_ns: Option<u32>,
    /// Slaves were told that the MST comes from a soft master.
    pub soft: bool,
    /// By position; `None` for a slave that takes no part.
    pub slaves: Vec<Option<Places>>,
    /// Everything that has a place.
    taken: Vec<Taken>,
}

/// A part of a telegram with its owner.
#[derive(Debug)]
struct Taken {
    kind: Kind,
    at: Offset,
    len: usize,
    part: Part,
}

impl Plan {
    /// What the slaves have learned in CP2, in order of position, and the rules it breaks.
    pub fn new(slaves: &[&Learned], broken: &mut Vec<Rule>) -> Plan {
        let position = |index: usize| u16::try_from(index + 1).unwrap_or(u16::MAX);
        let active = || slaves.iter().enumerate().filter(|(_, slave)| slave.checked);
        let first = active().next().map(|(_, slave)| *slave);
        let lengths = |idn| lengths(first.and_then(|slave| slave.list(idn)));
        let mut plan = Plan {
            mdt_len: lengths(Idn::MDT_LENGTHS),
            at_len: lengths(Idn::AT_LENGTHS),
            cycle_ns: first.and_then(|slave| slave.word(Idn::CYCLE_TIME)).unwrap_or(0),
            jitter_ns: active().filter_map(|(_, slave)| slave.word(Idn::SYNC_JITTER)).max().unwrap_or(0),
            at_start_ns: active().find_map(|(_, slave)| slave.word(Idn::AT_START)),
            uc_start_ns: None,
            soft: active().any(|(_, slave)| {
                slave.word(Idn::COMMUNICATION_CONTROL).is_some_and(|control| control & SOFT_MASTER != 0)
            }),
            slaves: Vec::with_capacity(slaves.len()),
            taken: Vec::new(),
        };
        let mut taken = vec![
            Taken { kind: Kind::Mdt, at: FIRST, len: HOT_PLUG_LEN, part: Part::HotPlug },
            Taken { kind: Kind::At, at: FIRST, len: HOT_PLUG_LEN, part: Part::HotPlug },
            Taken { kind: Kind::Mdt, at: BEHIND_HOT_PLUG, len: EXTENDED_LEN, part: Part::Extended },
        ];
        for (index, slave) in slaves.iter().enumerate() {
            let places = slave.checked.then(|| places(position(index), slave, &mut taken, broken)).flatten();
            plan.slaves.push(places);
        }
        for (index, slave) in active() {
            alike(position(index), first.unwrap_or(slave), slave, broken);
        }
        plan.check_places(&mut taken, broken);
        plan.check_times(&active().map(|(_, slave)| *slave).collect::<Vec<_>>(), broken);
        plan.taken = taken;
        plan
    }

    pub fn lengths(&self, kind: Kind) -> &[usize; TELEGRAMS_MAX] {
        match kind {
            Kind::Mdt => &self.mdt_len,
            Kind::At => &self.at_len,
        }
    }

    /// A slave has no places any more.
    pub fn drop(&mut self, index: usize) {
        let slave = u16::try_from(index + 1).unwrap_or(u16::MAX);
        self.taken.retain(|taken| !taken.part.is_of(slave));
        if let Some(places) = self.slaves.get_mut(index) {
            *places = None;
        }
    }

    /// A part that comes later lies within its telegram and on nothing else.
    pub fn check_free(&self, kind: Kind, at: Offset, len: usize, part: Part, broken: &mut Vec<Rule>) {
        let available = self.lengths(kind).get(usize::from(at.telegram)).copied().unwrap_or(0);
        let range = at.range(len);
        if range.end > available {
            broken.push(Rule::Beyond { kind, at, len, available, part });
        }
        for taken in &self.taken {
            let other = taken.at.range(taken.len);
            let same = taken.kind == kind && taken.at.telegram == at.telegram;
            if same && other.start < range.end && range.start < other.end {
                broken.push(Rule::Overlap { kind, at, first: taken.part, second: part });
            }
        }
    }

    fn set(&mut self, index: usize, places: Option<Places>) {
        while self.slaves.len() <= index {
            self.slaves.push(None);
        }
        self.slaves[index] = places;
    }

    /// A slave that is on its way in has a service channel, and nothing else yet.
    pub fn admit_service(&mut self, index: usize, svc_mdt: Offset, svc_at: Offset) {
        let mut own: [Vec<Range<usize>>; TELEGRAMS_MAX] = Default::default();
        if let Some(ranges) = own.get_mut(usize::from(svc_at.telegram)) {
            ranges.push(svc_at.range(SVC_LEN));
        }
        self.drop(index);
        self.set(
            index,
            Some(Places { svc_mdt, svc_at, control: None, status: None, connections: Vec::new(), own }),
        );
    }

    /// A slave comes in with what it was told, beside the others and like `first`.
    pub fn admit(&mut self, index: usize, slave: &Learned, first: &Learned, broken: &mut Vec<Rule>) {
        let position = u16::try_from(index + 1).unwrap_or(u16::MAX);
        self.drop(index);
        let mut parts = Vec::new();
        let places = places(position, slave, &mut parts, broken);
        for part in parts {
            self.check_free(part.kind, part.at, part.len, part.part, broken);
            self.taken.push(part);
        }
        alike(position, first, slave, broken);
        self.set(index, places);
    }

    fn check_places(&self, taken: &mut [Taken], broken: &mut Vec<Rule>) {
        taken.sort_by_key(|part| (part.kind == Kind::At, part.at.telegram, part.at.offset));
        for part in taken.iter() {
            let lengths = self.lengths(part.kind);
            let available = lengths.get(usize::from(part.at.telegram)).copied().unwrap_or(0);
            if part.at.range(part.len).end > available {
                let Taken { kind, at, len, part } = *part;
                broken.push(Rule::Beyond { kind, at, len, available, part });
            }
        }
        for pair in taken.windows(2) {
            let (first, second) = (&pair[0], &pair[1]);
            let same = first.kind == second.kind && first.at.telegram == second.at.telegram;
            if same && first.at.range(first.len).end > usize::from(second.at.offset) {
                let (kind, at) = (second.kind, second.at);
                broken.push(Rule::Overlap { kind, at, first: first.part, second: second.part });
            }
        }
    }

    fn check_times(&mut self, slaves: &[&Learned], broken: &mut Vec<Rule>) {
        let cycle = u64::from(self.cycle_ns);
        let exact = matches!(self.cycle_ns, 31_250 | 62_500 | 125_000);
        let steps = cycle > 0 && cycle.is_multiple_of(250_000) && cycle <= 65_000_000;
        if !exact && !steps {
            broken.push(Rule::CycleTime { found: self.cycle_ns });
        }
        let gap = slaves.iter().filter_map(|slave| slave.half(Idn::INTER_FRAME_GAP)).map(u64::from).max();
        let gap = gap.unwrap_or(0).max(GAP_MIN);
        let wire = |lengths: &[usize; TELEGRAMS_MAX]| -> u64 {
            let used = lengths.iter().filter(|&&len| len > 0);
            used.map(|&len| (u64::try_from(len).unwrap_or(u64::MAX) + OVERHEAD + gap) * BYTE_NS).sum()
        };
        let (mdt, at) = (wire(&self.mdt_len), wire(&self.at_len));
        if mdt + at > cycle {
            broken.push(Rule::Load { needed_ns: mdt + at, cycle_ns: self.cycle_ns });
            return;
        }
        let mut window = |idn, found: u64, min: u64, max: u64| {
            if found < min || found > max {
                broken.push(Rule::Window { idn, found, min, max });
            }
        };
        for slave in slaves {
            let times = [
                (Idn::AT_START, mdt, cycle - at),
                (Idn::SYNC_TIME, 0, cycle.saturating_sub(1)),
                (Idn::COMMAND_VALID, 0, cycle),
            ];
            for (idn, min, max) in times {
                if let Some(found) = slave.word(idn) {
                    window(idn, u64::from(found), min, max);
                }
            }
            let Some(uc) = slave.list(Idn::UC_TIMES).and_then(<[u8]>::first_chunk::<8>) else { continue };
            let [a, b, c, d, e, f, g, h] = *uc;
            let (t6, t7) = (u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h]));
            if (t6, t7) != (0, 0) {
                self.uc_start_ns = Some(t6);
                let start = u64::from(self.at_start_ns.unwrap_or(0)).max(mdt);
                window(Idn::UC_TIMES, u64::from(t6), start + at, cycle.saturating_sub(UC_MIN_NS));
                window(Idn::UC_TIMES, u64::from(t7), u64::from(t6) + UC_MIN_NS, cycle);
            }
        }
    }
}

const FIRST: Offset = Offset { telegram: 0, offset: 0 };
const BEHIND_HOT_PLUG: Offset = Offset { telegram: 0, offset: 8 };

fn lengths(list: Option<&[u8]>) -> [usize; TELEGRAMS_MAX] {
    let mut lengths = [0; TELEGRAMS_MAX];
    for (len, bytes) in lengths.iter_mut().zip(list.unwrap_or_default().chunks_exact(2)) {
        *len = usize::from(u16::from_le_bytes([bytes[0], bytes[1]]));
    }
    lengths
}

/// The places of one slave; `None` when it was not told all of them.
fn places(position: u16, slave: &Learned, taken: &mut Vec<Taken>, broken: &mut Vec<Rule>) -> Option<Places> {
    let mut offset = |idn| {
        let word = slave.half(idn);
        if word.is_none() {
            broken.push(Rule::NotConfigured { slave: position, idn });
        }
        word.map(Offset::from_parameter)
    };
    let (control, status) = (offset(Idn::CONTROL_OFFSET), offset(Idn::STATUS_OFFSET));
    let (svc_mdt, svc_at) = (offset(Idn::SVC_MDT_OFFSET)?, offset(Idn::SVC_AT_OFFSET)?);
    let (control, status) = (control?, status?);
    let mut part = |kind, at, len, part| taken.push(Taken { kind, at, len, part });
    part(Kind::Mdt, svc_mdt, SVC_LEN, Part::Svc(position));
    part(Kind::At, svc_at, SVC_LEN, Part::Svc(position));
    part(Kind::Mdt, control, DEVICE_WORD_LEN, Part::DeviceWord(position));
    part(Kind::At, status, DEVICE_WORD_LEN, Part::DeviceWord(position));
    let mut own: [Vec<Range<usize>>; TELEGRAMS_MAX] = Default::default();
    let mut write = |at: Offset, len: usize| {
        if let Some(ranges) = own.get_mut(usize::from(at.telegram)) {
            ranges.push(at.range(len));
        }
    };
    write(svc_at, SVC_LEN);
    write(status, DEVICE_WORD_LEN);
    let mut connections = Vec::new();
    for index in slave.connections() {
        let x = |element| Idn::connection(index, element);
        // Slaves with a fixed configuration may not be told a setup; they produce in ATs and consume in MDTs.
        let mdt = |word| Offset::from_assignment(word).0 == Kind::Mdt;
        let fixed = slave.half(x(3)).map(|word| ConnectionSetup::synchronous(!mdt(word)));
        let told = slave.half(x(1)).map(ConnectionSetup::from_bits_retain);
        let setup = told.or(fixed).unwrap_or_default();
        if !setup.contains(ConnectionSetup::ACTIVE) {
            continue;
        }
        let (Some(assignment), Some(len)) = (slave.half(x(3)), slave.half(x(5))) else {
            broken.push(Rule::NotConfigured { slave: position, idn: x(3) });
            continue;
        };
        let producer = setup.contains(ConnectionSetup::PRODUCER);
        let (kind, at) = Offset::from_assignment(assignment);
        let len = usize::from(len);
        // A connection that several slaves use stands in the telegrams once: with its producer.
        if producer || kind == Kind::Mdt {
            part(kind, at, len, Part::Connection(position, index));
        }
        if producer {
            write(at, len);
        }
        connections.push(Connection { index, kind, at, producer, last: 0 });
    }
    for ranges in &mut own {
        ranges.sort_by_key(|range| range.start);
    }
    Some(Places { svc_mdt, svc_at, control: Some(control), status: Some(status), connections, own })
}

/// What every slave is told alike.
fn alike(position: u16, first: &Learned, slave: &Learned, broken: &mut Vec<Rule>) {
    if slave.word(Idn::CYCLE_TIME).is_none() {
        broken.push(Rule::NotConfigured { slave: position, idn: Idn::CYCLE_TIME });
    }
    for idn in [Idn::MDT_LENGTHS, Idn::AT_LENGTHS] {
        if slave.list(idn).is_none() {
            broken.push(Rule::NotConfigured { slave: position, idn });
        }
        if slave.list(idn) != first.list(idn) {
            broken.push(Rule::NotAlike { slave: position, idn });
        }
    }
    for idn in [Idn::CYCLE_TIME, Idn::AT_START, Idn::SYNC_TIME, Idn::COMMAND_VALID, Idn::SYNC_JITTER] {
        if let (Some(first), Some(own)) = (first.word(idn), slave.word(idn))
            && first != own
        {
            broken.push(Rule::NotAlike { slave: position, idn });
        }
    }
}
