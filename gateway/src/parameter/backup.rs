//! The file of a backup: the drive, and each of its parameters with the bytes that it has.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::id::Id;
use super::value::unhex;
use crate::replace_file::replace_file;

/// The format of the files that are written, and the only one that is read.
pub const FORMAT: u32 = 1;

/// Longest file, bytes.
pub const BYTES_MAX: u64 = 64 * 1_024 * 1_024;

/// What a drive is asked about itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Question {
    /// What it is called in the file.
    pub key: &'static str,
    /// The number of the parameter that answers it.
    pub id: &'static str,
    /// Whether drives of one type agree in it.
    pub of_type: bool,
}

const fn question(key: &'static str, id: &'static str, of_type: bool) -> Question {
    Question { key, id, of_type }
}

const SERCOS: &[Question] = &[
    question("vendor_name", "S-0-1300.0.2", false),
    question("vendor_code", "S-0-1300.0.3", true),
    question("device_name", "S-0-1300.0.4", false),
    question("device_id", "S-0-1300.0.5", true),
    question("hardware_revision", "S-0-1300.0.8", false),
    question("software_revision", "S-0-1300.0.9", false),
    question("serial_number", "S-0-1300.0.12", false),
    question("firmware", "S-0-0030", false),
    question("controller_type", "S-0-0140", true),
];
const CANOPEN: &[Question] = &[
    question("device_type", "1000:00", true),
    question("device_name", "1008:00", false),
    question("hardware_version", "1009:00", false),
    question("software_version", "100A:00", false),
    question("vendor", "1018:01", true),
    question("product", "1018:02", true),
    question("revision", "1018:03", false),
    question("serial_number", "1018:04", false),
];
const DEVICENET: &[Question] = &[
    question("vendor", "1.1.1", true),
    question("device_type", "1.1.2", true),
    question("product_code", "1.1.3", true),
    question("revision", "1.1.4", false),
    question("serial_number", "1.1.6", false),
    question("product_name", "1.1.7", false),
];

/// What the drives of a bus are asked, by the word for the bus in the file.
#[must_use]
pub fn questions(bus: &str) -> &'static [Question] {
    match bus {
        "sercos" => SERCOS,
        "canopen" => CANOPEN,
        _ => DEVICENET,
    }
}

/// The first line of a file.
const HEAD: &str = "# Parameters of a drive, written by `axisbridge param backup`. `restore` and `compare` use `data`: the bytes of the drive.\n\n";

/// A backup. Where findings show places of the file, its texts `T` and its number `N` know theirs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Backup<T = String, N = u32> {
    /// Format of the file.
    pub format: N,
    /// The axis that the drive was on.
    pub axis: String,
    /// The kind of its bus.
    pub bus: T,
    /// Where the list of parameters is from.
    pub source: String,
    /// Who the drive is.
    pub drive: Identity,
    /// The parameters that could be read.
    #[serde(default = "Vec::new")]
    pub parameter: Vec<Kept<T>>,
    /// Those that could not.
    #[serde(default = "Vec::new", skip_serializing_if = "Vec::is_empty")]
    pub unread: Vec<Unread<T>>,
}

/// Who a drive is: what it says about itself, by what it is.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Identity(pub BTreeMap<String, String>);

/// A parameter.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kept<T = String> {
    /// Its number.
    pub id: T,
    /// Its name, for people.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Its type, for people; empty where nobody says.
    #[serde(default, skip_serializing_if = "String::is_empty", rename = "type")]
    pub kind: String,
    /// Its value, for people.
    #[serde(default)]
    pub value: String,
    /// Its unit, for people and for drives that are like this one.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// The attribute of an IDN, `0x01110001`; empty where there is none.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub attribute: String,
    /// The least value; empty where nobody says.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub minimum: String,
    /// The greatest value; empty where nobody says.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub maximum: String,
    /// Its bytes, two hexadecimal digits each.
    pub data: T,
}

/// A parameter of the list that could not be read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Unread<T = String> {
    /// Its number.
    pub id: T,
    /// Why not.
    pub why: String,
}

impl Identity {
    /// In what two drives are of another type: what it is called, and what they say.
    pub fn differences<'a>(&'a self, other: &'a Self, bus: &str) -> Vec<(&'static str, &'a str, &'a str)> {
        let of_type = questions(bus).iter().filter(|question| question.of_type);
        let pairs = of_type.map(|question| {
            let text = |identity: &'a Self| identity.0.get(question.key).map_or("nothing", String::as_str);
            (question.key, text(self), text(other))
        });
        // Earlier versions wrote texts in Latin-1 without a mark.
        let bare = |text: &'a str| text.strip_prefix("latin1:").unwrap_or(text);
        pairs.filter(|(_, one, other)| bare(one) != bare(other)).collect()
    }
}

impl Backup {
    /// A backup without parameters.
    pub fn new(axis: &str, bus: &str, source: &str, drive: Identity) -> Self {
        let [axis, bus, source] = [axis, bus, source].map(str::to_owned);
        Self { format: FORMAT, axis, bus, source, drive, parameter: Vec::new(), unread: Vec::new() }
    }

    /// The text of its file.
    ///
    /// # Errors
    /// What cannot be written as TOML.
    pub fn to_text(&self) -> Result<String, String> {
        toml::to_string(self).map(|text| format!("{HEAD}{text}")).map_err(|error| error.to_string())
    }

    /// Reads a text.
    ///
    /// # Errors
    /// It is no backup, has another format, or a parameter without a number or bytes.
    pub fn parse(text: &str) -> Result<Self, String> {
        let backup: Self = toml::from_str(text).map_err(|error| error.to_string().trim_end().to_owned())?;
        if backup.format != FORMAT {
            return Err(format!("the file has format {}: expected {FORMAT}", backup.format));
        }
        for kept in &backup.parameter {
            if Id::parse(&kept.id).is_none() {
                return Err(format!("`{}` is not the number of a parameter", kept.id.escape_debug()));
            }
            if unhex(&kept.data).is_none() {
                return Err(format!("the data of {} are not bytes of two hexadecimal digits", kept.id));
            }
        }
        Ok(backup)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// It cannot be read, is too long, or as [`Backup::parse`].
    pub fn load(path: &Path) -> Result<Self, String> {
        let fail = |error: String| format!("{}: {error}", path.display());
        let len = std::fs::metadata(path).map_err(|error| fail(error.to_string()))?.len();
        if len > BYTES_MAX {
            return Err(fail(format!("the file has more than {BYTES_MAX} bytes")));
        }
        let text = std::fs::read_to_string(path).map_err(|error| fail(error.to_string()))?;
        Self::parse(&text).map_err(fail)
    }

    /// Writes a file, whole or not at all.
    ///
    /// # Errors
    /// The system refuses it.
    pub fn save(&self, path: &Path) -> Result<(), String> {
        let text = self.to_text()?;
        replace_file(path, &text).map_err(|error| format!("{}: {error}", path.display()))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A parameter with everything that a backup keeps of one.
    pub fn kept() -> Kept {
        Kept {
            id: "S-0-0104".to_owned(),
            name: "Position loop Kv-factor".to_owned(),
            kind: "2 byte unsigned, 2 decimals".to_owned(),
            value: "1.50".to_owned(),
            unit: "1000/min".to_owned(),
            attribute: "0x02110001".to_owned(),
            minimum: "0.01".to_owned(),
            maximum: "655.35".to_owned(),
            data: "9600".to_owned(),
        }
    }

    fn identity(pairs: &[(&str, &str)]) -> Identity {
        Identity(pairs.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect())
    }

    fn backup() -> Backup {
        let drive = identity(&[("device_id", "D-1 \"x\""), ("vendor_code", "0x0539")]);
        let unread = Unread { id: "P-0-0001".to_owned(), why: "the drive refuses it".to_owned() };
        Backup {
            parameter: vec![kept()],
            unread: vec![unread],
            ..Backup::new("turntable", "sercos", "S-0-0192", drive)
        }
    }

    #[test]
    fn a_file_is_text_and_comes_back() {
        let text = backup().to_text().unwrap();
        insta::assert_snapshot!(text);
        assert_eq!(Backup::parse(&text).unwrap(), backup());
    }

    #[test]
    fn what_is_wrong_in_a_file_is_named() {
        let text = backup().to_text().unwrap();
        let refused = |from: &str, to: &str| {
            assert!(text.contains(from), "{from}");
            Backup::parse(&text.replacen(from, to, 1)).expect_err(to).to_string()
        };
        assert_eq!(refused("format = 1", "format = 2"), "the file has format 2: expected 1");
        assert_eq!(refused("S-0-0104", "S-0"), "`S-0` is not the number of a parameter");
        assert_eq!(
            refused("\"9600\"", "\"960\""),
            "the data of S-0-0104 are not bytes of two hexadecimal digits"
        );
        assert!(refused("data = ", "date = ").contains("unknown field `date`"));
        assert!(Backup::parse("").is_err());
    }

    #[test]
    fn drives_of_one_type_differ_in_serial_number_only() {
        let one =
            identity(&[("vendor", "1"), ("product", "2"), ("serial_number", "3"), ("device_type", "4")]);
        let other =
            identity(&[("vendor", "1"), ("product", "2"), ("serial_number", "9"), ("device_type", "4")]);
        assert_eq!(one.differences(&other, "canopen"), []);
        let third = identity(&[("vendor", "1"), ("product", "5"), ("serial_number", "3")]);
        assert_eq!(
            one.differences(&third, "canopen"),
            [("device_type", "4", "nothing"), ("product", "2", "5")]
        );
    }
}
