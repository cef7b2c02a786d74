//! From a description to the text of a data sheet or a configuration.

use core::fmt::Write as _;

use super::data_type::DataType;
use super::description::{DeviceDescription, Object, ObjectKind, ObjectList, SubObject};
use super::value::Setting;

/// What is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Form {
    /// An electronic data sheet (EDS): what a device can be.
    Sheet,
    /// A device configuration file (DCF): with node-ID, bit rate and the values of this one device.
    Configuration,
}

/// Bit rates that every file speaks of, kbit/s.
const BIT_RATES: [u16; 8] = [10, 20, 50, 125, 250, 500, 800, 1000];

impl DeviceDescription {
    /// The text of a file that says the same. Compact sections are written out, objects of modules are not written.
    #[must_use]
    pub fn to_text(&self, form: Form) -> String {
        let mut file = Text::default();
        self.write_head(form, &mut file);
        for (name, list) in ObjectList::ALL {
            let listed = || self.objects.iter().filter(|object| object.list == Some(*list));
            file.section(name);
            file.line("SupportedObjects", &listed().count().to_string());
            for (number, object) in (1..).zip(listed()) {
                file.line(&format!("{number}"), &format!("0x{:04X}", object.index));
            }
            listed().for_each(|object| write_object(object, form, &mut file));
        }
        self.objects
            .iter()
            .filter(|object| object.list.is_none())
            .for_each(|object| write_object(object, form, &mut file));
        file.0
    }

    fn write_head(&self, form: Form, file: &mut Text) {
        let info = &self.file;
        let halves = |text: &str| {
            let (date, time) = text.split_once(' ').unwrap_or((text, ""));
            (date.to_owned(), time.to_owned())
        };
        let (creation, modification) = (halves(&info.creation), halves(&info.modification));
        file.section("FileInfo");
        for (key, value) in [
            ("FileName", &info.file_name),
            ("FileVersion", &info.file_version),
            ("FileRevision", &info.file_revision),
            ("EDSVersion", &info.eds_version),
            ("Description", &info.description),
            ("CreationTime", &creation.1),
            ("CreationDate", &creation.0),
            ("CreatedBy", &info.created_by),
            ("ModificationTime", &modification.1),
            ("ModificationDate", &modification.0),
            ("ModifiedBy", &info.modified_by),
            ("LastEDS", &info.last_eds),
        ] {
            file.text(key, value);
        }
        self.write_device(file);
        if let Some(set) = self.commissioning.as_ref().filter(|_| form == Form::Configuration) {
            file.section("DeviceComissioning");
            file.number("NodeID", set.node_id.map(u32::from));
            file.text("NodeName", &set.node_name);
            file.decimal("Baudrate", set.bit_rate.map(u32::from));
            file.decimal("NetNumber", set.net_number);
            file.text("NetworkName", &set.network_name);
            file.flag("CANopenManager", set.manager);
            file.number("LSS_SerialNumber", set.lss_serial_number);
        }
        file.section("DummyUsage");
        for dummy in (1..=7).map(DataType).chain(self.dummies.iter().copied().filter(|dummy| dummy.0 > 7)) {
            file.flag(&format!("Dummy{:04X}", dummy.0), self.dummies.contains(&dummy));
        }
        file.section("Comments");
        file.line("Lines", &self.comments.len().to_string());
        for (number, comment) in (1..).zip(&self.comments) {
            file.line(&format!("Line{number}"), comment);
        }
    }

    fn write_device(&self, file: &mut Text) {
        let device = &self.device;
        file.section("DeviceInfo");
        file.text("VendorName", &device.vendor_name);
        file.number("VendorNumber", device.vendor_number);
        file.text("ProductName", &device.product_name);
        file.number("ProductNumber", device.product_number);
        file.number("RevisionNumber", device.revision_number);
        file.text("OrderCode", &device.order_code);
        for rate in BIT_RATES {
            file.flag(&format!("BaudRate_{rate}"), device.bit_rates.contains(&rate));
        }
        file.flag("SimpleBootUpMaster", device.boot_up_master);
        file.flag("SimpleBootUpSlave", device.boot_up_slave);
        file.decimal("Granularity", device.granularity.map(u32::from));
        file.decimal("DynamicChannelsSupported", Some(device.dynamic_channels));
        file.flag("GroupMessaging", device.group_messaging);
        file.decimal("NrOfRXPDO", device.rpdos.map(u32::from));
        file.decimal("NrOfTXPDO", device.tpdos.map(u32::from));
        file.flag("LSS_Supported", device.lss);
        file.number("LSS_SerialNumber", device.lss_serial_number);
        file.number("CompactPDO", Some(device.compact_pdo.into()));
    }
}

fn write_object(object: &Object, form: Form, file: &mut Text) {
    file.section(&format!("{:04X}", object.index));
    file.text("ParameterName", &object.name);
    file.line("ObjectType", &format!("0x{:X}", object.kind.number()));
    if object.flags != 0 {
        file.number("ObjFlags", Some(object.flags));
    }
    match object.subs.as_slice() {
        [value] if !object.kind.has_subs() => write_value(value, form, file),
        subs => {
            file.line("SubNumber", &subs.len().to_string());
            for value in subs {
                file.section(&format!("{:04X}sub{:X}", object.index, value.sub));
                file.text("ParameterName", &value.name);
                let domain = value.data_type == DataType::DOMAIN;
                let kind = if domain { ObjectKind::Domain } else { ObjectKind::Var };
                file.line("ObjectType", &format!("0x{:X}", kind.number()));
                write_value(value, form, file);
            }
        }
    }
}

fn write_value(value: &SubObject, form: Form, file: &mut Text) {
    if value.data_type != DataType::MISSING {
        file.line("DataType", &format!("0x{:04X}", value.data_type.0));
    }
    file.line("AccessType", value.access.word());
    file.setting("LowLimit", value.low.as_ref());
    file.setting("HighLimit", value.high.as_ref());
    file.setting("DefaultValue", value.default.as_ref());
    if form == Form::Configuration {
        file.setting("ParameterValue", value.parameter.as_ref());
    }
    file.flag("PDOMapping", value.pdo_mapping);
}

/// A file as it grows.
#[derive(Default)]
struct Text(String);

impl Text {
    fn section(&mut self, name: &str) {
        let gap = if self.0.is_empty() { "" } else { "\n" };
        let _ = writeln!(self.0, "{gap}[{name}]");
    }

    /// A line; what would end it early is taken out of the value.
    fn line(&mut self, key: &str, value: &str) {
        let _ = write!(self.0, "{key}=");
        let mut before = '=';
        for letter in value.chars().map(|letter| if matches!(letter, '\r' | '\n') { ' ' } else { letter }) {
            // A semicolon behind a blank would begin a comment.
            let ends = letter == ';' && (before.is_whitespace() || before == '=');
            self.0.push(if ends { ',' } else { letter });
            before = letter;
        }
        self.0.push('\n');
    }

    fn text(&mut self, key: &str, value: &str) {
        if !value.is_empty() {
            self.line(key, value);
        }
    }

    fn flag(&mut self, key: &str, value: bool) {
        self.line(key, if value { "1" } else { "0" });
    }

    fn number(&mut self, key: &str, value: Option<u32>) {
        if let Some(value) = value {
            self.line(key, &format!("0x{value:X}"));
        }
    }

    fn decimal(&mut self, key: &str, value: Option<u32>) {
        if let Some(value) = value {
            self.line(key, &value.to_string());
        }
    }

    fn setting(&mut self, key: &str, value: Option<&Setting>) {
        if let Some(value) = value {
            self.line(key, &value.to_string());
        }
    }
}
