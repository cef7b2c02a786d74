//! One axis of a motion device: it follows the device, and tells it what the axis does.

use profile_cip::device::axis_state::AxisState;
use profile_cip::device::drive_link::{Command, DriveAction};
use profile_cip::device::motion_device::MotionDevice;
use profile_cip::wire::motion::codes::NodeFault;
use profile_generic::capture::{CaptureKind, CaptureResult};
use profile_generic::inhibit::Inhibits;
use profile_generic::interpolation::TargetUpdate;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_generic::time_base::TimeBase;

use super::access::{Accessed, Accesses};
use super::axis::CipAxis;
use super::reactions;
use super::scaling::{Scaling, signal_octets};
use super::stopping::{Settings, StopDefaults, Stopping};
use crate::engine::axis::{AxisChannel, Owner, Reactions, Updates};
use crate::engine::notice::{Notice, axis_number};
use crate::mapping::{CipProgram, CipScaling, FeedbackUse, Mapping};

/// What a device has to know of one of its axes.
#[derive(Debug)]
pub struct MemberConfig {
    /// Its number in the engine.
    pub axis: usize,
    /// Its scaling by the configuration.
    pub scaling: CipScaling,
    /// The program of that scaling.
    pub program: CipProgram,
    /// What a stop falls back to.
    pub stops: StopDefaults,
    /// Whose encoder its position and velocity are of.
    pub feedback: FeedbackUse,
}

/// One axis of the device.
#[derive(Debug)]
pub(super) struct Member {
    /// Its number in the engine.
    pub axis: usize,
    /// What CIP Motion keeps of it.
    pub cip: CipAxis,
    pub state: AxisState,
    scaling: Scaling,
    stopping: Stopping,
    pub accesses: Accesses,
    /// The fault of the axis that was reported as one of the node.
    node_fault: Option<SystemTime>,
    /// The action of the device in the last exchange.
    action: DriveAction,
    /// What the reactions of the axis were made of; `None` while they are nobody's.
    reactions: Option<(Option<u64>, u32)>,
}

/// What an axis of the device needs to know of the cycle.
pub(super) struct Around<'a> {
    pub now: MonotonicTime,
    pub system: SystemTime,
    pub time: &'a TimeBase,
    pub mapping: &'a Mapping,
}

impl Member {
    /// An axis as it is configured; `None` if its scaling cannot be expressed exactly. `others` are axes of the same mapping: what is alike is
    /// in memory once.
    pub fn new(config: MemberConfig, mapping: &Mapping, others: &[Self]) -> Option<Self> {
        let alike =
            others.iter().map(|other| &other.scaling).find(|other| other.is_configured(&config.scaling));
        Some(Self {
            axis: config.axis,
            cip: CipAxis::new(config.program),
            state: AxisState::Off,
            scaling: match alike {
                Some(alike) => alike.alike(mapping, config.feedback),
                None => Scaling::new(mapping, config.scaling, config.feedback)?,
            },
            stopping: Stopping::new(config.stops),
            accesses: Accesses::default(),
            node_fault: None,
            action: DriveAction::None,
            reactions: None,
        })
    }

    /// Its number in the log.
    pub fn number(&self) -> u8 {
        axis_number(self.axis)
    }

    /// The axis as its attributes are accessed, and the accesses that wait for its drive.
    pub fn accessed<'a>(
        &'a mut self,
        (device, number): (&'a mut MotionDevice, u8),
        place: usize,
        axes: &'a [AxisChannel],
    ) -> (Accessed<'a>, &'a mut Accesses) {
        let Self { axis, scaling, accesses, .. } = self;
        let attributes = scaling.attributes();
        let (axis_number, axis) = (*axis, &axes[*axis]);
        (Accessed { device, number, place, axis_number, attributes, axis, axes }, accesses)
    }

    /// Sets the scaling attributes of a new connection as the configuration of the gateway has them.
    pub fn preset_scaling(
        &mut self,
        mapping: &Mapping,
        device: &mut MotionDevice,
        place: usize,
        axes: &mut [AxisChannel],
    ) {
        self.scaling.preset(mapping, (device, place), (&mut self.cip, &mut axes[self.axis]));
    }

    /// Hands on what the drive has captured, and tells it what to capture.
    pub fn exchange_events(
        &self,
        time: &TimeBase,
        device: &mut MotionDevice,
        place: usize,
        axis: &mut AxisChannel,
    ) {
        let events = self.cip.program().events();
        while let Some(CaptureResult { source, edge, status, position, at, .. }) = axis.poll_capture() {
            let event = events.event(CaptureKind::new(source, edge));
            if let (Some(event), Some(status)) = (event, events.status(status)) {
                let position = self.cip.program().counts(position.get()).value;
                device.notify_event(place, event, status, position, system_stamp(time, at));
            }
        }
        let armed = device.armed_events(place).map(|(armed, _)| armed).unwrap_or_default();
        axis.want_captures(events.captures(armed));
    }

    /// Reports the drive to the motion device, and how the axis starts and stops.
    pub fn show_drive(
        &mut self,
        time: &TimeBase,
        mapping: &Mapping,
        device: &mut MotionDevice,
        place: usize,
        axis: &mut AxisChannel,
    ) {
        device.update_drive(place, |image| {
            self.cip.fill(axis, image);
            image.events = self.scaling.checkable(image.events);
            image.captured_at = system_stamp(time, axis.feedback().at);
        });
        let computed = &mut self.accesses.cyclic;
        if let Some(program) = axis.south().filter(|_| computed.is_outdated(axis)) {
            let attributes = self.scaling.attributes();
            let refused = computed.commission(mapping, attributes, (axis.programs(), program));
            device.set_not_cyclically_read(place, refused);
            let nobodys = attributes.entries().iter().filter(|entry| !mapping.has(entry, program));
            device.set_not_cyclically_written(place, nobodys.map(|entry| entry.id));
        }
        let (settings, sequence) = self.stopping.settings(Settings {
            rows: &mapping.cip.sequence,
            device,
            place,
            attributes: self.scaling.attributes(),
            cip: &self.cip,
            axis,
        });
        device.set_sequence(place, sequence);
        if !winds_down(device, place, axis) && axis.owner() != Owner::Local {
            axis.set_stop_settings(settings);
        }
    }

    /// Reports a fault of the axis that the controller knows as one of the communications node, once.
    pub fn show_node_fault(&mut self, device: &mut MotionDevice, axis: &AxisChannel) {
        let fault = self.cip.node_fault(axis);
        if let Some((code, at)) = fault
            && self.node_fault != Some(at)
        {
            device.raise_node_fault(NodeFault(code));
        }
        self.node_fault = fault.map(|(_, at)| at);
    }

    /// Follows the motion device: its configuration, the state of the axis there, and what the axis is to do.
    pub fn follow(
        &mut self,
        device: &mut MotionDevice,
        place: usize,
        axis: &mut AxisChannel,
        around: &Around<'_>,
        notice: &mut dyn FnMut(Notice),
    ) {
        let Around { now, system, time, .. } = *around;
        if !winds_down(device, place, axis) {
            self.hand_reactions(device, place, axis, (now, system));
        }
        self.follow_state(device, place, axis, around, notice);
        if let Some(connection) = device.connection() {
            // The update may bring another target; the period stays for the life of the connection.
            let period = DurationNs::from_micros(i64::from(connection.rpi_us));
            let may_miss = device.update_delay_high_limit();
            axis.keep_updates(Updates { period, may_miss, first: TargetUpdate::Interpolate });
        }
        if let Some(view) = device.position_view(place) {
            let (attributes, signals) = (self.scaling.attributes(), &*axis);
            let computed = &mut self.accesses.cyclic;
            let mut octets = |id, octets: &mut [u8; 8]| {
                signal_octets(attributes, signals, &view, id, octets)
                    .or_else(|| computed.octets((around.mapping, attributes), signals, id, octets))
            };
            device.publish_signals(place, &mut octets);
        }
        let Some(image) = device.command(place, now) else { return };
        let enabled = image.action == DriveAction::Enable && self.action != DriveAction::Enable;
        self.action = image.action;
        if enabled {
            // Scaling attributes may have been set since the configuration was complete, or since they were refused.
            self.adopt_scaling(device, place, axis, around, notice);
        }
        if axis.owner() == Owner::Local {
            // No controller is connected.
            return;
        }
        let mut inhibits = Inhibits::empty();
        // Nor with what the last controller has left in the drive.
        let is_incomplete = !self.scaling.is_taken() || self.accesses.is_returning();
        inhibits.set(Inhibits::CONFIGURATION_INCOMPLETE, is_incomplete);
        inhibits.set(Inhibits::LIMIT_SWITCHES_NOT_TOLD, axis.misses_limit_switches());
        axis.set_inhibits(now, system, inhibits);
        let target = match &image.command {
            Command::Follow(points) => points.target_time.map(SystemTime),
            Command::Withheld(_) => None,
        };
        self.cip.command(axis, (now, system), &image, target.map(|at| time.target_at(at)));
    }

    /// Follows the state of the axis in the motion device. The scaling counts from the end of Initializing on.
    fn follow_state(
        &mut self,
        device: &MotionDevice,
        place: usize,
        axis: &mut AxisChannel,
        around: &Around<'_>,
        notice: &mut dyn FnMut(Notice),
    ) {
        let Some(state) = device.axis_state(place).filter(|state| *state != self.state) else { return };
        let before = std::mem::replace(&mut self.state, state);
        notice(Notice::AxisState { axis: self.number(), from: before, to: state });
        // Also when a fault stands and the axis goes on to Major Faulted at once.
        if before == AxisState::Initializing && device.connection().is_some() {
            self.adopt_scaling(device, place, axis, around, notice);
        }
    }

    /// Takes the controller's scaling; one that makes no sense is a fault of the axis.
    fn adopt_scaling(
        &mut self,
        device: &MotionDevice,
        place: usize,
        axis: &mut AxisChannel,
        around: &Around<'_>,
        notice: &mut dyn FnMut(Notice),
    ) {
        let get = |id| device.attribute(place, id);
        if let Err(error) = self.scaling.take(around.mapping, (&mut self.cip, axis), get) {
            axis.refuse_configuration(around.now, around.system);
            notice(Notice::Scaling { axis: self.number(), error });
        }
    }

    /// Hands the axis what the controller wants done about exceptions, when that is something else. Without a connection
    /// nobody wants anything, once the axis has ended what it was doing on the last one.
    fn hand_reactions(
        &mut self,
        device: &MotionDevice,
        place: usize,
        axis: &mut AxisChannel,
        (now, system): (MonotonicTime, SystemTime),
    ) {
        let made_of = match device.connection() {
            Some(_) => Some((device.attribute_changes(place), self.cip.scaling_id())),
            None if axis.may_have_torque() => return,
            None => None,
        };
        if made_of == self.reactions {
            return;
        }
        self.reactions = made_of;
        let wanted = match made_of {
            Some(_) => reactions::reactions(self.cip.program(), &device.exception_actions(place)),
            None => Reactions::default(),
        };
        axis.set_reactions(now, system, &wanted);
    }
}

/// Whether an axis still stops after the last connection: the attributes are those of the next one already.
fn winds_down(device: &MotionDevice, place: usize, axis: &AxisChannel) -> bool {
    device.axis_state(place) == Some(AxisState::Initializing) && axis.may_have_torque()
}

/// An instant of the local clock as a stamp in system time, ns; 0 for one that is not known.
fn system_stamp(time: &TimeBase, at: MonotonicTime) -> u64 {
    if at == MonotonicTime::ZERO { 0 } else { time.system_at(at).0 }
}
