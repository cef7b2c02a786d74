//! Other PDOs of a device, made beside the cycle: checked, and with all the storage that they need.

use super::config::{ConfigError, Direction, MasterConfig, PdoConfig, PdoError};
use super::ends::{RpdoEnd, TpdoEnd};
use super::plan::{Step, steps_max};
use super::station::Station;
use super::{CallError, Master};
use crate::master::boot::BootState;
use crate::wire::NodeId;

/// PDOs for [`Master::set_pdos`]. Making them allocates, taking them does not.
#[derive(Debug)]
pub struct PdoSet {
    node: NodeId,
    rpdos: Vec<PdoConfig>,
    tpdos: Vec<PdoConfig>,
    rpdo_ends: Vec<RpdoEnd>,
    tpdo_ends: Vec<TpdoEnd>,
    steps: Vec<Step>,
}

impl PdoSet {
    /// These PDOs for a device of the network `config`.
    ///
    /// # Errors
    /// [`CallError::NoNode`], or [`CallError::Config`] when the network is not possible with them.
    pub fn new(
        config: &MasterConfig,
        node: NodeId,
        rpdos: Vec<PdoConfig>,
        tpdos: Vec<PdoConfig>,
    ) -> Result<Self, CallError> {
        let mut changed = config.clone();
        let known = changed.nodes.iter_mut().find(|known| known.node == node).ok_or(CallError::NoNode)?;
        (known.rpdos, known.tpdos) = (rpdos, tpdos);
        let steps = Vec::with_capacity(steps_max(known));
        let rpdo_ends = known.rpdos.iter().map(|pdo| RpdoEnd::new(pdo, node)).collect();
        let tpdo_ends = known.tpdos.iter().map(|pdo| TpdoEnd::new(pdo, node)).collect();
        changed.check()?;
        let known = changed.nodes.into_iter().find(|known| known.node == node).ok_or(CallError::NoNode)?;
        Ok(Self { node, rpdos: known.rpdos, tpdos: known.tpdos, rpdo_ends, tpdo_ends, steps })
    }

    /// The device.
    #[must_use]
    pub fn node(&self) -> NodeId {
        self.node
    }

    /// Its PDOs, one way.
    #[must_use]
    pub fn pdos(&self, direction: Direction) -> &[PdoConfig] {
        match direction {
            Direction::Receive => &self.rpdos,
            Direction::Transmit => &self.tpdos,
        }
    }

    /// The first PDO whose identifier another device has: the network may be another one than the set was made for.
    fn taken(&self, others: &[Station]) -> Option<ConfigError> {
        let node = self.node;
        let others = || others.iter().filter(|station| station.node != node);
        let taken = |id| {
            others().any(|station| {
                station.rpdos.iter().any(|end| end.id == id) || station.tpdos.iter().any(|end| end.id == id)
            })
        };
        let error = |direction, number| ConfigError::Pdo { node, direction, number, reason: PdoError::Id };
        let receive = self.rpdo_ends.iter().map(|end| (end.id, error(Direction::Receive, end.number)));
        let transmit = self.tpdo_ends.iter().map(|end| (end.id, error(Direction::Transmit, end.number)));
        receive.chain(transmit).find(|(id, _)| taken(*id)).map(|(_, error)| error)
    }
}

impl MasterConfig {
    /// Gives a device the PDOs of a set, for those that keep account of what its master has been given.
    pub fn take_pdos(&mut self, set: &PdoSet) {
        if let Some(known) = self.nodes.iter_mut().find(|known| known.node == set.node) {
            known.rpdos.clone_from(&set.rpdos);
            known.tpdos.clone_from(&set.tpdos);
        }
    }
}

impl Master {
    /// Replaces the PDOs of a device that awaits the application, and gives back those that it had, to be freed where there is
    /// time for that.
    ///
    /// # Errors
    /// [`CallError`] and the set; the device keeps what it has.
    #[allow(clippy::result_large_err, reason = "the set goes back to be freed elsewhere")]
    pub fn set_pdos(&mut self, mut set: PdoSet) -> Result<PdoSet, (CallError, PdoSet)> {
        let (place, state) = match self.call(set.node) {
            Ok(known) => known,
            Err(error) => return Err((error, set)),
        };
        if state != BootState::Await || self.stations[place].proceed {
            return Err((CallError::State(state), set));
        }
        if let Some(error) = set.taken(&self.stations) {
            return Err((error.into(), set));
        }
        let (config, station) = (&mut self.config.nodes[place], &mut self.stations[place]);
        core::mem::swap(&mut config.rpdos, &mut set.rpdos);
        core::mem::swap(&mut config.tpdos, &mut set.tpdos);
        core::mem::swap(&mut station.rpdos, &mut set.rpdo_ends);
        core::mem::swap(&mut station.tpdos, &mut set.tpdo_ends);
        if station.steps.capacity() < set.steps.capacity() {
            set.steps.extend_from_slice(&station.steps);
            core::mem::swap(&mut station.steps, &mut set.steps);
        }
        self.routes.fill(&self.stations);
        Ok(set)
    }
}
