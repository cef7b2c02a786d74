//! The box as a follower of somebody else's grandmaster: linuxptp's `ptp4l` on a virtual cable.
//!
//! The namespaces of a host have one clock. `ptp4l` tells that clock; the box sees only what comes over the cable, and its system time
//! is compared with the clock itself.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use axisbridge::config::{Time, TimeSource};
use axisbridge::sys::clock::realtime_reading;
use axisbridge::time::feed::line_at;
use axisbridge::time::source::{Place, TimeService};
use axisbridge_tests::namespace::{Namespace, cable};
use axisbridge_tests::peer;
use axisbridge_tests::process::Running;
use serde_json::Value;

use super::{in_namespace, scratch, wait_for};

const BOX: &str = "192.168.30.20";

/// How far the system time may be off the clock, ns. Stamps of the kernel and a busy host leave some microseconds; a time without the
/// measured delay, or of another clock, is further off.
const TOLERANCE_NS: i64 = 200_000;

/// The shipped example with simulated drives, at the address of this test, with this source of system time.
fn configuration(name: &str, source: &str) -> PathBuf {
    let mut example = include_str!("../../../examples/two-axes-in-process.toml").to_owned();
    let listen = format!("listen = \"{BOX}\"");
    let time = format!("[time]\n{source}\nthreshold = \"100 us\"\n\n[log]\n");
    for (shipped, here) in [
        ("listen = \"127.0.0.2\"", listen.as_str()),
        ("listen = \"127.0.0.1:1502\"", "listen = \"127.0.0.1:1602\""),
        // On a busy host a stamp is late more often than on a machine.
        ("[log]\n", time.as_str()),
    ] {
        assert!(example.contains(shipped), "the shipped example has {shipped:?}");
        example = example.replace(shipped, here);
    }
    let path = scratch(&format!("{name}.toml"));
    std::fs::write(&path, example).expect("the scratch folder can be written");
    path
}

/// The management socket of a `ptp4l`; tests run beside each other, and a namespace is that of one.
fn socket(namespace: &Namespace, priority: u8) -> PathBuf {
    std::env::temp_dir().join(format!("{}-ptp4l-{priority}", namespace.name()))
}

/// What a `ptp4l` prints.
pub fn log_of(namespace: &Namespace, priority: u8) -> PathBuf {
    scratch(&format!("ptp4l-{}-{priority}.log", namespace.name()))
}

/// A grandmaster in a namespace.
fn grandmaster(namespace: &Namespace, priority: u8) -> Running {
    ptp4l(namespace, priority, "logAnnounceInterval 1\nlogSyncInterval 0\n")
}

/// `ptp4l` in a namespace with these settings. It sets no clock (`free_running`): a slave would set
/// that of the host, which all namespaces share.
pub fn ptp4l(namespace: &Namespace, priority: u8, settings: &str) -> Running {
    let log = log_of(namespace, priority);
    let (config, socket) = (log.with_extension("conf"), socket(namespace, priority));
    let text = format!(
        "[global]\ntime_stamping software\nfree_running 1\nnetwork_transport UDPv4\ndelay_mechanism E2E\n{settings}\
         logMinDelayReqInterval 0\ndscp_event 59\ndscp_general 47\ntx_timestamp_timeout 50\n\
         priority1 {priority}\nuds_address {}\n",
        socket.display()
    );
    std::fs::write(&config, text).expect("the scratch folder can be written");
    let mut command = namespace.command("ptp4l");
    command.args(["-i", "net0", "-m", "-f", config.to_str().expect("a path in UTF-8")]);
    let log = std::fs::File::create(log).expect("the log can be written");
    Running::start("ptp4l", command.stdout(log).stderr(Stdio::null()))
}

/// The Time Sync object as pycomm3 reads it in the controller's namespace.
fn time_sync(controller: &Namespace, python: &Path, settings: &[&str]) -> Value {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/pycomm3_time_sync.py");
    let mut command: Command = controller.command(python.to_str().expect("a path in UTF-8"));
    let output = command.arg(script).arg(BOX).args(settings).output().expect("the client can be started");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "the client ended with {}: {errors}", output.status);
    serde_json::from_slice(&output.stdout).expect("the client prints one JSON object")
}

/// The object as soon as it says that time is synchronized: the server of the device looks at the clock some times in a second.
fn synchronized(controller: &Namespace, python: &Path) -> Value {
    for _ in 0..10 {
        let object = time_sync(controller, python, &[]);
        if octets(&object, 2) == [1] {
            return object;
        }
        std::thread::sleep(Duration::from_millis(300));
    }
    panic!("the log says synchronized, the object does not");
}

fn octets<const N: usize>(object: &Value, attribute: u16) -> [u8; N] {
    octets_of(object, &attribute.to_string())
}

fn octets_of<const N: usize>(object: &Value, attribute: &str) -> [u8; N] {
    let text = object[attribute].as_str().expect("a value");
    let octet = |place: usize| u8::from_str_radix(text.get(2 * place..2 * place + 2)?, 16).ok();
    let octets: Option<Vec<u8>> = (0..text.len() / 2).map(octet).collect();
    octets
        .and_then(|octets| octets.try_into().ok())
        .unwrap_or_else(|| panic!("attribute {attribute}: {text}"))
}

#[test]
fn the_box_follows_a_foreign_grandmaster_through_its_loss_and_a_better_one() {
    let test = "the_box_follows_a_foreign_grandmaster_through_its_loss_and_a_better_one";
    let Some(python) = peer::python_or_skip(test, "pycomm3") else { return };
    if !peer::namespaces_or_skip(test) || !peer::tshark_or_skip(test) || !peer::ptp4l_or_skip(test) {
        return;
    }
    let (controller, gateway) = (Namespace::new("ctl"), Namespace::new("box"));
    cable((&controller, "net0", Some("192.168.30.1/24")), (&gateway, "net0", Some(&format!("{BOX}/24"))));
    let capture = scratch("ptp.pcapng");
    let mut tshark = gateway.command("tshark");
    tshark.args(["-q", "-i", "net0", "-f", "udp port 319 or udp port 320", "-a", "duration:20", "-w"]);
    let tshark = Running::start("tshark", tshark.arg(&capture).stdout(Stdio::null()).stderr(Stdio::null()));

    let mut master = grandmaster(&controller, 128);
    let (config, log) = (configuration("ptp", "source = \"ptp\""), scratch("ptp.log"));
    let mut run = in_namespace(&gateway, &["run", "--config", config.to_str().expect("a path in UTF-8")]);
    run.env("NO_COLOR", "1").stderr(std::fs::File::create(&log).expect("the log can be written"));
    let mut the_box = Running::start("run", &mut run);
    let before = time_sync_when_up(&controller, &python);
    assert_eq!((octets(&before, 1), octets(&before, 2)), ([1], [0]), "PTP runs, and nothing is proven yet");
    wait_for_count(&log, "system time: synchronized", 1, &mut the_box);

    let object = synchronized(&controller, &python);
    let told = u64::from_le_bytes(octets(&object, 4)).cast_signed();
    let (from, to) = (object["before"].as_i64().unwrap(), object["after"].as_i64().unwrap());
    let window = from - TOLERANCE_NS..=to + TOLERANCE_NS;
    assert!(window.contains(&told), "system time {told} is not between {from} and {to}");
    let offset = i64::from_le_bytes(octets(&object, 5));
    assert!(offset.abs() <= 100_000, "offset {offset} ns");
    let delay = i64::from_le_bytes(octets(&object, 7));
    assert!((1..100_000).contains(&delay), "path delay {delay} ns");
    let grandmaster_info: [u8; 24] = octets(&object, 8);
    let parent: [u8; 16] = octets(&object, 9);
    assert_eq!(grandmaster_info[..8], parent[..8], "the grandmaster is the parent");
    assert_eq!(grandmaster_info[20..], [128, 0, 128, 0], "its priorities");
    assert_eq!(
        (octets(&object, 12), octets(&object, 27)),
        ([1, 0, 1, 0, 9, 0], [1, 0]),
        "slave, one step away"
    );
    let local: [u8; 20] = octets(&object, 10);
    assert_ne!(local[..8], grandmaster_info[..8]);
    assert_eq!((octets(&object, 18), octets(&object, 19)), ([0], [1, 0]), "domain 0, ordinary clock");

    // The class of the axes says the same: how well, within what, and how long a change takes to come here.
    let variance = u32::from_le_bytes(octets_of(&object, "class 28"));
    assert!((1..100_000).contains(&variance), "variation {variance} ns");
    assert_eq!(
        u32::from_le_bytes(octets_of(&object, "class 29")),
        100_000,
        "the threshold of the configuration"
    );
    assert_eq!(
        f32::from_le_bytes(octets_of(&object, "class 30")).to_bits(),
        1_f32.to_bits(),
        "one step of a second"
    );
    for (attribute, expected) in [("class 2", [2, 0]), ("class 3", [2, 0]), ("class 6", [36, 0])] {
        assert_eq!(octets_of(&object, attribute), expected, "{attribute}");
    }

    // What the box sends, as Wireshark reads it.
    drop(tshark);
    let fields = [
        "-T",
        "fields",
        "-e",
        "ip.dsfield.dscp",
        "-e",
        "ptp.v2.domainnumber",
        "-e",
        "ip.ttl",
        "-e",
        "ip.dst",
    ];
    let mut read = Command::new("tshark");
    read.arg("-r").arg(&capture).args(["-Y", "ptp.v2.messagetype == 1 && udp.dstport == 319"]).args(fields);
    let output = read.output().expect("tshark can be started");
    let requests = String::from_utf8_lossy(&output.stdout);
    assert!(requests.lines().count() >= 5, "delay requests: {requests}");
    assert!(requests.lines().all(|line| line == "59\t0\t1\t224.0.1.129"), "{requests}");

    // The grandmaster dies: the time is held over. Another domain is nobody's.
    master.terminate(Duration::from_secs(10));
    wait_for(&log, "holdover: the master is silent", &mut the_box);
    let held = time_sync(&controller, &python, &["6=0000000000000000"]);
    assert_eq!((octets(&held, 2), held["set 6"].as_str()), ([1], Some("done")));
    // The interface goes and comes back as another one under its name.
    let mut unplug = gateway.command("ip");
    assert!(unplug.args(["link", "delete", "net0"]).status().is_ok_and(|status| status.success()));
    cable((&controller, "net0", Some("192.168.30.1/24")), (&gateway, "net0", Some(&format!("{BOX}/24"))));
    wait_for(&log, "the interface was replaced by another one of its name", &mut the_box);
    // A better one comes.
    let mut better = grandmaster(&controller, 100);
    let log_before =
        std::fs::read_to_string(&log).unwrap_or_default().matches("system time: synchronized").count();
    wait_for_count(&log, "system time: synchronized", log_before + 1, &mut the_box);
    let object = synchronized(&controller, &python);
    let priorities: [u8; 24] = octets(&object, 8);
    assert_eq!((priorities[20], octets(&object, 2)), (100, [1]), "{object:#}");

    better.terminate(Duration::from_secs(10));
    assert_eq!(the_box.terminate(Duration::from_secs(10)).code(), Some(0));
}

#[test]
fn the_box_takes_the_time_of_ptp4l_beside_it() {
    let test = "the_box_takes_the_time_of_ptp4l_beside_it";
    let Some(python) = peer::python_or_skip(test, "pycomm3") else { return };
    if !peer::namespaces_or_skip(test) || !peer::ptp4l_or_skip(test) {
        return;
    }
    let (controller, gateway) = (Namespace::new("ctl"), Namespace::new("box"));
    cable((&controller, "net0", Some("192.168.30.1/24")), (&gateway, "net0", Some(&format!("{BOX}/24"))));
    let mut daemon = grandmaster(&gateway, 77);
    let source = format!("source = \"daemon\"\nsocket = \"{}\"", socket(&gateway, 77).display());
    let (config, log) = (configuration("ptp-daemon", &source), scratch("ptp-daemon.log"));
    let mut run = in_namespace(&gateway, &["run", "--config", config.to_str().expect("a path in UTF-8")]);
    run.env("NO_COLOR", "1").stderr(std::fs::File::create(&log).expect("the log can be written"));
    let mut the_box = Running::start("run", &mut run);
    wait_for_count(&log, "system time: synchronized", 1, &mut the_box);
    let object = synchronized(&controller, &python);
    let told = u64::from_le_bytes(octets(&object, 4)).cast_signed();
    let (from, to) = (object["before"].as_i64().unwrap(), object["after"].as_i64().unwrap());
    assert!(
        (from - TOLERANCE_NS..=to + TOLERANCE_NS).contains(&told),
        "{told} is not between {from} and {to}"
    );
    let grandmaster_info: [u8; 24] = octets(&object, 8);
    assert_eq!((grandmaster_info[20], octets(&object, 2)), (77, [1]), "{object:#}");
    daemon.terminate(Duration::from_secs(10));
    wait_for(&log, "holdover: the master is silent", &mut the_box);
    assert_eq!(the_box.terminate(Duration::from_secs(10)).code(), Some(0));
}

/// Set for the copy of this test binary that follows inside the gateway's namespace.
const FOLLOWER: &str = "AXISBRIDGE_TEST_FOLLOWER";

/// How far the follower's time is off the clock that the grandmaster tells, for docs/performance.md; it judges nothing.
#[test]
#[ignore = "a measurement of a minute"]
fn measure_the_follower() {
    let (controller, gateway) = (Namespace::new("ctl"), Namespace::new("box"));
    cable((&controller, "net0", Some("192.168.30.1/24")), (&gateway, "net0", Some(&format!("{BOX}/24"))));
    let _master = grandmaster(&controller, 129);
    let own = std::env::current_exe().expect("own path");
    let mut inside = gateway.command(own.to_str().expect("UTF-8"));
    inside.args(["--exact", "ptp::follower", "--nocapture"]).env(FOLLOWER, "net0");
    assert!(inside.status().expect("the copy can be started").success());
}

/// The copy inside: prints mean, standard deviation, 99th percentile and largest error of 30 s that begin 30 s after the start.
#[test]
fn follower() {
    let Ok(interface) = std::env::var(FOLLOWER) else { return };
    let place = Place { interface: Some(interface), mac: [2, 0, 0, 0, 0, 9], event_dscp: 59 };
    let config = Time { source: TimeSource::Ptp, ..Time::default() };
    let (service, _feed) = TimeService::start(&config, &place).expect("the ports are free");
    std::thread::sleep(Duration::from_secs(30));
    let mut errors = Vec::new();
    for _ in 0..300 {
        std::thread::sleep(Duration::from_millis(100));
        let (line, clock) = (service.view().read().sample, realtime_reading());
        let (Some(line), Some(clock)) = (line, clock) else { continue };
        let told = line_at(&line, clock.at).system.0;
        errors.push(told.cast_signed().wrapping_sub(clock.time.cast_signed()));
    }
    let number = |value: usize| f64::from(u32::try_from(value).expect("few"));
    let value = |error: i64| f64::from(i32::try_from(error).expect("small"));
    let mean = errors.iter().map(|error| value(*error)).sum::<f64>() / number(errors.len());
    let square =
        errors.iter().map(|error| (value(*error) - mean).powi(2)).sum::<f64>() / number(errors.len());
    let mut sizes: Vec<u64> = errors.iter().map(|error| error.unsigned_abs()).collect();
    sizes.sort_unstable();
    let at = |percent: usize| sizes[(sizes.len() - 1) * percent / 100];
    println!("{}", service.view().read());
    println!(
        "{} readings: mean {mean:.0} ns, deviation {:.0} ns, p99 {} ns, largest {} ns",
        errors.len(),
        square.sqrt(),
        at(99),
        at(100)
    );
}

/// The object as soon as the box answers.
fn time_sync_when_up(controller: &Namespace, python: &Path) -> Value {
    for _ in 0..100 {
        let mut probe = controller.command("bash");
        probe.args(["-c", &format!("exec 3<>/dev/tcp/{BOX}/44818")]).stderr(Stdio::null());
        if probe.status().is_ok_and(|status| status.success()) {
            return time_sync(controller, python, &[]);
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    panic!("the box does not answer");
}

/// Waits until a text stands so often in the log of a box: a grandmaster takes ten seconds to become one, and the follower as long again
/// to believe it.
pub fn wait_for_count(log: &Path, text: &str, count: usize, process: &mut Running) {
    let end = std::time::Instant::now() + Duration::from_secs(60);
    loop {
        let seen = std::fs::read_to_string(log).unwrap_or_default();
        if seen.matches(text).count() >= count {
            return;
        }
        assert!(process.ended().is_none(), "the box has ended: {seen}");
        assert!(std::time::Instant::now() < end, "no {text:?} for the time {count} in the log: {seen}");
        std::thread::sleep(Duration::from_millis(50));
    }
}
