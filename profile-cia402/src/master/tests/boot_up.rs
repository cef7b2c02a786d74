//! How devices come up: the order of the steps, odd devices, and the error statuses.

use super::peer::Objects;
use super::*;
use crate::sdo::request::SdoOperation;

#[test]
fn the_report_names_every_step() {
    let mut config = network(1);
    let write =
        |index, value: &[u8]| Write { object: Mux::new(index, 0), data: SdoData::inline(value).unwrap() };
    config.nodes[0].writes = vec![write(0x6060, &[8])];
    config.nodes[0].stamp = Some(Stamp { date: 15_000, time: 36_000_000 });
    config.sync = Some(SyncConfig { period_ns: 4_000_000, window_ns: 2_000_000, counter_overflow: 10 });
    let mut rig = rig(config);
    rig.master.start(rig.now);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    let report = rig.master.node(id(1)).unwrap().report.iter().map(ToString::to_string);
    insta::assert_snapshot!(report.collect::<Vec<_>>().join("\n"));
    let device = &rig.devices[0].objects;
    let numbers = [(0x1400, 1), (0x1800, 1), (0x1401, 1), (0x1803, 1), (0x1016, 1), (0x1600, 2), (0x1A00, 2)];
    assert_eq!(
        numbers.map(|(index, sub)| device.number(Mux::new(index, sub))),
        [0x201, 0x4000_0181, 0x8000_0301, 0xC000_0481, 127 << 16 | 300, TARGET.0, POSITION.0]
    );
}

#[test]
fn the_frames_of_a_start() {
    let mut rig = rig(network(2));
    rig.master.start(rig.now);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    rig.run_ms(10);
    // One reset for all, then each is started by itself.
    let nmt = |(_, frame): &(_, Frame)| {
        (frame.id() == cob_id::NMT).then(|| Nmt::parse(frame.data()).unwrap().to_string())
    };
    let commands: Vec<_> = rig.sent.iter().filter_map(nmt).collect();
    assert_eq!(commands, ["NMT reset communication all nodes", "NMT start node 1", "NMT start node 2"]);
    // SYNC goes on at its times from the first one on, while devices are configured.
    let syncs: Vec<_> =
        rig.sent.iter().filter(|(_, frame)| frame.id() == cob_id::SYNC).map(|(at, _)| at.0).collect();
    assert!(syncs.len() > 10);
    assert!(syncs.windows(2).all(|pair| pair[1] - pair[0] == 4_000_000));
    // No RPDO before its device is in operation.
    let first = |id: Id| rig.sent.iter().position(|(_, frame)| frame.id() == id).unwrap();
    let start =
        rig.sent.iter().position(|(_, frame)| frame.data() == [1, 1] && frame.id() == cob_id::NMT).unwrap();
    assert!(first(Id::Standard(0x201)) > start);
    // The master's heartbeat: boot-up first.
    let own = rig.sent.iter().filter(|(_, frame)| frame.id() == Id::Standard(0x77F));
    let own: Vec<_> = own.map(|(_, frame)| frame.data()[0]).collect();
    assert_eq!(own[..2], [0, 5]);
    assert_eq!(
        rig.log,
        [
            Event::AwaitingApplication { node: id(1), kept: false },
            Event::AwaitingApplication { node: id(2), kept: false },
            Event::Operational { node: id(1) },
            Event::Operational { node: id(2) },
            Event::NetworkOperational,
        ]
    );
}

/// A network of one device, which is given a configuration with a date and time.
fn stamped() -> MasterConfig {
    let mut config = network(1);
    config.nodes[0].writes =
        vec![Write { object: Mux::new(0x6060, 0), data: SdoData::inline(&[8]).unwrap() }];
    config.nodes[0].stamp = Some(Stamp { date: 15_000, time: 7 });
    config
}

#[test]
fn a_configuration_of_the_same_date_is_not_written_again() {
    let config = stamped();
    for (date, time, written) in [(15_000, 7, 0), (15_000, 8, 1), (14_999, 7, 1), (0, 0, 1)] {
        let mut rig = rig(config.clone());
        rig.device(1).objects.set(Mux::CONFIGURATION_DATE, date);
        rig.device(1).objects.set(Mux::CONFIGURATION_TIME, time);
        rig.master.start(rig.now);
        rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
        let objects = &rig.devices[0].objects;
        let writes = objects.writes.iter().filter(|(object, _)| object.index == 0x6060).count();
        assert_eq!(writes, written, "{date} {time}");
        assert_eq!(objects.number(Mux::CONFIGURATION_DATE), 15_000);
        // The bytes are still there for the next time.
        assert_eq!(rig.master.config().nodes[0].writes[0].data.as_slice(), [8]);
    }
}

/// What is stored comes last, may take its time, and is not stored again.
#[test]
fn a_configuration_is_stored_once() {
    let mut config = stamped();
    config.nodes[0].store = true;
    let mut rig = rig(config);
    rig.device(1).objects.values.insert(Mux::STORE, vec![0; 4]);
    rig.master.start(rig.now);
    rig.until("the stamp", |rig| rig.devices[0].objects.number(Mux::CONFIGURATION_TIME) == 7);
    rig.device(1).answer_time = DurationNs::from_millis(2_000);
    rig.until("store", |rig| rig.devices[0].objects.number(Mux::STORE) != 0);
    rig.device(1).answer_time = DurationNs::from_micros(300);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    let configured = |rig: &Rig| -> Vec<(Mux, u64)> {
        let all = rig.devices[0].objects.writes.iter();
        all.filter(|(object, _)| [0x6060, 0x1020, 0x1010].contains(&object.index)).copied().collect()
    };
    let once = [
        (Mux::new(0x6060, 0), 8),
        (Mux::CONFIGURATION_DATE, 15_000),
        (Mux::CONFIGURATION_TIME, 7),
        (Mux::STORE, 0x6576_6173),
    ];
    assert_eq!(configured(&rig), once);
    rig.master.stop(rig.now);
    rig.forget();
    rig.master.start(rig.now);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    assert_eq!(configured(&rig), once, "nothing is written and nothing stored a second time");
}

#[test]
fn what_cannot_be_told_to_be_there_is_not_stored() {
    let mut config = stamped();
    config.nodes[0].store = true;
    let mut rig = rig(config);
    rig.device(1).objects.values.insert(Mux::STORE, vec![0; 4]);
    rig.device(1).objects.values.remove(&Mux::CONFIGURATION_TIME);
    rig.master.start(rig.now);
    rig.until("failure", |rig| rig.state(1) == BootState::Failed);
    let step = "configure write 1020:02: refused with 06020000: object does not exist";
    assert_eq!(rig.failed(), (BootStatus::CONFIGURATION, step.into()));
    assert_eq!(rig.device(1).objects.number(Mux::STORE), 0);
}

/// A device whose PDOs are as they are: neither mapping nor communication parameters can be written.
#[test]
fn a_mapping_that_is_kept_is_not_written_and_must_be_the_one() {
    let fixed = |rig: &mut Rig, entry: u32| {
        let objects = &mut rig.device(1).objects;
        objects.fixed_mapping = true;
        for (communication, word) in [(0x1400, 0x201_u32), (0x1800, 0x4000_0181)] {
            for sub in [1, 2] {
                objects.refuse.insert(Mux::new(communication, sub), AbortCode::READ_ONLY);
            }
            assert_eq!(objects.number(Mux::new(communication, 1)), word);
        }
        objects.fixed = vec![
            (Mux::new(0x1400, 2), 1),
            (Mux::new(0x1800, 2), 1),
            (Mux::new(0x1A00, 0), 2),
            (Mux::new(0x1A00, 1), STATUSWORD.0),
            (Mux::new(0x1A00, 2), entry),
        ];
        objects.default_pdos(id(1));
    };
    for entry in [POSITION.0, 0x606C_0020] {
        let mut config = network(2);
        let drive = &mut config.nodes[0];
        for pdo in drive.rpdos.iter_mut().chain(&mut drive.tpdos) {
            pdo.policy = MappingPolicy::Keep;
        }
        config.nodes[0].rpdos[0].mapping = vec![CONTROLWORD];
        config.nodes[0].tpdos[0].mapping = vec![STATUSWORD, POSITION];
        let mut rig = rig(config);
        fixed(&mut rig, entry);
        rig.master.start(rig.now);
        if entry == POSITION.0 {
            rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
            let written = rig.devices[0]
                .objects
                .writes
                .iter()
                .filter(|(object, _)| (0x1600..0x1C00).contains(&object.index));
            assert_eq!(written.filter(|(object, _)| matches!(object.index, 0x1600 | 0x1A00)).count(), 0);
            rig.comes_up(&[1, 2]);
        } else {
            rig.until("failure", |rig| rig.state(1) == BootState::Failed);
            let step = "map read 1A00:02: expected 0x60640020, got 0x606c0020";
            assert_eq!(rig.failed(), (BootStatus::CONFIGURATION, step.into()));
            rig.comes_up(&[2]);
        }
    }
}

#[test]
fn every_status_has_its_cause() {
    type Case = (&'static str, fn(&mut MasterConfig), fn(&mut Device));
    let cases: [Case; 11] = [
        ("no answer", |_| {}, |device| device.mute = true),
        ("another type", |config| config.nodes[0].expected.device_type = Some(0x0001_0192), |_| {}),
        ("no type", |_| {}, |device| drop(device.objects.values.remove(&Mux::DEVICE_TYPE))),
        ("another vendor", |config| config.nodes[0].expected.vendor = Some(0x31A), |_| {}),
        ("no vendor", |_| {}, |device| drop(device.objects.values.remove(&Mux::VENDOR))),
        ("another product", |config| config.nodes[0].expected.product = Some(8), |_| {}),
        ("another revision", |config| config.nodes[0].expected.revision = Some(8), |_| {}),
        ("another serial", |config| config.nodes[0].expected.serial = Some(8), |_| {}),
        (
            "configuration refused",
            |config| {
                let data = SdoData::inline(&[1]).unwrap();
                config.nodes[0].writes = vec![Write { object: Mux::new(0x5000, 1), data }];
            },
            |_| {},
        ),
        ("no heartbeat", |_| {}, |device| device.no_heartbeat = true),
        ("not started", |_| {}, |device| device.lazy = true),
    ];
    let mut table = String::new();
    for (name, change, misdeed) in cases {
        let mut config = network(2);
        change(&mut config);
        let mut rig = rig(config);
        misdeed(rig.device(1));
        rig.master.start(rig.now);
        rig.until("failure", |rig| rig.count(|event| matches!(event, Event::BootFailed { .. })) > 0);
        let (status, step) = rig.failed();
        table += &format!("{name:<22} {status:<32} {step}\n");
        assert_eq!(rig.master.node(id(1)).unwrap().status, Some(status));
        rig.comes_up(&[2]);
        assert_eq!(rig.state(1), BootState::Failed);
    }
    insta::assert_snapshot!(table);
}

#[test]
fn odd_devices_come_up() {
    type Case = (&'static str, fn(&mut Device));
    let cases: [Case; 9] = [
        ("vendor only", |device| {
            for object in [Mux::PRODUCT, Mux::REVISION, Mux::SERIAL] {
                device.objects.values.remove(&object);
            }
        }),
        ("no 1020", |device| {
            device.objects.values.remove(&Mux::CONFIGURATION_DATE);
            device.objects.values.remove(&Mux::CONFIGURATION_TIME);
        }),
        ("no 1006, 1007, 1016", |device| {
            for object in [Mux::CYCLE_PERIOD, Mux::SYNC_WINDOW, Mux::consumer_heartbeat(1)] {
                device.objects.values.remove(&object);
            }
        }),
        ("one PDO each way, without inhibit time and event timer", |device| {
            let gone = |mux: &Mux| {
                matches!(mux.index & 0xF3FF, 0x1001..=0x1003 | 0x1201..=0x1203) && mux.index >= 0x1400
            };
            device
                .objects
                .values
                .retain(|mux, _| !(gone(mux) || mux.index == 0x1800 && [3, 5].contains(&mux.sub)));
        }),
        ("late boot-up", |device| device.boot_time = Some(DurationNs::from_millis(5_000))),
        ("no boot-up", |device| device.boot_time = None),
        ("boot-up twice", |device| device.boot_ups = 2),
        ("slow answers", |device| device.answer_time = DurationNs::from_millis(200)),
        ("bit 30 of TPDOs clear", |device| {
            for number in 0..4 {
                device.objects.set(Mux::new(0x1800 + number, 1), 0x8000_0181 + 0x100 * u32::from(number));
            }
        }),
    ];
    for (name, oddity) in cases {
        let mut config = network(2);
        config.nodes[0].stamp = Some(Stamp { date: 1, time: 1 });
        let mut rig = rig(config);
        oddity(rig.device(1));
        rig.master.start(rig.now);
        rig.until(name, |rig| rig.saw(&Event::NetworkOperational));
        rig.comes_up(&[1, 2]);
        let duplicate = Event::DuplicateNode { node: id(1), sign: DuplicateSign::BootUps };
        assert_eq!(rig.saw(&duplicate), name == "boot-up twice", "{name}");
    }
}

#[test]
fn a_device_whose_answer_comes_after_the_time_out_is_asked_again() {
    let mut rig = rig(network(1));
    rig.device(1).answer_time = DurationNs::from_millis(600);
    rig.master.start(rig.now);
    rig.until("retry", |rig| rig.state(1) == BootState::Retry);
    rig.run_ms(300);
    rig.device(1).answer_time = DurationNs::from_millis(1);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    assert_eq!(rig.count(|event| matches!(event, Event::DuplicateNode { .. })), 0, "{:?}", rig.log);
}

/// Its boot-up message crosses the stop that the master sends it: it is stopped, and has no SDO then (CiA 301, 7.3.2.2.4).
#[test]
fn a_device_that_is_stopped_while_it_boots_comes_up_again() {
    for (keep_alive, has_heartbeat) in [(false, true), (false, false), (true, true), (true, false)] {
        let mut config = network(1);
        config.nodes[0].keep_alive = keep_alive;
        let mut rig = rig(config);
        rig.master.start(rig.now);
        rig.comes_up(&[1]);
        rig.device(1).no_heartbeat = !has_heartbeat;
        rig.hear(Id::Standard(0x701), &[0x7F]).unwrap();
        rig.until("the stop", |rig| rig.devices[0].state == NmtState::STOPPED);
        rig.hear(Id::Standard(0x701), &[0]).unwrap();
        assert_eq!(rig.state(1), BootState::Identify);
        let asked_in_vain = rig.now;
        rig.until("retry", |rig| rig.state(1) == BootState::Retry);
        rig.until("an answer", |rig| !matches!(rig.state(1), BootState::Identify | BootState::Retry));
        rig.device(1).no_heartbeat = false;
        rig.comes_up(&[1]);
        let took = rig.now.since(asked_in_vain);
        assert!(took < DurationNs::from_secs(5), "{keep_alive} {has_heartbeat}: {took}");
    }
}

#[test]
fn a_device_that_may_be_in_operation_and_does_not_answer_is_left_there() {
    for silent in [true, false] {
        let mut rig = running(1);
        let mut config = network(1);
        config.nodes[0].keep_alive = true;
        rig.master = Master::new(config).unwrap();
        (rig.device(1).mute, rig.device(1).no_heartbeat) = (true, silent);
        rig.forget();
        rig.master.start(rig.now);
        rig.until("failure", |rig| rig.state(1) == BootState::Failed);
        assert!(rig.sent.iter().all(|(_, frame)| frame.id() != cob_id::NMT), "{silent}: {:?}", rig.sent);
        assert_eq!(rig.devices[0].state, NmtState::OPERATIONAL);
    }
}

/// As one that is switched on, but after its boot-up amid operation.
#[test]
fn a_device_that_falls_silent_behind_its_boot_up_is_given_up_after_its_boot_time() {
    let mut rig = running(1);
    rig.device(1).mute = true;
    let now = rig.now;
    rig.device(1).reset(now);
    rig.until("failure", |rig| rig.state(1) == BootState::Failed);
    assert_eq!((rig.failed().0, rig.now.since(now).as_nanos() / 1_000_000_000), (BootStatus::NO_ANSWER, 10));
}

#[test]
fn a_device_that_becomes_slow_is_not_taken_for_two() {
    let mut rig = rig(network(1));
    // Its first answer comes in time, every other one after its time-out.
    rig.device(1).mute = true;
    rig.master.start(rig.now);
    rig.until("identify", |rig| rig.state(1) == BootState::Identify);
    rig.hear(Id::Standard(0x581), &[0x43, 0, 0x10, 0, 0x92, 1, 2, 0]).unwrap();
    assert_eq!(rig.master.node(id(1)).unwrap().device_type, Some(0x0002_0192));
    rig.device(1).mute = false;
    rig.device(1).answer_time = DurationNs::from_millis(600);
    rig.run_ms(8_000);
    assert!(rig.master.statistics().refused(Refusal::Unexpected) >= 3);
    assert_eq!(rig.count(|event| matches!(event, Event::DuplicateNode { .. })), 0, "{:?}", rig.log);
    rig.device(1).answer_time = DurationNs::from_millis(1);
    rig.comes_up(&[1]);
}

#[test]
fn a_device_that_keeps_another_identifier_than_it_was_given_is_found_out() {
    let mut rig = rig(network(2));
    rig.master.start(rig.now);
    let valid = |rig: &Rig| CobId(rig.devices[0].objects.number(Mux::new(0x1800, 1)));
    rig.until("switched off", |rig| !valid(rig).is_valid());
    rig.until("switched on", |rig| valid(rig).is_valid());
    rig.device(1).objects.set(Mux::new(0x1800, 1), 0x4000_0182);
    rig.until("failure", |rig| rig.state(1) == BootState::Failed);
    let step = "map read 1800:01: expected 0x40000181, got 0x40000182";
    assert_eq!(rig.failed(), (BootStatus::CONFIGURATION, step.into()));
    rig.comes_up(&[2]);
}

#[test]
fn a_device_that_is_switched_on_late_comes_in() {
    let mut rig = rig(network(2));
    rig.device(1).dead = true;
    rig.master.start(rig.now);
    // It is asked until its boot time is over.
    rig.until("failure", |rig| rig.state(1) == BootState::Failed);
    assert_eq!((rig.failed().0, rig.now.0 / 1_000_000_000), (BootStatus::NO_ANSWER, 11));
    rig.comes_up(&[2]);
    rig.forget();
    rig.device(1).dead = false;
    let now = rig.now;
    rig.device(1).reset(now);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    rig.comes_up(&[1, 2]);
    assert_eq!(rig.count(|event| matches!(event, Event::Rebooted { .. })), 0);
}

#[test]
fn a_mapping_that_the_device_does_not_take() {
    for policy in [MappingPolicy::Exact, MappingPolicy::Adopt] {
        let mut config = network(2);
        config.nodes[0].tpdos[0].policy = policy;
        let mut rig = rig(config);
        // It can map nothing else than the statusword to TPDO 1.
        for sub in 0..=8 {
            rig.device(1).objects.refuse.insert(Mux::new(0x1A00, sub), AbortCode::READ_ONLY);
        }
        rig.master.start(rig.now);
        if policy == MappingPolicy::Exact {
            rig.until("failure", |rig| rig.state(1) == BootState::Failed);
            let step = "map write 1A00:00: refused with 06010002: attempt to write a read-only object";
            assert_eq!(rig.failed(), (BootStatus::CONFIGURATION, step.into()));
            rig.comes_up(&[2]);
            continue;
        }
        rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
        let adopted = Event::MappingAdopted { node: id(1), direction: Direction::Transmit, number: 1 };
        let place = |event: &Event| rig.log.iter().position(|other| other == event).unwrap();
        assert!(place(&adopted) < place(&Event::Operational { node: id(1) }));
        assert_eq!(rig.master.mapping(id(1), Direction::Transmit, 1), Some(&[STATUSWORD][..]));
        rig.comes_up(&[1, 2]);
        assert_eq!(rig.master.consumer(id(1), 1).unwrap().data, [0x27, 6]);
    }
}

/// What a device takes and has for RPDO 1 and TPDO 1, and what it is used with: the type of RPDO 1 and TPDO 1, event timer.
#[test]
fn a_transmission_type_that_the_device_does_not_take_is_followed_by_the_next_one() {
    use TransmissionType as T;
    const RPDO: &[TransmissionType] = &[T::SYNC_ON_EVENT, T::EVENT_PROFILE, T::EVENT_MANUFACTURER];
    const TPDO: &[TransmissionType] = &[T::EVENT_PROFILE, T::EVENT_MANUFACTURER];
    type Case = (&'static str, fn(&mut Objects), Result<[u32; 3], &'static str>);
    let (rpdo, tpdo) = (Mux::new(0x1400, 2), Mux::new(0x1800, 2));
    let cases: [Case; 9] = [
        ("all", |_| {}, Ok([1, 1, 0])),
        ("0, 254, 255", |it| it.take(0x1400, &[0, 254, 255]), Ok([0, 1, 0])),
        ("254", |it| it.take(0x1400, &[254]), Ok([254, 1, 0])),
        ("TPDO 255", |it| it.take(0x1800, &[255]), Ok([1, 255, 5])),
        ("TPDO 254", |it| it.take(0x1800, &[254]), Ok([1, 254, 5])),
        ("fixed", |it| it.fix(&[(0x1400, 255), (0x1800, 255)]), Ok([255, 255, 5])),
        ("fixed, each 17th", |it| it.fix(&[(0x1400, 17)]), Ok([17, 1, 0])),
        (
            "TPDO fixed, by remote frame",
            |it| it.fix(&[(0x1800, 253)]),
            Err("map read 1800:02: expected 0x1, got 0xfd"),
        ),
        (
            "no event timer",
            |it| {
                it.take(0x1800, &[255]);
                it.refuse.insert(Mux::new(0x1800, 5), AbortCode::NO_SUB_INDEX);
            },
            Err("map write 1800:05: refused with 06090011: sub-index does not exist"),
        ),
    ];
    for (name, misdeed, expected) in cases {
        let mut config = network(2);
        let drive = &mut config.nodes[0];
        drive.rpdos[0].others = RPDO;
        drive.tpdos[0].others = TPDO;
        (drive.tpdos[0].event_timer_ms, drive.tpdos[0].deadline_ms) = (5, 10);
        let mut rig = rig(config);
        misdeed(&mut rig.device(1).objects);
        rig.master.start(rig.now);
        let Ok(expected) = expected else {
            rig.until("failure", |rig| rig.state(1) == BootState::Failed);
            assert_eq!(rig.failed(), (BootStatus::CONFIGURATION, expected.unwrap_err().into()), "{name}");
            rig.comes_up(&[2]);
            continue;
        };
        rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
        let has = |object| rig.devices[0].objects.number(object);
        assert_eq!([has(rpdo), has(tpdo), has(Mux::new(0x1800, 5))], expected, "{name}");
        let wanted = T::EVERY_SYNC;
        let told: Vec<_> = [(Direction::Receive, expected[0]), (Direction::Transmit, expected[1])]
            .into_iter()
            .filter(|(_, found)| *found != 1)
            .map(|(direction, found)| Event::TransmissionAdopted {
                node: id(1),
                direction,
                number: 1,
                wanted,
                found: TransmissionType(u8::try_from(found).unwrap()),
            })
            .collect();
        let said: Vec<_> =
            rig.log.iter().filter(|event| matches!(event, Event::TransmissionAdopted { .. })).collect();
        assert_eq!(said, told.iter().collect::<Vec<_>>(), "{name}");
        rig.comes_up(&[1, 2]);
    }
}

/// Each time that it comes into operation it restarts: it is set up less and less often, the other one goes on, and it comes
/// back when it stays.
#[test]
fn a_device_that_restarts_again_and_again_is_left_alone_for_longer_and_longer() {
    let mut rig = running(2);
    rig.keep(&[2]);
    let begin = rig.now;
    let mut boot_ups = 0_u64;
    while rig.now.since(begin) < DurationNs::from_secs(60) {
        if rig.state(1) == BootState::Operational {
            rig.run_ms(100);
            let now = rig.now;
            rig.device(1).reset(now);
            boot_ups += 1;
        }
        rig.run_ms(50);
    }
    let pauses: Vec<_> = rig
        .log
        .iter()
        .filter_map(|event| match event {
            Event::LeftAlone { node, times, pause } if *node == id(1) => {
                Some((*times, pause.0 / 1_000_000_000))
            }
            _ => None,
        })
        .collect();
    assert_eq!(pauses, [(3, 1), (4, 2), (5, 4), (6, 8), (7, 16), (8, 32)]);
    assert_eq!(boot_ups, 8, "every 0.5 s these were more than 100");
    rig.until("the other one again", |rig| rig.state(1) == BootState::Operational);
    rig.run_ms(11_000);
    rig.forget();
    let now = rig.now;
    rig.device(1).reset(now);
    rig.until("operation", |rig| rig.saw(&Event::Operational { node: id(1) }));
    assert_eq!(rig.count(|event| matches!(event, Event::LeftAlone { .. })), 0, "it was sound");
    let text = Event::LeftAlone { node: id(1), times: 4, pause: DurationNs::from_secs(2) }.to_string();
    assert_eq!(
        text,
        "node 1 has restarted or was lost 4 times without being in operation for 10 s; it is left alone for 2 s"
    );
}

#[test]
fn what_an_adopted_transmission_type_means_is_said() {
    let said = |direction, found| {
        let wanted = TransmissionType::EVERY_SYNC;
        Event::TransmissionAdopted {
            node: id(3),
            direction,
            number: 2,
            wanted,
            found: TransmissionType(found),
        }
        .to_string()
    };
    assert_eq!(
        said(Direction::Receive, 0),
        "node 3 does not take transmission type 1 for RPDO 2 (1401:02), and has 0"
    );
    assert_eq!(
        said(Direction::Receive, 255),
        "node 3 does not take transmission type 1 for RPDO 2 (1401:02), and has 255; it counts as soon as it is there, and is sent a cycle later"
    );
    assert_eq!(
        said(Direction::Transmit, 254),
        "node 3 does not take transmission type 1 for TPDO 2 (1801:02), and has 254; it comes by its event timer, not at SYNC"
    );
}

/// Nothing is written to a device that is no drive.
#[test]
fn a_device_of_another_profile_is_told_by_its_type_before_anything_is_written() {
    for (device_type, comes_up) in
        [(0x0002_0192, true), (0xFFFF_0192, true), (0x0002_0191, false), (0x0022_0811, false), (0, false)]
    {
        let mut config = network(2);
        config.nodes[0].expected = Expected { profile: Some(0x192), ..Expected::default() };
        let data = SdoData::inline(&[1]).unwrap();
        config.nodes[0].writes = vec![Write { object: Mux::new(0x6060, 0), data }];
        let mut rig = rig(config);
        rig.device(1).objects.set(Mux::DEVICE_TYPE, device_type);
        rig.master.start(rig.now);
        if comes_up {
            rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
            continue;
        }
        rig.until("failure", |rig| rig.state(1) == BootState::Failed);
        let expected = device_type & 0xFFFF_0000 | 0x192;
        let step = format!("identify read 1000:00: expected {expected:#x}, got {device_type:#x}");
        assert_eq!(rig.failed(), (BootStatus::DEVICE_TYPE, step));
        assert_eq!(rig.devices[0].objects.writes, []);
        rig.comes_up(&[2]);
    }
}

#[test]
fn a_device_that_keeps_another_mapping_than_it_says_is_found_out() {
    let mut rig = rig(network(2));
    rig.device(1).objects.values.insert(Mux::new(0x1A00, 2), vec![0; 4]);
    rig.master.start(rig.now);
    rig.until("map", |rig| rig.state(1) == BootState::Map);
    rig.until("count", |rig| rig.devices[0].objects.number(Mux::new(0x1A00, 0)) == 2);
    rig.device(1).objects.set(Mux::new(0x1A00, 2), 0x6064_0010);
    rig.until("failure", |rig| rig.state(1) == BootState::Failed);
    let step = "map read 1A00:02: expected 0x60640020, got 0x60640010";
    assert_eq!(rig.failed(), (BootStatus::CONFIGURATION, step.into()));
    rig.comes_up(&[2]);
}

#[test]
fn the_application_works_before_pdos_are_configured() {
    let mut rig = rig(network(2));
    rig.auto = false;
    rig.master.start(rig.now);
    rig.until("await", |rig| rig.state(1) == BootState::Await && rig.state(2) == BootState::Await);
    let name = SdoRequest::upload(Mux::new(0x1008, 0));
    let ticket = rig.master.sdo_submit(id(1), name, Priority::Normal).unwrap();
    let mode = SdoRequest::download_number(Mux::new(0x6060, 0), 8, 1);
    rig.master.sdo_submit(id(1), mode, Priority::Urgent).unwrap();
    let absent =
        rig.master.sdo_submit(id(1), SdoRequest::upload(Mux::new(0x5555, 0)), Priority::Normal).unwrap();
    // PDOs can be chosen by what the device has told.
    let rpdos = vec![PdoConfig::cyclic(2, vec![CONTROLWORD])];
    let config = rig.master.config().clone();
    let set = |node, rpdos, tpdos| PdoSet::new(&config, id(node), rpdos, tpdos);
    let chosen = set(2, rpdos, vec![PdoConfig::cyclic(3, vec![POSITION])]).unwrap();
    let had = rig.master.set_pdos(chosen).unwrap();
    assert_eq!(had.pdos(Direction::Receive), config.nodes[1].pdos(Direction::Receive));
    let twice = vec![PdoConfig::cyclic(1, vec![CONTROLWORD]); 2];
    assert!(matches!(set(2, twice, vec![]), Err(CallError::Config(_))));
    assert!(matches!(set(3, vec![], vec![]), Err(CallError::NoNode)));
    // Made for a network without the first device, it would take what that one has.
    let alone = MasterConfig { nodes: config.nodes[1..].to_vec(), ..config.clone() };
    let theirs = config.nodes[0].tpdos[0].id(Direction::Transmit, id(1));
    let stolen = PdoConfig { id: theirs, ..PdoConfig::cyclic(3, vec![POSITION]) };
    let stolen = PdoSet::new(&alone, id(2), vec![], vec![stolen]).unwrap();
    let (error, _) = rig.master.set_pdos(stolen).unwrap_err();
    assert!(matches!(error, CallError::Config(ConfigError::Pdo { reason: PdoError::Id, number: 3, .. })));
    for node in [1, 2] {
        rig.master.node_ready(id(node)).unwrap();
    }
    let none = set(2, vec![], vec![]).unwrap();
    assert!(matches!(rig.master.set_pdos(none), Err((CallError::State(BootState::Await), _))));
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    let outcomes: Vec<_> = rig
        .log
        .iter()
        .filter_map(|event| match event {
            Event::Sdo { ticket, outcome } => Some((*ticket, outcome.clone())),
            _ => None,
        })
        .collect();
    // The urgent one went first.
    assert_eq!(outcomes[0].1.operation, SdoOperation::Download);
    assert_eq!((outcomes[1].0, outcomes[1].1.data.as_slice().len()), (ticket, 61));
    assert_eq!(
        (outcomes[2].0, outcomes[2].1.result),
        (absent, Err(SdoFailure::Refused(AbortCode::NO_OBJECT)))
    );
    rig.run_ms(20);
    assert_eq!(rig.master.consumer(id(2), 3).unwrap().data, [0x27, 6, 1, 2]);
    assert!(rig.master.consumer(id(2), 1).is_none());
    // Requests are carried in operation too, between the PDOs.
    let status = SdoRequest::upload(Mux::new(0x6060, 0));
    rig.forget();
    rig.master.sdo_submit(id(1), status, Priority::Normal).unwrap();
    rig.until("answer", |rig| rig.count(|event| matches!(event, Event::Sdo { .. })) == 1);
    rig.runs(&[1]);
}

#[test]
fn requests_go_only_where_somebody_answers() {
    let mut rig = rig(network(1));
    let ask = |rig: &mut Rig, node| {
        rig.master.sdo_submit(id(node), SdoRequest::upload(Mux::VENDOR), Priority::Normal)
    };
    assert_eq!(ask(&mut rig, 1).unwrap_err().0, SubmitError::State(BootState::Off));
    assert_eq!(ask(&mut rig, 9).unwrap_err().0, SubmitError::NoNode);
    rig.auto = false;
    rig.master.start(rig.now);
    rig.until("await", |rig| rig.state(1) == BootState::Await);
    for _ in 0..QUEUE_MAX {
        ask(&mut rig, 1).unwrap();
    }
    assert_eq!(ask(&mut rig, 1).unwrap_err().0, SubmitError::Full);
    // The device goes: every request ends.
    let now = rig.now;
    rig.device(1).reset(now);
    rig.run_ms(100);
    let lost = |event: &Event| matches!(event, Event::Sdo { outcome, .. } if outcome.result == Err(SdoFailure::NodeLost));
    let done = |event: &Event| matches!(event, Event::Sdo { outcome, .. } if outcome.result.is_ok());
    assert_eq!(rig.count(lost) + rig.count(done), QUEUE_MAX);
    assert!(rig.count(lost) > 0);
    assert!(rig.saw(&Event::Rebooted { node: id(1), operational: false }));
}

#[test]
fn devices_start_together_if_that_is_wanted() {
    let mut config = network(3);
    config.start = StartPolicy::Together;
    config.nodes[2].mandatory = false;
    let mut rig = rig(config);
    rig.device(2).boot_time = Some(DurationNs::from_millis(3_000));
    rig.device(2).mute = true;
    rig.device(3).dead = true;
    rig.master.start(rig.now);
    rig.run_ms(2_900);
    assert_eq!(rig.state(1), BootState::Ready);
    rig.device(2).mute = false;
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    rig.comes_up(&[1, 2]);
}

#[test]
fn a_mandatory_device_that_fails_stops_or_resets_the_others_if_that_is_wanted() {
    for policy in [MandatoryError::Report, MandatoryError::StopAll, MandatoryError::ResetAll] {
        let mut config = network(2);
        config.mandatory_error = policy;
        let mut rig = rig(config);
        rig.master.start(rig.now);
        rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
        rig.forget();
        rig.device(1).dead = true;
        rig.until("loss", |rig| rig.saw(&Event::HeartbeatLost { node: id(1) }));
        rig.run_ms(1);
        let (state, command): (_, Option<&[u8]>) = match policy {
            MandatoryError::Report => (BootState::Operational, None),
            MandatoryError::StopAll => (BootState::Off, Some(&[2, 0])),
            MandatoryError::ResetAll => (BootState::Resetting, Some(&[130, 2])),
        };
        assert_eq!(rig.state(2), state, "{policy:?}");
        let sent =
            |data: &[u8]| rig.sent.iter().any(|(_, frame)| frame.id() == cob_id::NMT && frame.data() == data);
        assert!(command.is_none_or(sent), "{policy:?}");
    }
}

#[test]
fn a_device_in_operation_may_stay_so() {
    let mut rig = running(2);
    let mut config = network(2);
    config.nodes[0].keep_alive = true;
    // The master alone starts again.
    rig.master = Master::new(config).unwrap();
    rig.device(1).objects.writes.clear();
    rig.master.start(rig.now);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    assert!(rig.saw(&Event::AwaitingApplication { node: id(1), kept: true }));
    assert_eq!(rig.master.node(id(1)).unwrap().status, Some(BootStatus::ALREADY_OPERATIONAL));
    // Nothing was written to it, and it was not reset.
    assert_eq!(rig.device(1).objects.writes, []);
    let reset: Vec<_> =
        rig.sent.iter().filter(|(_, frame)| frame.id() == cob_id::NMT).map(|(_, f)| f.data()[1]).collect();
    assert_eq!(reset.iter().filter(|&&node| node == 0).count(), 0);
    rig.comes_up(&[1, 2]);
    // One that has another mapping does not stay.
    rig.device(1).objects.set(Mux::new(0x1A00, 1), 0x6061_0010);
    let mut config = network(2);
    config.nodes[0].keep_alive = true;
    rig.master = Master::new(config).unwrap();
    rig.forget();
    rig.master.start(rig.now);
    rig.until("failure", |rig| rig.state(1) == BootState::Failed);
    assert_eq!(rig.failed().1, "map read 1A00:01: expected 0x60410010, got 0x60610010");
    rig.run_ms(1);
    assert_eq!(rig.device(1).state, NmtState::STOPPED);
}

#[test]
fn a_device_that_does_not_tell_its_state_is_taken_out_of_operation_to_be_configured() {
    let mut rig = running(1);
    let mut config = network(1);
    config.nodes[0].keep_alive = true;
    rig.master = Master::new(config).unwrap();
    // It does not tell that it is in operation.
    rig.device(1).no_heartbeat = true;
    rig.master.start(rig.now);
    rig.until("await", |rig| rig.state(1) == BootState::Map);
    assert_eq!(rig.device(1).state, NmtState::PRE_OPERATIONAL);
    rig.device(1).no_heartbeat = false;
    rig.comes_up(&[1]);
    assert!(rig.saw(&Event::AwaitingApplication { node: id(1), kept: false }));
}
