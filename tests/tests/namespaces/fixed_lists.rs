//! SERCOS drives of class SCP_FixCFG at a box, each a process behind a cable: driven by the values that their lists have, in their order,
//! or refused by name. Somebody else's slave (`peer-sercos-slave`), and the simulated drive.

use std::process::Stdio;
use std::time::Duration;

use axisbridge_tests::host::in_real_time;
use axisbridge_tests::namespace::{Namespace, cable};
use axisbridge_tests::peer;
use axisbridge_tests::process::Running;

use super::{a_bus, in_namespace, scratch, wait_for};

const CONFIGURATION: &str = r#"
[box]
name = "test"

[[device]]
name = "front"
listen = "127.0.0.2"
axes = ["axis"]
update_period = { min = "4 ms", max = "32 ms" }

[device.identity]
vendor_id = 1
product_code = 1
serial_number = 1

[south.sercos]
interface = "sercos0"
cycle_time = "4 ms"
jitter = "200 us"
allowed_losses = 500

[[south.sercos.drive]]
name = "drive"
address = 1

[[axis]]
name = "axis"
instance = 1
drive = "drive"
unit = "revolution"
motion_resolution = 1_000_000
"#;

/// Enabled without a velocity it stands, and then it turns as fast as it is told.
const SCRIPT: &str = r#"
title = "fixed lists"

[connection]
target = "127.0.0.2"
bind = "127.0.0.1"
update_period = "16 ms"

[axis.1]
counts_per_unit = 1_000_000
mode = "velocity"
motion = { velocity = 0.5, acceleration = 5.0 }

[[step]]
enable = 1
within = "30 s"

[[step]]
dwell = "1 s"

[[step]]
expect = { axis = 1, velocity = 0.0, tolerance = 0.01 }

[[step]]
velocity = { axis = 1, velocity = 0.5 }

[[step]]
dwell = "1 s"

[[step]]
expect = { axis = 1, velocity = 0.5, tolerance = 0.05 }

[[step]]
stop = { axis = 1 }

[[step]]
disable = 1
"#;

/// Whose drive it is.
#[derive(Clone, Copy)]
enum Whose {
    Ours,
    SomebodyElses,
}

/// A box and a drive with these lists; `test` says what happens, and gets the place of what the drive has told too.
fn with_lists(
    name: &str,
    whose: Whose,
    lists: [&str; 2],
    test: impl FnOnce(&Namespace, &mut Running, &std::path::Path),
) -> String {
    let (gateway, drives) = (Namespace::new("box"), Namespace::new("drv"));
    cable((&gateway, "sercos0", None), (&drives, "sercos0", None));
    let mut line = match whose {
        Whose::Ours => {
            let arguments =
                ["simulate", "sercos-drive", "--interface", "sercos0", "--seconds", "90", "--fixed-lists"];
            let mut line = in_namespace(&drives, &arguments);
            line.args(lists);
            line
        }
        Whose::SomebodyElses => {
            let mut line = drives.command(env!("CARGO_BIN_EXE_peer-sercos-slave"));
            line.args(lists).arg("sercos0");
            line
        }
    };
    let told = scratch(&format!("{name}-drive.log"));
    let said = std::fs::File::create(&told).expect("the log can be written");
    let too = said.try_clone().expect("the log can be written");
    let mut line = Running::start("the drive", line.stdin(Stdio::null()).stderr(said).stdout(too));
    let (config, log) = (scratch(&format!("{name}.toml")), scratch(&format!("{name}.log")));
    std::fs::write(&config, CONFIGURATION).expect("the configuration can be written");
    let mut run = in_namespace(&gateway, &["run", "--config", config.to_str().expect("a path in UTF-8")]);
    run.env("NO_COLOR", "1").stderr(std::fs::File::create(&log).expect("the log can be written"));
    let mut run = Running::start("run", &mut run);
    test(&gateway, &mut run, &log);
    assert_eq!(run.terminate(Duration::from_secs(10)).code(), Some(0));
    line.terminate(Duration::from_secs(10));
    std::fs::read_to_string(told).unwrap_or_default()
}

#[test]
fn a_drive_with_fixed_lists_is_driven_by_them_in_their_order() {
    let name = "a_drive_with_fixed_lists_is_driven_by_them_in_their_order";
    if !peer::namespaces_or_skip(name) {
        return;
    }
    let _bus = a_bus();
    in_real_time(name, || {
        // The velocity before the control word, and the status word in the middle.
        let lists = ["S-0-0036,S-0-0134", "S-0-0051,S-0-0135,S-0-0040"];
        let drive = with_lists(name, Whose::SomebodyElses, lists, |gateway, run, log| {
            wait_for(log, "CP4", run);
            let script = scratch(&format!("{name}-script.toml"));
            std::fs::write(&script, SCRIPT).expect("the script can be written");
            let arguments = ["simulate", "controller", "--script", script.to_str().expect("a path in UTF-8")];
            let told = scratch(&format!("{name}-controller.log"));
            let mut controller = in_namespace(gateway, &arguments);
            controller.stdout(std::fs::File::create(&told).expect("the log can be written"));
            let mut controller = Running::start("simulate controller", &mut controller);
            let status = controller.wait(Duration::from_secs(90));
            let read = |path| std::fs::read_to_string(path).unwrap_or_default();
            assert!(status.success(), "{status}\n{}\n{}", read(&told), read(&log.to_path_buf()));
        });
        // It says itself that it was standing with torque, and then turned as it was told.
        let velocity = |torque| {
            let lines = drive.lines().filter(move |line| line.ends_with(torque));
            lines.filter_map(|line| line.split(' ').nth(1)?.parse::<f64>().ok())
        };
        let fastest = velocity("torque on").fold(0.0_f64, f64::max);
        assert!((fastest - 0.5).abs() < 0.01, "{fastest}: {drive}");
        assert!(velocity("torque on").any(|velocity| velocity == 0.0), "{drive}");
        assert!(velocity("torque off").all(|velocity| velocity == 0.0), "{drive}");
    });
}

#[test]
fn a_drive_whose_fixed_lists_do_not_serve_is_refused_by_name() {
    let name = "a_drive_whose_fixed_lists_do_not_serve_is_refused_by_name";
    if !peer::namespaces_or_skip(name) {
        return;
    }
    let _bus = a_bus();
    for whose in [Whose::Ours, Whose::SomebodyElses] {
        in_real_time(name, || {
            // A torque command that no mode of the axis has a value for would be sent as zero.
            let lists = ["S-0-0134,S-0-0036,S-0-0092", "S-0-0135,S-0-0051,S-0-0040"];
            let torque = ["S-0-0134,S-0-0036,S-0-0037", "S-0-0135,S-0-0051,S-0-0040"];
            let (lists, unfilled) = match whose {
                Whose::Ours => (lists, "S-0-0092"),
                Whose::SomebodyElses => (torque, "S-0-0037"),
            };
            let drive = with_lists(name, whose, lists, |_, run, log| {
                wait_for(
                    log,
                    &format!("has {unfilled}, for which none of the modes of this drive has a value"),
                    run,
                );
                wait_for(log, "it is left out", run);
                let text = std::fs::read_to_string(log).expect("the box has a log");
                assert!(!text.contains("CP3"), "nothing is laid out for it: {text}");
            });
            assert!(!drive.contains("torque on"), "{drive}");
        });
    }
}
