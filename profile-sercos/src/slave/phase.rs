//! Communication phases of a slave.
//!
//! ```text
//!      CP0          CPS CP1, CP1         CPS CP2, CP2         CPS CP3, CP3         CPS CP4, CP4
//! NRT -----> CP0 ----------------> CP1 ----------------> CP2 ----------------> CP3 ----------------> CP4
//!  ^          ^                                              needs S-0-0127        needs S-0-0128
//!  |          +--- CP0, announced by CPS or not, from any phase
//!  +-------------- no MST for too long, or a phase out of order
//! ```
//!
//! A switch is announced by CPS = 1 with the new phase; the telegrams keep the old layout and the slave stops
//! inserting data. It takes place with the first MST of the new phase with CPS = 0. An MST of the old phase
//! without CPS takes the announcement back.

use core::fmt;

use crate::wire::header::{Phase, PhaseField};

/// Where a slave stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum State {
    /// No SERCOS communication: telegrams are only passed on.
    Nrt,
    /// In a communication phase.
    In(Phase),
    /// In the first phase, with a switch to the second announced.
    Switching(Phase, Phase),
    /// On the way into a network in CP4: hot plug.
    Joining(Stage),
}

/// How far a slave is on its way into a network in CP4. HP0, in which it listens, is NRT.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stage {
    /// HP1: it is scanned and told where its service channel is.
    Scan,
    /// HP2: it is set up over the service channel.
    Setup,
}

/// Why a slave has left SERCOS communication; the bits of S-0-0014.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Fault {
    /// No MST for too long.
    MstLoss,
    /// A phase above CP4.
    InvalidPhase,
    /// A phase was left out on the way up.
    Upshift,
    /// A switch down to another phase than CP0.
    Downshift,
    /// A switch to CP3 or CP4 without a successful check (S-0-0127, S-0-0128).
    NotReady,
}

impl Fault {
    /// The bit of S-0-0014 and its name.
    pub const fn interface_status(self) -> (u16, &'static str) {
        match self {
            Fault::MstLoss => (1 << 3, "MST missing"),
            Fault::InvalidPhase => (1 << 5, "invalid phase"),
            Fault::Upshift => (1 << 6, "error during phase upshift"),
            Fault::Downshift => (1 << 7, "error during phase downshift"),
            Fault::NotReady => (1 << 8, "phase switch without ready acknowledge"),
        }
    }
}

/// What happens to a slave's phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Event {
    /// A valid MST.
    Mst(PhaseField),
    /// No MST for longer than permitted.
    MstTimeout,
    /// Hot plug is through: set up and checked.
    Joined,
}

/// What the transition rules need to know.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Conditions {
    /// S-0-0127 has succeeded in this CP2.
    pub cp3_checked: bool,
    /// S-0-0128 has succeeded in this CP3.
    pub cp4_checked: bool,
}

/// The state after an event, and what went wrong if something did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Transition {
    /// The new state.
    pub next: State,
    /// Why SERCOS communication ended.
    pub fault: Option<Fault>,
}

impl Transition {
    const fn to(next: State) -> Self {
        Self { next, fault: None }
    }

    const fn fail(fault: Fault) -> Self {
        Self { next: State::Nrt, fault: Some(fault) }
    }
}

impl State {
    /// The phase whose telegram layout is in force.
    pub const fn phase(self) -> Option<Phase> {
        match self {
            State::Nrt | State::Joining(_) => None,
            State::In(phase) | State::Switching(phase, _) => Some(phase),
        }
    }

    /// Whether a switch is announced.
    pub const fn is_switching(self) -> bool {
        matches!(self, State::Switching(..))
    }

    /// The state after `event`.
    #[must_use]
    // Flat: the table above, one arm per row.
    pub fn next(self, event: Event, conditions: Conditions) -> Transition {
        match (event, self) {
            (
                Event::MstTimeout,
                State::In(Phase::CP3 | Phase::CP4) | State::Switching(Phase::CP3, Phase::CP4),
            ) => Transition::fail(Fault::MstLoss),
            // Before CP3, or after a switch down to CP0 was announced, the master may stop without harm.
            (Event::MstTimeout, _) => Transition::to(State::Nrt),
            (Event::Joined, State::Joining(Stage::Setup))
                if conditions.cp3_checked && conditions.cp4_checked =>
            {
                Transition::to(State::In(Phase::CP4))
            }
            (Event::Joined, _) => Transition::to(self),
            (Event::Mst(field), _) => match self.phase() {
                Some(current) => self.follow(current, field, conditions),
                None => Transition::to(self.outside(field)),
            },
        }
    }

    /// The state after an MST outside of the phases: joining goes on in a ring in CP4, and a scan begins in CP0.
    fn outside(self, field: PhaseField) -> State {
        match (self, field.phase(), field.switching()) {
            (State::Joining(_), Phase::CP4, false) | (State::Joining(_), Phase::CP0, true) => self,
            (_, Phase::CP0, false) => State::In(Phase::CP0),
            _ => State::Nrt,
        }
    }

    /// The state after an MST in a phase.
    fn follow(self, current: Phase, field: PhaseField, conditions: Conditions) -> Transition {
        let (wanted, announced) = (field.phase(), field.switching());
        if !wanted.is_defined() {
            return Transition::fail(Fault::InvalidPhase);
        }
        if wanted == Phase::CP0 {
            let switches = announced && current != Phase::CP0;
            let next = if switches { State::Switching(current, wanted) } else { State::In(wanted) };
            return Transition::to(next);
        }
        if wanted < current {
            return Transition::fail(Fault::Downshift);
        }
        if wanted == current {
            return Transition::to(State::In(current));
        }
        if current.next() != Some(wanted) {
            return Transition::fail(Fault::Upshift);
        }
        match self {
            _ if announced => Transition::to(State::Switching(current, wanted)),
            State::Switching(_, target) if target == wanted => match wanted {
                Phase::CP3 if !conditions.cp3_checked => Transition::fail(Fault::NotReady),
                Phase::CP4 if !conditions.cp4_checked => Transition::fail(Fault::NotReady),
                _ => Transition::to(State::In(wanted)),
            },
            _ => Transition::fail(Fault::Upshift),
        }
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            State::Nrt => f.write_str("NRT"),
            State::Joining(Stage::Scan) => f.write_str("HP1"),
            State::Joining(Stage::Setup) => f.write_str("HP2"),
            State::In(phase) => write!(f, "{phase}"),
            State::Switching(from, to) => write!(f, "{from}->{to}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_table() {
        let phases = [Phase::CP0, Phase::CP1, Phase::CP2, Phase::CP3, Phase::CP4];
        let mut states = vec![State::Nrt];
        states.extend(phases.map(State::In));
        states.extend(phases.into_iter().filter_map(|phase| Some(State::Switching(phase, phase.next()?))));
        states.extend(phases[1..].iter().map(|&phase| State::Switching(phase, Phase::CP0)));
        states.extend([Stage::Scan, Stage::Setup].map(State::Joining));
        let mut events = Vec::new();
        for switching in [false, true] {
            events.extend((0..=5).map(|phase| Event::Mst(PhaseField::new(switching, 0, Phase(phase)))));
        }
        events.extend([Event::MstTimeout, Event::Joined]);
        let mut table = String::from("           |");
        for event in &events {
            table += &match event {
                Event::Mst(field) if field.switching() => format!(" >{:<9}|", field.phase().to_string()),
                Event::Mst(field) => format!(" {:<10}|", field.phase().to_string()),
                Event::MstTimeout => " timeout    |".to_owned(),
                Event::Joined => " joined".to_owned(),
            };
        }
        for checked in [true, false] {
            table += if checked { "\nchecks done" } else { "\nchecks not done" };
            let conditions = Conditions { cp3_checked: checked, cp4_checked: checked };
            for state in &states {
                table += &format!("\n{:<10} |", state.to_string());
                for event in &events {
                    let transition = state.next(*event, conditions);
                    let text = match transition.fault {
                        Some(fault) => {
                            assert_eq!(transition.next, State::Nrt);
                            format!("!{fault:?}")
                        }
                        None => transition.next.to_string(),
                    };
                    table += &format!(" {:<10.10}|", text);
                }
            }
        }
        insta::assert_snapshot!(table);
    }

    #[test]
    fn a_switch_needs_its_check() {
        let mst = |byte| Event::Mst(PhaseField(byte));
        let none = Conditions::default();
        let cp3 = Conditions { cp3_checked: true, cp4_checked: false };
        let switching = State::Switching(Phase::CP2, Phase::CP3);
        assert_eq!(State::In(Phase::CP2).next(mst(0xA3), none).next, switching);
        assert_eq!(switching.next(mst(0x03), none).fault, Some(Fault::NotReady));
        assert_eq!(switching.next(mst(0x03), cp3).next, State::In(Phase::CP3));
        assert_eq!(Fault::NotReady.interface_status().0, 0x0100);
    }
}
