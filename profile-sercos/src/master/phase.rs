//! The phases as the master goes through them.
//!
//! ```text
//! Nrt --> Listen --> Settle --> Scan <--> Cp0
//!           |          ^                   |
//!           v          |                   |
//!         Occupied ----+                   |
//!   Leave0 --> Silence1 --> Identify --> OpenSvc --> Cp1
//!                                                     |
//!   Leave1 --> Silence2 --> Start2 --> Read2 --> Await2 --> Connect2 --> Write2 --> Measure2 --> Check2
//!                                                  ^____________|___________|__________|__________|
//!                                                        a slave refused                         |
//!   Leave2 --> Silence3 --> Start3 --> Await3 --> Check3                                         |
//!     ^                                  ^__________|                                            |
//!     +------------------------------------------------------------------------------------------+
//!   Leave3 --> Start4 --> Cp4          Leave3 follows Check3 and has no silence behind it
//!
//!   every phase --> Down --> Silence0 --> Settle
//!   every state with telegrams, and the silences --> Occupied, when another master sends on the wire
//! ```
//!
//! `Listen` sends nothing before it is known that nobody else does. `Occupied` sends nothing because somebody else does, until
//! he has been silent for a while. `Leave` and `Down` send telegrams of the old phase with CPS set and the new phase in the header until the
//! slaves have stopped inserting data. `Silence` sends nothing. `Await` is where the application works.

use crate::wire::header::Phase;

/// Where the master is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum State {
    /// No SERCOS telegrams.
    Nrt,
    /// Nothing was sent yet: listening for another master.
    Listen,
    /// Another master sends; waiting for him to be silent.
    Occupied,
    /// Pause before CP0.
    Silence0,
    /// CP0, telegrams not evaluated yet.
    Settle,
    /// CP0, topology and address list not stable yet.
    Scan,
    /// CP0, scanned.
    Cp0,
    /// CP0 with CPS towards CP1.
    Leave0,
    /// Pause before CP1.
    Silence1,
    /// CP1, slaves report themselves and their service channels valid.
    Identify,
    /// CP1, service channels take over the handshake bit.
    OpenSvc,
    /// CP1 done.
    Cp1,
    /// CP1 with CPS towards CP2.
    Leave1,
    /// Pause before CP2.
    Silence2,
    /// CP2, service channels become usable.
    Start2,
    /// CP2, the master reads what the slaves are.
    Read2,
    /// CP2, the application works.
    Await2,
    /// CP2, connections are set up and their lengths read.
    Connect2,
    /// CP2, layout and times are written.
    Write2,
    /// CP2, procedure command S-0-1024.
    Measure2,
    /// CP2, procedure command S-0-0127.
    Check2,
    /// CP2 with CPS towards CP3.
    Leave2,
    /// Pause before CP3.
    Silence3,
    /// CP3, slaves become valid.
    Start3,
    /// CP3, the application works.
    Await3,
    /// CP3, procedure command S-0-0128.
    Check3,
    /// CP3 with CPS towards CP4.
    Leave3,
    /// CP4, slaves become valid.
    Start4,
    /// CP4.
    Cp4,
    /// CPS towards CP0.
    Down,
}

/// What moves the master on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PhaseEvent {
    /// A higher phase is wanted.
    Up,
    /// CP0 is wanted, or it is the only way on.
    Restart,
    /// No telegrams are wanted.
    Stop,
    /// The time of the state has run out.
    Elapsed,
    /// All slaves in question meet the condition of the state.
    Ready,
    /// A slave refused, or the network does not let the master go on.
    Failed,
    /// The application is through.
    Proceed,
    /// Another master sends on the wire.
    Foreign,
}

impl State {
    /// All states.
    pub const ALL: [State; 30] = [
        State::Nrt,
        State::Listen,
        State::Occupied,
        State::Silence0,
        State::Settle,
        State::Scan,
        State::Cp0,
        State::Leave0,
        State::Silence1,
        State::Identify,
        State::OpenSvc,
        State::Cp1,
        State::Leave1,
        State::Silence2,
        State::Start2,
        State::Read2,
        State::Await2,
        State::Connect2,
        State::Write2,
        State::Measure2,
        State::Check2,
        State::Leave2,
        State::Silence3,
        State::Start3,
        State::Await3,
        State::Check3,
        State::Leave3,
        State::Start4,
        State::Cp4,
        State::Down,
    ];

    /// The state after `event`; `None` when the event means nothing here.
    #[must_use]
    // Flat: the table above, one arm per row.
    pub const fn next(self, event: PhaseEvent) -> Option<State> {
        use PhaseEvent as E;
        use State as S;
        Some(match (self, event) {
            (S::Nrt | S::Occupied, E::Foreign) => return None,
            (_, E::Foreign) => S::Occupied,
            (S::Nrt, E::Up | E::Restart) => S::Listen,
            (S::Listen | S::Occupied | S::Silence0, E::Elapsed) => S::Settle,
            (S::Settle, E::Elapsed) => S::Scan,
            (S::Scan, E::Ready) => S::Cp0,
            (S::Cp0, E::Failed) => S::Scan,
            (S::Cp0, E::Up) => S::Leave0,
            (S::Listen | S::Occupied | S::Silence0 | S::Settle | S::Scan | S::Cp0, E::Stop) => S::Nrt,
            (S::Listen | S::Occupied | S::Silence0 | S::Settle | S::Scan | S::Cp0 | S::Down, E::Restart) => {
                return None;
            }
            (S::Leave0, E::Ready) => S::Silence1,
            (S::Silence1, E::Elapsed) => S::Identify,
            (S::Identify, E::Ready) => S::OpenSvc,
            (S::OpenSvc, E::Ready) => S::Cp1,
            (S::Cp1, E::Up) => S::Leave1,
            (S::Leave1, E::Ready) => S::Silence2,
            (S::Silence2, E::Elapsed) => S::Start2,
            (S::Start2, E::Ready) => S::Read2,
            // A slave that refuses to be read is reported; what is known of it decides what is done with it.
            (S::Read2, E::Ready | E::Failed) => S::Await2,
            (S::Await2, E::Proceed) => S::Connect2,
            (S::Connect2, E::Ready) => S::Write2,
            (S::Write2, E::Ready) => S::Measure2,
            (S::Measure2, E::Ready) => S::Check2,
            (S::Connect2 | S::Write2 | S::Measure2 | S::Check2, E::Failed) => S::Await2,
            (S::Check2, E::Ready) => S::Leave2,
            (S::Leave2, E::Ready) => S::Silence3,
            (S::Silence3, E::Elapsed) => S::Start3,
            (S::Start3, E::Ready) => S::Await3,
            (S::Await3, E::Proceed) => S::Check3,
            (S::Check3, E::Failed) => S::Await3,
            (S::Check3, E::Ready) => S::Leave3,
            (S::Leave3, E::Ready) => S::Start4,
            (S::Start4, E::Ready) => S::Cp4,
            (S::Down, E::Ready | E::Elapsed) => S::Silence0,
            // Nothing is on the wire: CP0 needs no CPS.
            (S::Silence1 | S::Silence2 | S::Silence3, E::Restart) => S::Silence0,
            // CP1 is announced: that has to be taken back.
            (S::Leave0, E::Stop) => S::Down,
            (S::Leave0 | S::Leave1 | S::Leave2 | S::Leave3, E::Elapsed | E::Failed) => S::Down,
            (S::Identify | S::OpenSvc | S::Start2 | S::Start3 | S::Start4, E::Failed) => S::Down,
            (_, E::Restart) => S::Down,
            _ => return None,
        })
    }

    /// The phase whose telegrams are on the wire; `None` in `Nrt`, while it listens, in the silences and, as it depends on
    /// where it came from, in `Down`.
    #[must_use]
    pub const fn phase(self) -> Option<Phase> {
        use State as S;
        Some(match self {
            S::Nrt | S::Listen | S::Occupied => return None,
            S::Silence0 | S::Silence1 | S::Silence2 | S::Silence3 | S::Down => return None,
            S::Settle | S::Scan | S::Cp0 | S::Leave0 => Phase::CP0,
            S::Identify | S::OpenSvc | S::Cp1 | S::Leave1 => Phase::CP1,
            S::Start2
            | S::Read2
            | S::Await2
            | S::Connect2
            | S::Write2
            | S::Measure2
            | S::Check2
            | S::Leave2 => Phase::CP2,
            S::Start3 | S::Await3 | S::Check3 | S::Leave3 => Phase::CP3,
            S::Start4 | S::Cp4 => Phase::CP4,
        })
    }

    /// The phase announced with CPS set; `None` where CPS is not set.
    #[must_use]
    pub const fn announces(self) -> Option<Phase> {
        match self {
            State::Leave0 => Some(Phase::CP1),
            State::Leave1 => Some(Phase::CP2),
            State::Leave2 => Some(Phase::CP3),
            State::Leave3 => Some(Phase::CP4),
            State::Down => Some(Phase::CP0),
            _ => None,
        }
    }

    /// The phase whose application work is waited for.
    #[must_use]
    pub const fn awaits(self) -> Option<Phase> {
        match self {
            State::Await2 => Some(Phase::CP2),
            State::Await3 => Some(Phase::CP3),
            _ => None,
        }
    }

    /// Whether nothing is sent until a time has come.
    #[must_use]
    pub const fn is_silent(self) -> bool {
        self.listens()
            || matches!(self, State::Silence0 | State::Silence1 | State::Silence2 | State::Silence3)
    }

    /// Whether every telegram that is heard is another master's.
    #[must_use]
    pub const fn listens(self) -> bool {
        matches!(self, State::Listen | State::Occupied)
    }

    /// Whether the service channels are served.
    #[must_use]
    pub const fn serves(self) -> bool {
        use State as S;
        matches!(
            self,
            S::Read2
                | S::Await2
                | S::Connect2
                | S::Write2
                | S::Measure2
                | S::Check2
                | S::Await3
                | S::Check3
                | S::Cp4
        )
    }

    /// Whether every slave must be valid in every cycle.
    #[must_use]
    pub const fn supervises(self) -> bool {
        self.serves() || matches!(self, State::OpenSvc | State::Cp1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_table() {
        use PhaseEvent::*;
        let events = [Up, Restart, Stop, Elapsed, Ready, Failed, Proceed, Foreign];
        let mut table = String::new();
        for state in State::ALL {
            for event in events {
                let next = state.next(event).map_or("-".to_string(), |next| format!("{next:?}"));
                table += &format!("{:<9} {:<8} {next}\n", format!("{state:?}"), format!("{event:?}"));
            }
        }
        insta::assert_snapshot!(table);
    }

    #[test]
    fn telegrams_by_state() {
        let mut table = String::new();
        for state in State::ALL {
            let phase = |phase: Option<Phase>| phase.map_or("-".to_string(), |phase| phase.to_string());
            table += &format!(
                "{:<9} telegrams of {:<3} announces {:<3}{}{}\n",
                format!("{state:?}"),
                phase(state.phase()),
                phase(state.announces()),
                if state.serves() { " service channel" } else { "" },
                if state.supervises() { " supervised" } else { "" },
            );
        }
        insta::assert_snapshot!(table);
    }
}
