//! Frames of a CAN bus: PDOs, EMCY, SYNC.

use std::sync::Arc;

use profile_cia402::master::config::Direction;
use profile_cia402::wire::Function;
use profile_cia402::wire::emcy::Emcy;
use profile_generic::can::{Frame, Id};

use super::stage::{CanDrive, CanPdo, StageAxis};
use super::tree::{hex, text};
use super::{Node, TranslateError, Translator};
use crate::mapping::Item;

impl Translator {
    /// Takes a frame of a CANopen bus; `None` of one that says nothing of a drive. `bus` is its number in the configuration,
    /// where it is known.
    pub(super) fn can(&mut self, bus: Option<usize>, frame: &Frame) -> Option<Result<Node, TranslateError>> {
        let Id::Standard(id) = frame.id() else { return None };
        if frame.is_remote() || frame.is_fd() {
            return None;
        }
        let stage = Arc::clone(&self.stage);
        let mut found = Vec::new();
        let on_bus = |axis: &StageAxis| axis.may_be_on(bus);
        for (number, axis) in stage.axes.iter().enumerate().filter(|(_, axis)| on_bus(axis)) {
            let pdos = axis.can().map(|drive| drive.pdos.as_slice()).unwrap_or_default();
            found.extend(pdos.iter().filter(|pdo| pdo.id == id).map(|pdo| (number, pdo)));
        }
        if let Some((number, _)) = found.iter().find(|(number, _)| self.unfit.contains(number)) {
            let drive = &stage.axes[*number].drive;
            let text = text!("{drive}: not translated, the recording does not fit the configuration");
            return Some(Err(TranslateError::Value(text)));
        }
        if let [(_, first), ..] = found.as_slice() {
            let mut node = Node::new(text!("{first}: {}", hex(frame.data())));
            for (number, pdo) in found {
                let told = match pdo.direction {
                    Direction::Receive => self.rpdo(number, pdo, frame.data()),
                    Direction::Transmit => self.tpdo(number, pdo, frame.data()),
                };
                match told {
                    Ok(told) => node.push(told),
                    Err(error) => return Some(Err(error)),
                }
            }
            return Some(Ok(node));
        }
        match Function::of(frame.id())? {
            Function::Sync => {
                let states = self.states.iter_mut().zip(&self.stage.axes);
                states.filter(|(_, axis)| on_bus(axis)).for_each(|(state, _)| state.heard.clear());
                Some(Ok(Node::new("SYNC")))
            }
            Function::Emcy(node) => self.emcy(bus, node.get(), frame.data()),
            _ => None,
        }
    }

    /// What a drive is told, read back.
    fn rpdo(&self, number: usize, pdo: &CanPdo, data: &[u8]) -> Result<Node, TranslateError> {
        let axis = &self.stage.axes[number];
        let mut node = Node::new(text!("axis {} on {}", axis.name, axis.drive)).about(number);
        let mut values = vec![0; usize::from(axis.south.telegram.command_bytes)];
        if !CanDrive::gather(pdo, data, &mut values) {
            return Err(short(pdo, data));
        }
        let there = |at: usize| pdo.parts.iter().any(|part| part.flat == at);
        for item in axis.south.heads_of_command() {
            let Some((at, len)) = axis.south.place_of_command(item).filter(|(at, _)| there(*at)) else {
                continue;
            };
            let bytes = values.get(at..at + len).unwrap_or_default();
            let fact = match *bytes {
                [low, high] => Some(self.sent_word(number, u16::from_le_bytes([low, high]), at, &values)),
                _ => None,
            };
            let word = Node::new(match *bytes {
                [low, high] => text!("{} {:#06x}", self.named(item), u16::from_le_bytes([low, high])),
                [octet] => text!("{} {}", self.named(item), i8::from_le_bytes([octet])),
                _ => text!("{} {}", self.named(item), hex(bytes)),
            });
            node.push(word.shows(fact));
        }
        for (field, item) in axis.south.command_fields().filter(|(field, _)| there(field.offset.into())) {
            node.push(self.command_value(number, field, item, &values));
        }
        Ok(node)
    }

    /// What a drive tells: as a whole, once every PDO of it has come.
    fn tpdo(&mut self, number: usize, pdo: &CanPdo, data: &[u8]) -> Result<Node, TranslateError> {
        let (axis, state) = (&self.stage.axes[number], &mut self.states[number]);
        if !CanDrive::gather(pdo, data, &mut state.came) {
            return Err(short(pdo, data));
        }
        // What comes again before the others belongs to the next cycle.
        if state.heard.contains(&pdo.number) {
            state.heard.clear();
        }
        state.heard.push(pdo.number);
        let all = axis.can().map(|drive| drive.pdos.as_slice()).unwrap_or_default();
        let wanted =
            all.iter().filter(|known| known.direction == Direction::Transmit && !known.parts.is_empty());
        let rest: Vec<String> = wanted
            .filter(|known| !state.heard.contains(&known.number))
            .map(|known| known.to_string())
            .collect();
        if !rest.is_empty() {
            let text = text!("axis {} on {}: {} to come", axis.name, axis.drive, rest.join(", "));
            return Ok(Node::new(text).about(number));
        }
        state.heard.clear();
        let values = state.came.clone();
        self.feedback(number, &values)
    }

    /// What a drive says is wrong.
    fn emcy(&mut self, bus: Option<usize>, id: u8, data: &[u8]) -> Option<Result<Node, TranslateError>> {
        let axes = self.stage.axes.iter().enumerate().filter(|(_, axis)| axis.may_be_on(bus));
        let of_node = axes.filter(|(_, axis)| axis.can().is_some_and(|drive| drive.node == id));
        let of_node: Vec<_> =
            of_node.map(|(number, axis)| (number, axis.name.clone(), axis.drive.clone())).collect();
        let (_, _, drive) = of_node.first()?;
        let emcy = match Emcy::parse(data) {
            Ok(emcy) => emcy,
            Err(error) => return Some(Err(TranslateError::Value(text!("EMCY of {drive}: {error}")))),
        };
        let mut node = Node::new(text!("EMCY of {drive}: {emcy}"));
        let words = |number: usize| self.stage.axes[number].south.diagnostic_words(true).collect();
        let words: Vec<Vec<Item>> = of_node.iter().map(|(number, ..)| words(*number)).collect();
        for ((number, name, _), words) in of_node.iter().zip(words) {
            let mut axis = Node::new(text!("axis {name}")).about(*number);
            for word in words {
                // The box reads the code where the drive keeps it; the message alone stops no axis.
                if let Err(error) = self.causes(*number, word, &emcy.code.0.to_le_bytes(), &mut axis) {
                    return Some(Err(error));
                }
            }
            node.push(axis);
        }
        Some(Ok(node))
    }
}

fn short(pdo: &CanPdo, data: &[u8]) -> TranslateError {
    TranslateError::Value(text!("{pdo}: expected {} bytes, got {}", pdo.len, data.len()))
}
