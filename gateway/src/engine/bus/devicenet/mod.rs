//! The DeviceNet side of the engine: the master, and the drives on the way from their allocation to the cycle.
//!
//! The master takes each slave by itself. Once its poll connection runs, the drive is [set up](setup) by explicit messages
//! beside the exchange, and only then its axis has a program. A drive that is lost is taken again by the master, with pauses
//! that grow, and goes the same way; the others go on.
//!
//! Everything that a drive can need is made before the start: nothing here allocates. Only its start-up list is gone through by the
//! [`commissioner`], alongside the cycle thread.

pub mod access;
pub mod commissioner;
pub mod direct;
pub mod end;
pub mod setup;

use std::sync::Arc;

use profile_cip::devicenet::connection::ConnectionKind;
use profile_cip::devicenet::master::Master;
use profile_cip::devicenet::master::config::{ConfigError, MasterConfig};
use profile_cip::devicenet::master::event::{Event, Outcome, Ticket};
use profile_cip::devicenet::master::station::Phase;
use profile_cip::devicenet::wire::MacId;
use profile_generic::can::{Frame, Id};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

use self::commissioner::ListWork;
use self::direct::DirectAccess;
use self::end::{End, MessageError, Row};
use self::setup::{SetupFailure, SetupStep};
use super::accesses::{Accesses, Asked};
use super::backoff::Backoff;
use super::can_link::{CanLink, PATIENCE, Station};
use super::commissioner::{CommissionerHandle, Done, Job, Run};
use super::direct_slot::DirectSlot;
use super::{Answer, Counts, Places, Purpose, Sent, South, ask};
use crate::engine::access::{Access, Data, Operation, Progress};
use crate::engine::axis::AxisChannel;
use crate::engine::cyclic::Received;
use crate::engine::direct::{DirectFailure, DirectResult, DirectTask, NotBegun, Target};
use crate::engine::notice::{Notice, axis_number};
use crate::engine::port::SouthPort;
use crate::mapping::devicenet::ROW_LEN;
use crate::mapping::{DriveProgram, Item, Mapping};
use crate::status::{BusDetail, NodeStatus};

/// The connection that carries the commands.
const POLL: ConnectionKind = ConnectionKind::Poll;

/// Accesses of one axis that wait for an answer at the same time.
const ACCESSES_MAX: usize = 4;

/// Where a drive is on its way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// The master takes it, or it is not there.
    Absent,
    /// Its start-up list is gone through: the request that is under way.
    List(Option<Ticket>),
    /// It is set up: the step, and the request that is under way.
    Setup(usize, Option<Ticket>),
    /// Its axis is led.
    Ready,
    /// It could not be set up.
    Unfit,
}

/// What the bus has to know of a drive.
#[derive(Debug)]
pub struct DrivePlan {
    /// Number of the axis in the box.
    pub axis: usize,
    /// Its MAC ID.
    pub mac: MacId,
    /// The box's end of its poll connection.
    pub end: End,
    /// How its axis speaks to it, with the data that the configuration has of the axis: what the axis would put in, it would put
    /// into a copy.
    pub program: Arc<DriveProgram>,
    /// Whether it has a start-up list, which comes before the set-up.
    pub has_list: bool,
    /// How it is set up.
    pub steps: Vec<SetupStep>,
}

#[derive(Debug)]
struct Drive {
    plan: DrivePlan,
    stage: Stage,
    /// Its list is through since it was taken.
    is_listed: bool,
    /// Times that its list was begun.
    runs: u32,
    command: Row,
    feedback: Row,
    fresh: bool,
    /// Cycles in a row without an answer that counts.
    vain: u16,
    /// Why the first one of them did not, and whether that has been reported.
    error: Option<(MessageError, bool)>,
    /// It has been tried: nobody waits for it any longer.
    tried: bool,
    backoff: Backoff,
    accesses: Accesses<Ticket, ACCESSES_MAX>,
}

/// Cycles in which a drive that was taken may have nothing valid to tell.
const BEGINNING: u16 = 100;

/// A DeviceNet network: the master and its drives.
#[derive(Debug)]
pub struct DevicenetBus {
    /// Its number among the DeviceNet networks of the box.
    number: u8,
    master: Master,
    drives: Vec<Drive>,
    /// The drive of each axis.
    places: Places<usize>,
    cycles_seen: u64,
    /// Number of the cycle that began last, counted with those that were left out: its place on the grid.
    on_grid: u64,
    /// Messages of drives that did not count.
    refused: u64,
    commissioner: CommissionerHandle<ListWork>,
    direct: DirectSlot<Ticket>,
    /// The direct access that is in progress, and its buffer.
    direct_access: Option<(DirectAccess, Vec<u8>)>,
    link: CanLink,
    /// When the frames that wait were made.
    made_at: MonotonicTime,
    /// It is on, or tries to be.
    started: bool,
    backoff: Backoff,
    up: bool,
    stopped: bool,
    /// Answers of a drive in a row that may be missing.
    allowed_losses: u16,
}

impl DevicenetBus {
    /// A bus that begins with the first call.
    ///
    /// # Errors
    /// What the master finds wrong with its configuration.
    pub fn new(
        number: u8,
        config: MasterConfig,
        drives: Vec<DrivePlan>,
        commissioner: CommissionerHandle<ListWork>,
    ) -> Result<Self, ConfigError> {
        let drive = |plan| Drive {
            plan,
            stage: Stage::Absent,
            is_listed: false,
            runs: 0,
            command: [0; ROW_LEN],
            feedback: [0; ROW_LEN],
            fresh: false,
            vain: 0,
            error: None,
            tried: false,
            backoff: Backoff::NONE,
            accesses: Accesses::new(),
        };
        let cycle = config.cycle;
        let allowed_losses = config.slaves.iter().map(|slave| slave.missed_max).max().map_or(0, u16::from);
        let drives: Vec<_> = drives.into_iter().map(drive).collect();
        Ok(Self {
            number,
            master: Master::new(config)?,
            places: Places::new(drives.iter().enumerate().map(|(place, drive)| (drive.plan.axis, place))),
            drives,
            cycles_seen: 0,
            on_grid: 0,
            refused: 0,
            commissioner,
            direct: DirectSlot::new(),
            direct_access: None,
            link: CanLink::new(cycle),
            made_at: MonotonicTime::ZERO,
            started: false,
            backoff: Backoff::NONE,
            up: false,
            stopped: false,
            allowed_losses,
        })
    }

    /// The DeviceNet master, for status and tests.
    #[must_use]
    pub fn master(&self) -> &Master {
        &self.master
    }

    /// Exchanges frames with the network.
    fn exchange<T>(&mut self, with: impl FnOnce(&mut CanLink, &mut dyn Station) -> T) -> T {
        let Self { master, drives, link, made_at, stopped, .. } = self;
        with(link, &mut Node { master, drives, made_at, stopped: *stopped })
    }

    /// Takes what the drives have answered in the cycle that has ended.
    fn gather(&mut self) {
        let cycle = self.on_grid;
        for drive in &mut self.drives {
            drive.fresh = false;
            let consumer = self.master.consumer(drive.plan.mac, POLL).filter(|consumer| consumer.fresh);
            let handled =
                consumer.map(|consumer| drive.plan.end.handle(cycle, consumer.data, &mut drive.feedback));
            match handled {
                Some(Ok(())) => (drive.fresh, drive.vain, drive.error) = (true, 0, None),
                Some(Err(error)) => {
                    self.refused += 1;
                    drive.vain = drive.vain.saturating_add(1);
                    // It is reported once, until one counts again.
                    drive.error = drive.error.or(Some((error, false)));
                }
                None => drive.vain = drive.vain.saturating_add(1),
            }
        }
    }

    /// Tells of drives that answer, and whose answers do not count.
    fn tell_errors(&mut self, notice: &mut dyn FnMut(Notice)) {
        for drive in &mut self.drives {
            if let Some((error, told @ false)) = &mut drive.error
                && drive.vain > if drive.stage == Stage::Ready { self.allowed_losses } else { BEGINNING }
            {
                *told = true;
                let axis = axis_number(drive.plan.axis);
                notice(Notice::SlaveAnswers { axis, mac: drive.plan.mac, error: *error });
            }
        }
    }

    fn event(&mut self, now: MonotonicTime, system: SystemTime, axes: &mut [AxisChannel], event: &Event) {
        match event {
            Event::OtherMaster { slave, .. } => {
                for drive in self.drives.iter_mut().filter(|drive| drive.plan.mac == *slave) {
                    drive.tried = true;
                    axes[drive.plan.axis].doubt_south(now, system);
                }
            }
            Event::Online => self.backoff = Backoff::NONE,
            Event::DuplicateMac { .. } => {
                self.backoff.begin(now);
                // Nobody will be taken for now.
                self.drives.iter_mut().for_each(|drive| drive.tried = true);
            }
            Event::Lost { slave, .. } => {
                let drive = self.drives.iter_mut().find(|drive| drive.plan.mac == *slave);
                drive.into_iter().for_each(|drive| drive.tried = true);
            }
            _ => {}
        }
    }

    /// An explicit request has ended.
    fn outcome(
        &mut self,
        now: MonotonicTime,
        ticket: Ticket,
        outcome: &Outcome,
        axes: &mut [AxisChannel],
        answer: &mut dyn FnMut(&mut [AxisChannel], Answer),
        notice: &mut dyn FnMut(Notice),
    ) {
        if self.direct.contains(ticket) {
            let (access, mut data) = self.direct_access.take().unwrap_or_default();
            let result = access.result(outcome, &mut data).map(|()| None);
            return self.direct.end(DirectResult { result, data });
        }
        for (place, drive) in self.drives.iter_mut().enumerate() {
            let axis = drive.plan.axis;
            if drive.stage == Stage::List(Some(ticket)) {
                let run = Run::new(place, drive.runs);
                // Room was made sure of before the request was sent. A drive that was lost is taken anew, with a list anew.
                let goes_on = !matches!(outcome, Outcome::Lost)
                    && self.commissioner.push(Job::Outcome(run, outcome.clone()));
                drive.stage = if goes_on { Stage::List(None) } else { Stage::Absent };
                return;
            }
            if let Stage::Setup(step, Some(known)) = drive.stage
                && known == ticket
            {
                let judged = drive.plan.steps.get(step).map_or(Ok(()), |step| step.judge(outcome));
                match (judged, outcome) {
                    (Ok(()), _) => drive.stage = Stage::Setup(step + 1, None),
                    // It is taken anew, and set up anew.
                    (Err(_), Outcome::Lost) => drive.stage = Stage::Absent,
                    (Err(failure), _) => {
                        drive.stage = Stage::Unfit;
                        drive.tried = true;
                        drive.backoff.begin(now);
                        notice(told(axis, drive.plan.mac, failure));
                    }
                }
                return;
            }
            if let Some(Asked { purpose, item, write }) = drive.accesses.take(ticket) {
                let result = reply(item, write, outcome);
                let said = result.as_ref().err().and_then(|_| access::refused_with(outcome));
                let said = said.map(DirectFailure::Cip);
                answer(axes, Answer { axis, purpose, item, write, result, said });
                return;
            }
        }
    }

    /// Takes what the commissioner has done.
    fn commission(&mut self, now: MonotonicTime, notice: &mut dyn FnMut(Notice)) {
        while let Some((run, done)) = self.commissioner.pop(notice) {
            let place = usize::from(run.place);
            let wanted = self.drives.get_mut(place);
            let wanted =
                wanted.filter(|drive| Run::new(place, drive.runs) == run && drive.stage == Stage::List(None));
            let Some(drive) = wanted else {
                self.commissioner.push(Job::Unused(done));
                continue;
            };
            match done {
                Done::Submit(run, request) => {
                    match self.master.submit(drive.plan.mac, request.clone()) {
                        Ok(ticket) => drive.stage = Stage::List(Some(ticket)),
                        // It begins anew.
                        Err(_) => {
                            drive.stage = Stage::Setup(0, None);
                            self.commissioner.push(Job::Unsent(run, request));
                        }
                    }
                }
                Done::Made(..) => (drive.stage, drive.is_listed) = (Stage::Setup(0, None), true),
                Done::Failed(_, failed) => {
                    notice(failed);
                    (drive.stage, drive.tried) = (Stage::Unfit, true);
                    drive.backoff.begin(now);
                }
                Done::Told(_) => {}
            }
        }
    }

    /// Takes each drive on as far as it goes now.
    fn lead_on(&mut self, now: MonotonicTime, system: SystemTime, axes: &mut [AxisChannel]) {
        let Self { master, drives, commissioner, .. } = self;
        for (place, drive) in drives.iter_mut().enumerate() {
            let axis = drive.plan.axis;
            if master.phase(drive.plan.mac) != Some(Phase::Exchange) {
                if drive.stage == Stage::Ready {
                    axes[axis].lose_south(now, system);
                }
                if drive.stage != Stage::Absent {
                    (drive.stage, drive.fresh) = (Stage::Absent, false);
                }
                continue;
            }
            match drive.stage {
                Stage::Absent => {
                    drive.plan.end.restart();
                    drive.fresh = false;
                    (drive.stage, drive.is_listed) = (Stage::Setup(0, None), false);
                }
                Stage::Unfit if drive.backoff.take(now) => {
                    (drive.stage, drive.is_listed) = (Stage::Setup(0, None), false);
                }
                Stage::Setup(0, None) if drive.plan.has_list && !drive.is_listed => {
                    let run = Run::new(place, drive.runs.wrapping_add(1));
                    // A full queue is tried again in the next call.
                    if drive.plan.end.is_answered() && commissioner.push(Job::Order(run, ())) {
                        (drive.stage, drive.runs) = (Stage::List(None), run.number);
                    }
                }
                Stage::Setup(step, None) if drive.plan.end.is_answered() => {
                    if let Some(step_of) = drive.plan.steps.get(step) {
                        // A full queue is tried again in the next call.
                        let ticket = master.submit(drive.plan.mac, step_of.request()).ok();
                        drive.stage = Stage::Setup(step, ticket);
                    } else if drive.fresh {
                        drive.stage = Stage::Ready;
                        (drive.tried, drive.backoff) = (true, Backoff::NONE);
                        drive.command = [0; ROW_LEN];
                        axes[axis].set_south(Arc::clone(&drive.plan.program));
                    }
                }
                Stage::List(_) | Stage::Setup(..) | Stage::Unfit | Stage::Ready => {}
            }
        }
    }
}

/// The node that the box is.
struct Node<'a> {
    master: &'a mut Master,
    drives: &'a mut [Drive],
    made_at: &'a mut MonotonicTime,
    stopped: bool,
}

impl Station for Node<'_> {
    fn handle_frame(&mut self, now: MonotonicTime, frame: &Frame) {
        let _ = self.master.handle_frame(now, frame);
    }

    fn handle_bus_off(&mut self, now: MonotonicTime) {
        self.master.handle_bus_off(now);
        self.drives.iter_mut().for_each(|drive| drive.tried = true);
    }

    /// Begins anew: whether the MAC ID is still free has to be asked.
    fn handle_bus_on(&mut self, now: MonotonicTime) {
        if !self.stopped {
            self.master.start(now);
        }
    }

    fn poll(&mut self, now: MonotonicTime) -> Option<(Frame, MonotonicTime)> {
        if self.master.is_drained() {
            // What comes now is made now; all of a message has the same age.
            *self.made_at = now;
        }
        self.master.poll(now).map(|frame| (frame, *self.made_at))
    }

    fn handle_failure(&mut self, _: Id) {}
}

fn told(axis: usize, mac: MacId, failure: SetupFailure) -> Notice {
    Notice::SlaveSetup { axis: axis_number(axis), mac, failure }
}

/// What an access came to.
fn reply(
    item: Item,
    write: bool,
    outcome: &Outcome,
) -> Result<(Data, Progress), crate::engine::access::AccessFailure> {
    let Item::Attribute(attribute) = item else {
        return Err(crate::engine::access::AccessFailure::Unanswered);
    };
    if write {
        access::written(attribute, outcome)?;
        return Ok((Data::new(), Progress::None));
    }
    Ok((access::value(attribute, outcome)?, Progress::None))
}

impl South for DevicenetBus {
    fn cycle_time(&self) -> DurationNs {
        self.master.config().cycle
    }

    fn patience(&self) -> DurationNs {
        PATIENCE
    }

    fn wake_at(&self) -> Option<MonotonicTime> {
        self.link.wake_at().or_else(|| self.master.wake_at())
    }

    fn next_cycle(&self) -> Option<MonotonicTime> {
        self.master.next_cycle()
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
            cycles: statistics.cycles,
            lost: statistics.missed,
            refused: statistics.refused + self.refused,
        }
    }

    fn detail(&self) -> BusDetail {
        self.link.detail()
    }

    fn node(&self, axis: usize) -> NodeStatus {
        let drive = self.places.of(axis).and_then(|place| self.drives.get(place));
        let phase = drive.and_then(|drive| self.master.phase(drive.plan.mac));
        let facts = drive.and_then(|drive| self.master.facts(drive.plan.mac));
        phase.map_or(NodeStatus::Unknown, |phase| NodeStatus::Devicenet {
            phase,
            status: facts.and_then(|facts| facts.status),
        })
    }

    fn receive(&mut self, now: MonotonicTime, port: &mut SouthPort<'_>) {
        let SouthPort::Can(port) = port else { return };
        self.exchange(|link, node| link.receive(now, *port, node));
    }

    fn take_cycle(&mut self, _now: MonotonicTime) -> bool {
        let cycles = self.master.statistics().cycles;
        let taken = std::mem::replace(&mut self.cycles_seen, cycles) != cycles;
        if taken {
            self.gather();
        }
        taken
    }

    fn feedback(&self, axis: usize) -> Option<Received<'_>> {
        let drive = self.drives.get(self.places.of(axis)?)?;
        // The master gives a drive up that has missed too many answers. Those that do not count are none.
        let exchanges = self.master.phase(drive.plan.mac) == Some(Phase::Exchange);
        let alive = exchanges && drive.vain <= self.allowed_losses;
        let ready = drive.stage == Stage::Ready;
        ready.then_some(Received { data: &drive.feedback, fresh: drive.fresh, at: None, alive })
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
        if !self.stopped && self.link.is_used() && (!self.started || self.backoff.take(now)) {
            self.started = true;
            self.master.start(now);
        }
        while let Some(event) = self.master.poll_event() {
            if let Event::Explicit { ticket, outcome } = &event {
                self.outcome(now, *ticket, outcome, axes, answer, notice);
                continue;
            }
            self.event(now, system, axes, &event);
            notice(Notice::Devicenet { network: self.number, event });
        }
        for drive in &self.drives {
            if !axes[drive.plan.axis].may_have_torque() {
                self.master.give_way(now, drive.plan.mac);
            }
        }
        self.commission(now, notice);
        self.lead_on(now, system, axes);
        self.tell_errors(notice);
        for place in 0..self.drives.len() {
            let axis = self.drives[place].plan.axis;
            if self.drives[place].stage == Stage::Ready {
                ask(now, &mut axes[axis], &mut |access, purpose| self.access(axis, access, purpose));
            }
        }
        let mut ready = false;
        let mut settled = true;
        for drive in &self.drives {
            ready |= drive.stage == Stage::Ready;
            settled &= drive.tried;
        }
        self.up = !self.stopped && (self.up || settled && ready);
    }

    fn command(&mut self, axis: usize, fill: &mut dyn FnMut(Option<&mut [u8]>) -> bool) {
        let Self { master, drives, places, .. } = self;
        let Some(drive) = places.of(axis).and_then(|place| drives.get_mut(place)) else {
            fill(None);
            return;
        };
        let mac = drive.plan.mac;
        let ready = drive.stage == Stage::Ready;
        let given = fill(ready.then_some(&mut drive.command[..]));
        if !master.is_unsent(mac, POLL) {
            drive.plan.end.sent();
        }
        let exchanging = master.phase(mac) == Some(Phase::Exchange);
        // Without a command the master sends a message without data, which keeps the connection and commands nothing.
        let Some(message) = master.producer(mac, POLL).filter(|_| exchanging) else { return };
        let written = match drive.stage {
            Stage::Ready => given && drive.plan.end.emit(&drive.command, message),
            Stage::List(_) | Stage::Setup(..) => drive.plan.end.emit_neutral(message),
            Stage::Absent | Stage::Unfit => false,
        };
        if written {
            master.commit(mac, POLL);
        }
    }

    fn access(&mut self, axis: usize, access: &Access, purpose: Purpose) -> bool {
        let Item::Attribute(attribute) = access.item else { return false };
        let request = match &access.operation {
            Operation::Read => access::read(attribute),
            Operation::Write(data) => access::write(attribute, data),
            Operation::Command | Operation::Start | Operation::Progress | Operation::Cancel => None,
        };
        let Some(request) = request else { return false };
        let Self { master, drives, places, .. } = self;
        let Some(drive) = places.of(axis).and_then(|place| drives.get_mut(place)) else { return false };
        if drive.stage != Stage::Ready {
            return false;
        }
        let mac = drive.plan.mac;
        drive.accesses.submit(access, purpose, || master.submit(mac, request).ok())
    }

    fn begin_direct(&mut self, axis: usize, task: DirectTask) -> Result<(), NotBegun> {
        let DirectTask { target, write, data } = task;
        let Target::Attribute { class, instance, attribute } = target else {
            return Err((DirectFailure::OtherBus, data));
        };
        let drive = self.places.of(axis).and_then(|place| self.drives.get(place));
        let Some(drive) = drive.filter(|drive| drive.stage == Stage::Ready) else {
            return Err((DirectFailure::NoDrive, data));
        };
        let access = DirectAccess { class, instance, attribute, write };
        let request = access.request(&data).filter(|_| self.direct.is_free());
        let ticket = request.and_then(|request| self.master.submit(drive.plan.mac, request).ok());
        let Some(ticket) = ticket else { return Err((DirectFailure::Unsent, data)) };
        self.direct.begin(ticket);
        self.direct_access = Some((access, data));
        Ok(())
    }

    fn take_direct(&mut self) -> Option<DirectResult> {
        self.direct.take()
    }

    fn send(&mut self, now: MonotonicTime, port: &mut SouthPort<'_>) -> Sent {
        let mut sent = Sent::default();
        let SouthPort::Can(port) = port else { return sent };
        let cycles = self.master.statistics().cycles;
        sent.failures = self.exchange(|link, node| link.send(now, *port, node));
        let statistics = self.master.statistics();
        sent.cycle = statistics.cycles != cycles;
        if sent.cycle {
            self.on_grid = statistics.cycles + statistics.skipped;
        }
        sent
    }

    fn stop(&mut self, now: MonotonicTime) {
        if !std::mem::replace(&mut self.stopped, true) {
            self.master.stop(now);
        }
    }

    fn is_stopped(&self) -> bool {
        // The drives have been given back, or cannot be.
        self.stopped && self.master.is_drained() && self.link.is_drained()
    }
}
