//! From the controller to the drive: an update goes in at the north port of the bench, and the telegram of the instant for which it is
//! meant comes out at the south port.

use profile_cip::wire::motion::codes::{AxisControl, FeedbackMode};
use profile_cip::wire::motion::{ActualBlock, CommandBlock, CommandPosition, CommandValues, WriteBlock};
use profile_cip::wire::status::GeneralStatus;
use profile_generic::image::{AxisCommand, Signal};
use profile_generic::mode::OperatingMode;
use profile_generic::state::DriveState;

use super::bench::{Telegram, Told, Update};
use super::fact::{Carrier, Direction, Fact, Raw, What, of_command};
use super::stage::StageAxis;
use super::telegram::{raw, sent};
use super::tree::{Mark, text};
use super::{Node, TranslateError, Translator, devicenet, shown};
use crate::engine::bus::devicenet::end::Row;
use crate::engine::notice::Notice;
use crate::mapping::devicenet::ROW_LEN;

/// Places in a command block.
const CONTROL_MODE_AT: usize = 0;
const AXIS_CONTROL_AT: usize = 2;

impl Translator {
    /// Hands an update with these blocks, each with the number of its instance and its cyclic write data, to the device, and pushes
    /// what comes of each block to `node`.
    pub(super) fn commands(
        &mut self,
        update: Update<'_>,
        blocks: &[(u8, CommandBlock, Option<WriteBlock<'_>>)],
        node: &mut Node,
    ) -> Result<(), TranslateError> {
        let stage = std::sync::Arc::clone(&self.stage);
        let mut known = Vec::new();
        for (instance, block, write) in blocks {
            match self.axis_of_instance(*instance) {
                Some(number) => known.push((number, block, write)),
                None => node.push(Node::new(text!("instance {instance}: no axis of the configuration"))),
            }
        }
        let mut replaced = Vec::new();
        for (number, block, _) in &known {
            let place = usize::from(stage.axes[*number].instance).saturating_sub(1);
            let bench = self.bench()?;
            if bench.is_unheard(*number) {
                bench.enable(*number, block.control_mode);
                let usable = bench.feedback_mode(*number);
                if block.feedback_mode.source() != usable.source() {
                    replaced.push((place, block.feedback_mode, usable));
                }
            }
        }
        let device = self.device;
        let bench = self.bench()?;
        bench.take_notices();
        let places: Vec<usize> = known
            .iter()
            .map(|(number, ..)| usize::from(stage.axes[*number].instance).saturating_sub(1))
            .collect();
        let usable: Vec<_> = replaced.iter().map(|(place, _, usable)| (*place, *usable)).collect();
        let told = bench.update(device, update, &places, &usable);
        let said = bench.take_notices();
        for ((number, block, write), told) in known.into_iter().zip(told) {
            let instance = stage.axes[number].instance;
            let replaced = replaced.iter().find(|(place, ..)| *place + 1 == usize::from(instance));
            let mut of_axis =
                self.command(number, block, replaced.map(|(_, mode, _)| *mode), &told, &said)?;
            if let Some(write) = write {
                of_axis.push(self.written_cyclically(number, write));
            }
            node.push(of_axis);
        }
        Ok(())
    }

    /// What came of the block of an axis.
    fn command(
        &mut self,
        number: usize,
        block: &CommandBlock,
        replaced: Option<FeedbackMode>,
        told: &Told,
        said: &[Notice],
    ) -> Result<Node, TranslateError> {
        let stage = std::sync::Arc::clone(&self.stage);
        let (axis, mapping) = (&stage.axes[number], &stage.mapping);
        let mut node = Node::new(text!("axis {} (instance {}) on {}", axis.name, axis.instance, axis.drive))
            .about(number);
        let asked = |what, raw| Fact {
            axis: number,
            direction: Direction::FromController,
            recorded: true,
            what,
            raw,
        };
        let control_mode = block.control_mode;
        let mode = axis.north.mode(control_mode.0);
        let raw =
            Raw::new(&[control_mode.0], Some(control_mode.0.into()), Some(CONTROL_MODE_AT), Carrier::Block);
        let fact = asked(What::Mode(mode), Some(raw));
        let shown_mode = match mode {
            Some(mode) => Node::new(text!("Control Mode {control_mode} -> mode {mode}"))
                .by(axis.control_mode_row(mapping, mode)),
            None => Node::new(text!("Control Mode {control_mode}: no row")),
        };
        node.push(shown_mode.shows([fact]));
        if let Some(mode) = replaced {
            node.push(Node::new(text!(
                "Feedback Mode {}: the gateway refuses to enable an axis with it; translated as one with Motor Feedback",
                mode.source()
            )));
        }
        let bench = self.bench()?;
        let (_, state) = bench.state_of(number);
        let fault = bench.engine().axes()[number].fault();
        let follows = mode.is_some_and(|mode| mode != OperatingMode::None && told.command.mode == mode)
            && state == DriveState::Operating
            && fault.is_none();
        let answer = self.block_of(number);
        node.facts.extend(self.fault_ended(number));
        for ((text, signal), (_, raw)) in elements(&block.values).into_iter().zip(of_command(block)) {
            let value = told.command.get(signal).filter(|_| follows);
            let element = match value {
                Some(value) => Node::new(text!("{text} -> {signal} {}", shown(axis, signal, value)))
                    .by(axis.cyclic_row(mapping, signal)),
                None => Node::new(text!("{text}: not followed")),
            };
            node.push(element.shows([asked(What::Signal(signal, value), Some(raw))]));
        }
        if let Some(count) = block.values.unwind_count {
            node.push(Node::new(text!("Unwind Cycle Count {count}")));
        }
        self.request(number, block, answer.as_ref(), &mut node);
        push_notices(&mut node, said, number, axis);
        for telegram in &told.before {
            let mut before = self.telegram_of(number, telegram, false);
            before.text.insert_str(0, "before: ");
            node.push(before);
        }
        node.push(match &told.last {
            Some(telegram) => self.telegram_of(number, telegram, true),
            None => Node::new(text!("nothing is sent to {}", axis.drive)),
        });
        if !follows {
            node.push(Node::new("the drive does not follow: set-points are withheld"));
        }
        Ok(node)
    }

    /// What Axis Control asks for, and the response.
    fn request(&self, number: usize, block: &CommandBlock, answer: Option<&ActualBlock>, node: &mut Node) {
        let axis = &self.stage.axes[number];
        let code = block.axis_control;
        let raw = Raw::new(&[code.0], Some(code.0.into()), Some(AXIS_CONTROL_AT), Carrier::Block);
        let fact = Fact {
            axis: number,
            direction: Direction::FromController,
            recorded: true,
            what: What::Request(code),
            raw: Some(raw),
        };
        if code == AxisControl::NONE {
            node.facts.push(fact);
            return;
        }
        let row = self.stage.mapping.request_row(code.0);
        let mut request = match axis.north.request(code.0) {
            None => Node::new(text!("Axis Control {code}: no row")),
            Some(request) => match request.request {
                Some(asked) => Node::new(text!("Axis Control {code} -> {asked}")).by(row),
                None => Node::new(text!("Axis Control {code}: carried out by the device")).by(row),
            },
        };
        if let Some(answer) = answer {
            let text = match answer.axis_response {
                AxisControl::NONE => "no response yet".to_owned(),
                response => text!("Axis Response {response}, {}", GeneralStatus(answer.response_status)),
            };
            request.push(Node::new(text));
        }
        node.push(request.shows([fact]));
    }

    /// What the drive is told, with its values or with its words alone.
    fn telegram_of(&self, number: usize, told: &Telegram, values: bool) -> Node {
        let (axis, mapping) = (&self.stage.axes[number], &self.stage.mapping);
        let Telegram { bytes, command, action, shown } = told;
        let status = axis.south.status(shown).unwrap_or_default();
        let selection = command.selection();
        let mut node = Node::new(sent(axis, bytes)).about(number);
        let made =
            |what, raw| Fact { axis: number, direction: Direction::ToDrive, recorded: false, what, raw };
        if let Some(drive) = axis.devicenet() {
            let mut row: Row = [0; ROW_LEN];
            if let Err(error) = drive.end.clone().overhear(bytes, &mut row) {
                node.push(Node::new(text!("not readable: {error}")));
                return node;
            }
            let text = text!("{}: action {action}, mode {}", devicenet::asked(axis, &row), command.mode);
            let facts = [What::Action(*action), What::Mode(Some(command.mode))].map(|what| made(what, None));
            node.push(Node::new(text).by(devicenet::rows_of(axis, mapping, &row)).shows(facts));
            for field in devicenet::values_to(axis, &row).filter(|_| values) {
                let (name, raw) = (drive.value(field).0, devicenet::raw(drive, field, &row));
                let fact = Raw::of_field(axis, field, &row);
                node.push(self.made_of(number, &text!("{name}: {raw}"), field.signal, command, fact));
            }
            return node;
        }
        let mut heads = axis.south.heads_of_command();
        let word_of = |item| {
            let (at, len) = axis.south.place_of_command(item)?;
            bytes.get(at..at + len)
        };
        if let Some((item, word)) = heads.next().and_then(|item| Some((item, word_of(item)?))) {
            let at = axis.south.place_of_command(item).map_or(0, |(at, _)| at);
            let raw = Raw::of_word(axis, true, at, bytes);
            let word = word.first_chunk().map_or(0, |word| u16::from_le_bytes(*word));
            let text = text!("{} {word:#06x}: action {action}, mode {}", self.named(item), command.mode);
            node.push(
                Node::new(text)
                    .by(axis.action_row(mapping, *action, status))
                    .by(axis.mode_row(mapping, selection))
                    .shows([made(What::Action(*action), raw), made(What::Mode(Some(command.mode)), raw)]),
            );
        }
        if let Some((item, &[octet])) = heads.next().and_then(|item| Some((item, word_of(item)?))) {
            let octet = i8::from_le_bytes([octet]);
            let text = text!("{} {octet}: mode {}", self.named(item), command.mode);
            node.push(Node::new(text).by(axis.mode_row(mapping, selection)));
        }
        for (field, item) in axis.south.command_fields().filter(|_| values) {
            let text = text!("{}: {}", self.named(item), raw(axis, field, bytes));
            let fact = Raw::of_field(axis, field, bytes);
            node.push(self.made_of(number, &text, field.signal, command, fact));
        }
        node
    }

    /// A value of a telegram, and what of the command it was made of.
    fn made_of(&self, number: usize, text: &str, signal: Signal, command: &AxisCommand, raw: Raw) -> Node {
        let axis = &self.stage.axes[number];
        let value = command.get(signal).unwrap_or_default();
        Node::new(text!("{text} <- {signal} {}", shown(axis, signal, value)))
            .by(axis.signal_row(&self.stage.mapping, signal))
            .shows([Fact {
                axis: number,
                direction: Direction::ToDrive,
                recorded: false,
                what: What::Signal(signal, Some(value)),
                raw: Some(raw),
            }])
    }
}

/// What the gateway has said about an axis and its device: changes of state, refusals, and faults with their reasons.
pub(super) fn push_notices(node: &mut Node, said: &[Notice], number: usize, axis: &StageAxis) {
    let own = |notice: &&Notice| match notice {
        Notice::State { .. }
        | Notice::AxisState { .. }
        | Notice::Fault { .. }
        | Notice::Refused { .. }
        | Notice::Logged { .. }
        | Notice::NotEqual { .. }
        | Notice::NotKept { .. }
        | Notice::DriveRefuses { .. }
        | Notice::OtherNameplate { .. }
        | Notice::NotReturned { .. }
        | Notice::Scaling { .. }
        | Notice::DriveSays { .. }
        | Notice::SlaveAnswers { .. } => notice.axis().map(usize::from) == Some(number),
        Notice::Node { device, .. } => usize::from(*device) == axis.device,
        _ => false,
    };
    for notice in said.iter().filter(own) {
        let text = notice.to_string();
        // When it was is the bench's time, which says nothing.
        let (text, rest) = match notice {
            Notice::Fault { .. } => text.split_once(") at ").map_or((text.as_str(), ""), |(fault, rest)| {
                (fault, rest.split_once(": ").map_or("", |(_, why)| why))
            }),
            _ => (text.as_str(), ""),
        };
        let line = Node::new(match (notice, rest) {
            (Notice::Fault { .. }, "") => text!("log: {text})"),
            (Notice::Fault { .. }, why) => text!("log: {text}): {why}"),
            _ => text!("log: {text}"),
        });
        let fault = match notice {
            Notice::Fault { fault, .. } => Some(Fact {
                axis: number,
                direction: Direction::ToController,
                recorded: false,
                what: What::Fault(Some(fault.cause)),
                raw: None,
            }),
            _ => None,
        };
        node.push(line.about(number).marked(Mark::Log).shows(fault));
    }
}

/// The command values as they came, each with the signal that it belongs to.
fn elements(values: &CommandValues) -> Vec<(String, Signal)> {
    let mut elements = Vec::new();
    match values.position {
        Some(CommandPosition::Float(value)) => {
            elements.push((text!("Command Position {value} (LREAL)"), Signal::PositionCommand));
        }
        Some(CommandPosition::Integer(value)) => {
            elements.push((text!("Command Position {value} (DINT)"), Signal::PositionCommand));
        }
        None => {}
    }
    let reals = [
        ("Command Velocity", values.velocity, Signal::VelocityCommand),
        ("Command Acceleration", values.acceleration, Signal::AccelerationCommand),
        ("Command Torque", values.torque, Signal::TorqueCommand),
    ];
    for (name, value, signal) in reals {
        elements.extend(value.map(|value| (text!("{name} {value}"), signal)));
    }
    elements
}
