//! Carrying out a commissioning plan: the reads and writes of one drive in one communication phase.
//!
//! Steps run one after the other over the drive's service channel; all drives run at the same time. What the drive
//! says is kept in its [`DriveFacts`], from which the next plan and in the end the drive's program are compiled.

use arrayvec::ArrayVec;
use profile_sercos::master::svc::request::{
    Shape, SvcData, SvcFailure, SvcOperation, SvcOutcome, SvcRequest,
};
use profile_sercos::wire::attribute::Attribute;
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::svc::Element;

use crate::mapping::{CommissioningPlan, DriveFacts, Refused, Step};

/// Bytes kept of an element that is longer than a request holds by itself; texts and lists are not scaling.
const BUFFER_LEN: usize = 1024;

/// A step that the drive did not take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{what} {idn}: {failure}")]
pub struct StepFailure {
    /// What was tried.
    pub what: &'static str,
    /// The parameter or command.
    pub idn: Idn,
    /// Why it failed.
    pub failure: SvcFailure,
}

/// One plan under way. `T` distinguishes its requests.
#[derive(Debug)]
pub struct Commissioning<T> {
    plan: CommissioningPlan,
    /// The step under way.
    at: usize,
    /// The value of a write, or the element of a read, under way.
    part: usize,
    /// How that element is transferred, where the attribute has reported it.
    shape: Option<Shape>,
    ticket: Option<T>,
    failure: Option<StepFailure>,
    /// Steps that failed and were allowed to.
    passed_over: Vec<StepFailure>,
    /// Steps one after the other to which the drive has not said a word.
    unanswered: ArrayVec<StepFailure, UNANSWERED_MAX>,
}

/// So many steps without a word, and the drive is given up.
const UNANSWERED_MAX: usize = 5;

/// Whether the drive has not said a word.
fn is_silence(failure: SvcFailure) -> bool {
    matches!(failure, SvcFailure::HandshakeTimeout { .. } | SvcFailure::BusyTimeout { .. })
}

impl<T: Copy + PartialEq> Commissioning<T> {
    /// Starts a plan.
    #[must_use]
    pub fn new(plan: CommissioningPlan) -> Self {
        Self {
            plan,
            at: 0,
            part: 0,
            shape: None,
            ticket: None,
            failure: None,
            passed_over: Vec::new(),
            unanswered: ArrayVec::new(),
        }
    }

    /// Whether every step is through, or one failed that must not.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.failure.is_some() || self.at >= self.plan.steps.len()
    }

    /// Whether a request is under way.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        self.ticket.is_some()
    }

    /// Whether the phase is to be planned again, with what the drive has reported.
    #[must_use]
    pub fn wants_more(&self) -> bool {
        self.plan.more && self.failure.is_none()
    }

    /// The step that ended the plan early.
    #[must_use]
    pub fn failure(&self) -> Option<StepFailure> {
        self.failure
    }

    /// Takes the steps that the drive refused and that it may refuse.
    #[must_use]
    pub fn take_passed_over(&mut self) -> Vec<StepFailure> {
        std::mem::take(&mut self.passed_over)
    }

    /// Submits what is next, when nothing is under way.
    pub fn poll(&mut self, submit: &mut dyn FnMut(SvcRequest) -> Option<T>) {
        while self.ticket.is_none() && !self.is_done() {
            let Some(request) = self.request() else {
                self.next_step();
                continue;
            };
            match submit(request) {
                Some(ticket) => self.ticket = Some(ticket),
                // The queue is full or the phase changes: tried again in the next cycle.
                None => return,
            }
        }
    }

    /// Takes an outcome if it is this plan's; `false` when it is another's.
    pub fn handle(&mut self, ticket: T, outcome: &SvcOutcome, facts: &mut DriveFacts) -> bool {
        if self.ticket != Some(ticket) {
            return false;
        }
        self.ticket = None;
        if !matches!(outcome.result, Err(failure) if is_silence(failure)) {
            self.unanswered.clear();
        }
        match &outcome.result {
            Ok(reply) => {
                let (idn, bytes) = (outcome.idn, outcome.data.as_slice());
                // On the way to other elements the master reads it by itself.
                if let Some(attribute) = reply.attribute {
                    facts.note_attribute(idn, attribute);
                }
                match outcome.operation {
                    SvcOperation::Read(Element::Attribute) => {
                        if let Some(word) = bytes.first_chunk() {
                            facts.note_attribute(idn, Attribute(u32::from_le_bytes(*word)));
                        }
                    }
                    SvcOperation::Read(Element::Unit) => facts.note_unit(idn, bytes),
                    SvcOperation::Read(Element::Minimum) => facts.note_limit(idn, false, bytes),
                    SvcOperation::Read(Element::Maximum) => facts.note_limit(idn, true, bytes),
                    SvcOperation::Read(Element::Data) | SvcOperation::Write(Element::Data) => {
                        facts.note_data(idn, bytes);
                    }
                    _ => {}
                }
                self.next_part(facts);
            }
            // An element that is not there reports nothing; the drive may have the parameter all the same.
            Err(SvcFailure::Refused { .. })
                if matches!(
                    outcome.operation,
                    SvcOperation::Read(Element::Unit | Element::Minimum | Element::Maximum)
                ) =>
            {
                self.next_part(facts);
            }
            Err(failure) => {
                if failure.is_absent() {
                    facts.note_missing(outcome.idn);
                } else if outcome.operation == SvcOperation::Write(Element::Data) {
                    facts.note_refused(outcome.idn);
                } else if outcome.operation == SvcOperation::Read(Element::Data) {
                    facts.note_unread(outcome.idn);
                }
                self.failed(outcome.idn, *failure);
            }
        }
        true
    }

    fn request(&self) -> Option<SvcRequest> {
        match self.plan.steps.get(self.at)? {
            Step::Write { idn, candidates, .. } => {
                let data = SvcData::inline(candidates.get(self.part)?)?;
                Some(SvcRequest::write(*idn, data))
            }
            Step::Read { idn, elements, .. } => {
                let request = SvcRequest::new(*idn, SvcOperation::Read(*elements.get(self.part)?));
                let request = request.with_buffer(Vec::with_capacity(BUFFER_LEN));
                Some(match self.shape {
                    Some(shape) => request.with_shape(shape),
                    None => request,
                })
            }
            Step::Command { idn, .. } => (self.part == 0).then(|| SvcRequest::command(*idn)),
        }
    }

    fn next_step(&mut self) {
        self.at += 1;
        self.part = 0;
        self.shape = None;
    }

    /// On to the next element of a read, or to the next step.
    fn next_part(&mut self, facts: &DriveFacts) {
        let Some(Step::Read { idn, elements, .. }) = self.plan.steps.get(self.at) else {
            self.next_step();
            return;
        };
        self.part += 1;
        let attribute = facts.attribute(*idn);
        let variable = attribute.is_some_and(|attribute| attribute.is_list());
        // A text or a list has no smallest and largest value.
        let limit = |element: Option<&Element>| matches!(element, Some(Element::Minimum | Element::Maximum));
        while variable && limit(elements.get(self.part)) {
            self.part += 1;
        }
        self.shape = attribute.filter(|_| elements.get(self.part) != Some(&Element::Unit)).map(|attribute| {
            if variable { Shape::List } else { Shape::Fixed(attribute.item_length().bytes()) }
        });
        if self.part >= elements.len() {
            self.next_step();
        }
    }

    fn failed(&mut self, idn: Idn, failure: SvcFailure) {
        let (what, refused, another) = match self.plan.steps.get(self.at) {
            Some(Step::Write { candidates, refused, .. }) => {
                ("writing", *refused, self.part + 1 < candidates.len())
            }
            Some(Step::Read { refused, .. }) => ("reading", *refused, false),
            Some(Step::Command { refused, .. }) => ("executing", *refused, false),
            None => return,
        };
        if another {
            self.part += 1;
            return;
        }
        let failure = StepFailure { what, idn, failure };
        if is_silence(failure.failure) && !self.unanswered.is_full() {
            self.unanswered.push(failure);
        }
        match refused {
            // Whatever it is asked now, it would not answer either.
            _ if self.unanswered.is_full() => self.failure = self.unanswered.first().copied(),
            Refused::Fail => self.failure = Some(failure),
            Refused::Continue => {
                self.passed_over.push(failure);
                self.next_step();
            }
        }
    }
}
