//! The state of a slave that the service channel and the cycle share.

use arrayvec::ArrayVec;
use profile_generic::time::MonotonicTime;

use super::application::{Application, Order, Progress};
use super::communication;
use super::configuration::{Configuration, Invalid, resolve};
use super::connection::ConsumerState;
use super::parameter::{Handle, Store};
use super::phase::{Conditions, Fault, State};
use super::service_channel::Host;
use crate::wire::data_status::{CommandState, DataStatus};
use crate::wire::device_control::DeviceControl;
use crate::wire::header::Phase;
use crate::wire::idn::Idn;
use crate::wire::procedure::ProcedureControl;
use crate::wire::svc_error::SvcError;

/// Procedure commands that can be in process at the same time.
pub const COMMANDS_MAX: usize = 16;
/// First data block of the communication profile.
const COMMUNICATION_BLOCKS: u16 = 1000;

/// Everything of a slave but its application and service channel.
#[derive(Debug)]
pub struct Core {
    pub(super) store: Store,
    pub(super) state: State,
    pub(super) conditions: Conditions,
    pub(super) configuration: Option<Configuration>,
    pub(super) fault: Option<Fault>,
    /// Procedure commands in process.
    running: ArrayVec<Handle, COMMANDS_MAX>,
    /// Procedure commands that have ended and are not cancelled yet; they hold the command change bit.
    ended: ArrayVec<Handle, COMMANDS_MAX>,
    /// A connection failed; reset by S-0-0099.
    pub(super) connection_failed: bool,
    pub(super) last_mst: MonotonicTime,
    pub(super) device_control: DeviceControl,
    invalid: Invalid,
}

impl Core {
    pub(super) fn new(store: Store) -> Self {
        Core {
            store,
            state: State::Nrt,
            conditions: Conditions::default(),
            configuration: None,
            fault: None,
            running: ArrayVec::new(),
            ended: ArrayVec::new(),
            connection_failed: false,
            last_mst: MonotonicTime::ZERO,
            device_control: DeviceControl::empty(),
            invalid: Invalid::default(),
        }
    }

    /// The phase whose write protections count. A slave that joins in CP4 goes through those of CP2 and CP3.
    pub(super) fn access_phase(&self) -> Phase {
        match self.state {
            State::Joining(_) if self.conditions.cp3_checked => Phase::CP3,
            State::Joining(_) => Phase::CP2,
            state => state.phase().unwrap_or(Phase::CP0),
        }
    }

    /// Forgets commands: a phase start. What they have left behind in the application ends.
    pub(super) fn clear_commands(&mut self, app: &mut impl Application) {
        while let Some(handle) = self.running.pop().or_else(|| self.ended.pop()) {
            self.store.set_status(handle, DataStatus::empty());
            self.store.set_number(handle, 0);
            let idn = self.store.get(handle).idn();
            if !is_communication(idn) {
                let _ = app.order(idn, Order::Cancel, &mut self.store);
            }
        }
    }

    /// S-DEV bit 5.
    pub(super) fn command_changed(&self) -> bool {
        !self.ended.is_empty()
    }

    /// Whether a check of this kind is what failed last, for the diagnosis.
    pub(super) fn failed_check(&self) -> Option<Idn> {
        self.ended
            .iter()
            .filter(|&&handle| self.store.get(handle).status().contains(DataStatus::ERROR))
            .map(|&handle| self.store.get(handle).idn())
            .find(|idn| matches!(*idn, Idn::CP3_CHECK | Idn::CP4_CHECK))
    }

    fn set_progress(&mut self, handle: Handle, progress: Progress) {
        let status = match progress {
            Progress::InProcess => DataStatus::SET | DataStatus::STARTED | DataStatus::BUSY,
            Progress::Done => DataStatus::SET | DataStatus::STARTED,
            Progress::Failed => DataStatus::SET | DataStatus::STARTED | DataStatus::BUSY | DataStatus::ERROR,
        };
        self.store.set_status(handle, status);
        self.running.retain(|running| *running != handle);
        self.ended.retain(|ended| *ended != handle);
        // Room is checked before a command is started.
        let list = if progress == Progress::InProcess { &mut self.running } else { &mut self.ended };
        let _ = list.try_push(handle);
    }

    /// Asks the application about the commands in process.
    pub(super) fn poll_commands(&mut self, app: &mut impl Application) {
        for index in (0..self.running.len()).rev() {
            let handle = self.running[index];
            if self.store.get(handle).status().command_state() != CommandState::InProcess {
                continue;
            }
            let idn = self.store.get(handle).idn();
            let progress = app.progress(idn, &mut self.store);
            if progress != Progress::InProcess {
                self.set_progress(handle, progress);
            }
        }
    }

    /// S-0-0127: everything that CP3 needs.
    fn check_cp3(&mut self, app: &impl Application) -> Progress {
        self.invalid = Invalid::default();
        self.configuration = resolve(&self.store, &mut self.invalid);
        app.check_phase(Phase::CP3, &self.store, &mut self.invalid);
        self.conditions.cp3_checked = self.report(Idn::INVALID_CP2) && self.configuration.is_some();
        if self.conditions.cp3_checked { Progress::Done } else { Progress::Failed }
    }

    /// S-0-0128: everything that CP4 needs.
    fn check_cp4(&mut self, app: &impl Application) -> Progress {
        self.invalid = Invalid::default();
        app.check_phase(Phase::CP4, &self.store, &mut self.invalid);
        self.conditions.cp4_checked = self.report(Idn::INVALID_CP3) && self.configuration.is_some();
        if self.conditions.cp4_checked { Progress::Done } else { Progress::Failed }
    }

    /// Writes the invalid IDNs into `list`; true if there are none.
    fn report(&mut self, list: Idn) -> bool {
        if let Some(handle) = self.store.find(list) {
            self.store.set_data(handle, &[]);
            for &idn in self.invalid.idns() {
                self.store.push_idn(handle, idn);
            }
        }
        self.invalid.idns().is_empty()
    }

    /// Starts a command of the communication profile; `None` if it is the application's.
    fn start(&mut self, idn: Idn, app: &mut impl Application) -> Option<Progress> {
        match idn {
            Idn::CP3_CHECK => Some(self.check_cp3(app)),
            Idn::CP4_CHECK => Some(self.check_cp4(app)),
            // The delay of a slave is constant: there is nothing to measure.
            Idn::DELAY_MEASURING => Some(Progress::Done),
            Idn::RESET_C1D => {
                // The cause of a communication fault is gone once the slave communicates.
                if self.state != State::Nrt {
                    self.fault = None;
                    self.store.set_number_of(Idn::INTERFACE_STATUS, 0);
                }
                self.connection_failed = false;
                for link in self.configuration.iter_mut().flat_map(|configuration| &mut configuration.links) {
                    if link.consumer.state() == ConsumerState::Error {
                        link.consumer.restart();
                    }
                }
                let reset = app.reset(&mut self.store) && self.fault.is_none();
                Some(if reset { Progress::Done } else { Progress::Failed })
            }
            _ => None,
        }
    }

    fn order(
        &mut self,
        handle: Handle,
        control: ProcedureControl,
        app: &mut impl Application,
    ) -> Result<(), SvcError> {
        let parameter = self.store.get(handle);
        let idn = parameter.idn();
        let state = parameter.status().command_state();
        let word = i64::from(control.bits());
        match (control, state) {
            (ProcedureControl::CANCEL, _) => self.cancel(handle, idn, state, app)?,
            (ProcedureControl::INTERRUPT, CommandState::InProcess) => {
                app.order(idn, Order::Interrupt, &mut self.store)?;
                self.store.set_status(handle, DataStatus::SET | DataStatus::BUSY);
            }
            (ProcedureControl::INTERRUPT, CommandState::Idle) => {
                self.store.set_status(handle, DataStatus::SET);
            }
            (ProcedureControl::INTERRUPT, _) => {}
            (ProcedureControl::EXECUTE, CommandState::Idle | CommandState::Set) => {
                let phase = self.access_phase();
                let full = self.running.len() + self.ended.len() >= COMMANDS_MAX;
                if full || parameter.attribute().write_protected(phase.0) {
                    return Err(SvcError::NOT_EXECUTABLE);
                }
                let progress = match self.start(idn, app) {
                    Some(progress) => progress,
                    None => app.order(idn, Order::Start, &mut self.store)?,
                };
                self.set_progress(handle, progress);
            }
            (ProcedureControl::EXECUTE, CommandState::Interrupted) => {
                let progress = app.order(idn, Order::Resume, &mut self.store)?;
                self.set_progress(handle, progress);
            }
            // Set and started already: nothing changes until it is cancelled.
            (ProcedureControl::EXECUTE, _) => {}
            _ => return Err(SvcError::INVALID_DATA),
        }
        self.store.set_number(handle, word);
        Ok(())
    }

    fn cancel(
        &mut self,
        handle: Handle,
        idn: Idn,
        state: CommandState,
        app: &mut impl Application,
    ) -> Result<(), SvcError> {
        match state {
            CommandState::InProcess | CommandState::Interrupted => {
                app.order(idn, Order::Cancel, &mut self.store)?;
            }
            CommandState::Idle | CommandState::Set => {}
            // It has ended; what it has left behind ends too.
            _ if !is_communication(idn) => {
                let _ = app.order(idn, Order::Cancel, &mut self.store);
            }
            _ => {}
        }
        self.running.retain(|running| *running != handle);
        self.ended.retain(|ended| *ended != handle);
        self.store.set_status(handle, DataStatus::empty());
        Ok(())
    }
}

/// The service channel's view of a slave.
pub(super) struct Access<'a, A> {
    pub(super) core: &'a mut Core,
    pub(super) app: &'a mut A,
}

impl<A: Application> Host for Access<'_, A> {
    fn store(&mut self) -> &mut Store {
        &mut self.core.store
    }

    fn phase(&self) -> Phase {
        self.core.access_phase()
    }

    fn refresh(&mut self, handle: Handle) {
        let idn = self.core.store.get(handle).idn();
        self.app.refresh(idn, &mut self.core.store);
    }

    fn write(&mut self, handle: Handle, data: &[u8]) -> Result<(), SvcError> {
        let core = &mut *self.core;
        let idn = core.store.get(handle).idn();
        let consumed = core
            .configuration
            .iter()
            .flat_map(|configuration| &configuration.links)
            .any(|link| !link.producer && link.values.iter().any(|(value, _)| *value == handle));
        if consumed && core.state.phase() == Some(Phase::CP4) {
            return Err(SvcError::CYCLIC);
        }
        communication::check(&core.store, idn, data)?;
        self.app.check(idn, data, &core.store)?;
        core.store.set_data(handle, data);
        communication::written(&mut core.store, idn);
        if core.access_phase() == Phase::CP2 && idn.block() >= COMMUNICATION_BLOCKS {
            // What has been checked is no longer what is configured.
            core.conditions.cp3_checked = false;
        }
        self.app.written(idn, &mut core.store);
        Ok(())
    }

    fn control(&mut self, handle: Handle, word: u16) -> Result<(), SvcError> {
        self.core.order(handle, ProcedureControl::from_bits_retain(word), self.app)
    }
}
/// Whether a procedure command is the slave's own and not its application's.
fn is_communication(idn: Idn) -> bool {
    matches!(idn, Idn::CP3_CHECK | Idn::CP4_CHECK | Idn::DELAY_MEASURING | Idn::RESET_C1D)
}
