//! What the buses on CAN have in common: frames in and out, and the controller that is off the bus and comes back.

use profile_generic::can::timing::Shape;
use profile_generic::can::{Frame, Id};
use profile_generic::time::{DurationNs, MonotonicTime};

use super::bus_return::BusReturn;
use super::transmit_queue::TransmitQueue;
use crate::engine::port::{CanInput, CanPort, CanSent};
use crate::status::BusDetail;

/// Frames taken from the bus in one call: more than a bus at 1 Mbit/s carries in ten milliseconds.
const FRAMES_PER_CALL: usize = 256;

/// Longest wait for what comes in: answers come at any time.
pub(super) const PATIENCE: DurationNs = DurationNs::from_millis(1);

/// The box as a station of a CAN bus.
pub(super) trait Station {
    /// Takes a frame. One that is refused is counted and changes nothing.
    fn handle_frame(&mut self, now: MonotonicTime, frame: &Frame);

    /// The controller is off the bus.
    fn handle_bus_off(&mut self, now: MonotonicTime);

    /// The bus is used again.
    fn handle_bus_on(&mut self, now: MonotonicTime);

    /// The next frame to be sent, with when it was made.
    fn poll(&mut self, now: MonotonicTime) -> Option<(Frame, MonotonicTime)>;

    /// A frame was not sent.
    fn handle_failure(&mut self, id: Id);
}

/// The way of a station's frames to and from its controller.
#[derive(Debug)]
pub(super) struct CanLink {
    queue: TransmitQueue,
    back: BusReturn,
    occupied: Occupied,
}

/// Bits for which frames have occupied the bus since the start: each frame counts with as many stuff bits as it could have.
#[derive(Debug, Clone, Copy, Default)]
struct Occupied {
    nominal: u64,
    data: u64,
}

impl Occupied {
    fn count(&mut self, frame: &Frame) {
        let bits = Shape::of(frame).most();
        self.nominal += u64::from(bits.nominal);
        self.data += u64::from(bits.data);
    }
}

impl CanLink {
    /// Of a bus with this cycle.
    pub(super) fn new(cycle_time: DurationNs) -> Self {
        Self {
            queue: TransmitQueue::new(cycle_time),
            back: BusReturn::NEVER_LOST,
            occupied: Occupied { nominal: 0, data: 0 },
        }
    }

    /// For how many bits frames have occupied the bus.
    pub(super) const fn detail(&self) -> BusDetail {
        let Occupied { nominal, data } = self.occupied;
        BusDetail::Can { nominal, data }
    }

    /// The cycle of the bus.
    pub(super) const fn cycle_time(&self) -> DurationNs {
        self.queue.cycle_time()
    }

    /// Whether the controller is on the bus, and the pause after its return is over.
    pub(super) const fn is_used(&self) -> bool {
        self.back.is_used()
    }

    /// Whether no frame waits for room.
    pub(super) const fn is_drained(&self) -> bool {
        self.queue.is_empty()
    }

    /// When the frame that waits for room is offered again; `None` when none waits.
    pub(super) fn wake_at(&self) -> Option<MonotonicTime> {
        self.queue.wake_at()
    }

    /// The frame that waits for room will not be sent.
    pub(super) const fn clear(&mut self) {
        self.queue.clear();
    }

    /// Takes what has come from the controller.
    pub(super) fn receive(&mut self, now: MonotonicTime, port: &mut dyn CanPort, station: &mut dyn Station) {
        for _ in 0..FRAMES_PER_CALL {
            match port.receive(now) {
                Some(CanInput::Frame(frame)) => {
                    self.occupied.count(&frame);
                    if self.back.is_used() {
                        station.handle_frame(now, &frame);
                    }
                }
                Some(CanInput::Transmitted) => self.queue.note_transmitted(now),
                Some(CanInput::BusOff) => {
                    if self.back.lose(now) {
                        self.queue.reset();
                        station.handle_bus_off(now);
                    }
                }
                Some(CanInput::BusOn) => {
                    self.back.come_back(now);
                    self.use_again(now, station);
                }
                None => break,
            }
        }
        self.use_again(now, station);
    }

    fn use_again(&mut self, now: MonotonicTime, station: &mut dyn Station) {
        if self.back.take(now) {
            station.handle_bus_on(now);
        }
    }

    /// Sends what the station has to send, as long as there is room; the number of frames that could not be sent.
    pub(super) fn send(
        &mut self,
        now: MonotonicTime,
        port: &mut dyn CanPort,
        station: &mut dyn Station,
    ) -> u64 {
        let mut failures = 0;
        while let Some((frame, made)) = self.queue.take().or_else(|| station.poll(now)) {
            match self.queue.send(now, port, frame, made) {
                CanSent::Sent => self.occupied.count(&frame),
                CanSent::Full => break,
                CanSent::Failed => {
                    failures += 1;
                    station.handle_failure(frame.id());
                }
            }
        }
        failures
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use super::*;

    /// A controller with these inputs and so much room.
    struct Controller(VecDeque<CanInput>, usize);

    impl CanPort for Controller {
        fn receive(&mut self, _: MonotonicTime) -> Option<CanInput> {
            self.0.pop_front()
        }

        fn send(&mut self, _: MonotonicTime, _: &Frame) -> CanSent {
            match self.1.checked_sub(1) {
                Some(left) => {
                    self.1 = left;
                    CanSent::Sent
                }
                None => CanSent::Full,
            }
        }
    }

    /// Records its calls, and sends these frames.
    #[derive(Default)]
    struct Notes(Vec<String>, VecDeque<Frame>);

    impl Station for Notes {
        fn handle_frame(&mut self, _: MonotonicTime, frame: &Frame) {
            self.0.push(frame.id().to_string());
        }

        fn handle_bus_off(&mut self, _: MonotonicTime) {
            self.0.push("off".into());
        }

        fn handle_bus_on(&mut self, _: MonotonicTime) {
            self.0.push("on".into());
        }

        fn poll(&mut self, now: MonotonicTime) -> Option<(Frame, MonotonicTime)> {
            self.1.pop_front().map(|frame| (frame, now))
        }

        fn handle_failure(&mut self, id: Id) {
            self.0.push(format!("failed {id}"));
        }
    }

    fn frame(id: u16) -> Frame {
        Frame::new(Id::Standard(id), &[]).unwrap()
    }

    const NOW: MonotonicTime = MonotonicTime(1_000_000_000);

    #[test]
    fn nothing_is_heard_while_the_controller_is_off_the_bus() {
        let mut link = CanLink::new(DurationNs::from_millis(4));
        let inputs = [
            CanInput::Frame(frame(0x181)),
            CanInput::BusOff,
            CanInput::BusOff,
            CanInput::Frame(frame(0x182)),
            CanInput::BusOn,
            CanInput::Frame(frame(0x183)),
        ];
        let mut notes = Notes::default();
        link.receive(NOW, &mut Controller(inputs.into(), 0), &mut notes);
        assert_eq!(
            notes.0,
            [frame(0x181).id().to_string(), "off".into(), "on".into(), frame(0x183).id().to_string()]
        );
        assert!(link.is_used());
    }

    #[test]
    fn a_return_that_does_not_last_is_followed_by_a_pause_that_ends_by_itself() {
        let mut link = CanLink::new(DurationNs::from_millis(4));
        let mut notes = Notes::default();
        let twice = [CanInput::BusOff, CanInput::BusOn, CanInput::BusOff, CanInput::BusOn];
        link.receive(NOW, &mut Controller(twice.into(), 0), &mut notes);
        assert_eq!(notes.0, ["off", "on", "off"]);
        assert!(!link.is_used());
        let mut silent = Controller(VecDeque::new(), 0);
        link.receive(NOW + DurationNs::from_millis(499), &mut silent, &mut notes);
        assert_eq!(notes.0.len(), 3);
        link.receive(NOW + DurationNs::from_millis(500), &mut silent, &mut notes);
        assert_eq!(notes.0.last().map(String::as_str), Some("on"));
    }

    #[test]
    fn frames_leave_in_order_and_an_old_one_is_reported_as_not_sent() {
        let mut link = CanLink::new(DurationNs::from_millis(4));
        let mut notes = Notes::default();
        notes.1.extend([frame(0x201), frame(0x202), frame(0x203)]);
        let mut controller = Controller(VecDeque::new(), 1);
        assert_eq!(link.send(NOW, &mut controller, &mut notes), 0);
        assert!(
            !link.is_drained() && notes.1.len() == 1,
            "the second one waits, the third one is not asked for"
        );
        controller.1 = 2;
        let late = NOW + DurationNs::from_millis(5);
        assert_eq!(link.send(late, &mut controller, &mut notes), 1);
        assert_eq!(notes.0, [format!("failed {}", frame(0x202).id())]);
        assert!(link.is_drained() && controller.1 == 1, "the third one is new");
    }

    #[test]
    fn frames_that_pass_occupy_the_bus_and_one_that_waits_does_not() {
        let mut link = CanLink::new(DurationNs::from_millis(4));
        assert_eq!(link.detail(), BusDetail::Can { nominal: 0, data: 0 });
        let mut notes = Notes::default();
        link.receive(NOW, &mut Controller([CanInput::Frame(frame(0x181))].into(), 0), &mut notes);
        notes.1.extend([frame(0x201), frame(0x202)]);
        link.send(NOW, &mut Controller(VecDeque::new(), 1), &mut notes);
        // 47 bits and 8 stuff bits each, of the frame that came and the one that was sent.
        assert_eq!(link.detail(), BusDetail::Can { nominal: 2 * 55, data: 0 });
    }

    #[test]
    fn a_frame_that_waits_is_not_sent_after_the_controller_was_off_the_bus() {
        let mut link = CanLink::new(DurationNs::from_millis(4));
        let mut notes = Notes::default();
        notes.1.extend([frame(0x201), frame(0x202)]);
        link.send(NOW, &mut Controller(VecDeque::new(), 1), &mut notes);
        assert!(!link.is_drained());
        let back = [CanInput::BusOff, CanInput::BusOn];
        link.receive(NOW, &mut Controller(back.into(), 0), &mut notes);
        assert!(link.is_drained() && link.is_used(), "it is old, and the bus may be used");
    }
}
