//! `axisbridge simulate plc`: a programmable controller that moves axes through assemblies.
//!
//! Exit status: 0 all steps did what they say, and no axis has torque; 1 otherwise; 2 the script or the arguments are wrong.

use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use profile_generic::cast::{f64_from_i64, i64_from_f64};

use super::{CliError, PlcArguments, USAGE, signal, usage};
use crate::config::Config;
use crate::simulate::plc::script::Script;
use crate::simulate::plc::{self, Event, HANDSHAKE, Movement, Plan, Planned, Step};

/// Moves the axis, or carries out the script.
///
/// # Errors
/// The configuration is faulty, a step fails, or an axis has torque at the end.
pub fn run(arguments: &PlcArguments) -> Result<ExitCode, CliError> {
    let config = Config::load(&arguments.config)?;
    if let Some(path) = &arguments.script {
        return scripted(arguments, path, &config);
    }
    let (Some(name), Some(to), Some(velocity)) = (&arguments.axis, arguments.to, arguments.velocity) else {
        return Ok(usage("expected --axis, --to and --velocity, or --script"));
    };
    let Some(axis) = config.axes.iter().find(|axis| axis.name == *name) else {
        let names: Vec<_> = config.axes.iter().map(|axis| axis.name.as_str()).collect();
        let names = names.join(", ");
        return Ok(usage(&format!("there is no axis `{name}`; expected one of: {names}")));
    };
    let interval = Duration::from_micros(u64::from(arguments.interval_us));
    let Some(plan) = Plan::of(&config, axis.device, interval) else {
        let device = &config.devices[axis.device].name;
        let message =
            format!("the axis `{name}` is on the CIP Motion device `{device}`; expected one with assemblies");
        return Ok(usage(&message));
    };
    let place = plan.names.iter().position(|known| known == name).unwrap_or(0);
    let counts = |units: f64| i64_from_f64((units * f64::from(axis.motion_resolution)).round());
    let movement = Movement {
        target: counts(to),
        relative: false,
        velocity: counts(velocity),
        acceleration: arguments.acceleration.map_or(0, counts),
    };
    let planned =
        |step, within, title: &str| Planned { step, within, title: format!("{title} {name}"), line: None };
    let steps = [
        planned(Step::Enable(vec![place]), HANDSHAKE, "enable"),
        planned(
            Step::Move { axis: place, movement, wait: true },
            Duration::from_secs(u64::from(arguments.seconds)),
            "move",
        ),
    ];
    let stop = signal::stop_on_signals()?;
    let outcome = plc::run(&plan, &steps, &stop, &mut |event| match event {
        Event::Connected => println!("{}", connected(&plan)),
        Event::Done(number, _) => println!("{}: done", steps[number].title),
        Event::Closed => println!("disabled and closed"),
        Event::Begun(_) => {}
    });
    if let Some(failure) = outcome.failure {
        return Err(failure.error.to_string().into());
    }
    let position = outcome.axes[place].position.unwrap_or(0);
    println!("{name} at {:.6}", f64_from_i64(position) / f64::from(axis.motion_resolution));
    Ok(ExitCode::SUCCESS)
}

fn connected(plan: &Plan) -> String {
    format!("connected to {}, interval {} us", plan.address, plan.interval.as_micros())
}

/// Checks or carries out a script.
fn scripted(arguments: &PlcArguments, path: &Path, config: &Config) -> Result<ExitCode, CliError> {
    let script = match Script::load(path, config) {
        Ok(script) => script,
        Err(findings) => {
            eprintln!("{findings}");
            return Ok(ExitCode::from(USAGE));
        }
    };
    let Script { plan, steps, .. } = &script;
    if arguments.check {
        for (number, planned) in (1..).zip(steps) {
            println!("{}  {}", place(number, planned), planned.title);
        }
        println!("{} axes, {} steps; nothing was sent", plan.names.len(), steps.len());
        return Ok(ExitCode::SUCCESS);
    }
    let stop = signal::stop_on_signals()?;
    let mut began = Instant::now();
    let outcome = plc::run(plan, steps, &stop, &mut |event| match event {
        Event::Connected => println!("{}", connected(plan)),
        Event::Begun(_) => began = Instant::now(),
        Event::Done(number, _) => {
            let (planned, seconds) = (&steps[number], began.elapsed().as_secs_f64());
            println!("passed  {}  {seconds:>8.3} s  {}", place(number + 1, planned), planned.title);
        }
        Event::Closed => println!("disabled and closed"),
    });
    for (axis, report) in outcome.axes.iter().enumerate() {
        if let Some(position) = report.position {
            let units = f64_from_i64(position) / f64::from(plan.counts[axis]);
            println!("{} at {units:.6}", plan.name(axis));
        }
    }
    let Some(failure) = outcome.failure else { return Ok(ExitCode::SUCCESS) };
    if let Some(planned) = failure.step.and_then(|step| steps.get(step)) {
        let number = failure.step.map_or(0, |step| step + 1);
        println!("failed  {}  {}", place(number, planned), planned.title);
    }
    Err(failure.to_string().into())
}

/// The place of a step for people.
fn place(number: usize, planned: &Planned) -> String {
    let line = planned.line.map_or_else(String::new, |line| format!("line {line}"));
    format!("{number:>4}  {line:<10}")
}
