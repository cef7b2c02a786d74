//! What foreign devices and masters say to ours, recorded, and read by tshark and by our own parsers: both must see the same.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use axisbridge::capture::can::{self, Record};
use axisbridge::capture::reader::Reader;
use axisbridge::capture::writer::Writer;
use axisbridge::sys::can_socket::{CanSocket, Content, Options};
use profile_cia402::wire::emcy::Emcy;
use profile_cia402::wire::error_control::Heartbeat;
use profile_cia402::wire::nmt::Nmt;
use profile_cia402::wire::sdo::{BlockSegment, SdoRequest, SdoResponse, Segment, Transfer};
use profile_cia402::wire::{Function, Mux};
use profile_generic::can::{Frame, Id};

use super::*;

/// A thread that writes every frame of the bus into a file.
pub struct Recording {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl Recording {
    pub fn start(path: &Path) -> Self {
        let mut socket = CanSocket::open(INTERFACE, &Options::default()).unwrap();
        let mut writer = Writer::new(File::create(path).unwrap(), ["none"; 3], &[INTERFACE]).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let ends = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            while !ends.load(Ordering::Relaxed) {
                let _ = socket.wait(Duration::from_millis(50)).unwrap();
                while let Some(received) = socket.recv().unwrap() {
                    let Content::Frame(frame) = received.content else { panic!("{received:?}") };
                    writer.can_frame(0, received.at.unwrap(), &frame, None).unwrap();
                }
            }
            assert_eq!(socket.take_dropped(), 0);
            writer.finish().unwrap();
        });
        Self { stop, thread }
    }

    pub fn finish(self) {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap();
    }
}

/// The frames of a recording.
fn frames(path: &Path) -> Vec<Frame> {
    let mut reader = Reader::open(path).unwrap();
    let mut frames = vec![];
    while let Some(recorded) = reader.next_frame().unwrap() {
        let Record::Frame(frame) = can::parse(recorded.data).unwrap() else { panic!("{recorded:?}") };
        frames.push(frame);
    }
    frames
}

/// What tshark tells of a frame, as far as it is compared. Of the first frames of block transfers tshark 4.0 tells nothing, and it
/// takes the segments of blocks for other frames.
const FIELDS: [&str; 20] = [
    "canopen.function_code",
    "canopen.nmt_ctrl.cd",
    "canopen.nmt_ctrl.node_id",
    "canopen.nmt_guard.state",
    "canopen.em.err_code",
    "canopen.em.err_reg",
    "canopen.sdo.ccs",
    "canopen.sdo.scs",
    "canopen.sdo.main_idx",
    "canopen.sdo.sub_idx",
    "canopen.sdo.e",
    "canopen.sdo.s",
    "canopen.sdo.n",
    "canopen.sdo.c",
    "canopen.sdo.toggle",
    "canopen.sdo.abort_code",
    "canopen.sdo.cs",
    "canopen.sdo.ss",
    "canopen.sdo.ackseq",
    "canopen.sdo.blksize",
];

type Facts = BTreeMap<&'static str, u32>;

/// What tshark tells of each frame.
fn told_by_tshark(path: &Path) -> Vec<Facts> {
    let mut command = Command::new("tshark");
    command.args(["-n", "-d", "can.subdissector,canopen", "-r"]).arg(path).args(["-T", "fields"]);
    for field in FIELDS.iter().chain(&["_ws.malformed"]) {
        command.args(["-e", field]);
    }
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let number = |shown: &str| match (shown, shown.strip_prefix("0x")) {
        ("True", _) => 1,
        ("False", _) => 0,
        (_, Some(digits)) => u32::from_str_radix(digits, 16).unwrap(),
        (_, None) => shown.parse().unwrap(),
    };
    let line = |line: &str| {
        let (shown, malformed) = line.rsplit_once('\t').unwrap();
        assert_eq!(malformed, "", "{line}");
        let all = FIELDS.into_iter().zip(shown.split('\t'));
        all.filter(|(_, shown)| !shown.is_empty()).map(|(field, shown)| (field, number(shown))).collect()
    };
    String::from_utf8(output.stdout).unwrap().lines().map(line).collect()
}

/// Where the segments of a block are, which only those tell that come before them.
#[derive(Default)]
struct Blocks {
    down: bool,
    up: bool,
    last: u8,
}

impl Blocks {
    fn received(&mut self, acknowledged: u8) -> bool {
        self.last != 0 && self.last == acknowledged
    }
}

/// What our own parsers tell of a frame, by the names of tshark, and its kind; no facts where tshark tells none.
fn told_by_us(blocks: &mut Blocks, frame: &Frame) -> (String, Option<Facts>) {
    let function = Function::of(frame.id()).unwrap();
    let data = frame.data();
    let (kind, facts) = match function {
        Function::Nmt => {
            let Nmt { command, node } = Nmt::parse(data).unwrap();
            let node = node.map_or(0, |node| node.get());
            let facts = vec![("nmt_ctrl.cd", command.0.into()), ("nmt_ctrl.node_id", node.into())];
            (format!("NMT {command}"), facts)
        }
        Function::ErrorControl(_) => {
            let heartbeat = Heartbeat::parse(data).unwrap();
            (format!("heartbeat {}", heartbeat.state), vec![("nmt_guard.state", heartbeat.state.0.into())])
        }
        Function::Emcy(_) => {
            let emcy = Emcy::parse(data).unwrap();
            let facts =
                vec![("em.err_code", emcy.code.0.into()), ("em.err_reg", emcy.register.bits().into())];
            (format!("EMCY {:04X}", emcy.code.0), facts)
        }
        Function::SdoRequest(_) if blocks.down && data[0] != 0x80 => {
            let segment = BlockSegment::parse(data).unwrap();
            blocks.last = if segment.last { segment.sequence } else { 0 };
            return ("block segment down".into(), None);
        }
        Function::SdoResponse(_) if blocks.up && data[0] != 0x80 => {
            let segment = BlockSegment::parse(data).unwrap();
            blocks.last = if segment.last { segment.sequence } else { 0 };
            return ("block segment up".into(), None);
        }
        Function::SdoRequest(_) => match request(blocks, data) {
            (kind, Some(facts)) => (format!("request {kind}"), facts),
            (kind, None) => return (format!("request {kind}"), None),
        },
        Function::SdoResponse(_) => match response(blocks, data) {
            (kind, Some(facts)) => (format!("response {kind}"), facts),
            (kind, None) => return (format!("response {kind}"), None),
        },
        // Identifiers alone.
        Function::Sync | Function::Time => (function.to_string(), vec![]),
        Function::Tpdo(..) | Function::Rpdo(..) => ("PDO".into(), vec![]),
        Function::LssRequest | Function::LssResponse => ("LSS".into(), vec![]),
    };
    let named = facts.into_iter().map(|(name, value)| {
        let field = FIELDS.into_iter().find(|field| field.strip_prefix("canopen.") == Some(name));
        (field.unwrap(), value)
    });
    let Id::Standard(id) = frame.id() else { panic!("{frame}") };
    let code = ("canopen.function_code", u32::from(id >> 7));
    (kind, Some(named.chain([code]).collect()))
}

type Told = (&'static str, Option<Vec<(&'static str, u32)>>);

fn request(blocks: &mut Blocks, data: &[u8]) -> Told {
    let (ccs, kind, mut facts) = match SdoRequest::parse(data).unwrap() {
        SdoRequest::Download(mux, transfer) => (1, "download", [object(mux), begins(&transfer)].concat()),
        SdoRequest::DownloadSegment(segment) => (0, "download segment", part(&segment)),
        SdoRequest::Upload(mux) => (2, "upload", object(mux)),
        SdoRequest::UploadSegment { toggle } => (3, "upload segment", vec![("sdo.toggle", toggle.into())]),
        SdoRequest::Abort(abort) => {
            *blocks = Blocks::default();
            (4, "abort", [object(abort.mux), vec![("sdo.abort_code", abort.code.0)]].concat())
        }
        SdoRequest::BlockUpload { .. } => return ("block upload", None),
        SdoRequest::BlockDownload { .. } => return ("block download", None),
        SdoRequest::StartBlockUpload => {
            (blocks.up, blocks.last) = (true, 0);
            (5, "block upload start", vec![("sdo.cs", 3)])
        }
        SdoRequest::BlockReceived { acknowledged, block_size } => {
            blocks.up &= !blocks.received(acknowledged);
            (5, "block received", block(("sdo.cs", 2), acknowledged, block_size))
        }
        SdoRequest::EndBlockUpload => (5, "block upload end", vec![("sdo.cs", 1)]),
        SdoRequest::EndBlockDownload { unused, .. } => {
            (6, "block download end", vec![("sdo.cs", 1), ("sdo.n", unused.into())])
        }
    };
    facts.push(("sdo.ccs", ccs));
    (kind, Some(facts))
}

fn response(blocks: &mut Blocks, data: &[u8]) -> Told {
    let (scs, kind, mut facts) = match SdoResponse::parse(data).unwrap() {
        SdoResponse::Upload(mux, transfer) => (2, "upload", [object(mux), begins(&transfer)].concat()),
        SdoResponse::UploadSegment(segment) => (0, "upload segment", part(&segment)),
        SdoResponse::Download(mux) => (3, "download", object(mux)),
        SdoResponse::DownloadSegment { toggle } => {
            (1, "download segment", vec![("sdo.toggle", toggle.into())])
        }
        SdoResponse::Abort(abort) => {
            *blocks = Blocks::default();
            (4, "abort", [object(abort.mux), vec![("sdo.abort_code", abort.code.0)]].concat())
        }
        SdoResponse::BlockDownload { .. } => {
            (blocks.down, blocks.last) = (true, 0);
            return ("block download", None);
        }
        SdoResponse::BlockUpload { .. } => return ("block upload", None),
        SdoResponse::BlockReceived { acknowledged, block_size } => {
            blocks.down &= !blocks.received(acknowledged);
            (5, "block received", block(("sdo.ss", 2), acknowledged, block_size))
        }
        SdoResponse::EndBlockDownload => (5, "block download end", vec![("sdo.ss", 1)]),
        SdoResponse::EndBlockUpload { unused, .. } => {
            (6, "block upload end", vec![("sdo.ss", 1), ("sdo.n", unused.into())])
        }
    };
    facts.push(("sdo.scs", scs));
    (kind, Some(facts))
}

fn object(mux: Mux) -> Vec<(&'static str, u32)> {
    vec![("sdo.main_idx", mux.index.into()), ("sdo.sub_idx", mux.sub.into())]
}

/// The first frame of a transfer; unused bytes are told where the size is, as 0 otherwise.
fn begins(transfer: &Transfer) -> Vec<(&'static str, u32)> {
    let (expedited, sized, unused) = match transfer {
        Transfer::Expedited { data, sized } => (true, *sized, 4 - data.len()),
        Transfer::Segmented { size } => (false, size.is_some(), 0),
    };
    vec![("sdo.e", expedited.into()), ("sdo.s", sized.into()), ("sdo.n", u32::try_from(unused).unwrap())]
}

fn part(segment: &Segment) -> Vec<(&'static str, u32)> {
    let unused = u32::try_from(7 - segment.data.len()).unwrap();
    vec![("sdo.toggle", segment.toggle.into()), ("sdo.n", unused), ("sdo.c", segment.last.into())]
}

fn block(step: (&'static str, u32), acknowledged: u8, block_size: u8) -> Vec<(&'static str, u32)> {
    vec![step, ("sdo.ackseq", acknowledged.into()), ("sdo.blksize", block_size.into())]
}

/// That tshark and our parsers tell the same of every frame; how many frames of each kind there were.
pub fn compare_with_tshark(path: &Path) -> BTreeMap<String, usize> {
    let frames = frames(path);
    let theirs = told_by_tshark(path);
    assert_eq!(frames.len(), theirs.len());
    let mut blocks = Blocks::default();
    let mut kinds = BTreeMap::new();
    for (frame, theirs) in frames.iter().zip(&theirs) {
        let (kind, ours) = told_by_us(&mut blocks, frame);
        if let Some(ours) = ours {
            assert_eq!(ours, *theirs, "{kind}: {frame}");
        }
        *kinds.entry(kind).or_default() += 1;
    }
    kinds
}
