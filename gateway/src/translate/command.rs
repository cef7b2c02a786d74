//! From the controller to the drive.

use profile_cia402::master::config::Direction;
use profile_cip::device::drive_link::Trims;
use profile_cip::wire::motion::{CommandBlock, CommandPosition, CommandValues};
use profile_generic::image::{AxisCommand, Signal};
use profile_generic::program::{ConversionReport, Field, Width};
use profile_generic::quantity::Position;
use profile_generic::state::{Action, DriveState};

use super::stage::{Behind, CanDrive, StageAxis};
use super::tree::hex;
use super::{Node, Translator, devicenet, shown};
use crate::mapping::devicenet::ROW_LEN;
use crate::mapping::{Cia402Dictionary, CyclicValues, Item};

/// The longest telegram of a drive.
const TELEGRAM_MAX: usize = 256;

impl Translator {
    /// Takes the cyclic command block of an instance, and what its cyclic write data add to it.
    pub(super) fn command(&mut self, instance: u8, block: &CommandBlock, trims: &Trims) -> Node {
        let Some(number) = self.axis_of_instance(instance) else {
            return Node::new(format!("instance {instance}: no axis of the configuration"));
        };
        let (axis, state) = (&self.stage.axes[number], &mut self.states[number]);
        let mapping = &self.stage.mapping;
        let mut node = Node::new(format!("axis {} (instance {instance}) on {}", axis.name, axis.drive));
        let control_mode = block.control_mode;
        let Some(mode) = axis.north.mode(control_mode.0) else {
            node.push(Node::new(format!(
                "Control Mode {control_mode}: no row, so the axis faults with illegal_mode"
            )));
            return node;
        };
        node.push(
            Node::new(format!("Control Mode {control_mode} -> mode {mode}"))
                .by(mapping.control_mode_row(mode)),
        );
        let mut command = AxisCommand { mode, ..state.command };
        let values = CyclicValues::from(&block.values);
        let report = axis.north.decode(&values, 0, &mut state.north, &mut command);
        for (text, signal) in elements(&block.values) {
            let came =
                command.get(signal).map_or_else(|| "left out".to_owned(), |value| shown(axis, signal, value));
            node.push(Node::new(format!("{text} -> {signal} {came}")).by(mapping.cyclic_row(signal)));
        }
        if let Some(count) = block.values.unwind_count {
            node.push(Node::new(format!("Unwind Cycle Count {count}")));
        }
        let added = axis.north.decode_trims(trims, &mut command);
        let doubts = report.saturated + report.not_finite + added.saturated + added.not_finite;
        let refused = !command.add_own_offset() || doubts > 0;
        // The loops of the mode are all that an offset can go to.
        let carried = axis.south.carries(command.selection());
        for signal in Signal::OFFSETS.into_iter().filter(|signal| !carried.contains(signal.command_bit())) {
            command.set(signal, 0);
        }
        if refused {
            node.push(Node::new(
                "half understood: the axis faults with position_command_limit, nothing is led by it",
            ));
        }
        self.request(number, block, &mut node);
        node.push(self.telegram_of(number, command, refused));
        node
    }

    /// What Axis Control asks for.
    fn request(&mut self, number: usize, block: &CommandBlock, node: &mut Node) {
        let (axis, state) = (&self.stage.axes[number], &mut self.states[number]);
        let code = block.axis_control;
        if code.0 == 0 {
            return;
        }
        let row = self.stage.mapping.request_row(code.0);
        let Some(request) = axis.north.request(code.0) else {
            node.push(Node::new(format!("Axis Control {code}: no row, so it is refused")));
            return;
        };
        let Some(asked) = request.request else {
            node.push(Node::new(format!("Axis Control {code}: carried out by the device")).by(row));
            return;
        };
        let text = match &mut state.machine {
            None => format!("Axis Control {code} -> {asked}"),
            Some(machine) => {
                let before = machine.state();
                let transition = machine.request(asked);
                state.take(transition.action, &axis.south);
                format!(
                    "Axis Control {code} -> {asked}: {before} -> {}, action {}",
                    transition.next, transition.action
                )
            }
        };
        node.push(Node::new(text).by(row));
    }

    /// What the drive is told.
    fn telegram_of(&mut self, number: usize, mut command: AxisCommand, refused: bool) -> Node {
        let (axis, state) = (&self.stage.axes[number], &mut self.states[number]);
        let mapping = &self.stage.mapping;
        let led = match &state.machine {
            None => !refused,
            Some(machine) => machine.state() == DriveState::Operating && !refused,
        };
        let action = match state.machine {
            None => Action::Enable,
            Some(_) if std::mem::take(&mut state.pulse) => Action::ResetFault,
            Some(_) => state.action,
        };
        if !led {
            // A drive that does not follow is shown its own position.
            let position = state.feedback.position;
            command = AxisCommand { mode: command.mode, ..AxisCommand::default() };
            command.set(Signal::PositionCommand, position.0);
        }
        fill(&mut command, state.feedback.position);
        let mut bytes = [0; TELEGRAM_MAX];
        let len = match &axis.behind {
            Behind::Devicenet(_) => ROW_LEN,
            _ => usize::from(axis.south.telegram.command_bytes).min(TELEGRAM_MAX),
        };
        let mut report = ConversionReport::default();
        let (control, status) = (state.control, state.status);
        let word = axis.south.encode(&command, action, control, status, &mut bytes[..len], &mut report);
        (state.control, state.command) = (word, command);
        let mut node = match &axis.behind {
            Behind::Devicenet(_) => match self.message_of(number, &bytes[..len]) {
                Some(message) => Node::new(devicenet::poll_of(axis, &message)),
                None => Node::new(format!("poll of {} without data: it cannot carry this", axis.drive)),
            },
            _ => Node::new(sent(axis, &bytes[..len])),
        };
        if !led {
            node.push(Node::new("the drive does not follow: set-points are withheld"));
        }
        let selection = command.selection();
        let mut heads = axis.south.telegram.command.iter();
        if let Some(item) = heads.next() {
            let text = format!(
                "{} {:#06x}: action {action}, mode {}",
                self.named(*item),
                word & 0xFFFF,
                command.mode
            );
            node.push(
                Node::new(text)
                    .by(axis.action_row(mapping, action, status))
                    .by(axis.mode_row(mapping, selection)),
            );
        }
        if let Some((item, octet)) = heads.next().zip(axis.south.mode_octet(word)) {
            let text = format!("{} {octet}: mode {}", self.named(*item), command.mode);
            node.push(Node::new(text).by(axis.mode_row(mapping, selection)));
        }
        if let (Some(drive), Some(row)) = (axis.devicenet(), bytes.first_chunk()) {
            let text = format!("{}: action {action}, mode {}", devicenet::asked(axis, row), command.mode);
            node.push(Node::new(text).by(devicenet::rows_of(axis, mapping, row)));
            for field in devicenet::values_to(axis, row) {
                let value = command.get(field.signal).unwrap_or_default();
                let (name, raw) = (drive.value(field).0, devicenet::raw(drive, field, &bytes));
                let generic = shown(axis, field.signal, value);
                let text = format!("{name}: {raw} <- {} {generic}", field.signal);
                node.push(Node::new(text).by(axis.signal_row(mapping, field.signal)));
            }
        }
        for (field, item) in axis.south.command_fields() {
            let value = command.get(field.signal).unwrap_or_default();
            let text = format!(
                "{}: {} <- {} {}",
                self.named(item),
                raw(axis, field, &bytes),
                field.signal,
                shown(axis, field.signal, value)
            );
            node.push(Node::new(text).by(axis.signal_row(mapping, field.signal)));
        }
        if report.saturated > 0 {
            node.push(Node::new(format!(
                "{} values are clamped: the axis faults with position_command_limit",
                report.saturated
            )));
        }
        node
    }

    /// What stands in a telegram from the master, read back.
    pub(super) fn command_values(&self, number: usize, bytes: &[u8]) -> Node {
        let axis = &self.stage.axes[number];
        let mut node = Node::new(sent(axis, bytes));
        if let (Some(item), Some(word)) = (axis.south.telegram.command.first(), bytes.first_chunk()) {
            node.push(Node::new(format!("{} {:#06x}", self.named(*item), u16::from_le_bytes(*word))));
        }
        for (field, item) in axis.south.command_fields() {
            node.push(self.command_value(number, field, item, bytes));
        }
        node
    }

    /// A value of it.
    pub(super) fn command_value(&self, number: usize, field: &Field, item: Item, bytes: &[u8]) -> Node {
        let axis = &self.stage.axes[number];
        let value =
            generic_of(field, bytes).map_or_else(String::new, |value| shown(axis, field.signal, value));
        let text = format!("{}: {} = {} {value}", self.named(item), raw(axis, field, bytes), field.signal);
        Node::new(text).by(axis.signal_row(&self.stage.mapping, field.signal))
    }

    /// An IDN or object with its name.
    pub(super) fn named(&self, item: Item) -> String {
        let dictionaries = &self.stage.mapping.dictionaries;
        let name = match item {
            Item::Idn(idn) => dictionaries.sercos.idn(idn).map(|row| row.name.clone()),
            Item::Attribute(_) => None,
            Item::Object(object) => {
                let index = Cia402Dictionary::on_first_axis(object.index);
                let row = dictionaries.cia402.object(index);
                row.map(|row| match row.sub(object.sub).map(|sub| sub.name.as_str()) {
                    Some(sub) if object.sub > 0 && !sub.is_empty() => format!("{}, {sub}", row.name),
                    _ => row.name.clone(),
                })
            }
        };
        name.map_or_else(|| item.to_string(), |name| format!("{item} {name}"))
    }
}

/// What goes to a drive, in the frames that carry it.
fn sent(axis: &StageAxis, bytes: &[u8]) -> String {
    match &axis.behind {
        Behind::Sercos(_) => {
            format!("MDT of {}, connection 0, {} bytes: {}", axis.drive, bytes.len(), hex(bytes))
        }
        Behind::Can(drive) => frames(&axis.drive, drive, Direction::Receive, bytes),
        Behind::Devicenet(_) => devicenet::poll_of(axis, bytes),
    }
}

/// The PDOs of a drive with the values of its program.
pub(super) fn frames(name: &str, drive: &CanDrive, direction: Direction, bytes: &[u8]) -> String {
    let pdos = drive.pdos.iter().filter(|pdo| pdo.direction == direction);
    let text = pdos.map(|pdo| format!("{pdo} {}", hex(&CanDrive::spread(pdo, bytes))));
    format!("PDOs of {name}: {}", text.collect::<Vec<_>>().join(", "))
}

/// Set-points that a mode has no use for are zero, and the position is that of the axis, as in the cycle.
fn fill(command: &mut AxisCommand, actual: Position) {
    if command.get(Signal::PositionCommand).is_none() {
        command.set(Signal::PositionCommand, actual.0);
    }
    let set_points = [Signal::VelocityCommand, Signal::AccelerationCommand, Signal::TorqueCommand];
    for signal in set_points.into_iter().chain(Signal::OFFSETS) {
        if command.get(signal).is_none() {
            command.set(signal, 0);
        }
    }
}

/// The command values as they came, each with the signal that it belongs to.
fn elements(values: &CommandValues) -> Vec<(String, Signal)> {
    let mut elements = Vec::new();
    match values.position {
        Some(CommandPosition::Float(value)) => {
            elements.push((format!("Command Position {value} (LREAL)"), Signal::PositionCommand));
        }
        Some(CommandPosition::Integer(value)) => {
            elements.push((format!("Command Position {value} (DINT)"), Signal::PositionCommand));
        }
        None => {}
    }
    let reals = [
        ("Command Velocity", values.velocity, Signal::VelocityCommand),
        ("Command Acceleration", values.acceleration, Signal::AccelerationCommand),
        ("Command Torque", values.torque, Signal::TorqueCommand),
    ];
    for (name, value, signal) in reals {
        elements.extend(value.map(|value| (format!("{name} {value}"), signal)));
    }
    elements
}

/// The bytes of a field, the number in them, and where they stand in which frame.
pub(super) fn raw(axis: &StageAxis, field: &Field, telegram: &[u8]) -> String {
    let (start, bytes) = (usize::from(field.offset), bytes_of(field, telegram));
    let number = field.width.integer(bytes).filter(|_| !field.width.is_float());
    let number = number.map_or_else(String::new, |number| format!("{number} "));
    let way = if field.signal.is_command() { Direction::Receive } else { Direction::Transmit };
    let place = match axis.can().map(|drive| drive.place(way, start)) {
        None => start.to_string(),
        Some(Some((pdo, at))) => format!("{at} of {}{}", pdo.kind(), pdo.number),
        Some(None) => "no place".to_owned(),
    };
    format!("{number}({} at {place})", hex(bytes))
}

/// The bytes of a field; none of one that is not there.
pub(super) fn bytes_of<'t>(field: &Field, telegram: &'t [u8]) -> &'t [u8] {
    let start = usize::from(field.offset);
    telegram.get(start..start + field.width.bytes()).unwrap_or_default()
}

/// The generic value of a field of commands.
pub(super) fn generic_of(field: &Field, telegram: &[u8]) -> Option<i64> {
    let (back, bytes) = (field.conversion.inverse()?, bytes_of(field, telegram));
    if field.width == Width::F32 {
        return Some(back.convert_f64(f32::from_le_bytes(*bytes.first_chunk()?).into())?.value);
    }
    Some(back.convert(field.width.integer(bytes)?).value)
}
