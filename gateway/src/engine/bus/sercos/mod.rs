//! The SERCOS III side of the engine: the master, and the drives on the way from the scan to the cycle.
//!
//! The master stops twice for its application. In CP2 each drive is written to and asked what its plan says, its
//! connections follow from that; in CP3 it is told its modes and asked its scaling, its program follows from that.
//! Compiling programs allocates; it happens before the cyclic operation of CP4 begins.

pub mod commissioner;
pub mod commissioning;
pub mod direct;
mod progress;
mod recovery;

use arrayvec::ArrayVec;
use profile_generic::state::Report;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_sercos::master::Master;
use profile_sercos::master::config::{ConfigError, ConnectionConfig, Connections, MasterConfig};
use profile_sercos::master::connection::{Consumer, ConsumerState};
use profile_sercos::master::event::{
    Event, HotPlugRefusal, Output, Port, Refusal as FrameRefusal, SlaveId, Ticket,
};
use profile_sercos::master::station::Presence;
use profile_sercos::master::svc::request::{SvcData, SvcFailure, SvcOperation, SvcOutcome, SvcRequest};
use profile_sercos::wire::data_status::{CommandState, DataStatus};
use profile_sercos::wire::header::{Kind, Phase};
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::procedure::ProcedureControl;
use profile_sercos::wire::scp::ScpClass;

use self::commissioner::{DriveSetup, DriveWork, Made, Order, Progress as SetupProgress, Setup};
use self::progress::PhaseProgress;
use self::recovery::{Missing, Recovery};
use super::accesses::{Accesses, Asked};
use super::commissioner::{CommissionerHandle, Done, Job, Run};
use super::direct_slot::DirectSlot;
use super::{Answer, Counts, Places, Purpose, Sent, South, ask};
use crate::engine::access::{Access, AccessFailure, Data, Operation, Progress, Refusal};
use crate::engine::axis::AxisChannel;
use crate::engine::cyclic::Received;
use crate::engine::direct::{DirectFailure, DirectResult, DirectTask, NotBegun};
use crate::engine::notice::{Notice, axis_number};
use crate::engine::port::{FRAME_MAX, SouthPort};
use crate::mapping::{DriveFacts, DriveProgram, Full, Item, Mapping, SercosAxis, SercosError};
use crate::status::{BusDetail, NodeStatus, PortLosses};

/// The connection in the MDT, by its number at the slave.
pub const COMMAND_CONNECTION: u8 = 0;

/// y of S-0-1050.x.y, the configuration list.
const CONFIGURATION_LIST: u8 = 6;

/// The connection that the slave produces in the AT: its actual values (S-0-1050.1).
pub const FEEDBACK_CONNECTION: u8 = 1;

/// Slaves that are left out at the same time; a bus with more of them needs a person anyway.
const REFUSED_MAX: usize = 64;

/// Frames taken from the bus in one cycle: eight telegrams on two ports, and as many strays.
const FRAMES_PER_CYCLE: usize = 32;

/// Service channel accesses of one drive that wait for an answer at the same time.
const ACCESSES_MAX: usize = 4;

/// The grid moves from cycle to cycle by at most this part of the jitter that the slaves were told of.
const JITTER_FOR_PULL: i64 = 4;

/// Where the drive of an axis is on its way.
#[derive(Debug)]
enum Stage {
    /// Not found, failed, or lost.
    Absent,
    /// Working through the plan of CP2 or CP3.
    Commissioning,
    /// On its way in by hot plug, commissioned beside the cycle.
    Joining {
        /// The request that is under way.
        ticket: Option<Ticket>,
    },
    /// Through with the plan of this phase.
    Ready,
}

/// The drive of one axis.
#[derive(Debug)]
struct Drive {
    /// Number of the axis.
    axis: usize,
    setup: Setup<Ticket>,
    slave: Option<SlaveId>,
    /// Numbers of its two connections, to it and from it.
    connections: [u8; 2],
    stage: Stage,
    /// It may come later: nothing is missing without it.
    hot_plug: bool,
    /// How often it has come by hot plug.
    runs: u32,
    accesses: Accesses<Ticket, ACCESSES_MAX>,
}

/// A SERCOS III bus: the master, its drives and their commissioning.
#[derive(Debug)]
pub struct SercosBus {
    master: Master,
    drives: Vec<Drive>,
    /// The drive of each axis.
    places: Places<usize>,
    recovery: Recovery,
    progress: PhaseProgress,
    cycles_seen: u64,
    /// Slaves that stand in the way of the others; left out until the next scan.
    refused: ArrayVec<SlaveId, REFUSED_MAX>,
    /// Who commissions drives that come later.
    commissioner: CommissionerHandle<DriveWork>,
    direct: DirectSlot<Ticket>,
    /// Room for a frame.
    buffer: Box<[u8; FRAME_MAX]>,
}

impl SercosBus {
    /// A bus whose master goes for CP4, and its drives; the commissioner knows the same.
    ///
    /// # Errors
    /// What the master finds wrong with its configuration.
    pub fn new(
        config: MasterConfig,
        drives: Vec<DriveSetup>,
        commissioner: CommissionerHandle<DriveWork>,
    ) -> Result<Self, ConfigError> {
        let allowed_losses = config.mst_losses;
        let later: Vec<_> = config
            .slaves
            .iter()
            .filter(|slave| slave.hot_plug.is_some())
            .map(|slave| slave.address)
            .collect();
        let mut master = Master::new(config)?;
        master.set_target_phase(Phase::CP4);
        let drive = |drive: DriveSetup| Drive {
            axis: drive.axis,
            hot_plug: later.contains(&drive.address),
            setup: Setup::new(drive, allowed_losses),
            slave: None,
            connections: [COMMAND_CONNECTION, FEEDBACK_CONNECTION],
            stage: Stage::Absent,
            runs: 0,
            accesses: Accesses::new(),
        };
        let drives: Vec<_> = drives.into_iter().map(drive).collect();
        Ok(Self {
            master,
            places: Places::new(drives.iter().enumerate().map(|(place, drive)| (drive.axis, place))),
            drives,
            recovery: Recovery::new(),
            progress: PhaseProgress::default(),
            cycles_seen: 0,
            refused: ArrayVec::new(),
            commissioner,
            direct: DirectSlot::new(),
            buffer: Box::new([0; FRAME_MAX]),
        })
    }

    /// The SERCOS III master, for status and tests.
    #[must_use]
    pub fn master(&self) -> &Master {
        &self.master
    }

    /// What the drive of an axis is needed for, and what it has reported about itself.
    #[must_use]
    pub fn drive(&self, axis: usize) -> Option<(&SercosAxis, &DriveFacts)> {
        self.drive_of(axis).map(|drive| (&drive.setup.needs, &drive.setup.facts))
    }

    fn drive_of(&self, axis: usize) -> Option<&Drive> {
        self.drives.get(self.places.of(axis)?)
    }

    fn event(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        mapping: &Mapping,
        axes: &mut [AxisChannel],
        event: &Event,
        notice: &mut dyn FnMut(Notice),
    ) {
        match event {
            Event::Scanned { .. } => self.refused.clear(),
            // Its data are listened to again, and it was spoken to all the time.
            Event::SlaveReturned { .. } if self.missing() == Missing::None => self.recovery.find_all(),
            // There is no hot plug in a ring: one that was lost before is amid the others now.
            Event::RingClosed if self.missing() == Missing::LeftOut => self.recovery.miss(now),
            Event::Isolated { .. } => self.recovery.isolate(),
            Event::OtherMaster(_) => self.doubt_all(now, system, axes),
            Event::GaveWay => {
                self.recovery.give_way();
                self.lose_all(now, system, axes);
            }
            Event::AwaitingApplication { phase } => self.begin_all(*phase, mapping, notice),
            Event::HotPlugAwaits { slave, address, phase } => self.begin_joining(*slave, *address, *phase),
            Event::HotPlugged { slave, .. } => self.complete_joining(*slave),
            // Nothing but a new scan brings it in.
            Event::HotPlugRefused {
                address: Some(address),
                reason: HotPlugRefusal::Misfit(_) | HotPlugRefusal::Several | HotPlugRefusal::NoTelegram,
            } if self.drives.iter().any(|drive| drive.setup.address == *address) => self.recovery.miss(now),
            // What it was that failed; that the slave does not come in follows.
            Event::StepFailed { slave, .. }
            | Event::ClassMismatch { slave }
            | Event::NoConnection { slave, .. }
            | Event::CheckFailed { slave, .. }
                if self.is_joining(*slave) => {}
            Event::Phase(Phase::CP4) => {
                let fit = self.drives.iter_mut().filter(|drive| drive.slave.is_some());
                fit.for_each(|drive| drive.setup.unfit = false);
                let missing = self.missing();
                self.recovery.reach_cp4(now, missing);
            }
            Event::SlaveLost { slave, address, phase } => {
                if !self.comes_by_hot_plug(*slave, *address) {
                    self.recovery.miss(now);
                }
                // In CP4 it may hear every word and be back in a moment: it is told to stop as long as its place is kept. That
                // it is not heard its connection says.
                if *phase != Phase::CP4 {
                    self.lose_slave(now, system, *slave, axes);
                }
            }
            Event::StepFailed { slave, idn, failure: SvcFailure::Refused { .. } }
                if self.may_be_bare(*slave, *idn) =>
            {
                self.make_bare(*slave, notice);
                self.refuse(now, system, *slave, axes);
            }
            // The master waits again for its application: the others go on without the slave that stands in the way.
            Event::StepFailed { slave, .. }
            | Event::ClassMismatch { slave }
            | Event::NoConnection { slave, .. }
            | Event::CheckFailed { slave, .. }
            | Event::AddressConflict { slave } => self.refuse(now, system, *slave, axes),
            // Nothing but another configuration helps; until then the phase-up is tried again and again.
            Event::LayoutRefused(_) => self.master.set_target_phase(Phase::CP0),
            Event::Phase(phase) if *phase < Phase::CP2 => {
                if *phase == Phase::CP0 {
                    self.recovery.begin_scan();
                }
                self.lose_all(now, system, axes);
            }
            Event::AllSlavesLost | Event::Stopped => self.lose_all(now, system, axes),
            _ => {}
        }
    }

    /// Whether a slave comes back by hot plug, and needs no new scan. It can come in at the end of a line, and not amid others that
    /// are heard past it.
    fn comes_by_hot_plug(&self, slave: SlaveId, address: u16) -> bool {
        let facts = self.master.slave(slave).map(|info| info.facts);
        let has_class = facts.is_some_and(|facts| facts.version(ScpClass::HOT_PLUG).is_some());
        let configured = |drive: &Drive| drive.setup.address == address && drive.hot_plug;
        (has_class || self.drives.iter().any(configured)) && !self.master.is_passed(slave)
    }

    /// Nobody knows which master a drive follows.
    fn doubt_all(&self, now: MonotonicTime, system: SystemTime, axes: &mut [AxisChannel]) {
        for drive in &self.drives {
            axes[drive.axis].doubt_south(now, system);
        }
    }

    /// The drives of a slave do with less of the configuration list.
    fn make_bare(&mut self, slave: SlaveId, notice: &mut dyn FnMut(Notice)) {
        for drive in self.drives.iter_mut().filter(|drive| drive.slave == Some(slave)) {
            drive.setup.needs.bare = true;
            notice(Notice::Bare { axis: axis_number(drive.axis), address: drive.setup.address });
        }
    }

    /// What the bus is without: the worst of all its drives.
    fn missing(&self) -> Missing {
        self.drives.iter().map(|drive| self.missing_of(drive)).max().unwrap_or(Missing::None)
    }

    /// Whether a drive is missing, and how. One that was found and is lost or left out does not come later by itself: it is there.
    fn missing_of(&self, drive: &Drive) -> Missing {
        if drive.slave.is_some() && !self.is_lost(drive) {
            Missing::None
        } else if self.master.slave_by_address(drive.setup.address).is_some() {
            Missing::LeftOut
        } else if drive.hot_plug {
            Missing::None
        } else {
            Missing::Absent
        }
    }

    /// Goes on without a slave.
    fn refuse(&mut self, now: MonotonicTime, system: SystemTime, slave: SlaveId, axes: &mut [AxisChannel]) {
        // Left out when the master waits for its application again, which may be only after others are done.
        let _ = self.refused.try_push(slave);
        self.exclude_refused();
        self.lose_slave(now, system, slave, axes);
    }

    /// Whether a slave has refused a configuration list that can do with less.
    fn may_be_bare(&self, slave: SlaveId, idn: Idn) -> bool {
        let list = |instance| idn == Idn::connection(instance, CONFIGURATION_LIST);
        let full = |drive: &Drive| drive.slave == Some(slave) && !drive.setup.needs.bare;
        [COMMAND_CONNECTION, FEEDBACK_CONNECTION].into_iter().any(list) && self.drives.iter().any(full)
    }

    /// Whether the master has lost the slave of a drive, and keeps its place.
    fn is_lost(&self, drive: &Drive) -> bool {
        let info = drive.slave.and_then(|slave| self.master.slave(slave));
        info.is_some_and(|info| info.presence == Presence::Lost)
    }

    fn exclude_refused(&mut self) {
        for slave in &self.refused {
            // Refused while the master does not wait for its application; it is tried again when it does.
            let _ = self.master.exclude(*slave);
        }
    }

    fn lose_slave(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        slave: SlaveId,
        axes: &mut [AxisChannel],
    ) {
        for drive in self.drives.iter_mut().filter(|drive| drive.slave == Some(slave)) {
            drive.lose();
            axes[drive.axis].lose_south(now, system);
        }
    }

    fn lose_all(&mut self, now: MonotonicTime, system: SystemTime, axes: &mut [AxisChannel]) {
        for drive in &mut self.drives {
            drive.lose();
            let axis = &mut axes[drive.axis];
            if self.recovery.is_planned() {
                axis.leave_south(now, system);
            } else {
                axis.lose_south(now, system);
            }
        }
    }

    /// Starts the commissioning of all drives for the phase in which the master waits.
    fn begin_all(&mut self, phase: Phase, mapping: &Mapping, notice: &mut dyn FnMut(Notice)) {
        self.exclude_refused();
        if phase == Phase::CP2 {
            for place in 0..self.drives.len() {
                self.begin(place, mapping, notice);
            }
            return;
        }
        for drive in self.drives.iter_mut().filter(|drive| drive.slave.is_some()) {
            drive.plan(mapping, phase, notice);
        }
    }

    /// Starts the commissioning of a drive in CP2.
    fn begin(&mut self, place: usize, mapping: &Mapping, notice: &mut dyn FnMut(Notice)) {
        let drive = &mut self.drives[place];
        let found = self.master.slave_by_address(drive.setup.address);
        // One that was left out, or was lost since the scan, is not waited for.
        drive.slave = found.filter(|slave| takes_part(&self.master, *slave));
        drive.setup.restart(drive.slave.is_some_and(|slave| is_fixed(&self.master, slave)));
        let other = drive.slave.and_then(|slave| self.master.slave(slave)?.facts.fsp_type).and_then(no_drive);
        if let (Some(what), Some(slave)) = (other, drive.slave) {
            let error = SercosError::Profile(what);
            notice(Notice::Program { axis: axis_number(drive.axis), address: drive.setup.address, error });
            drive.lose();
            let _ = self.refused.try_push(slave);
            let _ = self.master.exclude(slave);
        } else if drive.slave.is_some() {
            drive.plan(mapping, Phase::CP2, notice);
        } else {
            drive.stage = Stage::Absent;
            // What has become of one that was found has been reported.
            if !drive.hot_plug && found.is_none() {
                notice(Notice::DriveMissing { axis: axis_number(drive.axis), address: drive.setup.address });
            }
        }
    }

    fn commission(&mut self, mapping: &Mapping, axes: &mut [AxisChannel], notice: &mut dyn FnMut(Notice)) {
        if self.master.state().awaits().is_none() {
            return;
        }
        let Self { master, drives, refused, .. } = self;
        let mut busy = false;
        for drive in drives {
            let (Stage::Commissioning, Some(slave)) = (&drive.stage, drive.slave) else { continue };
            if !takes_part(master, slave) {
                // No request to it would be taken any more, and the others would wait for it.
                drive.lose();
                continue;
            }
            let mut submit = |request| master.svc_submit(slave, request).ok();
            let Some(progress) = drive.setup.poll(mapping, &mut submit, notice) else { continue };
            drive.stage = Stage::Ready;
            let taken = match progress {
                SetupProgress::Busy => {
                    drive.stage = Stage::Commissioning;
                    busy = true;
                    true
                }
                SetupProgress::Connections(connections) => {
                    drive.connections = numbers(&connections);
                    let set = master.set_connections(slave, connections).is_ok();
                    drive.setup.unfit |= !set;
                    set
                }
                SetupProgress::Program(program) => {
                    axes[drive.axis].set_south(program);
                    true
                }
                SetupProgress::Failed(failed) => {
                    notice(failed);
                    false
                }
            };
            if !taken {
                // The others go on without it.
                let _ = refused.try_push(slave);
                let _ = master.exclude(slave);
                drive.lose();
            }
        }
        if !busy {
            // Refused only when the master has left the phase meanwhile.
            let _ = self.master.proceed();
        }
    }

    fn is_joining(&self, slave: SlaveId) -> bool {
        self.drives.iter().any(|drive| drive.joining_slave() == Some(slave))
    }

    /// A slave has come in by hot plug.
    fn complete_joining(&mut self, slave: SlaveId) {
        let drive = self.drives.iter_mut().find(|drive| drive.slave == Some(slave));
        drive.into_iter().for_each(|drive| drive.stage = Stage::Ready);
        if self.missing() == Missing::None {
            self.recovery.complete();
        }
    }

    /// A slave is on its way in by hot plug: the drive of an axis, or one that nobody asked for.
    fn begin_joining(&mut self, slave: SlaveId, address: u16, phase: Phase) {
        let Some(place) = self.drives.iter().position(|drive| drive.setup.address == address) else {
            // It takes part without connections.
            let _ = self.master.proceed_hot_plug(slave);
            return;
        };
        let drive = &mut self.drives[place];
        if phase == Phase::CP2 {
            self.refused.retain(|refused| *refused != slave);
            drive.runs = drive.runs.wrapping_add(1);
        }
        drive.slave = Some(slave);
        drive.stage = Stage::Joining { ticket: None };
        let run = drive.run(place);
        let fixed = is_fixed(&self.master, slave);
        if !self.commissioner.push(Job::Order(run, Order { phase, fixed })) {
            // It is tried again after a while.
            drive.lose();
            let _ = self.master.exclude(slave);
        }
    }

    /// Carries on with the drives that are on their way in.
    fn let_join(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        axes: &mut [AxisChannel],
        notice: &mut dyn FnMut(Notice),
    ) {
        while let Some((run, done)) = self.commissioner.pop(notice) {
            let place = usize::from(run.place);
            let joining = self.drives.get(place).filter(|drive| {
                drive.run(place) == run && matches!(drive.stage, Stage::Joining { ticket: None })
            });
            let Some((axis, slave)) = joining.and_then(|drive| Some((drive.axis, drive.slave?))) else {
                self.commissioner.push(Job::Unused(done));
                continue;
            };
            let through = match done {
                Done::Submit(run, request) => {
                    match self.master.svc_submit(slave, request) {
                        Ok(sent) => self.drives[place].stage = Stage::Joining { ticket: Some(sent) },
                        Err((_, request)) => {
                            self.commissioner.push(Job::Unsent(run, request));
                            let _ = self.master.exclude(slave);
                        }
                    }
                    continue;
                }
                Done::Made(_, Made::Connections(connections)) => {
                    self.drives[place].connections = numbers(&connections);
                    self.master.set_connections(slave, connections).is_ok()
                }
                Done::Made(_, Made::Program(program)) => {
                    axes[axis].set_south(program);
                    true
                }
                Done::Failed(_, failed) => {
                    notice(failed);
                    false
                }
                Done::Told(_) => continue,
            };
            if through {
                let _ = self.master.proceed_hot_plug(slave);
            } else {
                let _ = self.master.exclude(slave);
                self.drives[place].lose();
                axes[axis].leave_south(now, system);
            }
        }
    }

    /// Gives up the drives that the master does not let in. It reports the same refusal only once, however often a drive tries.
    fn end_joining(&mut self, now: MonotonicTime, system: SystemTime, axes: &mut [AxisChannel]) {
        let Self { master, drives, .. } = self;
        let refused = |slave| !takes_part(master, slave);
        for drive in drives.iter_mut().filter(|drive| drive.joining_slave().is_some_and(refused)) {
            drive.lose();
            axes[drive.axis].leave_south(now, system);
        }
    }

    /// Takes the bus down for another master, because nobody is left, or to look for a drive that is missing.
    fn take_down(&mut self, now: MonotonicTime, system: SystemTime, axes: &mut [AxisChannel]) {
        let cyclic = self.master.phase() == Some(Phase::CP4);
        let gone = |drive: &Drive| drive.slave.is_none() || self.is_lost(drive);
        let alone = cyclic && self.drives.iter().all(gone) && !self.master.may_recover();
        let other = cyclic && self.master.other_master().is_some();
        for drive in self.drives.iter().filter(|_| other) {
            axes[drive.axis].doubt_run(now, system);
        }
        let free = cyclic && !axes.iter().any(AxisChannel::may_have_torque);
        let led = |drive: &Drive| axes[drive.axis].may_have_torque();
        if other && !self.drives.iter().any(led) {
            self.master.give_way(now);
        } else if alone || (free && self.recovery.wants_scan(now)) {
            // Of drives that are all lost nobody knows that they stand.
            self.recovery.take_down(!alone);
            for (slave, [command, _]) in
                self.drives.iter().filter_map(|drive| Some((drive.slave?, drive.connections)))
            {
                self.master.withdraw(slave, command);
            }
            self.lose_all(now, system, axes);
            self.master.set_target_phase(Phase::CP0);
        }
    }

    /// Takes the data of drives again that were lost, once their axes know.
    fn listen_again(&mut self, axes: &[AxisChannel]) {
        for drive in &self.drives {
            // Not before the axis knows: it stops, whatever is heard from now on, and is the sooner usable the sooner the drive
            // says that it stands.
            let noticed = axes[drive.axis].feedback().report == Report::Silent;
            let Some(slave) = drive.slave.filter(|_| noticed) else { continue };
            let failed = |consumer: Consumer<'_>| consumer.state == ConsumerState::Error;
            let [_, feedback] = drive.connections;
            if self.master.consumer(slave, feedback).is_some_and(failed) {
                self.master.reset_consumer(slave, feedback);
            }
        }
    }

    fn outcome(
        &mut self,
        ticket: Ticket,
        outcome: SvcOutcome,
        axes: &mut [AxisChannel],
        answer: &mut dyn FnMut(&mut [AxisChannel], Answer),
    ) {
        if self.direct.contains(ticket) {
            return self.direct.end(direct::result(outcome));
        }
        // An access may be answered only after its drive was lost.
        let asked = |drive: &Drive| drive.accesses.contains(ticket);
        let own = |drive: &Drive| drive.slave == Some(ticket.slave);
        let place = self.drives.iter().position(asked).or_else(|| self.drives.iter().position(own));
        let Some(place) = place else {
            // It may have a buffer, which is not freed in the cycle.
            self.commissioner.push(Job::Spent(outcome));
            return;
        };
        let drive = &mut self.drives[place];
        if let Stage::Joining { ticket: sent } = &mut drive.stage
            && *sent == Some(ticket)
        {
            *sent = None;
            // Room was made sure of before the request was sent.
            let run = drive.run(place);
            self.commissioner.push(Job::Outcome(run, outcome));
            return;
        }
        if drive.setup.handle(ticket, &outcome) {
            return;
        }
        let Some(Asked { purpose, item, write }) = drive.accesses.take(ticket) else {
            self.commissioner.push(Job::Spent(outcome));
            return;
        };
        let said = outcome.result.err().map(DirectFailure::Svc);
        answer(axes, Answer { axis: drive.axis, purpose, item, write, result: reply(&outcome), said });
    }
}

impl South for SercosBus {
    fn cycle_time(&self) -> DurationNs {
        DurationNs(i64::from(self.master.config().cycle_ns))
    }

    /// The master's next cycle is all that happens by itself.
    fn patience(&self) -> DurationNs {
        self.cycle_time()
    }

    fn wake_at(&self) -> Option<MonotonicTime> {
        self.master.wake_at()
    }

    fn next_cycle(&self) -> Option<MonotonicTime> {
        self.master.next_cycle()
    }

    fn skip_late(&mut self, now: MonotonicTime) -> bool {
        self.master.skip_late(now)
    }

    fn shift_grid(&mut self, by: DurationNs) {
        // The slaves were told how even the MST comes; the pull is a part of that.
        let most = i64::from(self.master.config().mst_jitter_ns) / JITTER_FOR_PULL;
        self.master.shift_grid(DurationNs(by.0.clamp(-most, most)));
    }

    fn prepare(&mut self, system: Option<SystemTime>) {
        self.master.set_system_time(system);
        self.master.prepare();
    }

    fn is_up(&self) -> bool {
        self.master.phase() == Some(Phase::CP4)
    }

    fn phase(&self) -> Option<u8> {
        self.master.phase().map(|phase| phase.0)
    }

    fn counts(&self) -> Counts {
        let statistics = self.master.statistics();
        Counts {
            cycles: statistics.cycles,
            lost: statistics.at_missing,
            refused: FrameRefusal::ALL.iter().map(|reason| statistics.refused(*reason)).sum(),
        }
    }

    fn detail(&self) -> BusDetail {
        let statistics = self.master.statistics();
        let lost = |port, kind| u32::try_from(statistics.lost(port, kind)).unwrap_or(u32::MAX);
        let of_port = |port| PortLosses { mdt: lost(port, Kind::Mdt), at: lost(port, Kind::At) };
        BusDetail::Sercos { topology: self.master.topology(), lost: [of_port(Port::One), of_port(Port::Two)] }
    }

    fn node(&self, axis: usize) -> NodeStatus {
        let slave = self.drive_of(axis).and_then(|drive| drive.slave);
        let info = slave.and_then(|slave| self.master.slave(slave));
        info.map_or(NodeStatus::Unknown, |info| NodeStatus::Sercos {
            place: info.id.topology_address(),
            presence: info.presence,
            status: info.status,
        })
    }

    fn receive(&mut self, now: MonotonicTime, port: &mut SouthPort<'_>) {
        let SouthPort::Ethernet(port) = port else { return };
        let Self { master, buffer, .. } = self;
        for _ in 0..FRAMES_PER_CYCLE {
            let Some((port, length)) = port.receive(&mut buffer[..]) else { break };
            // A refused frame is counted by the master and changes nothing.
            let _ = master.handle_frame(now, port, &buffer[..length]);
        }
    }

    fn send(&mut self, now: MonotonicTime, port: &mut SouthPort<'_>) -> Sent {
        let mut sent = Sent::default();
        let SouthPort::Ethernet(ethernet) = port else { return sent };
        while let Some(Output::Transmit { port, frame }) = self.master.poll(now) {
            sent.failures += u64::from(!ethernet.send(now, port, frame));
            sent.cycle = true;
        }
        sent
    }

    fn set_idle(&mut self, idle: bool) {
        self.recovery.set_idle(idle);
    }

    fn stop(&mut self, _now: MonotonicTime) {
        self.recovery.end();
        self.master.stop();
    }

    fn is_stopped(&self) -> bool {
        self.master.phase().is_none()
    }

    fn take_cycle(&mut self, now: MonotonicTime) -> bool {
        self.master.collect(now);
        let cycles = self.master.statistics().cycles;
        std::mem::replace(&mut self.cycles_seen, cycles) != cycles
    }

    fn feedback(&self, axis: usize) -> Option<Received<'_>> {
        let drive = self.drive_of(axis)?;
        if self.master.phase() != Some(Phase::CP4) {
            return None;
        }
        let [_, feedback] = drive.connections;
        let consumer = self.master.consumer(drive.present_slave()?, feedback)?;
        // Of a cycle that was left out nothing comes: what is there is that of the last one.
        Some(Received {
            data: consumer.data,
            fresh: consumer.fresh && self.master.cycle_complete(),
            at: None,
            alive: matches!(consumer.state, ConsumerState::Consuming | ConsumerState::Warning),
        })
    }

    fn command(&mut self, axis: usize, fill: &mut dyn FnMut(Option<&mut [u8]>) -> bool) {
        let drive = self.drive_of(axis);
        let there = drive.and_then(|drive| Some((drive.present_slave()?, drive.connections)));
        let Some((slave, [command, _])) = there else {
            fill(None);
            return;
        };
        if fill(self.master.producer(slave, command)) {
            self.master.commit(slave, command);
        } else {
            self.master.withdraw(slave, command);
        }
    }

    fn access(&mut self, axis: usize, access: &Access, purpose: Purpose) -> bool {
        let Some(request) = request(access) else { return false };
        let Some(place) = self.places.of(axis) else { return false };
        let Self { master, drives, .. } = self;
        let drive = &mut drives[place];
        let Some(slave) = drive.present_slave() else { return false };
        drive.accesses.submit(access, purpose, || master.svc_submit(slave, request).ok())
    }

    fn begin_direct(&mut self, axis: usize, task: DirectTask) -> Result<(), NotBegun> {
        let request = direct::request(task)?;
        let slave = self.drive_of(axis).and_then(Drive::present_slave);
        let Some(slave) = slave else { return Err((DirectFailure::NoDrive, direct::buffer(request.data))) };
        if !self.direct.is_free() {
            return Err((DirectFailure::Unsent, direct::buffer(request.data)));
        }
        match self.master.svc_submit(slave, request) {
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

    fn run(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        mapping: &Mapping,
        axes: &mut [AxisChannel],
        answer: &mut dyn FnMut(&mut [AxisChannel], Answer),
        notice: &mut dyn FnMut(Notice),
    ) {
        while let Some(event) = self.master.poll_event() {
            match event {
                Event::Svc { ticket, outcome } => self.outcome(ticket, outcome, axes, answer),
                event => {
                    self.event(now, system, mapping, axes, &event, notice);
                    notice(Notice::Sercos(event));
                }
            }
        }
        self.end_joining(now, system, axes);
        self.commission(mapping, axes, notice);
        self.let_join(now, system, axes, notice);
        for place in 0..self.drives.len() {
            let axis = self.drives[place].axis;
            ask(now, &mut axes[axis], &mut |access, purpose| self.access(axis, access, purpose));
        }
        self.take_down(now, system, axes);
        self.listen_again(axes);
        if let Some(progress) = self.progress.report(now, &self.master) {
            notice(progress);
        }
        let unfit = |drive: &Drive| drive.setup.unfit;
        if self.master.target_phase() != Some(Phase::CP4)
            && self.recovery.wants_up(now, self.drives.iter().any(unfit))
        {
            notice(Notice::Retry);
            self.master.set_target_phase(Phase::CP4);
        }
    }
}

/// What people should know of a drive that can be used: modes that its axis does without, and the ends of its range.
fn limitations(
    mapping: &Mapping,
    axis: u8,
    address: u16,
    needs: &SercosAxis,
    facts: &DriveFacts,
    program: &DriveProgram,
) -> ArrayVec<Notice, 2> {
    let modes = mapping.sercos_modes_left_out(needs, facts);
    let modes = (!modes.is_empty()).then_some(Notice::ModesLeftOut { axis, address, modes });
    // A drive that works modulo has a longest step from one position command to the next.
    let ends = needs.modulo && program.position_step().is_none();
    modes.into_iter().chain(ends.then_some(Notice::Ends { axis })).collect()
}

impl Drive {
    fn lose(&mut self) {
        self.slave = None;
        self.stage = Stage::Absent;
        self.setup.give_up();
    }

    fn plan(&mut self, mapping: &Mapping, phase: Phase, notice: &mut dyn FnMut(Notice)) {
        match self.setup.begin(mapping, phase) {
            Ok(()) => self.stage = Stage::Commissioning,
            Err(misfit) => {
                notice(misfit);
                self.lose();
            }
        }
    }

    /// Its slave, where it takes part or is on the way up.
    fn present_slave(&self) -> Option<SlaveId> {
        self.slave.filter(|_| !matches!(self.stage, Stage::Joining { .. }))
    }

    /// Its slave, while it is on its way in by hot plug.
    fn joining_slave(&self) -> Option<SlaveId> {
        self.slave.filter(|_| matches!(self.stage, Stage::Joining { .. }))
    }

    /// Its work for the commissioner, from its place among the drives.
    fn run(&self, place: usize) -> Run {
        Run::new(place, self.runs)
    }
}

/// The two connections of a drive, from what it has reported in CP2.
///
/// # Errors
/// As [`Mapping::telegram`], and when a connection is too long for the master.
pub(super) fn connections(
    mapping: &Mapping,
    needs: &SercosAxis,
    facts: &DriveFacts,
    allowed_losses: u16,
) -> Result<Connections, SercosError> {
    let telegram = mapping.telegram(needs, facts)?;
    let fixed = mapping.fixed_connections(facts)?;
    let [command, feedback] = fixed.map_or([COMMAND_CONNECTION, FEEDBACK_CONNECTION], |fixed| {
        [fixed.command.instance, fixed.feedback.instance]
    });
    let mut connections = Connections::new();
    let both = [
        (command, false, &telegram.command, telegram.command_bytes),
        (feedback, true, &telegram.feedback, telegram.feedback_bytes),
    ];
    for (instance, slave_produces, items, bytes) in both {
        let idns: Vec<Idn> = items.iter().copied().filter_map(Item::idn).collect();
        let connection = ConnectionConfig::new(instance, slave_produces, &idns);
        let connection = connection.ok_or(Full("a connection"))?;
        connections.push(ConnectionConfig { allowed_losses, data_len: Some(bytes), ..connection });
    }
    Ok(connections)
}

/// The numbers of the connections to and from a drive.
fn numbers(connections: &Connections) -> [u8; 2] {
    let of = |produced| connections.iter().find(|connection| connection.slave_produces == produced);
    let number = |produced, usual| of(produced).map_or(usual, |connection| connection.instance);
    [number(false, COMMAND_CONNECTION), number(true, FEEDBACK_CONNECTION)]
}

/// What a slave is by S-0-1302.0.1 when it is known to be no drive.
const fn no_drive(fsp_type: u32) -> Option<&'static str> {
    match fsp_type {
        1 => Some("an I/O device (1)"),
        3 => Some("an encoder (3)"),
        _ => None,
    }
}

/// Whether a slave takes part, or is on its way in.
fn takes_part(master: &Master, slave: SlaveId) -> bool {
    let presence = master.slave(slave).map(|info| info.presence);
    matches!(presence, Some(Presence::Active | Presence::Joining))
}

/// Whether the connections of a slave cannot be configured.
fn is_fixed(master: &Master, slave: SlaveId) -> bool {
    let version = |class| master.slave(slave).and_then(|info| info.facts.version(class));
    version(ScpClass::FIX_CFG).is_some() && version(ScpClass::VAR_CFG).is_none()
}

/// The request that an access is on the service channel; `None` for what no SERCOS drive has.
fn request(access: &Access) -> Option<SvcRequest> {
    let idn = access.item.idn()?;
    let set = |control: ProcedureControl| {
        Some(SvcRequest::write(idn, SvcData::inline(&control.bits().to_le_bytes())?))
    };
    let request = match &access.operation {
        Operation::Read => SvcRequest::read(idn),
        Operation::Write(data) => SvcRequest::write(idn, SvcData::inline(data)?),
        Operation::Command => SvcRequest::command(idn),
        Operation::Start => set(ProcedureControl::EXECUTE)?,
        Operation::Progress => SvcRequest::new(idn, SvcOperation::Status),
        Operation::Cancel => set(ProcedureControl::CANCEL)?,
    };
    Some(if access.urgent { request.urgent() } else { request })
}

/// What a request came to.
fn reply(outcome: &SvcOutcome) -> Result<(Data, Progress), AccessFailure> {
    let reply = outcome.result.map_err(failure)?;
    let data = Data::try_from(outcome.data.as_slice()).map_err(|_| AccessFailure::Unanswered)?;
    Ok((data, progress(reply.status)))
}

fn progress(status: DataStatus) -> Progress {
    match status.command_state() {
        CommandState::InProcess | CommandState::Interrupted => Progress::InProcess,
        CommandState::Done => Progress::Done,
        CommandState::Failed => Progress::Failed,
        CommandState::Idle | CommandState::Set | CommandState::Undefined(_) => Progress::None,
    }
}

/// What a failure of the service channel is to those who do not know it. The low twelve bits of the error code are the same
/// for every element.
pub(in crate::engine) fn failure(failure: SvcFailure) -> AccessFailure {
    let SvcFailure::Refused { code, .. } = failure else { return AccessFailure::Unanswered };
    AccessFailure::Refused(match code.0 & 0x0FFF {
        0x001 => Refusal::Unknown,
        0x004 => Refusal::ReadOnly,
        0x006..=0x008 | 0x00D => Refusal::Value,
        _ => Refusal::Other,
    })
}

#[cfg(test)]
mod tests {
    use profile_sercos::wire::svc::Element;
    use profile_sercos::wire::svc_error::SvcError;

    use super::*;

    #[test]
    fn accesses_are_requests_of_the_service_channel() {
        let item = Item::from(Idn::RESET_C1D);
        let made = |operation| request(&Access::new(item, operation)).map(|made| (made.operation, made.data));
        let write = |bytes| Some((SvcOperation::Write(Element::Data), SvcData::inline(bytes).unwrap()));
        let plain = |operation| Some((operation, SvcData::default()));
        assert_eq!(made(Operation::Read), plain(SvcOperation::Read(Element::Data)));
        assert_eq!(made(Operation::Write(Data::try_from(&[1, 2][..]).unwrap())), write(&[1, 2]));
        assert_eq!(made(Operation::Command), plain(SvcOperation::Command));
        assert_eq!(made(Operation::Start), write(&[3, 0]));
        assert_eq!(made(Operation::Progress), plain(SvcOperation::Status));
        assert_eq!(made(Operation::Cancel), write(&[0, 0]));
        let urgent = |access: Access| request(&access).map(|made| made.priority);
        use profile_sercos::master::svc::request::Priority;
        assert_eq!(urgent(Access::read(item)), Some(Priority::Normal));
        assert_eq!(urgent(Access::read(item).urgent()), Some(Priority::Urgent));
        assert_eq!(request(&Access::read(Item::object(0x6041, 0))), None, "not on this bus");
    }

    #[test]
    fn what_the_service_channel_says_is_told_in_general_terms() {
        let states = [0x0, 0x1, 0x3, 0x5, 0x6, 0x7, 0xB, 0xF].map(DataStatus::from_bits_retain).map(progress);
        use Progress::{Done, Failed, InProcess, None};
        assert_eq!(states, [None, None, Done, InProcess, InProcess, InProcess, Failed, Failed]);
        let refused = |code| failure(SvcFailure::Refused { element: Element::Data, code: SvcError(code) });
        for (codes, refusal) in [
            (&[0x1001, 0x2001, 0x7001][..], Refusal::Unknown),
            (&[0x7004], Refusal::ReadOnly),
            (&[0x7006, 0x7007, 0x7008, 0x700D], Refusal::Value),
            (&[0x7002, 0x7003, 0x7005, 0x7009, 0x7012], Refusal::Other),
        ] {
            for code in codes {
                assert_eq!(refused(*code), AccessFailure::Refused(refusal), "{code:04X}");
            }
        }
        assert_eq!(failure(SvcFailure::HandshakeTimeout { cycles: 10 }), AccessFailure::Unanswered);
    }
}
