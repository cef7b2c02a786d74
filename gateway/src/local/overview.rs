//! The state of the whole gateway as one JSON object: the reply to `box`, and what `axisbridge status` shows.

use profile_cip::wire::motion::codes::AxisStateCode;
use profile_generic::cast::f64_from_i64;
use serde::{Deserialize, Serialize};

use super::protocol::unit;
use crate::config::{AxisKind, TimeSource};
use crate::status::{AxisStatus, BoxState, BoxStatus, PHASE_NONE};
use crate::time::status::{Identity, TimeStatus};

/// Version of the object. It changes when a field gets another meaning, not when one is added.
pub const FORMAT: u32 = 1;

/// Nanounits in a unit.
const NANO: f64 = 1e9;

/// Millionths of the rated torque in a percent of it.
const PARTS_PER_PERCENT: f64 = 10_000.0;

/// A running gateway.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Overview {
    /// [`FORMAT`].
    pub format: u32,
    /// Its name in the configuration.
    pub name: String,
    /// `starting`, `phase_up`, `ready`, `running`, `bus_lost` or `stopping`.
    pub state: String,
    /// Communication phase of the SERCOS bus, where there is one.
    pub sercos_phase: Option<u8>,
    /// Open CIP Motion connections.
    pub connections: u8,
    /// Seconds since the start.
    pub uptime_s: f64,
    /// How its cycles go.
    pub cycles: Cycles,
    /// System time.
    pub time: Time,
    /// The axes in the order of the configuration.
    pub axes: Vec<Axis>,
}

/// How the cycles go: counters since the start.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cycles {
    /// Shortest cycle of all buses.
    pub cycle_ns: u32,
    /// Cycles of all buses.
    pub count: u64,
    /// Calls that were late by more than half a cycle.
    pub late: u64,
    /// Largest lateness of a call.
    pub latest_ns: u32,
    /// `free`, `pulling` or `locked`: how the buses follow system time, the least of all.
    pub phase_lock: String,
    /// Latest cycle after its instant of system time, the largest of all.
    pub phase_error_ns: i64,
    /// Updates of controllers that were lost or late.
    pub lost_updates: u64,
    /// Telegrams of drives that were not received in time.
    pub lost_telegrams: u64,
    /// Frames and datagrams that were malformed or from a stranger.
    pub refused_frames: u64,
    /// Frames and datagrams that could not be sent.
    pub send_failures: u64,
}

/// System time.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Time {
    /// The `source` of the configuration.
    pub source: String,
    /// Whether IsSynchronized is reported to controllers.
    pub synchronized: bool,
    /// In words, as the log has it.
    pub state: String,
    /// The grandmaster whose time it is.
    pub grandmaster: Option<String>,
    /// Offset from the master that the last Sync has shown.
    pub offset_ns: Option<i64>,
    /// Mean delay of the path to the master.
    pub path_delay_ns: Option<i64>,
    /// Bound of the error, where the source knows one.
    pub error_bound_ns: Option<u64>,
    /// Largest offset of a synchronized clock.
    pub threshold_ns: u64,
    /// Steps of the master's clock.
    pub steps: u32,
}

/// An axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// Its name.
    pub name: String,
    /// State in the generic drive model.
    pub state: String,
    /// State that the controller sees (Axis State), where the axis is on a device.
    pub cip_state: Option<String>,
    /// `nobody`, `controller` or `local`.
    pub owner: String,
    /// Operating mode that the drive shows.
    pub mode: String,
    /// `rev` or `mm`.
    pub unit: String,
    /// Actual position, in the unit.
    pub position: f64,
    /// Actual velocity, in the unit per second.
    pub velocity: f64,
    /// Actual torque, percent of the rated torque.
    pub torque: f64,
    /// Commanded less actual position, in the unit.
    pub following_error: f64,
    /// The fault that stands.
    pub fault: Option<String>,
    /// The drive's own code of it; 0 if it has reported none.
    pub drive_code: u32,
    /// What the axis has waited for, for longer than a second, in words.
    pub waits: Option<String>,
    /// Why it cannot be enabled.
    pub inhibits: Vec<String>,
    /// Bus cycles without fresh data from the drive.
    pub lost_telegrams: u32,
}

/// What does not change while the gateway runs.
#[derive(Debug, Clone, Copy)]
pub struct Known<'a> {
    /// Name of the gateway.
    pub name: &'a str,
    /// Names of the axes.
    pub names: &'a [String],
    /// Rotary or linear.
    pub kinds: &'a [AxisKind],
    /// Source of system time.
    pub source: TimeSource,
}

impl Overview {
    /// The overview of a status.
    #[must_use]
    pub fn of(known: &Known<'_>, status: &BoxStatus, time: &TimeStatus) -> Self {
        let counters = &status.counters;
        let axes = status.configured_axes().iter().zip(known.names.iter().zip(known.kinds));
        Self {
            format: FORMAT,
            name: known.name.to_owned(),
            state: status.state.to_string(),
            sercos_phase: Some(status.phase).filter(|phase| *phase != PHASE_NONE),
            connections: status.connections,
            uptime_s: f64_from_i64(status.uptime.0) / NANO,
            cycles: Cycles {
                cycle_ns: status.cycle_time_ns,
                count: counters.cycles,
                late: counters.late_cycles,
                latest_ns: status.lateness_max_ns,
                phase_lock: status.phase_lock.state.name().to_owned(),
                phase_error_ns: status.phase_lock.error.0,
                lost_updates: counters.lost_updates,
                lost_telegrams: counters.lost_telegrams,
                refused_frames: counters.refused_frames,
                send_failures: counters.send_failures,
            },
            time: Time::of(known.source, time),
            axes: axes.map(|(axis, (name, kind))| Axis::of(name, *kind, axis)).collect(),
        }
    }

    /// Whether all buses are in cyclic operation.
    #[must_use]
    pub fn is_up(&self) -> bool {
        [BoxState::READY, BoxState::RUNNING].iter().any(|state| self.state == state.to_string())
    }

    /// Whether all is well: the buses are up, no axis has a fault, and time is synchronized if there is to be one.
    #[must_use]
    pub fn is_healthy(&self) -> bool {
        let timed = self.time.synchronized || self.time.source == TimeSource::None.name();
        self.is_up() && timed && self.axes.iter().all(|axis| axis.fault.is_none())
    }
}

impl Time {
    fn of(source: TimeSource, time: &TimeStatus) -> Self {
        let measured = matches!(source, TimeSource::Ptp | TimeSource::Daemon | TimeSource::Host);
        Self {
            source: source.name().to_owned(),
            synchronized: time.phase.is_synchronized(),
            state: time.phase.to_string(),
            grandmaster: time.grandmaster.map(|grandmaster| Identity(grandmaster).to_string()),
            offset_ns: time.offset_from_master,
            path_delay_ns: time.mean_path_delay,
            error_bound_ns: Some(time.error_bound).filter(|bound| measured && *bound != u64::MAX),
            threshold_ns: time.threshold,
            steps: time.steps,
        }
    }
}

impl Axis {
    fn of(name: &str, kind: AxisKind, axis: &AxisStatus) -> Self {
        let units = |nano: i64| f64_from_i64(nano) / NANO;
        Self {
            name: name.to_owned(),
            state: axis.state.to_string(),
            cip_state: (axis.instance != 0).then(|| AxisStateCode(axis.cip_axis_state).to_string()),
            owner: axis.owner.name().to_owned(),
            mode: axis.mode.to_string(),
            unit: unit(kind).to_owned(),
            position: units(axis.position.get()),
            velocity: units(axis.velocity.get()),
            torque: f64_from_i64(axis.torque.get()) / PARTS_PER_PERCENT,
            following_error: units(axis.following_error.get()),
            fault: axis.fault.map(|fault| fault.to_string()),
            drive_code: axis.fault_vendor_code,
            waits: axis.wait.map(|wait| wait.to_string()),
            inhibits: axis.inhibits.iter_names().map(|(name, _)| name.to_ascii_lowercase()).collect(),
            lost_telegrams: axis.lost_telegrams,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::status::tests::distinct;
    use crate::time::judge::{Reason, SyncPhase};
    use crate::time::ptp::FollowerConfig;

    fn overview() -> Overview {
        let follower =
            FollowerConfig { identity: [1; 8], domain: 0, threshold: 10_000, asymmetry: 0, seed: 1 };
        let time = TimeStatus {
            phase: SyncPhase::Synchronized,
            grandmaster: Some([0x02, 0x41, 0x42, 0xFF, 0xFE, 0, 0, 1]),
            offset_from_master: Some(-120),
            mean_path_delay: Some(3_400),
            error_bound: 800,
            ..TimeStatus::ptp(&follower)
        };
        let names = ["turntable", "slide"].map(str::to_owned);
        let known = Known {
            name: "cell 4",
            names: &names,
            kinds: &[AxisKind::Rotary, AxisKind::Linear],
            source: TimeSource::Ptp,
        };
        Overview::of(&known, &distinct(), &time)
    }

    #[test]
    fn every_value_is_in_the_object() {
        insta::assert_snapshot!(serde_json::to_string_pretty(&overview()).unwrap());
    }

    #[test]
    fn health_is_buses_up_no_fault_and_time_where_there_is_to_be_one() {
        let mut good = overview();
        good.axes.iter_mut().for_each(|axis| axis.fault = None);
        assert!(good.is_healthy());
        let mut faulted = good.clone();
        faulted.axes[1].fault = Some("over_current".to_owned());
        let down = Overview { state: "bus_lost".to_owned(), ..good.clone() };
        let mut untimed = good.clone();
        (untimed.time.synchronized, untimed.time.state) =
            (false, SyncPhase::Uncalibrated(Reason::Offset).to_string());
        for bad in [&faulted, &down, &untimed] {
            assert!(!bad.is_healthy(), "{bad:?}");
        }
        untimed.time.source = "none".to_owned();
        assert!(untimed.is_healthy(), "nobody wants to know the time");
    }
}
