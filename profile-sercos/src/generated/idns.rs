//! Parameters and procedure commands of SERCOS.
//!
//! Generated from `sercos-idns.toml` and `sercos-communication.toml` in `mappings/tables/dictionary`: change the table, not this file, and run
//! `cargo run -p mappings --example generate`.

use crate::wire::idn::Idn;

impl Idn {
    /// S-0-0011: Class 1 diagnostic (C1D).
    pub const CLASS_1_DIAGNOSTIC: Idn = Idn::standard(11);
    /// S-0-0012: Class 2 diagnostic (C2D).
    pub const CLASS_2_DIAGNOSTIC: Idn = Idn::standard(12);
    /// S-0-0013: Class 3 diagnostic (C3D).
    pub const CLASS_3_DIAGNOSTIC: Idn = Idn::standard(13);
    /// S-0-0014: Interface status.
    pub const INTERFACE_STATUS: Idn = Idn::standard(14);
    /// S-0-0017: IDN-list of all operation data.
    pub const IDN_LIST_OF_ALL_OPERATION_DATA: Idn = Idn::standard(17);
    /// S-0-0021: IDN-list of invalid operation data for CP2.
    pub const INVALID_CP2: Idn = Idn::standard(21);
    /// S-0-0022: IDN-list of invalid operation data for CP3.
    pub const INVALID_CP3: Idn = Idn::standard(22);
    /// S-0-0025: IDN-list of all procedure commands.
    pub const IDN_LIST_OF_ALL_PROCEDURE_COMMANDS: Idn = Idn::standard(25);
    /// S-0-0030: Manufacturer version.
    pub const MANUFACTURER_VERSION: Idn = Idn::standard(30);
    /// S-0-0032: Primary operation mode.
    pub const PRIMARY_OPERATION_MODE: Idn = Idn::standard(32);
    /// S-0-0036: Velocity command value.
    pub const VELOCITY_COMMAND: Idn = Idn::standard(36);
    /// S-0-0037: Additive velocity command value.
    pub const ADDITIVE_VELOCITY_COMMAND: Idn = Idn::standard(37);
    /// S-0-0040: Velocity feedback value 1.
    pub const VELOCITY_FEEDBACK_VALUE_1: Idn = Idn::standard(40);
    /// S-0-0041: Homing velocity.
    pub const HOMING_VELOCITY: Idn = Idn::standard(41);
    /// S-0-0042: Homing acceleration.
    pub const HOMING_ACCELERATION: Idn = Idn::standard(42);
    /// S-0-0043: Velocity polarity parameter.
    pub const VELOCITY_POLARITY_PARAMETER: Idn = Idn::standard(43);
    /// S-0-0044: Velocity data scaling type.
    pub const VELOCITY_DATA_SCALING_TYPE: Idn = Idn::standard(44);
    /// S-0-0045: Velocity data scaling factor.
    pub const VELOCITY_DATA_SCALING_FACTOR: Idn = Idn::standard(45);
    /// S-0-0046: Velocity data scaling exponent.
    pub const VELOCITY_DATA_SCALING_EXPONENT: Idn = Idn::standard(46);
    /// S-0-0047: Position command value.
    pub const POSITION_COMMAND: Idn = Idn::standard(47);
    /// S-0-0048: Additive position command value.
    pub const ADDITIVE_POSITION_COMMAND: Idn = Idn::standard(48);
    /// S-0-0049: Positive position limit value.
    pub const POSITIVE_POSITION_LIMIT: Idn = Idn::standard(49);
    /// S-0-0050: Negative position limit value.
    pub const NEGATIVE_POSITION_LIMIT: Idn = Idn::standard(50);
    /// S-0-0051: Position feedback value 1 (motor feedback).
    pub const POSITION_FEEDBACK_VALUE_1: Idn = Idn::standard(51);
    /// S-0-0052: Reference distance 1.
    pub const REFERENCE_DISTANCE_1: Idn = Idn::standard(52);
    /// S-0-0053: Position feedback value 2 (external feedback).
    pub const POSITION_FEEDBACK_VALUE_2: Idn = Idn::standard(53);
    /// S-0-0055: Position polarity parameters.
    pub const POSITION_POLARITY_PARAMETERS: Idn = Idn::standard(55);
    /// S-0-0057: Position window.
    pub const POSITION_WINDOW: Idn = Idn::standard(57);
    /// S-0-0076: Position data scaling type.
    pub const POSITION_DATA_SCALING_TYPE: Idn = Idn::standard(76);
    /// S-0-0077: Linear position data scaling factor.
    pub const LINEAR_POSITION_DATA_SCALING_FACTOR: Idn = Idn::standard(77);
    /// S-0-0078: Linear position data scaling exponent.
    pub const LINEAR_POSITION_DATA_SCALING_EXPONENT: Idn = Idn::standard(78);
    /// S-0-0079: Rotational position resolution.
    pub const ROTATIONAL_POSITION_RESOLUTION: Idn = Idn::standard(79);
    /// S-0-0080: Torque command value.
    pub const TORQUE_COMMAND: Idn = Idn::standard(80);
    /// S-0-0081: Additive torque command value.
    pub const ADDITIVE_TORQUE_COMMAND: Idn = Idn::standard(81);
    /// S-0-0082: Positive torque limit value.
    pub const POSITIVE_TORQUE_LIMIT: Idn = Idn::standard(82);
    /// S-0-0083: Negative torque limit value.
    pub const NEGATIVE_TORQUE_LIMIT: Idn = Idn::standard(83);
    /// S-0-0084: Torque feedback value.
    pub const TORQUE_FEEDBACK: Idn = Idn::standard(84);
    /// S-0-0085: Torque polarity parameter.
    pub const TORQUE_POLARITY_PARAMETER: Idn = Idn::standard(85);
    /// S-0-0086: Torque/force data scaling type.
    pub const TORQUE_FORCE_DATA_SCALING_TYPE: Idn = Idn::standard(86);
    /// S-0-0091: Bipolar velocity limit value.
    pub const BIPOLAR_VELOCITY_LIMIT: Idn = Idn::standard(91);
    /// S-0-0092: Bipolar torque limit value.
    pub const BIPOLAR_TORQUE_LIMIT: Idn = Idn::standard(92);
    /// S-0-0093: Torque/force data scaling factor.
    pub const TORQUE_FORCE_DATA_SCALING_FACTOR: Idn = Idn::standard(93);
    /// S-0-0094: Torque/force data scaling exponent.
    pub const TORQUE_FORCE_DATA_SCALING_EXPONENT: Idn = Idn::standard(94);
    /// S-0-0095: Diagnostic message.
    pub const DIAGNOSTIC_MESSAGE: Idn = Idn::standard(95);
    /// S-0-0099: Reset class 1 diagnostic.
    pub const RESET_C1D: Idn = Idn::standard(99);
    /// S-0-0103: Modulo value.
    pub const MODULO: Idn = Idn::standard(103);
    /// S-0-0104: Position loop K_V-factor, 1000/min.
    pub const POSITION_LOOP_KV: Idn = Idn::standard(104);
    /// S-0-0108: Feedrate override, %.
    pub const FEEDRATE_OVERRIDE: Idn = Idn::standard(108);
    /// S-0-0121: Input revolutions of load gear, Rev.
    pub const INPUT_REVOLUTIONS_OF_LOAD_GEAR: Idn = Idn::standard(121);
    /// S-0-0122: Output revolutions of load gear, Rev.
    pub const OUTPUT_REVOLUTIONS_OF_LOAD_GEAR: Idn = Idn::standard(122);
    /// S-0-0123: Feed constant, mm/Rev.
    pub const FEED_CONSTANT: Idn = Idn::standard(123);
    /// S-0-0124: Standstill window.
    pub const STANDSTILL_WINDOW: Idn = Idn::standard(124);
    /// S-0-0125: Velocity threshold (n_x).
    pub const VELOCITY_THRESHOLD: Idn = Idn::standard(125);
    /// S-0-0126: Torque threshold (T_x).
    pub const TORQUE_THRESHOLD: Idn = Idn::standard(126);
    /// S-0-0127: Communication phase 3 transition check.
    pub const CP3_CHECK: Idn = Idn::standard(127);
    /// S-0-0128: Communication phase 4 transition check.
    pub const CP4_CHECK: Idn = Idn::standard(128);
    /// S-0-0129: Manufacturer class 1 diagnostic.
    pub const MANUFACTURER_CLASS_1_DIAGNOSTIC: Idn = Idn::standard(129);
    /// S-0-0130: Probe value 1 positive edge.
    pub const PROBE_VALUE_1_POSITIVE_EDGE: Idn = Idn::standard(130);
    /// S-0-0131: Probe value 1 negative edge.
    pub const PROBE_VALUE_1_NEGATIVE_EDGE: Idn = Idn::standard(131);
    /// S-0-0132: Probe value 2 positive edge.
    pub const PROBE_VALUE_2_POSITIVE_EDGE: Idn = Idn::standard(132);
    /// S-0-0133: Probe value 2 negative edge.
    pub const PROBE_VALUE_2_NEGATIVE_EDGE: Idn = Idn::standard(133);
    /// S-0-0134: Drive control (Master control word).
    pub const DRIVE_CONTROL: Idn = Idn::standard(134);
    /// S-0-0135: Drive status word.
    pub const DRIVE_STATUS: Idn = Idn::standard(135);
    /// S-0-0136: Acceleration limit value.
    pub const ACCELERATION_LIMIT: Idn = Idn::standard(136);
    /// S-0-0137: Deceleration limit value.
    pub const DECELERATION_LIMIT: Idn = Idn::standard(137);
    /// S-0-0138: Bipolar acceleration limit value.
    pub const BIPOLAR_ACCELERATION_LIMIT: Idn = Idn::standard(138);
    /// S-0-0140: Controller type.
    pub const CONTROLLER_TYPE: Idn = Idn::standard(140);
    /// S-0-0141: Motor type.
    pub const MOTOR_TYPE: Idn = Idn::standard(141);
    /// S-0-0146: Control unit controlled homing procedure command.
    pub const CONTROL_UNIT_CONTROLLED_HOMING: Idn = Idn::standard(146);
    /// S-0-0147: Homing parameter.
    pub const HOMING_PARAMETER: Idn = Idn::standard(147);
    /// S-0-0148: Drive controlled homing procedure command.
    pub const DRIVE_CONTROLLED_HOMING: Idn = Idn::standard(148);
    /// S-0-0150: Reference offset 1.
    pub const REFERENCE_OFFSET_1: Idn = Idn::standard(150);
    /// S-0-0159: Monitoring window.
    pub const MONITORING_WINDOW: Idn = Idn::standard(159);
    /// S-0-0160: Acceleration data scaling type.
    pub const ACCELERATION_DATA_SCALING_TYPE: Idn = Idn::standard(160);
    /// S-0-0161: Acceleration data scaling factor.
    pub const ACCELERATION_DATA_SCALING_FACTOR: Idn = Idn::standard(161);
    /// S-0-0162: Acceleration data scaling exponent.
    pub const ACCELERATION_DATA_SCALING_EXPONENT: Idn = Idn::standard(162);
    /// S-0-0169: Probe control parameter.
    pub const PROBE_CONTROL_PARAMETER: Idn = Idn::standard(169);
    /// S-0-0170: Probing cycle procedure command.
    pub const PROBING_CYCLE: Idn = Idn::standard(170);
    /// S-0-0171: Calculate displacement procedure command.
    pub const CALCULATE_DISPLACEMENT: Idn = Idn::standard(171);
    /// S-0-0172: Displacement to the referenced system procedure command.
    pub const DISPLACEMENT_TO_THE_REFERENCED_SYSTEM: Idn = Idn::standard(172);
    /// S-0-0173: Marker position A.
    pub const MARKER_POSITION_A: Idn = Idn::standard(173);
    /// S-0-0175: Displacement parameter 1.
    pub const DISPLACEMENT_PARAMETER_1: Idn = Idn::standard(175);
    /// S-0-0179: Probe status.
    pub const PROBE_STATUS: Idn = Idn::standard(179);
    /// S-0-0187: List of configurable data in the AT.
    pub const LIST_OF_CONFIGURABLE_DATA_IN_THE_AT: Idn = Idn::standard(187);
    /// S-0-0188: List of configurable data in the MDT.
    pub const LIST_OF_CONFIGURABLE_DATA_IN_THE_MDT: Idn = Idn::standard(188);
    /// S-0-0189: Following distance.
    pub const FOLLOWING_DISTANCE: Idn = Idn::standard(189);
    /// S-0-0191: Cancel reference point procedure command.
    pub const CANCEL_REFERENCE_POINT: Idn = Idn::standard(191);
    /// S-0-0192: IDN-list of all backup operation data.
    pub const IDN_LIST_OF_ALL_BACKUP_OPERATION_DATA: Idn = Idn::standard(192);
    /// S-0-0206: Drive on delay time, ms.
    pub const DRIVE_ON_DELAY_TIME: Idn = Idn::standard(206);
    /// S-0-0207: Drive off delay time, ms.
    pub const DRIVE_OFF_DELAY_TIME: Idn = Idn::standard(207);
    /// S-0-0208: Temperature data scaling type.
    pub const TEMPERATURE_DATA_SCALING_TYPE: Idn = Idn::standard(208);
    /// S-0-0258: Target position.
    pub const TARGET_POSITION: Idn = Idn::standard(258);
    /// S-0-0259: Positioning velocity.
    pub const POSITIONING_VELOCITY: Idn = Idn::standard(259);
    /// S-0-0260: Positioning acceleration.
    pub const POSITIONING_ACCELERATION: Idn = Idn::standard(260);
    /// S-0-0292: List of supported operation modes.
    pub const OPERATION_MODES: Idn = Idn::standard(292);
    /// S-0-0296: Velocity feed forward gain.
    pub const VELOCITY_FEED_FORWARD_GAIN: Idn = Idn::standard(296);
    /// S-0-0359: Positioning deceleration.
    pub const POSITIONING_DECELERATION: Idn = Idn::standard(359);
    /// S-0-0380: DC bus voltage, V.
    pub const DC_BUS_VOLTAGE: Idn = Idn::standard(380);
    /// S-0-0383: Motor temperature.
    pub const MOTOR_TEMPERATURE: Idn = Idn::standard(383);
    /// S-0-0384: Amplifier temperature.
    pub const AMPLIFIER_TEMPERATURE: Idn = Idn::standard(384);
    /// S-0-0386: Active position feedback value.
    pub const ACTIVE_POSITION_FEEDBACK: Idn = Idn::standard(386);
    /// S-0-0390: Diagnostic number.
    pub const DIAGNOSTIC_NUMBER: Idn = Idn::standard(390);
    /// S-0-0400: Home switch.
    pub const HOME_SWITCH: Idn = Idn::standard(400);
    /// S-0-0401: Probe 1.
    pub const PROBE_1: Idn = Idn::standard(401);
    /// S-0-0402: Probe 2.
    pub const PROBE_2: Idn = Idn::standard(402);
    /// S-0-0403: Position feedback value status.
    pub const POSITION_FEEDBACK_VALUE_STATUS: Idn = Idn::standard(403);
    /// S-0-0405: Probe 1 enable.
    pub const PROBE_1_ENABLE: Idn = Idn::standard(405);
    /// S-0-0406: Probe 2 enable.
    pub const PROBE_2_ENABLE: Idn = Idn::standard(406);
    /// S-0-0408: Reference marker pulse registered.
    pub const REFERENCE_MARKER_PULSE_REGISTERED: Idn = Idn::standard(408);
    /// S-0-0409: Probe 1 positive latched.
    pub const PROBE_1_POSITIVE_LATCHED: Idn = Idn::standard(409);
    /// S-0-0410: Probe 1 negative latched.
    pub const PROBE_1_NEGATIVE_LATCHED: Idn = Idn::standard(410);
    /// S-0-0411: Probe 2 positive latched.
    pub const PROBE_2_POSITIVE_LATCHED: Idn = Idn::standard(411);
    /// S-0-0412: Probe 2 negative latched.
    pub const PROBE_2_NEGATIVE_LATCHED: Idn = Idn::standard(412);
    /// S-0-0440: Marker position feedback 1.
    pub const MARKER_POSITION_FEEDBACK_1: Idn = Idn::standard(440);
    /// S-0-0442: Counter marker position feedback 1.
    pub const COUNTER_MARKER_POSITION_FEEDBACK_1: Idn = Idn::standard(442);
    /// S-0-0447: Set absolute position procedure command.
    pub const SET_ABSOLUTE_POSITION: Idn = Idn::standard(447);
    /// S-0-1000: List of SCP classes.
    pub const SCP_CLASSES: Idn = Idn::standard(1000);
    /// S-0-1000.0.1: List of active SCP classes.
    pub const SCP_ACTIVE: Idn = Idn::structured(1000, 0, 1);
    /// S-0-1002: Communication cycle time, ns.
    pub const CYCLE_TIME: Idn = Idn::standard(1002);
    /// S-0-1003: Allowed MST losses in CP3 and CP4.
    pub const MST_LOSSES: Idn = Idn::standard(1003);
    /// S-0-1005: Minimum feedback processing time, ns.
    pub const FEEDBACK_TIME: Idn = Idn::standard(1005);
    /// S-0-1006: AT0 transmission starting time, ns.
    pub const AT_START: Idn = Idn::standard(1006);
    /// S-0-1007: Synchronization time, ns.
    pub const SYNC_TIME: Idn = Idn::standard(1007);
    /// S-0-1008: Command value valid time, ns.
    pub const COMMAND_VALID: Idn = Idn::standard(1008);
    /// S-0-1009: Device control offset in MDT.
    pub const CONTROL_OFFSET: Idn = Idn::standard(1009);
    /// S-0-1010: Lengths of MDTs, bytes.
    pub const MDT_LENGTHS: Idn = Idn::standard(1010);
    /// S-0-1011: Device status offset in AT.
    pub const STATUS_OFFSET: Idn = Idn::standard(1011);
    /// S-0-1012: Lengths of ATs, bytes.
    pub const AT_LENGTHS: Idn = Idn::standard(1012);
    /// S-0-1013: Service channel offset in MDT.
    pub const SVC_MDT_OFFSET: Idn = Idn::standard(1013);
    /// S-0-1014: Service channel offset in AT.
    pub const SVC_AT_OFFSET: Idn = Idn::standard(1014);
    /// S-0-1015: Ring delay, ns.
    pub const RING_DELAY: Idn = Idn::standard(1015);
    /// S-0-1017: UC channel transmission time, ns.
    pub const UC_TIMES: Idn = Idn::standard(1017);
    /// S-0-1023: Synchronization jitter, ns.
    pub const SYNC_JITTER: Idn = Idn::standard(1023);
    /// S-0-1024: Synchronization delay measuring procedure command.
    pub const DELAY_MEASURING: Idn = Idn::standard(1024);
    /// S-0-1026: Hardware version.
    pub const HARDWARE_VERSION: Idn = Idn::standard(1026);
    /// S-0-1027.0.1: Requested MTU, bytes.
    pub const MTU_REQUESTED: Idn = Idn::structured(1027, 0, 1);
    /// S-0-1027.0.2: Effective MTU, bytes.
    pub const MTU_EFFECTIVE: Idn = Idn::structured(1027, 0, 2);
    /// S-0-1028: MST error counter.
    pub const MST_ERROR_COUNTER: Idn = Idn::standard(1028);
    /// S-0-1032: Communication control.
    pub const COMMUNICATION_CONTROL: Idn = Idn::standard(1032);
    /// S-0-1035: Error counter port 1 and port 2.
    pub const ERROR_COUNTER_PORT_1_AND_PORT_2: Idn = Idn::standard(1035);
    /// S-0-1036: Inter frame gap, bytes.
    pub const INTER_FRAME_GAP: Idn = Idn::standard(1036);
    /// S-0-1037: Slave jitter, ns.
    pub const SLAVE_JITTER: Idn = Idn::standard(1037);
    /// S-0-1040: SERCOS address.
    pub const ADDRESS: Idn = Idn::standard(1040);
    /// S-0-1044: Device control (C-DEV).
    pub const DEVICE_CONTROL: Idn = Idn::standard(1044);
    /// S-0-1045: Device status (S-DEV).
    pub const DEVICE_STATUS: Idn = Idn::standard(1045);
    /// S-0-1046: List of SERCOS addresses in device.
    pub const LIST_OF_SERCOS_ADDRESSES_IN_DEVICE: Idn = Idn::standard(1046);
    /// S-0-1047: Maximum consumer activation time, ns.
    pub const CONSUMER_TIME: Idn = Idn::standard(1047);
    /// S-0-1051: Image of connection setups.
    pub const CONNECTION_IMAGE: Idn = Idn::standard(1051);
    /// S-0-1061: Maximum TSref counter.
    pub const TSREF_MAX: Idn = Idn::standard(1061);
    /// S-0-1300.x.2: Vendor name.
    pub const VENDOR_NAME: Idn = Idn::structured(1300, 0, 2);
    /// S-0-1300.x.3: Vendor code.
    pub const VENDOR_CODE: Idn = Idn::structured(1300, 0, 3);
    /// S-0-1300.x.4: Device name.
    pub const DEVICE_NAME: Idn = Idn::structured(1300, 0, 4);
    /// S-0-1300.x.5: Device ID.
    pub const DEVICE_ID: Idn = Idn::structured(1300, 0, 5);
    /// S-0-1300.x.8: Hardware revision.
    pub const HARDWARE_REVISION: Idn = Idn::structured(1300, 0, 8);
    /// S-0-1300.x.9: Software revision.
    pub const SOFTWARE_REVISION: Idn = Idn::structured(1300, 0, 9);
    /// S-0-1300.x.12: Serial number.
    pub const SERIAL_NUMBER: Idn = Idn::structured(1300, 0, 12);
    /// S-0-1302.x.1: FSP type.
    pub const FSP_TYPE: Idn = Idn::structured(1302, 0, 1);
}

/// Elements of S-0-1050.x.
pub mod connection {
    /// Connection setup.
    pub const SETUP: u8 = 1;
    /// Connection number.
    pub const NUMBER: u8 = 2;
    /// Telegram assignment.
    pub const ASSIGNMENT: u8 = 3;
    /// Maximum length of connection.
    pub const LENGTH_MAX: u8 = 4;
    /// Current length of connection.
    pub const LENGTH: u8 = 5;
    /// Configuration list.
    pub const LIST: u8 = 6;
    /// Current connection control (C-CON).
    pub const CONTROL: u8 = 8;
    /// Producer cycle time.
    pub const CYCLE: u8 = 10;
    /// Allowed data losses.
    pub const LOSSES_MAX: u8 = 11;
    /// Error counter data losses.
    pub const LOSSES: u8 = 12;
}
