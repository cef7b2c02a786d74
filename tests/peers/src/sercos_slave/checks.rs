//! The checks behind S-0-0127 and S-0-0128: what is invalid goes to S-0-0021 and S-0-0022.
//!
//! Assumptions. What the master has to write counts as invalid until it was written. A data field is 0 or 40 to 1494 bytes;
//! MDT0 and AT0 have to be there. An active consumer may be in an AT (from another slave); a producer has to be in an AT.
//! An active connection with an empty list is invalid. t1 has to be below the cycle time for a slave of class SCP_Sync.

use super::connections;
use super::idn::{Idn, Parameter, Table};
use super::settings::Settings;
use super::telegram::{DATA_MAX, DATA_MIN, Place};

/// What is invalid for CP3.
#[must_use]
pub fn cp3(table: &Table, settings: &Settings) -> Vec<Idn> {
    let mut wrong: Vec<Idn> = Vec::new();
    for block in [1002, 1003, 1009, 1010, 1011, 1012, 1013, 1014] {
        if table.get(Idn::s(block)).is_some_and(|p| !p.valid) {
            wrong.push(Idn::s(block));
        }
    }
    let cycle = table.unsigned(Idn::s(1002));
    let known = matches!(cycle, 31_250 | 62_500 | 125_000) || cycle.is_multiple_of(250_000);
    if !known || cycle == 0 || cycle > 65_000_000 || cycle < settings.shortest_cycle_ns {
        wrong.push(Idn::s(1002));
    }
    for block in [1010, 1012] {
        let lengths = table.words(Idn::s(block));
        let valid = |length: &u16| *length == 0 || (DATA_MIN..=DATA_MAX).contains(&usize::from(*length));
        if lengths.len() != 4 || lengths.first() == Some(&0) || !lengths.iter().all(valid) {
            wrong.push(Idn::s(block));
        }
    }
    let mut used: Vec<(bool, Place, usize)> = Vec::new();
    for (block, mdt, size) in [(1009, true, 2), (1013, true, 6), (1011, false, 2), (1014, false, 6)] {
        let place = Place::from_offset_word(table.word(Idn::s(block)));
        if !fits(table, mdt, place, size) || overlaps(&used, mdt, place, size) {
            wrong.push(Idn::s(block));
        }
        used.push((mdt, place, size));
    }
    for number in (0u32..).take(settings.connections.len().min(255)) {
        connection(table, number, &mut used, &mut wrong);
    }
    let sync = settings.classes.iter().any(|class| class >> 8 == 3);
    if sync && table.unsigned(Idn::s(1006)) >= cycle.max(1) {
        wrong.push(Idn::s(1006));
    }
    wrong.extend(&settings.refuse_cp3);
    wrong.sort_unstable();
    wrong.dedup();
    wrong
}

fn connection(table: &Table, number: u32, used: &mut Vec<(bool, Place, usize)>, wrong: &mut Vec<Idn>) {
    let setup = table.word(Idn::se(1050, number, 1));
    if setup & 0x8000 == 0 {
        return;
    }
    let list = table.idns(Idn::se(1050, number, 6));
    let width = |idn| table.get(idn).map_or(0, Parameter::width);
    let size = usize::from(connections::length(width, &list));
    if list.is_empty() || list.iter().any(|idn| table.get(*idn).is_none()) {
        wrong.push(Idn::se(1050, number, 6));
    }
    let assignment = Idn::se(1050, number, 3);
    let (mdt, place) = Place::from_assignment(table.word(assignment));
    let written = table.get(assignment).is_some_and(|p| p.valid);
    let producer = setup & 0x4000 != 0;
    let displaced = !fits(table, mdt, place, size) || producer && overlaps(used, mdt, place, size);
    if !written || producer && mdt || displaced {
        wrong.push(assignment);
    }
    used.push((mdt, place, size));
}

fn fits(table: &Table, mdt: bool, place: Place, size: usize) -> bool {
    let lengths = table.words(Idn::s(if mdt { 1010 } else { 1012 }));
    let length = lengths.get(usize::from(place.telegram)).map_or(0, |length| usize::from(*length));
    place.offset.is_multiple_of(2) && usize::from(place.offset) + size <= length
}

fn overlaps(used: &[(bool, Place, usize)], mdt: bool, place: Place, size: usize) -> bool {
    let (start, end) = (place.index(), place.index() + size);
    used.iter().any(|(m, p, s)| {
        *m == mdt && p.telegram == place.telegram && start < p.index() + s && p.index() < end
    })
}

/// What is invalid for CP4.
#[must_use]
pub fn cp4(table: &Table, settings: &Settings) -> Vec<Idn> {
    let mut wrong = Vec::new();
    for block in 32..=35 {
        let mode = table.word(Idn::s(block));
        if mode != 0 && !settings.modes.contains(&mode) {
            wrong.push(Idn::s(block));
        }
    }
    if table.get(Idn::s(32)).is_some() && table.word(Idn::s(32)) == 0 {
        wrong.push(Idn::s(32));
    }
    for block in [45, 77, 79, 93, 121, 122, 123, 161] {
        if table.get(Idn::s(block)).is_some() && table.unsigned(Idn::s(block)) == 0 {
            wrong.push(Idn::s(block));
        }
    }
    if table.word(Idn::s(76)) & 0x80 != 0 && table.signed(Idn::s(103)) <= 0 {
        wrong.push(Idn::s(103));
    }
    wrong.extend(&settings.refuse_cp4);
    wrong.sort_unstable();
    wrong.dedup();
    wrong
}

#[cfg(test)]
mod tests {
    use super::super::parameters;
    use super::*;

    /// The set-up of slave 1 in the recording of the foreign master.
    fn recorded(settings: &Settings) -> Table {
        let mut table = parameters::table(settings);
        let fours: [(Idn, u32); 2] = [(Idn::s(1002), 10_000_000), (Idn::s(1006), 31_020)];
        for (idn, value) in fours {
            table.set(idn, &value.to_le_bytes());
        }
        let twos: [(Idn, u16); 9] = [
            (Idn::s(1009), 0x1A),
            (Idn::s(1011), 0x14),
            (Idn::s(1013), 0x0E),
            (Idn::s(1014), 0x08),
            (Idn::s(1003), 10),
            (Idn::se(1050, 0, 1), 0x8000),
            (Idn::se(1050, 1, 1), 0xC000),
            (Idn::se(1050, 0, 3), 0x081E),
            (Idn::se(1050, 1, 3), 0x0018),
        ];
        for (idn, value) in twos {
            table.set(idn, &value.to_le_bytes());
        }
        table.set(Idn::s(1010), &[46, 0, 0, 0, 0, 0, 0, 0]);
        table.set(Idn::s(1012), &[48, 0, 0, 0, 0, 0, 0, 0]);
        table
    }

    #[test]
    fn the_recorded_set_up_is_valid() {
        let settings = Settings::fixcfg();
        assert_eq!(cp3(&recorded(&settings), &settings), []);
    }

    #[test]
    fn what_was_never_written_is_invalid() {
        let settings = Settings::default();
        let wrong = cp3(&parameters::table(&settings), &settings);
        for block in [1002, 1003, 1009, 1010, 1011, 1012, 1013, 1014] {
            assert!(wrong.contains(&Idn::s(block)), "{block}");
        }
    }

    #[test]
    fn each_wrong_offset_is_named() {
        let settings = Settings::fixcfg();
        let cases: [(Idn, u16); 7] = [
            (Idn::s(1009), 45),
            (Idn::s(1009), 0x101A),
            (Idn::s(1011), 47),
            (Idn::s(1013), 41),
            (Idn::s(1014), 0x4008),
            (Idn::se(1050, 0, 3), 0x0827),
            (Idn::se(1050, 1, 3), 0x0818),
        ];
        for (idn, value) in cases {
            let mut table = recorded(&settings);
            table.set(idn, &value.to_le_bytes());
            assert_eq!(cp3(&table, &settings), [idn], "{idn} = {value:x}");
        }
    }

    #[test]
    fn overlapping_fields_and_odd_lengths_are_named() {
        let settings = Settings::fixcfg();
        let mut table = recorded(&settings);
        table.set(Idn::s(1011), &[0x0A, 0]);
        assert_eq!(cp3(&table, &settings), [Idn::s(1014)]);
        let mut table = recorded(&settings);
        table.set(Idn::s(1010), &[46, 0, 39, 0, 0, 0, 0, 0]);
        assert_eq!(cp3(&table, &settings), [Idn::s(1010)]);
        let mut table = recorded(&settings);
        table.set(Idn::s(1002), &300_000u32.to_le_bytes());
        assert_eq!(cp3(&table, &settings), [Idn::s(1002)]);
    }

    #[test]
    fn modes_and_scaling_are_checked_for_cp4() {
        let mut settings = Settings::default();
        assert_eq!(cp4(&parameters::table(&settings), &settings), []);
        settings.selected_modes = [0, 0x13, 1, 0];
        settings.scaling.gear_output = 0;
        settings.refuse_cp4 = vec![Idn::p(7)];
        let wrong = cp4(&parameters::table(&settings), &settings);
        assert_eq!(wrong, [Idn::s(32), Idn::s(33), Idn::s(122), Idn::p(7)]);
    }
}
