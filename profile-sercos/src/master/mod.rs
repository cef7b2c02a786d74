//! The master role.
//!
//! [`Master`] takes a network of slaves, a line on either port or a ring on both, from no telegrams at all (NRT) through CP0 to CP4 and keeps the cycle going.
//! It is driven by time and frames:
//!
//! ```text
//! loop {
//!     wait until wake_at(), hand every frame that arrives meanwhile to handle_frame()
//!     take consumer() values, write producer() values, commit()
//!     while let Some(output) = poll(now) { send it }
//!     while let Some(event) = poll_event() { .. }
//! }
//! ```
//!
//! All storage is set aside in [`Master::new`]; nothing is allocated or freed afterwards. The ATs are evaluated as
//! soon as the last one of the cycle is back, and at the start of the next cycle if one stays away. All frames of
//! a cycle are given at its start, MDTs before ATs: a soft master cannot keep t1 to the nanosecond, and slaves
//! learn of that by S-0-1023 and S-0-1032.

mod build;
pub mod config;
pub mod connection;
mod cycle;
pub mod event;
pub mod foreign;
mod frames;
pub mod hot_plug;
mod isolation;
pub mod layout;
mod measure;
pub mod phase;
mod plan;
mod redundancy;
pub mod report;
mod scan;
mod startup;
pub mod station;
pub mod svc;
pub mod topology;

use std::collections::VecDeque;

use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

use self::config::{ConfigError, Connections, MasterConfig};
use self::connection::Consumer;
use self::event::{Event, Output, Port, Refusal, SlaveId, Statistics, Ticket};
use self::foreign::{Foreign, OtherMaster};
use self::frames::Frames;
use self::hot_plug::Admission;
use self::isolation::Isolation;
use self::layout::CyclicLayout;
use self::measure::Measuring;
use self::phase::{PhaseEvent, State};
use self::redundancy::Redundancy;
use self::report::ReportRow;
use self::scan::Scan;
use self::station::{End, Facts, Presence, Station};
use self::svc::request::SvcOperation;
use self::svc::request::SvcRequest;
use self::topology::Topology;
use crate::wire::data_status::DataStatus;
use crate::wire::device_status::DeviceStatus;
use crate::wire::header::{Kind, Phase};
use crate::wire::idn::Idn;

/// Events kept until they are taken; later ones are dropped and counted.
pub const EVENTS_MAX: usize = 1024;

/// Why a service channel request was not taken. It is given back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
pub enum SubmitError {
    /// There is no such slave, or it is lost or excluded.
    #[error("no such slave takes part")]
    NoSlave,
    /// The network is below CP2.
    #[error("service channels exist from CP2 on")]
    Phase,
    /// All places of the slave are taken.
    #[error("the slave's queue is full")]
    Full,
}

/// Why a call of the application does not fit the state of the master.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CallError {
    /// The master is not waiting for the application, or not in the phase for this.
    #[error("not possible in this state")]
    State,
    /// There is no such slave.
    #[error("no such slave")]
    NoSlave,
    /// The connections are not acceptable.
    #[error(transparent)]
    Config(#[from] ConfigError),
}

/// What is known of a slave.
#[derive(Debug, Clone, Copy)]
pub struct SlaveInfo<'a> {
    /// The slave.
    pub id: SlaveId,
    /// SERCOS address, 0 when none is set.
    pub address: u16,
    /// Whether it stands in the configuration.
    pub configured: bool,
    /// Whether it takes part.
    pub presence: Presence,
    /// S-DEV of the last cycle, `None` when its AT did not come.
    pub status: Option<DeviceStatus>,
    /// What it said about itself in CP2.
    pub facts: &'a Facts,
}

/// The master of a network.
#[derive(Debug)]
pub struct Master {
    config: MasterConfig,
    state: State,
    target: Option<Phase>,
    /// The phase whose telegrams are on the wire; stays through `Down`.
    layout_phase: Phase,
    cycle_count: u8,
    frames: Frames,
    /// The frames that are out have been evaluated.
    evaluated: bool,
    scan: Scan,
    redundancy: Redundancy,
    isolation: Isolation,
    admission: Admission,
    measuring: Measuring,
    foreign: Foreign,
    heard: Option<OtherMaster>,
    /// Slaves in a stable scan that has not been taken over yet.
    scan_ready: Option<u16>,
    stations: Vec<Station>,
    /// Those that turn telegrams round in this cycle.
    turning: Vec<u16>,
    /// Slaves found by the last scan, and places kept for others.
    found: usize,
    /// Those of them that the scan has found.
    scanned: usize,
    layout: CyclicLayout,
    /// Start of the present state.
    since: MonotonicTime,
    /// Cycles sent in the present state.
    cycles: u32,
    /// The slaves meet the condition of the present state.
    condition: bool,
    /// No slave inserted data in the cycle before.
    left_before: bool,
    proceed: bool,
    next_cycle: MonotonicTime,
    /// When the frames that are built go out.
    send_at: MonotonicTime,
    /// The frames of the last cycle were built and left out: nothing can have come back.
    left_out: bool,
    system_time: Option<SystemTime>,
    /// The system time sent, latched for eight cycles, and its toggle.
    latched_time: Option<(SystemTime, bool)>,
    events: VecDeque<Event>,
    next_outcome: usize,
    statistics: Statistics,
}

impl Master {
    /// A master that sends nothing until a phase is set as the target, and then listens first ([`foreign::LISTEN`]).
    pub fn new(config: MasterConfig) -> Result<Master, ConfigError> {
        config.check()?;
        let slaves = usize::from(config.slaves_max);
        Ok(Master {
            state: State::Nrt,
            target: None,
            layout_phase: Phase::CP0,
            cycle_count: 0,
            frames: Frames::new(config.mac, config.ports),
            evaluated: true,
            scan: Scan::new(config.stable_cycles, config.scan_timeout_cycles),
            redundancy: Redundancy::new(config.ports, slaves),
            isolation: Isolation::default(),
            admission: Admission::new(&config),
            measuring: Measuring::default(),
            foreign: Foreign::default(),
            heard: None,
            scan_ready: None,
            stations: (0..slaves).map(|_| Station::new(&config)).collect(),
            turning: Vec::with_capacity(slaves),
            found: 0,
            scanned: 0,
            layout: CyclicLayout::with_capacity(slaves),
            since: MonotonicTime::ZERO,
            cycles: 0,
            condition: false,
            left_before: false,
            proceed: false,
            next_cycle: MonotonicTime::ZERO,
            send_at: MonotonicTime::ZERO,
            left_out: false,
            system_time: None,
            latched_time: None,
            events: VecDeque::with_capacity(EVENTS_MAX),
            next_outcome: 0,
            statistics: Statistics::default(),
            config,
        })
    }

    /// Sets the phase to go to, 0..=4. A lower phase than the present one, or a second start after a failure, goes
    /// by way of CP0. Values above CP4 mean CP4.
    pub fn set_target_phase(&mut self, phase: Phase) {
        self.target = Some(Phase(phase.0.min(Phase::CP4.0)));
    }

    /// Ends the telegrams, by way of CP0.
    pub fn stop(&mut self) {
        self.target = None;
    }

    /// The phase to go to; `None` for no telegrams. A failed phase-up sets it to CP0.
    #[must_use]
    pub fn target_phase(&self) -> Option<Phase> {
        self.target
    }

    /// Where the master is.
    #[must_use]
    pub fn state(&self) -> State {
        self.state
    }

    /// The phase whose telegrams are on the wire, `None` without telegrams.
    #[must_use]
    pub fn phase(&self) -> Option<Phase> {
        self.state.phase().or((self.state == State::Down).then_some(self.layout_phase))
    }

    /// The application is through with CP2 or CP3. Its service channel requests are finished first.
    pub fn proceed(&mut self) -> Result<(), CallError> {
        if self.state.awaits().is_none() {
            return Err(CallError::State);
        }
        self.proceed = true;
        Ok(())
    }

    /// The application is through with a slave that it was told of by [`Event::HotPlugAwaits`]. Its service channel
    /// requests are finished first.
    pub fn proceed_hot_plug(&mut self, slave: SlaveId) -> Result<(), CallError> {
        if self.state == State::Cp4 && self.admission.proceed(slave) { Ok(()) } else { Err(CallError::State) }
    }

    /// When to call [`Master::poll`] next; `None` when nothing will happen by itself.
    #[must_use]
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        if self.frames.has_transmit() {
            return Some(self.send_at);
        }
        let begins = self.state == State::Nrt && self.target.is_some();
        let ends = self.state.listens() && self.target.is_none();
        if begins || ends {
            return Some(MonotonicTime::ZERO);
        }
        (self.state != State::Nrt).then_some(self.next_cycle)
    }

    /// The instant on the grid at which the next cycle begins that is not built yet; `None` outside of CP4, where values are
    /// transmitted.
    #[must_use]
    pub fn next_cycle(&self) -> Option<MonotonicTime> {
        (self.state == State::Cp4).then_some(self.next_cycle)
    }

    /// Builds the frames of the next cycle ahead of its instant; [`Master::poll`] gives them when that has come. To be called
    /// when everything of the cycle before has come back and all values are committed. Outside of CP4 nothing is built ahead.
    pub fn prepare(&mut self) {
        if self.state == State::Cp4 && !self.frames.has_transmit() {
            self.cycle(self.next_cycle);
        }
    }

    /// Leaves out what could only go out late, by more than half a cycle, in CP4: frames that are built, and cycles that are not.
    /// A late MST would be near the next one, and no slave takes it for this cycle's. The grid stays where it is.
    pub fn skip_late(&mut self, now: MonotonicTime) {
        if self.state != State::Cp4 {
            return;
        }
        let cycle = self.cycle_time();
        let late = |at: MonotonicTime| now.since(at).as_nanos() > cycle.as_nanos() / 2;
        if self.frames.has_transmit() && late(self.send_at) {
            self.frames.discard();
            self.left_out = true;
            self.statistics.skipped += 1;
        }
        if !self.frames.has_transmit() && late(self.next_cycle) {
            let behind = now.since(self.next_cycle).as_nanos() + cycle.as_nanos() / 2;
            let missed = (behind / cycle.as_nanos()).max(1);
            self.next_cycle = self.next_cycle + cycle * missed;
            self.statistics.skipped += missed.unsigned_abs();
        }
    }

    /// Starts the next cycle when its time has come, and gives its frames one by one; those that were built ahead at their
    /// instant.
    pub fn poll(&mut self, now: MonotonicTime) -> Option<Output<'_>> {
        if !self.frames.has_transmit() {
            let due = self.wake_at().is_some_and(|at| now >= at);
            if due {
                self.cycle(now);
            }
        }
        if now < self.send_at {
            return None;
        }
        self.frames.next_transmit().map(|(port, frame)| Output::Transmit { port, frame })
    }

    /// Takes a frame from the network. A refused one changes nothing; it is counted by its reason.
    pub fn handle_frame(&mut self, now: MonotonicTime, port: Port, frame: &[u8]) -> Result<(), Refusal> {
        let (redundancy, isolating) = (&self.redundancy, self.isolation.is_busy());
        match self.frames.receive(port, frame, |route| redundancy.admits(route, isolating)) {
            Ok(kind) => {
                self.statistics.accepted += 1;
                if kind == Kind::At && !self.evaluated && self.is_complete() {
                    self.evaluate(now);
                }
                Ok(())
            }
            Err(reason) => {
                let reason = self.hear(now, port, frame, reason);
                self.statistics.count_refusal(reason);
                Err(reason)
            }
        }
    }

    /// Whether all ATs of the present cycle are back and taken over.
    #[must_use]
    pub fn cycle_complete(&self) -> bool {
        self.evaluated
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<Event> {
        if let Some(event) = self.events.pop_front() {
            return Some(event);
        }
        // Each in its turn, those that were there before the last scan as well.
        for index in (self.next_outcome..self.stations.len()).chain(0..self.next_outcome) {
            let channel = &mut self.stations[index].channel;
            if channel.has_outcome()
                && let Some((place, serial, outcome)) = channel.take_outcome()
            {
                self.next_outcome = index + 1;
                let ticket = Ticket { slave: SlaveId::from_index(index), place, serial };
                return Some(Event::Svc { ticket, outcome });
            }
        }
        None
    }

    /// The slaves of the last scan in the order of the line, then those that have come in by hot plug since.
    pub fn slaves(&self) -> impl Iterator<Item = SlaveInfo<'_>> {
        let stations = self.stations[..self.found].iter().enumerate();
        let there = stations.filter(|(_, station)| station.presence != Presence::Absent);
        there.map(|(index, station)| SlaveInfo {
            id: SlaveId::from_index(index),
            address: station.address,
            configured: station.configured,
            presence: station.presence,
            status: station.status,
            facts: &station.facts,
        })
    }

    /// One slave.
    #[must_use]
    pub fn slave(&self, slave: SlaveId) -> Option<SlaveInfo<'_>> {
        self.slaves().find(|info| info.id == slave)
    }

    /// The first slave with this SERCOS address.
    #[must_use]
    pub fn slave_by_address(&self, address: u16) -> Option<SlaveId> {
        self.slaves().find(|slave| slave.address == address).map(|slave| slave.id)
    }

    fn station(&mut self, slave: SlaveId) -> Option<&mut Station> {
        self.stations[..self.found].get_mut(slave.index())
    }

    /// Replaces the connections of a slave. Possible while the master awaits the application in CP2, or for this slave
    /// in [`Event::HotPlugAwaits`] of CP2.
    pub fn set_connections(&mut self, slave: SlaveId, connections: Connections) -> Result<(), CallError> {
        let joining = self.admission.awaits(slave) == Some(Phase::CP2);
        if !joining && (self.state != State::Await2 || self.proceed) {
            return Err(CallError::State);
        }
        let cycle_ns = self.config.cycle_ns;
        let station = self.station(slave).ok_or(CallError::NoSlave)?;
        config::check_connections(station.address, &connections, cycle_ns)?;
        station.connections = connections;
        Ok(())
    }

    /// Leaves a slave out from now on, until the next scan. Possible while the master awaits the application. A slave
    /// that is on its way in by hot plug is not let in.
    pub fn exclude(&mut self, slave: SlaveId) -> Result<(), CallError> {
        if self.state == State::Cp4 && self.admission.turn_away(slave) {
            return Ok(());
        }
        if self.state.awaits().is_none() {
            return Err(CallError::State);
        }
        let station = self.station(slave).ok_or(CallError::NoSlave)?;
        station.presence = Presence::Excluded;
        station.channel.abort(svc::request::SvcFailure::SlaveLost);
        self.admission.count_anew();
        Ok(())
    }

    /// Hands a request to a slave's service channel, from CP2 on. Its outcome comes as [`Event::Svc`].
    #[allow(clippy::result_large_err, reason = "the request goes back with the caller's buffer")]
    pub fn svc_submit(
        &mut self,
        slave: SlaveId,
        request: SvcRequest,
    ) -> Result<Ticket, (SubmitError, SvcRequest)> {
        if self.phase().is_none_or(|phase| phase < Phase::CP2) && !self.between_phases() {
            return Err((SubmitError::Phase, request));
        }
        let Some(station) = self.station(slave).filter(|station| station.is_served()) else {
            return Err((SubmitError::NoSlave, request));
        };
        match station.channel.submit(request) {
            Ok((place, serial)) => Ok(Ticket { slave, place, serial }),
            Err(request) => Err((SubmitError::Full, request)),
        }
    }

    /// How far a request is: the data status which the slave gave last, that of a procedure command as long as it is
    /// in process. `None` while it waits, and once it has ended.
    #[must_use]
    pub fn svc_progress(&self, ticket: Ticket) -> Option<DataStatus> {
        let station = self.stations[..self.found].get(ticket.slave.index())?;
        station.channel.progress(ticket.place, ticket.serial)
    }

    /// Between CP2 and CP3 requests wait.
    fn between_phases(&self) -> bool {
        self.state == State::Silence3
    }

    /// The values which a slave consumes on this connection, without C-CON, for the next commit. Exists from the
    /// moment the layout is known.
    pub fn producer(&mut self, slave: SlaveId, instance: u8) -> Option<&mut [u8]> {
        match self.station(slave)?.end(instance)? {
            End::Producer(end) => Some(end.data()),
            End::Consumer(_) => None,
        }
    }

    /// Sends the values with the next cycle: C-CON ready, toggled and counted. Has an effect in CP4 only; `false`
    /// when there is no such producer.
    pub fn commit(&mut self, slave: SlaveId, instance: u8) -> bool {
        let cp4 = self.state == State::Cp4;
        match self.station(slave).and_then(|station| station.end(instance)) {
            Some(End::Producer(end)) if cp4 => {
                end.commit();
                true
            }
            _ => false,
        }
    }

    /// Takes readiness back: the slave does not accept values until the next commit.
    pub fn withdraw(&mut self, slave: SlaveId, instance: u8) {
        if let Some(End::Producer(end)) = self.station(slave).and_then(|station| station.end(instance)) {
            end.withdraw();
        }
    }

    /// What a slave produces on this connection.
    #[must_use]
    pub fn consumer(&self, slave: SlaveId, instance: u8) -> Option<Consumer<'_>> {
        let station = self.stations[..self.found].get(slave.index())?;
        let index = station.connections.iter().position(|connection| connection.instance == instance)?;
        match station.ends.get(index)? {
            End::Consumer(end) => Some(end.view()),
            End::Producer(_) => None,
        }
    }

    /// Starts a consumer again after an error.
    pub fn reset_consumer(&mut self, slave: SlaveId, instance: u8) {
        if let Some(End::Consumer(end)) = self.station(slave).and_then(|station| station.end(instance)) {
            end.reset();
        }
    }

    /// System time at the start of the next cycle for the extended field of MDT0; `None` sends none. Whether the
    /// field is used is told to the slaves when CP3 is prepared.
    pub fn set_system_time(&mut self, time: Option<SystemTime>) {
        self.system_time = time;
    }

    /// What was read from and written to a slave on the way up.
    #[must_use]
    pub fn report(&self, slave: SlaveId) -> &[ReportRow] {
        self.stations[..self.found]
            .get(slave.index())
            .map(|station| station.report.as_slice())
            .unwrap_or_default()
    }

    /// Telegrams and times of CP3 and CP4, once computed.
    #[must_use]
    pub fn layout(&self) -> &CyclicLayout {
        &self.layout
    }

    /// What the network is: found by the scan, and watched from then on. A master with one port knows only lines.
    #[must_use]
    pub fn topology(&self) -> Topology {
        self.redundancy.topology()
    }

    /// What the master waits for: the first slave with a request on its service channel, and which one.
    #[must_use]
    pub fn waits_for(&self) -> Option<(SlaveId, Idn, SvcOperation)> {
        let stations =
            self.stations[..self.found].iter().enumerate().filter(|(_, station)| station.is_active());
        let mut busy = stations.filter_map(|(index, station)| {
            let (idn, operation) = station.channel.request()?;
            Some((SlaveId::from_index(index), idn, operation))
        });
        busy.next()
    }

    /// Counters.
    #[must_use]
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// The configuration.
    #[must_use]
    pub fn config(&self) -> &MasterConfig {
        &self.config
    }

    fn emit(&mut self, event: Event) {
        push(&mut self.events, &mut self.statistics, event);
    }

    /// The cycle time of the telegrams on the wire.
    fn cycle_time(&self) -> DurationNs {
        let cyclic = self.layout_phase >= Phase::CP3;
        DurationNs(i64::from(if cyclic { self.config.cycle_ns } else { self.config.setup_cycle_ns }))
    }

    /// Moves on by `event`; `false` when it means nothing in this state.
    fn advance(&mut self, now: MonotonicTime, event: PhaseEvent) -> bool {
        let Some(next) = self.state.next(event) else {
            return false;
        };
        let last = core::mem::replace(&mut self.state, next);
        self.since = now;
        self.cycles = 0;
        self.condition = false;
        self.left_before = false;
        self.proceed = false;
        if next.announces().is_some() || next.phase().is_none() {
            self.reset_isolation();
        }
        self.enter(now, last);
        true
    }
}

/// Keeps an event while there is room.
fn push(events: &mut VecDeque<Event>, statistics: &mut Statistics, event: Event) {
    if events.len() < EVENTS_MAX {
        events.push_back(event);
    } else {
        statistics.events_lost += 1;
    }
}

#[cfg(test)]
mod tests;
