//! Bits of the CIP Motion connection.
//!
//! Generated from `mappings/tables/dictionary/cip-enumerations.toml` and `cip-attributes.toml`: change the table, not this file, and run
//! `cargo run -p mappings --example generate`.

/// Node Control: number and name of each bit.
pub mod node_control {
    /// Bit 0.
    pub const REMOTE_CONTROL: (u32, &str) = (0, "Remote Control");
    /// Bit 1.
    pub const SYNC_CONTROL: (u32, &str) = (1, "Sync Control");
    /// Bit 2.
    pub const DATA_VALID: (u32, &str) = (2, "Controller Data Valid");
    /// Bit 3.
    pub const FAULT_RESET: (u32, &str) = (3, "Node Fault Reset");
    /// Bit 6.
    pub const VENDOR_SPECIFIC_6: (u32, &str) = (6, "Vendor Specific 6");
    /// Bit 7.
    pub const VENDOR_SPECIFIC_7: (u32, &str) = (7, "Vendor Specific 7");
}

/// Node Status: number and name of each bit.
pub mod node_status {
    /// Bit 0.
    pub const REMOTE_MODE: (u32, &str) = (0, "Remote Mode");
    /// Bit 1.
    pub const SYNC_MODE: (u32, &str) = (1, "Sync Mode");
    /// Bit 2.
    pub const DATA_VALID: (u32, &str) = (2, "Device Data Valid");
    /// Bit 3.
    pub const FAULT: (u32, &str) = (3, "Device Node Fault");
    /// Bit 6.
    pub const VENDOR_SPECIFIC_6: (u32, &str) = (6, "Vendor Specific 6");
    /// Bit 7.
    pub const VENDOR_SPECIFIC_7: (u32, &str) = (7, "Vendor Specific 7");
}

/// Time Data Set: number and name of each bit.
pub mod time_data_set {
    /// Bit 0.
    pub const TIME_STAMP: (u32, &str) = (0, "Time Stamp");
    /// Bit 1.
    pub const TIME_OFFSET: (u32, &str) = (1, "Time Offset");
    /// Bit 2.
    pub const UPDATE_DIAGNOSTICS: (u32, &str) = (2, "Update Diagnostics");
    /// Bit 3.
    pub const TIME_DIAGNOSTICS: (u32, &str) = (3, "Time Diagnostics");
}

/// Control Status: number and name of each bit.
pub mod control_status {
    /// Bit 0.
    pub const CONFIGURATION_COMPLETE: (u32, &str) = (0, "Configuration Complete");
    /// Bit 2.
    pub const CONVERTER_BUS_UP: (u32, &str) = (2, "Converter Bus Up");
    /// Bit 3.
    pub const CONVERTER_BUS_UNLOAD: (u32, &str) = (3, "Converter Bus Unload");
    /// Bit 4.
    pub const CONVERTER_AC_POWER_LOSS: (u32, &str) = (4, "Converter AC Power Loss");
}

/// Command Data Set: number and name of each bit.
pub mod command_data_set {
    /// Bit 0.
    pub const POSITION: (u32, &str) = (0, "Command Position");
    /// Bit 1.
    pub const VELOCITY: (u32, &str) = (1, "Command Velocity");
    /// Bit 2.
    pub const ACCELERATION: (u32, &str) = (2, "Command Acceleration");
    /// Bit 3.
    pub const TORQUE: (u32, &str) = (3, "Command Torque");
    /// Bit 6.
    pub const UNWIND_COUNT: (u32, &str) = (6, "Unwind Cycle Count");
    /// Bit 7.
    pub const POSITION_DISPLACEMENT: (u32, &str) = (7, "Position Displacement");
}

/// Actual Data Set: number and name of each bit.
pub mod actual_data_set {
    /// Bit 0.
    pub const POSITION: (u32, &str) = (0, "Actual Position");
    /// Bit 1.
    pub const VELOCITY: (u32, &str) = (1, "Actual Velocity");
    /// Bit 2.
    pub const ACCELERATION: (u32, &str) = (2, "Actual Acceleration");
    /// Bit 6.
    pub const UNWIND_COUNT: (u32, &str) = (6, "Unwind Cycle Count");
    /// Bit 7.
    pub const POSITION_DISPLACEMENT: (u32, &str) = (7, "Position Displacement");
}

/// Status Data Set: number and name of each bit.
pub mod status_data_set {
    /// Bit 0.
    pub const FAULT: (u32, &str) = (0, "Axis Fault");
    /// Bit 1.
    pub const ALARM: (u32, &str) = (1, "Axis Alarm");
    /// Bit 2.
    pub const AXIS_STATUS: (u32, &str) = (2, "Axis Status");
    /// Bit 3.
    pub const IO_STATUS: (u32, &str) = (3, "Axis I/O Status");
    /// Bit 4.
    pub const SAFETY_STATUS: (u32, &str) = (4, "Axis Safety");
    /// Bit 6.
    pub const VENDOR_SPECIFIC_6: (u32, &str) = (6, "Vendor Specific 6");
    /// Bit 7.
    pub const VENDOR_SPECIFIC_7: (u32, &str) = (7, "Vendor Specific 7");
}

/// Axis Status: number and name of each bit.
pub mod axis_status {
    /// Bit 0.
    pub const LOCAL_CONTROL: (u32, &str) = (0, "Local Control");
    /// Bit 1.
    pub const ALARM: (u32, &str) = (1, "Alarm");
    /// Bit 2.
    pub const DC_BUS_UP: (u32, &str) = (2, "DC Bus Up");
    /// Bit 3.
    pub const POWER_STRUCTURE_ENABLED: (u32, &str) = (3, "Power Structure Enabled");
    /// Bit 4.
    pub const MOTOR_FLUX_UP: (u32, &str) = (4, "Motor Flux Up");
    /// Bit 5.
    pub const TRACKING_COMMAND: (u32, &str) = (5, "Tracking Command");
    /// Bit 6.
    pub const POSITION_LOCK: (u32, &str) = (6, "Position Lock");
    /// Bit 7.
    pub const VELOCITY_LOCK: (u32, &str) = (7, "Velocity Lock");
    /// Bit 8.
    pub const VELOCITY_STANDSTILL: (u32, &str) = (8, "Velocity Standstill");
    /// Bit 9.
    pub const VELOCITY_THRESHOLD: (u32, &str) = (9, "Velocity Threshold");
    /// Bit 10.
    pub const VELOCITY_LIMIT: (u32, &str) = (10, "Velocity Limit");
    /// Bit 11.
    pub const ACCELERATION_LIMIT: (u32, &str) = (11, "Acceleration Limit");
    /// Bit 12.
    pub const DECELERATION_LIMIT: (u32, &str) = (12, "Deceleration Limit");
    /// Bit 13.
    pub const TORQUE_THRESHOLD: (u32, &str) = (13, "Torque Threshold");
    /// Bit 14.
    pub const TORQUE_LIMIT: (u32, &str) = (14, "Torque Limit");
    /// Bit 15.
    pub const CURRENT_LIMIT: (u32, &str) = (15, "Current Limit");
    /// Bit 16.
    pub const THERMAL_LIMIT: (u32, &str) = (16, "Thermal Limit");
    /// Bit 17.
    pub const FEEDBACK_INTEGRITY: (u32, &str) = (17, "Feedback Integrity");
    /// Bit 18.
    pub const SHUTDOWN: (u32, &str) = (18, "Shutdown");
    /// Bit 19.
    pub const IN_PROCESS: (u32, &str) = (19, "In Process");
    /// Bit 20.
    pub const DC_BUS_UNLOAD: (u32, &str) = (20, "DC Bus Unload");
    /// Bit 21.
    pub const AC_POWER_LOSS: (u32, &str) = (21, "AC Power Loss");
    /// Bit 22.
    pub const POSITION_CONTROL_MODE: (u32, &str) = (22, "Position Control Mode");
    /// Bit 23.
    pub const VELOCITY_CONTROL_MODE: (u32, &str) = (23, "Velocity Control Mode");
    /// Bit 24.
    pub const TORQUE_CONTROL_MODE: (u32, &str) = (24, "Torque Control Mode");
}

/// Axis I/O Status: number and name of each bit.
pub mod axis_io_status {
    /// Bit 0.
    pub const ENABLE_INPUT: (u32, &str) = (0, "Enable Input");
    /// Bit 1.
    pub const HOME_INPUT: (u32, &str) = (1, "Home Input");
    /// Bit 2.
    pub const REGISTRATION_1_INPUT: (u32, &str) = (2, "Registration 1 Input");
    /// Bit 3.
    pub const REGISTRATION_2_INPUT: (u32, &str) = (3, "Registration 2 Input");
    /// Bit 4.
    pub const POSITIVE_OVERTRAVEL_OK: (u32, &str) = (4, "Positive Overtravel OK Input");
    /// Bit 5.
    pub const NEGATIVE_OVERTRAVEL_OK: (u32, &str) = (5, "Negative Overtravel OK Input");
    /// Bit 6.
    pub const FEEDBACK_1_THERMOSTAT_OK: (u32, &str) = (6, "Feedback 1 Thermostat OK Input");
    /// Bit 7.
    pub const RESISTIVE_BRAKE_RELEASE: (u32, &str) = (7, "Resistive Brake Release Output");
    /// Bit 8.
    pub const MECHANICAL_BRAKE_RELEASE: (u32, &str) = (8, "Mechanical Brake Release Output");
    /// Bit 9.
    pub const MOTOR_THERMOSTAT_OK: (u32, &str) = (9, "Motor Thermostat OK Input");
}

/// Event Checking: number and name of each bit.
pub mod event_checking {
    /// Bit 0.
    pub const REG_1_POSITIVE: (u32, &str) = (0, "Reg 1 Pos Edge");
    /// Bit 1.
    pub const REG_1_NEGATIVE: (u32, &str) = (1, "Reg 1 Neg Edge");
    /// Bit 2.
    pub const REG_2_POSITIVE: (u32, &str) = (2, "Reg 2 Pos Edge");
    /// Bit 3.
    pub const REG_2_NEGATIVE: (u32, &str) = (3, "Reg 2 Neg Edge");
    /// Bit 4.
    pub const REG_1_POSITIVE_WINDOW: (u32, &str) = (4, "Reg 1 Pos Edge Window");
    /// Bit 5.
    pub const REG_1_NEGATIVE_WINDOW: (u32, &str) = (5, "Reg 1 Neg Edge Window");
    /// Bit 6.
    pub const REG_2_POSITIVE_WINDOW: (u32, &str) = (6, "Reg 2 Pos Edge Window");
    /// Bit 7.
    pub const REG_2_NEGATIVE_WINDOW: (u32, &str) = (7, "Reg 2 Neg Edge Window");
    /// Bit 8.
    pub const REG_1_POSITIVE_REARM: (u32, &str) = (8, "Reg 1 Pos Auto-rearm");
    /// Bit 9.
    pub const REG_1_NEGATIVE_REARM: (u32, &str) = (9, "Reg 1 Neg Auto-rearm");
    /// Bit 10.
    pub const REG_2_POSITIVE_REARM: (u32, &str) = (10, "Reg 2 Pos Auto-rearm");
    /// Bit 11.
    pub const REG_2_NEGATIVE_REARM: (u32, &str) = (11, "Reg 2 Neg Auto-rearm");
    /// Bit 12.
    pub const WATCH_1_FORWARD: (u32, &str) = (12, "Watch Position 1 Fwd");
    /// Bit 13.
    pub const WATCH_1_REVERSE: (u32, &str) = (13, "Watch Position 1 Rev");
    /// Bit 14.
    pub const WATCH_2_FORWARD: (u32, &str) = (14, "Watch Position 2 Fwd");
    /// Bit 15.
    pub const WATCH_2_REVERSE: (u32, &str) = (15, "Watch Position 2 Rev");
    /// Bit 16.
    pub const MARKER_POSITIVE: (u32, &str) = (16, "Marker Pos Edge");
    /// Bit 17.
    pub const MARKER_NEGATIVE: (u32, &str) = (17, "Marker Neg Edge");
    /// Bit 18.
    pub const HOME_POSITIVE: (u32, &str) = (18, "Home Switch Pos Edge");
    /// Bit 19.
    pub const HOME_NEGATIVE: (u32, &str) = (19, "Home Switch Neg Edge");
    /// Bit 20.
    pub const HOME_MARKER_PP: (u32, &str) = (20, "Home Switch-Marker ++");
    /// Bit 21.
    pub const HOME_MARKER_PN: (u32, &str) = (21, "Home Switch-Marker +-");
    /// Bit 22.
    pub const HOME_MARKER_NP: (u32, &str) = (22, "Home Switch-Marker -+");
    /// Bit 23.
    pub const HOME_MARKER_NN: (u32, &str) = (23, "Home Switch-Marker --");
    /// Bit 24.
    pub const HOME_TORQUE: (u32, &str) = (24, "Home Torque Threshold");
    /// Bit 31.
    pub const EXTENDED_FORMAT: (u32, &str) = (31, "Extended Format");
}
