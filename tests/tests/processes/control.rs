//! `axisbridge control`: requests as arguments and typed, and a jog by the keys of a terminal.

use std::io::Write as _;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use axisbridge_tests::host::in_real_time;
use axisbridge_tests::peer;
use axisbridge_tests::process::axisbridge;
use serde_json::Value;

use super::local::{Gateway, value};

const TYPED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/typed.py");

const JOG: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/jog.py");

fn control(gateway: &Gateway, words: &[&str], typed: &str) -> Output {
    let mut command = Command::new(axisbridge());
    command.args(["control", "--local"]).arg(&gateway.socket).args(words);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the command can be started");
    let mut input = child.stdin.take().expect("a pipe");
    input.write_all(typed.as_bytes()).expect("it reads its input");
    drop(input);
    child.wait_with_output().expect("it ends")
}

fn lines(output: &Output) -> Vec<String> {
    String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect()
}

/// Without a client, the axis loses its torque where it is.
fn let_go(gateway: &Gateway) -> f64 {
    let reply =
        gateway.connect().until("status turntable", "ok status turntable state=inhibited owner=nobody");
    value(&reply, "position=")
}

#[test]
fn requests_are_carried_out_one_after_the_other_up_to_the_first_error() {
    let name = "requests_are_carried_out_one_after_the_other_up_to_the_first_error";
    in_real_time(name, || {
        let mut gateway = Gateway::start("control", "127.0.0.93");
        gateway.connect().until("status turntable", "ok status turntable state=inhibited ");
        let words =
            ["enable turntable", "move turntable 0.25 velocity=2 acceleration=20", "status turntable"];
        let output = control(&gateway, &words, "");
        let found = lines(&output);
        assert_eq!((output.status.code(), found.len()), (Some(0), 3), "{output:?}");
        assert!(found[0].starts_with("ok enable turntable state=operating owner=local "), "{found:?}");
        assert!((value(&found[2], "position=") - 0.25).abs() < 0.002, "{found:?}");
        assert!((let_go(&gateway) - 0.25).abs() < 0.01);

        // What comes after an error is not done.
        let output = control(&gateway, &["enable nothing", "enable turntable"], "");
        let found = lines(&output);
        assert_eq!((output.status.code(), found.len()), (Some(1), 1), "{output:?}");
        assert!(found[0].starts_with("error enable "), "{found:?}");
        let_go(&gateway);

        // Lines of a pipe are the same; comments are not sent.
        let typed = "# there and back\nenable turntable\n\nmove turntable 0 velocity=2 acceleration=20\nnonsense\nbox\n";
        let output = control(&gateway, &[], typed);
        let found = lines(&output);
        assert_eq!((output.status.code(), found.len()), (Some(1), 3), "{output:?}");
        assert!(
            found[1].starts_with("ok move turntable ") && found[2].starts_with("error nonsense "),
            "{found:?}"
        );
        assert!(let_go(&gateway).abs() < 0.01);

        let output = control(&gateway, &["--jog", "turntable", "--velocity", "1"], "");
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!((output.status.code(), error.contains("need a terminal")), (Some(1), true), "{error}");
        assert!(gateway.run.terminate(Duration::from_secs(30)).success(), "{}", gateway.log());
    });
}

#[test]
fn axis_moves_while_a_key_is_held_and_no_longer() {
    let name = "axis_moves_while_a_key_is_held_and_no_longer";
    let Some(python) = peer::python_or_skip(name, "pty") else { return };
    in_real_time(name, || {
        let mut gateway = Gateway::start("control-jog", "127.0.0.92");
        gateway.connect().until("status turntable", "ok status turntable state=inhibited ");
        let jog = |key: &str, more: &[&str]| -> Value {
            let mut command = Command::new(&python);
            command
                .arg(JOG)
                .arg(axisbridge())
                .arg(&gateway.socket)
                .args(["turntable", "1", key, "1.5"])
                .args(more);
            let output = command.output().expect("Python starts");
            serde_json::from_slice(&output.stdout)
                .unwrap_or_else(|error| panic!("{error}: {output:?}\n{}", gateway.log()))
        };
        for (key, sign) in [("right", 1.0), ("left", -1.0)] {
            let found = jog(key, &[]);
            let at = |name: &str| found[name].as_f64().expect("a number");
            assert_eq!(found["status"], 0, "{found}");
            let way = (at("released") - at("first")) * sign;
            assert!((1.0..2.0).contains(&way), "1.5 s at 1 rev/s: {found}");
            assert!((at("speed") * sign - 1.0).abs() < 0.2, "{found}");
            // What is left of the last jog, and the braking.
            assert!((at("stopped") - at("released")) * sign < 1.0, "{found}");
            assert!((at("last") - at("stopped")).abs() < 0.001, "it stands: {found}");
            let_go(&gateway);
        }
        // The terminal is closed while the key is held.
        let found = jog("right", &["hang-up"]);
        assert_ne!(found["status"], 0, "{found}");
        let first = let_go(&gateway);
        std::thread::sleep(Duration::from_millis(300));
        assert!((let_go(&gateway) - first).abs() < 0.02);

        // Orders that are typed do not wait for each other.
        let mut command = Command::new(&python);
        command.arg(TYPED).arg(axisbridge()).arg(&gateway.socket);
        let output = command.output().expect("Python starts");
        let found: Value = serde_json::from_slice(&output.stdout)
            .unwrap_or_else(|error| panic!("{error}: {output:?}\n{}", gateway.log()));
        let shown = found["shown"].as_str().expect("a text");
        assert_eq!(found["status"], 1, "a move that was replaced is an error: {found}");
        let [replaced, stopped] =
            ["error move turntable replaced", "ok stop turntable "].map(|text| shown.find(text));
        assert!(replaced.is_some() && stopped > replaced, "{shown}");
        let_go(&gateway);
        assert!(gateway.run.terminate(Duration::from_secs(30)).success(), "{}", gateway.log());
    });
}
