//! Drives on DeviceNet: polls and their answers, put together from their fragments.
//!
//! A program sees a drive as a row of bytes, which the box's end of the poll connection makes messages of
//! (`mapping::devicenet`). Here that end listens: what it hears to the drive tells it which answer is the next.

use profile_cip::devicenet::fragmentation::{FragmentError, IoReceiver};
use profile_cip::devicenet::wire::Identifier;
use profile_cip::devicenet::wire::speed::SupervisorState;
use profile_cip::wire::motion::codes::{AxisControl, AxisStateCode, ControlMode};
use profile_generic::can::{Frame, Id};
use profile_generic::program::{Field, Width};

use super::stage::{DevicenetDrive, StageAxis};
use super::telegram::{bytes_of, generic_of};
use super::tree::{Row as TableRow, hex};
use super::{Node, TranslateError, Translator, flags, shown};
use crate::engine::bus::devicenet::end::{End, Row};
use crate::mapping::Mapping;
use crate::mapping::devicenet::{DevicenetAxis, MODE_AT, ROW_LEN, motion, speed};

/// What is heard of the poll connection of a drive.
#[derive(Debug)]
pub(super) struct Listener {
    end: End,
    command: IoReceiver,
    answer: IoReceiver,
    /// Messages to the drive.
    cycle: u64,
    /// What its answers have reported.
    row: Row,
}

impl Listener {
    pub fn new(drive: &DevicenetDrive) -> Self {
        let (command, answer) = Default::default();
        Self { end: drive.end.clone(), command, answer, cycle: 0, row: [0; ROW_LEN] }
    }
}

impl Translator {
    /// Takes a frame of a DeviceNet; `None` of one that is no end of a poll or its answer. `bus` is the number of its bus among
    /// the CAN buses of the configuration, where it is known.
    pub(super) fn devicenet(
        &mut self,
        bus: Option<usize>,
        frame: &Frame,
    ) -> Option<Result<Node, TranslateError>> {
        let Id::Standard(bits) = frame.id() else { return None };
        if frame.is_remote() || frame.is_fd() {
            return None;
        }
        let (mac, is_command) = match Identifier::parse(bits).ok()? {
            Identifier::PollCommand(mac) => (mac, true),
            Identifier::PollResponse(mac) => (mac, false),
            _ => return None,
        };
        let of_drive =
            |axis: &StageAxis| axis.devicenet().is_some_and(|drive| drive.mac == mac) && axis.may_be_on(bus);
        let axes = self.stage.axes.iter().enumerate().filter(|(_, axis)| of_drive(axis));
        let axes: Vec<usize> = axes.map(|(number, _)| number).collect();
        let mut told = axes.into_iter().filter_map(|number| self.poll(number, is_command, frame.data()));
        let mut first = told.next()?;
        // Drives with this MAC ID on several networks, and nobody knows which.
        for other in told {
            match (&mut first, other) {
                (Ok(first), Ok(other)) => first.push(other),
                (Ok(_), Err(error)) => first = Err(error),
                (Err(_), _) => {}
            }
        }
        Some(first)
    }

    /// A frame of a poll; `None` while its message is not whole.
    fn poll(&mut self, number: usize, is_command: bool, data: &[u8]) -> Option<Result<Node, TranslateError>> {
        let listener = self.states[number].listener.as_mut()?;
        let (output, input) = listener.end.lengths();
        let (receiver, size) =
            if is_command { (&mut listener.command, output) } else { (&mut listener.answer, input) };
        match receiver.handle(size, data) {
            Ok(true) => {}
            // What has begun before the recording, or was dropped and told already.
            Ok(false) | Err(FragmentError::NoBeginning { .. }) => return None,
            Err(error) => {
                let drive = &self.stage.axes[number].drive;
                return Some(Ok(Node::new(format!("message of {drive} dropped: {error}"))));
            }
        }
        let message = receiver.data().to_vec();
        Some(if is_command { Ok(self.polled(number, &message)) } else { self.answered(number, &message) })
    }

    /// What a drive is told, read back.
    fn polled(&mut self, number: usize, message: &[u8]) -> Node {
        let (axis, state) = (&self.stage.axes[number], &mut self.states[number]);
        let mut node = Node::new(poll_of(axis, message)).about(number);
        let Some(listener) = &mut state.listener else { return node };
        listener.cycle += 1;
        if message.is_empty() {
            return Node::new(format!("poll of {} without data: nothing is commanded", axis.drive));
        }
        let mut row = [0; ROW_LEN];
        if let Err(error) = listener.end.overhear(message, &mut row) {
            node.push(Node::new(format!("not readable: {error}")));
            return node;
        }
        node.push(Node::new(asked(axis, &row)).by(rows_of(axis, &self.stage.mapping, &row)));
        for field in values_to(axis, &row) {
            node.push(self.command_value_of(number, field, &row));
        }
        node
    }

    /// What a drive says.
    pub(super) fn answered(&mut self, number: usize, message: &[u8]) -> Result<Node, TranslateError> {
        let (axis, state) = (&self.stage.axes[number], &mut self.states[number]);
        let mut node =
            Node::new(format!("answer of {}, {} bytes: {}", axis.drive, message.len(), hex(message)));
        let Some(listener) = &mut state.listener else { return Ok(node) };
        if message.is_empty() {
            let text = format!("answer of {} without data: there is nothing valid to tell", axis.drive);
            return Ok(Node::new(text));
        }
        if let Err(error) = listener.end.handle(listener.cycle, message, &mut listener.row) {
            node.push(Node::new(format!("not taken: {error}")));
            return Ok(node);
        }
        let row = listener.row;
        self.understood(number, node, message, &row)
    }

    /// What a drive says, whatever it was asked before.
    pub(super) fn answered_alone(&mut self, number: usize, message: &[u8]) -> Result<Node, TranslateError> {
        if let Some(listener) = &mut self.states[number].listener {
            listener.cycle += 1;
            listener.end.expect(message);
        }
        self.answered(number, message)
    }

    /// A value of a row of commands.
    fn command_value_of(&self, number: usize, field: &Field, row: &Row) -> Node {
        let axis = &self.stage.axes[number];
        let Some(drive) = axis.devicenet() else { return Node::new("") };
        let generic =
            generic_of(field, row).map_or_else(String::new, |value| shown(axis, field.signal, value));
        let text =
            format!("{}: {} = {} {generic}", drive.value(field).0, raw(drive, field, row), field.signal);
        self.sent_value(number, text, field, row)
    }
}

/// A message to a drive.
pub(super) fn poll_of(axis: &StageAxis, message: &[u8]) -> String {
    format!("poll of {}, {} bytes: {}", axis.drive, message.len(), hex(message))
}

/// What a row of commands asks for beside its values.
pub(super) fn asked(axis: &StageAxis, row: &Row) -> String {
    match axis.devicenet().map(|drive| &drive.needs) {
        Some(DevicenetAxis::Speed(_)) => {
            let bits = [(speed::RUN, "run"), (speed::RESET, "fault reset")];
            let set = bits.into_iter().filter(|(bit, _)| row[0] & bit != 0);
            flags(set.map(|(bit, name)| (name, bit)))
        }
        _ => format!("Axis Control {}, Control Mode {}", AxisControl(row[0]), ControlMode(row[MODE_AT])),
    }
}

/// The rows of what is asked for, and of the mode.
pub(super) fn rows_of(axis: &StageAxis, mapping: &Mapping, row: &Row) -> Vec<TableRow> {
    if !axis.devicenet().is_some_and(DevicenetDrive::is_motion) {
        return Vec::new();
    }
    let mode = axis.south.mode(word_of(row)).and_then(|selection| axis.mode_row(mapping, selection));
    mapping.request_row(row[0]).map(TableRow::from).into_iter().chain(mode).collect()
}

/// Status or control as a program sees it: two bytes and the mode.
const fn word_of(row: &Row) -> u32 {
    u32::from_le_bytes([row[0], row[1], row[MODE_AT], 0])
}

/// What a row of actual values says beside them.
pub(super) fn told(axis: &StageAxis, row: &[u8]) -> String {
    let at = |place: usize| row.get(place).copied().unwrap_or_default();
    match axis.devicenet().map(|drive| &drive.needs) {
        Some(DevicenetAxis::Speed(needs)) if needs.extended => {
            format!("status {:#04x}, drive state {}", at(0), SupervisorState(at(1)))
        }
        Some(DevicenetAxis::Speed(_)) => format!("status {:#04x}", at(0)),
        _ => {
            let node = match at(1) {
                bits if bits & motion::NODE_FAULT != 0 => "node fault",
                bits if bits & motion::VALID != 0 => "valid",
                _ => "not valid",
            };
            format!("Axis State {}, {node}, Control Mode {}", AxisStateCode(at(0)), ControlMode(at(MODE_AT)))
        }
    }
}

/// The values of a row of commands that its mode carries: a message has one.
pub(super) fn values_to<'a>(axis: &'a StageAxis, row: &Row) -> impl Iterator<Item = &'a Field> {
    let carried =
        axis.south.mode(word_of(row)).map(|selection| axis.south.carries(selection)).unwrap_or_default();
    axis.south.command.fields().filter(move |field| carried.contains(field.signal.command_bit()))
}

/// The number of a field, its bytes, and where they stand in the message.
pub(super) fn raw(drive: &DevicenetDrive, field: &Field, row: &[u8]) -> String {
    let bytes = bytes_of(field, row);
    let number = match bytes.first_chunk() {
        Some(real) if field.width == Width::F32 => f32::from_le_bytes(*real).to_string(),
        _ => field.width.integer(bytes).map_or_else(String::new, |number| number.to_string()),
    };
    match drive.value(field).1 {
        Some(at) => format!("{number} ({} at {at})", hex(bytes)),
        None => number,
    }
}
