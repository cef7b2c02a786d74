//! The generic drive state machine (basic drive functional element).
//!
//! [`DriveState::next`] is the whole machine as a pure function; [`BasicDrive`] keeps the state and the
//! conditions together so that neither can be forgotten.
//!
//! ```text
//!                  no torque                                     torque possible
//!   +---------------------------------------------+   +----------------------------------+
//!   |  NotReady --> AwaitingPower --> Ready ------|-->| Starting --> Operating           |
//!   |     ^   \          ^             ^  |       |   |     |   \--> Testing             |
//!   |     |    \---------+--> Inhibited<--+       |   |     |            |               |
//!   |     +--- by what the drive reports ---+     |   |     v            v               |
//!   |  Shutdown (latched)                   ^     |<--|  Stopping <------+               |
//!   |  Faulted  (latched) <-----------------|-----|---|  FaultReaction <- any of these   |
//!   +---------------------------------------------+   +----------------------------------+
//! ```
//!
//! "Standby" below is the first of these that applies: Faulted while a fault is active, Shutdown while the
//! shutdown is latched, NotReady while the drive is not initialised, AwaitingPower without power, Inhibited
//! with any inhibit, else Ready. "Idle" states are NotReady, Inhibited, AwaitingPower and Ready; "running"
//! states are Starting, Operating and Testing. A fault raised by the machine itself is written in brackets.
//!
//! ```text
//! state           event                        condition               next           action
//! Ready           Enable, Test                 standby is Ready        Starting       Enable
//! any other       Enable, Test                 (see below)             same           Reject
//! Operating       Enable                       nothing forbids it      same           Enable (ends a halt)
//! running         Disable                                              Stopping       Disable
//! running, Stopping Coast                                              Stopping       TorqueOff
//! Starting        Stop                                                 Stopping       Disable
//! Testing         Stop                                                 Stopping       Disable
//! Operating       Stop                                                 same           Halt
//! Starting,Testing TestStop, TestComplete      test active             Stopping       Disable
//! idle            Shutdown                                             Shutdown       TorqueOff, latch
//! running         Shutdown                                             Stopping       TorqueOff, latch
//! Stopping, FaultReaction  Shutdown                                    same           TorqueOff, latch
//! Faulted, Shutdown Shutdown                                           same           None, latch
//! Shutdown        ShutdownReset                                        standby        Energize, unlatch
//! Faulted         FaultReset                   drive has torque        same           Reject
//! Faulted         FaultReset                   fault still active      same           ResetFault
//! Faulted         FaultReset                   else                    standby        ResetFault
//! Faulted         FaultCleared, idle report    reset was asked for     standby        None
//! FaultReaction   FaultReset                   fault gone, halted      Stopping       Disable (ends a hold)
//! idle, Shutdown  Abort, CommandLost                                   Faulted        TorqueOff  [cause]
//! running, Stopping Abort, CommandLost                                 FaultReaction  Disable    [cause]
//! idle, Shutdown  FaultRaised                  reaction stops          Faulted        TorqueOff
//! running, Stopping FaultRaised                reaction stops          FaultReaction  by reaction
//! running         InhibitRaised                takes torque away       FaultReaction  TorqueOff  [cause]
//! Starting        InhibitRaised                any other               Stopping       Disable
//! Stopping, FaultReaction  InhibitRaised       takes torque away       same           TorqueOff
//! idle            InhibitRaised, InhibitCleared                        standby        None
//! Starting        Timeout                      [start_time_out]        FaultReaction  Disable
//! Stopping        Timeout                      [stop_time_out]         FaultReaction  TorqueOff
//! FaultReaction   Timeout                      drive is heard          Faulted        TorqueOff
//! FaultReaction   Timeout                      drive is silent         Faulted        None (ends a hold by Disable)
//! ```
//!
//! What the drive reports. F is Faulted with the action TorqueOff, R is FaultReaction with the action
//! Disable:
//!
//! ```text
//! report         idle       Shutdown  Starting    Operating,  Stopping  Fault-    Faulted
//!                                                 Testing               Reaction
//! NotReady       standby    same      F left      F left      standby   F         same
//! AwaitingPower  standby 1  same      F power     F power     standby   F         same
//! Ready          standby    same      same        F left      standby   F         same
//! Enabling       F torque   F torque  same        R left      same      same      same 2
//! Operating      F torque   F torque  Operating 3 same        same      same      same 2
//! Halted         F torque   F torque  Operating 3 same        same      same      same 2
//! Stopping       R torque   R torque  R left      R left      same      same      same
//! FaultReaction  R          R         R           R           R         same      same
//! Faulted        F          F         F           F           F         F         same
//! Silent         F south 4  F south   R south     R south     R south   same      same
//!
//! left:   left_operation        power:  power_loss
//! torque: unexpected_torque     south:  south_silence
//! ```
//!
//! 1. With the action Energize, repeated while the drive waits.
//! 2. With the action TorqueOff, \[unexpected_torque\].
//! 3. Testing when a test is active.
//! 4. But NotReady stays: a drive that was never heard is not lost.
//!
//! Enabling is no fault of an Operating drive that was told to halt and is on its way: not following is what it
//! was told, and so it is until it follows again after an enable.
//!
//! A drive that decelerates unasked is left to its controlled stop. One in its own fault reaction is told to
//! disable all the same, so that it does not find itself enabled when the reaction ends.
//!
//! "same" for a drive that is running means: unless a fault is active or the shutdown is latched, in which
//! case the machine catches up with the stop that should have come. A request that changes nothing because
//! its aim is reached already (Disable while idle) is no error and gives None; one that is not allowed gives
//! Reject.

use crate::code::named_enum;
use crate::fault::{FaultCause, Reaction};
use crate::inhibit::Inhibits;

mod basic_drive;
mod transition;

pub use basic_drive::BasicDrive;

named_enum! {
    /// The state of one drive. Each CIP Motion axis state, CiA 402 state and SERCOS ready state maps to one
    /// of them.
    #[derive(Default)]
    pub enum DriveState {
        /// The drive is not initialised, not configured, or was not heard yet.
        #[default]
        NotReady = "not_ready",
        /// The drive could run but for at least one inhibit.
        Inhibited = "inhibited",
        /// The power stage has no supply.
        AwaitingPower = "awaiting_power",
        /// Without torque; may be enabled.
        Ready = "ready",
        /// Enabled by request; the drive is building up torque.
        Starting = "starting",
        /// The drive follows its set-points.
        Operating = "operating",
        /// The drive runs one of its own tests.
        Testing = "testing",
        /// Stopping by request.
        Stopping = "stopping",
        /// Stopping because of a fault, or holding the position because of one.
        FaultReaction = "fault_reaction",
        /// Without torque; a fault is latched.
        Faulted = "faulted",
        /// Without torque; the shutdown is latched.
        Shutdown = "shutdown",
    }
}

named_enum! {
    /// What the controller asks for.
    pub enum Request {
        /// Switch the torque on and follow set-points; in a halt, go on.
        Enable = "enable",
        /// Stop and switch the torque off.
        Disable = "disable",
        /// Switch the torque off at once.
        Coast = "coast",
        /// Stop under control and keep the torque.
        Stop = "stop",
        /// Switch the torque off at once, and latch that.
        Shutdown = "shutdown",
        /// End the shutdown.
        ShutdownReset = "shutdown_reset",
        /// Acknowledge the faults.
        FaultReset = "fault_reset",
        /// Stop with a fault.
        Abort = "abort",
        /// Switch the torque on and run a test of the drive.
        Test = "test",
        /// End the test.
        TestStop = "test_stop",
    }
}

named_enum! {
    /// What the south side reports about the real drive.
    #[derive(Default)]
    pub enum Report {
        /// Not initialised or not configured; no torque.
        NotReady = "not_ready",
        /// No supply of the power stage; no torque.
        AwaitingPower = "awaiting_power",
        /// May be enabled; no torque.
        Ready = "ready",
        /// Building up torque.
        Enabling = "enabling",
        /// Following set-points.
        Operating = "operating",
        /// With torque, at standstill by request.
        Halted = "halted",
        /// Coming to a stop.
        Stopping = "stopping",
        /// Coming to a stop because of a fault.
        FaultReaction = "fault_reaction",
        /// Faulted; no torque.
        Faulted = "faulted",
        /// Nothing was heard from it: communication is lost.
        #[default]
        Silent = "silent",
    }
}

impl Report {
    /// Whether the drive says that it has torque.
    pub const fn has_torque(self) -> bool {
        matches!(self, Self::Enabling | Self::Operating | Self::Halted | Self::Stopping | Self::FaultReaction)
    }
}

named_enum! {
    /// What the machine wants done to the real drive.
    #[derive(Default)]
    pub enum Action {
        /// Nothing new.
        #[default]
        None = "none",
        /// Connect the supply of the power stage; no torque.
        Energize = "energize",
        /// Switch the torque on and follow set-points.
        Enable = "enable",
        /// Stop under control, then switch the torque off.
        Disable = "disable",
        /// Stop under control and keep the torque.
        Halt = "halt",
        /// Switch the torque off at once.
        TorqueOff = "torque_off",
        /// Clear the faults of the drive; no torque. A pulse: afterwards what [`Action::TorqueOff`] writes
        /// stands again.
        ResetFault = "reset_fault",
        /// The request is refused; nothing is done.
        Reject = "reject",
    }
}

impl Action {
    /// The place of this action in [`Action::ALL`].
    pub const fn index(self) -> usize {
        match self {
            Self::None => 0,
            Self::Energize => 1,
            Self::Enable => 2,
            Self::Disable => 3,
            Self::Halt => 4,
            Self::TorqueOff => 5,
            Self::ResetFault => 6,
            Self::Reject => 7,
        }
    }
}

/// Something that happened to the state machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Event {
    /// The controller asks for something.
    Request(Request),
    /// The drive reports; may be repeated in every cycle.
    Report(Report),
    /// An inhibit appeared; [`Conditions::inhibits`] holds all of them.
    InhibitRaised,
    /// An inhibit went away; [`Conditions::inhibits`] holds those that are left.
    InhibitCleared,
    /// A fault became active; [`Conditions::reaction`] holds what it requires.
    FaultRaised,
    /// The last active fault went away. It stays latched until it is reset.
    FaultCleared,
    /// The drive's test ended by itself.
    TestComplete,
    /// Set-points from the controller stopped coming, or cannot be trusted.
    CommandLost,
    /// Starting, Stopping or FaultReaction takes longer than the configured limit.
    Timeout,
}

impl Event {
    /// Every event.
    pub fn all() -> impl Iterator<Item = Self> {
        let requests = Request::ALL.iter().copied().map(Self::Request);
        let reports = Report::ALL.iter().copied().map(Self::Report);
        let others = [
            Self::InhibitRaised,
            Self::InhibitCleared,
            Self::FaultRaised,
            Self::FaultCleared,
            Self::TestComplete,
            Self::CommandLost,
            Self::Timeout,
        ];
        requests.chain(reports).chain(others)
    }
}

/// What a transition depends on besides state and event: everything as it is after the event.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Conditions {
    /// What keeps the axis from starting.
    pub inhibits: Inhibits,
    /// Whether a shutdown is latched.
    pub shutdown_latched: bool,
    /// Whether a fault that stops the axis is present now, as opposed to latched.
    pub fault_active: bool,
    /// The strongest reaction that an active fault requires.
    pub reaction: Reaction,
    /// Whether a test was asked for and has not ended.
    pub test_active: bool,
    /// Whether the power stage has its supply.
    pub power: bool,
    /// Whether the drive is heard and initialised: its last report is neither NotReady nor Silent.
    pub initialised: bool,
    /// Whether the drive's last report is Halted.
    pub halted: bool,
    /// Whether the drive's last report says that it has torque, see [`Report::has_torque`].
    pub torque: bool,
    /// Whether the drive was told to halt and has not followed set-points since it was told to go on.
    pub halting: bool,
    /// Whether a fault reset was asked for and not yet answered.
    pub reset_pending: bool,
}

/// Where the machine goes and what has to be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transition {
    /// The next state.
    pub next: DriveState,
    /// What to do to the real drive.
    pub action: Action,
    /// The fault that this transition itself is, to be latched and reported.
    pub fault: Option<FaultCause>,
    /// Whether to latch (`true`) or unlatch (`false`) the shutdown.
    pub shutdown: Option<bool>,
}

#[cfg(test)]
mod tests;
