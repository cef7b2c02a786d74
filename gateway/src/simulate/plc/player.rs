//! Carries out steps on a connection.

use std::fmt;
use std::net::UdpSocket;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use profile_cip::assembly::Control;
use profile_cip::assembly::handshake::Status;

use super::line::{Counts, Line};
use super::session::Session;
use super::step::{Condition, Movement, Planned, Step, names};
use super::{HANDSHAKE, Images, Plan, PlcError, socket};

/// The device shows the refusal of an earlier order for so long after the next one.
const GRACE: Duration = Duration::from_millis(100);
/// The same in intervals.
const GRACE_INTERVALS: u32 = 5;

/// Modes of the axis.
const POSITION: u8 = 1;
const VELOCITY: u8 = 2;

/// The part of a velocity by which the actual one may differ when it counts as reached.
const REACHED: i64 = 20;

/// What happens.
#[derive(Debug)]
pub enum Event<'a> {
    /// A connection is open.
    Connected,
    /// A step begins.
    Begun(usize),
    /// It was carried out; the assemblies as they are.
    Done(usize, &'a Images),
    /// All axes are without torque, and the connection is closed.
    Closed,
}

/// What an axis showed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct AxisReport {
    /// Its actual position in the end, counts; `None` where the layout has none, or nothing came.
    pub position: Option<i64>,
    /// Its largest following error, counts.
    pub following_error_max: i64,
}

/// A run.
#[derive(Debug)]
pub struct Outcome {
    /// Its axes, in the order of the assemblies.
    pub axes: Vec<AxisReport>,
    /// Datagrams sent.
    pub cycles: u64,
    /// Datagrams of the device that did not come.
    pub lost: u64,
    /// Intervals without a datagram of the device.
    pub late: u64,
    /// Why it failed.
    pub failure: Option<Failure>,
}

/// Why a run failed.
#[derive(Debug)]
pub struct Failure {
    /// Number of the step, from 0; `None` before the first and behind the last one.
    pub step: Option<usize>,
    /// What went wrong.
    pub error: PlcError,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.step {
            Some(step) => write!(f, "step {}: {}", step + 1, self.error),
            None => write!(f, "{}", self.error),
        }
    }
}

/// Connects, carries out the steps, takes the torque of all axes away and closes.
pub fn run(plan: &Plan, steps: &[Planned], stop: &AtomicBool, report: &mut dyn FnMut(Event<'_>)) -> Outcome {
    let mut outcome = Outcome {
        axes: vec![AxisReport::default(); plan.names.len()],
        cycles: 0,
        lost: 0,
        late: 0,
        failure: None,
    };
    let images = Images::new(&plan.assemblies, &plan.counts);
    let session = match Session::open(plan.address) {
        Ok(session) => session,
        Err(error) => {
            outcome.failure = Some(Failure { step: None, error });
            return outcome;
        }
    };
    let mut player = Player {
        plan,
        images,
        session,
        line: None,
        stop,
        counts: Counts::default(),
        following_error_max: vec![0; plan.names.len()],
    };
    let mut failure = match player.connect() {
        Ok(()) => {
            report(Event::Connected);
            player.steps(steps, report)
        }
        Err(error) => Some(Failure { step: None, error }),
    };
    match player.end() {
        Ok(()) => report(Event::Closed),
        Err(error) => {
            failure.get_or_insert(Failure { step: None, error });
        }
    }
    let heard = player.counts.sent > player.counts.late;
    for (axis, report) in outcome.axes.iter_mut().enumerate() {
        report.position = player.images.position(axis).filter(|_| heard);
        report.following_error_max = player.following_error_max[axis];
    }
    let Counts { sent, lost, late } = player.counts;
    Outcome { cycles: sent, lost, late, failure, ..outcome }
}

struct Player<'a> {
    plan: &'a Plan,
    images: Images,
    session: Session,
    line: Option<Line>,
    stop: &'a AtomicBool,
    counts: Counts,
    following_error_max: Vec<i64>,
}

/// What is waited for.
#[derive(Clone, Copy)]
struct Wait<'a> {
    axes: &'a [usize],
    /// What the axes do meanwhile, in words.
    step: &'static str,
    within: Duration,
    /// A fault does not end it.
    with_faults: bool,
}

impl Player<'_> {
    fn steps(&mut self, steps: &[Planned], report: &mut dyn FnMut(Event<'_>)) -> Option<Failure> {
        for (number, planned) in steps.iter().enumerate() {
            report(Event::Begun(number));
            if let Err(error) = self.step(&planned.step, planned.within) {
                return Some(Failure { step: Some(number), error });
            }
            report(Event::Done(number, &self.images));
        }
        None
    }

    fn step(&mut self, step: &Step, within: Duration) -> Result<(), PlcError> {
        match step {
            Step::Enable(axes) => self.enable(axes, within),
            Step::Disable(axes) => self.disable(axes, within),
            Step::FaultReset(axes) => self.fault_reset(axes, within),
            Step::Stop(axes) => self.brake(axes, within),
            Step::Move { axis, movement, wait } => self.go(*axis, *movement, *wait, within),
            Step::Velocity { axis, velocity, acceleration, wait } => {
                self.follow(*axis, (*velocity, *acceleration), *wait, within)
            }
            Step::Word { axis, word } => {
                self.images.set_word(*axis, *word)?;
                self.interval()
            }
            Step::Set { axis, field, value } => {
                self.images.set(*axis, field, *value)?;
                self.interval()
            }
            Step::Dwell(span) => self.dwell(*span),
            Step::Idle(span) => {
                self.line.as_mut().ok_or(PlcError::Unconnected)?.run = false;
                let dwelt = self.dwell(*span);
                if let Some(line) = self.line.as_mut() {
                    line.run = true;
                }
                dwelt
            }
            Step::Silence(span) => self.silence(*span),
            Step::Close => self.close(),
            Step::Connect => self.connect(),
            Step::Expect { axis, condition } => self.expect(*axis, *condition, within),
        }
    }

    // ---- connection -----------------------------------------------------------------------------------------------

    fn connect(&mut self) -> Result<(), PlcError> {
        self.line = None;
        let io = UdpSocket::bind((self.session.local, 0)).map_err(socket("cannot open a UDP port"))?;
        let port = io.local_addr().map_err(socket("cannot open a UDP port"))?.port();
        let ids = self.session.forward_open(self.plan, port)?;
        self.line = Some(Line::new(io, ids));
        Ok(())
    }

    fn close(&mut self) -> Result<(), PlcError> {
        let line = self.line.take().ok_or(PlcError::Unconnected)?;
        self.session.forward_close(self.plan, line.ids)
    }

    /// One interval.
    fn interval(&mut self) -> Result<(), PlcError> {
        self.check_stop()?;
        self.exchange()
    }

    /// Fails once the controller is to stop.
    fn check_stop(&self) -> Result<(), PlcError> {
        if self.stop.load(Ordering::Relaxed) { Err(PlcError::Stopped) } else { Ok(()) }
    }

    fn exchange(&mut self) -> Result<(), PlcError> {
        let line = self.line.as_mut().ok_or(PlcError::Unconnected)?;
        line.exchange(self.plan, &mut self.images, &mut self.counts)?;
        for (axis, most) in self.following_error_max.iter_mut().enumerate() {
            let error = self.images.get(axis, "following_error").unwrap_or(0);
            *most = error.saturating_abs().max(*most);
        }
        Ok(())
    }

    /// Whether the input is what the device sends now.
    fn is_live(&self) -> bool {
        self.line.as_ref().is_some_and(|line| line.is_live(self.plan))
    }

    /// Takes the torque away, whatever came before; nothing stops this but its time. Then closes.
    fn end(&mut self) -> Result<(), PlcError> {
        if self.line.is_none() {
            return Ok(());
        }
        let axes: Vec<_> = (0..self.plan.names.len()).collect();
        let off = self.off(&axes);
        let closed = self.close();
        off.and(closed)
    }

    fn off(&mut self, axes: &[usize]) -> Result<(), PlcError> {
        for axis in axes {
            self.images.set_word(*axis, Control::empty())?;
        }
        let begun = Instant::now();
        loop {
            match self.exchange() {
                // The device may hear what it does not answer: it gets the words once more for as long as its own time-out lasts.
                Err(PlcError::ConnectionLost { limit }) if begun.elapsed() < limit => continue,
                other => other?,
            }
            let on = axes.iter().find(|axis| self.images.status(**axis).contains(Status::TORQUE));
            let Some(axis) = on else { return Ok(()) };
            if begun.elapsed() >= HANDSHAKE {
                let name = self.plan.name(*axis).to_owned();
                return Err(PlcError::Late { name, step: "lose its torque", limit: HANDSHAKE });
            }
        }
    }

    // ---- steps ----------------------------------------------------------------------------------------------------

    /// Sends a word to axes until `done` of each of them.
    fn until(
        &mut self,
        wait: Wait<'_>,
        word: Control,
        done: impl Fn(&Images, usize) -> bool,
    ) -> Result<(), PlcError> {
        for axis in wait.axes {
            self.images.set_word(*axis, word)?;
        }
        let begun = Instant::now();
        let mut intervals = 0;
        loop {
            self.interval()?;
            intervals += 1;
            let settled = intervals > GRACE_INTERVALS && begun.elapsed() > GRACE;
            let name = |axis: usize| self.plan.name(axis).to_owned();
            if self.is_live() {
                for &axis in wait.axes {
                    let status = self.images.status(axis);
                    if status.contains(Status::FAULT) && !wait.with_faults {
                        return Err(PlcError::Fault { name: name(axis), cause: self.images.fault(axis) });
                    }
                    if status.contains(Status::REFUSED) && settled && !done(&self.images, axis) {
                        let refusal = self.images.refusal(axis);
                        return Err(PlcError::Order { name: name(axis), step: wait.step, refusal });
                    }
                }
                if wait.axes.iter().all(|axis| done(&self.images, *axis)) {
                    return Ok(());
                }
            }
            if begun.elapsed() >= wait.within {
                let late = wait.axes.iter().find(|axis| !self.is_live() || !done(&self.images, **axis));
                let name = name(late.copied().unwrap_or(0));
                return Err(PlcError::Late { name, step: wait.step, limit: wait.within });
            }
        }
    }

    /// Sends a word of 0 until axes take orders.
    fn unlock(&mut self, wait: Wait<'_>) -> Result<(), PlcError> {
        self.until(Wait { step: "unlock", ..wait }, Control::empty(), |images, axis| {
            let status = images.status(axis);
            status.contains(Status::RUN) && !status.contains(Status::LOCKED)
        })
    }

    fn enable(&mut self, axes: &[usize], within: Duration) -> Result<(), PlcError> {
        let enable = Wait { axes, step: "enable", within, with_faults: false };
        self.unlock(enable)?;
        self.until(enable, Control::ENABLE, |images, axis| images.status(axis).contains(Status::ENABLED))
    }

    fn disable(&mut self, axes: &[usize], within: Duration) -> Result<(), PlcError> {
        let wait = Wait { axes, step: "lose its torque", within, with_faults: true };
        self.until(wait, Control::empty(), |images, axis| !images.status(axis).contains(Status::TORQUE))
    }

    fn fault_reset(&mut self, axes: &[usize], within: Duration) -> Result<(), PlcError> {
        let reset = Wait { axes, step: "reset its fault", within, with_faults: true };
        self.unlock(reset)?;
        self.until(reset, Control::RESET, |images, axis| !images.status(axis).contains(Status::FAULT))?;
        axes.iter().try_for_each(|axis| self.images.set_word(*axis, Control::empty()))?;
        self.interval()
    }

    /// Brakes. A velocity is 0 then, so that the end of STOP does not begin it anew.
    fn brake(&mut self, axes: &[usize], within: Duration) -> Result<(), PlcError> {
        let wait = Wait { axes, step: "stop", within, with_faults: false };
        self.until(wait, Control::ENABLE | Control::STOP, |images, axis| {
            let status = images.status(axis);
            status.contains(Status::STANDSTILL) && !status.contains(Status::MOVING)
        })?;
        for axis in axes {
            if self.images.find_output(*axis, "velocity").is_some() {
                self.images.set(*axis, "velocity", 0)?;
            }
            self.images.set_word(*axis, Control::ENABLE)?;
        }
        self.interval()
    }

    fn go(
        &mut self,
        axis: usize,
        movement: Movement,
        until_there: bool,
        within: Duration,
    ) -> Result<(), PlcError> {
        let axes = &[axis];
        let wait = Wait { axes, step: "move", within, with_faults: false };
        self.images.set_mode(axis, POSITION)?;
        // A START while another mode is in use would be lost.
        let ready = |images: &Images, axis: usize| {
            let in_mode = images.get(axis, "mode").is_none_or(|mode| mode == i64::from(POSITION));
            in_mode && !images.status(axis).contains(Status::START_TAKEN)
        };
        self.until(Wait { step: "take the mode", ..wait }, Control::ENABLE, ready)?;
        self.images.set_target(axis, movement.target)?;
        self.images.set(axis, "velocity", movement.velocity)?;
        self.images.set_acceleration(axis, movement.acceleration)?;
        let mut word = Control::ENABLE | Control::START;
        word.set(Control::RELATIVE, movement.relative);
        let there = if until_there { Status::START_TAKEN | Status::DONE } else { Status::START_TAKEN };
        self.until(wait, word, |images, axis| {
            let status = images.status(axis);
            status.contains(there) && (until_there || !status.contains(Status::REFUSED))
        })
    }

    fn follow(
        &mut self,
        axis: usize,
        (velocity, acceleration): (i64, i64),
        until_there: bool,
        within: Duration,
    ) -> Result<(), PlcError> {
        self.images.set_mode(axis, VELOCITY)?;
        self.images.set_velocity(axis, velocity)?;
        self.images.set_acceleration(axis, acceleration)?;
        let wait = Wait { axes: &[axis], step: "follow the velocity", within, with_faults: false };
        self.until(wait, Control::ENABLE, |images, axis| {
            let in_mode = images.get(axis, "mode").is_none_or(|mode| mode == i64::from(VELOCITY));
            let away = images.velocity(axis).map(|actual| actual.abs_diff(velocity));
            let may = velocity.unsigned_abs() / REACHED.unsigned_abs();
            let there = if velocity == 0 {
                images.status(axis).contains(Status::STANDSTILL)
            } else {
                away.is_none_or(|away| away <= may)
            };
            in_mode && !images.status(axis).contains(Status::REFUSED) && (there || !until_there)
        })
    }

    /// Sends what is sent for a time; without a connection the time passes.
    fn dwell(&mut self, span: Duration) -> Result<(), PlcError> {
        let end = Instant::now() + span;
        while Instant::now() < end {
            if self.line.is_some() {
                self.interval()?;
            } else {
                self.sleep(end)?;
            }
        }
        Ok(())
    }

    fn silence(&mut self, span: Duration) -> Result<(), PlcError> {
        let end = Instant::now() + span;
        while Instant::now() < end {
            self.check_stop()?;
            let next = end.min(Instant::now() + self.plan.interval);
            let line = self.line.as_mut().ok_or(PlcError::Unconnected)?;
            line.listen(next, self.plan, &mut self.images, &mut self.counts)?;
        }
        Ok(())
    }

    fn sleep(&self, end: Instant) -> Result<(), PlcError> {
        self.check_stop()?;
        std::thread::sleep(end.saturating_duration_since(Instant::now()).min(self.plan.interval));
        Ok(())
    }

    fn expect(&mut self, axis: usize, condition: Condition, within: Duration) -> Result<(), PlcError> {
        let begun = Instant::now();
        loop {
            self.interval()?;
            let (met, found) = meets(&self.images, axis, condition);
            if self.is_live() && met {
                return Ok(());
            }
            if begun.elapsed() >= within {
                let found = if self.is_live() { found } else { "said nothing".to_owned() };
                let name = self.plan.name(axis).to_owned();
                return Err(PlcError::Unmet { name, expected: condition.to_string(), found, limit: within });
            }
        }
    }
}

/// Whether an axis is as expected, and how it is.
fn meets(images: &Images, axis: usize, condition: Condition) -> (bool, String) {
    let near = |actual: Option<i64>, value: i64, tolerance: i64, unit: &str| {
        let met = actual.is_some_and(|actual| actual.abs_diff(value) <= tolerance.unsigned_abs());
        (met, actual.map_or_else(|| "no such field".to_owned(), |actual| format!("{actual} {unit}")))
    };
    match condition {
        Condition::Status { bits, on } => {
            let status = images.status(axis);
            let met = if on { status.contains(bits) } else { !status.intersects(bits) };
            (met, format!("{} on", names(status)))
        }
        Condition::Fault(cause) => {
            let found = images.fault(axis);
            (found == cause, Condition::Fault(found).to_string())
        }
        Condition::Refusal(refusal) => {
            let found = images.refusal(axis);
            (found == refusal, Condition::Refusal(found).to_string())
        }
        Condition::Position { value, tolerance } => near(images.position(axis), value, tolerance, "counts"),
        Condition::Velocity { value, tolerance } => near(images.velocity(axis), value, tolerance, "counts/s"),
    }
}
