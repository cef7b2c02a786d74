//! Set-points of the mode pp: the handshake of bits 4 and 12, and the one that waits for the present one.

use profile_generic::servo::motion::{Motion, Pace};

/// Where to go, and how.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SetPoint {
    /// Nanounits.
    pub target: i64,
    pub pace: Pace,
    /// The one before it is passed at speed, where both go the same way.
    pub blends: bool,
}

/// The set-points.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Profile {
    current: Option<SetPoint>,
    next: Option<SetPoint>,
    /// The demand has come to the target.
    arrived: bool,
    /// Bit 4 of the controlword is still 1.
    asked: bool,
}

impl Profile {
    /// Bit 12 of the statusword: a set-point was taken and bit 4 is still 1, or no further one can be taken.
    pub fn acknowledges(&self) -> bool {
        self.asked || self.next.is_some()
    }

    /// Whether the demand has come to the last target; so it has when there was none.
    pub fn has_arrived(&self) -> bool {
        self.next.is_none() && (self.current.is_none() || self.arrived)
    }

    /// The last target, to which a distance is added.
    pub fn last_target(&self) -> Option<i64> {
        self.next.or(self.current).map(|point| point.target)
    }

    /// Bit 4 rises with a set-point.
    pub fn offer(&mut self, point: SetPoint, immediately: bool) {
        if immediately || self.current.is_none() || self.arrived && self.next.is_none() {
            (self.current, self.next, self.arrived) = (Some(point), None, false);
        } else if self.next.is_none() {
            self.next = Some(point);
        } else {
            // Without room nothing is taken, and the acknowledge, which stands, says nothing new.
            return;
        }
        self.asked = true;
    }

    /// Bit 4 is 0.
    pub fn release(&mut self) {
        self.asked = false;
    }

    /// The positions of the servo are `shift` more than they were.
    pub fn shift(&mut self, shift: i64) {
        for point in [&mut self.current, &mut self.next].into_iter().flatten() {
            point.target = point.target.saturating_add(shift);
        }
    }

    /// Moves the demand on; it stays where it is without a set-point.
    pub fn advance(&mut self, motion: &mut Motion, span: i64) {
        let Some(point) = self.current else {
            motion.velocity = 0;
            return;
        };
        let way = point.target.saturating_sub(motion.position);
        let onward = |next: SetPoint| next.target.saturating_sub(point.target).signum() == way.signum();
        if self.next.is_some_and(|next| next.blends && onward(next)) {
            motion.advance(span, way.signum() * point.pace.velocity, point.pace);
            if point.target.saturating_sub(motion.position).signum() != way.signum() {
                self.current = self.next.take();
            }
            return;
        }
        if motion.advance_to(span, point.target, point.pace) {
            match self.next.take() {
                Some(next) => self.current = Some(next),
                None => self.arrived = true,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PACE: Pace =
        Pace { velocity: 1_000_000_000, acceleration: 10_000_000_000, deceleration: 10_000_000_000 };

    fn to(target: i64, blends: bool) -> SetPoint {
        SetPoint { target, pace: PACE, blends }
    }

    fn run(profile: &mut Profile, motion: &mut Motion) -> i64 {
        let mut slowest = i64::MAX;
        let start = motion.position;
        for _ in 0..10_000 {
            profile.advance(motion, 1_000_000);
            let way = (motion.position - start).abs();
            if (400_000_000..1_600_000_000).contains(&way) {
                slowest = slowest.min(motion.velocity.abs());
            }
        }
        slowest
    }

    #[test]
    fn a_set_point_waits_for_the_one_before_it() {
        let mut profile = Profile::default();
        assert!(profile.has_arrived() && !profile.acknowledges());
        profile.offer(to(1_000_000_000, false), false);
        profile.release();
        assert!(!profile.acknowledges() && !profile.has_arrived());
        profile.offer(to(2_000_000_000, false), false);
        profile.release();
        assert!(profile.acknowledges(), "there is no room for a third one");
        profile.offer(to(3_000_000_000, false), false);
        let mut motion = Motion::default();
        let slowest = run(&mut profile, &mut motion);
        assert_eq!((motion.position, motion.velocity), (2_000_000_000, 0), "the third one was not taken");
        assert!(slowest < 20_000_000, "it stops between: {slowest}");
        assert!(profile.has_arrived() && !profile.acknowledges());
    }

    #[test]
    fn change_on_set_point_passes_the_first_target_at_speed() {
        let mut profile = Profile::default();
        profile.offer(to(1_000_000_000, false), false);
        profile.release();
        profile.offer(to(2_000_000_000, true), false);
        let mut motion = Motion::default();
        assert!(run(&mut profile, &mut motion) >= 990_000_000);
        assert_eq!((motion.position, motion.velocity), (2_000_000_000, 0));
    }

    #[test]
    fn change_on_set_point_stops_where_the_way_turns_round() {
        let mut profile = Profile::default();
        profile.offer(to(1_000_000_000, false), false);
        profile.offer(to(-500_000_000, true), false);
        let (mut motion, mut highest) = (Motion::default(), 0);
        for _ in 0..10_000 {
            profile.advance(&mut motion, 1_000_000);
            highest = highest.max(motion.position);
        }
        assert!((999_000_000..1_001_000_000).contains(&highest), "{highest}");
        assert_eq!(motion.position, -500_000_000);
    }

    #[test]
    fn change_immediately_forgets_what_was_under_way() {
        let mut profile = Profile::default();
        profile.offer(to(1_000_000_000, false), false);
        profile.offer(to(2_000_000_000, false), false);
        profile.offer(to(-1_000_000_000, false), true);
        let mut motion = Motion { position: 0, velocity: 900_000_000 };
        run(&mut profile, &mut motion);
        assert_eq!(motion.position, -1_000_000_000);
    }
}
