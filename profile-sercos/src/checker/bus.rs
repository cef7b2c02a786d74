//! A master and its slaves in virtual time, under a checker.
//!
//! Time jumps from cycle to cycle. The telegrams of a cycle go out back to back, pass every station, and come
//! back in the same moment. A violation of a rule ends the test unless it is made on purpose: see [`checked_bus`](super::checked_bus).

use std::fmt;

use profile_generic::time::{DurationNs, MonotonicTime};

use super::checked_bus::{CheckedBus, Tried};
use crate::master::Master;
use crate::master::config::{ConfigError, MasterConfig};
use crate::master::event::{Event, Output, Port, SlaveId, Ticket};
use crate::master::phase::State;
use crate::master::svc::request::{SvcOutcome, SvcRequest};
use crate::slave::{Application, Network};
use crate::wire::header::Phase;

/// Is told about a passage: topology address, outward, frame before and behind the station, where it may be changed.
pub type Watch<'a> = dyn FnMut(u16, bool, &[u8], &mut [u8]) + 'a;

/// Is told what comes to a port of the master.
pub type Arrived<'a> = dyn FnMut(Port, &mut [u8]) + 'a;

/// What a station does besides: topology address, outward, the frame as it leaves the station.
pub type Misdeed = Box<dyn FnMut(u16, bool, &mut [u8])>;

/// What is behind the master's ports.
pub trait Stations {
    /// Looks after the time-outs of all stations.
    fn handle_time(&mut self, now: MonotonicTime);

    /// Sends a frame from a port of the master through the stations, which change it, and tells `watch` about each of
    /// them. `arrived` gets what comes to a port of the master.
    fn pass(
        &mut self,
        now: MonotonicTime,
        port: Port,
        frame: &mut [u8],
        watch: &mut Watch<'_>,
        arrived: &mut Arrived<'_>,
    );
}

impl<A: Application> Stations for Network<A> {
    fn handle_time(&mut self, now: MonotonicTime) {
        Network::handle_time(self, now);
    }

    fn pass(
        &mut self,
        now: MonotonicTime,
        port: Port,
        frame: &mut [u8],
        watch: &mut Watch<'_>,
        arrived: &mut Arrived<'_>,
    ) {
        self.send_watched(now, port, frame, Some(watch), arrived);
    }
}

/// What happens to a frame on a cable; false when it does not arrive.
pub type Cable = Box<dyn FnMut(&mut Vec<u8>) -> bool>;

/// A master, what is behind its port, and the checker.
pub struct VirtualBus<S> {
    /// The virtual time.
    pub now: MonotonicTime,
    /// The master under test.
    pub master: Master,
    /// The slaves.
    pub line: S,
    /// The checker, and what is broken on purpose.
    pub checked: CheckedBus,
    /// Makes the master do what it does not do by itself: changes its frames before anybody sees them.
    pub outward: Cable,
    /// Makes a station do what it does not do by itself.
    pub station: Misdeed,
    /// Disturbs the frames on their way back, behind all stations.
    pub cable: Cable,
    /// Events of the master.
    pub log: Vec<Event>,
    /// Start and phase byte of each cycle.
    pub cycles: Vec<(MonotonicTime, u8)>,
    /// Calls `proceed` and `proceed_hot_plug` where the master awaits its application.
    pub auto_proceed: bool,
}

impl<S: Stations> Tried for VirtualBus<S> {
    fn checked(&mut self) -> &mut CheckedBus {
        &mut self.checked
    }
}

impl<S: fmt::Debug> fmt::Debug for VirtualBus<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("VirtualBus").field("now", &self.now).field("state", &self.master.state()).finish()
    }
}

impl<S: Stations> VirtualBus<S> {
    /// A silent bus.
    ///
    /// # Errors
    /// What the master finds wrong with its configuration.
    pub fn new(config: MasterConfig, line: S) -> Result<VirtualBus<S>, ConfigError> {
        Ok(VirtualBus {
            now: MonotonicTime::ZERO,
            master: Master::new(config)?,
            line,
            checked: CheckedBus::new(MonotonicTime::ZERO),
            outward: Box::new(|_| true),
            station: Box::new(|_, _, _| {}),
            cable: Box::new(|_| true),
            log: Vec::new(),
            cycles: Vec::new(),
            auto_proceed: true,
        })
    }

    /// One wake-up: a cycle with all its frames, and the events. Without telegrams a millisecond passes.
    ///
    /// # Panics
    /// When a rule is broken that was not declared.
    pub fn step(&mut self) {
        let Some(at) = self.master.wake_at() else {
            self.now = self.now + DurationNs::from_millis(1);
            return;
        };
        self.now = self.now.max(at);
        self.line.handle_time(self.now);
        let mut out = Vec::new();
        while let Some(Output::Transmit { port, frame }) = self.master.poll(self.now) {
            out.push((port, frame.to_vec()));
        }
        if let Some((_, first)) = out.first() {
            self.cycles.push((self.now, first[15]));
        }
        for (port, mut frame) in out {
            if !(self.outward)(&mut frame) {
                continue;
            }
            let (now, master, cable) = (self.now, &mut self.master, &mut self.cable);
            let mut arrived = |port, frame: &mut [u8]| {
                let mut frame = frame.to_vec();
                if cable(&mut frame) {
                    // What the master refuses it counts by itself.
                    let _ = master.handle_frame(now, port, &frame);
                }
            };
            self.checked.send(now, port, &mut frame, &mut self.line, &mut self.station, &mut arrived);
        }
        self.checked.judge();
        while let Some(event) = self.master.poll_event() {
            if let Event::HotPlugAwaits { slave, .. } = event
                && self.auto_proceed
            {
                // Refused only when it has gone again.
                let _ = self.master.proceed_hot_plug(slave);
            }
            if self.auto_proceed && matches!(event, Event::AwaitingApplication { .. }) {
                // Refused only when the target has changed meanwhile.
                let _ = self.master.proceed();
            }
            self.log.push(event);
        }
    }

    /// Lets so many cycles pass.
    pub fn cycles(&mut self, cycles: usize) {
        (0..cycles).for_each(|_| self.step());
    }

    /// Lets cycles pass until `done`.
    ///
    /// # Panics
    /// After 20000 cycles; `what` says what did not happen.
    pub fn run_until(&mut self, what: &str, done: impl Fn(&Self) -> bool) {
        for _ in 0..20_000 {
            if done(self) {
                return;
            }
            self.step();
        }
        let report: Vec<_> = self.master.report(SlaveId(0)).iter().map(ToString::to_string).collect();
        let state = self.master.state();
        panic!("never {what}: {state:?} at {}, {:#?}\n{report:#?}", self.now, self.log);
    }

    /// Goes to a phase.
    pub fn up_to(&mut self, phase: Phase) {
        self.master.set_target_phase(phase);
        self.run_until("up", |bus| bus.log.contains(&Event::Phase(phase)));
    }

    /// Lets cycles pass until the master is in this state.
    pub fn state(&mut self, state: State) {
        self.run_until("in the state", |bus| bus.master.state() == state);
    }

    /// Whether an event has come.
    #[must_use]
    pub fn saw(&self, event: &Event) -> bool {
        self.log.contains(event)
    }

    /// The outcome of a request, if it is there.
    #[must_use]
    pub fn outcome(&self, wanted: Ticket) -> Option<&SvcOutcome> {
        self.log.iter().find_map(|event| match event {
            Event::Svc { ticket, outcome } if *ticket == wanted => Some(outcome),
            _ => None,
        })
    }

    /// Runs a request to its outcome.
    ///
    /// # Panics
    /// When the slave takes no requests, or without an outcome after 3000 cycles.
    pub fn request(&mut self, slave: SlaveId, request: SvcRequest) -> SvcOutcome {
        let Ok(ticket) = self.master.svc_submit(slave, request) else { panic!("{slave} takes no request") };
        for _ in 0..3000 {
            self.step();
            if let Some(outcome) = self.outcome(ticket) {
                return outcome.clone();
            }
        }
        panic!("no outcome from {slave}");
    }
}
