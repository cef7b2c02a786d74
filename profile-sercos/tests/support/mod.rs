//! Reads the committed recording.

/// The frames of a classic little-endian pcap file, without frame check sequences.
pub fn read_pcap(path: &str) -> Vec<Vec<u8>> {
    let file = std::fs::read(path).unwrap_or_else(|error| panic!("{path}: {error}"));
    assert_eq!(file[..4], [0xD4, 0xC3, 0xB2, 0xA1], "{path} is not a classic pcap file");
    let mut frames = Vec::new();
    let mut at = 24;
    while at < file.len() {
        let len = u32::from_le_bytes([file[at + 8], file[at + 9], file[at + 10], file[at + 11]]);
        let len = usize::try_from(len).unwrap();
        frames.push(file[at + 16..at + 16 + len].to_vec());
        at += 16 + len;
    }
    frames
}

/// The committed part of the recording of a foreign master with a line of two slaves, or the recording that
/// `SERCOS_RECORDING` names.
pub fn recording() -> Vec<Vec<u8>> {
    let default = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/captures/sercos3_startup_line2_part.pcap");
    read_pcap(&std::env::var("SERCOS_RECORDING").unwrap_or_else(|_| default.to_owned()))
}
