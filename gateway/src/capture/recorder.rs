//! Records what the box sends and receives, without the cycle thread ever waiting for a disk.
//!
//! Whoever sees traffic holds a [`Tap`]: a queue of records ([`super::record`]) to one recorder thread. Pushing copies
//! the bytes and returns; when the queue is full the record is dropped and counted. The recorder thread takes
//! the oldest record of all taps and dresses socket payloads up as frames ([`super::synth`]). The frames go to
//! a file, up to a limit of bytes, and to a [`FrameSink`].

use std::fs::File;
use std::io::{self, Write};
use std::net::SocketAddrV4;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use profile_generic::can::Frame;
use rtrb::{Producer, RingBuffer};

use super::can;
use super::record::{self, Head, Kind, RECORD_LEN_MAX, Records, len_in_queue};
use super::synth::{DATAGRAM_LEN_MAX, SEGMENT_LEN_MAX, Synthesizer};
use super::writer::Writer;
use super::{FRAME_LEN_MAX, Side};
use crate::sys::clock::KernelTime;
use crate::sys::thread::{self, SMALL_STACK};

/// Bytes after which a recording is full, unless configured.
pub const FILE_LEN_MAX_DEFAULT: u64 = 4 << 30;

/// Interfaces of a file.
const SIDES: usize = Side::COUNT;

/// How long the recorder thread sleeps when it has nothing to do.
const IDLE: Duration = Duration::from_millis(2);

/// Descriptions of the interfaces of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Interfaces {
    /// Of the north interface, such as its IP address.
    pub north: String,
    /// Of the two SERCOS ports, such as the names of their network interfaces.
    pub south: [String; 2],
    /// Of the CAN buses, such as the names of their network interfaces; none that are not here are recorded.
    pub can: Vec<String>,
}

impl Interfaces {
    /// Begins a recording with these interfaces.
    ///
    /// # Errors
    /// What the destination says.
    pub fn writer<W: Write>(&self, destination: W) -> io::Result<Writer<W>> {
        let [one, two] = &self.south;
        let can: Vec<&str> = self.can.iter().map(String::as_str).collect();
        Writer::new(destination, [&self.north, one, two], &can)
    }
}

impl Default for Interfaces {
    fn default() -> Self {
        let south = ["SERCOS III".to_owned(), "SERCOS III".to_owned()];
        Self { north: "EtherNet/IP".to_owned(), south, can: Vec::new() }
    }
}

/// What is recorded to a file, and how.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The file; overwritten if there.
    pub path: PathBuf,
    /// Its interfaces.
    pub interfaces: Interfaces,
    /// Records of the greatest length, about 1.5 KiB, that each tap can hold until the recorder thread takes them; of shorter ones more.
    pub depth: usize,
    /// Bytes of the file at which recording ends; what comes after counts as dropped.
    pub file_len_max: u64,
}

impl Settings {
    /// A recording to `path` with the usual limits.
    #[must_use]
    pub fn new(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            interfaces: Interfaces::default(),
            depth: 1024,
            file_len_max: FILE_LEN_MAX_DEFAULT,
        }
    }
}

/// What became of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Summary {
    /// Frames in the file.
    pub frames: u64,
    /// Records lost: a tap's queue was full, the payload did not fit a frame, or the file was full.
    pub dropped: u64,
}

/// Takes frames on the recorder thread, which may lock and allocate.
pub trait FrameSink: Send {
    /// A round of the recorder thread begins: it comes at least every few milliseconds. `lost` records were dropped so far.
    fn round(&mut self, lost: u64);

    /// The next frame, by time of the records.
    fn frame(&mut self, at: KernelTime, side: Side, frame: &[u8]);
}

/// One place where traffic is seen.
#[derive(Debug)]
pub struct Tap {
    queue: Producer<u8>,
    dropped: Arc<[AtomicU64; SIDES]>,
}

impl Tap {
    /// A whole Ethernet frame, cut to [`FRAME_LEN_MAX`].
    pub fn frame(&mut self, at: KernelTime, side: Side, frame: &[u8]) {
        self.push(at, Kind::Frame(side), frame.get(..FRAME_LEN_MAX).unwrap_or(frame));
    }

    /// A frame of a CAN bus.
    pub fn can_frame(&mut self, at: KernelTime, bus: u8, frame: &Frame) {
        let mut record = [0; can::RECORD_LEN_MAX];
        let len = can::emit(frame, &mut record);
        self.push(at, Kind::Frame(Side::Can(bus)), &record[..len]);
    }

    /// The payload of a UDP datagram with its type-of-service octet.
    pub fn datagram(
        &mut self,
        at: KernelTime,
        from: SocketAddrV4,
        to: SocketAddrV4,
        tos: u8,
        payload: &[u8],
    ) {
        let kind = Kind::Datagram { from, to, tos };
        if payload.len() > DATAGRAM_LEN_MAX {
            self.drop_one(kind);
        } else {
            self.push(at, kind, payload);
        }
    }

    /// A TCP connection was made.
    pub fn opened(&mut self, at: KernelTime, client: SocketAddrV4, server: SocketAddrV4) {
        self.push(at, Kind::Opened { client, server }, &[]);
    }

    /// Bytes that went through a TCP connection.
    pub fn stream(&mut self, at: KernelTime, from: SocketAddrV4, to: SocketAddrV4, bytes: &[u8]) {
        for part in bytes.chunks(SEGMENT_LEN_MAX) {
            self.push(at, Kind::Stream { from, to }, part);
        }
    }

    /// `from` closed its TCP connection to `to`.
    pub fn closed(&mut self, at: KernelTime, from: SocketAddrV4, to: SocketAddrV4) {
        self.push(at, Kind::Closed { from, to }, &[]);
    }

    fn push(&mut self, at: KernelTime, kind: Kind, bytes: &[u8]) {
        if !record::push(&mut self.queue, at, kind, bytes) {
            self.drop_one(kind);
        }
    }

    fn drop_one(&self, kind: Kind) {
        count(&self.dropped, kind.side());
    }
}

fn count(counters: &[AtomicU64; SIDES], side: Side) {
    counters[side.index()].fetch_add(1, Ordering::Relaxed);
}

/// A recording that is running.
#[derive(Debug)]
pub struct Recorder {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<io::Result<Summary>>,
}

impl Recorder {
    /// Creates the file and starts the recorder thread with `taps` taps, in the order in which they are
    /// returned.
    ///
    /// # Errors
    /// The file cannot be created, or the thread not started.
    pub fn start(settings: Settings, taps: usize) -> io::Result<(Self, Vec<Tap>)> {
        let depth = settings.depth;
        Self::start_with(Some(settings), None, depth, taps)
    }

    /// The same, with frames to a file, to a sink, or to both. Each tap holds `depth` records of the greatest length.
    ///
    /// # Errors
    /// The file cannot be created, or the thread not started.
    pub fn start_with(
        file: Option<Settings>,
        sink: Option<Box<dyn FrameSink>>,
        depth: usize,
        taps: usize,
    ) -> io::Result<(Self, Vec<Tap>)> {
        let file = file.map(FileEnd::create).transpose()?;
        let lost = Arc::new([const { AtomicU64::new(0) }; SIDES]);
        let mut queues = Vec::with_capacity(taps);
        let mut ends = Vec::with_capacity(taps);
        for _ in 0..taps {
            let (producer, consumer) = RingBuffer::new(depth.saturating_mul(RECORD_LEN_MAX));
            ends.push(Tap { queue: producer, dropped: Arc::clone(&lost) });
            queues.push(Records::new(consumer));
        }
        let stop = Arc::new(AtomicBool::new(false));
        let task = Task { queues, lost, synth: Synthesizer::new(), file, sink };
        let flag = Arc::clone(&stop);
        let thread = thread::named("recorder", SMALL_STACK).spawn(move || task.run(&flag))?;
        Ok((Self { stop, thread }, ends))
    }

    /// Writes what the taps hold, closes the file and says what is in it. Records pushed later are lost.
    ///
    /// # Errors
    /// Writing failed, now or at some time before; the file has what came before that.
    pub fn finish(self) -> io::Result<Summary> {
        self.stop.store(true, Ordering::Release);
        self.thread.join().unwrap_or_else(|_| Err(io::Error::other("the recorder thread panicked")))
    }
}

/// The file of a recording.
struct FileEnd {
    writer: Writer<File>,
    written: [u64; SIDES],
    dropped: [u64; SIDES],
    failed: Option<io::Error>,
    limit: u64,
}

impl FileEnd {
    fn create(settings: Settings) -> io::Result<Self> {
        let writer = settings.interfaces.writer(File::create(&settings.path)?)?;
        let limit = settings.file_len_max;
        Ok(Self { writer, written: [0; SIDES], dropped: [0; SIDES], failed: None, limit })
    }

    /// Whether a record of this side is written; otherwise it counts as dropped.
    fn takes(&mut self, side: Side) -> bool {
        let described = match side {
            Side::Can(bus) => usize::from(bus) < self.writer.can_buses(),
            _ => true,
        };
        let takes = described && self.failed.is_none() && self.writer.bytes_written() < self.limit;
        self.dropped[side.index()] += u64::from(!takes);
        takes
    }

    fn frame(&mut self, at: KernelTime, side: Side, frame: &[u8]) {
        match self.writer.frame(side, at, frame, None) {
            Ok(()) => self.written[side.index()] += 1,
            Err(error) => self.failed = Some(error),
        }
    }

    /// Closes the file; `lost` were dropped before they came here.
    fn finish(mut self, last: KernelTime, lost: [u64; SIDES]) -> io::Result<Summary> {
        if let Some(error) = self.failed {
            return Err(error);
        }
        let mut dropped = 0;
        for (index, side) in Side::all(self.writer.can_buses()).enumerate() {
            let of_side = self.dropped[index] + lost[index];
            self.writer.statistics(side, last, self.written[index] + of_side, of_side)?;
        }
        for (own, lost) in self.dropped.iter().zip(lost) {
            dropped += own + lost;
        }
        self.writer.finish()?;
        Ok(Summary { frames: self.written.iter().sum(), dropped })
    }
}

/// The recorder thread.
struct Task {
    queues: Vec<Records>,
    lost: Arc<[AtomicU64; SIDES]>,
    synth: Synthesizer,
    file: Option<FileEnd>,
    sink: Option<Box<dyn FrameSink>>,
}

impl Task {
    fn run(mut self, stop: &AtomicBool) -> io::Result<Summary> {
        let mut last = KernelTime(0);
        let mut buffer = [0; FRAME_LEN_MAX];
        loop {
            // Read before draining: what was pushed before the request to stop is still written.
            let stopping = stop.load(Ordering::Acquire);
            if let Some(sink) = &mut self.sink {
                sink.round(self.lost.iter().map(|counter| counter.load(Ordering::Relaxed)).sum());
            }
            // Bounded by what the queues hold, so that a flood cannot keep the thread from stopping.
            let waiting: usize = self.queues.iter().map(Records::waiting).sum();
            let mut left = waiting;
            while left > 0 {
                let Some(index) = self.oldest() else { break };
                let Some((head, bytes)) = self.queues[index].take(&mut buffer) else { break };
                last = last.max(head.at);
                left = left.saturating_sub(len_in_queue(&head));
                self.take(&head, bytes);
            }
            if stopping {
                break;
            }
            // Nothing waits, or the rest of a record is on its way.
            if left == waiting {
                std::thread::sleep(IDLE);
            }
        }
        let lost = self.lost.each_ref().map(|counter| counter.load(Ordering::Relaxed));
        self.file.map_or(Ok(Summary::default()), |file| file.finish(last, lost))
    }

    /// The queue whose next record has the smallest time.
    fn oldest(&mut self) -> Option<usize> {
        let heads = self.queues.iter_mut().enumerate();
        let times = heads.filter_map(|(index, queue)| Some((queue.next()?.at, index)));
        times.min().map(|(_, index)| index)
    }

    fn take(&mut self, record: &Head, data: &[u8]) {
        let side = record.kind.side();
        let Self { synth, file, sink, lost, .. } = self;
        let mut file = file.as_mut();
        if !file.as_mut().is_some_and(|file| file.takes(side)) {
            file = None;
        }
        let mut emit = |frame: &[u8]| {
            if let Some(file) = &mut file {
                file.frame(record.at, side, frame);
            }
            if let Some(sink) = sink.as_mut() {
                sink.frame(record.at, side, frame);
            }
        };
        match record.kind {
            Kind::Frame(_) => emit(data),
            Kind::Datagram { from, to, tos } => {
                if synth.udp(from, to, tos, data, &mut emit).is_err() {
                    count(lost, side);
                }
            }
            Kind::Opened { client, server } => synth.tcp_open(client, server, &mut emit),
            Kind::Stream { from, to } => synth.tcp_data(from, to, data, &mut emit),
            Kind::Closed { from, to } => synth.tcp_close(from, to, &mut emit),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use profile_sercos::port::Port;

    use super::*;
    use crate::capture::reader::Reader;

    const CLIENT: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 1), 50_000);
    const SERVER: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 2), 44_818);

    fn path(name: &str) -> PathBuf {
        std::env::temp_dir().join(format!("axisbridge-recorder-{}-{name}.pcapng", std::process::id()))
    }

    /// Interface, time and length of every frame of a file, which is then removed.
    fn frames(path: &Path) -> Vec<(u32, u64, usize)> {
        let mut reader = Reader::open(path).unwrap();
        let mut frames = Vec::new();
        while let Some(frame) = reader.next_frame().unwrap() {
            frames.push((frame.interface, frame.at.unwrap().0, frame.data.len()));
        }
        std::fs::remove_file(path).unwrap();
        frames
    }

    #[test]
    fn frames_of_a_can_bus_have_an_interface_of_their_own() {
        let path = path("can");
        let interfaces = Interfaces { can: vec!["can0".to_owned()], ..Interfaces::default() };
        let settings = Settings { interfaces, ..Settings::new(&path) };
        let (recorder, mut taps) = Recorder::start(settings, 1).unwrap();
        let id = profile_generic::can::Id::Standard(0x181);
        taps[0].can_frame(KernelTime(5), 0, &Frame::new(id, &[1, 2, 3]).unwrap());
        // The recording knows of one bus only.
        taps[0].can_frame(KernelTime(6), 1, &Frame::new(id, &[1]).unwrap());
        assert_eq!(recorder.finish().unwrap(), Summary { frames: 1, dropped: 1 });
        assert_eq!(frames(&path), [(3, 5, 11)]);
    }

    #[test]
    fn taps_are_merged_by_time_and_payloads_become_frames() {
        let path = path("merge");
        let settings = Settings::new(&path);
        let (recorder, mut taps) = Recorder::start(settings, 2).unwrap();
        // Held back by the lock-step of this thread: the writer may take either tap first, so push the later
        // first only where it is of the same tap.
        let [cycle, supervisor] = &mut taps[..] else { panic!() };
        supervisor.opened(KernelTime(10), CLIENT, SERVER);
        supervisor.stream(KernelTime(20), CLIENT, SERVER, &[1; 1461]);
        std::thread::sleep(Duration::from_millis(50));
        cycle.frame(KernelTime(30), Side::South(Port::One), &[2; 60]);
        cycle.frame(KernelTime(35), Side::South(Port::Two), &[2; 61]);
        cycle.datagram(KernelTime(40), SERVER, CLIENT, 0, &[3; 10]);
        std::thread::sleep(Duration::from_millis(50));
        supervisor.closed(KernelTime(50), SERVER, CLIENT);
        assert_eq!(recorder.finish().unwrap(), Summary { frames: 11, dropped: 0 });
        assert_eq!(
            frames(&path),
            [
                (0, 10, 54),
                (0, 10, 54),
                (0, 10, 54),
                (0, 20, 1514),
                (0, 20, 55),
                (1, 30, 60),
                (2, 35, 61),
                (0, 40, 52),
                (0, 50, 54),
                (0, 50, 54),
                (0, 50, 54)
            ]
        );
    }

    #[test]
    fn a_full_queue_drops_and_counts_and_never_waits() {
        let path = path("full");
        let settings = Settings { depth: 4, file_len_max: 0, ..Settings::new(&path) };
        let (recorder, mut taps) = Recorder::start(settings, 1).unwrap();
        for number in 0..1000 {
            taps[0].frame(KernelTime(number), Side::South(Port::One), &[0; 60]);
        }
        taps[0].datagram(KernelTime(2000), SERVER, CLIENT, 0, &[0; 1473]);
        // The file takes nothing, so that everything is dropped: in the queue, by its length or by the limit.
        assert_eq!(recorder.finish().unwrap(), Summary { frames: 0, dropped: 1001 });
        assert!(frames(&path).is_empty());
    }

    #[test]
    fn a_file_that_cannot_be_made_is_an_error_at_the_start() {
        let error = Recorder::start(Settings::new(Path::new("/nonexistent/file.pcapng")), 1).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::NotFound);
    }
}
