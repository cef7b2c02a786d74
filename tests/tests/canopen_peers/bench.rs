//! Our master on a CAN socket and the application that leads one drive by it: a set of values in each SYNC period.
//!
//! RPDO 1 is controlword and target position, RPDO 2 target velocity, target torque and mode; TPDO 1 and 2 are what belongs to them.
//! Time is counted in periods: how far a drive moves in them does not depend on how fast the machine is.

use axisbridge::sys::can_socket::{CanSocket, Content, Options};
use axisbridge::sys::clock::monotonic_now;
use profile_cia402::drive::controlword::Command;
use profile_cia402::drive::index;
use profile_cia402::drive::period::InterpolationPeriod;
use profile_cia402::drive::{Controlword, Mode, State, Statusword};
use profile_cia402::master::config::{
    Expected, HeartbeatConfig, MasterConfig, MasterHeartbeat, NodeConfig, PdoConfig, SyncConfig, Write,
};
use profile_cia402::master::event::{Event, Output};
use profile_cia402::master::{Master, Priority};
use profile_cia402::sdo::request::{SdoData, SdoOutcome, SdoRequest};
use profile_cia402::wire::pdo::MappingEntry;
use profile_cia402::wire::{Mux, NodeId};
use profile_generic::time::DurationNs;

use super::*;

/// A slow bus: the drive is a Python program that shares one processor with the master.
pub const PERIOD: DurationNs = DurationNs::from_millis(20);

/// Periods that are waited for something, half a minute.
const PATIENCE: u32 = 1_500;

/// User units of the drive's velocity and acceleration in pp and pv, written while it boots.
pub const PROFILE_VELOCITY: u32 = 100_000;
pub const PROFILE_ACCELERATION: u32 = 400_000;

pub fn node() -> NodeId {
    NodeId::new(NODE).unwrap()
}

/// What the drive gets in the next period.
#[derive(Debug, Clone, Copy, Default)]
pub struct Set {
    pub word: Controlword,
    pub position: i32,
    pub velocity: i32,
    pub torque: i16,
    pub mode: Mode,
}

/// What the drive has told in the last period.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shown {
    /// SYNCs sent so far.
    pub syncs: i32,
    pub word: Statusword,
    pub position: i32,
    pub velocity: i32,
    pub torque: i16,
    pub mode: Mode,
}

impl Shown {
    pub fn state(&self) -> State {
        self.word.state().unwrap_or_else(|| panic!("no state in {self:?}"))
    }
}

pub struct Bench {
    pub drive: Peer,
    pub master: Master,
    socket: CanSocket,
    pub log: Vec<Event>,
    pub set: Set,
    /// `None` when one of the two TPDOs did not come in the last period.
    pub shown: Option<Shown>,
    /// The last that was shown.
    pub last: Option<Shown>,
    periods: u32,
}

fn network() -> MasterConfig {
    let entry = |index, bits| MappingEntry::new(Mux::new(index, 0), bits);
    // The Python drive may be a little late now and then; what counts is told by `Bench::shown`.
    let pdo = |number, mapping| PdoConfig { allowed_losses: 50, ..PdoConfig::cyclic(number, mapping) };
    let write = |index, value: u32| Write {
        object: Mux::new(index, 0),
        data: SdoData::inline(&value.to_le_bytes()).unwrap(),
    };
    let drive = NodeConfig {
        expected: Expected {
            device_type: Some(0x0002_0192),
            vendor: Some(0x7FFF_FFF0),
            product: Some(0x402),
            revision: Some(0x1_0000),
            serial: Some(0x1000 + u32::from(NODE)),
            ..Expected::default()
        },
        writes: vec![
            write(index::PROFILE_VELOCITY, PROFILE_VELOCITY),
            write(index::PROFILE_ACCELERATION, PROFILE_ACCELERATION),
            write(index::PROFILE_DECELERATION, PROFILE_ACCELERATION),
        ],
        heartbeat: Some(HeartbeatConfig { producer_ms: 100, timeout_ms: 1_000 }),
        rpdos: vec![
            pdo(1, vec![entry(index::CONTROLWORD, 16), entry(index::TARGET_POSITION, 32)]),
            pdo(
                2,
                vec![
                    entry(index::TARGET_VELOCITY, 32),
                    entry(index::TARGET_TORQUE, 16),
                    entry(index::MODE, 8),
                ],
            ),
        ],
        tpdos: vec![
            pdo(1, vec![entry(index::STATUSWORD, 16), entry(index::POSITION_ACTUAL, 32)]),
            pdo(
                2,
                vec![
                    entry(index::VELOCITY_ACTUAL, 32),
                    entry(index::TORQUE_ACTUAL, 16),
                    entry(index::MODE_DISPLAY, 8),
                ],
            ),
        ],
        ..NodeConfig::new(node())
    };
    MasterConfig {
        nodes: vec![drive],
        sync: Some(SyncConfig {
            period_ns: u32::try_from(PERIOD.0).unwrap(),
            window_ns: 0,
            counter_overflow: 0,
        }),
        heartbeat: Some(MasterHeartbeat {
            node: NodeId::new(127).unwrap(),
            producer_ms: 100,
            timeout_ms: 1_500,
        }),
        sdo_timeout: DurationNs::from_secs(2),
        boot_up_time: DurationNs::from_secs(2),
        retry_time: DurationNs::from_millis(200),
        boot_time: DurationNs::ZERO,
        ..MasterConfig::default()
    }
}

impl Bench {
    /// A foreign drive in operation, in its state *switch on disabled*.
    pub fn new(python: &Path) -> Self {
        let drive = Self::start_drive(python);
        let socket = CanSocket::open(INTERFACE, &Options::default()).unwrap();
        let mut bench = Self {
            drive,
            master: Master::new(network()).unwrap(),
            socket,
            log: vec![],
            set: Set { mode: Mode::CYCLIC_POSITION, ..Set::default() },
            shown: None,
            last: None,
            periods: 0,
        };
        bench.master.start(monotonic_now());
        bench.until("a drive in operation", |bench| bench.shown.is_some());
        bench
    }

    pub fn start_drive(python: &Path) -> Peer {
        Peer::start(python, "canopen_drive.py", &[INTERFACE, &NODE.to_string()])
    }

    /// What is there, what is due, and a wait for either.
    fn turn(&mut self) {
        while let Some(received) = self.socket.recv().unwrap() {
            let Content::Frame(frame) = received.content else { panic!("{received:?}") };
            // What is refused is counted.
            let _ = self.master.handle_frame(monotonic_now(), &frame);
        }
        let now = monotonic_now();
        if self.master.next_sync().is_some_and(|at| now >= at) {
            self.lead();
        }
        while let Some(Output::Transmit(frame)) = self.master.poll(now) {
            self.socket.send(&frame).unwrap();
        }
        while let Some(event) = self.master.poll_event() {
            if let Event::AwaitingApplication { node, .. } = event {
                let period = InterpolationPeriod::new(PERIOD).unwrap();
                let exponent = u64::from(period.exponent.cast_unsigned());
                for (sub, value) in [(1, u64::from(period.value)), (2, exponent)] {
                    let object = Mux::new(index::INTERPOLATION_PERIOD, sub);
                    let request = SdoRequest::download_number(object, value, 1);
                    self.master.sdo_submit(node, request, Priority::Normal).unwrap();
                }
                self.master.node_ready(node).unwrap();
            }
            self.log.push(event);
        }
        let due = [self.master.wake_at(), self.master.next_sync()].into_iter().flatten().min();
        let wait = due.map_or(0, |at| at.since(monotonic_now()).0).clamp(0, PERIOD.0);
        let _ = self.socket.wait(Duration::from_nanos(wait.unsigned_abs())).unwrap();
    }

    /// Takes what the drive has told, and hands over what it gets next.
    fn lead(&mut self) {
        self.periods += 1;
        let both = [1, 2].map(|number| self.master.consumer(node(), number).unwrap());
        self.shown = both.iter().all(|consumer| consumer.fresh).then(|| {
            let [p, q] = both.map(|consumer| consumer.data);
            Shown {
                syncs: i32::try_from(self.master.statistics().syncs).unwrap(),
                word: Statusword::from_bits_retain(u16::from_le_bytes([p[0], p[1]])),
                position: i32::from_le_bytes([p[2], p[3], p[4], p[5]]),
                velocity: i32::from_le_bytes([q[0], q[1], q[2], q[3]]),
                torque: i16::from_le_bytes([q[4], q[5]]),
                mode: Mode(i8::from_le_bytes([q[6]])),
            }
        });
        self.last = self.shown.or(self.last);
        let Set { word, position, velocity, torque, mode } = self.set;
        let first = [&word.bits().to_le_bytes()[..], &position.to_le_bytes()].concat();
        let second = [&velocity.to_le_bytes()[..], &torque.to_le_bytes(), &mode.0.to_le_bytes()].concat();
        for (number, values) in [(1, first), (2, second)] {
            self.master.producer(node(), number).unwrap().copy_from_slice(&values);
            self.master.commit(node(), number);
        }
    }

    /// One period; what is set before goes out in it.
    pub fn period(&mut self) {
        let before = self.periods;
        while self.periods == before {
            self.turn();
        }
    }

    /// Periods until `done`.
    #[track_caller]
    pub fn until(&mut self, what: &str, done: impl Fn(&Self) -> bool) {
        let end = self.periods + PATIENCE;
        while !done(self) {
            assert!(
                self.periods < end,
                "no {what}: {:?} by {:?}; {:?}\n{}",
                self.last,
                self.set,
                self.log,
                self.drive.said()
            );
            self.period();
        }
    }

    /// Periods until the drive shows this, and what it shows then.
    #[track_caller]
    pub fn shows(&mut self, what: &str, done: impl Fn(&Shown) -> bool) -> Shown {
        self.until(what, |bench| bench.shown.as_ref().is_some_and(&done));
        self.shown.unwrap()
    }

    /// What the drive shows next.
    #[track_caller]
    pub fn next(&mut self) -> Shown {
        self.period();
        self.shows("TPDOs", |_| true)
    }

    /// Gives a command by the controlword and waits until the drive shows the state.
    #[track_caller]
    pub fn command(&mut self, command: Command, state: State) -> Shown {
        self.set.word = command.word();
        self.shows(state.name(), |shown| shown.state() == state)
    }

    /// *Switch on disabled* to *operation enabled* in a mode, without a way to go: the target follows the drive until then.
    #[track_caller]
    pub fn enable(&mut self, mode: Mode) -> Shown {
        self.set = Set { mode, ..Set::default() };
        let shown = self.command(Command::DisableVoltage, State::SwitchOnDisabled);
        self.set.position = shown.position;
        self.command(Command::Shutdown, State::ReadyToSwitchOn);
        self.command(Command::SwitchOn, State::SwitchedOn);
        self.command(Command::EnableOperation, State::OperationEnabled);
        self.shows("mode", |shown| shown.mode == mode)
    }

    /// One transfer while the periods go on.
    #[track_caller]
    pub fn sdo(&mut self, request: SdoRequest) -> SdoOutcome {
        let ticket = self.master.sdo_submit(node(), request, Priority::Normal).unwrap();
        let place = |bench: &Self| {
            bench
                .log
                .iter()
                .position(|event| matches!(event, Event::Sdo { ticket: own, .. } if *own == ticket))
        };
        self.until("answer", |bench| place(bench).is_some());
        let place = place(self).unwrap();
        let Event::Sdo { outcome, .. } = self.log.remove(place) else { unreachable!() };
        outcome
    }

    #[track_caller]
    pub fn write(&mut self, object: u16, sub: u8, value: u64, len: usize) {
        let outcome = self.sdo(SdoRequest::download_number(Mux::new(object, sub), value, len));
        assert_eq!(outcome.result, Ok(()), "{}", outcome.object);
    }

    #[track_caller]
    pub fn read(&mut self, object: u16, sub: u8) -> u64 {
        let outcome = self.sdo(SdoRequest::upload(Mux::new(object, sub)));
        assert_eq!(outcome.result, Ok(()), "{}", outcome.object);
        outcome.data.unsigned().unwrap()
    }

    /// Error codes of the EMCYs told so far, with their registers.
    pub fn emergencies(&self) -> Vec<(u16, u8)> {
        let told = self.log.iter().filter_map(|event| match event {
            Event::Emcy { emcy, .. } => Some((emcy.code.0, emcy.register.bits())),
            _ => None,
        });
        told.collect()
    }
}
