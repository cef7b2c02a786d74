//! Numbers of the objects of CiA 402, for the first axis of a device. Those of axis n are [`AXIS_OFFSET`] times n higher.

/// Distance from an object of one axis to that of the next.
pub const AXIS_OFFSET: u16 = 0x800;

/// Most axes in a device.
pub const AXES_MAX: u8 = 8;

macro_rules! objects {
    ($( $constant:ident = $value:literal, $name:literal; )*) => {
        $( #[doc = concat!($name, ".")] pub const $constant: u16 = $value; )*
    };
}

objects! {
    ABORT_CONNECTION_OPTION = 0x6007, "Abort connection option code";
    ERROR_CODE = 0x603F, "Error code";
    CONTROLWORD = 0x6040, "Controlword";
    STATUSWORD = 0x6041, "Statusword";
    VL_TARGET_VELOCITY = 0x6042, "vl target velocity";
    VL_VELOCITY_DEMAND = 0x6043, "vl velocity demand";
    VL_VELOCITY_ACTUAL = 0x6044, "vl velocity actual value";
    VL_VELOCITY_LIMITS = 0x6046, "vl velocity min max amount";
    VL_ACCELERATION = 0x6048, "vl velocity acceleration";
    VL_DECELERATION = 0x6049, "vl velocity deceleration";
    VL_QUICK_STOP = 0x604A, "vl velocity quick stop";
    VL_DIMENSION_FACTOR = 0x604C, "vl dimension factor";
    QUICK_STOP_OPTION = 0x605A, "Quick stop option code";
    SHUTDOWN_OPTION = 0x605B, "Shutdown option code";
    DISABLE_OPTION = 0x605C, "Disable operation option code";
    HALT_OPTION = 0x605D, "Halt option code";
    FAULT_REACTION_OPTION = 0x605E, "Fault reaction option code";
    MODE = 0x6060, "Modes of operation";
    MODE_DISPLAY = 0x6061, "Modes of operation display";
    POSITION_DEMAND = 0x6062, "Position demand value";
    POSITION_INTERNAL = 0x6063, "Position actual internal value";
    POSITION_ACTUAL = 0x6064, "Position actual value";
    FOLLOWING_WINDOW = 0x6065, "Following error window";
    FOLLOWING_TIME_OUT = 0x6066, "Following error time out";
    POSITION_WINDOW = 0x6067, "Position window";
    POSITION_WINDOW_TIME = 0x6068, "Position window time";
    VELOCITY_SENSOR = 0x6069, "Velocity sensor actual value";
    VELOCITY_DEMAND = 0x606B, "Velocity demand value";
    VELOCITY_ACTUAL = 0x606C, "Velocity actual value";
    VELOCITY_WINDOW = 0x606D, "Velocity window";
    VELOCITY_WINDOW_TIME = 0x606E, "Velocity window time";
    VELOCITY_THRESHOLD = 0x606F, "Velocity threshold";
    VELOCITY_THRESHOLD_TIME = 0x6070, "Velocity threshold time";
    TARGET_TORQUE = 0x6071, "Target torque";
    MAX_TORQUE = 0x6072, "Max torque";
    MAX_CURRENT = 0x6073, "Max current";
    TORQUE_DEMAND = 0x6074, "Torque demand";
    RATED_CURRENT = 0x6075, "Motor rated current";
    RATED_TORQUE = 0x6076, "Motor rated torque";
    TORQUE_ACTUAL = 0x6077, "Torque actual value";
    CURRENT_ACTUAL = 0x6078, "Current actual value";
    DC_LINK_VOLTAGE = 0x6079, "DC link circuit voltage";
    TARGET_POSITION = 0x607A, "Target position";
    RANGE_LIMIT = 0x607B, "Position range limit";
    HOME_OFFSET = 0x607C, "Home offset";
    SOFTWARE_LIMIT = 0x607D, "Software position limit";
    POLARITY = 0x607E, "Polarity";
    MAX_PROFILE_VELOCITY = 0x607F, "Max profile velocity";
    MAX_MOTOR_SPEED = 0x6080, "Max motor speed";
    PROFILE_VELOCITY = 0x6081, "Profile velocity";
    END_VELOCITY = 0x6082, "End velocity";
    PROFILE_ACCELERATION = 0x6083, "Profile acceleration";
    PROFILE_DECELERATION = 0x6084, "Profile deceleration";
    QUICK_STOP_DECELERATION = 0x6085, "Quick stop deceleration";
    PROFILE_TYPE = 0x6086, "Motion profile type";
    TORQUE_SLOPE = 0x6087, "Torque slope";
    ENCODER_RESOLUTION = 0x608F, "Position encoder resolution";
    GEAR_RATIO = 0x6091, "Gear ratio";
    FEED_CONSTANT = 0x6092, "Feed constant";
    VELOCITY_FACTOR = 0x6096, "Velocity factor";
    ACCELERATION_FACTOR = 0x6097, "Acceleration factor";
    HOMING_METHOD = 0x6098, "Homing method";
    HOMING_SPEEDS = 0x6099, "Homing speeds";
    HOMING_ACCELERATION = 0x609A, "Homing acceleration";
    POSITION_OFFSET = 0x60B0, "Position offset";
    VELOCITY_OFFSET = 0x60B1, "Velocity offset";
    TORQUE_OFFSET = 0x60B2, "Torque offset";
    PROBE_FUNCTION = 0x60B8, "Touch probe function";
    PROBE_STATUS = 0x60B9, "Touch probe status";
    PROBE_1_RISING = 0x60BA, "Touch probe position 1 positive edge";
    PROBE_1_FALLING = 0x60BB, "Touch probe position 1 negative edge";
    PROBE_2_RISING = 0x60BC, "Touch probe position 2 positive edge";
    PROBE_2_FALLING = 0x60BD, "Touch probe position 2 negative edge";
    INTERPOLATION_SUB_MODE = 0x60C0, "Interpolation sub mode select";
    INTERPOLATION_DATA = 0x60C1, "Interpolation data record";
    INTERPOLATION_PERIOD = 0x60C2, "Interpolation time period";
    MAX_ACCELERATION = 0x60C5, "Max acceleration";
    MAX_DECELERATION = 0x60C6, "Max deceleration";
    PROBE_1_RISING_COUNTER = 0x60D5, "Touch probe 1 positive edge counter";
    PROBE_1_FALLING_COUNTER = 0x60D6, "Touch probe 1 negative edge counter";
    PROBE_2_RISING_COUNTER = 0x60D7, "Touch probe 2 positive edge counter";
    PROBE_2_FALLING_COUNTER = 0x60D8, "Touch probe 2 negative edge counter";
    POSITIVE_TORQUE_LIMIT = 0x60E0, "Positive torque limit value";
    NEGATIVE_TORQUE_LIMIT = 0x60E1, "Negative torque limit value";
    SUPPORTED_HOMING_METHODS = 0x60E3, "Supported homing methods";
    FOLLOWING_ERROR = 0x60F4, "Following error actual value";
    CONTROL_EFFORT = 0x60FA, "Control effort";
    POSITION_DEMAND_INTERNAL = 0x60FC, "Position demand internal value";
    DIGITAL_INPUTS = 0x60FD, "Digital inputs";
    DIGITAL_OUTPUTS = 0x60FE, "Digital outputs";
    TARGET_VELOCITY = 0x60FF, "Target velocity";
    MOTOR_TYPE = 0x6402, "Motor type";
    SUPPORTED_MODES = 0x6502, "Supported drive modes";
    DRIVE_CATALOGUE = 0x6503, "Drive catalogue number";
    DRIVE_MANUFACTURER = 0x6504, "Drive manufacturer";
    AXIS_DEVICE_TYPE = 0x67FF, "Single device type";
}

/// Bits of 60FDh.
pub mod input {
    /// Negative limit switch.
    pub const NEGATIVE_LIMIT: u32 = 1 << 0;
    /// Positive limit switch.
    pub const POSITIVE_LIMIT: u32 = 1 << 1;
    /// Home switch.
    pub const HOME: u32 = 1 << 2;
    /// Interlock.
    pub const INTERLOCK: u32 = 1 << 3;
    /// The inputs of the manufacturer begin at this bit.
    pub const MANUFACTURER_SHIFT: u32 = 16;
}
