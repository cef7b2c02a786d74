//! Drives that misbehave on demand: a script and a person at a process of simulated drives.

use std::process::Stdio;
use std::time::Duration;

use axisbridge_tests::host::in_real_time;
use axisbridge_tests::namespace::{Namespace, cable};
use axisbridge_tests::peer;
use axisbridge_tests::process::Running;

use super::{a_bus, in_namespace, scratch, start_box, wait_for};

#[test]
fn a_drive_waits_for_its_port_and_a_typed_fault_is_one_at_the_gateway() {
    let name = "a_drive_waits_for_its_port_and_a_typed_fault_is_one_at_the_gateway";
    if !peer::namespaces_or_skip(name) {
        return;
    }
    let _bus = a_bus();
    in_real_time(name, || {
        let (gateway, drives) = (Namespace::new("box"), Namespace::new("drv"));
        cable((&gateway, "sercos0", None), (&drives, "sercos0", None));
        gateway.add_address("lo", "192.168.10.20/32");
        drives.set_link("sercos0", false);

        let script = scratch("misbehaviour-events.txt");
        std::fs::write(&script, "delay torque 300 ms\nresolution 2 20000\n")
            .expect("the script can be written");
        let said = scratch("misbehaviour-drives.log");
        let simulate =
            ["simulate", "sercos-drive", "--interface", "sercos0", "--slaves", "2", "--linear", "2"];
        let mut line = in_namespace(&drives, &simulate);
        line.args(["--seconds", "60", "--script", script.to_str().expect("a path in UTF-8")]);
        line.stdin(Stdio::piped()).stderr(std::fs::File::create(&said).expect("the log can be written"));
        let mut line = Running::start("simulate sercos-drive", &mut line);
        wait_for(&said, "waiting for sercos0: link down", &mut line);
        assert!(line.ended().is_none(), "it waits");
        drives.set_link("sercos0", true);
        wait_for(&said, "drive 2: event delay torque 300 ms", &mut line);

        let (mut run, log) = start_box(&gateway, "misbehaviour");
        wait_for(&said, "drive 1: CP4, ready", &mut line);
        line.type_line("falut 1 over_current");
        wait_for(&said, "`falut` is no event", &mut line);
        line.type_line("fault 1 over_current for 200 ms");
        wait_for(&said, "drive 1: event fault over_current for 200 ms", &mut line);
        wait_for(&said, "drive 1: CP4, faulted, fault over_current", &mut line);
        wait_for(&log, "faulted axis=\"turntable\"", &mut run);
        wait_for(&log, "the drive reports 0xC00F0007 \"overcurrent error\" axis=\"turntable\"", &mut run);
        wait_for(&said, "drive 1: event clear over_current", &mut line);
        line.end_input();
        std::thread::sleep(Duration::from_millis(500));
        assert!(line.ended().is_none(), "the end of standard input ends no drive");
        assert_eq!(run.terminate(Duration::from_secs(10)).code(), Some(0));
        assert_eq!(line.terminate(Duration::from_secs(10)).code(), Some(0));
    });
}
