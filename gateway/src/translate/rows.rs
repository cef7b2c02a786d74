//! Which row of its table made a value of a drive, whatever its profile.

use profile_generic::fault::FaultCause;
use profile_generic::image::Signal;
use profile_generic::mode::ModeSelection;
use profile_generic::parameter::Parameter;
use profile_generic::state::Action;

use super::stage::{Behind, StageAxis};
use crate::mapping::{Cia402Dictionary, Item, Mapping, Object, Origin};

impl StageAxis {
    /// The tables that count for the drive.
    fn tables<'m>(&self, mapping: &'m Mapping) -> &'m Mapping {
        match &self.behind {
            Behind::Can(drive) => mapping.of_drive(&drive.facts),
            Behind::Sercos(_) | Behind::Devicenet(_) => mapping,
        }
    }

    pub(super) fn signal_row(&self, mapping: &Mapping, signal: Signal) -> Option<Origin> {
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

    pub(super) fn mode_row(&self, mapping: &Mapping, selection: ModeSelection) -> Option<Origin> {
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

    /// `status` is what the drive has shown.
    pub(super) fn action_row(&self, mapping: &Mapping, action: Action, status: u32) -> Option<Origin> {
        let mapping = self.tables(mapping);
        match &self.behind {
            Behind::Sercos(_) => mapping.action_row(action),
            Behind::Can(_) => mapping.object_action_row(action, status),
            // What is asked for has its row by the code of the request.
            Behind::Devicenet(_) => None,
        }
    }

    pub(super) fn report_row(&self, mapping: &Mapping, status: u32) -> Option<Origin> {
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
