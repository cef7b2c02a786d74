//! The commissioning of SERCOS drives: what a drive is asked and written in CP2 and in CP3, and what follows from that.
//!
//! In either phase the start-up list of the drive comes first, so that what is read is what holds.
//!
//! While the whole bus comes up the cycle thread does this itself, because nothing moves yet ([`Setup::poll`]). A drive that comes
//! by hot plug is commissioned alongside the cycle ([`DriveWork`]).

use std::sync::Arc;

use profile_sercos::master::config::Connections;
use profile_sercos::master::svc::request::{Shape, SvcData, SvcOutcome, SvcRequest};
use profile_sercos::wire::header::Phase;

use super::commissioning::{Commissioning, StepFailure};
use super::{connections, limitations};
use crate::engine::bus::commissioner::{CommissionerHandle, Context, Done, Run, Work};
use crate::engine::bus::startup::{StartupAccess, StartupRun, When};
use crate::engine::direct::DirectFailure;
use crate::engine::notice::{Notice, axis_number};
use crate::mapping::{DriveFacts, DriveProgram, Mapping, Refused, SercosAxis, SercosError, Step};
use crate::parameter::id::Id;
use crate::parameter::startup::StartupEntry;

/// Messages under way in each direction.
const QUEUE: usize = 64;

/// A drive that is to be commissioned.
#[derive(Debug, Clone)]
pub struct DriveSetup {
    /// Number of its axis.
    pub axis: usize,
    /// Its SERCOS address.
    pub address: u16,
    /// What the commissioning has to achieve.
    pub needs: SercosAxis,
    /// Its start-up list.
    pub startup: Vec<StartupEntry>,
}

/// What the setup of a drive has come to.
#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "it is moved into its place at once, and boxing would allocate")]
pub enum Progress {
    /// Requests are under way, or can only be made later.
    Busy,
    /// The drive is through with CP2.
    Connections(Connections),
    /// The drive is through with CP3.
    Program(Arc<DriveProgram>),
    /// The drive cannot be used.
    Failed(Notice),
}

/// The setup of one drive. `T` distinguishes its requests.
#[derive(Debug)]
pub struct Setup<T> {
    /// Number of its axis.
    pub axis: u8,
    /// Its SERCOS address.
    pub address: u16,
    /// What the commissioning has to achieve.
    pub needs: SercosAxis,
    /// What the drive has reported of itself.
    pub facts: DriveFacts,
    /// The drive was refused for what it is: trying again does not help, and no command is executed in it.
    pub unfit: bool,
    /// Commands that it has to take were left out of the plan for that reason: a drive that gets through without them is not used yet.
    withheld: bool,
    /// Values in a row that either end of a connection may miss, S-0-1050.x.11.
    allowed_losses: u16,
    phase: Phase,
    startup: StartupRun,
    /// The request of the start-up list that is under way.
    asked: Option<T>,
    /// The start-up list of this phase is under way.
    lists: bool,
    /// What CP2 has read is read again: the start-up list has written since.
    rereads: bool,
    plan: Option<Commissioning<T>>,
    /// Steps that the drive did not take and need not, until they are reported.
    passed_over: Vec<StepFailure>,
}

impl<T: Copy + PartialEq> Setup<T> {
    /// The setup of the drive of an axis.
    #[must_use]
    pub fn new(drive: DriveSetup, allowed_losses: u16) -> Self {
        let DriveSetup { axis, address, needs, startup } = drive;
        Self {
            axis: axis_number(axis),
            address,
            needs,
            startup: StartupRun::new(&startup),
            asked: None,
            lists: false,
            rereads: false,
            facts: DriveFacts::new(),
            unfit: false,
            withheld: false,
            allowed_losses,
            phase: Phase::CP2,
            plan: None,
            passed_over: Vec::new(),
        }
    }

    /// Forgets what the drive has reported; `fixed` tells whether its connections cannot be configured.
    pub fn restart(&mut self, fixed: bool) {
        self.facts = DriveFacts::new();
        self.facts.note_fixed_connections(fixed);
        self.withheld = false;
        self.passed_over.clear();
        self.startup.restart();
    }

    /// Begins a phase: with the start-up list, then with the plan of the tables.
    ///
    /// # Errors
    /// The tables make no plan for this drive.
    #[expect(clippy::result_large_err, reason = "in the cycle thread, where boxing would allocate")]
    pub fn begin(&mut self, mapping: &Mapping, phase: Phase) -> Result<(), Notice> {
        self.give_up();
        self.phase = phase;
        self.startup.begin(if phase == Phase::CP2 { When::Cp2 } else { When::Cp3 });
        self.lists = !self.startup.is_done();
        if self.lists { Ok(()) } else { self.begin_plan(mapping) }
    }

    /// Begins the plan of the phase.
    #[expect(clippy::result_large_err, reason = "in the cycle thread, where boxing would allocate")]
    fn begin_plan(&mut self, mapping: &Mapping) -> Result<(), Notice> {
        let phase = if self.rereads { Phase::CP2 } else { self.phase };
        match mapping.commissioning(&self.needs, phase.0, &self.facts) {
            Ok(mut plan) => {
                if self.rereads {
                    plan.steps.retain(|step| matches!(step, Step::Read { .. }));
                }
                if self.unfit {
                    let needed = |step: &Step| matches!(step, Step::Command { refused: Refused::Fail, .. });
                    self.withheld |= plan.steps.iter().any(needed);
                    plan.steps.retain(|step| !matches!(step, Step::Command { .. }));
                }
                self.plan = Some(Commissioning::new(plan));
                Ok(())
            }
            Err(error) => {
                self.unfit = true;
                self.plan = None;
                Err(self.misfit(error))
            }
        }
    }

    /// Whether a request is under way.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        self.asked.is_some() || self.plan.as_ref().is_some_and(Commissioning::is_waiting)
    }

    /// Ends what is under way.
    pub fn give_up(&mut self) {
        self.plan = None;
        self.startup.give_up();
        (self.asked, self.lists, self.rereads) = (None, false, false);
    }

    /// Takes an outcome if it is of this setup; `false` when it is another's.
    pub fn handle(&mut self, ticket: T, outcome: &SvcOutcome) -> bool {
        if self.asked == Some(ticket) {
            self.asked = None;
            let data = outcome.data.as_slice();
            let read = outcome.result.map(|reply| (reply.attribute, data));
            self.startup.take(read.map_err(DirectFailure::Svc));
            return true;
        }
        self.plan.as_mut().is_some_and(|plan| plan.handle(ticket, outcome, &mut self.facts))
    }

    /// Submits what is next of the start-up list; what follows from it when it is through.
    fn poll_list(
        &mut self,
        mapping: &Mapping,
        submit: &mut dyn FnMut(SvcRequest) -> Option<T>,
        notice: &mut dyn FnMut(Notice),
    ) -> Progress {
        if self.asked.is_none()
            && let Some(access) = self.startup.next()
        {
            match request(access) {
                // When the queue is full or the phase changes it is tried again in the next cycle.
                Some(request) => self.asked = submit(request),
                None => self.startup.take(Err(DirectFailure::OtherBus)),
            }
        }
        for report in self.startup.take_reports() {
            notice(Notice::Startup { axis: self.axis, report });
        }
        if let Some(failure) = self.startup.take_failure() {
            self.unfit = true;
            self.lists = false;
            return Progress::Failed(Notice::StartupFailed { axis: self.axis, failure });
        }
        if !self.startup.is_done() {
            return Progress::Busy;
        }
        self.lists = false;
        self.rereads = self.phase != Phase::CP2 && self.startup.has_written();
        self.begin_plan(mapping).map_or_else(Progress::Failed, |()| Progress::Busy)
    }

    /// Submits what is next; when the plan is through, says what follows from it. `None` while there is no plan.
    pub fn poll(
        &mut self,
        mapping: &Mapping,
        submit: &mut dyn FnMut(SvcRequest) -> Option<T>,
        notice: &mut dyn FnMut(Notice),
    ) -> Option<Progress> {
        if self.lists {
            return Some(self.poll_list(mapping, submit, notice));
        }
        let plan = self.plan.as_mut()?;
        plan.poll(submit);
        if !plan.is_done() {
            return Some(Progress::Busy);
        }
        let (failure, more) = (plan.failure(), plan.wants_more());
        let mut passed_over = plan.take_passed_over();
        // What is read again was passed over in CP2.
        if !self.rereads {
            self.passed_over.append(&mut passed_over);
        }
        if more || (self.rereads && failure.is_none()) {
            // What the drive has reported leads to further steps of the same phase, or what was read again to those of this one:
            // they begin with the next call.
            self.rereads &= more;
            return Some(self.begin_plan(mapping).map_or_else(Progress::Failed, |()| Progress::Busy));
        }
        self.plan = None;
        let last = failure.is_some() || self.phase != Phase::CP2;
        if last && !self.passed_over.is_empty() {
            let failures = std::mem::take(&mut self.passed_over);
            notice(Notice::PassedOver { axis: self.axis, failures });
        }
        if let Some(failure) = failure {
            self.unfit = true;
            let (axis, address) = (self.axis, self.address);
            return Some(Progress::Failed(Notice::Commissioning { axis, address, failure }));
        }
        let made = if self.phase == Phase::CP2 {
            connections(mapping, &self.needs, &self.facts, self.allowed_losses).map(Progress::Connections)
        } else {
            self.program(mapping, notice).map(|program| self.unless_withheld(program))
        };
        Some(made.unwrap_or_else(|error| {
            self.unfit = true;
            Progress::Failed(self.misfit(error))
        }))
    }

    /// The program of the drive, once all is known of it, and what people should know of that.
    fn program(&self, mapping: &Mapping, notice: &mut dyn FnMut(Notice)) -> Result<Progress, SercosError> {
        for difference in self.facts.differences(&mapping.dictionaries.sercos) {
            notice(Notice::Difference { axis: self.axis, difference });
        }
        let program = mapping.sercos_program(&self.needs, &self.facts)?;
        limitations(mapping, self.axis, self.address, &self.needs, &self.facts, &program)
            .into_iter()
            .for_each(notice);
        Ok(Progress::Program(Arc::new(program)))
    }

    /// A drive that was refused and now comes through without its commands is set up once more, with them.
    fn unless_withheld(&mut self, program: Progress) -> Progress {
        if !self.withheld {
            return program;
        }
        self.unfit = false;
        Progress::Failed(Notice::CommandsWithheld { axis: self.axis, address: self.address })
    }

    fn misfit(&self, error: SercosError) -> Notice {
        Notice::Program { axis: self.axis, address: self.address, error }
    }
}

/// A request of a start-up list; `None` for what no SERCOS drive has.
fn request(access: StartupAccess) -> Option<SvcRequest> {
    match access {
        StartupAccess::Read(Id::Idn(idn), room) => {
            Some(SvcRequest::read(idn).with_buffer(Vec::with_capacity(room)))
        }
        StartupAccess::Write(Id::Idn(idn), attribute, bytes) => {
            let request = SvcRequest::write(idn, SvcData::Buffer(bytes));
            let shape = attribute.map(|attribute| match attribute.is_list() {
                true => Shape::List,
                false => Shape::Fixed(attribute.item_length().bytes()),
            });
            Some(SvcRequest { shape, ..request })
        }
        StartupAccess::Read(..) | StartupAccess::Write(..) => None,
    }
}

/// What the cycle thread orders: to set up a drive as in this phase.
#[derive(Debug, Clone, Copy)]
pub struct Order {
    /// CP2, or then CP3.
    pub phase: Phase,
    /// Whether the connections of the drive cannot be configured.
    pub fixed: bool,
}

/// What is ready for a drive.
#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "queue slots have one size, and boxing would allocate")]
pub enum Made {
    /// Its connections: it is through with CP2.
    Connections(Connections),
    /// Its program: it is through with CP3.
    Program(Arc<DriveProgram>),
}

/// The commissioning of a drive that comes by hot plug.
#[derive(Debug)]
pub struct DriveWork {
    run: Run,
    setup: Setup<u32>,
    /// Number of the last request.
    serial: u32,
}

/// Commissions drives that come while others move.
pub type Commissioner = crate::engine::bus::commissioner::Commissioner<DriveWork>;

/// A commissioner for these drives, and the cycle thread's end.
#[must_use]
pub fn commissioner(
    mapping: Mapping,
    allowed_losses: u16,
    drives: impl IntoIterator<Item = DriveSetup>,
) -> (Commissioner, CommissionerHandle<DriveWork>) {
    let work = |drive| DriveWork { run: Run::default(), setup: Setup::new(drive, allowed_losses), serial: 0 };
    Commissioner::with_queue(QUEUE, mapping, drives.into_iter().map(work).collect())
}

impl Work for DriveWork {
    type Order = Order;
    type Request = SvcRequest;
    type Outcome = SvcOutcome;
    type Made = Made;
    type Shared = Mapping;

    fn run(&self) -> Run {
        self.run
    }

    fn order(&mut self, run: Run, Order { phase, fixed }: Order, context: &mut Context<Self>) {
        self.run = run;
        if phase == Phase::CP2 {
            self.setup.restart(fixed);
            self.setup.unfit = false;
        }
        match self.setup.begin(&context.shared, phase) {
            Ok(()) => self.advance(context),
            Err(misfit) => context.out.push_back(Done::Failed(run, misfit)),
        }
    }

    fn handle(&mut self, outcome: &SvcOutcome, context: &mut Context<Self>) {
        self.setup.handle(self.serial, outcome);
        self.advance(context);
    }

    fn give_up(&mut self) {
        self.setup.give_up();
    }
}

impl DriveWork {
    /// The next request, or what follows from a plan that is through.
    fn advance(&mut self, context: &mut Context<Self>) {
        let Self { run, setup, serial } = self;
        let Context { shared: mapping, out } = context;
        while !setup.is_waiting() {
            let (mut request, mut told) = (None, Vec::new());
            let mut submit = |next| {
                *serial += 1;
                request = Some(next);
                Some(*serial)
            };
            let Some(progress) = setup.poll(mapping, &mut submit, &mut |notice| told.push(notice)) else {
                return;
            };
            out.extend(request.map(|request| Done::Submit(*run, request)));
            out.extend(told.into_iter().map(Done::Told));
            match progress {
                Progress::Busy => {}
                Progress::Connections(connections) => {
                    out.push_back(Done::Made(*run, Made::Connections(connections)));
                }
                Progress::Program(program) => out.push_back(Done::Made(*run, Made::Program(program))),
                Progress::Failed(failed) => {
                    setup.give_up();
                    out.push_back(Done::Failed(*run, failed));
                }
            }
        }
    }
}
