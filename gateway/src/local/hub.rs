//! The hub of local control: between the sessions of clients and the queues of the engine.
//!
//! ```text
//! Session --ToHub--> Hub --queue--> engine
//!         <--Answer--    <--queue--
//! ```
//!
//! A session belongs to a client on the Unix socket or to one on the page: the engine sees no difference. When a session is dropped, for
//! whatever reason, its axes stop.

use std::collections::{HashMap, VecDeque};
use std::fmt;
use std::fmt::Write as _;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use tokio::sync::mpsc;

use super::attributes::Attributes;
use super::protocol::{self, NamedParameter};
use super::session::Session;
use crate::bundle::Sources;
use crate::engine::direct::{DirectAnswer, DirectEnd, DirectRequest};
use crate::engine::local::{Answer, ClientEnd, ClientId, Request};
use crate::history::{LogQuery, Selection};
use crate::line_limit::{LineKind, LineLimit, Peer};
use crate::parameter::known::Catalogue;
use crate::sys::clock::monotonic_now;

/// Orders of a client without an answer.
pub(super) const PENDING_MAX: usize = 32;

/// How often the queues of the engine are looked at.
const HUB_INTERVAL: Duration = Duration::from_millis(2);

/// What the clients need to know of the gateway.
#[derive(Debug)]
pub struct Shared {
    /// Names of the axes in the order of the configuration.
    pub names: Vec<String>,
    /// Parameters that can be read and written by name.
    pub parameters: Vec<NamedParameter>,
    /// What is known of the drives.
    pub catalogue: Catalogue,
    /// What success means for each attribute.
    pub attributes: Attributes,
    /// How many lines clients can have written into the log.
    pub limit: Arc<LineLimit>,
    /// The gateway itself.
    pub sources: Arc<Sources>,
}

impl Shared {
    /// Whether a line about this peer is to be written.
    pub(super) fn admits(&self, kind: LineKind, peer: Peer) -> bool {
        self.limit.admits(monotonic_now(), kind, peer)
    }

    /// The whole gateway, as the reply to `box`.
    pub(super) fn overview(&self) -> String {
        let overview = self.sources.overview();
        // The object has texts, numbers and lists, and nothing that JSON does not know.
        let json = serde_json::to_string(&overview).unwrap_or_default();
        format!("ok box {json}\n")
    }

    /// Lines of the log, each as an object.
    pub(super) fn log(&self, query: &LogQuery) -> String {
        let Selection { events, next, missed } = self.sources.histories.events.select(query);
        let mut text = protocol::rows("event", events.iter().map(|event| &**event));
        let _ = writeln!(text, "ok log {} next={next} missed={missed}", events.len());
        text
    }

    /// The faults of an axis or of all, newest first, each as an object.
    pub(super) fn faults(&self, axis: Option<usize>) -> String {
        let name = axis.and_then(|axis| self.names.get(axis)).map(String::as_str);
        let records = self.sources.histories.faults.list(name);
        let mut text = protocol::rows("fault", &records);
        let _ = writeln!(text, "ok faults {}", records.len());
        text
    }

    /// The first contacts, newest first, each as an object.
    pub(super) fn contacts(&self) -> String {
        let recording = self.sources.recording.as_ref();
        let contacts = recording.map(|recording| recording.contacts()).unwrap_or_default();
        let mut text = protocol::rows("contact", &contacts);
        let _ = writeln!(text, "ok contacts {}", contacts.len());
        text
    }

    /// The state of an axis in the words of the protocol.
    pub(super) fn state(&self, axis: usize) -> String {
        let Sources { status, installation, .. } = &*self.sources;
        let (status, named) = (status.read(), installation.axes.get(axis));
        named
            .zip(status.axes.get(axis))
            .map_or_else(String::new, |(named, axis)| protocol::state(axis, named.kind))
    }
}

/// Who a client is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Who {
    /// A process of a user of this host, on the Unix socket.
    User(u32),
    /// A host, over HTTP.
    Host(SocketAddr),
}

impl Who {
    /// Whose lines of the log are counted together.
    #[must_use]
    pub const fn peer(self) -> Peer {
        match self {
            Self::User(uid) => Peer::User(uid),
            Self::Host(address) => Peer::Host(address.ip()),
        }
    }
}

impl fmt::Display for Who {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::User(uid) => write!(f, "user {uid}"),
            Self::Host(address) => write!(f, "{address}"),
        }
    }
}

/// From a session to the hub. What waits here is bounded by the requests that each session may have without an answer.
#[derive(Debug)]
pub(super) enum ToHub {
    Joined { client: ClientId, answers: mpsc::Sender<ToClient> },
    Ask(Request),
    Access(DirectRequest),
    Gone { client: ClientId },
}

/// From the hub to a session.
#[derive(Debug)]
pub(super) enum ToClient {
    Answer(Answer),
    Accessed(DirectAnswer),
}

/// Where sessions begin.
#[derive(Debug, Clone)]
pub struct Door {
    shared: Arc<Shared>,
    to_hub: mpsc::UnboundedSender<ToHub>,
    last: Arc<AtomicU32>,
}

impl Door {
    /// A session for a client. How many there are at once is up to the caller.
    #[must_use]
    pub fn enter(&self, who: Who) -> Session {
        // Four thousand million connections do not come in the life of a gateway.
        let client: ClientId = self.last.fetch_add(1, Ordering::Relaxed).wrapping_add(1).max(1);
        let (answers, of_hub) = mpsc::channel(PENDING_MAX);
        // The hub has gone only with the gateway: the session then has no answers.
        let _ = self.to_hub.send(ToHub::Joined { client, answers });
        Session::new(client, who, Arc::clone(&self.shared), self.to_hub.clone(), of_hub)
    }

    /// What is known of the gateway.
    pub(super) fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }
}

/// Passes requests and answers on.
#[derive(Debug)]
pub struct Hub {
    end: ClientEnd,
    direct: DirectEnd,
    from_clients: mpsc::UnboundedReceiver<ToHub>,
}

impl Hub {
    /// A hub at these ends of the queues of the engine, and where its sessions begin.
    #[must_use]
    pub fn new(shared: Shared, (end, direct): (ClientEnd, DirectEnd)) -> (Self, Door) {
        let (to_hub, from_clients) = mpsc::unbounded_channel();
        let door = Door { shared: Arc::new(shared), to_hub, last: Arc::default() };
        (Self { end, direct, from_clients }, door)
    }

    /// Passes on until the future is dropped; all axes of clients stop then.
    pub async fn run(self) {
        let Self { mut end, mut direct, mut from_clients } = self;
        let mut clients: HashMap<ClientId, mpsc::Sender<ToClient>> = HashMap::new();
        let mut waiting: VecDeque<Request> = VecDeque::new();
        let mut accesses: VecDeque<DirectRequest> = VecDeque::new();
        let mut interval = tokio::time::interval(HUB_INTERVAL);
        interval.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                Some(message) = from_clients.recv() => match message {
                    ToHub::Joined { client, answers } => drop(clients.insert(client, answers)),
                    ToHub::Ask(request) => waiting.push_back(request),
                    ToHub::Access(request) => accesses.push_back(request),
                    ToHub::Gone { client } => {
                        clients.remove(&client);
                        accesses.retain(|request| request.client != client);
                        waiting.push_back(Request::Gone { client });
                    }
                },
                _ = interval.tick() => {}
            }
            while let Some(request) = waiting.pop_front() {
                if let Err(rtrb::PushError::Full(request)) = end.requests.push(request) {
                    waiting.push_front(request);
                    break;
                }
            }
            while let Some(request) = accesses.pop_front() {
                if let Err(rtrb::PushError::Full(request)) = direct.requests.push(request) {
                    accesses.push_front(request);
                    break;
                }
            }
            while let Ok(answer) = end.answers.pop() {
                hand_on(&mut clients, answer.client, ToClient::Answer(answer));
            }
            while let Ok(answer) = direct.answers.pop() {
                hand_on(&mut clients, answer.client, ToClient::Accessed(answer));
            }
        }
    }
}

/// Hands an answer to its client. The channel of one that does not read its replies is full: it is disconnected.
fn hand_on(clients: &mut HashMap<ClientId, mpsc::Sender<ToClient>>, client: ClientId, answer: ToClient) {
    if clients.get(&client).is_some_and(|known| known.try_send(answer).is_err()) {
        clients.remove(&client);
    }
}
