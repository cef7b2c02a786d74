//! The parameters of the phase-up: which, in which order, for which slaves, with which values.
//!
//! The order is the one of the reference master. Where its order has the application's own parameters before
//! everything else, this master reads first what the slaves are, then lets the application work, then writes.

use super::config::{ConnectionConfig, MasterConfig};
use super::layout::{CyclicLayout, SlavePlaces};
use super::station::Station;
use super::svc::request::{Shape, SvcData, SvcOperation, SvcRequest};
use crate::generated::idns::connection;
use crate::wire::connection::{ConfigurationType, ConnectionSetup};
use crate::wire::header::Kind;
use crate::wire::idn::Idn;
use crate::wire::scp::ScpClass;
use crate::wire::svc::Element;

/// S-0-1032: the extended field of MDT0 is used.
const EXTENDED_USED: u32 = 1 << 2;
/// S-0-1032: the MST deviates by more than 1 us.
const SOFT_MASTER: u32 = 1 << 4;
/// MST deviation in nanoseconds above which a master declares itself a soft master.
const SOFT_MASTER_NS: u32 = 1_000;

/// One kind of request of the phase-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    Address,
    FspType,
    ScpClasses,
    ActivateClasses,
    GapPresence,
    ConnectionImage,
    Setup,
    FixedSetup,
    ConfigurationList,
    FixedList,
    Length,
    FeedbackTime,
    AtStartMinimum,
    SlaveJitter,
    ConsumerTime,
    CycleTime,
    ControlOffset,
    MdtLengths,
    StatusOffset,
    AtLengths,
    SvcMdtOffset,
    SvcAtOffset,
    MstLosses,
    Assignment,
    Number,
    AtStart,
    SyncTime,
    CommandValid,
    CommunicationControl,
    RingDelay,
    SyncJitter,
    ProducerCycle,
    AllowedLosses,
    Gap,
    CounterMax,
    UcTimes,
    MtuRequested,
    MtuEffective,
    MeasureExecute,
    MeasureCancel,
    CheckExecute,
    CheckInvalid,
    CheckCancel,
}

/// What the slaves are.
pub(super) const READ: &[Step] = &[
    Step::Address,
    Step::FspType,
    Step::ScpClasses,
    Step::ActivateClasses,
    Step::GapPresence,
    Step::ConnectionImage,
];

/// Connections and what they need.
pub(super) const CONNECT: &[Step] = &[
    Step::Setup,
    Step::FixedSetup,
    Step::ConfigurationList,
    Step::FixedList,
    Step::Length,
    Step::FeedbackTime,
    Step::AtStartMinimum,
    Step::SlaveJitter,
    Step::ConsumerTime,
];

/// Layout and times.
pub(super) const WRITE: &[Step] = &[
    Step::CycleTime,
    Step::ControlOffset,
    Step::MdtLengths,
    Step::StatusOffset,
    Step::AtLengths,
    Step::SvcMdtOffset,
    Step::SvcAtOffset,
    Step::MstLosses,
    Step::Assignment,
    Step::Number,
    Step::AtStart,
    Step::SyncTime,
    Step::CommandValid,
    Step::CommunicationControl,
    Step::RingDelay,
    Step::SyncJitter,
    Step::ProducerCycle,
    Step::AllowedLosses,
    Step::Gap,
    Step::CounterMax,
    Step::UcTimes,
    Step::MtuRequested,
    Step::MtuEffective,
];

/// Delay measuring once more, where the way of the telegrams is another one than when it was done last.
pub(super) const MEASURE_AGAIN: &[Step] = &[Step::RingDelay, Step::MeasureExecute, Step::MeasureCancel];

/// Delay measuring.
pub(super) const MEASURE: &[Step] = &[Step::MeasureExecute, Step::MeasureCancel];

/// Transition check: S-0-0127 in CP2, S-0-0128 in CP3.
pub(super) const CHECK: &[Step] = &[Step::CheckExecute, Step::CheckInvalid, Step::CheckCancel];

/// A place in a list of steps.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Cursor {
    row: usize,
    instance: u16,
}

impl Cursor {
    /// The next step for this slave with its connection number, 0 for steps that concern the whole slave.
    pub fn next(&mut self, steps: &[Step], station: &Station) -> Option<(Step, u8)> {
        while let Some(&step) = steps.get(self.row) {
            if !step.per_connection() {
                self.row += 1;
                if step.applies(station) {
                    return Some((step, 0));
                }
                continue;
            }
            while let Ok(instance) = u8::try_from(self.instance) {
                self.instance += 1;
                if step.applies_to(station, instance) {
                    return Some((step, instance));
                }
            }
            self.instance = 0;
            self.row += 1;
        }
        None
    }
}

/// What the values of the written parameters come from.
pub(super) struct Values<'a> {
    pub config: &'a MasterConfig,
    pub layout: &'a CyclicLayout,
    /// The slave's part of the layout.
    pub places: Option<&'a SlavePlaces>,
    /// The transition check of this phase: S-0-0127 or S-0-0128, and the list that belongs to it.
    pub check: (Idn, Idn),
    /// The extended field carries a time.
    pub extended: bool,
}

impl Step {
    fn per_connection(self) -> bool {
        matches!(
            self,
            Step::Setup
                | Step::FixedSetup
                | Step::ConfigurationList
                | Step::FixedList
                | Step::Length
                | Step::Assignment
                | Step::Number
                | Step::ProducerCycle
                | Step::AllowedLosses
        )
    }

    /// Whether a slave may lack the parameter.
    pub fn optional(self) -> bool {
        !matches!(
            self,
            Step::Address
                | Step::ScpClasses
                | Step::FixedSetup
                | Step::ConfigurationList
                | Step::FixedList
                | Step::Length
                | Step::CycleTime
                | Step::ControlOffset
                | Step::MdtLengths
                | Step::StatusOffset
                | Step::AtLengths
                | Step::SvcMdtOffset
                | Step::SvcAtOffset
                | Step::Assignment
                | Step::AtStart
                | Step::CheckExecute
                | Step::CheckCancel
        )
    }

    fn applies(self, station: &Station) -> bool {
        let facts = &station.facts;
        let sync = facts.version(ScpClass::SYNC).unwrap_or(0);
        match self {
            Step::ConnectionImage => facts.version(ScpClass::VAR_CFG).is_some(),
            Step::AtStart | Step::SyncTime | Step::CommandValid => sync >= 1,
            Step::MeasureExecute | Step::MeasureCancel => sync >= 1,
            Step::SlaveJitter | Step::ConsumerTime => sync >= 2,
            Step::CommunicationControl => sync >= 2 || facts.version(ScpClass::SOFTWARE_CONTROL).is_some(),
            Step::CounterMax => sync >= 3,
            Step::Gap => facts.gap,
            Step::UcTimes | Step::MtuRequested | Step::MtuEffective => facts.version(ScpClass::NRT).is_some(),
            Step::Address => station.setup.assign.is_some(),
            Step::CheckInvalid => station.setup.check_failed,
            _ => true,
        }
    }

    fn applies_to(self, station: &Station, instance: u8) -> bool {
        let facts = &station.facts;
        let variable = facts.version(ScpClass::VAR_CFG).is_some();
        match (self, station.connection(instance)) {
            // A connection that is not wanted is switched off. Slaves with a fixed configuration may lack the setup.
            (Step::Setup, None) => facts.has_setup() && u16::from(instance) < facts.connections,
            (Step::Setup, Some(_)) => facts.has_setup(),
            (Step::FixedSetup, _) => instance < 32 && station.setup.fixed_setups >> instance & 1 != 0,
            (_, None) => false,
            (Step::ConfigurationList, Some(connection)) => {
                variable && connection.configuration == ConfigurationType::IdnList
            }
            // What cannot be written is compared.
            (Step::FixedList, Some(connection)) => {
                !variable && connection.configuration == ConfigurationType::IdnList
            }
            (Step::Number, Some(_)) => variable,
            (_, Some(_)) => true,
        }
    }

    // Flat: a table from step to IDN.
    fn idn(self, instance: u8, check: (Idn, Idn)) -> Idn {
        match self {
            Step::Address => Idn::ADDRESS,
            Step::FspType => Idn::FSP_TYPE,
            Step::ScpClasses => Idn::SCP_CLASSES,
            Step::ActivateClasses => Idn::SCP_ACTIVE,
            Step::GapPresence | Step::Gap => Idn::INTER_FRAME_GAP,
            Step::ConnectionImage => Idn::CONNECTION_IMAGE,
            Step::Setup | Step::FixedSetup => Idn::connection(instance, connection::SETUP),
            Step::Number => Idn::connection(instance, connection::NUMBER),
            Step::Assignment => Idn::connection(instance, connection::ASSIGNMENT),
            Step::Length => Idn::connection(instance, connection::LENGTH),
            Step::ConfigurationList | Step::FixedList => Idn::connection(instance, connection::LIST),
            Step::ProducerCycle => Idn::connection(instance, connection::CYCLE),
            Step::AllowedLosses => Idn::connection(instance, connection::LOSSES_MAX),
            Step::FeedbackTime => Idn::FEEDBACK_TIME,
            Step::AtStartMinimum | Step::AtStart => Idn::AT_START,
            Step::SlaveJitter => Idn::SLAVE_JITTER,
            Step::ConsumerTime => Idn::CONSUMER_TIME,
            Step::CycleTime => Idn::CYCLE_TIME,
            Step::ControlOffset => Idn::CONTROL_OFFSET,
            Step::MdtLengths => Idn::MDT_LENGTHS,
            Step::StatusOffset => Idn::STATUS_OFFSET,
            Step::AtLengths => Idn::AT_LENGTHS,
            Step::SvcMdtOffset => Idn::SVC_MDT_OFFSET,
            Step::SvcAtOffset => Idn::SVC_AT_OFFSET,
            Step::MstLosses => Idn::MST_LOSSES,
            Step::SyncTime => Idn::SYNC_TIME,
            Step::CommandValid => Idn::COMMAND_VALID,
            Step::CommunicationControl => Idn::COMMUNICATION_CONTROL,
            Step::RingDelay => Idn::RING_DELAY,
            Step::SyncJitter => Idn::SYNC_JITTER,
            Step::CounterMax => Idn::TSREF_MAX,
            Step::UcTimes => Idn::UC_TIMES,
            Step::MtuRequested => Idn::MTU_REQUESTED,
            Step::MtuEffective => Idn::MTU_EFFECTIVE,
            Step::MeasureExecute | Step::MeasureCancel => Idn::DELAY_MEASURING,
            Step::CheckExecute | Step::CheckCancel => check.0,
            Step::CheckInvalid => check.1,
        }
    }

    /// The request of this step. `list` is the slave's buffer for lists to read; it is taken only by those.
    // Flat: one arm per step.
    pub fn request(self, instance: u8, station: &mut Station, values: &Values<'_>) -> SvcRequest {
        let idn = self.idn(instance, values.check);
        let times = &values.layout.times;
        let connection = station.connection(instance);
        let place = values
            .places
            .and_then(|places| places.connections.iter().find(|place| place.instance == instance).copied());
        let offset = |get: fn(&SlavePlaces) -> crate::wire::layout::Offset| {
            half(idn, values.places.map_or(0, |places| get(places).to_parameter()))
        };
        let connection_cycle = |connection: Option<&ConnectionConfig>| {
            let cycles = connection.map_or(1, |connection| u32::from(connection.producer_cycles));
            word(idn, values.config.cycle_ns.saturating_mul(cycles))
        };
        match self {
            Step::Address => half(idn, station.setup.assign.unwrap_or(0)),
            Step::FspType => SvcRequest::read(idn),
            Step::ScpClasses => SvcRequest::read(idn)
                .with_shape(Shape::List)
                .with_buffer(core::mem::take(&mut station.setup.list)),
            Step::CheckInvalid | Step::FixedList => SvcRequest::read(idn)
                .with_shape(Shape::List)
                .with_buffer(core::mem::take(&mut station.setup.list)),
            Step::ActivateClasses => list(idn, station.facts.active_classes()),
            Step::GapPresence | Step::SlaveJitter | Step::MtuEffective | Step::Length | Step::FixedSetup => {
                SvcRequest::read(idn).with_shape(Shape::Fixed(2))
            }
            Step::FeedbackTime | Step::ConsumerTime => SvcRequest::read(idn).with_shape(Shape::Fixed(4)),
            Step::AtStartMinimum => {
                SvcRequest::new(idn, SvcOperation::Read(Element::Minimum)).with_shape(Shape::Fixed(4))
            }
            Step::ConnectionImage => {
                SvcRequest::new(idn, SvcOperation::Length(Element::Data)).with_shape(Shape::List)
            }
            Step::Setup => {
                half(idn, connection.map_or(ConnectionSetup::empty(), ConnectionConfig::setup).bits())
            }
            Step::ConfigurationList => {
                let idns = connection.map(|connection| connection.idns.as_slice()).unwrap_or_default();
                list(idn, idns.iter().flat_map(|idn| idn.0.to_le_bytes()))
            }
            Step::CycleTime => word(idn, values.config.cycle_ns),
            Step::ControlOffset => offset(|places| places.control),
            Step::StatusOffset => offset(|places| places.status),
            Step::SvcMdtOffset => offset(|places| places.svc_mdt),
            Step::SvcAtOffset => offset(|places| places.svc_at),
            Step::MdtLengths => list(idn, values.layout.mdt_len.iter().flat_map(|len| len.to_le_bytes())),
            Step::AtLengths => list(idn, values.layout.at_len.iter().flat_map(|len| len.to_le_bytes())),
            Step::MstLosses => word(idn, u32::from(values.config.mst_losses)),
            Step::Assignment => half(idn, place.map_or(0, |place| place.at.to_assignment(place.kind))),
            Step::Number => half(idn, place.map_or(0, |place| place.number)),
            Step::AtStart => word(idn, times.at_start_ns),
            Step::SyncTime => word(idn, times.sync_ns),
            Step::CommandValid => word(idn, times.command_valid_ns),
            Step::CommunicationControl => {
                let extended = if values.extended { EXTENDED_USED } else { 0 };
                let soft = if values.config.mst_jitter_ns > SOFT_MASTER_NS { SOFT_MASTER } else { 0 };
                word(idn, extended | soft)
            }
            Step::RingDelay => word(idn, times.ring_delay_ns),
            Step::SyncJitter => word(idn, times.sync_jitter_ns),
            Step::ProducerCycle => connection_cycle(connection),
            Step::AllowedLosses => half(idn, connection.map_or(0, |connection| connection.allowed_losses)),
            Step::Gap => half(idn, times.gap),
            // The counter in the extended field stays at 0.
            Step::CounterMax => half(idn, 0),
            Step::UcTimes => {
                let (begin, end) = times.uc_ns.unwrap_or((0, 0));
                list(idn, [begin, end].into_iter().flat_map(u32::to_le_bytes))
            }
            Step::MtuRequested => half(idn, values.config.mtu),
            Step::MeasureExecute | Step::CheckExecute => SvcRequest::new(idn, SvcOperation::Execute),
            Step::MeasureCancel | Step::CheckCancel => SvcRequest::new(idn, SvcOperation::Cancel),
        }
    }
}

/// The kind of telegram in which a connection of the slave is.
pub(super) fn kind(connection: &ConnectionConfig) -> Kind {
    if connection.slave_produces { Kind::At } else { Kind::Mdt }
}

fn half(idn: Idn, value: u16) -> SvcRequest {
    write(idn, Shape::Fixed(2), value.to_le_bytes())
}

fn word(idn: Idn, value: u32) -> SvcRequest {
    write(idn, Shape::Fixed(4), value.to_le_bytes())
}

fn list(idn: Idn, bytes: impl IntoIterator<Item = u8>) -> SvcRequest {
    write(idn, Shape::List, bytes)
}

/// A write request; bytes beyond the inline data are left out, and no list written here is that long.
fn write(idn: Idn, shape: Shape, bytes: impl IntoIterator<Item = u8>) -> SvcRequest {
    let room = super::svc::request::INLINE_LEN;
    let data = SvcData::Inline(bytes.into_iter().take(room).collect());
    SvcRequest::write(idn, data).with_shape(shape)
}
