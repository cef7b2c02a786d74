//! Foreign peers: present, visibly skipped, or a failure in CI.

use std::process::Command;

/// Whether the named program can be started.
#[must_use]
pub fn has_program(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success())
}

/// Says that `test` is skipped because `peer` is missing; in CI (`CI=true`) it fails instead.
///
/// # Panics
/// When the environment says that this is CI.
pub fn skip(test: &str, peer: &str) {
    assert!(!in_ci(), "{test} needs {peer}, and CI must have it");
    // Past the test harness's capture, so that a user sees what did not run.
    use std::io::Write as _;
    let _ = writeln!(std::io::stderr(), "SKIPPED {test}: {peer} is not available on this machine");
}

/// Whether `tshark` is here; if not, `test` is skipped visibly (or fails in CI).
#[must_use]
pub fn tshark_or_skip(test: &str) -> bool {
    let here = has_program("tshark");
    if !here {
        skip(test, "tshark");
    }
    here
}

/// Whether network namespaces can be made (root and iproute2); if not, `test` is skipped visibly (or fails in CI).
#[must_use]
pub fn namespaces_or_skip(test: &str) -> bool {
    let here = crate::namespace::available();
    if !here {
        skip(test, "network namespaces (root and iproute2)");
    }
    here
}

fn in_ci() -> bool {
    std::env::var("CI").is_ok_and(|value| value == "true" || value == "1")
}
