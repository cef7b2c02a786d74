//! Network management, heartbeats, SYNC, PDOs and errors of a device.

use super::*;
use crate::sdo::client::{Client, ClientConfig};
use crate::sdo::request::{Method, SdoData, SdoFailure, SdoOutcome, SdoRequest};

#[test]
fn a_device_boots_and_tells_its_state() {
    let mut rig = Rig::new(1);
    assert_eq!(rig.take_of(0x705), [[0]], "one boot-up message");
    assert_eq!(rig.read(0x1000, 0), Ok(0x0002_0192));
    assert_eq!(rig.read(0x1018, 2), Ok(402));
    rig.set(0x1017, 0, 50).unwrap();
    rig.run(500);
    assert_eq!(rig.take_of(0x705), vec![[127]; 11]);
    rig.nmt(NmtCommand::START);
    rig.run(100);
    assert_eq!(rig.take_of(0x705), vec![[5]; 2]);
    rig.nmt(NmtCommand::STOP);
    rig.run(100);
    assert_eq!(rig.take_of(0x705), vec![[4]; 2]);
    rig.send(0x605, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]);
    assert_eq!(rig.take_of(0x585), Vec::<Vec<u8>>::new(), "no SDO while stopped");
    rig.nmt(NmtCommand::RESET_COMMUNICATION);
    rig.run(100);
    assert_eq!(rig.take_of(0x705), [[0]], "and 1017h is 0 again");
}

#[test]
fn commands_for_others_are_left_alone() {
    let mut rig = Rig::new(1);
    rig.send(0, &[1, NODE + 1]);
    assert_eq!(rig.node.state(), NmtState::PRE_OPERATIONAL);
    rig.send(0, &[1, 0]);
    assert_eq!(rig.node.state(), NmtState::OPERATIONAL);
}

/// The order of a SYNC cycle: what was sampled goes out, then what came takes effect.
#[test]
fn set_points_take_effect_at_sync() {
    let mut rig = Rig::new(1);
    rig.map_position();
    rig.nmt(NmtCommand::START);
    rig.take();
    rig.send(0x205, &[6, 0, 0, 0, 0, 0]);
    rig.run(5);
    assert_eq!(rig.state(), State::SwitchOnDisabled, "not before SYNC");
    rig.send(0x80, &[]);
    assert_eq!(rig.state(), State::ReadyToSwitchOn);
    let data = rig.take_of(0x185);
    assert_eq!(data.len(), 1);
    assert_eq!(data[0][0] & 0x4F, 0x40, "sampled before it");
}

#[test]
fn a_pdo_with_type_255_takes_effect_at_once_and_is_sent_on_change() {
    let mut rig = Rig::new(1);
    rig.take();
    rig.nmt(NmtCommand::START);
    rig.run(5);
    let first = rig.take_of(0x185);
    assert_eq!(first.len(), 1, "once at the start");
    assert_eq!(first[0][0] & 0x4F, 0x40);
    rig.send(0x205, &[6, 0]);
    assert_eq!(rig.state(), State::ReadyToSwitchOn);
    let next = rig.take_of(0x185);
    assert_eq!(next.len(), 1);
    assert_eq!(next[0][0] & 0x6F, 0x21);
    rig.run(50);
    assert!(rig.take_of(0x185).is_empty(), "nothing has changed");
}

#[test]
fn transmission_types_count_syncs() {
    for (kind, sent) in [(1, 12), (2, 6), (3, 4), (12, 1), (240, 0), (0, 1)] {
        let mut rig = Rig::new(1);
        rig.map(0x1800, 0x185, kind, &[0x6041_0010]);
        rig.nmt(NmtCommand::START);
        rig.take();
        for _ in 0..12 {
            rig.send(0x80, &[]);
            rig.run(1);
        }
        assert_eq!(rig.take_of(0x185).len(), sent, "type {kind}");
    }
}

#[test]
fn the_sync_start_value_sets_the_first_sync_that_counts() {
    let mut rig = Rig::new(1);
    rig.set(0x1019, 0, 6).unwrap();
    rig.map(0x1800, 0x4000_0185, 2, &[0x6041_0010]);
    assert_eq!(rig.set(0x1800, 6, 3), Err(AbortCode::VALUE), "not while it is valid");
    rig.set(0x1800, 1, 0xC000_0185).unwrap();
    rig.set(0x1800, 6, 3).unwrap();
    rig.set(0x1800, 1, 0x4000_0185).unwrap();
    rig.nmt(NmtCommand::START);
    rig.take();
    let mut sent = Vec::new();
    for counter in [5, 6, 1, 2, 3, 4, 5, 6, 1] {
        rig.send(0x80, &[counter]);
        if !rig.take_of(0x185).is_empty() {
            sent.push(counter);
        }
    }
    assert_eq!(sent, [3, 5, 1]);
}

#[test]
fn the_inhibit_time_and_the_event_timer_hold() {
    let mut rig = Rig::new(1);
    rig.set(0x1800, 1, 0xC000_0185).unwrap();
    rig.set(0x1800, 3, 200).unwrap();
    rig.set(0x1800, 5, 50).unwrap();
    rig.set(0x1800, 1, 0x4000_0185).unwrap();
    rig.nmt(NmtCommand::START);
    rig.take();
    rig.run(200);
    assert_eq!(rig.take_of(0x185).len(), 4, "every 50 ms without a change");
    assert!(rig.run_until(60, |rig| !rig.take_of(0x185).is_empty()));
    for word in [6, 0, 6, 0] {
        rig.send(0x205, &[word, 0]);
        rig.run(1);
    }
    assert!(rig.take_of(0x185).is_empty(), "inhibited");
    rig.run(20);
    assert_eq!(rig.take_of(0x185).len(), 0, "it is as it was sent last");
    rig.send(0x205, &[6, 0]);
    rig.run(20);
    assert_eq!(rig.take_of(0x185).len(), 1);
}

#[test]
fn a_sync_of_another_length_is_told_and_ignored() {
    let mut rig = Rig::new(1);
    rig.map_position();
    rig.nmt(NmtCommand::START);
    rig.take();
    for data in [&[1][..], &[0], &[1, 2]] {
        rig.send(0x80, data);
    }
    let frames = rig.take();
    let ids: Vec<_> = frames.iter().map(Frame::id).collect();
    assert_eq!(ids, [Id::Standard(0x85)], "one EMCY, no TPDO");
    assert_eq!(frames[0].data(), [0x40, 0x82, 0x11, 0, 0, 0, 0, 0]);
    rig.send(0x80, &[]);
    let told = rig.take_of(0x85);
    assert_eq!(told, [[0; 8]], "gone");
    assert_eq!(rig.read(0x1003, 0), Ok(1));
    assert_eq!(rig.read(0x1003, 1), Ok(0x8240));
    assert_eq!(rig.read(0x1003, 2), Err(AbortCode::NO_DATA));
    assert_eq!(rig.set(0x1003, 0, 1), Err(AbortCode::VALUE));
    rig.set(0x1003, 0, 0).unwrap();
    assert_eq!(rig.read(0x1003, 1), Err(AbortCode::NO_DATA));
}

#[test]
fn the_history_keeps_the_last_eight_and_the_inhibit_time_spreads_messages() {
    let mut rig = Rig::new(1);
    rig.set(0x1015, 0, 1_000).unwrap();
    rig.take();
    for code in 0xFF01..=0xFF0A {
        rig.set(0x2FFF, 1, code).unwrap();
        rig.run_until(100, |rig| rig.state() == State::Fault);
        rig.set(index::CONTROLWORD, 0, 0x80).unwrap();
        rig.set(index::CONTROLWORD, 0, 0).unwrap();
    }
    assert_eq!(rig.read(0x1003, 0), Ok(8));
    assert_eq!(rig.read(0x1003, 1), Ok(0x0001_FF0A));
    assert_eq!(rig.read(0x1003, 8), Ok(0x0001_FF03));
    let told = rig.take_of(0x85).len();
    assert!(told <= 2, "{told}");
    rig.run(1_000);
    assert_eq!(rig.take_of(0x85).len(), 10, "one in 100 ms");
}

#[test]
fn rpdos_have_a_deadline() {
    let mut rig = Rig::new(1);
    rig.map_position();
    rig.set(0x1400, 5, 20).unwrap();
    rig.nmt(NmtCommand::START);
    rig.run(100);
    assert!(rig.take_of(0x85).is_empty(), "it begins with the first one");
    for _ in 0..10 {
        rig.send(0x205, &[0; 6]);
        rig.run(10);
    }
    assert!(rig.take_of(0x85).is_empty());
    rig.run(20);
    assert_eq!(rig.take_of(0x85), [[0x50, 0x82, 0x11, 1, 0, 0, 0, 0]]);
    assert_eq!(rig.node.state(), NmtState::PRE_OPERATIONAL, "1029h:1 is 0");
}

#[test]
fn rpdos_after_the_synchronous_window_are_ignored() {
    let mut rig = Rig::new(1);
    rig.map_position();
    rig.set(0x1007, 0, 2_000).unwrap();
    rig.nmt(NmtCommand::START);
    rig.send(0x80, &[]);
    rig.run(5);
    rig.send(0x205, &[6, 0, 0, 0, 0, 0]);
    rig.send(0x80, &[]);
    assert_eq!(rig.state(), State::SwitchOnDisabled);
    assert_eq!(rig.node.statistics().late_rpdos, 1);
    rig.run(1);
    rig.send(0x205, &[6, 0, 0, 0, 0, 0]);
    rig.send(0x80, &[]);
    assert_eq!(rig.state(), State::ReadyToSwitchOn);
}

/// A heartbeat that stays away: 8130h, 1029h:1, and the axis by 6007h.
#[test]
fn a_lost_master_stops_the_axis() {
    let cases = [
        (0, 0, NmtState::PRE_OPERATIONAL, State::OperationEnabled),
        (0, 1, NmtState::OPERATIONAL, State::OperationEnabled),
        (1, 1, NmtState::OPERATIONAL, State::Fault),
        (1, 2, NmtState::STOPPED, State::Fault),
        (2, 0, NmtState::PRE_OPERATIONAL, State::SwitchOnDisabled),
        (3, 0, NmtState::PRE_OPERATIONAL, State::QuickStopActive),
    ];
    for (option, behaviour, state, axis) in cases {
        let mut rig = Rig::new(1);
        rig.set(index::ABORT_CONNECTION_OPTION, 0, option).unwrap();
        rig.set(index::QUICK_STOP_OPTION, 0, 6).unwrap();
        rig.set(0x1029, 1, behaviour).unwrap();
        rig.set(0x1016, 1, 0x0001_0064).unwrap();
        rig.nmt(NmtCommand::START);
        rig.enable(9);
        rig.run(500);
        assert_eq!(rig.state(), State::OperationEnabled, "watching begins with the first heartbeat");
        for _ in 0..5 {
            rig.send(0x701, &[5]);
            rig.run(50);
        }
        assert_eq!(rig.state(), State::OperationEnabled);
        rig.take();
        rig.run(300);
        assert_eq!((rig.node.state(), rig.state()), (state, axis), "6007h {option}, 1029h {behaviour}");
        if state != NmtState::STOPPED {
            assert_eq!(rig.take_of(0x85)[0][..4], [0x30, 0x81, 0x11, 1]);
            rig.send(0x701, &[5]);
            assert_eq!(rig.take_of(0x85).last().unwrap()[..2], [0, 0], "it is back");
        }
    }
}

/// Asks for the state, and takes the answer.
fn guard(rig: &mut Rig) -> Vec<Vec<u8>> {
    rig.take();
    let request = Frame::remote(Id::Standard(0x705), 1).unwrap();
    rig.node.handle_frame(rig.now, &request);
    rig.drain();
    rig.take_of(0x705)
}

#[test]
fn node_guarding_is_answered_with_a_bit_that_alternates() {
    let mut rig = Rig::new(1);
    assert_eq!([guard(&mut rig), guard(&mut rig), guard(&mut rig)], [[[0x7F]], [[0xFF]], [[0x7F]]]);
    rig.nmt(NmtCommand::START);
    assert_eq!([guard(&mut rig), guard(&mut rig)], [[[0x85]], [[0x05]]]);
    rig.nmt(NmtCommand::STOP);
    assert_eq!(guard(&mut rig), [[0x84]]);
    // From 0 again.
    rig.nmt(NmtCommand::RESET_COMMUNICATION);
    assert_eq!(guard(&mut rig), Vec::<Vec<u8>>::new(), "not while it initialises");
    rig.run(20);
    assert_eq!(guard(&mut rig), [[0x7F]]);
    // Somebody else is asked, or something else.
    for id in [0x704, 0x185, 0x605] {
        rig.node.handle_frame(rig.now, &Frame::remote(Id::Standard(id), 8).unwrap());
    }
    rig.drain();
    assert_eq!(rig.take(), []);
    // One that sends heartbeats is not guarded.
    rig.set(0x1017, 0, 1_000).unwrap();
    assert_eq!(guard(&mut rig), Vec::<Vec<u8>>::new());
}

/// Requests that stay away: 8130h, 1029h:1, and the axis by 6007h.
#[test]
fn a_master_that_does_not_ask_any_more_stops_the_axis() {
    let mut rig = Rig::new(1);
    rig.set(0x100C, 0, 50).unwrap();
    rig.set(0x100D, 0, 3).unwrap();
    rig.nmt(NmtCommand::START);
    rig.enable(9);
    rig.run(500);
    assert_eq!(rig.state(), State::OperationEnabled, "watching begins with the first request");
    for _ in 0..5 {
        assert_eq!(guard(&mut rig).len(), 1);
        rig.run(100);
    }
    assert_eq!((rig.node.state(), rig.state()), (NmtState::OPERATIONAL, State::OperationEnabled));
    rig.run(49);
    assert_eq!(rig.take_of(0x85), Vec::<Vec<u8>>::new(), "149 ms after the last one");
    rig.run(2);
    assert_eq!(rig.take_of(0x85)[0][..4], [0x30, 0x81, 0x11, 0]);
    assert_eq!(rig.node.state(), NmtState::PRE_OPERATIONAL);
    rig.run(300);
    assert_eq!(rig.state(), State::Fault);
    rig.node.handle_frame(rig.now, &Frame::remote(Id::Standard(0x705), 1).unwrap());
    rig.drain();
    let back = rig.take_of(0x85).last().map(|emcy| [emcy[0], emcy[1]]);
    assert_eq!(back, Some([0, 0]), "it is back");
}

#[test]
fn leaving_operational_stops_the_axis() {
    for command in [NmtCommand::STOP, NmtCommand::ENTER_PRE_OPERATIONAL, NmtCommand::RESET_COMMUNICATION] {
        let mut rig = Rig::new(1);
        rig.nmt(NmtCommand::START);
        rig.enable(9);
        rig.nmt(command);
        rig.run(100);
        assert_eq!(rig.state(), State::Fault, "{command}");
    }
    let mut rig = Rig::new(1);
    rig.nmt(NmtCommand::START);
    rig.enable(9);
    rig.nmt(NmtCommand::RESET_NODE);
    rig.run(100);
    assert_eq!(rig.state(), State::SwitchOnDisabled);
}

#[test]
fn a_sync_that_stays_away_stops_the_cyclic_modes() {
    for (cycles, silence) in [(3, 30), (50, 500)] {
        stops_after(cycles, silence);
    }
}

/// In operation at 10 ms: nothing after a silence of so many milliseconds, a fault right after.
fn stops_after(cycles: u16, silence: i64) {
    let mut rig = Rig::new(1);
    rig.node.set_sync_cycles(cycles);
    rig.map_position();
    rig.set(0x1006, 0, 10_000).unwrap();
    rig.nmt(NmtCommand::START);
    let mut word = 6;
    for _ in 0..100 {
        let got = rig.cycle(10, word, 0);
        word = match got.map(|(status, _)| status & 0x6F) {
            Some(0x21) => 7,
            Some(0x23 | 0x27) => 15,
            _ => 6,
        };
        if rig.read(index::MODE, 0) != Ok(8) {
            rig.set(index::MODE, 0, 8).unwrap();
        }
    }
    // A cycle of the rig ends when its time is over.
    rig.run(silence - 15);
    assert_eq!(rig.state(), State::OperationEnabled);
    rig.run(200);
    assert_eq!(rig.state(), State::Fault);
    assert_eq!(rig.read(index::ERROR_CODE, 0), Ok(0x8700));
}

#[test]
fn the_time_of_day_is_taken() {
    let mut rig = Rig::new(1);
    rig.send(0x100, &[0x40, 0x42, 0x0F, 0, 0x10, 0x27]);
    assert_eq!((rig.node.time().milliseconds, rig.node.time().days), (1_000_000, 10_000));
    rig.send(0x100, &[0; 5]);
    assert_eq!(rig.node.time().days, 10_000);
    assert_eq!(rig.node.statistics().malformed, 1);
}

/// A device without a node-id is silent until LSS gives it one; another one counts from the next reset on.
#[test]
fn a_node_id_comes_by_lss() {
    let device = Device::new(&[ServoParameters::default()]).unwrap();
    let boot_time = DurationNs::from_millis(10);
    let config =
        Config { node: None, identity: identity(1, 77), boot_time, has_blocks: true, has_mapping: true };
    let mut rig = Rig { node: Node::new(&config, device), now: MonotonicTime(0), sent: Vec::new() };
    rig.run(100);
    rig.send(0, &[1, 0]);
    rig.send(0x80, &[]);
    assert!(rig.take().is_empty(), "it has nothing to say");
    rig.send(0x7E5, &[0x04, 1, 0, 0, 0, 0, 0, 0]);
    rig.send(0x7E5, &[0x5D, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(rig.take_of(0x7E4), [[0x5D, 77, 0, 0, 0, 0, 0, 0]]);
    rig.send(0x7E5, &[0x11, 9, 0, 0, 0, 0, 0, 0]);
    assert_eq!(rig.take_of(0x7E4), [[0x11, 0, 0, 0, 0, 0, 0, 0]]);
    rig.send(0x7E5, &[0x04, 0, 0, 0, 0, 0, 0, 0]);
    rig.run(20);
    assert_eq!(rig.take_of(0x709), [[0]]);
    assert_eq!(rig.node.dictionary().number(0x1400, 1), 0x209);
    rig.send(0x7E5, &[0x04, 1, 0, 0, 0, 0, 0, 0]);
    rig.send(0x7E5, &[0x11, 5, 0, 0, 0, 0, 0, 0]);
    rig.send(0x7E5, &[0x04, 0, 0, 0, 0, 0, 0, 0]);
    rig.run(20);
    assert_eq!(rig.node.node().map(NodeId::get), Some(9));
    rig.send(0, &[130, 9]);
    rig.run(20);
    assert_eq!(rig.take_of(0x705), [[0]]);
    assert_eq!((rig.node.node().map(NodeId::get), rig.node.dictionary().number(0x1014, 0)), (Some(5), 0x85));
    assert_eq!(rig.read(0x1018, 4), Ok(77));
    rig.send(0x7E5, &[0; 7]);
    assert_eq!(rig.node.statistics().malformed, 1);
}

/// A master's client and the device, frame by frame.
fn transfer(rig: &mut Rig, request: SdoRequest) -> SdoOutcome {
    let mut client = Client::new(ClientConfig::default());
    client.start(rig.now, request).expect("a free client");
    for _ in 0..100_000 {
        if let Some(outcome) = client.take_outcome() {
            return outcome;
        }
        while let Some(frame) = client.poll(rig.now) {
            rig.send(0x605, &frame);
        }
        for answer in rig.take_of(0x585) {
            client.handle(rig.now, &answer).expect("eight bytes");
        }
    }
    panic!("no end");
}

/// The data sheet out of 1021h, and a long value into 2FFEh and back: in segments and in blocks.
#[test]
fn long_values_go_both_ways() {
    for method in [Method::Segments, Method::Blocks] {
        let mut rig = Rig::new(1);
        rig.take();
        let eds = rig.node.eds().to_vec();
        let request = SdoRequest::upload_into(Mux::new(0x1021, 0), Vec::with_capacity(eds.len())).by(method);
        assert_eq!(transfer(&mut rig, request).data.as_slice(), eds);
        let bytes: Vec<_> = (0..4_000_u32).map(|number| number.to_le_bytes()[0]).collect();
        let scratch = Mux::new(0x2FFE, 0);
        let outcome =
            transfer(&mut rig, SdoRequest::download(scratch, SdoData::Buffer(bytes.clone())).by(method));
        assert_eq!(outcome.result, Ok(()));
        let outcome =
            transfer(&mut rig, SdoRequest::upload_into(scratch, Vec::with_capacity(5_000)).by(method));
        assert_eq!(outcome.data.as_slice(), bytes);
        let outcome =
            transfer(&mut rig, SdoRequest::download(scratch, SdoData::Buffer(vec![0; 5_000])).by(method));
        assert_eq!(outcome.result, Err(SdoFailure::Refused(AbortCode::TOO_LONG)));
        let outcome =
            transfer(&mut rig, SdoRequest::upload_into(scratch, Vec::with_capacity(5_000)).by(method));
        assert_eq!(outcome.data.as_slice(), bytes, "as before");
    }
}
