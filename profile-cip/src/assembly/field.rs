//! The named values of one axis in an assembly.
//!
//! Positions are counts of the axis (`motion_resolution` of them make a revolution or millimetre), velocities counts per second,
//! accelerations counts per second squared. Torque is in thousandths of the rated torque. Stamps are nanoseconds of system time.

/// One row per field: variant, name, bytes, type of IEC 61131-3, description.
macro_rules! fields {
    ($(#[$doc:meta])* $name:ident { $( $field:ident = $text:literal, $len:literal, $kind:literal, $description:literal; )* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum $name { $( #[doc = $description] $field ),* }

        impl $name {
            /// Every field.
            pub const ALL: &'static [Self] = &[ $( Self::$field ),* ];

            /// The name in configurations and listings.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $( Self::$field => $text ),* }
            }

            /// Bytes in the assembly.
            #[must_use]
            pub const fn size(self) -> usize {
                match self { $( Self::$field => $len ),* }
            }

            /// Its type, as IEC 61131-3 names it.
            #[must_use]
            pub const fn kind(self) -> &'static str {
                match self { $( Self::$field => $kind ),* }
            }

            /// What it is, in a sentence.
            #[must_use]
            pub const fn description(self) -> &'static str {
                match self { $( Self::$field => $description ),* }
            }

            /// The field with this exact name.
            #[must_use]
            pub fn parse(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|field| field.name() == name)
            }
        }
    };
}

fields! {
    /// A value from the controller.
    OutputField {
        Control = "control", 2, "UINT", "Control word.";
        Mode = "mode", 1, "USINT", "Mode: 0 none, 1 position, 2 velocity, 3 cyclic position, 4 cyclic velocity, 5 cyclic torque.";
        TargetPosition32 = "target_position_32", 4, "DINT", "Target or set-point of the position, counts.";
        TargetPosition64 = "target_position_64", 8, "LINT", "Target or set-point of the position, counts.";
        Velocity = "velocity", 4, "DINT", "Velocity of a movement, or its set-point, counts/s.";
        Acceleration = "acceleration", 4, "DINT", "Acceleration and deceleration of a movement, counts/s^2; 0 takes the limit of the axis.";
        Torque = "torque", 2, "INT", "Torque set-point, 0.1 % of rated torque.";
        VelocityOffset = "velocity_offset", 4, "DINT", "Added to the velocity set-point, counts/s.";
        TorqueOffset = "torque_offset", 2, "INT", "Added to the torque set-point, 0.1 % of rated torque.";
        TimeStamp = "time_stamp", 8, "LINT", "Instant of the set-points in system time, ns; 0 for as soon as possible.";
        Pad8 = "pad_8", 1, "USINT", "Not used.";
        Pad16 = "pad_16", 2, "UINT", "Not used.";
        Pad32 = "pad_32", 4, "UDINT", "Not used.";
    }
}

fields! {
    /// A value to the controller.
    InputField {
        Status = "status", 2, "UINT", "Status word.";
        Mode = "mode", 1, "USINT", "Mode in use, as in the output.";
        Refusal = "refusal", 1, "USINT", "Why the last order was refused; 0 when it was not.";
        Fault = "fault", 2, "UINT", "Cause of the fault; 0 without one.";
        ActualPosition32 = "actual_position_32", 4, "DINT", "Actual position, counts; held at its end and marked in the status word when it does not fit.";
        ActualPosition64 = "actual_position_64", 8, "LINT", "Actual position, counts.";
        ActualVelocity = "actual_velocity", 4, "DINT", "Actual velocity, counts/s.";
        ActualTorque = "actual_torque", 2, "INT", "Actual torque, 0.1 % of rated torque.";
        FollowingError = "following_error", 4, "DINT", "Following error, counts.";
        Inputs = "inputs", 4, "UDINT", "Digital inputs of the drive.";
        Age = "age", 4, "UDINT", "Age of the actual values when they were put in, us.";
        TimeStamp = "time_stamp", 8, "LINT", "Instant of the actual values in system time, ns; 0 when it is not known.";
        Pad8 = "pad_8", 1, "USINT", "Always 0.";
        Pad16 = "pad_16", 2, "UINT", "Always 0.";
        Pad32 = "pad_32", 4, "UDINT", "Always 0.";
    }
}

impl OutputField {
    /// Whether it only fills.
    #[must_use]
    pub const fn is_pad(self) -> bool {
        matches!(self, Self::Pad8 | Self::Pad16 | Self::Pad32)
    }
}

impl InputField {
    /// Whether it only fills.
    #[must_use]
    pub const fn is_pad(self) -> bool {
        matches!(self, Self::Pad8 | Self::Pad16 | Self::Pad32)
    }
}
