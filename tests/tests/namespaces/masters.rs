//! One master a wire: on one host by the lock of the interface, between hosts by listening.

use std::process::Stdio;
use std::time::{Duration, Instant};

use axisbridge::sys::packet_socket::{ETHER_TYPE_SERCOS, PacketSocket};
use axisbridge_tests::host::in_real_time;
use axisbridge_tests::namespace::{Namespace, cable};
use axisbridge_tests::peer;
use axisbridge_tests::process::Running;
use profile_sercos::wire::header::{Channel, Header, Kind, Phase, PhaseField, TelegramType};

use super::{a_bus, configuration, in_namespace, scratch, start_box, wait_for};

/// Set for the copy of this test binary that replays telegrams at the other end of the cable.
const REPLAYS: &str = "AXISBRIDGE_TEST_REPLAY";

fn text(name: &str) -> String {
    std::fs::read_to_string(scratch(&format!("{name}.log"))).unwrap_or_default()
}

#[test]
fn a_second_master_on_an_interface_is_refused_and_told_who_has_it() {
    let name = "a_second_master_on_an_interface_is_refused_and_told_who_has_it";
    if !peer::namespaces_or_skip(name) {
        return;
    }
    let _bus = a_bus();
    in_real_time(name, || {
        let (gateway, drives) = (Namespace::new("box"), Namespace::new("drv"));
        cable((&gateway, "sercos0", None), (&drives, "sercos0", None));
        gateway.add_address("lo", "192.168.10.20/32");
        let simulate =
            ["simulate", "sercos-drive", "--interface", "sercos0", "--slaves", "2", "--linear", "2"];
        let mut line = in_namespace(&drives, &simulate);
        let mut line =
            Running::start("simulate sercos-drive", line.args(["--seconds", "60"]).stderr(Stdio::null()));
        let (mut first, log) = start_box(&gateway, "masters-first");
        wait_for(&log, "CP4", &mut first);

        let config = configuration("masters-second.toml");
        let config = config.to_str().expect("a path in UTF-8");
        let alone = ["param", "read", "turntable", "S-0-0104", "--alone", "--config", config];
        for second in [&["run", "--config", config][..], &["scan", "--interface", "sercos0"], &alone] {
            let begin = Instant::now();
            let output = in_namespace(&gateway, second).output().expect("it can be started");
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(1), "{second:?}: {said}");
            assert!(begin.elapsed() < Duration::from_secs(10), "at once");
            let expected = format!("`sercos0` has a master already: process {} (`axisbridge run", first.id());
            assert!(said.contains(&expected), "expected {expected:?}, got {said}");
            let is_alone = second.contains(&"--alone");
            assert_eq!(said.contains("leave out --alone"), is_alone, "what to do: {said}");
        }
        assert!(first.ended().is_none());
        let text = text("masters-first");
        assert!(!text.contains("lost") && !text.contains("south_silence"), "{text}");
        assert_eq!(first.terminate(Duration::from_secs(10)).code(), Some(0));
        let output = in_namespace(&gateway, &alone).output().expect("it can be started");
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(said.starts_with("S-0-0104 Position loop Kv-factor\n  value      "), "{said}");
        // Whoever comes after it may have the interface.
        let output = in_namespace(&gateway, &["scan", "--interface", "sercos0"]).output().expect("a scan");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        line.terminate(Duration::from_secs(10));
    });
}

#[test]
fn telegrams_of_another_master_keep_the_box_silent_until_they_end() {
    let name = "telegrams_of_another_master_keep_the_box_silent_until_they_end";
    if !peer::namespaces_or_skip(name) {
        return;
    }
    let _bus = a_bus();
    in_real_time(name, || {
        let (gateway, other) = (Namespace::new("box"), Namespace::new("oth"));
        cable((&gateway, "sercos0", None), (&other, "sercos0", None));
        gateway.add_address("lo", "192.168.10.20/32");
        let own = std::env::current_exe().expect("own path");
        let mut replay = other.command(own.to_str().expect("UTF-8"));
        replay.args(["--exact", "masters::replays", "--nocapture"]).env(REPLAYS, "4");
        let mut replay = Running::start("replay", replay.stdout(Stdio::null()));
        std::thread::sleep(Duration::from_millis(500));
        let (mut run, log) = start_box(&gateway, "masters-replay");
        wait_for(&log, "another master sends on this wire: CP4 from 02:00:00:00:00:77", &mut run);
        // It counts the telegrams that it hears, and has heard none but those of the other end.
        let status = replay.wait(Duration::from_secs(60));
        assert!(status.success(), "the box was silent: {status}\n{}", text("masters-replay"));
        // Nobody is there, which is found out after the wire is silent.
        wait_for(&log, "no slave answers", &mut run);
        assert_eq!(text("masters-replay").matches("another master sends on this wire").count(), 1);
        assert_eq!(run.terminate(Duration::from_secs(10)).code(), Some(0));
    });
}

/// Not a test of its own: the other end of the cable in the test above. It sends the MST of a network in CP4 every two milliseconds for
/// so many seconds, and ends well if nobody else has sent anything meanwhile.
#[test]
fn replays() {
    let Some(seconds) = std::env::var(REPLAYS).ok().and_then(|text| text.parse().ok()) else { return };
    let socket = PacketSocket::open("sercos0", ETHER_TYPE_SERCOS).expect("the end of the cable");
    let end = Instant::now() + Duration::from_secs(seconds);
    let mut buffer = [0; 1518];
    let mut count = 0;
    while Instant::now() < end {
        count = (count + 1) % 8;
        let mut frame = [0; 60];
        let telegram = TelegramType::new(Channel::Primary, Kind::Mdt, 0);
        let phase = PhaseField::new(false, count, Phase::CP4);
        let header = Header { source: [2, 0, 0, 0, 0, 0x77], telegram, phase };
        header.emit(&mut frame).expect("the header has room");
        let _ = socket.send(&frame);
        std::thread::sleep(Duration::from_millis(2));
        let heard = socket.recv(&mut buffer).expect("the link is up").map(|frame| frame.len);
        assert_eq!(heard, None, "the box has sent {:02x?}", &buffer[..20]);
    }
}
