//! The start-up lists of drives, as far as they can be judged without tables: numbers, words, values of a type, each parameter once.

use super::{Problems, value};
use crate::config::file::{
    AttributeStartupTable, CanDriveTable, DevicenetDriveTable, DriveTable, ObjectStartupTable, StartupTable,
};
use crate::config::scalar::Scalar;
use crate::finding::registry as code;
use crate::finding::{Problem, Spanned};
use crate::mapping::Cia402Type;
use crate::parameter::id::Id;
use crate::parameter::startup::{OnDifference, StartupEntry, StartupValue};
use crate::parameter::value::Kind;

/// Entries of a list.
const ENTRIES_MAX: usize = 4_096;

/// What an IDN, an object and an attribute look like.
const IDN: &str = "an IDN such as \"S-0-0121\", \"P-0-0123\" or \"S-0-1300.0.3\"";
const OBJECT: &str = "an object such as \"6091:01\", \"0x6091.1\" or \"2001h\"";
const PATH: &str = "class, instance and attribute such as \"0x2A.1.22\" or \"66.1.504\"";

/// An entry as it is written.
struct Row<'t> {
    parameter: &'t Spanned<String>,
    value: &'t Spanned<Scalar>,
    /// Type of an object.
    kind: Option<&'t Spanned<String>>,
    on_difference: Option<&'t Spanned<String>>,
}

impl<'t> From<&'t StartupTable> for Row<'t> {
    fn from(StartupTable { parameter, value, on_difference }: &'t StartupTable) -> Self {
        Row { parameter, value, kind: None, on_difference: on_difference.as_ref() }
    }
}

impl<'t> From<&'t ObjectStartupTable> for Row<'t> {
    fn from(ObjectStartupTable { parameter, value, kind, on_difference }: &'t ObjectStartupTable) -> Self {
        Row { parameter, value, kind: kind.as_ref(), on_difference: on_difference.as_ref() }
    }
}

/// The list of a SERCOS drive without its file.
pub(super) fn sercos(problems: &mut Problems, table: &DriveTable) -> Option<Vec<StartupEntry>> {
    file(problems, table.startup_file.as_ref());
    let usual = table.on_startup_difference.as_ref();
    list(problems, &table.startup, usual, IDN, |id| matches!(id, Id::Idn(_)))
}

/// The list of a CANopen drive without its file.
pub(super) fn can(problems: &mut Problems, table: &CanDriveTable) -> Option<Vec<StartupEntry>> {
    file(problems, table.startup_file.as_ref());
    let usual = table.on_startup_difference.as_ref();
    list(problems, &table.startup, usual, OBJECT, |id| matches!(id, Id::Object(_)))
}

impl<'t> From<&'t AttributeStartupTable> for Row<'t> {
    fn from(table: &'t AttributeStartupTable) -> Self {
        let AttributeStartupTable { parameter, value, kind, on_difference } = table;
        Row { parameter, value, kind: kind.as_ref(), on_difference: on_difference.as_ref() }
    }
}

/// The list of a drive on DeviceNet without its file.
pub(super) fn devicenet(problems: &mut Problems, table: &DevicenetDriveTable) -> Option<Vec<StartupEntry>> {
    file(problems, table.startup_file.as_ref());
    let usual = table.on_startup_difference.as_ref();
    list(problems, &table.startup, usual, PATH, |id| matches!(id, Id::Path { .. }))
}

/// The entries of a list whose parameters have to look like `expected`.
fn list<'t, T>(
    problems: &mut Problems,
    startup: &'t [Spanned<T>],
    usual: Option<&Spanned<String>>,
    expected: &str,
    is_of_bus: impl Fn(Id) -> bool,
) -> Option<Vec<StartupEntry>>
where
    Row<'t>: From<&'t T>,
{
    problems.count(startup, "entries of a start-up list", ENTRIES_MAX);
    let usual = word(problems, usual, OnDifference::default());
    let (mut numbers, mut entries) = (Vec::new(), Vec::new());
    for row in startup.iter().map(|entry| Row::from(entry.get_ref())) {
        let id = number(problems, row.parameter, expected, &is_of_bus);
        let on_difference = word(problems, row.on_difference, usual.unwrap_or_default());
        let data_type =
            row.kind.map(|word| value::word(problems, word, "type of an object", Cia402Type::NAMED));
        let fits = data_type.flatten().is_none_or(|kind| fits(problems, row.value, kind));
        // A word for no type was reported.
        let made = if data_type == Some(None) {
            None
        } else {
            made(id, row.value, data_type.flatten(), on_difference)
        };
        numbers.push(row.parameter);
        entries.push(made.filter(|_| fits));
    }
    once(problems, &numbers, &entries);
    usual.and(entries.into_iter().collect())
}

fn made(
    id: Option<Id>,
    value: &Spanned<Scalar>,
    data_type: Option<Cia402Type>,
    on_difference: Option<OnDifference>,
) -> Option<StartupEntry> {
    let value = StartupValue::Text(value.get_ref().0.clone());
    Some(StartupEntry { id: id?, value, data_type, on_difference: on_difference?, from_file: false })
}

fn file(problems: &mut Problems, path: Option<&Spanned<String>>) {
    if let Some(path) = path {
        value::path(problems, path, "the start-up list of a drive");
    }
}

fn word(
    problems: &mut Problems,
    word: Option<&Spanned<String>>,
    usual: OnDifference,
) -> Option<OnDifference> {
    value::word_or(problems, word, "reaction to a difference", &OnDifference::NAMED, usual)
}

/// A parameter by its number.
fn number(
    problems: &mut Problems,
    text: &Spanned<String>,
    expected: &str,
    is_of_bus: impl Fn(Id) -> bool,
) -> Option<Id> {
    match Id::parse(text.get_ref()) {
        Some(id) if is_of_bus(id) => Some(id),
        Some(id) => problems.report(
            text.span(),
            format_args!("`{}` is a number of {} drives", text.get_ref(), id.bus()),
            format_args!("expected {expected}"),
        ),
        None => problems.report(
            text.span(),
            format_args!("`{}` is not the number of a parameter", text.get_ref()),
            format_args!("expected {expected}"),
        ),
    }
}

/// Whether a value is one of the type.
fn fits(problems: &mut Problems, value: &Spanned<Scalar>, kind: Cia402Type) -> bool {
    match Kind::Object(kind).encode(&value.get_ref().0) {
        Ok(_) => true,
        Err(error) => {
            let title = format!("the value is not a {}", kind.name());
            problems.push(Problem::new(code::STARTUP, value.span()).title(title).expected(error.to_string()));
            false
        }
    }
}

/// Each parameter is in a list once, however it is written.
fn once(problems: &mut Problems, numbers: &[&Spanned<String>], entries: &[Option<StartupEntry>]) {
    for (at, entry) in entries.iter().enumerate() {
        let Some(entry) = entry else { continue };
        let same =
            |earlier: &Option<StartupEntry>| earlier.as_ref().is_some_and(|earlier| earlier.id == entry.id);
        if let Some(first) = entries[..at].iter().position(same) {
            problems.duplicate(
                &format!("the parameter {}", entry.id),
                numbers[first].span(),
                numbers[at].span(),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::checked;
    use super::*;

    fn titles<T: std::fmt::Debug>(checked: Result<T, Vec<String>>) -> Vec<String> {
        checked.map(|_| Vec::new()).unwrap_or_else(|titles| titles)
    }

    fn of_sercos(keys: &str) -> Result<Vec<StartupEntry>, Vec<String>> {
        checked(&format!("name = \"a\"\naddress = 1\n{keys}"), sercos)
    }

    fn of_can(keys: &str) -> Result<Vec<StartupEntry>, Vec<String>> {
        checked(&format!("name = \"a\"\nnode = 1\n{keys}"), can)
    }

    fn of_devicenet(keys: &str) -> Result<Vec<StartupEntry>, Vec<String>> {
        checked(&format!("name = \"a\"\nmac_id = 1\n{keys}"), devicenet)
    }

    #[test]
    fn values_are_numbers_and_texts_and_the_drive_has_a_usual_reaction() {
        let list = of_sercos(
            "on_startup_difference = \"refuse\"\n[[startup]]\nparameter = \"S-0-0121\"\nvalue = 3\n\
             [[startup]]\nparameter = \"p-0-123\"\nvalue = 0.10\non_difference = \"warn\"\n\
             [[startup]]\nparameter = \"S-0-0076\"\nvalue = \"0b0101\"\non_difference = \"write\"\n",
        )
        .expect("a list");
        let shown: Vec<_> = list
            .iter()
            .map(|entry| format!("{} {:?} {:?}", entry.id, entry.value, entry.on_difference))
            .collect();
        assert_eq!(
            shown,
            ["S-0-0121 Text(\"3\") Refuse", "P-0-0123 Text(\"0.1\") Warn", "S-0-0076 Text(\"0b0101\") Write"]
        );
        let list =
            of_can("[[startup]]\nparameter = \"6091:01\"\nvalue = -3\ntype = \"i32\"\n").expect("a list");
        assert_eq!((list[0].data_type, list[0].on_difference), (Some(Cia402Type::I32), OnDifference::Write));
        assert_eq!(list[0].bytes(Kind::Object(Cia402Type::I32)), Ok(vec![0xFD, 0xFF, 0xFF, 0xFF]));
        let list = of_devicenet("[[startup]]\nparameter = \"0x42.1.504\"\nvalue = 80.5\ntype = \"f32\"\n");
        let list = list.expect("a list");
        assert_eq!((list[0].id.to_string().as_str(), list[0].data_type), ("66.1.504", Some(Cia402Type::F32)));
        assert_eq!(list[0].bytes(Kind::Object(Cia402Type::F32)), Ok(80.5_f32.to_le_bytes().to_vec()));
    }

    #[test]
    fn what_is_no_entry_is_named() {
        let entry =
            |parameter: &str, rest: &str| format!("[[startup]]\nparameter = \"{parameter}\"\n{rest}\n");
        for (parameter, rest, expected) in [
            ("S-0-4096", "value = 1", "`S-0-4096` is not the number of a parameter"),
            ("6091:01", "value = 1", "`6091:01` is a number of CANopen drives"),
            (
                "S-0-0121",
                "value = 1\non_difference = \"ignore\"",
                "unknown reaction to a difference `ignore`",
            ),
        ] {
            assert_eq!(titles(of_sercos(&entry(parameter, rest))), [expected]);
        }
        for (parameter, rest, expected) in [
            ("6091", "value = 1", "`6091` is not the number of a parameter"),
            ("S-0-0121", "value = 1", "`S-0-0121` is a number of SERCOS drives"),
            ("6091:01", "value = 1\ntype = \"int\"", "unknown type of an object `int`"),
            ("6091:01", "value = 256\ntype = \"u8\"", "the value is not a u8"),
            ("6091:01", "value = 1.5\ntype = \"u32\"", "the value is not a u32"),
        ] {
            assert_eq!(titles(of_can(&entry(parameter, rest))), [expected]);
        }
        for (parameter, rest, expected) in [
            ("0x42.504", "value = 1", "`0x42.504` is not the number of a parameter"),
            ("6091:01", "value = 1", "`6091:01` is a number of CANopen drives"),
            ("0x42.1.504", "value = 1\ntype = \"real\"", "unknown type of an object `real`"),
            ("0x2A.1.22", "value = 200\ntype = \"i8\"", "the value is not a i8"),
        ] {
            assert_eq!(titles(of_devicenet(&entry(parameter, rest))), [expected]);
        }
        let twice = format!("{}{}", entry("S-0-0121", "value = 1"), entry("s-0-121", "value = 2"));
        assert_eq!(titles(of_sercos(&twice)), ["the parameter S-0-0121 is used twice"]);
        assert_eq!(
            titles(of_sercos("startup_file = \"\"")),
            ["the path of the start-up list of a drive is empty"]
        );
    }
}
