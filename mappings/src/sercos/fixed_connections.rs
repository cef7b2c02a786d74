//! The connections of a drive of class SCP_FixCFG: it says which values they carry, in which order, and takes no other.
//!
//! Nothing is guessed. Every value in the list of the MDT has a source in the modes of the axis, or the drive is refused:
//! a limit that is filled with 0, or a velocity that gets a position, moves a machine.

use std::collections::BTreeSet;

use profile_generic::image::Signal;
use profile_sercos::wire::connection::ConnectionSetup;
use profile_sercos::wire::idn::Idn;

use super::compile::SercosError;
use super::facts::DriveFacts;
use super::survey::Survey;
use super::tables::SercosTables;

/// Connections of a slave with SCP_FixCFG, x of S-0-1050.x.
const INSTANCES: [u8; 2] = [0, 1];

/// S-0-1050.x.1, connection setup.
const SETUP: u8 = 1;

/// S-0-1050.x.6, configuration list.
const LIST: u8 = 6;

/// One fixed connection.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FixedConnection {
    /// x of S-0-1050.x.
    pub instance: u8,
    /// Its values, in order.
    pub idns: Vec<Idn>,
}

impl FixedConnection {
    /// The parameter that says what it carries.
    #[must_use]
    pub fn list(&self) -> Idn {
        Idn::connection(self.instance, LIST)
    }
}

/// The two connections of a drive of class SCP_FixCFG.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FixedConnections {
    /// In the MDT, with S-0-0134.
    pub command: FixedConnection,
    /// In the AT, with S-0-0135.
    pub feedback: FixedConnection,
}

impl FixedConnections {
    /// The connections that the drive has; `None` when they can be configured.
    ///
    /// # Errors
    /// No list carries the control word or the status word, an IDN stands in a list twice, or S-0-1050.x.1 contradicts.
    pub(crate) fn of(tables: &SercosTables, facts: &DriveFacts) -> Result<Option<Self>, SercosError> {
        if !facts.has_fixed_connections() {
            return Ok(None);
        }
        let command = find(facts, tables.control, false)?;
        let feedback = find(facts, tables.status_word, true)?;
        Ok(Some(Self { command, feedback }))
    }

    /// The connection that a signal belongs into.
    pub(crate) fn of_signal(&self, signal: Signal) -> &FixedConnection {
        if signal.is_command() { &self.command } else { &self.feedback }
    }
}

/// The connection with a word that belongs into its direction.
fn find(facts: &DriveFacts, word: Idn, produces: bool) -> Result<FixedConnection, SercosError> {
    let connections = INSTANCES.map(|instance| FixedConnection { instance, idns: idns(facts, instance) });
    let [first, second] = &connections;
    let found = [first, second].into_iter().find(|connection| connection.idns.contains(&word));
    let Some(found) = found else {
        return Err(SercosError::FixedWord { word, lists: show(&connections) });
    };
    let mut seen = BTreeSet::new();
    if let Some(&idn) = found.idns.iter().find(|idn| !seen.insert(**idn)) {
        return Err(SercosError::FixedTwice { list: found.list(), idn });
    }
    let setup = facts.data(Idn::connection(found.instance, SETUP)).and_then(|data| data.first_chunk());
    let setup = setup.map(|word| ConnectionSetup::from_bits_retain(u16::from_le_bytes(*word)));
    // A connection that is switched off does not say which way it goes.
    let active = setup.filter(|setup| setup.contains(ConnectionSetup::ACTIVE));
    if active.is_some_and(|setup| setup.contains(ConnectionSetup::PRODUCER) != produces) {
        return Err(SercosError::FixedDirection { list: found.list(), word, produces });
    }
    Ok(found.clone())
}

/// What the drive has said of S-0-1050.x.6; nothing while it was not asked.
fn idns(facts: &DriveFacts, instance: u8) -> Vec<Idn> {
    let data = facts.data(Idn::connection(instance, LIST)).unwrap_or_default();
    data.chunks_exact(4).map(|word| Idn(u32::from_le_bytes([word[0], word[1], word[2], word[3]]))).collect()
}

fn show(connections: &[FixedConnection]) -> String {
    let list = |connection: &FixedConnection| {
        let idns: Vec<_> = connection.idns.iter().map(ToString::to_string).collect();
        format!("{} = [{}]", connection.list(), idns.join(", "))
    };
    connections.iter().map(list).collect::<Vec<_>>().join(" and ")
}

/// What has to be asked next of the fixed connections of a drive; `None` when all is known, or nothing is fixed.
pub(crate) fn survey(facts: &DriveFacts) -> Option<Survey> {
    if !facts.has_fixed_connections() {
        return None;
    }
    let list = |instance| Idn::connection(instance, LIST);
    let lists: Vec<_> = INSTANCES
        .into_iter()
        .filter(|instance| facts.data(list(*instance)).is_none())
        .map(|instance| (Idn::connection(instance, SETUP), list(instance)))
        .collect();
    if !lists.is_empty() {
        return Some(Survey::Lists(lists));
    }
    let all: BTreeSet<Idn> = INSTANCES.into_iter().flat_map(|instance| idns(facts, instance)).collect();
    let values: Vec<_> = all.into_iter().filter(|idn| facts.attribute(*idn).is_none()).collect();
    (!values.is_empty()).then_some(Survey::Values(values))
}
