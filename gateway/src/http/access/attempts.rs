//! How often a host may show a token: a few times at once, then one in ten seconds.

use std::net::{IpAddr, Ipv6Addr};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Time that each attempt costs.
const COST: Duration = Duration::from_secs(10);

/// Attempts at once.
const AT_ONCE: u32 = 5;

/// Hosts that are counted. Further ones wait until one is forgotten: that bounds the attempts of all hosts together.
const HOSTS_MAX: usize = 64;

/// The attempts of the last minute.
#[derive(Debug, Default)]
pub struct Attempts(Mutex<Vec<Host>>);

/// A host, and when it has all its attempts again.
#[derive(Debug)]
struct Host {
    address: IpAddr,
    whole: Instant,
}

impl Attempts {
    /// Takes an attempt of a host.
    ///
    /// # Errors
    /// It has none left: how long until the next one.
    pub fn take(&self, now: Instant, host: IpAddr) -> Result<(), Duration> {
        let address = network(host);
        let mut hosts = self.lock();
        hosts.retain(|host| host.whole > now);
        let known = hosts.iter_mut().find(|host| host.address == address);
        let Some(known) = known else {
            if hosts.len() >= HOSTS_MAX {
                return Err(COST);
            }
            hosts.push(Host { address, whole: now + COST });
            return Ok(());
        };
        let whole = known.whole + COST;
        match whole.duration_since(now).checked_sub(COST * AT_ONCE) {
            Some(wait) if !wait.is_zero() => Err(wait),
            _ => {
                known.whole = whole;
                Ok(())
            }
        }
    }

    /// The attempt of this host was right: it has all of them again.
    pub fn forget(&self, host: IpAddr) {
        let address = network(host);
        self.lock().retain(|host| host.address != address);
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Host>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What counts as one host: an IPv4 address, or the network of 64 bits in which a host takes IPv6 addresses as it likes.
fn network(host: IpAddr) -> IpAddr {
    match host.to_canonical() {
        IpAddr::V4(address) => address.into(),
        IpAddr::V6(address) => Ipv6Addr::from_bits(address.to_bits() & (u128::MAX << 64)).into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn host(text: &str) -> IpAddr {
        text.parse().unwrap()
    }

    #[test]
    fn host_has_five_attempts_and_then_one_in_ten_seconds() {
        let (attempts, now, one) = (Attempts::default(), Instant::now(), host("192.0.2.1"));
        for _ in 0..5 {
            assert_eq!(attempts.take(now, one), Ok(()));
        }
        assert_eq!(attempts.take(now, one), Err(Duration::from_secs(10)));
        assert_eq!(
            attempts.take(now, host("::ffff:192.0.2.1")),
            Err(Duration::from_secs(10)),
            "the same host"
        );
        assert_eq!(attempts.take(now, host("192.0.2.2")), Ok(()), "another host");
        let later = now + Duration::from_secs(10);
        assert_eq!(attempts.take(later, one), Ok(()));
        assert_eq!(attempts.take(later, one), Err(Duration::from_secs(10)), "what is refused costs nothing");
        attempts.forget(one);
        assert_eq!(attempts.take(later, one), Ok(()), "after a right one");
    }

    #[test]
    fn many_addresses_are_no_way_around() {
        let (attempts, now) = (Attempts::default(), Instant::now());
        for last in 0..5 {
            assert_eq!(attempts.take(now, host(&format!("2001:db8::{last}"))), Ok(()));
        }
        assert_eq!(attempts.take(now, host("2001:db8::ffff:1")), Err(Duration::from_secs(10)));
        for last in 1..HOSTS_MAX {
            assert_eq!(attempts.take(now, host(&format!("192.0.2.{last}"))), Ok(()));
        }
        assert_eq!(attempts.take(now, host("198.51.100.1")), Err(COST));
        assert_eq!(attempts.take(now + COST, host("198.51.100.1")), Ok(()), "the others are forgotten");
    }
}
