//! Controller and peer on one virtual clock.

use super::peer::Peer;
use crate::controller::{
    AxisSetup, Controller, ControllerConfig, DATAGRAM_MAX, Event, Report, Step, StreamAction,
};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

/// System time less monotonic time in the rig.
pub const OFFSET_NS: u64 = 1_700_000_000_000_000_000;
/// Counts in a unit of the axes.
pub const COUNTS_PER_UNIT: f64 = 1000.0;
/// Time a datagram is under way.
const LATENCY_NS: u64 = 100_000;

pub fn seconds(ns: u64) -> f64 {
    crate::controller::number::seconds(DurationNs(i64::try_from(ns).unwrap()))
}

/// Which datagrams get lost, by their number from 0.
pub type Loss = fn(u64) -> bool;

pub type Script = dyn FnMut(MonotonicTime, u64, &mut Peer, &mut Controller);

pub struct Rig {
    pub controller: Controller,
    pub peer: Peer,
    pub now: u64,
    pub events: Vec<Event>,
    pub lose_commands: Loss,
    pub lose_actuals: Loss,
    /// Called before each update with the instant and the number of C-to-D datagrams so far.
    pub script: Box<Script>,
    /// Which answer of the device gets a byte changed or is cut there: number, offset, value, cut.
    pub spoil: Option<(u64, usize, u8, bool)>,
    /// Another stream is refused, so often so far.
    pub refuse_streams: bool,
    pub streams_refused: u64,
    answers: u64,
    commands: u64,
    actuals: u64,
}

/// A configuration for these axes, synchronous, 2 ms.
pub fn config(axes: usize) -> ControllerConfig {
    ControllerConfig::new(Some([1, 2, 3, 4, 5, 6, 7, 8]), vec![AxisSetup::position(COUNTS_PER_UNIT); axes])
}

impl Rig {
    pub fn new(config: ControllerConfig, peer: Peer, program: Vec<Step>) -> Self {
        Self {
            controller: Controller::new(config, program).unwrap(),
            peer,
            now: 1_000_000,
            events: Vec::new(),
            lose_commands: |_| false,
            lose_actuals: |_| false,
            script: Box::new(|_, _, _, _| {}),
            spoil: None,
            refuse_streams: false,
            streams_refused: 0,
            answers: 0,
            commands: 0,
            actuals: 0,
        }
    }

    fn spoiled(&mut self, mut answer: Vec<u8>) -> Vec<u8> {
        let number = self.answers;
        self.answers += 1;
        if let Some((which, at, to, cut)) = self.spoil
            && which == number
            && at < answer.len()
        {
            answer[at] = to;
            answer.truncate(if cut { at } else { answer.len() });
        }
        answer
    }

    fn drain(&mut self) {
        let mut out = vec![0; DATAGRAM_MAX];
        let now = MonotonicTime(self.now);
        while let Some(length) = self.controller.poll_stream_transmit(&mut out) {
            let answer = self.peer.handle_stream(&out[..length]);
            let answer = self.spoiled(answer);
            self.controller.handle_stream(now, &answer);
        }
        while let Some(length) = self.controller.poll_datagram_transmit(&mut out) {
            let number = self.commands;
            self.commands += 1;
            if (self.lose_commands)(number) {
                continue;
            }
            let system = self.now + LATENCY_NS + OFFSET_NS;
            let Some(answer) = self.peer.handle_datagram(system, &out[..length]) else { continue };
            let answer = self.spoiled(answer);
            let number = self.actuals;
            self.actuals += 1;
            if !(self.lose_actuals)(number) {
                let arrival = self.now + 2 * LATENCY_NS;
                let system = SystemTime(arrival + OFFSET_NS);
                self.controller.handle_datagram(MonotonicTime(arrival), system, &answer);
            }
        }
        while let Some(event) = self.controller.poll_event() {
            self.events.push(event);
        }
        if self.controller.poll_stream_action() == Some(StreamAction::Reopen) {
            if self.refuse_streams {
                self.streams_refused += 1;
                self.controller.tcp_closed(now);
            } else {
                self.controller.tcp_connected(now);
            }
            self.drain();
        }
    }

    /// Opens the stream.
    pub fn connect(&mut self) {
        self.controller.tcp_connected(MonotonicTime(self.now));
        self.drain();
    }

    /// Goes on to `now` and does what is due then.
    pub fn step(&mut self, now: u64) {
        self.now = self.now.max(now);
        let instant = MonotonicTime(self.now);
        (self.script)(instant, self.commands, &mut self.peer, &mut self.controller);
        self.controller.handle_time(instant, SystemTime(self.now + OFFSET_NS));
        self.drain();
    }

    /// Runs until everything is closed, at most for `limit` seconds of virtual time.
    pub fn run(&mut self, limit: u64) -> Report {
        let end = self.now + limit * 1_000_000_000;
        self.connect();
        while !self.controller.is_closed() {
            let Some(wake) = self.controller.wake_at() else { break };
            assert!(wake.0 < end, "not closed within {limit} s: {}", self.log());
            self.step(wake.0);
        }
        self.controller.report()
    }

    /// The events as text, one a line.
    pub fn log(&self) -> String {
        self.events.iter().map(|event| format!("{event}\n")).collect()
    }
}
