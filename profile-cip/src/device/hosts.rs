//! Hosts by their addresses.

use core::net::{IpAddr, Ipv4Addr};
use core::ops::RangeInclusive;

/// Everybody, or the hosts that are listed.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Hosts {
    /// Ranges of addresses, each of one version of IP; `None` for everybody.
    listed: Option<Vec<RangeInclusive<IpAddr>>>,
}

impl Hosts {
    /// Every host.
    pub const EVERYBODY: Self = Self { listed: None };

    /// The hosts of these ranges of addresses; without one, nobody.
    pub fn of(ranges: impl IntoIterator<Item = RangeInclusive<IpAddr>>) -> Self {
        Self { listed: Some(ranges.into_iter().collect()) }
    }

    /// Whether there is a list.
    pub const fn are_listed(&self) -> bool {
        self.listed.is_some()
    }

    /// Whether the host of this address is among them. An IPv4 address in an IPv6 one counts as the IPv4 address.
    pub fn has(&self, host: IpAddr) -> bool {
        let host = host.to_canonical();
        // An IPv4 address is below every IPv6 address, and in no range of those.
        self.listed.as_ref().is_none_or(|ranges| ranges.iter().any(|range| range.contains(&host)))
    }

    /// As [`Hosts::has`], of a host on EtherNet/IP.
    pub fn has_v4(&self, host: Ipv4Addr) -> bool {
        self.has(host.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everybody_is_in_unless_there_is_a_list() {
        let any = IpAddr::from([192, 0, 2, 7]);
        assert!(Hosts::default().has(any) && Hosts::EVERYBODY.has(any) && !Hosts::EVERYBODY.are_listed());
        let nobody = Hosts::of([]);
        assert!(!nobody.has(any) && nobody.are_listed());
    }

    #[test]
    fn a_range_has_its_ends_and_no_other_version_of_ip() {
        let v4 = |last: u8| Ipv4Addr::new(192, 0, 2, last);
        let hosts = Hosts::of([v4(8).into()..=v4(15).into(), v4(40).into()..=v4(40).into()]);
        let found: Vec<u8> = (0..=255).filter(|last| hosts.has_v4(v4(*last))).collect();
        assert_eq!(found, [8, 9, 10, 11, 12, 13, 14, 15, 40]);
        assert!(hosts.has("::ffff:192.0.2.9".parse().unwrap()));
        assert!(!hosts.has("::ffff:192.0.2.16".parse().unwrap()));
        assert!(!hosts.has("2001:db8::9".parse().unwrap()));
        let v6 = Hosts::of(["2001:db8::".parse().unwrap()..="2001:db8::ff".parse().unwrap()]);
        assert!(v6.has("2001:db8::9".parse().unwrap()) && !v6.has("2001:db9::".parse().unwrap()));
        assert!(!v6.has_v4(v4(8)));
    }
}
