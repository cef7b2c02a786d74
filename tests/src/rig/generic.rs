//! One axis led in the generic model, without CIP Motion: engine, mapping, master and a simulated drive on one clock.
//!
//! What leads it is [`GenericRig::command`], as a north side of another profile would; see `AxisChannel::from_north`.

use axisbridge::config::Config;
use axisbridge::engine::axis::{AxisChannel, Limits};
use axisbridge::engine::build::sercos::master_config;
use axisbridge::engine::bus::sercos::SercosBus;
use axisbridge::engine::bus::sercos::commissioner::Commissioner;
use axisbridge::engine::bus::{AnyBus, Buses};
use axisbridge::engine::notice::Notice;
use axisbridge::engine::port::SouthPort;
use axisbridge::engine::{Engine, Parts};
use axisbridge::latest;
use axisbridge::mapping::{AxisUnits, CaptureMode, CipScaling, SercosAxis};
use axisbridge::simulate::drives::{DriveNetwork, drives};
use axisbridge::status::BoxStatus;
use profile_generic::fault::Reaction;
use profile_generic::image::{AxisCommand, AxisFeedback, CommandSet};
use profile_generic::interpolation::TargetUpdate;
use profile_generic::mode::ModeSelection;
use profile_generic::quantity::Position;
use profile_generic::scaling::UnitKind;
use profile_generic::state::{DriveState, Request};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_sercos::master::config::Connections;
use profile_sercos::master::config::SlaveConfig;
use profile_sercos::slave::drive::Drive;
use profile_sercos::wire::idn::Idn;

use super::ports::SouthQueue;
use super::{BOX, HOST, START, SYSTEM_OFFSET, mapping};

/// SERCOS address of the drive.
const ADDRESS: u16 = 1;

/// Time between two set-points of a controller that leads the axis.
pub const UPDATE_PERIOD: DurationNs = DurationNs::from_millis(4);

/// One axis, its drive, and what leads it.
pub struct GenericRig {
    /// What runs in the cycle.
    pub engine: Engine,
    /// The line with the one drive.
    pub line: DriveNetwork,
    /// What the engine told.
    pub notices: Vec<Notice>,
    /// What the north side wants.
    pub command: AxisCommand,
    /// How fast the north side moves the position set-point, nanounits per second; it leads the axis while there is one.
    pub velocity: Option<i64>,
    /// Whether the drive is still heard and spoken to.
    pub cable: bool,
    next_update: MonotonicTime,
    now: MonotonicTime,
    due: MonotonicTime,
    south: SouthQueue,
    notice_queue: rtrb::Consumer<Notice>,
    _status: latest::Reader<BoxStatus>,
}

impl GenericRig {
    /// A rotary axis with these modes, the first active at start, whose bus is in CP4. `prepare` sets up its needs and its
    /// drive before.
    ///
    /// # Panics
    /// When the bus does not come up.
    pub fn ready(
        modes: impl IntoIterator<Item = ModeSelection>,
        limits: Limits,
        prepare: impl FnOnce(&mut SercosAxis, &mut DriveNetwork),
    ) -> Self {
        let config = Config::parse(BOX, "box.toml").expect("the configuration is sound");
        let sercos = config.sercos.as_ref().expect("the box has a SERCOS bus");
        let mut master = master_config(sercos, HOST);
        master.slaves = [SlaveConfig { address: ADDRESS, connections: Connections::new(), hot_plug: None }]
            .into_iter()
            .collect();
        let mut needs = SercosAxis {
            units: AxisUnits { kind: UnitKind::Rotary, ..AxisUnits::default() },
            modes: modes.into_iter().collect(),
            modulo: false,
            set_scaling: true,
            parameters: Vec::new(),
            captures: CaptureMode::Off,
            silent: false,
        };
        let mut line = drives([(ADDRESS, UnitKind::Rotary)], false);
        prepare(&mut needs, &mut line);
        let mapping = mapping();
        let scaling = CipScaling {
            kind: UnitKind::Rotary,
            nanounits_per_unit: 1_000_000_000,
            counts_per_unit: 1_000_000,
            inverted: false,
            unwind: None,
        };
        let north = mapping.cip_program(&scaling).expect("a million counts are exact");
        let axis = AxisChannel::new(north, limits, Reaction::DecelerateAndDisable, true);
        let (producer, notice_queue) = rtrb::RingBuffer::new(1024);
        // No drive comes later.
        let (_, commissioner) = Commissioner::new(super::mapping(), 0, []);
        let (publisher, status) = latest::latest(BoxStatus::STARTING);
        let bus = SercosBus::new(master, vec![(0, ADDRESS, needs)], commissioner)
            .expect("the master's configuration is sound");
        let engine = Engine::new(Parts {
            mapping,
            buses: Buses::new(vec![AnyBus::Sercos(Box::new(bus))], vec![0]),
            devices: Vec::new(),
            axes: vec![axis],
            notices: producer,
            publisher,
        });
        let mut rig = Self {
            engine,
            line,
            notices: Vec::new(),
            command: AxisCommand::default(),
            velocity: None,
            cable: true,
            next_update: START,
            now: START,
            due: START,
            south: SouthQueue::default(),
            notice_queue,
            _status: status,
        };
        rig.engine.axes_mut()[0].keep_update_period(UPDATE_PERIOD, TargetUpdate::Interpolate);
        rig.run_until(20_000, "the drive to be ready", |rig| rig.state() == DriveState::Ready);
        rig
    }

    /// Changes what the north side wants.
    pub fn want(&mut self, change: impl FnOnce(&mut AxisCommand)) {
        self.command.request = None;
        self.command.target_time = None;
        change(&mut self.command);
        self.command.sequence += 1;
    }

    /// Leads the axis by position set-points of this velocity, from where it is and as fast as it is.
    pub fn lead(&mut self, velocity: i64, selection: ModeSelection) {
        let target = self.system() + UPDATE_PERIOD * 2;
        let feedback = *self.feedback();
        let way = feedback.velocity.get() * target.since(feedback.at).as_nanos() / 1_000_000_000;
        self.want(|command| {
            command.select(selection);
            command.position = Position(feedback.position.get() + way);
            command.present = CommandSet::POSITION;
            command.target_time = Some(target);
        });
        self.next_update = self.now + UPDATE_PERIOD;
        self.velocity = Some(velocity);
    }

    /// Enables the axis and waits until it follows.
    pub fn enable(&mut self) {
        self.want(|command| command.request = Some(Request::Enable));
        self.run_until(5_000, "operation", |rig| rig.state() == DriveState::Operating);
        self.run_for(50);
    }

    /// The axis.
    pub fn axis(&self) -> &AxisChannel {
        &self.engine.axes()[0]
    }

    /// What is known of it.
    pub fn feedback(&self) -> &AxisFeedback {
        self.axis().feedback()
    }

    /// Its state.
    pub fn state(&self) -> DriveState {
        self.axis().state()
    }

    /// The drive.
    pub fn drive(&self) -> &Drive {
        self.line.slaves()[0].application()
    }

    /// The drive, to act on it from outside.
    pub fn drive_mut(&mut self) -> &mut Drive {
        self.line.slaves_mut()[0].application_mut()
    }

    /// What the drive holds in a parameter.
    pub fn number(&self, idn: Idn) -> i64 {
        self.line.slaves()[0].store().number_of(idn)
    }

    /// Puts a value into a parameter of the drive.
    pub fn set_number(&mut self, idn: Idn, value: i64) {
        self.line.slaves_mut()[0].store_mut().set_number_of(idn, value);
    }

    /// Where the drive really is, nanounits.
    pub fn position(&self) -> i64 {
        self.drive().servo().position().get()
    }

    /// How fast it really is, nanounits per second.
    pub fn speed(&self) -> i64 {
        self.drive().actual().velocity.get()
    }

    /// The instant that has been reached.
    pub fn now(&self) -> MonotonicTime {
        self.now
    }

    fn system(&self) -> SystemTime {
        SystemTime(self.now.0 + SYSTEM_OFFSET)
    }

    /// One cycle.
    pub fn step(&mut self) {
        self.now = self.due.max(self.now);
        let system = self.system();
        if let Some(velocity) = self.velocity.filter(|_| self.now >= self.next_update) {
            self.next_update = self.now + UPDATE_PERIOD;
            self.command.request = None;
            let way = velocity * UPDATE_PERIOD.as_nanos() / 1_000_000_000;
            self.command.position.0 += way;
            self.command.target_time = Some(system + UPDATE_PERIOD * 2);
            self.command.sequence += 1;
        }
        self.engine.axes_mut()[0].from_north(self.now, system, &self.command);
        self.due = self.engine.cycle(self.now, system, &mut [], &mut [SouthPort::Ethernet(&mut self.south)]);
        self.line.handle_time(self.now);
        while let Some(mut frame) = self.south.outbound.pop_front() {
            if self.cable && self.line.round_trip(self.now, frame.as_mut_slice()) {
                self.south.inbound.push_back(frame);
            }
        }
        while let Ok(notice) = self.notice_queue.pop() {
            self.notices.push(notice);
        }
    }

    /// Goes on for so many milliseconds.
    pub fn run_for(&mut self, millis: i64) {
        let end = self.now + DurationNs::from_millis(millis);
        while self.now < end {
            self.step();
        }
    }

    /// Goes on until `done`, and returns how long that took.
    ///
    /// # Panics
    /// When it takes more than `millis` milliseconds.
    pub fn run_until(&mut self, millis: i64, what: &str, mut done: impl FnMut(&Self) -> bool) -> DurationNs {
        let start = self.now;
        while !done(self) {
            let told: Vec<String> = self.notices.iter().map(ToString::to_string).collect();
            assert!(
                self.now.since(start) < DurationNs::from_millis(millis),
                "{what} is not reached within {millis} ms: {:?}\n{}",
                self.feedback(),
                told.join("\n")
            );
            self.step();
        }
        self.now.since(start)
    }
}
