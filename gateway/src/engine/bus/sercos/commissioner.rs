//! The commissioning of drives that come while others move: beside the cycle thread, because it allocates.
//!
//! ```text
//! cycle thread                            commissioner, on a thread of its own
//!   Begin { phase } ------------------->  compiles the plan, keeps what the drive tells
//!   <------------------- Submit { request }
//!   Outcome, Unsent ------------------->
//!   <------------------- Connect (CP2), Program (CP3), or Failed
//! ```
//!
//! What was made for a drive that has gone again comes back as [`Job::Unused`] and is freed here.

use profile_sercos::master::config::Connections;
use profile_sercos::master::svc::request::{SvcOutcome, SvcRequest};
use profile_sercos::wire::header::Phase;

use super::commissioning::{Commissioning, StepFailure};
use super::{connections, limitations};
use crate::engine::notice::Notice;
use crate::mapping::{DriveFacts, DriveProgram, Mapping, SercosAxis};

/// Messages under way in each direction.
const QUEUE: usize = 64;

/// Which commissioning of which drive a message belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Run {
    /// Place of the drive among those of the bus.
    pub place: u8,
    /// Counts the times that its drive came; what belongs to an earlier time is not used.
    pub number: u32,
}

/// What the cycle thread wants.
#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "queue slots have one size, and boxing would allocate")]
pub enum Job {
    /// A drive can be set up as in CP2, or then as in CP3; whether its connections cannot be configured.
    Begin(Run, Phase, bool),
    /// What came of a request.
    Outcome(Run, SvcOutcome),
    /// A request that could not be made.
    Unsent(Run, SvcRequest),
    /// What came of a request that nobody waits for any more.
    Spent(SvcOutcome),
    /// Something that is not needed any more.
    Unused(Done),
}

/// What the commissioner has done.
#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "queue slots have one size, and boxing would allocate")]
pub enum Done {
    /// A request for the drive's service channel; the next one comes when its outcome is known.
    Submit(Run, SvcRequest),
    /// The connections of the drive: it is through with CP2.
    Connect(Run, Connections),
    /// The program of the drive: it is through with CP3.
    Program(Run, DriveProgram),
    /// The drive cannot be used.
    Failed(Run, Notice),
    /// Something that people should know.
    Told(Notice),
}

/// The cycle thread's end.
#[derive(Debug)]
pub struct CommissionerHandle {
    jobs: rtrb::Producer<Job>,
    done: rtrb::Consumer<Done>,
}

impl CommissionerHandle {
    /// Hands a job over; `false` when there is no room, and it is dropped.
    pub fn push(&mut self, job: Job) -> bool {
        self.jobs.push(job).is_ok()
    }

    /// Whether a job can be handed over now.
    #[must_use]
    pub fn has_room(&self) -> bool {
        !self.jobs.is_full()
    }

    /// What is done.
    pub fn pop(&mut self) -> Option<Done> {
        self.done.pop().ok()
    }
}

/// One drive.
#[derive(Debug)]
struct Work {
    /// Number of its axis.
    axis: u8,
    address: u16,
    needs: SercosAxis,
    facts: DriveFacts,
    run: Run,
    phase: Phase,
    plan: Option<Commissioning<u32>>,
    /// Steps that the drive did not take and need not, until they are told.
    passed_over: Vec<StepFailure>,
    serial: u32,
}

/// Commissions drives that come while others move.
#[derive(Debug)]
pub struct Commissioner {
    mapping: Mapping,
    allowed_losses: u16,
    drives: Vec<Work>,
    jobs: rtrb::Consumer<Job>,
    done: rtrb::Producer<Done>,
    /// What the queue had no room for.
    waiting: std::collections::VecDeque<Done>,
}

impl Commissioner {
    /// A commissioner for these drives, number, address and needs of each axis, and the cycle thread's end.
    #[must_use]
    pub fn new(
        mapping: Mapping,
        allowed_losses: u16,
        drives: impl IntoIterator<Item = (usize, u16, SercosAxis)>,
    ) -> (Self, CommissionerHandle) {
        let (jobs_in, jobs) = rtrb::RingBuffer::new(QUEUE);
        let (done, done_out) = rtrb::RingBuffer::new(QUEUE);
        let work = |(axis, address, needs)| Work {
            axis: u8::try_from(axis).unwrap_or(u8::MAX),
            address,
            needs,
            facts: DriveFacts::new(),
            run: Run { place: 0, number: 0 },
            phase: Phase::CP2,
            plan: None,
            passed_over: Vec::new(),
            serial: 0,
        };
        let drives = drives.into_iter().map(work).collect();
        let waiting = std::collections::VecDeque::new();
        (
            Self { mapping, allowed_losses, drives, jobs, done, waiting },
            CommissionerHandle { jobs: jobs_in, done: done_out },
        )
    }

    /// Whether the cycle thread has gone.
    #[must_use]
    pub fn is_abandoned(&self) -> bool {
        self.jobs.is_abandoned()
    }

    /// Does what there is to do, without waiting.
    pub fn poll(&mut self) {
        while let Ok(job) = self.jobs.pop() {
            match job {
                Job::Begin(run, phase, fixed) => self.begin(run, phase, fixed),
                Job::Outcome(run, outcome) => {
                    let work = self.drives.get_mut(usize::from(run.place)).filter(|work| work.run == run);
                    if let Some(work) = work
                        && let Some(plan) = &mut work.plan
                    {
                        plan.handle(work.serial, &outcome, &mut work.facts);
                    }
                }
                Job::Unsent(run, _) => {
                    let work = self.drives.get_mut(usize::from(run.place)).filter(|work| work.run == run);
                    work.into_iter().for_each(|work| work.plan = None);
                }
                Job::Spent(_) | Job::Unused(_) => {}
            }
            self.advance();
        }
        while let Some(done) = self.waiting.pop_front() {
            if let Err(rtrb::PushError::Full(done)) = self.done.push(done) {
                self.waiting.push_front(done);
                return;
            }
        }
    }

    fn begin(&mut self, run: Run, phase: Phase, fixed: bool) {
        let Some(work) = self.drives.get_mut(usize::from(run.place)) else { return };
        (work.run, work.phase) = (run, phase);
        if phase == Phase::CP2 {
            work.facts = DriveFacts::new();
            work.facts.note_fixed_connections(fixed);
            work.passed_over.clear();
        }
        match self.mapping.commissioning(&work.needs, phase.0, &work.facts) {
            Ok(plan) => work.plan = Some(Commissioning::new(plan)),
            Err(error) => {
                let notice = Notice::Program { axis: work.axis, address: work.address, error };
                self.waiting.push_back(Done::Failed(run, notice));
            }
        }
    }

    /// The next request of each plan, and what follows from those that are through.
    fn advance(&mut self) {
        let Self { mapping, drives, waiting, allowed_losses, .. } = self;
        for work in drives {
            let (run, Some(plan)) = (work.run, &mut work.plan) else { continue };
            let serial = &mut work.serial;
            plan.poll_with(|request| {
                *serial += 1;
                waiting.push_back(Done::Submit(run, request));
                Some(*serial)
            });
            if !plan.is_done() {
                continue;
            }
            let (axis, address) = (work.axis, work.address);
            let failed = plan.failure();
            let more = plan.wants_more();
            work.passed_over.append(&mut plan.take_passed_over());
            if more {
                match mapping.commissioning(&work.needs, work.phase.0, &work.facts) {
                    Ok(next) => {
                        let next = work.plan.insert(Commissioning::new(next));
                        next.poll_with(|request| {
                            *serial += 1;
                            waiting.push_back(Done::Submit(run, request));
                            Some(*serial)
                        });
                    }
                    Err(error) => {
                        work.plan = None;
                        waiting.push_back(Done::Failed(run, Notice::Program { axis, address, error }));
                    }
                }
                continue;
            }
            if (failed.is_some() || work.phase != Phase::CP2) && !work.passed_over.is_empty() {
                let failures = std::mem::take(&mut work.passed_over);
                waiting.push_back(Done::Told(Notice::PassedOver { axis, failures }));
            }
            work.plan = None;
            if let Some(failure) = failed {
                waiting.push_back(Done::Failed(run, Notice::Commissioning { axis, address, failure }));
                continue;
            }
            let done = if work.phase == Phase::CP2 {
                connections(mapping, &work.needs, &work.facts, *allowed_losses)
                    .map(|connections| Done::Connect(run, connections))
            } else {
                for difference in work.facts.differences(&mapping.dictionaries.sercos) {
                    waiting.push_back(Done::Told(Notice::Difference { axis, difference }));
                }
                let (needs, facts) = (&work.needs, &work.facts);
                mapping.sercos_program(needs, facts).map(|program| {
                    let known = limitations(mapping, axis, address, needs, facts, &program);
                    waiting.extend(known.into_iter().map(Done::Told));
                    Done::Program(run, program)
                })
            };
            waiting.push_back(
                done.unwrap_or_else(|error| Done::Failed(run, Notice::Program { axis, address, error })),
            );
        }
    }
}
