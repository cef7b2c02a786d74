//! Objects of a CANopen device that are known before it is asked: from its data sheet, or from the tables.

use profile_cia402::eds::{DataType, DeviceDescription};

use super::device_file::is_set_by_gateway;
use crate::mapping::{Cia402Access, Cia402Type, Object};

/// An object that a list of parameters has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KnownObject {
    /// Its number.
    pub object: Object,
    /// Its name; empty when nobody says.
    pub name: String,
    /// Its type; `None` when nobody says, or a type without a meaning here.
    pub data_type: Option<Cia402Type>,
    /// What can be done with it; `None` when nobody says.
    pub access: Option<Cia402Access>,
    /// Its unit; empty when there is none or nobody says.
    pub unit: String,
}

impl KnownObject {
    /// The objects of a data sheet or device configuration that have a value.
    #[must_use]
    pub fn of_description(description: &DeviceDescription) -> Vec<Self> {
        let values = description.objects.iter().flat_map(|object| {
            object.subs.iter().map(move |sub| Self {
                object: Object { index: object.index, sub: sub.sub },
                name: if object.subs.len() == 1 {
                    object.name.clone()
                } else {
                    format!("{}: {}", object.name, sub.name)
                },
                data_type: data_type(sub.data_type),
                access: Some(match (sub.access.reads(), sub.access.writes()) {
                    (true, true) => Cia402Access::Rw,
                    (false, true) => Cia402Access::Wo,
                    _ => Cia402Access::Ro,
                }),
                unit: String::new(),
            })
        });
        values.collect()
    }

    /// Whether a client may write it and read it back, as far as anybody says.
    #[must_use]
    pub fn is_kept(&self) -> bool {
        self.access == Some(Cia402Access::Rw) && !is_set_by_gateway(self.object.index)
    }
}

/// The type of a data sheet as the tables name it; `None` for those that they do not have.
fn data_type(data_type: DataType) -> Option<Cia402Type> {
    use Cia402Type as T;
    Some(match data_type {
        DataType::BOOLEAN => T::Bool,
        DataType::INTEGER8 => T::I8,
        DataType::INTEGER16 => T::I16,
        DataType::INTEGER32 => T::I32,
        DataType::INTEGER64 => T::I64,
        DataType::UNSIGNED8 => T::U8,
        DataType::UNSIGNED16 => T::U16,
        DataType::UNSIGNED32 => T::U32,
        DataType::UNSIGNED64 => T::U64,
        DataType::REAL32 => T::F32,
        DataType::REAL64 => T::F64,
        DataType::VISIBLE_STRING => T::VisibleString,
        DataType::OCTET_STRING => T::OctetString,
        DataType::DOMAIN => T::Domain,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use profile_cia402::eds;

    use super::*;

    #[test]
    fn a_data_sheet_names_objects_with_type_and_access() {
        let text = "[FileInfo]\nFileName=own.eds\n[DeviceInfo]\nVendorName=Own\n[OptionalObjects]\nSupportedObjects=2\n1=0x6040\n\
                    2=0x6081\n[ManufacturerObjects]\nSupportedObjects=1\n1=0x2100\n\
                    [6040]\nParameterName=Controlword\nObjectType=0x7\nDataType=0x0006\nAccessType=rw\nPDOMapping=1\n\
                    [6081]\nParameterName=Profile velocity\nObjectType=0x7\nDataType=0x0007\nAccessType=rw\nPDOMapping=0\n\
                    [2100]\nParameterName=Own\nObjectType=0x8\nSubNumber=2\n\
                    [2100sub0]\nParameterName=Entries\nObjectType=0x7\nDataType=0x0005\nAccessType=const\nPDOMapping=0\n\
                    [2100sub1]\nParameterName=Angle\nObjectType=0x7\nDataType=0x0010\nAccessType=rw\nPDOMapping=0\n";
        let reading = eds::read(text.as_bytes()).expect("a data sheet");
        let objects = KnownObject::of_description(&reading.description);
        let shown = objects.iter().map(|known| {
            let kind = known.data_type.map_or("-", Cia402Type::name);
            let access = known.access.map_or("-", Cia402Access::name);
            format!("{} {} {kind} {access} {}", known.object, known.name, known.is_kept())
        });
        assert_eq!(
            shown.collect::<Vec<_>>(),
            [
                "2100:00 Own: Entries u8 ro false",
                "2100:01 Own: Angle - rw true",
                "6040:00 Controlword u16 rw false",
                "6081:00 Profile velocity u32 rw true"
            ]
        );
    }
}
