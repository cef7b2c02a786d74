//! The Unix socket of local control: a bounded number of clients, each with its own connection.
//!
//! ```text
//! client task --line--> Session --> hub
//!             <--reply--
//! ```
//!
//! A client that disconnects, hangs up, or does not read its replies loses its axes: they stop.

use std::io;
use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::{UnixListener, UnixStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tracing::{info, warn};

use super::hub::{Door, Shared, Who};
use super::protocol::{BadRequest, FileRequest, LINE_MAX};
use super::session::{Session, Taken};
use crate::line_limit::{LineKind, Peer};

/// Clients connected at the same time.
const CLIENTS_MAX: usize = 4;

/// How long a client may leave a reply unread.
const WRITE_TIME_OUT: Duration = Duration::from_secs(1);

/// Bytes of a file that a client has to take within [`WRITE_TIME_OUT`].
const PART: usize = 64 * 1_024;

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
    door: Door,
    uid: u32,
}

impl LocalServer {
    /// Creates the socket, for this user only. A socket that a gateway left behind is replaced.
    ///
    /// # Errors
    /// The path is in use, or cannot be created.
    pub fn bind(path: &Path, door: Door) -> io::Result<(Self, SocketFile)> {
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
        Ok((Self { listener, door, uid }, file))
    }

    /// Serves clients until the future is dropped.
    pub async fn run(self) {
        let Self { listener, door, uid } = self;
        let places = Arc::new(Semaphore::new(CLIENTS_MAX));
        loop {
            match listener.accept().await {
                Ok((stream, _)) => {
                    if let Some((stream, user, place)) = admit(stream, uid, &places, door.shared()) {
                        tokio::spawn(client(stream, user, door.clone(), place));
                    }
                }
                Err(error) => {
                    warn!(%error, "local control cannot accept a client");
                    tokio::time::sleep(Duration::from_millis(100)).await;
                }
            }
        }
    }
}

/// Lets a client in: one of the gateway's own user or of root, as long as there is room.
fn admit(
    stream: UnixStream,
    uid: u32,
    places: &Arc<Semaphore>,
    shared: &Shared,
) -> Option<(UnixStream, u32, OwnedSemaphorePermit)> {
    let refused = |peer| shared.admits(LineKind::LocalRefused, peer);
    let user = match stream.peer_cred() {
        Ok(peer) if may_connect(peer.uid(), uid) => peer.uid(),
        Ok(peer) => {
            if refused(Peer::User(peer.uid())) {
                warn!(uid = peer.uid(), "local control refused a client of another user");
            }
            return None;
        }
        Err(error) => {
            if refused(Peer::Unknown) {
                warn!(%error, "local control refused a client of an unknown user");
            }
            return None;
        }
    };
    let Ok(place) = Arc::clone(places).try_acquire_owned() else {
        if refused(Peer::User(user)) {
            warn!(uid = user, limit = CLIENTS_MAX, "local control refused a client: too many are connected");
        }
        return None;
    };
    Some((stream, user, place))
}

/// Whether a user may control axes: the one that runs the gateway, and root.
const fn may_connect(peer: u32, own: u32) -> bool {
    peer == own || peer == 0
}

/// The task of one client.
async fn client(mut stream: UnixStream, user: u32, door: Door, place: OwnedSemaphorePermit) {
    let shared = Arc::clone(door.shared());
    // A program that asks for the state every second is not worth two lines each time.
    let shown = shared.admits(LineKind::LocalClient, Peer::User(user));
    let mut session = door.enter(Who::User(user));
    let client = session.id();
    if shown {
        info!(client, "local control: client connected");
    }
    let ended = serve(&mut stream, &mut session).await;
    // Its axes stop.
    drop((session, place));
    match ended {
        Ok(()) if shown => info!(client, "local control: client disconnected"),
        Ok(()) => {}
        Err(error) if shared.admits(LineKind::LocalRefused, Peer::User(user)) => {
            warn!(client, %error, "local control: connection lost");
        }
        Err(_) => {}
    }
}

async fn serve(stream: &mut UnixStream, session: &mut Session) -> io::Result<()> {
    let mut lines = Lines::default();
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
                    match session.take(&line) {
                        Taken::Reply(reply) => replies.push_str(&reply),
                        Taken::Asked => {}
                        Taken::File(wanted) => {
                            write(stream, std::mem::take(&mut replies).as_bytes()).await?;
                            send_file(stream, session, wanted).await?;
                        }
                    }
                }
                replies
            }
            reply = session.reply() => reply.ok_or_else(unread)?,
        };
        write(stream, reply.as_bytes()).await?;
    }
}

/// Makes a file and sends it: a line with its length, then its bytes.
async fn send_file(stream: &mut UnixStream, session: &Session, wanted: FileRequest) -> io::Result<()> {
    match session.file(wanted).await {
        Ok(file) => {
            write(stream, format!("ok {} bytes={}\n", wanted.word(), file.len()).as_bytes()).await?;
            for part in file.chunks(PART) {
                write(stream, part).await?;
            }
            Ok(())
        }
        Err(reply) => write(stream, reply.as_bytes()).await,
    }
}

/// Writes to a client that reads.
async fn write(stream: &mut UnixStream, bytes: &[u8]) -> io::Result<()> {
    let written = tokio::time::timeout(WRITE_TIME_OUT, stream.write_all(bytes)).await;
    written.map_err(|_| unread())?
}

fn unread() -> io::Error {
    io::Error::new(io::ErrorKind::TimedOut, "the client does not read its replies")
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
pub(crate) mod tests {
    use std::os::unix::fs::MetadataExt as _;

    use profile_generic::fault::{Fault, FaultCause};
    use profile_generic::parameter::{Access, Parameter};
    use profile_generic::time::SystemTime;
    use profile_sercos::wire::attribute::{Attribute, Format, ItemLength};
    use profile_sercos::wire::idn::Idn;
    use profile_sercos::wire::svc::Element;
    use tokio::io::{AsyncBufReadExt as _, BufReader};

    use super::super::attributes::Attributes;
    use super::super::hub::Hub;
    use super::super::installation::{Installation, NamedAxis};
    use super::super::overview::Overview;
    use super::super::protocol::NamedParameter;
    use super::*;
    use crate::bundle::Sources;
    use crate::config::{AxisKind, TimeSource};
    use crate::engine::direct::{DirectAnswer, DirectEnd, DirectRequest};
    use crate::engine::direct::{DirectFailure, Direction, Target};
    use crate::engine::local::Failure;
    use crate::engine::local::{Answer, ClientEnd, Order, Request};
    use crate::engine::notice::Notice;
    use crate::engine::parameter::ParameterFailure;
    use crate::history::{Histories, LogEvent};
    use crate::latest::latest;
    use crate::mapping::Mapping;
    use crate::parameter::known::Bus;
    use crate::parameter::known::Catalogue;
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

    pub(crate) type Ends = (ClientEnd, DirectEnd);
    pub(crate) type Direct = (rtrb::Consumer<DirectRequest>, rtrb::Producer<DirectAnswer>);

    fn named((name, kind): (&str, AxisKind)) -> NamedAxis {
        NamedAxis {
            name: name.to_owned(),
            kind,
            bus: 0,
            drive: format!("drive-{name}"),
            address: "address 1".to_owned(),
        }
    }

    pub(crate) fn shared() -> Shared {
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

    /// The queues of a hub, and the engine's ends of those of orders and of direct accesses.
    pub(crate) fn queues() -> (Ends, (rtrb::Consumer<Request>, rtrb::Producer<Answer>), Direct) {
        let (requests, taken) = rtrb::RingBuffer::new(8);
        let (given, answers) = rtrb::RingBuffer::new(8);
        let (accesses, asked) = rtrb::RingBuffer::new(8);
        let (accessed, results) = rtrb::RingBuffer::new(8);
        let direct = DirectEnd { requests: accesses, answers: results };
        ((ClientEnd { requests, answers }, direct), (taken, given), (asked, accessed))
    }

    fn door() -> Door {
        Hub::new(shared(), queues().0).1
    }

    impl Bench {
        fn start(name: &str) -> Self {
            let folder = std::env::temp_dir().join(format!("axisbridge-local-{}-{name}", std::process::id()));
            std::fs::create_dir_all(&folder).unwrap();
            let path = folder.join("socket");
            let (ends, (requests, answers), direct) = queues();
            let shared = shared();
            let histories = shared.sources.histories.clone();
            let (hub, door) = Hub::new(shared, ends);
            let (server, file) = LocalServer::bind(&path, door).unwrap();
            tokio::spawn(hub.run());
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
                        \"attribute\":\"0x02110001\",\"writable\":\"without torque\",\"value\":\"1.50\",\"data\":\"9600\"}\n";
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
        let again = LocalServer::bind(&bench.path, door());
        assert_eq!(again.expect_err("it is served").kind(), io::ErrorKind::AddrInUse);
        let file = bench.path.with_extension("txt");
        std::fs::write(&file, "kept").unwrap();
        let refused = LocalServer::bind(&file, door());
        assert_eq!(refused.expect_err("a file").kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "kept");
        let stale = bench.path.with_extension("stale");
        drop(std::os::unix::net::UnixListener::bind(&stale).unwrap());
        let (_server, guard) = LocalServer::bind(&stale, door()).expect("nobody serves it");
        drop(guard);
        assert!(!stale.exists(), "removed at the end");
    }
}
