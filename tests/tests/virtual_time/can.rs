//! The whole chain with CANopen drives: a bus with arbitration and bit times between the box and simulated CiA 402 drives.

use axisbridge::simulate::program::{self, AxisPlan};
use axisbridge_tests::rig::motion::{NANO, millis};
use axisbridge_tests::rig::{Rig, Settings};
use profile_cia402::drive::Statusword;
use profile_cia402::node::drive::Axis;
use profile_generic::image::FeedbackSet;

/// Two devices with one axis each at 4 ms.
const BOX: &str = include_str!("can.toml");

fn settings() -> Settings {
    Settings::without_line(BOX)
}

/// The same with a key of the turntable's drive.
fn with_key(key: &str) -> Settings {
    let mut settings = settings();
    let drive = "name = \"drive-a\"\nnode = 1\n";
    assert!(settings.configuration.contains(drive));
    settings.configuration = settings.configuration.replace(drive, &format!("{drive}{key}\n"));
    settings
}

fn axis(rig: &Rig, device: usize) -> &Axis {
    &rig.can[0].bus.nodes().nth(device).expect("a device").application().axes()[0]
}

#[test]
fn two_axes_go_where_the_controller_sends_them() {
    let mut rig = Rig::ready(settings());
    let plans = [AxisPlan::new(1, 2.0, 600.0, 0.002, 6.0), AxisPlan::new(2, 40.0, 700.0, 0.02, 6.0)];
    rig.connect(program::standard(&plans, 6.0));
    let report = rig.run(millis(60_000));
    assert!(report.failure.is_none(), "{report:?}\n{}\n{}", rig.log(), rig.told());
    for (device, (plan, unit)) in plans.iter().zip([1.0, 5.0]).enumerate() {
        #[allow(clippy::cast_precision_loss)]
        let position = axis(&rig, device).actual().position.get() as f64 / 1e9 * unit;
        assert!((position - plan.target).abs() < plan.window, "{position} is not {}", plan.target);
    }
    rig.can[0].bus.bus_mut().judge();
    assert!(rig.torque_free());
}

/// A drive that sends no velocity: the box takes it from the position, and knows when the axis stands.
#[test]
fn the_velocity_of_a_drive_that_does_not_tell_it_follows_from_its_positions() {
    let mut rig = Rig::ready(with_key("actual_values = [\"torque\"]"));
    let told = |rig: &Rig| *rig.engine.axes()[0].feedback();
    let plans = [AxisPlan::new(1, 2.0, 600.0, 0.002, 6.0), AxisPlan::new(2, 40.0, 700.0, 0.02, 6.0)];
    rig.connect(program::standard(&plans, 6.0));
    rig.run_until(millis(20_000), "the turntable in motion", |rig| {
        axis(rig, 0).actual().velocity.get() > NANO
    });
    for _ in 0..50 {
        rig.run_for(millis(4));
        let (actual, told) = (axis(&rig, 0).actual().velocity.get(), told(&rig));
        assert!(told.present.contains(FeedbackSet::VELOCITY));
        // Three cycles of 4 ms old at most, of an axis that speeds up by some turns a second squared.
        assert!((told.velocity.get() - actual).abs() < NANO / 5, "{} is not {actual}", told.velocity.get());
    }
    let report = rig.run(millis(60_000));
    assert!(report.failure.is_none(), "{report:?}\n{}\n{}", rig.log(), rig.told());
    assert!(told(&rig).velocity.get().abs() < NANO / 1000, "it stands: {}", told(&rig).velocity.get());
    assert!(rig.torque_free());
}

/// The turntable's drive holds bits of its statusword; whether it goes where it is sent, and the state of the axis where it does not.
fn goes_with(key: &str, bits: Statusword, value: Statusword) -> Result<(), String> {
    let mut rig = Rig::new(with_key(key));
    rig.can[0].bus.nodes_mut().next().expect("the turntable").application_mut().axes_mut()[0]
        .hold_status_bits(bits, value);
    rig.run_for(millis(3_000));
    let plans = [AxisPlan::new(1, 2.0, 600.0, 0.002, 6.0), AxisPlan::new(2, 40.0, 700.0, 0.02, 6.0)];
    rig.connect(program::standard(&plans, 6.0));
    let report = rig.run(millis(60_000));
    let stands = axis(&rig, 0).actual().position.get();
    match report.failure {
        None => {
            #[allow(clippy::cast_precision_loss)]
            let stands = stands as f64 / 1e9;
            assert!((stands - plans[0].target).abs() < plans[0].window, "{stands}");
            Ok(())
        }
        Some(failure) => {
            assert_eq!(stands, 0, "{failure}");
            Err(format!("{failure}\n{}", rig.told()))
        }
    }
}

/// maxon EPOS: bit 4 shows that the stage is on, 0121 is a drive that is ready. Other makers keep it at 0 for ever.
#[test]
fn a_drive_that_is_ready_is_ready_whatever_bit_4_says() {
    let bit = Statusword::VOLTAGE_ENABLED;
    assert_eq!(goes_with("", bit, Statusword::empty()), Ok(()));
    assert_eq!(goes_with("", bit, bit), Ok(()));
    assert_eq!(goes_with("voltage_bit = \"ignore\"", bit, Statusword::empty()), Ok(()));
    // Said to be the supply of the stage, it is waited for.
    let waits = goes_with("voltage_bit = \"dc-link\"", bit, Statusword::empty()).expect_err("no supply");
    assert!(waits.contains("Pre-Charge"), "{waits}");
    let said =
        "has waited 1 s for its drive to be ready, or for main power; 6041:00 = 0221, expected bit 4 = 1";
    assert!(waits.contains(said), "{waits}");
    assert_eq!(goes_with("voltage_bit = \"dc-link\"", bit, bit), Ok(()));
}

/// Bit 12 is 0 in drives that do not have it, and 1 all the time in others: without the key nobody asks for it.
#[test]
fn bit_12_is_waited_for_only_where_the_configuration_says_that_the_drive_keeps_it() {
    let bit = Statusword::FOLLOWS_COMMAND;
    assert_eq!(goes_with("", bit, Statusword::empty()), Ok(()));
    assert_eq!(goes_with("", bit, bit), Ok(()));
    assert_eq!(goes_with("acknowledges = false", bit, Statusword::empty()), Ok(()));
    let waits = goes_with("acknowledges = true", bit, Statusword::empty()).expect_err("it never follows");
    assert!(waits.contains("Enable refused"), "{waits}");
    let said = "has waited 1 s for its drive to follow set-points; 6041:00 = 0237, expected bit 12 = 1";
    assert!(waits.contains(said), "{waits}");
    assert_eq!(goes_with("acknowledges = true", Statusword::empty(), Statusword::empty()), Ok(()));
}
