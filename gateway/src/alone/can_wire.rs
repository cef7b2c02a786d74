//! The frames of one CAN interface, as a line of a session takes and sends them.

use profile_generic::can::Frame;
use profile_generic::time::{DurationNs, MonotonicTime};

use crate::engine::port::{CanInput, CanPort, CanSent, OFF_THE_BUS, UNACKNOWLEDGED};

/// Frames taken in one step at most.
pub const FRAMES_PER_STEP: usize = 64;

/// How often what does not fit the transmit queue is offered again.
const FULL_PAUSE: DurationNs = DurationNs::from_millis(1);

/// How long the transmit queue may stay full: then nobody acknowledges what is sent.
const STUCK_MAX: DurationNs = DurationNs::from_secs(1);

/// An interface, and the frame for which its transmit queue had no room.
pub struct CanWire {
    port: Box<dyn CanPort>,
    /// The frame, and since when it waits.
    held: Option<(Frame, MonotonicTime)>,
    again: Option<MonotonicTime>,
}

impl CanWire {
    /// Without a frame that waits.
    #[must_use]
    pub fn new(port: Box<dyn CanPort>) -> Self {
        Self { port, held: None, again: None }
    }

    /// The next frame that has come.
    ///
    /// # Errors
    /// The interface is off the bus.
    pub fn receive(&mut self, now: MonotonicTime) -> Result<Option<Frame>, String> {
        loop {
            match self.port.receive(now) {
                Some(CanInput::Frame(frame)) => return Ok(Some(frame)),
                Some(CanInput::BusOff) => return Err(OFF_THE_BUS.to_owned()),
                Some(CanInput::Transmitted | CanInput::BusOn) => {}
                None => return Ok(None),
            }
        }
    }

    /// Sends what there is, as far as there is room.
    ///
    /// # Errors
    /// There was none for too long.
    pub fn send(
        &mut self,
        now: MonotonicTime,
        mut next: impl FnMut() -> Option<Frame>,
    ) -> Result<(), String> {
        self.again = None;
        loop {
            let frame = self.held.take().or_else(|| next().map(|frame| (frame, now)));
            let Some((frame, since)) = frame else { return Ok(()) };
            if self.port.send(now, &frame) == CanSent::Full {
                if now.since(since) > STUCK_MAX {
                    return Err(UNACKNOWLEDGED.to_owned());
                }
                (self.held, self.again) = (Some((frame, since)), Some(now + FULL_PAUSE));
                return Ok(());
            }
        }
    }

    /// Whether no frame waits.
    #[must_use]
    pub const fn is_drained(&self) -> bool {
        self.held.is_none()
    }

    /// When the frame that waits is offered again; nothing else can be sent before then.
    #[must_use]
    pub const fn wake_at(&self) -> Option<MonotonicTime> {
        self.again
    }
}
