//! The CIP Motion side of the engine: one motion device with its axes, its I/O connection and its attributes.

mod access;
mod axis;
mod cyclic_values;
mod encoder;
mod member;
mod originals;
mod reactions;
mod refusal;
pub mod scaling;
mod stopping;
mod stopping_torque;

use std::net::SocketAddrV4;

use profile_cip::device::axis_state::AxisState;
use profile_cip::device::fault_log::FaultLog;
use profile_cip::device::motion_device::{DeviceConfig, DeviceError, MotionDevice};
use profile_cip::device::motion_link::{MotionReply, MotionRequest};
use profile_cip::device::visualization::{self, Indication, NetworkCondition};
use profile_cip::wire::class1::{CLASS1_HEADER_LEN, Class1Datagram, SEQUENCE_COUNT_LEN};
use profile_cip::wire::motion::codes::{NodeAlarm, NodeFault};
use profile_cip::wire::status::GeneralStatus;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_generic::time_base::TimeBase;

pub use self::axis::CipAxis;
pub use self::member::MemberConfig;
use self::member::{Around, Member};
pub use self::stopping::StopDefaults;
use super::admission::Admission;
use super::axis::AxisChannel;
use super::bus::{Answer, Buses, Purpose};
use super::north::{Exchange, North};
use super::notice::Notice;
use super::phase_lock::Grid;
use super::port::{FRAME_MAX, NorthPort};
use crate::mapping::{CipProgram, Item, Mapping};
use crate::north::DeviceEnd;

/// Attribute accesses handled in one cycle; the rest waits for the next.
const ACCESSES_PER_CYCLE: usize = 8;

/// Explicit requests handed to the device in one cycle.
const REQUESTS_PER_CYCLE: usize = 4;

/// Updates of the owner taken in one call: what a controller sends after a pause, and no storm.
const UPDATES_PER_CYCLE: usize = 16;

/// Datagrams refused in one call beside those. They are cheap, and the owner's update stands behind them in the socket: with
/// this many, 128 000 a second cannot hold it up in a cycle of 2 ms. Few come so far, see [`super::admission`].
const REFUSED_PER_CYCLE: usize = 256;

/// What the I/O connection has counted beside the motion device.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DatagramCounters {
    /// Datagrams of nobody's connection, or malformed before the connection data, as far as the kernel let them through.
    pub refused: u64,
    /// Datagrams that could not be sent.
    pub send_failures: u64,
}

/// One motion device.
pub struct DeviceChannel {
    number: u8,
    device: MotionDevice,
    link: DeviceEnd,
    members: Vec<Member>,
    encapsulation_sequence: u32,
    /// Room for a datagram.
    buffer: Box<[u8]>,
    admission: Admission,
    send_failures: u64,
    /// The connection for which the scaling attributes were preset.
    preset: Option<u32>,
    /// Fault and alarm of the node that were reported last.
    node: (NodeFault, NodeAlarm),
}

impl std::fmt::Debug for DeviceChannel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("DeviceChannel").field("number", &self.number).field("members", &self.members).finish()
    }
}

/// Why a device cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ChannelError {
    /// The device refuses its configuration.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// A ratio of an axis's scaling does not fit.
    #[error("axis {axis}: the motion resolution cannot be expressed exactly in the units of the tables")]
    Scaling {
        /// Number of the axis, from 0.
        axis: usize,
    },
}

impl DeviceChannel {
    /// A device with its axes in the order of their instances.
    ///
    /// # Errors
    /// See [`ChannelError`].
    pub fn new(
        number: u8,
        mut config: DeviceConfig,
        link: DeviceEnd,
        axes: Vec<MemberConfig>,
        mapping: &Mapping,
    ) -> Result<Self, ChannelError> {
        config.attributes = mapping
            .attribute_definitions(&axes[0].scaling)
            .ok_or(ChannelError::Scaling { axis: axes[0].axis })?;
        let device = MotionDevice::new(config)?;
        let mut members: Vec<Member> = Vec::with_capacity(axes.len());
        for config in axes {
            let axis = config.axis;
            let member = Member::new(config, mapping, &members).ok_or(ChannelError::Scaling { axis })?;
            members.push(member);
        }
        Ok(Self {
            number,
            device,
            link,
            members,
            encapsulation_sequence: 0,
            buffer: vec![0; FRAME_MAX].into_boxed_slice(),
            admission: Admission::default(),
            send_failures: 0,
            preset: None,
            node: (NodeFault::NONE, NodeAlarm::NONE),
        })
    }

    /// Its number in the box, from 0.
    #[must_use]
    pub fn number(&self) -> u8 {
        self.number
    }

    /// The motion device.
    #[must_use]
    pub fn device(&self) -> &MotionDevice {
        &self.device
    }

    /// The motion device, to set its synchronization.
    pub fn device_mut(&mut self) -> &mut MotionDevice {
        &mut self.device
    }

    /// The program of the CIP side for an axis of the engine; `None` when the axis is not one of this device.
    #[must_use]
    pub fn program(&self, axis: usize) -> Option<&CipProgram> {
        self.members.iter().find(|member| member.axis == axis).map(|member| member.cip.program())
    }

    /// What CIP Motion keeps of an axis of the engine; `None` when the axis is not one of this device.
    pub fn cip_axis(&mut self, axis: usize) -> Option<&mut CipAxis> {
        self.members.iter_mut().find(|member| member.axis == axis).map(|member| &mut member.cip)
    }

    /// Counters beside those of the motion device.
    #[must_use]
    pub fn counters(&self) -> DatagramCounters {
        DatagramCounters { refused: self.admission.refused(), send_failures: self.send_failures }
    }

    /// Whether settings of the drives are still read that cyclic lists may need.
    #[must_use]
    pub fn is_reading(&self) -> bool {
        self.members.iter().any(|member| member.accesses.cyclic.is_reading())
    }

    /// The engine's number of each axis with its state, in the order of the instances.
    pub fn axis_states(&self) -> impl Iterator<Item = (usize, AxisState)> + '_ {
        self.members.iter().map(|member| (member.axis, member.state))
    }

    /// The update period of the connected controller.
    #[must_use]
    pub fn update_period(&self) -> Option<DurationNs> {
        self.device.connection().map(|connection| DurationNs::from_micros(i64::from(connection.rpi_us)))
    }

    /// What the Network Status LED of the device shows.
    #[must_use]
    pub fn network_status(&self) -> Indication {
        let connected = self.device.connection().is_some() || self.link.explicit_connections() > 0;
        let timed_out = self.device.is_connection_lost();
        visualization::network_status(&NetworkCondition::listening(connected, timed_out))
    }

    /// The grid of the controller's updates in system time, if it and an axis for which `is_meant` holds work synchronously.
    #[must_use]
    pub fn grid(&self, is_meant: impl Fn(usize) -> bool) -> Option<Grid> {
        if !self.members.iter().any(|member| is_meant(member.axis)) {
            return None;
        }
        let (instant, period) = self.device.update_grid()?;
        Some(Grid { instant, period: DurationNs(i64::try_from(period).ok()?) })
    }

    /// Sets on each axis of the device whether a controller is connected.
    pub fn publish_connection(&self, axes: &mut [AxisChannel]) {
        let connected = self.device.connection().is_some();
        self.members.iter().for_each(|member| axes[member.axis].set_controller(connected));
    }

    /// Takes requests of the explicit side and what came on the I/O connection. While the gateway is `in_use`, this device may not be
    /// started anew, whatever its own axes do.
    pub fn receive(&mut self, now: MonotonicTime, time: &TimeBase, in_use: bool, port: &mut dyn NorthPort) {
        let system = time.system_at(now);
        self.link.report_kept();
        for _ in 0..REQUESTS_PER_CYCLE {
            let Some(request) = self.link.request() else { break };
            match request {
                MotionRequest::PrepareReset(token) if in_use => {
                    // A full queue means that the explicit side has given up waiting.
                    let _ = self.link.reply(MotionReply::ResetPrepared { token, granted: false });
                }
                request => self.device.request(now, Some(system), request),
            }
        }
        let mut buffer = std::mem::take(&mut self.buffer);
        let (mut updates, mut refused) = (0, 0);
        while updates < UPDATES_PER_CYCLE && refused < REFUSED_PER_CYCLE {
            let Some(datagram) = port.receive(&mut buffer) else { break };
            // What has come since the call began came now; the other way round it would answer before it was asked.
            let arrival = datagram.arrived_at.map_or(now, |at| at.min(now));
            let taken = self.datagram((now, arrival), system, &buffer[..datagram.len], datagram.from);
            *(if taken { &mut updates } else { &mut refused }) += 1;
        }
        self.buffer = buffer;
    }

    /// Hands a datagram of the owner to the device; whether that has taken it.
    fn datagram(
        &mut self,
        (now, arrival): (MonotonicTime, MonotonicTime),
        system: SystemTime,
        bytes: &[u8],
        from: SocketAddrV4,
    ) -> bool {
        let connection = self.device.connection();
        if let Err(why) = self.admission.check(connection, bytes, from) {
            self.admission.refuse(now, from, why);
            return false;
        }
        let id = connection.map_or(0, |connection| connection.o_to_t_id);
        let data = &bytes[CLASS1_HEADER_LEN - SEQUENCE_COUNT_LEN..];
        let taken = self.device.handle_io_arrived(now, arrival, Some(system), data);
        if taken && self.admission.learn(id, from) {
            self.link.tell_owner_port(id, from.port());
        }
        taken
    }

    /// Tells what came into the logs, and how the node is.
    fn tell(&mut self, notice: &mut dyn FnMut(Notice)) {
        let node = (self.device.node_fault(), self.device.node_alarm());
        if node != self.node {
            self.node = node;
            notice(Notice::Node { device: self.number, fault: node.0, alarm: node.1 });
        }
        for (place, member) in self.members.iter().enumerate() {
            while let Some(refused) = self.device.poll_refused(place) {
                notice(Notice::Refused { axis: member.number(), refused });
            }
            while let Some(entry) = self.device.poll_fault_log(place) {
                let axis = member.number();
                let cause = member.cip.program().cause_of(entry.kind, entry.code);
                notice(Notice::Logged { axis, entry, cause });
            }
        }
    }

    /// The log of an axis of the engine; `None` when the axis is not one of this device.
    #[must_use]
    pub fn fault_log(&self, axis: usize) -> Option<&FaultLog> {
        let place = self.members.iter().position(|member| member.axis == axis)?;
        self.device.fault_log(place)
    }

    /// A new connection finds the scaling attributes as the configuration of the gateway has them.
    fn preset_scaling(&mut self, mapping: &Mapping, axes: &mut [AxisChannel]) {
        let open = self.device.connection().map(|connection| connection.o_to_t_id);
        if std::mem::replace(&mut self.preset, open) == open || open.is_none() {
            return;
        }
        for (place, member) in self.members.iter_mut().enumerate() {
            member.accesses.opened();
            member.preset_scaling(mapping, &mut self.device, place, axes);
        }
    }

    /// Carries accesses to attributes that live in the drive, or in its process image, to where they live.
    pub fn attributes(&mut self, exchange: &mut Exchange<'_>, buses: &mut Buses) {
        let now = (exchange.now, exchange.system());
        let Exchange { mapping, ref mut axes, ref mut notice, .. } = *exchange;
        // A drive that is not heard is not waited for.
        let is_returning =
            self.members.iter().any(|member| member.accesses.is_returning() && axes[member.axis].is_heard());
        for _ in 0..if is_returning { 0 } else { ACCESSES_PER_CYCLE } {
            let Some(access) = self.device.poll_attribute_access() else { break };
            let place = usize::from(access.instance).checked_sub(1);
            let begun = place.ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED).and_then(|place| {
                let member = self.members.get_mut(place).ok_or(GeneralStatus::OBJECT_DOES_NOT_EXIST)?;
                let (mut on, accesses) = member.accessed((&mut self.device, self.number), place, axes);
                accesses.begin(&mut on, &access, buses, mapping, notice)?;
                member.accesses.rescaling.apply(now, member.axis, (axes, buses));
                Ok(())
            });
            if let Err(status) = begun {
                self.device.complete_attribute(access.ticket, Err(status));
            }
        }
        for (place, member) in self.members.iter_mut().enumerate() {
            let (mut on, accesses) = member.accessed((&mut self.device, self.number), place, axes);
            accesses.advance(now.0, &mut on, buses, mapping);
            member.accesses.rescaling.apply(now, member.axis, (axes, buses));
        }
    }

    /// Somebody else has set an item of the drive of this axis.
    pub fn set_by_others(&mut self, axis: usize, item: Item) {
        if let Some(member) = self.members.iter_mut().find(|member| member.axis == axis) {
            member.accesses.set_by_others(item);
        }
    }

    /// Takes the drive's answer to an access for an attribute; `false` when it is another device's.
    pub fn answer(
        &mut self,
        answer: &Answer,
        mapping: &Mapping,
        axes: &[AxisChannel],
        notice: &mut dyn FnMut(Notice),
    ) -> bool {
        let (Purpose::Attribute { device, .. } | Purpose::Original { device, .. } | Purpose::Setting(device)) =
            answer.purpose
        else {
            return false;
        };
        if device != self.number {
            return false;
        }
        let mut members = self.members.iter_mut().enumerate();
        // An access is made for a member alone, and the members of a device never change.
        let Some((place, member)) = members.find(|(_, member)| member.axis == answer.axis) else {
            return false;
        };
        match answer.purpose {
            Purpose::Attribute { ticket, attribute, write, .. } => {
                let (mut on, accesses) = member.accessed((&mut self.device, self.number), place, axes);
                accesses.answer(&mut on, answer, (ticket, attribute, write), &mapping.cip, notice);
            }
            Purpose::Original { write, .. } => member.accesses.original_answered(answer, write, notice),
            Purpose::Setting(_) => {
                member.accesses.cyclic.take(answer.data(), &axes[answer.axis]);
            }
            _ => {}
        }
        true
    }

    /// Sends what is due on the I/O connection before `next_call`, when this is called again, and answers the explicit side.
    pub fn transmit(
        &mut self,
        (now, next_call): (MonotonicTime, MonotonicTime),
        time: &TimeBase,
        port: &mut dyn NorthPort,
    ) {
        let system = time.system_at(now);
        self.device.expect_poll(next_call);
        let Self { buffer, .. } = self;
        let data = CLASS1_HEADER_LEN - SEQUENCE_COUNT_LEN;
        if let Some(length) = self.device.poll_transmit(now, Some(system), &mut buffer[data..])
            && let Some(connection) = self.device.connection()
        {
            self.encapsulation_sequence = self.encapsulation_sequence.wrapping_add(1);
            let (id, to) = (connection.t_to_o_id, connection.t_to_o_destination);
            let sequence = u16::from_le_bytes([buffer[data], buffer[data + 1]]);
            let header = Class1Datagram::emit_header(
                id,
                self.encapsulation_sequence,
                sequence,
                length - SEQUENCE_COUNT_LEN,
                buffer,
            );
            if header.is_err() || !port.send(&buffer[..data + length], to) {
                self.send_failures += 1;
            }
        }
        while let Some(reply) = self.device.poll_reply() {
            match reply {
                MotionReply::ConnectionLost { o_to_t_id, silent_us } => {
                    self.link.report_lost(o_to_t_id, silent_us);
                }
                answer => {
                    // A full queue means that the explicit side has given up waiting.
                    let _ = self.link.reply(answer);
                }
            }
        }
    }
}

impl North for DeviceChannel {
    /// Reports the drives to the motion device, lets time pass there, and hands each axis its command.
    fn exchange(&mut self, exchange: &mut Exchange<'_>) {
        let Exchange { now, time, mapping, ref mut axes, ref mut notice, .. } = *exchange;
        let system = time.system_at(now);
        self.preset_scaling(mapping, axes);
        let device = &mut self.device;
        for (place, member) in self.members.iter_mut().enumerate() {
            member.show_drive(time, mapping, device, place, &mut axes[member.axis]);
        }
        for (place, member) in self.members.iter().enumerate() {
            member.exchange_events(time, device, place, &mut axes[member.axis]);
        }
        for member in &mut self.members {
            member.show_node_fault(device, &axes[member.axis]);
        }
        device.poll(now, Some(system));
        let around = Around { now, system, time, mapping };
        for (place, member) in self.members.iter_mut().enumerate() {
            member.follow(device, place, &mut axes[member.axis], &around, *notice);
        }
        self.tell(notice);
        if let Some((count, from, why)) = self.admission.strangers(now) {
            notice(Notice::Strangers { device: self.number, count, from, why });
        }
    }
}
