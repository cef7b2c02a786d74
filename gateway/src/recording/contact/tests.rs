use std::net::SocketAddrV4;

use profile_cip::device::motion_link::AssemblyRole;
use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::motion::attribute_list::ListWriter;
use profile_cip::wire::motion::codes::{AxisStateCode, MotionService, NodeStatus, SyncStatus};
use profile_cip::wire::motion::header::ActualHeader;
use profile_cip::wire::motion::{ActualBlock, ActualInstance, ActualWriter, ServiceResponse};

use super::*;
use crate::capture::synth::Synthesizer;
use crate::status::tests::distinct;

const DEVICE: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 1), 2_222);
const SECOND: u64 = 1_000 * MILLI;
const START: u64 = 1_769_860_800 * SECOND;

fn controller(last: u8) -> SocketAddrV4 {
    SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, last), 50_000)
}

fn triad(number: u16) -> ConnectionTriad {
    ConnectionTriad { connection_serial: number, originator_vendor: 1, originator_serial: 2 }
}

fn at(milliseconds: u64) -> KernelTime {
    KernelTime(START + milliseconds * MILLI)
}

struct Bench {
    contacts: Contacts,
    explicit: FrameRing,
}

impl Bench {
    fn new(memory: usize) -> Self {
        let device = |name: &str, last| ContactDevice {
            name: name.to_owned(),
            address: Ipv4Addr::new(192, 0, 2, last),
        };
        let axes = [("turntable", 0), ("slide", 1)].map(|(name, device)| (name.to_owned(), device));
        let names = [(46, "Position Unwind".to_owned())].into();
        let devices = vec![device("front", 1), device("back", 2)];
        let contacts = Contacts::new(devices, axes.to_vec(), Arc::new(names), memory, None);
        Self { contacts, explicit: FrameRing::new(100_000) }
    }

    fn event(&mut self, milliseconds: u64, event: Event) {
        let happening = Happening { device: 0, at: at(milliseconds), event };
        self.contacts.take(&happening, &self.explicit);
    }

    fn open(&mut self, milliseconds: u64, last: u8, number: u16) {
        let event = Event::MotionOpened { triad: triad(number), originator: controller(last), rpi_us: 2_000 };
        self.event(milliseconds, event);
    }

    fn refuse(&mut self, milliseconds: u64, last: u8, extended: u16) {
        self.event(
            milliseconds,
            Event::OpenRefused {
                triad: triad(9),
                originator: controller(last),
                general: 1,
                extended,
                found: Some(3),
                expected: Some(2),
            },
        );
    }

    /// An update of the device to a controller.
    fn update(
        &mut self,
        milliseconds: u64,
        last: u8,
        node: NodeStatus,
        axis: AxisStateCode,
        service: Option<ServiceResponse<'_>>,
    ) {
        let header = ActualHeader {
            update_id: 1,
            node_status: node | NodeStatus::DATA_VALID,
            instance_count: 0,
            node_fault: profile_cip::wire::motion::codes::NodeFault(0),
            node_alarm: profile_cip::wire::motion::codes::NodeAlarm(0),
            last_received_id: 1,
            time_stamp: None,
            time_offset: None,
            update_diagnostics: None,
            time_diagnostics: None,
        };
        let mut buffer = [0; 512];
        let mut writer = ActualWriter::new(&mut buffer, &header).unwrap();
        let cyclic = Some(ActualBlock { axis_state: axis, ..ActualBlock::default() });
        writer.instance(&ActualInstance { number: 1, cyclic, service, ..ActualInstance::default() }).unwrap();
        let len = writer.finish();
        let mut datagram = [0; 600];
        let len = Class1Datagram {
            connection_id: 7,
            encapsulation_sequence: 1,
            sequence_count: 1,
            data: &buffer[..len],
        }
        .emit(&mut datagram)
        .unwrap();
        let to = SocketAddrV4::new(*controller(last).ip(), 2_222);
        let contacts = &mut self.contacts;
        Synthesizer::new()
            .udp(DEVICE, to, 0, &datagram[..len], &mut |frame| {
                contacts.frame(at(milliseconds), Side::North, frame);
            })
            .unwrap();
    }

    fn newest(&self) -> Contact {
        self.contacts.list().remove(0)
    }
}

fn phases(contact: &Contact) -> Vec<(Phase, u64)> {
    contact.phases.iter().map(|one| (one.phase, one.after_ms)).collect()
}

fn response(service: MotionService, status: u8, data: &[u8]) -> Option<ServiceResponse<'_>> {
    Some(ServiceResponse { transaction_id: 1, service, general_status: status, extended_status: 0, data })
}

#[test]
fn phases_are_those_that_the_frames_show_and_the_next_one_is_awaited() {
    let mut bench = Bench::new(2_000_000);
    bench.open(0, 10, 1);
    let mut status = distinct();
    status.axes.iter_mut().for_each(|axis| (axis.wait, axis.fault) = (None, None));
    let awaited = |bench: &mut Bench| {
        bench.contacts.look(&status);
        bench.newest().awaited
    };
    let none = NodeStatus::empty();
    let (init, running) = (AxisStateCode::INITIALIZING, AxisStateCode::RUNNING);
    assert_eq!(awaited(&mut bench), [Phase::Configuration.awaited()]);
    // Of another controller: nothing of it counts here.
    bench.update(5, 11, NodeStatus::SYNC_MODE, running, None);
    bench.update(6, 10, none, init, None);
    assert_eq!(phases(&bench.newest()), [(Phase::ForwardOpen, 0)]);

    let mut body = [0; 64];
    let mut list = ListWriter::new(&mut body).unwrap();
    for (id, status) in [(45, 0), (46, 9), (47, 0x0E)] {
        list.status(profile_cip::wire::motion::attribute_list::SetStatus { id, status, index: 0 }).unwrap();
    }
    let len = list.finish();
    let set = MotionService::SET_AXIS_ATTRIBUTES_LIST;
    bench.update(10, 10, none, init, response(set, 0x0C, &[]));
    bench.update(20, 10, none, init, response(set, 0, &body[..len]));
    bench.update(21, 10, none, init, response(set, 0, &body[..len]));
    assert_eq!(awaited(&mut bench), [Phase::GroupSync.awaited()]);
    let not = [SyncStatus::NOT_SYNCHRONIZED.0, 0, 0, 0];
    bench.update(30, 10, none, init, response(MotionService::GROUP_SYNC, 0, &not));
    assert_eq!(phases(&bench.newest()).len(), 2, "not synchronized is not reached");
    bench.update(40, 10, none, init, response(MotionService::GROUP_SYNC, 0, &[0; 4]));
    bench.update(50, 10, NodeStatus::SYNC_MODE, init, None);
    assert_eq!(awaited(&mut bench), [Phase::FirstEnable.awaited()]);
    // Long after the ten seconds of frames.
    bench.update(60_000, 10, NodeStatus::SYNC_MODE, running, None);
    let contact = bench.newest();
    use Phase::{Configuration, FirstEnable, ForwardOpen, GroupSync, Synchronous};
    let reached =
        [(ForwardOpen, 0), (Configuration, 20), (GroupSync, 40), (Synchronous, 50), (FirstEnable, 60_000)];
    assert_eq!(phases(&contact), reached);
    assert!(awaited(&mut bench).is_empty());
    assert_eq!(contact.frames, 7, "those of the first ten seconds");
    let refused: Vec<_> = contact
        .refused
        .iter()
        .map(|one| (one.service.as_str(), one.reason.as_str(), one.after_ms, one.count))
        .collect();
    let list = format!("{set} of axis instance 1");
    let unwind = format!("{list}, attribute 46 (Position Unwind)");
    assert_eq!(refused.len(), 4, "{refused:?}");
    assert_eq!((refused[0].0, refused[0].2, refused[0].3), (list.as_str(), 10, 1));
    assert_eq!((refused[1].0, refused[1].2, refused[1].3), (unwind.as_str(), 20, 2));
    assert_eq!(refused[1].1, GeneralStatus(9).to_string());
    assert_eq!(refused[2].0, format!("{list}, attribute 47"));
    assert!(refused[3].1.contains("not synchronized"), "{refused:?}");
}

#[test]
fn end_of_a_connection_is_that_of_its_contact() {
    let mut bench = Bench::new(2_000_000);
    bench.open(0, 10, 1);
    bench.event(1_000, Event::MotionClosed { triad: triad(2) });
    assert_eq!(bench.newest().end, None, "another connection");
    bench.event(2_000, Event::MotionClosed { triad: triad(1) });
    let contact = bench.newest();
    let end = contact.end.clone().unwrap();
    assert_eq!(end.after_ms, Some(2_000));
    assert!(end.by.ends_with("closed by its originator"), "{end:?}");
    // What comes later is of nobody.
    bench.update(3_000, 10, NodeStatus::SYNC_MODE, AxisStateCode::RUNNING, None);
    assert_eq!(bench.newest(), contact);
    let opened = Event::AssemblyOpened {
        group: None,
        role: AssemblyRole::ExclusiveOwner,
        triad: triad(3),
        originator: controller(10),
        intervals_us: (8_000, 8_000),
    };
    bench.event(4_000, opened);
    let (from, to) = (DriveState::Starting, DriveState::Operating);
    bench.contacts.note(at(4_500), &Notice::State { axis: 1, from, to });
    assert_eq!(bench.newest().phases.len(), 1, "an axis of another device");
    bench.contacts.note(at(5_000), &Notice::State { axis: 0, from, to });
    let contact = bench.newest();
    assert_eq!((contact.kind.as_str(), contact.number), (AssemblyRole::ExclusiveOwner.name(), 2));
    assert_eq!(phases(&contact), [(Phase::ForwardOpen, 0), (Phase::FirstEnable, 1_000)]);
    bench.contacts.close();
    assert_eq!(bench.newest().end.unwrap().by, UNSEEN);
}

#[test]
fn storm_of_refusals_is_one_contact_with_its_count_and_pushes_nothing_out() {
    let mut bench = Bench::new(2_000_000);
    bench.open(0, 10, 1);
    bench.refuse(1, 11, 0x0106);
    for number in 0..10_000 {
        bench.refuse(2 + number, 12, 0x0100 + u16::try_from(number % 40).unwrap());
        bench.refuse(2 + number, 13, 0x0106);
    }
    let contacts = bench.contacts.list();
    let of = |last| {
        contacts.iter().filter(|contact| contact.peer == controller(last).to_string()).collect::<Vec<_>>()
    };
    assert_eq!((of(10).len(), of(11).len(), of(12).len(), of(13).len()), (1, 1, REFUSALS_OF_PEER_MAX, 1));
    let storm = of(13)[0];
    assert_eq!((storm.attempts, storm.refused[0].count, storm.kind.as_str()), (10_000, 10_000, "refused"));
    assert_eq!(storm.last, utc_of(at(10_001)));
    let reason = &storm.refused[0].reason;
    let status = ConnectionStatus(0x0106).name().unwrap();
    assert!(reason.contains(status) && reason.ends_with(": expected 0x2, found 0x3"), "{reason}");
    // Refusals of many peers take no place of a connection.
    for last in 20..=250 {
        bench.refuse(20_000, last, 0x0106);
    }
    let contacts = bench.contacts.list();
    assert_eq!(contacts.iter().filter(|contact| contact.kind == REFUSED).count(), PLACES_MIN);
    assert!(contacts.iter().any(|contact| contact.kind == "motion"));
}

#[test]
fn peer_that_reconnects_without_end_leaves_the_contacts_of_others_and_its_last_good_one() {
    let mut bench = Bench::new(2_000_000);
    for number in 0..4 {
        bench.open(number, 10, u16::try_from(number).unwrap());
    }
    bench.open(10, 11, 10);
    bench.update(11, 11, NodeStatus::SYNC_MODE, AxisStateCode::STOPPED, None);
    for number in 100..5_000_u16 {
        bench.open(u64::from(number), 11, number);
        bench.event(u64::from(number), Event::MotionClosed { triad: triad(number) });
    }
    let contacts = bench.contacts.list();
    let of = |last| contacts.iter().filter(|contact| contact.peer == controller(last).to_string()).count();
    assert_eq!((contacts.len(), of(10), of(11)), (PLACES_MIN, 4, 6));
    assert_eq!(contacts[0].number, 4_905, "the newest one is there");
    assert!(contacts.iter().any(|contact| contact.number == 5), "the one that came to synchronous operation");
}

#[test]
fn memory_of_frames_is_bounded_and_services_keep_their_part() {
    let mut bench = Bench::new(10 * (REFUSED_LEN_MAX + 40_000));
    bench.open(0, 10, 1);
    let none = NodeStatus::empty();
    for number in 0..1_000 {
        bench.update(number, 10, none, AxisStateCode::STOPPED, None);
    }
    let full = bench.newest();
    assert!(full.frames > 100 && full.frames_left_out == 1_000 - full.frames, "{full:?}");
    bench.update(2_000, 10, none, AxisStateCode::STOPPED, response(MotionService::GROUP_SYNC, 0, &[0; 4]));
    assert_eq!(bench.newest().frames, full.frames + 1);
    let (frames, _) = bench.contacts.frames(1).unwrap();
    assert!(frames.len() <= 40_000, "{}", frames.len());
    assert!(bench.contacts.frames(2).is_none());
}

#[test]
fn stream_before_the_forward_open_belongs_to_the_contact() {
    let mut bench = Bench::new(2_000_000);
    let (peer, device) = (controller(10), SocketAddrV4::new(*DEVICE.ip(), 44_818));
    let mut synth = Synthesizer::new();
    for (milliseconds, client) in [(0, controller(11)), (15_000, peer)] {
        let explicit = &mut bench.explicit;
        synth.tcp_open(client, device, &mut |frame| explicit.push(at(milliseconds), Side::North, frame));
    }
    bench.open(16_000, 10, 1);
    assert_eq!(bench.newest().frames, 3, "its own handshake, not that of another client");
    bench.open(40_000, 10, 2);
    assert_eq!(bench.newest().frames, 0, "that is long ago");
}

#[test]
fn contacts_on_disk_are_those_of_the_next_run() {
    let folder = std::env::temp_dir().join(format!("axisbridge-contacts-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    let open = || {
        let device = ContactDevice { name: "front".to_owned(), address: *DEVICE.ip() };
        Contacts::new(vec![device], Vec::new(), AttributeNames::default(), 2_000_000, Some(folder.clone()))
    };
    let mut bench = Bench { contacts: open(), ..Bench::new(2_000_000) };
    let save = |contacts: &mut Contacts| {
        let (files, changed, numbers) = contacts.take_unsaved().unwrap();
        let count = changed.len();
        for (contact, frames) in changed {
            files.write(&contact, (!frames.is_empty()).then_some(&b"frames"[..])).unwrap();
        }
        files.retain(&numbers);
        count
    };
    bench.open(0, 10, 1);
    bench.update(1, 10, NodeStatus::SYNC_MODE, AxisStateCode::STOPPED, None);
    assert!(!bench.contacts.is_unsaved(), "its frames still come");
    bench.refuse(2, 11, 0x0106);
    assert_eq!(save(&mut bench.contacts), 1);
    bench.update(10_500, 10, NodeStatus::SYNC_MODE, AxisStateCode::STOPPED, None);
    assert_eq!(save(&mut bench.contacts), 1);
    assert!(!bench.contacts.is_unsaved());
    std::fs::write(folder.join("000099.json"), "{").unwrap();
    let mut next = open();
    let (first, refused) = (next.list().remove(1), next.list().remove(0));
    assert_eq!((first.number, first.end.unwrap().by.as_str()), (1, UNSEEN));
    assert_eq!((refused.number, refused.attempts), (2, 1));
    assert_eq!(next.frames(1).unwrap().1, Some(folder.join("000001.pcapng")));
    // Numbers go on, and what makes room is removed from the disk.
    let mut bench = Bench { contacts: next, ..Bench::new(2_000_000) };
    for number in 0..12 {
        bench.open(20_000 + u64::from(number), 10, number);
        bench.event(20_000 + u64::from(number), Event::MotionClosed { triad: triad(number) });
    }
    assert_eq!(bench.newest().number, 14);
    assert_eq!(save(&mut bench.contacts), 9);
    next = open();
    assert_eq!(next.list().len(), 11);
    assert!(folder.join("000001.json").exists(), "the last good one");
    std::fs::remove_dir_all(&folder).unwrap();
}
