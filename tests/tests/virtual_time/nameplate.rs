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
