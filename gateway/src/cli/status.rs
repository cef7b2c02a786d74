//! `axisbridge status`: what a running gateway does now, over its local socket.

use std::fmt::Write as _;
use std::io::{IsTerminal as _, Write as _};
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::Duration;

use super::gateway_client::GatewayClient;
use super::{CliError, StatusArguments, has_colours, print, signal, written_to_end};
use crate::local::overview::{Axis, FORMAT, Overview};

/// How often `--watch` asks.
const INTERVAL: Duration = Duration::from_secs(1);

/// How often it looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// How long the gateway may take to answer.
pub(super) const PATIENCE: Duration = Duration::from_secs(2);

/// Clears a terminal and goes to its upper left corner.
const CLEAR: &str = "\x1b[H\x1b[2J";

/// Shows the state once, or again and again. The exit status is 0 when all is well.
pub fn run(arguments: &StatusArguments) -> Result<ExitCode, CliError> {
    let mut client = GatewayClient::connect(&arguments.local, PATIENCE)?;
    let terminal = std::io::stdout().is_terminal();
    let colours = has_colours(&std::io::stdout());
    if !arguments.watch {
        let (json, overview) = ask(&mut client)?;
        let text = if arguments.json { format!("{json}\n") } else { text(&overview, colours) };
        return print(text, exit(&overview));
    }
    let stop = signal::stop_on_signals()?;
    loop {
        let (json, overview) = ask(&mut client)?;
        let mut out = std::io::stdout().lock();
        let shown = match (arguments.json, terminal) {
            (true, _) => format!("{json}\n"),
            (false, true) => format!("{CLEAR}{}", text(&overview, colours)),
            (false, false) => format!("{}\n", text(&overview, false)),
        };
        let written = out.write_all(shown.as_bytes()).and_then(|()| out.flush());
        if written.is_err() {
            return written_to_end(written, exit(&overview));
        }
        for _ in 0..INTERVAL.as_millis() / LOOK.as_millis() {
            if stop.load(Ordering::Relaxed) {
                return Ok(exit(&overview));
            }
            std::thread::sleep(LOOK);
        }
    }
}

fn exit(overview: &Overview) -> ExitCode {
    if overview.is_healthy() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// The overview, as it came and as it is.
pub(super) fn ask(client: &mut GatewayClient) -> Result<(String, Overview), CliError> {
    let reply = client.ask("box")?.last;
    let other = || format!("expected a reply `ok box {{...}}` of format {FORMAT}, got `{reply}`");
    let json = reply.strip_prefix("ok box ").ok_or_else(other)?;
    let overview: Overview = serde_json::from_str(json).map_err(|error| format!("{}: {error}", other()))?;
    if overview.format != FORMAT {
        return Err(other().into());
    }
    Ok((json.to_owned(), overview))
}

/// The overview for a person.
fn text(overview: &Overview, colours: bool) -> String {
    let paint = |text: &str, good: bool| match (colours, good) {
        (false, _) => text.to_owned(),
        (true, true) => format!("\x1b[32m{text}\x1b[0m"),
        (true, false) => format!("\x1b[31m{text}\x1b[0m"),
    };
    let Overview { name, state, cycles, time, .. } = overview;
    let mut out = String::new();
    let _ = write!(out, "{name}: {}", paint(state, overview.is_up()));
    if let Some(phase) = overview.sercos_phase {
        let _ = write!(out, ", SERCOS CP{phase}");
    }
    let s = if overview.connections == 1 { "" } else { "s" };
    let _ = writeln!(out, ", {} controller{s}, up {}", overview.connections, duration(overview.uptime_s));
    if let Some(silent) = &overview.silent {
        let _ = writeln!(out, "{}", paint(silent, false));
    }

    let _ = write!(out, "time    {}: {}", time.source, paint(&time.state, time.synchronized));
    if let Some(grandmaster) = &time.grandmaster {
        let _ = write!(out, ", grandmaster {grandmaster}");
    }
    for (what, value) in [("offset", time.offset_ns), ("path delay", time.path_delay_ns)] {
        if let Some(value) = value {
            let _ = write!(out, ", {what} {value} ns");
        }
    }
    if let Some(bound) = time.error_bound_ns {
        let _ = write!(out, ", error below {bound} ns of {}", time.threshold_ns);
    }
    if time.steps > 0 {
        let _ = write!(out, ", {} steps", time.steps);
    }
    let lock = match cycles.phase_lock.as_str() {
        "free" => "by the gateway's own clock".to_owned(),
        "pulling" => format!("pulled to system time, {} ns off", cycles.phase_error_ns),
        _ => format!("locked to system time, {} ns off", cycles.phase_error_ns),
    };
    let _ = writeln!(
        out,
        "\ncycles  {} us, {lock}; {} run, {} late, the latest by {} us",
        f64::from(cycles.cycle_ns) / 1e3,
        cycles.count,
        cycles.late,
        cycles.latest_ns / 1_000
    );
    let _ = writeln!(
        out,
        "lost    {} updates, {} telegrams; {} frames refused, {} not sent\n",
        cycles.lost_updates, cycles.lost_telegrams, cycles.refused_frames, cycles.send_failures
    );
    axes(&mut out, &overview.axes, &paint);
    out
}

/// The table of the axes, each with what is wrong below it.
fn axes(out: &mut String, axes: &[Axis], paint: &dyn Fn(&str, bool) -> String) {
    let head = ["axis", "state", "controller sees", "owner", "position", "velocity", "torque", "error"];
    let row = |axis: &Axis| {
        let unit = &axis.unit;
        [
            axis.name.clone(),
            axis.state.clone(),
            axis.cip_state.clone().unwrap_or_else(|| "-".to_owned()),
            axis.owner.clone(),
            format!("{:.6} {unit}", axis.position),
            format!("{:.6} {unit}/s", axis.velocity),
            format!("{:.1} %", axis.torque),
            format!("{:.6} {unit}", axis.following_error),
        ]
    };
    let rows: Vec<_> = std::iter::once(head.map(str::to_owned)).chain(axes.iter().map(row)).collect();
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; 8] = std::array::from_fn(width);
    for (number, row) in rows.iter().enumerate() {
        let cells = row.iter().zip(widths).enumerate().map(|(column, (cell, width))| match column {
            // Numbers end where those of the other axes do.
            4.. => format!("{cell:>width$}"),
            _ => format!("{cell:<width$}"),
        });
        let _ = writeln!(out, "{}", cells.collect::<Vec<_>>().join("  ").trim_end());
        let Some(axis) = number.checked_sub(1).and_then(|number| axes.get(number)) else { continue };
        let indent = " ".repeat(widths[0]);
        if let Some(fault) = &axis.fault {
            let code = if axis.drive_code == 0 {
                String::new()
            } else {
                format!(", the drive says {:#06X}", axis.drive_code)
            };
            let _ = writeln!(out, "{indent}  {}", paint(&format!("fault {fault}{code}"), false));
            if let Some(advice) = &axis.advice {
                let _ = writeln!(out, "{indent}  {advice}");
            }
        }
        if let Some(waits) = &axis.waits {
            let _ = writeln!(out, "{indent}  {waits}");
        }
        if waits_for_controller(axis) {
            let _ = writeln!(out, "{indent}  waits for a controller; local control can move it");
        } else if !axis.inhibits.is_empty() {
            let _ = writeln!(out, "{indent}  cannot be enabled: {}", axis.inhibits.join(", "));
        }
    }
}

/// Seconds as a person says them.
fn duration(seconds: f64) -> String {
    let whole = Duration::try_from_secs_f64(seconds).unwrap_or_default().as_secs();
    let (days, hours, minutes) = (whole / 86_400, whole / 3_600 % 24, whole / 60 % 60);
    match (days, hours, minutes) {
        (0, 0, 0) => format!("{whole} s"),
        (0, 0, _) => format!("{minutes} min {} s", whole % 60),
        (0, ..) => format!("{hours} h {minutes} min"),
        _ => format!("{days} d {hours} h"),
    }
}

/// Whether nothing but the configuration by a controller is missing, which local control does not need.
fn waits_for_controller(axis: &Axis) -> bool {
    axis.owner == "nobody" && axis.inhibits == ["configuration_incomplete"]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::local::overview::{Cycles, Lateness, Time};

    fn axis(name: &str, unit: &str) -> Axis {
        Axis {
            name: name.to_owned(),
            bus: "SERCOS".to_owned(),
            drive: "drive-a".to_owned(),
            device: Some("front".to_owned()),
            state: "operating".to_owned(),
            cip_state: Some("Running".to_owned()),
            owner: "controller".to_owned(),
            mode: "position".to_owned(),
            drive_status: vec!["ready".to_owned()],
            axis_status: "solid green".to_owned(),
            display: "RUNNING".to_owned(),
            unit: unit.to_owned(),
            position: 12.345_678,
            velocity: -0.5,
            torque: 1.8,
            following_error: 0.000_12,
            fault: None,
            advice: None,
            drive_code: 0,
            waits: None,
            inhibits: Vec::new(),
            lost_telegrams: 0,
            faults: 0,
            run_hours: 0.0,
            motor_turns: 0.0,
            address: "address 1".to_owned(),
            node: None,
            position_command: None,
            velocity_command: None,
            torque_command: None,
            current: None,
            bus_voltage: None,
            temperature: None,
        }
    }

    fn overview() -> Overview {
        let faulted = Axis {
            state: "faulted".to_owned(),
            cip_state: None,
            fault: Some("over_current".to_owned()),
            advice: Some("Check the supply.".to_owned()),
            drive_code: 0x2310,
            waits: Some("has waited 12 s for power".to_owned()),
            inhibits: vec!["no_power".to_owned(), "no_drive".to_owned()],
            position: -1_234.5,
            ..axis("slide", "mm")
        };
        Overview {
            format: FORMAT,
            name: "cell 4".to_owned(),
            version: "0.1.0".to_owned(),
            state: "running".to_owned(),
            silent: None,
            sercos_phase: Some(4),
            connections: 1,
            uptime_s: 7_384.2,
            cycles: Cycles {
                cycle_ns: 62_500,
                count: 1_234_567,
                late: 2,
                latest_ns: 83_400,
                lateness: Lateness::default(),
                phase_lock: "locked".to_owned(),
                phase_error_ns: -12,
                lost_updates: 3,
                lost_telegrams: 4,
                refused_frames: 5,
                send_failures: 6,
            },
            time: Time {
                source: "ptp".to_owned(),
                synchronized: true,
                state: "synchronized".to_owned(),
                grandmaster: Some("024142.fffe.000001".to_owned()),
                offset_ns: Some(-120),
                path_delay_ns: Some(3_400),
                error_bound_ns: Some(800),
                threshold_ns: 10_000,
                steps: 1,
            },
            devices: Vec::new(),
            buses: Vec::new(),
            axes: vec![axis("turntable", "rev"), faulted],
        }
    }

    #[test]
    fn a_person_sees_everything_on_one_screen() {
        insta::assert_snapshot!(text(&overview(), false));
    }

    #[test]
    fn a_cycle_thread_that_stands_is_shown() {
        let silent = "the cycle thread has published nothing for 5 s";
        let standing = Overview { silent: Some(silent.to_owned()), ..overview() };
        assert!(text(&standing, false).contains(&format!("\n{silent}\n")));
    }

    #[test]
    fn an_axis_that_lacks_only_a_controller_can_be_moved() {
        let said = |owner: &str, inhibits: &[&str]| {
            let inhibits = inhibits.iter().map(|inhibit| (*inhibit).to_owned()).collect();
            let axis = Axis { owner: owner.to_owned(), inhibits, ..axis("turntable", "rev") };
            let text = text(&Overview { axes: vec![axis], ..overview() }, false);
            text.lines().last().unwrap_or_default().trim().to_owned()
        };
        let waits = "waits for a controller; local control can move it";
        assert_eq!(said("nobody", &["configuration_incomplete"]), waits);
        let refused = "cannot be enabled: configuration_incomplete";
        assert_eq!(said("controller", &["configuration_incomplete"]), refused);
        let both = ["configuration_incomplete", "no_power"];
        assert_eq!(said("nobody", &both), "cannot be enabled: configuration_incomplete, no_power");
    }

    #[test]
    fn colours_mark_what_is_well_and_what_is_not() {
        let pulled = Cycles { phase_lock: "pulling".to_owned(), phase_error_ns: 76_445, ..overview().cycles };
        let shown = text(&Overview { cycles: pulled, ..overview() }, false);
        assert!(shown.contains("62.5 us, pulled to system time, 76445 ns off;"), "{shown}");
        let text = text(&overview(), true);
        assert!(text.contains("\x1b[32mrunning\x1b[0m") && text.contains("\x1b[32msynchronized\x1b[0m"));
        assert!(text.contains("\x1b[31mfault over_current, the drive says 0x2310\x1b[0m"), "{text}");
    }

    #[test]
    fn times_are_said_in_their_two_largest_parts() {
        for (seconds, said) in [
            (0.0, "0 s"),
            (59.9, "59 s"),
            (61.0, "1 min 1 s"),
            (7_384.0, "2 h 3 min"),
            (90_000.0, "1 d 1 h"),
            (f64::NAN, "0 s"),
        ] {
            assert_eq!(duration(seconds), said);
        }
    }
}
