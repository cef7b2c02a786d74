//! What every slave is asked.

use profile_sercos::wire::idn::Idn;

/// What is asked, in this order. A slave that has not got one of them says so, which is an answer too.
pub const QUESTIONS: &[Idn] = &[
    Idn::VENDOR_NAME,
    Idn::VENDOR_CODE,
    Idn::DEVICE_NAME,
    Idn::DEVICE_ID,
    Idn::HARDWARE_REVISION,
    Idn::SOFTWARE_REVISION,
    Idn::SERIAL_NUMBER,
    Idn::HARDWARE_VERSION,
    Idn::MANUFACTURER_VERSION,
    Idn::CONTROLLER_TYPE,
    Idn::MOTOR_TYPE,
    Idn::OPERATION_MODES,
    Idn::POSITION_DATA_SCALING_TYPE,
    Idn::VELOCITY_DATA_SCALING_TYPE,
    Idn::ACCELERATION_DATA_SCALING_TYPE,
    Idn::TORQUE_FORCE_DATA_SCALING_TYPE,
    Idn::DIAGNOSTIC_MESSAGE,
];
