//! What no master should send.

use proptest::prelude::*;

use super::*;

#[test]
fn an_rpdo_that_is_too_short_is_not_taken() {
    let mut rig = Rig::new(1);
    rig.map_position();
    rig.nmt(NmtCommand::START);
    rig.take();
    for len in 0..6 {
        rig.send(0x205, &[6, 0, 1, 2, 3, 4][..len]);
        rig.send(0x80, &[]);
    }
    assert_eq!(rig.state(), State::SwitchOnDisabled);
    assert_eq!(rig.take_of(0x85), [[0x10, 0x82, 0x11, 1, 0, 0, 0, 0]], "told once");
    rig.send(0x205, &[6, 0, 0, 0, 0, 0]);
    assert_eq!(rig.take_of(0x85), [[0, 0, 0, 1, 0, 0, 0, 0]]);
}

#[test]
fn an_rpdo_that_is_too_long_is_taken_and_told() {
    let mut rig = Rig::new(1);
    rig.nmt(NmtCommand::START);
    rig.take();
    rig.send(0x205, &[6, 0, 9]);
    assert_eq!(rig.state(), State::ReadyToSwitchOn);
    assert_eq!(rig.take_of(0x85), [[0x20, 0x82, 0x11, 1, 0, 0, 0, 0]]);
}

#[test]
fn an_rpdo_before_operational_is_not_taken() {
    let mut rig = Rig::new(1);
    rig.send(0x205, &[6, 0]);
    assert_eq!(rig.state(), State::SwitchOnDisabled);
    rig.nmt(NmtCommand::START);
    rig.send(0x205, &[6, 0]);
    assert_eq!(rig.state(), State::ReadyToSwitchOn);
}

#[test]
fn a_mode_that_is_not_supported_changes_nothing() {
    let mut rig = Rig::new(1);
    rig.map(0x1400, 0x205, 255, &[0x6060_0008]);
    rig.nmt(NmtCommand::START);
    rig.send(0x205, &[8]);
    rig.send(0x205, &[5]);
    assert_eq!(rig.read(index::MODE_DISPLAY, 0), Ok(8));
}

#[test]
fn an_nmt_command_of_another_length_or_kind_changes_nothing() {
    let mut rig = Rig::new(1);
    for data in [&[][..], &[1], &[1, NODE, 0], &[1, 128], &[7, NODE], &[0, 0]] {
        rig.send(0, data);
        assert_eq!(rig.node.state(), NmtState::PRE_OPERATIONAL, "{data:02x?}");
    }
    assert_eq!(rig.node.statistics().malformed, 4);
}

#[test]
fn somebody_with_the_same_node_id_is_told() {
    for id in [0x705, 0x185, 0x85, 0x585] {
        let mut rig = Rig::new(1);
        rig.nmt(NmtCommand::START);
        rig.take();
        rig.send(id, &[0]);
        rig.send(id, &[0]);
        assert_eq!(rig.take_of(0x85), [[0x50, 0x81, 0x11, 0, 0, 0, 0, 0]], "{id:x}");
    }
}

#[test]
fn remote_extended_and_fd_frames_are_left_alone() {
    let mut rig = Rig::new(1);
    rig.nmt(NmtCommand::START);
    rig.take();
    let id = Id::Standard(0x205);
    let frames = [
        Frame::remote(id, 2).unwrap(),
        Frame::fd(id, &[6, 0], false).unwrap(),
        Frame::new(Id::Extended(0x205), &[6, 0]).unwrap(),
        Frame::remote(Id::Standard(0x185), 8).unwrap(),
        Frame::remote(Id::Standard(0x705), 1).unwrap(),
    ];
    for frame in frames {
        let now = rig.now;
        rig.node.handle_frame(now, &frame);
    }
    rig.run(5);
    assert!(rig.take_of(0x185).len() <= 1);
    assert_eq!(rig.state(), State::SwitchOnDisabled);
}

/// SDO misuse: each is refused with its code, and the device goes on.
#[test]
fn sdo_misuse_is_refused() {
    let mut rig = Rig::new(1);
    let cases = [
        (rig.write(0x6041, 0, 0, 2), AbortCode::READ_ONLY),
        (rig.write(0x1000, 0, 0, 4), AbortCode::READ_ONLY),
        (rig.write(0x6040, 0, 6, 4), AbortCode::TOO_LONG),
        (rig.write(0x607A, 0, 6, 2), AbortCode::TOO_SHORT),
        (rig.write(0x9999, 0, 6, 2), AbortCode::NO_OBJECT),
        (rig.write(0x6040, 1, 6, 2), AbortCode::NO_SUB_INDEX),
        (rig.write(0x605D, 0, 9, 2), AbortCode::TOO_HIGH),
        (rig.write(0x605D, 0, -9, 2), AbortCode::TOO_LOW),
    ];
    for (answer, code) in cases {
        assert_eq!(answer, Err(code));
    }
    for len in 0..8 {
        rig.send(0x605, &[0x40, 0, 0x10, 0, 0, 0, 0, 0][..len]);
    }
    assert_eq!(rig.take_of(0x585).len(), 1, "only the last answer was there before");
    for command in [0xE0, 0x1F, 0x7F, 0x00, 0x60, 0xC1, 0xA3] {
        rig.send(0x605, &[command, 0, 0x10, 0, 0, 0, 0, 0]);
        let answers = rig.take_of(0x585);
        assert!(answers.iter().all(|answer| answer[0] == 0x80), "{command:02x}: {answers:02x?}");
    }
    assert_eq!(rig.read(0x1000, 0), Ok(0x0002_0192));
}

#[test]
fn a_process_that_was_stopped_does_not_catch_up() {
    let mut rig = Rig::new(1);
    rig.set(0x1017, 0, 10).unwrap();
    rig.run(50);
    rig.take();
    rig.now = rig.now + DurationNs::from_secs(3_600);
    rig.run(1);
    assert!(rig.take_of(0x705).len() <= 2);
}

proptest! {
    /// No sequence of frames makes a device panic, or send more than there is room for.
    #[test]
    fn no_frames_make_it_panic(
        frames in prop::collection::vec(
            (prop::sample::select(vec![0_u16, 0x80, 0x85, 0x100, 0x185, 0x205, 0x305, 0x605, 0x605, 0x605, 0x701, 0x705, 0x7E5]),
             prop::collection::vec(any::<u8>(), 0..=8), 0_i64..4),
            0..200),
    ) {
        let mut rig = Rig::new(2);
        rig.nmt(NmtCommand::START);
        for (id, data, pause) in frames {
            rig.send(id, &data);
            rig.run(pause);
            prop_assert!(rig.status(0).state().is_some());
        }
    }
}
