//! The buses behind the engine: what they have in common.

mod accesses;
mod backoff;
mod bus_return;
pub mod can;
mod can_link;
pub mod commissioner;
pub mod devicenet;
pub mod sercos;
mod transmit_queue;

use profile_generic::state::Action;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

use super::access::{Access, AccessFailure, Data, Operation, Progress};
use super::axis::AxisChannel;
use super::axis::capture::CaptureAccess;
use super::axis::procedure::ProcedureAccess;
use super::notice::Notice;
use super::port::SouthPort;
use crate::mapping::{Item, Mapping};

/// What an access to a drive was for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// A controller's access to an attribute that lives in the drive.
    Attribute {
        /// The motion device's ticket.
        ticket: u32,
        /// Index of the axis's device.
        device: u8,
        /// The attribute.
        attribute: u16,
        /// Whether it writes.
        write: bool,
    },
    /// A diagnostic word, to find the cause of a fault or a warning.
    Diagnosis,
    /// The diagnostic message of the drive, for people.
    DiagnosticMessage,
    /// The drive's fault reset.
    FaultReset,
    /// Capturing events, with the generation of the axis's captures.
    Capture(CaptureAccess, u8),
    /// A procedure command, with the generation of the axis's procedures.
    Procedure(ProcedureAccess, u8),
}

/// An answer to an access.
#[derive(Debug)]
pub struct Answer {
    /// The axis.
    pub axis: usize,
    /// What it was for.
    pub purpose: Purpose,
    /// What was accessed.
    pub item: Item,
    /// What was read and how far a command is, or why there is neither.
    pub result: Result<(Data, Progress), AccessFailure>,
}

/// What a drive sent cyclically.
#[derive(Debug, Clone, Copy)]
pub struct Received<'a> {
    /// Its values as they came last: the status word first, then what the drive's program knows.
    pub data: &'a [u8],
    /// Whether they came in the last cycle.
    pub fresh: bool,
    /// When they came, of a drive that sends by a timer of its own and not in step with the cycle: not every cycle has some.
    pub at: Option<MonotonicTime>,
    /// Whether the drive takes part: it was heard, and has not been lost for longer than its connection bears.
    pub alive: bool,
}

/// What was sent in one call.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Sent {
    /// Whether a cycle of the bus has begun with it.
    pub cycle: bool,
    /// Frames that could not be sent.
    pub failures: u64,
}

/// What a bus has counted since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Cycles.
    pub cycles: u64,
    /// Cyclic telegrams that did not come back in time.
    pub lost: u64,
    /// Frames that were not taken.
    pub refused: u64,
}

/// A cycle of a bus, as its axes have to know it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cycle {
    /// The instant on the grid at which drives take what is sent in it.
    pub acts_at: MonotonicTime,
    /// Time from one cycle to the next.
    pub span: DurationNs,
    /// From the latest moment at which an update still counts for the cycle to the instant at which drives take it.
    pub ahead: DurationNs,
    /// By how much the engine was called late for it.
    pub late: DurationNs,
}

/// A bus, as the engine sees it. Axes go by their numbers in the box.
pub trait Bus {
    /// Time from one cycle to the next.
    fn cycle_time(&self) -> DurationNs;

    /// How long the engine may sleep at most while the bus has nothing to do by itself: what comes in has to wait so long.
    fn patience(&self) -> DurationNs;

    /// When it has to do something by itself.
    fn wake_at(&self) -> Option<MonotonicTime>;

    /// The instant on the grid at which its next cycle begins; `None` while it keeps no grid.
    fn next_cycle(&self) -> Option<MonotonicTime>;

    /// Leaves out cycles that could only begin late, by more than half of their time. The grid stays where it is.
    fn skip_late(&mut self, now: MonotonicTime);

    /// Builds what goes out at the instant of the next cycle, as far as the bus can do that ahead.
    fn prepare(&mut self);

    /// Whether every drive that answers at all is in cyclic operation.
    fn is_up(&self) -> bool;

    /// SERCOS communication phase, of a bus that has phases.
    fn phase(&self) -> Option<u8>;

    /// What it has counted.
    fn counts(&self) -> Counts;

    /// Takes what has come in.
    fn receive(&mut self, now: MonotonicTime, port: &mut SouthPort<'_>);

    /// Whether a cycle was sent since the last call: then there is feedback to be taken.
    fn take_cycle(&mut self) -> bool;

    /// What the drive of an axis sent in the cycle that has just ended; `None` without a drive in cyclic operation.
    fn feedback(&self, axis: usize) -> Option<Received<'_>>;

    /// Tells whether no controller is connected: only then a bus that works may be taken down for a drive that does not.
    fn set_idle(&mut self, idle: bool);

    /// Handles what has happened on the bus and drives the commissioning on. `answer` gets what accesses came to, `notice`
    /// what people should know.
    fn run(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        mapping: &Mapping,
        axes: &mut [AxisChannel],
        answer: &mut dyn FnMut(&mut [AxisChannel], Answer),
        notice: &mut dyn FnMut(Notice),
    );

    /// Lets an axis fill its values for the next cycle; what it gives back says whether they may be sent.
    fn command(&mut self, axis: usize, fill: &mut dyn FnMut(Option<&mut [u8]>) -> bool);

    /// Asks something of the drive of an axis; `false` when it is not there or too much waits.
    fn access(&mut self, axis: usize, access: &Access, purpose: Purpose) -> bool;

    /// Sends what is due.
    fn send(&mut self, now: MonotonicTime, port: &mut SouthPort<'_>) -> Sent;

    /// Ends operation.
    fn stop(&mut self, now: MonotonicTime);

    /// Whether it has ended.
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

impl AnyBus {
    /// What all of them can do.
    #[must_use]
    pub fn get(&self) -> &dyn Bus {
        match self {
            Self::Sercos(bus) => &**bus,
            Self::Can(bus) => &**bus,
            Self::Devicenet(bus) => &**bus,
        }
    }

    /// The same.
    pub fn get_mut(&mut self) -> &mut dyn Bus {
        match self {
            Self::Sercos(bus) => &mut **bus,
            Self::Can(bus) => &mut **bus,
            Self::Devicenet(bus) => &mut **bus,
        }
    }
}

impl Buses {
    /// These buses; `of` has for each axis the place of its bus.
    ///
    /// # Panics
    /// When an axis is on a bus that is not there.
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
    pub fn get(&self, place: usize) -> &dyn Bus {
        self.list[place].get()
    }

    /// The same.
    pub fn get_mut(&mut self, place: usize) -> &mut dyn Bus {
        self.list[place].get_mut()
    }

    /// All of them, in order.
    pub fn iter(&self) -> impl Iterator<Item = &dyn Bus> {
        self.list.iter().map(AnyBus::get)
    }

    /// The same.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut dyn Bus> {
        self.list.iter_mut().map(AnyBus::get_mut)
    }

    /// The place of the bus of an axis.
    #[must_use]
    pub fn of(&self, axis: usize) -> usize {
        self.of[axis]
    }

    /// Asks something of the drive of an axis; `false` when it is not there or too much waits.
    pub fn access(&mut self, axis: usize, access: &Access, purpose: Purpose) -> bool {
        let place = self.of[axis];
        self.get_mut(place).access(axis, access, purpose)
    }
}

/// Where the drive of each axis is among those of a bus, found without a search.
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

/// What an axis wants of its drive beside the cycle: the words that tell the cause of a fault or warning, its fault reset,
/// captures and procedures, one access of each at a time.
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
