//! Attributes, IDNs and objects beside the cyclic data.

use super::stage::StageAxis;
use super::tree::hex;
use super::{Node, TranslateError, Translator, quantity};
use crate::mapping::{Access, Backing, CipFault, Item, ParameterEntry, ValueError};

impl Translator {
    /// The controller sets an attribute of an axis.
    pub(super) fn set(&mut self, number: usize, id: u16, bytes: &[u8]) -> Result<Node, TranslateError> {
        let axis = &self.stage.axes[number];
        let mapping = &self.stage.mapping;
        let Some(known) = mapping.dictionaries.cip.attribute_by_id(id) else {
            return Err(TranslateError::Value(format!(
                "attribute {id}: the axis object has no such attribute"
            )));
        };
        let mut node =
            Node::new(format!("axis {}: set attribute {id} {} to {}", axis.name, known.name, hex(bytes)));
        let rejected = mapping.cip.rejected.iter().find(|(rejected, _)| *rejected == id);
        if let Some((_, reason)) = rejected {
            node.push(Node::new(format!("not supported: {reason}")));
            return Ok(node);
        }
        let Some(entry) = axis.attributes.get(id) else {
            node.push(Node::new("no row: not supported"));
            return Ok(node);
        };
        let row = mapping.attribute_row(id);
        match entry.backing {
            Backing::Device => node.push(Node::new("served by the device").by(row)),
            Backing::Connection => node.push(Node::new("written by the connection").by(row)),
            Backing::Shadow => {
                node.push(Node::new("stored and given back, without effect on the drive").by(row))
            }
            Backing::Constant(value) => node.push(Node::new(format!("always {value}")).by(row)),
            Backing::Signal { signal, .. } if entry.access == Access::SetCyclic => {
                let text = format!("shows {signal}, set by cyclic write data only: refused");
                node.push(Node::new(text).by(row));
            }
            Backing::Signal { signal, .. } => {
                node.push(Node::new(format!("shows {signal}, cannot be set")).by(row));
            }
            Backing::Parameter { parameter, reject, .. } => {
                let value = match entry.to_generic(bytes) {
                    Ok(value) => value,
                    Err(error @ (ValueError::Length { .. } | ValueError::NotConvertible)) => {
                        return Err(TranslateError::Value(format!("attribute {id} {}: {error}", known.name)));
                    }
                    Err(error) => {
                        node.push(Node::new(format!("refused: {error}")).by(row));
                        return Ok(node);
                    }
                };
                let measured = parameter
                    .row()
                    .map_or_else(|| value.to_string(), |row| quantity(axis, row.quantity, value));
                node.push(Node::new(format!("{parameter} {measured}")).by(row));
                match axis.south.parameter(parameter) {
                    Some(place) => node.push(self.written(axis, place, value)),
                    None if reject => node.push(Node::new("the drive has no such parameter: refused")),
                    None => node.push(Node::new("the drive has no such parameter: stored only")),
                }
            }
        }
        Ok(node)
    }

    fn written(&self, axis: &StageAxis, place: &ParameterEntry, value: i64) -> Node {
        let row = axis.parameter_row(&self.stage.mapping, place.parameter);
        let name = self.named(place.item);
        match place.encode(value) {
            None => Node::new(format!("{name}: can only be read")).by(row),
            Some((bytes, len, clamped)) => {
                let clamped = if clamped { ", clamped" } else { "" };
                Node::new(format!("{name}: write {} ({} bytes{clamped})", hex(&bytes[..len]), len)).by(row)
            }
        }
    }

    /// A drive gives element 7 of an IDN, or an object.
    pub(super) fn held(&mut self, number: usize, item: Item, bytes: &[u8]) -> Result<Node, TranslateError> {
        let axis = &self.stage.axes[number];
        let mapping = &self.stage.mapping;
        let mut node = Node::new(format!("{}: {} is {}", axis.drive, self.named(item), hex(bytes)));
        let word = match *bytes {
            [a, b] => Some(u32::from(u16::from_le_bytes([a, b]))),
            [a, b, c, d] => Some(u32::from_le_bytes([a, b, c, d])),
            _ => None,
        };
        let is_diagnostic = match item {
            Item::Idn(idn) => mapping.sercos.is_diagnostic(idn),
            Item::Object(_) | Item::Attribute(_) => axis.south.is_diagnostic(item),
        };
        if let Some(word) = word.filter(|_| is_diagnostic) {
            self.causes(number, item, word, &mut node);
            return Ok(node);
        }
        for place in axis.south.parameters().iter().filter(|place| place.item == item) {
            let Some(value) = place.decode(bytes) else {
                let text = format!(
                    "{}: expected {} bytes, got {}",
                    self.named(item),
                    place.width.bytes(),
                    bytes.len()
                );
                return Err(TranslateError::Value(text));
            };
            let measured = place
                .parameter
                .row()
                .map_or_else(|| value.to_string(), |row| quantity(axis, row.quantity, value));
            let mut read = Node::new(format!("{} {measured}", place.parameter))
                .by(axis.parameter_row(mapping, place.parameter));
            for entry in axis.attributes.entries() {
                let Backing::Parameter { parameter, .. } = entry.backing else { continue };
                if parameter != place.parameter {
                    continue;
                }
                let mut out = [0; 8];
                let seen = match entry.from_generic(value, &mut out) {
                    Ok((len, clamped)) => {
                        let clamped = if clamped { ", clamped" } else { "" };
                        format!("reads {}{clamped}", hex(&out[..len]))
                    }
                    Err(error) => error.to_string(),
                };
                let name =
                    mapping.dictionaries.cip.attribute_by_id(entry.id).map_or("", |row| row.name.as_str());
                read.push(
                    Node::new(format!("attribute {} {name} {seen}", entry.id))
                        .by(mapping.attribute_row(entry.id)),
                );
            }
            node.push(read);
        }
        if node.children.is_empty() {
            node.push(Node::new("no row"));
        }
        Ok(node)
    }

    /// What a word says is wrong, and how the controller sees it.
    pub(super) fn causes(&self, number: usize, item: Item, word: u32, node: &mut Node) {
        let (axis, mapping) = (&self.stage.axes[number], &self.stage.mapping);
        let mut any = false;
        for (cause, reaction) in axis.south.faults(item, word) {
            let mut fault = Node::new(format!("{cause}, reaction {reaction}"))
                .by(axis.fault_row(mapping, item, word, cause));
            let seen = match axis.north.fault(cause) {
                Some(CipFault::Axis { fault_type, alarm_type, code }) => {
                    let alarm =
                        alarm_type.map_or_else(String::new, |kind| format!(", as an alarm of type {kind}"));
                    format!("Axis Fault Type {fault_type}, code {code}{alarm}")
                }
                Some(CipFault::Node(code)) => format!("Node Fault Code {code}"),
                None => "no CIP exception".to_owned(),
            };
            fault.push(Node::new(seen).by(mapping.exception_row(cause)));
            node.push(fault);
            any = true;
        }
        if !any {
            node.push(Node::new("nothing is wrong"));
        }
    }
}
