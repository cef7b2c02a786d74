//! One master an interface on this host.
//!
//! Two masters on one bus wreck each other's drives. The first one holds a socket with an abstract name made from the number of the
//! interface: such names are per network namespace, as interfaces are, leave nothing in a file system, and are gone with the process,
//! however it has ended. A second name beside it says who holds it; the kernel lists the names of this namespace.

use std::fmt;
use std::io;
use std::os::linux::net::SocketAddrExt as _;
use std::os::unix::net::{SocketAddr, UnixDatagram};

use super::link;

/// What the names begin with.
const PREFIX: &str = "axisbridge/master/";

/// The names of the network namespace of the calling thread.
const NAMES: &str = "/proc/thread-self/net/unix";

/// Longest part of a command line that is told.
const COMMAND_MAX: usize = 60;

/// Why the master's place on an interface is not to be had.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// Somebody has it.
    #[error(
        "`{interface}` has a master already: {holder}. Two masters on one bus stop each other's drives: end that one first"
    )]
    Held {
        /// The interface.
        interface: String,
        /// Who has it.
        holder: Holder,
    },
    /// The interface is not there.
    #[error("there is no network interface `{interface}`")]
    NoSuchInterface {
        /// The name asked for.
        interface: String,
    },
    /// The system refused for another reason.
    #[error("cannot reserve `{interface}` for one master: {source}")]
    System {
        /// The interface.
        interface: String,
        /// What the system said.
        source: io::Error,
    },
}

/// Who has an interface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Holder {
    /// This process.
    Own,
    /// A process, as it has said itself.
    Process {
        /// Its number, in its own PID namespace.
        id: u32,
        /// Its command line, shortened.
        command: String,
    },
    /// One that has not said who it is.
    Unknown,
}

impl fmt::Display for Holder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Own => f.write_str("this process"),
            Self::Process { id, command } => write!(f, "process {id} (`{command}`)"),
            Self::Unknown => f.write_str("another process"),
        }
    }
}

/// The master's place on an interface, until it is dropped.
#[derive(Debug)]
pub struct InterfaceLock {
    _place: UnixDatagram,
    _holder: UnixDatagram,
}

impl InterfaceLock {
    /// Takes the master's place on an interface.
    ///
    /// # Errors
    /// [`LockError`].
    pub fn take(interface: &str) -> Result<Self, LockError> {
        let name = || interface.to_owned();
        let system = |source| LockError::System { interface: name(), source };
        let index = link::index(interface).map_err(|_| LockError::NoSuchInterface { interface: name() })?;
        let place = format!("{PREFIX}{index}");
        let process = std::process::id();
        match bind(&place) {
            Ok(place_socket) => {
                // Who it is comes second: a reader in between learns less.
                let holder = format!("{place}/{process}/{}", own_command());
                Ok(Self { _place: place_socket, _holder: bind(&holder).map_err(system)? })
            }
            Err(error) if error.kind() == io::ErrorKind::AddrInUse => {
                let names = std::fs::read(NAMES).unwrap_or_default();
                let holder = match find_holder(&String::from_utf8_lossy(&names), &place) {
                    Holder::Process { id, .. } if id == process => Holder::Own,
                    holder => holder,
                };
                Err(LockError::Held { interface: name(), holder })
            }
            Err(error) => Err(system(error)),
        }
    }
}

fn bind(name: &str) -> io::Result<UnixDatagram> {
    UnixDatagram::bind_addr(&SocketAddr::from_abstract_name(name)?)
}

/// The command line of this process: the program without its folder, and what fits of its arguments.
fn own_command() -> String {
    let mut arguments = std::env::args();
    let program = arguments.next().unwrap_or_default();
    let program = program.rsplit('/').next().unwrap_or_default().to_owned();
    let words: Vec<_> = std::iter::once(program).chain(arguments).collect();
    let line: String = words.join(" ").chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let end =
        line.char_indices().map(|(at, c)| at + c.len_utf8()).take_while(|end| *end <= COMMAND_MAX).last();
    line[..end.unwrap_or(0)].to_owned()
}

/// Who has said in the kernel's list of names that he has a place. An abstract name stands in it with an `@` in front.
fn find_holder(names: &str, place: &str) -> Holder {
    let holder = names.lines().find_map(|line| {
        let (_, name) = line.split_once(" @")?;
        let (id, command) = name.strip_prefix(place)?.strip_prefix('/')?.split_once('/')?;
        Some(Holder::Process { id: id.parse().ok()?, command: command.to_owned() })
    });
    holder.unwrap_or(Holder::Unknown)
}

#[cfg(test)]
mod tests {
    use super::super::namespace::{in_namespace, ip};
    use super::*;

    #[test]
    fn the_second_one_is_refused_and_told_who_has_the_interface() {
        in_namespace("the_second_one_is_refused_and_told", || {
            ip("link add south0 type veth peer name south1");
            let first = InterfaceLock::take("south0").unwrap();
            let error = InterfaceLock::take("south0").unwrap_err();
            assert!(
                matches!(&error, LockError::Held { holder: Holder::Own, interface } if interface == "south0")
            );
            assert_eq!(
                error.to_string(),
                "`south0` has a master already: this process. Two masters on one bus stop each other's drives: end that one first"
            );
            let other = InterfaceLock::take("south1").unwrap();
            drop((first, other));
            InterfaceLock::take("south0").unwrap();
            assert!(matches!(InterfaceLock::take("none0"), Err(LockError::NoSuchInterface { .. })));
        });
    }

    #[test]
    fn the_kernel_s_list_is_read() {
        let names = "Num       RefCount Protocol Flags    Type St Inode Path\n\
            0000000000000000: 00000002 00000000 00000000 0002 01 19022 /run/systemd/notify\n\
            0000000000000000: 00000002 00000000 00000000 0002 01 19023 @axisbridge/master/3\n\
            0000000000000000: 00000002 00000000 00000000 0002 01 19024 @axisbridge/master/31/7/x\n\
            0000000000000000: 00000002 00000000 00000000 0002 01 19025 @axisbridge/master/3/4711/axisbridge run --config /etc/a.toml\n";
        let command = "axisbridge run --config /etc/a.toml".to_owned();
        let found = find_holder(names, "axisbridge/master/3");
        assert_eq!(found, Holder::Process { id: 4711, command });
        assert_eq!(found.to_string(), "process 4711 (`axisbridge run --config /etc/a.toml`)");
        for other in ["axisbridge/master/4", "axisbridge/master/", ""] {
            assert_eq!(find_holder(names, other), Holder::Unknown, "{other}");
        }
        assert_eq!(find_holder("", "axisbridge/master/3"), Holder::Unknown);
        assert!(own_command().len() <= COMMAND_MAX && !own_command().is_empty());
    }
}
