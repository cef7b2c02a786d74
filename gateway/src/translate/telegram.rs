//! The values of a drive's telegrams as text, and telegrams to it that were recorded, read back.

use profile_cia402::master::config::Direction;
use profile_generic::program::{Field, Width};

use super::stage::{Behind, CanDrive, StageAxis};
use super::tree::hex;
use super::{Node, Translator, devicenet, shown};
use crate::mapping::{Cia402Dictionary, Item};

impl Translator {
    /// What stands in a telegram from the master, read back.
    pub(super) fn command_values(&self, number: usize, bytes: &[u8]) -> Node {
        let axis = &self.stage.axes[number];
        let mut node = Node::new(sent(axis, bytes));
        if let (Some(item), Some(word)) = (axis.south.telegram.command.first(), bytes.first_chunk()) {
            node.push(Node::new(format!("{} {:#06x}", self.named(*item), u16::from_le_bytes(*word))));
        }
        for (field, item) in axis.south.command_fields() {
            node.push(self.command_value(number, field, item, bytes));
        }
        node
    }

    /// A value of it.
    pub(super) fn command_value(&self, number: usize, field: &Field, item: Item, bytes: &[u8]) -> Node {
        let axis = &self.stage.axes[number];
        let value =
            generic_of(field, bytes).map_or_else(String::new, |value| shown(axis, field.signal, value));
        let text = format!("{}: {} = {} {value}", self.named(item), raw(axis, field, bytes), field.signal);
        Node::new(text).by(axis.signal_row(&self.stage.mapping, field.signal))
    }

    /// An IDN or object with its name.
    pub(super) fn named(&self, item: Item) -> String {
        let dictionaries = &self.stage.mapping.dictionaries;
        let name = match item {
            Item::Idn(idn) => dictionaries.sercos.idn(idn).map(|row| row.name.clone()),
            Item::Attribute(_) => None,
            Item::Object(object) => {
                let index = Cia402Dictionary::on_first_axis(object.index);
                let row = dictionaries.cia402.object(index);
                row.map(|row| match row.sub(object.sub).map(|sub| sub.name.as_str()) {
                    Some(sub) if object.sub > 0 && !sub.is_empty() => format!("{}, {sub}", row.name),
                    _ => row.name.clone(),
                })
            }
        };
        name.map_or_else(|| item.to_string(), |name| format!("{item} {name}"))
    }
}

/// What goes to a drive, in the frames that carry it.
pub(super) fn sent(axis: &StageAxis, bytes: &[u8]) -> String {
    match &axis.behind {
        Behind::Sercos(_) => {
            format!("MDT of {}, connection 0, {} bytes: {}", axis.drive, bytes.len(), hex(bytes))
        }
        Behind::Can(drive) => frames(&axis.drive, drive, Direction::Receive, bytes),
        Behind::Devicenet(_) => devicenet::poll_of(axis, bytes),
    }
}

/// The PDOs of a drive with the values of its program.
pub(super) fn frames(name: &str, drive: &CanDrive, direction: Direction, bytes: &[u8]) -> String {
    let pdos = drive.pdos.iter().filter(|pdo| pdo.direction == direction);
    let text = pdos.map(|pdo| format!("{pdo} {}", hex(&CanDrive::spread(pdo, bytes))));
    format!("PDOs of {name}: {}", text.collect::<Vec<_>>().join(", "))
}

/// The bytes of a field, the number in them, and where they stand in which frame.
pub(super) fn raw(axis: &StageAxis, field: &Field, telegram: &[u8]) -> String {
    let (start, bytes) = (usize::from(field.offset), bytes_of(field, telegram));
    let number = field.width.integer(bytes).filter(|_| !field.width.is_float());
    let number = number.map_or_else(String::new, |number| format!("{number} "));
    let way = if field.signal.is_command() { Direction::Receive } else { Direction::Transmit };
    let place = match axis.can().map(|drive| drive.place(way, start)) {
        None => start.to_string(),
        Some(Some((pdo, at))) => format!("{at} of {}{}", pdo.kind(), pdo.number),
        Some(None) => "no place".to_owned(),
    };
    format!("{number}({} at {place})", hex(bytes))
}

/// The bytes of a field; none of one that is not there.
pub(super) fn bytes_of<'t>(field: &Field, telegram: &'t [u8]) -> &'t [u8] {
    let start = usize::from(field.offset);
    telegram.get(start..start + field.width.bytes()).unwrap_or_default()
}

/// The generic value of a field of commands.
pub(super) fn generic_of(field: &Field, telegram: &[u8]) -> Option<i64> {
    let (back, bytes) = (field.conversion.inverse()?, bytes_of(field, telegram));
    if field.width == Width::F32 {
        return Some(back.convert_f64(f32::from_le_bytes(*bytes.first_chunk()?).into())?.value);
    }
    Some(back.convert(field.width.integer(bytes)?).value)
}
