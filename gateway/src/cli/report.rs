//! What a run of a controller comes to, for people and for programs.

use std::process::ExitCode;

use profile_cip::controller::Report;
use serde::Serialize;

use super::CliError;
use crate::simulate::program::AxisPlan;

/// One axis.
#[derive(Debug, Clone, Serialize)]
pub struct AxisResult {
    /// Instance number.
    pub axis: u8,
    /// Where it had to end, in its units.
    pub target: f64,
    /// Where it ended; `null` when it never ran.
    pub reached: Option<f64>,
    /// Largest distance between command and actual position at the same instant.
    pub max_following_error: f64,
    /// Updates that the controller sent.
    pub cycles: u64,
    /// Updates lost on the way, both directions.
    pub lost_updates: u64,
    /// Updates that came too late, both directions.
    pub late_updates: u64,
    /// How far from the target it may end.
    pub window: f64,
    /// Whether it did.
    pub in_window: bool,
}

impl AxisResult {
    /// The axes of a run.
    #[must_use]
    pub fn all(plans: &[AxisPlan], report: &Report) -> Vec<Self> {
        plans.iter().map(|plan| Self::new(plan, report)).collect()
    }

    fn new(plan: &AxisPlan, report: &Report) -> Self {
        let seen = report.axes.iter().find(|axis| axis.axis == plan.axis);
        let reached = seen.and_then(|axis| axis.reached);
        Self {
            axis: plan.axis,
            target: plan.target,
            reached,
            max_following_error: seen.map_or(0.0, |axis| axis.following_error_max),
            cycles: report.cycles,
            lost_updates: report.lost_updates + u64::from(report.device_lost_updates),
            late_updates: report.late_updates + u64::from(report.device_late_updates),
            window: plan.window,
            in_window: reached.is_some_and(|reached| (reached - plan.target).abs() <= plan.window),
        }
    }
}

/// A whole run.
#[derive(Debug, Clone, Serialize)]
pub struct RunResult {
    /// Its axes.
    pub axes: Vec<AxisResult>,
    /// The recording, if one was made.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub capture: Option<String>,
    /// Why it failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

impl RunResult {
    /// Prints it, and says with which status to end: success only if every axis reached its target and nothing failed.
    pub fn print(&self, json: bool) -> Result<ExitCode, CliError> {
        let good =
            self.failure.is_none() && !self.axes.is_empty() && self.axes.iter().all(|axis| axis.in_window);
        if json {
            println!("{}", serde_json::to_string(self)?);
        } else {
            println!("axis    commanded      reached  following error    cycles  lost  late");
            for axis in &self.axes {
                let reached =
                    axis.reached.map_or_else(|| "never ran".to_owned(), |reached| format!("{reached:.4}"));
                println!(
                    "{:>4}  {:>11.4}  {reached:>11}  {:>15.4}  {:>8}  {:>4}  {:>4}{}",
                    axis.axis,
                    axis.target,
                    axis.max_following_error,
                    axis.cycles,
                    axis.lost_updates,
                    axis.late_updates,
                    if axis.in_window { "" } else { "  not within its window" }
                );
            }
            if let Some(capture) = &self.capture {
                println!("recording: {capture}");
            }
        }
        if let Some(failure) = &self.failure {
            eprintln!("error: {failure}");
        }
        Ok(if good { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}

/// Why a run failed, with the step of its program.
#[must_use]
pub fn failure(report: &Report) -> Option<String> {
    let failure = report.failure.as_ref()?;
    Some(match report.failed_step {
        Some(step) => format!("step {} of the program: {failure}", step + 1),
        None => failure.to_string(),
    })
}
