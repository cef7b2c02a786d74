//! Bit fields of the CIP Motion connection. Reserved bits are kept as they came.

use core::fmt;

/// Declares a bit field: a `bitflags` type that keeps reserved bits and prints the names of the set ones.
macro_rules! bit_field {
    ($(#[$meta:meta])* pub struct $name:ident($repr:ty) {
        $($(#[doc = $flag_doc:literal])* $flag:ident = $bit:literal, $text:literal;)*
    }) => {
        bitflags::bitflags! {
            $(#[$meta])*
            #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
            pub struct $name: $repr {
                $($(#[doc = $flag_doc])* const $flag = 1 << $bit;)*
                /// Reserved bits are kept.
                const _ = !0;
            }
        }

        impl $name {
            /// Every named bit with its name, in the order of declaration.
            pub const NAMED: &'static [($name, &'static str)] = &[$(($name::$flag, $text)),*];
            const KNOWN: $repr = 0 $(| (1 << $bit))*;

            /// The bits that have no name in the standard.
            #[must_use]
            pub const fn reserved(self) -> $repr {
                self.bits() & !Self::KNOWN
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                if self.is_empty() {
                    return f.write_str("none");
                }
                let mut separator = "";
                for (flag, text) in Self::NAMED {
                    if self.contains(*flag) {
                        write!(f, "{separator}{text}")?;
                        separator = ", ";
                    }
                }
                if self.reserved() != 0 {
                    write!(f, "{separator}reserved 0x{:X}", self.reserved())?;
                }
                Ok(())
            }
        }
    };
}

bit_field! {
    /// Node Control, class attribute 14, Table 5-2.4.
    pub struct NodeControl(u8) {
        /// The controller asks for full control of the device.
        REMOTE_CONTROL = 0, "Remote Control";
        /// The controller asks for synchronous operation; time stamps are valid.
        SYNC_CONTROL = 1, "Sync Control";
        /// The instance data blocks may be processed.
        DATA_VALID = 2, "Controller Data Valid";
        /// The controller asks for a reset of the node fault.
        FAULT_RESET = 3, "Node Fault Reset";
    }
}

bit_field! {
    /// Node Status, class attribute 15, Table 5-2.5.
    pub struct NodeStatus(u8) {
        /// The device obeys the controller.
        REMOTE_MODE = 0, "Remote Mode";
        /// The device works synchronously; its time stamp is valid.
        SYNC_MODE = 1, "Sync Mode";
        /// The instance data blocks may be processed.
        DATA_VALID = 2, "Device Data Valid";
        /// A node fault is active.
        FAULT = 3, "Device Node Fault";
    }
}

bit_field! {
    /// Time Data Set, class attribute 31, Table 6-2.11. The table of the header wins over that of the
    /// attribute.
    pub struct TimeDataSet(u8) {
        /// A time stamp is included (and asked for).
        TIME_STAMP = 0, "Time Stamp";
        /// A time offset is included.
        TIME_OFFSET = 1, "Time Offset";
        /// Lost and late update counts are asked for or included.
        UPDATE_DIAGNOSTICS = 2, "Update Diagnostics";
        /// Receive and transmit times are asked for or included.
        TIME_DIAGNOSTICS = 3, "Time Diagnostics";
    }
}

bit_field! {
    /// Control Status, attribute 89, Table 6-2.18.
    pub struct ControlStatus(u8) {
        /// The controller has set every attribute of the axis.
        CONFIGURATION_COMPLETE = 0, "Configuration Complete";
        /// The converters that supply this axis have their bus up.
        CONVERTER_BUS_UP = 2, "Converter Bus Up";
        /// A converter asks to stop drawing bus power.
        CONVERTER_BUS_UNLOAD = 3, "Converter Bus Unload";
        /// A converter has lost its AC input.
        CONVERTER_AC_POWER_LOSS = 4, "Converter AC Power Loss";
    }
}

bit_field! {
    /// Command Data Set, attribute 91, Table 6-2.19.
    pub struct CommandDataSet(u8) {
        /// LREAL or DINT, see Command Control.
        POSITION = 0, "Command Position";
        /// REAL.
        VELOCITY = 1, "Command Velocity";
        /// REAL.
        ACCELERATION = 2, "Command Acceleration";
        /// REAL.
        TORQUE = 3, "Command Torque";
        /// DINT.
        UNWIND_COUNT = 6, "Unwind Cycle Count";
        /// DINT.
        POSITION_DISPLACEMENT = 7, "Position Displacement";
    }
}

bit_field! {
    /// Actual Data Set, attribute 90, Table 6-2.21.
    pub struct ActualDataSet(u8) {
        /// DINT, or LINT by the Feedback Mode.
        POSITION = 0, "Actual Position";
        /// REAL.
        VELOCITY = 1, "Actual Velocity";
        /// REAL.
        ACCELERATION = 2, "Actual Acceleration";
        /// DINT.
        UNWIND_COUNT = 6, "Unwind Cycle Count";
        /// DINT.
        POSITION_DISPLACEMENT = 7, "Position Displacement";
    }
}

bit_field! {
    /// Status Data Set, attribute 94, Table 6-2.23.
    pub struct StatusDataSet(u8) {
        /// The fault record.
        FAULT = 0, "Axis Fault";
        /// The alarm record.
        ALARM = 1, "Axis Alarm";
        /// Axis Status and its manufacturer word.
        AXIS_STATUS = 2, "Axis Status";
        /// Axis I/O Status and its manufacturer word.
        IO_STATUS = 3, "Axis I/O Status";
        /// Safety status words and the safety state.
        SAFETY_STATUS = 4, "Axis Safety";
        /// Vendor specific.
        VENDOR_A = 6, "Vendor Specific 6";
        /// Vendor specific.
        VENDOR_B = 7, "Vendor Specific 7";
    }
}

bit_field! {
    /// Axis Status, attribute 651, Table 5-2.60.
    pub struct AxisStatus(u32) {
        /// Commands come from a local interface.
        LOCAL_CONTROL = 0, "Local Control";
        /// An alarm condition is present.
        ALARM = 1, "Alarm";
        /// The DC bus is at an operational voltage.
        DC_BUS_UP = 2, "DC Bus Up";
        /// The amplifier can generate torque.
        POWER_STRUCTURE_ENABLED = 3, "Power Structure Enabled";
        /// The flux of an induction motor is built up.
        MOTOR_FLUX_UP = 4, "Motor Flux Up";
        /// The axis follows the command reference.
        TRACKING_COMMAND = 5, "Tracking Command";
        /// Position error within the lock tolerance.
        POSITION_LOCK = 6, "Position Lock";
        /// Velocity error within the lock tolerance.
        VELOCITY_LOCK = 7, "Velocity Lock";
        /// Velocity within the standstill window.
        VELOCITY_STANDSTILL = 8, "Velocity Standstill";
        /// Velocity below the threshold.
        VELOCITY_THRESHOLD = 9, "Velocity Threshold";
        /// The velocity reference is limited.
        VELOCITY_LIMIT = 10, "Velocity Limit";
        /// The acceleration is limited.
        ACCELERATION_LIMIT = 11, "Acceleration Limit";
        /// The deceleration is limited.
        DECELERATION_LIMIT = 12, "Deceleration Limit";
        /// Torque above the threshold.
        TORQUE_THRESHOLD = 13, "Torque Threshold";
        /// The torque reference is limited.
        TORQUE_LIMIT = 14, "Torque Limit";
        /// The current command is limited.
        CURRENT_LIMIT = 15, "Current Limit";
        /// A thermal model limits the current.
        THERMAL_LIMIT = 16, "Thermal Limit";
        /// The feedback position can be trusted.
        FEEDBACK_INTEGRITY = 17, "Feedback Integrity";
        /// A shutdown is latched.
        SHUTDOWN = 18, "Shutdown";
        /// A test process is active.
        IN_PROCESS = 19, "In Process";
        /// The converter asks the others to unload the bus.
        DC_BUS_UNLOAD = 20, "DC Bus Unload";
        /// The AC input is lost.
        AC_POWER_LOSS = 21, "AC Power Loss";
        /// The position loop is in control.
        POSITION_CONTROL_MODE = 22, "Position Control Mode";
        /// The velocity loop is in control.
        VELOCITY_CONTROL_MODE = 23, "Velocity Control Mode";
        /// The torque loop is in control.
        TORQUE_CONTROL_MODE = 24, "Torque Control Mode";
    }
}

bit_field! {
    /// Axis I/O Status, attribute 653, Table 5-2.63.
    pub struct AxisIoStatus(u32) {
        /// Level of the enable input.
        ENABLE_INPUT = 0, "Enable Input";
        /// Level of the home switch.
        HOME_INPUT = 1, "Home Input";
        /// Level of registration input 1.
        REGISTRATION_1_INPUT = 2, "Registration 1 Input";
        /// Level of registration input 2.
        REGISTRATION_2_INPUT = 3, "Registration 2 Input";
        /// The positive limit switch is free.
        POSITIVE_OVERTRAVEL_OK = 4, "Positive Overtravel OK Input";
        /// The negative limit switch is free.
        NEGATIVE_OVERTRAVEL_OK = 5, "Negative Overtravel OK Input";
        /// The thermostat of feedback 1 is closed.
        FEEDBACK_1_THERMOSTAT_OK = 6, "Feedback 1 Thermostat OK Input";
        /// The resistive brake is released.
        RESISTIVE_BRAKE_RELEASE = 7, "Resistive Brake Release Output";
        /// The mechanical brake is released.
        MECHANICAL_BRAKE_RELEASE = 8, "Mechanical Brake Release Output";
        /// The motor thermostat is closed.
        MOTOR_THERMOSTAT_OK = 9, "Motor Thermostat OK Input";
    }
}

bit_field! {
    /// Event Checking Control and Status bits 0 to 27, attributes 60 and 61, Table 5-2.36. The block count
    /// and the format bit above them are computed.
    pub struct EventChecking(u32) {
        /// Check registration 1, positive edge.
        REG_1_POSITIVE = 0, "Reg 1 Pos Edge";
        /// Check registration 1, negative edge.
        REG_1_NEGATIVE = 1, "Reg 1 Neg Edge";
        /// Check registration 2, positive edge.
        REG_2_POSITIVE = 2, "Reg 2 Pos Edge";
        /// Check registration 2, negative edge.
        REG_2_NEGATIVE = 3, "Reg 2 Neg Edge";
        /// With window; extended format only.
        REG_1_POSITIVE_WINDOW = 4, "Reg 1 Pos Edge Window";
        /// With window; extended format only.
        REG_1_NEGATIVE_WINDOW = 5, "Reg 1 Neg Edge Window";
        /// With window; extended format only.
        REG_2_POSITIVE_WINDOW = 6, "Reg 2 Pos Edge Window";
        /// With window; extended format only.
        REG_2_NEGATIVE_WINDOW = 7, "Reg 2 Neg Edge Window";
        /// Keep checking after an event.
        REG_1_POSITIVE_REARM = 8, "Reg 1 Pos Auto-rearm";
        /// Keep checking after an event.
        REG_1_NEGATIVE_REARM = 9, "Reg 1 Neg Auto-rearm";
        /// Keep checking after an event.
        REG_2_POSITIVE_REARM = 10, "Reg 2 Pos Auto-rearm";
        /// Keep checking after an event.
        REG_2_NEGATIVE_REARM = 11, "Reg 2 Neg Auto-rearm";
        /// Extended format only.
        WATCH_1_FORWARD = 12, "Watch Position 1 Fwd";
        /// Extended format only.
        WATCH_1_REVERSE = 13, "Watch Position 1 Rev";
        /// Extended format only.
        WATCH_2_FORWARD = 14, "Watch Position 2 Fwd";
        /// Extended format only.
        WATCH_2_REVERSE = 15, "Watch Position 2 Rev";
        /// Check the marker, positive edge.
        MARKER_POSITIVE = 16, "Marker Pos Edge";
        /// Check the marker, negative edge.
        MARKER_NEGATIVE = 17, "Marker Neg Edge";
        /// Check the home switch, positive edge.
        HOME_POSITIVE = 18, "Home Switch Pos Edge";
        /// Check the home switch, negative edge.
        HOME_NEGATIVE = 19, "Home Switch Neg Edge";
        /// Home switch up, then marker up.
        HOME_MARKER_PP = 20, "Home Switch-Marker ++";
        /// Home switch up, then marker down.
        HOME_MARKER_PN = 21, "Home Switch-Marker +-";
        /// Home switch down, then marker up.
        HOME_MARKER_NP = 22, "Home Switch-Marker -+";
        /// Home switch down, then marker down.
        HOME_MARKER_NN = 23, "Home Switch-Marker --";
        /// Extended format only.
        HOME_TORQUE = 24, "Home Torque Threshold";
    }
}
