//! The 32-bit run/idle header in front of an update, from format revision 3 on, both ways.
//!
//! No edition that we have describes it for CIP Motion. It is what Wireshark reads there, and the real time header of class 1
//! connections as Volume 1 has it.
//!
//! | octet | content |
//! |---|---|
//! | 0 | bit 0: run; bits 1 to 3 are not looked at |
//! | 1 to 3 | reserved |
//! | 4 | the update, whose Format Revision is that of the connection |

use super::header::{FORMAT_REVISION, FORMAT_REVISION_RUN_IDLE, REVISION_AT};
use crate::wire::{Error, Reader};

/// Octets of the header.
pub const RUN_IDLE_LEN: usize = 4;

const RUN: u32 = 1;

/// Splits an update of a connection with this format revision: whether it runs, and the rest. Below revision 3 there is no header,
/// and data runs.
///
/// # Errors
/// The octets are too few.
pub fn split(revision: u8, data: &[u8]) -> Result<(bool, &[u8]), Error> {
    if revision < FORMAT_REVISION_RUN_IDLE {
        return Ok((true, data));
    }
    let mut reader = Reader::new(data);
    let header = reader.u32("run/idle header")?;
    Ok((header & RUN != 0, reader.rest()))
}

/// The format revision that a recorded update shows: the octets of a run/idle header that are always 0 stand where every update has
/// its Format Revision.
#[must_use]
pub fn revision_of(data: &[u8]) -> u8 {
    match *data {
        [_, 0, 0, 0, _, FORMAT_REVISION_RUN_IDLE, ..] => FORMAT_REVISION_RUN_IDLE,
        _ => FORMAT_REVISION,
    }
}

/// Octets in front of an update of a connection with this format revision.
#[must_use]
pub const fn len(revision: u8) -> usize {
    if revision < FORMAT_REVISION_RUN_IDLE { 0 } else { RUN_IDLE_LEN }
}

/// Makes what was written for this edition an update of a connection with this format revision: `data` begins with the room of
/// [`len`], and the update stands behind it.
pub fn finish(revision: u8, data: &mut [u8]) {
    let len = len(revision);
    if len == 0 {
        return;
    }
    if let Some(header) = data.first_chunk_mut::<RUN_IDLE_LEN>() {
        *header = RUN.to_le_bytes();
    }
    if let Some(place) = data.get_mut(len + REVISION_AT) {
        *place = revision;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_is_there_from_revision_3_on() {
        assert_eq!(split(2, &[6, 2, 9]), Ok((true, &[6, 2, 9][..])));
        assert_eq!(split(3, &[1, 0, 0, 0, 6, 3, 9]), Ok((true, &[6, 3, 9][..])));
        assert_eq!(split(3, &[0x0E, 0, 0, 0, 6]), Ok((false, &[6][..])), "bits 1 to 3 do not run");
        for len in 0..RUN_IDLE_LEN {
            assert!(split(3, &[1, 0, 0, 0][..len]).is_err(), "{len}");
        }
    }

    #[test]
    fn an_update_gets_header_and_revision() {
        let mut data = [0xA5, 0xA5, 0xA5, 0xA5, 7, 2, 9];
        finish(3, &mut data);
        assert_eq!(data, [1, 0, 0, 0, 7, 3, 9]);
        let mut same = [7, 2, 9];
        finish(2, &mut same);
        assert_eq!((same, len(2), len(3)), ([7, 2, 9], 0, 4));
        assert_eq!((revision_of(&data), revision_of(&same), revision_of(&[])), (3, 2, 2));
    }
}
