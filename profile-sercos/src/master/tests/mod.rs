//! The master in virtual time against a line of scripted slaves.

mod peer;

use std::fmt::Write as _;

use profile_generic::time::{DurationNs, MonotonicTime};

use self::peer::Line;
use super::config::{ConnectionConfig, MasterConfig, SlaveConfig};
use super::connection::ConsumerState;
use super::event::{Event, Output, Port, Refusal, SlaveId};
use super::phase::State;
use super::station::Presence;
use super::svc::request::{SvcFailure, SvcRequest};
use super::{CallError, Master, SubmitError};
use crate::wire::header::{HEADER_LEN, MacAddress, Phase};
use crate::wire::idn::Idn;

const MAC: MacAddress = [2, 0, 0, 0, 0, 1];

/// A slave with the recording's connections: MDT {134, 36}, AT {135, 40, 51}.
fn slave(address: u16) -> SlaveConfig {
    let idns = |numbers: &[u16]| numbers.iter().map(|&n| Idn::standard(n)).collect::<Vec<_>>();
    let connections = [
        ConnectionConfig::new(0, false, &idns(&[134, 36])).unwrap(),
        ConnectionConfig::new(1, true, &idns(&[135, 40, 51])).unwrap(),
    ];
    SlaveConfig { address, connections: connections.into_iter().collect() }
}

fn config(addresses: &[u16]) -> MasterConfig {
    MasterConfig {
        slaves: addresses.iter().map(|&address| slave(address)).collect(),
        stable_cycles: 10,
        ..MasterConfig::new(MAC, 1_000_000)
    }
}

/// What happens to a frame on its way back; false when it does not arrive.
type Cable = Box<dyn FnMut(&mut Vec<u8>) -> bool>;

struct Rig {
    now: MonotonicTime,
    master: Master,
    line: Line,
    cable: Cable,
    log: Vec<Event>,
    /// Start of each cycle with its phase byte.
    cycles: Vec<(MonotonicTime, u8)>,
    auto_proceed: bool,
}

impl Rig {
    fn new(addresses: &[u16]) -> Rig {
        Rig::with(config(addresses), addresses)
    }

    fn with(config: MasterConfig, addresses: &[u16]) -> Rig {
        Rig {
            now: MonotonicTime::ZERO,
            master: Master::new(config).unwrap(),
            line: Line::new(addresses),
            cable: Box::new(|_| true),
            log: Vec::new(),
            cycles: Vec::new(),
            auto_proceed: true,
        }
    }

    /// One wake-up: a cycle with all its frames, and the events.
    fn step(&mut self) {
        let Some(at) = self.master.wake_at() else {
            self.now = self.now + DurationNs::from_millis(1);
            return;
        };
        self.now = self.now.max(at);
        let mut out = Vec::new();
        while let Some(Output::Transmit { port, frame }) = self.master.poll(self.now) {
            assert_eq!(port, Port::One);
            out.push(frame.to_vec());
        }
        if let Some(first) = out.first() {
            self.cycles.push((self.now, first[15]));
        }
        for mut frame in out {
            self.line.pass(&mut frame);
            if (self.cable)(&mut frame) {
                let _ = self.master.handle_frame(self.now, Port::One, &frame);
            }
        }
        while let Some(event) = self.master.poll_event() {
            if self.auto_proceed && matches!(event, Event::AwaitingApplication { .. }) {
                self.master.proceed().unwrap();
            }
            self.log.push(event);
        }
    }

    fn run_until(&mut self, what: &str, done: impl Fn(&Rig) -> bool) {
        for _ in 0..20_000 {
            if done(self) {
                return;
            }
            self.step();
        }
        panic!("never {what}: {:?} at {}, {:#?}", self.master.state(), self.now, self.log);
    }

    fn up_to(&mut self, phase: Phase) {
        self.master.set_target_phase(phase);
        self.run_until("up", |rig| rig.log.contains(&Event::Phase(phase)));
    }

    fn state(&mut self, state: State) {
        self.run_until("in the state", |rig| rig.master.state() == state);
    }

    fn cycles(&mut self, cycles: usize) {
        for _ in 0..cycles {
            self.step();
        }
    }

    /// Runs until the result of a request is there.
    fn request(&mut self, slave: u16, request: SvcRequest) -> Result<Option<u64>, SvcFailure> {
        let wanted = self.master.svc_submit(SlaveId(slave), request).unwrap();
        for _ in 0..3000 {
            self.step();
            let found = self.log.iter().find_map(|event| match event {
                Event::Svc { ticket, outcome } if *ticket == wanted => {
                    Some(outcome.result.map(|_| outcome.data.unsigned()))
                }
                _ => None,
            });
            if let Some(result) = found {
                return result;
            }
        }
        panic!("no outcome");
    }
}

mod disturbance;
mod faults;
mod full_slaves;
mod phase_up;
mod recording;
