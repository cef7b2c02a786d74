//! Direct accesses to attributes of any object of a drive: the request, and what the answer says.

use profile_cip::devicenet::master::event::{ExplicitRequest, Outcome};
use profile_cip::wire::status::{GeneralStatus, Service};

use crate::engine::direct::DirectFailure;
use crate::mapping::devicenet::motion;

/// Longest value that is written, bytes: what is left of a message.
const VALUE_MAX: usize = 64;

/// An attribute, and whether it is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DirectAccess {
    /// Class code.
    pub class: u16,
    /// Instance number.
    pub instance: u16,
    /// Number of the attribute.
    pub attribute: u16,
    /// Whether it is written.
    pub write: bool,
}

impl DirectAccess {
    /// Whether the attribute is accessed by a list: those of the Motion Device Axis Object, and those beyond a byte.
    fn by_list(self) -> bool {
        self.class == motion::CLASS || self.attribute > 0xFF
    }

    /// The request; `None` when the value is longer than a message can be.
    #[must_use]
    pub fn request(self, value: &[u8]) -> Option<ExplicitRequest> {
        let Self { class, instance, attribute, write } = self;
        let single = u8::try_from(attribute).ok().filter(|_| !self.by_list());
        match (single, write) {
            (Some(id), false) => Some(ExplicitRequest::get(class, instance, id)),
            (Some(id), true) => ExplicitRequest::set(class, instance, id, value),
            (None, write) => {
                let mut data = [0; 4 + VALUE_MAX];
                data[0] = 1;
                data[2..4].copy_from_slice(&attribute.to_le_bytes());
                let value = if write { value } else { &[] };
                data.get_mut(4..4 + value.len())?.copy_from_slice(value);
                let service = if write { Service::SET_ATTRIBUTE_LIST } else { Service::GET_ATTRIBUTE_LIST };
                ExplicitRequest::new(service, class, instance, &data[..4 + value.len()])
            }
        }
    }

    /// What the answer says. What was read is put into `buffer`, as far as its capacity goes.
    ///
    /// # Errors
    /// The drive refuses, does not answer, or answers something else.
    pub fn result(self, outcome: &Outcome, buffer: &mut Vec<u8>) -> Result<(), DirectFailure> {
        let data: &[u8] = match outcome {
            Outcome::Done(data) => data,
            Outcome::Refused { status, .. } => return Err(DirectFailure::Cip(*status)),
            Outcome::NoAnswer | Outcome::NotTaken(_) | Outcome::Malformed(_) | Outcome::Lost => {
                return Err(DirectFailure::Unanswered);
            }
        };
        let value = if self.by_list() {
            // Count, then number and status of the attribute, then its value.
            let Some(([1, 0, a, b, status, _], value)) = data.split_first_chunk() else {
                return Err(DirectFailure::Unanswered);
            };
            if u16::from_le_bytes([*a, *b]) != self.attribute {
                return Err(DirectFailure::Unanswered);
            }
            match GeneralStatus(*status) {
                GeneralStatus::SUCCESS => value,
                status => return Err(DirectFailure::Cip(status)),
            }
        } else {
            data
        };
        if !self.write {
            buffer.clear();
            if value.len() > buffer.capacity() {
                return Err(DirectFailure::TooLong(buffer.capacity()));
            }
            buffer.extend_from_slice(value);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAME: DirectAccess = DirectAccess { class: 1, instance: 1, attribute: 7, write: false };
    const LIMIT: DirectAccess =
        DirectAccess { class: motion::CLASS, instance: 1, attribute: 504, write: false };

    fn done(bytes: &[u8]) -> Outcome {
        Outcome::Done(bytes.iter().copied().collect())
    }

    #[test]
    fn an_attribute_is_accessed_alone_or_by_a_list() {
        let request = NAME.request(&[]).unwrap();
        assert_eq!((request.service, &request.data[..]), (Service::GET_ATTRIBUTE_SINGLE, &[7][..]));
        let request = DirectAccess { write: true, ..NAME }.request(&[5, 6]).unwrap();
        assert_eq!((request.service, &request.data[..]), (Service::SET_ATTRIBUTE_SINGLE, &[7, 5, 6][..]));
        let request = LIMIT.request(&[9]).unwrap();
        assert_eq!((request.service, &request.data[..]), (Service::GET_ATTRIBUTE_LIST, &[1, 0, 0xF8, 1][..]));
        let written = DirectAccess { write: true, ..LIMIT };
        let request = written.request(&[9]).unwrap();
        assert_eq!(
            (request.service, &request.data[..]),
            (Service::SET_ATTRIBUTE_LIST, &[1, 0, 0xF8, 1, 9][..])
        );
        assert_eq!(written.request(&[0; 65]), None, "longer than a message");
    }

    #[test]
    fn answers_bring_the_value_or_the_drives_status() {
        let mut buffer = Vec::with_capacity(8);
        assert_eq!(NAME.result(&done(&[3, b'a', b'b', b'c']), &mut buffer), Ok(()));
        assert_eq!(buffer, [3, b'a', b'b', b'c']);
        assert_eq!(LIMIT.result(&done(&[1, 0, 0xF8, 1, 0, 0, 7, 8]), &mut buffer), Ok(()));
        assert_eq!(buffer, [7, 8]);
        let refused = Err(DirectFailure::Cip(GeneralStatus::ATTRIBUTE_NOT_SETTABLE));
        let written = DirectAccess { write: true, ..LIMIT };
        assert_eq!(written.result(&done(&[1, 0, 0xF8, 1, 0x0E, 0]), &mut buffer), refused);
        let outcome = Outcome::Refused { status: GeneralStatus::ATTRIBUTE_NOT_SETTABLE, additional: 0xFF };
        assert_eq!(NAME.result(&outcome, &mut buffer), refused);
        for bad in [&[1, 0, 0xF9, 1, 0, 0][..], &[2, 0, 0xF8, 1, 0, 0], &[1, 0, 0xF8]] {
            assert_eq!(LIMIT.result(&done(bad), &mut buffer), Err(DirectFailure::Unanswered), "{bad:?}");
        }
        let mut small = Vec::with_capacity(1);
        let long = vec![0; small.capacity() + 1];
        let too_long = Err(DirectFailure::TooLong(small.capacity()));
        assert_eq!(NAME.result(&done(&long), &mut small), too_long);
    }
}
