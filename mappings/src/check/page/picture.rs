//! The tables joined: each value, state, mode and fault from CIP Motion through the generic model to the drives.

use std::fmt::Write as _;

use profile_generic::image::Signal;
use profile_generic::mode::OperatingMode;
use profile_generic::program::Conversion;
use profile_generic::quantity::Quantity;
use profile_generic::ratio::Ratio;
use profile_generic::scaling::{NANO, UnitKind};
use profile_generic::state::{Action, DriveState, Report, Request};
use profile_generic::time::DurationNs;

use super::super::axes::obedient;
use super::diagram::{Diagram, Side};
use super::{escaped, name};
use crate::attributes::{AttributeTable, Backing};
use crate::dictionary::IdnUnit;
use crate::finding::Source;
use crate::format::{FieldValueRow, Name, listed};
use crate::{
    AxisUnits, CaptureMode, Cia402Axis, CipScaling, DriveProgram, GenericParameter, Item, Mapping, Object,
    ObjectFacts, SercosAxis,
};

/// What stands in a cell: where it is from, what it is, and the worked value there.
struct Cell {
    place: String,
    text: String,
    about: String,
    worked: String,
}

/// The axis of the worked values.
const AXIS: &str = "a rotary axis with 1 000 000 counts in a revolution, a SERCOS drive with preferential scaling, and a CiA 402 \
                    drive with 3600 counts in a revolution";

/// Everything about values that the picture needs.
struct Joined<'m> {
    mapping: &'m Mapping,
    scaling: CipScaling,
    attributes: Option<AttributeTable>,
    sercos: Option<DriveProgram>,
    cia402: Option<DriveProgram>,
}

/// Sections of the page: signals, parameters, states and orders, modes, faults.
pub(super) fn picture(page: &mut String, mapping: &Mapping) {
    let joined = Joined::new(mapping);
    let _ = writeln!(page, "<h2 id=\"values\">Values</h2>\n<p>The worked values are those of {AXIS}.</p>");
    let signals: Vec<[Vec<Cell>; 4]> = Signal::ALL.iter().map(|signal| joined.signal(*signal)).collect();
    rows(page, "Signals", "Sent in every cycle", &signals);
    let parameters = mapping.dictionaries.generic.parameters();
    let parameters: Vec<[Vec<Cell>; 4]> = parameters.iter().map(|row| joined.parameter(row)).collect();
    rows(page, "Parameters", "Read and written on demand", &parameters);
    states(page, mapping);
    faults(page, mapping);
}

/// A table of four columns; the rows where a side has nothing are marked.
fn rows(page: &mut String, title: &str, about: &str, rows: &[[Vec<Cell>; 4]]) {
    let _ = writeln!(page, "<h3>{title}</h3>\n<p>{about}. A hatched cell has no row on that side.</p>");
    page.push_str(
        "<table class=\"joined\"><thead><tr><th>CIP Motion</th><th>generic model</th><th>SERCOS</th><th>CiA 402</th></tr></thead><tbody>\n",
    );
    // Where only the generic model has it there is nothing to see in a row.
    let (bound, unbound): (Vec<_>, Vec<_>) = rows.iter().partition(|[north, _, sercos, cia402]| {
        !(north.is_empty() && sercos.is_empty() && cia402.is_empty())
    });
    for row in bound {
        page.push_str("<tr>");
        for cells in row {
            page.push_str(if cells.is_empty() { "<td class=\"gap\">" } else { "<td>" });
            for cell in cells {
                let text = escaped(&cell.text);
                let _ = match cell.place.as_str() {
                    "" => write!(page, "<div><b>{text}</b>"),
                    place => write!(page, "<div><a href=\"#{}\">{text}</a>", escaped(place)),
                };
                let _ = write!(page, " <small>{}</small>", escaped(&cell.about));
                if !cell.worked.is_empty() {
                    let _ = write!(page, " <span class=\"v\">{}</span>", escaped(&cell.worked));
                }
                page.push_str("</div>");
            }
            page.push_str("</td>");
        }
        page.push_str("</tr>\n");
    }
    page.push_str("</tbody></table>\n");
    let unbound: Vec<String> =
        unbound.iter().flat_map(|row| &row[1]).map(|cell| escaped(&cell.text)).collect();
    if !unbound.is_empty() {
        let _ = writeln!(page, "<p>In the generic model only: {}.</p>", unbound.join(", "));
    }
}

/// The place of a row on the page.
fn place(text: &Source, key: &Name) -> String {
    let (path, line, _) = text.place(key.span().start);
    format!("{}-{line}", name(path))
}

/// An amount of a quantity that people know, and how it is written.
const fn amount(quantity: Quantity) -> (i64, &'static str) {
    match quantity {
        Quantity::None => (1, "1"),
        Quantity::Position => (1_000_000_000, "1 rev"),
        Quantity::Velocity => (1_000_000_000, "1 rev/s"),
        Quantity::Acceleration => (1_000_000_000, "1 rev/s²"),
        Quantity::Jerk => (1_000_000_000, "1 rev/s³"),
        Quantity::Torque | Quantity::Fraction => (1_000_000, "100 %"),
        Quantity::TorqueAbsolute => (1_000_000, "1 Nm"),
        Quantity::Current => (1_000_000, "1 A"),
        Quantity::Voltage => (1_000_000, "1 V"),
        Quantity::Temperature => (25_000, "25 °C"),
        Quantity::Power => (1_000_000, "1 kW"),
        Quantity::Time => (1_000_000_000, "1 s"),
        Quantity::Frequency => (1_000, "1 Hz"),
        Quantity::Inertia => (1_000_000, "0.001 kg m²"),
        Quantity::Resistance => (1_000_000, "1 Ω"),
        Quantity::Inductance => (1_000_000, "1 mH"),
        Quantity::Gain => (1_000_000, "1 /s"),
    }
}

/// A number as short as it can be written, its thousands apart.
fn short(value: f64) -> String {
    let text = format!("{value:.6}");
    let (whole, decimals) = text.split_once('.').unwrap_or((&text, ""));
    let (sign, digits) = whole.strip_prefix('-').map_or(("", whole), |digits| ("-", digits));
    let mut grouped = String::from(sign);
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            grouped.push('\u{202F}');
        }
        grouped.push(digit);
    }
    match decimals.trim_end_matches('0') {
        "" => grouped,
        decimals => format!("{grouped}.{decimals}"),
    }
}

impl<'m> Joined<'m> {
    fn new(mapping: &'m Mapping) -> Self {
        let units = AxisUnits { kind: UnitKind::Rotary, ..AxisUnits::default() };
        let axis = SercosAxis {
            units,
            modes: mapping.drive_modes().collect(),
            set_scaling: true,
            ..SercosAxis::default()
        };
        let sercos = obedient(mapping, &axis).ok();
        let can = Cia402Axis {
            units,
            modes: mapping.drive_modes().collect(),
            any_mode: true,
            cycle: DurationNs::from_millis(4),
            offsets: vec![Signal::VelocityOffset, Signal::TorqueOffset],
            captures: CaptureMode::ServiceChannel,
            ..Cia402Axis::default()
        };
        let mut facts = ObjectFacts::new();
        // Every mode, and the factor group of a drive that counts 3600 in a turn.
        for (index, sub, value) in [
            (0x6502, 0, 0x3FF),
            (0x6092, 1, 3_600),
            (0x6092, 2, 1),
            (0x6096, 1, 1),
            (0x6096, 2, 1),
            (0x6091, 1, 1),
            (0x6091, 2, 1),
        ] {
            facts.note_data(Object { index, sub }, &u32::to_le_bytes(value));
        }
        let cia402 = mapping.cia402_program(&can, &facts).ok();
        let scaling = CipScaling {
            kind: UnitKind::Rotary,
            nanounits_per_unit: NANO,
            counts_per_unit: 1_000_000,
            inverted: false,
            unwind: None,
        };
        Self { mapping, scaling, attributes: mapping.attribute_table(&scaling), sercos, cia402 }
    }

    fn generic(name: &str, about: &str, quantity: Quantity) -> Vec<Cell> {
        let unit = quantity.unit();
        let (value, label) = amount(quantity);
        let worked = if unit.is_empty() {
            String::new()
        } else {
            format!("{label} = {}", short(profile_generic::cast::f64_from_i64(value)))
        };
        vec![Cell {
            place: String::new(),
            text: name.to_owned(),
            about: format!("{about}{}{unit}", if unit.is_empty() { "" } else { ", " }),
            worked,
        }]
    }

    fn signal(&self, signal: Signal) -> [Vec<Cell>; 4] {
        let quantity = signal.quantity();
        let tables = self.mapping.tables();
        let cip = &tables.cip_generic;
        let mut north = Vec::new();
        for row in cip.rows.cyclic.iter().filter(|row| row.signal.get_ref() == signal.name()) {
            let element = self.mapping.cip.cyclic.iter().find(|element| element.signal == signal);
            let ratio = element.and_then(|element| self.scaling.convert(element.unit, false));
            north.push(Cell {
                place: place(&cip.text, &row.element),
                text: row.element.get_ref().clone(),
                about: row.set.get_ref().clone(),
                worked: self.worked_north(quantity, ratio),
            });
        }
        north.extend(self.attributes(
            quantity,
            |backing| matches!(backing, Backing::Signal { signal: own, .. } if *own == signal),
        ));
        let file = &tables.generic_sercos;
        let rows = file.rows.signal.iter().filter(|row| row.signal.get_ref() == signal.name());
        let found = fields(self.sercos.as_ref(), signal);
        let sercos = rows.map(|row| self.south(&file.text, &row.idn, quantity, &found)).collect();
        let file = &tables.generic_cia402;
        let rows = file.rows.signal.iter().filter(|row| row.signal.get_ref() == signal.name());
        let found = fields(self.cia402.as_ref(), signal);
        let cia402 = rows.map(|row| {
            let mut cell = self.south(&file.text, &row.object, quantity, &found);
            if !row.modes.is_empty() {
                cell.about = format!("{} in {}", cell.about, listed(&row.modes));
            }
            cell
        });
        let direction = if signal.is_command() { "command" } else { "actual value" };
        [north, Self::generic(signal.name(), direction, quantity), sercos, cia402.collect()]
    }

    fn parameter(&self, row: &GenericParameter) -> [Vec<Cell>; 4] {
        let (parameter, quantity, name) = (row.parameter, row.quantity, row.name.as_str());
        let tables = self.mapping.tables();
        let north = self.attributes(quantity, |backing| {
            matches!(backing, Backing::Parameter { parameter: own, .. } if *own == parameter)
                || matches!(backing, Backing::Signal { otherwise: Some(own), .. } if *own == parameter)
        });
        let held = |program: &Option<DriveProgram>| {
            let entry = program.as_ref()?.parameter(parameter)?;
            Some((entry.item, entry.to_drive.or_else(|| entry.from_drive?.inverse())?))
        };
        let (of_sercos, of_cia402) = (held(&self.sercos), held(&self.cia402));
        let file = &tables.generic_sercos;
        let rows = file.rows.parameter.iter().filter(|row| row.parameter.get_ref() == name);
        let sercos =
            rows.map(|row| self.south(&file.text, &row.idn, quantity, of_sercos.as_slice())).collect();
        let file = &tables.generic_cia402;
        let rows = file.rows.parameter.iter().filter(|row| row.parameter.get_ref() == name);
        let cia402 = rows.map(|row| self.south(&file.text, &row.object, quantity, of_cia402.as_slice()));
        let computed = tables.generic.rows.computed.iter().find(|row| row.parameter.get_ref() == name);
        let about = match computed {
            Some(row) => format!("computed, {}", row.words()),
            None if parameter.is_of_vendor() => "vendor".to_owned(),
            None => String::new(),
        };
        let unit = quantity.unit();
        let mut generic = Self::generic(name, &about, quantity);
        if let (Some((low, high)), Some(cell)) = (row.range, generic.first_mut()) {
            let range = format!("{low} to {high} {unit}");
            cell.about = [cell.about.as_str(), range.trim_end()].join(", ");
        }
        [north, generic, sercos, cia402.collect()]
    }

    /// The attributes of the axis that are backed by something.
    fn attributes(&self, quantity: Quantity, is: impl Fn(&Backing) -> bool) -> Vec<Cell> {
        let file = &self.mapping.tables().cip_generic;
        let mut cells = Vec::new();
        let entries = self.attributes.iter().flat_map(AttributeTable::entries);
        for entry in entries.filter(|entry| is(&entry.backing)) {
            let Some(attribute) = self.mapping.dictionaries.cip.attribute_by_id(entry.id) else { continue };
            let row = file.rows.attribute.iter().find(|row| *row.attribute.get_ref() == attribute.name);
            let ratio = match &entry.backing {
                Backing::Parameter { to_generic, reciprocal: false, .. } => Some(to_generic.ratio),
                Backing::Signal { from_generic, .. } => from_generic.ratio.inverse(),
                _ => None,
            };
            cells.push(Cell {
                place: row.map_or_else(String::new, |row| place(&file.text, &row.attribute)),
                text: format!("{} {}", entry.id, attribute.name),
                about: attribute.unit.clone(),
                worked: self.worked_north(quantity, ratio),
            });
        }
        cells
    }

    /// What an amount is in the controller's unit, of which so many generic ones are one.
    fn worked_north(&self, quantity: Quantity, ratio: Option<Ratio>) -> String {
        let back = ratio.and_then(Ratio::inverse).filter(|_| !quantity.unit().is_empty());
        back.map_or_else(String::new, |back| short(back.to_f64(amount(quantity).0)))
    }

    /// A value of a drive; `found` are the values of its telegram or parameters that carry it.
    fn south(&self, text: &Source, item: &Name, quantity: Quantity, found: &[(Item, Conversion)]) -> Cell {
        let number = item.get_ref();
        let own = found.iter().find(|(known, _)| known.to_string() == *number);
        let worked = own.filter(|_| !quantity.unit().is_empty());
        let worked = worked
            .map_or_else(String::new, |(_, conversion)| short(conversion.ratio.to_f64(amount(quantity).0)));
        Cell { place: place(text, item), text: number.clone(), about: self.name(number), worked }
    }

    /// Name and unit of a value of a drive in its dictionary.
    fn name(&self, item: &str) -> String {
        let dictionaries = &self.mapping.dictionaries;
        let idn = item.parse().ok().and_then(|idn| dictionaries.sercos.idn(idn));
        if let Some(row) = idn {
            return match &row.unit {
                IdnUnit::Scaled(quantity) => format!("{}, scaled {quantity}", row.name),
                IdnUnit::Fixed { unit, .. } => format!("{}, {unit}", row.name),
                IdnUnit::None => row.name.clone(),
            };
        }
        let Some(object) = Object::parse(item) else { return String::new() };
        let Some(known) = dictionaries.cia402.object(object.index) else { return String::new() };
        let sub = known
            .sub(object.sub)
            .map(|sub| sub.name.clone())
            .filter(|name| !name.is_empty() && *name != known.name);
        match sub {
            Some(sub) => format!("{}: {sub}", known.name),
            None => known.name.clone(),
        }
    }
}

/// The values of the telegrams that carry a signal, with the conversion from the generic unit.
fn fields(program: Option<&DriveProgram>, signal: Signal) -> Vec<(Item, Conversion)> {
    let Some(program) = program else { return Vec::new() };
    let fields = program.command_fields().chain(program.feedback_fields());
    let own = fields.filter(|(field, _)| field.signal == signal);
    // What comes from the drive is converted the other way.
    own.filter_map(|(field, item)| {
        let command = signal.is_command();
        Some((item, if command { field.conversion } else { field.conversion.inverse()? }))
    })
    .collect()
}

/// A pattern in words.
fn pattern(rows: &[FieldValueRow]) -> String {
    rows.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

/// States, orders and modes of the three levels side by side.
fn states(page: &mut String, mapping: &Mapping) {
    let tables = mapping.tables();
    let (cip, sercos, cia402) =
        (&tables.cip_generic.rows, &tables.generic_sercos.rows, &tables.generic_cia402.rows);
    let words = |name: Option<&Name>, rows: &[FieldValueRow]| match (name, rows) {
        (Some(name), []) => name.get_ref().clone(),
        (Some(name), rows) => format!("{}, {}", name.get_ref(), pattern(rows)),
        (None, rows) => pattern(rows),
    };
    page.push_str(
        "<h2 id=\"states\">States, orders and modes</h2>\n<p>Blue: CIP Motion; green: generic model; orange: SERCOS; violet: CiA 402. \
         A dashed name has nothing on one side.</p>\n",
    );
    // The axis has a state; what the drive shows is a report. Where they go by one name it is one box.
    let states = DriveState::ALL.iter().map(|state| state.name());
    let reports = Report::ALL
        .iter()
        .map(|report| report.name())
        .filter(|name| DriveState::ALL.iter().all(|state| state.name() != *name));
    let mut diagram =
        Diagram::new(["CIP Axis State", "generic", "what the drive shows"], states.chain(reports));
    for row in &cip.state {
        diagram.join(row.state.get_ref(), Side::Left, "cip", row.axis_state.get_ref().clone());
    }
    for row in &sercos.report {
        diagram.join(row.report.get_ref(), Side::Right, "sercos", pattern(&row.pattern));
    }
    for row in &cia402.report {
        diagram.join(row.report.get_ref(), Side::Right, "cia402", words(Some(&row.state), &row.pattern));
    }
    diagram.draw(page, "States");
    let mut diagram = Diagram::new(
        ["CIP Axis Control", "generic request", ""],
        Request::ALL.iter().map(|request| request.name()),
    );
    for row in &cip.request {
        if let Some(request) = &row.request {
            diagram.join(request.get_ref(), Side::Left, "cip", row.axis_control.get_ref().clone());
        }
    }
    diagram.draw(page, "Requests of the controller");
    let actions = Action::ALL.iter().map(|action| action.name());
    let mut diagram = Diagram::new(["SERCOS control word", "generic order", "CiA 402 controlword"], actions);
    for row in &sercos.action {
        let word = words(row.send.as_ref(), &row.pattern);
        let command = row.command.as_ref().map(|idn| format!("command {}", idn.get_ref()));
        for text in [Some(word).filter(|word| !word.is_empty()), command].into_iter().flatten() {
            diagram.join(row.action.get_ref(), Side::Left, "sercos", text);
        }
    }
    for row in &cia402.action {
        let word = words(row.send.as_ref(), &row.pattern);
        let when = row.when.as_ref().map_or_else(String::new, |state| format!(" (in {})", state.get_ref()));
        if !word.is_empty() {
            diagram.join(row.action.get_ref(), Side::Right, "cia402", format!("{word}{when}"));
        }
    }
    diagram.draw(page, "Orders to the drive");
    let modes = OperatingMode::ALL.iter().map(|mode| mode.name());
    let mut diagram = Diagram::new(["CIP Control Mode", "generic mode", "mode of the drive"], modes);
    for row in &cip.mode {
        diagram.join(row.mode.get_ref(), Side::Left, "cip", row.control_mode.get_ref().clone());
    }
    let by = |word: &Option<Name>| word.as_ref().map_or("", |_| " by the drive");
    for row in &sercos.mode {
        let text = format!("{}{}", listed(&row.codes), by(&row.interpolation));
        diagram.join(row.mode.get_ref(), Side::Right, "sercos", text);
    }
    for row in &sercos.procedure {
        diagram.join(
            row.mode.get_ref(),
            Side::Right,
            "sercos",
            format!("command {} by the drive", listed(&row.commands)),
        );
    }
    for row in &cia402.mode {
        let text = format!("{}{}", listed(&row.modes), by(&row.interpolation));
        diagram.join(row.mode.get_ref(), Side::Right, "cia402", text);
    }
    for row in &cia402.procedure {
        diagram.join(
            row.mode.get_ref(),
            Side::Right,
            "cia402",
            format!("{} by the drive", listed(&row.modes)),
        );
    }
    diagram.draw(page, "Modes");
}

/// One row a fault: what the drive reports, the cause, what the controller is sent.
fn faults(page: &mut String, mapping: &Mapping) {
    let tables = mapping.tables();
    let (cip, sercos, cia402) = (&tables.cip_generic, &tables.generic_sercos, &tables.generic_cia402);
    let cell =
        |place: String, text: String, about: String| Cell { place, text, about, worked: String::new() };
    let rows_of_causes = cip.rows.fault.iter().map(|row| {
        let cause = row.cause.get_ref();
        let codes = [&row.exception, &row.node_fault, &row.initialization, &row.apr];
        let codes = codes.into_iter().flatten().map(|code| code.get_ref().clone());
        let manufacturer = row.manufacturer.as_ref().map(|bit| format!("Mfg {}", bit.get_ref()));
        let codes: Vec<String> = codes.chain(manufacturer).collect();
        let north = vec![cell(place(&cip.text, &row.cause), codes.join(", "), String::new())];
        let reaction = profile_generic::fault::FaultCause::NAMED.iter().find(|(_, name)| name == cause);
        let reaction =
            reaction.map_or_else(String::new, |(cause, _)| cause.default_reaction().name().replace('_', " "));
        let generic = vec![cell(String::new(), cause.clone(), reaction)];
        let about = |reaction: &Option<Name>| {
            reaction.as_ref().map_or_else(String::new, |name| name.get_ref().clone())
        };
        let of_sercos = sercos.rows.fault.iter().filter(|row| row.cause.get_ref() == cause);
        let of_sercos = of_sercos.map(|row| {
            cell(
                place(&sercos.text, &row.cause),
                format!("{}: {}", row.word.get_ref(), pattern(&row.pattern)),
                about(&row.reaction),
            )
        });
        let codes = cia402
            .rows
            .fault
            .iter()
            .filter(|row| row.cause.get_ref() == cause)
            .map(|row| cell(place(&cia402.text, &row.cause), listed(&row.codes), about(&row.reaction)));
        let classes = cia402.rows.fault_class.iter().filter(|row| row.cause.get_ref() == cause).map(|row| {
            cell(
                place(&cia402.text, &row.cause),
                format!("any other of {}", listed(&row.classes)),
                about(&row.reaction),
            )
        });
        [north, generic, of_sercos.collect(), codes.chain(classes).collect()]
    });
    page.push_str("<h2 id=\"faults\">Faults</h2>\n");
    rows(
        page,
        "Causes",
        "From the word or code of the drive to that of the controller; next to the cause its usual reaction",
        &rows_of_causes.collect::<Vec<_>>(),
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The texts of the four cells of the row of a signal or parameter.
    fn cells(page: &str, name: &str) -> [String; 4] {
        let row = page.lines().find(|line| line.contains(&format!("<b>{name}</b>"))).expect("a row");
        let cells: Vec<String> = row
            .split("<td")
            .skip(1)
            .map(|cell| {
                let mut text = String::new();
                let mut inside = false;
                for letter in cell.split_once('>').map_or("", |(_, cell)| cell).chars() {
                    match letter {
                        '<' => inside = true,
                        '>' => inside = false,
                        letter if !inside => text.push(letter),
                        _ => {}
                    }
                }
                text
            })
            .collect();
        cells.try_into().expect("four cells")
    }

    #[test]
    fn a_value_is_worked_on_all_levels() {
        let mapping = Mapping::embedded().unwrap();
        let mut page = String::new();
        picture(&mut page, &mapping);
        let page = page.replace('\u{202F}', " ");
        let [north, generic, sercos, cia402] = cells(&page, "position_command");
        assert!(north.starts_with("Command Position Command Data Set 1 000 000"), "{north}");
        assert_eq!(generic, "position_command command, nu 1 rev = 1 000 000 000");
        // The preferential resolution of S-0-0079 is 3 600 000 counts in a revolution.
        assert_eq!(sercos, "S-0-0047 Position command value, scaled position 3 600 000");
        assert!(cia402.starts_with("607A:00 Target position 3 600"), "{cia402}");
        // 60 rpm, in 1e-4 of one.
        assert!(cells(&page, "velocity_command")[2].ends_with(" 600 000"));
        assert!(cells(&page, "torque_command").iter().skip(2).all(|cell| cell.ends_with(" 1 000")));
        let [north, _, sercos, _] = cells(&page, "torque_limit_positive");
        assert!(north.starts_with("504 Torque Limit - Positive % Motor Rated 100"), "{north}");
        assert!(sercos.starts_with("S-0-0082 ") && sercos.ends_with(" 1 000"), "{sercos}");
        assert_eq!(cells(&page, "digital_inputs")[2], "", "no row of SERCOS");
        assert!(page.contains("<td class=\"gap\">"));
    }

    #[test]
    fn numbers_are_short_and_their_thousands_apart() {
        let texts = [0.0, 1.0, -1_234.5, 1_000_000.0, 0.000_01].map(short);
        assert_eq!(texts, ["0", "1", "-1\u{202F}234.5", "1\u{202F}000\u{202F}000", "0.00001"]);
    }
}
