//! The commissioning of CANopen devices: the start-up lists of its axes; for each axis of a device what it is asked and written,
//! and its program; then the PDOs of the device. Several requests are under way at a time. Where a device keeps its mapping, its PDOs are read first.

use std::collections::VecDeque;
use std::sync::Arc;

use profile_cia402::master::config::{Direction, MasterConfig, PdoConfig};
use profile_cia402::master::pdo_set::PdoSet;
use profile_cia402::sdo::request::{SdoData, SdoFailure, SdoOutcome, SdoRequest};
use profile_cia402::wire::{Mux, NodeId};

use super::super::commissioner::{CommissionerHandle, Done, Run, Work};
use super::failure::{Misfit, StepFailure};
use super::layout::{AxisPdos, FoundPdos, NotMapped, PdoMap, object};
use super::readback::Readback;
use super::trial::Trial;
use crate::engine::bus::startup::{StartupAccess, StartupRun, When};
use crate::engine::direct::DirectFailure;
use crate::engine::notice::{Notice, axis_number};
use crate::mapping::{
    Cia402Axis, Cia402Dictionary, Cia402Error, DriveIdentity, DriveProgram, Item, Mapping, Object,
    ObjectFacts, ObjectStep, Plan,
};
use crate::parameter::id::Id;
use crate::parameter::startup::StartupEntry;

/// Messages under way in each direction.
const QUEUE: usize = 128;

/// Values of an axis that may be in none of the PDOs of a device.
const UNMAPPED_MAX: usize = 16;

/// Requests to one device that wait for their answers.
pub const WINDOW: usize = 8;

/// What the cycle thread orders.
#[derive(Debug, Clone, Copy)]
pub enum Order {
    /// To set up a device, which has this identity.
    Begin(DriveIdentity),
    /// To use the PDOs that the device has, because it does not let its mapping be changed; or to try it again.
    Keep(bool),
}

/// What is ready for a device.
#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "queue slots have one size, and boxing would allocate")]
pub enum Made {
    /// The program of an axis, by its place in the device, and how its values are spread over RPDOs and TPDOs.
    Program(u8, Arc<DriveProgram>, [PdoMap; 2]),
    /// The RPDOs and TPDOs of the device: it is through. On the way back those that it had.
    Pdos(PdoSet),
}

/// An axis of a device.
#[derive(Debug, Clone)]
pub struct AxisSetup {
    /// Number of the axis in the box.
    pub axis: usize,
    /// What its drive is needed for.
    pub needs: Cia402Axis,
    /// The PDOs that it may have.
    pub pdos: AxisPdos,
    /// The start-up list of its drive.
    pub startup: Vec<StartupEntry>,
}

/// What is done with an axis.
#[derive(Debug)]
enum Task {
    /// The start-up list of its drive: those of all axes come before anything is read.
    List(StartupRun),
    /// A plan of the tables.
    Plan(Plan),
    /// Modes of operation are tried, of a drive that does not report them.
    Try(Trial),
    /// The PDOs are read that its device keeps.
    Readback(Readback),
}

/// The commissioning of one device with all of its axes.
#[derive(Debug)]
pub struct DeviceWork {
    node: NodeId,
    axes: Vec<AxisSetup>,
    run: Run,
    identity: DriveIdentity,
    /// The axis that is being set up, and what is done with it; `None` when nothing is.
    at: Option<(usize, Task)>,
    facts: ObjectFacts,
    /// Steps that are to come, and those that were sent, in order; each with whether it is repeated.
    steps: VecDeque<(ObjectStep, bool)>,
    sent: VecDeque<(ObjectStep, bool)>,
    passed_over: Vec<StepFailure>,
    /// The last question got no answer, and is asked once more.
    asked_again: bool,
    /// The PDOs that the device has are used, because it does not let them be changed.
    falls_back: bool,
    pdos: [Vec<PdoConfig>; 2],
}

/// What the work on every device shares.
#[derive(Debug)]
pub struct Shared {
    mapping: Mapping,
    /// The network, with the PDOs that its devices have been given.
    network: MasterConfig,
}

/// What the work on a device has around it.
type Context = super::super::commissioner::Context<DeviceWork>;

/// Commissions the drives of a bus.
pub type Commissioner = super::super::commissioner::Commissioner<DeviceWork>;

/// A commissioner for these devices of a network, and the cycle thread's end.
#[must_use]
pub fn commissioner(
    mapping: Mapping,
    network: MasterConfig,
    devices: impl IntoIterator<Item = (NodeId, Vec<AxisSetup>)>,
) -> (Commissioner, CommissionerHandle<DeviceWork>) {
    let work = |(node, axes)| DeviceWork {
        node,
        axes,
        run: Run::default(),
        identity: DriveIdentity::default(),
        at: None,
        facts: ObjectFacts::new(),
        steps: VecDeque::new(),
        sent: VecDeque::new(),
        passed_over: Vec::new(),
        asked_again: false,
        falls_back: false,
        pdos: [Vec::new(), Vec::new()],
    };
    Commissioner::with_queue(QUEUE, Shared { mapping, network }, devices.into_iter().map(work).collect())
}

impl Work for DeviceWork {
    type Order = Order;
    type Request = SdoRequest;
    type Outcome = SdoOutcome;
    type Made = Made;
    type Shared = Shared;

    fn run(&self) -> Run {
        self.run
    }

    fn order(&mut self, run: Run, order: Order, context: &mut Context) {
        match order {
            Order::Begin(identity) => self.begin(run, identity, context),
            Order::Keep(keeps) => self.falls_back = keeps,
        }
    }

    fn handle(&mut self, outcome: &SdoOutcome, context: &mut Context) {
        if let Some((_, Task::List(list))) = &mut self.at {
            let read = outcome.result.map(|()| (None, outcome.data.as_slice()));
            list.take(read.map_err(DirectFailure::Sdo));
            return self.advance_list(context);
        }
        if let Some((place, Task::Try(trial))) = &mut self.at {
            let place = *place;
            match trial.handle(outcome) {
                Ok(Some(request)) => context.out.push_back(Done::Submit(self.run, request)),
                Ok(None) => {
                    if let Some((place, task)) = self.at.take() {
                        self.through(place, task, context);
                    }
                }
                Err(failure) => {
                    let object = Object { index: outcome.object.index, sub: outcome.object.sub };
                    self.break_off(place, StepFailure { what: "trying", object, failure }, context);
                }
            }
            return;
        }
        if let Some((place, Task::Readback(readback))) = &mut self.at {
            let place = *place;
            return match readback.handle(outcome) {
                Ok(()) => self.advance(context),
                Err((object, failure)) => {
                    let object = Object { index: object.index, sub: object.sub };
                    self.break_off(place, StepFailure { what: "reading", object, failure }, context);
                }
            };
        }
        let Some(place) = self.at.as_ref().map(|(place, _)| *place) else { return };
        let Some((step, repeated)) = self.sent.pop_front() else { return };
        let (object, what, must) = match &step {
            ObjectStep::Read { object, fail } => (*object, "reading", *fail),
            ObjectStep::Write { object, fail, .. } => (*object, "writing", *fail),
        };
        match outcome.result {
            Ok(()) => {
                self.facts.note_data(object, outcome.data.as_slice());
                self.asked_again = false;
            }
            // A frame was lost, or the drive was busy: once more. What is written here is the same the second time.
            Err(SdoFailure::Timeout { .. }) if !self.asked_again && !repeated => {
                self.asked_again = true;
                self.repeat(step, object);
            }
            Err(failure) => {
                if failure.is_absent() {
                    self.facts.note_missing(object);
                }
                let object =
                    self.axes[place].needs.item(object).and_then(super::layout::object).unwrap_or(object);
                // One that says nothing is not one that lacks the object: it is gone, and would cost this time at each step.
                let gone = matches!(failure, SdoFailure::Timeout { .. } | SdoFailure::NodeLost);
                let failure = StepFailure { what, object, failure };
                if must || gone {
                    return self.break_off(place, failure, context);
                }
                self.passed_over.push(failure);
            }
        }
        self.advance(context);
    }

    fn give_up(&mut self) {
        self.at = None;
        self.steps.clear();
        self.sent.clear();
        self.passed_over.clear();
    }
}

impl DeviceWork {
    fn begin(&mut self, run: Run, identity: DriveIdentity, context: &mut Context) {
        self.give_up();
        (self.run, self.identity) = (run, identity);
        if let Some(family) = context.shared.mapping.family_of(&identity) {
            let (axis, node, name) = (self.number(0), self.node, family.name.clone());
            context.out.push_back(Done::Told(Notice::Family { axis, node, identity, name }));
        }
        self.pdos = [Vec::new(), Vec::new()];
        self.begin_list(0, context);
    }

    /// Begins with the start-up list of an axis, or of the next one that has one; behind the last one with the plans.
    fn begin_list(&mut self, first: usize, context: &mut Context) {
        let next = (first..self.axes.len()).find(|place| !self.axes[*place].startup.is_empty());
        let Some(place) = next else { return self.set_out(0, Plan::Ask, context) };
        let mut list = StartupRun::new(&self.axes[place].startup);
        list.begin(When::Once);
        self.at = Some((place, Task::List(list)));
        self.advance_list(context);
    }

    /// Asks what is next of a start-up list.
    fn advance_list(&mut self, context: &mut Context) {
        let Some((place, Task::List(list))) = &mut self.at else { return };
        let place = *place;
        let request = loop {
            let Some(access) = list.next() else { break None };
            match list_request(access) {
                Some(request) => break Some(request),
                None => list.take(Err(DirectFailure::OtherBus)),
            }
        };
        let (reports, failure) = (list.take_reports(), list.take_failure());
        let axis = self.number(place);
        let told = reports.into_iter().map(|report| Done::Told(Notice::Startup { axis, report }));
        context.out.extend(told);
        match (failure, request) {
            (Some(failure), _) => {
                context.out.push_back(Done::Failed(self.run, Notice::StartupFailed { axis, failure }));
                self.give_up();
            }
            (None, Some(request)) => context.out.push_back(Done::Submit(self.run, request)),
            (None, None) => self.begin_list(place + 1, context),
        }
    }

    /// Begins a plan of an axis.
    fn set_out(&mut self, place: usize, plan: Plan, context: &mut Context) {
        let Some(setup) = self.axes.get(place) else { return };
        if plan == Plan::Ask {
            self.facts = ObjectFacts::of(self.identity);
        }
        match context.shared.mapping.of_drive(&self.facts).cia402_steps(plan, &setup.needs, &self.facts) {
            Ok(steps) => {
                self.at = Some((place, Task::Plan(plan)));
                self.steps = steps.into_iter().map(|step| (step, false)).collect();
                self.advance(context);
            }
            Err(error) => self.fail(place, error.into(), context),
        }
    }

    fn fail(&mut self, place: usize, error: Misfit, context: &mut Context) {
        let axis = self.number(place);
        context.out.push_back(Done::Failed(self.run, Notice::NodeProgram { axis, node: self.node, error }));
        self.give_up();
    }

    /// A step failed that the axis cannot do without.
    fn break_off(&mut self, place: usize, failure: StepFailure, context: &mut Context) {
        let (axis, node) = (self.number(place), self.node);
        context.out.push_back(Done::Failed(self.run, Notice::NodeCommissioning { axis, node, failure }));
        self.give_up();
    }

    fn number(&self, place: usize) -> u8 {
        self.axes.get(place).map_or(u8::MAX, |setup| axis_number(setup.axis))
    }

    /// Takes a step again. A read-back that is under way comes before a write that is repeated, and proves nothing: it follows once more.
    fn repeat(&mut self, step: ObjectStep, object: Object) {
        if matches!(step, ObjectStep::Write { .. }) {
            let reads =
                |step: &ObjectStep| matches!(step, ObjectStep::Read { object: of, .. } if *of == object);
            let back = self.sent.iter().find(|(step, _)| reads(step));
            back.into_iter().for_each(|(read, _)| self.steps.push_front((read.clone(), false)));
        }
        self.steps.push_front((step, true));
    }

    /// Sends what may be sent, and goes on to the next plan when this one is through.
    fn advance(&mut self, context: &mut Context) {
        if let Some((_, Task::Readback(readback))) = &mut self.at {
            while readback.under_way() < WINDOW
                && let Some(object) = readback.next()
            {
                context.out.push_back(Done::Submit(self.run, SdoRequest::upload(object)));
            }
        }
        while self.sent.len() < WINDOW
            && let Some((place, Task::Plan(_))) = self.at
            && let Some((step, repeated)) = self.steps.pop_front()
        {
            let Some(request) = request(&step, &self.axes[place].needs) else {
                // A device without this axis has been told of already, by the axis that it does not have.
                let axis = self.axes[place].needs.axis;
                self.fail(place, Cia402Error::Axis(axis).into(), context);
                return;
            };
            context.out.push_back(Done::Submit(self.run, request));
            self.sent.push_back((step, repeated));
        }
        let is_through = match &self.at {
            Some((_, Task::Readback(readback))) => readback.under_way() == 0,
            Some((_, Task::Plan(_))) => self.sent.is_empty(),
            Some((_, Task::Try(_) | Task::List(_))) | None => false,
        };
        if is_through && let Some((place, task)) = self.at.take() {
            self.through(place, task, context);
        }
    }

    fn through(&mut self, place: usize, task: Task, context: &mut Context) {
        let found = match task {
            Task::Plan(Plan::Ask) => return self.learn_modes(place, context),
            Task::Plan(_) if self.axes[place].pdos.kept || self.falls_back => {
                self.at = Some((place, Task::Readback(Readback::new(self.axes[place].pdos))));
                return self.advance(context);
            }
            Task::Plan(_) => None,
            Task::List(_) => return self.begin_list(place + 1, context),
            Task::Readback(readback) => Some(readback.found()),
            Task::Try(trial) => return self.tried(place, trial, context),
        };
        let axis = self.number(place);
        if !self.passed_over.is_empty() {
            let failures = std::mem::take(&mut self.passed_over);
            context.out.push_back(Done::Told(Notice::ObjectsPassedOver { axis, failures }));
        }
        let mapping = context.shared.mapping.of_drive(&self.facts);
        let mut unmapped = Vec::new();
        let made = loop {
            let setup = &self.axes[place];
            let made = mapping.cia402_program(&setup.needs, &self.facts).map_err(Misfit::from);
            let made =
                made.and_then(|program| Ok((pdo_map(mapping, setup, &program, found.as_ref())?, program)));
            match made {
                // What is in none of the PDOs that it keeps it does not have for the box: perhaps the axis can do without.
                Err(Misfit::Mapped(lack))
                    if unmapped.len() < UNMAPPED_MAX
                        && !unmapped.iter().any(|known: &NotMapped| known.object == lack.object) =>
                {
                    let index = Cia402Dictionary::on_first_axis(lack.object.index);
                    let object = Object { index, ..lack.object };
                    unmapped.push(lack);
                    self.facts.note_missing(object);
                }
                // It cannot, and the first one of them says it best.
                Err(Misfit::Program(_) | Misfit::Mapped(_)) if !unmapped.is_empty() => {
                    break Err(Misfit::Mapped(unmapped.remove(0)));
                }
                made => break made,
            }
        };
        if made.is_ok() && !unmapped.is_empty() {
            let objects = unmapped.iter().map(|lack| lack.object).collect();
            context.out.push_back(Done::Told(Notice::NotMapped { axis, node: self.node, objects }));
        }
        let left_out = mapping.cia402_modes_left_out(&self.axes[place].needs, &self.facts);
        if !left_out.is_empty() {
            context.out.push_back(Done::Told(Notice::NodeModesLeftOut {
                axis,
                node: self.node,
                modes: left_out,
            }));
        }
        let ([(receive, to_drive), (transmit, from_drive)], program) = match made {
            Ok(made) => made,
            Err(error) => return self.fail(place, error, context),
        };
        let needs = &self.axes[place].needs;
        if let Some(found) = mapping.cia402_other_period(needs, &self.facts) {
            let (node, expected) = (self.node, needs.cycle);
            context.out.push_back(Done::Told(Notice::Period { axis, node, expected, found }));
        }
        self.pdos[0].extend(receive);
        self.pdos[1].extend(transmit);
        let which = u8::try_from(place).unwrap_or(u8::MAX);
        context
            .out
            .push_back(Done::Made(self.run, Made::Program(which, Arc::new(program), [to_drive, from_drive])));
        if place + 1 < self.axes.len() {
            self.set_out(place + 1, Plan::Ask, context);
        } else {
            let [receive, transmit] = std::mem::take(&mut self.pdos);
            match PdoSet::new(&context.shared.network, self.node, receive, transmit) {
                Ok(set) => {
                    context.shared.network.take_pdos(&set);
                    context.out.push_back(Done::Made(self.run, Made::Pdos(set)));
                }
                Err(error) => self.fail(place, error.into(), context),
            }
        }
    }

    /// The drive has been asked everything. What it does not tell of its modes stands in the configuration, or is tried.
    fn learn_modes(&mut self, place: usize, context: &mut Context) {
        let needs = &self.axes[place].needs;
        if let Some(words) =
            context.shared.mapping.of_drive(&self.facts).cia402_modes_untold(needs, &mut self.facts)
        {
            let mut trial = Trial::new(words);
            if let Some(request) = trial.begin() {
                self.at = Some((place, Task::Try(trial)));
                context.out.push_back(Done::Submit(self.run, request));
                return;
            }
        }
        self.set_out(place, Plan::Tell, context);
    }

    fn tried(&mut self, place: usize, trial: Trial, context: &mut Context) {
        let (axis, node, tried) = (self.number(place), self.node, trial.tried());
        context.shared.mapping.of_drive(&self.facts).cia402_has_modes(&mut self.facts, tried.codes());
        context.out.push_back(Done::Told(Notice::ModesTried { axis, node, tried }));
        self.set_out(place, Plan::Tell, context);
    }
}

/// A request of a start-up list; `None` for what no CANopen drive has.
fn list_request(access: StartupAccess) -> Option<SdoRequest> {
    let mux = |object: Object| Mux::new(object.index, object.sub);
    match access {
        StartupAccess::Read(Id::Object(object), room) => {
            Some(SdoRequest::upload_into(mux(object), Vec::with_capacity(room)))
        }
        StartupAccess::Write(Id::Object(object), _, bytes) => {
            Some(SdoRequest::download(mux(object), SdoData::Buffer(bytes)))
        }
        StartupAccess::Read(..) | StartupAccess::Write(..) => None,
    }
}

/// A step as the request that it is.
fn request(step: &ObjectStep, needs: &Cia402Axis) -> Option<SdoRequest> {
    let object = object(step.item(needs)?)?;
    let mux = Mux::new(object.index, object.sub);
    Some(match step {
        ObjectStep::Read { .. } => SdoRequest::upload(mux),
        ObjectStep::Write { bytes, .. } => SdoRequest::download(mux, SdoData::inline(bytes)?),
    })
}

/// RPDOs and TPDOs of an axis whose telegrams are known.
fn pdo_map(
    mapping: &Mapping,
    setup: &AxisSetup,
    program: &DriveProgram,
    found: Option<&FoundPdos>,
) -> Result<[(Vec<PdoConfig>, PdoMap); 2], Misfit> {
    let telegram = &program.telegram;
    pdos(mapping, &setup.pdos, &telegram.command, &telegram.feedback, found)
}

/// RPDOs and TPDOs that carry these items: those that were found, or such as the axis may have.
///
/// # Errors
/// There is no room, no length is known, or an item is in none of those that were found.
pub fn pdos(
    mapping: &Mapping,
    pdos: &AxisPdos,
    command: &[Item],
    feedback: &[Item],
    found: Option<&FoundPdos>,
) -> Result<[(Vec<PdoConfig>, PdoMap); 2], Misfit> {
    let values = |items: &[Item]| -> Result<Vec<(Object, u8)>, Misfit> {
        let value = |item: &Item| {
            let len = mapping.dictionaries.cia402.len_of(*item).ok_or(Misfit::Length(*item))?;
            Ok((object(*item).ok_or(Misfit::Length(*item))?, len))
        };
        items.iter().map(value).collect()
    };
    let (command, feedback) = (values(command)?, values(feedback)?);
    if let Some([receive, transmit]) = found {
        return Ok([
            pdos.find(Direction::Receive, &command, receive)?,
            pdos.find(Direction::Transmit, &feedback, transmit)?,
        ]);
    }
    Ok([pdos.pdo_map(Direction::Receive, &command)?, pdos.pdo_map(Direction::Transmit, &feedback)?])
}
