//! Whether an axis comes into every state and out of it again, with the requests and reports that the tables have.
//!
//! The state machine itself is walked ([`BasicDrive`]): every event that a table or the box can bring, in every situation that
//! they lead to.

use std::collections::HashMap;
use std::ops::Range;

use profile_generic::fault::Reaction;
use profile_generic::inhibit::Inhibits;
use profile_generic::state::{BasicDrive, DriveState, Event, Report, Request};

use crate::Mapping;
use crate::finding::registry as code;
use crate::finding::{Findings, Problem, Source};
use crate::format::Name;

/// More situations than the machine has; a bound in case the machine is changed.
const SITUATIONS_MAX: usize = 20_000;

/// Something that can happen.
#[derive(Debug, Clone, Copy)]
enum Happening {
    Event(Event),
    Inhibits(Inhibits),
    Power(bool),
    Fault(Reaction),
    FaultGone,
}

/// Walks the machine for SERCOS drives, those that acknowledge and those that do not.
pub(super) fn check(mapping: &Mapping, walks: &mut Walks, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    for told in [true, false] {
        let rows = file.rows.report.iter().filter(|row| row.acknowledges.is_none_or(|wanted| wanted == told));
        let drives = if told { "acknowledges" } else { "does not acknowledge" };
        let place = (&*file.text, file.rows.mapping.span());
        walks.check(rows.map(|row| &row.report), &format!("a drive that {drives}"), place, findings);
    }
}

/// The same for CiA 402 drives, those that tell whether they follow and those that do not.
pub(super) fn cia402(mapping: &Mapping, walks: &mut Walks, findings: &mut Findings) {
    let file = &mapping.tables().generic_cia402;
    for told in [true, false] {
        let rows = file.rows.report.iter().filter(|row| row.follows.is_none_or(|wanted| wanted == told));
        let drives = if told { "tells" } else { "does not tell" };
        let drives = format!("a CiA 402 drive that {drives} whether it follows");
        let place = (&*file.text, file.rows.mapping.span());
        walks.check(rows.map(|row| &row.report), &drives, place, findings);
    }
}

/// The machine with what a controller can ask, walked once for each set of reports that drives have.
pub(super) struct Walks {
    requests: Vec<Request>,
    known: HashMap<Vec<Report>, Vec<(DriveState, Gap)>>,
}

/// What is wrong with a state.
#[derive(Clone, Copy)]
enum Gap {
    NoWayIn,
    NoWayOut,
}

impl Walks {
    pub(super) fn of(mapping: &Mapping) -> Self {
        let cip = &mapping.tables().cip_generic.rows;
        let requests = cip.request.iter().filter_map(|row| row.request.as_ref());
        let requests = requests.chain(cip.drive_action.iter().filter_map(|row| row.request.as_ref()));
        let mut requests: Vec<Request> = requests.filter_map(|name| Request::parse(name.get_ref())).collect();
        // Stop and Coast are what the stopping actions come to.
        requests.extend([Request::Stop, Request::Coast]);
        Self { requests, known: HashMap::new() }
    }

    /// Walks the machine with what some drives report.
    fn check<'r>(
        &mut self,
        reports: impl Iterator<Item = &'r Name>,
        drives: &str,
        (text, span): (&Source, Range<usize>),
        findings: &mut Findings,
    ) {
        let mut reports: Vec<Report> = reports.filter_map(|name| Report::parse(name.get_ref())).collect();
        // The box itself says so.
        reports.extend([Report::Silent, Report::NotReady]);
        reports.sort_unstable();
        reports.dedup();
        let missing = missing(&self.requests, &reports);
        let requests = &self.requests;
        let gaps = self.known.entry(reports).or_insert_with_key(|reports| gaps(requests, reports));
        for (state, gap) in gaps {
            let (code, what) = match gap {
                Gap::NoWayIn => (code::NO_WAY_IN, "never comes to"),
                Gap::NoWayOut => (code::NO_WAY_OUT, "never comes back to `ready` from"),
            };
            let problem = Problem::new(code, span.clone());
            let problem = problem.title(format!("an axis {what} the state `{state}`, with {drives}"));
            findings.push(text, problem.expected(format!("no row brings {missing}")));
        }
    }
}

/// The states that an axis does not come into or out of.
fn gaps(requests: &[Request], reports: &[Report]) -> Vec<(DriveState, Gap)> {
    let walk = Walk::new(&happenings(requests, reports));
    let leading = walk.leading_to_ready();
    let of = |state: DriveState| {
        let mut there = walk.situations.iter().zip(&leading).filter(|(at, _)| at.state() == state).peekable();
        match there.peek() {
            None => Some((state, Gap::NoWayIn)),
            Some(_) => (!there.any(|(_, leads)| *leads)).then_some((state, Gap::NoWayOut)),
        }
    };
    DriveState::ALL.iter().filter_map(|state| of(*state)).collect()
}

/// What no row brings, of what could lead on.
fn missing(requests: &[Request], reports: &[Report]) -> String {
    let requests = Request::ALL.iter().filter(|request| !requests.contains(request));
    let reports = Report::ALL.iter().filter(|report| !reports.contains(report));
    let names: Vec<String> = requests
        .map(|request| format!("the request `{request}`"))
        .chain(reports.map(|report| format!("the report `{report}`")))
        .collect();
    if names.is_empty() { "what leads there".to_owned() } else { names.join(", ") }
}

fn happenings(requests: &[Request], reports: &[Report]) -> Vec<Happening> {
    let mut all: Vec<Happening> =
        requests.iter().map(|request| Happening::Event(Event::Request(*request))).collect();
    all.extend(reports.iter().map(|report| Happening::Event(Event::Report(*report))));
    all.extend([Event::TestComplete, Event::CommandLost, Event::Timeout].map(Happening::Event));
    all.extend([Inhibits::all(), Inhibits::empty()].map(Happening::Inhibits));
    all.extend([true, false].map(Happening::Power));
    all.extend(Reaction::ALL.iter().map(|reaction| Happening::Fault(*reaction)));
    all.push(Happening::FaultGone);
    all
}

/// Every situation that can come, and which lead to which.
struct Walk {
    situations: Vec<BasicDrive>,
    /// For each situation those that lead to it.
    before: Vec<Vec<usize>>,
}

impl Walk {
    fn new(happenings: &[Happening]) -> Self {
        let mut walk = Self { situations: vec![BasicDrive::new()], before: vec![Vec::new()] };
        let mut known = HashMap::from([(BasicDrive::new(), 0)]);
        let mut at = 0;
        while at < walk.situations.len() && at < SITUATIONS_MAX {
            for happening in happenings {
                let mut next = walk.situations[at];
                match *happening {
                    Happening::Event(event) => {
                        next.handle(event);
                    }
                    Happening::Inhibits(inhibits) => {
                        next.set_inhibits(inhibits);
                    }
                    Happening::Power(power) => next.set_power(power),
                    Happening::Fault(reaction) => {
                        next.raise_fault(reaction);
                    }
                    Happening::FaultGone => {
                        next.clear_faults();
                    }
                }
                // Most happenings change nothing.
                if next == walk.situations[at] {
                    continue;
                }
                let to = *known.entry(next).or_insert_with(|| {
                    walk.situations.push(next);
                    walk.before.push(Vec::new());
                    walk.situations.len() - 1
                });
                if walk.before[to].last() != Some(&at) {
                    walk.before[to].push(at);
                }
            }
            at += 1;
        }
        walk
    }

    /// For each situation whether something leads from it to the state from which an axis is started.
    fn leading_to_ready(&self) -> Vec<bool> {
        let is_ready = |at: &usize| self.situations[*at].state() == DriveState::Ready;
        let mut reached: Vec<usize> = (0..self.situations.len()).filter(is_ready).collect();
        let mut leads = vec![false; self.situations.len()];
        while let Some(at) = reached.pop() {
            if !std::mem::replace(&mut leads[at], true) {
                reached.extend(&self.before[at]);
            }
        }
        leads
    }
}
