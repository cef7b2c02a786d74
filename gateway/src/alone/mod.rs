//! The drive of one axis without a gateway: its parameters and commands over the bus itself.
//!
//! ```text
//! line of text --parse--> Job --Access--> Line --> bus
//!              <--reply--     <--Result--
//! ```
//!
//! Lines and replies are those of local control, and so are the [`Job`]s that answer them; a [`Line`] takes the place of the engine.
//! It goes no further than parameters need: a SERCOS line to CP2, CANopen devices to no other state than they are in, of a drive on
//! DeviceNet the explicit connection. There is no cycle, no telegram has a control word in it, and the jobs write none: no axis can be enabled.

pub mod can;
mod can_wire;
pub mod devicenet;
pub mod sercos;

#[cfg(test)]
mod tests;

use profile_generic::time::{DurationNs, MonotonicTime};

use crate::engine::direct::{
    DirectAnswer, DirectFailure, DirectResult, DirectTask, Direction, NotBegun, Target,
};
use crate::local::drive::job::{Context, Job, Step};
use crate::local::protocol::{self, BadRequest, Request};
use crate::parameter::id::Id;
use crate::parameter::known::Catalogue;

/// Longest time until the bus is ready: 511 slaves take less.
const READY_MAX: DurationNs = DurationNs::from_secs(60);

/// Longest time until the bus is down again.
const END_MAX: DurationNs = DurationNs::from_secs(5);

/// Longest report of the torque, bytes.
const REPORT_LEN: usize = 8;

/// Where a bus is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Stage {
    /// On the way up.
    Starting,
    /// The drive can be accessed.
    Ready,
    /// On the way down.
    Ending,
    /// Nothing is sent any more.
    Ended,
}

/// The bus of one drive.
pub trait Line {
    /// Everything that can be done at this moment.
    ///
    /// # Errors
    /// The drive cannot be accessed, or not any more: why.
    fn step(&mut self, now: MonotonicTime) -> Result<Stage, String>;

    /// When there is something to do, unless a frame comes before.
    fn wake_at(&self) -> Option<MonotonicTime>;

    /// Begins an access. One at a time is in progress.
    ///
    /// # Errors
    /// It cannot be sent, and the buffer.
    fn begin(&mut self, now: MonotonicTime, task: DirectTask) -> Result<(), NotBegun>;

    /// Takes the result of the access, once there is one.
    fn take(&mut self) -> Option<DirectResult>;

    /// What says whether the drive has torque; empty where it cannot have any.
    fn torque_reports(&self) -> &[Target] {
        &[]
    }

    /// Whether one of them says so, or nothing that makes sense.
    fn has_torque(&self, _report: &[u8]) -> bool {
        false
    }

    /// Takes the bus down.
    fn end(&mut self, now: MonotonicTime);
}

/// Sleeps until an instant, or a little while, and returns the time then.
pub type Wait = Box<dyn FnMut(Option<MonotonicTime>) -> MonotonicTime>;

/// An axis whose drive can be accessed, until it is dropped.
pub struct Session {
    line: Box<dyn Line>,
    wait: Wait,
    now: MonotonicTime,
    /// The names of all axes, in the order of the catalogue.
    names: Vec<String>,
    axis: usize,
    catalogue: Catalogue,
}

impl Session {
    /// Takes the bus up. `go_on` is asked whether to.
    ///
    /// # Errors
    /// The drive cannot be accessed: why.
    pub fn open(
        line: Box<dyn Line>,
        wait: Wait,
        (names, axis): (Vec<String>, usize),
        catalogue: Catalogue,
        mut go_on: impl FnMut() -> bool,
    ) -> Result<Self, String> {
        let mut session = Self { line, wait, now: MonotonicTime::ZERO, names, axis, catalogue };
        session.now = (session.wait)(None);
        let end = session.now + READY_MAX;
        while session.line.step(session.now)? != Stage::Ready {
            if !go_on() {
                return Err("interrupted".to_owned());
            }
            if session.now >= end {
                return Err(format!("the bus is not up after {READY_MAX}"));
            }
            session.sleep();
        }
        Ok(session)
    }

    /// The reply to a line of text.
    ///
    /// # Errors
    /// The drive cannot be accessed any more: why.
    pub fn ask(&mut self, line: &str) -> Result<String, String> {
        let (axis, ask) = match protocol::parse(line, &self.names, &[]) {
            Ok(Request::Drive { axis, ask }) if axis == self.axis => (axis, ask),
            Ok(_) => return Err(format!("`{line}` needs a gateway that runs")),
            Err(BadRequest::Parameter { name }) if !Id::is_meant(&name) => {
                return Err(format!(
                    "`{name}` is a name, which needs a gateway that runs: expected a number such as S-0-0100, 6081h or 66.1.504"
                ));
            }
            Err(error) => return Ok(protocol::bad(line, &error)),
        };
        let begun = self.with_context(axis, |context| Job::begin(ask, context));
        let (mut job, mut step) = match begun {
            Ok(begun) => begun,
            Err(reply) => return Ok(reply),
        };
        loop {
            match step {
                Step::Reply(reply) => return Ok(reply),
                Step::Access(target, direction, data) => {
                    let write = direction != Direction::Read;
                    let refusal = if write { self.guard()? } else { None };
                    let DirectResult { result, data } = match refusal {
                        Some(failure) => DirectResult { result: Err(failure), data },
                        None => self.access(DirectTask { target, write, data })?,
                    };
                    let answer = DirectAnswer { client: 0, id: 0, result, data };
                    step = self.with_context(axis, |context| job.take(answer, context));
                }
            }
        }
    }

    /// Why nothing is written now: the drive says that it has torque, or does not say that it has none. A device without such an
    /// object is no drive.
    fn guard(&mut self) -> Result<Option<DirectFailure>, String> {
        for target in self.line.torque_reports().to_vec() {
            let data = Vec::with_capacity(REPORT_LEN);
            let DirectResult { result, data } = self.access(DirectTask { target, write: false, data })?;
            match result {
                Ok(_) if self.line.has_torque(&data) => return Ok(Some(DirectFailure::Torque)),
                Ok(_) => {}
                Err(failure) if failure.code() == "absent" => {}
                Err(failure) => return Ok(Some(failure)),
            }
        }
        Ok(None)
    }

    /// One access, to its end.
    fn access(&mut self, task: DirectTask) -> Result<DirectResult, String> {
        if let Err((failure, data)) = self.line.begin(self.now, task) {
            return Ok(DirectResult { result: Err(failure), data });
        }
        loop {
            // A result counts, whatever comes after it.
            let stage = self.line.step(self.now);
            if let Some(result) = self.line.take() {
                return Ok(result);
            }
            if stage? != Stage::Ready {
                return Ok(DirectResult { result: Err(DirectFailure::Unanswered), data: Vec::new() });
            }
            self.sleep();
        }
    }

    fn sleep(&mut self) {
        self.now = (self.wait)(self.line.wake_at());
    }

    /// Calls with what is known of the drive of the axis.
    fn with_context<T>(&self, axis: usize, with: impl FnOnce(&Context<'_>) -> T) -> T {
        let Self { names, catalogue, .. } = self;
        let name = names.get(axis).map_or("-", String::as_str);
        with(&Context { axis: name, bus: catalogue.bus(axis), catalogue, parameters: &[] })
    }
}

impl Drop for Session {
    /// Takes the bus down.
    fn drop(&mut self) {
        self.line.end(self.now);
        let end = self.now + END_MAX;
        while self.now < end && !matches!(self.line.step(self.now), Ok(Stage::Ended) | Err(_)) {
            self.sleep();
        }
    }
}
