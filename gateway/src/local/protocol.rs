//! The text protocol of local control: one request a line, one reply a request.
//!
//! ```text
//! request:  WORD AXIS [VALUE] [NAME=VALUE ...]
//! reply:    ok WORD AXIS [NAME=VALUE ...]
//!           error WORD AXIS CODE: TEXT
//! ```
//!
//! Values are decimal numbers in the units of the axis: revolutions or millimetres, and seconds. Those of parameters are whole
//! numbers in the unit of the parameter.

use std::fmt::Write as _;

use profile_generic::parameter::{Access, Parameter};
use profile_generic::quantity::{Acceleration, Position, Velocity};
use profile_generic::ratio::{Ratio, Rounding};

use crate::config::AxisKind;
use crate::engine::local::{Failure, Generator, Jog, Move, Order};
use crate::mapping::Mapping;
use crate::status::AxisStatus;

/// Longest request; what is longer is refused and skipped.
pub const LINE_MAX: usize = 256;

/// Nanounits in a unit.
const NANO: i64 = 1_000_000_000;

/// A parameter of a vendor that clients can read and write.
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
    /// Those that the overlays of a gateway define, in the order of their numbers.
    #[must_use]
    pub fn of(mapping: &Mapping) -> Vec<Self> {
        let rows = mapping.dictionaries.generic.parameters().iter();
        let mut parameters: Vec<Self> = rows
            .filter(|row| row.parameter.is_of_vendor())
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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// Show the whole gateway.
    Box,
    /// List the axes.
    Axes,
    /// List the parameters.
    Parameters,
    /// Read or write a parameter.
    Parameter {
        /// Position of the axis in the configuration, from 0.
        axis: usize,
        /// Position of the parameter in the list.
        parameter: usize,
        /// What is written; `None` reads.
        wanted: Option<i64>,
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

/// Why a line is not a request.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BadRequest {
    /// The first word is none of the protocol's.
    #[error(
        "unknown word `{0}`: expected box, axes, status, enable, disable, stop, reset, jog, move, home, parameters, read or write"
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
    #[error("unknown parameter `{name}`: `parameters` lists those of the overlays")]
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
        "read" => access("read", &mut words, axes, parameters)?,
        "write" => access("write", &mut words, axes, parameters)?,
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
    match words.next() {
        None => Ok(request),
        Some(text) => Err(BadRequest::Unexpected { text: text.to_owned(), expected: "the end of the line" }),
    }
}

fn access<'a>(
    word: &'static str,
    words: &mut impl Iterator<Item = &'a str>,
    axes: &[String],
    parameters: &[NamedParameter],
) -> Result<Request, BadRequest> {
    let axis = axis(word, words, axes)?;
    let name = words.next().ok_or(BadRequest::Missing { word, what: "the name of a parameter" })?;
    let parameter = parameters.iter().position(|known| known.name == name);
    let parameter = parameter.ok_or_else(|| BadRequest::Parameter { name: name.to_owned() })?;
    if word == "read" {
        return Ok(Request::Parameter { axis, parameter, wanted: None });
    }
    let text = words.next().ok_or(BadRequest::Missing { word, what: "a value" })?;
    let wanted = text.parse().map_err(|_| BadRequest::Whole(text.to_owned()))?;
    Ok(Request::Parameter { axis, parameter, wanted: Some(wanted) })
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
            Order::Jog(Jog { velocity, acceleration: options.acceleration })
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

/// The reply to `parameters`: a line for each, and one that ends the list.
#[must_use]
pub fn parameter_list(parameters: &[NamedParameter]) -> String {
    let mut text = String::new();
    for NamedParameter { name, unit, access, range, .. } in parameters {
        let _ = write!(text, "parameter {name} access={access}");
        if !unit.is_empty() {
            let _ = write!(text, " unit={unit}");
        }
        if let Some((low, high)) = range {
            let _ = write!(text, " min={low} max={high}");
        }
        text.push('\n');
    }
    let _ = writeln!(text, "ok parameters {}", parameters.len());
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
            ("jog x -2.5", Order::Jog(Jog { velocity: Velocity(-5 * NANO / 2), acceleration: None })),
            (
                "jog x 0.000000001 acceleration=10",
                Order::Jog(Jog { velocity: Velocity(1), acceleration: Some(Acceleration(10 * NANO)) }),
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
