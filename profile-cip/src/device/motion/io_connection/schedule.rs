//! When the D-to-C updates go, and with which Update ID.
//!
//! A device that is asked for its updates from time to time has an Actual Update Window (clause 2-1.3): in synchronous
//! operation an update goes with the last call that is not later than its time, which is the start of the update cycle less
//! the Transmission Processing Time. Which call is the last one the caller says ([`Schedule::expect`]); one that says nothing
//! calls at the time itself.

use profile_generic::time::MonotonicTime;

/// Timing of the answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mode {
    Asynchronous,
    Pending { first_update_id: u8, at: MonotonicTime },
    Synchronous,
}

/// The schedule of the D-to-C updates.
#[derive(Debug, Clone)]
pub(crate) struct Schedule {
    /// Controller Update Period, ns.
    period: u64,
    pub mode: Mode,
    next: MonotonicTime,
    /// Transmission Processing Time, ns.
    processing: u64,
    /// When [`Schedule::take`] is called next, behind the call that is under way.
    next_call: Option<MonotonicTime>,
    /// The last update went right at its time, and not some time before it.
    close: bool,
    /// Sequence count of the last packet.
    pub sequence: u16,
    /// Head of the last update if it had nothing to say.
    idle_header: Option<[u8; 8]>,
    /// Update ID of the last update.
    sent_update_id: u8,
    /// Update ID that the next update answers, if a C-to-D update has triggered it.
    answer: Option<u8>,
}

impl Schedule {
    /// A schedule that begins at `now`; `period` and `processing` in ns.
    pub fn new(period: u64, processing: u64, now: MonotonicTime) -> Self {
        Self {
            period,
            mode: Mode::Asynchronous,
            next: MonotonicTime(now.0.saturating_add(period)),
            processing,
            next_call: None,
            close: true,
            sequence: 0,
            idle_header: None,
            sent_update_id: 0,
            answer: None,
        }
    }

    /// A C-to-D update asks for its answer. In synchronous mode the schedule goes on by itself.
    pub fn answer(&mut self, update_id: u8, has_data: bool, now: MonotonicTime) {
        if self.mode == Mode::Synchronous {
            return;
        }
        if has_data && update_id == self.sent_update_id && self.answer.is_none() {
            // The timer has sent this ID already: the update was late. The next one is due a period from here.
            self.next = MonotonicTime(now.0.saturating_add(self.period));
            return;
        }
        self.answer = Some(update_id);
        self.next = now;
    }

    /// Schedules the first synchronous update for the update cycle that starts in `in_ns` from now.
    pub fn synchronize(&mut self, update_id: u8, in_ns: u64, now: MonotonicTime) {
        let start = now.0.saturating_add(in_ns);
        self.mode = Mode::Pending {
            // The update that starts two cycles after the one of this command.
            first_update_id: update_id.wrapping_add(2),
            at: MonotonicTime(start.saturating_sub(self.processing).max(now.0)),
        };
    }

    /// Says when [`Schedule::take`] is called next, behind the call that is under way.
    pub fn expect(&mut self, next_call: MonotonicTime) {
        self.next_call = Some(next_call);
    }

    /// Aligns the schedule with an update cycle that starts in `in_ns` or whole periods from it.
    pub fn align(&mut self, in_ns: i64, now: MonotonicTime) {
        let in_ns = in_ns.saturating_sub(i64::try_from(self.processing).unwrap_or(0));
        if self.mode != Mode::Synchronous {
            return;
        }
        let period = i64::try_from(self.period).unwrap_or(i64::MAX).max(1);
        // Negative when it is overdue, as it is whenever an update and a command meet in one cycle of the device.
        let planned = self.next.since(now).as_nanos();
        // The multiple of the period from that start which is nearest to the plan.
        let off = planned.saturating_sub(in_ns).rem_euclid(period);
        let correction = if off > period / 2 { period - off } else { -off };
        self.next = MonotonicTime(self.next.0.saturating_add_signed(correction));
    }

    /// Goes back to asynchronous operation.
    pub fn desynchronize(&mut self) {
        self.mode = Mode::Asynchronous;
    }

    /// An update was produced; `idle` is the head of one that has nothing to say. While there is nothing to say, the same
    /// packet is repeated to keep the connection alive (clause 7-1.1).
    pub fn transmitted(&mut self, idle: Option<[u8; 8]>, has_data: bool) {
        if idle.is_none() || has_data || idle != self.idle_header {
            self.sequence = self.sequence.wrapping_add(1);
        }
        self.idle_header = idle;
    }

    /// Time of the next D-to-C update.
    pub fn next(&self) -> MonotonicTime {
        match self.mode {
            Mode::Pending { at, .. } => at.min(self.next),
            _ => self.next,
        }
    }

    /// Whether what is for `time` goes with the call at `now`: the next one would be too late. Where calls come right at that
    /// time, and both are known to some microseconds only, an update goes with the same call as the one before it.
    fn is_last_call(&self, now: MonotonicTime, time: MonotonicTime) -> bool {
        let slack = i64::try_from(self.processing / 2).unwrap_or(i64::MAX);
        let slack = if self.close { slack } else { -slack };
        now >= time || self.next_call.is_some_and(|next| next.since(time).as_nanos() > slack)
    }

    /// If a D-to-C update is due: its Update ID. Schedules the one after it.
    pub fn take(&mut self, now: MonotonicTime, has_data: bool) -> Option<u8> {
        // Before the cycles are known, an update is the answer to the controller's or comes after waiting for it, so that none
        // goes early.
        let due = match self.mode {
            Mode::Asynchronous => now >= self.next,
            Mode::Pending { at, .. } => now >= self.next || self.is_last_call(now, at),
            Mode::Synchronous => self.is_last_call(now, self.next),
        };
        if !due {
            return None;
        }
        let period = self.period;
        let answered = self.answer.take();
        let planned = self.next();
        self.close = planned.since(now).as_nanos() <= i64::try_from(self.processing / 2).unwrap_or(i64::MAX);
        let id = match self.mode {
            Mode::Pending { first_update_id, at } if self.is_last_call(now, at) => {
                self.mode = Mode::Synchronous;
                self.next = MonotonicTime(at.0.saturating_add(period));
                first_update_id
            }
            Mode::Synchronous => {
                // Cycles that nobody asked for an update in keep their IDs, and the grid stays.
                let left_out = now.0.saturating_sub(self.next.0) / period.max(1);
                self.next = MonotonicTime(self.next.0.saturating_add(period.saturating_mul(left_out + 1)));
                let [step, ..] = left_out.to_le_bytes();
                self.sent_update_id.wrapping_add(step).wrapping_add(1)
            }
            _ => {
                let next = self.next.0.saturating_add(period);
                // A schedule that has fallen behind starts anew instead of catching up in a burst.
                let behind = next <= now.0;
                self.next = MonotonicTime(if behind { now.0.saturating_add(period) } else { next });
                match answered {
                    Some(id) => id,
                    None if has_data => self.sent_update_id.wrapping_add(1),
                    None => self.sent_update_id,
                }
            }
        };
        self.sent_update_id = id;
        Some(id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: u64 = 1_000;

    #[test]
    fn answer_follows_its_update_and_the_timer_fills_in() {
        let mut schedule = Schedule::new(PERIOD, 100, MonotonicTime(0));
        assert_eq!(schedule.take(MonotonicTime(999), true), None);
        schedule.answer(7, true, MonotonicTime(500));
        assert_eq!(schedule.take(MonotonicTime(500), true), Some(7));
        assert_eq!(schedule.next(), MonotonicTime(1_500));
        assert_eq!(schedule.take(MonotonicTime(1_500), true), Some(8));
        // The update with the ID that the timer has sent already is late: nothing goes twice.
        schedule.answer(8, true, MonotonicTime(1_600));
        assert_eq!(schedule.take(MonotonicTime(1_600), true), None);
        assert_eq!(schedule.next(), MonotonicTime(2_600));
    }

    #[test]
    fn first_synchronous_update_starts_the_grid() {
        let mut schedule = Schedule::new(PERIOD, 100, MonotonicTime(0));
        schedule.synchronize(4, 700, MonotonicTime(0));
        assert_eq!(schedule.take(MonotonicTime(599), true), None);
        assert_eq!(schedule.take(MonotonicTime(600), true), Some(6));
        assert_eq!((schedule.mode, schedule.next()), (Mode::Synchronous, MonotonicTime(1_600)));
        schedule.align(800, MonotonicTime(1_000));
        assert_eq!(schedule.next(), MonotonicTime(1_700));
    }

    /// Calls every 300, of which one is now on this and now on that side of the time of an update: it stays with the call it has
    /// chosen until the other one is better by more than half the processing time.
    #[test]
    fn an_update_does_not_change_between_two_calls_for_the_last_nanosecond() {
        // When the call that sent the last update was to be late, and where the next call is against the time of this one.
        let rows = [
            (true, 0, true),
            (true, 50, true),
            (true, 51, false),
            (false, -49, false),
            (false, -50, true),
            (false, 1, false),
        ];
        for (close, next_call, waits) in rows {
            let mut schedule = Schedule::new(PERIOD, 100, MonotonicTime(0));
            schedule.synchronize(4, 100, MonotonicTime(0));
            assert_eq!(schedule.take(MonotonicTime(0), true), Some(6));
            // The next one is for 1000.
            schedule.close = close;
            let next = MonotonicTime(1_000_u64.saturating_add_signed(next_call));
            schedule.expect(next);
            let now = MonotonicTime(next.0 - 300);
            assert_eq!(schedule.take(now, true).is_none(), waits, "{close} {next_call}");
        }
    }

    #[test]
    fn idle_packet_is_repeated_with_its_count() {
        let mut schedule = Schedule::new(PERIOD, 0, MonotonicTime(0));
        let idle = Some([1; 8]);
        let counts = [idle, idle, Some([2; 8])].map(|head| {
            schedule.transmitted(head, false);
            schedule.sequence
        });
        assert_eq!(counts, [1, 1, 2]);
        schedule.transmitted(None, true);
        assert_eq!(schedule.sequence, 3);
    }
}
