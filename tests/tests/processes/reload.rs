//! SIGHUP: a box reads its files again, and keeps the last good ones when they are refused.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use axisbridge_tests::example::two_axes;
use axisbridge_tests::process::{Running, axisbridge};

const PATIENCE: Duration = Duration::from_secs(60);

/// The example on an address of its own, without Modbus, with an overlay.
fn configuration() -> String {
    two_axes("127.0.0.71", "[mappings]\noverlays = [\"own.toml\"]\n\n")
}

fn await_line(log: &Path, from: usize, wanted: &str) -> String {
    let end = Instant::now() + PATIENCE;
    loop {
        let text = fs::read_to_string(log).unwrap_or_default();
        if text.get(from..).is_some_and(|new| new.contains(wanted)) {
            return text;
        }
        assert!(Instant::now() < end, "`{wanted}` was not logged:\n{text}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_refused_reload_leaves_the_box_as_it_was_and_a_good_one_starts_it_anew() {
    let folder: PathBuf = Path::new(env!("CARGO_TARGET_TMPDIR")).join("reload");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    let own = "format = 1\noverlay = \"reload\"\n[[generic-sercos.parameter]]\nparameter = \"jerk_limit\"\nmissing = \"reject\"\n";
    fs::write(folder.join("own.toml"), own).unwrap();
    fs::write(folder.join("box.toml"), configuration()).unwrap();
    let log = folder.join("log");
    let mut command = Command::new(axisbridge());
    command.args(["run", "--config"]).arg(folder.join("box.toml"));
    command.env_remove("RUST_LOG").stdout(Stdio::null()).stderr(fs::File::create(&log).unwrap());
    let mut running = Running::start("axisbridge run", &mut command);
    let text = await_line(&log, 0, "EtherNet/IP");

    // An overlay that is broken: told with code and place, and nothing ends.
    fs::write(folder.join("own.toml"), own.replace("\"reject\"", "\"rejekt\"")).unwrap();
    running.signal("HUP");
    let refused = await_line(&log, text.len(), "are refused: the gateway keeps the present ones");
    assert!(refused[text.len()..].contains("error[AX0012]"), "{refused}");
    assert!(refused[text.len()..].contains("own.toml:5:11"), "{refused}");
    assert_eq!(running.ended(), None);
    assert!(!refused[text.len()..].contains("axisbridge restarts"));

    // A good one: no axis has torque, so that it counts at once.
    fs::write(folder.join("own.toml"), own).unwrap();
    running.signal("HUP");
    let anew = await_line(&log, refused.len(), "axisbridge restarts");
    await_line(&log, anew.find("axisbridge restarts").unwrap(), "EtherNet/IP");
    assert!(running.terminate(PATIENCE).success());
}

/// A gateway with its files and its log.
struct Site {
    folder: PathBuf,
    log: PathBuf,
    running: Running,
}

impl Site {
    /// Starts one with this configuration.
    fn start(name: &str, configuration: &str) -> Self {
        let folder: PathBuf = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("box.toml"), configuration).unwrap();
        let log = folder.join("log");
        let mut command = Command::new(axisbridge());
        command.args(["run", "--config"]).arg(folder.join("box.toml"));
        command.env_remove("RUST_LOG").stdout(Stdio::null()).stderr(fs::File::create(&log).unwrap());
        let running = Running::start("axisbridge run", &mut command);
        await_line(&log, 0, "EtherNet/IP");
        Self { folder, log, running }
    }

    /// Changes the configuration, and has it read again; what was logged before.
    fn reload(&mut self, configuration: &str) -> usize {
        let before = fs::read_to_string(&self.log).unwrap().len();
        fs::write(self.folder.join("box.toml"), configuration).unwrap();
        self.running.signal("HUP");
        before
    }
}

/// Files without an error can still not start here: then what ran before goes on.
#[test]
fn files_that_cannot_start_bring_the_gateway_back_that_ran_before() {
    let good = two_axes("127.0.0.171", "");
    let mut site = Site::start("reload-no-start", &good);
    // An address of another host.
    let before = site.reload(&two_axes("192.0.2.1", ""));
    let text = await_line(&site.log, before, "cannot start with the new configuration");
    assert!(text[before..].contains("192.0.2.1"), "{text}");
    let failed = before + text[before..].find("cannot start with the new configuration").unwrap();
    await_line(&site.log, failed, "EtherNet/IP");
    assert_eq!(site.running.ended(), None);
    // Settings that nobody can use: nothing is stopped for them.
    fs::write(site.folder.join("settings.toml"), "no toml").unwrap();
    let with = good.replacen("[box]\n", "[box]\nsettings_file = \"settings.toml\"\n", 1);
    assert_ne!(with, good, "the example has a table [box]");
    let before = site.reload(&with);
    let text = await_line(&site.log, before, "are refused: the gateway keeps the present ones");
    assert!(text[before..].contains("settings.toml"), "{text}");
    assert!(!text[before..].contains("axisbridge restarts"), "{text}");
    // And a good one still starts.
    let before = site.reload(&good);
    let text = await_line(&site.log, before, "axisbridge restarts");
    await_line(&site.log, before + text[before..].find("axisbridge restarts").unwrap(), "EtherNet/IP");
    assert!(site.running.terminate(PATIENCE).success());
}

#[test]
fn level_of_the_log_is_that_of_the_configuration_that_runs() {
    let good = two_axes("127.0.0.172", "");
    let mut site = Site::start("reload-level", &good);
    let first = fs::read_to_string(&site.log).unwrap();
    assert!(!first.contains("DEBUG"), "{first}");
    let before = site.reload(&good.replacen("level = \"info\"", "level = \"debug\"", 1));
    let text = await_line(&site.log, before, "axisbridge restarts");
    await_line(&site.log, before + text[before..].find("axisbridge restarts").unwrap(), "EtherNet/IP");
    let stream = std::net::TcpStream::connect("127.0.0.172:44818").unwrap();
    await_line(&site.log, before, "DEBUG");
    drop(stream);
    assert!(site.running.terminate(PATIENCE).success());
}

/// A start with a broken overlay says what is wrong and nothing of the shipped tables.
#[test]
fn a_refused_start_shows_what_the_user_has_written_and_nothing_else() {
    let folder: PathBuf = Path::new(env!("CARGO_TARGET_TMPDIR")).join("refused-start");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    let own = "format = 1\noverlay = \"start\"\n[[generic-sercos.parameter]]\nparameter = \"jerk_limit\"\nmissing = \"rejekt\"\n";
    fs::write(folder.join("own.toml"), own).unwrap();
    fs::write(folder.join("box.toml"), configuration()).unwrap();
    let mut command = Command::new(axisbridge());
    command
        .args(["run", "--config"])
        .arg(folder.join("box.toml"))
        .env_remove("RUST_LOG")
        .stdin(Stdio::null());
    let output = command.output().expect("the command can be started");
    let text = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(1), "{text}");
    let heads: Vec<_> = text.lines().filter(|line| line.contains("[AX")).collect();
    let [vendor, error] = heads[..] else { panic!("{text}") };
    assert!(vendor.starts_with("note[AX0092]") && error.starts_with("error[AX0012]"), "{text}");
}
