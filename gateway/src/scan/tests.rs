//! Scans of simulated drives in virtual time, under the checker.

use std::collections::VecDeque;

use profile_generic::scaling::UnitKind;
use profile_generic::time::MonotonicTime;
use profile_sercos::checker::checked_bus::CheckedBus;
use profile_sercos::master::config::MasterConfig;
use profile_sercos::master::event::Port;

use super::*;
use crate::config::{AxisKind, Config, DriveAt, Link};
use crate::mapping::Mapping;
use crate::simulate::drives::{DriveNetwork, SIMULATED_MAC, drives};

const NOBODY: &str =
    "no slave answers; with the link up: a station passes no telegrams on, or it is no SERCOS III slave";

fn config() -> MasterConfig {
    MasterConfig { stable_cycles: 10, ..MasterConfig::new(SIMULATED_MAC, 2_000_000) }
}

fn wire() -> Link {
    Link::Interface { name: "enp3s0".to_owned(), ring: None }
}

#[test]
fn names_are_utf_8_or_latin_1_without_what_is_no_letter() {
    let cases: [(&[u8], Option<&str>); 6] = [
        (b" IndraDrive\0", Some("IndraDrive")),
        ("Gerät".as_bytes(), Some("Gerät")),
        (b"Ger\xE4t \xB5", Some("Gerät µ")),
        (b"\x00\x85\xFF", Some("ÿ")),
        (b"", None),
        (b" \r\n", None),
    ];
    for (bytes, expected) in cases {
        assert_eq!(readable(bytes).as_deref(), expected, "{bytes:?}");
    }
}

/// Drives with these addresses in a line, with the checker.
struct Judged {
    network: DriveNetwork,
    checked: CheckedBus,
    returned: VecDeque<(Port, Vec<u8>)>,
}

impl Judged {
    fn line(slaves: impl IntoIterator<Item = (u16, UnitKind)>) -> Self {
        let (network, checked) = (drives(slaves, false), CheckedBus::new(MonotonicTime::ZERO));
        Self { network, checked, returned: VecDeque::new() }
    }
}

impl EthernetPort for Judged {
    fn receive(&mut self, buffer: &mut [u8]) -> Option<(Port, usize)> {
        let (port, frame) = self.returned.pop_front()?;
        buffer[..frame.len()].copy_from_slice(&frame);
        Some((port, frame.len()))
    }

    fn send(&mut self, now: MonotonicTime, port: Port, frame: &[u8]) -> bool {
        self.network.handle_time(now);
        let mut arrived = |port, frame: &mut [u8]| self.returned.push_back((port, frame.to_vec()));
        let frame = &mut frame.to_vec();
        self.checked.send(now, port, frame, &mut self.network, &mut |_, _, _| {}, &mut arrived);
        self.checked.judge();
        true
    }
}

fn scan_of(south: &mut dyn EthernetPort) -> Bus {
    let mut scanner = Scanner::new(config()).unwrap();
    let mut now = MonotonicTime::ZERO;
    for _ in 0..100_000 {
        if scanner.step(now, south) {
            return scanner.finish();
        }
        now = now.max(scanner.wake_at().unwrap_or(now));
    }
    panic!("the scan does not end");
}

fn scan(slaves: impl IntoIterator<Item = (u16, UnitKind)>) -> Bus {
    scan_of(&mut Judged::line(slaves))
}

#[test]
fn two_drives_tell_who_they_are() {
    let bus = scan([(7, UnitKind::Rotary), (3, UnitKind::Linear)]);
    let mapping = Mapping::embedded().unwrap();
    insta::assert_snapshot!("two_drives_text", text(&bus, &mapping.dictionaries.sercos));
    insta::assert_snapshot!("two_drives_json", format!("{:#}", json(&bus, &mapping.dictionaries.sercos)));
}

#[test]
fn the_starter_is_a_configuration_of_the_drives_that_were_found() {
    let bus = scan([(7, UnitKind::Rotary), (3, UnitKind::Linear)]);
    let starter = starter(&bus, &wire()).unwrap();
    insta::assert_snapshot!("two_drives_starter", starter);
    let config = Config::parse(&starter, "starter.toml").unwrap_or_else(|error| panic!("{error}"));
    let addresses: Vec<_> =
        config.sercos.as_ref().unwrap().drives.iter().map(|drive| drive.address).collect();
    let kinds: Vec<_> = config.axes.iter().map(|axis| (axis.instance, axis.drive, axis.kind)).collect();
    assert_eq!(addresses, [7, 3]);
    assert_eq!(
        kinds,
        [
            (1, DriveAt::Sercos { drive: 0 }, AxisKind::Rotary),
            (2, DriveAt::Sercos { drive: 1 }, AxisKind::Linear)
        ]
    );
}

/// The axes of each device and the instance of its last axis.
fn devices(config: &Config) -> Vec<(usize, u8)> {
    let last = |device| config.axes_of(device).map(|(_, axis)| axis.instance).max().unwrap_or(0);
    (0..config.devices.len()).map(|device| (config.axes_of(device).count(), last(device))).collect()
}

#[test]
fn more_drives_than_a_device_has_axes_get_further_devices_up_to_what_a_box_has() {
    for (drives, expected) in
        [(16, vec![(16, 16)]), (17, vec![(16, 16), (1, 1)]), (64, vec![(16, 16); 4]), (65, vec![(16, 16); 4])]
    {
        let bus = scan((1..=drives).map(|address| (address, UnitKind::Rotary)));
        let text = starter(&bus, &wire()).unwrap();
        let config = Config::parse(&text, "starter.toml").unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(devices(&config), expected, "{drives} drives");
    }
}

#[test]
fn the_same_address_twice_is_told_and_gets_no_axis() {
    let bus = scan([(7, UnitKind::Rotary), (5, UnitKind::Rotary), (7, UnitKind::Rotary)]);
    assert_eq!(bus.findings, ["slave at position 1 and slave at position 3 both have address 7"]);
    assert_eq!(bus.slaves.len(), 3);
    let config = Config::parse(&starter(&bus, &wire()).unwrap(), "starter.toml").unwrap();
    assert_eq!(
        config.sercos.as_ref().unwrap().drives.iter().map(|drive| drive.address).collect::<Vec<_>>(),
        [5]
    );
    assert_eq!(starter(&scan([(0, UnitKind::Rotary)]), &wire()), None);
}

#[test]
fn more_slaves_than_two_telegrams_hold_are_scanned_again_with_four() {
    let bus = scan((1..=260).map(|address| (address, UnitKind::Rotary)));
    assert_eq!((bus.slaves.len(), bus.findings.as_slice()), (260, [].as_slice()));
    assert!(bus.slaves.iter().all(|slave| slave.text(Idn::DEVICE_ID).is_some()));
}

/// A port from which nothing comes back.
struct Nobody;

impl EthernetPort for Nobody {
    fn receive(&mut self, _: &mut [u8]) -> Option<(Port, usize)> {
        None
    }

    fn send(&mut self, _: MonotonicTime, _: Port, _: &[u8]) -> bool {
        true
    }
}

#[test]
fn an_empty_bus_is_told() {
    let bus = scan_of(&mut Nobody);
    assert_eq!(bus.findings, [NOBODY]);
    assert!(bus.slaves.is_empty());
    let mapping = Mapping::embedded().unwrap();
    assert_eq!(text(&bus, &mapping.dictionaries.sercos), format!("0 slaves\n! {NOBODY}\n"));
}

#[test]
fn a_scan_that_is_given_up_takes_the_line_down() {
    let mut south = Judged::line([(7, UnitKind::Rotary)]);
    let mut scanner = Scanner::new(config()).unwrap();
    let mut now = MonotonicTime::ZERO;
    while scanner.stage != Stage::Asking {
        scanner.step(now, &mut south);
        now = now.max(scanner.wake_at().unwrap_or(now));
    }
    scanner.give_up("interrupted");
    while !scanner.step(now, &mut south) {
        now = now.max(scanner.wake_at().unwrap_or(now));
    }
    let bus = scanner.finish();
    assert_eq!((bus.slaves.len(), bus.findings), (1, vec!["interrupted".to_owned()]));
}

/// A wire on which another master sends.
struct Occupied {
    sent: usize,
    turn: bool,
}

impl EthernetPort for Occupied {
    fn receive(&mut self, buffer: &mut [u8]) -> Option<(Port, usize)> {
        use profile_sercos::wire::header::{Channel, Header, Kind, Phase, PhaseField, TelegramType};
        self.turn = !self.turn;
        let telegram = TelegramType::new(Channel::Primary, Kind::Mdt, 0);
        let header = Header { source: [2; 6], telegram, phase: PhaseField::new(false, 0, Phase::CP4) };
        header.emit(&mut buffer[..60]).unwrap();
        self.turn.then_some((Port::One, 60))
    }

    fn send(&mut self, _now: MonotonicTime, _port: Port, _frame: &[u8]) -> bool {
        self.sent += 1;
        true
    }
}

#[test]
fn a_wire_that_another_master_uses_is_left_alone() {
    let mut south = Occupied { sent: 0, turn: false };
    let mut scanner = Scanner::new(config()).unwrap();
    let mut now = MonotonicTime::ZERO;
    while !scanner.step(now, &mut south) {
        assert!(now < MonotonicTime(1_000_000_000), "the scan does not end");
        now = now + profile_generic::time::DurationNs::from_millis(2);
    }
    let bus = scanner.finish();
    assert_eq!((south.sent, bus.slaves.len()), (0, 0));
    let text = "another master sends on this wire: CP4 from 02:02:02:02:02:02, a cycle of about 2000 us, heard on port 1";
    assert_eq!(bus.findings, [text]);
}
