//! Bit fields of the CIP Motion connection. Reserved bits are kept as they came.

use core::fmt;

use crate::generated::motion_bits;

/// Declares a bit field: a `bitflags` type that keeps reserved bits and prints the names of the set ones. Numbers and names
/// are those of a module of [`motion_bits`].
macro_rules! bit_field {
    ($(#[$meta:meta])* pub struct $name:ident($repr:ty) of $module:ident {
        $($(#[doc = $flag_doc:literal])* $flag:ident;)*
    }) => {
        bitflags::bitflags! {
            $(#[$meta])*
            #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
            pub struct $name: $repr {
                $($(#[doc = $flag_doc])* const $flag = 1 << motion_bits::$module::$flag.0;)*
                /// Reserved bits are kept.
                const _ = !0;
            }
        }

        impl $name {
            /// Every named bit with its name, in the order of declaration.
            pub const NAMED: &'static [($name, &'static str)] =
                &[$(($name::$flag, motion_bits::$module::$flag.1)),*];
            const KNOWN: $repr = 0 $(| (1 << motion_bits::$module::$flag.0))*;

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
    pub struct NodeControl(u8) of node_control {
        /// The controller asks for full control of the device.
        REMOTE_CONTROL;
        /// The controller asks for synchronous operation; time stamps are valid.
        SYNC_CONTROL;
        /// The instance data blocks may be processed.
        DATA_VALID;
        /// The controller asks for a reset of the node fault.
        FAULT_RESET;
    }
}

bit_field! {
    /// Node Status, class attribute 15, Table 5-2.5.
    pub struct NodeStatus(u8) of node_status {
        /// The device obeys the controller.
        REMOTE_MODE;
        /// The device works synchronously; its time stamp is valid.
        SYNC_MODE;
        /// The instance data blocks may be processed.
        DATA_VALID;
        /// A node fault is active.
        FAULT;
    }
}

bit_field! {
    /// Time Data Set, class attribute 31, Table 6-2.11. The table of the header wins over that of the
    /// attribute.
    pub struct TimeDataSet(u8) of time_data_set {
        /// A time stamp is included (and asked for).
        TIME_STAMP;
        /// A time offset is included.
        TIME_OFFSET;
        /// Lost and late update counts are asked for or included.
        UPDATE_DIAGNOSTICS;
        /// Receive and transmit times are asked for or included.
        TIME_DIAGNOSTICS;
    }
}

bit_field! {
    /// Control Status, attribute 89, Table 6-2.18.
    pub struct ControlStatus(u8) of control_status {
        /// The controller has set every attribute of the axis.
        CONFIGURATION_COMPLETE;
        /// The converters that supply this axis have their bus up.
        CONVERTER_BUS_UP;
        /// A converter asks to stop drawing bus power.
        CONVERTER_BUS_UNLOAD;
        /// A converter has lost its AC input.
        CONVERTER_AC_POWER_LOSS;
    }
}

bit_field! {
    /// Command Data Set, attribute 91, Table 6-2.19.
    pub struct CommandDataSet(u8) of command_data_set {
        /// LREAL or DINT, see Command Control.
        POSITION;
        /// REAL.
        VELOCITY;
        /// REAL.
        ACCELERATION;
        /// REAL.
        TORQUE;
        /// DINT.
        UNWIND_COUNT;
        /// DINT.
        POSITION_DISPLACEMENT;
    }
}

bit_field! {
    /// Actual Data Set, attribute 90, Table 6-2.21.
    pub struct ActualDataSet(u8) of actual_data_set {
        /// DINT, or LINT by the Feedback Mode.
        POSITION;
        /// REAL.
        VELOCITY;
        /// REAL.
        ACCELERATION;
        /// DINT.
        UNWIND_COUNT;
        /// DINT.
        POSITION_DISPLACEMENT;
    }
}

bit_field! {
    /// Status Data Set, attribute 94, Table 6-2.23.
    pub struct StatusDataSet(u8) of status_data_set {
        /// The fault record.
        FAULT;
        /// The alarm record.
        ALARM;
        /// Axis Status and its manufacturer word.
        AXIS_STATUS;
        /// Axis I/O Status and its manufacturer word.
        IO_STATUS;
        /// Safety status words and the safety state.
        SAFETY_STATUS;
        /// Vendor specific.
        VENDOR_SPECIFIC_6;
        /// Vendor specific.
        VENDOR_SPECIFIC_7;
    }
}

bit_field! {
    /// Axis Status, attribute 651, Table 5-2.60.
    pub struct AxisStatus(u32) of axis_status {
        /// Commands come from a local interface.
        LOCAL_CONTROL;
        /// An alarm condition is present.
        ALARM;
        /// The DC bus is at an operational voltage.
        DC_BUS_UP;
        /// The amplifier can generate torque.
        POWER_STRUCTURE_ENABLED;
        /// The flux of an induction motor is built up.
        MOTOR_FLUX_UP;
        /// The axis follows the command reference.
        TRACKING_COMMAND;
        /// Position error within the lock tolerance.
        POSITION_LOCK;
        /// Velocity error within the lock tolerance.
        VELOCITY_LOCK;
        /// Velocity within the standstill window.
        VELOCITY_STANDSTILL;
        /// Velocity below the threshold.
        VELOCITY_THRESHOLD;
        /// The velocity reference is limited.
        VELOCITY_LIMIT;
        /// The acceleration is limited.
        ACCELERATION_LIMIT;
        /// The deceleration is limited.
        DECELERATION_LIMIT;
        /// Torque above the threshold.
        TORQUE_THRESHOLD;
        /// The torque reference is limited.
        TORQUE_LIMIT;
        /// The current command is limited.
        CURRENT_LIMIT;
        /// A thermal model limits the current.
        THERMAL_LIMIT;
        /// The feedback position can be trusted.
        FEEDBACK_INTEGRITY;
        /// A shutdown is latched.
        SHUTDOWN;
        /// A test process is active.
        IN_PROCESS;
        /// The converter asks the others to unload the bus.
        DC_BUS_UNLOAD;
        /// The AC input is lost.
        AC_POWER_LOSS;
        /// The position loop is in control.
        POSITION_CONTROL_MODE;
        /// The velocity loop is in control.
        VELOCITY_CONTROL_MODE;
        /// The torque loop is in control.
        TORQUE_CONTROL_MODE;
    }
}

bit_field! {
    /// Axis I/O Status, attribute 653, Table 5-2.63.
    pub struct AxisIoStatus(u32) of axis_io_status {
        /// Level of the enable input.
        ENABLE_INPUT;
        /// Level of the home switch.
        HOME_INPUT;
        /// Level of registration input 1.
        REGISTRATION_1_INPUT;
        /// Level of registration input 2.
        REGISTRATION_2_INPUT;
        /// The positive limit switch is free.
        POSITIVE_OVERTRAVEL_OK;
        /// The negative limit switch is free.
        NEGATIVE_OVERTRAVEL_OK;
        /// The thermostat of feedback 1 is closed.
        FEEDBACK_1_THERMOSTAT_OK;
        /// The resistive brake is released.
        RESISTIVE_BRAKE_RELEASE;
        /// The mechanical brake is released.
        MECHANICAL_BRAKE_RELEASE;
        /// The motor thermostat is closed.
        MOTOR_THERMOSTAT_OK;
    }
}

bit_field! {
    /// Event Checking Control and Status bits 0 to 27, attributes 60 and 61, Table 5-2.36. The block count
    /// and the format bit above them are computed.
    pub struct EventChecking(u32) of event_checking {
        /// Check registration 1, positive edge.
        REG_1_POSITIVE;
        /// Check registration 1, negative edge.
        REG_1_NEGATIVE;
        /// Check registration 2, positive edge.
        REG_2_POSITIVE;
        /// Check registration 2, negative edge.
        REG_2_NEGATIVE;
        /// With window; extended format only.
        REG_1_POSITIVE_WINDOW;
        /// With window; extended format only.
        REG_1_NEGATIVE_WINDOW;
        /// With window; extended format only.
        REG_2_POSITIVE_WINDOW;
        /// With window; extended format only.
        REG_2_NEGATIVE_WINDOW;
        /// Keep checking after an event.
        REG_1_POSITIVE_REARM;
        /// Keep checking after an event.
        REG_1_NEGATIVE_REARM;
        /// Keep checking after an event.
        REG_2_POSITIVE_REARM;
        /// Keep checking after an event.
        REG_2_NEGATIVE_REARM;
        /// Extended format only.
        WATCH_1_FORWARD;
        /// Extended format only.
        WATCH_1_REVERSE;
        /// Extended format only.
        WATCH_2_FORWARD;
        /// Extended format only.
        WATCH_2_REVERSE;
        /// Check the marker, positive edge.
        MARKER_POSITIVE;
        /// Check the marker, negative edge.
        MARKER_NEGATIVE;
        /// Check the home switch, positive edge.
        HOME_POSITIVE;
        /// Check the home switch, negative edge.
        HOME_NEGATIVE;
        /// Home switch up, then marker up.
        HOME_MARKER_PP;
        /// Home switch up, then marker down.
        HOME_MARKER_PN;
        /// Home switch down, then marker up.
        HOME_MARKER_NP;
        /// Home switch down, then marker down.
        HOME_MARKER_NN;
        /// Extended format only.
        HOME_TORQUE;
    }
}
