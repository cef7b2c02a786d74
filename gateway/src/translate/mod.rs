//! Frames through the box: what it makes of them, and which row of which file made each value.
//!
//! ```text
//! C-to-D update   -> north port -> Engine -> south port -> MDT, RPDOs, poll
//! D-to-C update   <- north port <- Engine <- south port <- AT, TPDOs, answer
//! Set attribute   -> north port -> Engine -> south port -> element 7 of an IDN, object
//! diagnostic word -> south port -> Engine -> faults     -> exceptions
//! ```
//!
//! There is no second implementation: every frame goes through the engine of the box, in virtual time, on a [`bench`]. An update is
//! handed in, the engine runs to the instant for which the update is meant, and the telegram of that instant is shown with the rows
//! of the programs that made it. What the box refuses is refused here, and the lines that begin with `log:` say why, as its log would.
//! Frames that follow one another share the state of the box; `restart` in a list makes it forget.
//!
//! A frame of a list, or of a recording that begins anywhere, has to get through whatever came before. Where that differs from what
//! the box would do on its own, this is decided:
//!
//! - Header, connection and counts of an update are replaced: see [`bench`].
//! - An axis of which no frame has said what its drive shows is enabled before it gets an update, in the Control Mode of the update if
//!   its drive has it, and its faults are reset before. From the first frame of its drive on, the list alone says what the drive does.
//!   A drive that comes with torque as the first thing was enabled by somebody.
//! - Feedback Modes that an axis does not have are replaced by that of the motor, and that is said.
//! - An update with a number that is none raises a node fault, which stops every axis of the device: as in the box.

mod access;
mod bench;
mod can;
mod commanded;
mod devicenet;
mod entry;
pub mod fact;
mod filter;
mod frame;
pub mod golden;
mod line;
mod list;
mod plot;
pub mod record;
mod recording;
mod reported;
mod rows;
pub mod scene;
mod stage;
mod telegram;
mod tree;
mod written;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use profile_cip::wire::motion::codes::{CommandTarget, ControlStatus};
use profile_cip::wire::motion::{ActualBlock, Format};
use profile_generic::image::Signal;
use profile_generic::quantity::{Current, Decimal, Quantity, Temperature, Torque, TorqueAbsolute, Voltage};
use profile_sercos::wire::connection::{CONNECTION_CONTROL_LEN, ConnectionControl};
use profile_sercos::wire::header::{HEADER_LEN, Header, Kind, Phase};
use profile_sercos::wire::layout::DeviceLayout;

use bench::{Bench, Update};
use devicenet::Listener;
pub use entry::{Counts, Entry, Place, Sink};
pub use fact::Direction;
use fact::{Carrier, Fact, Raw, What, of_actual};
pub use filter::Filter;
pub use frame::{FrameError, Recognised, recognise};
pub use line::{Line, LineError};
pub use list::{List, ListError, translate_list, translate_list_to};
pub use plot::Plot;
pub use recording::{Captured, translate_capture};
pub use stage::{
    Behind, CanDrive, CanPart, CanPdo, DevicenetDrive, SercosDrive, Stage, StageAxis, StageError, ValuesError,
};
pub use tree::{Mark, Node, Row, RowNames};

/// Lines of an update of the fixed format that are not about its axis: the update, and the node.
const FIXED_HEAD_LINES: usize = 2;

/// Connection of a drive with its command values, and with its actual values.
use crate::engine::bus::sercos::{COMMAND_CONNECTION, FEEDBACK_CONNECTION};

/// What is kept of an axis from frame to frame, beside the engine.
#[derive(Debug)]
struct AxisState {
    /// What has come of the values of a drive on CANopen, and by which of its TPDOs.
    came: Vec<u8>,
    heard: Vec<u16>,
    /// The poll connection of a drive on DeviceNet.
    listener: Option<Listener>,
    /// Whether the gateway saw a fault of the axis at the last frame.
    has_fault: bool,
}

/// Translates frame after frame.
#[derive(Debug)]
pub struct Translator {
    stage: Arc<Stage>,
    states: Vec<AxisState>,
    /// Attributes of the cyclic write data of axes, in their order.
    writes: BTreeMap<usize, Vec<u16>>,
    device: usize,
    bench: Option<Box<Bench>>,
    /// Where a recording has the values of each axis in its SERCOS telegrams, if it says so.
    places: Vec<Option<DeviceLayout>>,
    /// Axes whose drive in the recording is not that of the configuration.
    unfit: BTreeSet<usize>,
}

impl Drop for Translator {
    fn drop(&mut self) {
        self.bench.take().into_iter().for_each(|bench| self.stage.keep(bench));
    }
}

/// Why something is not translated.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TranslateError {
    /// The bytes are no frame.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// No axis, or no drive, has this name.
    #[error("expected {what}, one of {known}, got `{name}`")]
    Name {
        /// What the name would have to be.
        what: &'static str,
        /// The names that there are.
        known: String,
        /// The name.
        name: String,
    },
    /// Something about a value.
    #[error("{0}")]
    Value(String),
    /// There is no box for the axes.
    #[error("{0}")]
    Stage(String),
}

impl Translator {
    /// A translator for the first device of a configuration.
    #[must_use]
    pub fn new(stage: impl Into<Arc<Stage>>) -> Self {
        let stage = stage.into();
        let (states, places) = (Self::unheard(&stage), vec![None; stage.axes.len()]);
        let (writes, unfit) = (BTreeMap::new(), BTreeSet::new());
        Self { states, stage, writes, device: 0, bench: None, places, unfit }
    }

    /// Axes of which no frame has told anything.
    fn unheard(stage: &Stage) -> Vec<AxisState> {
        let states = stage.axes.iter().map(|axis| AxisState {
            came: vec![0; usize::from(axis.south.telegram.feedback_bytes)],
            heard: Vec::new(),
            listener: axis.devicenet().map(Listener::new),
            has_fault: false,
        });
        states.collect()
    }

    /// Goes on with the programs of another stage of the same box.
    fn change_stage(&mut self, stage: Arc<Stage>) {
        self.bench.take().into_iter().for_each(|bench| self.stage.keep(bench));
        let states = Self::unheard(&stage);
        let before = std::mem::replace(&mut self.states, states);
        // The axes are the same, and a fault that was shown has not ended by this.
        for (state, before) in self.states.iter_mut().zip(before) {
            state.has_fault = before.has_fault;
        }
        self.stage = stage;
    }

    /// The bench on which the frames are.
    fn bench(&mut self) -> Result<&mut Bench, TranslateError> {
        let bench = match self.bench.take() {
            Some(bench) => bench,
            None => self.stage.bench().map_err(|error| TranslateError::Stage(error.to_string()))?,
        };
        Ok(self.bench.insert(bench))
    }

    /// Forgets what the frames before have reported.
    fn restart(&mut self) {
        self.states = Self::unheard(&self.stage);
        self.writes.clear();
        if let Some(bench) = &mut self.bench {
            bench.restart(&self.stage.axes);
        }
    }

    /// Takes updates as those of this device, by its number in the configuration.
    pub fn set_device(&mut self, device: usize) {
        self.device = device;
    }

    /// The commissioned drives that frames are translated for.
    #[must_use]
    pub fn stage(&self) -> &Stage {
        &self.stage
    }

    /// Translates one line of a list of frames.
    ///
    /// # Errors
    /// The bytes are no frame, a name is not known, a value has another length.
    pub fn line(&mut self, line: &Line<'_>) -> Result<Node, TranslateError> {
        match line {
            Line::Frame(bytes) => self.frame(bytes),
            Line::Actual { drive, bytes } => {
                let axis = self.drive(drive)?;
                self.feedback(axis, bytes)
            }
            Line::Held { drive, item, bytes } => {
                let axis = self.drive(drive)?;
                self.held(axis, *item, bytes)
            }
            Line::Can(frame) => self.can(None, frame).unwrap_or_else(|| {
                Err(TranslateError::Value(format!("{}: no PDO and no EMCY of a drive here", frame.id())))
            }),
            // A message has several frames; only the last one tells something.
            Line::Devicenet(frame) => self
                .devicenet(None, frame)
                .unwrap_or_else(|| Ok(Node::new("no whole poll or answer of a drive here"))),
            Line::Restart => {
                self.restart();
                Ok(Node::new("restart"))
            }
            Line::Writes { axis, attributes } => {
                let axis = self.axis(axis)?;
                self.list_writes(axis, attributes)
            }
            Line::Set { axis, attribute, bytes } => {
                let axis = self.axis(axis)?;
                self.set(axis, *attribute, bytes)
            }
        }
    }

    /// Translates a frame, a datagram or an update.
    ///
    /// # Errors
    /// The bytes are none of them.
    pub fn frame(&mut self, bytes: &[u8]) -> Result<Node, TranslateError> {
        Ok(match recognise(bytes)? {
            Recognised::Command(frame, update) => {
                let mut node = Node::new(format!("C-to-D update {}", frame.header().update_id));
                let lines = frame.instances().map(|instance| (instance.number, lines_of(&instance)));
                node.push(self.decoded("as it came", &frame.to_string(), lines));
                if self.format() == Format::Fixed {
                    node.push(Node::new(
                        "the device has the fixed format: an update of the variable one is refused",
                    ));
                    return Ok(node);
                }
                let instances: Vec<_> = frame.instances().collect();
                let blocks: Vec<_> = instances
                    .iter()
                    .filter_map(|instance| Some((instance.number, instance.cyclic?, instance.write)))
                    .collect();
                self.commands(Update::Variable(update), &blocks, &mut node)?;
                for instance in &instances {
                    if instance.cyclic.is_none() {
                        node.push(Node::new(format!("instance {} without cyclic data", instance.number)));
                    }
                    if let Some(service) = &instance.service {
                        node.push(Node::new(format!("service request: {}", service.to_string().trim())));
                    }
                }
                node
            }
            Recognised::FixedCommand(update) => {
                let mut node = Node::new(format!("C-to-D update {} of the fixed format", update.update_id));
                let text = update.to_string();
                node.push(self.decoded("as it came", &text, [(1, lines_of(&text) - FIXED_HEAD_LINES)]));
                // The format has neither Control Status nor Command Control: the device assumes these (clause 6-2.7).
                let block = update.block(ControlStatus::empty(), CommandTarget::default());
                self.commands(Update::Fixed(block, update.node_control), &[(1, block, None)], &mut node)?;
                node
            }
            Recognised::Actual(frame) => {
                let mut facts = Vec::new();
                for instance in frame.instances() {
                    facts.extend(instance.cyclic.map(|block| self.reported(instance.number, &block)));
                }
                let lines = frame.instances().map(|instance| (instance.number, lines_of(&instance)));
                self.decoded("D-to-C update", &frame.to_string(), lines).shows(facts.into_iter().flatten())
            }
            Recognised::FixedActual(update) => {
                let facts = self.reported(1, &update.block());
                let text = update.to_string();
                let lines = [(1, lines_of(&text) - FIXED_HEAD_LINES)];
                self.decoded("D-to-C update of the fixed format", &text, lines).shows(facts)
            }
            Recognised::Sercos(frame) => self.telegram(frame)?,
        })
    }

    /// An update as it was decoded: a head, and behind it so many lines of each instance, which are about its axis.
    fn decoded(&self, title: &str, text: &str, instances: impl IntoIterator<Item = (u8, usize)>) -> Node {
        let of_instances: Vec<_> = instances
            .into_iter()
            .flat_map(|(number, lines)| std::iter::repeat_n(self.axis_of_instance(number), lines))
            .collect();
        let head = lines_of(&text).saturating_sub(of_instances.len());
        let axes = std::iter::repeat_n(None, head).chain(of_instances);
        let mut node = Node::new(title);
        for (line, axis) in text.lines().zip(axes) {
            node.push(Node { axis, ..Node::new(line.trim_end()) });
        }
        node
    }

    /// What the device has told the controller of an axis.
    fn reported(&self, instance: u8, block: &ActualBlock) -> Vec<Fact> {
        let Some(axis) = self.axis_of_instance(instance) else { return Vec::new() };
        let fact = |what, raw| Fact {
            axis,
            direction: Direction::ToController,
            recorded: true,
            what,
            raw: Some(raw),
        };
        let state = block.axis_state.0;
        let raw = Raw::new(&[state], Some(state.into()), Some(reported::AXIS_STATE_AT), Carrier::Block);
        let mut facts = vec![fact(What::AxisState(block.axis_state), raw)];
        let values = of_actual(block, &self.stage.axes[axis].scaling);
        facts.extend(values.map(|(signal, value, raw)| fact(What::Signal(signal, Some(value)), raw)));
        facts
    }

    /// The format of the updates of the device that is spoken to.
    fn format(&self) -> Format {
        self.stage.format(self.device)
    }

    /// Takes a SERCOS telegram apart.
    fn telegram(&mut self, frame: &[u8]) -> Result<Node, TranslateError> {
        let header = Header::parse(frame)
            .map_err(|error| TranslateError::Frame(FrameError::Other(format!("SERCOS III: {error}"))))?;
        let (kind, number, phase) = (header.telegram.kind(), header.telegram.number(), header.phase.phase());
        let mut node = Node::new(format!("SERCOS III {kind}{number} in {phase}"));
        if phase != Phase::CP4 {
            node.push(Node::new("no values of drives before CP4"));
            return Ok(node);
        }
        let data = frame.get(HEADER_LEN..).unwrap_or_default();
        let mut came = Vec::new();
        let wanted = if kind == Kind::At { FEEDBACK_CONNECTION } else { COMMAND_CONNECTION };
        for axis in 0..self.stage.axes.len() {
            let Some(topology) = self.stage.axes[axis].sercos().map(|drive| drive.topology) else { continue };
            let places = self.places[axis]
                .as_ref()
                .or_else(|| self.stage.layout.devices.iter().find(|device| device.address == topology));
            let place = places.and_then(|device| {
                device.connections.iter().find(|place| place.index == wanted && place.at.telegram == number)
            });
            let Some(place) = place else { continue };
            let name = &self.stage.axes[axis].drive;
            if self.unfit.contains(&axis) {
                let text = format!("{name}: not translated, the recording does not fit the configuration");
                node.push(Node::new(text).about(axis).marked(Mark::Error));
                continue;
            }
            let Some(bytes) = data.get(place.at.range(usize::from(place.len))) else {
                let text = format!(
                    "{name}: expected {} bytes at {}, the telegram has {}",
                    place.len,
                    place.at.offset,
                    data.len()
                );
                node.push(Node::new(text).about(axis).marked(Mark::Error));
                continue;
            };
            let (control, values) = bytes.split_at(CONNECTION_CONTROL_LEN.min(bytes.len()));
            let control = control.first_chunk().map_or(0, |word| u16::from_le_bytes(*word));
            if !ConnectionControl::from_bits_retain(control).contains(ConnectionControl::READY) {
                node.push(Node::new(format!("{name}: C-CON {control:#06x}, no values")));
                continue;
            }
            match kind {
                Kind::At => came.push((axis, values)),
                Kind::Mdt => node.push(self.command_values(axis, values)),
            }
        }
        self.telegram_heard(&came)?.into_iter().for_each(|heard| node.push(heard));
        Ok(node)
    }

    /// The axis with this instance in the device that is spoken to.
    fn axis_of_instance(&self, instance: u8) -> Option<usize> {
        let is = |axis: &StageAxis| axis.device == self.device && axis.instance == instance;
        self.stage.axes.iter().position(is)
    }

    fn axis(&self, name: &str) -> Result<usize, TranslateError> {
        let known = || self.stage.axes.iter().map(|axis| axis.name.as_str());
        self.stage.axis(name).ok_or_else(|| unknown("an axis", known(), name))
    }

    fn drive(&self, name: &str) -> Result<usize, TranslateError> {
        let known = || self.stage.axes.iter().map(|axis| axis.drive.as_str());
        self.stage.axis_of_drive(name).ok_or_else(|| unknown("a drive", known(), name))
    }
}

fn unknown<'n>(what: &'static str, known: impl Iterator<Item = &'n str>, name: &str) -> TranslateError {
    let known = known.collect::<Vec<_>>().join(", ");
    TranslateError::Name { what, known, name: name.to_owned() }
}

/// Lines that something has as text.
fn lines_of(shown: &impl ToString) -> usize {
    shown.to_string().lines().count()
}

/// Flags by their names, or that there are none.
fn flags<T>(names: impl Iterator<Item = (&'static str, T)>) -> String {
    let names: Vec<_> = names.map(|(name, _)| name.to_lowercase().replace('_', " ")).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

/// A value of a signal with its unit.
fn shown(axis: &StageAxis, signal: Signal, value: i64) -> String {
    quantity(axis, signal.quantity(), value)
}

/// A value in a quantity with its unit.
fn quantity(axis: &StageAxis, quantity: Quantity, value: i64) -> String {
    match quantity {
        // The generic model counts in units of the axis, whatever they are.
        Quantity::Position | Quantity::Velocity | Quantity::Acceleration => {
            let (unit, decimals) = fact::unit(axis.scaling.kind, quantity);
            Decimal { value, decimals, unit }.to_string()
        }
        Quantity::Torque => Torque(value).to_string(),
        Quantity::TorqueAbsolute => TorqueAbsolute(value).to_string(),
        Quantity::Current => Current(value).to_string(),
        Quantity::Voltage => Voltage(value).to_string(),
        Quantity::Temperature => Temperature(value).to_string(),
        Quantity::None => value.to_string(),
        other => format!("{value} {}", other.unit()),
    }
}

#[cfg(test)]
mod tests;
