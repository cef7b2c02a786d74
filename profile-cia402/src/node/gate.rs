//! The SDO server's way to the objects.

use super::application::Application;
use super::communication;
use super::consumer::Consumers;
use super::dictionary::{Access, Definition, Dictionary};
use super::pdo::{self, Pdo};
use crate::generated::objects;
use crate::sdo::server::ObjectAccess;
use crate::wire::{AbortCode, Mux};

/// What a client reaches, with what it brings about.
pub(super) struct Gate<'a, A> {
    pub dictionary: &'a mut Dictionary,
    pub application: &'a mut A,
    pub rpdos: &'a mut Vec<Pdo>,
    pub tpdos: &'a mut Vec<Pdo>,
    pub consumers: &'a mut Consumers,
}

impl<A: Application> ObjectAccess for Gate<'_, A> {
    fn read(&mut self, object: Mux, into: &mut [u8]) -> Result<usize, AbortCode> {
        let entry = self.dictionary.entry(self.dictionary.look_up(object)?);
        if entry.definition().access == Access::WriteOnly {
            return Err(AbortCode::WRITE_ONLY);
        }
        if object.index == objects::PRE_DEFINED_ERROR_FIELD
            && i64::from(object.sub) > self.dictionary.number(objects::PRE_DEFINED_ERROR_FIELD, 0)
        {
            return Err(AbortCode::NO_DATA);
        }
        let number = entry.number().to_le_bytes();
        let bytes = match entry.definition().data_type {
            data_type if data_type.is_bytes() => entry.bytes(),
            data_type => &number[..data_type.size()],
        };
        into.get_mut(..bytes.len()).ok_or(AbortCode::OUT_OF_MEMORY)?.copy_from_slice(bytes);
        Ok(bytes.len())
    }

    fn write_begins(&mut self, object: Mux, size: Option<u32>) -> Result<usize, AbortCode> {
        let definition = self.dictionary.entry(self.dictionary.look_up(object)?).definition();
        if !definition.access.writes() {
            return Err(AbortCode::READ_ONLY);
        }
        let size = size.map(|size| usize::try_from(size).unwrap_or(usize::MAX));
        let (least, most) = match definition.data_type {
            data_type if data_type.is_bytes() => (0, definition.bytes.1),
            data_type => (data_type.size(), data_type.size()),
        };
        match size {
            Some(size) if size > most => Err(AbortCode::TOO_LONG),
            Some(size) if size < least => Err(AbortCode::TOO_SHORT),
            _ => Ok(most),
        }
    }

    fn write(&mut self, object: Mux, data: &[u8]) -> Result<(), AbortCode> {
        let handle = self.dictionary.look_up(object)?;
        let definition = self.dictionary.entry(handle).definition();
        if !definition.access.writes() {
            return Err(AbortCode::READ_ONLY);
        }
        if definition.data_type.is_bytes() {
            if data.len() > definition.bytes.1 {
                return Err(AbortCode::TOO_LONG);
            }
            self.dictionary.set_bytes(handle, data);
            return Ok(());
        }
        let is_parameter = !definition.is_volatile;
        let number = number_of(definition, data)?;
        communication::check(object, number, self.dictionary)?;
        pdo::check(object, number, self.dictionary)?;
        self.application.check(object, number, self.dictionary)?;
        let before = self.dictionary.entry(handle).number();
        self.dictionary.set_number(handle, number);
        if is_parameter && number != before && object.index != objects::VERIFY_CONFIGURATION {
            // What 1020h says was configured is no longer so.
            self.dictionary.set(objects::VERIFY_CONFIGURATION, 1, 0);
            self.dictionary.set(objects::VERIFY_CONFIGURATION, 2, 0);
        }
        self.written(object);
        Ok(())
    }
}

impl<A: Application> Gate<'_, A> {
    /// What follows from a number that was written.
    fn written(&mut self, object: Mux) {
        communication::written(object, self.dictionary);
        if object.index == objects::CONSUMER_HEARTBEAT_TIME {
            self.consumers.refresh(self.dictionary);
        }
        let changed = pdo::communication_index(object.index);
        for pdo in self.rpdos.iter_mut().chain(self.tpdos.iter_mut()) {
            if Some(pdo.index) == changed {
                pdo.refresh(self.dictionary);
            }
        }
        self.application.commanded(self.dictionary);
    }
}

/// The number that bytes are, within the limits of its object.
fn number_of(definition: &Definition, data: &[u8]) -> Result<i64, AbortCode> {
    let size = definition.data_type.size();
    let wrong = if data.len() > size { AbortCode::TOO_LONG } else { AbortCode::TOO_SHORT };
    let number = definition.data_type.number(data).ok_or(wrong)?;
    if number > definition.high {
        return Err(AbortCode::TOO_HIGH);
    }
    if number < definition.low {
        return Err(AbortCode::TOO_LOW);
    }
    Ok(number)
}
