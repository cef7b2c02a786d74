//! `axisbridge dictionary` as a user runs it.

use std::io::{BufRead, BufReader};
use std::process::{Command, Output, Stdio};
use std::sync::Arc;

use axisbridge::mapping::{CipAttribute, Dictionaries, Enumeration, Mapping, PolarityEffect, Word};
use serde_json::Value;

fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_axisbridge"));
    command.arg("dictionary").args(arguments);
    command
}

fn run(arguments: &[&str]) -> Output {
    command(arguments).output().expect("the binary can be started")
}

fn printed(arguments: &[&str]) -> Vec<u8> {
    let output = run(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.stderr, b"", "{arguments:?}");
    output.stdout
}

/// The records of the CSV, each as columns and values.
fn records(arguments: &[&str]) -> (Vec<String>, Vec<Record>) {
    let output = printed(arguments);
    let mut reader = csv::Reader::from_reader(output.as_slice());
    let columns: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let row = |record: Result<csv::StringRecord, csv::Error>| Record {
        columns: columns.clone(),
        values: record.unwrap().iter().map(str::to_owned).collect(),
    };
    let records = reader.records().map(row).collect();
    (columns, records)
}

struct Record {
    columns: Vec<String>,
    values: Vec<String>,
}

impl Record {
    fn get(&self, column: &str) -> &str {
        let at = self.columns.iter().position(|known| known == column);
        &self.values[at.unwrap_or_else(|| panic!("no column {column}"))]
    }

    fn number<T: std::str::FromStr>(&self, column: &str) -> Option<T> {
        let text = self.get(column);
        if text.is_empty() { None } else { Some(text.parse().unwrap_or_else(|_| panic!("{column}: {text}"))) }
    }
}

fn dictionaries() -> Arc<Dictionaries> {
    Mapping::embedded().expect("the shipped tables are good").dictionaries
}

#[test]
fn instance_attributes_come_back_from_csv_as_they_are_in_the_dictionary() {
    let (columns, records) = records(&["cip", "--format", "csv"]);
    let first = ["id", "name", "access", "data_type", "units", "B", "E", "F", "P", "V", "T", "source"];
    assert_eq!(columns[..first.len()], first);
    let dictionary = &dictionaries().cip;
    assert_eq!(records.len(), 452);
    assert_eq!(records.len(), dictionary.attributes().len());
    for (record, row) in records.iter().zip(dictionary.attributes()) {
        let polarity = match record.get("polarity") {
            "" => PolarityEffect::None,
            "sign" => PolarityEffect::Sign,
            swap => PolarityEffect::Swap(swap.strip_prefix("swap ").unwrap().parse().unwrap()),
        };
        let text = |column| record.get(column).to_owned();
        let back = CipAttribute {
            id: record.number("id").unwrap(),
            name: text("name"),
            channel: record.number("channel"),
            length: record.number("length"),
            running: record.number("running").unwrap(),
            need: ["B", "E", "F", "P", "V", "T"].map(text).concat(),
            condition: text("condition"),
            unit: text("units"),
            default: record.number("default"),
            min: record.number("min"),
            max: record.number("max"),
            range: text("range"),
            polarity,
            note: text("note"),
            source: text("source"),
            clause: text("clause"),
            group: text("group"),
            data_type: row.data_type,
            access: row.access,
        };
        assert_eq!(back, *row);
        assert_eq!(record.get("data_type"), row.data_type.name());
        assert_eq!(record.get("access"), row.access.name());
    }
}

#[test]
fn every_part_of_every_profile_says_the_same_in_csv_and_json() {
    let parts = [
        ("cip", "instance", 452),
        ("cip", "class", 25),
        ("cip", "enums", codes(&dictionaries())),
        ("cip", "services", 15),
        ("cip", "networks", 20),
        ("cip", "faults", faults(&dictionaries())),
        ("sercos", "idns", 395),
        ("sercos", "communication", 91),
        ("sercos", "bits", sercos_bits(&dictionaries())),
        ("sercos", "codes", sercos_codes(&dictionaries())),
        ("cia402", "objects", cia402_objects(&dictionaries())),
        ("cia402", "codes", cia402_codes(&dictionaries())),
        ("generic", "instance", 20 + dictionaries().generic.parameters().len()),
    ];
    for (profile, part, count) in parts {
        let (columns, records) = records(&[profile, "--format", "csv", "--part", part]);
        assert_eq!(records.len(), count, "{profile} {part}");
        let json = printed(&[profile, "--format", "json", "--part", part]);
        let json: Value =
            serde_json::from_slice(&json).unwrap_or_else(|error| panic!("{profile} {part}: {error}"));
        let objects = json.as_array().expect("an array");
        assert_eq!(objects.len(), count, "{profile} {part}");
        for (record, object) in records.iter().zip(objects) {
            let object = object.as_object().expect("an object");
            assert_eq!(object.len(), columns.len(), "{profile} {part}");
            for column in &columns {
                let value = match &object[column] {
                    Value::Null => String::new(),
                    Value::String(text) => text.clone(),
                    other => other.to_string(),
                };
                assert_eq!(record.get(column), value, "{profile} {part} {column}");
            }
        }
    }
}

fn codes(dictionaries: &Dictionaries) -> usize {
    let sets = dictionaries.cip.enumerations().iter().chain(dictionaries.cip.bit_sets());
    sets.map(rows_of).sum()
}

fn rows_of(set: &Enumeration) -> usize {
    set.codes.len() + set.ranges.len()
}

fn faults(dictionaries: &Dictionaries) -> usize {
    let cip = &dictionaries.cip;
    let set = |name: &str| cip.bits(name).or_else(|| cip.enumeration(name)).expect("a set of conditions");
    cip.fault_records().iter().map(|record| rows_of(set(&record.conditions))).sum()
}

fn sercos_bits(dictionaries: &Dictionaries) -> usize {
    let words = dictionaries.sercos.words().iter();
    let fields = |word: &Word| word.fields.iter().map(|field| 1 + field.values.len()).sum::<usize>();
    words.map(|word| fields(word) + word.patterns.len()).sum()
}

fn sercos_codes(dictionaries: &Dictionaries) -> usize {
    dictionaries.sercos.code_sets().iter().map(|set| set.codes.len() + set.groups.len()).sum()
}

fn cia402_objects(dictionaries: &Dictionaries) -> usize {
    dictionaries.cia402.objects().iter().map(|object| object.subs.len()).sum()
}

fn cia402_codes(dictionaries: &Dictionaries) -> usize {
    let sets = dictionaries.cia402.code_sets().iter();
    sets.map(|set| set.codes.len() + set.ranges.len() + set.classes.len()).sum()
}

/// The whole CiA 402 dictionary as it is printed.
#[test]
fn cia402_reads_as_its_files_say() {
    for part in ["objects", "codes"] {
        let text = String::from_utf8(printed(&["cia402", "--part", part])).unwrap();
        insta::assert_snapshot!(format!("cia402_{part}"), text);
    }
    assert_eq!(printed(&["cia402"]), printed(&["cia402", "--part", "objects"]));
}

/// Without a part there are the IDNs of both lists, by number.
#[test]
fn sercos_prints_every_idn_by_number() {
    let (columns, all) = records(&["sercos"]);
    assert_eq!(columns[..5], ["idn", "name", "length", "list", "format"]);
    let [profile, communication] =
        ["idns", "communication"].map(|part| records(&["sercos", "--part", part]).1);
    assert_eq!((all.len(), profile.len(), communication.len()), (486, 395, 91));
    let mut parts: Vec<&Record> = profile.iter().chain(&communication).collect();
    // `S-0-1050.x.10` comes behind `S-0-1050.x.8`.
    let key = |record: &&Record| {
        let number = record.get("idn").replace('x', "0");
        number.split(['-', '.']).skip(1).map(|part| part.parse::<u16>().unwrap()).collect::<Vec<_>>()
    };
    parts.sort_by_key(key);
    for (record, part) in all.iter().zip(parts) {
        assert_eq!(record.values, part.values);
    }
}

/// The whole SERCOS dictionary as it is printed: what changes in it shows here.
#[test]
fn sercos_reads_as_its_files_say() {
    for part in ["idns", "communication", "bits", "codes"] {
        let text = String::from_utf8(printed(&["sercos", "--part", part])).unwrap();
        insta::assert_snapshot!(format!("sercos_{part}"), text);
    }
}

#[test]
fn rows_read_as_the_standards_print_them() {
    let row = |arguments: &[&str], key: &str, value: &str| {
        let (_, records) = records(arguments);
        let found = records.into_iter().find(|record| record.get(key) == value);
        found.unwrap_or_else(|| panic!("{arguments:?}: no {key} {value}")).values.join("|")
    };
    let snapshot = [
        row(&["cip"], "id", "474"),
        row(&["cip"], "id", "1462"),
        row(&["cip", "--part", "class"], "id", "35"),
        row(&["cip", "--part", "services"], "code", "0x4F"),
        row(&["cip", "--part", "services"], "code", "0x1C"),
        row(&["cip", "--part", "networks"], "class", "0xF0"),
        row(&["cip", "--part", "networks"], "class", "0x48"),
        row(&["cip", "--part", "enums"], "name", "Position Control"),
        row(&["cip", "--part", "enums"], "name", "Motor Overcurrent"),
        row(&["cip", "--part", "faults"], "name", "Motor Overspeed UL"),
        row(&["cip", "--part", "faults"], "set", "Start Inhibits - Mfg"),
        row(&["sercos"], "idn", "S-0-0047"),
        row(&["sercos"], "idn", "S-0-0100"),
        row(&["sercos"], "idn", "S-0-0448"),
        row(&["sercos"], "idn", "S-0-1050.x.6"),
        row(&["sercos", "--part", "bits"], "name", "Drive on"),
        row(&["sercos", "--part", "codes"], "code", "0x7007"),
        row(&["generic"], "name", "torque_limit_positive"),
        row(&["generic"], "name", "stopping_time_limit"),
    ];
    insta::assert_snapshot!(snapshot.join("\n"));
}

#[test]
fn a_part_that_a_profile_lacks_is_a_usage_error() {
    for (arguments, message) in [
        (
            ["sercos", "--part", "class"],
            "error: the sercos dictionary has no part `class`; expected one of: idns, communication, bits, codes\n",
        ),
        (
            ["cip", "--part", "idns"],
            "error: the cip dictionary has no part `idns`; expected one of: instance, class, enums, services, networks, faults\n",
        ),
        (
            ["generic", "--part", "services"],
            "error: the generic dictionary has no part `services`; expected one of: instance\n",
        ),
        (
            ["cia402", "--part", "idns"],
            "error: the cia402 dictionary has no part `idns`; expected one of: objects, codes\n",
        ),
    ] {
        let output = run(&arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert_eq!(String::from_utf8_lossy(&output.stderr), message);
        assert_eq!(output.stdout, b"");
    }
    let strange: [&[&str]; 3] = [&["cip", "--part", "nonsense"], &["canopen"], &["cip", "--format", "xml"]];
    for arguments in strange {
        let output = run(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(String::from_utf8_lossy(&output.stderr).contains("possible values"), "{arguments:?}");
    }
}

#[test]
fn a_folder_replaces_the_tables_and_its_errors_are_told() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("dictionary-mappings");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(folder.join("dictionary")).unwrap();
    let file = folder.join("dictionary/cip-services.toml");
    let shipped = include_str!("../../mappings/tables/dictionary/cip-services.toml");
    std::fs::write(&file, shipped.replace("\"Get_Attribute_Single\"", "\"Get_Single\"")).unwrap();
    let place = folder.to_str().unwrap();
    let (_, records) = records(&["cip", "--part", "services", "--mappings", place]);
    assert_eq!(records[2].get("name"), "Get_Single");

    std::fs::write(&file, shipped.replace("code = 0x0E", "code = 0x8E")).unwrap();
    let output = run(&["cip", "--part", "services", "--mappings", place]);
    assert_eq!(output.status.code(), Some(1));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(
        errors.contains("error[AX0013]: `code`") && errors.contains("expected a code below 0x80, got 0x8e"),
        "{errors}"
    );
    assert!(errors.contains(&format!("{}:", file.display())), "{errors}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_reader_that_closes_early_is_no_error() {
    // More than a pipe holds, so that the writer meets the closed end.
    assert!(printed(&["cip", "--format", "json"]).len() > 100_000);
    let mut child =
        command(&["cip", "--format", "json"]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut head = BufReader::with_capacity(16, child.stdout.take().unwrap());
    let mut line = String::new();
    head.read_line(&mut line).unwrap();
    drop(head);
    let output = child.wait_with_output().unwrap();
    assert_eq!(line, "[\n");
    assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()), (Some(0), ""));
}
