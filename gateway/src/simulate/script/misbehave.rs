//! The verb that breaks the rules.

use profile_cip::controller::{Misbehaviour, Step};
use toml::de::DeValue;

use super::reader::{Keys, Value, table, time, wrong};
use super::step::{Frame, axes};

/// Updates that one step may spoil.
pub(super) const UPDATES: std::ops::RangeInclusive<i128> = 1..=1_000_000;

/// Every kind, with the keys it takes beside its own.
const KINDS: [&str; 12] = [
    "skip_updates",
    "delay",
    "duplicate",
    "reorder",
    "stale_time_stamp",
    "wrong_sequence",
    "wrong_update_id",
    "truncate",
    "omit_set_point",
    "wrong_mode",
    "vanish",
    "drop_tcp",
];

/// `misbehave = { skip_updates = 3 }`, `misbehave = { delay = "5 ms", updates = 2 }`, ...
pub(super) fn misbehave(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let problems = frame.problems;
    let mut keys = table(value, "misbehave", problems)?;
    let mut kinds = keys.keys().filter(|(name, ..)| KINDS.contains(name));
    let Some((name, _, argument)) = kinds.next() else {
        let names: Vec<_> = KINDS.iter().map(|kind| format!("`{kind}`")).collect();
        let unknown = keys.keys().find(|(name, ..)| *name != "updates");
        let (span, title) = match unknown {
            Some((name, span, _)) => (span, format!("`{name}` is no misbehaviour")),
            None => (keys.span(), "no misbehaviour is named".to_owned()),
        };
        return problems.report(span, title, format_args!("expected one of {}", names.join(", ")));
    };
    if let Some((second, span, _)) = kinds.next() {
        let title = format!("`{second}` is a second misbehaviour besides `{name}`");
        return problems.report(span, title, "expected one; two at once go into together = [...]");
    }
    drop(kinds);
    let kind = match KINDS.into_iter().find(|kind| *kind == name)? {
        "skip_updates" => Misbehaviour::SkipUpdates { updates: own(&mut keys, "skip_updates", argument)? },
        "delay" => {
            keys.find("delay");
            Misbehaviour::Delay { by: time(argument, "delay", problems)?, updates: updates(&mut keys)? }
        }
        "duplicate" => Misbehaviour::Duplicate { updates: own(&mut keys, "duplicate", argument)? },
        "reorder" => Misbehaviour::Reorder { pairs: own(&mut keys, "reorder", argument)? },
        "stale_time_stamp" => {
            keys.find("stale_time_stamp");
            let age = time(argument, "stale_time_stamp", problems)?;
            Misbehaviour::StaleTimeStamp { age, updates: updates(&mut keys)? }
        }
        "wrong_sequence" => {
            let back = keys.integer("wrong_sequence", 1..=0x7FFF_FFFF)?;
            Misbehaviour::WrongSequence { back, updates: updates(&mut keys)? }
        }
        "wrong_update_id" => {
            let back = keys.integer("wrong_update_id", 1..=255)?;
            Misbehaviour::WrongUpdateId { back, updates: updates(&mut keys)? }
        }
        "truncate" => {
            let bytes = keys.integer("truncate", 1..=1400)?;
            Misbehaviour::Truncate { bytes, updates: updates(&mut keys)? }
        }
        "omit_set_point" => {
            keys.find("omit_set_point");
            Misbehaviour::OmitSetPoint { axes: axes(argument, frame)?, updates: updates(&mut keys)? }
        }
        "wrong_mode" => {
            let mode = keys.integer("wrong_mode", 0..=15)?;
            let axes = axes(keys.need("axes")?, frame)?;
            Misbehaviour::WrongMode { axes, mode, updates: updates(&mut keys)? }
        }
        "vanish" => flag(&mut keys, "vanish", argument, Misbehaviour::Vanish)?,
        _ => flag(&mut keys, "drop_tcp", argument, Misbehaviour::DropTcp)?,
    };
    keys.finish()?;
    Some(Step::Misbehave(kind))
}

fn own(keys: &mut Keys<'_, '_>, key: &'static str, value: &Value<'_>) -> Option<u32> {
    keys.find(key);
    keys.in_range(key, value, &UPDATES)
}

fn updates(keys: &mut Keys<'_, '_>) -> Option<u32> {
    keys.integer_or("updates", UPDATES, 1)
}

fn flag(
    keys: &mut Keys<'_, '_>,
    key: &'static str,
    value: &Value<'_>,
    kind: Misbehaviour,
) -> Option<Misbehaviour> {
    keys.find(key);
    match value.get_ref() {
        DeValue::Boolean(true) => Some(kind),
        _ => wrong(value, key, "true", keys.problems),
    }
}
