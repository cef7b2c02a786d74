//! The services that every object with one instance has in common: reading and writing attributes.

use arrayvec::ArrayVec;

use crate::device::motion_link::ObjectPath;
use crate::wire::attributes::{AttributeIds, AttributeStatus};
use crate::wire::message_router::{EXTENDED_STATUS_MAX, Reply};
use crate::wire::status::length_status;
use crate::wire::status::{ConnectionStatus, GeneralStatus, Service};
use crate::wire::{Error, Reader, Writer};

/// Answer of an object to a service.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Answer {
    pub status: GeneralStatus,
    pub extended: ArrayVec<u16, EXTENDED_STATUS_MAX>,
    pub data: Vec<u8>,
}

impl Answer {
    pub fn done(data: Vec<u8>) -> Self {
        Self { data, ..Self::default() }
    }

    pub fn status(status: GeneralStatus) -> Self {
        Self { status, ..Self::default() }
    }

    pub fn connection(extended: ConnectionStatus, data: Vec<u8>) -> Self {
        Self { status: GeneralStatus::CONNECTION_FAILURE, extended: ArrayVec::from_iter([extended.0]), data }
    }

    /// The reply to `service` as bytes, at most `limit` of them: a longer one turns into "reply data too
    /// large".
    pub fn into_reply(self, service: Service, limit: usize) -> Vec<u8> {
        let reply = Reply { service, status: self.status, extended: self.extended.clone(), data: &self.data };
        let mut bytes = vec![0; reply.buffer_len()];
        let fits = bytes.len() <= limit && reply.emit(&mut bytes).is_ok();
        if fits { bytes } else { vec![service.0 | 0x80, 0, GeneralStatus::REPLY_DATA_TOO_LARGE.0, 0] }
    }
}

impl From<Result<Vec<u8>, GeneralStatus>> for Answer {
    fn from(result: Result<Vec<u8>, GeneralStatus>) -> Self {
        match result {
            Ok(data) => Self::done(data),
            Err(status) => Self::status(status),
        }
    }
}

/// General status for malformed service data.
pub(crate) fn data_status(error: Error) -> GeneralStatus {
    length_status(&error).unwrap_or(GeneralStatus::INVALID_PARAMETER)
}

/// An object with one instance.
pub(crate) trait Object {
    /// Revision of the class (class attribute 1).
    const REVISION: u16;
    /// Number of the instance (class attribute 2).
    const INSTANCE: u16 = 1;
    /// Attributes of the instance in the order of Get_Attributes_All; empty without that service.
    const ALL: &'static [u16];
    /// Class attributes in the order of Get_Attributes_All; empty without that service.
    const CLASS_ALL: &'static [u16] = &[];
    /// Highest attribute number of the class (class attribute 6).
    const CLASS_ATTRIBUTE_MAX: u16 = 7;
    /// Highest attribute number of the instance (class attribute 7).
    const ATTRIBUTE_MAX: u16;

    /// Appends the value of an attribute.
    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus>;

    /// Appends the value of a class attribute beyond the common ones.
    fn class_get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        let _ = (attribute, out);
        Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)
    }

    /// Appends what Get_Attributes_All has in the place of an attribute that is not there.
    fn absent(&self, attribute: u16, out: &mut Vec<u8>) {
        let _ = (attribute, out);
    }

    /// Length in bytes of an attribute that may be written.
    fn settable_len(&self, attribute: u16) -> Result<usize, GeneralStatus> {
        self.get(attribute, &mut Vec::new())?;
        Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE)
    }

    /// Takes the value of an attribute, [`Object::settable_len`] bytes of it. Only called for attributes that
    /// may be written.
    fn set(&mut self, attribute: u16, value: &[u8]) -> Result<(), GeneralStatus> {
        let _ = (attribute, value);
        Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE)
    }
}

/// Runs one of the common attribute services; replies beyond `limit` bytes are refused while they grow.
pub(crate) fn serve<T: Object>(
    object: &mut T,
    service: Service,
    path: &ObjectPath,
    data: &[u8],
    limit: usize,
) -> Answer {
    if path.instance != 0 && path.instance != u32::from(T::INSTANCE) {
        return Answer::status(GeneralStatus::PATH_DESTINATION_UNKNOWN);
    }
    if path.member.is_some() || path.connection_point.is_some() {
        return Answer::status(GeneralStatus::PATH_SEGMENT_ERROR);
    }
    let of_class = path.instance == 0;
    match service {
        Service::GET_ATTRIBUTES_ALL => all(object, of_class, data).into(),
        Service::GET_ATTRIBUTE_SINGLE => single(object, path, data).into(),
        Service::GET_ATTRIBUTE_LIST => list(object, of_class, data, limit),
        Service::SET_ATTRIBUTE_SINGLE => set_single(object, path, data).into(),
        Service::SET_ATTRIBUTE_LIST => set_list(object, of_class, data, limit),
        _ => Answer::status(GeneralStatus::SERVICE_NOT_SUPPORTED),
    }
}

fn get<T: Object>(
    object: &T,
    of_class: bool,
    attribute: u16,
    out: &mut Vec<u8>,
) -> Result<(), GeneralStatus> {
    if !of_class {
        return object.get(attribute, out);
    }
    let value: u16 = match attribute {
        1 => T::REVISION,
        2 => T::INSTANCE,
        // Number of instances.
        3 => 1,
        6 => T::CLASS_ATTRIBUTE_MAX,
        7 => T::ATTRIBUTE_MAX,
        _ => return object.class_get(attribute, out),
    };
    out.extend(value.to_le_bytes());
    Ok(())
}

pub(super) fn all<T: Object>(object: &T, of_class: bool, data: &[u8]) -> Result<Vec<u8>, GeneralStatus> {
    let attributes = if of_class { T::CLASS_ALL } else { T::ALL };
    if attributes.is_empty() {
        return Err(GeneralStatus::SERVICE_NOT_SUPPORTED);
    }
    if !data.is_empty() {
        return Err(GeneralStatus::TOO_MUCH_DATA);
    }
    let mut out = Vec::new();
    for attribute in attributes {
        let before = out.len();
        if get(object, of_class, *attribute, &mut out).is_err() {
            out.truncate(before);
            object.absent(*attribute, &mut out);
        }
    }
    Ok(out)
}

fn single<T: Object>(object: &T, path: &ObjectPath, data: &[u8]) -> Result<Vec<u8>, GeneralStatus> {
    let attribute = path.attribute.ok_or(GeneralStatus::PATH_SEGMENT_ERROR)?;
    if !data.is_empty() {
        return Err(GeneralStatus::TOO_MUCH_DATA);
    }
    let mut out = Vec::new();
    get(object, path.instance == 0, attribute, &mut out)?;
    Ok(out)
}

fn list<T: Object>(object: &T, of_class: bool, data: &[u8], limit: usize) -> Answer {
    let ids = match AttributeIds::parse(data) {
        Ok(ids) => ids,
        Err(error) => return Answer::status(data_status(error)),
    };
    let mut answer = Answer::done(data[..2].to_vec());
    for attribute in ids.iter() {
        let mut value = Vec::new();
        let status = get(object, of_class, attribute, &mut value).err().unwrap_or(GeneralStatus::SUCCESS);
        push_row(&mut answer, attribute, status);
        if status == GeneralStatus::SUCCESS {
            answer.data.extend(value);
        }
        if answer.data.len() > limit {
            return Answer::status(GeneralStatus::REPLY_DATA_TOO_LARGE);
        }
    }
    answer
}

fn push_row(answer: &mut Answer, attribute: u16, status: GeneralStatus) {
    let mut row = [0; 4];
    let row_value = AttributeStatus { attribute, status: u16::from(status.0) };
    if row_value.write(&mut Writer::new(&mut row)).is_ok() {
        answer.data.extend(row);
    }
    if status != GeneralStatus::SUCCESS {
        answer.status = GeneralStatus::ATTRIBUTE_LIST_ERROR;
    }
}

fn set_single<T: Object>(object: &mut T, path: &ObjectPath, data: &[u8]) -> Result<Vec<u8>, GeneralStatus> {
    let attribute = path.attribute.ok_or(GeneralStatus::PATH_SEGMENT_ERROR)?;
    if path.instance == 0 {
        get(object, true, attribute, &mut Vec::new())?;
        return Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE);
    }
    // Too much data must not have changed anything, so the length is known before the value is taken.
    let mut r = Reader::new(data);
    let value = r.take("attribute value", object.settable_len(attribute)?).map_err(data_status)?;
    r.finish("attribute value").map_err(data_status)?;
    object.set(attribute, value)?;
    Ok(Vec::new())
}

/// Values have no length of their own, so the first attribute that cannot be written ends the list: the reply
/// has the rows up to it.
fn set_list<T: Object>(object: &mut T, of_class: bool, data: &[u8], limit: usize) -> Answer {
    let mut r = Reader::new(data);
    let count = match r.u16("attribute count") {
        Ok(count) => count,
        Err(error) => return Answer::status(data_status(error)),
    };
    let mut answer = Answer::done(vec![0, 0]);
    let mut rows: u16 = 0;
    while rows < count {
        let Ok(attribute) = r.u16("attribute") else {
            answer.status = GeneralStatus::NOT_ENOUGH_DATA;
            break;
        };
        let outcome = if of_class {
            get(object, true, attribute, &mut Vec::new()).and(Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE))
        } else {
            object.settable_len(attribute).and_then(|length| {
                let value = r.take("attribute value", length).map_err(data_status)?;
                object.set(attribute, value)
            })
        };
        push_row(&mut answer, attribute, outcome.err().unwrap_or(GeneralStatus::SUCCESS));
        rows += 1;
        if outcome.is_err() || answer.data.len() > limit {
            break;
        }
    }
    if rows == count && answer.status == GeneralStatus::SUCCESS && !r.is_empty() {
        answer.status = GeneralStatus::TOO_MUCH_DATA;
    }
    answer.data[..2].copy_from_slice(&rows.to_le_bytes());
    answer
}
