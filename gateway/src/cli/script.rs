//! `axisbridge simulate controller --script FILE`: the bench tester.
//!
//! Results of the steps go to standard output as they come, or all of them as one JSON object at the end; what happens in
//! between goes to standard error while that is a terminal. Exit status: 0 all steps did what they say, 1 one did not,
//! 2 the script or the arguments are wrong.

use std::net::Ipv4Addr;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use profile_cip::controller::{Event, Report};
use serde::Serialize;

use super::progress::Progress;
use super::simulate::controller_time;
use super::{CliError, ControllerArguments, USAGE, signal};
use crate::mapping::Mapping;
use crate::simulate::controller::{self, Endpoints};
use crate::simulate::script::{Script, show_attribute};

/// Runs or checks a script.
pub fn run(arguments: &ControllerArguments, path: &Path) -> Result<ExitCode, CliError> {
    let mapping = Mapping::embedded()?;
    let script = match Script::load(path, &mapping) {
        Ok(script) => script,
        Err(error) => return Ok(usage(&error.to_string())),
    };
    if arguments.check {
        print_plan(&script, arguments.json)?;
        return Ok(ExitCode::SUCCESS);
    }
    let Some(target) = arguments.target.or(script.places.target) else {
        return Ok(usage("no device: expected --target ADDR, or target = \"...\" in [connection]"));
    };
    let bind = arguments.bind.or(script.places.bind);
    let stop = signal::stop_on_signals()?;
    let mut teller = Teller::new(&script, &mapping, arguments.json);
    let mut time = controller_time(arguments, bind, &mut teller.progress, &stop)?;
    let endpoints = Endpoints { target, bind: bind.unwrap_or(Ipv4Addr::UNSPECIFIED) };
    let (config, steps) = (script.config.clone(), script.steps.clone());
    let report =
        controller::run(endpoints, config, &mut time, steps, &stop, &mut |event| teller.tell(event))?;
    let result = ScriptResult::new(&script, &report);
    if arguments.json {
        println!("{}", serde_json::to_string(&result)?);
    } else {
        result.print(&report);
    }
    if let Some(failure) = &result.failure {
        eprintln!("error: {failure}");
    }
    Ok(if result.passed { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn usage(text: &str) -> ExitCode {
    eprintln!("{text}");
    ExitCode::from(USAGE)
}

/// The place of a step for people.
fn place(number: usize, line: Option<usize>) -> String {
    let line = line.map_or_else(|| "at the end".to_owned(), |line| format!("line {line}"));
    format!("{number:>4}  {line:<10}")
}

fn print_plan(script: &Script, json: bool) -> Result<(), CliError> {
    if json {
        let rows = (1..).zip(&script.titles).map(|(step, (title, line))| StepResult {
            step,
            line: *line,
            title,
            result: "not run",
            seconds: None,
        });
        println!("{}", serde_json::to_string(&rows.collect::<Vec<_>>())?);
        return Ok(());
    }
    for (number, (title, line)) in (1..).zip(&script.titles) {
        println!("{}  {title}", place(number, *line));
    }
    println!("{} axes, {} steps; nothing was sent", script.config.axes.len(), script.steps.len());
    Ok(())
}

/// Tells what happens while it does.
struct Teller<'a> {
    script: &'a Script,
    mapping: &'a Mapping,
    progress: Progress,
    json: bool,
    began: Instant,
}

impl<'a> Teller<'a> {
    fn new(script: &'a Script, mapping: &'a Mapping, json: bool) -> Self {
        Self { script, mapping, progress: Progress::new(json), json, began: Instant::now() }
    }

    fn tell(&mut self, event: &Event) {
        let title = |step: usize| self.script.titles.get(step).map_or("", |(title, _)| title.as_str());
        match event {
            Event::StepStarted { step } => {
                self.began = Instant::now();
                self.progress.step(&format!("step {}: {}", step + 1, title(*step)));
            }
            Event::StepFinished { step } if !self.json => {
                let line = self.script.titles.get(*step).and_then(|(_, line)| *line);
                let seconds = self.began.elapsed().as_secs_f64();
                println!("passed  {}  {seconds:>8.3} s  {}", place(step + 1, line), title(*step));
            }
            Event::AttributesRead { instance, values } if !self.json => {
                for row in values {
                    let text = match &row.value {
                        Ok(bytes) => show_attribute(self.mapping, *instance, row.id, bytes),
                        Err(status) => format!("attribute {}: status {status:#04x}", row.id),
                    };
                    println!("        instance {instance}: {text}");
                }
            }
            Event::ServiceAnswered { .. }
            | Event::ExplicitAnswered { .. }
            | Event::AxisFault { .. }
            | Event::AxisAlarm { .. }
            | Event::AxisEvent { .. }
            | Event::NodeFault(_)
            | Event::NodeAlarm(_)
                if !self.json =>
            {
                println!("        {event}");
            }
            event => self.progress.step(&event.to_string()),
        }
    }
}

/// One step.
#[derive(Debug, Serialize)]
struct StepResult<'a> {
    /// From 1.
    step: usize,
    /// In the script; `null` for a step that was added.
    line: Option<usize>,
    title: &'a str,
    /// `passed`, `failed` or `not run`.
    result: &'static str,
    seconds: Option<f64>,
}

#[derive(Debug, Serialize)]
struct RecordResult {
    #[serde(rename = "type")]
    kind: String,
    code: u8,
    sub_code: u8,
    /// System time, ns.
    at: u64,
}

#[derive(Debug, Serialize)]
struct AxisResult {
    axis: u8,
    state: Option<String>,
    /// In units, as the others.
    actual: Option<f64>,
    commanded: Option<f64>,
    max_following_error: f64,
    faults: Vec<RecordResult>,
    alarms: Vec<RecordResult>,
}

#[derive(Debug, Serialize)]
struct UpdatesResult {
    sent: u64,
    received: u64,
    /// Device to controller.
    lost: u64,
    late: u64,
    /// Update periods in which this controller was too late.
    missed: u64,
    malformed: u64,
    /// Controller to device, as the device counts them, modulo 256.
    device_lost: u8,
    device_late: u8,
    interval: SpreadResult,
    round_trip: SpreadResult,
}

#[derive(Debug, Serialize)]
struct SpreadResult {
    count: u64,
    min_us: f64,
    max_us: f64,
    mean_us: f64,
}

impl From<&profile_cip::controller::statistics::Spread> for SpreadResult {
    fn from(spread: &profile_cip::controller::statistics::Spread) -> Self {
        let micros =
            |span: profile_generic::time::DurationNs| profile_generic::cast::f64_from_i64(span.0) / 1e3;
        Self {
            count: spread.count,
            min_us: micros(spread.min),
            max_us: micros(spread.max),
            mean_us: micros(spread.mean()),
        }
    }
}

/// A whole run.
#[derive(Debug, Serialize)]
struct ScriptResult<'a> {
    title: Option<&'a str>,
    passed: bool,
    device: Option<String>,
    synchronous: bool,
    steps: Vec<StepResult<'a>>,
    axes: Vec<AxisResult>,
    updates: UpdatesResult,
    /// The step that failed, what was expected, and what came.
    failure: Option<String>,
}

impl<'a> ScriptResult<'a> {
    fn new(script: &'a Script, report: &Report) -> Self {
        let steps = (0..).zip(&script.titles).map(|(index, (title, line)): (usize, _)| {
            let ran = report.steps.get(index);
            let result = match ran {
                _ if report.failed_step == Some(index) => "failed",
                Some(_) if index < report.steps_finished => "passed",
                _ => "not run",
            };
            let seconds = ran
                .and_then(|ran| ran.ended.map(|ended| ended - ran.began))
                .map(|span| profile_generic::cast::f64_from_i64(span.0) / 1e9);
            StepResult { step: index + 1, line: *line, title, result, seconds }
        });
        let failure = report.failure.map(|failure| match report.failed_step {
            Some(step) => {
                let (title, line) = script.titles.get(step).map_or(("", None), |(t, l)| (t.as_str(), *l));
                let line = line.map_or_else(String::new, |line| format!(" (line {line})"));
                format!("step {}{line}, {title}: {failure}", step + 1)
            }
            None => failure.to_string(),
        });
        Self {
            title: script.title.as_deref(),
            passed: report.failure.is_none() && report.steps_finished == script.steps.len(),
            device: report.identity.as_ref().map(ToString::to_string),
            synchronous: report.synchronous,
            steps: steps.collect(),
            axes: report.axes.iter().map(AxisResult::new).collect(),
            updates: UpdatesResult {
                sent: report.cycles,
                received: report.updates,
                lost: report.lost_updates,
                late: report.late_updates,
                missed: report.missed_cycles,
                malformed: report.malformed,
                device_lost: report.device_lost_updates,
                device_late: report.device_late_updates,
                interval: (&report.interval).into(),
                round_trip: (&report.round_trip).into(),
            },
            failure,
        }
    }

    fn print(&self, report: &Report) {
        for step in self.steps.iter().filter(|step| step.result != "passed") {
            let seconds = step.seconds.map_or_else(String::new, |seconds| format!("{seconds:.3} s"));
            let seconds = format!("{seconds:>10}");
            println!("{:<7} {}  {seconds}  {}", step.result, place(step.step, step.line), step.title);
        }
        let updates = &self.updates;
        println!(
            "{} updates sent, {} received, {} lost, {} late; the device counts {} lost, {} late",
            updates.sent,
            updates.received,
            updates.lost,
            updates.late,
            updates.device_lost,
            updates.device_late
        );
        println!("interval {}; round trip {}", report.interval, report.round_trip);
    }
}

impl AxisResult {
    fn new(axis: &profile_cip::controller::report::AxisReport) -> Self {
        Self {
            axis: axis.axis,
            state: axis.state.map(|state| state.to_string()),
            actual: axis.actual,
            commanded: axis.commanded,
            max_following_error: axis.following_error_max,
            faults: axis
                .faults
                .kept()
                .iter()
                .map(|fault| RecordResult {
                    kind: fault.fault_type.to_string(),
                    code: fault.code,
                    sub_code: fault.sub_code,
                    at: fault.time_stamp,
                })
                .collect(),
            alarms: axis
                .alarms
                .kept()
                .iter()
                .map(|alarm| RecordResult {
                    kind: alarm.alarm_type.to_string(),
                    code: alarm.code,
                    sub_code: alarm.sub_code,
                    at: alarm.time_stamp,
                })
                .collect(),
        }
    }
}
