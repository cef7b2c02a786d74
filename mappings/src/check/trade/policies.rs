//! What an axis cannot do without does not go missing in silence.
//!
//! A policy says what happens where a drive lacks a value or refuses a step. The weaker one of the two lets the axis come to
//! operation without it: good for what is only read, and not for a set-point, a mode or a limit.

use super::facts::{ALWAYS_THERE, LIMITS, MODE_STEPS, REQUIRED, REQUIRED_OF_SERCOS, WITHOUT_ENCODER};
use super::{Reporter, is_standard};
use crate::Mapping;
use crate::dictionary::Access;
use crate::finding::Findings;
use crate::finding::registry::POLICY_WEAK;
use crate::format::{CipAttributeRow, Name};

/// Attributes that may be accepted without effect, all together.
const STORED_MAX: usize = 20;

/// The parameter of an attribute that the gateway compares with others where a drive has none.
const STOPPING_TORQUE: &str = "stopping_torque";

/// Parameters of attributes that the gateway watches an axis by where a drive has none, or computes with.
const WATCHED: [&str; 20] = [
    "velocity_error_tolerance",
    "velocity_error_tolerance_time",
    "over_torque_limit",
    "over_torque_limit_time",
    "under_torque_limit",
    "under_torque_limit_time",
    "velocity_threshold",
    "torque_threshold",
    "over_speed_user_limit",
    "motor_temperature_user_limit",
    "drive_temperature_user_limit",
    "bus_overvoltage_user_limit",
    "bus_undervoltage_user_limit",
    "zero_speed",
    "feedback_acceleration_filter",
    "load_feedback_unit",
    "load_feedback_resolution",
    "load_feedback_interpolation",
    "system_inertia",
    "acceleration_feed_forward_gain",
];

pub(super) fn sercos(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let mut reporter = Reporter { source: &file.text, findings };
    for row in &file.rows.signal {
        if is_standard(row.idn.get_ref()) {
            signal(&mut reporter, &row.signal, &row.missing, &[]);
        }
        if row.signal.get_ref() == REQUIRED_OF_SERCOS {
            required(&mut reporter, &row.signal, &row.missing);
        }
    }
    for row in file.rows.scaling.iter().filter(|row| row.scaling.get_ref() == "position" && !row.exact) {
        let what = [
            "positions may be rounded in silence".to_owned(),
            "a position that does not come back exactly drifts: a drive whose scaling does not fit is refused"
                .to_owned(),
            "write `exact = true`".to_owned(),
        ];
        reporter.report(POLICY_WEAK, ("scaling", row.scaling.span()), what);
    }
    for row in &file.rows.mode {
        mode(&mut reporter, &row.mode, row.interpolation.as_ref(), &row.missing);
    }
    for row in &file.rows.commission {
        step(&mut reporter, &row.step, row.parameter.as_ref(), &row.refused);
    }
}

pub(super) fn cia402(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_cia402;
    let mut reporter = Reporter { source: &file.text, findings };
    for row in &file.rows.signal {
        if is_standard(row.object.get_ref()) {
            signal(&mut reporter, &row.signal, &row.missing, &row.modes);
        }
    }
    for row in &file.rows.mode {
        mode(&mut reporter, &row.mode, row.interpolation.as_ref(), &row.missing);
    }
    for row in &file.rows.commission {
        step(&mut reporter, &row.step, row.parameter.as_ref(), &row.refused);
    }
}

/// A cyclic value of a drive, or of some of its modes.
fn signal(reporter: &mut Reporter<'_>, name: &Name, missing: &Name, modes: &[Name]) {
    let (mode, shown) = WITHOUT_ENCODER;
    let without_encoder = modes.iter().any(|name| name.get_ref() == mode);
    let is = |wanted: &str| name.get_ref() == wanted;
    let required = if without_encoder {
        is(shown) || !is("position_actual") && REQUIRED.contains(&name.get_ref().as_str())
    } else {
        REQUIRED.contains(&name.get_ref().as_str())
    };
    if required {
        self::required(reporter, name, missing);
    }
}

/// A value that no axis can do without.
fn required(reporter: &mut Reporter<'_>, name: &Name, missing: &Name) {
    if missing.get_ref() != "refuse" {
        let what = [
            format!("`{}` may be missing in silence", name.get_ref()),
            "a drive that lacks it would come to operation, and the mode needs it".to_owned(),
            "write `missing = \"refuse\"`".to_owned(),
        ];
        reporter.report(POLICY_WEAK, ("missing", missing.span()), what);
    }
}

/// A mode of which the controller makes the set-points: one that is configured is there.
fn mode(reporter: &mut Reporter<'_>, name: &Name, interpolation: Option<&Name>, missing: &Name) {
    let by_drive = interpolation.is_some_and(|name| name.get_ref() == "drive");
    if !by_drive && missing.get_ref() != "refuse" {
        let what = [
            format!("the operating mode `{}` may be missing in silence", name.get_ref()),
            "a drive that lacks a mode of its axis would come to operation without it".to_owned(),
            "write `missing = \"refuse\"`; an axis that does without the mode has `modes` of its own"
                .to_owned(),
        ];
        reporter.report(POLICY_WEAK, ("missing", missing.span()), what);
    }
}

/// A step of commissioning.
fn step(reporter: &mut Reporter<'_>, step: &Name, parameter: Option<&Name>, refused: &Name) {
    let limit = parameter.filter(|name| LIMITS.contains(&name.get_ref().as_str()));
    let what = match limit {
        Some(limit) => format!("the limit `{}` of the configuration", limit.get_ref()),
        None if MODE_STEPS.contains(&step.get_ref().as_str()) => "the operating mode".to_owned(),
        None => return,
    };
    if refused.get_ref() != "fail" {
        let what = [
            format!("`{}` may fail in silence", limit.unwrap_or(step).get_ref()),
            format!("a drive that refuses {what} would come to operation without it"),
            "write `refused = \"fail\"`".to_owned(),
        ];
        reporter.report(POLICY_WEAK, ("refused", refused.span()), what);
    }
}

/// Elements and attributes of CIP Motion, and exceptions that nobody is told.
pub(super) fn cip(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().cip_generic;
    let mut reporter = Reporter { source: &file.text, findings };
    for row in &file.rows.cyclic {
        let always = row.element.get_ref() == ALWAYS_THERE;
        let right = if always { "zero" } else { "absent" };
        if row.missing.get_ref() != right {
            let element = row.element.get_ref();
            let what = [
                format!("`{element}` is not told as missing"),
                match always {
                    true => "every update has the position: of a drive that is gone, the last one".to_owned(),
                    false => "the controller would take 0 for a value that nobody has".to_owned(),
                },
                format!("write `missing = \"{right}\"`"),
            ];
            reporter.report(POLICY_WEAK, ("missing", row.missing.span()), what);
        }
    }
    for row in &file.rows.attribute {
        let Some(attribute) = mapping.dictionaries.cip.attribute(row.attribute.get_ref()) else { continue };
        // What a controller only reads cannot be what it has set.
        if let Some(missing) = row
            .missing
            .as_ref()
            .filter(|missing| attribute.access == Access::Get && missing.get_ref() != "reject")
        {
            let what = [
                format!("`{}` is not told as missing", attribute.name),
                "of a drive without the parameter the controller would read a value that nobody has"
                    .to_owned(),
                "remove `missing`".to_owned(),
            ];
            reporter.report(POLICY_WEAK, ("missing", missing.span()), what);
        }
        if let Some(missing) = row.missing.as_ref().filter(|missing| missing.get_ref() == "device")
            && !goes_by(mapping, row, attribute.id)
        {
            let what = [
                format!("`{}` would be accepted without effect", attribute.name),
                "the gateway goes by the attributes of [sequence], by Stopping Torque and by what it watches alone"
                    .to_owned(),
                "remove `missing`".to_owned(),
            ];
            reporter.report(POLICY_WEAK, ("missing", missing.span()), what);
        }
    }
    let stored = |word: &&Name| word.get_ref() == "stored";
    let stored = file.rows.attribute.iter().filter_map(|row| {
        let word = row.served_by.as_ref().filter(stored).or(row.missing.as_ref().filter(stored));
        word.map(|word| (row, word))
    });
    for (row, word) in stored.skip(STORED_MAX) {
        let what = [
            format!("`{}` would be accepted without effect", row.attribute.get_ref()),
            format!("there are {STORED_MAX} attributes already that have none"),
            "remove the row, or name what it does".to_owned(),
        ];
        reporter.report(POLICY_WEAK, ("served_by", word.span()), what);
    }
    for row in &file.rows.fault {
        if let Some(default) = row.default.as_ref().filter(|action| action.get_ref() == "Ignore") {
            let what = [
                format!("`{}` is ignored until the controller asks for it", row.cause.get_ref()),
                "the controller would not be told: no alarm and no fault comes of it".to_owned(),
                "write `default = \"Alarm\"`, or remove `default`".to_owned(),
            ];
            reporter.report(POLICY_WEAK, ("default", default.span()), what);
        }
    }
}

/// Whether the gateway does something with the value of an attribute where the drive has no parameter for it.
fn goes_by(mapping: &Mapping, row: &CipAttributeRow, id: u16) -> bool {
    let sequence = &mapping.cip.sequence;
    let ids = [
        sequence.stopping_time_limit,
        sequence.coasting_time_limit,
        sequence.brake_release_delay,
        sequence.brake_engage_delay,
        sequence.zero_speed,
        sequence.zero_speed_time,
        sequence.ramp_velocity_positive,
        sequence.ramp_velocity_negative,
        sequence.ramp_acceleration,
        sequence.ramp_deceleration,
        sequence.deceleration_limit,
    ];
    let watched =
        |name: &Name| name.get_ref() == STOPPING_TORQUE || WATCHED.contains(&name.get_ref().as_str());
    ids.contains(&id) || row.parameter.as_ref().is_some_and(watched)
}
