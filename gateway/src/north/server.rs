//! The server: sockets, adapter and time in one future, answered in the turn in which a request comes.

use std::fmt;
use std::future::{Future, poll_fn};
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4};
use std::pin::pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use profile_cip::device::adapter::{Adapter, NoRoom};
use profile_cip::device::event::Event;
use profile_cip::device::hosts::Hosts;
use profile_cip::device::motion_link::OpenParameters;
use profile_generic::time::{DurationNs, MonotonicTime};
use tokio::io::ReadBuf;
use tokio::net::{TcpListener, TcpStream, UdpSocket};
use tokio::sync::watch;
use tokio::time::sleep;

use super::core::{Core, host};
use super::error::ServeError;
use super::link::AdapterEnd;
use super::sockets::{Sockets, prepare};
use super::statistics::Statistics;
use super::stream::{Ending, Stream};
use crate::capture::recorder::Tap;
use crate::line_limit::{LineKind, LineLimit};
use crate::sys::clock::{monotonic_now, realtime_now};
use crate::sys::gate::Admitted;

/// UDP and TCP port of explicit messages.
const PORT_EXPLICIT: u16 = profile_cip::wire::encapsulation::EXPLICIT_PORT;

/// Streams there are at once, those among them that are on their way out. The adapter serves fewer.
const STREAMS_MAX: usize = 2 * profile_cip::device::adapter::SESSIONS_MAX;

/// Longest datagram worth reading: List requests are shorter.
const DATAGRAM_LEN_MAX: usize = 1500;

/// A peer that does not take 4 KiB in this time is dropped.
pub const STALL_LIMIT: Duration = Duration::from_secs(30);

/// How long the sockets are polled after something has moved before the thread sleeps.
///
/// Whoever asks once mostly asks again, and to be woken costs more than to answer. It is bounded, so that a quiet
/// server costs nothing, and below the priority of the cycle thread.
const POLL_FOR: DurationNs = DurationNs::from_micros(200);

/// How often the application is called and the statistics are published.
const ATTEND_PERIOD: DurationNs = DurationNs::from_millis(500);

/// How long nothing is accepted after accepting has failed, or read after receiving has.
const RETRY: DurationNs = DurationNs::from_millis(100);

type Attend = Box<dyn FnMut(&mut Adapter) + Send>;

/// The server of one device: listens once bound, answers once it runs, see [`super::spawn`].
pub struct ExplicitServer {
    sockets: Sockets,
    pub(super) stall_limit: Duration,
    core: Core,
    published: watch::Sender<Statistics>,
    attend: Option<Attend>,
    attend_at: MonotonicTime,
}

impl fmt::Debug for ExplicitServer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ExplicitServer").field("address", &self.sockets.address).finish_non_exhaustive()
    }
}

impl ExplicitServer {
    /// Listens at TCP and UDP port 44818 of `address`.
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
        let now = monotonic_now();
        let bound = sockets.address;
        let ip = if bound.ip().is_unspecified() { config.interface.address } else { *bound.ip() };
        let core = Core::new(adapter, link, tap, SocketAddrV4::new(ip, bound.port()), now);
        Ok(Self {
            sockets,
            stall_limit: STALL_LIMIT,
            core,
            published: watch::Sender::new(Statistics::default()),
            attend: None,
            attend_at: now,
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

    /// Calls `on_admit` with whose datagrams the I/O socket is to let through whenever that changes: before the motion device
    /// is asked to take a connection, once the source port of its updates is known, and with `None` when it has ended.
    #[must_use]
    pub fn on_admit(mut self, on_admit: impl FnMut(Option<Admitted>) + Send + 'static) -> Self {
        self.core.on_admit = Some(Box::new(on_admit));
        self
    }

    /// Serves these hosts and the controllers of the device, and nobody else.
    #[must_use]
    pub fn serve_tools(mut self, tools: Hosts) -> Self {
        self.core.tools = tools;
        self
    }

    /// Shares the limit of lines that peers can have written with others.
    #[must_use]
    pub fn limit_lines(mut self, limit: Arc<LineLimit>) -> Self {
        self.core.limit = limit;
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

    /// Hands the sockets to the runtime of the caller.
    ///
    /// # Errors
    /// [`ServeError::System`], when it does not take them.
    pub(super) fn start(self) -> Result<Running, ServeError> {
        let Self { sockets, stall_limit, core, published, attend, attend_at } = self;
        let traffic = Traffic::new(sockets, stall_limit)?;
        Ok(Running { traffic, core, published, attend, attend_at })
    }
}

/// A server whose sockets are at work.
pub(super) struct Running {
    traffic: Traffic,
    core: Core,
    published: watch::Sender<Statistics>,
    attend: Option<Attend>,
    attend_at: MonotonicTime,
}

impl Running {
    /// Answers until `stop` holds `true` or its sender is gone; then all streams are closed. To be run by a runtime
    /// of one thread that has nothing else to do.
    pub async fn run(mut self, mut stop: watch::Receiver<bool>) {
        let mut stopped = pin!(stop.wait_for(|stop| *stop));
        let mut poll_until = MonotonicTime::ZERO;
        loop {
            let now = monotonic_now();
            self.step(now);
            let polling = now < poll_until;
            let wake_at = self.core.wake_at().min(self.attend_at).min(self.traffic.wake_at(now));
            let pause = Duration::from_nanos(u64::try_from((wake_at - now).0).unwrap_or(0));
            let mut asleep = pin!((!polling).then(|| sleep(pause)));
            let turn = poll_fn(|cx| {
                // An error is a sender that is gone: that is a wish to stop as well.
                if stopped.as_mut().poll(cx).is_ready() {
                    return Poll::Ready(Turn::Stop);
                }
                if self.traffic.turn(cx, monotonic_now(), &mut self.core) {
                    return Poll::Ready(Turn::Moved);
                }
                let waited = asleep.as_mut().as_pin_mut().is_none_or(|timer| timer.poll(cx).is_ready());
                if waited { Poll::Ready(Turn::Idle) } else { Poll::Pending }
            });
            match turn.await {
                Turn::Stop => break,
                Turn::Moved => poll_until = monotonic_now() + POLL_FOR,
                // Lets the runtime look at the sockets.
                Turn::Idle if polling => tokio::task::yield_now().await,
                Turn::Idle => {}
            }
        }
        self.traffic.close(&mut self.core);
        self.publish();
    }

    /// Everything that can be done at this moment without a socket.
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

    fn publish(&mut self) {
        let statistics = &mut self.core.statistics;
        statistics.streams = self.traffic.streams.len();
        statistics.adapter.clone_from(self.core.adapter.counters());
        self.published.send_replace(statistics.clone());
    }
}

/// What one turn of the server came to.
enum Turn {
    Moved,
    Idle,
    Stop,
}

/// A socket for datagrams; after an error it is left alone for a while.
#[derive(Debug)]
struct Datagrams {
    socket: UdpSocket,
    to: SocketAddrV4,
    quiet_until: MonotonicTime,
}

/// All sockets at work.
#[derive(Debug)]
struct Traffic {
    listener: TcpListener,
    /// Nothing is accepted before this time.
    accept_after: MonotonicTime,
    /// The first one is bound to the device's address: answers go out there, whichever a question came in by.
    datagrams: Vec<Datagrams>,
    streams: Vec<Stream>,
    stall_limit: Duration,
    buffer: Box<[u8; DATAGRAM_LEN_MAX]>,
}

impl Traffic {
    fn new(sockets: Sockets, stall_limit: Duration) -> Result<Self, ServeError> {
        let (listener, udp) = sockets.register()?;
        let datagrams =
            udp.into_iter().map(|(socket, to)| Datagrams { socket, to, quiet_until: MonotonicTime::ZERO });
        Ok(Self {
            listener,
            accept_after: MonotonicTime::ZERO,
            datagrams: datagrams.collect(),
            streams: Vec::with_capacity(STREAMS_MAX),
            stall_limit,
            buffer: Box::new([0; DATAGRAM_LEN_MAX]),
        })
    }

    /// Moves what can be moved now; whether anything was. The task is woken when there is more.
    fn turn(&mut self, cx: &mut Context<'_>, now: MonotonicTime, core: &mut Core) -> bool {
        let mut moved = false;
        self.streams.retain_mut(|stream| match stream.turn(cx, now, core) {
            Ok(one) => {
                moved |= one;
                true
            }
            Err(ending) => {
                moved = true;
                ended(stream, ending, now, core);
                false
            }
        });
        self.accept(cx, now, core) | self.receive(cx, now, core) | moved
    }

    /// When a time-out of the sockets is due.
    fn wake_at(&self, now: MonotonicTime) -> MonotonicTime {
        let streams = self.streams.iter().filter_map(Stream::wake_at);
        let quiet = self.datagrams.iter().map(|one| one.quiet_until).chain([self.accept_after]);
        streams.chain(quiet.filter(|at| now < *at)).min().unwrap_or(MonotonicTime::MAX)
    }

    fn close(&mut self, core: &mut Core) {
        for mut stream in self.streams.drain(..) {
            stream.leave(core, false);
            let _ = stream.shut_down();
        }
    }

    fn accept(&mut self, cx: &mut Context<'_>, now: MonotonicTime, core: &mut Core) -> bool {
        if now < self.accept_after {
            return false;
        }
        match self.listener.poll_accept(cx) {
            Poll::Pending => return false,
            Poll::Ready(Ok((tcp, peer))) => self.open(tcp, peer, now, core),
            Poll::Ready(Err(error)) => {
                tracing::warn!(%error, "cannot accept a stream");
                self.accept_after = now + RETRY;
            }
        }
        true
    }

    fn open(&mut self, tcp: TcpStream, peer: SocketAddr, now: MonotonicTime, core: &mut Core) {
        let (SocketAddr::V4(peer), Ok(SocketAddr::V4(local))) = (peer, tcp.local_addr()) else { return };
        if !core.admits(peer) {
            if core.limit.admits(now, LineKind::Stream, host(peer)) {
                tracing::warn!(%peer, at = %local, "stream refused: the host is in neither `controllers` nor `tools`");
            }
            core.statistics.refused += 1;
            return;
        }
        let crowded = self.streams.len() >= STREAMS_MAX;
        let slot = if crowded { Err(NoRoom::All) } else { core.adapter.open(now, peer) };
        let slot = match slot {
            Ok(slot) => slot,
            Err(error) => {
                if core.limit.admits(now, LineKind::Stream, host(peer)) {
                    tracing::warn!(%peer, at = %local, "stream refused: {error}");
                }
                core.statistics.refused += 1;
                return;
            }
        };
        if let Err(error) = prepare(&tcp) {
            tracing::debug!(%peer, %error, "a stream cannot be set up as it should be");
        }
        core.statistics.accepted += 1;
        tracing::debug!(%peer, at = %local, "stream opened");
        if let Some(tap) = &mut core.tap {
            tap.opened(realtime_now(), peer, local);
        }
        self.streams.push(Stream::new(tcp, (peer, local), slot, self.stall_limit));
    }

    /// Takes one datagram of each socket and answers it.
    fn receive(&mut self, cx: &mut Context<'_>, now: MonotonicTime, core: &mut Core) -> bool {
        let mut moved = false;
        for index in 0..self.datagrams.len() {
            let Datagrams { socket, to, quiet_until } = &mut self.datagrams[index];
            if now < *quiet_until {
                continue;
            }
            let mut buffer = ReadBuf::new(&mut self.buffer[..]);
            let from = match socket.poll_recv_from(cx, &mut buffer) {
                Poll::Pending => continue,
                Poll::Ready(Ok(SocketAddr::V4(from))) => from,
                Poll::Ready(Ok(SocketAddr::V6(_))) => continue,
                Poll::Ready(Err(error)) => {
                    tracing::debug!(at = %to, %error, "cannot receive datagrams");
                    *quiet_until = now + RETRY;
                    continue;
                }
            };
            moved = true;
            let Some((answer, len)) = core.datagram(from, *to, buffer.filled()) else { continue };
            // A full send buffer loses a datagram, as the network may.
            let sent = self.datagrams[0].socket.try_send_to(&answer[..len], SocketAddr::V4(from));
            if let Err(error) = sent {
                core.statistics.datagrams_unsent += 1;
                tracing::debug!(peer = %from, %error, "an answer cannot be sent");
            }
        }
        moved
    }
}

/// Lets go of a stream that has ended.
fn ended(stream: &mut Stream, ending: Ending, now: MonotonicTime, core: &mut Core) {
    let peer = stream.peer;
    match ending {
        Ending::Stalled => {
            core.statistics.stalled += 1;
            if core.limit.admits(now, LineKind::Stalled, host(peer)) {
                tracing::warn!(%peer, "stream closed: the peer does not read what is sent to it");
            }
        }
        Ending::Failed(error) => tracing::debug!(%peer, %error, "stream broken"),
        Ending::Closed => {
            if let Err(error) = stream.shut_down() {
                tracing::debug!(%peer, %error, "stream broken");
            }
        }
    }
    stream.leave(core, false);
}
