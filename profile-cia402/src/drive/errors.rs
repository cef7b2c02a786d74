//! Error codes: object 603Fh, and the first two bytes of an emergency message.
//!
//! Sources: openCANopen `cia402-error-codes.h` and Beckhoff's servo sample, which agree; CANopenNode for 81xx and 82xx.

use profile_generic::open_code;

open_code! {
    /// An error code. FF00h to FFFFh are of the manufacturer.
    pub struct ErrorCode(u16) {
        /// No error.
        NO_ERROR = 0x0000 => "no error",
        /// Generic error.
        GENERIC = 0x1000 => "generic error",
        /// Short circuit or earth leakage, input.
        INPUT_SHORT_CIRCUIT_OR_EARTH_LEAKAGE = 0x2110 => "short circuit or earth leakage, input",
        /// Earth leakage, input.
        INPUT_EARTH_LEAKAGE = 0x2120 => "earth leakage, input",
        /// Earth leakage, phase L1.
        INPUT_EARTH_LEAKAGE_L1 = 0x2121 => "earth leakage, phase L1",
        /// Earth leakage, phase L2.
        INPUT_EARTH_LEAKAGE_L2 = 0x2122 => "earth leakage, phase L2",
        /// Earth leakage, phase L3.
        INPUT_EARTH_LEAKAGE_L3 = 0x2123 => "earth leakage, phase L3",
        /// Short circuit, input.
        INPUT_SHORT_CIRCUIT = 0x2130 => "short circuit, input",
        /// Short circuit, phases L1 and L2.
        INPUT_SHORT_CIRCUIT_L1_L2 = 0x2131 => "short circuit, phases L1 and L2",
        /// Short circuit, phases L2 and L3.
        INPUT_SHORT_CIRCUIT_L2_L3 = 0x2132 => "short circuit, phases L2 and L3",
        /// Short circuit, phases L3 and L1.
        INPUT_SHORT_CIRCUIT_L3_L1 = 0x2133 => "short circuit, phases L3 and L1",
        /// Internal current no. 1.
        INTERNAL_CURRENT_1 = 0x2211 => "internal current no. 1",
        /// Internal current no. 2.
        INTERNAL_CURRENT_2 = 0x2212 => "internal current no. 2",
        /// Over-current in the ramp function.
        OVER_CURRENT_IN_RAMP = 0x2213 => "over-current in the ramp function",
        /// Over-current in the sequence.
        OVER_CURRENT_IN_SEQUENCE = 0x2214 => "over-current in the sequence",
        /// Continuous over-current, inside the device.
        INTERNAL_CONTINUOUS_OVER_CURRENT = 0x2220 => "continuous over-current, inside the device",
        /// Continuous over-current no. 1, inside the device.
        INTERNAL_CONTINUOUS_OVER_CURRENT_1 = 0x2221 => "continuous over-current no. 1, inside the device",
        /// Continuous over-current no. 2, inside the device.
        INTERNAL_CONTINUOUS_OVER_CURRENT_2 = 0x2222 => "continuous over-current no. 2, inside the device",
        /// Short circuit or earth leakage, inside the device.
        INTERNAL_SHORT_CIRCUIT_OR_EARTH_LEAKAGE = 0x2230 => "short circuit or earth leakage, inside the device",
        /// Earth leakage, inside the device.
        INTERNAL_EARTH_LEAKAGE = 0x2240 => "earth leakage, inside the device",
        /// Short circuit, inside the device.
        INTERNAL_SHORT_CIRCUIT = 0x2250 => "short circuit, inside the device",
        /// Continuous over-current.
        CONTINUOUS_OVER_CURRENT = 0x2310 => "continuous over-current",
        /// Continuous over-current no. 1.
        CONTINUOUS_OVER_CURRENT_1 = 0x2311 => "continuous over-current no. 1",
        /// Continuous over-current no. 2.
        CONTINUOUS_OVER_CURRENT_2 = 0x2312 => "continuous over-current no. 2",
        /// Short circuit or earth leakage, motor side.
        SHORT_CIRCUIT_OR_EARTH_LEAKAGE = 0x2320 => "short circuit or earth leakage, motor side",
        /// Earth leakage, motor side.
        EARTH_LEAKAGE = 0x2330 => "earth leakage, motor side",
        /// Earth leakage, phase U.
        EARTH_LEAKAGE_U = 0x2331 => "earth leakage, phase U",
        /// Earth leakage, phase V.
        EARTH_LEAKAGE_V = 0x2332 => "earth leakage, phase V",
        /// Earth leakage, phase W.
        EARTH_LEAKAGE_W = 0x2333 => "earth leakage, phase W",
        /// Short circuit, motor side.
        SHORT_CIRCUIT = 0x2340 => "short circuit, motor side",
        /// Short circuit, phases U and V.
        SHORT_CIRCUIT_U_V = 0x2341 => "short circuit, phases U and V",
        /// Short circuit, phases V and W.
        SHORT_CIRCUIT_V_W = 0x2342 => "short circuit, phases V and W",
        /// Short circuit, phases W and U.
        SHORT_CIRCUIT_W_U = 0x2343 => "short circuit, phases W and U",
        /// Load level fault, I2t.
        LOAD_LEVEL_FAULT = 0x2350 => "load level fault, I2t",
        /// Load level warning, I2t.
        LOAD_LEVEL_WARNING = 0x2351 => "load level warning, I2t",
        /// Mains over-voltage.
        MAINS_OVER_VOLTAGE = 0x3110 => "mains over-voltage",
        /// Mains over-voltage, phase L1.
        MAINS_OVER_VOLTAGE_L1 = 0x3111 => "mains over-voltage, phase L1",
        /// Mains over-voltage, phase L2.
        MAINS_OVER_VOLTAGE_L2 = 0x3112 => "mains over-voltage, phase L2",
        /// Mains over-voltage, phase L3.
        MAINS_OVER_VOLTAGE_L3 = 0x3113 => "mains over-voltage, phase L3",
        /// Mains under-voltage.
        MAINS_UNDER_VOLTAGE = 0x3120 => "mains under-voltage",
        /// Mains under-voltage, phase L1.
        MAINS_UNDER_VOLTAGE_L1 = 0x3121 => "mains under-voltage, phase L1",
        /// Mains under-voltage, phase L2.
        MAINS_UNDER_VOLTAGE_L2 = 0x3122 => "mains under-voltage, phase L2",
        /// Mains under-voltage, phase L3.
        MAINS_UNDER_VOLTAGE_L3 = 0x3123 => "mains under-voltage, phase L3",
        /// Phase failure.
        PHASE_FAILURE = 0x3130 => "phase failure",
        /// Phase failure, L1.
        PHASE_FAILURE_L1 = 0x3131 => "phase failure, L1",
        /// Phase failure, L2.
        PHASE_FAILURE_L2 = 0x3132 => "phase failure, L2",
        /// Phase failure, L3.
        PHASE_FAILURE_L3 = 0x3133 => "phase failure, L3",
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
        /// DC link over-voltage no. 1.
        DC_LINK_OVER_VOLTAGE_1 = 0x3211 => "DC link over-voltage no. 1",
        /// DC link over-voltage no. 2.
        DC_LINK_OVER_VOLTAGE_2 = 0x3212 => "DC link over-voltage no. 2",
        /// DC link under-voltage.
        DC_LINK_UNDER_VOLTAGE = 0x3220 => "DC link under-voltage",
        /// DC link under-voltage no. 1.
        DC_LINK_UNDER_VOLTAGE_1 = 0x3221 => "DC link under-voltage no. 1",
        /// DC link under-voltage no. 2.
        DC_LINK_UNDER_VOLTAGE_2 = 0x3222 => "DC link under-voltage no. 2",
        /// Load error.
        LOAD_ERROR = 0x3230 => "load error",
        /// Output over-voltage.
        OUTPUT_OVER_VOLTAGE = 0x3310 => "output over-voltage",
        /// Output over-voltage, phase U.
        OUTPUT_OVER_VOLTAGE_U = 0x3311 => "output over-voltage, phase U",
        /// Output over-voltage, phase V.
        OUTPUT_OVER_VOLTAGE_V = 0x3312 => "output over-voltage, phase V",
        /// Output over-voltage, phase W.
        OUTPUT_OVER_VOLTAGE_W = 0x3313 => "output over-voltage, phase W",
        /// Armature circuit.
        ARMATURE_CIRCUIT = 0x3320 => "armature circuit",
        /// Armature circuit interrupted.
        ARMATURE_CIRCUIT_INTERRUPTED = 0x3321 => "armature circuit interrupted",
        /// Field circuit.
        FIELD_CIRCUIT = 0x3330 => "field circuit",
        /// Field circuit interrupted.
        FIELD_CIRCUIT_INTERRUPTED = 0x3331 => "field circuit interrupted",
        /// Ambient temperature too high.
        AMBIENT_TOO_HOT = 0x4110 => "ambient temperature too high",
        /// Ambient temperature too low.
        AMBIENT_TOO_COLD = 0x4120 => "ambient temperature too low",
        /// Temperature of the air intake.
        AIR_INTAKE_TEMPERATURE = 0x4130 => "temperature of the air intake",
        /// Temperature of the air outlet.
        AIR_OUTLET_TEMPERATURE = 0x4140 => "temperature of the air outlet",
        /// Device temperature too high.
        DEVICE_TOO_HOT = 0x4210 => "device temperature too high",
        /// Device temperature too low.
        DEVICE_TOO_COLD = 0x4220 => "device temperature too low",
        /// Drive temperature too high.
        DRIVE_TOO_HOT = 0x4310 => "drive temperature too high",
        /// Drive temperature too low.
        DRIVE_TOO_COLD = 0x4320 => "drive temperature too low",
        /// Supply temperature too high.
        SUPPLY_TOO_HOT = 0x4410 => "supply temperature too high",
        /// Supply temperature too low.
        SUPPLY_TOO_COLD = 0x4420 => "supply temperature too low",
        /// Supply.
        SUPPLY = 0x5100 => "supply",
        /// Supply, low voltage.
        SUPPLY_LOW_VOLTAGE = 0x5110 => "supply, low voltage",
        /// Supply, 15 V.
        SUPPLY_15_V = 0x5111 => "supply, 15 V",
        /// Supply, 24 V.
        SUPPLY_24_V = 0x5112 => "supply, 24 V",
        /// Supply, 5 V.
        SUPPLY_5_V = 0x5113 => "supply, 5 V",
        /// Supply, intermediate circuit.
        SUPPLY_INTERMEDIATE_CIRCUIT = 0x5120 => "supply, intermediate circuit",
        /// Control function.
        CONTROL = 0x5200 => "control",
        /// Control, measurement circuit.
        CONTROL_MEASUREMENT_CIRCUIT = 0x5210 => "control, measurement circuit",
        /// Control, computing circuit.
        CONTROL_COMPUTING_CIRCUIT = 0x5220 => "control, computing circuit",
        /// Operating unit.
        OPERATING_UNIT = 0x5300 => "operating unit",
        /// Power section.
        POWER_SECTION = 0x5400 => "power section",
        /// Power section, output stages.
        POWER_OUTPUT_STAGES = 0x5410 => "power section, output stages",
        /// Power section, chopper.
        POWER_CHOPPER = 0x5420 => "power section, chopper",
        /// Power section, input stages.
        POWER_INPUT_STAGES = 0x5430 => "power section, input stages",
        /// Power section, contacts.
        POWER_CONTACTS = 0x5440 => "power section, contacts",
        /// Power section, fuses.
        POWER_FUSES = 0x5450 => "power section, fuses",
        /// Memory, RAM.
        MEMORY_RAM = 0x5510 => "memory, RAM",
        /// Memory, ROM or EPROM.
        MEMORY_ROM = 0x5520 => "memory, ROM or EPROM",
        /// Memory, EEPROM.
        MEMORY_EEPROM = 0x5530 => "memory, EEPROM",
        /// Software reset, watchdog.
        SOFTWARE_WATCHDOG = 0x6010 => "software reset, watchdog",
        /// Loss of parameters.
        LOSS_OF_PARAMETERS = 0x6310 => "loss of parameters",
        /// Parameter error.
        PARAMETER_ERROR = 0x6320 => "parameter error",
        /// Brake chopper.
        BRAKE_CHOPPER = 0x7110 => "brake chopper",
        /// Brake chopper, failure.
        BRAKE_CHOPPER_FAILURE = 0x7111 => "brake chopper, failure",
        /// Brake chopper, over-current.
        BRAKE_CHOPPER_OVER_CURRENT = 0x7112 => "brake chopper, over-current",
        /// Brake chopper, protective circuit.
        BRAKE_CHOPPER_CIRCUIT = 0x7113 => "brake chopper, protective circuit",
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
        /// Tacho, wrong polarity.
        TACHO_WRONG_POLARITY = 0x7302 => "tacho, wrong polarity",
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
        SPEED_SENSOR = 0x7310 => "speed",
        /// Position.
        POSITION_SENSOR = 0x7320 => "position",
        /// Computation circuit.
        COMPUTATION_CIRCUIT = 0x7400 => "computation circuit",
        /// Communication.
        COMMUNICATION_MODULE = 0x7500 => "communication",
        /// Serial interface no. 1.
        SERIAL_INTERFACE_1 = 0x7510 => "serial interface no. 1",
        /// Serial interface no. 2.
        SERIAL_INTERFACE_2 = 0x7520 => "serial interface no. 2",
        /// Data storage.
        DATA_STORAGE = 0x7600 => "data storage",
        /// CAN overrun, objects lost.
        CAN_OVERRUN = 0x8110 => "CAN overrun, objects lost",
        /// CAN in error passive mode.
        CAN_ERROR_PASSIVE = 0x8120 => "CAN in error passive mode",
        /// Life guard or heartbeat error.
        HEARTBEAT = 0x8130 => "life guard or heartbeat error",
        /// Recovered from bus off.
        RECOVERED_FROM_BUS_OFF = 0x8140 => "recovered from bus off",
        /// Identifier collision.
        IDENTIFIER_COLLISION = 0x8150 => "identifier collision",
        /// PDO not processed, too short.
        PDO_TOO_SHORT = 0x8210 => "PDO not processed, too short",
        /// PDO length exceeded.
        PDO_TOO_LONG = 0x8220 => "PDO length exceeded",
        /// Unexpected SYNC data length.
        SYNC_LENGTH = 0x8240 => "unexpected SYNC data length",
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
        /// Control function.
        CONTROL_FUNCTION = 0xF004 => "control function",
    }
}

open_code! {
    /// What an error code is about: its first two digits, or the first one where no second one is known.
    pub struct ErrorClass(u8) {
        /// None.
        NONE = 0x00 => "no error",
        /// Generic.
        GENERIC = 0x10 => "generic",
        /// Current.
        CURRENT = 0x20 => "current",
        /// Current on the input side.
        CURRENT_INPUT = 0x21 => "current, input side",
        /// Current inside the device.
        CURRENT_INSIDE = 0x22 => "current, inside the device",
        /// Current on the output side.
        CURRENT_OUTPUT = 0x23 => "current, output side",
        /// Voltage.
        VOLTAGE = 0x30 => "voltage",
        /// Mains voltage.
        VOLTAGE_MAINS = 0x31 => "voltage, mains",
        /// Voltage inside the device: the DC link.
        VOLTAGE_INSIDE = 0x32 => "voltage, inside the device",
        /// Output voltage.
        VOLTAGE_OUTPUT = 0x33 => "voltage, output",
        /// Temperature.
        TEMPERATURE = 0x40 => "temperature",
        /// Ambient temperature.
        TEMPERATURE_AMBIENT = 0x41 => "temperature, ambient",
        /// Temperature of the device.
        TEMPERATURE_DEVICE = 0x42 => "temperature, device",
        /// Temperature of the drive.
        TEMPERATURE_DRIVE = 0x43 => "temperature, drive",
        /// Temperature of the supply.
        TEMPERATURE_SUPPLY = 0x44 => "temperature, supply",
        /// Hardware of the device.
        HARDWARE = 0x50 => "device hardware",
        /// Software of the device.
        SOFTWARE = 0x60 => "device software",
        /// Additional modules: brake chopper, motor, sensors.
        MODULES = 0x70 => "additional modules",
        /// Monitoring.
        MONITORING = 0x80 => "monitoring",
        /// Monitoring of the communication.
        COMMUNICATION = 0x81 => "monitoring, communication",
        /// Protocol error.
        PROTOCOL = 0x82 => "monitoring, protocol",
        /// Monitoring of torque, velocity, position and the like.
        CONTROL_LOOPS = 0x83 => "monitoring, control loops",
        /// External.
        EXTERNAL = 0x90 => "external",
        /// Additional functions.
        FUNCTIONS = 0xF0 => "additional functions",
        /// Of the manufacturer.
        MANUFACTURER = 0xFF => "manufacturer",
    }
}

impl ErrorCode {
    /// What it is about, also of a code without a name. A first digit that means nothing stays as it is.
    #[must_use]
    pub const fn class(self) -> ErrorClass {
        let [_, high] = self.0.to_le_bytes();
        ErrorClass(match high {
            0x21..=0x23 | 0x31..=0x33 | 0x41..=0x44 | 0x81 | 0x82 | 0xFF => high,
            0x83..=0x89 => 0x83,
            _ => high & 0xF0,
        })
    }

    /// Bits of the error register 1001h that a device sets for it: generic always, besides what it is about.
    #[must_use]
    pub const fn register(self) -> u8 {
        let [_, high] = self.0.to_le_bytes();
        let special = match (high >> 4, high) {
            (0, _) => return 0,
            (2, _) => 1 << 1,
            (3, _) => 1 << 2,
            (4, _) => 1 << 3,
            (_, 0x81 | 0x82) => 1 << 4,
            (5..=8, _) => 1 << 5,
            (_, 0xFF) => 1 << 7,
            _ => 0,
        };
        1 | special
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_there_once_and_in_order() {
        for pair in ErrorCode::NAMED.windows(2) {
            assert!(pair[0].0 < pair[1].0, "{:?} before {:?}", pair[0], pair[1]);
            assert_ne!(pair[0].1, pair[1].1);
        }
        for (code, name) in ErrorCode::NAMED {
            assert_eq!(ErrorCode::from_name(name), Some(*code), "{name} has two codes");
            assert!(code.class().name().is_some(), "{name} has no class");
        }
    }

    #[test]
    fn codes_tell_what_they_are_about() {
        let cases = [
            (0x0000, ErrorClass::NONE, 0x00),
            (0x2310, ErrorClass::CURRENT_OUTPUT, 0x03),
            (0x2FFF, ErrorClass::CURRENT, 0x03),
            (0x3220, ErrorClass::VOLTAGE_INSIDE, 0x05),
            (0x4310, ErrorClass::TEMPERATURE_DRIVE, 0x09),
            (0x6320, ErrorClass::SOFTWARE, 0x21),
            (0x7305, ErrorClass::MODULES, 0x21),
            (0x8130, ErrorClass::COMMUNICATION, 0x11),
            (0x8210, ErrorClass::PROTOCOL, 0x11),
            (0x8611, ErrorClass::CONTROL_LOOPS, 0x21),
            (0x9000, ErrorClass::EXTERNAL, 0x01),
            (0xFF01, ErrorClass::MANUFACTURER, 0x81),
        ];
        for (code, class, register) in cases {
            assert_eq!(
                (ErrorCode(code).class(), ErrorCode(code).register()),
                (class, register),
                "{code:04x}"
            );
        }
        for code in 0..=u16::MAX {
            assert_eq!(ErrorCode(code).register() & 1 != 0, code >= 0x1000);
        }
    }
}
