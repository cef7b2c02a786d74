//! Translations as JSON records: one object a value, with typed fields. [`Record`] is what the schema `translate-output` describes.

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::Serialize;

use super::fact::{Carrier, Direction, Fact, Raw, What, number_of, unit};
use super::tree::{Mark, Node, Row, hex};
use super::{Counts, Entry, Place, Stage};

/// Version of the records. It counts up when a field changes its meaning or goes away; fields may be added without.
pub const SCHEMA: u32 = 1;

/// A line of `axisbridge translate --format ndjson`.
#[derive(Debug, Serialize, JsonSchema)]
#[serde(tag = "record", rename_all = "kebab-case")]
#[allow(
    clippy::large_enum_variant,
    reason = "one is made, written and dropped at a time, and nearly all are values"
)]
pub enum Record<'a> {
    /// A value of an axis.
    Value(ValueRecord<'a>),
    /// What the gateway says in its log about a frame.
    Log(LineRecord<'a>),
    /// Something about the recording at this place.
    Note(LineRecord<'a>),
    /// Something that could not be translated.
    Error(LineRecord<'a>),
    /// The last line.
    End(EndRecord<'a>),
}

/// A value of an axis.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ValueRecord<'a> {
    /// Version of the record.
    pub schema: u32,
    /// Number of the frame in the recording, or of the line in the list, from 1.
    pub frame: u64,
    /// Seconds since the first frame of the recording; absent in a list.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
    /// Name of the axis.
    pub axis: &'a str,
    /// Name of its drive.
    pub drive: &'a str,
    /// Which way the value went.
    pub direction: Direction,
    /// Whether its bytes were in the frame; otherwise the gateway has made them of the frame.
    pub recorded: bool,
    /// Name of the signal in the generic model, such as `position_command`, or `mode`, `action`, `report`, `state`,
    /// `axis_state`, `request`, `status`, `control_word`, `fault`.
    pub signal: &'a str,
    /// The value in its unit; null of a command that the drive does not follow, and of a fault that has ended.
    pub value: Scalar<'a>,
    /// Unit of the value; empty of a name.
    pub unit: &'a str,
    /// The value in the generic model: an integer, in the smallest part of its unit that `exact_per_unit` says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exact: Option<i64>,
    /// Parts of `exact` in a unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exact_per_unit: Option<i64>,
    /// The bytes of the value, where it has some of its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub raw: Option<RawRecord>,
    /// The row that made it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub row: Option<RowRecord<'a>>,
    /// Further rows.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub more_rows: Vec<RowRecord<'a>>,
}

/// A number, a name, or nothing.
#[derive(Debug, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Scalar<'a> {
    /// A number.
    Number(f64),
    /// A name, or several with commas.
    Name(Cow<'a, str>),
    /// Nothing.
    Nothing,
}

/// The bytes of a value.
#[derive(Debug, Serialize, JsonSchema)]
pub struct RawRecord {
    /// In hexadecimal, with blanks between them.
    pub bytes: String,
    /// The number in them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub number: Option<f64>,
    /// First byte in what carries them; absent if the value has no bytes of its own there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset: Option<u16>,
    /// What carries them: `MDT`, `AT` (values of the connection, without C-CON), `RPDO1`, `TPDO1`, `message` (DeviceNet), `block`
    /// (the cyclic block of an instance in an update), `object` (IDN, object or EMCY).
    #[serde(rename = "in")]
    pub carrier: Cow<'static, str>,
}

/// A row of a mapping table.
#[derive(Debug, Serialize, JsonSchema)]
pub struct RowRecord<'a> {
    /// The file.
    pub file: &'a str,
    /// The line, from 1.
    pub line: usize,
    /// The kind of row.
    pub section: &'a str,
    /// What the row is about.
    pub key: &'a str,
}

/// Something that is said of a frame.
#[derive(Debug, Serialize, JsonSchema)]
pub struct LineRecord<'a> {
    /// Version of the record.
    pub schema: u32,
    /// Number of the frame or line.
    pub frame: u64,
    /// Seconds since the first frame of the recording.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
    /// The axis, where it is about one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<&'a str>,
    /// What is said.
    pub text: &'a str,
}

/// What became of the frames.
#[derive(Debug, Serialize, JsonSchema)]
pub struct EndRecord<'a> {
    /// Version of the record.
    pub schema: u32,
    /// Frames that were translated.
    pub translated: usize,
    /// Frames that carry nothing to translate.
    pub passed_over: usize,
    /// Frames that could not be translated.
    pub failed: usize,
    /// Drives whose scaling is that of simulated ones.
    pub simulated_scaling: Vec<&'a str>,
}

impl<'a> EndRecord<'a> {
    /// The end of a translation.
    #[must_use]
    pub fn new(counts: Counts, simulated_scaling: Vec<&'a str>) -> Self {
        let Counts { translated, passed_over, failed } = counts;
        Self { schema: SCHEMA, translated, passed_over, failed, simulated_scaling }
    }
}

impl What {
    /// Name of the signal.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Signal(signal, _) => signal.name(),
            Self::Mode(_) => "mode",
            Self::Action(_) => "action",
            Self::Report(_) => "report",
            Self::State(_) => "state",
            Self::AxisState(_) => "axis_state",
            Self::Request(_) => "request",
            Self::Status(_) => "status",
            Self::ControlWord(_) => "control_word",
            Self::Fault(_) => "fault",
        }
    }

    fn scalar(&self) -> Scalar<'static> {
        let name = |text: String| Scalar::Name(Cow::Owned(text));
        match *self {
            Self::Signal(_, _) | Self::Mode(None) | Self::Fault(None) => Scalar::Nothing,
            Self::Mode(Some(mode)) => Scalar::Name(Cow::Borrowed(mode.name())),
            Self::Action(action) => Scalar::Name(Cow::Borrowed(action.name())),
            Self::Report(report) => Scalar::Name(Cow::Borrowed(report.name())),
            Self::State(state) => Scalar::Name(Cow::Borrowed(state.name())),
            Self::AxisState(state) => name(state.to_string()),
            Self::Request(request) => name(request.to_string()),
            Self::Status(status) => {
                let names: Vec<_> = status.iter_names().map(|(name, _)| name.to_lowercase()).collect();
                name(names.join(","))
            }
            Self::ControlWord(word) => Scalar::Number(word.into()),
            Self::Fault(Some(cause)) => name(cause.to_string()),
        }
    }
}

impl Carrier {
    fn name(self, direction: Direction) -> Cow<'static, str> {
        match self {
            Self::Sercos if direction == Direction::ToDrive => Cow::Borrowed("MDT"),
            Self::Sercos => Cow::Borrowed("AT"),
            Self::Rpdo(number) => Cow::Owned(format!("RPDO{number}")),
            Self::Tpdo(number) => Cow::Owned(format!("TPDO{number}")),
            Self::Message => Cow::Borrowed("message"),
            Self::Block => Cow::Borrowed("block"),
            Self::Object => Cow::Borrowed("object"),
        }
    }
}

impl RawRecord {
    fn new(raw: &Raw, direction: Direction) -> Self {
        let Raw { number, offset, of, .. } = *raw;
        Self { bytes: hex(raw.bytes()), number, offset, carrier: of.name(direction) }
    }
}

impl<'a> From<&'a Row> for RowRecord<'a> {
    fn from(row: &'a Row) -> Self {
        Self { file: &row.file, line: row.line, section: row.section, key: &row.key }
    }
}

/// Seconds since the first frame.
#[must_use]
pub fn seconds(place: Place) -> Option<f64> {
    place.time.map(|time| number_of(time) / 1e9)
}

impl<'a> ValueRecord<'a> {
    fn new(stage: &'a Stage, place: Place, fact: &'a Fact, rows: &'a [Row]) -> Self {
        let axis = &stage.axes[fact.axis];
        let (mut value, mut name, mut exact, mut per_unit) = (fact.what.scalar(), "", None, None);
        if let What::Signal(signal, found) = fact.what {
            let (of, decimals) = unit(axis.scaling.kind, signal.quantity());
            name = of;
            if let Some(found) = found {
                let parts = 10_i64.pow(decimals.into());
                value = Scalar::Number(number_of(found) / number_of(parts));
                (exact, per_unit) = (Some(found), Some(parts));
            }
        }
        let mut rows = rows.iter().map(RowRecord::from);
        Self {
            schema: SCHEMA,
            frame: place.number,
            time: seconds(place),
            axis: &axis.name,
            drive: &axis.drive,
            direction: fact.direction,
            recorded: fact.recorded,
            signal: fact.what.name(),
            value,
            unit: name,
            exact,
            exact_per_unit: per_unit,
            raw: fact.raw.as_ref().map(|raw| RawRecord::new(raw, fact.direction)),
            row: rows.next(),
            more_rows: rows.collect(),
        }
    }
}

/// Hands on the records of a frame.
pub fn records<'a>(stage: &'a Stage, entry: &'a Entry, take: &mut dyn FnMut(Record<'a>)) {
    of_node(stage, entry.place, &entry.tree, None, take);
}

fn of_node<'a>(
    stage: &'a Stage,
    place: Place,
    node: &'a Node,
    above: Option<usize>,
    take: &mut dyn FnMut(Record<'a>),
) {
    let axis = node.axis.or(above);
    let line = |text: &'a str| LineRecord {
        schema: SCHEMA,
        frame: place.number,
        time: seconds(place),
        axis: axis.map(|axis| stage.axes[axis].name.as_str()),
        text,
    };
    let without = |word: &str| node.text.split_once(word).map_or(node.text.as_str(), |(_, text)| text);
    match node.mark {
        Mark::None => {}
        Mark::Log => take(Record::Log(line(without("log: ")))),
        Mark::Note => take(Record::Note(line(without("note: ")))),
        Mark::Error => take(Record::Error(line(without("error: ")))),
    }
    for fact in &node.facts {
        take(Record::Value(ValueRecord::new(stage, place, fact, &node.rows)));
    }
    node.children.iter().for_each(|child| of_node(stage, place, child, axis, take));
}
