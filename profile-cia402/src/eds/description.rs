//! What a data sheet says of a device.

use super::data_type::DataType;
use super::value::{Setting, Value};

/// What the head of a file says of itself, as it stands there.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct FileInfo {
    /// Name of the file.
    pub file_name: String,
    /// Version of the file.
    pub file_version: String,
    /// Revision of the file.
    pub file_revision: String,
    /// Version of CiA 306 it is written by.
    pub eds_version: String,
    /// What it is.
    pub description: String,
    /// When it was made.
    pub creation: String,
    /// Who made it.
    pub created_by: String,
    /// When it was changed.
    pub modification: String,
    /// Who changed it.
    pub modified_by: String,
    /// The data sheet that a configuration was made from.
    pub last_eds: String,
}

/// What a device is.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DeviceInfo {
    /// Name of the maker.
    pub vendor_name: String,
    /// Vendor-ID, as 1018:1.
    pub vendor_number: Option<u32>,
    /// Name of the device.
    pub product_name: String,
    /// Product code, as 1018:2.
    pub product_number: Option<u32>,
    /// Revision, as 1018:3.
    pub revision_number: Option<u32>,
    /// Order code.
    pub order_code: String,
    /// Bit rates that it can have, kbit/s, rising.
    pub bit_rates: Vec<u16>,
    /// Whether it can boot a network.
    pub boot_up_master: bool,
    /// Whether it can be booted.
    pub boot_up_slave: bool,
    /// The smallest piece that a PDO mapping can have, bits; 0 = the mapping cannot be changed, `None` = nothing is said.
    pub granularity: Option<u8>,
    /// Whether it makes objects at run time.
    pub dynamic_channels: u32,
    /// Whether PDOs can be multiplexed.
    pub group_messaging: bool,
    /// `NrOfRXPDO`; `None` where the file does not say.
    pub rpdos: Option<u16>,
    /// `NrOfTXPDO`; `None` where the file does not say.
    pub tpdos: Option<u16>,
    /// Whether it has LSS.
    pub lss: bool,
    /// Serial number for LSS, as 1018:4.
    pub lss_serial_number: Option<u32>,
    /// Sub-indices of the communication parameters of PDOs that are not described one by one: bit n is sub-index n + 1.
    pub compact_pdo: u8,
}

/// How a device is set up in a network: the head of a configuration.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Commissioning {
    /// Node-ID, 1 to 127.
    pub node_id: Option<u8>,
    /// Its name in the network.
    pub node_name: String,
    /// Bit rate, kbit/s.
    pub bit_rate: Option<u16>,
    /// Number of the network.
    pub net_number: Option<u32>,
    /// Name of the network.
    pub network_name: String,
    /// Whether it is the manager.
    pub manager: bool,
    /// Serial number for LSS.
    pub lss_serial_number: Option<u32>,
}

/// A module that a modular device can have.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Module {
    /// Its number, from 1.
    pub number: u16,
    /// Its name.
    pub product_name: String,
    /// Its version.
    pub product_version: Option<u32>,
    /// Its revision.
    pub product_revision: Option<u32>,
    /// Order code.
    pub order_code: String,
    /// Sections of the file that describe its objects; they are not read further.
    pub sections: Vec<String>,
}

/// What an object is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ObjectKind {
    /// Nothing.
    Null,
    /// As many bytes as there are.
    Domain,
    /// A definition of a type.
    DefType,
    /// A definition of a record.
    DefStruct,
    /// One value.
    Var,
    /// Values of one type.
    Array,
    /// Values of several types.
    Record,
}

impl ObjectKind {
    /// Every kind with its number in the files.
    pub const ALL: &'static [(u8, Self)] = &[
        (0, Self::Null),
        (2, Self::Domain),
        (5, Self::DefType),
        (6, Self::DefStruct),
        (7, Self::Var),
        (8, Self::Array),
        (9, Self::Record),
    ];

    /// Its number in the files.
    #[must_use]
    pub fn number(self) -> u8 {
        Self::ALL.iter().find(|(_, kind)| *kind == self).map_or(0, |(number, _)| *number)
    }

    /// The kind with a number.
    #[must_use]
    pub fn of_number(number: i128) -> Option<Self> {
        Self::ALL.iter().find(|(known, _)| i128::from(*known) == number).map(|(_, kind)| *kind)
    }

    /// Whether its values have sub-indices.
    #[must_use]
    pub const fn has_subs(self) -> bool {
        matches!(self, Self::Array | Self::Record | Self::DefStruct)
    }
}

/// The list that an object stands in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ObjectList {
    /// Every device has it.
    Mandatory,
    /// By a profile.
    Optional,
    /// Of the maker.
    Manufacturer,
}

impl ObjectList {
    /// Every list with the section it is.
    pub const ALL: &'static [(&'static str, Self)] = &[
        ("MandatoryObjects", Self::Mandatory),
        ("OptionalObjects", Self::Optional),
        ("ManufacturerObjects", Self::Manufacturer),
    ];
}

/// What can be done with a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Access {
    /// Read it.
    ReadOnly,
    /// Write it.
    WriteOnly,
    /// Both.
    ReadWrite,
    /// Both; a PDO can transmit it.
    ReadWriteTransmit,
    /// Both; a PDO can receive it.
    ReadWriteReceive,
    /// Read it, and it stays the same.
    Constant,
}

impl Access {
    /// Every access with its word in the files.
    pub const ALL: &'static [(&'static str, Self)] = &[
        ("ro", Self::ReadOnly),
        ("wo", Self::WriteOnly),
        ("rw", Self::ReadWrite),
        ("rwr", Self::ReadWriteTransmit),
        ("rww", Self::ReadWriteReceive),
        ("const", Self::Constant),
    ];

    /// Its word in the files.
    #[must_use]
    pub fn word(self) -> &'static str {
        Self::ALL.iter().find(|(_, access)| *access == self).map_or("", |(word, _)| word)
    }

    /// Whether an SDO can write it.
    #[must_use]
    pub const fn writes(self) -> bool {
        !matches!(self, Self::ReadOnly | Self::Constant)
    }

    /// Whether an SDO can read it.
    #[must_use]
    pub const fn reads(self) -> bool {
        !matches!(self, Self::WriteOnly)
    }

    /// Whether an RPDO may carry it, if it can be mapped at all.
    #[must_use]
    pub const fn receives(self) -> bool {
        matches!(self, Self::WriteOnly | Self::ReadWrite | Self::ReadWriteReceive)
    }

    /// Whether a TPDO may carry it, if it can be mapped at all.
    #[must_use]
    pub const fn transmits(self) -> bool {
        !matches!(self, Self::WriteOnly | Self::ReadWriteReceive)
    }
}

/// One value of an object.
#[derive(Debug, Clone, PartialEq)]
pub struct SubObject {
    /// Its sub-index; 0 of a variable.
    pub sub: u8,
    /// Its name.
    pub name: String,
    /// Its type; [`DataType::MISSING`] when the file does not say.
    pub data_type: DataType,
    /// What can be done with it.
    pub access: Access,
    /// Whether it can be mapped into a PDO.
    pub pdo_mapping: bool,
    /// Value after a reset to defaults.
    pub default: Option<Setting>,
    /// Value that a configuration gives it.
    pub parameter: Option<Setting>,
    /// The smallest value.
    pub low: Option<Setting>,
    /// The largest value.
    pub high: Option<Setting>,
}

impl SubObject {
    /// What the device has there: the value of a configuration, or the default.
    #[must_use]
    pub fn setting(&self) -> Option<&Setting> {
        self.parameter.as_ref().or(self.default.as_ref())
    }
}

/// An entry of the object dictionary, with its sub-entries.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// Its number.
    pub index: u16,
    /// Its name.
    pub name: String,
    /// What it is made of.
    pub kind: ObjectKind,
    /// The list it stands in; `None` when it stands in none.
    pub list: Option<ObjectList>,
    /// `ObjFlags`: bit 0 = not part of a download, bit 1 = not part of a scan.
    pub flags: u32,
    /// Its values, by sub-index: one with 0 of a variable.
    pub subs: Vec<SubObject>,
}

impl Object {
    /// The value with a sub-index.
    #[must_use]
    pub fn sub(&self, sub: u8) -> Option<&SubObject> {
        let at = self.subs.binary_search_by_key(&sub, |known| known.sub).ok()?;
        self.subs.get(at)
    }
}

/// What a data sheet or a configuration says of a device.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DeviceDescription {
    /// What it says of itself.
    pub file: FileInfo,
    /// What the device is.
    pub device: DeviceInfo,
    /// How it is set up; `None` of a data sheet.
    pub commissioning: Option<Commissioning>,
    /// Types that can fill gaps of an RPDO mapping.
    pub dummies: Vec<DataType>,
    /// Comments.
    pub comments: Vec<String>,
    /// Modules of a modular device.
    pub modules: Vec<Module>,
    /// Objects, by number.
    pub objects: Vec<Object>,
}

impl DeviceDescription {
    /// The object with a number.
    #[must_use]
    pub fn object(&self, index: u16) -> Option<&Object> {
        let at = self.objects.binary_search_by_key(&index, |object| object.index).ok()?;
        self.objects.get(at)
    }

    /// A value of an object.
    #[must_use]
    pub fn sub(&self, index: u16, sub: u8) -> Option<&SubObject> {
        self.object(index)?.sub(sub)
    }

    /// What a node with this node-ID has in an object: the value of a configuration, or the default.
    #[must_use]
    pub fn value(&self, index: u16, sub: u8, node: u8) -> Option<Value> {
        self.sub(index, sub)?.setting()?.at(node)
    }

    /// The same as a whole number of 32 bits.
    #[must_use]
    pub fn number(&self, index: u16, sub: u8, node: u8) -> Option<u32> {
        self.value(index, sub, node)?.as_u32()
    }

    /// Gives a value of an object what a configuration is to give it; whether the object is there and of the value's type.
    pub fn set_parameter(&mut self, index: u16, sub: u8, setting: Setting) -> bool {
        let object = self.objects.binary_search_by_key(&index, |object| object.index);
        let Some(object) = object.ok().and_then(|at| self.objects.get_mut(at)) else { return false };
        let Some(value) = object.subs.iter_mut().find(|value| value.sub == sub) else { return false };
        let fits = setting.value.to_bytes(value.data_type).is_some();
        if fits {
            value.parameter = Some(setting);
        }
        fits
    }
}
