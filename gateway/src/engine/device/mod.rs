//! The CIP Motion side of the engine: one motion device with its axes, its I/O connection and its attributes.

mod axis;
mod stopping_torque;

use std::net::SocketAddrV4;

use arrayvec::ArrayVec;
use profile_cip::device::attribute_worker::{AccessOperation, AttributeAccess};
use profile_cip::device::axis_object::PositionView;
use profile_cip::device::axis_state::AxisState;
use profile_cip::device::drive_link::{Command, DriveAction};
use profile_cip::device::fault_log::FaultLog;
use profile_cip::device::motion_device::{DeviceConfig, DeviceError, MotionDevice, SequenceSettings};
use profile_cip::device::visualization::{self, Indication, NetworkCondition};
use profile_cip::wire::class1::{CLASS1_HEADER_LEN, Class1Datagram, SEQUENCE_COUNT_LEN};
use profile_cip::wire::motion::codes::{ControlMode, EventChecking, NodeAlarm, NodeFault};
use profile_cip::wire::status::GeneralStatus;
use profile_generic::capture::{CaptureKind, CaptureResult};
use profile_generic::fault::Reaction;
use profile_generic::inhibit::Inhibits;
use profile_generic::interpolation::TargetUpdate;
use profile_generic::mode::OperatingMode;
use profile_generic::quantity::{Acceleration, Velocity};
use profile_generic::sequence::SequenceTimes;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_generic::time_base::TimeBase;

pub use self::axis::CipAxis;
use self::stopping_torque::Comparison;
use super::access::{Access, AccessFailure, Refusal};
use super::admission::Admission;
use super::axis::{AxisChannel, StopSettings};
use super::bus::{Answer, Buses, Purpose};
use super::notice::Notice;
use super::port::{FRAME_MAX, NorthPort};
use crate::mapping::{self, AttributeTable, CipProgram, CipScaling, CipType, Mapping, SequenceAttributes};
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

/// Writes to the drive that may be under way for one axis.
const WRITES_MAX: usize = 8;

/// Attributes that describe the scaling of an axis.
const SCALING_MAX: usize = 8;

/// Why the controller's scaling is not in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ScalingRefusal {
    /// The attributes make no sense.
    #[error(transparent)]
    Attributes(#[from] mapping::CipScalingError),
    /// A ratio does not fit.
    #[error("a ratio of the scaling cannot be expressed exactly")]
    Inexact,
    /// The axis still has torque.
    #[error("the axis still has torque")]
    Energized,
}

/// One axis of the device.
#[derive(Debug)]
struct Member {
    /// Its number in the engine.
    axis: usize,
    /// What CIP Motion keeps of it.
    cip: CipAxis,
    scaling: CipScaling,
    /// The scaling of the configuration, to which every new connection returns.
    configured: CipScaling,
    attributes: AttributeTable,
    state: AxisState,
    /// The fault of the axis that was told as one of the node.
    node_fault: Option<SystemTime>,
    /// The controller's scaling is known and in use on this connection.
    scaled: bool,
    /// The device does the scaling, not the controller.
    drive_scaling: bool,
    /// The action of the device in the last exchange.
    action: DriveAction,
    /// What a stop falls back to where the controller has set nothing.
    stops: StopDefaults,
    /// How the axis is to start and stop, as long as nothing changes that it was made of.
    stopping: Option<(MadeOf, Stopping)>,
    /// Attributes of the sequences that are being written to the drive: ticket, attribute and bytes. What the drive has
    /// taken is kept here as well, because the box goes by it.
    writes: ArrayVec<(u32, u16, ArrayVec<u8, 8>), WRITES_MAX>,
    /// A Stopping Torque that is being compared with the drive's torque limits.
    comparison: Option<Comparison>,
}

/// What the settings of starts and stops are made of: attributes of the axis, its programs, and the control mode of the
/// last update. [`StopDefaults`] never change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct MadeOf {
    attributes: Option<u64>,
    programs: (u64, u32),
    control_mode: Option<ControlMode>,
}

impl MadeOf {
    fn now(device: &MotionDevice, place: usize, axis: &AxisChannel, cip: &CipAxis) -> Self {
        Self {
            attributes: device.attribute_changes(place),
            programs: (axis.programs(), cip.scaling_id()),
            control_mode: device.control_mode(place),
        }
    }
}

/// How an axis is to start and stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Stopping {
    settings: StopSettings,
    sequence: SequenceSettings,
}

/// What a stop falls back to where the controller has set nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StopDefaults {
    /// Speed of an axis that stands.
    pub zero_speed: Velocity,
    /// Deceleration of a ramp.
    pub deceleration: Option<Acceleration>,
}

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
    /// Fault and alarm of the node that were told last.
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
    /// A device; `axes` are the engine's numbers of its axes in the order of their instances, with their scaling.
    ///
    /// # Errors
    /// See [`ChannelError`].
    pub fn new(
        number: u8,
        mut config: DeviceConfig,
        link: DeviceEnd,
        axes: &[(usize, CipScaling, StopDefaults)],
        mapping: &Mapping,
    ) -> Result<Self, ChannelError> {
        config.attributes =
            mapping.attribute_definitions(&axes[0].1).ok_or(ChannelError::Scaling { axis: axes[0].0 })?;
        let device = MotionDevice::new(config)?;
        let members = axes
            .iter()
            .map(|(axis, scaling, stops)| {
                let attributes =
                    mapping.attribute_table(scaling).ok_or(ChannelError::Scaling { axis: *axis })?;
                let program = mapping.cip_program(scaling).ok_or(ChannelError::Scaling { axis: *axis })?;
                let (scaling, configured) = (*scaling, *scaling);
                Ok(Member {
                    axis: *axis,
                    cip: CipAxis::new(program),
                    scaling,
                    configured,
                    attributes,
                    state: AxisState::Off,
                    node_fault: None,
                    scaled: false,
                    drive_scaling: true,
                    action: DriveAction::None,
                    stops: *stops,
                    stopping: None,
                    writes: ArrayVec::new(),
                    comparison: None,
                })
            })
            .collect::<Result<_, ChannelError>>()?;
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

    /// Counters beside those of the motion device.
    #[must_use]
    pub fn counters(&self) -> DatagramCounters {
        DatagramCounters { refused: self.admission.refused(), send_failures: self.send_failures }
    }

    /// The engine's number of each axis with its state, in the order of the instances.
    pub fn axis_states(&self) -> impl Iterator<Item = (usize, AxisState)> + '_ {
        self.members.iter().map(|member| (member.axis, member.state))
    }

    /// What the Network Status LED of the device shows. The box tests nothing of itself before it speaks, has the address it
    /// listens at, and does not look for another station with it.
    #[must_use]
    pub fn network_status(&self) -> Indication {
        visualization::network_status(&NetworkCondition {
            self_test: false,
            address: true,
            duplicate: false,
            connected: self.device.connection().is_some() || self.link.explicit_connections() > 0,
            timed_out: self.device.is_connection_lost(),
        })
    }

    /// Takes requests of the explicit side and what came on the I/O connection.
    pub fn receive(&mut self, now: MonotonicTime, time: &TimeBase, port: &mut dyn NorthPort) {
        let system = time.system_at(now);
        for _ in 0..REQUESTS_PER_CYCLE {
            let Some(request) = self.link.request() else { break };
            self.device.request(now, Some(system), request);
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

    /// Tells the device of its drives, lets time pass, and hands each axis what it has to do.
    pub fn exchange(
        &mut self,
        now: MonotonicTime,
        time: &TimeBase,
        mapping: &Mapping,
        axes: &mut [AxisChannel],
        notice: &mut dyn FnMut(Notice),
    ) {
        let system = time.system_at(now);
        self.preset_scaling(mapping, axes);
        for (place, member) in self.members.iter_mut().enumerate() {
            self.device.update_drive(place, |image| {
                member.cip.fill(&axes[member.axis], image);
                image.events = member.checkable(image.events);
                image.captured_at = system_stamp(time, axes[member.axis].feedback().at);
            });
            let axis = &mut axes[member.axis];
            let Stopping { settings, sequence } = member.stopping(mapping, &self.device, place, axis);
            self.device.set_sequence(place, sequence);
            // The attributes are those of the next connection while the axis still stops after the last one.
            let winds_down =
                self.device.axis_state(place) == Some(AxisState::Initializing) && axis.may_have_torque();
            if !winds_down {
                axis.set_stop_settings(settings);
            }
        }
        self.events(time, axes);
        for member in &mut self.members {
            let fault = member.cip.node_fault(&axes[member.axis]);
            if let Some((code, at)) = fault
                && member.node_fault != Some(at)
            {
                self.device.raise_node_fault(NodeFault(code));
            }
            member.node_fault = fault.map(|(_, at)| at);
        }
        self.device.poll(now, Some(system));
        let period = self.device.connection().map(|connection| i64::from(connection.rpi_us));
        for (place, member) in self.members.iter_mut().enumerate() {
            let axis = &mut axes[member.axis];
            if let Some(state) = self.device.axis_state(place)
                && state != member.state
            {
                let number = u8::try_from(member.axis).unwrap_or(u8::MAX);
                notice(Notice::AxisState { axis: number, from: member.state, to: state });
                // Also when a fault stands and the axis goes on to Major Faulted at once.
                if member.state == AxisState::Initializing && self.device.connection().is_some() {
                    let device = &self.device;
                    if let Err(error) = member.take_scaling(mapping, axis, |id| device.attribute(place, id)) {
                        axis.refuse_configuration(now, system);
                        notice(Notice::Scaling { axis: number, error });
                    }
                }
                member.state = state;
            }
            if let Some(period) = period {
                // The update may bring another target; the period stays for the life of the connection.
                axis.keep_update_period(DurationNs::from_micros(period), TargetUpdate::Interpolate);
            }
            if let Some(view) = self.device.position_view(place) {
                let (attributes, signals) = (&member.attributes, &*axis);
                let mut octets =
                    |id, octets: &mut [u8; 8]| signal_octets(attributes, signals, &view, id, octets);
                self.device.publish_signals(place, &mut octets);
            }
            if let Some(image) = self.device.command(place, now) {
                let enabled = image.action == DriveAction::Enable && member.action != DriveAction::Enable;
                member.action = image.action;
                if enabled && member.scaled {
                    // Scaling attributes may have been set since the configuration was complete.
                    let device = &self.device;
                    if let Err(error) = member.take_scaling(mapping, axis, |id| device.attribute(place, id)) {
                        axis.refuse_configuration(now, system);
                        let number = u8::try_from(member.axis).unwrap_or(u8::MAX);
                        notice(Notice::Scaling { axis: number, error });
                    }
                }
                let mut inhibits = Inhibits::empty();
                inhibits.set(Inhibits::CONFIGURATION_INCOMPLETE, !member.scaled);
                inhibits.set(Inhibits::LIMIT_SWITCHES_NOT_TOLD, axis.misses_limit_switches());
                axis.set_inhibits(now, system, inhibits);
                let target = match &image.command {
                    Command::Follow(points) => points.target_time.map(SystemTime),
                    Command::Withheld(_) => None,
                };
                let target = target.map(|at| time.monotonic_at(at));
                member.cip.command(axis, (now, system), &image, target);
            }
        }
        self.tell(notice);
        if let Some(strangers) = self.admission.notice(now, self.number) {
            notice(strangers);
        }
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
                let axis = u8::try_from(member.axis).unwrap_or(u8::MAX);
                notice(Notice::Refused { axis, refused });
            }
            while let Some(entry) = self.device.poll_fault_log(place) {
                let axis = u8::try_from(member.axis).unwrap_or(u8::MAX);
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

    /// Hands on what the drives have captured, and tells them what to capture.
    fn events(&mut self, time: &TimeBase, axes: &mut [AxisChannel]) {
        for (place, member) in self.members.iter().enumerate() {
            let axis = &mut axes[member.axis];
            while let Some(CaptureResult { source, edge, status, position, at, .. }) = axis.poll_capture() {
                let events = member.cip.program().events();
                let event = events.event(CaptureKind::new(source, edge));
                if let (Some(event), Some(status)) = (event, events.status(status)) {
                    let position = member.cip.program().counts(position.get()).value;
                    self.device.notify_event(place, event, status, position, system_stamp(time, at));
                }
            }
            let armed = self.device.armed_events(place).map_or(EventChecking::empty(), |(armed, _)| armed);
            let captures = member.cip.program().events().captures(armed);
            axis.want_captures(captures);
        }
    }

    /// A new connection finds the scaling attributes as the configuration of the box has them.
    fn preset_scaling(&mut self, mapping: &Mapping, axes: &mut [AxisChannel]) {
        let open = self.device.connection().map(|connection| connection.o_to_t_id);
        if open == self.preset {
            return;
        }
        self.preset = open;
        if open.is_none() {
            return;
        }
        for (place, member) in self.members.iter_mut().enumerate() {
            for (id, value) in scaling_attributes(&mapping.cip, &member.configured) {
                let Some(entry) = member.attributes.get(id) else { continue };
                let bytes = value.to_le_bytes();
                // Refused only for an attribute that the device does not have.
                let _ = self.device.put_attribute(place, id, &bytes[..width(entry.data_type)]);
            }
            let axis = &mut axes[member.axis];
            // Counts from the end of the configuration on; refused while the axis still stops, and then taken again.
            let _ = member.use_scaling(mapping, axis, member.configured);
            member.scaled = false;
            member.drive_scaling = true;
        }
    }

    /// Carries accesses to attributes that live in the drive, or in its process image, to where they live.
    pub fn attributes(&mut self, mapping: &Mapping, axes: &[AxisChannel], buses: &mut Buses) {
        for _ in 0..ACCESSES_PER_CYCLE {
            let Some(access) = self.device.poll_attribute_access() else { break };
            if let Err(status) = self.access(&access, axes, buses, &mapping.cip.sequence) {
                self.device.complete_attribute(access.ticket, Err(status));
            }
        }
    }

    fn access(
        &mut self,
        access: &AttributeAccess,
        axes: &[AxisChannel],
        buses: &mut Buses,
        sequence: &SequenceAttributes,
    ) -> Result<(), GeneralStatus> {
        let place =
            usize::from(access.instance).checked_sub(1).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)?;
        let member = self.members.get_mut(place).ok_or(GeneralStatus::OBJECT_DOES_NOT_EXIST)?;
        let entry = *member.attributes.get(access.id).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)?;
        let axis = &axes[member.axis];
        match entry.backing {
            mapping::Backing::Signal { .. } => {
                let mut bytes = [0; 8];
                let view = self.device.position_view(place);
                let len = view
                    .and_then(|view| signal_octets(&member.attributes, axis, &view, access.id, &mut bytes))
                    .ok_or(GeneralStatus::DEVICE_STATE_CONFLICT)?;
                self.device.complete_attribute(access.ticket, Ok(&bytes[..len]));
                Ok(())
            }
            mapping::Backing::Parameter { parameter, reject, .. } => {
                let program = axis.south().ok_or(GeneralStatus::DEVICE_STATE_CONFLICT)?;
                let Some(held) = program.parameter(parameter) else {
                    if reject || program.rejects(parameter) {
                        return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED);
                    }
                    if let AccessOperation::Write(bytes) = &access.operation
                        && stopping_torque::is_stopping_torque(&entry)
                    {
                        if let Some(before) = member.comparison.take() {
                            // Its drive was lost, or it is overtaken.
                            let overtaken = Err(GeneralStatus::DEVICE_STATE_CONFLICT);
                            self.device.complete_attribute(before.ticket, overtaken);
                        }
                        let number = (self.number, member.axis);
                        let begun = Comparison::begin(access, bytes, &entry, number, axis, buses)?;
                        member.comparison = Some(begun);
                        return Ok(());
                    }
                    return self.shadow(access, place);
                };
                if held.to_drive.is_none() && entry.access != mapping::Access::Get {
                    // The drive lets the parameter only be read: what the controller sets is kept beside it.
                    return self.shadow(access, place);
                }
                let (request, write) = match &access.operation {
                    AccessOperation::Read(_) => (Access::read(held.item), false),
                    AccessOperation::Write(bytes) => {
                        let generic =
                            entry.to_generic(bytes).map_err(|_| GeneralStatus::INVALID_ATTRIBUTE_VALUE)?;
                        let kept = |id| {
                            let entry = member.attributes.get(id)?;
                            entry.to_generic(self.device.attribute(place, id).ok()?).ok()
                        };
                        if stopping_torque::exceeds(parameter, generic, &member.attributes, kept, axis) {
                            return Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE);
                        }
                        let (bytes, len, clamped) =
                            held.encode(generic).ok_or(GeneralStatus::ATTRIBUTE_NOT_SETTABLE)?;
                        if clamped {
                            return Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE);
                        }
                        let write = Access::write(held.item, &bytes[..len]);
                        (write.ok_or(GeneralStatus::TOO_MUCH_DATA)?, true)
                    }
                };
                let purpose = Purpose::Attribute {
                    ticket: access.ticket,
                    device: self.number,
                    attribute: access.id,
                    write,
                };
                if buses.access(member.axis, &request, purpose) {
                    member.note_write(access, sequence);
                    Ok(())
                } else {
                    Err(GeneralStatus::RESOURCE_UNAVAILABLE)
                }
            }
            _ => Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
    }

    /// A parameter that the drive lacks: kept and given back.
    fn shadow(&mut self, access: &AttributeAccess, place: usize) -> Result<(), GeneralStatus> {
        match &access.operation {
            AccessOperation::Read(_) => {
                let mut bytes = [0; 8];
                let held = self.device.attribute(place, access.id)?;
                let len = held.len().min(bytes.len());
                bytes[..len].copy_from_slice(&held[..len]);
                self.device.complete_attribute(access.ticket, Ok(&bytes[..len]));
            }
            AccessOperation::Write(bytes) => {
                self.device.put_attribute(place, access.id, bytes)?;
                self.device.complete_attribute(access.ticket, Ok(&[]));
            }
        }
        Ok(())
    }

    /// Takes the drive's answer to an attribute access; `false` when it is another device's.
    pub fn answer(&mut self, answer: &Answer, axes: &[AxisChannel]) -> bool {
        let Purpose::Attribute { ticket, device, attribute, write } = answer.purpose else { return false };
        if device != self.number {
            return false;
        }
        let place = self.members.iter().position(|member| member.axis == answer.axis);
        if let Some(place) = place
            && let Some(at) = self.members[place].writes.iter().position(|(of, ..)| *of == ticket)
        {
            let (_, id, value) = self.members[place].writes.remove(at);
            if answer.result.is_ok() {
                // It was checked against the type of the attribute when it was encoded.
                let _ = self.device.put_attribute(place, id, &value);
            }
        }
        if let Some(place) = place
            && let Some(comparison) = &mut self.members[place].comparison
            && comparison.ticket == ticket
        {
            if let Some(verdict) = comparison.take(answer, &axes[answer.axis]) {
                let (id, value) = (comparison.attribute, comparison.bytes.clone());
                self.members[place].comparison = None;
                let kept = verdict.and_then(|()| self.device.put_attribute(place, id, &value));
                self.device.complete_attribute(ticket, kept.map(|()| &[][..]));
            }
            return true;
        }
        let member = place.map(|place| &self.members[place]);
        let mut bytes = [0; 8];
        let result = match (&answer.result, member) {
            (Err(failure), _) => Err(refusal(*failure)),
            (Ok(_), _) if write => Ok(0),
            (Ok((data, _)), Some(member)) => {
                let entry = member.attributes.get(attribute);
                let held = entry.and_then(|entry| match entry.backing {
                    mapping::Backing::Parameter { parameter, .. } => {
                        axes[member.axis].south()?.parameter(parameter)
                    }
                    _ => None,
                });
                let generic = held.and_then(|held| held.decode(data));
                match (generic, entry) {
                    (Some(generic), Some(entry)) => entry
                        .from_generic(generic, &mut bytes)
                        .map(|(len, _)| len)
                        .map_err(|_| GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
                    _ => Err(GeneralStatus::DEVICE_STATE_CONFLICT),
                }
            }
            (Ok(_), None) => Err(GeneralStatus::OBJECT_DOES_NOT_EXIST),
        };
        match result {
            Ok(len) => self.device.complete_attribute(ticket, Ok(&bytes[..len])),
            Err(status) => self.device.complete_attribute(ticket, Err(status)),
        }
        true
    }

    /// Sends what is due on the I/O connection, and answers the explicit side.
    pub fn transmit(&mut self, now: MonotonicTime, time: &TimeBase, port: &mut dyn NorthPort) {
        let system = time.system_at(now);
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
            // A full queue means that the explicit side has given up waiting.
            let _ = self.link.reply(reply);
        }
    }
}

impl Member {
    /// What can be checked for on this connection, of what axis and drive can. Windows, watch positions and torque only
    /// where the device does the scaling (Table 5-2.36).
    fn checkable(&self, events: EventChecking) -> EventChecking {
        if self.drive_scaling { events | events.windows() } else { events - EventChecking::EXTENDED }
    }

    /// How the axis is to start and stop now. It is worked out again when something has changed that it is made of.
    fn stopping(
        &mut self,
        mapping: &Mapping,
        device: &MotionDevice,
        place: usize,
        axis: &AxisChannel,
    ) -> Stopping {
        let now = MadeOf::now(device, place, axis, &self.cip);
        if let Some((made_of, stopping)) = self.stopping
            && made_of == now
        {
            debug_assert_eq!(stopping, self.work_out_stopping(mapping, device, place, axis), "it is stale");
            return stopping;
        }
        let stopping = self.work_out_stopping(mapping, device, place, axis);
        self.stopping = Some((now, stopping));
        stopping
    }

    fn work_out_stopping(
        &self,
        mapping: &Mapping,
        device: &MotionDevice,
        place: usize,
        axis: &AxisChannel,
    ) -> Stopping {
        let (settings, abort) = self.stop_settings(mapping, device, place, axis);
        let abort = self.cip.program().fault_action(abort);
        Stopping { settings, sequence: SequenceSettings { flying_start: settings.flying_start, abort } }
    }

    /// How the axis is to start and stop by the attributes that the controller has set, and the reaction to an Abort.
    fn stop_settings(
        &self,
        mapping: &Mapping,
        device: &MotionDevice,
        place: usize,
        axis: &AxisChannel,
    ) -> (StopSettings, Reaction) {
        let rows = &mapping.cip.sequence;
        let raw = |id| number_of(device.attribute(place, id), false);
        let value = |id| {
            let entry = self.attributes.get(id)?;
            let generic = entry.to_generic(device.attribute(place, id).ok()?).ok()?;
            (generic > 0).then_some(generic)
        };
        let time = |id| value(id).map(DurationNs);
        // A delay that the drive waits out by itself is not waited twice.
        let delay = |id| {
            let by_drive = match self.attributes.get(id).map(|entry| entry.backing) {
                Some(mapping::Backing::Parameter { parameter, .. }) => {
                    axis.south().is_some_and(|program| program.parameter(parameter).is_some())
                }
                _ => false,
            };
            if by_drive { DurationNs::ZERO } else { time(id).unwrap_or_default() }
        };
        let stopping = u8::try_from(raw(rows.stopping_action)).ok();
        let stopping = stopping.and_then(|code| self.cip.program().stopping(code));
        let stopping_limit = time(rows.stopping_time_limit).unwrap_or(SequenceTimes::FACTORY_LIMIT);
        let by_velocity = device.control_mode(place).and_then(|mode| self.cip.program().mode(mode.0))
            == Some(OperatingMode::Velocity);
        let settings = StopSettings {
            plan: stopping.map(|row| row.plan).unwrap_or_default(),
            times: SequenceTimes {
                brake_release_delay: delay(rows.brake_release_delay),
                brake_engage_delay: delay(rows.brake_engage_delay),
                stopping_limit,
                // Where it is not set the stopping time limit applies (attribute 617).
                coasting_limit: time(rows.coasting_time_limit).unwrap_or(stopping_limit),
                zero_speed: value(rows.zero_speed).map_or(self.stops.zero_speed, Velocity),
                zero_speed_time: time(rows.zero_speed_time).unwrap_or_default(),
            },
            deceleration: value(rows.ramp_deceleration).map(Acceleration).or(self.stops.deceleration),
            flying_start: raw(rows.flying_start) != 0 && by_velocity,
            checks_overtravel: raw(rows.overtravel_checking) != 0,
        };
        (settings, stopping.map(|row| row.abort).unwrap_or_default())
    }

    /// Remembers what is written to the drive for an attribute that the sequences go by.
    fn note_write(&mut self, access: &AttributeAccess, sequence: &SequenceAttributes) {
        if let AccessOperation::Write(bytes) = &access.operation
            && [sequence.zero_speed, sequence.ramp_deceleration].contains(&access.id)
            && let Ok(value) = ArrayVec::try_from(&bytes[..])
        {
            if self.writes.is_full() {
                self.writes.remove(0);
            }
            self.writes.push((access.ticket, access.id, value));
        }
    }

    /// The controller has finished its configuration: its scaling counts from now on.
    fn take_scaling<'d>(
        &mut self,
        mapping: &Mapping,
        axis: &mut AxisChannel,
        get: impl Fn(u16) -> Result<&'d [u8], GeneralStatus>,
    ) -> Result<(), ScalingRefusal> {
        self.scaled = false;
        let number = |id| {
            let signed = self.attributes.get(id).is_some_and(|entry| is_signed(entry.data_type));
            number_of(get(id), signed)
        };
        let rows = &mapping.cip.scaling;
        self.drive_scaling = number(rows.configuration) == i64::from(rows.drive_scaling);
        let scaling = CipScaling::from_attributes(&mapping.cip, number)?;
        self.use_scaling(mapping, axis, scaling)?;
        self.scaled = true;
        Ok(())
    }

    fn use_scaling(
        &mut self,
        mapping: &Mapping,
        axis: &mut AxisChannel,
        scaling: CipScaling,
    ) -> Result<(), ScalingRefusal> {
        if scaling == self.scaling {
            return Ok(());
        }
        let program = mapping.cip_program(&scaling).ok_or(ScalingRefusal::Inexact)?;
        let attributes = mapping.attribute_table(&scaling).ok_or(ScalingRefusal::Inexact)?;
        if !self.cip.set_program(axis, program) {
            return Err(ScalingRefusal::Energized);
        }
        self.attributes = attributes;
        self.scaling = scaling;
        Ok(())
    }
}

/// An instant of the local clock as a stamp in system time, ns; 0 for one that is not known.
fn system_stamp(time: &TimeBase, at: MonotonicTime) -> u64 {
    if at == MonotonicTime::ZERO { 0 } else { time.system_at(at).0 }
}

/// The attributes that describe a scaling, with their values.
fn scaling_attributes(
    tables: &mapping::CipTables,
    scaling: &CipScaling,
) -> ArrayVec<(u16, i64), SCALING_MAX> {
    let rows = &tables.scaling;
    let known = |unit: &&mapping::DisplacementUnit| {
        unit.kind == scaling.kind && unit.nanounits == scaling.nanounits_per_unit
    };
    let unit = tables.motion_units.iter().find(known).map_or(0, |unit| i64::from(unit.code));
    let polarity = if scaling.inverted { i64::from(rows.inverted) } else { 0 };
    let resolution =
        rows.resolution.iter().zip([scaling.counts_per_unit].into_iter().chain(std::iter::repeat(1)));
    let fixed = [
        (rows.configuration, i64::from(rows.drive_scaling)),
        (rows.unit, unit),
        (rows.polarity, polarity),
        (rows.unwind, i64::from(scaling.unwind.is_some())),
        (rows.unwind_position, scaling.unwind.unwrap_or(0)),
    ];
    fixed.into_iter().chain(resolution.map(|(id, value)| (*id, value))).take(SCALING_MAX).collect()
}

/// Octets of an integer type.
fn width(cip: CipType) -> usize {
    match cip {
        CipType::Bool | CipType::Sint | CipType::Usint | CipType::Byte | CipType::ShortString => 1,
        CipType::Int | CipType::Uint | CipType::Word => 2,
        CipType::Dint | CipType::Udint | CipType::Dword | CipType::Real => 4,
        CipType::Lint | CipType::Ulint | CipType::Lword | CipType::Lreal => 8,
    }
}

/// Whether an integer type has a sign.
fn is_signed(cip: CipType) -> bool {
    matches!(cip, CipType::Sint | CipType::Int | CipType::Dint | CipType::Lint)
}

/// An attribute's bytes as a number; 0 where there is none.
fn number_of(bytes: Result<&[u8], GeneralStatus>, signed: bool) -> i64 {
    let bytes = bytes.unwrap_or_default();
    let negative = signed && bytes.last().is_some_and(|last| last & 0x80 != 0);
    let mut wide = [if negative { 0xFF } else { 0 }; 8];
    for (to, from) in wide.iter_mut().zip(bytes) {
        *to = *from;
    }
    i64::from_le_bytes(wide)
}

/// Writes the value of a signal as the attribute with this number; `None` while it has none.
fn signal_octets(
    attributes: &AttributeTable,
    axis: &AxisChannel,
    view: &PositionView,
    id: u16,
    octets: &mut [u8; 8],
) -> Option<usize> {
    let entry = attributes.get(id)?;
    let mapping::Backing::Signal { signal, .. } = entry.backing else { return None };
    let generic = axis.signal(signal)?;
    entry.from_signal(generic, view, octets).ok()
}

/// What a refusal of the drive means to the controller.
fn refusal(failure: AccessFailure) -> GeneralStatus {
    match failure {
        AccessFailure::Refused(Refusal::Unknown) => GeneralStatus::ATTRIBUTE_NOT_SUPPORTED,
        AccessFailure::Refused(Refusal::ReadOnly) => GeneralStatus::ATTRIBUTE_NOT_SETTABLE,
        AccessFailure::Refused(Refusal::Value) => GeneralStatus::INVALID_ATTRIBUTE_VALUE,
        AccessFailure::Refused(Refusal::Other) | AccessFailure::Unanswered => {
            GeneralStatus::DEVICE_STATE_CONFLICT
        }
    }
}
