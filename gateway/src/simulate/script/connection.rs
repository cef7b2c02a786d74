//! `[connection]` and `[axis.N]`: everything about the device before the first step.

use std::net::Ipv4Addr;
use std::ops::RangeInclusive;

use profile_cip::controller::config::{KeyExpectation, MAX_AXES, TimeOuts};
use profile_cip::controller::limits::AxisLimits;
use profile_cip::controller::sets::DataSets;
use profile_cip::controller::{AttributeSet, AxisSetup, ControllerConfig, Scaling};
use profile_cip::wire::motion::codes::{
    ActualDataSet, CommandDataSet, CommandTarget, ControlMode, FeedbackMode, FeedbackSource, StatusDataSet,
    TimeDataSet,
};
use profile_cip::wire::motion::{FORMAT_REVISION, Format};
use profile_generic::time::DurationNs;
use toml::de::DeValue;

use super::attributes::{attribute, encode};
use super::reader::{Keys, Problems, Value, hex, table, time, words, wrong};
use crate::mapping::CipDictionary;
use crate::simulate::setup;

/// Update period where nothing is said.
const UPDATE_PERIOD: DurationNs = DurationNs::from_millis(8);
/// Update periods of silence after which the connection times out, with their codes.
pub(super) const MULTIPLIERS: [i128; 8] = [4, 8, 16, 32, 64, 128, 256, 512];
const DEFAULT_MULTIPLIER: u8 = 3;

pub(super) const MODES: &[(&str, ControlMode)] = &[
    ("position", ControlMode::POSITION),
    ("velocity", ControlMode::VELOCITY),
    ("acceleration", ControlMode::ACCELERATION),
    ("torque", ControlMode::TORQUE),
];
pub(super) const FEEDBACKS: &[(&str, FeedbackSource)] = &[
    ("none", FeedbackSource::NONE),
    ("master", FeedbackSource::MASTER),
    ("motor", FeedbackSource::MOTOR),
    ("load", FeedbackSource::LOAD),
    ("dual", FeedbackSource::DUAL),
];
pub(super) const TARGETS: &[(&str, CommandTarget)] = &[
    ("immediate", CommandTarget::IMMEDIATE),
    ("extrapolate", CommandTarget::EXTRAPOLATE),
    ("interpolate", CommandTarget::INTERPOLATE),
];
pub(super) const COMMANDS: &[(&str, CommandDataSet)] = &[
    ("position", CommandDataSet::POSITION),
    ("velocity", CommandDataSet::VELOCITY),
    ("acceleration", CommandDataSet::ACCELERATION),
    ("torque", CommandDataSet::TORQUE),
    ("unwind_count", CommandDataSet::UNWIND_COUNT),
    ("position_displacement", CommandDataSet::POSITION_DISPLACEMENT),
];
pub(super) const ACTUALS: &[(&str, ActualDataSet)] = &[
    ("position", ActualDataSet::POSITION),
    ("velocity", ActualDataSet::VELOCITY),
    ("acceleration", ActualDataSet::ACCELERATION),
    ("unwind_count", ActualDataSet::UNWIND_COUNT),
    ("position_displacement", ActualDataSet::POSITION_DISPLACEMENT),
];
pub(super) const STATUSES: &[(&str, StatusDataSet)] = &[
    ("fault", StatusDataSet::FAULT),
    ("alarm", StatusDataSet::ALARM),
    ("axis_status", StatusDataSet::AXIS_STATUS),
    ("io_status", StatusDataSet::IO_STATUS),
    ("safety_status", StatusDataSet::SAFETY_STATUS),
];
pub(super) const TIMES: &[(&str, TimeDataSet)] = &[
    ("update_diagnostics", TimeDataSet::UPDATE_DIAGNOSTICS),
    ("time_diagnostics", TimeDataSet::TIME_DIAGNOSTICS),
];
pub(super) const FORMATS: &[(&str, Format)] = &[("variable", Format::Variable), ("fixed", Format::Fixed)];
/// Keys for which an update of the fixed format has no room.
const VARIABLE_ONLY: [&str; 4] = ["connection_point", "grand_master", "size", "time_data"];
/// Connection points, which are format revisions.
const POINTS: RangeInclusive<i128> = 2..=3;
pub(super) const ACTUAL_POSITION_TYPES: &[(&str, bool)] = &[("DINT", false), ("LINT", true)];
pub(super) const POSITION_TYPES: &[(&str, bool)] = &[("LREAL", false), ("DINT", true)];

/// Time data of a list.
pub(super) fn time_data(value: &Value<'_>, problems: &Problems) -> Option<TimeDataSet> {
    Some(words(value, "time_data", TIMES, problems)?.into_iter().collect())
}

/// Data sets; what is not named stays as it was.
pub(super) fn data_sets(keys: &mut Keys<'_, '_>, before: DataSets) -> Option<DataSets> {
    let problems = keys.problems;
    let mut sets = before;
    if let Some(value) = keys.find("command") {
        sets.command = words(value, "command", COMMANDS, problems)?.into_iter().collect();
    }
    if let Some(value) = keys.find("actual") {
        sets.actual = words(value, "actual", ACTUALS, problems)?.into_iter().collect();
    }
    if let Some(value) = keys.find("status") {
        sets.status = words(value, "status", STATUSES, problems)?.into_iter().collect();
    }
    sets.integer_position = keys.word_or("position_type", POSITION_TYPES, before.integer_position)?;
    Some(sets)
}

/// Where the device and this controller are, if the script says so.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Places {
    /// The device.
    pub target: Option<Ipv4Addr>,
    /// This controller's own address.
    pub bind: Option<Ipv4Addr>,
}

/// The format of the connection, ahead of everything else: what an axis has by itself follows from it. What is wrong with
/// it is told with the rest of `[connection]`.
pub(super) fn format(value: Option<&Value<'_>>) -> Format {
    let named = value.and_then(|value| value.get_ref().as_table()).and_then(|table| table.get("format"));
    let fixed = named.and_then(|value| value.get_ref().as_str()) == Some("fixed");
    if fixed { Format::Fixed } else { Format::Variable }
}

/// The fixed format has no time stamps and one size.
fn fixed(keys: &mut Keys<'_, '_>, config: &mut ControllerConfig) -> Option<()> {
    let problems = keys.problems;
    for key in VARIABLE_ONLY {
        if let Some(value) = keys.find(key) {
            let title = format_args!("`{key}` does not go with the fixed format");
            return problems.report(value.span(), title, "expected it with format = \"variable\" only");
        }
    }
    if let Some(value) = keys.find("synchronous").filter(|value| value.get_ref().as_bool() != Some(false)) {
        return wrong(value, "synchronous", "false: the fixed format has no time stamps", problems);
    }
    config.set_fixed();
    Some(())
}

/// Reads `[connection]` into the configuration.
pub(super) fn connection(
    value: Option<&Value<'_>>,
    config: &mut ControllerConfig,
    dictionary: &CipDictionary,
    problems: &Problems,
) -> Option<Places> {
    config.list_identity = true;
    config.timeout_multiplier = DEFAULT_MULTIPLIER;
    config.time_outs = TimeOuts { initialization: setup::READY_TIME_OUT, ..TimeOuts::default() };
    config.rpi_us = micros(UPDATE_PERIOD);
    config.grand_master = Some(setup::HOST_CLOCK);
    let Some(value) = value else { return Some(Places::default()) };
    let mut keys = table(value, "[connection]", problems)?;
    let places = Places { target: address(&mut keys, "target")?, bind: address(&mut keys, "bind")? };
    if let Some(value) = keys.find("update_period") {
        let period = time(value, "update_period", problems)?;
        config.rpi_us = micros(period);
        if period.0 % 1_000 != 0 || !(100_000..=1_000_000_000).contains(&period.0) {
            return problems.report(
                value.span(),
                "this update period cannot be asked for",
                "expected whole microseconds, \"100 us\" to \"1 s\"",
            );
        }
    }
    if let Some(value) = keys.find("timeout_multiplier") {
        let found = super::reader::whole(value);
        let Some(code) = MULTIPLIERS.iter().position(|known| Some(*known) == found) else {
            return wrong(value, "timeout_multiplier", "4, 8, 16, 32, 64, 128, 256 or 512", problems);
        };
        config.timeout_multiplier = u8::try_from(code).unwrap_or(DEFAULT_MULTIPLIER);
    }
    match keys.word_or("format", FORMATS, Format::Variable)? {
        Format::Fixed => fixed(&mut keys, config)?,
        Format::Variable => variable(&mut keys, config)?,
    }
    config.command_target = keys.word_or("command_target", TARGETS, CommandTarget::INTERPOLATE)?;
    config.list_identity = keys.boolean_or("list_identity", true)?;
    config.update_delay_low_limit = keys.integer_or("late_after", 1..=255, 4)?;
    if let Some(value) = keys.find("give_up_after") {
        config.update_delay_high_limit = Some(keys.in_range("give_up_after", value, &(1..=255))?);
    }
    if let Some(value) = keys.find("power_structure") {
        config.power_structure =
            Some(keys.in_range("power_structure", value, &(0..=i128::from(u32::MAX)))?);
    }
    if let Some(value) = keys.find("key") {
        config.key = key(value, problems)?;
    }
    if let Some(value) = keys.find("wait") {
        config.time_outs = waits(value, config.time_outs, problems)?;
    }
    if let Some(value) = keys.find("attributes") {
        config.class_attributes = attribute_sets(value, true, dictionary, problems)?;
    }
    keys.finish()?;
    Some(places)
}

/// Synchronization, size and time data of the variable format.
fn variable(keys: &mut Keys<'_, '_>, config: &mut ControllerConfig) -> Option<()> {
    let problems = keys.problems;
    let synchronous = keys.boolean_or("synchronous", true)?;
    config.grand_master = match keys.find("grand_master") {
        Some(value) => {
            let bytes = hex(value, "grand_master", problems)?;
            let Ok(id) = <[u8; 8]>::try_from(bytes.as_slice()) else {
                return wrong(value, "grand_master", "8 bytes in hex", problems);
            };
            Some(id)
        }
        None => Some(setup::HOST_CLOCK),
    }
    .filter(|_| synchronous);
    if let Some(value) = keys.find("size") {
        config.connection_size = keys.in_range("size", value, &(50..=1400))?;
    }
    if let Some(value) = keys.find("time_data") {
        config.time_data = time_data(value, problems)?;
    }
    config.format_revision = keys.integer_or("connection_point", POINTS, FORMAT_REVISION)?;
    Some(())
}

fn micros(period: DurationNs) -> u32 {
    u32::try_from(period.0 / 1_000).unwrap_or(u32::MAX)
}

#[expect(clippy::option_option, reason = "absent is not wrong")]
fn address(keys: &mut Keys<'_, '_>, key: &'static str) -> Option<Option<Ipv4Addr>> {
    let Some(value) = keys.find(key) else { return Some(None) };
    let text = value.get_ref().as_str();
    match text.and_then(|text| text.parse().ok()) {
        Some(address) => Some(Some(address)),
        None => wrong(value, key, "an IPv4 address, such as \"192.0.2.10\"", keys.problems),
    }
}

fn key(value: &Value<'_>, problems: &Problems) -> Option<KeyExpectation> {
    const WORD: std::ops::RangeInclusive<i128> = 0..=0xFFFF;
    let mut keys = table(value, "the electronic key", problems)?;
    let key = KeyExpectation {
        vendor: keys.integer_or("vendor_id", WORD, 0)?,
        device_type: keys.integer_or("device_type", WORD, 0)?,
        product_code: keys.integer_or("product_code", WORD, 0)?,
        major_revision: keys.integer_or("major_revision", 0..=127, 0)?,
        minor_revision: keys.integer_or("minor_revision", 0..=255, 0)?,
        compatible: keys.boolean_or("compatible", false)?,
    };
    keys.finish()?;
    Some(key)
}

fn waits(value: &Value<'_>, before: TimeOuts, problems: &Problems) -> Option<TimeOuts> {
    let mut keys = table(value, "the waiting times", problems)?;
    let waits = TimeOuts {
        explicit: keys.duration_or("explicit", before.explicit)?,
        first_update: keys.duration_or("first_update", before.first_update)?,
        service: keys.duration_or("service", before.service)?,
        synchronization: keys.duration_or("synchronization", before.synchronization)?,
        initialization: keys.duration_or("initialization", before.initialization)?,
        axis_control: keys.duration_or("axis_control", before.axis_control)?,
        motion_margin: keys.duration_or("motion_margin", before.motion_margin)?,
    };
    keys.finish()?;
    Some(waits)
}

/// Attributes with their values: `{ "Stopping Action" = 1 }`; a table with `optional = true` may be refused.
pub(super) fn attribute_sets(
    value: &Value<'_>,
    class: bool,
    dictionary: &CipDictionary,
    problems: &Problems,
) -> Option<Vec<AttributeSet>> {
    let keys = table(value, "the attributes", problems)?;
    let mut sets = Vec::new();
    let mut good = true;
    for (name, span, value) in keys.keys() {
        let name = toml::Spanned::new(span, DeValue::String(name.into()));
        let (value, required) = match value.get_ref() {
            DeValue::Table(_) => {
                let mut keys = table(value, "the attribute", problems)?;
                let inner = keys.need("value");
                let optional = keys.boolean_or("optional", false);
                let finished = keys.finish();
                let (Some(inner), Some(optional), Some(())) = (inner, optional, finished) else {
                    good = false;
                    continue;
                };
                (inner, !optional)
            }
            _ => (value, true),
        };
        let set = attribute(&name, None, class, dictionary, problems).and_then(|attribute| {
            let value = encode(value, &attribute, dictionary, problems)?;
            Some(AttributeSet { selector: attribute.selector(), value, required })
        });
        match set {
            Some(set) => sets.push(set),
            None => good = false,
        }
    }
    good.then_some(sets)
}

/// How fast an axis moves where a step does not say.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct MotionDefaults {
    pub velocity: Option<f64>,
    pub acceleration: Option<f64>,
    pub jerk: Option<f64>,
}

/// Reads `[axis.N]`, from 1 on without gaps.
pub(super) fn axes(
    value: Option<&Value<'_>>,
    format: Format,
    dictionary: &CipDictionary,
    problems: &Problems,
) -> Option<Vec<(AxisSetup, MotionDefaults)>> {
    let Some(value) = value else {
        return problems.report(0..0, "there is no axis", "expected a table [axis.1]");
    };
    let keys = table(value, "[axis]", problems)?;
    let mut found: Vec<Option<(AxisSetup, MotionDefaults)>> = vec![None; MAX_AXES];
    let mut good = true;
    for (name, span, value) in keys.keys() {
        let number = name.parse::<usize>().ok().filter(|number| (1..=MAX_AXES).contains(number));
        let (Some(number), false) = (number, name.starts_with('0')) else {
            let title = format!("[axis.{name}] names no axis");
            problems.report::<()>(span, title, "expected an instance number, 1 to 16");
            good = false;
            continue;
        };
        found[number - 1] = axis(value, format, dictionary, problems);
        good &= found[number - 1].is_some();
    }
    if !good {
        return None;
    }
    let count = found.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
    found.truncate(count);
    if let Some(gap) = found.iter().position(Option::is_none) {
        let title = format!("[axis.{}] is missing", gap + 1);
        return problems.report(keys.span(), title, "expected the axes from 1 on without gaps");
    }
    if count == 0 {
        return problems.report(keys.span(), "there is no axis", "expected a table [axis.1]");
    }
    Some(found.into_iter().flatten().collect())
}

fn axis(
    value: &Value<'_>,
    format: Format,
    dictionary: &CipDictionary,
    problems: &Problems,
) -> Option<(AxisSetup, MotionDefaults)> {
    let mut keys = table(value, "the axis", problems)?;
    let mut setup = AxisSetup::unscaled();
    if let Some(value) = keys.find("counts_per_unit") {
        setup.scaling = match value.get_ref() {
            DeValue::String(text) if text == "device" => Scaling::Device,
            _ => match super::reader::number(value).filter(|counts| counts.is_finite() && *counts > 0.0) {
                Some(counts) => Scaling::Counts(counts),
                None => return wrong(value, "counts_per_unit", "a number above 0, or \"device\"", problems),
            },
        };
    }
    setup.control_mode = keys.word_or("mode", MODES, ControlMode::POSITION)?;
    let source = keys.word_or("feedback", FEEDBACKS, FeedbackSource::MOTOR)?;
    let lint = keys.word_or("actual_position_type", ACTUAL_POSITION_TYPES, false)?;
    setup.feedback_mode = FeedbackMode(source.0).with_lint(lint);
    if format == Format::Fixed {
        setup.sets = DataSets::fixed(setup.control_mode);
    }
    setup.sets = data_sets(&mut keys, setup.sets)?;
    if let Some(value) = keys.find("limits") {
        setup.limits = limits(value, problems)?;
    }
    let motion = match keys.find("motion") {
        Some(value) => {
            let mut keys = table(value, "the usual motion", problems)?;
            let motion = MotionDefaults {
                velocity: keys.maybe_number("velocity")?,
                acceleration: keys.maybe_number("acceleration")?,
                jerk: keys.maybe_number("jerk")?,
            };
            keys.finish()?;
            motion
        }
        None => MotionDefaults::default(),
    };
    if let Some(value) = keys.find("attributes") {
        setup.attributes = attribute_sets(value, false, dictionary, problems)?;
    }
    keys.finish()?;
    Some((setup, motion))
}

fn limits(value: &Value<'_>, problems: &Problems) -> Option<AxisLimits> {
    let mut keys = table(value, "the limits", problems)?;
    let mut above_zero = |key: &'static str| match keys.find(key) {
        Some(value) => match super::reader::number(value).filter(|n| n.is_finite() && *n > 0.0) {
            Some(number) => Some(Some(number)),
            None => wrong(value, key, "a number above 0", problems),
        },
        None => Some(None),
    };
    let (velocity, acceleration) = (above_zero("velocity")?, above_zero("acceleration")?);
    let torque = above_zero("torque")?;
    let (low, high) = (keys.maybe_number("position_min")?, keys.maybe_number("position_max")?);
    let position = match (low, high) {
        (None, None) => None,
        (Some(low), Some(high)) if low < high => Some((low, high)),
        _ => {
            let expected = "expected position_min and position_max, the first one below the second";
            return problems.report(keys.span(), "the position limits are no range", expected);
        }
    };
    keys.finish()?;
    Some(AxisLimits { velocity, acceleration, position, torque })
}
