//! Holds what a checker finds against a test: a violation that the test has not declared ends it, and so does a
//! declared one that does not come.

use std::fmt;

use profile_generic::time::{DurationNs, MonotonicTime};

use super::bus::{Arrived, Stations};
use super::{Checker, CheckerConfig, Violation, wire_time};
use crate::master::event::Port;

/// Smallest gap between two frames: 12 bytes at 100 Mbit/s.
const GAP: DurationNs = DurationNs(960);

/// Changes a frame as it leaves a station: topology address, outward, frame.
pub type Misdeeds<'a> = dyn FnMut(u16, bool, &mut [u8]) + 'a;

/// Violations that are made on purpose.
struct Purpose {
    is: Box<dyn Fn(&Violation) -> bool>,
    came: bool,
}

/// A checker, and what of its findings is meant to be.
pub struct CheckedBus {
    /// Judges everything that is sent and passed.
    pub checker: Checker,
    purposes: Vec<Purpose>,
    judged: usize,
    /// When each port of the master is through with its last frame.
    free: [MonotonicTime; 2],
}

impl fmt::Debug for CheckedBus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("CheckedBus")
            .field("checker", &self.checker)
            .field("purposes", &self.purposes.len())
            .finish()
    }
}

impl CheckedBus {
    /// Begins to watch at `now`, with nothing on the wire.
    #[must_use]
    pub fn new(now: MonotonicTime) -> CheckedBus {
        CheckedBus {
            checker: Checker::new(CheckerConfig::default(), now),
            purposes: Vec::new(),
            judged: 0,
            free: [now; 2],
        }
    }

    /// The master sends a frame, behind those that it has just sent on the same port; gives when it begins.
    pub fn sent(&mut self, now: MonotonicTime, port: Port, frame: &[u8]) -> MonotonicTime {
        let start = self.free[port.index()].max(now);
        self.free[port.index()] = start + wire_time(frame.len()) + GAP;
        self.checker.sent(start, frame);
        start
    }

    /// The master sends a frame from one of its ports through `stations`. Each passage is judged, behind what
    /// `misdeed` makes of it; `arrived` gets what comes to a port of the master.
    pub fn send<S: Stations + ?Sized>(
        &mut self,
        now: MonotonicTime,
        port: Port,
        frame: &mut [u8],
        stations: &mut S,
        misdeed: &mut Misdeeds<'_>,
        arrived: &mut Arrived<'_>,
    ) {
        let start = self.sent(now, port, frame);
        let checker = &mut self.checker;
        let mut watch = |slave, outward, before: &[u8], after: &mut [u8]| {
            misdeed(slave, outward, after);
            checker.passed(start, slave, outward, before, after);
        };
        stations.pass(now, port, frame, &mut watch, arrived);
    }

    /// Judges what was found since the last time.
    ///
    /// # Panics
    /// With station and rule of a violation that was not declared.
    pub fn judge(&mut self) {
        let new = self.checker.violations().get(self.judged..).unwrap_or_default();
        for violation in new {
            let mut meant = false;
            for purpose in self.purposes.iter_mut().filter(|purpose| (purpose.is)(violation)) {
                (purpose.came, meant) = (true, true);
            }
            assert!(meant, "{violation}");
        }
        self.judged = self.checker.violations().len();
    }
}

/// A test's rig whose every frame passes a [`CheckedBus`].
pub trait Tried: Sized {
    /// The checked bus.
    fn checked(&mut self) -> &mut CheckedBus;

    /// Runs `script`, in which the violations that `declared` knows are made on purpose.
    ///
    /// # Panics
    /// When none of them came.
    fn breaking<T>(
        &mut self,
        declared: impl Fn(&Violation) -> bool + 'static,
        script: impl FnOnce(&mut Self) -> T,
    ) -> T {
        let (result, came) = tried(self, Box::new(declared), script);
        assert!(came, "the rule that was to be broken on purpose was kept");
        result
    }

    /// Runs `script`, in which the violations that `declared` knows may come: where chance decides what is broken.
    fn tolerating<T>(
        &mut self,
        declared: impl Fn(&Violation) -> bool + 'static,
        script: impl FnOnce(&mut Self) -> T,
    ) -> T {
        tried(self, Box::new(declared), script).0
    }
}

fn tried<R: Tried, T>(
    rig: &mut R,
    is: Box<dyn Fn(&Violation) -> bool>,
    script: impl FnOnce(&mut R) -> T,
) -> (T, bool) {
    rig.checked().purposes.push(Purpose { is, came: false });
    let result = script(rig);
    let checked = rig.checked();
    checked.judge();
    (result, checked.purposes.pop().is_some_and(|purpose| purpose.came))
}
