//! Process data: what the PDO objects allow, and when PDOs come and go.

use super::dictionary::{Dictionary, Mappable, abort, byte, long, word};
use super::nmt::NmtState;
use super::settings::{Events, Settings};

/// Bit 31 of a COB-ID: the PDO is not valid.
const INVALID: u32 = 0x8000_0000;
/// Bit 30: no remote requests.
const NO_RTR: u32 = 0x4000_0000;
/// Bit 29: an identifier of 29 bits.
const EXTENDED: u32 = 0x2000_0000;

/// One mapped object: index on the bus, sub-index, bytes.
pub type Mapped = (u16, u8, usize);

/// Communication and mapping of one PDO.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct Link {
    valid: bool,
    id: u16,
    rtr: bool,
    kind: u8,
    inhibit_us: u64,
    event_us: u64,
    start: u8,
    map: Vec<Mapped>,
}

impl Link {
    fn read(od: &Dictionary, index: u16, map_index: u16, transmit: bool) -> Self {
        let cob = long(od.int(index, 1));
        let micros = |value: i64, unit: u64| u64::try_from(value).unwrap_or(0) * unit;
        let count = byte(od.int(map_index, 0));
        let map = (1..=count)
            .filter_map(|sub| mapped(od, long(od.int(map_index, sub)), transmit).ok())
            .collect::<Vec<_>>();
        Self {
            valid: cob & INVALID == 0,
            id: word(i64::from(cob & 0x7FF)),
            rtr: cob & NO_RTR == 0,
            kind: byte(od.int(index, 2)),
            inhibit_us: micros(od.int(index, 3), 100),
            event_us: micros(od.int(index, 5), 1000),
            start: byte(od.int(index, 6)),
            map,
        }
    }

    fn length(&self) -> usize {
        self.map.iter().map(|(_, _, bytes)| bytes).sum()
    }
}

/// A PDO the drive receives.
#[derive(Debug, Clone, Default)]
struct Receive {
    link: Link,
    waiting: Option<Vec<u8>>,
    deadline: Option<u64>,
}

/// A PDO the drive sends.
#[derive(Debug, Clone, Default)]
struct Transmit {
    link: Link,
    count: u8,
    started: bool,
    sent: Option<Vec<u8>>,
    sent_at: u64,
    sampled: Option<Vec<u8>>,
}

/// What became of a received PDO.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Received {
    /// To be taken now.
    Now(Vec<Mapped>, Vec<u8>),
    /// Kept until the next SYNC.
    Later,
    /// Too few bytes.
    Short,
}

/// All PDOs of the drive.
#[derive(Debug, Clone, Default)]
pub struct Pdos {
    receive: Vec<Receive>,
    transmit: Vec<Transmit>,
}

/// The object behind a mapping entry.
///
/// # Errors
/// The abort code if it cannot be mapped.
pub fn mapped(od: &Dictionary, entry: u32, transmit: bool) -> Result<Mapped, u32> {
    let index = word(i64::from(entry >> 16));
    let [bits, sub, ..] = entry.to_le_bytes();
    if !transmit && sub == 0 && (2..=7).contains(&index) {
        // A dummy: the index of a data type.
        let bytes: u8 = match index {
            2 | 5 => 1,
            3 | 6 => 2,
            _ => 4,
        };
        return if bits == bytes * 8 { Ok((index, 0, bytes.into())) } else { Err(abort::NOT_MAPPABLE) };
    }
    let object = od.wire(index, sub)?;
    let fits = match object.map {
        Mappable::No => false,
        Mappable::Rx => !transmit,
        Mappable::Tx => transmit,
        Mappable::Both => true,
    };
    match object.kind.width() {
        Some(width) if fits && usize::from(bits) == width * 8 => Ok((index, sub, width)),
        _ => Err(abort::NOT_MAPPABLE),
    }
}

/// Which range of PDO objects an index is in: communication or mapping, received or sent.
fn range(index: u16) -> Option<(bool, bool)> {
    match index {
        0x1400..=0x15FF => Some((true, false)),
        0x1600..=0x17FF => Some((false, false)),
        0x1800..=0x19FF => Some((true, true)),
        0x1A00..=0x1BFF => Some((false, true)),
        _ => None,
    }
}

/// Identifiers a PDO must not have.
fn restricted(id: u32) -> bool {
    matches!(id, 0..=0x7F | 0x101..=0x180 | 0x581..=0x5FF | 0x601..=0x67F | 0x6E0..=0x6FF | 0x701..=0x77F | 0x780..)
}

/// Whether the PDO objects allow this download.
///
/// # Errors
/// The abort code.
pub fn check(
    od: &Dictionary,
    state: NmtState,
    s: &Settings,
    index: u16,
    sub: u8,
    value: i64,
) -> Result<(), u32> {
    let Some((communication, transmit)) = range(index) else { return Ok(()) };
    let locked = s.remap_only_preoperational && state != NmtState::PreOperational;
    let old = od.int(index, sub);
    if communication {
        let valid = long(od.int(index, 1)) & INVALID == 0;
        return match sub {
            1 if locked => Err(abort::STATE),
            1 => check_cob_id(long(old), long(value), s),
            2 => {
                let types = if transmit { &s.tpdo_types } else { &s.rpdo_types };
                let known = types.iter().any(|(low, high)| (*low..=*high).contains(&byte(value)));
                if known { Ok(()) } else { Err(abort::VALUE) }
            }
            3 | 6 if transmit && valid && value != old && s.inhibit_locked => Err(abort::VALUE),
            _ => Ok(()),
        };
    }
    if locked {
        return Err(abort::STATE);
    }
    let valid = long(od.int(index - 0x200, 1)) & INVALID == 0;
    if valid && s.remap_needs_disabled {
        return Err(s.remap_code);
    }
    if sub > 0 {
        if od.int(index, 0) != 0 && s.remap_needs_zero_count {
            return Err(s.remap_code);
        }
        return if value == 0 { Ok(()) } else { mapped(od, long(value), transmit).map(|_| ()) };
    }
    if value > i64::from(s.max_entries) {
        return Err(abort::VALUE);
    }
    let mut length = 0;
    for sub in 1..=byte(value) {
        length += mapped(od, long(od.int(index, sub)), transmit)?.2;
    }
    if length > 8 { Err(abort::PDO_LENGTH) } else { Ok(()) }
}

fn check_cob_id(old: u32, new: u32, s: &Settings) -> Result<(), u32> {
    let keeps_bit_30 = !s.bit_30_fixed || old & NO_RTR == 0 || new & NO_RTR != 0;
    let both_valid = old & INVALID == 0 && new & INVALID == 0;
    let moves = both_valid && old & 0x7FF != new & 0x7FF;
    let bad_id = new & INVALID == 0 && restricted(new & 0x1FFF_FFFF);
    if new & EXTENDED != 0 || !keeps_bit_30 || moves || bad_id { Err(abort::VALUE) } else { Ok(()) }
}

impl Pdos {
    /// Takes over what the objects say. What has not changed goes on.
    pub fn load(&mut self, od: &Dictionary, s: &Settings) {
        self.receive.resize_with(s.rpdos.len(), Receive::default);
        self.transmit.resize_with(s.tpdos.len(), Transmit::default);
        for ((pdo, index), at) in self.receive.iter_mut().zip(0x1400..).zip(0x1600..) {
            let link = Link::read(od, index, at, false);
            if link != pdo.link {
                *pdo = Receive { link, ..Receive::default() };
            }
        }
        for ((pdo, index), at) in self.transmit.iter_mut().zip(0x1800..).zip(0x1A00..) {
            let link = Link::read(od, index, at, true);
            if link != pdo.link {
                *pdo = Transmit { link, ..Transmit::default() };
            }
        }
    }

    /// Forgets what was received and sent: the node starts or leaves operational.
    pub fn forget(&mut self) {
        for pdo in &mut self.receive {
            *pdo = Receive { link: std::mem::take(&mut pdo.link), ..Receive::default() };
        }
        for pdo in &mut self.transmit {
            *pdo = Transmit { link: std::mem::take(&mut pdo.link), ..Transmit::default() };
        }
    }

    /// A frame that may be an RPDO.
    pub fn receive(&mut self, id: u16, data: &[u8], now: u64) -> Option<(Received, bool)> {
        let pdo = self.receive.iter_mut().find(|pdo| pdo.link.valid && pdo.link.id == id)?;
        if pdo.link.map.is_empty() {
            return None;
        }
        let length = pdo.link.length();
        let Some(bytes) = data.get(..length) else { return Some((Received::Short, false)) };
        pdo.deadline = (pdo.link.event_us > 0).then_some(now + pdo.link.event_us);
        let long = data.len() > length;
        if pdo.link.kind <= 240 {
            pdo.waiting = Some(bytes.to_vec());
            return Some((Received::Later, long));
        }
        Some((Received::Now(pdo.link.map.clone(), bytes.to_vec()), long))
    }

    /// RPDOs that take effect at a SYNC.
    pub fn waiting(&mut self) -> Vec<(Vec<Mapped>, Vec<u8>)> {
        let take = |pdo: &mut Receive| pdo.waiting.take().map(|data| (pdo.link.map.clone(), data));
        self.receive.iter_mut().filter_map(take).collect()
    }

    /// Whether an RPDO stayed away longer than its event timer says.
    pub fn late(&mut self, now: u64) -> bool {
        let mut late = false;
        for pdo in &mut self.receive {
            if pdo.deadline.is_some_and(|at| now > at) {
                pdo.deadline = None;
                late = true;
            }
        }
        late
    }

    /// TPDOs that go out at a SYNC with this counter.
    pub fn at_sync(&mut self, od: &Dictionary, counter: Option<u8>, now: u64) -> Vec<(u16, Vec<u8>)> {
        let mut out = Vec::new();
        for pdo in self.transmit.iter_mut().filter(|pdo| pdo.link.valid && !pdo.link.map.is_empty()) {
            let data = gather(od, &pdo.link.map);
            match pdo.link.kind {
                0 if pdo.sent.as_ref() != Some(&data) => {}
                252 => {
                    pdo.sampled = Some(data);
                    continue;
                }
                1..=240 => {
                    if !pdo.started
                        && pdo.link.start != 0
                        && counter.is_some()
                        && counter != Some(pdo.link.start)
                    {
                        continue;
                    }
                    // The first one goes out at its start value, or after n SYNCs.
                    let at_start = !pdo.started && pdo.link.start != 0 && counter.is_some();
                    pdo.started = true;
                    pdo.count += 1;
                    if pdo.count < pdo.link.kind && !at_start {
                        continue;
                    }
                    pdo.count = 0;
                }
                _ => continue,
            }
            pdo.sent = Some(data.clone());
            pdo.sent_at = now;
            out.push((pdo.link.id, data));
        }
        out
    }

    /// TPDOs that go out because of a change or a timer.
    pub fn events(&mut self, od: &Dictionary, s: &Settings, now: u64) -> Vec<(u16, Vec<u8>)> {
        let mut out = Vec::new();
        for pdo in self.transmit.iter_mut().filter(|pdo| pdo.link.valid && pdo.link.kind >= 254) {
            if pdo.link.map.is_empty() {
                continue;
            }
            let data = gather(od, &pdo.link.map);
            let timer = pdo.link.event_us > 0 && now - pdo.sent_at >= pdo.link.event_us && pdo.sent.is_some();
            let send = match &pdo.sent {
                None if s.sends_at_start => true,
                None => {
                    pdo.sent = Some(data);
                    pdo.sent_at = now;
                    continue;
                }
                Some(sent) => timer || changed(&pdo.link.map, sent, &data, od, s.events),
            };
            let quiet = pdo.sent.is_some() && now - pdo.sent_at < pdo.link.inhibit_us;
            if send && !quiet {
                pdo.sent = Some(data.clone());
                pdo.sent_at = now;
                out.push((pdo.link.id, data));
            }
        }
        out
    }

    /// A remote request: the answer.
    pub fn requested(&mut self, id: u16, od: &Dictionary, now: u64) -> Option<Vec<u8>> {
        let pdo = self.transmit.iter_mut().find(|pdo| pdo.link.valid && pdo.link.rtr && pdo.link.id == id)?;
        if pdo.link.map.is_empty() {
            return None;
        }
        let data = match pdo.link.kind {
            252 => pdo.sampled.clone()?,
            _ => gather(od, &pdo.link.map),
        };
        pdo.sent = Some(data.clone());
        pdo.sent_at = now;
        Some(data)
    }
}

fn gather(od: &Dictionary, map: &[Mapped]) -> Vec<u8> {
    let mut data = Vec::with_capacity(8);
    for (index, sub, bytes) in map {
        match od.wire(*index, *sub) {
            Ok(entry) => data.extend_from_slice(&entry.data),
            Err(_) => data.extend(std::iter::repeat_n(0, *bytes)),
        }
    }
    data
}

fn changed(map: &[Mapped], old: &[u8], new: &[u8], od: &Dictionary, events: Events) -> bool {
    let mut at = 0;
    map.iter().any(|(index, _, bytes)| {
        let differs = old.get(at..at + bytes) != new.get(at..at + bytes);
        at += bytes;
        let counts = match events {
            Events::AnyChange => true,
            Events::StatusChange => matches!(od.inner(*index), 0x6041 | 0x6061 | 0x603F | 0x1001),
            Events::TimerOnly => false,
        };
        differs && counts
    })
}
