//! Places for the connections of a server: for hosts that it serves, and never all of them for one.

use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use profile_cip::device::hosts::Hosts;

/// Why a host has no place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoPlace {
    /// It is not served.
    #[error("the host is not among `clients`")]
    NotServed,
    /// All places are taken.
    #[error("too many are open")]
    All,
    /// It has as many as one host may have.
    #[error("this host has {0} open")]
    Host(usize),
}

/// A bounded number of places.
#[derive(Debug)]
pub struct Places {
    hosts: Hosts,
    max: usize,
    of_host_max: usize,
    /// The host of each place that is taken.
    taken: Mutex<Vec<IpAddr>>,
}

/// A place; it is free again when this is dropped.
#[derive(Debug)]
pub struct Place {
    places: Arc<Places>,
    host: IpAddr,
}

impl Places {
    /// So many places for these hosts, of which one host may have three quarters.
    #[must_use]
    pub fn new(max: usize, hosts: Hosts) -> Arc<Self> {
        let taken = Mutex::new(Vec::with_capacity(max));
        Arc::new(Self { hosts, max, of_host_max: max - max / 4, taken })
    }

    /// A place for a connection of this host.
    ///
    /// # Errors
    /// Why there is none.
    pub fn take(self: &Arc<Self>, host: IpAddr) -> Result<Place, NoPlace> {
        let host = host.to_canonical();
        if !self.hosts.has(host) {
            return Err(NoPlace::NotServed);
        }
        let mut taken = self.lock();
        if taken.len() >= self.max {
            return Err(NoPlace::All);
        }
        let own = taken.iter().filter(|one| **one == host).count();
        if own >= self.of_host_max {
            return Err(NoPlace::Host(own));
        }
        taken.push(host);
        Ok(Place { places: Arc::clone(self), host })
    }

    /// Whether no place is taken.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.lock().is_empty()
    }

    fn lock(&self) -> MutexGuard<'_, Vec<IpAddr>> {
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut taken = self.places.lock();
        if let Some(at) = taken.iter().position(|host| *host == self.host) {
            taken.swap_remove(at);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn host(last: u8) -> IpAddr {
        IpAddr::from([192, 0, 2, last])
    }

    #[test]
    fn one_host_leaves_a_quarter_of_the_places_to_others() {
        let places = Places::new(8, Hosts::EVERYBODY);
        let mut first: Vec<_> = (0..6).map(|_| places.take(host(1)).unwrap()).collect();
        assert_eq!(places.take(host(1)).unwrap_err(), NoPlace::Host(6));
        let mapped = "::ffff:192.0.2.1".parse().unwrap();
        assert_eq!(places.take(mapped).unwrap_err(), NoPlace::Host(6), "the same host");
        let second: Vec<_> = (0..2).map(|_| places.take(host(2)).unwrap()).collect();
        assert_eq!(places.take(host(3)).unwrap_err(), NoPlace::All);
        first.pop();
        let third = places.take(host(3)).unwrap();
        drop((first, second, third));
        assert!(places.is_empty());
    }

    #[test]
    fn few_places_can_all_be_of_one_host() {
        for (max, of_host) in [(1, 1), (2, 2), (3, 3), (4, 3), (64, 48)] {
            let places = Places::new(max, Hosts::EVERYBODY);
            let taken: Vec<_> = std::iter::from_fn(|| places.take(host(1)).ok()).collect();
            assert_eq!(taken.len(), of_host);
        }
    }

    #[test]
    fn hosts_that_are_not_listed_have_no_place() {
        let places = Places::new(4, Hosts::of([host(1)..=host(1)]));
        assert_eq!(places.take(host(2)).unwrap_err(), NoPlace::NotServed);
        assert!(places.take(host(1)).is_ok());
    }
}
