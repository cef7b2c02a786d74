//! What may reach the PTP library: messages are checked before it sees them.
//!
//! The library computes with unsigned times and believes what is well formed. Fields that are absurd, replayed messages and floods
//! would make it wrong, slow or deaf, so they end here, each counted by its [`Refusal`].
//!
//! Header of every message (IEEE 1588-2008, clause 13.3), big endian:
//!
//! ```text
//! 0 type in the low half, 1 version in the low half, 2 2 length, 4 domain, 6 2 flags, 8 8 correction (ns x 65536),
//! 20 10 port identity of the sender, 30 2 sequence id, 33 log interval
//! ```

use std::fmt;

use arrayvec::ArrayVec;
use profile_generic::time::MonotonicTime;

/// Bytes of the header.
pub const HEADER_LEN: usize = 34;

/// Longest message that is looked at: the largest datagram of an Ethernet frame.
pub const MESSAGE_MAX: usize = 1472;

/// Clocks that announce themselves and are told to the library; a better one takes the place of the worst.
const CANDIDATES: usize = 4;

/// A candidate that has not announced itself for so long makes room, ns.
const CANDIDATE_AGE_NS: u64 = 10_000_000_000;

/// New candidates in [`ADMISSION_NS`]; as many again if they are better than all that are there. With the candidates these are as many
/// as the library remembers, and it forgets none of them sooner.
const ADMISSIONS: u8 = 2;

/// See [`ADMISSIONS`]: four Announces of CIP Sync.
const ADMISSION_NS: u64 = 8_000_000_000;

/// Announces of a candidate that come closer than this are refused, ns.
const ANNOUNCE_SPACING_NS: u64 = 20_000_000;

/// After so long without a Sync any sequence number is a new beginning, ns.
const SEQUENCE_AGE_NS: u64 = 5_000_000_000;

/// Largest correction that is believed, ns x 65536: a second.
const CORRECTION_MAX: i64 = 1_000_000_000 << 16;

/// Steps from a grandmaster beyond which an Announce goes in circles (IEEE 1588-2008, clause 9.3.2.5).
const STEPS_MAX: u16 = 255;

/// First and last second that a clock may tell: corrections take none beyond the ends of 64 bit nanoseconds.
const SECONDS: std::ops::Range<u64> = 2..9_000_000_000;

pub(super) mod kind {
    pub const SYNC: u8 = 0x0;
    pub const DELAY_REQUEST: u8 = 0x1;
    pub const FOLLOW_UP: u8 = 0x8;
    pub const DELAY_RESPONSE: u8 = 0x9;
    pub const ANNOUNCE: u8 = 0xB;
}

/// The sender is an alternate master (flag field, clause 13.3.2.6).
const ALTERNATE_MASTER: u16 = 0x0100;

/// Why a message was not passed on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Refusal {
    /// Shorter than its header, its kind or its length field say.
    Short,
    /// Not PTP version 2.
    Version,
    /// Another domain.
    Domain,
    /// A kind that this clock has no use for.
    Kind,
    /// We have sent it.
    Own,
    /// From an alternate master.
    Alternate,
    /// A correction of more than a second.
    Correction,
    /// A time with more than 999 999 999 ns, or at one of the ends of time.
    Time,
    /// An Announce 255 or more steps from its grandmaster.
    Steps,
    /// A sequence number that does not come next.
    Sequence,
    /// More Announces than anybody needs.
    Flood,
    /// An Announce of a clock that is worse than those that are there.
    Worse,
}

impl Refusal {
    /// Every reason.
    pub const ALL: [Self; 12] = [
        Self::Short,
        Self::Version,
        Self::Domain,
        Self::Kind,
        Self::Own,
        Self::Alternate,
        Self::Correction,
        Self::Time,
        Self::Steps,
        Self::Sequence,
        Self::Flood,
        Self::Worse,
    ];
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Short => "shorter than it says",
            Self::Version => "not PTP version 2",
            Self::Domain => "of another domain",
            Self::Kind => "of a kind for others",
            Self::Own => "sent by us",
            Self::Alternate => "from an alternate master",
            Self::Correction => "with a correction of more than a second",
            Self::Time => "with a time that is none",
            Self::Steps => "255 steps from its grandmaster",
            Self::Sequence => "out of sequence",
            Self::Flood => "more often than anybody needs",
            Self::Worse => "from a clock worse than four others",
        })
    }
}

/// A clock that announces itself.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    sender: [u8; 10],
    rank: Rank,
    at: MonotonicTime,
}

/// What decides between clocks, the better one less: priority 1, class, accuracy, variance, priority 2, identity, and behind them
/// the steps (IEEE 1588-2008, clause 9.3.4).
type Rank = (u8, [u8; 4], u8, [u8; 8], u16);

/// See the module.
#[derive(Debug)]
pub struct Guard {
    own: [u8; 8],
    domain: u8,
    /// The clock may be a master: it answers delay requests.
    answers: bool,
    candidates: ArrayVec<Candidate, CANDIDATES>,
    /// Sender, sequence number and time of the last Sync that was passed on.
    sync: Option<([u8; 10], u16, MonotonicTime)>,
    /// Since when strangers are counted, how many were admitted, and how many as the best.
    window: MonotonicTime,
    admitted: u8,
    preferred: u8,
    refused: [u64; Refusal::ALL.len()],
}

impl Guard {
    /// Passes messages of a domain to the follower with this identity.
    #[must_use]
    pub fn new(own: [u8; 8], domain: u8) -> Self {
        Self {
            own,
            domain,
            answers: false,
            candidates: ArrayVec::new(),
            sync: None,
            window: MonotonicTime::ZERO,
            admitted: 0,
            preferred: 0,
            refused: [0; Refusal::ALL.len()],
        }
    }

    /// Passes messages of a domain to a clock that may be a master: delay requests too.
    #[must_use]
    pub fn of_master(own: [u8; 8], domain: u8) -> Self {
        Self { answers: true, ..Self::new(own, domain) }
    }

    /// How many messages were refused for this reason.
    #[must_use]
    pub fn refused(&self, reason: Refusal) -> u64 {
        Refusal::ALL
            .iter()
            .position(|known| *known == reason)
            .and_then(|place| self.refused.get(place))
            .copied()
            .unwrap_or(0)
    }

    /// The message without what stands behind its end, if the library may have it.
    ///
    /// # Errors
    /// Why not; counted.
    pub fn pass<'a>(&mut self, message: &'a [u8], now: MonotonicTime) -> Result<&'a [u8], Refusal> {
        let result = self.judge(message, now);
        if let Err(reason) = result
            && let Some(place) = Refusal::ALL.iter().position(|known| *known == reason)
            && let Some(count) = self.refused.get_mut(place)
        {
            *count = count.saturating_add(1);
        }
        result
    }

    fn judge<'a>(&mut self, message: &'a [u8], now: MonotonicTime) -> Result<&'a [u8], Refusal> {
        let header = message.first_chunk::<HEADER_LEN>().ok_or(Refusal::Short)?;
        if header[1] & 0x0F != 2 {
            return Err(Refusal::Version);
        }
        let length = usize::from(u16::from_be_bytes([header[2], header[3]]));
        let message =
            message.get(..length).filter(|message| message.len() >= HEADER_LEN).ok_or(Refusal::Short)?;
        if header[4] != self.domain {
            return Err(Refusal::Domain);
        }
        let sender: [u8; 10] = part(message, 20)?;
        if sender.starts_with(&self.own) {
            return Err(Refusal::Own);
        }
        if u16::from_be_bytes([header[6], header[7]]) & ALTERNATE_MASTER != 0 {
            return Err(Refusal::Alternate);
        }
        let correction = i64::from_be_bytes(part(message, 8)?);
        if correction.unsigned_abs() > CORRECTION_MAX.unsigned_abs() {
            return Err(Refusal::Correction);
        }
        let sequence = u16::from_be_bytes([header[30], header[31]]);
        match header[0] & 0x0F {
            kind::SYNC => {
                let two_step = header[6] & 0x02 != 0;
                // With a Follow_Up to come the time in the Sync does not count.
                if !two_step || part::<10>(message, HEADER_LEN)? != [0; 10] {
                    time(message)?;
                }
                self.next_sync(sender, sequence, now)?;
            }
            kind::FOLLOW_UP | kind::DELAY_RESPONSE => {
                time(message)?;
                if header[0] & 0x0F == kind::DELAY_RESPONSE {
                    part::<10>(message, HEADER_LEN + 10)?;
                }
            }
            kind::ANNOUNCE => self.announce(message, sender, now)?,
            // The time in a request says nothing.
            kind::DELAY_REQUEST if self.answers => _ = part::<10>(message, HEADER_LEN)?,
            // Requests of other followers, and management, are for others.
            _ => return Err(Refusal::Kind),
        }
        Ok(message)
    }

    /// A Sync has to be newer than the one before from the same sender.
    fn next_sync(&mut self, sender: [u8; 10], sequence: u16, now: MonotonicTime) -> Result<(), Refusal> {
        if let Some((before, last, at)) = self.sync
            && before == sender
            && now.0.saturating_sub(at.0) < SEQUENCE_AGE_NS
            && !(1..0x8000).contains(&sequence.wrapping_sub(last))
        {
            return Err(Refusal::Sequence);
        }
        self.sync = Some((sender, sequence, now));
        Ok(())
    }

    /// Whether a stranger becomes a candidate. A flood of strangers takes nothing from the clocks that are known, and does not keep out
    /// a better one.
    fn admit(&mut self, rank: Rank, now: MonotonicTime) -> Result<(), Refusal> {
        let best = self.candidates.iter().map(|known| known.rank).min();
        let worst = self.candidates.iter().map(|known| known.rank).max();
        if self.candidates.is_full() && worst.is_some_and(|worst| worst <= rank) {
            return Err(Refusal::Worse);
        }
        if now.0.saturating_sub(self.window.0) >= ADMISSION_NS {
            (self.window, self.admitted, self.preferred) = (now, 0, 0);
        }
        let count = if self.admitted < ADMISSIONS {
            &mut self.admitted
        } else if best.is_none_or(|best| rank < best) {
            &mut self.preferred
        } else {
            return Err(Refusal::Flood);
        };
        if *count >= ADMISSIONS {
            return Err(Refusal::Flood);
        }
        *count += 1;
        Ok(())
    }

    fn announce(&mut self, message: &[u8], sender: [u8; 10], now: MonotonicTime) -> Result<(), Refusal> {
        // Behind an origin time that nobody uses: 44 2 UTC offset, 47 priority 1, 48 4 quality, 52 priority 2, 53 8 identity,
        // 61 2 steps removed, 63 time source.
        let body: [u8; 30] = part(message, HEADER_LEN)?;
        let steps = u16::from_be_bytes([body[27], body[28]]);
        if steps >= STEPS_MAX {
            return Err(Refusal::Steps);
        }
        let quality = [body[14], body[15], body[16], body[17]];
        let rank: Rank = (body[13], quality, body[18], part(message, 53)?, steps);
        self.candidates
            .retain(|known| now.0.saturating_sub(known.at.0) < CANDIDATE_AGE_NS || known.sender == sender);
        let candidate = Candidate { sender, rank, at: now };
        if let Some(known) = self.candidates.iter_mut().find(|known| known.sender == sender) {
            if now.0.saturating_sub(known.at.0) < ANNOUNCE_SPACING_NS {
                return Err(Refusal::Flood);
            }
            *known = candidate;
            return Ok(());
        }
        self.admit(rank, now)?;
        if self.candidates.is_full()
            && let Some(worst) = self.candidates.iter_mut().max_by_key(|known| known.rank)
        {
            *worst = candidate;
            return Ok(());
        }
        self.candidates.push(candidate);
        Ok(())
    }
}

fn part<const N: usize>(message: &[u8], from: usize) -> Result<[u8; N], Refusal> {
    message.get(from..).and_then(<[u8]>::first_chunk).copied().ok_or(Refusal::Short)
}

/// The time behind the header: 6 bytes of seconds and 4 of nanoseconds.
fn time(message: &[u8]) -> Result<(), Refusal> {
    let [a, b, c, d, e, f, nanoseconds @ ..] = part::<10>(message, HEADER_LEN)?;
    let seconds = u64::from_be_bytes([0, 0, a, b, c, d, e, f]);
    let is_time = SECONDS.contains(&seconds) && u32::from_be_bytes(nanoseconds) < 1_000_000_000;
    if is_time { Ok(()) } else { Err(Refusal::Time) }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    const OWN: [u8; 8] = [9; 8];
    const NOW: MonotonicTime = MonotonicTime(100_000_000_000);

    /// The head of a message.
    pub fn head(kind: u8, length: u16, sender: u8, sequence: u16) -> Vec<u8> {
        let mut message = vec![0_u8; length.into()];
        message[0] = kind;
        message[1] = 2;
        message[2..4].copy_from_slice(&length.to_be_bytes());
        message[20..28].fill(sender);
        message[29] = 1;
        message[30..32].copy_from_slice(&sequence.to_be_bytes());
        message
    }

    /// A Sync of one step that tells this second.
    pub fn sync(sender: u8, sequence: u16, seconds: u64) -> Vec<u8> {
        let mut message = head(kind::SYNC, 44, sender, sequence);
        message[34..40].copy_from_slice(&seconds.to_be_bytes()[2..]);
        message
    }

    /// An Announce of a clock with this priority.
    pub fn announce(sender: u8, priority: u8, sequence: u16) -> Vec<u8> {
        let mut message = head(kind::ANNOUNCE, 64, sender, sequence);
        message[47] = priority;
        message[48..52].copy_from_slice(&[248, 0xFE, 0xFF, 0xFF]);
        message[52] = 128;
        message[53..61].fill(sender);
        message[63] = 0xA0;
        message
    }

    fn edited(mut message: Vec<u8>, place: usize, bytes: &[u8]) -> Vec<u8> {
        message[place..place + bytes.len()].copy_from_slice(bytes);
        message
    }

    #[test]
    fn what_is_absurd_is_refused_with_its_reason() {
        let good = || sync(1, 5, 1_700_000_000);
        let two_step = edited(sync(1, 5, 0), 6, &[2, 0]);
        let response = edited(head(kind::DELAY_RESPONSE, 54, 1, 5), 36, &1_700_000_000_u32.to_be_bytes());
        let rows: [(&str, Vec<u8>, Result<usize, Refusal>); 25] = [
            ("a Sync", good(), Ok(44)),
            ("a Sync with padding behind", [good(), vec![0; 6]].concat(), Ok(44)),
            ("a Sync of two steps without a time", two_step, Ok(44)),
            ("a Delay_Resp", response.clone(), Ok(54)),
            ("an Announce", announce(1, 128, 0), Ok(64)),
            ("version 1", edited(good(), 1, &[1]), Err(Refusal::Version)),
            ("a length beyond the datagram", edited(good(), 2, &[0, 45]), Err(Refusal::Short)),
            ("a length below the header", edited(good(), 2, &[0, 33]), Err(Refusal::Short)),
            ("a length below the body", edited(good(), 2, &[0, 43]), Err(Refusal::Short)),
            ("a Delay_Resp without a requester", edited(response, 2, &[0, 53]), Err(Refusal::Short)),
            ("another domain", edited(good(), 4, &[1]), Err(Refusal::Domain)),
            ("our own", edited(good(), 20, &OWN), Err(Refusal::Own)),
            ("an alternate master", edited(good(), 6, &[1]), Err(Refusal::Alternate)),
            ("a correction near 2^47 ns", edited(good(), 8, &[0x7F, 0xFF]), Err(Refusal::Correction)),
            ("a correction near -2^47 ns", edited(good(), 8, &[0x80]), Err(Refusal::Correction)),
            ("the smallest correction", edited(good(), 8, &i64::MIN.to_be_bytes()), Err(Refusal::Correction)),
            ("a correction of a second", edited(good(), 8, &CORRECTION_MAX.to_be_bytes()), Ok(44)),
            ("second 0", sync(1, 5, 0), Err(Refusal::Time)),
            ("the last second", sync(1, 5, (1 << 48) - 1), Err(Refusal::Time)),
            ("too many nanoseconds", edited(good(), 40, &[0x3B, 0x9A, 0xCA, 0x00]), Err(Refusal::Time)),
            ("the most nanoseconds", edited(good(), 40, &[0x3B, 0x9A, 0xC9, 0xFF]), Ok(44)),
            ("254 steps", edited(announce(1, 128, 0), 61, &[0, 254]), Ok(64)),
            ("65535 steps", edited(announce(1, 128, 0), 61, &[0xFF, 0xFF]), Err(Refusal::Steps)),
            ("a request of another follower", head(0x1, 44, 1, 5), Err(Refusal::Kind)),
            ("management", head(0xD, 54, 1, 5), Err(Refusal::Kind)),
        ];
        for (name, message, expected) in rows {
            let mut guard = Guard::new(OWN, 0);
            let found = guard.pass(&message, NOW).map(<[u8]>::len);
            assert_eq!(found, expected, "{name}");
            if let Err(reason) = expected {
                assert_eq!(guard.refused(reason), 1, "{name}");
            }
        }
    }

    #[test]
    fn every_message_cut_at_any_byte_is_refused() {
        for message in [sync(1, 5, 1_700_000_000), announce(1, 128, 0)] {
            for end in 0..message.len() {
                let found = Guard::new(OWN, 0).pass(&message[..end], NOW);
                assert_eq!(found, Err(Refusal::Short), "{end}");
            }
        }
    }

    #[test]
    fn sequence_numbers_go_forward_until_the_master_was_silent() {
        let mut guard = Guard::new(OWN, 0);
        let mut pass = |sender, sequence, at: u64| {
            guard.pass(&sync(sender, sequence, 1_700_000_000), MonotonicTime(at * 1_000_000_000)).is_ok()
        };
        assert!(pass(1, 0xFFFE, 100));
        assert!(!pass(1, 0xFFFE, 100), "replayed");
        assert!(!pass(1, 0xFFF0, 100), "backwards");
        assert!(pass(1, 2, 101), "over the end");
        assert!(!pass(1, 0x8002, 101));
        assert!(pass(1, 0, 107), "a master that begins anew");
        assert!(pass(2, 0, 107), "another master");
    }

    #[test]
    fn a_flood_of_announces_is_cut_off() {
        let mut guard = Guard::new(OWN, 0);
        let mut passed = 0;
        for number in 0..10_000_u16 {
            let at = MonotonicTime(NOW.0 + u64::from(number) * 100_000);
            passed += u32::from(guard.pass(&announce(1, 128, number), at).is_ok());
        }
        assert_eq!((passed, guard.refused(Refusal::Flood)), (50, 10_000 - 50));
    }

    #[test]
    fn a_flood_of_strangers_does_not_silence_the_master() {
        let mut guard = Guard::new(OWN, 0);
        assert!(guard.pass(&announce(1, 128, 0), NOW).is_ok());
        for number in 0..10_000_u16 {
            let mut stranger = announce(2, 250, number);
            stranger[20..22].copy_from_slice(&number.to_be_bytes());
            let _ = guard.pass(&stranger, MonotonicTime(NOW.0 + u64::from(number) * 50_000));
        }
        assert_eq!(guard.refused(Refusal::Flood), 10_000 - 1, "one is admitted beside the master");
        assert!(guard.pass(&announce(1, 128, 1), MonotonicTime(NOW.0 + 600_000_000)).is_ok());
        let better = guard.pass(&announce(5, 100, 0), MonotonicTime(NOW.0 + 600_000_000)).map(drop);
        assert!(better.is_ok(), "a better clock is not kept out");
    }

    #[test]
    fn clocks_that_only_announce_do_not_keep_a_better_one_out() {
        let mut guard = Guard::new(OWN, 0);
        let at = |seconds: u64| MonotonicTime(NOW.0 + seconds * 1_000_000_000);
        let mut pass =
            |sender, priority, seconds| guard.pass(&announce(sender, priority, 0), at(seconds)).map(drop);
        for sender in 10..18 {
            assert_eq!(
                pass(sender, 250, 0),
                if sender < 12 { Ok(()) } else { Err(Refusal::Flood) },
                "{sender}"
            );
        }
        for sender in 10..18 {
            let expected = if sender < 14 { Ok(()) } else { Err(Refusal::Worse) };
            assert_eq!(pass(sender, 250, 8), expected, "{sender}: four are there");
        }
        assert_eq!(pass(1, 128, 9), Ok(()));
        assert_eq!(pass(13, 250, 9), Err(Refusal::Worse), "the worst has made room");
        assert_eq!(pass(13, 250, 18), Ok(()), "the others are gone");
    }

    proptest::proptest! {
        #[test]
        fn anything_is_survived(message in proptest::collection::vec(proptest::prelude::any::<u8>(), 0..100), at in 0_u64..u64::MAX) {
            let _ = Guard::new(OWN, 0).pass(&message, MonotonicTime(at));
        }
    }
}
