//! What the controller is told before it starts.

use core::fmt;

use super::axis_set::AxisSet;
use super::failure::Failure;
use super::format;
use super::limits::AxisLimits;
use super::sets::{DataSets, cyclic_len};
use crate::wire::class1::SEQUENCE_COUNT_LEN;
use crate::wire::motion::attribute_list::AttributeSelector;
use crate::wire::motion::codes::{CommandTarget, ControlMode, FeedbackMode, FeedbackSource, TimeDataSet};
use crate::wire::motion::{FORMAT_REVISION, Format, fixed};
use profile_generic::time::DurationNs;

/// Most axis instances of one connection; the EtherNet/IP part of the standard (IEC 61800-7-302) allows 16.
pub const MAX_AXES: usize = 16;
/// Largest connection size in bytes; what fits one Ethernet frame without fragments.
pub const CONNECTION_SIZE_MAX: u16 = 1400;
/// Room of the service channel beside the cyclic data, in bytes; the default connection has it.
const SERVICE_ROOM: usize = 192;
/// Room of the service channel below which hardly an attribute fits.
const SERVICE_ROOM_MIN: usize = 32;

/// Connection size of the fixed format: 16 octets and the sequence count, clause 6-2.7.3.
#[expect(clippy::cast_possible_truncation, reason = "18")]
pub const CONNECTION_SIZE_FIXED: u16 = (SEQUENCE_COUNT_LEN + fixed::LEN) as u16;

/// A value to be written by Set_Axis_Attributes_List.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AttributeSet {
    /// Attribute ID, element size and array part.
    pub selector: AttributeSelector,
    /// The value in wire order; as long as `selector` says.
    pub value: Vec<u8>,
    /// Whether the start-up fails when the device refuses it.
    pub required: bool,
}

macro_rules! typed {
    ($($(#[$doc:meta])* $name:ident($kind:ty);)*) => {$(
        $(#[$doc])*
        #[must_use]
        pub fn $name(id: u16, value: $kind) -> Self {
            Self::bytes(id, &value.to_le_bytes())
        }
    )*};
}

impl AttributeSet {
    /// A single value in wire order; at most 255 bytes count.
    #[must_use]
    pub fn bytes(id: u16, value: &[u8]) -> Self {
        let size = u8::try_from(value.len()).unwrap_or(u8::MAX);
        let value = value[..usize::from(size)].to_vec();
        Self { selector: AttributeSelector::scalar(id, size), value, required: true }
    }

    typed! {
        /// A USINT, BYTE or BOOL.
        usint(u8);
        /// A UINT or WORD.
        uint(u16);
        /// A UDINT or DWORD.
        udint(u32);
        /// A DINT.
        dint(i32);
        /// A LINT.
        lint(i64);
        /// A REAL.
        real(f32);
        /// An LREAL.
        lreal(f64);
    }

    /// The same value, but a refusal is only reported.
    #[must_use]
    pub fn optional(mut self) -> Self {
        self.required = false;
        self
    }
}

/// What the device is expected to be: the electronic key of the Forward_Open. Zero matches anything.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct KeyExpectation {
    /// Vendor ID.
    pub vendor: u16,
    /// Device type; CIP Motion drives have 0x25.
    pub device_type: u16,
    /// Product code.
    pub product_code: u16,
    /// Major revision, 0..=127.
    pub major_revision: u8,
    /// Minor revision.
    pub minor_revision: u8,
    /// Whether a compatible revision will do.
    pub compatible: bool,
}

/// Counts (position control units) in a unit of the program.
///
/// The unit of the program is the one that the device counts velocity in, since velocities go out in units/s
/// and accelerations in units/s² (Table 5-2.8). A device that scales (attribute 45 is 1) has Motion Counts and
/// Motion Units, and this is its Motion Resolution, attribute 78. One that does not has counts and units of
/// its feedback or motor, and this is the resolution of that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scaling {
    /// Nobody knows: the axis is watched, enabled and asked, and never moved.
    Unknown,
    /// So many counts; above zero.
    Counts(f64),
    /// What the device says in Motion Resolution (78), if it scales (attribute 45 is 1).
    Device,
}

/// One axis of the device; its instance number is its place in [`ControllerConfig::axes`], counted from 1.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisSetup {
    /// Counts in a unit.
    pub scaling: Scaling,
    /// Control Mode at the start; steps change it.
    pub control_mode: ControlMode,
    /// Feedback Mode sent in every update; steps change it.
    pub feedback_mode: FeedbackMode,
    /// What goes to the device and what is asked of it in every update; steps change it.
    pub sets: DataSets,
    /// What no step may go beyond.
    pub limits: AxisLimits,
    /// Counts of a machine cycle, for a device that unwinds the axis: Cyclic Unwind Position, attribute 84, which
    /// `attributes` has to set like Cyclic Unwind Control, attribute 83. Both data sets have to hold the Unwind Cycle Count;
    /// programs go on counting over the cycles.
    pub unwind: Option<u32>,
    /// Attributes written before Configuration Complete, in this order.
    pub attributes: Vec<AttributeSet>,
}

impl AxisSetup {
    /// A position-controlled axis on its motor feedback, commanded in LREAL with velocity feed-forward.
    #[must_use]
    pub fn position(counts_per_unit: f64) -> Self {
        Self { scaling: Scaling::Counts(counts_per_unit), ..Self::unscaled() }
    }

    /// The same axis, of which nobody knows the scaling: it does not move.
    #[must_use]
    pub fn unscaled() -> Self {
        Self {
            scaling: Scaling::Unknown,
            control_mode: ControlMode::POSITION,
            feedback_mode: FeedbackMode(FeedbackSource::MOTOR.0),
            sets: DataSets::default(),
            limits: AxisLimits::default(),
            unwind: None,
            attributes: Vec::new(),
        }
    }
}

impl AxisSetup {
    /// Whether Command Position can be so many counts: a DINT, of an axis that the device unwinds a DINT of cycles as well.
    pub(super) fn has_room_for(&self, counts: f64) -> bool {
        let counts = self.unwind.map_or(counts, |unwind| counts / f64::from(unwind));
        (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&counts)
    }
}

/// How long the controller waits for what.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimeOuts {
    /// For the answer to an explicit request.
    pub explicit: DurationNs,
    /// For the first D-to-C update after the connection was opened.
    pub first_update: DurationNs,
    /// For the answer to a request in the service channel.
    pub service: DurationNs,
    /// For Group_Sync and then for Sync Mode; clause 7-1.3 asks for at least a minute.
    pub synchronization: DurationNs,
    /// For all axes to leave the Initializing state.
    pub initialization: DurationNs,
    /// For the acknowledge of an Axis Control request.
    pub axis_control: DurationNs,
    /// Beyond the planned length of a motion.
    pub motion_margin: DurationNs,
}

impl Default for TimeOuts {
    fn default() -> Self {
        Self {
            explicit: DurationNs::from_secs(5),
            first_update: DurationNs::from_secs(5),
            service: DurationNs::from_secs(5),
            synchronization: DurationNs::from_secs(60),
            initialization: DurationNs::from_secs(10),
            axis_control: DurationNs::from_secs(10),
            motion_margin: DurationNs::from_secs(5),
        }
    }
}

/// When in its update cycle the controller works and sends (clause 2-1.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TimingModel {
    /// The Controller Task runs at the start of each cycle and sends at once.
    #[default]
    Immediate,
    /// The task runs a third of the period into the cycle and sends at once: what the device measured at the start of the cycle
    /// counts in the command that it has at the end.
    OneCycle,
    /// The task runs half a period into the cycle and sends what the task before has planned.
    TwoCycle,
    /// The task runs at the start of the cycle and sends what the task before has planned.
    ThreeCycle,
}

impl TimingModel {
    /// From the start of an update cycle to the Controller Task.
    #[must_use]
    pub fn phase(self, period: DurationNs) -> DurationNs {
        match self {
            Self::Immediate | Self::ThreeCycle => DurationNs::ZERO,
            Self::OneCycle => DurationNs(period.as_nanos() / 3),
            Self::TwoCycle => DurationNs(period.as_nanos() / 2),
        }
    }

    /// Whether a task plans for the next update cycle, and sends what was planned for this one.
    #[must_use]
    pub const fn plans_ahead(self) -> bool {
        matches!(self, Self::TwoCycle | Self::ThreeCycle)
    }
}

/// Everything about the device and the connection to it.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerConfig {
    /// Vendor ID of this originator.
    pub originator_vendor: u16,
    /// Serial number of this originator.
    pub originator_serial: u32,
    /// Serial number of the connection.
    pub connection_serial: u16,
    /// Ask who the device is by ListIdentity before the session is registered.
    pub list_identity: bool,
    /// What the device is expected to be.
    pub key: KeyExpectation,
    /// Drive Power Structure Class ID that the device has to verify; `None` leaves it unverified.
    pub power_structure: Option<u32>,
    /// Controller Update Period in microseconds, which is the RPI of both directions.
    pub rpi_us: u32,
    /// Format of the motion connection. What the fixed one has not, no step may ask for.
    pub format: Format,
    /// Connection point of the motion connection, which is its Format Revision: 2, or in the variable format 3, with a run/idle header
    /// in front of each update.
    pub format_revision: u8,
    /// Connection Timeout Multiplier code, 0..=7 for 4..512 intervals.
    pub timeout_multiplier: u8,
    /// Connection size of both directions in bytes with the 2-byte sequence count; above 511 the connection
    /// is opened with Large_Forward_Open. In the fixed format [`CONNECTION_SIZE_FIXED`].
    pub connection_size: u16,
    /// Connection ID for the D-to-C datagrams.
    pub t_to_o_id: u32,
    /// UDP port at which this controller wants the D-to-C datagrams if not 2222.
    pub t_to_o_port: Option<u16>,
    /// Grand master clock of the controller, bytes as in the Time Sync object; `None` runs asynchronously: no
    /// Group_Sync, no time stamps.
    pub grand_master: Option<[u8; 8]>,
    /// Update for which the commands are meant: in the variable format in synchronous operation, in the fixed one what
    /// Command Control (attribute 92) is set to.
    pub command_target: CommandTarget,
    /// When the controller works and sends.
    pub timing: TimingModel,
    /// D-to-C updates older than this many update periods count as late.
    pub update_delay_low_limit: u8,
    /// Consecutive update periods without a D-to-C update after which the controller gives up before the
    /// connection times out; `None` leaves it to the connection.
    pub update_delay_high_limit: Option<u8>,
    /// Diagnostics in the header that every D-to-C update is asked for; steps change them. Time stamp and time
    /// offset go by themselves.
    pub time_data: TimeDataSet,
    /// Attributes of the class (instance 0), written first.
    pub class_attributes: Vec<AttributeSet>,
    /// The axes of the device; the first is instance 1.
    pub axes: Vec<AxisSetup>,
    /// Axes whose drives may come later: the program begins while they are still in Initializing.
    pub late: AxisSet,
    /// Waiting times.
    pub time_outs: TimeOuts,
}

impl ControllerConfig {
    /// A connection of 2 ms and time-out after 16 ms to whatever device answers, synchronous to
    /// `grand_master` with interpolation, for these axes.
    #[must_use]
    pub fn new(grand_master: Option<[u8; 8]>, axes: Vec<AxisSetup>) -> Self {
        let wanted = cyclic_len(&axes) + SERVICE_ROOM;
        let connection_size =
            u16::try_from(wanted).unwrap_or(CONNECTION_SIZE_MAX).clamp(500, CONNECTION_SIZE_MAX);
        Self {
            originator_vendor: 0xFFFF,
            originator_serial: 1,
            connection_serial: 1,
            list_identity: false,
            key: KeyExpectation::default(),
            power_structure: None,
            rpi_us: 2_000,
            format: Format::Variable,
            format_revision: FORMAT_REVISION,
            timeout_multiplier: 1,
            connection_size,
            t_to_o_id: 0x4258_0001,
            t_to_o_port: None,
            grand_master,
            command_target: CommandTarget::INTERPOLATE,
            timing: TimingModel::Immediate,
            update_delay_low_limit: 2,
            update_delay_high_limit: None,
            time_data: TimeDataSet::UPDATE_DIAGNOSTICS,
            class_attributes: Vec::new(),
            axes,
            late: AxisSet::NONE,
            time_outs: TimeOuts::default(),
        }
    }

    /// A connection of the fixed format for this axis, asynchronous as that always is. What travels of the axis is
    /// [`DataSets::fixed`] for its Control Mode.
    #[must_use]
    pub fn fixed(axis: AxisSetup) -> Self {
        let sets = DataSets::fixed(axis.control_mode);
        let mut config = Self::new(None, vec![AxisSetup { sets, ..axis }]);
        config.set_fixed();
        config
    }

    /// Changes the connection over to the fixed format: no grand master, no time data, 18 bytes. The data sets of the axis
    /// have to be those of [`DataSets::fixed`], or what else an update has room for.
    pub const fn set_fixed(&mut self) {
        self.format = Format::Fixed;
        self.grand_master = None;
        self.connection_size = CONNECTION_SIZE_FIXED;
        self.time_data = TimeDataSet::empty();
    }

    /// The Controller Update Period.
    #[must_use]
    pub fn period(&self) -> DurationNs {
        DurationNs::from_micros(i64::from(self.rpi_us))
    }

    /// Silence in one direction after which the connection has timed out.
    #[must_use]
    pub fn connection_timeout(&self) -> DurationNs {
        self.period() * (4_i64 << self.timeout_multiplier.min(7))
    }

    /// Finds what cannot work, before anything is sent.
    ///
    /// # Errors
    /// The first value out of its range.
    // Flat: one line per value, each with its error.
    pub fn check(&self) -> Result<(), ConfigError> {
        if self.axes.is_empty() || self.axes.len() > MAX_AXES {
            let count = u32::try_from(self.axes.len()).unwrap_or(u32::MAX);
            return bad("number of axes", f64::from(count), "1 to 16");
        }
        if !(100..=1_000_000).contains(&self.rpi_us) {
            return bad("rpi_us", f64::from(self.rpi_us), "100 to 1000000");
        }
        if self.timeout_multiplier > 7 {
            return bad("timeout_multiplier", f64::from(self.timeout_multiplier), "0 to 7");
        }
        let least = cyclic_len(&self.axes) + SERVICE_ROOM_MIN;
        if self.format == Format::Fixed {
            format::check_fixed(self).map_err(|wanted| ConfigError::Fixed { wanted })?;
        } else if usize::from(self.connection_size) < least || self.connection_size > CONNECTION_SIZE_MAX {
            let wanted = "room for the data sets of all axes and a service, and at most 1400";
            return bad("connection_size", f64::from(self.connection_size), wanted);
        }
        if self.command_target.0 > 2 {
            return bad("command_target", f64::from(self.command_target.0), "0 to 2");
        }
        if self.key.major_revision > 127 {
            return bad("major_revision", f64::from(self.key.major_revision), "0 to 127");
        }
        self.axes.iter().try_for_each(check_axis)
    }
}

/// The first value of an axis that is out of its range.
fn check_axis(axis: &AxisSetup) -> Result<(), ConfigError> {
    if let Scaling::Counts(scale) = axis.scaling
        && !(scale.is_finite() && scale > 0.0)
    {
        return bad("counts_per_unit", scale, "a finite number above zero");
    }
    if !(1..=4).contains(&axis.control_mode.0) {
        let wanted = "1 (position), 2 (velocity), 3 (acceleration) or 4 (torque)";
        return bad("control_mode", f64::from(axis.control_mode.0), wanted);
    }
    if let Some((what, value)) = axis.limits.first_bad() {
        return bad(what, value, "a finite number above zero, and the lower position below the upper one");
    }
    Ok(())
}

fn bad(what: &'static str, value: f64, wanted: &'static str) -> Result<(), ConfigError> {
    Err(ConfigError::Value { what, value, wanted })
}

/// What cannot work in a configuration or a program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ConfigError {
    /// A value of the configuration.
    Value {
        /// The value's name.
        what: &'static str,
        /// The value.
        value: f64,
        /// What it may be.
        wanted: &'static str,
    },
    /// Something that the fixed connection format cannot carry.
    Fixed {
        /// What it can.
        wanted: &'static str,
    },
    /// A step of the program that would fail for certain.
    Step {
        /// Place in the program, from 0.
        step: usize,
        /// Why.
        failure: Failure,
    },
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Value { what, value, wanted } => write!(f, "{what}: expected {wanted}, found {value}"),
            Self::Fixed { wanted } => write!(f, "the fixed connection format has {wanted}"),
            Self::Step { step, failure } => write!(f, "step {step}: {failure}"),
        }
    }
}

impl std::error::Error for ConfigError {}

/// Attribute Command Control, which a service sets where the updates do not carry it (footnote of Table 5-2.16).
const COMMAND_CONTROL: u16 = 92;
/// Command Position Data Type in Command Control: DINT.
const DINT: u8 = 0b0100;

/// Command Control as one value: the type of the position, and the update that commands are meant for.
pub(super) fn command_control(target: CommandTarget) -> AttributeSet {
    AttributeSet::usint(COMMAND_CONTROL, DINT | target.0).optional()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_take_their_wire_form() {
        let real = AttributeSet::real(461, 1.5);
        assert_eq!((real.selector.id, real.selector.element_size, real.required), (461, 4, true));
        assert_eq!(real.value, [0, 0, 0xC0, 0x3F]);
        assert_eq!(AttributeSet::lreal(1, -2.0).value, [0, 0, 0, 0, 0, 0, 0, 0xC0]);
        assert_eq!(AttributeSet::dint(1, -2).value, [0xFE, 0xFF, 0xFF, 0xFF]);
        assert!(!AttributeSet::usint(610, 1).optional().required);
        assert_eq!(AttributeSet::bytes(7, &[1; 300]).selector.value_len(), Some(255));
    }

    #[test]
    fn a_sound_configuration_passes_and_each_bad_value_is_named() {
        let good = ControllerConfig::new(None, vec![AxisSetup::position(1000.0)]);
        assert_eq!(good.check(), Ok(()));
        assert_eq!(good.connection_timeout(), DurationNs::from_millis(16));
        type Spoil = fn(&mut ControllerConfig);
        let broken: [(Spoil, &str); 9] = [
            (|c| c.axes.clear(), "number of axes: expected 1 to 16, found 0"),
            (|c| c.rpi_us = 50, "rpi_us: expected 100 to 1000000, found 50"),
            (|c| c.timeout_multiplier = 8, "timeout_multiplier: expected 0 to 7, found 8"),
            (
                |c| c.connection_size = 133,
                "connection_size: expected room for the data sets of all axes and a service, and at most \
                 1400, found 133",
            ),
            (|c| c.command_target = CommandTarget(3), "command_target: expected 0 to 2, found 3"),
            (|c| c.key.major_revision = 128, "major_revision: expected 0 to 127, found 128"),
            (
                |c| c.axes[0].scaling = Scaling::Counts(-1.0),
                "counts_per_unit: expected a finite number above zero, found -1",
            ),
            (
                |c| c.axes[0].control_mode = ControlMode::NO_CONTROL,
                "control_mode: expected 1 (position), 2 (velocity), 3 (acceleration) or 4 (torque), found 0",
            ),
            (
                |c| c.axes[0].limits.position = Some((2.0, 1.0)),
                "position limits: expected a finite number above zero, and the lower position below the \
                 upper one, found 2",
            ),
        ];
        for (spoil, text) in broken {
            let mut config = good.clone();
            spoil(&mut config);
            assert_eq!(config.check().unwrap_err().to_string(), text);
        }
    }
}
