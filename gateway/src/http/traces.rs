//! What the charts of the page show: the last minute of each axis, and the last ten minutes of system time.
//!
//! The server's thread takes a sample of the published status ten times a second. The cycle thread knows nothing of it.

use std::collections::VecDeque;
use std::time::Duration;

use profile_generic::cast::f64_from_i64;
use profile_generic::image::{CommandSet, FeedbackSet};
use profile_generic::inhibit::Inhibits;
use profile_generic::time::DurationNs;
use schemars::JsonSchema;
use serde::Serialize;

use crate::engine::phase_lock::LockState;
use crate::status::{AxisStatus, BUSES_MAX, BoxStatus};
use crate::time::status::TimeStatus;

/// Time from one sample of the axes to the next.
pub(super) const PERIOD: Duration = Duration::from_millis(100);

/// Samples of the axes that are kept: a minute. Those of 64 axes take less than 3 MB.
pub(super) const AXIS_SAMPLES_MAX: usize = 600;

/// Time from one sample of system time to the next.
const TIME_PERIOD: DurationNs = DurationNs::from_secs(1);

/// Samples of system time that are kept: ten minutes.
pub(super) const TIME_SAMPLES_MAX: usize = 600;

/// Nanoseconds in a second, and nanounits in a unit.
const NANO: f64 = 1e9;

/// Millionths of the rated torque in a percent of it.
const PARTS_PER_PERCENT: f64 = 10_000.0;

/// The last minute of an axis: one value of each list for each sample, oldest first. `null` is a value that the drive did not have.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct AxisTraces {
    /// The axis.
    pub axis: String,
    /// `rev` or `mm`.
    pub unit: String,
    /// Number of the newest sample, to go on after.
    pub next: u64,
    /// When each sample was published: seconds since the first cycle.
    pub uptime_s: Vec<f64>,
    /// Position set-point, in the unit.
    pub position_command: Vec<Option<f64>>,
    /// Actual position, in the unit.
    pub position: Vec<Option<f64>>,
    /// Velocity set-point, in the unit per second.
    pub velocity_command: Vec<Option<f64>>,
    /// Actual velocity, in the unit per second.
    pub velocity: Vec<Option<f64>>,
    /// Torque set-point, percent of the rated torque.
    pub torque_command: Vec<Option<f64>>,
    /// Actual torque, percent of the rated torque.
    pub torque: Vec<Option<f64>>,
    /// Commanded less actual position, in the unit.
    pub following_error: Vec<Option<f64>>,
}

/// The last ten minutes of system time: one value of each list for each sample, oldest first.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct TimeTraces {
    /// Number of the newest sample, to go on after.
    pub next: u64,
    /// When each sample was published: seconds since the first cycle.
    pub uptime_s: Vec<f64>,
    /// Offset from the master that the last Sync has shown; `null` where there is none.
    pub offset_ns: Vec<Option<i64>>,
    /// The buses in the order of the status.
    pub buses: Vec<PhaseTrace>,
}

/// How far the cycles of a bus were from their instants of system time.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PhaseTrace {
    /// The bus.
    pub bus: String,
    /// Last cycle after its instant; `null` while the bus follows no system time.
    pub phase_error_ns: Vec<Option<i64>>,
}

/// Samples by number, the first one has 1. The oldest go.
#[derive(Debug)]
struct Ring<T> {
    newest: u64,
    samples: VecDeque<T>,
    most: usize,
}

impl<T> Ring<T> {
    const fn new(most: usize) -> Self {
        Self { newest: 0, samples: VecDeque::new(), most }
    }

    fn push(&mut self, sample: T) {
        if self.samples.len() >= self.most {
            self.samples.pop_front();
        }
        self.samples.push_back(sample);
        self.newest += 1;
    }

    /// The samples after this number. All of them after one that there has not been: it is of an earlier run.
    fn after(&self, number: u64) -> impl Iterator<Item = &T> {
        let wanted = self.newest.checked_sub(number).unwrap_or(u64::MAX);
        let count = usize::try_from(wanted).unwrap_or(usize::MAX).min(self.samples.len());
        self.samples.iter().skip(self.samples.len() - count)
    }
}

/// One axis at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
struct AxisSample {
    commands: CommandSet,
    actual: FeedbackSet,
    position_command: i64,
    position: i64,
    velocity_command: i64,
    velocity: i64,
    torque_command: i64,
    torque: i64,
    following_error: i64,
}

impl AxisSample {
    fn of(axis: &AxisStatus) -> Self {
        // Nothing is heard from the drive: what it has reported before was not now.
        let silent = axis.inhibits.contains(Inhibits::NO_DRIVE);
        let image = &axis.image;
        Self {
            commands: if silent { CommandSet::empty() } else { image.commands },
            actual: if silent { FeedbackSet::empty() } else { image.actual },
            position_command: image.position_command.get(),
            position: axis.position.get(),
            velocity_command: image.velocity_command.get(),
            velocity: axis.velocity.get(),
            torque_command: image.torque_command.get(),
            torque: axis.torque.get(),
            following_error: axis.following_error.get(),
        }
    }

    fn command(&self, set: CommandSet, value: i64, scale: f64) -> Option<f64> {
        self.commands.contains(set).then(|| f64_from_i64(value) / scale)
    }

    fn actual(&self, set: FeedbackSet, value: i64, scale: f64) -> Option<f64> {
        self.actual.contains(set).then(|| f64_from_i64(value) / scale)
    }
}

/// All axes at one moment.
#[derive(Debug)]
struct Moment {
    at: DurationNs,
    axes: Box<[AxisSample]>,
}

/// System time at one moment.
#[derive(Debug)]
struct TimeMoment {
    at: DurationNs,
    offset: Option<i64>,
    phase_errors: [Option<i64>; BUSES_MAX],
}

/// The samples.
#[derive(Debug)]
pub(super) struct Traces {
    axes: Ring<Moment>,
    time: Ring<TimeMoment>,
}

impl Default for Traces {
    fn default() -> Self {
        Self { axes: Ring::new(AXIS_SAMPLES_MAX), time: Ring::new(TIME_SAMPLES_MAX) }
    }
}

impl Traces {
    /// Takes a sample of a status. One that was seen before is none: nothing was published meanwhile.
    pub fn take(&mut self, status: &BoxStatus, time: impl FnOnce() -> TimeStatus) {
        let at = status.uptime;
        if self.axes.samples.back().is_some_and(|last| last.at == at) {
            return;
        }
        self.axes.push(Moment { at, axes: status.configured_axes().iter().map(AxisSample::of).collect() });
        if self.time.samples.back().is_none_or(|last| DurationNs(at.0 - last.at.0) >= TIME_PERIOD) {
            let mut phase_errors = [None; BUSES_MAX];
            for (place, bus) in phase_errors.iter_mut().zip(status.configured_buses()) {
                *place = (bus.phase_lock.state != LockState::Free).then_some(bus.phase_lock.error.0);
            }
            self.time.push(TimeMoment { at, offset: time().offset_from_master, phase_errors });
        }
    }

    /// The samples of an axis after this number.
    pub fn of_axis(&self, place: usize, (axis, unit): (&str, &str), after: u64) -> AxisTraces {
        let mut traces = AxisTraces {
            axis: axis.to_owned(),
            unit: unit.to_owned(),
            next: self.axes.newest,
            uptime_s: Vec::new(),
            position_command: Vec::new(),
            position: Vec::new(),
            velocity_command: Vec::new(),
            velocity: Vec::new(),
            torque_command: Vec::new(),
            torque: Vec::new(),
            following_error: Vec::new(),
        };
        for moment in self.axes.after(after) {
            let Some(sample) = moment.axes.get(place) else { continue };
            let (command, actual) = (
                |set, value, scale| sample.command(set, value, scale),
                |set, value, scale| sample.actual(set, value, scale),
            );
            traces.uptime_s.push(seconds(moment.at));
            traces.position_command.push(command(CommandSet::POSITION, sample.position_command, NANO));
            traces.position.push(actual(FeedbackSet::POSITION, sample.position, NANO));
            traces.velocity_command.push(command(CommandSet::VELOCITY, sample.velocity_command, NANO));
            traces.velocity.push(actual(FeedbackSet::VELOCITY, sample.velocity, NANO));
            traces.torque_command.push(command(CommandSet::TORQUE, sample.torque_command, PARTS_PER_PERCENT));
            traces.torque.push(actual(FeedbackSet::TORQUE, sample.torque, PARTS_PER_PERCENT));
            traces.following_error.push(actual(FeedbackSet::FOLLOWING_ERROR, sample.following_error, NANO));
        }
        traces
    }

    /// The samples of system time after this number, with these buses.
    pub fn of_time<'a>(&self, buses: impl Iterator<Item = &'a str>, after: u64) -> TimeTraces {
        let moments = || self.time.after(after);
        let phase = |(place, bus): (usize, &str)| PhaseTrace {
            bus: bus.to_owned(),
            phase_error_ns: moments()
                .map(|moment| moment.phase_errors.get(place).copied().flatten())
                .collect(),
        };
        TimeTraces {
            next: self.time.newest,
            uptime_s: moments().map(|moment| seconds(moment.at)).collect(),
            offset_ns: moments().map(|moment| moment.offset).collect(),
            buses: buses.enumerate().map(phase).collect(),
        }
    }
}

fn seconds(span: DurationNs) -> f64 {
    f64_from_i64(span.0) / NANO
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::status::tests::distinct;
    use crate::time::status::tests::synchronized;

    fn at(millis: i64) -> BoxStatus {
        BoxStatus { uptime: DurationNs::from_millis(millis), ..distinct() }
    }

    fn uptimes(traces: &Traces, after: u64) -> Vec<f64> {
        traces.of_axis(0, ("turntable", "rev"), after).uptime_s
    }

    #[test]
    fn sample_has_the_values_that_were_published_and_the_absent_ones_as_none() {
        let mut traces = Traces::default();
        traces.take(&at(1_500), synchronized);
        let found = traces.of_axis(0, ("turntable", "rev"), 0);
        assert_eq!((found.next, &*found.uptime_s), (1, &[1.5][..]));
        assert_eq!(found.position_command, [Some(-1_234.567_890_046)]);
        assert_eq!(found.position, [Some(-1_234.567_890_123)]);
        assert_eq!(found.velocity_command, [Some(-2.500_000_001)]);
        assert_eq!(found.velocity, [Some(-2.5)]);
        assert_eq!((&*found.torque_command, &*found.torque), (&[Some(-33.3334)][..], &[Some(-33.3333)][..]));
        assert_eq!(found.following_error, [Some(0.000_000_077)]);
        let other = traces.of_axis(1, ("slide", "mm"), 0);
        assert_eq!((&*other.position, &*other.velocity), (&[Some(0.0)][..], &[None][..]));
        assert_eq!(other.position_command, [None]);
    }

    #[test]
    fn drive_that_is_not_heard_has_no_values() {
        let mut status = at(0);
        status.axes[0].inhibits = Inhibits::NO_DRIVE;
        let mut traces = Traces::default();
        traces.take(&status, synchronized);
        let found = traces.of_axis(0, ("turntable", "rev"), 0);
        assert_eq!((&*found.position, &*found.position_command), (&[None][..], &[None][..]));
    }

    #[test]
    fn minute_is_kept_and_a_viewer_goes_on_after_what_it_has() {
        let mut traces = Traces::default();
        assert_eq!(uptimes(&traces, 0), [0.0; 0]);
        for number in 0..650 {
            traces.take(&at(100 * number), synchronized);
            // The cycle thread has published nothing meanwhile.
            traces.take(&at(100 * number), synchronized);
        }
        let all = uptimes(&traces, 0);
        assert_eq!((all.len(), all[0], all[599]), (600, 5.0, 64.9));
        assert_eq!(uptimes(&traces, 648), [64.8, 64.9]);
        assert_eq!(uptimes(&traces, 650), [0.0; 0]);
        assert_eq!(uptimes(&traces, 651).len(), 600, "a number of an earlier run");
        let time = traces.of_time(["SERCOS", "CAN bus 1"].into_iter(), 63);
        assert_eq!((time.next, &*time.uptime_s), (65, &[63.0, 64.0][..]));
        assert_eq!(time.offset_ns, [synchronized().offset_from_master; 2]);
        let errors: Vec<_> = time.buses.iter().map(|bus| (bus.bus.as_str(), &*bus.phase_error_ns)).collect();
        assert_eq!(errors, [("SERCOS", &[Some(-789); 2][..]), ("CAN bus 1", &[Some(456); 2][..])]);
    }

    #[test]
    fn bus_that_follows_nothing_has_no_phase_error() {
        let mut status = at(0);
        status.buses[0].phase_lock.state = LockState::Free;
        let mut traces = Traces::default();
        traces.take(&status, synchronized);
        assert_eq!(traces.of_time(["SERCOS"].into_iter(), 0).buses[0].phase_error_ns, [None]);
    }
}
