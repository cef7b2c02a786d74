//! The motion I/O connection: datagrams out, datagrams in, and what is lost or late between them.

use core::net::SocketAddrV4;

use super::services::Room;
use super::session::Opened;
use crate::wire::class1::{CLASS1_HEADER_LEN, Class1Datagram, SEQUENCE_COUNT_LEN};
use crate::wire::motion::event::{ACTUAL_EVENTS_BARE, COMMAND_EVENTS_MAX};
use crate::wire::motion::header::CommandHeader;
use crate::wire::motion::{CommandInstance, CommandWriter};
use crate::wire::{Error, motion};
use profile_generic::time::MonotonicTime;

/// Largest C-to-D header: 8 bytes, time stamp, time offset.
const COMMAND_HEADER_MAX: usize = 24;
/// Largest D-to-C header: 8 bytes, time stamp, time offset, update and time diagnostics.
const ACTUAL_HEADER_MAX: usize = 44;
/// Largest cyclic part of an axis from this controller: instance header, block header, LREAL, two REAL.
pub(super) const COMMAND_AXIS_MAX: usize = 8 + 8 + 8 + 4 + 4;
/// Largest cyclic part of an axis that this controller asks for: instance header, block header, DINT, REAL,
/// fault, alarm, axis status.
pub(super) const ACTUAL_AXIS_MAX: usize = 8 + 8 + 4 + 4 + 12 + 12 + 8;
/// Header of an instance and of its service block.
const SERVICE_HEADERS: usize = 8 + 4;
/// Block sizes count up to 255 words; an instance has its header, the cyclic part and the service block.
const INSTANCE_MAX: usize = 255 * 4;

/// Bytes of connection data that every axis in every update needs, beside the service channel.
pub(super) const fn cyclic_len(axes: usize) -> usize {
    SEQUENCE_COUNT_LEN + ACTUAL_HEADER_MAX + axes * ACTUAL_AXIS_MAX
}

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

/// The connection.
#[derive(Debug)]
pub(super) struct Link {
    opened: Option<Opened>,
    size: usize,
    axes: usize,
    frame: Vec<u8>,
    length: Option<usize>,
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
    pub fn new(size: u16, axes: usize) -> Self {
        let size = usize::from(size);
        Self {
            opened: None,
            size,
            axes,
            frame: vec![0; CLASS1_HEADER_LEN + size],
            length: None,
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

    /// Room for a service beside the cyclic data of all axes and the event blocks of `checking` of them.
    pub fn room(&self, checking: usize) -> Room {
        let cut = |header: usize, axis: usize, events: usize| {
            let fixed = SEQUENCE_COUNT_LEN + header + self.axes * axis + checking * events + SERVICE_HEADERS;
            let instance = INSTANCE_MAX - axis - events - SERVICE_HEADERS;
            // Whole words, as the blocks are.
            self.size.saturating_sub(fixed).min(instance) / 4 * 4
        };
        Room {
            request: cut(COMMAND_HEADER_MAX, COMMAND_AXIS_MAX, COMMAND_EVENTS_MAX),
            // The device keeps notifications back for which there is no room.
            response: cut(ACTUAL_HEADER_MAX, ACTUAL_AXIS_MAX, ACTUAL_EVENTS_BARE),
        }
    }

    /// Writes an update. With `fresh` it has a new sequence count, without it repeats the data as a refresh.
    pub fn send<'i>(
        &mut self,
        header: &CommandHeader,
        instances: impl Iterator<Item = CommandInstance<'i>>,
        fresh: bool,
    ) -> Result<(), Error> {
        let Some(opened) = self.opened else { return Ok(()) };
        let end = CLASS1_HEADER_LEN + self.size - SEQUENCE_COUNT_LEN;
        let mut writer = CommandWriter::new(&mut self.frame[CLASS1_HEADER_LEN..end], header)?;
        for instance in instances {
            writer.instance(&instance)?;
        }
        let length = writer.finish();
        self.sequence_count = self.sequence_count.wrapping_add(u16::from(fresh));
        self.encapsulation_sequence = self.encapsulation_sequence.wrapping_add(1);
        let (id, sequence) = (opened.o_to_t_id, self.encapsulation_sequence);
        Class1Datagram::emit_header(id, sequence, self.sequence_count, length, &mut self.frame)?;
        self.length = Some(CLASS1_HEADER_LEN + length);
        Ok(())
    }

    /// The update, once.
    pub fn poll_transmit(&mut self, buffer: &mut [u8]) -> Option<usize> {
        let length = self.length?;
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
    ) -> Result<Option<(Arrival, motion::ActualFrame<'a>)>, Error> {
        let datagram = Class1Datagram::parse(bytes)?;
        if self.opened.is_none_or(|opened| opened.t_to_o_id != datagram.connection_id) {
            return Ok(None);
        }
        let room = self.size - SEQUENCE_COUNT_LEN;
        if datagram.data.len() > room {
            let clip = |length| u32::try_from(length).unwrap_or(u32::MAX);
            let (value, max) = (clip(datagram.data.len()), clip(room));
            return Err(Error::OutOfRange { what: "connection data", value, max });
        }
        let frame = motion::ActualFrame::parse(datagram.data)?;
        let update_id = frame.header().update_id;
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
        Ok(Some((arrival, frame)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::motion::codes::{NodeAlarm, NodeFault, NodeStatus};
    use crate::wire::motion::{ActualHeader, ActualWriter};

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
        let mut link = Link::new(200, 1);
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
        let room = Link::new(500, 2).room(0);
        assert_eq!((room.request, room.response), (396, 328));
        // Less 20 and 8 for the events of one axis.
        let room = Link::new(500, 2).room(1);
        assert_eq!((room.request, room.response), (376, 320));
        // Block sizes are counted in one byte: 1020 - 32 - 20 - 12 and 1020 - 56 - 8 - 12.
        let room = Link::new(1400, 1).room(1);
        assert_eq!((room.request, room.response), (956, 944));
        assert_eq!(Link::new(20, 1).room(0).request, 0);
    }

    #[test]
    fn an_update_longer_than_the_connection_is_refused() {
        let mut link = Link::new(9, 1);
        link.open(Opened { o_to_t_id: 1, t_to_o_id: 2, destination: None });
        let error = link.receive(MonotonicTime(0), &update(2, 1, 1, 1)).unwrap_err();
        assert_eq!(error.to_string(), "connection data: expected at most 7, found 8");
    }
}
