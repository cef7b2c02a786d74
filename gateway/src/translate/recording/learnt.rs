//! What a recording says of its drives: scalings that they have reported, and places of their values in the telegrams.
//!
//! Where the configuration leaves the scaling to the drive, that of the recording counts. Where the configuration, or a list of
//! values, says something else than the recording, the axis is not translated, and the difference is named.

use std::collections::{BTreeMap, HashSet};
use std::fmt::Write as _;
use std::sync::Arc;

use profile_cia402::wire::sdo::{SdoRequest, SdoResponse, Transfer};
use profile_cia402::wire::{Function, Mux};
use profile_generic::can::Frame;
use profile_generic::image::Signal;
use profile_generic::program::Conversion;
use profile_sercos::wire::connection::CONNECTION_CONTROL_LEN;
use profile_sercos::wire::describe::DecodeContext;
use profile_sercos::wire::idn::{Idn, connection};

use crate::engine::bus::sercos::{COMMAND_CONNECTION, FEEDBACK_CONNECTION};
use crate::mapping::{Cia402Dictionary, DriveProgram, Item, Object};
use crate::translate::stage::{Behind, RowCache, Stage, StageAxis};
use crate::translate::tree::hex;
use crate::translate::{Mark, Translator};

/// Differences that are named.
const NAMED_MAX: usize = 4;

/// Objects of an axis are so far behind those of the axis before it (CiA 402-2).
const AXIS_STEP: u16 = 0x800;

/// Elements of S-0-1050.x that say where a connection stands and what it carries.
const LAYOUT: [u8; 4] = [connection::SETUP, connection::ASSIGNMENT, connection::LENGTH, connection::LIST];

/// Objects that are kept.
const OBJECTS_MAX: usize = 4096;

/// What was seen of the drives.
#[derive(Debug, Default)]
pub(super) struct Learnt {
    /// By topology address.
    sercos: BTreeMap<(u16, Idn), Vec<u8>>,
    /// By axis.
    can: BTreeMap<(usize, Object), Vec<u8>>,
    /// Something has come since it was applied.
    news: bool,
    /// What was said already.
    said: HashSet<String>,
}

impl Learnt {
    pub fn has_news(&self) -> bool {
        self.news
    }

    /// Takes what the service channels have carried.
    pub fn sercos(&mut self, stage: &Stage, context: &mut DecodeContext<'_>) {
        for transfer in context.take_transfers() {
            let is_asked = stage
                .axes
                .iter()
                .filter_map(StageAxis::sercos)
                .any(|drive| drive.facts.data(transfer.idn).is_some());
            let is_layout =
                transfer.idn.block() == Idn::CONNECTION_BLOCK && LAYOUT.contains(&transfer.idn.element());
            if !is_asked && !is_layout {
                continue;
            }
            let key = (transfer.topology, transfer.idn);
            self.news |= is_layout || self.sercos.get(&key) != Some(&transfer.data);
            self.sercos.insert(key, transfer.data);
        }
    }

    /// Takes a frame of a CANopen bus; whether it is of an SDO transfer.
    pub fn can(&mut self, stage: &Stage, bus: Option<usize>, frame: &Frame) -> bool {
        let (node, mux, transfer) = match Function::of(frame.id()) {
            Some(Function::SdoRequest(node)) => match SdoRequest::parse(frame.data()) {
                Ok(SdoRequest::Download(mux, transfer)) => (node, mux, transfer),
                _ => return true,
            },
            Some(Function::SdoResponse(node)) => match SdoResponse::parse(frame.data()) {
                Ok(SdoResponse::Upload(mux, transfer)) => (node, mux, transfer),
                _ => return true,
            },
            _ => return false,
        };
        let Transfer::Expedited { data, .. } = transfer else { return true };
        let Mux { index, sub } = mux;
        for (number, axis) in stage.axes.iter().enumerate().filter(|(_, axis)| axis.may_be_on(bus)) {
            let Some(drive) = axis.can().filter(|drive| drive.node == node.get()) else { continue };
            // Each axis of a device has objects of its own.
            let object = Object { index: Cia402Dictionary::on_first_axis(index), sub };
            let is_of_axis = index < 0x6000
                || index - Cia402Dictionary::on_first_axis(index)
                    == AXIS_STEP.saturating_mul(drive.needs.axis);
            if !is_of_axis || drive.facts.is_missing(object) || self.can.len() >= OBJECTS_MAX {
                continue;
            }
            let is_new = self.can.get(&(number, object)).map(Vec::as_slice) != Some(&*data);
            self.news |= is_new;
            self.can.insert((number, object), data.to_vec());
        }
        true
    }

    /// Gives the translator what was learnt; what is to be said of it.
    pub fn apply(&mut self, translator: &mut Translator, context: &DecodeContext<'_>) -> Vec<(String, Mark)> {
        self.news = false;
        let stage = Arc::clone(&translator.stage);
        let mut axes = stage.axes.clone();
        let (mut said, mut changed) = (Vec::new(), false);
        translator.unfit.clear();
        for (number, axis) in axes.iter_mut().enumerate() {
            let found = match &axis.behind {
                Behind::Sercos(_) => self.on_sercos(number, axis, translator, context),
                Behind::Can(_) => self.on_can(number, axis, translator),
                Behind::Devicenet(_) => continue,
            };
            let now = match found {
                Ok(true) => {
                    changed = true;
                    Some((format!("the scaling of {} is that of the recording", axis.drive), Mark::Note))
                }
                Ok(false) => None,
                Err(text) => {
                    translator.unfit.insert(number);
                    Some((text, Mark::Error))
                }
            };
            // Each text names the drive, and is said once.
            said.extend(now.filter(|(text, _)| self.said.insert(text.clone())));
            changed |= axis.stands_in != stage.axes[number].stands_in;
        }
        if changed {
            translator.change_stage(Arc::new(stage.with_axes(axes)));
        }
        said
    }

    /// Whether the program of an axis has changed, or why the recording does not fit.
    fn on_sercos(
        &self,
        number: usize,
        axis: &mut StageAxis,
        translator: &mut Translator,
        context: &DecodeContext<'_>,
    ) -> Result<bool, String> {
        let mapping = &translator.stage.mapping;
        let name = axis.drive.clone();
        let Behind::Sercos(drive) = &mut axis.behind else { return Ok(false) };
        let known: Vec<u16> = context.layout().devices.iter().map(|device| device.address).collect();
        let of_address =
            known.iter().copied().find(|topology| context.address(*topology) == Some(drive.address));
        let topology = of_address.unwrap_or(drive.topology);
        let device = context.layout().devices.iter().find(|device| device.address == topology);
        if let Some(device) = device.filter(|device| !device.connections.is_empty()) {
            let telegram = &axis.south.telegram;
            let both = [
                (COMMAND_CONNECTION, &telegram.command, telegram.command_bytes),
                (FEEDBACK_CONNECTION, &telegram.feedback, telegram.feedback_bytes),
            ];
            for (index, items, bytes) in both {
                let listed = context.connection_idns(topology, index);
                let recorded: Vec<Item> = listed.iter().copied().map(Item::Idn).collect();
                if !recorded.is_empty() && recorded != *items {
                    return Err(format!(
                        "{name}: connection {index} carries {} in the recording, and {} with the configuration",
                        list(&recorded),
                        list(items)
                    ));
                }
                let len = device
                    .connections
                    .iter()
                    .find(|place| place.index == index)
                    .map(|place| usize::from(place.len));
                let expected = usize::from(bytes) + CONNECTION_CONTROL_LEN;
                if let Some(len) = len.filter(|len| *len != expected) {
                    return Err(format!(
                        "{name}: connection {index} has {len} bytes in the recording, and {expected} with the configuration"
                    ));
                }
            }
            translator.places[number] = Some(device.clone());
        }
        let mut facts = drive.facts.clone();
        let mut differ = Differences::default();
        let own = self.sercos.range((topology, Idn(0))..=(topology, Idn(u32::MAX)));
        let mut any = false;
        for ((_, idn), data) in own {
            any = true;
            let before = facts.data(*idn);
            if before.is_some_and(|before| before != data.as_slice()) {
                differ.note(idn, data, before);
                facts.note_data(*idn, data);
            }
        }
        if !any {
            return Ok(false);
        }
        let program = mapping.sercos_program(&drive.needs, &facts);
        let program =
            program.map_err(|error| format!("{name}: with what the recording says of it: {error}"))?;
        drive.facts = facts;
        adopt(axis, program, &differ.text)
    }

    fn on_can(&self, number: usize, axis: &mut StageAxis, translator: &Translator) -> Result<bool, String> {
        let name = axis.drive.clone();
        let Behind::Can(drive) = &mut axis.behind else { return Ok(false) };
        let mut facts = drive.facts.clone();
        let mut differ = Differences::default();
        let own = self.can.iter().filter(|((axis, _), _)| *axis == number);
        let mut any = false;
        for ((_, object), data) in own {
            any = true;
            let before = facts.data(*object);
            if before != Some(data.as_slice()) {
                differ.note(object, data, before);
                facts.note_data(*object, data);
            }
        }
        if !any {
            return Ok(false);
        }
        let program = translator.stage.mapping.of_drive(&facts).cia402_program(&drive.needs, &facts);
        let program =
            program.map_err(|error| format!("{name}: with what the recording says of it: {error}"))?;
        drive.facts = facts;
        adopt(axis, program, &differ.text)
    }
}

/// What the recording says and the configuration says differently; the first few are named.
#[derive(Debug, Default)]
struct Differences {
    named: usize,
    text: String,
}

impl Differences {
    fn note(&mut self, what: &dyn std::fmt::Display, data: &[u8], before: Option<&[u8]>) {
        let Some(before) = before.filter(|_| self.named < NAMED_MAX) else { return };
        self.named += 1;
        // Writing to a string does not fail.
        let _ = write!(
            self.text,
            "; {what} is {} in the recording, and {} with the configuration",
            hex(data),
            hex(before)
        );
    }
}

/// Takes the program of what the recording says, where the configuration leaves the scaling to the drive. Whether it is another one.
fn adopt(axis: &mut StageAxis, program: DriveProgram, differ: &str) -> Result<bool, String> {
    let changed = !fits(&axis.south, &program);
    if !axis.stands_in {
        let text = || {
            format!("{}: the scaling of the recording is not that of the configuration{differ}", axis.drive)
        };
        return if changed { Err(text()) } else { Ok(false) };
    }
    (axis.south, axis.rows, axis.stands_in) = (program, RowCache::default(), false);
    Ok(changed)
}

/// Whether two programs convert alike.
fn fits(one: &DriveProgram, other: &DriveProgram) -> bool {
    let conversions = |program: &DriveProgram| -> Vec<(Signal, Conversion)> {
        let fields = program.command.fields().chain(program.feedback.fields());
        fields.map(|field| (field.signal, field.conversion)).collect()
    };
    conversions(one) == conversions(other)
}

fn list(items: &[Item]) -> String {
    items.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_differences_are_named_however_much_else_was_recorded() {
        let mut differences = Differences::default();
        // What was not known before is no difference.
        (0..10).for_each(|sub| differences.note(&sub, &[1], None));
        (0..6).for_each(|sub| differences.note(&sub, &[1], Some(&[2])));
        let expected = (0..4)
            .map(|sub| format!("; {sub} is 01 in the recording, and 02 with the configuration"))
            .collect::<String>();
        assert_eq!(differences.text, expected);
    }
}
