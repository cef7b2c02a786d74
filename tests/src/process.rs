//! Child processes of a test: ended by their own id, never left behind.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// The `axisbridge` binary of the tree as it is now, of the same profile as the test itself.
///
/// `cargo test` of one package does not build the binary of another, and an older one may lie about: cargo is asked
/// once a process, which costs little when nothing has changed.
///
/// # Panics
/// When it cannot be built.
#[must_use]
pub fn axisbridge() -> PathBuf {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    BUILT
        .get_or_init(|| {
            let mut directory = std::env::current_exe().expect("the test knows its own path");
            directory.pop();
            if directory.ends_with("deps") {
                directory.pop();
            }
            let mut build = Command::new(env!("CARGO"));
            build.args([
                "build",
                "--quiet",
                "--package",
                "axisbridge",
                "--bin",
                "axisbridge",
                "--target-dir",
            ]);
            build.arg(directory.parent().expect("the profile's folder has a parent"));
            // Together with the running test, which is built: so the dependencies have the same features, and the gateway is not
            // built a second time.
            let program = std::env::current_exe().expect("the test knows its own path");
            let name = program.file_stem().and_then(|stem| stem.to_str()?.rsplit_once('-'));
            let tests = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests"));
            let is_test = |name: &str| tests.join(format!("{name}.rs")).exists() || tests.join(name).exists();
            if let Some((name, _)) = name.filter(|(name, _)| is_test(name)) {
                build.args(["--package", "axisbridge-tests", "--test", name]);
            }
            if directory.ends_with("release") {
                build.arg("--release");
            }
            // Cargo has set these for the test. The build script of `ring` asks for them: it would run again, and everything behind
            // it be built anew, this running test as well.
            for (name, _) in std::env::vars_os() {
                let of_package =
                    |name: &str| ["CARGO_PKG_", "CARGO_MANIFEST_"].iter().any(|head| name.starts_with(head));
                if name.to_str().is_some_and(of_package) {
                    build.env_remove(&name);
                }
            }
            build.current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
            assert!(
                build.status().is_ok_and(|status| status.success()),
                "cannot build the axisbridge binary"
            );
            let binary = directory.join("axisbridge");
            assert!(binary.exists(), "the axisbridge binary is not at {}", binary.display());
            binary
        })
        .clone()
}

/// A child process that is ended when the test ends, however it ends.
#[derive(Debug)]
pub struct Running {
    child: Child,
    name: &'static str,
}

impl Running {
    /// Starts `command`; `name` stands in messages.
    ///
    /// # Panics
    /// When the command cannot be started.
    #[must_use]
    pub fn start(name: &'static str, command: &mut Command) -> Self {
        let child = command.spawn().unwrap_or_else(|error| panic!("cannot start {name}: {error}"));
        Self { child, name }
    }

    /// Its number.
    #[must_use]
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Types a line on its standard input, which has to be a pipe.
    ///
    /// # Panics
    /// When it has none, or does not read it.
    pub fn type_line(&mut self, line: &str) {
        use std::io::Write as _;
        let stdin = self.child.stdin.as_mut().expect("standard input is a pipe");
        writeln!(stdin, "{line}").expect("the process reads its standard input");
    }

    /// Ends its standard input.
    pub fn end_input(&mut self) {
        self.child.stdin = None;
    }

    /// Its exit status if it has ended.
    pub fn ended(&mut self) -> Option<ExitStatus> {
        self.child.try_wait().expect("a child can be waited for")
    }

    /// Waits until it ends, at most `limit`.
    ///
    /// # Panics
    /// When it is still running then.
    pub fn wait(&mut self, limit: Duration) -> ExitStatus {
        let end = Instant::now() + limit;
        loop {
            if let Some(status) = self.ended() {
                return status;
            }
            assert!(Instant::now() < end, "{} did not end within {limit:?}", self.name);
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Sends it a signal by its name without SIG.
    pub fn signal(&mut self, name: &str) {
        if self.ended().is_none() {
            let _ = Command::new("kill").args([&format!("-{name}"), &self.child.id().to_string()]).status();
        }
    }

    /// Asks it to end (SIGTERM), as a service manager does, and waits.
    ///
    /// # Panics
    /// When it does not end within `limit`.
    pub fn terminate(&mut self, limit: Duration) -> ExitStatus {
        self.signal("TERM");
        self.wait(limit)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
