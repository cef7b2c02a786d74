//! Layouts: which fields an axis has in the assemblies of its device.

use core::fmt;
use core::ops::Range;

use super::RUN_IDLE_LEN;
use super::field::{InputField, OutputField};
use crate::devicenet::wire::speed::{Assembly, DRIVE_MODE_SPEED, DRIVE_MODE_TORQUE};
use crate::wire::class1::SEQUENCE_COUNT_LEN;

/// Most bytes of an assembly: with its headers it fits one Ethernet frame.
pub const ASSEMBLY_LEN_MAX: usize = 1400;

/// Connection point of the output assembly.
pub const OUTPUT_POINT: u16 = 150;
/// Connection point of the input assembly.
pub const INPUT_POINT: u16 = 100;
/// Connection point of the configuration assembly, which has no data.
pub const CONFIGURATION_POINT: u16 = 151;
/// Connection point of the heartbeat of an input-only connection.
pub const INPUT_ONLY_POINT: u16 = 152;
/// Connection point of the heartbeat of a listen-only connection.
pub const LISTEN_ONLY_POINT: u16 = 153;

/// Most bytes of an assembly of the AC/DC drive profile.
pub const SPEED_LEN_MAX: usize = 6;

/// `TorqueScale` either way: the unit of torque is from 2^-15 Nm to 2^15 Nm.
pub const TORQUE_SCALE_MAX: i8 = 15;

/// Which of the two references of an assembly with speed and torque moves the axis: `DriveMode` of the AC/DC Drive object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DriveMode {
    /// The speed; the torque reference has no effect.
    #[default]
    Speed,
    /// The torque; the speed reference has no effect.
    Torque,
}

impl DriveMode {
    /// Every mode by its name in configurations.
    pub const NAMED: [(&str, Self); 2] = [("speed", Self::Speed), ("torque", Self::Torque)];

    /// The name in configurations and listings.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Speed => "speed",
            Self::Torque => "torque",
        }
    }

    /// Attribute 6 of the AC/DC Drive object.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Speed => DRIVE_MODE_SPEED,
            Self::Torque => DRIVE_MODE_TORQUE,
        }
    }
}

/// What the axes of a device exchange.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Layout {
    /// Fields, the same for each axis, one axis behind the other.
    Fields {
        /// From the controller.
        output: Vec<OutputField>,
        /// To the controller.
        input: Vec<InputField>,
        /// The mode of a layout without such a field.
        mode: Option<u8>,
    },
    /// Assemblies of the AC/DC drive profile, for one axis.
    Speed {
        /// The output assembly, 20 to 23; the input assembly goes with it.
        output: Assembly,
        /// The reference that moves the axis.
        mode: DriveMode,
        /// `TorqueScale`: torque is in Nm / 2^`torque_scale`; up to [`TORQUE_SCALE_MAX`] either way.
        torque_scale: i8,
    },
}

/// Why fields make no layout.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LayoutError {
    /// A field that every layout needs is missing.
    Missing {
        /// In the output, or else in the input.
        output: bool,
        /// Its name.
        field: &'static str,
    },
    /// A field stands there twice.
    Twice {
        /// In the output, or else in the input.
        output: bool,
        /// Its name.
        field: &'static str,
    },
    /// Both widths of one value.
    BothWidths,
    /// An assembly is too long.
    TooLong {
        /// In the output, or else in the input.
        output: bool,
        /// Its bytes.
        len: usize,
    },
    /// The layout is for one axis.
    OneAxis {
        /// How many there are.
        axes: usize,
    },
}

impl fmt::Display for LayoutError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let side = |output: bool| if output { "output" } else { "input" };
        match self {
            Self::Missing { output, field } => write!(f, "the {} has no field `{field}`", side(*output)),
            Self::Twice { output, field } => write!(f, "the {} has the field `{field}` twice", side(*output)),
            Self::BothWidths => f.write_str("the output has target positions of both widths"),
            Self::TooLong { output, len } => {
                write!(f, "the {} assembly has {len} bytes, at most {ASSEMBLY_LEN_MAX} fit", side(*output))
            }
            Self::OneAxis { axes } => write!(f, "the layout carries one axis, the device has {axes}"),
        }
    }
}

impl std::error::Error for LayoutError {}

/// Names of the shipped layouts.
pub const SHIPPED: [&str; 7] =
    ["position", "motion", "speed", "speed-basic", "speed-torque", "speed-torque-basic", "mixed"];

impl Layout {
    /// Assemblies of the AC/DC drive profile, in speed control.
    const fn of_profile(output: Assembly) -> Self {
        Self::Speed { output, mode: DriveMode::Speed, torque_scale: 0 }
    }

    /// Whether it has a torque in Nm: assemblies 22 and 72, 23 and 73.
    #[must_use]
    pub const fn has_torque_in_nm(&self) -> bool {
        matches!(self, Self::Speed { output, .. } if output.has_torque())
    }

    /// The same assemblies of the AC/DC drive profile with this mode and scale; other layouts as they are.
    #[must_use]
    pub fn with_torque(self, mode: DriveMode, torque_scale: i8) -> Self {
        match self {
            Self::Speed { output, .. } if output.has_torque() => Self::Speed { output, mode, torque_scale },
            other => other,
        }
    }

    /// The shipped layout with this name.
    #[must_use]
    pub fn shipped(name: &str) -> Option<Self> {
        use InputField as I;
        use OutputField as O;
        let input = |rest: &[I]| [&[I::Status, I::Mode, I::Refusal, I::Fault][..], rest].concat();
        Some(match name {
            "position" => Self::Fields {
                output: vec![O::Control, O::Pad16, O::TargetPosition32, O::Velocity, O::Acceleration],
                input: input(&[I::ActualTorque, I::ActualPosition32, I::ActualVelocity, I::FollowingError]),
                mode: Some(1),
            },
            "motion" => Self::Fields {
                output: vec![
                    O::Control,
                    O::TorqueOffset,
                    O::VelocityOffset,
                    O::TargetPosition64,
                    O::TimeStamp,
                ],
                input: input(&[
                    I::ActualTorque,
                    I::ActualPosition64,
                    I::TimeStamp,
                    I::ActualVelocity,
                    I::FollowingError,
                ]),
                mode: Some(3),
            },
            "mixed" => Self::Fields {
                output: vec![
                    O::Control,
                    O::Mode,
                    O::Pad8,
                    O::Velocity,
                    O::TargetPosition64,
                    O::Acceleration,
                    O::Torque,
                    O::TorqueOffset,
                    O::TimeStamp,
                ],
                input: input(&[
                    I::ActualTorque,
                    I::ActualPosition64,
                    I::ActualVelocity,
                    I::FollowingError,
                    I::Inputs,
                    I::Age,
                    I::TimeStamp,
                ]),
                mode: None,
            },
            "speed" => Self::of_profile(Assembly::EXTENDED_SPEED_CONTROL),
            "speed-basic" => Self::of_profile(Assembly::BASIC_SPEED_CONTROL),
            "speed-torque" => Self::of_profile(Assembly::EXTENDED_TORQUE_CONTROL),
            "speed-torque-basic" => Self::of_profile(Assembly::BASIC_TORQUE_CONTROL),
            _ => return None,
        })
    }

    /// A layout of these fields.
    ///
    /// # Errors
    /// See [`LayoutError`]; the length is checked by [`Assemblies::new`].
    pub fn of_fields(output: Vec<OutputField>, input: Vec<InputField>) -> Result<Self, LayoutError> {
        for needed in [OutputField::Control, OutputField::Mode] {
            if !output.contains(&needed) {
                return Err(LayoutError::Missing { output: true, field: needed.name() });
            }
        }
        if !input.contains(&InputField::Status) {
            return Err(LayoutError::Missing { output: false, field: InputField::Status.name() });
        }
        let twice = |(at, field): &(usize, &OutputField)| !field.is_pad() && output[..*at].contains(field);
        if let Some((_, field)) = output.iter().enumerate().find(twice) {
            return Err(LayoutError::Twice { output: true, field: field.name() });
        }
        let twice = |(at, field): &(usize, &InputField)| !field.is_pad() && input[..*at].contains(field);
        if let Some((_, field)) = input.iter().enumerate().find(twice) {
            return Err(LayoutError::Twice { output: false, field: field.name() });
        }
        if output.contains(&OutputField::TargetPosition32) && output.contains(&OutputField::TargetPosition64)
        {
            return Err(LayoutError::BothWidths);
        }
        Ok(Self::Fields { output, input, mode: None })
    }

    /// Bytes of one axis in the output assembly.
    #[must_use]
    pub fn output_len(&self) -> usize {
        match self {
            Self::Fields { output, .. } => output.iter().map(|field| field.size()).sum(),
            Self::Speed { output, .. } => output.buffer_len(),
        }
    }

    /// Bytes of one axis in the input assembly.
    #[must_use]
    pub fn input_len(&self) -> usize {
        match self {
            Self::Fields { input, .. } => input.iter().map(|field| field.size()).sum(),
            Self::Speed { output, .. } => output.buffer_len(),
        }
    }
}

/// A field at its place in an assembly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Placed {
    /// The axis, from 0.
    pub axis: usize,
    /// First byte in the assembly, without the run/idle header.
    pub offset: usize,
    /// Bytes.
    pub len: usize,
    /// Name.
    pub name: &'static str,
    /// Type of IEC 61131-3.
    pub kind: &'static str,
    /// What it is.
    pub description: &'static str,
}

/// The assemblies of a device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assemblies {
    layout: Layout,
    axes: usize,
}

impl Assemblies {
    /// The assemblies of so many axes with this layout.
    ///
    /// # Errors
    /// [`LayoutError::OneAxis`], [`LayoutError::TooLong`].
    pub fn new(layout: Layout, axes: usize) -> Result<Self, LayoutError> {
        if matches!(layout, Layout::Speed { .. }) && axes != 1 {
            return Err(LayoutError::OneAxis { axes });
        }
        for (output, len) in [(true, layout.output_len()), (false, layout.input_len())] {
            let len = len.saturating_mul(axes);
            if len > ASSEMBLY_LEN_MAX {
                return Err(LayoutError::TooLong { output, len });
            }
        }
        Ok(Self { layout, axes })
    }

    /// The layout of each axis.
    #[must_use]
    pub const fn layout(&self) -> &Layout {
        &self.layout
    }

    /// How many axes there are.
    #[must_use]
    pub const fn axes(&self) -> usize {
        self.axes
    }

    /// Bytes of the output assembly.
    #[must_use]
    pub fn output_len(&self) -> usize {
        self.layout.output_len() * self.axes
    }

    /// Bytes of the input assembly.
    #[must_use]
    pub fn input_len(&self) -> usize {
        self.layout.input_len() * self.axes
    }

    /// Connection point of the output assembly.
    #[must_use]
    pub const fn output_point(&self) -> u16 {
        match self.layout {
            Layout::Fields { .. } => OUTPUT_POINT,
            Layout::Speed { output, .. } => u16::from_le_bytes([output.0, 0]),
        }
    }

    /// Connection point of the input assembly.
    #[must_use]
    pub const fn input_point(&self) -> u16 {
        match self.layout {
            Layout::Fields { .. } => INPUT_POINT,
            // The input assembly of an output assembly is that many above it.
            Layout::Speed { output, .. } => u16::from_le_bytes([output.0 + 50, 0]),
        }
    }

    /// Size of the O->T direction of an exclusive owner in a Forward_Open: sequence count, run/idle header and data.
    #[must_use]
    pub fn o_to_t_size(&self) -> u16 {
        size(SEQUENCE_COUNT_LEN + RUN_IDLE_LEN + self.output_len())
    }

    /// Size of the T->O direction in a Forward_Open: sequence count and data.
    #[must_use]
    pub fn t_to_o_size(&self) -> u16 {
        size(SEQUENCE_COUNT_LEN + self.input_len())
    }

    /// The fields of the output assembly in their order.
    #[must_use]
    pub fn output(&self) -> Vec<Placed> {
        match &self.layout {
            Layout::Fields { output, .. } => {
                let one =
                    |field: &OutputField| (field.size(), field.name(), field.kind(), field.description());
                place(self.axes, &output.iter().map(one).collect::<Vec<_>>())
            }
            Layout::Speed { output, .. } => place(1, with_torque(&SPEED_OUTPUT, *output)),
        }
    }

    /// The bytes of the control words in the output assembly.
    pub fn control_words(&self) -> impl Iterator<Item = Range<usize>> {
        let words = self.output().into_iter().filter(|field| field.name == OutputField::Control.name());
        words.map(|field| field.offset..field.offset + field.len)
    }

    /// The fields of the input assembly in their order.
    #[must_use]
    pub fn input(&self) -> Vec<Placed> {
        match &self.layout {
            Layout::Fields { input, .. } => {
                let one =
                    |field: &InputField| (field.size(), field.name(), field.kind(), field.description());
                place(self.axes, &input.iter().map(one).collect::<Vec<_>>())
            }
            Layout::Speed { output, .. } => place(1, with_torque(&SPEED_INPUT, *output)),
        }
    }
}

/// Length, name, type and description of a field.
type Row = (usize, &'static str, &'static str, &'static str);

/// The rows of an assembly of the AC/DC drive profile: the last one is the torque.
fn with_torque(rows: &[Row; 4], assembly: Assembly) -> &[Row] {
    if assembly.has_torque() { rows } else { &rows[..3] }
}

const SPEED_OUTPUT: [Row; 4] = [
    (
        1,
        "control",
        "BYTE",
        "Bits of the AC/DC drive profile: 0 run forward, 1 run reverse, 2 fault reset, 5 control from network, 6 reference from network.",
    ),
    (1, "pad_8", "USINT", "Not used."),
    (2, "speed_reference", "INT", "Speed, rpm."),
    (2, "torque_reference", "INT", "Torque, Nm / 2^TorqueScale."),
];

const SPEED_INPUT: [Row; 4] = [
    (
        1,
        "status",
        "BYTE",
        "Bits of the AC/DC drive profile: 0 faulted, 1 warning, 2 running forward, 3 running reverse, 4 ready, 5 control from network, 6 reference from network, 7 at reference.",
    ),
    (1, "drive_state", "USINT", "State of the Control Supervisor; 0 in assemblies 70 and 72."),
    (2, "actual_speed", "INT", "Speed, rpm."),
    (2, "actual_torque", "INT", "Torque, Nm / 2^TorqueScale."),
];

fn place(axes: usize, rows: &[Row]) -> Vec<Placed> {
    let mut offset = 0;
    let mut placed = Vec::with_capacity(axes * rows.len());
    for axis in 0..axes {
        for &(len, name, kind, description) in rows {
            placed.push(Placed { axis, offset, len, name, kind, description });
            offset += len;
        }
    }
    placed
}

/// A size that has been checked to be below [`ASSEMBLY_LEN_MAX`] and its headers.
fn size(len: usize) -> u16 {
    u16::try_from(len).unwrap_or(u16::MAX)
}
