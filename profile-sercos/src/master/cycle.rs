//! One cycle: evaluate what came back and move on.

use profile_generic::time::{DurationNs, MonotonicTime};

use super::Master;
use super::build::slot;
use super::event::{Event, HotPlugRefusal, SlaveId};
use super::phase::{PhaseEvent, State};
use super::scan::{self, ScanResult, Survey};
use super::station::{End, Presence, Station};
use super::svc::request::SvcFailure;
use super::topology::{Route, Topology};
use crate::wire::cp0::AtRepr;
use crate::wire::device_control::Topology as Loop;
use crate::wire::device_status::DeviceStatus;
use crate::wire::header::{Kind, Phase};
use crate::wire::layout::DEVICE_WORD_LEN;
use crate::wire::svc::{AtSvc, SVC_LEN, SvcStatus};
use profile_generic::wire::u16_at;

/// Cycles with CPS set, at least; CP4 may have connections between slaves, which need one more.
const LEAVE_CYCLES: u32 = 2;
const LEAVE_CYCLES_CP3: u32 = 3;
/// Cycles in a row in which a lost slave has to be valid before it takes part again: a bad contact lets one through now and
/// then.
const RETURN_CYCLES: u16 = 10;
/// States which one cycle can pass at most; more would be a loop in the table.
const STATES_PER_CYCLE: usize = 8;

impl Master {
    /// Runs one cycle; its time has come.
    pub(super) fn cycle(&mut self, now: MonotonicTime) {
        if self.state == State::Nrt {
            self.advance(now, PhaseEvent::Up);
            return;
        }
        let left_out = core::mem::take(&mut self.left_out);
        if (self.state.phase().is_some() || self.state == State::Down) && !left_out {
            if !self.evaluated {
                self.statistics.at_missing += u64::from(!self.is_complete());
                self.evaluate(now);
            }
            self.end_cycle();
        }
        for _ in 0..STATES_PER_CYCLE {
            let moved = self.decide(now).is_some_and(|event| self.advance(now, event));
            if !moved {
                break;
            }
        }
        if self.state.phase().is_none() && self.state != State::Down {
            return;
        }
        self.build();
        self.send_at = now;
        self.schedule(now);
    }

    /// Sets the time of the next cycle on the grid of the present one; cycles that are over are left out.
    fn schedule(&mut self, now: MonotonicTime) {
        let cycle = self.cycle_time();
        self.next_cycle = self.next_cycle + cycle;
        let late = now - self.next_cycle;
        if late >= DurationNs::ZERO {
            let missed = late.as_nanos() / cycle.as_nanos() + 1;
            self.next_cycle = self.next_cycle + cycle * missed;
            self.statistics.skipped += missed.unsigned_abs();
        }
    }

    /// What the present state asks for; also starts work that goes on in the slaves.
    fn decide(&mut self, now: MonotonicTime) -> Option<PhaseEvent> {
        if let Some(event) = self.wants_down() {
            return Some(event);
        }
        if self.isolation.is_busy() {
            // Who is not heard now will be, or not, in a few cycles.
            return None;
        }
        let target = self.target.unwrap_or(Phase::CP0);
        match self.state {
            State::Nrt | State::Cp4 => None,
            State::Listen | State::Occupied => self.decide_listen(now),
            State::Silence0 | State::Silence1 | State::Silence2 | State::Silence3 => {
                (now >= self.next_cycle).then_some(PhaseEvent::Elapsed)
            }
            State::Settle => (now - self.since >= self.config.settle).then_some(PhaseEvent::Elapsed),
            State::Scan => self.scan_ready.map(|_| PhaseEvent::Ready),
            State::Cp0 if self.condition => Some(PhaseEvent::Failed),
            State::Cp0 => {
                let known = self.scanned > 0;
                (known && target > Phase::CP0).then_some(PhaseEvent::Up)
            }
            State::Cp1 => (target > Phase::CP1).then_some(PhaseEvent::Up),
            State::Leave0 | State::Leave1 | State::Leave2 | State::Leave3 | State::Down => {
                self.decide_leave(now)
            }
            State::Identify | State::OpenSvc | State::Start2 | State::Start3 | State::Start4 => {
                self.decide_start(now)
            }
            State::Await2 => self.decide_await(target > Phase::CP2),
            State::Await3 => self.decide_await(target > Phase::CP3),
            State::Read2
            | State::Connect2
            | State::Write2
            | State::Measure2
            | State::Check2
            | State::Check3 => self.decide_work(),
        }
    }

    /// A lower phase is wanted, or no telegrams.
    fn wants_down(&self) -> Option<PhaseEvent> {
        let level = match self.state {
            State::Silence1 => Phase::CP1,
            State::Silence2 => Phase::CP2,
            State::Silence3 => Phase::CP3,
            state => state.phase().unwrap_or(Phase::CP0),
        };
        match self.target {
            Some(target) => (target < level).then_some(PhaseEvent::Restart),
            None if level > Phase::CP0 => Some(PhaseEvent::Restart),
            None => (self.state != State::Down && self.state != State::Nrt).then_some(PhaseEvent::Stop),
        }
    }

    fn decide_leave(&mut self, now: MonotonicTime) -> Option<PhaseEvent> {
        let cycles = if self.state == State::Leave3 { LEAVE_CYCLES_CP3 } else { LEAVE_CYCLES };
        if self.cycles >= cycles && self.condition {
            return Some(PhaseEvent::Ready);
        }
        if now - self.since < self.config.switch_timeout {
            return None;
        }
        let to = self.state.announces().unwrap_or(Phase::CP0);
        let laggard =
            (0..self.found).find(|&index| self.stations[index].is_active() && !self.has_left(index));
        let slave = laggard.filter(|_| self.layout_phase > Phase::CP0).map(SlaveId::from_index);
        self.emit(Event::SwitchFailed { from: self.layout_phase, to, slave });
        if self.state == State::Down {
            return Some(PhaseEvent::Elapsed);
        }
        self.target = Some(Phase::CP0);
        Some(PhaseEvent::Failed)
    }

    /// Waits for the slaves; those that do not come in time are lost, the others go on.
    fn decide_start(&mut self, now: MonotonicTime) -> Option<PhaseEvent> {
        if self.cycles > 0 && self.condition {
            return Some(PhaseEvent::Ready);
        }
        if now - self.since < self.config.switch_timeout {
            return None;
        }
        for index in 0..self.found {
            if self.stations[index].is_active() && !self.meets(index) {
                self.lose(index);
            }
        }
        if self.stations[..self.found].iter().any(Station::is_active) {
            return Some(PhaseEvent::Ready);
        }
        self.all_lost();
        Some(PhaseEvent::Failed)
    }

    /// Takes what the ATs of this cycle say.
    pub(super) fn evaluate(&mut self, now: MonotonicTime) {
        self.evaluated = true;
        if self.layout_phase == Phase::CP0 {
            self.evaluate_scan();
            return;
        }
        self.turning.clear();
        for index in 0..self.found {
            self.read_station(index);
            let turns = self.valid_status(index).is_some_and(|status| match status.topology() {
                Loop::LoopbackForwardPrimary | Loop::LoopbackForwardSecondary => true,
                Loop::FastForward | Loop::StoreAndForward => false,
            });
            if turns {
                self.turning.push(SlaveId::from_index(index).0);
            }
        }
        if self.state.supervises() {
            self.supervise();
        }
        self.condition = match self.state {
            State::Leave1 | State::Leave2 | State::Leave3 | State::Down => self.all_have_left(),
            State::Cp4 => true,
            _ => (0..self.found).all(|index| !self.stations[index].is_active() || self.meets(index)),
        };
        if self.state.serves() {
            for station in self.stations[..self.found].iter_mut().filter(|station| station.is_served()) {
                let answer = station.svc;
                if let Some(status) = station.status {
                    station.channel.command_change(status.contains(DeviceStatus::COMMAND_CHANGE));
                }
                station.channel.receive(now, answer);
            }
        }
        if self.layout_phase == Phase::CP4 {
            self.consume();
        }
    }

    fn evaluate_scan(&mut self) {
        let ats = Route::ALL.map(|route| self.frames.at(route, 0).and_then(|data| AtRepr::parse(data).ok()));
        let survey = Survey::of(&ats, self.scan.start_two());
        match self.state {
            // Counted from the first cycle on; what comes out is looked at when the slaves have had their time.
            State::Settle => {
                let _ = self.scan.update(survey);
            }
            State::Scan => match self.scan.update(survey) {
                ScanResult::Going => {}
                ScanResult::Nobody => self.emit(Event::NoSlaves),
                ScanResult::Unstable => self.emit(Event::ScanUnstable),
                ScanResult::Stable(slaves) if slaves > self.config.slaves_max => {
                    self.emit(Event::TooManySlaves { found: slaves, max: self.config.slaves_max });
                    self.scan.start();
                }
                ScanResult::Stable(slaves) => self.scan_ready = Some(slaves),
            },
            State::Cp0 => self.condition = self.scan.has_changed(survey.as_ref()),
            State::Leave0 | State::Down => {
                let mut back = ats.iter().flatten();
                self.condition = ats.iter().any(Option::is_some) && back.all(scan::is_untouched);
            }
            _ => {}
        }
    }

    /// Whether the ATs that have come back have the data of every slave.
    pub(super) fn is_complete(&mut self) -> bool {
        if let Some(complete) = self.search_is_complete() {
            return complete;
        }
        let back = |route: &Route| self.frames.all_back(Kind::At, *route);
        let scanned = self.scan.survey().map_or(&[][..], |survey| survey.topology.routes());
        let routes = match self.layout_phase {
            Phase::CP0 if self.redundancy.is_fixed() => self.redundancy.topology().routes(),
            Phase::CP0 => scanned,
            _ => self.redundancy.topology().routes(),
        };
        if !routes.is_empty() && routes.iter().all(back) {
            return true;
        }
        // In a ring one of the two copies is enough.
        let whole =
            self.layout_phase > Phase::CP0 && !self.redundancy.is_fixed() && Route::ALL.iter().any(back);
        whole
            && (0..self.found).all(|index| {
                self.read_station(index);
                let station = &self.stations[index];
                match station.presence {
                    Presence::Active => self.is_valid(station),
                    // It has nothing but a service channel yet.
                    Presence::Joining => station.svc.is_some_and(|svc| svc.status.contains(SvcStatus::VALID)),
                    Presence::Lost | Presence::Excluded | Presence::Absent => true,
                }
            })
    }

    /// Takes a slave's part of the ATs. Of the copies that a ring gives, a valid one counts, then one into which the
    /// slave has put anything at all.
    fn read_station(&mut self, index: usize) {
        let slot = slot(self.layout_phase, &self.layout, index, Kind::At);
        let mut best = (0, None, None);
        let mut valid_routes = 0;
        for &route in self.redundancy.possible_routes() {
            let part = |(telegram, offset): (u8, usize), len: usize| {
                self.frames.at(route, telegram).and_then(|data| data.get(offset..offset + len))
            };
            let svc =
                slot.and_then(|slot| part(slot.svc, SVC_LEN)).and_then(|bytes| AtSvc::parse(bytes).ok());
            let status = slot
                .and_then(|slot| part(slot.device, DEVICE_WORD_LEN))
                .map(|bytes| DeviceStatus::from_bits_retain(u16_at(bytes, 0)));
            let inserted = status.is_some_and(|status| !status.is_empty())
                || svc.is_some_and(|svc| svc.status.contains(SvcStatus::VALID));
            let rank = match status {
                Some(status) if self.shows_valid(status) => 3,
                _ if inserted => 2,
                Some(_) => 1,
                None => 0,
            };
            if rank == 3 {
                valid_routes |= 1 << route.index();
            }
            if rank > best.0 {
                best = (rank, status, svc);
            }
        }
        let station = &mut self.stations[index];
        (station.status, station.svc) = (best.1, best.2);
        station.valid_routes = valid_routes;
    }

    /// The status of a slave that is there, in this cycle.
    pub(super) fn valid_status(&self, index: usize) -> Option<DeviceStatus> {
        self.stations.get(index)?.status.filter(|&status| self.shows_valid(status))
    }

    /// A slave is there: S-DEV is not empty in CP2, SlaveValid in the other phases.
    pub(super) fn is_valid(&self, station: &Station) -> bool {
        station.status.is_some_and(|status| self.shows_valid(status))
    }

    fn shows_valid(&self, status: DeviceStatus) -> bool {
        match self.layout_phase {
            Phase::CP2 => !status.is_empty(),
            _ => status.contains(DeviceStatus::SLAVE_VALID),
        }
    }

    /// A slave meets the condition of the present state.
    fn meets(&self, index: usize) -> bool {
        let station = &self.stations[index];
        let svc = station.svc.unwrap_or_default().status;
        let handshake = svc.contains(SvcStatus::AHS) == station.channel.mhs();
        let svc_valid = svc.contains(SvcStatus::VALID);
        self.is_valid(station)
            && match self.state {
                State::Identify => svc_valid,
                State::OpenSvc | State::Start2 | State::Start3 => svc_valid && handshake,
                _ => true,
            }
    }

    /// A slave has stopped inserting data for the phase that is left.
    fn has_left(&self, index: usize) -> bool {
        let station = &self.stations[index];
        match self.layout_phase {
            Phase::CP1 => {
                station.svc.is_some_and(|svc| !svc.status.intersects(SvcStatus::VALID | SvcStatus::AHS))
            }
            Phase::CP2 => station.status.is_some_and(|status| status.is_empty()),
            _ => station.status.is_some_and(|status| !status.contains(DeviceStatus::SLAVE_VALID)),
        }
    }

    /// With two ports twice in a row: in the first cycle the copy into which a slave still writes may be lost.
    fn all_have_left(&mut self) -> bool {
        let left = (0..self.found).all(|index| !self.stations[index].is_active() || self.has_left(index));
        let before = core::mem::replace(&mut self.left_before, left);
        left && (before || self.redundancy.is_fixed())
    }

    fn supervise(&mut self) {
        let excused = self.excuses_silence();
        for index in 0..self.found {
            let valid = self.is_valid(&self.stations[index]);
            let allowed = self.config.slave_valid_misses;
            let station = &mut self.stations[index];
            let conditions = station.status.map(|status| status.intersection(DeviceStatus::CONDITIONS));
            if let Some(status) = conditions.filter(|&status| valid && status != station.told) {
                station.told = status;
                let event = Event::DeviceStatus { slave: SlaveId::from_index(index), status };
                super::push(&mut self.events, &mut self.statistics, event);
            }
            match station.presence {
                Presence::Active if valid => station.misses = 0,
                Presence::Active if excused => {}
                Presence::Active => {
                    station.misses = station.misses.saturating_add(1);
                    if station.misses > allowed {
                        self.lose(index);
                    }
                }
                Presence::Lost if valid && self.state == State::Cp4 => {
                    station.valid_cycles = station.valid_cycles.saturating_add(1);
                    if station.valid_cycles >= RETURN_CYCLES {
                        self.take_back(index);
                    }
                }
                Presence::Lost => station.valid_cycles = 0,
                Presence::Excluded | Presence::Absent | Presence::Joining => {}
            }
        }
        if !self.stations[..self.found].iter().any(Station::is_active) && !self.may_recover() {
            self.all_lost();
        }
    }

    pub(super) fn lose(&mut self, index: usize) {
        let station = &mut self.stations[index];
        station.presence = Presence::Lost;
        station.valid_cycles = 0;
        self.admission.count_anew();
        station.channel.abort(SvcFailure::SlaveLost);
        let address = station.address;
        let slave = SlaveId::from_index(index);
        self.emit(Event::SlaveLost { slave, address, phase: self.layout_phase });
    }

    /// A lost slave is valid again. One that had gone to NRT could not be: it is as it was, and takes part again.
    fn take_back(&mut self, index: usize) {
        let station = &mut self.stations[index];
        station.presence = Presence::Active;
        station.misses = 0;
        for end in &mut station.ends {
            if let End::Consumer(end) = end {
                end.reset();
            }
        }
        self.admission.count_anew();
        self.emit(Event::SlaveReturned { slave: SlaveId::from_index(index) });
    }

    fn all_lost(&mut self) {
        if self.target != Some(Phase::CP0) {
            self.target = Some(Phase::CP0);
            self.emit(Event::AllSlavesLost);
        }
    }

    fn consume(&mut self) {
        for index in 0..self.found {
            let valid = self.stations[index].is_active() && self.is_valid(&self.stations[index]);
            let Some(Some(places)) = self.layout.slaves.get(index) else { continue };
            let station = &mut self.stations[index];
            for (connection, end) in station.connections.iter().zip(&mut station.ends) {
                let End::Consumer(consumer) = end else { continue };
                let instance = connection.instance;
                let place = places.connections.iter().find(|place| place.instance == instance);
                let routes = station.valid_routes;
                let bytes = place.filter(|_| valid).and_then(|place| {
                    Route::ALL.into_iter().filter(|route| routes & 1 << route.index() != 0).find_map(
                        |route| {
                            let data = self.frames.at(route, place.at.telegram)?;
                            data.get(place.at.range(usize::from(place.len)))
                        },
                    )
                });
                if let Some(state) = consumer.update(bytes) {
                    let event = Event::Connection { slave: SlaveId::from_index(index), instance, state };
                    super::push(&mut self.events, &mut self.statistics, event);
                }
            }
        }
    }

    /// Enters the present state; `last` is the one before.
    pub(super) fn enter(&mut self, now: MonotonicTime, last: State) {
        match self.state {
            State::Nrt => {
                self.frames.silence();
                self.emit(Event::Stopped);
            }
            State::Listen => self.enter_listen(now),
            State::Occupied => self.enter_occupied(now, last),
            State::Silence0 | State::Silence1 | State::Silence2 | State::Silence3 => {
                self.frames.silence();
                self.evaluated = true;
                self.next_cycle = now + self.config.pause;
            }
            State::Settle => {
                self.redundancy.start();
                self.start_phase(Phase::CP0);
                self.scan.start();
            }
            State::Scan => {
                if last != State::Settle {
                    self.scan.start();
                }
                self.scan_ready = None;
            }
            State::Cp0 => self.take_scan(),
            State::Identify => {
                self.start_phase(Phase::CP1);
                self.rest_channels(Some(false));
            }
            State::OpenSvc => self.rest_channels(Some(true)),
            State::Start2 => {
                self.start_phase(Phase::CP2);
                self.rest_channels(None);
            }
            State::Start3 => {
                self.start_phase(Phase::CP3);
                self.rest_channels(None);
            }
            State::Start4 => {
                self.layout_phase = Phase::CP4;
                self.reset_topology_commands();
            }
            State::Cp4 => {
                self.open_channels(true);
                self.emit(Event::Phase(Phase::CP4));
                self.measuring.start(self.redundancy.topology() == Topology::Ring);
            }
            State::Await2 | State::Await3 => self.enter_await(last),
            State::Read2
            | State::Connect2
            | State::Write2
            | State::Measure2
            | State::Check2
            | State::Check3 => {
                self.open_channels(true);
                self.begin_work();
            }
            State::Down => {
                for station in &mut self.stations[..self.found] {
                    station.channel.abort(SvcFailure::PhaseLeft);
                }
                self.open_channels(false);
            }
            State::Cp1 | State::Leave0 | State::Leave1 | State::Leave2 | State::Leave3 => {}
        }
    }

    fn start_phase(&mut self, phase: Phase) {
        self.layout_phase = phase;
        self.reset_topology_commands();
        for station in &mut self.stations[..self.found] {
            station.misses = 0;
        }
        self.emit(Event::Phase(phase));
    }

    fn rest_channels(&mut self, mhs: Option<bool>) {
        for station in &mut self.stations[..self.found] {
            let mhs = mhs.unwrap_or(station.channel.mhs());
            station.channel.rest(mhs);
        }
    }

    pub(super) fn open_channels(&mut self, open: bool) {
        for station in &mut self.stations[..self.found] {
            station.channel.set_open(open);
        }
    }

    /// Makes the slaves of the finished scan known, and keeps places for those that may come later.
    fn take_scan(&mut self) {
        let scanned = usize::from(self.scan_ready.take().unwrap_or(0));
        (self.found, self.scanned) = (scanned, scanned);
        for index in 0..scanned {
            let address = self.scan.address(index);
            let config = self.config.slaves.iter().find(|slave| slave.address == address);
            self.stations[index].found(address, config);
        }
        self.emit(Event::Scanned { slaves: SlaveId::from_index(scanned).0 });
        self.take_topology();
        for index in 0..scanned {
            let (slave, address) = (SlaveId::from_index(index), self.stations[index].address);
            if !self.stations[index].configured {
                self.emit(Event::Unknown { slave, address });
            }
            let first = self.stations[..index].iter().position(|other| other.address == address);
            if let Some(first) = first.filter(|_| address != 0) {
                let first = SlaveId::from_index(first);
                self.emit(Event::DoubleAddress { address, first, second: slave });
            }
        }
        for index in 0..self.config.slaves.len() {
            let slave = &self.config.slaves[index];
            let address = slave.address;
            if self.stations[..scanned].iter().any(|station| station.address == address) {
                continue;
            }
            self.emit(Event::Missing { address });
            let slave = &self.config.slaves[index];
            if slave.hot_plug.is_none() {
                continue;
            }
            if let Some(station) = self.stations.get_mut(self.found) {
                station.found(address, Some(slave));
                station.presence = Presence::Absent;
                self.admission.count_anew();
                self.found += 1;
                self.emit(Event::PlaceKept { address });
            } else {
                let reason = HotPlugRefusal::NoPlace;
                self.emit(Event::HotPlugRefused { address: Some(address), reason });
            }
        }
    }
}
