//! Faults and losses of axes that a programmable controller moves through assemblies: state x event -> reaction.
//!
//! In each row the axis is in a state, an event comes, and what the axis does of itself is looked at for a while, with the motion checker
//! beside it. Then the controller does everything that must not move an axis that has stopped: it connects again, runs, and holds
//! ENABLE and START. Only after that comes what an orderly controller does: a word of 0, RESET, ENABLE, START.
//!
//! A new row is another element of [`events`], or of a list in [`table`].

use std::fmt::Write as _;

use axisbridge_tests::rig::Rig;
use axisbridge_tests::rig::motion_checker::violation::{Rule as MotionRule, Violation as MotionViolation};
use axisbridge_tests::rig::plc::Plc;
use profile_cip::assembly::Refusal;
use profile_cip::assembly::handshake::{Control, Status};
use profile_cip::device::motion_device::SyncState;
use profile_generic::cast::{f64_from_i64, i64_from_f64};
use profile_generic::fault::FaultCause;
use profile_generic::time::{DurationNs, MonotonicTime};
use profile_sercos::checker::checked_bus::{CheckedBus, Tried};
use profile_sercos::checker::{Rule, Violation};

use crate::chain::{Bus, Chain};
use crate::trouble::Trouble;

const NANO: i64 = 1_000_000_000;
/// Counts in a revolution.
const TURN: i64 = 1_000_000;

/// Velocity and acceleration of the motion, in revolutions, and its target.
const VELOCITY: i64 = 2;
const ACCELERATION: i64 = 20;
const TARGET: i64 = 20;

/// The limits of the axis: the motion checker holds every set-point to them.
const LIMITS: &str = "velocity = 5.0\nacceleration = 30.0\n";

/// How long a row is looked at before the controller does anything, ms.
const LOOK: i64 = 1_500;

/// How long everything that must not move the axis goes on, ms: drives that were gone come back meanwhile.
const LEVEL: i64 = 4_000;

/// Way that counts as none, and the same of an axis whose drive counts anew, in nanounits.
const NO_WAY: i64 = NANO / 500;

/// Slower than this is standing, in nanounits per second.
const REST: i64 = NANO / 100;

/// Where the set-points come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Operation {
    /// The generator of the gateway, to a target.
    Target,
    /// Each update, for the instant of its stamp.
    Stamped,
    /// Each update, for as soon as possible.
    Unstamped,
}

impl Operation {
    const fn name(self) -> &'static str {
        match self {
            Self::Target => "target",
            Self::Stamped => "stamped",
            Self::Unstamped => "unstamped",
        }
    }

    const fn mode(self) -> i64 {
        if matches!(self, Self::Target) { 1 } else { 3 }
    }
}

/// The axis when the event comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum During {
    /// It can be enabled.
    Armed,
    /// It is enabled and stands.
    Standing,
    /// It is on its way at full speed.
    Moving,
    /// STOP brakes it.
    Braking,
}

/// A controller that goes on with what it does, whatever the gateway says.
struct Bench {
    plc: Plc,
    chain: Chain,
    operation: Operation,
    /// Since when the set-points of a cyclic operation move, and from where, in counts.
    begun: Option<(MonotonicTime, i64)>,
    /// Where it stands, in counts.
    held: Option<i64>,
    /// Added to the stamps, and to the set-points.
    skew: DurationNs,
    jump: i64,
    /// What was seen since the event.
    seen: Seen,
}

/// What was seen since the event.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    since: Option<(MonotonicTime, i64)>,
    fault: Option<(DurationNs, FaultCause)>,
    /// When it moved for the last time.
    moved: Option<DurationNs>,
    /// When it had torque for the last time.
    torque: Option<DurationNs>,
    refusal: Option<Refusal>,
}

impl Tried for Bench {
    fn checked(&mut self) -> &mut CheckedBus {
        &mut self.plc.rig.checked
    }
}

impl Bench {
    fn new(chain: Chain, operation: Operation) -> Self {
        let rig = chain.ready_for_assemblies("{ layout = \"mixed\" }", LIMITS);
        let mut plc = Plc::on(rig, chain.period());
        plc.connect();
        plc.set(0, "mode", operation.mode());
        let seen = Seen::default();
        let mut bench =
            Self { plc, chain, operation, begun: None, held: None, skew: DurationNs::ZERO, jump: 0, seen };
        bench.run_for(60);
        bench
    }

    /// Brings the axis into the state.
    fn reach(&mut self, during: During) {
        if during == During::Armed {
            return;
        }
        self.plc.word(Control::ENABLE);
        assert!(self.until(2_000, |plc| plc.is(Status::ENABLED)), "{}", self.plc.rig.told());
        if during == During::Standing {
            return self.run_for(100);
        }
        self.go();
        self.run_for(500);
        // As the drive reports it: what has no interpolation of its own moves in steps.
        let speed = self.plc.get(0, "actual_velocity");
        assert!((speed - VELOCITY * TURN).abs() < TURN / 20, "{speed}\n{}", self.plc.rig.told());
        if during == During::Braking {
            self.plc.word(Control::ENABLE | Control::STOP);
            let slower = |plc: &Plc| plc.get(0, "actual_velocity") < VELOCITY * TURN - TURN / 20;
            assert!(self.until(200, slower), "{}", self.plc.rig.told());
        }
    }

    /// Begins the motion.
    fn go(&mut self) {
        match self.operation {
            Operation::Target => {
                self.plc.set(0, "target_position_64", TARGET * TURN);
                self.plc.set(0, "velocity", VELOCITY * TURN);
                self.plc.set(0, "acceleration", ACCELERATION * TURN);
                self.plc.word(Control::ENABLE | Control::START);
            }
            Operation::Stamped | Operation::Unstamped => {
                // From the instant on for which the next set-point is.
                let from = self.held.unwrap_or(0);
                self.begun = Some((self.plc.rig.now() + self.ahead(), from));
            }
        }
    }

    /// How far ahead of its instant a set-point is sent.
    fn ahead(&self) -> DurationNs {
        if self.operation == Operation::Stamped { self.plc.interval * 3 } else { DurationNs::ZERO }
    }

    /// The set-point of an axis that stands: where it is until it is enabled, and the same place from then on.
    fn hold(&mut self) -> i64 {
        let shown = self.plc.inputs.borrow().last().is_some().then(|| self.plc.get(0, "actual_position_64"));
        if !shown.is_some_and(|_| self.plc.is(Status::ENABLED)) {
            self.held = shown;
        }
        self.held.unwrap_or(0)
    }

    /// Target and stamp of the next update.
    fn prepare(&mut self) {
        if self.operation == Operation::Target {
            return;
        }
        let ahead = self.ahead();
        let here = match self.begun {
            Some((since, from)) => from + curve(self.plc.rig.now().since(since) + ahead),
            None => self.hold(),
        };
        self.plc.set(0, "target_position_64", here.saturating_add(self.jump));
        if self.operation == Operation::Stamped {
            let stamp = self.plc.rig.system() + ahead + self.skew;
            self.plc.set(0, "time_stamp", stamp.0.cast_signed());
        }
    }

    /// One interval in which nothing is sent.
    fn pass(&mut self) {
        self.pass_until(self.plc.rig.now() + self.plc.interval);
    }

    fn pass_until(&mut self, end: MonotonicTime) {
        while self.plc.rig.now() < end {
            self.plc.rig.step();
            self.look();
        }
    }

    fn scan(&mut self) {
        self.prepare();
        let data = self.plc.data();
        self.plc.send(&data);
        self.pass();
    }

    fn run_for(&mut self, millis: i64) {
        let end = self.plc.rig.now() + DurationNs::from_millis(millis);
        while self.plc.rig.now() < end {
            self.scan();
        }
    }

    fn until(&mut self, millis: i64, done: impl Fn(&Plc) -> bool) -> bool {
        let end = self.plc.rig.now() + DurationNs::from_millis(millis);
        while self.plc.rig.now() < end && !done(&self.plc) {
            self.scan();
        }
        done(&self.plc)
    }

    fn look(&mut self) {
        let Some((since, _)) = self.seen.since else { return };
        let after = self.plc.rig.now().since(since);
        if let Some(fault) = self.plc.rig.engine.axes()[0].fault()
            && self.seen.fault.is_none()
        {
            self.seen.fault = Some((after, fault.cause));
        }
        if self.plc.speed().abs() > REST {
            self.seen.moved = Some(after);
        }
        if !self.plc.rig.torque_free() {
            self.seen.torque = Some(after);
        }
        let refusal = self.plc.refusal();
        if refusal != Refusal::NONE && self.seen.refusal.is_none() {
            self.seen.refusal = Some(refusal);
        }
    }

    /// Sends an update on its way of which nothing arrives.
    fn lose(&mut self, count: u32) {
        for _ in 0..count {
            self.plc.sent += 1;
            self.pass();
        }
    }

    fn is_owner(&self) -> bool {
        self.plc.rig.engine.assemblies()[0].owner().is_some()
    }
}

/// Counts of the motion after a time: up to full speed, and on.
fn curve(span: DurationNs) -> i64 {
    let seconds = f64_from_i64(span.as_nanos()).max(0.0) / 1e9;
    let (velocity, acceleration) = (f64_from_i64(VELOCITY), f64_from_i64(ACCELERATION));
    let fast = velocity / acceleration;
    let turns = if seconds < fast {
        acceleration * seconds * seconds / 2.0
    } else {
        velocity * (seconds - fast / 2.0)
    };
    i64_from_f64((turns * f64_from_i64(TURN)).round())
}

/// What an event does; what lasts for good is undone by the second function.
struct Event {
    name: String,
    /// It goes on until it is ended.
    lasts: bool,
    /// Set-points that break a rule of the motion checker in this way are part of it.
    breaks: Option<fn(&MotionViolation) -> bool>,
    begin: Box<dyn Fn(&mut Bench)>,
    end: Box<dyn Fn(&mut Bench)>,
}

fn event(name: impl Into<String>, begin: impl Fn(&mut Bench) + 'static) -> Event {
    Event { name: name.into(), lasts: false, breaks: None, begin: Box::new(begin), end: Box::new(|_| {}) }
}

impl Event {
    /// One in which rules of the motion checker are broken: by a drive that does not get what was sent, by an engine that is not there, or
    /// by set-points that are not those of a motion before the gateway stops the axis for it.
    fn rough(self) -> Self {
        Self { breaks: Some(|_| true), ..self }
    }

    /// One in which the gateway leaves cycles out. On CANopen their way comes in one SYNC period, because a drive interpolates from
    /// one SYNC to the next: the acceleration of that set-point alone is another one. On the other buses every rule is held.
    fn leaves_out_cycles(self, bus: Bus) -> Self {
        let is = |violation: &MotionViolation| {
            violation.rule == MotionRule::Acceleration && violation.circumstances.late > DurationNs::ZERO
        };
        match bus {
            Bus::Canopen => Self { breaks: Some(is), ..self },
            Bus::Sercos | Bus::Devicenet => self,
        }
    }
}

fn lasting(
    name: impl Into<String>,
    begin: impl Fn(&mut Bench) + 'static,
    end: impl Fn(&mut Bench) + 'static,
) -> Event {
    Event { name: name.into(), lasts: true, breaks: None, begin: Box::new(begin), end: Box::new(end) }
}

/// Events on the side of the controller.
fn north(bus: Bus) -> Vec<Event> {
    let lost = |count| event(format!("updates lost: {count}"), move |bench| bench.lose(count));
    vec![
        lost(1),
        lost(2),
        lost(3),
        event("silence", |bench| bench.lose(8)),
        event("each update twice", |bench| {
            for _ in 0..10 {
                bench.prepare();
                let data = bench.plc.data();
                bench.plc.send(&data);
                let [low, high, ..] = bench.plc.sent.to_le_bytes();
                bench.plc.send_as(bench.plc.sent, u16::from_le_bytes([low, high]), &data);
                bench.pass();
            }
        }),
        event("an update overtaken", |bench| {
            bench.prepare();
            let held = bench.plc.data();
            bench.plc.sent += 1;
            let number = bench.plc.sent;
            bench.pass();
            bench.scan();
            let [low, high, ..] = number.to_le_bytes();
            bench.plc.send_as(number, u16::from_le_bytes([low, high]), &held);
            bench.scan();
        }),
        event("sequence count stands still: 20", |bench| {
            let [low, high, ..] = bench.plc.sent.to_le_bytes();
            for _ in 0..20 {
                bench.prepare();
                let data = bench.plc.data();
                bench.plc.sent += 1;
                bench.plc.send_as(bench.plc.sent, u16::from_le_bytes([low, high]), &data);
                bench.pass();
            }
        }),
        event("idle: 1", |bench| {
            bench.plc.run = false;
            bench.scan();
            bench.plc.run = true;
        }),
        event("idle", |bench| bench.plc.run = false),
        event("closed", |bench| bench.plc.close()),
        event("closed and opened", |bench| {
            bench.plc.close();
            bench.plc.connect();
        }),
        event("a byte too few: 1", |bench| {
            let data = bench.plc.data();
            bench.plc.send(&data[..data.len() - 1]);
            bench.pass();
        }),
        event("a byte too many: 8", |bench| {
            for _ in 0..8 {
                let data = [&bench.plc.data()[..], &[0]].concat();
                bench.plc.send(&data);
                bench.pass();
            }
        }),
        event("a second owner", |bench| {
            let (point, sizes) = bench.plc.owner();
            bench.scan();
            let next = bench.plc.rig.now() + bench.plc.interval;
            assert_eq!(bench.plc.ask_open(point, sizes).1, 0x106, "ownership conflict");
            // The request has taken time; the next update comes on the grid of those before.
            bench.plc.sent += 1;
            bench.pass_until(next);
        }),
        event("another address sends", |bench| {
            let address = std::mem::replace(&mut bench.plc.address, [10, 0, 0, 77].into());
            for _ in 0..8 {
                bench.scan();
            }
            bench.plc.address = address;
        }),
        event("reserved bit", |bench| {
            bench.plc.word(Control::from_bits_retain(0x0101));
            bench.scan();
            bench.plc.word(Control::ENABLE);
        }),
        event("RESET with ENABLE", |bench| bench.plc.word(Control::ENABLE | Control::RESET)),
        event("START with STOP", |bench| {
            bench.plc.word(Control::ENABLE);
            bench.scan();
            bench.plc.word(Control::ENABLE | Control::START | Control::STOP);
        }),
        event("ENABLE off", |bench| bench.plc.word(Control::empty())),
        event("mode 5", |bench| bench.plc.set(0, "mode", 5)),
        event("mode 0", |bench| bench.plc.set(0, "mode", 0)),
        event("mode 9", |bench| bench.plc.set(0, "mode", 9)),
        event("the gateway pauses for 6 ms", |bench| pause(bench, 6)).leaves_out_cycles(bus),
        // Drives come back as after a silence.
        lasting("the gateway pauses for 60 ms", |bench| pause(bench, 60), |_| {}).leaves_out_cycles(bus),
    ]
}

fn pause(bench: &mut Bench, millis: i64) {
    let until = bench.plc.rig.now() + DurationNs::from_millis(millis);
    bench.plc.rig.wake_ups.pause(until);
}

/// Events of the set-points themselves.
fn cyclic() -> Vec<Event> {
    let skewed = |name: &str, millis: i64, count: i32| {
        let name = if count > 0 { format!("{name}: {count}") } else { name.to_owned() };
        event(name, move |bench| {
            bench.skew = DurationNs::from_millis(millis);
            if count > 0 {
                (0..count).for_each(|_| bench.scan());
                bench.skew = DurationNs::ZERO;
            }
        })
    };
    let jumps = |name: &str, counts: i64, count: i32| {
        event(name, move |bench| {
            bench.jump = counts;
            if count > 0 {
                (0..count).for_each(|_| bench.scan());
                bench.jump = 0;
            }
        })
    };
    vec![
        skewed("stamps a second old", -1_000, 1),
        skewed("stamps a second old", -1_000, 0),
        skewed("stamps a second ahead", 1_000, 1),
        skewed("stamps a second ahead", 1_000, 0),
        skewed("stamps an hour ahead", 3_600_000, 0),
        skewed("stamps 5 ms late", -5, 0).rough(),
        jumps("a jump by a turn: 1", TURN, 1),
        jumps("a jump by a turn", TURN, 0),
        jumps("a jump beyond 64 bits", i64::MAX / 2, 0),
        lasting(
            "time not synchronized any more",
            |bench| set_synchronized(&mut bench.plc.rig, false),
            |bench| set_synchronized(&mut bench.plc.rig, true),
        ),
        event("system time steps by 20 ms", |bench| {
            let now = bench.plc.rig.now();
            bench.plc.rig.gateway_clock.step(now, DurationNs::from_millis(20));
        }),
    ]
}

fn set_synchronized(rig: &mut Rig, synchronized: bool) {
    let grandmaster = synchronized.then_some(axisbridge::simulate::setup::HOST_CLOCK);
    rig.engine.set_sync(SyncState { grandmaster, synchronized, offset: 0 });
}

/// Events on the side of the drive.
fn south(bus: Bus, cycle: DurationNs) -> Vec<Event> {
    let trouble = move |trouble: Trouble, millis: Option<i64>| {
        let name = match millis {
            None => trouble.name(),
            Some(0) => format!("{}: 1 telegram", trouble.name()),
            Some(millis) => format!("{}: {millis} ms", trouble.name()),
        };
        let begin = move |bench: &mut Bench| {
            trouble.begin(&mut bench.plc.rig, bus);
            if let Some(millis) = millis {
                let end = bench.plc.rig.now() + cycle.max(DurationNs::from_millis(millis));
                while bench.plc.rig.now() < end {
                    bench.scan();
                }
                trouble.end(&mut bench.plc.rig, bus);
            }
        };
        lasting(name, begin, move |bench: &mut Bench| {
            if millis.is_none() {
                trouble.end(&mut bench.plc.rig, bus);
            }
        })
    };
    vec![
        trouble(Trouble::Fault(FaultCause::OVER_CURRENT), Some(20)),
        trouble(Trouble::Fault(FaultCause::OVER_CURRENT), None),
        trouble(Trouble::Fault(FaultCause::EXTERNAL_INPUT), Some(20)),
        trouble(Trouble::Fault(FaultCause::EXTERNAL_INPUT), None),
        trouble(Trouble::MainPower, None),
        trouble(Trouble::Silence, Some(0)).rough(),
        trouble(Trouble::Silence, Some(60)),
        trouble(Trouble::Silence, None),
        trouble(Trouble::StaleData, Some(60)),
        trouble(Trouble::StaleData, None),
        trouble(Trouble::TorqueLost, None),
        trouble(Trouble::PositionJumpWithLimit, None),
    ]
}

/// A row: what the axis did of itself, and what brought it back.
fn row(bench: &mut Bench, during: During, event: &Event) -> String {
    bench.reach(during);
    if let Some(breaks) = event.breaks {
        bench.plc.rig.motion_checker.tolerate(&event.name, breaks);
    }
    let operation = bench.operation.name();
    let place = bench.plc.place();
    bench.seen = Seen { since: Some((bench.plc.rig.now(), place)), ..Seen::default() };
    (event.begin)(bench);
    bench.run_for(LOOK);
    let seen = std::mem::take(&mut bench.seen);
    let way = bench.plc.place() - place;
    // What a drive says of its fault comes later than the fault.
    let cause = bench.plc.rig.engine.axes()[0].fault().map(|fault| fault.cause);
    let goes_on = seen.fault.is_none() && bench.plc.is(Status::ENABLED);
    // An edge of ENABLE counts: there is nothing that it must not do.
    let armed = bench.is_owner() && seen.fault.is_none() && !bench.plc.is(Status::LOCKED);
    let off = bench.plc.rig.torque_free();
    let name = format!("{} {operation} {during:?}: {}", bench.chain, event.name);
    let then = match (goes_on, armed) {
        (true, _) => orderly_stop(bench),
        (false, true) => format!("armed; {}", recovery(bench, event, &name)),
        (false, false) => {
            stays_off(bench, event, off, &name);
            recovery(bench, event, &name)
        }
    };
    let ms = |span: DurationNs| span.as_nanos() / 1_000_000;
    let fault = seen
        .fault
        .map_or("-".to_owned(), |(after, first)| format!("{} at {}", cause.unwrap_or(first), ms(after)));
    let rest = match (goes_on && seen.moved.is_some_and(|at| ms(at) > LOOK - 100), seen.moved) {
        (true, _) => "moves on".to_owned(),
        (false, None) => "stands".to_owned(),
        (false, Some(at)) => format!("{} ms, {:.2} rev", ms(at), f64_from_i64(way) / 1e9),
    };
    let torque = match (off, seen.torque) {
        (false, _) => "on".to_owned(),
        (true, None) if during == During::Armed => "none".to_owned(),
        (true, None) => "at once".to_owned(),
        (true, Some(at)) => format!("{} ms", ms(at)),
    };
    let refusal = seen.refusal.map_or("-".to_owned(), |refusal| refusal.to_string());
    format!(
        "{operation:<9} {during:<8} {:<31} {fault:<28} {rest:<18} {torque:<8} {refusal:<14} {then}",
        event.name,
        during = format!("{during:?}"),
    )
}

/// An axis that goes on ends by the words of its controller.
fn orderly_stop(bench: &mut Bench) -> String {
    bench.plc.word(Control::ENABLE | Control::STOP);
    bench.run_for(500);
    if bench.plc.speed().abs() > REST {
        return "STOP DOES NOT STOP IT".to_owned();
    }
    bench.plc.word(Control::empty());
    if bench.until(1_000, |plc| plc.rig.torque_free()) { "goes on".to_owned() } else { "STAYS ON".to_owned() }
}

/// Everything that must not move an axis that has stopped: ENABLE and START as levels, in run, on the same connection or a new one, while
/// its drive comes back.
fn stays_off(bench: &mut Bench, event: &Event, off: bool, name: &str) {
    let place = bench.plc.place();
    bench.plc.run = true;
    bench.plc.word(Control::ENABLE | Control::START);
    let stays = |bench: &Bench| {
        assert!(!off || bench.plc.rig.torque_free(), "{name}: it has torque again\n{}", bench.plc.rig.told());
        let way = bench.plc.place() - place;
        assert!(way.abs() < NO_WAY, "{name}: it moved by {way}\n{}", bench.plc.rig.told());
    };
    for _ in 0..50 {
        bench.scan();
        stays(bench);
    }
    (event.end)(bench);
    if !bench.is_owner() {
        bench.plc.connect();
    }
    let level = if event.lasts { LEVEL } else { LEVEL / 4 };
    let end = bench.plc.rig.now() + DurationNs::from_millis(level);
    while bench.plc.rig.now() < end {
        bench.scan();
        stays(bench);
    }
}

/// What an orderly controller does: a word of 0, RESET, ENABLE, START.
fn recovery(bench: &mut Bench, event: &Event, name: &str) -> String {
    (event.end)(bench);
    bench.skew = DurationNs::ZERO;
    bench.jump = 0;
    bench.begun = None;
    bench.operation = Operation::Target;
    bench.plc.set(0, "mode", 1);
    bench.plc.set(0, "time_stamp", 0);
    bench.plc.word(Control::empty());
    bench.run_for(60);
    bench.plc.word(Control::RESET);
    if !bench.until(5_000, |plc| !plc.is(Status::FAULT)) {
        return format!("the fault stays: {}", bench.plc.fault());
    }
    bench.plc.word(Control::empty());
    bench.run_for(60);
    bench.plc.word(Control::ENABLE);
    if !bench.until(5_000, |plc| plc.is(Status::ENABLED)) {
        return format!("not enabled: {} {}", bench.plc.refusal(), bench.plc.fault());
    }
    let place = bench.plc.place();
    bench.plc.set(0, "target_position_64", TURN / 4);
    bench.plc.set(0, "velocity", TURN);
    bench.plc.set(0, "acceleration", 0);
    bench.plc.word(Control::ENABLE | Control::START | Control::RELATIVE);
    bench.scan();
    if !bench.until(3_000, |plc| plc.is(Status::START_TAKEN | Status::DONE)) {
        return format!("does not move: {} {}", bench.plc.refusal(), bench.plc.fault());
    }
    let way = bench.plc.place() - place;
    assert!((way - NANO / 4).abs() < NANO / 50, "{name}: it moved by {way} instead of a quarter");
    "moves again".to_owned()
}

fn table(bus: Bus) -> String {
    let chain = Chain { bus, synchronous: true };
    let mut text = format!(
        "{:<9} {:<8} {:<31} {:<28} {:<18} {:<8} {:<14} then\n",
        "set-points", "axis", "event", "fault at ms", "comes to rest", "torque", "refusal"
    );
    let mut rows = 0;
    let mut add = |operation: Operation, during: During, events: Vec<Event>| {
        for event in events {
            println!("{} {during:?} {}", operation.name(), event.name);
            let mut bench = Bench::new(chain, operation);
            // An engine that wakes up late sends its MST late.
            let late = |violation: &Violation| matches!(violation.rule, Rule::MstInterval { .. });
            let line = bench.tolerating(late, |bench| row(bench, during, &event));
            writeln!(text, "{line}").expect("a string takes everything");
            rows += 1;
        }
    };
    let both = || north(bus).into_iter().chain(south(bus, chain.cycle())).collect::<Vec<_>>();
    for during in [During::Armed, During::Standing, During::Moving, During::Braking] {
        add(Operation::Target, during, both());
    }
    for operation in [Operation::Stamped, Operation::Unstamped] {
        add(operation, During::Moving, both().into_iter().chain(cyclic()).collect());
    }
    println!("rows: {rows}");
    text
}

#[test]
fn sercos() {
    insta::assert_snapshot!(table(Bus::Sercos));
}

#[test]
fn canopen() {
    insta::assert_snapshot!(table(Bus::Canopen));
}

#[test]
fn devicenet_drives() {
    insta::assert_snapshot!(table(Bus::Devicenet));
}
