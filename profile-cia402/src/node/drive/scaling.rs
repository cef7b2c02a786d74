//! User units of an axis, by the factor group, and the units of the servo.
//!
//! ```text
//! position[user] = turns of the motor * 6091h:2 / 6091h:1 * 6092h:1 / 6092h:2
//! velocity[user] = position[user] per second * 6096h:1 / 6096h:2
//! acceleration[user] = velocity without 6096h per second * 6097h:1 / 6097h:2
//! ```
//!
//! 608Fh says only what 6063h and 60FCh count in. A linear motor's turn is a millimetre. Which way 6096h and 6097h go, no
//! public source says.

use profile_generic::ratio::{Ratio, Rounding};

use super::objects::UNITS_PER_TURN;
use crate::drive::index;
use crate::drive::polarity::Polarity;
use crate::node::dictionary::Dictionary;

/// Nanounits of the servo in a turn of its motor.
const TURN: i64 = 1_000_000_000;

/// One kind of data: user units to those of the servo and back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scale {
    to_servo: Ratio,
    to_user: Ratio,
}

impl Scale {
    fn new(to_servo: Ratio) -> Option<Self> {
        Some(Self { to_servo, to_user: to_servo.inverse()? })
    }

    /// Units of the servo of so many user units.
    pub fn servo(&self, user: i64) -> i64 {
        self.to_servo.convert(user, Rounding::Nearest).value
    }

    /// User units of so many of the servo.
    pub fn counts(&self, servo: i64) -> i64 {
        self.to_user.convert(servo, Rounding::Nearest).value
    }
}

/// All scales of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scales {
    /// Position, nanounits.
    pub position: Scale,
    /// Velocity, nanounits per second.
    pub velocity: Scale,
    /// Acceleration, nanounits per second squared.
    pub acceleration: Scale,
    /// vl: revolutions per minute with the dimension factor 604Ch.
    pub speed: Scale,
    /// Increments of the encoder.
    pub increments: Scale,
    /// Where positions begin anew: lowest one, and how many there are.
    range: (i64, i64),
    polarity: Polarity,
}

impl Scales {
    /// Those of a dictionary that nobody has changed, but for the encoder.
    pub fn preset() -> Self {
        let unit = Ratio::new(TURN, UNITS_PER_TURN).unwrap_or_default();
        let scale = |ratio: Ratio| Scale { to_servo: ratio, to_user: ratio.inverse().unwrap_or_default() };
        Self {
            position: scale(unit),
            velocity: scale(unit),
            acceleration: scale(unit),
            speed: scale(Ratio::new(TURN, 60).unwrap_or_default()),
            increments: scale(unit),
            range: (i64::from(i32::MIN), 1 << 32),
            polarity: Polarity::empty(),
        }
    }

    /// The scales that the objects of an axis ask for; `None` when they make none.
    pub fn read(dictionary: &Dictionary, offset: u16) -> Option<Self> {
        Self::of(|index, sub| dictionary.number(index + offset, sub))
    }

    /// The scales that these numbers make, by the index that an object of the first axis has.
    // Flat: one line per ratio, each of which may not exist.
    pub fn of(number: impl Fn(u16, u8) -> i64) -> Option<Self> {
        let ratio = |upper: (u16, u8), lower: (u16, u8)| {
            Ratio::new(number(upper.0, upper.1), number(lower.0, lower.1))
        };
        let gear = ratio((index::GEAR_RATIO, 1), (index::GEAR_RATIO, 2))?;
        let feed = ratio((index::FEED_CONSTANT, 2), (index::FEED_CONSTANT, 1))?;
        let turn = Ratio::new(TURN, 1)?;
        let position = turn.then_nearest(feed)?.then_nearest(gear)?;
        let velocity = ratio((index::VELOCITY_FACTOR, 2), (index::VELOCITY_FACTOR, 1))?;
        let acceleration = ratio((index::ACCELERATION_FACTOR, 2), (index::ACCELERATION_FACTOR, 1))?;
        let dimension = ratio((index::VL_DIMENSION_FACTOR, 1), (index::VL_DIMENSION_FACTOR, 2))?;
        let encoder = ratio((index::ENCODER_RESOLUTION, 2), (index::ENCODER_RESOLUTION, 1))?;
        let (lowest, highest) = (number(index::RANGE_LIMIT, 1), number(index::RANGE_LIMIT, 2));
        let polarity = u8::try_from(number(index::POLARITY, 0)).unwrap_or_default();
        Some(Self {
            position: Scale::new(position)?,
            velocity: Scale::new(position.then_nearest(velocity)?)?,
            acceleration: Scale::new(position.then_nearest(acceleration)?)?,
            speed: Scale::new(Ratio::new(TURN, 60)?.then_nearest(dimension)?)?,
            increments: Scale::new(turn.then_nearest(encoder)?)?,
            range: if lowest < highest {
                (lowest, highest - lowest + 1)
            } else {
                (i64::from(i32::MIN), 1 << 32)
            },
            polarity: Polarity::from_bits_retain(polarity),
        })
    }

    /// Whether positions begin anew within the 32 bits of their object.
    pub fn is_modulo(&self) -> bool {
        self.range.1 != 1 << 32
    }

    /// The object's value of a position of the servo.
    pub fn position_object(&self, servo: i64) -> i64 {
        let counts = self.polarity.position_sign().saturating_mul(self.position.counts(servo));
        counts.wrapping_sub(self.range.0).rem_euclid(self.range.1) + self.range.0
    }

    /// The position of the servo that the value of an object means: the nearest one to `reference`.
    pub fn position_near(&self, object: i64, reference: i64) -> i64 {
        let here = self.polarity.position_sign().saturating_mul(self.position.counts(reference));
        let ahead = object.wrapping_sub(here).rem_euclid(self.range.1);
        let way = if ahead > self.range.1 / 2 { ahead - self.range.1 } else { ahead };
        self.position.servo(self.polarity.position_sign().saturating_mul(here.saturating_add(way)))
    }

    /// The distance of the servo that the value of an object means, and back.
    pub fn distance(&self, object: i64) -> i64 {
        self.position.servo(self.polarity.position_sign().saturating_mul(object))
    }

    /// The object's value of a distance of the servo.
    pub fn distance_object(&self, servo: i64) -> i64 {
        self.polarity.position_sign().saturating_mul(self.position.counts(servo))
    }

    /// The velocity of the servo that the value of an object means.
    pub fn velocity_of(&self, object: i64) -> i64 {
        self.polarity.velocity_sign().saturating_mul(self.velocity.servo(object))
    }

    /// The object's value of a velocity of the servo.
    pub fn velocity_object(&self, servo: i64) -> i64 {
        self.polarity.velocity_sign().saturating_mul(self.velocity.counts(servo))
    }

    /// 1 or -1: which way the servo turns for a velocity above 0.
    pub fn velocity_sign(&self) -> i64 {
        self.polarity.velocity_sign()
    }

    /// 1 or -1: which way the servo turns for a rising position.
    pub fn position_sign(&self) -> i64 {
        self.polarity.position_sign()
    }
}

/// Units of the servo, millionths of the rated torque, in a thousandth of it.
pub const TORQUE: i64 = 1_000;
