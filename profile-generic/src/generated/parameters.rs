//! The catalogue of generic parameters.
//!
//! Generated from `mappings/tables/dictionary/generic.toml`: change the table, not this file, and run
//! `cargo run -p mappings --example generate`.

use crate::parameter::parameter_rows;

parameter_rows! {
    VENDOR_NAME = 0x0101, "vendor_name", DeviceIdentification, None, Text, Read,
        "Name of the vendor.";
    VENDOR_ID = 0x0102, "vendor_id", DeviceIdentification, None, Integer, Read,
        "Number of the vendor in the registry of its profile.";
    DEVICE_TYPE = 0x0103, "device_type", DeviceIdentification, None, Integer, Read,
        "Kind of device, as its profile numbers it.";
    PRODUCT_CODE = 0x0104, "product_code", DeviceIdentification, None, Integer, Read,
        "Number of the product within the vendor's range.";
    PRODUCT_NAME = 0x0105, "product_name", DeviceIdentification, None, Text, Read,
        "Name of the product.";
    SERIAL_NUMBER = 0x0106, "serial_number", DeviceIdentification, None, Text, Read,
        "Serial number of the device.";
    HARDWARE_VERSION = 0x0107, "hardware_version", DeviceIdentification, None, Text, Read,
        "Version of the hardware.";
    FIRMWARE_VERSION = 0x0108, "firmware_version", DeviceIdentification, None, Text, Read,
        "Version of the firmware.";
    PROFILE_VERSION = 0x0109, "profile_version", DeviceIdentification, None, Text, Read,
        "Version of the drive profile that the device follows.";
    DEVICE_NAME = 0x010A, "device_name", DeviceIdentification, None, Text, Write,
        "Name that the user gave to the device.";
    AXIS_NAME = 0x010B, "axis_name", DeviceIdentification, None, Text, Write,
        "Name that the user gave to the axis.";
    LOCATION = 0x010C, "location", DeviceIdentification, None, Text, Write,
        "Where the user says that the device is.";

    NODE_ADDRESS = 0x0201, "node_address", Communication, None, Integer, Read,
        "Address of the device on its bus.";
    UPDATE_PERIOD = 0x0202, "update_period", Communication, Time, Integer, WriteWhileDisabled,
        "Period of the controller's updates.";
    DEVICE_UPDATE_PERIOD = 0x0203, "device_update_period", Communication, Time, Integer, Read,
        "Period of the drive's own control loop.";
    COMMAND_DELAY = 0x0204, "command_delay", Communication, Time, Integer, Read,
        "From the arrival of set-points to their effect.";
    FEEDBACK_DELAY = 0x0205, "feedback_delay", Communication, Time, Integer, Read,
        "From taking the actual values to their being sent.";
    MISSED_UPDATE_LIMIT = 0x0206, "missed_update_limit", Communication, None, Integer, WriteWhileDisabled,
        "Updates in a row that may be missing before the set-points are taken as lost.";
    SYNCHRONIZED = 0x0207, "synchronized", Communication, None, Integer, Read,
        "Whether the local clock follows the system time: 0 or 1.";
    SYSTEM_TIME = 0x0208, "system_time", Communication, Time, Integer, Read,
        "System time of the device.";
    SYSTEM_TIME_OFFSET = 0x0209, "system_time_offset", Communication, Time, Integer, Read,
        "System time less local time.";
    MISSED_UPDATES = 0x020A, "missed_updates", Communication, None, Integer, Read,
        "Updates that did not arrive since the connection was made.";
    LATE_UPDATES = 0x020B, "late_updates", Communication, None, Integer, Read,
        "Updates that arrived after their target time since the connection was made.";

    OPERATING_MODE = 0x0301, "operating_mode", DeviceControl, None, Integer, WriteWhileDisabled,
        "What the drive follows, see the operating modes.";
    SUPPORTED_OPERATING_MODES = 0x0302, "supported_operating_modes", DeviceControl, None, Integer, Read,
        "Bit set of the operating modes that the drive can run.";
    INTERPOLATION_SOURCE = 0x0303, "interpolation_source", DeviceControl, None, Integer, WriteWhileDisabled,
        "Who generates the fine set-points: 0 the controller, 1 the drive.";
    CONTROL_SOURCE = 0x0304, "control_source", DeviceControl, None, Integer, Read,
        "Who has control: 0 the network, 1 a panel or tool.";
    FEEDBACK_MODE = 0x0305, "feedback_mode", DeviceControl, None, Integer, WriteWhileDisabled,
        "Which feedback closes the loops: 0 none, 1 the motor's, 2 the load's, 3 both.";
    DRIVE_STATE = 0x0306, "drive_state", DeviceControl, None, Integer, Read,
        "State of the generic state machine.";
    STATUS_BITS = 0x0307, "status_bits", DeviceControl, None, Integer, Read,
        "Status of the drive, one bit each.";
    INHIBITS = 0x0308, "inhibits", DeviceControl, None, Integer, Read,
        "What keeps the axis from starting, one bit each.";
    ACTIVE_FAULT = 0x0309, "active_fault", DeviceControl, None, Integer, Read,
        "Cause of the latched fault, 0 for none.";
    ACTIVE_FAULT_VENDOR_CODE = 0x030A, "active_fault_vendor_code", DeviceControl, None, Integer, Read,
        "Code of the vendor for the latched fault.";
    ACTIVE_WARNING = 0x030B, "active_warning", DeviceControl, None, Integer, Read,
        "Cause of the present warning, 0 for none.";

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
    CURRENT_LIMIT = 0x040B, "current_limit", BasicDrive, Current, Integer, Write,
        "Highest motor current.";
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
    TORQUE_FILTER_FREQUENCY = 0x0507, "torque_filter_frequency", BasicDrive, Frequency, Integer, Write,
        "Corner of the low pass of the torque set-point.";
    TORQUE_NOTCH_FREQUENCY = 0x0508, "torque_notch_frequency", BasicDrive, Frequency, Integer, Write,
        "Centre of the notch filter of the torque set-point, 0 for none.";
    VELOCITY_FILTER_FREQUENCY = 0x0509, "velocity_filter_frequency", BasicDrive, Frequency, Integer, Write,
        "Corner of the low pass of the velocity feedback.";
    CURRENT_LOOP_BANDWIDTH = 0x050A, "current_loop_bandwidth", BasicDrive, Frequency, Integer, Write,
        "Bandwidth of the current loop.";
    SYSTEM_INERTIA = 0x050B, "system_inertia", BasicDrive, Inertia, Integer, Write,
        "Inertia of motor and load seen from the motor.";
    BACKLASH_COMPENSATION = 0x050C, "backlash_compensation", BasicDrive, Position, Integer, Write,
        "Backlash that the drive compensates for.";
    FRICTION_COMPENSATION = 0x050D, "friction_compensation", BasicDrive, Torque, Integer, Write,
        "Torque added in the direction of motion against sliding friction.";
    POLARITY = 0x050E, "polarity", BasicDrive, None, Integer, WriteWhileDisabled,
        "Direction of the motor for positive set-points: 0 as built, 1 reversed.";

    AXIS_UNIT_KIND = 0x0601, "axis_unit_kind", BasicDrive, None, Integer, WriteWhileDisabled,
        "Whether the axis is rotary (0, revolutions) or linear (1, millimetres).";
    POSITION_COUNTS = 0x0602, "position_counts", BasicDrive, None, Integer, WriteWhileDisabled,
        "Counts in the stated number of axis units.";
    POSITION_UNITS = 0x0603, "position_units", BasicDrive, None, Integer, WriteWhileDisabled,
        "Axis units that the stated number of counts makes up.";
    MODULO_COUNTS = 0x0604, "modulo_counts", BasicDrive, None, Integer, WriteWhileDisabled,
        "Counts after which the position begins again, 0 for never.";
    GEAR_RATIO_NUMERATOR = 0x0605, "gear_ratio_numerator", BasicDrive, None, Integer, WriteWhileDisabled,
        "Motor revolutions in the stated number of load revolutions.";
    GEAR_RATIO_DENOMINATOR = 0x0606, "gear_ratio_denominator", BasicDrive, None, Integer, WriteWhileDisabled,
        "Load revolutions for the stated number of motor revolutions.";
    FEED_CONSTANT = 0x0607, "feed_constant", BasicDrive, Position, Integer, WriteWhileDisabled,
        "Travel of the load in one revolution of its shaft.";
    POSITION_OFFSET = 0x0608, "position_offset", BasicDrive, Position, Integer, WriteWhileDisabled,
        "Position of the machine's zero point.";
    MOTOR_TURNS_PER_UNIT = 0x0609, "motor_turns_per_unit", BasicDrive, None, Integer, Read,
        "Revolutions of the motor in one axis unit, in 1e-9; the gateway computes it from gear and feed.";

    MOTOR_TYPE = 0x0701, "motor_type", BasicDrive, None, Integer, WriteWhileDisabled,
        "Kind of motor: 0 none, 1 synchronous, 2 induction, 3 linear synchronous, 4 linear induction.";
    MOTOR_NAME = 0x0702, "motor_name", BasicDrive, None, Text, Read,
        "Type designation of the motor.";
    MOTOR_SERIAL_NUMBER = 0x0703, "motor_serial_number", BasicDrive, None, Text, Read,
        "Serial number of the motor.";
    MOTOR_RATED_TORQUE = 0x0704, "motor_rated_torque", BasicDrive, TorqueAbsolute, Integer, WriteWhileDisabled,
        "Rated torque or force: the whole that torque is told in parts of.";
    MOTOR_PEAK_TORQUE = 0x0705, "motor_peak_torque", BasicDrive, Torque, Integer, WriteWhileDisabled,
        "Peak torque or force.";
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
    COMMUTATION_OFFSET = 0x0712, "commutation_offset", BasicDrive, None, Integer, WriteWhileDisabled,
        "Electrical angle between feedback and winding, in 1e-6 degree.";
    BRAKE_ENGAGE_TIME = 0x0713, "brake_engage_time", ApplicationFunction, Time, Integer, Write,
        "From the order to the brake's being closed.";
    BRAKE_RELEASE_TIME = 0x0714, "brake_release_time", ApplicationFunction, Time, Integer, Write,
        "From the order to the brake's being open.";

    FEEDBACK_TYPE = 0x0801, "feedback_type", BasicDrive, None, Integer, WriteWhileDisabled,
        "Kind of the motor feedback, as its profile numbers it.";
    FEEDBACK_NAME = 0x0802, "feedback_name", BasicDrive, None, Text, Read,
        "Type designation of the motor feedback.";
    FEEDBACK_SERIAL_NUMBER = 0x0803, "feedback_serial_number", BasicDrive, None, Text, Read,
        "Serial number of the motor feedback.";
    FEEDBACK_RESOLUTION = 0x0804, "feedback_resolution", BasicDrive, None, Integer, WriteWhileDisabled,
        "Counts of the motor feedback in one revolution or millimetre.";
    FEEDBACK_TURNS = 0x0805, "feedback_turns", BasicDrive, None, Integer, WriteWhileDisabled,
        "Revolutions that an absolute motor feedback can tell apart, 1 for single turn.";
    FEEDBACK_POLARITY = 0x0806, "feedback_polarity", BasicDrive, None, Integer, WriteWhileDisabled,
        "Direction of the motor feedback: 0 as built, 1 reversed.";
    LOAD_FEEDBACK_TYPE = 0x0807, "load_feedback_type", BasicDrive, None, Integer, WriteWhileDisabled,
        "Kind of the load feedback, as its profile numbers it.";
    LOAD_FEEDBACK_RESOLUTION = 0x0808, "load_feedback_resolution", BasicDrive, None, Integer, WriteWhileDisabled,
        "Counts of the load feedback in one revolution or millimetre.";
    LOAD_FEEDBACK_POLARITY = 0x0809, "load_feedback_polarity", BasicDrive, None, Integer, WriteWhileDisabled,
        "Direction of the load feedback: 0 as built, 1 reversed.";

    POSITION_COMMAND = 0x0901, "position_command", BasicDrive, Position, Integer, Read,
        "Position set-point in effect.";
    VELOCITY_COMMAND = 0x0902, "velocity_command", BasicDrive, Velocity, Integer, Read,
        "Velocity set-point in effect.";
    ACCELERATION_COMMAND = 0x0903, "acceleration_command", BasicDrive, Acceleration, Integer, Read,
        "Acceleration set-point in effect.";
    TORQUE_COMMAND = 0x0904, "torque_command", BasicDrive, Torque, Integer, Read,
        "Torque set-point in effect.";
    POSITION_ACTUAL = 0x0905, "position_actual", BasicDrive, Position, Integer, Read,
        "Actual position.";
    LOAD_POSITION_ACTUAL = 0x0906, "load_position_actual", BasicDrive, Position, Integer, Read,
        "Actual position of the load feedback.";
    VELOCITY_ACTUAL = 0x0907, "velocity_actual", BasicDrive, Velocity, Integer, Read,
        "Actual velocity.";
    ACCELERATION_ACTUAL = 0x0908, "acceleration_actual", BasicDrive, Acceleration, Integer, Read,
        "Actual acceleration.";
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
    DIGITAL_INPUTS = 0x0910, "digital_inputs", BasicDrive, None, Integer, Read,
        "Digital inputs, bit 0 first.";
    DIGITAL_OUTPUTS = 0x0911, "digital_outputs", BasicDrive, None, Integer, Write,
        "Digital outputs, bit 0 first.";
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

    BUS_VOLTAGE = 0x0A01, "bus_voltage", BasicDrive, Voltage, Integer, Read,
        "Voltage of the DC bus.";
    BUS_NOMINAL_VOLTAGE = 0x0A02, "bus_nominal_voltage", BasicDrive, Voltage, Integer, WriteWhileDisabled,
        "Nominal voltage of the DC bus.";
    BUS_OVER_VOLTAGE_LIMIT = 0x0A03, "bus_over_voltage_limit", BasicDrive, Voltage, Integer, Write,
        "Voltage of the DC bus above which the drive faults.";
    BUS_UNDER_VOLTAGE_LIMIT = 0x0A04, "bus_under_voltage_limit", BasicDrive, Voltage, Integer, Write,
        "Voltage of the DC bus below which the drive faults.";
    POWER_LOSS_TIME = 0x0A05, "power_loss_time", BasicDrive, Time, Integer, Write,
        "How long the DC bus may be without power.";
    POWER_LOSS_ACTION = 0x0A06, "power_loss_action", BasicDrive, None, Integer, Write,
        "What to do when the DC bus loses its power.";
    REGULATOR_CAPACITY = 0x0A07, "regulator_capacity", BasicDrive, Fraction, Integer, Read,
        "Use of the brake resistor's thermal capacity.";
    MOTOR_TEMPERATURE = 0x0A08, "motor_temperature", BasicDrive, Temperature, Integer, Read,
        "Temperature of the motor.";
    DRIVE_TEMPERATURE = 0x0A09, "drive_temperature", BasicDrive, Temperature, Integer, Read,
        "Temperature of the power stage.";
    CONTROL_TEMPERATURE = 0x0A0A, "control_temperature", BasicDrive, Temperature, Integer, Read,
        "Temperature of the control electronics.";
    MOTOR_CAPACITY = 0x0A0B, "motor_capacity", BasicDrive, Fraction, Integer, Read,
        "Use of the motor's thermal capacity.";
    DRIVE_CAPACITY = 0x0A0C, "drive_capacity", BasicDrive, Fraction, Integer, Read,
        "Use of the power stage's thermal capacity.";
    OPERATING_TIME = 0x0A0D, "operating_time", BasicDrive, Time, Integer, Read,
        "Time for which the power stage has been on since it was built.";
    ENERGY = 0x0A0E, "energy", BasicDrive, None, Integer, Read,
        "Energy taken by the motor, in milliwatt hours.";
    DRIVE_RATED_CURRENT = 0x0A0F, "drive_rated_current", BasicDrive, Current, Integer, Read,
        "Rated output current of the power stage.";
    DRIVE_PEAK_CURRENT = 0x0A10, "drive_peak_current", BasicDrive, Current, Integer, Read,
        "Peak output current of the power stage.";

    STOPPING_ACTION = 0x0B01, "stopping_action", BasicDrive, None, Integer, Write,
        "How a disable stops the axis: 0 coast, 1 decelerate, 2 at the current limit.";
    SHUTDOWN_ACTION = 0x0B02, "shutdown_action", BasicDrive, None, Integer, Write,
        "What a shutdown does with the power stage: 0 keeps its supply, 1 drops it.";
    STOPPING_TORQUE = 0x0B04, "stopping_torque", BasicDrive, Torque, Integer, Write,
        "Torque of a stop at the current limit.";
    STOPPING_TIME_LIMIT = 0x0B05, "stopping_time_limit", BasicDrive, Time, Integer, Write,
        "How long a controlled stop may take before the torque is switched off.";
    STARTING_TIME_LIMIT = 0x0B06, "starting_time_limit", BasicDrive, Time, Integer, Write,
        "How long the drive may take to come into operation.";
    COMMUNICATION_LOSS_ACTION = 0x0B07, "communication_loss_action", BasicDrive, None, Integer, Write,
        "Reaction to the loss of the controller, numbered as the reactions.";
    POSITION_ERROR_ACTION = 0x0B08, "position_error_action", BasicDrive, None, Integer, Write,
        "Reaction to an excessive position error, numbered as the reactions.";
    HARDWARE_OVERTRAVEL_ACTION = 0x0B09, "hardware_overtravel_action", BasicDrive, None, Integer, Write,
        "Reaction to a limit switch, numbered as the reactions.";
    SOFTWARE_OVERTRAVEL_ACTION = 0x0B0A, "software_overtravel_action", BasicDrive, None, Integer, Write,
        "Reaction to a software limit, numbered as the reactions.";
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
    REGISTRATION_1_POSITIVE_POSITION = 0x0C08, "registration_1_positive_position", ApplicationFunction, Position, Integer, Read,
        "Position at the last positive edge of registration input 1.";
    REGISTRATION_1_NEGATIVE_POSITION = 0x0C09, "registration_1_negative_position", ApplicationFunction, Position, Integer, Read,
        "Position at the last negative edge of registration input 1.";
    REGISTRATION_1_POSITIVE_TIME = 0x0C0A, "registration_1_positive_time", ApplicationFunction, Time, Integer, Read,
        "System time of the last positive edge of registration input 1.";
    REGISTRATION_1_NEGATIVE_TIME = 0x0C0B, "registration_1_negative_time", ApplicationFunction, Time, Integer, Read,
        "System time of the last negative edge of registration input 1.";
    REGISTRATION_2_POSITIVE_POSITION = 0x0C0C, "registration_2_positive_position", ApplicationFunction, Position, Integer, Read,
        "Position at the last positive edge of registration input 2.";
    REGISTRATION_2_NEGATIVE_POSITION = 0x0C0D, "registration_2_negative_position", ApplicationFunction, Position, Integer, Read,
        "Position at the last negative edge of registration input 2.";
    REGISTRATION_2_POSITIVE_TIME = 0x0C0E, "registration_2_positive_time", ApplicationFunction, Time, Integer, Read,
        "System time of the last positive edge of registration input 2.";
    REGISTRATION_2_NEGATIVE_TIME = 0x0C0F, "registration_2_negative_time", ApplicationFunction, Time, Integer, Read,
        "System time of the last negative edge of registration input 2.";
    MARKER_POSITION = 0x0C10, "marker_position", ApplicationFunction, Position, Integer, Read,
        "Position at the last marker of the feedback.";
    HOME_SWITCH_POSITION = 0x0C11, "home_switch_position", ApplicationFunction, Position, Integer, Read,
        "Position at the last edge of the home switch.";
    WATCH_POSITION = 0x0C12, "watch_position", ApplicationFunction, Position, Integer, Write,
        "Position whose passing is an event.";
}
