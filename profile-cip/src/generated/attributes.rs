//! Attributes of the Motion Device Axis Object that the protocol engine itself works with.
//!
//! Generated from `mappings/tables/dictionary/cip-attributes.toml`: change the table, not this file, and run
//! `cargo run -p mappings --example generate`.

use crate::device::attribute::attributes;

attributes! {
    always {
        Class REVISION = 1, Uint, Get, 4, "Revision";
        Class NODE_CONTROL = 14, Byte, Cyclic, 0, "Node Control";
        Class NODE_STATUS = 15, Byte, Get, 0, "Node Status";
        Class NODE_FAULT_CODE = 16, Usint, Get, 0, "Node Fault Code";
        Class NODE_ALARM_CODE = 17, Usint, Get, 0, "Node Alarm Code";
        Class CONTROLLER_UPDATE_PERIOD = 18, Udint, Cyclic, 0, "Controller Update Period" ["Nanoseconds"];
        Class CONTROLLER_TIME_OFFSET = 19, Lint, Cyclic, 0, "Controller Time Offset" ["Nanoseconds"];
        Class CONTROLLER_TIME_STAMP = 20, Lint, Cyclic, 0, "Controller Time Stamp" ["Nanoseconds"];
        Class UPDATE_DELAY_HIGH_LIMIT = 21, Usint, Set, 0, "Controller Update Delay High Limit" ["# of Controller Update Periods"];
        Class UPDATE_DELAY_LOW_LIMIT = 22, Usint, Set, 0, "Controller Update Delay Low Limit" ["# of Controller Update Periods"];
        Class TIME_DATA_SET = 31, Byte, Cyclic, 0, "Time Data Set";
        Class LOST_UPDATES = 32, Byte, Set, 0, "Lost Controller Updates" ["# of Lost Packets"];
        Class LATE_UPDATES = 33, Byte, Set, 0, "Late Controller Updates" ["# of Late Packets"];
        Class POWER_STRUCTURE_CLASS_ID = 34, Udint, Get, 0, "Drive Power Structure Class ID";
        Class STEP_THRESHOLD = 35, Udint, Set, 1000000, "Step Threshold" ["Nanoseconds"];
        Class CONNECTION_CONFIGURATION_BITS = 36, Byte, Get, 0, "Connection Configuration Bits";
        Instance CONTROL_MODE = 40, Usint, Cyclic, 0, "Control Mode";
        Instance FEEDBACK_MODE = 42, Byte, Cyclic, 0, "Feedback Mode";
        Instance EVENT_CHECKING_CONTROL = 60, Dword, Cyclic, 0, "Event Checking Control";
        Instance EVENT_CHECKING_STATUS = 61, Dword, Get, 0, "Event Checking Status";
        Instance CONTROL_STATUS = 89, Byte, Cyclic, 0, "Control Status";
        Instance ACTUAL_DATA_SET = 90, Byte, Cyclic, 0, "Actual Data Set";
        Instance COMMAND_DATA_SET = 91, Byte, Cyclic, 0, "Command Data Set";
        Instance COMMAND_CONTROL = 92, Byte, Cyclic, 0, "Command Control";
        Instance COMMAND_TARGET_TIME = 93, Lint, Get, 0, "Command Target Time" ["Nanoseconds"];
        Instance STATUS_DATA_SET = 94, Byte, Cyclic, 0, "Status Data Set";
        Instance AXIS_STATE = 650, Usint, Get, 0, "Axis State";
        Instance AXIS_STATUS = 651, Dword, Get, 0, "Axis Status";
        Instance AXIS_STATUS_MFG = 652, Dword, Get, 0, "Axis Status - Mfg";
        Instance AXIS_IO_STATUS = 653, Dword, Get, 0, "Axis I/O Status";
        Instance AXIS_IO_STATUS_MFG = 654, Dword, Get, 0, "Axis I/O Status - Mfg";
        Instance AXIS_EXCEPTIONS = 655, Lword, Get, 0, "Axis Exceptions";
        Instance AXIS_EXCEPTIONS_MFG = 656, Lword, Get, 0, "Axis Exceptions - Mfg";
        Instance AXIS_FAULTS = 657, Lword, Get, 0, "Axis Faults";
        Instance AXIS_FAULTS_MFG = 658, Lword, Get, 0, "Axis Faults - Mfg";
        Instance AXIS_ALARMS = 659, Lword, Get, 0, "Axis Alarms";
        Instance AXIS_ALARMS_MFG = 660, Lword, Get, 0, "Axis Alarms - Mfg";
        Instance AXIS_FAULT_CODE = 661, Usint, Get, 0, "Axis Fault Code";
        Instance AXIS_FAULT_TYPE = 662, Usint, Get, 0, "Axis Fault Type";
        Instance AXIS_FAULT_TIME_STAMP = 663, Lint, Get, 0, "Axis Fault Time Stamp" ["Nanoseconds"];
        Instance AXIS_ALARM_CODE = 664, Usint, Get, 0, "Axis Alarm Code";
        Instance AXIS_ALARM_TYPE = 665, Usint, Get, 0, "Axis Alarm Type";
        Instance AXIS_FAULT_SUB_CODE = 666, Usint, Get, 0, "Axis Fault Sub Code";
        Instance AXIS_ALARM_SUB_CODE = 667, Usint, Get, 0, "Axis Alarm Sub Code";
        Instance AXIS_FAULT_ACTION = 668, Usint, Get, 0, "Axis Fault Action";
        Instance AXIS_ALARM_STATE = 669, Usint, Get, 0, "Axis Alarm State";
        Instance AXIS_ALARM_TIME_STAMP = 670, Lint, Get, 0, "Axis Alarm Time Stamp" ["Nanoseconds"];
        Instance INITIALIZATION_FAULTS = 674, Dword, Get, 0, "Initialization Faults";
        Instance INITIALIZATION_FAULTS_MFG = 675, Dword, Get, 0, "Initialization Faults - Mfg";
        Instance START_INHIBITS = 676, Word, Get, 0, "Start Inhibits";
        Instance START_INHIBITS_MFG = 677, Word, Get, 0, "Start Inhibits - Mfg";
    }
    else {
        Class MAX_INSTANCE = 2, "Max Instance";
        Class NUMBER_OF_INSTANCES = 3, "Number of Instances";
        Class OPTIONAL_ATTRIBUTE_LIST = 4, "Optional Attribute List";
        Class OPTIONAL_SERVICE_LIST = 5, "Optional Service List";
        Class MAX_CLASS_ATTRIBUTE = 6, "Maximum ID Number Class Attributes";
        Class MAX_INSTANCE_ATTRIBUTE = 7, "Maximum ID Number Instance Attributes";
        Class SYNC_VARIANCE = 28, "Sync Variance" ["Nanoseconds"];
        Class SYNC_THRESHOLD = 29, "Sync Threshold" ["Nanoseconds"];
        Class SYNC_UPDATE_DELAY = 30, "Sync Update Delay" ["Seconds"];
        Instance REGISTRATION_POSITION = 62, "Registration 1 Positive Edge Position" ["Position Control Units"];
        Instance REGISTRATION_TIME = 66, "Registration 1 Positive Edge Time" ["Nanoseconds"];
        Instance HOME_EVENT_POSITION = 70, "Home Event Position" ["Position Control Units"];
        Instance HOME_EVENT_TIME = 71, "Home Event Time" ["Nanoseconds"];
        Instance WATCH_EVENT_TIME = 72, "Watch 1 Event Time" ["Nanoseconds"];
        Instance REGISTRATION_DATA_SET = 95, "Registration Data Set";
        Instance HOME_DATA_SET = 96, "Home Data Set";
        Instance WATCH_DATA_SET = 97, "Watch Data Set";
        Instance POSITION_COMMAND_INTEGER = 360, "Controller Position Command - Integer" ["Position Control Units"];
        Instance POSITION_COMMAND_FLOAT = 361, "Controller Position Command - Float" ["Position Control Units"];
        Instance VELOCITY_COMMAND = 362, "Controller Velocity Command" ["Velocity Control Units / Sec"];
        Instance ACCELERATION_COMMAND = 363, "Controller Acceleration Command" ["Accel Control Units / Sec²"];
        Instance TORQUE_COMMAND = 364, "Controller Torque Command" ["% Motor Rated"];
        Instance AXIS_EXCEPTION_ACTION = 672, "Axis Exception Action";
        Instance AXIS_EXCEPTION_ACTION_MFG = 673, "Axis Exception Action - Mfg";
        Instance APR_FAULTS = 756, "APR Faults";
        Instance APR_FAULTS_MFG = 757, "APR Faults - Mfg";
        Instance AXIS_SAFETY_STATE = 760, "Axis Safety State";
        Instance AXIS_SAFETY_STATUS = 761, "Axis Safety Status";
        Instance AXIS_SAFETY_STATUS_MFG = 762, "Axis Safety Status - Mfg";
        Instance AXIS_SAFETY_FAULTS = 763, "Axis Safety Faults";
        Instance AXIS_SAFETY_FAULTS_MFG = 764, "Axis Safety Faults - Mfg";
    }
}
