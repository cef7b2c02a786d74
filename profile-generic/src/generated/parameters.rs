//! The catalogue of generic parameters.
//!
//! Generated from `mappings/tables/dictionary/generic.toml`: change the table, not this file, and run
//! `cargo run -p mappings --example generate`.

use crate::parameter::parameter_rows;

parameter_rows! {
    POSITION_LIMIT_POSITIVE = 0x0401, "position_limit_positive", BasicDrive, Position, Integer, Write,
        "Highest position that the software limit allows.";
    POSITION_LIMIT_NEGATIVE = 0x0402, "position_limit_negative", BasicDrive, Position, Integer, Write,
        "Lowest position that the software limit allows.";
    VELOCITY_LIMIT_POSITIVE = 0x0403, "velocity_limit_positive", BasicDrive, Velocity, Integer, Write,
        "Highest velocity forward.";
    VELOCITY_LIMIT_NEGATIVE = 0x0404, "velocity_limit_negative", BasicDrive, Velocity, Integer, Write,
        "Highest velocity backward, as a negative number.";
    ACCELERATION_LIMIT = 0x0405, "acceleration_limit", BasicDrive, Acceleration, Integer, Write,
        "Highest acceleration.";
    DECELERATION_LIMIT = 0x0406, "deceleration_limit", BasicDrive, Acceleration, Integer, Write,
        "Highest deceleration.";
    JERK_LIMIT = 0x0407, "jerk_limit", BasicDrive, Jerk, Integer, Write,
        "Highest jerk.";
    TORQUE_LIMIT_POSITIVE = 0x0408, "torque_limit_positive", BasicDrive, Torque, Integer, Write,
        "Highest torque forward.";
    TORQUE_LIMIT_NEGATIVE = 0x0409, "torque_limit_negative", BasicDrive, Torque, Integer, Write,
        "Highest torque backward, as a negative number.";
    TORQUE_RATE_LIMIT = 0x040A, "torque_rate_limit", BasicDrive, Torque, Integer, Write,
        "Highest change of torque in one second.";
    POSITION_ERROR_TOLERANCE = 0x040C, "position_error_tolerance", BasicDrive, Position, Integer, Write,
        "Position error above which the drive faults.";
    POSITION_ERROR_TOLERANCE_TIME = 0x040D, "position_error_tolerance_time", BasicDrive, Time, Integer, Write,
        "How long the position error may be above its tolerance.";
    VELOCITY_ERROR_TOLERANCE = 0x040E, "velocity_error_tolerance", BasicDrive, Velocity, Integer, Write,
        "Velocity error above which the drive faults.";
    VELOCITY_ERROR_TOLERANCE_TIME = 0x040F, "velocity_error_tolerance_time", BasicDrive, Time, Integer, Write,
        "How long the velocity error may be above its tolerance.";
    OVER_TORQUE_LIMIT = 0x0410, "over_torque_limit", BasicDrive, Torque, Integer, Write,
        "Torque above which the drive faults.";
    OVER_TORQUE_LIMIT_TIME = 0x0411, "over_torque_limit_time", BasicDrive, Time, Integer, Write,
        "How long the torque may be above its fault limit.";
    IN_POSITION_WINDOW = 0x0412, "in_position_window", BasicDrive, Position, Integer, Write,
        "Distance from the set-point within which the axis is in position.";
    AT_VELOCITY_WINDOW = 0x0413, "at_velocity_window", BasicDrive, Velocity, Integer, Write,
        "Distance from the set-point within which the axis is at velocity.";
    STANDSTILL_WINDOW = 0x0414, "standstill_window", BasicDrive, Velocity, Integer, Write,
        "Velocity below which the axis stands.";
    VELOCITY_LIMIT_BIPOLAR = 0x0415, "velocity_limit_bipolar", BasicDrive, Velocity, Integer, Read,
        "Highest velocity in both directions.";
    TORQUE_LIMIT_BIPOLAR = 0x0416, "torque_limit_bipolar", BasicDrive, Torque, Integer, Read,
        "Highest torque in both directions.";
    VELOCITY_THRESHOLD = 0x0417, "velocity_threshold", BasicDrive, Velocity, Integer, Write,
        "Velocity below which the gateway shows it to be low.";
    TORQUE_THRESHOLD = 0x0418, "torque_threshold", BasicDrive, Torque, Integer, Write,
        "Torque above which the gateway shows it to be high.";
    UNDER_TORQUE_LIMIT = 0x0419, "under_torque_limit", BasicDrive, Torque, Integer, Write,
        "Torque below which the load is missing.";
    UNDER_TORQUE_LIMIT_TIME = 0x041A, "under_torque_limit_time", BasicDrive, Time, Integer, Write,
        "How long the torque may be below that, 0 for not watched.";
    OVER_SPEED_USER_LIMIT = 0x041B, "over_speed_user_limit", BasicDrive, Fraction, Integer, Write,
        "Speed above which an exception is raised, of the rated one.";
    MOTOR_TEMPERATURE_USER_LIMIT = 0x041C, "motor_temperature_user_limit", BasicDrive, Temperature, Integer, Write,
        "Temperature of the motor above which an exception is raised.";
    DRIVE_TEMPERATURE_USER_LIMIT = 0x041D, "drive_temperature_user_limit", BasicDrive, Temperature, Integer, Write,
        "Temperature of the power stage above which an exception is raised.";
    BUS_OVERVOLTAGE_USER_LIMIT = 0x041E, "bus_overvoltage_user_limit", BasicDrive, Fraction, Integer, Write,
        "Voltage of the DC bus above which an exception is raised, of the nominal one.";
    BUS_UNDERVOLTAGE_USER_LIMIT = 0x041F, "bus_undervoltage_user_limit", BasicDrive, Fraction, Integer, Write,
        "Voltage of the DC bus below which an exception is raised, of the nominal one.";
    CURRENT_LIMIT = 0x0420, "current_limit", BasicDrive, Torque, Integer, Write,
        "Highest current of the motor, of the rated one.";

    POSITION_LOOP_GAIN = 0x0501, "position_loop_gain", BasicDrive, Gain, Integer, Write,
        "Proportional gain of the position loop.";
    POSITION_INTEGRAL_GAIN = 0x0502, "position_integral_gain", BasicDrive, Gain, Integer, Write,
        "Integral gain of the position loop.";
    VELOCITY_LOOP_GAIN = 0x0503, "velocity_loop_gain", BasicDrive, Gain, Integer, Write,
        "Proportional gain of the velocity loop.";
    VELOCITY_INTEGRAL_TIME = 0x0504, "velocity_integral_time", BasicDrive, Time, Integer, Write,
        "Integral action time of the velocity loop, 0 for none.";
    VELOCITY_FEED_FORWARD_GAIN = 0x0505, "velocity_feed_forward_gain", BasicDrive, Fraction, Integer, Write,
        "Part of the velocity set-point that is fed forward.";
    ACCELERATION_FEED_FORWARD_GAIN = 0x0506, "acceleration_feed_forward_gain", BasicDrive, Fraction, Integer, Write,
        "Part of the acceleration set-point that is fed forward.";
    SYSTEM_INERTIA = 0x0507, "system_inertia", BasicDrive, None, Integer, Write,
        "Torque that accelerates motor and load by one motor revolution per second squared, in 1e-9 percent of the rated torque.";
    OWN_ACCELERATION_FEED_FORWARD = 0x0508, "own_acceleration_feed_forward", BasicDrive, Current, Integer, Read,
        "Current that the loops of the drive feed forward for each radian per second squared.";

    GEAR_RATIO_NUMERATOR = 0x0605, "gear_ratio_numerator", BasicDrive, None, Integer, WriteWhileDisabled,
        "Motor revolutions in the stated number of load revolutions.";
    GEAR_RATIO_DENOMINATOR = 0x0606, "gear_ratio_denominator", BasicDrive, None, Integer, WriteWhileDisabled,
        "Load revolutions for the stated number of motor revolutions.";
    MOTOR_TURNS_PER_UNIT = 0x0609, "motor_turns_per_unit", BasicDrive, None, Integer, Read,
        "Revolutions of the motor in one axis unit, in 1e-15; the gateway computes it from gear and feed.";
    FEEDBACK_VELOCITY_FILTER = 0x060A, "feedback_velocity_filter", BasicDrive, Time, Integer, Write,
        "Time constant of the low-pass filter of the actual velocity, 0 for none.";
    FEEDBACK_ACCELERATION_FILTER = 0x060B, "feedback_acceleration_filter", BasicDrive, Time, Integer, Write,
        "Time constant of the low-pass filter of the actual acceleration, 0 for none.";
    LOAD_FEEDBACK_UNIT = 0x060C, "load_feedback_unit", BasicDrive, None, Integer, Write,
        "Unit of the encoder at the load, as the profile of the controller numbers it.";
    LOAD_FEEDBACK_RESOLUTION = 0x060D, "load_feedback_resolution", BasicDrive, None, Integer, Write,
        "Cycles in a unit of the encoder at the load.";
    LOAD_FEEDBACK_INTERPOLATION = 0x060E, "load_feedback_interpolation", BasicDrive, None, Integer, Write,
        "Counts in a cycle of the encoder at the load.";
    MOTOR_ENCODER_SHOWN = 0x060F, "motor_encoder_shown", BasicDrive, None, Integer, Read,
        "1 where the actual position is that of the encoder of the motor.";
    FEEDBACK_MASTER = 0x0610, "feedback_master", BasicDrive, None, Integer, WriteWhileDisabled,
        "Encoder that an axis shows which is never switched on: 1 that of the motor, 2 that of the load.";

    MOTOR_NAME = 0x0702, "motor_name", BasicDrive, None, Text, Read,
        "Type designation of the motor.";
    MOTOR_RATED_TORQUE = 0x0704, "motor_rated_torque", BasicDrive, TorqueAbsolute, Integer, WriteWhileDisabled,
        "Rated torque or force: the whole that torque is told in parts of.";
    MOTOR_RATED_CURRENT = 0x0706, "motor_rated_current", BasicDrive, Current, Integer, WriteWhileDisabled,
        "Rated current.";
    MOTOR_PEAK_CURRENT = 0x0707, "motor_peak_current", BasicDrive, Current, Integer, WriteWhileDisabled,
        "Peak current.";
    MOTOR_RATED_VELOCITY = 0x0708, "motor_rated_velocity", BasicDrive, Velocity, Integer, WriteWhileDisabled,
        "Rated velocity.";
    MOTOR_MAX_VELOCITY = 0x0709, "motor_max_velocity", BasicDrive, Velocity, Integer, WriteWhileDisabled,
        "Highest velocity that the motor stands.";
    MOTOR_RATED_VOLTAGE = 0x070A, "motor_rated_voltage", BasicDrive, Voltage, Integer, WriteWhileDisabled,
        "Rated voltage.";
    MOTOR_RATED_POWER = 0x070B, "motor_rated_power", BasicDrive, Power, Integer, WriteWhileDisabled,
        "Rated power.";
    MOTOR_POLE_COUNT = 0x070C, "motor_pole_count", BasicDrive, None, Integer, WriteWhileDisabled,
        "Number of poles.";
    MOTOR_INERTIA = 0x070D, "motor_inertia", BasicDrive, Inertia, Integer, WriteWhileDisabled,
        "Inertia or mass of the motor.";
    MOTOR_RESISTANCE = 0x070E, "motor_resistance", BasicDrive, Resistance, Integer, WriteWhileDisabled,
        "Resistance of the winding.";
    MOTOR_INDUCTANCE = 0x070F, "motor_inductance", BasicDrive, Inductance, Integer, WriteWhileDisabled,
        "Inductance of the winding.";
    MOTOR_MAX_TEMPERATURE = 0x0710, "motor_max_temperature", BasicDrive, Temperature, Integer, WriteWhileDisabled,
        "Highest temperature of the winding.";
    MOTOR_OVERLOAD_LIMIT = 0x0711, "motor_overload_limit", BasicDrive, Fraction, Integer, Write,
        "Use of the thermal capacity of the motor at which the drive faults.";
    BRAKE_ENGAGE_TIME = 0x0713, "brake_engage_time", ApplicationFunction, Time, Integer, Write,
        "From the order to the brake's being closed.";
    BRAKE_RELEASE_TIME = 0x0714, "brake_release_time", ApplicationFunction, Time, Integer, Write,
        "From the order to the brake's being open.";
    MOTOR_TYPE = 0x0715, "motor_type", BasicDrive, None, Integer, WriteWhileDisabled,
        "Kind of motor: 1 rotary and 3 linear with permanent magnets, 2 rotary and 4 linear induction motor.";
    MOTOR_UNIT = 0x0716, "motor_unit", BasicDrive, None, Integer, WriteWhileDisabled,
        "What the motor moves in: 0 revolutions, 1 metres.";
    MOTOR_POLE_PITCH = 0x0717, "motor_pole_pitch", BasicDrive, None, Integer, WriteWhileDisabled,
        "Pole pitch of a linear motor, in nanometres.";
    MOTOR_LINEAR_RATED_VELOCITY = 0x0718, "motor_linear_rated_velocity", BasicDrive, Velocity, Integer, WriteWhileDisabled,
        "Rated velocity of a linear motor.";
    MOTOR_LINEAR_MAX_VELOCITY = 0x0719, "motor_linear_max_velocity", BasicDrive, Velocity, Integer, WriteWhileDisabled,
        "Highest velocity that a linear motor stands.";
    MOTOR_MASS = 0x071A, "motor_mass", BasicDrive, Inertia, Integer, WriteWhileDisabled,
        "Mass of what a linear motor moves of its own.";
    MOTOR_RATED_FORCE = 0x071B, "motor_rated_force", BasicDrive, TorqueAbsolute, Integer, WriteWhileDisabled,
        "Rated force of a linear motor.";
    MOTOR_TORQUE_CONSTANT = 0x071C, "motor_torque_constant", BasicDrive, None, Integer, WriteWhileDisabled,
        "Torque for an ampere, in micro newton metre.";
    MOTOR_FORCE_CONSTANT = 0x071D, "motor_force_constant", BasicDrive, None, Integer, WriteWhileDisabled,
        "Force for an ampere, in micro newton.";
    MOTOR_VOLTAGE_CONSTANT = 0x071E, "motor_voltage_constant", BasicDrive, None, Integer, WriteWhileDisabled,
        "Voltage at a thousand revolutions per minute, in microvolt.";
    MOTOR_LINEAR_VOLTAGE_CONSTANT = 0x071F, "motor_linear_voltage_constant", BasicDrive, None, Integer, WriteWhileDisabled,
        "Voltage at a metre per second, in microvolt.";
    MOTOR_RATED_FREQUENCY = 0x0720, "motor_rated_frequency", BasicDrive, Frequency, Integer, WriteWhileDisabled,
        "Rated frequency of an induction motor.";
    MOTOR_FLUX_CURRENT = 0x0721, "motor_flux_current", BasicDrive, Current, Integer, WriteWhileDisabled,
        "Current that magnetises an induction motor.";
    MOTOR_STATOR_RESISTANCE = 0x0722, "motor_stator_resistance", BasicDrive, Resistance, Integer, WriteWhileDisabled,
        "Resistance of the stator of an induction motor.";
    MOTOR_Q_INDUCTANCE = 0x0723, "motor_q_inductance", BasicDrive, Inductance, Integer, WriteWhileDisabled,
        "Inductance across the magnets.";
    MOTOR_D_INDUCTANCE = 0x0724, "motor_d_inductance", BasicDrive, Inductance, Integer, WriteWhileDisabled,
        "Inductance along the magnets.";
    ENCODER_TYPE = 0x0725, "encoder_type", BasicDrive, None, Integer, WriteWhileDisabled,
        "Interface of the motor's encoder, as the profile of the controller numbers it.";
    ENCODER_STARTUP = 0x0726, "encoder_startup", BasicDrive, None, Integer, WriteWhileDisabled,
        "Where the motor's encoder counts from: 0 where it is at power-up, 1 its own zero.";
    ENCODER_TURNS = 0x0727, "encoder_turns", BasicDrive, None, Integer, WriteWhileDisabled,
        "Revolutions that an absolute rotary encoder tells apart.";
    ENCODER_LENGTH = 0x0728, "encoder_length", BasicDrive, Position, Integer, WriteWhileDisabled,
        "Length of an absolute linear encoder.";

    LOAD_POSITION_ACTUAL = 0x0906, "load_position_actual", BasicDrive, Position, Integer, Read,
        "Actual position of the load feedback.";
    LOAD_VELOCITY_ACTUAL = 0x0907, "load_velocity_actual", BasicDrive, Velocity, Integer, Read,
        "Actual velocity of the load feedback.";
    TORQUE_ACTUAL = 0x0909, "torque_actual", BasicDrive, Torque, Integer, Read,
        "Actual torque or force.";
    CURRENT_ACTUAL = 0x090A, "current_actual", BasicDrive, Current, Integer, Read,
        "Actual motor current.";
    OUTPUT_FREQUENCY = 0x090B, "output_frequency", BasicDrive, Frequency, Integer, Read,
        "Frequency of the motor current.";
    OUTPUT_VOLTAGE = 0x090C, "output_voltage", BasicDrive, Voltage, Integer, Read,
        "Voltage at the motor.";
    OUTPUT_POWER = 0x090D, "output_power", BasicDrive, Power, Integer, Read,
        "Mechanical power of the motor.";
    FOLLOWING_ERROR = 0x090E, "following_error", BasicDrive, Position, Integer, Read,
        "Position set-point less actual position.";
    VELOCITY_ERROR = 0x090F, "velocity_error", BasicDrive, Velocity, Integer, Read,
        "Velocity set-point less actual velocity.";
    POSITION_PROPORTIONAL_OUTPUT = 0x0921, "position_proportional_output", BasicDrive, Velocity, Integer, Read,
        "Position error times the gain of the position loop.";
    POSITION_INTEGRATOR_OUTPUT = 0x0922, "position_integrator_output", BasicDrive, Velocity, Integer, Read,
        "Output of the integrator of the position loop.";
    POSITION_LOOP_OUTPUT = 0x0923, "position_loop_output", BasicDrive, Velocity, Integer, Read,
        "Output of the position loop without what is fed forward.";
    VELOCITY_FEED_FORWARD = 0x0924, "velocity_feed_forward", BasicDrive, Velocity, Integer, Read,
        "Velocity that is fed forward to the output of the position loop.";
    VELOCITY_TRIM_IN_POSITION = 0x0925, "velocity_trim_in_position", BasicDrive, Velocity, Integer, Read,
        "Velocity offset that is added to the output of the position loop.";
    VELOCITY_DEMAND = 0x0926, "velocity_demand", BasicDrive, Velocity, Integer, Read,
        "Velocity set-point of velocity control, downstream of the ramps of the drive.";
    VELOCITY_SUM = 0x0927, "velocity_sum", BasicDrive, Velocity, Integer, Read,
        "Sum of all set-points of the velocity loop, upstream of its limits.";
    VELOCITY_REFERENCE = 0x0928, "velocity_reference", BasicDrive, Velocity, Integer, Read,
        "Velocity that the velocity loop follows.";
    ACCELERATION_FEED_FORWARD = 0x0929, "acceleration_feed_forward", BasicDrive, Acceleration, Integer, Read,
        "Acceleration that is fed forward to the output of the velocity loop.";
    TORQUE_DEMAND = 0x092A, "torque_demand", BasicDrive, Torque, Integer, Read,
        "Torque that the drive asks of its torque loop, downstream of its limits.";
    TORQUE_OF_LOOPS = 0x092B, "torque_of_loops", BasicDrive, Torque, Integer, Read,
        "Torque that the position and velocity loops ask for, while no limit holds it.";
    TORQUE_OF_COMMAND = 0x092C, "torque_of_command", BasicDrive, Torque, Integer, Read,
        "Torque set-point of torque control.";
    TORQUE_REFERENCE = 0x092D, "torque_reference", BasicDrive, Torque, Integer, Read,
        "Torque that is asked for, upstream of the limits.";
    TORQUE_REFERENCE_LIMITED = 0x092E, "torque_reference_limited", BasicDrive, Torque, Integer, Read,
        "Torque that is asked for, downstream of the limits.";
    TORQUE_CURRENT = 0x092F, "torque_current", BasicDrive, Torque, Integer, Read,
        "Torque producing current, in parts of the rated current.";
    MOTOR_TORQUE = 0x0930, "motor_torque", BasicDrive, TorqueAbsolute, Integer, Read,
        "Torque of the motor.";
    MOTOR_SPEED = 0x0931, "motor_speed", BasicDrive, Velocity, Integer, Read,
        "Revolutions of the motor per second.";
    MOTOR_ANGULAR_VELOCITY = 0x0932, "motor_angular_velocity", BasicDrive, Gain, Integer, Read,
        "Angular velocity of the motor in radians per second.";
    MOTOR_POSITION = 0x0933, "motor_position", BasicDrive, Position, Integer, Read,
        "Revolutions of the motor.";
    MOTOR_ACCELERATION = 0x0934, "motor_acceleration", BasicDrive, Acceleration, Integer, Read,
        "Revolutions of the motor per second squared.";
    LOOP_TORQUE = 0x0935, "loop_torque", BasicDrive, Torque, Integer, Read,
        "Torque that the position and velocity loops make, downstream of the limits.";
    LOOP_TORQUE_PARTS = 0x0936, "loop_torque_parts", BasicDrive, None, Integer, Read,
        "The same as a number of millionths of the rated torque.";
    LOOP_MOTOR_ACCELERATION = 0x0937, "loop_motor_acceleration", BasicDrive, None, Integer, Read,
        "Acceleration of the motor that this torque makes, in 1e-9 revolutions per second squared.";
    LOOP_AXIS_ACCELERATION = 0x0938, "loop_axis_acceleration", BasicDrive, None, Integer, Read,
        "The same of the axis, in 1e-9 units per second squared.";
    LOOP_ACCELERATION = 0x0939, "loop_acceleration", BasicDrive, Acceleration, Integer, Read,
        "Acceleration that the torque of the loops makes.";
    VELOCITY_LOOP_OUTPUT = 0x093A, "velocity_loop_output", BasicDrive, Acceleration, Integer, Read,
        "Output of the velocity loop without what is fed forward.";
    VELOCITY_PROPORTIONAL_OUTPUT = 0x093B, "velocity_proportional_output", BasicDrive, Acceleration, Integer, Read,
        "Output of the proportional part of the velocity loop.";
    VELOCITY_INTEGRATOR_OUTPUT = 0x093C, "velocity_integrator_output", BasicDrive, Acceleration, Integer, Read,
        "Output of the integrator of the velocity loop.";

    BUS_VOLTAGE = 0x0A01, "bus_voltage", BasicDrive, Voltage, Integer, Read,
        "Voltage of the DC bus.";
    BUS_NOMINAL_VOLTAGE = 0x0A02, "bus_nominal_voltage", BasicDrive, Voltage, Integer, WriteWhileDisabled,
        "Nominal voltage of the DC bus.";
    POWER_LOSS_ACTION = 0x0A06, "power_loss_action", BasicDrive, None, Integer, Write,
        "What to do when the DC bus loses its power.";
    MOTOR_TEMPERATURE = 0x0A08, "motor_temperature", BasicDrive, Temperature, Integer, Read,
        "Temperature of the motor.";
    DRIVE_TEMPERATURE = 0x0A09, "drive_temperature", BasicDrive, Temperature, Integer, Read,
        "Temperature of the power stage.";
    MOTOR_CAPACITY = 0x0A0B, "motor_capacity", BasicDrive, Fraction, Integer, Read,
        "Use of the motor's thermal capacity.";
    DRIVE_CAPACITY = 0x0A0C, "drive_capacity", BasicDrive, Fraction, Integer, Read,
        "Use of the power stage's thermal capacity.";
    DRIVE_RATED_CURRENT = 0x0A0F, "drive_rated_current", BasicDrive, Current, Integer, Read,
        "Rated output current of the power stage.";
    DRIVE_PEAK_CURRENT = 0x0A10, "drive_peak_current", BasicDrive, Current, Integer, Read,
        "Peak output current of the power stage.";
    DRIVE_RATED_VOLTAGE = 0x0A11, "drive_rated_voltage", BasicDrive, Voltage, Integer, Read,
        "Rated output voltage of the power stage.";
    DRIVE_RATED_POWER = 0x0A12, "drive_rated_power", BasicDrive, Power, Integer, Read,
        "Rated output power of the power stage.";
    BUS_CONFIGURATION = 0x0A13, "bus_configuration", BasicDrive, None, Integer, WriteWhileDisabled,
        "Where the DC bus has its power from, as the profile of the controller numbers it.";
    MAINS_CLASS = 0x0A14, "mains_class", BasicDrive, None, Integer, WriteWhileDisabled,
        "Mains that the power stage is for: 0 115, 230 or 460 V, 1 100, 200 or 400 V.";
    POWER_STRUCTURE_AXIS_ID = 0x0A15, "power_structure_axis_id", BasicDrive, None, Integer, Read,
        "Number of the power stage, by which a controller knows that it has the right one; 0 is not checked.";
    ENABLE_INPUT_CHECKING = 0x0A16, "enable_input_checking", BasicDrive, None, Integer, WriteWhileDisabled,
        "Whether the drive has an enable input without which it gives no torque: 0 or 1.";
    OPERATIVE_CURRENT_LIMIT = 0x0A17, "operative_current_limit", BasicDrive, Torque, Integer, Read,
        "Highest current that the drive gives, of the rated one of the motor.";
    OPERATIVE_PEAK_CURRENT = 0x0A18, "operative_peak_current", BasicDrive, Current, Integer, Read,
        "The lower of the peak currents of motor and power stage.";
    MOTOR_TEMPERATURE_LIMIT = 0x0A19, "motor_temperature_limit", BasicDrive, Temperature, Integer, Read,
        "Temperature of the motor at which the drive faults.";
    DRIVE_TEMPERATURE_LIMIT = 0x0A1A, "drive_temperature_limit", BasicDrive, Temperature, Integer, Read,
        "Temperature of the power stage at which the drive faults.";
    CONVERTER_CURRENT = 0x0A1B, "converter_current", BasicDrive, Current, Integer, Read,
        "Current of the DC bus.";
    CONVERTER_POWER = 0x0A1C, "converter_power", BasicDrive, Power, Integer, Read,
        "Power of the DC bus.";
    MOTOR_ROTATION = 0x0A1D, "motor_rotation", BasicDrive, Frequency, Integer, Read,
        "Revolutions of the motor per second.";
    SYNCHRONOUS_FREQUENCY = 0x0A1E, "synchronous_frequency", BasicDrive, Frequency, Integer, Read,
        "The same times the pairs of poles.";
    MOTOR_THERMAL_TIME = 0x0A1F, "motor_thermal_time", BasicDrive, Time, Integer, Read,
        "Time constant of the warming of the motor.";
    DRIVE_THERMAL_TIME = 0x0A20, "drive_thermal_time", BasicDrive, Time, Integer, Read,
        "Time constant of the warming of the power stage.";
    MOTOR_USE = 0x0A21, "motor_use", BasicDrive, Fraction, Integer, Read,
        "Use of the motor by its current, as the gateway estimates it with its thermal time constant.";
    DRIVE_USE = 0x0A22, "drive_use", BasicDrive, Fraction, Integer, Read,
        "The same with the thermal time constant of the power stage.";
    RATED_CURRENT_RATIO = 0x0A23, "rated_current_ratio", BasicDrive, Fraction, Integer, Read,
        "Rated current of the motor, of that of the power stage.";
    DRIVE_USE_SHARE = 0x0A24, "drive_use_share", BasicDrive, Fraction, Integer, Read,
        "Estimated use of the power stage, of the rated current of the motor once.";
    UP_TIME = 0x0A25, "up_time", BasicDrive, Time, Integer, Read,
        "How long the control of the drive has been up, as far as the gateway has heard it.";
    HEARD_TIME = 0x0A26, "heard_time", BasicDrive, Time, Integer, Read,
        "How long the gateway has heard the drive without a break.";
    RUN_TIME = 0x0A27, "run_time", BasicDrive, Time, Integer, Read,
        "Time that the axis has been in operation in its life.";
    COUNTED_RUN_TIME = 0x0A28, "counted_run_time", BasicDrive, Time, Integer, Read,
        "The same as far as the gateway has counted it.";
    OUTPUT_ENERGY = 0x0A29, "output_energy", BasicDrive, None, Integer, Read,
        "Energy that the motor has given in its life less what it was given, in joules.";
    COUNTED_WORK = 0x0A2A, "counted_work", BasicDrive, None, Integer, Read,
        "The same as far as the gateway has counted it, in millionths of the rated torque times a revolution.";
    RATED_WORK = 0x0A2B, "rated_work", BasicDrive, None, Integer, Read,
        "Work of the rated torque in a revolution, in microjoules.";
    MOTOR_TURNS = 0x0A2C, "motor_turns", BasicDrive, None, Integer, Read,
        "Revolutions of the motor in its life, in both directions together.";
    COUNTED_TURNS = 0x0A2D, "counted_turns", BasicDrive, None, Integer, Read,
        "The same as far as the gateway has counted it, in millionths.";

    STOPPING_TORQUE = 0x0B04, "stopping_torque", BasicDrive, Torque, Integer, Write,
        "Torque of a stop at the current limit.";
    STOPPING_TIME_LIMIT = 0x0B05, "stopping_time_limit", BasicDrive, Time, Integer, Write,
        "How long a controlled stop may take before the torque is switched off.";
    COASTING_TIME_LIMIT = 0x0B0B, "coasting_time_limit", BasicDrive, Time, Integer, Write,
        "How long an axis without torque is waited for until it counts as stopped.";
    ZERO_SPEED_TIME = 0x0B0C, "zero_speed_time", BasicDrive, Time, Integer, Write,
        "How long an axis has to be slow until it counts as standing.";
    RAMP_VELOCITY_POSITIVE = 0x0B0D, "ramp_velocity_positive", BasicDrive, Velocity, Integer, Write,
        "Highest velocity forward of the ramp of a velocity that is commanded at once.";
    RAMP_VELOCITY_NEGATIVE = 0x0B0E, "ramp_velocity_negative", BasicDrive, Velocity, Integer, Write,
        "Highest velocity backward of that ramp, as a negative number.";
    RAMP_ACCELERATION = 0x0B0F, "ramp_acceleration", BasicDrive, Acceleration, Integer, Write,
        "How fast that ramp gets quicker.";
    RAMP_DECELERATION = 0x0B10, "ramp_deceleration", BasicDrive, Acceleration, Integer, Write,
        "How fast that ramp gets slower, and a ramped stop.";
    ZERO_SPEED = 0x0B11, "zero_speed", BasicDrive, Fraction, Integer, Write,
        "Speed below which an axis that stops counts as slow, of the rated one.";

    HOMING_METHOD = 0x0C01, "homing_method", ApplicationFunction, None, Integer, Write,
        "How the drive homes, as its profile numbers it.";
    HOMING_VELOCITY = 0x0C02, "homing_velocity", ApplicationFunction, Velocity, Integer, Write,
        "Velocity towards the home switch or marker.";
    HOMING_CREEP_VELOCITY = 0x0C03, "homing_creep_velocity", ApplicationFunction, Velocity, Integer, Write,
        "Velocity away from the home switch.";
    HOMING_ACCELERATION = 0x0C04, "homing_acceleration", ApplicationFunction, Acceleration, Integer, Write,
        "Acceleration while homing.";
    HOME_POSITION = 0x0C05, "home_position", ApplicationFunction, Position, Integer, Write,
        "Position that the home place gets.";
    HOME_OFFSET = 0x0C06, "home_offset", ApplicationFunction, Position, Integer, Write,
        "Distance from the home place to the zero point.";
    HOMED = 0x0C07, "homed", ApplicationFunction, None, Integer, Read,
        "Whether a homing procedure has ended well: 0 or 1.";
}
