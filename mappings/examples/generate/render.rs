//! The text of the generated files.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use mappings::{
    Access, Cia402CodeSet, Cia402Dictionary, CipDictionary, Dictionaries, Enumeration, IdnUnit, RangeKind,
    SercosDictionary, Word,
};

use super::plan::{Attributes, Codes, FILES, File, Item, Letters, PARAMETERS, Rows, SIGNALS, Set};

/// Where signals and parameters of the generic model stand.
const GENERIC: &str = "`mappings/tables/dictionary/generic.toml`";

/// One named value of a set.
struct Named {
    value: i64,
    name: String,
    note: String,
}

/// Every generated file: its path from the root of the repository, and its text.
pub fn files(dictionaries: &Dictionaries, generic: &str) -> Vec<(&'static str, String)> {
    let mut files: Vec<_> = FILES.iter().map(|file| (file.path, file_text(file, dictionaries))).collect();
    let generic: toml::Table = generic.parse().expect("the generic dictionary is TOML");
    files.extend([(SIGNALS, signals(&generic)), (PARAMETERS, parameters(&generic))]);
    files
}

fn head(about: &str, tables: &str) -> String {
    format!(
        "//! {about}\n//!\n//! Generated from {tables}: change the table, not this file, and run\n\
         //! `cargo run -p mappings --example generate`.\n"
    )
}

fn file_text(file: &File, dictionaries: &Dictionaries) -> String {
    let mut text = head(file.about, file.tables);
    if file.items.iter().any(|item| matches!(item, Item::Codes(_))) {
        text.push_str("\nuse profile_generic::open_code;\n");
    }
    for item in file.items {
        text.push('\n');
        match item {
            Item::Codes(codes) => open_code(&mut text, codes, dictionaries),
            Item::Bits { module, set, constants } => bits(&mut text, module, set, constants, dictionaries),
            Item::Masks { module, repr, set, constants } => {
                masks(&mut text, module, repr, set, constants, dictionaries);
            }
            Item::Numbers { rows: Rows::Idns, of, constants } => {
                idns(&mut text, of, constants, &dictionaries.sercos);
            }
            Item::Numbers { rows: Rows::Objects, of, constants } => {
                objects(&mut text, of, constants, &dictionaries.cia402);
            }
            Item::Elements { module, block, of, constants } => {
                elements(&mut text, (module, *block), of, constants, &dictionaries.sercos);
            }
            Item::Attributes(list) => attributes(&mut text, list, &dictionaries.cip),
        }
    }
    text
}

fn open_code(text: &mut String, codes: &Codes, dictionaries: &Dictionaries) {
    let _ = writeln!(text, "open_code! {{");
    for line in codes.doc {
        let _ = writeln!(text, "    /// {line}");
    }
    let _ = writeln!(text, "    pub struct {}({}) {{", codes.name, codes.repr);
    let mut constants = BTreeSet::new();
    for row in values(&codes.set, dictionaries) {
        if codes.without.contains(&row.value) {
            continue;
        }
        let constant = constant(&row.name, codes.constants, &row.name);
        assert!(constants.insert(constant.clone()), "{}: two constants {constant}", codes.name);
        let note = if row.note.is_empty() { String::new() } else { format!(": {}", row.note) };
        let value = if codes.digits == 0 {
            row.value.to_string()
        } else {
            format!("0x{:0digits$X}", row.value, digits = codes.digits)
        };
        let name = codes.letters.of(&row.name, row.value);
        let _ = writeln!(text, "        /// {}{note}.", row.name.replace('[', "\\["));
        let _ = writeln!(text, "        {constant} = {value} => {name:?},");
    }
    text.push_str("    }\n}\n");
}

impl Letters {
    /// The name of a code as the program prints it.
    fn of(self, name: &str, value: i64) -> String {
        match self {
            Self::AsTheyAre => name.to_owned(),
            Self::Lower => lower(name),
            Self::LowerWithoutAbbreviation => lower(name.split(" (").next().unwrap_or(name)),
            Self::WithoutRequest if name.starts_with("No ") => name.to_owned(),
            Self::WithoutRequest => name.trim_end_matches(" Request").to_owned(),
            Self::BehindTheirLetter => {
                let letter = u8::try_from(value).map_or('?', char::from);
                format!("{letter}: {}", lower(name))
            }
        }
    }
}

/// A name without its capital, unless the first word is an abbreviation.
fn lower(name: &str) -> String {
    let word = name.split([' ', '-']).next().unwrap_or(name);
    let mut letters = name.chars();
    match letters.next() {
        Some(first) if !word.chars().skip(1).any(|letter| letter.is_uppercase() || letter.is_numeric()) => {
            first.to_lowercase().chain(letters).collect()
        }
        _ => name.to_owned(),
    }
}

/// Numbers and names of bits.
fn bits(text: &mut String, module: &str, set: &Set, constants: &[(&str, &str)], dictionaries: &Dictionaries) {
    let _ = writeln!(text, "/// {}: number and name of each bit.\npub mod {module} {{", set.name());
    let mut seen = BTreeSet::new();
    for row in values(set, dictionaries) {
        let constant = constant(&row.name, constants, &row.name);
        assert!(seen.insert(constant.clone()), "{module}: two constants {constant}");
        let _ = writeln!(text, "    /// Bit {}.", row.value);
        let _ = writeln!(text, "    pub const {constant}: (u32, &str) = ({}, {:?});", row.value, row.name);
    }
    text.push_str("}\n");
}

/// Masks of the fields of a word.
fn masks(
    text: &mut String,
    module: &str,
    repr: &str,
    set: &Set,
    constants: &[(&str, &str)],
    dictionaries: &Dictionaries,
) {
    let _ = writeln!(text, "/// {}: mask of each field.\npub mod {module} {{", set.name());
    let mut seen = BTreeSet::new();
    for (name, mask, width) in fields(set, dictionaries) {
        let constant = constant(&name, constants, &name);
        assert!(seen.insert(constant.clone()), "{module}: two constants {constant}");
        let _ = writeln!(text, "    /// {name}.");
        let _ = writeln!(text, "    pub const {constant}: {repr} = 0x{mask:0digits$X};", digits = width / 4);
    }
    text.push_str("}\n");
}

/// Parameters of SERCOS.
fn idns(text: &mut String, of: &str, constants: &[(&str, &str)], dictionary: &SercosDictionary) {
    text.push_str("use crate::wire::idn::Idn;\n\nimpl Idn {\n");
    let mut seen = BTreeSet::new();
    for number in of.split_whitespace() {
        let idn = format!("S-0-{number}").replacen(".x.", ".0.", 1);
        let row = idn.parse().ok().and_then(|idn| dictionary.idn(idn));
        let row = row.unwrap_or_else(|| panic!("no parameter {idn}"));
        let constant = constant(in_short(&row.name), constants, &row.name);
        assert!(seen.insert(constant.clone()), "two constants {constant}");
        let unit = match &row.unit {
            IdnUnit::Fixed { unit, .. } if unit != "1" => format!(", {unit}"),
            _ => String::new(),
        };
        let _ = writeln!(text, "    /// {}: {}{unit}.", row.number(), row.name);
        let (block, at) = (row.idn.block(), (row.idn.instance(), row.idn.element()));
        let _ = match at {
            (0, 0) => writeln!(text, "    pub const {constant}: Idn = Idn::standard({block});"),
            (instance, element) => writeln!(
                text,
                "    pub const {constant}: Idn = Idn::structured({block}, {instance}, {element});"
            ),
        };
    }
    text.push_str("}\n");
}

/// Elements of a structure of SERCOS.
fn elements(
    text: &mut String,
    (module, block): (&str, u16),
    of: &[u8],
    constants: &[(&str, &str)],
    dictionary: &SercosDictionary,
) {
    let _ = writeln!(text, "/// Elements of S-0-{block}.x.\npub mod {module} {{");
    for element in of {
        let idn = format!("S-0-{block}.0.{element}");
        let row = idn.parse().ok().and_then(|idn| dictionary.idn(idn));
        let row = row.unwrap_or_else(|| panic!("no parameter {idn}"));
        let constant = constant(&row.name, constants, &row.name);
        let _ = writeln!(text, "    /// {}.\n    pub const {constant}: u8 = {element};", row.name);
    }
    text.push_str("}\n");
}

/// Objects of CANopen and CiA 402.
fn objects(text: &mut String, of: &str, constants: &[(&str, &str)], dictionary: &Cia402Dictionary) {
    let mut seen = BTreeSet::new();
    for number in of.split_whitespace() {
        let index = u16::from_str_radix(number, 16).unwrap_or_else(|_| panic!("{number} is no index"));
        let row = dictionary.object(index).unwrap_or_else(|| panic!("no object {number}"));
        let constant = constant(in_short(&row.name), constants, &row.name);
        assert!(seen.insert(constant.clone()), "two constants {constant}");
        let _ = writeln!(text, "/// {}.\npub const {constant}: u16 = 0x{index:04X};", row.name);
    }
}

/// A name without abbreviations in parentheses and without the last word where all rows of its kind have it.
fn in_short(name: &str) -> &str {
    let name = name.split(" (").next().unwrap_or(name);
    let ends = [" value", " code", " procedure command"];
    ends.iter().find_map(|end| name.strip_suffix(end)).unwrap_or(name)
}

/// Attributes of the Motion Device Axis Object.
fn attributes(text: &mut String, list: &Attributes, dictionary: &CipDictionary) {
    text.push_str("use crate::device::attribute::attributes;\n\nattributes! {\n    always {\n");
    let mut seen = BTreeSet::new();
    let mut row = |scope, number: &str| {
        let id: u16 = number.parse().unwrap_or_else(|_| panic!("{number} is no number"));
        let row = match scope {
            "Class" => dictionary.class_attribute_by_id(id),
            _ => dictionary.attribute_by_id(id),
        };
        let row = row.unwrap_or_else(|| panic!("no attribute {id}"));
        let constant = constant(&row.name, list.constants, &row.name);
        assert!(seen.insert(constant.clone()), "two constants {constant}");
        let unit = if row.unit.is_empty() { String::new() } else { format!(" [{:?}]", row.unit) };
        (row, format!("        {scope} {constant} = {id}"), format!("{:?}{unit}", row.name))
    };
    for (scope, of) in [("Class", list.class), ("Instance", list.axis)] {
        for number in of.split_whitespace() {
            let (row, constant, name) = row(scope, number);
            let access = match row.access {
                Access::Get => "Get",
                Access::Set => "Set",
                Access::SetCyclic => "Cyclic",
            };
            let kind = camel(&row.data_type.name().to_lowercase());
            let default = row.default.unwrap_or(0);
            let _ = writeln!(text, "{constant}, {kind}, {access}, {default}, {name};");
        }
    }
    text.push_str("    }\n    else {\n");
    for (scope, others) in [("Class", list.other_class), ("Instance", list.others)] {
        for number in others.split_whitespace() {
            let (_, constant, name) = row(scope, number);
            let _ = writeln!(text, "{constant}, {name};");
        }
    }
    text.push_str("    }\n}\n");
}

/// The constant of a row: that of the plan for its name, or the words of its name in short.
fn constant(short: &str, constants: &[(&str, &str)], name: &str) -> String {
    if let Some((_, constant)) = constants.iter().find(|(known, _)| *known == name) {
        return (*constant).to_owned();
    }
    let letters = short.chars().map(|letter| if letter.is_ascii_alphanumeric() { letter } else { ' ' });
    letters.collect::<String>().split_whitespace().collect::<Vec<_>>().join("_").to_uppercase()
}

fn values(set: &Set, dictionaries: &Dictionaries) -> Vec<Named> {
    let named = |value: i64, name: &str, note: &str| Named { value, name: name.into(), note: note.into() };
    match set {
        Set::Cip(_) => {
            let set = cip(set, dictionaries);
            let mut rows: Vec<_> =
                set.codes.iter().map(|row| named(row.code.into(), &row.name, &row.note)).collect();
            if !matches!(set.kind, mappings::SetKind::Codes) {
                for range in set.ranges.iter().filter(|range| range.kind == RangeKind::Vendor) {
                    let bits = range.first..=range.last;
                    rows.extend(bits.map(|bit| named(bit.into(), &format!("Vendor Specific {bit}"), "")));
                }
            }
            rows
        }
        Set::CipServices => {
            let services = dictionaries.cip.services().iter();
            services.map(|row| named(row.code.into(), &row.name, "")).collect()
        }
        Set::Sercos(name) => {
            let set = dictionaries.sercos.codes(name).unwrap_or_else(|| panic!("no set {name}"));
            set.codes.iter().map(|row| named(row.code.into(), &row.name, &row.note)).collect()
        }
        Set::Cia402(_) => {
            let codes = cia402(set, dictionaries).codes.iter();
            codes.map(|row| named(row.code, &row.name, &row.note)).collect()
        }
        Set::SercosWord(name) => panic!("{name} has fields"),
    }
}

fn fields(set: &Set, dictionaries: &Dictionaries) -> Vec<(String, u64, usize)> {
    let mask = |first: u32, last: u32| (first..=last).fold(0_u64, |mask, bit| mask | 1 << bit);
    match set {
        Set::SercosWord(name) => {
            let word: &Word = dictionaries.sercos.word(name).unwrap_or_else(|| panic!("no word {name}"));
            let width = usize::try_from(word.width).unwrap_or_default();
            let of =
                |parts: &[(u32, u32)]| parts.iter().fold(0, |all, (first, last)| all | mask(*first, *last));
            let fields = word.fields.iter().filter_map(|field| Some((field.name.clone()?, of(&field.parts))));
            let mut rows: Vec<_> = fields.map(|(name, mask)| (name, mask, width)).collect();
            let all = mask(0, word.width - 1);
            let unnamed = rows.iter().fold(all, |rest, (_, mask, _)| rest & !mask);
            rows.push(("Reserved".to_owned(), unnamed, width));
            rows
        }
        Set::Cia402(_) => {
            let set = cia402(set, dictionaries);
            let bit = |row: &mappings::Cia402Code| u32::try_from(row.code).unwrap_or_default();
            let most = set.codes.iter().map(|row| row.last.unwrap_or_else(|| bit(row))).max().unwrap_or(0);
            let width = if most < 8 {
                8
            } else if most < 16 {
                16
            } else {
                32
            };
            let rows = set.codes.iter();
            rows.map(|row| (row.name.clone(), mask(bit(row), row.last.unwrap_or(bit(row))), width)).collect()
        }
        _ => panic!("{} has no fields", set.name()),
    }
}

fn cip<'d>(set: &Set, dictionaries: &'d Dictionaries) -> &'d Enumeration {
    let name = set.name();
    let found = dictionaries.cip.enumeration(name).or_else(|| dictionaries.cip.bits(name));
    found.unwrap_or_else(|| panic!("no set {name}"))
}

fn cia402<'d>(set: &Set, dictionaries: &'d Dictionaries) -> &'d Cia402CodeSet {
    dictionaries.cia402.codes(set.name()).unwrap_or_else(|| panic!("no set {}", set.name()))
}

/// What is read of the generic model as it stands: the program knows no signal and no parameter that has no constant yet.
fn generic<'t>(table: &'t toml::Table, list: &str) -> impl Iterator<Item = (&'t toml::Value, i64)> {
    let rows = table[list].as_array().unwrap_or_else(|| panic!("no list of {list}s"));
    rows.iter().map(|row| (row, row.get("number").and_then(toml::Value::as_integer).unwrap_or_default()))
}

fn word<'t>(row: &'t toml::Value, key: &str) -> &'t str {
    row.get(key).and_then(toml::Value::as_str).unwrap_or_else(|| panic!("{key}: {row}"))
}

/// The signals of the process image.
fn signals(table: &toml::Table) -> String {
    let mut text = head("The signals of the process image.", GENERIC);
    text.push_str("\nuse crate::image::signal_rows;\n\nsignal_rows! {\n");
    for (row, _) in generic(table, "signal") {
        let [signal, quantity, image] = ["name", "quantity", "access"].map(|key| camel(word(row, key)));
        let (name, about) = (word(row, "name"), word(row, "about"));
        let _ = writeln!(text, "    {signal} = {name:?}, {quantity}, {image}, {about:?};");
    }
    text.push_str("}\n");
    text
}

/// The catalogue of generic parameters.
fn parameters(table: &toml::Table) -> String {
    let mut text = head("The catalogue of generic parameters.", GENERIC);
    text.push_str("\nuse crate::parameter::parameter_rows;\n\nparameter_rows! {\n");
    let mut group = None;
    for (row, number) in generic(table, "parameter") {
        if group.replace(number >> 8).is_some_and(|group| group != number >> 8) {
            text.push('\n');
        }
        let [element, quantity, kind, access] =
            ["element", "quantity", "type", "access"].map(|key| camel(word(row, key)));
        let name = word(row, "name");
        let _ = writeln!(
            text,
            "    {} = 0x{number:04X}, {name:?}, {element}, {quantity}, {kind}, {access},\n        {:?};",
            name.to_uppercase(),
            word(row, "about")
        );
    }
    text.push_str("}\n");
    text
}

/// `write_while_disabled` as the variant of an enumeration.
fn camel(name: &str) -> String {
    let words = name.split('_').map(|word| {
        let mut letters = word.chars();
        letters
            .next()
            .map(|first| first.to_uppercase().chain(letters).collect::<String>())
            .unwrap_or_default()
    });
    words.collect()
}
