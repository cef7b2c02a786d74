//! How a slave is taken and set up, kept, lost and given back.

use profile_generic::time::{DurationNs, MonotonicTime};

use super::super::connection::{CLASS_CONNECTION, ConnectionKind, EXPLICIT_RATE_MS};
use super::super::wire::allocation::{ALLOCATE, CLASS_DEVICENET, RELEASE};
use super::super::wire::{AllocationChoice, BodyFormat, Header, Identifier, MacId};
use super::event::{Event, ExplicitRequest, LossReason, Outcome};
use super::station::{Phase, PhaseEvent};
use super::{Master, Place, Station};
use crate::device::objects::identity::CLASS_IDENTITY;
use crate::wire::status::{GeneralStatus, Service};

/// Attributes of the Identity object that are asked for: vendor, device type, product code, serial number.
const IDENTITY: [u8; 4] = [1, 2, 3, 6];
/// Serial number, the one of them that has four bytes.
const SERIAL: u8 = 6;

/// Status word of the Identity object.
const IDENTITY_STATUS: u8 = 5;

/// Produced and consumed connection size.
const SIZES: [u8; 2] = [7, 8];

/// Expected packet rate.
const RATE: u8 = 9;

/// Consumed and produced connection path, in the order of [`IoConfig::assemblies`](super::config::IoConfig::assemblies).
const PATHS: [u8; 2] = [16, 14];

/// Questions about a path: what it is, and another one for it.
const PER_PATH: usize = 2;

/// The path of the data of an assembly: class 4, instance, attribute 3.
const fn path_of(assembly: u8) -> [u8; 6] {
    [0x20, 0x04, 0x24, assembly, 0x30, 3]
}

/// The assembly that a path leads to.
fn assembly_of(path: &[u8]) -> Option<u8> {
    match path {
        [0x20, 0x04, 0x24, assembly, ..] => Some(*assembly),
        [0x20, 0x04, 0x25, 0, assembly, 0, ..] => Some(*assembly),
        _ => None,
    }
}

fn devicenet(service: u8, data: &[u8]) -> Option<ExplicitRequest> {
    ExplicitRequest::new(Service(service), u16::from(CLASS_DEVICENET), 1, data)
}

impl Station {
    /// The question of the present phase; `None` when everything has been asked.
    // Flat: one arm per phase.
    fn question(&self, master: MacId) -> Option<(bool, ExplicitRequest)> {
        let choice = self.config.choice().bits();
        let connection = u16::from(CLASS_CONNECTION);
        let io = |number: usize| self.config.connections.get(number);
        match self.phase {
            Phase::Allocate | Phase::AllocateAgain if self.step == 0 => {
                Some((false, devicenet(ALLOCATE, &[choice, master.get()])?))
            }
            Phase::Release if self.step == 0 => Some((false, devicenet(RELEASE, &[choice])?)),
            Phase::Identify => {
                let attribute = *IDENTITY.get(self.step)?;
                Some((true, ExplicitRequest::get(CLASS_IDENTITY, 1, attribute)))
            }
            Phase::Paths => {
                // Of all connections with assemblies: consumed, produced.
                let (place, way, sets) = self.path_step();
                let one = io(place)?;
                let (instance, attribute) = (u16::from(one.kind.instance()), PATHS[way]);
                Some((
                    true,
                    match one.assemblies {
                        None => return None,
                        Some(assemblies) if sets => {
                            ExplicitRequest::set(connection, instance, attribute, &path_of(assemblies[way]))?
                        }
                        Some(_) => ExplicitRequest::get(connection, instance, attribute),
                    },
                ))
            }
            Phase::Sizes => {
                let instance = u16::from(io(self.step / 2)?.kind.instance());
                Some((true, ExplicitRequest::get(connection, instance, SIZES[self.step % 2])))
            }
            Phase::Rates => {
                let one = io(self.step)?;
                let (instance, rate) = (u16::from(one.kind.instance()), one.rate_ms.to_le_bytes());
                Some((true, ExplicitRequest::set(connection, instance, RATE, &rate)?))
            }
            _ => None,
        }
    }

    /// The connection that a step with the paths is about, which way, and whether it sets the path.
    const fn path_step(&self) -> (usize, usize, bool) {
        let path = self.step / PER_PATH;
        (path / PATHS.len(), path % PATHS.len(), !self.step.is_multiple_of(PER_PATH))
    }

    /// What is made of the answer about a path.
    fn judge_path(&mut self, outcome: &Outcome) -> Result<(), (PhaseEvent, LossReason)> {
        let (place, way, sets) = self.path_step();
        let Some((kind, assemblies)) =
            self.config.connections.get(place).and_then(|one| Some((one.kind, one.assemblies?)))
        else {
            return Ok(());
        };
        match outcome {
            Outcome::Done(_) if sets => self.facts.assembly = None,
            Outcome::Done(path) => {
                self.facts.assembly = assembly_of(path);
                // What is right already is not set.
                self.step += usize::from(self.facts.assembly == Some(assemblies[way]));
            }
            Outcome::Refused { status, .. } if sets => {
                let reason = LossReason::Assembly {
                    kind,
                    produced: way == 1,
                    expected: assemblies[way],
                    found: self.facts.assembly,
                    status: *status,
                };
                return Err((PhaseEvent::Refused, reason));
            }
            // One that does not report its paths has no others: its data say what it is.
            Outcome::Refused { .. } => self.step += 1,
            Outcome::NoAnswer | Outcome::NotTaken(_) | Outcome::Lost => {
                return Err((PhaseEvent::NoAnswer, LossReason::NoAnswer(Phase::Paths)));
            }
            Outcome::Malformed(_) => {
                return Err((PhaseEvent::Refused, LossReason::Malformed(Phase::Paths)));
            }
        }
        Ok(())
    }

    /// What the answer to a question makes of the phase.
    // Flat: one arm per kind of outcome, then one per phase.
    fn judge(&mut self, outcome: &Outcome) -> Result<(), (PhaseEvent, LossReason)> {
        let phase = self.phase;
        if phase == Phase::Paths {
            return self.judge_path(outcome);
        }
        let data = match outcome {
            Outcome::Done(data) => data,
            Outcome::Refused { status, additional } => {
                let reason = LossReason::Refused { phase, status: *status, additional: *additional };
                let allocation = matches!(phase, Phase::Allocate | Phase::AllocateAgain | Phase::Release);
                return Err(match *status {
                    GeneralStatus::ALREADY_IN_STATE if allocation => (PhaseEvent::Already, reason),
                    GeneralStatus::OBJECT_STATE_CONFLICT if allocation => {
                        (PhaseEvent::Conflict, LossReason::AnotherMaster)
                    }
                    _ => (PhaseEvent::Refused, reason),
                });
            }
            Outcome::NoAnswer | Outcome::NotTaken(_) | Outcome::Lost => {
                return Err((PhaseEvent::NoAnswer, LossReason::NoAnswer(phase)));
            }
            Outcome::Malformed(_) => return Err((PhaseEvent::Refused, LossReason::Malformed(phase))),
        };
        let malformed = (PhaseEvent::Refused, LossReason::Malformed(phase));
        let word = || match data[..] {
            [low, high] => Some(u16::from_le_bytes([low, high])),
            _ => None,
        };
        match phase {
            Phase::Allocate | Phase::AllocateAgain => {
                let format = *data.first().ok_or(malformed)?;
                self.format = BodyFormat(format & 0x0F);
                Ok(())
            }
            Phase::Identify if IDENTITY[self.step.min(3)] == SERIAL => {
                let bytes = data[..].try_into().map_err(|_| malformed)?;
                self.facts.serial = Some(u32::from_le_bytes(bytes));
                Ok(())
            }
            Phase::Identify => self.judge_identity(word().ok_or(malformed)?),
            Phase::Sizes => self.judge_size(usize::from(word().ok_or(malformed)?)),
            _ => Ok(()),
        }
    }

    /// Vendor, device type or product code.
    fn judge_identity(&mut self, found: u16) -> Result<(), (PhaseEvent, LossReason)> {
        let attribute = IDENTITY[self.step.min(3)];
        let identity = &self.config.identity;
        let (fact, expected) = match attribute {
            1 => (&mut self.facts.vendor, identity.vendor),
            2 => (&mut self.facts.device_type, identity.device_type),
            _ => (&mut self.facts.product_code, identity.product_code),
        };
        *fact = Some(found);
        match expected.filter(|expected| *expected != found) {
            Some(expected) => Err((PhaseEvent::Refused, LossReason::Identity { attribute, expected, found })),
            None => Ok(()),
        }
    }

    /// The size of what a connection produces or consumes.
    fn judge_size(&self, found: usize) -> Result<(), (PhaseEvent, LossReason)> {
        let produced = self.step.is_multiple_of(2);
        let Some(one) = self.config.connections.get(self.step / 2) else { return Ok(()) };
        let kind = one.kind;
        // What a slave consumes by bit strobe or as acknowledge is not told in the same way by all.
        let expected = match kind {
            _ if produced => one.input,
            ConnectionKind::Poll => one.output,
            _ => found,
        };
        if expected == found {
            Ok(())
        } else {
            Err((PhaseEvent::Refused, LossReason::Size { kind, produced, expected, found }))
        }
    }

    fn end_requests(&mut self) {
        for place in &mut self.places {
            if let Place::Waiting(serial, _) | Place::Running(serial) = *place {
                *place = Place::Ended(serial, Outcome::Lost);
            }
        }
    }

    fn enter(&mut self, now: MonotonicTime, phase: Phase) {
        self.phase = phase;
        self.step = 0;
        self.since = now;
    }
}

impl Master {
    /// Takes a slave on as far as it goes now: questions, requests of the application, keep-alive.
    pub(super) fn advance(&mut self, now: MonotonicTime, place: usize) {
        if !self.access.is_online() {
            return;
        }
        loop {
            self.take_outcome(now, place);
            let master = self.config.mac;
            let (running, retry) = (self.running, self.config.retry);
            let station = &mut self.stations[place];
            if station.phase == Phase::Waiting
                && running
                && now >= station.retry_at.max(station.occupied_until())
                && station.client.is_free()
            {
                station.facts = super::Facts::default();
                station.enter(now, station.phase.next(PhaseEvent::Done));
            }
            if station.client.is_free() && station.phase != Phase::Waiting {
                if let Some((connected, request)) = station.question(master) {
                    let format = if connected { station.format } else { BodyFormat::CLASS_8_INSTANCE_8 };
                    station.own = true;
                    station.client.start(connected, format, &request);
                } else if station.phase == Phase::Exchange {
                    station.next_request(now, master);
                } else {
                    let next = station.phase.next(PhaseEvent::Done);
                    station.enter(now, next);
                    if next == Phase::Exchange {
                        station.ends.iter_mut().for_each(super::IoEnd::reset);
                        (station.told, station.foreign) = (None, super::Foreign::default());
                        station.retry_pause = retry;
                        let mac = station.config.mac;
                        self.tell(Event::Exchanging(mac));
                    }
                    continue;
                }
            }
            break;
        }
        while let Some((identifier, data)) = self.stations[place].client.poll(now) {
            self.send(identifier, &data);
        }
        // A request that has just ended by time is dealt with at once.
        if self.stations[place].client.has_outcome() {
            self.take_outcome(now, place);
        }
    }

    fn take_outcome(&mut self, now: MonotonicTime, place: usize) {
        let station = &mut self.stations[place];
        let Some(outcome) = station.client.take_outcome() else { return };
        if station.phase == Phase::Exchange {
            if core::mem::take(&mut station.own) {
                station.keep(&outcome);
                return;
            }
            station.explicit_gone |= matches!(outcome, Outcome::NoAnswer);
            if let Some(running) = station.places.iter_mut().find(|one| matches!(one, Place::Running(_)))
                && let Place::Running(serial) = *running
            {
                *running = Place::Ended(serial, outcome);
            }
            return;
        }
        station.own = false;
        match station.judge(&outcome) {
            Ok(()) => station.step += 1,
            Err((event, reason)) => {
                let next = station.phase.next(event);
                if next == Phase::Waiting {
                    let slave = station.config.mac;
                    let allocated = station.phase.is_allocated();
                    let choice = station.config.choice();
                    self.lose(now, place, reason);
                    if allocated && event == PhaseEvent::Refused {
                        // What cannot be used is not kept from others.
                        self.send_release(slave, choice);
                    }
                } else {
                    station.enter(now, next);
                }
            }
        }
    }

    /// A slave is not exchanged with any more; it is asked for again after a while.
    pub(super) fn lose(&mut self, now: MonotonicTime, place: usize, reason: LossReason) {
        let retry_max = self.config.retry_max;
        let station = &mut self.stations[place];
        let slave = station.config.mac;
        station.client.reset();
        station.own = false;
        station.explicit_gone = false;
        station.end_requests();
        station.ends.iter_mut().for_each(super::IoEnd::reset);
        station.enter(now, station.phase.next(PhaseEvent::Lost));
        station.retry_at = now + station.retry_pause;
        station.retry_pause = (station.retry_pause * 2).min(retry_max);
        self.statistics.losses += 1;
        if self.stations[place].told.as_ref() != Some(&reason) {
            self.stations[place].told = Some(reason.clone());
            self.tell(Event::Lost { slave, reason });
        }
    }

    /// The master is off the network, and with it everything that it had.
    pub(super) fn lose_all(&mut self, now: MonotonicTime) {
        for place in 0..self.stations.len() {
            if self.stations[place].phase != Phase::Waiting {
                self.lose(now, place, LossReason::MasterOffline);
            }
            self.stations[place].retry_at = MonotonicTime::ZERO;
        }
    }

    pub(super) fn give_back(&mut self, now: MonotonicTime, place: usize) {
        let station = &mut self.stations[place];
        let (slave, choice, allocated) =
            (station.config.mac, station.config.choice(), station.phase.is_allocated());
        station.client.reset();
        station.own = false;
        station.explicit_gone = false;
        station.end_requests();
        station.ends.iter_mut().for_each(super::IoEnd::reset);
        station.enter(now, Phase::Waiting);
        station.retry_at = MonotonicTime::ZERO;
        if allocated && self.access.is_online() {
            self.send_release(slave, choice);
            self.tell(Event::Released { slave, choice });
        }
    }

    /// Nobody waits for the answer: a slave that does not get it times out.
    fn send_release(&mut self, slave: MacId, choice: AllocationChoice) {
        let header = Header { fragmented: false, xid: false, mac: self.config.mac };
        let data = [header.byte(), RELEASE, CLASS_DEVICENET, 1, choice.bits()];
        self.send(Identifier::UnconnectedRequest(slave), &data);
    }

    pub(super) fn station_wake_at(&self, station: &Station) -> Option<MonotonicTime> {
        match station.phase {
            Phase::Waiting => self.running.then(|| station.retry_at.max(station.occupied_until())),
            Phase::Exchange if station.client.is_free() => {
                let waits = station.explicit_gone
                    || station.places.iter().any(|place| matches!(place, Place::Waiting(..)));
                Some(if waits { MonotonicTime::ZERO } else { station.keep_alive_at })
            }
            _ if station.client.is_free() => Some(MonotonicTime::ZERO),
            _ => station.client.wake_at(),
        }
    }
}

impl Station {
    /// Begins the request that has waited longest, or keeps the explicit connection alive.
    fn next_request(&mut self, now: MonotonicTime, master: MacId) {
        if self.explicit_gone {
            let choice = AllocationChoice::EXPLICIT.bits();
            if let Some(request) = devicenet(ALLOCATE, &[choice, master.get()]) {
                self.client.start(false, BodyFormat::CLASS_8_INSTANCE_8, &request);
                self.own = true;
            }
            return;
        }
        let waiting = self.places.iter_mut().find(|place| matches!(place, Place::Waiting(..)));
        let keep_alive = DurationNs::from_millis(i64::from(EXPLICIT_RATE_MS));
        if let Some(place) = waiting {
            let serial = match place {
                Place::Waiting(serial, _) | Place::Running(serial) | Place::Ended(serial, _) => *serial,
            };
            if let Place::Waiting(_, request) = core::mem::replace(place, Place::Running(serial)) {
                self.client.start(true, self.format, &request);
                self.own = false;
                self.keep_alive_at = now + keep_alive;
            }
        } else if now >= self.keep_alive_at {
            self.client.start(true, self.format, &ExplicitRequest::get(CLASS_IDENTITY, 1, IDENTITY_STATUS));
            self.own = true;
            self.keep_alive_at = now + keep_alive;
        }
    }

    /// Takes the answer to the master's own request beside the exchange. An explicit connection that does not answer any more
    /// is allocated again; the I/O connections are watched by their own messages, and go on.
    fn keep(&mut self, outcome: &Outcome) {
        if core::mem::take(&mut self.explicit_gone) {
            return;
        }
        match outcome {
            Outcome::Done(data) => {
                if let [low, high] = data[..] {
                    self.facts.status = Some(u16::from_le_bytes([low, high]));
                }
            }
            Outcome::NoAnswer | Outcome::NotTaken(_) => self.explicit_gone = true,
            _ => {}
        }
    }
}
