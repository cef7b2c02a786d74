//! What the rows between the generic model and SERCOS say.

use super::{Aspect, Fact, Reader, flag, parameter, pattern, quotient, said, span, text};
use crate::Mapping;
use crate::format::{WhenRow, listed};

pub(super) fn facts(mapping: &Mapping) -> Vec<Fact<'_>> {
    let file = &mapping.tables().generic_sercos;
    let rows = &file.rows;
    let mut reader = Reader::new(&file.text, "generic-sercos");
    reader.units(&rows.unit);
    for row in &rows.scaling {
        let name = row.scaling.get_ref();
        let gear = row.load.as_ref().map_or_else(
            || "no gear".to_owned(),
            |load| {
                let [motor, turns] = [0, 1].map(|at: usize| load.gear[at].get_ref());
                let [mask, value] = load.pattern;
                let of = said("of the", load.generic.as_ref());
                format!("gear {motor}/{turns}{of}, type {mask:#04x}/{value:#04x}")
            },
        );
        let exact = if row.exact { ", exact" } else { "" };
        let says = format!("by {}, {gear}, feed {}{exact}", row.word.get_ref(), text(row.feed.as_ref()));
        let place = row.load.as_ref().map_or(row.scaling.span(), |load| load.gear[0].span());
        reader.say(("scaling", name), Aspect::Scale, says, place);
        let modulo = row.modulo.as_ref();
        let says = modulo.map_or_else(
            || "never wraps".to_owned(),
            |modulo| {
                let [mask, value] = modulo.pattern;
                let (range, divider) = (modulo.range.get_ref(), text(modulo.divider.as_ref()));
                format!("wraps at {range} over {divider}, type {mask:#04x}/{value:#04x}")
            },
        );
        let place = span(modulo.map(|modulo| &modulo.range), &row.scaling);
        reader.say(("scaling", &format!("{name}, modulo")), Aspect::Scale, says, place);
        for method in &row.methods {
            let id = format!("{name}, {}", method.name);
            let idns =
                [&method.factor_idn, &method.exponent_idn, &method.divisor_idn].map(|idn| text(idn.as_ref()));
            let divisor = method.divisor.map_or_else(String::new, |divisor| format!(" / {divisor}"));
            let expect = method.expect.iter().map(|(idn, value)| format!(", {} = {value}", idn.get_ref()));
            let zero = method.zero.map_or_else(String::new, |zero| format!(", zero at {zero}"));
            let more = format!(
                "{divisor}, by {}, type {:#04x}/{:#04x}, {} {}{zero}{}",
                idns.join(" "),
                method.pattern[0],
                method.pattern[1],
                text(method.kind.as_ref()),
                method.quantity.get_ref(),
                expect.collect::<String>()
            );
            let exponent = method.exponent.unwrap_or_default();
            let fact = reader.scale(("scaling", &id), &method.base, exponent, &more);
            if let Some(divisor) = method.divisor {
                let by = quotient(1, divisor);
                fact.number = fact.number.zip(by).map(|(number, by)| number * by);
            }
        }
    }
    let sign = |polarity: &crate::format::PolarityRow| {
        format!("{} bit {}", polarity.idn.get_ref(), polarity.bit.get_ref())
    };
    let direction = &rows.direction.polarity;
    reader.say(("direction", "axis"), Aspect::Sign, sign(direction), direction.bit.span());
    for (key, name) in [
        ("control", &rows.words.control),
        ("status", &rows.words.status),
        ("mode_control", &rows.words.mode_control),
        ("mode_status", &rows.words.mode_status),
        ("supported_modes", &rows.supported_modes.list),
        ("diagnosis text", &rows.diagnosis.text),
        ("diagnosis number", &rows.diagnosis.number),
        ("configurable_data producer", &rows.configurable_data.producer),
        ("configurable_data consumer", &rows.configurable_data.consumer),
    ] {
        reader.named(("words", key), Aspect::Binding, name);
    }
    for row in &rows.signal {
        let id = ("signal", row.signal.get_ref().as_str());
        let polarity = row.polarity.as_ref();
        let says = polarity.map_or_else(|| "never inverted".to_owned(), sign);
        reader.say(id, Aspect::Sign, says, span(polarity.map(|polarity| &polarity.bit), &row.signal));
        reader.named(id, Aspect::Binding, &row.idn);
        reader.named(id, Aspect::Missing, &row.missing);
        reader.named(("signal", &format!("{}, direction", id.1)), Aspect::Binding, &row.direction);
        if let Some(load) = &row.load {
            let id = format!("{}, by the encoder of the load", row.signal.get_ref());
            let polarity = load.polarity.as_ref();
            let says = polarity.map_or_else(|| "never inverted".to_owned(), sign);
            let place = span(polarity.map(|polarity| &polarity.bit), &load.idn);
            reader.say(("signal", &id), Aspect::Sign, says, place);
            reader.named(("signal", &id), Aspect::Binding, &load.idn);
        }
    }
    for row in &rows.mode {
        let id = format!(
            "{}, by the {}",
            row.mode.get_ref(),
            row.interpolation.as_ref().map_or("controller", |name| name.get_ref())
        );
        let codes = match row.load_codes.as_slice() {
            [] => listed(&row.codes),
            load => format!("{}, by the load {}", listed(&row.codes), listed(load)),
        };
        let says = format!("{codes}; {}; {}", listed(&row.command), listed(&row.actual));
        reader.say(("mode", &id), Aspect::Mode, says, row.mode.span());
        reader.named(("mode", &id), Aspect::Missing, &row.missing);
    }
    for row in &rows.mode_slot {
        reader.named(("mode_slot", &row.slot.get_ref().to_string()), Aspect::Mode, &row.idn);
    }
    for row in &rows.procedure {
        let id = format!("{}, by the {}", row.mode.get_ref(), row.interpolation.get_ref());
        let says = format!("{}{}", listed(&row.commands), said("led in", row.led_in.as_ref()));
        reader.say(("procedure", &id), Aspect::Mode, says, row.mode.span());
    }
    for row in &rows.action {
        let says = format!(
            "{} {}, command {}",
            text(row.send.as_ref()),
            pattern(&row.pattern),
            text(row.command.as_ref())
        );
        reader.say(("action", row.action.get_ref()), Aspect::State, says, row.action.span());
    }
    for row in &rows.report {
        let id = format!(
            "{}{}{}",
            pattern(&row.pattern),
            flag("acknowledges", row.acknowledges),
            flag("procedure", row.procedure)
        );
        reader.named(("report", &id), Aspect::State, &row.report);
    }
    for row in &rows.status {
        let id = format!(
            "{}, {}{}",
            row.status.get_ref(),
            pattern(&row.pattern),
            flag("acknowledges", row.acknowledges)
        );
        reader.say(("status", &id), Aspect::State, row.word.get_ref(), row.status.span());
    }
    for row in &rows.fault {
        let id = format!("{}, {}", row.word.get_ref(), pattern(&row.pattern));
        let says = format!("{}, reaction {}", row.cause.get_ref(), text(row.reaction.as_ref()));
        reader.say(("fault", &id), Aspect::Fault, says, row.cause.span());
    }
    for row in &rows.parameter {
        let more = (&row.direction, row.missing.as_ref());
        parameter(&mut reader, &row.parameter, &row.idn, row.factor.as_ref(), more);
        let unit = if row.unit_by_drive { "of the drive" } else { "of the tables" };
        let says = format!("{unit}{}", said("in", row.acts_in.as_ref()));
        reader.say(("parameter", row.parameter.get_ref()), Aspect::Unit, says, row.parameter.span());
    }
    for row in &rows.capture {
        let id = format!("{}, {} edge", row.capture.get_ref(), row.edge.get_ref());
        let keys = [
            ("in", &row.value),
            ("shown by", &row.word),
            ("counted by", &row.counter),
            ("enabled by", &row.enable),
            ("during", &row.command),
        ];
        let more: String = keys.into_iter().map(|(key, name)| said(key, name.as_ref())).collect();
        let says = format!("{}{more}, {}", row.by.get_ref(), pattern(&row.pattern));
        reader.say(("capture", &id), Aspect::Binding, says, row.capture.span());
    }
    for row in &rows.commission {
        let what = row.idn.as_ref().or(row.parameter.as_ref());
        let what = what.map_or_else(String::new, |name| format!(" {}", name.get_ref()));
        let value = row.value.as_ref().map_or_else(String::new, |value| format!(" {:#x}", value.get_ref()));
        let when = row.when.as_ref().map_or_else(String::new, when);
        let id = format!("{}{what}{value} in phase {}{when}", row.step.get_ref(), row.phase.get_ref());
        let elements = row.elements.as_ref().map_or_else(String::new, |of| format!(", {}", listed(of)));
        let says = format!("refused {}{elements}", row.refused.get_ref());
        reader.say(("commission", &id), Aspect::Step, says, row.refused.span());
    }
    reader.facts
}

/// When a step of commissioning applies.
fn when(row: &WhenRow) -> String {
    let names = said("kind", row.kind.as_ref()) + &said("mode", row.mode.as_ref());
    let flags = [("modulo", row.modulo), ("set_scaling", row.set_scaling), ("captures", row.captures)];
    flags.into_iter().fold(names, |text, (name, value)| text + &flag(name, value))
}
