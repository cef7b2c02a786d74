//! SERCOS III lines and rings of simulated drives in processes of their own, behind virtual cables.

use std::fmt::Write as _;
use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Duration;

use axisbridge_tests::host::in_real_time;
use axisbridge_tests::namespace::{Namespace, cable};
use axisbridge_tests::peer;
use axisbridge_tests::process::Running;

use super::{a_bus, in_namespace, scratch, wait_for};

/// Address of the box, where its controller is in the same namespace.
const BOX: &str = "127.0.0.2";

/// Set for the copies of this test binary that talk to each other on the wire of a bus.
const TALKER: &str = "AXISBRIDGE_TEST_TALKER";

/// What the drives form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shape {
    Line,
    Ring,
    /// A line with a cable behind it that leads to a place for one more drive, and is not plugged in yet.
    Prepared,
}

/// A configuration with so many turning axes, each on the drive with its number as address; the last so many `late` ones may
/// come later.
fn configuration(name: &str, axes: usize, cycle_ms: u16, ring: bool, late: usize) -> PathBuf {
    // Nobody promises the tests a host that keeps time: two seconds without an answer.
    let losses = 2_000 / cycle_ms;
    let names = (1..=axes).map(|axis| format!("\"axis-{axis}\"")).collect::<Vec<_>>().join(", ");
    let mut text = format!(
        "[box]\nname = \"test\"\n[log]\nlevel = \"info\"\n\
         [time]\nsource = \"shared\"\n\
         [[device]]\nname = \"front\"\nlisten = \"{BOX}\"\naxes = [{names}]\n\
         update_period = {{ min = \"4 ms\", max = \"32 ms\" }}\n\
         [device.identity]\nvendor_id = 1\nproduct_code = 1\nserial_number = 1\n\
         [south.sercos]\ninterface = \"sercos0\"\n{}cycle_time = \"{cycle_ms} ms\"\n\
         jitter = \"200 us\"\nallowed_losses = {losses}\n",
        if ring { "ring_interface = \"sercos1\"\n" } else { "" }
    );
    for axis in 1..=axes {
        let _ = write!(
            text,
            "[[south.sercos.drive]]\nname = \"drive-{axis}\"\naddress = {axis}\nhot_plug = {}\n\
             [[axis]]\nname = \"axis-{axis}\"\ninstance = {axis}\ndrive = \"drive-{axis}\"\nunit = \"revolution\"\n",
            axis + late > axes
        );
    }
    let path = scratch(&format!("{name}.toml"));
    std::fs::write(&path, text).expect("the scratch folder can be written");
    path
}

/// The box and processes of drives one behind the other, in namespaces of their own.
struct Bus {
    gateway: Namespace,
    /// Each with interface `in`, nearer to the box's port 1, and `out`.
    segments: Vec<Namespace>,
    drives: Vec<Running>,
    run: Running,
    log: PathBuf,
}

impl Bus {
    /// Starts so many processes with so many drives each, and the box.
    fn start(name: &str, processes: usize, drives_each: usize, cycle_ms: u16, shape: Shape) -> Self {
        let (ring, late) = (shape == Shape::Ring, usize::from(shape == Shape::Prepared));
        let gateway = Namespace::new("box");
        let places = 0..processes + late;
        let segments: Vec<_> = places.map(|number| Namespace::new(&format!("d{number}"))).collect();
        cable((&gateway, "sercos0", None), (&segments[0], "in", None));
        for pair in segments.windows(2) {
            cable((&pair[0], "out", None), (&pair[1], "in", None));
        }
        if ring {
            cable((&segments[processes - 1], "out", None), (&gateway, "sercos1", None));
        }
        if late > 0 {
            segments[processes].set_link("in", false);
        }
        let drives = segments[..processes].iter().enumerate().map(|(number, segment)| {
            let (count, first) = (drives_each.to_string(), (number * drives_each + 1).to_string());
            let arguments =
                ["simulate", "sercos-drive", "--interface", "in", "--slaves", &count, "--address", &first];
            let mut command = in_namespace(segment, &arguments);
            if ring || number + 1 < segments.len() {
                command.args(["--ring", "out"]);
            }
            command.args(["--seconds", "90"]).stderr(Stdio::inherit());
            Running::start("simulate sercos-drive", &mut command)
        });
        let drives = drives.collect();
        let config = configuration(name, processes * drives_each + late, cycle_ms, ring, late);
        let log = scratch(&format!("{name}.log"));
        let mut command = in_namespace(&gateway, &["run", "--config", config.to_str().expect("UTF-8")]);
        command.env("NO_COLOR", "1").stderr(std::fs::File::create(&log).expect("the log can be written"));
        let run = Running::start("run", &mut command);
        Self { gateway, segments, drives, run, log }
    }

    fn wait_for(&mut self, text: &str) {
        wait_for(&self.log, text, &mut self.run);
    }

    /// A controller that moves all axes.
    fn controller(&self, axes: usize, seconds: u32) -> Running {
        let (axes, seconds) = (axes.to_string(), seconds.to_string());
        let arguments = [
            "simulate",
            "controller",
            "--target",
            BOX,
            "--bind",
            "127.0.0.1",
            "--axes",
            &axes,
            "--speed",
            "2",
            "--seconds",
            &seconds,
            "--update-period-us",
            "16000",
            "--json",
        ];
        let mut command = in_namespace(&self.gateway, &arguments);
        command.stdout(Stdio::null()).stderr(Stdio::inherit());
        Running::start("simulate controller", &mut command)
    }

    fn end(mut self) -> String {
        assert!(self.run.ended().is_none(), "the box still runs");
        assert_eq!(self.run.terminate(Duration::from_secs(10)).code(), Some(0));
        for mut drives in self.drives {
            drives.terminate(Duration::from_secs(10));
        }
        text(&self.log)
    }
}

fn text(log: &Path) -> String {
    std::fs::read_to_string(log).expect("the box has a log")
}

/// Takes a line to CP4 and moves every axis.
fn moves(name: &str, processes: usize, drives_each: usize, cycle_ms: u16) {
    if !peer::namespaces_or_skip(name) {
        return;
    }
    let _bus = a_bus();
    in_real_time(name, || {
        let mut bus = Bus::start(name, processes, drives_each, cycle_ms, Shape::Line);
        bus.wait_for("CP4");
        let mut controller = bus.controller(processes * drives_each, 2);
        let status = controller.wait(Duration::from_secs(60));
        assert!(status.success(), "the controller moved all axes: {status}\n{}", text(&bus.log));
        bus.end();
    });
}

#[test]
fn one_drive_at_1_ms() {
    moves("one_drive_at_1_ms", 1, 1, 1);
}

#[test]
fn four_drives_in_four_processes_at_2_ms() {
    moves("four_drives_in_four_processes_at_2_ms", 4, 1, 2);
}

#[test]
fn sixteen_drives_in_four_processes_at_4_ms() {
    moves("sixteen_drives_in_four_processes_at_4_ms", 4, 4, 4);
}

/// A ring of eight drives is cut in the middle and closed again while all axes move. No axis notices.
#[test]
fn a_ring_of_eight_is_cut_and_healed_while_all_axes_move() {
    let name = "a_ring_of_eight_is_cut_and_healed_while_all_axes_move";
    if !peer::namespaces_or_skip(name) {
        return;
    }
    let _bus = a_bus();
    in_real_time(name, || {
        let mut bus = Bus::start(name, 2, 4, 4, Shape::Ring);
        bus.wait_for("CP4");
        let mut controller = bus.controller(8, 6);
        bus.wait_for("-> Running");
        bus.segments[0].set_link("out", false);
        bus.wait_for("no connection between the slave with address 4 and the slave with address 5");
        bus.segments[0].set_link("out", true);
        bus.wait_for("the ring is closed again");
        let status = controller.wait(Duration::from_secs(60));
        let log = text(&bus.log);
        assert!(status.success(), "the controller moved all axes: {status}\n{log}");
        assert!(!log.contains("lost"), "no slave was lost: {log}");
        bus.end();
    });
}

/// A process with a drive is started behind a running one while that one moves; its axis comes in and is moved, and is gone
/// when its cable is pulled.
#[test]
fn a_drive_is_plugged_in_behind_a_running_one_and_moved() {
    let name = "a_drive_is_plugged_in_behind_a_running_one_and_moved";
    if !peer::namespaces_or_skip(name) {
        return;
    }
    let _bus = a_bus();
    in_real_time(name, || {
        let mut bus = Bus::start(name, 1, 1, 4, Shape::Prepared);
        bus.wait_for("a place is kept for the slave with address 2");
        bus.wait_for("CP4");
        let mut first = bus.controller(1, 12);
        bus.wait_for("-> Running");
        bus.segments[1].set_link("in", true);
        let arguments = ["simulate", "sercos-drive", "--interface", "in", "--address", "2", "--hot-plug"];
        let mut command = in_namespace(&bus.segments[1], &arguments);
        command.args(["--seconds", "90"]).stderr(Stdio::inherit());
        bus.drives.push(Running::start("simulate sercos-drive", &mut command));
        bus.wait_for("with address 2 takes part");
        let status = first.wait(Duration::from_secs(60));
        assert!(status.success(), "the first axis moved on: {status}\n{}", text(&bus.log));
        let mut both = bus.controller(2, 2);
        let status = both.wait(Duration::from_secs(60));
        let log = text(&bus.log);
        assert!(status.success(), "both axes moved: {status}\n{log}");
        assert!(!log.contains("lost"), "no slave was lost: {log}");
        bus.segments[1].set_link("in", false);
        bus.wait_for("slave at position 2 with address 2 was lost in CP4");
        bus.end();
    });
}

/// What a scan over a cable prints is a configuration that the check takes and the box runs.
#[test]
fn a_scan_over_a_cable_makes_a_configuration_that_runs() {
    let name = "a_scan_over_a_cable_makes_a_configuration_that_runs";
    if !peer::namespaces_or_skip(name) {
        return;
    }
    let _bus = a_bus();
    in_real_time(name, || {
        let (gateway, drives) = (Namespace::new("box"), Namespace::new("drv"));
        cable((&gateway, "sercos0", None), (&drives, "sercos0", None));
        let config = scratch(&format!("{name}.toml"));
        let path = config.to_str().expect("UTF-8");
        let output = |arguments: &[&str]| {
            let output = in_namespace(&gateway, arguments).output().expect("axisbridge can be started");
            let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
            (output.status.code(), text(&output.stdout), text(&output.stderr))
        };
        // An older run of the test may have left one.
        let _ = std::fs::remove_file(&config);
        let init = ["init", "--interface", "sercos0", "--output", path];
        let (status, printed, said) = output(&init);
        assert_eq!((status, printed.as_str()), (Some(1), ""), "{said}");
        let last = "no drive answers that a configuration could begin with: nothing is written";
        assert!(said.trim_end().ends_with(last) && !config.exists(), "{said}");

        let arguments =
            ["simulate", "sercos-drive", "--interface", "sercos0", "--slaves", "3", "--address", "7"];
        let mut line = in_namespace(&drives, &arguments);
        line.args(["--linear", "8", "--seconds", "90"]).stderr(Stdio::inherit());
        let mut line = Running::start("simulate sercos-drive", &mut line);

        let (status, found, said) = output(&["scan", "--interface", "sercos0"]);
        assert_eq!(status, Some(0), "{found}{said}");
        for line in [
            "# axisbridge scan of sercos0: 3 slaves, line on port 1",
            "# 2, address 8: Simulated drive (AXB-SIM-1)",
            "#   vendor                 Axisbridge (code 0)",
            "#                          0x0003 Position control, feedback 1",
            "#   serial number          00000009",
        ] {
            assert!(found.lines().any(|there| there == line), "no {line:?} in {found}");
        }
        let (status, printed, said) = output(&init);
        assert_eq!(status, Some(0), "{printed}{said}");
        assert!(printed.starts_with(&format!("{path}: 3 axes, ")), "{printed}");
        let starter = std::fs::read_to_string(&config).expect("init writes the file");
        assert_eq!(starter, found, "init writes what scan prints");

        // Where the axis ends no bus knows: its limits are asked for, each line to be edited is named, and nothing else.
        let marks =
            starter.lines().filter(|line| !line.starts_with('#') && line.contains("# CHANGE")).count();
        let (status, found, said) = output(&["check", "--config", path]);
        assert_eq!(status, Some(1), "{found}{said}");
        assert!(found.contains("warning[AX0082]: the linear axis `axis-8`"), "{found}");
        assert_eq!(found.matches("warning[AX0090]").count(), marks, "{found}");
        assert!(found.contains(&format!("\n0 errors, {} warnings", marks + 1)), "{found}");
        let (status, found, said) = output(&["scan", "--config", path]);
        assert_eq!(status, Some(0), "{found}{said}");
        assert!(!found.contains("# !"), "the bus is the one of the configuration: {found}");

        // Nobody promises the tests a host that keeps time.
        let patient =
            starter.replace("cycle_time = \"2 ms\"", "cycle_time = \"2 ms\"\nallowed_losses = 1000");
        std::fs::write(&config, patient).expect("the scratch folder can be written");
        let log = scratch(&format!("{name}.log"));
        let mut run = in_namespace(&gateway, &["run", "--config", path]);
        run.env("NO_COLOR", "1").stderr(std::fs::File::create(&log).expect("the log can be written"));
        let mut run = Running::start("run", &mut run);
        wait_for(&log, "CP4", &mut run);
        assert_eq!(run.terminate(Duration::from_secs(10)).code(), Some(0), "{}", text(&log));
        line.terminate(Duration::from_secs(10));
    });
}

/// The wire of a bus in operation carries other frames too (NRT), and the bus does not notice.
#[test]
fn other_traffic_crosses_the_cable_of_a_running_bus() {
    let name = "other_traffic_crosses_the_cable_of_a_running_bus";
    if !peer::namespaces_or_skip(name) {
        return;
    }
    let _bus = a_bus();
    in_real_time(name, || {
        let mut bus = Bus::start(name, 1, 2, 4, Shape::Line);
        bus.gateway.add_address("sercos0", "192.0.2.1/24");
        bus.segments[0].add_address("in", "192.0.2.2/24");
        bus.wait_for("CP4");
        let mut controller = bus.controller(2, 3);
        bus.wait_for("-> Running");
        let own = std::env::current_exe().expect("own path");
        let talker = |namespace: &Namespace, role: &str| {
            let mut command = namespace.command(own.to_str().expect("UTF-8"));
            command
                .args(["--exact", "sercos::talker", "--nocapture"])
                .env(TALKER, role)
                .stdout(Stdio::null());
            Running::start("talker", &mut command)
        };
        let echo = talker(&bus.segments[0], "echo");
        let mut asking = talker(&bus.gateway, "ask");
        assert!(asking.wait(Duration::from_secs(30)).success(), "every datagram came back");
        drop(echo);
        let status = controller.wait(Duration::from_secs(60));
        let log = text(&bus.log);
        assert!(status.success(), "the controller moved both axes: {status}\n{log}");
        assert!(!log.contains("lost"), "no slave was lost: {log}");
        bus.end();
    });
}

/// Not a test of its own: the two ends of the other traffic in the test above, as its role says. It ends well once a
/// hundred datagrams of 1400 bytes have come back whole.
#[test]
fn talker() {
    let Ok(role) = std::env::var(TALKER) else { return };
    let echoes = role == "echo";
    let socket =
        UdpSocket::bind(if echoes { "192.0.2.2:5000" } else { "192.0.2.1:5000" }).expect("an address");
    let mut buffer = [0; 2048];
    if echoes {
        loop {
            let (length, from) = socket.recv_from(&mut buffer).expect("a datagram");
            socket.send_to(&buffer[..length], from).expect("it can be sent back");
        }
    }
    socket.set_read_timeout(Some(Duration::from_millis(500))).expect("a time-out");
    for number in 0..100 {
        let datagram = [number; 1400];
        // The other end may not be there yet, and UDP may lose one: it is sent again.
        let came_back = (0..20).any(|_| {
            socket.send_to(&datagram, "192.0.2.2:5000").is_ok()
                && socket.recv_from(&mut buffer).is_ok_and(|(length, _)| buffer[..length] == datagram)
        });
        assert!(came_back, "datagram {number}");
        std::thread::sleep(Duration::from_millis(10));
    }
}
