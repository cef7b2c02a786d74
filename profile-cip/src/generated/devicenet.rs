//! Codes and bits of DeviceNet.
//!
//! Generated from `mappings/tables/dictionary/cip-enumerations.toml`: change the table, not this file, and run
//! `cargo run -p mappings --example generate`.

use profile_generic::open_code;

open_code! {
    /// Message body format: the widths of class and instance in a request.
    pub struct BodyFormat(u8) {
        /// DeviceNet (8/8): class 8 bits, instance 8 bits; the predefined connection set has it unless the slave says otherwise.
        CLASS_8_INSTANCE_8 = 0 => "DeviceNet (8/8)",
        /// DeviceNet (8/16): class 8 bits, instance 16 bits.
        CLASS_8_INSTANCE_16 = 1 => "DeviceNet (8/16)",
        /// DeviceNet (16/16): class 16 bits, instance 16 bits.
        CLASS_16_INSTANCE_16 = 2 => "DeviceNet (16/16)",
        /// DeviceNet (16/8): class 16 bits, instance 8 bits.
        CLASS_16_INSTANCE_8 = 3 => "DeviceNet (16/8)",
        /// CIP Path: a packed path in the place of class and instance.
        CIP_PATH = 4 => "CIP Path",
    }
}

open_code! {
    /// Status in the acknowledge of a fragment.
    pub struct AcknowledgeStatus(u8) {
        /// Success: taken.
        SUCCESS = 0 => "success",
        /// Too much data: the message is longer than the receiver can take; it is dropped.
        TOO_MUCH_DATA = 1 => "too much data",
    }
}

open_code! {
    /// State, attribute 1 of the Connection object.
    pub struct ConnectionState(u8) {
        /// Non-existent.
        NON_EXISTENT = 0 => "non-existent",
        /// Configuring: allocated; the expected packet rate is missing.
        CONFIGURING = 1 => "configuring",
        /// Waiting for connection ID: connections of the predefined set have their identifiers and are never in this state.
        WAITING_FOR_CONNECTION_ID = 2 => "waiting for connection ID",
        /// Established.
        ESTABLISHED = 3 => "established",
        /// Timed out: the watchdog has run out.
        TIMED_OUT = 4 => "timed out",
        /// Deferred delete: the watchdog of an explicit connection has run out, and it stays for the sake of an I/O connection.
        DEFERRED_DELETE = 5 => "deferred delete",
    }
}

open_code! {
    /// Watchdog time-out action, attribute 12 of the Connection object.
    pub struct WatchdogAction(u8) {
        /// Transition to timed out.
        TIME_OUT = 0 => "transition to timed out",
        /// Auto delete.
        AUTO_DELETE = 1 => "auto delete",
        /// Auto reset.
        AUTO_RESET = 2 => "auto reset",
        /// Deferred delete: when the last I/O connection has gone.
        DEFERRED_DELETE = 3 => "deferred delete",
    }
}

open_code! {
    /// Instance of the Assembly object (class 4).
    pub struct Assembly(u8) {
        /// Basic speed control.
        BASIC_SPEED_CONTROL = 20 => "basic speed control",
        /// Extended speed control.
        EXTENDED_SPEED_CONTROL = 21 => "extended speed control",
        /// Basic speed and torque control.
        BASIC_TORQUE_CONTROL = 22 => "basic speed and torque control",
        /// Extended speed and torque control.
        EXTENDED_TORQUE_CONTROL = 23 => "extended speed and torque control",
        /// Basic speed control status.
        BASIC_SPEED_STATUS = 70 => "basic speed control status",
        /// Extended speed control status.
        EXTENDED_SPEED_STATUS = 71 => "extended speed control status",
        /// Basic speed and torque control status.
        BASIC_TORQUE_STATUS = 72 => "basic speed and torque control status",
        /// Extended speed and torque control status.
        EXTENDED_TORQUE_STATUS = 73 => "extended speed and torque control status",
    }
}

open_code! {
    /// State of the Control Supervisor object, attribute 6.
    pub struct SupervisorState(u8) {
        /// Vendor specific.
        VENDOR = 0 => "vendor specific",
        /// Startup.
        STARTUP = 1 => "startup",
        /// Not ready: no power, for example.
        NOT_READY = 2 => "not ready",
        /// Ready.
        READY = 3 => "ready",
        /// Enabled.
        ENABLED = 4 => "enabled",
        /// Stopping.
        STOPPING = 5 => "stopping",
        /// Fault stop: slows down to a stop for a fault.
        FAULT_STOP = 6 => "fault stop",
        /// Faulted: stopped by a fault.
        FAULTED = 7 => "faulted",
    }
}

/// DeviceNet Speed Control: number and name of each bit.
pub mod speed_control {
    /// Bit 0.
    pub const RUN_FORWARD: (u32, &str) = (0, "Run Forward");
    /// Bit 1.
    pub const RUN_REVERSE: (u32, &str) = (1, "Run Reverse");
    /// Bit 2.
    pub const FAULT_RESET: (u32, &str) = (2, "Fault Reset");
    /// Bit 5.
    pub const NET_CONTROL: (u32, &str) = (5, "Net Control");
    /// Bit 6.
    pub const NET_REFERENCE: (u32, &str) = (6, "Net Reference");
}

/// DeviceNet Speed Status: number and name of each bit.
pub mod speed_status {
    /// Bit 0.
    pub const FAULTED: (u32, &str) = (0, "Faulted");
    /// Bit 1.
    pub const WARNING: (u32, &str) = (1, "Warning");
    /// Bit 2.
    pub const RUNNING_FORWARD: (u32, &str) = (2, "Running Forward");
    /// Bit 3.
    pub const RUNNING_REVERSE: (u32, &str) = (3, "Running Reverse");
    /// Bit 4.
    pub const READY: (u32, &str) = (4, "Ready");
    /// Bit 5.
    pub const CONTROL_FROM_NET: (u32, &str) = (5, "Control From Net");
    /// Bit 6.
    pub const REFERENCE_FROM_NET: (u32, &str) = (6, "Reference From Net");
    /// Bit 7.
    pub const AT_REFERENCE: (u32, &str) = (7, "At Reference");
}
