//! One axis led in the generic model, without CIP Motion: engine, mapping, master and a simulated drive on one clock.
//!
//! What leads it is [`GenericRig::command`], as a north side of another profile would; see `AxisChannel::from_north`.

use axisbridge::config::Config;
use axisbridge::engine::axis::{AxisChannel, Limits, Reactions, Updates};
use axisbridge::engine::build::can::{Network, network};
use axisbridge::engine::build::sercos::master_config;
use axisbridge::engine::bus::can::CanBus;
use axisbridge::engine::bus::sercos::SercosBus;
use axisbridge::engine::bus::sercos::commissioner::DriveSetup;
use axisbridge::engine::bus::{AnyBus, Buses, can, sercos};
use axisbridge::engine::notice::Notice;
use axisbridge::engine::port::SouthPort;
use axisbridge::engine::{Engine, Parts};
use axisbridge::latest;
use axisbridge::mapping::{AxisUnits, CaptureMode, Cia402Axis, FeedbackUse, SercosAxis};
use axisbridge::simulate::can_bus::InProcessCan;
use axisbridge::simulate::can_drive::DriveNode;
use axisbridge::simulate::drives::{DriveNetwork, drives};
use axisbridge::status::BoxStatus;
use profile_cia402::node::drive::Axis;
use profile_generic::fault::{FaultCause, Reaction};
use profile_generic::image::{AxisCommand, AxisFeedback, CommandSet};
use profile_generic::interpolation::TargetUpdate;
use profile_generic::mode::{ModeSelection, OperatingMode};
use profile_generic::quantity::{Position, Velocity};
use profile_generic::scaling::UnitKind;
use profile_generic::servo::{Servo, ServoActual};
use profile_generic::state::{DriveState, Request};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_sercos::master::config::Connections;
use profile_sercos::master::config::SlaveConfig;
use profile_sercos::slave::drive::Drive;
use profile_sercos::wire::idn::Idn;

use super::ports::SouthQueue;
use super::{BOX, HOST, START, SYSTEM_OFFSET};
use crate::mapping;

/// SERCOS address of the drive.
const ADDRESS: u16 = 1;

/// The configuration of a box with one CANopen drive.
const CAN_BOX: &str = include_str!("generic-can.toml");

/// Time between two set-points of a controller that leads the axis.
pub const UPDATE_PERIOD: DurationNs = DurationNs::from_millis(4);

/// The south side of the one axis: its bus and its drive.
pub trait South {
    /// The port of the bus.
    fn port(&mut self) -> SouthPort<'_>;

    /// What happens on the bus, and beside the cycle, after it. Without a `cable` nothing gets through.
    fn exchange(&mut self, now: MonotonicTime, cable: bool);

    /// The servo of the drive.
    fn servo(&self) -> &Servo;

    /// What it did last.
    fn actual(&self) -> &ServoActual;
}

/// A SERCOS line with the one drive.
pub struct SercosSouth {
    /// The line.
    pub line: DriveNetwork,
    queue: SouthQueue,
}

impl South for SercosSouth {
    fn port(&mut self) -> SouthPort<'_> {
        SouthPort::Ethernet(&mut self.queue)
    }

    fn exchange(&mut self, now: MonotonicTime, cable: bool) {
        self.line.handle_time(now);
        while let Some((mut frame, port)) = self.queue.outbound.pop() {
            if cable && self.line.round_trip(now, frame.as_mut_slice()) {
                self.queue.inbound.push(frame.as_slice(), port);
            }
        }
    }

    fn servo(&self) -> &Servo {
        self.line.slaves()[0].application().servo()
    }

    fn actual(&self) -> &ServoActual {
        self.line.slaves()[0].application().actual()
    }
}

/// A CAN bus with one CANopen device.
pub struct CanSouth {
    /// The bus.
    pub bus: InProcessCan,
    commissioner: can::commissioner::Commissioner,
    /// The axis of the device.
    axis: usize,
    connected: bool,
}

impl South for CanSouth {
    fn port(&mut self) -> SouthPort<'_> {
        SouthPort::Can(&mut self.bus)
    }

    fn exchange(&mut self, now: MonotonicTime, cable: bool) {
        self.commissioner.poll();
        if std::mem::replace(&mut self.connected, cable) != cable {
            self.bus.connect(now, 0, cable);
        }
    }

    fn servo(&self) -> &Servo {
        self.axis().servo()
    }

    fn actual(&self) -> &ServoActual {
        self.axis().actual()
    }
}

impl CanSouth {
    /// The device.
    ///
    /// # Panics
    /// Never: there is one.
    pub fn node(&self) -> &DriveNode {
        self.bus.nodes().next().expect("a device")
    }

    /// The device, to act on it from outside.
    ///
    /// # Panics
    /// Never: there is one.
    pub fn node_mut(&mut self) -> &mut DriveNode {
        self.bus.nodes_mut().next().expect("a device")
    }

    fn axis(&self) -> &Axis {
        &self.node().application().axes()[self.axis]
    }
}

/// One axis, its drive, and what leads it.
pub struct OneAxis<S> {
    /// What runs in the cycle.
    pub engine: Engine,
    /// The bus with the one drive.
    pub south: S,
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
    notice_queue: rtrb::Consumer<Notice>,
    _status: latest::Reader<BoxStatus>,
}

/// One axis on SERCOS.
pub type GenericRig = OneAxis<SercosSouth>;

/// One axis on CANopen.
pub type GenericCan = OneAxis<CanSouth>;

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
        let bus = config.sercos.as_ref().expect("the box has a SERCOS bus");
        let mut master = master_config(bus, HOST);
        master.slaves = [SlaveConfig { address: ADDRESS, connections: Connections::new(), hot_plug: None }]
            .into_iter()
            .collect();
        let mut needs = SercosAxis {
            units: AxisUnits { kind: UnitKind::Rotary, ..AxisUnits::default() },
            modes: modes.into_iter().collect(),
            modulo: false,
            any_mode: false,
            bare: false,
            set_scaling: true,
            parameters: Vec::new(),
            captures: CaptureMode::Off,
            silent: false,
            feedback: FeedbackUse::Motor,
        };
        let mut line = drives([(ADDRESS, UnitKind::Rotary)], false);
        prepare(&mut needs, &mut line);
        // No drive comes later.
        let (_, commissioner) = sercos::commissioner::commissioner(mapping::shipped(), 0, []);
        let drive = DriveSetup { axis: 0, address: ADDRESS, needs, startup: Vec::new() };
        let bus =
            SercosBus::new(master, vec![drive], commissioner).expect("the master's configuration is sound");
        let south = SercosSouth { line, queue: SouthQueue::default() };
        Self::on(AnyBus::Sercos(Box::new(bus)), south, limits)
    }

    /// The drive.
    pub fn drive(&self) -> &Drive {
        self.south.line.slaves()[0].application()
    }

    /// The drive, to act on it from outside.
    pub fn drive_mut(&mut self) -> &mut Drive {
        self.south.line.slaves_mut()[0].application_mut()
    }

    /// What the drive holds in a parameter.
    pub fn number(&self, idn: Idn) -> i64 {
        self.south.line.slaves()[0].store().number_of(idn)
    }

    /// Puts a value into a parameter of the drive.
    pub fn set_number(&mut self, idn: Idn, value: i64) {
        self.south.line.slaves_mut()[0].store_mut().set_number_of(idn, value);
    }
}

impl GenericCan {
    /// A rotary axis with these modes, the first active at start, on axis `axis` of a device in operation. `prepare` sets up its
    /// needs and its device before.
    ///
    /// # Panics
    /// When the bus does not come up.
    pub fn ready(
        axis: usize,
        modes: impl IntoIterator<Item = ModeSelection>,
        limits: Limits,
        prepare: impl FnOnce(&mut Cia402Axis, &mut DriveNode),
    ) -> Self {
        let text = CAN_BOX.replace("axis = 0", &format!("axis = {axis}"));
        let config = Config::parse(&text, "generic-can.toml").expect("the configuration is sound");
        let Network { master, mut devices, .. } =
            network(&config, 0, &mapping::shipped()).expect("a network");
        let mut bus = InProcessCan::of(&config.can[0], None);
        let needs = &mut devices[0].1[0].needs;
        needs.modes = modes.into_iter().collect();
        prepare(needs, bus.nodes_mut().next().expect("a device"));
        let (commissioner, end) =
            can::commissioner::commissioner(mapping::shipped(), master.clone(), devices.iter().cloned());
        let master = CanBus::new(0, master, &devices, &[], end).expect("the master's configuration is sound");
        let south = CanSouth { bus, commissioner, axis, connected: true };
        Self::on(AnyBus::Can(Box::new(master)), south, limits)
    }

    /// The axis of the device.
    pub fn drive(&self) -> &Axis {
        self.south.axis()
    }

    /// The axis of the device, to act on it from outside.
    pub fn drive_mut(&mut self) -> &mut Axis {
        let axis = self.south.axis;
        &mut self.south.node_mut().application_mut().axes_mut()[axis]
    }

    /// What the axis of the device holds in an object, which is named as on the first axis.
    ///
    /// # Panics
    /// Never: there are eight axes.
    pub fn number(&self, index: u16, sub: u8) -> i64 {
        self.south.node().dictionary().number(self.index(index), sub)
    }

    /// Puts a value into such an object, as the SDO server would.
    pub fn set_number(&mut self, index: u16, sub: u8, value: i64) {
        let index = self.index(index);
        self.south.node_mut().dictionary_mut().set(index, sub, value);
    }

    fn index(&self, index: u16) -> u16 {
        index + 0x800 * u16::try_from(self.south.axis).expect("eight axes")
    }
}

impl<S: South> OneAxis<S> {
    /// The axis on its bus, once its drive is ready.
    fn on(bus: AnyBus, south: S, limits: Limits) -> Self {
        let mapping = mapping::shipped();
        let mut axis = AxisChannel::new(limits, Reaction::DecelerateAndDisable, true);
        // A million counts to a revolution.
        axis.set_count(1_000);
        let (producer, notice_queue) = rtrb::RingBuffer::new(1024);
        let (publisher, status) = latest::latest(BoxStatus::STARTING);
        let engine = Engine::new(Parts {
            mapping,
            buses: Buses::new(vec![bus], vec![0]),
            devices: Vec::new(),
            assemblies: Vec::new(),
            axes: vec![axis],
            notices: producer,
            publisher,
            lead: DurationNs::from_micros(100),
        });
        let mut rig = Self {
            engine,
            south,
            notices: Vec::new(),
            command: AxisCommand::default(),
            velocity: None,
            cable: true,
            next_update: START,
            now: START,
            due: START,
            notice_queue,
            _status: status,
        };
        let system = rig.system();
        let axis = &mut rig.engine.axes_mut()[0];
        axis.keep_updates(Updates { period: UPDATE_PERIOD, may_miss: 4, first: TargetUpdate::Interpolate });
        // A homing that fails is no reason to stop an axis that stands: it may be led again.
        let mut reactions = Reactions::default();
        reactions.set(FaultCause::HOMING, Reaction::Alarm);
        axis.set_reactions(START, system, &reactions);
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
        let target = self.now + UPDATE_PERIOD * 2;
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

    /// Leads the axis by velocity set-points, this one from now on.
    pub fn drive_at(&mut self, velocity: i64) {
        self.want(|command| {
            command.select(OperatingMode::Velocity.into());
            command.velocity = Velocity(velocity);
            command.present = CommandSet::VELOCITY;
        });
        self.velocity = Some(0);
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

    /// Where the drive really is, nanounits.
    pub fn position(&self) -> i64 {
        self.south.servo().position().get()
    }

    /// How fast it really is, nanounits per second.
    pub fn speed(&self) -> i64 {
        self.south.actual().velocity.get()
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
        // A request goes before the next set-point.
        let free = self.command.request.is_none();
        if let Some(velocity) = self.velocity.filter(|_| free && self.now >= self.next_update) {
            self.next_update = self.now + UPDATE_PERIOD;
            let way = velocity * UPDATE_PERIOD.as_nanos() / 1_000_000_000;
            self.command.position.0 += way;
            self.command.target_time = Some(self.now + UPDATE_PERIOD * 2);
            self.command.sequence += 1;
        }
        self.engine.axes_mut()[0].from_north(self.now, system, &self.command);
        self.command.request = None;
        self.due = self.engine.cycle(self.now, &mut [], &mut [self.south.port()]);
        self.south.exchange(self.now, self.cable);
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
