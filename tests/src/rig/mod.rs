//! The whole chain in virtual time: controller, network, box and drives on one clock that only the rig moves.
//!
//! ```text
//! Controller --stream--> Adapter --queue--> Engine --frames--> Network<Drive>
//!            --datagrams (Knobs)-->         (NorthQueue, SouthQueue)
//! ```
//!
//! Every telegram stands before the checker of `profile_sercos`; a test that has a rule broken on purpose says which one
//! with [`Tried::breaking`](profile_sercos::checker::checked_bus::Tried::breaking).
//!
//! Seconds of the machine pass in milliseconds. The same settings and the same seed give the same run; a
//! test that fails
//! prints the seed.

pub mod clocks;
pub mod explicit;
pub mod foreign;
pub mod generic;
pub mod many;
pub mod motion;
pub mod motion_checker;
pub mod network;
pub mod plc;
pub mod ports;
mod updates;
pub mod wake_ups;

use std::cell::Cell;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::rc::Rc;

use arrayvec::ArrayVec;
use axisbridge::config::Config;
use axisbridge::engine::build::{Built, Commissioners, Host, build};
use axisbridge::engine::bus::sercos::SercosBus;
use axisbridge::engine::notice::Notice;
use axisbridge::engine::phase_lock::LockState;
use axisbridge::engine::port::SouthPort;
use axisbridge::engine::{BUSES_MAX, Engine};
use axisbridge::latest::Reader;
use axisbridge::mapping::Mapping;
use axisbridge::north::AdapterEnd;
use axisbridge::simulate::can_bus::InProcessCan;
use axisbridge::simulate::devicenet_drive::DevicenetNode;
use axisbridge::simulate::drives::{DriveNetwork, drives};
use axisbridge::simulate::setup;
use axisbridge::status::{BoxState, BoxStatus};
use profile_cia402::wire::cob_id;
use profile_cip::controller::sets::DataSets;
use profile_cip::controller::{
    Controller, ControllerConfig, DATAGRAM_MAX, Event, Report, Step, StreamAction,
};
use profile_cip::device::adapter::{Adapter, SessionSlot};
use profile_cip::device::axis_state::AxisState;
use profile_cip::device::motion_device::SyncState;
use profile_cip::devicenet::wire::{Identifier, MacId};
use profile_cip::wire::encapsulation::IO_PORT;
use profile_cip::wire::motion::Format;
use profile_generic::scaling::UnitKind;
use profile_generic::state::DriveState;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_generic::time_base::TimeSample;
use profile_sercos::checker::bus::Stations;
use profile_sercos::checker::checked_bus::{CheckedBus, Tried};
use profile_sercos::port::Port;
use profile_sercos::slave::drive::Drive;
use profile_sercos::wire::drive_words::DriveControl;
use profile_sercos::wire::idn::Idn;

use self::clocks::Clock;
use self::foreign::{Foreign, ForeignLine};
use self::motion_checker::MotionChecker;
use self::network::{Knobs, Pipe};
use self::ports::{Bytes, CanWire, NorthQueue, SouthQueue};
use self::wake_ups::WakeUps;
use crate::mapping;

/// The configuration of the box: a turntable (axis 1, revolutions) and a slide (axis 2, millimetres).
pub const BOX: &str = include_str!("box.toml");

/// The configuration of a box with the turntable alone, over the fixed connection format.
pub const FIXED_BOX: &str = include_str!("fixed.toml");

/// Update period of the controller in microseconds: two cycles of the bus.
pub const UPDATE_PERIOD_US: u32 = 4_000;

/// Where the controller is; its datagrams come from [`Rig::command_port`] there.
pub const CONTROLLER: Ipv4Addr = Ipv4Addr::new(10, 0, 0, 1);

/// TCP port of the controller.
const CONTROLLER_PORT: u16 = 50_000;

/// When the box is switched on.
pub const START: MonotonicTime = MonotonicTime(1_000_000_000);

/// System time less monotonic time.
pub const SYSTEM_OFFSET: u64 = 1_700_000_000_000_000_000;

/// Address of the box's Ethernet port.
pub const HOST: Host = Host { mac: [0x02, 0x41, 0x42, 0, 0, 1], incarnation: 0x7A00 };

/// Longest step of the virtual clock, so that streams are looked at when nothing else is due.
const STEP_MAX: DurationNs = DurationNs::from_millis(1);

/// A multiple of most cycles and update periods.
pub const GRID: DurationNs = DurationNs::from_millis(8);

/// The updates of a controller that connects so long behind an instant of the grid come on it: it has some steps to go before.
const FIRST_TO_GRID: DurationNs = DurationNs::from_millis(3);

/// How a rig is set up.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Configuration of the box.
    pub configuration: String,
    /// Address and kind of each drive on the line, nearest to the master first.
    pub drives: Vec<(u16, UnitKind)>,
    /// Texts of overlays over the shipped tables.
    pub overlays: Vec<&'static str>,
    /// The network between controller and box.
    pub knobs: Knobs,
    /// What the network's dice start from.
    pub seed: u64,
}

impl Settings {
    /// A box with this configuration and no SERCOS drives.
    #[must_use]
    pub fn without_line(configuration: impl Into<String>) -> Self {
        Self { configuration: configuration.into(), drives: Vec::new(), ..Self::default() }
    }

    /// [`FIXED_BOX`] and its one drive.
    #[must_use]
    pub fn fixed() -> Self {
        Self { configuration: FIXED_BOX.to_owned(), drives: vec![(1, UnitKind::Rotary)], ..Self::default() }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            configuration: BOX.to_owned(),
            drives: vec![(1, UnitKind::Rotary), (2, UnitKind::Linear)],
            overlays: Vec::new(),
            knobs: Knobs::GOOD,
            seed: 1,
        }
    }
}

/// What was seen of a drive from outside.
#[derive(Debug, Clone, Default)]
pub struct Watched {
    /// Drive-on bit (S-0-0134 bit 15) as the drive had it last.
    pub on: bool,
    /// Changes of the drive-on bit with their time.
    pub changes: Vec<(MonotonicTime, bool)>,
}

/// Changes a frame or datagram on its way; `false` loses it.
pub type Tamper = Box<dyn FnMut(&mut Bytes) -> bool>;

/// Everything on one clock.
pub struct Rig {
    /// The controller; `None` before the first one and while it is gone.
    pub controller: Option<Controller>,
    /// Its events.
    pub events: Vec<Event>,
    /// The explicit side of the box.
    pub adapter: Adapter,
    /// What runs in the cycle of the box.
    pub engine: Engine,
    /// What the engine told.
    pub notices: Vec<Notice>,
    /// The drives.
    pub line: DriveNetwork,
    /// The CAN buses with their drives.
    pub can: Vec<CanWire>,
    /// The DeviceNet networks with their drives.
    pub devicenet: Vec<CanWire<DevicenetNode>>,
    /// Drives of somebody else in place of those of the first CAN bus, or of the first DeviceNet where there is none.
    pub foreign: Option<CanWire<Foreign>>,
    /// SERCOS slaves of somebody else in place of the line.
    pub foreign_line: Option<ForeignLine>,
    /// The checker over the line.
    pub checked: CheckedBus,
    /// The checker of every set-point.
    pub motion_checker: MotionChecker,
    /// What was seen of each drive.
    pub watched: Vec<Watched>,
    /// The network between controller and box.
    pub knobs: Knobs,
    /// What happens to datagrams from the controller.
    pub tamper_command: Option<Tamper>,
    /// What happens to datagrams from the box.
    pub tamper_actual: Option<Tamper>,
    /// What happens to frames on their way back from the line.
    pub tamper_frame: Option<Tamper>,
    /// Whether there is a cable between the box and the line.
    pub cable: bool,
    /// The clock of the controller.
    pub controller_clock: Clock,
    /// Whether the controller reports steps of its system time in its Controller Time Offset.
    pub reports_steps: bool,
    /// The clock of the gateway.
    pub gateway_clock: Clock,
    /// Whether the gateway's source of system time knows its rate, as a follower of PTP does.
    pub knows_rate: bool,
    /// How late the engine runs.
    pub wake_ups: WakeUps,
    /// Whether the stream of the controller still carries bytes.
    pub stream_works: bool,
    /// UDP port that the controller's datagrams come from.
    pub command_port: u16,
    /// Whether the box accepts another stream of the controller.
    pub accepts_streams: bool,
    mapping: Mapping,
    overlays: Vec<&'static str>,
    config: Config,
    seed: u64,
    now: MonotonicTime,
    clock: Rc<Cell<MonotonicTime>>,
    engine_due: MonotonicTime,
    /// How late the wake-up for `engine_due` is.
    lateness: DurationNs,
    /// How late its last call was.
    late: DurationNs,
    commissioners: Commissioners,
    link: AdapterEnd,
    notice_queue: rtrb::Consumer<Notice>,
    status: Reader<BoxStatus>,
    slot: Option<SessionSlot>,
    north: NorthQueue,
    south: SouthQueue,
    commands: Pipe<Bytes>,
    actuals: Pipe<Bytes>,
}

impl Tried for Rig {
    fn checked(&mut self) -> &mut CheckedBus {
        &mut self.checked
    }
}

impl Rig {
    /// A box that has just been switched on, with nobody connected.
    ///
    /// # Panics
    /// When the configuration makes no box.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        let config = Config::parse(&settings.configuration, "box.toml").expect("the configuration is sound");
        let (engine, adapter, link, notice_queue, status, commissioners) =
            assemble(&config, &settings.overlays);
        let line = drives(settings.drives.iter().copied(), false);
        let can = config.can.iter().map(|bus| CanWire::new(InProcessCan::of(bus, None))).collect();
        let devicenet =
            config.devicenet.iter().map(|network| CanWire::new(InProcessCan::of_devicenet(network, None)));
        Self {
            controller: None,
            events: Vec::new(),
            adapter,
            engine,
            notices: Vec::new(),
            watched: vec![Watched::default(); line.slaves().len()],
            line,
            can,
            devicenet: devicenet.collect(),
            foreign: None,
            foreign_line: None,
            checked: CheckedBus::new(START),
            motion_checker: MotionChecker::new(&config, settings.seed),
            knobs: settings.knobs,
            tamper_command: None,
            tamper_actual: None,
            tamper_frame: None,
            cable: true,
            controller_clock: Clock::default(),
            reports_steps: true,
            gateway_clock: Clock::default(),
            knows_rate: false,
            wake_ups: WakeUps::new(settings.seed),
            stream_works: true,
            command_port: IO_PORT,
            accepts_streams: true,
            mapping: mapping::with_overlays(&settings.overlays),
            overlays: settings.overlays,
            config,
            seed: settings.seed,
            now: START,
            clock: Rc::new(Cell::new(START)),
            engine_due: START,
            lateness: DurationNs::ZERO,
            late: DurationNs::ZERO,
            commissioners,
            link,
            notice_queue,
            status,
            slot: None,
            north: NorthQueue::default(),
            south: SouthQueue::default(),
            commands: Pipe::new(settings.seed),
            actuals: Pipe::new(!settings.seed),
        }
    }

    /// A box whose first CAN bus, or DeviceNet, has these drives and no others.
    ///
    /// # Panics
    /// When the configuration makes no box, or has no such bus.
    #[must_use]
    pub fn among(settings: Settings, stations: Vec<foreign::Shared>) -> Self {
        let mut rig = Self::new(settings);
        let duplicates = (0..).map_while(MacId::new).map(|mac| Identifier::DuplicateMacCheck(mac).can());
        let (rate, shared) = match (rig.config.can.first(), rig.config.devicenet.first()) {
            (Some(bus), _) => (bus.bit_rate, Vec::new()),
            (None, Some(network)) => (network.bit_rate(), duplicates.collect()),
            (None, None) => panic!("no CAN bus"),
        };
        // The motion checker looks at drives that the rig knows the inside of.
        if rig.can.is_empty() {
            rig.devicenet.remove(0);
        } else {
            rig.can.remove(0);
        }
        rig.foreign = Some(foreign::wire(rate, stations, &shared));
        rig
    }

    /// A box whose SERCOS line has these slaves and no others, nearest to the master first.
    ///
    /// # Panics
    /// When the configuration makes no box.
    #[must_use]
    pub fn on_line(settings: Settings, slaves: Vec<foreign::SharedSlave>) -> Self {
        let mut rig = Self::new(Settings { drives: Vec::new(), ..settings });
        rig.foreign_line = Some(ForeignLine::new(slaves));
        rig
    }

    /// A box with its bus in CP4.
    #[must_use]
    pub fn ready(settings: Settings) -> Self {
        let mut rig = Self::new(settings);
        rig.until_ready();
        rig
    }

    /// Lets the buses come up.
    pub fn until_up(&mut self) {
        self.run_until(DurationNs::from_secs(20), "the buses up", |rig| {
            rig.status().state == BoxState::READY
        });
    }

    /// Lets the buses come up, and their cycles come to the grid of system time. What a test begins with does
    /// not depend on how long the start has taken: it ends a fixed time behind a multiple of [`GRID`].
    pub fn until_ready(&mut self) {
        self.until_up();
        // The lock sees a bus in its next cycles.
        self.run_for(GRID * 2);
        self.run_until(DurationNs::from_secs(5), "the grid", |rig| {
            rig.status().phase_lock.state != LockState::Pulling
        });
        let passed = self.now.since(START).as_nanos();
        self.run_for(DurationNs(-passed.rem_euclid(GRID.as_nanos())) + GRID + FIRST_TO_GRID);
    }

    // ---- time -----------------------------------------------------------------------------------

    /// The instant that has been reached.
    #[must_use]
    pub const fn now(&self) -> MonotonicTime {
        self.now
    }

    /// The instant that has been reached, for those that look on from a closure.
    #[must_use]
    pub fn clock(&self) -> Rc<Cell<MonotonicTime>> {
        Rc::clone(&self.clock)
    }

    /// System time of the gateway: the one place where it is made.
    #[must_use]
    pub fn system(&self) -> SystemTime {
        self.gateway_clock.system(self.now)
    }

    /// What the clock of the controller shows: its monotonic time and its system time.
    #[must_use]
    pub fn controller_time(&self) -> (MonotonicTime, SystemTime) {
        (self.controller_clock.monotonic(self.now), self.controller_clock.system(self.now))
    }

    /// When the controller has something to do, in true time.
    fn controller_due(&self) -> Option<MonotonicTime> {
        Some(self.controller_clock.when(self.controller.as_ref()?.wake_at()?))
    }

    /// When the engine runs next: when it is due, later by what the wake-ups have, and not in a pause.
    fn engine_wake(&self) -> MonotonicTime {
        self.wake_ups.after_pause(self.engine_due + self.lateness)
    }

    /// Seconds since the box was switched on.
    #[must_use]
    pub fn elapsed(&self) -> DurationNs {
        self.now.since(START)
    }

    /// Goes on to the next thing that is due.
    pub fn step(&mut self) {
        let engine = self.engine_wake();
        let due = [Some(engine), self.controller_due(), self.actuals.wake_at()];
        let next = due.into_iter().flatten().min().unwrap_or(engine);
        self.now = next.clamp(self.now, self.now + STEP_MAX);
        self.clock.set(self.now);
        self.deliver();
        if self.now >= engine {
            self.cycle();
        } else if self.now > self.engine_due {
            self.go_on_without_engine();
        }
        self.control();
        self.explicit();
    }

    /// Goes on for a time.
    pub fn run_for(&mut self, span: DurationNs) {
        let end = self.now + span;
        while self.now < end {
            self.step();
        }
    }

    /// Goes on until `done`, and says how long that took.
    ///
    /// # Panics
    /// When it takes longer than `limit`.
    pub fn run_until(
        &mut self,
        limit: DurationNs,
        what: &str,
        mut done: impl FnMut(&Self) -> bool,
    ) -> DurationNs {
        let start = self.now;
        while !done(self) {
            assert!(
                self.now.since(start) < limit,
                "{what} is not reached within {limit}\n{}\n{}",
                self.log(),
                self.told()
            );
            self.step();
        }
        self.now.since(start)
    }

    // ---- the controller -------------------------------------------------------------------------

    /// The configuration of a controller for this box.
    #[must_use]
    pub fn controller_config(&self) -> ControllerConfig {
        let counts: Vec<_> = self.config.axes.iter().map(|axis| f64::from(axis.motion_resolution)).collect();
        // A slow bus has a slow box.
        let least = u32::try_from(self.config.devices[0].update_period_min.as_nanos() / 1_000);
        let period = UPDATE_PERIOD_US.max(least.unwrap_or(0));
        let mut config = setup::controller(&self.mapping, &counts, period);
        if self.config.devices[0].connection_format == Format::Fixed {
            config.set_fixed();
            config.axes.iter_mut().for_each(|axis| axis.sets = DataSets::fixed(axis.control_mode));
        }
        config
    }

    /// Connects a controller that carries out `program`; one that was there before is gone.
    pub fn connect(&mut self, program: Vec<Step>) {
        let config = self.controller_config();
        self.connect_with(config, program);
    }

    /// Connects a controller with a configuration of its own.
    ///
    /// # Panics
    /// When the controller refuses its configuration, or the box the stream.
    pub fn connect_with(&mut self, config: ControllerConfig, program: Vec<Step>) {
        self.drop_stream();
        self.commands.clear();
        self.actuals.clear();
        self.stream_works = true;
        let mut controller =
            Controller::new(config, program).expect("the controller's configuration is sound");
        let peer = SocketAddrV4::new(CONTROLLER, CONTROLLER_PORT);
        self.slot = Some(self.adapter.open(self.now, peer).expect("the box has room for a stream"));
        controller.tcp_connected(self.controller_clock.monotonic(self.now));
        self.motion_checker.connected(self.now);
        self.controller = Some(controller);
        self.events.clear();
    }

    /// Runs the controller to its end.
    ///
    /// # Panics
    /// When that takes longer than `limit`.
    pub fn run(&mut self, limit: DurationNs) -> Report {
        self.run_until(limit, "the end of the program", |rig| {
            rig.controller.as_ref().is_none_or(Controller::is_closed)
        });
        self.report()
    }

    /// What the controller reports.
    ///
    /// # Panics
    /// Without a controller.
    #[must_use]
    pub fn report(&self) -> Report {
        self.controller.as_ref().expect("a controller").report()
    }

    /// The controller loses its power: nothing comes from it any more, and nothing arrives there.
    pub fn kill_controller(&mut self) -> Option<Report> {
        self.actuals.clear();
        self.controller.take().map(|controller| controller.report())
    }

    /// The stream breaks; the box sees it closed, the controller hears nothing more on it.
    pub fn drop_stream(&mut self) {
        self.stream_works = false;
        if let Some(slot) = self.slot.take() {
            self.adapter.close(slot);
        }
    }

    /// The box closes the controller's stream, as it does with an idle one.
    pub fn close_stream(&mut self) {
        self.drop_stream();
        let now = self.now;
        if let Some(controller) = self.controller.as_mut() {
            controller.tcp_closed(now);
        }
    }

    /// The controller's events as text, one a line.
    #[must_use]
    pub fn log(&self) -> String {
        self.events.iter().map(|event| format!("{event}\n")).collect()
    }

    // ---- the box --------------------------------------------------------------------------------

    /// The box starts again with another configuration.
    ///
    /// # Panics
    /// When the configuration is not sound.
    pub fn restart_box_with(&mut self, configuration: &str) {
        self.config = Config::parse(configuration, "box.toml").expect("the configuration is sound");
        self.restart_box();
    }

    /// The box loses its power and starts again, as a process does that is restarted. Streams break; the
    /// drives stay
    /// as they are.
    pub fn restart_box(&mut self) {
        self.drop_stream();
        let (engine, adapter, link, notice_queue, status, commissioners) =
            assemble(&self.config, &self.overlays);
        (self.engine, self.adapter, self.link, self.commissioners) = (engine, adapter, link, commissioners);
        (self.notice_queue, self.status) = (notice_queue, status);
        self.north = NorthQueue::default();
        self.south = SouthQueue::default();
        // A box takes longer to start; the last telegrams of the old one are through by then.
        self.set_due(self.now + STEP_MAX);
    }

    /// The engine is due then; how late it is found out now.
    fn set_due(&mut self, due: MonotonicTime) {
        self.engine_due = due;
        self.lateness = self.wake_ups.lateness();
    }

    /// The SERCOS bus of the box.
    ///
    /// # Panics
    /// Without one.
    #[must_use]
    pub fn sercos(&self) -> &SercosBus {
        self.engine.sercos().expect("a SERCOS bus")
    }

    /// The status that the box publishes.
    #[must_use]
    pub fn status(&self) -> BoxStatus {
        self.status.read()
    }

    /// What the box has told, one notice a line, each with its axis.
    #[must_use]
    pub fn told(&self) -> String {
        let line = |notice: &Notice| match notice.axis() {
            Some(axis) => format!("axis {}: {notice}\n", axis + 1),
            None => format!("{notice}\n"),
        };
        self.notices.iter().map(line).collect()
    }

    /// The generic states that an axis (from 0) took, each change once.
    #[must_use]
    pub fn states(&self, axis: u8) -> Vec<DriveState> {
        let change = |notice: &Notice| match notice {
            Notice::State { axis: of, to, .. } if *of == axis => Some(*to),
            _ => None,
        };
        self.notices.iter().filter_map(change).collect()
    }

    /// The CIP axis states that an axis (from 0) took, each change once.
    #[must_use]
    pub fn axis_states(&self, axis: u8) -> Vec<AxisState> {
        let change = |notice: &Notice| match notice {
            Notice::AxisState { axis: of, to, .. } if *of == axis => Some(*to),
            _ => None,
        };
        self.notices.iter().filter_map(change).collect()
    }

    /// Sends a datagram to the box, past the network's knobs.
    ///
    /// # Panics
    /// When there is no room for it.
    pub fn inject_datagram(&mut self, bytes: &[u8], from: SocketAddrV4) {
        assert!(self.north.inbound.push(bytes, (from, self.now)), "no room for another datagram");
    }

    /// Puts a frame on the box's SERCOS port.
    ///
    /// # Panics
    /// When there is no room for it.
    pub fn inject_frame(&mut self, frame: &[u8]) {
        assert!(self.south.inbound.push(frame, Port::One), "no room for another frame");
    }

    /// Datagrams that the network lost, doubled and held back: commands, then actual values.
    #[must_use]
    pub const fn network(&self) -> (network::Counts, network::Counts) {
        (self.commands.counts(), self.actuals.counts())
    }

    /// Runs the engine's next cycle by itself and hands it to `around`, which has to call it: for whoever
    /// wants to
    /// weigh the cycle alone. Before it comes everything that is due until then.
    pub fn cycle_in<T>(&mut self, around: impl FnOnce(&mut dyn FnMut()) -> T) -> T {
        loop {
            let due = [self.controller_due(), self.actuals.wake_at()].into_iter().flatten().min();
            if due.is_none_or(|due| due >= self.engine_wake()) {
                break;
            }
            self.now = due.unwrap_or(self.now).max(self.now);
            self.deliver();
            self.control();
            self.explicit();
        }
        self.now = self.engine_wake().max(self.now);
        self.deliver();
        self.before_cycle();
        let (now, mut due) = (self.now, self.now);
        let Self { engine, north, south, can, devicenet, foreign, config, .. } = self;
        let mut ports = ports_of(config, south, can, devicenet, foreign.as_mut());
        let result = around(&mut || due = engine.cycle(now, &mut [north], &mut ports));
        drop(ports);
        self.set_due(due);
        self.after_cycle();
        self.control();
        self.explicit();
        result
    }

    /// Has the SERCOS III telegrams handed over with their instant, as to a port that holds them until then. The line gets them at
    /// once nevertheless.
    pub fn hold_frames(&mut self) {
        self.south.holds = true;
    }

    /// When the last cycle of the first bus began, as its frames were sent: the MST, SYNC, or the first poll.
    #[must_use]
    pub fn cycle_sent_at(&self) -> Option<MonotonicTime> {
        let can = self.can.first().and_then(|wire| wire.sent_at(cob_id::SYNC));
        if self.config.sercos.is_some() { self.south.sent_at } else { can }
    }

    // ---- the drives -----------------------------------------------------------------------------

    /// A drive, by its place in the line.
    pub fn drive(&self, place: usize) -> &Drive {
        self.line.slaves()[place].application()
    }

    /// A drive, to act on it from outside.
    pub fn drive_mut(&mut self, place: usize) -> &mut Drive {
        self.line.slaves_mut()[place].application_mut()
    }

    /// Where a drive really is, in nanounits.
    #[must_use]
    pub fn position(&self, place: usize) -> i64 {
        self.drive(place).actual().position.get()
    }

    /// How fast a drive really is, in nanounits per second.
    #[must_use]
    pub fn velocity(&self, place: usize) -> i64 {
        self.drive(place).actual().velocity.get()
    }

    /// Whether every drive is without torque.
    #[must_use]
    pub fn torque_free(&self) -> bool {
        use profile_generic::state::Report as R;
        let free =
            |report: R| matches!(report, R::NotReady | R::AwaitingPower | R::Ready | R::Faulted | R::Silent);
        let drives = self.config.sercos.as_ref().map_or(0, |_| self.line.slaves().len());
        let axes =
            self.can.iter().flat_map(|wire| wire.bus.nodes()).flat_map(|node| node.application().axes());
        (0..drives).all(|place| free(self.drive(place).actual().report))
            && axes.into_iter().all(|axis| free(axis.actual().report))
            && self
                .devicenet
                .iter()
                .flat_map(|wire| wire.bus.nodes())
                .all(|drive| free(drive.actual().report))
    }

    // ---- one step -------------------------------------------------------------------------------

    /// What the network brings now.
    fn deliver(&mut self) {
        let from = SocketAddrV4::new(CONTROLLER, self.command_port);
        while let Some(datagram) = self.commands.receive(self.now) {
            assert!(self.north.inbound.push(datagram.as_slice(), (from, self.now)), "no room for an update");
        }
        let (now, system) = self.controller_time();
        while let Some(datagram) = self.actuals.receive(self.now) {
            if let Some(controller) = self.controller.as_mut() {
                controller.handle_datagram(now, system, datagram.as_slice());
            }
        }
    }

    fn cycle(&mut self) {
        self.before_cycle();
        let now = self.now;
        let Self { engine, north, south, can, devicenet, foreign, config, .. } = self;
        let due =
            engine.cycle(now, &mut [north], &mut ports_of(config, south, can, devicenet, foreign.as_mut()));
        self.set_due(due);
        self.after_cycle();
    }

    /// The engine is late: buses and drives go on.
    fn go_on_without_engine(&mut self) {
        self.line.handle_time(self.now);
        self.foreign_line.iter_mut().for_each(|line| line.handle_time(self.now));
        self.can.iter_mut().for_each(|wire| wire.bus.advance(self.now));
        self.devicenet.iter_mut().for_each(|wire| wire.bus.advance(self.now));
        self.foreign.iter_mut().for_each(|wire| wire.bus.advance(self.now));
        self.check_motion(|checker, rig| checker.observe(rig));
    }

    /// Shows the rig to the motion checker.
    fn check_motion(&mut self, look: impl FnOnce(&mut MotionChecker, &Self)) {
        let mut checker = std::mem::take(&mut self.motion_checker);
        look(&mut checker, self);
        self.motion_checker = checker;
    }

    /// What the engine finds at its ports when it is called now.
    fn before_cycle(&mut self) {
        self.late = self.now.since(self.engine_due);
        let format = self.config.devices[0].connection_format;
        let rate_ppb = if self.knows_rate { self.gateway_clock.drift_ppb() } else { 0 };
        let sample = TimeSample { at: self.now, system: self.system(), rate_ppb };
        self.engine.feed_time(&sample);
        for datagram in self.north.inbound.iter() {
            if let Some(update) = updates::read(datagram.as_slice(), format, None) {
                self.motion_checker.arrived(update.id);
            }
        }
    }

    /// The line answers, the network takes the device's datagrams, and the watchers look.
    fn after_cycle(&mut self) {
        self.commissioners.poll();
        let line: &mut dyn Stations = match &mut self.foreign_line {
            Some(line) => line,
            None => &mut self.line,
        };
        line.handle_time(self.now);
        let line = self.cable.then_some(line);
        let tamper = &mut self.tamper_frame;
        let mut back = |frame: &mut Bytes| tamper.as_mut().is_none_or(|tamper| tamper(frame));
        self.south.exchange(self.now, &mut self.checked, line, &mut back);
        while let Some((mut datagram, _)) = self.north.outbound.pop() {
            if self.tamper_actual.as_mut().is_none_or(|tamper| tamper(&mut datagram)) {
                self.actuals.send(self.now, &self.knobs, datagram);
            }
        }
        while let Ok(notice) = self.notice_queue.pop() {
            self.notices.push(notice);
        }
        let late = self.late;
        self.check_motion(|checker, rig| {
            checker.called(rig, late);
            checker.observe(rig);
        });
        for (slave, watched) in self.line.slaves().iter().zip(&mut self.watched) {
            let [low, high, ..] = slave.store().number_of(Idn::DRIVE_CONTROL).to_le_bytes();
            let control = DriveControl::from_bits_retain(u16::from_le_bytes([low, high]));
            let on = control.contains(DriveControl::ON);
            if on != watched.on {
                watched.on = on;
                watched.changes.push((self.now, on));
            }
        }
    }

    /// The controller does what is due and its datagrams go on their way.
    fn control(&mut self) {
        let (now, system) = self.controller_time();
        let hidden = if self.reports_steps { DurationNs::ZERO } else { self.controller_clock.stepped() };
        let Some(controller) = self.controller.as_mut() else { return };
        controller.handle_time(now, system);
        let mut sent = Vec::new();
        let format = self.config.devices[0].connection_format;
        let mut buffer = [0; DATAGRAM_MAX];
        while let Some(length) = controller.poll_datagram_transmit(&mut buffer) {
            let mut datagram = Bytes::of(&buffer[..length]);
            sent.extend(updates::read(datagram.as_slice(), format, Some(&*controller)));
            updates::hide_steps(datagram.as_mut_slice(), hidden);
            if self.tamper_command.as_mut().is_none_or(|tamper| tamper(&mut datagram)) {
                self.commands.send(self.now, &self.knobs, datagram);
            }
        }
        while let Some(event) = controller.poll_event() {
            self.events.push(event);
        }
        let action = controller.poll_stream_action();
        for commanded in &sent {
            self.check_motion(|checker, rig| checker.sent(rig, rig.now, commanded));
        }
        if let Some(action) = action {
            if let Some(slot) = self.slot.take() {
                self.adapter.close(slot);
            }
            self.stream_works = action == StreamAction::Reopen && self.accepts_streams;
            if let Some(controller) = self.controller.as_mut()
                && action == StreamAction::Reopen
                && !self.accepts_streams
            {
                controller.tcp_closed(now);
            }
            if self.stream_works {
                let peer = SocketAddrV4::new(CONTROLLER, CONTROLLER_PORT);
                self.slot = Some(self.adapter.open(self.now, peer).expect("the box has room for a stream"));
                if let Some(controller) = self.controller.as_mut() {
                    controller.tcp_connected(now);
                }
                // A session that is registered anew leaves the motion connection, and its curve, as they are.
                if self.engine.devices()[0].device().connection().is_none() {
                    self.motion_checker.connected(self.now);
                }
            }
        }
    }

    /// Moves everything that can move on the explicit side without time passing.
    fn explicit(&mut self) {
        let (now, (controller_now, _)) = (self.now, self.controller_time());
        while let Some(reply) = self.link.reply() {
            self.adapter.complete(now, &reply);
        }
        if self.adapter.wake_at().is_some_and(|at| at <= now) {
            self.adapter.handle_time(now);
        }
        let mut buffer = [0; 4096];
        loop {
            let mut moved = false;
            if let (Some(controller), Some(slot)) = (self.controller.as_mut(), self.slot) {
                while let Some(length) = controller.poll_stream_transmit(&mut buffer) {
                    moved = true;
                    if self.stream_works {
                        let taken = self.adapter.handle_stream(now, slot, &buffer[..length]);
                        assert_eq!(taken, length, "the adapter has room for what the controller asks");
                    }
                }
                loop {
                    let length = self.adapter.poll_transmit(now, slot, &mut buffer);
                    if length == 0 {
                        break;
                    }
                    moved = true;
                    if self.stream_works {
                        controller.handle_stream(controller_now, &buffer[..length]);
                    }
                }
            } else if let Some(controller) = self.controller.as_mut() {
                // What goes into a broken stream is lost.
                while controller.poll_stream_transmit(&mut buffer).is_some() {}
            }
            self.send_requests();
            if let Some(controller) = self.controller.as_mut() {
                while let Some(event) = controller.poll_event() {
                    self.events.push(event);
                }
            }
            if !moved {
                break;
            }
        }
        if self.slot.is_some_and(|slot| self.adapter.is_done(slot)) {
            self.close_stream();
        }
    }

    fn send_requests(&mut self) {
        while let Some(request) = self.adapter.poll_motion() {
            self.link.request(request).expect("the queue to the engine has room");
        }
    }

    // ---- streams of others ----------------------------------------------------------------------

    /// Opens a stream beside the controller's.
    pub fn open_stream(&mut self, from: SocketAddrV4) -> Option<SessionSlot> {
        self.adapter.open(self.now, from).ok()
    }

    /// Sends bytes on such a stream and returns what comes back within `limit`, all of it.
    pub fn exchange(&mut self, slot: SessionSlot, bytes: &[u8], limit: DurationNs) -> Vec<u8> {
        self.exchange_while(slot, bytes, limit, |_| {})
    }

    /// The same; `each` is called after each step.
    pub fn exchange_while(
        &mut self,
        slot: SessionSlot,
        bytes: &[u8],
        limit: DurationNs,
        mut each: impl FnMut(&mut Self),
    ) -> Vec<u8> {
        let mut rest = bytes;
        let mut answer = Vec::new();
        let mut buffer = [0; 4096];
        let end = self.now + limit;
        while self.now < end {
            let taken = self.adapter.handle_stream(self.now, slot, rest);
            rest = &rest[taken..];
            self.send_requests();
            self.step();
            each(self);
            let length = self.adapter.poll_transmit(self.now, slot, &mut buffer);
            answer.extend_from_slice(&buffer[..length]);
            if length == 0 && !answer.is_empty() {
                break;
            }
        }
        answer
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("the rig ran with seed {} up to {}", self.seed, self.elapsed());
        }
    }
}

/// The ports of the buses in the order of the engine's.
fn ports_of<'a>(
    config: &Config,
    south: &'a mut SouthQueue,
    can: &'a mut [CanWire],
    devicenet: &'a mut [CanWire<DevicenetNode>],
    foreign: Option<&'a mut CanWire<Foreign>>,
) -> ArrayVec<SouthPort<'a>, BUSES_MAX> {
    let mut ports = ArrayVec::new();
    if config.sercos.is_some() {
        ports.push(SouthPort::Ethernet(south));
    }
    // It stands in the place of the first one.
    ports.extend(foreign.map(|bus| SouthPort::Can(bus)));
    ports.extend(can.iter_mut().map(|bus| SouthPort::Can(bus)));
    ports.extend(devicenet.iter_mut().map(|network| SouthPort::Can(network)));
    ports
}

type Assembled = (Engine, Adapter, AdapterEnd, rtrb::Consumer<Notice>, Reader<BoxStatus>, Commissioners);

fn assemble(config: &Config, overlays: &[&str]) -> Assembled {
    let Built { mut engine, adapters, notices, status, commissioners } =
        build(config, mapping::with_overlays(overlays), HOST).expect("the configuration makes a box");
    engine.set_sync(SyncState { grandmaster: Some(setup::HOST_CLOCK), synchronized: true, offset: 0 });
    let (config, link) = adapters.into_iter().next().expect("one device");
    let adapter = Adapter::new(config).expect("the adapter's configuration is sound");
    (engine, adapter, link, notices, status, commissioners)
}
