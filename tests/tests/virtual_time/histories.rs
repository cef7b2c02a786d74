//! The fault history, from the notices of an engine with a controller and simulated drives.

use axisbridge::config::Config;
use axisbridge::history::{FaultHistory, FaultRecord};
use axisbridge::local::installation::Installation;
use axisbridge_tests::rig::motion::{in_motion, millis};
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cip::controller::{AxisSet, Step};
use profile_generic::fault::FaultCause;

const TURNTABLE_ONLY: AxisSet = AxisSet::one(1);

/// The history, oldest first.
fn history(rig: &Rig) -> Vec<FaultRecord> {
    let (history, names) = (
        FaultHistory::default(),
        Installation::of(&Config::parse(BOX, "box.toml").expect("a good configuration")),
    );
    rig.notices.iter().for_each(|notice| history.note(notice, &names));
    let mut records = history.list(None);
    records.reverse();
    records
}

/// A record as one text: axis, cause, beginning of the words of the controller, what the drive says, and how it has ended.
fn summary(record: &FaultRecord) -> String {
    let FaultRecord { axis, cause, controller, drive_says, end, .. } = record;
    let controller = controller.as_deref().and_then(|text| text.split(" in ").next()).unwrap_or("-");
    let says = drive_says.as_deref().unwrap_or("-");
    let end = end.as_ref().map_or("present", |end| end.by.as_str());
    format!("{axis}: {cause} | {controller} | {says} | {end}")
}

fn summaries(rig: &Rig) -> Vec<String> {
    history(rig).iter().map(summary).collect()
}

#[test]
fn fault_of_a_drive_is_in_the_words_of_gateway_controller_and_drive_until_it_is_reset() {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![
        Step::Enable(TURNTABLE_ONLY),
        Step::Dwell { seconds: 0.5 },
        Step::FaultReset(TURNTABLE_ONLY),
    ]);
    rig.run_until(millis(5_000), "the enable", |rig| rig.report().steps_finished == 1);
    assert_eq!(summaries(&rig), [""; 0]);
    rig.drive_mut(0).raise_fault(FaultCause::OVER_CURRENT);
    rig.run_for(millis(100));
    let says = "0xC00F0007 \"overcurrent error\"";
    assert_eq!(
        summaries(&rig),
        [
            "turntable: drive_specific | Axis Fault - Mfg 1 (drive_specific) | - | present".to_owned(),
            format!("turntable: over_current | Axis Fault 10 (over_current) | {says} | present"),
        ]
    );
    let records = history(&rig);
    assert_eq!((records[1].drive.as_str(), records[1].bus.as_str()), ("drive-a", "SERCOS"));
    assert!(records[1].gateway.as_deref().is_some_and(|text| text.starts_with("over_current (axis fault, ")));
    assert!(records[1].drive_code != 0 && records[1].advice.ends_with('.'), "{records:?}");
    rig.drive_mut(0).clear_fault(FaultCause::OVER_CURRENT);
    let report = rig.run(millis(20_000));
    assert_eq!(report.failure, None, "{}", rig.log());
    assert_eq!(
        summaries(&rig),
        [
            "turntable: drive_specific | Axis Fault - Mfg 1 (drive_specific) | - | Fault Reset".to_owned(),
            format!("turntable: over_current | Axis Fault 10 (over_current) | {says} | Fault Reset"),
        ]
    );
}

#[test]
fn fault_that_the_gateway_finds_and_faults_of_both_axes_are_records_of_their_own() {
    let mut rig = in_motion(Settings::default());
    rig.drive_mut(1).raise_fault(FaultCause::OVER_VOLTAGE);
    rig.run_for(millis(100));
    rig.drive_mut(0).raise_fault(FaultCause::FEEDBACK_LOSS);
    rig.run_for(millis(100));
    let causes: Vec<_> =
        history(&rig).into_iter().map(|record| (record.number, record.axis, record.cause)).collect();
    let expected = [
        (1, "slide", "drive_specific"),
        (2, "slide", "over_voltage"),
        (3, "turntable", "drive_specific"),
        (4, "turntable", "feedback_loss"),
    ];
    assert_eq!(causes, expected.map(|(number, axis, cause)| (number, axis.to_owned(), cause.to_owned())));
    assert!(history(&rig).iter().all(|record| record.is_present() && record.controller.is_some()));
}
