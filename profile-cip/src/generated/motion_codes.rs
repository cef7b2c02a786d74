//! Codes of the CIP Motion connection and of the Motion Device Axis Object.
//!
//! Generated from `mappings/tables/dictionary/cip-enumerations.toml` and `cip-faults.toml`: change the table, not this file, and run
//! `cargo run -p mappings --example generate`.

use profile_generic::open_code;

open_code! {
    /// Connection Type of the connection header, Table 6-2.9.
    pub struct ConnectionFormat(u8) {
        /// Fixed Controller-to-Device Connection.
        FIXED_COMMAND = 2 => "Fixed Controller-to-Device Connection",
        /// Fixed Device-to-Controller Connection.
        FIXED_ACTUAL = 3 => "Fixed Device-to-Controller Connection",
        /// Variable Controller-to-Device Connection.
        VARIABLE_COMMAND = 6 => "Variable Controller-to-Device Connection",
        /// Variable Device-to-Controller Connection: called Fixed in 6-2.7.2.1.
        VARIABLE_ACTUAL = 7 => "Variable Device-to-Controller Connection",
    }
}

open_code! {
    /// Control Mode, Table 6-2.15 and attribute 40. Only the low four bits are the mode; the others are
    /// reserved.
    pub struct ControlMode(u8) {
        /// No Control.
        NO_CONTROL = 0 => "No Control",
        /// Position Control.
        POSITION = 1 => "Position Control",
        /// Velocity Control.
        VELOCITY = 2 => "Velocity Control",
        /// Acceleration Control.
        ACCELERATION = 3 => "Acceleration Control",
        /// Torque Control.
        TORQUE = 4 => "Torque Control",
    }
}

open_code! {
    /// Feedback Mode proper: the low four bits of the Feedback Mode octet, attribute 42.
    pub struct FeedbackSource(u8) {
        /// No Feedback: tagged R/S; the standard does not define S.
        NONE = 0 => "No Feedback",
        /// Master Feedback.
        MASTER = 1 => "Master Feedback",
        /// Motor Feedback.
        MOTOR = 2 => "Motor Feedback",
        /// Load Feedback.
        LOAD = 3 => "Load Feedback",
        /// Dual Feedback.
        DUAL = 4 => "Dual Feedback",
    }
}

open_code! {
    /// Axis Control request and Axis Response acknowledge code, Tables 6-2.17 and 6-2.43.
    pub struct AxisControl(u8) {
        /// No Request.
        NONE = 0 => "No Request",
        /// Enable Request.
        ENABLE = 1 => "Enable",
        /// Disable Request.
        DISABLE = 2 => "Disable",
        /// Shutdown Request.
        SHUTDOWN = 3 => "Shutdown",
        /// Shutdown Reset Request.
        SHUTDOWN_RESET = 4 => "Shutdown Reset",
        /// Abort Request.
        ABORT = 5 => "Abort",
        /// Fault Reset Request.
        FAULT_RESET = 6 => "Fault Reset",
        /// Stop Process Request.
        STOP_PROCESS = 7 => "Stop Process",
        /// Change Actual Position Reference Request.
        CHANGE_ACTUAL_POSITION = 8 => "Change Actual Position Reference",
        /// Change Command Position Reference Request.
        CHANGE_COMMAND_POSITION = 9 => "Change Command Position Reference",
        /// Cancel Request.
        CANCEL = 127 => "Cancel",
    }
}

open_code! {
    /// Command Target Update, Table 6-2.24: for which update after the time stamp a command is meant.
    pub struct CommandTarget(u8) {
        /// Immediate.
        IMMEDIATE = 0 => "Immediate",
        /// Extrapolate (+1 UP).
        EXTRAPOLATE = 1 => "Extrapolate (+1 UP)",
        /// Interpolate (+2 UP).
        INTERPOLATE = 2 => "Interpolate (+2 UP)",
    }
}

open_code! {
    /// Axis State, attribute 650 (Table 5-2.59) as it travels in the cyclic actual block.
    pub struct AxisStateCode(u8) {
        /// Initializing.
        INITIALIZING = 0 => "Initializing",
        /// Pre-Charge.
        PRE_CHARGE = 1 => "Pre-Charge",
        /// Stopped.
        STOPPED = 2 => "Stopped",
        /// Starting.
        STARTING = 3 => "Starting",
        /// Running.
        RUNNING = 4 => "Running",
        /// Testing.
        TESTING = 5 => "Testing",
        /// Stopping.
        STOPPING = 6 => "Stopping",
        /// Aborting.
        ABORTING = 7 => "Aborting",
        /// Major Faulted.
        MAJOR_FAULTED = 8 => "Major Faulted",
        /// Start Inhibited.
        START_INHIBITED = 9 => "Start Inhibited",
        /// Shutdown.
        SHUTDOWN = 10 => "Shutdown",
    }
}

open_code! {
    /// Axis Fault Type, attribute 662. Zero is a record that faults were cleared.
    pub struct FaultType(u8) {
        /// Faults Cleared.
        CLEARED = 0 => "Faults Cleared",
        /// Initialization Fault.
        INITIALIZATION = 1 => "Initialization Fault",
        /// Initialization Fault - Mfg.
        INITIALIZATION_MFG = 2 => "Initialization Fault - Mfg",
        /// Axis Fault.
        AXIS = 3 => "Axis Fault",
        /// Axis Fault - Mfg.
        AXIS_MFG = 4 => "Axis Fault - Mfg",
        /// APR Fault.
        APR = 5 => "APR Fault",
        /// APR Fault - Mfg.
        APR_MFG = 6 => "APR Fault - Mfg",
        /// Axis Safety Fault.
        SAFETY = 7 => "Axis Safety Fault",
        /// Axis Safety Fault - Mfg.
        SAFETY_MFG = 8 => "Axis Safety Fault - Mfg",
    }
}

open_code! {
    /// Axis Fault Code of a record whose Fault Type is zero, attribute 661: what cleared the faults.
    pub struct ClearingEvent(u8) {
        /// No Faults.
        NONE = 0 => "No Faults",
        /// Device Reset: power cycle.
        DEVICE_RESET = 1 => "Device Reset",
        /// Fault Reset.
        FAULT_RESET = 2 => "Fault Reset",
        /// Shutdown Reset.
        SHUTDOWN_RESET = 3 => "Shutdown Reset",
        /// Connection Reset.
        CONNECTION_RESET = 4 => "Connection Reset",
    }
}

open_code! {
    /// Axis Alarm Type, attribute 665.
    pub struct AlarmType(u8) {
        /// No Alarms.
        NONE = 0 => "No Alarms",
        /// Start Inhibit.
        START_INHIBIT = 1 => "Start Inhibit",
        /// Start Inhibit - Mfg.
        START_INHIBIT_MFG = 2 => "Start Inhibit - Mfg",
        /// Axis Alarm.
        AXIS = 3 => "Axis Alarm",
        /// Axis Alarm - Mfg.
        AXIS_MFG = 4 => "Axis Alarm - Mfg",
    }
}

open_code! {
    /// Node Fault Code, class attribute 16, Table 5-2.6. Four bits on the wire.
    pub struct NodeFault(u8) {
        /// No Fault.
        NONE = 0 => "No Fault",
        /// Control Connection Update Fault: goes only when the connection is closed and opened anew.
        CONNECTION_UPDATE = 1 => "Control Connection Update Fault",
        /// Processor Watchdog Fault.
        PROCESSOR_WATCHDOG_FAULT = 2 => "Processor Watchdog Fault",
        /// Hardware Fault.
        HARDWARE = 3 => "Hardware Fault",
        /// Data Format Error.
        DATA_FORMAT = 4 => "Data Format Error",
        /// Clock Skew Fault.
        CLOCK_SKEW = 5 => "Clock Skew Fault",
        /// Control Connection Loss Fault.
        CONNECTION_LOSS = 6 => "Control Connection Loss Fault",
        /// Clock Sync Fault.
        CLOCK_SYNC = 7 => "Clock Sync Fault",
        /// Logic Watchdog.
        LOGIC_WATCHDOG = 8 => "Logic Watchdog",
        /// Duplicate Address.
        DUPLICATE_ADDRESS = 9 => "Duplicate Address",
    }
}

open_code! {
    /// Node Alarm Code, class attribute 17, Table 5-2.7. Four bits on the wire.
    pub struct NodeAlarm(u8) {
        /// No Alarm.
        NONE = 0 => "No Alarm",
        /// Control Connection Update Alarm: goes with the next fresh update.
        CONNECTION_UPDATE = 1 => "Control Connection Update Alarm",
        /// Processor Overload Alarm.
        PROCESSOR_OVERLOAD_ALARM = 2 => "Processor Overload Alarm",
        /// Clock Jitter Alarm.
        CLOCK_JITTER = 3 => "Clock Jitter Alarm",
        /// Clock Skew Alarm.
        CLOCK_SKEW = 4 => "Clock Skew Alarm",
        /// Clock Sync Alarm.
        CLOCK_SYNC = 5 => "Clock Sync Alarm",
        /// Node Address Alarm.
        NODE_ADDRESS_ALARM = 6 => "Node Address Alarm",
    }
}

open_code! {
    /// Event Type of an event notification, Table 6-2.47.
    pub struct EventType(u8) {
        /// Registration 1 Positive Edge.
        REGISTRATION_1_POSITIVE = 0 => "Registration 1 Positive Edge",
        /// Registration 1 Negative Edge.
        REGISTRATION_1_NEGATIVE = 1 => "Registration 1 Negative Edge",
        /// Registration 2 Positive Edge.
        REGISTRATION_2_POSITIVE_EDGE = 2 => "Registration 2 Positive Edge",
        /// Registration 2 Negative Edge.
        REGISTRATION_2_NEGATIVE = 3 => "Registration 2 Negative Edge",
        /// Marker Positive Edge.
        MARKER_POSITIVE = 4 => "Marker Positive Edge",
        /// Marker Negative Edge.
        MARKER_NEGATIVE = 5 => "Marker Negative Edge",
        /// Home Switch Positive Edge.
        HOME_POSITIVE = 6 => "Home Switch Positive Edge",
        /// Home Switch Negative Edge.
        HOME_NEGATIVE = 7 => "Home Switch Negative Edge",
        /// Home Switch-Marker ++.
        HOME_MARKER_PP = 8 => "Home Switch-Marker ++",
        /// Home Switch-Marker +-.
        HOME_MARKER_PN = 9 => "Home Switch-Marker +-",
        /// Home Switch-Marker -+.
        HOME_MARKER_NP = 10 => "Home Switch-Marker -+",
        /// Home Switch-Marker --: the signs are lost in Volume 9.
        HOME_MARKER_NN = 11 => "Home Switch-Marker --",
        /// Home Torque Threshold.
        HOME_TORQUE = 12 => "Home Torque Threshold",
        /// Watch 1 Position Forward.
        WATCH_1_FORWARD = 13 => "Watch 1 Position Forward",
        /// Watch 1 Position Reverse.
        WATCH_1_REVERSE = 14 => "Watch 1 Position Reverse",
        /// Watch 2 Position Forward.
        WATCH_2_FORWARD = 15 => "Watch 2 Position Forward",
        /// Watch 2 Position Reverse.
        WATCH_2_REVERSE = 16 => "Watch 2 Position Reverse",
    }
}

open_code! {
    /// Service code of a service block, Tables 5-2.82 and 5-2.85. The reply carries the same code, without
    /// a reply bit.
    pub struct MotionService(u8) {
        /// Group_Sync.
        GROUP_SYNC = 0x1C => "Group_Sync",
        /// Get_Axis_Attributes_List.
        GET_AXIS_ATTRIBUTES_LIST = 0x4B => "Get_Axis_Attributes_List",
        /// Set_Axis_Attributes_List.
        SET_AXIS_ATTRIBUTES_LIST = 0x4C => "Set_Axis_Attributes_List",
        /// Set_Cyclic_Write_List.
        SET_CYCLIC_WRITE_LIST = 0x4D => "Set_Cyclic_Write_List",
        /// Set_Cyclic_Read_List.
        SET_CYCLIC_READ_LIST = 0x4E => "Set_Cyclic_Read_List",
        /// Run_Motor_Test.
        RUN_MOTOR_TEST = 0x4F => "Run_Motor_Test",
        /// Get_Motor_Test_Data.
        GET_MOTOR_TEST_DATA = 0x50 => "Get_Motor_Test_Data",
        /// Run_Inertia_Test.
        RUN_INERTIA_TEST = 0x51 => "Run_Inertia_Test",
        /// Get_Inertia_Test_Data.
        GET_INERTIA_TEST_DATA = 0x52 => "Get_Inertia_Test_Data",
        /// Run_Hookup_Test.
        RUN_HOOKUP_TEST = 0x53 => "Run_Hookup_Test",
        /// Get_Hookup_Test_Data.
        GET_HOOKUP_TEST_DATA = 0x54 => "Get_Hookup_Test_Data",
    }
}

open_code! {
    /// Sync Status of a Group_Sync response, Table 5-2.84.
    pub struct SyncStatus(u8) {
        /// device synchronized.
        SYNCHRONIZED = 0 => "device synchronized",
        /// device not synchronized.
        NOT_SYNCHRONIZED = 1 => "device not synchronized",
        /// different grand master.
        DIFFERENT_GRANDMASTER = 2 => "different grand master",
        /// clock skew detected.
        CLOCK_SKEW = 3 => "clock skew detected",
    }
}

open_code! {
    /// Test Status of the Get_Motor, Get_Inertia and Get_Hookup_Test_Data responses; values from 5 on
    /// differ per test (Tables 5-2.89, .93, .96).
    pub struct TestStatus(u8) {
        /// test process successful.
        SUCCESSFUL = 0 => "test process successful",
        /// test in progress.
        IN_PROGRESS = 1 => "test in progress",
        /// test process aborted.
        ABORTED = 2 => "test process aborted",
        /// test process timed-out.
        TIMED_OUT = 3 => "test process timed-out",
        /// test process faulted.
        FAULTED = 4 => "test process faulted",
    }
}

open_code! {
    /// Axis Exception Action, attributes 672 and 673, Table 5-2.70.
    pub struct ExceptionAction(u8) {
        /// Ignore.
        IGNORE = 0 => "Ignore",
        /// Alarm.
        ALARM = 1 => "Alarm",
        /// Minor Fault.
        MINOR_FAULT = 2 => "Minor Fault",
        /// Major Fault.
        MAJOR_FAULT = 3 => "Major Fault",
        /// Unsupported: the only value of an exception the device does not support.
        UNSUPPORTED = 255 => "Unsupported",
    }
}
