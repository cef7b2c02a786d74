//! Network namespaces of this process. One lives as long as something of this process is in it; nothing has to be cleaned up.

use std::fs::File;
use std::io;
use std::os::fd::AsRawFd as _;
use std::process::Command;

use nix::sched::{CloneFlags, setns, unshare};

/// The namespace of the calling thread.
const OWN: &str = "/proc/thread-self/ns/net";

/// A network namespace without interfaces but its loopback.
#[derive(Debug)]
pub struct Namespace(File);

impl Namespace {
    /// Makes a namespace. The calling thread stays where it is.
    ///
    /// # Errors
    /// What the system says: it takes the capability `CAP_SYS_ADMIN`.
    pub fn new() -> io::Result<Self> {
        let before = File::open(OWN)?;
        // Only the calling thread moves to the new namespace, and back again.
        unshare(CloneFlags::CLONE_NEWNET)?;
        let made = File::open(OWN);
        setns(before, CloneFlags::CLONE_NEWNET)?;
        Ok(Self(made?))
    }

    /// Runs `f` with the calling thread in this namespace. Sockets and threads that it makes stay in it.
    ///
    /// # Errors
    /// What the system says; then `f` was not run, or the thread could not go back.
    pub fn inside<T>(&self, f: impl FnOnce() -> T) -> io::Result<T> {
        let before = File::open(OWN)?;
        setns(&self.0, CloneFlags::CLONE_NEWNET)?;
        let result = f();
        setns(before, CloneFlags::CLONE_NEWNET)?;
        Ok(result)
    }

    /// Its name for `ip`, as long as it lives.
    #[must_use]
    pub fn path(&self) -> String {
        format!("/proc/{}/fd/{}", std::process::id(), self.0.as_raw_fd())
    }
}

/// Runs `ip` of iproute2 with these words, in the namespace of the calling thread.
///
/// # Errors
/// It is not installed, or it refuses: with what it says.
pub fn run_ip(words: &str) -> io::Result<()> {
    let output = Command::new("ip")
        .args(words.split_whitespace())
        .output()
        .map_err(|error| io::Error::new(error.kind(), format!("cannot run `ip` of iproute2: {error}")))?;
    if output.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    Err(io::Error::other(format!("ip {words}: {}", said.trim())))
}

/// For tests: the same, which has to work.
#[cfg(test)]
pub(super) fn ip(words: &str) {
    run_ip(words).unwrap();
}

/// For tests: runs `test` on a thread in a fresh network namespace, or says that it was skipped.
#[cfg(test)]
pub(super) fn in_namespace(name: &str, test: impl FnOnce() + Send + 'static) {
    let ran = std::thread::spawn(move || {
        let namespace = Namespace::new()?;
        namespace.inside(test)
    })
    .join();
    match ran {
        Ok(Ok(())) => {}
        Ok(Err(error)) => println!("SKIPPED: {name}: cannot make a network namespace: {error}"),
        Err(panic) => std::panic::resume_unwind(panic),
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::*;
    use crate::sys::interfaces::name_of;

    #[test]
    fn a_cable_joins_two_namespaces_and_the_thread_stays_where_it_was() {
        let (Ok(a), Ok(b)) = (Namespace::new(), Namespace::new()) else {
            return println!("SKIPPED: cannot make a network namespace");
        };
        let [here, there] = [Ipv4Addr::new(198, 51, 100, 1), Ipv4Addr::new(198, 51, 100, 2)];
        let made = a.inside(|| {
            run_ip(&format!("link add net0 type veth peer name net1 netns {}", b.path()))?;
            run_ip(&format!("addr add {here}/24 dev net0"))
        });
        made.unwrap().unwrap();
        b.inside(|| run_ip(&format!("addr add {there}/24 dev net1"))).unwrap().unwrap();
        assert_eq!(a.inside(|| name_of(here)).unwrap().as_deref(), Some("net0"));
        assert_eq!(b.inside(|| name_of(there)).unwrap().as_deref(), Some("net1"));
        assert_eq!((name_of(here), name_of(there)), (None, None));
        let refused = a.inside(|| run_ip("link set no-such up")).unwrap().unwrap_err();
        assert!(refused.to_string().starts_with("ip link set no-such up: Cannot find device"), "{refused}");
    }
}
