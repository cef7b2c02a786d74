//! Moves each device through its boot-up.

use super::boot::BootState;
use super::config::{MandatoryError, StartPolicy};
use super::plan::{self, Step, Verdict};
use super::program::{self, ProgramStep};
use super::report::RowOutcome;
use super::station::Work;
use super::*;
use crate::sdo::request::{SdoFailure, SdoOutcome};

impl Master {
    /// Moves a device on by `event`; `false` when it means nothing in its state.
    pub(super) fn advance(&mut self, now: MonotonicTime, index: usize, event: BootEvent) -> bool {
        let last = self.stations[index].state;
        let Some(next) = last.next(event) else { return false };
        self.abandon(index, event);
        let config = &self.config;
        let node = &config.nodes[index];
        let station = &mut self.stations[index];
        (station.state, station.since, station.deadline) = (next, now, None);
        (station.at, station.again, station.proceed) = (0, None, false);
        (station.pause, station.program_until) = (None, None);
        let kept = station.kept;
        plan::fill(&mut station.steps, next, config, node, kept);
        if last == BootState::Operational {
            station.stop_ends();
        }
        if !next.supervises() {
            station.heartbeat_deadline = None;
        }
        if event == BootEvent::BootUp || next.is_out() {
            (station.guard_at, station.guard_toggle) = (None, None);
        }
        self.enter(now, index, last, event);
        self.check_complete();
        true
    }

    /// A device enters its present state by `event`; `last` is the one before.
    // Flat: one arm per state.
    fn enter(&mut self, now: MonotonicTime, index: usize, last: BootState, event: BootEvent) {
        let config = &self.config;
        let node = &config.nodes[index];
        let station = &mut self.stations[index];
        let kept = station.kept;
        match station.state {
            BootState::Off => {
                (station.give_up, station.kept) = (None, false);
                station.relapse.forget();
            }
            BootState::Resetting => {
                let keep = node.keep_alive && last == BootState::Off;
                station.nmt = (!keep).then_some(NmtCommand::RESET_COMMUNICATION);
                (station.status, station.kept, station.heartbeat) = (None, false, None);
                station.forget_duplicate();
                // One that may stay in operation reports its state when it is asked, and has to be asked from then on.
                station.guard_at = node.guarding.filter(|_| keep).map(|_| now);
                station.deadline = Some(now + config.boot_up_time);
                station.give_up = config.gives_up_at(now + config.boot_up_time);
            }
            BootState::Identify => {
                station.report.clear();
                (station.failed, station.device_type, station.identity) = (None, None, [None; 4]);
                (station.configured, station.nmt) = (false, None);
                if event == BootEvent::BootUp {
                    (station.kept, station.status) = (false, None);
                    if last == BootState::Failed {
                        // It begins anew, and so does the search for a second device.
                        station.forget_duplicate();
                    }
                }
                // One that was reset has its time since then.
                station.give_up = station.give_up.or(config.gives_up_at(now));
                // It may be stopped, and then has no SDO: a boot-up message can cross the stop that a lost device is sent. One that may
                // be in operation is left alone, unless it has started anew or says that it is stopped.
                let out = matches!(station.heartbeat, Some(NmtState::BOOT_UP | NmtState::STOPPED));
                if last == BootState::Retry && event == BootEvent::Elapsed && (out || !node.keep_alive) {
                    station.nmt = Some(NmtCommand::ENTER_PRE_OPERATIONAL);
                }
            }
            BootState::Retry => {
                let left_alone = station.relapse.until(now);
                if left_alone.is_some() {
                    station.give_up = None;
                }
                station.deadline = Some(left_alone.unwrap_or(now + config.retry_time));
            }
            BootState::Lost => {
                station.nmt = Some(NmtCommand::STOP);
                let retry = now + config.retry_time;
                station.deadline = Some(station.relapse.until(now).map_or(retry, |until| until.max(retry)));
            }
            BootState::Configure => {
                station.give_up = None;
                // It was not reset, and may be in any state.
                if node.keep_alive {
                    station.nmt = Some(NmtCommand::ENTER_PRE_OPERATIONAL);
                }
            }
            BootState::Await => {
                station.give_up = None;
                if kept {
                    station.status = Some(BootStatus::ALREADY_OPERATIONAL);
                }
                let node = station.node;
                self.emit(Event::AwaitingApplication { node, kept });
            }
            BootState::Map => {
                station.adopted.clear();
                if !kept {
                    station.reset_transmissions(node);
                }
            }
            BootState::Ready => {
                station.heartbeat_deadline = node.silence_max().map(|longest| now + longest);
                station.guard_at = node.guarding.map(|_| station.guard_at.unwrap_or(now));
            }
            BootState::Starting => {
                station.nmt = Some(NmtCommand::START);
                station.heartbeat = None;
                // Heartbeats that tell another state do not count.
                station.deadline = node.silence_max().map(|longest| now + longest * 2);
            }
            BootState::Operational => {
                station.tpdos.iter_mut().for_each(|end| end.start(now));
                station.relapse.operational(now);
                let node = station.node;
                self.emit(Event::Operational { node });
            }
            // A download takes its time, and the device that starts with it has its own.
            BootState::Program => station.give_up = None,
            BootState::Control | BootState::Failed => {}
        }
    }

    /// A device fails to come up.
    pub(super) fn fail(&mut self, now: MonotonicTime, index: usize, status: Option<BootStatus>) {
        let mandatory = self.config.nodes[index].mandatory;
        let station = &mut self.stations[index];
        (station.status, station.give_up) = (status, None);
        let (node, step, kept) = (station.node, station.failed, station.kept);
        if !self.advance(now, index, BootEvent::Failed) {
            return;
        }
        // A device that was in operation all the time and is not what it should be does not stay there.
        if kept {
            self.stations[index].nmt = Some(NmtCommand::STOP);
        }
        self.emit(Event::BootFailed { node, status, step, mandatory });
        self.mandatory_error(now, index);
    }

    /// Nothing is heard of a device's state any more.
    fn lose_sight(&mut self, now: MonotonicTime, index: usize) {
        let node = self.stations[index].node;
        let guarded = self.config.nodes[index].guarding.is_some();
        let event = if guarded { Event::GuardingLost { node } } else { Event::HeartbeatLost { node } };
        self.lose(now, index, event);
    }

    /// A device that was set up is lost.
    pub(super) fn lose(&mut self, now: MonotonicTime, index: usize, event: Event) {
        let guarded = self.config.nodes[index].guarding.is_some();
        let starting = self.stations[index].state == BootState::Starting;
        if starting {
            let status = if guarded { BootStatus::GUARDING } else { BootStatus::NO_HEARTBEAT };
            self.fail(now, index, Some(status));
            // It may have started, and nobody sees it.
            self.stations[index].nmt = Some(NmtCommand::STOP);
            return;
        }
        let status = if guarded { BootStatus::GUARDING } else { BootStatus::HEARTBEAT_LOST };
        self.stations[index].status = Some(status);
        let relapse = self.stations[index].relapse.count(now);
        if self.advance(now, index, BootEvent::Lost) {
            self.emit(event);
            self.tell_relapse(index, relapse);
            self.mandatory_error(now, index);
        }
    }

    /// Tells that a device is left alone for a while.
    pub(super) fn tell_relapse(&mut self, index: usize, relapse: Option<(u32, DurationNs)>) {
        if let Some((times, pause)) = relapse {
            let node = self.stations[index].node;
            self.emit(Event::LeftAlone { node, times, pause });
        }
    }

    /// The network does without a mandatory device, or it does not.
    fn mandatory_error(&mut self, now: MonotonicTime, index: usize) {
        if !self.config.nodes[index].mandatory || !self.running {
            return;
        }
        match self.config.mandatory_error {
            MandatoryError::Report => {}
            MandatoryError::StopAll => {
                for other in (0..self.stations.len()).filter(|&other| other != index) {
                    if self.advance(now, other, BootEvent::Stop) {
                        self.stations[other].nmt = None;
                    }
                }
                self.nmt_all = Some(NmtCommand::STOP);
            }
            MandatoryError::ResetAll => {
                for other in (0..self.stations.len()).filter(|&other| other != index) {
                    self.advance(now, other, BootEvent::Stop);
                    self.advance(now, other, BootEvent::Start);
                }
            }
        }
    }

    /// Ends what runs at a device whose state changes. The device is there and goes on, or it is not.
    fn abandon(&mut self, index: usize, event: BootEvent) {
        let gone = matches!(event, BootEvent::BootUp | BootEvent::Lost | BootEvent::Stop | BootEvent::Failed);
        let gone = gone || event == BootEvent::Start;
        if !gone {
            return;
        }
        let station = &mut self.stations[index];
        station.client.drop_server();
        if let Some(outcome) = station.client.take_outcome() {
            self.give_back(index, outcome);
        }
        self.stations[index].queue.fail(SdoFailure::NodeLost);
    }

    /// Hands an outcome to whom it belongs; that of a step comes back.
    fn give_back(&mut self, index: usize, mut outcome: SdoOutcome) -> Option<(Step, SdoOutcome)> {
        let station = &mut self.stations[index];
        match core::mem::replace(&mut station.work, Work::Free) {
            Work::Application => station.queue.finish(outcome),
            Work::Step(step) => {
                // The bytes of the configuration are needed for the next time.
                let node = &mut self.config.nodes[index];
                let place = match step {
                    Step::Write(place) => node.writes.get_mut(place).map(|write| &mut write.data),
                    Step::Program(ProgramStep::Download) => program::image(node),
                    _ => None,
                };
                if let Some(place) = place {
                    *place = core::mem::take(&mut outcome.data);
                }
                return Some((step, outcome));
            }
            Work::Free => {}
        }
        None
    }

    /// Does what is due at every device.
    pub(super) fn work(&mut self, now: MonotonicTime) {
        if !self.running {
            return;
        }
        for index in 0..self.stations.len() {
            self.watch(now, index);
            self.collect(now, index);
            // A state without steps is left at once; there are fewer states than this.
            for _ in BootState::ALL {
                if !self.ask(now, index) {
                    break;
                }
            }
        }
    }

    /// Times that have run out.
    fn watch(&mut self, now: MonotonicTime, index: usize) {
        let station = &self.stations[index];
        let state = station.state;
        let over = |at: Option<MonotonicTime>| at.is_some_and(|at| now >= at);
        if over(station.heartbeat_deadline) {
            self.lose_sight(now, index);
        } else if over(station.give_up) && state == BootState::Retry {
            self.fail(now, index, Some(BootStatus::NO_ANSWER));
        } else if over(station.deadline) {
            if state == BootState::Starting {
                self.lose_sight(now, index);
            } else {
                self.advance(now, index, BootEvent::Elapsed);
            }
        }
        for place in 0..self.stations[index].tpdos.len() {
            let (missed, lost) = self.stations[index].tpdos[place].elapsed(now);
            self.count_missed(index, place, missed, lost);
        }
    }

    /// Takes the outcome of what runs at a device.
    pub(super) fn collect(&mut self, now: MonotonicTime, index: usize) {
        let station = &mut self.stations[index];
        let Some(outcome) = station.client.take_outcome() else { return };
        if matches!(outcome.result, Err(SdoFailure::Timeout { .. })) {
            // What was given up may still be answered, which is no second answer.
            station.last_answer = None;
        }
        // The configured bytes of a step go back to where they came from.
        let plain = ReportRow::new(station.state, &outcome);
        let Some((step, outcome)) = self.give_back(index, outcome) else { return };
        let station = &mut self.stations[index];
        let node = &self.config.nodes[index];
        let (row, verdict) = plan::judge(step, &outcome, plain.outcome, &self.config, node, station);
        let row = plain.with(row);
        station.note(row);
        match verdict {
            Verdict::Next => {}
            Verdict::Then(step) => station.again = Some(step),
            Verdict::SkipTo(step) => {
                let place = station.steps.iter().position(|&other| other == step);
                station.at = place.unwrap_or(station.at).max(station.at);
            }
            Verdict::Finish => station.at = station.steps.len(),
            Verdict::Again(_) if station.program_until.is_some_and(|until| now >= until) => {
                station.failed = Some(plain);
                self.fail(now, index, Some(BootStatus::PROGRAM_DOWNLOAD));
            }
            Verdict::Again(step) => {
                (station.again, station.pause) = (Some(step), Some(now + self.config.retry_time));
            }
            Verdict::Program => {
                let time = node.program.as_ref().map(|program| program.time);
                station.program_until = time.map(|time| now + time);
                let node = station.node;
                self.emit(Event::ProgramDownload { node });
            }
            Verdict::Restart => {
                self.advance(now, index, BootEvent::Proceed);
            }
            Verdict::Fail(status) => {
                let timeout = matches!(row.outcome, RowOutcome::Failed(SdoFailure::Timeout { .. }));
                if timeout && station.state == BootState::Identify {
                    self.advance(now, index, BootEvent::NoAnswer);
                } else {
                    station.failed = Some(row);
                    self.fail(now, index, Some(status));
                }
            }
        }
    }

    /// Starts the next transfer at a device, or moves it on; `true` when there is more to do at once.
    fn ask(&mut self, now: MonotonicTime, index: usize) -> bool {
        let station = &mut self.stations[index];
        if station.work != Work::Free || !station.client.is_free() {
            return false;
        }
        if station.pause.take_if(|pause| now >= *pause).is_none() && station.pause.is_some() {
            return false;
        }
        if let Some(step) = station.next_step() {
            let (sync, heartbeat) = (self.config.sync, self.config.heartbeat);
            let request = plan::request(step, sync, heartbeat, &mut self.config.nodes[index], station);
            station.work = Work::Step(step);
            // It is free.
            let _ = station.client.start(now, request);
            return false;
        }
        if let Some(event) = self.next_event(index) {
            let station = &mut self.stations[index];
            station.kept |= event == BootEvent::Kept;
            let (node, adopted) = (station.node, core::mem::take(&mut station.adopted));
            for (direction, number, wanted, found) in core::mem::take(&mut station.types) {
                self.emit(Event::TransmissionAdopted { node, direction, number, wanted, found });
            }
            for (direction, number) in adopted {
                self.emit(Event::MappingAdopted { node, direction, number });
            }
            return self.advance(now, index, event);
        }
        let station = &mut self.stations[index];
        if station.state.serves()
            && let Some(request) = station.queue.start()
        {
            station.work = Work::Application;
            let _ = station.client.start(now, request);
        }
        false
    }

    /// What moves a device on whose steps are done.
    fn next_event(&self, index: usize) -> Option<BootEvent> {
        let station = &self.stations[index];
        Some(match station.state {
            BootState::Identify => {
                let operational = station.heartbeat == Some(NmtState::OPERATIONAL);
                let keeps = operational && self.config.nodes[index].keep_alive;
                if keeps { BootEvent::Kept } else { BootEvent::Done }
            }
            BootState::Program | BootState::Configure | BootState::Map | BootState::Control => {
                BootEvent::Done
            }
            BootState::Await if station.proceed && station.is_quiet() => BootEvent::Proceed,
            BootState::Ready if self.may_start() => BootEvent::Proceed,
            BootState::Starting if self.has_started(index) => BootEvent::Done,
            _ => return None,
        })
    }

    /// Whether something can be done at a device at once.
    pub(super) fn can_go_on(&self, index: usize) -> bool {
        let station = &self.stations[index];
        let free = station.work == Work::Free && station.client.is_free();
        let steps = station.again.is_some() || station.at < station.steps.len();
        let requests = station.state.serves() && station.queue.is_waiting();
        free && station.pause.is_none() && (steps || requests || self.next_event(index).is_some())
    }

    /// Whether devices that are ready are started.
    fn may_start(&self) -> bool {
        let ready = |station: &Station| {
            matches!(station.state, BootState::Ready | BootState::Starting | BootState::Operational)
        };
        self.config.start == StartPolicy::Each
            || self
                .config
                .nodes
                .iter()
                .zip(&self.stations)
                .all(|(node, station)| !node.mandatory || ready(station))
    }

    /// Whether a device that was started is in operation. One that reports nothing is believed to be once the command is out.
    fn has_started(&self, index: usize) -> bool {
        let station = &self.stations[index];
        let told = station.heartbeat == Some(NmtState::OPERATIONAL);
        let silent = self.config.nodes[index].silence_max().is_none();
        station.nmt.is_none() && (told || silent)
    }

    fn check_complete(&mut self) {
        let mut mandatory = self.config.nodes.iter().zip(&self.stations).filter(|(node, _)| node.mandatory);
        let any = self.config.nodes.iter().any(|node| node.mandatory);
        let complete = any && mandatory.all(|(_, station)| station.state == BootState::Operational);
        if complete && !self.complete {
            self.emit(Event::NetworkOperational);
        }
        self.complete = complete;
    }
}
