//! What the cycle thread has to tell people. The supervisor logs it; the cycle itself never does.

use std::fmt;
use std::net::SocketAddrV4;

use profile_cia402::master::boot::BootStatus;
use profile_cia402::master::event::Event as CanEvent;
use profile_cia402::wire::NodeId;
use profile_cip::assembly::Refusal;
use profile_cip::device::axis_object::refused::RefusedRequest;
use profile_cip::device::axis_state::AxisState;
use profile_cip::device::fault_log::{LogEntry, LogKind};
use profile_cip::devicenet::master::event::Event as DevicenetEvent;
use profile_cip::devicenet::wire::MacId;
use profile_cip::wire::motion::codes::{ClearingEvent, NodeAlarm, NodeFault};
use profile_generic::fault::{Fault, FaultCause};
use profile_generic::mode::ModeSelection;
use profile_generic::parameter::Parameter;
use profile_generic::state::DriveState;
use profile_generic::time::DurationNs;
use profile_sercos::master::event::{Event, SlaveId};
use profile_sercos::master::svc::request::SvcOperation;
use profile_sercos::master::topology::Topology;
use profile_sercos::wire::header::Phase;
use profile_sercos::wire::idn::Idn;

use super::access::AccessFailure;
use super::admission::Refused;
use super::axis::{DiagnosticMessage, Loss, PositionJump, Trip};
use super::bus::BusName;
use super::bus::can::failure::{Misfit, StepFailure as ObjectFailure};
use super::bus::can::lss::LssNotice;
use super::bus::can::trial::Tried;
use super::bus::devicenet::end::MessageError;
use super::bus::devicenet::setup::SetupFailure;
use super::bus::sercos::commissioning::StepFailure;
use super::bus::startup::{StartupFailure, StartupReport};
use super::device::scaling::ScalingRefusal;
use super::direct::DirectFailure;
use super::phase_lock::{LockState, Phase as LockPhase};
use crate::mapping::{
    Cia402Error, Difference, DriveIdentity, InterpolationPeriod, Item, Number, Object, SercosError,
};
use crate::status::AxisWait;

/// How much a notice matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Of use to those who look for something only: a state that comes with every lost telegram.
    Detail,
    /// The normal course.
    Info,
    /// Something to look at.
    Warning,
}

/// One thing that happened. Axes are numbered as in the configuration, from 0.
#[derive(Debug, Clone, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "queue slots have one size, and boxing would allocate")]
pub enum Notice {
    /// The SERCOS master.
    Sercos(Event),
    /// A request of the controller was refused.
    Refused {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// Which, and why.
        refused: RefusedRequest,
    },
    /// An order in the output assembly was refused. Not every layout of the input assembly has a place for the reason.
    OrderRefused {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// Why.
        refusal: Refusal,
    },
    /// A drive on DeviceNet answers, and its answers do not count.
    SlaveAnswers {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// Its MAC ID.
        mac: MacId,
        /// Why.
        error: MessageError,
    },
    /// A phase of the SERCOS bus takes long.
    Progress {
        /// The communication phase that takes long.
        phase: Phase,
        /// For how long it goes on, whole seconds.
        seconds: u16,
        /// What the master waits for: slave, parameter, and what is done with it.
        with: Option<(SlaveId, Idn, SvcOperation)>,
    },
    /// The phase-up failed; it is tried again after a pause.
    Retry,
    /// The drive of an axis was not found on the bus.
    DriveMissing {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// The SERCOS address looked for.
        address: u16,
    },
    /// A step of the commissioning failed; the drive is left out.
    Commissioning {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// The SERCOS address of its drive.
        address: u16,
        /// What failed.
        failure: StepFailure,
    },
    /// A drive that was refused before came through without the commands that were withheld from it; it is left out, and
    /// commissioned with them at the next attempt.
    CommandsWithheld {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// The SERCOS address of its drive.
        address: u16,
    },
    /// Something has happened to an entry of the start-up list of a drive.
    Startup {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// What.
        report: StartupReport,
    },
    /// The start-up list of a drive did not come through; the drive is left out.
    StartupFailed {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// Why, and how far it came.
        failure: StartupFailure,
    },
    /// Steps failed that may fail.
    PassedOver {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// What failed, in the order of the plan.
        failures: Vec<StepFailure>,
    },
    /// The drive does not fit the mapping tables; it is left out.
    Program {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// The SERCOS address of its drive.
        address: u16,
        /// Why.
        error: SercosError,
    },
    /// The drive says of a parameter what the dictionary does not say; the value of the drive is used.
    Difference {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// What differs.
        difference: Difference,
    },
    /// The drive of an unlimited (modulo) axis does not work modulo: its positions end where its 32 bits do.
    Ends {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
    },
    /// The master of a CAN bus.
    Can {
        /// The bus, from 0 among those of CAN.
        bus: u8,
        /// What it tells.
        event: CanEvent,
    },
    /// A device on a CAN bus was to be given its node-id.
    Lss {
        /// The bus, from 0 among those of CAN.
        bus: u8,
        /// What came of it.
        told: LssNotice,
    },
    /// The master of a DeviceNet network.
    Devicenet {
        /// The network, from 0 among those of DeviceNet.
        network: u8,
        /// What it tells.
        event: DevicenetEvent,
    },
    /// A drive on DeviceNet could not be set up; it is left out for a while.
    SlaveSetup {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// Its MAC ID.
        mac: MacId,
        /// Why.
        failure: SetupFailure,
    },
    /// A step of the commissioning of a CANopen drive failed; its device is left out.
    NodeCommissioning {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// Its device.
        node: NodeId,
        /// What failed.
        failure: ObjectFailure,
    },
    /// The drive of a CANopen device does not fit; the device is left out.
    NodeProgram {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// Its device.
        node: NodeId,
        /// Why.
        error: Misfit,
    },
    /// The drive of a CANopen device does not report its modes of operation, and they were tried.
    ModesTried {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// Its device.
        node: NodeId,
        /// What came out.
        tried: Tried,
    },
    /// A SERCOS drive takes a telegram only without the values that the axis can do without, if at all.
    Bare {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// SERCOS address of the drive.
        address: u16,
    },
    /// A SERCOS drive lacks operating modes that nobody asked for.
    ModesLeftOut {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// SERCOS address of the drive.
        address: u16,
        /// Which, and why.
        modes: Vec<(ModeSelection, SercosError)>,
    },
    /// The drive of a CANopen device lacks operating modes that nobody asked for.
    NodeModesLeftOut {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// Its device.
        node: NodeId,
        /// Which, and why.
        modes: Vec<(ModeSelection, Cia402Error)>,
    },
    /// A CANopen device is of a family of drives that has settings of its own.
    Family {
        /// The axis, the first one of the device.
        axis: u8,
        /// Its device.
        node: NodeId,
        /// What it says of itself.
        identity: DriveIdentity,
        /// The family.
        name: String,
    },
    /// The drive of a CANopen device expects set-points in another time than the cycle.
    Period {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// Its device.
        node: NodeId,
        /// The cycle.
        expected: DurationNs,
        /// What it expects.
        found: InterpolationPeriod,
    },
    /// Values are in none of the PDOs that a CANopen device keeps, and the axis can do without.
    NotMapped {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// Its device.
        node: NodeId,
        /// Index and sub-index of what no PDO carries.
        objects: Vec<Object>,
    },
    /// Steps failed that may fail, at a CANopen drive.
    ObjectsPassedOver {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// What failed, in the order of the plan.
        failures: Vec<ObjectFailure>,
    },
    /// An axis changed its generic state.
    State {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// Before.
        from: DriveState,
        /// Now.
        to: DriveState,
    },
    /// Local control has taken or released an axis.
    LocalControl {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// Taken, otherwise released.
        taken: bool,
    },
    /// An axis changed its CIP axis state.
    AxisState {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// Before.
        from: AxisState,
        /// Now.
        to: AxisState,
    },
    /// An axis has a fault.
    Fault {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// Cause, reaction, and the system time at which it was raised.
        fault: Fault,
        /// Why the command was lost, when that is the fault.
        loss: Option<Loss>,
        /// The limit that a set-point has exceeded, when that is the fault.
        trip: Option<Trip>,
        /// The jump of the actual position, when that is the fault.
        jump: Option<PositionJump>,
    },
    /// An axis has waited for longer than a second.
    Waiting {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// For how long, what for, and what its drive shows.
        wait: AxisWait,
    },
    /// The source of system time has stepped.
    TimeStep {
        /// By how much.
        step: DurationNs,
    },
    /// The cycles of a bus follow system time in another way.
    PhaseLock {
        /// The bus.
        bus: BusName,
        /// How, and how far from it they are.
        phase: LockPhase,
    },
    /// The diagnostic message of a drive that has a fault or warning.
    DriveSays {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// Number and text.
        said: DiagnosticMessage,
    },
    /// A fault or alarm came into the log of an axis, or ended there.
    Logged {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// The entry of the fault log, with the name of its code.
        entry: LogEntry,
        /// Its generic cause; a start inhibit has none.
        cause: Option<FaultCause>,
    },
    /// The communications node of a device has another fault or alarm.
    Node {
        /// The device, from 0.
        device: u8,
        /// The fault that stands.
        fault: NodeFault,
        /// The alarm that stands.
        alarm: NodeAlarm,
    },
    /// Datagrams reached the UDP port of a device that are not of its motion connection. At most once a minute.
    Strangers {
        /// The device, from 0.
        device: u8,
        /// How many since the last time.
        count: u64,
        /// Sender of the last one.
        from: SocketAddrV4,
        /// Why that was refused.
        why: Refused,
    },
    /// The controller would set something that drive or configuration have otherwise, and that nobody can set.
    NotEqual {
        /// Number of the axis.
        axis: u8,
        /// The attribute.
        attribute: u16,
        /// What the controller wants.
        wanted: Option<Number>,
        /// What drive or configuration have.
        held: Option<Number>,
        /// It is what the configuration has.
        configured: bool,
    },
    /// The drive has taken what the controller has set, and has something else afterwards.
    NotKept {
        /// Number of the axis.
        axis: u8,
        /// The attribute.
        attribute: u16,
        /// What the controller has set.
        wanted: Option<Number>,
        /// What the drive has.
        held: Option<Number>,
    },
    /// The drive has refused what the controller would set, and says why.
    DriveRefuses {
        /// Number of the axis.
        axis: u8,
        /// The attribute.
        attribute: u16,
        /// What the controller wants.
        wanted: Option<Number>,
        /// What was to be written in the drive.
        item: Item,
        /// The drive has taken it, and refuses to show what it has now.
        is_taken: bool,
        /// What the drive says.
        said: DirectFailure,
    },
    /// The data of the axis in the configuration say something else than the drive, which counts.
    OtherNameplate {
        /// Number of the axis.
        axis: u8,
        /// The value.
        parameter: Parameter,
        /// What the configuration has, in the unit of the parameter.
        configured: i64,
        /// What the drive has.
        held: i64,
    },
    /// The drive did not take back what it had before the last controller: it keeps what that has set.
    NotReturned {
        /// Number of the axis.
        axis: u8,
        /// What it keeps.
        item: Item,
        /// Why.
        failure: AccessFailure,
    },
    /// The scaling attributes of the controller make no sense; the axis stays out of operation.
    Scaling {
        /// Number of the axis: its place in the configuration, from 0.
        axis: u8,
        /// Why.
        error: ScalingRefusal,
    },
}

/// The number of an axis as notices have it.
pub(super) fn axis_number(axis: usize) -> u8 {
    // There are 64 at most.
    u8::try_from(axis).unwrap_or(u8::MAX)
}

impl Notice {
    /// How much it matters.
    #[must_use]
    pub fn severity(&self) -> Severity {
        match self {
            Self::Startup { report, .. } if !report.is_warning() => Severity::Info,
            Self::Sercos(Event::Connection { .. }) => Severity::Detail,
            Self::Progress { .. }
            | Self::PhaseLock { .. }
            | Self::State { .. }
            | Self::AxisState { .. }
            | Self::LocalControl { .. }
            | Self::Waiting { .. }
            | Self::PassedOver { .. }
            | Self::ObjectsPassedOver { .. }
            | Self::ModesLeftOut { .. }
            | Self::Bare { .. }
            | Self::NodeModesLeftOut { .. }
            | Self::Family { .. }
            | Self::Logged { entry: LogEntry { ended: Some(_), .. }, .. }
            | Self::Node { fault: NodeFault::NONE, alarm: NodeAlarm::NONE, .. }
            | Self::Sercos(
                Event::Phase(_)
                | Event::Stopped
                | Event::Scanned { .. }
                | Event::Topology(Topology::LineOne | Topology::LineTwo | Topology::Ring)
                | Event::RingClosed
                | Event::PlaceKept { .. }
                | Event::HotPlugAwaits { .. }
                | Event::HotPlugged { .. }
                | Event::Measured { .. }
                | Event::AwaitingApplication { .. }
                | Event::Svc { .. },
            )
            | Self::Can {
                event:
                    CanEvent::AwaitingApplication { .. }
                    | CanEvent::Operational { .. }
                    | CanEvent::NetworkOperational
                    | CanEvent::BusOn
                    | CanEvent::PdoBack { .. }
                    | CanEvent::Sdo { .. },
                ..
            }
            | Self::Lss { told: LssNotice::Given { .. }, .. }
            | Self::Devicenet {
                event:
                    DevicenetEvent::Online | DevicenetEvent::Exchanging(_) | DevicenetEvent::Released { .. },
                ..
            } => Severity::Info,
            _ => Severity::Warning,
        }
    }

    /// The axis it is about.
    #[must_use]
    pub fn axis(&self) -> Option<u8> {
        match self {
            Self::Sercos(_)
            | Self::Can { .. }
            | Self::Lss { .. }
            | Self::Devicenet { .. }
            | Self::Retry
            | Self::Progress { .. }
            | Self::TimeStep { .. }
            | Self::PhaseLock { .. }
            | Self::Strangers { .. }
            | Self::Node { .. } => None,
            Self::DriveMissing { axis, .. }
            | Self::Commissioning { axis, .. }
            | Self::CommandsWithheld { axis, .. }
            | Self::Startup { axis, .. }
            | Self::StartupFailed { axis, .. }
            | Self::PassedOver { axis, .. }
            | Self::SlaveSetup { axis, .. }
            | Self::NodeCommissioning { axis, .. }
            | Self::NodeProgram { axis, .. }
            | Self::ModesTried { axis, .. }
            | Self::Refused { axis, .. }
            | Self::OrderRefused { axis, .. }
            | Self::NotMapped { axis, .. }
            | Self::Period { axis, .. }
            | Self::ModesLeftOut { axis, .. }
            | Self::Bare { axis, .. }
            | Self::NodeModesLeftOut { axis, .. }
            | Self::Family { axis, .. }
            | Self::SlaveAnswers { axis, .. }
            | Self::ObjectsPassedOver { axis, .. }
            | Self::Program { axis, .. }
            | Self::Difference { axis, .. }
            | Self::Ends { axis }
            | Self::State { axis, .. }
            | Self::AxisState { axis, .. }
            | Self::LocalControl { axis, .. }
            | Self::Waiting { axis, .. }
            | Self::Fault { axis, .. }
            | Self::DriveSays { axis, .. }
            | Self::Logged { axis, .. }
            | Self::NotEqual { axis, .. }
            | Self::NotKept { axis, .. }
            | Self::DriveRefuses { axis, .. }
            | Self::OtherNameplate { axis, .. }
            | Self::NotReturned { axis, .. }
            | Self::Scaling { axis, .. } => Some(*axis),
        }
    }
}

impl Notice {
    /// What kind of thing has happened, for those who look for something.
    #[must_use]
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::Sercos(_)
            | Self::Can { .. }
            | Self::Lss { .. }
            | Self::Devicenet { .. }
            | Self::Retry
            | Self::Progress { .. }
            | Self::PhaseLock { .. } => "bus",
            Self::TimeStep { .. } => "time",
            Self::DriveMissing { .. }
            | Self::Commissioning { .. }
            | Self::CommandsWithheld { .. }
            | Self::Startup { .. }
            | Self::StartupFailed { .. }
            | Self::PassedOver { .. }
            | Self::SlaveSetup { .. }
            | Self::SlaveAnswers { .. }
            | Self::NodeCommissioning { .. }
            | Self::NodeProgram { .. }
            | Self::ModesTried { .. }
            | Self::NotMapped { .. }
            | Self::Period { .. }
            | Self::ModesLeftOut { .. }
            | Self::Bare { .. }
            | Self::NodeModesLeftOut { .. }
            | Self::Family { .. }
            | Self::ObjectsPassedOver { .. }
            | Self::Program { .. }
            | Self::Difference { .. }
            | Self::OtherNameplate { .. }
            | Self::Ends { .. } => "commissioning",
            Self::State { .. } | Self::AxisState { .. } | Self::LocalControl { .. } => "state",
            Self::Waiting { .. } => "wait",
            Self::Fault { .. } | Self::DriveSays { .. } | Self::Logged { .. } | Self::Node { .. } => "fault",
            Self::Refused { .. }
            | Self::OrderRefused { .. }
            | Self::Strangers { .. }
            | Self::NotEqual { .. }
            | Self::NotKept { .. }
            | Self::DriveRefuses { .. }
            | Self::NotReturned { .. }
            | Self::Scaling { .. } => "refusal",
        }
    }

    /// The bus that it is about, where it is about no axis.
    #[must_use]
    pub const fn bus(&self) -> Option<BusName> {
        match self {
            Self::Sercos(_) | Self::Retry | Self::Progress { .. } => Some(BusName::Sercos),
            Self::Can { bus, .. } | Self::Lss { bus, .. } => Some(BusName::Can(bus.saturating_add(1))),
            Self::Devicenet { network, .. } => Some(BusName::Devicenet(network.saturating_add(1))),
            Self::PhaseLock { bus, .. } => Some(*bus),
            _ => None,
        }
    }

    /// The device that it is about, where it is about no axis.
    #[must_use]
    pub const fn device(&self) -> Option<u8> {
        match self {
            Self::Node { device, .. } | Self::Strangers { device, .. } => Some(*device),
            _ => None,
        }
    }
}

impl fmt::Display for Notice {
    // A flat match: one arm for each variant.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sercos(event) => write!(f, "{event}"),
            Self::Waiting { wait, .. } => write!(f, "{wait}"),
            Self::Retry => f.write_str("phase-up failed; trying again"),
            Self::DriveMissing { address, .. } => {
                write!(f, "expected a drive with SERCOS address {address} on the bus, found none")
            }
            Self::Commissioning { address, failure, .. } => {
                write!(
                    f,
                    "commissioning of the drive with SERCOS address {address} failed: {failure}; it is left out"
                )
            }
            Self::CommandsWithheld { address, .. } => write!(
                f,
                "the drive with SERCOS address {address} was commissioned without its commands, because it had been refused before; it is left \
                 out, and commissioned with them at the next attempt"
            ),
            Self::Startup { report, .. } => write!(f, "{report}"),
            Self::StartupFailed { failure, .. } => {
                write!(f, "the start-up list of the drive failed: {failure}; the drive is left out")
            }
            Self::Can { bus, event } => {
                write!(f, "CAN bus {}: {event}", bus + 1)?;
                match event {
                    CanEvent::BootFailed { status: Some(BootStatus::DEVICE_TYPE), .. } => f.write_str(
                        "; nothing was written to it; for a drive nevertheless, `device_type = \"any\"` in its [[south.can.device]]",
                    ),
                    _ => Ok(()),
                }
            }
            Self::Lss { bus, told } => write!(f, "CAN bus {}: {told}", bus + 1),
            Self::Devicenet { network, event } => write!(f, "DeviceNet {}: {event}", network + 1),
            Self::SlaveSetup { mac, failure, .. } => {
                write!(f, "the drive with MAC ID {mac} cannot be used: {failure}; it is left out")
            }
            Self::NodeCommissioning { node, failure, .. } => {
                write!(f, "commissioning of node {node} failed: {failure}; it is left out")
            }
            Self::NodeProgram { node, error, .. } => {
                write!(f, "node {node} cannot be used: {error}; it is left out")
            }
            Self::Progress { phase, seconds, with: Some((slave, idn, operation)) } => {
                write!(f, "{phase} has taken {seconds} s: waiting for {slave}, {operation} {idn}")
            }
            Self::Progress { phase, seconds, with: None } => write!(f, "{phase} has taken {seconds} s"),
            Self::SlaveAnswers { mac, error, .. } => {
                write!(f, "the answers of the drive with MAC ID {mac} are ignored: {error}")
            }
            Self::Bare { address, .. } => write!(
                f,
                "the drive with SERCOS address {address} refuses the values of its telegram and does not say by S-0-0187 and S-0-0188 which: \
                 tried next without those that the axis can do without"
            ),
            Self::ModesLeftOut { address, modes, .. } => {
                write!(f, "the drive with SERCOS address {address}: the axis works without {}", left_out(modes))
            }
            Self::NodeModesLeftOut { node, modes, .. } => {
                write!(f, "node {node}: the axis works without {}", left_out(modes))
            }
            Self::Family { node, identity, name, .. } => {
                let number = |number: Option<u32>| number.map_or_else(|| "none".to_owned(), |number| format!("{number:#x}"));
                let (vendor, product) = (number(identity.vendor), number(identity.product));
                write!(f, "node {node} has vendor-ID {vendor} and product code {product}: the settings for {name} are used")
            }
            Self::Period { node, expected, found, .. } => write!(
                f,
                "node {node} expects set-points every {found} (60C2), and they come every {expected}: it may move in steps; set its \
                 interpolation time, or cycle_time"
            ),
            Self::NotMapped { node, objects, .. } => {
                let all: Vec<_> = objects.iter().map(ToString::to_string).collect();
                write!(f, "node {node} keeps its PDOs, and {} is in none that can be used: the axis works without", all.join(", "))
            }
            Self::Refused { refused, .. } => write!(f, "{refused}"),
            Self::OrderRefused { refusal, .. } => {
                write!(f, "what the controller orders in the output assembly is refused: {refusal}")
            }
            Self::ModesTried { node, tried, .. } => write!(f, "node {node}: {tried}"),
            Self::PassedOver { failures, .. } => {
                let all = failures.iter().map(|failure| (failure.what, failure.idn, failure.failure));
                passed_over(f, &all.collect::<Vec<_>>())
            }
            Self::ObjectsPassedOver { failures, .. } => {
                let all = failures.iter().map(|failure| (failure.what, failure.object, failure.failure));
                passed_over(f, &all.collect::<Vec<_>>())
            }
            Self::Program { address, error, .. } => {
                write!(f, "the drive with SERCOS address {address} cannot be used: {error}; it is left out")
            }
            Self::Difference { difference, .. } => write!(f, "{difference}; the value of the drive is used"),
            Self::Ends { .. } => f.write_str(
                "unwind_counts needs a drive that counts modulo, but the positions of this drive have ends: expected modulo \
                 (S-0-0076 bit 7, S-0-0103), or set_scaling = true",
            ),
            Self::State { from, to, .. } => write!(f, "drive {from} -> {to}"),
            Self::AxisState { from, to, .. } => write!(f, "axis {from} -> {to}"),
            Self::LocalControl { taken: true, .. } => f.write_str("under local control"),
            Self::LocalControl { taken: false, .. } => f.write_str("released by local control"),
            Self::Fault { fault, loss: Some(loss), .. } => write!(f, "{fault}: {loss}"),
            Self::Fault { fault, trip: Some(trip), .. } => write!(f, "{fault}: {trip}"),
            Self::Fault { fault, jump: Some(jump), .. } => write!(f, "{fault}: {jump}"),
            Self::Fault { fault, .. } => write!(f, "{fault}"),
            Self::TimeStep { step } => {
                write!(f, "system time stepped by {step}; it is reported to controllers, and no axis follows it")
            }
            Self::PhaseLock { bus, phase } => match phase.state {
                LockState::Free => write!(f, "{bus}: the cycles go on by the clock of the gateway, not by system time"),
                LockState::Pulling => {
                    write!(f, "{bus}: the cycles are {} off system time and are pulled to it", phase.error)
                }
                LockState::Locked => write!(f, "{bus}: the cycles are locked to system time"),
            },
            Self::DriveSays { said, .. } => diagnostic_message(f, said),
            Self::Logged { entry, cause, .. } => logged(f, entry, *cause),
            Self::Node { device, fault, alarm } => {
                write!(f, "device {device}: {fault} ({}), {alarm} ({})", fault.0, alarm.0)
            }
            Self::Strangers { device, count, from, why } => {
                let s = if *count == 1 { "" } else { "s" };
                write!(f, "device {device}: refused {count} datagram{s}, the last one from {from}: {why}")
            }
            Self::NotEqual { attribute, wanted: Some(wanted), held: Some(held), configured: true, .. } => {
                write!(f, "attribute {attribute} cannot be set to {wanted}: the configuration has {held}")
            }
            Self::NotEqual { attribute, wanted: Some(wanted), held: Some(held), .. } => {
                write!(f, "attribute {attribute} cannot be set to {wanted}: the drive has {held}, and only it can change that")
            }
            Self::NotEqual { attribute, .. } => {
                write!(f, "attribute {attribute} is not what the drive has, and only the drive can change that")
            }
            Self::NotKept { attribute, wanted: Some(wanted), held: Some(held), .. } => {
                write!(f, "attribute {attribute} was set to {wanted}, and the drive has {held} afterwards")
            }
            Self::NotKept { attribute, .. } => {
                write!(f, "attribute {attribute} was set, and the drive has something else afterwards")
            }
            Self::DriveRefuses { attribute, item, is_taken: true, said, .. } => {
                write!(f, "attribute {attribute} was set, and cannot be read back: {item}: {said}")
            }
            Self::DriveRefuses { attribute, wanted: Some(wanted), item, said, .. } => {
                write!(f, "attribute {attribute} is not set to {wanted}: {item}: {said}")
            }
            Self::DriveRefuses { attribute, item, said, .. } => {
                write!(f, "attribute {attribute} is not set: {item}: {said}")
            }
            Self::OtherNameplate { parameter, configured, held, .. } => {
                let unit = parameter.row().map_or("", |row| row.quantity.unit());
                write!(f, "{parameter}: the configuration has {configured} {unit}, the drive {held} {unit}, which counts")
            }
            Self::NotReturned { item, failure, .. } => {
                let why = match failure {
                    AccessFailure::Refused(_) => "the drive refuses it",
                    AccessFailure::Unanswered => "the drive does not answer",
                };
                write!(f, "{item} keeps what the last controller has set, instead of what the drive had before: {why}")
            }
            Self::Scaling { error, .. } => write!(f, "the controller's scaling cannot be used: {error}"),
        }
    }
}

/// Modes that an axis does without, each with the reason.
fn left_out(modes: &[(ModeSelection, impl fmt::Display)]) -> String {
    let all: Vec<_> = modes.iter().map(|(mode, why)| format!("{mode} ({why})")).collect();
    all.join(" and ")
}

/// `commissioning continues without reading S-0-0294, S-0-0208: IDN: IDN not available; writing S-0-0079: ...`: what failed
/// alike stands together.
fn passed_over<I, F>(f: &mut fmt::Formatter<'_>, failures: &[(&str, I, F)]) -> fmt::Result
where
    I: fmt::Display,
    F: fmt::Display + PartialEq,
{
    f.write_str("commissioning continues without ")?;
    let alike = |one: &(&str, I, F), other: &(&str, I, F)| (one.0, &one.2) == (other.0, &other.2);
    let mut between = "";
    for (at, first) in failures.iter().enumerate() {
        if failures[..at].iter().any(|earlier| alike(earlier, first)) {
            continue;
        }
        write!(f, "{between}{}", first.0)?;
        let mut comma = "";
        for (_, item, _) in failures[at..].iter().filter(|failure| alike(failure, first)) {
            write!(f, "{comma} {item}")?;
            comma = ",";
        }
        write!(f, ": {}", first.2)?;
        between = "; ";
    }
    Ok(())
}

/// `the drive reports 0xC00F0007 "overcurrent"`.
fn diagnostic_message(f: &mut fmt::Formatter<'_>, said: &DiagnosticMessage) -> fmt::Result {
    f.write_str("the drive reports")?;
    if let Some(number) = said.number {
        write!(f, " {number:#010X}")?;
    }
    if said.text.is_empty() { Ok(()) } else { write!(f, " \"{}\"", said.text) }
}

/// `Axis Fault 54 (excessive_position_error): Major Fault ...`.
fn logged(f: &mut fmt::Formatter<'_>, entry: &LogEntry, cause: Option<FaultCause>) -> fmt::Result {
    match entry.kind {
        LogKind::Fault(kind) => write!(f, "{kind} {}", entry.code)?,
        LogKind::Alarm(kind) => write!(f, "{kind} {}", entry.code)?,
    }
    if let Some(cause) = cause {
        write!(f, " ({cause})")?;
    }
    match entry.ended {
        None if entry.action != 0 => write!(f, " in {}, fault action {:#04x}", entry.state, entry.action)?,
        None => write!(f, " in {}", entry.state)?,
        Some((ClearingEvent::NONE, _)) => f.write_str(" is over")?,
        Some((by, _)) => write!(f, " ended by {by}")?,
    }
    if entry.detail != 0 {
        write!(f, ", vendor code {:#010x}", entry.detail)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_sercos::master::svc::request::SvcFailure;
    use profile_sercos::wire::idn::Idn;
    use profile_sercos::wire::svc::Element;
    use profile_sercos::wire::svc_error::SvcError;

    #[test]
    fn notice_names_its_kind_and_what_it_is_about() {
        let event = DevicenetEvent::Online;
        let notice = Notice::Devicenet { network: 1, event };
        assert_eq!((notice.kind(), notice.bus(), notice.axis()), ("bus", Some(BusName::Devicenet(2)), None));
        let notice = Notice::Node { device: 3, fault: NodeFault::NONE, alarm: NodeAlarm::NONE };
        assert_eq!((notice.kind(), notice.bus(), notice.device()), ("fault", None, Some(3)));
        let notice = Notice::Ends { axis: 2 };
        assert_eq!((notice.kind(), notice.bus(), notice.device()), ("commissioning", None, None));
    }

    #[test]
    fn what_a_drive_lacks_stands_in_one_line() {
        let failure = |what, block, code| StepFailure {
            what,
            idn: Idn::standard(block),
            failure: SvcFailure::Refused { element: Element::Idn, code: SvcError(code) },
        };
        let failures = vec![
            failure("reading", 294, 0x1001),
            failure("writing", 79, 0x7004),
            failure("reading", 208, 0x1001),
            failure("writing", 208, 0x1001),
        ];
        assert_eq!(
            Notice::PassedOver { axis: 0, failures }.to_string(),
            "commissioning continues without reading S-0-0294, S-0-0208: IDN: IDN not available; \
             writing S-0-0079: IDN: operation data cannot be changed; writing S-0-0208: IDN: IDN not available"
        );
    }
}
