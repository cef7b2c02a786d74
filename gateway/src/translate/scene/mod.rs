//! Scenes: a controller that carries out a script, the engine of the box, and simulated drives to which things happen, all on one
//! clock in virtual time.
//!
//! ```text
//! script -> Controller -> Adapter, NorthPort -> Engine::cycle -> SouthPort -> simulated drives <- events
//!                            (recorded)                           (recorded)
//! ```
//!
//! Where a list of frames shows what the box makes of one frame, a scene shows what it does over time: motion on the grid of the bus,
//! stops, losses, faults, captures, tests. Nothing is substituted; controller and drives are those of `axisbridge simulate`.
//!
//! The text of a scene has a line for each thing that happens, and one for every 100 ms with a checksum of everything that the
//! box has sent there, so that no byte can change unseen.

mod drives;
mod local;
mod recording;

use std::collections::VecDeque;
use std::net::{Ipv4Addr, SocketAddrV4};

use profile_cip::controller::config::ConfigError;
use profile_cip::controller::{Controller, ControllerConfig, DATAGRAM_MAX, Event, Step, StreamAction};
use profile_cip::device::adapter::{Adapter, SessionSlot};
use profile_cip::device::motion_device::SyncState;
use profile_cip::wire::encapsulation::IO_PORT;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_generic::time_base::TimeSample;

use self::drives::Drives;
use self::local::Client;
pub use self::local::{OrderError, Orders};
use self::recording::{Recording, Sum};
use crate::config::Config;
use crate::engine::Engine;
use crate::engine::axis::rest::Unrested;
use crate::engine::build::{BuildError, Built, Commissioners, Host, build};
use crate::engine::local::LocalNorth;
use crate::engine::notice::Notice;
use crate::engine::port::{Datagram, NorthPort, SouthPort};
use crate::mapping::Mapping;
use crate::north::AdapterEnd;
use crate::simulate::drive_events::player::Player;
use crate::simulate::drive_events::setup::Setup;
use crate::simulate::drive_events::{Names, Script as Events};
use crate::simulate::drives::SIMULATED_MAC;
use crate::simulate::script::Script;
use crate::simulate::setup::HOST_CLOCK;

/// When the box is switched on; the instant does not matter.
const START: MonotonicTime = MonotonicTime(1_000_000_000);

/// System time at the monotonic time zero.
const SYSTEM_OFFSET: u64 = 1_700_000_000_000_000_000;

/// Longest step of the clock, so that streams are looked at when nothing else is due.
const STEP_MAX: DurationNs = DurationNs::from_millis(1);

/// Time in which the buses must be in operation.
const COMMISSIONING_MAX: DurationNs = DurationNs::from_secs(30);

/// The longest scene.
const SCENE_MAX: DurationNs = DurationNs::from_secs(120);

/// Time in which the box must have stopped.
const STOP_MAX: DurationNs = DurationNs::from_secs(60);

/// The controller's address, and the port of its stream.
const CONTROLLER: Ipv4Addr = Ipv4Addr::new(10, 0, 0, 1);
const STREAM_PORT: u16 = 50_000;

/// Octets moved from or to a stream at once.
const STREAM_CHUNK: usize = 4096;

/// Why a scene cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The configuration makes no box.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The explicit side of a device cannot work as it is configured.
    #[error("the device of the script: {0}")]
    Device(String),
    /// A drive of a scene is built as the configuration says.
    #[error("the events set a property of a drive (resolution, rated_torque, gear), which a scene cannot")]
    Property,
    /// The script's controller cannot work.
    #[error("the controller of the script: {0}")]
    Controller(#[from] ConfigError),
}

/// The drives that the events of a scene can name: those of the axes, counted from 1 in the order of the configuration.
#[must_use]
pub fn names(config: &Config) -> Names {
    Names { what: "axis", numbers: 1..=u16::try_from(config.axes.len()).unwrap_or(u16::MAX) }
}

/// Plays a scene and returns its text. The controller is that of the device with the address `target` of the script, else of the first
/// one; it connects when a client of local control has given its orders. The events count from the moment at which the buses are in
/// operation, or should have been. When the controller is at its end, the box is stopped.
///
/// # Errors
/// [`SceneError`]. A step that fails is part of the text.
pub fn play(
    config: &Config,
    mapping: Mapping,
    script: &Script,
    events: Events,
    orders: Orders,
) -> Result<String, SceneError> {
    if events.setup != Setup::default() {
        return Err(SceneError::Property);
    }
    let mut scene = Scene::new(config, mapping, script)?;
    let end = scene.now + COMMISSIONING_MAX;
    while scene.now < end && !scene.is_ready() {
        scene.step();
    }
    let said = if scene.is_ready() {
        "the buses are in operation"
    } else {
        "not every bus is in operation, and the scene goes on without"
    };
    scene.recording.say(scene.now, said);
    scene.block();
    scene.player = Some(Player::new(names(config), events, scene.now));
    if !orders.is_empty() {
        scene.control_locally(orders);
    }
    scene.connect(script.config.clone(), script.steps.clone())?;
    let end = scene.now + SCENE_MAX;
    while scene.now < end && !scene.controller.as_ref().is_none_or(Controller::is_closed) {
        scene.step();
    }
    scene.report(script);
    scene.stop();
    Ok(scene.recording.text())
}

/// The UDP port of a device.
#[derive(Debug, Default)]
struct Wire {
    inbound: VecDeque<(Vec<u8>, MonotonicTime)>,
    outbound: VecDeque<Vec<u8>>,
    sum: Sum,
}

impl NorthPort for Wire {
    fn receive(&mut self, buffer: &mut [u8]) -> Option<Datagram> {
        let (bytes, at) = self.inbound.pop_front()?;
        buffer.get_mut(..bytes.len())?.copy_from_slice(&bytes);
        let from = SocketAddrV4::new(CONTROLLER, IO_PORT);
        Some(Datagram { len: bytes.len(), from, arrived_at: Some(at) })
    }

    fn send(&mut self, datagram: &[u8], _: SocketAddrV4) -> bool {
        self.sum.add(datagram);
        self.outbound.push_back(datagram.to_vec());
        true
    }
}

/// Everything on one clock.
struct Scene {
    engine: Engine,
    engine_due: MonotonicTime,
    commissioners: Commissioners,
    notices: rtrb::Consumer<Notice>,
    wires: Vec<Wire>,
    drives: Drives,
    player: Option<Player<Drives>>,
    client: Option<Client>,
    /// The device that the controller speaks to.
    device: usize,
    adapter: Adapter,
    /// To the devices; the others have no adapter that asks.
    links: Vec<AdapterEnd>,
    controller: Option<Controller>,
    slot: Option<SessionSlot>,
    titles: Vec<String>,
    recording: Recording,
    now: MonotonicTime,
}

impl Scene {
    fn new(config: &Config, mapping: Mapping, script: &Script) -> Result<Self, SceneError> {
        let host = Host { mac: SIMULATED_MAC, incarnation: 1 };
        let Built { mut engine, notices, commissioners, adapters, .. } = build(config, mapping, host)?;
        engine.set_sync(SyncState { grandmaster: Some(HOST_CLOCK), synchronized: true, offset: 0 });
        let target = script.places.target;
        let device = config.devices.iter().position(|device| Some(device.listen) == target).unwrap_or(0);
        let mut adapter = None;
        let mut links = Vec::new();
        for (number, (explicit, link)) in adapters.into_iter().enumerate() {
            if number == device {
                adapter =
                    Some(Adapter::new(explicit).map_err(|error| SceneError::Device(error.to_string()))?);
            }
            links.push(link);
        }
        Ok(Self {
            engine,
            engine_due: START,
            commissioners,
            notices,
            wires: config.devices.iter().map(|_| Wire::default()).collect(),
            drives: Drives::of(config),
            player: None,
            client: None,
            device,
            adapter: adapter.ok_or_else(|| SceneError::Device("expected one".to_owned()))?,
            links,
            controller: None,
            slot: None,
            titles: script.titles.iter().map(|(title, _)| title.clone()).collect(),
            recording: Recording::new(config, START),
            now: START,
        })
    }

    fn is_ready(&self) -> bool {
        let mut buses = self.engine.buses().iter();
        self.engine.axes().iter().all(|axis| axis.south().is_some()) && buses.all(|bus| bus.is_up())
    }

    /// Lets a client of local control give its orders.
    fn control_locally(&mut self, orders: Orders) {
        let (local, end) = LocalNorth::new(self.engine.axes().len());
        self.engine.set_local(local);
        self.client = Some(Client::new(end, orders));
        let end = self.now + SCENE_MAX;
        while self.now < end && self.client.as_ref().is_some_and(|client| !client.is_done(self.now)) {
            self.step();
        }
    }

    fn connect(&mut self, config: ControllerConfig, steps: Vec<Step>) -> Result<(), SceneError> {
        let mut controller = Controller::new(config, steps)?;
        self.open_stream();
        controller.tcp_connected(self.now);
        self.controller = Some(controller);
        Ok(())
    }

    fn open_stream(&mut self) {
        self.slot = self.adapter.open(self.now, SocketAddrV4::new(CONTROLLER, STREAM_PORT)).ok();
    }

    /// Goes on to the next thing that is due.
    fn step(&mut self) {
        let controller = self.controller.as_ref().and_then(Controller::wake_at);
        let event = self.player.as_ref().and_then(Player::wake_at);
        let due = [controller, event].into_iter().flatten().fold(self.engine_due, MonotonicTime::min);
        self.now = due.clamp(self.now, self.now + STEP_MAX);
        if self.player.is_some() && self.recording.is_due(self.now) {
            self.block();
        }
        let Self { player, drives, recording, now, .. } = self;
        drives.set_time(*now);
        if let Some(player) = player {
            player.poll(*now, drives, &mut |text| recording.say(*now, text));
        }
        if let Some(client) = &mut self.client {
            client.poll(*now, &mut |text| recording.say(*now, text));
        }
        if self.now >= self.engine_due {
            self.cycle();
        }
        self.control();
        self.explicit();
    }

    fn cycle(&mut self) {
        let Self { engine, wires, drives, now, .. } = self;
        let system = SystemTime(SYSTEM_OFFSET.wrapping_add(now.0));
        engine.feed_time(&TimeSample { at: *now, system, rate_ppb: 0 });
        let mut north: Vec<&mut dyn NorthPort> =
            wires.iter_mut().map(|wire| wire as &mut dyn NorthPort).collect();
        let mut south: Vec<SouthPort<'_>> = drives.ports();
        self.engine_due = engine.cycle(*now, &mut north, &mut south).max(*now + DurationNs(1));
        self.commissioners.poll();
        while let Ok(notice) = self.notices.pop() {
            self.recording.notice(self.now, &notice);
        }
    }

    /// The controller takes what came, and does what is due.
    fn control(&mut self) {
        let (now, system) = (self.now, SystemTime(SYSTEM_OFFSET.wrapping_add(self.now.0)));
        let wire = &mut self.wires[self.device];
        let Some(controller) = self.controller.as_mut() else {
            wire.outbound.clear();
            return;
        };
        while let Some(datagram) = wire.outbound.pop_front() {
            controller.handle_datagram(now, system, &datagram);
        }
        controller.handle_time(now, system);
        let mut buffer = [0; DATAGRAM_MAX];
        while let Some(length) = controller.poll_datagram_transmit(&mut buffer) {
            wire.inbound.push_back((buffer[..length].to_vec(), now));
        }
        let action = controller.poll_stream_action();
        self.tell();
        if let Some(action) = action {
            if let Some(slot) = self.slot.take() {
                self.adapter.close(slot);
            }
            if action == StreamAction::Reopen {
                self.open_stream();
                if let Some(controller) = self.controller.as_mut() {
                    controller.tcp_connected(now);
                }
            }
        }
    }

    /// Moves what can move between controller, adapter and engine without time passing.
    fn explicit(&mut self) {
        let now = self.now;
        while let Some(reply) = self.links[self.device].reply() {
            self.adapter.complete(now, &reply);
        }
        if self.adapter.wake_at().is_some_and(|at| at <= now) {
            self.adapter.handle_time(now);
        }
        let mut buffer = [0; STREAM_CHUNK];
        let mut moves = true;
        while std::mem::take(&mut moves) {
            if let (Some(controller), Some(slot)) = (self.controller.as_mut(), self.slot) {
                while let Some(length) = controller.poll_stream_transmit(&mut buffer) {
                    self.adapter.handle_stream(now, slot, &buffer[..length]);
                    moves = true;
                }
                loop {
                    let length = self.adapter.poll_transmit(now, slot, &mut buffer);
                    if length == 0 {
                        break;
                    }
                    self.recording.stream(&buffer[..length]);
                    controller.handle_stream(now, &buffer[..length]);
                    moves = true;
                }
            } else if let Some(controller) = self.controller.as_mut() {
                // What goes into a closed stream is lost.
                while controller.poll_stream_transmit(&mut buffer).is_some() {}
            }
            while let Some(request) = self.adapter.poll_motion() {
                // The queue has room for all that an adapter asks at once.
                let _ = self.links[self.device].request(request);
            }
            self.tell();
        }
        if self.slot.is_some_and(|slot| self.adapter.is_done(slot)) {
            self.slot = None;
            if let Some(controller) = self.controller.as_mut() {
                controller.tcp_closed(now);
            }
        }
    }

    /// Writes down what the controller says.
    fn tell(&mut self) {
        let Some(controller) = self.controller.as_mut() else { return };
        while let Some(event) = controller.poll_event() {
            let text = match event {
                Event::StepStarted { step } => {
                    let title = self.titles.get(step).map_or("", String::as_str);
                    format!("step {}: {title}", step + 1)
                }
                Event::StepFinished { .. } => continue,
                event => event.to_string(),
            };
            self.recording.say(self.now, &text);
        }
    }

    /// The controller is at its end.
    fn report(&mut self, script: &Script) {
        let Some(controller) = self.controller.take() else { return };
        let report = controller.report();
        let text = match (report.failure, report.failed_step) {
            (None, _) if controller.is_closed() => "the script is at its end".to_owned(),
            (None, _) => format!("the script does not end within {SCENE_MAX}"),
            (Some(failure), None) => format!("the script failed: {failure}"),
            (Some(failure), Some(step)) => {
                let line = script.titles.get(step).and_then(|(_, line)| *line);
                let line = line.map_or_else(String::new, |line| format!(" (line {line})"));
                format!("step {}{line} failed: {failure}", step + 1)
            }
        };
        self.recording.say(self.now, &text);
    }

    /// The box is stopped, whatever its axes do.
    fn stop(&mut self) {
        self.recording.say(self.now, "the gateway is stopped");
        self.engine.stop(self.now);
        let end = self.now + STOP_MAX;
        while self.now < end && !self.engine.is_stopped() {
            self.step();
        }
        for Unrested { axis, state, velocity } in self.engine.unrested() {
            let speed = velocity.map_or_else(|| "not known".to_owned(), |velocity| velocity.to_string());
            let text = format!("axis {} did not come to rest: speed {speed}, drive {state}", axis + 1);
            self.recording.say(self.now, &text);
        }
        self.block();
    }

    /// Writes down what was sent since the last time, and where the axes are.
    fn block(&mut self) {
        let north = self.wires.iter_mut().map(|wire| std::mem::take(&mut wire.sum)).collect();
        self.recording.block(self.now, north, self.drives.take_sums(), self.engine.axes());
    }
}

#[cfg(test)]
mod tests;
