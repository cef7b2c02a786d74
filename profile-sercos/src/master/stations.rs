//! The slaves of the last scan and the places kept for others.

use core::ops::{Deref, DerefMut};

use super::config::MasterConfig;
use super::event::{Event, SlaveId, Ticket};
use super::station::{Presence, Station};
use crate::wire::device_control::Topology;
use crate::wire::device_status::DeviceStatus;
use crate::wire::header::Phase;

/// Slaves that are not there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Census {
    /// That may come.
    pub free: usize,
    /// That were there before.
    pub lost: usize,
}

/// The stations: a slice of those that were found and those for which a place is kept.
#[derive(Debug)]
pub(super) struct Stations {
    all: Vec<Station>,
    found: usize,
    /// Those of them that the scan has found; they come first.
    pub scanned: usize,
    /// The phase whose telegrams are on the wire; stays through `Down`. It decides what S-DEV of a valid slave is.
    pub phase: Phase,
    /// Those that turn telegrams round in this cycle.
    pub turning: Vec<u16>,
    /// How many are not there, counted anew when one has gone or come.
    census: Option<Census>,
    next_outcome: usize,
}

impl Deref for Stations {
    type Target = [Station];

    fn deref(&self) -> &[Station] {
        &self.all[..self.found]
    }
}

impl DerefMut for Stations {
    fn deref_mut(&mut self) -> &mut [Station] {
        &mut self.all[..self.found]
    }
}

impl Stations {
    pub fn new(config: &MasterConfig) -> Stations {
        let slaves = usize::from(config.slaves_max);
        Stations {
            all: (0..slaves).map(|_| Station::new(config)).collect(),
            found: 0,
            scanned: 0,
            phase: Phase::CP0,
            turning: Vec::with_capacity(slaves),
            census: None,
            next_outcome: 0,
        }
    }

    /// The scan has found slaves with these addresses; at most as many as there is storage for.
    pub fn found(&mut self, addresses: impl Iterator<Item = u16>, config: &MasterConfig) {
        self.found = 0;
        for (station, address) in self.all.iter_mut().zip(addresses) {
            station.found(address, config.slave(address));
            self.found += 1;
        }
        self.scanned = self.found;
    }

    /// Keeps a place for a slave that may come later; `false` without storage for it.
    pub fn keep_place(&mut self, address: u16, config: &MasterConfig) -> bool {
        let Some(station) = self.all.get_mut(self.found) else { return false };
        station.found(address, config.slave(address));
        station.presence = Presence::Absent;
        self.found += 1;
        self.count_anew();
        true
    }

    /// The presence of a slave has changed.
    pub fn count_anew(&mut self) {
        self.census = None;
    }

    /// How many slaves are not there.
    pub fn census(&mut self) -> Census {
        let stations = &self.all[..self.found];
        *self.census.get_or_insert_with(|| Census {
            free: stations.iter().filter(|station| station.may_come()).count(),
            lost: stations.iter().filter(|station| station.presence == Presence::Lost).count(),
        })
    }

    /// S-DEV of a slave that is there, in this cycle.
    pub fn valid_status(&self, index: usize) -> Option<DeviceStatus> {
        self.get(index)?.link.status.filter(|&status| is_valid(self.phase, status))
    }

    pub fn is_valid(&self, index: usize) -> bool {
        self.valid_status(index).is_some()
    }

    /// All ATs of the cycle are read: which stations turn telegrams round.
    pub fn find_turning(&mut self) {
        self.turning.clear();
        for index in 0..self.found {
            let turns = self.valid_status(index).is_some_and(|status| match status.topology() {
                Topology::LoopbackForwardPrimary | Topology::LoopbackForwardSecondary => true,
                Topology::FastForward | Topology::StoreAndForward => false,
            });
            if turns {
                self.turning.push(SlaveId::from_index(index).0);
            }
        }
    }

    pub fn any_active(&self) -> bool {
        self.iter().any(Station::is_active)
    }

    /// A slave that takes part is not seen in this cycle.
    pub fn any_unseen(&self) -> bool {
        (0..self.found).any(|index| self.all[index].is_active() && !self.is_valid(index))
    }

    /// The next outcome of a request: each station in its turn, those that were there before the last scan as well.
    pub fn take_outcome(&mut self) -> Option<Event> {
        for index in (self.next_outcome..self.all.len()).chain(0..self.next_outcome) {
            if let Some((place, serial, outcome)) = self.all[index].channel.take_outcome() {
                self.next_outcome = index + 1;
                let ticket = Ticket { slave: SlaveId::from_index(index), place, serial };
                return Some(Event::Svc { ticket, outcome });
            }
        }
        None
    }
}

/// A slave is there: S-DEV is not empty in CP2, SlaveValid in the other phases.
pub(super) fn is_valid(phase: Phase, status: DeviceStatus) -> bool {
    match phase {
        Phase::CP2 => !status.is_empty(),
        _ => status.contains(DeviceStatus::SLAVE_VALID),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::header::MacAddress;

    const MAC: MacAddress = [2, 0, 0, 0, 0, 1];

    #[test]
    fn census_follows_places_and_lost_slaves() {
        let config = MasterConfig { slaves_max: 3, ..MasterConfig::new(MAC, 1_000_000) };
        let mut stations = Stations::new(&config);
        stations.found([7, 9].into_iter(), &config);
        assert_eq!((stations.len(), stations.scanned), (2, 2));
        assert_eq!((stations.census().free, stations.census().lost), (0, 0));
        assert!(stations.keep_place(11, &config) && !stations.keep_place(13, &config));
        assert_eq!((stations.len(), stations.scanned, stations.census().free), (3, 2, 1));
        stations[0].presence = Presence::Lost;
        stations.count_anew();
        // It has neither a place kept by the configuration nor SCP_HP: nothing lets it come back.
        assert_eq!((stations.census().free, stations.census().lost), (1, 1));
    }

    #[test]
    fn valid_status_depends_on_the_phase() {
        let config = MasterConfig { slaves_max: 1, ..MasterConfig::new(MAC, 1_000_000) };
        let mut stations = Stations::new(&config);
        stations.found([7].into_iter(), &config);
        stations[0].link.status = Some(DeviceStatus::COMMAND_CHANGE);
        stations.phase = Phase::CP2;
        assert!(stations.is_valid(0) && !stations.any_unseen());
        stations.phase = Phase::CP4;
        assert!(!stations.is_valid(0) && stations.any_unseen());
        stations[0].link.status = Some(DeviceStatus::SLAVE_VALID);
        assert!(stations.is_valid(0));
        stations.find_turning();
        assert!(stations.turning.is_empty());
    }
}
