//! Shows the facts of a box on a bench.

use std::collections::BTreeMap;

use profile_cip::wire::motion::codes::{AxisControl, ControlMode};
use profile_cip::wire::motion::fixed::FixedActual;
use profile_cip::wire::motion::{
    ActualBlock, ActualFrame, ActualPosition, CommandBlock, CommandPosition, CommandValues,
};
use profile_generic::image::Signal;
use profile_generic::program::Width;
use profile_generic::state::Action;

use super::Failure;
use super::parse::{Done, Expected, Fact, Generic, Group, Place, Quantity};
use crate::config::Config;
use crate::mapping::{
    AttributeEntry, Backing, Cia402Axis, DriveProgram, Item, Mapping, ObjectFacts, Origin, SercosAxis,
};
use crate::translate::bench::{Bench, Told};
use crate::translate::stage::{Behind, Stage, StageAxis, ValuesError};
use crate::translate::tree::hex;

/// Attributes of the trims, Tables 5-2.40, 5-2.42 and 5-2.46.
const POSITION_TRIM: u16 = 431;
const VELOCITY_TRIM: u16 = 451;
const TORQUE_TRIM: u16 = 491;

/// Relative error that a real number in a single may have.
const SINGLE: f64 = 1e-6;

/// Commissions the drives of the configuration, and shows group after group.
pub(super) fn play(
    config: &Config,
    mapping: &Mapping,
    file: &str,
    place: &Place<'_>,
    most: usize,
    failures: &mut Vec<Failure>,
) -> Result<(), String> {
    let mut stage = Stage::rehearse(config, mapping.clone()).map_err(|error| error.to_string())?;
    let axes = stage.axes.clone();
    for group in &place.groups {
        stage.axes.clone_from(&axes);
        let failed = |error: ValuesError| format!("{}: {error}", group.title);
        stage = stage.with_values(&group.values).map_err(failed)?;
        // A drive of other modes gets other telegrams: it is commissioned for its group alone.
        let own = match stage.has_telegrams_of(&axes) {
            true => None,
            false => Some(stage.rehearse_with(&group.values).map_err(failed)?),
        };
        let on = own.as_ref().unwrap_or(&stage);
        let bench = on.bench().map_err(|error| error.to_string())?;
        let mut player = Player { stage: on, bench, able: BTreeMap::new(), axes: BTreeMap::new() };
        player.group(file, group, most, failures);
        let Player { bench, .. } = player;
        on.keep(bench);
        if failures.len() >= most {
            break;
        }
    }
    Ok(())
}

/// What an axis was told and shown last.
#[derive(Debug, Default)]
struct Last {
    block: Option<CommandBlock>,
    shown: Vec<u8>,
}

/// What came of something.
#[derive(Debug, Default)]
struct Outcome {
    told: Option<Told>,
    answer: Option<u8>,
    written: Vec<(Item, Vec<u8>)>,
    block: Option<ActualBlock>,
    /// What the drive showed before it had an error, if a fact has said it.
    recover: Option<Option<Vec<u8>>>,
}

struct Player<'s> {
    stage: &'s Stage,
    bench: Box<Bench>,
    /// Programs for drives that have everything, by the axis.
    able: BTreeMap<usize, Option<DriveProgram>>,
    axes: BTreeMap<usize, Last>,
}

/// What was found in place of what was expected.
struct Wrong {
    expected: String,
    found: String,
    dangerous: bool,
    rows: Vec<Option<Origin>>,
}

impl Player<'_> {
    fn group(&mut self, file: &str, group: &Group<'_>, most: usize, failures: &mut Vec<Failure>) {
        for fact in &group.facts {
            let Some(axis) = self.stage.axis(fact.axis) else {
                failures.push(Failure {
                    says: fact.says.to_owned(),
                    group: group.title.to_owned(),
                    place: format!("{file}:{}", fact.line),
                    expected: format!("an axis `{}`", fact.axis),
                    found: "no such axis".to_owned(),
                    dangerous: true,
                    rows: Vec::new(),
                });
                continue;
            };
            let outcome = self.act(axis, &fact.done);
            let wrong = fact.expected.iter().find_map(|one| self.judge(axis, fact, one, &outcome));
            if let Some(Wrong { expected, found, dangerous, rows }) = wrong {
                failures.push(Failure {
                    says: fact.says.to_owned(),
                    group: group.title.to_owned(),
                    place: format!("{file}:{}", fact.line),
                    expected,
                    found,
                    dangerous,
                    rows: rows.into_iter().flatten().collect(),
                });
                if failures.len() >= most {
                    return;
                }
            }
            if let Some(before) = outcome.recover {
                self.bench.recover(axis, before);
            }
        }
    }

    fn act(&mut self, axis: usize, done: &Done) -> Outcome {
        let mut outcome = Outcome::default();
        let last = self.axes.entry(axis).or_default();
        match done {
            Done::Update { mode, values, trims } => {
                let block = CommandBlock {
                    control_mode: *mode,
                    values: command_values(values),
                    ..self.bench.standing(axis, *mode)
                };
                last.block = Some(block);
                if self.bench.is_unheard(axis) {
                    self.bench.enable(axis, *mode);
                }
                outcome.told = if trims.is_empty() {
                    self.bench.command(axis, block)
                } else {
                    let (attributes, data) = cyclic_writes(trims);
                    self.bench.command_with(axis, block, &attributes, &data)
                };
            }
            Done::Request(code) => {
                let standing = || self.bench.standing(axis, ControlMode::POSITION);
                let block = last.block.unwrap_or_else(standing);
                let block = CommandBlock { axis_control: AxisControl(*code), ..block };
                outcome.told = self.bench.command(axis, block);
            }
            Done::Enable(mode) => {
                last.block = Some(self.bench.standing(axis, *mode));
                self.bench.enable(axis, *mode);
            }
            Done::Shows(values) => {
                let south = &self.stage.axes[axis].south;
                last.shown.resize(usize::from(south.telegram.feedback_bytes), 0);
                for (item, value) in values {
                    let place =
                        south.place_of_feedback(*item).and_then(|(at, len)| last.shown.get_mut(at..at + len));
                    place
                        .into_iter()
                        .flatten()
                        .zip(value.to_le_bytes())
                        .for_each(|(place, byte)| *place = byte);
                }
                let shown = last.shown.clone();
                self.bench.say(axis, &shown, None);
                self.bench.listen(axis);
                self.bench.listen(axis);
            }
            Done::Bytes(bytes) => {
                self.bench.say(axis, bytes, None);
                self.bench.listen(axis);
                self.bench.listen(axis);
            }
            Done::Diagnosis { item, word, stops } => {
                outcome.recover = Some(self.bench.diagnose(axis, *item, *word, *stops));
            }
            Done::Set { attribute, value } => {
                let entry = self.stage.axes[axis].attributes.get(*attribute);
                let bytes = entry.map(|entry| encoded(entry, *value)).unwrap_or_default();
                let (reply, written) = self.bench.set(axis, *attribute, &bytes);
                (outcome.answer, outcome.written) = (reply.map(|reply| reply.general_status), written);
            }
            Done::Holds(item, value) => {
                self.bench.hold(axis, *item, *value, item_len(&self.stage.axes[axis], *item))
            }
            Done::Generic(generic, value) => {
                let stage = self.stage;
                let known = self.able.entry(axis);
                let able = known.or_insert_with(|| able(&stage.axes[axis], &stage.mapping));
                outcome.written = able.as_ref().map(|able| made(able, *generic, *value)).unwrap_or_default();
            }
            Done::Silence => outcome.told = self.bench.silence(axis),
            Done::Commissioned => {}
        }
        outcome.block = self.block_of(axis);
        outcome
    }

    /// The cyclic block of an axis in the newest update of its device.
    fn block_of(&self, axis: usize) -> Option<ActualBlock> {
        let update = self.bench.actual(axis);
        if let Ok(fixed) = FixedActual::parse(&update) {
            return Some(fixed.block());
        }
        let instance = self.stage.axes[axis].instance;
        ActualFrame::parse(&update).ok()?.instances().find(|known| known.number == instance)?.cyclic
    }

    fn judge(
        &mut self,
        number: usize,
        fact: &Fact<'_>,
        expected: &Expected,
        outcome: &Outcome,
    ) -> Option<Wrong> {
        let (axis, mapping) = (&self.stage.axes[number], &self.stage.mapping);
        match expected {
            Expected::Told { item, value, mask } => told(axis, mapping, *item, *value, *mask, outcome),
            Expected::At { offset, bytes } => {
                let sent = outcome.told.as_ref().and_then(|told| told.last.as_ref());
                let found = sent.and_then(|last| last.bytes.get(*offset..offset + bytes.len()));
                (found != Some(bytes)).then(|| Wrong {
                    expected: format!("{} at byte {offset}", hex(bytes)),
                    found: found.map_or_else(|| "no such telegram".to_owned(), hex),
                    dangerous: true,
                    rows: vec![update_row(mapping, &fact.done)],
                })
            }
            Expected::Actual(quantity, value) => {
                let found = outcome.block.as_ref().and_then(|block| actual(block, *quantity));
                let signal = feedback_signal(*quantity);
                (!found.is_some_and(|found| is_close(found, *value))).then(|| Wrong {
                    expected: format!("{value}"),
                    found: found.map_or_else(|| "no value".to_owned(), |found| found.to_string()),
                    dangerous: found.is_none_or(|found| found.signum() != value.signum()),
                    rows: vec![
                        axis.find_signal_row(mapping, signal),
                        mapping.cyclic_row(signal),
                        scaling_row(axis, mapping, signal),
                    ],
                })
            }
            Expected::State(code) => {
                let found = outcome.block.as_ref().map(|block| block.axis_state.0);
                let status = axis.south.status(&self.axes.get(&number)?.shown).unwrap_or_default();
                let rows = vec![axis.find_report_row(mapping, status), mapping.axis_state_row(*code)];
                code_differs("Axis State", *code, found, rows)
            }
            Expected::Response(code) => {
                let found = outcome.block.as_ref().map(|block| block.axis_response.0);
                code_differs("Axis Response", *code, found, vec![update_row(mapping, &fact.done)])
            }
            Expected::Status { bit, set } => {
                let status = outcome.block.as_ref().and_then(|block| block.status.axis_status);
                let status = status.map(|(status, _)| status.bits());
                self.bit_differs(number, "Axis Status", *bit, *set, status)
            }
            Expected::Io { bit, set } => {
                let status = outcome.block.as_ref().and_then(|block| block.status.io_status);
                let status = status.map(|(status, _)| status.bits());
                self.bit_differs(number, "Axis I/O Status", *bit, *set, status)
            }
            Expected::Attribute { id, value } => self.attribute(number, &fact.done, *id, *value),
            Expected::Answer(code) => {
                let row = match fact.done {
                    Done::Set { attribute, .. } => mapping.attribute_row(attribute),
                    _ => None,
                };
                code_differs("general status", *code, outcome.answer, vec![row])
            }
            Expected::Kept { item, value } | Expected::Wrote { item, value } => {
                let found = match expected {
                    Expected::Kept { .. } => self.bench.kept(number, *item),
                    _ => {
                        let len = item_len(axis, *item);
                        let written = outcome.written.iter().rfind(|(known, _)| known == item);
                        written.map(|(_, bytes)| signed(bytes.get(..len).unwrap_or(bytes)))
                    }
                };
                // A word without a sign is held as it is written in the fact.
                let is_word = (0x8000..=0xFFFF).contains(value);
                let same = |found: i64| found == *value || is_word && found == *value - 0x1_0000;
                (!found.is_some_and(same)).then(|| Wrong {
                    expected: format!("{value} ({value:#x}) in {item}"),
                    found: found
                        .map_or_else(|| "nothing".to_owned(), |found| format!("{found} ({found:#x})")),
                    dangerous: found.is_none_or(|found| found.signum() != value.signum()),
                    rows: self.rows_of(number, *item, &fact.done),
                })
            }
        }
    }

    /// The rows by which a parameter of the drive is written.
    fn rows_of(&self, number: usize, item: Item, done: &Done) -> Vec<Option<Origin>> {
        let (axis, mapping) = (&self.stage.axes[number], &self.stage.mapping);
        let places = axis.south.parameters().iter().filter(|place| place.item == item);
        let mut rows: Vec<_> = places.map(|place| axis.parameter_row(mapping, place.parameter)).collect();
        rows.push(mapping.commission_row(item));
        match done {
            Done::Set { attribute, .. } => rows.push(mapping.attribute_row(*attribute)),
            Done::Generic(Generic::Parameter(known), _) => rows.push(axis.parameter_row(mapping, *known)),
            Done::Generic(Generic::Signal(signal), _) => rows.push(axis.find_signal_row(mapping, *signal)),
            _ => {}
        }
        rows
    }

    fn bit_differs(
        &self,
        number: usize,
        what: &str,
        bit: u8,
        set: bool,
        status: Option<u32>,
    ) -> Option<Wrong> {
        let (axis, mapping) = (&self.stage.axes[number], &self.stage.mapping);
        let found = status.map(|status| status >> bit & 1 == 1);
        let word = |set| if set { "set" } else { "not set" };
        (found != Some(set)).then(|| {
            let shown = self.axes.get(&number).map(|last| last.shown.as_slice()).unwrap_or_default();
            let words = axis.south.status_words(shown);
            let rows = axis.south.status(shown).map(|status| axis.status_rows(mapping, status, &words));
            Wrong {
                expected: format!("bit {bit} of {what} {}", word(set)),
                found: found.map_or("no such word", word).to_owned(),
                dangerous: true,
                rows: rows.unwrap_or_default().into_iter().map(Some).collect(),
            }
        })
    }

    fn attribute(&mut self, number: usize, done: &Done, id: u16, value: f64) -> Option<Wrong> {
        let (axis, mapping) = (&self.stage.axes[number], &self.stage.mapping);
        let entry = axis.attributes.get(id);
        let reply = self.bench.get(number, id);
        let found = reply
            .as_ref()
            .filter(|reply| reply.general_status == 0)
            .and_then(|reply| Some(decoded(entry?.data_type.width(), &reply.data)));
        let parameter = entry.and_then(|entry| match entry.backing {
            Backing::Parameter { parameter, .. } => axis.parameter_row(mapping, parameter),
            Backing::Signal { signal, .. } => axis.find_signal_row(mapping, signal),
            _ => None,
        });
        let mut rows = vec![parameter, mapping.attribute_row(id)];
        if let Done::Diagnosis { item, word, .. } = *done {
            rows.extend(axis.south.faults(item, word).flat_map(|(cause, _)| {
                [axis.fault_row(mapping, item, word, cause), mapping.exception_row(cause)]
            }));
        }
        let is_code = matches!(done, Done::Diagnosis { .. });
        (!found.is_some_and(|found| is_close(found, value))).then(|| Wrong {
            expected: format!("{value} in attribute {id}"),
            found: match (&reply, found) {
                (_, Some(found)) => {
                    format!("{found} ({})", reply.map(|reply| hex(&reply.data)).unwrap_or_default())
                }
                (Some(reply), None) => format!("general status {}", reply.general_status),
                (None, None) => "no answer".to_owned(),
            },
            dangerous: is_code || found.is_none_or(|found| found.signum() != value.signum()),
            rows,
        })
    }
}

/// The program of an axis on a drive that has all modes and parameters, and takes what commissioning writes.
fn able(axis: &StageAxis, mapping: &Mapping) -> Option<DriveProgram> {
    match &axis.behind {
        Behind::Sercos(drive) => {
            let modes = mapping.drive_modes().collect();
            let needs = SercosAxis { modes, set_scaling: true, ..drive.needs.clone() };
            mapping.sercos_program(&needs, &mapping.facts_of_obedient(&needs).ok()?).ok()
        }
        Behind::Can(drive) => {
            let needs = Cia402Axis { modes: mapping.cia402.modes().collect(), ..drive.needs.clone() };
            mapping.cia402_program(&needs, &ObjectFacts::new()).ok()
        }
        Behind::Devicenet(_) => None,
    }
}

/// What a program makes of a value, and where it goes.
fn made(program: &DriveProgram, generic: Generic, value: i64) -> Vec<(Item, Vec<u8>)> {
    match generic {
        Generic::Parameter(parameter) => {
            let place = program.parameter(parameter);
            let made = place.and_then(|place| {
                let (bytes, len, _) = place.encode(value)?;
                Some((place.item, bytes.get(..len)?.to_vec()))
            });
            made.into_iter().collect()
        }
        Generic::Signal(signal) => {
            let fields = program.command_fields().filter(|(field, _)| field.signal == signal);
            fields
                .map(|(field, item)| (item, field.conversion.convert(value).value.to_le_bytes().to_vec()))
                .collect()
        }
    }
}

/// What a drive is told of a value.
fn told(
    axis: &StageAxis,
    mapping: &Mapping,
    item: Item,
    value: i64,
    mask: Option<i64>,
    outcome: &Outcome,
) -> Option<Wrong> {
    let sent = outcome.told.as_ref().and_then(|told| told.last.as_ref());
    let place = axis.south.place_of_command(item);
    let bytes = sent.zip(place).and_then(|(last, (at, len))| last.bytes.get(at..at + len));
    let found = bytes.map(signed);
    let bits = bytes.map_or(0, |bytes| 8 * bytes.len().min(8));
    let whole = if bits >= 64 { -1 } else { (1_i64 << bits) - 1 };
    let mask = mask.unwrap_or(whole);
    if found.is_some_and(|found| (found ^ value) & mask == 0) {
        return None;
    }
    let signal = axis.south.command_fields().find(|(_, known)| *known == item).map(|(field, _)| field.signal);
    let rows = match signal {
        Some(signal) => {
            vec![
                axis.find_signal_row(mapping, signal),
                mapping.cyclic_row(signal),
                scaling_row(axis, mapping, signal),
            ]
        }
        None => {
            let (action, command) =
                sent.map_or((Action::None, None), |last| (last.action, Some(last.command)));
            let status = sent.and_then(|last| axis.south.status(&last.shown)).unwrap_or_default();
            let mode = command.and_then(|command| axis.find_mode_row(mapping, command.selection()));
            vec![axis.find_action_row(mapping, action, status), mode]
        }
    };
    let masked = |value: i64| if mask == whole { value.to_string() } else { format!("{:#x}", value & mask) };
    Some(Wrong {
        expected: format!("{} in {item}", masked(value)),
        found: match (found, bytes) {
            (Some(found), Some(bytes)) => format!("{} (bytes {})", masked(found), hex(bytes)),
            _ if place.is_none() => "no such value in the telegram".to_owned(),
            _ => "no telegram".to_owned(),
        },
        dangerous: signal.is_none() || found.is_none_or(|found| found.signum() != value.signum()),
        rows,
    })
}

/// The row that says what a count of a signal is.
fn scaling_row(axis: &StageAxis, mapping: &Mapping, signal: Signal) -> Option<Origin> {
    match &axis.behind {
        Behind::Sercos(_) => mapping.scaling_row(signal.quantity()),
        Behind::Can(_) => mapping.object_scaling_row(signal.quantity()),
        Behind::Devicenet(_) => None,
    }
}

fn code_differs(what: &str, code: u8, found: Option<u8>, rows: Vec<Option<Origin>>) -> Option<Wrong> {
    (found != Some(code)).then(|| Wrong {
        expected: format!("{what} {code}"),
        found: found.map_or_else(|| "none".to_owned(), |found| found.to_string()),
        dangerous: true,
        rows,
    })
}

/// The row by which an update asks for something.
fn update_row(mapping: &Mapping, done: &Done) -> Option<Origin> {
    match done {
        Done::Request(code) => mapping.request_row(*code),
        _ => None,
    }
}

fn command_values(values: &[(Quantity, f64)]) -> CommandValues {
    let mut all = CommandValues::default();
    for (quantity, value) in values {
        match quantity {
            Quantity::Position => all.position = Some(position(*value)),
            Quantity::Velocity => all.velocity = Some(single(*value)),
            Quantity::Acceleration => all.acceleration = Some(single(*value)),
            Quantity::Torque => all.torque = Some(single(*value)),
        }
    }
    all
}

/// Attributes of trims, and their values as cyclic write data.
fn cyclic_writes(trims: &[(Quantity, f64)]) -> (Vec<u16>, Vec<u8>) {
    let one = |(quantity, value): &(Quantity, f64)| match quantity {
        Quantity::Position => {
            let CommandPosition::Integer(whole) = position(*value) else { return (POSITION_TRIM, [0; 4]) };
            (POSITION_TRIM, whole.to_le_bytes())
        }
        Quantity::Velocity | Quantity::Acceleration => (VELOCITY_TRIM, single(*value).to_le_bytes()),
        Quantity::Torque => (TORQUE_TRIM, single(*value).to_le_bytes()),
    };
    let (attributes, data): (Vec<u16>, Vec<[u8; 4]>) = trims.iter().map(one).unzip();
    (attributes, data.concat())
}

/// A whole number goes as DINT, another one as LREAL.
fn position(value: f64) -> CommandPosition {
    // Checked to be whole and in range.
    #[allow(clippy::cast_possible_truncation)]
    let whole = value as i32;
    if f64::from(whole) == value { CommandPosition::Integer(whole) } else { CommandPosition::Float(value) }
}

fn actual(block: &ActualBlock, quantity: Quantity) -> Option<f64> {
    match quantity {
        Quantity::Position => block.actual.position.map(|position| match position {
            ActualPosition::Dint(value) => f64::from(value),
            // Positions of the facts are far below 2^53.
            #[allow(clippy::cast_precision_loss)]
            ActualPosition::Lint(value) => value as f64,
        }),
        Quantity::Velocity => block.actual.velocity.map(f64::from),
        Quantity::Acceleration => block.actual.acceleration.map(f64::from),
        Quantity::Torque => None,
    }
}

const fn feedback_signal(quantity: Quantity) -> Signal {
    match quantity {
        Quantity::Position => Signal::PositionActual,
        Quantity::Velocity => Signal::VelocityActual,
        Quantity::Acceleration => Signal::AccelerationActual,
        Quantity::Torque => Signal::TorqueActual,
    }
}

// What CIP Motion sends is a single.
#[allow(clippy::cast_possible_truncation)]
fn single(value: f64) -> f32 {
    value as f32
}

fn is_close(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= expected.abs() * SINGLE
}

/// Bytes of a number, least significant first, with its sign.
fn signed(bytes: &[u8]) -> i64 {
    let negative = bytes.last().is_some_and(|last| last & 0x80 != 0);
    let mut wide = [if negative { 0xFF } else { 0 }; 8];
    wide.iter_mut().zip(bytes).for_each(|(place, byte)| *place = *byte);
    i64::from_le_bytes(wide)
}

/// The bytes of an attribute with this value.
fn encoded(entry: &AttributeEntry, value: f64) -> Vec<u8> {
    // Facts have whole numbers for whole attributes.
    #[allow(clippy::cast_possible_truncation)]
    let whole = value as i64;
    match entry.data_type.width() {
        Some(Width::F32) => single(value).to_le_bytes().to_vec(),
        Some(Width::F64) => value.to_le_bytes().to_vec(),
        Some(width) => whole.to_le_bytes().get(..width.bytes()).unwrap_or_default().to_vec(),
        None => whole.to_le_bytes().to_vec(),
    }
}

/// The value of an attribute; of one that is no number, its bytes as a bit string.
fn decoded(width: Option<Width>, bytes: &[u8]) -> f64 {
    match (width, bytes) {
        (Some(Width::F32), &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]).into(),
        (Some(Width::F64), &[a, b, c, d, e, f, g, h]) => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
        // A bit string of an exception has one bit.
        #[allow(clippy::cast_precision_loss)]
        _ => width.and_then(|width| width.integer(bytes)).unwrap_or_else(|| signed(bytes)) as f64,
    }
}

/// Bytes of what a drive holds, where the program of the axis says it.
fn item_len(axis: &StageAxis, item: Item) -> usize {
    axis.south.parameters().iter().find(|place| place.item == item).map_or(4, |place| place.width.bytes())
}
