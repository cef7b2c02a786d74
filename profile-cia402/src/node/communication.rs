//! Objects of the communication profile, 1000h to 1FFFh, and the rules for changing them.

use profile_generic::can::Id;

use super::Config;
use super::dictionary::{DataType, Definition, Dictionary, Group, Mapping, Object, Shape};
use super::errors::HISTORY_LEN;
use crate::generated::objects;
use crate::wire::cob_id::CobId;
use crate::wire::sync::COUNTER_MAX;
use crate::wire::{AbortCode, Mux};

/// Entries of 1016h.
pub const CONSUMERS: u8 = 4;

/// "save", what 1010h wants to be written.
pub const SAVE: i64 = 0x6576_6173;
/// "load", what 1011h wants to be written.
pub const LOAD: i64 = 0x6461_6F6C;

/// Adds the objects, but for PDOs.
pub(super) fn define(dictionary: &mut Dictionary, config: &Config) {
    use DataType::{U8, U16, U32};
    let new = Definition::new;
    let identity = &config.identity;
    let number = |name, value: u32| Some(new(name, U32, i64::from(value)).constant());
    dictionary
        .variable(objects::DEVICE_TYPE, new("Device type", U32, i64::from(identity.device_type)).constant());
    dictionary
        .variable(objects::ERROR_REGISTER, new("Error register", U8, 0).read_only().mappable(Mapping::Tpdo));
    dictionary.add_object(Object {
        index: objects::PRE_DEFINED_ERROR_FIELD,
        name: "Pre-defined error field",
        shape: Shape::Array,
    });
    dictionary.add(Mux::new(objects::PRE_DEFINED_ERROR_FIELD, 0), new("Number of errors", U8, 0).volatile());
    for sub in 1..=HISTORY_LEN {
        dictionary.add(
            Mux::new(objects::PRE_DEFINED_ERROR_FIELD, sub),
            new("Standard error field", U32, 0).read_only(),
        );
    }
    dictionary.variable(objects::COB_ID_SYNC, new("COB-ID SYNC", U32, 0x80));
    dictionary.variable(objects::COMMUNICATION_CYCLE_PERIOD, new("Communication cycle period", U32, 0));
    dictionary.variable(objects::SYNCHRONOUS_WINDOW_LENGTH, new("Synchronous window length", U32, 0));
    dictionary.variable(
        objects::MANUFACTURER_DEVICE_NAME,
        Definition::text("Manufacturer device name", identity.name),
    );
    dictionary.variable(
        objects::MANUFACTURER_HARDWARE_VERSION,
        Definition::text("Manufacturer hardware version", identity.hardware),
    );
    dictionary.variable(
        objects::MANUFACTURER_SOFTWARE_VERSION,
        Definition::text("Manufacturer software version", identity.software),
    );
    dictionary.variable(objects::GUARD_TIME, new("Guard time", U16, 0));
    dictionary.variable(objects::LIFE_TIME_FACTOR, new("Life time factor", U8, 0));
    let groups = [
        "Save all parameters",
        "Save communication parameters",
        "Save application parameters",
        "Save manufacturer parameters",
    ];
    dictionary.record(
        objects::STORE_PARAMETERS,
        "Store parameters",
        Shape::Array,
        &groups.map(|name| Some(new(name, U32, 1).volatile())),
    );
    let groups = [
        "Restore all default parameters",
        "Restore communication default parameters",
        "Restore application default parameters",
        "Restore manufacturer default parameters",
    ];
    dictionary.record(
        objects::RESTORE_DEFAULT_PARAMETERS,
        "Restore default parameters",
        Shape::Array,
        &groups.map(|name| Some(new(name, U32, 1).volatile())),
    );
    dictionary.variable(objects::COB_ID_TIME, new("COB-ID TIME", U32, 0x8000_0100));
    dictionary.variable(objects::COB_ID_EMCY, new("COB-ID EMCY", U32, 0x80).plus_node());
    dictionary.variable(objects::INHIBIT_TIME_EMCY, new("Inhibit time EMCY", U16, 0));
    let consumer = new("Consumer heartbeat time", U32, 0);
    dictionary.record(
        objects::CONSUMER_HEARTBEAT_TIME,
        "Consumer heartbeat time",
        Shape::Array,
        &[Some(consumer); CONSUMERS as usize],
    );
    dictionary.variable(objects::PRODUCER_HEARTBEAT_TIME, new("Producer heartbeat time", U16, 0));
    let parts = [
        number("Vendor-ID", identity.vendor),
        number("Product code", identity.product),
        number("Revision number", identity.revision),
        number("Serial number", identity.serial),
    ];
    dictionary.record(objects::IDENTITY, "Identity object", Shape::Record, &parts);
    let overflow = new("Synchronous counter overflow value", U8, 0).range(0, i64::from(COUNTER_MAX));
    dictionary.variable(objects::SYNC_OVERFLOW, overflow);
    let verify = [Some(new("Configuration date", U32, 0)), Some(new("Configuration time", U32, 0))];
    dictionary.record(objects::VERIFY_CONFIGURATION, "Verify configuration", Shape::Array, &verify);
    let eds = Definition { is_volatile: true, ..Definition::domain("Store EDS", 0) };
    dictionary.variable(objects::STORE_EDS, eds.constant());
    dictionary.variable(0x1022, new("Store format", U8, 0).constant());
    let behaviour = [Some(new("Communication error", U8, 0).range(0, 2))];
    dictionary.record(objects::ERROR_BEHAVIOR, "Error behaviour", Shape::Array, &behaviour);
    let server = [
        Some(new("COB-ID client to server", U32, 0x600).constant().plus_node()),
        Some(new("COB-ID server to client", U32, 0x580).constant().plus_node()),
    ];
    dictionary.record(objects::SDO_SERVER_PARAMETER, "SDO server parameter", Shape::Record, &server);
}

/// Whether an identifier may be used for a PDO, SYNC, TIME or EMCY: not one of NMT, SDO, error control or LSS.
pub(super) fn is_free(id: Id) -> bool {
    match id {
        Id::Extended(_) => false,
        Id::Standard(id) => {
            !matches!(id, 0..=0x7F | 0x101..=0x180 | 0x581..=0x5FF | 0x601..=0x67F | 0x6E0..=0x6FF | 0x701..=0x7FF)
        }
    }
}

/// Checks the word of SYNC, TIME or EMCY. An identifier in use is changed in two steps: first the frame is made invalid.
fn check_cob_id(new: CobId, old: CobId) -> Result<(), AbortCode> {
    let moves = new.is_valid() && old.is_valid() && !new.names_same(old);
    if moves || !is_free(new.id()) { Err(AbortCode::VALUE) } else { Ok(()) }
}

fn word(number: i64) -> CobId {
    CobId(u32::try_from(number).unwrap_or(u32::MAX))
}

/// Whether a number that fits type and limits may be written to an object of this file.
pub(super) fn check(mux: Mux, number: i64, dictionary: &Dictionary) -> Result<(), AbortCode> {
    let old = || word(dictionary.number(mux.index, mux.sub));
    match (mux.index, mux.sub) {
        // The device produces neither SYNC nor TIME. SYNC and TIME have no bit that makes them invalid.
        (objects::COB_ID_SYNC | objects::COB_ID_TIME, 0) => {
            let new = word(number);
            if new.bit_30() || !is_free(new.id()) { Err(AbortCode::VALUE) } else { Ok(()) }
        }
        (objects::COB_ID_EMCY, 0) => check_cob_id(word(number), old()),
        (objects::PRE_DEFINED_ERROR_FIELD, 0) if number != 0 => Err(AbortCode::VALUE),
        (objects::STORE_PARAMETERS, 1..=4) if number != SAVE => Err(AbortCode::STORE),
        (objects::RESTORE_DEFAULT_PARAMETERS, 1..=4) if number != LOAD => Err(AbortCode::STORE),
        (objects::SYNC_OVERFLOW, 0) if dictionary.number(objects::COMMUNICATION_CYCLE_PERIOD, 0) != 0 => {
            Err(AbortCode::DEVICE_STATE)
        }
        (objects::SYNC_OVERFLOW, 0) if number == 1 => Err(AbortCode::VALUE),
        (objects::CONSUMER_HEARTBEAT_TIME, 1..=CONSUMERS) => check_consumer(mux.sub, number, dictionary),
        _ => Ok(()),
    }
}

/// A node is watched once.
fn check_consumer(sub: u8, number: i64, dictionary: &Dictionary) -> Result<(), AbortCode> {
    let (node, time) = consumer(number);
    if number >> 24 != 0 || time != 0 && node > 127 {
        return Err(AbortCode::VALUE);
    }
    let others = (1..=CONSUMERS).filter(|other| *other != sub);
    let mut others = others.map(|other| consumer(dictionary.number(objects::CONSUMER_HEARTBEAT_TIME, other)));
    let twice = others.any(|(other, watched)| other == node && watched != 0);
    if twice && time != 0 && node != 0 { Err(AbortCode::PARAMETER) } else { Ok(()) }
}

/// Node and time, ms, of an entry of 1016h.
pub(super) fn consumer(number: i64) -> (i64, i64) {
    (number >> 16 & 0xFF, number & 0xFFFF)
}

/// What has to be done once an object of this file is written.
pub(super) fn written(mux: Mux, dictionary: &mut Dictionary) {
    match (mux.index, Group::of(mux.sub)) {
        (objects::PRE_DEFINED_ERROR_FIELD, _) => super::errors::forget(dictionary),
        (objects::STORE_PARAMETERS, Some(group)) => {
            // Reading 1 says: it is stored when asked for.
            dictionary.set(objects::STORE_PARAMETERS, mux.sub, 1);
            dictionary.store(group);
        }
        (objects::RESTORE_DEFAULT_PARAMETERS, Some(group)) => {
            dictionary.set(objects::RESTORE_DEFAULT_PARAMETERS, mux.sub, 1);
            dictionary.restore(group);
        }
        _ => {}
    }
}
