//! Error codes of the simulated drive's own faults.

use profile_generic::fault::FaultCause;

use crate::drive::ErrorCode;

/// The error code that reports what the servo has noticed, or what somebody has made it notice.
// Flat: a table from cause to code.
pub fn code_of(cause: FaultCause) -> ErrorCode {
    use ErrorCode as E;
    use FaultCause as F;
    match cause {
        F::MOTOR_OVER_CURRENT | F::OVER_CURRENT => E::CONTINUOUS_OVER_CURRENT,
        F::MOTOR_SHORT_CIRCUIT => E::SHORT_CIRCUIT,
        F::GROUND_CURRENT => E::EARTH_LEAKAGE,
        F::MOTOR_OVERLOAD | F::DRIVE_OVERLOAD => E::LOAD_LEVEL_FAULT,
        F::MAINS_PHASE_LOSS => E::PHASE_FAILURE,
        F::MAINS_LOSS => E::MAINS_UNDER_VOLTAGE,
        F::OVER_VOLTAGE => E::DC_LINK_OVER_VOLTAGE,
        F::UNDER_VOLTAGE | F::POWER_LOSS => E::DC_LINK_UNDER_VOLTAGE,
        F::DRIVE_OVER_TEMPERATURE => E::DRIVE_TOO_HOT,
        F::MOTOR_OVER_TEMPERATURE => E::DEVICE_TOO_HOT,
        F::CONTROL_VOLTAGE => E::SUPPLY_LOW_VOLTAGE,
        F::COMMUTATION => E::MOTOR_COMMUTATION,
        F::MOTOR_STALLED => E::MOTOR_BLOCKED,
        F::FEEDBACK_LOSS | F::FEEDBACK_NOISE | F::FEEDBACK_DATA_LOSS | F::FEEDBACK_DEVICE => {
            E::INCREMENTAL_SENSOR_1_FAULT
        }
        F::MOTOR_OVER_SPEED => E::VELOCITY_CONTROLLER,
        F::EXCESSIVE_POSITION_ERROR => E::FOLLOWING_ERROR,
        F::EXTERNAL_INPUT => E::EXTERNAL,
        _ => E::GENERIC,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_of_the_servo_have_codes_that_say_what_they_are() {
        let cases = [
            (FaultCause::POWER_LOSS, 0x3220),
            (FaultCause::OVER_CURRENT, 0x2310),
            (FaultCause::MOTOR_OVER_TEMPERATURE, 0x4210),
            (FaultCause::EXCESSIVE_POSITION_ERROR, 0x8611),
            (FaultCause::MOTOR_OVER_SPEED, 0x8400),
            (FaultCause::BRAKE, 0x1000),
        ];
        for (cause, code) in cases {
            assert_eq!(code_of(cause), ErrorCode(code), "{cause}");
        }
    }
}
