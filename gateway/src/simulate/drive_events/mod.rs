//! Events that make simulated drives misbehave: one vocabulary for the drives of every bus, read from a file and typed by a person.
//!
//! | file | what it holds |
//! |---|---|
//! | `reader` | the words: a line becomes an [`Order`] |
//! | `player` | the time: events begin and end, and state changes are reported |
//! | `console` | standard input and standard error of a process |
//! | `setup` | what a drive is built with: encoder, gear, rated torque |

pub mod console;
pub mod player;
mod reader;
pub mod setup;
#[cfg(test)]
mod tests;

use std::fmt;
use std::ops::RangeInclusive;

use profile_generic::capture::CaptureWindow;
use profile_generic::cast;
use profile_generic::fault::{FaultCause, Reaction};
use profile_generic::quantity::Position;
use profile_generic::servo::{Servo, ServoParameters};
use profile_generic::time::DurationNs;

pub use self::reader::{Order, Script, causes, help};
use crate::config::duration;

/// A delay of a drive that can be set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delay {
    /// From main power to ready.
    Ready,
    /// From the enable to the torque: commutation.
    Torque,
    /// The brake opens after the torque has come, and closes before it ends.
    Brake,
}

/// What changes in a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// The condition of a fault begins.
    Fault(FaultCause),
    /// The condition of a fault ends, or those of all; the drive still waits for its reset.
    Clear(Option<FaultCause>),
    /// A warning begins, or ends.
    Warning(Option<FaultCause>),
    /// Main power.
    Power(bool),
    /// The master hears nothing from the drive. On CAN the drive hears nothing either; on SERCOS it still takes telegrams.
    Silence(bool),
    /// Feedback values stay as they are.
    Freeze(bool),
    /// The encoder counts a motion that there was none.
    Jump(Position),
    /// A delay is set.
    Delay(Delay, DurationNs),
    /// A registration input, 1 or 2, is switched.
    Registration(usize, bool),
    /// Where the home switch is closed.
    HomeSwitch(Option<CaptureWindow>),
    /// The limit switches close at and below, and at and above these places.
    LimitSwitches(Position, Position),
}

impl Change {
    /// What ends it, for changes that may last for a time.
    #[must_use]
    pub const fn end(self) -> Option<Self> {
        match self {
            Self::Fault(cause) => Some(Self::Clear(Some(cause))),
            Self::Warning(Some(_)) => Some(Self::Warning(None)),
            Self::Power(false) => Some(Self::Power(true)),
            Self::Silence(true) => Some(Self::Silence(false)),
            Self::Freeze(true) => Some(Self::Freeze(false)),
            Self::Registration(number, true) => Some(Self::Registration(number, false)),
            _ => None,
        }
    }

    /// Carries out what concerns the servo alone; `false` for main power, silence and limit switches, which are the drive's own.
    pub fn apply_to(self, servo: &mut Servo) -> bool {
        match self {
            Self::Fault(cause) => {
                // A cause that only alarms by itself is a fault here all the same: somebody asked for one.
                let reaction = cause.default_reaction();
                let stops = if reaction.stops() { reaction } else { Reaction::DecelerateAndDisable };
                servo.raise_fault_with(cause, stops);
            }
            Self::Clear(Some(cause)) => servo.clear_fault(cause),
            Self::Clear(None) => servo.clear_faults(),
            Self::Warning(cause) => servo.set_warning(cause),
            Self::Freeze(frozen) => servo.set_frozen(frozen),
            Self::Jump(distance) => servo.jump_position(distance),
            Self::Delay(delay, time) => {
                let mut parameters: ServoParameters = *servo.parameters();
                match delay {
                    Delay::Ready => parameters.power_up_time = time,
                    Delay::Torque => parameters.starting_time = time,
                    Delay::Brake => parameters.brake_time = time,
                }
                // The reader has no times below zero, the only ones that a servo refuses.
                let _ = servo.set_parameters(parameters);
            }
            Self::Registration(number, on) => servo.set_registration(number, on),
            Self::HomeSwitch(window) => servo.set_home_switch(window),
            Self::Power(_) | Self::Silence(_) | Self::LimitSwitches(..) => return false,
        }
        true
    }
}

/// As a line of the script has it.
impl fmt::Display for Change {
    // A flat match: one arm for each variant.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let on_off = |on: bool| if on { "on" } else { "off" };
        let units = |place: Position| cast::f64_from_i64(place.0) / 1e9;
        match self {
            Self::Fault(cause) => write!(f, "fault {cause}"),
            Self::Clear(Some(cause)) => write!(f, "clear {cause}"),
            Self::Clear(None) => f.write_str("clear"),
            Self::Warning(Some(cause)) => write!(f, "warning {cause}"),
            Self::Warning(None) => f.write_str("warning off"),
            Self::Power(on) => write!(f, "power {}", on_off(*on)),
            Self::Silence(on) => write!(f, "silence {}", on_off(*on)),
            Self::Freeze(on) => write!(f, "freeze {}", on_off(*on)),
            Self::Jump(distance) => write!(f, "jump {}", units(*distance)),
            Self::Delay(delay, time) => {
                let delay = match delay {
                    Delay::Ready => "ready",
                    Delay::Torque => "torque",
                    Delay::Brake => "brake",
                };
                write!(f, "delay {delay} {}", duration::show(*time))
            }
            Self::Registration(number, on) => write!(f, "registration_{number} {}", on_off(*on)),
            Self::HomeSwitch(Some(at)) => write!(f, "home_switch {} {}", units(at.from), units(at.to)),
            Self::HomeSwitch(None) => f.write_str("home_switch off"),
            Self::LimitSwitches(lower, upper) => {
                write!(f, "limit_switches {} {}", units(*lower), units(*upper))
            }
        }
    }
}

/// A change of one drive or of all, and how long it lasts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Event {
    /// The drive; `None` for all of them.
    pub drive: Option<u16>,
    /// What changes.
    pub change: Change,
    /// After this time it ends by itself.
    pub lasts: Option<DurationNs>,
}

/// The drives that events can name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Names {
    /// What one of them is called: `drive`, `axis`.
    pub what: &'static str,
    /// The numbers by which events name them.
    pub numbers: RangeInclusive<u16>,
}

/// Simulated drives that events act on.
pub trait SimulatedDrives {
    /// What is shown of a drive.
    type State: Copy + PartialEq + fmt::Debug + fmt::Display;

    /// The state of a drive.
    fn state(&self, drive: u16) -> Option<Self::State>;

    /// Where the motor of a drive is, in revolutions or millimetres; `None` where that is not shown.
    fn position(&self, drive: u16) -> Option<f64> {
        let _ = drive;
        None
    }

    /// Carries out a change.
    ///
    /// # Errors
    /// Why this drive cannot do it.
    fn apply(&mut self, drive: u16, change: Change) -> Result<(), &'static str>;
}

/// What is shown of a drive: how it stands on its network, its state, and what is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shown<L, S> {
    /// Communication phase or state.
    pub link: L,
    /// State of the drive.
    pub state: S,
    /// The fault that has stopped it.
    pub fault: Option<FaultCause>,
    /// The warning raised by an event.
    pub warning: Option<FaultCause>,
    /// The master hears nothing from it.
    pub silent: bool,
}

impl<L: fmt::Display, S: fmt::Display> fmt::Display for Shown<L, S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}", self.link, self.state)?;
        if let Some(fault) = self.fault {
            write!(f, ", fault {fault}")?;
        }
        if let Some(warning) = self.warning {
            write!(f, ", warning {warning}")?;
        }
        if self.silent { f.write_str(", silent") } else { Ok(()) }
    }
}
