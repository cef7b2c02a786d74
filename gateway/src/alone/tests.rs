//! Simulated drives without a gateway, in virtual time.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use profile_cia402::wire::{Function, NodeId};
use profile_cip::devicenet::master::config::{DataRate, MasterConfig as DevicenetMaster, SlaveConfig};
use profile_cip::devicenet::slave::Slave;
use profile_cip::devicenet::slave::motion_drive::MotionDrive;
use profile_cip::devicenet::wire::speed::Assembly;
use profile_cip::devicenet::wire::{Identifier, MacId};
use profile_generic::can::Frame;
use profile_generic::can::bus as wire;
use profile_generic::can::timing::BitRate;
use profile_generic::scaling::UnitKind;
use profile_sercos::checker::checked_bus::CheckedBus;
use profile_sercos::master::config::MasterConfig;
use profile_sercos::master::event::Port;
use profile_sercos::wire::header::Phase;
use profile_sercos::wire::idn::Idn;

use super::can::CanLine;
use super::devicenet::DevicenetLine;
use super::sercos::SercosLine;
use super::*;
use crate::config::DevicenetKind;
use crate::engine::port::{CanInput, CanPort, CanSent, EthernetPort};
use crate::mapping::Mapping;
use crate::parameter::attributes::attributes;
use crate::parameter::known::Bus;
use crate::simulate::can_bus::InProcessCan;
use crate::simulate::can_drive::{DriveNode, drive};
use crate::simulate::devicenet_drive::{self, DevicenetNode};
use crate::simulate::drives::{DriveNetwork, SIMULATED_MAC, drives};

/// Two drives in a line, with the checker.
struct Judged {
    network: DriveNetwork,
    checked: CheckedBus,
    returned: VecDeque<(Port, Vec<u8>)>,
    /// The highest phase that a drive was in.
    highest: Option<Phase>,
}

/// A part that the test looks at while a session has it.
struct Shared<T>(Rc<RefCell<T>>);

impl<T> Clone for Shared<T> {
    fn clone(&self) -> Self {
        Self(Rc::clone(&self.0))
    }
}

impl EthernetPort for Shared<Judged> {
    fn receive(&mut self, buffer: &mut [u8]) -> Option<(Port, usize)> {
        let (port, frame) = self.0.borrow_mut().returned.pop_front()?;
        buffer[..frame.len()].copy_from_slice(&frame);
        Some((port, frame.len()))
    }

    fn send(&mut self, now: MonotonicTime, port: Port, frame: &[u8]) -> bool {
        let Judged { network, checked, returned, highest } = &mut *self.0.borrow_mut();
        network.handle_time(now);
        let mut arrived = |port, frame: &mut [u8]| returned.push_back((port, frame.to_vec()));
        checked.send(now, port, &mut frame.to_vec(), network, &mut |_, _, _| {}, &mut arrived);
        checked.judge();
        let phases = network.slaves().iter().filter_map(|slave| slave.state().phase());
        *highest = phases.chain(*highest).max_by_key(|phase| phase.0);
        true
    }
}

/// Time that jumps to whatever is due, from an instant on.
fn wait(from: MonotonicTime) -> Wait {
    let mut now = from;
    Box::new(move |until| {
        let latest = now + DurationNs::from_millis(1);
        now = until.map_or(latest, |at| at.clamp(now + DurationNs(1_000), latest));
        now
    })
}

fn names() -> Vec<String> {
    ["x", "y"].map(str::to_owned).to_vec()
}

fn line() -> Shared<Judged> {
    let network = drives([(7, UnitKind::Rotary), (3, UnitKind::Linear)], false);
    let checked = CheckedBus::new(MonotonicTime::ZERO);
    Shared(Rc::new(RefCell::new(Judged { network, checked, returned: VecDeque::new(), highest: None })))
}

/// A session with the drive of this address.
fn open_sercos(line: &Shared<Judged>, address: u16, from: MonotonicTime) -> Result<Session, String> {
    let config = MasterConfig { stable_cycles: 10, ..MasterConfig::new(SIMULATED_MAC, 2_000_000) };
    let line = SercosLine::new(config, Box::new(line.clone()), address).unwrap();
    let catalogue = Catalogue::new(vec![Bus::Sercos, Bus::Sercos], &Mapping::embedded().unwrap());
    Session::open(Box::new(line), wait(from), (names(), 0), catalogue, || true)
}

const BEGIN: MonotonicTime = MonotonicTime(1_000_000_000);

fn ask(session: &mut Session, line: &str) -> String {
    session.ask(line).unwrap_or_else(|why| panic!("{line}: {why}"))
}

#[test]
fn a_drive_takes_in_cp2_what_it_protects_in_operation_and_keeps_it() {
    let line = line();
    let mut session = open_sercos(&line, 7, BEGIN).unwrap();
    let written = ask(&mut session, "write x S-0-0121 5");
    assert!(written.starts_with("ok write x {\"id\":\"S-0-0121\","), "{written}");
    assert!(written.contains("\"value\":\"5\",\"before\":\"1\""), "{written}");
    let ended = session.now;
    drop(session);
    let held = |place: usize| line.0.borrow().network.slaves()[place].store().number_of(Idn::standard(121));
    assert_eq!((held(0), held(1)), (5, 1), "the drive with address 7, and no other");
    assert_eq!(line.0.borrow().highest, Some(Phase::CP2), "never above CP2");
    // Another one, with the same drives.
    let mut session = open_sercos(&line, 7, ended + DurationNs::from_secs(1)).unwrap();
    let read = ask(&mut session, "read x S-0-0121 brief");
    assert!(read.contains("\"value\":\"5\""), "{read}");
    let list = ask(&mut session, "list x backup");
    assert!(list.contains("parameter S-0-0104 name=") && list.ends_with("source=S-0-0192\n"), "{list}");
}

/// One that was found by the scan and goes on the way to CP2 is not waited for.
#[test]
fn a_drive_that_is_lost_before_cp2_is_not_asked() {
    let line = line();
    let config = MasterConfig { stable_cycles: 10, ..MasterConfig::new(SIMULATED_MAC, 2_000_000) };
    let mut master = SercosLine::new(config, Box::new(line.clone()), 3).unwrap();
    let mut wait = wait(BEGIN);
    let mut ended = None;
    for _ in 0..5_000 {
        let now = wait(master.wake_at());
        match master.step(now) {
            Ok(Stage::Starting) => {}
            other => {
                ended = Some(other);
                break;
            }
        }
        if line.0.borrow().highest >= Some(Phase::CP1) {
            line.0.borrow_mut().network.cut(1);
        }
    }
    let why = "no drive has the SERCOS address 3: those on the line have 7".to_owned();
    assert_eq!(ended, Some(Err(why)));
}

#[test]
fn refusals_are_those_of_the_drive_and_of_the_gateway() {
    let line = line();
    let mut session = open_sercos(&line, 3, BEGIN).unwrap();
    for (request, reply) in [
        (
            "write x S-0-0104 0",
            "error write x value: S-0-0104: the drive refuses the operation data with 0x7006: operation data is below the \
             minimum\n",
        ),
        (
            "write x S-0-0134 0xE000",
            "error write x gateway: S-0-0134 is not written: the gateway commands the drive with it\n",
        ),
        (
            "read x 6081h",
            "error read x no-parameter: 6081:00 is a number of CANopen drives: the drive of this axis is another one\n",
        ),
        (
            "command x S-0-0148 start",
            "error command x gateway: S-0-0148 is not executed: the gateway executes it for a controller\n",
        ),
        ("read z S-0-0104", "error read - no-axis: unknown axis `z`: expected x, y\n"),
    ] {
        assert_eq!(ask(&mut session, request), reply, "{request}");
    }
    for (request, why) in [
        ("enable x", "`enable x` needs a gateway that runs"),
        ("read y S-0-0104", "`read y S-0-0104` needs a gateway that runs"),
        (
            "read x notch",
            "`notch` is a name, which needs a gateway that runs: expected a number such as S-0-0100, 6081h or 66.1.504",
        ),
    ] {
        assert_eq!(session.ask(request).unwrap_err(), why);
    }
}

#[test]
fn a_command_of_a_drive_is_executed_in_cp2() {
    let line = line();
    let mut session = open_sercos(&line, 7, BEGIN).unwrap();
    let begun = ask(&mut session, "command x S-0-0264 start");
    assert!(begun.ends_with("\"state\":\"in-process\",\"status\":\"0x0007\"}\n"), "{begun}");
    let done = (0..1_000).map(|_| ask(&mut session, "command x S-0-0264 progress"));
    let done = done.into_iter().find(|reply| !reply.contains("in-process")).unwrap();
    assert!(done.contains("\"state\":\"done\",\"status\":\"0x0003\""), "{done}");
    let cancelled = ask(&mut session, "command x S-0-0264 cancel");
    assert!(cancelled.contains("\"state\":\"not-set\",\"status\":\"0x0000\""), "{cancelled}");
}

#[test]
fn a_drive_that_is_not_there_is_named_with_those_that_are() {
    let why = open_sercos(&line(), 9, BEGIN).err().unwrap();
    assert_eq!(why, "no drive has the SERCOS address 9: those on the line have 7, 3");
}

#[test]
fn a_line_without_drives_ends_with_the_reason() {
    let line = line();
    line.0.borrow_mut().network = drives([], false);
    let why = open_sercos(&line, 9, BEGIN).err().unwrap();
    assert!(why.starts_with("no slave answers"), "{why}");
}

/// A device on CAN, and what was sent to it.
struct Watched {
    bus: InProcessCan<DriveNode>,
    sent: Vec<Frame>,
    /// What another station sends next.
    foreign: Option<Frame>,
    /// What the device answers of its statusword instead of what it has.
    statusword: Option<u8>,
}

impl CanPort for Shared<Watched> {
    fn receive(&mut self, now: MonotonicTime) -> Option<CanInput> {
        let mut watched = self.0.borrow_mut();
        let foreign = watched.foreign.take().map(CanInput::Frame);
        let input = foreign.or_else(|| watched.bus.receive(now))?;
        match (input, watched.statusword) {
            // The answer to an upload of 6041h, two bytes.
            (CanInput::Frame(frame), Some(word)) if frame.data().starts_with(&[0x4B, 0x41, 0x60, 0]) => {
                let data = [0x4B, 0x41, 0x60, 0, word, 0, 0, 0];
                Some(CanInput::Frame(Frame::new(frame.id(), &data).unwrap()))
            }
            (input, _) => Some(input),
        }
    }

    fn send(&mut self, now: MonotonicTime, frame: &Frame) -> CanSent {
        let mut watched = self.0.borrow_mut();
        watched.sent.push(*frame);
        watched.bus.send(now, frame)
    }
}

fn can() -> Shared<Watched> {
    let rate = BitRate::classic(500_000).unwrap();
    let device = drive(NodeId::new(2).ok(), 1).unwrap();
    let bus = InProcessCan::new(wire::Bus::new(rate), vec![device], None);
    Shared(Rc::new(RefCell::new(Watched { bus, sent: Vec::new(), foreign: None, statusword: None })))
}

fn open_can(bus: &Shared<Watched>, node: u8) -> Result<Session, String> {
    let line = CanLine::new(Box::new(bus.clone()), NodeId::new(node).unwrap(), [0]);
    let can = Bus::Can { source: "dictionary", objects: Vec::new() };
    let catalogue = Catalogue::new(vec![can], &Mapping::embedded().unwrap());
    Session::open(Box::new(line), wait(BEGIN), (vec!["x".to_owned()], 0), catalogue, || true)
}

#[test]
fn nothing_but_sdo_is_sent_to_a_canopen_device() {
    let bus = can();
    let mut session = open_can(&bus, 2).unwrap();
    let written = ask(&mut session, "write x 6081h u32:4711");
    assert!(written.ends_with("\"data\":\"67120000\"}\n"), "{written}");
    let read = ask(&mut session, "read x 1008h");
    assert!(read.contains("\"data\":\"4178697362726964676520"), "Axisbridge: {read}");
    let stored = ask(&mut session, "command x 1010:01 start");
    assert!(stored.ends_with("\"state\":\"done\"}\n"), "{stored}");
    assert_eq!(
        ask(&mut session, "write x 6040h 15"),
        "error write x gateway: 6040:00 is not written: the gateway commands the drive with it\n"
    );
    assert_eq!(
        ask(&mut session, "read x 2ABCh"),
        "error read x absent: 2ABC:00: the drive refuses it with 0x06020000: object does not exist\n"
    );
    drop(session);
    let watched = bus.0.borrow();
    let node = NodeId::new(2).unwrap();
    assert!(watched.sent.iter().all(|frame| Function::of(frame.id()) == Some(Function::SdoRequest(node))));
    assert!(watched.sent.len() > 8, "{}", watched.sent.len());
}

#[test]
fn nothing_is_written_to_a_device_that_has_torque() {
    let bus = can();
    let mut session = open_can(&bus, 2).unwrap();
    let before = ask(&mut session, "read x 6081h");
    // 0x27: in operation; the drive is set to it from elsewhere.
    bus.0.borrow_mut().statusword = Some(0x27);
    for request in ["write x 6081h u32:4711", "command x 1010:01 start"] {
        let id = request.split(' ').nth(2).map(|id| id.replace("6081h", "6081:00")).unwrap();
        let word = &request[..request.find(' ').unwrap()];
        let reply =
            format!("error {word} x torque: {id}: parameters are not written while the drive has torque\n");
        assert_eq!(ask(&mut session, request), reply);
    }
    assert_eq!(ask(&mut session, "read x 6081h"), before);
    bus.0.borrow_mut().statusword = Some(0x21);
    assert!(ask(&mut session, "write x 6081h u32:4711").starts_with("ok write x "));
}

#[test]
fn a_device_that_is_not_there_does_not_answer() {
    let mut session = open_can(&can(), 5).unwrap();
    let reply = ask(&mut session, "read x 1000h");
    assert!(reply.starts_with("error read x unanswered: 1000:00: "), "{reply}");
}

#[test]
fn a_bus_of_another_master_is_left_alone() {
    let bus = can();
    let sync = Frame::new(profile_cia402::wire::cob_id::SYNC, &[]).unwrap();
    bus.0.borrow_mut().foreign = Some(sync);
    let why = open_can(&bus, 2).err().unwrap();
    assert!(why.starts_with("another master is on this bus: it sends "), "{why}");
    assert!(bus.0.borrow().sent.is_empty());
    // One that comes later ends it too.
    let mut session = open_can(&bus, 2).unwrap();
    bus.0.borrow_mut().foreign = Some(sync);
    let why = session.ask("read x 1000h").unwrap_err();
    assert!(why.starts_with("another master is on this bus: it sends "), "{why}");
}

#[test]
fn an_interrupted_start_ends_at_once() {
    let line = CanLine::new(Box::new(can()), NodeId::new(2).unwrap(), [0]);
    let catalogue = Catalogue::new(vec![Bus::Sercos], &Mapping::embedded().unwrap());
    let opened = Session::open(Box::new(line), wait(BEGIN), (names(), 0), catalogue, || false);
    assert_eq!(opened.err().unwrap(), "interrupted");
}

/// A network with one simulated drive, and what was sent to it.
struct Network {
    bus: InProcessCan<DevicenetNode>,
    sent: Vec<Frame>,
    /// What another station sends next.
    foreign: Option<Frame>,
    /// What the drive answers of its state instead of what it has.
    state: Option<u8>,
}

impl CanPort for Shared<Network> {
    fn receive(&mut self, now: MonotonicTime) -> Option<CanInput> {
        let mut network = self.0.borrow_mut();
        let foreign = network.foreign.take().map(CanInput::Frame);
        let input = foreign.or_else(|| network.bus.receive(now))?;
        match (input, network.state) {
            // The second fragment of a list with the one attribute 650: status, and the value.
            (CanInput::Frame(frame), Some(state)) if matches!(frame.data(), [_, 0x81, 0, _]) => {
                let mut data = frame.data().to_vec();
                data[3] = state;
                Some(CanInput::Frame(Frame::new(frame.id(), &data).unwrap()))
            }
            (input, _) => Some(input),
        }
    }

    fn send(&mut self, now: MonotonicTime, frame: &Frame) -> CanSent {
        let mut network = self.0.borrow_mut();
        network.sent.push(*frame);
        network.bus.send(now, frame)
    }
}

fn mac(number: u8) -> MacId {
    MacId::new(number).unwrap()
}

fn motion() -> DevicenetKind {
    DevicenetKind::Motion { modes: Vec::new(), resolution: 1_000 }
}

fn network(kind: &DevicenetKind) -> Shared<Network> {
    let mut bus = wire::Bus::new(BitRate::classic(500_000).unwrap());
    for number in 0..64 {
        bus.share(Identifier::DuplicateMacCheck(mac(number)).can());
    }
    let drive = devicenet_drive::node(mac(5), DataRate::Rate500, kind);
    let bus = InProcessCan::new(bus, vec![drive], None);
    Shared(Rc::new(RefCell::new(Network { bus, sent: Vec::new(), foreign: None, state: None })))
}

/// A session of a master with MAC ID 1.
fn open_devicenet(network: &Shared<Network>, number: u8, kind: &DevicenetKind) -> Result<Session, String> {
    open_from(network, number, kind, BEGIN)
}

fn open_from(
    network: &Shared<Network>,
    number: u8,
    kind: &DevicenetKind,
    from: MonotonicTime,
) -> Result<Session, String> {
    let cycle = DurationNs::from_millis(10);
    let mut config = DevicenetMaster::new(mac(1), 0x0539, 7, DataRate::Rate500, cycle);
    config.slaves.push(SlaveConfig::explicit(mac(number)));
    let line = DevicenetLine::new(config, Box::new(network.clone()), mac(number), kind).unwrap();
    let mapping = Mapping::embedded().unwrap();
    let bus = Bus::Devicenet { attributes: attributes(kind, &mapping) };
    let catalogue = Catalogue::new(vec![bus], &mapping);
    Session::open(Box::new(line), wait(from), (vec!["x".to_owned()], 0), catalogue, || true)
}

fn with_drive<T>(network: &Shared<Network>, look: impl FnOnce(&Slave<MotionDrive>) -> T) -> T {
    match network.0.borrow().bus.nodes().next() {
        Some(DevicenetNode::Motion(slave)) => look(slave),
        _ => panic!("a CIP Motion drive"),
    }
}

#[test]
fn only_the_explicit_connection_of_a_devicenet_drive_is_allocated_and_it_is_given_back() {
    let network = network(&motion());
    let mut session = open_devicenet(&network, 5, &motion()).unwrap();
    assert_eq!(with_drive(&network, Slave::master), Some(mac(1)));
    let written = ask(&mut session, "write x 66.1.441 75.5");
    let expected = "ok write x {\"id\":\"66.1.441\",\"name\":\"Kpp\",\"type\":\"f32\",\"unit\":\"Radians/Sec\",\
                    \"access\":\"Set\",\"writable\":\"without torque\",\"value\":\"75.5\",\"before\":\"50\",\"data\":\"00009742\"}\n";
    assert_eq!(written, expected);
    assert!(ask(&mut session, "read x 1.1.7").contains("\"value\":\"simulated drive\""));
    for (request, reply) in [
        ("read x 66.1.610", "error read x absent: 66.1.610: the drive refuses it with status 0x14: "),
        ("write x 66.1.441 1001", "error write x value: 66.1.441: the drive refuses it with status 0x09: "),
        ("write x 66.1.89 1", "error write x gateway: 66.1.89 is not written: the gateway sets it for its "),
    ] {
        let answer = ask(&mut session, request);
        assert!(answer.starts_with(reply), "{request}: {answer}");
    }
    let list = ask(&mut session, "list x backup");
    let line = "parameter 66.1.504 access=Set type=f32 name=Torque Limit - Positive\n";
    assert!(list.contains(line) && list.ends_with("bus=devicenet source=dictionary\n"), "{list}");
    let ended = session.now;
    drop(session);
    // What was sent last arrives.
    network.0.borrow_mut().bus.advance(ended + DurationNs::from_millis(10));
    let value =
        with_drive(&network, |slave| slave.application().device().attribute(0, 441).unwrap().to_vec());
    assert_eq!(value, 75.5_f32.to_le_bytes(), "in the drive");
    assert_eq!(with_drive(&network, Slave::master), None, "given back");
    let allowed = [
        Identifier::DuplicateMacCheck(mac(1)),
        Identifier::UnconnectedRequest(mac(5)),
        Identifier::ExplicitRequest(mac(5)),
    ];
    let is_allowed = |frame: &Frame| allowed.iter().any(|identifier| identifier.can() == frame.id());
    assert!(network.0.borrow().sent.iter().all(is_allowed), "no poll, and nothing to anybody else");
    // The drive has kept it.
    let mut session = open_from(&network, 5, &motion(), ended + DurationNs::from_secs(1)).unwrap();
    assert!(ask(&mut session, "read x 66.1.441 brief").contains("\"value\":\"75.5\""));
}

#[test]
fn nothing_is_written_to_a_devicenet_drive_that_has_torque() {
    let network = network(&motion());
    let mut session = open_devicenet(&network, 5, &motion()).unwrap();
    // Starting, Running, Testing, Stopping, Aborting, and a state that nobody knows.
    for state in [3, 4, 5, 6, 7, 11] {
        network.0.borrow_mut().state = Some(state);
        let reply = "error write x torque: 66.1.441: parameters are not written while the drive has torque\n";
        assert_eq!(ask(&mut session, "write x 66.1.441 9"), reply, "{state}");
    }
    let value =
        with_drive(&network, |slave| slave.application().device().attribute(0, 441).unwrap().to_vec());
    assert_eq!(value, 50.0_f32.to_le_bytes(), "in the drive");
    // Stopped.
    network.0.borrow_mut().state = Some(2);
    assert!(ask(&mut session, "write x 66.1.441 9").starts_with("ok write x "));
}

#[test]
fn a_velocity_drive_is_asked_for_the_state_of_its_supervisor() {
    let kind = DevicenetKind::Speed { assembly: Assembly(21), scale: 0 };
    let network = network(&kind);
    let mut session = open_devicenet(&network, 5, &kind).unwrap();
    let list = ask(&mut session, "list x backup");
    assert!(list.ends_with("ok list x 28 bus=devicenet source=dictionary\n"), "{list}");
    assert!(list.contains("parameter 42.1.18 access=Set type=u16 name=AccelTime\n"), "{list}");
    assert!(ask(&mut session, "read x 0x2A.1.22 brief").starts_with("ok read x "));
    let state = Target::Attribute { class: 0x29, instance: 1, attribute: 6 };
    assert_eq!(session.line.torque_reports(), [state]);
    let torque = |code: u8| session.line.has_torque(&[code]);
    let codes: Vec<u8> = (0..=8).filter(|code| torque(*code)).collect();
    assert_eq!(
        codes,
        [0, 4, 5, 6, 8],
        "vendor specific, enabled, stopping, fault stop, and what nobody knows"
    );
    assert!(session.line.has_torque(&[]) && session.line.has_torque(&[3, 0]));
}

#[test]
fn a_devicenet_drive_of_another_master_is_left_alone() {
    let polled = network(&motion());
    let poll = Frame::new(Identifier::PollCommand(mac(5)).can(), &[]).unwrap();
    polled.0.borrow_mut().foreign = Some(poll);
    let why = open_devicenet(&polled, 5, &motion()).err().unwrap();
    assert!(
        why.starts_with("slave 5: another master polls it") && why.ends_with("; the drive is left alone"),
        "{why}"
    );
    // One that is allocated and not polled refuses.
    let taken = network(&motion());
    let mut session = open_devicenet(&taken, 5, &motion()).unwrap();
    let allocate = Frame::new(Identifier::UnconnectedRequest(mac(5)).can(), &[2, 0x4B, 3, 1, 1, 2]).unwrap();
    assert!(ask(&mut session, "read x 1.1.1").starts_with("ok read x "));
    let ended = session.now;
    drop(session);
    let then = ended + DurationNs::from_millis(100);
    assert_eq!(taken.0.borrow_mut().bus.send(then, &allocate), CanSent::Sent);
    let sent = taken.0.borrow().sent.len();
    let why = open_from(&taken, 5, &motion(), then + DurationNs::from_millis(10)).err().unwrap();
    assert_eq!(why, "another master has the drive with MAC ID 5: it is left alone");
    assert_eq!(with_drive(&taken, Slave::master), Some(mac(2)), "it is still the other one's");
    let releases =
        taken.0.borrow().sent[sent..].iter().filter(|frame| frame.data().get(1) == Some(&0x4C)).count();
    assert_eq!(releases, 0, "nobody gives it back for the other one");
}

#[test]
fn a_devicenet_drive_that_is_not_there_or_whose_mac_id_the_gateway_has_is_named() {
    let why = open_devicenet(&network(&motion()), 7, &motion()).err().unwrap();
    assert_eq!(why, "the drive with MAC ID 7: no answer (allocate)");
    let network = network(&motion());
    let response =
        Frame::new(Identifier::DuplicateMacCheck(mac(1)).can(), &[0x80, 1, 0, 9, 0, 0, 0]).unwrap();
    network.0.borrow_mut().foreign = Some(response);
    let why = open_devicenet(&network, 5, &motion()).err().unwrap();
    assert!(why.contains("MAC ID 1"), "{why}");
    assert_eq!(with_drive(&network, Slave::master), None);
}
