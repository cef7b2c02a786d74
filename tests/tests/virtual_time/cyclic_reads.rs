//! Cyclic read lists: what an update carries is of its own instant, and what cannot be is refused when the list is made.

use axisbridge_tests::rig::motion::{NANO, millis};
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cip::controller::program::{CyclicAttribute, CyclicDirection};
use profile_cip::controller::{AttributeSet, AxisSet, Limits, Step};

const TURNTABLE: u8 = 1;

const VELOCITY_FEED_FORWARD: u16 = 433;
const POSITION_ERROR: u16 = 436;
const POSITION_LOOP: u16 = 438;
const KVFF: u16 = 440;
const KPP: u16 = 441;
const VELOCITY_INTEGRATOR: u16 = 456;
const VELOCITY_LOOP: u16 = 457;
const KJ: u16 = 496;
const VELOCITY_REFERENCE: u16 = 453;
const VELOCITY_FEEDBACK: u16 = 454;
const VELOCITY_ERROR: u16 = 455;
const TORQUE_REFERENCE: u16 = 492;
const IQ_FEEDBACK: u16 = 529;
const BUS_VOLTAGE: u16 = 620;

fn list(ids: &[u16]) -> Step {
    let attributes =
        ids.iter().map(|id| CyclicAttribute { id: *id, element_size: 4, value: vec![0; 4] }).collect();
    Step::CyclicList { axis: TURNTABLE, direction: CyclicDirection::Read, attributes }
}

fn value(rig: &Rig, id: u16) -> Option<f64> {
    let bytes = rig.controller.as_ref()?.cyclic_read(TURNTABLE, id)?;
    Some(f32::from_le_bytes(bytes.try_into().ok()?).into())
}

fn moving(settings: Settings, gains: &[(u16, f32)], ids: &[u16]) -> Rig {
    let gains = gains.iter().map(|(id, value)| AttributeSet::real(*id, *value)).collect();
    let limits = Limits { velocity: 2.0, acceleration: 10.0, jerk: 100.0 };
    let mut rig = Rig::ready(settings);
    rig.connect(vec![
        Step::SetAttributes { axis: TURNTABLE, attributes: gains },
        list(ids),
        Step::Enable(AxisSet::first(1)),
        Step::MoveAbsolute { axis: TURNTABLE, position: 4.0, limits },
        Step::SetAttributes { axis: TURNTABLE, attributes: vec![AttributeSet::real(KPP, 25.0)] },
        Step::Dwell { seconds: 100.0 },
    ]);
    rig.run_until(millis(30_000), "motion", |rig| rig.velocity(0) > NANO / 10);
    assert_eq!(rig.report().failure, None, "{}", rig.log());
    rig
}

/// In each update of an acceleration the sums and products of what it carries are right: nothing in it is of another instant.
#[test]
fn what_the_loops_make_is_fresh_in_each_update() {
    let ids = [
        POSITION_ERROR,
        POSITION_LOOP,
        VELOCITY_FEED_FORWARD,
        VELOCITY_REFERENCE,
        VELOCITY_FEEDBACK,
        VELOCITY_ERROR,
        IQ_FEEDBACK,
    ];
    for (bus, settings, gains) in [("SERCOS", Settings::default(), &[(KVFF, 50.0_f32), (KPP, 50.0)][..])] {
        let mut rig = moving(settings, gains, &ids);
        let mut seen: Vec<[f64; 7]> = Vec::new();
        let end = rig.now() + millis(300);
        while rig.now() < end {
            rig.step();
            let Some(values) = ids.iter().map(|id| value(&rig, *id)).collect::<Option<Vec<_>>>() else {
                panic!("{bus}: no value: {}", rig.log());
            };
            let values: [f64; 7] = values.try_into().expect("seven");
            if seen.last() != Some(&values) {
                seen.push(values);
            }
        }
        assert!(seen.len() >= 30, "{bus}: {} updates", seen.len());
        for [error, output, forward, reference, feedback, velocity_error, current] in seen {
            // A million counts are a turn.
            let expected = 50.0 * error / 1e6;
            assert!((output - expected).abs() < 2e-4, "{bus}: {output} of an error of {error}");
            assert!(
                (reference - output - forward).abs() < 2e-4,
                "{bus}: {reference} of {output} and {forward}"
            );
            assert!(
                (velocity_error - reference + feedback).abs() < 2e-4,
                "{bus}: {velocity_error} of {reference} and {feedback}"
            );
            assert!(forward > 0.0 && current > 0.0, "{bus}: {forward} {current}");
        }
        // Another gain shows, and nothing is left of the old one.
        rig.run_until(millis(30_000), "the other gain", |rig| rig.report().steps_finished >= 5);
        rig.run_for(millis(100));
        let (error, output) = (value(&rig, POSITION_ERROR), value(&rig, POSITION_LOOP));
        let (error, output) = error.zip(output).expect("values");
        assert!((output - 25.0 * error / 1e6).abs() < 1e-6, "{bus}: {output} of {error}");
    }
}

/// While a drive gains speed its velocity is behind: what its loop gives is more than the gain makes of that, by the integrator.
#[test]
fn velocity_integrator_is_what_the_loop_gives_beyond_its_gain() {
    let gains = "instance = 1\nloops = { velocity_gain = 300.0 }\n";
    let configuration = BOX.replacen("instance = 1\n", gains, 1);
    let ids = [VELOCITY_LOOP, VELOCITY_ERROR, VELOCITY_INTEGRATOR];
    let mut rig = Rig::ready(Settings { configuration, ..Settings::default() });
    rig.connect(vec![
        Step::SetAttributes { axis: TURNTABLE, attributes: vec![AttributeSet::real(KJ, 0.5)] },
        list(&ids),
        Step::Enable(AxisSet::first(1)),
        Step::Jog { axis: TURNTABLE, velocity: 4.0, acceleration: 20.0, jerk: 400.0, seconds: 2.0 },
        Step::Dwell { seconds: 100.0 },
    ]);
    rig.run_until(millis(30_000), "motion", |rig| rig.velocity(0) > NANO / 2);
    assert_eq!(rig.report().failure, None, "{}", rig.log());
    let (mut updates, mut behind) = (0, 0.0_f64);
    let (mut before, end) = (None, rig.now() + millis(250));
    while rig.now() < end {
        rig.step();
        let values = ids.map(|id| value(&rig, id).unwrap_or_else(|| panic!("{id}: {}", rig.log())));
        if before == Some(values) {
            continue;
        }
        (before, updates) = (Some(values), updates + 1);
        let [output, error, integrator] = values;
        behind = behind.max(error.abs());
        let expected = output - 300.0 * error;
        assert!((integrator - expected).abs() < 0.01, "{integrator} of {output} and {error}: {expected}");
    }
    assert!(updates >= 30 && behind > 0.01, "{updates} updates, {behind} behind");
}

/// The drive shows its torque set-point and its bus voltage by its service channel only.
#[test]
fn what_no_telegram_carries_is_refused_with_the_list() {
    for id in [TORQUE_REFERENCE, BUS_VOLTAGE, KPP] {
        let mut rig = Rig::ready(Settings::default());
        rig.connect(vec![list(&[POSITION_ERROR, id])]);
        rig.run_until(millis(30_000), "the end of the list", |rig| {
            rig.report().failure.is_some() || rig.report().steps_finished >= 1
        });
        let failure = rig.report().failure.map(|failure| failure.to_string()).unwrap_or_default();
        assert!(failure.contains(&id.to_string()), "{id}: {failure}");
    }
}
