//! What is generated: which sets of the dictionaries the profile crates have as Rust constants, and under which names.

use Item::{Attributes as OfAttributes, Bits, Codes as OfCodes, Elements, Masks, Numbers};
use Letters::{AsTheyAre, BehindTheirLetter, Lower, LowerWithoutAbbreviation, WithoutRequest};

/// A file of constants.
pub struct File {
    /// Where it lies, from the root of the repository.
    pub path: &'static str,
    /// What it has.
    pub about: &'static str,
    /// The tables that it comes from.
    pub tables: &'static str,
    /// What is in it.
    pub items: &'static [Item],
}

/// A part of a file. `constants` has the constants that are not just the words of the name: name in the table, constant.
pub enum Item {
    /// A type for codes.
    Codes(Codes),
    /// Number and name of each bit.
    Bits { module: &'static str, set: Set, constants: &'static [(&'static str, &'static str)] },
    /// A mask for each field of a word.
    Masks {
        module: &'static str,
        repr: &'static str,
        set: Set,
        constants: &'static [(&'static str, &'static str)],
    },
    /// Numbers of rows: `of` has those that the code uses.
    Numbers { rows: Rows, of: &'static str, constants: &'static [(&'static str, &'static str)] },
    /// Numbers of the elements of a structure of SERCOS.
    Elements {
        module: &'static str,
        block: u16,
        of: &'static [u8],
        constants: &'static [(&'static str, &'static str)],
    },
    /// Attributes of the Motion Device Axis Object.
    Attributes(Attributes),
}

/// Attributes of the Motion Device Axis Object that the code uses, by number.
pub struct Attributes {
    /// Of instance 0: those that every device has.
    pub class: &'static str,
    /// Of an axis: those that every device has.
    pub axis: &'static str,
    /// Of an axis: those that a device has by its tables.
    pub others: &'static str,
    /// The same of the class.
    pub other_class: &'static str,
    /// Constants that are not just the words of the name.
    pub constants: &'static [(&'static str, &'static str)],
}

/// Rows that have a number.
pub enum Rows {
    /// Parameters of SERCOS, without `S-0-`; `x` stands for any structure instance.
    Idns,
    /// Objects of CANopen and CiA 402, in hexadecimal.
    Objects,
}

/// A type for codes.
pub struct Codes {
    /// Its name.
    pub name: &'static str,
    /// How it is held.
    pub repr: &'static str,
    /// Digits of a code in hexadecimal; 0 for decimal.
    pub digits: usize,
    /// What it is.
    pub doc: &'static [&'static str],
    /// Where the codes stand.
    pub set: Set,
    /// Codes that are left out.
    pub without: &'static [i64],
    /// How the names are printed.
    pub letters: Letters,
    /// Constants that are not just the words of the name.
    pub constants: &'static [(&'static str, &'static str)],
}

/// A set of a dictionary.
#[derive(Clone, Copy)]
pub enum Set {
    /// Codes or bits of CIP Motion.
    Cip(&'static str),
    /// Services of CIP Motion.
    CipServices,
    /// Codes of SERCOS.
    Sercos(&'static str),
    /// A word of SERCOS.
    SercosWord(&'static str),
    /// Codes or bits of CANopen and CiA 402.
    Cia402(&'static str),
}

impl Set {
    /// Its name.
    pub fn name(&self) -> &'static str {
        match self {
            Self::CipServices => "Services",
            Self::Cip(name) | Self::Sercos(name) | Self::SercosWord(name) | Self::Cia402(name) => name,
        }
    }
}

/// How names are printed.
#[derive(Clone, Copy)]
pub enum Letters {
    /// As in the table.
    AsTheyAre,
    /// Without the capital of the first word.
    Lower,
    /// The same, without the abbreviation in parentheses.
    LowerWithoutAbbreviation,
    /// Without `Request`: the acknowledge has the same codes.
    WithoutRequest,
    /// The code as a letter, then the name.
    BehindTheirLetter,
}

/// The signals of the process image.
pub const SIGNALS: &str = "profile-generic/src/generated/signals.rs";

/// The catalogue of generic parameters.
pub const PARAMETERS: &str = "profile-generic/src/generated/parameters.rs";

const CODES: Codes = Codes {
    name: "",
    repr: "u8",
    digits: 0,
    doc: &[],
    set: Set::Cip(""),
    without: &[],
    letters: AsTheyAre,
    constants: &[],
};

/// Every file but those of the generic model.
pub const FILES: &[File] = &[
    File {
        path: "profile-cip/src/generated/motion_codes.rs",
        about: "Codes of the CIP Motion connection and of the Motion Device Axis Object.",
        tables: "`mappings/tables/dictionary/cip-enumerations.toml` and `cip-faults.toml`",
        items: &[
            OfCodes(Codes {
                name: "ConnectionFormat",
                doc: &["Connection Type of the connection header, Table 6-2.9."],
                set: Set::Cip("Connection Type"),
                without: &[0, 1, 4, 5],
                constants: &[
                    ("Fixed Controller-to-Device Connection", "FIXED_COMMAND"),
                    ("Fixed Device-to-Controller Connection", "FIXED_ACTUAL"),
                    ("Variable Controller-to-Device Connection", "VARIABLE_COMMAND"),
                    ("Variable Device-to-Controller Connection", "VARIABLE_ACTUAL"),
                ],
                ..CODES
            }),
            OfCodes(Codes {
                name: "ControlMode",
                doc: &[
                    "Control Mode, Table 6-2.15 and attribute 40. Only the low four bits are the mode; the others are",
                    "reserved.",
                ],
                set: Set::Cip("Control Mode"),
                constants: &[
                    ("Position Control", "POSITION"),
                    ("Velocity Control", "VELOCITY"),
                    ("Acceleration Control", "ACCELERATION"),
                    ("Torque Control", "TORQUE"),
                ],
                ..CODES
            }),
            OfCodes(Codes {
                name: "FeedbackSource",
                doc: &["Feedback Mode proper: the low four bits of the Feedback Mode octet, attribute 42."],
                set: Set::Cip("Feedback Mode"),
                constants: &[
                    ("No Feedback", "NONE"),
                    ("Master Feedback", "MASTER"),
                    ("Motor Feedback", "MOTOR"),
                    ("Load Feedback", "LOAD"),
                    ("Dual Feedback", "DUAL"),
                ],
                ..CODES
            }),
            OfCodes(Codes {
                name: "AxisControl",
                doc: &["Axis Control request and Axis Response acknowledge code, Tables 6-2.17 and 6-2.43."],
                set: Set::Cip("Axis Control"),
                letters: WithoutRequest,
                constants: &[
                    ("No Request", "NONE"),
                    ("Enable Request", "ENABLE"),
                    ("Disable Request", "DISABLE"),
                    ("Shutdown Request", "SHUTDOWN"),
                    ("Shutdown Reset Request", "SHUTDOWN_RESET"),
                    ("Abort Request", "ABORT"),
                    ("Fault Reset Request", "FAULT_RESET"),
                    ("Stop Process Request", "STOP_PROCESS"),
                    ("Change Actual Position Reference Request", "CHANGE_ACTUAL_POSITION"),
                    ("Change Command Position Reference Request", "CHANGE_COMMAND_POSITION"),
                    ("Cancel Request", "CANCEL"),
                ],
                ..CODES
            }),
            OfCodes(Codes {
                name: "CommandTarget",
                doc: &[
                    "Command Target Update, Table 6-2.24: for which update after the time stamp a command is meant.",
                ],
                set: Set::Cip("Command Target Update"),
                constants: &[("Extrapolate (+1 UP)", "EXTRAPOLATE"), ("Interpolate (+2 UP)", "INTERPOLATE")],
                ..CODES
            }),
            OfCodes(Codes {
                name: "AxisStateCode",
                doc: &["Axis State, attribute 650 (Table 5-2.59) as it travels in the cyclic actual block."],
                set: Set::Cip("Axis State"),
                ..CODES
            }),
            OfCodes(Codes {
                name: "FaultType",
                doc: &["Axis Fault Type, attribute 662. Zero is a record that faults were cleared."],
                set: Set::Cip("Axis Fault Type"),
                constants: &[
                    ("Faults Cleared", "CLEARED"),
                    ("Initialization Fault", "INITIALIZATION"),
                    ("Initialization Fault - Mfg", "INITIALIZATION_MFG"),
                    ("Axis Fault", "AXIS"),
                    ("Axis Fault - Mfg", "AXIS_MFG"),
                    ("APR Fault", "APR"),
                    ("APR Fault - Mfg", "APR_MFG"),
                    ("Axis Safety Fault", "SAFETY"),
                    ("Axis Safety Fault - Mfg", "SAFETY_MFG"),
                ],
                ..CODES
            }),
            OfCodes(Codes {
                name: "ClearingEvent",
                doc: &[
                    "Axis Fault Code of a record whose Fault Type is zero, attribute 661: what cleared the faults.",
                ],
                set: Set::Cip("Fault Clearing Event"),
                constants: &[("No Faults", "NONE")],
                ..CODES
            }),
            OfCodes(Codes {
                name: "AlarmType",
                doc: &["Axis Alarm Type, attribute 665."],
                set: Set::Cip("Axis Alarm Type"),
                constants: &[("No Alarms", "NONE"), ("Axis Alarm", "AXIS"), ("Axis Alarm - Mfg", "AXIS_MFG")],
                ..CODES
            }),
            OfCodes(Codes {
                name: "NodeFault",
                doc: &["Node Fault Code, class attribute 16, Table 5-2.6. Four bits on the wire."],
                set: Set::Cip("Node Fault Code"),
                constants: &[
                    ("No Fault", "NONE"),
                    ("Control Connection Update Fault", "CONNECTION_UPDATE"),
                    ("Hardware Fault", "HARDWARE"),
                    ("Data Format Error", "DATA_FORMAT"),
                    ("Clock Skew Fault", "CLOCK_SKEW"),
                    ("Control Connection Loss Fault", "CONNECTION_LOSS"),
                    ("Clock Sync Fault", "CLOCK_SYNC"),
                ],
                ..CODES
            }),
            OfCodes(Codes {
                name: "NodeAlarm",
                doc: &["Node Alarm Code, class attribute 17, Table 5-2.7. Four bits on the wire."],
                set: Set::Cip("Node Alarm Code"),
                constants: &[
                    ("No Alarm", "NONE"),
                    ("Control Connection Update Alarm", "CONNECTION_UPDATE"),
                    ("Clock Jitter Alarm", "CLOCK_JITTER"),
                    ("Clock Skew Alarm", "CLOCK_SKEW"),
                    ("Clock Sync Alarm", "CLOCK_SYNC"),
                ],
                ..CODES
            }),
            OfCodes(Codes {
                name: "EventType",
                doc: &["Event Type of an event notification, Table 6-2.47."],
                set: Set::Cip("Event Type"),
                constants: &[
                    ("Registration 1 Positive Edge", "REGISTRATION_1_POSITIVE"),
                    ("Registration 1 Negative Edge", "REGISTRATION_1_NEGATIVE"),
                    ("Registration 2 Negative Edge", "REGISTRATION_2_NEGATIVE"),
                    ("Marker Positive Edge", "MARKER_POSITIVE"),
                    ("Marker Negative Edge", "MARKER_NEGATIVE"),
                    ("Home Switch Positive Edge", "HOME_POSITIVE"),
                    ("Home Switch Negative Edge", "HOME_NEGATIVE"),
                    ("Home Switch-Marker ++", "HOME_MARKER_PP"),
                    ("Home Switch-Marker +-", "HOME_MARKER_PN"),
                    ("Home Switch-Marker -+", "HOME_MARKER_NP"),
                    ("Home Switch-Marker --", "HOME_MARKER_NN"),
                    ("Home Torque Threshold", "HOME_TORQUE"),
                    ("Watch 1 Position Forward", "WATCH_1_FORWARD"),
                    ("Watch 1 Position Reverse", "WATCH_1_REVERSE"),
                    ("Watch 2 Position Forward", "WATCH_2_FORWARD"),
                    ("Watch 2 Position Reverse", "WATCH_2_REVERSE"),
                ],
                ..CODES
            }),
            OfCodes(Codes {
                name: "MotionService",
                digits: 2,
                doc: &[
                    "Service code of a service block, Tables 5-2.82 and 5-2.85. The reply carries the same code, without",
                    "a reply bit.",
                ],
                set: Set::CipServices,
                // Services of Volume 1, which the wire code of the explicit messages has.
                without: &[0x03, 0x04, 0x0E, 0x10],
                ..CODES
            }),
            OfCodes(Codes {
                name: "SyncStatus",
                doc: &["Sync Status of a Group_Sync response, Table 5-2.84."],
                set: Set::Cip("Sync Status"),
                constants: &[
                    ("device synchronized", "SYNCHRONIZED"),
                    ("device not synchronized", "NOT_SYNCHRONIZED"),
                    ("different grand master", "DIFFERENT_GRANDMASTER"),
                    ("clock skew detected", "CLOCK_SKEW"),
                ],
                ..CODES
            }),
            OfCodes(Codes {
                name: "TestStatus",
                doc: &[
                    "Test Status of the Get_Motor, Get_Inertia and Get_Hookup_Test_Data responses; values from 5 on",
                    "differ per test (Tables 5-2.89, .93, .96).",
                ],
                set: Set::Cip("Motor Test Status"),
                constants: &[
                    ("test process successful", "SUCCESSFUL"),
                    ("test in progress", "IN_PROGRESS"),
                    ("test process aborted", "ABORTED"),
                    ("test process timed-out", "TIMED_OUT"),
                    ("test process faulted", "FAULTED"),
                ],
                ..CODES
            }),
            OfCodes(Codes {
                name: "ExceptionAction",
                doc: &["Axis Exception Action, attributes 672 and 673, Table 5-2.70."],
                set: Set::Cip("Axis Exception Action"),
                ..CODES
            }),
        ],
    },
    File {
        path: "profile-cip/src/generated/motion_bits.rs",
        about: "Bits of the CIP Motion connection.",
        tables: "`mappings/tables/dictionary/cip-enumerations.toml` and `cip-attributes.toml`",
        items: &[
            Bits {
                module: "node_control",
                set: Set::Cip("Node Control"),
                constants: &[("Controller Data Valid", "DATA_VALID"), ("Node Fault Reset", "FAULT_RESET")],
            },
            Bits {
                module: "node_status",
                set: Set::Cip("Node Status"),
                constants: &[("Device Data Valid", "DATA_VALID"), ("Device Node Fault", "FAULT")],
            },
            Bits { module: "time_data_set", set: Set::Cip("Time Data Set"), constants: &[] },
            Bits { module: "control_status", set: Set::Cip("Control Status"), constants: &[] },
            Bits {
                module: "command_data_set",
                set: Set::Cip("Command Data Set"),
                constants: &[
                    ("Command Position", "POSITION"),
                    ("Command Velocity", "VELOCITY"),
                    ("Command Acceleration", "ACCELERATION"),
                    ("Command Torque", "TORQUE"),
                    ("Unwind Cycle Count", "UNWIND_COUNT"),
                ],
            },
            Bits {
                module: "actual_data_set",
                set: Set::Cip("Actual Data Set"),
                constants: &[
                    ("Actual Position", "POSITION"),
                    ("Actual Velocity", "VELOCITY"),
                    ("Actual Acceleration", "ACCELERATION"),
                    ("Unwind Cycle Count", "UNWIND_COUNT"),
                ],
            },
            Bits {
                module: "status_data_set",
                set: Set::Cip("Status Data Set"),
                constants: &[
                    ("Axis Fault", "FAULT"),
                    ("Axis Alarm", "ALARM"),
                    ("Axis I/O Status", "IO_STATUS"),
                    ("Axis Safety", "SAFETY_STATUS"),
                ],
            },
            Bits { module: "axis_status", set: Set::Cip("Axis Status"), constants: &[] },
            Bits {
                module: "axis_io_status",
                set: Set::Cip("Axis I/O Status"),
                constants: &[
                    ("Positive Overtravel OK Input", "POSITIVE_OVERTRAVEL_OK"),
                    ("Negative Overtravel OK Input", "NEGATIVE_OVERTRAVEL_OK"),
                    ("Feedback 1 Thermostat OK Input", "FEEDBACK_1_THERMOSTAT_OK"),
                    ("Resistive Brake Release Output", "RESISTIVE_BRAKE_RELEASE"),
                    ("Mechanical Brake Release Output", "MECHANICAL_BRAKE_RELEASE"),
                    ("Motor Thermostat OK Input", "MOTOR_THERMOSTAT_OK"),
                ],
            },
            Bits {
                module: "event_checking",
                set: Set::Cip("Event Checking"),
                constants: &[
                    ("Reg 1 Pos Edge", "REG_1_POSITIVE"),
                    ("Reg 1 Neg Edge", "REG_1_NEGATIVE"),
                    ("Reg 2 Pos Edge", "REG_2_POSITIVE"),
                    ("Reg 2 Neg Edge", "REG_2_NEGATIVE"),
                    ("Reg 1 Pos Edge Window", "REG_1_POSITIVE_WINDOW"),
                    ("Reg 1 Neg Edge Window", "REG_1_NEGATIVE_WINDOW"),
                    ("Reg 2 Pos Edge Window", "REG_2_POSITIVE_WINDOW"),
                    ("Reg 2 Neg Edge Window", "REG_2_NEGATIVE_WINDOW"),
                    ("Reg 1 Pos Auto-rearm", "REG_1_POSITIVE_REARM"),
                    ("Reg 1 Neg Auto-rearm", "REG_1_NEGATIVE_REARM"),
                    ("Reg 2 Pos Auto-rearm", "REG_2_POSITIVE_REARM"),
                    ("Reg 2 Neg Auto-rearm", "REG_2_NEGATIVE_REARM"),
                    ("Watch Position 1 Fwd", "WATCH_1_FORWARD"),
                    ("Watch Position 1 Rev", "WATCH_1_REVERSE"),
                    ("Watch Position 2 Fwd", "WATCH_2_FORWARD"),
                    ("Watch Position 2 Rev", "WATCH_2_REVERSE"),
                    ("Marker Pos Edge", "MARKER_POSITIVE"),
                    ("Marker Neg Edge", "MARKER_NEGATIVE"),
                    ("Home Switch Pos Edge", "HOME_POSITIVE"),
                    ("Home Switch Neg Edge", "HOME_NEGATIVE"),
                    ("Home Switch-Marker ++", "HOME_MARKER_PP"),
                    ("Home Switch-Marker +-", "HOME_MARKER_PN"),
                    ("Home Switch-Marker -+", "HOME_MARKER_NP"),
                    ("Home Switch-Marker --", "HOME_MARKER_NN"),
                    ("Home Torque Threshold", "HOME_TORQUE"),
                ],
            },
        ],
    },
    File {
        path: "profile-cia402/src/generated/codes.rs",
        about: "Codes of CANopen devices and CiA 402 drives.",
        tables: "`mappings/tables/dictionary/cia402-codes.toml`",
        items: &[
            OfCodes(Codes {
                name: "NmtCommand",
                doc: &["Command specifier."],
                set: Set::Cia402("NMT command"),
                letters: Lower,
                ..CODES
            }),
            OfCodes(Codes {
                name: "NmtState",
                doc: &["State of a device as its heartbeat tells it."],
                set: Set::Cia402("NMT state"),
                letters: Lower,
                ..CODES
            }),
            OfCodes(Codes {
                name: "AbortCode",
                repr: "u32",
                digits: 8,
                doc: &["Abort code. Codes without a name are kept."],
                set: Set::Cia402("SDO abort"),
                letters: Lower,
                constants: &[
                    ("Toggle bit not alternated", "TOGGLE"),
                    ("SDO protocol timed out", "TIMEOUT"),
                    ("Command specifier not valid or unknown", "COMMAND"),
                    ("Invalid block size", "BLOCK_SIZE"),
                    ("Invalid sequence number", "SEQUENCE"),
                    ("CRC error", "CRC"),
                    ("Unsupported access to an object", "ACCESS"),
                    ("Attempt to read a write-only object", "WRITE_ONLY"),
                    ("Attempt to write a read-only object", "READ_ONLY"),
                    ("Object does not exist", "NO_OBJECT"),
                    ("Object cannot be mapped to a PDO", "NOT_MAPPABLE"),
                    ("Objects to be mapped exceed the length of the PDO", "PDO_LENGTH"),
                    ("General parameter incompatibility", "PARAMETER"),
                    ("Access failed due to a hardware error", "HARDWARE"),
                    ("Length of the data type does not match", "LENGTH"),
                    ("Length of the data type is too high", "TOO_LONG"),
                    ("Length of the data type is too low", "TOO_SHORT"),
                    ("Sub-index does not exist", "NO_SUB_INDEX"),
                    ("Value out of range", "VALUE"),
                    ("Value too high", "TOO_HIGH"),
                    ("Value too low", "TOO_LOW"),
                    ("General error", "GENERAL"),
                    ("Data cannot be transferred or stored", "STORE"),
                    ("Data cannot be transferred or stored: local control", "LOCAL_CONTROL"),
                    ("Data cannot be transferred or stored: device state", "DEVICE_STATE"),
                    ("No data available", "NO_DATA"),
                ],
                ..CODES
            }),
            OfCodes(Codes {
                name: "BootStatus",
                digits: 2,
                doc: &["Error status of a boot-up: a letter (CiA 302-2)."],
                set: Set::Cia402("Boot error status"),
                letters: BehindTheirLetter,
                constants: &[
                    ("No answer to device type", "NO_ANSWER"),
                    ("Another device type", "DEVICE_TYPE"),
                    ("Another vendor", "VENDOR"),
                    ("No answer to node guarding", "GUARDING"),
                    ("Configuration download failed", "CONFIGURATION"),
                    ("No heartbeat while starting", "NO_HEARTBEAT"),
                    ("Was operational already", "ALREADY_OPERATIONAL"),
                    ("Another product code", "PRODUCT"),
                    ("Another revision", "REVISION"),
                    ("Another serial number", "SERIAL"),
                    ("Program download not configured", "PROGRAM_VERSION"),
                    ("Program update not allowed", "PROGRAM_OTHER"),
                    ("Program download failed", "PROGRAM_DOWNLOAD"),
                ],
                ..CODES
            }),
            OfCodes(Codes {
                name: "Mode",
                repr: "i8",
                doc: &["A mode of operation. Below 0: of the manufacturer."],
                set: Set::Cia402("Mode of operation"),
                letters: LowerWithoutAbbreviation,
                constants: &[
                    ("No mode", "NONE"),
                    ("Profile position (pp)", "PROFILE_POSITION"),
                    ("Velocity (vl)", "VELOCITY"),
                    ("Profile velocity (pv)", "PROFILE_VELOCITY"),
                    ("Profile torque (tq)", "TORQUE"),
                    ("Homing (hm)", "HOMING"),
                    ("Interpolated position (ip)", "INTERPOLATED_POSITION"),
                    ("Cyclic synchronous position (csp)", "CYCLIC_POSITION"),
                    ("Cyclic synchronous velocity (csv)", "CYCLIC_VELOCITY"),
                    ("Cyclic synchronous torque (cst)", "CYCLIC_TORQUE"),
                    ("Cyclic synchronous torque with commutation angle (cstca)", "CYCLIC_TORQUE_COMMUTATION"),
                ],
                ..CODES
            }),
            OfCodes(Codes {
                name: "QuickStopOption",
                repr: "i16",
                doc: &[
                    "605Ah, quick stop: transition 11. 1 to 4 end in *switch on disabled*, 5 to 8 stand with torque.",
                ],
                set: Set::Cia402("Quick stop option code"),
                letters: Lower,
                constants: &[("Disable drive", "DISABLE")],
                ..CODES
            }),
            OfCodes(Codes {
                name: "ShutdownOption",
                repr: "i16",
                doc: &["605Bh, shutdown: transition 8."],
                set: Set::Cia402("Shutdown option code"),
                letters: Lower,
                constants: &[("Disable drive", "DISABLE")],
                ..CODES
            }),
            OfCodes(Codes {
                name: "DisableOption",
                repr: "i16",
                doc: &["605Ch, disable operation: transition 5."],
                set: Set::Cia402("Disable operation option code"),
                letters: Lower,
                constants: &[("Disable drive", "DISABLE")],
                ..CODES
            }),
            OfCodes(Codes {
                name: "HaltOption",
                repr: "i16",
                doc: &["605Dh, halt: bit 8 of the controlword. The axis stands with torque."],
                set: Set::Cia402("Halt option code"),
                letters: Lower,
                ..CODES
            }),
            OfCodes(Codes {
                name: "FaultReactionOption",
                repr: "i16",
                doc: &["605Eh, fault reaction: transition 13."],
                set: Set::Cia402("Fault reaction option code"),
                letters: Lower,
                constants: &[("Disable drive", "DISABLE")],
                ..CODES
            }),
            OfCodes(Codes {
                name: "AbortConnectionOption",
                repr: "i16",
                doc: &["6007h, abort connection: the master is gone while the axis runs."],
                set: Set::Cia402("Abort connection option code"),
                letters: Lower,
                constants: &[("No action", "NONE")],
                ..CODES
            }),
            OfCodes(Codes {
                name: "ErrorCode",
                repr: "u16",
                digits: 4,
                doc: &["An error code. FF00h to FFFFh are of the manufacturer."],
                set: Set::Cia402("Error code"),
                letters: Lower,
                constants: &[
                    ("Earth leakage, motor side", "EARTH_LEAKAGE"),
                    ("Short circuit, motor side", "SHORT_CIRCUIT"),
                    ("I2t fault", "LOAD_LEVEL_FAULT"),
                    ("Device temperature too high", "DEVICE_TOO_HOT"),
                    ("Drive temperature too high", "DRIVE_TOO_HOT"),
                    ("Motor error or commutation malfunction", "MOTOR_COMMUTATION"),
                    ("Communication of additional modules", "COMMUNICATION_MODULE"),
                    ("CAN overrun: objects lost", "CAN_OVERRUN"),
                    ("Life guard or heartbeat error", "HEARTBEAT"),
                    ("CAN-ID collision", "IDENTIFIER_COLLISION"),
                    ("PDO not processed: too short", "PDO_TOO_SHORT"),
                    ("Unexpected length of SYNC", "SYNC_LENGTH"),
                    ("External error", "EXTERNAL"),
                    ("Generic error", "GENERIC"),
                ],
                ..CODES
            }),
            OfCodes(Codes {
                name: "LssMode",
                doc: &["State that `switch state global` brings about."],
                set: Set::Cia402("LSS mode"),
                letters: Lower,
                ..CODES
            }),
            OfCodes(Codes {
                name: "LssError",
                doc: &["Error code in answers to 11 (node-id) and 13 (bit timing), and to 17 (store)."],
                set: Set::Cia402("LSS error"),
                letters: Lower,
                constants: &[
                    ("Out of range or not supported", "REFUSED"),
                    ("Storage error", "STORAGE"),
                    ("Manufacturer error", "MANUFACTURER"),
                ],
                ..CODES
            }),
            OfCodes(Codes {
                name: "BitTiming",
                doc: &["Entry of table 0 of bit rates."],
                set: Set::Cia402("LSS bit timing"),
                letters: Lower,
                constants: &[
                    ("1000 kbit/s", "K1000"),
                    ("800 kbit/s", "K800"),
                    ("500 kbit/s", "K500"),
                    ("250 kbit/s", "K250"),
                    ("125 kbit/s", "K125"),
                    ("50 kbit/s", "K50"),
                    ("20 kbit/s", "K20"),
                    ("10 kbit/s", "K10"),
                    ("Automatic", "AUTO"),
                ],
                ..CODES
            }),
        ],
    },
    File {
        path: "profile-cia402/src/generated/bits.rs",
        about: "Bits of CANopen devices and CiA 402 drives.",
        tables: "`mappings/tables/dictionary/cia402-codes.toml`",
        items: &[
            Masks {
                module: "error_register",
                repr: "u8",
                set: Set::Cia402("Error register"),
                constants: &[],
            },
            Masks {
                module: "supported_modes",
                repr: "u32",
                set: Set::Cia402("Supported drive modes"),
                constants: &[],
            },
            Masks { module: "controlword", repr: "u16", set: Set::Cia402("Controlword"), constants: &[] },
            Masks { module: "statusword", repr: "u16", set: Set::Cia402("Statusword"), constants: &[] },
            Masks {
                module: "probe_function",
                repr: "u16",
                set: Set::Cia402("Touch probe function"),
                constants: &[],
            },
            Masks {
                module: "probe_status",
                repr: "u16",
                set: Set::Cia402("Touch probe status"),
                constants: &[],
            },
            Masks { module: "polarity", repr: "u8", set: Set::Cia402("Polarity"), constants: &[] },
        ],
    },
    File {
        path: "profile-sercos/src/generated/codes.rs",
        about: "Codes of SERCOS.",
        tables: "`mappings/tables/dictionary/sercos-codes.toml`",
        items: &[
            OfCodes(Codes {
                name: "SvcError",
                repr: "u16",
                digits: 4,
                doc: &["An error code of the service channel. Codes without a name are kept."],
                set: Set::Sercos("Service channel error"),
                constants: &[
                    ("service channel not open", "NOT_OPEN"),
                    ("invalid access to closing the service channel", "CLOSE_ACCESS"),
                    ("IDN not available", "NO_IDN"),
                    ("invalid access to element 1", "IDN_ACCESS"),
                    ("name not available", "NO_NAME"),
                    ("name transmission too short", "NAME_SHORT"),
                    ("name cannot be changed", "NAME_READ_ONLY"),
                    ("attribute cannot be changed", "ATTRIBUTE_READ_ONLY"),
                    ("unit not available", "NO_UNIT"),
                    ("minimum value not available", "NO_MINIMUM"),
                    ("maximum value not available", "NO_MAXIMUM"),
                    ("maximum value cannot be changed", "MAXIMUM_READ_ONLY"),
                    ("operation data transmission too short", "DATA_SHORT"),
                    ("operation data transmission too long", "DATA_LONG"),
                    ("operation data cannot be changed", "DATA_READ_ONLY"),
                    ("operation data is write protected at this time", "DATA_PROTECTED"),
                    ("operation data is below the minimum", "BELOW_MINIMUM"),
                    ("operation data is above the maximum", "ABOVE_MAXIMUM"),
                    ("operation data is invalid", "INVALID_DATA"),
                    ("operation data is configured cyclically", "CYCLIC"),
                    ("operation data is protected by other settings", "OTHER_SETTINGS"),
                    ("procedure command cannot be executed at this time", "NOT_EXECUTABLE"),
                ],
                ..CODES
            }),
            OfCodes(Codes {
                name: "ScpClass",
                digits: 2,
                doc: &["An SCP class number. Numbers without a name are kept."],
                set: Set::Sercos("SCP class"),
                constants: &[
                    ("SCP_FixCFG", "FIX_CFG"),
                    ("SCP_VarCFG", "VAR_CFG"),
                    ("SCP_Sync", "SYNC"),
                    ("SCP_WD", "WATCHDOG"),
                    ("SCP_Diag", "DIAGNOSIS"),
                    ("SCP_HP", "HOT_PLUG"),
                    ("SCP_NRT", "NRT"),
                    ("SCP_Cyc", "CYCLIC"),
                    ("SCP_WDCon", "WATCHDOG_CONNECTION"),
                    ("SCP_SWC", "SOFTWARE_CONTROL"),
                ],
                ..CODES
            }),
        ],
    },
    File {
        path: "profile-sercos/src/generated/bits.rs",
        about: "Bits of the words of SERCOS.",
        tables: "`mappings/tables/dictionary/sercos-bits.toml`",
        items: &[
            Masks {
                module: "drive_control",
                repr: "u16",
                set: Set::SercosWord("Drive control"),
                constants: &[],
            },
            Masks {
                module: "drive_status",
                repr: "u16",
                set: Set::SercosWord("Drive status"),
                constants: &[],
            },
            Masks {
                module: "device_control",
                repr: "u16",
                set: Set::SercosWord("Device control"),
                constants: &[],
            },
            Masks {
                module: "device_status",
                repr: "u16",
                set: Set::SercosWord("Device status"),
                constants: &[],
            },
            Masks {
                module: "procedure_control",
                repr: "u16",
                set: Set::SercosWord("Procedure command control"),
                constants: &[],
            },
            Masks {
                module: "procedure_acknowledgement",
                repr: "u16",
                set: Set::SercosWord("Procedure command acknowledgement"),
                constants: &[],
            },
            Masks { module: "data_status", repr: "u16", set: Set::SercosWord("Data status"), constants: &[] },
            Masks {
                module: "connection_control",
                repr: "u16",
                set: Set::SercosWord("Connection control (C-CON)"),
                constants: &[],
            },
            Masks {
                module: "connection_setup",
                repr: "u16",
                set: Set::SercosWord("Connection setup"),
                constants: &[],
            },
            Masks {
                module: "communication_version",
                repr: "u32",
                set: Set::SercosWord("Communication version"),
                constants: &[],
            },
            Masks {
                module: "svc_control",
                repr: "u16",
                set: Set::SercosWord("Service channel control (C-SVC)"),
                constants: &[],
            },
            Masks {
                module: "svc_status",
                repr: "u16",
                set: Set::SercosWord("Service channel status (S-SVC)"),
                constants: &[],
            },
        ],
    },
    File {
        path: "profile-sercos/src/generated/idns.rs",
        about: "Parameters and procedure commands of SERCOS.",
        tables: "`sercos-idns.toml` and `sercos-communication.toml` in `mappings/tables/dictionary`",
        items: &[
            Numbers {
                rows: Rows::Idns,
                of: "0011 0012 0013 0014 0017 0021 0022 0025 0030 0032 0036 0037 0040 0041 0042 0043 0044 \
                     0045 0046 0047 0048 0049 0050 0051 0052 0053 0055 0057 0076 0077 0078 0079 0080 0081 \
                     0082 0083 0084 0085 0086 0091 0092 0093 0094 0095 0099 0103 0104 0108 0121 0122 0123 \
                     0124 0125 0126 0127 0128 0129 0130 0131 0132 0133 0134 0135 0136 0137 0138 0140 0141 \
                     0146 0147 0148 0150 0159 0160 0161 0162 0169 0170 0171 0172 0173 0175 0179 0187 0188 \
                     0189 0191 0192 0206 0207 0208 0258 0259 0260 0292 0296 0359 0380 0383 0384 0386 0390 \
                     0400 0401 0402 0403 0405 0406 0408 0409 0410 0411 0412 0440 0442 0447 1000 1000.0.1 1002 \
                     1003 1005 1006 1007 1008 1009 1010 1011 1012 1013 1014 1015 1017 1023 1024 1026 1027.0.1 \
                     1027.0.2 1028 1032 1035 1036 1037 1040 1044 1045 1046 1047 1051 1061 1300.x.2 1300.x.3 \
                     1300.x.4 1300.x.5 1300.x.8 1300.x.9 1300.x.12 1302.x.1",
                constants: &[
                    ("IDN-list of invalid operation data for CP2", "INVALID_CP2"),
                    ("IDN-list of invalid operation data for CP3", "INVALID_CP3"),
                    ("Reset class 1 diagnostic", "RESET_C1D"),
                    ("Communication phase 3 transition check", "CP3_CHECK"),
                    ("Communication phase 4 transition check", "CP4_CHECK"),
                    ("Drive status word", "DRIVE_STATUS"),
                    ("List of SCP classes", "SCP_CLASSES"),
                    ("List of active SCP classes", "SCP_ACTIVE"),
                    ("Communication cycle time", "CYCLE_TIME"),
                    ("Allowed MST losses in CP3 and CP4", "MST_LOSSES"),
                    ("Minimum feedback processing time", "FEEDBACK_TIME"),
                    ("AT0 transmission starting time", "AT_START"),
                    ("Synchronization time", "SYNC_TIME"),
                    ("Command value valid time", "COMMAND_VALID"),
                    ("Device control offset in MDT", "CONTROL_OFFSET"),
                    ("Lengths of MDTs", "MDT_LENGTHS"),
                    ("Device status offset in AT", "STATUS_OFFSET"),
                    ("Lengths of ATs", "AT_LENGTHS"),
                    ("Service channel offset in MDT", "SVC_MDT_OFFSET"),
                    ("Service channel offset in AT", "SVC_AT_OFFSET"),
                    ("UC channel transmission time", "UC_TIMES"),
                    ("Synchronization jitter", "SYNC_JITTER"),
                    ("Synchronization delay measuring procedure command", "DELAY_MEASURING"),
                    ("Requested MTU", "MTU_REQUESTED"),
                    ("Effective MTU", "MTU_EFFECTIVE"),
                    ("SERCOS address", "ADDRESS"),
                    ("Maximum consumer activation time", "CONSUMER_TIME"),
                    ("Image of connection setups", "CONNECTION_IMAGE"),
                    ("Maximum TSref counter", "TSREF_MAX"),
                    ("Position loop K_V-factor", "POSITION_LOOP_KV"),
                    ("List of supported operation modes", "OPERATION_MODES"),
                    ("Vendor code", "VENDOR_CODE"),
                ],
            },
            Elements {
                module: "connection",
                block: 1050,
                of: &[1, 2, 3, 4, 5, 6, 8, 10, 11, 12],
                constants: &[
                    ("Connection setup", "SETUP"),
                    ("Connection number", "NUMBER"),
                    ("Telegram assignment", "ASSIGNMENT"),
                    ("Maximum length of connection", "LENGTH_MAX"),
                    ("Current length of connection", "LENGTH"),
                    ("Configuration list", "LIST"),
                    ("Current connection control (C-CON)", "CONTROL"),
                    ("Producer cycle time", "CYCLE"),
                    ("Allowed data losses", "LOSSES_MAX"),
                    ("Error counter data losses", "LOSSES"),
                ],
            },
        ],
    },
    File {
        path: "profile-cia402/src/generated/objects.rs",
        about: "Indices of objects; those of CiA 402 are for the first axis of a device.",
        tables: "`mappings/tables/dictionary/cia402-objects.toml`",
        items: &[Numbers {
            rows: Rows::Objects,
            of: "1000 1001 1003 1005 1006 1007 1008 1009 100A 100C 100D 1010 1011 1012 1014 1015 1016 \
                     1017 1018 1019 1020 1021 1029 1200 1400 1600 1800 1A00 6007 603F 6040 6041 6042 6043 \
                     6044 6046 6048 6049 604A 604C 605A 605B 605C 605D 605E 6060 6061 6062 6063 6064 6065 \
                     6066 6067 6068 6069 606B 606C 606D 606E 606F 6070 6071 6072 6073 6074 6075 6076 6077 \
                     6078 6079 607A 607B 607C 607D 607E 607F 6080 6081 6082 6083 6084 6085 6086 6087 608F \
                     6091 6092 6096 6097 6098 6099 609A 60B0 60B1 60B2 60B8 60B9 60BA 60BB 60BC 60BD 60C0 \
                     60C1 60C2 60C5 60C6 60D5 60D6 60D7 60D8 60E0 60E1 60E3 60E4 60E5 60F4 60FA 60FC 60FD 60FE 60FF \
                     6402 6502 6503 6504 67FF",
            constants: &[
                ("Error code", "ERROR_CODE"),
                ("vl velocity min max amount", "VL_VELOCITY_LIMITS"),
                ("vl velocity acceleration", "VL_ACCELERATION"),
                ("vl velocity deceleration", "VL_DECELERATION"),
                ("vl velocity quick stop", "VL_QUICK_STOP"),
                ("Disable operation option code", "DISABLE_OPTION"),
                ("Modes of operation", "MODE"),
                ("Modes of operation display", "MODE_DISPLAY"),
                ("Position actual internal value", "POSITION_INTERNAL"),
                ("Following error window", "FOLLOWING_WINDOW"),
                ("Following error time out", "FOLLOWING_TIME_OUT"),
                ("Velocity sensor actual value", "VELOCITY_SENSOR"),
                ("Motor rated current", "RATED_CURRENT"),
                ("Motor rated torque", "RATED_TORQUE"),
                ("DC link circuit voltage", "DC_LINK_VOLTAGE"),
                ("Position range limit", "RANGE_LIMIT"),
                ("Software position limit", "SOFTWARE_LIMIT"),
                ("Motion profile type", "PROFILE_TYPE"),
                ("Position encoder resolution", "ENCODER_RESOLUTION"),
                ("Touch probe function", "PROBE_FUNCTION"),
                ("Touch probe status", "PROBE_STATUS"),
                ("Touch probe 1 positive edge", "PROBE_1_RISING"),
                ("Touch probe 1 negative edge", "PROBE_1_FALLING"),
                ("Touch probe 2 positive edge", "PROBE_2_RISING"),
                ("Touch probe 2 negative edge", "PROBE_2_FALLING"),
                ("Interpolation sub mode select", "INTERPOLATION_SUB_MODE"),
                ("Interpolation data record", "INTERPOLATION_DATA"),
                ("Interpolation time period", "INTERPOLATION_PERIOD"),
                ("Touch probe 1 positive edge counter", "PROBE_1_RISING_COUNTER"),
                ("Touch probe 1 negative edge counter", "PROBE_1_FALLING_COUNTER"),
                ("Touch probe 2 positive edge counter", "PROBE_2_RISING_COUNTER"),
                ("Touch probe 2 negative edge counter", "PROBE_2_FALLING_COUNTER"),
                ("Following error actual value", "FOLLOWING_ERROR"),
                ("Supported drive modes", "SUPPORTED_MODES"),
                ("Drive catalogue number", "DRIVE_CATALOGUE"),
                ("Single device type", "AXIS_DEVICE_TYPE"),
                ("COB-ID SYNC message", "COB_ID_SYNC"),
                ("COB-ID time stamp message", "COB_ID_TIME"),
                ("COB-ID emergency message", "COB_ID_EMCY"),
                ("Inhibit time emergency message", "INHIBIT_TIME_EMCY"),
                ("Identity object", "IDENTITY"),
                ("Synchronous counter overflow value", "SYNC_OVERFLOW"),
                ("RPDO communication parameter", "RPDO_COMMUNICATION"),
                ("RPDO mapping parameter", "RPDO_MAPPING"),
                ("TPDO communication parameter", "TPDO_COMMUNICATION"),
                ("TPDO mapping parameter", "TPDO_MAPPING"),
            ],
        }],
    },
    File {
        path: "profile-cip/src/generated/attributes.rs",
        about: "Attributes of the Motion Device Axis Object that the protocol engine itself works with.",
        tables: "`mappings/tables/dictionary/cip-attributes.toml`",
        items: &[OfAttributes(Attributes {
            class: "1 14 15 16 17 18 19 20 21 22 31 32 33 34 35 36",
            axis: "40 42 60 61 89 90 91 92 93 94 650 651 652 653 654 655 656 657 658 659 660 661 662 663 664 665 \
                   666 667 668 669 670 674 675 676 677",
            other_class: "2 3 4 5 6 7 28 29 30",
            others: "62 66 70 71 72 95 96 97 360 361 362 363 364 672 673 756 757 760 761 762 763 764",
            constants: &[
                ("Maximum ID Number Class Attributes", "MAX_CLASS_ATTRIBUTE"),
                ("Maximum ID Number Instance Attributes", "MAX_INSTANCE_ATTRIBUTE"),
                ("Controller Update Delay High Limit", "UPDATE_DELAY_HIGH_LIMIT"),
                ("Controller Update Delay Low Limit", "UPDATE_DELAY_LOW_LIMIT"),
                ("Lost Controller Updates", "LOST_UPDATES"),
                ("Late Controller Updates", "LATE_UPDATES"),
                ("Drive Power Structure Class ID", "POWER_STRUCTURE_CLASS_ID"),
                ("Axis I/O Status", "AXIS_IO_STATUS"),
                ("Axis I/O Status - Mfg", "AXIS_IO_STATUS_MFG"),
                ("Registration 1 Positive Edge Position", "REGISTRATION_POSITION"),
                ("Registration 1 Positive Edge Time", "REGISTRATION_TIME"),
                ("Watch 1 Event Time", "WATCH_EVENT_TIME"),
                ("Controller Position Command - Integer", "POSITION_COMMAND_INTEGER"),
                ("Controller Position Command - Float", "POSITION_COMMAND_FLOAT"),
                ("Controller Velocity Command", "VELOCITY_COMMAND"),
                ("Controller Acceleration Command", "ACCELERATION_COMMAND"),
                ("Controller Torque Command", "TORQUE_COMMAND"),
            ],
        })],
    },
    File {
        path: "profile-cip/src/generated/devicenet.rs",
        about: "Codes and bits of DeviceNet.",
        tables: "`mappings/tables/dictionary/cip-enumerations.toml`",
        items: &[
            OfCodes(Codes {
                name: "BodyFormat",
                doc: &["Message body format: the widths of class and instance in a request."],
                set: Set::Cip("DeviceNet Body Format"),
                letters: Lower,
                constants: &[
                    ("DeviceNet (8/8)", "CLASS_8_INSTANCE_8"),
                    ("DeviceNet (8/16)", "CLASS_8_INSTANCE_16"),
                    ("DeviceNet (16/16)", "CLASS_16_INSTANCE_16"),
                    ("DeviceNet (16/8)", "CLASS_16_INSTANCE_8"),
                ],
                ..CODES
            }),
            OfCodes(Codes {
                name: "AcknowledgeStatus",
                doc: &["Status in the acknowledge of a fragment."],
                set: Set::Cip("DeviceNet Fragment Status"),
                letters: Lower,
                ..CODES
            }),
            OfCodes(Codes {
                name: "ConnectionState",
                doc: &["State, attribute 1 of the Connection object."],
                set: Set::Cip("DeviceNet Connection State"),
                letters: Lower,
                ..CODES
            }),
            OfCodes(Codes {
                name: "WatchdogAction",
                doc: &["Watchdog time-out action, attribute 12 of the Connection object."],
                set: Set::Cip("DeviceNet Watchdog Action"),
                letters: Lower,
                constants: &[("Transition to timed out", "TIME_OUT")],
                ..CODES
            }),
            OfCodes(Codes {
                name: "Assembly",
                doc: &["Instance of the Assembly object (class 4)."],
                set: Set::Cip("DeviceNet Drive Assembly"),
                letters: Lower,
                constants: &[
                    ("Basic speed and torque control", "BASIC_TORQUE_CONTROL"),
                    ("Extended speed and torque control", "EXTENDED_TORQUE_CONTROL"),
                    ("Basic speed control status", "BASIC_SPEED_STATUS"),
                    ("Extended speed control status", "EXTENDED_SPEED_STATUS"),
                    ("Basic speed and torque control status", "BASIC_TORQUE_STATUS"),
                    ("Extended speed and torque control status", "EXTENDED_TORQUE_STATUS"),
                ],
                ..CODES
            }),
            OfCodes(Codes {
                name: "SupervisorState",
                doc: &["State of the Control Supervisor object, attribute 6."],
                set: Set::Cip("DeviceNet Drive State"),
                letters: Lower,
                constants: &[("Vendor specific", "VENDOR")],
                ..CODES
            }),
            Bits { module: "speed_control", set: Set::Cip("DeviceNet Speed Control"), constants: &[] },
            Bits { module: "speed_status", set: Set::Cip("DeviceNet Speed Status"), constants: &[] },
        ],
    },
];
