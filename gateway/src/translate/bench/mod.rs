//! The engine of the box on a bench: in virtual time, with a controller at each of its north ports and drives at its south ports that
//! say what a list of frames says.
//!
//! ```text
//! update of a list -> Controller -> NorthPort -> Engine::cycle -> SouthPort -> what the drive of the axis is told
//! D-to-C update    <-               NorthPort <- Engine::cycle <- SouthPort <- what a list says of the drive
//! ```
//!
//! The buses are real ones with simulated drives, so that commissioning, telegrams and service channel are those of the box. What is
//! substituted at the ports, so that any frame gets through:
//!
//! - Update ID, sequence count, last received ID, time stamp and connection of an update are those of the bench; its data sets ask
//!   for everything. An update is repeated in every period until another one comes, and so are the values of a drive.
//! - Drives get no word that would switch them on: what an axis is told moves nobody. A drive of which no frame has said anything
//!   stands at zero and does at once what its axis wants of it.
//! - An axis of which no frame has said anything is enabled before an update is handed to it, and after one that has stopped it.

mod can;
mod controller;
mod devicenet;
mod sercos;

use std::collections::VecDeque;
use std::net::SocketAddrV4;

use profile_cip::device::attribute::id;
use profile_cip::device::axis_state::AxisState;
use profile_cip::device::motion_link::{ExplicitReply, MotionReply, MotionRequest, Token};
use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::motion::codes::{
    AxisControl, AxisStateCode, ControlMode, FeedbackMode, NodeControl, NodeFault, NodeStatus,
};
use profile_cip::wire::motion::fixed::FixedActual;
use profile_cip::wire::motion::id_list::IdStatusList;
use profile_cip::wire::motion::{
    ActualFrame, ActualPosition, ActualValues, CommandBlock, CommandFrame, CommandPosition, CommandValues,
    Format,
};
use profile_generic::image::{AxisCommand, StatusBits};
use profile_generic::mode::OperatingMode;
use profile_generic::state::{Action, DriveState, Report};
use profile_generic::time::{DurationNs, MonotonicTime};

use self::controller::{Controller, MOTOR_FEEDBACK, at_rest};
use super::stage::{Behind, Held, StageAxis, StageError};
use crate::config::{AxisFunction, Config};
use crate::engine::Engine;
use crate::engine::build::{Built, Commissioners, Host, build};
use crate::engine::notice::Notice;
use crate::engine::port::{Datagram, NorthPort, SouthPort};
use crate::mapping::devicenet::{MODE_AT, motion};
use crate::mapping::{FeedbackUse, Item, Mapping};
use crate::north::AdapterEnd;
use crate::simulate::drives::SIMULATED_MAC;

/// Virtual time in which the drives must be ready, and what each of them adds: 511 of them take less.
const COMMISSIONING_MAX: DurationNs = DurationNs::from_secs(20);
const COMMISSIONING_AXIS: DurationNs = DurationNs::from_millis(250);

/// When it begins; the instant does not matter.
const START: MonotonicTime = MonotonicTime(1_000_000_000);

/// Update periods that an axis may take to get to where it is wanted.
const PERIODS_MAX: i64 = 60;

/// Update periods in which all settings of the drives of a device are read.
const READS_PERIODS_MAX: i64 = 1_000;

/// The same of the answer to an explicit message or a service: the drive may have to be asked.
const ANSWER_PERIODS_MAX: i64 = 400;

/// Update periods in which a telegram with the values of an update must have gone out.
const TELEGRAM_PERIODS_MAX: i64 = 8;

/// Services of explicit messages.
const GET_ATTRIBUTE_SINGLE: u8 = 0x0E;
const SET_ATTRIBUTE_SINGLE: u8 = 0x10;

/// Place of Axis Control in an update of the fixed format.
const AXIS_CONTROL_AT: usize = 6;

/// Update periods in which the box reads what a drive says is wrong.
const DIAGNOSIS_PERIODS: i64 = 40;

/// Update periods without an update after which an axis has lost its command, and has done what follows from that.
const SILENT_PERIODS: i64 = 24;

/// Bytes of the control word and an operating mode behind it.
const HEAD_LEN: usize = 2;

/// Bytes of a diagnostic word on CANopen.
const WORD_LEN: usize = 2;

/// The drive of an axis, as the bench has it.
#[derive(Debug, Default)]
struct Peer {
    /// What it shows.
    shown: Vec<u8>,
    /// What it was told last, and when; its control word first.
    told: Option<(MonotonicTime, Vec<u8>)>,
    /// What was written into it beside the cycle.
    written: Vec<(Item, Vec<u8>)>,
}

impl Peer {
    /// Puts what it shows in place of its values.
    fn show(&self, values: &mut [u8]) {
        values.iter_mut().zip(&self.shown).for_each(|(place, byte)| *place = *byte);
    }

    fn hear(&mut self, now: MonotonicTime, values: &[u8]) {
        match &mut self.told {
            Some((at, told)) => {
                *at = now;
                told.clear();
                told.extend_from_slice(values);
            }
            told => *told = Some((now, values.to_vec())),
        }
    }
}

/// A port with one controller.
#[derive(Debug, Default)]
struct Wire {
    to_device: VecDeque<(Vec<u8>, SocketAddrV4)>,
    /// The newest update of the device.
    from_device: Vec<u8>,
}

impl NorthPort for Wire {
    fn receive(&mut self, buffer: &mut [u8]) -> Option<Datagram> {
        let (bytes, from) = self.to_device.pop_front()?;
        let len = bytes.len();
        buffer.get_mut(..len)?.copy_from_slice(&bytes);
        Some(Datagram { len, from, arrived_at: None })
    }

    fn send(&mut self, datagram: &[u8], _: SocketAddrV4) -> bool {
        self.from_device.clear();
        self.from_device.extend_from_slice(datagram);
        true
    }
}

/// A bus.
#[derive(Debug)]
enum Tap {
    Sercos(Box<sercos::Tap>),
    Can(Box<can::Tap>),
    Devicenet(Box<devicenet::Tap>),
}

impl Tap {
    fn port(&mut self) -> SouthPort<'_> {
        match self {
            Self::Sercos(tap) => SouthPort::Ethernet(&mut **tap),
            Self::Can(tap) => SouthPort::Can(&mut **tap),
            Self::Devicenet(tap) => SouthPort::Can(&mut **tap),
        }
    }

    /// Stops the motors of simulated drives, where they have some.
    fn pause_drives(&mut self) {
        match self {
            Self::Sercos(tap) => tap.pause_drives(),
            Self::Can(tap) => tap.pause_drives(),
            Self::Devicenet(_) => {}
        }
    }

    fn peers(&mut self) -> &mut [Peer] {
        match self {
            Self::Sercos(tap) => &mut tap.peers,
            Self::Can(tap) => &mut tap.peers,
            Self::Devicenet(tap) => &mut tap.peers,
        }
    }
}

/// An axis.
#[derive(Debug, Clone)]
struct Member {
    device: usize,
    /// Place among the axes of its device.
    place: usize,
    /// Place of its bus.
    bus: usize,
    /// Whether it may be switched on.
    moves: bool,
    /// The Feedback Mode that it can be switched on with.
    feedback: FeedbackMode,
    /// Whether a frame has said what its drive shows.
    heard: bool,
    kind: Kind,
}

/// What the values of a drive come in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// In the order of its program.
    Values,
    /// An update of the fixed format, on DeviceNet.
    Update,
    /// An assembly, on DeviceNet.
    Assembly,
}

/// What a drive was told in one telegram.
#[derive(Debug, Clone)]
pub(super) struct Telegram {
    /// Its values.
    pub bytes: Vec<u8>,
    /// The command that they were made of, and what the drive was to do.
    pub command: AxisCommand,
    pub action: Action,
    /// What the drive showed.
    pub shown: Vec<u8>,
}

/// What an axis was told from an update on.
#[derive(Debug, Clone)]
pub(super) struct Told {
    /// Telegrams on the way with other words than those before them.
    pub before: Vec<Telegram>,
    /// That of the instant at which the update counts, if one went out.
    pub last: Option<Telegram>,
    /// The command of the axis then.
    pub command: AxisCommand,
}

/// An engine in virtual time with a controller and simulated drives.
#[derive(Debug)]
pub(super) struct Bench {
    engine: Engine,
    links: Vec<AdapterEnd>,
    notices: rtrb::Consumer<Notice>,
    commissioners: Commissioners,
    wires: Vec<Wire>,
    taps: Vec<Tap>,
    controllers: Vec<Controller>,
    members: Vec<Member>,
    lead: DurationNs,
    now: MonotonicTime,
    /// What the box has said since it was taken last.
    said: Vec<Notice>,
    /// Updates were taken in the last call: the cycles of the buses are about to begin.
    aligned: bool,
    /// What is to be done before the next list: nothing was said on a bench that is not used.
    used: bool,
}

impl Bench {
    /// Commissions simulated drives as the box would, which hold these values in place of their own.
    pub fn new(config: &Config, mapping: Mapping, held: &[Held]) -> Result<Self, StageError> {
        let host = Host { mac: SIMULATED_MAC, incarnation: 1 };
        let Built { engine, notices, commissioners, adapters, .. } = build(config, mapping, host)?;
        let axes = config.axes.len();
        let mut taps = Vec::new();
        taps.extend(
            config.sercos.iter().map(|bus| Tap::Sercos(Box::new(sercos::Tap::new(config, bus, axes)))),
        );
        taps.extend(config.can.iter().map(|bus| Tap::Can(Box::new(can::Tap::new(bus, axes)))));
        for Held { drive, item, bytes } in held {
            for tap in &mut taps {
                match (tap, item) {
                    (Tap::Sercos(tap), Item::Idn(idn)) => tap.commission_with(drive, *idn, bytes),
                    (Tap::Can(tap), Item::Object(object)) => tap.commission_with(drive, *object, bytes),
                    _ => {}
                }
            }
        }
        let devicenet = config.devicenet.iter();
        taps.extend(devicenet.map(|bus| Tap::Devicenet(Box::new(devicenet::Tap::new(bus, axes)))));
        let mut controllers = Vec::new();
        let mut members: Vec<Option<Member>> = vec![None; axes];
        for (number, device) in config.devices.iter().enumerate() {
            let mut own: Vec<_> = config.axes_of(number).collect();
            own.sort_by_key(|(_, axis)| axis.instance);
            let own: Vec<usize> = own.into_iter().map(|(axis, _)| axis).collect();
            let cycles = own.iter().map(|axis| engine.buses().get(engine.buses().of(*axis)).cycle_time());
            let period = cycles.max().unwrap_or(device.update_period_min).max(device.update_period_min);
            for (place, axis) in own.iter().enumerate() {
                members[*axis] = Some(Member {
                    device: number,
                    place,
                    bus: engine.buses().of(*axis),
                    moves: config.axes[*axis].function == AxisFunction::Drive,
                    feedback: feedback_mode(engine.mapping(), config.axes[*axis].feedback),
                    heard: false,
                    kind: Kind::Values,
                });
            }
            controllers.push(Controller::new(device.connection_format, own, period));
        }
        let mut bench = Self {
            engine,
            links: adapters.into_iter().map(|(_, end)| end).collect(),
            notices,
            commissioners,
            wires: config.devices.iter().map(|_| Wire::default()).collect(),
            taps,
            controllers,
            // Every axis of a checked configuration is one of a device.
            members: members.into_iter().flatten().collect(),
            lead: config.lead,
            now: START,
            said: Vec::new(),
            aligned: false,
            used: true,
        };
        let end =
            START + COMMISSIONING_MAX + COMMISSIONING_AXIS * i64::try_from(axes).unwrap_or(i64::MAX / 2);
        while !bench.is_ready() && bench.now < end {
            bench.call();
        }
        bench.taps.iter_mut().for_each(Tap::pause_drives);
        Ok(bench)
    }

    /// Whether every axis has the program of its drive, and every bus is in cyclic operation.
    fn is_ready(&self) -> bool {
        let mut buses = self.engine.buses().iter();
        self.engine.axes().iter().all(|axis| axis.south().is_some()) && buses.all(|bus| bus.is_up())
    }

    /// The engine that runs, to look at its state.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// The same, for a test that makes it wrong.
    #[cfg(test)]
    pub fn engine_mut(&mut self) -> &mut Engine {
        &mut self.engine
    }

    /// What the box has said since the last call.
    pub fn take_notices(&mut self) -> Vec<Notice> {
        std::mem::take(&mut self.said)
    }

    /// One call of the engine.
    fn call(&mut self) {
        let Self { engine, wires, taps, controllers, now, aligned, .. } = self;
        *aligned = false;
        for (controller, wire) in controllers.iter_mut().zip(wires.iter_mut()) {
            if controller.next.is_some_and(|next| *now >= next) {
                wire.to_device.push_back(controller.update());
                *aligned = true;
            }
        }
        let mut north: Vec<&mut dyn NorthPort> =
            wires.iter_mut().map(|wire| wire as &mut dyn NorthPort).collect();
        let mut south: Vec<SouthPort<'_>> = taps.iter_mut().map(Tap::port).collect();
        let due = engine.cycle(*now, &mut north, &mut south);
        self.commissioners.poll();
        while let Ok(notice) = self.notices.pop() {
            self.said.push(notice);
        }
        self.stand_in();
        let updates = self.controllers.iter().filter_map(|controller| controller.next).min();
        self.now = updates.map_or(due, |update| update.min(due)).max(self.now + DurationNs(1));
    }

    fn run_until(&mut self, end: MonotonicTime) {
        while self.now < end {
            self.call();
        }
    }

    /// Drives of which nothing was said do what their axes want.
    fn stand_in(&mut self) {
        for number in 0..self.members.len() {
            if !self.members[number].heard {
                let wanted = match self.engine.axes()[number].state() {
                    DriveState::Starting | DriveState::Operating | DriveState::Testing => Report::Operating,
                    _ => Report::Ready,
                };
                self.pose(number, wanted, StatusBits::empty());
            }
        }
    }

    /// Lets a drive show a state, in the mode that its axis is in and with all values zero.
    fn pose(&mut self, number: usize, report: Report, bits: StatusBits) {
        let axis = &self.engine.axes()[number];
        let Some(program) = axis.south() else { return };
        let selection = match axis.command().selection() {
            selection if program.has_mode(selection) => selection,
            _ => program.first_mode().unwrap_or_default(),
        };
        let member = &self.members[number];
        let peer = &mut self.taps[member.bus].peers()[number];
        let len = usize::from(program.telegram.feedback_bytes);
        peer.shown.clear();
        peer.shown.resize(len.max(MODE_AT + 1), 0);
        program.write_status(report, selection, bits, &mut peer.shown);
        match member.kind {
            Kind::Values => {}
            Kind::Update => {
                peer.shown = answer(&peer.shown, peer.told.as_ref().map(|(_, told)| told.as_slice()))
            }
            // Status and state, and a speed of zero.
            Kind::Assembly => peer.shown[MODE_AT] = 0,
        }
    }

    // ---- connections ------------------------------------------------------------------------------------------

    /// Forgets what was said before: every controller connects anew, and every drive is as none has heard it.
    pub fn restart(&mut self, axes: &[StageAxis]) {
        if !std::mem::take(&mut self.used) {
            return;
        }
        for device in 0..self.controllers.len() {
            if self.controllers[device].is_open {
                let request = self.controllers[device].close();
                self.request(device, request);
            }
        }
        self.members.iter_mut().for_each(|member| member.heard = false);
        self.learn(axes);
        self.settle();
        self.run_while(PERIODS_MAX, |bench| bench.engine.axes().iter().any(|axis| axis.may_have_torque()));
        for (number, stage) in axes.iter().enumerate().take(self.engine.axes().len()) {
            self.engine.set_cip_program(number, stage.north.clone());
            let axis = &mut self.engine.axes_mut()[number];
            axis.set_south(stage.south.clone());
            axis.forget_command();
        }
        for tap in &mut self.taps {
            tap.peers().iter_mut().for_each(|peer| peer.told = None);
        }
        self.release();
        for device in 0..self.controllers.len() {
            self.open(device);
        }
        self.settle();
        let standing = |bench: &Self| {
            let states = bench.engine.devices().iter().flat_map(|device| device.axis_states());
            states
                .into_iter()
                .all(|(_, state)| state != AxisState::Initializing && state != AxisState::PreCharge)
        };
        self.run_while(PERIODS_MAX, |bench| !standing(bench));
        self.said.clear();
    }

    /// Lets what was asked for be taken on every side.
    fn settle(&mut self) {
        let period = self.controllers.iter().map(|controller| controller.period).max();
        self.run_until(self.now + period.unwrap_or(DurationNs::from_millis(1)) * 2);
    }

    /// What was said before has to be forgotten.
    pub fn note_use(&mut self) {
        self.used = true;
    }

    /// Tells the ports where the values of each axis are.
    fn learn(&mut self, axes: &[StageAxis]) {
        for (number, axis) in axes.iter().enumerate() {
            self.members[number].kind = match &axis.behind {
                Behind::Devicenet(drive) if drive.is_motion() => Kind::Update,
                Behind::Devicenet(_) => Kind::Assembly,
                Behind::Sercos(_) | Behind::Can(_) => Kind::Values,
            };
        }
        let master = self.engine.sercos().map(|bus| bus.master());
        let topology = |index: usize| u16::try_from(index + 1).unwrap_or(u16::MAX);
        let layout = master.map(|master| master.layout().to_wire(topology));
        for (place, tap) in self.taps.iter_mut().enumerate() {
            let own = axes.iter().enumerate().filter(|(number, _)| self.members[*number].bus == place);
            match tap {
                Tap::Sercos(tap) => {
                    let drives = own.filter_map(|(number, axis)| Some((number, axis.sercos()?)));
                    let drives = drives
                        .map(|(number, drive)| (number, usize::from(drive.topology) - 1, drive.topology));
                    tap.learn(layout.as_ref().unwrap_or(&Default::default()), drives);
                }
                Tap::Can(tap) => tap.learn(own.filter_map(|(number, axis)| {
                    let telegram = &axis.south.telegram;
                    let lengths = [telegram.command_bytes, telegram.feedback_bytes].map(usize::from);
                    Some((number, axis.can()?, lengths))
                })),
                Tap::Devicenet(tap) => tap.learn(own.filter_map(|(number, axis)| {
                    let drive = axis.devicenet()?;
                    Some((number, drive.mac, drive.is_motion(), drive.end.lengths()))
                })),
            }
        }
    }

    fn request(&mut self, device: usize, request: MotionRequest) {
        // The queue is empty: every request was answered.
        let _ = self.links[device].request(request);
        while self.links[device].reply().is_some() {}
    }

    fn open(&mut self, device: usize) {
        // An update goes out when the work for a cycle of the bus begins, as that of a controller with the same clock.
        let bus = self.controllers[device].axes.first().map_or(0, |axis| self.engine.buses().of(*axis));
        self.run_while(PERIODS_MAX, |bench| bench.engine.buses().get(bus).next_cycle().is_none());
        let bus = self.engine.buses().get(bus);
        let lead = self.lead_of(bus.cycle_time());
        let first = bus.next_cycle().map_or(self.now, |at| at + bus.cycle_time() - lead);
        let request = self.controllers[device].open(first);
        self.request(device, request);
        if self.controllers[device].format == Format::Fixed {
            self.explicit(device, SET_ATTRIBUTE_SINGLE, 1, id::CONTROL_STATUS, &[1]);
        }
        // The drives are asked for nothing else any more when the first line comes.
        self.run_while(READS_PERIODS_MAX, |bench| bench.engine.devices()[device].is_reading());
    }

    fn lead_of(&self, cycle: DurationNs) -> DurationNs {
        self.lead.min(DurationNs(cycle.as_nanos() / 10))
    }

    /// Calls the engine while something stands, for so many update periods at most.
    fn run_while(&mut self, periods: i64, stands: impl Fn(&Self) -> bool) {
        let period = self.controllers.iter().map(|controller| controller.period).max();
        let end = self.now + period.unwrap_or(DurationNs::from_millis(1)) * periods;
        while self.now < end && stands(self) {
            self.call();
        }
    }

    /// The answer to an explicit message; `None` where none comes.
    fn explicit(
        &mut self,
        device: usize,
        service: u8,
        instance: usize,
        attribute: u16,
        data: &[u8],
    ) -> Option<ExplicitReply> {
        let (token, request) = self.controllers[device].explicit(service, instance, attribute, data);
        self.request(device, request);
        let end = self.now + self.controllers[device].period * ANSWER_PERIODS_MAX;
        while self.now < end {
            self.call();
            if let Some(reply) = self.reply(device, token) {
                return Some(reply);
            }
        }
        None
    }

    fn reply(&mut self, device: usize, token: Token) -> Option<ExplicitReply> {
        std::iter::from_fn(|| self.links[device].reply()).find_map(|reply| match reply {
            MotionReply::Explicit(reply) if reply.token == token => Some(reply),
            _ => None,
        })
    }

    // ---- north ------------------------------------------------------------------------------------------------

    /// Hands the blocks of an update to a device; what each of these axes is told at the instant at which they count. Those in
    /// `other_feedback` get that Feedback Mode.
    pub fn update(
        &mut self,
        device: usize,
        update: Update<'_>,
        places: &[usize],
        other_feedback: &[(usize, FeedbackMode)],
    ) -> Vec<Told> {
        self.used = true;
        if !update.is_valid() {
            self.reconnect(device);
            return Vec::new();
        }
        let controller = &mut self.controllers[device];
        match update {
            Update::Variable(bytes) => controller.take(bytes),
            Update::Fixed(block, node_control) => {
                controller.tell(0, block);
                controller.commands = true;
                controller.node_control = node_control - NodeControl::SYNC_CONTROL;
            }
            Update::Block(place, block) => {
                controller.tell(place, block);
                (controller.commands, controller.node_control) = (true, controller::CONTROLS);
            }
        }
        for (place, feedback) in other_feedback {
            if let Some(said) = controller.said.get_mut(*place) {
                said.block.feedback_mode = *feedback;
            }
        }
        let axes: Vec<usize> =
            places.iter().filter_map(|place| controller.axes.get(*place).copied()).collect();
        let Some(sent) = controller.next else { return Vec::new() };
        if axes.is_empty() {
            self.run_for(device, 1);
            return Vec::new();
        }
        self.telegrams(device, &axes, sent)
    }

    /// As a connection begins; its updates go on as those of the bench.
    fn reconnect(&mut self, device: usize) {
        if self.controllers[device].commands {
            let request = self.controllers[device].close();
            self.request(device, request);
            self.settle();
            self.open(device);
            self.settle();
        }
    }

    /// What axes are told from an update on, until each has had the telegram of the instant at which the update counts.
    fn telegrams(&mut self, device: usize, axes: &[usize], sent: MonotonicTime) -> Vec<Told> {
        let period = self.controllers[device].period;
        let (counts, last) = (sent + period + self.lead, sent + period * TELEGRAM_PERIODS_MAX);
        let mut told: Vec<Told> = Vec::with_capacity(axes.len());
        let mut words: Vec<Option<Vec<u8>>> = Vec::with_capacity(axes.len());
        for axis in axes {
            let peer = &self.taps[self.members[*axis].bus].peers()[*axis];
            words.push(peer.told.as_ref().map(|(_, bytes)| head(bytes)));
            told.push(Told { before: Vec::new(), last: None, command: AxisCommand::default() });
        }
        while told.iter().any(|told| told.last.is_none()) && self.now < last {
            self.call();
            for ((told, words), axis) in told.iter_mut().zip(&mut words).zip(axes) {
                self.note_told(*axis, (sent, counts), told, words);
            }
        }
        for (told, axis) in told.iter_mut().zip(axes).filter(|(told, _)| told.last.is_none()) {
            told.command = *self.engine.axes()[*axis].command();
        }
        for told in &mut told {
            // What the last one says needs not be said twice.
            let last = told.last.as_ref().map(|last| head(&last.bytes));
            told.before.retain(|before| Some(head(&before.bytes)) != last);
        }
        told
    }

    /// Notes the newest telegram of an axis: the first one from `counts` on, or one before it with other words than the last.
    fn note_told(
        &mut self,
        axis: usize,
        (sent, counts): (MonotonicTime, MonotonicTime),
        told: &mut Told,
        words: &mut Option<Vec<u8>>,
    ) {
        let peer = &self.taps[self.members[axis].bus].peers()[axis];
        let Some((at, bytes)) = peer.told.as_ref().filter(|(at, _)| *at >= sent) else { return };
        if told.last.is_some() {
            return;
        }
        let channel = &self.engine.axes()[axis];
        let telegram = || Telegram {
            bytes: bytes.clone(),
            command: *channel.command(),
            action: channel.action(),
            shown: peer.shown.clone(),
        };
        if *at >= counts {
            told.command = *channel.command();
            told.last = Some(telegram());
        } else if words.as_ref().is_none_or(|words| *words != head(bytes)) {
            *words = Some(head(bytes));
            told.before.push(telegram());
        }
    }

    /// What the drive of an axis shows.
    fn shown(&mut self, axis: usize) -> &[u8] {
        &self.taps[self.members[axis].bus].peers()[axis].shown
    }

    /// Whether no frame has said anything of the drive of an axis.
    pub fn is_unheard(&self, axis: usize) -> bool {
        !self.members[axis].heard
    }

    /// Brings an axis to Running in a mode of its drive, whatever it does now.
    pub fn enable(&mut self, axis: usize, control_mode: ControlMode) {
        let Member { device, place, moves, .. } = self.members[axis];
        let running = |bench: &Self| {
            let state = bench.engine.devices()[device].device().axis_state(place);
            state == Some(AxisState::Running) && bench.engine.axes()[axis].state() == DriveState::Operating
        };
        if !moves || running(self) && !self.is_faulted(axis) {
            return;
        }
        self.used = true;
        self.controllers[device].node_control = controller::CONTROLS;
        if self.is_faulted(axis) {
            self.reset(axis);
        }
        let block = self.standing(axis, control_mode);
        self.controllers[device].tell(place, block);
        self.run_for(device, 1);
        self.controllers[device].ask(place, AxisControl::ENABLE);
        self.run_while(PERIODS_MAX, |bench| !running(bench));
        self.controllers[device].ask(place, AxisControl::NONE);
        self.run_for(device, 2);
    }

    /// The Feedback Mode that an axis can be switched on with.
    pub fn feedback_mode(&self, axis: usize) -> FeedbackMode {
        self.members[axis].feedback
    }

    fn is_faulted(&self, axis: usize) -> bool {
        let Member { device, place, .. } = self.members[axis];
        let motion = self.engine.devices()[device].device();
        let faulted = matches!(motion.axis_state(place), Some(AxisState::Aborting | AxisState::MajorFaulted));
        motion.node_fault() != NodeFault::NONE || faulted || self.engine.axes()[axis].fault().is_some()
    }

    /// Resets node and axis.
    fn reset(&mut self, axis: usize) {
        let Member { device, place, .. } = self.members[axis];
        // What every axis of the device was told could be the reason.
        for other in 0..self.controllers[device].axes.len() {
            let number = self.controllers[device].axes[other];
            if !self.members[number].heard {
                let block = CommandBlock {
                    axis_control: AxisControl::NONE,
                    ..self.standing(number, ControlMode::POSITION)
                };
                self.controllers[device].tell(other, block);
            }
        }
        self.run_for(device, 1);
        self.controllers[device].node_control = controller::CONTROLS | NodeControl::FAULT_RESET;
        self.run_for(device, 2);
        self.controllers[device].node_control = controller::CONTROLS;
        let stops = |bench: &Self| {
            matches!(bench.engine.axes()[axis].state(), DriveState::FaultReaction | DriveState::Stopping)
        };
        self.run_while(PERIODS_MAX, stops);
        self.controllers[device].ask(place, AxisControl::FAULT_RESET);
        self.run_while(PERIODS_MAX, |bench| bench.is_faulted(axis));
        self.controllers[device].ask(place, AxisControl::NONE);
        self.run_for(device, 2);
    }

    /// A block that keeps an axis where it is, in a mode of its drive.
    pub fn standing(&self, axis: usize, control_mode: ControlMode) -> CommandBlock {
        let channel = &self.engine.axes()[axis];
        let north = self.engine.cip_program(axis);
        let mode = |code: ControlMode| {
            north.and_then(|north| north.mode(code.0)).filter(|mode| *mode != OperatingMode::None)
        };
        let has = |code: &ControlMode| {
            mode(*code).is_some_and(|mode| channel.south().is_some_and(|program| program.has_mode(mode)))
        };
        let codes = (0..16).map(ControlMode);
        let control_mode = Some(control_mode).filter(has).or_else(|| codes.into_iter().find(has));
        let here = channel.feedback().position.get();
        let counts = north.map_or(0, |north| north.counts(here).value);
        let [a, b, c, d, ..] = counts.to_le_bytes();
        let position = CommandPosition::Integer(i32::from_le_bytes([a, b, c, d]));
        let control_mode = control_mode.unwrap_or(ControlMode::POSITION);
        let values = match mode(control_mode) {
            Some(OperatingMode::Velocity) => {
                CommandValues { velocity: Some(0.0), ..CommandValues::default() }
            }
            Some(OperatingMode::Torque) => CommandValues { torque: Some(0.0), ..CommandValues::default() },
            _ => CommandValues { position: Some(position), ..CommandValues::default() },
        };
        CommandBlock { control_mode, feedback_mode: self.members[axis].feedback, values, ..at_rest() }
    }

    /// Lets so many updates of a device go by.
    fn run_for(&mut self, device: usize, updates: i64) {
        let period = self.controllers[device].period;
        // Up to the calls of the engine in which they are taken.
        let end = self.controllers[device]
            .next
            .map_or(self.now, |next| next + period * (updates - 1) + DurationNs(1));
        self.run_until(end);
    }

    /// Hands the block of one axis to its device, as an update that carries no other; what its drive is told at the instant at which
    /// it counts.
    pub fn command(&mut self, axis: usize, block: CommandBlock) -> Option<Told> {
        let Member { device, place, .. } = self.members[axis];
        self.update(device, Update::Block(place, block), &[place], &[]).pop()
    }

    /// The same with cyclic write data: these attributes have these values.
    pub fn command_with(
        &mut self,
        axis: usize,
        block: CommandBlock,
        attributes: &[u16],
        data: &[u8],
    ) -> Option<Told> {
        self.list_writes(axis, attributes)?;
        let Member { device, place, .. } = self.members[axis];
        let update = self.controllers[device].written(place, block, data);
        self.update(device, Update::Variable(&update), &[place], &[]).pop()
    }

    /// The controller agrees on a list of cyclic write data; what the device says of each attribute.
    pub fn list_writes(&mut self, axis: usize, attributes: &[u16]) -> Option<(u8, Vec<(u16, u8)>)> {
        self.used = true;
        let Member { device, place, .. } = self.members[axis];
        let number = u8::try_from(place + 1).unwrap_or(u8::MAX);
        let transaction = self.controllers[device].ask_writes(place, attributes);
        let end = self.now + self.controllers[device].period * ANSWER_PERIODS_MAX;
        let mut answer = None;
        while answer.is_none() && self.now < end {
            self.call();
            answer = self.with_update(device, |update| {
                let frame = ActualFrame::parse(update).ok()?;
                let instance = frame.instances().find(|instance| instance.number == number)?;
                let response = instance.service.filter(|response| response.transaction_id == transaction)?;
                let list = IdStatusList::parse(response.data).ok()?;
                let statuses = list.iter().map(|one| (one.id, one.status)).collect();
                Some((list.block_id, response.general_status, statuses))
            });
        }
        self.controllers[device].end_service();
        let (id, status, statuses) = answer?;
        if status == 0 {
            self.controllers[device].write_ids[place] = id;
        }
        Some((status, statuses))
    }

    /// Looks at the newest update of a device, behind its sequence count.
    fn with_update<T>(&self, device: usize, look: impl FnOnce(&[u8]) -> Option<T>) -> Option<T> {
        let datagram = Class1Datagram::parse(&self.wires[device].from_device).ok()?;
        look(datagram.data)
    }

    /// The newest update of the device of an axis, behind its sequence count.
    pub fn actual(&self, axis: usize) -> Vec<u8> {
        self.with_update(self.members[axis].device, |update| Some(update.to_vec())).unwrap_or_default()
    }

    /// Sets an attribute of an axis; the answer, and what was written into its drive.
    pub fn set(
        &mut self,
        axis: usize,
        attribute: u16,
        bytes: &[u8],
    ) -> (Option<ExplicitReply>, Vec<(Item, Vec<u8>)>) {
        self.used = true;
        let Member { device, place, bus, .. } = self.members[axis];
        self.taps[bus].peers()[axis].written.clear();
        let reply = self.explicit(device, SET_ATTRIBUTE_SINGLE, place + 1, attribute, bytes);
        (reply, std::mem::take(&mut self.taps[bus].peers()[axis].written))
    }

    /// Reads an attribute of an axis.
    pub fn get(&mut self, axis: usize, attribute: u16) -> Option<ExplicitReply> {
        self.used = true;
        let Member { device, place, .. } = self.members[axis];
        self.explicit(device, GET_ATTRIBUTE_SINGLE, place + 1, attribute, &[])
    }

    /// The controller of an axis sends no updates any more, and leaves its connection open; what the drive is told then.
    pub fn silence(&mut self, axis: usize) -> Option<Told> {
        self.used = true;
        let Member { device, bus, .. } = self.members[axis];
        self.controllers[device].next = None;
        self.run_until(self.now + self.controllers[device].period * SILENT_PERIODS);
        let peer = &self.taps[bus].peers()[axis];
        let (_, bytes) = peer.told.as_ref()?;
        let channel = &self.engine.axes()[axis];
        let last = Telegram {
            bytes: bytes.clone(),
            command: *channel.command(),
            action: channel.action(),
            shown: peer.shown.clone(),
        };
        Some(Told { before: Vec::new(), command: last.command, last: Some(last) })
    }

    // ---- south ------------------------------------------------------------------------------------------------

    /// The drive of an axis says this from now on. The axis is enabled before, where it comes with torque as the first thing.
    pub fn say(&mut self, axis: usize, bytes: &[u8], torque: Option<OperatingMode>) {
        self.used = true;
        if let Some(mode) = torque.filter(|_| self.is_unheard(axis)) {
            let north = self.engine.cip_program(axis);
            let code = (0..16).find(|code| north.and_then(|north| north.mode(*code)) == Some(mode));
            self.enable(axis, code.map_or(ControlMode::POSITION, ControlMode));
        }
        let member = &mut self.members[axis];
        member.heard = true;
        let peer = &mut self.taps[member.bus].peers()[axis];
        peer.shown.clear();
        peer.shown.extend_from_slice(bytes);
    }

    /// Lets the drive of an axis be heard for more than a cycle, so that the box can act on what it says, up to the update that tells
    /// of it.
    pub fn listen(&mut self, axis: usize) {
        let Member { device, bus, .. } = self.members[axis];
        let cycle = self.engine.buses().get(bus).cycle_time();
        self.run_until(self.now + cycle);
        self.run_for(device, 1);
    }

    /// Lets drives be heard once, up to the updates that report it.
    pub fn listen_once(&mut self, axes: impl Iterator<Item = usize>) {
        let mut devices: Vec<usize> = axes.map(|axis| self.members[axis].device).collect();
        devices.dedup();
        // What has come since the last updates were taken was said before.
        let updates = if self.aligned { 1 } else { 2 };
        devices.into_iter().for_each(|device| self.run_for(device, updates));
    }

    /// Lets the drive of an axis show that something is wrong, with a word that says what, until the box has read it. Gives back what the
    /// drive has shown before, if a frame has said it.
    pub fn diagnose(&mut self, axis: usize, item: Item, word: u32, stops: bool) -> Option<Vec<u8>> {
        self.used = true;
        let before = (!self.is_unheard(axis)).then(|| self.shown(axis).to_vec());
        self.hold(axis, item, i64::from(word), WORD_LEN);
        self.members[axis].heard = true;
        let (report, bits) = match stops {
            true => (Report::Faulted, StatusBits::empty()),
            false => (Report::Ready, StatusBits::WARNING),
        };
        self.pose(axis, report, bits);
        let device = self.members[axis].device;
        self.run_for(device, DIAGNOSIS_PERIODS);
        before
    }

    /// Nothing is wrong any more: the drive shows what it has shown before, or the box begins anew.
    pub fn recover(&mut self, axis: usize, before: Option<Vec<u8>>) {
        self.release();
        match before {
            Some(shown) => {
                self.say(axis, &shown, None);
                self.listen(axis);
            }
            None => {
                self.members[axis].heard = false;
                self.stand_in();
                self.run_for(self.members[axis].device, 1);
                if self.is_faulted(axis) {
                    self.reset(axis);
                }
            }
        }
    }

    /// The drive of an axis holds this in place of its own value, in so many bytes where it does not say itself.
    pub fn hold(&mut self, axis: usize, item: Item, value: i64, len: usize) {
        self.used = true;
        match (&mut self.taps[self.members[axis].bus], item) {
            (Tap::Sercos(tap), Item::Idn(idn)) => tap.hold(axis, idn, value),
            (Tap::Can(tap), Item::Object(object)) => {
                let bytes = value.to_le_bytes();
                tap.hold(axis, object, bytes.get(..len).unwrap_or(&bytes));
            }
            _ => {}
        }
    }

    /// What the drive of an axis holds, as commissioning and later writes have left it.
    pub fn kept(&mut self, axis: usize, item: Item) -> Option<i64> {
        match (&mut self.taps[self.members[axis].bus], item) {
            (Tap::Sercos(tap), Item::Idn(idn)) => tap.kept(axis, idn),
            (Tap::Can(tap), Item::Object(object)) => tap.kept(axis, object),
            _ => None,
        }
    }

    /// Drives hold what they have themselves.
    pub fn release(&mut self) {
        for tap in &mut self.taps {
            match tap {
                Tap::Sercos(tap) => tap.release(),
                Tap::Can(tap) => tap.release(),
                Tap::Devicenet(_) => {}
            }
        }
    }

    /// The state of an axis as the controller sees it, and that of its drive.
    pub fn state_of(&self, axis: usize) -> (Option<AxisState>, DriveState) {
        let Member { device, place, .. } = self.members[axis];
        (self.engine.devices()[device].device().axis_state(place), self.engine.axes()[axis].state())
    }
}

impl Update<'_> {
    /// Whether it has data.
    fn is_valid(&self) -> bool {
        let control = match self {
            Self::Variable(bytes) => CommandFrame::parse(bytes).map(|frame| frame.header().node_control),
            Self::Fixed(_, control) => Ok(*control),
            Self::Block(..) => Ok(controller::CONTROLS),
        };
        control.is_ok_and(|control| control.contains(NodeControl::DATA_VALID))
    }
}

/// The words of a telegram that say what a drive is to do.
fn head(bytes: &[u8]) -> Vec<u8> {
    bytes.get(..HEAD_LEN).unwrap_or(bytes).to_vec()
}

/// An update of a list.
#[derive(Debug, Clone, Copy)]
pub(super) enum Update<'u> {
    /// Of the variable format.
    Variable(&'u [u8]),
    /// Of the fixed one.
    Fixed(CommandBlock, NodeControl),
    /// The block of the axis at a place of the device, in the format of the device.
    Block(usize, CommandBlock),
}

/// The Feedback Mode that an axis can be switched on with.
fn feedback_mode(mapping: &Mapping, feedback: FeedbackUse) -> FeedbackMode {
    let modes = mapping.cip.feedback_modes(feedback);
    u8::try_from(modes.trailing_zeros()).ok().filter(|_| modes != 0).map_or(MOTOR_FEEDBACK, FeedbackMode)
}

/// The answer of a CIP Motion drive on DeviceNet that shows this, with the response to what it was told.
fn answer(row: &[u8], told: Option<&[u8]>) -> Vec<u8> {
    let asked = told.and_then(|told| told.get(AXIS_CONTROL_AT)).copied().unwrap_or_default();
    let valid = row[1] & motion::VALID != 0;
    let mut node_status = NodeStatus::REMOTE_MODE;
    node_status.set(NodeStatus::DATA_VALID, valid);
    let actual = FixedActual {
        node_status,
        axis_state: AxisStateCode(row[0]),
        control_mode: ControlMode(row[MODE_AT]),
        feedback_mode: MOTOR_FEEDBACK,
        axis_response: AxisControl(asked),
        actual: ActualValues { position: Some(ActualPosition::Dint(0)), ..ActualValues::default() },
        ..FixedActual::default()
    };
    let mut bytes = [0; profile_cip::wire::motion::fixed::LEN];
    let _ = actual.emit(&mut profile_cip::wire::Writer::new(&mut bytes));
    bytes.to_vec()
}
