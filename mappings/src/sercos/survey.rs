//! What has to be asked of a SERCOS drive before anything can be planned for it.

use profile_sercos::wire::idn::Idn;

use super::facts::DriveFacts;
use super::fixed_connections;
use super::tables::SercosTables;

/// The next questions.
pub(crate) enum Survey {
    /// S-0-1050.x.1, which may be missing, and S-0-1050.x.6.
    Lists(Vec<(Idn, Idn)>),
    /// What the values of the lists are.
    Values(Vec<Idn>),
    /// Which operation modes the drive has; each may be missing.
    Modes(Vec<Idn>),
}

/// The next questions; `None` when all is known.
pub(crate) fn survey(tables: &SercosTables, facts: &DriveFacts) -> Option<Survey> {
    if let Some(survey) = fixed_connections::survey(facts) {
        return Some(survey);
    }
    if !facts.is_told(tables.supported_modes) {
        return Some(Survey::Modes(vec![tables.supported_modes]));
    }
    if facts.data(tables.supported_modes).is_some() {
        return None;
    }
    // A drive that does not list its modes has those that it is set to.
    let slots = tables.slots.iter().map(|slot| slot.idn);
    let unasked: Vec<_> = slots.filter(|idn| !facts.is_told(*idn)).collect();
    (!unasked.is_empty()).then_some(Survey::Modes(unasked))
}
