//! `[recording]`.

use super::{Problems, value};
use crate::config::RollingRecording;
use crate::config::file::RecordingTable;

/// Seconds of a recording, unless configured.
const SECONDS: u32 = 10;

/// Bytes of memory, unless configured.
const MEMORY: usize = 16_000_000;

/// Bytes that memory can have: some tenths of a second of two buses, and what a host has to spare.
const MEMORY_RANGE: std::ops::RangeInclusive<usize> = 2_000_000..=1_000_000_000;

pub(super) fn check(
    problems: &mut Problems,
    table: Option<&RecordingTable>,
) -> Option<Option<RollingRecording>> {
    let usual = RecordingTable::default();
    let RecordingTable { seconds, memory } = table.unwrap_or(&usual);
    let seconds = value::number_or(problems, seconds, "the length of the recording", 0..=600, SECONDS);
    let memory = match memory {
        None => Some(MEMORY),
        Some(text) => value::size(problems, text, "the memory of the recording", MEMORY_RANGE),
    };
    let (seconds, memory) = (seconds?, memory?);
    Some((seconds > 0).then_some(RollingRecording { seconds, memory }))
}

#[cfg(test)]
mod tests {
    use super::super::checked;
    use super::*;

    fn of(text: &str) -> Result<Option<RollingRecording>, Vec<String>> {
        checked(text, |problems: &mut Problems, table: &RecordingTable| check(problems, Some(table)))
    }

    #[test]
    fn ten_seconds_in_sixteen_megabytes_unless_configured_and_zero_is_off() {
        let usual = RollingRecording { seconds: 10, memory: 16_000_000 };
        assert_eq!(of(""), Ok(Some(usual)));
        let own = RollingRecording { seconds: 600, memory: 1_000_000_000 };
        assert_eq!(of("seconds = 600\nmemory = \"1 GB\""), Ok(Some(own)));
        assert_eq!(of("seconds = 0"), Ok(None));
    }

    #[test]
    fn what_is_out_of_range_is_said() {
        let both = ["the length of the recording is 601", "the memory of the recording is `1999 kB`"];
        assert_eq!(of("seconds = 601\nmemory = \"1999 kB\""), Err(both.map(str::to_owned).to_vec()));
        assert_eq!(of("memory = \"16\""), Err(vec!["`16` is not a size".to_owned()]));
    }
}
