//! The D-to-C updates of the motion device, clauses 6-2.7.2, 7-1.1 and 7-1.3.

use arrayvec::ArrayVec;
use profile_generic::time::{MonotonicTime, SystemTime};

use super::cyclic_list::CYCLIC_DATA_MAX;
use super::engine::{Engine, INSTANCES_MAX, SEQUENCE_LEN};
use super::fixed;
use super::io_connection::Mode;
use super::service_channel::ServiceChannel;
use crate::wire::Writer;
use crate::wire::motion::codes::{NodeControl, NodeStatus, TimeDataSet};
use crate::wire::motion::event::NOTIFICATION_LEN;
use crate::wire::motion::{
    ActualBlock, ActualEvents, ActualHeader, ActualInstance, ActualWriter, Format, ReadBlock,
    ServiceResponse, TimeDiagnostics, run_idle,
};
use crate::wire::status::GeneralStatus;

/// Octets of the largest instance data block: its size is counted in one byte, in words.
const INSTANCE_MAX: usize = 255 * 4;

/// Cyclic read data of an instance: write ID and status, read ID and status, octets.
struct ReadData {
    head: [u8; 4],
    data: ArrayVec<u8, CYCLIC_DATA_MAX>,
}

/// Everything of an instance but its service response.
struct Part {
    number: u8,
    cyclic: Option<ActualBlock>,
    read: Option<ReadData>,
    events: Option<ActualEvents>,
}

impl Part {
    fn instance<'a>(&'a self, service: Option<ServiceResponse<'a>>) -> ActualInstance<'a> {
        let read = self.read.as_ref().map(|r| ReadBlock {
            write_block_id: r.head[0],
            write_status: r.head[1],
            read_block_id: r.head[2],
            read_status: r.head[3],
            data: &r.data,
        });
        ActualInstance {
            number: self.number,
            cyclic: self.cyclic,
            read,
            events: self.events.clone(),
            service,
        }
    }
}

/// Keeps back notifications that have no room beside everything else of the update; they stay until acknowledged anyway.
fn fit_notifications(parts: &mut [Part], room: usize) {
    let of = |part: &Part| part.events.as_ref().map_or(0, |events| events.notifications.len());
    if parts.iter().all(|part| of(part) == 0) {
        return;
    }
    let bare = |part: &Part| part.instance(None).buffer_len() - NOTIFICATION_LEN * of(part);
    let mut left = room.saturating_sub(parts.iter().map(bare).sum()) / NOTIFICATION_LEN;
    for part in parts {
        let own = INSTANCE_MAX.saturating_sub(bare(part)) / NOTIFICATION_LEN;
        let fits = of(part).min(left).min(own);
        left -= fits;
        if let Some(events) = &mut part.events {
            events.notifications.truncate(fits);
        }
    }
}

impl Engine {
    /// Node Status, class attribute 15.
    pub(super) fn node_status(&self) -> NodeStatus {
        let Some(connection) = &self.connection else { return NodeStatus::empty() };
        let control = connection.node_control();
        let mut status = NodeStatus::empty();
        status.set(NodeStatus::REMOTE_MODE, control.contains(NodeControl::REMOTE_CONTROL));
        status.set(NodeStatus::SYNC_MODE, connection.schedule.mode == Mode::Synchronous);
        let valid = control.contains(NodeControl::DATA_VALID) && connection.has_data();
        status.set(NodeStatus::DATA_VALID, valid);
        status.set(NodeStatus::FAULT, self.node.is_faulted());
        status
    }

    /// Writes the update that is due behind its sequence count.
    pub fn transmit(
        &mut self,
        now: MonotonicTime,
        system_time: Option<SystemTime>,
        out: &mut [u8],
    ) -> Option<usize> {
        let size = self.transmit_size()?.min(out.len());
        let (sequence, data) = out.get_mut(..size)?.split_first_chunk_mut::<SEQUENCE_LEN>()?;
        let revision = self.connection.as_ref()?.parameters.format_revision;
        let head = run_idle::len(revision);
        let len = head + self.produce(now, system_time, data.get_mut(head..)?)?;
        run_idle::finish(revision, data);
        *sequence = self.connection.as_ref()?.schedule.sequence.to_le_bytes();
        Some(SEQUENCE_LEN + len)
    }

    /// Writes the update that is due alone.
    pub fn transmit_unsequenced(
        &mut self,
        now: MonotonicTime,
        system_time: Option<SystemTime>,
        out: &mut [u8],
    ) -> Option<usize> {
        let size = self.transmit_size()?.checked_sub(SEQUENCE_LEN)?.min(out.len());
        self.produce(now, system_time, &mut out[..size])
    }

    /// Size of the connection, which counts a sequence count in any case.
    fn transmit_size(&self) -> Option<usize> {
        Some(usize::from(self.connection.as_ref()?.parameters.t_to_o_size))
    }

    fn produce(
        &mut self,
        now: MonotonicTime,
        system_time: Option<SystemTime>,
        update: &mut [u8],
    ) -> Option<usize> {
        let update_id = self.connection.as_mut()?.take_transmit(now)?;
        let node_status = self.node_status();
        let valid = node_status.contains(NodeStatus::DATA_VALID);
        let len = match self.config.format {
            Format::Variable => self.write_update(update, update_id, system_time)?,
            Format::Fixed => {
                let context = self.context(None);
                let slot = self.instances.slots.first_mut().filter(|_| valid);
                let block = slot.map(|slot| slot.axis.actual_block(update_id, None, &context));
                fixed::write(update.first_chunk_mut()?, update_id, node_status, &block.unwrap_or_default())?
            }
        };
        let idle = update.first_chunk::<8>().copied().filter(|_| !valid);
        self.connection.as_mut()?.transmitted(idle);
        self.statistics.counters.transmitted += 1;
        Some(len)
    }

    fn header(&mut self, update_id: u8, system_time: Option<SystemTime>) -> Option<ActualHeader> {
        let node_status = self.node_status();
        let connection = self.connection.as_ref()?;
        let valid = node_status.contains(NodeStatus::DATA_VALID);
        let asked = if valid { connection.time_data_set() } else { TimeDataSet::empty() };
        let supported = self.config.supports_sync;
        let time = system_time.filter(|_| supported).map_or(0, |t| t.0);
        let stamp = self.time_stamp(system_time).unwrap_or(0);
        let stamped = asked.contains(TimeDataSet::TIME_STAMP);
        let offset = (stamped && supported).then(|| self.clock.due(update_id));
        let diagnostics = asked.contains(TimeDataSet::UPDATE_DIAGNOSTICS);
        let diagnostics = diagnostics.then(|| self.statistics.due(update_id));
        let received_at = if supported { connection.received_at } else { 0 };
        Some(ActualHeader {
            update_id,
            node_status,
            instance_count: 0,
            node_fault: self.node.fault(),
            node_alarm: self.node.alarm(),
            last_received_id: connection.last_received_id(),
            time_stamp: stamped.then_some(stamp),
            time_offset: offset.flatten(),
            update_diagnostics: diagnostics.flatten(),
            time_diagnostics: asked
                .contains(TimeDataSet::TIME_DIAGNOSTICS)
                .then_some(TimeDiagnostics { received_at, transmitted_at: time }),
        })
    }

    /// Device Time Stamp, ns: when the actual data of the update was captured (clauses 2-1.3 and 6-2.7.2). `None` for a
    /// device without system time.
    ///
    /// There is one for all instances. It is that of the newest capture among the drives that are heard, to whose instant the
    /// positions of the others are taken ([`Axis::actual_block`](crate::device::axis::Axis::actual_block)); the controller
    /// goes on from there to its own cycle by the same means (Time-Stamp Correction), so nothing is corrected further than
    /// it would be on a device of its own. A drive that is lost does not count, and where none is heard the update itself is
    /// the event that is stamped.
    fn time_stamp(&self, system_time: Option<SystemTime>) -> Option<u64> {
        if !self.config.supports_sync {
            return None;
        }
        let axes = self.echo.iter().filter_map(|echo| usize::from(echo.number).checked_sub(1));
        let newest = axes.filter_map(|axis| self.instances.slots.get(axis)?.axis.captured_at()).max();
        newest.or(system_time.map(|time| time.0))
    }

    /// Fills in what each instance of the update has, in place: a list for all instances is too long to be handed around.
    fn fill_parts(
        &mut self,
        update_id: u8,
        system_time: Option<SystemTime>,
        parts: &mut ArrayVec<Part, INSTANCES_MAX>,
    ) {
        let stamp = self.time_stamp(system_time);
        let context = self.context(system_time);
        for number in 1..=self.instances.axis_count() {
            if self.echo.iter().any(|e| usize::from(e.number) == number && e.lists.is_some()) {
                self.publish(number);
            }
        }
        for echo in &self.echo {
            let Some((slot, table)) = self.instances.axis(usize::from(echo.number)) else {
                parts.push(Part { number: echo.number, cyclic: None, read: None, events: None });
                continue;
            };
            let read = echo.lists.map(|(write_id, read_id, write_status)| {
                let data = slot.read_lists.read(table, &slot.store, read_id);
                let read_status = data.as_ref().err().copied().unwrap_or(GeneralStatus::SUCCESS);
                let head = [write_id, write_status.0, read_id, read_status.0];
                ReadData { head, data: data.unwrap_or_default() }
            });
            parts.push(Part {
                number: echo.number,
                cyclic: echo.cyclic.then(|| slot.axis.actual_block(update_id, stamp, &context)),
                read,
                events: slot.axis.events.block(),
            });
        }
    }

    /// Writes header and instances. Service responses take what room the rest leaves: one that does not fit now waits,
    /// one that can never fit becomes an error.
    fn write_update(
        &mut self,
        update: &mut [u8],
        update_id: u8,
        system_time: Option<SystemTime>,
    ) -> Option<usize> {
        let header = self.header(update_id, system_time)?;
        if !header.node_status.contains(NodeStatus::DATA_VALID) {
            let mut writer = Writer::new(update);
            header.emit(&mut writer).ok()?;
            return Some(writer.written());
        }
        let mut parts = ArrayVec::new();
        self.fill_parts(update_id, system_time, &mut parts);
        let room = update.len().saturating_sub(header.buffer_len());
        fit_notifications(&mut parts, room);
        let base: usize = parts.iter().map(|part| part.instance(None).buffer_len()).sum();
        let room = room.saturating_sub(base);
        let mut left = room;
        let mut writer = ActualWriter::new(update, &header).ok()?;
        for part in &parts {
            let channel = self.instances.channel_of(part.number);
            let mut service = channel.and_then(ServiceChannel::response);
            if let Some(response) = &mut service
                && response.buffer_len() > room
            {
                response.general_status = GeneralStatus::REPLY_DATA_TOO_LARGE.0;
                response.data = &[];
            }
            let needed = service.as_ref().map_or(0, ServiceResponse::buffer_len);
            if needed > left {
                service = None;
            } else {
                left -= needed;
            }
            // Instance numbers follow each other without a gap, so the first that does not fit ends the update.
            if writer.instance(&part.instance(service)).is_err() {
                self.statistics.counters.left_out += 1;
                break;
            }
        }
        Some(writer.finish())
    }
}
