//! The engine of the box: everything that happens in a cycle, without sockets, clocks and threads.
//!
//! ```text
//! receive south -> axes take feedback -> receive north -> devices and axes exchange -> axes fill the telegrams
//!               -> send south -> send north -> publish
//! ```
//!
//! The cycle thread of the box calls [`Engine::cycle`] with real ports and clocks, the whole-system tests with queues and
//! virtual time. After start it neither allocates, locks, logs nor waits: what people should know leaves as a
//! [`Notice`] through a bounded queue. Commissioning is start: it compiles the programs of the drives and allocates
//! before their cyclic operation begins. Drives that come later are commissioned beside it, by the
//! [`bus::commissioner`].

pub mod access;
pub mod axis;
pub mod build;
pub mod bus;
pub mod device;
pub mod notice;
pub mod port;

use profile_generic::state::DriveState;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_sercos::master::event::{Output, Refusal};

use self::axis::AxisChannel;
use self::bus::Purpose;
use self::bus::sercos::SercosBus;
use self::device::DeviceChannel;
use self::notice::Notice;
use self::port::{FRAME_MAX, NorthPort, SouthPort};
use crate::latest::Publisher;
use crate::mapping::Mapping;
use crate::status::{AxisStatus, BoxState, BoxStatus, Indicators, PHASE_NONE};

/// Frames taken from the bus in one cycle: eight telegrams on two ports, and as many strays.
const FRAMES_PER_CYCLE: usize = 32;

/// Longest time between two cycles, so that the north side is served when the bus is silent.
const IDLE_INTERVAL: DurationNs = DurationNs::from_millis(1);

/// The engine.
#[derive(Debug)]
pub struct Engine {
    mapping: Mapping,
    bus: SercosBus,
    devices: Vec<DeviceChannel>,
    axes: Vec<AxisChannel>,
    /// The generic state and fault of each axis that was told last.
    told: Vec<(DriveState, bool)>,
    notices: rtrb::Producer<Notice>,
    publisher: Publisher<BoxStatus>,
    status: BoxStatus,
    cycle_time: DurationNs,
    started: Option<MonotonicTime>,
    due: Option<MonotonicTime>,
    /// When telegrams were sent last.
    sent_at: Option<SystemTime>,
    stopping: bool,
}

/// The parts of an engine; [`build`] makes them from a configuration.
#[derive(Debug)]
pub struct Parts {
    /// The mapping tables.
    pub mapping: Mapping,
    /// The bus.
    pub bus: SercosBus,
    /// The motion devices.
    pub devices: Vec<DeviceChannel>,
    /// All axes.
    pub axes: Vec<AxisChannel>,
    /// What people should know goes there; when it is full, notices are dropped.
    pub notices: rtrb::Producer<Notice>,
    /// The status of the box goes there.
    pub publisher: Publisher<BoxStatus>,
}

impl Engine {
    /// An engine of these parts.
    #[must_use]
    pub fn new(parts: Parts) -> Self {
        let Parts { mapping, bus, devices, axes, notices, publisher } = parts;
        let mut status = BoxStatus::STARTING;
        let cycle_ns = bus.master().config().cycle_ns;
        status.cycle_time_ns = cycle_ns;
        status.axis_count = u8::try_from(axes.len()).unwrap_or(u8::MAX);
        for channel in &devices {
            let several = channel.axis_states().count() > 1;
            for (place, (axis, _)) in channel.axis_states().enumerate() {
                if let Some(entry) = status.axes.get_mut(axis) {
                    entry.indicators.several = several;
                    entry.instance = u8::try_from(place + 1).unwrap_or(u8::MAX);
                    entry.device = channel.number();
                }
            }
        }
        let told = axes.iter().map(|axis| (axis.state(), false)).collect();
        Self {
            mapping,
            bus,
            devices,
            told,
            axes,
            notices,
            publisher,
            status,
            cycle_time: DurationNs(i64::from(cycle_ns)),
            started: None,
            due: None,
            sent_at: None,
            stopping: false,
        }
    }

    /// The axes in the order of the configuration.
    #[must_use]
    pub fn axes(&self) -> &[AxisChannel] {
        &self.axes
    }

    /// The axes, for a north side that speaks in the generic model: see [`AxisChannel::from_north`].
    pub fn axes_mut(&mut self) -> &mut [AxisChannel] {
        &mut self.axes
    }

    /// The devices in the order of the configuration.
    #[must_use]
    pub fn devices(&self) -> &[DeviceChannel] {
        &self.devices
    }

    /// The bus.
    #[must_use]
    pub fn bus(&self) -> &SercosBus {
        &self.bus
    }

    /// The status as it was published last.
    #[must_use]
    pub fn status(&self) -> &BoxStatus {
        &self.status
    }

    /// Whether system time can be trusted by the devices, and which clock it comes from.
    pub fn set_sync(&mut self, sync: profile_cip::target::motion_device::SyncState) {
        for channel in &mut self.devices {
            channel.device_mut().set_sync(sync);
        }
    }

    /// Ends operation: the axes stop as on a lost command, then the bus goes down. [`Self::is_stopped`] tells when.
    pub fn stop(&mut self, now: MonotonicTime, system: SystemTime) {
        self.stopping = true;
        for axis in &mut self.axes {
            axis.end(now, system);
        }
    }

    /// Whether every axis is without torque and the bus is down after [`Self::stop`].
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.stopping && self.bus.master().phase().is_none()
    }

    /// One cycle. `north` has a port for each device. Returns when the next one is due.
    pub fn cycle(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        north: &mut [&mut dyn NorthPort],
        south: &mut dyn SouthPort,
    ) -> MonotonicTime {
        let started = *self.started.get_or_insert(now);
        self.count_lateness(now);
        self.collect(now, south);
        let stepped = self.bus.take_cycle();
        if stepped {
            // The drives capture their values when the telegrams pass them.
            let sampled = self.sent_at.unwrap_or(system);
            for (number, axis) in self.axes.iter_mut().enumerate() {
                axis.from_drive(now, system, sampled, self.bus.feedback(number));
            }
        }
        self.run_bus(now, system);
        for (channel, port) in self.devices.iter_mut().zip(north.iter_mut()) {
            channel.receive(now, system, &mut **port);
        }
        {
            let Self { devices, mapping, axes, bus, notices, .. } = self;
            for channel in devices {
                channel.exchange(now, system, mapping, axes, &mut |notice| tell(notices, notice));
                channel.attributes(mapping, axes, bus);
            }
        }
        let acts_at = system + self.cycle_time;
        for (number, axis) in self.axes.iter_mut().enumerate() {
            self.bus.command(number, |telegram| axis.to_drive(now, system, acts_at, telegram));
        }
        if self.send(now, south) {
            self.sent_at = Some(system);
        }
        for (channel, port) in self.devices.iter_mut().zip(north.iter_mut()) {
            channel.transmit(now, system, &mut **port);
        }
        if self.stopping && !self.axes.iter().any(AxisChannel::may_have_torque) {
            self.bus.stop();
        }
        self.tell_changes();
        self.publish(now, started);
        let idle = now + IDLE_INTERVAL.max(self.cycle_time);
        let due = match self.bus.master().wake_at() {
            Some(wake) if wake <= idle => wake,
            _ => now + IDLE_INTERVAL,
        };
        self.due = Some(due);
        due
    }

    fn count_lateness(&mut self, now: MonotonicTime) {
        let Some(due) = self.due else { return };
        let late = now.since(due).as_nanos().max(0);
        self.status.lateness_max_ns =
            self.status.lateness_max_ns.max(u32::try_from(late).unwrap_or(u32::MAX));
        if late > self.cycle_time.as_nanos() / 2 {
            self.status.counters.late_cycles += 1;
        }
    }

    /// Takes what came back from the bus.
    fn collect(&mut self, now: MonotonicTime, south: &mut dyn SouthPort) {
        let mut buffer = [0; FRAME_MAX];
        for _ in 0..FRAMES_PER_CYCLE {
            let Some((port, length)) = south.receive(&mut buffer) else { break };
            // A refused frame is counted by the master and changes nothing.
            let _ = self.bus.master_mut().handle_frame(now, port, &buffer[..length]);
        }
    }

    fn run_bus(&mut self, now: MonotonicTime, system: SystemTime) {
        let Self { mapping, bus, devices, axes, notices, .. } = self;
        bus.set_idle(devices.iter().all(|channel| channel.device().connection().is_none()));
        bus.run(
            now,
            system,
            mapping,
            axes,
            &mut |axes, answer| match answer.purpose {
                Purpose::Attribute { .. } => {
                    for channel in devices.iter_mut() {
                        if channel.answer(&answer, axes) {
                            break;
                        }
                    }
                }
                Purpose::Diagnosis => {
                    let word = answer.result.as_ref().ok().and_then(|(data, _)| unsigned(data));
                    axes[answer.axis].diagnostic_word(now, system, answer.item, word);
                }
                Purpose::Capture(access, generation) => {
                    let result = answer.result.as_ref().map(|(data, _)| data.as_slice());
                    axes[answer.axis].capture_answer(access, generation, result.map_err(|failure| *failure));
                }
                Purpose::Procedure(access, generation) => {
                    axes[answer.axis].procedure_answer(
                        now,
                        access,
                        generation,
                        answer.result.map(|(_, progress)| progress),
                    );
                }
                // Whether it helped shows in the drive's status word.
                Purpose::FaultReset => {}
            },
            &mut |notice| tell(notices, notice),
        );
    }

    /// Sends the telegrams that are due; `false` when none was.
    fn send(&mut self, now: MonotonicTime, south: &mut dyn SouthPort) -> bool {
        let mut any = false;
        while let Some(Output::Transmit { port, frame }) = self.bus.master_mut().poll(now) {
            if !south.send(now, port, frame) {
                self.status.counters.send_failures += 1;
            }
            any = true;
        }
        any
    }

    fn tell_changes(&mut self) {
        for (number, (axis, told)) in self.axes.iter().zip(&mut self.told).enumerate() {
            let number = u8::try_from(number).unwrap_or(u8::MAX);
            let state = axis.state();
            if state != told.0 {
                tell(&mut self.notices, Notice::State { axis: number, from: told.0, to: state });
                told.0 = state;
            }
            if let Some(fault) = axis.fault().filter(|_| !told.1) {
                tell(&mut self.notices, Notice::Fault { axis: number, fault, loss: axis.loss() });
            }
            told.1 = axis.fault().is_some();
        }
    }

    fn publish(&mut self, now: MonotonicTime, started: MonotonicTime) {
        let master = self.bus.master();
        let statistics = master.statistics();
        let status = &mut self.status;
        status.phase = master.phase().map_or(PHASE_NONE, |phase| phase.0);
        status.uptime = now.since(started);
        status.connections = 0;
        status.counters.cycles = statistics.cycles;
        status.counters.lost_telegrams = statistics.at_missing;
        status.counters.refused_frames = Refusal::ALL.iter().map(|reason| statistics.refused(*reason)).sum();
        status.counters.lost_updates = 0;
        for channel in &self.devices {
            let device = channel.device();
            status.connections += u8::from(device.connection().is_some());
            let lost = device.counters().lost_updates;
            status.counters.lost_updates += lost;
            status.counters.refused_frames += channel.counters().refused;
            let (module, network) = (device.module_state(), channel.network_status());
            for (place, (axis, state)) in channel.axis_states().enumerate() {
                if let (Some(entry), Some(axis)) = (status.axes.get_mut(axis), self.axes.get(axis)) {
                    entry.indicators = Indicators {
                        module,
                        network,
                        axis: device.axis_indication(place),
                        line: device.display_line(place),
                        several: entry.indicators.several,
                        minor_fault: device.axis_condition(place).is_some_and(|axis| axis.minor_fault),
                    };
                    fill(entry, axis);
                    entry.cip_axis_state = state.code().0;
                    entry.lost_updates = u32::try_from(lost).unwrap_or(u32::MAX);
                }
            }
        }
        let was_up = !matches!(status.state, BoxState::STARTING | BoxState::PHASE_UP);
        status.state = match (self.stopping, status.phase, status.connections) {
            (true, ..) => BoxState::STOPPING,
            (_, 4, 0) => BoxState::READY,
            (_, 4, _) => BoxState::RUNNING,
            _ if was_up => BoxState::BUS_LOST,
            _ => BoxState::PHASE_UP,
        };
        self.publisher.publish(status);
    }
}

fn fill(entry: &mut AxisStatus, axis: &AxisChannel) {
    let feedback = axis.feedback();
    let counters = axis.counters();
    entry.state = axis.state();
    entry.mode = feedback.mode;
    entry.status = feedback.status;
    entry.inhibits = feedback.inhibits;
    entry.fault = axis.fault().map(|fault| fault.cause);
    entry.fault_vendor_code = axis.fault().map_or(0, |fault| fault.vendor_code);
    entry.position = feedback.position;
    entry.position_counts = low_word(axis.north().counts(feedback.position.get()).value);
    entry.velocity = feedback.velocity;
    entry.torque = feedback.torque;
    entry.following_error = feedback.following_error;
    entry.commands = counters.commands;
    entry.lost_telegrams = counters.lost_telegrams;
    entry.saturated = counters.saturated;
    entry.faults = counters.faults;
}

/// The DINT that a position is on the controller's side: it wraps.
fn low_word(counts: i64) -> i32 {
    let [a, b, c, d, ..] = counts.to_le_bytes();
    i32::from_le_bytes([a, b, c, d])
}

/// A word of one, two or four bytes.
fn unsigned(data: &[u8]) -> Option<u32> {
    if !matches!(data.len(), 1 | 2 | 4) {
        return None;
    }
    let mut bytes = [0; 4];
    bytes[..data.len()].copy_from_slice(data);
    Some(u32::from_le_bytes(bytes))
}

fn tell(notices: &mut rtrb::Producer<Notice>, notice: Notice) {
    // A full queue drops the notice; the state itself stands in the published status.
    let _ = notices.push(notice);
}
