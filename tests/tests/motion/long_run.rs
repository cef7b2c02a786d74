//! Long runs in virtual time: whatever clocks and network do, and however often counters wrap, the drive stands where the controller
//! wants it, to a count.
//!
//! What can accumulate an error is run alone, with the engine's own parts: the update of the controller, its target on the local
//! clock, the interpolator, the conversion to the drive's counter, and back to the position that the controller is told. The clocks
//! drift and step, updates are lost, and all counters of 32 bits and the modulo of the axis wrap. At each rest both sides are
//! compared. CI runs a million and a half cycles of it; a hundred million on each axis take minutes:
//!
//! ```text
//! cargo test -p axisbridge-tests --test motion -- --ignored --nocapture a_hundred_million
//! ```
//!
//! The whole chain, with controller, network, engine, bus and drive, is slower by two orders of magnitude and runs as many cycles as
//! there is time for.

use std::time::Instant;

use axisbridge::config::Config;
use axisbridge::engine::axis::{AxisChannel, Limits as AxisLimits, Updates};
use axisbridge::engine::cyclic::{Cycle, Received};
use axisbridge::engine::device::CipAxis;
use axisbridge::mapping::{DriveProgram, Mapping};
use axisbridge::simulate::setup::make_cyclic;
use axisbridge::translate::{Stage, StageAxis};
use axisbridge_tests::can_frames;
use axisbridge_tests::rig::network::{Knobs, Random};
use profile_cip::controller::{Limits, Step};
use profile_cip::device::axis_state::AxisState;
use profile_cip::device::drive_link::{
    AxisCommandImage, Command, DriveAction, DriveImage, SetPoints, Trims, Withheld,
};
use profile_cip::wire::motion::codes::{CommandTarget, ControlMode, FeedbackMode};
use profile_cip::wire::motion::{CommandPosition, CommandValues};
use profile_generic::cast::f64_from_i64;
use profile_generic::fault::Reaction;
use profile_generic::image::{Signal, StatusBits};
use profile_generic::interpolation::TargetUpdate;
use profile_generic::mode::OperatingMode;
use profile_generic::program::Field;
use profile_generic::state::{DriveState, Report};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_generic::time_base::{TimeBase, TimeSample};

use crate::chain::{Bus, Chain};
use crate::probe::{COUNT, Probe};
use crate::scenario::AXIS;

/// Cycle of the bus and update period of the controller.
const CYCLE: DurationNs = DurationNs::from_millis(2);
const PERIOD: DurationNs = DurationNs::from_millis(4);

/// How far ahead of its instant the work for a cycle begins.
const LEAD: DurationNs = DurationNs::from_micros(200);

/// How long an update is on its way.
const LATENCY: DurationNs = DurationNs::from_micros(700);

/// Bytes for the values of a drive.
const TELEGRAM: usize = 64;

/// When it begins.
const START: MonotonicTime = MonotonicTime(1_000_000_000_000);

/// System time less local clock then.
const EPOCH: u64 = 1_700_000_000_000_000_000;

/// Updates of a motion and of the rest behind it, which is long enough for everything that was under way to end.
const MOTION: u64 = 400;
const REST: u64 = 16;

/// Updates at the end of a motion in which it comes to rest.
const BRAKING: u64 = 30;

/// Most updates lost in a row: what is ridden through. So many have to come behind them.
const LOST_MAX: u64 = 4;
const GOOD_MIN: u64 = 8;

/// Counts that the speed changes by in a period, and its most: 20 revolutions of the turntable in a second.
const CHANGE: i64 = 4_000;
const SPEED: i64 = 80_000;

/// Cycles in CI for each axis, and in the long run.
const SHORT: u64 = 250_000;
const LONG: u64 = 100_000_000;

/// The system time of the grandmaster: it drifts against the local clock, by another rate every now and then, and steps.
struct Master {
    since: MonotonicTime,
    system: SystemTime,
    ppb: i64,
}

impl Master {
    fn at(&self, now: MonotonicTime) -> SystemTime {
        let passed = now.since(self.since);
        self.system + passed + DurationNs(passed.as_nanos() / 1_000_000 * self.ppb / 1_000)
    }

    fn change(&mut self, now: MonotonicTime, ppb: i64, step: DurationNs) {
        (self.system, self.since, self.ppb) = (self.at(now) + step, now, ppb);
    }
}

/// An axis of the engine between a controller that counts and a drive that is always where it is told to be.
struct Path {
    name: String,
    channel: AxisChannel,
    cip: CipAxis,
    order: AxisCommandImage,
    image: DriveImage,
    time: TimeBase,
    master: Master,
    random: Random,
    now: MonotonicTime,
    /// From the drive and to it.
    feedback: [u8; TELEGRAM],
    telegram: [u8; TELEGRAM],
    actual: Field,
    command: Field,
    /// Counts after which the drive's counter begins anew; those of a cycle of the axis.
    modulo: i64,
    unwind: Option<i64>,
    /// Counts of the controller in a unit.
    resolution: i128,
    /// How far the controller goes, in counts: a drive whose positions end has to turn round.
    far: i64,
    /// The controller: counts, counts in a period, and the next update.
    commanded: i64,
    speed: i64,
    wanted: i64,
    number: u64,
    /// The start of its next update period by the local clock, and what of a nanosecond is left of those before, in thousand millionths.
    tick: MonotonicTime,
    rest: i64,
    /// Updates that are to be lost, and those that have come since the last one that was.
    lost: u64,
    good: u64,
    /// The drive: counts as its counter has them, and all of them since the start.
    raw: i64,
    counts: i128,
    begun: i64,
    compared: u64,
    wraps: u64,
    /// How far the controller has been, in counts.
    farthest: i64,
}

fn field<'f>(mut fields: impl Iterator<Item = &'f Field>, signal: Signal) -> Field {
    *fields.find(|field| field.signal == signal).expect("every drive here has positions")
}

/// Two thirds of the way to the end of a drive's positions, in counts of the controller.
fn end(field: &Field, count: i64) -> i64 {
    let ratio = field.conversion.ratio;
    let nanounits = i128::from(i32::MAX) * i128::from(ratio.den()) / i128::from(ratio.num()).max(1);
    i64::try_from(nanounits.abs() / i128::from(count) * 2 / 3).unwrap_or(i64::MAX)
}

fn number(field: &Field, telegram: &[u8]) -> i64 {
    let at = usize::from(field.offset);
    let mut bytes = [0; 4];
    bytes.copy_from_slice(&telegram[at..at + 4]);
    i64::from(i32::from_le_bytes(bytes))
}

impl Path {
    fn new(axis: &StageAxis, (resolution, unwind): (i128, Option<i64>), seed: u64) -> Self {
        let south: DriveProgram = axis.south.clone();
        let actual = field(south.feedback.fields(), Signal::PositionActual);
        let command = field(south.command.fields(), Signal::PositionCommand);
        let mut channel = AxisChannel::new(AxisLimits::default(), Reaction::DecelerateAndDisable, true);
        channel.set_count(axis.north.count());
        channel.set_south(south.clone());
        channel.keep_updates(Updates { period: PERIOD, may_miss: 4, first: TargetUpdate::Interpolate });
        let order = AxisCommandImage {
            state: AxisState::Running,
            action: DriveAction::Enable,
            action_id: 1,
            reset_id: 0,
            abort: None,
            command: Command::Withheld(Withheld::NoSetPoint),
            test: None,
        };
        let master = Master { since: START, system: SystemTime(START.0 + EPOCH), ppb: 0 };
        let mut path = Self {
            name: axis.name.clone(),
            channel,
            cip: CipAxis::new(axis.north.clone()),
            order,
            image: DriveImage::default(),
            time: TimeBase::new(TimeSample { at: START, system: master.at(START), rate_ppb: 0 }),
            master,
            random: Random::new(seed),
            now: START,
            feedback: [0; TELEGRAM],
            telegram: [0; TELEGRAM],
            modulo: actual.modulo.unwrap_or(1 << 32),
            far: if command.modulo.is_some() { i64::MAX } else { end(&command, axis.north.count()) },
            actual,
            command,
            unwind,
            resolution,
            commanded: 0,
            speed: 0,
            wanted: 0,
            number: 0,
            tick: START,
            rest: 0,
            lost: 0,
            good: 0,
            raw: 0,
            counts: 0,
            begun: 0,
            compared: 0,
            wraps: 0,
            farthest: 0,
        };
        for report in [Report::Ready, Report::Operating] {
            let position = OperatingMode::Position.into();
            assert!(south.write_status(report, position, StatusBits::empty(), &mut path.feedback));
            path.hear();
            path.hand_on(None);
            path.send();
        }
        assert_eq!(path.channel.state(), DriveState::Operating, "{}", path.name);
        path.cip.fill(&path.channel, &mut path.image);
        path.commanded = path.image.position;
        path.begun = path.commanded;
        path.raw = number(&path.actual, &path.feedback);
        path
    }

    fn system(&self) -> SystemTime {
        self.time.system_at(self.now)
    }

    fn hand_on(&mut self, target: Option<MonotonicTime>) {
        let at = (self.now, self.system());
        self.cip.command(&mut self.channel, at, &self.order, target);
    }

    fn hear(&mut self) {
        let received = Received { data: &self.feedback, fresh: true, at: None, alive: true };
        self.channel.from_drive(self.now, self.system(), self.now, Some(received));
    }

    fn send(&mut self) {
        let at = self.now + LEAD;
        let ahead = CYCLE + LEAD;
        let cycle = Cycle { acts_at: at + CYCLE, span: CYCLE, ahead, late: DurationNs::ZERO };
        let system = self.system();
        assert!(self.channel.to_drive(self.now, system, &cycle, Some(&mut self.telegram)));
    }

    /// A cycle of the bus: the drive's telegram, the controller's updates, the telegram to the drive.
    fn cycle(&mut self) {
        self.now = self.now + CYCLE;
        self.keep_time();
        self.hear();
        let mut target = None;
        while self.tick + LATENCY <= self.now {
            target = self.update().or(target);
        }
        self.hand_on(target);
        self.send();
        // The drive has taken what it was told, and is there.
        let raw = number(&self.command, &self.telegram);
        let modulo = self.modulo;
        let way = (raw - self.raw + modulo / 2).rem_euclid(modulo) - modulo / 2;
        self.wraps += u64::from(raw - self.raw != way);
        self.counts += i128::from(way);
        self.raw = raw;
        let at = usize::from(self.actual.offset);
        let bytes: [u8; 4] = self.telegram[usize::from(self.command.offset)..][..4].try_into().expect("four");
        self.feedback[at..at + 4].copy_from_slice(&bytes);
    }

    /// Samples of the grandmaster come with some microseconds of noise; its rate changes every few seconds, and it steps: the controller
    /// tells the device, so its stamps are of the same time as the device's until both have seen the step.
    fn keep_time(&mut self) {
        if self.random.below(4_000) == 0 {
            let ppb = i64::try_from(self.random.below(400_000)).expect("small") - 200_000;
            let step = match self.random.below(8) {
                0 => i64::try_from(self.random.below(3_600_000_000_000)).expect("fits"),
                1 => -i64::try_from(self.random.below(20_000_000)).expect("small"),
                2 => 90_000,
                _ => 0,
            };
            self.master.change(self.now, ppb, DurationNs(step));
        }
        let noise = i64::try_from(self.random.below(4_001)).expect("small") - 2_000;
        let system = self.master.at(self.now) + DurationNs(noise);
        self.time.feed(&TimeSample { at: self.now, system, rate_ppb: self.master.ppb });
    }

    /// The controller's next update; its target on the local clock, unless it is lost.
    fn update(&mut self) -> Option<MonotonicTime> {
        let start = self.tick;
        // Its period is that of the master.
        self.rest += PERIOD.as_nanos() * self.master.ppb;
        let whole = self.rest / 1_000_000_000;
        self.rest -= whole * 1_000_000_000;
        self.tick = start + PERIOD - DurationNs(whole);
        self.number += 1;
        let phase = self.number % (MOTION + REST);
        if phase >= MOTION - BRAKING {
            self.wanted = 0;
        } else if self.random.below(40) == 0 {
            // More to one side than to the other: in the long run counters wrap.
            let speed = i64::try_from(self.random.below(160_001)).expect("small") - SPEED / 2;
            let turns = self.commanded.abs() > self.far;
            self.wanted = if turns { -SPEED * self.commanded.signum() } else { speed };
        }
        self.speed += (self.wanted.clamp(-SPEED, SPEED) - self.speed).clamp(-CHANGE, CHANGE);
        self.commanded += self.speed;
        self.farthest = self.farthest.max(self.commanded.abs());
        if phase + 1 == MOTION + REST {
            self.compare();
        }
        if self.lost == 0 && self.good >= GOOD_MIN && self.random.below(100) == 0 {
            self.lost = 1 + self.random.below(LOST_MAX);
        }
        if self.lost > 0 {
            self.lost -= 1;
            self.good = 0;
            return None;
        }
        self.good += 1;
        let sequence = match self.order.command {
            Command::Follow(points) => points.sequence.wrapping_add(1),
            Command::Withheld(_) => 0,
        };
        let stamp = self.time.system_at(start);
        let target = stamp + PERIOD * 2;
        self.order.command = Command::Follow(SetPoints {
            control_mode: ControlMode::POSITION,
            feedback_mode: FeedbackMode(2),
            values: self.values(),
            trims: Trims::default(),
            target: CommandTarget::INTERPOLATE,
            time_stamp: Some(stamp.0),
            target_time: Some(target.0),
            paced_at: self.now,
            position_reference: 0,
            sequence,
            age_updates: 0,
        });
        Some(self.time.target_at(target))
    }

    /// What the update carries: a DINT, of which the last 32 bits travel, or the place in the cycle of the axis with its number.
    fn values(&self) -> CommandValues {
        let [a, b, c, d, ..] = self.commanded.to_le_bytes();
        let rolled = CommandPosition::Integer(i32::from_le_bytes([a, b, c, d]));
        let (position, unwind_count) = match self.unwind {
            None => (rolled, None),
            Some(unwind) => {
                let cycles = i32::try_from(self.commanded.div_euclid(unwind)).expect("a DINT of cycles");
                let place = f64_from_i64(self.commanded.rem_euclid(unwind));
                (CommandPosition::Float(place), Some(cycles))
            }
        };
        CommandValues { position: Some(position), unwind_count, ..CommandValues::default() }
    }

    /// At the end of a rest: the drive and what the controller is told of it against what it has commanded.
    fn compare(&mut self) {
        assert_eq!(self.channel.fault(), None, "{} after {} updates", self.name, self.number);
        self.cip.fill(&self.channel, &mut self.image);
        // The drive by exact arithmetic: counts of its own to counts of the controller.
        let ratio = self.actual.conversion.ratio;
        let nanounits = self.counts * i128::from(ratio.num()) / i128::from(ratio.den());
        let wanted = i128::from(self.commanded - self.begun) * 1_000_000_000 / self.resolution;
        // A count of the coarser side, in nanounits.
        let drive = (i128::from(ratio.num()) / i128::from(ratio.den())).abs() + 1;
        let allowed = drive.max(1_000_000_000 / self.resolution + 1);
        let off = nanounits - wanted;
        assert!(off.abs() <= allowed, "{}: {off} nanounits off after {} updates", self.name, self.number);
        let told = i128::from(self.image.position - self.commanded) * 1_000_000_000 / self.resolution;
        assert!(
            told.abs() <= allowed,
            "{}: the controller is told {told} nanounits more than it wants",
            self.name
        );
        self.compared += 1;
    }
}

/// The axes, and what is special about each: a turntable and a slide on SERCOS, an axis that is unwound, and a CiA 402 drive.
fn paths() -> Vec<Path> {
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let config = Config::parse(include_str!("../../frames/config.toml"), "config.toml").expect("sound");
    let sercos = Stage::rehearse(&config, mapping.clone()).expect("its drives");
    let can = can_frames::stage(mapping).expect("its drives");
    // As both configurations have it.
    let scaling = |axis: &StageAxis| match axis.name.as_str() {
        "turntable" => (1_000_000, None),
        "slide" => (10_000, None),
        _ => (360_000, Some(360_000)),
    };
    let axes = sercos.axes.iter().chain(&can.axes);
    axes.zip(1..).map(|(axis, seed)| Path::new(axis, scaling(axis), seed)).collect()
}

fn run(cycles: u64) {
    let paths = paths();
    assert!(paths.len() >= 4, "drives of both profiles: {}", paths.len());
    let (mut counters, mut commands) = (0, 0);
    for mut path in paths {
        let begin = Instant::now();
        for _ in 0..cycles {
            path.cycle();
        }
        let least = cycles / 2 / (MOTION + REST) - 1;
        assert!(path.compared >= least, "{}: {} comparisons", path.name, path.compared);
        assert!(path.time.steps() > 0 || cycles < 100_000, "{}: no step of the clock", path.name);
        counters += path.wraps;
        commands += u32::from(path.unwind.is_none() && path.farthest > i64::from(i32::MAX));
        println!(
            "{:<10} {cycles} cycles, {} comparisons, {} steps of the clock, {} wraps of the drive's counter, {:.1} s",
            path.name,
            path.compared,
            path.time.steps(),
            path.wraps,
            begin.elapsed().as_secs_f64(),
        );
    }
    assert!(counters > 0 && commands > 0, "nothing wraps: {counters} counters, {commands} commands");
}

#[test]
fn a_million_cycles_leave_no_drift_between_controller_and_drive() {
    run(SHORT);
}

#[test]
#[ignore = "takes minutes; see the head of this file"]
fn a_hundred_million_cycles_leave_no_drift_between_controller_and_drive() {
    run(LONG);
}

/// Far enough to both sides for the drive's counter to wrap more than once on the way.
const FAR: f64 = 1_900.0;

/// 40 revolutions in a second.
const FAST: Limits = Limits { velocity: 40.0, acceleration: 400.0, jerk: 8_000.0 };

/// Moves of the whole chain in CI: some 50 000 cycles each.
const MOVES: usize = 3;

/// From one grandmaster to the next.
const MASTER_LASTS: DurationNs = DurationNs::from_millis(9_000);

/// The whole chain: one update in a hundred is lost either way, and every nine seconds another grandmaster takes over, of which the gateway
/// learns a second after the controller.
#[test]
fn the_whole_chain_ends_where_the_controller_wants_it() {
    let begin = Instant::now();
    let chain = Chain { bus: Bus::Sercos, synchronous: true };
    let mut rig = chain.endless();
    // An update that is lost in an acceleration is a step of the speed: other tables are about that.
    rig.motion_checker.record();
    rig.knobs = Knobs { loss: 10, ..Knobs::GOOD };
    let mut program = vec![Step::Enable(AXIS)];
    let mut ends = Vec::new();
    for number in 0..MOVES {
        let position = if number.is_multiple_of(2) { FAR } else { -FAR } + 0.123_456;
        ends.push(position);
        program.push(Step::MoveAbsolute { axis: 1, position, limits: FAST });
        program.push(Step::Dwell { seconds: 0.5 });
    }
    let mut config = chain.controller(&rig);
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    make_cyclic(&mapping, &mut config.axes[0], 1_000_000);
    rig.connect_with(config, program);
    let mut probe = Probe::new(&mut rig, chain.bus, chain.cycle());
    let (mut random, mut next, mut compared) = (Random::new(5), rig.now() + MASTER_LASTS, 0);
    let mut late = None;
    while compared < MOVES {
        probe.run_for(&mut rig, DurationNs::from_millis(50));
        assert_eq!(rig.report().failure, None);
        if rig.now() >= next {
            let mut master = rig.controller_clock.clone();
            let micros = i64::try_from(random.below(30_000)).expect("small") - 15_000;
            let ppm = i64::try_from(random.below(400)).expect("small") - 200;
            master.step(rig.now(), DurationNs::from_micros(micros));
            master.drift(rig.now(), ppm * 1_000);
            rig.controller_clock.follow(rig.now(), &master);
            late = Some((rig.now() + DurationNs::from_millis(1_000), master));
            next = rig.now() + MASTER_LASTS;
        }
        if let Some((_, master)) = late.take_if(|(at, _)| *at <= rig.now()) {
            rig.gateway_clock.follow(rig.now(), &master);
        }
        // A move has ended, and its dwell has begun.
        let ended = rig.report().steps_finished / 2;
        if ended > compared {
            probe.run_for(&mut rig, DurationNs::from_millis(300));
            let wanted = ends[compared] * 1e9;
            let taken = probe.taken.last().expect("set-points").position;
            let told = probe.reported().last().expect("updates").position;
            let drive = f64_from_i64(rig.position(0));
            for (what, position) in [("the set-point", taken), ("the drive", drive), ("what is told", told)] {
                let off = position - wanted;
                assert!(off.abs() <= COUNT.max(probe.count()), "{what} is {off} nanounits off at {wanted}");
            }
            compared = ended;
            probe.restart();
        }
    }
    let cycles = rig.elapsed().as_nanos() / chain.cycle().as_nanos();
    println!("{cycles} cycles of the whole chain, {:.0} s", begin.elapsed().as_secs_f64());
}
