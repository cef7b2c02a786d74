//! `[http]`.

use std::net::SocketAddr;
use std::path::PathBuf;

use super::{Problems, hosts, value};
use crate::config::file::{HttpTable, ModbusTable};
use crate::config::{Http, TlsFiles};
use crate::finding::Spanned;
use crate::finding::registry as code;

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
    let token = file(problems, table.token.as_ref(), "the token");
    let tls = tls(problems, table);
    let (listen, tls) = (listen?, tls?);
    if let Some(token) = &table.token
        && !listen.ip().to_canonical().is_loopback()
        && tls.is_none()
        && !is_plain(table)
    {
        return problems.report_as(
            code::CONTRADICTION,
            token.span(),
            format_args!("the token would cross the network to {listen} without encryption"),
            "expected `certificate` and `key`, a loopback address, or `plain = true`",
        );
    }
    Some(Http { listen, clients: clients?, connections_max: connections_max?, token, tls })
}

/// Whether the token may cross the network without encryption.
pub(in crate::config) fn is_plain(table: &HttpTable) -> bool {
    table.plain.as_ref().is_some_and(|plain| *plain.get_ref())
}

/// The path of a file.
fn file(problems: &mut Problems, path: Option<&Spanned<String>>, what: &str) -> Option<PathBuf> {
    let path = path?;
    value::path(problems, path, what);
    Some(PathBuf::from(path.get_ref()))
}

/// Certificate and key, which belong together.
fn tls(problems: &mut Problems, table: &HttpTable) -> Option<Option<TlsFiles>> {
    let certificate = file(problems, table.certificate.as_ref(), "the certificate");
    let key = file(problems, table.key.as_ref(), "the private key");
    let alone = |problems: &mut Problems, there: &Spanned<String>, is: &str, lacks: &str| {
        problems.report_as(
            code::CONTRADICTION,
            there.span(),
            format_args!("there is {is} without {lacks}"),
            "expected `certificate` and `key`, or neither",
        )
    };
    match (certificate, key, &table.certificate, &table.key) {
        (Some(certificate), Some(key), ..) => Some(Some(TlsFiles { certificate, key })),
        (_, _, Some(there), None) => alone(problems, there, "a certificate", "its key"),
        (_, _, None, Some(there)) => alone(problems, there, "a key", "its certificate"),
        _ => Some(None),
    }
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
    fn token_needs_encryption_beyond_the_host_unless_it_may_be_plain() {
        let token = |listen: &str, more: &str| {
            checked(&format!("listen = \"{listen}\"\ntoken = \"t\"\n{more}"), alone).map(|http| http.token)
        };
        let good = Ok(Some(PathBuf::from("t")));
        for loopback in ["127.0.0.1:80", "127.9.0.1:80", "[::1]:80", "[::ffff:127.0.0.1]:80"] {
            assert_eq!(token(loopback, ""), good, "{loopback}");
        }
        for (listen, shown) in
            [("192.0.2.1:80", "192.0.2.1:80"), ("0.0.0.0:80", "0.0.0.0:80"), ("[::]:80", "[::]:80")]
        {
            let text = format!("the token would cross the network to {shown} without encryption");
            assert_eq!(token(listen, ""), Err(vec![text.clone()]));
            assert_eq!(token(listen, "plain = false"), Err(vec![text]));
            assert_eq!(token(listen, "plain = true"), good);
            assert_eq!(token(listen, "certificate = \"c\"\nkey = \"k\""), good);
        }
    }

    #[test]
    fn certificate_and_key_belong_together() {
        let tls =
            |text: &str| checked(&format!("listen = \"0.0.0.0:80\"\n{text}"), alone).map(|http| http.tls);
        let files = TlsFiles { certificate: "c".into(), key: "k".into() };
        assert_eq!(tls("certificate = \"c\"\nkey = \"k\""), Ok(Some(files)));
        assert_eq!(tls(""), Ok(None));
        assert_eq!(
            tls("certificate = \"c\""),
            Err(vec!["there is a certificate without its key".to_owned()])
        );
        assert_eq!(tls("key = \"k\""), Err(vec!["there is a key without its certificate".to_owned()]));
        assert_eq!(
            tls("certificate = \"\"\nkey = \"k\""),
            Err(vec!["the path of the certificate is empty".to_owned()])
        );
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
