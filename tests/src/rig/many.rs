//! Many axes in virtual time: several devices in front, a controller for each, and drives on all kinds of buses behind.
//!
//! The network between is a good one. What goes wrong, and how, is tried with the other rig.

use std::fmt::Write as _;
use std::net::{Ipv4Addr, SocketAddrV4};

use arrayvec::ArrayVec;
use axisbridge::capture::recorder::Tap;
use axisbridge::config::Config;
use axisbridge::engine::build::{Built, Commissioners, build};
use axisbridge::engine::notice::Notice;
use axisbridge::engine::port::{NorthPort, SouthPort};
use axisbridge::engine::{BUSES_MAX, Engine};
use axisbridge::latest::Reader;
use axisbridge::mapping::Mapping;
use axisbridge::north::AdapterEnd;
use axisbridge::simulate::can_bus::InProcessCan;
use axisbridge::simulate::devicenet_drive::DevicenetNode;
use axisbridge::simulate::drives::{DriveNetwork, drives};
use axisbridge::simulate::setup;
use axisbridge::status::{BoxState, BoxStatus};
use profile_cip::controller::{AxisSet, Controller, DATAGRAM_MAX, Report, Step};
use profile_cip::device::adapter::{Adapter, SessionSlot};
use profile_cip::device::config::AXES_MAX as DEVICE_AXES_MAX;
use profile_cip::device::motion_device::SyncState;
use profile_cip::wire::encapsulation::IO_PORT;
use profile_generic::scaling::UnitKind;
use profile_generic::servo::ServoActual;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_generic::time_base::TimeSample;
use profile_sercos::checker::checked_bus::CheckedBus;

use super::network::{Knobs, Pipe};
use super::ports::{Bytes, CanWire, NorthQueue, SouthQueue};
use super::{CONTROLLER_PORT, HOST, START, STEP_MAX, SYSTEM_OFFSET, ports_of};
use crate::mapping;

/// How many drives each bus has; every one is a turntable with an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crowd {
    /// On the SERCOS line, at 2 ms.
    pub sercos: usize,
    /// On each CAN bus, at 8 ms.
    pub can: &'static [usize],
    /// On each DeviceNet network, at 20 ms.
    pub devicenet: &'static [usize],
}

/// The bus of an axis, and the place of its drive there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum At {
    /// The SERCOS line.
    Sercos(usize),
    /// A CAN bus.
    Can(usize, usize),
    /// A DeviceNet network.
    Devicenet(usize, usize),
}

impl Crowd {
    /// So many drives on a SERCOS line alone.
    #[must_use]
    pub const fn line(axes: usize) -> Self {
        Self { sercos: axes, can: &[], devicenet: &[] }
    }

    /// The axes in the order of the box: the buses take turns, so that each device has axes on all of them.
    #[must_use]
    pub fn axes(&self) -> Vec<At> {
        let bus = |count: usize, at: &dyn Fn(usize) -> At| {
            (0..count).map(|place| (place * 1_000_000 / count.max(1), at(place))).collect::<Vec<_>>()
        };
        let mut all = bus(self.sercos, &At::Sercos);
        for (number, count) in self.can.iter().enumerate() {
            all.extend(bus(*count, &|place| At::Can(number, place)));
        }
        for (number, count) in self.devicenet.iter().enumerate() {
            all.extend(bus(*count, &|place| At::Devicenet(number, place)));
        }
        all.sort_by_key(|(share, _)| *share);
        all.into_iter().map(|(_, at)| at).collect()
    }

    /// The configuration of its box: a device for every 16 axes.
    #[must_use]
    pub fn configuration(&self) -> String {
        let axes = self.axes();
        let mut text = "[box]\nname = \"crowd\"\n".to_owned();
        let names: Vec<_> = (1..=axes.len()).map(|number| format!("\"axis-{number}\"")).collect();
        // No update may come more often than the cycles of the fastest bus.
        let least = if self.sercos > 0 { 2 } else { 8 };
        for (device, names) in (1..).zip(names.chunks(DEVICE_AXES_MAX)) {
            let _ = write!(
                text,
                "\n[[device]]\nname = \"front-{device}\"\nlisten = \"10.0.1.{device}\"\naxes = [{}]\n\
                 update_period = {{ min = \"{least} ms\", max = \"40 ms\" }}\n\
                 identity = {{ vendor_id = 1, product_code = 1001, serial_number = {device} }}\n",
                names.join(", ")
            );
        }
        for (place, name) in names.iter().enumerate() {
            let (number, instance) = (place + 1, place % DEVICE_AXES_MAX + 1);
            let _ = write!(
                text,
                "\n[[axis]]\nname = {name}\ninstance = {instance}\ndrive = \"drive-{number}\"\nunit = \"revolution\"\n\
                 motion_resolution = 1_000_000\nlimits = {{ following_error = 2.0 }}\n",
            );
        }
        let mut bus = |head: &str, of: &dyn Fn(At) -> Option<String>| {
            let _ = write!(text, "\n{head}\n");
            for (number, drive) in (1..).zip(axes.iter().map(|at| of(*at))) {
                if let Some(drive) = drive {
                    let (table, rest) = drive.split_once('\n').unwrap_or((&drive, ""));
                    let _ = writeln!(text, "\n{table}\nname = \"drive-{number}\"\n{rest}");
                }
            }
        };
        if self.sercos > 0 {
            bus(
                "[south.sercos]\ninterface = \"in-process\"\ncycle_time = \"2 ms\"\njitter = \"100 us\"",
                &|at| {
                    let At::Sercos(place) = at else { return None };
                    Some(format!("[[south.sercos.drive]]\naddress = {}", place + 1))
                },
            );
        }
        for number in 0..self.can.len() {
            bus("[[south.can]]\ninterface = \"in-process\"\ncycle_time = \"8 ms\"", &|at| match at {
                At::Can(of, place) if of == number => Some(format!(
                    "[[south.can.drive]]\nnode = {}\nmodes = [\"position\"]\nactual_values = []",
                    place + 1
                )),
                _ => None,
            });
        }
        for number in 0..self.devicenet.len() {
            let head =
                "[[south.devicenet]]\ninterface = \"in-process\"\nbit_rate = 500_000\ncycle_time = \"20 ms\"";
            bus(head, &|at| match at {
                At::Devicenet(of, place) if of == number => {
                    Some(format!("[[south.devicenet.drive]]\nmac_id = {}\nresolution = 1_048_576", place + 1))
                }
                _ => None,
            });
        }
        text
    }
}

/// A controller with its device.
struct Seat {
    address: Ipv4Addr,
    axes: usize,
    controller: Option<Controller>,
    adapter: Adapter,
    link: AdapterEnd,
    slot: Option<SessionSlot>,
    north: NorthQueue,
    commands: Pipe<Bytes>,
    actuals: Pipe<Bytes>,
    /// Its events, one a line.
    log: String,
}

/// Everything on one clock.
pub struct Many {
    /// What runs in the cycle of the box.
    pub engine: Engine,
    /// What the engine told.
    pub notices: Vec<Notice>,
    axes: Vec<At>,
    seats: Vec<Seat>,
    line: DriveNetwork,
    can: Vec<CanWire>,
    devicenet: Vec<CanWire<DevicenetNode>>,
    checked: CheckedBus,
    mapping: Mapping,
    config: Config,
    commissioners: Commissioners,
    notice_queue: rtrb::Consumer<Notice>,
    status: Reader<BoxStatus>,
    south: SouthQueue,
    now: MonotonicTime,
    engine_due: MonotonicTime,
}

impl Many {
    /// A box with its buses up, and nobody connected.
    ///
    /// # Panics
    /// When the configuration makes no box, or the buses do not come up.
    #[must_use]
    pub fn ready(crowd: Crowd) -> Self {
        let config = Config::parse(&crowd.configuration(), "crowd.toml")
            .unwrap_or_else(|error| panic!("the configuration is sound: {error}"));
        let mapping = mapping::shipped();
        let Built { mut engine, adapters, notices, status, commissioners } =
            build(&config, mapping.clone(), HOST).expect("the configuration makes a box");
        engine.set_sync(SyncState { grandmaster: Some(setup::HOST_CLOCK), synchronized: true, offset: 0 });
        let seat = |(number, (adapter, link))| Seat {
            address: Ipv4Addr::new(10, 0, 2, u8::try_from(number + 1).unwrap_or(u8::MAX)),
            axes: config.axes_of(number).count(),
            controller: None,
            adapter: Adapter::new(adapter).expect("the adapter's configuration is sound"),
            link,
            slot: None,
            north: NorthQueue::default(),
            commands: Pipe::new(1),
            actuals: Pipe::new(2),
            log: String::new(),
        };
        let line = (1..).take(crowd.sercos).map(|address| (address, UnitKind::Rotary));
        let mut many = Self {
            engine,
            notices: Vec::new(),
            axes: crowd.axes(),
            seats: adapters.into_iter().enumerate().map(seat).collect(),
            line: drives(line, false),
            can: config.can.iter().map(|bus| CanWire::new(InProcessCan::of(bus, None))).collect(),
            devicenet: config
                .devicenet
                .iter()
                .map(|network| CanWire::new(InProcessCan::of_devicenet(network, None)))
                .collect(),
            checked: CheckedBus::new(START),
            mapping,
            config,
            commissioners,
            notice_queue: notices,
            status,
            south: SouthQueue::default(),
            now: START,
            engine_due: START,
        };
        many.run_until(DurationNs::from_secs(60), "the buses up", |many| {
            many.status().state == BoxState::READY
        });
        many
    }

    /// How many axes the box has.
    #[must_use]
    pub fn axis_count(&self) -> usize {
        self.axes.len()
    }

    /// The status that the box publishes.
    #[must_use]
    pub fn status(&self) -> BoxStatus {
        self.status.read()
    }

    /// What the drive of an axis (from 0) really does.
    ///
    /// # Panics
    /// Without such an axis.
    #[must_use]
    pub fn actual(&self, axis: usize) -> &ServoActual {
        match self.axes[axis] {
            At::Sercos(place) => self.line.slaves()[place].application().actual(),
            At::Can(bus, place) => {
                let node = self.can[bus].bus.nodes().nth(place).expect("a device");
                node.application().axes()[0].actual()
            }
            At::Devicenet(network, place) => {
                self.devicenet[network].bus.nodes().nth(place).expect("a drive").actual()
            }
        }
    }

    /// Where the drive of an axis (from 0) really is, in nanoturns.
    #[must_use]
    pub fn position(&self, axis: usize) -> i64 {
        self.actual(axis).position.get()
    }

    /// How fast it really is, in nanoturns per second.
    #[must_use]
    pub fn velocity(&self, axis: usize) -> i64 {
        self.actual(axis).velocity.get()
    }

    /// How many devices there are.
    #[must_use]
    pub fn device_count(&self) -> usize {
        self.seats.len()
    }

    /// Connects a controller to each device. `program` makes what it carries out from the number of the device, from 0,
    /// and its axes.
    ///
    /// # Panics
    /// When a controller refuses its configuration, or the box a stream.
    pub fn connect(&mut self, period_us: u32, program: impl Fn(usize, usize) -> Vec<Step>) {
        for (number, seat) in self.seats.iter_mut().enumerate() {
            let counts: Vec<_> =
                self.config.axes_of(number).map(|(_, axis)| f64::from(axis.motion_resolution)).collect();
            let config = setup::controller(&self.mapping, &counts, period_us);
            let mut controller =
                Controller::new(config, program(number, seat.axes)).expect("the configuration is sound");
            let peer = SocketAddrV4::new(seat.address, CONTROLLER_PORT);
            seat.slot = Some(seat.adapter.open(self.now, peer).expect("the box has room for a stream"));
            controller.tcp_connected(self.now);
            seat.controller = Some(controller);
        }
    }

    /// What the controllers report, in the order of the devices.
    #[must_use]
    pub fn reports(&self) -> Vec<Report> {
        self.seats.iter().flat_map(|seat| &seat.controller).map(Controller::report).collect()
    }

    /// Whether every controller has ended.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.seats.iter().flat_map(|seat| &seat.controller).all(Controller::is_closed)
    }

    /// What the controllers and the box said, for a failed test.
    #[must_use]
    pub fn told(&self) -> String {
        let logs: String = self.seats.iter().map(|seat| format!("{}:\n{}", seat.address, seat.log)).collect();
        let line = |notice: &Notice| format!("axis {:?}: {notice}\n", notice.axis());
        logs + &self.notices.iter().map(line).collect::<String>()
    }

    /// Goes on until `done`.
    ///
    /// # Panics
    /// When that takes longer than `limit`.
    pub fn run_until(&mut self, limit: DurationNs, what: &str, mut done: impl FnMut(&Self) -> bool) {
        let start = self.now;
        while !done(self) {
            assert!(self.now.since(start) < limit, "{what} is not reached within {limit}\n{}", self.told());
            self.step();
        }
    }

    /// Records what goes through the ports of the SERCOS line and the devices, with a tap for each.
    pub fn record(&mut self, taps: impl IntoIterator<Item = Tap>) {
        let mut taps = taps.into_iter();
        self.south.tap = taps.next();
        for seat in &mut self.seats {
            seat.north.tap = taps.next();
        }
    }

    /// How many taps [`Many::record`] takes.
    #[must_use]
    pub fn taps(&self) -> usize {
        1 + self.seats.len()
    }

    /// Runs the engine's next call by itself and hands it to `around`, which has to make it: for whoever wants to weigh it
    /// alone. Before it comes everything that is due until then.
    pub fn cycle_in<T>(&mut self, around: impl FnOnce(&mut dyn FnMut()) -> T) -> T {
        while let Some(due) = self.beside_due().filter(|due| *due < self.engine_due) {
            self.now = due.max(self.now);
            self.beside();
        }
        self.now = self.engine_due.max(self.now);
        self.deliver();
        let result = self.cycle(around);
        self.control();
        result
    }

    fn step(&mut self) {
        let next = self.beside_due().unwrap_or(self.engine_due).min(self.engine_due);
        self.now = next.clamp(self.now, self.now + STEP_MAX);
        self.deliver();
        if self.now >= self.engine_due {
            self.cycle(|cycle| cycle());
        }
        self.control();
    }

    /// When the network or a controller has something to do.
    fn beside_due(&self) -> Option<MonotonicTime> {
        let due = |seat: &Seat| {
            let controller = seat.controller.as_ref().and_then(Controller::wake_at);
            controller.into_iter().chain(seat.actuals.wake_at()).min()
        };
        self.seats.iter().filter_map(due).min()
    }

    fn beside(&mut self) {
        self.deliver();
        self.control();
    }

    fn cycle<T>(&mut self, around: impl FnOnce(&mut dyn FnMut()) -> T) -> T {
        let (now, system) = (self.now, SystemTime(self.now.0 + SYSTEM_OFFSET));
        self.engine.feed_time(&TimeSample { at: now, system, rate_ppb: 0 });
        let Self { engine, engine_due, seats, south, can, devicenet, config, .. } = self;
        let mut ports: ArrayVec<SouthPort<'_>, BUSES_MAX> = ports_of(config, south, can, devicenet, None);
        let mut north: Vec<&mut dyn NorthPort> =
            seats.iter_mut().map(|seat| &mut seat.north as &mut dyn NorthPort).collect();
        let result = around(&mut || *engine_due = engine.cycle(now, &mut north, &mut ports));
        drop((ports, north));
        self.commissioners.poll();
        self.line.handle_time(now);
        self.south.exchange(now, &mut self.checked, Some(&mut self.line), &mut |_| true);
        for seat in &mut self.seats {
            while let Some((datagram, _)) = seat.north.outbound.pop() {
                seat.actuals.send(now, &Knobs::GOOD, datagram);
            }
        }
        while let Ok(notice) = self.notice_queue.pop() {
            self.notices.push(notice);
        }
        result
    }

    /// What the network brings now.
    fn deliver(&mut self) {
        let (now, system) = (self.now, SystemTime(self.now.0 + SYSTEM_OFFSET));
        for seat in &mut self.seats {
            let from = SocketAddrV4::new(seat.address, IO_PORT);
            while let Some(datagram) = seat.commands.receive(now) {
                assert!(
                    seat.north.inbound.push(datagram.as_slice(), (from, self.now)),
                    "no room for an update"
                );
            }
            while let Some(datagram) = seat.actuals.receive(now) {
                if let Some(controller) = seat.controller.as_mut() {
                    controller.handle_datagram(now, system, datagram.as_slice());
                }
            }
        }
    }

    /// The controllers do what is due, and what they say goes on its way.
    fn control(&mut self) {
        let (now, system) = (self.now, SystemTime(self.now.0 + SYSTEM_OFFSET));
        for seat in &mut self.seats {
            seat.control(now, system);
        }
    }
}

impl Seat {
    fn control(&mut self, now: MonotonicTime, system: SystemTime) {
        let Some(controller) = self.controller.as_mut() else { return };
        controller.handle_time(now, system);
        let mut buffer = [0; DATAGRAM_MAX];
        while let Some(length) = controller.poll_datagram_transmit(&mut buffer) {
            self.commands.send(now, &Knobs::GOOD, Bytes::of(&buffer[..length]));
        }
        if controller.poll_stream_action().is_some()
            && let Some(slot) = self.slot.take()
        {
            self.adapter.close(slot);
        }
        self.explicit(now);
        if let Some(controller) = self.controller.as_mut() {
            while let Some(event) = controller.poll_event() {
                let _ = writeln!(self.log, "{event}");
            }
        }
    }

    /// Moves everything that can move on the explicit side without time passing.
    fn explicit(&mut self, now: MonotonicTime) {
        while let Some(reply) = self.link.reply() {
            self.adapter.complete(now, &reply);
        }
        if self.adapter.wake_at().is_some_and(|at| at <= now) {
            self.adapter.handle_time(now);
        }
        let (Some(controller), Some(slot)) = (self.controller.as_mut(), self.slot) else { return };
        let mut buffer = [0; 4096];
        loop {
            let mut moved = false;
            while let Some(length) = controller.poll_stream_transmit(&mut buffer) {
                moved = true;
                let taken = self.adapter.handle_stream(now, slot, &buffer[..length]);
                assert_eq!(taken, length, "the adapter has room for what the controller asks");
            }
            loop {
                let length = self.adapter.poll_transmit(now, slot, &mut buffer);
                if length == 0 {
                    break;
                }
                moved = true;
                controller.handle_stream(now, &buffer[..length]);
            }
            while let Some(request) = self.adapter.poll_motion() {
                self.link.request(request).expect("the queue to the engine has room");
            }
            if !moved {
                return;
            }
        }
    }
}

/// All axes of a device.
#[must_use]
pub fn all(axes: usize) -> AxisSet {
    AxisSet::first(u8::try_from(axes).unwrap_or(u8::MAX))
}
