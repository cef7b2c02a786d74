//! Odd peers: drives of the crate `axisbridge-peers`, written from the standards' facts by somebody who has not seen the product, with
//! everything about them that real drives are odd in. Each row says what the box has to do: work, or refuse with which words.
//!
//! A row works when the controller has the axis enabled, moved and disabled, and the drive itself says that it went. A row is
//! refused when the drive never was enabled and the box named it. The tables are snapshots, texts included.

mod backups;
mod canopen;
mod data_sheets;
mod devicenet;
mod sercos;

use axisbridge_tests::rig::Rig;
use axisbridge_tests::rig::motion::millis;
use profile_cip::controller::{AxisSet, Step};
use profile_cip::wire::motion::codes::ControlMode;

/// What became of a row.
pub struct Outcome {
    /// Whether it worked.
    pub works: bool,
    /// What the box said of it that matters: warnings, without what follows from them.
    pub said: Vec<String>,
}

/// The axis under test, and no other.
pub const AXIS: AxisSet = AxisSet::one(1);

/// Has the controller do this, and says whether all of it was done within so many milliseconds. `look` sees it go on.
pub fn does(
    rig: &mut Rig,
    mode: ControlMode,
    program: Vec<Step>,
    within: i64,
    mut look: impl FnMut(&Rig),
) -> bool {
    let steps = program.len();
    let mut config = rig.controller_config();
    config.axes[0].control_mode = mode;
    rig.connect_with(config, program);
    let mut left = within;
    while left > 0 && !(rig.report().failure.is_some() || rig.report().steps_finished >= steps) {
        rig.run_for(millis(10));
        left -= 10;
        look(rig);
    }
    rig.report().failure.is_none() && rig.report().steps_finished >= steps
}

/// The lines of the box that name the drive, each once, in their order.
pub fn said(rig: &Rig, names: &[&str]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let ordinary = [
        "is the expected device",
        "is in operation",
        "continues without reading",
        ": exchanging",
        "slaves found",
        "is in state consuming",
    ];
    let told = rig.told();
    let matters = |line: &&str| {
        names.iter().any(|name| line.contains(name)) && !ordinary.iter().any(|word| line.contains(word))
    };
    for line in told.lines().filter(matters) {
        if !lines.iter().any(|known| known == line) {
            lines.push(line.to_owned());
        }
    }
    lines
}

/// A table of rows as text: the name, what the box does, what it says.
pub fn table(rows: &[(String, Outcome)]) -> String {
    let mut text = String::new();
    for (name, outcome) in rows {
        let works = if outcome.works { "works" } else { "refused" };
        text.push_str(&format!("{name}: {works}\n"));
        for line in &outcome.said {
            text.push_str(&format!("    {line}\n"));
        }
    }
    println!(
        "{} rows, {} of them work",
        rows.len(),
        rows.iter().filter(|(_, outcome)| outcome.works).count()
    );
    text
}

/// Whether a single row is asked for by name in `ODD_ROW`, and it is not this one.
pub fn left_out(name: &str) -> bool {
    std::env::var("ODD_ROW").is_ok_and(|wanted| wanted != name)
}

/// Whether a single row is asked for: then it says everything.
pub fn is_wordy() -> bool {
    std::env::var_os("ODD_ROW").is_some()
}
