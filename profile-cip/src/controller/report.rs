//! What a run comes to: the figures a tester reads at its end.

use core::fmt;

use super::event::{DeviceIdentity, FaultText};
use super::failure::Failure;
use super::statistics::Spread;
use crate::wire::motion::codes::{AxisStateCode, NodeAlarm, NodeFault};
use crate::wire::motion::{AlarmRecord, FaultRecord};
use profile_generic::time::MonotonicTime;

/// Most entries of a list in the report; what comes later is counted, not kept.
pub const ENTRIES_MAX: usize = 64;

/// A list that keeps its first [`ENTRIES_MAX`] entries and counts them all.
#[derive(Debug, Clone, PartialEq)]
pub struct Entries<T> {
    kept: Vec<T>,
    /// How many there were.
    pub total: u64,
}

impl<T> Default for Entries<T> {
    fn default() -> Self {
        Self { kept: Vec::with_capacity(ENTRIES_MAX), total: 0 }
    }
}

impl<T> Entries<T> {
    pub(super) fn push(&mut self, entry: T) {
        self.total += 1;
        if self.kept.len() < ENTRIES_MAX {
            self.kept.push(entry);
        }
    }

    /// The first ones.
    #[must_use]
    pub fn kept(&self) -> &[T] {
        &self.kept
    }
}

/// The figures of one axis in a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AxisReport {
    /// Instance number.
    pub axis: u8,
    /// Last position commanded while Running, in units; none if there never was one.
    pub commanded: Option<f64>,
    /// Last actual position while Running, in units.
    pub reached: Option<f64>,
    /// Last actual position in any state, in units.
    pub actual: Option<f64>,
    /// Largest distance between command and actual position at the same instant while Running in position
    /// control, in units.
    pub following_error_max: f64,
    /// Updates in which that distance was measured.
    pub following_samples: u64,
    /// State the axis was seen in last.
    pub state: Option<AxisStateCode>,
    /// States in the order in which they were seen.
    pub states: Entries<AxisStateCode>,
    /// Fault log entries.
    pub faults: Entries<FaultRecord>,
    /// Alarm log entries.
    pub alarms: Entries<AlarmRecord>,
}

/// One step of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepReport {
    /// When it began.
    pub began: MonotonicTime,
    /// When it finished or failed; `None` while it is under way.
    pub ended: Option<MonotonicTime>,
}

/// The whole run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// Who the device says it is.
    pub identity: Option<DeviceIdentity>,
    /// The axes, instance 1 first.
    pub axes: Vec<AxisReport>,
    /// C-to-D updates sent.
    pub cycles: u64,
    /// Update periods in which this controller was too late to send anything.
    pub missed_cycles: u64,
    /// D-to-C updates received.
    pub updates: u64,
    /// Update IDs of the device that never came.
    pub lost_updates: u64,
    /// D-to-C updates that came overtaken by a newer one or were older than the low limit.
    pub late_updates: u64,
    /// C-to-D updates that the device reports as lost, modulo 256.
    pub device_lost_updates: u8,
    /// C-to-D updates that the device reports as late, modulo 256.
    pub device_late_updates: u8,
    /// Time between two D-to-C updates.
    pub interval: Spread,
    /// Time from sending an update until the device says that it received it.
    pub round_trip: Spread,
    /// Messages from the device that could not be understood.
    pub malformed: u64,
    /// Last node fault other than none.
    pub node_fault: Option<NodeFault>,
    /// Last node alarm other than none.
    pub node_alarm: Option<NodeAlarm>,
    /// Whether the device ran synchronously.
    pub synchronous: bool,
    /// The steps that have begun, in their order.
    pub steps: Vec<StepReport>,
    /// Steps of the program that have finished.
    pub steps_finished: usize,
    /// Why the run failed.
    pub failure: Option<Failure>,
    /// Step of the program that failed.
    pub failed_step: Option<usize>,
}

impl fmt::Display for AxisReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "axis {}:", self.axis)?;
        for (name, value) in [("commanded", self.commanded), ("reached", self.reached)] {
            match value {
                Some(value) => write!(f, " {name} {value:.6},")?,
                None => write!(f, " {name} nothing,")?,
            }
        }
        write!(f, " following error up to {:.6};", self.following_error_max)?;
        self.states.kept().iter().enumerate().try_for_each(|(n, state)| {
            let separator = if n == 0 { " " } else { " -> " };
            write!(f, "{separator}{state}")
        })?;
        self.faults.kept().iter().try_for_each(|fault| write!(f, "; {}", FaultText(*fault)))
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(identity) = &self.identity {
            writeln!(f, "device {identity}")?;
        }
        let mode = if self.synchronous { "synchronous" } else { "asynchronous" };
        writeln!(
            f,
            "{} cycles, {mode}, {} missed; {} updates, {} lost, {} late, {} malformed",
            self.cycles,
            self.missed_cycles,
            self.updates,
            self.lost_updates,
            self.late_updates,
            self.malformed
        )?;
        self.axes.iter().try_for_each(|axis| writeln!(f, "{axis}"))?;
        match (&self.failure, self.failed_step) {
            (Some(failure), Some(step)) => writeln!(f, "failed in step {step}: {failure}"),
            (Some(failure), None) => writeln!(f, "failed: {failure}"),
            (None, _) => writeln!(f, "{} steps finished", self.steps_finished),
        }
    }
}
