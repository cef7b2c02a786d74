//! The published status of the box: made at each change, and every 10 ms otherwise.

use profile_cip::device::identity::ModuleState;
use profile_cip::device::visualization::display::{self, Line};
use profile_cip::device::visualization::{self, Indication};
use profile_cip::wire::motion::codes::AxisStateCode;
use profile_generic::inhibit::Inhibits;
use profile_generic::state::DriveState;
use profile_generic::time::{DurationNs, MonotonicTime};

use super::assembly::AssemblyChannel;
use super::axis::{Awaited, AxisChannel};
use super::bus::{Buses, South};
use super::changes::Changes;
use super::device::DeviceChannel;
use super::phase_lock::{Phase, PhaseLock};
use crate::latest::Publisher;
use crate::mapping::CipProgram;
use crate::status::{
    AxisStatus, BoxState, BoxStatus, BusStatus, Controller, ImageStatus, Indicators, PHASE_NONE,
};

/// Longest age of the published status while no state changes.
const PUBLISH_PERIOD: DurationNs = DurationNs::from_millis(10);

/// The status, and when it was published.
#[derive(Debug)]
pub(super) struct Publication {
    pub status: BoxStatus,
    publisher: Publisher<BoxStatus>,
    started: Option<MonotonicTime>,
    /// When the status was published last, and what it was in outline.
    published: Option<(MonotonicTime, Outline)>,
}

/// What the status is made of.
#[derive(Clone, Copy)]
pub(super) struct Sources<'a> {
    pub stopping: bool,
    pub buses: &'a Buses,
    pub devices: &'a [DeviceChannel],
    pub assemblies: &'a [AssemblyChannel],
    pub axes: &'a [AxisChannel],
    pub changes: &'a Changes,
    pub locks: &'a [PhaseLock],
}

/// The facts that the state of the box depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Outline {
    stopping: bool,
    /// All buses are in cyclic operation.
    up: bool,
    /// Controllers that are connected.
    connections: u8,
}

impl Outline {
    fn of(sources: &Sources<'_>) -> Self {
        let connected = sources.devices.iter().filter(|channel| channel.device().connection().is_some());
        let owned = sources.assemblies.iter().filter(|channel| channel.owner().is_some());
        Self {
            stopping: sources.stopping,
            up: sources.buses.iter().all(South::is_up),
            connections: u8::try_from(connected.count() + owned.count()).unwrap_or(u8::MAX),
        }
    }

    fn state(self, before: BoxState) -> BoxState {
        match self {
            Self { stopping: true, .. } => BoxState::STOPPING,
            Self { up: true, connections: 0, .. } => BoxState::READY,
            Self { up: true, .. } => BoxState::RUNNING,
            _ if matches!(before, BoxState::STARTING | BoxState::PHASE_UP) => BoxState::PHASE_UP,
            _ => BoxState::BUS_LOST,
        }
    }
}

impl Publication {
    pub fn new(
        publisher: Publisher<BoxStatus>,
        cycle_time: DurationNs,
        axes: usize,
        (devices, assemblies): (&[DeviceChannel], &[AssemblyChannel]),
    ) -> Self {
        let mut status = BoxStatus::STARTING;
        status.cycle_time_ns = u32::try_from(cycle_time.as_nanos()).unwrap_or(u32::MAX);
        status.axis_count = u8::try_from(axes).unwrap_or(u8::MAX);
        for channel in devices {
            let several = channel.axis_states().count() > 1;
            for (place, (axis, _)) in channel.axis_states().enumerate() {
                if let Some(entry) = status.axes.get_mut(axis) {
                    entry.indicators.several = several;
                    entry.instance = u8::try_from(place + 1).unwrap_or(u8::MAX);
                    entry.device = channel.number();
                }
            }
        }
        for channel in assemblies {
            for (place, axis) in channel.members().enumerate() {
                if let Some(entry) = status.axes.get_mut(axis) {
                    entry.instance = u8::try_from(place + 1).unwrap_or(u8::MAX);
                    entry.device = channel.number();
                }
            }
        }
        Self { status, publisher, started: None, published: None }
    }

    /// Counts a call that is late by so much, of a box whose shortest cycle is this.
    pub fn count_lateness(&mut self, late: DurationNs, cycle_time: DurationNs) {
        let max = &mut self.status.lateness_max_ns;
        *max = (*max).max(u32::try_from(late.as_nanos()).unwrap_or(u32::MAX));
        self.status.lateness.count(late);
        self.status.counters.late_cycles += u64::from(late.as_nanos() > cycle_time.as_nanos() / 2);
    }

    /// Publishes the status if an axis has changed, the outline has, or the last one is old.
    pub fn publish(&mut self, now: MonotonicTime, changed: bool, sources: &Sources<'_>) {
        let started = *self.started.get_or_insert(now);
        let outline = Outline::of(sources);
        let stale = |(last, known): (MonotonicTime, _)| now.since(last) >= PUBLISH_PERIOD || known != outline;
        if changed || self.published.is_none_or(stale) {
            self.published = Some((now, outline));
            self.status.uptime = now.since(started);
            self.status.connections = outline.connections;
            self.status.state = outline.state(self.status.state);
            self.fill(now, sources);
            self.publisher.publish(&self.status);
        }
    }

    fn fill(&mut self, now: MonotonicTime, sources: &Sources<'_>) {
        let status = &mut self.status;
        status.phase = sources.buses.iter().find_map(South::phase).unwrap_or(PHASE_NONE);
        status.phase_lock = worst(&sources.locks[..sources.buses.len().min(sources.locks.len())]);
        let counters = &mut status.counters;
        (counters.cycles, counters.lost_telegrams, counters.refused_frames) = (0, 0, 0);
        status.bus_count = u8::try_from(sources.buses.len()).unwrap_or(u8::MAX);
        for (place, bus) in sources.buses.iter().enumerate() {
            let counts = bus.counts();
            counters.cycles += counts.cycles;
            counters.lost_telegrams += counts.lost;
            counters.refused_frames += counts.refused;
            if let Some(entry) = status.buses.get_mut(place) {
                *entry = BusStatus {
                    up: bus.is_up(),
                    phase: bus.phase().unwrap_or(PHASE_NONE),
                    cycle_time_ns: u32::try_from(bus.cycle_time().as_nanos()).unwrap_or(u32::MAX),
                    cycles: counts.cycles,
                    lost_telegrams: counts.lost,
                    refused_frames: counts.refused,
                    phase_lock: sources.locks.get(place).map(PhaseLock::phase).unwrap_or_default(),
                    detail: bus.detail(),
                };
            }
        }
        counters.lost_updates = 0;
        for channel in sources.devices {
            let device = channel.device();
            let lost_updates = device.counters().lost_updates;
            status.counters.lost_updates += lost_updates;
            status.counters.refused_frames += channel.counters().refused;
            // Each of them looks at all axes of the device.
            let (node, module) = (device.node_condition(), device.module_state());
            let network = channel.network_status();
            let controller = device
                .connection()
                .map(|open| Controller { address: open.originator, update_period_us: open.rpi_us });
            for (place, (number, state)) in channel.axis_states().enumerate() {
                if let (Some(entry), Some(axis)) = (status.axes.get_mut(number), sources.axes.get(number)) {
                    of_axis(entry, axis);
                    entry.node = sources.buses.node(number);
                    let shown = device.axis_condition(place);
                    entry.indicators = Indicators {
                        module,
                        network,
                        axis: shown.as_ref().map_or(Indication::OFF, visualization::axis_status),
                        line: shown.as_ref().map_or(Line::default(), |axis| display::line(&node, axis)),
                        several: entry.indicators.several,
                        minor_fault: shown.is_some_and(|axis| axis.minor_fault),
                    };
                    entry.controller = controller;
                    entry.lost_updates = u32::try_from(lost_updates).unwrap_or(u32::MAX);
                    let counts =
                        |program: &CipProgram| low_word(program.counts(axis.feedback().position.get()).value);
                    entry.position_counts = channel.program(number).map_or(0, counts);
                    entry.wait = sources.changes.wait(now, number, axis);
                    entry.cip_axis_state = state.code().0;
                }
            }
        }
        for channel in sources.assemblies {
            fill_assembly(&mut self.status, channel, now, sources);
        }
    }
}

/// The axes of a device with assemblies. They have no states of CIP Motion: what is shown are those that come nearest.
fn fill_assembly(
    status: &mut BoxStatus,
    channel: &AssemblyChannel,
    now: MonotonicTime,
    sources: &Sources<'_>,
) {
    let counts = channel.counts();
    status.counters.lost_updates += counts.lost_updates;
    status.counters.refused_frames += counts.refused;
    let controller =
        channel.owner().map(|(address, update_period_us)| Controller { address, update_period_us });
    let network = channel.network_status();
    let axes = || channel.members().filter_map(|number| sources.axes.get(number));
    let module = if axes().any(|axis| axis.fault().is_some()) {
        ModuleState::MajorRecoverableFault
    } else if axes().any(|axis| axis.may_have_torque()) {
        ModuleState::Operational
    } else {
        ModuleState::Standby
    };
    for (number, scale) in channel.members().zip(channel.scales()) {
        if let (Some(entry), Some(axis)) = (status.axes.get_mut(number), sources.axes.get(number)) {
            of_axis(entry, axis);
            entry.node = sources.buses.node(number);
            entry.indicators = Indicators { module, network, ..Indicators::NONE };
            entry.controller = controller;
            entry.lost_updates = u32::try_from(counts.lost_updates).unwrap_or(u32::MAX);
            entry.position_counts = scale.counts(axis.feedback().position.get()).map_or(0, low_word);
            entry.wait = sources.changes.wait(now, number, axis);
            entry.cip_axis_state = state_code(axis.state()).0;
        }
    }
}

/// The state of CIP Motion that comes nearest to one of the generic model.
fn state_code(state: DriveState) -> AxisStateCode {
    match state {
        DriveState::NotReady => AxisStateCode::INITIALIZING,
        DriveState::Inhibited => AxisStateCode::START_INHIBITED,
        DriveState::AwaitingPower => AxisStateCode::PRE_CHARGE,
        DriveState::Ready => AxisStateCode::STOPPED,
        DriveState::Starting => AxisStateCode::STARTING,
        DriveState::Operating => AxisStateCode::RUNNING,
        DriveState::Testing => AxisStateCode::TESTING,
        DriveState::Stopping => AxisStateCode::STOPPING,
        DriveState::FaultReaction => AxisStateCode::ABORTING,
        DriveState::Faulted => AxisStateCode::MAJOR_FAULTED,
        DriveState::Shutdown => AxisStateCode::SHUTDOWN,
    }
}

/// The least state of all buses, and the largest phase error.
fn worst(locks: &[PhaseLock]) -> Phase {
    let phases = || locks.iter().map(PhaseLock::phase);
    let error = phases().map(|phase| phase.error).max_by_key(|error| error.magnitude());
    Phase {
        state: phases().map(|phase| phase.state).min().unwrap_or_default(),
        error: error.unwrap_or_default(),
    }
}

fn of_axis(entry: &mut AxisStatus, axis: &AxisChannel) {
    let feedback = axis.feedback();
    let counters = axis.counters();
    entry.state = axis.state();
    entry.owner = axis.owner();
    entry.mode = feedback.mode;
    entry.status = feedback.status;
    entry.inhibits = feedback.inhibits.union(axis.awaited().map_or(Inhibits::empty(), Awaited::inhibits));
    entry.fault = axis.fault().map(|fault| fault.cause);
    entry.fault_vendor_code = axis.fault().map_or(0, |fault| fault.vendor_code);
    entry.position = feedback.position;
    entry.velocity = feedback.velocity;
    entry.torque = feedback.torque;
    entry.following_error = feedback.following_error;
    entry.commands = counters.commands;
    entry.lost_telegrams = counters.lost_telegrams;
    entry.saturated = counters.saturated;
    entry.faults = counters.faults;
    entry.image = ImageStatus::of(axis.command(), feedback);
    entry.totals = axis.totals();
}

/// The DINT that a position is on the controller's side: it wraps.
fn low_word(counts: i64) -> i32 {
    let [a, b, c, d, ..] = counts.to_le_bytes();
    i32::from_le_bytes([a, b, c, d])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::latest::latest;

    fn at(millis: i64) -> MonotonicTime {
        MonotonicTime::ZERO + DurationNs::from_millis(millis)
    }

    #[test]
    fn status_is_published_at_a_change_and_every_ten_milliseconds() {
        let (publisher, reader) = latest(BoxStatus::STARTING);
        let mut publication = Publication::new(publisher, DurationNs::from_millis(2), 0, (&[], &[]));
        let (buses, changes) = (Buses::default(), Changes::new(&[]));
        let mut publish = |millis, changed, stopping| {
            let sources = Sources {
                stopping,
                buses: &buses,
                devices: &[],
                assemblies: &[],
                axes: &[],
                changes: &changes,
                locks: &[],
            };
            publication.publish(at(millis), changed, &sources);
            let status = reader.read();
            (status.uptime, status.state)
        };
        let uptime = DurationNs::from_millis;
        assert_eq!(publish(100, false, false), (uptime(0), BoxState::READY));
        assert_eq!(publish(109, false, false), (uptime(0), BoxState::READY), "nothing is new");
        assert_eq!(publish(110, false, false), (uptime(10), BoxState::READY));
        assert_eq!(publish(111, true, false), (uptime(11), BoxState::READY), "an axis has changed");
        assert_eq!(publish(112, false, true), (uptime(12), BoxState::STOPPING));
    }

    #[test]
    fn call_late_by_more_than_half_a_cycle_is_counted() {
        let (publisher, _) = latest(BoxStatus::STARTING);
        let cycle = DurationNs::from_millis(2);
        let mut publication = Publication::new(publisher, cycle, 0, (&[], &[]));
        for micros in [0, 1_000, 1_001, 20] {
            publication.count_lateness(DurationNs::from_micros(micros), cycle);
        }
        let status = &publication.status;
        assert_eq!((status.counters.late_cycles, status.lateness_max_ns), (1, 1_001_000));
        assert_eq!(status.lateness.counts, [1, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0]);
        assert_eq!(status.lateness.sum_ns, 2_021_000);
    }

    #[test]
    fn bus_that_fails_is_lost_only_if_it_was_up() {
        let down = Outline { stopping: false, up: false, connections: 1 };
        assert_eq!(down.state(BoxState::STARTING), BoxState::PHASE_UP);
        assert_eq!(down.state(BoxState::RUNNING), BoxState::BUS_LOST);
        assert_eq!(Outline { up: true, ..down }.state(BoxState::BUS_LOST), BoxState::RUNNING);
        assert_eq!(Outline { stopping: true, ..down }.state(BoxState::RUNNING), BoxState::STOPPING);
    }
}
