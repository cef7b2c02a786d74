//! The south sides of the engine: their contract [`South`], and what the buses have in common.

mod accesses;
mod backoff;
mod bus_return;
pub mod can;
mod can_link;
pub mod commissioner;
pub mod devicenet;
mod direct_slot;
pub mod sercos;
pub mod startup;
mod transmit_queue;

use std::fmt;

use profile_generic::state::Action;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

use super::access::{Access, AccessFailure, Data, Operation, Progress};
use super::axis::AxisChannel;
use super::axis::capture::CaptureAccess;
use super::axis::procedure::ProcedureAccess;
use super::cyclic::Received;
use super::direct::{DirectFailure, DirectResult, DirectTask, NotBegun};
use super::notice::Notice;
use super::port::SouthPort;
use crate::mapping::{Item, Mapping};
use crate::status::{BusDetail, NodeStatus};

/// What an access to a drive is for. Its answer comes back with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// A controller's access to an attribute that lives in the drive.
    Attribute {
        /// The motion device's ticket.
        ticket: u32,
        /// Index of the axis's device.
        device: u8,
        /// Its number in the Motion Device Axis Object.
        attribute: u16,
        /// Whether it is a write access.
        write: bool,
    },
    /// What a drive has before a controller's first write, or its way back there.
    Original {
        /// Index of the axis's device.
        device: u8,
        /// It goes back.
        write: bool,
    },
    /// A setting of a drive that a cyclic list of a controller needs, with the index of the device of the axis.
    Setting(u8),
    /// Local control's access to a parameter, by its ticket.
    LocalParameter(u32),
    /// An explicit request's access to a parameter at a device with assemblies, by its ticket.
    AssemblyParameter {
        /// Number of the device.
        device: u8,
        /// The ticket.
        ticket: u32,
    },
    /// A register's access to a parameter, by its ticket.
    RegisterParameter(u32),
    /// A diagnostic word, to find the cause of a fault or a warning.
    Diagnosis,
    /// The diagnostic message of the drive, for people.
    DiagnosticMessage,
    /// A value that changes slowly and that a limit is watched by.
    SlowValue,
    /// A value that the nameplate in the configuration says too.
    Nameplate,
    /// The drive's fault reset.
    FaultReset,
    /// Capturing events, with the generation of the axis's captures.
    Capture(CaptureAccess, u8),
    /// A procedure command, with the generation of the axis's procedures.
    Procedure(ProcedureAccess, u8),
}

/// The result of an access to a drive.
#[derive(Debug)]
pub struct Answer {
    /// Number of the axis in the gateway, from 0.
    pub axis: usize,
    /// What it was for.
    pub purpose: Purpose,
    /// What was accessed.
    pub item: Item,
    /// Whether a value was written.
    pub write: bool,
    /// The data and the progress of a command, or why it failed.
    pub result: Result<(Data, Progress), AccessFailure>,
    /// How the drive itself has said why it failed, as far as it has said anything.
    pub said: Option<DirectFailure>,
}

impl Answer {
    /// The data read, or why they were not.
    ///
    /// # Errors
    /// The access has failed.
    pub fn data(&self) -> Result<&Data, AccessFailure> {
        self.result.as_ref().map(|(data, _)| data).map_err(|failure| *failure)
    }
}

/// The result of [`South::send`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Sent {
    /// Whether a cycle of the bus began with this call.
    pub cycle: bool,
    /// Frames that could not be sent.
    pub failures: u64,
}

/// Counters of a bus since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Cycles that have begun.
    pub cycles: u64,
    /// Cyclic telegrams that were not received in time.
    pub lost: u64,
    /// Frames that were received and refused.
    pub refused: u64,
}

/// The contract of a south side: a bus with its drives. `axis` is always the number of an axis in the gateway, from 0.
/// The counterpart for controllers is [`super::north::North`].
///
/// All methods run in the cycle: they neither allocate nor wait once the drives are in operation.
pub trait South {
    /// Time from one cycle to the next.
    fn cycle_time(&self) -> DurationNs;

    /// Longest time between two calls while the bus has nothing to do. Frames that are received wait for that long.
    fn patience(&self) -> DurationNs;

    /// When the bus must be called next, regardless of frames; `None` if there is no such instant.
    fn wake_at(&self) -> Option<MonotonicTime>;

    /// The instant on the grid at which the next cycle begins; `None` before the bus has a grid.
    fn next_cycle(&self) -> Option<MonotonicTime>;

    /// Skips cycles that would begin late by more than half of the cycle time, with the frames that were built for them. The grid
    /// does not move. Returns whether one was skipped: what the axes have given for it was not sent.
    fn skip_late(&mut self, now: MonotonicTime) -> bool;

    /// Moves the grid: the next cycle begins by so much later, and all that follow it.
    fn shift_grid(&mut self, by: DurationNs);

    /// Builds the frames of the next cycle, as far as the bus can do that before its instant. `system` is system time at that
    /// instant, while it is to be trusted.
    fn prepare(&mut self, system: Option<SystemTime>);

    /// Whether every drive that answers is in cyclic operation.
    fn is_up(&self) -> bool;

    /// SERCOS communication phase, 0 to 4; `None` for a bus without phases.
    fn phase(&self) -> Option<u8>;

    /// Counters since the start.
    fn counts(&self) -> Counts;

    /// What only a bus of its kind has.
    fn detail(&self) -> BusDetail {
        BusDetail::None
    }

    /// What is known of the node of an axis.
    fn node(&self, _axis: usize) -> NodeStatus {
        NodeStatus::Unknown
    }

    /// Receives all waiting frames.
    fn receive(&mut self, now: MonotonicTime, port: &mut SouthPort<'_>);

    /// Whether a cycle was sent since the last call of this method. If so, there is feedback to take: what has come back until now.
    fn take_cycle(&mut self, now: MonotonicTime) -> bool;

    /// Values of the drive in the cycle that has ended; `None` if the drive is not in cyclic operation.
    fn feedback(&self, axis: usize) -> Option<Received<'_>>;

    /// Sets whether no controller is connected. Only then may a bus be brought up again for a drive that is missing.
    fn set_idle(&mut self, idle: bool);

    /// Handles the events of the bus and advances the commissioning. `answer` gets the results of accesses, `notice` what
    /// people should know.
    fn run(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        mapping: &Mapping,
        axes: &mut [AxisChannel],
        answer: &mut dyn FnMut(&mut [AxisChannel], Answer),
        notice: &mut dyn FnMut(Notice),
    );

    /// Calls `fill` with the place for the command values of the next cycle, or with `None` if there is no drive. The values
    /// are sent only if `fill` returns `true`.
    fn command(&mut self, axis: usize, fill: &mut dyn FnMut(Option<&mut [u8]>) -> bool);

    /// Starts an access to the drive of an axis. Returns `false` if there is no drive or too many accesses wait.
    fn access(&mut self, axis: usize, access: &Access, purpose: Purpose) -> bool;

    /// Starts a direct access to the drive of an axis, one of the bus at a time.
    ///
    /// # Errors
    /// Why not, and the buffer.
    fn begin_direct(&mut self, axis: usize, task: DirectTask) -> Result<(), NotBegun>;

    /// Takes the result of the direct access, once there is one.
    fn take_direct(&mut self) -> Option<DirectResult>;

    /// Whether two axes of this bus have one device.
    fn share_device(&self, axis: usize, other: usize) -> bool {
        axis == other
    }

    /// Sends the frames that are due.
    fn send(&mut self, now: MonotonicTime, port: &mut SouthPort<'_>) -> Sent;

    /// Begins to end operation.
    fn stop(&mut self, now: MonotonicTime);

    /// Whether operation has ended and nothing is sent any more.
    fn is_stopped(&self) -> bool;
}

/// The buses of a box, and which of them each axis is on.
#[derive(Debug, Default)]
pub struct Buses {
    list: Vec<AnyBus>,
    /// The bus of each axis.
    of: Vec<usize>,
}

/// A bus of any kind.
#[derive(Debug)]
pub enum AnyBus {
    /// SERCOS III.
    Sercos(Box<sercos::SercosBus>),
    /// CANopen.
    Can(Box<can::CanBus>),
    /// DeviceNet.
    Devicenet(Box<devicenet::DevicenetBus>),
}

/// What people call a bus: a number of its own for each kind that a box can have several of, from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusName {
    /// The SERCOS bus.
    Sercos,
    /// A CANopen bus.
    Can(u8),
    /// A DeviceNet network.
    Devicenet(u8),
}

impl fmt::Display for BusName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sercos => f.write_str("SERCOS"),
            Self::Can(number) => write!(f, "CAN bus {number}"),
            Self::Devicenet(number) => write!(f, "DeviceNet {number}"),
        }
    }
}

impl AnyBus {
    /// The contract of the bus.
    #[must_use]
    pub fn get(&self) -> &dyn South {
        match self {
            Self::Sercos(bus) => &**bus,
            Self::Can(bus) => &**bus,
            Self::Devicenet(bus) => &**bus,
        }
    }

    /// The same.
    pub fn get_mut(&mut self) -> &mut dyn South {
        match self {
            Self::Sercos(bus) => &mut **bus,
            Self::Can(bus) => &mut **bus,
            Self::Devicenet(bus) => &mut **bus,
        }
    }
}

impl Buses {
    /// `of` has, for each axis, the place of its bus in `list`.
    ///
    /// # Panics
    /// If `of` names a place that `list` does not have.
    #[must_use]
    pub fn new(list: Vec<AnyBus>, of: Vec<usize>) -> Self {
        assert!(of.iter().all(|bus| *bus < list.len()), "every axis is on a bus");
        Self { list, of }
    }

    /// The SERCOS bus, where there is one.
    #[must_use]
    pub fn sercos(&self) -> Option<&sercos::SercosBus> {
        self.list.iter().find_map(|bus| match bus {
            AnyBus::Sercos(bus) => Some(&**bus),
            AnyBus::Can(_) | AnyBus::Devicenet(_) => None,
        })
    }

    /// The CANopen buses.
    pub fn can(&self) -> impl Iterator<Item = &can::CanBus> {
        self.list.iter().filter_map(|bus| match bus {
            AnyBus::Can(bus) => Some(&**bus),
            AnyBus::Sercos(_) | AnyBus::Devicenet(_) => None,
        })
    }

    /// The DeviceNet networks.
    pub fn devicenet(&self) -> impl Iterator<Item = &devicenet::DevicenetBus> {
        self.list.iter().filter_map(|bus| match bus {
            AnyBus::Devicenet(bus) => Some(&**bus),
            AnyBus::Sercos(_) | AnyBus::Can(_) => None,
        })
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The bus in a place.
    #[must_use]
    pub fn get(&self, place: usize) -> &dyn South {
        self.list[place].get()
    }

    /// The same.
    pub fn get_mut(&mut self, place: usize) -> &mut dyn South {
        self.list[place].get_mut()
    }

    /// What people call the bus in a place.
    #[must_use]
    pub fn name(&self, place: usize) -> BusName {
        let kind = std::mem::discriminant(&self.list[place]);
        let alike = self.list[..=place].iter().filter(|bus| std::mem::discriminant(*bus) == kind).count();
        let number = u8::try_from(alike).unwrap_or(u8::MAX);
        match self.list[place] {
            AnyBus::Sercos(_) => BusName::Sercos,
            AnyBus::Can(_) => BusName::Can(number),
            AnyBus::Devicenet(_) => BusName::Devicenet(number),
        }
    }

    /// All of them, in order.
    pub fn iter(&self) -> impl Iterator<Item = &dyn South> {
        self.list.iter().map(AnyBus::get)
    }

    /// The same.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut dyn South> {
        self.list.iter_mut().map(AnyBus::get_mut)
    }

    /// The place of the bus of an axis.
    #[must_use]
    pub fn of(&self, axis: usize) -> usize {
        self.of[axis]
    }

    /// What is known of the node of an axis on its bus.
    #[must_use]
    pub fn node(&self, axis: usize) -> NodeStatus {
        self.get(self.of(axis)).node(axis)
    }

    /// Starts an access to the drive of an axis. Returns `false` if there is no drive or too many accesses wait.
    pub fn access(&mut self, axis: usize, access: &Access, purpose: Purpose) -> bool {
        let place = self.of[axis];
        self.get_mut(place).access(axis, access, purpose)
    }

    /// Starts a direct access to the drive of an axis.
    ///
    /// # Errors
    /// Why not, and the buffer.
    pub fn begin_direct(&mut self, axis: usize, task: DirectTask) -> Result<(), NotBegun> {
        let place = self.of.get(axis).copied();
        match place.and_then(|place| self.list.get_mut(place)) {
            Some(bus) => bus.get_mut().begin_direct(axis, task),
            None => Err((DirectFailure::NoAxis, task.data)),
        }
    }

    /// Takes the result of the direct access to the drive of an axis, once there is one.
    pub fn take_direct(&mut self, axis: usize) -> Option<DirectResult> {
        let place = self.of.get(axis).copied()?;
        self.list.get_mut(place)?.get_mut().take_direct()
    }

    /// Whether two axes have one device.
    #[must_use]
    pub fn share_device(&self, axis: usize, other: usize) -> bool {
        match (self.of.get(axis), self.of.get(other)) {
            (Some(place), Some(bus)) if place == bus => self.get(*place).share_device(axis, other),
            _ => false,
        }
    }
}

/// Finds the drive of an axis on its bus without a search.
#[derive(Debug)]
struct Places<T>(Vec<Option<T>>);

impl<T: Copy> Places<T> {
    /// The numbers of the axes in the box, each with its place.
    fn new(axes: impl Iterator<Item = (usize, T)>) -> Self {
        let mut places = Vec::new();
        for (axis, place) in axes {
            if places.len() <= axis {
                places.resize(axis + 1, None);
            }
            places[axis] = Some(place);
        }
        Self(places)
    }

    /// The place of an axis; `None` for one that is on another bus.
    fn of(&self, axis: usize) -> Option<T> {
        self.0.get(axis).copied().flatten()
    }
}

/// Starts the accesses that an axis wants outside the cyclic data: words with the cause of a fault or warning, fault reset,
/// values that are watched or compared, captures and procedures; one of each at a time.
fn ask(now: MonotonicTime, axis: &mut AxisChannel, access: &mut dyn FnMut(&Access, Purpose) -> bool) {
    if axis.wants_drive_reset() {
        let sent = match axis.south().and_then(|program| program.command_of(Action::ResetFault)) {
            Some(item) => access(&Access::new(item, Operation::Command).urgent(), Purpose::FaultReset),
            None => true,
        };
        // Else too many accesses wait, and the next cycle tries again.
        if sent {
            axis.drive_reset_sent();
        }
    }
    if let Some(item) = axis.wants_word(now)
        && access(&Access::read(item).urgent(), Purpose::Diagnosis)
    {
        axis.word_asked(now, item);
    }
    if let Some(item) = axis.wanted_diagnostic(now)
        && access(&Access::read(item), Purpose::DiagnosticMessage)
    {
        axis.diagnostic_requested(now, item);
    }
    if let Some((place, item)) = axis.wanted_slow_value(now)
        && access(&Access::read(item), Purpose::SlowValue)
    {
        axis.slow_value_requested(now, place);
    }
    if let Some(item) = axis.wanted_nameplate_value()
        && access(&Access::read(item), Purpose::Nameplate)
    {
        axis.nameplate_value_requested();
    }
    if let Some((wanted, part, generation)) = axis.capture_access()
        && access(&wanted, Purpose::Capture(part, generation))
    {
        axis.capture_sent(part);
    }
    if let Some((wanted, part, generation)) = axis.procedure_access(now)
        && access(&wanted, Purpose::Procedure(part, generation))
    {
        axis.procedure_sent(part);
    }
}

#[cfg(test)]
mod tests {
    use super::Places;

    #[test]
    fn every_axis_of_a_bus_has_its_place_and_others_have_none() {
        let places = Places::new([(5, 'a'), (0, 'b'), (63, 'c')].into_iter());
        let found: Vec<_> = (0..70).filter_map(|axis| Some((axis, places.of(axis)?))).collect();
        assert_eq!(found, [(0, 'b'), (5, 'a'), (63, 'c')]);
        assert_eq!(Places::<u8>::new(std::iter::empty()).of(0), None);
    }
}
