//! `axisbridge faults`: the faults that are present and those that were, over the local socket of a running gateway.

use std::fmt::Write as _;
use std::process::ExitCode;

use serde_json::json;

use super::gateway_client::GatewayClient;
use super::status::{self, PATIENCE};
use super::{CliError, FaultsArguments, print};
use crate::history::FaultRecord;
use crate::local::overview::Axis;
use crate::local::protocol::printable;

/// Version of the JSON object. It changes when a field gets another meaning, not when one is added.
const FORMAT: u32 = 1;

/// Shows the faults. The exit status is 0 when none is present.
pub fn run(arguments: &FaultsArguments) -> Result<ExitCode, CliError> {
    let mut client = GatewayClient::connect(&arguments.local, PATIENCE)?;
    let axis = arguments.axis.as_ref().map(|axis| format!(" {axis}")).unwrap_or_default();
    let reply = client.ask(&format!("faults{axis}"))?;
    reply.end("faults", "ok faults N")?;
    let history: Vec<FaultRecord> = reply.rows("fault")?.into_iter().map(|(_, record)| record).collect();
    let (_, overview) = status::ask(&mut client)?;
    let wanted = |axis: &&Axis| arguments.axis.as_ref().is_none_or(|name| axis.name == *name);
    let present: Vec<&Axis> =
        overview.axes.iter().filter(wanted).filter(|axis| axis.fault.is_some()).collect();
    let code = if present.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE };
    if arguments.json {
        return print(format!("{}\n", object(&present, &history)), code);
    }
    print(text(&present, &history), code)
}

/// Everything as one object.
fn object(present: &[&Axis], history: &[FaultRecord]) -> serde_json::Value {
    let present: Vec<_> = present
        .iter()
        .map(|axis| {
            json!({
                "axis": axis.name,
                "drive": axis.drive,
                "bus": axis.bus,
                "cause": axis.fault,
                "drive_code": axis.drive_code,
                "advice": axis.advice,
            })
        })
        .collect();
    json!({ "format": FORMAT, "present": present, "history": history })
}

/// Everything for a person.
fn text(present: &[&Axis], history: &[FaultRecord]) -> String {
    let mut out = String::new();
    if present.is_empty() {
        out.push_str("No fault is present.\n");
    } else {
        out.push_str("Present:\n");
    }
    for axis in present {
        let fault = axis.fault.as_deref().unwrap_or_default();
        let _ = writeln!(out, "  {}: {fault}{}", axis.name, code(axis.drive_code));
        if let Some(advice) = &axis.advice {
            let _ = writeln!(out, "    {advice}");
        }
    }
    if history.is_empty() {
        out.push_str("\nNo fault is in the history.\n");
        return out;
    }
    out.push_str("\nHistory, newest first:\n");
    for record in history {
        let FaultRecord { time, axis, drive, bus, cause, .. } = record;
        let _ = writeln!(out, "\n{time}  {axis}  {cause}");
        let mut row = |name: &str, text: &str| {
            let _ = writeln!(out, "  {name:<10}  {}", printable(text));
        };
        if let Some(text) = &record.gateway {
            row("gateway", text);
        }
        if let Some(text) = &record.controller {
            row("controller", text);
        }
        let says = record.drive_says.as_ref().map(|says| format!(", it reports {says}"));
        row("drive", &format!("{drive} on {bus}{}{}", code(record.drive_code), says.unwrap_or_default()));
        row("to do", &record.advice);
        match &record.end {
            None => row("end", "present"),
            Some(end) => {
                row(
                    "end",
                    &end.time.as_ref().map_or_else(|| end.by.clone(), |at| format!("{at}, {}", end.by)),
                );
            }
        }
    }
    out
}

/// The drive's own code, if it has one.
fn code(code: u32) -> String {
    if code == 0 { String::new() } else { format!(", the drive says {code:#06X}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::history::FaultEnd;
    use crate::local::overview::Overview;
    use crate::status::tests::distinct;
    use crate::time::status::tests::synchronized;

    fn record() -> FaultRecord {
        FaultRecord {
            number: 7,
            time: "2026-01-31T12:00:00.000000Z".to_owned(),
            axis: "turntable".to_owned(),
            drive: "drive-a".to_owned(),
            bus: "SERCOS".to_owned(),
            cause: "over_current".to_owned(),
            gateway: Some("over_current (axis fault, coast_and_disable)".to_owned()),
            controller: Some("Axis Fault 10 (over_current) in Running".to_owned()),
            drive_code: 0x2310,
            drive_says: Some("0xC00F0007 \"over\u{1b}current\"".to_owned()),
            advice: "Check the supply.".to_owned(),
            end: None,
        }
    }

    #[test]
    fn person_sees_present_faults_and_the_history_in_everybodys_words() {
        let installation = crate::local::installation::tests::installation();
        let overview = Overview::of(&installation, &distinct(), &synchronized());
        let present: Vec<&Axis> = overview.axes.iter().filter(|axis| axis.fault.is_some()).collect();
        let end =
            FaultEnd { time: Some("2026-01-31T12:00:09.000000Z".to_owned()), by: "Fault Reset".to_owned() };
        let ended = FaultRecord { number: 6, end: Some(end), drive_says: None, ..record() };
        let unseen = FaultEnd { time: None, by: "not seen".to_owned() };
        let lost = FaultRecord {
            gateway: None,
            controller: None,
            drive_code: 0,
            end: Some(unseen),
            ..ended.clone()
        };
        insta::assert_snapshot!(text(&present, &[record(), ended, lost]));
        assert_eq!(text(&[], &[]), "No fault is present.\n\nNo fault is in the history.\n");
        let object = object(&present, &[record()]);
        assert_eq!(object["history"][0]["end"], serde_json::Value::Null);
        assert_eq!((&object["format"], &object["present"][0]["axis"]), (&1.into(), &"slide".into()));
    }
}
