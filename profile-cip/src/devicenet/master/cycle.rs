//! The cycle: commands out, answers in, and what stays away.

use profile_generic::time::{DurationNs, MonotonicTime};

use super::super::connection::ConnectionKind;
use super::super::fragmentation::{IoData, IoFrames};
use super::super::link::Refusal;
use super::super::wire::Identifier;
use super::Master;
use super::event::LossReason;
use super::station::Phase;

impl Master {
    /// Leaves out cycles that could only begin late, by more than half of their time. The grid stays where it is. Returns whether one
    /// was left out.
    pub fn skip_late(&mut self, now: MonotonicTime) -> bool {
        let half = self.config.cycle.as_nanos() / 2;
        let late = self.access.is_online() && now.since(self.next_cycle).as_nanos() > half;
        if late {
            self.skip_until(now - DurationNs(half));
        }
        late
    }

    /// Moves the grid: the next cycle begins by so much later, and all that follow it.
    pub fn shift_grid(&mut self, by: DurationNs) {
        self.next_cycle = self.next_cycle + by;
    }

    /// Leaves out the cycles up to `now`.
    fn skip_until(&mut self, now: MonotonicTime) {
        let cycle = self.config.cycle.as_nanos().max(1);
        let late = now.since(self.next_cycle).as_nanos();
        if late >= 0 {
            let missed = late / cycle + 1;
            self.next_cycle = self.next_cycle + DurationNs(cycle) * missed;
            self.statistics.skipped += missed.unsigned_abs();
        }
    }

    /// Begins a cycle: counts what has not come, and asks every slave that is due.
    pub(super) fn cycle(&mut self, now: MonotonicTime) {
        self.next_cycle = self.next_cycle + self.config.cycle;
        // A master that was late does not make up for cycles in a burst, and the grid stays where it is.
        self.skip_until(now);
        self.statistics.cycles += 1;
        let (mut strobe, mut strobes) = ([0_u8; 8], false);
        for place in 0..self.stations.len() {
            if self.stations[place].phase != Phase::Exchange {
                continue;
            }
            let mut lost = None;
            for number in 0..self.stations[place].ends.len() {
                let station = &mut self.stations[place];
                let (mac, max, hold) =
                    (station.config.mac, u32::from(station.config.missed_max), station.config.hold_cycles);
                let end = &mut station.ends[number];
                let missed = end.missed;
                if !end.begin_cycle() {
                    continue;
                }
                let kind = end.config.kind;
                self.statistics.missed += u64::from(end.missed > missed);
                if end.missed > max {
                    lost = Some(LossReason::Missed { kind, count: end.missed });
                    break;
                }
                let data: IoData = end.command(hold).iter().copied().collect();
                let size = end.config.output;
                end.sent();
                match kind {
                    ConnectionKind::Poll => {
                        for frame in IoFrames::new(size, &data) {
                            self.send(Identifier::PollCommand(mac), &frame);
                        }
                    }
                    ConnectionKind::BitStrobe => {
                        strobes = true;
                        let bit = data.first().copied().unwrap_or(0) & 1;
                        strobe[usize::from(mac.get() / 8)] |= bit << (mac.get() % 8);
                    }
                    _ => {}
                }
            }
            if let Some(reason) = lost {
                self.lose(now, place, reason);
            }
        }
        if strobes {
            self.send(Identifier::BitStrobeCommand(self.config.mac), &strobe);
        }
    }

    /// Takes an I/O frame of a slave.
    pub(super) fn receive(
        &mut self,
        place: usize,
        kind: ConnectionKind,
        identifier: Identifier,
        frame: &[u8],
    ) -> Result<(), Refusal> {
        let station = &mut self.stations[place];
        let exchanging = station.phase == Phase::Exchange;
        if station.phase == Phase::Rates {
            // A connection speaks as soon as it has its rate, which may be before the last one has.
            return Err(Refusal::NotForUs(identifier));
        }
        let mac = station.config.mac;
        let end = station.ends.iter_mut().find(|end| end.config.kind == kind);
        let Some(end) = end.filter(|_| exchanging) else { return Err(Refusal::NoConnection(identifier)) };
        let expected = end.config.input;
        let whole = end.receiver.handle(expected, frame);
        if !whole.map_err(|error| Refusal::Fragment(identifier, error))? {
            return Ok(());
        }
        let found = end.receiver.data().len();
        if found != 0 && found != expected {
            // Nothing of it may be looked at.
            end.receiver.reset();
            end.invalidate();
            return Err(Refusal::Length { identifier, expected, found });
        }
        end.received();
        let acknowledged = kind == ConnectionKind::ChangeOfState && end.config.acknowledged;
        self.statistics.received += 1;
        if acknowledged {
            self.send(Identifier::Acknowledge(mac), &[]);
        }
        Ok(())
    }
}
