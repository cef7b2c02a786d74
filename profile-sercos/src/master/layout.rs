//! The telegrams of CP3 and CP4: who has which bytes, and when they are on the wire.
//!
//! ```text
//! MDT0   hot-plug 8, extended field 4, [2 spare], service channels, C-DEVs, connections
//! AT0    hot-plug 8, service channels, S-DEVs, connections
//! MDT1.. AT1..   [hot-plug 8], what did not fit before
//!
//! |MDT0 .. MDTn|      |AT0 .. ATn|        | unified communication |
//! 0                   t1                  t6                     t7        tScyc
//! ```
//!
//! The order is the one of the reference master. A part never crosses from one telegram to the next.

use arrayvec::ArrayVec;

use super::config::{CONNECTION_LEN_MAX, CONNECTIONS_MAX};
use crate::wire::extended::EXTENDED_LEN;
use crate::wire::header::{DATA_LEN_MAX, DATA_LEN_MIN, Kind, TELEGRAMS_MAX};
use crate::wire::hot_plug::HOT_PLUG_LEN;
use crate::wire::layout::{ConnectionLayout, DEVICE_WORD_LEN, DeviceLayout, Offset};
use crate::wire::svc::SVC_LEN;

/// Time of one byte at 100 Mbit/s in nanoseconds.
const BYTE_NS: u64 = 80;
/// Bytes of a frame besides its data field: preamble 8, addresses 12, EtherType 2, SERCOS header 6, FCS 4.
const OVERHEAD: u64 = 32;
/// Bytes of a frame up to the end of the SERCOS header, where slaves take the time from.
const MST_END: u64 = 28;
/// Bytes between MDT0's extended field and the first service channel, which so stands at a multiple of six
/// behind a hot-plug field.
const SPARE: usize = 2;
/// Shortest unified communication channel in nanoseconds: one frame of the largest size.
const UC_MIN_NS: u64 = 125_000;
/// Bytes kept free at the end of the cycle: the header of the next MST, and what a hardware master takes before it.
const CYCLE_GUARD: u64 = 60;
/// Time which the components on the way take besides the slaves in nanoseconds. No public figure: what is left of the
/// recorded ring delay of two slaves when the passes and half the gap are taken off.
const COMPONENTS_NS: u64 = 1_800;
/// Bytes of Ethernet's smallest permitted inter frame gap, and one for its rounding.
const GAP_MIN: u64 = 12 + 1;
/// The gap grows by this share of the slaves' jitter (ns) times the thousandfold root of the passes.
const GAP_FACTOR: (u64, u64) = (27, 640_000);
/// Largest inter frame gap which a slave without S-0-1036 stands.
pub(super) const GAP_MAX_FIXED: u64 = 37;

/// What one slave needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConnectionNeed {
    /// Number of the connection at the slave.
    pub instance: u8,
    /// In the AT (the slave produces) or in the MDT.
    pub slave_produces: bool,
    /// Bytes with C-CON, even.
    pub len: u16,
}

/// What one slave needs.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SlaveNeed {
    /// Its connections.
    pub connections: ArrayVec<ConnectionNeed, CONNECTIONS_MAX>,
    /// S-0-1005, time from feedback acquisition to AT (t5), ns.
    pub feedback_ns: u32,
    /// Minimum of S-0-1006, earliest start of AT0, ns.
    pub at_start_min_ns: u32,
    /// S-0-1037, jitter of its forwarding, ns; 0 where it does not report.
    pub jitter_ns: u32,
    /// S-0-1047, time until command values are active in it (t11), ns.
    pub consumer_ns: u32,
}

/// Where a connection is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConnectionPlace {
    /// Number of the connection at the slave.
    pub instance: u8,
    /// MDT or AT.
    pub kind: Kind,
    /// Telegram and offset of C-CON.
    pub at: Offset,
    /// Bytes with C-CON.
    pub len: u16,
    /// Bytes set aside for it; more than `len` where a slave that came later needs less than was kept for it.
    pub room: u16,
    /// Number in the network, S-0-1050.x.2.
    pub number: u16,
}

/// Where the parts of a slave are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SlavePlaces {
    /// S-0-1013.
    pub svc_mdt: Offset,
    /// S-0-1014.
    pub svc_at: Offset,
    /// S-0-1009.
    pub control: Offset,
    /// S-0-1011.
    pub status: Offset,
    /// Connections in the order of the configuration.
    pub connections: ArrayVec<ConnectionPlace, CONNECTIONS_MAX>,
}

/// When things are on the wire, nanoseconds from the cycle start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Times {
    /// S-0-1006, start of AT0 (t1).
    pub at_start_ns: u32,
    /// S-0-1007, feedback acquisition (tSync).
    pub sync_ns: u32,
    /// S-0-1008, command values valid (t3).
    pub command_valid_ns: u32,
    /// S-0-1015, ring delay.
    pub ring_delay_ns: u32,
    /// The last AT is back at the master.
    pub at_back_ns: u32,
    /// S-0-1023, synchronization jitter.
    pub sync_jitter_ns: u32,
    /// S-0-1036, inter frame gap in bytes.
    pub gap: u16,
    /// S-0-1017, begin and end of the unified communication channel (t6, t7); `None` when no room is left.
    pub uc_ns: Option<(u32, u32)>,
    /// Share of the cycle which MDTs and ATs take, per mille.
    pub load_permille: u32,
}

/// What the times depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    /// tScyc, ns.
    pub cycle_ns: u32,
    /// Deviation of the master's cycle start, ns.
    pub mst_jitter_ns: u32,
    /// Deviation of one slave's forwarding, ns; slaves that tell a larger one count with theirs.
    pub slave_jitter_ns: u32,
    /// Delay of one pass through a slave, ns.
    pub slave_delay_ns: u32,
    /// Whether every slave has S-0-1036.
    pub gap_adjustable: bool,
    /// Hot-plug field in every telegram.
    pub hot_plug_in_all: bool,
}

/// Why there is no layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LayoutError {
    /// A connection is longer than any place for it.
    #[error("slave {slave} connection {instance}: {length} bytes, at most {max}")]
    Connection {
        /// Position of the slave in the list.
        slave: usize,
        /// Connection number.
        instance: u8,
        /// Its length with C-CON.
        length: u16,
        /// The longest possible.
        max: usize,
    },
    /// Four telegrams are not enough.
    #[error(
        "{kind}s: {needed} bytes are needed, four telegrams have {available}; slave {slave} is the first without room"
    )]
    Telegrams {
        /// MDT or AT.
        kind: Kind,
        /// Position in the list of the first slave that lacks room.
        slave: usize,
        /// Bytes needed.
        needed: usize,
        /// Bytes there.
        available: usize,
    },
    /// The telegrams, with their jitter and until they are back, are longer than the cycle.
    #[error(
        "MDTs of {mdt_ns} ns and ATs of {at_ns} ns with a ring delay of {ring_ns} ns take {needed_ns} ns with jitter, \
         the cycle has {cycle_ns} ns"
    )]
    Cycle {
        /// Time of the MDTs with gaps in nanoseconds.
        mdt_ns: u64,
        /// Time of the ATs with gaps in nanoseconds.
        at_ns: u64,
        /// Time of a telegram through all slaves and back in nanoseconds.
        ring_ns: u64,
        /// Time needed in nanoseconds, late starts of slow slaves and jitter included.
        needed_ns: u64,
        /// Cycle time in nanoseconds.
        cycle_ns: u32,
    },
}

/// The telegrams of CP3 and CP4.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CyclicLayout {
    /// S-0-1010, data field lengths of the MDTs; 0 = not sent.
    pub mdt_len: [u16; TELEGRAMS_MAX],
    /// S-0-1012, data field lengths of the ATs; 0 = not sent.
    pub at_len: [u16; TELEGRAMS_MAX],
    /// Places by position of the slave; `None` for a slave that takes no part.
    pub slaves: Vec<Option<SlavePlaces>>,
    /// Times.
    pub times: Times,
    /// The largest times of the slaves, which `times` come from.
    pub slowest: Slowest,
}

/// The largest of the slaves' times, nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Slowest {
    /// S-0-1005.
    pub feedback_ns: u32,
    /// Minimum of S-0-1006, or where AT0 begins anyway.
    pub at_start_min_ns: u32,
    /// S-0-1037, or the configured one.
    pub jitter_ns: u32,
    /// S-0-1047.
    pub consumer_ns: u32,
}

/// Hands out the bytes of the telegrams of one kind.
struct Filler {
    kind: Kind,
    /// Start of telegrams 1 to 3.
    start: usize,
    telegram: usize,
    at: usize,
    /// Bytes asked for, beyond the end as well.
    needed: usize,
    len: [u16; TELEGRAMS_MAX],
    /// The first slave for which there was no room.
    without: Option<usize>,
}

impl Filler {
    fn new(kind: Kind, first: usize, start: usize) -> Filler {
        Filler { kind, start, telegram: 0, at: first, needed: first, len: [0; TELEGRAMS_MAX], without: None }
    }

    /// The next `len` bytes, for a slave. Beyond the last telegram it goes on counting, so that the error can say how
    /// much.
    fn take(&mut self, slave: usize, len: usize) -> Offset {
        if self.at + len > DATA_LEN_MAX {
            self.telegram += 1;
            self.at = self.start;
            self.needed += self.start;
        }
        if self.telegram >= TELEGRAMS_MAX {
            self.without.get_or_insert(slave);
        }
        let offset = self.at;
        self.at += len;
        self.needed += len;
        if let Some(total) = self.len.get_mut(self.telegram) {
            *total = u16::try_from(self.at.max(DATA_LEN_MIN)).unwrap_or(u16::MAX);
        }
        Offset {
            telegram: u8::try_from(self.telegram).unwrap_or(u8::MAX),
            offset: u16::try_from(offset).unwrap_or(u16::MAX),
        }
    }

    fn finish(mut self) -> Result<[u16; TELEGRAMS_MAX], LayoutError> {
        if let Some(slave) = self.without {
            let available = TELEGRAMS_MAX * DATA_LEN_MAX;
            return Err(LayoutError::Telegrams { kind: self.kind, slave, needed: self.needed, available });
        }
        if self.len[0] == 0 {
            self.len[0] = u16::try_from(DATA_LEN_MIN).unwrap_or(u16::MAX);
        }
        Ok(self.len)
    }
}

impl CyclicLayout {
    /// Storage for `slaves` slaves; [`CyclicLayout::compute`] does not allocate for up to so many.
    #[must_use]
    pub fn with_capacity(slaves: usize) -> CyclicLayout {
        CyclicLayout { slaves: Vec::with_capacity(slaves), ..CyclicLayout::default() }
    }

    /// Lays out the telegrams for these slaves; `None` stands for a slave that takes no part. On an error the
    /// layout is unusable until the next success.
    pub fn compute<'a, I>(&mut self, timing: &Timing, needs: I) -> Result<(), LayoutError>
    where
        I: Iterator<Item = Option<&'a SlaveNeed>> + Clone,
    {
        let start = if timing.hot_plug_in_all { HOT_PLUG_LEN } else { 0 };
        let spare = if timing.hot_plug_in_all { SPARE } else { 0 };
        let mut mdt = Filler::new(Kind::Mdt, HOT_PLUG_LEN + EXTENDED_LEN + spare, start);
        let mut at = Filler::new(Kind::At, HOT_PLUG_LEN, start);
        self.slaves.clear();
        for (slave, need) in needs.clone().enumerate() {
            self.slaves.push(need.map(|_| {
                let (svc_mdt, svc_at) = (mdt.take(slave, SVC_LEN), at.take(slave, SVC_LEN));
                let (control, status) = (svc_mdt, svc_at);
                SlavePlaces { svc_mdt, svc_at, control, status, connections: ArrayVec::new() }
            }));
        }
        for (slave, places) in self.slaves.iter_mut().enumerate() {
            if let Some(places) = places {
                places.control = mdt.take(slave, DEVICE_WORD_LEN);
                places.status = at.take(slave, DEVICE_WORD_LEN);
            }
        }
        let mut number = 0;
        for (slave, (places, need)) in self.slaves.iter_mut().zip(needs.clone()).enumerate() {
            let (Some(places), Some(need)) = (places, need) else { continue };
            for connection in &need.connections {
                let (instance, length) = (connection.instance, connection.len);
                if usize::from(length) > CONNECTION_LEN_MAX {
                    return Err(LayoutError::Connection { slave, instance, length, max: CONNECTION_LEN_MAX });
                }
                let filler = if connection.slave_produces { &mut at } else { &mut mdt };
                let (kind, at) = (filler.kind, filler.take(slave, usize::from(length)));
                places.connections.push(ConnectionPlace {
                    instance,
                    kind,
                    at,
                    len: length,
                    room: length,
                    number,
                });
                number += 1;
            }
        }
        self.mdt_len = mdt.finish()?;
        self.at_len = at.finish()?;
        self.times = self.compute_times(timing, needs.clone())?;
        let most = |get: fn(&SlaveNeed) -> u32| needs.clone().flatten().map(get).max().unwrap_or(0);
        self.slowest = Slowest {
            feedback_ns: most(|need| need.feedback_ns),
            at_start_min_ns: self.times.at_start_ns,
            jitter_ns: most(|need| need.jitter_ns).max(timing.slave_jitter_ns),
            consumer_ns: most(|need| need.consumer_ns),
        };
        Ok(())
    }

    fn compute_times<'a, I>(&self, timing: &Timing, needs: I) -> Result<Times, LayoutError>
    where
        I: Iterator<Item = Option<&'a SlaveNeed>> + Clone,
    {
        let active = || needs.clone().flatten();
        let most = |get: fn(&SlaveNeed) -> u32| active().map(|need| u64::from(get(need))).max().unwrap_or(0);
        let slaves = u64::try_from(active().count()).unwrap_or(u64::MAX).min(511);
        let cycle = u64::from(timing.cycle_ns);
        let slave_jitter = most(|need| need.jitter_ns).max(u64::from(timing.slave_jitter_ns));
        let gap = inter_frame_gap(slave_jitter, slaves, timing.gap_adjustable);
        let on_wire = |lengths: &[u16; TELEGRAMS_MAX]| -> u64 {
            lengths
                .iter()
                .filter(|&&len| len > 0)
                .map(|&len| (u64::from(len) + OVERHEAD + gap) * BYTE_NS)
                .sum()
        };
        let (mdt, at) = (on_wire(&self.mdt_len), on_wire(&self.at_len));
        let jitter = (u64::from(timing.mst_jitter_ns) + gap * BYTE_NS) / 2;
        let at_start = (mdt + jitter).max(most(|need| need.at_start_min_ns));
        let at_end = at_start + jitter + at;
        // Out through every slave and back, as the gaps let it shift, and what else is on the way.
        let path = 2 * slaves * u64::from(timing.slave_delay_ns) + gap * BYTE_NS / 2 + COMPONENTS_NS;
        // The ATs have to be back before the master begins the next cycle, which evaluates them.
        let needed = (at_end + jitter + CYCLE_GUARD * BYTE_NS).max(at_end + path);
        if needed > cycle {
            let (mdt_ns, at_ns, ring_ns, cycle_ns) = (mdt, at, path, timing.cycle_ns);
            return Err(LayoutError::Cycle { mdt_ns, at_ns, ring_ns, needed_ns: needed, cycle_ns });
        }
        let uc_end = cycle.saturating_sub(jitter + CYCLE_GUARD * BYTE_NS);
        let uc = (uc_end >= at_end + UC_MIN_NS).then(|| (narrow(at_end), narrow(uc_end)));
        let before_at = path + most(|need| need.feedback_ns);
        let command_valid = mdt - MST_END * BYTE_NS + path + most(|need| need.consumer_ns);
        Ok(Times {
            at_start_ns: narrow(at_start),
            sync_ns: narrow((at_start + cycle - before_at % cycle) % cycle),
            command_valid_ns: narrow(command_valid % cycle),
            ring_delay_ns: narrow(path + OVERHEAD * BYTE_NS),
            at_back_ns: narrow(at_end + path),
            sync_jitter_ns: narrow(jitter),
            gap: u16::try_from(gap).unwrap_or(u16::MAX),
            uc_ns: uc,
            load_permille: narrow((mdt + at) * 1000 / cycle),
        })
    }

    /// The same layout as the wire tools have it; `topology` gives the topology address by position.
    #[must_use]
    pub fn to_wire(&self, topology: impl Fn(usize) -> u16) -> crate::wire::layout::Layout {
        let device = |(index, places): (usize, &Option<SlavePlaces>)| {
            places.as_ref().map(|places| DeviceLayout {
                address: topology(index),
                device_control: Some(places.control),
                device_status: Some(places.status),
                svc_mdt: Some(places.svc_mdt),
                svc_at: Some(places.svc_at),
                connections: places
                    .connections
                    .iter()
                    .map(|place| ConnectionLayout {
                        index: place.instance,
                        kind: place.kind,
                        at: place.at,
                        len: place.len,
                    })
                    .collect(),
            })
        };
        crate::wire::layout::Layout {
            mdt_len: self.mdt_len,
            at_len: self.at_len,
            extended: true,
            devices: self.slaves.iter().enumerate().filter_map(device).collect(),
        }
    }
}

/// Bytes between two frames, so that frames which the slaves delay differently do not meet: every slave is passed
/// twice, and what the passes deviate adds up like noise.
fn inter_frame_gap(slave_jitter_ns: u64, slaves: u64, adjustable: bool) -> u64 {
    // Thousandfold root of 2 N, rounded.
    let root = (8_000_000 * slaves).isqrt().div_ceil(2);
    let (numerator, denominator) = GAP_FACTOR;
    let gap = GAP_MIN + numerator * slave_jitter_ns * root / denominator;
    if adjustable { gap } else { gap.min(GAP_MAX_FIXED) }
}

/// Times are below the cycle time or a few microseconds: they fit 32 bits.
fn narrow(ns: u64) -> u32 {
    u32::try_from(ns).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;
    use crate::wire::layout::Region;

    fn timing(cycle_ns: u32) -> Timing {
        Timing {
            cycle_ns,
            mst_jitter_ns: 45_000,
            slave_jitter_ns: 80,
            slave_delay_ns: 900,
            gap_adjustable: true,
            hot_plug_in_all: true,
        }
    }

    fn need(mdt: u16, at: u16) -> SlaveNeed {
        let connections = [(0, false, mdt), (1, true, at)]
            .into_iter()
            .filter(|&(_, _, len)| len > 0)
            .map(|(instance, slave_produces, len)| ConnectionNeed { instance, slave_produces, len })
            .collect();
        SlaveNeed { connections, ..SlaveNeed::default() }
    }

    fn layout(timing: &Timing, needs: &[SlaveNeed]) -> Result<CyclicLayout, LayoutError> {
        let mut layout = CyclicLayout::with_capacity(needs.len());
        layout.compute(timing, needs.iter().map(Some)).map(|()| layout)
    }

    #[test]
    fn the_recordings_layout() {
        // Startup recording: two slaves, MDT connections of 8 bytes, AT connections of 12, 10 ms cycle.
        let layout = layout(&timing(10_000_000), &[need(8, 12), need(8, 12)]).unwrap();
        assert_eq!(layout.mdt_len, [46, 0, 0, 0], "frames 3321, 3337: S-0-1010");
        assert_eq!(layout.at_len, [48, 0, 0, 0], "frames 3449, 3465: S-0-1012");
        let places: Vec<_> = layout.slaves.iter().flatten().collect();
        let offsets = |f: fn(&SlavePlaces) -> Offset| places.iter().map(|p| f(p).offset).collect::<Vec<_>>();
        assert_eq!(offsets(|p| p.svc_mdt), [14, 20], "S-0-1013");
        assert_eq!(offsets(|p| p.svc_at), [8, 14], "S-0-1014");
        assert_eq!(offsets(|p| p.control), [26, 28], "S-0-1009");
        assert_eq!(offsets(|p| p.status), [20, 22], "S-0-1011");
        assert_eq!(offsets(|p| p.connections[0].at), [30, 38], "S-0-1050.0.3");
        assert_eq!(offsets(|p| p.connections[1].at), [24, 36], "S-0-1050.1.3");
        let numbers: Vec<_> = places.iter().flat_map(|p| p.connections.iter().map(|c| c.number)).collect();
        assert_eq!(numbers, [0, 1, 2, 3], "S-0-1050.x.2");
        assert_eq!(
            layout.times,
            Times {
                at_start_ns: 31_020,      // frame 3881
                sync_ns: 24_860,          // frame 3929
                command_valid_ns: 11_680, // frame 3977
                ring_delay_ns: 8_720,     // frame 4025
                at_back_ns: 62_200 + 6_160,
                sync_jitter_ns: 23_260,           // frame 4073
                gap: 19,                          // frame 4345
                uc_ns: Some((62_200, 9_971_940)), // frames 4409, 4425
                load_permille: 1,
            }
        );
    }

    #[test]
    fn the_tools_see_no_overlap() {
        let needs = vec![need(40, 60); 40];
        let layout = layout(&timing(2_000_000), &needs).unwrap();
        let wire = layout.to_wire(|index| u16::try_from(index + 1).unwrap());
        for (kind, lengths) in [(Kind::Mdt, layout.mdt_len), (Kind::At, layout.at_len)] {
            for (number, len) in (0u8..).zip(lengths).filter(|&(_, len)| len > 0) {
                wire.regions(kind, number, usize::from(len)).unwrap();
            }
        }
        // 40 * (6 + 2 + 40) + 14 bytes take two MDTs, 40 * (6 + 2 + 60) + 8 bytes two ATs.
        assert!(layout.mdt_len[1] > 0 && layout.mdt_len[2] == 0);
        assert!(layout.at_len[1] > 0 && layout.at_len[2] == 0);
    }

    #[test]
    fn slaves_that_take_no_part_have_no_place() {
        let one = need(8, 12);
        let mut layout = CyclicLayout::with_capacity(3);
        layout.compute(&timing(1_000_000), [Some(&one), None, Some(&one)].into_iter()).unwrap();
        assert!(layout.slaves[1].is_none());
        assert_eq!(layout.slaves[2].as_ref().unwrap().svc_mdt.offset, 20);
        assert_eq!(layout.mdt_len[0], 46);
    }

    #[test]
    fn refusals_have_numbers() {
        let needs = vec![need(250, 8); 40];
        assert_eq!(
            layout(&timing(10_000_000), &needs),
            Err(LayoutError::Telegrams { kind: Kind::Mdt, slave: 19, needed: 10_398, available: 5976 })
        );
        assert_eq!(
            layout(&timing(10_000_000), &[need(258, 8)]),
            Err(LayoutError::Connection { slave: 0, instance: 0, length: 258, max: 256 })
        );
        // (46 + 32 + 19) * 80, (48 + 32 + 19) * 80; with 3 * 23260 and the guard of 4800.
        assert_eq!(
            layout(&timing(62_500), &[need(8, 12), need(8, 12)]),
            Err(LayoutError::Cycle {
                mdt_ns: 7_760,
                at_ns: 7_920,
                ring_ns: 6_160,
                needed_ns: 90_260,
                cycle_ns: 62_500
            })
        );
        // 200 slaves: MDTs and ATs of two telegrams each fit into 500 us, their way through the slaves does not.
        let error = layout(&Timing { mst_jitter_ns: 0, ..timing(500_000) }, &vec![need(0, 0); 200]);
        assert_eq!(
            error.unwrap_err().to_string(),
            "MDTs of 147680 ns and ATs of 147200 ns with a ring delay of 365000 ns take 666280 ns with jitter, the \
             cycle has 500000 ns"
        );
    }

    #[test]
    fn performance_anchors() {
        // Public performance table: 12 bytes for each of 70 drives in 250 us, with a hardware master.
        // Such a master takes ATs that come back in the next cycle; the ring delay does not count.
        let exact = Timing { mst_jitter_ns: 0, slave_jitter_ns: 0, slave_delay_ns: 0, ..timing(250_000) };
        let table = layout(&exact, &vec![need(12, 12); 70]).unwrap();
        assert_eq!(table.times.load_permille, 931);
        assert_eq!(table.times.uc_ns, None);
        // Nothing at all still has telegrams.
        let empty = layout(&exact, &[]).unwrap();
        assert_eq!((empty.mdt_len, empty.at_len), ([40, 0, 0, 0], [40, 0, 0, 0]));
    }

    /// How many drives with connections of 8 bytes each way a cycle holds, for a hardware master and a soft one.
    #[test]
    fn what_the_cycles_hold() {
        let mut table = String::new();
        let most = |timing: &Timing| {
            let fits = |count: usize| layout(timing, &vec![need(8, 8); count]);
            let count = (1..=511).take_while(|&count| fits(count).is_ok()).last().unwrap_or(0);
            let load = fits(count).map_or(0, |layout| layout.times.load_permille);
            // One more is refused, with the time that it would take.
            match (count, fits(count + 1)) {
                (_, Err(LayoutError::Telegrams { needed, available, .. })) => assert!(needed > available),
                (_, Err(LayoutError::Cycle { needed_ns, cycle_ns, .. })) => {
                    assert!(needed_ns > u64::from(cycle_ns) && needed_ns < u64::from(cycle_ns) + 100_000);
                }
                (_, other) => panic!("{other:?}"),
            }
            (count, load)
        };
        for cycle_ns in [31_250, 62_500, 125_000, 250_000, 500_000, 1_000_000, 2_000_000, 4_000_000] {
            let (hard, load) = most(&Timing { mst_jitter_ns: 1_000, ..timing(cycle_ns) });
            let (soft, soft_load) = most(&timing(cycle_ns));
            writeln!(
                table,
                "{cycle_ns:>9} ns: {hard:>3} at {load:>3} per mille, soft {soft:>3} at {soft_load:>3}"
            )
            .unwrap();
        }
        insta::assert_snapshot!(table);
    }

    #[test]
    fn slave_times_move_the_at() {
        let mut slow = need(8, 12);
        slow.at_start_min_ns = 100_000;
        slow.feedback_ns = 40_000;
        let layout = layout(&timing(1_000_000), &[slow, need(8, 12)]).unwrap();
        assert_eq!(layout.times.at_start_ns, 100_000);
        assert_eq!(layout.times.sync_ns, 100_000 - 6_160 - 40_000);
        let mut slower = need(8, 12);
        slower.feedback_ns = 200_000;
        let layout = self::layout(&timing(1_000_000), &[slower]).unwrap();
        assert!(layout.times.sync_ns > 800_000, "feedback of the cycle before: {}", layout.times.sync_ns);
    }

    #[test]
    fn gaps_and_ring_delays_of_any_number_of_slaves() {
        // Gaps by the public formula, with its thousandfold roots of 2 N: 1414, 2000, 4000, 5657, 11314, 22539, 31969.
        for (slaves, gap, capped) in
            [(1, 17, 17), (2, 19, 19), (8, 26, 26), (16, 32, 32), (64, 51, 37), (254, 89, 37), (511, 120, 37)]
        {
            assert_eq!(inter_frame_gap(80, slaves, true), gap, "{slaves}");
            assert_eq!(inter_frame_gap(80, slaves, false), capped, "{slaves}");
        }
        assert_eq!((inter_frame_gap(80, 0, true), inter_frame_gap(0, 511, true)), (13, 13));
        let one = layout(&timing(10_000_000), &[need(8, 12)]).unwrap();
        let many = layout(&timing(10_000_000), &vec![need(0, 0); 511]).unwrap();
        // 1800 a slave, half a gap, the components, one frame overhead.
        assert_eq!(one.times.ring_delay_ns, 1_800 + 680 + 1_800 + 2_560);
        assert_eq!(many.times.ring_delay_ns, 511 * 1_800 + 4_800 + 1_800 + 2_560);
    }

    #[test]
    fn slaves_that_tell_their_jitter_and_t11_are_believed() {
        let mut slow = need(8, 12);
        slow.jitter_ns = 200;
        slow.consumer_ns = 5_000;
        let layout = layout(&timing(1_000_000), &[slow, need(8, 12)]).unwrap();
        // 13 + 27 * 200 * 2000 / 640000, and five microseconds more until the command values are active.
        assert_eq!(layout.times.gap, 29);
        let path = 3_600 + 29 * 40 + 1_800;
        assert_eq!(layout.times.command_valid_ns, (46 + 32 + 29) * 80 - 2_240 + path + 5_000);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(96))]

        /// Whatever the slaves need: a layout without overlaps that holds its own times, or a refusal whose numbers
        /// show why.
        #[test]
        fn every_layout_holds(
            needs in vec((0u16..40, 0u16..40), 1..=511),
            cycles in 1u32..40,
            hot_plug_in_all: bool,
        ) {
            let needs: Vec<_> = needs.iter().map(|&(mdt, at)| need(2 * mdt, 2 * at)).collect();
            let timing = Timing { hot_plug_in_all, ..timing(cycles * 250_000) };
            match layout(&timing, &needs) {
                Ok(layout) => {
                    let wire = layout.to_wire(|index| u16::try_from(index + 1).unwrap());
                    for (kind, lengths) in [(Kind::Mdt, layout.mdt_len), (Kind::At, layout.at_len)] {
                        for (number, len) in (0u8..).zip(lengths) {
                            let len = usize::from(len);
                            prop_assert!(len == 0 || (DATA_LEN_MIN..=DATA_LEN_MAX).contains(&len));
                            if len == 0 {
                                continue;
                            }
                            let regions = wire.regions(kind, number, len).unwrap();
                            let first = regions.iter().find(|(_, region)| {
                                !matches!(region, Region::HotPlug | Region::Extended | Region::Gap)
                            });
                            let start = match (number, kind) {
                                (0, Kind::Mdt) if hot_plug_in_all => 14,
                                (0, Kind::Mdt) => 12,
                                (0, Kind::At) => 8,
                                _ if hot_plug_in_all => 8,
                                _ => 0,
                            };
                            prop_assert_eq!(first.map(|(range, _)| range.start), Some(start));
                        }
                    }
                    let times = layout.times;
                    let cycle = timing.cycle_ns;
                    prop_assert!(times.at_start_ns < cycle && times.at_back_ns <= cycle);
                    prop_assert!(times.sync_ns < cycle && times.command_valid_ns < cycle);
                    prop_assert!(times.load_permille < 1000);
                    if let Some((t6, t7)) = times.uc_ns {
                        prop_assert!(t6 > times.at_start_ns && t7 <= cycle && t7 - t6 >= 125_000);
                    }
                }
                Err(LayoutError::Telegrams { needed, available, slave, .. }) => {
                    prop_assert!(slave < needs.len() && available == 5976);
                    // What does not fit behind the end of a telegram is lost at most four times.
                    prop_assert!(needed + 4 * 80 > available, "{needed}");
                }
                Err(LayoutError::Cycle { needed_ns, cycle_ns, mdt_ns, at_ns, .. }) => {
                    prop_assert!(needed_ns > u64::from(cycle_ns) && mdt_ns + at_ns < needed_ns);
                }
                Err(error) => return Err(TestCaseError::fail(error.to_string())),
            }
        }
    }
}
