//! Attributes, IDNs and objects beside the cyclic data.

use std::sync::Arc;

use profile_cip::wire::status::GeneralStatus;
use profile_generic::fault_set::{ActiveFault, Origin};

use super::fact::{Carrier, Direction, Fact, Raw, What};
use super::tree::{hex, text};
use super::{Node, TranslateError, Translator, quantity};
use crate::mapping::{Access, Backing, CipFault, Item, ValueError};

impl Translator {
    /// The controller sets an attribute of an axis.
    pub(super) fn set(&mut self, number: usize, id: u16, bytes: &[u8]) -> Result<Node, TranslateError> {
        let stage = Arc::clone(&self.stage);
        let (axis, mapping) = (&stage.axes[number], &stage.mapping);
        let Some(known) = mapping.dictionaries.cip.attribute_by_id(id) else {
            return Err(TranslateError::Value(text!(
                "attribute {id}: the axis object has no such attribute"
            )));
        };
        let mut node =
            Node::new(text!("axis {}: set attribute {id} {} to {}", axis.name, known.name, hex(bytes)))
                .about(number);
        if let Some((_, reason)) = mapping.cip.rejected.iter().find(|(rejected, _)| *rejected == id) {
            node.push(Node::new(text!("not supported: {reason}")));
        }
        let Some(entry) = axis.attributes.get(id) else {
            let (reply, _) = self.bench()?.set(number, id, bytes);
            node.push(Node::new("no row"));
            let status = reply.map(|reply| GeneralStatus(reply.general_status).to_string());
            node.push(Node::new(text!("answer: {}", status.as_deref().unwrap_or("none"))));
            return Ok(node);
        };
        let row = mapping.attribute_row(id);
        let (what, place) = match entry.backing {
            Backing::Device => ("served by the device".to_owned(), None),
            Backing::Connection => ("written by the connection".to_owned(), None),
            Backing::Stored => ("stored and given back, without effect".to_owned(), None),
            Backing::Constant(value) => (text!("always {value}"), None),
            Backing::Mechanics(_) => ("compared with the scaling of the drive".to_owned(), None),
            Backing::Signal { signal, .. } if entry.access == Access::SetCyclic => {
                (text!("shows {signal}, set by cyclic write data only"), None)
            }
            Backing::Signal { signal, .. } => (text!("shows {signal}, cannot be set"), None),
            Backing::Parameter { parameter, .. } => {
                let value = match entry.to_generic(bytes) {
                    Ok(value) => mapping
                        .dictionaries
                        .generic
                        .by_number(parameter)
                        .map_or_else(|| value.to_string(), |row| quantity(axis, row.quantity, value)),
                    Err(error @ (ValueError::Length { .. } | ValueError::NotConvertible)) => {
                        return Err(TranslateError::Value(text!("attribute {id} {}: {error}", known.name)));
                    }
                    Err(error) => error.to_string(),
                };
                let place = axis.south.parameter(parameter);
                let is_computed = mapping.dictionaries.generic.computation(parameter).is_some();
                let lacks = match place {
                    _ if is_computed => ", which is computed",
                    None => ": the drive has no such parameter",
                    Some(_) => "",
                };
                let name = &mapping.parameter_name(parameter);
                (text!("{name} {value}{lacks}"), place)
            }
        };
        node.push(Node::new(what).by(row));
        let (reply, written) = self.bench()?.set(number, id, bytes);
        for (item, bytes) in written {
            let width = place.map_or(bytes.len(), |place| place.width.bytes());
            let row = place.and_then(|place| axis.parameter_row(mapping, place.parameter));
            let bytes = bytes.get(..width).unwrap_or(&bytes);
            let text = text!("{}: write {} ({} bytes)", self.named(item), hex(bytes), bytes.len());
            node.push(Node::new(text).by(row));
        }
        node.push(Node::new(match reply {
            Some(reply) => text!("answer: {}", GeneralStatus(reply.general_status)),
            None => "no answer".to_owned(),
        }));
        Ok(node)
    }

    /// A drive gives element 7 of an IDN, or an object.
    pub(super) fn held(&mut self, number: usize, item: Item, bytes: &[u8]) -> Result<Node, TranslateError> {
        let stage = Arc::clone(&self.stage);
        let (axis, mapping) = (&stage.axes[number], &stage.mapping);
        let mut node =
            Node::new(text!("{}: {} is {}", axis.drive, self.named(item), hex(bytes))).about(number);
        if axis.south.is_diagnostic(item) {
            self.causes(number, item, bytes, &mut node)?;
            return Ok(node);
        }
        for place in axis.south.parameters().iter().filter(|place| place.item == item) {
            let Some(value) = place.decode(bytes) else {
                let text = text!(
                    "{}: expected {} bytes, got {}",
                    self.named(item),
                    place.width.bytes(),
                    bytes.len()
                );
                return Err(TranslateError::Value(text));
            };
            let measured = mapping
                .dictionaries
                .generic
                .by_number(place.parameter)
                .map_or_else(|| value.to_string(), |row| quantity(axis, row.quantity, value));
            let mut read = Node::new(text!("{} {measured}", mapping.parameter_name(place.parameter)))
                .by(axis.parameter_row(mapping, place.parameter));
            for entry in axis.attributes.entries() {
                let Backing::Parameter { parameter, .. } = entry.backing else { continue };
                if parameter != place.parameter {
                    continue;
                }
                let bench = self.bench()?;
                bench.hold(number, item, place.width.integer(bytes).unwrap_or_default(), bytes.len());
                let answer = bench.get(number, entry.id);
                bench.release();
                let seen = match answer {
                    Some(reply) if reply.general_status == 0 => text!("reads {}", hex(&reply.data)),
                    Some(reply) => text!("answers {}", GeneralStatus(reply.general_status)),
                    None => "is not answered".to_owned(),
                };
                let name =
                    mapping.dictionaries.cip.attribute_by_id(entry.id).map_or("", |row| row.name.as_str());
                read.push(
                    Node::new(text!("attribute {} {name} {seen}", entry.id))
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

    /// What the box finds wrong by a word of a drive, and how the controller sees it.
    pub(super) fn causes(
        &mut self,
        number: usize,
        item: Item,
        bytes: &[u8],
        node: &mut Node,
    ) -> Result<(), TranslateError> {
        let stage = Arc::clone(&self.stage);
        let (axis, mapping) = (&stage.axes[number], &stage.mapping);
        let mut word = [0; 4];
        word.iter_mut().zip(bytes).for_each(|(place, byte)| *place = *byte);
        let word = u32::from_le_bytes(word);
        let bench = self.bench()?;
        bench.take_notices();
        let mut found = Vec::new();
        // A drive shows an error for what stops it, and a warning otherwise.
        let reads = |stops: &bool| axis.south.diagnostic_words(*stops).any(|known| known == item);
        let shows = |stops: &bool| {
            axis.south.faults(item, word).any(|(_, reaction)| reaction.stops() == *stops) && reads(stops)
        };
        let mut kinds: Vec<bool> = [true, false].into_iter().filter(shows).collect();
        if kinds.is_empty() {
            kinds.extend([true, false].into_iter().find(reads));
        }
        for stops in kinds {
            let before = bench.diagnose(number, item, word, stops);
            let faults = bench.engine().axes()[number].faults();
            let drive = |active: &&ActiveFault| matches!(active.origin, Origin::Drive | Origin::Warning);
            found.extend(faults.filter(drive).map(|active| active.fault));
            bench.recover(number, before);
        }
        let reports = |cause| Fact {
            axis: number,
            direction: Direction::FromDrive,
            recorded: true,
            what: What::Fault(cause),
            raw: Some(Raw::new(bytes, Some(word.into()), Some(0), Carrier::Object)),
        };
        for fault in &found {
            let (cause, reaction) = (fault.cause, fault.reaction);
            let has_row = axis.south.faults(item, word).any(|(known, _)| known == cause);
            let row = has_row.then(|| axis.fault_row(mapping, item, word, cause)).flatten();
            let mut shown =
                Node::new(text!("{cause}, reaction {reaction}")).by(row).shows([reports(Some(cause))]);
            let seen = match axis.north.fault(cause) {
                Some(CipFault::Axis { fault_type, alarm_type, code }) => {
                    let alarm =
                        alarm_type.map_or_else(String::new, |kind| text!(", as an alarm of type {kind}"));
                    text!("Axis Fault Type {fault_type}, code {code}{alarm}")
                }
                Some(CipFault::Node(code)) => text!("Node Fault Code {code}"),
                None => "no CIP exception".to_owned(),
            };
            shown.push(Node::new(seen).by(mapping.exception_row(cause)));
            node.push(shown);
        }
        if found.is_empty() {
            node.push(Node::new("nothing is wrong").shows([reports(None)]));
        }
        Ok(())
    }
}
