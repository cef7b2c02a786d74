//! Fine interpolation: from the controller's updates to the cycle of the drive.
//!
//! Each update carries set-points and the instant at which they shall be reached, on the local clock: a step of the system
//! time moves nothing here (5-2.6.5.2). Between two targets a polynomial is followed whose coefficients are those of CIP Motion (Volume 9, 5-2.6.5.2): third order for
//! the position, second for the velocity, first for acceleration and torque. The same polynomial goes on
//! beyond its target when an update is late, for a stated number of periods and no longer: then the axis is
//! held, and the interpolator says so until it is started again.
//!
//! All arithmetic is in integers. At each target the set-point is met exactly; between targets the error of
//! the arithmetic is below one nanounit as long as the axis moves less than 2000 units in a period.

use crate::code::named_enum;
use crate::image::{AxisCommand, Signal};
use crate::mode::OperatingMode;
use crate::quantity::{Acceleration, Position, Torque, Velocity};
use crate::time::{DurationNs, MonotonicTime};
use arrayvec::ArrayVec;

mod arrival;
mod polynomial;

pub use arrival::ArrivalClock;

use polynomial::{Channel, Place, Polynomial};

named_enum! {
    /// How far ahead of its time stamp an update is meant: CIP Motion's Command Target Update (Volume 9,
    /// table 6-2.24).
    #[derive(Default)]
    pub enum TargetUpdate {
        /// For the instant of the stamp: taken as it comes, without any curve.
        Immediate = "immediate",
        /// For one update period after the stamp: it is reached by extrapolation.
        Extrapolate = "extrapolate",
        /// For two update periods after the stamp: it is reached by interpolation.
        #[default]
        Interpolate = "interpolate",
    }
}

impl TargetUpdate {
    /// The update periods from the stamp to the target.
    pub const fn periods(self) -> u32 {
        match self {
            Self::Immediate => 0,
            Self::Extrapolate => 1,
            Self::Interpolate => 2,
        }
    }

    /// The periods beyond its target that an update is in use when nothing is late. An update can be on its
    /// way for one period and is then in use for one, so two periods after the stamp the next one is there.
    const fn usual_overrun(self) -> u32 {
        2 - self.periods()
    }

    /// The target of an update with this stamp.
    pub fn target(self, stamp: MonotonicTime, period: DurationNs) -> MonotonicTime {
        stamp + period * i64::from(self.periods())
    }
}

/// The longest update period. CIP Motion uses some milliseconds; a tenth of a second is beyond any of them.
pub const MAX_PERIOD: DurationNs = DurationNs::from_millis(100);

/// The most periods that may be extrapolated after a loss: as far as the Controller Update Delay High Limit can be set.
pub const MAX_EXTRAPOLATION: u32 = 10;

/// The most periods between the targets of two updates that are taken as a gap and not as a wrong time stamp.
pub const MAX_GAP: i64 = 16;

/// Segments that may wait for their time. A controller whose clock is ahead is served up to the update delay high limit, at most
/// [`MAX_EXTRAPOLATION`] periods; its updates are for two periods later, and one segment is in use.
const MAX_SEGMENTS: usize = 16;

/// How good a fine set-point is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// No update came since the start; the position of the start is held.
    Waiting,
    /// From updates that are as fresh as they should be.
    Fresh,
    /// Updates are overdue by this many periods; the polynomial goes on.
    Extrapolated {
        /// Overdue periods, from 1.
        periods: u32,
    },
    /// Updates stopped coming; position is held, velocity, acceleration and torque are zero. Stays until the
    /// next [`FineInterpolator::start`].
    Lost,
}

/// How the command moves at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Motion {
    /// Where it is.
    pub position: Position,
    /// How fast it is.
    pub velocity: Velocity,
    /// How the velocity changes.
    pub acceleration: Acceleration,
    /// The torque that is commanded.
    pub torque: Torque,
}

impl Motion {
    /// The same motion `after` later, or earlier, with its acceleration unchanged. Saturates.
    #[must_use]
    pub fn after(self, after: DurationNs) -> Self {
        const SECOND: i128 = 1_000_000_000;
        let time = i128::from(after.0);
        let gained = i128::from(self.acceleration.get()) * time / SECOND;
        let velocity = i128::from(self.velocity.get());
        let way = (2 * velocity + gained).saturating_mul(time) / (2 * SECOND);
        Self {
            position: Position(saturate(i128::from(self.position.get()) + way)),
            velocity: Velocity(saturate(velocity + gained)),
            ..self
        }
    }
}

fn saturate(value: i128) -> i64 {
    i64::try_from(value).unwrap_or(if value > 0 { i64::MAX } else { i64::MIN })
}

/// An update was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UpdateError {
    /// Its target is not later than that of the update before by at least half a period.
    #[error("expected a target after {last}, got {target}")]
    NotNewer {
        /// The last target taken.
        last: MonotonicTime,
        /// The target of this update.
        target: MonotonicTime,
    },
    /// Its target is too far from that of the update before: more than [`MAX_GAP`] periods.
    #[error("target {target} is too far after {last}")]
    Gap {
        /// The last target taken.
        last: MonotonicTime,
        /// The target of this update.
        target: MonotonicTime,
    },
    /// Its target is further in the future than updates are kept for.
    #[error("target {target} is too far ahead: updates are kept for {MAX_SEGMENTS} periods")]
    Ahead {
        /// The target of this update.
        target: MonotonicTime,
    },
    /// A set-point is further from the one before than any machine moves in a period.
    #[error("a set-point jumps further than any axis can move")]
    Jump,
    /// Updates were lost before; the interpolator has to be started again.
    #[error("updates were lost; expected a start before the next one")]
    Lost,
}

/// How an interpolator works.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InterpolatorConfig {
    /// How far ahead of their stamp updates are meant.
    pub target_update: TargetUpdate,
    /// The controller's update period: above zero, at most [`MAX_PERIOD`].
    pub period: DurationNs,
    /// How many periods to go on when updates are overdue: at most [`MAX_EXTRAPOLATION`].
    pub extrapolate_periods: u32,
}

/// The polynomials between two targets.
#[derive(Clone, Copy, Debug)]
struct Segment {
    start: MonotonicTime,
    /// Above zero.
    length: DurationNs,
    /// How long the curves count from the start on.
    follow: DurationNs,
    position: Option<Polynomial>,
    velocity: Option<Polynomial>,
    acceleration: Option<Polynomial>,
    torque: Option<Polynomial>,
}

/// Follows the updates of one axis.
#[derive(Clone, Debug)]
pub struct FineInterpolator {
    config: InterpolatorConfig,
    /// In the order of their starts; the first is the one in use.
    segments: ArrayVec<Segment, MAX_SEGMENTS>,
    last_target: Option<MonotonicTime>,
    position: Channel<3>,
    velocity: Channel<2>,
    acceleration: Channel<1>,
    torque: Channel<1>,
    /// What is given while there is nothing to follow: before the first update and after a loss.
    held: AxisCommand,
    lost: bool,
    /// The motion that the next update goes on from, and when it was so.
    carried: Option<(MonotonicTime, Motion)>,
    /// How far ahead set-points are made.
    ahead: DurationNs,
}

impl FineInterpolator {
    /// An interpolator that was not started yet, or `None` when the configuration is out of its limits.
    pub fn new(config: InterpolatorConfig) -> Option<Self> {
        let fits = config.period > DurationNs::ZERO
            && config.period <= MAX_PERIOD
            && config.extrapolate_periods <= MAX_EXTRAPOLATION;
        fits.then(|| Self {
            config,
            segments: ArrayVec::new(),
            last_target: None,
            position: Channel::default(),
            velocity: Channel::default(),
            acceleration: Channel::default(),
            torque: Channel::default(),
            held: AxisCommand::default(),
            lost: false,
            carried: None,
            ahead: DurationNs::ZERO,
        })
    }

    /// The configuration.
    pub const fn config(&self) -> &InterpolatorConfig {
        &self.config
    }

    /// Sets how many periods to go on when updates are overdue, from now on; more than [`MAX_EXTRAPOLATION`] are that many.
    pub fn set_extrapolation(&mut self, periods: u32) {
        self.config.extrapolate_periods = periods.min(MAX_EXTRAPOLATION);
    }

    /// Forgets everything and holds `position` until the first update: when the axis is enabled, and after a
    /// loss.
    pub fn start(&mut self, position: Option<Position>) {
        self.segments.clear();
        self.last_target = None;
        self.position = Channel::starting_at(position.map(Position::get));
        self.velocity = Channel::default();
        self.acceleration = Channel::default();
        self.torque = Channel::default();
        self.held = AxisCommand::default();
        if let Some(position) = position {
            self.held.set(Signal::PositionCommand, position.get());
        }
        self.lost = false;
        self.carried = None;
    }

    /// Goes on in another way from the motion that the commands have at `now`: when another kind of set-point leads from
    /// here on, or updates are meant for another instant. Until the next update takes over the motion goes on as it is,
    /// and that update's curve begins in it: neither position nor velocity steps.
    ///
    /// `modes` are the operating mode of before and that from now on. Of the curves of before only those count that led the
    /// axis: a velocity of zero beside a commanded torque was a feed-forward value, not the motion. What they do not report is
    /// taken from `actual`; the torque is always one that was commanded. Before the first update and after a loss there is no motion to go on with: then only the way changes.
    pub fn change(
        &mut self,
        now: MonotonicTime,
        target_update: TargetUpdate,
        modes: (OperatingMode, OperatingMode),
        actual: &Motion,
    ) {
        self.config.target_update = target_update;
        self.pass(now);
        let Some(segment) = self.segments.first() else { return };
        let curves = segment.motion_at(now, actual);
        let motion = match modes {
            (from, to) if from == to => curves,
            (OperatingMode::Position, _) => {
                // The slope of what led it; a velocity beside a position is a feed-forward value.
                let (position, velocity) =
                    segment.position.map_or((actual.position.get(), actual.velocity.get()), |curve| {
                        segment.motion(&curve, &segment.place(now), now)
                    });
                let (position, velocity) = (Position(position), Velocity(velocity));
                Motion { position, velocity, ..curves }
            }
            (OperatingMode::Velocity, _) => Motion { position: actual.position, ..curves },
            (OperatingMode::Torque, _) => Motion { torque: curves.torque, ..*actual },
            _ => *actual,
        };
        self.carry(now, motion);
    }

    /// Begins in a motion that is under way: until the first update it goes on as it is.
    pub fn start_moving(&mut self, now: MonotonicTime, motion: &Motion) {
        self.start(Some(motion.position));
        self.carry(now, *motion);
    }

    fn carry(&mut self, now: MonotonicTime, motion: Motion) {
        const SECOND: i128 = 1_000_000_000;
        let length = self.config.period;
        let per_length = |per_second: i64| saturate(i128::from(per_second) * i128::from(length.0) / SECOND);
        let gained = per_length(motion.acceleration.get());
        self.segments.clear();
        self.segments.push(Segment {
            start: now,
            length,
            follow: length,
            position: Some(Polynomial::moving(
                motion.position.get(),
                per_length(motion.velocity.get()),
                per_length(gained),
            )),
            velocity: Some(Polynomial::moving(motion.velocity.get(), gained, 0)),
            acceleration: Some(Polynomial::moving(motion.acceleration.get(), 0, 0)),
            torque: Some(Polynomial::moving(motion.torque.get(), 0, 0)),
        });
        self.last_target = Some(now);
        self.carried = Some((now, motion));
    }

    /// Takes the set-points of an update for the instant `target`, which may be past already.
    ///
    /// # Errors
    /// See [`UpdateError`]; the update is then left out of account.
    pub fn update(&mut self, target: MonotonicTime, update: &AxisCommand) -> Result<(), UpdateError> {
        if self.lost {
            return Err(UpdateError::Lost);
        }
        let immediate = self.config.target_update == TargetUpdate::Immediate;
        if !immediate && self.segments.is_full() {
            // The one in use has not ended: none of those that wait may take its place.
            return Err(UpdateError::Ahead { target });
        }
        // The channels are worked on as copies, so that a refused update leaves no trace.
        let mut channels = (self.position, self.velocity, self.acceleration, self.torque);
        let (periods, length) =
            if self.carried.is_some() { (1, self.config.period) } else { self.spacing(target)? };
        if let Some((since, motion)) = self.carried {
            // As if the updates before had led along the motion.
            channels = Default::default();
            for before in (1..=3).rev() {
                let past = motion.after((target - length * before).since(since));
                channels.0.fill(Some(past.position.get()));
                channels.1.fill(Some(past.velocity.get()));
                channels.2.fill(Some(past.acceleration.get()));
                channels.3.fill(Some(past.torque.get()));
            }
        } else if let Some(segment) = self.segments.last() {
            // Until this one leads, from a period before its target on, the motion goes on as it is.
            let until = self.config.period * i64::from(self.config.target_update.periods().saturating_sub(1));
            for missing in (1..periods).rev() {
                let at = self.limit_time(segment, target - length * missing - until) + until;
                let place = segment.place(at);
                channels.0.lose(segment.position.map(|curve| segment.motion(&curve, &place, at).0));
                channels.1.lose(segment.velocity.map(|curve| curve.value(&place)));
                channels.2.lose(segment.acceleration.map(|curve| curve.value(&place)));
                channels.3.lose(segment.torque.map(|curve| curve.value(&place)));
            }
        }
        let segment = Segment {
            start: target - length,
            length,
            follow: length + self.config.period * i64::from(self.config.target_update.usual_overrun()),
            position: channels.0.push(update.get(Signal::PositionCommand), immediate)?,
            velocity: channels.1.push(update.get(Signal::VelocityCommand), immediate)?,
            acceleration: channels.2.push(update.get(Signal::AccelerationCommand), immediate)?,
            torque: channels.3.push(update.get(Signal::TorqueCommand), immediate)?,
        };
        (self.position, self.velocity, self.acceleration, self.torque) = channels;
        if immediate {
            self.segments.clear();
        }
        self.segments.push(segment);
        self.last_target = Some(target);
        self.carried = None;
        Ok(())
    }

    /// Lets the time pass up to `now` for updates that nobody follows: those whose time is over make room.
    pub fn pass(&mut self, now: MonotonicTime) {
        while self.segments.get(1).is_some_and(|next| next.start <= now) {
            self.segments.remove(0);
        }
    }

    /// Puts the fine set-points for the instant `now` into a command; those that are not commanded become absent.
    pub fn write(&mut self, now: MonotonicTime, command: &mut AxisCommand) -> Quality {
        self.write_ahead(now, DurationNs::ZERO, command)
    }

    /// The same for an instant that is still to come, by `ahead`: an update is not overdue for not being there before its time.
    pub fn write_ahead(
        &mut self,
        now: MonotonicTime,
        ahead: DurationNs,
        command: &mut AxisCommand,
    ) -> Quality {
        self.ahead = ahead;
        self.pass(now);
        let (Some(segment), Some(last_target)) = (self.segments.first(), self.last_target) else {
            command.take_set_points(&self.held);
            return if self.lost { Quality::Lost } else { Quality::Waiting };
        };
        let overdue = self.overdue(last_target, now - ahead);
        if overdue > self.config.extrapolate_periods {
            segment.write(self.limit_time(segment, now), &mut self.held);
            // The position, and nothing that would move the axis on from there.
            self.held.velocity = Velocity::ZERO;
            self.held.acceleration = Acceleration::ZERO;
            self.held.torque = Torque::ZERO;
            self.segments.clear();
            self.lost = true;
            command.take_set_points(&self.held);
            return Quality::Lost;
        }
        segment.write(now, command);
        match overdue {
            0 => Quality::Fresh,
            periods => Quality::Extrapolated { periods },
        }
    }

    /// The acceleration of the fine set-points at `now`: the commanded one, or how the velocity or the position changes. Zero where no
    /// update goes on.
    pub fn acceleration(&self, now: MonotonicTime) -> Acceleration {
        let segment = self.segments.first().filter(|segment| now.since(segment.start) <= segment.follow);
        segment.map_or(Acceleration::ZERO, |segment| segment.acceleration_at(now))
    }

    /// Whether updates were lost, so that a new start is needed.
    pub const fn is_lost(&self) -> bool {
        self.lost
    }

    /// The periods from the last target to this one, and the length of one of them.
    fn spacing(&self, target: MonotonicTime) -> Result<(i64, DurationNs), UpdateError> {
        let period = self.config.period;
        let Some(last) = self.last_target else { return Ok((1, period)) };
        let spacing = target.since(last);
        if spacing.0 < period.0 / 2 || spacing.0 <= 0 {
            return Err(UpdateError::NotNewer { last, target });
        }
        let periods = (spacing.0.saturating_add(period.0 / 2) / period.0).max(1);
        if periods > MAX_GAP {
            return Err(UpdateError::Gap { last, target });
        }
        Ok((periods, DurationNs(spacing.0 / periods)))
    }

    /// Periods, begun ones included, by which the next update is overdue.
    fn overdue(&self, last_target: MonotonicTime, now: MonotonicTime) -> u32 {
        let beyond = now.since(last_target).0.max(0);
        let periods = beyond / self.config.period.0 + i64::from(beyond % self.config.period.0 != 0);
        u32::try_from(periods).unwrap_or(u32::MAX).saturating_sub(self.config.target_update.usual_overrun())
    }

    /// `at`, or the last instant that a segment may be followed to.
    fn limit_time(&self, segment: &Segment, at: MonotonicTime) -> MonotonicTime {
        let beyond = self.config.target_update.usual_overrun() + self.config.extrapolate_periods;
        at.min(segment.start + segment.length + self.config.period * i64::from(beyond) + self.ahead)
    }
}

impl Segment {
    fn write(&self, now: MonotonicTime, command: &mut AxisCommand) {
        let beyond = now.since(self.start) > self.follow;
        let place = self.place(now);
        let motion = self.position.map(|curve| self.motion(&curve, &place, now));
        let velocity = match (self.velocity, motion) {
            // Beyond its curve a position goes its own way, and its velocity with it.
            (Some(curve), None) => Some(curve.value(&place)),
            (Some(curve), Some(_)) if !beyond => Some(curve.value(&place)),
            (_, Some((_, velocity))) => Some(velocity),
            (None, None) => None,
        };
        command.put_set_points([
            motion.map(|(position, _)| position),
            velocity,
            self.acceleration.map(|curve| curve.value(&place)),
            self.torque.map(|curve| curve.value(&place)),
        ]);
    }

    /// The motion at `now`; what no curve tells is taken from `actual`.
    fn motion_at(&self, now: MonotonicTime, actual: &Motion) -> Motion {
        let Motion { position, velocity, acceleration, torque } = *actual;
        let mut points = AxisCommand { position, velocity, acceleration, torque, ..AxisCommand::default() };
        self.write(now, &mut points);
        let place = self.place(now);
        let acceleration = match (self.acceleration, self.position, self.velocity) {
            (None, Some(curve), _) => Acceleration(curve.bend_per_second(&place)),
            (None, None, Some(curve)) => Acceleration(curve.slope_per_second(&place)),
            _ => points.acceleration,
        };
        Motion { position: points.position, velocity: points.velocity, acceleration, torque: points.torque }
    }

    fn acceleration_at(&self, now: MonotonicTime) -> Acceleration {
        let place = self.place(now);
        Acceleration(match (self.acceleration, self.velocity, self.position) {
            (Some(curve), ..) => curve.value(&place),
            // A velocity has finer steps than the counts of a position.
            (None, Some(curve), _) => curve.slope_per_second(&place),
            (None, None, Some(curve)) => curve.bend_per_second(&place),
            (None, None, None) => 0,
        })
    }

    /// How far along its curve the segment is at `at`. A curve is followed to its end and through the overrun that the
    /// target update brings with it, no further: beyond, a polynomial of third order soon leads anywhere.
    fn on_curve(&self, at: MonotonicTime) -> DurationNs {
        at.since(self.start).min(self.follow)
    }

    /// The place along the curves at `at`: where they end, values stay what they were.
    fn place(&self, at: MonotonicTime) -> Place {
        Place::new(self.on_curve(at), self.length)
    }

    /// Position and velocity. Where the curve ends the position goes on with the velocity it had; if it was slowing down
    /// it goes on slowing down, until it stands. It never gets faster on its own.
    fn motion(&self, curve: &Polynomial, place: &Place, at: MonotonicTime) -> (i64, i64) {
        const SECOND: i128 = 1_000_000_000;
        let on_curve = self.on_curve(at);
        let (position, velocity) = (curve.value(place), curve.slope_per_second(place));
        let beyond = i128::from(at.since(self.start).0.saturating_sub(on_curve.0).max(0));
        if beyond == 0 {
            return (position, velocity);
        }
        let (speed, change) = (i128::from(velocity), i128::from(curve.bend_per_second(place)));
        let slows = speed.signum() * change.signum() < 0;
        let change = if slows { change } else { 0 };
        let time = if slows { beyond.min(speed.abs() * SECOND / change.abs()) } else { beyond };
        let gained = change * time / SECOND;
        let way = (2 * speed + gained) * time / (2 * SECOND);
        let way = i64::try_from(way).unwrap_or(if way > 0 { i64::MAX } else { i64::MIN });
        let velocity =
            if slows && time < beyond { 0 } else { i64::try_from(speed + gained).unwrap_or(velocity) };
        (position.saturating_add(way), velocity)
    }
}

#[cfg(test)]
mod tests;
