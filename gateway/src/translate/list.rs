//! Whole lists of frames and whole recordings, each frame with what came before it.

use std::io::Read;
use std::sync::Arc;

use profile_cia402::wire::cob_id;
use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::encapsulation::IO_PORT;
use profile_sercos::wire::describe::Names;
use profile_sercos::wire::header::{Header, Phase};

use super::{Line, LineError, Node, Stage, TranslateError, Translator};
use crate::capture::can::{self, LINK_TYPE_CAN, Record};
use crate::capture::can_bus::{CanBuses, CanProtocol};
use crate::capture::reader::{ReadError, Reader};
use crate::config::Config;
use crate::decode::Decoder;
use crate::decode::packet::{self, Packet};

/// Characters of a line that stand in its heading.
const HEADING_MAX: usize = 60;

/// A translated list.
#[derive(Debug, Default)]
pub struct List {
    /// A tree for each frame.
    pub frames: Vec<Node>,
    /// Frames of a recording that carry nothing to translate.
    pub passed_over: usize,
    /// Frames that could not be translated.
    pub failed: usize,
}

/// What is wrong with a list.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{line}:{}: {error}", error.column)]
pub struct ListError {
    /// Line, 1 first.
    pub line: usize,
    /// What is wrong with it.
    pub error: LineError,
}

impl List {
    fn push(&mut self, heading: String, translated: Result<Node, super::TranslateError>) {
        let mut frame = Node::new(heading);
        match translated {
            Ok(node) => frame.push(node),
            Err(error) => {
                self.failed += 1;
                frame.push(Node::new(format!("error: {error}")));
            }
        }
        self.frames.push(frame);
    }
}

/// Translates a text with a frame a line. A frame that cannot be translated is told where it stands, and the others go on.
///
/// # Errors
/// The first line that is no line of such a list.
pub fn translate_list(stage: &Arc<Stage>, text: &str) -> Result<List, ListError> {
    let mut translator = Translator::new(Arc::clone(stage));
    let mut list = List::default();
    for (number, line) in (1..).zip(text.lines()) {
        let Some(frame) = Line::parse(line).map_err(|error| ListError { line: number, error })? else {
            continue;
        };
        let translated = translator.line(&frame);
        if frame != Line::Restart {
            list.push(format!("line {number}: {}", heading(line)), translated);
        }
    }
    Ok(list)
}

/// The comment behind a frame says best what it is, else the frame itself does.
fn heading(line: &str) -> String {
    let (frame, comment) = line.split_once('#').unwrap_or((line, ""));
    let shown = if comment.trim().is_empty() { frame.trim() } else { comment.trim() };
    match shown.char_indices().nth(HEADING_MAX) {
        Some((end, _)) => format!("{} ...", &shown[..end]),
        None => shown.to_owned(),
    }
}

/// Translates the updates of CIP Motion connections, the cyclic SERCOS telegrams, PDOs and EMCY of CiA 402 drives, and polls of
/// drives on DeviceNet in a recording.
///
/// # Errors
/// The recording cannot be read on.
pub fn translate_capture<R: Read>(
    stage: &Arc<Stage>,
    config: &Config,
    mut reader: Reader<R>,
    names: &dyn Names,
) -> Result<List, ReadError> {
    let mut translator = Translator::new(Arc::clone(stage));
    let mut decoder = Decoder::new(names);
    let mut list = List::default();
    let buses = CanBuses::of(config);
    let mut unknown: Vec<u32> = Vec::new();
    while let Some(frame) = reader.next_frame()? {
        if frame.link_type == LINK_TYPE_CAN {
            let record = can::parse(frame.data);
            let translated = match (&record, buses.find(&frame)) {
                (Ok(Record::Frame(record)), Some(bus)) if bus.protocol == CanProtocol::Devicenet => {
                    translator.devicenet(bus.number, record)
                }
                // Without CAN buses in the configuration the drives come from data sheets, and those are of CANopen.
                (Ok(Record::Frame(record)), bus)
                    if bus.is_some() || config.can.len() + config.devicenet.len() == 0 =>
                {
                    // One each cycle, and nothing in it to read.
                    let number = bus.and_then(|bus| bus.number);
                    translator.can(number, record).filter(|_| record.id() != cob_id::SYNC)
                }
                (Ok(_), None) if !unknown.contains(&frame.interface) => {
                    unknown.push(frame.interface);
                    let text =
                        "expected a CAN interface of the configuration, which has CANopen and DeviceNet, got";
                    let name = frame
                        .interface_name
                        .map_or_else(|| "one without name".to_owned(), |name| format!("`{name}`"));
                    Some(Err(TranslateError::Value(format!("{text} {name}: all its frames are left out"))))
                }
                _ => None,
            };
            match (translated, record) {
                (Some(translated), Ok(record)) => {
                    list.push(format!("frame {} {record}", frame.number), translated)
                }
                _ => list.passed_over += 1,
            }
            continue;
        }
        decoder.frame(&frame);
        let wanted = match packet::parse(frame.data) {
            Packet::Sercos => {
                let phase = Header::parse(frame.data).map(|header| header.phase.phase());
                phase == Ok(Phase::CP4)
            }
            Packet::Udp { from, to, payload } if to.port() == IO_PORT => match Class1Datagram::parse(payload)
            {
                Ok(datagram) => match decoder.connection(datagram.connection_id, *from.ip(), *to.ip()) {
                    Some((target, motion)) => {
                        let device = config.devices.iter().position(|device| device.listen == target);
                        translator.set_device(device.unwrap_or(0));
                        motion
                    }
                    // Opened before the recording began: the data tell.
                    None => super::recognise(frame.data).is_ok(),
                },
                Err(_) => false,
            },
            _ => false,
        };
        if wanted {
            list.push(format!("frame {}", frame.number), translator.frame(frame.data));
        } else {
            list.passed_over += 1;
        }
    }
    Ok(list)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings() {
        assert_eq!(heading("06 02 # forward  "), "forward");
        assert_eq!(heading(" 06 02 #"), "06 02");
        assert_eq!(heading(&"ä".repeat(61)), format!("{} ...", "ä".repeat(60)));
    }
}
