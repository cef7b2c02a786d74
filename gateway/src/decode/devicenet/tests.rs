use proptest::prelude::*;

use super::*;

fn tree(devicenet: &mut Devicenet, id: u16, data: &[u8]) -> String {
    let mut text = Text::default();
    devicenet.frame(&Frame::new(Id::Standard(id), data).unwrap(), &mut text);
    text.as_str().to_owned()
}

fn told(frames: &[(u16, &[u8])]) -> String {
    let mut devicenet = Devicenet::default();
    let told = frames.iter().map(|(id, data)| format!("{id:03X}{}\n", tree(&mut devicenet, *id, data)));
    told.collect()
}

/// A motion drive with MAC ID 5 and a master with MAC ID 1.
#[test]
fn a_motion_drive_is_read_with_what_was_asked_before() {
    insta::assert_snapshot!(told(&[
        // Nothing is known of the connection yet.
        (0x42D, &[0x00, 2, 2, 7, 3, 1, 1, 1]),
        (0x42F, &[0x00, 0x01, 0x00, 5, 0, 0, 0]),
        (0x42F, &[0x80, 0x01, 0x00, 6, 0, 0, 0]),
        (0x42E, &[0x01, 0x4B, 3, 1, 0x03, 1]),
        (0x42B, &[0x01, 0xCB, 0]),
        (0x42C, &[0x41, 0x0E, 1, 1, 2]),
        (0x42B, &[0x41, 0x8E, 0x25, 0]),
        (0x42C, &[0x01, 0x0E, 5, 2, 7]),
        (0x42B, &[0x01, 0x8E, 16, 0]),
        (0x42C, &[0x41, 0x0E, 5, 2, 8]),
        (0x42B, &[0x41, 0x8E, 16, 0]),
        (0x42C, &[0x01, 0x10, 5, 2, 9, 10, 0]),
        (0x42B, &[0x01, 0x90, 10, 0]),
        // Get_Attribute_List of the axis, in two fragments, and the answer.
        (0x42C, &[0x81, 0x00, 3, 0x42, 1, 2, 0, 0x95]),
        (0x42B, &[0x81, 0xC0, 0]),
        (0x42C, &[0x81, 0x81, 0x02, 0x96, 0x02]),
        (0x42B, &[0x81, 0xC1, 0]),
        (0x42B, &[0x81, 0x00, 0x83, 2, 0, 0x95, 2, 0]),
        (0x42C, &[0x81, 0xC0, 0]),
        (0x42B, &[0x81, 0x82, 0, 0, 0x96, 0x02, 0, 0]),
        // Polls, with a fragment that is missing in the answer.
        (0x42D, &[0x00, 2, 2, 7, 3, 1, 1, 1]),
        (0x42D, &[0x41, 0, 1, 1, 0, 0, 0, 0]),
        (0x42D, &[0x82, 0, 4]),
        (0x3C5, &[0x00, 3, 2, 7, 3, 1, 1, 1]),
        (0x3C5, &[0x41, 0, 4, 1, 0, 0, 0, 0]),
        (0x3C5, &[0x82, 4, 0]),
        (0x3C5, &[0x00, 3, 2, 8, 3, 1, 1, 1]),
        (0x3C5, &[0x82, 4, 0]),
        (0x3C5, &[]),
        (0x42D, &[]),
        (0x42E, &[0x01, 0x4C, 3, 1, 3]),
        (0x42B, &[0x01, 0x94, 0x0C, 0x02]),
        (0x42B, &[0x01, 0x94, 0x0C, 0xFF]),
    ]));
}

/// The same bits from a velocity drive, and what belongs to no single drive.
#[test]
fn velocity_drives_and_what_is_rare() {
    insta::assert_snapshot!(told(&[
        (0x44C, &[0x01, 0x0E, 1, 1, 2]),
        (0x44B, &[0x01, 0x8E, 2, 0]),
        (0x44C, &[0x01, 0x0E, 5, 2, 7]),
        (0x44B, &[0x01, 0x8E, 4, 0]),
        (0x44C, &[0x01, 0x0E, 5, 2, 8]),
        (0x44B, &[0x01, 0x8E, 4, 0]),
        (0x44D, &[0x61, 0, 0xDC, 5]),
        (0x3C9, &[0x74, 4, 0xDC, 5]),
        (0x3C9, &[0x74, 4]),
        // A change of state of 2 bytes, and its acknowledge.
        (0x44C, &[0x01, 0x0E, 5, 4, 7]),
        (0x44B, &[0x01, 0x8E, 6, 0]),
        (0x349, &[0x74, 4, 0xDC, 5, 0xF6, 0xFF]),
        (0x44A, &[]),
        (0x450, &[0x20, 0x02, 0, 0, 0, 0, 0, 0x80]),
        (0x450, &[]),
        (0x389, &[7]),
        (0x7BF, &[0x01, 0x4B, 2]),
        (0x7ED, &[1, 2]),
        (0x7F0, &[1]),
        (0x44C, &[]),
        (0x44C, &[0x81]),
        (0x44C, &[0x81, 0x81, 1]),
        (0x44B, &[0x81, 0xC1]),
        (0x44C, &[0x01, 0x8E, 1]),
        (0x44F, &[0, 1]),
    ]));
}

/// Whoever checks its MAC ID has started anew: the sizes of before do not count.
#[test]
fn a_node_that_starts_anew_is_known_anew() {
    let size: [(u16, &[u8]); 2] = [(0x42C, &[0x01, 0x0E, 5, 2, 8]), (0x42B, &[0x01, 0x8E, 4, 0])];
    let poll: (u16, &[u8]) = (0x42D, &[1, 0, 1, 0]);
    let known = told(&[size[0], size[1], poll]);
    assert!(known.ends_with("42D  group 2: poll command, MAC ID 5\n    data: 01 00 01 00\n"), "{known}");
    let check: (u16, &[u8]) = (0x42F, &[0, 1, 0, 5, 0, 0, 0]);
    let anew = told(&[size[0], size[1], check, poll]);
    assert!(anew.ends_with("the size of the connection was not seen\n    data: 01 00 01 00\n"), "{anew}");
    let answer: (u16, &[u8]) = (0x42F, &[0x80, 1, 0, 5, 0, 0, 0]);
    let kept = told(&[size[0], size[1], answer, poll]);
    assert!(kept.ends_with("poll command, MAC ID 5\n    data: 01 00 01 00\n"), "{kept}");
}

/// Nothing tells of the connection, but the fragments are an update.
#[test]
fn an_update_is_read_where_it_fits() {
    let update: [(u16, &[u8]); 3] = [
        (0x42D, &[0x00, 2, 2, 7, 3, 1, 1, 1]),
        (0x42D, &[0x41, 0, 1, 1, 0, 0, 0, 0]),
        (0x42D, &[0x82, 0, 4]),
    ];
    let text = told(&update);
    let wanted = "with the fragments before read as CIP Motion because it fits";
    assert!(text.contains(wanted) && text.contains("fixed format, update 7"), "{text}");
    assert!(!told(&[update[0], update[2]]).contains(wanted), "one is missing");
}

proptest! {
    #[test]
    fn no_frames_make_it_panic(frames in proptest::collection::vec((0..0x800_u16, proptest::collection::vec(any::<u8>(), 0..=8)), 0..40)) {
        let mut devicenet = Devicenet::default();
        for (id, data) in frames {
            tree(&mut devicenet, id, &data);
        }
    }

    /// All of one slave, so that what came before counts.
    #[test]
    fn no_messages_of_a_slave_make_it_panic(frames in proptest::collection::vec((0..10_usize, proptest::collection::vec(any::<u8>(), 0..=8)), 0..80)) {
        let mut devicenet = Devicenet::default();
        for (kind, data) in frames {
            let id = [0x42C, 0x42B, 0x42E, 0x42D, 0x3C5, 0x345, 0x42A, 0x42F, 0x428, 0x42B][kind];
            tree(&mut devicenet, id, &data);
        }
    }
}
