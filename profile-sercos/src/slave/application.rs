//! What stands behind the communication of a slave: the function-specific profile.

use profile_generic::time::{DurationNs, MonotonicTime};

use super::configuration::Invalid;
use super::parameter::Store;
use super::phase::State;
use crate::wire::header::Phase;
use crate::wire::idn::Idn;
use crate::wire::svc_error::SvcError;

/// What the master does to a procedure command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Order {
    /// Set and start.
    Start,
    /// Go on after an interruption.
    Resume,
    /// Interrupt.
    Interrupt,
    /// Cancel; it is running.
    Cancel,
}

/// How far a procedure command is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Progress {
    /// Still working.
    InProcess,
    /// Finished.
    Done,
    /// Failed.
    Failed,
}

/// One communication cycle, or one master synchronisation telegram before there are cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cycle {
    /// The instant of this cycle, on the local clock.
    pub now: MonotonicTime,
    /// Time since the last call.
    pub elapsed: DurationNs,
    /// Where the slave stands.
    pub state: State,
    /// CP4, and every connection that the slave consumes delivers.
    pub connected: bool,
    /// New command values came in this cycle.
    pub fresh: bool,
}

/// What a device has to say about itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Diagnosis {
    /// S-0-0011 without the communication error.
    pub errors: u16,
    /// S-0-0012.
    pub warnings: u16,
    /// S-0-0390.
    pub number: u32,
    /// S-0-0095.
    pub text: &'static str,
}

/// The function-specific profile of a slave.
///
/// Every method is called from the slave; none may block or, once built, allocate.
pub trait Application {
    /// Adds the parameters of the profile.
    fn define(&mut self, store: &mut Store);

    /// The master is going to read the data of `idn`: brings it up to date.
    fn refresh(&mut self, idn: Idn, store: &mut Store);

    /// Judges new data of `idn`, which is within its limits.
    fn check(&self, idn: Idn, data: &[u8], store: &Store) -> Result<(), SvcError>;

    /// The data of `idn` has changed over the service channel.
    fn written(&mut self, idn: Idn, store: &mut Store);

    /// The master's order to a procedure command.
    fn order(&mut self, idn: Idn, order: Order, store: &mut Store) -> Result<Progress, SvcError>;

    /// How far a procedure command is that was in process.
    fn progress(&mut self, idn: Idn, store: &mut Store) -> Progress;

    /// Judges the parameters of the profile before `phase`, CP3 or CP4, is entered.
    fn check_phase(&self, phase: Phase, store: &Store, invalid: &mut Invalid);

    /// A cycle: command values are in the store, feedback values are due there.
    fn cycle(&mut self, cycle: Cycle, store: &mut Store);

    /// Errors, warnings and the diagnosis to show.
    fn diagnosis(&self) -> Diagnosis;

    /// Resets class 1 errors whose cause is gone (S-0-0099). Returns whether none is left.
    fn reset(&mut self, store: &mut Store) -> bool;
}
