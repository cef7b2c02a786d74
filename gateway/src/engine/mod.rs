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
pub mod assembly;
pub mod axis;
pub mod build;
pub mod bus;
mod changes;
mod clock;
pub mod cyclic;
pub mod device;
pub mod direct;
mod ending;
pub mod generator;
pub mod local;
pub mod north;
pub mod notice;
pub mod parameter;
pub mod phase_lock;
pub mod port;
pub mod programs;
mod publication;
pub mod registers;
mod schedule;
mod sharing;

use std::cell::RefCell;
use std::sync::Arc;

use profile_cip::device::motion_device::{SyncQuality, SyncState};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_generic::time_base::{TimeBase, TimeSample};

use self::assembly::AssemblyChannel;
use self::axis::nameplate::Difference;
use self::axis::rest::Unrested;
use self::axis::{AxisChannel, Owner};
use self::bus::sercos::SercosBus;
use self::bus::{Answer, Buses, Purpose, South};
use self::changes::Changes;
use self::clock::Clock;
use self::device::DeviceChannel;
use self::direct::DirectNorth;
use self::ending::Ending;
use self::local::LocalNorth;
use self::north::{Exchange, North};
use self::notice::{Notice, axis_number};
use self::phase_lock::PhaseLock;
use self::port::{NorthPort, SouthPort};
use self::programs::{Programs, ProgramsOfDrives};
use self::publication::{Publication, Sources};
use self::registers::RegisterNorth;
pub use self::schedule::BUSES_MAX;
use self::schedule::{IDLE_INTERVAL, Schedule};
use crate::latest::Publisher;
use crate::mapping::{CipProgram, Mapping};
use crate::status::BoxStatus;

/// The cycle for which the axes of each bus do a step in this call.
type Due = [Option<MonotonicTime>; BUSES_MAX];

/// The engine of one box. It owns buses, devices and axes; only the cycle thread uses it.
#[derive(Debug)]
pub struct Engine {
    mapping: Arc<Mapping>,
    buses: Buses,
    devices: Vec<DeviceChannel>,
    assemblies: Vec<AssemblyChannel>,
    /// Local control, if the gateway offers it.
    local: Option<LocalNorth>,
    /// Registers that are parameters of drives, if there are some.
    registers: Option<RegisterNorth>,
    /// Direct accesses to drives, if the gateway offers them.
    direct: Option<DirectNorth>,
    axes: Vec<AxisChannel>,
    notices: rtrb::Producer<Notice>,
    schedule: Schedule,
    locks: [PhaseLock; BUSES_MAX],
    clock: Clock,
    changes: Changes,
    publication: Publication,
    programs: ProgramsOfDrives,
    ending: Ending,
}

/// The parts of an engine; [`build`] makes them from a configuration.
#[derive(Debug)]
pub struct Parts {
    /// The mapping tables.
    pub mapping: Mapping,
    /// The buses, and which of them each axis is on.
    pub buses: Buses,
    /// The motion devices. Their numbers and those of the devices with assemblies are the places of their ports.
    pub devices: Vec<DeviceChannel>,
    /// The devices with assemblies.
    pub assemblies: Vec<AssemblyChannel>,
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
        let Parts { mapping, buses, devices, assemblies, axes, notices, publisher, lead } = parts;
        let cycle_time = buses.iter().map(South::cycle_time).min().unwrap_or(IDLE_INTERVAL);
        Self {
            publication: Publication::new(publisher, cycle_time, axes.len(), (&devices, &assemblies)),
            schedule: Schedule::new(cycle_time, lead),
            locks: [PhaseLock::default(); BUSES_MAX],
            clock: Clock::default(),
            changes: Changes::new(&axes),
            ending: Ending::new(axes.len()),
            mapping: Arc::new(mapping),
            programs: ProgramsOfDrives::new(axes.len()),
            buses,
            devices,
            assemblies,
            local: None,
            registers: None,
            direct: None,
            axes,
            notices,
        }
    }

    /// Adds local control; to be called before the first cycle.
    pub fn set_local(&mut self, local: LocalNorth) {
        self.local = Some(local);
    }

    /// Adds registers that are parameters of drives; to be called before the first cycle.
    pub fn set_registers(&mut self, registers: RegisterNorth) {
        self.registers = Some(registers);
    }

    /// Adds direct accesses to drives; to be called before the first cycle.
    pub fn set_direct(&mut self, direct: DirectNorth) {
        self.direct = Some(direct);
    }

    /// The mapping tables.
    #[must_use]
    pub fn mapping(&self) -> &Mapping {
        &self.mapping
    }

    /// The same, to be kept.
    #[must_use]
    pub fn shared_mapping(&self) -> Arc<Mapping> {
        Arc::clone(&self.mapping)
    }

    /// The programs of the drives, for readers outside of the cycle.
    #[must_use]
    pub fn programs(&self) -> Programs {
        self.programs.reader()
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

    /// Takes another scaling of the controller for an axis; `false`, and nothing done, while the torque may be on.
    pub fn set_cip_program(&mut self, axis: usize, program: CipProgram) -> bool {
        let Self { devices, axes, .. } = self;
        let cip = devices.iter_mut().find_map(|device| device.cip_axis(axis));
        cip.zip(axes.get_mut(axis)).is_some_and(|(cip, axis)| cip.set_program(axis, program))
    }

    /// The devices in the order of the configuration.
    #[must_use]
    pub fn devices(&self) -> &[DeviceChannel] {
        &self.devices
    }

    /// The devices with assemblies, in the order of the configuration.
    #[must_use]
    pub fn assemblies(&self) -> &[AssemblyChannel] {
        &self.assemblies
    }

    /// The buses in the order of the configuration.
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
        &self.publication.status
    }

    /// Whether system time can be trusted by the devices, and which clock it comes from. The offset is that of the time base.
    pub fn set_sync(&mut self, sync: SyncState) {
        let sync = self.clock.set_sync(sync);
        self.devices.iter_mut().for_each(|channel| channel.device_mut().set_sync(sync));
        self.assemblies.iter_mut().for_each(|channel| channel.set_synchronized(sync.synchronized));
    }

    /// How good the synchronization of system time is.
    pub fn set_sync_quality(&mut self, quality: SyncQuality) {
        self.devices.iter_mut().for_each(|channel| channel.device_mut().set_sync_quality(quality));
    }

    /// Least Sync Threshold of the controllers that are connected (class attribute 29), ns.
    #[must_use]
    pub fn sync_threshold(&self) -> Option<u64> {
        self.devices.iter().filter_map(|channel| channel.device().sync_threshold()).min()
    }

    /// Takes a sample of system time, before each [`Self::cycle`]. A step is reported to the devices, which compensate the stamps of
    /// their controllers (clause 2-2); no axis follows it.
    pub fn feed_time(&mut self, sample: &TimeSample) {
        let (step, sync) = self.clock.feed(sample);
        if let Some(sync) = sync {
            self.devices.iter_mut().for_each(|channel| channel.device_mut().set_sync(sync));
        }
        if let Some(step) = step {
            push(&mut self.notices, Notice::TimeStep { step });
        }
    }

    /// System time over the local clock.
    #[must_use]
    pub fn time(&self) -> &TimeBase {
        &self.clock.base
    }

    /// Ends operation: the axes stop as on a lost command, and when they stand, or have had all the time that their own limits
    /// give them, the buses go down. [`Self::is_stopped`] says when.
    pub fn stop(&mut self, now: MonotonicTime) {
        self.ending.begin(now, self.clock.base.system_at(now), &mut self.axes);
    }

    /// Ends the wait for axes that [`Self::stop`] has begun to stop: the buses go down now.
    pub fn hurry(&mut self, now: MonotonicTime) {
        self.ending.hurry(now);
    }

    /// Whether no axis is waited for any longer and every bus is down after [`Self::stop`].
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.ending.is_over && self.buses.iter().all(South::is_stopped)
    }

    /// The axes that did not come to rest, or were not seen to, before the buses went down.
    #[must_use]
    pub fn unrested(&self) -> &[Unrested] {
        &self.ending.unrested
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
        let late = self.schedule.begin(now);
        self.publication.count_lateness(late, self.schedule.cycle_time);
        self.send_prepared(now, south);
        let due = self.receive(now, south);
        self.take_feedback(now, &due);
        self.run_buses(now);
        self.serve_norths(now, north);
        self.fill_telegrams(now, &due);
        for (place, (bus, port)) in self.buses.iter_mut().zip(south.iter_mut()).enumerate() {
            if let Some(at) = self.schedule.take_sendable(place, now, port.holds_frames()) {
                // The bus sends as of then what a port holds until then.
                send(bus, port, (now.max(at), at), place, &mut self.schedule, &mut self.publication);
            }
        }
        self.follow_time();
        let next_call = self.end_call(now);
        for channel in &mut self.devices {
            if let Some(port) = north.get_mut(usize::from(channel.number())) {
                channel.transmit((now, next_call), &self.clock.base, &mut **port);
            }
        }
        for channel in &mut self.assemblies {
            if let Some(port) = north.get_mut(usize::from(channel.number())) {
                channel.transmit(now, &mut **port);
            }
        }
        if self.ending.advance(now, self.clock.base.system_at(now), &mut self.axes) {
            self.buses.iter_mut().for_each(|bus| bus.stop(now));
        }
        self.programs.publish(&self.axes);
        let notices = &mut self.notices;
        let changed = self.changes.report(now, &self.axes, &mut |notice| push(notices, notice));
        let Self { buses, devices, assemblies, axes, changes, ending, publication, .. } = self;
        let stopping = ending.has_begun;
        let sources = Sources { stopping, buses, devices, assemblies, axes, changes, locks: &self.locks };
        publication.publish(now, changed, &sources);
        next_call
    }

    /// Sends what was built ahead and whose instant has come. What could only go out much too late does not.
    fn send_prepared(&mut self, now: MonotonicTime, south: &mut [SouthPort<'_>]) {
        for (place, (bus, port)) in self.buses.iter_mut().zip(south.iter_mut()).enumerate() {
            let left_out = bus.skip_late(now);
            if let Some(at) = self.schedule.take_prepared(place, now, left_out) {
                send(bus, port, (now, at), place, &mut self.schedule, &mut self.publication);
            }
        }
    }

    /// Takes the frames that came.
    fn receive(&mut self, now: MonotonicTime, south: &mut [SouthPort<'_>]) -> Due {
        let mut due = [None; BUSES_MAX];
        for (place, (bus, port)) in self.buses.iter_mut().zip(south.iter_mut()).enumerate() {
            bus.receive(now, port);
            due[place] = self.schedule.step(place, now, bus.next_cycle(), bus.cycle_time());
        }
        due
    }

    /// The axes of the buses that are due take what their drives sent.
    fn take_feedback(&mut self, now: MonotonicTime, due: &Due) {
        let (mut stepped, mut off) = ([false; BUSES_MAX], [false; BUSES_MAX]);
        for (place, bus) in self.buses.iter_mut().enumerate() {
            stepped[place] = due[place].is_some() && bus.take_cycle(now);
            off[place] = bus.next_cycle().is_none();
        }
        let system = self.clock.base.system_at(now);
        for (number, axis) in self.axes.iter_mut().enumerate() {
            let place = self.buses.of(number);
            if stepped[place] {
                let sampled = self.schedule.sampled_at(place, now);
                axis.from_drive(now, system, sampled, self.buses.get(place).feedback(number));
            } else if off[place] && axis.south().is_none() {
                // No cycle comes on a bus that is off, and what waits for a time waits for no drive.
                axis.tick(now, system);
            }
        }
    }

    /// Takes what came from controllers, and lets controllers and axes exchange their values.
    fn serve_norths(&mut self, now: MonotonicTime, north: &mut [&mut dyn NorthPort]) {
        let Self {
            devices,
            assemblies,
            local,
            registers,
            direct,
            mapping,
            axes,
            buses,
            notices,
            clock,
            ending,
            ..
        } = self;
        let time = &clock.base;
        // A restart, which a Reset of any device asks for, stops all axes.
        let in_use = devices.iter().any(|channel| channel.device().connection().is_some())
            || assemblies.iter().any(AssemblyChannel::is_connected)
            || axes.iter().any(AxisChannel::may_have_torque);
        for channel in devices.iter_mut() {
            if let Some(port) = north.get_mut(usize::from(channel.number())) {
                channel.receive(now, time, in_use, &mut **port);
            }
        }
        for channel in assemblies.iter_mut() {
            if let Some(port) = north.get_mut(usize::from(channel.number())) {
                channel.receive(now, in_use, &mut **port);
            }
        }
        devices.iter().for_each(|channel| channel.publish_connection(axes));
        assemblies.iter().for_each(|channel| channel.publish_connection(axes));
        let notice = &mut |notice| push(notices, notice);
        let mut exchange = Exchange { now, time, mapping, ending: ending.has_begun, axes, notice };
        if let Some(local) = local {
            local.exchange(&mut exchange);
            local.parameters(&mut exchange, buses);
        }
        if let Some(registers) = registers {
            registers.exchange(&mut exchange, buses);
        }
        if let Some(direct) = direct
            && let Some((axis, item)) = direct.exchange(&mut exchange, buses)
        {
            devices.iter_mut().for_each(|device| device.set_by_others(axis, item));
        }
        for channel in devices {
            channel.exchange(&mut exchange);
            channel.attributes(&mut exchange, buses);
        }
        for channel in assemblies {
            channel.exchange(&mut exchange);
            channel.parameters(&mut exchange, buses);
        }
    }

    /// The axes of the buses that are due give what their drives are to do, and the buses build their frames.
    fn fill_telegrams(&mut self, now: MonotonicTime, due: &Due) {
        let system = self.clock.base.system_at(now);
        for (number, axis) in self.axes.iter_mut().enumerate() {
            let place = self.buses.of(number);
            if let Some(at) = due[place] {
                let bus = self.buses.get_mut(place);
                let cycle = self.schedule.cycle(place, at, bus.cycle_time());
                bus.command(number, &mut |telegram| axis.to_drive(now, system, &cycle, telegram));
            }
        }
        for (place, bus) in self.buses.iter_mut().enumerate() {
            if let Some(at) = due[place].filter(|_| bus.next_cycle().is_some()) {
                bus.prepare(self.clock.trusted().map(|time| time.system_at(at)));
                self.schedule.prepared(place, at);
            }
        }
    }

    /// Moves the next cycle of each bus that has begun one towards the grid of system time.
    fn follow_time(&mut self) {
        let Self { buses, devices, axes, schedule, locks, clock, notices, .. } = self;
        for (place, lock) in locks.iter_mut().enumerate().take(buses.len()) {
            let next = buses.get(place).next_cycle();
            if !schedule.take_sent(place) && next.is_some() {
                continue;
            }
            let grid = devices.iter().find_map(|channel| channel.grid(|axis| buses.of(axis) == place));
            let mut numbered = axes.iter().enumerate();
            let torque = numbered.any(|(number, axis)| buses.of(number) == place && axis.may_have_torque());
            let bus = buses.get_mut(place);
            let (span, before) = (bus.cycle_time(), lock.phase().state);
            if let Some(grid) = grid {
                lock.refer(grid, span);
            }
            let by = lock.correct(clock.trusted(), next, span, torque);
            bus.shift_grid(by);
            if lock.is_news(before) {
                push(notices, Notice::PhaseLock { bus: buses.name(place), phase: lock.phase() });
            }
        }
    }

    /// Ends a call; when the next one is due.
    fn end_call(&mut self, now: MonotonicTime) -> MonotonicTime {
        let wake = |(place, bus): (usize, &dyn South)| {
            self.schedule.wake(place, now, (bus.next_cycle(), bus.cycle_time()), bus.wake_at())
        };
        let wake = self.buses.iter().enumerate().filter_map(wake).min();
        let patience = self.buses.iter().map(South::patience).min().unwrap_or(IDLE_INTERVAL);
        let due = self.schedule.end(now, wake, patience);
        // A controller that is faster than the buses gets its updates in between.
        let period = self.devices.iter().filter_map(DeviceChannel::update_period);
        let period = period.chain(self.assemblies.iter().filter_map(AssemblyChannel::update_period)).min();
        let fast = period.filter(|period| *period < self.schedule.cycle_time);
        fast.map_or(due, |period| due.min(now + DurationNs(period.as_nanos() / 2)))
    }

    fn run_buses(&mut self, now: MonotonicTime) {
        let system = self.clock.base.system_at(now);
        let Self { mapping, buses, devices, assemblies, local, registers, axes, notices, .. } = self;
        let idle = devices.iter().all(|channel| channel.device().connection().is_none())
            && assemblies.iter().all(|channel| channel.owner().is_none())
            && axes.iter().all(|axis| axis.owner() != Owner::Local);
        // Both closures push notices, never at the same time.
        let notices = RefCell::new(notices);
        let mut notice = |notice| push(&mut notices.borrow_mut(), notice);
        let mut hand_on = |axes: &mut [AxisChannel], answer| {
            let notice = &mut |notice| push(&mut notices.borrow_mut(), notice);
            let norths = Norths { devices, assemblies, local: local.as_mut(), registers: registers.as_mut() };
            hand_on((now, system), mapping, norths, axes, answer, notice);
        };
        for bus in buses.iter_mut() {
            bus.set_idle(idle);
            bus.run(now, system, mapping, axes, &mut hand_on, &mut notice);
        }
    }
}

/// Who asks drives.
struct Norths<'a> {
    devices: &'a mut [DeviceChannel],
    assemblies: &'a mut [AssemblyChannel],
    local: Option<&'a mut LocalNorth>,
    registers: Option<&'a mut RegisterNorth>,
}

/// Hands the answer of a drive to whom has asked.
fn hand_on(
    (now, system): (MonotonicTime, SystemTime),
    mapping: &Mapping,
    norths: Norths<'_>,
    axes: &mut [AxisChannel],
    answer: Answer,
    notice: &mut dyn FnMut(Notice),
) {
    let data = answer.data().map(|data| data.as_slice());
    let axis = &mut axes[answer.axis];
    match answer.purpose {
        Purpose::Attribute { .. } | Purpose::Original { .. } | Purpose::Setting(_) => {
            norths.devices.iter_mut().any(|channel| channel.answer(&answer, mapping, axes, notice));
        }
        Purpose::LocalParameter(ticket) => {
            note_set(norths.devices, answer.axis, &answer);
            if let Some(local) = norths.local {
                local.parameter_answered(ticket, &answer, axis);
            }
        }
        // Its axis is none of a motion device, which alone gives back what a controller has set.
        Purpose::AssemblyParameter { device, ticket } => {
            let mut channels = norths.assemblies.iter_mut();
            if let Some(channel) = channels.find(|channel| channel.number() == device) {
                channel.parameter_answered(ticket, &answer, axis);
            }
        }
        Purpose::RegisterParameter(ticket) => {
            note_set(norths.devices, answer.axis, &answer);
            if let Some(registers) = norths.registers {
                registers.answered(ticket, &answer, axis);
            }
        }
        Purpose::Diagnosis => axis.diagnostic_word(now, system, answer.item, data.ok().and_then(unsigned)),
        Purpose::DiagnosticMessage => {
            if let Some(said) = axis.diagnostic_message_read(answer.item, data.ok()) {
                notice(Notice::DriveSays { axis: axis_number(answer.axis), said });
            }
        }
        Purpose::Nameplate => {
            if let Some(Difference { parameter, configured, held }) =
                axis.nameplate_value_read(answer.item, data.ok())
            {
                let axis = axis_number(answer.axis);
                notice(Notice::OtherNameplate { axis, parameter, configured, held });
            }
        }
        Purpose::SlowValue => axis.slow_value_read(now, answer.item, data.ok()),
        Purpose::Capture(access, generation) => axis.capture_answer(access, generation, data),
        Purpose::Procedure(access, generation) => {
            let progress = answer.result.map(|(_, progress)| progress);
            axis.procedure_answer(now, access, generation, progress);
        }
        // Whether it helped shows in the drive's status word.
        Purpose::FaultReset => {}
    }
}

/// Somebody besides a controller may have written to a drive.
fn note_set(devices: &mut [DeviceChannel], axis: usize, answer: &Answer) {
    if answer.write && answer.result.is_ok() {
        devices.iter_mut().for_each(|device| device.set_by_others(axis, answer.item));
    }
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

/// Sends what is due on a bus at the second of two instants.
fn send(
    bus: &mut dyn South,
    port: &mut SouthPort<'_>,
    (now, at): (MonotonicTime, MonotonicTime),
    place: usize,
    schedule: &mut Schedule,
    publication: &mut Publication,
) {
    let sent = bus.send(now, port);
    if sent.cycle {
        schedule.sent(place, at);
    }
    publication.status.counters.send_failures += sent.failures;
}

fn push(notices: &mut rtrb::Producer<Notice>, notice: Notice) {
    // A full queue drops the notice; the state itself stands in the published status.
    let _ = notices.push(notice);
}

#[cfg(test)]
mod tests;
