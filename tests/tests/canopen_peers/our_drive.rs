//! Our simulated drive under foreign masters.

use axisbridge::sys::can_socket::{CanSocket, Content, Options};
use profile_generic::can::{Frame, Id};

use super::*;

/// Starts our drive as a user does, and waits for its boot-up message.
fn drive(binary: &Path, arguments: &[&str]) -> Peer {
    let mut bus = CanSocket::open(INTERFACE, &Options::default()).unwrap();
    let mut command = Command::new(binary);
    command.args(["simulate", "can-drive", "--interface", INTERFACE]).args(arguments);
    let drive = Peer::command("axisbridge", command);
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
    let mut drive = drive(&binary, &["--node", "5"]);
    let said = Peer::script(&python, "canopen_master.py", &[INTERFACE, "5", "--period", "0.02"]).succeeds();
    has_lines(&said, &["type 00020192", "missing 06020000", "state 27", "error 7305", "cleared 40"]);
    has_lines(&said, &["name Axisbridge simulated CiA 402 drive"]);
    assert!(drive.running.terminate(Duration::from_secs(5)).success(), "{}", drive.said());
}
