//! The master's part of a cycle in CP4: building MDTs and ATs, and taking the frames that come back.
//!
//! Each slave has one connection of 14 bytes each way. The slaves' own time is left out. Every number contains one
//! pair of clock readings.
//!
//! Instructions, with `valgrind --tool=callgrind --toggle-collect='cycle::counted_*' PROGRAM --bench --profile-time 1
//! mdt_emit/64`, divided by the calls that it tells.

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use profile_generic::servo::ServoParameters;
use profile_generic::time::MonotonicTime;
use profile_sercos::master::Master;
use profile_sercos::master::config::{ConnectionConfig, Connections, MasterConfig, SlaveConfig};
use profile_sercos::master::connection::ConsumerState;
use profile_sercos::master::event::{Event, Output, Port, SlaveId};
use profile_sercos::master::phase::State;
use profile_sercos::slave::drive::Drive;
use profile_sercos::slave::{Config, Network, Slave};
use profile_sercos::wire::header::{FRAME_LEN_MAX, Phase};
use profile_sercos::wire::idn::Idn;

/// Control word, position, velocity and torque; status word and the same three back.
const COMMANDS: [u16; 4] = [134, 47, 36, 80];
const FEEDBACK: [u16; 4] = [135, 51, 40, 84];
/// Four MDTs and four ATs.
const FRAMES: usize = 8;

struct Bus {
    now: MonotonicTime,
    master: Master,
    line: Network<Drive>,
    /// The frames of a cycle are the first so many.
    frames: [([u8; FRAME_LEN_MAX], usize); FRAMES],
    used: usize,
    slaves: u16,
    counted: bool,
}

impl Bus {
    /// So many drives in CP4, with values on every connection.
    fn new(slaves: u16) -> Bus {
        let idns = |numbers: [u16; 4]| numbers.map(Idn::standard);
        let connections: Connections = [
            ConnectionConfig::new(0, false, &idns(COMMANDS)).expect("four values"),
            ConnectionConfig::new(1, true, &idns(FEEDBACK)).expect("four values"),
        ]
        .into_iter()
        .collect();
        let configured = (1..=slaves).map(|address| SlaveConfig {
            address,
            connections: connections.clone(),
            hot_plug: None,
        });
        let config = MasterConfig {
            slaves: configured.collect(),
            slaves_max: slaves,
            stable_cycles: 2,
            ..MasterConfig::new([2, 0, 0, 0, 0, 1], 4_000_000)
        };
        let mut master = Master::new(config).expect("a sound configuration");
        master.set_target_phase(Phase::CP4);
        let slave = |address| {
            let config = Config { address, ..Config::default() };
            Slave::new(&config, Drive::new(ServoParameters::default()).expect("sound parameters"))
        };
        let line = Network::line((1..=slaves).map(slave).collect());
        let mut bus = Bus {
            now: MonotonicTime(1),
            master,
            line,
            frames: [([0; FRAME_LEN_MAX], 0); FRAMES],
            used: 0,
            slaves,
            counted: false,
        };
        while bus.master.state() != State::Cp4 {
            bus.cycle();
        }
        for _ in 0..5 {
            bus.cycle();
        }
        for slave in (0..slaves).map(SlaveId) {
            let consumer = bus.master.consumer(slave, 1).expect("a connection");
            assert_eq!((consumer.state, consumer.fresh), (ConsumerState::Consuming, true));
        }
        bus.counted = true;
        bus
    }

    /// One cycle; the time which the master took to send and to receive.
    fn cycle(&mut self) -> (Duration, Duration) {
        self.now = self.now.max(self.master.wake_at().expect("a running master"));
        if self.master.state() == State::Cp4 {
            for slave in (0..self.slaves).map(SlaveId) {
                self.master.commit(slave, 0);
            }
        }
        let start = Instant::now();
        if self.counted {
            counted_send(self)
        } else {
            self.send()
        }
        let sent = start.elapsed();
        for (bytes, len) in &mut self.frames[..self.used] {
            assert!(self.line.round_trip(self.now, &mut bytes[..*len]), "a closed line");
        }
        let start = Instant::now();
        if self.counted {
            counted_receive(self)
        } else {
            self.receive()
        }
        let received = start.elapsed();
        while let Some(event) = self.master.poll_event() {
            if matches!(event, Event::AwaitingApplication { .. }) {
                self.master.proceed().expect("the master waits");
            }
        }
        (sent, received)
    }

    fn send(&mut self) {
        self.used = 0;
        while let Some(Output::Transmit { frame, .. }) = self.master.poll(self.now) {
            let (bytes, len) = &mut self.frames[self.used];
            bytes[..frame.len()].copy_from_slice(frame);
            *len = frame.len();
            self.used += 1;
        }
    }

    fn receive(&mut self) {
        for (bytes, len) in &self.frames[..self.used] {
            black_box(self.master.handle_frame(self.now, Port::One, &bytes[..*len])).expect("a good frame");
        }
    }
}

/// What a count of instructions is to see: the cycles of the benchmark and not the way up.
#[inline(never)]
fn counted_send(bus: &mut Bus) {
    bus.send();
}

#[inline(never)]
fn counted_receive(bus: &mut Bus) {
    bus.receive();
}

fn cycle(criterion: &mut Criterion) {
    for slaves in [1u16, 16, 64, 254] {
        let mut bus = Bus::new(slaves);
        let mut group = criterion.benchmark_group("sercos_cycle");
        group.throughput(Throughput::Elements(u64::from(slaves)));
        group.bench_function(BenchmarkId::new("mdt_emit", slaves), |bencher| {
            bencher.iter_custom(|count| (0..count).map(|_| bus.cycle().0).sum());
        });
        group.bench_function(BenchmarkId::new("at_parse", slaves), |bencher| {
            bencher.iter_custom(|count| (0..count).map(|_| bus.cycle().1).sum());
        });
    }
}

criterion_group!(benches, cycle);
criterion_main!(benches);
