//! What is not objects: file, device, commissioning, dummies, comments, modules.

use super::{Reader, SectionKind};
use crate::eds::data_type::DataType;
use crate::eds::description::{Commissioning, DeviceDescription, DeviceInfo, FileInfo, Module};
use crate::eds::diagnostic::{Kind, Place};

/// Bit rates of CiA 301, kbit/s.
const BIT_RATES: [u16; 8] = [10, 20, 50, 125, 250, 500, 800, 1000];

/// The most comments and modules that are kept.
const LINES_MAX: usize = 1000;

impl Reader<'_, '_> {
    /// Everything but the objects.
    pub(super) fn head(&mut self) -> DeviceDescription {
        for section in &self.document.sections {
            if SectionKind::of(section.name) == SectionKind::Unknown {
                let expected = "a section of CiA 306";
                self.diagnostics.push(Kind::SectionUnknown, section.place(), expected, section.name);
            }
        }
        DeviceDescription {
            file: self.file_info(),
            device: self.device_info(),
            commissioning: self.commissioning(),
            dummies: self.dummies(),
            comments: self.comments(),
            modules: self.modules(),
            objects: Vec::new(),
        }
    }

    /// The number of a section that every file has.
    fn required(&mut self, name: &str) -> Option<usize> {
        let found = self.document.section(name).map(|(at, _)| at);
        if found.is_none() {
            let expected = format!("a section [{name}]");
            self.diagnostics.push(Kind::SectionMissing, Place::default(), expected, "none");
        }
        found
    }

    fn file_info(&mut self) -> FileInfo {
        let Some(at) = self.required("FileInfo") else { return FileInfo::default() };
        let text = |key| self.text(at, key).to_owned();
        let both = |one, other| format!("{} {}", self.text(at, one), self.text(at, other)).trim().to_owned();
        FileInfo {
            file_name: text("FileName"),
            file_version: text("FileVersion"),
            file_revision: text("FileRevision"),
            eds_version: text("EDSVersion"),
            description: text("Description"),
            creation: both("CreationDate", "CreationTime"),
            created_by: text("CreatedBy"),
            modification: both("ModificationDate", "ModificationTime"),
            modified_by: text("ModifiedBy"),
            last_eds: text("LastEDS"),
        }
    }

    fn device_info(&mut self) -> DeviceInfo {
        let Some(at) = self.required("DeviceInfo") else { return DeviceInfo::default() };
        let mut bit_rates = Vec::with_capacity(BIT_RATES.len());
        for rate in BIT_RATES {
            if self.flag(at, &format!("BaudRate_{rate}")) {
                bit_rates.push(rate);
            }
        }
        DeviceInfo {
            vendor_name: self.text(at, "VendorName").to_owned(),
            vendor_number: self.number(at, "VendorNumber"),
            product_name: self.text(at, "ProductName").to_owned(),
            product_number: self.number(at, "ProductNumber"),
            revision_number: self.number(at, "RevisionNumber"),
            order_code: self.text(at, "OrderCode").to_owned(),
            bit_rates,
            boot_up_master: self.flag(at, "SimpleBootUpMaster"),
            boot_up_slave: self.flag(at, "SimpleBootUpSlave"),
            granularity: self.number(at, "Granularity"),
            dynamic_channels: self.number(at, "DynamicChannelsSupported").unwrap_or_default(),
            group_messaging: self.flag(at, "GroupMessaging"),
            rpdos: self.number(at, "NrOfRXPDO"),
            tpdos: self.number(at, "NrOfTXPDO"),
            lss: self.flag(at, "LSS_Supported"),
            lss_serial_number: self.number(at, "LSS_SerialNumber"),
            compact_pdo: self.number(at, "CompactPDO").unwrap_or_default(),
        }
    }

    /// The section goes by two spellings; the one with a single m is that of CiA 306.
    fn commissioning(&mut self) -> Option<Commissioning> {
        let document = self.document;
        let spellings = ["DeviceComissioning", "DeviceCommissioning"];
        let (at, section) = spellings.iter().find_map(|name| document.section(name))?;
        let node_id = self.number::<u8>(at, "NodeID").or_else(|| self.number(at, "NodeId"));
        let bit_rate = self.number::<u16>(at, "Baudrate");
        let good_node = node_id.filter(|node| (1..=127).contains(node));
        let good_rate = bit_rate.filter(|rate| BIT_RATES.contains(rate));
        for (key, good, expected) in [
            ("NodeID", good_node.is_some() || node_id.is_none(), "a node-ID of 1 to 127"),
            ("Baudrate", good_rate.is_some() || bit_rate.is_none(), "a bit rate of CiA 301 in kbit/s"),
        ] {
            if let Some(entry) = document.entry(at, key).filter(|_| !good) {
                self.diagnostics.push(Kind::Commissioning, section.value_place(entry), expected, entry.value);
            }
        }
        Some(Commissioning {
            node_id: good_node,
            node_name: self.text(at, "NodeName").to_owned(),
            bit_rate: good_rate,
            net_number: self.number(at, "NetNumber"),
            network_name: self.text(at, "NetworkName").to_owned(),
            manager: self.flag(at, "CANopenManager"),
            lss_serial_number: self.number(at, "LSS_SerialNumber"),
        })
    }

    /// `Dummy0005=1`: type 5 can fill a gap.
    fn dummies(&mut self) -> Vec<DataType> {
        let document = self.document;
        let Some((at, section)) = document.section("DummyUsage") else { return Vec::new() };
        let mut dummies = Vec::new();
        for entry in &section.entries {
            let number = entry
                .key
                .get(..5)
                .filter(|front| front.eq_ignore_ascii_case("dummy"))
                .and(entry.key.get(5..));
            let code = number.and_then(|digits| u16::from_str_radix(digits, 16).ok());
            match code.map(DataType).filter(|code| code.bits().is_some()) {
                Some(code) if self.flag(at, entry.key) => dummies.push(code),
                Some(_) => {}
                None => {
                    let expected = "`Dummy` and the number of a data type";
                    self.diagnostics.push(Kind::TypeUnknown, section.key_place(entry), expected, entry.key);
                }
            }
        }
        dummies.sort_unstable();
        dummies
    }

    /// `Line1=`, `Line2=` ..., as many as there are, whatever `Lines` says.
    fn comments(&mut self) -> Vec<String> {
        let document = self.document;
        let Some((at, section)) = document.section("Comments") else { return Vec::new() };
        let lines = (1..=LINES_MAX).map_while(|number| document.entry(at, &format!("Line{number}")));
        let comments: Vec<String> = lines.map(|entry| entry.value.to_owned()).collect();
        if let Some(count) = self.number::<usize>(at, "Lines").filter(|count| *count != comments.len()) {
            let expected = format!("{count} lines");
            self.diagnostics.push(Kind::ListCount, section.place(), expected, format!("{}", comments.len()));
        }
        comments
    }

    /// Modules: what they are; their objects stand in sections that are named and not read.
    fn modules(&mut self) -> Vec<Module> {
        let mut modules: Vec<Module> = Vec::new();
        for section in &self.document.sections {
            let SectionKind::Module(number) = SectionKind::of(section.name) else { continue };
            let at = match modules.binary_search_by_key(&number, |module| module.number) {
                Ok(at) => at,
                Err(_) if modules.len() >= LINES_MAX => continue,
                Err(at) => {
                    modules.insert(at, Module { number, ..Module::default() });
                    at
                }
            };
            let Some(module) = modules.get_mut(at) else { continue };
            if module.sections.len() < LINES_MAX {
                module.sections.push(section.name.to_owned());
            }
        }
        for module in &mut modules {
            let name = format!("M{}ModuleInfo", module.number);
            let Some((at, _)) = self.document.section(&name) else { continue };
            self.text(at, "ProductName").clone_into(&mut module.product_name);
            self.text(at, "OrderCode").clone_into(&mut module.order_code);
            module.product_version = self.number(at, "ProductVersion");
            module.product_revision = self.number(at, "ProductRevision");
        }
        if let Some((at, section)) = self.document.section("SupportedModules") {
            let count = self.number::<usize>(at, "NrOfEntries").unwrap_or_default();
            if count != modules.len() {
                let expected = format!("sections of {count} modules");
                self.diagnostics.push(
                    Kind::ListCount,
                    section.place(),
                    expected,
                    format!("{}", modules.len()),
                );
            }
        }
        modules
    }
}
