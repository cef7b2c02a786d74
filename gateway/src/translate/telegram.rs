//! The values of a drive's telegrams as text, and telegrams to it that were recorded, read back.

use std::fmt::Write as _;
use std::sync::Arc;

use profile_cia402::master::config::Direction;
use profile_generic::program::{Field, Width};

use super::fact::{Direction as Way, Fact, Raw, What};
use super::stage::{Behind, CanDrive, StageAxis};
use super::tree::{hex, text};
use super::{Node, Translator, devicenet, shown};
use crate::mapping::Item;

/// Room for a number, its bytes and their place.
const RAW_LEN: usize = 48;

impl Translator {
    /// What stands in a telegram from the master, read back.
    pub(super) fn command_values(&self, number: usize, bytes: &[u8]) -> Node {
        let axis = &self.stage.axes[number];
        let mut node = Node::new(sent(axis, bytes)).about(number);
        if let (Some(item), Some(word)) = (axis.south.telegram.command.first(), bytes.first_chunk()) {
            let word = u16::from_le_bytes(*word);
            let fact = self.sent_word(number, word, 0, bytes);
            node.push(Node::new(text!("{} {word:#06x}", self.named(*item))).shows([fact]));
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
        let text = text!("{}: {} = {} {value}", self.named(item), raw(axis, field, bytes), field.signal);
        self.sent_value(number, text, field, bytes)
    }

    /// The line of a value that was sent to a drive.
    pub(super) fn sent_value(&self, number: usize, text: String, field: &Field, bytes: &[u8]) -> Node {
        let axis = &self.stage.axes[number];
        let what = What::Signal(field.signal, generic_of(field, bytes));
        let raw = Some(Raw::of_field(axis, field, bytes));
        let fact = Fact { axis: number, direction: Way::ToDrive, recorded: true, what, raw };
        Node::new(text).by(axis.signal_row(&self.stage.mapping, field.signal)).shows([fact])
    }

    /// A control word that was sent to a drive.
    pub(super) fn sent_word(&self, number: usize, word: u16, at: usize, bytes: &[u8]) -> Fact {
        let raw = Raw::of_word(&self.stage.axes[number], true, at, bytes);
        Fact { axis: number, direction: Way::ToDrive, recorded: true, what: What::ControlWord(word), raw }
    }

    /// An IDN or object with its name.
    pub(super) fn named(&self, item: Item) -> Arc<str> {
        self.stage.label(item)
    }
}

/// What goes to a drive, in the frames that carry it.
pub(super) fn sent(axis: &StageAxis, bytes: &[u8]) -> String {
    match &axis.behind {
        Behind::Sercos(_) => {
            text!("MDT of {}, connection 0, {} bytes: {}", axis.drive, bytes.len(), hex(bytes))
        }
        Behind::Can(drive) => frames(&axis.drive, drive, Direction::Receive, bytes),
        Behind::Devicenet(_) => devicenet::poll_of(axis, bytes),
    }
}

/// The PDOs of a drive with the values of its program.
pub(super) fn frames(name: &str, drive: &CanDrive, direction: Direction, bytes: &[u8]) -> String {
    let pdos = drive.pdos.iter().filter(|pdo| pdo.direction == direction);
    let text = pdos.map(|pdo| text!("{pdo} {}", hex(&CanDrive::spread(pdo, bytes))));
    text!("PDOs of {name}: {}", text.collect::<Vec<_>>().join(", "))
}

/// The bytes of a field, the number in them, and where they stand in which frame.
pub(super) fn raw(axis: &StageAxis, field: &Field, telegram: &[u8]) -> String {
    let (start, bytes) = (usize::from(field.offset), bytes_of(field, telegram));
    let mut text = String::with_capacity(RAW_LEN);
    // Writing to a string does not fail.
    if let Some(number) = field.width.integer(bytes).filter(|_| !field.width.is_float()) {
        let _ = write!(text, "{number} ");
    }
    let way = if field.signal.is_command() { Direction::Receive } else { Direction::Transmit };
    let _ = match axis.can().map(|drive| drive.place(way, start)) {
        None => write!(text, "({} at {start})", hex(bytes)),
        Some(Some((pdo, at))) => write!(text, "({} at {at} of {}{})", hex(bytes), pdo.kind(), pdo.number),
        Some(None) => write!(text, "({} at no place)", hex(bytes)),
    };
    text
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
