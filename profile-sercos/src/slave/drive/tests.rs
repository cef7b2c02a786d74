//! The state machine of the drive, whole: each state with each event.

use std::fmt::Write as _;

use profile_generic::servo::ServoParameters;
use profile_generic::time::MonotonicTime;

use super::*;
use crate::slave::phase::State;

/// Bits of S-0-0135 that the states are told by: ready, error, halt, follows.
const STATE_BITS: u16 = 0xE018;

struct Rig {
    drive: Drive,
    store: Store,
    phase: State,
    connected: bool,
}

impl Rig {
    fn new() -> Self {
        let mut drive = Drive::new(ServoParameters::default()).expect("a drive");
        let mut store = Store::new();
        drive.define(&mut store);
        // A brake that takes its time, so that the delays show.
        store.set_number_of(Idn::DRIVE_ON_DELAY_TIME, 200);
        store.set_number_of(Idn::DRIVE_OFF_DELAY_TIME, 300);
        drive.adopt(&store);
        Self { drive, store, phase: State::In(Phase::CP4), connected: true }
    }

    fn control(&mut self, word: u16) {
        self.store.set_number_of(Idn::DRIVE_CONTROL, i64::from(word));
    }

    fn cycle(&mut self) -> u16 {
        let cycle = Cycle {
            now: MonotonicTime(0),
            elapsed: DurationNs::from_millis(1),
            state: self.phase,
            connected: self.connected,
            fresh: self.connected,
        };
        self.drive.cycle(cycle, &mut self.store);
        let word = self.store.number_of(Idn::DRIVE_STATUS);
        u16::try_from(word).expect("a word") & STATE_BITS
    }

    /// What the status word goes through in a time.
    fn watch(&mut self, cycles: usize) -> Vec<u16> {
        let mut seen = Vec::new();
        for _ in 0..cycles {
            let word = self.cycle();
            if seen.last() != Some(&word) {
                seen.push(word);
            }
        }
        seen
    }

    /// The drive follows, standing or at ten turns a second.
    fn follow(&mut self, velocity: bool) {
        self.watch(1_000);
        self.store.set_number_of(Idn::PRIMARY_OPERATION_MODE, i64::from(MODES[1]));
        self.control(0xE000);
        self.watch(300);
        if velocity {
            self.store.set_number_of(Idn::VELOCITY_COMMAND, 6_000_000);
            self.watch(300);
            assert!(self.drive.actual().velocity.0 > 9_000_000_000);
        }
    }
}

/// States by name, and how to get there.
type Start = (&'static str, fn(&mut Rig));

const STARTS: [Start; 10] = [
    ("before CP4", |rig| {
        rig.phase = State::In(Phase::CP3);
        rig.connected = false;
        rig.watch(1_000);
    }),
    ("waiting for main power", |rig| {
        rig.drive.set_main_power(false);
        rig.watch(1_000);
    }),
    ("main power on", |rig| {
        rig.watch(1_000);
    }),
    ("drive-on delay", |rig| {
        rig.watch(1_000);
        rig.control(0xE000);
        rig.watch(15);
    }),
    ("following", |rig| rig.follow(false)),
    ("moving", |rig| rig.follow(true)),
    ("halted", |rig| {
        rig.follow(true);
        rig.control(0xC000);
        rig.watch(300);
    }),
    ("stopping", |rig| {
        rig.follow(true);
        rig.control(0x6000);
        rig.watch(5);
    }),
    ("fault reaction", |rig| {
        rig.follow(true);
        rig.drive.raise_fault(FaultCause::EXCESSIVE_POSITION_ERROR);
        rig.watch(3);
        rig.drive.clear_fault(FaultCause::EXCESSIVE_POSITION_ERROR);
    }),
    ("locked by an error", |rig| {
        rig.follow(false);
        rig.drive.raise_fault(FaultCause::OVER_CURRENT);
        rig.watch(300);
        rig.drive.clear_fault(FaultCause::OVER_CURRENT);
    }),
];

/// Events by name, and what they do.
type What = (&'static str, fn(&mut Rig));

const EVENTS: [What; 15] = [
    ("S-0-0134 = 0000", |rig| rig.control(0x0000)),
    ("S-0-0134 = 4000", |rig| rig.control(0x4000)),
    ("S-0-0134 = 8000", |rig| rig.control(0x8000)),
    ("S-0-0134 = A000", |rig| rig.control(0xA000)),
    ("S-0-0134 = 6000", |rig| rig.control(0x6000)),
    ("S-0-0134 = C000", |rig| rig.control(0xC000)),
    ("S-0-0134 = E000", |rig| rig.control(0xE000)),
    ("0000, then E000", |rig| {
        rig.control(0x0000);
        rig.watch(2);
        rig.control(0xE000);
    }),
    ("main power off", |rig| rig.drive.set_main_power(false)),
    ("main power on", |rig| rig.drive.set_main_power(true)),
    ("no mode", |rig| rig.control(0xE700)),
    ("C1D that coasts", |rig| rig.drive.raise_fault(FaultCause::OVER_CURRENT)),
    ("C1D that brakes", |rig| rig.drive.raise_fault(FaultCause::EXCESSIVE_POSITION_ERROR)),
    ("S-0-0099", |rig| {
        rig.drive.reset(&mut rig.store);
    }),
    ("connection lost", |rig| rig.connected = false),
];

fn name(word: u16) -> String {
    let ready = ["00", "01", "10", "11"][usize::from(word >> 14)];
    let bits = [(0x2000, " C1D"), (0x10, " halt"), (0x08, " follows")];
    let set = bits.iter().filter(|(bit, _)| word & bit != 0).map(|(_, name)| *name);
    std::iter::once(ready).chain(set).collect()
}

#[test]
fn every_state_with_every_event() {
    let mut text = String::new();
    for (start, begin) in STARTS {
        writeln!(text, "{start}").expect("a string");
        for (event, happen) in EVENTS {
            let mut rig = Rig::new();
            begin(&mut rig);
            happen(&mut rig);
            let seen: Vec<_> = rig.watch(1_500).into_iter().map(name).collect();
            writeln!(text, "  {event:<17} {}", seen.join(" -> ")).expect("a string");
        }
    }
    insta::assert_snapshot!(text);
}
