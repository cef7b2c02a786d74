//! Homing: the position gets its reference to the machine.
//!
//! ```text
//! S-0-0148, drive controlled         the drive moves by itself and ignores command values until the command is cancelled
//!   leave     the home switch is active at the start: back out of it
//!   switch    S-0-0147 bit 0 says which way, S-0-0041 how fast, S-0-0042 how quickly; bit 5 = 1 does without
//!   marker    the first one behind the edge of the switch; bit 6 = 1 does without
//!   approach  bit 7 = 1: to the reference point; else to a stop
//!   done      S-0-0403 = 1; the reference point, S-0-0150 behind the marker, has the position S-0-0052
//!
//! S-0-0146, control unit controlled  the master moves the axis; the drive watches for switch and marker, S-0-0408 = 1
//! S-0-0171                           S-0-0175 = what the positions are off
//! S-0-0172                           positions shift by it, S-0-0403 = 1; no command value counts until it is cancelled
//!
//! S-0-0191 cancels the reference. S-0-0447 gives the place where the axis stands the position S-0-0052.
//! ```
//!
//! What the drive does on S-0-0148 is how Rexroth, Metronix and Kollmorgen drives do it. The meaning of S-0-0171, 0172,
//! 0175 and 0408 beyond their names is told by no public source.

use profile_generic::quantity::Position;
use profile_generic::servo::motion::{Motion, Pace};

use super::scaling::Scales;
use crate::slave::application::Progress;
use crate::slave::parameter::{Definition, Store};
use crate::wire::idn::Idn;

/// Bits of S-0-0147.
mod bits {
    pub const NEGATIVE: i64 = 1;
    pub const NO_SWITCH: i64 = 1 << 5;
    pub const NO_MARKER: i64 = 1 << 6;
    pub const TO_REFERENCE: i64 = 1 << 7;
    /// What the drive can do; bit 2, switch connected to the drive, is how it is anyway.
    pub const KNOWN: i64 = NEGATIVE | 1 << 2 | NO_SWITCH | NO_MARKER | TO_REFERENCE;
}

/// Element 3.
mod attribute {
    pub const BITS: u32 = 0x4001_0001;
    pub const BITS_READ: u32 = 0x7001_0001;
    pub const COMMAND_CP4: u32 = 0x3009_0001;
    pub const COMMAND: u32 = 0x0009_0001;
    pub const POSITION: u32 = 0x0422_0001;
    pub const POSITION_READ: u32 = 0x7422_0001;
    pub const VELOCITY: u32 = 0x0322_0001;
}

/// Adds the parameters of homing.
pub fn define(store: &mut Store, length: &'static str, speed: &'static str) {
    use attribute as a;
    let value = |idn, attribute, name| Definition::value(idn, attribute, name, 0);
    let command = Definition::command;
    let double = i64::from(i32::MAX);
    let definitions = [
        value(Idn::HOMING_VELOCITY, a::VELOCITY, "Homing velocity").unit(speed).range(1, double),
        value(Idn::HOMING_ACCELERATION, a::VELOCITY, "Homing acceleration").range(1, double),
        value(Idn::REFERENCE_DISTANCE_1, a::POSITION, "Reference distance 1").unit(length),
        value(Idn::REFERENCE_OFFSET_1, a::POSITION, "Reference offset 1").unit(length),
        value(Idn::HOMING_PARAMETER, a::BITS, "Homing parameter"),
        value(Idn::MARKER_POSITION_A, a::POSITION_READ, "Marker position A").unit(length),
        value(Idn::DISPLACEMENT_PARAMETER_1, a::POSITION_READ, "Displacement parameter 1").unit(length),
        value(Idn::REFERENCE_MARKER_PULSE_REGISTERED, a::BITS_READ, "Reference marker pulse registered"),
        command(Idn::DRIVE_CONTROLLED_HOMING, a::COMMAND_CP4, "Drive controlled homing procedure command"),
        command(
            Idn::CONTROL_UNIT_CONTROLLED_HOMING,
            a::COMMAND_CP4,
            "Control unit controlled homing procedure command",
        ),
        command(Idn::CALCULATE_DISPLACEMENT, a::COMMAND_CP4, "Calculate displacement procedure command"),
        command(
            Idn::DISPLACEMENT_TO_THE_REFERENCED_SYSTEM,
            a::COMMAND_CP4,
            "Displacement to the referenced system procedure command",
        ),
        command(Idn::CANCEL_REFERENCE_POINT, a::COMMAND, "Cancel reference point procedure command"),
        command(Idn::SET_ABSOLUTE_POSITION, a::COMMAND, "Set absolute position procedure command"),
    ];
    for definition in definitions {
        store.define(definition);
    }
}

/// Whether the drive can home by this S-0-0147.
pub fn is_possible(parameter: i64) -> bool {
    let nothing = bits::NO_SWITCH | bits::NO_MARKER;
    parameter & !bits::KNOWN == 0 && parameter & nothing != nothing
}

/// Where homing stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Step {
    #[default]
    Idle,
    Leave,
    Switch,
    /// Behind the edge of the switch at this position, if there was one.
    Marker(Option<i64>),
    /// On to this position, or to a stop; the place of the marker is known.
    Approach {
        marker: i64,
        target: Option<i64>,
    },
    Done,
    Failed,
    /// Cancelled on the way: to a stop, then command values count again.
    Stopping,
}

/// What the drive senses in a cycle, nanounits.
#[derive(Debug, Clone, Copy)]
pub(super) struct Senses {
    /// The home switch is active.
    pub switch: bool,
    /// Where it went active since the last cycle.
    pub edge: Option<Position>,
    /// Where a marker was since the last cycle.
    pub marker: Option<Position>,
    /// The drive could follow a set-point.
    pub able: bool,
    /// Time since the last cycle, nanoseconds.
    pub span: i64,
}

/// State of homing.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Homing {
    /// S-0-0148.
    by_drive: Step,
    /// S-0-0146.
    by_master: Step,
    /// Place of the marker that counts.
    marker: Option<i64>,
    /// S-0-0172 is set: no command value counts.
    displaced: bool,
}

impl Homing {
    /// Whether the drive moves, or stands, by itself.
    pub fn leads(&self) -> bool {
        self.by_drive != Step::Idle || self.displaced
    }

    pub fn start_by_drive(&mut self, store: &Store, switch: bool) {
        let without = store.number_of(Idn::HOMING_PARAMETER) & bits::NO_SWITCH != 0;
        self.by_drive = match (without, switch) {
            (true, _) => Step::Marker(None),
            (false, true) => Step::Leave,
            (false, false) => Step::Switch,
        };
    }

    pub fn start_by_master(&mut self, store: &mut Store) {
        let without = store.number_of(Idn::HOMING_PARAMETER) & bits::NO_SWITCH != 0;
        self.marker = None;
        store.set_number_of(Idn::REFERENCE_MARKER_PULSE_REGISTERED, 0);
        self.by_master = if without { Step::Marker(None) } else { Step::Switch };
    }

    /// The master cancels S-0-0148.
    pub fn cancel_by_drive(&mut self) {
        self.by_drive = match self.by_drive {
            Step::Idle | Step::Done | Step::Failed => Step::Idle,
            _ => Step::Stopping,
        };
    }

    /// The master cancels S-0-0146.
    pub fn cancel_by_master(&mut self) {
        self.by_master = Step::Idle;
    }

    pub fn set_displaced(&mut self, displaced: bool) {
        self.displaced = displaced;
    }

    pub fn progress_by_drive(&self) -> Progress {
        progress(self.by_drive)
    }

    pub fn progress_by_master(&self) -> Progress {
        progress(self.by_master)
    }

    /// What the positions are off, as S-0-0171 calculates it; `None` before a marker was registered.
    pub fn displacement(&self, store: &Store, scales: &Scales) -> Option<i64> {
        Some(reference_of(store, scales) - (self.marker? + offset_of(store, scales)))
    }

    /// The place of the axis is `shift` more than it was.
    pub fn shifted(&mut self, shift: i64) {
        self.marker = self.marker.map(|marker| marker.saturating_add(shift));
    }

    /// S-0-0146: watches while the master moves the axis.
    pub fn watch(&mut self, senses: &Senses, store: &mut Store, counts: impl Fn(i64) -> i64) {
        let parameter = store.number_of(Idn::HOMING_PARAMETER);
        self.by_master = match self.by_master {
            Step::Switch => senses.edge.map_or(Step::Switch, |edge| Step::Marker(Some(edge.0))),
            Step::Marker(edge) => match found(edge, senses, parameter, store) {
                Some(marker) => {
                    self.marker = Some(marker);
                    store.set_number_of(Idn::MARKER_POSITION_A, counts(marker));
                    store.set_number_of(Idn::REFERENCE_MARKER_PULSE_REGISTERED, 1);
                    Step::Done
                }
                None => Step::Marker(edge),
            },
            other => other,
        };
    }

    /// S-0-0148: one cycle. Returns by how much positions shift, at the end.
    pub fn advance(
        &mut self,
        motion: &mut Motion,
        senses: &Senses,
        store: &mut Store,
        scales: &Scales,
        counts: impl Fn(i64) -> i64,
    ) -> Option<i64> {
        let parameter = store.number_of(Idn::HOMING_PARAMETER);
        let way = way_of(parameter, store);
        let quick = scales.acceleration.generic(store.number_of(Idn::HOMING_ACCELERATION)).max(1);
        let velocity = scales.velocity.generic(store.number_of(Idn::HOMING_VELOCITY)).max(1);
        let pace = Pace { velocity, acceleration: quick, deceleration: quick };
        if !senses.able && !matches!(self.by_drive, Step::Idle | Step::Done) {
            // Without torque, or halted for good: it cannot be brought to an end.
            self.by_drive = if self.by_drive == Step::Stopping { Step::Idle } else { Step::Failed };
        }
        match self.by_drive {
            Step::Idle => {}
            Step::Done | Step::Failed => motion.advance(senses.span, 0, pace),
            Step::Stopping => {
                motion.advance(senses.span, 0, pace);
                if motion.velocity == 0 {
                    self.by_drive = Step::Idle;
                }
            }
            Step::Leave => {
                motion.advance(senses.span, -way * velocity, pace);
                if !senses.switch {
                    self.by_drive = Step::Switch;
                }
            }
            Step::Switch => {
                motion.advance(senses.span, way * velocity, pace);
                if let Some(edge) = senses.edge {
                    self.by_drive = self.behind(Some(edge.0), senses, parameter, store, scales);
                }
            }
            Step::Marker(edge) => {
                motion.advance(senses.span, way * velocity, pace);
                self.by_drive = self.behind(edge, senses, parameter, store, scales);
            }
            Step::Approach { marker, target } => {
                let there = match target {
                    Some(target) => motion.advance_to(senses.span, target, pace),
                    None => {
                        motion.advance(senses.span, 0, pace);
                        motion.velocity == 0
                    }
                };
                if there {
                    self.by_drive = Step::Done;
                    self.marker = Some(marker);
                    store.set_number_of(Idn::MARKER_POSITION_A, counts(marker));
                    return self.displacement(store, scales);
                }
            }
        }
        None
    }

    /// Behind the switch: the marker, or the switch itself where no marker counts.
    fn behind(
        &self,
        edge: Option<i64>,
        senses: &Senses,
        parameter: i64,
        store: &Store,
        scales: &Scales,
    ) -> Step {
        let Some(marker) = found(edge, senses, parameter, store) else { return Step::Marker(edge) };
        let reference = marker + offset_of(store, scales);
        let target = (parameter & bits::TO_REFERENCE != 0).then_some(reference);
        Step::Approach { marker, target }
    }
}

/// The place that counts: a marker that was not passed before the switch, or the switch.
fn found(edge: Option<i64>, senses: &Senses, parameter: i64, store: &Store) -> Option<i64> {
    if parameter & bits::NO_MARKER != 0 {
        return edge;
    }
    let marker = senses.marker?.0;
    let way = way_of(parameter, store);
    edge.is_none_or(|edge| (marker - edge) * way >= 0).then_some(marker)
}

fn progress(step: Step) -> Progress {
    match step {
        Step::Done => Progress::Done,
        Step::Failed | Step::Idle => Progress::Failed,
        _ => Progress::InProcess,
    }
}

/// Positions and directions are those of the feedback value, which may be inverted.
fn sign_of(store: &Store) -> i64 {
    const INVERTED: i64 = 1 << 2;
    if store.number_of(Idn::POSITION_POLARITY_PARAMETERS) & INVERTED == 0 { 1 } else { -1 }
}

fn way_of(parameter: i64, store: &Store) -> i64 {
    if parameter & bits::NEGATIVE != 0 { -sign_of(store) } else { sign_of(store) }
}

fn reference_of(store: &Store, scales: &Scales) -> i64 {
    sign_of(store) * scales.position.generic(store.number_of(Idn::REFERENCE_DISTANCE_1))
}

fn offset_of(store: &Store, scales: &Scales) -> i64 {
    sign_of(store) * scales.position.generic(store.number_of(Idn::REFERENCE_OFFSET_1))
}

#[cfg(test)]
mod tests;
