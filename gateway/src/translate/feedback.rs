//! From the drive to the controller.

use profile_cia402::master::config::Direction;
use profile_cip::wire::Writer;
use profile_cip::wire::motion::codes::{AxisStateCode, AxisStatus, ControlMode};
use profile_cip::wire::motion::{ActualBlock, ActualPosition, ActualValues, StatusValues};
use profile_generic::image::Signal;
use profile_generic::mode::OperatingMode;
use profile_generic::program::ConversionReport;
use profile_generic::state::{Action, BasicDrive, Report, Request};

use super::command::{frames, raw};
use super::stage::Behind;
use super::tree::hex;
use super::{AxisState, Node, Translator, devicenet, flags, shown};
use crate::mapping::{CipValue, CyclicValues, DriveProgram};

/// Octets of the longest cyclic actual block that is made here.
const BLOCK_MAX: usize = 64;

/// Bits of the Actual Data Set with the signals of a drive (Table 6-2.21).
const ELEMENTS: [(u8, &str, Signal); 3] = [
    (0, "Actual Position", Signal::PositionActual),
    (1, "Actual Velocity", Signal::VelocityActual),
    (2, "Actual Acceleration", Signal::AccelerationActual),
];

impl AxisState {
    /// Takes what the state machine wants of the drive.
    pub(super) fn take(&mut self, action: Action, drive: &DriveProgram) {
        match action {
            // A reset is a procedure command, or bits of one telegram; the control word stays without torque.
            Action::ResetFault => {
                self.action = Action::TorqueOff;
                self.pulse = drive.command_of(Action::ResetFault).is_none();
            }
            Action::None | Action::Reject => {}
            action => self.action = action,
        }
    }
}

impl Translator {
    /// Takes what a drive sent in a cycle, without C-CON.
    pub(super) fn feedback(&mut self, number: usize, bytes: &[u8]) -> Node {
        let axis = &self.stage.axes[number];
        let came = match &axis.behind {
            Behind::Sercos(_) => {
                format!("AT of {}, connection 1, {} bytes: {}", axis.drive, bytes.len(), hex(bytes))
            }
            Behind::Can(drive) => frames(&axis.drive, drive, Direction::Transmit, bytes),
            Behind::Devicenet(_) => return self.answered_alone(number, bytes),
        };
        self.understood(number, Node::new(came), bytes)
    }

    /// What the values of a drive say, behind what they came in.
    pub(super) fn understood(&mut self, number: usize, mut node: Node, bytes: &[u8]) -> Node {
        let (axis, state) = (&self.stage.axes[number], &mut self.states[number]);
        let mapping = &self.stage.mapping;
        let mut report = ConversionReport::default();
        let needed = usize::from(axis.south.telegram.feedback_bytes);
        let Some(word) = axis.south.decode(bytes, false, &mut state.feedback, &mut state.south, &mut report)
        else {
            node.push(Node::new(format!("expected {needed} bytes")));
            return node;
        };
        state.status = word;
        let told = state.feedback.report;
        let machine = state.machine.get_or_insert_with(|| heard_first(told));
        let before = machine.state();
        let transition = machine.report(told);
        let next = machine.state();
        state.feedback.state = next;
        state.take(transition.action, &axis.south);
        let state = &self.states[number];
        let mut heads = axis.south.telegram.feedback.iter();
        if let Some(item) = heads.next() {
            let mode = axis.south.mode(word);
            let shown = mode.map_or_else(|| "none that was set up".to_owned(), |mode| mode.to_string());
            let text = format!("{} {:#06x}: {told}, mode {shown}", self.named(*item), word & 0xFFFF);
            let mut status = Node::new(text)
                .by(axis.report_row(mapping, word))
                .by(mode.and_then(|mode| axis.mode_row(mapping, mode)));
            let words = axis.south.status_words(bytes);
            for (idn, word) in &words {
                status.push(Node::new(format!("{} {word:#06x}", self.named(*idn))));
            }
            let bits = axis.south.status_bits(word, &words);
            if !bits.is_empty() {
                let rows = axis.status_rows(mapping, word, &words);
                status.push(Node::new(format!("status: {}", flags(bits.iter_names()))).by(rows));
            }
            node.push(status);
            if let Some((item, octet)) = heads.next().zip(axis.south.mode_octet(word)) {
                let row = mode.and_then(|mode| axis.mode_row(mapping, mode));
                node.push(Node::new(format!("{} {octet}: mode {shown}", self.named(*item))).by(row));
            }
        }
        if let Some(drive) = axis.devicenet() {
            let mode = axis.south.mode(word);
            let shown_mode = mode.map_or_else(|| "none that was set up".to_owned(), |mode| mode.to_string());
            let told = format!("{}: {told}, mode {shown_mode}", devicenet::told(axis, bytes));
            let mode_row = mode.and_then(|mode| axis.mode_row(mapping, mode));
            let mut status = Node::new(told).by(axis.report_row(mapping, word)).by(mode_row);
            let bits = axis.south.status_bits(word, &[]);
            if !bits.is_empty() {
                status.push(Node::new(format!("status: {}", flags(bits.iter_names()))));
            }
            node.push(status);
            for field in axis.south.feedback.fields() {
                let Some(value) = state.feedback.get(field.signal) else { continue };
                let (name, raw) = (drive.value(field).0, devicenet::raw(drive, field, bytes));
                let generic = shown(axis, field.signal, value);
                let text = format!("{name}: {raw} -> {} {generic}", field.signal);
                node.push(Node::new(text).by(axis.signal_row(mapping, field.signal)));
            }
        }
        for (field, item) in axis.south.feedback_fields() {
            let Some(value) = state.feedback.get(field.signal) else { continue };
            let text = format!(
                "{}: {} -> {} {}",
                self.named(item),
                raw(axis, field, bytes),
                field.signal,
                shown(axis, field.signal, value)
            );
            node.push(Node::new(text).by(axis.signal_row(mapping, field.signal)));
        }
        if bytes.len() < needed {
            node.push(Node::new(format!(
                "expected {needed} bytes, got {}: the rest is not known",
                bytes.len()
            )));
        }
        if report.saturated > 0 {
            node.push(Node::new(format!("{} values are clamped", report.saturated)));
        }
        node.push(Node::new(format!("drive state {before} -> {next}, action {}", transition.action)));
        node.push(self.update_of(number));
        node
    }

    /// What the controller sees of it.
    fn update_of(&self, number: usize) -> Node {
        let (axis, state) = (&self.stage.axes[number], &self.states[number]);
        let mapping = &self.stage.mapping;
        let feedback = &state.feedback;
        let wanted =
            ELEMENTS.iter().fold(
                0,
                |bits, (bit, _, signal)| {
                    if feedback.get(*signal).is_some() { bits | 1 << bit } else { bits }
                },
            );
        let mut values = CyclicValues::default();
        let report = axis.north.encode(feedback, wanted, &mut values);
        let seen = axis.north.state(feedback.state);
        let axis_status = axis.north.axis_status(feedback);
        let real = |bit: usize| match values.0[bit] {
            Some(CipValue::Real(value)) => Some(value),
            _ => None,
        };
        let actual = ActualValues {
            position: match values.0[0] {
                Some(CipValue::Dint(value)) => Some(ActualPosition::Dint(value)),
                _ => None,
            },
            velocity: real(1),
            acceleration: real(2),
            ..ActualValues::default()
        };
        let block = ActualBlock {
            control_mode: control_mode(axis, feedback.mode),
            axis_state: AxisStateCode(seen.axis_state),
            actual,
            status: StatusValues {
                axis_status: Some((AxisStatus::from_bits_retain(axis_status), 0)),
                ..StatusValues::default()
            },
            ..ActualBlock::default()
        };
        let mut bytes = [0; BLOCK_MAX];
        let mut writer = Writer::new(&mut bytes);
        // There is room for all that this block may have.
        let _ = block.emit(&mut writer);
        let len = writer.written();
        let mut node = Node::new(format!(
            "D-to-C cyclic block of instance {}, {len} bytes: {}",
            axis.instance,
            hex(&bytes[..len])
        ));
        let text = format!(
            "Axis State {} from drive state {}: {}",
            block.axis_state,
            feedback.state,
            flags(seen.conditions.iter_names())
        );
        node.push(Node::new(text).by(mapping.state_row(feedback.state)));
        for (bit, name, signal) in ELEMENTS {
            let Some(value) = values.0[usize::from(bit)] else { continue };
            let value = match value {
                CipValue::Dint(value) => value.to_string(),
                CipValue::Real(value) => value.to_string(),
                CipValue::Lreal(value) => value.to_string(),
            };
            node.push(Node::new(format!("{name} {value}")).by(mapping.cyclic_row(signal)));
        }
        let bits = AxisStatus::from_bits_retain(axis_status);
        node.push(Node::new(format!("Axis Status {axis_status:#010x}: {}", flags(bits.iter_names()))));
        if report.saturated > 0 {
            node.push(Node::new(format!("{} values are clamped", report.saturated)));
        }
        node
    }
}

/// The state machine of a drive that was not heard before: one with torque was enabled by someone.
fn heard_first(told: Report) -> BasicDrive {
    let mut machine = BasicDrive::new();
    machine.set_power(true);
    if told.has_torque() {
        machine.report(Report::Ready);
        machine.request(Request::Enable);
        if told != Report::Enabling {
            machine.report(Report::Operating);
        }
    }
    machine
}

/// The Control Mode that leads to a mode.
fn control_mode(axis: &super::StageAxis, mode: OperatingMode) -> ControlMode {
    let codes = 0..=u8::MAX >> 4;
    ControlMode(codes.into_iter().find(|code| axis.north.mode(*code) == Some(mode)).unwrap_or_default())
}
