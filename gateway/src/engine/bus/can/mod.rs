//! The CANopen side of the engine: the master, and the drives on the way from their boot-up to the cycle.
//!
//! The master brings each device up by itself and waits for its application once the device is the right one. Then the
//! [`commissioner`] asks its drives, and programs and PDOs follow from that; the master sets the PDOs up and starts the device.
//! A device that comes back while others move goes the same way.
//!
//! What a drive is told goes out after SYNC and counts from the next one; what it tells was captured at SYNC.

pub mod commissioner;
pub mod direct;
pub mod failure;
pub mod layout;
pub mod load;
pub mod lss;
mod readback;
pub mod trial;

use arrayvec::ArrayVec;
use profile_cia402::master::boot::{BootState, BootStatus};
use profile_cia402::master::config::{ConfigError, MasterConfig};
use profile_cia402::master::event::{Event, Output, Refusal as FrameRefusal, Ticket};
use profile_cia402::master::pdo_set::PdoSet;
use profile_cia402::master::report::ReportRow;
use profile_cia402::master::{ConsumerState, Master, Priority};
use profile_cia402::sdo::request::{SdoData, SdoFailure, SdoOutcome, SdoRequest};
use profile_cia402::wire::{AbortCode, Mux, NodeId};
use profile_generic::can::{Frame, Id};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

use self::commissioner::{AxisSetup, DeviceWork, Made, Order, WINDOW};
use self::layout::{BYTES_MAX, PDOS_MAX, PdoMap};
use self::lss::{Assigner, Assignment};
use super::accesses::{Accesses, Asked};
use super::backoff::Backoff;
use super::can_link::{CanLink, PATIENCE, Station};
use super::commissioner::{CommissionerHandle, Done, Job, Run};
use super::direct_slot::DirectSlot;
use super::{Answer, Counts, Places, Purpose, Sent, South, ask};
use crate::engine::access::{Access, AccessFailure, Data, Operation, Progress, Refusal};
use crate::engine::axis::AxisChannel;
use crate::engine::cyclic::Received;
use crate::engine::direct::{DirectFailure, DirectResult, DirectTask, NotBegun};
use crate::engine::notice::Notice;
use crate::engine::port::SouthPort;
use crate::mapping::{DriveIdentity, Mapping};
use crate::status::{BusDetail, NodeStatus};

/// Axes of one device.
const AXES_MAX: usize = 8;

/// SDO accesses of one axis that wait for an answer at the same time.
const ACCESSES_MAX: usize = 4;

/// Where a device is on its way.
#[derive(Debug)]
enum Stage {
    /// The master brings it up, or it is not there.
    Absent,
    /// It is commissioned beside the cycle.
    Commissioning {
        /// The requests that are under way.
        tickets: ArrayVec<Ticket, WINDOW>,
    },
    /// Programs and PDOs are known.
    Ready,
}

/// The values of an axis, one way: the row that its program sees.
#[derive(Debug)]
struct Values {
    pdo_map: PdoMap,
    row: [u8; BYTES_MAX],
}

impl Values {
    fn new() -> Self {
        Self { pdo_map: PdoMap::default(), row: [0; BYTES_MAX] }
    }

    fn take(&mut self, pdo_map: PdoMap) {
        *self = Self { pdo_map, row: [0; BYTES_MAX] };
    }
}

/// The drive of one axis.
#[derive(Debug)]
struct Drive {
    /// Number of the axis in the box.
    axis: usize,
    command: Values,
    feedback: Values,
    /// Whether every value is new, and whether none is lost.
    fresh: bool,
    alive: bool,
    /// When the values of each TPDO came that were new last: what comes later is new in the cycle after, whatever lies between.
    taken_at: [Option<MonotonicTime>; PDOS_MAX],
    /// When they came, where a TPDO does not come at SYNC: the oldest of them.
    at: Option<MonotonicTime>,
    accesses: Accesses<Ticket, ACCESSES_MAX>,
}

/// A device, with one drive or several.
#[derive(Debug)]
struct Device {
    node: NodeId,
    drives: ArrayVec<Drive, AXES_MAX>,
    stage: Stage,
    runs: u32,
    backoff: Backoff,
    /// It does not let its mapping be changed: the PDOs that it has are used.
    keeps: bool,
}

/// A CANopen bus: the master, its devices and their commissioning.
#[derive(Debug)]
pub struct CanBus {
    /// Its number among the CAN buses of the box.
    number: u8,
    master: Master,
    assigner: Assigner,
    devices: Vec<Device>,
    /// The device of each axis, and the drive there.
    places: Places<(usize, usize)>,
    commissioner: CommissionerHandle<DeviceWork>,
    direct: DirectSlot<Ticket>,
    cycles_seen: u64,
    link: CanLink,
    /// It was up since the bus was on last.
    up: bool,
    stopped: bool,
}

impl CanBus {
    /// A bus that begins with the first call. `devices` have the axes of each device; the commissioner knows the same.
    /// `assignments` are given their node-ids when they do not answer.
    ///
    /// # Errors
    /// What the master finds wrong with its configuration.
    pub fn new(
        number: u8,
        config: MasterConfig,
        devices: &[(NodeId, Vec<AxisSetup>)],
        assignments: &[Assignment],
        commissioner: CommissionerHandle<DeviceWork>,
    ) -> Result<Self, ConfigError> {
        let cycle_time = DurationNs(config.sync.map_or(0, |sync| i64::from(sync.period_ns)));
        let master = Master::new(config)?;
        let drive = |setup: &AxisSetup| Drive {
            axis: setup.axis,
            command: Values::new(),
            feedback: Values::new(),
            fresh: false,
            alive: false,
            taken_at: [None; PDOS_MAX],
            at: None,
            accesses: Accesses::new(),
        };
        let device = |(node, axes): &(NodeId, Vec<AxisSetup>)| Device {
            node: *node,
            drives: axes.iter().take(AXES_MAX).map(drive).collect(),
            stage: Stage::Absent,
            runs: 0,
            backoff: Backoff::NONE,
            keeps: false,
        };
        let devices: Vec<_> = devices.iter().map(device).collect();
        let places = devices.iter().enumerate().flat_map(|(place, device)| {
            let drives = device.drives.iter().enumerate();
            drives.map(move |(number, drive)| (drive.axis, (place, number)))
        });
        Ok(Self {
            number,
            master,
            assigner: Assigner::new(assignments),
            places: Places::new(places),
            devices,
            commissioner,
            direct: DirectSlot::new(),
            cycles_seen: 0,
            link: CanLink::new(cycle_time),
            up: false,
            stopped: false,
        })
    }

    /// The CANopen master, for status and tests.
    #[must_use]
    pub fn master(&self) -> &Master {
        &self.master
    }

    fn is_operational(&self, device: &Device) -> bool {
        matches!(device.stage, Stage::Ready)
            && self.master.node(device.node).is_some_and(|info| info.state == BootState::Operational)
    }

    /// Puts together what the TPDOs have brought since the last cycle. The values of a drive are new once each of its TPDOs has come again:
    /// those that drives send by timers of their own may come in different cycles. Which ones stay away the master counts.
    fn gather(&mut self) {
        let Self { master, devices, .. } = self;
        for device in devices {
            let node = device.node;
            for drive in &mut device.drives {
                let Values { pdo_map, row } = &mut drive.feedback;
                let consumers: ArrayVec<_, PDOS_MAX> =
                    pdo_map.numbers().iter().filter_map(|number| master.consumer(node, *number)).collect();
                let all = consumers.len() == pdo_map.numbers().len() && !consumers.is_empty();
                let good = |state| matches!(state, ConsumerState::Good | ConsumerState::Missing);
                drive.alive = all && consumers.iter().all(|consumer| good(consumer.state));
                // A TPDO comes at any time: SYNC, before which the axes have done their step, says nothing of whether it is new.
                let came_at = consumers.iter().map(|consumer| consumer.at);
                let is_new = |(at, taken): (Option<MonotonicTime>, &_)| at.is_some() && at != *taken;
                drive.fresh = all && came_at.clone().zip(&drive.taken_at).all(is_new);
                if drive.fresh {
                    drive.taken_at.iter_mut().zip(came_at).for_each(|(taken, at)| *taken = at);
                }
                let own = consumers.iter().filter(|consumer| !consumer.cyclic);
                drive.at = own.filter_map(|consumer| consumer.at).min();
                for part in pdo_map.parts() {
                    let bytes =
                        consumers.get(part.pdo).and_then(|pdo| pdo.data.get(part.at..part.at + part.len));
                    if let (Some(bytes), Some(place)) = (bytes, row.get_mut(part.from..part.from + part.len))
                    {
                        place.copy_from_slice(bytes);
                    }
                }
            }
        }
    }

    fn event(&mut self, now: MonotonicTime, system: SystemTime, axes: &mut [AxisChannel], event: &Event) {
        match event {
            Event::AwaitingApplication { node, .. } => self.begin(now, *node),
            Event::Operational { node } => {
                if let Some(device) = self.devices.iter_mut().find(|device| device.node == *node) {
                    device.backoff = Backoff::NONE;
                }
            }
            Event::BootFailed { node, step, .. } => {
                self.lose(now, system, *node, axes);
                self.fall_back(now, *node, *step);
            }
            Event::Rebooted { node, .. }
            | Event::HeartbeatLost { node }
            | Event::GuardingLost { node }
            | Event::StateChanged { node, .. } => self.lose(now, system, *node, axes),
            Event::DuplicateNode { node, .. } => {
                // Where the master stops it for that, it is lost; a device that only says its name twice is not.
                let off = self.master.node(*node).is_some_and(|info| info.state == BootState::Off);
                if off {
                    self.lose(now, system, *node, axes);
                    self.try_later(now, *node);
                }
            }
            Event::OtherMaster(_) => {
                for drive in self.devices.iter().flat_map(|device| &device.drives) {
                    axes[drive.axis].doubt_south(now, system);
                }
            }
            Event::GaveWay => {
                self.up = false;
                self.link.clear();
                self.assigner.abort();
                for drive in self.devices.iter_mut().flat_map(|device| {
                    device.stage = Stage::Absent;
                    &mut device.drives
                }) {
                    (drive.fresh, drive.alive) = (false, false);
                    axes[drive.axis].leave_south(now, system);
                }
            }
            Event::BusOff => {
                self.up = false;
                for place in 0..self.devices.len() {
                    let node = self.devices[place].node;
                    self.lose(now, system, node, axes);
                }
            }
            _ => {}
        }
    }

    /// A device waits for its application.
    fn begin(&mut self, now: MonotonicTime, node: NodeId) {
        let Some(place) = self.devices.iter().position(|device| device.node == node) else {
            // A device without axes takes part as it is.
            let _ = self.master.node_ready(node);
            return;
        };
        let [vendor, product, ..] = self.master.node(node).map(|info| info.identity).unwrap_or_default();
        let device = &mut self.devices[place];
        device.runs = device.runs.wrapping_add(1);
        let run = device.run(place);
        if self.commissioner.push(Job::Order(run, Order::Begin(DriveIdentity { vendor, product }))) {
            device.stage = Stage::Commissioning { tickets: ArrayVec::new() };
        } else {
            self.give_up(now, place);
        }
    }

    /// A device is gone, or has to begin anew.
    fn lose(&mut self, now: MonotonicTime, system: SystemTime, node: NodeId, axes: &mut [AxisChannel]) {
        for device in self.devices.iter_mut().filter(|device| device.node == node) {
            device.stage = Stage::Absent;
            for drive in &mut device.drives {
                (drive.fresh, drive.alive) = (false, false);
                axes[drive.axis].lose_south(now, system);
            }
        }
    }

    /// Stops a device that cannot be used, for now.
    fn give_up(&mut self, now: MonotonicTime, place: usize) {
        let device = &mut self.devices[place];
        device.stage = Stage::Absent;
        let node = device.node;
        let _ = self.master.stop_node(now, node);
        self.try_later(now, node);
    }

    /// A device did not come up. One that does not let its mapping be changed is tried at once with the PDOs that it has, any other one
    /// after a pause.
    fn fall_back(&mut self, now: MonotonicTime, node: NodeId, step: Option<ReportRow>) {
        let fixed = step.is_some_and(|step| step.is_refused_mapping());
        if let Some(place) = self.devices.iter().position(|device| device.node == node) {
            let device = &mut self.devices[place];
            let keeps = fixed && !device.keeps;
            let changes = keeps != device.keeps;
            let run = device.run(place);
            if changes && self.commissioner.push(Job::Order(run, Order::Keep(keeps))) {
                device.keeps = keeps;
                if keeps && self.master.retry(now, node).is_ok() {
                    return;
                }
            }
        }
        self.try_later(now, node);
    }

    fn try_later(&mut self, now: MonotonicTime, node: NodeId) {
        if let Some(device) = self.devices.iter_mut().find(|device| device.node == node) {
            device.backoff.begin(now);
        }
    }

    /// Tries devices again whose pause is over.
    fn retry(&mut self, now: MonotonicTime) {
        let Self { master, devices, .. } = self;
        for device in devices {
            if device.backoff.take(now) {
                // One that is on its way by itself, or in operation, needs no other try.
                let _ = master.retry(now, device.node);
            }
        }
    }

    /// Takes what the commissioner has done.
    fn commission(&mut self, now: MonotonicTime, axes: &mut [AxisChannel], notice: &mut dyn FnMut(Notice)) {
        while let Some((run, done)) = self.commissioner.pop(notice) {
            let place = usize::from(run.place);
            let wanted = self.devices.get(place).is_some_and(|device| {
                device.run(place) == run && matches!(device.stage, Stage::Commissioning { .. })
            });
            if !wanted {
                self.commissioner.push(Job::Unused(done));
                continue;
            }
            match done {
                Done::Submit(run, request) => self.submit(now, place, run, request),
                Done::Made(_, Made::Program(which, program, [command, feedback])) => {
                    if let Some(drive) = self.devices[place].drives.get_mut(usize::from(which)) {
                        drive.command.take(command);
                        drive.feedback.take(feedback);
                        axes[drive.axis].set_south(program);
                    }
                }
                Done::Made(run, Made::Pdos(set)) => self.connect(now, place, run, set),
                Done::Failed(run, failed) => {
                    notice(failed);
                    // The PDOs that it has do not do either: the next try begins as the first one did.
                    let device = &mut self.devices[place];
                    if device.keeps && self.commissioner.push(Job::Order(run, Order::Keep(false))) {
                        device.keeps = false;
                    }
                    self.give_up(now, place);
                }
                Done::Told(_) => {}
            }
        }
    }

    fn submit(&mut self, now: MonotonicTime, place: usize, run: Run, request: SdoRequest) {
        let node = self.devices[place].node;
        match self.master.sdo_submit(node, request, Priority::Normal) {
            Ok(ticket) => {
                if let Stage::Commissioning { tickets } = &mut self.devices[place].stage {
                    // The commissioner has no more under way than there is room for.
                    let _ = tickets.try_push(ticket);
                }
            }
            Err((_, request)) => {
                self.commissioner.push(Job::Unsent(run, request));
                self.give_up(now, place);
            }
        }
    }

    /// The PDOs of a device are known: the master sets them up and starts it.
    fn connect(&mut self, now: MonotonicTime, place: usize, run: Run, set: PdoSet) {
        let node = self.devices[place].node;
        let (taken, unused) = match self.master.set_pdos(set) {
            Ok(had) => (true, had),
            Err((_, set)) => (false, set),
        };
        self.commissioner.push(Job::Unused(Done::Made(run, Made::Pdos(unused))));
        if taken && self.master.node_ready(node).is_ok() {
            self.devices[place].stage = Stage::Ready;
        } else {
            self.give_up(now, place);
        }
    }

    fn outcome(
        &mut self,
        ticket: Ticket,
        outcome: SdoOutcome,
        axes: &mut [AxisChannel],
        answer: &mut dyn FnMut(&mut [AxisChannel], Answer),
    ) {
        if self.direct.contains(ticket) {
            return self.direct.end(direct::result(outcome));
        }
        for (place, device) in self.devices.iter_mut().enumerate() {
            let run = device.run(place);
            if let Stage::Commissioning { tickets } = &mut device.stage
                && let Some(at) = tickets.iter().position(|known| *known == ticket)
            {
                tickets.remove(at);
                self.commissioner.push(Job::Outcome(run, outcome));
                return;
            }
            for drive in &mut device.drives {
                if let Some(Asked { purpose, item, write }) = drive.accesses.take(ticket) {
                    let (result, said) = (reply(&outcome), outcome.result.err().map(DirectFailure::Sdo));
                    answer(axes, Answer { axis: drive.axis, purpose, item, write, result, said });
                    return;
                }
            }
        }
        self.commissioner.push(Job::Spent(outcome));
    }
}

impl Device {
    /// Its work for the commissioner, from its place among the devices.
    fn run(&self, place: usize) -> Run {
        Run::new(place, self.runs)
    }
}

impl South for CanBus {
    fn cycle_time(&self) -> DurationNs {
        self.link.cycle_time()
    }

    fn patience(&self) -> DurationNs {
        PATIENCE
    }

    fn wake_at(&self) -> Option<MonotonicTime> {
        let own = || self.master.wake_at().into_iter().chain(self.assigner.wake_at()).min();
        self.link.wake_at().or_else(own)
    }

    fn next_cycle(&self) -> Option<MonotonicTime> {
        self.master.next_sync()
    }

    fn skip_late(&mut self, now: MonotonicTime) -> bool {
        self.master.skip_late(now)
    }

    fn shift_grid(&mut self, by: DurationNs) {
        self.master.shift_grid(by);
    }

    fn prepare(&mut self, _system: Option<SystemTime>) {}

    fn is_up(&self) -> bool {
        self.up
    }

    fn phase(&self) -> Option<u8> {
        None
    }

    fn counts(&self) -> Counts {
        let statistics = self.master.statistics();
        Counts {
            cycles: statistics.syncs,
            lost: statistics.pdos_missed,
            refused: FrameRefusal::ALL.iter().map(|reason| statistics.refused(*reason)).sum(),
        }
    }

    fn detail(&self) -> BusDetail {
        self.link.detail()
    }

    fn node(&self, axis: usize) -> NodeStatus {
        let device = self.places.of(axis).and_then(|(device, _)| self.devices.get(device));
        let info = device.and_then(|device| self.master.node(device.node));
        info.map_or(NodeStatus::Unknown, |info| NodeStatus::Can {
            state: info.state,
            nmt: info.heartbeat,
            emcy: info.emcy.map(|emcy| (emcy.code.0, emcy.register)),
        })
    }

    fn receive(&mut self, now: MonotonicTime, port: &mut SouthPort<'_>) {
        let SouthPort::Can(port) = port else { return };
        let Self { master, assigner, link, .. } = self;
        link.receive(now, *port, &mut Stations { master, assigner });
    }

    fn take_cycle(&mut self, _now: MonotonicTime) -> bool {
        let cycles = self.master.statistics().syncs;
        let taken = std::mem::replace(&mut self.cycles_seen, cycles) != cycles;
        if taken {
            self.gather();
        }
        taken
    }

    fn feedback(&self, axis: usize) -> Option<Received<'_>> {
        let (device, drive) = self.places.of(axis)?;
        let device = self.devices.get(device).filter(|device| self.is_operational(device))?;
        let drive = device.drives.get(drive)?;
        let data = drive.feedback.row.get(..drive.feedback.pdo_map.len())?;
        Some(Received { data, fresh: drive.fresh, at: drive.at, alive: drive.alive })
    }

    fn set_idle(&mut self, _idle: bool) {}

    fn run(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        _mapping: &Mapping,
        axes: &mut [AxisChannel],
        answer: &mut dyn FnMut(&mut [AxisChannel], Answer),
        notice: &mut dyn FnMut(Notice),
    ) {
        if !self.stopped {
            self.master.start(now);
        }
        // What was asked for and can be answered has room with the commissioner.
        while self.commissioner.has_room()
            && let Some(event) = self.master.poll_event()
        {
            match event {
                Event::Sdo { ticket, outcome } => self.outcome(ticket, outcome, axes, answer),
                event => {
                    self.event(now, system, axes, &event);
                    notice(Notice::Can { bus: self.number, event });
                }
            }
        }
        self.commission(now, axes, notice);
        self.retry(now);
        if self.master.leads() && self.master.other_master().is_some() {
            let mut torque = false;
            for drive in self.devices.iter().flat_map(|device| &device.drives) {
                axes[drive.axis].doubt_run(now, system);
                torque |= axes[drive.axis].may_have_torque();
            }
            if !torque {
                self.master.give_way(now);
            }
        }
        if !self.stopped && self.master.leads() {
            let Self { master, assigner, .. } = self;
            if let Some(told) = assigner.run(now, |node| is_silent(master, node)) {
                notice(Notice::Lss { bus: self.number, told });
            }
        }
        for device in 0..self.devices.len() {
            if !self.is_operational(&self.devices[device]) {
                continue;
            }
            for drive in 0..self.devices[device].drives.len() {
                let axis = self.devices[device].drives[drive].axis;
                ask(now, &mut axes[axis], &mut |access, purpose| self.access(axis, access, purpose));
            }
        }
        let mut states = self.master.nodes().map(|info| info.state);
        self.up = match self.up {
            true => !self.stopped,
            false => {
                !self.stopped
                    && states.all(is_settled)
                    && self.devices.iter().any(|device| self.is_operational(device))
            }
        };
    }

    fn command(&mut self, axis: usize, fill: &mut dyn FnMut(Option<&mut [u8]>) -> bool) {
        let place = self.places.of(axis).filter(|(device, _)| self.is_operational(&self.devices[*device]));
        let Some((device, drive)) = place else {
            fill(None);
            return;
        };
        let Self { master, devices, .. } = self;
        let node = devices[device].node;
        let Values { pdo_map, row } = &mut devices[device].drives[drive].command;
        let given = fill(row.get_mut(..pdo_map.len()));
        if !given {
            pdo_map.numbers().iter().for_each(|number| master.withdraw(node, *number));
            return;
        }
        for part in pdo_map.parts() {
            let pdo = pdo_map.numbers().get(part.pdo).and_then(|number| master.producer(node, *number));
            let place = pdo.and_then(|pdo| pdo.get_mut(part.at..part.at + part.len));
            if let (Some(place), Some(bytes)) = (place, row.get(part.from..part.from + part.len)) {
                place.copy_from_slice(bytes);
            }
        }
        for number in pdo_map.numbers() {
            master.commit(node, *number);
        }
    }

    fn access(&mut self, axis: usize, access: &Access, purpose: Purpose) -> bool {
        let Some(request) = request(access) else { return false };
        let place = self.places.of(axis).filter(|(device, _)| self.is_operational(&self.devices[*device]));
        let Some((device, drive)) = place else { return false };
        let Self { master, devices, .. } = self;
        let device = &mut devices[device];
        let drive = &mut device.drives[drive];
        let priority = if access.urgent { Priority::Urgent } else { Priority::Normal };
        let node = device.node;
        drive.accesses.submit(access, purpose, || master.sdo_submit(node, request, priority).ok())
    }

    fn begin_direct(&mut self, axis: usize, task: DirectTask) -> Result<(), NotBegun> {
        let request = direct::request(task)?;
        let place = self.places.of(axis).filter(|(device, _)| self.is_operational(&self.devices[*device]));
        let Some((device, _)) = place else {
            return Err((DirectFailure::NoDrive, direct::buffer(request.data)));
        };
        if !self.direct.is_free() {
            return Err((DirectFailure::Unsent, direct::buffer(request.data)));
        }
        match self.master.sdo_submit(self.devices[device].node, request, Priority::Normal) {
            Ok(ticket) => {
                self.direct.begin(ticket);
                Ok(())
            }
            Err((_, request)) => Err((DirectFailure::Unsent, direct::buffer(request.data))),
        }
    }

    fn take_direct(&mut self) -> Option<DirectResult> {
        self.direct.take()
    }

    fn share_device(&self, axis: usize, other: usize) -> bool {
        let device = |axis| self.places.of(axis).map(|(device, _)| device);
        device(axis).is_some() && device(axis) == device(other)
    }

    fn send(&mut self, now: MonotonicTime, port: &mut SouthPort<'_>) -> Sent {
        let mut sent = Sent::default();
        let SouthPort::Can(port) = port else { return sent };
        let cycles = self.master.statistics().syncs;
        let Self { master, assigner, link, .. } = self;
        sent.failures = link.send(now, *port, &mut Stations { master, assigner });
        sent.cycle = self.master.statistics().syncs != cycles;
        sent
    }

    fn stop(&mut self, now: MonotonicTime) {
        self.stopped = true;
        self.master.stop(now);
    }

    fn is_stopped(&self) -> bool {
        // The devices have been told, or cannot be.
        self.stopped
            && !self.master.is_running()
            && (self.master.wake_at().is_none() && self.link.is_drained())
    }
}

/// The stations that the box is: master, and LSS master for devices without a node-id.
struct Stations<'a> {
    master: &'a mut Master,
    assigner: &'a mut Assigner,
}

impl Station for Stations<'_> {
    fn handle_frame(&mut self, now: MonotonicTime, frame: &Frame) {
        if !self.assigner.handle(now, frame) {
            let _ = self.master.handle_frame(now, frame);
        }
    }

    fn handle_bus_off(&mut self, now: MonotonicTime) {
        self.assigner.abort();
        self.master.bus_off(now);
    }

    /// Brings all devices up again.
    fn handle_bus_on(&mut self, now: MonotonicTime) {
        self.master.bus_on(now);
    }

    fn poll(&mut self, now: MonotonicTime) -> Option<(Frame, MonotonicTime)> {
        let own = self.master.poll(now).map(|Output::Transmit(frame)| frame);
        own.or_else(|| self.assigner.poll(now)).map(|frame| (frame, now))
    }

    fn handle_failure(&mut self, id: Id) {
        self.master.transmit_failed(id);
    }
}

/// Whether nobody answers under a node-id.
fn is_silent(master: &Master, node: NodeId) -> bool {
    master.node(node).is_some_and(|info| match info.state {
        BootState::Retry => true,
        BootState::Failed => info.status == Some(BootStatus::NO_ANSWER),
        _ => false,
    })
}

/// Whether a device is where it stays until something happens.
fn is_settled(state: BootState) -> bool {
    use BootState as S;
    matches!(state, S::Off | S::Retry | S::Operational | S::Lost | S::Failed)
}

/// The request that an access is; `None` for what no CANopen drive has.
fn request(access: &Access) -> Option<SdoRequest> {
    let object = layout::object(access.item)?;
    let mux = Mux::new(object.index, object.sub);
    match &access.operation {
        Operation::Read => Some(SdoRequest::upload(mux)),
        Operation::Write(data) => Some(SdoRequest::download(mux, SdoData::inline(data)?)),
        Operation::Command | Operation::Start | Operation::Progress | Operation::Cancel => None,
    }
}

/// What a request came to.
fn reply(outcome: &SdoOutcome) -> Result<(Data, Progress), AccessFailure> {
    outcome.result.map_err(failure)?;
    let data = Data::try_from(outcome.data.as_slice()).map_err(|_| AccessFailure::Unanswered)?;
    Ok((data, Progress::None))
}

/// What a failure of SDO is to those who do not know it.
pub(in crate::engine) fn failure(failure: SdoFailure) -> AccessFailure {
    let SdoFailure::Refused(code) = failure else { return AccessFailure::Unanswered };
    AccessFailure::Refused(match code {
        code if code.is_absent() => Refusal::Unknown,
        AbortCode::READ_ONLY => Refusal::ReadOnly,
        AbortCode::VALUE
        | AbortCode::TOO_HIGH
        | AbortCode::TOO_LOW
        | AbortCode::LENGTH
        | AbortCode::TOO_LONG
        | AbortCode::TOO_SHORT => Refusal::Value,
        _ => Refusal::Other,
    })
}
