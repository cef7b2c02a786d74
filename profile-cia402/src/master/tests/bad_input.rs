//! Devices and strangers that do what they must not, one at a time: each is named, and the others keep running.

use super::peer::Wrong;
use super::*;
use crate::drive::ErrorCode;
use crate::sdo::request::SdoOperation;
use crate::wire::emcy::{Emcy, ErrorRegister};

#[test]
fn a_device_that_reboots_in_operation_is_told_at_once() {
    let mut rig = running(2);
    rig.keep(&[2]);
    let now = rig.now;
    rig.device(1).reset(now);
    rig.until("boot-up", |rig| rig.count(|event| matches!(event, Event::Rebooted { .. })) > 0);
    assert!(rig.saw(&Event::Rebooted { node: id(1), operational: true }));
    // 20 ms after its reset, with the boot-up message itself.
    assert_eq!(rig.now.0 - now.0, 20_000_000);
    let consumer = rig.master.consumer(id(1), 1).unwrap();
    assert_eq!((consumer.fresh, consumer.state), (false, ConsumerState::Waiting));
    assert!(!rig.master.commit(id(1), 1));
    // The values to be sent are gone too.
    assert_eq!(rig.master.producer(id(1), 1).unwrap(), [0; 6]);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    rig.comes_up(&[1, 2]);
}

#[test]
fn a_lost_heartbeat() {
    let mut rig = running(2);
    rig.keep(&[2]);
    rig.device(1).no_heartbeat = true;
    let before = rig.now;
    rig.until("loss", |rig| rig.saw(&Event::HeartbeatLost { node: id(1) }));
    assert!((100..=150).contains(&((rig.now.0 - before.0) / 1_000_000)));
    rig.run_ms(1);
    // Whatever it does, it is told to stop, and gets no RPDO.
    assert_eq!((rig.state(1), rig.device(1).state), (BootState::Lost, NmtState::STOPPED));
    assert_eq!(rig.master.node(id(1)).unwrap().status, Some(BootStatus::HEARTBEAT_LOST));
    let received = rig.device(1).received.len();
    rig.runs(&[2]);
    assert_eq!(rig.device(1).received.len(), received);
    // It is brought up again.
    rig.device(1).no_heartbeat = false;
    rig.forget();
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    rig.comes_up(&[1, 2]);
}

#[test]
fn a_device_that_leaves_operation_by_itself() {
    let mut rig = running(2);
    rig.keep(&[2]);
    rig.device(1).state = NmtState::PRE_OPERATIONAL;
    let state = NmtState::PRE_OPERATIONAL;
    rig.until("loss", |rig| rig.saw(&Event::StateChanged { node: id(1), state }));
    assert!(!rig.master.consumer(id(1), 1).unwrap().fresh);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    rig.comes_up(&[1, 2]);
}

#[test]
fn a_device_that_is_switched_off_while_it_is_configured() {
    let mut rig = rig(network(2));
    rig.master.start(rig.now);
    rig.until("map", |rig| rig.state(1) == BootState::Map);
    rig.device(1).dead = true;
    rig.until("failure", |rig| rig.state(1) == BootState::Failed);
    let (status, step) = rig.failed();
    assert_eq!(status, BootStatus::CONFIGURATION);
    assert!(step.ends_with("no answer within 500 ms"), "{step}");
    rig.comes_up(&[2]);
}

/// The whole boot-up of a device with all that there is to write, one access of it going wrong: how far it comes.
#[test]
fn every_step_that_goes_wrong() {
    let mut config = network(2);
    let data = SdoData::inline(&[8]).unwrap();
    config.nodes[0].writes = vec![Write { object: Mux::new(0x6060, 0), data }];
    config.nodes[0].stamp = Some(Stamp { date: 15_000, time: 36_000_000 });
    config.sync = Some(SyncConfig { period_ns: 4_000_000, window_ns: 2_000_000, counter_overflow: 10 });
    let good = {
        let mut rig = beside(config.clone(), |_| {});
        rig.comes_up(&[1]);
        let text = |row: &report::ReportRow| row.to_string().split(": ").next().unwrap().to_string();
        rig.master.node(id(1)).unwrap().report.iter().map(text).collect::<Vec<_>>()
    };
    let mut table = String::new();
    for (at, step) in (1..).zip(&good) {
        table += &format!("{step:<30}");
        for wrong in [Wrong::Abort, Wrong::Silence, Wrong::Nonsense, Wrong::Stranger, Wrong::Reboot] {
            let mut rig = beside(config.clone(), |device| device.objects.wrong = Some((at, wrong)));
            let over = |rig: &Rig| matches!(rig.state(1), BootState::Failed | BootState::Operational);
            rig.until("an end", over);
            rig.kept();
            let info = rig.master.node(id(1)).unwrap();
            let end = match (info.state, info.status) {
                (BootState::Operational, _) => "up".to_string(),
                (_, Some(status)) => char::from(status.0).to_string(),
                (_, None) => "twice".to_string(),
            };
            // What failed is named as what was done wrong.
            if info.state == BootState::Failed {
                let (_, named) = rig.failed();
                assert!(named.starts_with(step), "{wrong:?} at {step}: {named}");
            }
            table += &format!(" {:<14}", format!("{wrong:?} {end}"));
        }
        table += "\n";
    }
    insta::assert_snapshot!(table);
}

/// Every identifier, with nothing and with eight bytes in it, as a stranger would send it.
#[test]
fn frames_with_any_identifier() {
    let mut rig = running(2);
    rig.keep(&[2]);
    let mut table = String::new();
    let mut last = String::new();
    for number in 0..0x800_u16 {
        // What only the other device sends would be the other device.
        if [0x082, 0x182, 0x582, 0x702].contains(&number) {
            continue;
        }
        let mut verdict = |data: &[u8]| {
            rig.hear(Id::Standard(number), data).map_or_else(|error| error.to_string(), |()| "taken".into())
        };
        let verdicts = format!("{}; {}", verdict(&[]), verdict(&[0; 8]));
        if verdicts != last {
            table += &format!("from {number:03X}: {verdicts}\n");
            last = verdicts;
        }
        if number % 16 == 0 {
            rig.run_ms(1);
        }
    }
    rig.kept();
    insta::assert_snapshot!(table);
}

#[test]
fn an_abort_at_each_step_is_named() {
    // What cannot be done without; everything else is tolerated.
    let needed = [
        (Mux::new(0x1400, 1), "map write 1400:01"),
        (Mux::new(0x1400, 2), "map write 1400:02"),
        (Mux::new(0x1600, 0), "map write 1600:00"),
        (Mux::new(0x1600, 1), "map write 1600:01"),
        (Mux::new(0x1600, 2), "map write 1600:02"),
        (Mux::new(0x1800, 1), "map write 1800:01"),
        (Mux::new(0x1800, 2), "map write 1800:02"),
        (Mux::new(0x1A00, 2), "map write 1A00:02"),
        (Mux::PRODUCER_HEARTBEAT, "control write 1017:00"),
    ];
    for (object, step) in needed {
        let mut rig = rig(network(2));
        rig.device(1).objects.refuse.insert(object, AbortCode::DEVICE_STATE);
        rig.master.start(rig.now);
        rig.until("failure", |rig| rig.state(1) == BootState::Failed);
        let (status, text) = rig.failed();
        assert_eq!(status, BootStatus::CONFIGURATION);
        let text_of = "refused with 08000022: data cannot be transferred or stored: device state";
        assert_eq!(text, format!("{step}: {text_of}"));
        rig.comes_up(&[2]);
    }
    for object in [
        Mux::CYCLE_PERIOD,
        Mux::consumer_heartbeat(1),
        Mux::new(0x1800, 3),
        Mux::new(0x1800, 5),
        Mux::new(0x1401, 1),
    ] {
        let mut rig = rig(network(2));
        rig.device(1).objects.refuse.insert(object, AbortCode::DEVICE_STATE);
        rig.master.start(rig.now);
        rig.until("identify", |rig| rig.state(1) == BootState::Identify);
        if object.index == 0x1401 {
            // A PDO that is not configured, and stays.
            rig.device(1).objects.set(object, 0x301);
        }
        rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
        rig.comes_up(&[1, 2]);
        let report = rig.master.node(id(1)).unwrap().report;
        let tolerated = report.iter().filter(|row| matches!(row.outcome, report::RowOutcome::Tolerated(_)));
        assert_eq!(tolerated.map(|row| row.object).collect::<Vec<_>>(), [object]);
    }
}

#[test]
fn an_answer_with_a_wrong_toggle_or_length() {
    let mut rig = running(2);
    rig.keep(&[2]);
    rig.device(1).mute = true;
    rig.master.sdo_submit(id(1), SdoRequest::upload(Mux::new(0x1008, 0)), Priority::Normal).unwrap();
    rig.run_ms(5);
    // A frame that is too short is not taken, and the transfer goes on.
    assert_eq!(rig.hear(Id::Standard(0x581), &[0x41, 8, 0x10, 0, 14, 0, 0]), Err(Refusal::Malformed));
    assert_eq!(rig.hear(Id::Standard(0x581), &[0x41, 8, 0x10, 0, 14, 0, 0, 0]), Ok(()));
    rig.run_ms(5);
    assert_eq!(rig.hear(Id::Standard(0x581), &[0x10, 1, 2, 3, 4, 5, 6, 7]), Ok(()));
    let failed = |event: &Event| {
        let toggle = Err(SdoFailure::Protocol(AbortCode::TOGGLE));
        matches!(event, Event::Sdo { outcome, .. } if outcome.result == toggle)
    };
    assert_eq!(rig.count(failed), 1, "{:?}", rig.log);
    rig.run_ms(5);
    assert!(rig.sent.iter().any(|(_, frame)| frame.to_string() == "601#80 08 10 00 00 00 03 05"));
    rig.runs(&[1, 2]);
}

#[test]
fn a_wrong_toggle_in_the_answer_to_a_segment() {
    let mut rig = running(2);
    rig.keep(&[2]);
    rig.device(1).mute = true;
    let text = SdoData::inline(b"longer than one segment").unwrap();
    rig.master.sdo_submit(id(1), SdoRequest::download(Mux::new(0x1008, 0), text), Priority::Normal).unwrap();
    rig.run_ms(5);
    assert_eq!(rig.hear(Id::Standard(0x581), &[0x60, 8, 0x10, 0, 0, 0, 0, 0]), Ok(()));
    rig.run_ms(5);
    assert_eq!(rig.hear(Id::Standard(0x581), &[0x30, 0, 0, 0, 0, 0, 0, 0]), Ok(()));
    let failed = |event: &Event| {
        let toggle = Err(SdoFailure::Protocol(AbortCode::TOGGLE));
        matches!(event, Event::Sdo { outcome, .. } if outcome.result == toggle && outcome.operation == SdoOperation::Download)
    };
    assert_eq!(rig.count(failed), 1, "{:?}", rig.log);
    rig.run_ms(5);
    assert!(rig.sent.iter().any(|(_, frame)| frame.to_string() == "601#80 08 10 00 00 00 03 05"));
    rig.kept();
    rig.runs(&[1, 2]);
}

#[test]
fn pdos_of_a_wrong_length() {
    for len in [5, 7] {
        let mut rig = running(2);
        rig.keep(&[2]);
        rig.device(1).tpdo_len = Some(len);
        rig.run_ms(20);
        // Told once, not taken, and missed.
        let told = Event::PdoLength { node: id(1), number: 1, expected: 6, found: len };
        assert_eq!(rig.count(|event| *event == told), 1);
        assert!(rig.saw(&Event::PdoLost { node: id(1), number: 1 }));
        assert!(rig.master.statistics().refused(Refusal::Malformed) >= 4);
        rig.runs(&[2]);
        rig.device(1).tpdo_len = None;
        rig.run_ms(8);
        rig.runs(&[1, 2]);
    }
}

#[test]
fn malformed_frames_change_nothing() {
    let mut rig = running(2);
    rig.keep(&[1, 2]);
    let frames: [(u16, &[u8], Refusal); 10] = [
        (0x701, &[], Refusal::Malformed),
        (0x701, &[5, 5], Refusal::Malformed),
        (0x081, &[0; 7], Refusal::Malformed),
        (0x581, &[0x60; 3], Refusal::Malformed),
        (0x181, &[1, 2], Refusal::Malformed),
        (0x7E4, &[0; 8], Refusal::NotOurs),
        (0x100, &[0; 6], Refusal::NotOurs),
        (0x601, &[0x40, 0, 0x10, 0, 0, 0, 0, 0], Refusal::NotOurs),
        (0x281, &[0; 8], Refusal::NotOurs),
        (0x6FF, &[], Refusal::NotOurs),
    ];
    for (number, data, refusal) in frames {
        let before = rig.master.statistics().refused(refusal);
        assert_eq!(rig.hear(Id::Standard(number), data), Err(refusal), "{number:03X}");
        assert_eq!(rig.master.statistics().refused(refusal), before + 1, "{number:03X}");
    }
    let remote = Frame::remote(Id::Standard(0x181), 6).unwrap();
    assert_eq!(rig.master.handle_frame(rig.now, &remote), Err(Refusal::Remote));
    assert_eq!(rig.hear(Id::Extended(0x181), &[0; 6]), Err(Refusal::NotOurs));
    rig.runs(&[1, 2]);
}

#[test]
fn a_device_that_is_not_in_the_list_is_told_once() {
    let mut rig = running(2);
    rig.keep(&[1, 2]);
    for _ in 0..3 {
        assert_eq!(rig.hear(Id::Standard(0x705), &[0]), Err(Refusal::UnknownNode));
        assert_eq!(rig.hear(Id::Standard(0x185), &[0; 8]), Err(Refusal::UnknownNode));
        assert_eq!(rig.hear(Id::Standard(0x085), &[0; 8]), Err(Refusal::UnknownNode));
    }
    assert_eq!(rig.log.iter().filter(|event| !matches!(event, Event::Sdo { .. })).count(), 1);
    assert!(rig.saw(&Event::UnknownNode { node: id(5) }));
    rig.runs(&[1, 2]);
}

#[test]
fn a_second_master_is_told() {
    let mut rig = running(2);
    rig.keep(&[1, 2]);
    for (number, data) in [(0x000, &[1, 0][..]), (0x080, &[]), (0x201, &[0; 6]), (0x201, &[0; 6])] {
        assert_eq!(rig.hear(Id::Standard(number), data), Err(Refusal::SecondMaster));
    }
    let ids: Vec<_> = rig
        .log
        .iter()
        .filter_map(|event| match event {
            Event::SecondMaster { id, .. } => Some(id.to_string()),
            _ => None,
        })
        .collect();
    assert_eq!(ids, ["000", "080", "201"]);
    rig.runs(&[1, 2]);
}

#[test]
fn a_storm_of_emcys_is_told_by_its_beginning_and_its_last_one() {
    let mut rig = running(2);
    rig.keep(&[1, 2]);
    let emcy = |vendor| Emcy {
        code: ErrorCode(0x8611),
        register: ErrorRegister::GENERIC,
        vendor: [vendor, 0, 0, 0, 0],
    };
    // From the beginning of a second on.
    let second = MonotonicTime((rig.now.0 / 1_000_000_000 + 1) * 1_000_000_000);
    rig.run_ms((second.0 - rig.now.0) / 1_000_000 + 1);
    rig.forget();
    for vendor in 0..100 {
        assert_eq!(rig.hear(Id::Standard(0x081), &emcy(vendor).emit()), Ok(()));
    }
    assert_eq!(rig.count(|event| matches!(event, Event::Emcy { .. })), 16);
    assert_eq!(rig.count(|event| *event == Event::EmcyStorm { node: id(1) }), 1);
    assert_eq!(rig.master.statistics().emcys_suppressed, 84);
    assert_eq!(rig.master.node(id(1)).unwrap().emcy, Some(emcy(99)));
    // Another device's are told.
    assert_eq!(rig.hear(Id::Standard(0x082), &emcy(7).emit()), Ok(()));
    assert!(rig.saw(&Event::Emcy { node: id(2), emcy: emcy(7) }));
    rig.runs(&[1, 2]);
    rig.run_ms(1000);
    assert_eq!(rig.hear(Id::Standard(0x081), &emcy(1).emit()), Ok(()));
    assert!(rig.saw(&Event::Emcy { node: id(1), emcy: emcy(1) }));
}

#[test]
fn bus_off_and_back() {
    let mut rig = running(2);
    rig.master.bus_off(rig.now);
    rig.settle();
    assert!(rig.saw(&Event::BusOff));
    for number in [1, 2] {
        assert_eq!(rig.state(number), BootState::Off);
        assert!(!rig.master.consumer(id(number), 1).unwrap().fresh);
        assert!(!rig.master.commit(id(number), 1));
    }
    rig.forget();
    rig.run_ms(100);
    assert_eq!((rig.sent.len(), rig.master.wake_at(), rig.master.next_sync()), (0, None, None));
    rig.master.bus_on(rig.now);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    assert!(rig.saw(&Event::BusOn));
    rig.comes_up(&[1, 2]);
}

#[test]
fn frames_that_cannot_be_sent_are_told_once_a_period() {
    let mut rig = running(2);
    rig.keep(&[1, 2]);
    for _ in 0..5 {
        rig.master.transmit_failed(Id::Standard(0x201));
    }
    rig.settle();
    assert_eq!(rig.count(|event| *event == Event::TransmitFailed { id: Id::Standard(0x201) }), 1);
    assert_eq!(rig.master.statistics().transmit_failures, 5);
    rig.runs(&[1, 2]);
}

#[test]
fn two_devices_with_one_node_id_answer_twice() {
    let mut rig = rig(network(2));
    rig.devices.push(Device::new(id(1)));
    rig.master.start(rig.now);
    rig.until("duplicate", |rig| {
        rig.saw(&Event::DuplicateNode { node: id(1), sign: DuplicateSign::Answers })
    });
    rig.run_ms(1);
    // Neither is let into operation.
    assert_eq!(rig.state(1), BootState::Failed);
    assert!(
        rig.devices
            .iter()
            .filter(|device| device.node == id(1))
            .all(|device| device.state == NmtState::STOPPED)
    );
    rig.comes_up(&[2]);
    assert_eq!(rig.count(|event| *event == Event::Operational { node: id(1) }), 0);
}

#[test]
fn somebody_else_may_ask_a_device_in_operation() {
    let mut rig = running(2);
    rig.keep(&[1, 2]);
    for _ in 0..20 {
        // The same as the last answer to the master.
        let answer = [0x60, 0x17, 0x10, 0, 0, 0, 0, 0];
        assert_eq!(rig.hear(Id::Standard(0x581), &answer), Err(Refusal::Unexpected));
    }
    assert_eq!(rig.count(|event| matches!(event, Event::DuplicateNode { .. })), 0);
    rig.runs(&[1, 2]);
}

#[test]
fn two_devices_with_one_node_id_send_twice() {
    let mut rig = running(2);
    rig.keep(&[2]);
    // A second one comes, already in operation.
    let mut other = Device::new(id(1));
    other.objects.values = rig.device(1).objects.values.clone();
    other.state = NmtState::OPERATIONAL;
    rig.devices.push(other);
    let failures =
        |rig: &Rig| rig.count(|event| matches!(event, Event::BootFailed { node, .. } if *node == id(1)));
    let states = |rig: &Rig| -> Vec<NmtState> {
        let both = rig.devices.iter().filter(|device| device.node == id(1));
        both.map(|device| device.state).collect()
    };
    let duplicate = Event::DuplicateNode { node: id(1), sign: DuplicateSign::Pdos };
    rig.until("duplicate", |rig| rig.saw(&duplicate));
    rig.run_ms(1);
    assert_eq!((failures(&rig), states(&rig)), (1, vec![NmtState::STOPPED; 2]));
    // One of them starts again. It comes up, and the start reaches both.
    let now = rig.now;
    rig.device(1).reset(now);
    rig.until("operation", |rig| rig.saw(&Event::Operational { node: id(1) }));
    rig.run_ms(40);
    assert_eq!((failures(&rig), states(&rig)), (2, vec![NmtState::STOPPED; 2]), "{:?}", rig.log);
    assert_eq!(rig.count(|event| *event == duplicate), 2);
    rig.runs(&[2]);
}

#[test]
fn somebody_has_the_masters_node_id() {
    let mut rig = running(2);
    rig.keep(&[1, 2]);
    assert_eq!(rig.hear(Id::Standard(0x77F), &[5]), Err(Refusal::UnknownNode));
    assert!(rig.saw(&Event::DuplicateNode { node: id(127), sign: DuplicateSign::Answers }));
    rig.runs(&[1, 2]);
}

mod arbitrary {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        /// No frames whatever stop the SYNC or the device that nobody speaks for.
        #[test]
        fn frames_never_panic_and_never_stop_the_others(
            frames in prop::collection::vec((0..0x800_u16, prop::collection::vec(any::<u8>(), 0..9)), 1..60),
        ) {
            let mut rig = running(2);
            rig.keep(&[2]);
            for (number, data) in frames {
                if number & 0x7F != 2 {
                    let _ = rig.hear(Id::Standard(number), &data);
                }
                rig.run_ms(1);
            }
            rig.runs(&[2]);
        }
    }
}
