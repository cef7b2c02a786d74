//! A foreign master's recorded telegrams are played to a line of two slaves of ours. The answers are compared
//! with those of the recorded slaves, a small simulator; every difference is in the snapshot:
//!
//! * S-0-1051: another greatest length.
//! * CP1: ours makes the service channel valid when the master has shown Master valid, the simulator at once.
//! * Attributes: ours have write protection and format, the simulator's only length, list and command.
//! * S-0-0135 bit 3: ours shows that it follows, the simulator never does.
//!
//! Left out of the comparison is S-DEV bit 5: the simulator toggles it with every change of a command, ours
//! sets it when a command has ended and resets it when the command is cancelled. Counters and values in
//! connections are left out as well.

mod support;

use std::fmt::Write;

use profile_generic::servo::ServoParameters;
use profile_generic::time::{DurationNs, MonotonicTime};
use profile_sercos::slave::drive::Drive;
use profile_sercos::slave::phase::State;
use profile_sercos::slave::{Config, Network, Slave};
use profile_sercos::wire::cp12;
use profile_sercos::wire::device_status::DeviceStatus;
use profile_sercos::wire::header::{HEADER_LEN, Header, Kind, Phase};
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::svc::{AtSvc, SVC_LEN};

const CYCLE: DurationNs = DurationNs::from_millis(10);

fn line() -> Network<Drive> {
    let slave = |address: u16| {
        let config = Config { address, connections: 2, serial: u32::from(address), ..Config::default() };
        Slave::new(&config, Drive::new(ServoParameters::default()).unwrap())
    };
    Network::line(vec![slave(1), slave(2)])
}

/// Offsets of the parts of slave 1 and 2 in a recorded AT0 of CP3 and CP4: service channel, S-DEV, connection.
const CYCLIC: [(usize, usize, usize); 2] = [(8, 20, 24), (14, 22, 36)];

/// The recorded AT as it left the master.
fn emptied(frame: &[u8], phase: Phase) -> Vec<u8> {
    let mut sent = frame.to_vec();
    let data = &mut sent[HEADER_LEN..];
    if phase == Phase::CP0 {
        data.fill(0xFF);
        data[..2].copy_from_slice(&[1, 0]);
    } else {
        data.fill(0);
    }
    sent
}

/// What a slave answers in an AT, as text without what counts up.
fn answers(frame: &[u8], phase: Phase) -> [String; 2] {
    let data = &frame[HEADER_LEN..];
    [1u16, 2].map(|address| {
        let index = usize::from(address) - 1;
        let (svc, device, connection) = match phase {
            Phase::CP1 | Phase::CP2 => {
                let place = cp12::place(address).unwrap();
                (place.svc, place.device, None)
            }
            _ => {
                let (svc, device, connection) = CYCLIC[index];
                (svc, device, Some(connection))
            }
        };
        let svc = AtSvc::parse(&data[svc..svc + SVC_LEN]).unwrap();
        let mut device = DeviceStatus::from_bits_retain(u16::from_le_bytes([data[device], data[device + 1]]));
        device.remove(DeviceStatus::COMMAND_CHANGE);
        let mut text = format!("{svc}, {device}");
        if let Some(at) = connection {
            let word = |at: usize| u16::from_le_bytes([data[at], data[at + 1]]);
            write!(text, ", C-CON {:#06x}, S-0-0135 {:#06x}", word(at) & 1, word(at + 2)).unwrap();
        }
        text
    })
}

#[test]
fn a_foreign_master_takes_the_line_to_cp4() {
    let frames = support::recording();
    let mut line = line();
    let mut now = MonotonicTime(1_000_000_000);
    let mut last_mdt = std::collections::BTreeMap::<u8, Vec<u8>>::new();
    let mut differences = Vec::<String>::new();
    let (mut compared, mut equal) = (0, 0);
    let mut phases = Vec::new();
    for (index, recorded) in frames.iter().enumerate() {
        let header = Header::parse(recorded).unwrap();
        let kind = header.telegram.kind();
        if kind == Kind::Mdt {
            // Each frame was recorded on its way out and back.
            if last_mdt.get(&header.telegram.number()) == Some(recorded) {
                continue;
            }
            if header.telegram.is_mst() {
                now = now + CYCLE;
            }
            last_mdt.insert(header.telegram.number(), recorded.clone());
            let mut frame = recorded.clone();
            assert!(line.round_trip(now, &mut frame));
            assert_eq!(&frame, recorded, "an MDT comes back unchanged");
            let state = line.slaves()[0].state();
            assert_eq!(line.slaves()[1].state(), state);
            if phases.last() != Some(&state) {
                phases.push(state);
            }
            continue;
        }
        let phase = line.slaves()[0].state().phase().unwrap_or(Phase::CP0);
        let sent = emptied(recorded, phase);
        let switching = header.phase.switching();
        // Sent telegrams are in the recording as well; in a switch up to CP3 the slaves leave them empty.
        if &sent == recorded && !(switching && phase <= Phase::CP2) {
            continue;
        }
        let mut frame = sent;
        assert!(line.round_trip(now, &mut frame));
        compared += 1;
        if &frame == recorded {
            equal += 1;
            continue;
        }
        assert_ne!(phase, Phase::CP0, "frame {}: addresses and counter", index + 1);
        assert_eq!(frame[..HEADER_LEN], recorded[..HEADER_LEN]);
        let both = answers(recorded, phase).into_iter().zip(answers(&frame, phase));
        for (slave, (theirs, ours)) in line.slaves().iter().zip(both) {
            let open = slave.open_idn().map_or("nothing open".to_owned(), |idn| idn.to_string());
            let difference = format!("{phase}, {open}\n  recorded {theirs}\n  ours     {ours}\n");
            if theirs != ours && !differences.contains(&difference) {
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
    insta::assert_snapshot!(format!(
        "{compared} ATs compared, {equal} equal to the byte\n{}",
        differences.concat()
    ));
}
