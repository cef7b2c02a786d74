//! How many lines others can have written into the log: refusals, and what comes and goes as peers like.
//!
//! Of each kind and peer a few lines in a minute are written, then they are counted, and one line has the count.

use std::fmt;
use std::net::IpAddr;
use std::sync::{Mutex, MutexGuard, PoisonError};

use profile_generic::time::{DurationNs, MonotonicTime};
use tracing::{info, warn};

/// The time for which lines are counted.
const WINDOW: DurationNs = DurationNs::from_secs(60);

/// Lines of one kind and peer in a window.
const OF_PEER: u32 = 4;

/// Lines of one kind in a window, of all peers.
const OF_KIND: u32 = 8;

/// Lines of all kinds in a window.
const OF_ALL: u32 = 24;

/// Peers that have a count of their own for each kind; the others have one together.
const PEERS_OF_KIND: usize = 3;

/// A kind of line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineKind {
    /// A TCP stream to EtherNet/IP was refused.
    Stream,
    /// A stream was closed because its peer does not read.
    Stalled,
    /// A Forward_Open was refused.
    Open,
    /// An explicit connection or a session timed out.
    Lost,
    /// A request had no answer of the motion device in time.
    Silent,
    /// A request to an axis was refused.
    Request,
    /// What a controller would set is not what the drive has.
    Setting,
    /// A Modbus client was refused.
    Modbus,
    /// An HTTP connection was refused.
    Http,
    /// Somebody was refused who would control axes over HTTP.
    Login,
    /// A client of local control was refused or lost.
    LocalRefused,
    /// A client of local control has come or gone.
    LocalClient,
}

impl LineKind {
    /// Its name in the line with the count.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stream => "stream refused",
            Self::Stalled => "stream closed",
            Self::Open => "Forward_Open refused",
            Self::Lost => "explicit connection or session timed out",
            Self::Silent => "request without an answer",
            Self::Request => "request refused",
            Self::Setting => "setting refused",
            Self::Modbus => "Modbus client refused",
            Self::Http => "HTTP connection refused",
            Self::Login => "HTTP control refused",
            Self::LocalRefused => "client of local control refused or lost",
            Self::LocalClient => "client of local control",
        }
    }

    /// Whether it belongs to the normal course.
    const fn is_normal(self) -> bool {
        matches!(self, Self::LocalClient)
    }
}

/// Whose lines they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Peer {
    /// A host.
    Host(IpAddr),
    /// A user of this host.
    User(u32),
    /// The controller of an axis, by the place of the axis in the configuration, from 0.
    Axis(u8),
    /// Nobody that is known.
    Unknown,
    /// All that have no count of their own.
    Others,
}

impl fmt::Display for Peer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Host(address) => write!(f, "{address}"),
            Self::User(uid) => write!(f, "user {uid}"),
            Self::Axis(axis) => write!(f, "axis {}", u16::from(*axis) + 1),
            Self::Unknown => f.write_str("unknown"),
            Self::Others => f.write_str("others"),
        }
    }
}

/// Lines that were left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LeftOut {
    /// Their kind.
    pub kind: LineKind,
    /// Whose.
    pub peer: Peer,
    /// How many.
    pub count: u64,
}

/// The limit, shared by all that write such lines. Nothing of the cycle comes here.
#[derive(Debug, Default)]
pub struct LineLimit(Mutex<Window>);

#[derive(Debug, Default)]
struct Window {
    began: Option<MonotonicTime>,
    counts: Vec<Count>,
    /// Of windows that are over.
    left_out: Vec<LeftOut>,
}

#[derive(Debug)]
struct Count {
    kind: LineKind,
    peer: Peer,
    written: u32,
    left_out: u64,
}

impl LineLimit {
    /// Whether a line of this kind and peer is to be written; it is counted otherwise.
    pub fn admits(&self, now: MonotonicTime, kind: LineKind, peer: Peer) -> bool {
        let mut window = self.lock();
        window.roll(now);
        window.began.get_or_insert(now);
        let sum = |counts: &[Count], kind: Option<LineKind>| -> u32 {
            counts.iter().filter(|one| kind.is_none_or(|kind| one.kind == kind)).map(|one| one.written).sum()
        };
        let room = sum(&window.counts, Some(kind)) < OF_KIND && sum(&window.counts, None) < OF_ALL;
        let count = window.count(kind, peer);
        if room && count.written < OF_PEER {
            count.written += 1;
            return true;
        }
        count.left_out = count.left_out.saturating_add(1);
        false
    }

    /// What was left out in windows that are over, each only once.
    pub fn take(&self, now: MonotonicTime) -> Vec<LeftOut> {
        let mut window = self.lock();
        window.roll(now);
        std::mem::take(&mut window.left_out)
    }

    /// Logs what was left out; to be called every now and then. An axis has its name.
    pub fn report(&self, now: MonotonicTime, axes: &[String]) {
        for LeftOut { kind, peer, count } in self.take(now) {
            let axis = match peer {
                Peer::Axis(axis) => axes.get(usize::from(axis)).map(String::as_str),
                _ => None,
            };
            let peer = axis.is_none().then(|| tracing::field::display(peer));
            let name = kind.name();
            if kind.is_normal() {
                info!(axis, peer, count, "{name}: more such lines were left out in the last minute");
            } else {
                warn!(axis, peer, count, "{name}: more such lines were left out in the last minute");
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, Window> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Window {
    /// Begins anew when the window is over.
    fn roll(&mut self, now: MonotonicTime) {
        if self.began.is_none_or(|began| now < began + WINDOW) {
            return;
        }
        self.began = None;
        for Count { kind, peer, left_out: count, .. } in self.counts.drain(..) {
            if count > 0 {
                self.left_out.push(LeftOut { kind, peer, count });
            }
        }
    }

    /// The count of a peer, or the one of the others.
    fn count(&mut self, kind: LineKind, peer: Peer) -> &mut Count {
        let own = self.counts.iter().position(|one| (one.kind, one.peer) == (kind, peer));
        let of_kind = self.counts.iter().filter(|one| one.kind == kind).count();
        let peer = if of_kind < PEERS_OF_KIND { peer } else { Peer::Others };
        let place = own.or_else(|| self.counts.iter().position(|one| (one.kind, one.peer) == (kind, peer)));
        let place = place.unwrap_or_else(|| {
            self.counts.push(Count { kind, peer, written: 0, left_out: 0 });
            self.counts.len() - 1
        });
        &mut self.counts[place]
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::*;

    const KINDS: [LineKind; 12] = [
        LineKind::Stream,
        LineKind::Stalled,
        LineKind::Open,
        LineKind::Lost,
        LineKind::Silent,
        LineKind::Request,
        LineKind::Setting,
        LineKind::Modbus,
        LineKind::Http,
        LineKind::Login,
        LineKind::LocalRefused,
        LineKind::LocalClient,
    ];

    fn at(millis: i64) -> MonotonicTime {
        MonotonicTime(5_000_000_000) + DurationNs::from_millis(millis)
    }

    fn host(number: u32) -> Peer {
        Peer::Host(Ipv4Addr::from(0x0A00_0000 + number).into())
    }

    /// Runs a storm of so many lines over this time. Gives the instant of each line that is written, those with counts included,
    /// and how many lines all counts and written lines come to.
    fn storm(lines: u32, millis: i64, line: impl Fn(u32) -> (LineKind, Peer)) -> (Vec<i64>, u64) {
        let limit = LineLimit::default();
        let (mut instants, mut accounted) = (Vec::new(), 0);
        let mut said = 0;
        for number in 0..lines {
            let now = i64::from(number) * millis / i64::from(lines);
            let (kind, peer) = line(number);
            if limit.admits(at(now), kind, peer) {
                instants.push(now);
                accounted += 1;
            }
            // The runner looks once a second.
            while said * 1_000 <= now {
                for left_out in limit.take(at(now)) {
                    instants.push(now);
                    accounted += left_out.count;
                }
                said += 1;
            }
        }
        for left_out in limit.take(at(millis + 60_000)) {
            instants.push(millis + 60_000);
            accounted += left_out.count;
        }
        (instants, accounted)
    }

    /// Most lines in any 60 seconds.
    fn most_in_a_minute(instants: &[i64]) -> usize {
        let within = |from: i64| instants.iter().filter(|at| (from..from + 60_000).contains(*at)).count();
        instants.iter().map(|from| within(*from)).max().unwrap_or(0)
    }

    #[test]
    fn storm_of_ten_thousand_refusals_writes_few_lines_and_every_one_is_counted() {
        for kind in KINDS {
            for (name, peers) in [("one peer", 1), ("ten thousand peers", 10_000)] {
                for millis in [8_000, 60_000, 600_000] {
                    let (instants, accounted) = storm(10_000, millis, |number| (kind, host(number % peers)));
                    let most = most_in_a_minute(&instants);
                    assert!((1..40).contains(&most), "{kind:?} of {name} in {millis} ms: {most} lines");
                    assert_eq!(accounted, 10_000, "{kind:?} of {name} in {millis} ms");
                }
            }
        }
    }

    #[test]
    fn storm_of_all_kinds_and_many_peers_at_once_writes_fewer_than_a_hundred_lines_in_any_minute() {
        let (instants, accounted) = storm(60_000, 360_000, |number| {
            (KINDS[usize::try_from(number % 11).unwrap()], host(number.wrapping_mul(7) % 997))
        });
        let most = most_in_a_minute(&instants);
        assert!(most < 100, "{most} lines");
        assert_eq!(accounted, 60_000);
    }

    #[test]
    fn few_lines_of_a_peer_are_written_and_the_rest_has_one_count() {
        let limit = LineLimit::default();
        let admitted = |millis, peer| limit.admits(at(millis), LineKind::Modbus, peer);
        let first: Vec<bool> = (0..6).map(|number| admitted(number, host(1))).collect();
        assert_eq!(first, [true, true, true, true, false, false]);
        assert!(admitted(7, host(2)), "another peer");
        assert_eq!(limit.take(at(59_999)), []);
        let count = LeftOut { kind: LineKind::Modbus, peer: host(1), count: 2 };
        assert_eq!(limit.take(at(60_000)), [count]);
        assert_eq!(limit.take(at(60_000)), [], "each only once");
        assert!(limit.admits(at(60_001), LineKind::Modbus, host(1)), "another window");
    }

    #[test]
    fn peers_beyond_those_with_a_count_of_their_own_have_one_together() {
        let limit = LineLimit::default();
        for number in 0..100 {
            limit.admits(at(0), LineKind::Open, host(number));
        }
        let left_out = limit.take(at(60_000));
        assert_eq!(left_out, [LeftOut { kind: LineKind::Open, peer: Peer::Others, count: 93 }]);
    }
}
