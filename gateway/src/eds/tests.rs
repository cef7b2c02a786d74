//! A reader of sheets of its own: what the writer writes has to come back, and has to say what the adapter does.

use std::collections::BTreeMap;

use profile_cip::device::config::MOTION_SIZE_MAX;
use profile_cip::device::motion_open;

use super::*;
use crate::config::Config;
use crate::engine::build::{Host, adapter_config};

const EXAMPLE: &str = include_str!("../../../examples/two-axes-in-process.toml");

/// Sections in their order, each with its entries, each with its fields as they are written.
type Sheet = Vec<(String, BTreeMap<String, Vec<String>>)>;

fn adapter(configuration: &str) -> AdapterConfig {
    let config = Config::parse(configuration, "test.toml").unwrap();
    adapter_config(&config, 0, Host { mac: [2; 6], incarnation: 9 }).unwrap()
}

/// Reads a sheet; panics on whatever is not in its form.
fn read(bytes: &[u8]) -> Sheet {
    let text = std::str::from_utf8(bytes).unwrap();
    assert!(text.is_ascii() && text.ends_with("\r\n"));
    assert_eq!(text.matches('\n').count(), text.matches("\r\n").count());
    let mut sheet = Sheet::new();
    let mut statement = String::new();
    for line in text.lines() {
        assert!(line.len() < 256, "{line}");
        let line = line.trim();
        if line.is_empty() || line.starts_with('$') {
            continue;
        }
        if let Some(name) = line.strip_prefix('[') {
            assert_eq!(statement, "", "an entry that is not ended");
            let name = name.strip_suffix(']').unwrap().to_owned();
            assert!(sheet.iter().all(|(known, _)| *known != name), "section {name} is defined twice");
            sheet.push((name, BTreeMap::new()));
            continue;
        }
        statement.push_str(line);
        let Some(entry) = statement.strip_suffix(';') else { continue };
        let (keyword, fields) = entry.split_once('=').unwrap();
        let section = &mut sheet.last_mut().unwrap().1;
        let before = section.insert(keyword.trim().to_owned(), split(fields));
        assert_eq!(before, None, "{keyword} is defined twice");
        statement.clear();
    }
    sheet
}

/// Fields between commas; those in quotation marks are not looked into.
fn split(text: &str) -> Vec<String> {
    let (mut fields, mut field, mut quoted, mut escaped) = (Vec::new(), String::new(), false, false);
    for c in text.chars() {
        match c {
            '"' if !escaped => quoted = !quoted,
            ',' if !quoted => {
                fields.push(field.trim().to_owned());
                field.clear();
                continue;
            }
            _ => {}
        }
        escaped = quoted && c == '\\' && !escaped;
        field.push(c);
    }
    assert!(!quoted, "a quotation mark that is not closed: {text}");
    fields.push(field.trim().to_owned());
    fields
}

fn number(field: &str) -> u32 {
    match field.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16).unwrap(),
        None => field.parse().unwrap(),
    }
}

fn unquoted(field: &str) -> &str {
    field.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).unwrap()
}

struct Reader(Sheet);

impl Reader {
    fn of(adapter: &AdapterConfig) -> Self {
        Self(read(&adapter.eds))
    }

    fn section(&self, name: &str) -> &BTreeMap<String, Vec<String>> {
        let found = self.0.iter().find(|(known, _)| known == name);
        &found.unwrap_or_else(|| panic!("no section {name}")).1
    }

    fn fields(&self, section: &str, keyword: &str) -> &[String] {
        self.section(section).get(keyword).unwrap_or_else(|| panic!("no {keyword} in {section}"))
    }

    fn one(&self, section: &str, keyword: &str) -> &str {
        let [field] = self.fields(section, keyword) else { panic!("{keyword} has several fields") };
        field
    }

    /// Least, greatest and proposed value of the parameter that a field names.
    fn range(&self, reference: &str) -> [u32; 3] {
        let fields = self.fields("Params", reference);
        assert_eq!(fields.len(), 21, "{reference}");
        assert_eq!(&fields[..3], ["0", "", ""]);
        let bytes = match number(&fields[4]) {
            0xC7 => 2,
            0xC8 => 4,
            other => panic!("data type {other:#x}"),
        };
        assert_eq!(number(&fields[5]), bytes);
        assert!(fields[12..].iter().all(String::is_empty));
        let [least, most, proposed] = [9, 10, 11].map(|at| number(&fields[at]));
        assert!((least..=most).contains(&proposed));
        [least, most, proposed]
    }
}

#[test]
fn the_sheet_of_the_example() {
    insta::assert_snapshot!(String::from_utf8(adapter(EXAMPLE).eds.to_vec()).unwrap().replace("\r\n", "\n"));
}

#[test]
fn the_sheet_says_what_the_adapter_does() {
    let adapter = adapter(EXAMPLE);
    let sheet = Reader::of(&adapter);
    assert!(adapter.validate().is_ok());
    let sections: Vec<_> = sheet.0.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(
        sections,
        [
            "File",
            "Device",
            "Device Classification",
            "Params",
            "Identity Class",
            "Message Router Class",
            "Connection Manager",
            "File Class",
            "Time Sync Class",
            "QoS Class",
            "TCP/IP Interface Class",
            "Ethernet Link Class",
            "Capacity",
        ]
    );
    assert_eq!(sheet.one("Device Classification", "Class1"), "EtherNetIP");
    for (keyword, value) in [
        ("VendCode", u32::from(adapter.identity.vendor)),
        ("ProdType", 37),
        ("ProdCode", u32::from(adapter.identity.product_code)),
        ("MajRev", u32::from(adapter.identity.major)),
        ("MinRev", u32::from(adapter.identity.minor)),
    ] {
        assert_eq!(number(sheet.one("Device", keyword)), value, "{keyword}");
    }
    assert_eq!(unquoted(sheet.one("Device", "ProdName")), adapter.identity.product_name.as_str());
    assert_eq!(unquoted(sheet.one("Device", "VendName")), "Vendor 65535");

    let connection = sheet.fields("Connection Manager", "Connection1");
    assert_eq!(connection.len(), 15);
    // Class 1, cyclic, exclusive owner; variable, point to point and scheduled in both directions, no header.
    assert_eq!((number(&connection[0]), number(&connection[1])), (0x0401_0002, 0x4444_000A));
    let motion = &adapter.motion;
    for (at, least, most) in [
        (2, motion.rpi_min_us, motion.rpi_max_us),
        (3, 8, u32::from(motion.o_to_t_size_max) - 2),
        (5, motion.rpi_min_us, motion.rpi_max_us),
        (6, 8, u32::from(motion.t_to_o_size_max) - 2),
    ] {
        let [low, high, _] = sheet.range(&connection[at]);
        assert_eq!((low, high), (least, most), "field {at}");
    }
    let [.., proposed] = sheet.range(&connection[2]);
    assert_eq!(motion.acceptable_rpi_us(proposed), proposed, "the proposed interval is one the device takes");
    for at in [4, 7, 8, 9, 10, 11] {
        assert_eq!(connection[at], "");
    }
    let path: Vec<u8> =
        unquoted(&connection[14]).split(' ').map(|octet| u8::from_str_radix(octet, 16).unwrap()).collect();
    assert_eq!(
        path,
        motion_open::application_path(motion),
        "a test of the adapter opens a connection with it"
    );
    assert_eq!(path[..8], [0x20, 0x42, 0x2C, 0x51, 0x2C, 0x02, 0x80, 0x04]);

    for class in OBJECT_CLASSES {
        let Some(instance) = class.instance else { continue };
        let name = section(&class);
        assert_eq!(number(sheet.one(&name, "Object_Class_Code")), u32::from(class.class));
        assert_eq!(number(sheet.one(&name, "Revision")), u32::from(class.revision));
        assert_eq!(number(sheet.one(&name, "MaxInst")), u32::from(instance));
        assert_eq!(unquoted(sheet.one(&name, "Object_Name")), class.name);
    }
    let of = |keyword| number(sheet.one("Capacity", keyword));
    assert_eq!((of("MaxCIPConnections"), of("MaxIOConnections"), of("MaxMsgConnections")), (33, 1, 32));
    assert_eq!(sheet.fields("Capacity", "TSpec1"), ["Rx", "1400", "500"]);
    assert_eq!(sheet.fields("Capacity", "TSpec2"), ["Tx", "1400", "500"]);
}

#[test]
fn the_sheet_follows_the_configuration_and_nothing_else() {
    let changed = EXAMPLE
        .replace(
            "vendor_id = 65_535 ",
            "vendor_name = 'Say \"A\\B\", Inc.; $5'\ncatalog = \"AB-2\"\nvendor_id = 77 ",
        )
        .replace("power_structure_class_id = 0", "power_structure_class_id = 0x01020304")
        .replace("min = \"2 ms\", max = \"16 ms\"", "min = \"4 ms\", max = \"5 ms\"");
    let adapter = adapter(&changed);
    let sheet = Reader::of(&adapter);
    assert_eq!(sheet.one("Device", "VendName"), r#""Say \"A\\B\", Inc.; $5""#);
    assert_eq!(sheet.one("Device", "Catalog"), "\"AB-2\"");
    assert_eq!(number(sheet.one("Device", "VendCode")), 77);
    assert_eq!(sheet.range("Param1"), [4000, 5000, 5000]);
    assert_eq!(
        unquoted(&sheet.fields("Connection Manager", "Connection1")[14]),
        "20 42 2C 51 2C 02 80 04 01 01 00 00 04 03 02 01"
    );
    // The fixed format has one size, in the connection and in what the device can carry.
    let fixed = EXAMPLE.replace(
        "axes = [\"turntable\", \"slide\"]",
        "axes = [\"turntable\"]\nconnection_format = \"fixed\"",
    );
    let fixed = &fixed[..fixed.rfind("[[axis]]").unwrap()];
    let bus = &EXAMPLE[EXAMPLE.find("[south.sercos]").unwrap()..];
    let adapter_fixed = self::adapter(&format!("{fixed}{bus}"));
    let sheet_fixed = Reader::of(&adapter_fixed);
    let (size, _) = adapter_fixed.motion.sizes(adapter_fixed.motion.o_to_t_size_max);
    assert_eq!(number(&sheet_fixed.fields("Connection Manager", "Connection1")[1]), 0x4444_0005);
    assert_eq!(sheet_fixed.range("Param2"), [data_size(size); 3]);
    assert_eq!(number(&sheet_fixed.fields("Capacity", "TSpec1")[1]), u32::from(size));
    // Another start, another host, the same sheet.
    let config = Config::parse(&changed, "test.toml").unwrap();
    let again = adapter_config(&config, 0, Host { mac: [4; 6], incarnation: 77 }).unwrap();
    assert_eq!(again.eds, adapter.eds);
    assert!(adapter_config(&config, 1, Host { mac: [4; 6], incarnation: 1 }).is_none());
    const { assert!(MOTION_SIZE_MAX >= 1400) };
}
