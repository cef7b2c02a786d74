//! The transition function. The table it follows stands above [`super::DriveState`].

use super::{Action, Conditions, DriveState, Event, Report, Request, Transition};
use crate::fault::{FaultCause, Reaction};
use crate::inhibit::Inhibits;

impl Transition {
    const fn to(next: DriveState, action: Action) -> Self {
        Self { next, action, fault: None, shutdown: None }
    }

    const fn because(self, cause: FaultCause) -> Self {
        Self { fault: Some(cause), ..self }
    }

    const fn latching(self) -> Self {
        Self { shutdown: Some(true), ..self }
    }
}

impl Conditions {
    /// The state of a drive without torque: by precedence of fault, shutdown, initialisation, power and
    /// inhibits.
    pub const fn standby(&self) -> DriveState {
        if self.fault_active {
            DriveState::Faulted
        } else if self.shutdown_latched {
            DriveState::Shutdown
        } else if !self.initialised {
            DriveState::NotReady
        } else if !self.power {
            DriveState::AwaitingPower
        } else if !self.inhibits.is_empty() {
            DriveState::Inhibited
        } else {
            DriveState::Ready
        }
    }

    /// These conditions with what a report says. A report can only take the supply away: that there is one
    /// has to be known already.
    const fn with_report(self, report: Report) -> Self {
        let initialised = !matches!(report, Report::NotReady | Report::Silent);
        let power = self.power && !matches!(report, Report::AwaitingPower);
        let fault_active = self.fault_active || matches!(report, Report::Faulted | Report::FaultReaction);
        let halted = matches!(report, Report::Halted);
        Self { initialised, power, fault_active, halted, torque: report.has_torque(), ..self }
    }

    /// The cause to report for an inhibit that takes the torque away.
    const fn removal_cause(&self) -> FaultCause {
        if self.inhibits.contains(Inhibits::SAFETY) {
            FaultCause::SAFE_TORQUE_OFF
        } else if self.inhibits.contains(Inhibits::NO_POWER) {
            FaultCause::POWER_LOSS
        } else if self.inhibits.contains(Inhibits::HARDWARE_ENABLE) {
            FaultCause::ENABLE_INPUT_LOST
        } else {
            FaultCause::COMMUTATION
        }
    }
}

impl DriveState {
    /// Whether the machine may have switched the torque on.
    pub const fn may_have_torque(self) -> bool {
        matches!(
            self,
            Self::Starting | Self::Operating | Self::Testing | Self::Stopping | Self::FaultReaction
        )
    }

    /// Whether the drive is starting, or follows set-points or a test.
    pub const fn is_running(self) -> bool {
        matches!(self, Self::Starting | Self::Operating | Self::Testing)
    }

    /// Whether the drive stands by without anything latched.
    pub const fn is_idle(self) -> bool {
        matches!(self, Self::NotReady | Self::Inhibited | Self::AwaitingPower | Self::Ready)
    }

    /// The transition for an event under conditions; see the table in the module documentation.
    pub const fn next(self, event: Event, conditions: &Conditions) -> Transition {
        match event {
            Event::Request(request) => self.on_request(request, conditions),
            Event::Report(report) => self.on_report(report, &conditions.with_report(report)),
            Event::InhibitRaised => self.on_inhibit_raised(conditions),
            Event::InhibitCleared if self.is_idle() => self.stand_by(conditions),
            Event::InhibitCleared => self.stay(),
            Event::FaultRaised => self.on_fault_raised(conditions),
            Event::FaultCleared => self.after_reset(conditions),
            Event::TestComplete => self.end_test(conditions, Action::None),
            Event::CommandLost => self.fail(FaultCause::COMMAND_LOST),
            Event::Timeout => self.on_timeout(conditions),
        }
    }

    const fn stay(self) -> Transition {
        Transition::to(self, Action::None)
    }

    const fn reject(self) -> Transition {
        Transition::to(self, Action::Reject)
    }

    /// Settles a drive without torque where the conditions put it.
    const fn stand_by(self, conditions: &Conditions) -> Transition {
        let next = conditions.standby();
        let action = match next {
            Self::AwaitingPower => Action::Energize,
            Self::Faulted | Self::Shutdown => Action::TorqueOff,
            _ => Action::None,
        };
        Transition::to(next, action)
    }

    /// Goes to the stop that a fault of this cause requires when no reaction is configured for it.
    const fn fail(self, cause: FaultCause) -> Transition {
        if self.is_idle() || matches!(self, Self::Shutdown) {
            Transition::to(Self::Faulted, Action::TorqueOff).because(cause)
        } else if self.is_running() || matches!(self, Self::Stopping) {
            Transition::to(Self::FaultReaction, Action::Disable).because(cause)
        } else {
            self.stay()
        }
    }

    // Flat: the table of the module, one arm per row.
    const fn on_request(self, request: Request, conditions: &Conditions) -> Transition {
        match request {
            Request::Enable | Request::Test => self.on_enable(request, conditions),
            Request::Disable if self.is_running() => Transition::to(Self::Stopping, Action::Disable),
            Request::Disable => self.stay(),
            Request::Coast if self.is_running() || matches!(self, Self::Stopping) => {
                Transition::to(Self::Stopping, Action::TorqueOff)
            }
            Request::Coast => self.stay(),
            Request::Stop => match self {
                Self::Operating => Transition::to(Self::Operating, Action::Halt),
                Self::Starting | Self::Testing => Transition::to(Self::Stopping, Action::Disable),
                _ => self.stay(),
            },
            Request::Shutdown if self.is_idle() => {
                Transition::to(Self::Shutdown, Action::TorqueOff).latching()
            }
            Request::Shutdown if self.is_running() => {
                Transition::to(Self::Stopping, Action::TorqueOff).latching()
            }
            // Category 0 at once, also out of a stop under way (Volume 9, attribute 629).
            Request::Shutdown if self.may_have_torque() => Transition::to(self, Action::TorqueOff).latching(),
            Request::Shutdown => self.stay().latching(),
            Request::ShutdownReset => self.on_shutdown_reset(conditions),
            Request::FaultReset => self.on_fault_reset(conditions),
            Request::Abort => self.fail(FaultCause::CONTROLLER_ABORT),
            Request::TestStop => self.end_test(conditions, Action::Reject),
        }
    }

    const fn on_enable(self, request: Request, conditions: &Conditions) -> Transition {
        match (self, request) {
            (Self::Ready, _) if matches!(conditions.standby(), Self::Ready) && !conditions.torque => {
                Transition::to(Self::Starting, Action::Enable)
            }
            (Self::Operating, Request::Enable) if matches!(conditions.standby(), Self::Ready) => {
                Transition::to(Self::Operating, Action::Enable)
            }
            _ => self.reject(),
        }
    }

    const fn on_shutdown_reset(self, conditions: &Conditions) -> Transition {
        match self {
            Self::Shutdown => {
                let unlatched = Conditions { shutdown_latched: false, ..*conditions };
                let standby = self.stand_by(&unlatched);
                let action = if unlatched.fault_active { standby.action } else { Action::Energize };
                Transition { action, shutdown: Some(false), ..standby }
            }
            _ if conditions.shutdown_latched => self.reject(),
            _ => self.stay(),
        }
    }

    const fn on_fault_reset(self, conditions: &Conditions) -> Transition {
        match self {
            // A drive that still has torque is not done with its fault, whatever it says about the cause.
            Self::Faulted if conditions.torque => self.reject(),
            Self::Faulted => Transition::to(conditions.standby(), Action::ResetFault),
            Self::FaultReaction if !conditions.fault_active && conditions.halted => {
                Transition::to(Self::Stopping, Action::Disable)
            }
            Self::FaultReaction => self.reject(),
            _ => self.stay(),
        }
    }

    const fn end_test(self, conditions: &Conditions, otherwise: Action) -> Transition {
        match self {
            Self::Starting | Self::Testing if conditions.test_active => {
                Transition::to(Self::Stopping, Action::Disable)
            }
            _ => Transition::to(self, otherwise),
        }
    }

    const fn on_inhibit_raised(self, conditions: &Conditions) -> Transition {
        let removes_torque = conditions.inhibits.intersects(Inhibits::REMOVE_TORQUE);
        match self {
            Self::NotReady | Self::Inhibited | Self::AwaitingPower | Self::Ready => self.stand_by(conditions),
            Self::Starting | Self::Operating | Self::Testing if removes_torque => {
                Transition::to(Self::FaultReaction, Action::TorqueOff).because(conditions.removal_cause())
            }
            Self::Stopping | Self::FaultReaction if removes_torque => Transition::to(self, Action::TorqueOff),
            Self::Starting if !conditions.inhibits.is_empty() => {
                Transition::to(Self::Stopping, Action::Disable)
            }
            _ => self.stay(),
        }
    }

    const fn on_fault_raised(self, conditions: &Conditions) -> Transition {
        let (action, latch) = match conditions.reaction {
            Reaction::Ignore | Reaction::Alarm => return self.stay(),
            Reaction::HoldPosition => (Action::Halt, false),
            Reaction::DecelerateAndDisable => (Action::Disable, false),
            Reaction::CoastAndDisable => (Action::TorqueOff, false),
            Reaction::Shutdown => (Action::TorqueOff, true),
        };
        let transition = match self {
            Self::Faulted => self.stay(),
            // A second fault may ask for more than the reaction under way, never for less.
            Self::FaultReaction => match action {
                Action::Halt => self.stay(),
                stronger => Transition::to(self, stronger),
            },
            // There is no torque to hold a position with, and a stop under way is not turned into a hold.
            Self::Stopping if matches!(action, Action::Halt) => {
                Transition::to(Self::FaultReaction, Action::Disable)
            }
            _ if self.may_have_torque() => Transition::to(Self::FaultReaction, action),
            _ => Transition::to(Self::Faulted, Action::TorqueOff),
        };
        if latch { transition.latching() } else { transition }
    }

    /// Leaves Faulted when a reset was asked for and nothing stands against it any more.
    const fn after_reset(self, conditions: &Conditions) -> Transition {
        match self {
            Self::Faulted if conditions.reset_pending && !conditions.fault_active && !conditions.torque => {
                Transition::to(conditions.standby(), Action::None)
            }
            _ => self.stay(),
        }
    }

    const fn on_timeout(self, conditions: &Conditions) -> Transition {
        match self {
            Self::Starting => {
                Transition::to(Self::FaultReaction, Action::Disable).because(FaultCause::START_TIME_OUT)
            }
            Self::Stopping => {
                Transition::to(Self::FaultReaction, Action::TorqueOff).because(FaultCause::STOP_TIME_OUT)
            }
            // Nobody hears the drive, and it may hear every word: a stop that it is about is not made a coasting.
            Self::FaultReaction if !conditions.initialised => match conditions.reaction {
                Reaction::HoldPosition => Transition::to(Self::Faulted, Action::Disable),
                _ => Transition::to(Self::Faulted, Action::None),
            },
            Self::FaultReaction => Transition::to(Self::Faulted, Action::TorqueOff),
            _ => self.stay(),
        }
    }

    /// `conditions` hold the report already.
    const fn on_report(self, report: Report, conditions: &Conditions) -> Transition {
        match report {
            Report::NotReady | Report::AwaitingPower | Report::Ready => {
                self.on_report_without_torque(report, conditions)
            }
            Report::Enabling | Report::Operating | Report::Halted => {
                self.on_report_with_torque(report, conditions)
            }
            Report::Stopping => match self {
                Self::Stopping | Self::FaultReaction | Self::Faulted => self.stay(),
                _ if self.is_running() => {
                    Transition::to(Self::FaultReaction, Action::Disable).because(FaultCause::LEFT_OPERATION)
                }
                _ => Transition::to(Self::FaultReaction, Action::Disable)
                    .because(FaultCause::UNEXPECTED_TORQUE),
            },
            Report::FaultReaction => match self {
                Self::Faulted | Self::FaultReaction => self.stay(),
                // The drive is about it already, but it shall not find itself enabled when it is done.
                _ => Transition::to(Self::FaultReaction, Action::Disable),
            },
            Report::Faulted => match self {
                Self::Faulted => self.stay(),
                _ => Transition::to(Self::Faulted, Action::TorqueOff),
            },
            Report::Silent => match self {
                Self::NotReady => self.stay(),
                _ => self.fail(FaultCause::SOUTH_SILENCE),
            },
        }
    }

    const fn on_report_without_torque(self, report: Report, conditions: &Conditions) -> Transition {
        match self {
            Self::NotReady | Self::Inhibited | Self::AwaitingPower | Self::Ready => self.stand_by(conditions),
            Self::Shutdown => self.stay(),
            Self::Faulted => self.after_reset(conditions),
            Self::Starting if matches!(report, Report::Ready) => self.catch_up(conditions),
            Self::Starting | Self::Operating | Self::Testing => {
                let cause = match report {
                    Report::AwaitingPower => FaultCause::POWER_LOSS,
                    _ => FaultCause::LEFT_OPERATION,
                };
                Transition::to(Self::Faulted, Action::TorqueOff).because(cause)
            }
            Self::Stopping => self.stand_by(conditions),
            Self::FaultReaction => Transition::to(Self::Faulted, Action::TorqueOff),
        }
    }

    const fn on_report_with_torque(self, report: Report, conditions: &Conditions) -> Transition {
        match self {
            Self::NotReady
            | Self::Inhibited
            | Self::AwaitingPower
            | Self::Ready
            | Self::Shutdown
            | Self::Faulted => {
                Transition::to(Self::Faulted, Action::TorqueOff).because(FaultCause::UNEXPECTED_TORQUE)
            }
            Self::Starting => {
                let held = self.catch_up(conditions);
                if !matches!(held.next, Self::Starting) || matches!(report, Report::Enabling) {
                    return held;
                }
                let next = if conditions.test_active { Self::Testing } else { Self::Operating };
                Transition::to(next, Action::None)
            }
            Self::Operating | Self::Testing => match report {
                Report::Enabling if !conditions.halting => {
                    Transition::to(Self::FaultReaction, Action::Disable).because(FaultCause::LEFT_OPERATION)
                }
                _ => self.catch_up(conditions),
            },
            Self::Stopping | Self::FaultReaction => self.stay(),
        }
    }

    /// Stops a running drive when the conditions say that it should not be running any more.
    const fn catch_up(self, conditions: &Conditions) -> Transition {
        if conditions.fault_active {
            self.on_fault_raised(&Conditions {
                reaction: match conditions.reaction {
                    Reaction::Ignore | Reaction::Alarm => Reaction::DecelerateAndDisable,
                    reaction => reaction,
                },
                ..*conditions
            })
        } else if conditions.inhibits.intersects(Inhibits::REMOVE_TORQUE) {
            self.on_inhibit_raised(conditions)
        } else if conditions.shutdown_latched {
            Transition::to(Self::Stopping, Action::TorqueOff)
        } else {
            self.stay()
        }
    }
}
