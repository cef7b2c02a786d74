//! The attributes that the protocol engine itself works with.

use super::{Access, DataType, Scope};

/// Revision of the Motion Device Axis Object that the device speaks (clause 5-2.2).
pub const OBJECT_REVISION: u16 = 4;

/// Numbers of attributes, and the table of those that every device has.
macro_rules! attributes {
    (
        always { $($scope:ident $name:ident = $id:literal, $type:ident, $access:ident, $default:expr, $text:literal $([$more:literal])?;)* }
        else { $($(#[$doc:meta])* $other:ident = $other_id:literal;)* }
    ) => {
        /// Numbers of the attributes that the protocol engine itself works with.
        pub mod id {
            $(#[doc = concat!(stringify!($scope), ": ", $text $(, ", ", $more)?, ".")] pub const $name: u16 = $id;)*
            $($(#[$doc])* pub const $other: u16 = $other_id;)*
        }

        /// Attributes of the engine: scope, ID, type, access, default, name.
        pub(super) const ENGINE: &[(Scope, u16, DataType, Access, i64, &str)] =
            &[$((Scope::$scope, $id, DataType::$type, Access::$access, $default, $text)),*];
    };
}

attributes! {
    always {
        Class REVISION = 1, Uint, Get, OBJECT_REVISION as i64, "Revision" ["Table 5-2.3"];
        Class NODE_CONTROL = 14, Byte, Cyclic, 0, "Node Control";
        Class NODE_STATUS = 15, Byte, Get, 0, "Node Status";
        Class NODE_FAULT_CODE = 16, Usint, Get, 0, "Node Fault Code";
        Class NODE_ALARM_CODE = 17, Usint, Get, 0, "Node Alarm Code";
        Class CONTROLLER_UPDATE_PERIOD = 18, Udint, Cyclic, 0, "Controller Update Period" ["ns"];
        Class CONTROLLER_TIME_OFFSET = 19, Lint, Cyclic, 0, "Controller Time Offset" ["ns"];
        Class CONTROLLER_TIME_STAMP = 20, Lint, Cyclic, 0, "Controller Time Stamp" ["ns of system time"];
        Class UPDATE_DELAY_HIGH_LIMIT = 21, Usint, Set, 4, "Controller Update Delay High Limit" ["update periods"];
        Class UPDATE_DELAY_LOW_LIMIT = 22, Usint, Set, 2, "Controller Update Delay Low Limit" ["update periods"];
        Class TIME_DATA_SET = 31, Byte, Cyclic, 0, "Time Data Set";
        Class LOST_UPDATES = 32, Byte, Set, 0, "Lost Controller Updates";
        Class LATE_UPDATES = 33, Byte, Set, 0, "Late Controller Updates";
        Class POWER_STRUCTURE_CLASS_ID = 34, Udint, Get, 0, "Drive Power Structure Class ID";
        Class STEP_THRESHOLD = 35, Udint, Set, 1_000_000, "Step Threshold" ["ns"];
        Instance CONTROL_MODE = 40, Usint, Cyclic, 0, "Control Mode";
        Instance FEEDBACK_MODE = 42, Byte, Cyclic, 0, "Feedback Mode";
        Instance EVENT_CHECKING_CONTROL = 60, Dword, Cyclic, 0, "Event Checking Control";
        Instance EVENT_CHECKING_STATUS = 61, Dword, Get, 0, "Event Checking Status";
        Instance CONTROL_STATUS = 89, Byte, Cyclic, 0, "Control Status";
        Instance ACTUAL_DATA_SET = 90, Byte, Cyclic, 0, "Actual Data Set";
        Instance COMMAND_DATA_SET = 91, Byte, Cyclic, 0, "Command Data Set";
        Instance COMMAND_CONTROL = 92, Byte, Cyclic, 0, "Command Control";
        Instance COMMAND_TARGET_TIME = 93, Lint, Get, 0, "Command Target Time" ["ns of system time"];
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
        Instance AXIS_FAULT_CODE = 661, Usint, Get, 0, "Axis Fault Code" ["of the newest record"];
        Instance AXIS_FAULT_TYPE = 662, Usint, Get, 0, "Axis Fault Type" ["of the newest record"];
        Instance AXIS_FAULT_TIME_STAMP = 663, Lint, Get, 0, "Axis Fault Time Stamp" ["of the newest record, ns of system time"];
        Instance AXIS_ALARM_CODE = 664, Usint, Get, 0, "Axis Alarm Code" ["of the newest record"];
        Instance AXIS_ALARM_TYPE = 665, Usint, Get, 0, "Axis Alarm Type" ["of the newest record"];
        Instance AXIS_FAULT_SUB_CODE = 666, Usint, Get, 0, "Axis Fault Sub Code" ["of the newest record"];
        Instance AXIS_ALARM_SUB_CODE = 667, Usint, Get, 0, "Axis Alarm Sub Code" ["of the newest record"];
        Instance AXIS_FAULT_ACTION = 668, Usint, Get, 0, "Axis Fault Action" ["of the newest record"];
        Instance AXIS_ALARM_STATE = 669, Usint, Get, 0, "Axis Alarm State" ["of the newest record"];
        Instance AXIS_ALARM_TIME_STAMP = 670, Lint, Get, 0, "Axis Alarm Time Stamp" ["of the newest record, ns of system time"];
        Instance INITIALIZATION_FAULTS = 674, Dword, Get, 0, "Initialization Faults";
        Instance INITIALIZATION_FAULTS_MFG = 675, Dword, Get, 0, "Initialization Faults - Mfg";
        Instance START_INHIBITS = 676, Word, Get, 0, "Start Inhibits";
        Instance START_INHIBITS_MFG = 677, Word, Get, 0, "Start Inhibits - Mfg";
    }
    else {
        /// Registration 1 Positive Edge Position; the other three edges follow.
        REGISTRATION_POSITION = 62;
        /// Registration 1 Positive Edge Time; the other three edges follow.
        REGISTRATION_TIME = 66;
        /// Home Event Position.
        HOME_EVENT_POSITION = 70;
        /// Home Event Time.
        HOME_EVENT_TIME = 71;
        /// Watch 1 Event Time; Watch 2 follows.
        WATCH_EVENT_TIME = 72;
        /// Registration Data Set.
        REGISTRATION_DATA_SET = 95;
        /// Home Data Set.
        HOME_DATA_SET = 96;
        /// Watch Data Set.
        WATCH_DATA_SET = 97;
        /// Controller Position Command - Integer.
        POSITION_COMMAND_INTEGER = 360;
        /// Controller Position Command - Float.
        POSITION_COMMAND_FLOAT = 361;
        /// Controller Velocity Command.
        VELOCITY_COMMAND = 362;
        /// Controller Acceleration Command.
        ACCELERATION_COMMAND = 363;
        /// Controller Torque Command.
        TORQUE_COMMAND = 364;
        /// Axis Exception Action, 64 elements.
        AXIS_EXCEPTION_ACTION = 672;
        /// Axis Exception Action - Mfg, 64 elements.
        AXIS_EXCEPTION_ACTION_MFG = 673;
        /// APR Faults. This and those below are there only where the device is built with them.
        APR_FAULTS = 756;
        /// APR Faults - Mfg.
        APR_FAULTS_MFG = 757;
        /// Axis Safety State.
        AXIS_SAFETY_STATE = 760;
        /// Axis Safety Status.
        AXIS_SAFETY_STATUS = 761;
        /// Axis Safety Status - Mfg.
        AXIS_SAFETY_STATUS_MFG = 762;
        /// Axis Safety Faults.
        AXIS_SAFETY_FAULTS = 763;
        /// Axis Safety Faults - Mfg.
        AXIS_SAFETY_FAULTS_MFG = 764;
    }
}
