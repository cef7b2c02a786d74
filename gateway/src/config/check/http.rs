//! `[http]`.

use std::net::SocketAddr;

use super::{Problems, hosts, value};
use crate::config::Http;
use crate::config::file::{HttpTable, ModbusTable};

pub(super) fn check(
    problems: &mut Problems,
    table: &HttpTable,
    modbus: Option<&ModbusTable>,
) -> Option<Http> {
    let listen = value::socket_address(problems, &table.listen);
    let clients = hosts::check(problems, table.clients.as_ref(), "clients", false);
    let connections_max =
        value::number_or(problems, &table.connections_max, "the number of HTTP connections", 8..=256, 64);
    if let (Some(own), Some(modbus)) = (listen, modbus)
        && own.port() != 0
        && modbus.listen.get_ref().parse::<SocketAddr>().is_ok_and(|other| other == own)
    {
        let what = format!("the listen address `{own}`");
        problems.duplicate(&what, modbus.listen.span(), table.listen.span());
    }
    Some(Http { listen: listen?, clients: clients?, connections_max: connections_max? })
}

#[cfg(test)]
mod tests {
    use super::super::checked;
    use super::*;

    fn alone(problems: &mut Problems, table: &HttpTable) -> Option<Http> {
        check(problems, table, None)
    }

    #[test]
    fn sixty_four_connections_are_open_at_most_unless_configured() {
        let found = checked("listen = \"[::1]:8080\"", alone).unwrap();
        assert_eq!((found.listen.port(), found.connections_max), (8080, 64));
        let both = ["`8080` is not an address with a port", "the number of HTTP connections is 7"]
            .map(str::to_owned);
        assert_eq!(checked("listen = \"8080\"\nconnections_max = 7", alone), Err(both.to_vec()));
    }

    #[test]
    fn address_of_the_modbus_server_is_used_twice() {
        let modbus: ModbusTable = toml::from_str("listen = \"0.0.0.0:502\"").unwrap();
        let beside = |text: &str| {
            checked(text, |problems: &mut Problems, table: &HttpTable| check(problems, table, Some(&modbus)))
        };
        let twice = Err(vec!["the listen address `0.0.0.0:502` is used twice".to_owned()]);
        assert_eq!(beside("listen = \"0.0.0.0:502\"").map(|_| ()), twice);
        assert_eq!(beside("listen = \"0.0.0.0:80\"").map(|_| ()), Ok(()));
    }
}
