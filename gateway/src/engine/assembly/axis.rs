//! One axis of a device with assemblies: what its control word makes of it, and where its set-points come from.
//!
//! ```text
//! mode  name             set-points                                     START
//! 1     position         the generator of the gateway, to the target    begins a movement
//! 2     velocity         the generator of the gateway, to the velocity  not needed
//! 3     cyclic position  each datagram                                  not needed
//! 4     cyclic velocity  each datagram                                  not needed
//! 5     cyclic torque    each datagram                                  not needed
//! ```
//!
//! STOP brakes with the generator. In torque control, and where no acceleration is configured, it ends as a disable does. Another mode is
//! taken at standstill; before, the axis brakes.

use profile_cip::assembly::handshake::{Axis, Control, Handshake, Reaction, State, Status};
use profile_cip::assembly::{AxisInput, AxisOutput, Link, Refusal, Scale};
use profile_generic::fault::FaultCause;
use profile_generic::image::{AxisCommand, CommandSet, FeedbackSet, Signal, StatusBits};
use profile_generic::inhibit::Inhibits;
use profile_generic::interpolation::TargetUpdate;
use profile_generic::mode::{InterpolationSource, ModeSelection, OperatingMode};
use profile_generic::quantity::{Acceleration, Position, Torque, Velocity};
use profile_generic::state::{DriveState, Request};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_generic::time_base::TimeBase;

use super::AssemblyAxis;
use crate::engine::axis::{
    AxisChannel, Intent, NorthPoints, Owner, READY_TIME_OUT, START_TIME_OUT, Target, Updates, Wish,
};
use crate::engine::generator::{self, Misfit, POSITION, ProfileGenerator, SetPoint, Standstill};

/// Set-points of the controller that may be missed before the command counts as lost.
const MAY_MISS: u32 = 4;

mod mode {
    pub const POSITION: u8 = 1;
    pub const VELOCITY: u8 = 2;
    pub const CYCLIC_POSITION: u8 = 3;
    pub const CYCLIC_VELOCITY: u8 = 4;
    pub const CYCLIC_TORQUE: u8 = 5;
}

/// Torque within which the reference of torque control counts as reached: 2 % of the rated one.
const AT_TORQUE: u64 = 20_000;

/// What is around an axis in a cycle.
#[derive(Clone, Copy)]
pub(super) struct Around<'a> {
    pub now: (MonotonicTime, SystemTime),
    pub time: &'a TimeBase,
    pub synchronized: bool,
    pub link: Link,
    /// Interval of the owner.
    pub period: Option<DurationNs>,
    /// New data came, and would have on an even network at this instant.
    pub paced_at: Option<MonotonicTime>,
}

/// Where the set-points of an operating axis come from.
#[derive(Debug, Clone, Copy)]
enum Source {
    /// Nowhere yet: it holds the position at which it was enabled.
    None,
    /// The generator of the gateway.
    Generator(ProfileGenerator),
    /// The controller.
    Cyclic,
}

/// One axis.
#[derive(Debug)]
pub(super) struct PlcAxis {
    /// Number of the axis in the engine.
    pub number: usize,
    /// Its instance in the device.
    pub instance: u16,
    pub scale: Scale,
    handshake: Handshake,
    source: Source,
    /// The mode in use.
    mode: u8,
    /// Velocity and acceleration that mode 2 follows.
    followed: Option<(Velocity, Acceleration)>,
    /// Target of the last movement, until another order.
    target: Option<Position>,
    done: bool,
    /// The last set-point of the controller that was handed on.
    last: Option<SetPoint>,
    /// The same of a torque.
    torque: Option<Torque>,
    start_taken: bool,
    refusal: Refusal,
    sequence: u32,
    /// Since when ENABLE waits for the drive.
    enabling: Option<MonotonicTime>,
    /// When the drive was asked to enable.
    begun: Option<MonotonicTime>,
    /// It was in operation since it was enabled.
    has_operated: bool,
    standstill: Standstill,
    connected: bool,
    toggle: bool,
    sampled_at: MonotonicTime,
}

impl PlcAxis {
    pub fn new(config: &AssemblyAxis) -> Self {
        Self {
            number: config.axis,
            instance: config.instance,
            scale: config.scale,
            handshake: Handshake::default(),
            source: Source::None,
            mode: 0,
            followed: None,
            target: None,
            done: false,
            last: None,
            torque: None,
            start_taken: false,
            refusal: Refusal::NONE,
            sequence: 0,
            enabling: None,
            begun: None,
            has_operated: false,
            standstill: Standstill::new(),
            connected: false,
            toggle: false,
            sampled_at: MonotonicTime::ZERO,
        }
    }

    /// Does what the controller wants. Call it in every cycle.
    pub fn follow(&mut self, around: &Around<'_>, axis: &mut AxisChannel, output: &AxisOutput) {
        let (now, system) = around.now;
        if axis.owner() == Owner::Local {
            self.handshake = Handshake::default();
            return;
        }
        self.connect(axis);
        let mut inhibits = Inhibits::empty();
        inhibits.set(Inhibits::LIMIT_SWITCHES_NOT_TOLD, axis.misses_limit_switches());
        axis.set_inhibits(now, system, inhibits);
        axis.retry_wish(now, system);
        self.standstill.watch(now, axis);
        if !axis.operates() {
            (self.source, self.followed, self.last, self.torque) = (Source::None, None, None, None);
        }
        let reaction = self.shake(around, axis, output);
        self.react(around, axis, reaction);
        self.enable(around, axis);
        self.in_operation(around, axis, output, reaction);
        self.generate(around, axis);
    }

    /// A step of the handshake, and what of the word is refused.
    fn shake(&mut self, around: &Around<'_>, axis: &AxisChannel, output: &AxisOutput) -> Reaction {
        let known = Axis { faulted: is_faulted(axis), operating: axis.operates() };
        let before = self.handshake.state();
        let (reaction, refusal) = self.handshake.step(around.link, output.control, known);
        if before == State::Enabled && known.faulted {
            self.forget_enable();
        }
        if !output.control.contains(Control::START) {
            self.start_taken = false;
        }
        if reaction.intersects(Reaction::RESET | Reaction::ENABLE) {
            self.refusal = Refusal::NONE;
        }
        // What was refused of the same word is shown, whatever else of it was carried out.
        if refusal != Refusal::NONE {
            self.refusal = refusal;
        }
        if around.link == Link::Run
            && let Some(refusal) = output.refusal
        {
            self.refusal = refusal;
        }
        reaction
    }

    /// Carries out what the handshake says, without what needs an axis in operation.
    fn react(&mut self, around: &Around<'_>, axis: &mut AxisChannel, reaction: Reaction) {
        if reaction.contains(Reaction::LOSE) {
            self.lose(around, axis);
        }
        if reaction.contains(Reaction::DISABLE) {
            self.disable(around, axis);
        }
        if reaction.contains(Reaction::RESET) {
            let reset = AxisCommand { request: Some(Request::FaultReset), ..AxisCommand::default() };
            self.send(around, axis, reset);
        }
        if reaction.contains(Reaction::ENABLE) {
            (self.enabling, self.begun, self.has_operated) = (Some(around.now.0), None, false);
            (self.target, self.done) = (None, false);
        }
    }

    /// What an axis in operation does: nothing without ENABLE.
    fn in_operation(
        &mut self,
        around: &Around<'_>,
        axis: &mut AxisChannel,
        output: &AxisOutput,
        reaction: Reaction,
    ) {
        if !axis.operates() {
            return;
        }
        if self.handshake.state() == State::Enabled {
            self.operate(around, axis, output, reaction);
        } else if !is_faulted(axis) {
            // Held after a lost command, and the fault was reset: nobody wants the torque.
            self.disable(around, axis);
        }
    }

    /// A controller that has connected counts its orders by itself, and was refused none.
    fn connect(&mut self, axis: &mut AxisChannel) {
        let connected = axis.has_controller();
        if connected && !self.connected {
            axis.begin_north();
            self.refusal = Refusal::NONE;
        }
        self.connected = connected;
    }

    fn forget_enable(&mut self) {
        (self.enabling, self.begun, self.source, self.followed) = (None, None, Source::None, None);
    }

    /// The controller is gone or idle.
    fn lose(&mut self, around: &Around<'_>, axis: &mut AxisChannel) {
        let (now, system) = around.now;
        self.forget_enable();
        axis.lose_north(now, system);
        if !is_faulted(axis) {
            // It was not running: what may be under way ends as a disable does.
            self.disable(around, axis);
        }
    }

    fn disable(&mut self, around: &Around<'_>, axis: &mut AxisChannel) {
        let (now, system) = around.now;
        self.forget_enable();
        axis.take_wish(now, system, Wish { intent: Intent::Disable, request: Some(Request::Disable) });
        axis.end_set_points();
    }

    /// Enables the drive once it is ready; gives up when it does not become ready, or falls out of operation.
    fn enable(&mut self, around: &Around<'_>, axis: &mut AxisChannel) {
        let (now, system) = around.now;
        if self.handshake.state() != State::Enabled {
            return;
        }
        self.has_operated |= axis.operates();
        let Some(since) = self.enabling else { return };
        let late = match self.begun {
            None if axis.state() == DriveState::Ready => {
                self.begun = Some(now);
                axis.end_set_points();
                axis.take_wish(now, system, Wish { intent: Intent::Enable, request: Some(Request::Enable) });
                false
            }
            None => now.since(since) > READY_TIME_OUT,
            Some(_) if self.has_operated => axis.state() != DriveState::Operating,
            Some(begun) => now.since(begun) > START_TIME_OUT,
        };
        if late {
            self.refusal = Refusal::NOT_READY;
            self.handshake.lock();
            self.disable(around, axis);
        }
    }

    // ---- in operation ----------------------------------------------------------------------------------------------

    fn operate(
        &mut self,
        around: &Around<'_>,
        axis: &mut AxisChannel,
        output: &AxisOutput,
        reaction: Reaction,
    ) {
        if output.mode != self.mode {
            if !self.standstill.is_reached(around.now.0) {
                self.refusal = Refusal::MODE;
                return self.brake(around, axis);
            }
            (self.mode, self.source, self.followed) = (output.mode, Source::None, None);
            (self.last, self.torque) = (None, None);
            if self.refusal == Refusal::MODE {
                self.refusal = Refusal::NONE;
            }
            // Nobody has set-points until there is another source: the axis holds its position.
            axis.end_set_points();
            // A drive that starts in torque control is in the mode that is asked for.
            if is_pushed(axis) && self.mode != mode::CYCLIC_TORQUE {
                self.brake(around, axis);
                if self.handshake.state() != State::Enabled {
                    return;
                }
            }
        }
        if reaction.contains(Reaction::HALT) {
            return self.brake(around, axis);
        }
        if reaction.contains(Reaction::START) {
            (self.start_taken, self.done, self.target) = (true, false, None);
            self.refusal = Refusal::NONE;
        }
        match self.mode {
            mode::POSITION => {
                if reaction.contains(Reaction::START)
                    && let Err(refusal) = self.go(around, axis, output)
                {
                    self.refusal = refusal;
                }
            }
            mode::VELOCITY => self.run(around, axis, output),
            mode::CYCLIC_POSITION | mode::CYCLIC_VELOCITY | mode::CYCLIC_TORQUE => {
                self.pass_on(around, axis, output);
            }
            0 => {}
            _ => self.refusal = Refusal::MODE,
        }
    }

    /// Starts a movement to the target.
    fn go(
        &mut self,
        around: &Around<'_>,
        axis: &mut AxisChannel,
        output: &AxisOutput,
    ) -> Result<(), Refusal> {
        if let Some(refusal) = output.refusal {
            return Err(refusal);
        }
        let (Some(target), Some(velocity)) = (output.position, output.velocity) else {
            return Err(Refusal::MODE);
        };
        if !generator::has(axis, POSITION) {
            return Err(Refusal::MODE);
        }
        let acceleration = generator::acceleration(axis, velocity, given(output)).map_err(refusal)?;
        let here = match &self.source {
            Source::Generator(generator) => generator.profile.position(),
            Source::None | Source::Cyclic => axis.feedback().position,
        };
        let target = match output.control.contains(Control::RELATIVE) {
            true => here.get().checked_add(target.get()).map(Position).ok_or(Refusal::VALUE)?,
            false => target,
        };
        generator::target(axis, target, velocity).map_err(refusal)?;
        let mut generator = self.generator(around, axis, POSITION, acceleration);
        generator.profile.to_position(target, velocity, acceleration);
        self.source = Source::Generator(generator);
        self.target = Some(target);
        Ok(())
    }

    /// Follows the velocity on the ramp of the generator.
    fn run(&mut self, around: &Around<'_>, axis: &mut AxisChannel, output: &AxisOutput) {
        let Some(velocity) = output.velocity else {
            self.refusal = Refusal::MODE;
            return;
        };
        let acceleration = match generator::acceleration(axis, velocity, given(output)) {
            Ok(acceleration) if self.followed == Some((velocity, acceleration)) => return,
            acceleration => acceleration,
        };
        let fit = acceleration.and_then(|acceleration| {
            Ok((acceleration, generator::run_mode(axis)?, generator::end_of_travel(axis, velocity)?))
        });
        let (acceleration, mode, end) = match fit {
            Ok(fit) => fit,
            Err(misfit) => {
                self.refusal = refusal(misfit);
                return self.brake(around, axis);
            }
        };
        let mut generator = self.generator(around, axis, mode, acceleration);
        generator.run(velocity, acceleration, end);
        self.source = Source::Generator(generator);
        self.followed = Some((velocity, acceleration));
        if self.refusal != Refusal::BOTH_DIRECTIONS {
            self.refusal = Refusal::NONE;
        }
    }

    /// Hands the set-points of the controller on.
    fn pass_on(&mut self, around: &Around<'_>, axis: &mut AxisChannel, output: &AxisOutput) {
        let (now, system) = around.now;
        let (Some(paced_at), Some(period)) = (around.paced_at, around.period) else { return };
        let selection = ModeSelection {
            mode: match self.mode {
                mode::CYCLIC_POSITION => OperatingMode::Position,
                mode::CYCLIC_VELOCITY => OperatingMode::Velocity,
                _ => OperatingMode::Torque,
            },
            interpolation: InterpolationSource::Controller,
        };
        self.sequence = self.sequence.wrapping_add(1);
        self.source = Source::Cyclic;
        let Some(command) = set_points(selection, output).filter(|_| generator::has(axis, selection)) else {
            self.refusal = Refusal::MODE;
            return axis.refuse_set_points(now, system, self.sequence, FaultCause::ILLEGAL_MODE);
        };
        axis.keep_updates(Updates { period, may_miss: MAY_MISS, first: TargetUpdate::Interpolate });
        // Without a common time a stamp says nothing.
        let stamp = output.time_stamp.filter(|_| around.synchronized);
        let target = match stamp {
            Some(stamp) => Target::At(around.time.target_at(stamp), TargetUpdate::Interpolate),
            None => Target::Paced(paced_at),
        };
        self.last = Some(self.handed(axis.instant_of(target), &command));
        self.torque = (selection.mode == OperatingMode::Torque).then_some(command.torque);
        let unusable = u32::from(output.refusal.is_some());
        if unusable == 0 && self.refusal == Refusal::VALUE {
            self.refusal = Refusal::NONE;
        }
        let sequence = self.sequence;
        let points = NorthPoints { command, sequence, target, saturated: 0, unusable, is_counted: false };
        axis.take_set_points(now, system, points);
    }

    /// A set-point as it is handed on; a position has the velocity at which it is come to.
    fn handed(&self, at: MonotonicTime, command: &AxisCommand) -> SetPoint {
        let mut handed = SetPoint { at, position: command.position, velocity: command.velocity };
        if self.mode == mode::CYCLIC_POSITION {
            handed.velocity = match self.last {
                Some(last) if at > last.at => velocity_between(&last, &handed),
                Some(last) => last.velocity,
                None => Velocity::ZERO,
            };
        }
        handed
    }

    /// Brakes to standstill, and stays there.
    fn brake(&mut self, around: &Around<'_>, axis: &mut AxisChannel) {
        self.followed = None;
        self.target = None;
        let mode = match &self.source {
            Source::Generator(generator) => Some(generator.mode),
            // It holds the position at which it was enabled.
            Source::None if self.standstill.is_reached(around.now.0) && !is_pushed(axis) => return,
            Source::None | Source::Cyclic => generator::run_mode(axis).ok(),
        };
        let torque = self.mode == mode::CYCLIC_TORQUE;
        // A generator in progress goes on with its own acceleration.
        let acceleration = match &self.source {
            Source::Generator(_) => Some(Acceleration(1)),
            Source::None | Source::Cyclic => generator::acceleration(axis, Velocity::ZERO, None).ok(),
        };
        let (Some(mode), Some(acceleration), false) = (mode, acceleration, torque) else {
            // Nothing but the drive itself brakes an axis in torque control, or one without a known acceleration.
            self.handshake.lock();
            return self.disable(around, axis);
        };
        if let (Source::Cyclic, Some(last), Some(period)) = (&self.source, self.last, around.period) {
            // Where the set-points have led it, and not where it is: the drive lags.
            let mode =
                if self.mode == mode::CYCLIC_VELOCITY { generator::VELOCITY } else { generator::POSITION };
            self.source = Source::Generator(ProfileGenerator::behind(&last, mode, period, acceleration));
            return;
        }
        let mut generator = self.generator(around, axis, mode, acceleration);
        generator.profile.brake();
        self.source = Source::Generator(generator);
    }

    /// The generator in this mode: the one in progress, or one from how the axis moves.
    fn generator(
        &mut self,
        around: &Around<'_>,
        axis: &mut AxisChannel,
        mode: ModeSelection,
        braking: Acceleration,
    ) -> ProfileGenerator {
        match self.source {
            Source::Generator(generator) if generator.mode == mode => generator,
            _ => {
                axis.keep_updates(generator::UPDATES);
                ProfileGenerator::from_axis(around.now.0, axis, mode, braking)
            }
        }
    }

    /// Sends the set-points of the generator that are due, and sees whether the movement is done.
    fn generate(&mut self, around: &Around<'_>, axis: &mut AxisChannel) {
        let Source::Generator(mut generator) = self.source else { return };
        while let Some(command) = generator.poll(around.now.0, axis) {
            self.send(around, axis, command);
        }
        self.source = Source::Generator(generator);
        if let Some(target) = self.target
            && generator.profile.is_done()
            && self.standstill.is_reached(around.now.0)
        {
            self.done = generator::is_in_position(axis, target);
        }
    }

    fn send(&mut self, around: &Around<'_>, axis: &mut AxisChannel, command: AxisCommand) {
        let (now, system) = around.now;
        self.sequence = self.sequence.wrapping_add(1);
        axis.from_north(now, system, &AxisCommand { sequence: self.sequence, ..command });
    }

    // ---- to the controller -----------------------------------------------------------------------------------------

    /// Why the last order was refused.
    pub const fn refusal(&self) -> Refusal {
        self.refusal
    }

    /// What the controller is shown.
    pub fn input(&mut self, around: &Around<'_>, axis: &AxisChannel) -> AxisInput {
        let now = around.now.0;
        let feedback = axis.feedback();
        self.toggle ^= std::mem::replace(&mut self.sampled_at, feedback.at) != feedback.at;
        let moving = match &self.source {
            Source::Generator(generator) => !generator.profile.is_done(),
            Source::None => false,
            Source::Cyclic => !axis.stands(),
        };
        let held = axis.owner() == Owner::Local;
        let mut status = Status::empty();
        for (bit, on) in [
            (Status::READY, axis.state() == DriveState::Ready),
            (Status::ENABLED, axis.operates() && !held),
            (Status::FAULT, is_faulted(axis)),
            (Status::MOVING, moving),
            (Status::DONE, self.done),
            (Status::START_TAKEN, self.start_taken),
            (Status::REFUSED, self.refusal != Refusal::NONE),
            (Status::LOCKED, self.handshake.state() == State::Locked),
            (Status::RUN, around.link == Link::Run),
            (Status::HELD, held),
            (Status::STANDSTILL, axis.stands()),
            (Status::SYNCHRONIZED, around.synchronized),
            (Status::WARNING, feedback.status.contains(StatusBits::WARNING)),
            (Status::TORQUE, axis.may_have_torque()),
            (Status::TOGGLE, self.toggle),
        ] {
            status.set(bit, on);
        }
        let age = now.since(feedback.at).as_nanos() / 1_000;
        let known = feedback.at != MonotonicTime::ZERO;
        let has = |signal| feedback.present.contains(signal);
        let stamp =
            if known && around.synchronized { around.time.system_at(feedback.at) } else { SystemTime(0) };
        let at_reference = match (&self.source, self.followed) {
            (Source::Generator(generator), Some((velocity, _))) => generator.profile.velocity() == velocity,
            (Source::Cyclic, _) => self
                .torque
                .zip(feedback.get(Signal::TorqueActual))
                .is_some_and(|(wanted, actual)| actual.abs_diff(wanted.get()) <= AT_TORQUE),
            _ => false,
        };
        AxisInput {
            status,
            mode: self.mode,
            refusal: self.refusal,
            fault: axis.fault().map_or(0, |fault| fault.cause.0),
            position: feedback.position,
            velocity: feedback.velocity,
            torque: feedback.torque,
            following_error: feedback.following_error,
            inputs: if has(FeedbackSet::DIGITAL_INPUTS) { feedback.digital_inputs } else { 0 },
            age_us: if known { u32::try_from(age).unwrap_or(u32::MAX) } else { u32::MAX },
            time_stamp: stamp,
            at_reference,
        }
    }
}

/// The set-points of a mode, with offsets; `None` when the layout has no field for them.
fn set_points(selection: ModeSelection, output: &AxisOutput) -> Option<AxisCommand> {
    let mut command = AxisCommand::default();
    command.select(selection);
    match selection.mode {
        OperatingMode::Position => {
            command.position = output.position.or(output.refusal.map(|_| Position::ZERO))?;
            command.present |= CommandSet::POSITION;
        }
        OperatingMode::Velocity => {
            command.velocity = output.velocity.or(output.refusal.map(|_| Velocity::ZERO))?;
            command.present |= CommandSet::VELOCITY;
        }
        _ => {
            command.torque = output.torque?;
            command.present |= CommandSet::TORQUE;
        }
    }
    if let Some(offset) = output.velocity_offset {
        command.velocity_offset = offset;
        command.present |= CommandSet::VELOCITY_OFFSET;
    }
    if let Some(offset) = output.torque_offset {
        command.torque_offset = offset;
        command.present |= CommandSet::TORQUE_OFFSET;
    }
    Some(command)
}

/// The acceleration that the controller gives; zero means the configured one.
fn given(output: &AxisOutput) -> Option<Acceleration> {
    output.acceleration.filter(|given| *given != Acceleration::ZERO)
}

/// The velocity from one set-point to a later one.
fn velocity_between(from: &SetPoint, to: &SetPoint) -> Velocity {
    let way = i128::from(to.position.get()) - i128::from(from.position.get());
    let span = i128::from(to.at.since(from.at).as_nanos().max(1));
    let velocity = way * 1_000_000_000 / span;
    Velocity(i64::try_from(velocity).unwrap_or(if way < 0 { i64::MIN } else { i64::MAX }))
}

fn refusal(misfit: Misfit) -> Refusal {
    match misfit {
        Misfit::Mode(_) => Refusal::MODE,
        Misfit::NoAcceleration | Misfit::NotPositive => Refusal::NOT_POSITIVE,
        Misfit::TooFast(_) => Refusal::TOO_FAST,
        Misfit::TooSteep(_) => Refusal::TOO_STEEP,
        Misfit::Beyond(_) => Refusal::BEYOND_LIMIT,
    }
}

/// Whether the drive of an axis is in torque control, where nothing holds it.
fn is_pushed(axis: &AxisChannel) -> bool {
    axis.command().mode == OperatingMode::Torque
}

fn is_faulted(axis: &AxisChannel) -> bool {
    axis.fault().is_some() || matches!(axis.state(), DriveState::Faulted | DriveState::FaultReaction)
}

#[cfg(test)]
mod tests {
    use profile_generic::fault::Reaction as FaultReaction;
    use profile_generic::time_base::TimeSample;

    use super::*;
    use crate::engine::axis::Limits;

    /// However small the torque is that is wanted: nobody knows whether it is there.
    #[test]
    fn torque_that_the_drive_does_not_report_is_not_at_its_reference() {
        let scale = Scale { counts_per_unit: 1, rated_torque: 0 };
        let config = AssemblyAxis { axis: 0, instance: 1, scale };
        let mut plc = PlcAxis::new(&config);
        (plc.source, plc.torque) = (Source::Cyclic, Some(Torque::ZERO));
        let now = (MonotonicTime::ZERO, SystemTime(0));
        let time = TimeBase::new(TimeSample { at: now.0, system: now.1, rate_ppb: 0 });
        let around =
            Around { now, time: &time, synchronized: false, link: Link::Run, period: None, paced_at: None };
        let axis = AxisChannel::new(Limits::default(), FaultReaction::HoldPosition, true);
        assert_eq!(axis.feedback().get(Signal::TorqueActual), None);
        assert!(!plc.input(&around, &axis).at_reference);
    }
}
