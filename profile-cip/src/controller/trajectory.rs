//! Jerk-limited motion profiles of the controller's motion planner.
//!
//! A profile is a chain of at most seven segments of constant jerk. Between them position, velocity and
//! acceleration are continuous; jerk is what jumps, and only between plus and minus its limit.
//!
//! | profile | segments |
//! |---|---|
//! | [`Profile::to_position`] | jerk up, acceleration, jerk down, cruise, and the mirror image of it |
//! | [`Profile::to_velocity`] | jerk up, constant acceleration, jerk down |
//! | [`Profile::jog`] | to the velocity, cruise, to standstill |
//!
//! A move that is too short to reach the velocity or the acceleration limit leaves those segments out and
//! lowers the peak, so that the limits hold for any length and the end is met exactly. Units are those of the
//! caller: units, units/s, units/s², units/s³, and seconds.

use core::fmt;

use arrayvec::ArrayVec;

/// Segments of the longest profile.
const SEGMENTS: usize = 7;

/// Position, velocity and acceleration of a point in motion.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct State {
    /// Units.
    pub position: f64,
    /// Units per second.
    pub velocity: f64,
    /// Units per second squared.
    pub acceleration: f64,
}

impl State {
    /// Standing still at `position`.
    pub const fn at_rest(position: f64) -> Self {
        Self { position, velocity: 0.0, acceleration: 0.0 }
    }

    /// The state after `seconds` of constant `jerk`.
    fn after(self, jerk: f64, seconds: f64) -> Self {
        let t = seconds;
        Self {
            position: self.position + t * (self.velocity + t * (self.acceleration / 2.0 + t * jerk / 6.0)),
            velocity: self.velocity + t * (self.acceleration + t * jerk / 2.0),
            acceleration: self.acceleration + t * jerk,
        }
    }
}

/// What a profile may not exceed; all finite and above zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Units per second.
    pub velocity: f64,
    /// Units per second squared, for speeding up and slowing down alike.
    pub acceleration: f64,
    /// Units per second cubed.
    pub jerk: f64,
}

impl Limits {
    /// The same limits in counts, for an axis with `counts_per_unit`.
    #[must_use]
    pub fn scaled(self, counts_per_unit: f64) -> Self {
        Self {
            velocity: self.velocity * counts_per_unit,
            acceleration: self.acceleration * counts_per_unit,
            jerk: self.jerk * counts_per_unit,
        }
    }

    fn check(self) -> Result<(), ProfileError> {
        let named = [
            ("velocity limit", self.velocity),
            ("acceleration limit", self.acceleration),
            ("jerk limit", self.jerk),
        ];
        named.into_iter().try_for_each(|(what, value)| {
            if value.is_finite() && value > 0.0 { Ok(()) } else { Err(ProfileError { what, value }) }
        })
    }
}

/// A number from which no profile can be made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfileError {
    /// The number's name.
    pub what: &'static str,
    /// The number.
    pub value: f64,
}

impl fmt::Display for ProfileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let wanted = if self.what.ends_with("limit") { "finite and above zero" } else { "finite" };
        write!(f, "{}: expected a number that is {wanted}, found {}", self.what, self.value)
    }
}

impl std::error::Error for ProfileError {}

#[derive(Debug, Clone, Copy)]
struct Segment {
    start: State,
    jerk: f64,
    seconds: f64,
}

/// A planned motion; time zero is its start.
#[derive(Debug, Clone)]
pub struct Profile {
    segments: ArrayVec<Segment, SEGMENTS>,
    end: State,
}

impl Profile {
    /// Standing still at `position` for ever.
    #[must_use]
    pub fn rest(position: f64) -> Self {
        Self { segments: ArrayVec::new(), end: State::at_rest(position) }
    }

    /// From rest at `from` to rest at `to`, in the shortest time the limits allow.
    ///
    /// # Errors
    /// A limit that is not finite and above zero, or a position that is not finite.
    pub fn to_position(from: f64, to: f64, limits: Limits) -> Result<Self, ProfileError> {
        limits.check()?;
        finite("start position", from)?;
        finite("end position", to)?;
        let distance = (to - from).abs();
        finite("distance", distance)?;
        let sign = if to < from { -1.0 } else { 1.0 };
        let times = MoveTimes::plan(distance, limits);
        let jerk = sign * limits.jerk;
        let mut profile = Self::rest(from);
        for (jerk, seconds) in [
            (jerk, times.jerk),
            (0.0, times.acceleration),
            (-jerk, times.jerk),
            (0.0, times.cruise),
            (-jerk, times.jerk),
            (0.0, times.acceleration),
            (jerk, times.jerk),
        ] {
            profile.push(jerk, seconds);
        }
        profile.end = State::at_rest(to);
        Ok(profile)
    }

    /// From any state to the constant velocity `to`; [`Limits::velocity`] does not count, `to` is the
    /// velocity.
    ///
    /// # Errors
    /// A limit that is not finite and above zero, or a value of the state or the velocity that is not finite.
    pub fn to_velocity(from: State, to: f64, limits: Limits) -> Result<Self, ProfileError> {
        let mut profile = Self { segments: ArrayVec::new(), end: from };
        profile.change_velocity(to, limits)?;
        Ok(profile)
    }

    /// From any state to `velocity`, on at that velocity until `seconds` have passed since the start, and to
    /// standstill. When the velocity is not reached by then, slowing down starts from what was reached.
    ///
    /// # Errors
    /// As [`Profile::to_velocity`]; also for a time that is not finite. A negative time counts as zero.
    pub fn jog(from: State, velocity: f64, seconds: f64, limits: Limits) -> Result<Self, ProfileError> {
        finite("jog time", seconds)?;
        let mut profile = Self::to_velocity(from, velocity, limits)?;
        let seconds = seconds.max(0.0);
        if seconds > profile.seconds() {
            profile.push(0.0, seconds - profile.seconds());
        } else {
            profile.cut(seconds);
        }
        profile.change_velocity(0.0, limits)?;
        Ok(profile)
    }

    /// Length in seconds; behind it the profile keeps its end velocity.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.segments.iter().map(|s| s.seconds).sum()
    }

    /// The state in which the profile ends.
    #[must_use]
    pub const fn end(&self) -> State {
        self.end
    }

    /// The state `seconds` after the start; before the start it is the start.
    #[must_use]
    pub fn sample(&self, seconds: f64) -> State {
        // The sum decides where the profile ends, so that its last instant is the end without rounding.
        let behind = seconds - self.seconds();
        if behind >= 0.0 {
            return self.end.after(0.0, behind);
        }
        let mut rest = seconds.max(0.0);
        for segment in &self.segments {
            if rest < segment.seconds {
                return segment.start.after(segment.jerk, rest);
            }
            rest -= segment.seconds;
        }
        self.end
    }

    /// Adds a segment at the end.
    fn push(&mut self, jerk: f64, seconds: f64) {
        if seconds > 0.0 {
            self.segments.push(Segment { start: self.end, jerk, seconds });
            self.end = self.end.after(jerk, seconds);
        }
    }

    /// Leaves away what comes after `seconds`.
    fn cut(&mut self, seconds: f64) {
        self.end = self.sample(seconds);
        let mut rest = seconds;
        self.segments.retain(|segment| {
            segment.seconds = segment.seconds.min(rest);
            rest -= segment.seconds;
            segment.seconds > 0.0
        });
    }

    /// Adds three segments that lead from the end to the constant velocity `to`.
    ///
    /// With all signs turned so that the acceleration peak A is positive: coming from acceleration a and
    /// gaining velocity dv, (A² - a²)/2j is gained on the way to A and A²/2j on the way from A to zero.
    /// Without a phase at A this gives A² = j·dv + a²/2.
    fn change_velocity(&mut self, to: f64, limits: Limits) -> Result<(), ProfileError> {
        limits.check()?;
        finite("velocity", to)?;
        for (what, value) in [
            ("start position", self.end.position),
            ("start velocity", self.end.velocity),
            ("start acceleration", self.end.acceleration),
        ] {
            finite(what, value)?;
        }
        let start = self.end;
        let j = limits.jerk;
        let straight = start.velocity + start.acceleration * start.acceleration.abs() / (2.0 * j);
        let sign = if to < straight { -1.0 } else { 1.0 };
        let a = sign * start.acceleration;
        let dv = sign * (to - start.velocity);
        let peak = (j * dv + a * a / 2.0).max(0.0).sqrt();
        // Above the limit already: the way to the limit goes down, which the sign of the first jerk shows.
        let peak = peak.min(limits.acceleration);
        let first_jerk = if peak < a { -j } else { j };
        let first = (peak - a).abs() / j;
        let gained = (peak * peak - a * a) / (2.0 * first_jerk) + peak * peak / (2.0 * j);
        let constant = if peak > 0.0 { ((dv - gained) / peak).max(0.0) } else { 0.0 };
        self.push(sign * first_jerk, first);
        self.push(0.0, constant);
        self.push(-sign * j, peak / j);
        self.end.velocity = to;
        self.end.acceleration = 0.0;
        Ok(())
    }
}

/// Lengths of the segments of a move from rest to rest, in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
struct MoveTimes {
    jerk: f64,
    acceleration: f64,
    cruise: f64,
}

impl MoveTimes {
    /// Speeding up with jerk time T and constant-acceleration time C reaches v = j·T·(T + C) over v·(2T +
    /// C)/2.
    fn plan(distance: f64, limits: Limits) -> Self {
        let Limits { velocity: v, acceleration: a, jerk: j } = limits;
        let (jerk, acceleration) =
            if v * j < a * a { ((v / j).sqrt(), 0.0) } else { (a / j, (v / a - a / j).max(0.0)) };
        let cruise = distance / v - (2.0 * jerk + acceleration);
        if cruise >= 0.0 {
            return Self { jerk, acceleration, cruise };
        }
        // The velocity is not reached. With the acceleration reached: distance = a·(T + C)·(2T + C), T = a/j.
        let t = a / j;
        let c = ((t * t + 4.0 * distance / a).sqrt() - 3.0 * t) / 2.0;
        if c >= 0.0 {
            return Self { jerk: t, acceleration: c, cruise: 0.0 };
        }
        // Neither is reached: distance = 2·j·T³.
        Self { jerk: (distance / (2.0 * j)).cbrt(), acceleration: 0.0, cruise: 0.0 }
    }
}

fn finite(what: &'static str, value: f64) -> Result<(), ProfileError> {
    if value.is_finite() { Ok(()) } else { Err(ProfileError { what, value }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LIMITS: Limits = Limits { velocity: 10.0, acceleration: 50.0, jerk: 1000.0 };

    /// Largest |velocity| and |acceleration|, and the largest step of each quantity against what the next
    /// higher derivative allows, over `steps` equal steps.
    fn walk(profile: &Profile, steps: u32, limits: Limits) {
        let total = profile.seconds();
        let dt = total / f64::from(steps);
        let mut last = profile.sample(0.0);
        for i in 1..=steps {
            let s = profile.sample(dt * f64::from(i));
            let slack = 1.0 + 1e-6;
            assert!(s.velocity.abs() <= limits.velocity * slack, "velocity {} at step {i}", s.velocity);
            assert!(s.acceleration.abs() <= limits.acceleration * slack, "acceleration {s:?} at step {i}");
            let jump = (s.acceleration - last.acceleration).abs();
            assert!(jump <= limits.jerk * dt * slack + 1e-9, "acceleration jumps by {jump} at step {i}");
            let jump = (s.velocity - last.velocity).abs();
            assert!(jump <= limits.acceleration * dt * slack + 1e-9, "velocity jumps by {jump} at step {i}");
            let jump = (s.position - last.position).abs();
            let allowed = limits.velocity * dt * slack + 1e-9 * (1.0 + s.position.abs());
            assert!(jump <= allowed, "position jumps by {jump} at step {i}");
            last = s;
        }
    }

    #[test]
    fn a_long_move_has_seven_segments_of_the_textbook_lengths() {
        // Jerk time a/j = 0.05 s, constant acceleration v/a - a/j = 0.15 s, cruise 100/10 - 0.25 = 9.75 s.
        let p = Profile::to_position(-20.0, 80.0, LIMITS).unwrap();
        let lengths: Vec<f64> = p.segments.iter().map(|s| s.seconds).collect();
        for (found, expected) in lengths.iter().zip([0.05, 0.15, 0.05, 9.75, 0.05, 0.15, 0.05]) {
            assert!((found - expected).abs() < 1e-12, "{lengths:?}");
        }
        assert_eq!(lengths.len(), 7);
        assert!((p.seconds() - 10.25).abs() < 1e-12);
        let middle = p.sample(p.seconds() / 2.0);
        assert!((middle.position - 30.0).abs() < 1e-9);
        assert!((middle.velocity - 10.0).abs() < 1e-9);
        assert_eq!(p.sample(p.seconds()), State::at_rest(80.0));
        assert_eq!(p.sample(1e9), State::at_rest(80.0));
        assert_eq!(p.sample(-1.0), State::at_rest(-20.0));
    }

    #[test]
    fn a_shorter_move_stays_below_the_velocity_and_a_tiny_one_below_the_acceleration() {
        // 1 unit: T = 0.05, C = (sqrt(0.0025 + 0.08) - 0.15) / 2; peak a·(T + C) below 10.
        let p = Profile::to_position(0.0, 1.0, LIMITS).unwrap();
        let c = (0.0825_f64.sqrt() - 0.15) / 2.0;
        assert!((p.seconds() - (4.0 * 0.05 + 2.0 * c)).abs() < 1e-12);
        let peak = p.sample(p.seconds() / 2.0).velocity;
        assert!((peak - 50.0 * (0.05 + c)).abs() < 1e-9 && peak < 10.0, "peak {peak}");
        // 0.002 units: T = cbrt(1e-6) = 0.01 s, peak acceleration 10, a fifth of the limit.
        let p = Profile::to_position(0.0, -0.002, LIMITS).unwrap();
        assert!((p.seconds() - 0.04).abs() < 1e-12);
        assert!((p.sample(0.01).acceleration + 10.0).abs() < 1e-9);
        assert_eq!(p.end(), State::at_rest(-0.002));
        assert_eq!(Profile::to_position(3.0, 3.0, LIMITS).unwrap().seconds(), 0.0);
    }

    #[test]
    fn a_low_velocity_limit_leaves_out_the_constant_acceleration() {
        // v·j = 1000 < a² = 2500: T = sqrt(v/j), peak acceleration sqrt(v·j) = 31.6.
        let limits = Limits { velocity: 1.0, ..LIMITS };
        let p = Profile::to_position(0.0, 1.0, limits).unwrap();
        let t = 0.001_f64.sqrt();
        assert!((p.sample(t).acceleration - 1000.0_f64.sqrt()).abs() < 1e-9);
        assert!((p.seconds() - (1.0 + 2.0 * t)).abs() < 1e-9);
        walk(&p, 1000, limits);
    }

    #[test]
    fn a_jog_travels_velocity_times_time_and_ends_at_rest() {
        let p = Profile::jog(State::at_rest(5.0), -10.0, 2.0, LIMITS).unwrap();
        walk(&p, 2000, LIMITS);
        let s = p.sample(1.0);
        assert_eq!((s.velocity, s.acceleration), (-10.0, 0.0));
        // Ramps of 0.25 s are symmetric: what ramping up loses, ramping down adds.
        assert!((p.end().position - (5.0 - 20.0)).abs() < 1e-9, "{:?}", p.end());
        assert_eq!((p.end().velocity, p.end().acceleration), (0.0, 0.0));
    }

    #[test]
    fn a_jog_shorter_than_its_ramp_turns_back_before_the_velocity() {
        let p = Profile::jog(State::at_rest(0.0), 10.0, 0.1, LIMITS).unwrap();
        walk(&p, 1000, LIMITS);
        let fastest = p.sample(0.15).velocity;
        assert!(fastest > 3.0 && fastest < 6.0, "{fastest}");
        assert_eq!(p.end().velocity, 0.0);
        assert_eq!(Profile::jog(State::at_rest(1.0), 10.0, 0.0, LIMITS).unwrap().seconds(), 0.0);
    }

    #[test]
    fn stopping_amid_acceleration_overshoots_no_limit() {
        let moving = Profile::to_position(0.0, 100.0, LIMITS).unwrap();
        for at in [0.01, 0.1, 0.24, 3.0, 10.1] {
            let from = moving.sample(at);
            let stop = Profile::to_velocity(from, 0.0, LIMITS).unwrap();
            walk(&stop, 1000, LIMITS);
            assert_eq!((stop.end().velocity, stop.end().acceleration), (0.0, 0.0));
            assert!(stop.end().position >= from.position);
        }
    }

    #[test]
    fn an_acceleration_above_a_lowered_limit_comes_down_with_the_jerk() {
        let from = State { position: 0.0, velocity: 1.0, acceleration: 100.0 };
        let p = Profile::to_velocity(from, 20.0, LIMITS).unwrap();
        assert!((p.sample(0.02).acceleration - 80.0).abs() < 1e-9);
        assert!((p.sample(0.05).acceleration - 50.0).abs() < 1e-9);
        assert_eq!((p.end().velocity, p.end().acceleration), (20.0, 0.0));
        let before = p.sample(p.seconds() - 1e-7);
        assert!((before.velocity - 20.0).abs() < 1e-6, "{before:?}");
    }

    #[test]
    fn numbers_that_make_no_profile_are_named() {
        let bad = Limits { jerk: 0.0, ..LIMITS };
        let e = Profile::to_position(0.0, 1.0, bad).unwrap_err();
        assert_eq!(e.to_string(), "jerk limit: expected a number that is finite and above zero, found 0");
        let e = Profile::to_position(0.0, f64::NAN, LIMITS).unwrap_err();
        assert_eq!(e.to_string(), "end position: expected a number that is finite, found NaN");
        assert!(Profile::to_position(f64::MIN, f64::MAX, LIMITS).is_err());
        assert!(Profile::jog(State::at_rest(0.0), 1.0, f64::INFINITY, LIMITS).is_err());
        assert!(Profile::to_velocity(State::at_rest(f64::NAN), 0.0, LIMITS).is_err());
    }

    prop_compose! {
        fn limits()(v in -3.0..5.0_f64, a in -1.0..5.0_f64, j in 0.0..7.0_f64) -> Limits {
            Limits { velocity: 10f64.powf(v), acceleration: 10f64.powf(a), jerk: 10f64.powf(j) }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(96))]

        #[test]
        fn any_move_keeps_its_limits_and_ends_exactly(
            limits in limits(), from in -1e6..1e6_f64, exponent in -4.0..6.0_f64, forward: bool,
        ) {
            let distance = 10f64.powf(exponent) * if forward { 1.0 } else { -1.0 };
            let to = from + distance;
            let p = Profile::to_position(from, to, limits).unwrap();
            walk(&p, 400, limits);
            prop_assert_eq!(p.sample(p.seconds()), State::at_rest(to));
            // The last segment leads to the end without a step: what is left is rounding.
            let last = p.sample(p.seconds() * (1.0 - 1e-12));
            let slack = 1e-9 * (1.0 + from.abs() + to.abs()) + limits.velocity * p.seconds() * 1e-9;
            prop_assert!((last.position - to).abs() <= slack, "{} against {}", last.position, to);
        }

        #[test]
        fn any_change_of_velocity_from_within_a_move_is_smooth(
            limits in limits(), distance in 0.01..1e4_f64, part in 0.0..1.0_f64, to in -1.0..1.0_f64,
        ) {
            let moving = Profile::to_position(0.0, distance, limits).unwrap();
            let from = moving.sample(moving.seconds() * part);
            let p = Profile::to_velocity(from, to * limits.velocity, limits).unwrap();
            let end = p.end();
            prop_assert_eq!((end.velocity, end.acceleration), (to * limits.velocity, 0.0));
            // Leaving a high acceleration may pass the velocity by what bringing it to zero takes.
            let beyond = limits.acceleration * limits.acceleration / (2.0 * limits.jerk);
            walk(&p, 400, Limits { velocity: limits.velocity + beyond, ..limits });
            let reached = p.segments.last().map_or(from, |s| s.start.after(s.jerk, s.seconds));
            prop_assert!((reached.velocity - end.velocity).abs() <= 1e-9 * (1.0 + limits.velocity));
        }
    }
}
