//! The unit of the package under a real systemd: process 1 of a system of its own, in namespaces, on a layer over this host's files.

use std::fs;
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use axisbridge_tests::host::in_real_time;
use axisbridge_tests::peer;
use axisbridge_tests::process::Running;

use super::package::{Package, edited, package, short_folder};

/// How long anything may take on a slow host.
const PATIENCE: Duration = Duration::from_secs(60);

const SYSTEMD: &str = "/usr/lib/systemd/systemd";

/// What the unit says, and what systemd is asked for.
const UNIT: &str = "axisbridge.service";

/// Where this host has the hierarchy of cgroup v2; `None` where it has none that can be written to.
fn cgroups() -> Option<PathBuf> {
    ["/sys/fs/cgroup", "/sys/fs/cgroup/unified"]
        .map(PathBuf::from)
        .into_iter()
        .find(|path| path.join("cgroup.procs").exists() && path.join("cgroup.controllers").exists())
}

/// A system with nothing but the package. It ends when this is dropped.
struct System {
    /// The process that waits for systemd.
    run: Option<Running>,
    /// Process 1 as this host sees it.
    init: u32,
    cgroup: PathBuf,
    folder: PathBuf,
    log: PathBuf,
}

impl Drop for System {
    fn drop(&mut self) {
        // The kernel ends every process of the namespace with its first one.
        let _ = Command::new("kill").arg("-KILL").arg(self.init.to_string()).status();
        drop(self.run.take());
        remove_groups(&self.cgroup);
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// Removes a group and those below it, once their processes are gone.
fn remove_groups(group: &Path) {
    let end = Instant::now() + Duration::from_secs(5);
    while fs::read_to_string(group.join("cgroup.events")).is_ok_and(|text| text.contains("populated 1")) {
        if Instant::now() > end {
            return;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    for entry in fs::read_dir(group).into_iter().flatten().flatten() {
        if entry.path().is_dir() {
            remove_groups(&entry.path());
        }
    }
    let _ = fs::remove_dir(group);
}

impl System {
    /// Boots a system with the files of the package and a configuration for a drive in the process.
    fn boot(package: &Package, hierarchy: &Path) -> Self {
        let folder = short_folder("systemd");
        let (files, memory) = (folder.join("files"), folder.join("memory"));
        for made in [&files, &memory] {
            fs::create_dir_all(made).expect("a folder");
        }
        let copied = Command::new("cp").arg("-a").arg(package.tree.join(".")).arg(&files).status();
        assert!(copied.expect("cp").success());
        fs::remove_dir_all(files.join("DEBIAN")).expect("the scripts of the package");
        fs::write(files.join("etc/axisbridge/gateway.toml"), edited("127.0.0.1")).expect("a configuration");
        let cgroup = hierarchy.join(format!("axisbridge-test-{}", std::process::id()));
        fs::create_dir_all(&cgroup).expect("a group");
        let log = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("systemd.log");
        let output = fs::File::create(&log).expect("a log");
        // The shell joins the group, which is the root of the hierarchy that systemd sees.
        let mut command = Command::new("/bin/sh");
        command
            .args(["-c", "echo $$ > \"$0/cgroup.procs\" && exec \"$@\""])
            .arg(&cgroup)
            .args(["unshare", "--pid", "--mount", "--uts", "--ipc", "--net", "--cgroup", "--fork"])
            .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("peers/systemd-boot"))
            .args([&memory, &files])
            .stdin(Stdio::null())
            .stdout(output.try_clone().expect("a log"))
            .stderr(output)
            .process_group(0);
        let mut run = Running::start("systemd", &mut command);
        let end = Instant::now() + PATIENCE;
        let init = loop {
            let children = format!("/proc/{0}/task/{0}/children", run.id());
            let child = fs::read_to_string(children).unwrap_or_default();
            let child = child.split_whitespace().next().and_then(|child| child.parse::<u32>().ok());
            let is_systemd = |child: &u32| {
                fs::read_to_string(format!("/proc/{child}/comm")).is_ok_and(|name| name == "systemd\n")
            };
            if let Some(child) = child.filter(is_systemd) {
                break child;
            }
            let ended = run.ended();
            let said = || fs::read_to_string(&log).unwrap_or_default();
            assert!(ended.is_none() && Instant::now() < end, "systemd does not start: {ended:?} {}", said());
            std::thread::sleep(Duration::from_millis(20));
        };
        Self { run: Some(run), init, cgroup, folder, log }
    }

    /// What a command in the system prints, and whether it went well.
    fn ask(&self, words: &[&str]) -> (bool, String) {
        let mut command = Command::new("nsenter");
        command.args(["-t", &self.init.to_string(), "-a", "env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin"]);
        let output = command.args(words).stdin(Stdio::null()).output().expect("nsenter");
        let text = [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
        (output.status.success(), text.concat())
    }

    /// A property of the unit.
    fn property(&self, name: &str) -> String {
        let (_, text) = self.ask(&["systemctl", "show", UNIT, "--value", "-p", name]);
        text.trim_end().to_owned()
    }

    /// Waits until a property is as wanted.
    fn until(&self, name: &str, wanted: impl Fn(&str) -> bool) -> String {
        let end = Instant::now() + PATIENCE;
        loop {
            let value = self.property(name);
            if wanted(&value) {
                return value;
            }
            assert!(Instant::now() < end, "{name} is {value:?}: {}", self.said());
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// What systemd and the journal say.
    fn said(&self) -> String {
        let (_, journal) = self.ask(&["journalctl", "--no-pager", "-u", UNIT, "-n", "60"]);
        let (_, status) = self.ask(&["systemctl", "status", "--no-pager", UNIT]);
        let log = fs::read_to_string(&self.log).unwrap_or_default();
        format!("{status}\n{journal}\n{log}")
    }

    /// A line of `/proc/PID/status` of the service.
    fn of_process(&self, name: &str) -> String {
        let pid = self.property("MainPID");
        let (_, status) = self.ask(&["cat", &format!("/proc/{pid}/status")]);
        let line = status.lines().find_map(|line| line.strip_prefix(&format!("{name}:")));
        line.unwrap_or_else(|| panic!("no {name}: {status}")).trim().to_owned()
    }
}

#[test]
fn service_is_ready_feeds_the_watchdog_and_stops_under_systemd() {
    let test = "service_is_ready_feeds_the_watchdog_and_stops_under_systemd";
    let Some(package) = package(test) else { return };
    let can_boot = rustix::process::geteuid().is_root()
        && Path::new(SYSTEMD).exists()
        && ["unshare", "nsenter", "ip"].into_iter().all(|program| {
            // `ip` has no `--version`.
            Command::new(program).arg("-V").output().is_ok_and(|output| output.status.success())
        });
    let Some(hierarchy) = cgroups().filter(|_| can_boot) else {
        peer::skip(test, "root, systemd and a hierarchy of cgroup v2");
        return;
    };
    in_real_time(test, || {
        let system = System::boot(package, &hierarchy);
        // READY=1 makes it active, and nothing else does (Type=notify).
        system.until("ActiveState", |state| state == "active");
        system.until("StatusText", |text| text == "ready");
        assert_eq!(system.property("Type"), "notify");
        let (ok, status) = system.ask(&["systemctl", "status", "--no-pager", UNIT]);
        assert!(ok && status.contains("Active: active (running)"), "{status}");
        let (ok, axes) = system.ask(&["axisbridge", "status", "--local", "/run/axisbridge/local"]);
        assert!(ok, "{axes}");

        // User, capabilities and the rest of the sandbox are those of the unit, and are enough.
        let (_, user) = system.ask(&["id", "-u", "axisbridge"]);
        let user = user.trim();
        assert_ne!(user, "0");
        assert_eq!(system.of_process("Uid").split_whitespace().collect::<Vec<_>>(), [user; 4]);
        // CAP_NET_BIND_SERVICE 10, CAP_NET_ADMIN 12, CAP_NET_RAW 13, CAP_IPC_LOCK 14, CAP_SYS_NICE 23.
        let capabilities = (1 << 10) | (1 << 12) | (1 << 13) | (1 << 14) | (1 << 23);
        for set in ["CapEff", "CapBnd", "CapAmb"] {
            let of_process = u64::from_str_radix(&system.of_process(set), 16);
            assert_eq!(of_process, Ok(capabilities), "{set}");
        }
        assert_eq!((system.of_process("NoNewPrivs"), system.of_process("Seccomp")), ("1".into(), "2".into()));
        let pid = system.property("MainPID");
        let (_, mounts) = system.ask(&["cat", &format!("/proc/{pid}/mountinfo")]);
        let root = mounts.lines().find(|line| line.split(' ').nth(4) == Some("/")).expect("a root");
        assert!(root.split(' ').nth(5).is_some_and(|options| options.starts_with("ro")), "{root}");
        let (_, folders) = system.ask(&["stat", "-c", "%U %a", "/run/axisbridge", "/var/lib/axisbridge"]);
        assert_eq!(folders, "axisbridge 750\naxisbridge 755\n");
        let policy = system.ask(&["sh", "-c", &format!("chrt -a -p {pid}")]).1;
        assert!(policy.contains("SCHED_FIFO"), "the cycle runs in real time: {policy}");
        let refusals = system.ask(&["journalctl", "--no-pager", "-u", UNIT]).1;
        assert!(!refusals.contains("the kernel refused real-time settings"), "{refusals}");

        // The watchdog is fed while the cycle runs.
        assert_eq!(system.property("WatchdogUSec"), "10s");
        let fed = system.property("WatchdogTimestampMonotonic");
        system.until("WatchdogTimestampMonotonic", |now| now != fed);
        // A process that stands is killed, and started again.
        assert_eq!(system.property("NRestarts"), "0");
        let (ok, said) = system.ask(&["kill", "-STOP", &pid]);
        assert!(ok, "{said}");
        system.until("NRestarts", |count| count == "1");
        system.until("StatusText", |text| text == "ready");
        assert_ne!(system.property("MainPID"), pid);
        let journal = system.ask(&["journalctl", "--no-pager", "-u", UNIT]).1;
        assert!(journal.contains("Watchdog timeout"), "{journal}");

        let (ok, said) = system.ask(&["systemctl", "reload", UNIT]);
        assert!(ok, "{said}");
        let end = Instant::now() + PATIENCE;
        let reloaded = "configuration and tables were read again";
        while !system.ask(&["journalctl", "--no-pager", "-u", UNIT]).1.contains(reloaded) {
            assert!(Instant::now() < end, "{}", system.said());
        }
        system.until("StatusText", |text| text == "ready");

        let (ok, said) = system.ask(&["systemctl", "stop", UNIT]);
        assert!(ok, "{said}");
        let ended = ["ActiveState", "Result", "ExecMainStatus"].map(|name| system.property(name));
        assert_eq!(ended, ["inactive", "success", "0"], "{}", system.said());
        let (exists, _) = system.ask(&["test", "-e", "/run/axisbridge"]);
        assert!(!exists, "the runtime directory goes with the service");
        let (exists, _) = system.ask(&["test", "-d", "/var/lib/axisbridge"]);
        assert!(exists, "the state stays");
    });
}
