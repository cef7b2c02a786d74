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
//! soon as the last one of the cycle is back, and if one stays away by [`Master::collect`] or at the start of the next cycle. All frames
//! of a cycle are given at its start, MDTs before ATs: a soft master cannot keep t1 to the nanosecond, and slaves
//! learn of that by S-0-1023 and S-0-1032.

mod build;
pub mod config;
pub mod connection;
mod cycle;
pub mod event;
pub mod foreign;
mod frames;
mod grid;
pub mod hot_plug;
mod isolation;
mod journal;
pub mod layout;
mod measure;
mod network;
pub mod phase;
mod plan;
mod redundancy;
pub mod report;
mod run_up;
mod scan;
mod startup;
pub mod station;
mod stations;
pub mod svc;
pub mod topology;

use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

use self::config::{ConfigError, Connections, MasterConfig};
use self::connection::Consumer;
use self::event::{Event, Output, Port, Refusal, SlaveId, Statistics, Ticket};
use self::foreign::{Foreign, OtherMaster};
use self::grid::Grid;
use self::hot_plug::Admission;
use self::isolation::Isolation;
pub use self::journal::EVENTS_MAX;
use self::layout::CyclicLayout;
use self::measure::Measuring;
use self::network::Network;
use self::phase::{PhaseEvent, State};
use self::report::ReportRow;
use self::run_up::RunUp;
use self::scan::Scan;
use self::station::{End, Facts, Presence, Station};
use self::svc::request::SvcOperation;
use self::svc::request::SvcRequest;
use self::topology::Topology;
use crate::wire::device_status::DeviceStatus;
use crate::wire::header::{Kind, Phase};
use crate::wire::idn::Idn;

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
    net: Network,
    run: RunUp,
    grid: Grid,
    scan: Scan,
    isolation: Isolation,
    admission: Admission,
    measuring: Measuring,
    foreign: Foreign,
}

impl Master {
    /// A master that sends nothing until a phase is set as the target, and then listens first ([`foreign::LISTEN`]).
    pub fn new(config: MasterConfig) -> Result<Master, ConfigError> {
        config.check()?;
        Ok(Master {
            run: RunUp::new(),
            grid: Grid::new(),
            scan: Scan::new(config.stable_cycles, config.scan_timeout_cycles),
            isolation: Isolation::default(),
            admission: Admission::new(&config),
            measuring: Measuring::default(),
            foreign: Foreign::default(),
            net: Network::new(config),
        })
    }

    /// Sets the phase to go to, 0..=4. A lower phase than the present one, or a second start after a failure, goes
    /// by way of CP0. Values above CP4 mean CP4.
    pub fn set_target_phase(&mut self, phase: Phase) {
        self.run.target = Some(Phase(phase.0.min(Phase::CP4.0)));
    }

    /// Ends the telegrams, by way of CP0.
    pub fn stop(&mut self) {
        self.run.target = None;
    }

    /// The phase to go to; `None` for no telegrams. A failed phase-up sets it to CP0.
    #[must_use]
    pub fn target_phase(&self) -> Option<Phase> {
        self.run.target
    }

    /// Where the master is.
    #[must_use]
    pub fn state(&self) -> State {
        self.run.state()
    }

    /// The phase whose telegrams are on the wire, `None` without telegrams.
    #[must_use]
    pub fn phase(&self) -> Option<Phase> {
        self.run.state().phase().or((self.run.state() == State::Down).then_some(self.net.stations.phase))
    }

    /// The application is through with CP2 or CP3. Its service channel requests are finished first.
    pub fn proceed(&mut self) -> Result<(), CallError> {
        if self.run.state().awaits().is_none() {
            return Err(CallError::State);
        }
        self.run.proceed = true;
        Ok(())
    }

    /// The application is through with a slave that it was told of by [`Event::HotPlugAwaits`]. Its service channel
    /// requests are finished first.
    pub fn proceed_hot_plug(&mut self, slave: SlaveId) -> Result<(), CallError> {
        if self.run.state() == State::Cp4 && self.admission.proceed(slave) {
            Ok(())
        } else {
            Err(CallError::State)
        }
    }

    /// When to call [`Master::poll`] next; `None` when nothing will happen by itself.
    #[must_use]
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        if self.net.frames.has_transmit() {
            return Some(self.grid.send_at);
        }
        let begins = self.run.state() == State::Nrt && self.run.target.is_some();
        let ends = self.run.state().listens() && self.run.target.is_none();
        if begins || ends {
            return Some(MonotonicTime::ZERO);
        }
        (self.run.state() != State::Nrt).then_some(self.grid.next_cycle)
    }

    /// The instant on the grid at which the next cycle begins that is not built yet; `None` outside of CP4, where values are
    /// transmitted.
    #[must_use]
    pub fn next_cycle(&self) -> Option<MonotonicTime> {
        (self.run.state() == State::Cp4).then_some(self.grid.next_cycle)
    }

    /// Moves the grid, in CP4 alone: the next cycle that is not built yet begins by so much later. Slaves follow a grid that moves
    /// by a small part of the cycle at a time; a jump would lose them the MST.
    pub fn shift_grid(&mut self, by: DurationNs) {
        if self.run.state() == State::Cp4 {
            self.grid.shift(by);
        }
    }

    /// Takes what has come back of the cycle whose frames are out, also where some of it stays away: the values of a slave do not
    /// wait for those of others. To be called ahead of the next cycle, before the application takes values. Outside of CP4 nothing
    /// is taken before the next cycle begins.
    pub fn collect(&mut self, now: MonotonicTime) {
        if self.run.state() == State::Cp4 && !self.net.frames.has_transmit() && !self.grid.left_out {
            self.evaluate_rest(now);
        }
    }

    /// Builds the frames of the next cycle ahead of its instant; [`Master::poll`] gives them when that has come. To be called
    /// when everything of the cycle before has come back and all values are committed. Outside of CP4 nothing is built ahead.
    pub fn prepare(&mut self) {
        if self.run.state() == State::Cp4 && !self.net.frames.has_transmit() {
            self.cycle(self.grid.next_cycle);
        }
    }

    /// Leaves out what could only go out late, by more than half a cycle, in CP4: frames that are built, and cycles that are not.
    /// A late MST would be near the next one, and no slave takes it for this cycle's. The grid stays where it is. Returns whether
    /// something was left out: values that were committed for it have not been sent.
    pub fn skip_late(&mut self, now: MonotonicTime) -> bool {
        if self.run.state() != State::Cp4 {
            return false;
        }
        let cycle = self.cycle_time();
        let net = &mut self.net;
        let mut skipped = 0;
        if net.frames.has_transmit() && grid::is_late(now, self.grid.send_at, cycle) {
            net.frames.discard();
            self.grid.left_out = true;
            // Slaves count the cycles that they see.
            net.cycle_count = net.cycle_count.wrapping_sub(1) & 7;
            net.time.take_back(net.cycle_count);
            for end in net.stations.iter_mut().flat_map(|station| &mut station.ends) {
                if let End::Producer(producer) = end {
                    producer.take_back();
                }
            }
            skipped += 1;
        }
        if !net.frames.has_transmit() {
            skipped += self.grid.skip_late(now, cycle);
        }
        net.journal.statistics.skipped += skipped;
        skipped > 0
    }

    /// Starts the next cycle when its time has come, and gives its frames one by one; those that were built ahead at their
    /// instant.
    pub fn poll(&mut self, now: MonotonicTime) -> Option<Output<'_>> {
        if !self.net.frames.has_transmit() {
            let due = self.wake_at().is_some_and(|at| now >= at);
            if due {
                self.cycle(now);
            }
        }
        if now < self.grid.send_at {
            return None;
        }
        self.net.frames.next_transmit().map(|(port, frame)| Output::Transmit { port, frame })
    }

    /// Takes a frame from the network. A refused one changes nothing; it is counted by its reason.
    pub fn handle_frame(&mut self, now: MonotonicTime, port: Port, frame: &[u8]) -> Result<(), Refusal> {
        let (redundancy, isolating) = (&self.net.redundancy, self.isolation.is_busy());
        match self.net.frames.receive(port, frame, |route| redundancy.admits(route, isolating)) {
            Ok(kind) => {
                self.net.journal.statistics.accepted += 1;
                if kind == Kind::At && !self.grid.evaluated && self.is_complete() {
                    self.evaluate(now);
                }
                Ok(())
            }
            Err(reason) => {
                let reason = self.hear(now, port, frame, reason);
                self.net.journal.statistics.count_refusal(reason);
                Err(reason)
            }
        }
    }

    /// Whether what has come back of the present cycle is taken over: all ATs, or those that were back at [`Master::collect`].
    #[must_use]
    pub fn cycle_complete(&self) -> bool {
        self.grid.evaluated
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.net.journal.take().or_else(|| self.net.stations.take_outcome())
    }

    /// The slaves of the last scan in the order of the line, then those that have come in by hot plug since.
    pub fn slaves(&self) -> impl Iterator<Item = SlaveInfo<'_>> {
        let stations = self.net.stations.iter().enumerate();
        let there = stations.filter(|(_, station)| station.presence != Presence::Absent);
        there.map(|(index, station)| SlaveInfo {
            id: SlaveId::from_index(index),
            address: station.address,
            configured: station.configured,
            presence: station.presence,
            status: station.link.status,
            facts: &station.facts,
        })
    }

    /// What is known of a slave; `None` without one in this place.
    #[must_use]
    pub fn slave(&self, slave: SlaveId) -> Option<SlaveInfo<'_>> {
        self.slaves().find(|info| info.id == slave)
    }

    /// The first slave with this SERCOS address.
    #[must_use]
    pub fn slave_by_address(&self, address: u16) -> Option<SlaveId> {
        self.slaves().find(|slave| slave.address == address).map(|slave| slave.id)
    }

    /// Whether telegrams get past a slave to others that are heard, in a closed ring or on a line. Hot plug brings no slave in there.
    #[must_use]
    pub fn is_passed(&self, slave: SlaveId) -> bool {
        self.net.is_passed(slave.index())
    }

    /// Replaces the connections of a slave. Possible while the master awaits the application in CP2, or for this slave
    /// in [`Event::HotPlugAwaits`] of CP2.
    pub fn set_connections(&mut self, slave: SlaveId, connections: Connections) -> Result<(), CallError> {
        let joining = self.admission.awaits(slave) == Some(Phase::CP2);
        if !joining && (self.run.state() != State::Await2 || self.run.proceed) {
            return Err(CallError::State);
        }
        let cycle_ns = self.net.config.cycle_ns;
        let station = self.net.stations.get_mut(slave.index()).ok_or(CallError::NoSlave)?;
        config::check_connections(station.address, &connections, cycle_ns)?;
        station.connections = connections;
        Ok(())
    }

    /// Leaves a slave out from now on, until the next scan. Possible while the master awaits the application. A slave
    /// that is on its way in by hot plug is not let in.
    pub fn exclude(&mut self, slave: SlaveId) -> Result<(), CallError> {
        if self.run.state() == State::Cp4 && self.admission.turn_away(slave) {
            return Ok(());
        }
        if self.run.state().awaits().is_none() {
            return Err(CallError::State);
        }
        let station = self.net.stations.get_mut(slave.index()).ok_or(CallError::NoSlave)?;
        station.presence = Presence::Excluded;
        station.channel.abort(svc::request::SvcFailure::SlaveLost);
        self.net.stations.count_anew();
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
        let Some(station) = self.net.stations.get_mut(slave.index()).filter(|station| station.is_served())
        else {
            return Err((SubmitError::NoSlave, request));
        };
        match station.channel.submit(request) {
            Ok((place, serial)) => Ok(Ticket { slave, place, serial }),
            Err(request) => Err((SubmitError::Full, request)),
        }
    }

    /// Between CP2 and CP3 requests wait.
    fn between_phases(&self) -> bool {
        self.run.state() == State::Silence3
    }

    /// The values which a slave consumes on this connection, without C-CON, for the next commit. Exists from the
    /// moment the layout is known.
    pub fn producer(&mut self, slave: SlaveId, instance: u8) -> Option<&mut [u8]> {
        match self.net.stations.get_mut(slave.index())?.end(instance)? {
            End::Producer(end) => Some(end.data()),
            End::Consumer(_) => None,
        }
    }

    /// Sends the values with the next cycle: C-CON ready, toggled and counted. Has an effect in CP4 only; `false`
    /// when there is no such producer.
    pub fn commit(&mut self, slave: SlaveId, instance: u8) -> bool {
        let cp4 = self.run.state() == State::Cp4;
        match self.net.stations.get_mut(slave.index()).and_then(|station| station.end(instance)) {
            Some(End::Producer(end)) if cp4 => {
                end.commit();
                true
            }
            _ => false,
        }
    }

    /// Takes readiness back: the slave does not accept values until the next commit.
    pub fn withdraw(&mut self, slave: SlaveId, instance: u8) {
        if let Some(End::Producer(end)) =
            self.net.stations.get_mut(slave.index()).and_then(|station| station.end(instance))
        {
            end.withdraw();
        }
    }

    /// What a slave produces on this connection.
    #[must_use]
    pub fn consumer(&self, slave: SlaveId, instance: u8) -> Option<Consumer<'_>> {
        let station = self.net.stations.get(slave.index())?;
        let index = station.connections.iter().position(|connection| connection.instance == instance)?;
        match station.ends.get(index)? {
            End::Consumer(end) => Some(end.view()),
            End::Producer(_) => None,
        }
    }

    /// Starts a consumer again after an error.
    pub fn reset_consumer(&mut self, slave: SlaveId, instance: u8) {
        if let Some(End::Consumer(end)) =
            self.net.stations.get_mut(slave.index()).and_then(|station| station.end(instance))
        {
            end.reset();
        }
    }

    /// System time at the start of the next cycle, for the extended field of MDT0; `None` if it is not known. Every eighth cycle
    /// begins to send one, and needs its own. Slaves get it where the configuration says that they do
    /// ([`MasterConfig::system_time`]).
    pub fn set_system_time(&mut self, time: Option<SystemTime>) {
        self.net.time.now = time;
    }

    /// What was read from and written to a slave on the way up.
    #[must_use]
    pub fn report(&self, slave: SlaveId) -> &[ReportRow] {
        self.net
            .stations
            .get(slave.index())
            .map(|station| station.setup.report.as_slice())
            .unwrap_or_default()
    }

    /// Telegrams and times of CP3 and CP4, once computed.
    #[must_use]
    pub fn layout(&self) -> &CyclicLayout {
        &self.net.layout
    }

    /// What the network is: found by the scan, and watched from then on. A master with one port knows only lines.
    #[must_use]
    pub fn topology(&self) -> Topology {
        self.net.redundancy.topology()
    }

    /// What the master waits for: the first slave with a request on its service channel, and which one.
    #[must_use]
    pub fn waits_for(&self) -> Option<(SlaveId, Idn, SvcOperation)> {
        let stations = self.net.stations.iter().enumerate().filter(|(_, station)| station.is_active());
        let mut busy = stations.filter_map(|(index, station)| {
            let (idn, operation) = station.channel.request()?;
            Some((SlaveId::from_index(index), idn, operation))
        });
        busy.next()
    }

    /// Whether lost slaves may be back in a moment: a station that hangs is searched for, or the search has brought slaves back
    /// that have to be valid for some cycles before they count.
    #[must_use]
    pub fn may_recover(&self) -> bool {
        let returning =
            |station: &Station| station.presence == Presence::Lost && station.link.valid_cycles > 0;
        self.isolation.is_busy() || self.net.stations.iter().any(returning)
    }

    /// Another master that sends while this one does, or for which this one waits. `None` when nobody is heard.
    #[must_use]
    pub fn other_master(&self) -> Option<OtherMaster> {
        self.foreign.other(self.run.state())
    }

    /// Leaves the wire to another master: no telegrams any more, not even those towards CP0, until he has been silent for a
    /// while. Nothing when nobody was heard.
    pub fn give_way(&mut self, now: MonotonicTime) {
        if self.other_master().is_some() {
            self.advance(now, PhaseEvent::Foreign);
        }
    }

    /// Counters.
    #[must_use]
    pub fn statistics(&self) -> &Statistics {
        &self.net.journal.statistics
    }

    /// The configuration.
    #[must_use]
    pub fn config(&self) -> &MasterConfig {
        &self.net.config
    }

    /// The cycle time of the telegrams on the wire.
    fn cycle_time(&self) -> DurationNs {
        let cyclic = self.net.stations.phase >= Phase::CP3;
        DurationNs(i64::from(if cyclic { self.net.config.cycle_ns } else { self.net.config.setup_cycle_ns }))
    }
}

#[cfg(test)]
mod tests;
