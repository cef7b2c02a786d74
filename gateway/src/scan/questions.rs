//! What every slave is asked.

use profile_sercos::wire::idn::Idn;

/// An IDN of the generic device profile, S-0-1300.0.`element`.
pub const fn component(element: u8) -> Idn {
    Idn::standard(1300).with_structure(0, element)
}

/// Vendor name.
pub const VENDOR_NAME: Idn = component(2);
/// Vendor code.
pub const VENDOR_CODE: Idn = component(3);
/// Device name.
pub const DEVICE_NAME: Idn = component(4);
/// Device ID, the ordering code.
pub const DEVICE_ID: Idn = component(5);
/// Hardware revision.
pub const HARDWARE: Idn = component(8);
/// Software revision.
pub const SOFTWARE: Idn = component(9);
/// Serial number.
pub const SERIAL_NUMBER: Idn = component(12);
/// Hardware version of the communication.
pub const COMMUNICATION_HARDWARE: Idn = Idn::standard(1026);
/// Manufacturer version, of drives that have no generic device profile.
pub const MANUFACTURER_VERSION: Idn = Idn::standard(30);
/// Controller type, of drives that have no generic device profile.
pub const CONTROLLER_TYPE: Idn = Idn::standard(140);
/// Motor type.
pub const MOTOR_TYPE: Idn = Idn::standard(141);
/// List of supported operation modes.
pub const OPERATION_MODES: Idn = Idn::standard(292);
/// Position data scaling type.
pub const POSITION_SCALING: Idn = Idn::standard(76);
/// Velocity data scaling type.
pub const VELOCITY_SCALING: Idn = Idn::standard(44);
/// Acceleration data scaling type.
pub const ACCELERATION_SCALING: Idn = Idn::standard(160);
/// Torque and force data scaling type.
pub const TORQUE_SCALING: Idn = Idn::standard(86);
/// Diagnostic message.
pub const DIAGNOSIS: Idn = Idn::standard(95);

/// What is asked, in this order. A slave that has not got one of them says so, which is an answer too.
pub const QUESTIONS: &[Idn] = &[
    VENDOR_NAME,
    VENDOR_CODE,
    DEVICE_NAME,
    DEVICE_ID,
    HARDWARE,
    SOFTWARE,
    SERIAL_NUMBER,
    COMMUNICATION_HARDWARE,
    MANUFACTURER_VERSION,
    CONTROLLER_TYPE,
    MOTOR_TYPE,
    OPERATION_MODES,
    POSITION_SCALING,
    VELOCITY_SCALING,
    ACCELERATION_SCALING,
    TORQUE_SCALING,
    DIAGNOSIS,
];
