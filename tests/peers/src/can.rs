//! A frame of a CAN bus, and what every station on one can do.

/// A data or remote frame with an 11-bit identifier.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// The identifier, 0 to 7FFh.
    pub id: u16,
    /// A remote frame; its data are empty.
    pub remote: bool,
    /// At most eight bytes.
    pub data: Vec<u8>,
}

impl Frame {
    /// A data frame.
    #[must_use]
    pub fn new(id: u16, data: &[u8]) -> Self {
        Self { id, remote: false, data: data.to_vec() }
    }
}

/// A station on a CAN bus. Times are microseconds of one clock that never goes back.
pub trait Station {
    /// Hears a frame of somebody else; what it says goes to the end of `out`.
    fn hear(&mut self, now_us: u64, frame: &Frame, out: &mut Vec<Frame>);

    /// Lets time pass: motion, heartbeats, timers. Called at least once a millisecond.
    fn tick(&mut self, now_us: u64, out: &mut Vec<Frame>);
}
