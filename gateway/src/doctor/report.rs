//! What the doctor has found, for people and for programs.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::{Check, Diagnosis, Verdict, latency};

/// Version of the JSON object.
const FORMAT: u32 = 1;

/// As lines of text: areas with their checks, then the cycles.
#[must_use]
pub fn text(diagnosis: &Diagnosis) -> String {
    let mut out = String::new();
    let mut area = "";
    for check in &diagnosis.checks {
        if check.area != area {
            area = check.area;
            let _ = writeln!(out, "{area}");
        }
        line(&mut out, check);
    }
    if !diagnosis.cycles.is_empty() {
        out.push_str("cycles\n");
    }
    for result in &diagnosis.cycles {
        cycle(&mut out, result);
    }
    let said = match diagnosis.verdict() {
        Verdict::Good => "this host is fit",
        Verdict::Doubtful => {
            "the gateway runs on this host, but not as well as it could: see what is doubtful"
        }
        Verdict::Unfit => "the gateway does not run on this host: see what is unfit",
    };
    let _ = writeln!(out, "\n{said}");
    out
}

fn line(out: &mut String, check: &Check) {
    let _ = writeln!(out, "  {:<9} {:<28} {}", check.verdict, check.what, check.found);
    if let Some(advice) = &check.advice {
        let _ = writeln!(out, "            -> {advice}");
    }
}

fn cycle(out: &mut String, result: &latency::Result) {
    let what = format!("{}, {}", result.cycle.time, result.cycle.what);
    let _ = writeln!(out, "  {:<9} {what}", result.verdict());
    let _ = writeln!(
        out,
        "            {} wake-ups, usually {} late, at most {}; {} cycles skipped",
        result.wakes(),
        result.usual,
        result.latest,
        result.skipped
    );
    let [p50, p99, p999] = [500, 990, 999].map(|permille| result.permille(permille));
    let _ = writeln!(
        out,
        "            deviation from the usual lateness: {p50} (p50), {p99} (p99), {p999} (p99.9)"
    );
    let _ = writeln!(out, "            -> {}", result.reason());
}

/// As one JSON object; times are nanoseconds.
#[must_use]
pub fn json(diagnosis: &Diagnosis) -> Value {
    let checks = diagnosis.checks.iter().map(|check| {
        json!({
            "area": check.area,
            "what": check.what,
            "verdict": check.verdict.name(),
            "found": check.found,
            "advice": check.advice,
        })
    });
    let cycles = diagnosis.cycles.iter().map(|result| {
        json!({
            "what": result.cycle.what,
            "verdict": result.verdict().name(),
            "reason": result.reason(),
            "cycle_time": result.cycle.time.as_nanos(),
            "tolerance": result.cycle.tolerance.as_nanos(),
            "allowed_losses": result.cycle.losses,
            "wakes": result.wakes(),
            "outside": result.outside(),
            "skipped": result.skipped,
            "usual_lateness": result.usual.as_nanos(),
            "latest": result.latest.as_nanos(),
            "p50": result.permille(500).as_nanos(),
            "p99": result.permille(990).as_nanos(),
            "p999": result.permille(999).as_nanos(),
        })
    });
    json!({
        "format": FORMAT,
        "verdict": diagnosis.verdict().name(),
        "checks": checks.collect::<Vec<_>>(),
        "cycles": cycles.collect::<Vec<_>>(),
    })
}
