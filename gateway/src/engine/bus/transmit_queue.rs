//! The way of a CAN bus's frames into the transmit queue.

use profile_generic::can::Frame;
use profile_generic::time::{DurationNs, MonotonicTime};

use crate::engine::port::{CanPort, CanSent};

/// How long a frame waits for room in the transmit queue before it is offered again.
const FULL_PAUSE: DurationNs = DurationNs::from_micros(200);

/// A frame that waits for room in the transmit queue.
#[derive(Debug, Clone, Copy)]
struct Held {
    frame: Frame,
    made: MonotonicTime,
    /// When it is offered again.
    again: MonotonicTime,
}

/// Hands frames to the transmit queue in their order, and keeps the one for which there is no room.
#[derive(Debug)]
pub(super) struct TransmitQueue {
    cycle_time: DurationNs,
    held: Option<Held>,
}

impl TransmitQueue {
    /// Of a bus with this cycle: what has waited for longer than one is not sent any more.
    pub(super) const fn new(cycle_time: DurationNs) -> Self {
        Self { cycle_time, held: None }
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

    /// When the frame that waits is offered again; `None` when none waits.
    pub(super) fn wake_at(&self) -> Option<MonotonicTime> {
        self.held.map(|held| held.again)
    }

    /// The frame that waits, with when it was made. It has to be sent before any other.
    pub(super) fn take(&mut self) -> Option<(Frame, MonotonicTime)> {
        self.held.take().map(|held| (held.frame, held.made))
    }

    /// Sends a frame that was made at `made`; with [`CanSent::Full`] it waits, and nothing else is to be sent before it.
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
        let sent = port.send(now, &frame);
        if sent == CanSent::Full {
            self.held = Some(Held { frame, made, again: now + FULL_PAUSE });
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
}
