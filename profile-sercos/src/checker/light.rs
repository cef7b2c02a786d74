//! A light application for tests with many slaves.

use crate::slave::Application;
use crate::slave::application::{Cycle, Diagnosis, Order, Progress};
use crate::slave::configuration::Invalid;
use crate::slave::parameter::{Cyclic, Definition, Store};
use crate::wire::header::Phase;
use crate::wire::idn::Idn;
use crate::wire::svc_error::SvcError;

/// A profile with a velocity that follows its command value, and a parameter that CP4 needs.
#[derive(Debug, Default)]
pub(crate) struct Mirror {
    /// The parameters of the profile are not acceptable for this phase.
    pub(crate) refuses: Option<Phase>,
}

pub(crate) const COMMAND: Idn = Idn::standard(36);
pub(crate) const FEEDBACK: Idn = Idn::standard(40);
pub(crate) const MODE: Idn = Idn::standard(32);

impl Application for Mirror {
    fn define(&mut self, store: &mut Store) {
        let signed = 0x0022_0001;
        store.define(Definition::value(COMMAND, signed, "velocity command value", 0).cyclic(Cyclic::Command));
        store.define(
            Definition::value(FEEDBACK, signed, "velocity feedback value", 0).cyclic(Cyclic::Feedback),
        );
        store.define(Definition::value(MODE, 0x4001_0001, "primary operation mode", 0).range(0, 10).busy(5));
    }

    fn refresh(&mut self, _: Idn, _: &mut Store) {}

    fn check(&self, _: Idn, _: &[u8], _: &Store) -> Result<(), SvcError> {
        Ok(())
    }

    fn written(&mut self, _: Idn, _: &mut Store) {}

    fn order(&mut self, _: Idn, _: Order, _: &mut Store) -> Result<Progress, SvcError> {
        Ok(Progress::Done)
    }

    fn progress(&mut self, _: Idn, _: &mut Store) -> Progress {
        Progress::Done
    }

    fn check_phase(&self, phase: Phase, _: &Store, invalid: &mut Invalid) {
        if self.refuses == Some(phase) {
            invalid.push(MODE);
        }
    }

    fn cycle(&mut self, cycle: Cycle, store: &mut Store) {
        let (Some(command), Some(feedback)) = (store.find(COMMAND), store.find(FEEDBACK)) else { return };
        let value = if cycle.connected { store.number(command) } else { 0 };
        store.set_number(feedback, value);
    }

    fn diagnosis(&self) -> Diagnosis {
        Diagnosis::default()
    }

    fn reset(&mut self, _: &mut Store) -> bool {
        true
    }
}
