//! Parameters that overlays define, constants, and what is wrong with them.

use super::*;
use crate::check::texts;

const EXAMPLE: &str = include_str!("../../../examples/overlays/vendor-parameter.toml");

/// The notch filter's frequency, as the example numbers it.
const NOTCH: Parameter = Parameter(0x8001);

fn checked(text: &str) -> Vec<String> {
    let mut tables = TableTexts::embedded();
    tables.overlays = vec![Overlay::new("own.toml", text)];
    let outcome = texts(Some(tables), Findings::default());
    let found = outcome.findings.to_string();
    found
        .split("\n\n")
        .filter(|found| found.contains("own.toml") && !found.starts_with("note"))
        .map(str::to_owned)
        .collect()
}

fn example() -> Mapping {
    let mut tables = TableTexts::embedded();
    tables.overlays = vec![Overlay::new("own.toml", EXAMPLE)];
    let mut findings = Findings::default();
    let mapping = Mapping::resolve(&tables, &mut findings);
    assert!(findings.is_empty(), "{findings}");
    mapping.unwrap()
}

/// The example with one text in place of another has one finding, which says all of `expected`.
#[track_caller]
fn wrong(good: &str, bad: &str, expected: &[&str]) {
    assert!(EXAMPLE.contains(good), "{good}");
    let found = checked(&EXAMPLE.replacen(good, bad, 1));
    assert!(
        found.iter().any(|found| expected.iter().all(|text| found.contains(text))),
        "{expected:?} not in\n{}",
        found.join("\n\n")
    );
}

#[test]
fn the_example_is_clean_and_binds_both_drives() {
    assert_eq!(checked(EXAMPLE), Vec::<String>::new());
    let mapping = example();
    let row = mapping.dictionaries.generic.parameter("notch_frequency").unwrap();
    assert_eq!((row.parameter, row.range), (NOTCH, Some((50_000, 2_000_000))));
    let table = mapping.attribute_table(&rotary_counts()).unwrap();
    let entry = table.get(2001).unwrap();
    assert_eq!(entry.to_generic(&123.4_f32.to_le_bytes()), Ok(123_400));
    assert_eq!(entry.to_generic(&2_000_f32.to_le_bytes()), Ok(2_000_000));
    assert_eq!(entry.to_generic(&2_000.1_f32.to_le_bytes()), Err(ValueError::Range));
    assert_eq!(entry.to_generic(&49.9_f32.to_le_bytes()), Err(ValueError::Range));
    let mut bytes = [0; 8];
    assert_eq!(entry.from_generic(123_400, &mut bytes), Ok((4, false)));
    assert_eq!(bytes[..4], 123.4_f32.to_le_bytes());
    assert_eq!(mapping.parameter_row(NOTCH).unwrap().file, "own.toml");
    assert_eq!(mapping.object_parameter_row(NOTCH).unwrap().file, "own.toml");
}

#[test]
fn a_constant_can_only_be_set_to_what_it_is() {
    let mapping = example();
    let table = mapping.attribute_table(&rotary_counts()).unwrap();
    assert_eq!(table.get(2002).unwrap().range, Some((3, 3)));
    wrong("value = 3", "value = 256", &["expected 0 to 255", "got 256"]);
    wrong("value = 3\n", "", &["a constant", "`value`"]);
    wrong("value = 3", "value = 3\nrange = [0, 5]", &["`range`", "constant"]);
}

#[test]
fn a_parameter_is_wrong_where_it_says_so() {
    wrong("number = 0x8001\n", "", &["AX0010", "own.toml:8:8", "0x8000 to 0xFFFF"]);
    wrong("0x8001", "0x7FFF", &["AX0010", "own.toml:9:8"]);
    wrong("\"notch_frequency\"\nquantity", "\"Notch\"\nquantity", &["own.toml:9:8", "small letters"]);
    wrong("type = \"integer\"", "type = \"float\"", &["own.toml:11:8", "one of integer"]);
    wrong("[50_000, 2_000_000]", "[2, 1]", &["own.toml:13:9", "least value first"]);
    wrong("access = \"write\"", "access = \"read\"", &["only read", "own.toml:13:9"]);
    let second = "[[generic.parameter]]\nnumber = 0x8001\nname = \"other\"\nquantity = \"none\"\ntype = \"integer\"\naccess = \"read\"\n\n# What the controller";
    wrong("# What the controller", second, &["0x8001 is the number of notch_frequency"]);
}

/// Success without an effect is not possible by tables.
#[test]
fn a_parameter_is_never_kept_in_the_gateway() {
    let kept = "a value kept in the gateway has no effect";
    let head = "notch_frequency\"\nmissing";
    wrong(&format!("{head} = \"reject\""), &format!("{head} = \"stored\""), &["own.toml", kept]);
    let head = "direction = \"both\"\nmissing";
    wrong(
        &format!("{head} = \"reject\""),
        &format!("{head} = \"stored\""),
        &["own.toml", "AX0012", "reject"],
    );
    wrong("\"both\"", "\"to_drive\"", &["expected `both` for notch_frequency", "`write`"]);
    wrong("\"both\"", "\"from_drive\"", &["expected `both` for notch_frequency"]);
    let disabled = EXAMPLE.replace("access = \"write\"", "access = \"write_while_disabled\"");
    let found = checked(&disabled);
    assert!(found.iter().any(|found| found.contains("running = false")), "{found:?}");
}

#[test]
fn both_ends_are_there_and_hold_the_range_in_their_units() {
    wrong("2_000_000]", "9_000_000]", &["own.toml", "do not fit the 2 bytes of P-0-0702"]);
    wrong("2_000_000]", "90_000_000]", &["do not fit the 2 bytes of 2051:00"]);
    wrong("\"REAL\"", "\"USINT\"", &["do not fit a USINT"]);
    wrong("unit = \"Hertz\"", "unit = \"Volts\"", &["AX0030", "Volts"]);
    wrong("unit = \"Hz\"\nwrite", "unit = \"ms\"\nwrite", &["AX0030", "P-0-0702"]);
    let lonely = &EXAMPLE[..EXAMPLE.find("# What the controller").unwrap()];
    let found = checked(lonely);
    assert!(
        found.iter().any(|found| found.contains("own.toml:9:8") && found.contains("cip-generic")),
        "{found:?}"
    );
}

/// A folder of overlays is laid over the tables as a whole.
#[test]
fn the_example_goes_with_the_other_examples() {
    let others = [
        include_str!("../../../examples/overlays/first.toml"),
        include_str!("../../../examples/overlays/line-4.toml"),
        include_str!("../../../examples/overlays/vendor-attribute.toml"),
        include_str!("../../../examples/overlays/vendor-idn.toml"),
        include_str!("../../../examples/overlays/vendor-object.toml"),
    ];
    let mut tables = TableTexts::embedded();
    tables.overlays = others.iter().chain([&EXAMPLE]).map(|text| Overlay::new("own.toml", text)).collect();
    let findings = texts(Some(tables), Findings::default()).findings.to_string();
    let bad = |found: &&str| found.contains("own.toml") && !found.starts_with("note");
    assert_eq!(findings.split("\n\n").find(bad), None);
}
