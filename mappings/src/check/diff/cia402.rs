//! What the rows between the generic model and CiA 402 say.

use super::{Aspect, Fact, Reader, flag, parameter, pattern, said, span, text};
use crate::Mapping;
use crate::format::listed;

pub(super) fn facts(mapping: &Mapping) -> Vec<Fact<'_>> {
    let file = &mapping.tables().generic_cia402;
    let rows = &file.rows;
    let mut reader = Reader::new(&file.text, "generic-cia402");
    reader.units(&rows.unit);
    for row in &rows.scaling {
        for method in &row.methods {
            let id = format!("{}, {}", row.unit.get_ref(), method.name);
            let when = method.when.as_ref();
            let when = when.map_or_else(String::new, |(object, value)| {
                format!(", when {} = {value:#x}", object.get_ref())
            });
            let more = format!(
                ", times {}, over {}, like {}{when}",
                listed(&method.times),
                listed(&method.over),
                text(method.like.as_ref())
            );
            match &method.base {
                Some(base) => reader.scale(("scaling", &id), base, 0, &more),
                None => {
                    let says = more.trim_start_matches(", ");
                    reader.say(("scaling", &id), Aspect::Scale, says, row.unit.span())
                }
            };
        }
    }
    let words = &rows.words;
    reader.named(("words", "direction"), Aspect::Sign, &words.direction);
    for (key, name) in words.objects() {
        reader.named(("words", key), Aspect::Binding, name);
    }
    let drive = &rows.drive;
    let modes = drive.modes.as_deref().map_or_else(String::new, |modes| format!(", modes {}", listed(modes)));
    let says =
        format!("acknowledges {}, voltage bit {}{modes}", drive.acknowledges, drive.voltage_bit.get_ref());
    reader.say(("drive", "usual"), Aspect::State, says, drive.voltage_bit.span());
    for row in &rows.signal {
        let modes = if row.modes.is_empty() { String::new() } else { format!(" in {}", listed(&row.modes)) };
        let id = format!("{}{modes}", row.signal.get_ref());
        let says = row.polarity.as_ref().map_or("never inverted", |name| name.get_ref());
        reader.say(("signal", &id), Aspect::Sign, says, span(row.polarity.as_ref(), &row.signal));
        reader.named(("signal", &id), Aspect::Binding, &row.object);
        reader.named(("signal", &id), Aspect::Missing, &row.missing);
        reader.named(("signal", &format!("{id}, direction")), Aspect::Binding, &row.direction);
        if let Some(load) = &row.load {
            reader.named(("signal", &format!("{id}, by the encoder of the load")), Aspect::Binding, load);
        }
    }
    for row in &rows.mode {
        let by = row.interpolation.as_ref().map_or("controller", |name| name.get_ref());
        let id = format!("{}, by the {by}, {}", row.mode.get_ref(), listed(&row.modes));
        let handshake = row.handshake.as_ref().map_or_else(String::new, |handshake| {
            format!("; asks {}, taken {}", pattern(&handshake.ask), pattern(&handshake.taken))
        });
        let (control, command) = (pattern(&row.control), listed(&row.command));
        let says = format!("{control}; {command}; {}{handshake}", listed(&row.actual));
        reader.say(("mode", &id), Aspect::Mode, says, row.mode.span());
        reader.named(("mode", &id), Aspect::Missing, &row.missing);
    }
    for row in &rows.procedure {
        let id = format!("{}, by the {}", row.mode.get_ref(), row.interpolation.get_ref());
        let says = format!(
            "{}; {}; done {}, failed {} or after {} s",
            listed(&row.modes),
            pattern(&row.start),
            row.done.get_ref(),
            listed(&row.failed),
            row.seconds.get_ref()
        );
        reader.say(("procedure", &id), Aspect::Mode, says, row.mode.span());
    }
    for row in &rows.action {
        let id = format!(
            "{}, in {}",
            row.action.get_ref(),
            row.when.as_ref().map_or("every state", |name| name.get_ref())
        );
        let says = format!("{} {}", text(row.send.as_ref()), pattern(&row.pattern));
        reader.say(("action", &id), Aspect::State, says, row.action.span());
    }
    for row in &rows.report {
        let modes = listed(&row.modes);
        let id = format!(
            "{} {} {modes}{}{}",
            row.state.get_ref(),
            pattern(&row.pattern),
            flag("follows", row.follows),
            flag("voltage", row.voltage)
        );
        reader.named(("report", &id), Aspect::State, &row.report);
    }
    for row in &rows.status {
        let state = row.state.as_ref().map_or("", |name| name.get_ref());
        let id = format!(
            "{}, {state} {} {}{}{}",
            row.status.get_ref(),
            pattern(&row.pattern),
            listed(&row.modes),
            flag("follows", row.follows),
            flag("voltage", row.voltage)
        );
        let says = format!("{}{}", row.object.get_ref(), said("inverted", row.inverted.as_ref()));
        reader.say(("status", &id), Aspect::State, says, row.status.span());
    }
    for row in &rows.fault {
        let says = format!("{}, reaction {}", row.cause.get_ref(), text(row.reaction.as_ref()));
        for name in &row.codes {
            reader.say(("fault", name.get_ref()), Aspect::Fault, says.clone(), name.span());
        }
    }
    for row in &rows.fault_class {
        let says = format!("{}, reaction {}", row.cause.get_ref(), text(row.reaction.as_ref()));
        for name in &row.classes {
            reader.say(("fault_class", name.get_ref()), Aspect::Fault, says.clone(), name.span());
        }
    }
    for row in &rows.parameter {
        let more = (&row.direction, row.missing.as_ref());
        parameter(&mut reader, &row.parameter, &row.object, row.factor.as_ref(), more);
        let id = ("parameter", row.parameter.get_ref().as_str());
        let polarity = row.polarity.as_ref().map_or("with the positions", |name| name.get_ref());
        let says = format!("{polarity}{}", said("inverted", row.inverted.as_ref()));
        let place = span(row.inverted.as_ref().or(row.polarity.as_ref()), &row.parameter);
        reader.say(id, Aspect::Sign, says, place);
        if let Some(common) = &row.common {
            reader.named(("parameter", &format!("{}, of both directions", id.1)), Aspect::Binding, common);
        }
    }
    for row in &rows.capture {
        let id = format!("{}, {} edge", row.capture.get_ref(), row.edge.get_ref());
        let keys = [("in", &row.value), ("by", &row.function)];
        let more: String = keys.into_iter().map(|(key, name)| said(key, name.as_ref())).collect();
        let (shown, enable) = (pattern(&row.pattern), pattern(&row.enable));
        let says = format!("{} {shown}{more}, {enable}; {}", row.word.get_ref(), pattern(&row.select));
        reader.say(("capture", &id), Aspect::Binding, says, row.capture.span());
    }
    for row in &rows.commission {
        let what = row.object.as_ref().or(row.parameter.as_ref());
        let what = what.map_or_else(String::new, |name| format!(" {}", name.get_ref()));
        let value = row.value.as_ref().map_or_else(String::new, |value| format!(" {:#x}", value.get_ref()));
        let modes = if row.modes.is_empty() { String::new() } else { format!(" in {}", listed(&row.modes)) };
        let id = format!("{}{what}{value}{modes}", row.step.get_ref());
        let says = format!("refused {}{}", row.refused.get_ref(), said("exponent", row.exponent.as_ref()));
        reader.say(("commission", &id), Aspect::Step, says, row.refused.span());
    }
    reader.facts
}
