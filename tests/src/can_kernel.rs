//! A kernel with CAN where the host has none: User-Mode Linux, a kernel that runs as a process.
//!
//! The guest sees the host's own file system, read only, and runs one command of it: a test binary, a script, the gateway.
//! It has virtual CAN interfaces, a loopback interface of its own, and one processor; it starts within a second and is gone
//! with its command. A system call takes it some 70 us: cycles of 10 ms hold in it, cycles of 1 ms belong to virtual time.
//! The host gives it one processor too: the guest's processes are stopped and continued by its kernel at each system call,
//! and to wake a process on another processor takes three times as long.
//!
//! [`Kernel::run`] runs a command. A test that wants to be inside calls [`Kernel::inside`] with its own name and goes on only
//! there. `cargo run -p axisbridge-tests --bin can-kernel -- COMMAND` does it by hand.

use std::ffi::{OsStr, OsString};
use std::fmt::Write as _;
use std::os::unix::ffi::OsStrExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use crate::host::in_real_time;

/// The kernel, and where its modules are (Debian package user-mode-linux).
const PROGRAM: &str = "/usr/bin/linux.uml";
const MODULES: &str = "/usr/lib/uml/modules";

/// What every guest loads, each behind those it needs.
const CAN_MODULES: [&str; 5] = [
    "drivers/net/can/dev/can-dev",
    "net/can/can",
    "net/can/can-raw",
    "net/can/can-bcm",
    "drivers/net/can/vcan",
];

/// Parts of the kernel that only measure or prepare for file systems that nobody mounts: most of the time of a start.
const LEFT_OUT: &str = "raid6_select_algo,calibrate_xor_blocks,init_btrfs_fs,init_jfs_fs,init_xfs_fs,init_reiserfs_fs,\
                        init_zswap,strp_dev_init";

/// Set inside a guest.
const INSIDE: &str = "AXISBRIDGE_CAN_KERNEL";

/// Runs a command before everything that is ordinary.
const URGENT: [&str; 3] = ["chrt", "--fifo", "10"];

/// What lets the kernel run on processors with more registers than it knows, and the flag of such a processor.
const XSTATE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/uml/xstate.c");
const AMX: &str = "amx_tile";

/// How long the host waits beyond the guest's own limit, and for a guest that was asked to end.
const GRACE: Duration = Duration::from_secs(20);
const ENDING: Duration = Duration::from_secs(3);

/// Whether such a kernel can be started here.
#[must_use]
pub fn available() -> bool {
    is_inside() || Path::new(PROGRAM).exists() && modules_folder().is_some()
}

/// Whether this process runs in such a kernel.
#[must_use]
pub fn is_inside() -> bool {
    std::env::var_os(INSIDE).is_some()
}

fn modules_folder() -> Option<PathBuf> {
    let versions = std::fs::read_dir(MODULES).ok()?;
    versions.flatten().map(|version| version.path().join("kernel")).find(|path| path.is_dir())
}

/// What a command did.
#[derive(Debug, Clone)]
pub struct Finished {
    /// Its exit status; 128 and the signal's number for one that was killed, 124 after the time limit, 127 where there is no
    /// such program, 125 where the guest itself failed.
    pub status: i32,
    /// Its standard output.
    pub stdout: String,
    /// Its standard error.
    pub stderr: String,
}

impl Finished {
    /// Its standard output, if it succeeded.
    ///
    /// # Panics
    /// With everything it said if not.
    #[must_use]
    #[track_caller]
    pub fn good(self) -> String {
        assert!(self.status == 0, "status {}\n{}\n{}", self.status, self.stdout, self.stderr);
        self.stdout
    }
}

/// A guest to be started.
#[derive(Debug, Clone)]
pub struct Kernel {
    interfaces: Vec<String>,
    modules: Vec<String>,
    writable: Vec<PathBuf>,
    limit: Duration,
    user: u32,
    urgent: bool,
    environment: Vec<(&'static str, OsString)>,
}

impl Default for Kernel {
    fn default() -> Self {
        Self::new()
    }
}

impl Kernel {
    /// One with the interface `vcan0` and a time limit of a minute.
    #[must_use]
    pub fn new() -> Self {
        let (interfaces, limit) = (vec!["vcan0".to_owned()], Duration::from_secs(60));
        Self {
            interfaces,
            modules: Vec::new(),
            writable: Vec::new(),
            limit,
            user: 0,
            urgent: false,
            environment: Vec::new(),
        }
    }

    /// With these interfaces instead: `vcan0`, or `vxcan0:vxcan1` for the two ends of a cable.
    #[must_use]
    pub fn interfaces(mut self, names: &[&str]) -> Self {
        if names.iter().any(|name| name.contains(':')) {
            self.modules.push("drivers/net/can/vxcan".to_owned());
        }
        self.interfaces = names.iter().map(|&name| name.to_owned()).collect();
        self
    }

    /// With a further module of the kernel, such as `drivers/net/can/slcan/slcan`.
    #[must_use]
    pub fn module(mut self, path: &str) -> Self {
        self.modules.push(path.to_owned());
        self
    }

    /// With a folder of the host in which the guest may write.
    #[must_use]
    pub fn writable(mut self, folder: &Path) -> Self {
        self.writable.push(folder.to_owned());
        self
    }

    /// With the command run by this user instead of root.
    #[must_use]
    pub fn user(mut self, id: u32) -> Self {
        self.user = id;
        self
    }

    /// For processes that keep time: the host runs the guest before what is ordinary, where it permits that (`SCHED_FIFO`).
    #[must_use]
    pub fn urgent(mut self) -> Self {
        self.urgent = true;
        self
    }

    /// With this in the environment of a test that goes [inside](Kernel::inside).
    #[must_use]
    pub fn environment(mut self, name: &'static str, value: &OsStr) -> Self {
        self.environment.push((name, value.to_owned()));
        self
    }

    /// With another time limit.
    #[must_use]
    pub fn limit(mut self, limit: Duration) -> Self {
        self.limit = limit;
        self
    }

    /// Starts a guest, runs `command` in it with its arguments, environment and folder, and waits for its end.
    ///
    /// # Panics
    /// When there is no such kernel here (ask [`available`] first) or it does not start.
    #[must_use]
    pub fn run(&self, command: &Command) -> Finished {
        let job = Job::new();
        job.write("argv", &zero_ended(std::iter::once(command.get_program()).chain(command.get_args())));
        job.write("env", &zero_ended(environment(command).iter().map(OsString::as_os_str)));
        job.write("settings", self.settings(command).as_bytes());
        for file in ["stdout", "stderr"] {
            job.write(file, b"");
        }
        self.boot(&job);
        let stdout = job.read("stdout");
        let mut stderr = job.read("stderr");
        let status = job.read("status").trim().parse().unwrap_or_else(|_| {
            let _ = write!(stderr, "the guest left no status; its log:\n{}", job.read("log"));
            125
        });
        Finished { status, stdout, stderr }
    }

    /// For a test: `true` inside a guest, where it goes on. Outside it runs itself, by its `name` in this test binary, in a
    /// guest, and gives `false` when that has passed.
    ///
    /// # Panics
    /// When the test fails inside.
    #[must_use]
    #[track_caller]
    pub fn inside(&self, name: &str) -> bool {
        if is_inside() {
            return true;
        }
        let mut command = Command::new(std::env::current_exe().expect("the test knows its own path"));
        command.args([name, "--exact", "--nocapture", "--test-threads=1"]);
        command.envs(self.environment.iter().map(|(name, value)| (name, value)));
        let finished = self.run(&command);
        let said = format!("{}\n{}", finished.stdout, finished.stderr);
        assert!(finished.status == 0, "inside the CAN kernel:\n{said}");
        assert!(said.contains("1 passed"), "the test did not run inside the CAN kernel:\n{said}");
        print!("{said}");
        false
    }

    /// As [`inside`](Self::inside) outside of a guest, and [again](in_real_time) when the host did not keep time: devices in a guest miss
    /// a heartbeat then.
    ///
    /// # Panics
    /// When the test fails inside, or this is a guest.
    pub fn inside_in_real_time(&self, name: &str) {
        in_real_time(name, || assert!(!self.inside(name), "there is only one guest"));
    }

    fn settings(&self, command: &Command) -> String {
        let folder = command.get_current_dir().map(Path::to_owned);
        let folder = folder.or_else(|| std::env::current_dir().ok()).unwrap_or_else(|| "/".into());
        let modules = modules_folder().expect("the modules of the kernel are there");
        let path = |module: &str| modules.join(format!("{module}.ko")).display().to_string();
        let named = self.modules.iter().map(String::as_str);
        let modules: Vec<String> = CAN_MODULES.iter().copied().chain(named).map(path).collect();
        let writable: Vec<String> = self.writable.iter().map(|path| path.display().to_string()).collect();
        format!(
            "folder={}\nlimit={}\nuser={}\ninterfaces={}\nmodules={}\nwritable={}\n",
            folder.display(),
            self.limit.as_secs().max(1),
            self.user,
            self.interfaces.join("\t"),
            modules.join("\t"),
            writable.join("\t"),
        )
    }

    /// Runs the guest until it powers off, or past its time.
    fn boot(&self, job: &Job) {
        let log = std::fs::File::create(job.folder.join("log")).expect("the job folder can be written");
        let folder = job.folder.display();
        let scheduling: &[&str] = match self.urgent && is_permitted(&URGENT) {
            true => &URGENT,
            false => &[],
        };
        // A guest must not outlive the test that started it.
        let mut kernel = Command::new("setpriv");
        if let Some(library) = xstate_library(&job.folder) {
            kernel.env("LD_PRELOAD", library);
        }
        let mut kernel = kernel
            .args(["--pdeathsig", "TERM"])
            .args(job.processor())
            .args(scheduling)
            .arg(PROGRAM)
            .args(["mem=512M", "rootfstype=hostfs", "rootflags=/", "ro", "panic=1", "loglevel=4"])
            .args(["con=null", "con0=null,fd:1", "ssl=null", "pty.legacy_count=0"])
            .arg(format!("initcall_blacklist={LEFT_OUT}"))
            .arg(format!("init={}", concat!(env!("CARGO_MANIFEST_DIR"), "/uml/init")))
            .arg(format!("job={folder}"))
            .arg(format!("uml_dir={folder}/"))
            .arg("umid=guest")
            .stdin(Stdio::null())
            .stdout(log.try_clone().expect("a file can be shared"))
            .stderr(log)
            .spawn()
            .expect("setpriv (util-linux) and the kernel can be started");
        let end = Instant::now() + self.limit + GRACE;
        while kernel.try_wait().expect("a child can be waited for").is_none() {
            if Instant::now() > end {
                signal("TERM", &kernel.id().to_string());
                std::thread::sleep(ENDING);
                break;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        // The guest's processes are processes of the host too, in a group that has the number of the kernel.
        signal("KILL", &format!("-{}", kernel.id()));
        let _ = kernel.kill();
        let _ = kernel.wait();
    }
}

/// The library for the processor of this host, made in a folder; `None` where the kernel needs none.
///
/// # Panics
/// It cannot be made: the linker that Rust uses is the compiler that it needs.
fn xstate_library(folder: &Path) -> Option<PathBuf> {
    let processors = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let flags = processors.lines().find(|line| line.starts_with("flags"))?;
    flags.split_whitespace().find(|flag| *flag == AMX)?;
    let library = folder.join("xstate.so");
    let made = Command::new("cc")
        .args(["-O2", "-shared", "-fPIC", "-o"])
        .arg(&library)
        .arg(XSTATE)
        .arg("-ldl")
        .status();
    assert!(
        made.is_ok_and(|status| status.success()),
        "`cc` cannot make {XSTATE}, which this processor ({AMX}) needs"
    );
    Some(library)
}

/// Whether a command may be run in this way.
fn is_permitted(way: &[impl AsRef<OsStr>]) -> bool {
    let mut command = Command::new(&way[0]);
    command.args(&way[1..]).arg("true").stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

fn signal(name: &str, process: &str) {
    let kill = Command::new("kill").args([&format!("-{name}"), "--", process]).stderr(Stdio::null()).status();
    let _ = kill;
}

/// Words, each ended by a zero byte.
fn zero_ended<'a>(words: impl Iterator<Item = &'a OsStr>) -> Vec<u8> {
    words.flat_map(|word| word.as_bytes().iter().copied().chain([0])).collect()
}

/// The environment that `command` would have, as `NAME=value`, and the mark of a guest.
fn environment(command: &Command) -> Vec<OsString> {
    let changed = |name: &OsStr| command.get_envs().any(|(changed, _)| changed == name);
    let pair = |name: &OsStr, value: &OsStr| {
        let mut pair = name.to_owned();
        pair.push("=");
        pair.push(value);
        pair
    };
    let kept = std::env::vars_os().filter(|(name, _)| !changed(name));
    let mut all: Vec<OsString> = kept.map(|(name, value)| pair(&name, &value)).collect();
    all.extend(command.get_envs().filter_map(|(name, value)| Some(pair(name, value?))));
    all.push(pair(OsStr::new(INSIDE), OsStr::new("1")));
    all
}

/// The processors that this process may use.
fn allowed() -> Vec<u32> {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let list = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"));
    processors(list.unwrap_or_default())
}

/// The kernel's list of processors, such as `0-1,4`.
fn processors(list: &str) -> Vec<u32> {
    let ranges = list.trim().split(',').filter_map(|range| {
        let (first, last) = range.split_once('-').unwrap_or((range, range));
        Some(first.parse().ok()?..=last.parse().ok()?)
    });
    ranges.flatten().collect()
}

/// The folder over which host and guest speak; removed with everything in it.
struct Job {
    folder: PathBuf,
    /// How many were before it in this process.
    serial: usize,
}

impl Job {
    fn new() -> Self {
        static NEXT: AtomicUsize = AtomicUsize::new(0);
        let serial = NEXT.fetch_add(1, Ordering::Relaxed);
        // The name of a socket in it must stay below 108 bytes.
        let folder = PathBuf::from(format!("/var/tmp/axb-guest-{}-{serial}", std::process::id()));
        std::fs::create_dir(&folder).expect("/var/tmp can be written");
        Self { folder, serial }
    }

    /// What keeps its guest on one processor of the host: the next for each guest.
    fn processor(&self) -> Vec<String> {
        let processors = allowed();
        let chosen = processors.get(self.serial.checked_rem(processors.len()).unwrap_or_default());
        let way = |processor: &u32| ["taskset", "--cpu-list", &processor.to_string()].map(str::to_owned);
        chosen.map(way).filter(|way| is_permitted(way)).map(Vec::from).unwrap_or_default()
    }

    fn write(&self, file: &str, content: &[u8]) {
        std::fs::write(self.folder.join(file), content).expect("the job folder can be written");
    }

    fn read(&self, file: &str) -> String {
        let content = std::fs::read(self.folder.join(file)).unwrap_or_default();
        String::from_utf8_lossy(&content).into_owned()
    }
}

impl Drop for Job {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kernels_list_of_processors_is_read() {
        assert_eq!(processors("\t0-1,4,6-7\n"), [0, 1, 4, 6, 7]);
        assert_eq!(processors("3"), [3]);
        assert_eq!(processors(""), [0_u32; 0]);
    }

    #[test]
    fn guests_take_turns_on_the_processors() {
        let job = |serial| Job { folder: PathBuf::from("/nowhere"), serial };
        let ways: Vec<_> = (0..2).map(|serial| job(serial).processor()).collect();
        assert!(ways.iter().all(|way| way.is_empty() || way.len() == 3), "{ways:?}");
        assert_eq!(ways[0] == ways[1], ways[0].is_empty() || allowed().len() == 1);
    }
}
