//! Frames as JSON records. [`DecodeRecord`] is what the schema `decode-output` describes.

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::Serialize;

use super::Protocol;
use crate::capture::reader::Frame;

/// Version of the records. It counts up when a field changes its meaning or goes away; fields may be added without.
pub const SCHEMA: u32 = 1;

/// A line of `axisbridge decode --format ndjson`: a frame.
#[derive(Debug, Serialize, JsonSchema)]
pub struct DecodeRecord<'a> {
    /// Version of the record.
    pub schema: u32,
    /// Number of the frame in the recording, from 1.
    pub frame: u64,
    /// Seconds since the first frame; absent where the recording has no times.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
    /// Name of the interface, where the recording has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interface: Option<&'a str>,
    /// What the frame was decoded as.
    pub protocol: &'a str,
    /// Bytes of the frame on the network.
    pub bytes: u32,
    /// What the frame is, in a line.
    pub text: Cow<'a, str>,
    /// What stands in it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub fields: Vec<Field<'a>>,
}

/// A line of the tree of a frame.
#[derive(Debug, PartialEq, Serialize, JsonSchema)]
pub struct Field<'a> {
    /// The line.
    pub text: Cow<'a, str>,
    /// What stands before `: ` or ` = `, where the line has a value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<Cow<'a, str>>,
    /// The value: a number where the line has one, else the text behind the name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<FieldValue<'a>>,
    /// What belongs to it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub fields: Vec<Field<'a>>,
}

/// A value of a line.
#[derive(Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum FieldValue<'a> {
    /// A whole number.
    Integer(i64),
    /// Another number.
    Number(f64),
    /// Anything else.
    Text(Cow<'a, str>),
}

impl Protocol {
    /// As the records have it.
    const fn name(self) -> &'static str {
        match self {
            Self::EtherNetIp => "ethernet-ip",
            Self::Sercos => "sercos",
            Self::Can => "can",
            Self::Other => "other",
        }
    }
}

impl<'a> DecodeRecord<'a> {
    /// The record of a frame with this tree.
    pub(super) fn new(frame: &Frame<'a>, time: Option<f64>, protocol: Protocol, tree: &'a str) -> Self {
        let mut lines = tree.lines();
        // The first line begins with number, time, interface and length, which have fields of their own.
        let head = lines.next().unwrap_or_default();
        let text = head.split_once(" bytes: ").map_or(head, |(_, text)| text);
        let lines: Vec<(usize, &str)> = lines
            .map(|line| {
                let text = line.trim_start_matches(' ');
                ((line.len() - text.len()) / 2, text)
            })
            .collect();
        Self {
            schema: SCHEMA,
            frame: frame.number,
            time,
            interface: frame.interface_name,
            protocol: protocol.name(),
            bytes: frame.original_len,
            text: text.into(),
            fields: tree_of(&lines),
        }
    }
}

/// The tree of lines with their levels.
fn tree_of<'a>(lines: &[(usize, &'a str)]) -> Vec<Field<'a>> {
    let mut fields = Vec::new();
    let mut rest = lines;
    while let Some(((level, text), below)) = rest.split_first() {
        let end = below.iter().position(|(deeper, _)| deeper <= level).unwrap_or(below.len());
        let mut field = Field::of(text);
        field.fields = tree_of(&below[..end]);
        fields.push(field);
        rest = &below[end..];
    }
    fields
}

impl<'a> Field<'a> {
    fn of(text: &'a str) -> Self {
        let split = text.split_once(" = ").or_else(|| text.split_once(": "));
        let (name, value) = split.map_or((None, None), |(name, value)| (Some(name), Some(value)));
        let value = value.map(|value| match (value.parse::<i64>(), value.parse::<f64>()) {
            (Ok(number), _) => FieldValue::Integer(number),
            (_, Ok(number)) if number.is_finite() => FieldValue::Number(number),
            _ => FieldValue::Text(value.into()),
        });
        Self { text: text.into(), name: name.map(Cow::from), value, fields: Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_become_fields_with_their_values() {
        let tree = tree_of(&[
            (1, "CIP Motion"),
            (2, "Command Position: 250000 (DINT)"),
            (2, "Actual Velocity: 0.5"),
            (1, "S-0-0040 = -3"),
        ]);
        let json = serde_json::to_string(&tree).unwrap();
        let expected = concat!(
            r#"[{"text":"CIP Motion","fields":[{"text":"Command Position: 250000 (DINT)","name":"Command Position","value":"250000 (DINT)"},"#,
            r#"{"text":"Actual Velocity: 0.5","name":"Actual Velocity","value":0.5}]},{"text":"S-0-0040 = -3","name":"S-0-0040","value":-3}]"#
        );
        assert_eq!(json, expected);
    }
}
