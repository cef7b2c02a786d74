//! The way up compared with a foreign master's: the public reference soft master with two slaves at 10 ms.
//!
//! Compared are the service channel steps of each slave with their values, in order, and the pauses and switches
//! between the phases.

use super::peer::SeenStep;
use super::*;
use crate::wire::header::{Header, Kind};
use crate::wire::svc::{Element, MdtSvc};

/// Frames with their time in microseconds.
fn recording() -> Vec<(u64, Vec<u8>)> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/captures/sercos3_startup_line2_part.pcap");
    let file = std::fs::read(path).unwrap();
    let word = |at: usize| u64::from(u32::from_le_bytes(file[at..at + 4].try_into().unwrap()));
    let mut frames = Vec::new();
    let mut at = 24;
    while at < file.len() {
        let len = usize::try_from(word(at + 8)).unwrap();
        frames.push((word(at) * 1_000_000 + word(at + 4), file[at + 16..at + 16 + len].to_vec()));
        at += 16 + len;
    }
    frames
}

/// The steps which the recording's master makes at the slave with this topology address.
fn recorded_steps(topology: usize) -> Vec<SeenStep> {
    let mut steps = Vec::new();
    let (mut mhs, mut idn) = (true, Idn::default());
    for (_, frame) in recording() {
        let header = Header::parse(&frame).unwrap();
        let phase = header.phase.phase();
        let slot = match phase {
            Phase::CP2 => 6 * topology,
            Phase::CP3 => 14 + 6 * (topology - 1),
            _ => continue,
        };
        let mst = header.telegram.kind() == Kind::Mdt && header.telegram.number() == 0;
        if !mst || header.phase.switching() {
            continue;
        }
        let svc = MdtSvc::parse(&frame[HEADER_LEN + slot..]).unwrap();
        if svc.control.mhs() == mhs {
            continue;
        }
        mhs = svc.control.mhs();
        let element = svc.control.element();
        if element == Element::Idn {
            idn = Idn(svc.info);
        }
        let (write, last) = (svc.control.write(), svc.control.last());
        steps.push(SeenStep { phase, idn, element, write, last, info: svc.info });
    }
    steps
}

/// A step as a line. Of what is written only the low word counts: the reference leaves the old upper half in
/// front of values of two bytes, and writes another maximum length into list heads.
fn line(step: &SeenStep) -> String {
    let part = if step.last { "" } else { " part" };
    match (step.element, step.write) {
        (Element::Idn, _) => format!("{} {} open", step.phase, step.idn),
        (Element::Close, _) => format!("{} {} close", step.phase, step.idn),
        (element, false) => format!("{} {} read {element}{part}", step.phase, step.idn),
        (element, true) => {
            format!("{} {} write {element}{part} {:#06x}", step.phase, step.idn, step.info & 0xFFFF)
        }
    }
}

/// Longest common subsequence: lines only in `a` with "-", only in `b` with "+".
fn differences(a: &[String], b: &[String]) -> Vec<String> {
    let mut length = vec![vec![0usize; b.len() + 1]; a.len() + 1];
    for i in (0..a.len()).rev() {
        for j in (0..b.len()).rev() {
            length[i][j] =
                if a[i] == b[j] { length[i + 1][j + 1] + 1 } else { length[i + 1][j].max(length[i][j + 1]) };
        }
    }
    let (mut i, mut j) = (0, 0);
    let mut lines = Vec::new();
    while i < a.len() || j < b.len() {
        if i < a.len() && j < b.len() && a[i] == b[j] {
            i += 1;
            j += 1;
        } else if j >= b.len() || (i < a.len() && length[i + 1][j] >= length[i][j + 1]) {
            lines.push(format!("- {}", a[i]));
            i += 1;
        } else {
            lines.push(format!("+ {}", b[j]));
            j += 1;
        }
    }
    lines
}

/// The same network as in the recording, with an application that does what the recording's does.
fn rig() -> Rig {
    let config = MasterConfig {
        cycle_ns: 10_000_000,
        setup_cycle_ns: 10_000_000,
        stable_cycles: 100,
        ..config(&[1, 2])
    };
    let mut rig = Rig::with(config, &[1, 2]);
    rig.auto_proceed = false;
    rig.master.set_target_phase(Phase::CP4);
    rig.state(State::Await2);
    for slave in [0, 1].map(SlaveId) {
        let mode = super::super::svc::request::SvcData::inline(&2u16.to_le_bytes()).unwrap();
        rig.master.svc_submit(slave, SvcRequest::command(Idn::RESET_C1D)).unwrap();
        rig.master.svc_submit(slave, SvcRequest::write(Idn::standard(32), mode)).unwrap();
    }
    rig.master.proceed().unwrap();
    rig.state(State::Await3);
    for slave in [0, 1].map(SlaveId) {
        rig.master.svc_submit(slave, SvcRequest::read(Idn::FSP_TYPE)).unwrap();
    }
    rig.master.proceed().unwrap();
    rig.state(State::Cp4);
    rig
}

/// What this master does otherwise, with the reason. "-" is in the recording only, "+" here only.
const DIFFERENCES: &[(&str, &[&str])] = &[
    (
        "the application works after the master's own reading, not before it",
        &[
            "- CP2 S-0-0099 open",
            "- CP2 S-0-0099 read attribute",
            "- CP2 S-0-0099 write operation data 0x0003",
            "- CP2 S-0-0099 open",
            "- CP2 S-0-0099 open",
            "- CP2 S-0-0099 write operation data 0x0000",
            "- CP2 S-0-0099 open",
            "- CP2 S-0-0032 open",
            "- CP2 S-0-0032 read attribute",
            "- CP2 S-0-0032 write operation data 0x0002",
        ],
    ),
    (
        "a list is read once into a buffer of known size, not once for its length and once for its items",
        &["- CP2 S-0-1000 close", "- CP2 S-0-1000 open", "- CP2 S-0-1000 read operation data part"],
    ),
    (
        "S-0-1000.0.1 is a list of words by the standard; its attribute is not needed",
        &["- CP2 S-0-1000.0.1 read attribute", "- CP2 S-0-1000.0.1 read attribute"],
    ),
    (
        "the application's commands are cleared before they are set, as S-0-0127 is, and S-0-0099 is known to be one",
        &[
            "+ CP2 S-0-0099 open",
            "+ CP2 S-0-0099 write operation data 0x0000",
            "+ CP2 S-0-0099 open",
            "+ CP2 S-0-0099 write operation data 0x0003",
            "+ CP2 S-0-0099 open",
            "+ CP2 S-0-0099 write operation data 0x0000",
            "+ CP2 S-0-0099 open",
        ],
    ),
    (
        "the application works after the master's own reading, not before it",
        &[
            "+ CP2 S-0-0032 open",
            "+ CP2 S-0-0032 read attribute",
            "+ CP2 S-0-0032 write operation data 0x0002",
        ],
    ),
];

#[test]
fn steps_of_the_reference_master() {
    let rig = rig();
    let expected: Vec<&str> = DIFFERENCES.iter().flat_map(|(_, lines)| lines.iter().copied()).collect();
    for (topology, peer) in (1..).zip(&rig.line.peers) {
        let theirs: Vec<String> = recorded_steps(topology).iter().map(line).collect();
        let ours: Vec<String> = peer.steps.iter().map(line).collect();
        assert_eq!(theirs.len(), 135, "the recording is whole");
        assert_eq!(differences(&theirs, &ours), expected, "slave {topology}");
    }
}

/// Times at which the phase byte, but for the cycle counter, changes: (byte, first) of each stretch.
fn stretches(cycles: impl Iterator<Item = (u64, u8)>) -> Vec<(u8, u64)> {
    let mut list: Vec<(u8, u64)> = cycles.map(|(at, byte)| (byte & 0x8F, at)).collect();
    list.dedup_by_key(|(byte, _)| *byte);
    list
}

#[test]
fn switches_of_the_reference_master() {
    // Of each cycle the first MDT0 counts: the second is the same one coming back.
    let mut last = None;
    let recorded: Vec<(u64, u8)> = recording()
        .into_iter()
        .filter(|(_, frame)| frame[14] == 0x20)
        .map(|(at, frame)| (at, frame[15]))
        .filter(|&(_, byte)| last.replace(byte) != Some(byte))
        .collect();
    let rig = rig();
    let ours: Vec<(u64, u8)> = rig.cycles.iter().map(|&(at, byte)| (at.as_nanos() / 1000, byte)).collect();
    // Announced phase, and milliseconds from the first telegram with CPS to the first of the phase: two cycles,
    // three towards CP4, and 120 ms of silence but for CP4. The committed part of the recording leaves out some
    // cycles in between.
    let switches = |cycles: &[(u64, u8)]| -> Vec<(u8, u64)> {
        let list = stretches(cycles.iter().copied());
        let pairs = list.windows(2).filter(|pair| pair[0].0 & 0x80 != 0);
        pairs.map(|pair| (pair[0].0 & 0xF, (pair[1].1 - pair[0].1 + 500) / 1000)).collect()
    };
    let expected = [(1, 140), (2, 140), (3, 140), (4, 30)];
    assert_eq!(switches(&recorded), expected);
    assert_eq!(switches(&ours), expected);
}
