//! The web page of the demonstration.

use std::io::IsTerminal as _;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::process::{Command, Stdio};

/// Where the page is served unless another address is given.
pub const PAGE: &str = "127.0.0.1:8080";

/// The configuration with an HTTP server at this address.
pub fn with_page(text: &str, address: SocketAddr) -> String {
    format!("{text}\n[http]\nlisten = \"{address}\"\n")
}

/// Where a browser on this host finds the page.
pub fn url(address: SocketAddr) -> String {
    let host = if address.ip().is_unspecified() { IpAddr::V4(Ipv4Addr::LOCALHOST) } else { address.ip() };
    format!("http://{}/", SocketAddr::new(host, address.port()))
}

/// Opens the page in the browser of the desktop, for somebody who sits there. Without one the address has been printed.
pub fn open(url: &str) {
    let desktop = ["WAYLAND_DISPLAY", "DISPLAY"].iter().any(|name| std::env::var_os(name).is_some());
    if !desktop || !std::io::stderr().is_terminal() {
        return;
    }
    let mut command = Command::new("xdg-open");
    let command = command.arg(url).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let Ok(mut child) = command.spawn() else { return };
    // It ends when the browser has the address; nobody waits for it here.
    let _ = std::thread::Builder::new().name("axisbridge-open".to_owned()).spawn(move || child.wait());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::demo::{DriveKind, configuration};
    use crate::config::Config;

    #[test]
    fn every_choice_of_drives_can_have_the_page() {
        let address: SocketAddr = PAGE.parse().unwrap();
        for kinds in [&[DriveKind::Sercos][..], &[DriveKind::Sercos, DriveKind::Can, DriveKind::Devicenet]] {
            let text = with_page(&configuration(kinds), address);
            let config = Config::parse(&text, "demo").unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(config.http.map(|http| http.listen), Some(address));
        }
    }

    #[test]
    fn page_of_all_addresses_is_found_on_this_host() {
        assert_eq!(url("0.0.0.0:8081".parse().unwrap()), "http://127.0.0.1:8081/");
        assert_eq!(url("192.0.2.7:80".parse().unwrap()), "http://192.0.2.7:80/");
    }
}
