//! Facts as text: groups of lines, each with what is done, what must come of it, and the fact that this shows.
//!
//! ```text
//! config sercos.toml                     the box: axes and drives, commissioned
//! == a turntable behind a gear of 3:1    a group: the box forgets what was before
//! idn drive-a S-0-0121 03 00 00 00       what a drive of this group holds
//! axis turntable                         the axis of the lines below
//! velocity 1.0 -> S-0-0036 1800000 | one turn of the load is three of the motor
//! ```
//!
//! | what is done | |
//! |---|---|
//! | `position N`, `velocity X`, `acceleration X`, `torque X`, several in a line | an update; the first is the Control Mode |
//! | the same with `position_trim N`, `velocity_trim X`, `torque_trim X` behind them | with cyclic write data |
//! | `request N` | Axis Control |
//! | `enable N` | the axis is brought to Running in this Control Mode |
//! | `shows ITEM N, ITEM N` | the drive sends these values, and those that it has sent before |
//! | `bytes HEX` | the drive sends this |
//! | `error ITEM N`, `warning ITEM N` | the drive has an error or a warning, and this is its diagnostic word |
//! | `set ATTRIBUTE X` | the controller sets an attribute |
//! | `holds ITEM N` | the drive holds this value |
//! | `generic NAME N` | a parameter or set-point of the generic model has this value, for a drive that has all of them |
//! | `silence` | the controller sends no updates any more, up to the end of the group |
//! | `commissioned` | nothing |
//!
//! | what must come of it | |
//! |---|---|
//! | `ITEM N`, `ITEM N & MASK` | in the telegram to the drive |
//! | `at OFFSET HEX` | the same, by its bytes |
//! | `position N`, `velocity X`, `acceleration X` | in the update to the controller |
//! | `state N`, `response N` | Axis State, Axis Response |
//! | `status +N`, `status -N`, `io +N`, `io -N` | a bit of Axis Status or Axis I/O Status is set, or is not |
//! | `attribute N X` | an attribute, read by the controller |
//! | `answer N` | general status of the answer to `set` |
//! | `kept ITEM N` | what the drive holds |
//! | `wrote ITEM N` | what was written into the drive beside the cycle |

use profile_cip::wire::motion::codes::ControlMode;
use profile_generic::image::Signal;
use profile_generic::parameter::Parameter;
use profile_sercos::wire::idn::Idn;

use crate::mapping::{Item, Object};

/// A box with its groups of facts.
#[derive(Debug)]
pub(super) struct Place<'t> {
    pub config: &'t str,
    pub groups: Vec<Group<'t>>,
}

/// Facts that are shown one after the other.
#[derive(Debug, Default)]
pub(super) struct Group<'t> {
    pub title: &'t str,
    /// Lines of `idn` and `object`, as [`crate::translate::Stage::with_values`] takes them.
    pub values: String,
    pub facts: Vec<Fact<'t>>,
}

/// A fact.
#[derive(Debug)]
pub(super) struct Fact<'t> {
    pub line: usize,
    pub axis: &'t str,
    pub done: Done,
    pub expected: Vec<Expected>,
    pub says: &'t str,
}

/// What is done.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Done {
    Update { mode: ControlMode, values: Vec<(Quantity, f64)>, trims: Vec<(Quantity, f64)> },
    Request(u8),
    Enable(ControlMode),
    Shows(Vec<(Item, i64)>),
    Bytes(Vec<u8>),
    Diagnosis { item: Item, word: u32, stops: bool },
    Set { attribute: u16, value: f64 },
    Holds(Item, i64),
    Generic(Generic, i64),
    Silence,
    Commissioned,
}

/// A value of the generic model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Generic {
    Parameter(Parameter),
    Signal(Signal),
}

/// A cyclic value of CIP Motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Quantity {
    Position,
    Velocity,
    Acceleration,
    Torque,
}

/// What must come of it.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Expected {
    Told { item: Item, value: i64, mask: Option<i64> },
    At { offset: usize, bytes: Vec<u8> },
    Actual(Quantity, f64),
    State(u8),
    Response(u8),
    Status { bit: u8, set: bool },
    Io { bit: u8, set: bool },
    Attribute { id: u16, value: f64 },
    Answer(u8),
    Kept { item: Item, value: i64 },
    Wrote { item: Item, value: i64 },
}

/// Reads a file.
///
/// # Errors
/// The line, and what was expected there.
pub(super) fn parse(text: &str) -> Result<Vec<Place<'_>>, (usize, String)> {
    let mut boxes: Vec<Place<'_>> = Vec::new();
    let mut axis = "";
    for (number, line) in (1..).zip(text.lines().map(str::trim)) {
        let failed = |what: &str| (number, format!("expected {what}, got `{line}`"));
        let (first, rest) = line.split_once(' ').unwrap_or((line, ""));
        match first {
            "" | "#" => {}
            "config" => boxes.push(Place { config: rest, groups: Vec::new() }),
            _ => {
                let place = boxes.last_mut().ok_or_else(|| failed("`config` first"))?;
                if first == "==" {
                    place.groups.push(Group { title: rest, ..Group::default() });
                    continue;
                }
                let group = place.groups.last_mut().ok_or_else(|| failed("`== title` first"))?;
                match first {
                    "idn" | "object" => group.values.extend([line, "\n"]),
                    "axis" => axis = rest,
                    _ => group.facts.push(fact(line, number, axis).map_err(|what| failed(&what))?),
                }
            }
        }
    }
    Ok(boxes)
}

fn fact<'t>(line: &'t str, number: usize, axis: &'t str) -> Result<Fact<'t>, String> {
    let (shown, says) = line.rsplit_once(" | ").ok_or("` | ` and the fact")?;
    let (done, expected) = shown.split_once(" -> ").ok_or("` -> ` and what must come of it")?;
    let expected = expected.split(',').map(|one| self::expected(one.trim())).collect::<Result<_, _>>()?;
    Ok(Fact { line: number, axis, done: self::done(done.trim())?, expected, says: says.trim() })
}

fn done(text: &str) -> Result<Done, String> {
    let (first, rest) = text.split_once(' ').unwrap_or((text, ""));
    Ok(match first {
        "request" => Done::Request(number(rest)?),
        "enable" => Done::Enable(ControlMode(number(rest)?)),
        "shows" => Done::Shows(rest.split(',').map(|one| valued(one.trim())).collect::<Result<_, _>>()?),
        "bytes" => Done::Bytes(bytes(rest)?),
        "error" | "warning" => {
            let (item, word) = valued(rest)?;
            let word = u32::try_from(word).map_err(|_| "a word of 32 bits".to_owned())?;
            Done::Diagnosis { item, word, stops: first == "error" }
        }
        "set" => {
            let (attribute, value) = rest.split_once(' ').ok_or("an attribute and its value")?;
            Done::Set { attribute: number(attribute)?, value: real(value)? }
        }
        "holds" => valued(rest).map(|(item, value)| Done::Holds(item, value))?,
        "generic" => {
            let (name, value) = rest.split_once(' ').ok_or("a parameter or signal and its value")?;
            let signal = Signal::parse(name).map(Generic::Signal);
            let generic = signal.or_else(|| Parameter::from_name(name).map(Generic::Parameter));
            Done::Generic(generic.ok_or("a parameter or signal")?, number(value)?)
        }
        "silence" => Done::Silence,
        "commissioned" => Done::Commissioned,
        _ => {
            let words: Vec<&str> = text.split_whitespace().collect();
            let (mut values, mut trims) = (Vec::new(), Vec::new());
            for pair in words.chunks(2) {
                let [name, value] = pair else { return Err("a quantity and its value".to_owned()) };
                match name.strip_suffix("_trim") {
                    Some(name) => trims.push((quantity(name)?, real(value)?)),
                    None => values.push((quantity(name)?, real(value)?)),
                }
            }
            let mode = match values.first() {
                Some((Quantity::Position, _)) => ControlMode::POSITION,
                Some((Quantity::Velocity, _)) => ControlMode::VELOCITY,
                Some((Quantity::Acceleration, _)) => ControlMode::ACCELERATION,
                Some((Quantity::Torque, _)) | None => ControlMode::TORQUE,
            };
            Done::Update { mode, values, trims }
        }
    })
}

fn expected(text: &str) -> Result<Expected, String> {
    let (first, rest) = text.split_once(' ').unwrap_or((text, ""));
    let bit = || {
        let (sign, bit) = rest.split_at_checked(1).ok_or("+ or - and a bit")?;
        Ok::<_, String>((number(bit)?, sign == "+"))
    };
    Ok(match first {
        "at" => {
            let (offset, text) = rest.split_once(' ').ok_or("an offset and bytes")?;
            Expected::At { offset: number(offset)?, bytes: bytes(text)? }
        }
        "state" => Expected::State(number(rest)?),
        "response" => Expected::Response(number(rest)?),
        "answer" => Expected::Answer(number(rest)?),
        "status" => bit().map(|(bit, set)| Expected::Status { bit, set })?,
        "io" => bit().map(|(bit, set)| Expected::Io { bit, set })?,
        "attribute" => {
            let (id, value) = rest.split_once(' ').ok_or("an attribute and its value")?;
            Expected::Attribute { id: number(id)?, value: real(value)? }
        }
        "kept" => valued(rest).map(|(item, value)| Expected::Kept { item, value })?,
        "wrote" => valued(rest).map(|(item, value)| Expected::Wrote { item, value })?,
        _ => match quantity(first) {
            Ok(quantity) => Expected::Actual(quantity, real(rest)?),
            Err(_) => {
                let (plain, mask) = match text.split_once('&') {
                    Some((plain, mask)) => (plain.trim(), Some(number(mask)?)),
                    None => (text, None),
                };
                let (item, value) = valued(plain)?;
                Expected::Told { item, value, mask }
            }
        },
    })
}

fn quantity(text: &str) -> Result<Quantity, String> {
    Ok(match text {
        "position" => Quantity::Position,
        "velocity" => Quantity::Velocity,
        "acceleration" => Quantity::Acceleration,
        "torque" => Quantity::Torque,
        _ => return Err("a quantity, an IDN or an object".to_owned()),
    })
}

/// An IDN or object with a number.
fn valued(text: &str) -> Result<(Item, i64), String> {
    let (item, value) = text.split_once(' ').ok_or("an IDN or object and its value")?;
    let idn = item.parse::<Idn>().ok().map(Item::Idn);
    let item = idn.or_else(|| Object::parse(item).map(Item::Object)).ok_or("an IDN or object")?;
    Ok((item, number(value)?))
}

fn number<T: TryFrom<i64>>(text: &str) -> Result<T, String> {
    let digits = text.trim().replace('_', "");
    let parsed = match digits.strip_prefix("0x") {
        Some(hex) => i64::from_str_radix(hex, 16),
        None => digits.parse(),
    };
    parsed.ok().and_then(|number| T::try_from(number).ok()).ok_or_else(|| format!("a number, not `{text}`"))
}

/// A real number, or a whole one in hexadecimal.
fn real(text: &str) -> Result<f64, String> {
    let text = text.trim();
    match text.strip_prefix("0x") {
        Some(hex) => u32::from_str_radix(hex, 16).map(f64::from).map_err(|_| "a number".to_owned()),
        None => text.replace('_', "").parse().map_err(|_| format!("a number, not `{text}`")),
    }
}

fn bytes(text: &str) -> Result<Vec<u8>, String> {
    let byte = |pair| u8::from_str_radix(pair, 16).map_err(|_| "bytes in hexadecimal".to_owned());
    text.split_whitespace().map(byte).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_read() {
        let text = "config a.toml\n== group\nidn d S-0-0121 03 00\naxis x\n\
            velocity 1.0 acceleration 2 -> S-0-0036 600_000, S-0-0134 0xE000 & 0xE000 | a fact\n\
            shows S-0-0135 0xC008, S-0-0051 -5 -> position -5, status +3, io -1 | another";
        let boxes = parse(text).unwrap();
        let group = &boxes[0].groups[0];
        assert_eq!(
            (boxes[0].config, group.title, &*group.values),
            ("a.toml", "group", "idn d S-0-0121 03 00\n")
        );
        let fact = &group.facts[0];
        assert_eq!((fact.line, fact.axis, fact.says), (5, "x", "a fact"));
        let values = vec![(Quantity::Velocity, 1.0), (Quantity::Acceleration, 2.0)];
        assert_eq!(fact.done, Done::Update { mode: ControlMode::VELOCITY, values, trims: Vec::new() });
        let told =
            |number, value, mask| Expected::Told { item: Item::Idn(Idn::standard(number)), value, mask };
        assert_eq!(fact.expected, [told(36, 600_000, None), told(134, 0xE000, Some(0xE000))]);
        let expected = &group.facts[1].expected;
        assert_eq!(expected[0], Expected::Actual(Quantity::Position, -5.0));
        assert_eq!(
            expected[1..],
            [Expected::Status { bit: 3, set: true }, Expected::Io { bit: 1, set: false }]
        );
    }

    #[test]
    fn a_wrong_line_is_named() {
        for (line, what) in [
            ("velocity 1.0 -> S-0-0036 1", "` | `"),
            ("velocity 1.0 | fact", "` -> `"),
            ("velocity x -> S-0-0036 1 | fact", "a number"),
            ("velocity 1.0 -> S-0-0036 | fact", "an IDN or object"),
            ("spin 1.0 -> S-0-0036 1 | fact", "a quantity"),
        ] {
            let text = format!("config a\n== b\n{line}");
            let (number, message) = parse(&text).unwrap_err();
            assert_eq!(number, 3);
            assert!(message.contains(what), "{line}: {message}");
        }
    }
}
