//! How far a slave is on its way into the network, as the master sees it.
//!
//! ```text
//!        a place is free,     an end hears its own
//!        the ring is open     telegrams from behind
//! Idle -----------------> Offer -----------------> Open --> Scan --> Place --> Switch
//!  ^                       HP0                                HP1                |
//!  |                                                                             v
//!  |        Check3 <-- Await3 <-- Check2 <-- Measure <-- Write <-- Connect <-- Await2 <-- Read
//!  |          |                            HP2
//!  |          v
//! Rest <--- Prove <-- Enter            Open to Prove: failed --> Close --> Rest
//! ```
//!
//! In `Await` the application works, as in CP2 and CP3. `Enter` waits for the slave in CP4. In `Prove` hot plug is
//! switched off: who is still on the way in gives up. Whoever turns telegrams round behind the new slave even then has
//! taken over what was meant for it. `Close` commands the end of the line back to loopback before hot plug is switched
//! off, because a slave that gives up may pass telegrams on to nowhere.

/// How far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub(in crate::master) enum Stage {
    /// No place is free, or the ring is closed.
    #[default]
    Idle,
    /// HP0: the parameters are broadcast.
    Offer,
    /// The end of the line is commanded to fast forward.
    Open,
    /// HP1: addresses by slave index.
    Scan,
    /// HP1: offsets of the service channel.
    Place,
    /// HP1: the service channel takes over.
    Switch,
    /// HP2: what the slave is.
    Read,
    /// HP2: the application works, as in CP2.
    Await2,
    /// HP2: connections are set up and their lengths read.
    Connect,
    /// HP2: layout and times are written.
    Write,
    /// HP2: procedure command S-0-1024.
    Measure,
    /// HP2: procedure command S-0-0127.
    Check2,
    /// HP2: the application works, as in CP3.
    Await3,
    /// HP2: procedure command S-0-0128.
    Check3,
    /// The slave becomes valid in CP4.
    Enter,
    /// Nobody else has come in with it.
    Prove,
    /// The end of the line is commanded back to loopback.
    Close,
    /// Hot plug is off for a while.
    Rest,
}

/// What moves a stage on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(in crate::master) enum StageEvent {
    /// A place is free and the ring is open.
    Wanted,
    /// It is not any more.
    Unwanted,
    /// An end of a line hears its own telegrams from behind.
    Heard,
    /// What the stage is for is done.
    Done,
    /// It cannot be done.
    Failed,
    /// The time of the stage is over.
    Elapsed,
}

impl Stage {
    #[cfg(test)]
    pub const ALL: [Stage; 18] = [
        Stage::Idle,
        Stage::Offer,
        Stage::Open,
        Stage::Scan,
        Stage::Place,
        Stage::Switch,
        Stage::Read,
        Stage::Await2,
        Stage::Connect,
        Stage::Write,
        Stage::Measure,
        Stage::Check2,
        Stage::Await3,
        Stage::Check3,
        Stage::Enter,
        Stage::Prove,
        Stage::Close,
        Stage::Rest,
    ];

    /// The stage after `event`; `None` when it means nothing here.
    // Flat: the table above, one arm per row.
    pub const fn next(self, event: StageEvent) -> Option<Stage> {
        use Stage as S;
        use StageEvent as E;
        Some(match (self, event) {
            (S::Idle, E::Wanted) => S::Offer,
            (S::Offer, E::Unwanted) => S::Idle,
            (S::Offer, E::Heard) => S::Open,
            // Whoever turns telegrams round has not learned it here.
            (S::Offer, E::Failed) => S::Rest,
            (S::Open, E::Done) => S::Scan,
            (S::Scan, E::Done) => S::Place,
            (S::Place, E::Done) => S::Switch,
            (S::Switch, E::Done) => S::Read,
            (S::Read, E::Done) => S::Await2,
            (S::Await2, E::Done) => S::Connect,
            (S::Connect, E::Done) => S::Write,
            (S::Write, E::Done) => S::Measure,
            (S::Measure, E::Done) => S::Check2,
            (S::Check2, E::Done) => S::Await3,
            (S::Await3, E::Done) => S::Check3,
            (S::Check3, E::Done) => S::Enter,
            (S::Enter, E::Done) => S::Prove,
            (S::Prove, E::Done) => S::Rest,
            (S::Close, E::Done | E::Elapsed) => S::Rest,
            (S::Rest, E::Elapsed) => S::Idle,
            (state, E::Failed) if state.is_joining() => S::Close,
            _ => return None,
        })
    }

    /// A slave is on its way in: the end of the line is in fast forward, or commanded to be.
    pub const fn is_joining(self) -> bool {
        !matches!(self, Stage::Idle | Stage::Offer | Stage::Close | Stage::Rest)
    }

    /// Ends of lines are being commanded: the ring must not be closed meanwhile.
    pub const fn is_busy(self) -> bool {
        self.is_joining() || matches!(self, Stage::Close)
    }

    /// The slave's service channel is served.
    pub const fn serves(self) -> bool {
        matches!(
            self,
            Stage::Read
                | Stage::Await2
                | Stage::Connect
                | Stage::Write
                | Stage::Measure
                | Stage::Check2
                | Stage::Await3
                | Stage::Check3
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write as _;

    #[test]
    fn whole_table() {
        use StageEvent::*;
        let mut table = String::new();
        for stage in Stage::ALL {
            for event in [Wanted, Unwanted, Heard, Done, Failed, Elapsed] {
                let next = stage.next(event).map_or("-".to_string(), |next| format!("{next:?}"));
                writeln!(table, "{:<8} {:<8} {next}", format!("{stage:?}"), format!("{event:?}")).unwrap();
            }
        }
        insta::assert_snapshot!(table);
    }
}
