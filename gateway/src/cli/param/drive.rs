//! The drive of an axis: requests of the local socket, and what their replies mean. A gateway answers them, or the drive itself
//! over its bus.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use super::At;
use super::alone::Alone;
use crate::cli::gateway_client::GatewayClient;
pub use crate::cli::gateway_client::Reply;
use crate::cli::{CliError, signal};
use crate::local::drive::CommandReport;
use crate::local::drive::job::{Act, Listing, ParameterReport, RECOMMISSION};
use crate::local::drive::reply::report;
pub use crate::local::drive::reply::{List, Listed, Refused};
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
        let lines = reply.lines.iter().map(String::as_str);
        List::parse(&self.axis, lines, &reply.last).map_err(|refused| refused.text.into())
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
            let mut refused = Refused::parse(&reply);
            if self.is_alone()
                && let Some(text) = refused.text.strip_suffix(RECOMMISSION)
            {
                refused.text = text.to_owned();
            }
            return Ok(Found::Refused(refused));
        };
        read(words)
            .map(|report| Found::Report(Box::new(report)))
            .ok_or_else(|| format!("unexpected reply `{reply}`").into())
    }
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
