//! For tests: a thread inside a network namespace of its own.
//!
//! The namespace lives as long as the thread and its sockets; nothing has to be cleaned up.

use std::process::Command;

use nix::sched::{CloneFlags, unshare};

/// Runs `test` on a thread in a fresh network namespace, or says that it was skipped.
pub(super) fn in_namespace(name: &str, test: impl FnOnce() + Send + 'static) {
    let ran = std::thread::spawn(move || {
        // Only the calling thread moves to the new namespace.
        unshare(CloneFlags::CLONE_NEWNET)?;
        test();
        Ok::<(), nix::Error>(())
    })
    .join();
    match ran {
        Ok(Ok(())) => {}
        Ok(Err(error)) => println!("SKIPPED: {name}: cannot make a network namespace: {error}"),
        Err(panic) => std::panic::resume_unwind(panic),
    }
}

/// `ip` with these words, in the namespace of the calling thread.
pub(super) fn ip(words: &str) {
    let status = Command::new("ip").args(words.split_whitespace()).status().expect("iproute2 is installed");
    assert!(status.success(), "ip {words}: {status}");
}
