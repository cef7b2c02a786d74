//! What the PTP library is given for a clock and a filter: a clock that nobody sets, and a filter that keeps what was measured.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::convert::Infallible;
use std::rc::Rc;

use profile_generic::time::MonotonicTime;
use statime::Clock;
use statime::config::TimePropertiesDS;
use statime::filters::{Filter, FilterEstimate, FilterUpdate};
use statime::port::Measurement;
use statime::time::{Duration, Time};

/// Measurements that nobody has taken: the follower takes them after each message.
const MEASUREMENTS_MAX: usize = 16;

/// One measurement; `phase` as in [`super::super::line::Line`], ns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Measured {
    /// Of a Sync that came at `at`.
    Sync { at: MonotonicTime, phase: i64 },
    /// Of a delay request that left at `at`.
    Delay { at: MonotonicTime, phase: i64 },
}

/// The measurements of a port, in their order.
#[derive(Debug, Clone, Default)]
pub(super) struct Measurements(Rc<RefCell<VecDeque<Measured>>>);

impl Measurements {
    /// Takes the oldest one.
    pub fn take(&self) -> Option<Measured> {
        self.0.borrow_mut().pop_front()
    }

    fn push(&self, measured: Measured) {
        let mut queue = self.0.borrow_mut();
        if queue.len() == MEASUREMENTS_MAX {
            queue.pop_front();
        }
        queue.push_back(measured);
    }
}

/// The filter of the port: it filters nothing, [`super::super::line::Line`] does.
#[derive(Debug)]
pub(super) struct Collector {
    measurements: Measurements,
}

impl Filter for Collector {
    type Config = Measurements;

    fn new(config: Self::Config) -> Self {
        Self { measurements: config }
    }

    fn measurement<C: Clock>(&mut self, measured: Measurement, _: &mut C) -> FilterUpdate {
        let at = |time: Time| time.nanos().to_num::<i128>().try_into().ok().map(MonotonicTime);
        // Offsets are ours from the master's: the other way round.
        let phase = |offset: Duration| {
            offset.nanos_rounded().checked_neg().and_then(|phase| i64::try_from(phase).ok())
        };
        let event = at(measured.event_time);
        if let (Some(at), Some(phase)) = (event, measured.raw_sync_offset.and_then(phase)) {
            self.measurements.push(Measured::Sync { at, phase });
        }
        if let (Some(at), Some(phase)) = (event, measured.raw_delay_offset.and_then(phase)) {
            self.measurements.push(Measured::Delay { at, phase });
        }
        FilterUpdate::default()
    }

    fn update<C: Clock>(&mut self, _: &mut C) -> FilterUpdate {
        FilterUpdate::default()
    }

    fn demobilize<C: Clock>(self, _: &mut C) {}

    fn current_estimates(&self) -> FilterEstimate {
        FilterEstimate { offset_from_master: Duration::ZERO, mean_delay: Duration::ZERO }
    }
}

/// The monotonic clock as the library sees it.
#[derive(Debug, Clone)]
pub(super) struct LocalClock(Rc<Cell<MonotonicTime>>);

impl LocalClock {
    pub fn new(now: MonotonicTime) -> Self {
        Self(Rc::new(Cell::new(now)))
    }

    pub fn set(&self, now: MonotonicTime) {
        self.0.set(now);
    }
}

impl Clock for LocalClock {
    type Error = Infallible;

    fn now(&self) -> Time {
        super::time(self.0.get())
    }

    fn step_clock(&mut self, _: Duration) -> Result<Time, Self::Error> {
        Ok(self.now())
    }

    fn set_frequency(&mut self, _: f64) -> Result<Time, Self::Error> {
        Ok(self.now())
    }

    fn set_properties(&mut self, _: &TimePropertiesDS) -> Result<(), Self::Error> {
        Ok(())
    }
}
