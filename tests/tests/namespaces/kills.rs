//! The gateway is killed at random times while its drives live on: no axis moves or has torque by itself afterwards, and what is on disk
//! is whole.
//!
//! The drives and the controller are processes of their own. `AXISBRIDGE_KILLS` sets how often; without it a few times.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use axisbridge_tests::host::in_real_time;
use axisbridge_tests::namespace::{Namespace, cable};
use axisbridge_tests::peer;
use axisbridge_tests::process::{Running, axisbridge};
use axisbridge_tests::rig::network::Random;
use profile_cip::wire::status::Service;
use serde_json::Value;

use super::attackers::{answer_of, message};
use super::{a_bus, in_namespace, scratch, wait_for};

/// How often the gateway is killed, where it is not to be five times.
const KILLS: &str = "AXISBRIDGE_KILLS";

/// Set for the copy of this test binary that reads the inactivity time-out of the device, and sets it.
const SETTER: &str = "AXISBRIDGE_TEST_SETTER";

const DEVICE: &str = "127.0.0.2";

/// How long axes are looked at after a start, before a controller comes.
const WATCH: Duration = Duration::from_millis(600);

/// States in which a drive has no torque.
const WITHOUT_TORQUE: [&str; 6] =
    ["not_ready", "inhibited", "awaiting_power", "ready", "faulted", "shutdown"];

/// What a drive may report as movement while it stands.
const STANDING: f64 = 1e-4;

fn configuration(name: &str) -> PathBuf {
    let text = format!(
        "[box]\nname = \"kills\"\nsettings_file = \"{name}-state/settings.toml\"\n\
         [time]\nsource = \"shared\"\n[history]\ndirectory = \"{name}-state\"\n\
         [[device]]\nname = \"front\"\nlisten = \"{DEVICE}\"\naxes = [\"a\", \"b\"]\n\
         update_period = {{ min = \"4 ms\", max = \"32 ms\" }}\n\
         [device.identity]\nvendor_id = 1\nproduct_code = 1\nserial_number = 1\n\
         [south.sercos]\ninterface = \"sercos0\"\ncycle_time = \"2 ms\"\njitter = \"200 us\"\nallowed_losses = 1000\n\
         [[south.sercos.drive]]\nname = \"drive-a\"\naddress = 1\n[[south.sercos.drive]]\nname = \"drive-b\"\naddress = 2\n\
         [[axis]]\nname = \"a\"\ninstance = 1\ndrive = \"drive-a\"\nunit = \"revolution\"\n\
         [[axis]]\nname = \"b\"\ninstance = 2\ndrive = \"drive-b\"\nunit = \"revolution\"\n"
    );
    let path = scratch(&format!("{name}.toml"));
    std::fs::write(&path, text).expect("the scratch folder can be written");
    path
}

/// The hosts and their files.
struct Plant {
    host: Namespace,
    config: PathBuf,
    socket: PathBuf,
    state: PathBuf,
    log: PathBuf,
}

impl Plant {
    fn start(&self) -> Running {
        let mut command = in_namespace(&self.host, &["run", "--config"]);
        command.arg(&self.config).arg("--local").arg(&self.socket).env("NO_COLOR", "1");
        command.stderr(std::fs::File::create(&self.log).expect("the log can be written"));
        Running::start("run", &mut command)
    }

    fn log(&self) -> String {
        std::fs::read_to_string(&self.log).unwrap_or_default()
    }

    /// State, torque and position of each axis.
    fn axes(&self) -> Vec<(String, f64)> {
        let mut command = Command::new(axisbridge());
        command.args(["status", "--json", "--local"]).arg(&self.socket).stdin(Stdio::null());
        let output = command.output().expect("the command can be started");
        let status: Value = serde_json::from_slice(&output.stdout).unwrap_or_else(|error| {
            panic!("{error}: {}\n{}", String::from_utf8_lossy(&output.stderr), self.log())
        });
        let axis = |axis: &Value| {
            let state = axis["state"].as_str().expect("a state").to_owned();
            (state, axis["position"].as_f64().expect("a position"))
        };
        status["axes"].as_array().expect("axes").iter().map(axis).collect()
    }

    /// Looks at the axes for a while: none of them has torque, and none moves.
    fn axes_stand(&self, round: usize) {
        let end = Instant::now() + WATCH;
        let first = self.axes();
        loop {
            for (axis, ((state, position), (_, before))) in self.axes().iter().zip(&first).enumerate() {
                assert!(
                    WITHOUT_TORQUE.contains(&state.as_str()),
                    "round {round}: axis {axis} is {state} without a controller\n{}",
                    self.log()
                );
                assert!(
                    (position - before).abs() < STANDING,
                    "round {round}: axis {axis} moves\n{}",
                    self.log()
                );
            }
            if end <= Instant::now() {
                return;
            }
        }
    }

    /// The faults that are on disk by their numbers; every line is whole.
    fn faults(&self) -> BTreeMap<u64, Value> {
        let Ok(text) = std::fs::read_to_string(self.state.join("faults.jsonl")) else {
            return BTreeMap::new();
        };
        let record = |line: &str| {
            let record: Value =
                serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line:?}"));
            record["number"].as_u64().map(|number| (number, record.clone()))
        };
        text.lines().filter_map(record).collect()
    }

    /// Sets the inactivity time-out of the device, and returns what it was.
    fn set(&self, seconds: u16) -> u16 {
        let own = std::env::current_exe().expect("own path");
        let mut command = self.host.command(own.to_str().expect("UTF-8"));
        command.args(["--exact", "kills::setter", "--nocapture"]).env(SETTER, seconds.to_string());
        let output = command.output().expect("it starts");
        assert!(output.status.success(), "{}{}", String::from_utf8_lossy(&output.stderr), self.log());
        let before = super::flood::numbers(&output.stdout, "BEFORE")[0];
        u16::try_from(before).expect("16 bits")
    }
}

#[test]
fn no_kill_of_the_gateway_lets_an_axis_move_or_damages_what_is_kept() {
    let name = "no_kill_of_the_gateway_lets_an_axis_move_or_damages_what_is_kept";
    if !peer::namespaces_or_skip(name) {
        return;
    }
    let _bus = a_bus();
    in_real_time(name, killed);
}

fn killed() {
    let kills = std::env::var(KILLS).ok().and_then(|text| text.parse().ok()).unwrap_or(5);
    let (host, line) = (Namespace::new("box"), Namespace::new("drv"));
    cable((&host, "sercos0", None), (&line, "sercos0", None));
    let seconds = (kills * 15 + 60).to_string();
    let mut drives =
        in_namespace(&line, &["simulate", "sercos-drive", "--interface", "sercos0", "--slaves", "2"]);
    let mut drives = Running::start("drives", drives.args(["--seconds", &seconds]).stderr(Stdio::inherit()));
    let plant = Plant {
        host,
        config: configuration("kills"),
        socket: scratch("kills.socket"),
        state: scratch("kills-state"),
        log: scratch("kills.log"),
    };
    let _ = std::fs::remove_dir_all(&plant.state);
    std::fs::create_dir_all(&plant.state).expect("the scratch folder can be written");

    let mut random = Random::new(u64::from(std::process::id()));
    let mut pause = |most: u64| std::thread::sleep(Duration::from_micros(random.next() % (most * 1_000)));
    // The default of the attribute.
    let mut kept: u16 = 120;
    let mut known = BTreeMap::new();
    let mut moved = 0;
    for round in 0..kills {
        let mut gateway = plant.start();
        // Every third time in the middle of its start.
        if round % 3 == 2 {
            pause(1_500);
            kill(&mut gateway);
            continue;
        }
        wait_for(&plant.log, "CP4", &mut gateway);
        plant.axes_stand(round);
        // A record may have got its end since; none is gone.
        let faults = plant.faults();
        let gone: Vec<_> = known.keys().filter(|number| !faults.contains_key(number)).collect();
        assert!(gone.is_empty(), "round {round}: {gone:?} are no longer in the history");
        known = faults;

        let wanted = 100 + u16::try_from(round % 1_000).expect("small");
        assert_eq!(
            plant.set(wanted),
            kept,
            "round {round}: the setting of the round before\n{}",
            plant.log()
        );
        kept = wanted;
        let mut controller = in_namespace(
            &plant.host,
            &["simulate", "controller", "--target", DEVICE, "--bind", "127.0.0.1", "--axes", "2"],
        );
        controller.args(["--counts-per-unit", "1000000,1000000", "--speed", "2,2", "--seconds", "8"]);
        controller.args(["--update-period-us", "8000"]).stdout(Stdio::null()).stderr(Stdio::null());
        let mut controller = Running::start("controller", &mut controller);
        wait_for(&plant.log, "-> Running", &mut gateway);
        pause(1_500);
        moved += usize::from(plant.axes().iter().any(|(_, position)| position.abs() > STANDING));
        // Every other time while faults are being written: the axes have lost their controller.
        if round % 2 == 1 {
            controller.signal("KILL");
            pause(1_000);
        }
        kill(&mut gateway);
        controller.terminate(Duration::from_secs(20));
    }
    // Once more to the end: everything is found, and nothing moves.
    let mut gateway = plant.start();
    wait_for(&plant.log, "CP4", &mut gateway);
    plant.axes_stand(kills);
    assert_eq!(plant.set(kept), kept);
    assert!(moved > 0, "no axis has moved in {kills} rounds");
    assert!(!plant.faults().is_empty(), "no fault was written in {kills} rounds");
    for part in ["cannot be read", "damaged", "left out"] {
        assert!(!plant.log().contains(part), "{}", plant.log());
    }
    assert_eq!(gateway.terminate(Duration::from_secs(10)).code(), Some(0), "{}", plant.log());
    println!(
        "{kills} kills, {moved} of them while an axis had moved; {} faults in the history",
        plant.faults().len()
    );
    drives.terminate(Duration::from_secs(10));
}

/// Kills at once, as a loss of power does.
fn kill(gateway: &mut Running) {
    gateway.signal("KILL");
    let status = gateway.wait(Duration::from_secs(10));
    assert_eq!(status.code(), None, "it was killed");
}

/// Not a test of its own: the client inside the namespace.
#[test]
fn setter() {
    let Ok(seconds) = std::env::var(SETTER) else { return };
    let seconds: u16 = seconds.parse().expect("a number");
    let path: &[u8] = &[0x20, 0xF5, 0x24, 1, 0x30, 13];
    let device = format!("{DEVICE}:44818");
    let before = answer_of(&device, &message(Service::GET_ATTRIBUTE_SINGLE, path, &[])).expect("an answer");
    let set = answer_of(&device, &message(Service::SET_ATTRIBUTE_SINGLE, path, &seconds.to_le_bytes()));
    assert_eq!(set.as_deref(), Ok(&[][..]));
    println!("BEFORE {}", u16::from_le_bytes(before.try_into().expect("two bytes")));
}
