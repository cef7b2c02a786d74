//! Class 1 diagnostics of the drive: which bit of S-0-0011 a fault sets, and what it is called.

use profile_generic::fault::FaultCause;

/// Bit of S-0-0011 for what only S-0-0129 tells.
pub const MANUFACTURER: u16 = 15;
/// Bit of S-0-0011 for communication.
pub const COMMUNICATION: u16 = 12;

/// The bit of S-0-0011 that a fault sets.
pub fn class_1_bit(cause: FaultCause) -> u16 {
    use FaultCause as F;
    match cause {
        F::MOTOR_OVERLOAD | F::DRIVE_OVERLOAD => 0,
        F::DRIVE_OVER_TEMPERATURE => 1,
        F::MOTOR_OVER_TEMPERATURE => 2,
        F::COOLING => 3,
        F::CONTROL_VOLTAGE => 4,
        F::FEEDBACK_LOSS | F::FEEDBACK_NOISE | F::FEEDBACK_DATA_LOSS | F::FEEDBACK_DEVICE => 5,
        F::COMMUTATION => 6,
        F::MOTOR_OVER_CURRENT | F::OVER_CURRENT | F::MOTOR_SHORT_CIRCUIT | F::GROUND_CURRENT => 7,
        F::OVER_VOLTAGE => 8,
        F::UNDER_VOLTAGE | F::POWER_LOSS => 9,
        F::MAINS_LOSS | F::MAINS_PHASE_LOSS => 10,
        F::EXCESSIVE_POSITION_ERROR => 11,
        F::ILLEGAL_MODE => COMMUNICATION,
        F::HARDWARE_OVERTRAVEL_POSITIVE
        | F::HARDWARE_OVERTRAVEL_NEGATIVE
        | F::SOFTWARE_OVERTRAVEL_POSITIVE
        | F::SOFTWARE_OVERTRAVEL_NEGATIVE => 13,
        _ => MANUFACTURER,
    }
}

/// Names of the bits of S-0-0011.
pub const CLASS_1_TEXTS: [&str; 16] = [
    "overload shut-down",
    "amplifier overtemperature shut-down",
    "motor overtemperature shut-down",
    "cooling error shut-down",
    "control voltage error",
    "feedback error",
    "error in the commutation system",
    "overcurrent error",
    "overvoltage error",
    "undervoltage error",
    "power supply phase error",
    "excessive position deviation",
    "communication error",
    "travel limit exceeded",
    "reserved",
    "manufacturer-specific error",
];

/// Names of the bits of S-0-0012.
pub const CLASS_2_TEXTS: [&str; 16] = [
    "overload warning",
    "amplifier overtemperature warning",
    "motor overtemperature warning",
    "cooling error warning",
    "reserved",
    "positioning velocity above limit",
    "reserved",
    "reserved",
    "reserved",
    "undervoltage warning",
    "reserved",
    "reserved",
    "reserved",
    "target position outside of the travel range",
    "reserved",
    "manufacturer-specific warning",
];

/// The bit of S-0-0012 that a warning sets.
pub fn class_2_bit(cause: FaultCause) -> u16 {
    let bit = class_1_bit(cause);
    let same_meaning = [0, 1, 2, 3, 9].contains(&bit);
    if same_meaning { bit } else { MANUFACTURER }
}

/// S-0-0390 of a class 1 (`0xF`) or class 2 (`0xE`) diagnosis. No public list of codes of the drive profile is
/// known: the low word is the number of the bit in S-0-0011 or S-0-0012.
pub const fn number(class: u32, bit: u32) -> u32 {
    0xC000_0000 | class << 16 | bit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_have_the_meaning_of_their_text() {
        let cases = [
            (FaultCause::EXCESSIVE_POSITION_ERROR, "excessive position deviation"),
            (FaultCause::POWER_LOSS, "undervoltage error"),
            (FaultCause::OVER_VOLTAGE, "overvoltage error"),
            (FaultCause::FEEDBACK_LOSS, "feedback error"),
            (FaultCause::MOTOR_OVERLOAD, "overload shut-down"),
            (FaultCause::SOFTWARE_OVERTRAVEL_NEGATIVE, "travel limit exceeded"),
            (FaultCause::BRAKE, "manufacturer-specific error"),
        ];
        for (cause, text) in cases {
            assert_eq!(CLASS_1_TEXTS[usize::from(class_1_bit(cause))], text);
        }
        let warnings = [
            (FaultCause::MOTOR_OVER_TEMPERATURE, "motor overtemperature warning"),
            (FaultCause::UNDER_VOLTAGE, "undervoltage warning"),
            (FaultCause::OVER_CURRENT, "manufacturer-specific warning"),
        ];
        for (cause, text) in warnings {
            assert_eq!(CLASS_2_TEXTS[usize::from(class_2_bit(cause))], text);
        }
        assert_eq!(number(0xF, 11), 0xC00F_000B);
    }
}
