//! What the replies to requests for parameters say: for the programs that ask, and for the page.

use std::fmt;

use serde::Serialize;

use super::job::ParameterReport;

/// Why something was refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refused {
    /// The code of the reply.
    pub code: String,
    /// Its text.
    pub text: String,
}

impl Refused {
    /// Takes `error WORD AXIS CODE: TEXT` apart.
    #[must_use]
    pub fn parse(reply: &str) -> Self {
        let parts = reply.strip_prefix("error ").and_then(|rest| {
            let (head, text) = rest.split_once(": ")?;
            Some((head.rsplit(' ').next()?, text))
        });
        let (code, text) = parts.unwrap_or(("", reply));
        Self { code: code.to_owned(), text: text.to_owned() }
    }

    /// Whether asking for other parameters makes no sense either.
    #[must_use]
    pub fn ends_all(&self) -> bool {
        ["unanswered", "ending", "no-axis", "controller", "held", "torque"].contains(&self.code.as_str())
    }
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// The parameters that are known of a drive.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub struct List {
    /// The axis.
    pub axis: String,
    /// The kind of its bus.
    pub bus: String,
    /// Where the list is from.
    pub source: String,
    /// The parameters, in the order of the list.
    pub parameters: Vec<Listed>,
}

impl List {
    /// Reads the lines of a list, and the line that ends it.
    ///
    /// # Errors
    /// The list was refused.
    pub fn parse<'l>(
        axis: &str,
        lines: impl IntoIterator<Item = &'l str>,
        last: &str,
    ) -> Result<Self, Refused> {
        let words =
            last.strip_prefix(&format!("ok list {axis} ")).ok_or_else(|| Refused::parse(last.trim_end()))?;
        let find = |key: &str| {
            words.split_ascii_whitespace().find_map(|word| word.strip_prefix(key)).unwrap_or_default()
        };
        Ok(Self {
            axis: axis.to_owned(),
            bus: find("bus=").to_owned(),
            source: find("source=").to_owned(),
            parameters: lines.into_iter().filter_map(Listed::parse).collect(),
        })
    }
}

/// A parameter of a list.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub struct Listed {
    /// Its number or name.
    pub id: String,
    /// What else is known of it: access, type, unit, limits.
    #[serde(flatten)]
    pub details: std::collections::BTreeMap<String, String>,
}

impl Listed {
    /// Reads `parameter ID NAME=VALUE ... name=REST`.
    fn parse(line: &str) -> Option<Self> {
        let line = line.strip_prefix("parameter ")?;
        let (words, name) = match line.split_once(" name=") {
            Some((words, name)) => (words, Some(name)),
            None => (line, None),
        };
        let mut words = words.split(' ');
        let id = words.next().filter(|id| !id.is_empty())?.to_owned();
        let pairs = words.filter_map(|word| word.split_once('='));
        let pairs = pairs.chain(name.map(|name| ("name", name)));
        Some(Self { id, details: pairs.map(|(key, value)| (key.to_owned(), value.to_owned())).collect() })
    }

    /// What is known under a key; empty when nothing is.
    #[must_use]
    pub fn detail(&self, key: &str) -> &str {
        self.details.get(key).map_or("", String::as_str)
    }
}

/// The parameter of a reply: an object, or `NAME=VALUE unit=UNIT`.
#[must_use]
pub fn report(words: &str) -> Option<ParameterReport> {
    if words.starts_with('{') {
        return serde_json::from_str(words).ok();
    }
    let mut words = words.split(' ');
    let (id, value) = words.next()?.split_once('=')?;
    let unit = words.find_map(|word| word.strip_prefix("unit=")).map(str::to_owned);
    Some(ParameterReport { id: id.to_owned(), value: value.to_owned(), unit, ..ParameterReport::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replies_are_taken_apart() {
        let refused = Refused::parse("error write turntable value: S-0-0100: the drive refuses: it");
        assert_eq!(
            (refused.code.as_str(), refused.text.as_str()),
            ("value", "S-0-0100: the drive refuses: it")
        );
        assert_eq!(Refused::parse("what").text, "what");
        let named = report("notch_frequency=120000 unit=mHz").unwrap();
        assert_eq!((named.id.as_str(), named.value.as_str()), ("notch_frequency", "120000"));
        assert_eq!(named.unit.as_deref(), Some("mHz"));
        let object = report(r#"{"id":"6081:00","type":"u32","value":"5","data":"05000000"}"#).unwrap();
        assert_eq!((object.kind.as_deref(), object.value.as_str()), (Some("u32"), "5"));
        assert_eq!(report("{"), None);
        assert_eq!(report("5"), None);
    }

    #[test]
    fn lines_of_a_list_are_taken_apart() {
        let listed =
            Listed::parse("parameter 6081:00 access=rw type=u32 name=Profile velocity = max").unwrap();
        assert_eq!(listed.id, "6081:00");
        assert_eq!(
            ["access", "type", "unit", "name"].map(|key| listed.detail(key)),
            ["rw", "u32", "", "Profile velocity = max"]
        );
        assert_eq!(Listed::parse("parameter P-0-0001").unwrap().id, "P-0-0001");
        assert_eq!(Listed::parse("parameter "), None);
        assert_eq!(Listed::parse("axis x"), None);
        let list =
            List::parse("x", ["parameter P-0-0001"], "ok list x 1 bus=sercos source=S-0-0017\n").unwrap();
        assert_eq!((list.bus.as_str(), list.source.as_str()), ("sercos", "S-0-0017"));
        assert_eq!(list.parameters.len(), 1);
        let refused = List::parse("x", [], "error list x absent: S-0-0017: no\n").unwrap_err();
        assert_eq!((refused.code.as_str(), refused.text.as_str()), ("absent", "S-0-0017: no"));
    }
}
