//! A slave on its way into a network in CP4, hand-driven through HP0, HP1 and HP2.

#[path = "support/bench.rs"]
#[allow(dead_code, reason = "shared with other tests")]
mod bench;

use bench::Bench;
use profile_generic::servo::ServoParameters;
use profile_generic::time::{DurationNs, MonotonicTime};
use profile_sercos::slave::communication::CLASSES;
use profile_sercos::slave::drive::Drive;
use profile_sercos::slave::phase::{Stage, State};
use profile_sercos::slave::{Config, Network, Slave};
use profile_sercos::wire::device_status::{DeviceStatus, InactivePort};
use profile_sercos::wire::header::{Channel, HEADER_LEN, Header, Kind, Phase, PhaseField, TelegramType};
use profile_sercos::wire::hot_plug::{BROADCAST_ADDRESS, END_ADDRESS, HotPlug};
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::scp::{ScpClass, ScpEntry};
use profile_sercos::wire::svc::{AtSvc, Element, MdtSvc, SvcControl, SvcStatus};

const CYCLE: DurationNs = DurationNs::from_millis(1);
const LEN: usize = 100;
const ADDRESS: u16 = 7;
const WITH_HOT_PLUG: &[ScpEntry] = &[
    ScpEntry { class: ScpClass::VAR_CFG, version: 1 },
    ScpEntry { class: ScpClass::SYNC, version: 1 },
    ScpEntry { class: ScpClass::HOT_PLUG, version: 1 },
];
const ENABLED: u16 = HotPlug::SUPPORTED | HotPlug::ENABLED;

fn slave(address: u16, classes: &'static [ScpEntry]) -> Slave<Drive> {
    let config = Config { address, connections: 2, classes, ..Config::default() };
    Slave::new(&config, Drive::new(ServoParameters::default()).unwrap())
}

/// A slave alone on the wire of a master in CP4.
struct Wire {
    network: Network<Drive>,
    now: MonotonicTime,
    count: u8,
    field: HotPlug,
    svc: MdtSvc,
    /// AT0 as it came back in the last cycle.
    at: Option<Vec<u8>>,
    secondary: bool,
}

impl Wire {
    fn new(address: u16, classes: &'static [ScpEntry]) -> Wire {
        Wire {
            network: Network::line(vec![slave(address, classes)]),
            now: MonotonicTime(1_000_000_000),
            count: 0,
            field: HotPlug { selection: 0, word: HotPlug::SUPPORTED, info: 0 },
            svc: MdtSvc::default(),
            at: None,
            secondary: false,
        }
    }

    fn cycle(&mut self) {
        self.now = self.now + CYCLE;
        self.count = (self.count + 1) & 7;
        self.network.handle_time(self.now);
        let channel = if self.secondary { Channel::Secondary } else { Channel::Primary };
        let port =
            if self.secondary { profile_sercos::port::Port::Two } else { profile_sercos::port::Port::One };
        self.at = None;
        for kind in [Kind::Mdt, Kind::At] {
            let mut frame = vec![0; HEADER_LEN + LEN];
            let telegram = TelegramType::new(channel, kind, 0);
            let phase = PhaseField::new(false, self.count, Phase::CP4);
            Header { source: [2; 6], telegram, phase }.emit(&mut frame).unwrap();
            if kind == Kind::Mdt {
                self.field.emit(&mut frame[HEADER_LEN..]).unwrap();
                self.svc.emit(&mut frame[HEADER_LEN + 14..]).unwrap();
                // C-DEV: Master valid.
                frame[HEADER_LEN + 26 + 1] = 1;
            }
            self.network.send(self.now, port, &mut frame, &mut |_, frame| {
                if kind == Kind::At {
                    self.at = Some(frame[HEADER_LEN..].to_vec());
                }
            });
        }
    }

    fn say(&mut self, selection: u16, word: u16, info: u32) -> Option<HotPlug> {
        self.field = HotPlug { selection, word, info };
        self.cycle();
        self.at.as_ref().map(|at| HotPlug::parse(at).unwrap())
    }

    fn broadcast(&mut self, code: u16, info: u32) {
        self.say(BROADCAST_ADDRESS, ENABLED | code, info);
    }

    /// Every parameter of HP0 but `without`.
    fn parameters(&mut self, without: u16) {
        let len = u32::try_from(LEN).unwrap();
        let all = [(1, 1_000_000), (0x10, len), (0x11, 0), (0x12, 0), (0x13, 0), (0x20, len), (0x21, 0)];
        let rest = [(0x22, 0), (0x23, 0), (2, 100_000), (3, 900_000), (4, 1500), (5, 1)];
        for (code, info) in all.into_iter().chain(rest).filter(|&(code, _)| code != without) {
            self.broadcast(code, info);
        }
    }

    fn state(&self) -> State {
        self.network.slaves()[0].state()
    }

    /// One service channel step.
    fn step(&mut self, element: Element, write: bool, last: bool, info: u32) -> u32 {
        let mhs = !self.svc.control.mhs();
        self.svc = MdtSvc { control: SvcControl::new(mhs, element, write, last), info };
        for _ in 0..20 {
            self.cycle();
            let answer = AtSvc::parse(&self.at.as_ref().expect("it turns telegrams round")[14..]).unwrap();
            if answer.status.contains(SvcStatus::AHS) == mhs && !answer.status.contains(SvcStatus::BUSY) {
                assert!(!answer.status.contains(SvcStatus::ERROR), "{element:?}: {:#x}", answer.info);
                return answer.info;
            }
        }
        panic!("no answer");
    }

    fn write(&mut self, idn: Idn, value: u32) {
        self.step(Element::Idn, true, true, idn.0);
        self.step(Element::Data, true, true, value);
    }

    fn write_list(&mut self, idn: Idn, values: &[u32]) {
        self.step(Element::Idn, true, true, idn.0);
        let len = u32::try_from(4 * values.len()).unwrap();
        self.step(Element::Data, true, false, len);
        for (index, value) in values.iter().enumerate() {
            self.step(Element::Data, true, index + 1 == values.len(), *value);
        }
    }

    fn command(&mut self, idn: Idn) {
        self.write(idn, 3);
        assert_eq!(self.step(Element::Idn, true, true, idn.0) & 0xF, 3, "{idn} is done");
        self.step(Element::Data, true, true, 0);
    }

    fn set_up(&mut self) {
        self.parameters(0);
        self.say(0, ENABLED, 0);
        self.say(ADDRESS, ENABLED | 0x80, 14);
        self.say(ADDRESS, ENABLED | 0x81, 14);
        self.svc.control = SvcControl::new(true, Element::Close, false, false);
        self.say(0, ENABLED | HotPlug::SWITCH_TO_SVC, 0);
        assert_eq!(self.state(), State::Joining(Stage::Setup));
    }

    fn status(&self) -> DeviceStatus {
        let at = self.at.as_ref().expect("an AT");
        DeviceStatus::from_bits_retain(u16::from_le_bytes([at[20], at[21]]))
    }
}

#[test]
fn from_the_cable_to_cp4() {
    for secondary in [false, true] {
        let mut wire = Wire::new(ADDRESS, WITH_HOT_PLUG);
        wire.secondary = secondary;
        if secondary {
            wire.network.cut(0);
            wire.network.mend(1);
        }
        wire.cycle();
        assert_eq!((wire.state(), wire.at.is_some()), (State::Nrt, false), "nothing comes back");
        // HP0: whatever is missing keeps it from answering.
        wire.parameters(0x13);
        assert_eq!((wire.state(), wire.at.is_some()), (State::Nrt, false));
        wire.broadcast(0x13, 0);
        assert_eq!(wire.state(), State::Joining(Stage::Scan));
        assert!(wire.at.is_some(), "the slave in front sees the telegram come back");
        let store = wire.network.slaves()[0].store();
        assert_eq!(store.number_of(Idn::CYCLE_TIME), 1_000_000);
        assert_eq!(store.number_of(Idn::standard(390)), 0xC30A_0031);
        // HP1: the scan, index by index, and the offsets.
        assert_eq!(wire.say(0, ENABLED, 0), Some(HotPlug { selection: ADDRESS, word: 1, info: 0 }));
        let end = HotPlug { selection: 1 << 12 | END_ADDRESS, word: 1, info: 0 };
        assert_eq!(wire.say(1 << 12, ENABLED, 0), Some(end));
        let early = wire.say(0, ENABLED | HotPlug::SWITCH_TO_SVC, 0).unwrap();
        assert_eq!(early.word, HotPlug::ERROR | HotPlug::ERROR_SWITCH);
        let other = wire.say(ADDRESS + 1, ENABLED | 0x80, 14).unwrap();
        assert_eq!(other.word, early.word, "it is not for this slave");
        let beyond = wire.say(ADDRESS, ENABLED | 0x80, 95).unwrap();
        assert_eq!(beyond.word, HotPlug::ERROR | 0x80, "95 + 6 bytes are not in MDT0");
        assert_eq!(wire.say(ADDRESS, ENABLED | 0x80, 14).unwrap().word, 0x80);
        assert_eq!(wire.say(ADDRESS, ENABLED | 0x81, 14).unwrap().word, 0x81);
        wire.svc.control = SvcControl::new(true, Element::Close, false, false);
        wire.say(0, ENABLED | HotPlug::SWITCH_TO_SVC, 0);
        assert_eq!(wire.state(), State::Joining(Stage::Setup));
        // HP2: set up as in CP2 and CP3, while CP4 goes on.
        wire.cycle();
        assert_eq!(wire.status(), DeviceStatus::empty(), "no data of a slave yet");
        for (idn, value) in [
            (Idn::CONTROL_OFFSET, 26),
            (Idn::STATUS_OFFSET, 20),
            (Idn::MST_LOSSES, 10),
            (Idn::standard(32), 2),
        ] {
            wire.write(idn, value);
        }
        wire.write(Idn::connection(0, 1), 0x8000);
        wire.write_list(Idn::connection(0, 6), &[134, 36]);
        wire.write(Idn::connection(0, 3), 0x0800 | 40);
        wire.write(Idn::connection(1, 1), 0xC000);
        wire.write_list(Idn::connection(1, 6), &[135, 40]);
        wire.write(Idn::connection(1, 3), 40);
        wire.command(Idn::CP3_CHECK);
        assert_eq!(wire.state(), State::Joining(Stage::Setup));
        wire.command(Idn::CP4_CHECK);
        wire.cycle();
        assert_eq!(wire.state(), State::In(Phase::CP4));
        assert!(wire.status().contains(DeviceStatus::SLAVE_VALID), "{}", wire.status());
        // Hot plug ends, the slave stays.
        wire.say(0, HotPlug::SUPPORTED, 0);
        wire.cycle();
        assert_eq!(wire.state(), State::In(Phase::CP4));
        let wanted = if secondary { "loopback and forward S" } else { "loopback and forward P" };
        assert_eq!(wire.status().topology().to_string(), wanted);
        assert_eq!(wire.status().inactive_port(), InactivePort::NoLink);
    }
}

#[test]
fn a_slave_without_the_class_or_without_hot_plug_stays_out() {
    let mut wire = Wire::new(ADDRESS, CLASSES);
    wire.parameters(0);
    wire.parameters(0);
    assert_eq!((wire.state(), wire.at.is_some()), (State::Nrt, false));
    // Parameters of an attempt that was given up do not count for the next one.
    let mut wire = Wire::new(ADDRESS, WITH_HOT_PLUG);
    wire.parameters(0x20);
    wire.say(0, HotPlug::SUPPORTED, 0);
    wire.broadcast(0x20, 100);
    assert_eq!(wire.state(), State::Nrt);
    // Impossible values: a cycle time, a telegram that is too long.
    for (code, info) in [(1, 300_001), (0x10, 1495), (0x10, 0)] {
        let mut wire = Wire::new(ADDRESS, WITH_HOT_PLUG);
        wire.parameters(code);
        wire.broadcast(code, info);
        assert_eq!(wire.state(), State::Nrt, "{code:#x} {info}");
    }
}

#[test]
fn a_slave_without_address_says_so() {
    let mut wire = Wire::new(0, WITH_HOT_PLUG);
    wire.parameters(0);
    let answer = wire.say(0, ENABLED, 0).unwrap();
    assert_eq!(answer.word, HotPlug::ERROR | HotPlug::ERROR_NO_ADDRESS);
}

#[test]
fn hot_plug_that_is_given_up_leads_back_to_nrt() {
    // In HP1 and in HP2: hot plug is disabled, or the telegrams stop.
    for stage in [Stage::Scan, Stage::Setup] {
        for silence in [false, true] {
            let mut wire = Wire::new(ADDRESS, WITH_HOT_PLUG);
            match stage {
                Stage::Scan => wire.parameters(0),
                Stage::Setup => wire.set_up(),
            }
            assert_eq!(wire.state(), State::Joining(stage));
            if silence {
                wire.now = wire.now + DurationNs::from_millis(600);
                wire.network.handle_time(wire.now);
            } else {
                wire.say(0, HotPlug::SUPPORTED, 0);
            }
            assert_eq!(wire.state(), State::Nrt);
            wire.cycle();
            assert!(wire.at.is_none(), "it passes telegrams on again");
            assert_eq!(wire.network.slaves()[0].fault(), None);
        }
    }
}

#[test]
fn a_slave_that_joins_can_be_scanned_anew() {
    let mut wire = Wire::new(ADDRESS, WITH_HOT_PLUG);
    wire.set_up();
    let mut bench = Bench::new(1, ServoParameters::default());
    bench.line = wire.network;
    bench.now = wire.now;
    bench.up_to_cp2();
    assert_eq!(bench.line.slaves()[0].state(), State::In(Phase::CP2));
    assert_eq!(bench.line.slaves()[0].topology_address(), 1);
}

#[test]
fn a_slave_plugged_into_a_running_line_is_seen_as_a_link_and_disturbs_nobody() {
    let mut bench = Bench::in_cp4(2);
    bench.line.append(slave(ADDRESS, WITH_HOT_PLUG));
    bench.cycle();
    assert_eq!(bench.feedback[1].device.inactive_port(), InactivePort::NoLink);
    bench.line.mend(2);
    bench.cycles(20);
    assert_eq!(bench.feedback[1].device.inactive_port(), InactivePort::Link);
    assert_eq!(bench.line.slaves()[2].state(), State::Nrt);
    assert!(bench.feedback.iter().all(|feedback| feedback.device.contains(DeviceStatus::SLAVE_VALID)));
}
