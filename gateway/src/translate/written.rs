//! The cyclic write data of an update.

use profile_cip::device::drive_link::Trims;
use profile_cip::wire::motion::{ActualFrame, WriteBlock};
use profile_cip::wire::status::GeneralStatus;
use profile_generic::image::{AxisCommand, Signal};

use super::stage::StageAxis;
use super::{Node, TranslateError, Translator, shown};
use crate::mapping::{AttributeEntry, Backing};

impl Translator {
    /// What cyclic write data say, by the list that a line before has reported, and what became of the trims among them.
    pub(super) fn written_cyclically(&mut self, number: usize, block: &WriteBlock<'_>) -> Node {
        let mut node = Node::new(format!("cyclic write block: {}", block.to_string().trim()));
        let stage = std::sync::Arc::clone(&self.stage);
        let axis = &stage.axes[number];
        let status = self.write_status(number);
        let mut at = 0_usize;
        for id in self.writes.get(&number).into_iter().flatten() {
            let name =
                stage.mapping.dictionaries.cip.attribute_by_id(*id).map_or("", |row| row.name.as_str());
            let Some(entry) = axis.attributes.get(*id).filter(|entry| entry.length.is_none()) else {
                node.push(Node::new(format!("attribute {id} {name}: not served, or no single number")));
                break;
            };
            let Some(width) = entry.data_type.width() else { break };
            at = at.next_multiple_of(width.bytes().min(4));
            let Some(value) = block.data.get(at..at + width.bytes()) else { break };
            at += value.len();
            let number = number_of(width, value);
            let trim = trim_of(entry).filter(|_| status == Some(0));
            let text = match trim {
                Some(signal) => {
                    let value = trimmed(axis, *id, &number, signal).unwrap_or_default();
                    format!("{name} {number} -> {signal} {}", shown(axis, signal, value))
                }
                None => format!("{name} {number}"),
            };
            node.push(Node::new(text).by(stage.mapping.attribute_row(*id)));
        }
        if let Some(status) = status {
            node.push(Node::new(format!("Cyclic Write Status: {}", GeneralStatus(status))));
        }
        node
    }

    /// What the device says of the newest cyclic write data of an axis.
    fn write_status(&mut self, number: usize) -> Option<u8> {
        let instance = self.stage.axes[number].instance;
        let update = self.bench().ok()?.actual(number);
        let frame = ActualFrame::parse(&update).ok()?;
        let read = frame.instances().find(|known| known.number == instance)?.read?;
        Some(read.write_status)
    }

    /// The list of an axis's cyclic write data.
    pub(super) fn list_writes(&mut self, number: usize, attributes: &[u16]) -> Result<Node, TranslateError> {
        self.writes.insert(number, attributes.to_vec());
        let ids = attributes.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
        let mut node = Node::new(format!("axis {}: updates write {ids}", self.stage.axes[number].name));
        match self.bench()?.list_writes(number, attributes) {
            None => node.push(Node::new("no answer")),
            Some((status, each)) => {
                node.push(Node::new(format!("Set_Cyclic_Write_List: {}", GeneralStatus(status))));
                for (id, status) in each.into_iter().filter(|(_, status)| *status != 0) {
                    node.push(Node::new(format!("attribute {id}: {}", GeneralStatus(status))));
                }
            }
        }
        Ok(node)
    }
}

/// What the program of the axis makes of a trim. What the telegram has of it stands with its other values.
fn trimmed(axis: &StageAxis, id: u16, number: &str, signal: Signal) -> Option<i64> {
    let (mut trims, mut command) = (Trims::default(), AxisCommand::default());
    trims.set(id, number.parse().ok()?);
    axis.north.decode_trims(&trims, &mut command);
    command.get(signal)
}

/// The signal of a trim.
fn trim_of(entry: &AttributeEntry) -> Option<Signal> {
    match entry.backing {
        Backing::Signal { signal, .. } if signal.is_command() => Some(signal),
        _ => None,
    }
}

/// A number as people write it.
fn number_of(width: profile_generic::program::Width, bytes: &[u8]) -> String {
    use profile_generic::program::Width;
    match (width, bytes) {
        (Width::F32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]).to_string(),
        (Width::F64, &[a, b, c, d, e, f, g, h]) => f64::from_le_bytes([a, b, c, d, e, f, g, h]).to_string(),
        _ => width.integer(bytes).map_or_else(String::new, |number| number.to_string()),
    }
}
