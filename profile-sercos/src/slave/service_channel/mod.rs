//! The slave's end of the service channel: one step a cycle.
//!
//! A step begins when the master's handshake bit MHS differs from the slave's AHS. The slave sets AHS = MHS,
//! shows busy as long as it works, and then has the result or an error code in INFO.
//!
//! An element is read or written in parts of four bytes; only the step with the last part has the end bit.
//! Lists and texts begin with a part of their own, the current and the greatest length.

use super::parameter::{Handle, Parameter, Store};
use crate::wire::data_status::DataStatus;
use crate::wire::header::Phase;
use crate::wire::idn::Idn;
use crate::wire::svc::{AtSvc, Element, LIST_HEAD_LEN, ListHead, MdtSvc, SvcControl, SvcStatus};
use crate::wire::svc_error::SvcError;

/// Bytes in one step.
const PART: usize = 4;

/// What the rest of the slave does for the service channel.
pub trait Host {
    /// The parameters.
    fn store(&mut self) -> &mut Store;
    /// The communication phase, for write protection.
    fn phase(&self) -> Phase;
    /// The data of an opened parameter is going to be read: bring it up to date.
    fn refresh(&mut self, handle: Handle);
    /// Takes over new data of a parameter, or refuses it. Length, limits and write protection are right.
    fn write(&mut self, handle: Handle, data: &[u8]) -> Result<(), SvcError>;
    /// Takes a new control word of a procedure command.
    fn control(&mut self, handle: Handle, word: u16) -> Result<(), SvcError>;
}

/// A transfer that takes several steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Progress {
    element: Element,
    write: bool,
    /// Bytes done, the list head included.
    done: usize,
}

/// The slave end of one service channel.
#[derive(Debug)]
pub struct Server {
    valid: bool,
    ahs: bool,
    error: bool,
    info: u32,
    /// Step that is being worked on, and the cycles it still takes.
    busy: Option<(MdtSvc, u8)>,
    open: Option<Handle>,
    progress: Option<Progress>,
    /// Data of a list being written; its capacity is the longest list's.
    buffer: Vec<u8>,
}

impl Server {
    /// A server for the parameters of `store`, which is complete.
    pub fn new(store: &Store) -> Self {
        let longest = store.iter().map(|parameter| parameter.capacity()).max().unwrap_or(0);
        Server {
            valid: false,
            ahs: false,
            error: false,
            info: 0,
            busy: None,
            open: None,
            progress: None,
            // The last part may be longer than what is left of the list.
            buffer: Vec::with_capacity(longest + LIST_HEAD_LEN + PART),
        }
    }

    /// Back to the state before CP1: not valid, nothing open.
    pub fn reset(&mut self) {
        *self = Server {
            valid: false,
            ahs: false,
            error: false,
            info: 0,
            busy: None,
            open: None,
            progress: None,
            buffer: std::mem::take(&mut self.buffer),
        };
    }

    /// The master is there: from now on the channel is valid.
    pub fn set_valid(&mut self) {
        self.valid = true;
    }

    /// The IDN that is open.
    pub fn open_idn(&self, store: &Store) -> Option<Idn> {
        self.open.map(|handle| store.get(handle).idn())
    }

    /// The slot for the AT.
    pub fn answer(&self) -> AtSvc {
        if !self.valid {
            return AtSvc::default();
        }
        let mut status = SvcStatus::VALID;
        status.set(SvcStatus::AHS, self.ahs);
        status.set(SvcStatus::BUSY, self.busy.is_some());
        status.set(SvcStatus::ERROR, self.error);
        AtSvc { status, info: self.info }
    }

    /// Takes the slot of this cycle's MDT.
    pub fn handle(&mut self, slot: MdtSvc, host: &mut impl Host) {
        if !self.valid {
            return;
        }
        match &mut self.busy {
            Some((step, 0)) => {
                let step = *step;
                self.busy = None;
                self.perform(step, host);
            }
            Some((_, cycles)) => *cycles -= 1,
            None if slot.control.mhs() == self.ahs => {}
            None => {
                self.ahs = slot.control.mhs();
                self.error = false;
                match self.cycles_needed(slot.control, host.store()) {
                    0 => self.perform(slot, host),
                    cycles => self.busy = Some((slot, cycles - 1)),
                }
            }
        }
    }

    fn cycles_needed(&self, control: SvcControl, store: &Store) -> u8 {
        match (self.open, control.element()) {
            (Some(handle), Element::Data) => store.get(handle).busy_cycles(),
            _ => 0,
        }
    }

    fn perform(&mut self, step: MdtSvc, host: &mut impl Host) {
        match self.step(step, host) {
            Ok(info) => self.info = info,
            Err(code) => {
                self.error = true;
                self.info = u32::from(code.0);
                self.progress = None;
            }
        }
    }

    fn step(&mut self, step: MdtSvc, host: &mut impl Host) -> Result<u32, SvcError> {
        let control = step.control;
        let element = control.element();
        match (element, control.write(), control.last()) {
            (Element::Close, write, last) if write == last => {
                self.open = None;
                self.progress = None;
                Ok(0)
            }
            (Element::Close, ..) => Err(SvcError::CLOSE_ACCESS),
            (Element::Idn, true, true) => self.open(Idn(step.info), host),
            (Element::Idn, ..) => Err(SvcError::IDN_ACCESS),
            _ => {
                let handle = self.open.ok_or(SvcError::NOT_OPEN)?;
                let write = control.write();
                let done = match self.progress {
                    Some(progress) if (progress.element, progress.write) == (element, write) => progress.done,
                    _ => 0,
                };
                let (info, finished) = if write {
                    self.write(handle, element, step, done, host)?
                } else {
                    let (info, len) = read(handle, element, done, host)?;
                    let head = done == 0 && has_head(handle, element, host);
                    (info, is_finished(element, done + PART, len, control.last(), head)?)
                };
                self.progress =
                    if finished { None } else { Some(Progress { element, write, done: done + PART }) };
                Ok(info)
            }
        }
    }

    fn open(&mut self, idn: Idn, host: &mut impl Host) -> Result<u32, SvcError> {
        self.progress = None;
        self.open = host.store().find(idn);
        let handle = self.open.ok_or(SvcError::NO_IDN)?;
        let status: DataStatus = host.store().get(handle).status();
        Ok(u32::from(status.bits()))
    }

    /// Takes a part of the operation data. Returns the answer and whether that was the last part.
    fn write(
        &mut self,
        handle: Handle,
        element: Element,
        step: MdtSvc,
        done: usize,
        host: &mut impl Host,
    ) -> Result<(u32, bool), SvcError> {
        if element != Element::Data {
            return Err(SvcError::of_element(element, 4));
        }
        let phase = host.phase();
        let parameter = host.store().get(handle);
        let attribute = parameter.attribute();
        if attribute.is_command() {
            return command(handle, step, host);
        }
        if let Some(error) = parameter.write_protection(phase) {
            return Err(error);
        }
        let capacity = parameter.capacity();
        let head = if attribute.is_list() { LIST_HEAD_LEN } else { 0 };
        if done == 0 {
            self.buffer.clear();
        }
        self.buffer.extend_from_slice(&step.info.to_le_bytes());
        let len = match self.buffer.first_chunk::<PART>() {
            Some(bytes) if head > 0 => usize::from(ListHead::from_info(u32::from_le_bytes(*bytes)).current),
            _ => capacity,
        };
        if len > capacity {
            return Err(SvcError::DATA_LONG);
        }
        let complete = self.buffer.len() >= head + len;
        match (complete, step.control.last()) {
            (false, true) => return Err(SvcError::DATA_SHORT),
            (true, false) if len > 0 => return Err(SvcError::DATA_LONG),
            (false, false) => return Ok((0, false)),
            _ => {}
        }
        let data = &self.buffer[head..head + len];
        host.store().get(handle).check(data)?;
        host.write(handle, data)?;
        Ok((0, true))
    }
}

/// Takes the control word of a procedure command.
fn command(handle: Handle, step: MdtSvc, host: &mut impl Host) -> Result<(u32, bool), SvcError> {
    if !step.control.last() {
        return Err(SvcError::DATA_LONG);
    }
    let [low, high, _, _] = step.info.to_le_bytes();
    host.control(handle, u16::from_le_bytes([low, high]))?;
    Ok((0, true))
}

/// Whether an element comes with a list head.
fn has_head(handle: Handle, element: Element, host: &mut impl Host) -> bool {
    match element {
        Element::Name | Element::Unit => true,
        Element::Data => host.store().get(handle).attribute().is_list(),
        _ => false,
    }
}

/// The bytes of an element, and how many there may be where it is a list. Numbers are put into `number`.
fn content<'a>(
    parameter: &'a Parameter,
    element: Element,
    number: &'a mut [u8; 8],
) -> Result<(&'a [u8], Option<usize>), SvcError> {
    let not_available = SvcError::of_element(element, 1);
    let attribute = parameter.attribute();
    Ok(match element {
        Element::Name => (parameter.name().as_bytes(), Some(parameter.name().len())),
        Element::Unit if parameter.unit().is_empty() => return Err(not_available),
        Element::Unit => (parameter.unit().as_bytes(), Some(parameter.unit().len())),
        Element::Attribute => {
            *number = i64::from(attribute.0).to_le_bytes();
            (&number[..4], None)
        }
        Element::Minimum | Element::Maximum => {
            let value = if element == Element::Minimum { parameter.minimum() } else { parameter.maximum() };
            *number = value.ok_or(not_available)?.to_le_bytes();
            (&number[..usize::from(attribute.item_length().bytes())], None)
        }
        _ if attribute.is_list() => (parameter.data(), Some(parameter.capacity())),
        _ => (parameter.data(), None),
    })
}

/// Reads the part of an element at `done`. Returns it and the length of the whole element, head included.
fn read(
    handle: Handle,
    element: Element,
    done: usize,
    host: &mut impl Host,
) -> Result<(u32, usize), SvcError> {
    if element == Element::Data && done == 0 {
        host.refresh(handle);
    }
    let mut number = [0; 8];
    let (data, capacity) = content(host.store().get(handle), element, &mut number)?;
    let word = |len: usize| u16::try_from(len).unwrap_or(u16::MAX);
    let head = match capacity {
        Some(capacity) if done == 0 => {
            let head = ListHead { current: word(data.len()), max: word(capacity) };
            return Ok((head.to_info(), LIST_HEAD_LEN + data.len()));
        }
        Some(_) => LIST_HEAD_LEN,
        None => 0,
    };
    let rest = data.get(done - head..).unwrap_or(&[]);
    let mut info = [0; PART];
    let len = rest.len().min(PART);
    info[..len].copy_from_slice(&rest[..len]);
    if len == 0 {
        return Err(SvcError::of_element(element, 3));
    }
    Ok((u32::from_le_bytes(info), head + data.len()))
}

/// Judges the end bit of a read: it belongs to the last part. The head of a list may stand alone.
fn is_finished(element: Element, done: usize, len: usize, last: bool, head: bool) -> Result<bool, SvcError> {
    match (done >= len, last) {
        (true, true) => Ok(true),
        (false, false) => Ok(false),
        // The master learns from the head that there is nothing behind it.
        (true, false) if head => Ok(true),
        (true, false) => Err(SvcError::of_element(element, 3)),
        (false, true) => Err(SvcError::of_element(element, 2)),
    }
}

#[cfg(test)]
mod tests;
