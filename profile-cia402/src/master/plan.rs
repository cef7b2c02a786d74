//! The steps of the boot-up, in the order that devices accept.
//!
//! A mapping that is not to be written is only read. Else it is changed while its PDO does not exist: COB-ID with bit 31 set,
//! number of entries 0, entries, number of entries, communication parameters, COB-ID valid. Then all of it is read back.

use profile_generic::time::DurationNs;

use super::boot::{BootState, BootStatus};
use super::config::{
    Direction, MappingPolicy, MasterConfig, MasterHeartbeat, NodeConfig, PdoConfig, SyncConfig,
};
use super::program::ProgramStep;
use super::report::RowOutcome;
use super::station::Station;
use crate::generated::objects;
use crate::sdo::request::{SdoFailure, SdoOutcome, SdoRequest};
use crate::wire::pdo::{
    MAPPING_MAX, MappingEntry, SUB_COB_ID, SUB_EVENT_TIMER, SUB_INHIBIT, SUB_SYNC_START, SUB_TYPE,
    TransmissionType,
};
use crate::wire::{CobId, Mux};

/// PDOs that devices have by default; those that are not configured are switched off.
const DEFAULT_PDOS: u16 = 4;

/// "save", what 1010 wants to be written.
const SAVE: u32 = 0x6576_6173;

/// Longest time for the answer to it: pages of a memory are erased before.
const STORE_TIME: DurationNs = DurationNs::from_secs(10);

/// A step with one PDO.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PdoStep {
    /// Reads the COB-ID: bit 30 is left as the device has it.
    ReadOld,
    Disable,
    Clear,
    Entry(u8),
    Count,
    Type,
    Inhibit,
    EventTimer,
    SyncStart,
    Enable,
    ReadCount,
    ReadEntry(u8),
    ReadType,
    ReadCobId,
}

/// A step of the boot-up: one SDO.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    DeviceType,
    Identity(u8),
    Program(ProgramStep),
    Date,
    Time,
    Write(usize),
    StampDate,
    StampTime,
    Store,
    /// The period is 0 while the counter overflow is changed.
    PeriodOff,
    Overflow,
    Period,
    Window,
    OtherPdo(Direction, u16),
    OtherPdoOff(Direction, u16),
    Pdo(Direction, usize, PdoStep),
    MasterHeartbeat,
    Heartbeat,
    /// A device whose heartbeat is on does not answer to guarding.
    HeartbeatOff,
    GuardTime,
    LifeTimeFactor,
}

/// How to go on after a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// With the next one.
    Next,
    /// With this one, and then the next one.
    Then(Step),
    /// With this one, which stands further behind.
    SkipTo(Step),
    /// With this one, after a while, as long as there is time.
    Again(Step),
    /// With the next one: the download of a program begins.
    Program,
    /// As with a device that has just come.
    Restart,
    /// All is done.
    Finish,
    /// Not at all.
    Fail(BootStatus),
}

/// Steps that a device can need at most in one state.
pub(super) fn steps_max(node: &NodeConfig) -> usize {
    let pdos = [&node.rpdos, &node.tpdos].into_iter().flatten();
    let map: usize = pdos.map(|pdo| pdo.mapping.len() + 16).sum();
    map + 5 + 2 * usize::from(DEFAULT_PDOS) + node.writes.len() + ProgramStep::ALL.len()
}

/// Fills in the steps of a state.
// Flat: the steps of a state, one arm per state.
pub(super) fn fill(
    steps: &mut Vec<Step>,
    state: BootState,
    config: &MasterConfig,
    node: &NodeConfig,
    kept: bool,
) {
    steps.clear();
    match state {
        BootState::Identify => {
            steps.push(Step::DeviceType);
            steps.extend((1..=4).map(Step::Identity));
        }
        BootState::Program if node.program.is_some() => {
            steps.extend(ProgramStep::ALL.map(Step::Program));
        }
        BootState::Configure => {
            if node.stamp.is_some() {
                steps.extend([Step::Date, Step::Time]);
            }
            steps.extend((0..node.writes.len()).map(Step::Write));
            if node.stamp.is_some() {
                steps.extend([Step::StampDate, Step::StampTime]);
            }
            if node.store {
                steps.push(Step::Store);
            }
        }
        BootState::Map => {
            if let Some(sync) = config.sync.filter(|_| !kept) {
                if sync.counter_overflow > 0 {
                    steps.extend([Step::PeriodOff, Step::Overflow]);
                }
                steps.extend([Step::Period, Step::Window]);
            }
            for direction in Direction::BOTH {
                let pdos = node.pdos(direction);
                let other = |number: &u16| !kept && !pdos.iter().any(|pdo| pdo.number == *number);
                let others = (1..=DEFAULT_PDOS).filter(other);
                steps.extend(others.map(|number| Step::OtherPdo(direction, number)));
                for (place, pdo) in pdos.iter().enumerate() {
                    fill_pdo(steps, config, direction, place, pdo, kept);
                }
            }
        }
        BootState::Control if !kept => {
            if config.heartbeat.is_some() {
                steps.push(Step::MasterHeartbeat);
            }
            if node.heartbeat.is_some() {
                steps.push(Step::Heartbeat);
            }
            if node.guarding.is_some() {
                steps.extend([Step::HeartbeatOff, Step::GuardTime, Step::LifeTimeFactor]);
            }
        }
        _ => {}
    }
}

fn fill_pdo(
    steps: &mut Vec<Step>,
    config: &MasterConfig,
    direction: Direction,
    place: usize,
    pdo: &PdoConfig,
    kept: bool,
) {
    use PdoStep as P;
    let transmits = direction == Direction::Transmit;
    let counter = config.sync.is_some_and(|sync| sync.counter_overflow > 0);
    let mut push = |step| steps.push(Step::Pdo(direction, place, step));
    if !kept {
        [P::ReadOld, P::Disable].into_iter().for_each(&mut push);
        if pdo.policy != MappingPolicy::Keep {
            push(P::Clear);
            (1..=u8::try_from(pdo.mapping.len()).unwrap_or(u8::MAX)).map(P::Entry).for_each(&mut push);
            push(P::Count);
        }
        push(P::Type);
        if transmits {
            push(P::Inhibit);
        }
        if transmits || pdo.event_timer_ms > 0 {
            push(P::EventTimer);
        }
        if transmits && (counter || pdo.sync_start > 0) {
            push(P::SyncStart);
        }
        push(P::Enable);
    }
    [P::ReadCount, P::ReadType, P::ReadCobId].into_iter().for_each(&mut push);
}

fn number(object: Mux, value: impl Into<u64>, len: usize) -> SdoRequest {
    SdoRequest::download_number(object, value.into(), len)
}

/// The event timer of a PDO, ms: a TPDO has one only while it is event-driven.
fn event_timer(direction: Direction, pdo: &PdoConfig, transmission: TransmissionType) -> u16 {
    match direction {
        Direction::Transmit if !transmission.is_event_driven() => 0,
        _ => pdo.event_timer_ms,
    }
}

/// The COB-ID that a PDO shall have.
fn cob_id(direction: Direction, pdo: &PdoConfig, node: &NodeConfig, station: &Station) -> CobId {
    let id = pdo.id(direction, node.node).map_or(CobId(1 << 31), CobId::new);
    id.with_bit_30(station.bit_30)
}

/// The request of a step. The bytes of a configured value go with it, and come back with the outcome.
// Flat: one arm per step.
pub(super) fn request(
    step: Step,
    sync: Option<SyncConfig>,
    heartbeat: Option<MasterHeartbeat>,
    node: &mut NodeConfig,
    station: &Station,
) -> SdoRequest {
    let stamp = node.stamp;
    match step {
        Step::DeviceType => SdoRequest::upload(Mux::DEVICE_TYPE),
        Step::Identity(sub) => SdoRequest::upload(Mux::new(objects::IDENTITY, sub)),
        Step::Program(step) => step.request(node),
        Step::Date => SdoRequest::upload(Mux::CONFIGURATION_DATE),
        Step::Time => SdoRequest::upload(Mux::CONFIGURATION_TIME),
        Step::Write(place) => {
            let (object, data) = node
                .writes
                .get_mut(place)
                .map_or_else(Default::default, |write| (write.object, core::mem::take(&mut write.data)));
            SdoRequest::download(object, data)
        }
        Step::StampDate => number(Mux::CONFIGURATION_DATE, stamp.map_or(0, |stamp| stamp.date), 4),
        Step::StampTime => number(Mux::CONFIGURATION_TIME, stamp.map_or(0, |stamp| stamp.time), 4),
        Step::Store => number(Mux::STORE, SAVE, 4).within(STORE_TIME),
        Step::PeriodOff => number(Mux::CYCLE_PERIOD, 0_u32, 4),
        Step::Overflow => number(Mux::SYNC_OVERFLOW, sync.map_or(0, |sync| sync.counter_overflow), 1),
        Step::Period => number(Mux::CYCLE_PERIOD, sync.map_or(0, |sync| sync.period_ns / 1000), 4),
        Step::Window => number(Mux::SYNC_WINDOW, sync.map_or(0, |sync| sync.window_ns / 1000), 4),
        Step::OtherPdo(direction, pdo) => SdoRequest::upload(direction.communication_object(pdo, SUB_COB_ID)),
        Step::OtherPdoOff(direction, pdo) => {
            number(direction.communication_object(pdo, SUB_COB_ID), station.other.with_valid(false).0, 4)
        }
        Step::MasterHeartbeat => {
            let word = heartbeat.map_or(0, |own| u32::from(own.node.get()) << 16 | u32::from(own.timeout_ms));
            number(Mux::consumer_heartbeat(1), word, 4)
        }
        Step::Heartbeat => {
            number(Mux::PRODUCER_HEARTBEAT, node.heartbeat.map_or(0, |heartbeat| heartbeat.producer_ms), 2)
        }
        Step::HeartbeatOff => number(Mux::PRODUCER_HEARTBEAT, 0_u16, 2),
        Step::GuardTime => number(Mux::GUARD_TIME, node.guarding.map_or(0, |guard| guard.guard_time_ms), 2),
        Step::LifeTimeFactor => {
            number(Mux::LIFE_TIME_FACTOR, node.guarding.map_or(0, |guard| guard.life_time_factor), 1)
        }
        Step::Pdo(direction, place, step) => {
            let Some(pdo) = node.pdos(direction).get(place) else {
                return SdoRequest::upload(Mux::DEVICE_TYPE);
            };
            pdo_request(step, direction, place, pdo, node, station)
        }
    }
}

fn pdo_request(
    step: PdoStep,
    direction: Direction,
    place: usize,
    pdo: &PdoConfig,
    node: &NodeConfig,
    station: &Station,
) -> SdoRequest {
    use PdoStep as P;
    let parameter = |sub| direction.communication_object(pdo.number, sub);
    let map = |sub| direction.mapping_object(pdo.number, sub);
    let id = cob_id(direction, pdo, node, station);
    let count = u8::try_from(pdo.mapping.len()).unwrap_or(u8::MAX);
    let transmission = station.transmission(direction, place).unwrap_or(pdo.transmission);
    match step {
        P::ReadOld | P::ReadCobId => SdoRequest::upload(parameter(SUB_COB_ID)),
        P::Disable => number(parameter(SUB_COB_ID), id.with_valid(false).0, 4),
        P::Clear => number(map(0), 0_u8, 1),
        P::Entry(place) => {
            let entry = pdo.mapping.get(usize::from(place) - 1).map_or(0, |entry| entry.0);
            number(map(place), entry, 4)
        }
        P::Count => number(map(0), count, 1),
        P::Type => number(parameter(SUB_TYPE), transmission.0, 1),
        P::Inhibit => number(parameter(SUB_INHIBIT), pdo.inhibit_100us, 2),
        P::EventTimer => number(parameter(SUB_EVENT_TIMER), event_timer(direction, pdo, transmission), 2),
        P::SyncStart => number(parameter(SUB_SYNC_START), pdo.sync_start, 1),
        P::Enable => number(parameter(SUB_COB_ID), id.with_valid(true).0, 4),
        P::ReadCount => SdoRequest::upload(map(0)),
        P::ReadEntry(place) => SdoRequest::upload(map(place)),
        P::ReadType => SdoRequest::upload(parameter(SUB_TYPE)),
    }
}

/// What a step's outcome means.
// Flat: one arm per step.
pub(super) fn judge(
    step: Step,
    outcome: &SdoOutcome,
    row: RowOutcome,
    config: &MasterConfig,
    node: &NodeConfig,
    station: &mut Station,
) -> (RowOutcome, Verdict) {
    let value = match outcome.result {
        Ok(()) => outcome.data.unsigned().and_then(|value| u32::try_from(value).ok()),
        Err(_) => None,
    };
    let expected = node.expected;
    let refused = outcome.result.err().filter(|failure| matches!(failure, SdoFailure::Refused(_)));
    // A value that the device need not have, but has to say so.
    let optional_or = |status| match refused {
        Some(failure) if failure.is_absent() => (RowOutcome::Absent, Verdict::Next),
        Some(failure) => (RowOutcome::Tolerated(failure), Verdict::Next),
        None => required_or(row, status),
    };
    let optional = || optional_or(BootStatus::CONFIGURATION);
    match step {
        Step::DeviceType => {
            station.device_type = value;
            // An abort is an answer; it is no answer to what the device is.
            // Of the profile the low half counts, of a whole type all of it.
            let profile = expected.device_type.is_none().then_some(expected.profile).flatten().map(u32::from);
            let high = profile.and(value).unwrap_or(0) & 0xFFFF_0000;
            let expected = expected.device_type.or(profile.map(|profile| high | profile));
            compare(expected, value, BootStatus::DEVICE_TYPE, optional_or(BootStatus::NO_ANSWER))
        }
        Step::Identity(sub) => {
            let (expected, status) = match sub {
                1 => (expected.vendor, BootStatus::VENDOR),
                2 => (expected.product, BootStatus::PRODUCT),
                3 => (expected.revision, BootStatus::REVISION),
                _ => (expected.serial, BootStatus::SERIAL),
            };
            station.identity[usize::from(sub - 1).min(3)] = value;
            compare(expected, value, status, optional_or(status))
        }
        Step::Program(step) => step.judge(value, row, node, station),
        Step::Date | Step::Time => {
            let wanted = node.stamp.map(|stamp| if step == Step::Date { stamp.date } else { stamp.time });
            let same = value.is_some() && value == wanted;
            station.configured = same && (station.configured || step == Step::Date);
            let finished = step == Step::Time && station.configured;
            let (row, verdict) = optional();
            (row, if finished { Verdict::Finish } else { verdict })
        }
        Step::StampDate | Step::StampTime if node.store => required(row),
        Step::StampDate | Step::StampTime | Step::PeriodOff | Step::Period | Step::Window => optional(),
        Step::MasterHeartbeat | Step::HeartbeatOff => optional(),
        // It answers nevertheless; that the master is lost it does not see then.
        Step::GuardTime | Step::LifeTimeFactor if refused.is_some_and(SdoFailure::is_absent) => optional(),
        Step::GuardTime | Step::LifeTimeFactor => required(row),
        Step::Write(_) | Step::Store | Step::Overflow | Step::Heartbeat => required(row),
        Step::OtherPdo(direction, number) => match value.map(CobId) {
            Some(id) if id.is_valid() => {
                station.other = id;
                (row, Verdict::Then(Step::OtherPdoOff(direction, number)))
            }
            _ => optional(),
        },
        // A PDO that keeps coming is not taken, but it costs time on the bus.
        Step::OtherPdoOff(..) => optional(),
        Step::Pdo(direction, place, step) => {
            let Some(pdo) = node.pdos(direction).get(place) else { return required(row) };
            let judge = PdoJudge { direction, place, pdo, config, node };
            judge.judge(step, value, row, refused, station)
        }
    }
}

fn required(row: RowOutcome) -> (RowOutcome, Verdict) {
    required_or(row, BootStatus::CONFIGURATION)
}

fn required_or(row: RowOutcome, status: BootStatus) -> (RowOutcome, Verdict) {
    let verdict = match row {
        RowOutcome::Failed(_) => Verdict::Fail(status),
        _ => Verdict::Next,
    };
    (row, verdict)
}

/// Compares a value with the one that is expected, if one is.
fn compare(
    expected: Option<u32>,
    value: Option<u32>,
    status: BootStatus,
    tolerant: (RowOutcome, Verdict),
) -> (RowOutcome, Verdict) {
    match (expected, value) {
        (Some(expected), Some(found)) if expected != found => {
            (RowOutcome::Differs { found, expected }, Verdict::Fail(status))
        }
        (Some(_), None) if !matches!(tolerant.1, Verdict::Fail(_)) => (tolerant.0, Verdict::Fail(status)),
        _ => tolerant,
    }
}

struct PdoJudge<'a> {
    direction: Direction,
    place: usize,
    pdo: &'a PdoConfig,
    config: &'a MasterConfig,
    node: &'a NodeConfig,
}

impl PdoJudge<'_> {
    fn step(&self, step: PdoStep) -> Step {
        Step::Pdo(self.direction, self.place, step)
    }

    // Flat: one arm per step.
    fn judge(
        &self,
        step: PdoStep,
        value: Option<u32>,
        row: RowOutcome,
        refused: Option<SdoFailure>,
        station: &mut Station,
    ) -> (RowOutcome, Verdict) {
        use PdoStep as P;
        let lenient = self.pdo.policy != MappingPolicy::Exact;
        let tolerated = |failure| (RowOutcome::Tolerated(failure), Verdict::Next);
        match (step, refused) {
            (P::ReadOld, _) => {
                station.bit_30 = value.is_some_and(|word| CobId(word).bit_30());
                required(row)
            }
            // What the device does not take it may have already: that is read at the end.
            (P::Disable | P::Clear | P::Entry(_) | P::Count, Some(failure)) if lenient => {
                (RowOutcome::Tolerated(failure), Verdict::SkipTo(self.step(P::Type)))
            }
            (P::Type, Some(failure)) if lenient || !self.pdo.others.is_empty() => {
                self.refused_type(failure, station)
            }
            (P::Enable, Some(failure)) if lenient => tolerated(failure),
            (P::Inhibit, Some(failure)) if self.pdo.inhibit_100us == 0 => tolerated(failure),
            (P::EventTimer, Some(failure)) if self.timer(station) == 0 => tolerated(failure),
            (P::SyncStart, Some(failure)) if self.pdo.sync_start == 0 => tolerated(failure),
            (P::ReadCount, None) => self.read_count(value, row, station),
            (P::ReadEntry(place), None) => self.read_entry(place, value, row, station),
            (P::ReadType, None) => self.read_type(value, row, station),
            (P::ReadCobId, None) => {
                let wanted = cob_id(self.direction, self.pdo, self.node, station);
                // Bit 30 does not matter to the master, who sends no remote frames.
                let value = value.map(|word| CobId(word).with_bit_30(station.bit_30).0);
                self.same(value, wanted.0, row)
            }
            _ => required(row),
        }
    }

    fn same(&self, value: Option<u32>, expected: u32, row: RowOutcome) -> (RowOutcome, Verdict) {
        match value {
            Some(found) if found != expected => {
                (RowOutcome::Differs { found, expected }, Verdict::Fail(BootStatus::CONFIGURATION))
            }
            _ => required(row),
        }
    }

    fn timer(&self, station: &Station) -> u16 {
        event_timer(self.direction, self.pdo, self.transmission(station))
    }

    /// The transmission type that the PDO is used with.
    fn transmission(&self, station: &Station) -> TransmissionType {
        station.transmission(self.direction, self.place).unwrap_or(self.pdo.transmission)
    }

    /// The device does not take a transmission type: it is asked for the next one, and for what it has if there is none, or if it
    /// lets nothing be changed.
    fn refused_type(&self, failure: SdoFailure, station: &mut Station) -> (RowOutcome, Verdict) {
        let tried = self.transmission(station);
        let all = core::iter::once(&self.pdo.transmission).chain(self.pdo.others);
        let next = all.skip_while(|kind| **kind != tried).nth(1).filter(|_| !failure.is_read_only());
        let step = match next {
            Some(next) => {
                station.take_transmission(self.direction, self.place, *next);
                PdoStep::Type
            }
            None => PdoStep::ReadType,
        };
        (RowOutcome::Tolerated(failure), Verdict::Then(self.step(step)))
    }

    /// What it has: what it was given, or another one that does.
    fn read_type(&self, value: Option<u32>, row: RowOutcome, station: &mut Station) -> (RowOutcome, Verdict) {
        let used = self.transmission(station);
        let found = value.and_then(|value| u8::try_from(value).ok()).map(TransmissionType);
        // All synchronous types are one to a device that receives.
        let receives = |kind: TransmissionType| {
            self.direction == Direction::Receive && kind.is_synchronous() && !kind.is_remote()
        };
        let all = || core::iter::once(&self.pdo.transmission).chain(self.pdo.others);
        let does =
            |found: TransmissionType| all().any(|kind| *kind == found || receives(*kind) && receives(found));
        let taken = match found.filter(|found| *found != used && !self.pdo.others.is_empty() && does(*found))
        {
            Some(found) => {
                station.take_transmission(self.direction, self.place, found);
                found
            }
            None => used,
        };
        let (row, verdict) = self.same(value, u32::from(taken.0), row);
        let told = (self.direction, self.pdo.number, self.pdo.transmission, taken);
        if verdict == Verdict::Next && taken != self.pdo.transmission && !station.types.contains(&told) {
            // As many as there are PDOs.
            let _ = station.types.try_push(told);
        }
        (row, verdict)
    }

    fn read_count(
        &self,
        value: Option<u32>,
        row: RowOutcome,
        station: &mut Station,
    ) -> (RowOutcome, Verdict) {
        station.found.clear();
        station.found_count =
            value.and_then(|value| usize::try_from(value).ok()).unwrap_or(0).min(MAPPING_MAX);
        let (row, verdict) = match self.pdo.policy {
            MappingPolicy::Exact | MappingPolicy::Keep => {
                self.same(value, u32::try_from(self.pdo.mapping.len()).unwrap_or(u32::MAX), row)
            }
            MappingPolicy::Adopt => required(row),
        };
        match verdict {
            Verdict::Next if station.found_count > 0 => {
                (row, Verdict::Then(self.step(PdoStep::ReadEntry(1))))
            }
            Verdict::Next => self.read_all(row, station),
            _ => (row, verdict),
        }
    }

    fn read_entry(
        &self,
        place: u8,
        value: Option<u32>,
        row: RowOutcome,
        station: &mut Station,
    ) -> (RowOutcome, Verdict) {
        let (row, verdict) = match (self.pdo.policy, self.pdo.mapping.get(usize::from(place) - 1)) {
            (MappingPolicy::Exact | MappingPolicy::Keep, Some(entry)) => self.same(value, entry.0, row),
            _ => required(row),
        };
        if verdict != Verdict::Next {
            return (row, verdict);
        }
        if station.found.len() < MAPPING_MAX {
            station.found.push(MappingEntry(value.unwrap_or_default()));
        }
        if usize::from(place) < station.found_count {
            return (row, Verdict::Then(self.step(PdoStep::ReadEntry(place + 1))));
        }
        self.read_all(row, station)
    }

    /// The whole mapping has been read.
    fn read_all(&self, row: RowOutcome, station: &mut Station) -> (RowOutcome, Verdict) {
        let wanted = self.config.check_mapping(&self.pdo.mapping).unwrap_or(0);
        if self.config.check_mapping(&station.found).is_err() {
            let found = u32::try_from(station.found.len()).unwrap_or(u32::MAX);
            let expected = u32::try_from(wanted).unwrap_or(u32::MAX);
            return (RowOutcome::Differs { found, expected }, Verdict::Fail(BootStatus::CONFIGURATION));
        }
        let adopted = *station.found != *self.pdo.mapping;
        station.take_mapping(self.direction, self.place);
        if adopted {
            station.adopted.push((self.direction, self.pdo.number));
        }
        (row, Verdict::Next)
    }
}
