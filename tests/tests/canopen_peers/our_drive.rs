//! Our simulated drive under foreign masters.

use axisbridge::sys::can_socket::{CanSocket, Content, Options};
use profile_generic::can::{Frame, Id};

use super::*;
use crate::recording::{Recording, compare_with_tshark};
use axisbridge_tests::peer::tshark_or_skip;

/// Starts our drive as a user does.
fn drive(binary: &Path, arguments: &[&str]) -> Peer {
    let mut command = Command::new(binary);
    command.args(["simulate", "can-drive", "--interface", INTERFACE]).args(arguments);
    Peer::command("axisbridge", command)
}

/// One with a node-id, after its boot-up message.
fn booted(binary: &Path) -> Peer {
    let mut bus = CanSocket::open(INTERFACE, &Options::default()).unwrap();
    let drive = drive(binary, &["--node", &NODE.to_string()]);
    let boot_up = Frame::new(Id::Standard(0x700 + u16::from(NODE)), &[0]).unwrap();
    assert!(bus.wait(Duration::from_secs(30)).unwrap(), "no boot-up message: {}", drive.said());
    let first = bus.recv().unwrap().map(|received| received.content);
    assert_eq!(first, Some(Content::Frame(boot_up)), "{}", drive.said());
    drive
}

#[test]
fn the_two_foreign_peers_understand_each_other() {
    let Some(python) = python_inside("our_drive::the_two_foreign_peers_understand_each_other") else {
        return;
    };
    let mut drive = Peer::start(&python, "canopen_drive.py", &[INTERFACE, "5", "--heartbeat", "100"]);
    let said = Peer::script(&python, "canopen_master.py", &[INTERFACE, "5", "--period", "0.03"]).succeeds();
    has_lines(
        &said,
        &["type 00020192", "modes 3A5", "missing 06020000", "state 27", "error 7305", "cleared 40"],
    );
    drive.says("fault -> switch on disabled");
}

#[test]
fn our_drive_follows_a_foreign_master() {
    let test = "our_drive::our_drive_follows_a_foreign_master";
    let Some((python, binary)) = python_and_binary_inside(test) else { return };
    let mut drive = booted(&binary);
    let said = Peer::script(&python, "canopen_master.py", &[INTERFACE, "5", "--period", "0.02"]).succeeds();
    has_lines(&said, &["type 00020192", "missing 06020000", "state 27", "error 7305", "cleared 40"]);
    has_lines(&said, &["name Axisbridge simulated CiA 402 drive"]);
    assert!(drive.running.terminate(Duration::from_secs(5)).success(), "{}", drive.said());
}

/// Whether tshark saw in the recording what we did, and all that there should be.
fn check_recording(test: &str, path: &Path) {
    if !tshark_or_skip(test) {
        return;
    }
    let kinds = compare_with_tshark(path);
    let all = [
        "EMCY 0000",
        "EMCY 7305",
        "EMCY 7500",
        "EMCY 8130",
        "LSS",
        "NMT enter pre-operational",
        "NMT reset node",
        "NMT start",
        "NMT stop",
        "PDO",
        "SYNC",
        "block segment down",
        "block segment up",
        "heartbeat boot-up",
        "heartbeat operational",
        "heartbeat pre-operational",
        "heartbeat stopped",
        "request abort",
        "request block download",
        "request block download end",
        "request block received",
        "request block upload",
        "request block upload end",
        "request block upload start",
        "request download",
        "request download segment",
        "request upload",
        "request upload segment",
        "response abort",
        "response block download",
        "response block download end",
        "response block received",
        "response block upload",
        "response block upload end",
        "response download",
        "response download segment",
        "response upload",
        "response upload segment",
    ];
    assert_eq!(kinds.keys().collect::<Vec<_>>(), all);
    // Those of 1, 4, 5, 7, 8, 889, 890 and 4096 bytes, none of them sent twice.
    assert_eq!((kinds["block segment down"], kinds["block segment up"]), (847, 847));
}

#[test]
fn our_drive_does_what_a_foreign_library_expects_of_one() {
    let test = "our_drive::our_drive_does_what_a_foreign_library_expects_of_one";
    if !is_inside() {
        let Some(python) = python_outside(test) else { return };
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("canopen-peers");
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("library.pcapng");
        let kernel = kernel(&python).environment(BINARY, axisbridge().as_os_str());
        let kernel = kernel.writable(&folder).environment(RECORDING, path.as_os_str());
        kernel.inside_in_real_time(test);
        check_recording(test, &path);
        return;
    }
    let (python, binary) = (told(PYTHON), told(BINARY));
    let recording = Recording::start(&told(RECORDING));
    let sheet = std::env::temp_dir().join("drive.eds");
    let sheet = sheet.to_str().unwrap();
    // Without a node-id; the library finds it by LSS and reads its objects from the data sheet that it writes.
    let mut drive = drive(&binary, &["--serial", "0", "--eds", sheet]);
    let said = Peer::script(&python, "canopen_remote.py", &[INTERFACE, "5", sheet]).succeeds();
    has_lines(
        &said,
        &[
            "address 7FFFFFFF 192 1 0",
            "type 00020192",
            "name Axisbridge simulated CiA 402 drive",
            // No object, no sub-index, read only, a mode that is none, too short, too long, a mapping in use, no room.
            "refused 06020000 06090011 06010002 06090030 06070013 06070012 06010000 06070012",
            "mapped 6040 607A 6060 60FF 6071 6041 6064 6061 606C 6077",
            "states READY TO SWITCH ON, SWITCHED ON, READY TO SWITCH ON, SWITCH ON DISABLED, OPERATION ENABLED, \
             SWITCHED ON, OPERATION ENABLED, READY TO SWITCH ON",
            "mode refused",
            "error 7305 21 7305 7305 21",
            "after OPERATION ENABLED",
            "silence 8130 7500 08",
        ],
    );
    assert!(drive.running.terminate(Duration::from_secs(5)).success(), "{}", drive.said());
    recording.finish();
}
