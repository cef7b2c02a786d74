//! The cyclic write data of an update.

use profile_cip::device::drive_link::Trims;
use profile_cip::wire::motion::WriteBlock;
use profile_generic::image::AxisCommand;
use profile_generic::program::Width;

use super::{Node, Translator, shown};
use crate::mapping::{Access, AttributeEntry, Backing};

impl Translator {
    /// What cyclic write data say, by the list that a line before has told, and the trims among them.
    pub(super) fn written_cyclically(&mut self, instance: u8, block: &WriteBlock<'_>) -> (Node, Trims) {
        let mut trims = Trims::default();
        let mut node = Node::new(format!("cyclic write block: {}", block.to_string().trim()));
        let Some(number) = self.axis_of_instance(instance) else { return (node, trims) };
        let (mut at, mut good) = (0_usize, true);
        for id in self.states[number].writes.clone() {
            let entry = self.stage.axes[number].attributes.get(id);
            let width =
                entry.filter(|entry| entry.length.is_none()).and_then(|entry| entry.data_type.width());
            let Some((entry, width)) = entry.zip(width) else {
                node.push(Node::new(format!("attribute {id}: not served, or no single number")));
                return (node, Trims::default());
            };
            at = at.next_multiple_of(width.bytes().min(4));
            let Some(value) = block.data.get(at..at + width.bytes()) else {
                good = false;
                break;
            };
            at += value.len();
            let told = match number_of(entry, width, value) {
                Some(value) => {
                    good &= value.is_finite();
                    self.trim(number, entry.id, value, &mut trims)
                }
                None => self.set(number, id, value).unwrap_or_else(|error| Node::new(error.to_string())),
            };
            node.push(told);
        }
        let listed = !self.states[number].writes.is_empty();
        if listed && (!good || at.next_multiple_of(4) != block.data.len()) {
            node.push(Node::new("no data of this list: refused as a whole, trims are zero"));
            trims = Trims::default();
        }
        (node, trims)
    }

    /// A trim, and the signal that it becomes.
    fn trim(&self, number: usize, id: u16, value: f64, trims: &mut Trims) -> Node {
        let (axis, mapping) = (&self.stage.axes[number], &self.stage.mapping);
        let mut one = Trims::default();
        one.set(id, value);
        let mut command = AxisCommand::default();
        axis.north.decode_trims(&one, &mut command);
        trims.set(id, value);
        let name = mapping.dictionaries.cip.attribute_by_id(id).map_or("", |row| row.name.as_str());
        let signal = profile_generic::image::Signal::OFFSETS
            .into_iter()
            .find_map(|signal| Some((signal, command.get(signal)?)));
        let text = match signal {
            Some((signal, generic)) => format!("{name} {value} -> {signal} {}", shown(axis, signal, generic)),
            None => format!("{name} {value}: no number"),
        };
        Node::new(text).by(mapping.attribute_row(id))
    }

    /// The list of an axis's cyclic write data.
    pub(super) fn list_writes(&mut self, number: usize, attributes: &[u16]) -> Node {
        self.states[number].writes = attributes.to_vec();
        let ids = attributes.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
        Node::new(format!("axis {}: updates write {ids}", self.stage.axes[number].name))
    }
}

/// The value of a trim; `None` of an attribute that is none.
fn number_of(entry: &AttributeEntry, width: Width, bytes: &[u8]) -> Option<f64> {
    let is_trim = entry.access == Access::SetCyclic && matches!(entry.backing, Backing::Signal { .. });
    let number = match (width, bytes) {
        (Width::F32, &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
        (Width::F64, &[a, b, c, d, e, f, g, h]) => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
        _ => f64::from(i32::try_from(width.integer(bytes)?).ok()?),
    };
    is_trim.then_some(number)
}
