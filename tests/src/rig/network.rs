//! A network for datagrams in virtual time: it delays, loses, doubles and overtakes them as its knobs say,
//! the same way
//! each time for the same seed.

use profile_generic::time::{DurationNs, MonotonicTime};

/// Pseudo-random numbers (SplitMix64): the same ones for the same seed.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// Numbers that follow from `seed`.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next number.
    pub const fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A number below `end`; 0 when `end` is.
    pub const fn below(&mut self, end: u64) -> u64 {
        if end == 0 { 0 } else { self.next() % end }
    }

    /// Whether an event of this probability in parts per thousand happens.
    pub const fn happens(&mut self, per_mille: u16) -> bool {
        per_mille != 0 && self.below(1000) < per_mille as u64
    }
}

/// What the network does to the datagrams of both directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Knobs {
    /// Time that every datagram is under way.
    pub latency: DurationNs,
    /// Datagrams lost, parts per thousand.
    pub loss: u16,
    /// Datagrams delivered twice, parts per thousand.
    pub duplication: u16,
    /// Datagrams held back by up to [`Knobs::hold`] so that others overtake them, parts per thousand.
    pub reordering: u16,
    /// Longest time a datagram is held back, in addition to the latency.
    pub hold: DurationNs,
}

impl Knobs {
    /// A switch with nothing else on it.
    pub const GOOD: Self = Self {
        latency: DurationNs::from_micros(100),
        loss: 0,
        duplication: 0,
        reordering: 0,
        hold: DurationNs::from_millis(10),
    };
}

/// What happened to the datagrams.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Handed to the network.
    pub sent: u64,
    /// Lost.
    pub lost: u64,
    /// Delivered twice.
    pub doubled: u64,
    /// Held back.
    pub held: u64,
}

/// One direction of the network.
#[derive(Debug)]
pub struct Pipe<T> {
    random: Random,
    under_way: Vec<(MonotonicTime, u64, T)>,
    counts: Counts,
}

impl<T: Clone> Pipe<T> {
    /// An empty pipe.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self {
            random: Random::new(seed),
            under_way: Vec::new(),
            counts: Counts { sent: 0, lost: 0, doubled: 0, held: 0 },
        }
    }

    /// What happened so far.
    #[must_use]
    pub const fn counts(&self) -> Counts {
        self.counts
    }

    /// Takes a datagram.
    pub fn send(&mut self, now: MonotonicTime, knobs: &Knobs, datagram: T) {
        self.counts.sent += 1;
        if self.random.happens(knobs.loss) {
            self.counts.lost += 1;
            return;
        }
        let mut copies = 1;
        if self.random.happens(knobs.duplication) {
            self.counts.doubled += 1;
            copies = 2;
        }
        for _ in 0..copies {
            let mut at = now + knobs.latency;
            if self.random.happens(knobs.reordering) {
                self.counts.held += 1;
                let hold = u64::try_from(knobs.hold.as_nanos()).unwrap_or(0);
                at = MonotonicTime(at.0.saturating_add(self.random.below(hold)));
            }
            self.under_way.push((at, self.counts.sent, datagram.clone()));
        }
    }

    /// When the next datagram arrives.
    #[must_use]
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        self.under_way.iter().map(|(at, ..)| *at).min()
    }

    /// The next datagram that has arrived.
    pub fn receive(&mut self, now: MonotonicTime) -> Option<T> {
        let arrived = self.under_way.iter().enumerate().filter(|(_, (at, ..))| *at <= now);
        let (place, _) = arrived.min_by_key(|(_, (at, order, _))| (*at, *order))?;
        Some(self.under_way.remove(place).2)
    }

    /// Loses everything that is under way.
    pub fn clear(&mut self) {
        self.under_way.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn through(knobs: &Knobs, seed: u64) -> (Vec<u32>, Counts) {
        let mut pipe = Pipe::new(seed);
        for number in 0..1000_u32 {
            pipe.send(MonotonicTime(u64::from(number) * 4_000_000), knobs, number);
        }
        let mut arrived = Vec::new();
        while let Some(at) = pipe.wake_at() {
            arrived.extend(pipe.receive(at));
        }
        (arrived, pipe.counts())
    }

    #[test]
    fn a_good_network_delivers_everything_in_order() {
        let (arrived, counts) = through(&Knobs::GOOD, 1);
        assert_eq!(arrived, (0..1000).collect::<Vec<_>>());
        assert_eq!(counts, Counts { sent: 1000, ..Counts::default() });
    }

    #[test]
    fn each_knob_does_what_it_says_and_the_seed_decides_when() {
        let knobs = Knobs { loss: 100, duplication: 50, reordering: 200, ..Knobs::GOOD };
        let (arrived, counts) = through(&knobs, 7);
        assert_eq!(through(&knobs, 7), (arrived.clone(), counts), "the same seed, the same network");
        assert_ne!(through(&knobs, 8).0, arrived);
        assert!((60..140).contains(&counts.lost), "{counts:?}");
        assert!((20..80).contains(&counts.doubled), "{counts:?}");
        assert!((120..280).contains(&counts.held), "{counts:?}");
        let delivered = counts.sent - counts.lost + counts.doubled;
        assert_eq!(u64::try_from(arrived.len()), Ok(delivered));
        assert!(!arrived.is_sorted(), "held ones are overtaken");
    }
}
