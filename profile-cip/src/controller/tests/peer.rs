//! A device for the tests: it answers as the tests want, and its axes follow their commands exactly.

use std::collections::{BTreeMap, VecDeque};

use super::rig::{COUNTS_PER_UNIT, seconds};
use crate::wire::ConnectionTriad;
use crate::wire::class1::Class1Datagram;
use crate::wire::cpf::{CommonPacket, EncapsulatedPacket, Item, ItemType};
use crate::wire::encapsulation::{Command, EncapsulationStatus, Packet};
use crate::wire::forward_close::{ForwardClose, ForwardCloseReply};
use crate::wire::forward_open::{ForwardOpen, ForwardOpenReply};
use crate::wire::message_router::{Reply, Request};
use crate::wire::motion::attribute_list::{GetRequest, ListWriter, SetRequest, SetStatus};
use crate::wire::motion::codes::{
    AlarmType, AxisControl, AxisStateCode, AxisStatus, ControlMode, ControlStatus, FaultType, MotionService,
    NodeAlarm, NodeControl, NodeFault, NodeStatus, SyncStatus,
};
use crate::wire::motion::{
    ActualBlock, ActualHeader, ActualInstance, ActualPosition, ActualValues, ActualWriter, AlarmRecord,
    CommandBlock, CommandFrame, FaultRecord, ServiceResponse, StatusValues, UpdateDiagnostics,
};
use crate::wire::status::{GeneralStatus, Service};

pub const SESSION: u32 = 0x1234_5678;
pub const O_TO_T_ID: u32 = 0xAAAA_0001;

/// One axis of the device.
#[derive(Debug, Clone)]
pub struct PeerAxis {
    pub state: AxisStateCode,
    /// Response Status to Enable; other than 0 is a refusal.
    pub enable_status: u8,
    /// Whether Enable is never acknowledged.
    pub enable_hangs: bool,
    pub fault: Option<FaultRecord>,
    pub alarm: Option<AlarmRecord>,
    pub attributes: BTreeMap<u16, Vec<u8>>,
    /// Position in counts.
    pub position: f64,
    /// Velocity in units/s, in velocity control.
    velocity: f64,
    /// Commands that apply later: instant in ns, position.
    path: VecDeque<(u64, f64)>,
    last: (u64, f64),
    updates_in_state: u32,
    pub response: AxisControl,
    status: u8,
    pub control_mode: ControlMode,
    /// Every command received while Running: target instant, command.
    pub commands: Vec<(u64, CommandBlock)>,
}

impl PeerAxis {
    fn new(position: f64) -> Self {
        Self {
            state: AxisStateCode::INITIALIZING,
            enable_status: 0,
            enable_hangs: false,
            fault: None,
            alarm: None,
            attributes: BTreeMap::new(),
            position,
            velocity: 0.0,
            path: VecDeque::new(),
            last: (0, position),
            updates_in_state: 0,
            response: AxisControl::NONE,
            status: 0,
            control_mode: ControlMode::POSITION,
            commands: Vec::new(),
        }
    }

    fn go(&mut self, state: AxisStateCode) {
        self.state = state;
        self.updates_in_state = 0;
    }

    /// Moves the plant to `now`.
    fn advance(&mut self, from: u64, now: u64) {
        if self.state != AxisStateCode::RUNNING {
            self.path.clear();
            self.last = (now, self.position);
            return;
        }
        if self.control_mode == ControlMode::VELOCITY {
            let units = self.velocity * seconds(now.saturating_sub(from));
            self.position += units * COUNTS_PER_UNIT;
            self.path.clear();
            self.last = (now, self.position);
            return;
        }
        while let Some(&(at, position)) = self.path.front() {
            if at > now {
                break;
            }
            self.last = (at, position);
            self.path.pop_front();
        }
        self.position = self.last.1;
        if let Some(&(at, position)) = self.path.front() {
            let whole = seconds(at - self.last.0);
            let part = seconds(now.saturating_sub(self.last.0));
            self.position += (position - self.last.1) * part / whole;
        }
    }

    fn take(&mut self, block: &CommandBlock, at: u64) {
        use AxisStateCode as S;
        if self.state == S::RUNNING {
            self.commands.push((at, *block));
            self.control_mode = block.control_mode;
            if let Some(position) = block.values.position {
                self.path.push_back((at, position.as_f64()));
            }
            self.velocity = f64::from(block.values.velocity.unwrap_or(0.0));
        }
        self.updates_in_state += 1;
        let configured = block.control_status.contains(ControlStatus::CONFIGURATION_COMPLETE);
        match self.state {
            S::INITIALIZING if configured => self.go(S::PRE_CHARGE),
            S::PRE_CHARGE => self.go(S::STOPPED),
            S::STARTING if self.updates_in_state > 3 => self.go(S::RUNNING),
            S::STOPPING if self.updates_in_state > 2 => self.go(S::STOPPED),
            _ => {}
        }
        self.request(block.axis_control);
    }

    fn request(&mut self, request: AxisControl) {
        use AxisStateCode as S;
        let done = |axis: &mut Self, status| (axis.response, axis.status) = (request, status);
        match request {
            AxisControl::NONE => (self.response, self.status) = (AxisControl::NONE, 0),
            code if code == self.response => {}
            AxisControl::ENABLE if self.enable_hangs => {}
            AxisControl::ENABLE if self.enable_status != 0 => {
                if self.enable_status == 0x10 {
                    self.go(S::START_INHIBITED);
                }
                done(self, self.enable_status);
            }
            AxisControl::ENABLE => match self.state {
                S::STOPPED => self.go(S::STARTING),
                S::STARTING => {}
                S::RUNNING => done(self, 0),
                _ => done(self, 0x0C),
            },
            AxisControl::DISABLE => match self.state {
                S::RUNNING | S::STARTING => self.go(S::STOPPING),
                S::STOPPING => {}
                _ => done(self, 0),
            },
            AxisControl::SHUTDOWN => {
                self.go(S::SHUTDOWN);
                done(self, 0);
            }
            AxisControl::SHUTDOWN_RESET | AxisControl::FAULT_RESET => {
                if self.state == S::SHUTDOWN || self.state == S::MAJOR_FAULTED {
                    self.go(S::STOPPED);
                    self.fault = Some(FaultRecord {
                        fault_type: FaultType::CLEARED,
                        code: 2,
                        ..FaultRecord::default()
                    });
                }
                done(self, 0);
            }
            _ => done(self, 0),
        }
    }

    /// An axis fault: the axis stops at once.
    pub fn fail(&mut self, code: u8, time_stamp: u64) {
        self.fault =
            Some(FaultRecord { fault_type: FaultType::AXIS, code, sub_code: 1, action: 0x11, time_stamp });
        self.alarm =
            Some(AlarmRecord { alarm_type: AlarmType::AXIS, code, state: 1, ..AlarmRecord::default() });
        self.go(AxisStateCode::MAJOR_FAULTED);
    }

    fn block(&self) -> ActualBlock {
        let tracking = if self.state == AxisStateCode::RUNNING {
            AxisStatus::TRACKING_COMMAND | AxisStatus::POWER_STRUCTURE_ENABLED
        } else {
            AxisStatus::empty()
        };
        let counts = crate::controller::number::counts(self.position);
        ActualBlock {
            control_mode: self.control_mode,
            axis_response: self.response,
            response_status: self.status,
            axis_state: self.state,
            actual: ActualValues {
                position: Some(ActualPosition::Dint(crate::controller::number::roll(counts))),
                velocity: Some(0.0),
                ..ActualValues::default()
            },
            status: StatusValues {
                fault: self.fault,
                alarm: self.alarm,
                axis_status: Some((tracking, 0)),
                ..StatusValues::default()
            },
            ..ActualBlock::default()
        }
    }
}

/// The device.
#[derive(Debug)]
pub struct Peer {
    pub axes: Vec<PeerAxis>,
    /// Refusal of the Forward_Open: general status and extended words.
    pub refuse_open: Option<(u8, Vec<u16>)>,
    /// Added to the packet intervals granted.
    pub api_offset_us: u32,
    /// Refused attributes: instance, ID, general status.
    pub refuse_attributes: Vec<(u8, u16, u8)>,
    /// Answers to Group_Sync before success.
    pub sync_answers: VecDeque<SyncStatus>,
    /// Whether Sync Mode ever comes on.
    pub sync_mode: bool,
    /// Answers nothing any more.
    pub dead: bool,
    /// It answers nothing on the stream.
    pub mute: bool,
    pub node_fault: NodeFault,
    pub node_alarm: NodeAlarm,
    /// Requests seen on the stream, in order.
    pub seen: Vec<String>,
    /// Attributes written, in order: instance, ID, value.
    pub written: Vec<(u8, u16, Vec<u8>)>,
    /// Connection path of the Forward_Open.
    pub path: Vec<u8>,
    /// C-to-D updates: their bytes behind the sequence count.
    pub updates: Vec<Vec<u8>>,
    pub open: bool,
    t_to_o_id: u32,
    period_ns: u64,
    sequence: u32,
    count: u16,
    last_update: Option<u8>,
    lost: u8,
    now: u64,
}

impl Peer {
    pub fn new(positions: &[f64]) -> Self {
        Self {
            axes: positions.iter().map(|p| PeerAxis::new(*p)).collect(),
            refuse_open: None,
            api_offset_us: 0,
            refuse_attributes: Vec::new(),
            sync_answers: VecDeque::new(),
            sync_mode: true,
            dead: false,
            mute: false,
            node_fault: NodeFault::NONE,
            node_alarm: NodeAlarm::NONE,
            seen: Vec::new(),
            written: Vec::new(),
            path: Vec::new(),
            updates: Vec::new(),
            open: false,
            t_to_o_id: 0,
            period_ns: 0,
            sequence: 0,
            count: 0,
            last_update: None,
            lost: 0,
            now: 0,
        }
    }

    /// Answers one encapsulation packet.
    pub fn handle_stream(&mut self, bytes: &[u8]) -> Vec<u8> {
        let packet = Packet::parse(bytes).unwrap();
        if self.dead || self.mute {
            return Vec::new();
        }
        let data = match packet.command {
            Command::LIST_IDENTITY => {
                self.seen.push("ListIdentity".into());
                let item = crate::wire::list_identity::IdentityItem {
                    protocol_version: 1,
                    socket: crate::wire::sockaddr::SockaddrInfo {
                        address: std::net::SocketAddrV4::new([10, 0, 0, 1].into(), 44818),
                    },
                    vendor: 0x4D,
                    device_type: 0x25,
                    product_code: 7,
                    revision: (2, 3),
                    status: 0,
                    serial_number: 99,
                    product_name: b"Peer",
                    state: 3,
                };
                let mut identity = vec![0; item.buffer_len()];
                item.emit(&mut identity).unwrap();
                let list = CommonPacket::new(&[Item { item_type: ItemType::IDENTITY, data: &identity }]);
                let mut out = vec![0; list.buffer_len()];
                list.emit(&mut out).unwrap();
                out
            }
            Command::REGISTER_SESSION => {
                self.seen.push("RegisterSession".into());
                vec![1, 0, 0, 0]
            }
            Command::UNREGISTER_SESSION => {
                self.seen.push("UnRegisterSession".into());
                return Vec::new();
            }
            _ if packet.session_handle != SESSION => {
                // As a device says it; the controller took over a handle that was changed on the way.
                let status = EncapsulationStatus::INVALID_SESSION_HANDLE;
                let refusal = Packet { status, data: &[], ..packet };
                let mut out = vec![0; refusal.buffer_len()];
                refusal.emit(&mut out).unwrap();
                return out;
            }
            _ => self.rr_data(packet.data),
        };
        let reply =
            Packet { session_handle: SESSION, status: EncapsulationStatus::SUCCESS, data: &data, ..packet };
        let mut out = vec![0; reply.buffer_len()];
        reply.emit(&mut out).unwrap();
        out
    }

    fn rr_data(&mut self, data: &[u8]) -> Vec<u8> {
        let block = EncapsulatedPacket::parse(data).unwrap();
        let request = Request::parse(block.packet.find(ItemType::UNCONNECTED_DATA).unwrap()).unwrap();
        self.seen.push(request.service.to_string());
        let mut body = Vec::new();
        let mut reply = Reply::new(request.service, GeneralStatus::SUCCESS);
        match request.service {
            Service::GET_ATTRIBUTES_ALL => {
                body.extend([0x4D, 0, 0x25, 0, 7, 0, 2, 3, 0, 0, 99, 0, 0, 0, 4]);
                body.extend(b"Peer");
            }
            Service::FORWARD_OPEN | Service::LARGE_FORWARD_OPEN => {
                let large = request.service == Service::LARGE_FORWARD_OPEN;
                let open = ForwardOpen::parse(request.data, large).unwrap();
                self.path = open.path.to_vec();
                if let Some((general, extended)) = &self.refuse_open {
                    reply.status = GeneralStatus(*general);
                    reply.extended = extended.iter().copied().collect();
                } else {
                    self.grant(&open, &mut body);
                }
            }
            Service::FORWARD_CLOSE => {
                self.open = false;
                let close = ForwardClose::parse(request.data).unwrap();
                assert_eq!(close.path, self.path);
                let answer = ForwardCloseReply { triad: close.triad, application_reply: &[] };
                body.resize(answer.buffer_len(), 0);
                answer.emit(&mut body).unwrap();
            }
            Service::GET_ATTRIBUTE_SINGLE => body.extend([0x4D, 0]),
            _ => panic!("unexpected {request}"),
        }
        reply.data = &body;
        let mut message = vec![0; reply.buffer_len()];
        reply.emit(&mut message).unwrap();
        let items = [
            Item { item_type: ItemType::NULL_ADDRESS, data: &[] },
            Item { item_type: ItemType::UNCONNECTED_DATA, data: &message },
        ];
        let packet =
            EncapsulatedPacket { interface_handle: 0, timeout_s: 0, packet: CommonPacket::new(&items) };
        let mut out = vec![0; packet.buffer_len()];
        packet.emit(&mut out).unwrap();
        out
    }

    fn grant(&mut self, open: &ForwardOpen<'_>, body: &mut Vec<u8>) {
        self.open = true;
        self.t_to_o_id = open.t_to_o_id;
        self.period_ns = u64::from(open.o_to_t_rpi_us) * 1000;
        let triad: ConnectionTriad = open.triad;
        let api = open.o_to_t_rpi_us + self.api_offset_us;
        let answer = ForwardOpenReply {
            o_to_t_id: O_TO_T_ID,
            t_to_o_id: open.t_to_o_id,
            triad,
            o_to_t_api_us: api,
            t_to_o_api_us: api,
            application_reply: &[],
        };
        body.resize(answer.buffer_len(), 0);
        answer.emit(body).unwrap();
    }

    /// Answers one C-to-D datagram at once; `now` is system time in ns.
    pub fn handle_datagram(&mut self, now: u64, bytes: &[u8]) -> Option<Vec<u8>> {
        let datagram = Class1Datagram::parse(bytes).unwrap();
        assert_eq!(datagram.connection_id, O_TO_T_ID);
        assert!(self.open, "an update after Forward_Close");
        if self.dead {
            return None;
        }
        self.updates.push(datagram.data.to_vec());
        let frame = CommandFrame::parse(datagram.data).unwrap();
        let header = *frame.header();
        if let Some(last) = self.last_update {
            self.lost = self.lost.wrapping_add(header.update_id.wrapping_sub(last).saturating_sub(1));
        }
        self.last_update = Some(header.update_id);
        let valid = header.node_control.contains(NodeControl::DATA_VALID);
        let synchronous = self.sync_mode && header.node_control.contains(NodeControl::SYNC_CONTROL);
        if header.node_control.contains(NodeControl::FAULT_RESET) {
            self.node_fault = NodeFault::NONE;
        }
        let from = self.now;
        self.now = now;
        for axis in &mut self.axes {
            axis.advance(from, now);
        }
        let mut status = NodeStatus::REMOTE_MODE;
        status.set(NodeStatus::DATA_VALID, valid);
        status.set(NodeStatus::SYNC_MODE, synchronous);
        status.set(NodeStatus::FAULT, self.node_fault != NodeFault::NONE);
        let answer = ActualHeader {
            update_id: header.update_id,
            node_status: status,
            instance_count: 0,
            node_fault: self.node_fault,
            node_alarm: self.node_alarm,
            last_received_id: header.update_id,
            time_stamp: header.time_stamp.map(|_| now),
            time_offset: None,
            update_diagnostics: Some(UpdateDiagnostics { lost_updates: self.lost, late_updates: 0 }),
            time_diagnostics: None,
        };
        let mut buffer = vec![0; 1500];
        let mut writer = ActualWriter::new(&mut buffer, &answer).unwrap();
        let mut body = vec![0; 1024];
        for instance in frame.instances() {
            let mut service = None;
            if let Some(request) = &instance.service {
                let (general_status, length) =
                    self.serve(instance.number, request.service, request.data, &mut body);
                service = Some(ServiceResponse {
                    transaction_id: request.transaction_id,
                    service: request.service,
                    general_status,
                    extended_status: 0,
                    data: &body[..length],
                });
            }
            let mut out = ActualInstance { number: instance.number, service, ..ActualInstance::default() };
            if let (Some(block), Some(index)) =
                (&instance.cyclic, usize::from(instance.number).checked_sub(1))
            {
                let ahead = if synchronous { u64::from(block.target.0) * self.period_ns } else { 0 };
                let axis = &mut self.axes[index];
                axis.take(block, header.time_stamp.filter(|_| synchronous).unwrap_or(now) + ahead);
                out.cyclic = Some(axis.block());
            }
            writer.instance(&out).unwrap();
        }
        let length = writer.finish();
        self.sequence += 1;
        self.count = self.count.wrapping_add(1);
        let reply = Class1Datagram {
            connection_id: self.t_to_o_id,
            encapsulation_sequence: self.sequence,
            sequence_count: self.count,
            data: &buffer[..length],
        };
        let mut out = vec![0; reply.buffer_len()];
        reply.emit(&mut out).unwrap();
        Some(out)
    }

    fn serve(&mut self, instance: u8, service: MotionService, data: &[u8], body: &mut [u8]) -> (u8, usize) {
        match service {
            MotionService::GROUP_SYNC => {
                body[0] = self.sync_answers.pop_front().unwrap_or(SyncStatus::SYNCHRONIZED).0;
                (0, 1)
            }
            MotionService::SET_AXIS_ATTRIBUTES_LIST => {
                let mut general = 0;
                let mut list = ListWriter::new(body).unwrap();
                for item in SetRequest::new(data).unwrap() {
                    let (selector, value) = item.unwrap();
                    let refusal = self
                        .refuse_attributes
                        .iter()
                        .find(|(i, id, _)| (*i, *id) == (instance, selector.id))
                        .map_or(0, |r| r.2);
                    if refusal == 0 {
                        self.written.push((instance, selector.id, value.to_vec()));
                        if instance > 0 {
                            let axis = &mut self.axes[usize::from(instance) - 1];
                            axis.attributes.insert(selector.id, value.to_vec());
                        }
                    } else {
                        general = 0x0A;
                    }
                    list.status(SetStatus { id: selector.id, status: refusal, index: 0 }).unwrap();
                }
                (general, list.finish())
            }
            MotionService::GET_AXIS_ATTRIBUTES_LIST => {
                let mut list = ListWriter::new(body).unwrap();
                for selector in GetRequest::new(data).unwrap() {
                    let selector = selector.unwrap();
                    match self.axes[usize::from(instance) - 1].attributes.get(&selector.id) {
                        Some(value) => list.value(&selector, value).unwrap(),
                        None => list.error(selector.id, 0x14).unwrap(),
                    }
                }
                (0, list.finish())
            }
            _ => (0x08, 0),
        }
    }
}
