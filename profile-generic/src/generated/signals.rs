//! The signals of the process image.
//!
//! Generated from `mappings/tables/dictionary/generic.toml`: change the table, not this file, and run
//! `cargo run -p mappings --example generate`.

use crate::image::signal_rows;

signal_rows! {
    PositionCommand = "position_command", Position, Command, "Set-point of the position.";
    VelocityCommand = "velocity_command", Velocity, Command, "Set-point of the velocity.";
    AccelerationCommand = "acceleration_command", Acceleration, Command, "Set-point of the acceleration.";
    TorqueCommand = "torque_command", Torque, Command, "Set-point of the torque or force.";
    PositionOffset = "position_offset", Position, Command, "Added to the position set-point.";
    VelocityOffset = "velocity_offset", Velocity, Command, "Added to the output of the position loop: trim and feed-forward of the velocity.";
    TorqueOffset = "torque_offset", Torque, Command, "Added to the torque set-point: trim and feed-forward of the torque.";
    TargetPosition = "target_position", Position, Command, "Where the drive is to go by itself.";
    ProfileVelocity = "profile_velocity", Velocity, Command, "Highest speed on the way to the target.";
    ProfileAcceleration = "profile_acceleration", Acceleration, Command, "Acceleration on the way to the target.";
    ProfileDeceleration = "profile_deceleration", Acceleration, Command, "Deceleration on the way to the target.";
    PositionActual = "position_actual", Position, Feedback, "Actual position.";
    VelocityActual = "velocity_actual", Velocity, Feedback, "Actual velocity.";
    AccelerationActual = "acceleration_actual", Acceleration, Feedback, "Actual acceleration.";
    TorqueActual = "torque_actual", Torque, Feedback, "Actual torque or force.";
    CurrentActual = "current_actual", Current, Feedback, "Actual motor current.";
    BusVoltage = "bus_voltage", Voltage, Feedback, "Voltage of the DC bus.";
    Temperature = "temperature", Temperature, Feedback, "Temperature of the motor.";
    FollowingError = "following_error", Position, Feedback, "Position set-point less actual position, as the drive's loop sees it.";
    DigitalInputs = "digital_inputs", None, Feedback, "Digital inputs of the drive, bit 0 first.";
}
