//! What goes on the bus, and when.

use super::boot::BootState;
use super::ends::RpdoEnd;
use super::*;
use crate::wire::error_control::HEARTBEAT_LEN;
use crate::wire::frame;
use crate::wire::sync::Sync;

impl Master {
    /// SYNC begins, and devices come up.
    pub(super) fn begin(&mut self, now: MonotonicTime) {
        self.next_sync = now;
        self.counter = 0;
        let all = self.config.nodes.iter().all(|node| !node.keep_alive);
        if all && !self.stations.is_empty() {
            self.nmt_all = Some(NmtCommand::RESET_COMMUNICATION);
        }
        for index in 0..self.stations.len() {
            self.advance(now, index, BootEvent::Start);
            if all {
                self.stations[index].nmt = None;
            }
        }
    }

    /// Leaves out SYNCs that could only go out late, by more than half a period: devices would take the values of two periods
    /// nearly at once. The grid stays where it is. Returns whether one was left out.
    pub fn skip_late(&mut self, now: MonotonicTime) -> bool {
        let Some(sync) = self.config.sync.filter(|_| self.running && !self.bus_off) else { return false };
        let period = i64::from(sync.period_ns).max(1);
        let late = now.since(self.next_sync).as_nanos();
        if late <= period / 2 {
            return false;
        }
        let missed = ((late + period / 2) / period).max(1);
        self.next_sync = self.next_sync + DurationNs(period) * missed;
        self.statistics.syncs_skipped += missed.unsigned_abs();
        true
    }

    /// Moves the grid: the next SYNC comes by so much later, and all that follow it.
    pub fn shift_grid(&mut self, by: DurationNs) {
        self.next_sync = self.next_sync + by;
    }

    /// Begins a SYNC period when its time has come.
    pub(super) fn cycle(&mut self, now: MonotonicTime) {
        let Some(sync) = self.config.sync.filter(|_| self.running && now >= self.next_sync) else { return };
        let period = DurationNs(i64::from(sync.period_ns));
        self.last_sync = now;
        self.next_sync = self.next_sync + period;
        let late = now.since(self.next_sync).0;
        if late >= 0 {
            // Times that have passed are left out; the grid stays.
            let skipped = late / period.0 + 1;
            self.next_sync = self.next_sync + period * skipped;
            self.statistics.syncs_skipped += skipped.unsigned_abs();
        }
        self.sync_due = true;
        self.sdo_left = match self.config.sdo_frames_per_cycle {
            0 => u8::MAX,
            frames => frames,
        };
        self.transmit_told = false;
        for index in 0..self.stations.len() {
            let station = &mut self.stations[index];
            if station.state != BootState::Operational {
                continue;
            }
            station.rpdos.iter_mut().for_each(RpdoEnd::sync);
            for place in 0..self.stations[index].tpdos.len() {
                let (missed, lost) = self.stations[index].tpdos[place].sync();
                self.count_missed(index, place, missed, lost);
            }
        }
    }

    /// Counts a TPDO that did not come, and reports one too many.
    pub(super) fn count_missed(&mut self, index: usize, place: usize, missed: bool, lost: bool) {
        self.statistics.pdos_missed += u64::from(missed);
        if lost {
            let station = &self.stations[index];
            let (node, number) = (station.node, station.tpdos[place].number);
            self.emit(Event::PdoLost { node, number });
        }
    }

    /// Whether an RPDO is to be sent.
    pub(super) fn has_rpdo(&self) -> bool {
        self.stations.iter().any(|station| station.rpdos.iter().any(|end| end.due))
    }

    /// SYNC, and then the RPDOs.
    pub(super) fn next_cyclic(&mut self) -> Option<Frame> {
        if core::mem::take(&mut self.sync_due) {
            self.statistics.syncs += 1;
            let overflow = self.config.sync.map_or(0, |sync| sync.counter_overflow);
            let counter = (overflow > 0).then(|| {
                self.counter = if self.counter >= overflow { 1 } else { self.counter + 1 };
                self.counter
            });
            let sync = Sync { counter };
            return Some(frame(cob_id::SYNC, &sync.emit()[..sync.buffer_len()]));
        }
        let (fd, held) = (self.config.fd, self.config.sync.is_some());
        let ends = self.stations.iter_mut().flat_map(|station| &mut station.rpdos);
        let end = ends.into_iter().find(|end| end.due)?;
        end.due = false;
        match fd {
            Some(fast) => Frame::fd(end.id, end.outgoing(held), fast).ok(),
            None => Some(frame(end.id, end.outgoing(held))),
        }
    }

    /// Asks the next device that is guarded for its state.
    fn next_guarding(&mut self, now: MonotonicTime) -> Option<Frame> {
        let mut stations = self.stations.iter_mut().zip(&self.config.nodes);
        let (station, node) = stations.find(|(station, _)| station.guard_at.is_some_and(|at| now >= at))?;
        let time = DurationNs::from_millis(node.guarding.map_or(0, |guard| guard.guard_time_ms).into());
        // On a grid of its own, unless it was not called for longer.
        let next = station.guard_at.unwrap_or(now) + time;
        station.guard_at = (time > DurationNs::ZERO).then(|| if next > now { next } else { now + time });
        Frame::remote(cob_id::error_control(station.node), HEARTBEAT_LEN).ok()
    }

    /// NMT, error control, TIME and SDO, in this order.
    pub(super) fn next_other(&mut self, now: MonotonicTime) -> Option<Frame> {
        if let Some(command) = self.nmt_all.take() {
            return Some(frame(cob_id::NMT, &Nmt { command, node: None }.emit()));
        }
        for station in &mut self.stations {
            if let Some(command) = station.nmt.take() {
                return Some(frame(cob_id::NMT, &Nmt { command, node: Some(station.node) }.emit()));
            }
        }
        if !self.running {
            return None;
        }
        if let (Some(state), Some(own)) = (self.heartbeat, self.config.heartbeat)
            && now >= self.next_heartbeat
        {
            self.next_heartbeat = now + DurationNs::from_millis(i64::from(own.producer_ms));
            self.heartbeat = Some(NmtState::OPERATIONAL);
            return Some(frame(cob_id::error_control(own.node), &Heartbeat::new(state).emit()));
        }
        if let Some(request) = self.next_guarding(now) {
            return Some(request);
        }
        if let Some(time) = self.time.take() {
            return Some(frame(cob_id::TIME, &time.emit()));
        }
        self.next_sdo(now)
    }

    fn next_sdo(&mut self, now: MonotonicTime) -> Option<Frame> {
        if self.sdo_left == 0 {
            return None;
        }
        let stations = self.stations.len();
        for turn in 0..stations {
            let index = (self.next_client + turn) % stations;
            let station = &mut self.stations[index];
            if let Some(bytes) = station.client.poll(now) {
                self.next_client = index + 1;
                if self.config.sync.is_some() {
                    self.sdo_left -= 1;
                }
                return Some(frame(cob_id::sdo_request(station.node), &bytes));
            }
        }
        None
    }

    /// When a device needs a call.
    pub(super) fn station_wakes(&self, index: usize) -> Option<MonotonicTime> {
        let station = &self.stations[index];
        if station.nmt.is_some() || station.client.has_outcome() || self.can_go_on(index) {
            return Some(MonotonicTime::ZERO);
        }
        let client = station.client.wake_at().filter(|_| self.sdo_left > 0 || self.config.sync.is_none());
        let give_up = station.give_up.filter(|_| station.state == BootState::Retry);
        let pdos = station.tpdos.iter().filter_map(|end| end.deadline());
        let (heartbeat, guard) = (station.heartbeat_deadline, station.guard_at);
        let times = [station.deadline, give_up, heartbeat, guard, station.pause, client];
        times.into_iter().flatten().chain(pdos).min()
    }
}
