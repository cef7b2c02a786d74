//! The functional elements of a power drive system.

use crate::code::named_enum;

named_enum! {
    /// A part of the drive with an interface of its own (IEC 61800-7-202, 3.1.26), as IEC 61800-7-1 divides
    /// it.
    pub enum FunctionalElement {
        /// Who the device is: vendor, type, serial number, versions.
        DeviceIdentification = "device_identification",
        /// How the device talks: connections, cycle times, synchronisation.
        Communication = "communication",
        /// Who commands the device and in which operating mode.
        DeviceControl = "device_control",
        /// The drive proper: state machine, control loops, motor, feedback, power, limits, stopping.
        BasicDrive = "basic_drive",
        /// What a drive may do beyond that: homing, capture, tests, brake.
        ApplicationFunction = "application_function",
    }
}
