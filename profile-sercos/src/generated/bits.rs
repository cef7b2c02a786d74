//! Bits of the words of SERCOS.
//!
//! Generated from `mappings/tables/dictionary/sercos-bits.toml`: change the table, not this file, and run
//! `cargo run -p mappings --example generate`.

/// Drive control: mask of each field.
pub mod drive_control {
    /// Drive on.
    pub const DRIVE_ON: u16 = 0x8000;
    /// Enable drive.
    pub const ENABLE_DRIVE: u16 = 0x4000;
    /// Restart drive.
    pub const RESTART_DRIVE: u16 = 0x2000;
    /// Operation mode.
    pub const OPERATION_MODE: u16 = 0x0700;
    /// Reserved.
    pub const RESERVED: u16 = 0x18FF;
}

/// Drive status: mask of each field.
pub mod drive_status {
    /// Ready to operate.
    pub const READY_TO_OPERATE: u16 = 0xC000;
    /// Drive shut-down error.
    pub const DRIVE_SHUT_DOWN_ERROR: u16 = 0x2000;
    /// Drive warning.
    pub const DRIVE_WARNING: u16 = 0x1000;
    /// Actual operation mode.
    pub const ACTUAL_OPERATION_MODE: u16 = 0x0700;
    /// Quick stop active.
    pub const QUICK_STOP_ACTIVE: u16 = 0x0080;
    /// Position feedback value status.
    pub const POSITION_FEEDBACK_VALUE_STATUS: u16 = 0x0020;
    /// Drive halt acknowledge.
    pub const DRIVE_HALT_ACKNOWLEDGE: u16 = 0x0010;
    /// Command value processing.
    pub const COMMAND_VALUE_PROCESSING: u16 = 0x0008;
    /// Reserved.
    pub const RESERVED: u16 = 0x0847;
}

/// Device control: mask of each field.
pub mod device_control {
    /// Identification.
    pub const IDENTIFICATION: u16 = 0x8000;
    /// Topology change.
    pub const TOPOLOGY_CHANGE: u16 = 0x4000;
    /// Commanded topology.
    pub const COMMANDED_TOPOLOGY: u16 = 0x3000;
    /// Physical ring closed.
    pub const PHYSICAL_RING_CLOSED: u16 = 0x0800;
    /// Master valid.
    pub const MASTER_VALID: u16 = 0x0100;
    /// Reserved.
    pub const RESERVED: u16 = 0x06FF;
}

/// Device status: mask of each field.
pub mod device_status {
    /// Communication warning.
    pub const COMMUNICATION_WARNING: u16 = 0x8000;
    /// Topology change acknowledge.
    pub const TOPOLOGY_CHANGE_ACKNOWLEDGE: u16 = 0x4000;
    /// Current topology.
    pub const CURRENT_TOPOLOGY: u16 = 0x3000;
    /// Inactive port.
    pub const INACTIVE_PORT: u16 = 0x0C00;
    /// Error in a connection.
    pub const ERROR_IN_A_CONNECTION: u16 = 0x0200;
    /// Slave valid.
    pub const SLAVE_VALID: u16 = 0x0100;
    /// Device error (C1D).
    pub const DEVICE_ERROR_C1D: u16 = 0x0080;
    /// Device warning (C2D).
    pub const DEVICE_WARNING_C2D: u16 = 0x0040;
    /// Procedure command change.
    pub const PROCEDURE_COMMAND_CHANGE: u16 = 0x0020;
    /// Parameterization level active.
    pub const PARAMETERIZATION_LEVEL_ACTIVE: u16 = 0x0010;
    /// Reserved.
    pub const RESERVED: u16 = 0x000F;
}

/// Procedure command control: mask of each field.
pub mod procedure_control {
    /// Set.
    pub const SET: u16 = 0x0001;
    /// Start.
    pub const START: u16 = 0x0002;
    /// Reserved.
    pub const RESERVED: u16 = 0xFFFC;
}

/// Procedure command acknowledgement: mask of each field.
pub mod procedure_acknowledgement {
    /// Set in drive.
    pub const SET_IN_DRIVE: u16 = 0x0001;
    /// Started.
    pub const STARTED: u16 = 0x0002;
    /// Busy.
    pub const BUSY: u16 = 0x0004;
    /// Error.
    pub const ERROR: u16 = 0x0008;
    /// Reserved.
    pub const RESERVED: u16 = 0xFFF0;
}

/// Data status: mask of each field.
pub mod data_status {
    /// Operation data invalid.
    pub const OPERATION_DATA_INVALID: u16 = 0x0100;
    /// Reserved.
    pub const RESERVED: u16 = 0xFEFF;
}

/// Connection control (C-CON): mask of each field.
pub mod connection_control {
    /// Producer ready.
    pub const PRODUCER_READY: u16 = 0x0001;
    /// New data.
    pub const NEW_DATA: u16 = 0x0002;
    /// Data field delay.
    pub const DATA_FIELD_DELAY: u16 = 0x0004;
    /// Flow control.
    pub const FLOW_CONTROL: u16 = 0x0010;
    /// Real-time bit 1.
    pub const REAL_TIME_BIT_1: u16 = 0x0040;
    /// Real-time bit 2.
    pub const REAL_TIME_BIT_2: u16 = 0x0080;
    /// Counter.
    pub const COUNTER: u16 = 0xF000;
    /// Reserved.
    pub const RESERVED: u16 = 0x0F28;
}

/// Connection setup: mask of each field.
pub mod connection_setup {
    /// Active.
    pub const ACTIVE: u16 = 0x8000;
    /// Producer.
    pub const PRODUCER: u16 = 0x4000;
    /// Configuration type.
    pub const CONFIGURATION_TYPE: u16 = 0x0030;
    /// Timing.
    pub const TIMING: u16 = 0x0003;
    /// Reserved.
    pub const RESERVED: u16 = 0x3FCC;
}

/// Communication version: mask of each field.
pub mod communication_version {
    /// Address allocation.
    pub const ADDRESS_ALLOCATION: u32 = 0x00000001;
    /// Telegrams in CP1 and CP2.
    pub const TELEGRAMS_IN_CP1_AND_CP2: u32 = 0x00030000;
    /// t1, t6 and t7 transmitted.
    pub const T1_T6_AND_T7_TRANSMITTED: u32 = 0x00100000;
    /// Fast phase switch.
    pub const FAST_PHASE_SWITCH: u32 = 0x00200000;
    /// Last slave does not forward.
    pub const LAST_SLAVE_DOES_NOT_FORWARD: u32 = 0x00400000;
    /// Reserved.
    pub const RESERVED: u32 = 0xFF8CFFFE;
}

/// Service channel control (C-SVC): mask of each field.
pub mod svc_control {
    /// Master handshake (MHS).
    pub const MASTER_HANDSHAKE_MHS: u16 = 0x0001;
    /// Read or write.
    pub const READ_OR_WRITE: u16 = 0x0002;
    /// End of element.
    pub const END_OF_ELEMENT: u16 = 0x0004;
    /// Element.
    pub const ELEMENT: u16 = 0x0038;
    /// Reserved.
    pub const RESERVED: u16 = 0xFFC0;
}

/// Service channel status (S-SVC): mask of each field.
pub mod svc_status {
    /// Slave handshake (AHS).
    pub const SLAVE_HANDSHAKE_AHS: u16 = 0x0001;
    /// Busy.
    pub const BUSY: u16 = 0x0002;
    /// Error.
    pub const ERROR: u16 = 0x0004;
    /// Valid.
    pub const VALID: u16 = 0x0008;
    /// Reserved.
    pub const RESERVED: u16 = 0xFFF0;
}
