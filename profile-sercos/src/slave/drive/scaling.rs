//! Scaling of the drive's data: what one count of a position, velocity, acceleration or torque is worth.
//!
//! | data | type | factor, exponent | preferential linear | preferential rotational |
//! |---|---|---|---|---|
//! | position | S-0-0076 | S-0-0077, S-0-0078; rotational S-0-0079 | 0.0001 mm | 0.0001 degree |
//! | velocity | S-0-0044 | S-0-0045, S-0-0046 | 0.001 mm/min | 0.0001 1/min or 0.000001 1/s |
//! | acceleration | S-0-0160 | S-0-0161, S-0-0162 | 0.001 mm/s² | 0.001 rad/s² |
//! | torque | S-0-0086 | S-0-0093, S-0-0094 | 1 N | 0.01 Nm |
//!
//! Torque without scaling is in 0.1 % of S-0-0111, position without scaling in encoder counts. With a
//! preferential type (bit 3 = 0) the drive sets factor and exponent itself; those that no source tells (inch, linear
//! per second) are its own. Data refer to the motor or, with bit 6, to the load behind the gear S-0-0121 : S-0-0122. A
//! turn of the load makes the way S-0-0123, so that either kind of axis takes either kind of data.

use profile_generic::ratio::{Ratio, Rounding};
use profile_generic::scaling::UnitKind;
use profile_generic::servo::ServoParameters;

use super::super::parameter::Store;
use crate::wire::idn::Idn;

/// Bits of a scaling type.
mod bits {
    pub const METHOD: i64 = 7;
    pub const NONE: i64 = 0;
    pub const LINEAR: i64 = 1;
    pub const ROTATIONAL: i64 = 2;
    pub const PARAMETER: i64 = 1 << 3;
    /// Inch instead of metre; reserved with rotational scaling.
    pub const INCH: i64 = 1 << 4;
    /// Second instead of minute, for velocity.
    pub const SECOND: i64 = 1 << 5;
    /// Of the load instead of the motor.
    pub const LOAD: i64 = 1 << 6;
    pub const MODULO: i64 = 1 << 7;
}

/// Nanounits in a metre (axis unit millimetre) and in a turn (axis unit revolution).
const METRE: i64 = 1_000_000_000_000;
const TURN: i64 = 1_000_000_000;
/// Turns in radians: a convergent of the continued fraction, off by less than 4e-18.
const TURNS: i64 = 78_256_779;
const RADIANS: i64 = 491_701_844;
/// Pound of force in 1e-13 newton.
const POUND: i64 = 44_482_216_152_605;
/// Inch pound of force in 1e-16 newton metre.
const INCH_POUND: i64 = 1_129_848_290_276_167;

/// One kind of data: counts to generic units and back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scale {
    to_generic: Ratio,
    to_counts: Ratio,
}

impl Scale {
    fn new(to_generic: Option<Ratio>) -> Option<Scale> {
        let to_generic = to_generic?;
        Some(Scale { to_generic, to_counts: to_generic.inverse()? })
    }

    /// Generic units of so many counts.
    pub fn generic(&self, counts: i64) -> i64 {
        self.to_generic.convert(counts, Rounding::Nearest).value
    }

    /// Counts of so many generic units.
    pub fn counts(&self, generic: i64) -> i64 {
        self.to_counts.convert(generic, Rounding::Nearest).value
    }
}

/// All scales of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scales {
    /// Position, nanounits.
    pub position: Scale,
    /// Velocity, nanounits per second.
    pub velocity: Scale,
    /// Acceleration, nanounits per second squared.
    pub acceleration: Scale,
    /// Torque, parts per million of rated torque.
    pub torque: Scale,
    /// Counts after which a position begins anew: S-0-0103, or the 2^32 of its length.
    pub modulo: i64,
    /// Positions go from 0 to `modulo`; else they are centred on 0.
    pub from_zero: bool,
}

impl Scales {
    /// The scales that the parameters ask for; the IDN of the first parameter that makes none.
    pub fn read(store: &Store, servo: &ServoParameters) -> Result<Scales, Idn> {
        let rotary = servo.kind == UnitKind::Rotary;
        let position = position(store, rotary, servo).and_then(|ratio| Scale::new(Some(ratio)));
        let modulo = store.number_of(Idn::POSITION_DATA_SCALING_TYPE) & bits::MODULO != 0;
        let value = store.number_of(Idn::MODULO);
        if modulo && value < 2 {
            return Err(Idn::MODULO);
        }
        Ok(Scales {
            position: position.ok_or(Idn::POSITION_DATA_SCALING_TYPE)?,
            velocity: Scale::new(velocity(store, rotary)).ok_or(Idn::VELOCITY_DATA_SCALING_TYPE)?,
            acceleration: Scale::new(acceleration(store, rotary))
                .ok_or(Idn::ACCELERATION_DATA_SCALING_TYPE)?,
            torque: Scale::new(torque(store, servo)).ok_or(Idn::TORQUE_FORCE_DATA_SCALING_TYPE)?,
            modulo: if modulo { value } else { 1 << 32 },
            from_zero: modulo,
        })
    }

    /// A position in counts as it is transmitted: within the modulo value, or within 32 bits.
    pub fn fold(&self, counts: i64) -> i64 {
        if self.from_zero {
            return counts.rem_euclid(self.modulo);
        }
        let half = self.modulo / 2;
        (counts.wrapping_add(half)).rem_euclid(self.modulo) - half
    }

    /// The whole position whose transmitted form is `counts`, nearest to `reference`.
    pub fn unfold(&self, counts: i64, reference: i64) -> i64 {
        let ahead = counts.wrapping_sub(reference).rem_euclid(self.modulo);
        let way = if ahead > self.modulo / 2 { ahead - self.modulo } else { ahead };
        reference.saturating_add(way)
    }
}

/// `factor` times ten to the `exponent` of a parameter pair.
fn factor(store: &Store, factor: Idn, exponent: Idn) -> Option<Ratio> {
    let power = store.number_of(exponent);
    let ten = 10i64.checked_pow(u32::try_from(power.unsigned_abs()).ok()?)?;
    let number = store.number_of(factor);
    if number < 1 {
        return None;
    }
    if power < 0 { Ratio::new(number, ten) } else { Ratio::new(number.checked_mul(ten)?, 1) }
}

/// A length in metres or inches, as nanounits.
fn length(kind: i64) -> Option<Ratio> {
    if kind & bits::INCH != 0 { Ratio::new(METRE / 10_000 * 254, 1) } else { Ratio::new(METRE, 1) }
}

/// Nanounits of the axis in what the scaling type measures: a turn (`turn` nanoturns of it) or a length, of motor or load.
fn displacement(store: &Store, kind: i64, rotary: bool, turn: Ratio) -> Option<Ratio> {
    // Nanomillimetres of the load in a nanoturn of it.
    let feed = Ratio::new(store.number_of(Idn::FEED_CONSTANT), 10_000)?;
    let unit = match (kind & bits::METHOD, rotary) {
        (bits::ROTATIONAL, true) => turn,
        (bits::ROTATIONAL, false) => turn.then_nearest(feed)?,
        (bits::LINEAR, false) => length(kind)?,
        (bits::LINEAR, true) => length(kind)?.then_nearest(feed.inverse()?)?,
        _ => return None,
    };
    if kind & bits::LOAD != 0 { Some(unit) } else { unit.then_nearest(gear(store)?) }
}

/// Turns of the load in a turn of the motor.
fn gear(store: &Store) -> Option<Ratio> {
    Ratio::new(
        store.number_of(Idn::OUTPUT_REVOLUTIONS_OF_LOAD_GEAR),
        store.number_of(Idn::INPUT_REVOLUTIONS_OF_LOAD_GEAR),
    )
    .filter(|gear| gear.num() > 0)
}

fn position(store: &Store, rotary: bool, servo: &ServoParameters) -> Option<Ratio> {
    let kind = store.number_of(Idn::POSITION_DATA_SCALING_TYPE);
    let turn = Ratio::new(TURN, 1)?;
    match kind & bits::METHOD {
        bits::NONE => Ratio::new(TURN, i64::from(servo.encoder_counts)),
        bits::ROTATIONAL => {
            let counts = Ratio::new(1, store.number_of(Idn::ROTATIONAL_POSITION_RESOLUTION))?;
            displacement(store, kind, rotary, turn)?.then(counts)
        }
        _ => factor(
            store,
            Idn::LINEAR_POSITION_DATA_SCALING_FACTOR,
            Idn::LINEAR_POSITION_DATA_SCALING_EXPONENT,
        )?
        .then(displacement(store, kind, rotary, turn)?),
    }
}

fn velocity(store: &Store, rotary: bool) -> Option<Ratio> {
    let kind = store.number_of(Idn::VELOCITY_DATA_SCALING_TYPE);
    let seconds = if kind & bits::SECOND != 0 { 1 } else { 60 };
    factor(store, Idn::VELOCITY_DATA_SCALING_FACTOR, Idn::VELOCITY_DATA_SCALING_EXPONENT)?
        .then_nearest(displacement(store, kind, rotary, Ratio::new(TURN, 1)?)?)?
        .then_nearest(Ratio::new(1, seconds)?)
}

fn acceleration(store: &Store, rotary: bool) -> Option<Ratio> {
    let kind = store.number_of(Idn::ACCELERATION_DATA_SCALING_TYPE);
    let radian = Ratio::new(TURNS * TURN, RADIANS)?;
    factor(store, Idn::ACCELERATION_DATA_SCALING_FACTOR, Idn::ACCELERATION_DATA_SCALING_EXPONENT)?
        .then_nearest(displacement(store, kind, rotary, radian)?)
}

fn torque(store: &Store, servo: &ServoParameters) -> Option<Ratio> {
    let kind = store.number_of(Idn::TORQUE_FORCE_DATA_SCALING_TYPE);
    let inch = kind & bits::INCH != 0;
    // Micro newton (metre); the motor is rated in that of the axis.
    let rotary = servo.kind == UnitKind::Rotary;
    let unit = match (kind & bits::METHOD, rotary) {
        (bits::NONE, _) => return Ratio::new(1_000, 1),
        (bits::ROTATIONAL, true) if inch => Ratio::new(INCH_POUND, 10_000_000_000),
        (bits::LINEAR, false) if inch => Ratio::new(POUND, 10_000_000),
        (bits::ROTATIONAL, true) | (bits::LINEAR, false) => Ratio::new(1_000_000, 1),
        _ => None,
    }?;
    // What the load sees is more by as much as it turns slower.
    let unit = if kind & bits::LOAD != 0 { unit.then_nearest(gear(store)?)? } else { unit };
    let rated = Ratio::new(1_000_000, servo.rated_torque.0)?;
    factor(store, Idn::TORQUE_FORCE_DATA_SCALING_FACTOR, Idn::TORQUE_FORCE_DATA_SCALING_EXPONENT)?
        .then_nearest(unit)?
        .then_nearest(rated)
}

/// A temperature in millidegree Celsius as counts of 0.1 degree of the scaling type.
pub fn temperature(store: &Store, millidegree: i64) -> i64 {
    if store.number_of(Idn::TEMPERATURE_DATA_SCALING_TYPE) & 1 == 0 {
        return millidegree / 100;
    }
    millidegree * 9 / 500 + 320
}

/// The scaling type that a factor or an exponent belongs to.
pub fn type_of_factor(factor: Idn) -> Option<Idn> {
    const TYPES: [(Idn, Idn, Idn); 4] = [
        (
            Idn::LINEAR_POSITION_DATA_SCALING_FACTOR,
            Idn::LINEAR_POSITION_DATA_SCALING_EXPONENT,
            Idn::POSITION_DATA_SCALING_TYPE,
        ),
        (
            Idn::VELOCITY_DATA_SCALING_FACTOR,
            Idn::VELOCITY_DATA_SCALING_EXPONENT,
            Idn::VELOCITY_DATA_SCALING_TYPE,
        ),
        (
            Idn::ACCELERATION_DATA_SCALING_FACTOR,
            Idn::ACCELERATION_DATA_SCALING_EXPONENT,
            Idn::ACCELERATION_DATA_SCALING_TYPE,
        ),
        (
            Idn::TORQUE_FORCE_DATA_SCALING_FACTOR,
            Idn::TORQUE_FORCE_DATA_SCALING_EXPONENT,
            Idn::TORQUE_FORCE_DATA_SCALING_TYPE,
        ),
    ];
    let row = TYPES.iter().find(|(factors, exponents, _)| factor == *factors || factor == *exponents);
    row.map(|row| row.2)
}

/// What the drive sets by itself when a scaling type is preferential: pairs of IDN and value.
// Flat: a table by scaling type and method.
pub fn preferential(type_idn: Idn, kind: i64) -> &'static [(Idn, i64)] {
    if kind & bits::PARAMETER != 0 {
        return &[];
    }
    let linear = kind & bits::METHOD == bits::LINEAR;
    let inch = linear && kind & bits::INCH != 0;
    match (type_idn, linear, kind & bits::SECOND != 0) {
        (Idn::POSITION_DATA_SCALING_TYPE, true, _) if inch => {
            &[(Idn::LINEAR_POSITION_DATA_SCALING_FACTOR, 1), (Idn::LINEAR_POSITION_DATA_SCALING_EXPONENT, -5)]
        }
        (Idn::POSITION_DATA_SCALING_TYPE, true, _) => {
            &[(Idn::LINEAR_POSITION_DATA_SCALING_FACTOR, 1), (Idn::LINEAR_POSITION_DATA_SCALING_EXPONENT, -7)]
        }
        (Idn::POSITION_DATA_SCALING_TYPE, false, _) => &[(Idn::ROTATIONAL_POSITION_RESOLUTION, 3_600_000)],
        (Idn::VELOCITY_DATA_SCALING_TYPE, true, false) if inch => {
            &[(Idn::VELOCITY_DATA_SCALING_FACTOR, 1), (Idn::VELOCITY_DATA_SCALING_EXPONENT, -5)]
        }
        (Idn::VELOCITY_DATA_SCALING_TYPE, true, false) => {
            &[(Idn::VELOCITY_DATA_SCALING_FACTOR, 1), (Idn::VELOCITY_DATA_SCALING_EXPONENT, -6)]
        }
        (Idn::VELOCITY_DATA_SCALING_TYPE, true, true) => {
            &[(Idn::VELOCITY_DATA_SCALING_FACTOR, 1), (Idn::VELOCITY_DATA_SCALING_EXPONENT, -7)]
        }
        (Idn::VELOCITY_DATA_SCALING_TYPE, false, false) => {
            &[(Idn::VELOCITY_DATA_SCALING_FACTOR, 1), (Idn::VELOCITY_DATA_SCALING_EXPONENT, -4)]
        }
        (Idn::VELOCITY_DATA_SCALING_TYPE, false, true) => {
            &[(Idn::VELOCITY_DATA_SCALING_FACTOR, 1), (Idn::VELOCITY_DATA_SCALING_EXPONENT, -6)]
        }
        (Idn::ACCELERATION_DATA_SCALING_TYPE, true, _) if inch => {
            &[(Idn::ACCELERATION_DATA_SCALING_FACTOR, 1), (Idn::ACCELERATION_DATA_SCALING_EXPONENT, -4)]
        }
        (Idn::ACCELERATION_DATA_SCALING_TYPE, true, _) => {
            &[(Idn::ACCELERATION_DATA_SCALING_FACTOR, 1), (Idn::ACCELERATION_DATA_SCALING_EXPONENT, -6)]
        }
        (Idn::ACCELERATION_DATA_SCALING_TYPE, false, _) => {
            &[(Idn::ACCELERATION_DATA_SCALING_FACTOR, 1), (Idn::ACCELERATION_DATA_SCALING_EXPONENT, -3)]
        }
        (Idn::TORQUE_FORCE_DATA_SCALING_TYPE, true, _) => {
            &[(Idn::TORQUE_FORCE_DATA_SCALING_FACTOR, 1), (Idn::TORQUE_FORCE_DATA_SCALING_EXPONENT, 0)]
        }
        (Idn::TORQUE_FORCE_DATA_SCALING_TYPE, false, _) if kind & bits::METHOD == bits::ROTATIONAL => {
            &[(Idn::TORQUE_FORCE_DATA_SCALING_FACTOR, 1), (Idn::TORQUE_FORCE_DATA_SCALING_EXPONENT, -2)]
        }
        (Idn::TORQUE_FORCE_DATA_SCALING_TYPE, false, _) => {
            &[(Idn::TORQUE_FORCE_DATA_SCALING_FACTOR, 1), (Idn::TORQUE_FORCE_DATA_SCALING_EXPONENT, -1)]
        }
        _ => &[],
    }
}

#[cfg(test)]
mod tests {
    use super::super::parameters;
    use super::*;
    use proptest::prelude::*;

    fn store(kind: UnitKind) -> (Store, ServoParameters) {
        let servo = ServoParameters { kind, ..ServoParameters::default() };
        let mut store = Store::new();
        parameters::define(&mut store, &servo);
        (store, servo)
    }

    #[test]
    fn preferential_rotational() {
        let (store, servo) = store(UnitKind::Rotary);
        let scales = Scales::read(&store, &servo).unwrap();
        assert_eq!(scales.position.generic(3_600_000), TURN);
        assert_eq!(scales.position.counts(TURN / 4), 900_000);
        // 3000 1/min = 50 turns a second.
        assert_eq!(scales.velocity.generic(30_000_000), 50 * TURN);
        // 2 pi rad/s² = one turn per second squared, to the resolution of the data.
        assert_eq!(scales.acceleration.counts(TURN), 6_283);
        assert_eq!(scales.torque.generic(1_000), 1_000_000);
    }

    #[test]
    fn preferential_linear() {
        let (mut store, servo) = store(UnitKind::Linear);
        let scales = Scales::read(&store, &servo).unwrap();
        // 0.0001 mm, 0.001 mm/min, 0.001 mm/s².
        assert_eq!(scales.position.generic(1), 100_000);
        assert_eq!(scales.velocity.generic(60), 1_000_000);
        assert_eq!(scales.acceleration.generic(1), 1_000_000);
        store.set_number_of(Idn::POSITION_DATA_SCALING_TYPE, bits::LINEAR | bits::PARAMETER | bits::INCH);
        store.set_number_of(Idn::LINEAR_POSITION_DATA_SCALING_EXPONENT, -4);
        let scales = Scales::read(&store, &servo).unwrap();
        assert_eq!(scales.position.generic(10_000), 25_400_000_000, "one inch");
    }

    #[test]
    fn torque_in_newton_metre() {
        let (mut store, servo) = store(UnitKind::Rotary);
        store.set_number_of(Idn::TORQUE_FORCE_DATA_SCALING_TYPE, bits::ROTATIONAL);
        for &(idn, value) in preferential(Idn::TORQUE_FORCE_DATA_SCALING_TYPE, bits::ROTATIONAL) {
            store.set_number_of(idn, value);
        }
        // The default servo is rated for 1 Nm; one count is 0.01 Nm.
        assert_eq!(Scales::read(&store, &servo).unwrap().torque.generic(50), 500_000);
    }

    /// Gear and feed constant: a spindle of 10 mm whose motor turns 5 times for 2 turns of it.
    #[test]
    fn motor_and_load_turns_and_ways() {
        let (mut store, servo) = store(UnitKind::Linear);
        store.set_number_of(Idn::INPUT_REVOLUTIONS_OF_LOAD_GEAR, 5);
        store.set_number_of(Idn::OUTPUT_REVOLUTIONS_OF_LOAD_GEAR, 2);
        for (kind, counts, way) in [
            (0x02, 3_600_000, 4_000_000_000),
            (0x42, 3_600_000, 10_000_000_000),
            (0x01, 10_000, 400_000_000),
            (0x41, 10_000, 1_000_000_000),
            (0x59, 10_000_000, 25_400_000_000),
        ] {
            store.set_number_of(Idn::POSITION_DATA_SCALING_TYPE, kind);
            store.set_number_of(Idn::LINEAR_POSITION_DATA_SCALING_EXPONENT, -7);
            assert_eq!(Scales::read(&store, &servo).unwrap().position.generic(counts), way, "{kind:#x}");
        }
        store.set_number_of(Idn::TORQUE_FORCE_DATA_SCALING_TYPE, 0x41);
        store.set_number_of(Idn::TORQUE_FORCE_DATA_SCALING_EXPONENT, 0);
        // 2.5 N at the load are 1 N of the motor, which is rated for 1 N.
        assert_eq!(Scales::read(&store, &servo).unwrap().torque.generic(5), 2_000_000);
        store.set_number_of(Idn::TEMPERATURE_DATA_SCALING_TYPE, 1);
        assert_eq!(temperature(&store, 100_000), 2_120);
    }

    #[test]
    fn impossible_scalings_are_named() {
        let cases = [
            (Idn::POSITION_DATA_SCALING_TYPE, 3, Idn::POSITION_DATA_SCALING_TYPE),
            (Idn::INPUT_REVOLUTIONS_OF_LOAD_GEAR, 0, Idn::POSITION_DATA_SCALING_TYPE),
            (Idn::ROTATIONAL_POSITION_RESOLUTION, 0, Idn::POSITION_DATA_SCALING_TYPE),
            (Idn::VELOCITY_DATA_SCALING_TYPE, 0, Idn::VELOCITY_DATA_SCALING_TYPE),
            (Idn::VELOCITY_DATA_SCALING_EXPONENT, 30, Idn::VELOCITY_DATA_SCALING_TYPE),
            (Idn::ACCELERATION_DATA_SCALING_FACTOR, 0, Idn::ACCELERATION_DATA_SCALING_TYPE),
            (Idn::TORQUE_FORCE_DATA_SCALING_TYPE, 0x01, Idn::TORQUE_FORCE_DATA_SCALING_TYPE),
            (Idn::POSITION_DATA_SCALING_TYPE, 0x82, Idn::MODULO),
        ];
        for (idn, value, wanted) in cases {
            let (mut store, servo) = store(UnitKind::Rotary);
            store.set_number_of(Idn::MODULO, 0);
            store.set_number_of(idn, value);
            assert_eq!(Scales::read(&store, &servo), Err(wanted), "{idn} = {value}");
        }
    }

    proptest! {
        #[test]
        fn what_is_transmitted_leads_back(
            reference in -1_000_000_000_000i64..1_000_000_000_000,
            step in -1_700_000i64..1_700_000,
            modulo: bool,
        ) {
            let (mut store, servo) = store(UnitKind::Rotary);
            if modulo {
                store.set_number_of(Idn::POSITION_DATA_SCALING_TYPE, 0x82);
                store.set_number_of(Idn::MODULO, 3_600_000);
            }
            let scales = Scales::read(&store, &servo).unwrap();
            let there = reference + step;
            let sent = scales.fold(there);
            let fits = if modulo { (0..3_600_000).contains(&sent) } else { i32::try_from(sent).is_ok() };
            prop_assert!(fits, "{} is transmitted", sent);
            prop_assert_eq!(scales.unfold(sent, reference), there);
        }
    }
}
