//! Which row of its table made a value of a drive, whatever its profile. Rows are looked up by name once and kept.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use profile_generic::fault::FaultCause;
use profile_generic::image::Signal;
use profile_generic::mode::{ModeSelection, OperatingMode};
use profile_generic::parameter::Parameter;
use profile_generic::state::{Action, DriveState};

use super::stage::{Behind, StageAxis};
use super::tree::Row;
use crate::mapping::{Cia402Dictionary, Item, Mapping, Object, Origin};

/// Rows that are kept of an axis: status words with a counter in them have many.
const KEPT_MAX: usize = 1024;

/// What a row was looked up by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Key {
    Cyclic(Signal),
    Signal(Signal),
    ControlMode(OperatingMode),
    Mode(ModeSelection),
    State(DriveState),
    Report(u32),
    Action(Action, u32),
}

/// Rows of an axis that were looked up before.
#[derive(Debug, Default)]
pub struct RowCache(Mutex<HashMap<Key, Option<Row>>>);

/// A copy of an axis may get other tables.
impl Clone for RowCache {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl RowCache {
    fn get(&self, key: Key, find: impl FnOnce() -> Option<Origin>) -> Option<Row> {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.len() >= KEPT_MAX {
            kept.clear();
        }
        kept.entry(key).or_insert_with(|| find().map(Row::from)).clone()
    }
}

/// Rows, looked up once.
impl StageAxis {
    pub(super) fn cyclic_row(&self, mapping: &Mapping, signal: Signal) -> Option<Row> {
        self.rows.get(Key::Cyclic(signal), || mapping.cyclic_row(signal))
    }

    pub(super) fn control_mode_row(&self, mapping: &Mapping, mode: OperatingMode) -> Option<Row> {
        self.rows.get(Key::ControlMode(mode), || mapping.control_mode_row(mode))
    }

    pub(super) fn state_row(&self, mapping: &Mapping, state: DriveState) -> Option<Row> {
        self.rows.get(Key::State(state), || mapping.state_row(state))
    }

    pub(super) fn signal_row(&self, mapping: &Mapping, signal: Signal) -> Option<Row> {
        self.rows.get(Key::Signal(signal), || self.find_signal_row(mapping, signal))
    }

    pub(super) fn mode_row(&self, mapping: &Mapping, selection: ModeSelection) -> Option<Row> {
        self.rows.get(Key::Mode(selection), || self.find_mode_row(mapping, selection))
    }

    /// `status` is what the drive has shown.
    pub(super) fn action_row(&self, mapping: &Mapping, action: Action, status: u32) -> Option<Row> {
        self.rows.get(Key::Action(action, status), || self.find_action_row(mapping, action, status))
    }

    pub(super) fn report_row(&self, mapping: &Mapping, status: u32) -> Option<Row> {
        self.rows.get(Key::Report(status), || self.find_report_row(mapping, status))
    }
}

impl StageAxis {
    /// The tables that count for the drive.
    fn tables<'m>(&self, mapping: &'m Mapping) -> &'m Mapping {
        match &self.behind {
            Behind::Can(drive) => mapping.of_drive(&drive.facts),
            Behind::Sercos(_) | Behind::Devicenet(_) => mapping,
        }
    }

    pub(super) fn find_signal_row(&self, mapping: &Mapping, signal: Signal) -> Option<Origin> {
        let mapping = self.tables(mapping);
        match &self.behind {
            Behind::Sercos(_) => mapping.signal_row(signal),
            Behind::Devicenet(drive) => drive.is_motion().then(|| mapping.cyclic_row(signal))?,
            Behind::Can(_) => {
                let mut fields = self.south.command_fields().chain(self.south.feedback_fields());
                let (_, item) = fields.find(|(field, _)| field.signal == signal)?;
                let Item::Object(object) = item else { return None };
                let index = Cia402Dictionary::on_first_axis(object.index);
                mapping.object_signal_row(signal, Object { index, ..object })
            }
        }
    }

    pub(super) fn find_mode_row(&self, mapping: &Mapping, selection: ModeSelection) -> Option<Origin> {
        let mapping = self.tables(mapping);
        match &self.behind {
            Behind::Sercos(_) => mapping.mode_row(selection),
            Behind::Devicenet(_) => mapping.control_mode_row(selection.mode),
            Behind::Can(_) => {
                let told = self.south.control(Action::None, selection, 0, 0);
                mapping.object_mode_row(selection, self.south.mode_octet(told)?)
            }
        }
    }

    pub(super) fn find_action_row(&self, mapping: &Mapping, action: Action, status: u32) -> Option<Origin> {
        let mapping = self.tables(mapping);
        match &self.behind {
            Behind::Sercos(_) => mapping.action_row(action),
            Behind::Can(_) => mapping.object_action_row(action, status),
            // What is asked for has its row by the code of the request.
            Behind::Devicenet(_) => None,
        }
    }

    pub(super) fn find_report_row(&self, mapping: &Mapping, status: u32) -> Option<Origin> {
        let mapping = self.tables(mapping);
        match &self.behind {
            Behind::Sercos(drive) => mapping.report_row(status, drive.silent),
            Behind::Can(drive) => mapping.object_report_row(self.known(status), &drive.needs),
            Behind::Devicenet(drive) => {
                let [code, ..] = status.to_le_bytes();
                drive.is_motion().then(|| mapping.axis_state_row(code))?
            }
        }
    }

    pub(super) fn status_rows(&self, mapping: &Mapping, status: u32, words: &[(Item, u32)]) -> Vec<Origin> {
        let mapping = self.tables(mapping);
        match &self.behind {
            Behind::Sercos(drive) => mapping.status_rows(status, words, drive.silent),
            Behind::Devicenet(_) => Vec::new(),
            Behind::Can(drive) => {
                let first = |item: &Item| match *item {
                    Item::Object(object) => {
                        Item::object(Cia402Dictionary::on_first_axis(object.index), object.sub)
                    }
                    item => item,
                };
                let words: Vec<_> = words.iter().map(|(item, word)| (first(item), *word)).collect();
                mapping.object_status_rows(self.known(status), &words, &drive.needs)
            }
        }
    }

    /// A status without a mode of operation that the axis does not use: no row counts for it.
    fn known(&self, status: u32) -> u32 {
        if self.south.mode(status).is_some() { status } else { status & 0xFFFF }
    }

    pub(super) fn fault_row(
        &self,
        mapping: &Mapping,
        item: Item,
        word: u32,
        cause: FaultCause,
    ) -> Option<Origin> {
        let mapping = self.tables(mapping);
        match item {
            Item::Idn(idn) => mapping.fault_row(idn, word, cause),
            Item::Object(_) => mapping.object_fault_row(word),
            Item::Attribute(_) => None,
        }
    }

    pub(super) fn parameter_row(&self, mapping: &Mapping, parameter: Parameter) -> Option<Origin> {
        let mapping = self.tables(mapping);
        match &self.behind {
            Behind::Sercos(_) => mapping.parameter_row(parameter),
            Behind::Can(_) => mapping.object_parameter_row(parameter),
            // The program of a drive on DeviceNet has none.
            Behind::Devicenet(_) => None,
        }
    }
}
