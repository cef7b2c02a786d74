//! What the faults, alarms and exception actions of CIP Motion mean.

use super::cip::CipDictionary;
use super::cip_codes::resolve_sets;
use crate::finding::Findings;
use crate::finding::registry as code;
use crate::format::{CipFaultFile, ExceptionActionRow, FaultRecordRow, Name, StatusCodeRow};
use crate::load::Parsed;
use crate::resolver::Resolver;

/// What makes a fault, alarm or inhibit go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Clearing {
    /// The condition has gone.
    ConditionGone,
    /// A Fault Reset Request.
    FaultReset,
    /// A Shutdown Reset Request.
    ShutdownReset,
    /// The connection is closed or opened anew.
    ConnectionReset,
    /// Node Fault Reset in Node Control.
    NodeFaultReset,
    /// A reset or power cycle of the device.
    DeviceReset,
    /// Time passes.
    TimeOut,
}

impl Clearing {
    /// Every way with its word in the files.
    pub const NAMED: &'static [(&'static str, Self)] = &[
        ("condition_gone", Self::ConditionGone),
        ("fault_reset", Self::FaultReset),
        ("shutdown_reset", Self::ShutdownReset),
        ("connection_reset", Self::ConnectionReset),
        ("node_fault_reset", Self::NodeFaultReset),
        ("device_reset", Self::DeviceReset),
        ("time_out", Self::TimeOut),
    ];
}

/// What one type of fault or alarm means.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FaultRecord {
    /// Name of the set, of bits or of codes, that names the conditions.
    pub conditions: String,
    /// Axis Fault Type of its record.
    pub fault_type: Option<u8>,
    /// Axis Alarm Type of its record.
    pub alarm_type: Option<u8>,
    /// Whether it stays after the condition has gone.
    pub latched: bool,
    /// Whether Axis Exception Action decides what happens.
    pub configurable: bool,
    /// Whether the axis goes to Major Faulted; `None` where it depends or the standard does not say.
    pub major: Option<bool>,
    /// What clears it.
    pub cleared_by: Vec<Clearing>,
    /// What a seven-segment display shows, `##` for the code; empty when the standard has nothing.
    pub seven_segment: String,
    /// What a display of several characters shows, `##` for the code; empty when the standard has nothing.
    pub display: String,
    /// Anything worth knowing; mostly empty.
    pub note: String,
    /// Where it comes from.
    pub source: String,
}

/// What one exception action does.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExceptionAction {
    /// Value of an element of Axis Exception Action.
    pub code: u8,
    /// Its name.
    pub name: String,
    /// Whether the bit is set in Axis Exceptions.
    pub exceptions: bool,
    /// Whether the bit is set in Axis Alarms.
    pub alarms: bool,
    /// Whether the bit is set in Axis Faults.
    pub faults: bool,
    /// Whether the axis is brought to a stop.
    pub stops: bool,
}

/// A general status code of the object and where it occurs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StatusCode {
    /// General status.
    pub general: u8,
    /// Extended status, where it has one; the first of them where an index is added.
    pub extended: Option<u8>,
    /// Name of the code.
    pub name: String,
    /// Service or field it occurs in.
    pub occurs: String,
    /// Where it comes from.
    pub source: String,
}

/// Reads the file of faults into the dictionary, which has the attributes already.
pub(super) fn resolve_faults(
    file: &Parsed<CipFaultFile>,
    dictionary: &mut CipDictionary,
    errors: &mut Findings,
) {
    let mut resolver = Resolver::new(&file.text, errors);
    let rows = &file.rows;
    resolver.head(&rows.format, "profile", &rows.profile, "cip-motion");
    resolve_sets(&rows.enumeration, &rows.bits, dictionary, &mut resolver);
    for row in &rows.fault_record {
        let record = resolve_record(row, dictionary, &mut resolver);
        let same = |known: &FaultRecord| {
            (known.fault_type, known.alarm_type) == (record.fault_type, record.alarm_type)
                && known.conditions == record.conditions
        };
        if dictionary.fault_records.iter().any(same) {
            resolver.error(code::TWICE, row.conditions.span(), "conditions", "the record is defined twice");
        }
        dictionary.fault_records.push(record);
    }
    for row in &rows.exception_action {
        let Some(action) = resolve_action(row, dictionary, &mut resolver) else { continue };
        if dictionary.exception_actions.iter().any(|known| known.code == action.code) {
            resolver.error(code::TWICE, row.action.span(), "action", "the action is defined twice");
        }
        dictionary.exception_actions.push(action);
    }
    for row in &rows.status {
        let code = resolve_status(row);
        let same = |known: &StatusCode| (known.general, known.extended) == (code.general, code.extended);
        if dictionary.status_codes.iter().any(same) {
            resolver.error(code::TWICE, row.general.span(), "general", "the status is defined twice");
        }
        dictionary.status_codes.push(code);
    }
}

fn resolve_record(
    row: &FaultRecordRow,
    dictionary: &CipDictionary,
    resolver: &mut Resolver<'_>,
) -> FaultRecord {
    let sets = dictionary.bit_sets().iter().chain(dictionary.enumerations());
    let known = sets.clone().map(|set| set.name.as_str());
    let find = |text: &str| sets.clone().find(|set| set.name == text);
    resolver.name("conditions", &row.conditions, "a set of codes or bits", find, known);
    let mut byte = |set: &str, key: &str, name: &Option<Name>| {
        let code = dictionary.code_or_error(set, key, name.as_ref()?, resolver)?;
        u8::try_from(code).ok()
    };
    let fault_type = byte("Axis Fault Type", "fault_type", &row.fault_type);
    let alarm_type = byte("Axis Alarm Type", "alarm_type", &row.alarm_type);
    let ways = row.cleared_by.iter();
    FaultRecord {
        conditions: row.conditions.get_ref().clone(),
        fault_type,
        alarm_type,
        latched: row.latched,
        configurable: row.configurable,
        major: row.major,
        cleared_by: ways.filter_map(|way| resolver.word("cleared_by", way, Clearing::NAMED)).collect(),
        seven_segment: row.seven_segment.clone().unwrap_or_default(),
        display: row.display.clone().unwrap_or_default(),
        note: row.note.clone().unwrap_or_default(),
        source: row.source.get_ref().clone(),
    }
}

fn resolve_action(
    row: &ExceptionActionRow,
    dictionary: &CipDictionary,
    resolver: &mut Resolver<'_>,
) -> Option<ExceptionAction> {
    let code = dictionary.code_or_error("Axis Exception Action", "action", &row.action, resolver)?;
    Some(ExceptionAction {
        code: u8::try_from(code).ok()?,
        name: row.action.get_ref().clone(),
        exceptions: row.exceptions,
        alarms: row.alarms,
        faults: row.faults,
        stops: row.stops,
    })
}

fn resolve_status(row: &StatusCodeRow) -> StatusCode {
    StatusCode {
        general: *row.general.get_ref(),
        extended: row.extended,
        name: row.name.get_ref().clone(),
        occurs: row.occurs.clone(),
        source: row.source.get_ref().clone(),
    }
}
