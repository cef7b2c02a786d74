//! Tables that are broken on purpose.

use super::*;

fn broken(change: impl Fn(&mut TableTexts)) -> String {
    let mut texts = TableTexts::embedded();
    change(&mut texts);
    match Mapping::from_texts(texts) {
        Ok(_) => "nothing found".to_owned(),
        Err(errors) => errors.to_string(),
    }
}

fn replace(table: &mut TableText, from: &str, to: &str) {
    assert!(table.text.contains(from), "{from:?} is not in {}", table.path);
    table.text = table.text.replacen(from, to, 1);
}

/// One of the files.
type Table = fn(&mut TableTexts) -> &mut TableText;

/// What to break, in which file, from what, to what.
type Case = (&'static str, Table, &'static str, &'static str);

const CASES: &[Case] = &[
    ("no TOML", |t| &mut t.cip_generic, "[scaling]", "[scaling"),
    ("unknown key", |t| &mut t.cip_generic, "wraps = true", "wrap = true"),
    ("wrong type", |t| &mut t.sercos, "length = 2,", "length = \"two\","),
    ("warning that stops", |t| &mut t.generic_sercos, "cause = \"cooling_warning\"", "cause = \"cooling\""),
    ("no such action", |t| &mut t.cip_generic, "least = \"Ignore\"", "least = \"Ignored\""),
    (
        "default below the least",
        |t| &mut t.cip_generic,
        "least = \"Ignore\"\ndefault = \"Alarm\"",
        "default = \"Alarm\"",
    ),
    ("unknown signal", |t| &mut t.cip_generic, "\"position_command\"", "\"position_comand\""),
    (
        "unknown IDN",
        |t| &mut t.generic_sercos,
        "idn = \"S-0-0047\"\ndirection",
        "idn = \"S-0-4047\"\ndirection",
    ),
    ("no IDN", |t| &mut t.generic_sercos, "idn = \"S-0-0047\"\ndirection", "idn = \"S-47\"\ndirection"),
    ("unknown attribute", |t| &mut t.cip_generic, "attribute = \"Kpp\"", "attribute = \"Kpq\""),
    ("unit does not convert", |t| &mut t.cip_generic, "\"position_loop_gain\"", "\"power_loss_time\""),
    ("unknown exception", |t| &mut t.cip_generic, "exception = \"Brake Slip\"", "exception = \"Brake Slap\""),
    (
        "two answers",
        |t| &mut t.cip_generic,
        "exception = \"Brake Slip\"",
        "exception = \"Brake Slip\"\nmanufacturer = 9",
    ),
    ("manufacturer bit 0", |t| &mut t.cip_generic, "manufacturer = 1\n", "manufacturer = 0\n"),
    ("field value too large", |t| &mut t.generic_sercos, "\"Drive on\", is = 0", "\"Drive on\", is = 2"),
    ("unknown field", |t| &mut t.generic_sercos, "field = \"Drive on\"", "field = \"Drive off\""),
    ("wrong direction", |t| &mut t.generic_sercos, "direction = \"to_drive\"", "direction = \"from_drive\""),
    (
        "read only",
        |t| &mut t.generic_sercos,
        "idn = \"S-0-0111\"\ndirection = \"from_drive\"",
        "idn = \"S-0-0112\"\ndirection = \"both\"",
    ),
    ("phase", |t| &mut t.generic_sercos, "phase = 2\ndo = \"write\"", "phase = 4\ndo = \"write\""),
    ("ratio", |t| &mut t.generic_sercos, "generic_per_unit = [1_000, 1]", "generic_per_unit = [1_000, 0]"),
    ("state twice", |t| &mut t.cip_generic, "state = \"shutdown\"", "state = \"faulted\""),
    ("attribute twice", |t| &mut t.cip_attributes, "{ id = 41,", "{ id = 40,"),
    (
        "attribute name twice",
        |t| &mut t.cip_attributes,
        "name = \"Motion Unit\"",
        "name = \"Motion Resolution\"",
    ),
    (
        "attribute without a clause",
        |t| &mut t.cip_attributes,
        "source = \"Table 5-2.9\", clause",
        "source = \"Table 5-2.8\", clause",
    ),
    ("attribute need", |t| &mut t.cip_attributes, "need = \"-O----\"", "need = \"-O---\""),
    ("attribute polarity", |t| &mut t.cip_attributes, "polarity = \"sign\"", "polarity = \"swap\""),
    (
        "limits that do not swap",
        |t| &mut t.cip_attributes,
        "swaps_with = \"Torque Limit - Negative\"",
        "swaps_with = \"Kpp\"",
    ),
    ("range upside down", |t| &mut t.cip_attributes, "min = 0, max = 100", "min = 101, max = 100"),
    (
        "channel without a place in the name",
        |t| &mut t.cip_attributes,
        "\"Feedback n Turns\"",
        "\"Feedback Turns\"",
    ),
    ("channels that overlap", |t| &mut t.cip_attributes, "step = 50", "step = 34"),
    ("channel above the last number", |t| &mut t.cip_attributes, "{ id = 1435,", "{ id = 65535,"),
    ("service code", |t| &mut t.cip_services, "code = 0x4B", "code = 0x9B"),
    ("service twice", |t| &mut t.cip_services, "code = 0x4B", "code = 0x4C"),
    ("service need", |t| &mut t.cip_services, "instance = \"--OOOO\"", "instance = \"--XXXX\""),
    ("service carrier", |t| &mut t.cip_services, "via = [\"explicit\"]", "via = [\"implicit\"]"),
    ("service without a carrier", |t| &mut t.cip_services, "via = [\"explicit\"]", "via = []"),
    ("network twice", |t| &mut t.cip_networks, "name = \"ControlNet\"", "name = \"DeviceNet\""),
    ("network format", |t| &mut t.cip_networks, "formats = [\"fixed\"]", "formats = [\"loose\"]"),
    ("network without a format", |t| &mut t.cip_networks, "formats = [\"fixed\"]", "formats = []"),
    ("network without axes", |t| &mut t.cip_networks, "axes = [1, 16]", "axes = [0, 16]"),
    ("network axes upside down", |t| &mut t.cip_networks, "variable = [1, 4]", "variable = [5, 4]"),
    ("network class twice", |t| &mut t.cip_networks, "class = 0x05", "class = 0x01"),
    ("network need", |t| &mut t.cip_networks, "need = \"O\"", "need = \"C\""),
    ("network priority", |t| &mut t.cip_networks, "priority = \"urgent\"", "priority = \"low\""),
    ("codes of nothing", |t| &mut t.cip_enumerations, "attributes = [\"Control Mode\"]\n", ""),
    (
        "codes of an unknown attribute",
        |t| &mut t.cip_enumerations,
        "attributes = [\"Control Method\"]",
        "attributes = [\"Control Methods\"]",
    ),
    (
        "codes of an unknown class attribute",
        |t| &mut t.cip_enumerations,
        "class_attributes = [\"Node Status\"]",
        "class_attributes = [\"Nod Status\"]",
    ),
    ("set twice", |t| &mut t.cip_enumerations, "name = \"Control Method\"", "name = \"Control Mode\""),
    (
        "code twice",
        |t| &mut t.cip_enumerations,
        "{ code = 1, name = \"Position Control\"",
        "{ code = 0, name = \"Position Control\"",
    ),
    (
        "bit above the width",
        |t| &mut t.cip_faults,
        "name = \"APR Faults\"\nattributes = [\"APR Faults\"]\nwidth = 16",
        "name = \"APR Faults\"\nattributes = [\"APR Faults\"]\nwidth = 7",
    ),
    (
        "code above the field",
        |t| &mut t.cip_enumerations,
        "{ code = 4, name = \"Torque Control\"",
        "{ code = 16, name = \"Torque Control\"",
    ),
    ("field above the value", |t| &mut t.cip_enumerations, "field = [0, 3]", "field = [5, 8]"),
    (
        "range over a code",
        |t| &mut t.cip_enumerations,
        "{ from = 5, to = 15, kind = \"reserved\" }",
        "{ from = 4, to = 15, kind = \"reserved\" }",
    ),
    (
        "range over a range, the wrong way round, of an unknown kind",
        |t| &mut t.cip_enumerations,
        "  { from = 128, to = 255, kind = \"vendor\" },\n",
        "  { from = 127, to = 256, kind = \"maker\" },\n  { from = 9, to = 8, kind = \"vendor\" },\n",
    ),
    ("unknown limit", |t| &mut t.cip_faults, "limits = [\"Brake Slip", "limits = [\"Brake Slap"),
    (
        "limit of the axis for the node",
        |t| &mut t.cip_faults,
        "limits = [\"Sync Threshold\"]",
        "limits = [\"Torque Threshold\"]",
    ),
    (
        "set in both files",
        |t| &mut t.cip_faults,
        "name = \"Node Alarm Code\"\nclass",
        "name = \"Axis State\"\nclass",
    ),
    (
        "record of unknown conditions",
        |t| &mut t.cip_faults,
        "conditions = \"APR Faults\"",
        "conditions = \"APR Fault\"",
    ),
    (
        "record twice",
        |t| &mut t.cip_faults,
        "conditions = \"APR Faults - Mfg\"\nfault_type = \"APR Fault - Mfg\"",
        "conditions = \"APR Faults\"\nfault_type = \"APR Fault\"",
    ),
    ("unknown clearing", |t| &mut t.cip_faults, "[\"time_out\"]", "[\"times_out\"]"),
    ("action twice", |t| &mut t.cip_faults, "action = \"Alarm\"", "action = \"Ignore\""),
    ("status twice", |t| &mut t.cip_faults, "general = 0x14", "general = 0x0A"),
    (
        "catalogue",
        |t| &mut t.generic,
        "quantity = \"torque\", access = \"command\"",
        "quantity = \"time\", access = \"command\"",
    ),
    ("format", |t| &mut t.sercos, "format = 1", "format = 2"),
];

#[test]
fn are_refused_with_place_key_and_what_was_expected() {
    let mut text = String::new();
    for (what, table, from, to) in CASES {
        let errors = broken(|texts| replace(table(texts), from, to));
        assert_ne!(errors, "nothing found", "{what}");
        writeln!(text, "## {what}\n{errors}\n").unwrap();
    }
    insta::assert_snapshot!(text);
}

#[test]
fn errors_carry_their_place_as_numbers() {
    let mut texts = TableTexts::embedded();
    replace(&mut texts.cip_generic, "signal = \"position_command\"", "signal = \"position_comand\"");
    let line = texts.cip_generic.text.lines().position(|line| line.contains("position_comand")).unwrap() + 1;
    let errors = Mapping::from_texts(texts).unwrap_err();
    let [error] = errors.0.as_slice() else { panic!("{errors}") };
    assert_eq!((error.line, error.column, error.key.as_str()), (line, 10, "signal"));
    assert_eq!(error.file, "mappings/cip-generic.toml");
}

/// The examples are worth their place: a row that is changed is found out.
#[test]
fn a_changed_ratio_makes_an_example_fail() {
    let changes: &[(Table, &str, &str)] = &[
        (
            |t| &mut t.cip_generic,
            "quantity = \"torque\"\ngeneric_per_unit = [10_000, 1]",
            "quantity = \"torque\"\ngeneric_per_unit = [1_000, 1]",
        ),
        (|t| &mut t.cip_generic, "nanounits = 25_400_000_000", "nanounits = 25_000_000_000"),
        (|t| &mut t.generic_sercos, "divisor = 3_600_000, expect", "divisor = 360_000, expect"),
        (|t| &mut t.generic_sercos, "factor = [-1, 1]\n", ""),
    ];
    for (table, from, to) in changes {
        let mut texts = TableTexts::embedded();
        let before =
            texts.cip_generic.text.matches(from).count() + texts.generic_sercos.text.matches(from).count();
        for _ in 0..before {
            replace(table(&mut texts), from, to);
        }
        let failures = Mapping::from_texts(texts).unwrap().run_examples().unwrap_err();
        assert!(!failures.is_empty(), "{from}");
    }
}

#[test]
fn a_folder_replaces_files_and_may_hold_no_others() {
    let folder = std::env::temp_dir().join(format!("axisbridge-mapping-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("dictionary")).unwrap();
    let mut texts = TableTexts::embedded();
    replace(&mut texts.sercos, "name = \"Position command value\"", "name = \"Position set-point\"");
    std::fs::write(folder.join("dictionary/sercos.toml"), &texts.sercos.text).unwrap();
    let mapping = Mapping::from_folder(&folder).unwrap();
    let name = mapping.dictionaries.sercos.idn(Idn::standard(47)).map(|row| row.name.clone());
    assert_eq!(name.as_deref(), Some("Position set-point"));
    std::fs::write(folder.join("cip_generic.toml"), "").unwrap();
    let errors = Mapping::from_folder(&folder).unwrap_err();
    assert!(errors.0[0].message.contains("got `cip_generic.toml`"), "{errors}");
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(Mapping::from_folder(&folder).unwrap_err().0[0].message.starts_with("cannot read"));
}
