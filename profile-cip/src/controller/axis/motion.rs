//! Motion of one axis: profiles in all control modes, and what keeps them within bounds.
//!
//! Whenever the axis is not Running the command stands at the actual position and there is no torque; a motion
//! begins there, and the control mode changes only at standstill. So no command jumps.
//!
//! Motion is planned in counts. On the connection positions are in counts, the position control unit, while
//! velocity and acceleration are in units, the velocity and acceleration control unit (Table 5-2.8).

use super::Axis;
use crate::controller::failure::Failure;
use crate::controller::number::{float, seconds, span};
use crate::controller::trajectory::{Limits, Profile, ProfileError, State};
use crate::wire::motion::codes::ControlMode;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

/// Updates without movement that end a jog.
const SETTLED_UPDATES: u8 = 8;
/// Parts of a unit by which a standing axis may still move between two updates.
const STANDSTILL_PARTS: f64 = 1e4;
/// Longest wait for standstill after a jog, beyond which position control takes over anyway.
pub(super) const SETTLING_MAX: DurationNs = DurationNs::from_secs(1);
/// Seconds in which an axis that turns in torque control is braked when it leaves that.
const BRAKING_SECONDS: f64 = 0.25;

/// The motion under way.
#[expect(clippy::large_enum_variant, reason = "one per axis, and a box would be allocated in the cycle")]
#[derive(Debug, Clone)]
pub(super) enum Motion {
    /// The command stands.
    None,
    /// The command follows a profile that began at `start`; profile and limits are in counts.
    Moving { profile: Profile, start: MonotonicTime, limits: Limits, stopping: bool },
    /// Velocity or acceleration control at a constant velocity, counts/s.
    Cruising { velocity: f64, limits: Limits },
    /// Velocity control at zero until the axis stands.
    Settling { since: MonotonicTime, last: i64, still: u8 },
    /// The torque goes from one value to another, %, at so many %/s.
    Torque { from: f64, to: f64, rate: f64, start: MonotonicTime },
}

impl Axis {
    /// Whether a motion is under way.
    pub fn is_moving(&self) -> bool {
        !matches!(self.motion, Motion::None) || self.torque != 0.0
    }

    /// Whether a motion is on its way to somewhere; an axis that keeps a velocity or a torque is not.
    pub const fn is_busy(&self) -> bool {
        !matches!(self.motion, Motion::None | Motion::Cruising { .. })
    }

    /// Plans the command for `target`; `applies_at` is the same instant in system time.
    ///
    /// # Errors
    /// The command would pass a limit of the axis; the motion is being stopped.
    pub fn plan(&mut self, target: MonotonicTime, applies_at: SystemTime) -> Result<(), Failure> {
        self.planned_for = target;
        let Some(actual) = self.place() else { return Ok(()) };
        if !self.is_running() {
            self.motion = Motion::None;
            self.torque = 0.0;
            self.mode = self.setup.control_mode;
            self.command = State::at_rest(float(self.rebased(actual)));
            self.following.clear();
            return Ok(());
        }
        self.advance(target, actual);
        if self.mode == ControlMode::POSITION {
            self.report.commanded = Some(self.commanded());
            self.following.push(applies_at, self.command);
        } else {
            self.following.clear();
        }
        self.guard()
    }

    /// The last look at a command before it goes out.
    fn guard(&mut self) -> Result<(), Failure> {
        let axis = self.instance();
        let scale = self.scale();
        let in_units = State {
            position: self.command.position / scale,
            velocity: self.command.velocity / scale,
            acceleration: self.command.acceleration / scale,
        };
        let checked = match (&self.motion, self.torque_guard) {
            // Slowing down goes on wherever it is.
            (Motion::Moving { stopping: false, .. } | Motion::Cruising { .. }, _) => {
                self.setup.limits.check_command(axis, in_units)
            }
            (_, Some(limit)) if self.mode == ControlMode::TORQUE => {
                let velocity = self.seen.velocity(scale);
                let position = float(self.seen.actual.unwrap_or(0)) / scale;
                if velocity.abs() > limit {
                    let what = "velocity in torque control";
                    Err(Failure::BeyondLimit { axis, what, value: velocity, limit })
                } else {
                    self.setup.limits.check_position(axis, position)
                }
            }
            _ => Ok(()),
        };
        if checked.is_err() {
            // A motion that cannot be stopped smoothly is stopped by the Disable that follows the failure.
            let _ = self.stop(None);
        }
        checked
    }

    fn advance(&mut self, target: MonotonicTime, actual: i64) {
        let standing = State::at_rest(float(actual));
        match &mut self.motion {
            Motion::None if self.mode == ControlMode::POSITION => {}
            Motion::None => self.command = standing,
            Motion::Moving { profile, start, limits, .. } => {
                let elapsed = seconds(target - *start);
                self.command = profile.sample(elapsed);
                if elapsed >= profile.seconds() {
                    self.command = profile.end();
                    let (velocity, limits) = (self.command.velocity, *limits);
                    let away = self.mode != self.setup.control_mode;
                    self.motion = if velocity != 0.0 {
                        Motion::Cruising { velocity, limits }
                    } else if away {
                        Motion::Settling { since: target, last: actual, still: 0 }
                    } else {
                        Motion::None
                    };
                }
            }
            Motion::Cruising { velocity, .. } => self.command = State { velocity: *velocity, ..standing },
            Motion::Settling { since, last, still } => {
                let moved = float((actual - *last).abs());
                let stands = moved <= (self.scale.unwrap_or(1.0) / STANDSTILL_PARTS).max(1.0);
                *still = if stands { *still + 1 } else { 0 };
                *last = actual;
                let settled = *still >= SETTLED_UPDATES || target - *since > SETTLING_MAX;
                if settled {
                    self.motion = Motion::None;
                    self.mode = self.setup.control_mode;
                }
                self.command = State::at_rest(float(if settled { self.rebased(actual) } else { actual }));
            }
            Motion::Torque { from, to, rate, start } => {
                let change = (*to - *from).abs();
                let part = seconds(target - *start) * *rate;
                self.torque = if part >= change { *to } else { *from + (*to - *from).signum() * part };
                if part >= change {
                    self.motion = Motion::None;
                }
                self.command = standing;
            }
        }
    }

    /// Begins a motion from rest to `units`; returns its planned length.
    pub fn move_to(&mut self, units: f64, limits: Limits) -> Result<DurationNs, Failure> {
        let axis = self.instance();
        let scale = self.ready_for_motion()?;
        self.in_mode(&[ControlMode::POSITION])?;
        self.setup.limits.check_motion(axis, limits)?;
        self.setup.limits.check_position(axis, units)?;
        let target = units * scale;
        if !self.setup.has_room_for(target) {
            return Err(Failure::OutOfRange { axis, counts: target });
        }
        let limits = limits.scaled(scale);
        let profile = Profile::to_position(self.command.position, target, limits);
        self.begin(profile, limits)
    }

    /// Begins a jog at `velocity` in units/s for `run` seconds; returns its planned length.
    pub fn jog(&mut self, velocity: f64, run: f64, limits: Limits) -> Result<DurationNs, Failure> {
        let scale = self.ready_for_motion()?;
        self.in_mode(&[ControlMode::POSITION, ControlMode::VELOCITY, ControlMode::ACCELERATION])?;
        self.setup.limits.check_motion(self.instance(), limits)?;
        let limits = limits.scaled(scale);
        let profile = Profile::jog(State::at_rest(self.command.position), velocity * scale, run, limits);
        let length = self.begin(profile, limits)?;
        if self.mode == ControlMode::POSITION {
            self.mode = ControlMode::VELOCITY;
            return Ok(length + SETTLING_MAX);
        }
        Ok(length)
    }

    /// Begins to go over to `velocity` in units/s; returns how long that takes.
    pub fn run_at(&mut self, velocity: f64, limits: Limits) -> Result<DurationNs, Failure> {
        let axis = self.instance();
        let scale = self.running_scale()?;
        self.in_mode(&[ControlMode::VELOCITY, ControlMode::ACCELERATION])?;
        if self.is_busy() {
            return Err(Failure::AxisBusy { axis });
        }
        self.setup.limits.check_motion(axis, limits)?;
        let limits = limits.scaled(scale);
        let profile = Profile::to_velocity(self.command, velocity * scale, limits);
        self.begin(profile, limits)
    }

    /// Begins to go over to `torque` in % at `rate` in %/s; returns how long that takes.
    pub fn torque_to(&mut self, torque: f64, rate: f64, velocity_limit: f64) -> Result<DurationNs, Failure> {
        let axis = self.instance();
        self.running_scale()?;
        self.in_mode(&[ControlMode::TORQUE])?;
        if self.is_busy() {
            return Err(Failure::AxisBusy { axis });
        }
        check_torque_step(axis, torque, rate, velocity_limit)?;
        self.setup.limits.check_torque(axis, torque)?;
        self.torque_guard = Some(velocity_limit);
        self.motion = Motion::Torque { from: self.torque, to: torque, rate, start: self.planned_for };
        Ok(span((torque - self.torque).abs() / rate))
    }

    /// Begins to change over to another Control Mode; it is in force when the axis is no longer busy.
    pub fn change_mode(&mut self, mode: ControlMode) -> Result<DurationNs, Failure> {
        if mode == ControlMode::POSITION && !self.has_position() {
            return Err(Failure::NoPosition { axis: self.instance() });
        }
        if !self.is_running() || mode == self.mode {
            self.setup.control_mode = mode;
            return Ok(DurationNs::ZERO);
        }
        if !matches!(self.motion, Motion::None) {
            return Err(Failure::AxisBusy { axis: self.instance() });
        }
        let from = self.mode;
        if from == ControlMode::TORQUE {
            return self.leave_torque(mode);
        }
        self.setup.control_mode = mode;
        if mode == ControlMode::POSITION {
            let last = self.seen.actual.unwrap_or(0);
            self.motion = Motion::Settling { since: self.planned_for, last, still: 0 };
            return Ok(SETTLING_MAX);
        }
        self.mode = mode;
        Ok(DurationNs::ZERO)
    }

    /// Velocity control takes the axis over as it turns, and brakes it.
    fn leave_torque(&mut self, mode: ControlMode) -> Result<DurationNs, Failure> {
        let scale = self.scale();
        let velocity = self.seen.velocity(scale) * scale;
        let acceleration = (velocity.abs() / BRAKING_SECONDS).max(1.0);
        let limits = Limits { velocity: 1.0, acceleration, jerk: acceleration / (BRAKING_SECONDS / 4.0) };
        let from = State { velocity, ..State::at_rest(float(self.seen.actual.unwrap_or(0))) };
        let profile = Profile::to_velocity(from, 0.0, limits);
        let length = self.begin_stop(profile, limits)?;
        self.torque = 0.0;
        self.mode = ControlMode::VELOCITY;
        self.setup.control_mode = mode;
        Ok(length + SETTLING_MAX)
    }

    /// Ends the motion under way; without one nothing happens. Without limits those of the motion count.
    pub fn stop(&mut self, limits: Option<Limits>) -> Result<DurationNs, Failure> {
        self.torque = 0.0;
        let present = match &self.motion {
            Motion::Moving { limits, .. } | Motion::Cruising { limits, .. } => *limits,
            Motion::Torque { .. } => {
                self.motion = Motion::None;
                return Ok(SETTLING_MAX);
            }
            Motion::None | Motion::Settling { .. } => return Ok(SETTLING_MAX),
        };
        let limits = limits.map_or(present, |limits| limits.scaled(self.scale()));
        let profile = Profile::to_velocity(self.command, 0.0, limits);
        Ok(self.begin_stop(profile, limits)? + SETTLING_MAX)
    }

    /// The counts in a unit of an axis that runs.
    fn running_scale(&self) -> Result<f64, Failure> {
        let axis = self.instance();
        if !self.is_running() {
            return Err(Failure::AxisNotRunning { axis, state: self.seen.state, fault: self.seen.fault });
        }
        self.scale.ok_or(Failure::NotScaled { axis })
    }

    fn ready_for_motion(&self) -> Result<f64, Failure> {
        let scale = self.running_scale()?;
        if self.is_moving() { Err(Failure::AxisBusy { axis: self.instance() }) } else { Ok(scale) }
    }

    fn in_mode(&self, wanted: &[ControlMode]) -> Result<(), Failure> {
        if wanted.contains(&self.mode) {
            return Ok(());
        }
        Err(Failure::WrongMode { axis: self.instance(), mode: self.mode })
    }

    /// The profile continues the command planned last.
    fn begin(
        &mut self,
        profile: Result<Profile, ProfileError>,
        limits: Limits,
    ) -> Result<DurationNs, Failure> {
        self.follow(profile, limits, false)
    }

    fn begin_stop(
        &mut self,
        profile: Result<Profile, ProfileError>,
        limits: Limits,
    ) -> Result<DurationNs, Failure> {
        self.follow(profile, limits, true)
    }

    fn follow(
        &mut self,
        profile: Result<Profile, ProfileError>,
        limits: Limits,
        stopping: bool,
    ) -> Result<DurationNs, Failure> {
        let profile = profile.map_err(|error| Failure::Profile { axis: self.instance(), error })?;
        let length = span(profile.seconds());
        self.motion = Motion::Moving { profile, start: self.planned_for, limits, stopping };
        Ok(length)
    }
}

/// What a torque step has to say.
pub(in crate::controller) fn check_torque_step(
    axis: u8,
    torque: f64,
    rate: f64,
    velocity_limit: f64,
) -> Result<(), Failure> {
    let bad = |what, value| Err(Failure::Profile { axis, error: ProfileError { what, value } });
    if !torque.is_finite() {
        return bad("torque", torque);
    }
    if !(rate.is_finite() && rate > 0.0) {
        return bad("torque rate limit", rate);
    }
    if !(velocity_limit.is_finite() && velocity_limit > 0.0) {
        return bad("velocity limit", velocity_limit);
    }
    Ok(())
}
