//! What the axis does about a fault: decided here, at the instant at which it is raised.
//!
//! The north side says for each cause what it wants done ([`Reactions::set`]); it is not asked again when the fault comes. A
//! fault for which drive or gateway stop the axis anyway stops it whatever is configured, and a stop is never milder than
//! the best one that the fault itself leaves (CIP Volume 9, Table 5-2.70). A cause that nobody has configured has the
//! reaction of its fault.

use profile_generic::fault::{FaultCause, Reaction};
use profile_generic::fault_set::{ActiveFault, Origin};

/// Causes of the catalogue.
const CAUSES: usize = FaultCause::NAMED.len();

/// What a north side wants done about each cause; nothing is configured to begin with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reactions([Option<Reaction>; CAUSES]);

impl Default for Reactions {
    fn default() -> Self {
        Self([None; CAUSES])
    }
}

impl Reactions {
    /// Configures a cause; one that is not in the catalogue keeps the reaction of its fault.
    pub fn set(&mut self, cause: FaultCause, reaction: Reaction) {
        if let Some(place) = place(cause) {
            self.0[place] = Some(reaction);
        }
    }

    /// What is configured for a cause.
    #[must_use]
    pub fn get(&self, cause: FaultCause) -> Option<Reaction> {
        place(cause).and_then(|place| self.0[place])
    }

    /// The reaction to a fault that is there.
    #[must_use]
    pub fn decide(&self, active: &ActiveFault) -> Reaction {
        let ActiveFault { fault, origin } = active;
        let acts = matches!(origin, Origin::Drive | Origin::Event) && fault.reaction.stops();
        match self.get(fault.cause) {
            Some(configured) if configured.stops() => fault.best_stop().max(configured),
            Some(configured) if !acts => configured,
            _ => fault.reaction,
        }
    }
}

/// The place of a cause in the table; the catalogue is in the order of the codes.
fn place(cause: FaultCause) -> Option<usize> {
    FaultCause::NAMED.binary_search_by_key(&cause, |(known, _)| *known).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::fault::Fault;
    use profile_generic::time::SystemTime;

    const ALL: [Origin; 4] = [Origin::Event, Origin::Drive, Origin::Warning, Origin::Watch];

    fn active(cause: FaultCause, own: Reaction, origin: Origin) -> ActiveFault {
        ActiveFault { fault: Fault::new(cause, SystemTime(7)).with_reaction(own), origin }
    }

    #[test]
    fn every_cause_of_the_catalogue_has_a_place_of_its_own() {
        let mut reactions = Reactions::default();
        for (at, (cause, name)) in FaultCause::NAMED.iter().enumerate() {
            assert_eq!(place(*cause), Some(at), "{name}");
            assert_eq!(reactions.get(*cause), None, "{name}");
            reactions.set(*cause, Reaction::ALL[at % Reaction::ALL.len()]);
        }
        for (at, (cause, name)) in FaultCause::NAMED.iter().enumerate() {
            assert_eq!(reactions.get(*cause), Some(Reaction::ALL[at % Reaction::ALL.len()]), "{name}");
        }
    }

    #[test]
    fn a_cause_that_nobody_knows_keeps_the_reaction_of_its_fault() {
        let mut reactions = Reactions::default();
        reactions.set(FaultCause(0x7777), Reaction::Ignore);
        assert_eq!(reactions, Reactions::default());
        let unknown = active(FaultCause(0x7777), Reaction::CoastAndDisable, Origin::Watch);
        assert_eq!(reactions.decide(&unknown), Reaction::CoastAndDisable);
    }

    #[test]
    fn without_configuration_a_fault_has_its_own_reaction() {
        for origin in ALL {
            for own in Reaction::ALL {
                let fault = active(FaultCause::MOTOR_OVERLOAD, *own, origin);
                assert_eq!(Reactions::default().decide(&fault), *own, "{origin:?} {own}");
            }
        }
    }

    #[test]
    fn what_drive_or_gateway_stop_for_is_never_made_milder() {
        for configured in Reaction::ALL {
            let mut reactions = Reactions::default();
            reactions.set(FaultCause::OVER_CURRENT, *configured);
            for origin in [Origin::Event, Origin::Drive] {
                for own in Reaction::ALL.iter().filter(|own| own.stops()) {
                    let decided = reactions.decide(&active(FaultCause::OVER_CURRENT, *own, origin));
                    assert_eq!(
                        decided,
                        *own.max(configured),
                        "{origin:?}: own {own}, configured {configured}"
                    );
                }
            }
        }
    }

    #[test]
    fn what_is_watched_or_warned_of_is_for_the_configuration_to_say() {
        use Reaction as R;
        // Own reaction, configured reaction, what follows.
        let rows = [
            (R::DecelerateAndDisable, R::Ignore, R::Ignore),
            (R::DecelerateAndDisable, R::Alarm, R::Alarm),
            (R::DecelerateAndDisable, R::HoldPosition, R::DecelerateAndDisable),
            (R::DecelerateAndDisable, R::CoastAndDisable, R::CoastAndDisable),
            (R::CoastAndDisable, R::DecelerateAndDisable, R::CoastAndDisable),
            // A warning that shall stop the axis: it leaves a controlled stop.
            (R::Alarm, R::HoldPosition, R::DecelerateAndDisable),
            (R::Alarm, R::Shutdown, R::Shutdown),
            (R::Alarm, R::Ignore, R::Ignore),
        ];
        for (own, configured, expected) in rows {
            let mut reactions = Reactions::default();
            reactions.set(FaultCause::MOTOR_OVERLOAD, configured);
            for origin in [Origin::Watch, Origin::Warning] {
                let decided = reactions.decide(&active(FaultCause::MOTOR_OVERLOAD, own, origin));
                assert_eq!(decided, expected, "{origin:?}: own {own}, configured {configured}");
            }
        }
    }

    #[test]
    fn one_cause_says_nothing_about_another() {
        let mut reactions = Reactions::default();
        reactions.set(FaultCause::MOTOR_OVER_CURRENT, Reaction::Ignore);
        // The two share an exception of CIP; the table holds causes.
        let other = active(FaultCause::MOTOR_SHORT_CIRCUIT, Reaction::CoastAndDisable, Origin::Watch);
        assert_eq!(reactions.decide(&other), Reaction::CoastAndDisable);
    }
}
