//! The SERCOS master in CP4, alone: the line's own time is left out of what is measured.

use std::hint::black_box;
use std::time::{Duration, Instant};

use axisbridge::simulate::drives::{DriveNetwork, drives};
use criterion::{BenchmarkId, Criterion};
use profile_generic::scaling::UnitKind;
use profile_generic::time::MonotonicTime;
use profile_sercos::master::Master;
use profile_sercos::master::config::{ConnectionConfig, Connections, MasterConfig, SlaveConfig};
use profile_sercos::master::connection::ConsumerState;
use profile_sercos::master::event::{Event, Output, Port, SlaveId};
use profile_sercos::master::phase::State;
use profile_sercos::wire::header::Phase;
use profile_sercos::wire::idn::Idn;

/// Cycle time in nanoseconds.
const CYCLE_NS: u32 = 2_000_000;
/// Frames of one cycle: four MDTs and four ATs.
const FRAMES: usize = 8;
const FRAME_MAX: usize = 1_514;
/// Cycles that the way up to CP4 may take.
const CYCLES_UP: u32 = 200_000;
/// Values to the drive: control word, position, velocity and torque command.
const COMMANDS: [u16; 4] = [134, 47, 36, 80];
/// Values from the drive: status word, position, velocity and torque feedback.
const FEEDBACK: [u16; 4] = [135, 51, 40, 84];
/// Bytes of the values to the drive.
const COMMAND_LEN: usize = 12;

struct Frame {
    bytes: [u8; FRAME_MAX],
    len: usize,
}

struct Bus {
    now: MonotonicTime,
    master: Master,
    line: DriveNetwork,
    frames: Vec<Frame>,
    slaves: u16,
}

impl Bus {
    /// A master and so many drives, in CP4.
    fn in_cp4(slaves: u16) -> Self {
        let idns = |numbers: [u16; 4]| numbers.map(Idn::standard);
        let connections: Connections = [
            ConnectionConfig::new(0, false, &idns(COMMANDS)).expect("four values"),
            ConnectionConfig::new(1, true, &idns(FEEDBACK)).expect("four values"),
        ]
        .into_iter()
        .collect();
        let configs = (1..=slaves).map(|address| SlaveConfig {
            address,
            connections: connections.clone(),
            hot_plug: None,
        });
        let config = MasterConfig {
            slaves: configs.collect(),
            slaves_max: slaves,
            ..MasterConfig::new([0x02, 0, 0, 0, 0, 1], CYCLE_NS)
        };
        let mut master = Master::new(config).expect("a sound configuration");
        master.set_target_phase(Phase::CP4);
        let line = drives((1..=slaves).map(|address| (address, UnitKind::Rotary)), false);
        let mut bus =
            Self { now: MonotonicTime(1), master, line, frames: Vec::with_capacity(FRAMES), slaves };
        for _ in 0..CYCLES_UP {
            if bus.master.state() == State::Cp4 {
                break;
            }
            bus.cycle();
        }
        assert_eq!(bus.master.state(), State::Cp4);
        for _ in 0..10 {
            bus.cycle();
        }
        for index in 0..slaves {
            let consumer = bus.master.consumer(SlaveId(index), 1).expect("a connection");
            assert_eq!((consumer.state, consumer.fresh), (ConsumerState::Consuming, true));
        }
        bus
    }

    /// One cycle; gives the time for filling the producers and taking the telegrams, and the time for the telegrams
    /// that came back.
    fn cycle(&mut self) -> (Duration, Duration) {
        self.now = self.master.wake_at().map_or(self.now, |at| at.max(self.now));
        self.line.handle_time(self.now);
        self.frames.clear();

        let start = Instant::now();
        for index in 0..self.slaves {
            if let Some(values) = self.master.producer(SlaveId(index), 0) {
                values.copy_from_slice(black_box(&[0; COMMAND_LEN]));
                self.master.commit(SlaveId(index), 0);
            }
        }
        while let Some(Output::Transmit { frame, .. }) = self.master.poll(self.now) {
            let mut bytes = [0; FRAME_MAX];
            bytes[..frame.len()].copy_from_slice(frame);
            self.frames.push(Frame { bytes, len: frame.len() });
        }
        let emitting = start.elapsed();

        for frame in &mut self.frames {
            let back = self.line.round_trip(self.now, &mut frame.bytes[..frame.len]);
            assert!(back, "the line is whole");
        }

        let start = Instant::now();
        for frame in &self.frames {
            self.master.handle_frame(self.now, Port::One, &frame.bytes[..frame.len]).expect("our own frame");
        }
        for index in 0..self.slaves {
            black_box(self.master.consumer(SlaveId(index), 1));
        }
        let parsing = start.elapsed();

        while let Some(event) = self.master.poll_event() {
            if matches!(event, Event::AwaitingApplication { .. }) {
                self.master.proceed().expect("it waits");
            }
        }
        (emitting, parsing)
    }

    /// So many cycles; gives the sum of what `part` picks.
    fn cycles(&mut self, count: u64, part: fn((Duration, Duration)) -> Duration) -> Duration {
        (0..count).map(|_| part(self.cycle())).sum()
    }
}

/// Benches of this module.
pub fn bench(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("sercos_master");
    group.sample_size(20);
    group.bench_function("reading_the_clock_twice", |bencher| {
        bencher.iter(|| black_box(Instant::now()).elapsed());
    });
    for slaves in [1, 16, 64] {
        let mut bus = Bus::in_cp4(slaves);
        group.bench_function(BenchmarkId::new("emit", slaves), |bencher| {
            bencher.iter_custom(|count| bus.cycles(count, |(emitting, _)| emitting));
        });
        group.bench_function(BenchmarkId::new("parse", slaves), |bencher| {
            bencher.iter_custom(|count| bus.cycles(count, |(_, parsing)| parsing));
        });
        assert_eq!(bus.master.state(), State::Cp4);
    }
    group.finish();
}
