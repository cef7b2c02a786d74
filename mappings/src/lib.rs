#![doc = include_str!("../README.md")]
//!
//! # Parts
//!
//! ```text
//! TOML files --load--> Tables --resolve--> Mapping --compile(axis)--> CipProgram, AttributeTable
//!  format                dictionary,              Telegram, CommissioningPlan, DriveProgram
//!                        cip_tables, sercos, cia402
//! ```
//!
//! Loading finds unknown keys and wrong types, resolving finds unknown names and units that do not convert; both report file,
//! line, column and key ([`finding`]). [`check`] finds what only the whole shows. Compiling makes flat programs for one axis;
//! what can still go wrong then lies with the axis or the drive. No translation of an attribute, IDN, object, state, mode or
//! fault is code.

mod attributes;
mod capture_program;
pub mod check;
mod cia402;
mod cip_events;
mod cip_scaling;
mod cip_tables;
mod compile_cip;
mod computed;
mod definitions;
mod device_link;
pub mod devicenet;
mod dictionary;
mod drive_program;
mod drive_rows;
mod examples;
mod feedback;
pub mod finding;
pub mod format;
mod generic_names;
mod groups;
mod item;
mod load;
mod meaning;
mod mechanics;
mod numbers;
mod origin;
mod overlay;
pub mod own_values;
mod places;
mod resolver;
mod rows;
mod sercos;
mod truth;
mod twice;

#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use profile_cip::device::attribute::AttributeDefinition;
use profile_generic::mode::ModeSelection;

pub use attributes::{AttributeEntry, AttributeTable, Backing, Number, ValueError};
pub use capture_program::{
    CAPTURES_MAX, CaptureMode, CaptureProgram, Counter, Input, Latch, Place, Sequence, Stored,
    WORDS_MAX as CAPTURE_WORDS_MAX,
};
pub use cia402::{
    Cia402Axis, Cia402Error, Cia402Tables, DriveIdentity, InterpolationPeriod, ModeWords, ObjectFacts,
    ObjectStep, Plan, VOLTAGE_BIT,
};
pub use cip_events::EventProgram;
pub use cip_scaling::{CipScaling, CipScalingError};
pub use cip_tables::{
    CipTables, CipUnit, DisplacementUnit, ExceptionRow, FeedbackChannel, FeedbackUnit, Finder, Missing,
    ScalingAttributes, SequenceAttributes, Served, ServedAttribute, Times,
};
pub use compile_cip::{
    CipConditions, CipFault, CipProgram, CipReport, CipRequest, CipState, CipStopping, CipTrackers, CipValue,
    MissingValue,
};
pub use computed::{
    Computation, Control, Fact, Known, Limit, NoValue, Operand, Operation, READS_MAX, ROWS_MAX, Read, Row,
};
pub use device_link::Told;
pub use dictionary::{
    Access, Cia402Access, Cia402Category, Cia402Class, Cia402Code, Cia402CodeSet, Cia402Dictionary,
    Cia402Kind, Cia402Object, Cia402Pdo, Cia402Range, Cia402RangeKind, Cia402SetKind, Cia402Sub, Cia402Type,
    CipAttribute, CipDictionary, CipNetwork, CipService, CipType, Clearing, Code, CodeGroup, CodeRange,
    CodeSet, Confidence, ConnectionDataFormat, DEVICE_FUNCTIONS, DataElement, Dictionaries, Document,
    Documents, ETHERNET_IP, Enumeration, ExceptionAction, FaultRecord, Field, FieldValue, GenericDictionary,
    GenericParameter, GroupKind, IdnFormat, IdnPart, IdnUnit, Layout, NamedCode, NetworkObject, Pattern,
    PolarityEffect, RangeKind, ScaledQuantity, SercosDictionary, SercosIdn, SercosTerms, SetKind, StatusCode,
    Trust, Word, networks,
};
pub use drive_program::{
    CachedStatus, DATA_MAX, DriveProgram, FaultRow, MAX_MODES, MODE_SHIFT, ModeProcedure, Order,
    ParameterEntry, Procedure, ProcedureBy, Telegram,
};
pub use drive_rows::Full;
pub use feedback::FeedbackUse;
pub use item::{Attribute, Item, Object};
pub use load::{FORMAT, MAX_FILE_BYTES, Parsed, TableText, TableTexts, Tables};
pub use mechanics::{MechanicalFact, Mechanics};
pub use numbers::{LostPrecision, RowNumbers};
pub use origin::Origin;
pub use overlay::{DrivesHead, OVERLAYS_MAX, Overlay, OverlayHead, Section, sections};
pub use places::Places;
pub use sercos::commissioning::{CommissioningPlan, Refused, Step};
use sercos::compile::Compiler;
pub use sercos::compile::{SercosAxis, SercosError};
pub use sercos::facts::{Difference, DriveFacts};
pub use sercos::fixed_connections::{FixedConnection, FixedConnections};
pub use sercos::scaling::{AxisUnits, Lsb, Rated, Reference, ScalingError, ScalingRule};
pub use sercos::tables::{ReportRule, SercosTables};
pub use truth::{AttributeTruth, ParameterPlace, Truth};

use crate::finding::{Findings, Severity};
use profile_cip::device::attribute::{DefaultValue, ElementRule};
use profile_cip::device::exception;
use profile_sercos::wire::idn::Idn;

/// Bits of Axis Exceptions.
const EXCEPTION_BITS: u8 = 64;

/// All tables, read and resolved.
#[derive(Debug, Clone)]
pub struct Mapping {
    /// What the profiles have.
    pub dictionaries: Arc<Dictionaries>,
    /// CIP Motion and the generic model.
    pub cip: Arc<CipTables>,
    /// The generic model and SERCOS.
    pub sercos: Arc<SercosTables>,
    /// The same for axes whose position is that of the load: by its velocity too, and by that of the motor.
    sercos_of_load: [Arc<SercosTables>; 2],
    /// The generic model and CiA 402.
    pub cia402: Arc<Cia402Tables>,
    /// The same for axes that only look at the encoder of the load.
    cia402_of_load: Arc<Cia402Tables>,
    tables: Tables,
    families: Vec<Family>,
}

/// CiA 402 drives that have rows of their own.
#[derive(Debug, Clone)]
pub struct Family {
    /// What they are, in words.
    pub name: String,
    vendor: u32,
    /// None: all that no other family of the vendor has.
    products: Vec<u32>,
    /// The tables with their rows.
    pub mapping: Mapping,
}

impl Mapping {
    /// The tables built into the binary.
    ///
    /// # Errors
    /// None with the tables that are shipped; a test holds that.
    pub fn embedded() -> Result<Self, Findings> {
        Self::from_texts(&TableTexts::embedded())
    }

    /// The tables in a folder; files that are not there come from the binary.
    ///
    /// # Errors
    /// Everything that is wrong with the files.
    pub fn from_folder(folder: &Path) -> Result<Self, Findings> {
        Self::from_texts(&TableTexts::from_folder(folder)?)
    }

    /// The tables in a folder, or those in the binary, and over them files or folders of files.
    ///
    /// # Errors
    /// Everything that is wrong with the files.
    pub fn load(folder: Option<&Path>, overlays: &[PathBuf]) -> Result<Self, Findings> {
        Self::from_texts(&TableTexts::load(folder, overlays)?)
    }

    /// The tables in these texts.
    ///
    /// # Errors
    /// Everything that is wrong with them.
    pub fn from_texts(texts: &TableTexts) -> Result<Self, Findings> {
        let mut findings = Findings::default();
        match Self::resolve(texts, &mut findings) {
            Some(mapping) => Ok(mapping),
            None => Err(findings),
        }
    }

    /// The dictionaries in these texts, also where a row of them is wrong; `None` where a file cannot be read into rows.
    pub fn dictionaries_of(texts: &TableTexts, findings: &mut Findings) -> Option<Dictionaries> {
        let (tables, _) = texts.parse(findings)?;
        Some(Dictionaries::resolve(&tables, findings))
    }

    /// The tables in these texts, and everything that is found in them; `None` with errors.
    pub fn resolve(texts: &TableTexts, findings: &mut Findings) -> Option<Self> {
        let mapping = Self::resolve_all(texts, findings);
        findings.settle();
        mapping.filter(|_| !findings.has_errors())
    }

    /// The same with what only follows from something else, and a mapping although something is wrong.
    fn resolve_all(texts: &TableTexts, findings: &mut Findings) -> Option<Self> {
        let (tables, families) = texts.parse(findings)?;
        let before = findings.count(Severity::Error);
        let dictionaries = Dictionaries::resolve(&tables, findings);
        let sound = findings.count(Severity::Error) == before;
        let mut mapping = Self::join(tables, Arc::new(dictionaries), sound, findings);
        if sound {
            let mut found = Findings::default();
            mapping.families =
                families.into_iter().map(|family| mapping.family(family, &mut found)).collect();
            load::extend_with_families(findings, found);
        }
        Some(mapping)
    }

    /// The mapping tables, resolved by the dictionaries, which are sound or were told not to be.
    fn join(tables: Tables, dictionaries: Arc<Dictionaries>, sound: bool, findings: &mut Findings) -> Self {
        let cip = CipTables::resolve(&tables.cip_generic, &dictionaries, findings);
        let sercos = SercosTables::resolve(&tables.generic_sercos, &dictionaries, &cip, findings);
        let of_load = [FeedbackUse::Load, FeedbackUse::Dual].map(|of| Arc::new(sercos.for_feedback(of)));
        // What is wrong with a dictionary need not be told again by every row that names it.
        let cia402 = sound.then(|| Cia402Tables::resolve(&tables.generic_cia402, &dictionaries, findings));
        let cia402 = cia402.unwrap_or_default();
        Self {
            dictionaries,
            cip: Arc::new(cip),
            sercos: Arc::new(sercos),
            sercos_of_load: of_load,
            cia402_of_load: Arc::new(cia402.for_load()),
            cia402: Arc::new(cia402),
            tables,
            families: Vec::new(),
        }
    }

    /// The same for a family of drives.
    fn family(&self, family: overlay::ParsedFamily, findings: &mut Findings) -> Family {
        let overlay::ParsedFamily { name, vendor, products, table } = family;
        let cia402 = Cia402Tables::resolve(&table, &self.dictionaries, findings);
        let (cia402_of_load, cia402) = (Arc::new(cia402.for_load()), Arc::new(cia402));
        let tables = Tables { generic_cia402: table, ..self.tables.clone() };
        Family {
            name,
            vendor,
            products,
            mapping: Self { cia402, cia402_of_load, tables, families: Vec::new(), ..self.clone() },
        }
    }

    /// The families of CiA 402 drives that have rows of their own.
    #[must_use]
    pub fn families(&self) -> &[Family] {
        &self.families
    }

    /// The family that a CiA 402 drive is of, by what its device says of itself.
    #[must_use]
    pub fn family_of(&self, identity: &DriveIdentity) -> Option<&Family> {
        let (vendor, product) = (identity.vendor?, identity.product);
        let mut own = self.families.iter().filter(|family| family.vendor == vendor);
        let named = own.clone().find(|family| product.is_some_and(|code| family.products.contains(&code)));
        named.or_else(|| own.find(|family| family.products.is_empty()))
    }

    /// The tables for a CiA 402 drive: those of its family, where it is of one.
    #[must_use]
    pub fn of_drive(&self, facts: &ObjectFacts) -> &Self {
        self.family_of(facts.identity()).map_or(self, |family| &family.mapping)
    }

    /// The same with another text of one of the mapping tables, such as `cip-generic.toml`, for all drives: for whoever
    /// tries a change. The dictionaries stay as they are.
    ///
    /// # Errors
    /// Everything that is wrong with it, and another name of a file.
    pub fn with_table(&self, file: &str, text: &str) -> Result<Self, Findings> {
        let mut findings = Findings::default();
        let table = TableText { path: file.to_owned(), text: text.to_owned() };
        let mut tables = self.tables.clone();
        match load::table_name(file) {
            "cip-generic" => {
                if let Some(parsed) = rows::parse(&table, "cip-generic", &[], &mut findings) {
                    tables.cip_generic = parsed;
                }
            }
            "generic-sercos" => {
                if let Some(parsed) = rows::parse(&table, "generic-sercos", &[], &mut findings) {
                    tables.generic_sercos = parsed;
                }
            }
            "generic-cia402" => {
                if let Some(parsed) = rows::parse(&table, "generic-cia402", &[], &mut findings) {
                    tables.generic_cia402 = parsed;
                }
            }
            _ => {
                let message = format!("expected the file of a mapping table, got `{file}`");
                findings.push_file(crate::finding::registry::STRANGER, Path::new(file), message);
            }
        }
        if findings.has_errors() {
            return Err(findings);
        }
        let mapping = Self::join(tables, Arc::clone(&self.dictionaries), true, &mut findings);
        findings.into_result(mapping)
    }

    /// The operation modes that drives have, each once, as many as a drive has places for.
    pub fn drive_modes(&self) -> impl Iterator<Item = ModeSelection> + '_ {
        self.sercos.modes.iter().map(|rule| rule.selection).take(MAX_MODES)
    }

    /// The rows as they stand in the files, with their places.
    pub fn tables(&self) -> &Tables {
        &self.tables
    }

    /// The program of an axis on the CIP side. `None` when a ratio of the scaling does not fit 64 bits.
    pub fn cip_program(&self, scaling: &CipScaling) -> Option<CipProgram> {
        CipProgram::compile(&self.cip, scaling)
    }

    /// Default and range of each element of Axis Exception Action, or of that of the manufacturer: an exception that nobody
    /// finds, neither the box nor a drive by its table, is Unsupported.
    pub fn exception_rules(&self, manufacturer: bool) -> Vec<ElementRule> {
        let rows = |bit: u8| {
            let found = |cause| self.sercos.faults.iter().any(|row| row.cause == cause);
            let exceptions = self.cip.exceptions.iter();
            exceptions.filter(move |row| {
                row.manufacturer == manufacturer
                    && row.bit == bit
                    && (row.found_by.is_some() || found(row.cause))
            })
        };
        let rule = |bit| {
            let unsupported = exception::ExceptionAction::UNSUPPORTED.0;
            // Where several causes share a bit, the strictest counts.
            let default = rows(bit).map(|row| row.default).max().unwrap_or(unsupported);
            let least = rows(bit).map(|row| row.least).max().unwrap_or(unsupported);
            let most =
                if least == unsupported { unsupported } else { exception::ExceptionAction::MAJOR_FAULT.0 };
            let range = (f64::from(least), f64::from(most));
            // A controller whose profile lacks an exception says 255 for it, whatever the device has.
            ElementRule {
                default: DefaultValue::Integer(i64::from(default)),
                range,
                keeps: Some(unsupported),
            }
        };
        (0..EXCEPTION_BITS).map(rule).collect()
    }

    /// Bits of Axis Exceptions that the box, the device or a drive finds.
    pub fn raised_exceptions(&self) -> impl Iterator<Item = u8> + '_ {
        let by_drive = |cause| {
            let rows = self.sercos.faults.iter().map(|row| row.cause);
            rows.chain(self.cia402.faults().iter().map(|row| row.cause)).any(|known| known == cause)
        };
        let rows = self.cip.exceptions.iter().filter(|row| !row.manufacturer);
        rows.filter(move |row| row.found_by.is_some() || by_drive(row.cause)).map(|row| row.bit)
    }

    /// The attributes of an axis. `None` when a ratio of the scaling does not fit 64 bits.
    pub fn attribute_table(&self, scaling: &CipScaling) -> Option<AttributeTable> {
        AttributeTable::compile(&self.cip, scaling)
    }

    /// Room for the attributes of an axis whose scaling changes in operation; empty until [`Mapping::refill_attributes`].
    pub fn attribute_room(&self) -> AttributeTable {
        AttributeTable::with_room(&self.cip)
    }

    /// Makes the attributes in another scaling in a table of [`Mapping::attribute_room`], without allocating. `None`, and nothing done,
    /// when a ratio of the scaling does not fit 64 bits.
    pub fn refill_attributes(&self, table: &mut AttributeTable, scaling: &CipScaling) -> Option<()> {
        table.refill(&self.cip, scaling)
    }

    /// What the device has to know of its attributes, those of the class included. `None` when a ratio of the scaling
    /// does not fit 64 bits.
    pub fn attribute_definitions(&self, scaling: &CipScaling) -> Option<Vec<AttributeDefinition>> {
        Some(definitions::definitions(self, &self.attribute_table(scaling)?))
    }

    /// The tables for a CiA 402 axis, by the encoder that it goes by.
    fn cia402_of(&self, axis: &Cia402Axis) -> &Cia402Tables {
        if axis.only_looks && axis.feedback != FeedbackUse::Motor {
            &self.cia402_of_load
        } else {
            &self.cia402
        }
    }

    /// The tables for a SERCOS axis, by the encoders that it goes by.
    fn sercos_of(&self, axis: &SercosAxis) -> &SercosTables {
        let [load, dual] = &self.sercos_of_load;
        match axis.feedback {
            FeedbackUse::Motor => &self.sercos,
            FeedbackUse::Load => load,
            FeedbackUse::Dual => dual,
        }
    }

    /// What the telegrams of an axis carry, as far as `facts` are known.
    ///
    /// # Errors
    /// A mode has no row, the drive lacks a value that it must have, or a length is not known.
    pub fn telegram(&self, axis: &SercosAxis, facts: &DriveFacts) -> Result<Telegram, SercosError> {
        Telegram::compile(self.sercos_of(axis), &self.dictionaries.sercos, axis, facts)
    }

    /// The connections of a drive of class SCP_FixCFG, as it has said them; `None` of a drive that takes others.
    ///
    /// # Errors
    /// They lack the control or the status word, or contradict themselves.
    pub fn fixed_connections(&self, facts: &DriveFacts) -> Result<Option<FixedConnections>, SercosError> {
        FixedConnections::of(&self.sercos, facts)
    }

    /// The steps of commissioning in a phase. Parameters are converted by the scaling that `facts` hold by
    /// then.
    ///
    /// # Errors
    /// A mode has no row, or a value does not fit the drive.
    pub fn commissioning(
        &self,
        axis: &SercosAxis,
        phase: u8,
        facts: &DriveFacts,
    ) -> Result<CommissioningPlan, SercosError> {
        CommissioningPlan::compile(self.sercos_of(axis), &self.dictionaries.sercos, axis, phase, facts)
    }

    /// The program of an axis on the SERCOS side, once its drive has reported its scaling.
    ///
    /// # Errors
    /// As [`Mapping::telegram`], and when the scaling was not read or has no row.
    pub fn sercos_program(&self, axis: &SercosAxis, facts: &DriveFacts) -> Result<DriveProgram, SercosError> {
        DriveProgram::compile(self.sercos_of(axis), &self.dictionaries.sercos, axis, facts)
    }

    /// The IDNs that commissioning writes into the drive of an axis, by number.
    #[must_use]
    pub fn sercos_written(&self, axis: &SercosAxis) -> Vec<Idn> {
        self.sercos_of(axis).written(axis)
    }

    /// The objects that commissioning writes into the drive of an axis, by number, as they are on the device.
    #[must_use]
    pub fn cia402_written(&self, axis: &Cia402Axis) -> Vec<Object> {
        let of_axis = |object: Object| match axis.item(object)? {
            Item::Object(object) => Some(object),
            Item::Idn(_) | Item::Attribute(_) => None,
        };
        self.cia402_of(axis).written(axis).into_iter().filter_map(of_axis).collect()
    }

    /// What is asked of a CiA 402 drive at start, or told to it.
    ///
    /// # Errors
    /// A mode is not there, or a value does not fit the drive.
    pub fn cia402_steps(
        &self,
        plan: Plan,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
    ) -> Result<Vec<ObjectStep>, Cia402Error> {
        self.cia402_of(axis).steps(plan, axis, facts)
    }

    /// What has to be tried of a CiA 402 drive that does not report its modes of operation; `None` where it does, or where the
    /// configuration reports them, which is noted.
    #[must_use]
    pub fn cia402_modes_untold(&self, axis: &Cia402Axis, facts: &mut ObjectFacts) -> Option<ModeWords> {
        self.cia402_of(axis).modes_untold(axis, facts)
    }

    /// Operating modes that an axis does without, because its SERCOS drive lacks something, and what.
    #[must_use]
    pub fn sercos_modes_left_out(
        &self,
        axis: &SercosAxis,
        facts: &DriveFacts,
    ) -> Vec<(ModeSelection, SercosError)> {
        let compiler =
            Compiler { tables: self.sercos_of(axis), dictionary: &self.dictionaries.sercos, axis, facts };
        compiler.modes().map(|modes| modes.left_out).unwrap_or_default()
    }

    /// Operating modes that an axis does without, because its CiA 402 drive lacks something, and what.
    #[must_use]
    pub fn cia402_modes_left_out(
        &self,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
    ) -> Vec<(ModeSelection, Cia402Error)> {
        self.cia402_of(axis).modes_left_out(axis, facts)
    }

    /// The time between set-points that a CiA 402 drive expects, where it is another one than the cycle.
    #[must_use]
    pub fn cia402_other_period(&self, axis: &Cia402Axis, facts: &ObjectFacts) -> Option<InterpolationPeriod> {
        self.cia402_of(axis).other_period(axis, facts)
    }

    /// Notes that a CiA 402 drive has these modes of operation and no others.
    pub fn cia402_has_modes(&self, facts: &mut ObjectFacts, codes: impl Iterator<Item = i8>) {
        self.cia402.has_modes(facts, codes);
    }

    /// What the telegrams of an axis carry at most, of a CiA 402 drive that lacks nothing.
    ///
    /// # Errors
    /// A mode has no row.
    pub fn cia402_telegram(&self, axis: &Cia402Axis) -> Result<Telegram, Cia402Error> {
        self.cia402_of(axis).telegram_room(axis)
    }

    /// The program of an axis on the CiA 402 side, once its drive was asked.
    ///
    /// # Errors
    /// The drive lacks a mode or a value that it must have, or nobody says what its counts are.
    pub fn cia402_program(
        &self,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
    ) -> Result<DriveProgram, Cia402Error> {
        self.cia402_of(axis).program(axis, facts)
    }

    /// Runs every worked example of the tables.
    ///
    /// Returns how many there are; an example whose numbers do not come out is a finding.
    pub fn run_examples(&self, findings: &mut Findings) -> usize {
        examples::run(self, &self.tables, findings)
    }
}
