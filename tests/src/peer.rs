//! Foreign peers: present, visibly skipped, or a failure in CI.

use std::path::PathBuf;
use std::process::{Command, Stdio};

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

/// Whether `ptp4l` is here; if not, `test` is skipped visibly (or fails in CI).
#[must_use]
pub fn ptp4l_or_skip(test: &str) -> bool {
    // It has no `--version`.
    let here = Command::new("ptp4l").arg("-v").output().is_ok_and(|output| output.status.success());
    if !here {
        skip(test, "ptp4l (Debian package linuxptp)");
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

/// Whether a kernel with CAN can be started (User-Mode Linux); if not, `test` is skipped visibly (or fails in CI).
#[must_use]
pub fn can_kernel_or_skip(test: &str) -> bool {
    let here = crate::can_kernel::available();
    if !here {
        skip(test, "a kernel with CAN (Debian package user-mode-linux)");
    }
    here
}

/// A Python that has `module`; without one `test` is skipped visibly (or fails in CI).
///
/// Asked in this order: `AXISBRIDGE_PYTHON`, the environment that `.ci/run` makes, and `python3`.
#[must_use]
pub fn python_or_skip(test: &str, module: &str) -> Option<PathBuf> {
    let found = pythons().chain([PathBuf::from("python3")]).find(|python| {
        let import = Command::new(python)
            .args(["-c", &format!("import {module}")])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        import.is_ok_and(|status| status.success())
    });
    if found.is_none() {
        skip(test, &format!("a Python with the package {module}"));
    }
    found
}

/// The Pythons with packages of their own: `AXISBRIDGE_PYTHON`, and the environment that `.ci/run` makes.
fn pythons() -> impl Iterator<Item = PathBuf> {
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/ci-tools/bin/python");
    std::env::var_os("AXISBRIDGE_PYTHON").map(PathBuf::from).into_iter().chain([PathBuf::from(own)])
}

/// The taplo that is installed with one of these Pythons, or on the path; without one `test` is skipped visibly (or fails in CI).
#[must_use]
pub fn taplo_or_skip(test: &str) -> Option<PathBuf> {
    let installed = pythons().map(|python| python.with_file_name("taplo"));
    let found = installed.chain([PathBuf::from("taplo")]).find(|taplo| has_program(&taplo.to_string_lossy()));
    if found.is_none() {
        skip(test, "taplo");
    }
    found
}

/// Whether nmap with its script `enip-info` is here; if not, `test` is skipped visibly (or fails in CI).
#[must_use]
pub fn nmap_or_skip(test: &str) -> bool {
    let here = Command::new("nmap")
        .args(["--script-help", "enip-info"])
        .output()
        .is_ok_and(|output| output.status.success() && !output.stdout.is_empty());
    if !here {
        skip(test, "nmap with its script enip-info");
    }
    here
}

/// The browser Chromium; without it `test` is skipped visibly (or fails in CI).
#[must_use]
pub fn chromium_or_skip(test: &str) -> Option<PathBuf> {
    let found = ["chromium", "chromium-browser"].into_iter().find(|program| has_program(program));
    if found.is_none() {
        skip(test, "the browser Chromium");
    }
    found.map(PathBuf::from)
}

fn in_ci() -> bool {
    std::env::var("CI").is_ok_and(|value| value == "true" || value == "1")
}
