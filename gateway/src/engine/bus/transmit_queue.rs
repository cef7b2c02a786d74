//! The way of a CAN bus's frames into the transmit queue.
//!
//! A controller whose frame nobody acknowledges repeats it until somebody does, however long that takes, and what is queued after it
//! leaves then at once. So no more may be in the transmit queue than what was made in a cycle or two. Where the port does not report
//! what has left, the length of the queue alone limits this.

use std::collections::VecDeque;

use profile_generic::can::Frame;
use profile_generic::time::{DurationNs, MonotonicTime};

use crate::engine::port::{CanPort, CanSent};

/// How long a frame waits for room in the transmit queue before it is offered again.
const FULL_PAUSE: DurationNs = DurationNs::from_micros(200);

/// Longest time from when a frame was handed over until it is reported, where somebody acknowledges: adapters on USB take a while.
const REPORT_LATEST: DurationNs = DurationNs::from_millis(5);

/// After so long without a frame one more is handed over, although those before it are not known to have left: reports may be lost.
const PROBE_PAUSE: DurationNs = DurationNs::from_millis(500);

/// Frames of which it is known since when they are in the transmit queue: more than its length.
const QUEUED_MAX: usize = 256;

/// A frame that waits for room in the transmit queue.
#[derive(Debug, Clone, Copy)]
struct Held {
    frame: Frame,
    made: MonotonicTime,
    /// When it is offered again.
    again: MonotonicTime,
}

/// The frames in the transmit queue of the port, as far as it reports when one has left.
#[derive(Debug)]
struct Queued {
    /// When each was handed over, the oldest first.
    since: VecDeque<MonotonicTime>,
    /// The port reports what has left.
    is_reported: bool,
    /// When a frame was handed over last.
    last: MonotonicTime,
    /// It was one more than may be in there: the next report is that of a bus that carries frames.
    is_probe: bool,
}

impl Queued {
    /// Whether the oldest is in there for longer than `longest`, so that no other may follow it.
    fn is_stuck(&mut self, now: MonotonicTime, longest: DurationNs) -> bool {
        let is_old = self.is_reported && self.since.front().is_some_and(|since| now.since(*since) > longest);
        let is_probe = is_old && now.since(self.last) > PROBE_PAUSE;
        self.is_probe |= is_probe;
        is_old && !is_probe
    }

    /// A frame has left: the bus carries frames. Of what was handed over a `cycle` ago or before it, the reports are late or lost.
    fn pop(&mut self, now: MonotonicTime, cycle: DurationNs) {
        self.is_reported = true;
        if std::mem::take(&mut self.is_probe) {
            self.since.clear();
        }
        self.since.pop_front();
        while self.since.front().is_some_and(|since| now.since(*since) >= cycle) {
            self.since.pop_front();
        }
    }

    fn push(&mut self, now: MonotonicTime) {
        if self.since.len() == QUEUED_MAX {
            self.since.pop_front();
        }
        self.since.push_back(now);
        self.last = now;
    }
}

/// Hands frames to the transmit queue in their order, and keeps the one for which there is no room.
#[derive(Debug)]
pub(super) struct TransmitQueue {
    cycle_time: DurationNs,
    held: Option<Held>,
    queued: Queued,
}

impl TransmitQueue {
    /// Of a bus with this cycle: what has waited for longer than one is not sent any more.
    pub(super) fn new(cycle_time: DurationNs) -> Self {
        let since = VecDeque::with_capacity(QUEUED_MAX);
        let queued = Queued { since, is_reported: false, last: MonotonicTime::ZERO, is_probe: false };
        Self { cycle_time, held: None, queued }
    }

    /// The cycle of the bus.
    pub(super) const fn cycle_time(&self) -> DurationNs {
        self.cycle_time
    }

    /// Whether no frame waits.
    pub(super) const fn is_empty(&self) -> bool {
        self.held.is_none()
    }

    /// The frame that waits will not be sent.
    pub(super) const fn clear(&mut self) {
        self.held = None;
    }

    /// The controller was off the bus: nothing is left of the frames that were handed over.
    pub(super) fn reset(&mut self) {
        self.clear();
        self.queued.since.clear();
    }

    /// A frame has left.
    pub(super) fn note_transmitted(&mut self, now: MonotonicTime) {
        self.queued.pop(now, self.cycle_time);
    }

    /// How long a frame may be in the transmit queue: half a cycle beyond the next one, and never less than what a report takes.
    fn longest(&self) -> DurationNs {
        DurationNs(self.cycle_time.as_nanos() / 2 * 3).max(REPORT_LATEST)
    }

    /// When the frame that waits is offered again; `None` when none waits.
    pub(super) fn wake_at(&self) -> Option<MonotonicTime> {
        self.held.map(|held| held.again)
    }

    /// The frame that waits, with when it was made. It has to be sent before any other.
    pub(super) fn take(&mut self) -> Option<(Frame, MonotonicTime)> {
        self.held.take().map(|held| (held.frame, held.made))
    }

    /// Sends a frame that was made at `made`; with [`CanSent::Full`] it waits, and nothing else is to be sent before it. One behind a
    /// frame that does not leave is not sent: nobody hears it while it is new.
    pub(super) fn send(
        &mut self,
        now: MonotonicTime,
        port: &mut dyn CanPort,
        frame: Frame,
        made: MonotonicTime,
    ) -> CanSent {
        // What has waited for a whole cycle is old: no drive shall act on it.
        if now.since(made) > self.cycle_time {
            return CanSent::Failed;
        }
        let longest = self.longest();
        if self.queued.is_stuck(now, longest) {
            return CanSent::Failed;
        }
        let sent = port.send(now, &frame);
        match sent {
            CanSent::Sent => self.queued.push(now),
            CanSent::Full => self.held = Some(Held { frame, made, again: now + FULL_PAUSE }),
            CanSent::Failed => {}
        }
        sent
    }
}

#[cfg(test)]
mod tests {
    use profile_generic::can::Id;

    use super::*;
    use crate::engine::port::CanInput;

    /// A transmit queue with so much room.
    struct Queue(Vec<Frame>, usize);

    impl CanPort for Queue {
        fn receive(&mut self, _: MonotonicTime) -> Option<CanInput> {
            None
        }

        fn send(&mut self, _: MonotonicTime, frame: &Frame) -> CanSent {
            if self.0.len() == self.1 {
                return CanSent::Full;
            }
            self.0.push(*frame);
            CanSent::Sent
        }
    }

    fn us(micros: u64) -> MonotonicTime {
        MonotonicTime(micros * 1_000)
    }

    #[test]
    fn a_frame_without_room_waits_and_is_not_sent_once_it_is_old() {
        let frame = Frame::new(Id::Standard(0x205), &[6, 0]).unwrap();
        let (mut transmit_queue, mut queue) =
            (TransmitQueue::new(DurationNs::from_millis(4)), Queue(Vec::new(), 0));
        assert_eq!(
            (transmit_queue.is_empty(), transmit_queue.wake_at(), transmit_queue.take()),
            (true, None, None)
        );
        assert_eq!(transmit_queue.send(us(1_000), &mut queue, frame, us(900)), CanSent::Full);
        assert_eq!((transmit_queue.is_empty(), transmit_queue.wake_at()), (false, Some(us(1_200))));
        // It keeps the age that it had.
        let (held, made) = transmit_queue.take().unwrap();
        assert_eq!((held, made, transmit_queue.is_empty()), (frame, us(900), true));
        queue.1 = 1;
        assert_eq!(transmit_queue.send(us(4_901), &mut queue, frame, us(900)), CanSent::Failed);
        assert_eq!((queue.0.len(), transmit_queue.is_empty()), (0, true));
        assert_eq!(transmit_queue.send(us(4_900), &mut queue, frame, us(900)), CanSent::Sent);
        assert_eq!(queue.0, [frame]);
        queue.1 = 0;
        transmit_queue.send(us(5_000), &mut queue, frame, us(5_000));
        transmit_queue.clear();
        assert!(transmit_queue.is_empty());
    }

    /// Two frames in each cycle of so many milliseconds, of which `leave` have left before the next one: how many were taken in each.
    fn cycles(millis: u64, leave: &[usize]) -> Vec<usize> {
        let frame = Frame::new(Id::Standard(0x205), &[6, 0]).unwrap();
        let mut transmit_queue = TransmitQueue::new(DurationNs(i64::try_from(millis * 1_000_000).unwrap()));
        let mut queue = Queue(Vec::new(), usize::MAX);
        let mut taken = Vec::new();
        for (now, leave) in (0..).map(|cycle| us(1_000 + 1_000 * millis * cycle)).zip(leave) {
            let before = queue.0.len();
            transmit_queue.clear();
            (0..2).for_each(|_| _ = transmit_queue.send(now, &mut queue, frame, now));
            taken.push(queue.0.len() - before);
            (0..*leave).for_each(|_| transmit_queue.note_transmitted(now));
        }
        taken
    }

    #[test]
    fn frames_of_about_a_cycle_wait_for_somebody_who_acknowledges() {
        assert_eq!(cycles(4, &[2, 2, 2, 2]), [2, 2, 2, 2]);
        // Nobody acknowledges from the second cycle on, and somebody does again at the end.
        assert_eq!(cycles(10, &[2, 0, 0, 0, 2, 2]), [2, 2, 2, 0, 0, 2]);
        assert_eq!(cycles(4, &[2, 0, 0, 0, 4, 2]), [2, 2, 2, 0, 0, 2]);
        assert_eq!(cycles(1, &[2, 0, 0, 0, 0, 0, 0, 0, 12, 2]), [2, 2, 2, 2, 2, 2, 2, 0, 0, 2]);
        // A port that does not report what has left.
        assert_eq!(cycles(4, &[0; 6]), [2; 6]);
        // A report is late by a cycle; all of a cycle are lost.
        assert_eq!(cycles(4, &[1, 2, 2, 3, 2]), [2; 5]);
        assert_eq!(cycles(4, &[2, 0, 2, 2, 2, 2]), [2; 6]);
        for millis in [1, 2, 4, 5, 6, 10, 20] {
            // A report is lost now and then, or all of one cycle; each comes a cycle late.
            let lossy: Vec<_> = (0..300).map(|cycle| if cycle % 10 == 3 { 1 } else { 2 }).collect();
            assert_eq!(cycles(millis, &lossy), vec![2; 300], "{millis} ms");
            assert_eq!(cycles(millis, &[2, 2, 0, 2, 2, 2, 2, 2]), [2; 8], "{millis} ms");
            assert_eq!(cycles(millis, &[0, 2, 2, 2, 2, 2, 2, 2])[..], [2; 8], "{millis} ms");
        }
        // Where reports are lost, or nobody acknowledges, one frame is tried in half a second, and with its report all is well.
        let mut lost = [0; 260];
        lost[0] = 2;
        let taken = cycles(4, &lost);
        assert_eq!((taken[127], taken[128], taken[129]), (0, 1, 0));
        assert_eq!(taken.iter().sum::<usize>(), 6 + 2, "{taken:?}");
        lost[128] = 1;
        assert_eq!(cycles(4, &lost)[127..131], [0, 1, 2, 2]);
    }

    #[test]
    fn nothing_is_left_in_the_queue_of_a_controller_that_was_off_the_bus() {
        let frame = Frame::new(Id::Standard(0x205), &[6, 0]).unwrap();
        let mut transmit_queue = TransmitQueue::new(DurationNs::from_millis(4));
        let mut queue = Queue(Vec::new(), usize::MAX);
        transmit_queue.send(us(1_000), &mut queue, frame, us(1_000));
        transmit_queue.send(us(1_000), &mut queue, frame, us(1_000));
        transmit_queue.note_transmitted(us(1_000));
        assert_eq!(transmit_queue.send(us(9_000), &mut queue, frame, us(9_000)), CanSent::Failed);
        transmit_queue.reset();
        assert_eq!(transmit_queue.send(us(9_000), &mut queue, frame, us(9_000)), CanSent::Sent);
    }
}
