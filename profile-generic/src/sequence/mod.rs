//! Start and stop sequences of a drive axis: which step follows which, and when (CIP Volume 9, 5-2.3.9.1).
//!
//! A [`Sequencer`] holds the step that an axis is in. It is told what the drive shows and what time it is, and answers
//! with what to tell the drive next. It never decides that an axis may move: starts and stops come from outside, and
//! whatever takes the torque away outside of a sequence ends it.
//!
//! ```text
//! start    Energizing --follows--> Releasing --release delay--> Running
//!
//! stop     category 0        Coasting ---------------- zero speed or coasting limit --------------> Off
//!          category 1        SwitchingOff ------------ the drive brakes and switches off ---------> Off
//!          category 1, delay Braking  --zero speed--> Engaging --engage delay--> SwitchingOff ----> Off
//!          category 1, ramp  Ramping  --zero speed--> Engaging --engage delay--> SwitchingOff ----> Off
//!          category 2        Braking  --zero speed and halted--> Holding
//!          category 2, ramp  Ramping  --zero speed--> Braking  --halted--> Holding
//! ```
//!
//! What a drive does by itself is not done twice: with its own delays for the brake both delays are zero here, and
//! commutation, flux and its own release of the brake all lie between enable and [`Sensed::follows`].
//!
//! An axis that does not come to zero speed within the stopping limit loses its torque, and that is an error
//! ([`Order::TimeOut`]). One that coasts has none to lose: it counts as stopped when its own limit is over.

use crate::code::named_enum;
use crate::quantity::{Acceleration, Position, Velocity};
use crate::time::{DurationNs, MonotonicTime};

named_enum! {
    /// How an axis is brought to rest.
    #[derive(Default)]
    pub enum StopMethod {
        /// Without torque.
        Coast = "coast",
        /// By the drive, as fast as its torque allows.
        #[default]
        Decelerate = "decelerate",
        /// On a ramp of commanded velocity.
        Ramp = "ramp",
    }
}

/// A way to stop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StopPlan {
    /// How the axis is brought to rest.
    pub method: StopMethod,
    /// Whether it is held with torque afterwards (IEC 60204-1 category 2). Nothing holds an axis that coasts.
    pub hold: bool,
}

/// The times of the sequences.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SequenceTimes {
    /// From torque to the first command that is followed, for a brake to open; zero where the drive waits by itself.
    pub brake_release_delay: DurationNs,
    /// From rest to the end of the torque, for a brake to close; zero where the drive waits by itself.
    pub brake_engage_delay: DurationNs,
    /// The longest a stop with torque may take to zero speed.
    pub stopping_limit: DurationNs,
    /// The longest that coasting is waited for.
    pub coasting_limit: DurationNs,
    /// At or below this speed an axis counts as standing.
    pub zero_speed: Velocity,
    /// How long it has to be so slow.
    pub zero_speed_time: DurationNs,
}

impl SequenceTimes {
    /// The limit for a stop where nobody has set one.
    pub const FACTORY_LIMIT: DurationNs = DurationNs::from_secs(30);
}

impl Default for SequenceTimes {
    fn default() -> Self {
        Self {
            brake_release_delay: DurationNs::ZERO,
            brake_engage_delay: DurationNs::ZERO,
            stopping_limit: Self::FACTORY_LIMIT,
            coasting_limit: Self::FACTORY_LIMIT,
            zero_speed: Velocity(100_000_000),
            zero_speed_time: DurationNs::ZERO,
        }
    }
}

/// What the drive shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sensed {
    /// It has torque, or may have it.
    pub torque: bool,
    /// It follows set-points.
    pub follows: bool,
    /// It holds the axis at standstill.
    pub halted: bool,
    /// Its velocity, where it is known.
    pub velocity: Option<Velocity>,
}

named_enum! {
    /// Where in a sequence an axis is.
    #[derive(Default)]
    pub enum SequenceStep {
        /// Without torque, and it has come to rest.
        #[default]
        Off = "off",
        /// The drive builds up its torque.
        Energizing = "energizing",
        /// With torque at a static command, while the brake opens.
        Releasing = "releasing",
        /// Follows its command.
        Running = "running",
        /// Without torque, still moving.
        Coasting = "coasting",
        /// The drive brings it to rest and keeps the torque.
        Braking = "braking",
        /// The commanded velocity goes to zero on a ramp.
        Ramping = "ramping",
        /// At rest with torque, while the brake closes.
        Engaging = "engaging",
        /// The drive brings it to rest, where it is not, and ends the torque.
        SwitchingOff = "switching_off",
        /// At rest with torque.
        Holding = "holding",
    }
}

named_enum! {
    /// What to tell the drive, once.
    pub enum Order {
        /// Switch the torque on.
        Enable = "enable",
        /// End the torque at once.
        TorqueOff = "torque_off",
        /// Come to rest, then end the torque.
        Disable = "disable",
        /// Come to rest and keep the torque.
        Halt = "halt",
        /// Lead the axis to rest by its command.
        Ramp = "ramp",
        /// End the torque at once: the axis did not come to rest in time.
        TimeOut = "time_out",
    }
}

/// The step of an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sequencer {
    step: SequenceStep,
    /// Since when it is in this step.
    since: MonotonicTime,
    /// When the stop began.
    stop_begun: MonotonicTime,
    slow_since: Option<MonotonicTime>,
    plan: StopPlan,
}

impl Sequencer {
    /// Where the start or the stop is.
    pub const fn step(&self) -> SequenceStep {
        self.step
    }

    /// Since when it is in its step.
    pub const fn since(&self) -> MonotonicTime {
        self.since
    }

    /// Whether the start has ended and no stop has begun.
    pub const fn is_running(&self) -> bool {
        matches!(self.step, SequenceStep::Running)
    }

    /// Whether a stop has ended: without torque at rest, or held.
    pub const fn is_stopped(&self) -> bool {
        matches!(self.step, SequenceStep::Off | SequenceStep::Holding)
    }

    /// Whether a stop is under way.
    pub const fn is_stopping(&self) -> bool {
        matches!(
            self.step,
            SequenceStep::Coasting
                | SequenceStep::Braking
                | SequenceStep::Ramping
                | SequenceStep::Engaging
                | SequenceStep::SwitchingOff
        )
    }

    fn enter(&mut self, now: MonotonicTime, step: SequenceStep) {
        self.step = step;
        self.since = now;
    }

    /// Begins a start; also out of a stop or a hold.
    pub fn start(&mut self, now: MonotonicTime) -> Order {
        self.enter(now, SequenceStep::Energizing);
        Order::Enable
    }

    /// Begins a stop; `None` when there is nothing to stop. A stop that begins during another takes its place, so that the
    /// time limit is that of the last one.
    pub fn stop(
        &mut self,
        now: MonotonicTime,
        plan: StopPlan,
        sensed: &Sensed,
        times: &SequenceTimes,
    ) -> Option<Order> {
        if matches!(self.step, SequenceStep::Off | SequenceStep::Coasting) {
            return None;
        }
        self.plan = plan;
        self.stop_begun = now;
        self.slow_since = None;
        let with_control = sensed.follows || sensed.halted;
        let (step, order) = match plan.method {
            StopMethod::Coast => (SequenceStep::Coasting, Order::TorqueOff),
            // Before the drive is in control there is nothing to brake with, nor to hold.
            _ if !with_control => (SequenceStep::SwitchingOff, Order::Disable),
            StopMethod::Ramp if sensed.follows => (SequenceStep::Ramping, Order::Ramp),
            StopMethod::Decelerate if !plan.hold && times.brake_engage_delay <= DurationNs::ZERO => {
                (SequenceStep::SwitchingOff, Order::Disable)
            }
            _ => (SequenceStep::Braking, Order::Halt),
        };
        self.enter(now, step);
        Some(order)
    }

    /// The drive was told to stop and end its torque by somebody else.
    pub fn drive_stops(&mut self, now: MonotonicTime) {
        if !matches!(self.step, SequenceStep::Off | SequenceStep::Coasting | SequenceStep::SwitchingOff) {
            self.stop_begun = now;
            self.slow_since = None;
            self.enter(now, SequenceStep::SwitchingOff);
        }
    }

    /// The torque was taken away by somebody else, or the drive itself stops: what is left is to wait for rest.
    pub fn lose_torque(&mut self, now: MonotonicTime) {
        if !matches!(self.step, SequenceStep::Off | SequenceStep::Coasting) {
            self.stop_begun = now;
            self.slow_since = None;
            self.enter(now, SequenceStep::Coasting);
        }
    }

    /// Goes on with the time. At most one order comes of it; further ones in the next cycles.
    // Flat: one arm per step.
    pub fn poll(&mut self, now: MonotonicTime, sensed: &Sensed, times: &SequenceTimes) -> Option<Order> {
        let rest = self.rests(now, sensed, times);
        match self.step {
            SequenceStep::Off | SequenceStep::Running | SequenceStep::Holding => None,
            SequenceStep::Energizing => {
                if sensed.follows {
                    self.enter(now, SequenceStep::Releasing);
                    return self.poll(now, sensed, times);
                }
                None
            }
            SequenceStep::Releasing => {
                if now.since(self.since) >= times.brake_release_delay {
                    self.enter(now, SequenceStep::Running);
                }
                None
            }
            SequenceStep::Coasting => {
                if rest || now.since(self.stop_begun) >= times.coasting_limit {
                    self.enter(now, SequenceStep::Off);
                }
                None
            }
            SequenceStep::SwitchingOff if !sensed.torque => {
                self.enter(now, SequenceStep::Coasting);
                self.poll(now, sensed, times)
            }
            SequenceStep::Engaging => (now.since(self.since) >= times.brake_engage_delay).then(|| {
                self.enter(now, SequenceStep::SwitchingOff);
                Order::Disable
            }),
            _ if !rest && now.since(self.stop_begun) >= times.stopping_limit => {
                self.enter(now, SequenceStep::Coasting);
                Some(Order::TimeOut)
            }
            SequenceStep::Ramping if rest && self.plan.hold => {
                self.enter(now, SequenceStep::Braking);
                Some(Order::Halt)
            }
            SequenceStep::Braking if rest && self.plan.hold => {
                if sensed.halted {
                    self.enter(now, SequenceStep::Holding);
                }
                None
            }
            SequenceStep::Ramping | SequenceStep::Braking if rest => {
                self.enter(now, SequenceStep::Engaging);
                self.poll(now, sensed, times)
            }
            SequenceStep::Ramping | SequenceStep::Braking | SequenceStep::SwitchingOff => None,
        }
    }

    /// Whether the axis has been slow for long enough. What cannot be seen does not rest.
    fn rests(&mut self, now: MonotonicTime, sensed: &Sensed, times: &SequenceTimes) -> bool {
        let slow = sensed
            .velocity
            .is_some_and(|velocity| velocity.get().unsigned_abs() <= times.zero_speed.get().unsigned_abs());
        if !slow {
            self.slow_since = None;
            return false;
        }
        let since = *self.slow_since.get_or_insert(now);
        now.since(since) >= times.zero_speed_time
    }
}

/// A command that goes to rest at a constant deceleration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StopRamp {
    begun: MonotonicTime,
    position: Position,
    velocity: Velocity,
    /// Above zero.
    deceleration: Acceleration,
}

impl StopRamp {
    /// A ramp from this motion to rest; `None` without a deceleration.
    pub fn new(
        begun: MonotonicTime,
        position: Position,
        velocity: Velocity,
        deceleration: Acceleration,
    ) -> Option<Self> {
        let deceleration = Acceleration(deceleration.get().saturating_abs());
        (deceleration.get() > 0).then_some(Self { begun, position, velocity, deceleration })
    }

    /// Where the command is and how fast; from the end of the ramp on it stays. Saturates.
    pub fn at(&self, now: MonotonicTime) -> (Position, Velocity) {
        const SECOND: i128 = 1_000_000_000;
        let speed = i128::from(self.velocity.get());
        let change = i128::from(self.deceleration.get()) * -speed.signum();
        let length = (speed.abs() * SECOND).checked_div(change.abs()).unwrap_or(0);
        let elapsed = i128::from(now.since(self.begun).0.max(0));
        let time = elapsed.min(length);
        let gained = change * time / SECOND;
        let way = (2 * speed + gained) * time / (2 * SECOND);
        let within =
            |value: i128| i64::try_from(value).unwrap_or(if value > 0 { i64::MAX } else { i64::MIN });
        let velocity = if elapsed >= length { 0 } else { within(speed + gained) };
        (Position(within(i128::from(self.position.get()) + way)), Velocity(velocity))
    }
}

#[cfg(test)]
mod tests;
