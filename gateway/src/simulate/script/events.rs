//! Verbs of the event channel.

use profile_cip::controller::Scaling;
use profile_cip::controller::Step;
use profile_cip::controller::condition::Condition;
use profile_cip::wire::motion::codes::{EventChecking, EventType};
use profile_cip::wire::motion::event::{ExtendedEventData, Window};
use toml::de::DeValue;

use super::expect::done;
use super::reader::{Keys, Value, table, words, wrong};
use super::step::{Frame, Modifiers, axis};

/// The events that can be armed, by their names in Event Checking Control.
fn events(keys: &mut Keys<'_, '_>) -> Option<EventChecking> {
    let value = keys.need("events")?;
    let known: Vec<(&str, EventChecking)> = EventChecking::NAMED
        .iter()
        .filter(|(bit, _)| EventChecking::EVENTS.contains(*bit))
        .map(|(bit, name)| (*name, *bit))
        .collect();
    let found = words(value, "events", &known, keys.problems)?;
    if found.is_empty() {
        return keys.problems.report(value.span(), "no event is named", "expected a list of events");
    }
    Some(found.into_iter().collect())
}

/// A position in units as the counts of the axis.
fn counts(value: &Value<'_>, key: &str, axis: u8, keys: &Keys<'_, '_>, frame: &Frame<'_>) -> Option<i32> {
    let units = keys.finite(key, value)?;
    let Scaling::Counts(scale) = frame.config.axes[usize::from(axis) - 1].scaling else {
        let title = format!("`{key}` is in units, and the script does not say how many counts a unit has");
        return frame.problems.report(
            value.span(),
            title,
            "expected counts_per_unit as a number in [axis.N]",
        );
    };
    let counts = (units * scale).round();
    if !(f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&counts) {
        return frame.problems.report(
            value.span(),
            "the position is beyond 32 bits of counts",
            "expected less",
        );
    }
    #[expect(clippy::cast_possible_truncation, reason = "whole and in range")]
    Some(counts as i32)
}

/// `arm = { axis, events, rearm, window, watch, home_torque_threshold, home_torque_time }`
pub(super) fn arm(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let mut keys = table(value, "arm", frame.problems)?;
    let axis = axis(keys.need("axis")?, frame)?;
    let mut checking = events(&mut keys)?;
    let mut data = ExtendedEventData::default();
    if keys.boolean_or("rearm", false)? {
        checking |= checking.rearms();
    }
    if let Some(value) = keys.find("window") {
        let window = window(value, axis, &keys, frame)?;
        let registrations = [
            EventChecking::REG_1_POSITIVE,
            EventChecking::REG_1_NEGATIVE,
            EventChecking::REG_2_POSITIVE,
            EventChecking::REG_2_NEGATIVE,
        ];
        for (place, bit) in data.windows.iter_mut().zip(registrations) {
            *place = Some(window).filter(|_| checking.contains(bit));
        }
        checking |= checking.windows();
    }
    if let Some(value) = keys.find("watch") {
        let position = counts(value, "watch", axis, &keys, frame)?;
        let watches = [
            EventChecking::WATCH_1_FORWARD | EventChecking::WATCH_1_REVERSE,
            EventChecking::WATCH_2_FORWARD | EventChecking::WATCH_2_REVERSE,
        ];
        for (place, bits) in data.watch_positions.iter_mut().zip(watches) {
            *place = Some(position).filter(|_| checking.intersects(bits));
        }
    }
    #[expect(clippy::cast_possible_truncation, reason = "REAL is what the parameter has")]
    let real = |value: f64| value as f32;
    data.home_torque_threshold = keys.maybe_number("home_torque_threshold")?.map(real);
    data.home_torque_time = keys.maybe_number("home_torque_time")?.map(real);
    keys.finish()?;
    let parameters = (data != ExtendedEventData::default()).then(|| Box::new(data));
    Some(Step::ArmEvents { axis, checking, parameters })
}

/// `[lower, upper]` in units.
fn window(value: &Value<'_>, axis: u8, keys: &Keys<'_, '_>, frame: &Frame<'_>) -> Option<Window> {
    let ends: Vec<&Value<'_>> = match value.get_ref() {
        DeValue::Array(items) => items.iter().collect(),
        _ => Vec::new(),
    };
    let [low, high] = ends.as_slice() else {
        return wrong(value, "window", "two positions, [lower, upper]", frame.problems);
    };
    let min = counts(low, "window", axis, keys, frame)?;
    let max = counts(high, "window", axis, keys, frame)?;
    if min > max {
        return wrong(value, "window", "the lower position first", frame.problems);
    }
    Some(Window { max, min })
}

/// `disarm = { axis, events }`
pub(super) fn disarm(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let mut keys = table(value, "disarm", frame.problems)?;
    let axis = axis(keys.need("axis")?, frame)?;
    let checking = events(&mut keys)?;
    keys.finish()?;
    Some(Step::DisarmEvents { axis, checking })
}

/// `expect_event = { axis, type, position, tolerance, within }`
pub(super) fn expect(value: &Value<'_>, frame: &Frame<'_>, modifiers: &mut Modifiers<'_>) -> Option<Step> {
    let mut keys = table(value, "expect_event", frame.problems)?;
    let axis = axis(keys.need("axis")?, frame)?;
    let types: Vec<(&str, EventType)> = EventType::NAMED.iter().map(|(code, name)| (*name, *code)).collect();
    let event_type = keys.word("type", &types)?;
    let position = match keys.maybe_number("position")? {
        Some(position) => Some((position, keys.number("tolerance")?)),
        None => None,
    };
    let step = done(&mut keys, modifiers, Condition::Event { axis, event_type, position })?;
    keys.finish()?;
    Some(step)
}
