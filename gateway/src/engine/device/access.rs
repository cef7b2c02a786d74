//! Attributes that live in the drive, or in its process image: the controller's accesses to them.

use arrayvec::ArrayVec;
use profile_cip::device::attribute_worker::{AccessOperation, AttributeAccess};
use profile_cip::device::motion_device::MotionDevice;
use profile_cip::wire::status::GeneralStatus;
use profile_generic::parameter::Parameter;
use profile_generic::state::Report;
use profile_generic::time::MonotonicTime;

use super::cyclic_values::CyclicValues;
use super::encoder;
use super::originals::Originals;
use super::refusal::refusal;
use super::scaling::signal_octets;
use super::stopping_torque::{self, Comparison};
use crate::engine::access::{Access, Operation};
use crate::engine::axis::{AxisChannel, Owner};
use crate::engine::bus::{Answer, Buses, Purpose};
use crate::engine::direct::DirectFailure;
use crate::engine::notice::{Notice, axis_number};
use crate::engine::parameter::{Next, ParameterFailure, ParameterJob, ParameterJobs};
use crate::engine::sharing::{Rescaling, is_rescaling, sharing};
use crate::mapping::{
    self, AttributeEntry, AttributeTable, Backing, CipTables, Item, Mapping, MechanicalFact, Number,
    ParameterEntry, ParameterPlace, SequenceAttributes,
};

/// Writes to the drive that may be under way for one axis.
const WRITES_MAX: usize = 8;

/// The accesses of one axis that wait for its drive.
#[derive(Debug, Default)]
pub(super) struct Accesses {
    /// What is being written to the drive, and read back.
    writes: ArrayVec<Write, WRITES_MAX>,
    /// A Stopping Torque that is being compared with the drive's torque limits.
    comparison: Option<Comparison>,
    /// Values that are being compared with those of the drive: ticket and bytes.
    confirmations: ArrayVec<(u32, ArrayVec<u8, 8>), WRITES_MAX>,
    /// Values that are computed from what the drive has, and signals that are in no telegram.
    computed: ParameterJobs<Computed>,
    /// What the drive had before a controller changed it.
    originals: Originals,
    /// The programs of the axis at the last look.
    programs: u64,
    /// A write to what decides what the values of the drive mean.
    pub rescaling: Rescaling,
    /// What the computed values of cyclic lists need.
    pub cyclic: CyclicValues,
}

/// How far a write is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum WriteStage {
    /// The drive was asked to take it.
    Written,
    /// The drive has taken it, and is to be asked what it has now.
    Taken,
    /// It was asked.
    ReadBack,
}

/// A value that is being written to the drive: a drive may take one and keep another.
#[derive(Debug)]
struct Write {
    ticket: u32,
    attribute: u16,
    /// The value, as the controller has set it.
    bytes: ArrayVec<u8, 8>,
    /// The same, as the drive was sent it.
    raw: ArrayVec<u8, 8>,
    item: Item,
    /// The drive lets it be read.
    is_readable: bool,
    /// Attribute of the sequences: what the drive has taken is kept in the device as well, because the gateway goes by it.
    is_kept: bool,
    stage: WriteStage,
}

/// An access to a computed value.
#[derive(Debug, Clone, Copy)]
struct Computed {
    ticket: u32,
    attribute: u16,
    write: bool,
}

/// The axis whose attributes are accessed.
pub(super) struct Accessed<'a> {
    pub device: &'a mut MotionDevice,
    /// Number of the device in the gateway.
    pub number: u8,
    /// Place of the axis in the device.
    pub place: usize,
    /// Number of the axis in the engine.
    pub axis_number: usize,
    pub attributes: &'a AttributeTable,
    pub axis: &'a AxisChannel,
    /// All axes of the gateway.
    pub axes: &'a [AxisChannel],
}

impl Accesses {
    /// Begins an access; an error is its answer.
    pub fn begin(
        &mut self,
        on: &mut Accessed<'_>,
        access: &AttributeAccess,
        buses: &mut Buses,
        mapping: &Mapping,
        notice: &mut dyn FnMut(Notice),
    ) -> Result<(), GeneralStatus> {
        let entry = *on.attributes.get(access.id).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)?;
        let (parameter, missing) = match entry.backing {
            Backing::Signal { signal, otherwise: Some(parameter), .. }
                if on.axis.signal(signal).is_none() =>
            {
                return self.compute(access, &entry, parameter);
            }
            Backing::Signal { .. } => return on.read_signal(access),
            Backing::Parameter { parameter, missing, .. } => (parameter, missing),
            Backing::Mechanics(fact) => return on.compare_mechanics(access, &entry, fact, notice),
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        };
        let program = on.axis.south().ok_or(GeneralStatus::DEVICE_STATE_CONFLICT)?;
        if mapping.dictionaries.generic.computation(parameter).is_some() && program.datum(parameter).is_none()
        {
            return self.compute(access, &entry, parameter);
        }
        let held = match program.place(parameter, missing) {
            ParameterPlace::Drive(held) => held,
            ParameterPlace::Configuration(value) => return on.compare_datum(access, &entry, value, notice),
            ParameterPlace::Zero => return on.compare_zero(access, &entry, notice),
            ParameterPlace::Gateway | ParameterPlace::Stored => {
                if let AccessOperation::Write(bytes) = &access.operation
                    && stopping_torque::is_stopping_torque(&entry)
                {
                    return self.compare(on, access, bytes, &entry, buses);
                }
                return on.keep(access);
            }
            ParameterPlace::Absent => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        };
        if held.to_drive.is_none() && entry.access != mapping::Access::Get {
            match (&access.operation, parameter.is_of_vendor()) {
                // The drive lets the parameter only be read: it can be set to what the drive has.
                (AccessOperation::Write(bytes), false) => {
                    return self.begin_confirmation(on, access, bytes, held, buses);
                }
                (AccessOperation::Write(_), true) => return Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE),
                (AccessOperation::Read(_), _) => {}
            }
        }
        let (request, write) = match &access.operation {
            AccessOperation::Read(_) => (Access::read(held.item), None),
            // It is not heard, and would take back what it had over this.
            AccessOperation::Write(_) if self.is_returning() => {
                return Err(GeneralStatus::DEVICE_STATE_CONFLICT);
            }
            AccessOperation::Write(bytes) => {
                let request = on.write(&entry, bytes, parameter, held)?;
                let write = self.begin_write(access, (bytes, &request), held, &mapping.cip.sequence)?;
                (request, Some(write))
            }
        };
        if is_rescaling(&request) && on.is_held(buses) {
            return Err(GeneralStatus::DEVICE_STATE_CONFLICT);
        }
        let (number, purpose) = (on.axis_number, on.original(false));
        self.follow_program(on.axis);
        if !self.originals.ask_before(&request, |before| buses.access(number, before, purpose)) {
            return Err(on.unasked());
        }
        on.ask(access, &request, write.is_some(), buses)?;
        self.rescaling.asked(&request);
        self.writes.extend(write);
        Ok(())
    }

    /// What is remembered of a write, if there is room for it.
    fn begin_write(
        &self,
        access: &AttributeAccess,
        (bytes, request): (&[u8], &Access),
        held: &ParameterEntry,
        sequence: &SequenceAttributes,
    ) -> Result<Write, GeneralStatus> {
        if self.writes.is_full() {
            return Err(GeneralStatus::RESOURCE_UNAVAILABLE);
        }
        let Operation::Write(raw) = &request.operation else {
            return Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE);
        };
        let too_much = |_| GeneralStatus::TOO_MUCH_DATA;
        Ok(Write {
            ticket: access.ticket,
            attribute: access.id,
            bytes: ArrayVec::try_from(bytes).map_err(too_much)?,
            raw: ArrayVec::try_from(raw.as_slice()).map_err(too_much)?,
            item: held.item,
            is_readable: held.from_drive.is_some(),
            is_kept: is_of_sequence(access.id, sequence),
            stage: WriteStage::Written,
        })
    }

    /// Asks the drive for a value that it lets only be read, to compare it with what the controller sets.
    fn begin_confirmation(
        &mut self,
        on: &mut Accessed<'_>,
        access: &AttributeAccess,
        bytes: &[u8],
        held: &ParameterEntry,
        buses: &mut Buses,
    ) -> Result<(), GeneralStatus> {
        if self.confirmations.is_full() {
            return Err(GeneralStatus::RESOURCE_UNAVAILABLE);
        }
        let bytes = ArrayVec::try_from(bytes).map_err(|_| GeneralStatus::TOO_MUCH_DATA)?;
        on.ask(access, &Access::read(held.item), true, buses)?;
        self.confirmations.push((access.ticket, bytes));
        Ok(())
    }

    /// Begins an access to a computed value.
    fn compute(
        &mut self,
        access: &AttributeAccess,
        entry: &AttributeEntry,
        parameter: Parameter,
    ) -> Result<(), GeneralStatus> {
        let wanted = match &access.operation {
            AccessOperation::Read(_) => None,
            // As for a value that is not computed.
            AccessOperation::Write(_) if self.is_returning() => {
                return Err(GeneralStatus::DEVICE_STATE_CONFLICT);
            }
            AccessOperation::Write(bytes) => {
                Some(entry.to_generic(bytes).map_err(|_| GeneralStatus::INVALID_ATTRIBUTE_VALUE)?)
            }
        };
        let what = Computed { ticket: access.ticket, attribute: access.id, write: wanted.is_some() };
        match self.computed.push(what, ParameterJob::new(parameter, wanted)) {
            true => Ok(()),
            false => Err(GeneralStatus::RESOURCE_UNAVAILABLE),
        }
    }

    /// Asks the drive for what computed values need next, and answers the controller with those that are known.
    pub fn advance(
        &mut self,
        now: MonotonicTime,
        on: &mut Accessed<'_>,
        buses: &mut Buses,
        mapping: &Mapping,
    ) {
        self.read_back(on, buses);
        let Accessed { number, axis_number, place, attributes, axis, .. } = *on;
        self.give_back(on, buses);
        let purpose = Purpose::Setting(on.number);
        self.cyclic.advance(now, on.axis, |request| buses.access(axis_number, request, purpose));
        let (original, is_held) = (on.original(false), on.is_held(buses));
        let (device, tables) = (&mut *on.device, &mapping.cip);
        let Self { originals, rescaling, computed, .. } = self;
        computed.advance(
            |what, job| {
                let request = match job.next(mapping, axis, axis.may_have_torque()) {
                    Next::Wait => return None,
                    Next::Done(result) => return Some(result),
                    Next::Ask(request) if is_held && is_rescaling(&request) => {
                        return Some(Err(ParameterFailure::Torque));
                    }
                    // One such write at a time, so that each counts.
                    Next::Ask(request) if rescaling.is_busy() && is_rescaling(&request) => return None,
                    Next::Ask(request) => request,
                };
                let Computed { ticket, attribute, write } = *what;
                let ask = |before: &Access| buses.access(axis_number, before, original);
                let purpose = Purpose::Attribute { ticket, device: number, attribute, write };
                if !originals.ask_before(&request, ask) || !buses.access(axis_number, &request, purpose) {
                    return Some(Err(ParameterFailure::Busy));
                }
                rescaling.asked(&request);
                job.sent();
                None
            },
            |what, result| {
                let mut bytes = [0; 8];
                let answer = match result.map_err(GeneralStatus::from) {
                    Ok(_) if what.write => Ok(0),
                    Ok(value) => {
                        let reading = Reading { tables, device, place, axis };
                        reading.shown(attributes.get(what.attribute), value, &mut bytes)
                    }
                    Err(status) => Err(status),
                };
                device.complete_attribute(what.ticket, answer.map(|len| &bytes[..len]));
            },
        );
    }

    /// A connection was opened: what the last one has changed in the drive goes back.
    pub fn opened(&mut self) {
        self.originals.give_back();
        self.cyclic.start_over();
    }

    /// Whether the drive still takes back what it had.
    pub fn is_returning(&self) -> bool {
        self.originals.is_returning()
    }

    /// The value of an item is what the drive has by itself: somebody else has set it.
    pub fn set_by_others(&mut self, item: Item) {
        self.originals.forget(item);
    }

    /// A drive with another program was commissioned anew, and may be another one. One that is not heard for a moment has what it had.
    fn follow_program(&mut self, axis: &AxisChannel) {
        let programs = axis.programs();
        if std::mem::replace(&mut self.programs, programs) != programs {
            self.originals.forget_all();
        }
    }

    fn give_back(&mut self, on: &Accessed<'_>, buses: &mut Buses) {
        self.follow_program(on.axis);
        if !on.is_gone() && !on.axis.may_have_torque() {
            let (number, purpose) = (on.axis_number, on.original(true));
            self.originals.advance(|request| buses.access(number, request, purpose));
        }
    }

    /// Takes the drive's answer to what it had, or takes back.
    pub fn original_answered(&mut self, answer: &Answer, write: bool, notice: &mut dyn FnMut(Notice)) {
        let result = answer.data();
        match (write, result) {
            (false, result) => self.originals.read(answer.item, result),
            (true, result) => {
                self.originals.written();
                if let Err(failure) = result {
                    let axis = axis_number(answer.axis);
                    notice(Notice::NotReturned { axis, item: answer.item, failure });
                }
            }
        }
    }

    /// Compares a Stopping Torque with the drive's torque limits. A comparison in progress is overtaken, or its drive was lost.
    fn compare(
        &mut self,
        on: &mut Accessed<'_>,
        access: &AttributeAccess,
        bytes: &[u8],
        entry: &AttributeEntry,
        buses: &mut Buses,
    ) -> Result<(), GeneralStatus> {
        if let Some(before) = self.comparison.take() {
            on.device.complete_attribute(before.ticket, Err(GeneralStatus::DEVICE_STATE_CONFLICT));
        }
        let number = (on.number, on.axis_number);
        self.comparison = Some(Comparison::begin(access, bytes, entry, number, on.axis, buses)?);
        Ok(())
    }

    /// Asks the drive for what it has made of the values that it has taken.
    fn read_back(&mut self, on: &mut Accessed<'_>, buses: &mut Buses) {
        for write in self.writes.iter_mut().filter(|write| write.stage == WriteStage::Taken) {
            let (ticket, attribute) = (write.ticket, write.attribute);
            let purpose = Purpose::Attribute { ticket, device: on.number, attribute, write: false };
            if buses.access(on.axis_number, &Access::read(write.item), purpose) {
                write.stage = WriteStage::ReadBack;
            }
        }
        if on.is_gone() {
            let device = &mut *on.device;
            self.writes.retain(|write| {
                let waits = write.stage == WriteStage::Taken;
                if waits {
                    device.complete_attribute(write.ticket, Err(GeneralStatus::DEVICE_STATE_CONFLICT));
                }
                !waits
            });
        }
    }

    /// Takes the drive's answer to a write, or to the question what it has made of it.
    fn write_answered(
        &mut self,
        on: &mut Accessed<'_>,
        answer: &Answer,
        at: usize,
        tables: &CipTables,
        notice: &mut dyn FnMut(Notice),
    ) {
        if let Some(write) = self.writes.get_mut(at)
            && write.stage == WriteStage::Written
            && write.is_readable
            && answer.result.is_ok()
        {
            write.stage = WriteStage::Taken;
            return;
        }
        let write = self.writes.remove(at);
        let outcome = match (&answer.result, write.stage) {
            (Err(failure), _) => {
                if let Some(said) = answer.said {
                    notice(on.refused(&write, said));
                }
                Err(refusal(*failure))
            }
            (Ok((data, _)), WriteStage::ReadBack) if data.as_slice() != write.raw.as_slice() => {
                on.kept(&write, data, tables, notice)
            }
            (Ok(_), _) => Ok(()),
        };
        if outcome.is_ok() && write.is_kept {
            // It was checked against the type of the attribute when it was encoded.
            let _ = on.device.put_attribute(on.place, write.attribute, &write.bytes);
        }
        on.device.complete_attribute(write.ticket, outcome.map(|()| &[][..]));
    }

    /// Takes the drive's answer to an access, and answers the controller.
    pub fn answer(
        &mut self,
        on: &mut Accessed<'_>,
        answer: &Answer,
        (ticket, attribute, write): (u32, u16, bool),
        tables: &CipTables,
        notice: &mut dyn FnMut(Notice),
    ) {
        self.rescaling.answered(answer);
        if write && answer.result.is_ok() {
            self.cyclic.written(answer.item, on.axis);
        }
        if let Some(at) = self.writes.iter().position(|write| write.ticket == ticket) {
            return self.write_answered(on, answer, at, tables, notice);
        }
        if let Some(comparison) = self.comparison.as_mut().filter(|comparison| comparison.ticket == ticket) {
            if let Some(verdict) = comparison.take(answer, on.axis) {
                let (id, value) = (comparison.attribute, comparison.bytes.clone());
                self.comparison = None;
                let kept = verdict.and_then(|()| on.device.put_attribute(on.place, id, &value));
                on.device.complete_attribute(ticket, kept.map(|()| &[][..]));
            }
            return;
        }
        if self.computed.take(|what| what.ticket == ticket, answer, on.axis) {
            return;
        }
        let mut bytes = [0; 8];
        let confirmation = self.confirmations.iter().position(|(of, _)| *of == ticket);
        let wanted = confirmation.map(|at| self.confirmations.remove(at).1);
        let result = match (&answer.result, &wanted) {
            (Err(failure), _) => Err(refusal(*failure)),
            (Ok((data, _)), Some(wanted)) => on.confirm(attribute, wanted, (data, tables), notice),
            (Ok(_), None) if write => Ok(0),
            (Ok((data, _)), None) => on.read(attribute, data, tables, &mut bytes),
        };
        on.device.complete_attribute(ticket, result.map(|len| &bytes[..len]));
    }
}

impl Accessed<'_> {
    fn read_signal(&mut self, access: &AttributeAccess) -> Result<(), GeneralStatus> {
        let mut bytes = [0; 8];
        let view = self.device.position_view(self.place);
        let len = view
            .and_then(|view| signal_octets(self.attributes, self.axis, &view, access.id, &mut bytes))
            .ok_or(GeneralStatus::DEVICE_STATE_CONFLICT)?;
        self.device.complete_attribute(access.ticket, Ok(&bytes[..len]));
        Ok(())
    }

    /// Hands a request to the drive.
    fn ask(
        &self,
        access: &AttributeAccess,
        request: &Access,
        write: bool,
        buses: &mut Buses,
    ) -> Result<(), GeneralStatus> {
        let (ticket, attribute) = (access.ticket, access.id);
        let purpose = Purpose::Attribute { ticket, device: self.number, attribute, write };
        if buses.access(self.axis_number, request, purpose) { Ok(()) } else { Err(self.unasked()) }
    }

    /// The purpose of an access to what the drive has by itself.
    fn original(&self, write: bool) -> Purpose {
        Purpose::Original { device: self.number, write }
    }

    /// Whether an axis of the drive may have torque, or is another one's.
    fn is_held(&self, buses: &Buses) -> bool {
        sharing(self.axis_number, self.axes, buses)
            .any(|(_, axis)| axis.may_have_torque() || axis.owner() == Owner::Local)
    }

    fn is_gone(&self) -> bool {
        self.axis.feedback().report == Report::Silent
    }

    /// Why the drive was not asked.
    fn unasked(&self) -> GeneralStatus {
        if self.is_gone() {
            GeneralStatus::DEVICE_STATE_CONFLICT
        } else {
            GeneralStatus::RESOURCE_UNAVAILABLE
        }
    }

    /// Whether the drive has the value that the controller would set.
    fn confirm(
        &self,
        attribute: u16,
        wanted: &[u8],
        (data, tables): (&[u8], &CipTables),
        notice: &mut dyn FnMut(Notice),
    ) -> Result<usize, GeneralStatus> {
        let mut bytes = [0; 8];
        let len = self.read(attribute, data, tables, &mut bytes)?;
        let entry = self.attributes.get(attribute).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)?;
        let held = bytes.get(..len).unwrap_or(&[]);
        if entry.agree(wanted, held) {
            return Ok(0);
        }
        Err(self.not_equal(attribute, (entry.number(wanted), entry.number(held)), false, notice))
    }

    /// What the drive says of a value that it does not take.
    fn refused(&self, write: &Write, said: DirectFailure) -> Notice {
        let axis = axis_number(self.axis_number);
        let wanted = self.attributes.get(write.attribute).and_then(|entry| entry.number(&write.bytes));
        let (attribute, item, is_taken) = (write.attribute, write.item, write.stage == WriteStage::ReadBack);
        Notice::DriveRefuses { axis, attribute, wanted, item, is_taken, said }
    }

    /// Whether the drive has kept a value, in whole steps of its unit.
    fn kept(
        &self,
        write: &Write,
        data: &[u8],
        tables: &CipTables,
        notice: &mut dyn FnMut(Notice),
    ) -> Result<(), GeneralStatus> {
        let attribute = write.attribute;
        let mut bytes = [0; 8];
        let len = self.read(attribute, data, tables, &mut bytes)?;
        let entry = self.attributes.get(attribute).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)?;
        let held = bytes.get(..len).unwrap_or_default();
        if entry.agree(&write.bytes, held) {
            return Ok(());
        }
        let axis = axis_number(self.axis_number);
        let (wanted, held) = (entry.number(&write.bytes), entry.number(held));
        notice(Notice::NotKept { axis, attribute, wanted, held });
        Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE)
    }

    /// The answer to a value that is not the one that the drive holds, or the configuration if it is `configured`; both go into the log.
    fn not_equal(
        &self,
        attribute: u16,
        (wanted, held): (Option<Number>, Option<Number>),
        configured: bool,
        notice: &mut dyn FnMut(Notice),
    ) -> GeneralStatus {
        let axis = axis_number(self.axis_number);
        notice(Notice::NotEqual { axis, attribute, wanted, held, configured });
        GeneralStatus::INVALID_ATTRIBUTE_VALUE
    }

    /// A term that the loops of the drive do not have: it is 0.
    fn compare_zero(
        &mut self,
        access: &AttributeAccess,
        entry: &AttributeEntry,
        notice: &mut dyn FnMut(Notice),
    ) -> Result<(), GeneralStatus> {
        if let AccessOperation::Write(bytes) = &access.operation {
            let wanted = entry.number(bytes);
            let is_zero = matches!(wanted, Some(Number::Integer(0)))
                || matches!(wanted, Some(Number::Real(value)) if value == 0.0);
            if !is_zero {
                return Err(self.not_equal(access.id, (wanted, Some(Number::Integer(0))), false, notice));
            }
        }
        self.keep(access)
    }

    /// What the configuration has of motor or power stage.
    fn compare_datum(
        &mut self,
        access: &AttributeAccess,
        entry: &AttributeEntry,
        value: i64,
        notice: &mut dyn FnMut(Notice),
    ) -> Result<(), GeneralStatus> {
        let mut bytes = [0; 8];
        let len = shown(Some(entry), value, &mut bytes)?;
        let held = bytes.get(..len).unwrap_or_default();
        match &access.operation {
            AccessOperation::Read(_) => self.device.complete_attribute(access.ticket, Ok(held)),
            AccessOperation::Write(wanted) if entry.agree(wanted, held) => {
                self.device.complete_attribute(access.ticket, Ok(&[]));
            }
            AccessOperation::Write(wanted) => {
                let values = (entry.number(wanted), entry.number(held));
                return Err(self.not_equal(access.id, values, true, notice));
            }
        }
        Ok(())
    }

    /// What the scaling of the drive comes to. What the controller has set is shown again as long as it is so.
    fn compare_mechanics(
        &mut self,
        access: &AttributeAccess,
        entry: &AttributeEntry,
        fact: MechanicalFact,
        notice: &mut dyn FnMut(Notice),
    ) -> Result<(), GeneralStatus> {
        let program = self.axis.south().ok_or(GeneralStatus::DEVICE_STATE_CONFLICT)?;
        let (mechanics, value) = program.mechanical(fact).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)?;
        let agrees = |bytes: &[u8]| entry.number(bytes).is_some_and(|number| mechanics.agrees(fact, number));
        match &access.operation {
            AccessOperation::Write(bytes) if agrees(bytes) => self.keep(access),
            AccessOperation::Write(bytes) => {
                Err(self.not_equal(access.id, (entry.number(bytes), Some(value)), false, notice))
            }
            AccessOperation::Read(_) if self.device.attribute(self.place, access.id).is_ok_and(agrees) => {
                self.keep(access)
            }
            AccessOperation::Read(_) => {
                let mut bytes = [0; 8];
                let len =
                    entry.write_number(value, &mut bytes).ok_or(GeneralStatus::DEVICE_STATE_CONFLICT)?;
                self.device.complete_attribute(access.ticket, Ok(&bytes[..len]));
                Ok(())
            }
        }
    }

    /// A parameter that the drive lacks: kept and given back.
    fn keep(&mut self, access: &AttributeAccess) -> Result<(), GeneralStatus> {
        match &access.operation {
            AccessOperation::Read(_) => {
                let mut bytes = [0; 8];
                let held = self.device.attribute(self.place, access.id)?;
                let len = held.len().min(bytes.len());
                bytes[..len].copy_from_slice(&held[..len]);
                self.device.complete_attribute(access.ticket, Ok(&bytes[..len]));
            }
            AccessOperation::Write(bytes) => {
                self.device.put_attribute(self.place, access.id, bytes)?;
                self.device.complete_attribute(access.ticket, Ok(&[]));
            }
        }
        Ok(())
    }

    /// The request that writes an attribute to the drive.
    fn write(
        &self,
        entry: &AttributeEntry,
        bytes: &[u8],
        parameter: Parameter,
        held: &ParameterEntry,
    ) -> Result<Access, GeneralStatus> {
        let generic = entry.to_generic(bytes).map_err(|_| GeneralStatus::INVALID_ATTRIBUTE_VALUE)?;
        let kept = |id| generic_of(self.attributes, self.device, self.place, id);
        if stopping_torque::exceeds(parameter, generic, self.attributes, kept, self.axis) {
            return Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE);
        }
        let (raw, len, clamped) = held.encode(generic).ok_or(GeneralStatus::ATTRIBUTE_NOT_SETTABLE)?;
        let raw = raw.get(..len).unwrap_or(&[]);
        // The end of a drive's range read as a REAL may be rounded beyond it; what was read can be set again.
        let is_as_read = || {
            let mut again = [0; 8];
            let len = held.decode(raw).and_then(|generic| shown(Some(entry), generic, &mut again).ok());
            len.is_some_and(|len| again.get(..len) == Some(bytes))
        };
        // One count of the drive may be more than a time: written as 0 it would be none.
        let vanishes = entry.is_reciprocal() && generic != 0 && raw.iter().all(|octet| *octet == 0);
        if clamped && !is_as_read() || vanishes {
            return Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE);
        }
        Access::write(held.item, raw).ok_or(GeneralStatus::TOO_MUCH_DATA)
    }

    /// What the drive has answered to a read, as the attribute; its length.
    fn read(
        &self,
        attribute: u16,
        data: &[u8],
        tables: &CipTables,
        bytes: &mut [u8; 8],
    ) -> Result<usize, GeneralStatus> {
        let entry = self.attributes.get(attribute);
        let generic = held(self.attributes, self.axis, attribute).and_then(|held| held.decode(data));
        let reading = Reading { tables, device: &*self.device, place: self.place, axis: self.axis };
        reading.shown(entry, generic.ok_or(GeneralStatus::DEVICE_STATE_CONFLICT)?, bytes)
    }
}

/// What a value that is read is shown by.
struct Reading<'a> {
    tables: &'a CipTables,
    device: &'a MotionDevice,
    place: usize,
    axis: &'a AxisChannel,
}

impl Reading<'_> {
    /// A generic value as the attribute; its length.
    fn shown(
        &self,
        entry: Option<&AttributeEntry>,
        generic: i64,
        bytes: &mut [u8; 8],
    ) -> Result<usize, GeneralStatus> {
        let Some((entry, unit)) = entry.and_then(|entry| Some((entry, entry.feedback()?))) else {
            return shown(entry, generic, bytes);
        };
        let nanounits = encoder::nanounits(self.tables, unit, (self.device, self.place), self.axis);
        let nanounits = nanounits.ok_or(GeneralStatus::DEVICE_STATE_CONFLICT)?;
        entry.from_encoder(generic, nanounits, bytes).map_err(|_| GeneralStatus::DEVICE_STATE_CONFLICT)
    }
}

/// A generic value as the attribute; its length.
fn shown(entry: Option<&AttributeEntry>, generic: i64, bytes: &mut [u8; 8]) -> Result<usize, GeneralStatus> {
    let entry = entry.ok_or(GeneralStatus::DEVICE_STATE_CONFLICT)?;
    match entry.from_generic(generic, bytes) {
        Ok((len, false)) => Ok(len),
        // The attribute cannot hold what the drive has.
        Ok((_, true)) => Err(GeneralStatus::DEVICE_STATE_CONFLICT),
        Err(_) => Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
    }
}

/// Whether the sequences go by an attribute.
fn is_of_sequence(id: u16, sequence: &SequenceAttributes) -> bool {
    [sequence.zero_speed, sequence.ramp_deceleration, sequence.deceleration_limit].contains(&id)
}

/// The value that the device holds of an attribute, in its generic unit.
pub(super) fn generic_of(
    attributes: &AttributeTable,
    device: &MotionDevice,
    place: usize,
    id: u16,
) -> Option<i64> {
    attributes.get(id)?.to_generic(device.attribute(place, id).ok()?).ok()
}

/// The parameter of the drive that holds an attribute.
pub(super) fn held<'a>(
    attributes: &AttributeTable,
    axis: &'a AxisChannel,
    id: u16,
) -> Option<&'a ParameterEntry> {
    let Backing::Parameter { parameter, .. } = attributes.get(id)?.backing else { return None };
    axis.south()?.parameter(parameter)
}
