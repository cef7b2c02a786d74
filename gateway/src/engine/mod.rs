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
//! [`bus::sercos::commissioner`].

pub mod access;
pub mod axis;
pub mod build;
pub mod bus;
pub mod device;
pub mod notice;
pub mod port;

use std::cell::RefCell;

use profile_generic::state::DriveState;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

use self::axis::AxisChannel;
use self::bus::sercos::SercosBus;
use self::bus::{Bus, Buses, Purpose};
use self::device::DeviceChannel;
use self::notice::Notice;
use self::port::{NorthPort, SouthPort};
use crate::latest::Publisher;
use crate::mapping::Mapping;
use crate::status::{AxisStatus, BoxState, BoxStatus, Indicators, PHASE_NONE};

/// Most buses of a box.
pub const BUSES_MAX: usize = 9;

/// Time between two calls while no bus has anything to do by itself, so that the north side is served.
const IDLE_INTERVAL: DurationNs = DurationNs::from_millis(1);

/// The same of a box whose buses are slow: a part of the shortest cycle, up to this.
const IDLE_INTERVAL_MAX: DurationNs = DurationNs::from_millis(4);
const IDLE_CALLS_PER_CYCLE: i64 = 4;

/// Rather than call so shortly before a cycle of a bus, the engine sleeps until that.
const QUIET_BEFORE_CYCLE: DurationNs = DurationNs::from_micros(250);

/// The engine.
#[derive(Debug)]
pub struct Engine {
    mapping: Mapping,
    buses: Buses,
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
    /// When each bus began its last cycle.
    sent_at: [Option<SystemTime>; BUSES_MAX],
    stopping: bool,
}

/// The parts of an engine; [`build`] makes them from a configuration.
#[derive(Debug)]
pub struct Parts {
    /// The mapping tables.
    pub mapping: Mapping,
    /// The buses.
    pub buses: Buses,
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
        let Parts { mapping, buses, devices, axes, notices, publisher } = parts;
        let mut status = BoxStatus::STARTING;
        let cycle_time = buses.iter().map(Bus::cycle_time).min().unwrap_or(IDLE_INTERVAL);
        status.cycle_time_ns = u32::try_from(cycle_time.as_nanos()).unwrap_or(u32::MAX);
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
            buses,
            devices,
            told,
            axes,
            notices,
            publisher,
            status,
            cycle_time,
            started: None,
            due: None,
            sent_at: [None; BUSES_MAX],
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

    /// The buses.
    #[must_use]
    pub fn buses(&self) -> &Buses {
        &self.buses
    }

    /// The SERCOS bus, where there is one.
    #[must_use]
    pub fn sercos(&self) -> Option<&SercosBus> {
        self.buses.sercos()
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

    /// Ends operation: the axes stop as on a lost command, then the buses go down. [`Self::is_stopped`] tells when.
    pub fn stop(&mut self, now: MonotonicTime, system: SystemTime) {
        self.stopping = true;
        for axis in &mut self.axes {
            axis.end(now, system);
        }
    }

    /// Whether every axis is without torque and every bus is down after [`Self::stop`].
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.stopping && self.buses.iter().all(Bus::is_stopped)
    }

    /// One call of the cycle. `north` has a port for each device, `south` one for each bus. Returns when the next one is due.
    ///
    /// A bus whose cycle is about to begin has its axes do a step: they take what their drives sent in the cycle that ends,
    /// and give what they are to do in the next one. Calls in between serve the north side and what is beside the cycle.
    pub fn cycle(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        north: &mut [&mut dyn NorthPort],
        south: &mut [SouthPort<'_>],
    ) -> MonotonicTime {
        let started = *self.started.get_or_insert(now);
        self.count_lateness(now);
        let mut due = [false; BUSES_MAX];
        let mut stepped = [false; BUSES_MAX];
        for (place, (bus, port)) in self.buses.iter_mut().zip(south.iter_mut()).enumerate() {
            bus.receive(now, port);
            due[place] = bus.is_due(now);
            stepped[place] = due[place] && bus.take_cycle();
        }
        for (number, axis) in self.axes.iter_mut().enumerate() {
            let place = self.buses.of(number);
            if stepped[place] {
                // The drives capture their values when the telegrams pass them.
                let sampled = self.sent_at[place].unwrap_or(system);
                axis.from_drive(now, system, sampled, self.buses.get(place).feedback(number));
            }
        }
        self.run_buses(now, system);
        for (channel, port) in self.devices.iter_mut().zip(north.iter_mut()) {
            channel.receive(now, system, &mut **port);
        }
        {
            let Self { devices, mapping, axes, buses, notices, .. } = self;
            for channel in devices {
                channel.exchange(now, system, mapping, axes, &mut |notice| tell(notices, notice));
                channel.attributes(mapping, axes, buses);
            }
        }
        for (number, axis) in self.axes.iter_mut().enumerate() {
            let place = self.buses.of(number);
            if due[place] {
                let bus = self.buses.get_mut(place);
                let acts_at = system + bus.cycle_time();
                bus.command(number, &mut |telegram| axis.to_drive(now, system, acts_at, telegram));
            }
        }
        for (place, (bus, port)) in self.buses.iter_mut().zip(south.iter_mut()).enumerate() {
            let sent = bus.send(now, port);
            self.status.counters.send_failures += sent.failures;
            if sent.cycle {
                self.sent_at[place] = Some(system);
            }
        }
        for (channel, port) in self.devices.iter_mut().zip(north.iter_mut()) {
            channel.transmit(now, system, &mut **port);
        }
        if self.stopping && !self.axes.iter().any(AxisChannel::may_have_torque) {
            self.buses.iter_mut().for_each(|bus| bus.stop(now));
        }
        self.tell_changes();
        self.publish(now, started);
        let due = self.next_due(now);
        self.due = Some(due);
        due
    }

    /// When the next call is due.
    fn next_due(&self, now: MonotonicTime) -> MonotonicTime {
        let wake = self.buses.iter().filter_map(Bus::wake_at).min();
        let patience = self.buses.iter().map(Bus::patience).min().unwrap_or(IDLE_INTERVAL);
        let part = DurationNs(self.cycle_time.as_nanos() / IDLE_CALLS_PER_CYCLE);
        let interval = part.max(IDLE_INTERVAL).min(IDLE_INTERVAL_MAX);
        let idle = now + interval.max(patience);
        match wake {
            Some(wake) if wake <= idle + QUIET_BEFORE_CYCLE => wake,
            _ => now + interval,
        }
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

    fn run_buses(&mut self, now: MonotonicTime, system: SystemTime) {
        let Self { mapping, buses, devices, axes, notices, .. } = self;
        let idle = devices.iter().all(|channel| channel.device().connection().is_none());
        // What an answer leads to is told beside what the bus tells, never while it does.
        let notices = RefCell::new(notices);
        for bus in buses.iter_mut() {
            bus.set_idle(idle);
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
                    Purpose::OwnWords => {
                        let data = answer.result.as_ref().ok().map(|(data, _)| data.as_slice());
                        let said = axes[answer.axis].own_words_read(answer.item, data);
                        let axis = u8::try_from(answer.axis).unwrap_or(u8::MAX);
                        if let Some(said) = said {
                            tell(&mut notices.borrow_mut(), Notice::DriveSays { axis, said });
                        }
                    }
                    Purpose::Capture(access, generation) => {
                        let result = answer.result.as_ref().map(|(data, _)| data.as_slice());
                        axes[answer.axis].capture_answer(
                            access,
                            generation,
                            result.map_err(|failure| *failure),
                        );
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
                &mut |notice| tell(&mut notices.borrow_mut(), notice),
            );
        }
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
        let status = &mut self.status;
        status.phase = self.buses.iter().find_map(Bus::phase).unwrap_or(PHASE_NONE);
        status.uptime = now.since(started);
        status.connections = 0;
        (status.counters.cycles, status.counters.lost_telegrams, status.counters.refused_frames) = (0, 0, 0);
        for counts in self.buses.iter().map(Bus::counts) {
            status.counters.cycles += counts.cycles;
            status.counters.lost_telegrams += counts.lost;
            status.counters.refused_frames += counts.refused;
        }
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
        let up = self.buses.iter().all(Bus::is_up);
        status.state = match (self.stopping, up, status.connections) {
            (true, ..) => BoxState::STOPPING,
            (_, true, 0) => BoxState::READY,
            (_, true, _) => BoxState::RUNNING,
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
