//! The motion checker: velocity and acceleration of every set-point that a drive gets, against the controller's own curve.
//!
//! It stands in every test of the rig, beside the protocol checkers, and looks at two things from outside: the updates as the
//! controller sends them ([`curve`]), and the set-points as the drives have them ([`reading`]), each with the cycle of its
//! bus ([`grid`]). While an axis is led by the controller, the velocity that the change since the last set-point means has
//! to be one that the controller's curve has in the time on which the set-point can depend, and so has its acceleration
//! ([`follower`]). What the gateway does by itself has rules of its own:
//!
//! | the axis | its set-points |
//! |---|---|
//! | begins to follow | are where the drive is |
//! | is led through assemblies | speed up and slow down by twice `limits.acceleration` at most: at the corners of a profile |
//! | is held by the gateway | stand |
//! | is stopped by the gateway's ramp | slow down by the configured deceleration at most |
//! | moves by its drive: homing, positioning, halt | are not looked at |
//! | whatever it does | are no faster than `limits.velocity`, with a tenth to spare |
//!
//! What was recorded of a box in real time is judged by the same rules ([`recording`]).
//!
//! A violation ends the test, unless the test has declared it ([`MotionChecker::allow`]) or it is of a finding that is
//! not mended yet ([`known`]).

pub mod curve;
pub mod follower;
pub mod grid;
pub mod known;
pub mod reading;
pub mod recording;
pub mod statistics;
pub mod violation;

use std::collections::VecDeque;
use std::fmt;

use axisbridge::config::{Config, DevicenetKind, DriveAt};
use axisbridge::engine::axis::AxisChannel;
use axisbridge::mapping::CipProgram;
use profile_cia402::drive::index::AXIS_OFFSET;
use profile_cia402::wire::cob_id;
use profile_cip::devicenet::wire::Identifier;
use profile_cip::wire::motion::CommandValues;
use profile_generic::cast::f64_from_i64;
use profile_generic::image::AxisCommand;
use profile_generic::sequence::SequenceStep;
use profile_generic::state::DriveState;
use profile_generic::time::{DurationNs, MonotonicTime};
use profile_sercos::wire::idn::Idn;

use self::curve::{Curve, Quantity, Skew};
use self::follower::{Follower, Instant, Leader};
use self::grid::Grid;
use self::known::{Known, OPEN};
use self::reading::{Reading, Scaling};
use self::statistics::Statistics;
use self::violation::{BusKind, Circumstances, Violation};
use super::clocks::Clock;
use super::updates::{AxisCommanded, Commanded};
use super::{Rig, START};

/// Calls of the engine that are remembered: some cycles of the slowest bus.
const CALLS_MAX: usize = 256;

/// How long set-points may depend on updates of before the end of a drift: those of a controller that is ahead wait for their time.
const DRIFT_LASTS: DurationNs = DurationNs::from_millis(100);

/// How long after a Sync of another master a phase of up to a millisecond may be corrected, and how fast: a microsecond in a
/// millisecond (CIP Volume 9, 2-2.2).
const CORRECTION_LASTS: DurationNs = DurationNs::from_millis(1_500);
const CORRECTION: f64 = 1e-3;

/// Cycles in which the lateness of the engine still shows in a set-point: it moves the change before and behind it, and the
/// ones that a curve is bent by.
const LATE_CYCLES: i64 = 16;

/// Violations shown at most.
const SHOWN_MAX: usize = 5;

/// A call of the engine.
#[derive(Debug, Clone)]
struct Call {
    at: MonotonicTime,
    late: DurationNs,
    leaders: Vec<Leader>,
}

/// The controller's units in generic ones.
#[derive(Debug, Clone, Copy)]
struct NorthScale {
    /// Nanounits in a count.
    position: f64,
    /// Nanounits per second in a unit per second.
    velocity: f64,
    /// Parts per million in a percent.
    torque: f64,
}

impl NorthScale {
    fn of(north: &CipProgram) -> Self {
        const MANY: i64 = 1_000_000_000_000_000;
        let counts = f64_from_i64(north.counts(MANY).value - north.counts(0).value);
        let values = CommandValues { velocity: Some(1e3), torque: Some(100.0), ..CommandValues::default() };
        let mut command = AxisCommand::default();
        north.decode(&values, 0, &mut north.trackers(), &mut command);
        Self {
            position: f64_from_i64(MANY) / counts,
            velocity: f64_from_i64(command.velocity.get()) / 1e3,
            torque: f64_from_i64(command.torque.get()) / 100.0,
        }
    }
}

/// An axis with its drive.
#[derive(Debug, Clone)]
struct Axis {
    number: usize,
    instance: u8,
    bus: BusKind,
    drive: DriveAt,
    limit: Option<f64>,
    acceleration: Option<f64>,
    grid: Grid,
    scaling: Option<Scaling>,
    mark: Option<u64>,
    curve: Curve,
    follower: Follower,
    statistics: Statistics,
    /// Updates that the gateway has got in the call that is to come, and set-points that it had taken before.
    arrived: Vec<u8>,
    commands: u64,
}

/// A violation that is meant to be.
struct Allowance {
    reason: String,
    is: Box<dyn Fn(&Violation) -> bool>,
    /// Whether it has to come.
    must: bool,
    came: bool,
}

/// The checker of a rig.
#[derive(Default)]
pub struct MotionChecker {
    axes: Vec<Axis>,
    calls: VecDeque<Call>,
    violations: Vec<Violation>,
    judged: usize,
    allowances: Vec<Allowance>,
    records: bool,
    seed: u64,
    period: DurationNs,
    connected_at: MonotonicTime,
    /// The largest drift between the clocks, and when it was there last: set-points depend on updates of then for a while.
    drifted: (MonotonicTime, f64),
}

impl fmt::Debug for MotionChecker {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MotionChecker").field("axes", &self.axes).finish_non_exhaustive()
    }
}

impl MotionChecker {
    /// A checker of the axes of a configuration; `seed` is shown with what it finds.
    #[must_use]
    pub fn new(config: &Config, seed: u64) -> Self {
        let cycle = |drive| match drive {
            DriveAt::Sercos { .. } => config.sercos.as_ref().map(|bus| (BusKind::Sercos, bus.cycle_time)),
            DriveAt::Can { bus, .. } => config.can.get(bus).map(|bus| (BusKind::Canopen, bus.cycle_time)),
            DriveAt::Devicenet { network, .. } => {
                config.devicenet.get(network).map(|network| (BusKind::Devicenet, network.cycle_time))
            }
        };
        let axes = config.axes.iter().enumerate().filter_map(|(number, axis)| {
            let (bus, cycle) = cycle(axis.drive)?;
            Some(Axis {
                number,
                instance: axis.instance,
                bus,
                drive: axis.drive,
                limit: axis.limits.velocity.map(|limit| f64_from_i64(limit.get())),
                acceleration: axis.limits.acceleration.map(|limit| f64_from_i64(limit.get())),
                grid: Grid::new(cycle),
                scaling: None,
                mark: None,
                curve: Curve::default(),
                follower: Follower::default(),
                statistics: Statistics::default(),
                arrived: Vec::new(),
                commands: 0,
            })
        });
        let mut checker = Self::default();
        (checker.axes, checker.seed) = (axes.collect(), seed);
        checker
    }

    // ---- what is meant to be --------------------------------------------------------------------------------------

    /// Declares violations that are made on purpose, and why. At least one of them has to come before the rig is dropped.
    pub fn allow(&mut self, reason: &str, is: impl Fn(&Violation) -> bool + 'static) {
        self.declare(reason, true, Box::new(is));
    }

    /// Declares violations that may come, and why: where chance decides.
    pub fn tolerate(&mut self, reason: &str, is: impl Fn(&Violation) -> bool + 'static) {
        self.declare(reason, false, Box::new(is));
    }

    /// Declares that this finding shows itself, as long as it is open.
    pub fn expect(&mut self, known: Known) {
        self.expect_as(known, move |violation| known.explains(violation));
    }

    /// Declares that this finding shows itself in violations that it does not always explain, as long as it is open.
    pub fn expect_as(&mut self, known: Known, is: impl Fn(&Violation) -> bool + 'static) {
        if known.is_open() {
            self.allow(&format!("{known:?} is open"), is);
        }
    }

    /// Judges nothing from now on: violations are only recorded.
    pub fn record(&mut self) {
        self.records = true;
    }

    fn declare(&mut self, reason: &str, must: bool, is: Box<dyn Fn(&Violation) -> bool>) {
        self.allowances.push(Allowance { reason: reason.to_owned(), is, must, came: false });
    }

    /// Everything that was found.
    #[must_use]
    pub fn violations(&self) -> &[Violation] {
        &self.violations
    }

    /// What the set-points of an axis, from 0, were like so far.
    #[must_use]
    pub fn statistics(&self, axis: usize) -> Statistics {
        self.axes.iter().find(|known| known.number == axis).map(|known| known.statistics).unwrap_or_default()
    }

    /// Forgets the statistics so far.
    pub fn restart_statistics(&mut self) {
        self.axes.iter_mut().for_each(|axis| axis.statistics = Statistics::default());
    }

    /// Judges what was found since the last time.
    ///
    /// # Panics
    /// With the violations that nobody has declared.
    pub fn judge(&mut self) {
        let new = self.violations.get(self.judged..).unwrap_or_default();
        let mut undeclared = Vec::new();
        for violation in new {
            let mut meant = OPEN.iter().any(|known| known.explains(violation));
            for allowance in self.allowances.iter_mut().filter(|allowance| (allowance.is)(violation)) {
                (allowance.came, meant) = (true, true);
            }
            if !meant {
                undeclared.push(violation.to_string());
            }
        }
        self.judged = self.violations.len();
        undeclared.truncate(SHOWN_MAX);
        assert!(undeclared.is_empty() || self.records, "seed {}: {}", self.seed, undeclared.join("\n"));
    }

    // ---- what happens ---------------------------------------------------------------------------------------------

    /// A controller has opened a stream: its updates are those of a new connection.
    pub fn connected(&mut self, now: MonotonicTime) {
        self.connected_at = now;
        self.axes.iter_mut().for_each(|axis| axis.curve.restart());
    }

    /// The controller has sent an update.
    pub(super) fn sent(&mut self, rig: &Rig, now: MonotonicTime, commanded: &Commanded) {
        let Some(controller) = &rig.controller else { return };
        let config = controller.config();
        let period =
            f64::from(config.rpi_us) * 1e3 * (1.0 - f64_from_i64(rig.controller_clock.drift_ppb()) / 1e9);
        self.period = DurationNs(profile_generic::cast::i64_from_f64(period.round()));
        for axis in &mut self.axes {
            let unwind = usize::from(axis.instance)
                .checked_sub(1)
                .and_then(|place| config.axes.get(place))
                .and_then(|setup| setup.unwind);
            let scale = NorthScale::of(rig.engine.cip_program(axis.number).expect("an axis of a device"));
            let command = commanded.axes.iter().find(|command| command.instance == axis.instance);
            let (value, modulo) = match command {
                Some(command) => (value(command, unwind, &scale), command.rolls_over()),
                None => (None, false),
            };
            let modulo = (modulo && unwind.is_none()).then_some(4_294_967_296.0 * scale.position.abs());
            let ahead = command.map_or(0, |command| command.target.0);
            axis.curve.sent(now, commanded.id, self.period, ahead, value, modulo);
        }
    }

    /// An update waits for the engine's next call.
    pub(super) fn arrived(&mut self, id: u8) {
        self.axes.iter_mut().for_each(|axis| axis.arrived.push(id));
    }

    /// The engine was called, late by so much: what it has taken, and who leads each axis.
    pub(super) fn called(&mut self, rig: &Rig, late: DurationNs) {
        let now = rig.now();
        for axis in &mut self.axes {
            let commands = rig.engine.axes()[axis.number].counters().commands;
            let taken = std::mem::replace(&mut axis.commands, commands) != commands;
            for id in axis.arrived.drain(..).filter(|_| taken) {
                axis.curve.taken(now, id);
            }
        }
        // What a controller commands through assemblies is not read here: its axes have no curve, and may have a limit.
        let by_assembly = |axis: usize| rig.engine.cip_program(axis).is_none();
        let limit = |number| self.axes.iter().find(|axis| axis.number == number)?.acceleration;
        let leaders = rig.engine.axes().iter().enumerate().map(|(number, axis)| match leader(axis) {
            Leader::Controller if by_assembly(number) => limit(number).map_or(Leader::Other, Leader::Bounded),
            leader => leader,
        });
        let leaders = leaders.collect();
        self.calls.push_back(Call { at: now, late, leaders });
        if self.calls.len() > CALLS_MAX {
            self.calls.pop_front();
        }
    }

    /// Looks at what the drives have, and judges it.
    pub(super) fn observe(&mut self, rig: &Rig) {
        let apart = (rig.controller_clock.drift_ppb() - rig.gateway_clock.drift_ppb()).abs();
        let pull = self.axes.iter().map(|axis| axis.grid.pull()).fold(0.0, f64::max);
        let rates = f64_from_i64(apart) / 1e9;
        let drift = rates + pull;
        if drift >= self.drifted.1 || rig.now().since(self.drifted.0) > DRIFT_LASTS {
            self.drifted = (rig.now(), drift);
        }
        let followed = [&rig.controller_clock, &rig.gateway_clock].map(Clock::followed_at);
        let corrects = followed.into_iter().flatten().any(|at| rig.now().since(at) <= CORRECTION_LASTS);
        let correction = if corrects { CORRECTION } else { 0.0 };
        let offset = rig.controller_clock.offset(rig.now()) - rig.gateway_clock.offset(rig.now());
        let skew = Skew {
            synchronous: rig
                .engine
                .devices()
                .first()
                .is_some_and(|channel| channel.device().is_synchronous()),
            // The time of another master is on its way to one of them: their stamps are compensated.
            offset: if corrects { DurationNs::ZERO } else { offset },
            drift: self.drifted.1 + correction,
        };
        let steps = rig.controller_clock.steps().iter().chain(rig.gateway_clock.steps());
        let stepped = steps.into_iter().any(|(at, _)| *at >= self.connected_at);
        for axis in &mut self.axes {
            let Some((reading, scaling, sent)) = read_scaled(axis, rig) else {
                axis.mark = None;
                axis.follower.lose();
                continue;
            };
            let news = axis.mark.replace(reading.mark) != Some(reading.mark);
            if !news {
                continue;
            }
            let (cycle_time, bus) = (axis.grid.cycle(), axis.bus);
            // On CANopen what goes out behind a SYNC counts from the next one on.
            let made = |call: &&Call| if bus == BusKind::Canopen { call.at < sent } else { call.at <= sent };
            let call = self.calls.iter().rev().find(made);
            let of_sent = self.calls.iter().rev().find(|call| call.at <= sent);
            let late = of_sent.map_or(DurationNs::ZERO, |call| call.late);
            let cycle = axis.grid.sent(sent, late > DurationNs::ZERO);
            let leader =
                call.and_then(|call| call.leaders.get(axis.number)).copied().unwrap_or(Leader::Other);
            // The pull of this very cycle.
            let skew = Skew { drift: skew.drift.max(rates + axis.grid.pull() + correction), ..skew };
            let instant = Instant {
                at: call.map_or(sent, |call| call.at),
                cycle,
                cycle_time,
                skew,
                period: self.period,
                limit: axis.limit,
            };
            let since = sent - cycle_time * LATE_CYCLES;
            let recent = self.calls.iter().rev().take_while(|call| call.at >= since).map(|call| call.late);
            let circumstances = Circumstances {
                synchronous: skew.synchronous,
                late: recent.max().unwrap_or(DurationNs::ZERO),
                offset: skew.offset,
                stepped,
                drifts: skew.drift != 0.0,
            };
            let Axis { follower, curve, statistics, .. } = axis;
            for found in follower.take(&reading, &scaling, leader, curve, &instant, statistics) {
                let follower::Finding { rule, value, low, high } = found;
                let (axis, at) = (axis.number, sent.since(START));
                self.violations.push(Violation {
                    rule,
                    axis,
                    bus,
                    at,
                    cycle,
                    value,
                    low,
                    high,
                    circumstances,
                });
            }
        }
        self.judge();
    }
}

impl Drop for MotionChecker {
    fn drop(&mut self) {
        if std::thread::panicking() {
            return;
        }
        for allowance in self.allowances.iter().filter(|allowance| allowance.must) {
            assert!(allowance.came, "no motion was violated though it was declared: {}", allowance.reason);
        }
    }
}

/// What an update commands, in generic units.
fn value(command: &AxisCommanded, unwind: Option<u32>, scale: &NorthScale) -> Option<(Quantity, f64)> {
    let quantity = Quantity::of(command.mode)?;
    let value = match quantity {
        Quantity::Position => command.position(unwind)? * scale.position,
        Quantity::Velocity => (f64::from(command.values.velocity?) + command.trims.1) * scale.velocity,
        Quantity::Torque => (f64::from(command.values.torque?) + command.trims.2) * scale.torque,
    };
    Some((quantity, value))
}

/// What leads an axis now.
fn leader(axis: &AxisChannel) -> Leader {
    match (axis.state(), axis.sequence_step()) {
        (DriveState::Operating, SequenceStep::Running) => Leader::Controller,
        (_, SequenceStep::Ramping) => {
            let deceleration = axis.stop_settings().deceleration;
            deceleration.map_or(Leader::Other, |rate| Leader::Ramp(f64_from_i64(rate.get().abs())))
        }
        (
            DriveState::Starting | DriveState::Operating,
            SequenceStep::Energizing | SequenceStep::Releasing | SequenceStep::Engaging,
        ) => Leader::Hold,
        _ => Leader::Other,
    }
}

/// The same with the scaling of now, which does not change while a drive follows.
fn read_scaled(axis: &mut Axis, rig: &Rig) -> Option<(Reading, Scaling, MonotonicTime)> {
    let before = read(axis, rig)?;
    if before.0.follows.is_none() || axis.follower.follows() {
        return Some(before);
    }
    axis.scaling = None;
    let now = read(axis, rig)?;
    if now.1 != before.1 {
        axis.follower.lose();
    }
    Some(now)
}

/// The drive of an axis, its scaling, and when what it has was sent; `None` while it is not there.
fn read(axis: &mut Axis, rig: &Rig) -> Option<(Reading, Scaling, MonotonicTime)> {
    let fresh = axis.scaling.is_none();
    match axis.drive {
        DriveAt::Sercos { drive } => {
            let address = rig.config.sercos.as_ref()?.drives.get(drive)?.address;
            let mut slaves = rig.line.slaves().iter();
            let slave = slaves.find(|slave| slave.store().number_of(Idn::ADDRESS) == i64::from(address))?;
            if fresh {
                axis.scaling = reading::sercos_scaling(slave);
            }
            let scaling = axis.scaling?;
            Some((reading::sercos(slave, &scaling)?, scaling, rig.now()))
        }
        DriveAt::Can { bus, drive } => {
            let (wire, drive) = (rig.can.get(bus)?, rig.config.can.get(bus)?.drives.get(drive)?);
            let node = wire.bus.nodes().find(|node| node.node() == Some(drive.node))?;
            let offset = drive.axis * AXIS_OFFSET;
            if fresh {
                axis.scaling = reading::canopen_scaling(node, offset, drive.way_of_a_turn);
            }
            let scaling = axis.scaling?;
            let servo = node.application().axes().get(usize::from(drive.axis))?;
            Some((reading::canopen(node, servo, offset, &scaling)?, scaling, wire.sent_at(cob_id::SYNC)?))
        }
        DriveAt::Devicenet { network, drive } => {
            let (wire, place) = (rig.devicenet.get(network)?, drive);
            let drive = rig.config.devicenet.get(network)?.drives.get(drive)?;
            let DevicenetKind::Motion { resolution, .. } = drive.kind else { return None };
            let scaling = reading::devicenet_scaling(resolution, drive.way_of_a_turn);
            axis.scaling = Some(scaling);
            let sent = wire.sent_at(Identifier::PollCommand(drive.mac).can())?;
            Some((reading::devicenet(wire.bus.nodes().nth(place)?, rig.now(), &scaling)?, scaling, sent))
        }
    }
}
