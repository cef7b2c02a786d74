//! One cycle: evaluate what came back and move on.

use profile_generic::time::MonotonicTime;

use super::Master;
use super::event::{Event, HotPlugRefusal, Port, Refusal, SlaveId};
use super::foreign::{Foreign, LISTEN, is_alien};
use super::isolation::Isolation;
use super::phase::{PhaseEvent, State};
use super::scan::{self, ScanResult, Survey};
use super::startup::Layout;
use super::station::Station;
use super::topology::{Route, Seen, Topology};
use crate::wire::cp0::AtRepr;
use crate::wire::device_control::DeviceControl;
use crate::wire::header::{Header, Kind, Phase};

/// Cycles with CPS set, at least; CP4 may have connections between slaves, which need one more.
const LEAVE_CYCLES: u32 = 2;
const LEAVE_CYCLES_CP3: u32 = 3;
/// States which one cycle can pass at most; more would be a loop in the table.
const STATES_PER_CYCLE: usize = 8;

impl Master {
    /// Runs one cycle; its time has come.
    pub(super) fn cycle(&mut self, now: MonotonicTime) {
        if self.run.state() == State::Nrt {
            self.advance(now, PhaseEvent::Up);
            return;
        }
        let left_out = core::mem::take(&mut self.grid.left_out);
        if self.sends() && !left_out {
            self.evaluate_rest(now);
            self.end_cycle();
        }
        for _ in 0..STATES_PER_CYCLE {
            let moved = self.decide(now).is_some_and(|event| self.advance(now, event));
            if !moved {
                break;
            }
        }
        if !self.sends() {
            return;
        }
        if self.run.state().serves() {
            for station in self.net.stations.iter_mut().filter(|station| station.is_served()) {
                station.channel.kick();
            }
        }
        let in_cp4 = self.net.stations.phase == Phase::CP4;
        let hot_plug = in_cp4.then(|| self.admission.fields(&self.net.config, &self.net.layout)).flatten();
        self.net.build(self.run.state().announces(), &self.scan, hot_plug, &self.isolation);
        self.run.cycles = self.run.cycles.saturating_add(1);
        self.net.journal.statistics.skipped += self.grid.built(now, self.cycle_time());
    }

    /// Telegrams are on the wire.
    fn sends(&self) -> bool {
        self.run.state().phase().is_some() || self.run.state() == State::Down
    }

    /// Moves on by `event`; `false` when it means nothing in this state.
    pub(super) fn advance(&mut self, now: MonotonicTime, event: PhaseEvent) -> bool {
        let Some(last) = self.run.advance(now, event) else { return false };
        let state = self.run.state();
        if state.announces().is_some() || state.phase().is_none() {
            self.isolation = Isolation::default();
        }
        self.enter(now, last);
        true
    }

    /// What the present state asks for; also starts work that goes on in the slaves.
    // Flat: one arm per state.
    fn decide(&mut self, now: MonotonicTime) -> Option<PhaseEvent> {
        if let Some(event) = self.run.wants_down() {
            return Some(event);
        }
        if self.isolation.is_busy() {
            // Who is not heard now will be, or not, in a few cycles.
            return None;
        }
        let (state, target) = (self.run.state(), self.run.wanted());
        match state {
            State::Nrt | State::Cp4 => None,
            State::Listen | State::Occupied => self.decide_listen(now),
            State::Silence0 | State::Silence1 | State::Silence2 | State::Silence3 => {
                (now >= self.grid.next_cycle).then_some(PhaseEvent::Elapsed)
            }
            State::Settle => (self.run.age(now) >= self.net.config.settle).then_some(PhaseEvent::Elapsed),
            State::Scan => self.scan.ready.map(|_| PhaseEvent::Ready),
            State::Cp0 if self.run.condition => Some(PhaseEvent::Failed),
            State::Cp0 => {
                let known = self.net.stations.scanned > 0;
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
            _ => self.decide_work(),
        }
    }

    fn decide_listen(&mut self, now: MonotonicTime) -> Option<PhaseEvent> {
        if now < self.grid.next_cycle {
            return None;
        }
        if self.run.state() == State::Occupied {
            // One that has said so little that it was not told of yet.
            self.report_other();
        }
        self.foreign.forget();
        Some(PhaseEvent::Elapsed)
    }

    fn decide_leave(&mut self, now: MonotonicTime) -> Option<PhaseEvent> {
        let state = self.run.state();
        let cycles = if state == State::Leave3 { LEAVE_CYCLES_CP3 } else { LEAVE_CYCLES };
        if self.run.cycles >= cycles && self.run.condition {
            return Some(PhaseEvent::Ready);
        }
        if self.run.age(now) < self.net.config.switch_timeout {
            return None;
        }
        let (from, to) = (self.net.stations.phase, state.announces().unwrap_or(Phase::CP0));
        let laggard = (0..self.net.stations.len()).find(|&index| !self.net.has_left(index));
        let slave = laggard.filter(|_| from > Phase::CP0).map(SlaveId::from_index);
        self.net.emit(Event::SwitchFailed { from, to, slave });
        if state == State::Down {
            return Some(PhaseEvent::Elapsed);
        }
        self.run.target = Some(Phase::CP0);
        Some(PhaseEvent::Failed)
    }

    /// Waits for the slaves; those that do not come in time are lost, the others go on.
    fn decide_start(&mut self, now: MonotonicTime) -> Option<PhaseEvent> {
        if self.run.cycles > 0 && self.run.condition {
            return Some(PhaseEvent::Ready);
        }
        if self.run.age(now) < self.net.config.switch_timeout {
            return None;
        }
        for index in 0..self.net.stations.len() {
            if self.net.stations[index].is_active() && !self.net.meets(index, self.run.state()) {
                self.net.lose(index);
            }
        }
        if self.net.stations.any_active() {
            return Some(PhaseEvent::Ready);
        }
        self.all_lost();
        Some(PhaseEvent::Failed)
    }

    fn decide_work(&mut self) -> Option<PhaseEvent> {
        let state = self.run.state();
        let event = self.net.work_on_all(state)?;
        if state != State::Connect2 || event == PhaseEvent::Failed {
            return Some(event);
        }
        match self.net.lay_out() {
            Layout::Done => return Some(PhaseEvent::Ready),
            Layout::Refused => {}
            Layout::Restart => self.run.target = Some(Phase::CP0),
        }
        Some(PhaseEvent::Failed)
    }

    /// The application works, until it is through and its requests are too.
    fn decide_await(&mut self, higher: bool) -> Option<PhaseEvent> {
        if !self.run.proceed || !higher {
            return None;
        }
        let active = || self.net.stations.iter().filter(|station| station.is_active());
        if !active().all(|station| station.channel.is_idle()) {
            return None;
        }
        let is_unclear = |station: &Station| {
            let twice = active().filter(|other| other.address == station.address).count() > 1;
            station.is_active() && (station.address == 0 || twice)
        };
        let conflict = self.net.stations.iter().position(is_unclear);
        if let Some(index) = conflict.filter(|_| self.run.state() == State::Await2) {
            self.run.proceed = false;
            self.net.emit(Event::AddressConflict { slave: SlaveId::from_index(index) });
            return None;
        }
        Some(PhaseEvent::Proceed)
    }

    /// Takes what the ATs of this cycle say, if that was not done: not all of them are back.
    pub(super) fn evaluate_rest(&mut self, now: MonotonicTime) {
        if !self.grid.evaluated {
            self.net.journal.statistics.at_missing += u64::from(!self.is_complete());
            self.evaluate(now);
        }
    }

    /// Takes what the ATs of this cycle say.
    pub(super) fn evaluate(&mut self, now: MonotonicTime) {
        self.grid.evaluated = true;
        let (state, phase) = (self.run.state(), self.net.stations.phase);
        if phase == Phase::CP0 {
            self.evaluate_scan();
            return;
        }
        self.net.read_stations();
        if state.supervises() {
            // Below CP4 nobody moves: who is not heard during the search is not lost by that.
            let excused = phase < Phase::CP4 && self.isolation.is_busy();
            self.net.supervise(excused, state == State::Cp4);
            if !self.net.stations.any_active() && !self.may_recover() {
                self.all_lost();
            }
        }
        let mut indices = 0..self.net.stations.len();
        self.run.condition = match state {
            State::Leave1 | State::Leave2 | State::Leave3 | State::Down => {
                let left = indices.all(|index| self.net.has_left(index));
                self.run.have_left(left, self.net.redundancy.is_fixed())
            }
            State::Cp4 => true,
            _ => indices.all(|index| !self.net.stations[index].is_active() || self.net.meets(index, state)),
        };
        if state.serves() {
            self.net.serve(now);
        }
        if phase == Phase::CP4 {
            self.net.consume();
        }
    }

    fn evaluate_scan(&mut self) {
        let frames = &self.net.frames;
        let ats = Route::ALL.map(|route| frames.at(route, 0).and_then(|data| AtRepr::parse(data).ok()));
        let survey = Survey::of(&ats, self.scan.start_two());
        match self.run.state() {
            // Counted from the first cycle on; what comes out is looked at when the slaves have had their time.
            State::Settle => {
                let _ = self.scan.update(survey);
            }
            State::Scan => match self.scan.update(survey) {
                ScanResult::Going => {}
                ScanResult::Nobody => self.net.emit(Event::NoSlaves),
                ScanResult::Unstable => self.net.emit(Event::ScanUnstable),
                ScanResult::Stable(slaves) if slaves > self.net.config.slaves_max => {
                    let max = self.net.config.slaves_max;
                    self.net.emit(Event::TooManySlaves { found: slaves, max });
                    self.scan.start();
                }
                ScanResult::Stable(slaves) => self.scan.ready = Some(slaves),
            },
            State::Cp0 => self.run.condition = self.scan.has_changed(survey.as_ref()),
            State::Leave0 | State::Down => {
                let mut back = ats.iter().flatten();
                self.run.condition = ats.iter().any(Option::is_some) && back.all(scan::is_untouched);
            }
            _ => {}
        }
    }

    /// Whether the ATs that have come back have the data of every slave.
    pub(super) fn is_complete(&mut self) -> bool {
        let searched = self.isolation.search_is_complete(&self.net);
        searched.unwrap_or_else(|| self.net.is_complete(self.scan.routes()))
    }

    /// The cycle is over: what did not come back is lost, and the ways of the telegrams are looked at.
    fn end_cycle(&mut self) {
        self.count_lost();
        if self.net.stations.phase == Phase::CP0 {
            return;
        }
        let Master { net, run, admission, isolation, measuring, .. } = self;
        let one_port = net.redundancy.is_fixed();
        if !one_port && let Some(topology) = net.redundancy.see(Seen::of(|route| net.frames.came(route))) {
            net.journal.emit(Event::Topology(topology));
        }
        let settled = run.state().announces().is_none() && !admission.is_busy();
        let mut ring_closed = settled && net.redundancy.is_at_ease() && isolation.step(net);
        if !isolation.is_busy() {
            // Else they turn the telegrams round because they were asked to.
            net.redundancy.find_open_cables(&net.stations, &mut net.journal);
            ring_closed |= !one_port
                && settled
                && net.redundancy.close_ring(&mut net.stations, &net.config, &mut net.journal);
        }
        if ring_closed {
            measuring.ring_closed();
        }
        if run.state() == State::Cp4 {
            if !isolation.is_busy() && admission.step(net) {
                measuring.joined();
            }
            measuring.step(net);
        }
    }

    /// Counts the telegrams of the cycle that have not come back.
    fn count_lost(&mut self) {
        let Master { net, scan, .. } = self;
        let scanning = net.stations.phase == Phase::CP0 && !net.redundancy.is_fixed();
        let routes = match scan.survey() {
            Some(survey) if scanning => survey.topology.routes(),
            _ => net.redundancy.topology().routes(),
        };
        let mut mdt_missing = false;
        for &route in routes {
            for kind in [Kind::Mdt, Kind::At] {
                let missing = net.frames.missing(kind, route);
                net.journal.statistics.count_lost(route.port, kind, missing);
                mdt_missing |= kind == Kind::Mdt && missing > 0;
            }
        }
        net.journal.statistics.mdt_missing += u64::from(mdt_missing);
    }

    fn all_lost(&mut self) {
        if self.run.target != Some(Phase::CP0) {
            self.run.target = Some(Phase::CP0);
            self.net.emit(Event::AllSlavesLost);
        }
    }

    /// Nothing is sent until this time.
    pub(super) fn pause_until(&mut self, end: MonotonicTime) {
        self.net.frames.silence();
        self.grid.pause_until(end);
    }

    /// Enters the present state; `last` is the one before.
    // Flat: one arm per state.
    fn enter(&mut self, now: MonotonicTime, last: State) {
        let state = self.run.state();
        match state {
            State::Nrt => {
                self.net.frames.silence();
                self.net.emit(Event::Stopped);
            }
            State::Listen => {
                self.foreign = Foreign::default();
                self.pause_until(now + LISTEN);
            }
            State::Occupied => self.enter_occupied(now, last),
            State::Silence0 | State::Silence1 | State::Silence2 | State::Silence3 => {
                self.pause_until(now + self.net.config.pause);
            }
            State::Settle => {
                self.net.redundancy.start();
                self.start_phase(Phase::CP0);
                self.scan.start();
            }
            State::Scan => {
                if last != State::Settle {
                    self.scan.start();
                }
                self.scan.ready = None;
            }
            State::Cp0 => self.take_scan(),
            State::Identify => {
                self.start_phase(Phase::CP1);
                self.net.rest_channels(Some(false));
            }
            State::OpenSvc => self.net.rest_channels(Some(true)),
            State::Start2 | State::Start3 => {
                self.start_phase(if state == State::Start2 { Phase::CP2 } else { Phase::CP3 });
                self.net.rest_channels(None);
            }
            State::Start4 => {
                self.net.stations.phase = Phase::CP4;
                self.reset_topology_commands();
            }
            State::Cp4 => {
                self.net.open_channels(true);
                self.net.emit(Event::Phase(Phase::CP4));
                self.measuring.start(self.net.redundancy.topology() == Topology::Ring);
            }
            State::Await2 | State::Await3 => self.net.enter_await(state, last),
            State::Down => self.net.close_channels(),
            State::Cp1 | State::Leave0 | State::Leave1 | State::Leave2 | State::Leave3 => {}
            _ => {
                self.net.open_channels(true);
                self.net.begin_work(state);
            }
        }
    }

    fn enter_occupied(&mut self, now: MonotonicTime, last: State) {
        self.foreign.retry();
        self.pause_until(now + self.foreign.patience(&self.net.config.mac));
        if last != State::Listen {
            self.net.close_channels();
            self.net.emit(Event::GaveWay);
        }
    }

    /// Takes a frame that is not one of those that were sent in this cycle. Returns why it is refused.
    pub(super) fn hear(&mut self, now: MonotonicTime, port: Port, frame: &[u8], reason: Refusal) -> Refusal {
        let Ok(header) = Header::parse(frame) else { return reason };
        let state = self.run.state();
        if !is_alien(&header, reason, state, self.run.age(now)) {
            return reason;
        }
        self.foreign.hear(now, port, &header);
        let confirmed = self.foreign.is_confirmed();
        if state.listens() {
            self.advance(now, PhaseEvent::Foreign);
            self.grid.next_cycle = now + self.foreign.patience(&self.net.config.mac);
            if self.foreign.is_estimated() {
                self.report_other();
            }
        } else if confirmed {
            self.report_other();
            if state != State::Cp4 {
                self.advance(now, PhaseEvent::Foreign);
            }
        }
        Refusal::Foreign
    }

    /// Says once what was heard.
    fn report_other(&mut self) {
        if let Some(other) = self.foreign.report() {
            self.net.emit(Event::OtherMaster(other));
        }
    }

    fn start_phase(&mut self, phase: Phase) {
        self.net.stations.phase = phase;
        self.reset_topology_commands();
        for station in self.net.stations.iter_mut() {
            station.link.misses = 0;
        }
        self.net.emit(Event::Phase(phase));
    }

    /// The handshake bits start anew with each phase.
    fn reset_topology_commands(&mut self) {
        self.net.redundancy.leave_open();
        self.isolation = Isolation::default();
        self.admission.reset();
        for station in self.net.stations.iter_mut() {
            station.link.command = DeviceControl::empty();
        }
    }

    /// Makes the slaves of the finished scan known, and keeps places for those that may come later.
    fn take_scan(&mut self) {
        let Master { net, scan, .. } = self;
        let scanned = usize::from(scan.ready.take().unwrap_or(0));
        net.stations.found((0..scanned).map(|index| scan.address(index)), &net.config);
        net.emit(Event::Scanned { slaves: SlaveId::from_index(scanned).0 });
        if let Some(survey) = scan.survey() {
            net.redundancy.take_over(survey, &net.stations, &mut net.journal);
        }
        for index in 0..scanned {
            let (slave, address) = (SlaveId::from_index(index), net.stations[index].address);
            if !net.stations[index].configured {
                net.emit(Event::Unknown { slave, address });
            }
            let first = net.stations[..index].iter().position(|other| other.address == address);
            if let Some(first) = first.filter(|_| address != 0) {
                let first = SlaveId::from_index(first);
                net.emit(Event::DoubleAddress { address, first, second: slave });
            }
        }
        for index in 0..net.config.slaves.len() {
            let slave = &net.config.slaves[index];
            let (address, may_come) = (slave.address, slave.hot_plug.is_some());
            if net.stations[..scanned].iter().any(|station| station.address == address) {
                continue;
            }
            net.emit(Event::Missing { address });
            if may_come {
                let kept = net.stations.keep_place(address, &net.config);
                let reason = HotPlugRefusal::NoPlace;
                net.emit(match kept {
                    true => Event::PlaceKept { address },
                    false => Event::HotPlugRefused { address: Some(address), reason },
                });
            }
        }
    }
}
