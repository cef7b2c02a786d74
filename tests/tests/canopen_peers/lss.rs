//! Our LSS master against devices on PyPI's durand that have no node-id.

use axisbridge::sys::can_socket::{CanSocket, Content, Options};
use axisbridge::sys::clock::monotonic_now;
use profile_cia402::lss::master::{LssFailure, LssReply, LssTask, Master, MasterConfig};
use profile_cia402::sdo::request::SdoRequest;
use profile_cia402::wire::lss::{BitTiming, LssAddress};
use profile_cia402::wire::{Mux, NodeId, cob_id, frame};
use profile_generic::can::{Frame, Id};
use profile_generic::time::DurationNs;

use super::blocks::Channel;
use super::*;

/// Vendor, product and revision of the devices, and a serial number.
fn address(serial: u32) -> LssAddress {
    LssAddress([0x7FFF_FFF1, 0x0400_D00D, 0x8000_0001, serial])
}

struct Bus {
    socket: CanSocket,
    lss: Master,
    /// Boot-up messages seen.
    booted: Vec<u16>,
}

impl Bus {
    fn open() -> Self {
        let socket = CanSocket::open(INTERFACE, &Options::default()).unwrap();
        // A Python device needs some milliseconds for an answer, one that is late on purpose some more.
        let config =
            MasterConfig { timeout: DurationNs::from_secs(2), scan_timeout: DurationNs::from_millis(30) };
        Self { socket, lss: Master::new(config), booted: vec![] }
    }

    fn task(&mut self, task: LssTask) -> Result<LssReply, LssFailure> {
        assert!(self.lss.start(monotonic_now(), task));
        loop {
            while let Some(received) = self.socket.recv().unwrap() {
                let Content::Frame(frame) = received.content else { panic!("{received:?}") };
                self.take(&frame);
            }
            if let Some(request) = self.lss.poll(monotonic_now()) {
                self.socket.send(&frame(cob_id::LSS_REQUEST, &request)).unwrap();
            }
            if let Some(outcome) = self.lss.take_outcome() {
                return outcome;
            }
            let wait = self.lss.wake_at().map_or(0, |at| at.since(monotonic_now()).0).clamp(0, 10_000_000);
            let _ = self.socket.wait(Duration::from_nanos(wait.unsigned_abs())).unwrap();
        }
    }

    /// Where the machine is busy a Python device may be later than that: the scan notices it, and is repeated.
    fn scan(&mut self) -> Result<LssReply, LssFailure> {
        let mut scans = (0..10).map(|_| self.task(LssTask::Fastscan));
        scans.find(|outcome| !matches!(outcome, Err(LssFailure::Unstable(_)))).expect("a scan that ends well")
    }

    fn take(&mut self, frame: &Frame) {
        if frame.id() == cob_id::LSS_RESPONSE {
            self.lss.handle(monotonic_now(), frame.data()).unwrap();
        } else if let (Id::Standard(id @ 0x701..0x780), [0]) = (frame.id(), frame.data()) {
            self.booted.push(id & 0x7F);
        }
    }

    /// Until a device with this node-id has said that it is there.
    fn boots(&mut self, node: u16) {
        while !self.booted.contains(&node) {
            assert!(self.socket.wait(Duration::from_secs(10)).unwrap(), "no boot-up of {node}");
            while let Some(received) = self.socket.recv().unwrap() {
                let Content::Frame(frame) = received.content else { panic!("{received:?}") };
                self.take(&frame);
            }
        }
    }
}

#[test]
fn devices_without_a_node_id_are_found_one_by_one() {
    let Some(python) = python_inside("lss::devices_without_a_node_id_are_found_one_by_one") else { return };
    // Two that answer at different times: the bus carries the answers to one question one after the other.
    let arguments = [INTERFACE, "5A5A0001", "5A5A0003:5"];
    let mut devices = Peer::start(&python, "canopen_lss.py", &arguments);
    let mut bus = Bus::open();
    assert_eq!(bus.task(LssTask::IdentifyUnconfigured), Ok(LssReply::Found(true)));
    let mut found = vec![];
    for number in [NODE, NODE + 1] {
        let outcome = bus.scan();
        let Ok(LssReply::Address(address)) = outcome else {
            panic!("{outcome:?} {found:?} {}", devices.said())
        };
        found.push(address);
        // The one that was found, and no other one, is in configuration.
        assert_eq!(bus.task(LssTask::InquireAddress), Ok(LssReply::Address(address)));
        assert_eq!(bus.task(LssTask::InquireNodeId), Ok(LssReply::NodeId(None)));
        let node = NodeId::new(number).unwrap();
        assert_eq!(bus.task(LssTask::SetNodeId(Some(node))), Ok(LssReply::Done));
        assert_eq!(bus.task(LssTask::SetBitTiming(BitTiming(2))), Ok(LssReply::Done));
        assert_eq!(bus.task(LssTask::Store), Ok(LssReply::Done));
        devices.says(&format!("{:X} stores {number} 500000", address.0[3]));
        assert_eq!(bus.task(LssTask::SwitchAllToWaiting), Ok(LssReply::Done));
        bus.boots(number.into());
    }
    assert_eq!(found, [0x5A5A_0001, 0x5A5A_0003].map(address));
    assert_eq!(bus.task(LssTask::Fastscan), Ok(LssReply::Found(false)));
    assert_eq!(bus.task(LssTask::IdentifyUnconfigured), Ok(LssReply::Found(false)));
    // By its address; what there is not is refused.
    assert_eq!(bus.task(LssTask::Select(address(0x5A5A_0003))), Ok(LssReply::Done));
    let node = NodeId::new(NODE + 1).unwrap();
    assert_eq!(bus.task(LssTask::InquireNodeId), Ok(LssReply::NodeId(Some(node))));
    let refused = bus.task(LssTask::SetBitTiming(BitTiming(5)));
    assert!(matches!(refused, Err(LssFailure::Refused { .. })), "{refused:?}");
    assert_eq!(bus.task(LssTask::SwitchAllToWaiting), Ok(LssReply::Done));
    let nobody = bus.task(LssTask::Select(address(7)));
    assert_eq!(nobody, Err(LssFailure::Timeout { milliseconds: 2_000 }));
    // Its objects come from where it now is.
    let serial = Channel::open().ask(SdoRequest::upload(Mux::new(0x1018, 4)));
    assert_eq!((serial.result, serial.data.unsigned()), (Ok(()), Some(0x5A5A_0001)));
}
