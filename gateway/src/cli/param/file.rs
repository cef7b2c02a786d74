//! The file of a backup: the drive, and each of its parameters with the bytes that it has.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::drive::{Drive, Found, Refused};
use crate::cli::CliError;
use crate::local::drive::job::ParameterReport;
use crate::parameter::backup::{BYTES_MAX, FORMAT, questions};
use crate::parameter::id::Id;
use crate::parameter::value::unhex;
use crate::replace_file::replace_file;

/// The first line of a file.
const HEAD: &str = "# Parameters of a drive, written by `axisbridge param backup`. `restore` and `compare` use `data`: the bytes of the drive.\n\n";

/// A backup.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Backup {
    /// Format of the file.
    pub format: u32,
    /// The axis that the drive was on.
    pub axis: String,
    /// The kind of its bus.
    pub bus: String,
    /// Where the list of parameters is from.
    pub source: String,
    /// Who the drive is.
    pub drive: Identity,
    /// The parameters that could be read.
    #[serde(default)]
    pub parameter: Vec<Kept>,
    /// Those that could not.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unread: Vec<Unread>,
}

/// Who a drive is: what it says about itself, by what it is.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Identity(pub BTreeMap<String, String>);

/// A parameter.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kept {
    /// Its number.
    pub id: String,
    /// Its name, for people.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
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
    pub data: String,
}

/// A parameter of the list that could not be read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Unread {
    /// Its number.
    pub id: String,
    /// Why not.
    pub why: String,
}

impl From<ParameterReport> for Kept {
    fn from(report: ParameterReport) -> Self {
        let ParameterReport { id, name, value, data, unit, attribute, minimum, maximum, .. } = report;
        Self {
            id,
            name: name.unwrap_or_default(),
            value,
            unit: unit.unwrap_or_default(),
            attribute: attribute.unwrap_or_default(),
            minimum: minimum.unwrap_or_default(),
            maximum: maximum.unwrap_or_default(),
            data,
        }
    }
}

impl Identity {
    /// What a drive says about itself. It need not have all of it.
    pub fn of(drive: &mut Drive, bus: &str) -> Result<Self, CliError> {
        let mut identity = Self::default();
        for question in questions(bus) {
            match drive.read(question.id, true)? {
                Found::Report(report) => {
                    identity.0.insert(question.key.to_owned(), report.value);
                }
                Found::Refused(refused) if refused.ends_all() => return Err(refused.text.into()),
                Found::Refused(_) => {}
            }
        }
        Ok(identity)
    }

    /// In what two drives are of another type: what it is called, and what they say.
    pub fn differences<'a>(&'a self, other: &'a Self, bus: &str) -> Vec<(&'static str, &'a str, &'a str)> {
        let of_type = questions(bus).iter().filter(|question| question.of_type);
        let pairs = of_type.map(|question| {
            let text = |identity: &'a Self| identity.0.get(question.key).map_or("nothing", String::as_str);
            (question.key, text(self), text(other))
        });
        pairs.filter(|(_, one, other)| one != other).collect()
    }
}

impl Backup {
    /// A backup without parameters.
    pub fn new(axis: &str, bus: &str, source: &str, drive: Identity) -> Self {
        let [axis, bus, source] = [axis, bus, source].map(str::to_owned);
        Self { format: FORMAT, axis, bus, source, drive, parameter: Vec::new(), unread: Vec::new() }
    }

    /// The text of its file.
    pub fn to_text(&self) -> Result<String, CliError> {
        Ok(format!("{HEAD}{}", toml::to_string(self)?))
    }

    /// Reads a text.
    pub fn parse(text: &str) -> Result<Self, CliError> {
        let backup: Self = toml::from_str(text).map_err(|error| error.to_string().trim_end().to_owned())?;
        if backup.format != FORMAT {
            return Err(format!("the file has format {}: expected {FORMAT}", backup.format).into());
        }
        for kept in &backup.parameter {
            if Id::parse(&kept.id).is_none() {
                return Err(format!("`{}` is not the number of a parameter", kept.id.escape_debug()).into());
            }
            if unhex(&kept.data).is_none() {
                return Err(format!("the data of {} are not bytes of two hexadecimal digits", kept.id).into());
            }
        }
        Ok(backup)
    }

    /// Reads a file.
    pub fn load(path: &Path) -> Result<Self, CliError> {
        let fail = |error: String| format!("{}: {error}", path.display());
        let len = std::fs::metadata(path).map_err(|error| fail(error.to_string()))?.len();
        if len > BYTES_MAX {
            return Err(fail(format!("the file has more than {BYTES_MAX} bytes")).into());
        }
        let text = std::fs::read_to_string(path).map_err(|error| fail(error.to_string()))?;
        Self::parse(&text).map_err(|error| fail(error.to_string()).into())
    }

    /// Writes a file, whole or not at all.
    pub fn save(&self, path: &Path) -> Result<(), CliError> {
        let text = self.to_text()?;
        Ok(replace_file(path, &text).map_err(|error| format!("{}: {error}", path.display()))?)
    }

    /// Whether the drive of an axis can have these parameters: the bus must be the same, and the type of the drive, unless it is
    /// forced.
    pub fn is_for(&self, drive: &mut Drive, force: bool) -> Result<(), CliError> {
        let bus = drive.list(true)?.bus;
        if self.bus != bus {
            return Err(format!("the backup is of a drive on {}, and this one is on {bus}", self.bus).into());
        }
        let found = Identity::of(drive, &bus)?;
        let differences = self.drive.differences(&found, &bus);
        if differences.is_empty() || force {
            return Ok(());
        }
        let texts = differences
            .iter()
            .map(|(key, of_file, found)| format!("\n  {key}: {of_file} in the backup, {found} in the drive"));
        Err(format!("the backup is of another type of drive:{}", texts.collect::<String>()).into())
    }
}

/// A refusal as it is kept.
impl Unread {
    /// Why a parameter could not be read.
    pub fn new(id: &str, refused: &Refused) -> Self {
        Self { id: id.to_owned(), why: refused.text.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn identity(pairs: &[(&str, &str)]) -> Identity {
        Identity(pairs.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect())
    }

    fn backup() -> Backup {
        let drive = identity(&[("device_id", "D-1 \"x\""), ("vendor_code", "0x0539")]);
        let kept = Kept {
            id: "S-0-0104".to_owned(),
            name: "Position loop Kv-factor".to_owned(),
            value: "1.50".to_owned(),
            unit: "1000/min".to_owned(),
            attribute: "0x02110001".to_owned(),
            minimum: "0.01".to_owned(),
            maximum: "655.35".to_owned(),
            data: "9600".to_owned(),
        };
        let unread = Unread { id: "P-0-0001".to_owned(), why: "the drive refuses it".to_owned() };
        Backup {
            parameter: vec![kept],
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
        let told = |from: &str, to: &str| {
            assert!(text.contains(from), "{from}");
            Backup::parse(&text.replacen(from, to, 1)).expect_err(to).to_string()
        };
        assert_eq!(told("format = 1", "format = 2"), "the file has format 2: expected 1");
        assert_eq!(told("S-0-0104", "S-0"), "`S-0` is not the number of a parameter");
        assert_eq!(
            told("\"9600\"", "\"960\""),
            "the data of S-0-0104 are not bytes of two hexadecimal digits"
        );
        assert!(told("data = ", "date = ").contains("unknown field `date`"));
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
