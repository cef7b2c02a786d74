//! What a drive was sent, as the drive has it: from its own parameters, with its own scaling.

use axisbridge::simulate::can_drive::DriveNode;
use axisbridge::simulate::devicenet_drive::DevicenetNode;
use profile_cia402::drive::Mode;
use profile_cia402::drive::index;
use profile_cia402::drive::states::State;
use profile_cia402::node::drive::Axis;
use profile_cia402::node::drive::scaling::Scales as Cia402Scales;
use profile_cip::device::axis_state::AxisState;
use profile_cip::device::drive_link::{Command, DriveAction};
use profile_cip::wire::motion::CommandPosition;
use profile_generic::cast::{f64_from_i64, i64_from_f64};
use profile_generic::ratio::Ratio;
use profile_generic::state::Report;
use profile_generic::time::MonotonicTime;
use profile_sercos::slave::Slave;
use profile_sercos::slave::drive::Drive;
use profile_sercos::slave::drive::scaling::Scales as SercosScales;
use profile_sercos::wire::drive_words::{DriveControl, DriveStatus, ReadyState};
use profile_sercos::wire::idn::{Idn, connection};

use super::curve::Quantity;

/// Counts over which scales are measured: enough that their rounding does not show.
const MANY: i64 = 1_000_000_000;

/// Positions of 32 bits begin anew after so many.
const WORD: i64 = 1 << 32;

/// Bit of an operation mode: the drive makes its way by itself.
const DRIVE_CONTROLLED: i64 = 1 << 4;

/// Bit of the polarity of the position feedback value in S-0-0055; bit 0 is that of the command.
const FEEDBACK: i64 = 1 << 2;

/// Data blocks of the operation modes that bits 10..8 of S-0-0135 show.
const MODE_BLOCKS: [u16; 8] = [32, 33, 34, 35, 284, 285, 286, 287];

/// The scaling of a drive, from counts to generic units of the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scaling {
    /// Nanounits in a count of position: negative where the drive takes set-points the other way round than it reports
    /// positions.
    pub position: f64,
    /// Nanounits per second in a count of velocity, likewise.
    pub velocity: f64,
    /// Parts per million in a count of torque, likewise.
    pub torque: f64,
    /// Counts after which positions begin anew.
    pub modulo: i64,
    /// Nanounits of the axis in one of the servo.
    pub turn: f64,
    /// -1 where the servo counts the other way round than the axis.
    pub way_round: i64,
}

impl Scaling {
    /// Generic units in a count.
    #[must_use]
    pub const fn of(&self, quantity: Quantity) -> f64 {
        match quantity {
            Quantity::Position => self.position,
            Quantity::Velocity => self.velocity,
            Quantity::Torque => self.torque,
        }
    }

    /// Counts of a position of the servo.
    fn counts(&self, nanounits: i64) -> i64 {
        let position = f64_from_i64(self.way_round * nanounits) * self.turn;
        i64_from_f64((position / self.position).round())
    }

    /// The shorter way from one position to another, in counts.
    #[must_use]
    pub const fn way(&self, from: i64, to: i64) -> i64 {
        let ahead = to.wrapping_sub(from).rem_euclid(self.modulo);
        if ahead > self.modulo / 2 { ahead - self.modulo } else { ahead }
    }
}

/// What a drive follows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SetPoint {
    /// What it is of.
    pub quantity: Quantity,
    /// Counts, with what the drive adds to it.
    pub counts: i64,
    /// As it came, in generic units; a position only modulo.
    pub value: f64,
}

/// A drive, seen when new set-points have come to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Changes when new set-points have come.
    pub mark: u64,
    /// The set-point that it follows; `None` while it follows none of a controller.
    pub follows: Option<SetPoint>,
    /// Where the drive is, in counts of its set-points.
    pub actual_counts: i64,
    /// How fast it is, in nanounits per second of the axis.
    pub actual_velocity: f64,
}

fn sign(negative: bool) -> i64 {
    if negative { -1 } else { 1 }
}

fn factor(ratio: Option<Ratio>) -> f64 {
    ratio.map_or(1.0, |ratio| f64_from_i64(ratio.num()) / f64_from_i64(ratio.den()))
}

// ---- SERCOS ---------------------------------------------------------------------------------------------------------

/// The scaling that the parameters of a SERCOS drive make.
#[must_use]
pub fn sercos_scaling(slave: &Slave<Drive>) -> Option<Scaling> {
    let store = slave.store();
    let scales = SercosScales::read(store, slave.application().servo().parameters()).ok()?;
    // The axis counts as the drive reports its position, whichever way its motor turns.
    let way = sign(store.number_of(Idn::POSITION_POLARITY_PARAMETERS) & FEEDBACK != 0);
    let polarity = |idn| f64_from_i64(way * sign(store.number_of(idn) & 1 != 0));
    let many = f64_from_i64(MANY);
    Some(Scaling {
        position: polarity(Idn::POSITION_POLARITY_PARAMETERS) * f64_from_i64(scales.position.generic(MANY))
            / many,
        velocity: polarity(Idn::VELOCITY_POLARITY_PARAMETER) * f64_from_i64(scales.velocity.generic(MANY))
            / many,
        torque: polarity(Idn::TORQUE_POLARITY_PARAMETER) * f64_from_i64(scales.torque.generic(MANY)) / many,
        modulo: scales.modulo,
        turn: 1.0,
        way_round: way,
    })
}

/// The connection that brings S-0-0134, and what its C-CON says; it changes with each new production.
fn sercos_mark(slave: &Slave<Drive>) -> Option<u64> {
    let store = slave.store();
    let wanted = Idn::DRIVE_CONTROL.0.to_le_bytes();
    let brings = |x: &u8| {
        let list = store.find(Idn::connection(*x, connection::LIST)).map(|handle| store.get(handle).data());
        list.is_some_and(|list| list.chunks(4).any(|idn| idn == wanted))
    };
    let x = (0..4).find(brings)?;
    u64::try_from(store.number_of(Idn::connection(x, connection::CONTROL))).ok()
}

/// What a SERCOS drive follows.
#[must_use]
pub fn sercos(slave: &Slave<Drive>, scaling: &Scaling) -> Option<Reading> {
    let (store, drive) = (slave.store(), slave.application());
    let word = |idn| u16::try_from(store.number_of(idn)).unwrap_or_default();
    let control = DriveControl::from_bits_retain(word(Idn::DRIVE_CONTROL));
    let status = DriveStatus::from_bits_retain(word(Idn::DRIVE_STATUS));
    let asked = DriveControl::ON.union(DriveControl::ENABLE).union(DriveControl::RESTART);
    let operates = drive.actual().report == Report::Operating && status.ready() == ReadyState::InOperation;
    let mode = store.number_of(Idn::standard(MODE_BLOCKS[usize::from(status.mode() & 7)]));
    let quantity = match mode & 0x7 {
        1 => Some(Quantity::Torque),
        2 => Some(Quantity::Velocity),
        3 => Some(Quantity::Position),
        _ => None,
    };
    let leads_itself = mode & DRIVE_CONTROLLED != 0;
    let shows = status.contains(DriveStatus::FOLLOWS);
    let follows = operates && control.contains(asked) && shows && !leads_itself;
    let set_point = |quantity| {
        let (command, additive, polarity) = match quantity {
            Quantity::Position => {
                (Idn::POSITION_COMMAND, Idn::ADDITIVE_POSITION_COMMAND, Idn::POSITION_POLARITY_PARAMETERS)
            }
            Quantity::Velocity => {
                (Idn::VELOCITY_COMMAND, Idn::ADDITIVE_VELOCITY_COMMAND, Idn::VELOCITY_POLARITY_PARAMETER)
            }
            Quantity::Torque => {
                (Idn::TORQUE_COMMAND, Idn::ADDITIVE_TORQUE_COMMAND, Idn::TORQUE_POLARITY_PARAMETER)
            }
        };
        let polarity = store.number_of(polarity);
        let opposite = sign((polarity ^ polarity >> 1) & 1 != 0);
        let counts = store.number_of(command) + opposite * store.number_of(additive);
        SetPoint { quantity, counts, value: f64_from_i64(counts) * scaling.of(quantity) }
    };
    Some(Reading {
        mark: sercos_mark(slave)?,
        follows: quantity.filter(|_| follows).map(set_point),
        actual_counts: scaling.counts(drive.actual().position.0),
        actual_velocity: f64_from_i64(drive.actual().velocity.0) * scaling.turn,
    })
}

// ---- CANopen --------------------------------------------------------------------------------------------------------

/// The scaling that the objects of a CANopen drive make, of an axis whose `way` is that of a turn of the motor.
#[must_use]
pub fn canopen_scaling(node: &DriveNode, offset: u16, way: Option<Ratio>) -> Option<Scaling> {
    let dictionary = node.dictionary();
    let scales = Cia402Scales::read(dictionary, offset)?;
    // Turns of the load in one of the motor.
    let gear = |sub| dictionary.number(index::GEAR_RATIO + offset, sub);
    let gear = if gear(1) > 0 && gear(2) > 0 { f64_from_i64(gear(2)) / f64_from_i64(gear(1)) } else { 1.0 };
    let (many, way) = (f64_from_i64(MANY), factor(way) * gear);
    let limit = |sub| dictionary.number(index::RANGE_LIMIT + offset, sub);
    // Position objects of both directions have the same polarity.
    let position = f64_from_i64(scales.position.servo(MANY));
    let turns = scales.position_sign() * scales.velocity_sign();
    let velocity = f64_from_i64(turns * scales.velocity.servo(MANY));
    Some(Scaling {
        position: position / many * way,
        velocity: velocity / many * way,
        torque: f64_from_i64(profile_cia402::node::drive::scaling::TORQUE),
        modulo: if limit(1) < limit(2) { limit(2) - limit(1) + 1 } else { WORD },
        turn: way,
        way_round: scales.position_sign(),
    })
}

/// What a CANopen drive follows.
#[must_use]
pub fn canopen(node: &DriveNode, axis: &Axis, offset: u16, scaling: &Scaling) -> Option<Reading> {
    const ENABLED: i64 = 0x0F;
    const HALT: i64 = 1 << 8;
    let number = |index: u16| node.dictionary().number(index + offset, 0);
    let quantity = match i8::try_from(number(index::MODE_DISPLAY)).map(Mode) {
        Ok(Mode::CYCLIC_POSITION) => {
            Some((Quantity::Position, index::TARGET_POSITION, index::POSITION_OFFSET))
        }
        Ok(Mode::CYCLIC_VELOCITY) => {
            Some((Quantity::Velocity, index::TARGET_VELOCITY, index::VELOCITY_OFFSET))
        }
        Ok(Mode::CYCLIC_TORQUE) => Some((Quantity::Torque, index::TARGET_TORQUE, index::TORQUE_OFFSET)),
        _ => None,
    };
    let control = number(index::CONTROLWORD);
    let follows =
        axis.state() == State::OperationEnabled && control & ENABLED == ENABLED && control & HALT == 0;
    let set_point = |(quantity, command, added)| {
        let counts = number(command) + number(added);
        SetPoint { quantity, counts, value: f64_from_i64(counts) * scaling.of(quantity) }
    };
    Some(Reading {
        mark: node.statistics().syncs,
        follows: quantity.filter(|_| follows).map(set_point),
        actual_counts: scaling.counts(axis.actual().position.0),
        actual_velocity: f64_from_i64(axis.actual().velocity.0) * scaling.turn,
    })
}

// ---- DeviceNet ------------------------------------------------------------------------------------------------------

/// The scaling of a CIP Motion drive with so many counts in a turn of its motor.
#[must_use]
pub fn devicenet_scaling(resolution: u32, way: Option<Ratio>) -> Scaling {
    let way = factor(way);
    let position = 1e9 / f64::from(resolution) * way;
    Scaling { position, velocity: 1e3 * way, torque: 10.0, modulo: WORD, turn: way, way_round: 1 }
}

/// What a CIP Motion drive on DeviceNet follows; `None` for a drive of another kind. Velocities are in millionths of a
/// revolution per second, torques in thousandths of a percent: finer than any command.
#[must_use]
pub fn devicenet(node: &DevicenetNode, now: MonotonicTime, scaling: &Scaling) -> Option<Reading> {
    let DevicenetNode::Motion(slave) = node else { return None };
    let drive = slave.application();
    let image = drive.device().command(0, now)?;
    let operates = drive.axis_state() == AxisState::Running && drive.actual().report == Report::Operating;
    let points = match image.command {
        Command::Follow(points) if operates && image.action == DriveAction::Enable => Some(points),
        _ => None,
    };
    let whole = |value: f32, parts: f64| i64_from_f64((f64::from(value) * parts).round());
    let follows = points.and_then(|points| {
        let quantity = Quantity::of(points.control_mode)?;
        let counts = match (quantity, points.values.position) {
            (Quantity::Position, Some(CommandPosition::Integer(position))) => {
                i64::from(position).wrapping_sub(points.position_reference)
            }
            (Quantity::Position, _) => return None,
            (Quantity::Velocity, _) => whole(points.values.velocity?, 1e6),
            (Quantity::Torque, _) => whole(points.values.torque?, 1e3),
        };
        Some(SetPoint { quantity, counts, value: f64_from_i64(counts) * scaling.of(quantity) })
    });
    Some(Reading {
        mark: drive.device().counters().applied,
        follows,
        actual_counts: scaling.counts(drive.actual().position.0),
        actual_velocity: f64_from_i64(drive.actual().velocity.0) * scaling.turn,
    })
}
