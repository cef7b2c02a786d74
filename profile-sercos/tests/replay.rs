//! A foreign master's recorded telegrams are played to a line of two slaves of ours, under the checker. The answers are
//! compared with those of the recorded slaves, a small simulator: which telegrams come back, which bytes of them slaves
//! have written, and what stands there. Every difference is in the snapshot:
//!
//! * S-0-1051: another greatest length.
//! * CP1: ours makes the service channel valid when the master has shown Master valid, the simulator at once.
//! * Attributes: ours have write protection and format, the simulator's only length, list and command.
//! * S-0-0135 bit 3: ours shows that it follows, the simulator never does.
//!
//! Left out of the comparison is S-DEV bit 5: the simulator toggles it with every change of a command, ours
//! sets it when a command has ended and resets it when the command is cancelled. Counters and values in
//! connections are left out as well; that they stand in their places and nowhere else is not.

mod support;

use std::collections::BTreeMap;
use std::fmt::Write;

use profile_generic::servo::ServoParameters;
use profile_generic::time::{DurationNs, MonotonicTime};
use profile_sercos::checker::checked_bus::CheckedBus;
use profile_sercos::port::Port;
use profile_sercos::slave::drive::Drive;
use profile_sercos::slave::phase::State;
use profile_sercos::slave::{Config, Network, Slave};
use profile_sercos::wire::cp12;
use profile_sercos::wire::describe::{DecodeContext, describe};
use profile_sercos::wire::device_status::DeviceStatus;
use profile_sercos::wire::header::{HEADER_LEN, Header, Kind, Phase};
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::layout::DEVICE_WORD_LEN;
use profile_sercos::wire::svc::{AtSvc, SVC_LEN};

/// Cycle of the recording.
const CYCLE: DurationNs = DurationNs::from_millis(10);
/// What is longer than this from cycle to cycle is a pause between phases, in microseconds.
const PAUSE_US: u64 = 100_000;

fn line() -> Network<Drive> {
    let slave = |address: u16| {
        let config = Config { address, connections: 2, serial: u32::from(address), ..Config::default() };
        Slave::new(&config, Drive::new(ServoParameters::default()).unwrap())
    };
    Network::line(vec![slave(1), slave(2)])
}

/// A telegram as it left the master and as it came back.
struct Passage {
    at: u64,
    sent: Vec<u8>,
    returned: Vec<u8>,
}

/// The recording has each frame twice.
fn passages() -> Vec<Passage> {
    let mut passages: Vec<Passage> = Vec::new();
    let mut under_way: Vec<usize> = Vec::new();
    for (at, frame) in support::whole() {
        let back = under_way.iter().position(|&index| passages[index].sent[..16] == frame[..16]);
        match back {
            Some(place) => passages[under_way.remove(place)].returned = frame,
            None => {
                under_way.push(passages.len());
                passages.push(Passage { at, sent: frame, returned: Vec::new() });
            }
        }
    }
    assert!(under_way.is_empty(), "every telegram came back");
    passages
}

/// Where a slave writes in an AT0 of CP1 to CP4.
struct Places {
    svc: usize,
    device: usize,
    /// Offset and length of the connection that it produces.
    connection: Option<(usize, usize)>,
}

/// Places of the slaves in a phase: fixed ones, or those which the master has told them in this recording.
fn places(phase: Phase, context: &DecodeContext<'_>) -> Vec<Places> {
    let fixed = |address| {
        let place = cp12::place(address).unwrap();
        Places { svc: place.svc, device: place.device, connection: None }
    };
    if phase < Phase::CP3 {
        return vec![fixed(1), fixed(2)];
    }
    let told = context.layout().devices.iter().map(|device| {
        let connection = device.connections.iter().find(|connection| connection.kind == Kind::At).unwrap();
        Places {
            svc: usize::from(device.svc_at.unwrap().offset),
            device: usize::from(device.device_status.unwrap().offset),
            connection: Some((usize::from(connection.at.offset), usize::from(connection.len))),
        }
    });
    told.collect()
}

impl Places {
    fn covers(&self, byte: usize) -> bool {
        let within = |at: usize, len: usize| (at..at + len).contains(&byte);
        within(self.svc, SVC_LEN)
            || within(self.device, DEVICE_WORD_LEN)
            || self.connection.is_some_and(|(at, len)| within(at, len))
    }

    /// What the slave answers, as text without what counts up.
    fn answer(&self, data: &[u8]) -> String {
        let word = |at: usize| u16::from_le_bytes([data[at], data[at + 1]]);
        let svc = AtSvc::parse(&data[self.svc..self.svc + SVC_LEN]).unwrap();
        let mut device = DeviceStatus::from_bits_retain(word(self.device));
        device.remove(DeviceStatus::COMMAND_CHANGE);
        let mut text = format!("{svc}, {device}");
        if let Some((at, _)) = self.connection {
            write!(text, ", C-CON {:#06x}, S-0-0135 {:#06x}", word(at) & 1, word(at + 2)).unwrap();
        }
        text
    }
}

/// Compares an AT that came back with the recorded one; gives what the slaves answer otherwise.
fn compare(places: &[Places], number: u8, passage: &Passage, ours: &[u8]) -> Vec<(usize, String, String)> {
    let (theirs, ours) = (&passage.returned[HEADER_LEN..], &ours[HEADER_LEN..]);
    let sent = &passage.sent[HEADER_LEN..];
    for byte in 0..sent.len() {
        let owned = number == 0 && places.iter().any(|place| place.covers(byte));
        assert!(owned || (theirs[byte] == sent[byte] && ours[byte] == sent[byte]), "byte {byte} is nobody's");
    }
    if number > 0 {
        return Vec::new();
    }
    let both = places.iter().map(|place| (place.answer(theirs), place.answer(ours)));
    both.enumerate().filter(|(_, (theirs, ours))| theirs != ours).map(|(n, (t, o))| (n, t, o)).collect()
}

#[test]
fn a_foreign_master_takes_the_line_to_cp4() {
    let mut line = line();
    let mut checked = CheckedBus::new(MonotonicTime::ZERO);
    let mut context = DecodeContext::default();
    let (mut now, mut last) = (MonotonicTime(1_000_000_000), 0);
    let mut differences = Vec::<String>::new();
    // ATs compared and equal to the byte, by phase.
    let mut counts = BTreeMap::<String, (u32, u32)>::new();
    let mut phases = Vec::new();
    for passage in passages() {
        let header = Header::parse(&passage.sent).unwrap();
        if header.telegram.is_mst() {
            let pause = passage.at - last;
            let pause = DurationNs(i64::try_from(pause * 1000).unwrap());
            now = now + if last > 0 && passage.at - last > PAUSE_US { pause } else { CYCLE };
            last = passage.at;
        }
        describe(&passage.sent, &mut context);
        describe(&passage.returned, &mut context);
        let mut frame = passage.sent.clone();
        let mut back = None;
        let mut arrived = |port, frame: &mut [u8]| back = Some((port, frame.to_vec()));
        checked.send(now, Port::One, &mut frame, &mut line, &mut |_, _, _| {}, &mut arrived);
        checked.judge();
        let Some((Port::One, ours)) = back else { panic!("{header} does not come back") };
        assert_eq!(ours[..HEADER_LEN], passage.returned[..HEADER_LEN], "{header}");
        let state = line.slaves()[0].state();
        assert_eq!(line.slaves()[1].state(), state);
        if header.telegram.kind() == Kind::Mdt {
            assert_eq!(ours, passage.sent, "an MDT comes back unchanged");
            assert_eq!(ours, passage.returned);
            if phases.last() != Some(&state) {
                phases.push(state);
            }
            continue;
        }
        let (compared, equal) = counts.entry(state.to_string()).or_default();
        *compared += 1;
        *equal += u32::from(ours == passage.returned);
        let phase = state.phase().unwrap_or(Phase::CP0);
        if phase == Phase::CP0 {
            assert_eq!(ours, passage.returned, "addresses and counter");
            continue;
        }
        let places = places(phase, &context);
        for (slave, theirs, ours) in compare(&places, header.telegram.number(), &passage, &ours) {
            let open = line.slaves()[slave].open_idn();
            let open = open.map_or("nothing open".to_owned(), |idn| idn.to_string());
            let difference = format!("{phase}, {open}\n  recorded {theirs}\n  ours     {ours}\n");
            if !differences.contains(&difference) {
                differences.push(difference);
            }
        }
    }
    let text: Vec<String> = phases.iter().map(State::to_string).collect();
    assert_eq!(
        text.join(" "),
        "CP0 CP0->CP1 CP1 CP1->CP2 CP2 CP2->CP3 CP3 CP3->CP4 CP4",
        "the way up of the recording"
    );
    for (slave, velocity) in line.slaves().iter().zip([1000, 2000]) {
        assert_eq!(slave.fault(), None);
        assert_eq!(slave.store().number_of(Idn::standard(36)), velocity, "command of the recording");
        assert_eq!(slave.store().idns(Idn::INVALID_CP2).count(), 0);
    }
    let counts: String = counts
        .iter()
        .map(|(state, (compared, equal))| format!("{state}: {compared} ATs, {equal} equal to the byte\n"))
        .collect();
    insta::assert_snapshot!(counts + &differences.concat());
}
