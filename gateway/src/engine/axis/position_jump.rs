//! Whether the position that a drive reports can be true: from one value to the next no axis gets further than its velocity allows.
//!
//! A value beyond that is not the axis's: an encoder that has lost its count, bits that a telegram has brought wrong, a drive that counts
//! from another place without a word. Whatever follows from it, a following error or a set-point, would be as wrong.
//!
//! What legally changes the position all at once ends the comparison until the new position has settled: the drive is referenced or given
//! another position, it is new, or it was lost.

use std::fmt;

use profile_generic::cast;
use profile_generic::quantity::{Position, Velocity};
use profile_generic::time::{DurationNs, MonotonicTime};

/// Where no velocity limit is configured: 20 000 revolutions or 20 m a second. No machine has it; what is faster is no motion.
pub(super) const FASTEST: Velocity = Velocity(20_000 * 1_000_000_000);

/// A drive may report a position twice and twice the way after it, as its own cycle is not that of the bus; and an axis may be faster than
/// its limit without a jump, which is for the overspeed watch to judge.
const SPARE: i128 = 2;

/// Noise and rounding of an encoder: a hundredth of a revolution or of a millimetre.
const TOLERANCE: i128 = 10_000_000;

/// For so long after the position was given anew it may change at will: values of before and after are on their way.
const SETTLING: DurationNs = DurationNs::from_millis(100);

/// A change of the actual position that no motion within the limits explains.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PositionJump {
    /// From the position before to the one after it, in nanounits.
    pub way: i64,
    /// The longest way that is possible in this time, in nanounits.
    pub limit: i64,
    /// From the one value to the other.
    pub time: DurationNs,
}

impl fmt::Display for PositionJump {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let units = |nanounits: i64| cast::f64_from_i64(nanounits) / 1e9;
        write!(
            f,
            "the actual position changed by {:.3} u in {}, possible are {:.3} u",
            units(self.way),
            self.time,
            units(self.limit)
        )
    }
}

/// The position that the next one is compared with.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Plausibility {
    last: Option<(Position, MonotonicTime)>,
    /// Until then positions are taken as they come.
    settles_until: Option<MonotonicTime>,
}

impl Plausibility {
    /// The position is given anew, or the drive is: the next ones have nothing to do with the last one.
    pub fn restart(&mut self) {
        *self = Self::default();
    }

    /// Takes a position; the jump to it, where it is one. The axis is never faster than `fastest`, as far as anybody knows.
    pub fn judge(
        &mut self,
        position: Position,
        at: MonotonicTime,
        fastest: Option<Velocity>,
    ) -> Option<PositionJump> {
        let (from, begin) = self.last.replace((position, at))?;
        let until = *self.settles_until.get_or_insert(begin + SETTLING);
        let time = at.since(begin);
        if at <= until || time <= DurationNs::ZERO {
            return None;
        }
        let fastest = i128::from(fastest.unwrap_or(FASTEST).get().unsigned_abs());
        let limit = SPARE * fastest * i128::from(time.as_nanos()) / 1_000_000_000 + TOLERANCE;
        let way = i128::from(position.get()) - i128::from(from.get());
        (way.abs() > limit).then(|| PositionJump { way: narrow(way), limit: narrow(limit), time })
    }
}

/// As far as 64 bits go.
fn narrow(value: i128) -> i64 {
    i64::try_from(value).unwrap_or(if value < 0 { i64::MIN } else { i64::MAX })
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: i64 = 1_000_000_000;
    const CYCLE: u64 = 2_000_000;

    fn at(cycle: u64) -> MonotonicTime {
        MonotonicTime(cycle * CYCLE)
    }

    /// A judge that has settled at 0, and the number of its next cycle.
    fn settled(fastest: Option<Velocity>) -> (Plausibility, u64) {
        let mut judge = Plausibility::default();
        for cycle in 0..=51 {
            assert_eq!(judge.judge(Position(0), at(cycle), fastest), None);
        }
        (judge, 52)
    }

    #[test]
    fn a_way_beyond_twice_the_velocity_limit_is_a_jump() {
        // 10 rev/s are 0.02 revolutions in a cycle; twice that, and a hundredth.
        let limit = 50_000_000;
        let fastest = Some(Velocity(10 * UNIT));
        for sign in [1, -1] {
            let (mut judge, next) = settled(fastest);
            assert_eq!(judge.judge(Position(sign * limit), at(next), fastest), None);
            let jump = judge.judge(Position(sign * (2 * limit + 1)), at(next + 1), fastest);
            let time = DurationNs::from_millis(2);
            assert_eq!(jump, Some(PositionJump { way: sign * (limit + 1), limit, time }));
            let after = judge.judge(Position(sign * (2 * limit + 1)), at(next + 2), fastest);
            assert_eq!(after, None, "it is told once");
        }
        assert_eq!(
            PositionJump { way: -2 * UNIT, limit, time: DurationNs::from_millis(2) }.to_string(),
            "the actual position changed by -2.000 u in 2 ms, possible are 0.050 u"
        );
    }

    #[test]
    fn lost_telegrams_allow_the_way_of_their_time() {
        let fastest = Some(Velocity(10 * UNIT));
        let (mut judge, next) = settled(fastest);
        // Four cycles: 0.08 revolutions, twice, and a hundredth.
        assert_eq!(judge.judge(Position(170_000_000), at(next + 3), fastest), None);
        let (mut judge, next) = settled(fastest);
        let jump = judge.judge(Position(170_000_001), at(next + 3), fastest).expect("one more is too much");
        assert_eq!((jump.limit, jump.time), (170_000_000, DurationNs::from_millis(8)));
    }

    #[test]
    fn without_a_limit_only_what_no_machine_does_is_a_jump() {
        let (mut judge, next) = settled(None);
        assert_eq!(judge.judge(Position(80 * UNIT), at(next), None), None);
        let jump =
            judge.judge(Position(161 * UNIT), at(next + 1), None).expect("80 revolutions in 2 ms, and one");
        assert_eq!((jump.way, jump.limit), (81 * UNIT, 80 * UNIT + 10_000_000));
        // The ends of what a position can be.
        assert!(judge.judge(Position(i64::MIN), at(next + 2), None).is_some());
        let jump = judge.judge(Position(i64::MAX), at(next + 3), None).expect("the other end");
        assert_eq!(jump.way, i64::MAX);
    }

    #[test]
    fn a_position_that_is_given_anew_settles_first() {
        let fastest = Some(Velocity(UNIT));
        let (mut judge, next) = settled(fastest);
        judge.restart();
        assert_eq!(judge.judge(Position(500 * UNIT), at(next), fastest), None, "the first one");
        assert_eq!(judge.judge(Position(-500 * UNIT), at(next + 50), fastest), None, "100 ms after it");
        assert!(judge.judge(Position(500 * UNIT), at(next + 51), fastest).is_some());
    }

    #[test]
    fn a_clock_that_stands_or_goes_back_judges_nothing() {
        let fastest = Some(Velocity(UNIT));
        let (mut judge, next) = settled(fastest);
        assert_eq!(judge.judge(Position(UNIT), at(next - 1), fastest), None);
        assert_eq!(judge.judge(Position(2 * UNIT), at(next - 2), fastest), None);
    }
}
