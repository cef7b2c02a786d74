//! Lists of hosts.

use std::net::IpAddr;

use ipnet::IpNet;
use profile_cip::device::hosts::Hosts;

use super::Problems;
use crate::finding::Spanned;

/// Longest list; a network takes one entry.
const HOSTS_MAX: usize = 64;

/// The hosts of a list, everybody without one.
pub(super) fn check(
    problems: &mut Problems,
    list: Option<&Spanned<Vec<Spanned<String>>>>,
    what: &str,
    is_v4_only: bool,
) -> Option<Hosts> {
    let Some(list) = list else { return Some(Hosts::EVERYBODY) };
    problems.count(list.get_ref(), what, HOSTS_MAX);
    let networks: Vec<_> = list.get_ref().iter().map(|host| network(problems, host, is_v4_only)).collect();
    let networks: Option<Vec<IpNet>> = networks.into_iter().collect();
    Some(Hosts::of(networks?.iter().map(|network| network.network()..=network.broadcast())))
}

/// An address alone is a network of one host.
fn network(problems: &mut Problems, host: &Spanned<String>, is_v4_only: bool) -> Option<IpNet> {
    let text = host.get_ref();
    let network = text.parse().or_else(|_| text.parse::<IpAddr>().map(IpNet::from));
    // Leading zeros look like another base.
    let has_zero = text.split_once('/').is_some_and(|(_, bits)| bits.len() > 1 && bits.starts_with('0'));
    match network {
        Ok(network @ IpNet::V4(_)) if !has_zero => Some(network),
        Ok(network @ IpNet::V6(_)) if !has_zero && !is_v4_only => Some(network),
        _ => {
            let version = if is_v4_only { "IPv4 " } else { "" };
            problems.report(
                host.span(),
                format_args!("`{text}` is neither a host nor a network"),
                format_args!(
                    "expected an {version}address such as \"192.168.1.20\", or a network such as \"192.168.1.0/24\""
                ),
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::checked;
    use super::*;
    use crate::config::file::HttpTable;

    fn hosts(clients: &str) -> Result<Hosts, Vec<String>> {
        let text = format!("listen = \"127.0.0.1:80\"\nclients = {clients}");
        checked(&text, |problems: &mut Problems, table: &HttpTable| {
            check(problems, table.clients.as_ref(), "clients", false)
        })
    }

    #[test]
    fn addresses_and_networks_are_hosts() {
        let found = hosts("[\"192.0.2.7\", \"198.51.100.9/29\", \"2001:db8::/64\"]").unwrap();
        let has = |host: &str| found.has(host.parse().unwrap());
        for host in ["192.0.2.7", "198.51.100.8", "198.51.100.15", "2001:db8::ffff", "::ffff:192.0.2.7"] {
            assert!(has(host), "{host}");
        }
        for host in ["192.0.2.8", "198.51.100.7", "198.51.100.16", "2001:db8:0:1::", "0.0.0.0"] {
            assert!(!has(host), "{host}");
        }
        assert!(!hosts("[]").unwrap().has("127.0.0.1".parse().unwrap()), "nobody");
        assert!(hosts("[\"0.0.0.0/0\"]").unwrap().has("255.255.255.255".parse().unwrap()));
    }

    #[test]
    fn what_is_no_host_is_reported() {
        for wrong in
            ["192.0.2", "192.0.2.7/33", "192.0.2.7/08", "plc.local", "192.0.2.7:80", "", "2001:db8::/129"]
        {
            let expected = Err(vec![format!("`{wrong}` is neither a host nor a network")]);
            assert_eq!(hosts(&format!("[\"{wrong}\"]")), expected);
        }
    }
}
