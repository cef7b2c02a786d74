//! Grandmaster, controller and gateway as three machines with a switch between them, and axes that move synchronously while something
//! happens to their time.
//!
//! ```text
//! grandmaster (ptp4l) 192.168.40.1 ------------+
//! a better one        192.168.40.4 --- relay --+-- switch (a bridge)
//! controller          192.168.40.2 ------------+
//! gateway             192.168.40.3 ------------+      gateway --- SERCOS cable --- two drives
//! ```
//!
//! The namespaces of a host have one oscillator. The clock of the better grandmaster is 4 ms and 40 ppm off it: by so much the
//! controller's clock and the gateway's are off their master's. The relay loses and delays frames, as this kernel need not have
//! `netem`.
//!
//! What the drives were sent is judged by the motion checker, from the recording of the gateway.

use std::io::{BufRead as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use axisbridge::config::Config;
use axisbridge::sys::packet_socket::{self, PacketSocket};
use axisbridge::sys::realtime;
use axisbridge_tests::host::in_real_time;
use axisbridge_tests::namespace::{Namespace, cable};
use axisbridge_tests::peer;
use axisbridge_tests::process::Running;
use axisbridge_tests::rig::motion_checker::recording;
use profile_generic::time::DurationNs;
use serde_json::Value;

use super::ptp::{log_of, ptp4l, wait_for_count};
use super::{a_bus, in_namespace, scratch};

const GATEWAY: &str = "192.168.40.3";
const CONTROLLER: &str = "192.168.40.2";

/// Set for the copy of this test binary that is the relay.
const RELAY: &str = "AXISBRIDGE_TEST_RELAY";

const CONFIGURATION: &str = r#"
[box]
name = "three clocks"

[time]
source = "ptp"
threshold = "100 us" # the stamps of a busy host are late now and then

[[device]]
name = "front"
listen = "192.168.40.3"
axes = ["turntable", "slide"]
update_period = { min = "4 ms", max = "32 ms" }

[device.identity]
vendor_id = 1
product_code = 1
serial_number = 1

[[axis]]
name = "turntable"
instance = 1
drive = "drive-a"
unit = "revolution"
motion_resolution = 1_000_000

[[axis]]
name = "slide"
instance = 2
drive = "drive-b"
unit = "millimetre"
motion_resolution = 10_000

[axis.limits]
position_min = -5.0
position_max = 1_000.0

[south.sercos]
interface = "sercos0"
cycle_time = "4 ms"
jitter = "200 us"
allowed_losses = 500 # nobody promises the tests a host that keeps time

[[south.sercos.drive]]
name = "drive-a"
address = 1

[[south.sercos.drive]]
name = "drive-b"
address = 2
"#;

/// What happens to the time.
const KILLED: &str = "the grandmaster is killed and comes back";
const BETTER: &str = "a better grandmaster appears";
const STEP: &str = "the grandmaster steps by 10 ms";
const ASYMMETRY: &str = "100 us of asymmetric delay and 20 % loss";

/// Controller update period: two cycles of the bus.
const PERIOD_US: u32 = 8_000;

/// How often a grandmaster tells the time, and how long each phase lasts at least.
#[derive(Clone, Copy)]
struct Pace {
    log_announce: i8,
    log_sync: i8,
    phase: Duration,
    /// The relay's delay grows by one part in so many, 12.5 us from Sync to Sync: a sudden one is taken for a step of the master, and
    /// that is another phase.
    ramp: u32,
    /// How long the axes move: as long as all phases.
    motion: u32,
}

/// As CIP Sync does.
const CIP_SYNC: Pace =
    Pace { log_announce: 1, log_sync: 0, phase: Duration::from_secs(60), ramp: 80_000, motion: 420 };

/// Four times as often, for a short test.
const FAST: Pace =
    Pace { log_announce: -1, log_sync: -2, phase: Duration::from_secs(3), ramp: 20_000, motion: 30 };

/// A machine on the switch, at interface `net0`; behind the relay, `through` is its namespace.
fn plug(switch: &Namespace, role: &str, address: &str) -> Namespace {
    let host = Namespace::new(role);
    let port = format!("to-{role}");
    cable((&host, "net0", Some(&format!("{address}/24"))), (switch, &port, None));
    bridge(switch, &["link", "set", &port, "master", "switch"]);
    host
}

fn bridge(switch: &Namespace, arguments: &[&str]) {
    let status = Command::new("ip").args(["-n", switch.name()]).args(arguments).status();
    assert!(status.is_ok_and(|status| status.success()), "ip {arguments:?}");
}

fn switch() -> Namespace {
    let switch = Namespace::new("switch");
    bridge(&switch, &["link", "add", "switch", "type", "bridge", "mcast_snooping", "0"]);
    bridge(&switch, &["link", "set", "switch", "up"]);
    switch
}

/// The machines with the gateway, its drives and the controller at work.
struct Plant {
    switch: Namespace,
    master: Namespace,
    controller: Namespace,
    gateway: Namespace,
    drives: (Namespace, Running),
    run: Running,
    log: PathBuf,
    capture: PathBuf,
}

impl Plant {
    fn start(name: &str) -> Self {
        let switch = switch();
        let master = plug(&switch, "gm", "192.168.40.1");
        let controller = plug(&switch, "ctl", CONTROLLER);
        let gateway = plug(&switch, "box", GATEWAY);
        let drives = Namespace::new("drv");
        cable((&gateway, "sercos0", None), (&drives, "sercos0", None));
        let arguments =
            ["simulate", "sercos-drive", "--interface", "sercos0", "--slaves", "2", "--linear", "2"];
        let mut line = in_namespace(&drives, &arguments);
        let line = Running::start("simulate sercos-drive", line.stdin(Stdio::null()).stderr(Stdio::null()));
        let (config, log) = (scratch(&format!("{name}.toml")), scratch(&format!("{name}.log")));
        let capture = scratch(&format!("{name}.pcapng"));
        std::fs::write(&config, CONFIGURATION).expect("the configuration can be written");
        let mut run = in_namespace(&gateway, &["run", "--config"]);
        run.arg(&config).arg("--capture").arg(&capture).env("NO_COLOR", "1");
        run.stderr(std::fs::File::create(&log).expect("the log can be written"));
        let run = Running::start("run", &mut run);
        Self { switch, master, controller, gateway, drives: (drives, line), run, log, capture }
    }

    /// A controller that moves both axes for so many seconds; what it prints goes to a file.
    fn controller(&self, name: &str, seconds: u32, time: &[&str]) -> (Running, PathBuf) {
        let (seconds, period) = (seconds.to_string(), PERIOD_US.to_string());
        let arguments = [
            "simulate",
            "controller",
            "--target",
            GATEWAY,
            "--bind",
            CONTROLLER,
            "--axes",
            "2",
            "--counts-per-unit",
            "1000000,10000",
            "--speed",
            "2,20",
            "--json",
            "--seconds",
            &seconds,
            "--update-period-us",
            &period,
        ];
        let printed = scratch(&format!("{name}-controller.json"));
        let mut command = in_namespace(&self.controller, &arguments);
        command.args(time).stdout(std::fs::File::create(&printed).expect("the result can be written"));
        (Running::start("simulate controller", &mut command), printed)
    }

    fn text(&self) -> String {
        std::fs::read_to_string(&self.log).unwrap_or_default()
    }

    /// Waits until the log has `text` once more than it had in `before`.
    fn wait_for_another(&mut self, before: &str, text: &str) {
        wait_for_count(&self.log, text, before.matches(text).count() + 1, &mut self.run);
    }

    /// Ends everything. Gives the log.
    fn end(mut self) -> String {
        assert!(self.run.ended().is_none(), "the box still runs");
        assert_eq!(self.run.terminate(Duration::from_secs(10)).code(), Some(0));
        self.drives.1.terminate(Duration::from_secs(10));
        self.text()
    }
}

/// Whether an axis or the device had a fault.
fn is_faulted(log: &str) -> bool {
    log.contains("fault action") || log.replace("No Fault (0)", "").contains("Fault (")
}

/// Whether the last of these lines of a log about time says that it is synchronized, or there are none.
fn is_synchronized(log: &str) -> bool {
    let last = log.lines().rfind(|line| line.contains("system time: "));
    last.is_none_or(|line| line.contains("system time: synchronized") || line.contains("holdover"))
}

/// Both axes ended where they had to.
fn both_arrived(printed: &Path) {
    let text = std::fs::read_to_string(printed).unwrap_or_default();
    let result: Value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"));
    let axes = result["axes"].as_array().expect("an array `axes`");
    assert_eq!(axes.len(), 2, "{result}");
    for axis in axes {
        assert!(axis["in_window"] == true && axis["target"].as_f64().unwrap() > 1.0, "{result}");
    }
}

/// Nothing that the drives were sent was a jump; there were so many set-points at least. Then the same with one set-point changed,
/// which has to show.
fn no_jump(capture: &Path, log: &str, set_points: u64, changed: u64) {
    let config = Config::parse(CONFIGURATION, "three clocks").expect("the configuration is right");
    let period = DurationNs::from_micros(PERIOD_US.into());
    let judged = recording::judge(&config, period, capture, |_, _, _| {}).expect("the recording can be read");
    let shown: Vec<_> = judged.violations.iter().take(5).map(ToString::to_string).collect();
    assert!(
        shown.is_empty(),
        "{} violations, frames late by {} at most: {}\n{}",
        judged.violations.len(),
        judged.late,
        shown.join("\n"),
        log.lines()
            .filter(|line| line.contains("WARN") || line.contains("ERROR"))
            .collect::<Vec<_>>()
            .join("\n")
    );
    for (axis, fastest) in judged.statistics.iter().zip([0.5e9, 4e9]) {
        assert!(axis.set_points > set_points && axis.fastest > fastest, "synchronous set-points: {axis:?}");
    }
    // The same recording with one set-point of the turntable that is 400 counts of the drive too far.
    let mut is_changed = false;
    let judged = recording::judge(&config, period, capture, |axis, so_far, reading| {
        if let (0, true, Some(point)) = (axis, so_far >= changed, &mut reading.follows)
            && !std::mem::replace(&mut is_changed, true)
        {
            point.counts += 400;
        }
    });
    let found = judged.expect("the recording can be read").violations;
    assert!(found.iter().any(|found| found.axis == 0), "it is seen: {found:?}");
}

fn axes_move_through_changes_of_their_time(name: &str, pace: Pace) {
    if !peer::namespaces_or_skip(name) || !peer::ptp4l_or_skip(name) {
        return;
    }
    let _bus = a_bus();
    in_real_time(name, || {
        let mut plant = Plant::start(name);
        let intervals =
            format!("logAnnounceInterval {}\nlogSyncInterval {}\n", pace.log_announce, pace.log_sync);
        let mut master = ptp4l(&plant.master, 128, &intervals);
        // A gateway without any time takes the first stamps of a connection for a step.
        plant.wait_for_another("", "offsets are being measured");
        let time = ["--time", "ptp", "--time-threshold", "100"];
        let (mut controller, printed) = plant.controller(name, pace.motion, &time);
        wait_for_count(&plant.log, "-> Running", 2, &mut plant.run);
        let started = plant.text();
        assert!(!started.contains("Clock Sync"), "{started}");

        let mut phases = Vec::new();
        let mut phase = |plant: &mut Plant, title: &'static str, act: &mut dyn FnMut(&mut Plant, &str)| {
            let (before, begun) = (plant.text(), Instant::now());
            act(plant, &before);
            std::thread::sleep(pace.phase.saturating_sub(begun.elapsed()));
            phases.push((title, plant.text()[before.len()..].to_owned()));
        };

        phase(&mut plant, KILLED, &mut |plant, before| {
            master.terminate(Duration::from_secs(10));
            plant.wait_for_another(before, "holdover: the master is silent");
            master = ptp4l(&plant.master, 128, &intervals);
            plant.wait_for_another(before, "system time: synchronized");
        });

        // Behind a relay, to be able to lose and delay.
        let relay = Namespace::new("relay");
        let better = Namespace::new("gm2");
        cable((&better, "net0", Some("192.168.40.4/24")), (&relay, "host", None));
        cable((&relay, "net", None), (&plant.switch, "to-relay", None));
        bridge(&plant.switch, &["link", "set", "to-relay", "master", "switch"]);
        let own = std::env::current_exe().expect("own path");
        let mut inside = relay.command(own.to_str().expect("UTF-8"));
        inside.args(["--exact", "synchronous::relay", "--nocapture"]).env(RELAY, "host net");
        let mut relaying = inside.stdin(Stdio::piped()).stdout(Stdio::null()).spawn().expect("the relay");
        let mut tell_relay = relaying.stdin.take().expect("piped");

        // Its clock steps in the phase behind the next one.
        let (announce, sync) = (pace.log_announce.to_string(), pace.log_sync.to_string());
        let step_after = pace.phase.as_secs() + 9;
        let step = format!("{step_after}:10");
        let arguments = [
            "simulate",
            "grandmaster",
            "--interface",
            "net0",
            "--priority1",
            "100",
            "--clock-offset",
            "4",
            "--clock-drift",
            "40",
            "--clock-step",
            &step,
            "--log-announce",
            &announce,
            "--log-sync",
            &sync,
        ];
        let second_begun = Instant::now();
        let mut second = in_namespace(&better, &arguments);
        let mut second = Running::start("simulate grandmaster", second.stdout(Stdio::null()));
        phase(&mut plant, BETTER, &mut |plant, before| {
            plant.wait_for_another(before, "another grandmaster is followed");
            plant.wait_for_another(before, "system time: synchronized");
        });
        assert!(second_begun.elapsed().as_secs() < step_after, "it has not stepped yet");

        phase(&mut plant, STEP, &mut |plant, before| {
            plant.wait_for_another(before, "the grandmaster's clock has stepped");
            plant.wait_for_another(before, "system time: synchronized");
        });

        phase(&mut plant, ASYMMETRY, &mut |plant, before| {
            writeln!(tell_relay, "100 20 {}", pace.ramp).expect("the relay listens");
            std::thread::sleep(Duration::from_secs(4).max(pace.phase / 2));
            let end = Instant::now() + Duration::from_secs(10);
            while !is_synchronized(&plant.text()[before.len()..]) && Instant::now() < end {
                std::thread::sleep(Duration::from_millis(50));
            }
        });

        assert!(
            controller.ended().is_none(),
            "the axes have moved all the time: {}\n{}",
            std::fs::read_to_string(&printed).unwrap_or_default(),
            plant.text()
        );
        let status = controller.wait(Duration::from_secs(u64::from(pace.motion) + 60));
        assert!(
            status.success(),
            "{status}: {}\n{}",
            std::fs::read_to_string(&printed).unwrap_or_default(),
            plant.text()
        );
        both_arrived(&printed);
        second.terminate(Duration::from_secs(10));
        master.terminate(Duration::from_secs(10));
        drop(tell_relay);
        // It ends with its input.
        let _ = relaying.wait();
        let capture = plant.capture.clone();
        let log = plant.end();
        for (title, text) in &phases {
            println!("---- {title}\n{text}");
        }
        assert!(!is_faulted(&log), "{log}");
        no_jump(&capture, &log, 4_000, 2_000);
        for (title, text) in phases {
            assert!(is_synchronized(&text), "{title}: {text}");
            // An alarm is due at a change of the grandmaster, and ten seconds after the loss of time (IEC 61800-7-202, 6.5.4). At a Sync
            // each second it takes eight Syncs behind a step to be synchronized again.
            let alarms = text.matches("Clock Sync Alarm").count();
            let is_slow = pace.log_sync >= 0;
            let most = if title == BETTER || title == STEP && is_slow { 1 } else { 0 };
            assert!(alarms <= most, "{title}: {text}");
        }
    });
}

#[test]
fn axes_move_synchronously_through_changes_of_the_grandmaster() {
    axes_move_through_changes_of_their_time(
        "axes_move_synchronously_through_changes_of_the_grandmaster",
        FAST,
    );
}

#[test]
#[ignore = "a minute for each phase"]
fn axes_move_synchronously_for_minutes() {
    axes_move_through_changes_of_their_time("axes_move_synchronously_for_minutes", CIP_SYNC);
}

/// The controller is the grandmaster: the gateway follows it, another follower too, and tshark reads what it sends. A controller that
/// has the time from elsewhere is refused for its grandmaster.
#[test]
fn a_controller_that_is_the_grandmaster_moves_the_axes_of_its_follower() {
    let name = "a_controller_that_is_the_grandmaster_moves_the_axes_of_its_follower";
    if !peer::namespaces_or_skip(name) || !peer::ptp4l_or_skip(name) || !peer::tshark_or_skip(name) {
        return;
    }
    let _bus = a_bus();
    in_real_time(name, || {
        let mut plant = Plant::start(name);
        let capture = scratch(&format!("{name}-ptp.pcapng"));
        let mut tshark = plant.gateway.command("tshark");
        tshark.args(["-q", "-i", "net0", "-f", "udp port 319 or udp port 320", "-w"]).arg(&capture);
        let mut tshark = Running::start("tshark", tshark.stdout(Stdio::null()).stderr(Stdio::null()));
        let mut follower = ptp4l(
            &plant.master,
            130,
            "slaveOnly 1\nlogAnnounceInterval -1\nsummary_interval -4\nfreq_est_interval 0\n",
        );
        // The clock of the controller's interface tells its time before the controller connects: a gateway without any takes the
        // first stamps of a connection for a step.
        let clock = ["--log-announce", "-1", "--log-sync", "-2", "--priority1", "120", "--clock-offset", "5"];
        let mut first = in_namespace(&plant.controller, &["simulate", "grandmaster", "--interface", "net0"]);
        let mut first = Running::start("simulate grandmaster", first.args(clock).stdout(Stdio::null()));
        plant.wait_for_another("", "system time: synchronized");
        first.terminate(Duration::from_secs(10));
        let time = [&["--time", "grandmaster", "--clock-step", "6:20"], &clock[..]].concat();
        let (mut controller, printed) = plant.controller(name, 6, &time);
        let status = controller.wait(Duration::from_secs(60));
        let said = std::fs::read_to_string(&printed).unwrap_or_default();
        assert!(status.success(), "{status}: {said}\n{}", plant.text());
        both_arrived(&printed);
        follower.terminate(Duration::from_secs(10));
        tshark.terminate(Duration::from_secs(10));

        // Whose time the gateway has is no question: the clock of the host is another one.
        let script = scratch(&format!("{name}-script.toml"));
        let text = "[connection]\ntarget = \"192.168.40.3\"\nbind = \"192.168.40.2\"\n\
                    wait = { synchronization = \"1 s\" }\n[axis.1]\ncounts_per_unit = 1_000_000\n\
                    [[step]]\nenable = 1\n";
        std::fs::write(&script, text).expect("the script can be written");
        let mut refused = in_namespace(&plant.controller, &["simulate", "controller", "--script"]);
        let refused = refused.arg(&script).output().expect("the controller can be started");
        let told = String::from_utf8_lossy(&refused.stderr);
        assert!(!refused.status.success() && told.contains("different grand master"), "{told}");

        let (gateway_capture, log_of_follower) = (plant.capture.clone(), log_of(&plant.master, 130));
        let log = plant.end();
        assert!(!is_faulted(&log), "{log}");
        no_jump(&gateway_capture, &log, 300, 400);
        ptp_is_told_as_it_should(&capture);
        // What ptp4l measures is the clock of the controller against the host's.
        let followed = std::fs::read_to_string(log_of_follower).unwrap_or_default();
        let offset =
            |line: &str| line.split("master offset").nth(1)?.split_whitespace().next()?.parse::<i64>().ok();
        let offsets: Vec<i64> = followed.lines().filter_map(offset).collect();
        let near =
            |expected: i64| offsets.iter().filter(|offset| (*offset + expected).abs() < 1_500_000).count();
        assert!(near(5_000_000) >= 3, "5 ms ahead: {offsets:?}: {followed}");
        assert!(near(25_000_000) >= 1, "and 20 ms more behind the step: {offsets:?}");
    });
}

/// The PTP messages of the controller, as Wireshark reads them.
fn ptp_is_told_as_it_should(capture: &Path) {
    let fields = [
        "frame.time_epoch",
        "ptp.v2.messagetype",
        "ip.dsfield.dscp",
        "udp.dstport",
        "udp.length",
        "ptp.v2.flags",
        "ptp.v2.logmessageperiod",
        "ip.ttl",
        "ptp.v2.domainnumber",
        "ptp.v2.an.priority1",
        "ptp.v2.an.grandmasterclockclass",
        "ptp.v2.an.grandmasterclockaccuracy",
        "ptp.v2.timesource",
    ];
    let mut read = Command::new("tshark");
    read.arg("-r").arg(capture).args(["-Y", &format!("ip.src == {CONTROLLER}"), "-T", "fields"]);
    fields.iter().for_each(|field| {
        read.args(["-e", field]);
    });
    let output = read.output().expect("tshark can be started");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let mut kinds: std::collections::BTreeMap<&str, Vec<(f64, Vec<&str>)>> =
        std::collections::BTreeMap::new();
    for line in text.lines() {
        let words: Vec<&str> = line.split('\t').collect();
        let Ok(at) = words[0].parse::<f64>() else { continue };
        // Joining the group is no PTP.
        if !words[1].is_empty() {
            kinds.entry(words[1]).or_default().push((at, words[2..].to_vec()));
        }
    }
    let found: Vec<_> = kinds.keys().copied().collect();
    assert_eq!(found, ["0x00", "0x08", "0x09", "0x0b"], "Sync, Follow_Up, Delay_Resp, Announce: {text}");
    for (kind, head, interval) in [
        ("0x00", ["59", "319", "52", "0x0200", "-2", "1", "0"], Some(0.25)),
        ("0x08", ["47", "320", "52", "0x0000", "-2", "1", "0"], Some(0.25)),
        ("0x09", ["47", "320", "62", "0x0000", "0", "1", "0"], None),
        ("0x0b", ["47", "320", "72", "0x0000", "-1", "1", "0"], Some(0.5)),
    ] {
        let messages = &kinds[kind];
        assert!(messages.iter().all(|(_, words)| words[..7] == head), "{kind}: {messages:?}");
        let Some(interval) = interval else { continue };
        let mut intervals: Vec<f64> = messages.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
        intervals.sort_by(f64::total_cmp);
        let middle = intervals[intervals.len() / 2];
        assert!((middle - interval).abs() < interval / 20.0, "{kind}: every {middle} s");
    }
    let (_, announce) = &kinds["0x0b"][0];
    assert_eq!(announce[7..], ["120", "248", "0xfe", "0xa0"], "priority, class, accuracy, source");
}

/// Not a test of its own: passes IPv4 frames between two interfaces. A line of its input sets by how many microseconds longer frames
/// take towards the second one, how many of a hundred are lost in both directions, and by one part in how many of the time the delay
/// grows. It ends with its input.
#[test]
fn relay() {
    let Ok(interfaces) = std::env::var(RELAY) else { return };
    const IPV4: u16 = 0x0800;
    // A late relay is a late message.
    let _ = realtime::apply(&realtime::Request { priority: Some(60), ..realtime::Request::default() });
    let sockets: Vec<PacketSocket> = interfaces
        .split(' ')
        .map(|interface| PacketSocket::open(interface, IPV4).expect("the interface is up"))
        .collect();
    let (sender, settings) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            let numbers: Vec<u64> = line.split(' ').filter_map(|word| word.parse().ok()).collect();
            if let [delay, loss, ramp] = numbers[..] {
                let _ = sender.send((Duration::from_micros(delay), loss, u32::try_from(ramp).unwrap_or(1)));
            }
        }
        drop(sender);
    });
    let (mut delay, mut loss, mut ramp, mut passed, mut set_at) =
        (Duration::ZERO, 0, 1, 0_u64, Instant::now());
    let mut buffer = [0; 2048];
    loop {
        match settings.try_recv() {
            Ok(set) => ((delay, loss, ramp), set_at) = (set, Instant::now()),
            Err(std::sync::mpsc::TryRecvError::Disconnected) => return,
            Err(std::sync::mpsc::TryRecvError::Empty) => {}
        }
        packet_socket::wait(&sockets, Duration::from_millis(20)).expect("both interfaces are there");
        for (from, to) in [(0, 1), (1, 0)] {
            while let Ok(Some(received)) = sockets[from].recv(&mut buffer) {
                let begun = Instant::now();
                passed += 1;
                // Spread out, and the same in each run.
                if passed.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32 & 0xFFFF < loss * 0xFFFF / 100 {
                    continue;
                }
                let delay = delay.min(set_at.elapsed() / ramp);
                while from == 0 && begun.elapsed() < delay {}
                let frame = &mut buffer[..received.len];
                // The checksum of a datagram is left to the network card, which a virtual cable has none of: there is none (RFC 768).
                if let Some([17, .., _, _]) = frame.get(23..42) {
                    frame[40..42].fill(0);
                }
                let _ = sockets[to].send(frame);
            }
        }
    }
}
