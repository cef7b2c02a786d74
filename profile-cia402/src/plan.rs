//! Whether a bus can carry what its nodes send, in the worst case.
//!
//! What goes with SYNC must be through before the next one: SYNC itself, PDOs, and event-driven PDOs as often as their inhibit
//! time lets them. Of the cycle they may take a share, 70 % unless told otherwise: the rest is for SDO, heartbeats, EMCY and for
//! sending again what was spoilt. SDO and heartbeats have the highest identifiers, so they cannot delay a PDO by more than the
//! one frame that is on the wire; but with everything together the bus must not be full.
//!
//! Every frame counts with as many stuff bits as it could have ([`Shape::most`]), and a PDO that comes with every n-th SYNC counts
//! in each cycle, because all of them can come with the same one.

use core::fmt;

use profile_generic::can::Id;
use profile_generic::can::timing::{BitRate, Shape};
use profile_generic::time::DurationNs;

/// Thousandths of the cycle that what goes with SYNC may take, unless told otherwise.
pub const SHARE_DEFAULT: u16 = 700;

/// What a frame is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Purpose {
    /// SYNC.
    Sync,
    /// A PDO that this node receives; which of them, from 1.
    Rpdo(u8, u16),
    /// A PDO that this node sends; which of them, from 1.
    Tpdo(u8, u16),
    /// Heartbeat of this node.
    Heartbeat(u8),
    /// Node guarding of this node: the request, and the answer with the same identifier.
    Guarding(u8),
    /// Requests or answers of SDO.
    Sdo,
    /// Anything else that comes regularly and has time.
    Other,
}

impl Purpose {
    /// Whether it must be through within the cycle.
    const fn is_cyclic(self) -> bool {
        matches!(self, Purpose::Sync | Purpose::Rpdo(..) | Purpose::Tpdo(..))
    }
}

impl fmt::Display for Purpose {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Purpose::Sync => f.write_str("SYNC"),
            Purpose::Rpdo(node, number) => write!(f, "RPDO {number} of node {node}"),
            Purpose::Tpdo(node, number) => write!(f, "TPDO {number} of node {node}"),
            Purpose::Heartbeat(node) => write!(f, "heartbeat of node {node}"),
            Purpose::Guarding(node) => write!(f, "guarding of node {node}"),
            Purpose::Sdo => f.write_str("SDO"),
            Purpose::Other => f.write_str("other traffic"),
        }
    }
}

/// How often a frame comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cadence {
    /// With every n-th SYNC.
    Sync(u16),
    /// At most once in this time: heartbeat, event timer, inhibit time.
    Every(DurationNs),
    /// Whenever something changes, with no inhibit time.
    Unbounded,
}

/// A frame that comes again and again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Traffic {
    /// What it is for.
    pub purpose: Purpose,
    /// Its identifier.
    pub id: Id,
    /// Its length and kind.
    pub shape: Shape,
    /// How often it comes.
    pub cadence: Cadence,
}

/// A bus and what is to go on it.
#[derive(Debug, Clone, Copy)]
pub struct Plan<'a> {
    /// Nominal bit rate of the bus.
    pub rate: BitRate,
    /// From one SYNC to the next.
    pub cycle: DurationNs,
    /// Thousandths of the cycle that what goes with SYNC may take.
    pub share: u16,
    /// Everything that comes regularly.
    pub traffic: &'a [Traffic],
}

/// What the traffic takes of a bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Load {
    /// What goes with SYNC, in the worst cycle.
    pub cyclic: DurationNs,
    /// The same in thousandths of the cycle, rounded up.
    pub cyclic_load: u32,
    /// Everything, in thousandths of the time, rounded up.
    pub total_load: u32,
    /// The longest frame: how much SYNC can be late because of one that is on the wire.
    pub blocking: DurationNs,
    /// The shortest cycle that would do, if there is any.
    pub shortest: Option<DurationNs>,
}

/// Why the traffic does not fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum PlanError {
    /// What goes with SYNC takes too much of the cycle.
    #[error("SYNC and PDOs take {} of the cycle of {cycle} ({} %), expected at most {} % at {rate}{}", load.cyclic, Percent(load.cyclic_load), Percent((*share).into()), Shortest(*load))]
    Cyclic {
        /// What it comes to.
        load: Load,
        /// The cycle.
        cycle: DurationNs,
        /// What it may take, thousandths.
        share: u16,
        /// Of the bus.
        rate: BitRate,
    },
    /// With heartbeats, SDO and the rest the bus is full.
    #[error("the bus is used to {} % at {rate}, {} % of it by SYNC and PDOs; expected at most 100 %{}", Percent(load.total_load), Percent(load.cyclic_load), Shortest(*load))]
    Total {
        /// What it comes to.
        load: Load,
        /// Of the bus.
        rate: BitRate,
    },
    /// A frame can come as often as it likes.
    #[error("{purpose} is sent on every change, expected an inhibit time")]
    Unbounded {
        /// What it is for.
        purpose: Purpose,
    },
    /// Two kinds of frames have one identifier.
    #[error("{first} and {second} have the same identifier {id}")]
    SameIdentifier {
        /// The identifier.
        id: Id,
        /// What the one is for.
        first: Purpose,
        /// What the other is for.
        second: Purpose,
    },
    /// The cycle is no time at all, or longer than a second.
    #[error("expected a cycle of more than 0 and at most 1 s, got {0}")]
    Cycle(DurationNs),
}

/// Thousandths as a percentage.
struct Percent(u32);

impl fmt::Display for Percent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.0 / 10, self.0 % 10)
    }
}

/// What would do.
struct Shortest(Load);

impl fmt::Display for Shortest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.shortest {
            Some(cycle) => write!(f, "; a cycle of {cycle} would do"),
            None => f.write_str("; no cycle would do"),
        }
    }
}

impl Plan<'_> {
    /// Whether it fits, and what it takes.
    ///
    /// # Errors
    /// [`PlanError`], with the numbers.
    pub fn check(&self) -> Result<Load, PlanError> {
        if self.cycle <= DurationNs::ZERO || self.cycle > DurationNs::from_secs(1) {
            return Err(PlanError::Cycle(self.cycle));
        }
        for (place, one) in self.traffic.iter().enumerate() {
            if one.cadence == Cadence::Unbounded {
                return Err(PlanError::Unbounded { purpose: one.purpose });
            }
            let guards = matches!(one.purpose, Purpose::Guarding(_));
            let same = |other: &&Traffic| {
                other.id == one.id
                    && other.purpose != Purpose::Sdo
                    && !(guards && other.purpose == one.purpose)
            };
            if let Some(other) =
                self.traffic[..place].iter().find(same).filter(|_| one.purpose != Purpose::Sdo)
            {
                let (first, second) = (other.purpose, one.purpose);
                return Err(PlanError::SameIdentifier { id: one.id, first, second });
            }
        }
        let load = self.load();
        if load.cyclic_load > u32::from(self.share) {
            let (cycle, share, rate) = (self.cycle, self.share, self.rate);
            return Err(PlanError::Cyclic { load, cycle, share, rate });
        }
        if load.total_load > 1000 {
            return Err(PlanError::Total { load, rate: self.rate });
        }
        Ok(load)
    }

    /// What it takes, whether it fits or not; frames without an inhibit time count with every SYNC.
    #[must_use]
    pub fn load(&self) -> Load {
        let (cycle, share) = (self.cycle.0.max(1), i64::from(self.share).max(1));
        let (mut cyclic, mut with_sync, mut loose) = (0, 0, 0_i128);
        let mut blocking = DurationNs::ZERO;
        for one in self.traffic {
            let time = self.rate.time(one.shape.most());
            blocking = blocking.max(time);
            let times = one.cadence.times_in(self.cycle);
            if one.purpose.is_cyclic() {
                cyclic += time.0.saturating_mul(times);
            }
            match one.cadence {
                Cadence::Sync(_) | Cadence::Unbounded => with_sync += time.0,
                // Billionths of the time.
                Cadence::Every(span) => {
                    loose += i128::from(time.0) * 1_000_000_000 / i128::from(span.0.max(1))
                }
            }
        }
        let thousandths = |time: i64| i128::from(time) * 1000;
        let ceil = |numerator: i128, by: i128| {
            u32::try_from((numerator + by - 1).div_euclid(by)).unwrap_or(u32::MAX)
        };
        let total = thousandths(with_sync) * 1_000_000 + loose * i128::from(cycle);
        let idle = 1_000_000_000 - loose;
        // Both limits: the share of the cycle, and the whole bus beside what comes whatever the cycle is. Frames that come
        // twice in a long cycle come once in a short one, so that this may ask for a little too much.
        let shortest = (idle > 0).then(|| {
            let by_share = (thousandths(cyclic) + i128::from(share) - 1) / i128::from(share);
            let by_load = (i128::from(with_sync) * 1_000_000_000 + idle - 1) / idle;
            DurationNs(i64::try_from(by_share.max(by_load)).unwrap_or(i64::MAX))
        });
        Load {
            cyclic: DurationNs(cyclic),
            cyclic_load: ceil(thousandths(cyclic), cycle.into()),
            total_load: ceil(total, i128::from(cycle) * 1_000_000),
            blocking,
            shortest,
        }
    }
}

impl Cadence {
    /// How often at most it comes between two SYNCs.
    fn times_in(self, cycle: DurationNs) -> i64 {
        match self {
            Cadence::Sync(_) | Cadence::Unbounded => 1,
            Cadence::Every(span) => {
                // Neither is negative.
                (cycle.0.max(0) + span.0.max(1) - 1) / span.0.max(1)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// SYNC, for each axis so many RPDOs and TPDOs of so many bytes, heartbeats every 100 ms, one SDO request and answer in each
    /// cycle.
    fn axes(axes: u8, pdos: u16, shape: Shape) -> Vec<Traffic> {
        let short = |len| Shape::classic(len).unwrap();
        let one = |purpose, id, shape, cadence| Traffic { purpose, id: Id::Standard(id), shape, cadence };
        let mut all = vec![
            one(Purpose::Sync, 0x80, short(0), Cadence::Sync(1)),
            one(Purpose::Sdo, 0x601, short(8), Cadence::Sync(1)),
            one(Purpose::Sdo, 0x581, short(8), Cadence::Sync(1)),
        ];
        let beat = Cadence::Every(DurationNs::from_millis(100));
        for node in 1..=axes {
            for pdo in 1..=pdos {
                let id = u16::from(node) + 0x100 * (pdo - 1);
                all.push(one(Purpose::Rpdo(node, pdo), 0x200 + id, shape, Cadence::Sync(1)));
                all.push(one(Purpose::Tpdo(node, pdo), 0x180 + id, shape, Cadence::Sync(1)));
            }
            all.push(one(Purpose::Heartbeat(node), 0x700 + u16::from(node), short(1), beat));
        }
        all
    }

    fn check(rate: BitRate, cycle_us: i64, traffic: &[Traffic]) -> Result<Load, PlanError> {
        let cycle = DurationNs::from_micros(cycle_us);
        Plan { rate, cycle, share: SHARE_DEFAULT, traffic }.check()
    }

    /// The most axes that fit each cycle.
    fn most(rate: BitRate, pdos: u16, shape: Shape) -> [u8; 4] {
        [1_000, 2_000, 4_000, 8_000].map(|cycle| {
            (0..=60)
                .take_while(|&count| check(rate, cycle, &axes(count, pdos, shape)).is_ok())
                .last()
                .unwrap()
        })
    }

    /// Figures from the formula of the most bits: SYNC 55, 6 bytes 115, 8 bytes 135 bits, at 70 % of the cycle.
    #[test]
    fn axes_in_a_cycle() {
        let classic = |len| Shape::classic(len).unwrap();
        let slow = BitRate::classic(500_000).unwrap();
        assert_eq!(most(BitRate::MAX_CLASSIC, 1, classic(8)), [2, 4, 10, 20], "what is promised");
        assert_eq!(most(BitRate::MAX_CLASSIC, 1, classic(6)), [2, 5, 11, 24]);
        assert_eq!(most(BitRate::MAX_CLASSIC, 2, classic(8)), [1, 2, 5, 10]);
        assert_eq!(most(slow, 1, classic(8)), [0, 2, 4, 10]);
        let fd = |rate| BitRate::fd(1_000_000, rate).unwrap();
        assert_eq!(most(fd(2_000_000), 1, Shape::fd(8).unwrap()), [3, 7, 15, 30]);
        assert_eq!(most(fd(5_000_000), 1, Shape::fd(8).unwrap()), [5, 11, 24, 48]);
    }

    #[test]
    fn what_does_not_fit_is_refused_with_the_numbers() {
        let classic = Shape::classic(8).unwrap();
        let load = check(BitRate::MAX_CLASSIC, 1_000, &axes(2, 1, classic)).unwrap();
        let heartbeats = 2; // 2 * 65 us in 100 ms are 1.3 thousandths.
        assert_eq!(
            load,
            Load {
                cyclic: DurationNs(595_000),
                cyclic_load: 595,
                total_load: 595 + 270 + heartbeats,
                blocking: DurationNs(135_000),
                shortest: Some(DurationNs(866_126)),
            }
        );
        let error =
            |cycle, traffic: &[Traffic]| check(BitRate::MAX_CLASSIC, cycle, traffic).unwrap_err().to_string();
        assert_eq!(
            error(1_000, &axes(3, 1, classic)),
            "SYNC and PDOs take 865 us of the cycle of 1 ms (86.5 %), expected at most 70.0 % at 1 Mbit/s; a cycle of 1.235715 ms would do"
        );
        assert!(check(BitRate::MAX_CLASSIC, 1_236, &axes(3, 1, classic)).is_ok());
        let mut sdo = axes(2, 1, classic);
        for n in 0..2 {
            sdo.push(Traffic { id: Id::Standard(0x602 + n), ..sdo[1] });
        }
        assert_eq!(
            error(1_000, &sdo),
            "the bus is used to 113.7 % at 1 Mbit/s, 59.5 % of it by SYNC and PDOs; expected at most 100 %; a cycle of 1.136478 ms would do"
        );
        assert_eq!(error(0, &[]), "expected a cycle of more than 0 and at most 1 s, got 0 ns");
    }

    #[test]
    fn a_pdo_with_every_second_sync_counts_in_each_cycle() {
        let classic = Shape::classic(8).unwrap();
        let mut traffic = axes(2, 1, classic);
        let mut slow = traffic[3];
        (slow.purpose, slow.id, slow.cadence) = (Purpose::Tpdo(1, 2), Id::Standard(0x281), Cadence::Sync(2));
        traffic.push(slow);
        let cycle = DurationNs::from_millis(2);
        let plan = Plan { rate: BitRate::MAX_CLASSIC, cycle, share: SHARE_DEFAULT, traffic: &traffic };
        assert_eq!(plan.load().cyclic, DurationNs(595_000 + 135_000));
    }

    #[test]
    fn event_driven_pdos_count_by_their_inhibit_time() {
        let classic = Shape::classic(8).unwrap();
        let mut traffic = axes(1, 1, classic);
        let mut event = traffic[3];
        (event.purpose, event.id) = (Purpose::Tpdo(1, 2), Id::Standard(0x281));
        event.cadence = Cadence::Every(DurationNs::from_micros(700));
        traffic.push(event);
        let load = check(BitRate::MAX_CLASSIC, 2_000, &traffic).unwrap();
        assert_eq!(load.cyclic, DurationNs(55_000 + 2 * 135_000 + 3 * 135_000));
        traffic.last_mut().unwrap().cadence = Cadence::Unbounded;
        let error = check(BitRate::MAX_CLASSIC, 2_000, &traffic).unwrap_err();
        assert_eq!(error.to_string(), "TPDO 2 of node 1 is sent on every change, expected an inhibit time");
    }

    #[test]
    fn an_identifier_is_used_once() {
        let mut traffic = axes(2, 1, Shape::classic(8).unwrap());
        traffic[7].id = Id::Standard(0x181);
        let error = check(BitRate::MAX_CLASSIC, 4_000, &traffic).unwrap_err();
        assert_eq!(error.to_string(), "TPDO 1 of node 1 and TPDO 1 of node 2 have the same identifier 181");
    }

    #[test]
    fn guarding_asks_and_answers_with_one_identifier() {
        let classic = Shape::classic(8).unwrap();
        let mut traffic = axes(2, 1, classic);
        let without = check(BitRate::MAX_CLASSIC, 4_000, &traffic).unwrap();
        let (beat, id) = (Cadence::Every(DurationNs::from_millis(1)), Id::Standard(0x703));
        for len in [0, 1] {
            let shape = Shape::classic(len).unwrap();
            traffic.push(Traffic { purpose: Purpose::Guarding(3), id, shape, cadence: beat });
        }
        let load = check(BitRate::MAX_CLASSIC, 4_000, &traffic).unwrap();
        // 55 and 65 us in each millisecond.
        assert_eq!(load.total_load, without.total_load + 120);
        assert_eq!(load.cyclic, without.cyclic);
        traffic.last_mut().unwrap().id = Id::Standard(0x701);
        let error = check(BitRate::MAX_CLASSIC, 4_000, &traffic).unwrap_err();
        assert_eq!(
            error.to_string(),
            "heartbeat of node 1 and guarding of node 3 have the same identifier 701"
        );
    }

    #[test]
    fn heartbeats_alone_can_fill_a_bus() {
        let beat = Cadence::Every(DurationNs::from_millis(1));
        let one = |node: u8| Traffic {
            purpose: Purpose::Heartbeat(node),
            id: Id::Standard(0x700 + u16::from(node)),
            shape: Shape::classic(1).unwrap(),
            cadence: beat,
        };
        let traffic: Vec<_> = (1..=20).map(one).collect();
        let error = check(BitRate::MAX_CLASSIC, 4_000, &traffic).unwrap_err();
        assert_eq!(
            error.to_string(),
            "the bus is used to 130.0 % at 1 Mbit/s, 0.0 % of it by SYNC and PDOs; expected at most 100 %; no cycle would do"
        );
    }
}
