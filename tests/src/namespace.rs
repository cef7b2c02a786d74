//! Network namespaces and the virtual cables between them, removed again when dropped.

use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};

static NEXT: AtomicU32 = AtomicU32::new(0);

/// Whether this process may make network namespaces.
#[must_use]
pub fn available() -> bool {
    // Tests of one process ask at the same time.
    let serial = NEXT.fetch_add(1, Ordering::Relaxed);
    let name = format!("axb-{}-{serial}-probe", std::process::id());
    let made = ip(&["netns", "add", &name]);
    if made {
        ip(&["netns", "del", &name]);
    }
    made
}

/// One network namespace of this test; deleted, with its ends of all cables, when dropped.
#[derive(Debug)]
pub struct Namespace {
    name: String,
}

impl Namespace {
    /// Makes a namespace with its loopback up; `role` becomes part of its name.
    ///
    /// # Panics
    /// When `ip netns add` fails: ask [`available`] first.
    #[must_use]
    pub fn new(role: &str) -> Self {
        let serial = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = format!("axb-{}-{serial}-{role}", std::process::id());
        assert!(ip(&["netns", "add", &name]), "cannot add the network namespace {name}");
        let namespace = Self { name };
        assert!(ip(&["-n", &namespace.name, "link", "set", "lo", "up"]), "cannot raise loopback");
        namespace
    }

    /// Its name, as `ip netns exec` takes it.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// A command that runs `program` inside this namespace.
    #[must_use]
    pub fn command(&self, program: &str) -> Command {
        let mut command = Command::new("ip");
        command.args(["netns", "exec", &self.name, program]);
        command
    }

    /// Gives an interface an address with prefix length.
    ///
    /// # Panics
    /// When the interface does not exist here, or has the address already.
    pub fn add_address(&self, interface: &str, address: &str) {
        assert!(
            ip(&["-n", &self.name, "addr", "add", address, "dev", interface]),
            "cannot give {interface} the address {address}"
        );
    }

    /// Takes one end of a cable down or up.
    ///
    /// # Panics
    /// When the interface does not exist here.
    pub fn set_link(&self, interface: &str, up: bool) {
        let state = if up { "up" } else { "down" };
        assert!(ip(&["-n", &self.name, "link", "set", interface, state]), "cannot set {interface} {state}");
    }
}

impl Drop for Namespace {
    fn drop(&mut self) {
        ip(&["netns", "del", &self.name]);
    }
}

/// Lays a cable (a veth pair) between two namespaces; each end is an interface name, and optionally an address
/// with prefix length.
///
/// # Panics
/// When the pair cannot be made.
pub fn cable(a: (&Namespace, &str, Option<&str>), b: (&Namespace, &str, Option<&str>)) {
    let made = ip(&[
        "link", "add", a.1, "netns", &a.0.name, "type", "veth", "peer", "name", b.1, "netns", &b.0.name,
    ]);
    assert!(made, "cannot lay a cable from {} to {}", a.1, b.1);
    for (namespace, interface, address) in [a, b] {
        if let Some(address) = address {
            namespace.add_address(interface, address);
        }
        namespace.set_link(interface, true);
    }
}

fn ip(arguments: &[&str]) -> bool {
    Command::new("ip")
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}
