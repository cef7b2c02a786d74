//! A simulated node of a CAN bus that events act on.

use std::fmt;

use profile_generic::can::Frame;
use profile_generic::quantity::Position;
use profile_generic::servo::Servo;
use profile_generic::time::MonotonicTime;

use super::can_bus::CanNode;
use super::drive_events::{Change, Shown, SimulatedDrives};

/// A node with drives that events can act on.
pub trait ActingNode: CanNode {
    /// What is shown of a drive.
    type State: Silent;

    /// The state of a drive.
    fn state(&self, drive: u16) -> Option<Self::State>;

    /// The servo of a drive.
    fn servo_mut(&mut self, drive: u16) -> Option<&mut Servo>;

    /// Switches the main power of a drive.
    fn set_power(&mut self, drive: u16, on: bool);

    /// Places the limit switches of a drive; `false` where it has none.
    fn set_limit_switches(&mut self, _drive: u16, _lower: Position, _upper: Position) -> bool {
        false
    }

    /// Why it cannot carry out a change.
    fn refuses(&self, _change: Change) -> Option<&'static str> {
        None
    }
}

/// A state that can show silence.
pub trait Silent: Copy + PartialEq + fmt::Debug + fmt::Display {
    /// The same, silent or not.
    #[must_use]
    fn with_silence(self, silent: bool) -> Self;
}

impl<L, S> Silent for Shown<L, S>
where
    L: Copy + PartialEq + fmt::Debug + fmt::Display,
    S: Copy + PartialEq + fmt::Debug + fmt::Display,
{
    fn with_silence(self, silent: bool) -> Self {
        Self { silent, ..self }
    }
}

/// A node that can fall silent: it then takes and sends no frames while its time passes.
#[derive(Debug)]
pub struct Actor<N> {
    node: N,
    silent: bool,
}

impl<N> Actor<N> {
    /// A node that is not silent.
    pub const fn new(node: N) -> Self {
        Self { node, silent: false }
    }

    /// The node that the script acts on.
    pub const fn node(&self) -> &N {
        &self.node
    }

    /// The node, to act on it from outside.
    pub const fn node_mut(&mut self) -> &mut N {
        &mut self.node
    }
}

impl<N: ActingNode> SimulatedDrives for Actor<N> {
    type State = N::State;

    fn state(&self, drive: u16) -> Option<N::State> {
        self.node.state(drive).map(|state| state.with_silence(self.silent))
    }

    fn apply(&mut self, drive: u16, change: Change) -> Result<(), &'static str> {
        act_on(&mut self.node, drive, change, |silent| self.silent = silent)
    }
}

/// Carries out a change in a node. Silence is that of all its axes, and left to `silence`.
///
/// # Errors
/// Why this drive cannot do it.
pub fn act_on<N: ActingNode>(
    node: &mut N,
    drive: u16,
    change: Change,
    silence: impl FnOnce(bool),
) -> Result<(), &'static str> {
    if let Some(reason) = node.refuses(change) {
        return Err(reason);
    }
    let servo = node.servo_mut(drive).ok_or("there is no such drive")?;
    if change.apply_to(servo) {
        return Ok(());
    }
    match change {
        Change::Power(on) => node.set_power(drive, on),
        Change::Silence(silent) => silence(silent),
        Change::LimitSwitches(lower, upper) if !node.set_limit_switches(drive, lower, upper) => {
            return Err("it has no limit switches");
        }
        _ => {}
    }
    Ok(())
}

impl<N: CanNode> CanNode for Actor<N> {
    fn start(&mut self, now: MonotonicTime) {
        self.node.start(now);
    }

    fn handle_frame(&mut self, now: MonotonicTime, frame: &Frame) {
        if !self.silent {
            self.node.handle_frame(now, frame);
        }
    }

    fn handle_time(&mut self, now: MonotonicTime) {
        self.node.handle_time(now);
    }

    fn poll(&mut self, now: MonotonicTime) -> Option<Frame> {
        if !self.silent {
            return self.node.poll(now);
        }
        while self.node.poll(now).is_some() {}
        None
    }

    fn wake_at(&self) -> MonotonicTime {
        self.node.wake_at()
    }

    fn bus_off(&mut self, now: MonotonicTime) {
        self.node.bus_off(now);
    }

    fn bus_on(&mut self) {
        self.node.bus_on();
    }

    fn overrun(&mut self) {
        self.node.overrun();
    }
}
