//! The electronic data sheet of a device, written from its object dictionary (CiA 306).

use std::fmt::Write as _;

use super::Identity;
use super::dictionary::{Access, DataType, Dictionary, Entry, Mapping, Object, Shape};
use crate::generated::objects;
use crate::wire::Mux;

/// Objects that every device has.
const MANDATORY: [u16; 3] = [objects::DEVICE_TYPE, objects::ERROR_REGISTER, objects::IDENTITY];

/// The data sheet.
#[must_use]
pub fn write(dictionary: &Dictionary, identity: &Identity) -> String {
    let mut text = String::new();
    // Writing to a string does not fail.
    let _ = head(&mut text, dictionary, identity);
    let _ = objects(&mut text, dictionary);
    text
}

fn head(text: &mut String, dictionary: &Dictionary, identity: &Identity) -> std::fmt::Result {
    let count = |range: std::ops::Range<u16>| {
        dictionary.objects().iter().filter(|object| range.contains(&object.index)).count()
    };
    writeln!(text, "[FileInfo]\nFileName=drive.eds\nFileVersion=1\nFileRevision=1\nEDSVersion=4.0")?;
    writeln!(
        text,
        "Description={}\nCreationTime=12:00AM\nCreationDate=01-01-2026\nCreatedBy=Axisbridge",
        identity.name
    )?;
    writeln!(text, "ModificationTime=12:00AM\nModificationDate=01-01-2026\nModifiedBy=Axisbridge\n")?;
    writeln!(text, "[DeviceInfo]\nVendorName=Axisbridge\nVendorNumber={:#010X}", identity.vendor)?;
    writeln!(text, "ProductName={}\nProductNumber={:#010X}", identity.name, identity.product)?;
    writeln!(text, "RevisionNumber={:#010X}\nOrderCode=", identity.revision)?;
    for (rate, has) in [(10, 1), (20, 1), (50, 1), (125, 1), (250, 1), (500, 1), (800, 1), (1000, 1)] {
        writeln!(text, "BaudRate_{rate}={has}")?;
    }
    writeln!(text, "SimpleBootUpMaster=0\nSimpleBootUpSlave=1\nGranularity=8\nDynamicChannelsSupported=0")?;
    writeln!(
        text,
        "GroupMessaging=0\nNrOfRXPDO={}\nNrOfTXPDO={}",
        count(0x1400..0x1600),
        count(0x1800..0x1A00)
    )?;
    writeln!(text, "LSS_Supported=1\n")?;
    writeln!(text, "[DummyUsage]")?;
    for code in 1..=7 {
        writeln!(text, "Dummy{code:04}={}", u8::from(code > 1))?;
    }
    writeln!(text, "\n[Comments]\nLines=1\nLine1=Written from the object dictionary of a simulated drive\n")
}

fn objects(text: &mut String, dictionary: &Dictionary) -> std::fmt::Result {
    let section = |object: &Object| match object.index {
        index if MANDATORY.contains(&index) => "MandatoryObjects",
        0x2000..=0x5FFF => "ManufacturerObjects",
        _ => "OptionalObjects",
    };
    for name in ["MandatoryObjects", "OptionalObjects", "ManufacturerObjects"] {
        let own = || dictionary.objects().iter().filter(|object| section(object) == name);
        writeln!(text, "[{name}]\nSupportedObjects={}", own().count())?;
        for (number, object) in own().enumerate() {
            writeln!(text, "{}={:#06X}", number + 1, object.index)?;
        }
        writeln!(text)?;
        for object in own() {
            one_object(text, dictionary, object)?;
        }
    }
    Ok(())
}

fn one_object(text: &mut String, dictionary: &Dictionary, object: &Object) -> std::fmt::Result {
    let parts = || {
        dictionary.entries().iter().filter(|entry| entry.mux().index == object.index && !entry.is_hidden())
    };
    writeln!(text, "[{:04X}]\nParameterName={}", object.index, object.name)?;
    let is_domain = parts().any(|entry| entry.definition().data_type == DataType::Domain);
    let code = match object.shape {
        Shape::Variable if is_domain => 2,
        Shape::Variable => 7,
        Shape::Array => 8,
        Shape::Record => 9,
    };
    writeln!(text, "ObjectType={code:#X}")?;
    if object.shape == Shape::Variable {
        if let Some(handle) = dictionary.find(Mux::new(object.index, 0)) {
            one_entry(text, dictionary.entry(handle))?;
        }
        return writeln!(text);
    }
    writeln!(text, "SubNumber={}\n", parts().count())?;
    for part in parts() {
        writeln!(
            text,
            "[{:04X}sub{:X}]\nParameterName={}",
            object.index,
            part.mux().sub,
            part.definition().name
        )?;
        writeln!(text, "ObjectType=0x7")?;
        one_entry(text, part)?;
        writeln!(text)?;
    }
    Ok(())
}

fn one_entry(text: &mut String, entry: &Entry) -> std::fmt::Result {
    let definition = entry.definition();
    let access = match (definition.access, definition.mapping) {
        (Access::Constant, _) => "const",
        (Access::ReadOnly, _) => "ro",
        (Access::WriteOnly, _) => "wo",
        (Access::ReadWrite, Mapping::None | Mapping::Both) => "rw",
        (Access::ReadWrite, Mapping::Tpdo) => "rwr",
        (Access::ReadWrite, Mapping::Rpdo) => "rww",
    };
    writeln!(text, "DataType={:#06X}\nAccessType={access}", definition.data_type.code())?;
    match definition.data_type {
        DataType::Text => writeln!(text, "DefaultValue={}", String::from_utf8_lossy(entry.bytes()))?,
        DataType::Domain | DataType::Octets | DataType::F32 | DataType::F64 => {}
        data_type => {
            let (lowest, highest) = data_type.range();
            if (definition.low, definition.high) != (lowest, highest) && definition.access.writes() {
                writeln!(text, "LowLimit={}\nHighLimit={}", definition.low, definition.high)?;
            }
            match (definition.adds_node, data_type) {
                (true, _) => writeln!(text, "DefaultValue=$NODEID+{:#X}", definition.default)?,
                (false, DataType::U32) => writeln!(text, "DefaultValue={:#X}", definition.default)?,
                (false, _) => writeln!(text, "DefaultValue={}", definition.default)?,
            }
        }
    }
    writeln!(text, "PDOMapping={}", u8::from(definition.mapping != Mapping::None))
}
