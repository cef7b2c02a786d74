//! The text of a scene.

use std::fmt::Write as _;

use profile_generic::mode::OperatingMode;
use profile_generic::time::{DurationNs, MonotonicTime};

use crate::config::Config;
use crate::engine::axis::AxisChannel;
use crate::engine::notice::Notice;

/// Time whose frames share a checksum.
const BLOCK: DurationNs = DurationNs::from_millis(100);

/// FNV-1a, 32 bits.
const FNV_OFFSET: u32 = 0x811C_9DC5;
const FNV_PRIME: u32 = 0x0100_0193;

/// Frames, and a checksum of their bytes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sum {
    frames: u32,
    sum: u32,
}

impl Default for Sum {
    fn default() -> Self {
        Self { frames: 0, sum: FNV_OFFSET }
    }
}

impl Sum {
    /// Adds a frame; its length tells it from the next one.
    pub fn add(&mut self, bytes: &[u8]) {
        let length = u32::try_from(bytes.len()).unwrap_or(u32::MAX).to_le_bytes();
        self.frames += 1;
        for byte in length.iter().chain(bytes) {
            self.sum = (self.sum ^ u32::from(*byte)).wrapping_mul(FNV_PRIME);
        }
    }
}

/// What has happened so far.
pub(super) struct Recording {
    text: String,
    start: MonotonicTime,
    block_end: MonotonicTime,
    devices: Vec<String>,
    axes: Vec<String>,
    buses: Vec<String>,
    stream: Sum,
}

impl Recording {
    pub fn new(config: &Config, start: MonotonicTime) -> Self {
        let mut buses = Vec::new();
        buses.extend(config.sercos.iter().map(|_| "sercos".to_owned()));
        buses.extend((1..=config.can.len()).map(|number| format!("can {number}")));
        buses.extend((1..=config.devicenet.len()).map(|number| format!("devicenet {number}")));
        Self {
            text: String::new(),
            start,
            block_end: start + BLOCK,
            devices: config.devices.iter().map(|device| device.name.clone()).collect(),
            axes: config.axes.iter().map(|axis| axis.name.clone()).collect(),
            buses,
            stream: Sum::default(),
        }
    }

    pub fn text(self) -> String {
        self.text
    }

    /// A line with its time.
    pub fn say(&mut self, now: MonotonicTime, text: &str) {
        let micros = now.since(self.start).as_nanos() / 1_000;
        // Writing to a string does not fail.
        let _ = writeln!(self.text, "{:>3}.{:06}  {text}", micros / 1_000_000, micros % 1_000_000);
    }

    /// What the box has said in its log.
    pub fn notice(&mut self, now: MonotonicTime, notice: &Notice) {
        let axis = notice.axis().and_then(|axis| self.axes.get(usize::from(axis)));
        let text = axis.map_or_else(|| format!("log: {notice}"), |axis| format!("log: {axis}: {notice}"));
        self.say(now, &text);
    }

    /// Bytes on the stream to the controller.
    pub fn stream(&mut self, bytes: &[u8]) {
        self.stream.add(bytes);
    }

    /// Whether a block has ended.
    pub fn is_due(&self, now: MonotonicTime) -> bool {
        now >= self.block_end
    }

    /// A block has ended: what was sent to controllers and buses in it, and where the axes are.
    pub fn block(&mut self, now: MonotonicTime, north: Vec<Sum>, south: Vec<Sum>, axes: &[AxisChannel]) {
        self.block_end = now + BLOCK;
        let stream = (&"stream".to_owned(), std::mem::take(&mut self.stream));
        let sent = self.devices.iter().zip(north).chain([stream]).chain(self.buses.iter().zip(south));
        let mut parts: Vec<String> = sent
            .filter(|(_, sum)| sum.frames > 0)
            .map(|(name, sum)| format!("{name} {} {:08x}", sum.frames, sum.sum))
            .collect();
        parts.extend(self.axes.iter().zip(axes).map(|(name, axis)| {
            let (command, feedback) = (axis.command(), axis.feedback());
            let set_point = match command.mode {
                OperatingMode::Position => command.position.to_string(),
                OperatingMode::Velocity => command.velocity.to_string(),
                OperatingMode::Torque => command.torque.to_string(),
                mode => mode.to_string(),
            };
            format!("{name} {} {set_point} -> {}", axis.state(), feedback.position)
        }));
        self.say(now, &parts.join(" | "));
    }
}
