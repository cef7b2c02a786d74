//! What the controller wants watched of an axis beside its way: the speed of the motor, temperatures and the voltage of the DC bus, as
//! user limits with an exception each (the speed is watched with the limits of the configuration); and thresholds of velocity and torque, which are bits of the status.

use profile_generic::fault::FaultCause;
use profile_generic::image::StatusBits;
use profile_generic::parameter::Parameter;
use profile_generic::quantity::{Torque, Velocity};

use super::supervision::Conditions;

/// Limits and thresholds; what is `None` is not watched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct UserLimits {
    /// Speed of the axis at Motor Overspeed User Limit (attribute 695).
    pub speed: Option<Velocity>,
    /// Motor Overtemperature User Limit (attribute 696), millidegrees.
    pub motor_temperature: Option<i64>,
    /// Inverter Overtemperature User Limit (attribute 698), millidegrees.
    pub drive_temperature: Option<i64>,
    /// Bus Overvoltage User Limit (attribute 704), microvolts.
    pub bus_high: Option<i64>,
    /// Bus Undervoltage User Limit (attribute 705), microvolts.
    pub bus_low: Option<i64>,
    /// Velocity Threshold (attribute 470).
    pub velocity_threshold: Option<Velocity>,
    /// Torque Threshold (attribute 507).
    pub torque_threshold: Option<Torque>,
}

impl UserLimits {
    /// Whether a value of the drive has a limit.
    pub(super) const fn watches(&self, parameter: Parameter) -> bool {
        match parameter {
            Parameter::BUS_VOLTAGE => self.bus_high.is_some() || self.bus_low.is_some(),
            Parameter::MOTOR_TEMPERATURE => self.motor_temperature.is_some(),
            Parameter::DRIVE_TEMPERATURE => self.drive_temperature.is_some(),
            _ => false,
        }
    }

    /// The limits that are passed by these values. What is not known passes none. The voltage counts while the bus is `charged`: without
    /// mains it is no matter of a limit.
    pub(super) fn passed(&self, [voltage, motor, drive]: [Option<i64>; 3], charged: bool) -> Conditions<4> {
        let voltage = voltage.filter(|_| charged);
        let above = |value: Option<i64>, limit: Option<i64>| {
            value.zip(limit).is_some_and(|(value, limit)| value > limit)
        };
        [
            (FaultCause::MOTOR_OVER_TEMPERATURE_USER_LIMIT, above(motor, self.motor_temperature)),
            (FaultCause::DRIVE_OVER_TEMPERATURE_USER_LIMIT, above(drive, self.drive_temperature)),
            (FaultCause::OVER_VOLTAGE_USER_LIMIT, above(voltage, self.bus_high)),
            (FaultCause::UNDER_VOLTAGE_USER_LIMIT, above(self.bus_low, voltage)),
        ]
    }

    /// The status of the thresholds: the velocity is below its one, the torque above its one (Table 5-2.61, bits 9 and 13).
    pub(super) fn thresholds(&self, velocity: Option<Velocity>, torque: Option<Torque>) -> StatusBits {
        let mut status = StatusBits::empty();
        let slow = velocity.zip(self.velocity_threshold);
        let slow =
            slow.is_some_and(|(velocity, least)| velocity.get().unsigned_abs() < least.get().unsigned_abs());
        status.set(StatusBits::VELOCITY_THRESHOLD, slow);
        let strong = torque.zip(self.torque_threshold);
        let strong =
            strong.is_some_and(|(torque, most)| torque.get().unsigned_abs() > most.get().unsigned_abs());
        status.set(StatusBits::TORQUE_THRESHOLD, strong);
        status
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: i64 = 1_000_000_000;

    #[test]
    fn limits_are_passed_by_what_is_known() {
        let limits = UserLimits {
            motor_temperature: Some(80_000),
            drive_temperature: Some(60_000),
            bus_high: Some(360_000_000),
            bus_low: Some(250_000_000),
            ..UserLimits::default()
        };
        let look =
            |values: [i64; 3], charged| limits.passed(values.map(Some), charged).map(|(_, passed)| passed);
        assert_eq!(look([360_000_000, 80_000, 60_000], true), [false; 4]);
        let hot = [360_000_001, 80_001, 60_001];
        assert_eq!(look(hot, true), [true, true, true, false]);
        let low = [249_999_999, 0, 0];
        assert_eq!(look(low, true), [false, false, false, true]);
        assert_eq!(look(low, false), [false; 4], "there is no mains");
        let causes = limits.passed([None; 3], true);
        assert_eq!(
            causes,
            [
                (FaultCause::MOTOR_OVER_TEMPERATURE_USER_LIMIT, false),
                (FaultCause::DRIVE_OVER_TEMPERATURE_USER_LIMIT, false),
                (FaultCause::OVER_VOLTAGE_USER_LIMIT, false),
                (FaultCause::UNDER_VOLTAGE_USER_LIMIT, false),
            ],
            "nothing is known"
        );
        let none = UserLimits::default().passed([Some(i64::MAX); 3], true);
        assert!(none.iter().all(|(_, passed)| !passed), "nothing is watched");
    }

    #[test]
    fn what_has_a_limit_is_watched() {
        const SLOW: [Parameter; 3] =
            [Parameter::BUS_VOLTAGE, Parameter::MOTOR_TEMPERATURE, Parameter::DRIVE_TEMPERATURE];
        let limits = UserLimits { bus_low: Some(1), drive_temperature: Some(1), ..UserLimits::default() };
        assert_eq!(SLOW.map(|parameter| limits.watches(parameter)), [true, false, true]);
        let limits = UserLimits { bus_high: Some(1), motor_temperature: Some(1), ..UserLimits::default() };
        assert_eq!(SLOW.map(|parameter| limits.watches(parameter)), [true, true, false]);
    }

    #[test]
    fn thresholds_are_bits_of_the_status() {
        let limits = UserLimits {
            velocity_threshold: Some(Velocity(UNIT)),
            torque_threshold: Some(Torque(500_000)),
            ..UserLimits::default()
        };
        let look =
            |velocity: i64, torque: i64| limits.thresholds(Some(Velocity(velocity)), Some(Torque(torque)));
        assert_eq!(look(UNIT, 500_000), StatusBits::empty());
        assert_eq!(look(-UNIT + 1, -500_000), StatusBits::VELOCITY_THRESHOLD);
        assert_eq!(look(-UNIT, -500_001), StatusBits::TORQUE_THRESHOLD);
        assert_eq!(limits.thresholds(None, None), StatusBits::empty());
        let none = UserLimits::default().thresholds(Some(Velocity(0)), Some(Torque(i64::MAX)));
        assert_eq!(none, StatusBits::empty());
    }
}
