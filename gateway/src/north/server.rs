//! The server: one task that owns the adapter and moves bytes, requests and time to and from it.

use std::collections::HashMap;
use std::fmt;
use std::io;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4};
use std::sync::Arc;
use std::time::Duration;

use profile_cip::target::adapter::{Adapter, DEVICE_TIMEOUT};
use profile_cip::target::event::Event;
use profile_cip::target::motion_link::{MotionReply, MotionRequest, OpenParameters};
use profile_generic::time::{DurationNs, MonotonicTime};
use tokio::net::{TcpStream, UdpSocket};
use tokio::sync::{mpsc, watch};
use tokio::task::{Id, JoinError, JoinSet};
use tokio::time::sleep;

use super::connection::{BUFFER_LEN, Connection, Ending, Message, Task};
use super::error::ServeError;
use super::link::AdapterEnd;
use super::sockets::{Sockets, prepare};
use super::statistics::Statistics;
use crate::capture::recorder::Tap;
use crate::sys::clock::{monotonic_now, realtime_now};

/// UDP and TCP port of explicit messages.
const PORT_EXPLICIT: u16 = profile_cip::wire::encapsulation::EXPLICIT_PORT;

/// Streams there are at once, those among them that are on their way out. The adapter serves fewer.
const STREAMS_MAX: usize = 2 * profile_cip::target::adapter::SESSIONS_MAX;

/// Messages of the streams' tasks that may wait. A task waits when there is no room.
const MESSAGES_MAX: usize = 2 * STREAMS_MAX;

/// Longest datagram worth reading: List requests are shorter.
const DATAGRAM_LEN_MAX: usize = 1500;

/// Longest answer to a datagram.
const ANSWER_LEN_MAX: usize = 256;

/// A peer that does not take 4 KiB in this time is dropped.
pub const STALL_LIMIT: Duration = Duration::from_secs(30);

/// How often the motion device's replies are looked for while it owes one: the resolution of the runtime's
/// timers.
///
/// The cycle thread does not wake this task, because that would be a system call in its cycle, into a runtime
/// whose locks it would have to wait for. A reply is late by a millisecond, which no explicit message minds.
const POLL_AWAITING: DurationNs = DurationNs::from_millis(1);

/// How often they are looked for otherwise: the loss of a connection comes unasked.
const POLL_IDLE: DurationNs = DurationNs::from_millis(20);

/// How often the application is called and the statistics are published.
const ATTEND_PERIOD: DurationNs = DurationNs::from_millis(500);

/// How long nothing is accepted after accepting has failed, or read after receiving has.
const RETRY: Duration = Duration::from_millis(100);

type Attend = Box<dyn FnMut(&mut Adapter) + Send>;
type OnEvent = Box<dyn FnMut(&Event) + Send>;
type OnOpen = Box<dyn FnMut(&OpenParameters) + Send>;

/// The server of one device: listens once bound, answers in [`ExplicitServer::run`].
pub struct ExplicitServer {
    sockets: Sockets,
    pub(super) stall_limit: Duration,
    core: Core,
    published: watch::Sender<Statistics>,
    attend: Option<Attend>,
    attend_at: MonotonicTime,
    /// Whether the last stream was refused: told once, until one is accepted.
    refusing: bool,
    tasks: JoinSet<Ending>,
    inbox: mpsc::Receiver<Message>,
    outbox: mpsc::Sender<Message>,
}

impl fmt::Debug for ExplicitServer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ExplicitServer").field("address", &self.sockets.address).finish_non_exhaustive()
    }
}

/// What needs no socket: the adapter, the streams' buffers, the motion device.
struct Core {
    adapter: Adapter,
    link: AdapterEnd,
    tap: Option<Tap>,
    on_event: Option<OnEvent>,
    on_open: Option<OnOpen>,
    /// Where answers to datagrams come from.
    address: SocketAddrV4,
    connections: HashMap<Id, Connection>,
    /// A request for which the queue to the motion device had no room.
    held: Option<MotionRequest>,
    /// Replies the motion device owes.
    owed: u64,
    /// Until when they are worth waiting for.
    owed_until: MonotonicTime,
    poll_at: MonotonicTime,
    statistics: Statistics,
}

impl ExplicitServer {
    /// Listens at TCP and UDP port 44818 of `address`; to be called inside a tokio runtime.
    ///
    /// # Errors
    /// [`ServeError`], when the address or port cannot be had.
    pub fn bind(
        address: Ipv4Addr,
        adapter: Adapter,
        link: AdapterEnd,
        tap: Option<Tap>,
    ) -> Result<Self, ServeError> {
        Self::bind_port(SocketAddrV4::new(address, PORT_EXPLICIT), adapter, link, tap)
    }

    /// As [`ExplicitServer::bind`], at another port; 0 takes any free one.
    ///
    /// # Errors
    /// [`ServeError`], when the address or port cannot be had.
    pub fn bind_port(
        address: SocketAddrV4,
        adapter: Adapter,
        link: AdapterEnd,
        tap: Option<Tap>,
    ) -> Result<Self, ServeError> {
        let config = adapter.config();
        let sockets = Sockets::open(address, config.interface.netmask, config.qos.explicit)?;
        let (outbox, inbox) = mpsc::channel(MESSAGES_MAX);
        let now = monotonic_now();
        let bound = sockets.address;
        let ip = if bound.ip().is_unspecified() { config.interface.address } else { *bound.ip() };
        let core = Core {
            address: SocketAddrV4::new(ip, bound.port()),
            adapter,
            link,
            tap,
            on_event: None,
            on_open: None,
            connections: HashMap::with_capacity(STREAMS_MAX),
            held: None,
            owed: 0,
            owed_until: now,
            poll_at: now,
            statistics: Statistics::default(),
        };
        Ok(Self {
            sockets,
            stall_limit: STALL_LIMIT,
            core,
            published: watch::Sender::new(Statistics::default()),
            attend: None,
            attend_at: now,
            refusing: false,
            tasks: JoinSet::new(),
            inbox,
            outbox,
        })
    }

    /// Calls `attend` at the start and twice a second: the place to tell the adapter how the device is.
    #[must_use]
    pub fn attend(mut self, attend: impl FnMut(&mut Adapter) + Send + 'static) -> Self {
        self.attend = Some(Box::new(attend));
        self
    }

    /// Calls `on_event` for every event of the adapter, besides logging it: the place for the application's
    /// duties, such as a reset or keeping a setting.
    #[must_use]
    pub fn on_event(mut self, on_event: impl FnMut(&Event) + Send + 'static) -> Self {
        self.core.on_event = Some(Box::new(on_event));
        self
    }

    /// Calls `on_open` with every motion connection before the motion device is asked to take it: the place to prepare the
    /// socket it will use.
    #[must_use]
    pub fn on_open(mut self, on_open: impl FnMut(&OpenParameters) + Send + 'static) -> Self {
        self.core.on_open = Some(Box::new(on_open));
        self
    }

    /// Where it listens, TCP and UDP.
    #[must_use]
    pub const fn local_address(&self) -> SocketAddrV4 {
        self.sockets.address
    }

    /// What it has counted, twice a second and at its end.
    #[must_use]
    pub fn statistics(&self) -> watch::Receiver<Statistics> {
        self.published.subscribe()
    }

    /// Answers until `stop` holds `true` or its sender is gone; then all streams are closed and their tasks
    /// ended.
    pub async fn run(mut self, mut stop: watch::Receiver<bool>) -> Statistics {
        let mut receivers = JoinSet::new();
        let udp = Arc::clone(&self.sockets.udp);
        for socket in std::iter::once(udp).chain(self.sockets.broadcast.drain(..)) {
            receivers.spawn(receive(socket, self.outbox.clone()));
        }
        // Nothing is accepted before this time.
        let mut accept_after = tokio::time::Instant::now();
        loop {
            let now = monotonic_now();
            self.step(now);
            let pause = self.wake_at() - monotonic_now();
            let pause = Duration::from_nanos(u64::try_from(pause.0).unwrap_or(0));
            tokio::select! {
                () = stopped(&mut stop) => break,
                Some(message) = self.inbox.recv() => self.take(message),
                Some(ended) = self.tasks.join_next_with_id() => self.ended(ended),
                accepted = async {
                    tokio::time::sleep_until(accept_after).await;
                    self.sockets.listener.accept().await
                } => match accepted {
                    Ok((stream, peer)) => self.accept(stream, peer),
                    Err(error) => {
                        tracing::warn!(at = %self.sockets.address, %error, "cannot accept a stream");
                        accept_after = tokio::time::Instant::now() + RETRY;
                    }
                },
                () = sleep(pause) => {}
            }
        }
        let streams: Vec<Id> = self.core.connections.keys().copied().collect();
        for id in streams {
            self.core.close(id, false);
        }
        receivers.shutdown().await;
        self.tasks.shutdown().await;
        self.publish();
        self.core.statistics
    }

    /// Everything that can be done at this moment.
    fn step(&mut self, now: MonotonicTime) {
        if self.attend_at <= now {
            self.attend_at = now + ATTEND_PERIOD;
            if let Some(attend) = &mut self.attend {
                attend(&mut self.core.adapter);
            }
            self.publish();
        }
        self.core.step(now);
    }

    fn wake_at(&self) -> MonotonicTime {
        self.core.wake_at().min(self.attend_at)
    }

    fn publish(&mut self) {
        let statistics = &mut self.core.statistics;
        statistics.streams = self.core.connections.len();
        statistics.adapter.clone_from(self.core.adapter.counters());
        self.published.send_replace(statistics.clone());
    }

    fn accept(&mut self, stream: TcpStream, peer: SocketAddr) {
        let (SocketAddr::V4(peer), Ok(SocketAddr::V4(local))) = (peer, stream.local_addr()) else { return };
        let crowded = self.tasks.len() >= STREAMS_MAX;
        let slot = if crowded { None } else { self.core.adapter.open(monotonic_now(), peer) };
        let Some(slot) = slot else {
            if !self.refusing {
                tracing::warn!(%peer, at = %local, "stream refused: all places are taken");
            }
            self.refusing = true;
            self.core.statistics.refused += 1;
            return;
        };
        self.refusing = false;
        if let Err(error) = prepare(&stream) {
            tracing::debug!(%peer, %error, "a stream cannot be set up as it should be");
        }
        self.core.statistics.accepted += 1;
        tracing::debug!(%peer, at = %local, "stream opened");
        if let Some(tap) = &mut self.core.tap {
            tap.opened(realtime_now(), peer, local);
        }
        let (to_reader, read_buffers) = mpsc::channel(1);
        let (to_writer, write_buffers) = mpsc::channel(1);
        let (server, stall_limit) = (self.outbox.clone(), self.stall_limit);
        let task = Task { stream, server, read_buffers, write_buffers, stall_limit };
        let id = self.tasks.spawn(task.run()).id();
        let spare = Some(Vec::with_capacity(BUFFER_LEN));
        let connection = Connection { peer, local, slot, input: None, spare, to_reader, to_writer };
        self.core.connections.insert(id, connection);
    }

    fn take(&mut self, message: Message) {
        match message {
            Message::Received(id, bytes) => self.core.received(id, bytes),
            Message::Sent(id, buffer) => {
                if let Some(connection) = self.core.connections.get_mut(&id) {
                    connection.spare = Some(buffer);
                }
            }
            Message::Finished(id) => self.core.close(id, true),
            Message::Datagram { from, to, bytes } => {
                let sent = self.core.datagram(from, to, &bytes).map(|(answer, len)| {
                    // A full send buffer loses a datagram, as the network may.
                    self.sockets.udp.try_send_to(&answer[..len], SocketAddr::V4(from))
                });
                if let Some(Err(error)) = sent {
                    self.core.statistics.datagrams_unsent += 1;
                    tracing::debug!(peer = %from, %error, "an answer cannot be sent");
                }
            }
        }
    }

    fn ended(&mut self, ended: Result<(Id, Ending), JoinError>) {
        let (id, ending) = match ended {
            Ok((id, ending)) => (id, Some(ending)),
            Err(error) => {
                tracing::error!(%error, "the task of a stream broke down");
                (error.id(), None)
            }
        };
        let peer = self.core.connections.get(&id).map(|connection| connection.peer);
        let peer = peer.map_or_else(|| "a peer that had left".to_owned(), |peer| peer.to_string());
        match ending {
            Some(Ending::Stalled) => {
                self.core.statistics.stalled += 1;
                let limit = self.stall_limit;
                tracing::warn!(peer, ?limit, "stream dropped: the peer does not take what is sent to it");
            }
            Some(Ending::Failed(error)) => tracing::debug!(peer, %error, "stream broken"),
            Some(Ending::Closed) | None => {}
        }
        self.core.close(id, false);
    }
}

impl Core {
    fn step(&mut self, now: MonotonicTime) {
        while let Some(reply) = self.link.reply() {
            self.statistics.motion_replies += 1;
            self.owed = self.owed.saturating_sub(u64::from(answers(&reply)));
            self.adapter.complete(now, &reply);
        }
        if self.adapter.wake_at().is_some_and(|at| at <= now) {
            self.adapter.handle_timeout(now);
        }
        self.move_bytes(now);
        self.send_requests(now);
        self.link.tell_connections(self.adapter.explicit_connections());
        while let Some(event) = self.adapter.poll_event() {
            self.note(&event);
        }
        let waiting = self.held.is_some() || (self.owed > 0 && now < self.owed_until);
        self.poll_at = now + if waiting { POLL_AWAITING } else { POLL_IDLE };
    }

    fn wake_at(&self) -> MonotonicTime {
        self.adapter.wake_at().map_or(self.poll_at, |at| at.min(self.poll_at))
    }

    /// Moves what can be moved between the streams and the adapter, and closes those that are done.
    fn move_bytes(&mut self, now: MonotonicTime) {
        let mut done = Vec::new();
        for (id, connection) in &mut self.connections {
            let slot = connection.slot;
            if let Some((bytes, mut taken)) = connection.input.take() {
                taken += self.adapter.handle_stream(now, slot, &bytes[taken..]);
                if taken < bytes.len() {
                    connection.input = Some((bytes, taken));
                } else {
                    // There is one read buffer, so there is room; only a task that has ended does not take
                    // it.
                    let _ = connection.to_reader.try_send(bytes);
                }
            }
            if let Some(mut buffer) = connection.spare.take() {
                buffer.resize(BUFFER_LEN, 0);
                let count = self.adapter.poll_transmit(now, slot, &mut buffer);
                buffer.truncate(count);
                if count == 0 {
                    connection.spare = Some(buffer);
                } else {
                    if let Some(tap) = &mut self.tap {
                        tap.stream(realtime_now(), connection.local, connection.peer, &buffer);
                    }
                    let _ = connection.to_writer.try_send(buffer);
                }
            }
            if self.adapter.is_done(slot) {
                done.push(*id);
            }
        }
        for id in done {
            self.close(id, false);
        }
    }

    /// Hands the adapter's requests to the motion device, as far as there is room.
    fn send_requests(&mut self, now: MonotonicTime) {
        let mut was_held = self.held.is_some();
        while let Some(request) = self.held.take().or_else(|| self.adapter.poll_motion()) {
            if let (MotionRequest::Open(open), Some(on_open)) = (&request, &mut self.on_open) {
                on_open(open);
            }
            if let Err(request) = self.link.request(request) {
                self.statistics.motion_requests_held += u64::from(!was_held);
                self.held = Some(request);
                return;
            }
            was_held = false;
            self.statistics.motion_requests += 1;
            self.owed += 1;
            self.owed_until = now + DEVICE_TIMEOUT;
        }
    }

    fn received(&mut self, id: Id, bytes: Vec<u8>) {
        let Some(connection) = self.connections.get_mut(&id) else { return };
        if let Some(tap) = &mut self.tap {
            tap.stream(realtime_now(), connection.peer, connection.local, &bytes);
        }
        connection.input = Some((bytes, 0));
    }

    /// Lets go of a stream; its task sends what it has and ends.
    fn close(&mut self, id: Id, by_peer: bool) {
        let Some(connection) = self.connections.remove(&id) else { return };
        self.adapter.close(connection.slot);
        let (from, to) =
            if by_peer { (connection.peer, connection.local) } else { (connection.local, connection.peer) };
        tracing::debug!(peer = %connection.peer, by_peer, "stream closed");
        if let Some(tap) = &mut self.tap {
            tap.closed(realtime_now(), from, to);
        }
    }

    /// The answer to a datagram.
    fn datagram(
        &mut self,
        from: SocketAddrV4,
        to: SocketAddrV4,
        bytes: &[u8],
    ) -> Option<([u8; ANSWER_LEN_MAX], usize)> {
        self.statistics.datagrams += 1;
        if let Some(tap) = &mut self.tap {
            tap.datagram(realtime_now(), from, to, 0, bytes);
        }
        let mut answer = [0; ANSWER_LEN_MAX];
        let len = self.adapter.handle_datagram(bytes, &mut answer)?;
        if let Some(tap) = &mut self.tap {
            let tos = self.adapter.config().qos.explicit << 2;
            tap.datagram(realtime_now(), self.address, from, tos, &answer[..len]);
        }
        Some((answer, len))
    }

    fn note(&mut self, event: &Event) {
        let statistics = &mut self.statistics;
        statistics.events += 1;
        match event {
            Event::MotionOpened { .. } => statistics.motion_opened += 1,
            Event::MotionClosed { .. } => statistics.motion_closed += 1,
            Event::MotionLost { .. } => statistics.motion_lost += 1,
            _ => {}
        }
        match event {
            Event::MotionLost { .. }
            | Event::ExplicitLost { .. }
            | Event::SessionLost { .. }
            | Event::DeviceSilent { .. }
            | Event::OpenRefused { .. }
            | Event::Reset { .. } => {
                tracing::warn!("{event}");
            }
            _ => tracing::info!("{event}"),
        }
        if let Some(on_event) = &mut self.on_event {
            on_event(event);
        }
    }
}

/// Whether a message of the motion device is the answer to a request.
const fn answers(reply: &MotionReply) -> bool {
    !matches!(reply, MotionReply::ConnectionLost { .. })
}

async fn stopped(stop: &mut watch::Receiver<bool>) {
    // An error is a sender that is gone: that is a wish to stop as well.
    let _ = stop.wait_for(|stop| *stop).await;
}

/// Hands the datagrams of a socket to the server.
async fn receive(socket: Arc<UdpSocket>, server: mpsc::Sender<Message>) {
    let to = match socket.local_addr() {
        Ok(SocketAddr::V4(to)) => to,
        Ok(SocketAddr::V6(_)) | Err(_) => SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, PORT_EXPLICIT),
    };
    let mut buffer = [0; DATAGRAM_LEN_MAX];
    loop {
        let received: io::Result<(usize, SocketAddr)> = socket.recv_from(&mut buffer).await;
        match received {
            Ok((len, SocketAddr::V4(from))) => {
                let bytes = buffer[..len].to_vec();
                if server.send(Message::Datagram { from, to, bytes }).await.is_err() {
                    return;
                }
            }
            Ok((_, SocketAddr::V6(_))) => {}
            Err(error) => {
                tracing::debug!(at = %to, %error, "cannot receive datagrams");
                sleep(RETRY).await;
            }
        }
    }
}
