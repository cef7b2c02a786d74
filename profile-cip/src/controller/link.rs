//! The motion I/O connection: datagrams out, datagrams in, and what is lost or late between them.

use core::net::SocketAddrV4;
use std::collections::VecDeque;

use super::config::ControllerConfig;
use super::misbehaviour::Spoil;
use super::services::Room;
use super::session::Opened;
use super::sets::ACTUAL_HEADER_MAX;
use crate::wire::class1::{CLASS1_HEADER_LEN, Class1Datagram, SEQUENCE_COUNT_LEN};
use crate::wire::motion::fixed::{FixedActual, FixedCommand};
use crate::wire::motion::header::CommandHeader;
use crate::wire::motion::{ActualFrame, CommandInstance, CommandWriter, FORMAT_REVISION, Format, run_idle};
use crate::wire::{Error, Writer};
use profile_generic::time::MonotonicTime;

/// Largest C-to-D header: 8 bytes, time stamp, time offset.
const COMMAND_HEADER_MAX: usize = 24;
/// Header of an instance and of its service block.
const SERVICE_HEADERS: usize = 8 + 4;
/// Block sizes count up to 255 words; an instance has its header, the cyclic part and the service block.
const INSTANCE_MAX: usize = 255 * 4;

/// What a received datagram means for the counters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Arrival {
    /// New data; so many update IDs before it are missing.
    Fresh { lost: u8 },
    /// The data have been here before.
    Repeated,
    /// A newer update overtook it.
    Overtaken,
}

/// A D-to-C update in the format of the connection.
#[derive(Debug)]
pub(super) enum Update<'a> {
    Variable(ActualFrame<'a>),
    Fixed(FixedActual),
}

impl Update<'_> {
    fn id(&self) -> u8 {
        match self {
            Self::Variable(frame) => frame.header().update_id,
            Self::Fixed(actual) => actual.update_id,
        }
    }
}

/// Room of a service as an unconnected message: the 504 bytes that a device has to take, less service, path and status.
const MESSAGE_ROOM: Room = Room { request: 480, response: 480 };

/// The connection.
#[derive(Debug)]
pub(super) struct Link {
    opened: Option<Opened>,
    /// Format Revision.
    revision: u8,
    format: Format,
    size: usize,
    frame: Vec<u8>,
    length: Option<usize>,
    /// Datagrams beside the usual one: repeated, held back until the next one, or until an instant.
    extra: VecDeque<Vec<u8>>,
    held: Option<Vec<u8>>,
    delayed: VecDeque<(MonotonicTime, Vec<u8>)>,
    sequence_count: u16,
    encapsulation_sequence: u32,
    received: Option<Received>,
}

#[derive(Debug, Clone, Copy)]
struct Received {
    encapsulation_sequence: u32,
    sequence_count: u16,
    update_id: u8,
    at: MonotonicTime,
}

impl Link {
    /// The connection that a configuration asks for.
    pub fn of(config: &ControllerConfig) -> Self {
        Self { revision: config.format_revision, ..Self::new(config.format, config.connection_size) }
    }

    pub fn new(format: Format, size: u16) -> Self {
        let size = usize::from(size);
        Self {
            opened: None,
            revision: FORMAT_REVISION,
            format,
            size,
            frame: vec![0; CLASS1_HEADER_LEN + size],
            length: None,
            extra: VecDeque::new(),
            held: None,
            delayed: VecDeque::new(),
            sequence_count: 0,
            encapsulation_sequence: 0,
            received: None,
        }
    }

    pub fn open(&mut self, opened: Opened) {
        self.opened = Some(opened);
    }

    /// Sends and receives nothing any more.
    pub fn close(&mut self) {
        self.opened = None;
        self.length = None;
        self.extra.clear();
        self.held = None;
        self.delayed.clear();
    }

    pub const fn is_open(&self) -> bool {
        self.opened.is_some()
    }

    pub fn destination(&self) -> Option<SocketAddrV4> {
        self.opened.and_then(|opened| opened.destination)
    }

    /// Update ID of the last D-to-C update, 0 before the first one.
    pub fn last_received(&self) -> u8 {
        self.received.map_or(0, |received| received.update_id)
    }

    /// When the last D-to-C datagram came.
    pub fn received_at(&self) -> Option<MonotonicTime> {
        self.received.map(|received| received.at)
    }

    /// Whether so many bytes of cyclic data of all axes fit, to the device and from it. What an update of the fixed format
    /// has room for is checked with the data sets.
    pub fn fits(&self, (command, actual): (usize, usize)) -> bool {
        if self.format == Format::Fixed {
            return true;
        }
        let fixed = |header: usize| SEQUENCE_COUNT_LEN + run_idle::len(self.revision) + header;
        fixed(COMMAND_HEADER_MAX) + command <= self.size && fixed(ACTUAL_HEADER_MAX) + actual <= self.size
    }

    /// Room for a service beside so many bytes of cyclic data of all axes, of which the largest axis has so many.
    pub fn room(&self, all: (usize, usize), largest: (usize, usize)) -> Room {
        if self.format == Format::Fixed {
            return MESSAGE_ROOM;
        }
        let cut = |header: usize, all: usize, axis: usize| {
            let fixed = SEQUENCE_COUNT_LEN + run_idle::len(self.revision) + header + all + SERVICE_HEADERS;
            let instance = INSTANCE_MAX.saturating_sub(axis + SERVICE_HEADERS);
            // Whole words, as the blocks are.
            self.size.saturating_sub(fixed).min(instance) / 4 * 4
        };
        Room {
            request: cut(COMMAND_HEADER_MAX, all.0, largest.0),
            response: cut(ACTUAL_HEADER_MAX, all.1, largest.1),
        }
    }

    /// Writes an update. With `fresh` it has a new sequence count, without it repeats the data as a refresh.
    pub fn send<'i>(
        &mut self,
        now: MonotonicTime,
        header: &CommandHeader,
        instances: impl Iterator<Item = CommandInstance<'i>>,
        fresh: bool,
        spoil: &Spoil,
    ) -> Result<(), Error> {
        let end = CLASS1_HEADER_LEN + self.size - SEQUENCE_COUNT_LEN;
        let data = &mut self.frame[CLASS1_HEADER_LEN..end];
        let head = run_idle::len(self.revision);
        let mut writer = CommandWriter::new(data.get_mut(head..).unwrap_or_default(), header)?;
        for instance in instances {
            writer.instance(&instance)?;
        }
        let length = head + writer.finish();
        run_idle::finish(self.revision, data);
        self.send_written(now, length, fresh, spoil)
    }

    /// As [`Link::send`], in the fixed format.
    pub fn send_fixed(
        &mut self,
        now: MonotonicTime,
        command: &FixedCommand,
        fresh: bool,
        spoil: &Spoil,
    ) -> Result<(), Error> {
        let mut writer = Writer::new(&mut self.frame[CLASS1_HEADER_LEN..]);
        command.emit(&mut writer)?;
        let length = writer.written();
        self.send_written(now, length, fresh, spoil)
    }

    /// Puts the datagram around an update that has been written.
    fn send_written(
        &mut self,
        now: MonotonicTime,
        length: usize,
        fresh: bool,
        spoil: &Spoil,
    ) -> Result<(), Error> {
        let Some(opened) = self.opened else { return Ok(()) };
        let length = length.saturating_sub(usize::from(spoil.cut));
        self.sequence_count = self.sequence_count.wrapping_add(u16::from(fresh));
        self.encapsulation_sequence = self.encapsulation_sequence.wrapping_add(1);
        let sequence = self.encapsulation_sequence.wrapping_sub(spoil.sequence_back);
        Class1Datagram::emit_header(
            opened.o_to_t_id,
            sequence,
            self.sequence_count,
            length,
            &mut self.frame,
        )?;
        self.length = Some(CLASS1_HEADER_LEN + length);
        if *spoil != Spoil::default() || self.held.is_some() {
            self.misdirect(now, spoil);
        }
        Ok(())
    }

    /// Keeps, repeats or forgets the update that is ready.
    fn misdirect(&mut self, now: MonotonicTime, spoil: &Spoil) {
        let Some(length) = self.length else { return };
        let copy = || self.frame[..length].to_vec();
        if spoil.skip {
            self.length = None;
        } else if spoil.hold {
            self.held = Some(copy());
            self.length = None;
        } else if spoil.delay.0 > 0 {
            self.delayed.push_back((now + spoil.delay, copy()));
            self.length = None;
        } else if spoil.duplicate {
            self.extra.push_back(copy());
        }
        if !spoil.hold {
            self.extra.extend(self.held.take());
        }
    }

    /// When a delayed update is due.
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        self.delayed.iter().map(|(due, _)| *due).min()
    }

    /// Lets delayed updates go that are due.
    pub fn handle_time(&mut self, now: MonotonicTime) {
        while let Some(at) = self.delayed.iter().position(|(due, _)| *due <= now) {
            self.extra.extend(self.delayed.remove(at).map(|(_, datagram)| datagram));
        }
    }

    /// An update to be sent now.
    pub fn poll_transmit(&mut self, buffer: &mut [u8]) -> Option<usize> {
        let Some(length) = self.length else {
            let length = self.extra.front()?.len();
            buffer.get_mut(..length)?.copy_from_slice(self.extra.front()?);
            self.extra.pop_front();
            return Some(length);
        };
        let target = buffer.get_mut(..length)?;
        target.copy_from_slice(&self.frame[..length]);
        self.length = None;
        Some(length)
    }

    /// Reads a datagram. `None` for one of another connection.
    pub fn receive<'a>(
        &mut self,
        now: MonotonicTime,
        bytes: &'a [u8],
    ) -> Result<Option<(Arrival, Update<'a>)>, Error> {
        let datagram = Class1Datagram::parse(bytes)?;
        if self.opened.is_none_or(|opened| opened.t_to_o_id != datagram.connection_id) {
            return Ok(None);
        }
        let room = self.size - SEQUENCE_COUNT_LEN;
        if datagram.data.len() > room {
            let clip = |length| u32::try_from(length).unwrap_or(u32::MAX);
            let (value, max) = (clip(datagram.data.len()), clip(room));
            return Err(Error::too_large("connection data", max, value));
        }
        let update = match self.format {
            Format::Variable => {
                // Whether the device runs is in the header of the update as well, which says more.
                let (_, update) = run_idle::split(self.revision, datagram.data)?;
                Update::Variable(ActualFrame::parse_as(update, self.revision)?)
            }
            Format::Fixed => Update::Fixed(FixedActual::parse(datagram.data)?),
        };
        let update_id = update.id();
        let arrival = self.received.map_or(Arrival::Fresh { lost: 0 }, |last| {
            let behind = datagram.encapsulation_sequence.wrapping_sub(last.encapsulation_sequence);
            let step = update_id.wrapping_sub(last.update_id);
            if behind == 0 || behind > u32::MAX / 2 || step > u8::MAX / 2 {
                Arrival::Overtaken
            } else if datagram.sequence_count == last.sequence_count {
                Arrival::Repeated
            } else {
                Arrival::Fresh { lost: step.saturating_sub(1) }
            }
        });
        if arrival != Arrival::Overtaken {
            self.received = Some(Received {
                encapsulation_sequence: datagram.encapsulation_sequence,
                sequence_count: datagram.sequence_count,
                update_id,
                at: now,
            });
        }
        Ok(Some((arrival, update)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::motion::codes::{NodeAlarm, NodeControl, NodeFault, NodeStatus, TimeDataSet};
    use crate::wire::motion::{ActualHeader, ActualWriter};
    use profile_generic::time::DurationNs;

    fn update(id: u32, sequence: u32, count: u16, update_id: u8) -> Vec<u8> {
        let header = ActualHeader {
            update_id,
            node_status: NodeStatus::REMOTE_MODE,
            instance_count: 0,
            node_fault: NodeFault::NONE,
            node_alarm: NodeAlarm::NONE,
            last_received_id: 0,
            time_stamp: None,
            time_offset: None,
            update_diagnostics: None,
            time_diagnostics: None,
        };
        let mut data = [0; 8];
        let length = ActualWriter::new(&mut data, &header).unwrap().finish();
        let datagram = Class1Datagram {
            connection_id: id,
            encapsulation_sequence: sequence,
            sequence_count: count,
            data: &data[..length],
        };
        let mut bytes = vec![0; datagram.buffer_len()];
        datagram.emit(&mut bytes).unwrap();
        bytes
    }

    #[test]
    fn arrivals_are_told_apart() {
        let mut link = Link::new(Format::Variable, 200);
        let mut receive = |id, sequence, count, update_id| {
            if !link.is_open() {
                link.open(Opened { o_to_t_id: 1, t_to_o_id: 2, destination: None });
            }
            let bytes = update(id, sequence, count, update_id);
            let arrival = link.receive(MonotonicTime(5), &bytes).unwrap();
            (arrival.map(|(arrival, _)| arrival), link.last_received())
        };
        use Arrival as A;
        assert_eq!(receive(9, 1, 1, 7), (None, 0), "another connection");
        assert_eq!(receive(2, u32::MAX, u16::MAX, 254), (Some(A::Fresh { lost: 0 }), 254), "the first one");
        assert_eq!(receive(2, 0, u16::MAX, 254), (Some(A::Repeated), 254), "a refresh");
        assert_eq!(receive(2, 1, 0, 255), (Some(A::Fresh { lost: 0 }), 255), "all counters roll over");
        assert_eq!(receive(2, 4, 3, 2), (Some(A::Fresh { lost: 2 }), 2), "0 and 1 are missing");
        assert_eq!(receive(2, 3, 2, 1), (Some(A::Overtaken), 2));
        assert_eq!(receive(2, 4, 3, 2), (Some(A::Overtaken), 2), "the same datagram doubled");
        assert_eq!(receive(2, 5, 4, 2), (Some(A::Fresh { lost: 0 }), 2), "new data under the same ID");
    }

    #[test]
    fn the_room_of_a_service_leaves_the_cyclic_data_theirs() {
        // 500 - 2 - 24 - 2 x 32 - 12 and 500 - 2 - 44 - 2 x 56 - 12, in whole words.
        let room = Link::new(Format::Variable, 500).room((64, 112), (32, 56));
        assert_eq!((room.request, room.response), (396, 328));
        // Block sizes are counted in one byte: 1020 - 32 - 12 and 1020 - 56 - 12.
        let room = Link::new(Format::Variable, 1400).room((32, 56), (32, 56));
        assert_eq!((room.request, room.response), (976, 952));
        assert_eq!(Link::new(Format::Variable, 20).room((32, 56), (32, 56)).request, 0);
        assert!(
            Link::new(Format::Variable, 102).fits((76, 56))
                && !Link::new(Format::Variable, 101).fits((76, 56))
                && !Link::new(Format::Variable, 101).fits((0, 56))
        );
    }

    #[test]
    fn updates_are_held_delayed_doubled_cut_and_skipped() {
        let mut link = Link::new(Format::Variable, 200);
        link.open(Opened { o_to_t_id: 1, t_to_o_id: 2, destination: None });
        let mut buffer = [0; 300];
        // What goes out after each update: encapsulation sequence and length.
        let mut send = |now: u64, spoil: Spoil| {
            let now = MonotonicTime(now);
            link.handle_time(now);
            let header = CommandHeader {
                update_id: 1,
                node_control: NodeControl::empty(),
                instance_count: 0,
                last_received_id: 0,
                time_stamp: None,
                time_offset: None,
                diagnostics: TimeDataSet::empty(),
            };
            link.send(now, &header, core::iter::empty(), true, &spoil).unwrap();
            let mut sent = Vec::new();
            while let Some(length) = link.poll_transmit(&mut buffer) {
                let sequence = u32::from_le_bytes([buffer[10], buffer[11], buffer[12], buffer[13]]);
                sent.push((sequence, length));
            }
            (sent, link.wake_at().map(|at| at.0))
        };
        let good = Spoil::default();
        let len = CLASS1_HEADER_LEN + 8;
        assert_eq!(send(0, good), (vec![(1, len)], None));
        assert_eq!(send(1, Spoil { hold: true, ..good }), (vec![], None));
        assert_eq!(send(2, good), (vec![(3, len), (2, len)], None));
        assert_eq!(send(3, Spoil { duplicate: true, ..good }), (vec![(4, len), (4, len)], None));
        assert_eq!(send(4, Spoil { delay: DurationNs(5), ..good }), (vec![], Some(9)));
        assert_eq!(send(9, good), (vec![(6, len), (5, len)], None));
        assert_eq!(send(10, Spoil { skip: true, ..good }), (vec![], None));
        assert_eq!(send(11, Spoil { cut: 3, ..good }), (vec![(8, len - 3)], None));
        assert_eq!(send(12, Spoil { sequence_back: 5, ..good }), (vec![(4, len)], None));
    }

    #[test]
    fn an_update_longer_than_the_connection_is_refused() {
        let mut link = Link::new(Format::Variable, 9);
        link.open(Opened { o_to_t_id: 1, t_to_o_id: 2, destination: None });
        let error = link.receive(MonotonicTime(0), &update(2, 1, 1, 1)).unwrap_err();
        assert_eq!(error.to_string(), "connection data: expected at most 7, found 8");
    }
}
