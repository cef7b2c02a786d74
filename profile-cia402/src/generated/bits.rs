//! Bits of CANopen devices and CiA 402 drives.
//!
//! Generated from `mappings/tables/dictionary/cia402-codes.toml`: change the table, not this file, and run
//! `cargo run -p mappings --example generate`.

/// Error register: mask of each field.
pub mod error_register {
    /// Generic error.
    pub const GENERIC_ERROR: u8 = 0x01;
    /// Current.
    pub const CURRENT: u8 = 0x02;
    /// Voltage.
    pub const VOLTAGE: u8 = 0x04;
    /// Temperature.
    pub const TEMPERATURE: u8 = 0x08;
    /// Communication error.
    pub const COMMUNICATION_ERROR: u8 = 0x10;
    /// Device profile specific.
    pub const DEVICE_PROFILE_SPECIFIC: u8 = 0x20;
    /// Manufacturer specific.
    pub const MANUFACTURER_SPECIFIC: u8 = 0x80;
}

/// Supported drive modes: mask of each field.
pub mod supported_modes {
    /// pp.
    pub const PP: u32 = 0x00000001;
    /// vl.
    pub const VL: u32 = 0x00000002;
    /// pv.
    pub const PV: u32 = 0x00000004;
    /// tq.
    pub const TQ: u32 = 0x00000008;
    /// hm.
    pub const HM: u32 = 0x00000020;
    /// ip.
    pub const IP: u32 = 0x00000040;
    /// csp.
    pub const CSP: u32 = 0x00000080;
    /// csv.
    pub const CSV: u32 = 0x00000100;
    /// cst.
    pub const CST: u32 = 0x00000200;
    /// cstca.
    pub const CSTCA: u32 = 0x00000400;
    /// Modes of the manufacturer.
    pub const MODES_OF_THE_MANUFACTURER: u32 = 0xFFFF0000;
}

/// Controlword: mask of each field.
pub mod controlword {
    /// Switch on.
    pub const SWITCH_ON: u16 = 0x0001;
    /// Enable voltage.
    pub const ENABLE_VOLTAGE: u16 = 0x0002;
    /// Quick stop.
    pub const QUICK_STOP: u16 = 0x0004;
    /// Enable operation.
    pub const ENABLE_OPERATION: u16 = 0x0008;
    /// New set-point.
    pub const NEW_SET_POINT: u16 = 0x0010;
    /// Change set immediately.
    pub const CHANGE_SET_IMMEDIATELY: u16 = 0x0020;
    /// Relative.
    pub const RELATIVE: u16 = 0x0040;
    /// Enable ramp.
    pub const ENABLE_RAMP: u16 = 0x0010;
    /// Unlock ramp.
    pub const UNLOCK_RAMP: u16 = 0x0020;
    /// Reference ramp.
    pub const REFERENCE_RAMP: u16 = 0x0040;
    /// Homing operation start.
    pub const HOMING_OPERATION_START: u16 = 0x0010;
    /// Enable interpolation.
    pub const ENABLE_INTERPOLATION: u16 = 0x0010;
    /// Fault reset.
    pub const FAULT_RESET: u16 = 0x0080;
    /// Halt.
    pub const HALT: u16 = 0x0100;
    /// Change on set-point.
    pub const CHANGE_ON_SET_POINT: u16 = 0x0200;
    /// Manufacturer specific.
    pub const MANUFACTURER_SPECIFIC: u16 = 0xF800;
}

/// Statusword: mask of each field.
pub mod statusword {
    /// Ready to switch on.
    pub const READY_TO_SWITCH_ON: u16 = 0x0001;
    /// Switched on.
    pub const SWITCHED_ON: u16 = 0x0002;
    /// Operation enabled.
    pub const OPERATION_ENABLED: u16 = 0x0004;
    /// Fault.
    pub const FAULT: u16 = 0x0008;
    /// Voltage enabled.
    pub const VOLTAGE_ENABLED: u16 = 0x0010;
    /// Quick stop.
    pub const QUICK_STOP: u16 = 0x0020;
    /// Switch on disabled.
    pub const SWITCH_ON_DISABLED: u16 = 0x0040;
    /// Warning.
    pub const WARNING: u16 = 0x0080;
    /// Manufacturer specific.
    pub const MANUFACTURER_SPECIFIC: u16 = 0x0100;
    /// Remote.
    pub const REMOTE: u16 = 0x0200;
    /// Target reached.
    pub const TARGET_REACHED: u16 = 0x0400;
    /// Internal limit active.
    pub const INTERNAL_LIMIT_ACTIVE: u16 = 0x0800;
    /// Set-point acknowledge.
    pub const SET_POINT_ACKNOWLEDGE: u16 = 0x1000;
    /// Following error.
    pub const FOLLOWING_ERROR: u16 = 0x2000;
    /// Speed.
    pub const SPEED: u16 = 0x1000;
    /// Max slippage error.
    pub const MAX_SLIPPAGE_ERROR: u16 = 0x2000;
    /// Homing attained.
    pub const HOMING_ATTAINED: u16 = 0x1000;
    /// Homing error.
    pub const HOMING_ERROR: u16 = 0x2000;
    /// Interpolation active.
    pub const INTERPOLATION_ACTIVE: u16 = 0x1000;
    /// Drive follows the command value.
    pub const DRIVE_FOLLOWS_THE_COMMAND_VALUE: u16 = 0x1000;
    /// Manufacturer specific 14.
    pub const MANUFACTURER_SPECIFIC_14: u16 = 0xC000;
}

/// Touch probe function: mask of each field.
pub mod probe_function {
    /// Enable touch probe 1.
    pub const ENABLE_TOUCH_PROBE_1: u16 = 0x0001;
    /// Continuous 1.
    pub const CONTINUOUS_1: u16 = 0x0002;
    /// Index pulse 1.
    pub const INDEX_PULSE_1: u16 = 0x000C;
    /// Sample at positive edge 1.
    pub const SAMPLE_AT_POSITIVE_EDGE_1: u16 = 0x0010;
    /// Sample at negative edge 1.
    pub const SAMPLE_AT_NEGATIVE_EDGE_1: u16 = 0x0020;
    /// Enable touch probe 2.
    pub const ENABLE_TOUCH_PROBE_2: u16 = 0x0100;
    /// Continuous 2.
    pub const CONTINUOUS_2: u16 = 0x0200;
    /// Index pulse 2.
    pub const INDEX_PULSE_2: u16 = 0x0C00;
    /// Sample at positive edge 2.
    pub const SAMPLE_AT_POSITIVE_EDGE_2: u16 = 0x1000;
    /// Sample at negative edge 2.
    pub const SAMPLE_AT_NEGATIVE_EDGE_2: u16 = 0x2000;
}

/// Touch probe status: mask of each field.
pub mod probe_status {
    /// Touch probe 1 enabled.
    pub const TOUCH_PROBE_1_ENABLED: u16 = 0x0001;
    /// Positive edge stored 1.
    pub const POSITIVE_EDGE_STORED_1: u16 = 0x0002;
    /// Negative edge stored 1.
    pub const NEGATIVE_EDGE_STORED_1: u16 = 0x0004;
    /// Touch probe 2 enabled.
    pub const TOUCH_PROBE_2_ENABLED: u16 = 0x0100;
    /// Positive edge stored 2.
    pub const POSITIVE_EDGE_STORED_2: u16 = 0x0200;
    /// Negative edge stored 2.
    pub const NEGATIVE_EDGE_STORED_2: u16 = 0x0400;
}

/// Polarity: mask of each field.
pub mod polarity {
    /// Velocity polarity.
    pub const VELOCITY_POLARITY: u8 = 0x40;
    /// Position polarity.
    pub const POSITION_POLARITY: u8 = 0x80;
}
