//! SERCOS drives like those of backups: with their settings, and with no others.

use std::fmt::Write as _;

use axisbridge::simulate::drive_events::setup::Setup;
use axisbridge::simulate::drives::{DriveLine, DriveNetwork, LineKind};
use axisbridge::simulate::sercos_twin::Twin;
use axisbridge_tests::rig::motion::millis;
use axisbridge_tests::rig::motion_checker::MotionChecker;
use axisbridge_tests::rig::{Rig, Settings};
use profile_cip::controller::{Limits, Step};
use profile_cip::wire::motion::codes::ControlMode;
use profile_generic::scaling::UnitKind;
use profile_sercos::wire::idn::Idn;

use super::{AXIS, does};

const BOX: &str = r#"
[box]
name = "backup"

[[device]]
name = "front"
listen = "10.0.0.2"
axes = ["axis"]
update_period = { min = "4 ms", max = "32 ms" }

[device.identity]
vendor_id = 65_000
product_code = 1001
serial_number = 0x0041_4201
product_name = "Axisbridge backup"

[[axis]]
name = "axis"
instance = 1
drive = "drive"
unit = "revolution"
motion_resolution = 1_000_000

[axis.limits]
following_error = 0.5

[south.sercos]
interface = "in-process"
cycle_time = "2 ms"
jitter = "100 us"

[[south.sercos.drive]]
name = "drive"
address = 1
"#;

/// Position counts in a revolution of the drive in the backup.
const RESOLUTION: u32 = 720_000;

/// The backup of a drive: all settings of the simulated one but for those left out, with another resolution, and one of its maker.
fn backup(left_out: &[Idn]) -> String {
    let mut line =
        DriveLine::new([(1, UnitKind::Rotary)], false, &LineKind::Plain, &Setup::default()).expect("a drive");
    let store = line.network_mut().slaves()[0].store();
    let list = store.get(store.find(Idn::IDN_LIST_OF_ALL_BACKUP_OPERATION_DATA).expect("every drive has it"));
    let mut text = "format = 1\naxis = \"axis\"\nbus = \"sercos\"\nsource = \"S-0-0192\"\n\n[drive]\ndevice_id = \"TW-1\"\n".to_owned();
    let mut add = |idn: Idn, attribute: u32, data: &[u8]| {
        let data: String = data.iter().map(|byte| format!("{byte:02x}")).collect();
        let _ = write!(
            text,
            "\n[[parameter]]\nid = \"{idn}\"\nattribute = \"{attribute:#010x}\"\ndata = \"{data}\"\n"
        );
    };
    for idn in list.data().chunks(4) {
        let idn = Idn(u32::from_le_bytes([idn[0], idn[1], idn[2], idn[3]]));
        let parameter = store.get(store.find(idn).expect("it is listed"));
        match idn {
            idn if left_out.contains(&idn) => {}
            Idn::ROTATIONAL_POSITION_RESOLUTION => {
                add(idn, parameter.attribute().0, &RESOLUTION.to_le_bytes());
            }
            // Rotary, by parameters.
            Idn::POSITION_DATA_SCALING_TYPE => add(idn, parameter.attribute().0, &[0x0A, 0]),
            idn => add(idn, parameter.attribute().0, parameter.data()),
        }
    }
    add("P-0-4011".parse().expect("an IDN"), 0x0011_0001, &[7, 0]);
    text
}

fn line(text: &str) -> DriveNetwork {
    let twin = Twin::parse(text).expect("a backup of a SERCOS drive");
    DriveLine::like([(1, UnitKind::Rotary)], false, &LineKind::Plain, &Setup::default(), Some(&twin))
        .expect("a drive that works")
        .into_network()
}

#[test]
fn a_drive_like_that_of_a_backup_is_commissioned_with_its_scaling_and_moved() {
    let window = Idn::MONITORING_WINDOW;
    let settings = Settings {
        configuration: BOX.to_owned(),
        drives: vec![(1, UnitKind::Rotary)],
        ..Settings::default()
    };
    let mut rig = Rig::new(settings);
    rig.motion_checker = MotionChecker::default();
    rig.line = line(&backup(&[window]));
    rig.until_ready();
    rig.run_for(millis(200));
    let start = rig.line.slaves()[0].application().servo().position().0;
    let steps = vec![
        Step::Enable(AXIS),
        Step::MoveRelative {
            axis: 1,
            distance: 1.0,
            limits: Limits { velocity: 1.0, acceleration: 4.0, jerk: 40.0 },
        },
        Step::Dwell { seconds: 0.5 },
    ];
    assert!(does(&mut rig, ControlMode::POSITION, steps, 20_000, |_| {}), "{}\n{}", rig.told(), rig.log());
    let slave = &rig.line.slaves()[0];
    let store = slave.store();
    let went = slave.application().servo().position().0 - start;
    assert!((went - 1_000_000_000).abs() < 2_000_000, "{went}");
    assert_eq!(store.number_of(Idn::ROTATIONAL_POSITION_RESOLUTION), i64::from(RESOLUTION));
    assert_eq!(store.number_of("P-0-4011".parse().expect("an IDN")), 7);
    assert!(store.find(window).is_none());
    // The limit of the configuration is watched by the box alone, which says so.
    assert!(rig.told().contains("S-0-0159"), "{}", rig.told());
}
