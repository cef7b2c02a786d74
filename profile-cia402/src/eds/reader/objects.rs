//! Objects and sub-objects.

use std::collections::BTreeMap;

use super::{Reader, SectionKind};
use crate::eds::data_type::{DataType, Shape};
use crate::eds::description::{Access, DeviceDescription, Object, ObjectKind, SubObject};
use crate::eds::diagnostic::{Kind, Place};
use crate::eds::ini::Section;
use crate::eds::number;
use crate::eds::value::{self, Fault, Setting, Value};

/// The most sub-objects that a compact object can stand for.
const COMPACT_MAX: u8 = 254;

/// The most bytes that compact sections may stand for. A small file could ask for gigabytes with them.
const EXPANDED_MAX: usize = 64 * 1024 * 1024;

/// About what a sub-object takes without its texts, bytes.
const SUB_BYTES: usize = 256;

/// The sections of one object, by their numbers in the document.
#[derive(Debug, Default)]
struct Parts {
    object: Option<usize>,
    subs: BTreeMap<u8, usize>,
    names: Option<usize>,
    values: Option<usize>,
    /// The first section of all.
    first: usize,
}

impl<'t> Reader<'_, 't> {
    /// All objects, by number.
    pub(super) fn objects(&mut self, description: &DeviceDescription) -> Vec<Object> {
        let mut parts: BTreeMap<u16, Parts> = BTreeMap::new();
        for (at, section) in self.document.sections.iter().enumerate() {
            let kind = SectionKind::of(section.name);
            let (SectionKind::Object(index)
            | SectionKind::Sub(index, _)
            | SectionKind::Names(index)
            | SectionKind::Values(index)) = kind
            else {
                continue;
            };
            let of = parts.entry(index).or_insert_with(|| Parts { first: at, ..Parts::default() });
            match kind {
                SectionKind::Object(_) => of.object = Some(at),
                // `1018sub1` and `1018sub01` are two names of one sub-object; the first counts.
                SectionKind::Sub(_, sub) => _ = of.subs.entry(sub).or_insert(at),
                SectionKind::Names(_) => of.names = Some(at),
                _ => of.values = Some(at),
            }
        }
        let mut objects: Vec<Object> =
            parts.iter().filter_map(|(index, parts)| self.object(*index, parts)).collect();
        self.compact_pdos(&mut objects, description);
        objects
    }

    fn section(&self, at: usize) -> Option<&'_ Section<'t>> {
        self.document.sections.get(at)
    }

    /// The place of the header of a section.
    fn header(&self, at: usize) -> Place<'t> {
        self.section(at).map_or_else(Place::default, Section::place)
    }

    fn object(&mut self, index: u16, parts: &Parts) -> Option<Object> {
        let Some(at) = parts.object else {
            let expected = format!("a section [{index:04X}]");
            let place = self.header(parts.first);
            self.diagnostics.push(Kind::SubOrphan, place, expected, "none");
            if parts.subs.is_empty() {
                return None;
            }
            let subs = parts.subs.iter().map(|(sub, at)| self.sub(*at, *sub)).collect();
            let kind = ObjectKind::Record;
            return Some(Object { index, name: String::new(), kind, list: None, flags: 0, subs });
        };
        let kind = self.kind(at, parts);
        let name = self.name(at);
        let entry = self.document.entry(at, "CompactSubObj");
        // Whether it is a number has been said already.
        let compact = entry
            .and_then(|entry| number::plain(entry.value).ok()?.0.try_into().ok())
            .filter(|count: &u8| *count > 0);
        let mut subs: Vec<SubObject> = match compact {
            Some(count) => self.compact(at, count.min(COMPACT_MAX), parts),
            None if kind.has_subs() => Vec::with_capacity(parts.subs.len()),
            None => vec![self.variable(at, kind, &name)],
        };
        for (sub, at) in &parts.subs {
            let value = self.sub(*at, *sub);
            match subs.binary_search_by_key(sub, |known| known.sub) {
                Ok(known) => {
                    let place = self.header(*at);
                    let expected = "no section of its own where `CompactSubObj` describes it";
                    self.diagnostics.push(Kind::Compact, place, expected, format!("sub-object {sub}"));
                    if let Some(known) = subs.get_mut(known) {
                        *known = value;
                    }
                }
                Err(place) => subs.insert(place, value),
            }
        }
        if compact.is_none() && kind.has_subs() {
            self.check_sub_number(at, &subs);
        }
        let flags = self.number(at, "ObjFlags").unwrap_or_default();
        Some(Object { index, name, kind, list: None, flags, subs })
    }

    /// `ObjectType`; an object without is a variable, and a record when it has sub-objects.
    fn kind(&mut self, at: usize, parts: &Parts) -> ObjectKind {
        let compact = self.number::<u8>(at, "CompactSubObj").is_some_and(|count| count > 0);
        let has_subs = compact || !parts.subs.is_empty();
        let by_subs = match (compact, has_subs) {
            (true, _) => ObjectKind::Array,
            (false, true) => ObjectKind::Record,
            (false, false) => ObjectKind::Var,
        };
        let Some(number) = self.number::<i128>(at, "ObjectType") else { return by_subs };
        let Some(entry) = self.document.entry(at, "ObjectType") else { return by_subs };
        let place = self.section(at).map_or_else(Place::default, |section| section.value_place(entry));
        match ObjectKind::of_number(number) {
            Some(kind) if has_subs && !kind.has_subs() => {
                let got = format!("{} and sub-objects", entry.value);
                self.diagnostics.push(Kind::SubsOfVariable, place, "an array or a record", got);
                by_subs
            }
            Some(kind) => kind,
            None => {
                self.diagnostics.push(Kind::ObjectType, place, "0, 2, 5, 6, 7, 8 or 9", entry.value);
                by_subs
            }
        }
    }

    /// `ParameterName`; empty and told when it is not there.
    fn name(&mut self, at: usize) -> String {
        let name = self.text(at, "ParameterName");
        if name.is_empty() {
            let place = self.header(at);
            self.diagnostics.push(Kind::NameMissing, place, "`ParameterName`", "none");
        }
        name.to_owned()
    }

    fn variable(&mut self, at: usize, kind: ObjectKind, name: &str) -> SubObject {
        let domain = kind == ObjectKind::Domain;
        self.value_of(at, 0, name.to_owned(), domain.then_some(DataType::DOMAIN))
    }

    fn sub(&mut self, at: usize, sub: u8) -> SubObject {
        let name = self.name(at);
        let domain = self.number::<u8>(at, "ObjectType") == Some(ObjectKind::Domain.number());
        self.value_of(at, sub, name, domain.then_some(DataType::DOMAIN))
    }

    /// What a section says of a value; `otherwise` is its type when it does not say.
    fn value_of(&mut self, at: usize, sub: u8, name: String, otherwise: Option<DataType>) -> SubObject {
        let data_type = self.data_type(at, otherwise);
        let access = self.access(at);
        let pdo_mapping = self.flag(at, "PDOMapping");
        let low = self.setting(at, "LowLimit", data_type);
        let high = self.setting(at, "HighLimit", data_type);
        let default = self.setting(at, "DefaultValue", data_type);
        let parameter = self.setting(at, "ParameterValue", data_type);
        let value = SubObject { sub, name, data_type, access, pdo_mapping, default, parameter, low, high };
        self.check_limits(at, &value);
        value
    }

    fn data_type(&mut self, at: usize, otherwise: Option<DataType>) -> DataType {
        let entry = self.document.entry(at, "DataType").filter(|entry| !entry.value.is_empty());
        let Some(entry) = entry else {
            return otherwise.unwrap_or_else(|| {
                let place = self.header(at);
                self.diagnostics.push(Kind::TypeMissing, place, "`DataType`", "none");
                DataType::MISSING
            });
        };
        let place = self.section(at).map_or_else(Place::default, |section| section.value_place(entry));
        let Some(code) = self.number_of::<u16>(place, entry.value) else { return DataType::MISSING };
        let data_type = DataType(code);
        let reserved = [DataType::RESERVED_0E, DataType::RESERVED_17].contains(&data_type);
        if data_type.shape() == Shape::Other && (reserved || data_type.name().is_none()) {
            let expected = "a data type of CiA 301, 0x01 to 0x1B";
            self.diagnostics.push(Kind::TypeUnknown, place, expected, entry.value);
        }
        data_type
    }

    fn access(&mut self, at: usize) -> Access {
        let entry = self.document.entry(at, "AccessType").filter(|entry| !entry.value.is_empty());
        let Some(entry) = entry else {
            let place = self.header(at);
            self.diagnostics.push(Kind::AccessMissing, place, "`AccessType`", "none");
            return Access::ReadOnly;
        };
        let known = Access::ALL.iter().find(|(word, _)| entry.value.eq_ignore_ascii_case(word));
        known.map_or_else(
            || {
                let place =
                    self.section(at).map_or_else(Place::default, |section| section.value_place(entry));
                self.diagnostics.push(Kind::Access, place, "ro, wo, rw, rwr, rww or const", entry.value);
                Access::ReadOnly
            },
            |(_, access)| *access,
        )
    }

    /// A value behind a key; `None` when it is not there, empty, or not of the type.
    fn setting(&mut self, at: usize, key: &str, data_type: DataType) -> Option<Setting> {
        let entry = self.document.entry(at, key).filter(|entry| !entry.value.is_empty())?;
        let place = self.section(at)?.value_place(entry);
        self.setting_of(place, entry.value, data_type)
    }

    fn setting_of(&mut self, place: Place<'_>, text: &str, data_type: DataType) -> Option<Setting> {
        match value::parse(text, data_type) {
            Ok(parsed) => {
                if parsed.twos_complement {
                    let expected = format!("a number with sign, as {data_type} has");
                    let got = format!("{text}, read as {}", parsed.setting);
                    self.diagnostics.push(Kind::TwosComplement, place, expected, got);
                }
                Some(parsed.setting)
            }
            Err(Fault::Form(expected)) => {
                self.diagnostics.push(Kind::Value, place, expected, text);
                None
            }
            Err(Fault::Range(low, high)) => {
                let expected = format!("{low} to {high}, as {data_type} has");
                self.diagnostics.push(Kind::Range, place, expected, text);
                None
            }
        }
    }

    /// Limits that rise, and values between them.
    fn check_limits(&mut self, at: usize, value: &SubObject) {
        let number = |setting: &Option<Setting>| match setting {
            Some(Setting { value, plus_node: false }) => value.as_integer(),
            _ => None,
        };
        let (low, high) = (number(&value.low), number(&value.high));
        let place_of = |key: &str| {
            let entry = self.document.entry(at, key);
            let section = self.document.sections.get(at);
            section.zip(entry).map_or_else(Place::default, |(section, entry)| section.value_place(entry))
        };
        if let (Some(low), Some(high)) = (low, high)
            && low > high
        {
            let place = place_of("LowLimit");
            self.diagnostics.push(
                Kind::Limits,
                place,
                format!("at most the high limit {high}"),
                format!("{low}"),
            );
            return;
        }
        for (key, setting) in [("DefaultValue", &value.default), ("ParameterValue", &value.parameter)] {
            let Some(number) = number(setting) else { continue };
            if low.is_some_and(|low| number < low) || high.is_some_and(|high| number > high) {
                let end =
                    |limit: Option<i128>| limit.map_or_else(|| "any".to_owned(), |limit| limit.to_string());
                let expected = format!("{} to {}, by its limits", end(low), end(high));
                let place = place_of(key);
                self.diagnostics.push(Kind::BeyondLimits, place, expected, format!("{number}"));
            }
        }
    }

    /// `SubNumber` is how many sub-objects there are.
    fn check_sub_number(&mut self, at: usize, subs: &[SubObject]) {
        let Some(said) = self.number::<usize>(at, "SubNumber") else { return };
        let Some(entry) = self.document.entry(at, "SubNumber").filter(|_| said != subs.len()) else { return };
        let place = self.section(at).map_or_else(Place::default, |section| section.value_place(entry));
        self.diagnostics.push(
            Kind::SubNumber,
            place,
            format!("{}, as are described", subs.len()),
            entry.value,
        );
    }

    /// The sub-objects that `CompactSubObj` stands for: a count, and as many values of the object's own type.
    fn compact(&mut self, at: usize, count: u8, parts: &Parts) -> Vec<SubObject> {
        let name = self.text(at, "ParameterName");
        let model = self.value_of(at, 1, String::new(), None);
        let bytes: usize =
            self.section(at).map_or(0, |section| section.entries.iter().map(|entry| entry.value.len()).sum());
        self.expanded += usize::from(count) * (SUB_BYTES + bytes);
        if self.expanded > EXPANDED_MAX {
            let place = self.header(at);
            let expected = "no more compact objects than a device can have";
            self.diagnostics.push(Kind::TooMany, place, expected, format!("{count} sub-objects more"));
            return Vec::new();
        }
        let mut subs = Vec::with_capacity(usize::from(count) + 1);
        subs.push(SubObject {
            sub: 0,
            name: "NrOfObjects".to_owned(),
            data_type: DataType::UNSIGNED8,
            access: Access::ReadOnly,
            pdo_mapping: false,
            default: Some(Setting::plain(Value::Unsigned(count.into()))),
            parameter: None,
            low: None,
            high: None,
        });
        subs.extend((1..=count).map(|sub| SubObject { sub, name: format!("{name}{sub}"), ..model.clone() }));
        let data_type = model.data_type;
        self.compact_entries(parts.names, &mut subs, |_, sub, _, text| text.clone_into(&mut sub.name));
        self.compact_entries(parts.values, &mut subs, |reader, sub, place, text| {
            sub.parameter = reader.setting_of(place, text, data_type).or(sub.parameter.take());
        });
        subs
    }

    /// The entries of `[1003Name]` or `[1003Value]`.
    fn compact_entries(
        &mut self,
        at: Option<usize>,
        subs: &mut [SubObject],
        mut take: impl FnMut(&mut Self, &mut SubObject, Place<'t>, &str),
    ) {
        let document = self.document;
        let Some((at, section)) = at.and_then(|at| Some((at, document.sections.get(at)?))) else { return };
        let mut count = 0_u32;
        for (number, entry) in self.numbered(section) {
            let found = usize::try_from(number).ok().filter(|number| *number > 0);
            let Some(sub) = found.and_then(|number| subs.get_mut(number)) else {
                let expected = format!("a sub-index of 1 to {}", subs.len().saturating_sub(1));
                self.diagnostics.push(Kind::Compact, section.key_place(entry), expected, entry.key);
                continue;
            };
            count += 1;
            take(self, sub, section.value_place(entry), entry.value);
        }
        let Some(said) = self.number::<u32>(at, "NrOfEntries").filter(|said| *said != count) else { return };
        self.diagnostics.push(
            Kind::ListCount,
            section.place(),
            format!("{said} entries"),
            format!("{count}"),
        );
    }

    /// PDOs that `CompactPDO` stands for: those of `NrOfRXPDO` and `NrOfTXPDO` that have no section.
    fn compact_pdos(&mut self, objects: &mut Vec<Object>, description: &DeviceDescription) {
        let mask = description.device.compact_pdo;
        if mask == 0 {
            return;
        }
        let mut made = Vec::new();
        let counts = [(0x1400, description.device.rpdos), (0x1800, description.device.tpdos)];
        for (base, count) in counts {
            for number in 0..count.unwrap_or_default().min(512) {
                for object in
                    [compact_communication(base + number, mask), compact_mapping(base + 0x200 + number)]
                {
                    if objects.binary_search_by_key(&object.index, |known| known.index).is_err() {
                        made.push(object);
                    }
                }
            }
        }
        objects.append(&mut made);
        objects.sort_by_key(|object| object.index);
    }
}

/// Name, type and default of the communication parameters of a PDO (CiA 301), from sub-index 1.
const COMMUNICATION: [(&str, DataType); 6] = [
    ("COB-ID", DataType::UNSIGNED32),
    ("Transmission type", DataType::UNSIGNED8),
    ("Inhibit time", DataType::UNSIGNED16),
    ("Compatibility entry", DataType::UNSIGNED8),
    ("Event timer", DataType::UNSIGNED16),
    ("SYNC start value", DataType::UNSIGNED8),
];

fn made(sub: u8, name: &str, data_type: DataType, default: Option<Setting>) -> SubObject {
    SubObject {
        sub,
        name: name.to_owned(),
        data_type,
        access: Access::ReadWrite,
        pdo_mapping: false,
        default,
        parameter: None,
        low: None,
        high: None,
    }
}

fn made_record(index: u16, name: &str, subs: Vec<SubObject>) -> Object {
    Object { index, name: name.to_owned(), kind: ObjectKind::Record, list: None, flags: 0, subs }
}

/// The communication parameters of a PDO that has no section: those sub-indices whose bits are set.
fn compact_communication(index: u16, mask: u8) -> Object {
    let number = index & 0x1FF;
    let (name, first) =
        if index < 0x1800 { ("RPDO communication", 0x200) } else { ("TPDO communication", 0x180) };
    // PDO 1 to 4 have identifiers of their own, others are switched off.
    let cob_id = match number {
        0..=3 => Setting { value: Value::Unsigned(first + u64::from(number) * 0x100), plus_node: true },
        _ => Setting::plain(Value::Unsigned(0x8000_0000)),
    };
    let parameters = (1_u8..).zip(COMMUNICATION);
    let mut subs: Vec<SubObject> = parameters
        .filter(|(sub, _)| mask >> (sub - 1) & 1 == 1)
        .map(|(sub, (name, data_type))| made(sub, name, data_type, (sub == 1).then(|| cob_id.clone())))
        .collect();
    let highest = subs.last().map_or(0, |sub| sub.sub);
    let count = Setting::plain(Value::Unsigned(highest.into()));
    let head = made(0, "Highest sub-index supported", DataType::UNSIGNED8, Some(count));
    subs.insert(0, SubObject { access: Access::Constant, ..head });
    made_record(index, name, subs)
}

/// The mapping parameters of a PDO that has no section: up to eight entries, none of them used.
fn compact_mapping(index: u16) -> Object {
    let name = if index < 0x1800 { "RPDO mapping" } else { "TPDO mapping" };
    let none = || Some(Setting::plain(Value::Unsigned(0)));
    let mut subs = vec![made(0, "Number of mapped objects", DataType::UNSIGNED8, none())];
    subs.extend((1..=8).map(|sub| made(sub, "Mapped object", DataType::UNSIGNED32, none())));
    made_record(index, name, subs)
}
