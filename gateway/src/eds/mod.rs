//! The Electronic Data Sheet of a device: the text by which a controller's tool knows it (CIP Volume 1, chapter 7).
//!
//! Volume 1 is not among our documents; the form is that of the sheets makers publish, and of a parser of another maker
//! that judges it in the tests. CIP Motion adds nothing to it (Volume 9 clause 7-2).
//!
//! Everything in it is the configuration's or a constant of the adapter, so the sheet and the device cannot differ. The
//! same configuration makes the same bytes: the File object serves them, and `axisbridge eds` writes them.
//!
//! A device with assemblies has them in its sheet, and its connections to them in place of the motion connection.
//!
//! Left out is what the box does not have or the configuration does not know: icons, the parameters of the
//! axes (a CIP Motion controller has those from its own profile), speed and label of the port.

mod assembly;
mod writer;

use profile_cip::device::adapter::SESSIONS_MAX;
use profile_cip::device::config::{
    AdapterConfig, DEVICE_TYPE_CIP_MOTION_CONVERTER, DEVICE_TYPE_CIP_MOTION_DRIVE,
    DEVICE_TYPE_CIP_MOTION_ENCODER, DEVICE_TYPE_GENERIC,
};
use profile_cip::device::connection_manager::{CONNECTIONS_MAX, EXPLICIT_CONNECTIONS_MAX, LISTENERS_MAX};
use profile_cip::device::motion_open;
use profile_cip::device::object_list::{OBJECT_CLASSES, ObjectClass};
use profile_cip::device::objects::class::CLASS_CONNECTION_MANAGER;
use profile_cip::wire::class1::SEQUENCE_COUNT_LEN;
use profile_cip::wire::forward_open::Trigger;
use profile_cip::wire::network_parameters::ConnectionType;

use self::writer::{Field, Writer};
use crate::config::Device;

/// When the form of the sheets was made; it changes with the form, not with the clock, so that a sheet can be made again.
const CREATED: (&str, &str) = ("11-22-2026", "00:00:00");

/// Revision of the form of the sheets.
const REVISION: &str = "1.1";

/// Packet interval a tool proposes, in microseconds, as near as the device takes it: slow enough for any host.
const RPI_PROPOSED_US: u32 = 8000;

/// Data types of parameters: name, code and bytes.
const DATA_TYPES: [(&str, u8, u16); 7] = [
    ("INT", 0xC3, 2),
    ("DINT", 0xC4, 4),
    ("LINT", 0xC5, 8),
    ("USINT", 0xC6, 1),
    ("UINT", 0xC7, 2),
    ("UDINT", 0xC8, 4),
    ("BYTE", 0xD1, 1),
];

/// Numbers of the parameters that the connection refers to.
const PARAM_RPI: u16 = 1;
const PARAM_O_TO_T_SIZE: u16 = 2;
const PARAM_T_TO_O_SIZE: u16 = 3;

/// Bits of the first word of a connection: transport classes from 0, triggers from 16, application type.
mod transport {
    pub const CYCLIC: u32 = 1 << 16;
    pub const EXCLUSIVE_OWNER: u32 = 1 << 26;
    pub const SERVER: u32 = 1 << 31;
}

/// Bits of the second word of a connection. The priorities of a sheet are low, high and scheduled; urgent, with which
/// controllers open the motion connection, has no bit, and scheduled is the nearest that has.
mod parameters {
    pub const O_TO_T_VARIABLE: u32 = 1 << 1;
    pub const T_TO_O_VARIABLE: u32 = 1 << 3;
    pub const O_TO_T_FIXED: u32 = 1;
    pub const T_TO_O_FIXED: u32 = 1 << 2;
    /// Real time formats 0: the data carry no run/idle header.
    pub const MODELESS: u32 = 0;
    pub const O_TO_T_TYPES: u32 = 16;
    pub const T_TO_O_TYPES: u32 = 20;
    pub const O_TO_T_SCHEDULED: u32 = 1 << 26;
    pub const T_TO_O_SCHEDULED: u32 = 1 << 30;
}

/// The sheet of a device.
#[must_use]
pub fn sheet(device: &Device, adapter: &AdapterConfig) -> String {
    let mut w = Writer::default();
    w.comment(&format!("Electronic data sheet of {}, written by Axisbridge.", adapter.identity.product_name));
    file(&mut w, adapter);
    identity(&mut w, device, adapter);
    w.section("Device Classification");
    w.entry("Class1", &[Field::Word("EtherNetIP")]);
    parameters(&mut w, adapter);
    assembly::section(&mut w, adapter);
    for class in &OBJECT_CLASSES {
        // The sheet has no section for the axes.
        if class.instance.is_some() {
            object(&mut w, class, adapter);
        }
    }
    capacity(&mut w, adapter);
    w.finish()
}

fn file(w: &mut Writer, adapter: &AdapterConfig) {
    w.section("File");
    let (name, kind) = (&adapter.identity.product_name, device_type(adapter.identity.device_type));
    w.entry("DescText", &[Field::Text(&format!("{name}: {kind}"))]);
    w.entry("CreateDate", &[Field::Word(CREATED.0)]);
    w.entry("CreateTime", &[Field::Word(CREATED.1)]);
    w.entry("Revision", &[Field::Word(REVISION)]);
}

fn identity(w: &mut Writer, device: &Device, adapter: &AdapterConfig) {
    let identity = &adapter.identity;
    w.section("Device");
    w.entry("VendCode", &[Field::from(identity.vendor)]);
    w.entry("VendName", &[Field::Text(&device.identity.vendor_name)]);
    w.entry("ProdType", &[Field::from(identity.device_type)]);
    w.entry("ProdTypeStr", &[Field::Text(device_type(identity.device_type))]);
    w.entry("ProdCode", &[Field::from(identity.product_code)]);
    w.entry("MajRev", &[Field::from(u16::from(identity.major))]);
    w.entry("MinRev", &[Field::from(u16::from(identity.minor))]);
    w.entry("ProdName", &[Field::Text(&identity.product_name)]);
    w.entry("Catalog", &[Field::Text(&device.identity.catalog)]);
}

/// Name of a device type (Volume 9 clause 6-2).
fn device_type(code: u16) -> &'static str {
    match code {
        DEVICE_TYPE_CIP_MOTION_DRIVE => "CIP Motion Drive",
        DEVICE_TYPE_CIP_MOTION_ENCODER => "CIP Motion Encoder",
        DEVICE_TYPE_CIP_MOTION_CONVERTER => "CIP Motion Converter",
        DEVICE_TYPE_GENERIC => "Generic Device",
        _ => "Vendor Specific",
    }
}

/// Bytes of connection data that the sheet counts: without the sequence count of class 1.
fn data_size(connection_size: u16) -> u32 {
    let sequence_count = u16::try_from(SEQUENCE_COUNT_LEN).unwrap_or(0);
    u32::from(connection_size.saturating_sub(sequence_count))
}

fn parameters(w: &mut Writer, adapter: &AdapterConfig) {
    let motion = &adapter.motion;
    w.section("Params");
    let rpi =
        [motion.rpi_min_us, motion.acceptable_rpi_us(u32::MAX), motion.acceptable_rpi_us(RPI_PROPOSED_US)];
    let interval = if adapter.assembly.is_some() { "Packet interval" } else { "Controller Update Period" };
    parameter(w, PARAM_RPI, "UDINT", [interval, "us", ""], rpi.map(Field::Number));
    if let Some(assemblies) = &adapter.assembly {
        assembly::field_parameters(w, assemblies);
        return;
    }
    let size = |most: u16| {
        let (least, most) = motion.sizes(most);
        [data_size(least), data_size(most), data_size(most)].map(Field::Number)
    };
    let (o_to_t, t_to_o) = (size(motion.o_to_t_size_max), size(motion.t_to_o_size_max));
    parameter(w, PARAM_O_TO_T_SIZE, "UINT", ["Controller-to-Device size", "bytes", ""], o_to_t);
    parameter(w, PARAM_T_TO_O_SIZE, "UINT", ["Device-to-Controller size", "bytes", ""], t_to_o);
}

/// Code and bytes of a data type. All types that fields of assemblies have are known; another one has no code and no bytes.
fn data_type(name: &str) -> (u8, u16) {
    let found = DATA_TYPES.iter().find(|(known, ..)| *known == name);
    found.map_or((0, 0), |(_, code, size)| (*code, *size))
}

/// A parameter that only the sheet has: name, unit and help; least, greatest and proposed value.
fn parameter(w: &mut Writer, number: u16, kind: &str, texts: [&str; 3], range: [Field<'_>; 3]) {
    let (code, size) = data_type(kind);
    let mut fields = vec![
        Field::from(0u16),
        // Link path size and link path: it is no attribute.
        Field::Empty,
        Field::Empty,
        Field::Hex(0, 4),
        Field::Hex(u32::from(code), 2),
        Field::from(size),
    ];
    fields.extend(texts.map(Field::Text));
    fields.extend(range);
    // Multiplier, divider, base, offset, links to them, and decimal places: the values are as they are.
    fields.extend([const { Field::Empty }; 9]);
    w.entry(&format!("Param{number}"), &fields);
}

/// What every class has in common, and what is its own.
fn object(w: &mut Writer, class: &ObjectClass, adapter: &AdapterConfig) {
    w.section(&section(class));
    w.entry("Revision", &[Field::from(class.revision)]);
    w.entry("MaxInst", &[Field::from(class.instance.unwrap_or(1))]);
    w.entry("Number_Of_Static_Instances", &[Field::from(1u16)]);
    w.entry("Max_Number_Of_Dynamic_Instances", &[Field::from(0u16)]);
    w.entry("Object_Name", &[Field::Text(class.name)]);
    w.entry("Object_Class_Code", &[Field::Hex(u32::from(class.class), 2)]);
    if class.class == CLASS_CONNECTION_MANAGER {
        match &adapter.assembly {
            None => connection(w, adapter),
            Some(assemblies) => assembly::connections(w, assemblies),
        }
    }
}

/// Name of a class's section: that of the object, and "Class" in place of "Object". The Connection Manager has none.
fn section(class: &ObjectClass) -> String {
    let name = class.name.strip_suffix(" Object").unwrap_or(class.name);
    if class.class == CLASS_CONNECTION_MANAGER { name.to_owned() } else { format!("{name} Class") }
}

fn connection(w: &mut Writer, adapter: &AdapterConfig) {
    let open = motion_open::TRANSPORT;
    let mut trigger = 1 << open.class | transport::EXCLUSIVE_OWNER;
    if open.trigger == Trigger::CYCLIC {
        trigger |= transport::CYCLIC;
    }
    if open.server {
        trigger |= transport::SERVER;
    }
    let of_type = |connection_type: ConnectionType, from: u32| 1 << (u32::from(connection_type.0) + from);
    let mut parameters = parameters::MODELESS
        | of_type(motion_open::CONNECTION_TYPE, parameters::O_TO_T_TYPES)
        | of_type(motion_open::CONNECTION_TYPE, parameters::T_TO_O_TYPES)
        | parameters::O_TO_T_SCHEDULED
        | parameters::T_TO_O_SCHEDULED;
    parameters |= if adapter.motion.is_variable() {
        parameters::O_TO_T_VARIABLE | parameters::T_TO_O_VARIABLE
    } else {
        parameters::O_TO_T_FIXED | parameters::T_TO_O_FIXED
    };
    let path = motion_open::application_path(&adapter.motion);
    let path = path.iter().map(|octet| format!("{octet:02X}")).collect::<Vec<_>>().join(" ");
    w.entry(
        "Connection1",
        &[
            Field::Hex(trigger, 8),
            Field::Hex(parameters, 8),
            Field::Reference(PARAM_RPI),
            Field::Reference(PARAM_O_TO_T_SIZE),
            Field::Empty,
            Field::Reference(PARAM_RPI),
            Field::Reference(PARAM_T_TO_O_SIZE),
            Field::Empty,
            // Configuration of a proxy, and of the device: the path carries it.
            Field::Empty,
            Field::Empty,
            Field::Empty,
            Field::Empty,
            Field::Text("CIP Motion"),
            Field::Text("The motion connection: commands and actual values of all axes"),
            Field::Text(&path),
        ],
    );
}

fn capacity(w: &mut Writer, adapter: &AdapterConfig) {
    let motion = &adapter.motion;
    let count = |most: usize| Field::Number(u32::try_from(most).unwrap_or(u32::MAX));
    w.section("Capacity");
    w.comment(&format!("{SESSIONS_MAX} encapsulation sessions"));
    let listeners = u32::try_from(LISTENERS_MAX).unwrap_or(0);
    let all = u32::from(CONNECTIONS_MAX) + if adapter.assembly.is_some() { listeners } else { 0 };
    w.entry("MaxCIPConnections", &[Field::Number(all)]);
    w.entry("MaxIOConnections", &[Field::Number(all.saturating_sub(explicit()))]);
    w.entry("MaxMsgConnections", &[count(EXPLICIT_CONNECTIONS_MAX)]);
    let per_second = Field::Number(1_000_000 / motion.rpi_min_us.max(1));
    let (rx, tx) = match &adapter.assembly {
        None => (motion.sizes(motion.o_to_t_size_max).1, motion.sizes(motion.t_to_o_size_max).1),
        Some(assemblies) => (assemblies.o_to_t_size(), assemblies.t_to_o_size()),
    };
    w.entry("TSpec1", &[Field::Word("Rx"), Field::from(rx), per_second.clone()]);
    w.entry("TSpec2", &[Field::Word("Tx"), Field::from(tx), per_second]);
}

fn explicit() -> u32 {
    u32::try_from(EXPLICIT_CONNECTIONS_MAX).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests;
