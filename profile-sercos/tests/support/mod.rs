//! Reads the committed recordings of a foreign master with a line of two slaves.

use std::io::Read;

use flate2::read::GzDecoder;

/// A frame with its time in microseconds.
pub type Timed = (u64, Vec<u8>);

/// The frames of a classic little-endian pcap file, without frame check sequences.
fn frames(file: &[u8], path: &str) -> Vec<Timed> {
    assert_eq!(file[..4], [0xD4, 0xC3, 0xB2, 0xA1], "{path} is not a classic pcap file");
    let word = |at: usize| u32::from_le_bytes([file[at], file[at + 1], file[at + 2], file[at + 3]]);
    let mut frames = Vec::new();
    let mut at = 24;
    while at < file.len() {
        let time = u64::from(word(at)) * 1_000_000 + u64::from(word(at + 4));
        let len = usize::try_from(word(at + 8)).unwrap();
        frames.push((time, file[at + 16..at + 16 + len].to_vec()));
        at += 16 + len;
    }
    frames
}

/// The committed part of the recording.
#[allow(dead_code, reason = "not every test needs it")]
pub fn part() -> Vec<Vec<u8>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/captures/sercos3_startup_line2_part.pcap");
    let file = std::fs::read(path).unwrap_or_else(|error| panic!("{path}: {error}"));
    frames(&file, path).into_iter().map(|(_, frame)| frame).collect()
}

/// The whole recording, or the one that `SERCOS_RECORDING` names.
#[allow(dead_code, reason = "not every test needs it")]
pub fn whole() -> Vec<Timed> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/captures/sercos3_startup_line2.pcap.gz");
    let path = std::env::var("SERCOS_RECORDING").unwrap_or_else(|_| path.to_owned());
    let packed = std::fs::read(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let mut file = Vec::new();
    match packed.starts_with(&[0x1F, 0x8B]) {
        true => drop(GzDecoder::new(&packed[..]).read_to_end(&mut file).unwrap()),
        false => file = packed,
    }
    frames(&file, &path)
}
