//! The engine of the box: everything that happens in a cycle, without sockets, clocks and threads.
//!
//! ```text
//! lead before the instant   receive south -> axes take feedback -> receive north -> devices and axes exchange
//!                           -> axes fill the telegrams -> the bus builds its frames
//! at the instant            send south -> send north -> publish
//! ```
//!
//! Each bus has a grid of instants at which its cycles begin. Set-points are computed for the instant of the grid at which drives
//! take them, whenever the engine is called; a cycle that is left out leaves the grid where it is. Everything that moves an axis works
//! on the local clock, the monotonic one; system time is made from it at the north side ([`TimeBase`]).
//!
//! The cycle thread of the box calls [`Engine::cycle`] with real ports and clocks, the whole-system tests with queues and
//! virtual time. After start it neither allocates, locks, logs nor waits: what people should know leaves as a
//! [`Notice`] through a bounded queue. Commissioning is start: it compiles the programs of the drives and allocates
//! before their cyclic operation begins. Drives that come later are commissioned beside it, by the
//! [`bus::sercos::commissioner`].

pub mod access;
pub mod admission;
pub mod axis;
pub mod build;
pub mod bus;
pub mod device;
pub mod notice;
pub mod port;

use std::cell::RefCell;

use profile_cip::device::motion_device::SyncState;
use profile_cip::device::visualization::display::{self, Line};
use profile_cip::device::visualization::{self, Indication};
use profile_generic::fault::FaultCause;
use profile_generic::inhibit::Inhibits;
use profile_generic::state::DriveState;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_generic::time_base::{TimeBase, TimeSample};

use self::axis::rest::Unrested;
use self::axis::{Awaited, AxisChannel};
use self::bus::sercos::SercosBus;
use self::bus::{Bus, Buses, Cycle, Purpose};
use self::device::DeviceChannel;
use self::notice::Notice;
use self::port::{NorthPort, SouthPort};
use crate::latest::Publisher;
use crate::mapping::{CipProgram, Mapping};
use crate::status::{AxisStatus, AxisWait, BoxState, BoxStatus, Indicators, PHASE_NONE};

/// Most buses of a box.
pub const BUSES_MAX: usize = 9;

/// Time between two calls while no bus has anything to do by itself, so that the north side is served.
const IDLE_INTERVAL: DurationNs = DurationNs::from_millis(1);

/// The same of a box whose buses are slow: a part of the shortest cycle, up to this.
const IDLE_INTERVAL_MAX: DurationNs = DurationNs::from_millis(4);
const IDLE_CALLS_PER_CYCLE: i64 = 4;

/// Beyond the limits of the axes, before the buses of a box that ends go down whatever the axes do: telegrams take their time.
const END_MARGIN: DurationNs = DurationNs::from_secs(1);

/// Rather than call so shortly before a cycle of a bus, the engine sleeps until that.
const QUIET_BEFORE_CYCLE: DurationNs = DurationNs::from_micros(250);

/// How long an axis waits before it is told what for; ten times as long before it is told again.
const WAIT_TOLD: DurationNs = DurationNs::from_secs(1);

/// A wait of an axis.
#[derive(Debug, Clone, Copy, Default)]
struct Wait {
    /// What it waits for, and since when.
    since: Option<(Awaited, MonotonicTime)>,
    /// How long it may last until it is told, or told again.
    limit: DurationNs,
}

impl Wait {
    /// What the status says of it: nothing before the log would.
    fn shown(&self, now: MonotonicTime, axis: &AxisChannel) -> Option<AxisWait> {
        let (awaited, since) = self.since?;
        let time = now.since(since);
        let waiting = (time >= WAIT_TOLD).then(|| axis.waiting()).flatten()?;
        (waiting.awaited == awaited).then(|| AxisWait::new(waiting, time))
    }
}

/// What the state of the box follows from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Outline {
    stopping: bool,
    /// All buses are in cyclic operation.
    up: bool,
    /// Controllers that are connected.
    connections: u8,
}

/// How old the published status may be, where neither the box nor an axis has another state: people and supervisory systems read it.
const PUBLISH_PERIOD: DurationNs = DurationNs::from_millis(10);

/// The work for a cycle begins at most by this part of it before its instant: the answers of the drives have to be back by then.
const LEAD_DIVISOR: i64 = 10;

/// The engine.
#[derive(Debug)]
pub struct Engine {
    mapping: Mapping,
    buses: Buses,
    devices: Vec<DeviceChannel>,
    axes: Vec<AxisChannel>,
    /// The generic state and fault of each axis that was told last.
    told: Vec<(DriveState, Option<FaultCause>)>,
    /// What the axes wait for.
    waits: Vec<Wait>,
    /// When the status was published last, and what it was in outline.
    published: Option<(MonotonicTime, Outline)>,
    notices: rtrb::Producer<Notice>,
    publisher: Publisher<BoxStatus>,
    status: BoxStatus,
    cycle_time: DurationNs,
    /// How long before its instant the work for a cycle begins.
    lead: DurationNs,
    time: TimeBase,
    /// The time base has taken a sample.
    timed: bool,
    sync: SyncState,
    started: Option<MonotonicTime>,
    due: Option<MonotonicTime>,
    /// The cycle of each bus that is built and waits for its instant.
    prepared: [Option<MonotonicTime>; BUSES_MAX],
    /// By how much calls were late since the last cycle of each bus was built.
    late: [DurationNs; BUSES_MAX],
    /// When each bus began its last cycle: its instant on the grid.
    sent_at: [Option<MonotonicTime>; BUSES_MAX],
    stopping: bool,
    ending: Ending,
}

/// The end of a box: which axes are waited for, and how long.
#[derive(Debug)]
struct Ending {
    deadline: MonotonicTime,
    /// The axes that were on the move, or could be.
    awaited: Vec<bool>,
    /// Nobody is waited for any longer.
    over: bool,
    unrested: Vec<Unrested>,
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
    /// How long before its instant the work for a cycle begins; at most a tenth of the cycle counts.
    pub lead: DurationNs,
}

impl Engine {
    /// An engine of these parts.
    #[must_use]
    pub fn new(parts: Parts) -> Self {
        let Parts { mapping, buses, devices, axes, notices, publisher, lead } = parts;
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
        let told = axes.iter().map(|axis| (axis.state(), None)).collect();
        let ending = Ending {
            deadline: MonotonicTime::MAX,
            awaited: vec![false; axes.len()],
            over: false,
            unrested: Vec::with_capacity(axes.len()),
        };
        Self {
            mapping,
            buses,
            devices,
            told,
            published: None,
            waits: vec![Wait::default(); axes.len()],
            axes,
            notices,
            publisher,
            status,
            cycle_time,
            lead,
            time: TimeBase::new(TimeSample {
                at: MonotonicTime::ZERO,
                system: SystemTime::ZERO,
                rate_ppb: 0,
            }),
            timed: false,
            sync: SyncState::default(),
            started: None,
            due: None,
            prepared: [None; BUSES_MAX],
            late: [DurationNs::ZERO; BUSES_MAX],
            sent_at: [None; BUSES_MAX],
            stopping: false,
            ending,
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

    /// The program of the CIP side for an axis; `None` for one that is on no device.
    #[must_use]
    pub fn cip_program(&self, axis: usize) -> Option<&CipProgram> {
        self.devices.iter().find_map(|device| device.program(axis))
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

    /// Whether system time can be trusted by the devices, and which clock it comes from. The offset is that of the time base.
    pub fn set_sync(&mut self, sync: SyncState) {
        self.sync = SyncState { offset: self.time.offset().as_nanos(), ..sync };
        for channel in &mut self.devices {
            channel.device_mut().set_sync(self.sync);
        }
    }

    /// Takes a sample of system time, before each [`Self::cycle`]. A step is reported to the devices, which compensate the stamps of
    /// their controllers (clause 2-2); no axis follows it.
    pub fn feed_time(&mut self, sample: &TimeSample) {
        let step = if std::mem::replace(&mut self.timed, true) {
            self.time.feed(sample)
        } else {
            self.time = TimeBase::new(*sample);
            None
        };
        if self.time.offset().as_nanos() != self.sync.offset {
            self.set_sync(self.sync);
        }
        if let Some(step) = step {
            tell(&mut self.notices, Notice::TimeStep { step });
        }
    }

    /// System time over the local clock.
    #[must_use]
    pub fn time(&self) -> &TimeBase {
        &self.time
    }

    /// Ends operation: the axes stop as on a lost command, and when they stand, or have had all the time that their own limits
    /// give them, the buses go down. [`Self::is_stopped`] says when.
    pub fn stop(&mut self, now: MonotonicTime) {
        self.stopping = true;
        let system = self.time.system_at(now);
        let mut limit = DurationNs::ZERO;
        for (axis, awaited) in self.axes.iter_mut().zip(&mut self.ending.awaited) {
            *awaited = axis.is_stopping();
            axis.end(now, system);
            if *awaited {
                limit = limit.max(axis.stop_limit());
            }
        }
        self.ending.deadline = now + limit + END_MARGIN;
    }

    /// Ends the wait for axes that [`Self::stop`] has begun to stop: the buses go down now.
    pub fn hurry(&mut self, now: MonotonicTime) {
        self.ending.deadline = self.ending.deadline.min(now);
    }

    /// Whether no axis is waited for any longer and every bus is down after [`Self::stop`].
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.ending.over && self.buses.iter().all(Bus::is_stopped)
    }

    /// The axes that did not come to rest, or were not seen to, before the buses went down.
    #[must_use]
    pub fn unrested(&self) -> &[Unrested] {
        &self.ending.unrested
    }

    /// Whether the buses may go down; notes once which axes do not stand.
    fn may_go_down(&mut self, now: MonotonicTime) -> bool {
        let Ending { deadline, awaited, over, unrested } = &mut self.ending;
        let awaited = || self.axes.iter().enumerate().zip(&*awaited).filter(|(_, awaited)| **awaited);
        if !*over && (now >= *deadline || awaited().all(|((_, axis), _)| axis.has_stopped())) {
            *over = true;
            unrested.extend(awaited().filter_map(|((number, axis), _)| axis.unrested(number)));
        }
        *over
    }

    /// One call of the cycle. `north` has a port for each device, `south` one for each bus. Returns when the next one is due.
    ///
    /// A bus is called for twice in a cycle. A little before its instant its axes do a step: they take what their drives sent in the
    /// cycle that ends, and give what they are to do in the next one, for the instant of the grid at which drives take it. At the
    /// instant itself what was built goes out before anything else is done. Calls in between serve the north side and what is
    /// beside the cycle.
    pub fn cycle(
        &mut self,
        now: MonotonicTime,
        north: &mut [&mut dyn NorthPort],
        south: &mut [SouthPort<'_>],
    ) -> MonotonicTime {
        let started = *self.started.get_or_insert(now);
        let late = self.count_lateness(now);
        self.late.iter_mut().for_each(|known| *known = (*known).max(late));
        self.send_prepared(now, south);
        let mut due = [None; BUSES_MAX];
        for (place, (bus, port)) in self.buses.iter_mut().zip(south.iter_mut()).enumerate() {
            bus.receive(now, port);
            let lead = lead_of(bus.cycle_time(), self.lead);
            due[place] = match bus.next_cycle() {
                // Before there is a grid every call is a step.
                None => Some(now),
                Some(at) if self.prepared[place] == Some(at) || now + lead < at => None,
                Some(at) => Some(at),
            };
        }
        self.take_feedback(now, &due);
        self.run_buses(now);
        for (channel, port) in self.devices.iter_mut().zip(north.iter_mut()) {
            channel.receive(now, &self.time, &mut **port);
        }
        {
            let Self { devices, mapping, axes, buses, notices, time, .. } = self;
            for channel in devices {
                channel.exchange(now, time, mapping, axes, &mut |notice| tell(notices, notice));
                channel.attributes(mapping, axes, buses);
            }
        }
        self.fill_telegrams(now, &due);
        for (place, (bus, port)) in self.buses.iter_mut().zip(south.iter_mut()).enumerate() {
            if self.prepared[place].is_none_or(|at| now >= at) {
                let at = self.prepared[place].take().unwrap_or(now);
                self.status.counters.send_failures += send(bus, port, (now, at), &mut self.sent_at[place]);
            }
        }
        for (channel, port) in self.devices.iter_mut().zip(north.iter_mut()) {
            channel.transmit(now, &self.time, &mut **port);
        }
        let was_over = self.ending.over;
        if self.stopping && self.may_go_down(now) {
            if !was_over {
                // That these drives are not heard any more is no fault.
                let system = self.time.system_at(now);
                let free = self.axes.iter_mut().filter(|axis| !axis.may_have_torque());
                free.for_each(|axis| axis.leave_south(now, system));
            }
            self.buses.iter_mut().for_each(|bus| bus.stop(now));
        }
        let told = self.tell_changes();
        self.tell_waits(now);
        let outline = self.outline();
        let due = |(last, known): (MonotonicTime, _)| now.since(last) >= PUBLISH_PERIOD || known != outline;
        if told || self.published.is_none_or(due) {
            self.published = Some((now, outline));
            self.publish(now, started, outline);
        }
        let due = self.next_due(now);
        self.due = Some(due);
        due
    }

    /// Sends what was built ahead and whose instant has come. What could only go out much too late does not.
    fn send_prepared(&mut self, now: MonotonicTime, south: &mut [SouthPort<'_>]) {
        for (place, (bus, port)) in self.buses.iter_mut().zip(south.iter_mut()).enumerate() {
            let before = bus.next_cycle();
            bus.skip_late(now);
            let Some(at) = self.prepared[place] else { continue };
            if before != bus.next_cycle() {
                // It was left out; the axes do their step for another cycle.
                self.prepared[place] = None;
            } else if now >= at {
                self.status.counters.send_failures += send(bus, port, (now, at), &mut self.sent_at[place]);
                self.prepared[place] = None;
            }
        }
    }

    /// The axes of the buses that are due take what their drives sent.
    fn take_feedback(&mut self, now: MonotonicTime, due: &[Option<MonotonicTime>; BUSES_MAX]) {
        let mut stepped = [false; BUSES_MAX];
        for (place, bus) in self.buses.iter_mut().enumerate() {
            stepped[place] = due[place].is_some() && bus.take_cycle();
        }
        let system = self.time.system_at(now);
        for (number, axis) in self.axes.iter_mut().enumerate() {
            let place = self.buses.of(number);
            if stepped[place] {
                // The drives capture their values when the telegrams pass them.
                let sampled = self.sent_at[place].unwrap_or(now);
                axis.from_drive(now, system, sampled, self.buses.get(place).feedback(number));
            }
        }
    }

    /// The axes of the buses that are due give what their drives are to do, and the buses build their frames.
    fn fill_telegrams(&mut self, now: MonotonicTime, due: &[Option<MonotonicTime>; BUSES_MAX]) {
        let system = self.time.system_at(now);
        for (number, axis) in self.axes.iter_mut().enumerate() {
            let place = self.buses.of(number);
            if let Some(at) = due[place] {
                let bus = self.buses.get_mut(place);
                let span = bus.cycle_time();
                let ahead = span + lead_of(span, self.lead);
                let cycle = Cycle { acts_at: at + span, span, ahead, late: self.late[place] };
                bus.command(number, &mut |telegram| axis.to_drive(now, system, &cycle, telegram));
            }
        }
        for (place, bus) in self.buses.iter_mut().enumerate() {
            if let Some(at) = due[place].filter(|_| bus.next_cycle().is_some()) {
                bus.prepare();
                self.prepared[place] = Some(at);
                self.late[place] = DurationNs::ZERO;
            }
        }
    }

    /// When the next call is due.
    fn next_due(&self, now: MonotonicTime) -> MonotonicTime {
        let of = |(place, bus): (usize, &dyn Bus)| match self.prepared[place] {
            Some(at) => Some(at),
            None => {
                let begin = bus.next_cycle().map(|at| at - lead_of(bus.cycle_time(), self.lead));
                // A cycle that could not begin, as its frames have no room, waits for what the bus says.
                let begin = begin.filter(|at| *at > now);
                bus.wake_at().into_iter().chain(begin).min()
            }
        };
        let wake = self.buses.iter().enumerate().filter_map(of).min();
        let patience = self.buses.iter().map(Bus::patience).min().unwrap_or(IDLE_INTERVAL);
        let part = DurationNs(self.cycle_time.as_nanos() / IDLE_CALLS_PER_CYCLE);
        let interval = part.max(IDLE_INTERVAL).min(IDLE_INTERVAL_MAX);
        let idle = now + interval.max(patience);
        match wake {
            Some(wake) if wake <= idle + QUIET_BEFORE_CYCLE => wake,
            _ => now + interval,
        }
    }

    /// Counts a late call; by how much it is late.
    fn count_lateness(&mut self, now: MonotonicTime) -> DurationNs {
        let Some(due) = self.due else { return DurationNs::ZERO };
        let late = now.since(due).as_nanos().max(0);
        self.status.lateness_max_ns =
            self.status.lateness_max_ns.max(u32::try_from(late).unwrap_or(u32::MAX));
        if late > self.cycle_time.as_nanos() / 2 {
            self.status.counters.late_cycles += 1;
        }
        DurationNs(late)
    }

    fn run_buses(&mut self, now: MonotonicTime) {
        let system = self.time.system_at(now);
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
                    Purpose::DiagnosticMessage => {
                        let data = answer.result.as_ref().ok().map(|(data, _)| data.as_slice());
                        let said = axes[answer.axis].diagnostic_message_read(answer.item, data);
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

    /// Tells states and faults that are new; whether there are any.
    fn tell_changes(&mut self) -> bool {
        let mut changed = false;
        for (number, (axis, told)) in self.axes.iter().zip(&mut self.told).enumerate() {
            let number = u8::try_from(number).unwrap_or(u8::MAX);
            let now = (axis.state(), axis.fault().map(|fault| fault.cause));
            if *told == now {
                continue;
            }
            changed = true;
            let before = std::mem::replace(told, now);
            if now.0 != before.0 {
                tell(&mut self.notices, Notice::State { axis: number, from: before.0, to: now.0 });
            }
            // Once more when it is known which one the drive has.
            if let Some(fault) = axis.fault().filter(|fault| before.1 != Some(fault.cause)) {
                let (loss, trip, jump) = (axis.loss(), axis.tripped(), axis.jump());
                tell(&mut self.notices, Notice::Fault { axis: number, fault, loss, trip, jump });
            }
        }
        changed
    }

    /// Tells of axes that wait for long.
    fn tell_waits(&mut self, now: MonotonicTime) {
        for (number, (axis, wait)) in self.axes.iter().zip(&mut self.waits).enumerate() {
            let awaited = axis.awaited();
            let Some((known, since)) = wait.since.filter(|(known, _)| Some(*known) == awaited) else {
                *wait = Wait { since: awaited.map(|awaited| (awaited, now)), limit: WAIT_TOLD };
                continue;
            };
            let time = now.since(since);
            if time < wait.limit {
                continue;
            }
            wait.limit = wait.limit * 10;
            if let Some(waiting) = axis.waiting().filter(|waiting| waiting.awaited == known) {
                let (axis, wait) = (u8::try_from(number).unwrap_or(u8::MAX), AxisWait::new(waiting, time));
                tell(&mut self.notices, Notice::Waiting { axis, wait });
            }
        }
    }

    fn outline(&self) -> Outline {
        let connections = self.devices.iter().filter(|channel| channel.device().connection().is_some());
        Outline {
            stopping: self.stopping,
            up: self.buses.iter().all(Bus::is_up),
            connections: u8::try_from(connections.count()).unwrap_or(u8::MAX),
        }
    }

    fn publish(&mut self, now: MonotonicTime, started: MonotonicTime, outline: Outline) {
        let status = &mut self.status;
        status.phase = self.buses.iter().find_map(Bus::phase).unwrap_or(PHASE_NONE);
        status.uptime = now.since(started);
        let Outline { stopping, up, connections } = outline;
        status.connections = connections;
        (status.counters.cycles, status.counters.lost_telegrams, status.counters.refused_frames) = (0, 0, 0);
        for counts in self.buses.iter().map(Bus::counts) {
            status.counters.cycles += counts.cycles;
            status.counters.lost_telegrams += counts.lost;
            status.counters.refused_frames += counts.refused;
        }
        status.counters.lost_updates = 0;
        for channel in &self.devices {
            let device = channel.device();
            let lost = device.counters().lost_updates;
            status.counters.lost_updates += lost;
            status.counters.refused_frames += channel.counters().refused;
            let (module, network) = (device.module_state(), channel.network_status());
            let node = device.node_condition();
            for (place, (number, state)) in channel.axis_states().enumerate() {
                let shown = device.axis_condition(place);
                if let (Some(entry), Some(axis)) = (status.axes.get_mut(number), self.axes.get(number)) {
                    entry.indicators = Indicators {
                        module,
                        network,
                        axis: shown.as_ref().map_or(Indication::OFF, visualization::axis_status),
                        line: shown.as_ref().map_or(Line::default(), |axis| display::line(&node, axis)),
                        several: entry.indicators.several,
                        minor_fault: shown.is_some_and(|axis| axis.minor_fault),
                    };
                    fill(entry, axis);
                    let counts =
                        |program: &CipProgram| low_word(program.counts(axis.feedback().position.get()).value);
                    entry.position_counts = channel.program(number).map_or(0, counts);
                    entry.wait = self.waits.get(number).and_then(|wait| wait.shown(now, axis));
                    entry.cip_axis_state = state.code().0;
                    entry.lost_updates = u32::try_from(lost).unwrap_or(u32::MAX);
                }
            }
        }
        let was_up = !matches!(status.state, BoxState::STARTING | BoxState::PHASE_UP);
        status.state = match (stopping, up, connections) {
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

/// How long before its instant the work for a cycle begins: what comes in later belongs to the cycle after.
fn lead_of(cycle: DurationNs, lead: DurationNs) -> DurationNs {
    lead.min(DurationNs(cycle.as_nanos() / LEAD_DIVISOR))
}

/// Sends what is due on a bus at the second of two instants; the frames that could not be sent.
fn send(
    bus: &mut dyn Bus,
    port: &mut SouthPort<'_>,
    (now, at): (MonotonicTime, MonotonicTime),
    sent_at: &mut Option<MonotonicTime>,
) -> u64 {
    let sent = bus.send(now, port);
    if sent.cycle {
        *sent_at = Some(at);
    }
    sent.failures
}

fn tell(notices: &mut rtrb::Producer<Notice>, notice: Notice) {
    // A full queue drops the notice; the state itself stands in the published status.
    let _ = notices.push(notice);
}
