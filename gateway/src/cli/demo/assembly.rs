//! The controller of the demonstration as a PLC: it moves the axes through the assemblies of the device.
//!
//! The axes do what they do with CIP Motion, in the same time. The gateway's generator makes the set-points.

use std::sync::atomic::AtomicBool;
use std::time::Duration;

use clap::ValueEnum;
use profile_cip::assembly::handshake::Status;
use profile_generic::cast::{f64_from_i64, i64_from_f64};

use super::super::progress::Progress;
use super::super::report::AxisResult;
use super::{Ran, UPDATE_PERIOD_US};
use crate::config::Config;
use crate::simulate::plc::{self, Condition, Event, HANDSHAKE, Movement, Outcome, Plan, Planned, Step};
use crate::simulate::program::{self, AxisPlan, JOG_SHARE, MOVE_SHARE};

/// What the controller of the demonstration is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum DemoNorth {
    /// A CIP Motion controller.
    #[default]
    CipMotion,
    /// A PLC with a class 1 connection to assemblies.
    Assembly,
}

/// Where the assemblies stand in the configuration.
const IDENTITY: &str = "[device.identity]";

/// The configuration with assemblies in place of CIP Motion.
pub fn with_assemblies(text: &str) -> String {
    text.replacen(IDENTITY, &format!("assembly = {{ layout = \"mixed\" }}\n\n{IDENTITY}"), 1)
}

/// The steps of all axes, taking about `seconds`.
fn steps(plan: &Plan, plans: &[AxisPlan], seconds: f64) -> Vec<Planned> {
    let titles = program::titles(plans);
    let all: Vec<_> = (0..plans.len()).collect();
    let patience = Duration::from_secs_f64(seconds) + HANDSHAKE;
    let planned = |title: usize, step| {
        let title = titles.get(title).cloned().unwrap_or_default();
        Planned { step, within: patience, title, line: None }
    };
    let counts = |axis: usize, units: f64| i64_from_f64((units * f64::from(plan.counts[axis])).round());
    let (move_time, jog_time) = (seconds * MOVE_SHARE, seconds * JOG_SHARE);
    let movements = |title: usize, to: &dyn Fn(&AxisPlan) -> f64| {
        let begin = plans.iter().enumerate().map(|(axis, one)| {
            let limits = AxisPlan::limits(one.first, move_time);
            let movement = Movement {
                target: counts(axis, to(one)),
                relative: false,
                velocity: counts(axis, limits.velocity),
                acceleration: counts(axis, limits.acceleration),
            };
            planned(title, Step::Move { axis, movement, wait: false })
        });
        let condition = Condition::Status { bits: Status::DONE, on: true };
        let end = all.iter().map(|axis| planned(title + 1, Step::Expect { axis: *axis, condition }));
        begin.chain(end).collect::<Vec<_>>()
    };
    let jogs = plans.iter().enumerate().map(|(axis, one)| {
        let acceleration = counts(axis, one.velocity.abs() / (0.2 * jog_time));
        let step = Step::Velocity { axis, velocity: counts(axis, one.velocity), acceleration, wait: false };
        planned(3, step)
    });
    let mut steps = vec![planned(0, Step::Enable(all.clone()))];
    steps.extend(movements(1, &|one| one.first));
    steps.extend(jogs);
    steps.push(planned(3, Step::Dwell(Duration::from_secs_f64(0.7 * jog_time))));
    steps.push(planned(3, Step::Stop(all.clone())));
    steps.extend(movements(4, &|one| one.target));
    steps.push(planned(6, Step::Dwell(Duration::from_millis(100))));
    steps.push(planned(7, Step::Disable(all)));
    steps
}

/// Moves the axes.
pub fn run(
    config: &Config,
    address: std::net::Ipv4Addr,
    (plans, seconds): (&[AxisPlan], f64),
    progress: &mut Progress,
    stop: &AtomicBool,
) -> Result<Ran, String> {
    let interval = Duration::from_micros(u64::from(UPDATE_PERIOD_US));
    let plan = Plan::of(config, 0, interval).ok_or("the device of the demonstration has no assemblies")?;
    let plan = Plan { address, ..plan };
    let steps = steps(&plan, plans, seconds);
    let mut shown = "";
    let outcome = plc::run(&plan, &steps, stop, &mut |event| match event {
        Event::Connected => progress.step(&format!("connected to the assemblies at {address}")),
        Event::Begun(step) if steps[step].title != shown => {
            shown = &steps[step].title;
            progress.step(shown);
        }
        Event::Closed => progress.step("closed"),
        Event::Begun(_) | Event::Done(..) => {}
    });
    let axes = plans.iter().enumerate().map(|(axis, one)| result(&plan, one, axis, &outcome));
    Ok(Ran { axes: axes.collect(), failure: outcome.failure.as_ref().map(ToString::to_string) })
}

fn result(plan: &Plan, one: &AxisPlan, axis: usize, outcome: &Outcome) -> AxisResult {
    let units = |counts: i64| f64_from_i64(counts) / f64::from(plan.counts[axis]);
    let report = outcome.axes[axis];
    let reached = report.position.map(units);
    AxisResult {
        axis: one.axis,
        target: one.target,
        reached,
        max_following_error: units(report.following_error_max),
        cycles: outcome.cycles,
        lost_updates: outcome.lost,
        late_updates: outcome.late,
        window: one.window,
        in_window: reached.is_some_and(|reached| (reached - one.target).abs() <= one.window),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::demo::{DriveKind, configuration};

    #[test]
    fn every_choice_of_drives_can_have_assemblies() {
        for kinds in [&[DriveKind::Sercos][..], &[DriveKind::Sercos, DriveKind::Can, DriveKind::Devicenet]] {
            let text = with_assemblies(&configuration(kinds));
            let config = Config::parse(&text, "demo").unwrap_or_else(|error| panic!("{error}"));
            let plan = Plan::of(&config, 0, Duration::from_millis(8)).expect("assemblies");
            let plans: Vec<_> =
                (1..).zip(&plan.names).map(|(axis, _)| AxisPlan::new(axis, 2.0, 600.0, 0.01, 5.0)).collect();
            let steps = steps(&plan, &plans, 5.0);
            assert_eq!(steps.len(), 5 + 5 * plan.names.len());
            assert!(steps.iter().all(|step| !step.title.is_empty()));
        }
    }
}
