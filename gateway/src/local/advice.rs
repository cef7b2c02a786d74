//! What to do about a fault: one sentence for each cause, for people at the machine.

use profile_generic::fault::FaultCause;

/// First code of each group of causes.
const MOTOR: u16 = 0x0100;
const DRIVE: u16 = 0x0200;
const POWER: u16 = 0x0300;
const FEEDBACK: u16 = 0x0400;
const MOTION: u16 = 0x0500;
const CONTROL: u16 = 0x0600;
const COMMUNICATION: u16 = 0x0700;
const CONFIGURATION: u16 = 0x0800;
const SAFETY: u16 = 0x0900;
const UNKNOWN: u16 = 0x0A00;

/// What to do about a fault of this cause, then reset it.
#[must_use]
pub fn advice(cause: FaultCause) -> &'static str {
    special(cause).unwrap_or_else(|| of_group(cause))
}

/// Causes for which there is more to say than for their group.
fn special(cause: FaultCause) -> Option<&'static str> {
    Some(match cause {
        FaultCause::MOTOR_SHORT_CIRCUIT | FaultCause::MOTOR_PHASE_LOSS | FaultCause::GROUND_CURRENT => {
            "Switch off main power, then check the motor cable and the insulation of the motor."
        }
        FaultCause::MOTOR_OVER_TEMPERATURE
        | FaultCause::MOTOR_OVER_TEMPERATURE_USER_LIMIT
        | FaultCause::MOTOR_OVERLOAD
        | FaultCause::MOTOR_OVERLOAD_USER_LIMIT => {
            "Let the motor cool down. Check load, brake, friction and the cooling of the motor."
        }
        FaultCause::DRIVE_OVER_TEMPERATURE
        | FaultCause::DRIVE_OVER_TEMPERATURE_USER_LIMIT
        | FaultCause::COOLING
        | FaultCause::COOLING_WARNING => "Check the fans, filters and temperature of the cabinet.",
        FaultCause::EXCESSIVE_POSITION_ERROR | FaultCause::EXCESSIVE_VELOCITY_ERROR => {
            "Check that the axis moves freely, then the torque limit, the gains and the tolerance."
        }
        FaultCause::HARDWARE_OVERTRAVEL_POSITIVE
        | FaultCause::HARDWARE_OVERTRAVEL_NEGATIVE
        | FaultCause::SOFTWARE_OVERTRAVEL_POSITIVE
        | FaultCause::SOFTWARE_OVERTRAVEL_NEGATIVE => {
            "Reset the fault, enable the axis where it stands, and move it back into its range."
        }
        FaultCause::ABSOLUTE_POSITION_LOST => "Home the axis again. Check the battery of the encoder.",
        FaultCause::ENABLE_INPUT_LOST => "Check the enable input of the drive.",
        FaultCause::SOUTH_SILENCE => {
            "Treat the axis as moving until you see it stand. Check the drive's supply and the bus cable."
        }
        FaultCause::COMMAND_LOST | FaultCause::COMMUNICATION_LOSS | FaultCause::CONNECTION_CLOSED => {
            "Check the controller and the network to it. The controller has to connect again."
        }
        FaultCause::SYNCHRONIZATION_LOSS | FaultCause::TIME_STAMP => {
            "Check the time of controller and gateway: grandmaster, source, offset."
        }
        FaultCause::DUPLICATE_ADDRESS => "Give each drive on the bus an address of its own.",
        FaultCause::WRONG_DEVICE => "Compare the drive on the bus with the configuration.",
        _ => return None,
    })
}

fn of_group(cause: FaultCause) -> &'static str {
    match cause.0 {
        MOTOR..DRIVE => "Check the motor, its cable, its load and the motor data in the drive.",
        DRIVE..POWER => "Look up the drive's code in its manual. Check the supply of the drive and its load.",
        POWER..FEEDBACK => "Check mains, fuses, DC bus and brake resistor.",
        FEEDBACK..MOTION => "Check the encoder and its cable. Home the axis again if its position is lost.",
        MOTION..CONTROL => "Check what the controller commands against the limits of the axis.",
        CONTROL..COMMUNICATION => "Check brake, inputs and what the controller commands.",
        COMMUNICATION..CONFIGURATION => {
            "Check cables, switches and the supply of the stations on the network."
        }
        CONFIGURATION..SAFETY => "Compare the parameters of the drive with the configuration, then restart.",
        SAFETY..UNKNOWN => "Clear the safety function that has tripped before you reset the fault.",
        _ => "Look up the drive's code in its manual.",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cause_has_advice_of_its_group_or_its_own() {
        for (cause, name) in FaultCause::NAMED {
            let text = advice(*cause);
            assert!(text.ends_with('.') && text.len() <= 120, "{name}: {text}");
            let unknown = advice(FaultCause(0xFFFF));
            assert_eq!(text == unknown, cause.0 < MOTOR, "{name}: {text}");
        }
        assert!(advice(FaultCause::SAFETY_CORE).contains("safety function"));
        assert!(advice(FaultCause::SOUTH_SILENCE).contains("as moving"));
    }
}
