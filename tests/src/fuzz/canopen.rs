//! CANopen: frames, SDO, LSS, a device, its master, data sheets and configurations.

use axisbridge::simulate::can_drive::{self, DriveNode};
use profile_cia402::eds as sheet;
use profile_cia402::eds::Form;
use profile_cia402::eds::concise as concise_form;
use profile_cia402::lss;
use profile_cia402::master::Master;
use profile_cia402::master::boot::BootState;
use profile_cia402::master::config::{
    Expected, HeartbeatConfig, MasterConfig, MasterHeartbeat, NodeConfig, PdoConfig, SyncConfig,
};
use profile_cia402::master::event::{Event, Output};
use profile_cia402::node::drive::{Device as Twin, identity, identity_of};
use profile_cia402::node::{Config as NodeSettings, Node};
use profile_cia402::sdo::client::{Client, ClientConfig};
use profile_cia402::sdo::request::{INLINE_LEN, Method, SdoData, SdoRequest};
use profile_cia402::sdo::server::{ObjectAccess, Server, ServerConfig};
use profile_cia402::wire::emcy::Emcy;
use profile_cia402::wire::error_control::Heartbeat;
use profile_cia402::wire::lss::{BitTiming, LssAddress, LssRequest, LssResponse};
use profile_cia402::wire::nmt::Nmt;
use profile_cia402::wire::pdo::MappingEntry;
use profile_cia402::wire::sdo::{self as sdo_wire, Abort, BlockSegment, SdoResponse};
use profile_cia402::wire::sync::Sync;
use profile_cia402::wire::time::TimeOfDay;
use profile_cia402::wire::{self, AbortCode, Function, Mux, NodeId, cob_id};
use profile_generic::can::Id;
use profile_generic::servo::ServoParameters;
use profile_generic::state::Report;
use profile_generic::time::{DurationNs, MonotonicTime};

use super::assert_printed;
use super::conversation::{BURST_MAX, Bytes, Disturber};

const START: MonotonicTime = MonotonicTime(1_000_000_000);
const MILLISECOND: DurationNs = DurationNs::from_millis(1);

/// What is read from the data of a frame is printed within bounds and is read again as the same value.
macro_rules! frame_again {
    ($type:ty, $data:expr) => {
        if let Ok(value) = <$type>::parse($data) {
            assert_printed(&value.to_string(), $data.len());
            assert_eq!(<$type>::parse(&value.emit()).as_ref(), Ok(&value));
        }
    };
}

/// Every kind of frame.
pub fn wire(data: &[u8]) {
    frame_again!(Nmt, data);
    frame_again!(Heartbeat, data);
    frame_again!(Emcy, data);
    frame_again!(TimeOfDay, data);
    frame_again!(sdo_wire::SdoRequest, data);
    frame_again!(SdoResponse, data);
    frame_again!(BlockSegment, data);
    frame_again!(LssRequest, data);
    frame_again!(LssResponse, data);
    if let Ok(sync) = Sync::parse(data) {
        assert_eq!(Sync::parse(&sync.emit()[..sync.buffer_len()]), Ok(sync));
    }
    if let Some(abort) = Abort::parse(data) {
        assert_eq!(Abort::parse(&abort.emit()), Some(abort));
    }
    if let Some(frame) = Bytes::new(data).frame() {
        let _ = Function::of(frame.id()).map(|function| assert_printed(&function.to_string(), 0));
    }
}

/// A few objects of different lengths.
#[derive(Default)]
struct Objects {
    text: Vec<u8>,
    writes: u32,
}

const NUMBER: Mux = Mux::new(0x2000, 1);
const TEXT: Mux = Mux::new(0x2000, 0);
const TEXT_MAX: usize = 1_000;

impl ObjectAccess for Objects {
    fn read(&mut self, object: Mux, into: &mut [u8]) -> Result<usize, AbortCode> {
        let value = match object {
            NUMBER => &[1, 2, 3, 4][..],
            TEXT => &self.text,
            _ => return Err(AbortCode::NO_OBJECT),
        };
        into.get_mut(..value.len()).ok_or(AbortCode::OUT_OF_MEMORY)?.copy_from_slice(value);
        Ok(value.len())
    }

    fn write_begins(&mut self, object: Mux, size: Option<u32>) -> Result<usize, AbortCode> {
        let most = match object {
            NUMBER => 4,
            TEXT => TEXT_MAX,
            _ => return Err(AbortCode::NO_OBJECT),
        };
        match size {
            Some(size) if usize::try_from(size).is_ok_and(|size| size > most) => Err(AbortCode::TOO_LONG),
            _ => Ok(most),
        }
    }

    fn write(&mut self, object: Mux, data: &[u8]) -> Result<(), AbortCode> {
        self.writes += 1;
        match object {
            NUMBER => assert!(data.len() <= 4, "{} bytes for a number", data.len()),
            _ => {
                assert!(data.len() <= TEXT_MAX, "{} bytes for a text", data.len());
                self.text = data.to_vec();
            }
        }
        Ok(())
    }
}

/// A server fed with frames: 250 ms pass with a byte above 9, otherwise so many bytes come. Afterwards it serves a good client.
pub fn sdo_server(data: &[u8]) {
    let mut objects = Objects { text: vec![0x5A; 300], writes: 0 };
    let mut server = Server::new(ServerConfig { capacity: TEXT_MAX, ..ServerConfig::default() });
    let (mut bytes, mut now) = (Bytes::new(data), START);
    let drain = |server: &mut Server, now| {
        // A block of 127 segments, an answer, an abort.
        let sent = core::iter::from_fn(|| server.poll(now)).take(BURST_MAX).collect::<Vec<_>>();
        assert!(sent.len() < 130, "{} frames at once", sent.len());
        sent
    };
    while !bytes.is_over() {
        match bytes.byte() {
            len @ 0..=9 => {
                let frame = bytes.take(usize::from(len));
                let taken = server.handle(now, frame, &mut objects);
                assert_eq!(taken.is_ok(), frame.len() == sdo_wire::SDO_LEN);
            }
            _ => now = now + DurationNs::from_millis(250),
        }
        drain(&mut server, now);
    }
    server.handle(now, &[0x80, 0, 0, 0, 0, 0, 0, 0], &mut objects).expect("an abort of eight bytes");
    drain(&mut server, now);
    server.handle(now, &[0x40, 0, 0x20, 1, 0, 0, 0, 0], &mut objects).expect("a request of eight bytes");
    assert_eq!(drain(&mut server, now), [[0x43, 0, 0x20, 1, 1, 2, 3, 4]]);
}

/// A client with a good server, whose answers are disturbed. Every request ends, and the next one without a disturbance goes well, or
/// the one after it: an answer that was changed to an abort leaves the server in its block, where a request is taken for a segment, until
/// the client gives up and says so.
pub fn sdo_client(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let head = bytes.byte();
    let method = [Method::Auto, Method::Segments, Method::Blocks][usize::from(head % 3)];
    let len = usize::from(bytes.byte()) * 3;
    let text: Vec<u8> = (0..=u8::MAX).cycle().take(len).collect();
    let object = if head & 0x40 == 0 { TEXT } else { NUMBER };
    let request = match head & 0x80 {
        0 => SdoRequest::upload_into(object, Vec::with_capacity(INLINE_LEN + len)),
        _ => SdoRequest::download(object, SdoData::Buffer(text.clone())),
    };
    let mut rig = SdoPair {
        client: Client::new(ClientConfig::default()),
        server: Server::new(ServerConfig { capacity: TEXT_MAX, ..ServerConfig::default() }),
        objects: Objects { text, writes: 0 },
        now: START,
    };
    let mut answers = Disturber::new(data.get(2..).unwrap_or_default());
    rig.run(request.by(method), &mut answers);
    answers.calm();
    let mut good = || rig.run(SdoRequest::upload(NUMBER), &mut answers);
    assert_eq!(good().or_else(good), Some(0x0403_0201));
}

struct SdoPair {
    client: Client,
    server: Server,
    objects: Objects,
    now: MonotonicTime,
}

impl SdoPair {
    /// Runs a request to its end; the number that it brings.
    fn run(&mut self, request: SdoRequest, answers: &mut Disturber<'_>) -> Option<u64> {
        let Self { client, server, objects, now } = self;
        client.start(*now, request).expect("a free client");
        for _ in 0..20_000 {
            let mut moved = false;
            while let Some(frame) = client.poll(*now) {
                moved = true;
                server.handle(*now, &frame, objects).expect("eight bytes");
                while let Some(frame) = server.poll(*now) {
                    answers.carry(&frame, &mut |frame| {
                        let _ = client.handle(*now, frame);
                    });
                }
            }
            while let Some(frame) = server.poll(*now) {
                moved = true;
                answers.carry(&frame, &mut |frame| {
                    let _ = client.handle(*now, frame);
                });
            }
            if let Some(outcome) = client.take_outcome() {
                while let Some(frame) = client.poll(*now) {
                    server.handle(*now, &frame, objects).expect("eight bytes");
                }
                while server.poll(*now).is_some() {}
                return outcome.result.ok().and_then(|()| outcome.data.unsigned());
            }
            if !moved {
                *now = *now + MILLISECOND * 10;
            }
        }
        panic!("the transfer does not end: {:?}, {}", client.state(), server.state());
    }
}

/// Both ends of LSS: a device fed with requests, and a master whose device's answers are disturbed.
pub fn lss(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let config = lss::slave::SlaveConfig {
        address: LssAddress([0x319, 2, 3, 4]),
        node: None,
        bit_timings: [BitTiming(0), BitTiming(2)].into_iter().collect(),
        storable: true,
    };
    let mut slave = lss::slave::Slave::new(config.clone());
    while !bytes.is_over() {
        let len = usize::from(bytes.byte() % 10);
        let frame = bytes.take(len);
        let _ = slave.handle(frame);
        let sent = core::iter::from_fn(|| slave.poll()).take(BURST_MAX).count();
        assert!(sent <= 1, "{sent} answers to one request");
    }
    let mut slave = lss::slave::Slave::new(config.clone());
    let mut master = lss::master::Master::new(lss::master::MasterConfig::default());
    let mut answers = Disturber::new(data);
    let mut now = START;
    use lss::master::{LssReply, LssTask as T};
    let tasks =
        [T::SwitchAllToWaiting, T::Fastscan, T::InquireAddress, T::SetNodeId(NodeId::new(5).ok()), T::Store];
    for task in tasks {
        // It may fail, but it ends.
        let _ = run_lss(&mut master, &mut slave, &mut now, task, &mut answers);
    }
    answers.calm();
    let mut slave = lss::slave::Slave::new(config.clone());
    let found = run_lss(&mut master, &mut slave, &mut now, T::Fastscan, &mut answers);
    assert_eq!(found, Ok(LssReply::Address(config.address)));
}

fn run_lss(
    master: &mut lss::master::Master,
    slave: &mut lss::slave::Slave,
    now: &mut MonotonicTime,
    task: lss::master::LssTask,
    answers: &mut Disturber<'_>,
) -> Result<lss::master::LssReply, lss::master::LssFailure> {
    assert!(master.start(*now, task), "a free master");
    for _ in 0..10_000 {
        while let Some(frame) = master.poll(*now) {
            let _ = slave.handle(&frame);
            while let Some(frame) = slave.poll() {
                answers.carry(&frame, &mut |frame| {
                    let _ = master.handle(*now, frame);
                });
            }
        }
        if let Some(outcome) = master.take_outcome() {
            return outcome;
        }
        *now = *now + MILLISECOND;
    }
    panic!("the task does not end: {task:?}");
}

const DEVICE: u8 = 5;

fn device() -> DriveNode {
    can_drive::drive(NodeId::new(DEVICE).ok(), 1).expect("one axis")
}

/// A drive fed with frames: a head below 0x8000 is that of a frame, above it so many milliseconds pass (low seven bits of the
/// second byte). When everybody is silent for long it is without torque, unless nothing supervises its master.
pub fn node(data: &[u8]) {
    let (mut node, mut bytes, mut now) = (device(), Bytes::new(data), START);
    let pass = |node: &mut DriveNode, now: &mut MonotonicTime, milliseconds: u8| {
        for _ in 0..milliseconds {
            *now = *now + MILLISECOND;
            node.handle_time(*now);
            let sent = core::iter::from_fn(|| node.poll(*now)).take(BURST_MAX).count();
            assert!(sent < 200, "{sent} frames at once");
        }
    };
    pass(&mut node, &mut now, 200);
    // Long enough for any state, short enough for a fuzzer.
    let mut budget = 400_u16;
    while !bytes.is_over() {
        let mut ahead = bytes.clone();
        let [_, high] = ahead.array();
        if high & 0x80 == 0 {
            if let Some(frame) = bytes.frame() {
                node.handle_frame(now, &frame);
            }
            pass(&mut node, &mut now, 0);
        } else {
            bytes = ahead;
            let wait = (high & 0x7F).min(u8::try_from(budget).unwrap_or(u8::MAX));
            budget -= u16::from(wait);
            pass(&mut node, &mut now, wait);
        }
        let sent = core::iter::from_fn(|| node.poll(now)).take(BURST_MAX).count();
        assert!(sent < 200, "{sent} frames at once");
    }
    for axis in node.application().axes() {
        let actual = axis.actual();
        assert!(actual.velocity.get().abs() < i64::MAX / 2, "{actual:?}");
    }
}

/// A network of one drive with one PDO each way.
fn network() -> MasterConfig {
    let entry = |index, bits| MappingEntry::new(Mux::new(index, 0), bits);
    MasterConfig {
        nodes: vec![NodeConfig {
            expected: Expected { device_type: Some(0x0002_0192), ..Expected::default() },
            heartbeat: Some(HeartbeatConfig { producer_ms: 50, timeout_ms: 150 }),
            rpdos: vec![PdoConfig::cyclic(1, vec![entry(0x6040, 16), entry(0x607A, 32)])],
            tpdos: vec![PdoConfig::cyclic(1, vec![entry(0x6041, 16), entry(0x6064, 32)])],
            ..NodeConfig::new(NodeId::new(DEVICE).expect("a node-id"))
        }],
        sync: Some(SyncConfig { period_ns: 4_000_000, window_ns: 0, counter_overflow: 0 }),
        heartbeat: Some(MasterHeartbeat {
            node: NodeId::new(127).expect("a node-id"),
            producer_ms: 100,
            timeout_ms: 300,
        }),
        retry_time: DurationNs::from_millis(100),
        boot_up_time: DurationNs::from_millis(300),
        sdo_timeout: DurationNs::from_millis(100),
        ..MasterConfig::default()
    }
}

/// A master with a good drive whose frames are disturbed for two seconds at most. Left alone, it has the drive in operation soon.
pub fn master(data: &[u8]) {
    let mut master = Master::new(network()).expect("a possible network");
    let (mut node, mut now, mut said) = (device(), START, Disturber::new(data));
    let id = NodeId::new(DEVICE).expect("a node-id");
    master.start(now);
    let (mut calm_since, disturbed_until) = (None, now + DurationNs::from_millis(2_000));
    loop {
        for _ in 0..BURST_MAX {
            let mut moved = false;
            node.handle_time(now);
            while let Some(frame) = node.poll(now) {
                moved = true;
                said.carry_frame(&frame, &mut |frame| {
                    let _ = master.handle_frame(now, frame);
                });
            }
            master.commit(id, 1);
            let mut sent = 0;
            while let Some(Output::Transmit(frame)) = master.poll(now) {
                moved = true;
                sent += 1;
                assert!(sent < BURST_MAX, "the master does not stop sending");
                node.handle_frame(now, &frame);
            }
            while let Some(event) = master.poll_event() {
                let _ = match event {
                    Event::AwaitingApplication { node, .. } => master.node_ready(node),
                    Event::BootFailed { node, .. } => master.retry(now, node),
                    _ => Ok(()),
                };
            }
            if !moved {
                break;
            }
        }
        if calm_since.is_none() && (said.is_over() || now >= disturbed_until) {
            said.calm();
            calm_since = Some(now);
        }
        if let Some(since) = calm_since {
            let state = master.node(id).expect("a device of the list").state;
            let fresh = master.consumer(id, 1).is_some_and(|consumer| consumer.fresh);
            if state == BootState::Operational && fresh {
                break;
            }
            let waited = now.since(since);
            assert!(waited < DurationNs::from_secs(20), "{state:?}, {waited} after all was well again");
        }
        now = now + MILLISECOND;
    }
    let torque = node.application().axes().iter().any(|axis| axis.actual().report == Report::Operating);
    assert!(!torque, "nobody has enabled the drive");
}

/// Data sheets and configurations: what was read is written and is read again as the same description.
pub fn eds(data: &[u8]) {
    let Ok(reading) = sheet::read(data) else { return };
    let description = reading.description;
    let printed: usize = reading.diagnostics.list().iter().map(|one| one.to_string().len()).sum();
    assert!(printed <= 200_000 + 2_000 * data.len(), "{printed}");
    for form in [Form::Sheet, Form::Configuration] {
        let text = description.to_text(form);
        let once = sheet::read(text.as_bytes()).expect("what was written").description;
        let again = once.to_text(form);
        let twice = sheet::read(again.as_bytes()).expect("what was written").description;
        assert_eq!(twice, once, "{text}\n---\n{again}");
    }
    let configuration = description.configuration(DEVICE);
    let bytes = configuration.to_bytes();
    assert_eq!(concise_form::parse(&bytes).expect("what was written").len(), configuration.writes.len());
    let _ = (description.is_drive(), description.axes());
    twin(description);
}

/// A drive like that of a data sheet: whatever it says, each object is there, is read and written, and time passes.
fn twin(description: sheet::DeviceDescription) {
    let Some(last) = description.axes().last().map(|axis| usize::from(axis.number)) else { return };
    let servos = vec![ServoParameters::default(); last + 1];
    let config = NodeSettings {
        node: NodeId::new(DEVICE).ok(),
        identity: identity_of(&description, identity(servos.len(), 1)),
        boot_time: DurationNs::from_millis(1),
        has_blocks: true,
        has_mapping: true,
    };
    let objects: Vec<_> = description.objects.iter().take(200).cloned().collect();
    let mut node =
        Node::new(&config, Twin::like(&servos, description, DEVICE).expect("the default servo works"));
    let mut now = MonotonicTime(1_000_000);
    let mut pass = |node: &mut Node<Twin>, frame: Option<(Id, [u8; 8], usize)>| {
        now = now + DurationNs::from_millis(1);
        match frame {
            Some((id, data, len)) => node.handle_frame(now, &wire::frame(id, &data[..len])),
            None => node.handle_time(now),
        }
        while node.poll(now).is_some() {}
    };
    (0..30).for_each(|_| pass(&mut node, None));
    let request = NodeId::new(DEVICE).map(cob_id::sdo_request).expect("a node-id");
    for object in &objects {
        let [low, high] = object.index.to_le_bytes();
        for sub in object.subs.iter().take(9) {
            pass(&mut node, Some((request, [0x40, low, high, sub.sub, 0, 0, 0, 0], 8)));
            pass(&mut node, Some((request, [0x22, low, high, sub.sub, 0xFF, 0xFF, 0xFF, 0x7F], 8)));
            pass(&mut node, Some((request, [0x2B, low, high, sub.sub, 0x0F, 0, 0, 0], 8)));
        }
    }
    // Started, with SYNC.
    pass(&mut node, Some((Id::Standard(0), [1, 0, 0, 0, 0, 0, 0, 0], 2)));
    for _ in 0..20 {
        pass(&mut node, Some((Id::Standard(0x80), [0; 8], 0)));
    }
}

/// Concise configurations.
pub fn concise(data: &[u8]) {
    if let Ok(entries) = concise_form::parse(data) {
        assert!(entries.len() <= data.len() / 7);
        assert_eq!(concise_form::emit(entries.iter().copied()), data);
        let text: String = entries.iter().map(ToString::to_string).collect();
        assert_printed(&text, data.len());
    }
}
