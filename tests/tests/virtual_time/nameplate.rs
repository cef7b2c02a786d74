//! Data of motor and power stage that the drive does not show and the configuration has.

use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::{BOX, Rig, Settings};

use super::settings::stopped;

const GET: u8 = 0x0E;
const SET: u8 = 0x10;
const OK: u8 = 0;
const INVALID_VALUE: u8 = 0x09;
const NOT_SUPPORTED: u8 = 0x14;

const OUTPUT_POWER: u16 = 603;
const BUS_VOLTAGE_NOMINAL: u16 = 621;
const RATED_VOLTAGE: u16 = 1318;
const RATED_CURRENT: u16 = 1319;
const RATED_POWER: u16 = 1321;
const RESISTANCE: u16 = 1327;
const RATED_TORQUE: u16 = 1339;

/// The nameplate of the turntable.
const NAMEPLATE: &str = "motor = { rated_torque = 2.4, rated_current = 9.9, rated_voltage = 230.0, rated_power = 0.75, \
                         resistance = 1.25 }\nconverter = { bus_voltage = 325.0 }\n";

fn rig(configuration: &str, nameplate: &str) -> (Rig, Client) {
    let configuration = configuration.replacen("instance = 1\n", &format!("instance = 1\n{nameplate}"), 1);
    let settings = match configuration.contains("[south.sercos]") {
        true => Settings { configuration, ..Settings::default() },
        false => Settings::without_line(configuration),
    };
    stopped(Rig::ready(settings))
}

#[test]
fn data_of_the_configuration_are_read_and_compared() {
    for (bus, configuration) in [("SERCOS", BOX), ("CANopen", include_str!("can.toml"))] {
        let (mut rig, client) = rig(configuration, NAMEPLATE);
        let mut ask = |service, id, value: &[u8]| client.ask(&mut rig, service, 1, Some(id), value);
        for (id, value) in [
            (RATED_VOLTAGE, 230.0_f32),
            (RATED_POWER, 0.75),
            (RESISTANCE, 1.25),
            (BUS_VOLTAGE_NOMINAL, 325.0),
        ] {
            assert_eq!(ask(GET, id, &[]), (OK, value.to_le_bytes().to_vec()), "{bus} {id}");
            if id == BUS_VOLTAGE_NOMINAL {
                continue;
            }
            for (other, status) in [(value, OK), (value * 1.0005, OK), (value * 1.1, INVALID_VALUE)] {
                assert_eq!(ask(SET, id, &other.to_le_bytes()).0, status, "{bus} {id} {other}");
            }
            assert_eq!(ask(GET, id, &[]), (OK, value.to_le_bytes().to_vec()), "{bus} {id}: as it was");
        }
        // The drive says otherwise, and it is the drive's.
        let current = f32::from_le_bytes(ask(GET, RATED_CURRENT, &[]).1.try_into().expect("a REAL"));
        assert!((current - 9.9).abs() > 0.1, "{bus}: {current}");
        let said = "attribute 1327 cannot be set to 1.375: the configuration has 1.25";
        assert!(rig.told().contains(said), "{bus}: {}", rig.told());
        // That is said once, and of nothing else.
        let held = (current * 1_000_000.0).round();
        let other = format!(
            "motor_rated_current: the configuration has 9900000 uA, the drive {held} uA, which counts"
        );
        assert_eq!(rig.told().matches(&other).count(), 1, "{bus}: {}", rig.told());
        let others = rig.told().matches(", which counts").count();
        assert_eq!(
            others,
            if bus == "SERCOS" { 1 } else { 2 },
            "{bus}: the rated torque of a CANopen drive too"
        );
    }
}

/// Gains that the drive does not show: an axis without them does not have the attributes. Of a SERCOS drive that shows its own, those
/// count.
#[test]
fn gains_of_the_configuration_are_compared() {
    const ALL: &str = "loops = { position_gain = 50.0, position_integral_gain = 2.5, velocity_gain = 400.0, velocity_integral_gain = 80.0, \
                       velocity_feed_forward = 100.0 }\n";
    let gains = [(440, 100.0_f32), (441, 50.0), (442, 2.5), (461, 400.0), (462, 80.0)];
    let (mut bare, client) = rig(include_str!("can.toml"), "");
    for (id, _) in gains {
        let expected = if id == 442 { OK } else { NOT_SUPPORTED };
        assert_eq!(client.ask(&mut bare, GET, 1, Some(id), &[]).0, expected, "{id}: nobody knows");
    }
    for (bus, configuration) in [
        ("SERCOS", BOX),
        ("CANopen", include_str!("can.toml")),
        ("DeviceNet", include_str!("devicenet.toml")),
    ] {
        let (mut rig, client) = rig(configuration, ALL);
        let shown = if bus == "SERCOS" { &[440, 441, 462][..] } else { &[] };
        for (id, value) in gains.into_iter().filter(|(id, _)| !shown.contains(id)) {
            let mut ask = |service, value: &[u8]| client.ask(&mut rig, service, 1, Some(id), value);
            let held = (OK, value.to_le_bytes().to_vec());
            assert_eq!(ask(GET, &[]), held, "{bus} {id}");
            for (other, status) in
                [(value, OK), (value * 1.0005, OK), (value * 1.1, INVALID_VALUE), (0.0, INVALID_VALUE)]
            {
                assert_eq!(ask(SET, &other.to_le_bytes()).0, status, "{bus} {id} {other}");
            }
            assert_eq!(ask(SET, &f32::NAN.to_le_bytes()).0, INVALID_VALUE, "{bus} {id}");
            assert_eq!(ask(GET, &[]), held, "{bus} {id}: as it was");
        }
        let said = "attribute 461 cannot be set to 440: the configuration has 400";
        assert!(rig.told().contains(said), "{bus}: {}", rig.told());
        // S-0-0101 of this drive is 10 ms, which are 100 rad/s.
        let other =
            "velocity_integral_time: the configuration has 12500000 ns, the drive 10000000 ns, which counts";
        let told = rig.told().matches(other).count();
        assert_eq!(told, usize::from(bus == "SERCOS"), "{bus}: {}", rig.told());
        for id in shown {
            assert_eq!(client.ask(&mut rig, GET, 1, Some(*id), &[]).0, OK, "{bus} {id}");
        }
        if let Some(id) = shown.last() {
            let (status, value) = client.ask(&mut rig, GET, 1, Some(*id), &[]);
            assert_eq!((status, value), (OK, 100.0_f32.to_le_bytes().to_vec()), "{bus}: of the drive");
        }
    }
}

/// The power of a SERCOS drive needs the rated torque, which its profile does not have.
#[test]
fn data_of_the_configuration_are_computed_with() {
    let (mut rig, client) = rig(BOX, "");
    for id in [OUTPUT_POWER, RATED_TORQUE, RATED_VOLTAGE] {
        assert_eq!(client.ask(&mut rig, GET, 1, Some(id), &[]).0, NOT_SUPPORTED, "{id}: nobody knows");
    }
    let (mut rig, client) = self::rig(BOX, NAMEPLATE);
    assert_eq!(client.ask(&mut rig, GET, 1, Some(RATED_TORQUE), &[]), (OK, 2.4_f32.to_le_bytes().to_vec()));
    assert_eq!(client.ask(&mut rig, GET, 1, Some(OUTPUT_POWER), &[]).0, OK);
}

/// Each kind of motor has data of its own: those are compared, and those of the others are given back or absent, as without a nameplate.
#[test]
fn motors_of_all_kinds_are_compared() {
    const LINEAR: &str = "motor = { type = \"linear-permanent-magnet\", pole_pitch = 24.0, rated_speed = 2.5, max_speed = 5.0, inertia = 3.5, \
                          rated_torque = 200.0, torque_constant = 60.5, voltage_constant = 35.0 }\nencoder = { startup = \"absolute\", \
                          length = 1500.0 }\n";
    const INDUCTION: &str = "motor = { type = \"rotary-induction\", rated_frequency = 50.0, flux_current = 1.25, stator_resistance = 2.25 }\n";
    let real = |value: f32| value.to_le_bytes().to_vec();
    let linear = [
        (1315, vec![3]),
        (1316, vec![1]),
        (1334, real(0.024)),
        (1335, real(2.5)),
        (1336, real(3.5)),
        (1337, real(5.0)),
        (679, real(5.0)),
        (1342, real(200.0)),
        (1343, real(60.5)),
        (1344, real(35.0)),
        (1415, vec![1]),
        (1419, real(1.5)),
    ];
    let induction =
        [(1315, vec![2]), (1316, vec![0]), (1345, real(50.0)), (1346, real(1.25)), (1347, real(2.25))];
    for (nameplate, values) in [(LINEAR, &linear[..]), (INDUCTION, &induction[..])] {
        for (bus, configuration) in [("SERCOS", BOX), ("CANopen", include_str!("can.toml"))] {
            let (mut rig, client) = rig(configuration, nameplate);
            for (id, value) in values {
                assert_eq!(client.ask(&mut rig, GET, 1, Some(*id), &[]), (OK, value.clone()), "{bus} {id}");
                // Only read.
                if *id == 679 {
                    continue;
                }
                assert_eq!(client.ask(&mut rig, SET, 1, Some(*id), value).0, OK, "{bus} {id}");
                let mut other = value.clone();
                *other.last_mut().expect("a value") ^= 1;
                let status = client.ask(&mut rig, SET, 1, Some(*id), &other).0;
                assert_eq!(status, INVALID_VALUE, "{bus} {id} {other:02X?}");
                assert_eq!(client.ask(&mut rig, GET, 1, Some(*id), &[]), (OK, value.clone()), "{bus} {id}");
            }
        }
    }
}

/// What is fixed for an axis, whatever is configured.
#[test]
fn what_is_the_same_for_each_axis_is_compared() {
    let (mut rig, client) = rig(BOX, "power_structure_axis_id = 77\n");
    assert_eq!(client.ask(&mut rig, GET, 1, Some(725), &[]), (OK, 77_u32.to_le_bytes().to_vec()));
    assert_eq!(client.ask(&mut rig, GET, 2, Some(725), &[]), (OK, vec![0; 4]), "not checked");
    for (id, value) in [(43, 1), (614, 0), (750, 0)] {
        assert_eq!(client.ask(&mut rig, GET, 1, Some(id), &[]), (OK, vec![value]), "{id}");
        assert_eq!(client.ask(&mut rig, SET, 1, Some(id), &[value]).0, OK, "{id}");
        assert_eq!(client.ask(&mut rig, SET, 1, Some(id), &[value ^ 1]).0, INVALID_VALUE, "{id}");
    }
    for id in [1400, 1401] {
        assert_eq!(client.ask(&mut rig, GET, 1, Some(id), &[]), (OK, vec![0]), "{id}: no text");
    }
}
