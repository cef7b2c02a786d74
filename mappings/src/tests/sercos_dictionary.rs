//! The SERCOS dictionary against lists that were made from its sources, and against the wire code of the profile crate.

use std::collections::BTreeSet;

use profile_sercos::wire::attribute::{Attribute, Format};
use profile_sercos::wire::device_control::DeviceControl;
use profile_sercos::wire::device_status::DeviceStatus;
use profile_sercos::wire::scp::ScpClass;
use profile_sercos::wire::svc_error::SvcError;

use super::*;

/// Number, name and clause of every IDN, from the contents of IEC 61800-7-204.
const CONTENTS: &str = include_str!("data/sercos-contents.csv");
/// What drives and their manuals show of IDNs.
const IDN_FACTS: &str = include_str!("data/sercos-idn-facts.csv");
/// What they say about bits; `fact` is what was noted, `name` what the dictionary calls it.
const BIT_FACTS: &str = include_str!("data/sercos-bit-facts.csv");

fn sercos() -> &'static SercosDictionary {
    &shipped().dictionaries.sercos
}

fn idn(number: &str) -> &'static SercosIdn {
    let found = sercos().idns().iter().find(|row| row.number() == number);
    found.unwrap_or_else(|| panic!("no {number}"))
}

/// The records of a CSV file, each by the names of its columns.
fn records(text: &str) -> Vec<Vec<(String, String)>> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let columns: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let record = |row: Result<csv::StringRecord, csv::Error>| {
        columns.iter().cloned().zip(row.unwrap().iter().map(str::to_owned)).collect()
    };
    reader.records().map(record).collect()
}

fn get<'r>(record: &'r [(String, String)], column: &str) -> &'r str {
    let found = record.iter().find(|(known, _)| known == column);
    &found.unwrap_or_else(|| panic!("no column {column}")).1
}

fn keys(text: &str) -> BTreeSet<&str> {
    text.split_whitespace().collect()
}

#[test]
fn has_the_395_idns_of_the_standard_with_their_names_and_clauses() {
    let printed = records(CONTENTS);
    assert_eq!(printed.len(), 395);
    let rows = || sercos().idns().iter().filter(|row| row.part == IdnPart::Profile);
    assert_eq!(rows().count(), 395);
    for (record, row) in printed.iter().zip(rows()) {
        let got = (row.number(), row.name.as_str(), row.clause.as_str());
        assert_eq!(got, (get(record, "idn").to_owned(), get(record, "name"), get(record, "clause")));
    }
    // 12.1 to 12.359, and every one of them.
    let clauses: BTreeSet<u32> = rows().map(|row| row.clause["12.".len()..].parse().unwrap()).collect();
    assert_eq!(clauses, (1..=359).collect());
    let others = sercos().idns().len() - 395;
    assert_eq!(others, 91, "communication");
    assert!(sercos().idns().iter().all(|row| row.part == IdnPart::Profile || row.clause.is_empty()));
}

/// What a row says of a fact that every source agrees on, and what it makes of one about which they do not.
#[test]
fn says_what_the_sources_say_of_each_idn() {
    let facts = records(IDN_FACTS);
    assert_eq!(facts.len(), 421);
    for fact in &facts {
        let column = |name| get(fact, name);
        let number = column("idn");
        let row = idn(number);
        assert_eq!(
            row.length.map_or(String::new(), |length| length.to_string()),
            column("length"),
            "{number}"
        );
        assert_eq!(row.list, !column("list").is_empty(), "{number}");
        assert_eq!(row.format.map_or("", IdnFormat::name), column("format"), "{number}");
        assert!(row.command || column("command").is_empty(), "{number}");
        if !column("decimals").is_empty() {
            assert_eq!(row.decimals, column("decimals").parse().ok(), "{number}");
        }
        let unit = match &row.unit {
            IdnUnit::None => "",
            IdnUnit::Fixed { unit, .. } => unit,
            IdnUnit::Scaled(quantity) => quantity,
        };
        assert_eq!(unit, column("unit"), "{number}");
        assert_eq!(row.write, written(column("write")), "{number}");
        let (at, mdt) = cyclic(column("cyclic"));
        assert_eq!((row.in_at.as_str(), row.in_mdt.as_str()), (at.as_str(), mdt.as_str()), "{number}");
        if number != "S-0-0390" {
            // That of the live drive is of SERCOS II.
            let attribute = row.attribute.map_or(String::new(), |word| format!("0x{word:08X}"));
            assert_eq!(attribute, column("attribute"), "{number}");
        }
        assert!(row.range.contains(&column("max").replace(',', ".")), "{number}: {}", row.range);
        let source = if column("source").is_empty() { "list" } else { column("source") };
        assert_eq!(keys(&row.source), keys(source), "{number}");
        assert_eq!(row.confidence.name(), column("confidence"), "{number}");
        for what in column("conflict").split_whitespace() {
            let told = row.note.contains(&format!("{what}: ")) || number == "S-0-0390";
            assert!(
                told,
                "{number}: {what} differs between sources and the note does not say so: {}",
                row.note
            );
        }
    }
    let unknown = sercos().idns().iter().filter(|row| !row.is_known()).count();
    assert_eq!(unknown, 179);
}

/// The phases in which everybody writes who writes at all: none when nobody writes, `None` when nobody says anything
/// or those who write have no phase in common.
fn written(by_source: &str) -> Option<Vec<u8>> {
    let said: Vec<Vec<u8>> = by_source
        .split("; ")
        .filter_map(|said| said.split_once(':'))
        .map(|(_, said)| said.split('+').filter_map(|phase| phase.strip_prefix("CP")?.parse().ok()).collect())
        .collect();
    let writers = said.iter().filter(|phases| !phases.is_empty());
    let common: Vec<u8> =
        (2..=4).filter(|phase| writers.clone().all(|phases| phases.contains(phase))).collect();
    match writers.count() {
        0 => (!said.is_empty()).then(Vec::new),
        _ => Some(common).filter(|phases| !phases.is_empty()),
    }
}

/// `AT/MDT (R3,M)` as the keys for the AT and for the MDT.
fn cyclic(text: &str) -> (String, String) {
    let Some((telegrams, sources)) = text.strip_suffix(')').and_then(|text| text.split_once(" (")) else {
        return (String::new(), String::new());
    };
    let in_telegram = |telegram| {
        let there = telegrams.split('/').any(|known| known == telegram);
        if there { sources.replace(',', " ") } else { String::new() }
    };
    (in_telegram("AT"), in_telegram("MDT"))
}

#[test]
fn the_test_reads_what_sources_say_as_meant() {
    assert_eq!(written(""), None);
    assert_eq!(written("R1:read-only"), Some(vec![]));
    assert_eq!(written("R1:CP2+CP3; M:read-only; E:CP2"), Some(vec![2]));
    assert_eq!(written("M:read-only; R1:CP4"), Some(vec![4]));
    assert_eq!(written("R3:CP2+CP3; K1:CP4"), None);
    assert_eq!(cyclic("AT/MDT (R3,M)"), ("R3 M".to_owned(), "R3 M".to_owned()));
    assert_eq!(cyclic("MDT (B)"), (String::new(), "B".to_owned()));
}

/// Of IDNs of which nothing is known the dictionary says nothing.
#[test]
fn invents_nothing() {
    for row in sercos().idns().iter().filter(|row| !row.is_known()) {
        let number = row.number();
        assert_eq!(
            (row.length, row.format, row.decimals, row.attribute),
            (None, None, None, None),
            "{number}"
        );
        assert_eq!((row.list, &row.unit, &row.write), (false, &IdnUnit::None, &None), "{number}");
        assert_eq!(row.command, row.name.ends_with("procedure command"), "{number}");
        assert_eq!(row.source, "list", "{number}");
    }
}

#[test]
fn says_what_the_sources_say_of_each_bit() {
    let facts = records(BIT_FACTS);
    assert_eq!(facts.len(), 245);
    for fact in &facts {
        let column = |name| get(fact, name);
        let place = format!("{} {} {}", column("word"), column("bits"), column("value"));
        let value = column("value");
        let number = value
            .strip_prefix("0x")
            .map_or_else(|| value.parse().ok(), |hex| u32::from_str_radix(hex, 16).ok());
        let (name, trust) = match column("kind") {
            "code" | "range" => {
                let set = sercos().codes(column("word")).expect("a set");
                let code = set.codes.iter().find(|code| Some(code.code) == number);
                let group = set.groups.iter().find(|group| Some(group.first) == number);
                let code = code.map(|code| (code.name.as_str(), &code.trust));
                code.or_else(|| group.map(|group| (group.name.as_str(), &group.trust)))
            }
            kind => {
                let word = sercos().word(column("word")).expect("a word");
                assert_eq!(word.layout.name(), column("layout"), "{place}");
                let field = word.fields.iter().find(|field| field.bits() == column("bits"));
                match kind {
                    "pattern" => {
                        let mut patterns = word.patterns.iter().filter(|row| row.bits() == column("bits"));
                        let found = patterns.find(|row| Some(row.value.value) == number);
                        found.map(|row| (row.value.name.as_str(), &row.value.trust))
                    }
                    "value" => {
                        let values = field.into_iter().flat_map(|field| &field.values);
                        let found = values.into_iter().find(|row| Some(row.value) == number);
                        found.map(|row| (row.name.as_str(), &row.trust))
                    }
                    _ => field.map(|field| (field.name.as_deref().unwrap_or_default(), &field.trust)),
                }
            }
        }
        .unwrap_or_else(|| panic!("{place}: not there"));
        assert_eq!(name, column("name"), "{place}");
        assert!(keys(&trust.source).is_superset(&keys(column("source"))), "{place}: {}", trust.source);
        assert_eq!(trust.confidence.name(), column("confidence"), "{place}");
    }
}

/// The parameters that the reference master reads and writes on its way to CP4, by the tables of the facts: number,
/// bytes, list, unit.
#[rustfmt::skip]
const MASTER: &[(&str, u8, bool, &str)] = &[
    ("S-0-1000", 2, true, ""), ("S-0-1000.0.1", 2, true, ""), ("S-0-1002", 4, false, "ns"), ("S-0-1003", 4, false, ""),
    ("S-0-1005", 4, false, "ns"), ("S-0-1006", 4, false, "ns"), ("S-0-1007", 4, false, "ns"),
    ("S-0-1008", 4, false, "ns"), ("S-0-1009", 2, false, ""), ("S-0-1010", 2, true, "bytes"), ("S-0-1011", 2, false, ""),
    ("S-0-1012", 2, true, "bytes"), ("S-0-1013", 2, false, ""), ("S-0-1014", 2, false, ""), ("S-0-1015", 4, false, "ns"),
    ("S-0-1017", 4, true, "ns"), ("S-0-1023", 4, false, "ns"), ("S-0-1027.0.1", 2, false, "bytes"),
    ("S-0-1027.0.2", 2, false, "bytes"), ("S-0-1032", 4, false, ""), ("S-0-1036", 2, false, "bytes"),
    ("S-0-1037", 2, false, "ns"), ("S-0-1047", 4, false, "ns"), ("S-0-1050.x.1", 2, false, ""),
    ("S-0-1050.x.2", 2, false, ""), ("S-0-1050.x.3", 2, false, ""), ("S-0-1050.x.5", 2, false, "bytes"),
    ("S-0-1050.x.6", 4, true, ""), ("S-0-1050.x.10", 4, false, "ns"), ("S-0-1050.x.11", 2, false, ""),
    ("S-0-1051", 2, true, ""), ("S-0-1061", 2, false, ""),
];

/// IDNs of which the sources name no more than what they are for.
#[rustfmt::skip]
const NAMED: &[&str] = &[
    "S-0-0420", "S-0-0422", "S-0-0423", "S-0-0424", "S-0-1016", "S-0-1019", "S-0-1020", "S-0-1021", "S-0-1022",
    "S-0-1024", "S-0-1026", "S-0-1028", "S-0-1035", "S-0-1040", "S-0-1046", "S-0-1050.x.4", "S-0-1050.x.8",
    "S-0-1050.x.12", "S-0-1050.x.20", "S-0-1050.x.21", "S-0-1300.x.1", "S-0-1300.x.2", "S-0-1300.x.3", "S-0-1300.x.4",
    "S-0-1300.x.5", "S-0-1300.x.8", "S-0-1300.x.9", "S-0-1300.x.12", "S-0-1301", "S-0-1302.x.1", "S-0-1302.x.2",
];

#[test]
fn has_the_parameters_of_communication() {
    for (number, length, list, unit) in MASTER {
        let row = idn(number);
        let has = match &row.unit {
            IdnUnit::Fixed { unit, decimals: 0 } => unit.as_str(),
            _ => "",
        };
        assert_eq!((row.length, row.list, has), (Some(*length), *list, *unit), "{number}");
    }
    for number in NAMED {
        assert_eq!((idn(number).length, idn(number).format), (None, None), "{number}");
    }
    // The words of the telegram, and what of SERCOS I and II stands outside the standard's list.
    let others = ["S-0-1044", "S-0-1045"];
    assert_eq!(MASTER.len() + NAMED.len() + others.len() + 26, 91);
    for number in others {
        assert_eq!(idn(number).length, Some(2), "{number}");
    }
}

/// `x` stands for every instance, and rows that have it are found by instance 0.
#[test]
fn rows_of_structures_stand_for_every_instance() {
    let row = idn("S-0-1050.x.6");
    assert_eq!((row.idn, row.every_instance), (Idn::connection(0, 6), true));
    assert_eq!(sercos().idn(Idn::connection(0, 6)), Some(row));
    assert_eq!((idn("S-0-1000.0.1").idn, idn("S-0-1000.0.1").every_instance), (Idn::SCP_ACTIVE, false));
    let numbers: Vec<String> = sercos().idns().iter().map(SercosIdn::number).collect();
    let at = |number: &str| numbers.iter().position(|known| known == number).unwrap();
    assert_eq!(at("S-0-1000.0.1"), at("S-0-1000") + 1);
    assert_eq!(at("S-0-1050.x.10"), at("S-0-1050.x.8") + 1);
    assert!(at("S-0-1601") == numbers.len() - 1 && at("S-0-0001") == 0);
}

/// Both layouts of the drive words, and the mapping takes that of SERCOS III.
#[test]
fn the_drive_words_have_the_layout_of_either_sercos() {
    for (number, name) in [(134, "Drive control"), (135, "Drive status")] {
        let idn = Idn::standard(number);
        assert_eq!(sercos().word_of(idn).unwrap().name, name);
        let layouts: Vec<_> =
            sercos().words().iter().filter(|word| word.idns.contains(&idn)).map(|word| word.layout).collect();
        assert_eq!(layouts, [Layout::Sercos12, Layout::Sercos3]);
    }
    let old = sercos().word("Drive control (SERCOS I/II)").unwrap();
    assert_eq!((old.field("Operation mode"), old.field("Enable drive")), (None, Some((14, 14))), "in pieces");
    let mode = old.fields.iter().find(|field| field.name.as_deref() == Some("Operation mode")).unwrap();
    assert_eq!((mode.bits().as_str(), mode.values.len()), ("11,9,8", 8));
    assert_eq!(sercos().word("Drive control").unwrap().field("Operation mode"), Some((8, 10)));
}

/// Codes and bits that the wire code of the profile crate has too.
#[test]
fn agrees_with_the_wire_code() {
    let codes = |set: &str| -> Vec<(u32, &str)> {
        let set = sercos().codes(set).expect("a set");
        set.codes.iter().map(|code| (code.code, code.name.as_str())).collect()
    };
    let errors: Vec<_> = SvcError::NAMED.iter().map(|(code, name)| (u32::from(code.0), *name)).collect();
    assert_eq!(codes("Service channel error"), errors);
    let classes: Vec<_> = ScpClass::NAMED.iter().map(|(code, name)| (u32::from(code.0), *name)).collect();
    assert_eq!(codes("SCP class"), classes);

    let bit = |word: &str, field: &str| {
        let (low, high) = sercos().word(word).and_then(|word| word.field(field)).expect("a field");
        assert_eq!(low, high, "{word} {field}");
        1_u16 << low
    };
    let control = |field| DeviceControl::from_bits(bit("Device control", field)).expect("a bit");
    assert_eq!(control("Identification"), DeviceControl::IDENTIFICATION);
    assert_eq!(control("Topology change"), DeviceControl::TOPOLOGY_CHANGE);
    assert_eq!(control("Physical ring closed"), DeviceControl::RING_CLOSED);
    assert_eq!(control("Master valid"), DeviceControl::MASTER_VALID);
    let status = |field| DeviceStatus::from_bits(bit("Device status", field)).expect("a bit");
    assert_eq!(status("Communication warning"), DeviceStatus::COMMUNICATION_WARNING);
    assert_eq!(status("Topology change acknowledge"), DeviceStatus::TOPOLOGY_CHANGE);
    assert_eq!(status("Error in a connection"), DeviceStatus::CONNECTION_ERROR);
    assert_eq!(status("Slave valid"), DeviceStatus::SLAVE_VALID);
    assert_eq!(status("Device error (C1D)"), DeviceStatus::DEVICE_ERROR);
    assert_eq!(status("Device warning (C2D)"), DeviceStatus::DEVICE_WARNING);
    assert_eq!(status("Procedure command change"), DeviceStatus::COMMAND_CHANGE);
    assert_eq!(status("Parameterization level active"), DeviceStatus::PARAMETERIZATION);

    // Element 3, by its own description: the word of S-0-0047.
    let word = sercos().word("Attribute").unwrap();
    let part = |name: &str| {
        let (low, high) = word.field(name).unwrap();
        let value = 0x7422_0001_u32 >> low & (u32::MAX >> (31 - (high - low)));
        let field = word.fields.iter().find(|field| field.name.as_deref() == Some(name)).unwrap();
        let named = field.values.iter().find(|known| known.value == value);
        (value, named.map_or("", |known| known.name.as_str()))
    };
    let attribute = Attribute(0x7422_0001);
    assert_eq!(part("Data length"), (2, "4 bytes"));
    assert_eq!(part("Format"), (2, attribute.format().name()));
    assert_eq!(attribute.format(), Format::Signed);
    assert_eq!(part("Decimal point").0, u32::from(attribute.decimals()));
    assert_eq!((part("Function").1, part("Write protected in CP3").0), ("parameter", 1));
}

#[test]
fn has_so_many_words_and_codes() {
    let fields: usize = sercos().words().iter().map(|word| word.fields.len()).sum();
    let codes: usize = sercos().code_sets().iter().map(|set| set.codes.len()).sum();
    let groups: usize = sercos().code_sets().iter().map(|set| set.groups.len()).sum();
    assert_eq!((sercos().words().len(), fields), (60, 278));
    assert_eq!((sercos().code_sets().len(), codes, groups), (11, 180, 7));
    // Every word that holds a scaling type is described.
    for scaling in &sercos().terms().scalings {
        let idn: Idn = scaling.scaling_type.get_ref().parse().unwrap();
        assert!(sercos().word_of(idn).is_some(), "{}", scaling.name);
    }
}
