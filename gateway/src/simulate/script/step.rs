//! `[[step]]`: one verb with its arguments, and what goes with any verb.

use std::ops::Range;

use profile_cip::controller::program::AxisSet;
use profile_cip::controller::{ControllerConfig, Step};
use profile_cip::wire::motion::codes::AxisControl;
use profile_cip::wire::status::GeneralStatus;
use profile_generic::time::DurationNs;
use toml::de::DeValue;

use super::connection::{MotionDefaults, TARGETS, time_data};
use super::reader::{Keys, Problems, Value, folded, table, time, title, verb, whole, word_of, wrong};
use super::{events, exchange, expect, misbehave, motion};
use crate::mapping::CipDictionary;

/// What steps are checked against.
pub(super) struct Frame<'a> {
    pub config: &'a ControllerConfig,
    pub motion: &'a [MotionDefaults],
    pub dictionary: &'a CipDictionary,
    pub problems: &'a Problems,
}

/// A verb: its name, and how its arguments make a step.
type Verb = (&'static str, fn(&Value<'_>, &Frame<'_>, &mut Modifiers<'_>) -> Option<Step>);

/// Every verb.
pub(super) const VERBS: &[Verb] = &[
    ("enable", |v, f, m| request(v, f, m, AxisControl::ENABLE, Step::Enable)),
    ("disable", |v, f, m| request(v, f, m, AxisControl::DISABLE, Step::Disable)),
    ("shutdown", |v, f, m| request(v, f, m, AxisControl::SHUTDOWN, Step::Shutdown)),
    ("shutdown_reset", |v, f, m| request(v, f, m, AxisControl::SHUTDOWN_RESET, Step::ShutdownReset)),
    ("abort", |v, f, m| request(v, f, m, AxisControl::ABORT, Step::Abort)),
    ("fault_reset", |v, f, m| request(v, f, m, AxisControl::FAULT_RESET, Step::FaultReset)),
    ("stop_process", |v, f, m| request(v, f, m, AxisControl::STOP_PROCESS, Step::StopProcess)),
    ("cancel", |v, f, m| request(v, f, m, AxisControl::CANCEL, Step::Cancel)),
    ("request", |v, f, m| {
        let mut keys = table(v, "request", f.problems)?;
        let axes = axes(keys.need("axes")?, f)?;
        let code = AxisControl(keys.integer("code", 1..=255)?);
        keys.finish()?;
        made(axes, code, m, |axes| Step::Ask { axes, request: code })
    }),
    ("node_fault_reset", |v, f, _| flag(v, "node_fault_reset", f, Step::NodeFaultReset)),
    ("move", |v, f, _| motion::go(v, f)),
    ("jog", |v, f, _| motion::jog(v, f)),
    ("velocity", |v, f, _| motion::velocity(v, f)),
    ("torque", |v, f, _| motion::torque(v, f)),
    ("stop", |v, f, _| motion::stop(v, f)),
    ("mode", |v, f, _| motion::mode(v, f)),
    ("feedback", |v, f, _| motion::feedback(v, f)),
    ("redefine_position", |v, f, _| motion::redefine(v, f)),
    ("in_window", |v, f, _| motion::in_window(v, f)),
    ("data_sets", |v, f, _| motion::data_sets(v, f)),
    ("time_data", |v, f, _| Some(Step::TimeData(time_data(v, f.problems)?))),
    ("command_target", |v, f, _| Some(Step::Target(word_of(v, "command_target", TARGETS, f.problems)?))),
    ("dwell", |v, f, _| {
        let span = time(v, "dwell", f.problems)?;
        Some(Step::Dwell { seconds: profile_generic::cast::f64_from_i64(span.0) / 1e9 })
    }),
    ("set", |v, f, _| exchange::set(v, f)),
    ("get", |v, f, _| exchange::get(v, f)),
    ("cyclic_write_list", |v, f, _| exchange::write_list(v, f)),
    ("cyclic_read_list", |v, f, _| exchange::read_list(v, f)),
    ("cyclic_write", |v, f, _| exchange::cyclic_write(v, f)),
    ("service", |v, f, _| exchange::service(v, f)),
    ("explicit", |v, f, _| exchange::explicit(v, f)),
    ("run_hookup_test", |v, f, _| exchange::hookup_test(v, f)),
    ("run_motor_test", |v, f, _| exchange::motor_test(v, f)),
    ("run_inertia_test", |v, f, _| exchange::inertia_test(v, f)),
    ("test_result", |v, f, _| exchange::test_result(v, f)),
    ("arm", |v, f, _| events::arm(v, f)),
    ("disarm", |v, f, _| events::disarm(v, f)),
    ("expect_event", events::expect),
    ("expect", expect::expect),
    ("expect_fault", expect::fault),
    ("expect_alarm", expect::alarm),
    ("misbehave", |v, f, _| misbehave::misbehave(v, f)),
    ("reconnect", |v, f, _| flag(v, "reconnect", f, Step::Reconnect)),
    ("together", |v, f, _| Some(Step::Together(nested(v, "together", f)?))),
    ("sequence", |v, f, _| Some(Step::Sequence(nested(v, "sequence", f)?))),
];

/// Keys beside the verb.
pub(super) struct Modifiers<'a> {
    /// `within`: a time-out of the step's own.
    pub within: Option<DurationNs>,
    /// `wait = false`: go on without the acknowledge.
    no_wait: Option<Range<usize>>,
    /// `refused = ...`: the device has to say no.
    refused: Option<(Range<usize>, Option<u8>)>,
    problems: &'a Problems,
}

impl Modifiers<'_> {
    fn read<'p>(keys: &mut Keys<'p, '_>) -> Option<Modifiers<'p>> {
        let problems = keys.problems;
        let within = match keys.find("within") {
            Some(value) => Some(time(value, "within", problems)?),
            None => None,
        };
        let place = keys.find("wait").map(toml::Spanned::span);
        let no_wait = place.filter(|_| keys.boolean_or("wait", true) == Some(false));
        let refused = match keys.find("refused") {
            Some(value) => Some((value.span(), refusal(value, problems)?)),
            None => None,
        };
        Some(Modifiers { within, no_wait, refused, problems })
    }

    /// What no verb has made use of.
    fn finish(self) -> Option<()> {
        let left = self.no_wait.map(|span| (span, "wait"));
        let left = left.or(self.refused.map(|(span, _)| (span, "refused")));
        let Some((span, key)) = left else { return Some(()) };
        let title = format!("`{key}` does not go with this step");
        self.problems.report(span, title, "expected it together with a request, such as enable")
    }
}

/// `true` for any refusal, or the general status by name or number.
#[expect(clippy::option_option, reason = "any refusal, or one in particular")]
fn refusal(value: &Value<'_>, problems: &Problems) -> Option<Option<u8>> {
    if value.get_ref().as_bool() == Some(true) {
        return Some(None);
    }
    general_status(value, "refused", problems).map(Some)
}

/// A general status by name or number.
pub(super) fn general_status(value: &Value<'_>, key: &str, problems: &Problems) -> Option<u8> {
    if let Some(code) = whole(value).and_then(|number| u8::try_from(number).ok()) {
        return Some(code);
    }
    let DeValue::String(name) = value.get_ref() else {
        return wrong(value, key, "a general status, 0 to 255 or its name", problems);
    };
    let known = GeneralStatus::NAMED.iter().find(|(_, known)| folded(known) == folded(name));
    match known {
        Some((code, _)) => Some(code.0),
        None => problems.report(
            value.span(),
            format_args!("`{name}` is no general status"),
            "expected one such as \"object state conflict\", or its number",
        ),
    }
}

/// An axis of the configuration.
pub(super) fn axis(value: &Value<'_>, frame: &Frame<'_>) -> Option<u8> {
    instance(value, frame, 1)
}

/// An instance, from `first` on.
pub(super) fn instance(value: &Value<'_>, frame: &Frame<'_>, first: u8) -> Option<u8> {
    let count = u8::try_from(frame.config.axes.len()).unwrap_or(u8::MAX);
    match whole(value).map(u8::try_from) {
        Some(Ok(axis)) if (first..=count).contains(&axis) => Some(axis),
        Some(_) => frame.problems.report(
            value.span(),
            "the script has no such axis",
            format_args!("expected {first} to {count}"),
        ),
        None => wrong(value, "axis", "the number of an axis", frame.problems),
    }
}

/// `"all"`, an axis, or a list of axes.
pub(super) fn axes(value: &Value<'_>, frame: &Frame<'_>) -> Option<AxisSet> {
    match value.get_ref() {
        DeValue::String(text) if text == "all" => {
            Some(AxisSet::first(u8::try_from(frame.config.axes.len()).unwrap_or(u8::MAX)))
        }
        DeValue::Integer(_) => axis(value, frame).map(AxisSet::one),
        DeValue::Array(items) => {
            let found: Option<Vec<u8>> = items.iter().map(|item| axis(item, frame)).collect();
            Some(found?.into_iter().fold(AxisSet::NONE, AxisSet::with))
        }
        _ => wrong(value, "axes", "\"all\", an axis, or a list of axes", frame.problems),
    }
}

fn request(
    value: &Value<'_>,
    frame: &Frame<'_>,
    modifiers: &mut Modifiers<'_>,
    code: AxisControl,
    step: fn(AxisSet) -> Step,
) -> Option<Step> {
    made(axes(value, frame)?, code, modifiers, step)
}

fn made(
    axes: AxisSet,
    request: AxisControl,
    modifiers: &mut Modifiers<'_>,
    step: impl Fn(AxisSet) -> Step,
) -> Option<Step> {
    if let Some((_, status)) = modifiers.refused.take() {
        return Some(Step::Refused { axes, request, status });
    }
    if modifiers.no_wait.take().is_some() {
        return Some(Step::Ask { axes, request });
    }
    Some(step(axes))
}

fn flag(value: &Value<'_>, key: &str, frame: &Frame<'_>, step: Step) -> Option<Step> {
    match value.get_ref() {
        DeValue::Boolean(true) => Some(step),
        _ => wrong(value, key, "true", frame.problems),
    }
}

fn nested(value: &Value<'_>, key: &str, frame: &Frame<'_>) -> Option<Vec<Step>> {
    let DeValue::Array(items) = value.get_ref() else {
        return wrong(value, key, "a list of steps", frame.problems);
    };
    let steps: Vec<Option<Step>> = items.iter().map(|item| step(item, frame).map(|(step, _)| step)).collect();
    steps.into_iter().collect()
}

/// Reads one step; gives it with its title, if it has one.
pub(super) fn step(value: &Value<'_>, frame: &Frame<'_>) -> Option<(Step, Option<String>)> {
    let mut keys = table(value, "the step", frame.problems)?;
    let mut modifiers = Modifiers::read(&mut keys)?;
    let title = title(&mut keys)?;
    let expected = "expected one verb in a step; steps at once go into together = [...]";
    let others = ["within", "wait", "refused", "title"];
    let (read, arguments) = verb(value, &mut keys, VERBS, &others, expected)?;
    keys.finish()?;
    let mut step = read(arguments, frame, &mut modifiers)?;
    if let Some(time_out) = modifiers.within {
        step = Step::Within { time_out, step: Box::new(step) };
    }
    modifiers.finish()?;
    // What is certain to fail is no good script; steps inside of others have been looked at already.
    if !matches!(step, Step::Together(_) | Step::Sequence(_))
        && let Err(failure) = step.check(frame.config)
    {
        let title = "this step is certain to fail";
        return frame.problems.report(arguments.span(), title, failure);
    }
    Some((step, title))
}
