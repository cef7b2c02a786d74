//! Values that the gateway has without a drive: by its configuration, or by what it sees of the drive.

use profile_generic::parameter::Parameter;

/// What the nameplates in a configuration can say of motor, power stage and encoder.
pub const OF_CONFIGURATION: [Parameter; 42] = [
    Parameter::MOTOR_RATED_TORQUE,
    Parameter::MOTOR_RATED_CURRENT,
    Parameter::MOTOR_PEAK_CURRENT,
    Parameter::MOTOR_RATED_VELOCITY,
    Parameter::MOTOR_MAX_VELOCITY,
    Parameter::MOTOR_RATED_VOLTAGE,
    Parameter::MOTOR_RATED_POWER,
    Parameter::MOTOR_POLE_COUNT,
    Parameter::MOTOR_INERTIA,
    Parameter::MOTOR_RESISTANCE,
    Parameter::MOTOR_INDUCTANCE,
    Parameter::MOTOR_MAX_TEMPERATURE,
    Parameter::MOTOR_OVERLOAD_LIMIT,
    Parameter::MOTOR_TYPE,
    Parameter::MOTOR_UNIT,
    Parameter::MOTOR_POLE_PITCH,
    Parameter::MOTOR_LINEAR_RATED_VELOCITY,
    Parameter::MOTOR_LINEAR_MAX_VELOCITY,
    Parameter::MOTOR_MASS,
    Parameter::MOTOR_RATED_FORCE,
    Parameter::MOTOR_TORQUE_CONSTANT,
    Parameter::MOTOR_FORCE_CONSTANT,
    Parameter::MOTOR_VOLTAGE_CONSTANT,
    Parameter::MOTOR_LINEAR_VOLTAGE_CONSTANT,
    Parameter::MOTOR_RATED_FREQUENCY,
    Parameter::MOTOR_FLUX_CURRENT,
    Parameter::MOTOR_STATOR_RESISTANCE,
    Parameter::MOTOR_Q_INDUCTANCE,
    Parameter::MOTOR_D_INDUCTANCE,
    Parameter::ENCODER_TYPE,
    Parameter::ENCODER_STARTUP,
    Parameter::ENCODER_TURNS,
    Parameter::ENCODER_LENGTH,
    Parameter::BUS_NOMINAL_VOLTAGE,
    Parameter::DRIVE_RATED_CURRENT,
    Parameter::DRIVE_RATED_VOLTAGE,
    Parameter::DRIVE_RATED_POWER,
    Parameter::BUS_CONFIGURATION,
    Parameter::MAINS_CLASS,
    Parameter::ENABLE_INPUT_CHECKING,
    Parameter::MOTOR_THERMAL_TIME,
    Parameter::DRIVE_THERMAL_TIME,
];

/// What else it has: from the configuration of the axis, and from what it sees in every cycle.
pub const OF_GATEWAY: [Parameter; 5] = [
    Parameter::MOTOR_TURNS_PER_UNIT,
    Parameter::POWER_STRUCTURE_AXIS_ID,
    Parameter::MOTOR_USE,
    Parameter::DRIVE_USE,
    Parameter::HEARD_TIME,
];
