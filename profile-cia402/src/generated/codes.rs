//! Codes of CANopen devices and CiA 402 drives.
//!
//! Generated from `mappings/tables/dictionary/cia402-codes.toml`: change the table, not this file, and run
//! `cargo run -p mappings --example generate`.

use profile_generic::open_code;

open_code! {
    /// Command specifier.
    pub struct NmtCommand(u8) {
        /// Start.
        START = 1 => "start",
        /// Stop.
        STOP = 2 => "stop",
        /// Enter pre-operational.
        ENTER_PRE_OPERATIONAL = 128 => "enter pre-operational",
        /// Reset node.
        RESET_NODE = 129 => "reset node",
        /// Reset communication.
        RESET_COMMUNICATION = 130 => "reset communication",
    }
}

open_code! {
    /// State of a device as its heartbeat tells it.
    pub struct NmtState(u8) {
        /// Boot-up.
        BOOT_UP = 0 => "boot-up",
        /// Stopped.
        STOPPED = 4 => "stopped",
        /// Operational.
        OPERATIONAL = 5 => "operational",
        /// Pre-operational.
        PRE_OPERATIONAL = 127 => "pre-operational",
    }
}

open_code! {
    /// Abort code. Codes without a name are kept.
    pub struct AbortCode(u32) {
        /// Toggle bit not alternated.
        TOGGLE = 0x05030000 => "toggle bit not alternated",
        /// SDO protocol timed out.
        TIMEOUT = 0x05040000 => "SDO protocol timed out",
        /// Command specifier not valid or unknown.
        COMMAND = 0x05040001 => "command specifier not valid or unknown",
        /// Invalid block size.
        BLOCK_SIZE = 0x05040002 => "invalid block size",
        /// Invalid sequence number.
        SEQUENCE = 0x05040003 => "invalid sequence number",
        /// CRC error.
        CRC = 0x05040004 => "CRC error",
        /// Out of memory.
        OUT_OF_MEMORY = 0x05040005 => "out of memory",
        /// Unsupported access to an object.
        ACCESS = 0x06010000 => "unsupported access to an object",
        /// Attempt to read a write-only object.
        WRITE_ONLY = 0x06010001 => "attempt to read a write-only object",
        /// Attempt to write a read-only object.
        READ_ONLY = 0x06010002 => "attempt to write a read-only object",
        /// Object does not exist.
        NO_OBJECT = 0x06020000 => "object does not exist",
        /// Object cannot be mapped to a PDO.
        NOT_MAPPABLE = 0x06040041 => "object cannot be mapped to a PDO",
        /// Objects to be mapped exceed the length of the PDO.
        PDO_LENGTH = 0x06040042 => "objects to be mapped exceed the length of the PDO",
        /// General parameter incompatibility.
        PARAMETER = 0x06040043 => "general parameter incompatibility",
        /// General internal incompatibility in the device.
        GENERAL_INTERNAL_INCOMPATIBILITY_IN_THE_DEVICE = 0x06040047 => "general internal incompatibility in the device",
        /// Access failed due to a hardware error.
        HARDWARE = 0x06060000 => "access failed due to a hardware error",
        /// Length of the data type does not match.
        LENGTH = 0x06070010 => "length of the data type does not match",
        /// Length of the data type is too high.
        TOO_LONG = 0x06070012 => "length of the data type is too high",
        /// Length of the data type is too low.
        TOO_SHORT = 0x06070013 => "length of the data type is too low",
        /// Sub-index does not exist.
        NO_SUB_INDEX = 0x06090011 => "sub-index does not exist",
        /// Value out of range.
        VALUE = 0x06090030 => "value out of range",
        /// Value too high.
        TOO_HIGH = 0x06090031 => "value too high",
        /// Value too low.
        TOO_LOW = 0x06090032 => "value too low",
        /// Maximum value is less than minimum value.
        MAXIMUM_VALUE_IS_LESS_THAN_MINIMUM_VALUE = 0x06090036 => "maximum value is less than minimum value",
        /// Resource not available: SDO connection.
        RESOURCE_NOT_AVAILABLE_SDO_CONNECTION = 0x060A0023 => "resource not available: SDO connection",
        /// General error.
        GENERAL = 0x08000000 => "general error",
        /// Data cannot be transferred or stored.
        STORE = 0x08000020 => "data cannot be transferred or stored",
        /// Data cannot be transferred or stored: local control.
        LOCAL_CONTROL = 0x08000021 => "data cannot be transferred or stored: local control",
        /// Data cannot be transferred or stored: device state.
        DEVICE_STATE = 0x08000022 => "data cannot be transferred or stored: device state",
        /// No object dictionary.
        NO_OBJECT_DICTIONARY = 0x08000023 => "no object dictionary",
        /// No data available.
        NO_DATA = 0x08000024 => "no data available",
    }
}

open_code! {
    /// Error status of a boot-up: a letter (CiA 302-2).
    pub struct BootStatus(u8) {
        /// Not in the list of devices: letter A.
        NOT_IN_THE_LIST_OF_DEVICES = 0x41 => "A: not in the list of devices",
        /// No answer to device type: letter B.
        NO_ANSWER = 0x42 => "B: no answer to device type",
        /// Another device type: letter C.
        DEVICE_TYPE = 0x43 => "C: another device type",
        /// Another vendor: letter D.
        VENDOR = 0x44 => "D: another vendor",
        /// Heartbeat lost: letter E.
        HEARTBEAT_LOST = 0x45 => "E: heartbeat lost",
        /// No answer to node guarding: letter F.
        GUARDING = 0x46 => "F: no answer to node guarding",
        /// Program download not configured: letter G; or its objects contradict each other.
        PROGRAM_VERSION = 0x47 => "G: program download not configured",
        /// Program update not allowed: letter H; by the configuration or by the state.
        PROGRAM_OTHER = 0x48 => "H: program update not allowed",
        /// Program download failed: letter I.
        PROGRAM_DOWNLOAD = 0x49 => "I: program download failed",
        /// Configuration download failed: letter J.
        CONFIGURATION = 0x4A => "J: configuration download failed",
        /// No heartbeat while starting: letter K.
        NO_HEARTBEAT = 0x4B => "K: no heartbeat while starting",
        /// Was operational already: letter L.
        ALREADY_OPERATIONAL = 0x4C => "L: was operational already",
        /// Another product code: letter M.
        PRODUCT = 0x4D => "M: another product code",
        /// Another revision: letter N.
        REVISION = 0x4E => "N: another revision",
        /// Another serial number: letter O.
        SERIAL = 0x4F => "O: another serial number",
    }
}

open_code! {
    /// A mode of operation. Below 0: of the manufacturer.
    pub struct Mode(i8) {
        /// No mode.
        NONE = 0 => "no mode",
        /// Profile position (pp).
        PROFILE_POSITION = 1 => "profile position",
        /// Velocity (vl).
        VELOCITY = 2 => "velocity",
        /// Profile velocity (pv).
        PROFILE_VELOCITY = 3 => "profile velocity",
        /// Profile torque (tq).
        TORQUE = 4 => "profile torque",
        /// Homing (hm).
        HOMING = 6 => "homing",
        /// Interpolated position (ip).
        INTERPOLATED_POSITION = 7 => "interpolated position",
        /// Cyclic synchronous position (csp).
        CYCLIC_POSITION = 8 => "cyclic synchronous position",
        /// Cyclic synchronous velocity (csv).
        CYCLIC_VELOCITY = 9 => "cyclic synchronous velocity",
        /// Cyclic synchronous torque (cst).
        CYCLIC_TORQUE = 10 => "cyclic synchronous torque",
        /// Cyclic synchronous torque with commutation angle (cstca).
        CYCLIC_TORQUE_COMMUTATION = 11 => "cyclic synchronous torque with commutation angle",
    }
}

open_code! {
    /// 605Ah, quick stop: transition 11. 1 to 4 end in *switch on disabled*, 5 to 8 stand with torque.
    pub struct QuickStopOption(i16) {
        /// Disable drive.
        DISABLE = 0 => "disable drive",
        /// Slow down ramp.
        SLOW_DOWN_RAMP = 1 => "slow down ramp",
        /// Quick stop ramp.
        QUICK_STOP_RAMP = 2 => "quick stop ramp",
        /// Current limit.
        CURRENT_LIMIT = 3 => "current limit",
        /// Voltage limit.
        VOLTAGE_LIMIT = 4 => "voltage limit",
        /// Slow down ramp, stay in quick stop active.
        SLOW_DOWN_RAMP_STAY_IN_QUICK_STOP_ACTIVE = 5 => "slow down ramp, stay in quick stop active",
        /// Quick stop ramp, stay in quick stop active.
        QUICK_STOP_RAMP_STAY_IN_QUICK_STOP_ACTIVE = 6 => "quick stop ramp, stay in quick stop active",
        /// Current limit, stay in quick stop active.
        CURRENT_LIMIT_STAY_IN_QUICK_STOP_ACTIVE = 7 => "current limit, stay in quick stop active",
        /// Voltage limit, stay in quick stop active.
        VOLTAGE_LIMIT_STAY_IN_QUICK_STOP_ACTIVE = 8 => "voltage limit, stay in quick stop active",
    }
}

open_code! {
    /// 605Bh, shutdown: transition 8.
    pub struct ShutdownOption(i16) {
        /// Disable drive.
        DISABLE = 0 => "disable drive",
        /// Slow down ramp.
        SLOW_DOWN_RAMP = 1 => "slow down ramp",
    }
}

open_code! {
    /// 605Ch, disable operation: transition 5.
    pub struct DisableOption(i16) {
        /// Disable drive.
        DISABLE = 0 => "disable drive",
        /// Slow down ramp.
        SLOW_DOWN_RAMP = 1 => "slow down ramp",
    }
}

open_code! {
    /// 605Dh, halt: bit 8 of the controlword. The axis stands with torque.
    pub struct HaltOption(i16) {
        /// Disable drive.
        DISABLE_DRIVE = 0 => "disable drive",
        /// Slow down ramp.
        SLOW_DOWN_RAMP = 1 => "slow down ramp",
        /// Quick stop ramp.
        QUICK_STOP_RAMP = 2 => "quick stop ramp",
        /// Current limit.
        CURRENT_LIMIT = 3 => "current limit",
        /// Voltage limit.
        VOLTAGE_LIMIT = 4 => "voltage limit",
    }
}

open_code! {
    /// 605Eh, fault reaction: transition 13.
    pub struct FaultReactionOption(i16) {
        /// Disable drive.
        DISABLE = 0 => "disable drive",
        /// Slow down ramp.
        SLOW_DOWN_RAMP = 1 => "slow down ramp",
        /// Quick stop ramp.
        QUICK_STOP_RAMP = 2 => "quick stop ramp",
        /// Current limit.
        CURRENT_LIMIT = 3 => "current limit",
        /// Voltage limit.
        VOLTAGE_LIMIT = 4 => "voltage limit",
    }
}

open_code! {
    /// 6007h, abort connection: the master is gone while the axis runs.
    pub struct AbortConnectionOption(i16) {
        /// No action.
        NONE = 0 => "no action",
        /// Fault.
        FAULT = 1 => "fault",
        /// Disable voltage.
        DISABLE_VOLTAGE = 2 => "disable voltage",
        /// Quick stop.
        QUICK_STOP = 3 => "quick stop",
    }
}

open_code! {
    /// An error code. FF00h to FFFFh are of the manufacturer.
    pub struct ErrorCode(u16) {
        /// No error: an EMCY with it says that an error is gone.
        NO_ERROR = 0x0000 => "no error",
        /// Generic error.
        GENERIC = 0x1000 => "generic error",
        /// Short circuit or earth leakage, input.
        SHORT_CIRCUIT_OR_EARTH_LEAKAGE_INPUT = 0x2110 => "short circuit or earth leakage, input",
        /// Earth leakage, input.
        EARTH_LEAKAGE_INPUT = 0x2120 => "earth leakage, input",
        /// Earth leakage phase L1.
        EARTH_LEAKAGE_PHASE_L1 = 0x2121 => "earth leakage phase L1",
        /// Earth leakage phase L2.
        EARTH_LEAKAGE_PHASE_L2 = 0x2122 => "earth leakage phase L2",
        /// Earth leakage phase L3.
        EARTH_LEAKAGE_PHASE_L3 = 0x2123 => "earth leakage phase L3",
        /// Short circuit, input.
        SHORT_CIRCUIT_INPUT = 0x2130 => "short circuit, input",
        /// Short circuit phases L1-L2.
        SHORT_CIRCUIT_PHASES_L1_L2 = 0x2131 => "short circuit phases L1-L2",
        /// Short circuit phases L2-L3.
        SHORT_CIRCUIT_PHASES_L2_L3 = 0x2132 => "short circuit phases L2-L3",
        /// Short circuit phases L3-L1.
        SHORT_CIRCUIT_PHASES_L3_L1 = 0x2133 => "short circuit phases L3-L1",
        /// Internal current 1.
        INTERNAL_CURRENT_1 = 0x2211 => "internal current 1",
        /// Internal current 2.
        INTERNAL_CURRENT_2 = 0x2212 => "internal current 2",
        /// Over-current in the ramp function.
        OVER_CURRENT_IN_THE_RAMP_FUNCTION = 0x2213 => "over-current in the ramp function",
        /// Over-current in the sequence.
        OVER_CURRENT_IN_THE_SEQUENCE = 0x2214 => "over-current in the sequence",
        /// Continuous over-current, internal.
        CONTINUOUS_OVER_CURRENT_INTERNAL = 0x2220 => "continuous over-current, internal",
        /// Continuous over-current, internal 1.
        CONTINUOUS_OVER_CURRENT_INTERNAL_1 = 0x2221 => "continuous over-current, internal 1",
        /// Continuous over-current, internal 2.
        CONTINUOUS_OVER_CURRENT_INTERNAL_2 = 0x2222 => "continuous over-current, internal 2",
        /// Short circuit or earth leakage, internal.
        SHORT_CIRCUIT_OR_EARTH_LEAKAGE_INTERNAL = 0x2230 => "short circuit or earth leakage, internal",
        /// Earth leakage, internal.
        EARTH_LEAKAGE_INTERNAL = 0x2240 => "earth leakage, internal",
        /// Short circuit, internal.
        SHORT_CIRCUIT_INTERNAL = 0x2250 => "short circuit, internal",
        /// Continuous over-current.
        CONTINUOUS_OVER_CURRENT = 0x2310 => "continuous over-current",
        /// Continuous over-current 1.
        CONTINUOUS_OVER_CURRENT_1 = 0x2311 => "continuous over-current 1",
        /// Continuous over-current 2.
        CONTINUOUS_OVER_CURRENT_2 = 0x2312 => "continuous over-current 2",
        /// Short circuit or earth leakage, motor side.
        SHORT_CIRCUIT_OR_EARTH_LEAKAGE_MOTOR_SIDE = 0x2320 => "short circuit or earth leakage, motor side",
        /// Earth leakage, motor side.
        EARTH_LEAKAGE = 0x2330 => "earth leakage, motor side",
        /// Earth leakage phase U.
        EARTH_LEAKAGE_PHASE_U = 0x2331 => "earth leakage phase U",
        /// Earth leakage phase V.
        EARTH_LEAKAGE_PHASE_V = 0x2332 => "earth leakage phase V",
        /// Earth leakage phase W.
        EARTH_LEAKAGE_PHASE_W = 0x2333 => "earth leakage phase W",
        /// Short circuit, motor side.
        SHORT_CIRCUIT = 0x2340 => "short circuit, motor side",
        /// Short circuit phases U-V.
        SHORT_CIRCUIT_PHASES_U_V = 0x2341 => "short circuit phases U-V",
        /// Short circuit phases V-W.
        SHORT_CIRCUIT_PHASES_V_W = 0x2342 => "short circuit phases V-W",
        /// Short circuit phases W-U.
        SHORT_CIRCUIT_PHASES_W_U = 0x2343 => "short circuit phases W-U",
        /// I2t fault.
        LOAD_LEVEL_FAULT = 0x2350 => "I2t fault",
        /// I2t warning.
        I2T_WARNING = 0x2351 => "I2t warning",
        /// Mains over-voltage.
        MAINS_OVER_VOLTAGE = 0x3110 => "mains over-voltage",
        /// Mains over-voltage phase L1.
        MAINS_OVER_VOLTAGE_PHASE_L1 = 0x3111 => "mains over-voltage phase L1",
        /// Mains over-voltage phase L2.
        MAINS_OVER_VOLTAGE_PHASE_L2 = 0x3112 => "mains over-voltage phase L2",
        /// Mains over-voltage phase L3.
        MAINS_OVER_VOLTAGE_PHASE_L3 = 0x3113 => "mains over-voltage phase L3",
        /// Mains under-voltage.
        MAINS_UNDER_VOLTAGE = 0x3120 => "mains under-voltage",
        /// Mains under-voltage phase L1.
        MAINS_UNDER_VOLTAGE_PHASE_L1 = 0x3121 => "mains under-voltage phase L1",
        /// Mains under-voltage phase L2.
        MAINS_UNDER_VOLTAGE_PHASE_L2 = 0x3122 => "mains under-voltage phase L2",
        /// Mains under-voltage phase L3.
        MAINS_UNDER_VOLTAGE_PHASE_L3 = 0x3123 => "mains under-voltage phase L3",
        /// Phase failure.
        PHASE_FAILURE = 0x3130 => "phase failure",
        /// Phase failure L1.
        PHASE_FAILURE_L1 = 0x3131 => "phase failure L1",
        /// Phase failure L2.
        PHASE_FAILURE_L2 = 0x3132 => "phase failure L2",
        /// Phase failure L3.
        PHASE_FAILURE_L3 = 0x3133 => "phase failure L3",
        /// Phase sequence.
        PHASE_SEQUENCE = 0x3134 => "phase sequence",
        /// Mains frequency.
        MAINS_FREQUENCY = 0x3140 => "mains frequency",
        /// Mains frequency too high.
        MAINS_FREQUENCY_TOO_HIGH = 0x3141 => "mains frequency too high",
        /// Mains frequency too low.
        MAINS_FREQUENCY_TOO_LOW = 0x3142 => "mains frequency too low",
        /// DC link over-voltage.
        DC_LINK_OVER_VOLTAGE = 0x3210 => "DC link over-voltage",
        /// Over-voltage 1.
        OVER_VOLTAGE_1 = 0x3211 => "over-voltage 1",
        /// Over-voltage 2.
        OVER_VOLTAGE_2 = 0x3212 => "over-voltage 2",
        /// DC link under-voltage.
        DC_LINK_UNDER_VOLTAGE = 0x3220 => "DC link under-voltage",
        /// Under-voltage 1.
        UNDER_VOLTAGE_1 = 0x3221 => "under-voltage 1",
        /// Under-voltage 2.
        UNDER_VOLTAGE_2 = 0x3222 => "under-voltage 2",
        /// Load error.
        LOAD_ERROR = 0x3230 => "load error",
        /// Output over-voltage.
        OUTPUT_OVER_VOLTAGE = 0x3310 => "output over-voltage",
        /// Output over-voltage phase U.
        OUTPUT_OVER_VOLTAGE_PHASE_U = 0x3311 => "output over-voltage phase U",
        /// Output over-voltage phase V.
        OUTPUT_OVER_VOLTAGE_PHASE_V = 0x3312 => "output over-voltage phase V",
        /// Output over-voltage phase W.
        OUTPUT_OVER_VOLTAGE_PHASE_W = 0x3313 => "output over-voltage phase W",
        /// Armature circuit.
        ARMATURE_CIRCUIT = 0x3320 => "armature circuit",
        /// Armature circuit interrupted.
        ARMATURE_CIRCUIT_INTERRUPTED = 0x3321 => "armature circuit interrupted",
        /// Field circuit.
        FIELD_CIRCUIT = 0x3330 => "field circuit",
        /// Field circuit interrupted.
        FIELD_CIRCUIT_INTERRUPTED = 0x3331 => "field circuit interrupted",
        /// Ambient temperature too high.
        AMBIENT_TEMPERATURE_TOO_HIGH = 0x4110 => "ambient temperature too high",
        /// Ambient temperature too low.
        AMBIENT_TEMPERATURE_TOO_LOW = 0x4120 => "ambient temperature too low",
        /// Temperature of supply air.
        TEMPERATURE_OF_SUPPLY_AIR = 0x4130 => "temperature of supply air",
        /// Temperature of air outlet.
        TEMPERATURE_OF_AIR_OUTLET = 0x4140 => "temperature of air outlet",
        /// Device temperature too high.
        DEVICE_TOO_HOT = 0x4210 => "device temperature too high",
        /// Device temperature too low.
        DEVICE_TEMPERATURE_TOO_LOW = 0x4220 => "device temperature too low",
        /// Drive temperature.
        DRIVE_TEMPERATURE = 0x4300 => "drive temperature",
        /// Drive temperature too high.
        DRIVE_TOO_HOT = 0x4310 => "drive temperature too high",
        /// Drive temperature too low.
        DRIVE_TEMPERATURE_TOO_LOW = 0x4320 => "drive temperature too low",
        /// Supply temperature.
        SUPPLY_TEMPERATURE = 0x4400 => "supply temperature",
        /// Supply temperature too high.
        SUPPLY_TEMPERATURE_TOO_HIGH = 0x4410 => "supply temperature too high",
        /// Supply temperature too low.
        SUPPLY_TEMPERATURE_TOO_LOW = 0x4420 => "supply temperature too low",
        /// Supply.
        SUPPLY = 0x5100 => "supply",
        /// Supply low voltage.
        SUPPLY_LOW_VOLTAGE = 0x5110 => "supply low voltage",
        /// Supply 1: +/-15 V.
        SUPPLY_1_15_V = 0x5111 => "supply 1: +/-15 V",
        /// Supply 2: +24 V.
        SUPPLY_2_24_V = 0x5112 => "supply 2: +24 V",
        /// Supply 3: +5 V.
        SUPPLY_3_5_V = 0x5113 => "supply 3: +5 V",
        /// Supply 4: of the manufacturer.
        SUPPLY_4 = 0x5114 => "supply 4",
        /// Supply 5: of the manufacturer.
        SUPPLY_5 = 0x5115 => "supply 5",
        /// Supply 6: of the manufacturer.
        SUPPLY_6 = 0x5116 => "supply 6",
        /// Supply 7: of the manufacturer.
        SUPPLY_7 = 0x5117 => "supply 7",
        /// Supply 8: of the manufacturer.
        SUPPLY_8 = 0x5118 => "supply 8",
        /// Supply 9: of the manufacturer.
        SUPPLY_9 = 0x5119 => "supply 9",
        /// Supply of the intermediate circuit.
        SUPPLY_OF_THE_INTERMEDIATE_CIRCUIT = 0x5120 => "supply of the intermediate circuit",
        /// Control hardware.
        CONTROL_HARDWARE = 0x5200 => "control hardware",
        /// Measurement circuit of the control.
        MEASUREMENT_CIRCUIT_OF_THE_CONTROL = 0x5210 => "measurement circuit of the control",
        /// Computing circuit of the control.
        COMPUTING_CIRCUIT_OF_THE_CONTROL = 0x5220 => "computing circuit of the control",
        /// Operating unit.
        OPERATING_UNIT = 0x5300 => "operating unit",
        /// Power section.
        POWER_SECTION = 0x5400 => "power section",
        /// Output stages.
        OUTPUT_STAGES = 0x5410 => "output stages",
        /// Chopper.
        CHOPPER = 0x5420 => "chopper",
        /// Input stages.
        INPUT_STAGES = 0x5430 => "input stages",
        /// Contacts.
        CONTACTS = 0x5440 => "contacts",
        /// Contact 1: of the manufacturer.
        CONTACT_1 = 0x5441 => "contact 1",
        /// Contact 2: of the manufacturer.
        CONTACT_2 = 0x5442 => "contact 2",
        /// Contact 3: of the manufacturer.
        CONTACT_3 = 0x5443 => "contact 3",
        /// Contact 4: of the manufacturer.
        CONTACT_4 = 0x5444 => "contact 4",
        /// Contact 5: of the manufacturer.
        CONTACT_5 = 0x5445 => "contact 5",
        /// Fuses.
        FUSES = 0x5450 => "fuses",
        /// Fuse S1: L1.
        FUSE_S1_L1 = 0x5451 => "fuse S1: L1",
        /// Fuse S2: L2.
        FUSE_S2_L2 = 0x5452 => "fuse S2: L2",
        /// Fuse S3: L3.
        FUSE_S3_L3 = 0x5453 => "fuse S3: L3",
        /// Fuse S4: of the manufacturer.
        FUSE_S4 = 0x5454 => "fuse S4",
        /// Fuse S5: of the manufacturer.
        FUSE_S5 = 0x5455 => "fuse S5",
        /// Fuse S6: of the manufacturer.
        FUSE_S6 = 0x5456 => "fuse S6",
        /// Fuse S7: of the manufacturer.
        FUSE_S7 = 0x5457 => "fuse S7",
        /// Fuse S8: of the manufacturer.
        FUSE_S8 = 0x5458 => "fuse S8",
        /// Fuse S9: of the manufacturer.
        FUSE_S9 = 0x5459 => "fuse S9",
        /// Hardware data storage.
        HARDWARE_DATA_STORAGE = 0x5500 => "hardware data storage",
        /// Working memory (RAM).
        WORKING_MEMORY_RAM = 0x5510 => "working memory (RAM)",
        /// Program memory (EPROM).
        PROGRAM_MEMORY_EPROM = 0x5520 => "program memory (EPROM)",
        /// Non-volatile data memory (EEPROM).
        NON_VOLATILE_DATA_MEMORY_EEPROM = 0x5530 => "non-volatile data memory (EEPROM)",
        /// Software reset (watchdog).
        SOFTWARE_RESET_WATCHDOG = 0x6010 => "software reset (watchdog)",
        /// Data record 1.
        DATA_RECORD_1 = 0x6301 => "data record 1",
        /// Data record 2.
        DATA_RECORD_2 = 0x6302 => "data record 2",
        /// Data record 3.
        DATA_RECORD_3 = 0x6303 => "data record 3",
        /// Data record 4.
        DATA_RECORD_4 = 0x6304 => "data record 4",
        /// Data record 5.
        DATA_RECORD_5 = 0x6305 => "data record 5",
        /// Data record 6.
        DATA_RECORD_6 = 0x6306 => "data record 6",
        /// Data record 7.
        DATA_RECORD_7 = 0x6307 => "data record 7",
        /// Data record 8.
        DATA_RECORD_8 = 0x6308 => "data record 8",
        /// Data record 9.
        DATA_RECORD_9 = 0x6309 => "data record 9",
        /// Data record 10.
        DATA_RECORD_10 = 0x630A => "data record 10",
        /// Data record 11.
        DATA_RECORD_11 = 0x630B => "data record 11",
        /// Data record 12.
        DATA_RECORD_12 = 0x630C => "data record 12",
        /// Data record 13.
        DATA_RECORD_13 = 0x630D => "data record 13",
        /// Data record 14.
        DATA_RECORD_14 = 0x630E => "data record 14",
        /// Data record 15.
        DATA_RECORD_15 = 0x630F => "data record 15",
        /// Loss of parameters.
        LOSS_OF_PARAMETERS = 0x6310 => "loss of parameters",
        /// Parameter error.
        PARAMETER_ERROR = 0x6320 => "parameter error",
        /// Power of additional modules.
        POWER_OF_ADDITIONAL_MODULES = 0x7100 => "power of additional modules",
        /// Brake chopper.
        BRAKE_CHOPPER = 0x7110 => "brake chopper",
        /// Failure of the brake chopper.
        FAILURE_OF_THE_BRAKE_CHOPPER = 0x7111 => "failure of the brake chopper",
        /// Over-current of the brake chopper.
        OVER_CURRENT_OF_THE_BRAKE_CHOPPER = 0x7112 => "over-current of the brake chopper",
        /// Protective circuit of the brake chopper.
        PROTECTIVE_CIRCUIT_OF_THE_BRAKE_CHOPPER = 0x7113 => "protective circuit of the brake chopper",
        /// Motor.
        MOTOR = 0x7120 => "motor",
        /// Motor blocked.
        MOTOR_BLOCKED = 0x7121 => "motor blocked",
        /// Motor error or commutation malfunction.
        MOTOR_COMMUTATION = 0x7122 => "motor error or commutation malfunction",
        /// Motor tilted.
        MOTOR_TILTED = 0x7123 => "motor tilted",
        /// Measurement circuit.
        MEASUREMENT_CIRCUIT = 0x7200 => "measurement circuit",
        /// Sensor.
        SENSOR = 0x7300 => "sensor",
        /// Tacho fault.
        TACHO_FAULT = 0x7301 => "tacho fault",
        /// Tacho wrong polarity.
        TACHO_WRONG_POLARITY = 0x7302 => "tacho wrong polarity",
        /// Resolver 1 fault.
        RESOLVER_1_FAULT = 0x7303 => "resolver 1 fault",
        /// Resolver 2 fault.
        RESOLVER_2_FAULT = 0x7304 => "resolver 2 fault",
        /// Incremental sensor 1 fault.
        INCREMENTAL_SENSOR_1_FAULT = 0x7305 => "incremental sensor 1 fault",
        /// Incremental sensor 2 fault.
        INCREMENTAL_SENSOR_2_FAULT = 0x7306 => "incremental sensor 2 fault",
        /// Incremental sensor 3 fault.
        INCREMENTAL_SENSOR_3_FAULT = 0x7307 => "incremental sensor 3 fault",
        /// Speed.
        SPEED = 0x7310 => "speed",
        /// Position.
        POSITION = 0x7320 => "position",
        /// Computation circuit.
        COMPUTATION_CIRCUIT = 0x7400 => "computation circuit",
        /// Communication of additional modules.
        COMMUNICATION_MODULE = 0x7500 => "communication of additional modules",
        /// Serial interface 1.
        SERIAL_INTERFACE_1 = 0x7510 => "serial interface 1",
        /// Serial interface 2.
        SERIAL_INTERFACE_2 = 0x7520 => "serial interface 2",
        /// Data storage of additional modules.
        DATA_STORAGE_OF_ADDITIONAL_MODULES = 0x7600 => "data storage of additional modules",
        /// CAN overrun: objects lost.
        CAN_OVERRUN = 0x8110 => "CAN overrun: objects lost",
        /// CAN in error passive mode.
        CAN_IN_ERROR_PASSIVE_MODE = 0x8120 => "CAN in error passive mode",
        /// Life guard or heartbeat error.
        HEARTBEAT = 0x8130 => "life guard or heartbeat error",
        /// Recovered from bus-off.
        RECOVERED_FROM_BUS_OFF = 0x8140 => "recovered from bus-off",
        /// CAN-ID collision.
        IDENTIFIER_COLLISION = 0x8150 => "CAN-ID collision",
        /// PDO not processed: too short.
        PDO_TOO_SHORT = 0x8210 => "PDO not processed: too short",
        /// PDO too long.
        PDO_TOO_LONG = 0x8220 => "PDO too long",
        /// Multiplexed PDO not processed: no such object.
        MULTIPLEXED_PDO_NOT_PROCESSED_NO_SUCH_OBJECT = 0x8230 => "multiplexed PDO not processed: no such object",
        /// Unexpected length of SYNC.
        SYNC_LENGTH = 0x8240 => "unexpected length of SYNC",
        /// RPDO time-out.
        RPDO_TIME_OUT = 0x8250 => "RPDO time-out",
        /// Torque control.
        TORQUE_CONTROL = 0x8300 => "torque control",
        /// Excess torque.
        EXCESS_TORQUE = 0x8311 => "excess torque",
        /// Difficult start-up.
        DIFFICULT_START_UP = 0x8312 => "difficult start-up",
        /// Standstill torque.
        STANDSTILL_TORQUE = 0x8313 => "standstill torque",
        /// Insufficient torque.
        INSUFFICIENT_TORQUE = 0x8321 => "insufficient torque",
        /// Torque fault.
        TORQUE_FAULT = 0x8331 => "torque fault",
        /// Velocity controller.
        VELOCITY_CONTROLLER = 0x8400 => "velocity controller",
        /// Position controller.
        POSITION_CONTROLLER = 0x8500 => "position controller",
        /// Positioning controller.
        POSITIONING_CONTROLLER = 0x8600 => "positioning controller",
        /// Following error.
        FOLLOWING_ERROR = 0x8611 => "following error",
        /// Reference limit.
        REFERENCE_LIMIT = 0x8612 => "reference limit",
        /// Sync controller.
        SYNC_CONTROLLER = 0x8700 => "sync controller",
        /// Winding controller.
        WINDING_CONTROLLER = 0x8800 => "winding controller",
        /// Process data monitoring.
        PROCESS_DATA_MONITORING = 0x8900 => "process data monitoring",
        /// External error.
        EXTERNAL = 0x9000 => "external error",
        /// Deceleration.
        DECELERATION = 0xF001 => "deceleration",
        /// Sub-synchronous run.
        SUB_SYNCHRONOUS_RUN = 0xF002 => "sub-synchronous run",
        /// Stroke operation.
        STROKE_OPERATION = 0xF003 => "stroke operation",
        /// Control.
        CONTROL = 0xF004 => "control",
    }
}

open_code! {
    /// State that `switch state global` brings about.
    pub struct LssMode(u8) {
        /// Waiting.
        WAITING = 0 => "waiting",
        /// Configuration.
        CONFIGURATION = 1 => "configuration",
    }
}

open_code! {
    /// Error code in answers to 11 (node-id) and 13 (bit timing), and to 17 (store).
    pub struct LssError(u8) {
        /// Ok.
        OK = 0 => "ok",
        /// Out of range or not supported: node-id out of range, bit rate not supported, or storing not supported.
        REFUSED = 1 => "out of range or not supported",
        /// Storage error: the memory cannot be written.
        STORAGE = 2 => "storage error",
        /// Manufacturer error: a code of the manufacturer follows.
        MANUFACTURER = 255 => "manufacturer error",
    }
}

open_code! {
    /// Entry of table 0 of bit rates.
    pub struct BitTiming(u8) {
        /// 1000 kbit/s.
        K1000 = 0 => "1000 kbit/s",
        /// 800 kbit/s.
        K800 = 1 => "800 kbit/s",
        /// 500 kbit/s.
        K500 = 2 => "500 kbit/s",
        /// 250 kbit/s.
        K250 = 3 => "250 kbit/s",
        /// 125 kbit/s.
        K125 = 4 => "125 kbit/s",
        /// 50 kbit/s.
        K50 = 6 => "50 kbit/s",
        /// 20 kbit/s.
        K20 = 7 => "20 kbit/s",
        /// 10 kbit/s.
        K10 = 8 => "10 kbit/s",
        /// Automatic: the device finds it by itself.
        AUTO = 9 => "automatic",
    }
}
