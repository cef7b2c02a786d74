use profile_generic::time::MonotonicTime;
use proptest::prelude::*;

use super::master::{AddressRange, LssFailure, LssReply, LssTask, Master, MasterConfig};
use super::slave::{Slave, SlaveConfig, SlaveEvent, SlaveState};
use crate::wire::NodeId;
use crate::wire::lss::{BitTiming, LSS_LEN, LssAddress, LssError, LssRequest, LssResponse};

const ADDRESS: LssAddress = LssAddress([0x0000_0319, 0x0002_0192, 0x0001_0000, 0xDEAD_BEEF]);

fn node(number: u8) -> NodeId {
    NodeId::new(number).unwrap()
}

fn ms(milliseconds: u64) -> MonotonicTime {
    MonotonicTime(milliseconds * 1_000_000)
}

fn config(address: LssAddress, node: Option<NodeId>) -> SlaveConfig {
    let bit_timings = [BitTiming::K1000, BitTiming::K500].into_iter().collect();
    SlaveConfig { address, node, bit_timings, storable: true }
}

/// A master and devices on one bus. Equal answers at the same time are one frame there.
struct Rig {
    master: Master,
    slaves: Vec<Slave>,
    now: u64,
    asked: usize,
    /// Answers of one kind that are lost.
    deaf: fn(&LssResponse) -> bool,
    /// Each device answers so many milliseconds after the one before it in the list.
    late: u64,
}

fn rig(slaves: Vec<SlaveConfig>) -> Rig {
    Rig {
        master: Master::new(MasterConfig::default()),
        slaves: slaves.into_iter().map(Slave::new).collect(),
        now: 0,
        asked: 0,
        deaf: |_| false,
        late: 0,
    }
}

impl Rig {
    fn run(&mut self, task: LssTask) -> (Result<LssReply, LssFailure>, Vec<SlaveEvent>) {
        assert!(self.master.start(ms(self.now), task));
        let mut events = vec![];
        let mut answers: Vec<(u64, [u8; LSS_LEN])> = vec![];
        for _ in 0..2_000 {
            answers.dedup();
            answers.retain(|&(at, answer)| {
                let lost = (self.deaf)(&LssResponse::parse(&answer).unwrap());
                if at <= self.now && !lost {
                    self.master.handle(ms(self.now), &answer).unwrap();
                }
                at > self.now
            });
            if let Some(frame) = self.master.poll(ms(self.now)) {
                self.asked += 1;
                for (place, slave) in (0..).zip(&mut self.slaves) {
                    events.extend(slave.handle(&frame).unwrap());
                    answers.extend(slave.poll().map(|answer| (self.now + place * self.late, answer)));
                }
                continue;
            }
            if let Some(outcome) = self.master.take_outcome() {
                return (outcome, events);
            }
            let wake = self.master.wake_at().map_or(self.now, |at| at.0 / 1_000_000);
            let next = answers.iter().map(|&(at, _)| at).min().unwrap_or(u64::MAX);
            self.now = wake.min(next).max(self.now);
        }
        panic!("{task:?} does not end");
    }

    fn reply(&mut self, task: LssTask) -> LssReply {
        self.run(task).0.unwrap()
    }
}

#[test]
fn slave_table() {
    type Case = (&'static str, Option<u8>, &'static [LssRequest]);
    use crate::wire::lss::{IdentifyPart as I, LssMode, Part};
    use LssRequest as R;
    let [vendor, product, revision, serial] = ADDRESS.0;
    let scan = |number, bit_check, sub, next| R::Fastscan { number, bit_check, sub, next };
    let configuration: &'static [R] = &[R::SwitchGlobal(LssMode::CONFIGURATION)];
    let cases: [Case; 4] = [
        ("waiting, node 5", Some(5), &[]),
        ("waiting, no node", None, &[]),
        ("configuration, node 5", Some(5), configuration),
        ("configuration, no node", None, configuration),
    ];
    let requests: [(&str, Vec<R>); 26] = [
        ("switch all to waiting", vec![R::SwitchGlobal(LssMode::WAITING)]),
        ("switch all to configuration", vec![R::SwitchGlobal(LssMode::CONFIGURATION)]),
        ("switch all to 2", vec![R::SwitchGlobal(LssMode(2))]),
        (
            "select",
            vec![
                R::SwitchSelective(Part::Vendor, vendor),
                R::SwitchSelective(Part::Product, product),
                R::SwitchSelective(Part::Revision, revision),
                R::SwitchSelective(Part::Serial, serial),
            ],
        ),
        (
            "select another serial",
            vec![
                R::SwitchSelective(Part::Vendor, vendor),
                R::SwitchSelective(Part::Product, product),
                R::SwitchSelective(Part::Revision, revision),
                R::SwitchSelective(Part::Serial, 1),
            ],
        ),
        (
            "select, product missing",
            vec![
                R::SwitchSelective(Part::Vendor, vendor),
                R::SwitchSelective(Part::Revision, revision),
                R::SwitchSelective(Part::Serial, serial),
            ],
        ),
        (
            "identify",
            vec![
                R::Identify(I::Vendor, vendor),
                R::Identify(I::Product, product),
                R::Identify(I::RevisionLow, revision),
                R::Identify(I::RevisionHigh, revision),
                R::Identify(I::SerialLow, 0),
                R::Identify(I::SerialHigh, u32::MAX),
            ],
        ),
        (
            "identify, serial too high",
            vec![
                R::Identify(I::Vendor, vendor),
                R::Identify(I::Product, product),
                R::Identify(I::RevisionLow, revision),
                R::Identify(I::RevisionHigh, revision),
                R::Identify(I::SerialLow, 0),
                R::Identify(I::SerialHigh, 1),
            ],
        ),
        ("identify unconfigured", vec![R::IdentifyUnconfigured]),
        ("fastscan: anybody", vec![scan(0, 0x80, 0, 0)]),
        ("fastscan: bit right", vec![scan(0, 31, 0, 0)]),
        ("fastscan: bit wrong", vec![scan(0x8000_0000, 31, 0, 0)]),
        ("fastscan: part out of turn", vec![scan(product, 0, 1, 1)]),
        ("fastscan: bit 32", vec![scan(0, 32, 0, 0)]),
        ("fastscan: part 4", vec![scan(0, 31, 4, 0)]),
        ("fastscan: next 4", vec![scan(0, 31, 0, 4)]),
        (
            "fastscan: all parts",
            vec![
                scan(vendor, 0, 0, 1),
                scan(product, 0, 1, 2),
                scan(revision, 0, 2, 3),
                scan(serial, 0, 3, 0),
            ],
        ),
        ("set node 7", vec![R::NodeId(7)]),
        ("set node 0", vec![R::NodeId(0)]),
        ("set node 255, to waiting", vec![R::NodeId(255), R::SwitchGlobal(LssMode::WAITING)]),
        ("set node 7, to waiting", vec![R::NodeId(7), R::SwitchGlobal(LssMode::WAITING)]),
        ("set bit rate", vec![R::BitTiming { table: 0, entry: BitTiming::K500 }]),
        ("set bit rate it has not", vec![R::BitTiming { table: 0, entry: BitTiming::K10 }]),
        ("activate", vec![R::ActivateBitTiming { delay_ms: 100 }]),
        ("store", vec![R::Store]),
        ("inquire", vec![R::Inquire(Part::Serial), R::InquireNodeId]),
    ];
    let mut table = String::new();
    for (name, number, way) in cases {
        for (asked, requests) in &requests {
            let mut slave = Slave::new(config(ADDRESS, number.map(node)));
            let mut said = vec![];
            for request in way.iter().chain(requests) {
                let event = slave.handle(&request.emit()).unwrap();
                said.extend(slave.poll().map(|answer| LssResponse::parse(&answer).unwrap().to_string()));
                said.extend(event.map(|event| format!("{event:?}")));
            }
            let said = if said.is_empty() { "-".into() } else { said.join("; ") };
            table += &format!("{name:<22} {asked:<27} -> {:<13} {said}\n", slave.state());
        }
    }
    insta::assert_snapshot!(table);
}

#[test]
fn master_table() {
    let range = AddressRange { vendor: 1, product: 2, revision: (0, 9), serial: (5, 5) };
    let tasks = [
        LssTask::SwitchAllToWaiting,
        LssTask::SwitchAllToConfiguration,
        LssTask::Select(ADDRESS),
        LssTask::Fastscan,
        LssTask::Identify(range),
        LssTask::IdentifyUnconfigured,
        LssTask::InquireAddress,
        LssTask::InquireNodeId,
        LssTask::SetNodeId(Some(node(7))),
        LssTask::SetBitTiming(BitTiming::K500),
        LssTask::ActivateBitTiming { delay_ms: 100 },
        LssTask::Store,
    ];
    use crate::wire::lss::Part;
    let (ok, refused) = (LssError::OK, LssError::REFUSED);
    let answers = [
        LssResponse::Selected,
        LssResponse::Identified,
        LssResponse::Unconfigured,
        LssResponse::Inquired(Part::Vendor, 1),
        LssResponse::Inquired(Part::Serial, 1),
        LssResponse::InquiredNodeId(5),
        LssResponse::InquiredNodeId(255),
        LssResponse::InquiredNodeId(0),
        LssResponse::NodeId { error: ok, specific: 0 },
        LssResponse::NodeId { error: refused, specific: 0 },
        LssResponse::BitTiming { error: ok, specific: 0 },
        LssResponse::BitTiming { error: LssError::MANUFACTURER, specific: 3 },
        LssResponse::Store { error: ok, specific: 0 },
        LssResponse::Store { error: LssError::STORAGE, specific: 0 },
    ];
    let mut table = String::new();
    for task in tasks {
        let begin = || {
            let mut master = Master::new(MasterConfig::default());
            assert!(master.start(ms(0), task));
            let frames: Vec<_> = core::iter::from_fn(|| master.poll(ms(0))).collect();
            (master, frames)
        };
        let (mut master, frames) = begin();
        let name = format!("{task:?}").split(['(', ' ']).next().unwrap().to_string();
        for frame in frames {
            table += &format!("{name:<24} sends {}\n", LssRequest::parse(&frame).unwrap());
        }
        let end = |outcome: Result<LssReply, LssFailure>| match outcome {
            Ok(reply) => reply.to_string(),
            Err(failure) => format!("failure: {failure}"),
        };
        if let Some(outcome) = master.take_outcome() {
            table += &format!("{name:<24} {}\n", end(outcome));
            continue;
        }
        for answer in answers {
            let (mut master, _) = begin();
            if !master.handle(ms(1), &answer.emit()).unwrap() {
                continue;
            }
            let next = match (master.take_outcome(), master.poll(ms(1))) {
                (Some(outcome), _) => end(outcome),
                (None, Some(frame)) => format!("sends {}", LssRequest::parse(&frame).unwrap()),
                (None, None) => "-".into(),
            };
            table += &format!("{name:<24} {answer} -> {next}\n");
        }
        let wait = master.wake_at().unwrap();
        let frame = master.poll(wait);
        let next = match (master.take_outcome(), frame) {
            (Some(outcome), _) => end(outcome),
            (None, Some(frame)) => format!("sends {}", LssRequest::parse(&frame).unwrap()),
            (None, None) => "-".into(),
        };
        table += &format!("{name:<24} silence for {} ms -> {next}\n", wait.0 / 1_000_000);
    }
    insta::assert_snapshot!(table);
}

#[test]
fn a_device_is_selected_and_given_a_node_id_that_it_keeps() {
    let other = LssAddress([1, 2, 3, 4]);
    let mut rig = rig(vec![config(ADDRESS, None), config(other, Some(node(9)))]);
    assert_eq!(rig.reply(LssTask::Select(ADDRESS)), LssReply::Done);
    assert_eq!(rig.slaves[1].state(), SlaveState::Waiting);
    assert_eq!(rig.reply(LssTask::InquireNodeId), LssReply::NodeId(None));
    assert_eq!(rig.reply(LssTask::InquireAddress), LssReply::Address(ADDRESS));
    assert_eq!(rig.reply(LssTask::SetNodeId(Some(node(3)))), LssReply::Done);
    assert_eq!(rig.reply(LssTask::SetBitTiming(BitTiming::K500)), LssReply::Done);
    let refused = LssFailure::Refused { error: LssError::REFUSED, specific: 0 };
    assert_eq!(rig.run(LssTask::SetBitTiming(BitTiming::K10)).0, Err(refused));
    let stored = SlaveEvent::Store { node: Some(node(3)), timing: Some(BitTiming::K500) };
    assert_eq!(rig.run(LssTask::Store), (Ok(LssReply::Done), vec![stored]));
    let active = SlaveEvent::Activate { timing: Some(BitTiming::K500), delay_ms: 100 };
    let before = rig.now;
    assert_eq!(rig.run(LssTask::ActivateBitTiming { delay_ms: 100 }), (Ok(LssReply::Done), vec![active]));
    assert_eq!(rig.now - before, 200);
    let taken = SlaveEvent::NodeId(Some(node(3)));
    assert_eq!(rig.run(LssTask::SwitchAllToWaiting), (Ok(LssReply::Done), vec![taken]));
    rig.slaves[0].reset();
    rig.reply(LssTask::Select(ADDRESS));
    assert_eq!(rig.reply(LssTask::InquireNodeId), LssReply::NodeId(Some(node(3))));
}

#[test]
fn nobody_and_somebody_are_told_apart() {
    let mut rig = rig(vec![config(ADDRESS, Some(node(5)))]);
    assert_eq!(rig.reply(LssTask::IdentifyUnconfigured), LssReply::Found(false));
    assert_eq!(rig.reply(LssTask::Fastscan), LssReply::Found(false));
    let [vendor, product, revision, serial] = ADDRESS.0;
    let range = |serial| AddressRange { vendor, product, revision: (revision, revision), serial };
    assert_eq!(rig.reply(LssTask::Identify(range((0, u32::MAX)))), LssReply::Found(true));
    assert_eq!(rig.reply(LssTask::Identify(range((0, serial - 1)))), LssReply::Found(false));
    let timeout = LssFailure::Timeout { milliseconds: 500 };
    assert_eq!(rig.run(LssTask::Select(LssAddress([0; 4]))).0, Err(timeout));
}

fn scan_all(late: u64) {
    let addresses = [ADDRESS, LssAddress([0x319, 0x0002_0192, 0x0001_0000, 1]), LssAddress([u32::MAX; 4])];
    let mut slaves: Vec<_> = addresses.iter().map(|&address| config(address, None)).collect();
    slaves.push(config(LssAddress([7; 4]), Some(node(100))));
    let mut rig = Rig { late, ..rig(slaves) };
    let mut found = vec![];
    for number in 1..=3 {
        let LssReply::Address(address) = rig.reply(LssTask::Fastscan) else { panic!("nobody") };
        found.push(address);
        assert_eq!(rig.reply(LssTask::SetNodeId(Some(node(number)))), LssReply::Done);
        rig.reply(LssTask::SwitchAllToWaiting);
        for slave in &mut rig.slaves {
            slave.reset();
        }
    }
    // Zero bits are tried first, so that the lowest numbers come first.
    assert_eq!(found, [addresses[1], addresses[0], addresses[2]]);
    assert_eq!(rig.reply(LssTask::Fastscan), LssReply::Found(false));
    let nodes = rig.slaves.iter().map(|slave| slave.node().unwrap().get());
    assert_eq!(nodes.collect::<Vec<_>>(), [2, 1, 3, 100]);
}

#[test]
fn a_scan_finds_every_device_without_a_node_id_one_after_the_other() {
    scan_all(0);
}

#[test]
fn answers_that_come_one_after_the_other_belong_to_one_question() {
    scan_all(1);
    scan_all(9);
}

#[test]
fn a_scan_whose_answers_are_lost_says_where_it_came_to() {
    let mut rig = rig(vec![config(ADDRESS, None)]);
    assert!(rig.master.start(ms(0), LssTask::Fastscan));
    let frame = rig.master.poll(ms(0)).unwrap();
    rig.slaves[0].handle(&frame).unwrap();
    rig.master.handle(ms(0), &rig.slaves[0].poll().unwrap()).unwrap();
    // The device is gone: all its bits seem to be ones.
    let mut polls = (1..500).map(|step| {
        rig.master.poll(ms(20 * step));
        rig.master.take_outcome()
    });
    let all_ones = LssAddress([u32::MAX, 0, 0, 0]);
    assert_eq!(polls.find_map(|outcome| outcome), Some(Err(LssFailure::Unstable(all_ones))));
    rig.now = 20_000;
    rig.deaf = |answer| *answer == LssResponse::Identified;
    assert_eq!(rig.run(LssTask::Fastscan).0, Ok(LssReply::Found(false)));
}

#[test]
fn what_is_no_frame_of_lss_changes_nothing() {
    let mut slave = Slave::new(config(ADDRESS, None));
    let mut master = Master::new(MasterConfig::default());
    master.start(ms(0), LssTask::InquireNodeId);
    master.poll(ms(0));
    for bytes in [&[][..], &[0x04; 7], &[0x04; 9], &[0x99; 8]] {
        assert!(slave.handle(bytes).is_err() && master.handle(ms(0), bytes).is_err());
    }
    assert_eq!((slave.state(), master.take_outcome()), (SlaveState::Waiting, None));
    // An answer to another question.
    assert_eq!(master.handle(ms(0), &LssResponse::Selected.emit()), Ok(false));
    assert!(!master.start(ms(0), LssTask::Fastscan));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn a_scan_finds_any_address(numbers: [u32; 4]) {
        let mut rig = rig(vec![config(LssAddress(numbers), None)]);
        prop_assert_eq!(rig.reply(LssTask::Fastscan), LssReply::Address(LssAddress(numbers)));
        prop_assert_eq!(rig.slaves[0].state(), SlaveState::Configuration);
        // One question per bit, one per part, and the first one.
        prop_assert_eq!(rig.asked, 1 + 4 * 33);
    }

    #[test]
    fn arbitrary_frames_never_panic(frames in prop::collection::vec(any::<[u8; 8]>(), 0..40)) {
        let mut slave = Slave::new(config(ADDRESS, None));
        let mut master = Master::new(MasterConfig::default());
        for (frame, at) in frames.iter().zip(0..) {
            master.start(ms(at), LssTask::Fastscan);
            let _ = slave.handle(frame);
            let _ = master.handle(ms(at), frame);
            let _ = (slave.poll(), master.poll(ms(at)));
        }
    }
}
