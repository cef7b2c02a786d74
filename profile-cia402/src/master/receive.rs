//! What comes from the bus.

use super::boot::BootState;
use super::config::PDOS_MAX;
use super::ends::Taken;
use super::station::EmcyVerdict;
use super::*;
use crate::wire::emcy::Emcy;

/// No device starts twice within this time; but some send two boot-up messages.
const BOOT_UP_SHORTEST: DurationNs = DurationNs::from_millis(50);

/// Second answers to a question, after which two devices seem to answer.
const STRAYS_MAX: u8 = 2;

/// Identifiers of 11 bits.
const STANDARD_COUNT: usize = 0x800;

/// Whose a PDO is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Route {
    None,
    /// A TPDO of this device.
    Tpdo(u16, u16),
    /// An RPDO, which only the master sends.
    Own,
}

/// PDOs by identifier.
#[derive(Debug)]
pub(super) struct Routes {
    standard: Box<[Route]>,
    extended: Vec<(u32, Route)>,
}

impl Routes {
    pub fn new(stations: &[Station]) -> Self {
        // As many as there can be, so that there is room for other PDOs.
        let extended = Vec::with_capacity(stations.len() * 2 * PDOS_MAX);
        let mut routes = Self { standard: vec![Route::None; STANDARD_COUNT].into(), extended };
        routes.fill(stations);
        routes
    }

    /// Fills them anew, without allocating.
    pub fn fill(&mut self, stations: &[Station]) {
        let routes = self;
        routes.standard.fill(Route::None);
        routes.extended.clear();
        let number = |place: usize| u16::try_from(place).unwrap_or(u16::MAX);
        for (index, station) in stations.iter().enumerate() {
            for (place, end) in station.tpdos.iter().enumerate() {
                routes.set(end.id, Route::Tpdo(number(index), number(place)));
            }
            for end in &station.rpdos {
                routes.set(end.id, Route::Own);
            }
        }
    }

    fn set(&mut self, id: Id, route: Route) {
        match id {
            Id::Standard(id) => {
                if let Some(place) = self.standard.get_mut(usize::from(id)) {
                    *place = route;
                }
            }
            Id::Extended(id) => self.extended.push((id, route)),
        }
    }

    fn get(&self, id: Id) -> Route {
        match id {
            Id::Standard(id) => self.standard.get(usize::from(id)).copied().unwrap_or(Route::None),
            Id::Extended(id) => {
                self.extended.iter().find(|(own, _)| *own == id).map_or(Route::None, |(_, route)| *route)
            }
        }
    }
}

impl Master {
    pub(super) fn receive(&mut self, now: MonotonicTime, frame: &Frame) -> Result<(), Refusal> {
        if frame.is_remote() {
            return Err(Refusal::Remote);
        }
        let (id, data) = (frame.id(), frame.data());
        match self.routes.get(id) {
            Route::Tpdo(index, place) => {
                return self.take_tpdo(now, usize::from(index), usize::from(place), data);
            }
            Route::Own => return Err(self.second_master(id, 0)),
            Route::None => {}
        }
        let function = Function::of(id);
        match function {
            Some(Function::ErrorControl(node)) => self.take_heartbeat(now, node, data),
            Some(Function::SdoResponse(node)) => self.take_answer(now, node, data),
            Some(Function::Emcy(node)) => self.take_emcy(now, node, data),
            Some(Function::Nmt) => Err(self.second_master(id, 1)),
            Some(Function::Sync) if self.config.sync.is_some() => {
                self.foreign_sync(now, id);
                Err(self.second_master(id, 2))
            }
            Some(Function::Tpdo(_, node)) => {
                self.listed(node)?;
                Err(Refusal::NotOurs)
            }
            _ => Err(Refusal::NotOurs),
        }
    }

    /// Whether an identifier is that of an RPDO of a device in the list.
    pub(super) fn is_rpdo(&self, id: Id) -> bool {
        self.routes.get(id) == Route::Own
    }

    fn second_master(&mut self, id: Id, kind: u8) -> Refusal {
        if self.second_master & 1 << kind == 0 {
            self.second_master |= 1 << kind;
            self.emit(Event::SecondMaster { function: Function::of(id), id });
        }
        Refusal::SecondMaster
    }

    /// The place of a device; one that is not in the list is reported once.
    fn listed(&mut self, node: NodeId) -> Result<usize, Refusal> {
        if let Some(place) = self.place(node) {
            return Ok(place);
        }
        let (word, bit) = (node.index() / 64, 1 << (node.index() % 64));
        let own = self.config.heartbeat.is_some_and(|own| own.node == node);
        if own {
            self.emit_once_own(node);
        } else if self.unknown[word] & bit == 0 {
            self.unknown[word] |= bit;
            self.emit(Event::UnknownNode { node });
        }
        Err(Refusal::UnknownNode)
    }

    /// Somebody has the master's own node-id.
    fn emit_once_own(&mut self, node: NodeId) {
        let (word, bit) = (node.index() / 64, 1 << (node.index() % 64));
        if self.unknown[word] & bit == 0 {
            self.unknown[word] |= bit;
            self.emit(Event::DuplicateNode { node, sign: DuplicateSign::Answers });
        }
    }

    fn take_tpdo(
        &mut self,
        now: MonotonicTime,
        index: usize,
        place: usize,
        data: &[u8],
    ) -> Result<(), Refusal> {
        let window = self.config.sync.map_or(0, |sync| sync.window_ns);
        let late = window > 0 && now.since(self.last_sync).0 > i64::from(window);
        let station = &mut self.stations[index];
        match station.state {
            BootState::Operational => {}
            // Between its start and the heartbeat that says so it sends what the master has asked for and does not use yet.
            BootState::Starting => return Ok(()),
            _ => return Err(Refusal::NotOperational),
        }
        let node = station.node;
        let end = &mut station.tpdos[place];
        let (number, expected) = (end.number, end.len());
        if data.len() != expected {
            if !core::mem::replace(&mut end.length_told, true) {
                self.emit(Event::PdoLength { node, number, expected, found: data.len() });
            }
            return Err(Refusal::Malformed);
        }
        let taken = end.take(now, data, late);
        self.statistics.pdos_late += u64::from(late);
        match taken {
            Taken::Value => {}
            Taken::Back => self.emit(Event::PdoBack { node, number }),
            Taken::Double => self.duplicate(now, index, DuplicateSign::Pdos),
        }
        Ok(())
    }

    /// Two devices obey one node-id: both are stopped, whether this was reported before or not.
    fn duplicate(&mut self, now: MonotonicTime, index: usize, sign: DuplicateSign) {
        self.tell_duplicate(index, sign);
        if !self.stations[index].state.is_out() {
            self.stations[index].failed = None;
            self.fail(now, index, None);
            self.stations[index].nmt = Some(NmtCommand::STOP);
        }
    }

    fn take_heartbeat(&mut self, now: MonotonicTime, node: NodeId, data: &[u8]) -> Result<(), Refusal> {
        let index = self.listed(node)?;
        let heartbeat = Heartbeat::parse(data).map_err(|_| Refusal::Malformed)?;
        if heartbeat.is_boot_up() {
            self.take_boot_up(now, index);
            return Ok(());
        }
        let config = &self.config.nodes[index];
        let station = &mut self.stations[index];
        if config.guarding.is_some() {
            // An answer that came before says nothing of now.
            if station.guard_toggle.is_some_and(|toggle| toggle != heartbeat.toggle) {
                return Err(Refusal::Unexpected);
            }
            station.guard_toggle = Some(!heartbeat.toggle);
        }
        let state = heartbeat.state;
        station.heartbeat = Some(state);
        if station.state.supervises() {
            station.heartbeat_deadline = config.silence_max().map(|longest| now + longest);
        }
        match (station.state, state) {
            (BootState::Operational, NmtState::OPERATIONAL) => {}
            (BootState::Operational, _) => self.lose(now, index, Event::StateChanged { node, state }),
            // A device that was asked in vain is there.
            (BootState::Retry, _) if station.relapse.until(now).is_none() => {
                self.advance(now, index, BootEvent::Elapsed);
            }
            (BootState::Resetting, _) if self.config.nodes[index].keep_alive => {
                self.advance(now, index, BootEvent::Elapsed);
            }
            _ => {}
        }
        Ok(())
    }

    fn take_boot_up(&mut self, now: MonotonicTime, index: usize) {
        let station = &mut self.stations[index];
        let (node, state) = (station.node, station.state);
        let twice = station.boot_up_at.is_some_and(|at| now.since(at) < BOOT_UP_SHORTEST);
        station.boot_up_at = Some(now);
        station.heartbeat = Some(NmtState::BOOT_UP);
        if twice {
            self.tell_duplicate(index, DuplicateSign::BootUps);
        }
        if self.stations[index].is_without_program() {
            return;
        }
        let station = &mut self.stations[index];
        if station.relapse.until(now).is_some() {
            return;
        }
        use BootState as S;
        let by_itself = !twice && !matches!(state, S::Off | S::Resetting | S::Retry | S::Lost);
        let relapse = if by_itself { station.relapse.count(now) } else { None };
        if !self.advance(now, index, BootEvent::BootUp) {
            return;
        }
        let set_up = !matches!(
            state,
            BootState::Resetting
                | BootState::Identify
                | BootState::Program
                | BootState::Retry
                | BootState::Lost
                | BootState::Failed
        );
        if set_up {
            self.emit(Event::Rebooted { node, operational: state == BootState::Operational });
        }
        if relapse.is_some() {
            self.advance(now, index, BootEvent::NoAnswer);
            self.tell_relapse(index, relapse);
        }
    }

    fn take_answer(&mut self, now: MonotonicTime, node: NodeId, data: &[u8]) -> Result<(), Refusal> {
        let index = self.listed(node)?;
        let station = &mut self.stations[index];
        let head = data.first_chunk().copied();
        match station.client.handle(now, data) {
            Err(_) => Err(Refusal::Malformed),
            Ok(true) => {
                station.last_answer = head;
                self.collect(now, index);
                Ok(())
            }
            Ok(false) => {
                // In operation somebody else may ask, a service tool for one.
                let again = head.is_some() && head == station.last_answer;
                if again && station.state != BootState::Operational {
                    station.strays = station.strays.saturating_add(1);
                    if station.strays >= STRAYS_MAX {
                        self.duplicate(now, index, DuplicateSign::Answers);
                    }
                }
                Err(Refusal::Unexpected)
            }
        }
    }

    fn take_emcy(&mut self, now: MonotonicTime, node: NodeId, data: &[u8]) -> Result<(), Refusal> {
        let index = self.listed(node)?;
        let emcy = Emcy::parse(data).map_err(|_| Refusal::Malformed)?;
        let station = &mut self.stations[index];
        station.emcy = Some(emcy);
        match station.emcy_limit.count(now, self.config.emcy_per_second) {
            EmcyVerdict::Tell => self.emit(Event::Emcy { node, emcy }),
            verdict => {
                self.statistics.emcys_suppressed += 1;
                if verdict == EmcyVerdict::Storm {
                    self.emit(Event::EmcyStorm { node });
                }
            }
        }
        Ok(())
    }
}
