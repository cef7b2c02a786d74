//! The device with everything explicit, its motion connection, and a controller with such a device.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::sync::LazyLock;

use axisbridge::config::Config;
use axisbridge::engine::build::adapter_config;
use axisbridge::mapping::{CipScaling, Mapping};
use profile_cip::controller::{
    AxisSet, AxisSetup, Controller, ControllerConfig, DATAGRAM_MAX, Limits, Step, StreamAction,
};
use profile_cip::device::AxisConfig;
use profile_cip::device::adapter::{Adapter, SessionSlot};
use profile_cip::device::attribute::AttributeDefinition;
use profile_cip::device::axis_state::{AxisState, ControlKind};
use profile_cip::device::drive_link::{Command, DriveAction, DriveImage};
use profile_cip::device::motion_device::{DeviceConfig, MotionDevice, SyncState};
use profile_cip::wire::class1::{CLASS1_HEADER_LEN, Class1Datagram, SEQUENCE_COUNT_LEN};
use profile_cip::wire::cpf::{CommonPacket, EncapsulatedPacket, Item, ItemType};
use profile_cip::wire::encapsulation::{self, EncapsulationStatus, HEADER_LEN, Header, Packet};
use profile_cip::wire::message_router::{Reply, Request};
use profile_cip::wire::motion::codes::{AxisControl, ControlMode, MotionService, NodeControl};
use profile_cip::wire::motion::{
    ActualFrame, CommandBlock, CommandHeader, CommandInstance, CommandPosition, CommandValues, CommandWriter,
    Format, ServiceRequest, run_idle,
};
use profile_cip::wire::status::Service;
use profile_generic::scaling::{NANO, UnitKind};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

use super::conversation::{BURST_MAX, Bytes, Disturber};
use crate::rig::{BOX, HOST};

const EPOCH: u64 = 1_700_000_000_000_000_000;
const GRANDMASTER: [u8; 8] = [1, 2, 3, 4, 5, 6, 7, 8];
const CONTROLLER: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 1), 50_000);
const IDENTITY: &[u8] = &[0x20, 1, 0x24, 1];
const MANAGER: &[u8] = &[0x20, 6, 0x24, 1];
/// The longest D-to-C update with its sequence count.
const UPDATE_MAX: usize = 1_500;

static CONFIG: LazyLock<Config> =
    LazyLock::new(|| Config::parse(BOX, "box.toml").expect("the configuration is sound"));

static ATTRIBUTES: LazyLock<Vec<AttributeDefinition>> = LazyLock::new(|| {
    let scaling = CipScaling {
        kind: UnitKind::Rotary,
        nanounits_per_unit: NANO,
        counts_per_unit: 1_000_000,
        inverted: false,
        unwind: None,
    };
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    mapping.attribute_definitions(&scaling).expect("definitions of the shipped tables")
});

/// A device of two axes, with drives that obey after one call.
struct Device {
    adapter: Adapter,
    motion: MotionDevice,
    drives: [DriveImage; 2],
    now: MonotonicTime,
    sequence: u32,
}

impl Device {
    fn new() -> Self {
        let config = adapter_config(&CONFIG, 0, HOST).expect("one device");
        let axis = AxisConfig {
            kind: ControlKind::Active,
            control_modes: 1 << 1 | 1 << 2 | 1 << 4,
            feedback_modes: 0b1101,
            lint_position: true,
            hookup_tests: 0b11,
        };
        let mut motion = MotionDevice::new(DeviceConfig {
            format: Format::Variable,
            axes: vec![axis; 2],
            attributes: ATTRIBUTES.clone(),
            power_structure_class_id: 0,
            supports_sync: true,
            sync_threshold: None,
            transmission_processing_ns: 100_000,
        })
        .expect("a device");
        motion.set_sync(SyncState { grandmaster: Some(GRANDMASTER), synchronized: true, offset: 0 });
        let drive = DriveImage {
            online: true,
            bus_up: true,
            velocity: Some(0.0),
            acceleration: Some(0.0),
            ..DriveImage::default()
        };
        Self {
            adapter: Adapter::new(config).expect("the adapter's configuration is sound"),
            motion,
            drives: [drive; 2],
            now: MonotonicTime(1_000_000_000),
            sequence: 0,
        }
    }

    fn system(&self) -> SystemTime {
        SystemTime(EPOCH + self.now.0)
    }

    /// Requests go to the motion device and their answers back.
    fn settle(&mut self) {
        let (now, system) = (self.now, self.system());
        while let Some(request) = self.adapter.poll_motion() {
            self.motion.request(now, Some(system), request);
            self.answer(now);
        }
        while let Some(access) = self.motion.poll_attribute_access() {
            self.motion.complete_attribute(access.ticket, Ok(&[0; 4]));
        }
        self.answer(now);
        while self.adapter.poll_event().is_some() {}
    }

    fn answer(&mut self, now: MonotonicTime) {
        while let Some(reply) = self.motion.poll_reply() {
            self.adapter.complete(now, &reply);
        }
    }

    /// The drives do what they are told, and nothing that was not commanded.
    fn drive(&mut self) {
        for axis in 0..self.drives.len() {
            let command = self.motion.command(axis, self.now).expect("an axis");
            if let Command::Follow(set_points) = command.command {
                assert_eq!((command.state, command.action), (AxisState::Running, DriveAction::Enable));
                assert!(self.motion.connection().is_some());
                assert!(set_points.values.is_finite(), "{set_points:?}");
                assert!(set_points.age_updates <= u32::from(u8::MAX), "{set_points:?}");
            }
            let image = &mut self.drives[axis];
            image.reset_id = command.reset_id;
            let obeyed = command.action_id == image.action_id;
            let on = matches!(command.action, DriveAction::Enable | DriveAction::Test);
            image.action_id = command.action_id;
            image.power_enabled = obeyed && on;
            image.start_complete = obeyed && on;
            image.tracking = obeyed && command.action == DriveAction::Enable;
            image.stop_complete = obeyed && !on;
            let image = *image;
            self.motion.set_drive(axis, image);
        }
    }

    /// Lets the device act; the D-to-C datagram, if one is due. What is sent can be read.
    fn act(&mut self) -> Option<Vec<u8>> {
        self.settle();
        self.drive();
        let (now, system) = (self.now, self.system());
        if self.adapter.wake_at().is_some_and(|at| at <= now) {
            self.adapter.handle_time(now);
        }
        const HEAD: usize = CLASS1_HEADER_LEN - SEQUENCE_COUNT_LEN;
        let mut buffer = [0xA5; HEAD + UPDATE_MAX];
        let len = self.motion.poll_transmit(now, Some(system), &mut buffer[HEAD..])?;
        let connection = self.motion.connection()?;
        assert!(len <= usize::from(connection.t_to_o_size), "{len}");
        let (update, revision) = (&buffer[HEAD + SEQUENCE_COUNT_LEN..HEAD + len], connection.format_revision);
        let (run, update) =
            run_idle::split(revision, update).expect("a run/idle header, where one is agreed on");
        assert!(run, "the device sends no idle");
        ActualFrame::parse_as(update, revision).expect("what the device sends");
        self.sequence += 1;
        let count = u16::from_le_bytes([buffer[HEAD], buffer[HEAD + 1]]);
        Class1Datagram::emit_header(
            connection.t_to_o_id,
            self.sequence,
            count,
            len - SEQUENCE_COUNT_LEN,
            &mut buffer,
        )
        .expect("room for a header");
        self.settle();
        Some(buffer[..HEAD + len].to_vec())
    }

    /// Takes a datagram on the I/O port.
    fn datagram(&mut self, bytes: &[u8]) {
        let Some(connection) = self.motion.connection() else { return };
        let (now, system) = (self.now, self.system());
        if Class1Datagram::parse(bytes).is_ok_and(|datagram| datagram.connection_id == connection.o_to_t_id) {
            self.motion.handle_io(now, Some(system), &bytes[CLASS1_HEADER_LEN - SEQUENCE_COUNT_LEN..]);
        }
    }

    /// Sends bytes on a stream; everything that comes back, in whole packets.
    fn stream(&mut self, slot: SessionSlot, mut bytes: &[u8]) -> Vec<u8> {
        let (mut answer, mut chunk) = (Vec::new(), [0; 512]);
        for _ in 0..BURST_MAX {
            let taken = self.adapter.handle_stream(self.now, slot, bytes);
            bytes = &bytes[taken..];
            self.settle();
            let sent = self.adapter.poll_transmit(self.now, slot, &mut chunk);
            answer.extend_from_slice(&chunk[..sent]);
            if taken == 0 && sent == 0 {
                break;
            }
        }
        let mut rest = answer.as_slice();
        while let Ok(header) = Header::parse(rest) {
            rest = rest.get(HEADER_LEN + usize::from(header.length)..).expect("a whole packet");
        }
        assert!(rest.is_empty(), "{rest:02x?}");
        answer
    }

    /// A stream with a session of its own, if there is room for one more.
    fn client(&mut self, from: SocketAddrV4) -> Option<(SessionSlot, u32)> {
        let slot = self.adapter.open(self.now, from).ok()?;
        let answer = self.stream(slot, &packet(encapsulation::Command::REGISTER_SESSION, 0, &[1, 0, 0, 0]));
        let header = Header::parse(&answer).expect("an answer");
        assert_eq!(header.status, EncapsulationStatus::SUCCESS);
        Some((slot, header.session_handle))
    }
}

fn packet(command: encapsulation::Command, session_handle: u32, data: &[u8]) -> Vec<u8> {
    let status = EncapsulationStatus::SUCCESS;
    let packet = Packet { command, session_handle, status, sender_context: *b"the fuzz", options: 0, data };
    let mut bytes = vec![0; packet.buffer_len()];
    packet.emit(&mut bytes).expect("short enough");
    bytes
}

fn items(items: &[Item<'_>]) -> Vec<u8> {
    let body = EncapsulatedPacket { packet: CommonPacket::new(items), ..EncapsulatedPacket::default() };
    let mut bytes = vec![0; body.buffer_len()];
    body.emit(&mut bytes).expect("short enough");
    bytes
}

fn unconnected(message: &[u8]) -> Vec<u8> {
    items(&[
        Item { item_type: ItemType::NULL_ADDRESS, data: &[] },
        Item { item_type: ItemType::UNCONNECTED_DATA, data: message },
    ])
}

/// Strangers and their streams. A byte says what comes: a whole request without connection, one with path and service, one on a
/// connection, an encapsulation packet, raw bytes, a datagram, time, or the end of a stream. Afterwards a new client is served.
pub fn adapter(data: &[u8]) {
    let (mut device, mut bytes) = (Device::new(), Bytes::new(data));
    let mut clients = [None; 3];
    while !bytes.is_over() {
        let head = bytes.byte();
        let place = usize::from(head >> 4) % clients.len();
        if clients[place].is_none_or(|(slot, _)| device.adapter.is_done(slot)) {
            if let Some((slot, _)) = clients[place] {
                device.adapter.close(slot);
            }
            let from = SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 20 + head / 16), 50_000);
            clients[place] = device.client(from);
        }
        let Some((slot, handle)) = clients[place] else { continue };
        let request = match head & 7 {
            0 => packet(encapsulation::Command::SEND_RR_DATA, handle, &unconnected(bytes.block())),
            1 => {
                let (service, path) = (Service(bytes.byte()), [0x20, bytes.byte(), 0x24, bytes.byte()]);
                let request = Request { service, path: &path, data: bytes.block() };
                let mut message = vec![0; request.buffer_len()];
                request.emit(&mut message).expect("short enough");
                packet(encapsulation::Command::SEND_RR_DATA, handle, &unconnected(&message))
            }
            2 => {
                let address = bytes.array::<4>();
                let connected = [
                    Item { item_type: ItemType::CONNECTED_ADDRESS, data: &address },
                    Item { item_type: ItemType::CONNECTED_DATA, data: bytes.block() },
                ];
                packet(encapsulation::Command::SEND_UNIT_DATA, handle, &items(&connected))
            }
            3 => packet(encapsulation::Command(bytes.word()), handle, bytes.block()),
            4 => bytes.block().to_vec(),
            5 => {
                let mut out = [0; 1_024];
                let sent = device.adapter.handle_datagram(bytes.block(), &mut out);
                assert!(sent.is_none_or(|len| Header::parse(&out[..len]).is_ok()));
                continue;
            }
            6 => {
                device.now = device.now + DurationNs::from_millis(i64::from(bytes.word()));
                device.act();
                continue;
            }
            _ => {
                device.adapter.close(slot);
                clients[place] = None;
                continue;
            }
        };
        let answer = device.stream(slot, &request);
        assert!(answer.len() < 1 << 17, "{} bytes for {}", answer.len(), request.len());
        device.act();
    }
    for (slot, _) in clients.into_iter().flatten() {
        device.adapter.close(slot);
    }
    let (slot, handle) = device.client(CONTROLLER).expect("room for a client");
    let path = [IDENTITY, &[0x30, 7]].concat();
    let request = Request { service: Service::GET_ATTRIBUTE_SINGLE, path: &path, data: &[] };
    let mut message = vec![0; request.buffer_len()];
    request.emit(&mut message).expect("short enough");
    let answer =
        device.stream(slot, &packet(encapsulation::Command::SEND_RR_DATA, handle, &unconnected(&message)));
    let body = EncapsulatedPacket::parse(&answer[HEADER_LEN..]).expect("an answer");
    let reply = Reply::parse(body.packet.items[1].data).expect("a reply");
    assert_eq!(reply.status.0, 0, "the product name");
}

/// Connection of a controller for both axes.
fn open() -> Vec<u8> {
    use profile_cip::wire::ConnectionTriad;
    use profile_cip::wire::forward_open::{ForwardOpen, Transport, Trigger};
    use profile_cip::wire::network_parameters::{ConnectionType, NetworkParameters, Priority};
    let direction = NetworkParameters {
        redundant_owner: false,
        connection_type: ConnectionType::POINT_TO_POINT,
        priority: Priority::URGENT,
        variable: true,
        size: 500,
    };
    let open = ForwardOpen {
        large: false,
        priority_tick: 5,
        timeout_ticks: 157,
        o_to_t_id: 0,
        t_to_o_id: 0x5500_0001,
        triad: ConnectionTriad { connection_serial: 77, originator_vendor: 1, originator_serial: 0xCAFE },
        timeout_multiplier: 3,
        o_to_t_rpi_us: PERIOD_US,
        o_to_t: direction,
        t_to_o_rpi_us: PERIOD_US,
        t_to_o: direction,
        transport: Transport { server: false, trigger: Trigger::CYCLIC, class: 1 },
        path: &[0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 4, 1, 0, 0, 0, 0, 0, 0, 0],
    };
    let mut data = vec![0; open.buffer_len()];
    open.emit(&mut data).expect("short enough");
    let request = Request { service: open.service(), path: MANAGER, data: &data };
    let mut message = vec![0; request.buffer_len()];
    request.emit(&mut message).expect("short enough");
    message
}

const PERIOD_US: u32 = 4_000;
const PERIOD: DurationNs = DurationNs(4_000_000);

/// Updates on a motion connection, each with what a byte says: good, with another control word, with changed octets, with a
/// service, cut, or none at all. Silence ends every motion.
pub fn motion_device(data: &[u8]) {
    let (mut device, mut bytes) = (Device::new(), Bytes::new(data));
    let (slot, handle) = device.client(CONTROLLER).expect("room for a client");
    let open = packet(encapsulation::Command::SEND_RR_DATA, handle, &unconnected(&open()));
    let connect = |device: &mut Device| {
        if device.motion.connection().is_none() {
            device.stream(slot, &open);
        }
    };
    connect(&mut device);
    assert!(device.motion.connection().is_some(), "a good Forward_Open");
    let (mut sequence, mut update_id) = (0_u16, 0_u8);
    let mut controls = [AxisControl::NONE; 2];
    let mut mode = ControlMode::POSITION;
    while !bytes.is_over() {
        let act = bytes.byte();
        if act & 0xF0 == 0xF0 {
            for _ in 0..=act & 0x0F {
                device.now = device.now + PERIOD;
                device.act();
            }
            connect(&mut device);
            continue;
        }
        sequence = sequence.wrapping_add(1);
        update_id = update_id.wrapping_add(1);
        let header = CommandHeader {
            update_id,
            node_control: NodeControl::REMOTE_CONTROL | NodeControl::DATA_VALID,
            instance_count: 0,
            last_received_id: 0,
            time_stamp: None,
            time_offset: None,
            diagnostics: Default::default(),
        };
        if act & 1 != 0 {
            controls[usize::from(act >> 7)] = AxisControl(bytes.byte());
        }
        if act & 8 != 0 {
            mode = ControlMode(bytes.byte() % 6);
        }
        let service = (act & 2 != 0).then(|| (bytes.byte(), MotionService(bytes.byte()), bytes.block()));
        let values = match mode {
            ControlMode::VELOCITY => CommandValues { velocity: Some(1.0), ..CommandValues::default() },
            ControlMode::TORQUE => CommandValues { torque: Some(1.0), ..CommandValues::default() },
            _ => CommandValues { position: Some(CommandPosition::Float(0.0)), ..CommandValues::default() },
        };
        let mut buffer = vec![0xA5; 2_000];
        let mut writer = CommandWriter::new(&mut buffer, &header).expect("room");
        for (number, axis_control) in (1..).zip(controls) {
            let service = service.filter(|_| number == 1 + (act >> 6 & 1));
            let block = CommandBlock { control_mode: mode, axis_control, values, ..CommandBlock::default() };
            let padded = service
                .map(|(_, _, body)| [body, &[0; 3][..body.len().next_multiple_of(4) - body.len()]].concat());
            let service = service
                .zip(padded.as_deref())
                .map(|((transaction_id, service, _), data)| ServiceRequest { transaction_id, service, data });
            let instance =
                CommandInstance { number, cyclic: Some(block), service, ..CommandInstance::default() };
            writer.instance(&instance).expect("room");
        }
        let len = writer.finish();
        let mut update = [&sequence.to_le_bytes()[..], &buffer[..len]].concat();
        if act & 4 != 0 {
            for _ in 0..=bytes.byte() & 3 {
                let at = usize::from(bytes.byte()) % update.len();
                update[at] = bytes.byte();
            }
        }
        if act & 16 != 0 {
            update.truncate(usize::from(bytes.byte()));
        }
        if act & 32 != 0 {
            update = [&sequence.to_le_bytes()[..], bytes.block()].concat();
        }
        device.now = device.now + PERIOD;
        let (now, system) = (device.now, device.system());
        device.motion.handle_io(now, Some(system), &update);
        device.act();
        connect(&mut device);
    }
    for _ in 0..400 {
        device.now = device.now + PERIOD;
        device.act();
    }
    for axis in 0..device.drives.len() {
        let command = device.motion.command(axis, device.now).expect("an axis");
        assert!(!matches!(command.command, Command::Follow(_)), "{command:?}");
        assert!(!matches!(command.action, DriveAction::Enable | DriveAction::Test), "{command:?}");
    }
}

/// A controller with a good device, whose answers and updates are disturbed. It comes to an end, and the axes are left disabled.
pub fn controller(data: &[u8]) {
    let mut device = Device::new();
    let axes = vec![AxisSetup::position(1_000_000.0); 2];
    let config = ControllerConfig { rpi_us: PERIOD_US, ..ControllerConfig::new(Some(GRANDMASTER), axes) };
    let both = AxisSet::first(2);
    let limits = Limits { velocity: 5.0, acceleration: 50.0, jerk: 1_000.0 };
    let program =
        vec![Step::Enable(both), Step::MoveRelative { axis: 1, distance: 0.1, limits }, Step::Disable(both)];
    let mut controller = Controller::new(config, program).expect("a sound configuration");
    let mut said = Disturber::new(data);
    let mut slot = device.adapter.open(device.now, CONTROLLER).ok();
    controller.tcp_connected(device.now);
    let mut buffer = vec![0; DATAGRAM_MAX.max(4_096)];
    let began = device.now;
    while !controller.is_closed() {
        let (now, system) = (device.now, device.system());
        controller.handle_time(now, system);
        for _ in 0..BURST_MAX {
            let mut moved = false;
            while let Some(len) = controller.poll_stream_transmit(&mut buffer) {
                moved = true;
                let Some(slot) = slot else { continue };
                let answer = device.stream(slot, &buffer[..len]);
                if !answer.is_empty() {
                    said.carry(&answer, &mut |answer| controller.handle_stream(now, answer));
                }
            }
            while let Some(len) = controller.poll_datagram_transmit(&mut buffer) {
                moved = true;
                device.datagram(&buffer[..len]);
            }
            while controller.poll_event().is_some() {}
            if let Some(action) = controller.poll_stream_action() {
                if let Some(slot) = slot.take() {
                    device.adapter.close(slot);
                }
                if action == StreamAction::Reopen {
                    slot = device.adapter.open(now, CONTROLLER).ok();
                    controller.tcp_connected(now);
                }
            }
            if !moved {
                break;
            }
        }
        if let Some(datagram) = device.act() {
            said.carry(&datagram, &mut |datagram| controller.handle_datagram(now, system, datagram));
        }
        let lasted = device.now.since(began);
        assert!(
            lasted < DurationNs::from_secs(300),
            "the controller does not end: {:?}",
            controller.report()
        );
        device.now = device.now + DurationNs(1_000_000);
    }
    for _ in 0..400 {
        device.now = device.now + PERIOD;
        device.act();
    }
    for axis in 0..device.drives.len() {
        let command = device.motion.command(axis, device.now).expect("an axis");
        assert!(!matches!(command.command, Command::Follow(_)), "{command:?}");
        assert!(!matches!(command.action, DriveAction::Enable | DriveAction::Test), "{command:?}");
    }
}
