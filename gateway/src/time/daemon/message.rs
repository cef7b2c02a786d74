//! Management messages of PTP as `ptp4l` takes them on its Unix socket (IEEE 1588-2008, clause 15), big endian.
//!
//! ```text
//! 0 34 header, 34 10 target port (all ones), 44 hops, 46 action (0 GET, 2 RESPONSE), 48 2 TLV type (1, or 2 for an error),
//! 50 2 length of what follows, 52 2 management id, 54 data
//! ```

use crate::time::status::{Master, Quality};

/// Seconds from UTC to TAI that `ptp4l` assumes while its master does not vouch for more (its option `utc_offset`).
const UTC_OFFSET: i16 = 37;

/// Bytes of a question.
pub const QUESTION_LEN: usize = 54;

/// Bytes of the longest answer that is understood, and more.
pub const ANSWER_MAX: usize = 512;

mod place {
    pub const LENGTH: usize = 2;
    pub const DOMAIN: usize = 4;
    pub const SEQUENCE: usize = 30;
    pub const CONTROL: usize = 32;
    pub const TARGET: usize = 34;
    pub const ACTION: usize = 46;
    pub const TLV: usize = 48;
    pub const TLV_LENGTH: usize = 50;
    pub const ID: usize = 52;
    pub const DATA: usize = 54;
}

/// A management message.
const MANAGEMENT: u8 = 0x0D;
const RESPONSE: u8 = 2;
const TLV_MANAGEMENT: u16 = 1;

/// What is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Question {
    /// CURRENT_DATA_SET.
    Current = 0x2001,
    /// PARENT_DATA_SET.
    Parent = 0x2002,
    /// TIME_PROPERTIES_DATA_SET.
    TimeProperties = 0x2003,
    /// PORT_DATA_SET.
    Port = 0x2004,
    /// TIME_STATUS_NP of linuxptp.
    TimeStatus = 0xC000,
}

impl Question {
    /// In the order in which they are asked.
    pub const ALL: [Self; 5] =
        [Self::Current, Self::Parent, Self::TimeProperties, Self::Port, Self::TimeStatus];

    /// The message.
    #[must_use]
    pub fn emit(self, domain: u8, sequence: u16) -> [u8; QUESTION_LEN] {
        let mut message = [0; QUESTION_LEN];
        (message[0], message[1]) = (MANAGEMENT, 2);
        put(&mut message, place::LENGTH, 54);
        message[place::DOMAIN] = domain;
        put(&mut message, place::SEQUENCE, sequence);
        (message[place::CONTROL], message[place::CONTROL + 1]) = (4, 0x7F);
        message[place::TARGET..place::TARGET + 10].fill(0xFF);
        put(&mut message, place::TLV, TLV_MANAGEMENT);
        put(&mut message, place::TLV_LENGTH, 2);
        put(&mut message, place::ID, self as u16);
        message
    }
}

fn put(message: &mut [u8], place: usize, value: u16) {
    if let Some(slot) = message.get_mut(place..place + 2) {
        slot.copy_from_slice(&value.to_be_bytes());
    }
}

/// What `ptp4l` answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer {
    /// Clocks on the way, offset from the master and mean path delay in ns.
    Current {
        /// Clocks on the way from the grandmaster.
        steps_removed: u16,
        /// Mean path delay, ns.
        mean_path_delay: i64,
    },
    /// Who is followed.
    Parent {
        /// Identity and port of the clock that sends the Syncs.
        parent: ([u8; 8], u16),
        /// First and second priority of the grandmaster.
        priorities: [u8; 2],
        /// What the grandmaster tells of itself.
        quality: Quality,
        /// Its identity.
        grandmaster: [u8; 8],
    },
    /// The scale of the time.
    TimeProperties {
        /// Seconds ahead of UTC.
        utc_offset: i16,
        /// Flags: 4 the offset is valid, 8 PTP scale, 16 and 32 traceable.
        flags: u8,
        /// Where the time comes from.
        source: u8,
    },
    /// State of a port (IEEE 1588-2008, table 8).
    Port {
        /// 4 listening, 6 master, 8 uncalibrated, 9 slave.
        state: u8,
    },
    /// How good the time is.
    TimeStatus {
        /// Offset from the master, ns.
        offset: i64,
        /// When the last Sync came, ns.
        ingress: i64,
        /// There is a grandmaster other than this clock.
        has_grandmaster: bool,
    },
}

impl Answer {
    /// The answer with its sequence number; `None` for what is none of these.
    #[must_use]
    pub fn parse(message: &[u8]) -> Option<(u16, Self)> {
        let is_answer =
            message.first()? & 0x0F == MANAGEMENT && message.get(place::ACTION)? & 0x0F == RESPONSE;
        if !is_answer || number::<u16>(message, place::TLV)? != u64::from(TLV_MANAGEMENT) {
            return None;
        }
        let length = usize::try_from(number::<u16>(message, place::TLV_LENGTH)?).ok()?;
        let data = message.get(place::DATA..place::ID.checked_add(length)?)?;
        let id = number::<u16>(message, place::ID)?;
        let question = Question::ALL.into_iter().find(|question| u64::from(*question as u16) == id)?;
        let sequence = u16::try_from(number::<u16>(message, place::SEQUENCE)?).ok()?;
        Some((sequence, Self::of(question, data)?))
    }

    fn of(question: Question, data: &[u8]) -> Option<Self> {
        let short = |place| Some(u16::from_be_bytes(*data.get(place..)?.first_chunk()?));
        let long = |place| Some(i64::from_be_bytes(*data.get(place..)?.first_chunk()?));
        let identity = |place: usize| data.get(place..)?.first_chunk::<8>().copied();
        Some(match question {
            Question::Current => {
                Self::Current { steps_removed: short(0)?, mean_path_delay: long(10)? / 0x1_0000 }
            }
            // 0 10 port, 10 statistics, 11 0, 12 2 variance, 14 4 rate, 18 priority 1, 19 4 quality, 23 priority 2, 24 8 identity
            Question::Parent => Self::Parent {
                parent: (identity(0)?, short(8)?),
                priorities: [*data.get(18)?, *data.get(23)?],
                quality: Quality { class: *data.get(19)?, accuracy: *data.get(20)?, variance: short(21)? },
                grandmaster: identity(24)?,
            },
            Question::TimeProperties => Self::TimeProperties {
                utc_offset: short(0)?.cast_signed(),
                flags: *data.get(2)?,
                source: *data.get(3)?,
            },
            Question::Port => Self::Port { state: *data.get(10)? },
            Question::TimeStatus => Self::TimeStatus {
                offset: long(0)?,
                ingress: long(8)?,
                has_grandmaster: data.get(38..42)?.iter().any(|octet| *octet != 0),
            },
        })
    }
}

/// A number of the size of `T`.
fn number<T>(message: &[u8], place: usize) -> Option<u64> {
    let octets = message.get(place..place.checked_add(size_of::<T>())?)?;
    Some(octets.iter().fold(0, |number, octet| number << 8 | u64::from(*octet)))
}

/// What all answers together say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Picture {
    /// Who is followed.
    pub master: Master,
    /// Seconds that system time is ahead of `CLOCK_REALTIME` where `ptp4l` keeps that: it counts UTC, whatever the master counts. It
    /// takes the master's offset if that is valid and traceable, or larger than its own one.
    pub utc_seconds: i16,
    /// State of the port.
    pub port: u8,
    /// Offset from the master, ns.
    pub offset: i64,
    /// When the last Sync came, ns.
    pub ingress: i64,
    /// There is a grandmaster other than this clock.
    pub has_grandmaster: bool,
    /// Mean path delay, ns.
    pub mean_path_delay: i64,
}

impl Picture {
    /// Puts answers together; `None` while one is missing.
    #[must_use]
    pub fn of(answers: &[Option<Answer>; Question::ALL.len()]) -> Option<Self> {
        let [
            Some(Answer::Current { steps_removed, mean_path_delay }),
            Some(Answer::Parent { parent, priorities, quality, grandmaster }),
            Some(Answer::TimeProperties { utc_offset, flags, source }),
            Some(Answer::Port { state }),
            Some(Answer::TimeStatus { offset, ingress, has_grandmaster }),
        ] = *answers
        else {
            return None;
        };
        let is_set = |bit: u8| flags & bit != 0;
        let master = Master {
            grandmaster,
            quality,
            priorities,
            parent,
            steps_removed,
            utc_offset: is_set(4).then_some(utc_offset),
            ptp_time_scale: is_set(8),
            time_source: source,
            time_traceable: is_set(16),
            frequency_traceable: is_set(32),
        };
        let is_believed = is_set(4) && is_set(16) || utc_offset > UTC_OFFSET;
        let utc_seconds = match (is_set(8), is_believed) {
            (false, _) => 0,
            (true, true) => utc_offset,
            (true, false) => UTC_OFFSET,
        };
        Some(Self { master, utc_seconds, port: state, offset, ingress, has_grandmaster, mean_path_delay })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An answer with this id and data.
    fn answer(id: u16, data: &[u8]) -> Vec<u8> {
        let mut message = vec![0; place::DATA];
        (message[0], message[1]) = (0x0D, 2);
        put(&mut message, place::SEQUENCE, 7);
        message[place::ACTION] = 2;
        put(&mut message, place::TLV, 1);
        put(&mut message, place::TLV_LENGTH, u16::try_from(data.len() + 2).unwrap());
        put(&mut message, place::ID, id);
        message.extend(data);
        let length = u16::try_from(message.len()).unwrap();
        put(&mut message, place::LENGTH, length);
        message
    }

    fn samples() -> [(Vec<u8>, Answer); 5] {
        let mut current = vec![0, 2];
        current.extend((-5_i64 << 16).to_be_bytes());
        current.extend((700_i64 << 16).to_be_bytes());
        let parent =
            [&[1; 8][..], &[0, 3, 0, 0, 0xFF, 0xFF, 0, 0, 0, 0, 100, 6, 0x21, 0x4E, 0x5D, 101], &[2; 8]]
                .concat();
        let mut port = vec![0; 26];
        port[10] = 9;
        let mut status = vec![0; 50];
        status[..8].copy_from_slice(&(-12_i64).to_be_bytes());
        status[8..16].copy_from_slice(&99_i64.to_be_bytes());
        status[41] = 1;
        let quality = Quality { class: 6, accuracy: 0x21, variance: 0x4E5D };
        [
            (answer(0x2001, &current), Answer::Current { steps_removed: 2, mean_path_delay: 700 }),
            (
                answer(0x2002, &parent),
                Answer::Parent { parent: ([1; 8], 3), priorities: [100, 101], quality, grandmaster: [2; 8] },
            ),
            (
                answer(0x2003, &[0, 37, 0x3C, 0x20]),
                Answer::TimeProperties { utc_offset: 37, flags: 0x3C, source: 0x20 },
            ),
            (answer(0x2004, &port), Answer::Port { state: 9 }),
            (answer(0xC000, &status), Answer::TimeStatus { offset: -12, ingress: 99, has_grandmaster: true }),
        ]
    }

    #[test]
    fn a_question_has_54_bytes() {
        let question = Question::Parent.emit(5, 0x0102);
        let mut expected = vec![0x0D, 2, 0, 54, 5];
        expected.resize(30, 0);
        expected.extend([1, 2, 4, 0x7F]);
        expected.extend([0xFF; 10]);
        expected.extend([0, 0, 0, 0, 0, 1, 0, 2, 0x20, 0x02]);
        assert_eq!(question[..], expected);
    }

    #[test]
    fn answers_are_read_whole_or_not_at_all() {
        for (message, expected) in samples() {
            assert_eq!(Answer::parse(&message), Some((7, expected)));
            for end in 0..message.len() {
                assert_eq!(Answer::parse(&message[..end]), None, "{expected:?} cut at {end}");
            }
            let mut question = message.clone();
            question[place::ACTION] = 0;
            assert_eq!(Answer::parse(&question), None);
            let mut error = message;
            error[place::TLV + 1] = 2;
            assert_eq!(Answer::parse(&error), None);
        }
        assert_eq!(Answer::parse(&answer(0x2005, &[0; 60])), None);
    }

    #[test]
    fn all_answers_make_a_picture() {
        let mut answers = samples().map(|(_, answer)| Some(answer));
        let picture = Picture::of(&answers).unwrap();
        assert_eq!(
            (picture.master.grandmaster, picture.master.utc_offset, picture.port),
            ([2; 8], Some(37), 9)
        );
        assert!(
            picture.master.ptp_time_scale
                && picture.master.time_traceable
                && picture.master.frequency_traceable
        );
        answers[3] = None;
        assert_eq!(Picture::of(&answers), None);
    }

    /// As linuxptp 3 and 4 correct a clock that counts UTC.
    #[test]
    fn seconds_to_utc_are_those_that_ptp4l_takes() {
        const SCALE: u8 = 8;
        const VALID: u8 = 4;
        const TRACEABLE: u8 = 16;
        for (flags, utc_offset, seconds) in [
            (0, 37, 0),
            (VALID | TRACEABLE, 37, 0),
            (SCALE, 37, 37),
            (SCALE, 0, 37),
            (SCALE, 36, 37),
            (SCALE, 38, 38),
            (SCALE | VALID, 36, 37),
            (SCALE | TRACEABLE, 36, 37),
            (SCALE | VALID | TRACEABLE, 36, 36),
            (SCALE | VALID | TRACEABLE, 38, 38),
        ] {
            let mut answers = samples().map(|(_, answer)| Some(answer));
            answers[2] = Some(Answer::TimeProperties { utc_offset, flags, source: 0x20 });
            assert_eq!(Picture::of(&answers).unwrap().utc_seconds, seconds, "{flags} {utc_offset}");
        }
    }

    proptest::proptest! {
        #[test]
        fn anything_is_survived(message in proptest::collection::vec(proptest::prelude::any::<u8>(), 0..200)) {
            let _ = Answer::parse(&message);
        }
    }
}
