//! `translate` and `snapshot` as a user runs them, and against what the running box sent.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use axisbridge_tests::host::in_real_time;
use axisbridge_tests::process::axisbridge;

/// Address of this test alone.
const LISTEN: &str = "127.0.0.36";

fn run(arguments: &[&str]) -> Output {
    Command::new(axisbridge()).args(arguments).output().expect("axisbridge can be started")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A folder of this test alone, empty.
fn folder(name: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).expect("the folder of the tests can be written to");
    path
}

fn path(path: &Path) -> &str {
    path.to_str().expect("a path in UTF-8")
}

/// What the tables make of a frame for each drive, as `drive: bytes`: the MDT values of one, the first RPDO of another, and the
/// poll of a third, without its count of updates and the handshake, which lasts longer than an update asks for it.
fn told(node: &serde_json::Value, found: &mut Vec<String>) {
    let line = node["text"].as_str().unwrap_or_default();
    if let Some((drive, rest)) = line.strip_prefix("MDT of ").and_then(|line| line.split_once(", connection"))
    {
        found.push(format!("{drive}: {}", rest.split_once("bytes: ").expect("bytes").1));
    } else if let Some((drive, rest)) =
        line.strip_prefix("PDOs of ").and_then(|line| line.split_once(": RPDO1 "))
    {
        let bytes = rest.split_once(") ").and_then(|(_, rest)| rest.split(',').next());
        found.push(format!("{drive}: {}", bytes.expect("bytes")));
    } else if let Some(bytes) = line.strip_prefix("RPDO1 (202): ") {
        found.push(format!("drive-b: {bytes}"));
    }
    if let Some((drive, rest)) =
        line.strip_prefix("poll of ").and_then(|line| line.split_once(", 16 bytes: "))
    {
        let bytes: Vec<&str> = rest.split(' ').collect();
        let [head, mode, values] = [&bytes[..2], &bytes[3..6], &bytes[7..]];
        found.push(format!("{drive}: {}", [head, mode, values].concat().join(" ")));
    }
    for child in node["children"].as_array().into_iter().flatten() {
        told(child, found);
    }
}

/// One test of this file at a time: a demonstration in real time cannot stand others that compute on every processor.
fn alone() -> std::sync::MutexGuard<'static, ()> {
    static ALONE: std::sync::Mutex<()> = std::sync::Mutex::new(());
    ALONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// What the tables make of the updates in the recording of a demonstration is what the box sent to the drives.
#[test]
fn translated_updates_are_what_the_box_sent() {
    let _alone = alone();
    in_real_time("translated_updates_are_what_the_box_sent", || {
        let capture = folder("translate-demo").join("demo.pcapng");
        let drives = "sercos,can,devicenet";
        let demo = run(&[
            "demo",
            "--seconds",
            "1",
            "--listen",
            LISTEN,
            "--drives",
            drives,
            "--capture",
            path(&capture),
        ]);
        assert!(demo.status.success(), "{}", text(&demo.stderr));
        let output = run(&["translate", path(&capture), "--drives", drives, "--json"]);
        assert_eq!((output.status.code(), text(&output.stderr).as_str()), (Some(0), ""));
        let result: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        let (mut wanted, mut sent) = (HashSet::new(), Vec::new());
        for frame in result["frames"].as_array().expect("frames") {
            let kind = frame["children"][0]["text"].as_str().expect("what it is");
            let mut lines = Vec::new();
            told(frame, &mut lines);
            if kind.starts_with("C-to-D") {
                wanted.extend(lines);
            } else {
                // Led, by the first word: S-0-0134 and the controlword. A poll is of a drive that is led, or asks for nothing.
                let led = |line: &String| {
                    ["drive-a: 00 e0", "drive-b: 0f 00", "drive-c: "]
                        .iter()
                        .any(|head| line.starts_with(head))
                };
                sent.extend(lines.into_iter().filter(led));
            }
        }
        for drive in ["drive-a", "drive-b", "drive-c"] {
            let of_drive: Vec<_> = sent.iter().filter(|line| line.contains(drive)).collect();
            assert!(of_drive.len() > 100, "{drive} was led: {}", of_drive.len());
            // At the end of the motion the axes stand, and the last command is the last update's.
            let last = of_drive.last().expect("one");
            assert!(wanted.contains(*last), "{last}");
            let distinct: HashSet<_> = of_drive.iter().filter(|line| wanted.contains(**line)).collect();
            assert!(
                distinct.len() > 1,
                "{drive} is told what updates say on its way as well: {}",
                distinct.len()
            );
        }
    });
}

#[test]
fn a_frame_by_hand_names_the_rows() {
    let _alone = alone();
    let update = "06 02 07 05 01 00 00 00 01 00 05 03 03 00 00 00 01 00 00 00 01 00 00 04 90 d0 03 00";
    let output = run(&["translate", "--hex", update]);
    let found = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{found}{}", text(&output.stderr));
    assert!(found.contains("Command Position 250000 (DINT) -> position_command 0.250000000 rev"), "{found}");
    assert!(found.contains("MDT of drive-a, connection 0, 22 bytes: 00 e0 a0 bb 0d 00"), "{found}");
    assert!(
        found.contains("generic-sercos.toml:") && found.contains("[[signal]] position_command"),
        "{found}"
    );
    let output = run(&["translate", "--hex", "06 0"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("--hex:1:4: expected pairs of hexadecimal digits, got `0`"));
    let output = run(&["translate", "--hex", "06 02"]);
    assert_eq!(output.status.code(), Some(1), "a frame that is none fails");
    assert_eq!(run(&["translate"]).status.code(), Some(2));
}

/// What is wrong beyond the last line that is asked for does not count.
#[test]
fn lines_beyond_the_count_are_not_translated() {
    let _alone = alone();
    let list = folder("translate-count").join("frames.hex");
    let update = "06 02 07 05 01 00 00 00 01 00 05 03 03 00 00 00 01 00 00 00 01 00 00 04 90 d0 03 00";
    std::fs::write(&list, format!("{update}\n06 02 07\n")).expect("a file");
    let status = |count: &str| run(&["translate", path(&list), "--count", count]).status.code();
    assert_eq!((status("1"), status("2")), (Some(0), Some(1)));
}

#[test]
fn golden_texts_are_made_compared_and_accepted() {
    let _alone = alone();
    let frames = folder("snapshot-frames");
    let list = frames.join("moves.hex");
    std::fs::write(&list, "at drive-a 08c0 40420f00 00000000 0000 # one turn\n").expect("a file");
    let snapshot = |more: &[&str]| {
        let output = run(&[&["snapshot", path(&frames)], more].concat());
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let (code, out, _) = snapshot(&[]);
    assert!(code == Some(1) && out.contains("0 the same, 0 differ, 1 new, 0 without frames"), "{out}");
    assert!(!frames.join("moves.golden").exists(), "nothing is written unasked");
    assert_eq!(snapshot(&["--accept"]).0, Some(0));
    let golden = std::fs::read_to_string(frames.join("moves.golden")).expect("the golden text");
    assert!(
        golden.starts_with("line 1: one turn\n") && golden.contains("[[signal]] position_actual"),
        "{golden}"
    );
    let (code, out, errors) = snapshot(&[]);
    assert_eq!((code, errors.as_str()), (Some(0), ""), "{out}");

    std::fs::write(frames.join("moves.golden"), golden.replace("1000000", "1000001")).expect("a file");
    let (code, out, _) = snapshot(&[]);
    assert_eq!(code, Some(1));
    let difference: Vec<_> = out.lines().filter(|line| line.contains("S-0-0051")).collect();
    assert!(difference[0].starts_with("-    S-0-0051") || difference[0].starts_with('-'), "{out}");
    assert!(difference[0].contains("1000001") && difference[1].contains("1000000"), "{out}");

    std::fs::remove_file(&list).expect("it is there");
    std::fs::write(frames.join("other.hex"), "# nothing\n").expect("a file");
    let (code, out, _) = snapshot(&["--accept"]);
    assert!(code == Some(0) && out.contains("moves.golden: it has no frames any more"), "{out}");
    assert!(!frames.join("moves.golden").exists());

    std::fs::write(frames.join("other.hex"), "at\n").expect("a file");
    let (code, _, errors) = snapshot(&[]);
    assert_eq!(code, Some(1));
    assert!(errors.contains("other.hex:1:3: expected the name of a drive"), "{errors}");
    let empty = folder("snapshot-empty");
    let output = run(&["snapshot", path(&empty)]);
    assert!(text(&output.stderr).contains("expected files *.hex, *.pcap, *.pcapng or *.toml, found none"));
}

/// Whatever the shipped tables make of some two thousand frames is what they made of them before.
#[test]
fn the_golden_texts_of_the_shipped_tables_stand() {
    let _alone = alone();
    let frames = concat!(env!("CARGO_MANIFEST_DIR"), "/frames");
    let output = run(&["snapshot", frames]);
    assert_eq!(output.status.code(), Some(0), "{}{}", text(&output.stdout), text(&output.stderr));
}

/// The folder that a machine builder would keep: its commands run from a copy with the built program alone, and a change of a table is
/// refused.
#[test]
fn the_commands_of_the_example_for_ci_run() {
    let _alone = alone();
    let copy = folder("example-ci");
    copy_folder(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/ci")), &copy);
    let program = axisbridge();
    let programs = program.parent().expect("a folder");
    let ci = || {
        let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap_or_default());
        let output = Command::new("sh").arg(copy.join("ci.sh")).env("PATH", path).output().expect("a shell");
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let (code, out, errors) = ci();
    assert_eq!(code, Some(0), "{out}{errors}");
    let report = std::fs::read_to_string(copy.join("target/frames.xml")).expect("the report");
    assert!(report.contains("<testsuites tests=\"2\" failures=\"0\">"), "{report}");
    let values = std::fs::read_to_string(copy.join("target/first-move.ndjson")).expect("the values");
    let values: Vec<serde_json::Value> =
        values.lines().map(|line| serde_json::from_str(line).expect("one object a line")).collect();
    let commanded = values.iter().find(|value| {
        value["signal"] == "position_command"
            && value["direction"] == "to-drive"
            && value["axis"] == "turntable"
    });
    let commanded = commanded.expect("a command");
    assert_eq!((&commanded["unit"], &commanded["raw"]["in"]), (&"rev".into(), &"MDT".into()));
    assert_eq!(
        (&commanded["raw"]["offset"], &commanded["row"]["file"]),
        (&2.into(), &"generic-sercos.toml".into())
    );
    assert!(commanded["row"]["line"].as_u64().is_some_and(|line| line > 0), "{commanded}");
    let last = values.last().expect("a last line");
    assert_eq!(
        (&last["record"], &last["translated"], &last["failed"]),
        (&"end".into(), &40.into(), &0.into())
    );

    // Somebody turns a sign.
    let config = copy.join("config.toml");
    let turned = std::fs::read_to_string(&config).expect("a file");
    std::fs::write(&config, turned.replace("motion_resolution = 1_000_000", "motion_resolution = 2_000_000"))
        .expect("a file");
    let (code, out, _) = ci();
    assert_eq!(code, Some(1), "{out}");
    assert!(
        out.contains("generic-sercos.toml:") && out.contains("[[signal]] position_command: now"),
        "{out}"
    );
    let report = std::fs::read_to_string(copy.join("target/frames.xml")).expect("the report");
    assert!(report.contains("failures=\"2\"") && report.contains("<failure message="), "{report}");
}

fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("the folder") {
        let entry = entry.expect("an entry");
        let target = to.join(entry.file_name());
        if entry.file_type().expect("its kind").is_dir() {
            copy_folder(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), &target).expect("a copy");
        }
    }
}

/// Finding T4: with nothing translated the status is 1, and nothing is accepted.
#[test]
fn what_was_not_translated_is_no_success() {
    let _alone = alone();
    let frames = folder("snapshot-nothing");
    let recording = frames.join("other.pcap");
    // pcap with link type 113, and one frame of four bytes.
    let mut file =
        vec![0xD4, 0xC3, 0xB2, 0xA1, 2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF, 0, 0, 113, 0, 0, 0];
    file.extend([[0; 4], [0; 4], [4, 0, 0, 0], [4, 0, 0, 0], [1, 2, 3, 4]].concat());
    std::fs::write(&recording, file).expect("a file");
    let output = run(&["translate", path(&recording)]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        text(&output.stderr).ends_with("1 of 1 frames could not be translated\n"),
        "{}",
        text(&output.stderr)
    );
    let output = run(&["snapshot", path(&frames), "--accept"]);
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stdout));
    assert!(
        text(&output.stderr).contains("other.pcap: not accepted: 1 of 1 frames"),
        "{}",
        text(&output.stderr)
    );
    assert!(!recording.with_extension("golden").exists());
}
