//! The work of the phase-up: each list of steps for all slaves at the same time.

use super::config::{AddressPolicy, CONNECTION_LEN_MAX, ConnectionConfig};
use super::connection::{ConsumerEnd, ProducerEnd};
use super::event::{Event, Invalid, SlaveId};
use super::layout::{ConnectionNeed, Timing};
use super::network::Network;
use super::phase::{PhaseEvent, State};
use super::plan::{self, Cursor, Step, Values};
use super::report::{ReportRow, RowOutcome};
use super::station::{End, Presence, Station, Work};
use super::svc::request::{SvcData, SvcFailure, SvcOutcome};
use crate::wire::connection::{CONNECTION_CONTROL_LEN, ConnectionSetup};
use crate::wire::header::{Kind, Phase};
use crate::wire::idn::Idn;
use crate::wire::scp::{ScpClass, ScpEntry};
use crate::wire::svc_error::SvcError;

/// Largest SERCOS address.
const ADDRESS_MAX: u16 = 511;

/// What the master does in a state.
const fn steps(state: State) -> &'static [Step] {
    match state {
        State::Read2 => plan::READ,
        State::Connect2 => plan::CONNECT,
        State::Write2 => plan::WRITE,
        State::Measure2 => plan::MEASURE,
        State::Check2 | State::Check3 => plan::CHECK,
        _ => &[],
    }
}

/// Result of computing the telegrams of CP3 and CP4.
pub(super) enum Layout {
    Done,
    /// The application has to change something.
    Refused,
    /// The only way on leads through CP0.
    Restart,
}

impl Network {
    /// Starts the list of steps of the present state at every slave.
    pub(super) fn begin_work(&mut self, state: State) {
        if state == State::Read2 && self.config.addresses == AddressPolicy::Assign {
            self.choose_addresses();
        }
        for index in 0..self.stations.len() {
            self.begin_steps(index);
            if state == State::Connect2 {
                self.begin_connections(index);
            }
        }
    }

    /// Starts a list of steps at a slave.
    pub(super) fn begin_steps(&mut self, index: usize) {
        let station = &mut self.stations[index];
        // A request that was cut off by a switch of the phase gives the list buffer back.
        if let Some(SvcOutcome { data: SvcData::Buffer(buffer), .. }) = station.channel.take_own() {
            station.setup.list = buffer;
        }
        station.setup.work = Work::Free;
        station.setup.cursor = Cursor::default();
        station.setup.check_failed = false;
    }

    /// Forgets what is known of a slave's connections, and refuses those that it cannot have.
    pub(super) fn begin_connections(&mut self, index: usize) {
        let station = &mut self.stations[index];
        station.need = super::layout::SlaveNeed::default();
        station.setup.fixed_setups = 0;
        station.ends.clear();
        station.setup.report.truncate(station.setup.read_rows);
        if !station.is_served() || station.connections.is_empty() {
            return;
        }
        let (slave, available) = (SlaveId::from_index(index), station.facts.connections);
        let beyond = station.connections.iter().map(|connection| connection.instance);
        let beyond = beyond.max().filter(|&instance| available > 0 && u16::from(instance) >= available);
        if !station.facts.is_consistent() {
            station.setup.work = Work::Failed;
            self.emit(Event::ClassMismatch { slave });
        } else if let Some(instance) = beyond {
            station.setup.work = Work::Failed;
            self.emit(Event::NoConnection { slave, instance, available });
        }
    }

    /// Chooses an address for each slave that has none of its own.
    fn choose_addresses(&mut self) {
        let configured = |address: u16| self.config.slaves.iter().any(|slave| slave.address == address);
        for index in 0..self.stations.len() {
            let (before, others) = self.stations.split_at_mut(index);
            let Some((station, after)) = others.split_first_mut() else { continue };
            let address = station.address;
            let first = !before.iter().any(|other| other.address == address);
            let shared = !first || after.iter().any(|other| other.address == address);
            let keeps = address != 0 && (!shared || (first && !configured(address)));
            if keeps || !station.is_active() {
                continue;
            }
            let others = || before.iter().chain(after.iter());
            let taken = |address: u16| {
                configured(address)
                    || others().any(|other| other.address == address || other.setup.assign == Some(address))
            };
            station.setup.assign = (1..=ADDRESS_MAX).find(|&address| !taken(address));
        }
    }

    /// The slave has taken its new address.
    fn take_address(&mut self, index: usize) {
        let slave = SlaveId::from_index(index);
        let station = &mut self.stations[index];
        let Some(new) = station.setup.assign.take() else { return };
        let old = core::mem::replace(&mut station.address, new);
        let missing = core::mem::replace(&mut station.configured, false);
        station.connections.clear();
        self.emit(Event::AddressAssigned { slave, old, new });
        // Said with the last of those that shared it.
        if missing && !self.stations.iter().any(|other| other.address == old) {
            self.emit(Event::Missing { address: old });
        }
    }

    /// Goes on with the list of steps of this state at every slave.
    pub(super) fn work_on_all(&mut self, state: State) -> Option<PhaseEvent> {
        let steps = steps(state);
        let phase = if state == State::Check3 { Phase::CP3 } else { Phase::CP2 };
        let (mut pending, mut failed) = (false, false);
        for index in 0..self.stations.len() {
            if !self.stations[index].is_active() {
                continue;
            }
            match self.work_on(index, steps, phase) {
                Work::Free | Work::Asked(..) => pending = true,
                Work::Failed => failed = true,
                Work::Done => {}
            }
        }
        if pending {
            return None;
        }
        if failed {
            return Some(PhaseEvent::Failed);
        }
        // The phase is left only when the application's running requests are through.
        if matches!(state, State::Check2 | State::Check3) {
            self.open_channels(false);
            let quiet = self.stations.iter().all(|station| !station.channel.is_running());
            return quiet.then_some(PhaseEvent::Ready);
        }
        Some(PhaseEvent::Ready)
    }

    /// Goes on with a list of steps at one slave. `phase` is the one whose check `CHECK` means.
    pub(super) fn work_on(&mut self, index: usize, steps: &[Step], phase: Phase) -> Work {
        self.collect(index);
        self.ask(index, steps, phase);
        self.stations[index].setup.work
    }

    /// Asks for the slave's next step, if it is free for one.
    fn ask(&mut self, index: usize, steps: &[Step], phase: Phase) {
        let station = &mut self.stations[index];
        if station.setup.work != Work::Free {
            return;
        }
        let mut cursor = station.setup.cursor;
        let next = cursor.next(steps, station);
        station.setup.cursor = cursor;
        let Some((step, instance)) = next else {
            station.setup.work = if station.setup.check_failed { Work::Failed } else { Work::Done };
            if station.setup.check_failed {
                let invalid = station.setup.invalid.clone();
                self.emit(Event::CheckFailed { slave: SlaveId::from_index(index), phase, invalid });
            }
            return;
        };
        let check = match phase {
            Phase::CP3 => (Idn::CP4_CHECK, Idn::INVALID_CP3),
            _ => (Idn::CP3_CHECK, Idn::INVALID_CP2),
        };
        let values = Values {
            config: &self.config,
            layout: &self.layout,
            places: self.layout.slaves.get(index).and_then(Option::as_ref),
            check,
            extended: self.config.system_time,
        };
        let request = step.request(instance, station, &values);
        station.channel.submit_own(request);
        station.setup.work = Work::Asked(step, instance);
    }

    /// Takes the outcome of the slave's step, if there is one.
    fn collect(&mut self, index: usize) {
        let phase = self.stations.phase;
        let station = &mut self.stations[index];
        let Work::Asked(step, instance) = station.setup.work else { return };
        let Some(outcome) = station.channel.take_own() else { return };
        let row = ReportRow::new(phase, &outcome, step.optional());
        station.setup.note(row);
        let idn = outcome.idn;
        let failure = match row.outcome {
            RowOutcome::Failed(failure) => forgive(station, step, instance, failure).err(),
            RowOutcome::Absent => None,
            RowOutcome::Value { .. } | RowOutcome::Done => {
                learn(station, step, instance, &outcome, self.config.cycle_ns).err()
            }
        };
        if let SvcData::Buffer(buffer) = outcome.data {
            station.setup.list = buffer;
        }
        station.setup.checked |=
            idn == Idn::CP3_CHECK && step == Step::CheckExecute && row.outcome == RowOutcome::Done;
        station.setup.work = if failure.is_some() { Work::Failed } else { Work::Free };
        if failure.is_none() && step == Step::Address {
            self.take_address(index);
        }
        if let Some(failure) = failure {
            let slave = SlaveId::from_index(index);
            // In operation that is no reason to do without the slave.
            let operating = phase == Phase::CP4 && self.stations[index].is_active();
            self.emit(if operating {
                Event::MeasureFailed { slave, idn, failure }
            } else {
                Event::StepFailed { slave, idn, failure }
            });
        }
    }

    /// Computes the telegrams of CP3 and CP4 and makes the ends of the connections.
    pub(super) fn lay_out(&mut self) -> Layout {
        let stale = |station: &Station| !station.is_active() && station.setup.checked;
        if let Some(index) = self.stations.iter().position(stale) {
            self.emit(Event::Stale { slave: SlaveId::from_index(index) });
            return Layout::Restart;
        }
        let stations = &mut self.stations;
        let timing = Timing {
            cycle_ns: self.config.cycle_ns,
            mst_jitter_ns: self.config.mst_jitter_ns,
            slave_jitter_ns: self.config.slave_jitter_ns,
            slave_delay_ns: self.config.slave_delay_ns,
            gap_adjustable: stations.iter().filter(|station| station.is_active()).all(|s| s.facts.gap),
            hot_plug_in_all: self.config.hot_plug_in_all,
        };
        let kept = |station: &Station| {
            let slave = self.config.slave(station.address);
            slave.filter(|_| station.hot_plug && station.presence != Presence::Excluded)?.hot_plug.as_ref()
        };
        if !stations.iter().any(|station| station.is_active() || kept(station).is_some()) {
            self.emit(Event::NobodyLeft);
            return Layout::Restart;
        }
        let needs = stations.iter().map(|station| match station.presence {
            Presence::Active => Some(&station.need),
            _ => kept(station),
        });
        if let Err(error) = self.layout.compute(&timing, needs) {
            self.emit(Event::LayoutRefused(error));
            return Layout::Refused;
        }
        stations.iter_mut().filter(|station| station.is_active()).for_each(make_ends);
        Layout::Done
    }

    /// The application's turn begins; `last` is the state before.
    pub(super) fn enter_await(&mut self, state: State, last: State) {
        self.open_channels(true);
        if last == State::Read2 {
            for station in self.stations.iter_mut() {
                station.setup.read_rows = station.setup.report.len();
            }
        }
        if let Some(phase) = state.awaits() {
            self.emit(Event::AwaitingApplication { phase });
        }
    }
}

/// Makes the master's ends of a slave's connections, once their lengths are known.
pub(super) fn make_ends(station: &mut Station) {
    station.ends.clear();
    for connection in &station.connections {
        let need = station.need.connections.iter().find(|need| need.instance == connection.instance);
        let len = need.map_or(0, |need| need.len);
        station.ends.push(match plan::kind(connection) {
            Kind::Mdt => End::Producer(ProducerEnd::new(len)),
            Kind::At => {
                End::Consumer(ConsumerEnd::new(len, connection.producer_cycles, connection.allowed_losses))
            }
        });
    }
}

/// Decides whether the slave can be set up in spite of a failure, and notes what follows.
fn forgive(station: &mut Station, step: Step, instance: u8, failure: SvcFailure) -> Result<(), SvcFailure> {
    let fixed = station.facts.version(ScpClass::VAR_CFG).is_none() && instance < 32;
    match (step, failure) {
        (Step::CheckExecute, SvcFailure::CommandFailed(_)) => {
            station.setup.check_failed = true;
            station.setup.invalid = Invalid::default();
        }
        // It cannot be written: then it has to be what it would have been.
        (Step::Setup, SvcFailure::Refused { code: SvcError::DATA_READ_ONLY, .. }) if fixed => {
            station.setup.fixed_setups |= 1 << instance;
        }
        // The check has failed anyway; without its list there is less to show.
        (Step::CheckInvalid, _) => {}
        _ => return Err(failure),
    }
    Ok(())
}

/// Takes what a step brought about the slave.
// Flat: one arm per step.
fn learn(
    station: &mut Station,
    step: Step,
    instance: u8,
    outcome: &SvcOutcome,
    cycle_ns: u32,
) -> Result<(), SvcFailure> {
    let number = outcome.data.unsigned().and_then(|value| u32::try_from(value).ok());
    // What would refuse the layout of all others is refused here, where it has a name.
    let max = match step {
        Step::Length => u32::try_from(CONNECTION_LEN_MAX).unwrap_or(u32::MAX),
        Step::FeedbackTime | Step::SlaveJitter | Step::ConsumerTime | Step::AtStartMinimum => cycle_ns,
        _ => u32::MAX,
    };
    if let Some(value) = number.filter(|&value| value > max) {
        return Err(SvcFailure::Impossible { value, max });
    }
    match step {
        Step::FspType => station.facts.fsp_type = number,
        Step::ScpClasses => {
            station.facts.classes =
                outcome.data.words().map(ScpEntry::from_word).take(super::station::CLASSES_MAX).collect();
            if station.facts.version(ScpClass::VAR_CFG).is_none() {
                station.facts.connections = super::station::CONNECTIONS_FIXED;
            }
        }
        Step::GapPresence => station.facts.gap = true,
        Step::ConnectionImage => {
            let head = outcome.result.ok().and_then(|reply| reply.head).unwrap_or_default();
            station.facts.connections = head.current / 2;
        }
        Step::Length => return learn_length(station, instance, half(number)),
        Step::FixedSetup => return check_setup(station.connection(instance), half(number)),
        Step::FixedList => return check_list(station.connection(instance), outcome),
        Step::FeedbackTime => station.need.feedback_ns = number.unwrap_or(0),
        Step::SlaveJitter => station.need.jitter_ns = number.unwrap_or(0),
        Step::ConsumerTime => station.need.consumer_ns = number.unwrap_or(0),
        Step::AtStartMinimum => station.need.at_start_min_ns = number.unwrap_or(0),
        Step::CheckInvalid => station.setup.invalid = outcome.data.double_words().map(Idn).collect(),
        _ => {}
    }
    Ok(())
}

/// A number of two bytes.
fn half(number: Option<u32>) -> u16 {
    u16::try_from(number.unwrap_or(0)).unwrap_or(0)
}

/// S-0-1050.x.5: the length of a connection with C-CON.
fn learn_length(station: &mut Station, instance: u8, len: u16) -> Result<(), SvcFailure> {
    if usize::from(len) < CONNECTION_CONTROL_LEN {
        return Err(SvcFailure::Length { expected: CONNECTION_CONTROL_LEN, given: usize::from(len) });
    }
    let connection = station.connection(instance);
    // Some slaves count the byte that makes an odd length even.
    let data_len = connection.and_then(|connection| connection.data_len);
    let expected = data_len.map(|bytes| bytes.saturating_add(2));
    if let Some(expected) = expected.filter(|&bytes| bytes != len && bytes.next_multiple_of(2) != len) {
        return Err(SvcFailure::ConnectionLength { expected, found: len });
    }
    let slave_produces = connection.is_some_and(|connection| connection.slave_produces);
    let len = len.saturating_add(len % 2);
    // As many as there are connections in the configuration, which have the same bound.
    let _ = station.need.connections.try_push(ConnectionNeed { instance, slave_produces, len });
    Ok(())
}

/// S-0-1050.x.1 of a slave that does not let anybody write it.
fn check_setup(connection: Option<&ConnectionConfig>, found: u16) -> Result<(), SvcFailure> {
    let expected = connection.map_or(ConnectionSetup::empty(), ConnectionConfig::setup);
    let counts = ConnectionSetup::ACTIVE | ConnectionSetup::PRODUCER;
    if ConnectionSetup::from_bits_retain(found) & counts == expected & counts {
        Ok(())
    } else {
        Err(SvcFailure::FixedSetup { expected: expected.bits(), found })
    }
}

/// S-0-1050.x.6 of a slave whose connections are fixed: it has to be the planned list.
fn check_list(connection: Option<&ConnectionConfig>, outcome: &SvcOutcome) -> Result<(), SvcFailure> {
    let wanted = connection.map_or(&[][..], |connection| &connection.idns);
    let mut found = outcome.data.double_words().map(Idn);
    // One more than either has, so that a longer list shows.
    for place in 0..=u16::try_from(wanted.len()).unwrap_or(u16::MAX) {
        let (expected, found) = (wanted.get(usize::from(place)).copied(), found.next());
        if expected != found {
            let (expected, found) = (expected.unwrap_or(Idn(0)), found.unwrap_or(Idn(0)));
            return Err(SvcFailure::FixedList { place, expected, found });
        }
    }
    Ok(())
}
