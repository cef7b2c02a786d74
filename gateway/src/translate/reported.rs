//! From the drive to the controller: what a drive sent goes in at the south port of the bench, and the update of the device comes out at
//! the north port.

use profile_cia402::master::config::Direction;
use profile_cip::wire::Writer;
use profile_cip::wire::motion::fixed::FixedActual;
use profile_cip::wire::motion::{ActualBlock, ActualFrame, ActualPosition};
use profile_generic::image::{Signal, StatusBits};
use profile_generic::mode::OperatingMode;

use super::commanded::push_notices;
use super::fact::{Carrier, Direction as Way, Fact, Raw, What, of_actual};
use super::stage::Behind;
use super::telegram::{frames, raw};
use super::tree::{Mark, Row, hex, text};
use super::{Node, TranslateError, Translator, devicenet, flags, shown};
use crate::engine::notice::Notice;
use crate::mapping::Origin;

/// Octets of the longest cyclic actual block.
const BLOCK_MAX: usize = 128;

/// Place of the Axis State in it.
pub(super) const AXIS_STATE_AT: usize = 7;

impl Translator {
    /// Takes what a drive sent in a cycle, without C-CON.
    pub(super) fn feedback(&mut self, number: usize, bytes: &[u8]) -> Result<Node, TranslateError> {
        let axis = &self.stage.axes[number];
        let came = match &axis.behind {
            Behind::Sercos(_) => self.at(number, bytes),
            Behind::Can(drive) => frames(&axis.drive, drive, Direction::Transmit, bytes),
            Behind::Devicenet(_) => return self.answered_alone(number, bytes),
        };
        self.understood(number, Node::new(came), bytes, bytes)
    }

    /// What the values of a drive say, behind what they came in. `row` is what its program sees of them.
    pub(super) fn understood(
        &mut self,
        number: usize,
        node: Node,
        bytes: &[u8],
        row: &[u8],
    ) -> Result<Node, TranslateError> {
        self.say(number, bytes, row)?;
        let bench = self.bench()?;
        bench.take_notices();
        bench.listen(number);
        let said = bench.take_notices();
        self.heard(number, node, row, &said)
    }

    /// Takes what SERCOS drives sent in one telegram.
    pub(super) fn telegram_heard(&mut self, came: &[(usize, &[u8])]) -> Result<Vec<Node>, TranslateError> {
        for (number, bytes) in came {
            self.say(*number, bytes, bytes)?;
        }
        let bench = self.bench()?;
        bench.take_notices();
        bench.listen_once(came.iter().map(|(number, _)| *number));
        let said = bench.take_notices();
        let mut nodes = Vec::with_capacity(came.len());
        for (number, bytes) in came {
            let node = Node::new(self.at(*number, bytes));
            nodes.push(self.heard(*number, node, bytes, &said)?);
        }
        Ok(nodes)
    }

    fn at(&self, number: usize, bytes: &[u8]) -> String {
        let drive = &self.stage.axes[number].drive;
        text!("AT of {drive}, connection 1, {} bytes: {}", bytes.len(), hex(bytes))
    }

    /// The drive says this from now on.
    fn say(&mut self, number: usize, bytes: &[u8], row: &[u8]) -> Result<(), TranslateError> {
        let south = &self.stage.axes[number].south;
        let Some(word) = south.status(row) else { return Ok(()) };
        let mode = south.mode(word).map_or(OperatingMode::Position, |mode| mode.mode);
        let torque = south.report(word).has_torque().then_some(mode);
        self.bench()?.say(number, bytes, torque);
        Ok(())
    }

    /// What the box has made of it.
    fn heard(
        &mut self,
        number: usize,
        mut node: Node,
        row: &[u8],
        said: &[Notice],
    ) -> Result<Node, TranslateError> {
        let stage = std::sync::Arc::clone(&self.stage);
        let (axis, mapping) = (&stage.axes[number], &stage.mapping);
        let needed = usize::from(axis.south.telegram.feedback_bytes);
        let Some(word) = axis.south.status(row) else {
            node.push(Node::new(text!("expected {needed} bytes")).marked(Mark::Error));
            return Ok(node);
        };
        let mode = axis.south.mode(word);
        let bench = self.bench()?;
        let channel = &bench.engine().axes()[number];
        let (told, feedback) = (channel.feedback().report, *channel.feedback());
        node.axis = Some(number);
        let heard = |what, raw| Fact { axis: number, direction: Way::FromDrive, recorded: true, what, raw };
        let generic_mode = mode.map(|mode| mode.mode);
        let shown_mode = mode.map_or_else(|| "none that was set up".to_owned(), |mode| mode.to_string());
        let mode_row = || mode.and_then(|mode| axis.mode_row(mapping, mode));
        let mut heads = axis.south.telegram.feedback.iter();
        if let Some(item) = heads.next() {
            let text = text!("{} {:#06x}: {told}, mode {shown_mode}", self.named(*item), word & 0xFFFF);
            let raw = Raw::of_word(axis, false, 0, row);
            let facts = [heard(What::Report(told), raw), heard(What::Mode(generic_mode), raw)];
            let mut status = Node::new(text).by(axis.report_row(mapping, word)).by(mode_row()).shows(facts);
            let words = axis.south.status_words(row);
            for (idn, word) in &words {
                status.push(Node::new(text!("{} {word:#06x}", self.named(*idn))));
            }
            let rows = || axis.status_rows(mapping, word, &words);
            push_status(&mut status, feedback.status, heard(What::Status(feedback.status), None), rows);
            node.push(status);
            if let Some((item, octet)) = heads.next().zip(axis.south.mode_octet(word)) {
                node.push(
                    Node::new(text!("{} {octet}: mode {shown_mode}", self.named(*item))).by(mode_row()),
                );
            }
        }
        if let Some(drive) = axis.devicenet() {
            let text = text!("{}: {told}, mode {shown_mode}", devicenet::told(axis, row));
            let facts = [heard(What::Report(told), None), heard(What::Mode(generic_mode), None)];
            let mut status = Node::new(text).by(axis.report_row(mapping, word)).by(mode_row()).shows(facts);
            let rows = || axis.status_rows(mapping, word, &[]);
            push_status(&mut status, feedback.status, heard(What::Status(feedback.status), None), rows);
            node.push(status);
            for field in axis.south.feedback.fields() {
                let Some(value) = feedback.get(field.signal) else { continue };
                let (name, raw) = (drive.value(field).0, devicenet::raw(drive, field, row));
                let generic = shown(axis, field.signal, value);
                let text = text!("{name}: {raw} -> {} {generic}", field.signal);
                let fact =
                    heard(What::Signal(field.signal, Some(value)), Some(Raw::of_field(axis, field, row)));
                node.push(Node::new(text).by(axis.signal_row(mapping, field.signal)).shows([fact]));
            }
        }
        for (field, item) in axis.south.feedback_fields() {
            let Some(value) = feedback.get(field.signal) else { continue };
            let text = text!(
                "{}: {} -> {} {}",
                self.named(item),
                raw(axis, field, row),
                field.signal,
                shown(axis, field.signal, value)
            );
            let fact = heard(What::Signal(field.signal, Some(value)), Some(Raw::of_field(axis, field, row)));
            node.push(Node::new(text).by(axis.signal_row(mapping, field.signal)).shows([fact]));
        }
        if row.len() < needed {
            node.push(Node::new(text!(
                "expected {needed} bytes, got {}: the rest is that of the simulated drive",
                row.len()
            )));
        }
        push_notices(&mut node, said, number, axis);
        node.push(self.update_of(number)?);
        Ok(node)
    }

    /// What the controller sees of it.
    fn update_of(&mut self, number: usize) -> Result<Node, TranslateError> {
        let stage = std::sync::Arc::clone(&self.stage);
        let (axis, mapping) = (&stage.axes[number], &stage.mapping);
        let state = self.bench()?.engine().axes()[number].state();
        let ended = self.fault_ended(number);
        let Some(block) = self.block_of(number) else {
            return Ok(Node::new("the device sends no update"));
        };
        let mut bytes = [0; BLOCK_MAX];
        let mut writer = Writer::new(&mut bytes);
        // There is room for all that a block may have.
        let _ = block.emit(&mut writer);
        let len = writer.written();
        let mut node = Node::new(text!(
            "D-to-C cyclic block of instance {}, {len} bytes: {}",
            axis.instance,
            hex(&bytes[..len])
        ))
        .about(number);
        let report =
            |what, raw| Fact { axis: number, direction: Way::ToController, recorded: false, what, raw };
        let raw = Raw::new(
            &[block.axis_state.0],
            Some(block.axis_state.0.into()),
            Some(AXIS_STATE_AT),
            Carrier::Block,
        );
        node.push(
            Node::new(text!("Axis State {} from drive state {state}", block.axis_state))
                .by(axis.state_row(mapping, state))
                .shows([
                    report(What::State(state), None),
                    report(What::AxisState(block.axis_state), Some(raw)),
                ])
                .shows(ended),
        );
        let values: Vec<_> = of_actual(&block, &axis.scaling).collect();
        push_values(&mut node, &block, |signal| {
            let found = values.iter().find(|(known, ..)| *known == signal);
            let fact = found.map(|(_, value, raw)| report(What::Signal(signal, Some(*value)), Some(*raw)));
            (axis.cyclic_row(mapping, signal), fact)
        });
        Ok(node)
    }

    /// That the gateway sees no fault of an axis any more, once after each time that it saw one.
    pub(super) fn fault_ended(&mut self, number: usize) -> Option<Fact> {
        let has_fault = self.bench().ok()?.engine().axes()[number].fault().is_some();
        let had_fault = std::mem::replace(&mut self.states[number].has_fault, has_fault);
        (had_fault && !has_fault).then_some(Fact {
            axis: number,
            direction: Way::ToController,
            recorded: false,
            what: What::Fault(None),
            raw: None,
        })
    }

    /// The cyclic block of an axis in the newest update of its device.
    pub(super) fn block_of(&mut self, number: usize) -> Option<ActualBlock> {
        let instance = self.stage.axes[number].instance;
        let update = self.bench().ok()?.actual(number);
        if let Ok(fixed) = FixedActual::parse(&update) {
            return Some(fixed.block());
        }
        let frame = ActualFrame::parse(&update).ok()?;
        frame.instances().find(|known| known.number == instance)?.cyclic
    }
}

/// What a drive reports beside its state: a line below the one of its state, which has the value itself if that is nothing.
fn push_status(node: &mut Node, status: StatusBits, fact: Fact, rows: impl FnOnce() -> Vec<Origin>) {
    if status.is_empty() {
        node.facts.push(fact);
        return;
    }
    let text = text!("status: {}", flags(status.iter_names()));
    node.push(Node::new(text).by(rows()).shows([fact]));
}

/// Actual values and status words of a block.
fn push_values(node: &mut Node, block: &ActualBlock, of: impl Fn(Signal) -> (Option<Row>, Option<Fact>)) {
    let actual = &block.actual;
    let position = actual.position.map(|position| match position {
        ActualPosition::Dint(value) => value.to_string(),
        ActualPosition::Lint(value) => value.to_string(),
    });
    let values = [
        ("Actual Position", position, Signal::PositionActual),
        ("Actual Velocity", actual.velocity.map(|value| value.to_string()), Signal::VelocityActual),
        (
            "Actual Acceleration",
            actual.acceleration.map(|value| value.to_string()),
            Signal::AccelerationActual,
        ),
    ];
    for (element, value, signal) in values {
        let Some(value) = value else { continue };
        let (row, fact) = of(signal);
        node.push(Node::new(text!("{element} {value}")).by(row).shows(fact));
    }
    if let Some((status, _)) = block.status.axis_status {
        let text = text!("Axis Status {:#010x}: {}", status.bits(), flags(status.iter_names()));
        node.push(Node::new(text));
    }
    if let Some((status, _)) = block.status.io_status {
        let text = text!("Axis I/O Status {:#010x}: {}", status.bits(), flags(status.iter_names()));
        node.push(Node::new(text));
    }
}
