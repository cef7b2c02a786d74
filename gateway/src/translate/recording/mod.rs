//! Whole recordings, each frame with what came before it, and what is odd about a recording.
//!
//! A recording need not be whole: it is translated as far as it can be read, and what does not fit is said at its place.
//!
//! | oddity | what becomes of it |
//! |---|---|
//! | it ends in the middle of a frame | an error behind the last whole frame |
//! | interfaces of another link type, CAN buses of which nobody says what runs there | an error at their first frame, all are left out |
//! | frames of a second gateway | the same |
//! | frames with values of a drive or a device that are cut or cannot be read | an error in place of their translation |
//! | updates that are missing by their sequence count, a silence | a note |
//! | time that goes backwards | a note |

mod learnt;
mod oddities;

use std::io::Read;
use std::net::Ipv4Addr;
use std::sync::Arc;

use profile_cia402::wire::cob_id;
use profile_cip::wire::class1::{CONNECTION_ID_OFFSET, Class1Datagram};
use profile_sercos::wire::describe::Names;
use profile_sercos::wire::header::{Header, Phase};

use self::learnt::Learnt;
use self::oddities::Oddities;
use super::entry::{Counts, Entry, Place, Sink};
use super::{Mark, Node, Recognised, Stage, StageAxis, TranslateError, Translator};
use crate::capture::can::{self, LINK_TYPE_CAN, Record};
use crate::capture::can_bus::{CanBuses, CanProtocol};
use crate::capture::reader::{Frame, LINK_TYPE_ETHERNET, ReadError, Reader};
use crate::config::Config;
use crate::decode::Decoder;
use crate::decode::packet::{self, Packet, is_io};

/// What a frame came to.
enum Outcome {
    /// It carries nothing to translate.
    Nothing,
    /// It is one of those that are left out; the first of them says why.
    LeftOut(Option<String>),
    /// Its heading and its translation.
    Translated(String, Result<Node, TranslateError>),
}

/// Translates the updates of CIP Motion connections, the cyclic SERCOS telegrams, PDOs and EMCY of CiA 402 drives, and polls of
/// drives on DeviceNet in a recording, frame by frame, up to frame `last`.
///
/// # Errors
/// The recording cannot be read on. What came before has been handed on, and counts.
pub fn translate_capture<R: Read>(
    stage: &Arc<Stage>,
    config: &Config,
    mut reader: Reader<R>,
    names: &dyn Names,
    last: u64,
    sink: Sink<'_>,
) -> Captured {
    let mut counts = Counts::default();
    let mut recording = Recording {
        translator: Translator::new(Arc::clone(stage)),
        decoder: Decoder::new(names),
        config,
        buses: CanBuses::of(config),
        oddities: Oddities::default(),
        learnt: Learnt::default(),
        first: None,
    };
    let error = loop {
        let offset = reader.offset();
        let frame = match reader.next_frame() {
            Ok(Some(frame)) if frame.number <= last => frame,
            Ok(_) => break None,
            Err(error) => break Some(error),
        };
        let place = recording.place(&frame, offset);
        if let Some(note) = recording.oddities.of(&frame)
            && !sink(Entry::note(place, &note, Mark::Note))
        {
            break None;
        }
        let go_on = match recording.frame(&frame, place, sink) {
            Outcome::Nothing => {
                counts.passed_over += 1;
                true
            }
            Outcome::LeftOut(why) => {
                counts.failed += 1;
                why.is_none_or(|why| sink(Entry::note(place, &why, Mark::Error)))
            }
            Outcome::Translated(heading, translated) => {
                counts.push(sink, Entry::of(place, heading, translated))
            }
        };
        if !go_on {
            break None;
        }
    };
    Captured { counts, error, stage: Arc::clone(&recording.translator.stage) }
}

/// What became of a recording.
#[derive(Debug)]
pub struct Captured {
    /// Its frames.
    pub counts: Counts,
    /// Why it could not be read on.
    pub error: Option<ReadError>,
    /// The programs of the end: what the recording says of its drives counts.
    pub stage: Arc<Stage>,
}

struct Recording<'a> {
    translator: Translator,
    decoder: Decoder<'a>,
    config: &'a Config,
    buses: CanBuses,
    oddities: Oddities,
    learnt: Learnt,
    /// Time of the first frame.
    first: Option<u64>,
}

impl Recording<'_> {
    fn place(&mut self, frame: &Frame<'_>, offset: u64) -> Place {
        let time = frame.at.map(|at| {
            let first = *self.first.get_or_insert(at.0);
            i64::try_from(i128::from(at.0) - i128::from(first)).unwrap_or(i64::MAX)
        });
        Place { number: frame.number, time, offset }
    }

    fn frame(&mut self, frame: &Frame<'_>, place: Place, sink: Sink<'_>) -> Outcome {
        self.oddities.enter(frame);
        if let Some(why) = self.oddities.other_gateway(frame) {
            return Outcome::LeftOut(why);
        }
        match frame.link_type {
            LINK_TYPE_CAN => self.can(frame, place, sink),
            LINK_TYPE_ETHERNET => self.ethernet(frame, place, sink),
            other => Outcome::LeftOut(self.oddities.left_out(frame, || {
                format!(
                    "link type {other} is neither Ethernet nor CAN: all frames of this interface are left out"
                )
            })),
        }
    }

    /// Takes over what the recording has said of its drives.
    fn learn(&mut self, frame: &Frame<'_>, place: Place, sink: Sink<'_>) {
        if !self.learnt.has_news() {
            return;
        }
        let context = self.decoder.bus(frame);
        for (text, mark) in self.learnt.apply(&mut self.translator, context) {
            sink(Entry::note(place, &text, mark));
        }
    }

    fn can(&mut self, frame: &Frame<'_>, place: Place, sink: Sink<'_>) -> Outcome {
        let record =
            frame.cut().map_or_else(|| can::parse(frame.data).map_err(|error| error.to_string()), Err);
        if matches!(record, Ok(Record::Controller { .. })) {
            return Outcome::Nothing;
        }
        let bus = self.buses.find(frame);
        let no_buses = self.config.can.len() + self.config.devicenet.len() == 0;
        if bus.is_none() && !no_buses {
            return Outcome::LeftOut(self.oddities.left_out(frame, || {
                let expected =
                    "expected a CAN interface of the configuration, which has CANopen and DeviceNet, got";
                let name = frame
                    .interface_name
                    .map_or_else(|| "one without name".to_owned(), |name| format!("`{name}`"));
                format!("{expected} {name}: all its frames are left out")
            }));
        }
        let record = match record {
            Ok(record) => record,
            Err(error) => {
                let number = bus.and_then(|bus| bus.number);
                return self
                    .unreadable(frame, error, |axis| axis.sercos().is_none() && axis.may_be_on(number));
            }
        };
        let Record::Frame(content) = &record else { return Outcome::Nothing };
        let translated = match bus {
            Some(bus) if bus.protocol == CanProtocol::Devicenet => {
                self.translator.devicenet(bus.number, content)
            }
            // Without CAN buses in the configuration the drives come from data sheets, and those are of CANopen.
            // A SYNC comes each cycle, and has nothing in it to read.
            bus => {
                let number = bus.and_then(|bus| bus.number);
                if self.learnt.can(self.translator.stage(), number, content) {
                    return Outcome::Nothing;
                }
                self.learn(frame, place, sink);
                self.translator.can(number, content).filter(|_| content.id() != cob_id::SYNC)
            }
        };
        translated.map_or(Outcome::Nothing, |translated| {
            Outcome::Translated(format!("frame {} {record}", frame.number), translated)
        })
    }

    fn ethernet(&mut self, frame: &Frame<'_>, place: Place, sink: Sink<'_>) -> Outcome {
        let packet = packet::parse(frame.data);
        self.decoder.follow(frame, &packet);
        let wanted = match packet {
            Packet::Sercos => {
                let header = Header::parse(frame.data);
                self.learnt.sercos(self.translator.stage(), self.decoder.bus(frame));
                let is_cyclic = header.as_ref().map(|header| header.phase.phase()) == Ok(Phase::CP4);
                let error = header.err().map(|error| format!("SERCOS III: {error}"));
                let cut = frame.cut().filter(|_| is_cyclic || error.is_some());
                if let Some(error) = cut.or(error) {
                    return self.unreadable(frame, error, |axis| axis.sercos().is_some());
                }
                if is_cyclic {
                    self.learn(frame, place, sink);
                }
                is_cyclic
            }
            Packet::Udp { from, to, payload } if is_io(from, to) => {
                let ends = (*from.ip(), *to.ip());
                let datagram = match Class1Datagram::parse(payload) {
                    Ok(datagram) => datagram,
                    Err(error) => {
                        return self.unreadable(frame, error.to_string(), |_| self.may_be_motion(ends));
                    }
                };
                let known = self.decoder.connection(datagram.connection_id, ends.0, ends.1);
                // Opened before the recording began: the data say what they are, or else whose they are.
                let motion = known.map_or_else(
                    || {
                        super::recognise(frame.data).is_ok()
                            || self.has_motion(ends.0)
                            || self.has_motion(ends.1)
                    },
                    |(_, motion)| motion,
                );
                if motion {
                    let target = known.map(|(target, _)| target);
                    if let Some(why) = self.choose_device(frame, target, ends) {
                        return Outcome::LeftOut(why);
                    }
                    if let Some(note) = self.oddities.sequence(&datagram, ends) {
                        sink(Entry::note(place, &note, Mark::Note));
                    }
                }
                motion
            }
            Packet::CutUdp { from, to, payload, what } if is_io(from, to) => {
                let id = payload.get(CONNECTION_ID_OFFSET..).and_then(<[u8]>::first_chunk);
                let ends = (*from.ip(), *to.ip());
                let known =
                    id.and_then(|id| self.decoder.connection(u32::from_le_bytes(*id), ends.0, ends.1));
                let motion = known.map_or_else(|| self.may_be_motion(ends), |(_, motion)| motion);
                return self.unreadable(frame, frame.cut().unwrap_or(what), |_| motion);
            }
            _ => false,
        };
        if !wanted {
            return Outcome::Nothing;
        }
        Outcome::Translated(format!("frame {}", frame.number), self.translator.frame(frame.data))
    }

    /// A frame that cannot be read: an error if it may be one of an axis like this, else it is of no interest.
    fn unreadable(
        &self,
        frame: &Frame<'_>,
        error: String,
        may_be_of: impl Fn(&StageAxis) -> bool,
    ) -> Outcome {
        if !self.translator.stage().axes.iter().any(may_be_of) {
            return Outcome::Nothing;
        }
        Outcome::Translated(format!("frame {}", frame.number), Err(TranslateError::Value(error)))
    }

    /// Whether a CIP Motion device of the configuration has this address.
    fn has_motion(&self, address: Ipv4Addr) -> bool {
        self.config.devices.iter().any(|device| device.listen == address && device.assembly.is_none())
    }

    /// Whether data that cannot be read, of a connection that was not seen to open, may be updates: if an end is a CIP Motion device of
    /// the configuration or the one that stands for it, or as long as none of them was there.
    fn may_be_motion(&self, (from, to): (Ipv4Addr, Ipv4Addr)) -> bool {
        let is_first = self.oddities.first_device().is_none_or(|device| [from, to].contains(&device));
        is_first || self.has_motion(from) || self.has_motion(to)
    }

    /// Takes an update as one of the device that it goes to or comes from. A device with another address than those of the
    /// configuration stands for the first one, if it is the only one of its kind. Gives back why an update is left out.
    fn choose_device(
        &mut self,
        frame: &Frame<'_>,
        target: Option<Ipv4Addr>,
        (from, to): (Ipv4Addr, Ipv4Addr),
    ) -> Option<Option<String>> {
        let of = |address| self.config.devices.iter().position(|device| device.listen == address);
        let device = match target {
            Some(target) => of(target),
            None => of(to).or_else(|| of(from)),
        };
        if let Some(device) = device {
            self.oddities.is_there(self.config.devices[device].listen);
            self.translator.set_device(device);
            return None;
        }
        // Without the Forward_Open only the kind of update tells which end is the device.
        let reports =
            || matches!(super::recognise(frame.data), Ok(Recognised::Actual(_) | Recognised::FixedActual(_)));
        let target = target.unwrap_or_else(|| if reports() { from } else { to });
        if self.oddities.stands_for_the_first(target) {
            self.translator.set_device(0);
            return None;
        }
        Some(self.oddities.left_out_of(target, || {
            format!("{target} is another gateway, or a device that the configuration does not have: its frames are left out")
        }))
    }
}

#[cfg(test)]
mod tests;
