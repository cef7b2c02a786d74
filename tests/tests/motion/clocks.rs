//! The clocks of controller and gateway differ, drift apart, and step.

use axisbridge_tests::rig::Rig;
use profile_generic::time::DurationNs;

use crate::chain::Chain;
use crate::scenario::Moment;
use crate::table::{Disturbance, Table};

/// Steps of a clock, in milliseconds.
const STEPS: [i64; 5] = [1, 20, 100, 1_000, 3_600_000];

/// Whose clock it is.
#[derive(Debug, Clone, Copy)]
enum Whose {
    Gateway,
    /// It says so in its updates.
    Controller,
    /// It does not.
    Silent,
    /// Both, at the same instant.
    Both,
}

impl Whose {
    const fn name(self) -> &'static str {
        match self {
            Self::Gateway => "gateway",
            Self::Controller => "controller",
            Self::Silent => "controller (not reported)",
            Self::Both => "both clocks",
        }
    }

    fn step(self, rig: &mut Rig, by: DurationNs) {
        let now = rig.now();
        if matches!(self, Self::Gateway | Self::Both) {
            rig.gateway_clock.step(now, by);
        }
        if !matches!(self, Self::Gateway) {
            rig.controller_clock.step(now, by);
        }
    }

    fn stepping(self, millis: i64) -> Disturbance {
        let sign = if millis < 0 { '-' } else { '+' };
        let by = DurationNs::from_millis(millis);
        let length = match millis.abs() {
            3_600_000 => "1 h".to_owned(),
            1_000 => "1 s".to_owned(),
            millis => format!("{millis} ms"),
        };
        Disturbance::new(format!("{} {sign}{length}", self.name()), move |rig, moment| match moment {
            Moment::Start => rig.reports_steps = !matches!(self, Self::Silent),
            Moment::Constant => self.step(rig, by),
            Moment::Begin | Moment::Accelerating => {}
        })
    }
}

#[test]
fn offset_of_the_controller() {
    let table = Table::of(|chain: Chain| {
        // Half periods.
        let offsets = [1, 2, 4, 6, 7, 8, 9, 10, 20].into_iter().flat_map(|halves: i64| [halves, -halves]);
        let row = |halves: i64| {
            let offset = DurationNs(chain.period().as_nanos() * halves / 2);
            let sign = if halves < 0 { '-' } else { '+' };
            let (whole, half) = (halves.abs() / 2, if halves % 2 == 0 { "" } else { ".5" });
            let name = format!("controller {sign}{whole}{half} periods");
            Disturbance::at(Moment::Start, name, move |rig| {
                rig.controller_clock.set_offset(rig.now(), offset);
            })
        };
        offsets.map(row).collect()
    });
    insta::assert_snapshot!(table.finish());
}

#[test]
fn drift() {
    let table = Table::of(|_| {
        let drifts = [20, 200, 2_000].into_iter().flat_map(|ppm| [ppm, -ppm]);
        let row = |ppm: i64| {
            let controller = Disturbance::at(Moment::Begin, format!("controller {ppm:+} ppm"), move |rig| {
                rig.controller_clock.drift(rig.now(), ppm * 1_000);
            });
            let gateway = Disturbance::at(Moment::Begin, format!("gateway {ppm:+} ppm"), move |rig| {
                rig.gateway_clock.drift(rig.now(), ppm * 1_000);
            });
            [controller, gateway]
        };
        drifts.flat_map(row).collect()
    });
    insta::assert_snapshot!(table.finish());
}

#[test]
fn steps_of_the_gateway() {
    let table = Table::of(|_| {
        STEPS.into_iter().flat_map(|step| [step, -step]).map(|step| Whose::Gateway.stepping(step)).collect()
    });
    insta::assert_snapshot!(table.finish());
}

#[test]
fn steps_of_the_controller() {
    let table = Table::of(|_| {
        let steps = STEPS.into_iter().flat_map(|step| [step, -step]);
        steps.flat_map(|step| [Whose::Controller, Whose::Silent].map(|whose| whose.stepping(step))).collect()
    });
    insta::assert_snapshot!(table.finish());
}

/// A leap second puts UTC back by one, on both sides at once or on one of them.
#[test]
fn leap_second() {
    let table = Table::of(|_| {
        [Whose::Both, Whose::Gateway, Whose::Controller, Whose::Silent]
            .map(|whose| whose.stepping(-1_000))
            .into()
    });
    insta::assert_snapshot!(table.finish());
}
