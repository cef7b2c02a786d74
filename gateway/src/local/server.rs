//! The Unix socket of local control: a bounded number of clients, each with its own connection.
//!
//! ```text
//! client task --line--> parse --Request--> hub --queue--> engine
//!             <--reply--             <--Answer--  <--queue--
//! ```
//!
//! A client that disconnects, hangs up, or does not read its replies loses its axes: they stop.

use std::collections::{HashMap, VecDeque};
use std::fmt::Write as _;
use std::io;
use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::{UnixListener, UnixStream};
use tokio::sync::mpsc;
use tracing::{info, warn};

use super::attributes::Attributes;
use super::drive::job::{Ask, Context, Job, Step};
use super::protocol::{self, BadRequest, FileRequest, LINE_MAX, NamedParameter};
use crate::bundle::Sources;
use crate::engine::direct::{DirectAnswer, DirectEnd, DirectRequest};
use crate::engine::local::{Answer, ClientEnd, ClientId, Order, Request};
use crate::history::{LogQuery, Selection};
use crate::line_limit::{LineKind, LineLimit, Peer};
use crate::parameter::known::Catalogue;
use crate::sys::clock::monotonic_now;

/// Clients connected at the same time.
const CLIENTS_MAX: usize = 4;

/// Orders of a client without an answer.
const PENDING_MAX: usize = 32;

/// Requests of all clients that wait for the engine.
const WAITING_MAX: usize = CLIENTS_MAX * PENDING_MAX;

/// How long a client may leave a reply unread.
const WRITE_TIME_OUT: Duration = Duration::from_secs(1);

/// Bytes of a file that a client has to take within [`WRITE_TIME_OUT`].
const PART: usize = 64 * 1_024;

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
    /// Whether a line about clients of this user is to be written.
    fn admits(&self, kind: LineKind, user: Option<u32>) -> bool {
        self.limit.admits(monotonic_now(), kind, user.map_or(Peer::Unknown, Peer::User))
    }

    /// The whole gateway, as the reply to `box`.
    fn overview(&self) -> String {
        let overview = self.sources.overview();
        // The object has texts, numbers and lists, and nothing that JSON does not know.
        let json = serde_json::to_string(&overview).unwrap_or_default();
        format!("ok box {json}\n")
    }

    /// Lines of the log, each as an object.
    fn log(&self, query: &LogQuery) -> String {
        let Selection { events, next, missed } = self.sources.histories.events.select(query);
        let mut text = String::new();
        for event in &events {
            let _ = writeln!(text, "event {}", serde_json::to_string(&**event).unwrap_or_default());
        }
        let _ = writeln!(text, "ok log {} next={next} missed={missed}", events.len());
        text
    }

    /// The faults of an axis or of all, newest first, each as an object.
    fn faults(&self, axis: Option<usize>) -> String {
        let name = axis.and_then(|axis| self.names.get(axis)).map(String::as_str);
        let records = self.sources.histories.faults.list(name);
        let mut text = String::new();
        for record in &records {
            let _ = writeln!(text, "fault {}", serde_json::to_string(record).unwrap_or_default());
        }
        let _ = writeln!(text, "ok faults {}", records.len());
        text
    }

    /// The first contacts, newest first, each as an object.
    fn contacts(&self) -> String {
        let recording = self.sources.recording.as_ref();
        let contacts = recording.map(|recording| recording.contacts()).unwrap_or_default();
        let mut text = String::new();
        for contact in &contacts {
            let _ = writeln!(text, "contact {}", serde_json::to_string(contact).unwrap_or_default());
        }
        let _ = writeln!(text, "ok contacts {}", contacts.len());
        text
    }

    /// The state of an axis in the words of the protocol.
    fn state(&self, axis: usize) -> String {
        let Sources { status, installation, .. } = &*self.sources;
        let (status, named) = (status.read(), installation.axes.get(axis));
        named
            .zip(status.axes.get(axis))
            .map_or_else(String::new, |(named, axis)| protocol::state(axis, named.kind))
    }
}

/// The file of a socket, removed when this is dropped.
#[derive(Debug)]
pub struct SocketFile(PathBuf);

impl Drop for SocketFile {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// The server of the socket.
#[derive(Debug)]
pub struct LocalServer {
    listener: UnixListener,
    shared: Arc<Shared>,
    end: ClientEnd,
    direct: DirectEnd,
    uid: u32,
}

/// From a client's task to the hub.
#[derive(Debug)]
enum ToHub {
    Ask(Request),
    Access(DirectRequest),
    Gone { client: ClientId },
}

/// From the hub to a client's task.
#[derive(Debug)]
enum ToClient {
    Answer(Answer),
    Accessed(DirectAnswer),
}

impl LocalServer {
    /// Creates the socket, for this user only. A socket that a gateway left behind is replaced.
    ///
    /// # Errors
    /// The path is in use, or cannot be created.
    pub fn bind(
        path: &Path,
        shared: Shared,
        (end, direct): (ClientEnd, DirectEnd),
    ) -> io::Result<(Self, SocketFile)> {
        if let Ok(known) = std::fs::symlink_metadata(path) {
            if !known.file_type().is_socket() {
                return Err(io::Error::new(
                    io::ErrorKind::AlreadyExists,
                    "a file that is not a socket is there",
                ));
            }
            if std::os::unix::net::UnixStream::connect(path).is_ok() {
                return Err(io::Error::new(io::ErrorKind::AddrInUse, "another process serves this socket"));
            }
            std::fs::remove_file(path)?;
        }
        let listener = UnixListener::bind(path)?;
        let file = SocketFile(path.to_owned());
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600))?;
        let uid = rustix::process::getuid().as_raw();
        Ok((Self { listener, shared: Arc::new(shared), end, direct, uid }, file))
    }

    /// Serves clients until the future is dropped.
    pub async fn run(self) {
        let Self { listener, shared, mut end, mut direct, uid } = self;
        let (to_hub, mut from_clients) = mpsc::channel::<ToHub>(WAITING_MAX);
        let mut clients: HashMap<ClientId, mpsc::Sender<ToClient>> = HashMap::new();
        let mut waiting: VecDeque<Request> = VecDeque::new();
        let mut accesses: VecDeque<DirectRequest> = VecDeque::new();
        let mut last: ClientId = 0;
        let mut interval = tokio::time::interval(HUB_INTERVAL);
        interval.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                accepted = listener.accept() => match accepted {
                    Ok((stream, _)) => {
                        if let Some((stream, user)) = admit(stream, uid, clients.len(), &shared) {
                            last = last.wrapping_add(1).max(1);
                            let (answers, for_client) = mpsc::channel(PENDING_MAX);
                            clients.insert(last, answers);
                            let client = Client { id: last, user, shared: Arc::clone(&shared), to_hub: to_hub.clone() };
                            tokio::spawn(client.run(stream, for_client));
                        }
                    }
                    Err(error) => {
                        warn!(%error, "local control cannot accept a client");
                        tokio::time::sleep(Duration::from_millis(100)).await;
                    }
                },
                Some(message) = from_clients.recv() => match message {
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

/// Lets a client in: one of the gateway's own user or of root, as long as there is room.
fn admit(stream: UnixStream, uid: u32, clients: usize, shared: &Shared) -> Option<(UnixStream, u32)> {
    let refused = |user| shared.admits(LineKind::LocalRefused, user);
    let user = match stream.peer_cred() {
        Ok(peer) if may_connect(peer.uid(), uid) => peer.uid(),
        Ok(peer) => {
            if refused(Some(peer.uid())) {
                warn!(uid = peer.uid(), "local control refused a client of another user");
            }
            return None;
        }
        Err(error) => {
            if refused(None) {
                warn!(%error, "local control refused a client of an unknown user");
            }
            return None;
        }
    };
    if clients >= CLIENTS_MAX {
        if refused(Some(user)) {
            warn!(uid = user, limit = CLIENTS_MAX, "local control refused a client: too many are connected");
        }
        return None;
    }
    Some((stream, user))
}

/// Whether a user may control axes: the one that runs the gateway, and root.
const fn may_connect(peer: u32, own: u32) -> bool {
    peer == own || peer == 0
}

/// The task of one client.
struct Client {
    id: ClientId,
    /// Whose process it is.
    user: u32,
    shared: Arc<Shared>,
    to_hub: mpsc::Sender<ToHub>,
}

impl Client {
    async fn run(self, mut stream: UnixStream, answers: mpsc::Receiver<ToClient>) {
        // A program that asks for the state every second is not worth two lines each time.
        let shown = self.shared.admits(LineKind::LocalClient, Some(self.user));
        if shown {
            info!(client = self.id, "local control: client connected");
        }
        let ended = self.serve(&mut stream, answers).await;
        let _ = self.to_hub.send(ToHub::Gone { client: self.id }).await;
        match ended {
            Ok(()) if shown => info!(client = self.id, "local control: client disconnected"),
            Ok(()) => {}
            Err(error) if self.shared.admits(LineKind::LocalRefused, Some(self.user)) => {
                warn!(client = self.id, %error, "local control: connection lost");
            }
            Err(_) => {}
        }
    }

    async fn serve(&self, stream: &mut UnixStream, mut answers: mpsc::Receiver<ToClient>) -> io::Result<()> {
        let mut lines = Lines::default();
        let mut pending: HashMap<u32, Accepted> = HashMap::new();
        let mut last = 0_u32;
        let mut buffer = [0; 512];
        loop {
            let reply = tokio::select! {
                read = stream.read(&mut buffer) => {
                    let len = read?;
                    if len == 0 {
                        return Ok(());
                    }
                    let mut replies = String::new();
                    for byte in &buffer[..len] {
                        let Some(line) = lines.push(*byte) else { continue };
                        last = last.wrapping_add(1);
                        let request = match self.parse(&line) {
                            Ok(protocol::Request::File(wanted)) => {
                                write(stream, std::mem::take(&mut replies).as_bytes()).await?;
                                self.send_file(stream, wanted).await?;
                                continue;
                            }
                            Ok(request) => self.request(last, request, &line, pending.len()),
                            Err(reply) => Err(reply),
                        };
                        match request {
                            Ok((accepted, request)) => {
                                pending.insert(last, accepted);
                                if self.to_hub.send(request).await.is_err() {
                                    return Ok(());
                                }
                            }
                            Err(reply) => replies.push_str(&reply),
                        }
                    }
                    replies
                }
                answer = answers.recv() => {
                    let Some(answer) = answer else {
                        return Err(unread());
                    };
                    let next = match answer {
                        ToClient::Answer(answer) => {
                            let accepted = pending.remove(&answer.id);
                            Err(accepted.map(|accepted| self.reply(&accepted, &answer)).unwrap_or_default())
                        }
                        ToClient::Accessed(answer) => self.accessed(answer, &mut pending),
                    };
                    match next {
                        Err(reply) => reply,
                        Ok(request) => match self.to_hub.send(ToHub::Access(request)).await {
                            Ok(()) => continue,
                            Err(_) => return Ok(()),
                        },
                    }
                }
            };
            write(stream, reply.as_bytes()).await?;
        }
    }

    /// What a line asks for; or the reply to it.
    fn parse(&self, line: &Result<String, BadRequest>) -> Result<protocol::Request, String> {
        let line = line.as_ref().map_err(|error| protocol::bad("-", error))?;
        let Shared { names, parameters, .. } = &*self.shared;
        protocol::parse(line, names, parameters).map_err(|error| protocol::bad(line, &error))
    }

    /// Makes a file and sends it: a line with its length, then its bytes.
    async fn send_file(&self, stream: &mut UnixStream, wanted: FileRequest) -> io::Result<()> {
        let sources = Arc::clone(&self.shared.sources);
        // It takes tens of milliseconds, and waits for the disk.
        let made = tokio::task::spawn_blocking(move || make(&sources, wanted)).await?;
        let word = wanted.word();
        match made {
            Ok(file) => {
                write(stream, format!("ok {word} bytes={}\n", file.len()).as_bytes()).await?;
                for part in file.chunks(PART) {
                    write(stream, part).await?;
                }
                Ok(())
            }
            Err(text) => write(stream, format!("error {word} - recording: {text}\n").as_bytes()).await,
        }
    }

    /// What a request asks the engine for, under the number `id`; or the reply to it.
    fn request(
        &self,
        id: u32,
        request: protocol::Request,
        line: &Result<String, BadRequest>,
        pending: usize,
    ) -> Result<(Accepted, ToHub), String> {
        let line = line.as_ref().map_or("-", String::as_str);
        let Shared { names, parameters, .. } = &*self.shared;
        let number = |axis: usize| u8::try_from(axis).unwrap_or(u8::MAX);
        let client = self.id;
        match request {
            protocol::Request::Box => Err(self.shared.overview()),
            protocol::Request::Axes => Err(protocol::list(names, |axis| self.shared.state(axis))),
            protocol::Request::Status { axis } => {
                Err(protocol::done("status", &names[axis], &self.shared.state(axis)))
            }
            protocol::Request::Parameters => Err(protocol::parameter_list(parameters)),
            protocol::Request::Log(query) => Err(self.shared.log(&query)),
            protocol::Request::Faults { axis } => Err(self.shared.faults(axis)),
            protocol::Request::Attributes { axis } => Err(self.shared.attributes.reply(axis, &names[axis])),
            protocol::Request::Contacts => Err(self.shared.contacts()),
            // Its reply is not a text: see `send_file`.
            protocol::Request::File(_) => Err(String::new()),
            _ if pending >= PENDING_MAX => Err(protocol::bad(line, &BadRequest::TooMany)),
            protocol::Request::Order { axis, order } => {
                let request = Request::Order { client, id, axis: number(axis), order };
                Ok((Accepted { axis, what: What::Order(order) }, ToHub::Ask(request)))
            }
            protocol::Request::Parameter { axis, parameter, wanted } => {
                let named = parameters[parameter].clone();
                let parameter = named.parameter;
                let request = Request::Parameter { client, id, axis: number(axis), parameter, wanted };
                Ok((Accepted { axis, what: What::Parameter(named, wanted) }, ToHub::Ask(request)))
            }
            protocol::Request::Drive { axis, ask } => self.begin(id, axis, ask),
        }
    }

    /// Begins with a request for parameters of a drive; or the reply to it.
    fn begin(&self, id: u32, axis: usize, ask: Ask) -> Result<(Accepted, ToHub), String> {
        let (job, step) = self.with_context(axis, |context| Job::begin(ask, context))?;
        match step {
            Step::Access(..) => {
                let request = self.access(id, axis, step)?;
                Ok((Accepted { axis, what: What::Drive(Box::new(job)) }, ToHub::Access(request)))
            }
            Step::Reply(reply) => Err(reply),
        }
    }

    /// Goes on with a request when its drive has answered: the next access, or the reply.
    fn accessed(
        &self,
        answer: DirectAnswer,
        pending: &mut HashMap<u32, Accepted>,
    ) -> Result<DirectRequest, String> {
        let id = answer.id;
        let Some(Accepted { axis, what: What::Drive(job) }) = pending.get_mut(&id) else {
            return Err(String::new());
        };
        let axis = *axis;
        let next = self.access(id, axis, self.with_context(axis, |context| job.take(answer, context)));
        if next.is_err() {
            pending.remove(&id);
        }
        next
    }

    /// What a step asks of the engine, or the reply that it is.
    fn access(&self, id: u32, axis: usize, step: Step) -> Result<DirectRequest, String> {
        match step {
            Step::Access(target, direction, data) => {
                let axis = u8::try_from(axis).unwrap_or(u8::MAX);
                Ok(DirectRequest { client: self.id, id, axis, target, direction, data })
            }
            Step::Reply(reply) => Err(reply),
        }
    }

    /// Calls with what is known of the drive of an axis.
    fn with_context<T>(&self, axis: usize, with: impl FnOnce(&Context<'_>) -> T) -> T {
        let Shared { names, parameters, catalogue, .. } = &*self.shared;
        let axis_name = names.get(axis).map_or("-", String::as_str);
        with(&Context { axis: axis_name, bus: catalogue.bus(axis), catalogue, parameters })
    }

    fn reply(&self, Accepted { axis, what }: &Accepted, answer: &Answer) -> String {
        let name = self.shared.names.get(*axis).map_or("-", String::as_str);
        let word = match what {
            What::Order(order) => order.name(),
            What::Parameter(_, None) => "read",
            What::Parameter(_, Some(_)) => "write",
            // Its accesses are answered by themselves.
            What::Drive(_) => return String::new(),
        };
        match (&answer.result, what) {
            (Ok(Some(value)), What::Parameter(named, _)) => protocol::accessed(word, name, named, *value),
            (Ok(_), _) => protocol::done(word, name, &self.shared.state(*axis)),
            (Err(failure), _) => protocol::failed(word, name, failure),
        }
    }
}

/// Makes a file; otherwise why there is none.
fn make(sources: &Sources, wanted: FileRequest) -> Result<Vec<u8>, String> {
    let recording = || {
        let off = "nothing is recorded: `[recording]` has `seconds = 0`";
        sources.recording.as_ref().ok_or_else(|| off.to_owned())
    };
    let made = match wanted {
        FileRequest::Recording(last) => {
            let recording = recording()?;
            recording.take(last.unwrap_or_else(|| recording.span()))
        }
        FileRequest::Contact(number) => recording()?.take_contact(number),
        FileRequest::Bundle => sources.bundle(),
    };
    made.map_err(|error| error.to_string())
}

/// Writes to a client that reads.
async fn write(stream: &mut UnixStream, bytes: &[u8]) -> io::Result<()> {
    let written = tokio::time::timeout(WRITE_TIME_OUT, stream.write_all(bytes)).await;
    written.map_err(|_| unread())?
}

fn unread() -> io::Error {
    io::Error::new(io::ErrorKind::TimedOut, "the client does not read its replies")
}

/// A request that goes to the engine.
struct Accepted {
    axis: usize,
    what: What,
}

/// What is asked of an axis or its drive.
enum What {
    Order(Order),
    Parameter(NamedParameter, Option<i64>),
    /// A request for parameters by the numbers of the drive.
    Drive(Box<Job>),
}

/// Cuts a stream of bytes into lines of bounded length.
#[derive(Debug, Default)]
struct Lines {
    line: Vec<u8>,
    too_long: bool,
}

impl Lines {
    /// Takes a byte; returns the line that it ends.
    fn push(&mut self, byte: u8) -> Option<Result<String, BadRequest>> {
        if byte != b'\n' {
            match self.line.len() < LINE_MAX {
                true => self.line.push(byte),
                false => self.too_long = true,
            }
            return None;
        }
        let line = std::mem::take(&mut self.line);
        if std::mem::take(&mut self.too_long) {
            return Some(Err(BadRequest::TooLong));
        }
        let text = String::from_utf8(line).ok().map(|text| text.trim_end_matches('\r').to_owned());
        Some(
            text.filter(|text| !text.contains(|c: char| c.is_control() && c != '\t'))
                .ok_or(BadRequest::NotText),
        )
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::MetadataExt as _;

    use profile_generic::fault::{Fault, FaultCause};
    use profile_generic::parameter::{Access, Parameter};
    use profile_generic::time::SystemTime;
    use profile_sercos::wire::attribute::{Attribute, Format, ItemLength};
    use profile_sercos::wire::idn::Idn;
    use profile_sercos::wire::svc::Element;
    use tokio::io::{AsyncBufReadExt as _, BufReader};

    use super::super::installation::{Installation, NamedAxis};
    use super::super::overview::Overview;
    use super::*;
    use crate::config::{AxisKind, TimeSource};
    use crate::engine::direct::{DirectFailure, Direction, Target};
    use crate::engine::local::Failure;
    use crate::engine::notice::Notice;
    use crate::engine::parameter::ParameterFailure;
    use crate::history::{Histories, LogEvent};
    use crate::latest::latest;
    use crate::mapping::Mapping;
    use crate::parameter::known::Bus;
    use crate::status::tests::distinct;
    use crate::time::ptp::FollowerConfig;
    use crate::time::source::TimeView;
    use crate::time::status::TimeStatus;

    /// A server, and the engine's side of its queues.
    struct Bench {
        path: PathBuf,
        histories: Histories,
        requests: rtrb::Consumer<Request>,
        answers: rtrb::Producer<Answer>,
        direct: Direct,
        _file: SocketFile,
        folder: PathBuf,
    }

    type Ends = (ClientEnd, DirectEnd);
    type Direct = (rtrb::Consumer<DirectRequest>, rtrb::Producer<DirectAnswer>);

    fn named((name, kind): (&str, AxisKind)) -> NamedAxis {
        NamedAxis {
            name: name.to_owned(),
            kind,
            bus: 0,
            drive: format!("drive-{name}"),
            address: "address 1".to_owned(),
        }
    }

    fn shared() -> Shared {
        let (publisher, status) = latest(distinct());
        drop(publisher);
        let names = ["x", "y"].map(str::to_owned).to_vec();
        let code = NamedParameter {
            name: "code".to_owned(),
            parameter: Parameter(0x8002),
            unit: "mHz",
            access: Access::Write,
            range: None,
        };
        let follower =
            FollowerConfig { identity: [1; 8], domain: 0, threshold: 10_000, asymmetry: 0, seed: 1 };
        let installation = Installation {
            name: "cell".to_owned(),
            source: TimeSource::Ptp,
            devices: Vec::new(),
            buses: Vec::new(),
            axes: [("x", AxisKind::Rotary), ("y", AxisKind::Linear)].map(named).to_vec(),
        };
        let time = TimeView::of(TimeStatus::ptp(&follower));
        Shared {
            names,
            parameters: vec![code],
            catalogue: Catalogue::new(
                vec![Bus::Sercos, Bus::Devicenet { attributes: Vec::new() }],
                &Mapping::embedded().unwrap(),
            ),
            attributes: Attributes::of_nobody(2),
            limit: Arc::default(),
            sources: Arc::new(Sources { status, installation, time, ..crate::bundle::tests::sources() }),
        }
    }

    /// The queues of a server, and the engine's ends of those of orders and of direct accesses.
    fn queues() -> (Ends, (rtrb::Consumer<Request>, rtrb::Producer<Answer>), Direct) {
        let (requests, taken) = rtrb::RingBuffer::new(8);
        let (given, answers) = rtrb::RingBuffer::new(8);
        let (accesses, asked) = rtrb::RingBuffer::new(8);
        let (accessed, results) = rtrb::RingBuffer::new(8);
        let direct = DirectEnd { requests: accesses, answers: results };
        ((ClientEnd { requests, answers }, direct), (taken, given), (asked, accessed))
    }

    impl Bench {
        fn start(name: &str) -> Self {
            let folder = std::env::temp_dir().join(format!("axisbridge-local-{}-{name}", std::process::id()));
            std::fs::create_dir_all(&folder).unwrap();
            let path = folder.join("socket");
            let (ends, (requests, answers), direct) = queues();
            let shared = shared();
            let histories = shared.sources.histories.clone();
            let (server, file) = LocalServer::bind(&path, shared, ends).unwrap();
            tokio::spawn(server.run());
            Self { path, histories, requests, answers, direct, _file: file, folder }
        }

        async fn connect(&self) -> BufReader<UnixStream> {
            BufReader::new(UnixStream::connect(&self.path).await.unwrap())
        }

        /// The next access that reaches the engine.
        async fn access(&mut self) -> DirectRequest {
            for _ in 0..5_000 {
                if let Ok(request) = self.direct.0.pop() {
                    return request;
                }
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
            panic!("no access reaches the engine");
        }

        /// The next request that reaches the engine.
        async fn request(&mut self) -> Request {
            for _ in 0..5_000 {
                if let Ok(request) = self.requests.pop() {
                    return request;
                }
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
            panic!("no request reaches the engine");
        }
    }

    impl Drop for Bench {
        fn drop(&mut self) {
            let _ = std::fs::remove_dir_all(&self.folder);
        }
    }

    async fn say(client: &mut BufReader<UnixStream>, text: &str) {
        client.get_mut().write_all(text.as_bytes()).await.unwrap();
    }

    async fn hear(client: &mut BufReader<UnixStream>) -> String {
        let mut line = String::new();
        let read = tokio::time::timeout(Duration::from_secs(10), client.read_line(&mut line));
        read.await.expect("a reply").unwrap();
        line
    }

    #[tokio::test]
    async fn an_order_goes_to_the_engine_and_its_answer_comes_back() {
        let mut bench = Bench::start("order");
        let mut client = bench.connect().await;
        say(&mut client, "enable y\r\nstatus x\nreset x\n").await;
        let Request::Order { client: number, id, axis: 1, order: Order::Enable } = bench.request().await
        else {
            panic!("not the enable");
        };
        assert!(
            hear(&mut client).await.starts_with("ok status x state=operating owner=local mode=position ")
        );
        let Request::Order { id: second, axis: 0, order: Order::Reset, .. } = bench.request().await else {
            panic!("not the reset");
        };
        bench.answers.push(Answer { client: number, id: second, result: Err(Failure::Controller) }).unwrap();
        bench.answers.push(Answer { client: number, id, result: Ok(None) }).unwrap();
        assert_eq!(
            hear(&mut client).await,
            "error reset x controller: a controller is connected to the device of this axis\n"
        );
        assert!(hear(&mut client).await.starts_with("ok enable y state=faulted owner=controller "));
        drop(client);
        assert_eq!(bench.request().await, Request::Gone { client: number });
    }

    #[tokio::test]
    async fn a_parameter_is_asked_of_the_engine_and_its_value_comes_back() {
        let mut bench = Bench::start("parameter");
        let mut client = bench.connect().await;
        say(&mut client, "parameters\nread y code\nwrite x code -3\nwrite x mode 1\n").await;
        assert_eq!(hear(&mut client).await, "parameter code access=write unit=mHz\n");
        assert_eq!(hear(&mut client).await, "ok parameters 1\n");
        assert!(hear(&mut client).await.starts_with("error write - no-parameter: unknown parameter `mode`"));
        let (read, write) = (bench.request().await, bench.request().await);
        let Request::Parameter { client: number, id, axis: 1, parameter: Parameter(0x8002), wanted: None } =
            read
        else {
            panic!("{read:?}");
        };
        let Request::Parameter { id: second, axis: 0, wanted: Some(-3), .. } = write else {
            panic!("{write:?}");
        };
        bench.answers.push(Answer { client: number, id, result: Ok(Some(77)) }).unwrap();
        let failure = Failure::Parameter(ParameterFailure::Value);
        bench.answers.push(Answer { client: number, id: second, result: Err(failure) }).unwrap();
        assert_eq!(hear(&mut client).await, "ok read y code=77 unit=mHz\n");
        assert_eq!(hear(&mut client).await, "error write x value: the value is out of range\n");
    }

    #[tokio::test]
    async fn the_whole_gateway_is_one_object_on_one_line() {
        let bench = Bench::start("box");
        let mut client = bench.connect().await;
        say(&mut client, "box\n").await;
        let reply = hear(&mut client).await;
        let json = reply.strip_prefix("ok box ").expect("the reply to `box`");
        let overview: Overview = serde_json::from_str(json).unwrap();
        let axes: Vec<_> =
            overview.axes.iter().map(|axis| (axis.name.as_str(), axis.unit.as_str())).collect();
        assert_eq!((overview.name.as_str(), axes), ("cell", vec![("x", "rev"), ("y", "mm")]));
        assert_eq!((overview.time.source.as_str(), overview.time.synchronized), ("ptp", false));
        assert_eq!(overview.cycles.phase_error_ns, -789);
    }

    #[tokio::test]
    async fn files_are_sent_with_their_length_between_other_replies() {
        let bench = Bench::start("files");
        let mut client = bench.connect().await;
        say(&mut client, "contacts\nattributes y\nrecord last=5\ncontact number=3\nbundle\naxes\n").await;
        assert_eq!(hear(&mut client).await, "ok contacts 0\n");
        let nobodys = "error attributes y no-attributes: no CIP Motion device has the axis\n";
        assert_eq!(hear(&mut client).await, nobodys);
        let file = async |client: &mut BufReader<UnixStream>, word: &str| {
            let head = hear(client).await;
            let length = head.strip_prefix(&format!("ok {word} bytes=")).expect(&head).trim_end();
            let mut bytes = vec![0; length.parse().unwrap()];
            client.read_exact(&mut bytes).await.unwrap();
            bytes
        };
        let recording = file(&mut client, "record").await;
        assert_eq!(recording[..4], [0x0A, 0x0D, 0x0D, 0x0A]);
        assert_eq!(hear(&mut client).await, "error contact - recording: there is no contact 3\n");
        let bundle = file(&mut client, "bundle").await;
        assert!(bundle.starts_with(b"axisbridge-bundle/recording.pcapng\0"));
        assert!(hear(&mut client).await.starts_with("axis x state="));
    }

    #[tokio::test]
    async fn histories_are_objects_on_lines_of_their_own() {
        let bench = Bench::start("histories");
        let mut client = bench.connect().await;
        say(&mut client, "log\nfaults\nfaults y\n").await;
        assert_eq!(hear(&mut client).await, "ok log 0 next=0 missed=0\n");
        assert_eq!(hear(&mut client).await, "ok faults 0\n");
        assert_eq!(hear(&mut client).await, "ok faults 0\n");
        for (axis, text) in [(None, "one"), (Some("y"), "two"), (None, "three")] {
            let axis = axis.map(str::to_owned);
            let text = text.to_owned();
            bench.histories.events.push(LogEvent {
                axis,
                text,
                level: "info".to_owned(),
                ..LogEvent::default()
            });
        }
        let fault = Fault::new(FaultCause::OVER_CURRENT, SystemTime(5));
        let fault = Notice::Fault { axis: 1, fault, loss: None, trip: None, jump: None };
        bench.histories.faults.note(&fault, &shared().sources.installation);
        say(&mut client, "log after=1 lines=1\nlog axis=y level=info\nfaults\nlog axis=z\nlog lines=0\n")
            .await;
        let object = |line: String, word: &str| -> serde_json::Value {
            serde_json::from_str(line.strip_prefix(word).unwrap_or_else(|| panic!("{line}"))).unwrap()
        };
        assert_eq!(object(hear(&mut client).await, "event ")["text"], "two");
        assert_eq!(hear(&mut client).await, "ok log 1 next=2 missed=0\n");
        assert_eq!(object(hear(&mut client).await, "event ")["number"], 2);
        assert_eq!(hear(&mut client).await, "ok log 1 next=3 missed=0\n");
        let fault = object(hear(&mut client).await, "fault ");
        assert_eq!(
            (&fault["axis"], &fault["cause"], &fault["end"]),
            (&"y".into(), &"over_current".into(), &serde_json::Value::Null)
        );
        assert_eq!(hear(&mut client).await, "ok faults 1\n");
        assert_eq!(hear(&mut client).await, "error log - no-axis: unknown axis `z`: expected x, y\n");
        let wrong = "error log - syntax: unexpected `lines=0`: expected lines=1 to lines=10000\n";
        assert_eq!(hear(&mut client).await, wrong);
    }

    #[tokio::test]
    async fn a_line_that_is_no_request_gets_an_error_and_the_next_one_counts() {
        let bench = Bench::start("line");
        let mut client = bench.connect().await;
        let long = "x".repeat(LINE_MAX + 1);
        say(&mut client, &format!("{long}\nenable \u{1b}[2J\nwhat\naxes\n")).await;
        assert_eq!(hear(&mut client).await, "error - - syntax: the line is longer than 4096 bytes\n");
        assert_eq!(hear(&mut client).await, "error - - syntax: the line is not printable UTF-8 text\n");
        assert!(hear(&mut client).await.starts_with("error what - syntax: unknown word `what`"));
        assert!(hear(&mut client).await.starts_with("axis x state="));
        assert!(hear(&mut client).await.starts_with("axis y state="));
        assert_eq!(hear(&mut client).await, "ok axes 2\n");
    }

    #[tokio::test]
    async fn a_parameter_of_a_drive_takes_its_accesses_one_after_the_other() {
        let mut bench = Bench::start("drive");
        let mut client = bench.connect().await;
        say(&mut client, "read y S-0-0104\nread x S-0-0104 brief\n").await;
        let other = "error read y no-parameter: S-0-0104 is a number of SERCOS drives: the drive of this axis is another one\n";
        assert_eq!(hear(&mut client).await, other, "the engine is not asked");
        let gain = Idn::standard(104);
        let attribute = Attribute::new(ItemLength::Two, Format::Unsigned).with_decimals(2);
        for (element, result, data) in
            [(Element::Data, Ok(Some(attribute)), &[0x96, 0][..]), (Element::Name, Ok(None), b"Own name")]
        {
            let DirectRequest { client, id, axis, target, direction, data: mut buffer } =
                bench.access().await;
            assert_eq!((axis, target, direction), (0, Target::Element(gain, element), Direction::Read));
            buffer.extend_from_slice(data);
            bench.direct.1.push(DirectAnswer { client, id, result, data: buffer }).unwrap();
        }
        let expected = "ok read x {\"id\":\"S-0-0104\",\"name\":\"Own name\",\"type\":\"2 byte unsigned, 2 decimals\",\
                        \"attribute\":\"0x02110001\",\"value\":\"1.50\",\"data\":\"9600\"}\n";
        assert_eq!(hear(&mut client).await, expected);
        // The answer to a client that is gone is for nobody, and the next client is served.
        say(&mut client, "read x S-0-0104\n").await;
        let DirectRequest { client: gone, id, data, .. } = bench.access().await;
        drop(client);
        bench
            .direct
            .1
            .push(DirectAnswer { client: gone, id, result: Err(DirectFailure::Unanswered), data })
            .unwrap();
        let mut client = bench.connect().await;
        say(&mut client, "list y\n").await;
        assert_eq!(hear(&mut client).await, "parameter code access=write unit=mHz\n");
        assert_eq!(hear(&mut client).await, "ok list y 1 bus=devicenet source=dictionary\n");
    }

    #[tokio::test]
    async fn one_client_too_many_is_disconnected() {
        let bench = Bench::start("many");
        let mut clients = Vec::new();
        for _ in 0..CLIENTS_MAX {
            let mut client = bench.connect().await;
            say(&mut client, "axes\n").await;
            assert!(hear(&mut client).await.starts_with("axis x "));
            clients.push(client);
        }
        let mut client = bench.connect().await;
        assert_eq!(hear(&mut client).await, "", "the connection ends");
    }

    #[test]
    fn only_root_and_the_user_of_the_gateway_may_connect() {
        let users = [0, 1000, 1001].map(|peer| [0, 1000].map(|own| may_connect(peer, own)));
        assert_eq!(users, [[true, true], [false, true], [false, false]]);
    }

    #[tokio::test]
    async fn the_socket_is_this_users_and_replaces_only_what_nobody_serves() {
        let bench = Bench::start("file");
        assert_eq!(std::fs::metadata(&bench.path).unwrap().mode() & 0o777, 0o600);
        let again = LocalServer::bind(&bench.path, shared(), queues().0);
        assert_eq!(again.expect_err("it is served").kind(), io::ErrorKind::AddrInUse);
        let file = bench.path.with_extension("txt");
        std::fs::write(&file, "kept").unwrap();
        let refused = LocalServer::bind(&file, shared(), queues().0);
        assert_eq!(refused.expect_err("a file").kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "kept");
        let stale = bench.path.with_extension("stale");
        drop(std::os::unix::net::UnixListener::bind(&stale).unwrap());
        let (_server, guard) = LocalServer::bind(&stale, shared(), queues().0).expect("nobody serves it");
        drop(guard);
        assert!(!stale.exists(), "removed at the end");
    }
}
