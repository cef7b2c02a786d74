//! The dictionaries: what each profile has, looked up by name or number.

use profile_generic::image::Signal;
use profile_generic::parameter::{Parameter, ParameterRow};
use profile_generic::program::Width;
use profile_generic::quantity::Quantity;
use profile_sercos::wire::idn::Idn;

use super::format::{AttributeRow, CipFile, EnumerationRow, GenericFile, IdnRow, Name, SercosFile};
use super::load::{Parsed, TableErrors, Tables};
use super::resolver::Resolver;

/// Signals and parameters of the generic model, as the generic dictionary lists them. The catalogue in code decides;
/// the dictionary must say the same.
#[derive(Debug, Clone, Default)]
pub struct GenericDictionary {
    signals: Vec<Signal>,
    parameters: Vec<&'static ParameterRow>,
}

impl GenericDictionary {
    fn resolve(file: &Parsed<GenericFile>, errors: &mut TableErrors) -> Self {
        let mut resolver = Resolver::new(&file.text, errors);
        let rows = &file.rows;
        resolver.head(&rows.format, "profile", &rows.profile, "generic");
        let mut dictionary = Self::default();
        for row in &rows.signal {
            let signals = Signal::ALL.iter().map(|signal| signal.name());
            let what = "a signal of the generic model";
            let Some(signal) = resolver.name("name", &row.name, what, Signal::parse, signals) else {
                continue;
            };
            let access = if signal.is_command() { "command" } else { "feedback" };
            same(&mut resolver, "quantity", &row.quantity, signal.quantity().name());
            same(&mut resolver, "access", &row.access, access);
            if dictionary.signals.contains(&signal) {
                resolver.error(row.name.span(), "name", "the signal is there twice");
            }
            dictionary.signals.push(signal);
        }
        for row in &rows.parameter {
            let names = Parameter::NAMED.iter().map(|(_, name)| *name);
            let what = "a parameter of the generic model";
            let find = |name: &str| Parameter::from_name(name).and_then(Parameter::row);
            let Some(known) = resolver.name("name", &row.name, what, find, names) else { continue };
            same(&mut resolver, "quantity", &row.quantity, known.quantity.name());
            same(&mut resolver, "type", &row.data_type, known.kind.name());
            same(&mut resolver, "access", &row.access, known.access.name());
            if dictionary.parameters.iter().any(|other| other.parameter == known.parameter) {
                resolver.error(row.name.span(), "name", "the parameter is there twice");
            }
            dictionary.parameters.push(known);
        }
        dictionary
    }

    /// All signals.
    pub fn signals(&self) -> &[Signal] {
        &self.signals
    }

    /// All parameters.
    pub fn parameters(&self) -> &[&'static ParameterRow] {
        &self.parameters
    }

    /// The parameter with this name.
    pub fn parameter(&self, name: &str) -> Option<&'static ParameterRow> {
        let row = Parameter::from_name(name)?.row()?;
        self.parameters.iter().copied().find(|known| known.parameter == row.parameter)
    }

    /// The names of all parameters.
    pub fn names(&self) -> impl Iterator<Item = &'static str> + Clone + '_ {
        self.parameters.iter().filter_map(|row| row.parameter.name())
    }
}

/// Checks that a dictionary repeats what the catalogue says.
fn same(resolver: &mut Resolver<'_>, key: &str, name: &Name, expected: &str) {
    if name.get_ref() != expected {
        resolver.error(name.span(), key, format!("expected `{expected}`, got `{}`", name.get_ref()));
    }
}

/// A generic quantity by name.
pub(super) fn quantity(resolver: &mut Resolver<'_>, name: &Name) -> Option<Quantity> {
    let names = Quantity::ALL.iter().map(|quantity| quantity.name());
    resolver.name("quantity", name, "a quantity of the generic model", Quantity::parse, names)
}

/// An elementary data type of CIP, as far as axis attributes use them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CipType {
    /// One byte, 0 or 1.
    Bool,
    /// Signed, 1 byte.
    Sint,
    /// Signed, 2 bytes.
    Int,
    /// Signed, 4 bytes.
    Dint,
    /// Signed, 8 bytes.
    Lint,
    /// Unsigned, 1 byte.
    Usint,
    /// Unsigned, 2 bytes.
    Uint,
    /// Unsigned, 4 bytes.
    Udint,
    /// Unsigned, 8 bytes.
    Ulint,
    /// Floating point, 4 bytes.
    Real,
    /// Floating point, 8 bytes.
    Lreal,
    /// 8 bits.
    Byte,
    /// 16 bits.
    Word,
    /// 32 bits.
    Dword,
    /// 64 bits.
    Lword,
    /// One length byte and that many characters.
    ShortString,
}

impl CipType {
    /// Every type with its name.
    pub const NAMED: &'static [(&'static str, Self)] = &[
        ("BOOL", Self::Bool),
        ("SINT", Self::Sint),
        ("INT", Self::Int),
        ("DINT", Self::Dint),
        ("LINT", Self::Lint),
        ("USINT", Self::Usint),
        ("UINT", Self::Uint),
        ("UDINT", Self::Udint),
        ("ULINT", Self::Ulint),
        ("REAL", Self::Real),
        ("LREAL", Self::Lreal),
        ("BYTE", Self::Byte),
        ("WORD", Self::Word),
        ("DWORD", Self::Dword),
        ("LWORD", Self::Lword),
        ("SHORT_STRING", Self::ShortString),
    ];

    /// How a number of this type lies in memory; `None` for strings.
    pub const fn width(self) -> Option<Width> {
        Some(match self {
            Self::Bool | Self::Usint | Self::Byte => Width::U8,
            Self::Sint => Width::I8,
            Self::Int => Width::I16,
            Self::Dint => Width::I32,
            Self::Lint => Width::I64,
            Self::Uint | Self::Word => Width::U16,
            Self::Udint | Self::Dword => Width::U32,
            Self::Ulint | Self::Lword => Width::U64,
            Self::Real => Width::F32,
            Self::Lreal => Width::F64,
            Self::ShortString => return None,
        })
    }

    /// The name in the standard.
    pub fn name(self) -> &'static str {
        Self::NAMED.iter().find(|(_, known)| *known == self).map_or("", |(name, _)| name)
    }
}

/// How an attribute may be accessed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Access {
    /// Read only.
    Get,
    /// Written by Set services.
    Set,
    /// Written by the connection, not by Set services (Set* in the standard).
    SetCyclic,
}

/// The device functions of the implementation table, in its order.
pub const DEVICE_FUNCTIONS: [char; 6] = ['B', 'E', 'F', 'P', 'V', 'T'];

/// One attribute; "Feedback n" attributes are there once per channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CipAttribute {
    /// Attribute number.
    pub id: u16,
    /// Name in the standard.
    pub name: String,
    /// Type of the value or of an array's elements.
    pub data_type: CipType,
    /// Elements of an array; `None` for a single value.
    pub length: Option<u16>,
    /// Access.
    pub access: Access,
    /// Whether it may be set in the Running state.
    pub running: bool,
    /// Need for each of [`DEVICE_FUNCTIONS`]: `R`, `O`, `C` or `-`.
    pub need: String,
    /// Unit; empty when there is none.
    pub unit: String,
    /// Value at power-up.
    pub default: i64,
}

/// Named codes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Enumeration {
    /// Name of the set.
    pub name: String,
    /// Codes and names.
    pub codes: Vec<(u32, String)>,
}

/// An element of a data set of the cyclic data block.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DataElement {
    /// Bit in the data set.
    pub bit: u8,
    /// Name.
    pub name: String,
    /// Numbers of the attributes it carries.
    pub attributes: Vec<u16>,
}

/// What a CIP Motion device has.
#[derive(Debug, Clone, Default)]
pub struct CipDictionary {
    class_attributes: Vec<CipAttribute>,
    attributes: Vec<CipAttribute>,
    enumerations: Vec<Enumeration>,
    bits: Vec<Enumeration>,
    data_sets: Vec<(String, Vec<DataElement>)>,
}

impl CipDictionary {
    fn resolve(file: &Parsed<CipFile>, errors: &mut TableErrors) -> Self {
        let mut resolver = Resolver::new(&file.text, errors);
        let rows = &file.rows;
        resolver.head(&rows.format, "profile", &rows.profile, "cip-motion");
        let mut dictionary = Self {
            class_attributes: resolve_attributes(&rows.class_attribute, 1, &mut resolver),
            attributes: resolve_attributes(&rows.attribute, DEVICE_FUNCTIONS.len(), &mut resolver),
            enumerations: rows.enumeration.iter().map(|row| resolve_codes(row, &mut resolver)).collect(),
            bits: Vec::new(),
            data_sets: Vec::new(),
        };
        for row in &rows.enumeration {
            if let Some(name) = &row.attribute {
                dictionary.attribute_or_error("attribute", name, &mut resolver);
            }
        }
        for row in &rows.bits {
            if let Some(name) = &row.attribute {
                dictionary.attribute_or_error("attribute", name, &mut resolver);
            }
            let mut codes: Vec<(u32, String)> = Vec::with_capacity(row.bits.len());
            for bit in &row.bits {
                let number = *bit.bit.get_ref();
                if number >= row.width {
                    let message = format!("expected a bit below {}, got {number}", row.width);
                    resolver.error(bit.bit.span(), "bit", message);
                } else if codes.iter().any(|(known, name)| *known == number || name == bit.name.get_ref()) {
                    resolver.error(bit.name.span(), "name", "the bit or its name is there twice");
                }
                codes.push((number, bit.name.get_ref().clone()));
            }
            dictionary.bits.push(Enumeration { name: row.name.get_ref().clone(), codes });
        }
        for row in &rows.data_set {
            dictionary.attribute_or_error("attribute", &row.attribute, &mut resolver);
            let mut elements = Vec::with_capacity(row.elements.len());
            for element in &row.elements {
                let bit = *element.bit.get_ref();
                if bit >= 8 {
                    resolver.error(element.bit.span(), "bit", format!("expected a bit below 8, got {bit}"));
                }
                let attributes = element
                    .attributes
                    .iter()
                    .filter_map(|name| dictionary.attribute_or_error("attributes", name, &mut resolver))
                    .map(|attribute| attribute.id)
                    .collect();
                elements.push(DataElement { bit, name: element.name.get_ref().clone(), attributes });
            }
            dictionary.data_sets.push((row.name.get_ref().clone(), elements));
        }
        dictionary
    }

    /// The attributes of instance 0, by number.
    pub fn class_attributes(&self) -> &[CipAttribute] {
        &self.class_attributes
    }

    /// The attributes of an axis, by number.
    pub fn attributes(&self) -> &[CipAttribute] {
        &self.attributes
    }

    /// The axis attribute with this name.
    pub fn attribute(&self, name: &str) -> Option<&CipAttribute> {
        self.attributes.iter().find(|attribute| attribute.name == name)
    }

    /// The axis attribute with this number.
    pub fn attribute_by_id(&self, id: u16) -> Option<&CipAttribute> {
        let at = self.attributes.binary_search_by_key(&id, |attribute| attribute.id).ok()?;
        self.attributes.get(at)
    }

    /// The set of named codes with this name.
    pub fn enumeration(&self, name: &str) -> Option<&Enumeration> {
        self.enumerations.iter().find(|set| set.name == name)
    }

    /// All sets of named codes.
    pub fn enumerations(&self) -> &[Enumeration] {
        &self.enumerations
    }

    /// The set of named bits with this name.
    pub fn bits(&self, name: &str) -> Option<&Enumeration> {
        self.bits.iter().find(|set| set.name == name)
    }

    /// The elements of the data set with this name.
    pub fn data_set(&self, name: &str) -> Option<&[DataElement]> {
        self.data_sets.iter().find(|(known, _)| known == name).map(|(_, elements)| elements.as_slice())
    }

    /// The names of all data sets.
    pub fn data_set_names(&self) -> impl Iterator<Item = &str> {
        self.data_sets.iter().map(|(name, _)| name.as_str())
    }

    /// The axis attribute that `key` names in a mapping.
    pub(super) fn attribute_or_error(
        &self,
        key: &str,
        name: &Name,
        resolver: &mut Resolver<'_>,
    ) -> Option<&CipAttribute> {
        let known = self.attributes.iter().map(|attribute| attribute.name.as_str());
        resolver.name(key, name, "an attribute of the axis object", |text| self.attribute(text), known)
    }

    /// The code that `key` names in a mapping, from the enumeration `set`.
    pub(super) fn code_or_error(
        &self,
        set: &str,
        key: &str,
        name: &Name,
        resolver: &mut Resolver<'_>,
    ) -> Option<u32> {
        named_code(self.enumeration(set), set, key, name, resolver)
    }

    /// The bit that `key` names in a mapping, from the set of bits `set`.
    pub(super) fn bit_or_error(
        &self,
        set: &str,
        key: &str,
        name: &Name,
        resolver: &mut Resolver<'_>,
    ) -> Option<u32> {
        named_code(self.bits(set), set, key, name, resolver)
    }
}

fn named_code(
    set: Option<&Enumeration>,
    set_name: &str,
    key: &str,
    name: &Name,
    resolver: &mut Resolver<'_>,
) -> Option<u32> {
    let codes = set.map_or(&[][..], |set| &set.codes);
    let find = |text: &str| codes.iter().find(|(_, known)| known == text).map(|(code, _)| *code);
    let known = codes.iter().map(|(_, name)| name.as_str());
    resolver.name(key, name, &format!("a name of {set_name}"), find, known)
}

fn resolve_codes(row: &EnumerationRow, resolver: &mut Resolver<'_>) -> Enumeration {
    let mut codes: Vec<(u32, String)> = Vec::with_capacity(row.codes.len());
    for code in &row.codes {
        let (number, name) = (*code.code.get_ref(), code.name.get_ref());
        if codes.iter().any(|(known, known_name)| *known == number || known_name == name) {
            resolver.error(code.name.span(), "name", "the code or its name is there twice");
        }
        codes.push((number, name.clone()));
    }
    Enumeration { name: row.name.get_ref().clone(), codes }
}

fn resolve_attributes(rows: &[AttributeRow], needs: usize, resolver: &mut Resolver<'_>) -> Vec<CipAttribute> {
    let mut attributes = Vec::with_capacity(rows.len());
    for row in rows {
        let data_type = resolver.word("type", &row.data_type, CipType::NAMED);
        let access = [("get", Access::Get), ("set", Access::Set), ("set_cyclic", Access::SetCyclic)];
        let access = resolver.word("access", &row.access, &access);
        let need = row.need.get_ref();
        if need.chars().count() != needs || !need.chars().all(|letter| "ROC-".contains(letter)) {
            let message = format!("expected {needs} letters of R, O, C and -, got `{need}`");
            resolver.error(row.need.span(), "need", message);
        }
        let (Some(data_type), Some(access)) = (data_type, access) else { continue };
        let step = row.channel_step.unwrap_or(0);
        for channel in 0..row.channels.unwrap_or(1) {
            let Some(id) = step.checked_mul(channel).and_then(|above| row.id.get_ref().checked_add(above))
            else {
                resolver.error(row.id.span(), "id", "the number of the last channel is above 65535");
                break;
            };
            let name = match row.channels {
                Some(_) => row.name.get_ref().replacen(" n ", &format!(" {} ", channel + 1), 1),
                None => row.name.get_ref().clone(),
            };
            attributes.push((
                row.id.span(),
                CipAttribute {
                    id,
                    name,
                    data_type,
                    length: row.length,
                    access,
                    running: row.running,
                    need: need.clone(),
                    unit: row.unit.as_ref().map(|unit| unit.get_ref().clone()).unwrap_or_default(),
                    default: row.default.unwrap_or(0),
                },
            ));
        }
    }
    attributes.sort_by_key(|(_, attribute)| attribute.id);
    for pair in attributes.windows(2) {
        if pair[0].1.id == pair[1].1.id {
            let message = format!("attribute {} is there twice", pair[1].1.id);
            resolver.error(pair[1].0.clone(), "id", message);
        }
    }
    attributes.into_iter().map(|(_, attribute)| attribute).collect()
}

/// How the value of an IDN is displayed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum IdnFormat {
    /// Bits.
    Binary,
    /// Unsigned.
    Unsigned,
    /// Signed.
    Signed,
    /// Hexadecimal.
    Hexadecimal,
    /// Text.
    Text,
    /// IDNs.
    Idn,
}

/// What one unit in the last place of an IDN is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum IdnUnit {
    /// No unit.
    None,
    /// 10^-decimals of a fixed unit.
    Fixed {
        /// The unit.
        unit: String,
        /// Digits behind the decimal point.
        decimals: u8,
    },
    /// What the drive's scaling parameters for this quantity say.
    Scaled(String),
}

/// One IDN.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SercosIdn {
    /// The number.
    pub idn: Idn,
    /// Its name.
    pub name: String,
    /// Bytes of the value or of a list item; `None` when only the drive knows.
    pub length: Option<u8>,
    /// Whether it is a list.
    pub list: bool,
    /// Display format.
    pub format: Option<IdnFormat>,
    /// Whether it is a procedure command.
    pub command: bool,
    /// Unit.
    pub unit: IdnUnit,
    /// Communication phases in which it can be written; `None` when not known.
    pub write: Option<Vec<u8>>,
}

/// A word with named fields.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Word {
    /// Name of the word.
    pub name: String,
    /// IDN that holds it.
    pub idn: Idn,
    /// Fields: name, first bit, last bit.
    pub fields: Vec<(String, u32, u32)>,
}

impl Word {
    /// First and last bit of the field with this name.
    pub fn field(&self, name: &str) -> Option<(u32, u32)> {
        self.fields.iter().find(|(known, _, _)| known == name).map(|(_, low, high)| (*low, *high))
    }

    /// The names of all fields.
    pub fn field_names(&self) -> impl Iterator<Item = &str> + Clone {
        self.fields.iter().map(|(name, _, _)| name.as_str())
    }
}

/// What a SERCOS drive has.
#[derive(Debug, Clone, Default)]
pub struct SercosDictionary {
    idns: Vec<SercosIdn>,
    words: Vec<Word>,
    enumerations: Vec<Enumeration>,
}

impl SercosDictionary {
    fn resolve(file: &Parsed<SercosFile>, errors: &mut TableErrors) -> Self {
        let mut resolver = Resolver::new(&file.text, errors);
        let rows = &file.rows;
        resolver.head(&rows.format, "profile", &rows.profile, "sercos");
        let mut idns: Vec<SercosIdn> = Vec::with_capacity(rows.idn.len());
        for row in &rows.idn {
            if let Some(idn) = resolve_idn(row, &mut resolver) {
                if idns.iter().any(|known| known.idn == idn.idn) {
                    resolver.error(row.idn.span(), "idn", format!("{} is there twice", idn.idn));
                }
                idns.push(idn);
            }
        }
        idns.sort_by_key(|row| row.idn);
        let mut dictionary = Self {
            idns,
            words: Vec::new(),
            enumerations: rows.enumeration.iter().map(|row| resolve_codes(row, &mut resolver)).collect(),
        };
        for row in &rows.word {
            let Some(idn) = dictionary.idn_or_error("idn", &row.idn, &mut resolver).map(|row| row.idn) else {
                continue;
            };
            let mut fields: Vec<(String, u32, u32)> = Vec::with_capacity(row.fields.len());
            for field in &row.fields {
                let [low, high] = *field.bits.get_ref();
                if low > high || high > 31 {
                    let message = format!("expected first and last bit up to 31, got [{low}, {high}]");
                    resolver.error(field.bits.span(), "bits", message);
                    continue;
                }
                if fields.iter().any(|(_, other_low, other_high)| low <= *other_high && *other_low <= high) {
                    resolver.error(field.bits.span(), "bits", "the field overlaps another one");
                }
                fields.push((field.name.get_ref().clone(), low, high));
            }
            dictionary.words.push(Word { name: row.name.get_ref().clone(), idn, fields });
        }
        dictionary
    }

    /// All IDNs, by number.
    pub fn idns(&self) -> &[SercosIdn] {
        &self.idns
    }

    /// The row of an IDN.
    pub fn idn(&self, idn: Idn) -> Option<&SercosIdn> {
        let at = self.idns.binary_search_by_key(&idn, |row| row.idn).ok()?;
        self.idns.get(at)
    }

    /// The word with this name.
    pub fn word(&self, name: &str) -> Option<&Word> {
        self.words.iter().find(|word| word.name == name)
    }

    /// The word that this IDN holds.
    pub fn word_of(&self, idn: Idn) -> Option<&Word> {
        self.words.iter().find(|word| word.idn == idn)
    }

    /// All words.
    pub fn words(&self) -> &[Word] {
        &self.words
    }

    /// The set of named codes with this name.
    pub fn enumeration(&self, name: &str) -> Option<&Enumeration> {
        self.enumerations.iter().find(|set| set.name == name)
    }

    /// The IDN that `key` names in a mapping.
    pub(super) fn idn_or_error(
        &self,
        key: &str,
        name: &Name,
        resolver: &mut Resolver<'_>,
    ) -> Option<&SercosIdn> {
        let idn = parse_idn(key, name, resolver)?;
        let row = self.idn(idn);
        if row.is_none() {
            resolver.error(name.span(), key, format!("expected an IDN of the dictionary, got {idn}"));
        }
        row
    }

    /// The code that `key` names in a mapping, from the enumeration `set`.
    pub(super) fn code_or_error(
        &self,
        set: &str,
        key: &str,
        name: &Name,
        resolver: &mut Resolver<'_>,
    ) -> Option<u32> {
        named_code(self.enumeration(set), set, key, name, resolver)
    }
}

fn parse_idn(key: &str, name: &Name, resolver: &mut Resolver<'_>) -> Option<Idn> {
    match name.get_ref().parse() {
        Ok(idn) => Some(idn),
        Err(error) => {
            resolver.error(name.span(), key, format!("expected an IDN, got `{}`: {error}", name.get_ref()));
            None
        }
    }
}

fn resolve_idn(row: &IdnRow, resolver: &mut Resolver<'_>) -> Option<SercosIdn> {
    const FORMATS: [(&str, IdnFormat); 6] = [
        ("binary", IdnFormat::Binary),
        ("unsigned", IdnFormat::Unsigned),
        ("signed", IdnFormat::Signed),
        ("hexadecimal", IdnFormat::Hexadecimal),
        ("text", IdnFormat::Text),
        ("idn", IdnFormat::Idn),
    ];
    const CONFIDENCES: [(&str, ()); 4] = [("high", ()), ("medium", ()), ("low", ()), ("none", ())];
    let idn = parse_idn("idn", &row.idn, resolver)?;
    let format = match &row.format {
        Some(name) => Some(resolver.word("format", name, &FORMATS)?),
        None => None,
    };
    resolver.word("confidence", &row.confidence, &CONFIDENCES)?;
    if let Some(length) = &row.length
        && ![1, 2, 4, 8].contains(length.get_ref())
    {
        resolver.error(length.span(), "length", format!("expected 1, 2, 4 or 8, got {}", length.get_ref()));
        return None;
    }
    let unit = match (&row.scaling, &row.unit) {
        (Some(scaling), None) => IdnUnit::Scaled(scaling.get_ref().clone()),
        (None, Some(unit)) => IdnUnit::Fixed { unit: unit.get_ref().clone(), decimals: row.decimals },
        (None, None) => IdnUnit::None,
        (Some(_), Some(unit)) => {
            resolver.error(unit.span(), "unit", "expected `scaling` or `unit`, got both");
            return None;
        }
    };
    Some(SercosIdn {
        idn,
        name: row.name.get_ref().clone(),
        length: row.length.as_ref().map(|length| *length.get_ref()),
        list: row.list,
        format,
        command: row.command,
        unit,
        write: row.write.clone(),
    })
}

/// All dictionaries.
#[derive(Debug, Clone, Default)]
pub struct Dictionaries {
    /// The generic model.
    pub generic: GenericDictionary,
    /// CIP Motion.
    pub cip: CipDictionary,
    /// SERCOS.
    pub sercos: SercosDictionary,
}

impl Dictionaries {
    pub(super) fn resolve(tables: &Tables, errors: &mut TableErrors) -> Self {
        Self {
            generic: GenericDictionary::resolve(&tables.generic, errors),
            cip: CipDictionary::resolve(&tables.cip, errors),
            sercos: SercosDictionary::resolve(&tables.sercos, errors),
        }
    }
}
