//! What a slave says about its errors, warnings and state: S-0-0011, S-0-0012, S-0-0095 and S-0-0390.
//!
//! S-0-0390 of the communication profile is 0xC3 and the class (A state, C command, E warning, F error), then a
//! code. The codes of states, of S-0-0127 and of the MST loss warning are public; those of communication errors
//! are not known and are here the error's bit in S-0-0014, or 1 for a lost connection.

use super::phase::{Stage, State};
use super::{Application, Diagnosis, Slave};
use crate::wire::header::Phase;
use crate::wire::idn::Idn;

impl<A: Application> Slave<A> {
    pub(super) fn communication_error(&self) -> bool {
        self.core.fault.is_some() || self.core.connection_failed
    }

    /// More than half of the permitted MST losses came in a row.
    pub(super) fn loss_warning(&self) -> bool {
        let permitted = self.core.configuration.as_ref().map_or(0, |configuration| configuration.mst_losses);
        self.losses > permitted / 2
    }

    /// S-0-0011, S-0-0012, S-0-0390 and S-0-0095.
    pub(super) fn show_diagnosis(&mut self) {
        const COMMUNICATION_ERROR: u16 = 1 << 12;
        let own = self.app.diagnosis();
        let communication = if self.communication_error() { COMMUNICATION_ERROR } else { 0 };
        let store = &mut self.core.store;
        store.set_number_of(Idn::CLASS_1_DIAGNOSTIC, i64::from(own.errors | communication));
        store.set_number_of(Idn::CLASS_2_DIAGNOSTIC, i64::from(own.warnings));
        let (number, text) = self.diagnosis_shown(&own);
        if number != self.shown {
            self.shown = number;
            let store = &mut self.core.store;
            store.set_number_of(Idn::DIAGNOSTIC_NUMBER, i64::from(number));
            store.set_data_of(Idn::DIAGNOSTIC_MESSAGE, text.as_bytes());
        }
    }

    /// The most important diagnosis of application and communication: error, warning, command, state.
    fn diagnosis_shown(&self, own: &Diagnosis) -> (u32, &'static str) {
        if own.errors != 0 {
            return (own.number, own.text);
        }
        if let Some(fault) = self.core.fault {
            let (bit, text) = fault.interface_status();
            return (0xC30F_0000 | u32::from(bit), text);
        }
        if self.core.connection_failed {
            return (0xC30F_0001, "connection lost");
        }
        if self.loss_warning() {
            return (0xC30E_4001, "MST losses");
        }
        if own.warnings != 0 {
            return (own.number, own.text);
        }
        match self.core.failed_check() {
            Some(Idn::CP3_CHECK) => return (0xC30C_0101, "invalid parameters for CP3, see S-0-0021"),
            Some(_) => return (0xC30C_0111, "invalid parameters for CP4, see S-0-0022"),
            None => {}
        }
        match self.core.state {
            State::In(Phase::CP4) if own.number != 0 => (own.number, own.text),
            State::In(Phase::CP4) => (0xC30A_0040, "CP4"),
            State::Nrt => (0xC30A_0008, "NRT"),
            State::Joining(Stage::Scan) => (0xC30A_0031, "HP1"),
            State::Joining(Stage::Setup) => (0xC30A_0032, "HP2"),
            State::In(phase) | State::Switching(phase, _) => {
                let texts = ["CP0", "CP1", "CP2", "CP3", "CP4"];
                let text = texts[usize::from(phase.0.min(4))];
                (if phase == Phase::CP4 { 0xC30A_0040 } else { 0xC30A_0000 | u32::from(phase.0) }, text)
            }
        }
    }
}
