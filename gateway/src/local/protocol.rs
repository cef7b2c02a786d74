//! The text protocol of local control: one request a line, one reply a request.
//!
//! ```text
//! request:  WORD AXIS [VALUE] [NAME=VALUE ...]
//! reply:    ok WORD AXIS [NAME=VALUE ...]
//!           error WORD AXIS CODE: TEXT
//! ```
//!
//! Values are decimal numbers in the units of the axis: revolutions or millimetres, and seconds. Those of parameters with a name
//! are whole numbers in the unit of the parameter; those with the number of a drive are in [`super::drive`].

use std::fmt::Write as _;

use profile_generic::parameter::{Access, Parameter};
use profile_generic::quantity::{Acceleration, Position, Velocity};
use profile_generic::ratio::{Ratio, Rounding};
use profile_generic::time::DurationNs;
use serde::Serialize;

use super::drive::job::{Act, Ask, Listing};
use crate::config::{AxisKind, LogLevel};
use crate::engine::local::{Failure, Generator, JOG_TIME, Jog, Move, Order};
use crate::history::{LINES_MAX, LogQuery};
use crate::mapping::Mapping;
use crate::parameter::id::Id;
use crate::status::AxisStatus;

/// Longest request, bytes; what is longer is refused and skipped. A value of 2000 bytes fits, written as `hex:`.
pub const LINE_MAX: usize = 4_096;

/// Nanounits in a unit.
const NANO: i64 = 1_000_000_000;

/// A parameter that clients can read and write by its name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedParameter {
    /// Its name in the tables.
    pub name: String,
    /// Its number.
    pub parameter: Parameter,
    /// The unit of its values; empty for a bare number.
    pub unit: &'static str,
    /// When it may be written.
    pub access: Access,
    /// Least and greatest value.
    pub range: Option<(i64, i64)>,
}

impl NamedParameter {
    /// Those of the generic model and those that the overlays of a gateway define, in the order of their numbers.
    #[must_use]
    pub fn of(mapping: &Mapping) -> Vec<Self> {
        let rows = mapping.dictionaries.generic.parameters().iter();
        let mut parameters: Vec<Self> = rows
            .map(|row| Self {
                name: row.name.clone(),
                parameter: row.parameter,
                unit: row.quantity.unit(),
                access: row.access,
                range: row.range,
            })
            .collect();
        parameters.sort_by_key(|row| row.parameter);
        parameters
    }
}

/// A request of a client.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Request {
    /// Show the whole gateway.
    Box,
    /// List the axes.
    Axes,
    /// List the parameters.
    Parameters,
    /// Show lines of the log.
    Log(LogQuery),
    /// List the faults.
    Faults {
        /// Position of the axis in the configuration, from 0; all axes without it.
        axis: Option<usize>,
    },
    /// List the attributes of an axis, by what its drive has.
    Attributes {
        /// Position of the axis in the configuration, from 0.
        axis: usize,
    },
    /// List the first contacts.
    Contacts,
    /// Send a file.
    File(FileRequest),
    /// Read or write a parameter.
    Parameter {
        /// Position of the axis in the configuration, from 0.
        axis: usize,
        /// Position of the parameter in the list.
        parameter: usize,
        /// What is written; `None` reads.
        wanted: Option<i64>,
    },
    /// Read, write or list parameters of a drive by its numbers, or execute a command.
    Drive {
        /// Position of the axis in the configuration, from 0.
        axis: usize,
        /// What is asked for.
        ask: Ask,
    },
    /// Show the state of an axis.
    Status {
        /// Position of the axis in the configuration, from 0.
        axis: usize,
    },
    /// Give an order.
    Order {
        /// Position of the axis in the configuration, from 0.
        axis: usize,
        /// What is to be done.
        order: Order,
    },
}

/// A file that a client asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileRequest {
    /// The frames of the last seconds of all sides; all that are kept without a length.
    Recording(Option<DurationNs>),
    /// The frames of a first contact.
    Contact(u64),
    /// The diagnostics bundle.
    Bundle,
}

impl FileRequest {
    /// The word of the request.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Recording(_) => "record",
            Self::Contact(_) => "contact",
            Self::Bundle => "bundle",
        }
    }
}

/// Why a line is not a request.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BadRequest {
    /// The first word is none of the protocol's.
    #[error(
        "unknown word `{0}`: expected box, axes, status, log, faults, attributes, contacts, contact, record, bundle, enable, disable, stop, reset, jog, move, home, parameters, list, read, write or command"
    )]
    Word(String),
    /// The word needs an axis.
    #[error("`{0}` needs the name of an axis")]
    NoAxis(&'static str),
    /// There is no axis of this name.
    #[error("unknown axis `{name}`: expected {known}")]
    Axis {
        /// The name in the request.
        name: String,
        /// The names of all axes.
        known: String,
    },
    /// There is no parameter of this name.
    #[error(
        "unknown parameter `{name}`: expected a name that `list` shows, or a number such as S-0-0100, 6081h or 1.1.7"
    )]
    Parameter {
        /// The name in the request.
        name: String,
    },
    /// The text is not a whole number.
    #[error("`{0}` is not a whole number of 64 bits")]
    Whole(String),
    /// A value is missing.
    #[error("`{word}` needs {what}")]
    Missing {
        /// The order or key whose value is missing.
        word: &'static str,
        /// The value.
        what: &'static str,
    },
    /// The text of a value is not a number of its range.
    #[error(
        "`{text}` is not {what}: expected a decimal number of at most 9 digits before and after the point"
    )]
    Number {
        /// The text.
        text: String,
        /// The value.
        what: &'static str,
    },
    /// A word too many, or a name that this request does not have.
    #[error("unexpected `{text}`: expected {expected}")]
    Unexpected {
        /// The text.
        text: String,
        /// What may stand there.
        expected: &'static str,
    },
    /// More lines of the log than there are in an answer, or none.
    #[error("unexpected `{text}`: expected lines=1 to lines={most}")]
    Lines {
        /// The text.
        text: String,
        /// How many there can be.
        most: usize,
    },
    /// The line is too long.
    #[error("the line is longer than {LINE_MAX} bytes")]
    TooLong,
    /// The line is not printable text.
    #[error("the line is not printable UTF-8 text")]
    NotText,
    /// The client has too many orders without an answer.
    #[error("too many orders without an answer")]
    TooMany,
}

impl BadRequest {
    /// The code in the reply. Codes never change.
    #[must_use]
    pub const fn code(&self) -> &'static str {
        match self {
            Self::Axis { .. } | Self::NoAxis(_) => "no-axis",
            Self::Parameter { .. } => "no-parameter",
            Self::TooMany => "busy",
            _ => "syntax",
        }
    }
}

/// Reads a line. `axes` are the names of the axes in the order of the configuration, `parameters` those that clients can access.
///
/// # Errors
/// [`BadRequest`]; nothing is done then.
pub fn parse(line: &str, axes: &[String], parameters: &[NamedParameter]) -> Result<Request, BadRequest> {
    let mut words = line.split_ascii_whitespace();
    let word = words.next().unwrap_or_default();
    let request = match word {
        "box" => Request::Box,
        "axes" => Request::Axes,
        "parameters" => Request::Parameters,
        "log" => Request::Log(log_query(&mut words, axes, LINES_MAX)?),
        "faults" => {
            let name = words.next();
            Request::Faults {
                axis: name.map(|name| axis("faults", &mut std::iter::once(name), axes)).transpose()?,
            }
        }
        "attributes" => Request::Attributes { axis: axis("attributes", &mut words, axes)? },
        "contacts" => Request::Contacts,
        "contact" => Request::File(FileRequest::Contact(contact_query(&mut words)?)),
        "record" => Request::File(FileRequest::Recording(recording_query(&mut words)?)),
        "bundle" => Request::File(FileRequest::Bundle),
        "read" => access("read", &mut words, axes, parameters)?,
        "write" => match direct_write(line, axes)? {
            Some(request) => return Ok(request),
            None => access("write", &mut words, axes, parameters)?,
        },
        "list" => {
            let axis = axis("list", &mut words, axes)?;
            Request::Drive { axis, ask: Ask::List { of: listing(&mut words)? } }
        }
        "command" => command(&mut words, axes)?,
        "status" => Request::Status { axis: axis("status", &mut words, axes)? },
        _ => {
            let word = ["enable", "disable", "stop", "reset", "jog", "move", "home"]
                .into_iter()
                .find(|known| *known == word)
                .ok_or_else(|| BadRequest::Word(word.to_owned()))?;
            let axis = axis(word, &mut words, axes)?;
            Request::Order { axis, order: order(word, &mut words)? }
        }
    };
    end(&mut words)?;
    Ok(request)
}

/// The axis whose faults are wanted, as a program asks for it over HTTP.
pub(crate) fn fault_query(words: &[&str], axes: &[String]) -> Result<Option<String>, BadRequest> {
    let mut wanted = None;
    for text in words {
        let unexpected = || BadRequest::Unexpected { text: (*text).to_owned(), expected: "axis=AXIS" };
        let name = text.strip_prefix("axis=").ok_or_else(unexpected)?;
        let place = axis("faults", &mut std::iter::once(name), axes)?;
        wanted = axes.get(place).cloned();
    }
    Ok(wanted)
}

/// The place of the axis that is wanted, and the number after which its samples are.
pub(crate) fn trace_query(words: &[&str], axes: &[String]) -> Result<(usize, u64), BadRequest> {
    let (mut place, mut after) = (None, 0);
    for text in words {
        let unexpected =
            || BadRequest::Unexpected { text: (*text).to_owned(), expected: "axis=AXIS or after=N" };
        match text.split_once('=').ok_or_else(unexpected)? {
            ("axis", name) => place = Some(axis("traces", &mut std::iter::once(name), axes)?),
            ("after", value) => {
                after = value.parse().map_err(|_| BadRequest::Whole(value.to_owned()))?;
            }
            _ => return Err(unexpected()),
        }
    }
    Ok((place.ok_or(BadRequest::NoAxis("traces"))?, after))
}

/// The place of the one axis that is wanted.
pub(crate) fn axis_query(words: &[&str], axes: &[String]) -> Result<usize, BadRequest> {
    let [text] = words else { return Err(BadRequest::NoAxis("axis")) };
    let unexpected = || BadRequest::Unexpected { text: (*text).to_owned(), expected: "axis=AXIS" };
    let name = text.strip_prefix("axis=").ok_or_else(unexpected)?;
    axis("axis", &mut std::iter::once(name), axes)
}

/// The number after which samples are wanted.
pub(crate) fn after_query(words: &[&str]) -> Result<u64, BadRequest> {
    let mut after = 0;
    for text in words {
        let unexpected = || BadRequest::Unexpected { text: (*text).to_owned(), expected: "after=N" };
        let value = text.strip_prefix("after=").ok_or_else(unexpected)?;
        after = value.parse().map_err(|_| BadRequest::Whole(value.to_owned()))?;
    }
    Ok(after)
}

/// How much of the recording is wanted: `last=SECONDS`, or nothing.
pub(crate) fn recording_query<'a>(
    words: &mut impl Iterator<Item = &'a str>,
) -> Result<Option<DurationNs>, BadRequest> {
    let Some(text) = words.next() else { return Ok(None) };
    let seconds: Option<u32> = text.strip_prefix("last=").and_then(|value| value.parse().ok());
    let seconds = seconds.filter(|seconds| *seconds > 0);
    let expected = "last=SECONDS, a whole number from 1";
    let seconds = seconds.ok_or_else(|| BadRequest::Unexpected { text: text.to_owned(), expected })?;
    end(words)?;
    Ok(Some(DurationNs::from_secs(seconds.into())))
}

/// Which contact is wanted: `number=N`.
pub(crate) fn contact_query<'a>(words: &mut impl Iterator<Item = &'a str>) -> Result<u64, BadRequest> {
    let missing = BadRequest::Missing { word: "contact", what: "number=N" };
    let text = words.next().ok_or(missing)?;
    let number = text.strip_prefix("number=").and_then(|value| value.parse().ok());
    let number =
        number.ok_or_else(|| BadRequest::Unexpected { text: text.to_owned(), expected: "number=N" })?;
    end(words)?;
    Ok(number)
}

/// Nothing may follow.
fn end<'a>(words: &mut impl Iterator<Item = &'a str>) -> Result<(), BadRequest> {
    words.next().map_or(Ok(()), |text| {
        Err(BadRequest::Unexpected { text: text.to_owned(), expected: "the end of the line" })
    })
}

/// Which lines of the log are wanted, at most so many.
pub(crate) fn log_query<'a>(
    words: &mut impl Iterator<Item = &'a str>,
    axes: &[String],
    most: usize,
) -> Result<LogQuery, BadRequest> {
    let mut query = LogQuery::default();
    for text in words {
        let expected = "after=N, lines=N, level=LEVEL or axis=AXIS";
        let unexpected = || BadRequest::Unexpected { text: text.to_owned(), expected };
        let (name, value) = text.split_once('=').ok_or_else(unexpected)?;
        let whole = || value.parse().map_err(|_| BadRequest::Whole(value.to_owned()));
        match name {
            "after" => query.after = Some(whole()?),
            "lines" => {
                let lines: u64 = whole()?;
                let lines = usize::try_from(lines).ok().filter(|lines| (1..=most).contains(lines));
                query.lines = lines.ok_or_else(|| BadRequest::Lines { text: text.to_owned(), most })?;
            }
            "level" => {
                let level = LogLevel::ALL.into_iter().find(|level| level.name() == value);
                query.level = level.ok_or_else(|| BadRequest::Unexpected {
                    text: text.to_owned(),
                    expected: "level=error, warn, info, debug or trace",
                })?;
            }
            "axis" => {
                let place = axis("log", &mut std::iter::once(value), axes)?;
                query.axis = axes.get(place).cloned();
            }
            _ => return Err(unexpected()),
        }
    }
    Ok(query)
}

fn access<'a>(
    word: &'static str,
    words: &mut impl Iterator<Item = &'a str>,
    axes: &[String],
    parameters: &[NamedParameter],
) -> Result<Request, BadRequest> {
    let axis = axis(word, words, axes)?;
    let name = words.next().ok_or(BadRequest::Missing { word, what: "the name of a parameter" })?;
    if word == "read"
        && let Some(id) = id(name)?
    {
        let brief = option(words, "brief")?;
        return Ok(Request::Drive { axis, ask: Ask::Read { id, brief } });
    }
    let parameter = parameters.iter().position(|known| known.name == name);
    let parameter = parameter.ok_or_else(|| BadRequest::Parameter { name: name.to_owned() })?;
    if word == "read" {
        return Ok(Request::Parameter { axis, parameter, wanted: None });
    }
    let text = words.next().ok_or(BadRequest::Missing { word, what: "a value" })?;
    let wanted = text.parse().map_err(|_| BadRequest::Whole(text.to_owned()))?;
    Ok(Request::Parameter { axis, parameter, wanted: Some(wanted) })
}

/// The number of a parameter in its drive; `None` for what is a name.
fn id(word: &str) -> Result<Option<Id>, BadRequest> {
    match Id::parse(word) {
        None if Id::is_meant(word) => Err(BadRequest::Parameter { name: word.to_owned() }),
        id => Ok(id),
    }
}

/// Whether the line goes on with this word.
fn option<'a>(words: &mut impl Iterator<Item = &'a str>, known: &'static str) -> Result<bool, BadRequest> {
    match words.next() {
        None => Ok(false),
        Some(word) if word == known => Ok(true),
        Some(text) => Err(BadRequest::Unexpected { text: text.to_owned(), expected: known }),
    }
}

/// Which list the line goes on with.
fn listing<'a>(words: &mut impl Iterator<Item = &'a str>) -> Result<Listing, BadRequest> {
    match words.next() {
        None => Ok(Listing::All),
        Some("backup") => Ok(Listing::Backup),
        Some("commands") => Ok(Listing::Commands),
        Some(text) => Err(BadRequest::Unexpected { text: text.to_owned(), expected: "backup or commands" }),
    }
}

/// A procedure command, and what is done with it.
fn command<'a>(words: &mut impl Iterator<Item = &'a str>, axes: &[String]) -> Result<Request, BadRequest> {
    let axis = axis("command", words, axes)?;
    let missing = |what| BadRequest::Missing { word: "command", what };
    let name = words.next().ok_or(missing("the number of a command"))?;
    let id = id(name)?.ok_or_else(|| BadRequest::Parameter { name: name.to_owned() })?;
    let expected = "start, progress or cancel";
    let word = words.next().ok_or(missing(expected))?;
    let act = Act::ALL.into_iter().find(|act| act.word() == word);
    let act = act.ok_or_else(|| BadRequest::Unexpected { text: word.to_owned(), expected })?;
    Ok(Request::Drive { axis, ask: Ask::Command { id, act } })
}

/// A write to a parameter by its number: the value is the rest of the line. `None` for a name.
fn direct_write(line: &str, axes: &[String]) -> Result<Option<Request>, BadRequest> {
    let mut rest = line;
    let [_, name, number] = [(); 3].map(|()| take_word(&mut rest));
    let Some(id) = id(number)? else { return Ok(None) };
    let axis = axis("write", &mut std::iter::once(name), axes)?;
    let text = rest.trim_ascii();
    if text.is_empty() {
        return Err(BadRequest::Missing { word: "write", what: "a value" });
    }
    Ok(Some(Request::Drive { axis, ask: Ask::Write { id, text: text.to_owned() } }))
}

/// The next word of a line, which is left with what follows.
fn take_word<'l>(line: &mut &'l str) -> &'l str {
    let start = line.trim_ascii_start();
    let end = start.find(|letter: char| letter.is_ascii_whitespace()).unwrap_or(start.len());
    let (word, rest) = start.split_at(end);
    *line = rest;
    word
}

fn axis<'a>(
    word: &'static str,
    words: &mut impl Iterator<Item = &'a str>,
    axes: &[String],
) -> Result<usize, BadRequest> {
    let name = words.next().ok_or(BadRequest::NoAxis(word))?;
    axes.iter()
        .position(|known| known == name)
        .ok_or_else(|| BadRequest::Axis { name: name.to_owned(), known: axes.join(", ") })
}

fn order<'a>(word: &'static str, words: &mut impl Iterator<Item = &'a str>) -> Result<Order, BadRequest> {
    Ok(match word {
        "enable" => Order::Enable,
        "disable" => Order::Disable,
        "stop" => Order::Stop,
        "reset" => Order::Reset,
        "home" => Order::Home,
        "jog" => {
            let missing = BadRequest::Missing { word, what: "a velocity" };
            let velocity = Velocity(number(words.next().ok_or(missing)?, "a velocity")?);
            let options = options(words, &["acceleration"])?;
            Order::Jog(Jog { velocity, acceleration: options.acceleration, time: JOG_TIME })
        }
        _ => {
            let missing = BadRequest::Missing { word, what: "a target" };
            let to = Position(number(words.next().ok_or(missing)?, "a target")?);
            let options = options(words, &["velocity", "acceleration", "by"])?;
            let velocity = options.velocity.ok_or(BadRequest::Missing { word, what: "velocity=" })?;
            Order::Move(Move { to, velocity, acceleration: options.acceleration, by: options.by })
        }
    })
}

#[derive(Default)]
struct Options {
    velocity: Option<Velocity>,
    acceleration: Option<Acceleration>,
    by: Option<Generator>,
}

/// Reads what follows the positional values: `NAME=VALUE` in any order, each at most once.
fn options<'a>(
    words: &mut impl Iterator<Item = &'a str>,
    known: &'static [&'static str],
) -> Result<Options, BadRequest> {
    let expected = match known {
        [_] => "acceleration=VALUE",
        _ => "velocity=VALUE, acceleration=VALUE or by=drive|gateway, each once",
    };
    let mut options = Options::default();
    for text in words {
        let unexpected = || BadRequest::Unexpected { text: text.to_owned(), expected };
        let (name, value) = text.split_once('=').ok_or_else(unexpected)?;
        let twice = match name {
            _ if !known.contains(&name) => return Err(unexpected()),
            "velocity" => options.velocity.replace(Velocity(number(value, "a velocity")?)).is_some(),
            "acceleration" => {
                options.acceleration.replace(Acceleration(number(value, "an acceleration")?)).is_some()
            }
            _ => {
                let by = match value {
                    "drive" => Generator::Drive,
                    "gateway" => Generator::Gateway,
                    _ => return Err(unexpected()),
                };
                options.by.replace(by).is_some()
            }
        };
        if twice {
            return Err(unexpected());
        }
    }
    Ok(options)
}

/// A decimal number in nanounits, exactly: `-12.5` is -12 500 000 000.
fn number(text: &str, what: &'static str) -> Result<i64, BadRequest> {
    let bad = || BadRequest::Number { text: text.to_owned(), what };
    let (negative, digits) = match text.as_bytes().first() {
        Some(b'-') => (true, &text[1..]),
        Some(b'+') => (false, &text[1..]),
        _ => (false, text),
    };
    let (whole, part) = digits.split_once('.').unwrap_or((digits, ""));
    let all_digits = |text: &str| text.len() <= 9 && text.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() || !all_digits(whole) || !all_digits(part) || digits.ends_with('.') {
        return Err(bad());
    }
    let whole: i64 = whole.parse().map_err(|_| bad())?;
    let part: i64 = format!("{part:0<9}").parse().map_err(|_| bad())?;
    let value = whole * NANO + part;
    Ok(if negative { -value } else { value })
}

/// A value in units, with six decimals.
fn units(nano: i64) -> String {
    let micro = Ratio::new(1, 1_000).and_then(|ratio| ratio.apply(nano, Rounding::Nearest).ok());
    let micro = micro.unwrap_or_default();
    let sign = if micro < 0 { "-" } else { "" };
    let micro = micro.unsigned_abs();
    format!("{sign}{}.{:06}", micro / 1_000_000, micro % 1_000_000)
}

/// The unit of positions.
#[must_use]
pub const fn unit(kind: AxisKind) -> &'static str {
    match kind {
        AxisKind::Rotary => "rev",
        AxisKind::Linear => "mm",
    }
}

/// The state of an axis as `NAME=VALUE` words.
#[must_use]
pub fn state(status: &AxisStatus, kind: AxisKind) -> String {
    let mut text = format!(
        "state={} owner={} mode={} position={} velocity={} torque={} unit={}",
        status.state,
        status.owner.name(),
        status.mode,
        units(status.position.get()),
        units(status.velocity.get()),
        // Parts per million of the rated torque are percent with four decimals.
        units(status.torque.get().saturating_mul(NANO / 10_000)),
        unit(kind),
    );
    if let Some(fault) = status.fault {
        let _ = write!(text, " fault={fault}");
    }
    if let Some(wait) = status.wait {
        let _ = write!(text, " waits_for={}", wait.waiting.awaited.name());
    }
    for (inhibit, _) in status.inhibits.iter_names() {
        let _ = write!(text, " inhibit={}", inhibit.to_ascii_lowercase());
    }
    text
}

/// The reply to `axes`: a line for each, and one that ends the list.
#[must_use]
pub fn list(names: &[String], state: impl Fn(usize) -> String) -> String {
    let mut text = String::new();
    for (axis, name) in names.iter().enumerate() {
        let _ = writeln!(text, "axis {name} {}", state(axis));
    }
    let _ = writeln!(text, "ok axes {}", names.len());
    text
}

/// Lines of a reply, each a word and an object.
#[must_use]
pub fn rows<T: Serialize>(word: &str, rows: impl IntoIterator<Item = T>) -> String {
    rows.into_iter().fold(String::new(), |mut text, row| {
        // The objects have texts, numbers and lists, and nothing that JSON does not know.
        let _ = writeln!(text, "{word} {}", serde_json::to_string(&row).unwrap_or_default());
        text
    })
}

/// The reply to `parameters`: a line for each of the overlays, and one that ends the list.
#[must_use]
pub fn parameter_list(parameters: &[NamedParameter]) -> String {
    let mut text = parameter_lines(parameters);
    let count = text.lines().count();
    let _ = writeln!(text, "ok parameters {count}");
    text
}

/// Text of a drive on one line, without what a terminal would act upon.
#[must_use]
pub fn printable(text: &str) -> String {
    text.chars().map(|letter| if letter.is_control() { '?' } else { letter }).collect()
}

/// A line for each parameter of the overlays.
#[must_use]
pub fn parameter_lines(parameters: &[NamedParameter]) -> String {
    let mut text = String::new();
    let of_overlays = parameters.iter().filter(|row| row.parameter.is_of_vendor());
    for NamedParameter { name, unit, access, range, .. } in of_overlays {
        let _ = write!(text, "parameter {name} access={access}");
        if !unit.is_empty() {
            let _ = write!(text, " unit={unit}");
        }
        if let Some((low, high)) = range {
            let _ = write!(text, " min={low} max={high}");
        }
        text.push('\n');
    }
    text
}

/// The reply to an access to a parameter that has succeeded.
#[must_use]
pub fn accessed(word: &str, axis: &str, parameter: &NamedParameter, value: i64) -> String {
    let NamedParameter { name, unit, .. } = parameter;
    let unit = if unit.is_empty() { String::new() } else { format!(" unit={unit}") };
    format!("ok {word} {axis} {name}={value}{unit}\n")
}

/// The reply to an order that has completed, with the state of the axis.
#[must_use]
pub fn done(order: &str, axis: &str, state: &str) -> String {
    format!("ok {order} {axis} {state}\n")
}

/// The reply to an order that was refused or not completed.
#[must_use]
pub fn failed(order: &str, axis: &str, failure: &Failure) -> String {
    format!("error {order} {axis} {}: {failure}\n", failure.code())
}

/// The reply to a line that is not a request.
#[must_use]
pub fn bad(line: &str, error: &BadRequest) -> String {
    let word = line.split_ascii_whitespace().next().unwrap_or("-");
    format!("error {} - {}: {error}\n", word.escape_default(), error.code())
}

#[cfg(test)]
mod tests {
    use profile_generic::fault::FaultCause;
    use profile_generic::quantity::Torque;
    use profile_generic::state::DriveState;
    use proptest::prelude::*;

    use super::*;
    use crate::engine::axis::Owner;

    fn axes() -> Vec<String> {
        ["x", "y-2"].map(str::to_owned).to_vec()
    }

    fn parameters() -> Vec<NamedParameter> {
        let notch = NamedParameter {
            name: "notch_frequency".to_owned(),
            parameter: Parameter(0x8001),
            unit: "mHz",
            access: Access::Write,
            range: Some((50_000, 2_000_000)),
        };
        let code = NamedParameter {
            name: "code".to_owned(),
            parameter: Parameter(0x8002),
            unit: "",
            access: Access::Read,
            range: None,
        };
        vec![notch, code]
    }

    fn order(line: &str) -> Order {
        match parse(line, &axes(), &parameters()) {
            Ok(Request::Order { order, .. }) => order,
            other => panic!("{line}: {other:?}"),
        }
    }

    #[test]
    fn every_request_is_read() {
        let axes = axes();
        let parse = |line: &str, axes: &[String]| parse(line, axes, &parameters());
        assert_eq!(parse("box", &axes), Ok(Request::Box));
        assert_eq!(parse("axes", &axes), Ok(Request::Axes));
        assert_eq!(parse("  status\ty-2 ", &axes), Ok(Request::Status { axis: 1 }));
        assert_eq!(parse("parameters", &axes), Ok(Request::Parameters));
        assert_eq!(parse("contacts", &axes), Ok(Request::Contacts));
        assert_eq!(parse("attributes y-2", &axes), Ok(Request::Attributes { axis: 1 }));
        for (line, wanted) in [
            ("record", FileRequest::Recording(None)),
            ("record last=30", FileRequest::Recording(Some(DurationNs::from_secs(30)))),
            ("contact number=7", FileRequest::Contact(7)),
            ("bundle", FileRequest::Bundle),
        ] {
            assert_eq!(parse(line, &axes), Ok(Request::File(wanted)));
            assert!(line.starts_with(wanted.word()));
        }
        for (line, said) in [
            ("record last=0", "unexpected `last=0`: expected last=SECONDS, a whole number from 1"),
            ("record last=1 x", "unexpected `x`: expected the end of the line"),
            ("contact", "`contact` needs number=N"),
            ("contact 7", "unexpected `7`: expected number=N"),
            ("bundle x", "unexpected `x`: expected the end of the line"),
        ] {
            assert_eq!(parse(line, &axes).unwrap_err().to_string(), said);
        }
        let parameter = |parameter, wanted| Ok(Request::Parameter { axis: 1, parameter, wanted });
        assert_eq!(parse("read y-2 code", &axes), parameter(1, None));
        assert_eq!(parse("write y-2 notch_frequency -5", &axes), parameter(0, Some(-5)));
        let most = format!("write y-2 notch_frequency {}", i64::MIN);
        assert_eq!(parse(&most, &axes), parameter(0, Some(i64::MIN)));
        for (line, expected) in [
            ("enable x", Order::Enable),
            ("disable x", Order::Disable),
            ("stop x", Order::Stop),
            ("reset x", Order::Reset),
            ("home x", Order::Home),
            (
                "jog x -2.5",
                Order::Jog(Jog { velocity: Velocity(-5 * NANO / 2), acceleration: None, time: JOG_TIME }),
            ),
            (
                "jog x 0.000000001 acceleration=10",
                Order::Jog(Jog {
                    velocity: Velocity(1),
                    acceleration: Some(Acceleration(10 * NANO)),
                    time: JOG_TIME,
                }),
            ),
            (
                "move x +1.25 by=gateway acceleration=3 velocity=2",
                Order::Move(Move {
                    to: Position(5 * NANO / 4),
                    velocity: Velocity(2 * NANO),
                    acceleration: Some(Acceleration(3 * NANO)),
                    by: Some(Generator::Gateway),
                }),
            ),
            (
                "move x -999999999.999999999 velocity=2 by=drive",
                Order::Move(Move {
                    to: Position(-999_999_999_999_999_999),
                    velocity: Velocity(2 * NANO),
                    acceleration: None,
                    by: Some(Generator::Drive),
                }),
            ),
        ] {
            assert_eq!(parse(line, &axes), Ok(Request::Order { axis: 0, order: expected }), "{line}");
        }
        assert_eq!(order("jog x 1"), order("jog x +1.0"));
    }

    #[test]
    fn parameters_of_a_drive_are_named_by_its_numbers() {
        let drive = |axis, ask| Ok(Request::Drive { axis, ask });
        let id = |text| Id::parse(text).expect(text);
        let write = |text, value: &str| Ask::Write { id: id(text), text: value.to_owned() };
        for (line, axis, ask) in [
            ("read x S-0-0100", 0, Ask::Read { id: id("S-0-0100"), brief: false }),
            ("read y-2 6081h brief", 1, Ask::Read { id: id("6081h"), brief: true }),
            ("list x", 0, Ask::List { of: Listing::All }),
            ("list y-2 backup", 1, Ask::List { of: Listing::Backup }),
            ("write x P-0-4000 12.5", 0, write("P-0-4000", "12.5")),
            ("  write\ty-2  0x6081.0   two  words ", 1, write("6081h", "two  words")),
            ("write x 1.1.7 hex:0102", 0, write("1.1.7", "hex:0102")),
            ("list x commands", 0, Ask::List { of: Listing::Commands }),
            ("command x S-0-0264 start", 0, Ask::Command { id: id("S-0-0264"), act: Act::Start }),
            ("command y-2 1010:01 progress", 1, Ask::Command { id: id("1010:01"), act: Act::Progress }),
            ("command x S-0-0264 cancel", 0, Ask::Command { id: id("S-0-0264"), act: Act::Cancel }),
        ] {
            assert_eq!(parse(line, &axes(), &parameters()), drive(axis, ask), "{line}");
        }
        for (line, code) in [
            ("read x S-0", "no-parameter"),
            ("read x 6081", "no-parameter"),
            ("write x 6081 5", "no-parameter"),
            ("write z 6081h 5", "no-axis"),
            ("write x 6081h", "syntax"),
            ("write x 6081h  ", "syntax"),
            ("read x 6081h all", "syntax"),
            ("read x 6081h brief brief", "syntax"),
            ("list x all", "syntax"),
            ("list", "no-axis"),
            ("command x", "syntax"),
            ("command x notch start", "no-parameter"),
            ("command x S-0-0264", "syntax"),
            ("command x S-0-0264 stop", "syntax"),
            ("command x S-0-0264 start now", "syntax"),
            ("command z S-0-0264 start", "no-axis"),
        ] {
            assert_eq!(parse(line, &axes(), &parameters()).expect_err(line).code(), code, "{line}");
        }
    }

    #[test]
    fn whatever_is_wrong_is_named() {
        let texts: Vec<String> = [
            "",
            "go x",
            "enable",
            "enable z",
            "enable x now",
            "jog x",
            "jog x fast",
            "jog x 1e3",
            "jog x 1.",
            "jog x .5",
            "jog x 1234567890",
            "jog x 1 velocity=2",
            "move x",
            "move x 1",
            "move x 1 velocity=",
            "move x 1 velocity=1 velocity=2",
            "move x 1 velocity=1 by=hand",
            "axes x",
            "box x",
            "parameters x",
            "read",
            "read x",
            "read x notch",
            "read x code 1",
            "write x code",
            "write x code 1.5",
            "write x notch_frequency 9223372036854775808",
            "write x code 1 2",
        ]
        .into_iter()
        .map(|line| bad(line, &parse(line, &axes(), &parameters()).expect_err(line)))
        .collect();
        insta::assert_snapshot!(texts.concat());
    }

    #[test]
    fn parameters_are_listed_and_shown_with_their_unit() {
        let expected = "parameter notch_frequency access=write unit=mHz min=50000 max=2000000\n\
                        parameter code access=read\nok parameters 2\n";
        assert_eq!(parameter_list(&parameters()), expected);
        let [notch, code] = parameters().try_into().expect("two");
        assert_eq!(accessed("read", "x", &notch, 120_000), "ok read x notch_frequency=120000 unit=mHz\n");
        assert_eq!(accessed("write", "x", &code, -7), "ok write x code=-7\n");
    }

    #[test]
    fn the_state_of_an_axis_is_one_line() {
        let axis = AxisStatus {
            state: DriveState::Faulted,
            owner: Owner::Local,
            position: Position(-1_250_000_499),
            velocity: Velocity(1_500),
            torque: Torque(-123_456),
            fault: Some(FaultCause::OVER_CURRENT),
            ..AxisStatus::NONE
        };
        let expected = "state=faulted owner=local mode=none position=-1.250000 velocity=0.000002 \
                        torque=-12.345600 unit=mm fault=over_current";
        assert_eq!(state(&axis, AxisKind::Linear), expected);
        assert_eq!(done("home", "x", expected), format!("ok home x {expected}\n"));
        assert_eq!(
            failed("jog", "x", &Failure::TooFast(Velocity(NANO))),
            "error jog x too-fast: the velocity limit of the axis is 1.000000000 u/s\n"
        );
    }

    proptest! {
        #[test]
        fn numbers_are_exact(value in -999_999_999_999_999_999_i64..=999_999_999_999_999_999) {
            let sign = if value < 0 { "-" } else { "" };
            let (whole, part) = (value.abs() / NANO, value.abs() % NANO);
            prop_assert_eq!(number(&format!("{sign}{whole}.{part:09}"), "a value"), Ok(value));
        }

        #[test]
        fn any_line_has_an_answer_of_one_line(line in "\\PC{0,80}") {
            if let Err(error) = parse(&line, &axes(), &parameters()) {
                let reply = bad(&line, &error);
                prop_assert_eq!(reply.matches('\n').count(), 1);
                prop_assert!(reply.starts_with("error "));
            }
        }
    }
}
