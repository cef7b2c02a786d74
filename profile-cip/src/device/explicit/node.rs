//! The device below encapsulation: takes one explicit request and answers it, at once or after the motion
//! device.

use std::collections::VecDeque;

use arrayvec::ArrayVec;
use core::net::{Ipv4Addr, SocketAddrV4};
use profile_generic::time::{DurationNs, MonotonicTime};

use super::adapter::{DEVICE_TIMEOUT, SessionSlot};
use super::reset::{self, Reset};
use super::{forward_close, forward_open};
use crate::assembly::{Assemblies, Layout};
use crate::device::config::{AdapterConfig, QosConfig};
use crate::device::connection::manager::{
    ASSEMBLY_CONNECTIONS_MAX, CONNECTIONS_MAX, ConnectionManager, Motion, Owner,
};
use crate::device::connection::refusal::Refusal;
use crate::device::counters::Counters;
use crate::device::event::Event;
use crate::device::motion_link::{
    AssemblyOpen, CloseParameters, ConnectionTriad, ExplicitRequest, MotionReply, MotionRequest, ObjectPath,
    OpenParameters, Token,
};
use crate::device::objects::ac_dc_drive;
use crate::device::objects::assembly::{self, Outcome};
use crate::device::objects::class::{
    CLASS_AC_DC_DRIVE, CLASS_ASSEMBLY, CLASS_AXIS_PARAMETER, CLASS_CONNECTION_MANAGER, CLASS_MESSAGE_ROUTER,
    CLASS_MOTION_DEVICE_AXIS,
};
use crate::device::objects::connection_manager::{self, Statistics};
use crate::device::objects::ethernet_link::{CLASS_ETHERNET_LINK, Cleared, EthernetLink, GET_AND_CLEAR};
use crate::device::objects::file::{Asker, CLASS_FILE, File, INSTANCE_EDS, Uploads};
use crate::device::objects::identity::CLASS_IDENTITY;
use crate::device::objects::identity::{Health, Identity, Ownership};
use crate::device::objects::object::{Answer, serve};
use crate::device::objects::qos::{CLASS_QOS, Qos};
use crate::device::objects::router::{self, MessageRouter};
use crate::device::objects::tcp_ip::{CLASS_TCP_IP, TcpIp};
use crate::device::objects::time_sync::{CLASS_TIME_SYNC, TimeSync, TimeSyncState};
use crate::wire::message_router::Request;
use crate::wire::status::{ConnectionStatus, GeneralStatus, Service};

/// Most requests waiting for the motion device to fetch them.
const REQUESTS_MAX: usize = 128;

/// Most events waiting to be fetched; older ones are dropped then.
const EVENTS_MAX: usize = 64;

/// Who sent a request, and when it came.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Origin {
    pub now: MonotonicTime,
    pub session: SessionSlot,
    pub peer: SocketAddrV4,
    /// Socket address item of the T->O direction, where the request has one.
    pub t_to_o_socket: Option<SocketAddrV4>,
    /// Longest reply in bytes.
    pub reply_max: usize,
}

/// What a request came to.
pub(crate) enum Step {
    /// The reply.
    Done(Vec<u8>),
    /// The motion device has been asked.
    Await(Await),
}

/// What is to be made of the motion device's answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Await {
    pub token: Token,
    pub service: Service,
    pub kind: AwaitKind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AwaitKind {
    Open(OpenParameters, SocketAddrV4),
    Close(CloseParameters),
    Explicit,
    Reset,
}

/// Everything the device keeps besides its sessions.
#[derive(Debug)]
pub(crate) struct Node {
    pub config: AdapterConfig,
    /// The code points of the start; those of the configuration are for the next one.
    pub qos_in_use: QosConfig,
    pub health: Health,
    pub time_sync: TimeSyncState,
    pub connections: ConnectionManager,
    pub counters: Counters,
    pub reset: Reset,
    pub uploads: Uploads,
    cleared: Cleared,
    requests: VecDeque<MotionRequest>,
    events: VecDeque<Event>,
    next_token: u64,
    /// The host that owns the device, or was the last one to do so.
    pub last_owner: Option<Ipv4Addr>,
}

impl Node {
    pub fn new(config: AdapterConfig) -> Self {
        Self {
            health: Health::default(),
            time_sync: TimeSyncState::default(),
            connections: ConnectionManager::new(config.incarnation),
            counters: Counters::default(),
            reset: Reset::default(),
            uploads: Uploads::default(),
            cleared: Cleared::default(),
            qos_in_use: config.qos,
            requests: VecDeque::with_capacity(REQUESTS_MAX),
            events: VecDeque::with_capacity(EVENTS_MAX),
            next_token: 1,
            last_owner: None,
            config,
        }
    }

    pub fn poll_request(&mut self) -> Option<MotionRequest> {
        self.requests.pop_front()
    }

    pub fn poll_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    pub fn tell(&mut self, event: Event) {
        if self.events.len() >= EVENTS_MAX {
            self.events.pop_front();
            self.counters.events_lost += 1;
        }
        self.events.push_back(event);
    }

    pub fn new_token(&mut self) -> Token {
        let token = Token(self.next_token);
        self.next_token += 1;
        token
    }

    /// Puts a request into the queue for the motion device.
    pub fn ask(&mut self, request: MotionRequest) -> Result<(), GeneralStatus> {
        if self.requests.len() >= REQUESTS_MAX {
            return Err(GeneralStatus::RESOURCE_UNAVAILABLE);
        }
        self.requests.push_back(request);
        Ok(())
    }

    pub fn identity(&self) -> Identity<'_> {
        let ownership = match self.connections.motion {
            Motion::Open(_) => Ownership::Owned,
            _ if self.connections.motion_lost => Ownership::Lost,
            _ => Ownership::Free,
        };
        let config = &self.config.identity;
        Identity { config, health: self.health, ownership, consistency: self.consistency() }
    }

    /// Configuration Consistency Value: differs when the application's configuration or a stored setting does.
    fn consistency(&self) -> u16 {
        let QosConfig { ptp_event, ptp_general, urgent, scheduled, high, low, explicit } = self.config.qos;
        let [a, b] = self.config.interface.inactivity_timeout_s.to_le_bytes();
        let settings = [ptp_event, ptp_general, urgent, scheduled, high, low, explicit, a, b];
        // A CRC (CCITT polynomial), in which any one change of a setting shows.
        settings.into_iter().fold(self.config.identity.configuration, |crc, byte| {
            (0..8).fold(crc ^ u16::from(byte) << 8, |crc, _| {
                if crc & 0x8000 == 0 { crc << 1 } else { crc << 1 ^ 0x1021 }
            })
        })
    }

    /// Runs one explicit request.
    pub fn execute(&mut self, origin: &Origin, message: &[u8]) -> Step {
        let first = Service(message.first().map_or(0, |service| service & 0x7F));
        let request = match Request::parse(message) {
            Ok(request) => request,
            Err(_) => {
                let status = match message {
                    [] | [_] => GeneralStatus::NOT_ENOUGH_DATA,
                    [service, ..] if service & 0x80 != 0 => GeneralStatus::SERVICE_NOT_SUPPORTED,
                    _ => GeneralStatus::PATH_SIZE_INVALID,
                };
                return self.refuse(first, status);
            }
        };
        let path = match router::resolve(request.path, &self.config.identity) {
            Ok(path) => path,
            Err(status) => return self.refuse(request.service, status),
        };
        let client = *origin.peer.ip();
        if self.is_foreign(client, path.class, request.service) {
            return self.refuse(request.service, GeneralStatus::PRIVILEGE_VIOLATION);
        }
        let of_assemblies = self.config.assembly.as_ref().and_then(|assemblies| match path.class {
            CLASS_ASSEMBLY => Some(assembly::serve(assemblies, request.service, &path, request.data)),
            CLASS_AC_DC_DRIVE => ac_dc_drive::serve(assemblies, request.service, &path, request.data),
            _ => None,
        });
        if let Some(outcome) = of_assemblies {
            return match outcome {
                Outcome::Data => self.hand_on(origin, &request, path),
                Outcome::Done(answer) => self.answered(origin, request.service, answer),
            };
        }
        let answer = match (path.class, path.instance, request.service) {
            (CLASS_MOTION_DEVICE_AXIS, ..) if self.config.assembly.is_none() => {
                return self.hand_on(origin, &request, path);
            }
            (CLASS_AXIS_PARAMETER, ..) if self.config.assembly.is_some() => {
                return self.hand_on(origin, &request, path);
            }
            (CLASS_CONNECTION_MANAGER, 1, Service::FORWARD_OPEN | Service::LARGE_FORWARD_OPEN) => {
                return forward_open::open(self, origin, &request);
            }
            (CLASS_CONNECTION_MANAGER, 1, Service::FORWARD_CLOSE) => {
                return forward_close::close(self, origin, &request);
            }
            (CLASS_CONNECTION_MANAGER, 1, Service::GET_CONNECTION_DATA) => {
                connection_manager::get(&self.connections, &self.config.interface, client, request.data)
            }
            (CLASS_CONNECTION_MANAGER, 1, Service::SEARCH_CONNECTION_DATA) => {
                connection_manager::search(&self.connections, &self.config.interface, client, request.data)
            }
            (CLASS_IDENTITY, 1, Service::RESET) => return self.reset(origin, request.data),
            (CLASS_ETHERNET_LINK, 1, GET_AND_CLEAR) => {
                self.ethernet_link().get_and_clear(path.attribute, request.data)
            }
            _ => self.attribute_service(origin, &request, &path),
        };
        self.answered(origin, request.service, answer)
    }

    fn answered(&mut self, origin: &Origin, service: Service, answer: Answer) -> Step {
        if answer.status != GeneralStatus::SUCCESS {
            self.counters.requests_refused += 1;
        }
        Step::Done(answer.into_reply(service, origin.reply_max))
    }

    pub fn refuse(&mut self, service: Service, status: GeneralStatus) -> Step {
        self.counters.requests_refused += 1;
        Step::Done(Answer::status(status).into_reply(service, usize::MAX))
    }

    fn attribute_service(&mut self, origin: &Origin, request: &Request<'_>, path: &ObjectPath) -> Answer {
        let (service, data, limit) = (request.service, request.data, origin.reply_max);
        match path.class {
            CLASS_IDENTITY => serve(&mut self.identity(), service, path, data, limit),
            CLASS_MESSAGE_ROUTER => {
                let explicit = u16::try_from(self.connections.explicit.len()).unwrap_or(u16::MAX);
                let listeners = u16::try_from(self.connections.listeners.len()).unwrap_or(u16::MAX);
                let motion = listeners + u16::from(self.connections.motion.parameters().is_some());
                let has_axes = self.config.assembly.is_none();
                let has_file = !self.config.eds.is_empty();
                let layout = self.config.assembly.as_ref().map(Assemblies::layout);
                let has_drive = matches!(layout, Some(Layout::Speed { .. }));
                let mut router = MessageRouter {
                    available: self.connections_max(),
                    active: explicit + motion,
                    has_file,
                    has_axes,
                    has_drive,
                };
                serve(&mut router, service, path, data, limit)
            }
            CLASS_CONNECTION_MANAGER => {
                let (counters, connections) = (&self.counters, &self.connections);
                let available = self.connections_max();
                serve(&mut Statistics { counters, connections, available }, service, path, data, limit)
            }
            CLASS_FILE if !self.config.eds.is_empty() => {
                let Self { config, uploads, .. } = self;
                let mut file = File { eds: &config.eds, identity: &config.identity, uploads };
                let asker = Asker { session: origin.session, now: origin.now, reply_max: limit };
                let own = if path.instance == u32::from(INSTANCE_EDS) {
                    file.serve(service, &asker, data)
                } else {
                    None
                };
                own.unwrap_or_else(|| serve(&mut file, service, path, data, limit))
            }
            CLASS_TIME_SYNC => {
                let (state, config) = (&self.time_sync, &self.config);
                let mut object = TimeSync { state, config, now: origin.now, setting: None };
                let answer = serve(&mut object, service, path, data, limit);
                if let Some(setting) = object.setting {
                    self.tell(Event::TimeSyncSet(setting));
                }
                answer
            }
            CLASS_QOS => {
                let before = self.config.qos;
                let answer = serve(&mut Qos(&mut self.config.qos), service, path, data, limit);
                if self.config.qos != before {
                    self.tell(Event::QosChanged(self.config.qos));
                }
                answer
            }
            CLASS_TCP_IP => {
                let before = self.config.interface.inactivity_timeout_s;
                let answer = serve(&mut TcpIp(&mut self.config.interface), service, path, data, limit);
                let seconds = self.config.interface.inactivity_timeout_s;
                if seconds != before {
                    self.tell(Event::InactivityTimeoutChanged { seconds });
                }
                answer
            }
            CLASS_ETHERNET_LINK => serve(&mut self.ethernet_link(), service, path, data, limit),
            _ => Answer::status(GeneralStatus::PATH_DESTINATION_UNKNOWN),
        }
    }

    /// Connections there can be.
    fn connections_max(&self) -> u16 {
        if self.config.assembly.is_some() { ASSEMBLY_CONNECTIONS_MAX } else { CONNECTIONS_MAX }
    }

    fn ethernet_link(&mut self) -> EthernetLink<'_> {
        EthernetLink { config: &self.config.link, cleared: &mut self.cleared }
    }

    fn hand_on(&mut self, origin: &Origin, request: &Request<'_>, path: ObjectPath) -> Step {
        let Ok(data) = ArrayVec::try_from(request.data) else {
            return self.refuse(request.service, GeneralStatus::TOO_MUCH_DATA);
        };
        let token = self.new_token();
        let originator = *origin.peer.ip();
        let explicit = ExplicitRequest { token, originator, service: request.service.0, path, data };
        match self.ask(MotionRequest::Explicit(explicit)) {
            Ok(()) => Step::Await(Await { token, service: request.service, kind: AwaitKind::Explicit }),
            Err(status) => self.refuse(request.service, status),
        }
    }

    /// Takes note of what the motion device did, whether or not somebody still waits for it.
    pub fn note(&mut self, reply: &MotionReply) {
        self.note_reset(reply);
        self.note_listener(reply);
        match (reply, self.connections.motion) {
            (MotionReply::Opened { token, outcome }, Motion::Opening(owner, asked))
                if *token == asked.token =>
            {
                if outcome.is_err() {
                    self.connections.motion = Motion::Closed;
                } else {
                    self.connections.motion = Motion::Open(owner);
                    self.connections.motion_lost = false;
                    self.last_owner = Some(owner.open.originator);
                    self.tell(opened(&owner));
                }
            }
            (MotionReply::Closed { token }, Motion::Closing(owner, asked)) if *token == asked.token => {
                self.motion_closed(&owner);
            }
            (
                MotionReply::ConnectionLost { o_to_t_id, silent_us },
                Motion::Open(owner) | Motion::Closing(owner, _),
            ) if *o_to_t_id == owner.open.o_to_t_id => {
                self.connections.motion = Motion::Closed;
                self.connections.motion_lost = true;
                self.counters.connection_timeouts += 1;
                self.tell(lost(&owner, *silent_us));
            }
            _ => {}
        }
    }

    fn motion_closed(&mut self, owner: &Owner) {
        self.connections.motion = Motion::Closed;
        self.tell(closed(owner));
    }

    /// As [`Self::note`], for input-only and listen-only connections.
    fn note_listener(&mut self, reply: &MotionReply) {
        let is_meant = |one: &Motion| match (reply, one) {
            (MotionReply::Opened { token, .. }, Motion::Opening(_, asked))
            | (MotionReply::Closed { token }, Motion::Closing(_, asked)) => *token == asked.token,
            (
                MotionReply::ConnectionLost { o_to_t_id, .. },
                Motion::Open(owner) | Motion::Closing(owner, _),
            ) => *o_to_t_id == owner.open.o_to_t_id,
            _ => false,
        };
        let Some(place) = self.connections.listeners.iter().position(is_meant) else { return };
        let (Motion::Opening(owner, _) | Motion::Open(owner) | Motion::Closing(owner, _)) =
            self.connections.listeners[place]
        else {
            return;
        };
        match reply {
            MotionReply::Opened { outcome: Ok(()), .. } => {
                self.connections.listeners[place] = Motion::Open(owner);
                self.tell(opened(&owner));
                return;
            }
            MotionReply::ConnectionLost { silent_us, .. } => {
                self.counters.connection_timeouts += 1;
                self.tell(lost(&owner, *silent_us));
            }
            MotionReply::Closed { .. } => self.tell(closed(&owner)),
            _ => {}
        }
        self.connections.listeners.swap_remove(place);
    }

    /// Stops waiting for the device to open or close input-only and listen-only connections.
    fn listeners_silent(&mut self, now: MonotonicTime) {
        let is_late = |one: &Motion| one.deadline().is_some_and(|deadline| deadline <= now);
        while let Some(place) = self.connections.listeners.iter().position(is_late) {
            match self.connections.listeners.swap_remove(place) {
                Motion::Opening(owner, _) => {
                    let OpenParameters { triad, o_to_t_id, .. } = owner.open;
                    let token = self.new_token();
                    let _ = self.ask(MotionRequest::Close(CloseParameters { token, triad, o_to_t_id }));
                }
                Motion::Closing(owner, _) => self.tell(closed(&owner)),
                Motion::Closed | Motion::Open(_) => {}
            }
        }
    }

    /// Stops waiting for the motion device to open or close the connection. It finds requests in their order:
    /// what it was asked before comes before any new request to open.
    fn motion_device_silent(&mut self) {
        match self.connections.motion {
            Motion::Opening(owner, _) => {
                self.connections.motion = Motion::Closed;
                // It may still take the connection later. A full queue means that it fetches nothing at all.
                let OpenParameters { triad, o_to_t_id, .. } = owner.open;
                let token = self.new_token();
                let _ = self.ask(MotionRequest::Close(CloseParameters { token, triad, o_to_t_id }));
            }
            Motion::Closing(owner, _) => self.motion_closed(&owner),
            Motion::Closed | Motion::Open(_) => {}
        }
    }

    /// The reply to a request the motion device has answered; `None` if that answer belongs to another
    /// service.
    pub fn finish(&mut self, awaited: &Await, reply: &MotionReply, reply_max: usize) -> Option<Vec<u8>> {
        let answer = match (awaited.kind, reply) {
            (AwaitKind::Open(open, peer), MotionReply::Opened { outcome, .. }) => {
                forward_open::opened(self, &open, peer, *outcome)
            }
            (AwaitKind::Close(close), MotionReply::Closed { .. }) => forward_close::closed(close.triad),
            (AwaitKind::Reset, MotionReply::ResetPrepared { granted, .. }) => reset::prepared(*granted),
            (AwaitKind::Explicit, MotionReply::Explicit(reply)) => Answer {
                status: GeneralStatus(reply.general_status),
                extended: reply.extended_status.iter().copied().collect(),
                data: reply.data.to_vec(),
            },
            _ => return None,
        };
        if answer.status != GeneralStatus::SUCCESS {
            self.counters.requests_refused += 1;
        }
        Some(answer.into_reply(awaited.service, reply_max))
    }

    /// The reply to a request the motion device has not answered in time.
    pub fn give_up(&mut self, awaited: &Await) -> Vec<u8> {
        self.counters.device_timeouts += 1;
        self.counters.requests_refused += 1;
        self.tell(Event::DeviceSilent { service: awaited.service, waited_us: micros(DEVICE_TIMEOUT) });
        let answer = match awaited.kind {
            AwaitKind::Open(open, peer) => {
                let refusal = Refusal::new(GeneralStatus::RESOURCE_UNAVAILABLE, 0);
                self.refuse_open(open.triad, peer, refusal)
            }
            AwaitKind::Close(close) => Answer {
                data: forward_open::failure(close.triad, 0),
                ..Answer::status(GeneralStatus::RESOURCE_UNAVAILABLE)
            },
            AwaitKind::Explicit | AwaitKind::Reset => Answer::status(GeneralStatus::RESOURCE_UNAVAILABLE),
        };
        answer.into_reply(awaited.service, usize::MAX)
    }

    /// Counts and reports a refused Forward_Open, and makes its answer.
    pub fn refuse_open(&mut self, triad: ConnectionTriad, peer: SocketAddrV4, refusal: Refusal) -> Answer {
        let (general, extended) = (refusal.general.0, refusal.first_extended());
        if general == GeneralStatus::CONNECTION_FAILURE.0
            && extended == ConnectionStatus::OUT_OF_CONNECTIONS.0
            || refusal.general == GeneralStatus::RESOURCE_UNAVAILABLE
        {
            self.counters.open_resource_rejects += 1;
        } else {
            self.counters.open_other_rejects += 1;
        }
        self.counters.refuse_open(general, extended);
        let Refusal { found, expected, .. } = refusal;
        self.tell(Event::OpenRefused { triad, originator: peer, general, extended, found, expected });
        Answer {
            status: refusal.general,
            extended: refusal.extended,
            data: forward_open::failure(triad, refusal.remaining_path_words),
        }
    }

    /// When the next connection times out.
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        self.connections
            .wake_at()
            .into_iter()
            .chain(self.reset_deadline())
            .chain(self.uploads.wake_at())
            .min()
    }

    /// Ends the connections whose time is up.
    pub fn handle_time(&mut self, now: MonotonicTime) {
        if self.connections.motion.deadline().is_some_and(|deadline| deadline <= now) {
            self.motion_device_silent();
        }
        self.listeners_silent(now);
        self.expire_reset(now);
        self.uploads.expire(now);
        while let Some(expired) = self.connections.take_expired(now) {
            self.counters.connection_timeouts += 1;
            self.tell(Event::ExplicitLost {
                triad: expired.triad,
                originator: expired.peer,
                silent_us: micros(now - expired.heard),
                timeout_us: micros(expired.deadline - expired.heard),
            });
        }
    }
}

/// That a connection was opened.
fn opened(owner: &Owner) -> Event {
    let OpenParameters { triad, rpi_us, assembly, .. } = owner.open;
    let originator = owner.peer;
    match assembly {
        None => Event::MotionOpened { triad, originator, rpi_us },
        Some(AssemblyOpen { role, t_to_o_rpi_us, .. }) => Event::AssemblyOpened {
            role,
            triad,
            originator,
            intervals_us: (rpi_us, t_to_o_rpi_us),
            group: owner.open.group().map(|group| *group.ip()),
        },
    }
}

/// That a connection was closed.
fn closed(owner: &Owner) -> Event {
    let OpenParameters { triad, assembly, .. } = owner.open;
    match assembly {
        None => Event::MotionClosed { triad },
        Some(AssemblyOpen { role, .. }) => Event::AssemblyClosed { role, triad },
    }
}

/// That a connection has timed out.
fn lost(owner: &Owner, silent_us: u64) -> Event {
    let OpenParameters { triad, timeout_us, assembly, .. } = owner.open;
    let originator = owner.peer;
    match assembly {
        None => Event::MotionLost { triad, originator, silent_us, timeout_us },
        Some(AssemblyOpen { role, .. }) => {
            Event::AssemblyLost { role, triad, originator, silent_us, timeout_us }
        }
    }
}

/// Whole microseconds of a time that has passed.
pub(crate) fn micros(time: DurationNs) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(0) / 1000
}
