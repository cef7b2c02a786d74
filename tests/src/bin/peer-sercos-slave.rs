//! `peer-sercos-slave TO FROM INTERFACE`: the SERCOS slave of the crate `axisbridge-peers` on an Ethernet interface, of class SCP_FixCFG
//! with these lists of IDNs (`S-0-0134,S-0-0036 S-0-0135,S-0-0051,S-0-0040`). What happens to it stands on standard error, and a line
//! with its velocity each second on standard output.

use std::process::ExitCode;
use std::time::{Duration, Instant};

use axisbridge::sys::packet_socket::{self, PacketSocket};
use axisbridge_peers::sercos_slave::{Connection, Idn, SercosSlave, Settings};

/// EtherType of SERCOS III.
const ETHER_TYPE: u16 = 0x88CD;

/// How often time passes in the slave.
const TICK: Duration = Duration::from_millis(1);

/// The longest frame.
const FRAME_MAX: usize = 1_536;

fn list(text: &str) -> Option<Vec<Idn>> {
    text.split(',').map(|name| name.strip_prefix("S-0-")?.parse().ok().map(Idn::s)).collect()
}

fn settings(to: &str, from: &str) -> Option<Settings> {
    let mut settings = Settings { neighbour: [true, false], ..Settings::fixcfg() };
    settings.connections = vec![
        Connection { list: list(to)?, ..Connection::default() },
        Connection { producer: true, list: list(from)?, ..Connection::default() },
    ];
    Some(settings)
}

fn run(settings: Settings, interface: &str) -> Result<(), Box<dyn std::error::Error>> {
    let sockets = [PacketSocket::open(interface, ETHER_TYPE)?];
    let begin = Instant::now();
    let mut slave = SercosSlave::new(settings);
    let (mut told, mut second) = (0, 0);
    let mut buffer = [0; FRAME_MAX];
    loop {
        packet_socket::wait(&sockets, TICK)?;
        let now = u64::try_from(begin.elapsed().as_nanos())?;
        slave.tick(now);
        while let Ok(Some(received)) = sockets[0].recv(&mut buffer) {
            let Some(frame) = buffer.get_mut(..received.len) else { continue };
            let now = u64::try_from(begin.elapsed().as_nanos())?;
            if slave.pass(now, 1, frame) == Some(1) {
                // What cannot be sent is lost, as on a wire.
                let _ = sockets[0].send(frame);
            }
        }
        for line in &slave.log()[told..] {
            eprintln!("{line}");
        }
        told = slave.log().len();
        if begin.elapsed().as_secs() > second {
            second = begin.elapsed().as_secs();
            println!(
                "velocity {:.3} torque {}",
                slave.velocity(),
                if slave.enabled() { "on" } else { "off" }
            );
        }
    }
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let known = match words.as_slice() {
        [to, from, interface] => settings(to, from).map(|settings| (settings, interface)),
        _ => None,
    };
    let Some((settings, interface)) = known else {
        eprintln!("error: expected two lists such as S-0-0134,S-0-0036 and an interface");
        return ExitCode::from(2);
    };
    match run(settings, interface) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
