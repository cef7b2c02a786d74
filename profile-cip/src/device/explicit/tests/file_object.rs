//! The File object: a client uploads the electronic data sheet, and what it gets when it does so wrongly.

use std::sync::Arc;

use profile_generic::time::DurationNs;

use super::rig::*;
use crate::device::objects::file::{INITIATE_UPLOAD, UPLOAD_TIMEOUT, UPLOAD_TRANSFER};
use crate::wire::forward_open::ForwardOpen;
use crate::wire::status::Service;

const CLASS: &[u8] = &[0x20, 0x37, 0x24, 0];
const FILE: &[u8] = &[0x20, 0x37, 0x24, 0xC8];

/// A file of so many bytes, no two neighbouring blocks alike.
fn sheet(len: usize) -> Vec<u8> {
    (0..len).map(|at| u8::try_from((at * 7 + at / 251) % 256).unwrap()).collect()
}

fn rig(file: &[u8]) -> (Rig, Client) {
    let mut rig = Rig::with(|config| config.eds = Arc::from(file));
    let client = rig.client(1);
    (rig, client)
}

fn initiate(rig: &mut Rig, client: Client, longest: u8) -> Answered {
    rig.ask(client, &message(INITIATE_UPLOAD, FILE, &[longest]))
}

fn transfer(rig: &mut Rig, client: Client, number: u8) -> Answered {
    rig.ask(client, &message(UPLOAD_TRANSFER, FILE, &[number]))
}

/// Uploads the file as a client does, and checks packet types and checksum. Returns the file and how many blocks it took.
fn upload(rig: &mut Rig, client: Client, longest: u8) -> (Vec<u8>, usize) {
    let answer = initiate(rig, client, longest);
    assert_eq!((answer.outcome(), answer.data.len()), ((0, 0), 5));
    let len = usize::try_from(u32::from_le_bytes(answer.data[..4].try_into().unwrap())).unwrap();
    let size = usize::from(answer.data[4]);
    assert!(size > 0 && size <= usize::from(longest));
    let (mut file, mut blocks) = (Vec::new(), 0);
    loop {
        let number = u8::try_from(blocks % 256).unwrap();
        let answer = transfer(rig, client, number);
        assert_eq!((answer.service, answer.outcome(), answer.data[0]), (0x4F, (0, 0), number));
        let packet = answer.data[1];
        let first = [0, 4].contains(&packet);
        assert_eq!(first, blocks == 0);
        blocks += 1;
        if [2, 4].contains(&packet) {
            let (data, checksum) = answer.data[2..].split_at(answer.data.len() - 4);
            file.extend_from_slice(data);
            let sum = file.iter().fold(0u16, |sum, byte| sum.wrapping_add(u16::from(*byte)));
            assert_eq!(sum.wrapping_add(u16::from_le_bytes(checksum.try_into().unwrap())), 0);
            break;
        }
        assert_eq!(answer.data.len(), 2 + size, "full blocks up to the last");
        file.extend_from_slice(&answer.data[2..]);
        assert!(file.len() < len);
    }
    assert_eq!(file.len(), len);
    (file, blocks)
}

#[test]
fn a_client_gets_the_whole_file_whatever_its_length() {
    for (len, longest, blocks) in [
        (1, 255, 1),
        (100, 100, 1),
        (101, 100, 2),
        (200, 100, 2),
        (199, 100, 2),
        (5000, 255, 20),
        // Transfer numbers start over behind 255.
        (700, 1, 700),
        (600, 2, 300),
    ] {
        let file = sheet(len);
        let (mut rig, client) = rig(&file);
        assert_eq!(upload(&mut rig, client, longest), (file, blocks), "{len} bytes by {longest}");
    }
}

#[test]
fn attributes_of_file_and_class() {
    let (mut rig, client) = rig(b"[File]\n");
    let string_i =
        |text: &[u8]| [&[1][..], b"eng", &[0xDA, 4, 0, u8::try_from(text.len()).unwrap()], text].concat();
    let attributes: [&[u8]; 11] = [
        &[2],
        &string_i(b"EDS and Icon Files"),
        &[1, 0],
        &string_i(b"EDS.txt"),
        &[2, 3],
        &[7, 0, 0, 0],
        // 0x10000 less the sum of the bytes.
        &(0x1_0000 - b"[File]\n".iter().map(|byte| u32::from(*byte)).sum::<u32>()).to_le_bytes()[..2],
        &[255],
        &[0],
        &[1],
        &[0],
    ];
    for (number, value) in (1..).zip(attributes) {
        let answer = rig.get(client, FILE, number);
        assert_eq!((answer.status, answer.data.as_slice()), (0, value), "attribute {number}");
    }
    assert_eq!(rig.get(client, FILE, 12).outcome(), (0x14, 0));
    let directory = [&[0xC8, 0][..], attributes[1], attributes[3]].concat();
    for (number, value) in
        [(1, &[3, 0][..]), (2, &[0xC8, 0]), (3, &[1, 0]), (6, &[32, 0]), (7, &[11, 0]), (32, &directory)]
    {
        assert_eq!(rig.get(client, CLASS, number).data, value, "class attribute {number}");
    }
    assert_eq!(rig.get(client, &[0x20, 0x37, 0x24, 1], 1).outcome(), (0x05, 0), "there is one file");
    assert_eq!(rig.get(client, &[0x20, 0x37, 0x24, 0xC9], 1).outcome(), (0x05, 0));
}

#[test]
fn the_state_follows_the_upload() {
    let (mut rig, client) = rig(&sheet(3));
    let mut states = Vec::new();
    states.push(rig.get(client, FILE, 1).data[0]);
    initiate(&mut rig, client, 2);
    states.push(rig.get(client, FILE, 1).data[0]);
    transfer(&mut rig, client, 0);
    states.push(rig.get(client, FILE, 1).data[0]);
    transfer(&mut rig, client, 1);
    states.push(rig.get(client, FILE, 1).data[0]);
    assert_eq!(states, [2, 3, 5, 2]);
}

#[test]
fn a_block_whose_reply_was_lost_is_given_again() {
    let file = sheet(5);
    let (mut rig, client) = rig(&file);
    initiate(&mut rig, client, 2);
    for number in 0..3 {
        let once = transfer(&mut rig, client, number);
        assert_eq!(transfer(&mut rig, client, number), once, "block {number}");
        assert_eq!(transfer(&mut rig, client, number), once, "and again");
    }
    // The last one too, until its time is up; then the upload is over.
    rig.pass(UPLOAD_TIMEOUT - DurationNs(1));
    assert_eq!(transfer(&mut rig, client, 2).data[1], 2);
    rig.pass(UPLOAD_TIMEOUT);
    assert_eq!(transfer(&mut rig, client, 2).outcome(), (0x0C, 2));
}

#[test]
fn numbers_out_of_sequence_are_refused_and_the_upload_goes_on() {
    let file = sheet(6);
    let (mut rig, client) = rig(&file);
    initiate(&mut rig, client, 2);
    for number in [1, 2, 255] {
        assert_eq!(transfer(&mut rig, client, number).outcome(), (0x20, 6), "the first is 0, not {number}");
    }
    assert_eq!(transfer(&mut rig, client, 0).data[2..], file[..2]);
    for number in [2, 3, 255] {
        assert_eq!(transfer(&mut rig, client, number).outcome(), (0x20, 6), "behind 0 comes 1, not {number}");
    }
    assert_eq!(transfer(&mut rig, client, 1).data[2..], file[2..4]);
    assert_eq!(transfer(&mut rig, client, 0).outcome(), (0x20, 6), "two back is too far");
    assert_eq!(transfer(&mut rig, client, 2).data[1], 2);
    assert_eq!(transfer(&mut rig, client, 3).outcome(), (0x0C, 2), "behind the last there is none");
}

#[test]
fn uploads_that_were_not_begun_or_were_given_up() {
    let (mut rig, a) = rig(&sheet(10));
    assert_eq!(transfer(&mut rig, a, 0).outcome(), (0x0C, 2));
    initiate(&mut rig, a, 2);
    assert_eq!(rig.adapter.wake_at(), Some(rig.now + UPLOAD_TIMEOUT));
    rig.pass(UPLOAD_TIMEOUT);
    assert_eq!(transfer(&mut rig, a, 0).outcome(), (0x0C, 2), "the client was silent for too long");
    // A client that begins again has given up what it had begun.
    initiate(&mut rig, a, 2);
    transfer(&mut rig, a, 0);
    initiate(&mut rig, a, 4);
    assert_eq!(transfer(&mut rig, a, 1).outcome(), (0x20, 6));
    assert_eq!(transfer(&mut rig, a, 0).data.len(), 6);
    // What one session leaves in the middle keeps nobody else from the file, and ends with it.
    let b = rig.client(2);
    assert_eq!(transfer(&mut rig, b, 1).outcome(), (0x0C, 2));
    assert_eq!(upload(&mut rig, b, 3).0, sheet(10));
    assert_eq!(transfer(&mut rig, a, 1).data.len(), 6);
    rig.adapter.close(a.slot);
    assert_eq!(rig.get(b, FILE, 1).data, [2]);
}

#[test]
fn malformed_requests_and_downloads() {
    let (mut rig, client) = rig(&sheet(10));
    for (service, data, outcome) in [
        (INITIATE_UPLOAD, &[][..], (0x13, 0)),
        (INITIATE_UPLOAD, &[1, 2], (0x15, 0)),
        (INITIATE_UPLOAD, &[0], (0x20, 8)),
        (UPLOAD_TRANSFER, &[], (0x13, 0)),
        (UPLOAD_TRANSFER, &[0, 0], (0x15, 0)),
        // Download, partial read and write, download transfer, clear: the file is read only.
        (Service(0x4C), &[9, 0, 0, 0, 1, 0, 1, 1, 0], (0x08, 0)),
        (Service(0x4D), &[0, 0, 0, 0, 1, 0, 0, 0, 255], (0x08, 0)),
        (Service(0x4E), &[], (0x08, 0)),
        (Service(0x50), &[0, 0], (0x08, 0)),
        (Service(0x51), &[], (0x08, 0)),
        (Service(0x09), &[], (0x08, 0)),
        (Service::GET_ATTRIBUTES_ALL, &[], (0x08, 0)),
    ] {
        assert_eq!(rig.ask(client, &message(service, FILE, data)).outcome(), outcome, "{service:?} {data:?}");
    }
    let of_class = message(INITIATE_UPLOAD, CLASS, &[100]);
    assert_eq!(rig.ask(client, &of_class).outcome(), (0x08, 0), "the class has no file of its own");
    let set = message(Service::SET_ATTRIBUTE_SINGLE, &[FILE, &[0x30, 4]].concat(), b"x");
    assert_eq!(rig.ask(client, &set).outcome(), (0x0E, 0));
}

#[test]
fn blocks_fit_the_connection_they_are_asked_over() {
    let file = sheet(1000);
    let (mut rig, client) = rig(&file);
    let tiny = ForwardOpen { t_to_o: point_to_point(30), ..explicit_open(1) };
    assert_eq!(rig.ask(client, &open_message(&tiny)).outcome(), (0, 0));
    let id = rig.adapter.node.connections.explicit[0].o_to_t_id;
    rig.send_connected(client, id, 1, &message(INITIATE_UPLOAD, FILE, &[255]));
    let answer = rig.connected_reply(client).2;
    // 30 bytes less sequence count, reply header, number, type and checksum.
    assert_eq!(answer.data[4], 20);
    rig.send_connected(client, id, 2, &message(UPLOAD_TRANSFER, FILE, &[0]));
    assert_eq!(rig.connected_reply(client).2.data[2..], file[..20]);
    // Begun over something larger, a block may not fit; there the upload goes on.
    initiate(&mut rig, client, 255);
    rig.send_connected(client, id, 3, &message(UPLOAD_TRANSFER, FILE, &[0]));
    assert_eq!(rig.connected_reply(client).2.outcome(), (0x11, 0));
    assert_eq!(transfer(&mut rig, client, 0).data.len(), 257);
    // A connection without room for a single byte.
    let none = ForwardOpen { t_to_o: point_to_point(8), ..explicit_open(2) };
    assert_eq!(rig.ask(client, &open_message(&none)).outcome(), (0, 0));
    let id = rig.adapter.node.connections.explicit[1].o_to_t_id;
    rig.send_connected(client, id, 1, &message(INITIATE_UPLOAD, FILE, &[255]));
    assert_eq!(rig.connected_reply(client).2.outcome(), (0x11, 0));
}

#[test]
fn without_a_sheet_there_is_no_file_object() {
    let (mut rig, client) = rig(&[]);
    assert_eq!(initiate(&mut rig, client, 100).outcome(), (0x05, 0));
    assert_eq!(rig.get(client, CLASS, 1).outcome(), (0x05, 0));
}
