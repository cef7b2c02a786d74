//! Requests to the Motion Device Axis Object, class 42h.

use super::DevicenetSlave;
use super::axis_table::{class_row, row, settable_while_running};
use super::drive::Drive;
use super::motion_drive::{MotionDrive, RUNNING, dint_bytes, real_bytes};
use super::objects::{Answer, GET, GET_LIST, Refusal, Request, SET, SET_LIST};
use super::request::word;
use super::settings::Settings;

/// Reads some attributes with their dimensions.
const GET_AXIS_LIST: u8 = 0x4B;
/// Writes some attributes with their dimensions.
const SET_AXIS_LIST: u8 = 0x4C;
/// The class.
const CLASS: u16 = 0x42;

fn count_bytes(count: usize) -> [u8; 2] {
    u16::try_from(count).unwrap_or(u16::MAX).to_le_bytes()
}

/// Rounds up to whole 32-bit words.
fn padded(length: usize) -> usize {
    length.next_multiple_of(4)
}

impl MotionDrive {
    /// The size of one element and of the whole attribute.
    fn sizes(settings: &Settings, instance: u16, attribute: u16) -> Option<(usize, usize)> {
        let found = if instance == 0 { class_row(attribute) } else { row(attribute) };
        let missing = instance != 0 && settings.missing_axis_attributes.contains(&attribute);
        found.filter(|_| !missing).map(|row| (row.size, row.size * row.count))
    }

    fn read(&self, settings: &Settings, instance: u16, attribute: u16) -> Answer {
        let (_, length) = Self::sizes(settings, instance, attribute).ok_or(Refusal::NO_ATTRIBUTE)?;
        let stored = |values: &std::collections::BTreeMap<u16, Vec<u8>>| {
            values.get(&attribute).cloned().unwrap_or_else(|| vec![0; length])
        };
        let [kind, code, sub, action] = self.fault_record();
        if instance == 0 {
            return Ok(match attribute {
                1 => vec![4, 0],
                2 | 3 => settings.axes.to_le_bytes().to_vec(),
                14 => vec![self.node_control],
                15 => vec![self.node_status()],
                16 => vec![self.node_fault],
                _ => stored(&self.class_values),
            });
        }
        Ok(match attribute {
            40 => vec![self.mode],
            42 => vec![self.feedback_mode],
            434 | 1402 => dint_bytes(self.position).to_vec(),
            430 | 432 => dint_bytes(self.command_position).to_vec(),
            436 => real_bytes(self.command_position - self.position).to_vec(),
            454 | 1403 => real_bytes(self.velocity).to_vec(),
            483 | 1404 => real_bytes(self.acceleration).to_vec(),
            490 | 492..=494 => real_bytes(self.torque).to_vec(),
            650 => vec![self.state],
            651 => self.status().to_le_bytes().to_vec(),
            655 | 657 => self.faults().to_le_bytes().to_vec(),
            661 => vec![code],
            662 => vec![kind],
            666 => vec![sub],
            668 => vec![action],
            _ => stored(&self.values),
        })
    }

    /// Whether the attribute can be set now to data of this length.
    fn writable(
        &self,
        settings: &Settings,
        instance: u16,
        attribute: u16,
        length: Option<usize>,
    ) -> Result<(), Refusal> {
        let (_, whole) = Self::sizes(settings, instance, attribute).ok_or(Refusal::NO_ATTRIBUTE)?;
        let found = if instance == 0 { class_row(attribute) } else { row(attribute) };
        if !found.is_some_and(|row| row.settable) {
            return Err(Refusal::READ_ONLY);
        }
        let locked = instance != 0 && settings.locked_while_running && self.state == RUNNING;
        if locked && !settable_while_running(attribute) {
            return Err(Refusal::STATE);
        }
        match length {
            Some(length) if length < whole => Err(Refusal::SHORT),
            Some(length) if length > whole => Err(Refusal::LONG),
            _ => Ok(()),
        }
    }

    fn write(&mut self, instance: u16, attribute: u16, data: &[u8]) -> Result<(), Refusal> {
        let first = data.first().copied().unwrap_or(0);
        if instance == 0 {
            self.class_values.insert(attribute, data.to_vec());
            return Ok(());
        }
        let highest = match attribute {
            40 => 4,
            41 => 2,
            610 => 4,
            _ => u8::MAX,
        };
        if first > highest {
            return Err(Refusal::BAD_VALUE);
        }
        match attribute {
            40 => self.mode = first,
            42 => self.feedback_mode = first,
            89 => self.configured |= first & 1 != 0,
            _ => {}
        }
        self.values.insert(attribute, data.to_vec());
        Ok(())
    }
}

impl DevicenetSlave {
    fn axis(&mut self) -> Result<&mut MotionDrive, Refusal> {
        match &mut self.drive {
            Drive::Motion(drive) => Ok(drive),
            Drive::Speed(_) => Err(Refusal::NO_OBJECT),
        }
    }

    fn axis_get(&mut self, instance: u16, attribute: u16) -> Answer {
        let settings = &self.settings;
        match &self.drive {
            Drive::Motion(drive) => drive.read(settings, instance, attribute),
            Drive::Speed(_) => Err(Refusal::NO_OBJECT),
        }
    }

    fn axis_check(&mut self, instance: u16, attribute: u16, length: Option<usize>) -> Result<(), Refusal> {
        if let Some(refusal) = self.chosen_refusal(CLASS, attribute) {
            return Err(refusal);
        }
        match &self.drive {
            Drive::Motion(drive) => drive.writable(&self.settings, instance, attribute, length),
            Drive::Speed(_) => Err(Refusal::NO_OBJECT),
        }
    }

    fn axis_set(&mut self, instance: u16, attribute: u16, data: &[u8]) -> Result<(), Refusal> {
        self.axis_check(instance, attribute, Some(data.len()))?;
        self.axis()?.write(instance, attribute, data)?;
        self.note_set(CLASS, instance, attribute, data);
        Ok(())
    }

    /// Requests to class 42h.
    pub(super) fn axis_object(&mut self, request: &Request) -> Answer {
        let instance = request.instance;
        if instance > 1 {
            return Err(Refusal::NO_OBJECT);
        }
        match (request.service, request.attribute) {
            (GET, Some(attribute)) => self.axis_get(instance, attribute),
            (SET, Some(attribute)) => self.axis_set(instance, attribute, &request.data).map(|()| Vec::new()),
            (GET | SET, None) => Err(Refusal::SHORT),
            (GET_LIST, _) => self.get_list(instance, &request.data),
            (SET_LIST, _) => self.set_list(instance, &request.data),
            (GET_AXIS_LIST, _) if instance == 1 => self.get_axis_list(&request.data),
            (SET_AXIS_LIST, _) if instance == 1 => self.set_axis_list(&request.data),
            _ => Err(Refusal::NO_SERVICE),
        }
    }

    fn list_answer(&mut self, service: u8, instance: u16, bad: &[(u16, Refusal)], answer: Vec<u8>) -> Answer {
        if !bad.is_empty() && self.settings.list_error_as_error {
            return Err(Refusal::LIST);
        }
        for &(attribute, refusal) in bad {
            self.note_refused(service, CLASS, instance, Some(attribute), refusal);
        }
        Ok(answer)
    }

    fn get_list(&mut self, instance: u16, data: &[u8]) -> Answer {
        let count = usize::from(word(data, 0).ok_or(Refusal::SHORT)?);
        Refusal::length(data, 2 + 2 * count)?;
        let mut answer = count_bytes(count).to_vec();
        let mut bad = Vec::new();
        for at in 0..count {
            let attribute = word(data, 2 + 2 * at).ok_or(Refusal::SHORT)?;
            answer.extend(attribute.to_le_bytes());
            match self.axis_get(instance, attribute) {
                Ok(value) => {
                    answer.extend([0, 0]);
                    answer.extend(value);
                }
                Err(refusal) => {
                    answer.extend([refusal.general, 0]);
                    bad.push((attribute, refusal));
                }
            }
        }
        self.list_answer(GET_LIST, instance, &bad, answer)
    }

    fn set_list(&mut self, instance: u16, data: &[u8]) -> Answer {
        let count = usize::from(word(data, 0).ok_or(Refusal::SHORT)?);
        let mut answer = count_bytes(count).to_vec();
        let mut bad = Vec::new();
        let mut at = 2;
        for _ in 0..count {
            let attribute = word(data, at).ok_or(Refusal::SHORT)?;
            answer.extend(attribute.to_le_bytes());
            // Without the size of an unknown attribute, what follows cannot be read.
            let Some((_, length)) = MotionDrive::sizes(&self.settings, instance, attribute) else {
                answer.extend([Refusal::NO_ATTRIBUTE.general, 0]);
                bad.push((attribute, Refusal::NO_ATTRIBUTE));
                break;
            };
            let value = data.get(at + 2..at + 2 + length).ok_or(Refusal::SHORT)?;
            at += 2 + length;
            let state = self.axis_set(instance, attribute, value);
            answer.extend([state.err().map_or(0, |refusal| refusal.general), 0]);
            bad.extend(state.err().map(|refusal| (attribute, refusal)));
        }
        self.list_answer(SET_LIST, instance, &bad, answer)
    }

    /// Reads the number, the dimension, the element size and the part of one attribute of an axis list.
    fn list_head(data: &[u8], at: &mut usize) -> Result<(u16, u8, usize, usize, usize), Refusal> {
        let attribute = word(data, *at).ok_or(Refusal::SHORT)?;
        let dimension = *data.get(*at + 2).ok_or(Refusal::SHORT)?;
        let size = usize::from(*data.get(*at + 3).ok_or(Refusal::SHORT)?);
        *at += 4;
        let (mut start, mut elements) = (0, 1);
        if dimension > 1 {
            return Err(Refusal::BAD_VALUE);
        }
        if dimension == 1 {
            start = usize::from(word(data, *at).ok_or(Refusal::SHORT)?);
            elements = usize::from(word(data, *at + 2).ok_or(Refusal::SHORT)?);
            *at += 4;
        }
        Ok((attribute, dimension, size, start, elements))
    }

    fn get_axis_list(&mut self, data: &[u8]) -> Answer {
        let count = usize::from(word(data, 0).ok_or(Refusal::SHORT)?);
        let mut answer = count_bytes(count).to_vec();
        answer.extend([0, 0]);
        let mut bad = Vec::new();
        let mut at = 4;
        for _ in 0..count {
            let (attribute, dimension, _, start, elements) = Self::list_head(data, &mut at)?;
            answer.extend(attribute.to_le_bytes());
            let sizes = MotionDrive::sizes(&self.settings, 1, attribute).ok_or(Refusal::NO_ATTRIBUTE);
            let part = sizes.and_then(|(size, _)| {
                let whole = self.axis_get(1, attribute)?;
                let end = if dimension == 0 { whole.len() } else { (start + elements) * size };
                let part = whole.get(start * size..end).ok_or(Refusal::BAD_VALUE)?;
                Ok((size, part.to_vec()))
            });
            match part {
                Ok((size, mut part)) => {
                    answer.extend([dimension, u8::try_from(size).unwrap_or(0)]);
                    if dimension == 1 {
                        answer.extend(count_bytes(start));
                        answer.extend(count_bytes(elements));
                    }
                    part.resize(padded(part.len()), 0);
                    answer.extend(part);
                }
                Err(refusal) => {
                    answer.extend([0xFF, refusal.general]);
                    bad.push((attribute, refusal));
                }
            }
        }
        self.list_answer(GET_AXIS_LIST, 1, &bad, answer)
    }

    fn set_axis_list(&mut self, data: &[u8]) -> Answer {
        let count = usize::from(word(data, 0).ok_or(Refusal::SHORT)?);
        let mut answer = count_bytes(count).to_vec();
        answer.extend([0, 0]);
        let mut bad = Vec::new();
        let mut at = 4;
        for _ in 0..count {
            let (attribute, dimension, size, start, elements) = Self::list_head(data, &mut at)?;
            let length = size * elements;
            let value = data.get(at..at + length).ok_or(Refusal::SHORT)?;
            at += padded(length);
            let state = self.set_part(attribute, dimension, start, size, value);
            answer.extend(attribute.to_le_bytes());
            answer.extend([state.err().map_or(0, |refusal| refusal.general), 0]);
            bad.extend(state.err().map(|refusal| (attribute, refusal)));
        }
        self.list_answer(SET_AXIS_LIST, 1, &bad, answer)
    }

    fn set_part(
        &mut self,
        attribute: u16,
        dimension: u8,
        start: usize,
        size: usize,
        value: &[u8],
    ) -> Result<(), Refusal> {
        let (own_size, _) = MotionDrive::sizes(&self.settings, 1, attribute).ok_or(Refusal::NO_ATTRIBUTE)?;
        if own_size != size {
            return Err(if size < own_size { Refusal::SHORT } else { Refusal::LONG });
        }
        if dimension == 0 {
            return self.axis_set(1, attribute, value);
        }
        self.axis_check(1, attribute, None)?;
        let mut whole = self.axis_get(1, attribute)?;
        let place = whole.get_mut(start * size..start * size + value.len()).ok_or(Refusal::BAD_VALUE)?;
        place.copy_from_slice(value);
        self.axis_set(1, attribute, &whole)
    }
}
