//! Indices of objects; those of CiA 402 are for the first axis of a device.
//!
//! Generated from `mappings/tables/dictionary/cia402-objects.toml`: change the table, not this file, and run
//! `cargo run -p mappings --example generate`.

/// Device type.
pub const DEVICE_TYPE: u16 = 0x1000;
/// Error register.
pub const ERROR_REGISTER: u16 = 0x1001;
/// Pre-defined error field.
pub const PRE_DEFINED_ERROR_FIELD: u16 = 0x1003;
/// COB-ID SYNC message.
pub const COB_ID_SYNC: u16 = 0x1005;
/// Communication cycle period.
pub const COMMUNICATION_CYCLE_PERIOD: u16 = 0x1006;
/// Synchronous window length.
pub const SYNCHRONOUS_WINDOW_LENGTH: u16 = 0x1007;
/// Manufacturer device name.
pub const MANUFACTURER_DEVICE_NAME: u16 = 0x1008;
/// Manufacturer hardware version.
pub const MANUFACTURER_HARDWARE_VERSION: u16 = 0x1009;
/// Manufacturer software version.
pub const MANUFACTURER_SOFTWARE_VERSION: u16 = 0x100A;
/// Guard time.
pub const GUARD_TIME: u16 = 0x100C;
/// Life time factor.
pub const LIFE_TIME_FACTOR: u16 = 0x100D;
/// Store parameters.
pub const STORE_PARAMETERS: u16 = 0x1010;
/// Restore default parameters.
pub const RESTORE_DEFAULT_PARAMETERS: u16 = 0x1011;
/// COB-ID time stamp message.
pub const COB_ID_TIME: u16 = 0x1012;
/// COB-ID emergency message.
pub const COB_ID_EMCY: u16 = 0x1014;
/// Inhibit time emergency message.
pub const INHIBIT_TIME_EMCY: u16 = 0x1015;
/// Consumer heartbeat time.
pub const CONSUMER_HEARTBEAT_TIME: u16 = 0x1016;
/// Producer heartbeat time.
pub const PRODUCER_HEARTBEAT_TIME: u16 = 0x1017;
/// Identity object.
pub const IDENTITY: u16 = 0x1018;
/// Synchronous counter overflow value.
pub const SYNC_OVERFLOW: u16 = 0x1019;
/// Verify configuration.
pub const VERIFY_CONFIGURATION: u16 = 0x1020;
/// Store EDS.
pub const STORE_EDS: u16 = 0x1021;
/// Error behavior.
pub const ERROR_BEHAVIOR: u16 = 0x1029;
/// SDO server parameter.
pub const SDO_SERVER_PARAMETER: u16 = 0x1200;
/// RPDO communication parameter.
pub const RPDO_COMMUNICATION: u16 = 0x1400;
/// RPDO mapping parameter.
pub const RPDO_MAPPING: u16 = 0x1600;
/// TPDO communication parameter.
pub const TPDO_COMMUNICATION: u16 = 0x1800;
/// TPDO mapping parameter.
pub const TPDO_MAPPING: u16 = 0x1A00;
/// Abort connection option code.
pub const ABORT_CONNECTION_OPTION: u16 = 0x6007;
/// Error code.
pub const ERROR_CODE: u16 = 0x603F;
/// Controlword.
pub const CONTROLWORD: u16 = 0x6040;
/// Statusword.
pub const STATUSWORD: u16 = 0x6041;
/// vl target velocity.
pub const VL_TARGET_VELOCITY: u16 = 0x6042;
/// vl velocity demand.
pub const VL_VELOCITY_DEMAND: u16 = 0x6043;
/// vl velocity actual value.
pub const VL_VELOCITY_ACTUAL: u16 = 0x6044;
/// vl velocity min max amount.
pub const VL_VELOCITY_LIMITS: u16 = 0x6046;
/// vl velocity acceleration.
pub const VL_ACCELERATION: u16 = 0x6048;
/// vl velocity deceleration.
pub const VL_DECELERATION: u16 = 0x6049;
/// vl velocity quick stop.
pub const VL_QUICK_STOP: u16 = 0x604A;
/// vl dimension factor.
pub const VL_DIMENSION_FACTOR: u16 = 0x604C;
/// Quick stop option code.
pub const QUICK_STOP_OPTION: u16 = 0x605A;
/// Shutdown option code.
pub const SHUTDOWN_OPTION: u16 = 0x605B;
/// Disable operation option code.
pub const DISABLE_OPTION: u16 = 0x605C;
/// Halt option code.
pub const HALT_OPTION: u16 = 0x605D;
/// Fault reaction option code.
pub const FAULT_REACTION_OPTION: u16 = 0x605E;
/// Modes of operation.
pub const MODE: u16 = 0x6060;
/// Modes of operation display.
pub const MODE_DISPLAY: u16 = 0x6061;
/// Position demand value.
pub const POSITION_DEMAND: u16 = 0x6062;
/// Position actual internal value.
pub const POSITION_INTERNAL: u16 = 0x6063;
/// Position actual value.
pub const POSITION_ACTUAL: u16 = 0x6064;
/// Following error window.
pub const FOLLOWING_WINDOW: u16 = 0x6065;
/// Following error time out.
pub const FOLLOWING_TIME_OUT: u16 = 0x6066;
/// Position window.
pub const POSITION_WINDOW: u16 = 0x6067;
/// Position window time.
pub const POSITION_WINDOW_TIME: u16 = 0x6068;
/// Velocity sensor actual value.
pub const VELOCITY_SENSOR: u16 = 0x6069;
/// Velocity demand value.
pub const VELOCITY_DEMAND: u16 = 0x606B;
/// Velocity actual value.
pub const VELOCITY_ACTUAL: u16 = 0x606C;
/// Velocity window.
pub const VELOCITY_WINDOW: u16 = 0x606D;
/// Velocity window time.
pub const VELOCITY_WINDOW_TIME: u16 = 0x606E;
/// Velocity threshold.
pub const VELOCITY_THRESHOLD: u16 = 0x606F;
/// Velocity threshold time.
pub const VELOCITY_THRESHOLD_TIME: u16 = 0x6070;
/// Target torque.
pub const TARGET_TORQUE: u16 = 0x6071;
/// Max torque.
pub const MAX_TORQUE: u16 = 0x6072;
/// Max current.
pub const MAX_CURRENT: u16 = 0x6073;
/// Torque demand.
pub const TORQUE_DEMAND: u16 = 0x6074;
/// Motor rated current.
pub const RATED_CURRENT: u16 = 0x6075;
/// Motor rated torque.
pub const RATED_TORQUE: u16 = 0x6076;
/// Torque actual value.
pub const TORQUE_ACTUAL: u16 = 0x6077;
/// Current actual value.
pub const CURRENT_ACTUAL: u16 = 0x6078;
/// DC link circuit voltage.
pub const DC_LINK_VOLTAGE: u16 = 0x6079;
/// Target position.
pub const TARGET_POSITION: u16 = 0x607A;
/// Position range limit.
pub const RANGE_LIMIT: u16 = 0x607B;
/// Home offset.
pub const HOME_OFFSET: u16 = 0x607C;
/// Software position limit.
pub const SOFTWARE_LIMIT: u16 = 0x607D;
/// Polarity.
pub const POLARITY: u16 = 0x607E;
/// Max profile velocity.
pub const MAX_PROFILE_VELOCITY: u16 = 0x607F;
/// Max motor speed.
pub const MAX_MOTOR_SPEED: u16 = 0x6080;
/// Profile velocity.
pub const PROFILE_VELOCITY: u16 = 0x6081;
/// End velocity.
pub const END_VELOCITY: u16 = 0x6082;
/// Profile acceleration.
pub const PROFILE_ACCELERATION: u16 = 0x6083;
/// Profile deceleration.
pub const PROFILE_DECELERATION: u16 = 0x6084;
/// Quick stop deceleration.
pub const QUICK_STOP_DECELERATION: u16 = 0x6085;
/// Motion profile type.
pub const PROFILE_TYPE: u16 = 0x6086;
/// Torque slope.
pub const TORQUE_SLOPE: u16 = 0x6087;
/// Position encoder resolution.
pub const ENCODER_RESOLUTION: u16 = 0x608F;
/// Gear ratio.
pub const GEAR_RATIO: u16 = 0x6091;
/// Feed constant.
pub const FEED_CONSTANT: u16 = 0x6092;
/// Velocity factor.
pub const VELOCITY_FACTOR: u16 = 0x6096;
/// Acceleration factor.
pub const ACCELERATION_FACTOR: u16 = 0x6097;
/// Homing method.
pub const HOMING_METHOD: u16 = 0x6098;
/// Homing speeds.
pub const HOMING_SPEEDS: u16 = 0x6099;
/// Homing acceleration.
pub const HOMING_ACCELERATION: u16 = 0x609A;
/// Position offset.
pub const POSITION_OFFSET: u16 = 0x60B0;
/// Velocity offset.
pub const VELOCITY_OFFSET: u16 = 0x60B1;
/// Torque offset.
pub const TORQUE_OFFSET: u16 = 0x60B2;
/// Touch probe function.
pub const PROBE_FUNCTION: u16 = 0x60B8;
/// Touch probe status.
pub const PROBE_STATUS: u16 = 0x60B9;
/// Touch probe 1 positive edge.
pub const PROBE_1_RISING: u16 = 0x60BA;
/// Touch probe 1 negative edge.
pub const PROBE_1_FALLING: u16 = 0x60BB;
/// Touch probe 2 positive edge.
pub const PROBE_2_RISING: u16 = 0x60BC;
/// Touch probe 2 negative edge.
pub const PROBE_2_FALLING: u16 = 0x60BD;
/// Interpolation sub mode select.
pub const INTERPOLATION_SUB_MODE: u16 = 0x60C0;
/// Interpolation data record.
pub const INTERPOLATION_DATA: u16 = 0x60C1;
/// Interpolation time period.
pub const INTERPOLATION_PERIOD: u16 = 0x60C2;
/// Max acceleration.
pub const MAX_ACCELERATION: u16 = 0x60C5;
/// Max deceleration.
pub const MAX_DECELERATION: u16 = 0x60C6;
/// Touch probe 1 positive edge counter.
pub const PROBE_1_RISING_COUNTER: u16 = 0x60D5;
/// Touch probe 1 negative edge counter.
pub const PROBE_1_FALLING_COUNTER: u16 = 0x60D6;
/// Touch probe 2 positive edge counter.
pub const PROBE_2_RISING_COUNTER: u16 = 0x60D7;
/// Touch probe 2 negative edge counter.
pub const PROBE_2_FALLING_COUNTER: u16 = 0x60D8;
/// Positive torque limit value.
pub const POSITIVE_TORQUE_LIMIT: u16 = 0x60E0;
/// Negative torque limit value.
pub const NEGATIVE_TORQUE_LIMIT: u16 = 0x60E1;
/// Supported homing methods.
pub const SUPPORTED_HOMING_METHODS: u16 = 0x60E3;
/// Additional position actual value.
pub const ADDITIONAL_POSITION_ACTUAL: u16 = 0x60E4;
/// Additional velocity actual value.
pub const ADDITIONAL_VELOCITY_ACTUAL: u16 = 0x60E5;
/// Following error actual value.
pub const FOLLOWING_ERROR: u16 = 0x60F4;
/// Control effort.
pub const CONTROL_EFFORT: u16 = 0x60FA;
/// Position demand internal value.
pub const POSITION_DEMAND_INTERNAL: u16 = 0x60FC;
/// Digital inputs.
pub const DIGITAL_INPUTS: u16 = 0x60FD;
/// Digital outputs.
pub const DIGITAL_OUTPUTS: u16 = 0x60FE;
/// Target velocity.
pub const TARGET_VELOCITY: u16 = 0x60FF;
/// Motor type.
pub const MOTOR_TYPE: u16 = 0x6402;
/// Supported drive modes.
pub const SUPPORTED_MODES: u16 = 0x6502;
/// Drive catalogue number.
pub const DRIVE_CATALOGUE: u16 = 0x6503;
/// Drive manufacturer.
pub const DRIVE_MANUFACTURER: u16 = 0x6504;
/// Single device type.
pub const AXIS_DEVICE_TYPE: u16 = 0x67FF;
