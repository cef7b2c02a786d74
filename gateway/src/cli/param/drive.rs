//! The drive of an axis: requests of the local socket, and what their replies mean. A gateway answers them, or the drive itself
//! over its bus.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use serde::Serialize;

use super::At;
use super::alone::Alone;
use crate::cli::gateway_client::GatewayClient;
pub use crate::cli::gateway_client::Reply;
use crate::cli::{CliError, signal};
use crate::local::drive::CommandReport;
use crate::local::drive::job::{Act, Listing, ParameterReport};
use crate::parameter::id::Id;

/// How long a drive may take for a request: several accesses, each of which the gateway gives up after a second or so.
const PATIENCE: Duration = Duration::from_secs(30);

/// Answers requests: a gateway, or the drive itself.
pub trait Link {
    /// The reply to a request.
    fn ask(&mut self, request: &str) -> Result<Reply, CliError>;

    /// A flag that is set once the user wants an end.
    fn stop(&mut self) -> Result<Arc<AtomicBool>, CliError>;

    /// Whether it is the drive itself, without a gateway.
    fn is_alone(&self) -> bool;
}

impl Link for GatewayClient {
    fn ask(&mut self, request: &str) -> Result<Reply, CliError> {
        Self::ask(self, request)
    }

    fn stop(&mut self) -> Result<Arc<AtomicBool>, CliError> {
        signal::stop_on_signals()
    }

    fn is_alone(&self) -> bool {
        false
    }
}

/// The drive of an axis.
pub struct Drive {
    link: Box<dyn Link>,
    axis: String,
}

/// What came of a request.
#[derive(Debug)]
pub enum Found<T = ParameterReport> {
    /// The parameter, or the command.
    Report(Box<T>),
    /// The gateway or the drive refused.
    Refused(Refused),
}

/// Why something was refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refused {
    /// The code of the reply.
    pub code: String,
    /// Its text.
    pub text: String,
}

impl Refused {
    /// Whether asking for other parameters makes no sense either.
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
#[derive(Debug, Serialize)]
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
    pub fn detail(&self, key: &str) -> &str {
        self.details.get(key).map_or("", String::as_str)
    }
}

impl Drive {
    /// Connects to the gateway, or takes the bus up.
    pub fn connect(at: &At) -> Result<Self, CliError> {
        let axis = at.axis.clone();
        if axis.is_empty() || axis.chars().any(|letter| letter.is_whitespace() || letter.is_control()) {
            return Err(format!("`{}` is not the name of an axis", axis.escape_debug()).into());
        }
        let link: Box<dyn Link> = match &at.config {
            Some(config) => Box::new(Alone::open(config, &axis)?),
            None => Box::new(GatewayClient::connect(&at.local, PATIENCE)?),
        };
        Ok(Self { link, axis })
    }

    /// A flag that is set once the user wants an end.
    pub fn stop(&mut self) -> Result<Arc<AtomicBool>, CliError> {
        self.link.stop()
    }

    /// Whether no gateway runs between this and the drive.
    pub fn is_alone(&self) -> bool {
        self.link.is_alone()
    }

    /// The name of the axis.
    pub fn axis(&self) -> &str {
        &self.axis
    }

    /// Reads a parameter; `brief` without unit and limits.
    pub fn read(&mut self, parameter: &str, brief: bool) -> Result<Found, CliError> {
        let brief = if brief && Id::parse(parameter).is_some() { " brief" } else { "" };
        self.parameter("read", &format!("{}{brief}", word(parameter)?))
    }

    /// Writes a parameter, and reads it back.
    pub fn write(&mut self, parameter: &str, value: &str) -> Result<Found, CliError> {
        if value.chars().any(char::is_control) {
            return Err(
                "a value of one line without control characters is expected; hex:BYTES has no limits".into(),
            );
        }
        let written = self.parameter("write", &format!("{} {value}", word(parameter)?))?;
        if Id::parse(parameter).is_some() || matches!(written, Found::Refused(_)) {
            // Read back by the gateway.
            return Ok(written);
        }
        let found = self.read(parameter, false)?;
        Ok(match found {
            Found::Report(report) if Some(report.value.as_str()) != whole(value).as_deref() => {
                Found::Refused(Refused {
                    code: "not-kept".to_owned(),
                    text: format!("the drive took {parameter} = {value} and has {} afterwards", report.value),
                })
            }
            found => found,
        })
    }

    /// Starts a procedure command, asks how far it is, or cancels it.
    pub fn command(&mut self, command: &str, act: Act) -> Result<Found<CommandReport>, CliError> {
        let read = |words: &str| serde_json::from_str::<CommandReport>(words).ok();
        let mut found = self.ask("command", &format!("{} {}", word(command)?, act.word()), read)?;
        if let Found::Report(report) = &mut found {
            report.recommission &= !self.is_alone();
        }
        Ok(found)
    }

    /// The parameters that are known, or some of them.
    pub fn list(&mut self, of: Listing) -> Result<List, CliError> {
        let of = match of {
            Listing::All => "",
            Listing::Backup => " backup",
            Listing::Commands => " commands",
        };
        let reply = self.link.ask(&format!("list {}{of}", self.axis))?;
        let Some(words) = reply.last.strip_prefix(&format!("ok list {} ", self.axis)) else {
            return Err(refused(&reply.last).text.into());
        };
        let find = |key: &str| words.split(' ').find_map(|word| word.strip_prefix(key)).unwrap_or_default();
        Ok(List {
            axis: self.axis.clone(),
            bus: find("bus=").to_owned(),
            source: find("source=").to_owned(),
            parameters: reply.lines.iter().filter_map(|line| Listed::parse(line)).collect(),
        })
    }

    /// A request for a parameter.
    fn parameter(&mut self, request: &str, rest: &str) -> Result<Found, CliError> {
        let mut found = self.ask(request, rest, report)?;
        if let Found::Report(report) = &mut found {
            // Without a gateway the drive is commissioned at the next start in any case.
            report.recommission &= !self.is_alone();
        }
        Ok(found)
    }

    fn ask<T>(
        &mut self,
        request: &str,
        rest: &str,
        read: impl FnOnce(&str) -> Option<T>,
    ) -> Result<Found<T>, CliError> {
        let reply = self.link.ask(&format!("{request} {} {rest}", self.axis))?.last;
        let Some(words) = reply.strip_prefix(&format!("ok {request} {} ", self.axis)) else {
            return Ok(Found::Refused(refused(&reply)));
        };
        read(words)
            .map(|report| Found::Report(Box::new(report)))
            .ok_or_else(|| format!("unexpected reply `{reply}`").into())
    }
}

/// The parameter of a reply: an object, or `NAME=VALUE unit=UNIT`.
fn report(words: &str) -> Option<ParameterReport> {
    if words.starts_with('{') {
        return serde_json::from_str(words).ok();
    }
    let mut words = words.split(' ');
    let (id, value) = words.next()?.split_once('=')?;
    let unit = words.find_map(|word| word.strip_prefix("unit=")).map(str::to_owned);
    Some(ParameterReport { id: id.to_owned(), value: value.to_owned(), unit, ..ParameterReport::default() })
}

/// Takes `error WORD AXIS CODE: TEXT` apart.
fn refused(reply: &str) -> Refused {
    let parts = reply.strip_prefix("error ").and_then(|rest| {
        let (head, text) = rest.split_once(": ")?;
        Some((head.rsplit(' ').next()?, text))
    });
    let (code, text) = parts.unwrap_or(("", reply));
    Refused { code: code.to_owned(), text: text.to_owned() }
}

/// A parameter that can be a word of a request.
fn word(parameter: &str) -> Result<&str, CliError> {
    match parameter.is_empty()
        || parameter.chars().any(|letter| letter.is_whitespace() || letter.is_control())
    {
        true => {
            Err(format!("`{}` is neither name nor number of a parameter", parameter.escape_debug()).into())
        }
        false => Ok(parameter),
    }
}

/// A whole number as the gateway shows it.
fn whole(value: &str) -> Option<String> {
    value.parse::<i64>().ok().map(|value| value.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replies_are_taken_apart() {
        let refused = refused("error write turntable value: S-0-0100: the drive refuses: it");
        assert_eq!(
            (refused.code.as_str(), refused.text.as_str()),
            ("value", "S-0-0100: the drive refuses: it")
        );
        assert_eq!(super::refused("what").text, "what");
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
    }
}
