//! Electronic data sheets (EDS) and device configuration files (DCF) of CiA 306, concise device configurations (object 1F22 of
//! CiA 302), and what follows from a data sheet for a drive.
//!
//! [`read`] takes the bytes of a file and gives a [`DeviceDescription`] with [`Diagnostics`]: line, column, a stable kind, what was
//! expected and what came. Real files are odd, and only what is too long to be one is [`Refused`]; whatever else is wrong with
//! a file costs the entry it stands in. [`DeviceDescription::to_text`] writes both forms.
//!
//! [`drive`] says what a drive is and can: axes, modes, PDOs and whether their mapping can be changed. [`layout`] chooses PDOs
//! for wanted objects. [`concise`] is the binary form of a configuration.
//!
//! CiA 306 is not public. What is read here is what data sheets in the field have (Technosoft iPOS, the drive of ros2_canopen,
//! files that lely's dcfgen writes) and what PyPI's canopen makes of them. Of `CompactPDO` no source says more than that it is a
//! set of bits: bit n is taken for sub-index n + 1 of the communication parameters.

mod access;
pub mod concise;
mod data_type;
mod description;
mod diagnostic;
pub mod drive;
mod ini;
pub mod layout;
mod number;
mod reader;
mod value;
mod writer;

pub use data_type::DataType;
pub use description::{
    Access, Commissioning, DeviceDescription, DeviceInfo, FileInfo, Module, Object, ObjectKind, ObjectList,
    SubObject,
};
pub use diagnostic::{DIAGNOSTICS_MAX, Diagnostic, Diagnostics, Kind, Severity};
pub use ini::{BYTES_MAX, ENTRIES_MAX, LINE_MAX, Refused, SECTIONS_MAX, plain};
pub use reader::{Reading, read};
pub use value::{Setting, Value};
pub use writer::Form;
