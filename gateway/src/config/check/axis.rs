//! An `[[axis]]`.

use super::{Problems, limits, nameplate, value};
use crate::config::file::{AxisTable, LimitsTable};
use crate::config::{Axis, AxisFunction, AxisKind, DriveAt, Limits, StoppingAction};
use crate::finding::registry as code;
use crate::finding::{Problem, Spanned};
use crate::mapping::{CaptureMode, FeedbackUse};

/// What an axis counts in.
pub(in crate::config) const UNITS: [(&str, AxisKind); 2] =
    [("revolution", AxisKind::Rotary), ("millimetre", AxisKind::Linear)];

/// How captures are read.
pub(in crate::config) const EVENTS: [(&str, CaptureMode); 3] = [
    ("cyclic", CaptureMode::Cyclic),
    ("service-channel", CaptureMode::ServiceChannel),
    ("off", CaptureMode::Off),
];

/// What an axis can be.
pub(in crate::config) fn functions() -> [(&'static str, AxisFunction); 3] {
    AxisFunction::ALL.map(|function| (function.name(), function))
}

/// Whose encoder an axis can go by.
pub(in crate::config) fn feedback_uses() -> [(&'static str, FeedbackUse); 3] {
    FeedbackUse::ALL.map(|feedback| (feedback.name(), feedback))
}

/// What an axis can do when commands stay away.
pub(in crate::config) fn stopping_actions() -> [(&'static str, StoppingAction); 5] {
    StoppingAction::ALL.map(|action| (action.name(), action))
}

pub(super) fn check(
    problems: &mut Problems,
    table: &AxisTable,
    device: Option<usize>,
    drives: &[(&Spanned<String>, DriveAt)],
) -> Option<Axis> {
    let name = value::name(problems, "axis", &table.name);
    let instance = value::number(problems, &table.instance, "the instance", 1..=255);
    let drive = drives.iter().find(|(name, _)| name.get_ref() == table.drive.get_ref()).map(|(_, at)| *at);
    if drive.is_none() {
        problems.unknown("drive", &table.drive, drives.iter().map(|(name, _)| name.get_ref()));
    }
    let function = function(problems, table);
    let feedback = function.and_then(|function| feedback(problems, table, function, drive));
    let kind = value::word(problems, &table.unit, "axis unit", &UNITS);
    let counts = 1..=i64::from(i32::MAX);
    let motion_resolution = value::number_or(
        problems,
        &table.motion_resolution,
        "the motion resolution",
        counts.clone(),
        1_000_000,
    );
    let unwind_counts =
        value::optional(&table.unwind_counts, |value| value::number(problems, value, "the unwind", counts));
    let power_structure_axis_id = value::number_or(
        problems,
        &table.power_structure_axis_id,
        "the power structure axis ID",
        0..=i64::from(u32::MAX),
        0,
    );
    let limits = match &table.limits {
        Some(limits) => limits::check(problems, limits, table.unwind_counts.as_ref()),
        None => Some(Limits::default()),
    };
    let nameplate = nameplate::check(problems, table, kind);
    // A PDO more is much of a CAN bus.
    let usual = match drive {
        Some(DriveAt::Can { .. }) => CaptureMode::ServiceChannel,
        _ => CaptureMode::Cyclic,
    };
    let events = value::word_or(problems, table.events.as_ref(), "way to capture events", &EVENTS, usual);
    let on_command_loss = value::word_or(
        problems,
        table.on_command_loss.as_ref(),
        "stopping action",
        &stopping_actions(),
        StoppingAction::RampedDecelAndDisable,
    );
    Some(Axis {
        name: name?,
        instance: instance?,
        device: device?,
        drive: drive?,
        function: function?,
        kind: kind?,
        feedback: feedback?,
        motion_resolution: motion_resolution?,
        unwind_counts: unwind_counts?,
        power_structure_axis_id: power_structure_axis_id?,
        limits: limits?,
        nameplate: nameplate?,
        on_command_loss: on_command_loss?,
        events: events?,
    })
}

/// What the axis is, and whether that goes with the rest of its table.
fn function(problems: &mut Problems, table: &AxisTable) -> Option<AxisFunction> {
    let Some(name) = &table.function else { return Some(AxisFunction::Drive) };
    let function = value::word(problems, name, "axis function", &functions())?;
    if function == AxisFunction::Drive {
        return Some(function);
    }
    let limits = table.limits.as_ref().and_then(LimitsTable::first);
    let misfits = [
        (limits, "it is never moved"),
        (table.on_command_loss.as_ref().map(|value| ("on_command_loss", value.span())), "it is never moved"),
        (
            table
                .unwind_counts
                .as_ref()
                .filter(|_| function == AxisFunction::Converter)
                .map(|value| ("unwind_counts", value.span())),
            "it has no position",
        ),
    ];
    let before = problems.len();
    for ((key, span), why) in misfits.into_iter().filter_map(|(found, why)| Some((found?, why))) {
        let title = format!("an axis of function \"{}\" has no {key}", function.name());
        let problem = Problem::new(code::CONTRADICTION, span).title(title);
        let problem = problem.expected(format!("expected no {key}: {why}"));
        problems.push(problem.related(name.span(), "the function of the axis"));
    }
    (problems.len() == before).then_some(function)
}

/// Whose encoder the axis goes by, and whether function and drive have it.
fn feedback(
    problems: &mut Problems,
    table: &AxisTable,
    function: AxisFunction,
    drive: Option<DriveAt>,
) -> Option<FeedbackUse> {
    let Some(name) = &table.feedback else { return Some(FeedbackUse::Motor) };
    let feedback = value::word(problems, name, "use of the encoders", &feedback_uses())?;
    let why = match (feedback, function, drive) {
        (FeedbackUse::Motor, ..) => None,
        (_, _, Some(DriveAt::Devicenet { .. })) => {
            Some("a drive on DeviceNet shows the encoder of its motor only")
        }
        (_, AxisFunction::Converter, _) => Some("a converter has no position"),
        (FeedbackUse::Dual, AxisFunction::Encoder, _) => {
            Some("an axis that is never switched on shows one encoder: \"motor\" or \"load\"")
        }
        _ => None,
    };
    if let Some(why) = why {
        let title = format!("the axis cannot have feedback \"{}\"", feedback.name());
        let problem = Problem::new(code::CONTRADICTION, name.span()).title(title);
        problems.push(problem.expected(format!("expected feedback \"motor\", or none: {why}")));
        return None;
    }
    Some(feedback)
}

#[cfg(test)]
mod tests {
    use super::super::checked;
    use super::*;

    fn axis(drive: DriveAt, keys: &str) -> Result<Axis, Vec<String>> {
        let text = format!("name = \"x\"\ninstance = 1\ndrive = \"a\"\nunit = \"revolution\"\n{keys}");
        let name = Spanned::new(0..1, "a".to_owned());
        checked(&text, |problems, table| check(problems, table, Some(0), &[(&name, drive)]))
    }

    #[test]
    fn events_are_captured_over_the_service_channel_on_can_alone() {
        let events = |drive, keys| axis(drive, keys).map(|axis| axis.events);
        assert_eq!(events(DriveAt::Sercos { drive: 0 }, ""), Ok(CaptureMode::Cyclic));
        assert_eq!(events(DriveAt::Can { bus: 0, drive: 0 }, ""), Ok(CaptureMode::ServiceChannel));
        assert_eq!(events(DriveAt::Can { bus: 0, drive: 0 }, "events = \"off\""), Ok(CaptureMode::Off));
    }

    #[test]
    fn axis_goes_by_an_encoder_that_its_drive_has() {
        let feedback = |drive, keys: &str| axis(drive, keys).map(|axis| axis.feedback);
        let (sercos, can) = (DriveAt::Sercos { drive: 0 }, DriveAt::Can { bus: 0, drive: 0 });
        let devicenet = DriveAt::Devicenet { network: 0, drive: 0 };
        assert_eq!(feedback(sercos, ""), Ok(FeedbackUse::Motor));
        for of in FeedbackUse::ALL {
            let key = format!("feedback = \"{}\"", of.name());
            assert_eq!(feedback(sercos, &key), Ok(of));
            assert_eq!(feedback(can, &key), Ok(of));
            let encoder = feedback(can, &format!("function = \"encoder\"\n{key}"));
            assert_eq!(encoder.ok(), Some(of).filter(|of| *of != FeedbackUse::Dual));
            let supply = feedback(sercos, &format!("function = \"converter\"\n{key}"));
            assert_eq!(supply.ok(), Some(of).filter(|of| *of == FeedbackUse::Motor));
            assert_eq!(feedback(devicenet, &key).ok(), Some(of).filter(|of| *of == FeedbackUse::Motor));
        }
        let refused = vec!["the axis cannot have feedback \"load\"".to_owned()];
        assert_eq!(feedback(devicenet, "feedback = \"load\""), Err(refused));
    }

    #[test]
    fn an_axis_that_never_moves_has_no_limits_and_no_stopping() {
        let keys = "function = \"converter\"\nunwind_counts = 5\non_command_loss = \"disable-and-coast\"\nlimits = { velocity = 1.0 }";
        let titles = ["velocity", "on_command_loss", "unwind_counts"];
        let titles = titles.map(|key| format!("an axis of function \"converter\" has no {key}"));
        assert_eq!(axis(DriveAt::Sercos { drive: 0 }, keys), Err(titles.to_vec()));
        let unknown = axis(DriveAt::Sercos { drive: 0 }, "function = \"pump\"\non_command_loss = \"fall\"");
        assert_eq!(
            unknown,
            Err(vec!["unknown axis function `pump`".to_owned(), "unknown stopping action `fall`".to_owned()])
        );
    }
}
